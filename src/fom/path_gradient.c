/* The gradient of a path at full order, by the paths beside it in its own steps. */
#include <hycogradient.h>
#include <hycopath.h>

typedef struct {
  HycoFOM f;
  PetscInt n;
  PetscReal *taken; /* n: the steps of the solution */
} Work;

/* Solves at mu, without what shows a path to others. Collective. */
static PetscErrorCode Solve(HycoFOM f, const PetscReal mu[])
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
static PetscErrorCode Follow(void *context, const PetscReal mu[], const HycoStep *step[])
{
  const Work *o = (const Work *)context;
  HycoPath p = o->f->path;
  const PetscReal rtol = p->rtol;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  p->rtol = PetscMin(rtol, HYCO_GRADIENT_RTOL);
  p->n_given = o->n;
  p->given = o->taken;
  ierr = Solve(o->f, mu);
  p->rtol = rtol;
  p->n_given = 0;
  p->given = NULL;
  PetscCall(ierr);
  PetscCall(HycoPathCheckBeside(p->ended, p->n_cuts, p->why));
  *step = p->steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path is solved again at the end: the caller may ask for any of its results. */
PetscErrorCode HycoPathGradient(HycoFOM f, HycoGradient *gradient)
{
  HycoPath p = f->path;
  Work o = {.f = f, .n = p->n_taken};
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheck(p->ended, "there is no gradient: the path ends at t = %g, before its last time", (double)p->t);
  PetscCall(PetscArraycpy(mu, f->fe->mu, f->scene->n_variables));
  HycoDuplicate(p->n_taken, p->taken, &o.taken);
  ierr = HycoGradientOfPath(f->scene, mu, p->steps, &f->gradient, gradient, Follow, &o);
  if (!ierr) ierr = Solve(f, mu);
  if (ierr) f->solved = PETSC_FALSE;
  PetscCall(PetscFree(o.taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
