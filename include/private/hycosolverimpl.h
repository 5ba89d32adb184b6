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
  PetscBool warm;
  HycoMonitor monitor;
  void *monitor_ctx;
  /* factor of K (dual) */
  HycoDirect direct; /* sparse */
  PetscReal bytes;   /* estimated for it, all ranks together */
  PetscReal *lu;     /* dense: LAPACK's factors, column major n x n */
  PetscBLASInt *ipiv, n_lu;
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
/* A direct solver for a sparse K: MUMPS on several ranks or large, PETSc's own when small. Cholesky when symmetric. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp);

/* -- the direct solver of the dual form; all calls collective on its communicator -- */

PetscErrorCode HycoDirectCreate(MPI_Comm comm, HycoDirect *direct);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoDirectDestroy(HycoDirect *direct);
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

/* place[i] on rank 0: position of unknown i (of n) in a fill-reducing order of K. Collective. */
PetscErrorCode HycoDissection(MPI_Comm comm, Mat K, PetscInt place[]);

/* Factors the operators of such a solver, with more workspace when MUMPS asks for it. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular);

/* The forms: fill x and L, set its and method; *solved says whether the method finished by its own account. */
PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
PetscErrorCode HycoSolvePrimal(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
/* Whether gap coordinates exist: each contact row has an unknown that no other row has. Collective. */
PetscErrorCode HycoPrimalPossible(HycoSystem system, PetscBool *possible);

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
