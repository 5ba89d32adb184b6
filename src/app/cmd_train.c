/* hyco train: snapshots, reduction, model. */
#include "driver.h"
#include <string.h>

/* "scan": how near the reduced stiffness comes to being singular inside the parameters' ranges; null: not scanned. */
static void ReportScan(cJSON *json, const HycoScan *s, PetscInt n_par)
{
  cJSON *object;

  if (!s->n) {
    cJSON_AddNullToObject(json, "scan");
    return;
  }
  object = cJSON_AddObjectToObject(json, "scan");
  cJSON_AddNumberToObject(object, "points", s->n);
  cJSON_AddNumberToObject(object, "points_of_other_sign", s->n_singular);
  cJSON_AddNumberToObject(object, "smallest_singular_value", s->smallest);
  ReportVector(object, "at", n_par, s->at);
}

static PetscErrorCode Report(HycoScene scene, const HycoTraining *t, const GreedyLog *log, const Search *search)
{
  PetscInt n_par;
  cJSON *json, *seconds;

  PetscFunctionBegin;
  PetscCall(ReportCreate("train", scene, NULL, &json));
  cJSON_AddStringToObject(json, "model_type", HycoROMTypes[t->type]);
  cJSON_AddNumberToObject(json, "n_samples", t->n_samples);
  cJSON_AddNumberToObject(json, "n_modes", t->n_modes);
  cJSON_AddNumberToObject(json, "n_dual_modes", t->n_dual_modes);
  cJSON_AddNumberToObject(json, "n_stress_modes", t->n_stress_modes);
  cJSON_AddNumberToObject(json, "n_force_modes", t->n_force_modes);
  cJSON_AddNumberToObject(json, "n_fe_dofs", t->n_fe_dofs);
  cJSON_AddNumberToObject(json, "rid_nodes", t->rid_nodes);
  cJSON_AddNumberToObject(json, "rid_a_nodes", t->rid_a_nodes);
  cJSON_AddNumberToObject(json, "rid_elements", t->rid_elements);
  cJSON_AddNumberToObject(json, "rid_contacts", t->rid_contacts);
  cJSON_AddNumberToObject(json, "rid_fraction", t->rid_fraction);
  if (t->type != HYCO_ROM_CONDENSED) cJSON_AddNumberToObject(json, "condition", t->condition);
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  ReportScan(json, &t->scan, n_par);
  cJSON_AddNumberToObject(json, "training_error_u", t->error_u);
  cJSON_AddNumberToObject(json, "training_error_lambda_rid", t->error_lambda);
  cJSON_AddNumberToObject(json, "held_out_predictions", t->n_held);
  if (t->type == HYCO_ROM_PROJECTION) {
    cJSON_AddNumberToObject(json, "n_supremizers", t->n_supremizers);
    cJSON_AddNumberToObject(json, "dual_misfit", t->dual_misfit);
  }
  if (t->type == HYCO_ROM_CONDENSED) {
    cJSON_AddNumberToObject(json, "n_flexibilities", t->n_flexibilities);
    ReportVector(json, "left_out_flexibility_gap_forces", 3, t->left_out);
  }
  if (log->scene) DriverReportGreedy(json, log);
  DriverReportModel(json, search, t);
  seconds = cJSON_AddObjectToObject(json, "seconds");
  cJSON_AddNumberToObject(seconds, "snapshots", t->seconds_snapshots); /* of the model that is written */
  cJSON_AddNumberToObject(seconds, "reduction", t->seconds_reduction);
  cJSON_AddNumberToObject(seconds, "total", t->seconds_snapshots + t->seconds_reduction);
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SayBases(const HycoTraining *t)
{
  PetscFunctionBegin;
  if (t->type == HYCO_ROM_PROJECTION) {
    PetscCall(
        Say("projection-based: %d snapshots; %d displacement modes, %d of them supremizers; %d force vectors, which "
            "leave out %.2e of the dual snapshots' energy\n",
            (int)t->n_samples, (int)t->n_modes, (int)t->n_supremizers, (int)t->n_dual_modes, (double)t->dual_misfit));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (t->type == HYCO_ROM_CONDENSED) {
    PetscCall(Say("condensed: %d snapshots, flexibility at %d points; one training value left out, relative: "
                  "flexibility %.1e, gap %.1e, forces %.1e; %d displacement modes\n",
                  (int)t->n_samples, (int)t->n_flexibilities, (double)t->left_out[0], (double)t->left_out[1],
                  (double)t->left_out[2], (int)t->n_modes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Say("%d snapshots; modes: %d displacement, %d stress, %d force, %d dual\n", (int)t->n_samples,
                (int)t->n_modes, (int)t->n_stress_modes, (int)t->n_force_modes, (int)t->n_dual_modes));
  PetscCall(Say("RID: %d elements (%.1f %%), %d nodes, %d in A, %d contacts; %d full-order displacements\n",
                (int)t->rid_elements, 100 * (double)t->rid_fraction, (int)t->rid_nodes, (int)t->rid_a_nodes,
                (int)t->rid_contacts, (int)t->n_fe_dofs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Targets choose a recipe for a given set of points; -greedy has a target of its own for choosing these. */
static PetscErrorCode CheckKind(PetscBool greedy, const Search *search)
{
  PetscFunctionBegin;
  HycoCheck(!greedy || !search->on,
            "-target_u and the like choose a model for a given set of points; train -greedy stops by -target");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses an option of the command line that this training does not read, by what the reducer declares of it. */
static PetscErrorCode CheckRead(HycoReducer reducer, PetscBool given, PetscBool greedy)
{
  const HycoOption *table;
  PetscInt n;
  HycoROMType type;

  PetscFunctionBegin;
  PetscCall(HycoReducerGetType(reducer, &type));
  PetscCall(HycoGetOptionTable(&n, &table));
  for (PetscInt k = 0; k < n; k++) {
    const char *only = table[k].only, *where = strstr(only, " where");
    char dashed[DRIVER_LINE];
    PetscBool set;

    if (!only[0] || strcmp(table[k].owner, "HycoReducer")) continue;
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", table[k].name));
    PetscCall(PetscOptionsHasName(NULL, NULL, dashed, &set));
    if (!set) continue;
    if (strcmp(only, "greedy") == 0) {
      HycoCheck(greedy, "nothing reads %s here: it is for train -greedy", dashed);
      continue;
    }
    HycoCheck(strstr(only, HycoROMTypes[type]),
              "nothing reads %s here: it is for -hyco_model_type %.*s, and the model is %s", dashed,
              where ? (int)(where - only) : (int)strlen(only), only, HycoROMTypes[type]);
    HycoCheck(!given || !where, "nothing reads %s here: it chooses points where none are given", dashed);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point given twice would be learned twice. */
static PetscErrorCode TakeOnce(HycoSamples samples, const char what[])
{
  PetscInt n = 0, dropped;

  PetscFunctionBegin;
  if (!samples) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesDropTwins(samples, &dropped));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  if (dropped)
    PetscCall(Say("%d of the %d %s points repeat others; each of the %d is used once\n", (int)dropped,
                  (int)(n + dropped), what, (int)n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A condensed model's own points that miss -hyco_condensed_tol. */
static PetscErrorCode JudgePoints(HycoScene scene, const HycoTraining *t)
{
  const char *const *names, *name;

  PetscFunctionBegin;
  if (t->target_met) PetscFunctionReturn(PETSC_SUCCESS);
  if (t->hopeless < 0) {
    PetscCall(DriverMissed("-hyco_condensed_tol was not reached: the forces' error, one value left out, is %.1e, and "
                           "%.1e was asked; raise -hyco_condensed_max_values, which is %d, or -hyco_condensed_tol",
                           (double)t->left_out[2], (double)t->target, (int)t->most_values));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoSceneGetParameters(scene, NULL, &names, NULL, NULL));
  name = names[t->hopeless];
  PetscCall(DriverMissed("-hyco_condensed_tol was not reached: with %d values of %s the forces' error, one of them "
                         "left out, is %.1e, and hardly falls as values are added, where %.1e was asked: the stiffness "
                         "or the contacts do not depend smoothly on %s (a kink, as of abs or max, a jump); train a "
                         "hybrid model, or raise -hyco_condensed_tol",
                         (int)t->hopeless_values, name, (double)t->hopeless_error, (double)t->target, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadGreedy(PetscBool *greedy)
{
  PetscFunctionBegin;
  *greedy = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag(
      "-greedy", "add solutions where an error indicator is worst, from the corners of the ranges or -grid ...",
      greedy));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  PetscCall(DriverGetSamples(NULL, NULL, NULL));
  PetscCall(ReadGreedy(&greedy));
  PetscCall(DriverReadGreedy(NULL, NULL, &none, &log));
  PetscCall(DriverReadTargets(&search));
  PetscCall(DriverReadBudget(&search.budget));
  PetscCall(DriverGetValidation(NULL, &none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CommandTrain(void)
{
  HycoScene scene;
  HycoSamples samples, training = NULL, validation;
  HycoReducer reducer;
  HycoTraining t;
  GreedyLog log = {0};
  Search search = {0};
  PetscBool given, chooses, greedy;
  PetscInt n;
  char path[PETSC_MAX_PATH_LEN], model[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN], word[] = "snapshots:";

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, model, NULL, report, NULL));
  PetscCall(DriverRequire("scene", path));
  PetscCall(DriverRequire("model", model));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  PetscCall(DriverGetSamples(scene, &samples, &given));
  PetscCall(ReadGreedy(&greedy));
  PetscCall(DriverReadTargets(&search));
  PetscCall(DriverGetValidation(scene, &validation));
  PetscCall(CheckKind(greedy, &search));
  if (!greedy) PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, search.table));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(TakeOnce(samples, "training"));
  PetscCall(TakeOnce(validation, "validation"));
  PetscCall(CheckRead(reducer, given, greedy));
  PetscCall(HycoReducerChooses(reducer, &chooses));
  HycoCheck(given || greedy || chooses,
            "give the training points: -grid N,N,..., or -values_NAME V,V,... for each parameter, or -points FILE.csv");
  PetscCall(HycoReducerSetProgress(reducer, DriverProgress, word));
  PetscCall(HycoReducerSetValidation(reducer, validation));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  PetscCall(DriverSetSearch(&search, scene, reducer, n));
  if (greedy) PetscCall(DriverReadGreedy(scene, reducer, &training, &log));
  PetscCall(DriverCheckLeftEarly());
  if (greedy)
    PetscCall(HycoReducerRunGreedy(reducer, given ? samples : NULL, training, model, &t));
  else
    PetscCall(HycoReducerRun(reducer, given ? samples : NULL, model, &t));
  PetscCall(SayBases(&t));
  if (!given && t.type == HYCO_ROM_CONDENSED) PetscCall(JudgePoints(scene, &t));
  PetscCall(Say("mean training errors: u %.2e, %sforces %.2e", (double)t.error_u,
                t.type == HYCO_ROM_HYBRID ? "RID " : "", (double)t.error_lambda));
  if (t.condition > 0) PetscCall(Say("; condition of the reduced stiffness %.1e", (double)t.condition));
  PetscCall(Say("\n"));
  if (t.scan.n)
    PetscCall(Say("scan of the ranges: %d points, smallest singular value %.1e of the largest%s\n", (int)t.scan.n,
                  (double)t.scan.smallest, t.scan.n_singular ? "; SINGULAR inside, kept as asked" : ""));
  PetscCall(DriverJudgeModel(&search, &t));
  PetscCall(Say("seconds: %.2f snapshots, %.2f reduction; model in %s\n", (double)t.seconds_snapshots,
                (double)t.seconds_reduction, model));
  if (greedy) PetscCall(DriverJudgeGreedy(&log));
  PetscCall(Report(scene, &t, &log, &search));
  PetscCall(PetscFree(search.text));
  PetscCall(PetscFree(log.text));
  PetscCall(HycoSamplesDestroy(&training));
  PetscCall(HycoSamplesDestroy(&validation));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
