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

struct _p_HycoSolver {
  MPI_Comm comm;
  /* user parameters */
  HycoSystem system; /* borrowed */
  PetscInt type;     /* index in HycoSolverTypes */
  HycoForm form;
  PetscReal rtol;
  PetscInt max_its;
  PetscBool warm, multilevel;
  HycoMonitor monitor;
  void *monitor_ctx;
  /* factor of K (dual) */
  KSP ksp;       /* sparse */
  PetscReal *lu; /* dense: LAPACK's factors, column major n x n */
  PetscBLASInt *ipiv, n_lu;
  HycoSeen factored;
  /* dual form, replicated on every rank: column-major m x m flexibility, gap without forces */
  PetscInt m;
  PetscReal *S, *g, *L;
  PetscBool *active;
  PetscBool started; /* active holds a solution's set */
  HycoSeen condensed;
  /* primal form in gap coordinates */
  Mat T, Kg, Kw;
  KSP ksp_gap;
  PetscInt *pivot; /* this rank's contacts' pivot unknowns */
  HycoSeen transformed;
  /* the last solve */
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

/* Whether K, on one process, has so short an envelope in reverse Cuthill-McKee order that its factor hardly fills. */
PetscErrorCode HycoThin(Mat K, PetscBool *thin);
/* Factors the operators of such a solver, with more workspace when MUMPS asks for it. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular);

/* The forms: fill x and L, set its and method; *solved says whether the method finished by its own account. */
PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
PetscErrorCode HycoSolvePrimal(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
/* Whether gap coordinates exist: each contact row has an unknown that no other row has. Collective. */
PetscErrorCode HycoPrimalPossible(HycoSystem system, PetscBool *possible);

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

/* min 1/2 y^T H y - f^T y, lo <= y <= hi, by TAO (options -hyco_tao_). */
PetscErrorCode HycoTaoBoundQP(Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its, PetscBool *solved);

/* -- dense complementarity, w = q + M z >= 0, z >= 0, w.z = 0; M column major n x n; all replicated -- */

typedef enum { HYCO_LCP_SOLVED, HYCO_LCP_CYCLE, HYCO_LCP_SINGULAR, HYCO_LCP_LIMIT, HYCO_LCP_RAY } HycoLCPStatus;

/* Primal-dual active set from `active`, which returns the last set. The monitor may be NULL. */
PetscErrorCode HycoLCPActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its,
                                HycoMonitor monitor, void *ctx, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status);
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, for finding cycles. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

#endif
