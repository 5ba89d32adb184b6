/* The JSON report. */
#include "driver.h"
#include <hycofile.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/resource.h>

/* Error in time above which a report says so: default steps stay below in tests/paths. */
#define LARGE_TIME_ERROR 0.06
#define REPORT_FORMAT    1 /* raised when a key changes its meaning or goes; new keys do not raise it */

/* A column of a table: over the rows that converged, its mean and largest value, and their number. */
typedef struct {
  PetscReal mean, worst;
  PetscInt used, undefined, apart; /* rows where it is finite, where it is not, where it was not compared (NaN) */
} Column;

/* Collective only in that all ranks call it: each has the object, rank 0 writes. */
PetscErrorCode ReportCreate(const char command[], HycoScene scene, const PetscReal mu[], cJSON **json)
{
  PetscInt n;
  const char *const *names;
  const char *title;
  cJSON *point;

  PetscFunctionBegin;
  *json = cJSON_CreateObject();
  cJSON_AddNumberToObject(*json, "format", REPORT_FORMAT);
  PetscCall(HycoSceneGetTitle(scene, &title));
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  cJSON_AddStringToObject(*json, "command", command);
  cJSON_AddStringToObject(*json, "scene", title);
  point = cJSON_AddObjectToObject(*json, "mu");
  /* A set of points has an empty object. */
  for (PetscInt p = 0; mu && p < n; p++) cJSON_AddNumberToObject(point, names[p], mu[p]);
  cJSON_AddNumberToObject(*json, "ranks", HycoSize(PETSC_COMM_WORLD));
  PetscCall(DriverReportOptionFiles(*json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void ReportNumbers_Private(cJSON *json, PetscInt n, const ReportNumber number[])
{
  for (PetscInt k = 0; k < n; k++) cJSON_AddNumberToObject(json, number[k].name, number[k].value);
}

/* Above one facet the slave has passed its master: the pairing before any displacement, on which small sliding
   rests, no longer holds. */
PetscErrorCode DriverWarnSliding(PetscReal sliding)
{
  PetscFunctionBegin;
  if (sliding > 1)
    PetscCall(
        DriverPrint("LARGE SLIDING: a closed contact moves by %.2g facets along its surface; contact pairs are found "
                    "before displacement, and are valid for less than one facet\n",
                    (double)sliding));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the sum of the steps' estimates, which bounds the error from above where stresses relax; none without creep. */
PetscErrorCode DriverWarnSteps(PetscReal time_error)
{
  char share[32];

  PetscFunctionBegin;
  if (!(time_error > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  DriverPercent(time_error, share);
  PetscCall(DriverPrint(
      "%sestimated error of creep strains by the time steps: %s of the largest%s\n",
      time_error > LARGE_TIME_ERROR ? "LONG TIME STEPS: " : "", share,
      time_error > LARGE_TIME_ERROR ? "; give none or more of -hyco_substeps, or a smaller -hyco_step_error" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Remarks that concern the validity of any result, full order or reduced. */
PetscErrorCode ReportContacts(cJSON *json, PetscInt n_contacts, PetscInt n_facing, PetscReal overlap, PetscReal sliding)
{
  PetscFunctionBegin;
  ReportNumbers(json, {"n_facing", n_facing}, {"overlap", overlap}, {"sliding", sliding});
  if (n_contacts && !n_facing)
    PetscCall(DriverPrint("NO CONTACT: no slave node faces a master at these parameter values\n"));
  if (overlap > 0) PetscCall(DriverPrint("largest initial overlap %.4g\n", (double)overlap));
  PetscCall(DriverWarnSliding(sliding));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN is written as null by cJSON: an output without a value, as a model without reconstruction has it. */
PetscErrorCode ReportQuantities(cJSON *json, HycoScene scene, const PetscReal value[])
{
  const char *names[HYCO_MAX_QUANTITIES], *units[HYCO_MAX_QUANTITIES];
  cJSON *object, *given;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(scene, &n, names));
  PetscCall(HycoSceneGetQuantityUnits(scene, &n, units));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  object = cJSON_AddObjectToObject(json, "outputs");
  given = cJSON_AddObjectToObject(json, "output_units");
  for (PetscInt k = 0; k < n; k++) {
    cJSON_AddNumberToObject(object, names[k], value[k]);
    cJSON_AddStringToObject(given, names[k], units[k]);
    PetscCall(DriverPrint("%s %.6g%s%s%s", names[k], (double)value[k], units[k][0] ? " " : "", units[k],
                          k + 1 < n ? ", " : "\n"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quantity whose name is a column's gets a prefix: names of columns must be unique. */
PetscErrorCode ReportColumns(HycoScene scene, PetscInt n, const char *const columns[], PetscInt *n_all,
                             const char *names[])
{
  static char renamed[HYCO_MAX_QUANTITIES][HYCO_LINE / 8]; /* names are borrowed, like those of the scene */

  PetscFunctionBegin;
  for (PetscInt c = 0; c < n; c++) names[c] = columns[c];
  PetscCall(HycoSceneGetQuantities(scene, n_all, names + n));
  for (PetscInt k = 0; k < *n_all; k++) {
    for (PetscInt c = 0; c < n; c++) {
      /* Readers tell T from t. */
      if (strcmp(names[n + k], columns[c]) || names[n + k] == renamed[k]) continue;
      snprintf(renamed[k], sizeof(renamed[k]), "output.%s", columns[c]);
      names[n + k] = renamed[k];
    }
  }
  *n_all += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For tables of paths, whose outputs are those of the end. */
PetscErrorCode ReportExtremes(PetscInt n, const char *names[], PetscInt *n_all,
                              char extreme[HYCO_MAX_QUANTITIES][DRIVER_LINE])
{
  const PetscInt outputs = *n_all - n;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < outputs; k++) {
    PetscCall(PetscSNPrintf(extreme[k], DRIVER_LINE, "path_%s", names[n + k]));
    names[(*n_all)++] = extreme[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relative residuals that were recomputed from K, B, F and D, not what the solver believes. */
void ReportKKT(cJSON *json, const HycoKKT *kkt)
{
  cJSON *object = cJSON_AddObjectToObject(json, "kkt");

  ReportNumbers(object, {"stationarity", kkt->stationarity}, {"penetration", kkt->penetration},
                {"adhesion", kkt->adhesion}, {"complementarity", kkt->complementarity});
}

void ReportSeconds(cJSON *json, const HycoSeconds *seconds)
{
  cJSON *object = cJSON_AddObjectToObject(json, "seconds");

  ReportNumbers(object, {"setup", seconds->setup}, {"assemble", seconds->assemble}, {"factor", seconds->factor},
                {"solve", seconds->solve}, {"total", seconds->total});
}

/* Arrays have the scene's dimension or one moment in 2D: no component that is 0 by definition. */
void ReportVector(cJSON *json, const char name[], PetscInt n, const PetscReal v[])
{
  cJSON *array = cJSON_AddArrayToObject(json, name);

  for (PetscInt k = 0; k < n; k++) cJSON_AddItemToArray(array, cJSON_CreateNumber(v[k]));
}

/* Under a temporary name until the close succeeds: a full disk leaves the old file. */
PetscErrorCode DriverWriteText(const char path[], const char text[])
{
  HycoFile out;

  PetscFunctionBegin;
  PetscCall(HycoFileCreate(path, HYCO_FILE_TEXT, &out));
  (void)!fputs(text, HycoFileStream(out)); /* Close reports a failure */
  PetscCall(HycoFileClose(&out, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds an object with these numbers of a column. */
static void AddColumn(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                      PetscInt column, PetscInt converged, Column *c)
{
  cJSON *object = cJSON_AddObjectToObject(json, name);

  *c = (Column){0};
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal e = value[k * n_columns + column];

    if (value[k * n_columns + converged] < 0.5) continue;
    /* Infinite and the library's largest numbers alike. */
    c->undefined += e > PETSC_MAX_REAL / 8;
    c->apart += PetscIsNanReal(e);
    if (!(e <= PETSC_MAX_REAL / 8)) continue;
    c->mean += e;
    c->worst = PetscMax(c->worst, e);
    c->used++;
  }
  c->mean /= PetscMax(1, c->used);
  ReportNumbers(object, {"undefined", c->undefined}, {"not_compared", c->apart});
  if (c->used) {
    ReportNumbers(object, {"mean", c->mean}, {"max", c->worst});
  } else { /* defined at no point */
    cJSON_AddNullToObject(object, "mean");
    cJSON_AddNullToObject(object, "max");
    (void)!DriverPrint("  %-21s %s at every point\n", name, c->undefined ? "undefined" : "not compared");
  }
}

#define WORTH_TRAINING 3 /* times: a smaller gain is hardly worth a training */

/* Processor time, which other load of the machine does not change. A training that never pays has no break-even. */
PetscErrorCode DriverReportGain(cJSON *json, const char point[], PetscReal full, PetscReal reduced, PetscReal training)
{
  const PetscReal times = full / PetscMax(reduced, 1e-9), after = full > reduced ? training / (full - reduced) : 0;
  cJSON *gain = cJSON_AddObjectToObject(json, "gain");

  PetscFunctionBegin;
  ReportNumbers(gain, {"times", times}, {"cpu_full_order", full}, {"cpu_predicted", reduced});
  if (training > 0) cJSON_AddNumberToObject(gain, "cpu_training", training);
  if (after > 0) cJSON_AddNumberToObject(gain, "break_even", PetscCeilReal(after));
  PetscCall(DriverPrint("gain: a %s takes %.3g ms of CPU at full order, %.3g ms predicted with outputs and estimates: "
                        "%.3g times%s",
                        point, 1e3 * (double)full, 1e3 * (double)reduced, (double)times,
                        times < 1                ? "; this model is slower"
                        : times < WORTH_TRAINING ? "; this model gains little"
                                                 : ""));
  if (after > 0) PetscCall(DriverPrint("; the training pays from %.0f %ss on", ceil((double)after), point));
  PetscCall(DriverPrint("\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relative errors, in per cent on the screen and as shares in the report. Points where the error is x/0 are
   counted and left out of the mean, which would otherwise be infinite. */
void ReportError(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                 PetscInt column, PetscInt converged, PetscInt *all_undefined)
{
  Column c;

  AddColumn(json, name, n, n_columns, value, column, converged, &c);
  *all_undefined += c.undefined;
  if (c.used)
    (void)!DriverPrint("  %-21s mean %9.4f %%   max %9.4f %%\n", name, 100 * (double)c.mean, 100 * (double)c.worst);
}

/* Absolute and in the unit of the output: an output may pass through 0, where a relative error means nothing. */
void ReportOutputError(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                       PetscInt column, PetscInt converged)
{
  Column c;

  AddColumn(json, name, n, n_columns, value, column, converged, &c);
  if (c.used) (void)!DriverPrint("  %-21s mean %9.4g     max %9.4g\n", name, (double)c.mean, (double)c.worst);
}

/* The column of a set's table that says whether a point converged. */
static PetscInt FindConverged(PetscInt n_columns, const char *const columns[])
{
  for (PetscInt c = 0; c < n_columns; c++) {
    if (strcmp(columns[c], "converged") == 0) return c;
  }
  return 0;
}

/* The table is written even if points or gradients failed; the command fails after it, with the number. */
PetscErrorCode ReportSet(const char command[], const char table[], HycoScene scene, HycoSamples samples,
                         const char *const columns[], const DriverRows *rows, PetscReal seconds)
{
  const PetscInt converged = FindConverged(rows->width, columns);
  PetscInt n, failed = 0;
  const PetscReal *mu;
  cJSON *json;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  for (PetscInt p = 0; p < rows->n_pieces; p++) {
    for (PetscInt k = 0; k < rows->piece[p].n; k++)
      failed += rows->piece[p].value[(size_t)k * (size_t)rows->width + (size_t)converged] < 0.5;
  }
  /* Each rank has only the rows that it took. */
  HycoAllreduce(&failed, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  if (table[0]) PetscCall(DriverWriteTable(table, scene, mu, columns, rows));
  PetscCall(DriverPrint("%d points in %.3f s (%.3g a second), %d not converged%s\n", (int)n, (double)seconds,
                        seconds > 0 ? (double)(n / seconds) : 0., (int)failed,
                        table[0] ? "" : "; -table FILE.csv writes their results"));
  PetscCall(ReportCreate(command, scene, NULL, &json));
  ReportNumbers(json, {"n_points", n}, {"not_converged", failed}, {"seconds_total", seconds});
  if (rows->lacking.n) ReportNumbers(json, {"without_gradient", rows->lacking.n});
  if (seconds > 0) cJSON_AddNumberToObject(json, "points_per_second", n / seconds);
  PetscCall(ReportWrite(&json));
  HycoCheck(!failed, "%d of the %d points did not converge; the column converged of %s says which", (int)failed, (int)n,
            table[0] ? table : "a table (-table FILE.csv)");
  HycoCheck(!rows->lacking.n, "%d of the %d points have no gradient: their columns d_ of %s are nan; the first: %s",
            (int)rows->lacking.n, (int)n, table[0] ? table : "a table (-table FILE.csv)", rows->lacking.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Memory is the largest of the run so far, which is why the report is written last. */
PetscErrorCode ReportWrite(cJSON **json)
{
  char path[PETSC_MAX_PATH_LEN], *text;
  struct rusage usage;
  PetscReal mine, all, largest;

  PetscFunctionBegin;
  getrusage(RUSAGE_SELF, &usage);
  mine = (PetscReal)usage.ru_maxrss / 1024;
  PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(&mine, &largest, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  ReportNumbers(*json, {"memory_mb", all}, {"memory_mb_largest_rank", largest});
  DriverReportMissed(*json);
  PetscCall(DriverReadFiles(NULL, NULL, NULL, path, NULL));
  if (path[0]) {
    text = cJSON_Print(*json);
    /* An error of writing is raised on all ranks, which end together. */
    HycoOnRoot(PETSC_COMM_WORLD, DriverWriteText(path, text));
    cJSON_free(text);
  }
  cJSON_Delete(*json);
  *json = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
