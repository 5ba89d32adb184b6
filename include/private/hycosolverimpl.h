/* The contact system and its solver, inside. */
#ifndef HYCOSOLVERIMPL_H
#define HYCOSOLVERIMPL_H

#include <hycoimpl.h>
#include <hycosolver.h>
#include <petscksp.h>

struct _p_HycoSystem {
  MPI_Comm comm;
  Mat K, Bt, B; /* referenced */
  Vec F, D;     /* referenced */
  PetscBool symmetric;
  PetscInt n, m; /* unknowns, contacts */
};

/* What a form keeps between solves while K and B stay as they are. */
typedef struct {
  PetscObjectId K, B; /* 0: none */
  PetscObjectState K_state, B_state;
} HycoSeen;

typedef struct _n_HycoDirect *HycoDirect;

struct _p_HycoSolver {
  MPI_Comm comm;
  /* user parameters */
  HycoSystem system; /* borrowed */
  PetscInt type;     /* index in HycoSolverTypes */
  HycoForm form;
  PetscReal rtol;
  PetscInt max_its;
  PetscBool warm, fallback, multilevel;
  HycoLinear linear;
  PetscReal memory;         /* bytes that factors may take, all ranks together; 0: most of what is free */
  PetscBool iterative;      /* chosen: solve with K iteratively */
  PetscObjectId chosen_for; /* the K that it was chosen for */
  char linear_method[128], why_iterative[96];
  PetscInt tao_type; /* index in HycoTaoTypes; HYCO_TAO_AUTO: by the problem */
  HycoMonitor monitor;
  void *monitor_ctx;
  /* factor of K (dual) */
  HycoDirect direct; /* sparse */
  PetscReal bytes;   /* estimated for it, all ranks together */
  PetscReal *lu;     /* dense: LAPACK's factors, column major n x n */
  PetscBLASInt *ipiv, n_lu;
  /* dual form, replicated on every rank: column-major m x m flexibility, gap without forces */
  PetscInt m, p; /* contacts; unknowns pinned because K is singular: they come before the contacts in S, g and L */
  PetscReal *S, *g, *L;
  PetscBool *active;
  PetscBool started; /* active holds a solution's set */
  HycoSeen condensed;
  /* primal form in gap coordinates */
  Mat T, Kg, Kw;
  KSP ksp_gap;
  PetscInt *pivot, *contact, n_pivots; /* this rank's contacts' pivot unknowns, the contacts' numbers on this rank */
  HycoSeen transformed;
  /* dual form without its matrix */
  HycoDirect direct_free;
  HycoSeen factored_free;
  /* the last solve */
  PetscInt tao; /* the type that serves its system */
  HycoReason reason;
  HycoKKT kkt;
  PetscInt its;
  char method[128];
  PetscReal seconds_factor, seconds_solve;
};

extern const char *const HycoSolverTypes[]; /* active_set, tao, lemke, NULL */
enum { HYCO_TYPE_ACTIVE_SET, HYCO_TYPE_TAO, HYCO_TYPE_LEMKE };

/* Whether K and B are those last seen, unchanged; then remember them. */
PetscErrorCode HycoSeenUpdate(HycoSeen *seen, Mat K, Mat B, PetscBool *same);
/* A direct solver for a sparse K: MUMPS on several ranks or large, PETSc's own when small or thin. Cholesky when
   symmetric. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp);

/* -- the direct solver of the dual form; all calls collective on its communicator -- */

PetscErrorCode HycoDirectCreate(MPI_Comm comm, HycoDirect *direct);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoDirectDestroy(HycoDirect *direct);
/* Leaves as many unknowns as K has a kernel to the dense problem, z = (x_pinned, L). */
PetscErrorCode HycoDirectPinKernel(HycoDirect direct, Mat K);
/* Orders and analyses [K Bt; B 0] (B and Bt may be NULL) unless the pattern is the last one's; bytes: what the factor
   is estimated to take on all ranks together. */
PetscErrorCode HycoDirectAnalyse(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscBool symmetric, PetscReal *bytes);
/* Factors, after HycoDirectAnalyse() with the same matrices: S = B K^-1 Bt, m x m, column major, on every rank. */
PetscErrorCode HycoDirectFactor(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscReal S[], PetscBool *singular);
/* g = D - B K^-1 F on every rank; D (length m) is read on rank 0. */
PetscErrorCode HycoDirectReduce(HycoDirect direct, Vec F, const PetscReal D[], PetscReal g[]);
/* x = K^-1 (F - Bt L) with the F of the last HycoDirectReduce(); L (length m) is read on rank 0. */
PetscErrorCode HycoDirectExpand(HycoDirect direct, const PetscReal L[], Vec x);
/* x = K^-1 r */
PetscErrorCode HycoDirectSolve(HycoDirect direct, Vec r, Vec x);

/* -- a singular K -- */

/* How many motions the attached kernel of K has (0: none is attached). */
PetscErrorCode HycoKernelSize(Mat K, PetscInt *n);
/* As many unknowns, ascending, without which K is regular; the same on every rank. Collective. */
PetscErrorCode HycoKernelPins(MPI_Comm comm, Mat K, PetscInt n, PetscInt pinned[]);

/* place[i] on rank 0: position of unknown i (of n) in a fill-reducing order of K. Collective. */
PetscErrorCode HycoDissection(MPI_Comm comm, Mat K, PetscInt place[]);

/* Conjugate gradients with algebraic multigrid for a sparse, symmetric K, from the last solution. */
PetscErrorCode HycoIterativeSolver(MPI_Comm comm, const char prefix[], Mat K, KSP *ksp);
/* K x = F without contact. */
PetscErrorCode HycoSolveIterative(HycoSolver s, Vec x, PetscBool *solved);
/* Says in linear_method what solves with K. */
PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp);
/* Chooses between a factor and iterations (s->iterative), which need the primal form. */
PetscErrorCode HycoChooseLinear(HycoSolver s, HycoForm *form);
extern const char *const HycoLinearNames[];
/* Attaches K's near-kernel (MatSetNearNullSpace()) to Kw, in gap coordinates. Collective. */
PetscErrorCode HycoGapNearKernel(HycoSolver s, Mat Kw);
/* Whether K has so short an envelope in reverse Cuthill-McKee order that its factor hardly fills; on several ranks only
   a line's has. Collective. */
PetscErrorCode HycoThin(Mat K, PetscBool *thin);
/* Sets up a PCCHOLESKY for such a K. Collective. */
PetscErrorCode HycoThinSolver(PC pc);
/* Factors the operators of such a solver, with more workspace when MUMPS asks for it. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular);

/* The forms: fill x and L, set its and method; *solved says whether the method finished by its own account. */
PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
PetscErrorCode HycoSolvePrimal(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
/* Whether gap coordinates exist: each contact row has an unknown that no other row has. Collective. */
PetscErrorCode HycoPrimalPossible(HycoSystem system, PetscBool *possible);

/* TAO's types that hyco knows, by the index that the functions below take; from HYCO_TAO_SEMISMOOTH on semismooth. */
extern const char *const HycoTaoTypes[];
enum { HYCO_TAO_AUTO = -1, HYCO_TAO_GPCG = 0, HYCO_TAO_BLMVM = 5, HYCO_TAO_BQPIP = 11, HYCO_TAO_SEMISMOOTH = 12 };
PetscBool HycoTaoSemismooth(PetscInt type);
/*
  min 1/2 y^T H y - f^T y, lo <= y <= hi, by a bound-constrained type, H symmetric; or w = H y - f >= 0, y >= 0, w.y = 0
  by a semismooth one, lo = 0, hi infinite, H assembled. Begins at y. H, f, lo, hi are scaled in place: they serve once.
  max_its 0: 2000. An error inside TAO is caught: *solved is false. Further options by -hyco_tao_. Collective.
*/
PetscErrorCode HycoTaoSolve(PetscInt type, PetscInt max_its, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its,
                            PetscBool *solved);
/* The same on dense, replicated arrays: w = q + M z >= 0, z >= 0, w.z = 0; M column major n x n. */
PetscErrorCode HycoTaoLCP(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric, PetscInt type,
                          PetscInt max_its, PetscReal z[], PetscInt *its, PetscBool *solved);
/* The dual form by TAO with S = B K^-1 Bt never formed (form dual_free). */
PetscErrorCode HycoSolveDualFree(HycoSolver s, Vec x, Vec L, PetscBool *solved);

/*
  Gap coordinates. HycoGapWork() prepares Kw, a copy of Kg that keeps its pattern; HycoSolveOnSet() solves Kg y = f with
  y = d at this rank's n rows a[], through Kw, its solver and rhs. Collective.
*/
PetscErrorCode HycoGapWork(Mat Kw);
PetscErrorCode HycoSolveOnSet(Mat Kg, Mat Kw, KSP ksp, Vec f, PetscInt n, const PetscInt a[], const PetscReal d[],
                              Vec rhs, Vec y, PetscBool *singular);
/*
  Where the active set of min 1/2 y^T K y - f^T y, y <= bound (PETSC_INFINITY: none) starts: set is 1 at its bound, else
  0; *made says whether K has what the coarser problems need, else set is not touched. Collective.
*/
PetscErrorCode HycoMultilevelStart(Mat K, Vec f, Vec bound, Vec set, PetscBool *made);
/* Whether a held unknown pulls at its bound, or a free one is past it, beyond round-off. `largest` is the largest
   force, `size` the largest gap or displacement, `diagonal` the unknown's own stiffness. */
static inline PetscBool HycoPulls(PetscReal force, PetscReal largest, PetscReal diagonal, PetscReal bound)
{
  return (PetscBool)(force < -1e-12 * largest - 16 * PETSC_MACHINE_EPSILON * diagonal * PetscAbsReal(bound));
}
static inline PetscBool HycoPenetrates(PetscReal value, PetscReal bound, PetscReal size)
{
  return (PetscBool)(value > bound + 1e-14 * size);
}

/* -- dense complementarity, w = q + M z >= 0, z >= 0, w.z = 0; M column major n x n; all replicated -- */

typedef enum { HYCO_LCP_SOLVED, HYCO_LCP_CYCLE, HYCO_LCP_SINGULAR, HYCO_LCP_LIMIT, HYCO_LCP_RAY } HycoLCPStatus;

/*
  Primal-dual active set from `active`, which returns the last set. `symmetric`: M is symmetric positive semidefinite.
  Contacts that repeat others carry no force and leave the set; when their gaps contradict each other and the choice of
  the smaller ones does not end it, the status is SINGULAR. The monitor may be NULL.
*/
PetscErrorCode HycoLCPActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                PetscInt max_its, HycoMonitor monitor, void *ctx, PetscBool active[], PetscReal z[],
                                PetscInt *its, HycoLCPStatus *status);
/*
  z with M_aa z_a = -q_a on the set a[0..*k), 0 elsewhere. Members that depend on others leave a (their z is 0), and *k
  becomes smaller. *singular: even the rest could not be solved.
*/
PetscErrorCode HycoLCPSolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric, PetscInt *k,
                                 PetscInt a[], PetscReal z[], PetscBool *singular);
/*
  The active set with p free unknowns before m contacts (bodies that contact alone holds): M and q as HycoDirectFactor()
  and HycoDirectReduce() give them, z = (x_pinned, L). SINGULAR: contact does not hold them under this load.
*/
PetscErrorCode HycoSolveHeld(PetscInt p, PetscInt m, const PetscReal M[], const PetscReal q[], PetscInt max_its,
                             HycoMonitor monitor, void *ctx, PetscBool active[], PetscReal z[], PetscInt *its,
                             HycoLCPStatus *status);
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, for finding cycles. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

#endif
