/* The gradient of a path at full order: step by step, else by the paths beside it in its own steps. */
#include "sensitivity_step.h"

typedef struct {
  HycoFOM f;
  PetscInt n;
  PetscReal *taken; /* n: the steps of the solution */
} Work;

/* Solves at mu, without what shows a path to others. Collective. */
static PetscErrorCode PathGradientSolve(HycoFOM f, const PetscReal mu[])
{
  HycoPath p = f->path;
  const HycoStepMonitor monitor = p->monitor;
  PetscErrorCode (*const between)(HycoFOM, void *) = p->between;
  HycoSeries series = p->series;
  const PetscBool resume = p->resume;
  char checkpoint[PETSC_MAX_PATH_LEN], fclib[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(fclib, p->fclib, sizeof(fclib)));
  p->fclib[0] = '\0';
  PetscCall(PetscStrncpy(checkpoint, p->checkpoint, sizeof(checkpoint)));
  /* Paths beside the solution must not print, write a series, resume, or overwrite the checkpoint of the solution.
     */
  p->monitor = NULL;
  p->between = NULL;
  p->series = NULL;
  p->resume = PETSC_FALSE;
  p->checkpoint[0] = '\0';
  ierr = HycoFOMSolve(f, f->scene->n_parameters, mu);
  /* Also after an error: the caller may go on with this model. */
  p->monitor = monitor;
  p->between = between;
  p->series = series;
  p->resume = resume;
  PetscCall(PetscStrncpy(p->checkpoint, checkpoint, sizeof(p->checkpoint)));
  PetscCall(PetscStrncpy(p->fclib, fclib, sizeof(p->fclib)));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoGradientFollow. */
static PetscErrorCode PathGradientFollow(void *context, const PetscReal mu[], const HycoStep *step[])
{
  const Work *o = (const Work *)context;
  HycoPath p = o->f->path;
  const PetscReal rtol = p->rtol;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  p->rtol = PetscMin(rtol, HYCO_TIGHT_NEWTON);
  p->n_given = o->n;
  p->given = o->taken;
  ierr = PathGradientSolve(o->f, mu);
  p->rtol = rtol;
  p->n_given = 0;
  p->given = NULL;
  PetscCall(ierr);
  PetscCall(HycoPathCheckPerturbed(p->ended, p->n_cuts, p->why));
  *step = p->steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path that is solved again for its derivatives. */
typedef struct {
  HycoFOM f;
  HycoSensitivityStep along;
  const HycoGradient *gradient;
  PetscReal most[HYCO_MAX_QUANTITIES]; /* the largest of each output on the path */
  PetscBool done;                      /* no step so far lacks them */
} Again;

/* After an accepted step. Those of elastic bodies without friction do not depend on each other, and are left out
   between the listed times. */
static PetscErrorCode PathGradientPass(HycoPath p, PetscReal t0, void *context)
{
  Again *o = (Again *)context;
  HycoFOM f = o->f;
  const PetscInt n = o->gradient->n_outputs, np = o->gradient->n_parameters;
  const PetscBool lists = (PetscBool)(p->t == p->scene->times[p->step]);
  HycoGradientStore there = {f->gradient.value + p->step * n * np, f->gradient.kink + p->step * n * np, o->most};
  HycoGradient at = {.n_outputs = n, .n_parameters = np};

  PetscFunctionBegin;
  if (!o->done || (!lists && !f->path->friction && !p->flows)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSensitivityAdvance(o->along, t0, &o->done));
  if (o->done) PetscCall(HycoFOMStateGradient(f, o->along, lists ? &there : NULL, &at, &o->done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All facets of masters that the points beside the path need: along the path the surfaces stay. Collective. */
static PetscErrorCode PathGradientFetch(HycoFOM f, const PetscReal mu[])
{
  PetscReal at[HYCO_MAX_PARAMETERS];
  HycoDifference d;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < f->scene->n_parameters && f->size > 1 && f->searches; p++) {
    HycoDifferenceSet(f->scene, mu, p, HYCO_GRADIENT_STEP, &d);
    for (PetscInt j = 1; j < 3; j++) {
      HycoDifferencePoint(&d, f->scene, mu, j, at);
      PetscCall(HycoFOMSetParameters(f, at));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path again, with the gradient of its steps; *done false: one has none. Collective. */
static PetscErrorCode BySteps(HycoFOM f, const PetscReal mu[], HycoGradient *gradient, PetscBool *done)
{
  HycoPath p = f->path;
  Again o = {.f = f, .gradient = gradient, .done = PETSC_TRUE};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoGradientCreate(f->scene, &f->gradient, gradient));
  HycoPathLargest(f->scene, p->steps, o.most);
  ierr = PathGradientFetch(f, mu);
  if (!ierr) ierr = HycoSensitivityCreate(f, &o.along);
  p->passes = PathGradientPass;
  p->passes_ctx = &o;
  if (!ierr) ierr = PathGradientSolve(f, mu);
  p->passes = NULL;
  *done = (PetscBool)(!ierr && o.done);
  PetscCall(HycoSensitivityDestroy(&o.along));
  PetscCall(ierr);
  if (*done) HycoGradientOfExtremes(f->scene, mu, p->steps, &f->gradient, gradient);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same by the paths beside it. The path is solved again at the end: the caller may ask for any of its results. */
static PetscErrorCode PathGradientPerturbedResidual(HycoFOM f, const PetscReal mu[], HycoGradient *gradient)
{
  HycoPath p = f->path;
  Work o = {.f = f, .n = p->n_taken};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoDuplicate(p->n_taken, p->taken, &o.taken);
  ierr = HycoGradientOfPath(f->scene, mu, p->steps, &f->gradient, gradient, PathGradientFollow, &o);
  if (!ierr) ierr = PathGradientSolve(f, mu);
  PetscCall(PetscFree(o.taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathGradient(HycoFOM f, HycoGradient *gradient)
{
  HycoPath p = f->path;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool done = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheck(p->ended, "there is no gradient: the path ends at t = %g, before its last time", (double)p->t);
  PetscCall(PetscArraycpy(mu, f->fe->mu, f->scene->n_variables));
  if (!p->contact.solver->iterative) HycoOnError(BySteps(f, mu, gradient, &done), f->solved = PETSC_FALSE);
  if (!done) HycoOnError(PathGradientPerturbedResidual(f, mu, gradient), f->solved = PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
