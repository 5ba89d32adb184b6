/* HycoSolver: solves a HycoSystem. Convergence of every method is decided by the recomputed KKT residuals. */
#ifndef HYCOSOLVER_H
#define HYCOSOLVER_H

#include <hycosystem.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSolver *HycoSolver;

typedef const char *HycoSolverType;
#define HYCO_SOLVER_ACTIVE_SET "active_set" /* primal-dual active set, the paper's section 6.2 */
#define HYCO_SOLVER_TAO        "tao"        /* a solver of TAO on the same problem (HycoSolverSetTaoType()) */
#define HYCO_SOLVER_LEMKE      "lemke"      /* Lemke's complementary pivoting on the dense dual problem */
#define HYCO_SOLVER_SEMISMOOTH "semismooth" /* semismooth Newton on the dense dual problem, for blocks of any cone */

/* The unknowns of the complementarity problem. */
typedef enum {
  HYCO_FORM_AUTO,     /* dual for few contacts, primal if there are about as many contacts as unknowns */
  HYCO_FORM_DUAL,     /* w = (D - B K^-1 F) + (B K^-1 Bt) L */
  HYCO_FORM_PRIMAL,   /* gap coordinates: one unknown of each contact row is replaced by its gap, a bound */
  HYCO_FORM_DUAL_FREE /* the dual with B K^-1 Bt applied, never formed: TAO's bound-constrained types, symmetric */
} HycoForm;

/*
  Makes a form available to solvers that are created later. It is used by -hyco_solver_form name, or automatically if it
  is the cheapest that accepts a system. `create` sets the form's operations and data (private headers). A
  complementarity method is added by TaoRegister() instead, and selected by HycoSolverSetTaoType(). Not collective.
*/
typedef struct _n_HycoSolverForm *HycoSolverForm;
typedef PetscErrorCode (*HycoSolverFormCreate)(HycoSolver solver, HycoSolverForm form);
PetscErrorCode HycoSolverRegister(const char name[], HycoSolverFormCreate create);

/* Solves with the stiffness K. */
typedef enum {
  HYCO_LINEAR_AUTO,     /* direct, unless the factor is estimated to need more memory than is available */
  HYCO_LINEAR_DIRECT,   /* MUMPS, ordered by nested dissection */
  HYCO_LINEAR_ITERATIVE /* conjugate gradients with algebraic multigrid, the contacts as constraints */
} HycoLinear;

/* Reasons for the end of a solve. Negative: not solved, and x and L are the last iterate. */
typedef enum {
  HYCO_CONVERGED = 1,                  /* KKT residuals below the tolerance */
  HYCO_CONVERGED_FALLBACK = 2,         /* the same, by a fallback method (HycoSolverGetMethod) */
  HYCO_DIVERGED_RESIDUAL = -1,         /* a residual above the tolerance */
  HYCO_DIVERGED_ITERATIONS = -2,       /* the limit of iterations */
  HYCO_DIVERGED_SINGULAR = -3,         /* K (or its active saddle point) is singular */
  HYCO_DIVERGED_FLOATING = -4,         /* the load lifts a body off the contacts, which alone hold it */
  HYCO_DIVERGED_NO_CONTACT_BASIS = -5, /* a reduced model without any contact force, where bodies penetrate */
  HYCO_DIVERGED_STEP = -6,             /* a history: its time steps became too small */
  HYCO_DIVERGED_DISPLACEMENT = -7,     /* full order: displacements of more than 1e6 times the mesh's extent */
  HYCO_DIVERGED_ENERGY = -8,           /* full order: strain energy and work differ */
  HYCO_DIVERGED_HELD = -9,             /* contact alone holds a body, can balance the load, and the method failed */
  HYCO_DIVERGED_SURFACE = -10          /* a model of bodies: a slave meets nodes that training left out */
} HycoReason;

/* Collective. The caller owns it. */
PetscErrorCode HycoSolverCreate(MPI_Comm comm, HycoSolver *solver);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoSolverDestroy(HycoSolver *solver);
/* Sets (references) the system. */
PetscErrorCode HycoSolverSetSystem(HycoSolver solver, HycoSystem system);
/* -hyco_solver_type. A solve of a system with other cones than forces >= 0 (HycoSystemSetBlocks()) refuses each type
   but semismooth, which has no fallback there, and each form but dual and, without K, condensed. */
PetscErrorCode HycoSolverSetType(HycoSolver solver, HycoSolverType type);
/*
  -hyco_tao_type: for the type tao. Bound-constrained (symmetric systems): gpcg, tron, bntr, bnls, bntl, blmvm, bncg,
  bqnls, bqnkls, bqnktr, bqnktl, bqpip; semismooth (any, dual form): ssils, asils, ssfls, asfls; or what the program
  has registered by TaoRegister(), which gets a scaled problem: bounds, Hessian H, gradient H y - f (also if H is not
  symmetric). NULL (default): gpcg for a symmetric system, otherwise ssils. A solve refuses a bound-constrained type for
  a nonsymmetric system. docs/solvers.md compares the types.
*/
PetscErrorCode HycoSolverSetTaoType(HycoSolver solver, const char type[]);
/* -hyco_solver_form */
PetscErrorCode HycoSolverSetForm(HycoSolver solver, HycoForm form);
/* -hyco_linear; `gigabytes` (-hyco_memory): largest memory of a factor on all ranks together; 0: most of the free
   memory. */
PetscErrorCode HycoSolverSetLinear(HycoSolver solver, HycoLinear linear, PetscReal gigabytes);
/* -hyco_solver_rtol: the largest relative KKT residual that counts as solved (default 1e-8). */
PetscErrorCode HycoSolverSetTolerance(HycoSolver solver, PetscReal rtol);
/* -hyco_solver_max_its: of the active set or TAO (0: chosen from the number of contacts; TAO 2000), or of semismooth
   from each of its starts (0: 100). */
PetscErrorCode HycoSolverSetMaxIts(HycoSolver solver, PetscInt max_its);
/* -hyco_solver_warm_start: start from the last solution's active set (default) or without contact. */
PetscErrorCode HycoSolverSetWarmStart(HycoSolver solver, PetscBool warm);
/* -hyco_solver_multilevel: in the primal form, if there are more contacts than a quarter of the unknowns and couplings
   have one sign (a rope, a membrane), start from the active set of coarser problems (default). */
PetscErrorCode HycoSolverSetMultilevel(HycoSolver solver, PetscBool multilevel);
/*
  -hyco_solver_fallback: if the residuals of the chosen method are too large, try the next (default): the active set,
  Lemke's method, TAO's gpcg and tron (for a nonsymmetric system ssils); Lemke's method after TAO's types if the form
  has no dense problem. Otherwise such a solve does not converge.
*/
PetscErrorCode HycoSolverSetFallback(HycoSolver solver, PetscBool fallback);
/* Sets the prefix of its options: with "other_", -other_hyco_solver_rtol. */
PetscErrorCode HycoSolverSetOptionsPrefix(HycoSolver solver, const char prefix[]);
/* Reads the options above, from the database of PetscObjectSetOptions() (default: the global one). Collective. */
PetscErrorCode HycoSolverSetFromOptions(HycoSolver solver);

/* Called after each iteration of the active set, on every rank, with its number, the active contacts and the changes.
 */
typedef PetscErrorCode (*HycoMonitor)(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);
PetscErrorCode HycoSolverSetMonitor(HycoSolver solver, HycoMonitor monitor, void *ctx);

/*
  Solves for x (length n) and L (length m; NULL without contact). Collective. The factor and the flexibility, which
  depend on K and B alone, are kept between solves until a matrix changes. A solve that does not converge is not an
  error: see HycoSolverGetReason.
*/
PetscErrorCode HycoSolverSolve(HycoSolver solver, Vec x, Vec L);

PetscErrorCode HycoSolverGetReason(HycoSolver solver, HycoReason *reason);
/* Gets the iterations of the last solve, and the KKT residuals recomputed after it. */
PetscErrorCode HycoSolverGetIterations(HycoSolver solver, PetscInt *its);
PetscErrorCode HycoSolverGetKKT(HycoSolver solver, HycoKKT *kkt);
/* Gets the method of the last solve: "active_set dual", "tao tron primal, then active_set". Borrowed, until the next
   solve. */
PetscErrorCode HycoSolverGetMethod(HycoSolver solver, const char *method[]);
/* Gets the linear solver of the last solve: "direct: mumps, 0.9 GB estimated". Borrowed, until the next solve. */
PetscErrorCode HycoSolverGetLinear(HycoSolver solver, const char *linear[]);
/* Gets the seconds of the factorisation (and the flexibility) and of the rest of the last solve. Either may be NULL. */
PetscErrorCode HycoSolverGetSeconds(HycoSolver solver, PetscReal *factor, PetscReal *solve);
/* Text of a reason, for messages. Not collective. Borrowed. */
const char *HycoReasonName(HycoReason reason);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSolverView(HycoSolver object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSolverViewFromOptions(HycoSolver object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
