/* hyco train: snapshots, reduction, model. */
#include "driver.h"
#include <string.h>

/* "scan": how close the reduced stiffness comes to being singular within the parameters' ranges; null: not scanned. */
static void ReportScan(cJSON *json, const HycoScan *s, PetscInt n_par)
{
  cJSON *object;

  /* The key is there in any case, so that a script can tell a scan of no points from an older report. */
  if (!s->n) {
    cJSON_AddNullToObject(json, "scan");
    return;
  }
  object = cJSON_AddObjectToObject(json, "scan");
  ReportNumbers(object, {"points", s->n}, {"points_of_other_sign", s->n_singular},
                {"smallest_singular_value", s->smallest});
  ReportVector(object, "at", n_par, s->at);
}

/* "solved_by_group": the points that each group of ranks solved full order; "unsolved_when_idle": how many were not
   solved yet when the first group found none to begin; "written_mb_by_rank": megabytes of their solutions. */
static PetscErrorCode ReportGroups(cJSON *json, HycoReducer reducer)
{
  cJSON *array = cJSON_AddArrayToObject(json, "solved_by_group");
  PetscInt n, unsolved;
  const PetscInt *solved;
  const PetscReal *written;

  PetscFunctionBegin;
  PetscCall(HycoReducerGetSolved(reducer, &n, &solved));
  PetscCall(HycoReducerGetBalance(reducer, &unsolved, &written));
  for (PetscInt k = 0; k < n; k++) cJSON_AddItemToArray(array, cJSON_CreateNumber(solved[k]));
  cJSON_AddNumberToObject(json, "unsolved_when_idle", unsolved);
  array = cJSON_AddArrayToObject(json, "written_mb_by_rank");
  for (PetscMPIInt r = 0; r < HycoSize(PETSC_COMM_WORLD); r++)
    cJSON_AddItemToArray(array, cJSON_CreateNumber(1e-6 * written[r]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TIMED 25 /* predictions for their time */
/* Seconds after which the time of a prediction is known from fewer: a training's report may take no longer. */
#define LONGEST_TIMING 1.

/* The mean processor time of predictions by the written model, with outputs and estimates, as a set makes them. Rank
   0. */
static PetscErrorCode TimeModel(HycoScene scene, const char path[], PetscReal *each)
{
  HycoSamples points;
  HycoROM m;
  PetscInt n, n_par, k = 0;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &points));
  PetscCall(HycoSamplesAddScattered(points, TIMED));
  PetscCall(HycoSamplesGet(points, &n, &n_par, &mu));
  PetscCall(HycoROMLoad(path, &m));
  for (*each = 0; k < n && *each < LONGEST_TIMING; k++) {
    HycoPrediction p;

    PetscCall(HycoROMPredict(m, n_par, mu + k * n_par));
    PetscCall(HycoROMGetPrediction(m, &p));
    *each += p.seconds.cpu;
  }
  *each /= (PetscReal)PetscMax(k, 1);
  PetscCall(HycoROMDestroy(&m));
  PetscCall(HycoSamplesDestroy(&points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If this run has solved any point at full order. Collective. */
static PetscErrorCode ReportGain(cJSON *json, HycoScene scene, const char path[], const HycoTraining *t)
{
  PetscReal one = 0;
  PetscInt n_times;

  PetscFunctionBegin;
  if (!(t->cpu_solution > 0) || !t->held_out.n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  HycoOnRoot(PETSC_COMM_WORLD, TimeModel(scene, path, &one));
  PetscCall(DriverReportGain(json, n_times ? "path" : "point", t->cpu_solution, one, t->cpu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The keys are those of docs/output.md, which is made from outputs_list.c. */
static PetscErrorCode TrainCommandReport(HycoScene scene, HycoReducer reducer, const char path[], const HycoTraining *t,
                                         const GreedyLog *log, const Search *search)
{
  PetscInt n_par;
  cJSON *json, *seconds;

  PetscFunctionBegin;
  PetscCall(ReportCreate("train", scene, NULL, &json));
  cJSON_AddStringToObject(json, "model_type", t->type);
  cJSON_AddNumberToObject(json, "n_samples", t->n_samples);
  cJSON_AddNumberToObject(json, "n_left_out", t->n_lost);
  if (t->n_lost) cJSON_AddStringToObject(json, "no_equilibrium", t->first_lost);
  PetscCall(ReportGroups(json, reducer));
  ReportNumbers(json, {"n_modes", t->n_modes}, {"n_dual_modes", t->n_dual_modes}, {"n_stress_modes", t->n_stress_modes},
                {"n_force_modes", t->n_force_modes}, {"n_fe_dofs", t->n_fe_dofs}, {"rid_nodes", t->rid_nodes},
                {"rid_a_nodes", t->rid_a_nodes}, {"rid_elements", t->rid_elements}, {"rid_contacts", t->rid_contacts},
                {"rid_fraction", t->rid_fraction});
  /* Known only if the reduced stiffness was formed. */
  if (t->stiffness) cJSON_AddNumberToObject(json, "condition", t->condition);
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  ReportScan(json, &t->scan, n_par);
  /* Negative: not computed. */
  if (t->error_u >= 0)
    ReportNumbers(json, {"training_error_u", t->error_u}, {"training_error_lambda_rid", t->error_lambda});
  ReportNumbers(json, {"held_out_predictions", t->n_held});
  for (PetscInt k = 0; k < t->n_facts; k++) {
    if (t->fact[k].n > 1)
      ReportVector(json, t->fact[k].name, t->fact[k].n, t->fact[k].value);
    else
      cJSON_AddNumberToObject(json, t->fact[k].name, t->fact[k].value[0]);
  }
  if (log->scene) DriverReportGreedy(json, log);
  DriverReportModel(json, search, t);
  seconds = cJSON_AddObjectToObject(json, "seconds"); /* of the final model */
  ReportNumbers(seconds, {"snapshots", t->seconds_snapshots}, {"reduction", t->seconds_reduction},
                {"total", t->seconds_snapshots + t->seconds_reduction});
  PetscCall(ReportGain(json, scene, path, t));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses an option of the command line that this training does not read, according to the reducer's declarations.
   By the reducer's own declarations (HycoOption.only): an option of a type that is not tried would silently do
   nothing. */
static PetscErrorCode CheckRead(HycoReducer reducer, PetscBool greedy)
{
  const HycoOption *table;
  PetscInt n;
  HycoROMType type;

  PetscFunctionBegin;
  PetscCall(HycoReducerGetType(reducer, &type));
  PetscCall(HycoGetOptionTable(&n, &table));
  for (PetscInt k = 0; k < n; k++) {
    const char *only = table[k].only;
    char dashed[DRIVER_LINE];
    PetscBool set, read;

    /* Options without `only` are read by every training. */
    if (!only[0] || strcmp(table[k].owner, "HycoReducer")) continue;
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", table[k].name));
    PetscCall(PetscOptionsHasName(NULL, NULL, dashed, &set));
    if (!set) continue;
    if (strcmp(only, "greedy") == 0) {
      HycoCheck(greedy, "%s has no effect without -greedy; remove it", dashed);
      continue;
    }
    PetscCall(HycoReducerTries(reducer, only, &read));
    HycoCheck(read, "%s has no effect here: it is for -hyco_model_type %s, and the model is %s", dashed, only, type);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A repeated point would have twice the weight. */
static PetscErrorCode TakeOnce(HycoSamples samples, const char what[])
{
  PetscInt n = 0, dropped;

  PetscFunctionBegin;
  if (!samples) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesDropTwins(samples, &dropped));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  /* Said, since the number of points that is reported differs from what was given. */
  if (dropped)
    PetscCall(DriverPrint("%d of the %d %s points are duplicates; each of the %d different points is used once\n",
                          (int)dropped, (int)(n + dropped), what, (int)n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its own function, so that the help lists it from the same call. */
static PetscErrorCode ReadGreedy(PetscBool *greedy)
{
  PetscFunctionBegin;
  *greedy = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag(
      "-greedy",
      "add solutions where an error indicator is largest, starting from the corners of the ranges or from -grid ...",
      greedy));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same calls as in the run, with NULL in place of scene and objects: they declare and return. Options of the
   classes are declared by HycoDeclareClasses(). */
PetscErrorCode DeclareTrain(PetscOptions options)
{
  GreedyLog log = {0};
  Search search = {0};
  HycoSamples none;
  PetscBool greedy;
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, path, path));
  PetscCall(DriverGetSamples(NULL, PETSC_TRUE, NULL, NULL));
  PetscCall(ReadGreedy(&greedy));
  PetscCall(DriverReadGreedy(NULL, NULL, &none, &log));
  PetscCall(DriverReadTargets(&search));
  PetscCall(DriverReadBudget(&search.budget));
  PetscCall(DriverGetValidation(NULL, &none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoProgress with the reducer, which knows what it solves. */
static PetscErrorCode ShowSolutions(PetscInt done, PetscInt n, void *ctx)
{
  const char *what;
  char word[64];

  PetscFunctionBegin;
  PetscCall(HycoReducerGetSolving((HycoReducer)ctx, &what));
  snprintf(word, sizeof(word), "%s:", what);
  PetscCall(DriverProgress(done, n, word));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything that can be wrong in options and files is checked before the first solution, which may be hours
   before the last. */
PetscErrorCode CommandTrain(void)
{
  HycoScene scene;
  HycoSamples samples, training = NULL, validation;
  HycoReducer reducer;
  HycoTraining t;
  GreedyLog log = {0};
  Search search = {0};
  PetscBool given, greedy;
  PetscInt n;
  char path[PETSC_MAX_PATH_LEN], model[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];
  char folder[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, model, NULL, report, NULL));
  PetscCall(DriverRequire("scene", path));
  PetscCall(DriverRequire("model", model));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  PetscCall(DriverGetSamples(scene, PETSC_TRUE, &samples, &given));
  PetscCall(ReadGreedy(&greedy));
  PetscCall(DriverReadTargets(&search));
  PetscCall(DriverGetValidation(scene, &validation));
  /* Targets choose settings for a given set of points; -greedy has its own target for choosing points. */
  HycoCheck(
      !greedy || !search.on,
      "-target_u and similar options choose the settings for a given set of points; for train -greedy use -target");
  if (!greedy) PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, search.table));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(TakeOnce(samples, "training"));
  PetscCall(TakeOnce(validation, "validation"));
  PetscCall(CheckRead(reducer, greedy));
  HycoCheck(given || greedy,
            "give the training points: -grid N,N,..., or -values_NAME V,V,... for each parameter, or -points FILE.csv");
  PetscCall(HycoReducerSetProgress(reducer, ShowSolutions, reducer));
  PetscCall(HycoReducerSetPhaseMonitor(reducer, DriverPhase, NULL));
  PetscCall(DriverSnapshotFolder(model, folder));
  /* From here on an interrupt says where the solutions are kept. */
  PetscCall(DriverCatchInterrupt(folder));
  PetscCall(HycoReducerSetValidation(reducer, validation));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  PetscCall(DriverSetSearch(&search, scene, reducer, n));
  if (greedy) PetscCall(DriverReadGreedy(scene, reducer, &training, &log));
  PetscCall(DriverCheckLeftEarly());
  if (greedy)
    PetscCall(HycoReducerRunGreedy(reducer, given ? samples : NULL, training, model, &t));
  else
    PetscCall(HycoReducerRun(reducer, samples, model, &t));
  PetscCall(DriverPrint("%s", t.summary));
  if (t.error_u >= 0) {
    PetscCall(DriverPrint("mean training errors: u %.2e, %sforces %.2e", (double)t.error_u,
                          t.chosen.settings.rid ? "RID " : "", (double)t.error_lambda));
    if (t.condition > 0) PetscCall(DriverPrint("; condition of the reduced stiffness %.1e", (double)t.condition));
    PetscCall(DriverPrint("\n"));
  }
  if (t.scan.n)
    PetscCall(DriverPrint("scan of the ranges: %d points, smallest singular value %.1e of the largest%s\n",
                          (int)t.scan.n, (double)t.scan.smallest,
                          t.scan.n_singular ? "; SINGULAR inside, kept by -hyco_keep_singular" : ""));
  if (t.n_lost)
    PetscCall(DriverPrint("warning: %d point%s left out; there is no equilibrium: %s\n", (int)t.n_lost,
                          t.n_lost > 1 ? "s are" : " is", t.first_lost));
  PetscCall(DriverWarnSliding(t.sliding));
  PetscCall(DriverWarnSteps(t.time_error));
  PetscCall(DriverJudgeModel(&search, &t));
  PetscCall(DriverPrint("seconds: %.2f snapshots, %.2f reduction; model in %s\n", (double)t.seconds_snapshots,
                        (double)t.seconds_reduction, model));
  if (greedy) PetscCall(DriverJudgeGreedy(&log));
  PetscCall(TrainCommandReport(scene, reducer, model, &t, &log, &search));
  PetscCall(PetscFree(search.text));
  PetscCall(PetscFree(log.text));
  PetscCall(HycoSamplesDestroy(&training));
  PetscCall(HycoSamplesDestroy(&validation));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
