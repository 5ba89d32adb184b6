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
  PetscBool warm, fallback;
  PetscInt tao_type; /* index in HycoTaoTypes; HYCO_TAO_AUTO: by the problem */
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
  /* dual form without its matrix */
  KSP ksp_free;
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
/* A direct solver for a sparse K: MUMPS on several ranks or large, PETSc's own when small. Cholesky when symmetric. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp);

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
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, for finding cycles. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

#endif
