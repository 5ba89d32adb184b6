/*
  The parameter values at which a model's outputs are closest to targets, min 1/2 |r|^2 within the ranges with
  r_k = (output_k - target_k) / scale_k, by a TAO type on the model's gradients. There may be several minima: it starts
  at the best of some points over the ranges.
*/
#include <hycoalgorithms.h>
#include <hycoromimpl.h>
#include <hycosamples.h>
#include <petsctao.h>
#include <string.h>

#define EXACT 1e-9 /* of the targets, a misfit: a tenth of the residual of 1e-8 */
/* Of what the derivatives allow, the slope of the misfit: derivatives by differences are right to 1e-8, and gradients
   at minima of tests/models/fit.py fall below. */
#define MINIMUM 1e-5
/* Weight of the regularisation of Gauss-Newton steps: below any curvature of the targets, above the square of their
   round-off; for targets that do not determine all parameters. */
#define WEIGHT 1e-6
/* Of a misfit: minima from several starts that differ by less are one (tests/models/fit.py). */
#define SAME_MISFIT 1e-4
#define STALLED     5 /* iterations in which a misfit that does not fall by SAME_MISFIT ends */
#define ITERATIONS  200
#define SEARCH      "10" /* predictions of a line search */
/* Step from the ends of the ranges as a share of half of them: the derivative at the load 0 of a floating body does not
   exist, beside it it does. */
#define INSIDE 1e-4
/* Of a parameter's derivatives, what is left beside the others': 100 times the error of derivatives by differences. */
#define LEFT_DERIVATIVE 1e-6

typedef struct {
  HycoROM model;
  PetscInt n, n_par;
  PetscReal earlier;      /* the misfit some iterations before */
  const PetscInt *output; /* by target: its output */
  const PetscReal *target;
  PetscReal scale[HYCO_MAX_QUANTITIES];
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS]; /* of a held parameter both are its value */
  PetscInt evaluations;
  /* at the last point: */
  /* shares of the ranges; J: n x n_par */
  PetscReal x[HYCO_MAX_PARAMETERS], r[HYCO_MAX_QUANTITIES], J[HYCO_MAX_QUANTITIES * HYCO_MAX_PARAMETERS];
  PetscBool known, kink;
  HycoPrediction prediction;
} Fit;

/* The optimiser's unknowns are shares of the ranges: parameters may differ by many orders of magnitude, and its
   tolerances are absolute. Cut at the ends, because x may leave [0, 1] by round-off, and predict refuses it. */
static void ToParameters(const Fit *f, const PetscReal x[], PetscReal mu[])
{
  for (PetscInt p = 0; p < f->n_par; p++)
    mu[p] = PetscMin(PetscMax(f->lo[p] + x[p] * (f->hi[p] - f->lo[p]), f->lo[p]), f->hi[p]);
}

static PetscReal FitSize(PetscInt n, const PetscReal v[])
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < n; k++) sum += v[k] * v[k];
  return PetscSqrtReal(sum);
}

/* The output of target k: those of the end of a path are followed by their extremes. */
static PetscReal FitValue(const Fit *f, const HycoPrediction *p, PetscInt k)
{
  const PetscInt q = f->output[k], n = f->model->model->scene->n_quantities;

  return q < n ? p->quantity[q] : p->path_quantity[q - n];
}

/* Divided by the scales, so that outputs of different units weigh the same. */
static void FitMisfit(const Fit *f, const HycoPrediction *p, PetscReal r[])
{
  for (PetscInt k = 0; k < f->n; k++) r[k] = (FitValue(f, p, k) - f->target[k]) / f->scale[k];
}

/* The derivatives at mu, of which the prediction is the model's last; where there are none, as at the end of a range at
   which no load presses a body, those a little inside the ranges. */
static PetscErrorCode FitDifferentiate(Fit *f, const PetscReal mu[], HycoGradient *g)
{
  PetscReal inside[HYCO_MAX_PARAMETERS];
  char message[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCatch(HycoROMGetGradient(f->model, g), ierr, message);
  if (!ierr) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < f->n_par; p++) inside[p] = mu[p] + INSIDE * ((f->lo[p] + f->hi[p]) / 2 - mu[p]);
  PetscCall(HycoROMPredict(f->model, f->n_par, inside));
  PetscCall(HycoROMGetGradient(f->model, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r and J at x. */
static PetscErrorCode FitEvaluate(Fit *f, const PetscReal x[])
{
  HycoGradient g;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool same = f->known;

  PetscFunctionBegin;
  /* TAO asks for residual and Jacobian at the same x in separate calls: one prediction serves both. */
  for (PetscInt p = 0; p < f->n_par; p++) same = (PetscBool)(same && x[p] == f->x[p]);
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  /* Before the prediction: after an error r and J would belong to different points. */
  f->known = PETSC_FALSE;
  ToParameters(f, x, mu);
  PetscCall(HycoROMPredict(f->model, f->n_par, mu));
  PetscCall(HycoROMGetPrediction(f->model, &f->prediction));
  HycoCheck(f->prediction.reason > 0, "a prediction of the fit failed: %s",
            f->prediction.why[0] ? f->prediction.why : HycoReasonName(f->prediction.reason));
  PetscCall(FitDifferentiate(f, mu, &g));
  FitMisfit(f, &f->prediction, f->r);
  f->kink = PETSC_FALSE;
  for (PetscInt k = 0; k < f->n; k++) {
    for (PetscInt p = 0; p < f->n_par; p++) {
      const PetscBool path = (PetscBool)(f->output[k] >= g.n_outputs);
      const PetscInt at = (f->output[k] - (path ? g.n_outputs : 0)) * f->n_par + p;

      f->J[k * f->n_par + p] = (path ? g.path : g.value)[at] * (f->hi[p] - f->lo[p]) / f->scale[k];
      f->kink = (PetscBool)(f->kink || (path ? g.path_kink : g.kink)[at]);
    }
  }
  PetscCall(PetscArraycpy(f->x, x, f->n_par));
  f->known = PETSC_TRUE;
  f->evaluations++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's vectors live here as arrays in [0, 1]^n; the array is given back after an error as well. */
static PetscErrorCode EvaluateVec(Fit *f, Vec X)
{
  const PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(X, &x));
  HycoFinally(FitEvaluate(f, x), PetscCall(VecRestoreArrayRead(X, &x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's callback for Gauss-Newton. TAO may ask for residual and Jacobian at the same point: FitEvaluate() keeps the
   last one. */
static PetscErrorCode FitResidual(Tao tao, Vec X, Vec R, void *ctx)
{
  Fit *f = (Fit *)ctx;
  PetscScalar *r;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(EvaluateVec(f, X));
  PetscCall(VecGetArrayWrite(R, &r));
  PetscCall(PetscArraycpy(r, f->r, f->n));
  PetscCall(VecRestoreArrayWrite(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By rows: outputs; columns: parameters in units of their ranges, so that steps in all of them are comparable. */
static PetscErrorCode FitJacobian(Tao tao, Vec X, Mat J, Mat P, void *ctx)
{
  Fit *f = (Fit *)ctx;

  PetscFunctionBegin;
  (void)tao;
  (void)P;
  PetscCall(EvaluateVec(f, X));
  for (PetscInt k = 0; k < f->n; k++) {
    /* J is tiny and dense: its assembly costs less than a copy of its layout would be worth. */
    for (PetscInt p = 0; p < f->n_par; p++) PetscCall(MatSetValue(J, k, p, f->J[k * f->n_par + p], INSERT_VALUES));
  }
  PetscCall(HycoMatAssemble(J));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J^T r */
static void FitDerivative(const Fit *f, PetscReal g[])
{
  for (PetscInt p = 0; p < f->n_par; p++) {
    g[p] = 0;
    for (PetscInt k = 0; k < f->n; k++) g[p] += f->J[k * f->n_par + p] * f->r[k];
  }
}

/* TAO's callback for limited-memory methods, with the same evaluation as FitResidual(), so that both types minimise one
   function. */
static PetscErrorCode FitObjective(Tao tao, Vec X, PetscReal *value, Vec G, void *ctx)
{
  Fit *f = (Fit *)ctx;
  PetscScalar *g;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(EvaluateVec(f, X));
  /* Half of the squares, so that the gradient is J^T r without a factor. */
  *value = PetscSqr(FitSize(f->n, f->r)) / 2;
  PetscCall(VecGetArrayWrite(G, &g));
  FitDerivative(f, g);
  PetscCall(VecRestoreArrayWrite(G, &g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The samples with their misfits; scales of targets that are 0 are the largest outputs there. */
static PetscErrorCode FitSample(Fit *f, PetscInt n, const PetscReal mu[], PetscReal misfit[])
{
  HycoPrediction *p;
  PetscReal r[HYCO_MAX_QUANTITIES];

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &p));
  PetscCall(HycoROMSolveMany(f->model, n, f->n_par, mu, p, NULL, NULL));
  f->evaluations = n;
  for (PetscInt k = 0; k < f->n; k++) {
    /* Targets differ in size: relative differences give each the same weight. */
    f->scale[k] = PetscAbsReal(f->target[k]);
    for (PetscInt i = 0; i < n && f->target[k] == 0; i++)
      f->scale[k] = PetscMax(f->scale[k], PetscAbsReal(FitValue(f, &p[i], k)));
    if (f->scale[k] == 0) f->scale[k] = 1;
  }
  for (PetscInt i = 0; i < n; i++) {
    FitMisfit(f, &p[i], r);
    /* Points without a solution are last in the order and never become a start. */
    misfit[i] = p[i].reason > 0 ? FitSize(f->n, r) : PETSC_MAX_REAL;
  }
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the n_starts points with the smallest misfits, starts[] (shares of the ranges), the best first. */
static PetscErrorCode FitStart(Fit *f, const PetscReal start[], PetscInt n_samples, PetscInt *n_starts,
                               PetscReal starts[])
{
  HycoSamples samples = NULL;
  const PetscReal *all;
  PetscReal *misfit, *mu;
  PetscInt n, *order, kept = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(f->model->model->scene, &samples));
  /* A given start is the only one; otherwise scattered points, because the misfit may have several minima. */
  if (start)
    PetscCall(HycoSamplesAddPoint(samples, start));
  else
    PetscCall(HycoSamplesAddScattered(samples, n_samples));
  PetscCall(HycoSamplesGet(samples, &n, NULL, &all));
  HycoDuplicate(n * f->n_par, all, &mu);
  /* Held parameters have their values at every start. */
  for (PetscInt i = 0; i < n * f->n_par; i++)
    mu[i] = PetscMin(PetscMax(mu[i], f->lo[i % f->n_par]), f->hi[i % f->n_par]);
  PetscCall(PetscMalloc2(n, &misfit, n, &order));
  PetscCall(FitSample(f, n, mu, misfit));
  for (PetscInt i = 0; i < n; i++) order[i] = i;
  PetscCall(PetscSortRealWithArrayInt(n, misfit, order));
  for (PetscInt i = 0; i < n && kept < *n_starts && misfit[i] < PETSC_MAX_REAL; i++, kept++) {
    /* A parameter whose range is one value stays at it. */
    for (PetscInt q = 0; q < f->n_par; q++)
      starts[kept * f->n_par + q] =
          f->hi[q] > f->lo[q] ? (mu[order[i] * f->n_par + q] - f->lo[q]) / (f->hi[q] - f->lo[q]) : 0;
  }
  *n_starts = kept;
  PetscCall(PetscFree2(misfit, order));
  PetscCall(PetscFree(mu));
  PetscCall(HycoSamplesDestroy(&samples));
  HycoCheck(kept, "no prediction at the start of the fit converged; give another -mu");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the last point is a minimum within the ranges, by the recomputed slope: a solver's flag is no evidence. */
static PetscBool IsMinimum(const Fit *f, PetscReal tolerance)
{
  PetscReal g[HYCO_MAX_PARAMETERS], most = 0;

  FitDerivative(f, g);
  for (PetscInt p = 0; p < f->n_par; p++) {
    /* At an end of a range the slope may point outwards. */
    const PetscBool held = (PetscBool)((f->x[p] <= 0 && g[p] > 0) || (f->x[p] >= 1 && g[p] < 0));

    if (!held) most = PetscMax(most, PetscAbsReal(g[p]));
  }
  /* Relative to the sizes of J and r: the same answer whatever the units of the outputs. */
  return (PetscBool)(FitSize(f->n, f->r) <= EXACT ||
                     most <= tolerance * FitSize(f->n * f->n_par, f->J) * FitSize(f->n, f->r));
}

/* TAO's callback after an iteration. TAO's own test of the slope has no scale: near a minimum the slope is that of
   round-off, or of differences. */
static PetscErrorCode FitConverged(Tao tao, void *ctx)
{
  Fit *f = (Fit *)ctx;
  PetscReal size;
  PetscInt k;
  Vec X;

  PetscFunctionBegin;
  PetscCall(TaoGetSolution(tao, &X));
  PetscCall(EvaluateVec(f, X));
  PetscCall(TaoGetIterationNumber(tao, &k));
  size = FitSize(f->n, f->r);
  if (k % STALLED == 0) {
    if (k && size > (1 - SAME_MISFIT) * f->earlier) PetscCall(TaoSetConvergedReason(tao, TAO_CONVERGED_USER));
    f->earlier = size;
  }
  if (IsMinimum(f, MINIMUM / 100)) PetscCall(TaoSetConvergedReason(tao, TAO_CONVERGED_GATOL));
  if (k >= ITERATIONS) PetscCall(TaoSetConvergedReason(tao, TAO_DIVERGED_MAXITS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's own limit is 30 predictions with gradients, which a search that ends at a kink takes; there is no function for
   it. */
static PetscErrorCode LimitSearch(Tao tao)
{
  TaoLineSearch search;
  PetscOptions options;

  PetscFunctionBegin;
  PetscCall(TaoGetLineSearch(tao, &search));
  PetscCall(PetscOptionsCreate(&options));
  PetscCall(PetscOptionsSetValue(options, "-tao_ls_max_funcs", SEARCH));
  PetscCall(PetscObjectSetOptions((PetscObject)search, options));
  PetscCall(TaoLineSearchSetFromOptions(search));
  PetscCall(PetscObjectSetOptions((PetscObject)search, NULL));
  PetscCall(PetscOptionsDestroy(&options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Minimises from X by a type. */
static PetscErrorCode FitMinimise(Fit *f, const char type[], Vec X)
{
  const PetscBool squares = (PetscBool)(strcmp(type, TAOBRGN) == 0);
  Tao tao, inner;
  Vec lo, hi, r;
  Mat J;

  PetscFunctionBegin;
  HycoVecDuplicate(X, &lo, &hi);
  /* Variables are shares of the ranges: bounds 0 and 1. VecDuplicate() has zeros in lo. */
  PetscCall(VecSet(hi, 1));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->n, &r));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, f->n, f->n_par, NULL, &J));
  PetscCall(TaoCreate(PETSC_COMM_SELF, &tao));
  PetscCall(TaoSetType(tao, type));
  if (squares) {
    PetscCall(TaoSetResidualRoutine(tao, r, FitResidual, f));
    PetscCall(TaoSetJacobianResidualRoutine(tao, J, J, FitJacobian, f));
    /* Nearly no regularisation: it would pull the answer from the targets. It must not be 0, since J^T J is singular if
       targets do not determine all parameters. */
    PetscCall(TaoBRGNSetRegularizerWeight(tao, WEIGHT));
  } else
    PetscCall(TaoSetObjectiveAndGradient(tao, NULL, FitObjective, f));
  PetscCall(TaoSetSolution(tao, X));
  PetscCall(TaoSetVariableBounds(tao, lo, hi));
  inner = tao;
  if (squares) PetscCall(TaoBRGNGetSubsolver(tao, &inner));
  PetscCall(TaoSetConvergenceTest(inner, FitConverged, f));
  PetscCall(LimitSearch(inner));
  PetscCall(TaoSolve(tao));
  HycoDestroyAll(&tao, &J, &r, &lo, &hi);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From one start, by the requested type, and after it by the other one if that ends at no minimum. *minimum: the last
   point is one. */
static PetscErrorCode RunFrom(Fit *f, const PetscReal start[], const char type[], PetscBool *minimum, char method[64])
{
  /* Gauss-Newton can stall at a kink, where the limited-memory method still descends, and the other way round. */
  const char *const types[2] = {type, strcmp(type, HYCO_FIT_BRGN) ? HYCO_FIT_BRGN : HYCO_FIT_BLMVM};
  PetscScalar *x;
  Vec X;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->n_par, &X));
  PetscCall(VecGetArrayWrite(X, &x));
  PetscCall(PetscArraycpy(x, start, f->n_par));
  PetscCall(VecRestoreArrayWrite(X, &x));
  *minimum = PETSC_FALSE;
  method[0] = '\0';
  for (PetscInt k = 0; k < 2 && !*minimum; k++) {
    PetscCall(FitMinimise(f, types[k], X));
    PetscCall(EvaluateVec(f, X));
    *minimum = IsMinimum(f, MINIMUM);
    PetscCall(PetscStrlcat(method, k ? ", then " : "", 64));
    PetscCall(PetscStrlcat(method, types[k], 64));
  }
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two misfits are those of one minimum. */
static PetscBool AreSame(PetscReal a, PetscReal b)
{
  return (PetscBool)(PetscAbsReal(a - b) <= SAME_MISFIT * PetscMin(a, b) + EXACT);
}

/* The smaller misfit; of the same ones a minimum. */
static PetscBool IsBetter(const HycoFit *fit, PetscReal misfit, PetscBool minimum)
{
  if (minimum != fit->converged && AreSame(misfit, fit->misfit)) return minimum;
  return (PetscBool)(misfit < fit->misfit);
}

/* From each start; fit and x are the best one's. */
static PetscErrorCode RunAll(Fit *f, const PetscReal starts[], const char type[], HycoFit *fit, PetscReal x[])
{
  PetscReal *ends;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fit->n_starts, &ends));
  for (PetscInt s = 0; s < fit->n_starts; s++) {
    char method[64];
    PetscBool minimum = PETSC_FALSE;

    PetscCall(RunFrom(f, starts + s * f->n_par, type, &minimum, method));
    /* Root mean square, so that it does not depend on the number of targets. */
    ends[s] = FitSize(f->n, f->r) / PetscSqrtReal((PetscReal)f->n);
    if (s && !IsBetter(fit, ends[s], minimum)) continue;
    fit->misfit = ends[s];
    fit->converged = minimum;
    PetscCall(PetscStrncpy(fit->method, method, sizeof(fit->method)));
    PetscCall(PetscArraycpy(x, f->x, f->n_par));
  }
  /* Counted afterwards: the least is known only when all starts have ended. */
  for (PetscInt s = 0; s < fit->n_starts; s++) fit->n_least += AreSame(ends[s], fit->misfit);
  PetscCall(PetscFree(ends));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ranges of the fit: a held parameter has that of one value, which is no direction of a step, since derivatives are
   multiplied by the width. */
static PetscErrorCode SetRanges(Fit *f, const PetscReal held[], PetscInt *n_free)
{
  const HycoScene scene = f->model->model->scene;

  PetscFunctionBegin;
  *n_free = f->n_par;
  PetscCall(PetscArraycpy(f->lo, scene->lo, f->n_par));
  PetscCall(PetscArraycpy(f->hi, scene->hi, f->n_par));
  if (!held) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < f->n_par; p++) {
    if (PetscIsNanReal(held[p])) continue;
    HycoCheckValue(held[p] >= scene->lo[p] && held[p] <= scene->hi[p],
                   "a fit holds the parameter %s at %.10g; its range is from %.10g to %.10g", scene->parameter[p],
                   (double)held[p], (double)scene->lo[p], (double)scene->hi[p]);
    f->lo[p] = f->hi[p] = held[p];
    --*n_free;
  }
  HycoCheckValue(*n_free,
                 "a fit holds all %d parameters, so that nothing is left to find; predict gives the outputs there",
                 (int)f->n_par);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many parameters the answer determines: those that the misfit presses against an end of their range, and of the
   others the rank of J, whose columns of held parameters are 0. */
static PetscErrorCode FitDetermined(const Fit *f, PetscInt *n)
{
  const PetscInt most = PetscMin(f->n, f->n_par);
  PetscReal A[HYCO_MAX_QUANTITIES * HYCO_MAX_PARAMETERS], s[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(A, f->J, f->n * f->n_par));
  *n = 0;
  for (PetscInt p = 0; p < f->n_par; p++) {
    PetscReal slope = 0, size = 0;

    for (PetscInt k = 0; k < f->n; k++) {
      slope += f->J[k * f->n_par + p] * f->r[k];
      size += PetscAbsReal(f->J[k * f->n_par + p] * f->r[k]);
    }
    /* Where the targets are met the slope is round-off, and the end is no reason. */
    if (!(PetscAbsReal(slope) > LEFT_DERIVATIVE * size) || FitSize(f->n, f->r) < LEFT_DERIVATIVE ||
        !(slope > 0 ? f->x[p] <= 0 : f->x[p] >= 1))
      continue;
    ++*n;
    for (PetscInt k = 0; k < f->n; k++) A[k * f->n_par + p] = 0;
  }
  PetscCall(HycoSingularValues(f->n_par, f->n, A, s)); /* of its transpose: by columns */
  for (PetscInt k = 0; k < most && s[k] > LEFT_DERIVATIVE * s[0]; k++) ++*n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fit works on x in [0, 1]^n; mu is made from it at the end. Which starts are tried depends on the fixed sequence
   of samples, hence the same answer in every run. */
PetscErrorCode HycoROMFit(HycoROM m, PetscInt n, const PetscInt output[], const PetscReal target[],
                          const PetscReal start[], const PetscReal held[], PetscInt n_samples, PetscInt n_starts,
                          const char type[], PetscReal mu[], HycoFit *fit)
{
  Fit f = {.model = m, .n = n, .output = output, .target = target};
  HycoScene scene;
  PetscReal x[HYCO_MAX_PARAMETERS], *starts;
  PetscInt n_free;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(output);
  HycoCheckGiven(target);
  HycoCheckGiven(mu);
  HycoCheckGiven(fit);
  HycoCheckGiven(type);
  scene = m->model->scene;
  f.n_par = scene->n_parameters;
  HycoCheckValue(n > 0 && n <= HYCO_MAX_QUANTITIES && n_samples > 0 && n_starts > 0,
                 "a fit has %d targets, %d samples and %d starts; at least 1 of each is expected", (int)n,
                 (int)n_samples, (int)n_starts);
  HycoCheckValue(!strcmp(type, HYCO_FIT_BRGN) || !strcmp(type, HYCO_FIT_BLMVM),
                 "the type of a fit is \"%s\"; it must be " HYCO_FIT_BRGN " or " HYCO_FIT_BLMVM, type);
  for (PetscInt k = 0; k < n; k++) {
    HycoCheckValue(output[k] >= 0 && output[k] < (scene->n_times ? 2 : 1) * scene->n_quantities,
                   "there is no output %d; the model has %d", (int)output[k], (int)scene->n_quantities);
    HycoCheckValue(!PetscIsInfOrNanReal(target[k]), "the target of %s is %g; a finite number is expected",
                   scene->quantity[output[k] % scene->n_quantities].name, (double)target[k]);
  }
  PetscCall(SetRanges(&f, held, &n_free));
  *fit = (HycoFit){.n_starts = n_starts, .n_free = n_free};
  PetscCall(PetscMalloc1(n_starts * f.n_par + 1, &starts));
  /* As many samples as starts are asked for. */
  PetscCall(FitStart(&f, start, PetscMax(n_samples, n_starts), &fit->n_starts, starts));
  PetscCall(RunAll(&f, starts, type, fit, x));
  PetscCall(PetscFree(starts));
  f.known = PETSC_FALSE;
  /* Once more at the answer: the caller's getters of the model show this point, not the last start's. */
  PetscCall(FitEvaluate(&f, x));
  ToParameters(&f, x, mu);
  fit->kink = f.kink;
  PetscCall(FitDetermined(&f, &fit->n_determined));
  fit->evaluations = f.evaluations;
  PetscCall(PetscArraycpy(fit->scale, f.scale, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}
