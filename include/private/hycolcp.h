/* Complementarity problems as arrays and vectors: active set, Lemke's method, TAO, independent of the contact
   system. */
#ifndef HYCOLCP_H
#define HYCOLCP_H

#include <hycoconeimpl.h>
#include <hycoimpl.h>

/* Called after each iteration of an active set, on every rank: its number, active contacts, changes made. */
typedef PetscErrorCode (*HycoLCPMonitor)(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);

typedef enum { HYCO_LCP_SOLVED, HYCO_LCP_CYCLE, HYCO_LCP_SINGULAR, HYCO_LCP_LIMIT, HYCO_LCP_RAY } HycoLCPStatus;

/* -- the active set -- */

/*
  Functions of the problem that the active-set loop calls. `active` and `violates` hold this rank's n contacts, the
  first of which has the number `first`; comm: the ranks that share the contacts, MPI_COMM_NULL if every rank has all of
  them.
*/
typedef struct {
  MPI_Comm comm;
  PetscInt first, n, max_its;
  PetscBool one_by_one; /* after a set repeats, contacts change one at a time; otherwise a repeated set ends the loop */
  void *ctx;
  /* May be NULL. Called by the type of a Tao before the first solve, with the bounds of its solution, NULL: none. */
  PetscErrorCode (*bounds)(void *ctx, Vec lo, Vec hi);
  /* Solves with the contacts of the set closed and the others open. May remove contacts from the set that depend on
     others. */
  PetscErrorCode (*solve)(void *ctx, PetscBool active[], PetscBool *singular);
  /* Which contacts violate a condition in that solution: tension in the set, or penetration outside it. */
  PetscErrorCode (*violations)(void *ctx, const PetscBool active[], PetscBool violates[]);
  /* May be NULL. Called before each iteration, with `its` so far: *fresh if it has replaced the set. */
  PetscErrorCode (*restart)(void *ctx, PetscInt its, PetscBool active[], PetscBool *fresh);
  /* May be NULL. Called when no contact violates: *more if the next solve is more accurate, so that the loop must
     continue. */
  PetscErrorCode (*settled)(void *ctx, PetscBool *more);
  HycoLCPMonitor monitor; /* may be NULL */
  void *monitor_ctx;
} HycoActiveSet;
/* Runs from `active` to the last set; solved: no contact violates a condition. Collective on comm. */
PetscErrorCode HycoActiveSetRun(const HycoActiveSet *set, PetscBool active[], PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, to detect repeated ones. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

/* -- dense complementarity, w = q + M z >= 0, z >= 0, w.z = 0; all replicated -- */

/*
  Factors the triangle ("L" or "U", by columns) of the symmetric n x n matrix A; *regular: no pivot is round-off beside
  its diagonal entry, or beside scale[n].
*/
PetscErrorCode HycoCholesky(const char triangle[], PetscInt n, PetscReal A[], const PetscReal scale[],
                            PetscBool *regular);
/*
  The Cholesky factor of M_aa, M symmetric n x n, updated from one set and one right-hand side to the next, until
  HycoSetFactorForget() after a change of M (NULL-safe). HycoSetFactorSolve(): z_a = -M_aa^-1 q_a, 0 elsewhere;
  *regular: no pivot was below `tol` of M's diagonal entry, and z is finite. The contacts are ordered by the time at
  which they joined, so that z depends on the history by round-off.
*/
typedef struct _n_HycoSetFactor *HycoSetFactor;
PetscErrorCode HycoSetFactorCreate(PetscInt n, HycoSetFactor *factor);
PetscErrorCode HycoSetFactorDestroy(HycoSetFactor *factor);
void HycoSetFactorForget(HycoSetFactor factor);
PetscErrorCode HycoSetFactorSolve(HycoSetFactor factor, const PetscReal M[], const PetscReal q[], PetscInt k,
                                  const PetscInt a[], PetscReal tol, PetscReal z[], PetscBool *regular);
/*
  The factor of semismooth Newton's method, kept from one problem to the next while M, its free unknowns and the rows of
  its blocks are the same; HycoConeFactorForget() after a change of M. NULL-safe.
*/
typedef struct _n_HycoConeFactor *HycoConeFactor;
PetscErrorCode HycoConeFactorCreate(HycoConeFactor *factor);
PetscErrorCode HycoConeFactorDestroy(HycoConeFactor *factor);
void HycoConeFactorForget(HycoConeFactor factor);
/* The same blocks as of the last solve, where those are gone. Borrowed. */
void HycoConeFactorSetBlocks(HycoConeFactor factor, const HycoBlocks *blocks);
/* After a solve with this factor: the sign of the determinant of J at the solution, as HycoLCP's; dz (p + n, k
   columns), the derivative of the solution where q changes by dq, on the pieces of the laws at the solution. *regular:
   it has one. */
PetscErrorCode HycoConeFactorSign(HycoConeFactor factor, PetscInt *sign);
PetscErrorCode HycoConeFactorTangent(HycoConeFactor factor, PetscInt k, const PetscReal dq[], PetscReal dz[],
                                     PetscBool *regular);
/* These pieces: n numbers, borrowed until the next solve. */
void HycoConeFactorGetPieces(HycoConeFactor factor, PetscInt *n, const PetscReal *pieces[]);
/*
  A dense problem: M column major, n x n. `symmetric`: M is positive semidefinite; then `factor` may be that of M's last
  set, or one after HycoSetFactorForget(); NULL: each set is factored anew. With p free unknowns before the n contacts
  (floating bodies) z = (x_pinned, L), M and q as returned by HycoDirectFactor() and HycoDirectReduce(). `blocks`: the
  laws of z and w, for HYCO_TAO_CONES types only; NULL: z, w >= 0. All is borrowed.
*/
typedef struct {
  PetscInt n, p;
  const PetscReal *M, *q;
  PetscBool symmetric, springs; /* springs: the block of the free unknowns is that of springs, not round-off */
  HycoSetFactor factor;
  const HycoBlocks *blocks;
  HycoConeFactor cone; /* of HYCO_TAO_CONES types; NULL: none is kept */
  PetscBool warm;      /* HYCO_TAO_CONES types start from the last solution of their Tao */
  PetscBool given;     /* these start from z instead, */
  const PetscReal
      *other;         /* or (NULL: none; without free unknowns) from these forces, where their residual is smaller */
  PetscReal rounding; /* of the loads on the free unknowns: what no forces need to balance */
  PetscInt *sign;     /* NULL, or from these: the sign of the determinant of J at the solution; 0: not known */
  PetscInt max_its;   /* iterations of the active set; 0: 50 + 4 n */
  HycoLCPMonitor monitor;
  void *monitor_ctx;
} HycoLCP;
/*
  Moves the p free unknowns x of an N x N problem without forces by as little as possible, such that the slack of no row
  row[0..n) is negative. *exists false: no motion does that, and x is unchanged. Not collective.
*/
PetscErrorCode HycoLCPUnload(PetscInt N, PetscInt p, PetscInt n, const PetscInt row[], const PetscReal M[],
                             const PetscReal q[], PetscReal x[], PetscBool *exists);
/*
  The active set method from `active`, which returns the last set. Contacts that repeat others carry no force and leave
  the set. The status is SINGULAR if their gaps contradict each other and choosing the smaller ones does not resolve it,
  or if contact does not hold floating bodies under this load.
*/
PetscErrorCode HycoLCPActiveSet(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status);
/* The same with p > 0 free unknowns. */
PetscErrorCode HycoLCPSemidefinite(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                   HycoLCPStatus *status);
/* A method for forces alone, for the problem of bodies that springs hold: from L; adds to *its. soft: the springs'
   stiffness relative to that of the contacts. */
typedef struct {
  PetscErrorCode (*solve)(void *ctx, const HycoLCP *held, PetscReal L[], PetscInt *its);
  void *ctx;
  PetscReal soft;
} HycoHeldMethod;
/* The same by the proximal point method, M symmetric, from the set `active`; adds to *its. RAY: no contact forces
   balance the load; L is then a best approximation. method NULL: by the active set. */
PetscErrorCode HycoLCPProximal(const HycoLCP *lcp, const HycoHeldMethod *method, PetscBool active[], PetscReal z[],
                               PetscInt *its, HycoLCPStatus *status);
/*
  z with M_aa z_a = -q_a on the set a[0..*k), 0 elsewhere. Members that depend on others are removed from a (their z is
  0), and *k decreases. *singular: the remaining set could not be solved either. `factor` as in HycoLCPActiveSet().
*/
PetscErrorCode HycoLCPSolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                 HycoSetFactor factor, PetscInt *k, PetscInt a[], PetscReal z[], PetscBool *singular);
/* The rank of a symmetric positive semidefinite matrix (k x k, overwritten), scaled to a unit diagonal, with
   tolerance 1e-12. */
PetscErrorCode HycoGramRank(PetscInt k, PetscReal A[], PetscInt *rank);
/* Of the largest displacement of a contact along a rigid motion: below, it is round-off of normals, which are
   differences of coordinates, eps of the mesh over a facet (tests/contact/friction.py: test_shrunk). */
#define HYCO_TANGENTIAL 1e-12
/* That displacement, of the i-th of p motions in M (N x N, by columns), tangents included. */
PetscReal HycoMotionReach(PetscInt N, PetscInt p, const PetscReal M[], PetscInt i);
/* Sets to 0 the entries of p rigid motions in M (p + n, by columns) that are round-off of normals: by reach[i], which
   is that of these rows and of those left out of M. */
void HycoMotionsRound(PetscInt p, PetscInt n, const PetscReal reach[], PetscReal M[]);
/*
  Whether forces of the blocks balance a load f on p motions, A r = f with A (p x rows, by columns); if not, r are those
  that come nearest. Less than `rounding` of f need not be balanced. True where it is not decided, as for laws other
  than Coulomb's. Not collective.
*/
PetscErrorCode HycoBlocksBalance(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal f[],
                                 PetscReal rounding, PetscReal r[], PetscBool *exists);
/* The same for n contacts without other laws: forces r >= 0. */
PetscErrorCode HycoNormalsBalance(PetscInt p, PetscInt n, const PetscReal A[], const PetscReal f[], PetscReal rounding,
                                  PetscReal r[], PetscBool *exists);
/* Where none do: adds normal forces to r, so that f - A r is a motion along which no contact opens: the bodies slide by
   it. */
PetscErrorCode HycoBlocksLeaveSlide(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal f[],
                                    PetscReal r[]);
/* Whether the law of a block, Coulomb's, has friction: its coefficient is above 0. */
PetscBool HycoBlockHasFriction(const HycoBlocks *blocks, PetscInt k);
/* Of p motions with the rows A (p x rows by columns), those which neither the normal forces of r nor its tangential
   ones that stick hold: their number, 0 without any force, and the first of them (p). */
PetscErrorCode HycoBlocksFreeMotions(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal r[],
                                     PetscInt *n, PetscReal first[]);
/*
  Coulomb's law: x[p], the change of the p motions after a step with the slacks w and the forces r (by row) along the n
  motions that no force acts on, by which the contacts slip least in the step and no gap becomes negative; move[p]: the
  motions' change in the step. first[p]: one of the n. A as above; w changes by -A^T x. Not collective.
*/
PetscErrorCode HycoBlocksLeastSlip(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal w[],
                                   const PetscReal r[], const PetscReal move[], PetscReal x[], PetscInt *n,
                                   PetscReal first[]);
/* Semismooth Newton's method for blocks of any cone, z = P(z - rho w), w = q + M z, from z = (x_pinned, forces). */
PetscErrorCode HycoLCPSemismooth(const HycoLCP *lcp, PetscReal z[], PetscInt *its, HycoLCPStatus *status);
/*
  After a solve with `lcp`'s cone, of which z is the solution, and w = q + M z (p + n): dz and dw where q changes by dq
  (overwritten) and the coefficients of friction by dmu, by block. before[n]: the forces before the step, which decide
  where floating bodies without loads are; size: of gaps and displacements of the contacts. *regular false: the solution
  has no derivative, as where the contacts do not determine it, or change their states.
*/
PetscErrorCode HycoConeTangent(const HycoLCP *lcp, const PetscReal before[], const PetscReal z[], const PetscReal w[],
                               PetscReal size, const PetscReal dmu[], PetscReal dq[], PetscReal dz[], PetscReal dw[],
                               PetscBool *regular);
/* y += M x; columns of zero entries are skipped. */
PetscErrorCode HycoAddDenseProduct(PetscInt n, const PetscReal M[], const PetscReal x[], PetscReal y[]);
/* Writes a problem with Coulomb's law, its solution z and a start (both p + n) in FCLIB's layout `fclib_local`; dim:
   components of a contact there, 2 or 3. On one process. */
PetscErrorCode HycoLCPWriteFclib(const HycoLCP *lcp, PetscInt dim, const PetscReal z[], const PetscReal start[],
                                 const char path[]);
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);
/* The same with p > 0 free unknowns. */
PetscErrorCode HycoLCPLemkeFree(const HycoLCP *lcp, PetscInt max_its, PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status);

/* -- the derivative of a dense problem's solution -- */

typedef struct _n_HycoTangent *HycoTangent;
/* Whether a contact is closed or undecided, when its flexibility is not known. */
PetscBool HycoTangentMayClose(PetscReal L, PetscReal w, PetscReal size);
/* Why there is no derivative where the matrix is singular and no contact has a force. */
#define HYCO_TANGENT_UNPRESSED                                                                                         \
  "no load presses a body here that contact alone holds, so that its position has no derivative; take a point at "     \
  "which it carries a load"
/* The derivative with p free unknowns x before the n contacts, M as in HycoLCP (read now). rigid: they are rigid
   motions, without stiffness. A contact of force L and gap w is undecided if both are near zero, the force by the
   displacement that it causes; where the others do not determine the solution, forces above round-off close it. size:
   of the gaps or of the displacements of the contacts. *regular: the closed contacts determine their forces; otherwise
   only HycoTangentDestroy() (NULL-safe) may be called. */
PetscErrorCode HycoTangentCreate(PetscInt p, PetscBool rigid, PetscInt n, const PetscReal M[], const PetscReal L[],
                                 const PetscReal w[], PetscReal size, HycoTangent *tangent, PetscBool *regular);
PetscErrorCode HycoTangentDestroy(HycoTangent *tangent);
/* Undecided contacts whose rows do not depend on closed ones. */
PetscInt HycoTangentUndecided(HycoTangent tangent);
/* z' (p + n) where q changes by q' (p + n). *kink: undecided contacts make it one-sided; it is that for a change of q
   in the direction sign (1 or -1) times q'. */
PetscErrorCode HycoTangentSolve(HycoTangent tangent, const PetscReal q[], int sign, PetscReal z[], PetscBool *kink);

/* -- problems solved by a Tao -- */

#define HYCO_TAO_NAME              64
#define HYCO_TAO_BNLS              "bnls"
#define HYCO_TAO_SEMISMOOTH_NEWTON "hyco_semismooth"

/* Properties and requirements of a Tao type; 0: one that a program has registered. */
enum {
  HYCO_TAO_SYMMETRIC = 1,  /* bound-constrained: H symmetric */
  HYCO_TAO_DENSE = 2,      /* the dense matrix of the dual form */
  HYCO_TAO_ENTRIES = 4,    /* reads H's entries */
  HYCO_TAO_SEMISMOOTH = 8, /* solves the complementarity problem of z and w */
  HYCO_TAO_NEWTON = 16,    /* converges quadratically */
  HYCO_TAO_RESTARTS = 32,  /* may succeed from a second start after it has stalled */
  HYCO_TAO_OWN = 64,       /* one of hyco's types: takes the problem unscaled */
  HYCO_TAO_CONES = 128     /* solves with blocks of any cone; the others know z >= 0 only */
};
int HycoTaoTraits(const char type[]);
/* The error of the last solve by a type of TAO's, "": none. Of the process. */
const char *HycoTaoFailure(void);
/* The type's registered name, empty for an unknown one; list: TAO's types that are suitable for contact. */
PetscErrorCode HycoTaoFindType(const char type[], char name[HYCO_TAO_NAME], char list[HYCO_LINE]);

/* A Tao, kept from one problem to the next; its options are -hyco_tao_..., after the prefix of its owner. */
typedef struct _n_HycoTao *HycoTao;
/* Collective, as all functions below. `owner` (borrowed, may be NULL): if each of its ranks solves a problem alone
   (comm: PETSC_COMM_SELF), the first rank prints the output of -hyco_tao_monitor and similar options. */
PetscErrorCode HycoTaoCreate(MPI_Comm comm, PetscObject owner, HycoTao *tao);
/* NULL-safe. */
PetscErrorCode HycoTaoDestroy(HycoTao *tao);
/* max_its 0: 2000, or for hyco's types a number that depends on the number of contacts. */
PetscErrorCode HycoTaoSetType(HycoTao tao, const char type[], PetscInt max_its);
/*
  min 1/2 y^T H y - f^T y, lo <= y <= hi, by any type but hyco's, H symmetric; or w = H y - f >= 0, y >= 0, w.y = 0 by a
  semismooth one, lo = 0, hi infinite, H assembled. Starts from y. H, f, lo, hi are scaled in place and cannot be used
  again. An error inside TAO is caught: *solved is false.
*/
PetscErrorCode HycoTaoSolve(HycoTao tao, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its, PetscBool *solved);
/* By HYCO_TAO_ACTIVE_SET; y: the vector that the set's functions compute, y <= hi (referenced). */
PetscErrorCode HycoTaoSolveSet(HycoTao tao, const HycoActiveSet *set, PetscBool active[], Vec hi, Vec y, PetscInt *its,
                               HycoLCPStatus *status);
/* A dense problem by any type; hyco's active set starts from `active` and returns it, the others leave it unchanged.
   With free unknowns TAO's types need a symmetric problem: they solve that of bodies held by springs, which move. */
PetscErrorCode HycoTaoSolveLCP(HycoTao tao, const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                               PetscBool *solved);
/*
  Whether x solves min |A x - b|_2, x >= 0 (A: m x n column major): no entry negative, and each of the gradient A^T (b -
  A x) within rtol of its column's length times |b| (where x is 0: not above it). `residual`, |A x - b|, may be NULL.
  Not collective.
*/
PetscErrorCode HycoNNLSCheck(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const PetscReal x[],
                             PetscReal rtol, PetscReal *residual, PetscBool *solved);
/*
  The same problem by a bound-constrained TAO type on the normal equations; *solved as computed by HycoNNLSCheck(). Not
  collective.
*/
PetscErrorCode HycoTaoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const char type[],
                           PetscReal rtol, PetscReal x[], PetscReal *residual, PetscBool *solved);
#endif
