/* hyco compare for a model of paths: the worst listed time and the end of each path, in full order's steps. */
#include "driver.h"

/* Errors by kind, at the worst time and at the end; then further columns; then the absolute error of each output at its
   worst time, and of each at the end. */
enum {
  CONVERGED = 2 * HYCO_N_ERRORS,
  REACHED,
  KKT,
  ITERATIONS,
  SECONDS_FOM,
  SECONDS_ROM,
  ESTIMATES,
  N_COLUMNS = ESTIMATES + DRIVER_JUDGED
};

PetscInt DriverPathColumns(void)
{
  return N_COLUMNS;
}

/* The errors of the outputs at the listed times that both paths reached, on the model's process: v as above. */
static PetscErrorCode CompareOutputs(HycoFOM fom, HycoROM model, const DriverOutputs *outputs, PetscReal v[])
{
  HycoHistory full, reduced;
  PetscInt both;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(fom, &full));
  PetscCall(HycoROMGetHistory(model, &reduced));
  both = PetscMin(full.n, reduced.n);
  for (PetscInt q = 0; q < outputs->n; q++) {
    PetscReal *worst = &v[q], *end = &v[outputs->n + q];

    *worst = *end = both ? 0 : PETSC_INFINITY;
    for (PetscInt k = 0; k < both; k++) {
      *end = PetscAbsReal(full.step[k].quantity[outputs->full[q]] - reduced.step[k].quantity[outputs->reduced[q]]);
      *worst = *end <= *worst ? *worst : *end;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full-order path and the model's, and their difference; root: the rank that predicts and whose v is used. */
PetscErrorCode DriverComparePath(HycoFOM fom, HycoROM model, PetscBool root, PetscInt n_par, const PetscReal mu[],
                                 const DriverOutputs *outputs, PetscReal v[])
{
  HycoSummary s;
  HycoPrediction p = {0};
  HycoPathErrors e = {0};

  PetscFunctionBegin;
  PetscCall(HycoROMComparePath(model, fom, n_par, mu, &e));
  PetscCall(HycoFOMGetSummary(fom, &s));
  if (root) PetscCall(HycoROMGetPrediction(model, &p));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    v[j] = e.worst[j];
    v[HYCO_N_ERRORS + j] = e.end[j];
  }
  v[CONVERGED] = p.reason > 0;
  v[REACHED] = e.n;
  v[KKT] = HycoKKTMax(&p.kkt);
  v[ITERATIONS] = p.iterations;
  v[SECONDS_FOM] = s.seconds.total;
  v[SECONDS_ROM] = p.seconds.total;
  DriverTakeEstimates(&p, v + ESTIMATES);
  if (root && outputs->n) PetscCall(CompareOutputs(fom, model, outputs, v + N_COLUMNS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "worst_u", ..., "end_u", ..., "worst_output_NAME", ..., "end_output_NAME", ... */
static PetscErrorCode NameColumns(const DriverOutputs *outputs, char names[][DRIVER_LINE], const char *columns[])
{
  static const char *const rest[] = {"converged",
                                     "times_reached",
                                     "kkt_max",
                                     "iterations",
                                     "seconds_full_order",
                                     "seconds_reduced",
                                     "estimated_error_u",
                                     "estimated_error_sigma",
                                     "estimated_error_lambda",
                                     "unseen"};

  PetscFunctionBegin;
  for (PetscInt c = 0; c < N_COLUMNS + 2 * outputs->n; c++) {
    const PetscInt q = c - N_COLUMNS;

    if (c < CONVERGED)
      PetscCall(PetscSNPrintf(names[c], DRIVER_LINE, "%s_%s", c < HYCO_N_ERRORS ? "worst" : "end",
                              HycoErrorKinds[c % HYCO_N_ERRORS]));
    else if (c < N_COLUMNS)
      PetscCall(PetscStrncpy(names[c], rest[c - CONVERGED], DRIVER_LINE));
    else
      PetscCall(PetscSNPrintf(names[c], DRIVER_LINE, "%s_output_%s", q < outputs->n ? "worst" : "end",
                              outputs->names[q % outputs->n]));
    columns[c] = names[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode JudgeEstimates(cJSON *json, PetscInt n, PetscInt width, const PetscReal value[])
{
  static const HycoErrorKind kinds[] = {HYCO_ERROR_U, HYCO_ERROR_SIGMA, HYCO_ERROR_LAMBDA};
  const PetscReal *error[DRIVER_JUDGED - 1];
  PetscReal *of;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * (DRIVER_JUDGED - 1), &of));
  for (PetscInt e = 0; e < DRIVER_JUDGED - 1; e++) {
    for (PetscInt k = 0; k < n; k++) of[e * n + k] = value[k * width + kinds[e]];
    error[e] = of + e * n;
  }
  PetscCall(DriverJudgeEstimates(json, n, width, value, ESTIMATES, error));
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReportPaths(HycoScene scene, const DriverOutputs *outputs, PetscBool contact, PetscInt n,
                                 const PetscReal mu[], PetscReal value[], const char table[])
{
  char names[N_COLUMNS + 2 * HYCO_MAX_QUANTITIES][DRIVER_LINE];
  const char *columns[N_COLUMNS + 2 * HYCO_MAX_QUANTITIES];
  DriverPiece all;
  DriverRows rows;
  PetscReal seconds[2] = {0, 0}, kkt = 0;
  PetscInt failed = 0, undefined = 0, width;
  cJSON *json;

  PetscFunctionBegin;
  PetscCall(NameColumns(outputs, names, columns));
  width = N_COLUMNS + 2 * outputs->n;
  rows = DriverRowsOfRoot(n, width, value, &all);
  if (table[0]) PetscCall(DriverWriteTable(table, scene, mu, columns, &rows));
  PetscCall(ReportCreate("compare", scene, NULL, &json));
  cJSON_AddNumberToObject(json, "n_points", n);
  PetscCall(Say("%d path%s, each at its worst listed time and at its end\n", (int)n, n == 1 ? "" : "s"));
  for (PetscInt c = 0; c < CONVERGED; c++) {
    const PetscInt kind = c % HYCO_N_ERRORS;

    if (contact || (kind != HYCO_ERROR_LAMBDA && kind != HYCO_ERROR_LAMBDA_RID))
      ReportError(json, names[c], n, width, value, c, CONVERGED, &undefined);
  }
  for (PetscInt c = N_COLUMNS; c < width; c++) ReportOutputError(json, names[c], n, width, value, c, CONVERGED);
  PetscCall(JudgeEstimates(json, n, width, value));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + k * width;

    seconds[0] += v[SECONDS_FOM] / n;
    seconds[1] += v[SECONDS_ROM] / n;
    kkt = PetscMax(kkt, v[KKT]);
    failed += v[CONVERGED] < 0.5;
  }
  cJSON_AddNumberToObject(json, "seconds_full_order", seconds[0]);
  cJSON_AddNumberToObject(json, "seconds_reduced", seconds[1]);
  cJSON_AddNumberToObject(json, "undefined", undefined);
  cJSON_AddNumberToObject(json, "not_converged", failed);
  cJSON_AddNumberToObject(json, "kkt_max", kkt);
  PetscCall(Say(
      "mean seconds of a path: full order %.3g, reduced %.3g; %d did not reach their end; largest KKT residual %.1e\n",
      (double)seconds[0], (double)seconds[1], (int)failed, (double)kkt));
  PetscCall(ReportWrite(&json));
  HycoCheck(!failed, "%d of the %d reduced paths did not reach their end; the errors do not include them", (int)failed,
            (int)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}
