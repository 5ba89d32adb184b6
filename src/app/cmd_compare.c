/* hyco compare: compares the reduced model with full order over a set of points. */
#include "driver.h"
#include <hycosnapshotsimpl.h>
#include <math.h>
#include <stdlib.h>

enum { E_U, E_U_H1, E_U_RID, E_SIGMA, E_SIGMA_11, E_LAMBDA_RID, E_LAMBDA_RID_DUAL, E_LAMBDA, E_LAMBDA_DUAL, N_ERRORS };
enum {
  CONVERGED = N_ERRORS,
  FALLBACK,
  KKT,
  COVERED,
  SECONDS_FOM,
  SECONDS_ROM,
  LAMBDA_NORM, /* of full order */
  SIGMA_NORM,
  ESTIMATES, /* of u, stress, forces, and the unseen regime */
  N_COLUMNS = ESTIMATES + DRIVER_JUDGED
};
static const char *const columns[N_COLUMNS] = {"error_u",
                                               "error_u_h1",
                                               "error_u_rid",
                                               "error_sigma",
                                               "error_sigma_11",
                                               "error_lambda_rid",
                                               "error_lambda_rid_dual",
                                               "error_lambda",
                                               "error_lambda_dual",
                                               "converged",
                                               "fallback",
                                               "kkt_max",
                                               "covered_force",
                                               "seconds_full_order",
                                               "seconds_reduced",
                                               "lambda_norm2",
                                               "sigma_norm2",
                                               "estimated_error_u",
                                               "estimated_error_sigma",
                                               "estimated_error_lambda",
                                               "unseen"};

void DriverTakeEstimates(const HycoPrediction *p, PetscReal v[DRIVER_JUDGED])
{
  const PetscReal estimate[] = {p->estimated_error_u, p->estimated_error_sigma, p->estimated_error_lambda};

  for (PetscInt k = 0; k < DRIVER_JUDGED - 1; k++) v[k] = estimate[k] >= 0 ? estimate[k] : NAN;
  v[DRIVER_JUDGED - 1] = p->unseen;
}

static int CompareReal(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return (x > y) - (x < y);
}

PetscErrorCode DriverJudgeEstimates(cJSON *json, PetscInt n, PetscInt width, const PetscReal value[], PetscInt first,
                                    const PetscReal *const error[DRIVER_JUDGED - 1])
{
  static const char *const words[] = {"u", "stress", "contact forces"};
  static const char *const keys[] = {"u", "sigma", "lambda"};
  cJSON *all = cJSON_AddObjectToObject(json, "estimates");
  PetscReal *ratio;
  PetscInt unseen = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &ratio));
  for (PetscInt e = 0; e < DRIVER_JUDGED - 1; e++) {
    PetscInt m = 0, bounded = 0;
    PetscReal worst = 0;
    cJSON *object;

    for (PetscInt k = 0; k < n && error[e]; k++) {
      const PetscReal estimate = value[k * width + first + e], true_error = error[e][k];

      if (isnan(estimate) || !isfinite(true_error)) continue;
      bounded += true_error <= estimate;
      worst = PetscMax(worst, true_error / PetscMax(estimate, PETSC_SMALL));
      ratio[m++] = estimate / PetscMax(true_error, PETSC_SMALL);
    }
    if (!m) continue;
    qsort(ratio, (size_t)m, sizeof(*ratio), CompareReal);
    object = cJSON_AddObjectToObject(all, keys[e]);
    cJSON_AddNumberToObject(object, "bounded", (PetscReal)bounded / m);
    cJSON_AddNumberToObject(object, "median_ratio", ratio[m / 2]);
    cJSON_AddNumberToObject(object, "worst_error_over_estimate", worst);
    PetscCall(Say("estimates of %s: at least the error at %.1f %% of the points; estimate / error %.3g in the median, "
                  "error / estimate at most %.3g\n",
                  words[e], 100. * bounded / m, (double)ratio[m / 2], (double)worst));
  }
  for (PetscInt k = 0; k < n; k++) unseen += value[k * width + first + DRIVER_JUDGED - 1] > HYCO_UNSEEN;
  cJSON_AddNumberToObject(all, "unseen", unseen);
  if (unseen) PetscCall(Say("unseen regime at %d of %d points\n", (int)unseen, (int)n));
  PetscCall(PetscFree(ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A relative error of a quantity with this norm, for the estimates: norms below a tenth of the set's largest count as
   this tenth. */
static PetscReal Guarded(PetscReal error, PetscReal size, PetscReal largest)
{
  return size > 0 ? error * size / PetscMax(size, 0.1 * largest) : error;
}

/* The same with the errors of stresses and forces as in the estimates. */
static PetscErrorCode JudgeEstimates(cJSON *json, PetscInt n, PetscInt width, const PetscReal value[])
{
  const PetscReal *error[DRIVER_JUDGED - 1];
  PetscReal *of[DRIVER_JUDGED - 1], largest[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n, &of[0], n, &of[1], n, &of[2]));
  for (PetscInt k = 0; k < n; k++) {
    largest[0] = PetscMax(largest[0], value[k * width + SIGMA_NORM]);
    largest[1] = PetscMax(largest[1], value[k * width + LAMBDA_NORM]);
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + k * width;

    of[0][k] = v[E_U];
    of[1][k] = Guarded(v[E_SIGMA], v[SIGMA_NORM], largest[0]);
    of[2][k] = Guarded(v[E_LAMBDA], v[LAMBDA_NORM], largest[1]);
  }
  for (PetscInt e = 0; e < DRIVER_JUDGED - 1; e++) error[e] = of[e];
  PetscCall(DriverJudgeEstimates(json, n, width, value, ESTIMATES, error));
  PetscCall(PetscFree3(of[0], of[1], of[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCommonOutputs(HycoScene scene, HycoROM model, DriverOutputs *outputs)
{
  const char *names[HYCO_MAX_QUANTITIES];
  HycoScene other;
  PetscInt n, at[HYCO_MAX_QUANTITIES];

  PetscFunctionBegin;
  PetscCall(HycoROMGetScene(model, &other));
  PetscCall(HycoSceneGetQuantities(scene, &n, names));
  HycoSceneMatchQuantities(scene, other, at);
  outputs->n = 0;
  for (PetscInt q = 0; q < n; q++) {
    if (at[q] < 0) continue;
    outputs->full[outputs->n] = q;
    outputs->reduced[outputs->n] = at[q];
    outputs->names[outputs->n++] = names[q];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of a table: these, then the absolute error of each output that the scene and the model have. */
typedef struct {
  PetscInt n;
  const char *names[N_COLUMNS + HYCO_MAX_QUANTITIES];
  char error_name[HYCO_MAX_QUANTITIES][DRIVER_LINE];
} Shape;

static PetscErrorCode ShapeOf(const DriverOutputs *outputs, Shape *s)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < N_COLUMNS; c++) s->names[c] = columns[c];
  s->n = N_COLUMNS + outputs->n;
  for (PetscInt q = 0; q < outputs->n; q++) {
    PetscCall(PetscSNPrintf(s->error_name[q], DRIVER_LINE, "error_output_%s", outputs->names[q]));
    s->names[N_COLUMNS + q] = s->error_name[q];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One point on one group: both solutions, and their difference. */
static PetscErrorCode ComparePoint(HycoScene scene, HycoFOM fom, HycoROM model, PetscInt n_par, const PetscReal mu[],
                                   const DriverOutputs *outputs, PetscReal v[])
{
  HycoSummary s;
  HycoPrediction p;
  HycoErrors e = {0};
  char words[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMSolve(fom, n_par, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  if (s.reason < 0) {
    PetscCall(DriverFormatPoint(scene, mu, words, NULL));
    HycoFail("the full-order solution at %s failed: %s; no comparison is possible", words, s.why);
  }
  PetscCall(HycoROMPredict(model, n_par, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  PetscCall(HycoROMCompare(model, fom, &e));
  v[E_U] = e.u;
  v[E_U_H1] = e.u_h1;
  v[E_U_RID] = e.u_rid;
  v[E_SIGMA] = e.sigma;
  v[E_SIGMA_11] = e.sigma_11;
  v[E_LAMBDA_RID] = e.lambda_rid;
  v[E_LAMBDA_RID_DUAL] = e.lambda_rid_dual;
  v[E_LAMBDA] = e.lambda;
  v[E_LAMBDA_DUAL] = e.lambda_dual;
  v[CONVERGED] = p.reason > 0;
  v[FALLBACK] = p.reason == HYCO_CONVERGED_FALLBACK;
  v[KKT] = HycoKKTMax(&p.kkt);
  v[COVERED] = p.covered_force;
  v[SECONDS_FOM] = s.seconds.total;
  v[SECONDS_ROM] = p.seconds.total;
  v[LAMBDA_NORM] = s.lambda_norm2;
  v[SIGMA_NORM] = e.sigma_norm2;
  DriverTakeEstimates(&p, v + ESTIMATES);
  for (PetscInt q = 0; q < outputs->n; q++)
    v[N_COLUMNS + q] = PetscAbsReal(p.quantity[outputs->reduced[q]] - s.quantity[outputs->full[q]]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the scene has a history, and the number of values per point. */
static PetscErrorCode CountColumns(HycoScene scene, const DriverOutputs *outputs, PetscBool *paths, PetscInt *n)
{
  PetscInt n_times;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  *paths = (PetscBool)(n_times > 0);
  *n = *paths ? DriverPathColumns() + 2 * outputs->n : N_COLUMNS + outputs->n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of a comparison, shared by a queue. value: rows of those that this rank's group takes. */
typedef struct {
  HycoScene scene;
  HycoROM model;
  HycoQueue queue;
  PetscInt n, n_par, n_columns;
  const PetscReal *mu;
  PetscReal *value;
  PetscBool paths;
  DriverOutputs outputs;
} Points;

static PetscErrorCode CompareQueued(const Points *p, HycoFOM fom, PetscBool root, PetscReal unused[])
{
  PetscInt k, n_done;
  PetscMPIInt rank;
  char word[] = "points:";

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscBool first = PETSC_TRUE;; first = PETSC_FALSE) {
    PetscReal *v;

    PetscCall(HycoQueueTake(p->queue, &k));
    if (!first && rank == 0) {
      PetscCall(HycoQueueDone(p->queue, &n_done));
      PetscCall(DriverProgress(n_done, p->n, word));
    }
    if (k < 0) PetscFunctionReturn(PETSC_SUCCESS);
    v = root ? p->value + k * p->n_columns : unused;
    PetscCall(p->paths ? DriverComparePath(fom, p->model, root, p->n_par, p->mu + k * p->n_par, &p->outputs, v)
                       : ComparePoint(p->scene, fom, p->model, p->n_par, p->mu + k * p->n_par, &p->outputs, v));
  }
}

static PetscErrorCode CompareMine(const Points *p)
{
  HycoFOM fom;
  MPI_Comm group;
  PetscMPIInt rank;
  PetscReal *unused;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p->n_columns, &unused));
  PetscCall(HycoQueueGetGroup(p->queue, &group));
  PetscCall(HycoFOMCreate(group, p->scene, &fom));
  PetscCallMPI(MPI_Comm_rank(group, &rank));
  PetscCall(CompareQueued(p, fom, (PetscBool)(rank == 0), unused));
  PetscCall(PetscFree(unused));
  PetscCall(HycoFOMDestroy(&fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers a row for each point on every rank. */
static PetscErrorCode CompareAll(Points *p)
{
  PetscInt *list;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p->n, &list));
  for (PetscInt k = 0; k < p->n; k++) list[k] = k;
  PetscCall(HycoSnapshotsCreateQueue(PETSC_COMM_WORLD, p->scene, p->n_par, p->mu, p->n, list, p->n, &p->queue));
  PetscCall(PetscFree(list));
  PetscCall(CountColumns(p->scene, &p->outputs, &p->paths, &p->n_columns));
  PetscCall(PetscCalloc1(p->n * p->n_columns, &p->value));
  HycoOnEach(PETSC_COMM_WORLD, HycoQueueEnd(p->queue, CompareMine(p)));
  HycoAllreduce(p->value, p->n * p->n_columns, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD);
  PetscCall(HycoQueueDestroy(&p->queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(HycoScene scene, PetscBool contact, const Shape *shape, PetscInt n,
                             const PetscReal value[])
{
  cJSON *json, *object;
  PetscReal *ratio, mean = 0, kkt = 0, covered[2] = {0, 1};
  PetscInt undefined = 0, failed = 0, fallback = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &ratio));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + k * shape->n;

    ratio[k] = v[SECONDS_FOM] / PetscMax(v[SECONDS_ROM], 1e-9);
    mean += ratio[k] / n;
    kkt = PetscMax(kkt, v[KKT]);
    failed += v[CONVERGED] < 0.5;
    fallback += v[FALLBACK] > 0.5;
    covered[0] += v[COVERED] / n;
    covered[1] = PetscMin(covered[1], v[COVERED]);
  }
  qsort(ratio, (size_t)n, sizeof(*ratio), CompareReal);
  PetscCall(ReportCreate("compare", scene, NULL, &json));
  cJSON_AddNumberToObject(json, "n_points", n);
  PetscCall(Say("%d point%s\n", (int)n, n == 1 ? "" : "s"));
  for (PetscInt k = 0; k < (contact ? N_ERRORS : E_LAMBDA_RID); k++)
    ReportError(json, columns[k], n, shape->n, value, k, CONVERGED, &undefined);
  for (PetscInt c = N_COLUMNS; c < shape->n; c++)
    ReportOutputError(json, shape->names[c], n, shape->n, value, c, CONVERGED);
  PetscCall(JudgeEstimates(json, n, shape->n, value));
  object = cJSON_AddObjectToObject(json, "speedup");
  cJSON_AddNumberToObject(object, "mean", mean);
  cJSON_AddNumberToObject(object, "median", ratio[n / 2]);
  PetscCall(Say("speed-up: mean %.3g, median %.3g\n", (double)mean, (double)ratio[n / 2]));
  if (contact) {
    object = cJSON_AddObjectToObject(json, "covered_force");
    cJSON_AddNumberToObject(object, "mean", covered[0]);
    cJSON_AddNumberToObject(object, "min", covered[1]);
    PetscCall(Say("contact force in the RID: mean %.1f %%, least %.1f %%\n", 100 * (double)covered[0],
                  100 * (double)covered[1]));
  }
  cJSON_AddNumberToObject(json, "undefined", undefined);
  cJSON_AddNumberToObject(json, "not_converged", failed);
  cJSON_AddNumberToObject(json, "fallback", fallback);
  cJSON_AddNumberToObject(json, "kkt_max", kkt);
  PetscCall(Say("%d not converged, %d by the fallback solver, %d errors undefined (x/0); largest KKT residual %.1e\n",
                (int)failed, (int)fallback, (int)undefined, (double)kkt));
  PetscCall(PetscFree(ratio));
  PetscCall(ReportWrite(&json));
  HycoCheck(!failed, "%d of the %d predictions did not converge; the errors do not include them", (int)failed, (int)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -mu, or -mu_NAME for each parameter: a set of one. */
static PetscErrorCode AddOnePoint(HycoScene scene, HycoSamples samples, PetscBool *given)
{
  PetscReal mu[64];

  PetscFunctionBegin;
  PetscCall(DriverHasPoint(scene, given));
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DriverGetPoint(scene, mu));
  PetscCall(HycoSamplesAddPoint(samples, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareCompare(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, path, path));
  PetscCall(DriverGetPoint(NULL, NULL));
  PetscCall(DriverGetSamples(NULL, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CommandCompare(void)
{
  HycoScene scene;
  HycoROM model = NULL;
  HycoSamples samples;
  Points p = {0};
  DriverPiece all;
  DriverRows rows;
  Shape shape;
  PetscBool given, contact;
  char path[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN], table[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, file, NULL, report, table));
  PetscCall(DriverRequire("scene", path));
  PetscCall(DriverRequire("model", file));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  HycoOnEach(PETSC_COMM_WORLD, HycoROMLoad(file, &model));
  PetscCall(HycoROMCheckScene(model, scene));
  PetscCall(DriverGetSamples(scene, &samples, &given));
  if (!given) PetscCall(AddOnePoint(scene, samples, &given));
  HycoCheck(given, "give the test points: -mu V,V,... for one, or -grid N,N,..., or -values_NAME V,V,... for each "
                   "parameter, or -points FILE.csv");
  PetscCall(HycoSamplesGet(samples, &p.n, &p.n_par, &p.mu));
  PetscCall(DriverCheckLeftEarly());
  PetscCall(HycoSceneHasContact(scene, &contact));
  p.scene = scene;
  p.model = model;
  PetscCall(DriverCommonOutputs(scene, model, &p.outputs));
  PetscCall(CompareAll(&p));
  PetscCall(ShapeOf(&p.outputs, &shape));
  rows = DriverRowsOfRoot(p.n, shape.n, p.value, &all);
  if (table[0] && !p.paths) PetscCall(DriverWriteTable(table, scene, p.mu, shape.names, &rows));
  PetscCall(p.paths ? DriverReportPaths(scene, &p.outputs, contact, p.n, p.mu, p.value, table)
                    : Report(scene, contact, &shape, p.n, p.value));
  PetscCall(PetscFree(p.value));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
