/*
  HycoPath: the solution of a scene with a history, from its first time to its last. Steps of time and Newton's method
  are the same whoever has the bodies (history.c, newton.c): the full order on distributed vectors (path.c), a reduced
  model on its small ones. Its ops say what it is made of.
*/
#ifndef HYCOPATH_H
#define HYCOPATH_H

#include <hycofomimpl.h>
#include <hycoinelastic.h>

typedef struct _n_HycoSeries *HycoSeries;

/* What one iteration of a step solves with: the consistent tangent; the elastic stiffness, whose factor stays; a
   tangent that stays as long as the iterations contract. */
typedef enum { HYCO_NEWTON_AUTO, HYCO_NEWTON_TANGENT, HYCO_NEWTON_ELASTIC, HYCO_NEWTON_MODIFIED } HycoNewton;
extern const char *const HycoNewtons[]; /* NULL ends */

#define HYCO_ANDERSON 5 /* depth of the acceleration */

/* An attempt at a step of time. */
typedef struct {
  PetscBool converged, easy;
  char why[HYCO_LINE];              /* else */
  PetscInt iterations;              /* contact systems solved */
  PetscInt factors;                 /* of them with a new stiffness */
  PetscInt active_its;              /* iterations within them */
  PetscInt linear_its, most_linear; /* of conjugate gradients; most in one solve */
  PetscReal residual;               /* of equilibrium, relative to the largest of |f_int|, |F|, |B^T L| */
  PetscReal order;                  /* observed; 0: too few iterations to tell */
  PetscReal seconds_factor, seconds_solve, seconds_law;
  HycoFEStepReport law; /* over all ranks */
} HycoStepAttempt;

typedef struct {
  PetscReal loads, supports, contact; /* work of loads, of moved supports, against contact forces */
  PetscReal stored, dissipated, thermal, moduli;
  PetscReal defect, size; /* of their balance, the largest of a step so far; the sum of the terms' sizes */
} HycoWork;

/* All are collective on the path's communicator. NULL for what a path does not do. */
typedef struct {
  /* Everything at mu (the scene's variables at the attempt's time): what is borrowed below, F, and D; elastic: K too.
   */
  PetscErrorCode (*assemble)(HycoPath, const PetscReal mu[], PetscBool elastic);
  /* The laws at U: the state `end`, f_int, and r = F - f_int, 0 where U is prescribed; the report over all ranks. */
  PetscErrorCode (*step)(HycoPath, PetscReal t0, PetscReal t1, PetscBool tangent, HycoFEStepReport *report);
  /* K from fe's tangents. */
  PetscErrorCode (*stiffness)(HycoPath);
  /* Adds what supports do that have moved since the last accepted time. */
  PetscErrorCode (*moves)(HycoPath, Vec rhs);
  PetscErrorCode (*accept)(HycoPath, const HycoStepAttempt *); /* the attempt is the state at t now */
  PetscErrorCode (*record)(HycoPath); /* a listed time is reached, or the last that is: fills `now` */
  PetscErrorCode (*save)(HycoPath);   /* the checkpoint */
} HycoPathOps;

struct _n_HycoPath {
  const HycoPathOps *ops;
  void *ctx; /* whose path it is */
  MPI_Comm comm;
  /* borrowed; matrices and system are those of the attempt's time */
  HycoScene scene;
  HycoFE fe;
  HycoSystem system;
  HycoSolver solver;
  Mat K, B, Bt;
  Vec U, Lambda, rhs, D; /* the solution, and the right side of the contact system */
  PetscInt n_contacts;   /* length of Lambda */
  PetscInt n_free;       /* unknowns */
  PetscBool cold;        /* the next contact system is solved without what the solver knows of the last */
  /* options */
  PetscInt method; /* a HycoNewton */
  PetscInt max_its, substeps;
  PetscReal rtol, bound, smallest;
  char checkpoint[PETSC_MAX_PATH_LEN];
  PetscBool resume;
  /* times of the steps to be taken, instead of its own choice; NULL: none. Borrowed */
  PetscInt n_given;
  const PetscReal *given;
  PetscInt most_cuts, n_cuts; /* steps of the path that may be cut before it ends; 0: any number; that were */
  /* state of the material at the last accepted time, and of the attempt */
  HycoFEState begin, end;
  /* as U: loads alone, of the attempt; internal forces, the same */
  Vec F, f_int, r, U_old, work, diagonal;
  Vec L_old, gap_work;     /* as Lambda; NULL without contact */
  PetscReal *f_local, *u0; /* of fe's n_dof */
  PetscReal summands;      /* 2-norm of what f_int is a small difference of, as ops->step has it; 0: of nothing */
  PetscBool tangent;       /* K is a tangent, not the elastic stiffness */
  PetscInt kept;           /* contact systems that were solved with this K */
  PetscBool flows;         /* some body's law has a memory */
  /* Anderson's acceleration: differences of iterates and residuals, newest last */
  PetscInt n_mixed;
  Vec dU[HYCO_ANDERSON], dG[HYCO_ANDERSON], U_last, G_last, G;
  Vec dL[HYCO_ANDERSON], L_last, L_new;
  /* where the path is */
  PetscReal mu[HYCO_MAX_PARAMETERS], t, dt;
  PetscInt step; /* listed times reached: the index of the next */
  HycoKKT kkt;   /* of the last accepted time */
  HycoStep now;  /* since the last listed time */
  PetscInt n_steps;
  HycoStep *steps;
  PetscReal *orders; /* of the attempts that told one */
  PetscInt n_orders, room_orders;
  PetscReal *taken; /* times of the accepted steps, the first among them */
  PetscInt n_taken, room_taken;
  PetscBool ended; /* the last path reached its end */
  char why[HYCO_LINE];
  /* of the full order */
  HycoWork work_done;
  Vec F_old, f_old;  /* of the last accepted time */
  HycoSeries series; /* NULL: none is asked for */
  HycoStepMonitor monitor;
  PetscErrorCode (*between)(HycoFOM, void *ctx); /* NULL, or called at the accepted steps that no listed time ends */
  void *monitor_ctx;                             /* of both */
  PetscErrorCode (*interrupt)(void *ctx);        /* NULL, or called at each iteration; its error ends the path */
  void *interrupt_ctx;
};

/* With the options' defaults. The caller owns it. */
PetscErrorCode HycoPathNew(MPI_Comm comm, HycoScene scene, HycoPath *path);
/* Vectors as U and Lambda (NULL: no contact), once U, Lambda and fe are there. */
PetscErrorCode HycoPathSetUp(HycoPath path);
/* NULL-safe. */
PetscErrorCode HycoPathFree(HycoPath *path);
/* Declares and reads the options of -hyco_newton and their kin. */
PetscErrorCode HycoPathSetFromOptions(HycoPath path, HycoOptionItems PetscOptionsObject);
/* The virgin bodies, at the first time. Collective. */
PetscErrorCode HycoPathBegin(HycoPath path, const PetscReal mu[]);
/* On from where the path is to its end, or as far as it gets: path->ended. Collective. */
PetscErrorCode HycoPathRun(HycoPath path);
/* One attempt, from the accepted state at t0 to t1: U, Lambda and the state `end`. Collective. */
PetscErrorCode HycoPathAttempt(HycoPath path, PetscReal t0, PetscReal t1, HycoStepAttempt *attempt);
/* U and Lambda of the last accepted time again. */
PetscErrorCode HycoPathRestore(HycoPath path);
/* Everything at t but the solution. Collective. */
PetscErrorCode HycoPathAssemble(HycoPath path, PetscReal t);
/* In ops->moves: what supports do that have moved away from u (fe's n_dof) is added to the loads of `work`, as
   HycoFEAssembleForce() has them; *moved: there is some. Collective. */
PetscErrorCode HycoPathMoves(HycoPath path, const PetscScalar u[], Vec work, PetscBool *moved);
/* How many solves a factor with its flexibility costs, as a rule: in 3D 24 were counted at 29,000 unknowns and 50 at
   118,000, the root of their number; in 2D a fifth of that. */
PetscReal HycoPathFactorCost(HycoPath path);
/* What steps are solved with; not HYCO_NEWTON_AUTO. */
HycoNewton HycoPathMethod(HycoPath path);
/* What a path has to tell. */
void HycoPathGetHistory(HycoPath path, HycoHistory *history);

/* -- of the full order: a HycoPath whose ctx is the HycoFOM -- */

PetscErrorCode HycoFOMPathCreate(HycoFOM fom);
/* Fails where one of the options of paths is given and the scene has no history. */
PetscErrorCode HycoPathRefuseOptions(HycoFOM fom);
/* Solves the history at mu; not reaching its end is told by the summary's reason. Collective. */
PetscErrorCode HycoPathSolve(HycoFOM fom, const PetscReal mu[]);
/* Fails where the checkpoint would take the place of a model. Collective. */
PetscErrorCode HycoPathCheckPlace(HycoFOM fom);
/* The checkpoint, if there is to be one; back from it, if it is there. Collective. */
PetscErrorCode HycoPathSave(HycoFOM fom);
PetscErrorCode HycoPathLoad(HycoFOM fom);
/* The series of fields, if one is asked for: made anew, the last time added, written. Collective. */
PetscErrorCode HycoSeriesBegin(HycoFOM fom);
PetscErrorCode HycoSeriesAdd(HycoFOM fom);
/* The times before a checkpoint, from the files beside it. */
PetscErrorCode HycoSeriesRestore(HycoFOM fom);
PetscErrorCode HycoSeriesEnd(HycoFOM fom);
PetscErrorCode HycoSeriesDestroy(HycoSeries *series);
/* What a series shows of a time, whoever has it: a HycoFE of each rank with the state of its cells, u on it, and on
   rank 0 the contacts' surface with displacements and forces. Borrowed. */
typedef struct {
  MPI_Comm comm;
  HycoFE fe;
  HycoFEState state;
  HycoFE fe_surface;
  HycoPairs *pairs;
  PetscInt n_nodes, n_cells, n_contacts; /* of the whole mesh */
  const HycoFileOrder *rows;             /* NULL on one rank */
  const PetscReal *u, *u_surface, *lambda, *mu;
  PetscReal t;
} HycoSeriesSource;
/* To a HycoFieldFile of at most so many times: created, the mesh written, a time added, put in its place. Collective.
 */
PetscErrorCode HycoSeriesCreate(MPI_Comm comm, const char path[], PetscInt most, HycoSeries *series);
PetscErrorCode HycoSeriesOpen(HycoSeries series, const HycoSeriesSource *from);
PetscErrorCode HycoSeriesAddTime(HycoSeries series, const HycoSeriesSource *from);
PetscErrorCode HycoSeriesClose(HycoSeries series);
/* Of a path, in place of the linear identity's: energies. */
void HycoPathSummary(HycoFOM fom, HycoSummary *summary);

#endif
