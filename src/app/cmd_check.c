/* hyco check: reads and assembles a whole scene, solves only on request; reports its contents and its cost. */
#include "check.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

/* Collected, and printed at the end: among the other lines they would be overlooked. Rank 0 prints and reports them;
   the other ranks have the same list or none. */
void CheckReportWarning(Check *check, const char format[], ...)
{
  char line[HYCO_LINE];
  va_list args;

  va_start(args, format);
  vsnprintf(line, sizeof(line), format, args);
  va_end(args);
  cJSON_AddItemToArray(check->warnings, cJSON_CreateString(line));
}

/* A parameter's range: wide ones, those of a single value. */
static PetscErrorCode ReportRange(Check *check, const HycoVariableInspection *v, PetscReal lo, PetscReal hi)
{
  PetscFunctionBegin;
  if (v->wide) {
    cJSON_AddItemToArray(cJSON_GetObjectItem(check->json, "wide_ranges"), cJSON_CreateString(v->name));
    CheckReportWarning(
        check,
        "the parameter %s is a stiffness over %.2g decades: training samples its logarithm, a grid and a "
        "table of yours should too; or let that be the parameter: q from %.4g to %.4g, and 10^q in place "
        "of %s",
        v->name, log10((double)(hi / lo)), log10((double)lo), log10((double)hi), v->name);
  }
  if (lo == hi) CheckReportWarning(check, "the range of the parameter %s is a single value", v->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A parameter, or the time of a history, or one of its tables. A parameter that affects nothing is probably a
   misspelt name in an expression. */
static PetscErrorCode ReportVariable(Check *check, PetscInt p, cJSON *reaches)
{
  const HycoVariableInspection *v = &check->in.variable[p];
  cJSON *list = cJSON_AddArrayToObject(reaches, v->name);
  const PetscReal *lo, *hi;
  const char *what;
  char words[HYCO_LINE] = "";
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(check->scene, &n, NULL, &lo, &hi));
  /* Variables are ordered: parameters, the time, tables. */
  what = p < n ? "parameter" : p == n ? "time" : "table";
  for (PetscInt k = 0; k < HYCO_N_AFFECTED; k++) {
    if (!v->affects[k]) continue;
    PetscCall(HycoListAdd(words, ", ", HycoAffectedNames[k]));
    cJSON_AddItemToArray(list, cJSON_CreateString(HycoAffectedNames[k]));
  }
  if (!words[0] && p == n) PetscFunctionReturn(PETSC_SUCCESS); /* laws and tables depend on time in any case */
  PetscCall(DriverPrint("%s %s", what, v->name));
  if (p < n) PetscCall(DriverPrint(" from %g to %g", (double)lo[p], (double)hi[p]));
  PetscCall(DriverPrint(": affects %s\n", words[0] ? words : "nothing"));
  if (!words[0]) CheckReportWarning(check, "the %s %s affects nothing: no expression uses it", what, v->name);
  if (p < n) PetscCall(ReportRange(check, v, lo[p], hi[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What was found, on rank 0. */
static PetscErrorCode CheckCommandDescribe(Check *check)
{
  const HycoInspection *in = &check->in;
  const PetscReal *times;
  PetscInt n_par, n_times;
  cJSON *reaches;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(check->scene, &n_par, NULL, NULL, NULL));
  PetscCall(HycoSceneGetHistory(check->scene, &n_times, &times));
  /* The order of the text: from the mesh to what acts on it. */
  PetscCall(CheckReportMesh(check));
  PetscCall(CheckReportBodies(check));
  PetscCall(CheckReportContacts(check));
  PetscCall(CheckReportMotions(check));
  reaches = cJSON_AddObjectToObject(check->json, "parameters");
  cJSON_AddArrayToObject(check->json, "wide_ranges");
  for (PetscInt p = 0; p < in->n_variables; p++) PetscCall(ReportVariable(check, p, reaches));
  if (n_times)
    PetscCall(
        DriverPrint("history of %d times from %g to %g\n", (int)n_times, (double)times[0], (double)times[n_times - 1]));
  cJSON_AddNumberToObject(check->json, "n_times", n_times);
  PetscCall(CheckReportGroups(check));
  CheckReportLoads(check);
  PetscCall(DriverPrint("%d point%s of the ranges assembled%s%s\n", (int)in->n_points, in->n_points > 1 ? "s" : "",
                        !in->corners ? ": the centre and the ends of each parameter"
                        : n_par      ? ": the centre and the corners"
                                     : "",
                        n_times ? ", each at the first and the last time" : ""));
  if (in->bodies[0]) PetscCall(DriverPrint("%s\n", in->bodies));
  if (in->bodies[0]) cJSON_AddStringToObject(check->json, "bodies_by_parameter", in->bodies);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declared by the same call in DeclareCheck() and read in CommandCheck(). */
static PetscErrorCode ReadSolve(PetscBool *solve)
{
  PetscFunctionBegin;
  *solve = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-check_solve", "solve at the centre of the ranges, so that seconds are measured", solve));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The functions that read the options declare them: called without a scene, they only note names and texts. */
PetscErrorCode DeclareCheck(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool solve;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, NULL, NULL, path, NULL));
  PetscCall(DriverGetSamples(NULL, PETSC_FALSE, NULL, NULL));
  PetscCall(ReadSolve(&solve));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the warnings and writes the report. All ranks have created `json`; ReportWrite() is collective and writes
   on rank 0. */
static PetscErrorCode CheckCommandFinish(Check *check)
{
  const int n = cJSON_GetArraySize(check->warnings);

  PetscFunctionBegin;
  /* Last, all together: warnings between the results would be overlooked. */
  for (int k = 0; k < n; k++)
    PetscCall(DriverPrint("warning: %s\n", cJSON_GetStringValue(cJSON_GetArrayItem(check->warnings, k))));
  PetscCall(DriverPrint("%d warning%s, no error\n", n, n == 1 ? "" : "s"));
  /* The report takes over the array, and frees it. */
  cJSON_AddItemToObject(check->json, "warnings", check->warnings);
  cJSON_AddNumberToObject(check->json, "n_warnings", n);
  PetscCall(ReportWrite(&check->json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options are checked before the inspection, which takes as long as assembling all points. */
PetscErrorCode CommandCheck(void)
{
  HycoSamples samples = NULL;
  HycoFOM fom;
  Check check = {0};
  PetscBool given, solve;
  char path[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, NULL, NULL, report, NULL));
  PetscCall(DriverRequire("scene", path));
  PetscCall(ReadSolve(&solve));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &check.scene));
  PetscCall(DriverCheckMesh(check.scene));
  PetscCall(DriverGetSamples(check.scene, PETSC_FALSE, &samples, &given));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, check.scene, &fom));
  /* After HycoFOMCreate(), which reads the options of full order. */
  PetscCall(DriverCheckLeftEarly());
  PetscCall(ReportCreate("check", check.scene, NULL, &check.json));
  check.warnings = cJSON_CreateArray();
  HycoStaged(HYCO_STAGE_FULL_ORDER, HycoInspect(fom, &check.in));
  HycoOnRoot(PETSC_COMM_WORLD, CheckCommandDescribe(&check));
  if (solve) HycoStaged(HYCO_STAGE_FULL_ORDER, CheckReportSolve(&check, fom));
  PetscCall(CheckReportCost(&check, given ? samples : NULL, solve));
  PetscCall(CheckCommandFinish(&check));
  PetscCall(HycoInspectionDestroy(&check.in));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&check.scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
