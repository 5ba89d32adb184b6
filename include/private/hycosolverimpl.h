/* The contact system and its solver, inside. */
#ifndef HYCOSOLVERIMPL_H
#define HYCOSOLVERIMPL_H

#include <hycolcp.h>
#include <hycolinear.h>
#include <hycosolver.h>

struct _p_HycoSystem {
  PETSCHEADER(int);
  Mat K, Bt, B; /* referenced */
  Vec F, D;     /* referenced */
  PetscBool symmetric;
  PetscInt n, m; /* unknowns, contacts */
  /* work of the residuals, made by the first */
  Vec work_x[2], work_L; /* as F, as D */
  PetscReal size_B;      /* its largest row sum, while B is as seen */
  HycoOperatorState seen_B;
};

/* The work vectors of a system whose vectors are set. */
PetscErrorCode HycoSystemWork(HycoSystem system);

struct _p_HycoSolver {
  PETSCHEADER(int);
  /* user parameters */
  HycoSystem system; /* referenced */
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
  PetscReal *X;      /* its work: K^-1 Bt, n x m */
  PetscBool refined; /* solves with it are refined in twice the working precision, S too */
  /* dual form, replicated on every rank: column-major m x m flexibility, gap without forces */
  PetscInt m, p; /* contacts; unknowns pinned because K is singular: they come before the contacts in S, g and L */
  PetscReal *S, *g, *L;
  PetscBool *active;
  PetscBool started; /* active holds a solution's set */
  HycoOperatorState condensed;
  /* primal form in gap coordinates */
  Mat T, Kg, Kw;
  KSP ksp_gap;
  PetscInt *pivot, *contact, n_pivots; /* this rank's contacts' pivot unknowns, the contacts' numbers on this rank */
  HycoOperatorState transformed;
  /* dual form without its matrix */
  HycoDirect direct_free;
  HycoOperatorState factored_free;
  Vec free; /* K^-1 F of the next solve, if known; borrowed */
  /* the last solve */
  PetscInt tao; /* the type that serves its system */
  HycoReason reason;
  HycoKKT kkt;
  PetscInt its;
  char method[128];
  PetscReal seconds_factor, seconds_solve, seconds_before; /* before: of a factor made ahead of the solve */
};

extern const char *const HycoSolverTypes[]; /* active_set, tao, lemke, NULL */
enum { HYCO_TYPE_ACTIVE_SET, HYCO_TYPE_TAO, HYCO_TYPE_LEMKE };

/* K x = F without contact. */
PetscErrorCode HycoSolveIterative(HycoSolver s, Vec x, PetscBool *solved);
/* Says in linear_method what solves with K: `ksp`, or (NULL) the factor of a HycoDirect. */
PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp);
/* Few contacts: dual. About as many as unknowns: primal. */
PetscErrorCode HycoChooseForm(HycoSolver s, HycoForm *form);
/* The TAO type for the system; fails when type, form and system do not go together. */
PetscErrorCode HycoChooseTao(HycoSolver s, HycoForm form);
/* Chooses between a factor and iterations (s->iterative), which need the primal form. */
PetscErrorCode HycoChooseLinear(HycoSolver s, HycoForm *form);
extern const char *const HycoLinearNames[];
/* Attaches K's near-kernel (MatSetNearNullSpace()) to Kw, in gap coordinates. Collective. */
PetscErrorCode HycoGapNearKernel(HycoSolver s, Mat Kw);
/* Factors K and makes S unless K and B are as they were; dual form. Collective. */
PetscErrorCode HycoSolverFactor(HycoSolver s, PetscBool *singular);
/* After a solve in the dual form with a small dense K: makes S again, refined, for one more solve; *done is false where
   that changes nothing. HycoDualForget() ends it: each solve begins alike. */
PetscErrorCode HycoDualRefine(HycoSolver s, PetscBool *done);
void HycoDualForget(HycoSolver s);
/* x = K^-1 r by that factor, refined once. Collective. */
PetscErrorCode HycoSolverSolveLinear(HycoSolver s, Vec r, Vec x);
/* K^-1 F of the next solve, which takes it for granted if it uses the dual form and K is regular. Borrowed until then.
 */
PetscErrorCode HycoSolverSetFree(HycoSolver s, Vec x);
/* The forms: fill x and L, set its and method; *solved says whether the method finished by its own account. */
PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
PetscErrorCode HycoSolvePrimal(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved);
/* Whether gap coordinates exist: each contact row has an unknown that no other row has. Collective. */
PetscErrorCode HycoPrimalPossible(HycoSystem system, PetscBool *possible);

/* S = B K^-1 Bt of the last solve, which was in the dual form with a factor of a regular K: m x m column major, the
   same on every rank. Borrowed until a matrix changes. Collective. */
PetscErrorCode HycoSolverGetFlexibility(HycoSolver s, PetscInt *m, const PetscReal *S[]);
/* x[j] = K^-1 r[j] by the factor of the last solve, k of them. Collective. */
PetscErrorCode HycoSolverApplyInverse(HycoSolver s, PetscInt k, Vec r[], Vec x[]);

/* The dual form by TAO with S = B K^-1 Bt never formed (form dual_free). */
PetscErrorCode HycoSolveDualFree(HycoSolver s, Vec x, Vec L, PetscBool *solved);

/*
  Gap coordinates. HycoGapSetUp() makes T, Kg, Kw, the pivots and the solver unless K and B are as they were;
  HycoGapWork() prepares Kw, a copy of Kg that keeps its pattern; HycoSolveOnSet() solves Kg y = f with y = d at this
  rank's n rows a[], through Kw, its solver and rhs. Collective.
*/
PetscErrorCode HycoGapSetUp(HycoSolver s);
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

#endif
