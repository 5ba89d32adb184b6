/* The gradient of a predicted path, by the paths beside it in its own steps. */
#include <hycogradient.h>
#include <hycoromimpl.h>

typedef struct {
  HycoROM m;
  PetscInt n;
  PetscReal *taken; /* n: the steps of the prediction */
} Work;

/* A HycoGradientFollow. */
static PetscErrorCode Follow(void *context, const PetscReal mu[], const HycoStep *step[])
{
  const Work *o = (const Work *)context;
  HycoTrace *trace = &o->m->trace;
  const HycoTrace before = *trace;
  HycoHistory history;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  /* The difference of two paths is a small share of either: what Newton's method leaves must be small beside it.
     */
  trace->rtol = HYCO_GRADIENT_RTOL;
  trace->n_given = o->n;
  trace->given = o->taken;
  ierr = HycoROMPredict(o->m, o->m->model->scene->n_parameters, mu);
  trace->rtol = 0;
  trace->n_given = before.n_given;
  trace->given = before.given;
  PetscCall(ierr);
  PetscCall(HycoROMGetHistory(o->m, &history));
  PetscCall(HycoPathCheckBeside(history.ended, trace->n_cuts, history.why));
  *step = history.step;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path is predicted again at the end: the caller may ask for any of its results, which do not depend on the order of
   predictions. */
PetscErrorCode HycoROMPathGradient(HycoROM m, HycoGradient *gradient)
{
  const PetscInt shown = m->trace.shown;
  Work o = {.m = m};
  HycoHistory history;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMGetHistory(m, &history));
  HycoCheck(history.ended, "there is no gradient: the path ends at t = %g, before its last time", (double)history.t);
  /* Copies: predictions beside mu overwrite both. */
  PetscCall(PetscArraycpy(mu, m->fe->mu, m->model->scene->n_variables));
  o.n = history.n_taken;
  HycoDuplicate(o.n, history.taken, &o.taken);
  ierr = HycoGradientOfPath(m->model->scene, mu, history.step, &m->gradient, gradient, Follow, &o);
  if (!ierr) ierr = HycoROMPredict(m, m->model->scene->n_parameters, mu);
  if (!ierr) ierr = HycoROMSetStep(m, shown);
  /* The handle then has the results of a path beside the one that was asked for. */
  if (ierr) m->solved = PETSC_FALSE;
  PetscCall(PetscFree(o.taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
