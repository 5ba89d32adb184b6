/* The contact system and its solver, inside. */
#ifndef HYCOSOLVERIMPL_H
#define HYCOSOLVERIMPL_H

#include <hycolcp.h>
#include <hycolinear.h>
#include <hycosolver.h>

struct _p_HycoSystem {
  PETSCHEADER(int);
  Mat K, Bt, B; /* referenced; NULL where the flexibility is given */
  Mat G;        /* referenced: the flexibility B K^-1 Bt, dense; NULL where K is given */
  Vec F, D;     /* referenced; D: with G the gap without forces */
  PetscBool symmetric;
  PetscInt n, m; /* unknowns, contacts */
  /* work of the residuals, made by the first */
  Vec work_x[2], work_L; /* as F, as D */
  PetscReal size_B;      /* its largest row sum, while B is as seen */
  PetscReal residual;    /* 2-norm of F - K x - Bt L beyond round-off, of the last residuals */
  HycoOperatorState seen_B;
};

/* The work vectors of a system whose vectors are set. */
PetscErrorCode HycoSystemWork(HycoSystem system);

/*
  A form: the unknowns in which the complementarity problem is posed, one file in impls/ each. Every solver has one of
  each registered form; s->now is the method that it is asked for.
*/
struct _HycoSolverFormOps {
  /* *cost >= 0: it accepts system and method; the cheapest is taken. Else `why` says what to use instead. `asked`: the
     user named the form. */
  PetscErrorCode (*accepts)(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost, char why[HYCO_LINE]);
  /* Bytes that its factor would take on all ranks together; NULL: what a factor of K takes. */
  PetscErrorCode (*estimate)(HycoSolver s, HycoSolverForm form, PetscReal *bytes);
  /* What K and B alone decide, unless they are as they were. */
  PetscErrorCode (*setup)(HycoSolver s, HycoSolverForm form, PetscBool *singular);
  /* Fills x and L, sets s->its; *solved: the method finished by its own account. */
  PetscErrorCode (*solve)(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved);
  /* May be NULL. After a solve that failed: *better where another one now has less round-off. */
  PetscErrorCode (*refine)(HycoSolver s, HycoSolverForm form, PetscBool *better);
  /* May be NULL. Ends a refinement: each solve begins alike. */
  PetscErrorCode (*reset)(HycoSolver s, HycoSolverForm form);
  /* May be NULL. The options of this form alone. */
  PetscErrorCode (*setfromoptions)(HycoSolver s, HycoSolverForm form, HycoOptionItems PetscOptionsObject);
  PetscErrorCode (*destroy)(HycoSolverForm form);
};
struct _n_HycoSolverForm {
  char name[32];
  struct _HycoSolverFormOps ops[1];
  void *data;
};

/* How a form's complementarity problem is solved: by a type of Tao. */
typedef struct {
  const char *word; /* of -hyco_solver_type and the reports */
  char type[HYCO_TAO_NAME];
  int traits; /* HYCO_TAO_... */
} HycoMethod;

/* A factor of K: LAPACK's where it is dense, else MUMPS's with the Schur complement. */
typedef struct {
  HycoDirect direct;
  PetscReal bytes; /* estimated for it, all ranks together */
  PetscReal *lu;   /* column major n x n */
  PetscBLASInt *ipiv, n;
  PetscReal *X; /* its work: K^-1 Bt, n x room */
  size_t room;
  PetscBool refined; /* solves with it are refined in twice the working precision, S too */
  HycoOperatorState of;
} HycoStiffness;

struct _p_HycoSolver {
  PETSCHEADER(int);
  /* user parameters */
  HycoSystem system;                           /* referenced */
  PetscInt type;                               /* index in HycoSolverTypes */
  char form_name[32], tao_type[HYCO_TAO_NAME]; /* empty: by the problem */
  PetscReal rtol;
  PetscInt max_its;
  PetscBool warm, fallback, multilevel, refine;
  HycoLinear linear;
  PetscReal memory; /* bytes that factors may take, all ranks together; 0: most of what is free */
  HycoMonitor monitor;
  void *monitor_ctx;
  /* children */
  PetscInt n_forms;
  HycoSolverForm *forms;
  HycoStiffness stiffness; /* shared by the forms that factor K */
  /* direct or iterative, chosen for one K */
  PetscBool iterative;
  PetscObjectId chosen_for;
  char linear_method[128], why_iterative[96];
  Vec free;                   /* K^-1 F of the next solve, if known; borrowed */
  const PetscBool *start_set; /* of the next solve, if given; borrowed */
  PetscReal target;           /* residual that the next solve is to reach by iterations; 0: by rtol alone */
  /* the attempt under way, or the last one */
  HycoSolverForm form;
  HycoMethod now;
  PetscBool falling_back;
  PetscBool by_factor; /* its x came from a solve with K */
  /* the last solve */
  HycoReason reason;
  HycoKKT kkt;
  PetscInt its;
  PetscInt linear_its, linear_solves, linear_most; /* of conjugate gradients: in all, solves, most in one */
  char method[128];
  PetscReal seconds_factor, seconds_solve, seconds_before; /* before: of a factor made ahead of the solve */
};

extern const char *const HycoSolverTypes[]; /* active_set, tao, lemke, NULL */
extern const char *const HycoLinearNames[];

/* One of each registered form. */
PetscErrorCode HycoSolverCreateForms(HycoSolver s);
PetscErrorCode HycoSolverFormCreate_Linear(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Dual(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Shell(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Primal(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Projected(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Flexibility(HycoSolver s, HycoSolverForm form);
/* The form of that name; NULL: there is none. */
HycoSolverForm HycoSolverFindForm(HycoSolver s, const char name[]);
/* The cheapest form that accepts the system by the method now; `stay` is taken if it does. NULL: none, and why. */
PetscErrorCode HycoSolverAcceptingForm(HycoSolver s, HycoSolverForm stay, HycoSolverForm *form, char why[HYCO_LINE]);
/* Writes into s->method what solves: "active_set dual", "tao gpcg dual". */
PetscErrorCode HycoSolverNameMethod(HycoSolver s, const char form[]);
/* x = 0, L = 0, and the reason, for a K that has no factor. */
PetscErrorCode HycoSolverGiveUp(HycoSolver s, Vec x, Vec L);
/* Whether the chosen type of Tao serves symmetric systems alone. */
PetscBool HycoSolverNeedsSymmetry(HycoSolver s);

/* Chooses between a factor and iterations (s->iterative), which may change the form. */
PetscErrorCode HycoChooseLinear(HycoSolver s, HycoSolverForm *form);
/* Says in linear_method what solves with K: `ksp`, or (NULL) the factor of a HycoDirect. */
PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp);
/* Adds the iterations of a solve by conjugate gradients to the counts. */
void HycoCountLinear(HycoSolver s, PetscInt its);

/* -- a factor of K, with s->stiffness -- */

/* Factors K, and makes S = B K^-1 Bt (as HycoDirectFactor() where K has a kernel; NULL without B) unless K and B are as
   they were. Collective, as all that follow. */
PetscErrorCode HycoStiffnessFactor(HycoSolver s, Mat Bt, Mat B, PetscReal S[], PetscBool *singular);
PetscErrorCode HycoStiffnessDestroy(HycoStiffness *factor);
/* x = K^-1 r */
PetscErrorCode HycoStiffnessSolve(HycoSolver s, Vec r, Vec x);
/* S = B K^-1 Bt again, of a dense K, refined where factor->refined says so. */
PetscErrorCode HycoStiffnessCondense(HycoSolver s, Mat Bt, Mat B, PetscReal S[]);
/* Refines x, K x = F - Bt L of a dense K, against what double precision does not hold. */
PetscErrorCode HycoStiffnessRefine(HycoSolver s, const PetscReal L[], Vec x);
/* One step of refinement of x, K x = F - Bt L (L may be NULL), when round-off shows. */
PetscErrorCode HycoStiffnessCorrect(HycoSolver s, Vec L, Vec x);

/* Factors K and makes S unless K and B are as they were; dual form. Collective. */
PetscErrorCode HycoSolverFactor(HycoSolver s, PetscBool *singular);
/* x = K^-1 r by that factor, refined once. Collective. */
PetscErrorCode HycoSolverSolveLinear(HycoSolver s, Vec r, Vec x);
/* K^-1 F of the next solve, which takes it for granted if it uses the dual form and K is regular. Borrowed until then.
 */
PetscErrorCode HycoSolverSetFree(HycoSolver s, Vec x);
/* Whether what misses its residuals by round-off is solved again by solves refined in twice the working precision
   (yes), which take hundreds of times as long: not for an iteration whose end is judged anyway. */
PetscErrorCode HycoSolverSetRefine(HycoSolver s, PetscBool refine);
/* The contacts from which the active set of the next solve begins, m of them, with a given flexibility. Borrowed until
   then. */
PetscErrorCode HycoSolverSetStartSet(HycoSolver s, const PetscBool active[]);
/* The 2-norm of F - K x - Bt L that the next solve is to reach where it iterates (0: by the tolerance alone), within
   the tolerance too; it then begins from the given x. A factor takes no notice of it. */
PetscErrorCode HycoSolverSetTarget(HycoSolver s, PetscReal residual);
/* Iterations of conjugate gradients in the last solve, and most in one of its linear solves; 0: a factor solved. */
PetscErrorCode HycoSolverGetLinearIterations(HycoSolver s, PetscInt *its, PetscInt *most);
/* S = B K^-1 Bt of the last solve, which was in the dual form with a factor of a regular K: m x m column major, the
   same on every rank. Borrowed until a matrix changes. Collective. */
PetscErrorCode HycoSolverGetFlexibility(HycoSolver s, PetscInt *m, const PetscReal *S[]);
/* x[j] = K^-1 r[j] by the factor of the last solve, k of them. Collective. */
PetscErrorCode HycoSolverApplyInverse(HycoSolver s, PetscInt k, Vec r[], Vec x[]);

#endif
