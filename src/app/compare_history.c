/* hyco compare for a model of paths: the worst listed time and the end of each path, in full order's steps. */
#include "driver.h"

/* Errors by kind, at the worst time and at the end; then further columns. */
enum { CONVERGED = 2 * HYCO_N_ERRORS, REACHED, KKT, ITERATIONS, SECONDS_FOM, SECONDS_ROM, N_COLUMNS };

PetscInt DriverPathColumns(void)
{
  return N_COLUMNS;
}

/* The full-order path and the model's, and their difference; root: the rank that predicts and whose v is used. */
PetscErrorCode DriverComparePath(HycoFOM fom, HycoROM model, PetscBool root, PetscInt n_par, const PetscReal mu[],
                                 PetscReal v[])
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "worst_u", ..., "end_u", ... */
static PetscErrorCode NameColumns(char names[][64], const char *columns[])
{
  static const char *const rest[] = {"converged",  "times_reached",      "kkt_max",
                                     "iterations", "seconds_full_order", "seconds_reduced"};

  PetscFunctionBegin;
  for (PetscInt c = 0; c < N_COLUMNS; c++) {
    if (c < CONVERGED)
      PetscCall(
          PetscSNPrintf(names[c], 64, "%s_%s", c < HYCO_N_ERRORS ? "worst" : "end", HycoErrorKinds[c % HYCO_N_ERRORS]));
    else
      PetscCall(PetscStrncpy(names[c], rest[c - CONVERGED], 64));
    columns[c] = names[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReportPaths(HycoScene scene, PetscBool contact, PetscInt n, const PetscReal mu[],
                                 PetscReal value[], const char table[])
{
  char names[N_COLUMNS][64];
  const char *columns[N_COLUMNS];
  DriverPiece all;
  const DriverRows rows = DriverRowsOfRoot(n, N_COLUMNS, value, &all);
  PetscReal seconds[2] = {0, 0}, kkt = 0;
  PetscInt failed = 0, undefined = 0;
  cJSON *json;

  PetscFunctionBegin;
  PetscCall(NameColumns(names, columns));
  if (table[0]) PetscCall(DriverWriteTable(table, scene, mu, columns, &rows));
  PetscCall(ReportCreate("compare", scene, NULL, &json));
  cJSON_AddNumberToObject(json, "n_points", n);
  PetscCall(Say("%d path%s, each at its worst listed time and at its end\n", (int)n, n == 1 ? "" : "s"));
  for (PetscInt c = 0; c < CONVERGED; c++) {
    const PetscInt kind = c % HYCO_N_ERRORS;

    if (contact || (kind != HYCO_ERROR_LAMBDA && kind != HYCO_ERROR_LAMBDA_RID))
      ReportError(json, names[c], n, N_COLUMNS, value, c, CONVERGED, &undefined);
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + k * N_COLUMNS;

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
