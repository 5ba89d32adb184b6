/* Complementarity problems as arrays and vectors: the active set, Lemke's method, TAO. They know no contact system. */
#ifndef HYCOLCP_H
#define HYCOLCP_H

#include <hycoimpl.h>

/* Called after each iteration of an active set, on every rank: its number, active contacts, changes made. */
typedef PetscErrorCode (*HycoLCPMonitor)(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);

typedef enum { HYCO_LCP_SOLVED, HYCO_LCP_CYCLE, HYCO_LCP_SINGULAR, HYCO_LCP_LIMIT, HYCO_LCP_RAY } HycoLCPStatus;

/* -- the active set -- */

/*
  What the loop asks of those who use it. `active` and `violates` hold this rank's n contacts, the first of which has
  the number `first`; comm: the ranks that share the contacts, MPI_COMM_NULL where every rank has them all.
*/
typedef struct {
  MPI_Comm comm;
  PetscInt first, n, max_its;
  PetscBool one_by_one; /* a set that comes back lets contacts change singly from then on; else it ends the loop */
  void *ctx;
  /* Solves with the contacts of the set closed, the others open. Some may leave the set as dependent on others. */
  PetscErrorCode (*solve)(void *ctx, PetscBool active[], PetscBool *singular);
  /* Which contacts violate in that solution: pull in the set, or penetrate outside. */
  PetscErrorCode (*violations)(void *ctx, const PetscBool active[], PetscBool violates[]);
  /* May be NULL. Before each iteration, `its` so far: *fresh where it has put another set in place. */
  PetscErrorCode (*restart)(void *ctx, PetscInt its, PetscBool active[], PetscBool *fresh);
  /* May be NULL. No contact violates: *more where the next solve is more accurate, so that the loop goes on. */
  PetscErrorCode (*settled)(void *ctx, PetscBool *more);
  HycoLCPMonitor monitor; /* may be NULL */
  void *monitor_ctx;
} HycoActiveSet;
/* From `active` to the last set; solved: no contact violates it. Collective on comm. */
PetscErrorCode HycoActiveSetRun(const HycoActiveSet *set, PetscBool active[], PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, for finding those that come back. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

/* -- dense complementarity, w = q + M z >= 0, z >= 0, w.z = 0; all replicated -- */

/*
  The Cholesky factor of M_aa, M symmetric n x n, kept from one set and one right-hand side to the next until M changes
  and it is forgotten (NULL-safe). HycoSetFactorSolve(): z_a = -M_aa^-1 q_a, 0 elsewhere; *regular: no pivot was below
  `tol` of M's diagonal entry, and z is finite. The contacts stand in the order in which they joined, so that z depends
  on the past by round-off.
*/
typedef struct _n_HycoSetFactor *HycoSetFactor;
PetscErrorCode HycoSetFactorCreate(PetscInt n, HycoSetFactor *factor);
PetscErrorCode HycoSetFactorDestroy(HycoSetFactor *factor);
void HycoSetFactorForget(HycoSetFactor factor);
PetscErrorCode HycoSetFactorSolve(HycoSetFactor factor, const PetscReal M[], const PetscReal q[], PetscInt k,
                                  const PetscInt a[], PetscReal tol, PetscReal z[], PetscBool *regular);
/*
  A dense problem: M column major, n x n. `symmetric`: it is positive semidefinite; then `factor` may be that of M's
  last set, or one that was forgotten; NULL: each set is factored anew. With p free unknowns before the n contacts
  (floating bodies) z = (x_pinned, L), M and q as HycoDirectFactor() and HycoDirectReduce() give them. All is borrowed.
*/
typedef struct {
  PetscInt n, p;
  const PetscReal *M, *q;
  PetscBool symmetric;
  HycoSetFactor factor;
  PetscInt max_its; /* of the active set; 0: 50 + 4 n */
  HycoLCPMonitor monitor;
  void *monitor_ctx;
} HycoLCP;
/*
  The active set from `active`, which returns the last set. Contacts that repeat others carry no force and leave the
  set; when their gaps contradict each other and the choice of the smaller ones does not end it, the status is SINGULAR.
  So it is where contact does not hold floating bodies under this load.
*/
PetscErrorCode HycoLCPActiveSet(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status);
/* The same with p > 0 free unknowns. */
PetscErrorCode HycoLCPSemidefinite(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                   HycoLCPStatus *status);
/*
  z with M_aa z_a = -q_a on the set a[0..*k), 0 elsewhere. Members that depend on others leave a (their z is 0), and *k
  becomes smaller. *singular: even the rest could not be solved. `factor` as HycoLCPActiveSet()'s.
*/
PetscErrorCode HycoLCPSolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                 HycoSetFactor factor, PetscInt *k, PetscInt a[], PetscReal z[], PetscBool *singular);
/* The rank of a symmetric positive semidefinite matrix (k x k, overwritten), scaled to a unit
   diagonal, to 1e-12. */
PetscErrorCode HycoGramRank(PetscInt k, PetscReal A[], PetscInt *rank);
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);

/* -- problems posed to a Tao -- */

#define HYCO_TAO_NAME       64
#define HYCO_TAO_ACTIVE_SET "hyco_active_set"
#define HYCO_TAO_LEMKE      "hyco_lemke"
#define HYCO_TAO_BNLS       "bnls"

/* What a type of Tao is and needs; 0: one that a program has registered. */
enum {
  HYCO_TAO_SYMMETRIC = 1,  /* bound-constrained: H symmetric */
  HYCO_TAO_DENSE = 2,      /* the dense matrix of the dual form */
  HYCO_TAO_ENTRIES = 4,    /* reads H's entries */
  HYCO_TAO_SEMISMOOTH = 8, /* poses it as complementarity of z and w */
  HYCO_TAO_NEWTON = 16,    /* converges quadratically */
  HYCO_TAO_RESTARTS = 32,  /* comes through from a second start where it stood still */
  HYCO_TAO_OWN = 64        /* hyco's: takes the problem as it is, unscaled */
};
int HycoTaoTraits(const char type[]);
/* The type's name as registered, empty for an unknown one; list: TAO's types that suit contact. */
PetscErrorCode HycoTaoFindType(const char type[], char name[HYCO_TAO_NAME], char list[HYCO_LINE]);
/* Registers hyco's types beside TAO's. */
PetscErrorCode HycoTaoRegisterAll(void);

/* A Tao, kept between problems; its options are -hyco_tao_..., behind the prefix of its owner. */
typedef struct _n_HycoTao *HycoTao;
/* Collective, as all that follows. `owner` (borrowed, may be NULL): of a problem that each of its ranks solves alone
   (comm: PETSC_COMM_SELF) the first one prints what -hyco_tao_monitor and its like ask for. */
PetscErrorCode HycoTaoCreate(MPI_Comm comm, PetscObject owner, HycoTao *tao);
/* NULL-safe. */
PetscErrorCode HycoTaoDestroy(HycoTao *tao);
/* max_its 0: 2000, or of hyco's types by the number of contacts. */
PetscErrorCode HycoTaoSetType(HycoTao tao, const char type[], PetscInt max_its);
/*
  min 1/2 y^T H y - f^T y, lo <= y <= hi, by any type but hyco's, H symmetric; or w = H y - f >= 0, y >= 0, w.y = 0
  by a semismooth one, lo = 0, hi infinite, H assembled. Begins at y. H, f, lo, hi are scaled in place: they serve once.
  An error inside TAO is caught: *solved is false.
*/
PetscErrorCode HycoTaoSolve(HycoTao tao, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its, PetscBool *solved);
/* By HYCO_TAO_ACTIVE_SET; y: what the set's functions solve for. */
PetscErrorCode HycoTaoSolveSet(HycoTao tao, const HycoActiveSet *set, PetscBool active[], Vec y, PetscInt *its,
                               HycoLCPStatus *status);
/* A dense problem by any type; hyco's active set begins at `active` and returns it, the others leave it alone. */
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
  The same problem by a bound-constrained TAO type on the normal equations; *solved is HycoNNLSCheck()'s. Not
  collective.
*/
PetscErrorCode HycoTaoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const char type[],
                           PetscReal rtol, PetscReal x[], PetscReal *residual, PetscBool *solved);
#endif
