/* The gradient of a predicted path: step by step, else by the paths beside it in its own steps. */
#include <hycogradient.h>
#include <hycomaterialimpl.h>
#include <hycoromimpl.h>

typedef struct {
  HycoROM m;
  PetscInt n;
  PetscReal *taken; /* n: the steps of the prediction */
} Work;

/* A HycoGradientFollow. */
static PetscErrorCode PathGradientFollow(void *context, const PetscReal mu[], const HycoStep *step[])
{
  const Work *o = (const Work *)context;
  HycoTrace *trace = &o->m->trace;
  const HycoTrace before = *trace;
  HycoHistory history;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  /* The difference of two paths is a small share of either: what Newton's method leaves must be small beside it.
     */
  trace->rtol = HYCO_TIGHT_NEWTON;
  trace->n_given = o->n;
  trace->given = o->taken;
  ierr = HycoROMPredict(o->m, o->m->model->scene->n_parameters, mu);
  trace->rtol = 0;
  trace->n_given = before.n_given;
  trace->given = before.given;
  PetscCall(ierr);
  PetscCall(HycoROMGetHistory(o->m, &history));
  PetscCall(HycoPathCheckPerturbed(history.ended, trace->n_cuts, history.why));
  *step = history.step;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The state of an accepted step; at a listed time with its results, and those of a prediction of its own. */
static PetscErrorCode TakeStep(HycoROM m, PetscInt k, PetscInt listed, PetscBool *done)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (listed >= 0)
    PetscCall(HycoROMSetStep(m, listed));
  else {
    HycoSceneSetTime(m->model->scene, m->fe->mu, m->trace.t[k], mu);
    PetscCall(HycoROMBringRows(m, mu));
  }
  PetscCall((*m->ops->linearise)(m, k, listed, done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs at a listed time: of bodies that flow those of the path, which has their stresses. */
static PetscErrorCode MeasureListed(HycoROM m, PetscInt listed)
{
  PetscFunctionBegin;
  if (HycoSceneFlows(m->model->scene))
    PetscCall(PetscArraycpy(m->prediction.quantity, m->trace.step[listed].quantity, m->model->scene->n_quantities));
  else
    PetscCall(HycoROMMeasureQuantities(m, &m->prediction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the steps one after the other; without friction and flow these do not depend on each other, and those between the
   listed times are left out. *done: false, where one has no derivative. */
static PetscErrorCode AtTimes(HycoROM m, const HycoStep step[], HycoGradient *gradient, PetscBool *done)
{
  const PetscInt n = gradient->n_outputs * gradient->n_parameters, n_listed = m->trace.n_listed;
  const PetscBool flows = HycoSceneFlows(m->model->scene),
                  all = (PetscBool)(flows || HycoSceneHasFriction(m->model->scene));
  PetscReal most[HYCO_MAX_QUANTITIES];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *done = PETSC_TRUE;
  HycoPathLargest(m->model->scene, step, most);
  for (PetscInt k = 0, listed = 0; k < m->trace.n && *done; k++) {
    const PetscBool lists = (PetscBool)(listed < n_listed && m->trace.at[listed] == k);
    HycoGradientStore there = {m->gradient.value + listed * n, m->gradient.kink + listed * n, most};
    HycoGradient at = {.n_outputs = gradient->n_outputs, .n_parameters = gradient->n_parameters};

    if (!lists && !all) continue;
    PetscCall(TakeStep(m, k, lists ? listed : -1, done));
    if (!*done) break;
    if (flows) PetscCall(HycoROMOutputsStep(m, k));
    m->trace.n_listed = 0; /* the outputs are those of this state, and of no path */
    ierr = lists ? MeasureListed(m, listed) : PETSC_SUCCESS;
    m->measured = lists;
    if (!ierr) ierr = HycoROMStateGradient(m, lists ? &there : NULL, &at, done);
    m->trace.n_listed = n_listed;
    PetscCall(ierr);
    listed += lists;
  }
  if (*done) HycoGradientOfExtremes(m->model->scene, m->fe->mu, step, &m->gradient, gradient);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The gradient of a path step by step, where its type has that. */
static PetscErrorCode ByTimes(HycoROM m, const HycoStep step[], HycoGradient *gradient, PetscBool *done)
{
  const HycoPrediction prediction = m->prediction;
  const PetscBool measured = m->measured;
  const PetscInt shown = m->trace.shown;
  PetscBool able = PETSC_FALSE, flows = HycoSceneFlows(m->model->scene), focused = PETSC_FALSE;

  PetscFunctionBegin;
  *done = PETSC_FALSE;
  PetscTryTypeMethod(m, linearise, -1, -1, &able);
  if (!able || (flows && !HycoROMOutputsFollow(m))) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoGradientCreate(m->model->scene, &m->gradient, gradient));
  if (flows) PetscCall(HycoROMFocusPath(m, &focused));
  HycoOnError(AtTimes(m, step, gradient, done), m->solved = m->ready = PETSC_FALSE);
  if (focused) PetscCall(HycoROMUnfocusOutputs(m));
  m->prediction = prediction;
  m->measured = measured;
  PetscCall(HycoROMSetStep(m, shown));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path is predicted again at the end: the caller may ask for any of its results, which do not depend on the order
   of predictions. */
PetscErrorCode HycoROMPathGradient(HycoROM m, HycoGradient *gradient)
{
  const PetscInt shown = m->trace.shown;
  Work o = {.m = m};
  HycoHistory history;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool done;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMGetHistory(m, &history));
  HycoCheck(history.ended, "there is no gradient: the path ends at t = %g, before its last time", (double)history.t);
  PetscCall(ByTimes(m, history.step, gradient, &done));
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  /* Copies: predictions beside mu overwrite both. */
  PetscCall(PetscArraycpy(mu, m->fe->mu, m->model->scene->n_variables));
  o.n = history.n_taken;
  HycoDuplicate(o.n, history.taken, &o.taken);
  ierr = HycoGradientOfPath(m->model->scene, mu, history.step, &m->gradient, gradient, PathGradientFollow, &o);
  if (!ierr) ierr = HycoROMPredict(m, m->model->scene->n_parameters, mu);
  if (!ierr) ierr = HycoROMSetStep(m, shown);
  /* The handle then has the results of a path beside the one that was asked for. */
  if (ierr) m->solved = PETSC_FALSE;
  PetscCall(PetscFree(o.taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
