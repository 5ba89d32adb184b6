/* HycoReducer: made, configured, destroyed. */
#include <hycoreducerimpl.h>
#include <string.h>

const char *const HycoHybrids[] = {"auto", "rank", "contact", "all", NULL};

PetscErrorCode HycoReducerCreate(MPI_Comm comm, HycoScene scene, HycoReducer *reducer)
{
  HycoReducer t;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCall(PetscHeaderCreate(t, HYCO_REDUCER_CLASSID, "HycoReducer", "Training of reduced models", "Hyco", comm,
                              HycoReducerDestroy, HycoReducerView));
  PetscCallMPI(MPI_Comm_rank(HycoComm(t), &t->rank));
  PetscCall(PetscObjectReference((PetscObject)scene));
  t->scene = scene;
  t->noise = 1e-11;
  t->greedy.target = 1e-3;
  t->n_validation = -1;
  t->search = PETSC_TRUE;
  t->budget = -1;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->tol[k] = k == HYCO_SEED_DUAL ? 1e-1 : 1e-7;
  t->seed[HYCO_SEED_DISPLACEMENT] = t->seed[HYCO_SEED_STRESS] = t->seed[HYCO_SEED_FORCE] = PETSC_TRUE;
  PetscCall(HycoReducerSetType(t, HYCO_ROM_HYBRID));
  *reducer = t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its options and all that it has made. */
static PetscErrorCode EndTraining(HycoReducer t)
{
  PetscFunctionBegin;
  if (t->training && t->prototype->ops->resettraining) PetscCall((*t->prototype->ops->resettraining)(t));
  PetscCall(PetscFree(t->training));
  PetscCall(HycoROMDestroy(&t->prototype));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetType(HycoReducer t, HycoROMType name)
{
  PetscBool same = PETSC_FALSE;
  HycoROM type;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (t->prototype) PetscCall(PetscObjectTypeCompare((PetscObject)t->prototype, name, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMCreate(&type));
  ierr = HycoROMSetType(type, name);
  if (ierr) (void)!HycoROMDestroy(&type);
  PetscCall(ierr);
  PetscCall(EndTraining(t));
  t->prototype = type;
  if (type->ops->setfromoptions) PetscCall((*type->ops->setfromoptions)(t, t->scene->options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerReset(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerResetBases(t));
  if (t->training && t->prototype->ops->resettraining) PetscCall((*t->prototype->ops->resettraining)(t));
  PetscCall(HycoFEDestroy(&t->fe));
  PetscCall(HycoPairsDestroy(&t->pairs));
  PetscCall(HycoMetDestroy(&t->met));
  PetscCall(HycoMeshDestroy(&t->whole));
  PetscCall(PetscFree(t->grown));
  PetscCall(HycoSamplesDestroy(&t->held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerDropBases(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(t->seeds_node));
  PetscCall(PetscFree(t->seeds_cell));
  PetscCall(PetscFree(t->sigma));
  PetscCall(PetscFree(t->V_whole));
  PetscCall(PetscFree(t->VtU));
  t->n_seeds_node = t->n_seeds_cell = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerResetBases(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerDropBases(t));
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) {
    PetscCall(MatDestroy(&t->basis[k].V));
    PetscCall(PetscFree(t->basis[k].sigma));
    PetscCall(PetscFree(t->basis[k].coefficients));
    t->basis[k].l = t->basis[k].n_sigma = 0;
  }
  PetscCall(PetscFree(t->U));
  PetscCall(PetscFree(t->Lambda));
  PetscCall(PetscFree(t->U_norm));
  PetscCall(PetscFree(t->dual_seeds));
  t->n_dual_seeds = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerDestroy(HycoReducer *reducer)
{
  HycoReducer t;

  PetscFunctionBegin;
  if (!reducer || !*reducer) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*reducer, HYCO_REDUCER_CLASSID);
  HycoDereference(reducer);
  t = *reducer;
  PetscCall(HycoReducerReset(t));
  PetscCall(EndTraining(t));
  for (PetscInt k = 0; k < t->n_groups; k++) PetscCall(PetscFree(t->groups[k]));
  PetscCall(PetscFree(t->region));
  PetscCall(HycoSceneDestroy(&t->scene));
  PetscCall(PetscHeaderDestroy(reducer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetSnapshotFolder(HycoReducer t, const char folder[])
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  PetscCall(PetscStrncpy(t->folder, folder, sizeof(t->folder)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerChooses(HycoReducer t, PetscBool *chooses)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  *chooses = (PetscBool)(t->prototype->ops->choosepoints != NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetProgress(HycoReducer t, HycoProgress progress, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->progress = progress;
  t->progress_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetValidation(HycoReducer t, HycoSamples validation)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->validation = validation;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetValidationCount(HycoReducer t, PetscInt n)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->n_validation = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetSearch(HycoReducer t, PetscBool search)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->search = search;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetAttemptMonitor(HycoReducer t, HycoAttemptMonitor attempt, HycoAddedMonitor added,
                                            void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->attempt = attempt;
  t->added = added;
  t->attempt_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetTargets(HycoReducer t, const PetscReal target[], PetscInt budget)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  for (PetscInt e = 0; e < HYCO_N_ERRORS; e++) {
    HycoCheck(target[e] >= 0, "the target of the error %s is %g; it must be positive (0: none)", HycoErrorKinds[e],
              (double)target[e]);
    t->target[e] = target[e];
  }
  t->budget = budget;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetGreedyMonitor(HycoReducer t, HycoGreedyMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->greedy.monitor = monitor;
  t->greedy.ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetGreedyIndicator(HycoReducer t, HycoIndicatorKind kind)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  t->greedy.indicator = kind;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetGreedyStop(HycoReducer t, PetscReal target, PetscInt max_snapshots, PetscReal max_seconds)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheck(target > 0, "the target of the greedy training is %g; it must be positive, as 1e-3 is", (double)target);
  HycoCheck(max_snapshots >= 0 && max_seconds >= 0,
            "the greedy training may take %d snapshots and %g seconds; neither can be negative (0: no limit)",
            (int)max_snapshots, (double)max_seconds);
  t->greedy.target = target;
  t->greedy.max_snapshots = max_snapshots;
  t->greedy.max_seconds = max_seconds;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadSeedKinds(HycoReducer t)
{
  static const char *const words[HYCO_N_SEEDS] = {"displacement", "stress", "force", "dual"};
  char *list[16];
  PetscInt n = 16;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetStringArray(t->scene->options, NULL, "-hyco_rid_modes", list, &n, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt k = 0;

    while (k < HYCO_N_SEEDS && strcmp(list[i], words[k])) k++;
    if (k == HYCO_N_SEEDS)
      HycoFail("-hyco_rid_modes has \"%s\"; its words are displacement, stress, force and dual", list[i]);
    t->seed[k] = PETSC_TRUE;
    PetscCall(PetscFree(list[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type, with its own options; one whose RID is the whole mesh has nothing that seeds it. */
static PetscErrorCode ReadType(HycoReducer t)
{
  const char **names;
  char text[64] = "fe";
  PetscInt type = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMTypeNames(&names));
  while (names[type] && strcmp(names[type], t->prototype->type)) type++;
  ierr = HycoOptionsWord(t->scene->options, "hyco_model_type", names, &type);
  if (!ierr) ierr = EndTraining(t); /* the options may have changed */
  if (!ierr) ierr = HycoReducerSetType(t, names[type]);
  PetscCall(PetscFree(names));
  PetscCall(ierr);
  PetscCall(PetscOptionsGetString(t->scene->options, NULL, "-hyco_dual", text, sizeof(text), NULL));
  HycoCheckModel(t->prototype->traits.force_basis || strcmp(text, "fe") == 0,
                 "-hyco_dual %s is for -hyco_model_type projection; the other models have the finite-element forces",
                 text);
  if (!t->prototype->traits.whole) PetscFunctionReturn(PETSC_SUCCESS);
  t->whole_rid = PETSC_TRUE;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetFromOptions(HycoReducer t)
{
  static const char *const deims[] = {"deim", "qdeim", NULL};
  static const char *const choices[HYCO_N_CHOICES] = {"-hyco_model_type", "-hyco_pod_tol",
                                                      "-hyco_rid_layers", "-hyco_rid_contact_extension",
                                                      "-hyco_hybrid",     "-hyco_rid_whole"};
  static const char *const indicators[] = {"local", "penetration", NULL};
  PetscOptions o;
  PetscInt hybrid, indicator, n = 64;
  PetscBool set;
  char text[4 * HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  o = t->scene->options;
  hybrid = (PetscInt)t->hybrid;
  PetscCall(PetscOptionsGetString(o, NULL, "-hyco_snapshots", t->folder, sizeof(t->folder), NULL));
  PetscCall(HycoOptionsReal(o, "hyco_pod_tol", 0, 1, &t->tol[HYCO_SEED_DISPLACEMENT]));
  t->tol[HYCO_SEED_STRESS] = t->tol[HYCO_SEED_FORCE] = t->tol[HYCO_SEED_DISPLACEMENT];
  PetscCall(HycoOptionsReal(o, "hyco_rid_stress_tol", 0, 1, &t->tol[HYCO_SEED_STRESS]));
  PetscCall(HycoOptionsReal(o, "hyco_rid_force_tol", 0, 1, &t->tol[HYCO_SEED_FORCE]));
  PetscCall(HycoOptionsReal(o, "hyco_rid_dual_tol", 0, 1, &t->tol[HYCO_SEED_DUAL]));
  PetscCall(HycoOptionsReal(o, "hyco_pod_noise", 0, 1, &t->noise));
  PetscCall(HycoOptionsInt(o, "hyco_pod_max_modes", 0, PETSC_MAX_INT, &t->max_modes));
  PetscCall(HycoOptionsWord(o, "hyco_deim_type", deims, &t->deim));
  PetscCall(HycoOptionsInt(o, "hyco_rid_layers", 0, PETSC_MAX_INT, &t->layers));
  PetscCall(HycoOptionsReal(o, "hyco_rid_contact_extension", 0, PETSC_MAX_REAL, &t->extension));
  PetscCall(HycoOptionsBool(o, "hyco_rid_whole", &t->whole_rid));
  PetscCall(HycoOptionsWord(o, "hyco_hybrid", HycoHybrids, &hybrid));
  t->hybrid = (HycoHybrid)hybrid;
  PetscCall(HycoOptionsInt(o, "hyco_scan", 0, 1000000, &t->scan));
  PetscCall(HycoOptionsBool(o, "hyco_keep_singular", &t->keep_singular));
  PetscCall(HycoOptionsInt(o, "hyco_validation", -1, 100000, &t->n_validation));
  PetscCall(HycoOptionsBool(o, "hyco_search", &t->search));
  for (PetscInt k = 0; k < HYCO_N_CHOICES; k++) PetscCall(PetscOptionsHasName(o, NULL, choices[k], &t->pinned[k]));
  indicator = (PetscInt)t->greedy.indicator;
  PetscCall(HycoOptionsWord(o, "hyco_greedy_indicator", indicators, &indicator));
  t->greedy.indicator = (HycoIndicatorKind)indicator;
  PetscCall(HycoOptionsBool(o, "hyco_greedy_keep", &t->greedy.keep));
  PetscCall(ReadSeedKinds(t));
  PetscCall(ReadType(t));
  for (PetscInt k = 0; k < t->n_groups; k++) PetscCall(PetscFree(t->groups[k]));
  PetscCall(PetscOptionsGetStringArray(o, NULL, "-hyco_rid_groups", t->groups, &n, &set));
  t->n_groups = set ? n : 0;
  if (set && n == 1 && strcmp(t->groups[0], "none") == 0) {
    PetscCall(PetscFree(t->groups[0]));
    t->n_groups = 0;
  }
  PetscCall(PetscOptionsGetString(o, NULL, "-hyco_rid_region", text, sizeof(text), &set));
  PetscCall(PetscFree(t->region));
  if (set && strcmp(text, "none")) {
    HycoExpr region = NULL; /* parsed now, so that a slip does not show after hours */

    PetscCall(HycoExprCreate("hyco_rid_region", text, 0, NULL, &region));
    PetscCall(HycoExprDestroy(&region));
    PetscCall(PetscStrallocpy(text, &t->region));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerView(HycoReducer t, PetscViewer viewer)
{
  PetscBool ascii;

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  PetscCall(HycoViewBegin((PetscObject)t, &viewer, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "model type: %s\n", t->prototype->type));
  PetscCall(PetscViewerASCIIPrintf(viewer, "energy left out of the displacement basis: %g\n",
                                   (double)t->tol[HYCO_SEED_DISPLACEMENT]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "search for settings: %s\n", t->search ? "yes" : "no"));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerViewFromOptions(HycoReducer object, PetscObject owner, const char option[])
{
  PetscFunctionBegin;
  HycoCheckHandle(object, HYCO_REDUCER_CLASSID);
  PetscCall(PetscObjectViewFromOptions((PetscObject)object, owner, option));
  PetscFunctionReturn(PETSC_SUCCESS);
}
