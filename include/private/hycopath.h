/* HycoPath: the solution of a scene with a history, from its first time to its last: substeps, Newton's method,
 * energies. */
#ifndef HYCOPATH_H
#define HYCOPATH_H

#include <hycofomimpl.h>
#include <hycoinelastic.h>

typedef struct _n_HycoSeries *HycoSeries;

/* What one iteration of a step solves with: the consistent tangent, or the elastic stiffness, whose factor stays. */
typedef enum { HYCO_NEWTON_AUTO, HYCO_NEWTON_TANGENT, HYCO_NEWTON_ELASTIC } HycoNewton;

#define HYCO_ANDERSON 5 /* depth of the acceleration */

/* An attempt at a step of time. */
typedef struct {
  PetscBool converged, easy;
  char why[HYCO_LINE]; /* else */
  PetscInt iterations; /* contact systems solved */
  PetscInt factors;    /* of them with a new stiffness */
  PetscInt active_its; /* iterations within them */
  PetscReal residual;  /* of equilibrium, relative to the largest of |f_int|, |F|, |B^T L| */
  PetscReal order;     /* observed; 0: too few iterations to tell */
  PetscReal seconds_factor, seconds_solve, seconds_law;
  HycoFEStepReport law; /* over all ranks */
} HycoAttempt;

typedef struct {
  PetscReal loads, supports, contact; /* work of loads, of moved supports, against contact forces */
  PetscReal stored, dissipated, thermal, moduli;
  PetscReal defect, size; /* of their balance, the largest of a step so far; the sum of the terms' sizes */
} HycoWork;

struct _n_HycoPath {
  /* options */
  PetscInt method; /* a HycoNewton */
  PetscInt max_its, substeps;
  PetscReal rtol, bound, smallest;
  char checkpoint[PETSC_MAX_PATH_LEN];
  PetscBool resume;
  /* state of the material at the last accepted time, and of the attempt */
  HycoFEState begin, end;
  /* distributed, as U: loads alone, of the attempt and of the last accepted time; internal forces, the same */
  Vec F, F_old, f_int, f_old, r, U_old, work, diagonal;
  Vec L_old, gap_work;     /* as Lambda; NULL without contact */
  PetscReal *f_local, *u0; /* of the part's n_dof */
  PetscBool tangent;       /* f->K is a tangent, not the elastic stiffness */
  PetscBool flows;         /* some body's law has a memory */
  /* Anderson's acceleration: differences of iterates and residuals, newest last */
  PetscInt n_mixed;
  Vec dU[HYCO_ANDERSON], dG[HYCO_ANDERSON], U_last, G_last, G;
  Vec dL[HYCO_ANDERSON], L_last, L_new;
  /* where the path is */
  PetscReal mu[HYCO_MAX_PARAMETERS], t, dt;
  PetscInt step; /* listed times reached: the index of the next */
  HycoWork work_done;
  HycoKKT kkt;  /* of the last accepted time */
  HycoStep now; /* since the last listed time */
  PetscInt n_steps;
  HycoStep *steps;
  PetscReal *orders; /* of the attempts that told one */
  PetscInt n_orders, room_orders;
  PetscBool ended; /* the last path reached its end */
  char why[HYCO_LINE];
  HycoSeries series; /* NULL: none is asked for */
  HycoStepMonitor monitor;
  void *monitor_ctx;
};

PetscErrorCode HycoPathCreate(HycoFOM fom);
PetscErrorCode HycoPathDestroy(HycoFOM fom);
/* Declares and reads the options of -hyco_newton and their kin. */
PetscErrorCode HycoPathSetFromOptions(HycoFOM fom, HycoOptionItems PetscOptionsObject);
/* Fails where one of them is given and the scene has no history. */
PetscErrorCode HycoPathRefuseOptions(HycoFOM fom);
/* Solves the history at mu; not reaching its end is told by the summary's reason. Collective. */
PetscErrorCode HycoPathSolve(HycoFOM fom, const PetscReal mu[]);
/* One attempt, from the accepted state at t0 to t1: U, Lambda and the state `end`. Collective. */
PetscErrorCode HycoPathAttempt(HycoFOM fom, PetscReal t0, PetscReal t1, HycoAttempt *attempt);
/* U and Lambda of the last accepted time again. */
PetscErrorCode HycoPathRestore(HycoFOM fom);
/* Everything at t but the solution: the scene's parts, and the loads without what moved supports do. Collective. */
PetscErrorCode HycoPathAssemble(HycoFOM fom, PetscReal t);
/* How many solves a factor with its flexibility costs, as a rule: in 3D 24 were counted at 29,000 unknowns and 50 at
   118,000, the root of their number; in 2D a fifth of that. */
PetscReal HycoPathFactorCost(HycoFOM fom);
/* Whether steps are solved with the elastic stiffness. */
PetscBool HycoPathPrefersElastic(HycoFOM fom);
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
/* Of a path, in place of the linear identity's: energies. */
void HycoPathSummary(HycoFOM fom, HycoSummary *summary);

#endif
