/* Differences of data along a parameter, or of paths, and the gradients that they give. */
#include <hycogradient.h>
#include <hycopath.h>

/* Share of a jump that remains at a quarter of the step: a kink keeps all of it, curvature a quarter. */
#define JUMP_STAYS 0.5
/* Of a value, its difference over a step: ten times the residual of solves, 1e-10 as a rule. */
#define DIFFERENCE_ROUND_OFF 1e-9
/* Of a value, its change over a step of HYCO_GRADIENT_STEP: 1350 eps; as a derivative 1e-8 of the value over the range.
   */
#define DERIVATIVE_ROUND_OFF 3e-13
/* Of an output's largest value on a path: the residual of the forces, 1e-8; less is round-off, as is a change over the
   range. */
#define NO_OUTPUT 1e-8

/* For gradients at full order and of models. */
PetscErrorCode HycoGradientCheckScene(HycoScene s)
{
  PetscFunctionBegin;
  HycoCheck(s->n_quantities, "a gradient is that of the scene's outputs, and it has none; add an entry output");
  HycoCheck(s->n_parameters, "a gradient is with respect to the scene's parameters, and it has none");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Central, or of second order to one side where the range ends (sign: the side); the points stay in the range, since
   expressions may be invalid beyond it. */
void HycoDifferenceSet(HycoScene scene, const PetscReal mu[], PetscInt p, PetscReal share, HycoDifference *d)
{
  const PetscReal width = scene->hi[p] - scene->lo[p];
  PetscReal h = share * (width > 0 ? width : PetscMax(PetscAbsReal(mu[p]), 1));
  const PetscBool inside = (PetscBool)(mu[p] >= scene->lo[p] && mu[p] <= scene->hi[p] && width > 0);

  /* So that the step taken is the step divided by. */
  h = (mu[p] + h) - mu[p]; /* representable */
  *d = (HycoDifference){.parameter = p, .step = {0, h, -h}, .weight = {0, 0.5 / h, -0.5 / h}, .sign = 1};
  if (!inside || (mu[p] - h >= scene->lo[p] && mu[p] + h <= scene->hi[p])) return;
  /* At the upper end downwards, elsewhere upwards: one-sided values are those towards larger parameters. */
  if (mu[p] + h > scene->hi[p]) d->sign = -1;
  h *= d->sign;
  *d = (HycoDifference){.parameter = p, .step = {0, h, 2 * h}, .weight = {-1.5 / h, 2 / h, -0.5 / h}, .sign = d->sign};
}

/* From the second order to the first: only the nearer point is on the same side of the kink. */
void HycoDifferenceTakeSide(HycoDifference *d)
{
  d->weight[0] = -1 / d->step[1];
  d->weight[1] = 1 / d->step[1];
  d->weight[2] = 0;
}

/* k = 0 is mu itself. Variables beyond the parameters (the time) keep their values. */
void HycoDifferencePoint(const HycoDifference *d, HycoScene scene, const PetscReal mu[], PetscInt k, PetscReal at[])
{
  for (PetscInt p = 0; p < scene->n_variables; p++) at[p] = mu[p] + (p == d->parameter ? d->step[k] : 0);
}

/* Kink or curvature: a jump of slopes stays, a difference by curvature is a quarter. */
void HycoDifferenceShrink(HycoDifference *d)
{
  for (PetscInt k = 0; k < 3; k++) {
    d->step[k] /= 4;
    d->weight[k] *= 4;
  }
}

/* The slopes to the two sides, or of the two parts of a one-sided difference. */
static void DifferenceQuotients(const HycoDifference *d, const PetscReal v[3], PetscReal slope[2])
{
  const PetscReal *s = d->step;

  slope[0] = (v[1] - v[0]) / (s[1] - s[0]);
  slope[1] = s[2] * s[1] < 0 ? (v[0] - v[2]) / (s[0] - s[2]) : (v[2] - v[1]) / (s[2] - s[1]);
}

/* 0: no jump beyond what a smooth function has, or round-off. slope: the scale of slopes (0: this value's own),
   size: of the values. */
PetscReal HycoDifferenceJump(const HycoDifference *d, PetscReal size, PetscReal slope, const PetscReal v[3])
{
  PetscReal s[2], jump;

  DifferenceQuotients(d, v, s);
  jump = PetscAbsReal(s[0] - s[1]);
  if (slope <= 0) slope = PetscMax(PetscAbsReal(s[0]), PetscAbsReal(s[1]));
  return jump > HYCO_KINK * slope && jump * PetscAbsReal(d->step[1]) > DIFFERENCE_ROUND_OFF * size ? jump : 0;
}

/* closer: at mu, and at the two points of the shrunk difference. */
PetscBool HycoDifferenceKinks(const HycoDifference *d, PetscReal jump, const PetscReal closer[3])
{
  HycoDifference near = *d;
  PetscReal s[2];

  HycoDifferenceShrink(&near);
  DifferenceQuotients(&near, closer, s);
  return (PetscBool)(jump > 0 && PetscAbsReal(s[0] - s[1]) > JUMP_STAYS * jump);
}

/* The store owns the arrays, which g borrows: a former gradient of the same object becomes invalid. */
PetscErrorCode HycoGradientCreate(HycoScene scene, HycoGradientStore *store, HycoGradient *g)
{
  const PetscInt n = scene->n_quantities * scene->n_parameters, n_times = scene->n_times;

  PetscFunctionBegin;
  PetscCall(HycoGradientDestroy(store));
  PetscCall(PetscCalloc1(n * (n_times + 1) + 1, &store->value));
  PetscCall(PetscCalloc1(n * (n_times + 1) + 1, &store->kink));
  *g = (HycoGradient){.n_outputs = scene->n_quantities,
                      .n_parameters = scene->n_parameters,
                      .n_times = n_times,
                      .value = store->value,
                      .kink = store->kink};
  if (!n_times) PetscFunctionReturn(PETSC_SUCCESS);
  /* The listed times one after the other, then the extremes over them. */
  g->times = store->value;
  g->times_kink = store->kink;
  g->value += n * (n_times - 1);
  g->kink += n * (n_times - 1);
  g->path = store->value + n * n_times;
  g->path_kink = store->kink + n * n_times;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe in its arrays. */
PetscErrorCode HycoGradientDestroy(HycoGradientStore *store)
{
  PetscFunctionBegin;
  HycoFreeAll(&store->value, &store->kink);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The jump of the slopes of output q. */
static PetscReal DifferencesJump(const HycoGradient *g, const HycoDifference *d, const PetscReal value[], PetscInt q)
{
  const PetscReal v[3] = {value[q], value[g->n_outputs + q], value[2 * g->n_outputs + q]};

  return HycoDifferenceJump(d, PetscMax(PetscAbsReal(v[0]), PetscAbsReal(v[1])), 0, v);
}

/* The derivative of output q from the values at the points of d. */
static void DifferencesSet(HycoGradient *g, HycoGradientStore *store, const HycoDifference *d, const PetscReal value[],
                           PetscInt q, PetscBool kink, PetscBool turns)
{
  const PetscInt at = q * g->n_parameters + d->parameter;
  HycoDifference side = *d;

  /* At a kink the mean of both slopes would be no derivative at all. */
  if (turns) HycoDifferenceTakeSide(&side);
  store->value[at] = 0;
  for (PetscInt k = 0; k < 3; k++) store->value[at] += side.weight[k] * value[k * g->n_outputs + q];
  /* Below the noise of the difference: a derivative that is exactly 0 has round-off of any sign. */
  if (PetscAbsReal(store->value[at] * d->step[1]) <= DERIVATIVE_ROUND_OFF * PetscAbsReal(value[q]))
    store->value[at] = 0;
  store->kink[at] = (PetscBool)(kink || turns);
}

/* The n outputs at the two points beside mu. */
static PetscErrorCode MeasurePerturbed(PetscInt n, HycoScene scene, const PetscReal mu[], const HycoDifference *d,
                                       HycoGradientMeasure measure, void *context, PetscReal value[])
{
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  /* The second first, where the data are that were moved to both before. */
  for (PetscInt j = 2; j > 0; j--) {
    HycoDifferencePoint(d, scene, mu, j, at);
    PetscCall((*measure)(context, at, d->step[j], value + j * n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outputs that are round-off at a time of a path, as stresses of bodies without loads, have no derivative, and no
   kink. */
static void DropRounding(const HycoGradient *g, HycoGradientStore *store, HycoScene s, PetscInt p,
                         const PetscReal value[])
{
  const PetscReal width = s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1;

  for (PetscInt q = 0; q < g->n_outputs; q++) {
    const PetscInt at = q * g->n_parameters + p;
    const PetscReal least = NO_OUTPUT * store->most[q];

    if (PetscAbsReal(value[q]) > least || PetscAbsReal(store->value[at]) * width > least) continue;
    store->value[at] = 0;
    store->kink[at] = PETSC_FALSE;
  }
}

/* Closer differences only of outputs whose slopes jump: they tell a kink from curvature, and are of one side of a kink
   that lies between their points and the farther ones. */
PetscErrorCode HycoGradientColumn(HycoGradient *g, HycoGradientStore *store, HycoScene scene, const PetscReal mu[],
                                  const HycoDifference *d, PetscBool kink, HycoGradientMeasure measure, void *context,
                                  PetscReal value[])
{
  const PetscInt n = g->n_outputs;
  PetscReal *closer = value + 3 * n; /* the room's second half: value is 6 x n_outputs */
  HycoDifference at = *d;
  PetscReal *jump;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(MeasurePerturbed(n, scene, mu, d, measure, context, value));
  PetscCall(PetscMalloc1(n + 1, &jump));
  for (PetscInt q = 0; q < n; q++) {
    DifferencesSet(g, store, d, value, q, kink, PETSC_FALSE);
    jump[q] = 1;
  }
  /* Of a path each closer difference is two paths more. */
  for (PetscInt k = g->n_times ? HYCO_GRADIENT_CLOSER - 1 : 0; k < HYCO_GRADIENT_CLOSER; k++) {
    HycoDifference near = at;
    PetscBool any = PETSC_FALSE;

    for (PetscInt q = 0; q < n; q++) {
      if (jump[q] > 0) jump[q] = DifferencesJump(g, &at, value, q);
      any = (PetscBool)(any || jump[q] > 0);
    }
    if (!any) break;
    HycoDifferenceShrink(&near);
    for (PetscInt q = 0; q < n; q++) closer[q] = value[q];
    ierr = MeasurePerturbed(n, scene, mu, &near, measure, context, closer);
    if (ierr) PetscCall(PetscFree(jump));
    PetscCall(ierr);
    for (PetscInt q = 0; q < n; q++) {
      const PetscReal v[3] = {closer[q], closer[n + q], closer[2 * n + q]};

      if (jump[q] > 0) DifferencesSet(g, store, &near, closer, q, kink, HycoDifferenceKinks(&at, jump[q], v));
    }
    for (PetscInt q = n; q < 3 * n; q++) value[q] = closer[q];
    at = near;
  }
  if (store->most && !kink) DropRounding(g, store, scene, d->parameter, value);
  PetscCall(PetscFree(jump));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- paths -- */

void HycoPathLargest(HycoScene s, const HycoStep step[], PetscReal most[])
{
  for (PetscInt q = 0; q < s->n_quantities; q++) {
    most[q] = 0;
    for (PetscInt k = 0; k < s->n_times; k++) most[q] = PetscMax(most[q], PetscAbsReal(step[k].quantity[q]));
  }
}

typedef struct {
  HycoScene scene;
  HycoGradientFollow follow;
  void *context;
} Beside;

/* A path beside this one that chooses other steps has another error in time: the difference would be that of the
   steps, divided by a small number. */
PetscErrorCode HycoPathCheckPerturbed(PetscBool ended, PetscInt cuts, const char why[])
{
  PetscFunctionBegin;
  HycoCheck(ended && !cuts,
            "there is no gradient: a path beside this one %s (%s); smaller steps (-hyco_substeps) may avoid it",
            ended ? "halves its steps" : "ends early", why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs at all listed times, then their extremes. */
static void DifferencesGather(HycoScene scene, const HycoStep step[], PetscReal output[])
{
  const PetscInt n = scene->n_quantities;

  for (PetscInt k = 0; k < scene->n_times; k++) {
    for (PetscInt q = 0; q < n; q++) output[k * n + q] = step[k].quantity[q];
  }
  HycoPathExtremes(scene, scene->n_times, step, output + scene->n_times * n);
}

/* step: not used; the outputs of a path are those of its own listed times, not of a displaced mesh. */
static PetscErrorCode MeasurePath(void *context, const PetscReal mu[], PetscReal step, PetscReal output[])
{
  const Beside *b = (const Beside *)context;
  const HycoStep *steps;

  PetscFunctionBegin;
  (void)step;
  PetscCall((*b->follow)(b->context, mu, &steps));
  DifferencesGather(b->scene, steps, output);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The steps in time stay those of the solution: with steps that each path chooses, outputs would jump along a
   parameter. Newton's tolerance is small beside the difference of the paths. */
PetscErrorCode HycoGradientOfPath(HycoScene scene, const PetscReal mu[], const HycoStep step[],
                                  HycoGradientStore *store, HycoGradient *g, HycoGradientFollow follow, void *context)
{
  Beside beside = {scene, follow, context};
  HycoGradient all;
  PetscReal *value;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(HycoGradientCreate(scene, store, g));
  all = *g;
  /* Each output at each listed time, and its extreme over them, as if they were outputs of their own. */
  all.n_outputs *= scene->n_times + 1;
  /* At mu, and at the points of a difference with one closer step. */
  PetscCall(PetscCalloc1(6 * all.n_outputs + 1, &value));
  DifferencesGather(scene, step, value);
  for (PetscInt p = 0; p < g->n_parameters && !ierr; p++) {
    HycoDifference d;

    HycoDifferenceSet(scene, mu, p, HYCO_GRADIENT_PATH_STEP, &d);
    ierr = HycoGradientColumn(&all, store, scene, mu, &d, PETSC_FALSE, MeasurePath, &beside, value);
  }
  PetscCall(PetscFree(value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether v is an extreme as `most` is, but for round-off. */
static PetscBool DifferencesIsExtreme(const HycoQuantity *of, PetscReal v, PetscReal most)
{
  const PetscReal room = HYCO_UNDECIDED * PetscAbsReal(most);

  return (PetscBool)(!HycoPathIsBeyond(of, most, v + room) || !HycoPathIsBeyond(of, most, v - room));
}

/* Of output q along parameter p. Of the times that share the extreme that one decides which has it beside mu. */
static void SetExtreme(HycoScene scene, const HycoStep step[], const HycoDifference *d, PetscInt q, PetscReal most,
                       HycoGradientStore *store, const HycoGradient *g)
{
  const HycoQuantity *of = &scene->quantity[q];
  const PetscInt n = g->n_outputs * g->n_parameters, at = q * g->n_parameters + d->parameter;
  PetscReal beside = 0, slope = 0;
  PetscInt chosen = -1;

  for (PetscInt k = 0; k < g->n_times; k++) {
    const PetscReal v = step[k].quantity[q], size = PetscAbsReal(most);
    /* Equal values, so that slopes alone decide. */
    const PetscReal moved = (v < 0 ? -size : size) + d->step[1] * store->value[k * n + at];

    if (!DifferencesIsExtreme(of, v, most)) continue;
    slope = PetscMax(slope, PetscAbsReal(store->value[k * n + at]));
    if (chosen >= 0 && !HycoPathIsBeyond(of, moved, beside)) continue;
    chosen = k;
    beside = moved;
  }
  /* A number that is no number ties with none. */
  chosen = PetscMax(chosen, 0);
  store->value[g->n_times * n + at] = store->value[chosen * n + at];
  store->kink[g->n_times * n + at] = store->kink[chosen * n + at];
  for (PetscInt k = 0; k < g->n_times; k++) {
    if (DifferencesIsExtreme(of, step[k].quantity[q], most) &&
        PetscAbsReal(store->value[k * n + at] - store->value[chosen * n + at]) > HYCO_KINK * slope)
      store->kink[g->n_times * n + at] = PETSC_TRUE;
  }
}

void HycoGradientOfExtremes(HycoScene scene, const PetscReal mu[], const HycoStep step[], HycoGradientStore *store,
                            const HycoGradient *g)
{
  PetscReal most[HYCO_MAX_QUANTITIES];

  HycoPathExtremes(scene, g->n_times, step, most);
  for (PetscInt p = 0; p < g->n_parameters; p++) {
    HycoDifference d;

    HycoDifferenceSet(scene, mu, p, HYCO_GRADIENT_STEP, &d);
    for (PetscInt q = 0; q < g->n_outputs; q++) SetExtreme(scene, step, &d, q, most[q], store, g);
  }
}
