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
  cJSON_AddStringToObject(json, "model_type", t->type);
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
  if (t->stiffness) cJSON_AddNumberToObject(json, "condition", t->condition);
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  ReportScan(json, &t->scan, n_par);
  cJSON_AddNumberToObject(json, "training_error_u", t->error_u);
  cJSON_AddNumberToObject(json, "training_error_lambda_rid", t->error_lambda);
  cJSON_AddNumberToObject(json, "held_out_predictions", t->n_held);
  for (PetscInt k = 0; k < t->n_facts; k++) {
    if (t->fact[k].n > 1)
      ReportVector(json, t->fact[k].name, t->fact[k].n, t->fact[k].value);
    else
      cJSON_AddNumberToObject(json, t->fact[k].name, t->fact[k].value[0]);
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

/* Targets choose a recipe for a given set of points; -greedy has a target of its own for choosing these. */
static PetscErrorCode CheckKind(PetscBool greedy, const Search *search)
{
  PetscFunctionBegin;
  HycoCheck(!greedy || !search->on,
            "-target_u and the like choose a model for a given set of points; train -greedy stops by -target");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses an option of the command line that this training does not read. */
static PetscErrorCode CheckRead(HycoScene scene, PetscBool given, PetscBool greedy)
{
  static const struct {
    const char *name, *types;                        /* NULL: for -greedy */
  } meant[] = {{"-hyco_condensed_tol", "condensed"}, /* the first two choose points */
               {"-hyco_condensed_max_values", "condensed"},
               {"-hyco_condensed_pod_tol", "condensed"},
               {"-hyco_nnmf_vectors", "projection"},
               {"-hyco_nnmf_max_its", "projection"},
               {"-hyco_rid_modes", "hybrid or condensed"},
               {"-hyco_rid_dual_tol", "hybrid or condensed"},
               {"-hyco_rid_stress_tol", "hybrid or condensed"},
               {"-hyco_rid_force_tol", "hybrid or condensed"},
               {"-hyco_rid_layers", "hybrid or condensed"},
               {"-hyco_rid_contact_extension", "hybrid or condensed"},
               {"-hyco_rid_groups", "hybrid or condensed"},
               {"-hyco_rid_region", "hybrid or condensed"},
               {"-hyco_rid_whole", "hybrid or condensed"},
               {"-hyco_deim_type", "hybrid or condensed"},
               {"-hyco_hybrid", "hybrid"},
               {"-hyco_hybrid_trials", "hybrid"},
               {"-hyco_hybrid_ridge", "hybrid"},
               {"-hyco_scan", "hybrid or projection"},
               {"-hyco_keep_singular", "hybrid or projection"},
               {"-hyco_greedy_indicator", NULL},
               {"-hyco_greedy_keep", NULL}};
  char type[64] = HYCO_ROM_HYBRID;
  PetscOptions options;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetOptions(scene, &options));
  PetscCall(PetscOptionsGetString(options, NULL, "-hyco_model_type", type, sizeof(type), NULL));
  for (size_t k = 0; k < sizeof(meant) / sizeof(meant[0]); k++) {
    PetscBool set;

    PetscCall(PetscOptionsHasName(NULL, NULL, meant[k].name, &set));
    if (!set) continue;
    HycoCheck(meant[k].types || greedy, "nothing reads %s here: it is for train -greedy", meant[k].name);
    if (!meant[k].types) continue;
    HycoCheck(strstr(meant[k].types, type), "nothing reads %s here: it is for -hyco_model_type %s, and the model is %s",
              meant[k].name, meant[k].types, type);
    HycoCheck(!given || k >= 2, "nothing reads %s here: it chooses points where none are given", meant[k].name);
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

PetscErrorCode CommandTrain(void)
{
  HycoScene scene;
  HycoSamples samples, training = NULL, validation;
  HycoReducer reducer;
  HycoTraining t;
  GreedyLog log = {0};
  Search search = {0};
  PetscBool given, chooses, greedy = PETSC_FALSE;
  PetscInt n;
  char path[PETSC_MAX_PATH_LEN], model[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN], word[] = "snapshots:";

  PetscFunctionBegin;
  PetscCall(DriverGet("scene", PETSC_TRUE, path));
  PetscCall(DriverGet("model", PETSC_TRUE, model));
  PetscCall(DriverGet("report", PETSC_FALSE, report));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  PetscCall(DriverGetSamples(scene, &samples, &given));
  PetscCall(HycoOptionsBool(NULL, "greedy", &greedy));
  PetscCall(DriverReadTargets(&search));
  PetscCall(DriverGetValidation(scene, &validation));
  PetscCall(CheckKind(greedy, &search));
  if (!greedy) PetscCall(DriverGet("table", PETSC_FALSE, search.table));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(TakeOnce(samples, "training"));
  PetscCall(TakeOnce(validation, "validation"));
  PetscCall(CheckRead(scene, given, greedy));
  PetscCall(HycoReducerChooses(reducer, &chooses));
  HycoCheck(given || greedy || chooses,
            "give the training points: -grid N,N,..., or -values_NAME V,V,... for each parameter, or -points FILE.csv");
  PetscCall(HycoReducerSetProgress(reducer, DriverProgress, word));
  PetscCall(HycoReducerSetValidation(reducer, validation));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  PetscCall(DriverSetSearch(&search, scene, reducer, n));
  if (greedy) PetscCall(DriverReadGreedy(scene, reducer, &training, &log));
  PetscCall(DriverCheckLeftEarly(scene));
  if (greedy)
    PetscCall(HycoReducerRunGreedy(reducer, given ? samples : NULL, training, model, &t));
  else
    PetscCall(HycoReducerRun(reducer, given ? samples : NULL, model, &t));
  PetscCall(Say("%s", t.summary));
  if (t.missed[0]) PetscCall(DriverMissed("%s", t.missed));
  PetscCall(Say("mean training errors: u %.2e, %sforces %.2e", (double)t.error_u, t.chosen.recipe.rid ? "RID " : "",
                (double)t.error_lambda));
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
