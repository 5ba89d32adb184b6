/* The contact system and its solver: structs and internal functions. */
#ifndef HYCOSOLVERIMPL_H
#define HYCOSOLVERIMPL_H

#include <hycolcp.h>
#include <hycolinear.h>
#include <hycosolver.h>

/* Orthonormal motions, of bodies that contact alone holds or springs softer than the bodies, which the dual form of a
   system with cones takes as unknowns of their own. stiffness: of the springs on each, 0 without. */
typedef struct {
  PetscInt n;
  Vec *v;
  PetscReal *stiffness;
} HycoSoft;

/* Composed with a compliance: the block of n contacts, by columns, lda apart. Instead of the rows of W: a PETSc matrix
   made for each round would cost as much as a small prediction. */
#define HYCO_COMPLIANCE_BLOCK "HycoComplianceBlock_C"
typedef PetscErrorCode (*HycoComplianceBlock)(Mat W, PetscInt n, const PetscInt contact[], PetscInt lda,
                                              PetscScalar block[]);
/* Composed with one in which soft springs are, so that D and W L are huge and their sum is not: after MatMult(), the
   size of gaps and displacements, and by row the sizes of the terms that the gap is the sum of (borrowed). */
#define HYCO_COMPLIANCE_TERMS "HycoComplianceTerms_C"
typedef PetscErrorCode (*HycoComplianceTerms)(Mat W, Vec x, PetscReal *size, const PetscReal *terms[]);

struct _p_HycoSystem {
  PETSCHEADER(int);
  Mat K, Bt, B;      /* referenced; K, Bt NULL: K = 0, x are free; B NULL too: there are no x */
  Mat W;             /* referenced: the compliance of the contacts; NULL: 0 */
  PetscBool dense_W; /* it is MATSEQDENSE; its functions, or NULL: */
  HycoComplianceBlock block_W;
  HycoComplianceTerms terms_W;
  Vec F, D; /* referenced; F is NULL without x */
  PetscBool symmetric;
  const HycoSoft *soft; /* borrowed; NULL or without motions: those of K's null space */
  PetscInt n, m;        /* numbers of unknowns, and of rows: of contacts if these have one component each */
  HycoBlocks *blocks;   /* of this rank's rows; NULL: each row is a force >= 0 */
  /* work vectors of the residuals, created by the first */
  Vec work_x[2], work_L, work_W; /* like F, like D; work_L: the gaps of the last residuals */
  PetscReal size, beyond;        /* of these gaps; the largest residual without the effect of rounding terms */
  const PetscReal *terms;        /* of these gaps, by row, if W tells them; borrowed */
  PetscReal size_B;              /* its largest row sum, valid while B is unchanged */
  PetscReal rounding;            /* of an entry of F, where F is a difference; 0: not known */
  PetscReal residual;            /* 2-norm of F - K x - Bt L beyond round-off, when residuals were last computed */
  HycoOperatorState seen_B;
};

/* Fails on every rank if the blocks are not those of the rows. Collective. */
PetscErrorCode HycoSystemCheckBlocks(HycoSystem system);
/* The round-off of an entry of the F that is set: a smaller load on a floating body is none. */
void HycoSystemSetRounding(HycoSystem system, PetscReal rounding);
/* Sets the motions, which stay the caller's; NULL: those of K's null space. */
void HycoSystemSetSoft(HycoSystem system, const HycoSoft *soft);
/* The motions whose unknowns the dual form pins: K's null space (*stiffness NULL), or the soft ones. Borrowed. */
PetscErrorCode HycoSystemMotions(HycoSystem system, PetscInt *n, const Vec *v[], const PetscReal *stiffness[]);
/* Their number. */
PetscErrorCode HycoSystemPinned(HycoSystem system, PetscInt *n);
/* Pins them. Collective. */
PetscErrorCode HycoSystemPin(HycoSystem system, HycoDirect direct);
/* The largest of each value over the ranks. Collective. */
PetscErrorCode HycoSystemMost(HycoSystem system, PetscMPIInt n, PetscReal value[]);
/* Creates the work vectors of a system whose vectors are set, and destroys them. */
PetscErrorCode HycoSystemWork(HycoSystem system);
PetscErrorCode HycoSystemFreeWork(HycoSystem system);

/* -- a compliance -- */

/* The block of W, on every rank. Collective. */
PetscErrorCode HycoSystemCompliance(HycoSystem system, PetscInt n, const PetscInt contact[], PetscInt lda,
                                    PetscScalar block[]);
/* The problem of n contacts without K: M = [0 A; -A^T W] (square, by columns) of the free unknowns and them, and
   q = (-F, D) (NULL: not wanted). On one process. */
PetscErrorCode HycoSystemFill(HycoSystem system, PetscInt n, const PetscInt contact[], PetscReal M[], PetscReal q[]);
/* The gaps w = D - B x + W L, and their `size`: what joins, closes and is measured. HycoSystemAddCompliance(): the last
   term. Collective. */
PetscErrorCode HycoSystemGaps(HycoSystem system, Vec x, Vec L, Vec w);
PetscErrorCode HycoSystemAddCompliance(HycoSystem system, Vec L, Vec w, PetscReal *size);
/* Takes `size` and `terms` after HycoSystemGaps() from a compliance that tells them. */
PetscErrorCode HycoSystemSizes(HycoSystem system, Vec x);
/* The effect of rounding the terms of row k, if the compliance tells them. */
PetscReal HycoSystemGapRounding(HycoSystem system, PetscInt k);
/* The stationarity without K. */
PetscErrorCode HycoSystemFreeStationarity(HycoSystem system, Vec L, PetscReal *value);
/* How far gaps that are found in another way, as from displacements, are from those of the last residuals, relative to
   their size, beyond round-off. */
PetscErrorCode HycoSystemMisfit(HycoSystem system, const PetscReal gap[], PetscReal *misfit);

/*
  A form: the unknowns in which the complementarity problem is posed, one file in impls/ each. Every solver has one
  object of each registered form; s->now is the requested method.
*/
struct _HycoSolverFormOps {
  /* *cost >= 0: the form accepts system and method; the cheapest is chosen. Else `why` says what to use instead.
     `asked`: the user has named the form. */
  PetscErrorCode (*accepts)(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost, char why[HYCO_LINE]);
  /* Memory of its factor on all ranks together, in bytes; NULL: that of a factor of K. */
  PetscErrorCode (*estimate)(HycoSolver s, HycoSolverForm form, PetscReal *bytes);
  /* Computes what depends only on K and B, unless they are unchanged. */
  PetscErrorCode (*setup)(HycoSolver s, HycoSolverForm form, PetscBool *singular);
  /* Computes x and L, sets s->its; *solved: the method reports convergence. */
  PetscErrorCode (*solve)(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved);
  /* May be NULL. After a solve that failed: *better if another solve now has less round-off. */
  PetscErrorCode (*refine)(HycoSolver s, HycoSolverForm form, PetscBool *better);
  /* May be NULL. Ends a refinement, so that each solve starts in the same way. */
  PetscErrorCode (*reset)(HycoSolver s, HycoSolverForm form);
  /* May be NULL. The options of this form. */
  PetscErrorCode (*setfromoptions)(HycoSolver s, HycoSolverForm form, HycoOptionItems PetscOptionsObject);
  PetscErrorCode (*destroy)(HycoSolverForm form);
};
struct _n_HycoSolverForm {
  char name[32];
  PetscBool cones;      /* trait: takes blocks of any cone; false: forces >= 0 only */
  PetscBool compliance; /* trait: takes W */
  struct _HycoSolverFormOps ops[1];
  void *data;
};

/* The method for a form's complementarity problem: a Tao type. */
typedef struct {
  const char *word; /* as in -hyco_solver_type and the reports */
  char type[HYCO_TAO_NAME];
  int traits; /* HYCO_TAO_... */
} HycoMethod;

/* A factor of K: LAPACK's where it is dense, else MUMPS's with the Schur complement. */
typedef struct {
  HycoDirect direct;
  PetscReal bytes; /* estimated memory, all ranks together */
  PetscReal *lu;   /* column major n x n */
  PetscBLASInt *ipiv, n;
  PetscReal *X; /* work: K^-1 Bt, n x room */
  size_t room;
  PetscBool refined; /* solves are refined in twice the working precision, and so is S */
  HycoOperatorState of;
  PetscInt made; /* number of factors so far */
} HycoStiffness;

struct _p_HycoSolver {
  PETSCHEADER(int);
  /* user parameters */
  HycoSystem system;                           /* referenced */
  PetscInt type;                               /* index in HycoSolverTypes */
  char form_name[32], tao_type[HYCO_TAO_NAME]; /* empty: chosen by the problem */
  PetscReal rtol;
  PetscInt max_its;
  PetscBool warm, fallback, multilevel, refine;
  HycoLinear linear;
  PetscReal memory; /* memory in bytes that factors may use, all ranks together; 0: most of the free memory */
  HycoMonitor monitor;
  void *monitor_ctx;
  /* children */
  PetscInt n_forms;
  HycoSolverForm *forms;
  HycoStiffness stiffness; /* shared by the forms that factor K */
  /* direct or iterative, chosen once for each K */
  PetscBool iterative;
  PetscObjectId chosen_for;
  char linear_method[128], why_iterative[96];
  Vec free;                     /* K^-1 F for the next solve, if known; borrowed */
  const PetscBool *working_set; /* contacts of the next solve's first problem, if given; borrowed */
  Vec other;                    /* with blocks: a second start, if given; borrowed */
  PetscReal target;             /* largest residual of the next solve without a factor; 0: by rtol alone */
  /* the current attempt, or the last one */
  HycoSolverForm form;
  HycoMethod now;
  PetscBool falling_back;
  PetscBool by_factor; /* its x was computed by a solve with K */
  /* the last solve */
  HycoReason reason;
  HycoKKT kkt;
  PetscInt its;
  PetscInt sign; /* with cones: of the determinant of the derivative at the solution; 0: not known */
  PetscInt linear_its, linear_solves, linear_most; /* of conjugate gradients: iterations, solves, most in one solve */
  char failure[HYCO_LINE]; /* what a solver of PETSc says why it failed in the last solve; "": nothing */
  char method[128];
  PetscReal seconds_factor, seconds_solve, seconds_before; /* before: time of a factor computed ahead of the solve */
};

extern const char *const HycoSolverTypes[]; /* active_set, tao, lemke, semismooth, NULL */
extern const char *const HycoLinearNames[];

/* One of each registered form. */
PetscErrorCode HycoSolverCreateForms(HycoSolver s);
PetscErrorCode HycoSolverFormCreate_Linear(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Dual(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Shell(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Primal(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Projected(HycoSolver s, HycoSolverForm form);
PetscErrorCode HycoSolverFormCreate_Condensed(HycoSolver s, HycoSolverForm form);
/* The form of that name, or NULL. */
HycoSolverForm HycoSolverFindForm(HycoSolver s, const char name[]);
/* The cheapest form that accepts the system with the current method; `stay` is preferred if it accepts. NULL: none,
   and the reason. */
/* Notes that a KSP of the last solve has not converged, with its reason. */
PetscErrorCode HycoSolverNoteKSP(HycoSolver s, KSP ksp);
/* HycoReasonName() of a reason below 0, and what PETSc's solver says. */
void HycoSolverExplain(HycoSolver s, char why[HYCO_LINE]);
PetscErrorCode HycoSolverAcceptingForm(HycoSolver s, HycoSolverForm stay, HycoSolverForm *form, char why[HYCO_LINE]);
/* Writes the method into s->method: "active_set dual", "tao gpcg dual". */
PetscErrorCode HycoSolverNameMethod(HycoSolver s, const char form[]);
/* With a singular K: whether no contact forces balance the load on its null space; L then has those that come nearest.
   Collective. */
PetscErrorCode HycoSystemLiftOff(HycoSystem system, Vec L, PetscBool *lift_off);
/* Sets x = 0, L = 0 and the reason, for a K that cannot be factored. */
PetscErrorCode HycoSolverGiveUp(HycoSolver s, Vec x, Vec L);
/* Whether the chosen Tao type requires a symmetric system. */
PetscBool HycoSolverNeedsSymmetry(HycoSolver s);

/* Chooses between a factor and iterations (s->iterative); may change the form. */
PetscErrorCode HycoChooseLinear(HycoSolver s, HycoSolverForm *form);
/* The memory for factors in bytes: -hyco_memory, or four fifths of the free memory of all machines of the ranks, the
   same on every rank. Collective. */
PetscErrorCode HycoSolverMemory(HycoSolver solver, PetscReal *bytes);
/* Says in linear_method what solves with K: `ksp`, or (NULL) the factor of a HycoDirect. */
PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp);
/* Adds the iterations of a solve by conjugate gradients to the counts. */
void HycoCountLinear(HycoSolver s, PetscInt its);

/* -- a factor of K, with s->stiffness -- */

/* Factors K, and computes S = B K^-1 Bt (as HycoDirectFactor() if K has a null space; NULL without B), unless K and
   B are unchanged. Collective, as all functions below. */
PetscErrorCode HycoStiffnessFactor(HycoSolver s, Mat Bt, Mat B, PetscReal S[], PetscBool *singular);
PetscErrorCode HycoStiffnessDestroy(HycoStiffness *factor);
/* x = K^-1 r */
PetscErrorCode HycoStiffnessSolve(HycoSolver s, Vec r, Vec x);
/* Computes S = B K^-1 Bt again, for a dense K; refined if factor->refined is set. */
PetscErrorCode HycoStiffnessCondense(HycoSolver s, Mat Bt, Mat B, PetscReal S[]);
/* Refines x, K x = F - Bt L for a dense K, in twice the working precision. */
PetscErrorCode HycoStiffnessRefine(HycoSolver s, const PetscReal L[], Vec x);
/* One step of refinement of x, K x = F - Bt L (L may be NULL), if its residual shows round-off. */
PetscErrorCode HycoStiffnessCorrect(HycoSolver s, Vec L, Vec x);

/* Factors K and computes S, unless K and B are unchanged; dual form. Collective. */
PetscErrorCode HycoSolverFactor(HycoSolver s, PetscBool *singular);
/* x = K^-1 r by that factor, refined once. Collective. */
PetscErrorCode HycoSolverSolveLinear(HycoSolver s, Vec r, Vec x);
/* Passes K^-1 F of the next solve, which uses it without a check if it uses the dual form and K is regular. Borrowed
   until then. */
PetscErrorCode HycoSolverSetFree(HycoSolver s, Vec x);
/* Whether a solve that misses its residuals by round-off is repeated with refinement in twice the working precision
   (yes). This takes hundreds of times as long, and is unnecessary for an iteration whose final result is checked
   anyway. */
PetscErrorCode HycoSolverSetRefine(HycoSolver s, PetscBool refine);
/* The m contacts of the first problem of the next solve without K, from which the others join as they close. Borrowed
   until then. */
PetscErrorCode HycoSolverSetWorkingSet(HycoSolver s, const PetscBool in[]);
/* Passes forces from which the next solve with blocks may start as well as from L: from those with the smaller
   residual. Borrowed until then. */
PetscErrorCode HycoSolverSetOtherStart(HycoSolver s, Vec L);
/* Sets the largest 2-norm of F - K x - Bt L of the next solve, beside the tolerance; it then starts from the given x.
   0: the tolerance alone. Only iterative solves use it. */
PetscErrorCode HycoSolverSetTarget(HycoSolver s, PetscReal residual);
/* Gets the iterations of conjugate gradients in the last solve, and most of one linear solve; 0 with a factor. */
PetscErrorCode HycoSolverGetLinearIterations(HycoSolver s, PetscInt *its, PetscInt *most);
/* The matrix of the dual problem after HycoSolverFactor(): S, p + m square, p unknowns pinned before the m contacts.
   Borrowed. */
void HycoSolverGetCondensed(HycoSolver s, PetscInt *m, PetscInt *p, const PetscReal *S[]);
/* The dense problem of the last solve with the dual form, and its z = (x_pinned, L). Borrowed, without the blocks. */
void HycoSolverGetDense(HycoSolver s, HycoLCP *lcp, const PetscReal *z[]);
/*
  The derivative of the solution x, L of s's system (tangent.c): HycoSolverTangentSolve() gives x' and L' where F - K x
  - Bt L changes by r, and D - B x by g, at fixed x and L; g and dL are not used without contacts. sign, *kink as in
  HycoTangentSolve(). Needs a factor of K. *regular false: the closed contacts do not determine the solution, and only
  HycoSolverTangentDestroy() (NULL-safe) may follow. Of a system with blocks x must be that of the last solve, `before`
  the forces from which it began (else not read), and HycoSolverTangentSolveCones() takes the derivatives of the
  coefficients too (mu, like L, at normal rows), and gives dw, of D - B x; step: of the differences by which r was
  found, whose round-off on motions is none; *regular as in HycoConeTangent(). Collective.
*/
typedef struct _n_HycoSolverTangent *HycoSolverTangent;
PetscErrorCode HycoSolverTangentCreate(HycoSolver s, Vec x, Vec L, Vec before, HycoSolverTangent *tangent,
                                       PetscBool *regular);
PetscErrorCode HycoSolverTangentDestroy(HycoSolverTangent *tangent);
PetscErrorCode HycoSolverTangentSolve(HycoSolverTangent tangent, Vec r, Vec g, int sign, Vec dx, Vec dL,
                                      PetscBool *kink);
PetscErrorCode HycoSolverTangentSolveCones(HycoSolverTangent tangent, Vec r, Vec g, Vec mu, PetscReal step, Vec dx,
                                           Vec dL, Vec dw, PetscBool *regular);
PetscInt HycoSolverTangentUndecided(HycoSolverTangent tangent);

#endif
