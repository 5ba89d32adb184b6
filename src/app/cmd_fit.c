/*
  hyco fit: the parameter values at which a model's outputs are closest to targets, min 1/2 |r|^2 within the ranges with
  r_k = (output_k - target_k) / scale_k, by a TAO type on the model's gradients; the answer is solved once at full order.
  A fit starts at the best of some points over the ranges, since there may be several minima.
*/
#include "driver.h"
#include <petsctao.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MOST    64   /* parameters */
#define EXACT   1e-9 /* a misfit below it is round-off */
#define UNMET   1e-3 /* a misfit above it means that the targets are not met */
#define MINIMUM 1e-5 /* of the slope of the misfit, relative to what the derivatives allow */
#define WEIGHT  1e-6 /* of the regularisation of Gauss-Newton steps: for targets that do not determine all parameters */

typedef struct {
  HycoROM model;
  HycoScene scene; /* the model's */
  PetscInt n, n_par;
  PetscInt output[HYCO_MAX_QUANTITIES]; /* by target: its output */
  PetscReal target[HYCO_MAX_QUANTITIES], scale[HYCO_MAX_QUANTITIES];
  const PetscReal *lo, *hi;
  PetscInt evaluations;
  /* at the last point: */
  PetscReal x[MOST], r[HYCO_MAX_QUANTITIES], J[HYCO_MAX_QUANTITIES * MOST]; /* shares of the ranges; J: n x n_par */
  PetscBool known, kink;
  HycoPrediction prediction;
} Fit;

/* -- options -- */

/* -fit_type, -fit_starts, and whether -mu gives the start. */
typedef struct {
  PetscInt type, starts;
  PetscBool given;
  PetscReal mu[MOST];
} Settings;
static const char *const types[] = {"brgn", "blmvm", NULL};

static PetscErrorCode ReadSettings(Settings *s)
{
  *s = (Settings){.starts = 64};

  PetscFunctionBegin;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(
      HycoOptionsWord("-fit_type",
                      "TAO type of the fit: regularised Gauss-Newton steps within the ranges, or a limited-memory "
                      "quasi-Newton method",
                      types, &s->type, NULL));
  PetscCall(HycoOptionsInt("-fit_starts", "predictions over the ranges, the best of which is the start without -mu", 1,
                           1000000, &s->starts, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An empty meaning: the option is declared once, as target_, in DeclareFit(). */
static PetscErrorCode ReadTarget(Fit *f, PetscInt output, const char name[])
{
  char key[DRIVER_LINE], text[PETSC_MAX_PATH_LEN], *end;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(key, sizeof(key), "target_%s", name));
  PetscCall(DriverGet(key, "", text));
  if (!text[0]) PetscFunctionReturn(PETSC_SUCCESS);
  f->target[f->n] = strtod(text, &end);
  HycoCheck(end != text && !*end && !PetscIsInfOrNanReal(f->target[f->n]), "-%s is \"%s\"; a number is expected", key,
            text);
  f->output[f->n++] = output;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses -target_foo if foo is no output; after the others are read. */
static PetscErrorCode CheckTargets(const char list[])
{
  char **keys, **values, bad[DRIVER_LINE] = "";
  PetscInt left;

  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(NULL, &left, &keys, &values));
  for (PetscInt k = 0; k < left; k++) {
    if (strncasecmp(keys[k], "target_", 7) == 0) PetscCall(PetscStrncpy(bad, keys[k], sizeof(bad)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &left, &keys, &values));
  HycoCheck(!bad[0], "-%s does not name an output; the model's outputs are: %s", bad, list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -target_OUTPUT for the outputs of the model. */
static PetscErrorCode ReadTargets(Fit *f)
{
  const char *names[HYCO_MAX_QUANTITIES];
  char list[HYCO_LINE] = "";
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  for (PetscInt q = 0; q < n; q++) {
    PetscCall(ReadTarget(f, q, names[q]));
    PetscCall(HycoListAdd(list, ", ", names[q]));
  }
  HycoCheck(n, "the model has no outputs to fit; train it on a scene with an entry output");
  PetscCall(CheckTargets(list));
  HycoCheck(f->n, "give -target_OUTPUT V for one of the model's outputs or more, which are: %s", list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the misfit -- */

/* Clipped after the product: lo + 1 (hi - lo) may exceed hi by round-off, which the scene would refuse. */
static void ToParameters(const Fit *f, const PetscReal x[], PetscReal mu[])
{
  for (PetscInt p = 0; p < f->n_par; p++)
    mu[p] = PetscMin(PetscMax(f->lo[p] + x[p] * (f->hi[p] - f->lo[p]), f->lo[p]), f->hi[p]);
}

/* The 2-norm. */
static PetscReal Size(PetscInt n, const PetscReal v[])
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < n; k++) sum += v[k] * v[k];
  return PetscSqrtReal(sum);
}

static void Misfit(const Fit *f, const HycoPrediction *p, PetscReal r[])
{
  for (PetscInt k = 0; k < f->n; k++) r[k] = (p->quantity[f->output[k]] - f->target[k]) / f->scale[k];
}

/* r and J at x. */
static PetscErrorCode Evaluate(Fit *f, const PetscReal x[])
{
  HycoGradient g;
  PetscReal mu[MOST];
  PetscBool same = f->known;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < f->n_par; p++) same = (PetscBool)(same && x[p] == f->x[p]);
  /* TAO asks for residual and Jacobian separately: one prediction and gradient serve both. */
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  /* Until all of r, J and x belong together. */
  f->known = PETSC_FALSE;
  ToParameters(f, x, mu);
  PetscCall(HycoROMPredict(f->model, f->n_par, mu));
  PetscCall(HycoROMGetPrediction(f->model, &f->prediction));
  HycoCheck(f->prediction.reason > 0, "a prediction of the fit failed: %s", HycoReasonName(f->prediction.reason));
  PetscCall(HycoROMGetGradient(f->model, &g));
  Misfit(f, &f->prediction, f->r);
  f->kink = PETSC_FALSE;
  for (PetscInt k = 0; k < f->n; k++) {
    for (PetscInt p = 0; p < f->n_par; p++) {
      const PetscInt at = f->output[k] * f->n_par + p;

      /* In shares of the ranges and of the targets: TAO's tolerances and steps then have a scale. */
      f->J[k * f->n_par + p] = g.value[at] * (f->hi[p] - f->lo[p]) / f->scale[k];
      f->kink = (PetscBool)(f->kink || g.kink[at]);
    }
  }
  PetscCall(PetscArraycpy(f->x, x, f->n_par));
  f->known = PETSC_TRUE;
  f->evaluations++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The array is restored after an error too. */
static PetscErrorCode EvaluateVec(Fit *f, Vec X)
{
  const PetscScalar *x;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(X, &x));
  ierr = Evaluate(f, x);
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Residual(Tao tao, Vec X, Vec R, void *ctx)
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

static PetscErrorCode Jacobian(Tao tao, Vec X, Mat J, Mat P, void *ctx)
{
  Fit *f = (Fit *)ctx;

  PetscFunctionBegin;
  (void)tao;
  (void)P;
  PetscCall(EvaluateVec(f, X));
  for (PetscInt k = 0; k < f->n; k++) {
    for (PetscInt p = 0; p < f->n_par; p++) PetscCall(MatSetValue(J, k, p, f->J[k * f->n_par + p], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J^T r */
static void Slope(const Fit *f, PetscReal g[])
{
  for (PetscInt p = 0; p < f->n_par; p++) {
    g[p] = 0;
    for (PetscInt k = 0; k < f->n; k++) g[p] += f->J[k * f->n_par + p] * f->r[k];
  }
}

static PetscErrorCode Objective(Tao tao, Vec X, PetscReal *value, Vec G, void *ctx)
{
  Fit *f = (Fit *)ctx;
  PetscScalar *g;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(EvaluateVec(f, X));
  *value = PetscSqr(Size(f->n, f->r)) / 2;
  PetscCall(VecGetArrayWrite(G, &g));
  Slope(f, g);
  PetscCall(VecRestoreArrayWrite(G, &g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the fit, the same on each rank -- */

/* The best of the points over the ranges; scales of targets that are 0 are the largest outputs there. */
static PetscErrorCode Start(Fit *f, const Settings *s, PetscReal x[])
{
  HycoSamples samples = NULL;
  HycoPrediction *p;
  const PetscReal *mu;
  PetscReal least = PETSC_MAX_REAL, r[HYCO_MAX_QUANTITIES];
  PetscInt n, n_par;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(f->scene, &samples));
  if (s->given)
    PetscCall(HycoSamplesAddPoint(samples, s->mu));
  else
    PetscCall(HycoSamplesAddScattered(samples, s->starts));
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(PetscCalloc1(n, &p));
  PetscCall(HycoROMSolveMany(f->model, n, n_par, mu, p, NULL, NULL));
  f->evaluations = n;
  for (PetscInt k = 0; k < f->n; k++) {
    /* Relative to the target; a target of 0 has no scale of its own. */
    f->scale[k] = PetscAbsReal(f->target[k]);
    for (PetscInt i = 0; i < n && f->target[k] == 0; i++)
      f->scale[k] = PetscMax(f->scale[k], PetscAbsReal(p[i].quantity[f->output[k]]));
    if (f->scale[k] == 0) f->scale[k] = 1;
  }
  for (PetscInt i = 0; i < n; i++) {
    Misfit(f, &p[i], r);
    /* `>=`: of equal starts the first. */
    if (p[i].reason <= 0 || Size(f->n, r) >= least) continue;
    least = Size(f->n, r);
    for (PetscInt q = 0; q < n_par; q++)
      x[q] = f->hi[q] > f->lo[q] ? (mu[i * n_par + q] - f->lo[q]) / (f->hi[q] - f->lo[q]) : 0;
  }
  PetscCall(PetscFree(p));
  PetscCall(HycoSamplesDestroy(&samples));
  HycoCheck(least < PETSC_MAX_REAL, "no prediction at the start of the fit converged; give another -mu");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Minimises from X by a type. Bounds 0 and 1; tolerances far below what is judged afterwards, so that IsMinimum()
   decides. */
static PetscErrorCode Minimise(Fit *f, const char type[], Vec X)
{
  const PetscBool squares = (PetscBool)(strcmp(type, TAOBRGN) == 0);
  Tao tao;
  Vec lo, hi, r;
  Mat J;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(X, &lo));
  PetscCall(VecDuplicate(X, &hi));
  PetscCall(VecSet(hi, 1));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->n, &r));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, f->n, f->n_par, NULL, &J));
  PetscCall(TaoCreate(PETSC_COMM_SELF, &tao));
  PetscCall(TaoSetType(tao, type));
  if (squares) {
    PetscCall(TaoSetResidualRoutine(tao, r, Residual, f));
    PetscCall(TaoSetJacobianResidualRoutine(tao, J, J, Jacobian, f));
    PetscCall(TaoBRGNSetRegularizerWeight(tao, WEIGHT));
  } else
    PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Objective, f));
  PetscCall(TaoSetSolution(tao, X));
  PetscCall(TaoSetVariableBounds(tao, lo, hi));
  PetscCall(TaoSetTolerances(tao, 1e-14, 0, 0));
  PetscCall(TaoSetMaximumIterations(tao, 200));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoDestroy(&tao));
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&lo));
  PetscCall(VecDestroy(&hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the last point is a minimum within the ranges, by the recomputed slope: a solver's flag is no evidence. */
static PetscBool IsMinimum(const Fit *f)
{
  PetscReal g[MOST], most = 0;

  Slope(f, g);
  for (PetscInt p = 0; p < f->n_par; p++) {
    /* At an end of the range with the slope pointing outside: the first-order condition holds. */
    const PetscBool held = (PetscBool)((f->x[p] <= 0 && g[p] > 0) || (f->x[p] >= 1 && g[p] < 0));

    if (!held) most = PetscMax(most, PetscAbsReal(g[p]));
  }
  return (PetscBool)(Size(f->n, f->r) <= EXACT || most <= MINIMUM * Size(f->n * f->n_par, f->J) * Size(f->n, f->r));
}

/* The requested type, and after it the other one if that ends at no minimum. *minimum: the last point is one. On
   each rank the same work: a model predicts on one process, and sharing gradients is not worth the messages. */
static PetscErrorCode Run(Fit *f, const Settings *s, PetscReal mu[], PetscBool *minimum, char method[64])
{
  PetscScalar *x;
  Vec X;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->n_par, &X));
  PetscCall(VecGetArray(X, &x));
  PetscCall(Start(f, s, x));
  PetscCall(VecRestoreArray(X, &x));
  *minimum = PETSC_FALSE;
  method[0] = '\0';
  for (PetscInt k = 0; k < 2 && !*minimum; k++) {
    const char *type = types[k ? !s->type : s->type];

    PetscCall(Minimise(f, type, X));
    PetscCall(EvaluateVec(f, X));
    *minimum = IsMinimum(f);
    PetscCall(PetscStrlcat(method, k ? ", then " : "", 64));
    PetscCall(PetscStrlcat(method, type, 64));
  }
  ToParameters(f, f->x, mu);
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the answer -- */

/* The scene for the check: the model's, with the outputs that have targets. Collective. The full-order scene may
   have other outputs, in another order: at[] maps those with targets. */
static PetscErrorCode LoadScene(const Fit *f, const char path[], HycoScene *scene, PetscInt at[])
{
  const char *names[HYCO_MAX_QUANTITIES];
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, scene));
  PetscCall(DriverCheckMesh(*scene));
  PetscCall(HycoROMCheckScene(f->model, *scene));
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  HycoSceneMatchQuantities(f->scene, *scene, at);
  for (PetscInt k = 0; k < f->n; k++)
    HycoCheck(at[f->output[k]] >= 0, "the scene has no output %s as the model has it; give its entries, as in training",
              names[f->output[k]]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One full-order solve at the answer: full[k], the outputs with targets. Collective. Fails before anything is
   written: an answer that full order cannot confirm is none. */
static PetscErrorCode Check(const Fit *f, HycoScene scene, const PetscInt at[], const PetscReal mu[], PetscReal full[])
{
  HycoFOM fom;
  HycoSummary summary;

  PetscFunctionBegin;
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, f->n_par, mu));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  HycoCheck(summary.reason > 0, "full order at the answer: %s; nothing was written", summary.why);
  for (PetscInt k = 0; k < f->n; k++) full[k] = summary.quantity[at[f->output[k]]];
  PetscCall(HycoFOMDestroy(&fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The root mean square of the relative differences from the targets. */
static PetscReal Mean(const Fit *f, const PetscReal value[])
{
  PetscReal r[HYCO_MAX_QUANTITIES];

  for (PetscInt k = 0; k < f->n; k++) r[k] = (value[k] - f->target[k]) / f->scale[k];
  return Size(f->n, r) / PetscSqrtReal((PetscReal)f->n);
}

static PetscErrorCode PrintAnswer(const Fit *f, const PetscReal mu[], const PetscReal full[], cJSON *json)
{
  const char *names[HYCO_MAX_QUANTITIES];
  char words[DRIVER_LINE];
  PetscReal value[HYCO_MAX_QUANTITIES];
  PetscInt n;
  cJSON *targets = cJSON_AddObjectToObject(json, "targets");

  PetscFunctionBegin;
  PetscCall(DriverFormatPoint(f->scene, mu, words, NULL));
  PetscCall(DriverPrint("found: %s\n", words));
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  for (PetscInt k = 0; k < f->n; k++) {
    cJSON *of = cJSON_AddObjectToObject(targets, names[f->output[k]]);

    value[k] = f->prediction.quantity[f->output[k]];
    ReportNumbers(of, {"target", f->target[k]}, {"model", value[k]});
    PetscCall(DriverPrint("%s: target %.6g, model %.6g", names[f->output[k]], (double)f->target[k], (double)value[k]));
    if (full) cJSON_AddNumberToObject(of, "full_order", full[k]);
    if (full) PetscCall(DriverPrint(", full order %.6g", (double)full[k]));
    PetscCall(DriverPrint("\n"));
  }
  cJSON_AddNumberToObject(json, "misfit_model", Mean(f, value));
  PetscCall(DriverPrint("misfit (relative, root mean square): model %.2g", (double)Mean(f, value)));
  if (full) cJSON_AddNumberToObject(json, "misfit_full_order", Mean(f, full));
  if (full)
    PetscCall(DriverPrint(", full order %.2g\n", (double)Mean(f, full)));
  else
    PetscCall(DriverPrint("; not checked at full order, for which -scene is needed\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A fit that ended at no minimum is a miss (exit status 3), with its report written. */
static PetscErrorCode Report(Fit *f, const PetscReal mu[], const PetscReal full[], PetscBool minimum,
                             const char method[])
{
  const char *const *names;
  cJSON *json, *ends;

  PetscFunctionBegin;
  PetscCall(ReportCreate("fit", f->scene, mu, &json));
  PetscCall(PrintAnswer(f, mu, full, json));
  cJSON_AddNumberToObject(json, "evaluations", f->evaluations);
  cJSON_AddStringToObject(json, "solver", method);
  cJSON_AddBoolToObject(json, "converged", minimum);
  cJSON_AddBoolToObject(json, "kink", f->kink);
  ends = cJSON_AddArrayToObject(json, "at_ends");
  PetscCall(HycoSceneGetParameters(f->scene, NULL, &names, NULL, NULL));
  for (PetscInt p = 0; p < f->n_par; p++) {
    if (mu[p] > f->lo[p] && mu[p] < f->hi[p]) continue;
    cJSON_AddItemToArray(ends, cJSON_CreateString(names[p]));
    PetscCall(DriverPrint("%s is at the end of its range\n", names[p]));
  }
  PetscCall(DriverPrint("%d predictions (%s)\n", (int)f->evaluations, method));
  if (minimum && Size(f->n, f->r) > UNMET * PetscSqrtReal((PetscReal)f->n))
    PetscCall(DriverPrint("the targets are not met; the misfit may have lower minima elsewhere: other starts (-mu, "
                          "-fit_starts) may find them\n"));
  if (!minimum)
    PetscCall(DriverMissed("the fit ended%s, where the misfit %.2g is no minimum by its slope; start elsewhere (-mu, "
                           "-fit_starts)",
                           f->kink ? " at a kink" : "", (double)(Size(f->n, f->r) / PetscSqrtReal((PetscReal)f->n))));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -mu or -mu_NAME as the start. Without -mu the start is searched; DriverGetPoint() would require all parameters. */
static PetscErrorCode ReadStart(const Fit *f, Settings *s)
{
  const char *const *names;
  char key[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(f->scene, NULL, &names, NULL, NULL));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-mu", &s->given));
  for (PetscInt p = 0; p < f->n_par && !s->given; p++) {
    PetscCall(PetscSNPrintf(key, sizeof(key), "-mu_%s", names[p]));
    PetscCall(PetscOptionsHasName(NULL, NULL, key, &s->given));
  }
  if (s->given) PetscCall(DriverGetPoint(f->scene, s->mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The answer is that of rank 0: others may differ in the last bits. Collective. */
static PetscErrorCode RunOnEach(Fit *f, const Settings *s, PetscReal mu[], PetscBool *minimum, char method[64])
{
  PetscFunctionBegin;
  HycoOnEach(PETSC_COMM_WORLD, Run(f, s, mu, minimum, method));
  PetscCallMPI(MPI_Bcast(mu, MOST, MPIU_REAL, 0, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Bcast(minimum, 1, HYCO_MPI_BOOL, 0, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareFit(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  Settings s;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, path, NULL));
  PetscCall(DriverGetPoint(NULL, NULL));
  PetscCall(DriverGet("target_", "<v> value that an output of the model should have: -target_OUTPUT v", path));
  PetscCall(ReadSettings(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene, if given, is loaded and checked before the fit, so that a mismatch is not found only after it. */
PetscErrorCode CommandFit(void)
{
  Fit f = {0};
  Settings s;
  PetscReal mu[MOST] = {0}, full[HYCO_MAX_QUANTITIES];
  PetscBool minimum;
  PetscInt at[HYCO_MAX_QUANTITIES];
  HycoScene scene = NULL;
  char own[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN], method[64] = "";

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(own, path, NULL, report, NULL));
  PetscCall(DriverRequire("model", path));
  PetscCall(ReadSettings(&s));
  HycoOnEach(PETSC_COMM_WORLD, HycoROMLoad(path, &f.model));
  PetscCall(HycoROMGetScene(f.model, &f.scene));
  PetscCall(HycoSceneRefuseHistory(f.scene, "hyco fit"));
  PetscCall(HycoSceneGetParameters(f.scene, &f.n_par, NULL, &f.lo, &f.hi));
  PetscCall(ReadTargets(&f));
  PetscCall(ReadStart(&f, &s));
  if (own[0])
    PetscCall(LoadScene(&f, own, &scene, at));
  else
    PetscCall(DriverRefuseOnly("full order", "it is for full order, which fit solves only with -scene"));
  PetscCall(DriverCheckLeftEarly());
  HycoStaged(HYCO_STAGE_ONLINE, RunOnEach(&f, &s, mu, &minimum, method));
  if (scene) HycoStaged(HYCO_STAGE_FULL_ORDER, Check(&f, scene, at, mu, full));
  PetscCall(DriverCheckLeft());
  PetscCall(Report(&f, mu, scene ? full : NULL, minimum, method));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(HycoROMDestroy(&f.model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
