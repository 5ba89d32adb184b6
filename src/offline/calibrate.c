/*
  The accuracy of a model: compares its predictions at held-out points with their full-order solutions, and calibrates
  the online error estimates with the result (error_estimate.c). A log-linear formula is fitted to the errors and
  raised above BOUNDED_SHARE of them, each compared with a formula fitted without it. Held-out points are distributed
  like a user's points over the region of training, so that the quantile number ceil(BOUNDED_SHARE (n + 1)) of the
  ratios is a bound for BOUNDED_SHARE of future points (split conformal prediction: Vovk, Gammerman, Shafer,
  Algorithmic Learning in a Random World, 2005), however accurate the formula is; an accurate formula only makes the
  bound tighter. The settings were chosen with the same points, for which CHOICE_MARGIN allows. The scene's outputs
  have formulas for their absolute errors (judge_outputs.c).
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>
#include <math.h>
#include <stdio.h>

/* Share of the held-out errors that estimates bound: more than the 0.9 that is promised, which each drawn scene then
   reaches at unseen points (tests/drawn/run). */
#define BOUNDED_SHARE 0.93
/* Factor of the estimates, because the settings were chosen by the same points: errors at unseen points of drawn scenes
   (tests/drawn/run). */
#define CHOICE_MARGIN 1.2
#define LEAST         10 /* smallest number of predictions for a formula */
/* Share of a feature's median, its floor: a smaller feature is no sign of a smaller error. */
#define LEAST_FEATURE 0.3
/* Of the median of the errors: the least error that is distinguished, as one exact point must not tilt a formula of
   logarithms. */
#define NEGLIGIBLE 1e-3

/* The estimated errors, in the order of HycoEstimateKind. */
static const HycoErrorKind errors[HYCO_N_ESTIMATES] = {HYCO_ERROR_U, HYCO_ERROR_SIGMA, HYCO_ERROR_LAMBDA};

/* Median of the positive ones of value[0], value[stride], ..., or `otherwise`. Positive ones only: errors and
   features that are exactly zero would pull a floor to zero, by which they are divided. */
static PetscErrorCode CalibrateMedian(PetscInt n, const PetscReal value[], PetscInt stride, PetscReal otherwise,
                                      PetscReal *median)
{
  PetscReal *positive;
  PetscInt m = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &positive));
  for (PetscInt i = 0; i < n; i++) {
    if (value[i * stride] > 0) positive[m++] = value[i * stride];
  }
  PetscCall(PetscSortReal(m, positive));
  *median = m ? positive[m / 2] : otherwise;
  PetscCall(PetscFree(positive));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The median distance of a training point from the nearest other: the floor of the feature "distance". Twins have
   no distance from each other (d > 0), and count by their next neighbour. */
static PetscErrorCode CalibrateSpacing(HycoReducer t, PetscReal *spacing)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscReal *nearest;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, &mu));
  PetscCall(PetscCalloc1(n, &nearest));
  for (PetscInt k = 0; n_par && k < n; k++) {
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal d = HycoEstimatesDistance(t->scene, mu + k * n_par, mu + j * n_par);

      /* O(n^2) distances: thousands of points take well below a second. */
      if (d > 0 && (nearest[k] == 0 || d < nearest[k])) nearest[k] = d;
    }
  }
  PetscCall(CalibrateMedian(n, nearest, 1, 1, spacing));
  PetscCall(PetscFree(nearest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean of a formula over n rows of X. */
static PetscReal MeanOf(PetscInt n, const PetscReal X[], const PetscReal law[])
{
  const PetscInt p = HYCO_ESTIMATE_FEATURES;
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n * p; i++) sum += law[i % p] * X[i];
  return law[p] + sum / n;
}

/* Replaces a formula by that of the error of u, stress or forces, raised above the errors y in the same way, if its
   mean is smaller. The error of an output has a sign and passes through zero, so that its logarithm scatters more than
   that of a norm, and coefficients fitted to it are less certain. */
static PetscErrorCode CalibrateBorrow(PetscInt n, const PetscInt group[], const PetscReal X[], const PetscReal y[],
                                      const HycoEstimates *estimates, PetscReal law[])
{
  PetscReal other[HYCO_ESTIMATE_FEATURES + 1];

  PetscFunctionBegin;
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
    if (!estimates->has[e]) continue;
    PetscCall(PetscArraycpy(other, estimates->law[e], HYCO_ESTIMATE_FEATURES + 1));
    /* Raised anew: the constant of another error says nothing about this one. */
    PetscCall(HycoRaiseBound(n, group, HYCO_ESTIMATE_FEATURES, X, y, BOUNDED_SHARE, other));
    if (MeanOf(n, X, other) < MeanOf(n, X, law)) PetscCall(PetscArraycpy(law, other, HYCO_ESTIMATE_FEATURES + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fits the formula for these errors. Those up to `least`, for example of forces without contact, contain no information
   on their size: they come last, and only raise the bound. On logarithms: errors and features span orders of magnitude,
   and their relation is nearly a power law there. */
static PetscErrorCode CalibrateFit(PetscInt n, const HycoHeldOut rows[], const PetscReal error[], PetscReal least,
                                   const HycoEstimates *estimates, PetscBool borrow, PetscReal law[])
{
  const PetscInt p = HYCO_ESTIMATE_FEATURES;
  PetscReal *X, *y;
  PetscInt filled = 0, explanatory = 0, *group;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n * p, &X, n, &y, n, &group));
  /* Two passes put the telling ones first, as HycoUpperBound() expects. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < n; i++) {
      if ((error[i] > least) != (pass == 0)) continue;
      for (PetscInt j = 0; j < p; j++) X[filled * p + j] = PetscLogReal(1 + rows[i].feature[j] / estimates->floor[j]);
      group[filled] = (PetscInt)rows[i].group;
      y[filled++] = PetscLogReal(PetscMax(error[i], least));
      if (pass == 0) explanatory = filled;
    }
  }
  PetscCall(HycoUpperBound(n, explanatory ? explanatory : n, group, p, X, y, BOUNDED_SHARE, law));
  if (borrow) PetscCall(CalibrateBorrow(n, group, X, y, estimates, law));
  law[p] += PetscLogReal(CHOICE_MARGIN);
  PetscCall(PetscFree3(X, y, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One kind of error; no estimate if one is not finite. An error that is infinite (not converged, x/0) has no
   logarithm; an estimate without it would bound less than it says. */
static PetscErrorCode FitError(PetscInt n, const HycoHeldOut rows[], HycoEstimateKind kind, HycoEstimates *estimates)
{
  PetscReal *error, median;
  PetscBool finite = PETSC_TRUE, compared = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &error));
  for (PetscInt i = 0; i < n; i++) {
    /* Forces and stresses are guarded: below a tenth of the largest they are relative to that tenth. */
    error[i] = HycoHeldOutError(&rows[i], errors[kind], estimates->force);
    compared = (PetscBool)(compared || !PetscIsNanReal(error[i]));
    if (PetscIsNanReal(error[i])) error[i] = 0;
    finite = (PetscBool)(finite && !PetscIsInfOrNanReal(error[i]));
  }
  PetscCall(CalibrateMedian(n, error, 1, PETSC_SMALL, &median));
  estimates->has[kind] = (PetscBool)(finite && compared && (kind != HYCO_ESTIMATE_LAMBDA || estimates->force > 0));
  if (estimates->has[kind])
    PetscCall(CalibrateFit(n, rows, error, NEGLIGIBLE * median, estimates, PETSC_FALSE, estimates->law[kind]));
  PetscCall(PetscFree(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How the errors of an output follow the field that decides it: the largest over its norm, and over its error. */
static void CalibrateIntegrate(PetscInt n, const HycoHeldOut rows[], const HycoOutputErrors found[], PetscInt q,
                               const HycoScene scene, PetscReal force, HycoOutputEstimate *o)
{
  const HycoPrediction none = {0};
  HycoEstimateKind kind;

  (void)HycoOutputNorm(&scene->quantity[q], &none, &kind);
  for (PetscInt i = 0; i < n; i++) o->norm = PetscMax(o->norm, found[i].norm[q]);
  for (PetscInt i = 0; i < n && o->norm > 0; i++) {
    const PetscReal norm = PetscMax(found[i].norm[q], HYCO_SMALL_FORCE * o->norm),
                    field = PetscMax(HycoHeldOutError(&rows[i], errors[kind], force), PETSC_MACHINE_EPSILON);

    o->relative = PetscMax(o->relative, found[i].error[q] / norm);
    o->amplified = PetscMax(o->amplified, found[i].error[q] / norm / field);
  }
}

/* One output of the scene: its errors at the converged points, and the formula for them. Errors up to round-off of the
   output's largest value are not told apart: relative to the output itself they have no meaning where it is zero, and
   relative to its spread none where it is constant. No estimate if an error is not known, or if the output is always
   zero. */
static PetscErrorCode FitOutput(PetscInt n, const HycoHeldOut rows[], const HycoOutputErrors found[], PetscInt q,
                                const HycoScene scene, HycoEstimates *estimates)
{
  HycoOutputEstimate *o = &estimates->output[q];
  PetscReal *error, *sorted, least, median;
  PetscInt m = 0;

  PetscFunctionBegin;
  *o = (HycoOutputEstimate){.magnitude = -1, .median = -1, .largest = -1};
  for (PetscInt i = 0; i < n; i++) {
    if (PetscIsInfReal(found[i].error[q]) || PetscIsInfOrNanReal(found[i].size[q])) PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(n, &error, n, &sorted));
  for (PetscInt i = 0; i < n; i++) {
    /* NaN: not compared, as the position of a body is arbitrary. */
    error[i] = PetscIsNanReal(found[i].error[q]) ? 0 : found[i].error[q];
    if (!PetscIsNanReal(found[i].error[q])) sorted[m++] = error[i];
    o->magnitude = PetscMax(o->magnitude, found[i].size[q]);
  }
  PetscCall(PetscSortReal(m, sorted));
  o->median = m ? sorted[m / 2] : -1;
  o->largest = m ? sorted[m - 1] : -1;
  CalibrateIntegrate(n, rows, found, q, scene, estimates->force, o);
  /* Without calibrated features (estimates->n = 0) there is nothing to fit with. */
  o->has = (PetscBool)(m && o->magnitude > 0 && estimates->n);
  PetscCall(CalibrateMedian(n, error, 1, 0, &median));
  /* Smaller errors count as this one: their logarithms would only be noise. */
  least = PetscMax(NEGLIGIBLE * median, HYCO_OUTPUT_ROUND_OFF * o->magnitude);
  if (o->has) PetscCall(CalibrateFit(n, rows, error, least, estimates, PETSC_TRUE, o->law));
  PetscCall(PetscFree2(error, sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest number of predictions for an estimate: a type that needs no formula takes a multiple of the largest of
   few errors. */
static PetscInt CalibrateLeast(const HycoROM m)
{
  return m->model->traits.uniform ? HYCO_FEW_HELD : LEAST;
}

/* Fits the formulas to converged predictions. The features' floors come before the formulas, whose terms are log(1
   + feature / floor). */
static PetscErrorCode FitAll(HycoReducer t, PetscInt n, PetscInt least, const HycoHeldOut rows[],
                             HycoEstimates *estimates)
{
  PetscFunctionBegin;
  /* Too few points: an upper tolerance limit of so few would say nothing. */
  if (n < least) PetscFunctionReturn(PETSC_SUCCESS);
  estimates->n = n;
  for (PetscInt j = 0; j < HYCO_ESTIMATE_FEATURES; j++) {
    PetscCall(CalibrateMedian(n, rows[0].feature + j, (PetscInt)(sizeof(*rows) / sizeof(PetscReal)), 1 / LEAST_FEATURE,
                              &estimates->floor[j]));
    estimates->floor[j] *= LEAST_FEATURE;
  }
  /* The distance has a floor of its own: between training points it is never 0, and its median says little. */
  PetscCall(CalibrateSpacing(t, &estimates->floor[HYCO_ESTIMATE_DISTANCE]));
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) PetscCall(FitError(n, rows, (HycoEstimateKind)e, estimates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest values of the features. -1: unknown. With few points the largest values say nothing about what is
   usual. */
static void CalibrateReach(PetscInt n, PetscInt least, const HycoHeldOut rows[], PetscReal reached[])
{
  for (PetscInt j = 0; j < HYCO_FEATURES; j++) {
    reached[j] = n >= least ? 0 : -1;
    for (PetscInt i = 0; i < n && n >= least; i++) reached[j] = PetscMax(reached[j], rows[i].feature[j]);
  }
}

/* Numbers the points' groups: those of one stiffness, if not all parameters affect it, are not independent. */
static PetscErrorCode CalibrateGroup(HycoReducer t, HycoSamples points, PetscInt n, HycoHeldOut rows[])
{
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  PetscInt n_par, n_stiff = 0;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(points, NULL, &n_par, &mu));
  /* Points of one stiffness share the error of its interpolation or modes: the formula leaves out whole groups. */
  HycoSceneReaches(t->scene, reaches);
  for (PetscInt p = 0; p < n_par; p++) n_stiff += reaches[p];
  for (PetscInt i = 0; i < n; i++) {
    PetscInt k = i;

    for (PetscInt j = i - 1; j >= 0 && n_stiff; j--) {
      PetscBool same = PETSC_TRUE;

      for (PetscInt p = 0; p < n_par; p++)
        same = (PetscBool)(same && (!reaches[p] || mu[i * n_par + p] == mu[j * n_par + p]));
      if (same) k = (PetscInt)rows[j].group;
    }
    rows[i].group = (PetscReal)k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the points with converged predictions to the front: others have no features, and are reported as not converged
   online. Returns their number. */
static PetscInt KeepConverged(PetscInt n, HycoHeldOut rows[], HycoOutputErrors outputs[])
{
  PetscInt converged = 0;

  for (PetscInt i = 0; i < n; i++) {
    if (!(rows[i].converged > 0.5)) continue;
    rows[converged] = rows[i];
    outputs[converged++] = outputs[i];
  }
  return converged;
}

/* "  settings number 2 of the 5 that were tried: ...", and how many held-out points are fresh, in the model. */
static PetscErrorCode NameSettings(const HycoTraining *report, HycoROM m)
{
  const HycoAttempt *chosen = &report->chosen;
  char settings[HYCO_LINE], fresh[HYCO_LINE] = "", text[3 * HYCO_LINE];

  PetscFunctionBegin;
  if (!chosen->number) PetscFunctionReturn(PETSC_SUCCESS);
  HycoReducerSettingsDescribe(&chosen->settings, sizeof(settings), settings);
  /* Errors near added solutions are smaller than elsewhere: `view` says how many points are free of this. */
  if (report->n_fresh)
    HycoFormat(fresh, "  training added %d solutions; near %d of the held-out points, fresh ones, it added none\n",
               (int)report->n_added, (int)report->n_fresh);
  snprintf(text, sizeof(text), "  settings number %d of the %d that were tried: %s\n%s", (int)chosen->number,
           (int)chosen->of, settings, fresh);
  PetscCall(PetscFree(m->model->search));
  PetscCall(PetscStrallocpy(text, &m->model->search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fits the formulas, and stores the errors in the model. Rank 0. Rank 0 alone has the model's online data; the caller
   broadcasts what other ranks report. What it learns from are predictions, not interpolations: held-out points are in
   no basis. */
static PetscErrorCode CalibrateConclude(HycoReducer t, HycoSamples points, PetscInt n, HycoHeldOut rows[],
                                        HycoOutputErrors outputs[], HycoROM m, HycoTraining *report)
{
  const HycoValidation *v = &report->held_out;
  HycoEstimates estimates = {0};

  PetscFunctionBegin;
  estimates.n_held = v->n;
  estimates.cpu = report->cpu;
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
    /* -1: not compared at any point. */
    estimates.median[e] = PetscIsNanReal(v->median[errors[e]]) ? -1 : v->median[errors[e]];
    estimates.largest[e] = PetscIsNanReal(v->largest[errors[e]]) ? -1 : v->largest[errors[e]];
  }
  estimates.force = HycoHeldOutForce(n, rows);
  PetscCall(CalibrateGroup(t, points, n, rows));
  /* After CalibrateGroup(), whose numbers are those of all points. */
  n = KeepConverged(n, rows, outputs);
  CalibrateReach(n, CalibrateLeast(m), rows, estimates.reached);
  PetscCall(FitAll(t, n, CalibrateLeast(m), rows, &estimates));
  estimates.n_outputs = t->scene->n_quantities;
  for (PetscInt q = 0; q < estimates.n_outputs; q++) {
    const HycoOutputEstimate *o = &estimates.output[q];

    PetscCall(FitOutput(n, rows, outputs, q, t->scene, &estimates));
    report->output[q] = (HycoOutputValidation){o->median, o->largest, o->magnitude, o->has};
  }
  report->n_held = PetscMin(estimates.n, v->n);
  m->model->estimates = estimates;
  PetscCall(NameSettings(report, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define CORNERS 3 /* held-out points for each corner that judges too */

/* Spread over them. The held-out points of a training on a closed grid have no corner, where errors may be larger than
   inside although the corner was trained on. */
PetscErrorCode HycoReducerCorners(HycoReducer t, PetscInt most, HycoSamples *corners)
{
  const HycoScene scene = t->scene;
  PetscInt n, n_par, found = 0, *at;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, corners));
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, &mu));
  PetscCall(PetscMalloc1(n, &at));
  for (PetscInt k = 0; k < n; k++) {
    PetscBool corner = PETSC_TRUE;

    for (PetscInt p = 0; p < n_par; p++)
      corner = (PetscBool)(corner && (mu[k * n_par + p] == scene->lo[p] || mu[k * n_par + p] == scene->hi[p]));
    if (corner) at[found++] = k;
  }
  most = PetscMin(most, found);
  /* k found / most: evenly over the list, in which the last parameter changes fastest. */
  for (PetscInt k = 0; k < most; k++) PetscCall(HycoSamplesAddPoint(*corners, mu + at[k * found / most] * n_par));
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* They enter the largest errors, not the medians: the held-out points are distributed like a user's, corners are
   not. */
PetscErrorCode HycoReducerJudgeCorners(HycoReducer t, HycoSamples corners, PetscInt n, HycoROM model,
                                       HycoSnapshots store, HycoHeldOut rows[], HycoValidation *held_out)
{
  HycoValidation there = {0};
  PetscInt n_corners;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(corners, &n_corners, NULL, NULL));
  if (!n_corners) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerPredictHeldOut(t, corners, model, store, NULL, rows + n));
  /* The scale of forces is that of all points, so that corners with small forces are judged alike. */
  PetscCall(HycoHeldOutSummarise(n_corners, rows + n, HycoHeldOutForce(n + n_corners, rows), &there));
  for (PetscInt e = 0; e < HYCO_N_ERRORS; e++) {
    held_out->largest[e] = fmax(held_out->largest[e], there.largest[e]); /* NaN: not compared */
    held_out->end[e] = fmax(held_out->end[e], there.end[e]);
  }
  held_out->not_converged += there.not_converged;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The processor time of the training so far. Solutions of an earlier run count as the mean of this one's. */
static PetscErrorCode CountCost(HycoReducer t, PetscInt n_held, HycoSnapshots store, HycoTraining *report)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  report->cpu = HycoCPU() - t->cpu_begin;
  HycoAllreduce(&report->cpu, 1, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, NULL));
  n = n_held + (t->late ? 0 : n) - store->n_timed;
  report->cpu = store->n_timed ? report->cpu + PetscMax(n, 0) * store->cpu : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fits the estimates to the errors at `points`, which are those of the n rows. */
static PetscErrorCode CalibrateErrors(HycoReducer t, HycoSamples points, PetscInt n, HycoHeldOut rows[], HycoROM model,
                                      HycoSnapshots store, HycoTraining *report)
{
  HycoOutputErrors *outputs;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &outputs));
  PetscCall(HycoReducerJudgeOutputs(t, points, model, store, rows, outputs));
  PetscCall(CountCost(t, n, store, report));
  /* Rank 0 has the rows of all points, and the fit is small. */
  HycoOnRoot(HycoComm(t), CalibrateConclude(t, points, n, rows, outputs, model, report));
  PetscCallMPI(MPI_Bcast(&report->n_held, 1, MPIU_INT, 0, HycoComm(t)));
  PetscCallMPI(MPI_Bcast(report->output, sizeof(report->output), MPI_BYTE, 0, HycoComm(t)));
  PetscCall(PetscFree(outputs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors are those of the final model, at points that did not choose it where there are such. */
PetscErrorCode HycoReducerCalibrate(HycoReducer t, HycoSnapshots store, HycoROM model, HycoTraining *report)
{
  HycoHeldOut *rows = t->judged_held;
  HycoSamples corners, all;
  PetscInt n = 0, n_corners;

  PetscFunctionBegin;
  t->judged_held = NULL;
  if (t->held) PetscCall(HycoSamplesGet(t->held, &n, NULL, NULL));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerCorners(t, t->validation || n < CalibrateLeast(model) ? 0 : n / CORNERS, &corners));
  PetscCall(HycoSamplesGet(corners, &n_corners, NULL, NULL));
  /* The training points were not solved: their corners are now. */
  if (t->late && n_corners) PetscCall(HycoReducerSolve(t, store, corners));
  PetscCall(HycoSamplesGet(corners, &n_corners, NULL, NULL));
  /* A search over paths has kept the rows of the chosen attempt. */
  if (!rows) {
    PetscCall(PetscMalloc1(n, &rows));
    PetscCall(HycoReducerPredictHeldOut(t, t->held, model, store, NULL, rows));
  }
  PetscCall(PetscRealloc((size_t)(n + n_corners) * sizeof(*rows), &rows));
  PetscCall(HycoHeldOutSummarise(n, rows, HycoHeldOutForce(n, rows), &report->held_out));
  PetscCall(HycoReducerJudgeCorners(t, corners, n, model, store, rows, &report->held_out));
  report->n_corners = n_corners;
  PetscCall(HycoSamplesCreate(t->scene, &all));
  PetscCall(HycoSamplesAddSet(all, t->held));
  PetscCall(HycoSamplesAddSet(all, corners));
  PetscCall(CalibrateErrors(t, all, n + n_corners, rows, model, store, report));
  HycoDestroyAll(&all, &corners);
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
