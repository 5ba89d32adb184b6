/* HycoReducer: creation, options, destruction. */
#include <hycoalgorithms.h>
#include <hycoentries.h>
#include <hycomaterialimpl.h>
#include <hycoreducerimpl.h>
#include <string.h>

const char *const HycoHybrids[] = {"auto", "rank", "contact", "all", NULL};

/* Defaults of a program without options; HycoReducerSetFromOptions() changes them. */
static PetscErrorCode ReducerCreate(MPI_Comm comm, HycoReducer *reducer)
{
  HycoReducer t;

  PetscFunctionBegin;
  PetscCall(PetscHeaderCreate(t, HYCO_REDUCER_CLASSID, "HycoReducer", "Training of reduced models", "Hyco", comm,
                              HycoReducerDestroy, HycoReducerView));
  PetscCallMPI(MPI_Comm_rank(HycoComm(t), &t->rank));
  t->noise = 1e-11;
  PetscCall(PetscStrncpy(t->svd_type, HYCO_SVD_TSQR, sizeof(t->svd_type)));
  t->greedy.target = 1e-3;
  /* -1: by the number of training points. */
  t->n_validation = -1;
  t->search = PETSC_TRUE;
  t->search_budget = 1;
  t->budget = -1;
  t->ridge = -1;
  /* The paper's thresholds for the rope (section 6). */
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->tol[k] = k == HYCO_SEED_DUAL ? 1e-1 : 1e-7;
  t->seed[HYCO_SEED_DISPLACEMENT] = t->seed[HYCO_SEED_STRESS] = t->seed[HYCO_SEED_FORCE] = PETSC_TRUE;
  *reducer = t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees the type's options and data. The type's reset frees data that `training` points to, before `training`
   itself. */
static PetscErrorCode EndTraining(HycoReducer t)
{
  PetscFunctionBegin;
  if (t->training && t->trainer.reset) PetscCall((*t->trainer.reset)(t));
  PetscCall(PetscFree(t->training));
  PetscCall(HycoROMDestroy(&t->prototype));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The prototype is an empty model: its traits answer what the type can do. */
PetscErrorCode HycoReducerSetType(HycoReducer t, HycoROMType name)
{
  PetscBool same = PETSC_FALSE;
  HycoTrainerOps trainer;
  HycoROM type;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (t->prototype) PetscCall(PetscObjectTypeCompare((PetscObject)t->prototype, name, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMCreate(&type));
  ierr = HycoROMSetType(type, name);
  if (!ierr) ierr = HycoTrainerFind(name, &trainer);
  /* The present type stays if the new one is unknown. */
  if (ierr) (void)!HycoROMDestroy(&type);
  PetscCall(ierr);
  PetscCall(EndTraining(t));
  t->prototype = type;
  t->trainer = trainer;
  if (trainer.setfromoptions) PetscCall((*trainer.setfromoptions)(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Defaults that depend on the scene: the options override them in HycoReducerSetFromOptions(). */
PetscErrorCode HycoReducerCreate(MPI_Comm comm, HycoScene scene, HycoReducer *reducer)
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(reducer);
  PetscCall(ReducerCreate(comm, reducer));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*reducer)->scene = scene;
  /* The local problem of (43) would be a path of its own. */
  if (scene->n_times) (*reducer)->greedy.indicator = HYCO_INDICATOR_RESIDUAL;
  /* Springs act on surfaces whose cells would otherwise be missing from the RID. */
  (*reducer)->seed[HYCO_SEED_SPRING] = (PetscBool)(scene->n_springs > 0);
  for (PetscInt b = 0; b < scene->n_bodies && scene->n_times; b++) {
    if (!scene->body[b].law->linear) (*reducer)->seed[HYCO_SEED_INELASTIC] = PETSC_TRUE;
  }
  PetscCall(HycoSceneGiveOptions(scene, (PetscObject)*reducer));
  PetscCall(HycoReducerSetType(*reducer, HycoSceneHasFriction(scene) ? HYCO_ROM_BODIES : HYCO_ROM_HYBRID));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The store is not the reducer's. The type's options survive: HycoReducerSetType() alone ends them. */
PetscErrorCode HycoReducerReset(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerResetBases(t));
  if (t->training && t->trainer.reset) PetscCall((*t->trainer.reset)(t));
  PetscCall(HycoFOMDestroy(&t->fom));
  PetscCall(HycoMetDestroy(&t->met));
  HycoFreeAll(&t->grown, &t->surface_node, &t->fixed);
  PetscCall(HycoSamplesDestroy(&t->held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between the attempts of a search: bases depend on the settings, solutions do not. */
PetscErrorCode HycoReducerDropBases(HycoReducer t)
{
  PetscFunctionBegin;
  HycoFreeAll(&t->seeds_node, &t->seeds_cell, &t->sigma, &t->VtU);
  PetscCall(MatDestroy(&t->V));
  t->n_seeds_node = t->n_seeds_cell = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For other training solutions; HycoReducerDropBases() only takes back what one attempt cut from the bases. */
PetscErrorCode HycoReducerResetBases(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerDropBases(t));
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) {
    PetscCall(MatDestroy(&t->basis[k].V));
    HycoFreeAll(&t->basis[k].sigma, &t->basis[k].coefficients);
    t->basis[k].l = t->basis[k].n_sigma = 0;
  }
  PetscCall(MatDestroy(&t->S));
  /* Everything that was cut from these solutions or judged on them. */
  HycoFreeAll(&t->U_rid, &t->rid_row, &t->V_rid, &t->Lambda, &t->U_norm, &t->dual_seeds, &t->taken_start, &t->taken,
              &t->stops, &t->judged, &t->judged_held);
  t->n_dual_seeds = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also half made: each part is NULL until it is. */
PetscErrorCode HycoReducerDestroy(HycoReducer *reducer)
{
  HycoReducer t;

  PetscFunctionBegin;
  HycoDestroyBegin(reducer, HYCO_REDUCER_CLASSID);
  t = *reducer;
  PetscCall(HycoReducerReset(t));
  /* The type's own data before the prototype that names the type. */
  PetscCall(EndTraining(t));
  PetscCall(PetscStrArrayDestroy(&t->groups));
  HycoFreeAll(&t->region, &t->solved, &t->written);
  PetscCall(HycoSceneDestroy(&t->scene));
  PetscCall(PetscHeaderDestroy(reducer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoReducerSetSnapshotFolder, (HycoReducer t, const char folder[]), t, HYCO_REDUCER_CLASSID,
                 HycoCheckGiven(folder);
                 PetscCall(PetscStrncpy(t->folder, folder, sizeof(t->folder))))
HycoDefineMethod(HycoReducerGetSolved, (HycoReducer t, PetscInt *n_groups, const PetscInt *solved[]), t,
                 HYCO_REDUCER_CLASSID, HycoCheckGiven(n_groups);
                 HycoCheckGiven(solved); *n_groups = t->n_solvers; *solved = t->solved)
HycoDefineMethod(HycoReducerGetBalance, (HycoReducer t, PetscInt *unsolved, const PetscReal *written[]), t,
                 HYCO_REDUCER_CLASSID, HycoCheckGiven(unsolved);
                 HycoCheckGiven(written); *unsolved = t->unsolved; *written = t->written)
HycoDefineMethod(HycoReducerSetProgress, (HycoReducer t, HycoProgress progress, void *ctx), t, HYCO_REDUCER_CLASSID,
                 t->progress = progress;
                 t->progress_ctx = ctx)
HycoDefineMethod(HycoReducerSetPhaseMonitor, (HycoReducer t, HycoPhaseMonitor monitor, void *ctx), t,
                 HYCO_REDUCER_CLASSID, t->phase = monitor;
                 t->phase_ctx = ctx)
HycoDefineMethod(HycoReducerSetValidation, (HycoReducer t, HycoSamples validation), t, HYCO_REDUCER_CLASSID,
                 t->validation = validation)
HycoDefineMethod(HycoReducerSetValidationCount, (HycoReducer t, PetscInt n), t, HYCO_REDUCER_CLASSID,
                 t->n_validation = n)
HycoDefineMethod(HycoReducerSetSearch, (HycoReducer t, PetscBool search), t, HYCO_REDUCER_CLASSID, t->search = search)
HycoDefineMethod(HycoReducerSetAttemptMonitor,
                 (HycoReducer t, HycoAttemptMonitor attempt, HycoAddedMonitor added, void *ctx), t,
                 HYCO_REDUCER_CLASSID, t->attempt = attempt;
                 t->added = added; t->attempt_ctx = ctx)

/* Default targets: errors that most studies can ignore; and limits. */
static const PetscReal usual[HYCO_N_ERRORS] = {
    [HYCO_ERROR_U] = 2e-3, [HYCO_ERROR_SIGMA] = 2e-2, [HYCO_ERROR_LAMBDA] = 1e-2, [HYCO_ERROR_INELASTIC] = 2e-2};
static const PetscReal limits[HYCO_N_ERRORS] = {[HYCO_ERROR_U] = 5e-3, [HYCO_ERROR_LAMBDA] = 3e-2};

/* With a target of the user's, errors without one have none, and each target is its own limit. */
PetscErrorCode HycoReducerGetTargets(HycoReducer t, PetscReal target[], PetscReal limit[])
{
  PetscBool given = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  for (PetscInt e = 0; e < HYCO_N_ERRORS; e++) given = (PetscBool)(given || t->target[e] > 0);
  if (target) PetscCall(PetscArraycpy(target, given ? t->target : usual, HYCO_N_ERRORS));
  if (limit) PetscCall(PetscArraycpy(limit, given ? t->target : limits, HYCO_N_ERRORS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A budget below 0: as many solutions may be added as there are at first. */
PetscErrorCode HycoReducerSetTargets(HycoReducer t, const PetscReal target[], PetscInt budget)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheckGiven(target);
  for (PetscInt e = 0; e < HYCO_N_ERRORS; e++) {
    HycoCheck(target[e] >= 0, "the target of the error %s is %g; it must be positive (0: none)", HycoErrorKinds[e],
              (double)target[e]);
    t->target[e] = target[e];
  }
  t->budget = budget;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoReducerSetGreedyMonitor, (HycoReducer t, HycoGreedyMonitor monitor, void *ctx), t,
                 HYCO_REDUCER_CLASSID, t->greedy.monitor = monitor;
                 t->greedy.ctx = ctx)
HycoDefineMethod(HycoReducerSetGreedyIndicator, (HycoReducer t, HycoIndicatorKind kind), t, HYCO_REDUCER_CLASSID,
                 t->greedy.indicator = kind)

/* 0: no limit. Both limits are checked after an iteration, so that a model is always complete. */
PetscErrorCode HycoReducerSetGreedyStop(HycoReducer t, PetscReal target, PetscInt max_snapshots, PetscReal max_seconds)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheck(target > 0, "the target of the greedy training is %g; it must be positive, for example 1e-3",
            (double)target);
  HycoCheck(
      max_snapshots >= 0 && max_seconds >= 0,
      "the limits of the greedy training are %d snapshots and %g seconds; they must not be negative (0: no limit)",
      (int)max_snapshots, (double)max_seconds);
  t->greedy.target = target;
  t->greedy.max_snapshots = max_snapshots;
  t->greedy.max_seconds = max_seconds;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hyco_pod_svd_type: a registered type, SLEPc's or the program's among them. */
static PetscErrorCode ReadSVDType(HycoReducer t, HycoOptionItems PetscOptionsObject)
{
  const char **registered, **types;
  int n;
  PetscInt type = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoSVDRegisterAll());
  PetscCall(PetscFunctionListGet(SVDList, &registered, &n));
  while (n && !registered[n - 1]) n--; /* some releases of PETSc count a NULL at the end */
  PetscCall(PetscCalloc1(n + 1, &types));
  PetscCall(PetscArraycpy(types, registered, n));
  PetscCall(PetscFree(registered));
  while (types[type] && strcmp(types[type], t->svd_type)) type++;
  ierr = HycoOptionsWord("-hyco_pod_svd_type",
                         "<tsqr|trlanczos|cross|cyclic|lapack|randomized|...> SVD of the POD: tall-skinny QR, or one "
                         "of SLEPc's (-hyco_pod_svd_... sets its own options)",
                         types, &type, NULL);
  /* A copy: the list of names is freed. */
  if (!ierr) ierr = PetscStrncpy(t->svd_type, types[type], sizeof(t->svd_type));
  PetscCall(PetscFree(types));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the other options of the PODs' SVD now, so that an error is not found only after hours. */
static PetscErrorCode CheckSVDOptions(HycoReducer t)
{
  SVD svd;

  PetscFunctionBegin;
  PetscCall(HycoReducerCreateSVD(t, HycoComm(t), &svd));
  PetscCall(SVDSetFromOptions(svd));
  PetscCall(SVDDestroy(&svd));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options of train that do not depend on the model. */
static PetscErrorCode ReadTraining(HycoReducer t)
{
  static const char *const indicators[] = {"local", "penetration", "residual", NULL};
  const PetscBool set = t->pinned[HYCO_CHOICE_TYPE]; /* HycoReducerSetModelType() */
  PetscInt type = 0, indicator = (PetscInt)t->greedy.indicator;
  const char *const *types;

  PetscFunctionBegin;
  PetscCall(HycoTrainerNames(&types));
  /* The present type is the default of the option. */
  while (types[type] && strcmp(types[type], t->prototype ? t->prototype->model->type : HYCO_ROM_HYBRID)) type++;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsString("-hyco_snapshots", "<folder> where full-order solutions are stored [MODEL.snapshots]",
                              t->folder, sizeof(t->folder), NULL));
  PetscCall(HycoOptionsWord("-hyco_model_type",
                            "hybrid hyper-reduced (38) on an RID; projection-based (44) on the whole mesh, or with a "
                            "cubature on some of its cells; bodies condensed to their surfaces; "
                            "regression without a solve [train searches: bodies, then hybrid]",
                            types, &type, &t->pinned[HYCO_CHOICE_TYPE]));
  PetscCall(HycoOptionsReal("-hyco_pod_tol", "energy left out of the displacement basis, epsilon of (18)", 0, 1,
                            &t->tol[HYCO_SEED_DISPLACEMENT], &t->pinned[HYCO_CHOICE_TOLERANCE]));
  PetscCall(HycoOptionsReal("-hyco_pod_noise", "singular values below this share of the first are treated as round-off",
                            0, 1, &t->noise, NULL));
  PetscCall(HycoOptionsReal("-hyco_pod_memory",
                            "<MB> of all ranks for the snapshots of a field while their POD is computed, in batches "
                            "(0: all at once)",
                            0, 1e9, &t->pod_memory, NULL));
  PetscCall(ReadSVDType(t, PetscOptionsObject));
  PetscCall(HycoOptionsInt("-hyco_pod_max_modes", "largest number of displacement modes (0: no limit)", 0,
                           PETSC_MAX_INT, &t->max_modes, NULL));
  PetscCall(HycoOptionsInt("-hyco_validation",
                           "number of held-out solutions, on which the model is judged (-1: from the number of "
                           "training points, few for bodies; "
                           "0: none)",
                           -1, 100000, &t->n_validation, NULL));
  PetscCall(HycoOptionsBool(
      "-hyco_search",
      "choose model_type, pod_tol, rid_layers, rid_contact_extension and hybrid by the held-out errors, unless given",
      &t->search, NULL));
  PetscCall(HycoOptionsReal("-hyco_search_budget",
                            "estimated operations of the search as a multiple of those of the full-order solutions; "
                            "two models, and searches of seconds, are always tried",
                            0, 1e9, &t->search_budget, NULL));
  PetscCall(HycoOptionsBool(
      "-hyco_search_exhaustive",
      "try all settings, whatever they cost, and judge them at all held-out points, also those that cannot be chosen",
      &t->exhaustive, NULL));
  PetscCall(HycoOptionsName("-hyco_reducer_view", "print the settings of the training before it begins"));
  PetscCall(HycoOptionsFor("greedy"));
  PetscCall(HycoOptionsWord("-hyco_greedy_indicator",
                            "error indicator of train -greedy: distance from a full-order problem on the RID (43), "
                            "penetration (45), or for paths the residual of full order",
                            indicators, &indicator, NULL));
  PetscCall(HycoOptionsBool("-hyco_greedy_keep",
                            "train -greedy stores the model of each iteration beside the snapshots", &t->greedy.keep,
                            NULL));
  PetscCall(HycoOptionsFor("hybrid, projection or cubature"));
  PetscCall(HycoOptionsInt(
      "-hyco_scan",
      "points per parameter at which training looks for a singular reduced stiffness (0: some hundred in all)", 0,
      1000000, &t->scan, NULL));
  PetscCall(HycoOptionsBool("-hyco_keep_singular", "keep a model whose reduced stiffness is singular inside the ranges",
                            &t->keep_singular, NULL));
  PetscOptionsEnd();
  PetscCall(EndTraining(t)); /* the type's options may have changed */
  /* With friction the type without a search is bodies; a search begins with the settings of others, and may end with
     hybrid. */
  if (t->scene && HycoSceneHasFriction(t->scene) && t->search && t->n_validation && !set &&
      !t->pinned[HYCO_CHOICE_TYPE])
    PetscCall(HycoReducerSetType(t, HYCO_ROM_HYBRID));
  else
    PetscCall(HycoReducerSetType(t, types[type]));
  t->greedy.indicator = (HycoIndicatorKind)indicator;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hyco_rid_modes. The wrong word is reported after the list is freed. Springs are not a word: they follow forces. */
static PetscErrorCode TakeSeedKinds(HycoReducer t, PetscInt n, char ***list)
{
  static const char *const words[] = {"displacement", "stress", "force", "dual", "inelastic"};
  const PetscInt n_words = HYCO_SEED_INELASTIC + 1;
  char wrong[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt k = 0;

    while (k < n_words && strcmp((*list)[i], words[k])) k++;
    if (k < n_words)
      t->seed[k] = PETSC_TRUE;
    else
      PetscCall(PetscStrncpy(wrong, (*list)[i], sizeof(wrong)));
  }
  PetscCall(PetscStrArrayDestroy(list));
  /* Force modes that leave out springs would not balance at their nodes. */
  t->seed[HYCO_SEED_SPRING] = (PetscBool)(t->seed[HYCO_SEED_FORCE] && t->scene && t->scene->n_springs);
  HycoCheck(!wrong[0],
            "-hyco_rid_modes has \"%s\"; the possible values are displacement, stress, force, dual and inelastic",
            wrong);
  HycoCheck(!t->seed[HYCO_SEED_INELASTIC] || !t->scene || t->scene->n_times,
            "-hyco_rid_modes inelastic is for scenes with a history, and this scene has none; remove it");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hyco_rid_region, parsed now, so that an error is not found only after hours */
static PetscErrorCode TakeRegion(HycoReducer t, const char text[])
{
  HycoExpr region = NULL;

  PetscFunctionBegin;
  PetscCall(PetscFree(t->region));
  if (!text[0] || strcmp(text, "none") == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoExprCreate("hyco_rid_region", text, 0, NULL, &region));
  PetscCall(HycoExprDestroy(&region));
  PetscCall(PetscStrallocpy(text, &t->region));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options of the RID and of its full-order displacements. */
static PetscErrorCode ReadRID(HycoReducer t)
{
  static const char *const deims[] = {"deim", "qdeim", NULL};
  char region[4 * HYCO_LINE] = "", **kinds;
  PetscInt hybrid = (PetscInt)t->hybrid, n_kinds;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscStrArrayDestroy(&t->groups));
  /* The default of both is the value of -hyco_pod_tol, which ReadTraining() has read. */
  t->tol[HYCO_SEED_STRESS] = t->tol[HYCO_SEED_FORCE] = t->tol[HYCO_SEED_DISPLACEMENT];
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("hybrid or regression"));
  PetscCall(HycoOptionsList("-hyco_rid_modes",
                            "bases whose DEIM points seed the RID: displacement, stress, force, dual and, with a "
                            "history, inelastic [displacement,stress,force,inelastic]",
                            &n_kinds, &kinds, &set));
  if (set) PetscCall(TakeSeedKinds(t, n_kinds, &kinds));
  PetscCall(
      HycoOptionsReal("-hyco_rid_dual_tol", "epsilon of (18) for the dual basis", 0, 1, &t->tol[HYCO_SEED_DUAL], NULL));
  PetscCall(HycoOptionsReal("-hyco_rid_stress_tol", "epsilon of (18) for the stress basis [hyco_pod_tol]", 0, 1,
                            &t->tol[HYCO_SEED_STRESS], NULL));
  PetscCall(HycoOptionsReal("-hyco_rid_force_tol", "epsilon of (18) for the basis of generalised forces [hyco_pod_tol]",
                            0, 1, &t->tol[HYCO_SEED_FORCE], NULL));
  PetscCall(
      HycoOptionsWord("-hyco_deim_type",
                      "selection of the points that seed the RID from a basis: greedy (DEIM), or pivoted QR (Q-DEIM)",
                      deims, &t->deim, NULL));
  PetscCall(HycoOptionsInt("-hyco_rid_layers", "layers of elements added around the RID", 0, PETSC_MAX_INT, &t->layers,
                           &t->pinned[HYCO_CHOICE_LAYERS]));
  PetscCall(
      HycoOptionsReal("-hyco_rid_contact_extension",
                      "<length> contact nodes within this distance of the RID's are added to it, with their elements",
                      0, PETSC_MAX_REAL, &t->extension, &t->pinned[HYCO_CHOICE_EXTENSION]));
  PetscCall(HycoOptionsList("-hyco_rid_groups", "mesh groups whose elements are added to the RID (region of interest)",
                            &t->n_groups, &t->groups, NULL));
  PetscCall(HycoOptionsString("-hyco_rid_region",
                              "<expression> elements with a node where this is positive are added to the RID [none]",
                              region, sizeof(region), NULL));
  PetscCall(HycoOptionsBool("-hyco_rid_whole", "use the whole mesh as the RID", &t->whole_rid,
                            &t->pinned[HYCO_CHOICE_WHOLE]));
  PetscCall(HycoOptionsFor("hybrid or cubature"));
  PetscCall(HycoOptionsWord(
      "-hyco_hybrid", "displacements kept full order: the fewest for full row rank, those of the contacts, or all",
      HycoHybrids, &hybrid, &t->pinned[HYCO_CHOICE_HYBRID]));
  PetscOptionsEnd();
  t->tol[HYCO_SEED_INELASTIC] = t->tol[HYCO_SEED_STRESS];
  t->tol[HYCO_SEED_SPRING] = t->tol[HYCO_SEED_FORCE];
  t->hybrid = (HycoHybrid)hybrid;
  PetscCall(TakeRegion(t, region));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Settings fixed by the type: some have one basis of forces only; if the RID is the whole mesh, nothing seeds it. */
static PetscErrorCode CheckType(HycoReducer t)
{
  char dual[32] = "fe";

  PetscFunctionBegin;
  /* Read here too, where the wrong type would otherwise leave it unread. */
  PetscCall(PetscOptionsGetString(((PetscObject)t)->options, NULL, "-hyco_dual", dual, sizeof(dual), NULL));
  HycoCheckModel(t->prototype->model->traits.force_basis || strcmp(dual, "fe") == 0,
                 "-hyco_dual %s is for -hyco_model_type projection and cubature; the other models have no vectors of "
                 "forces",
                 dual);
  HycoCheckModel(t->prototype->model->traits.history || !t->scene || !t->scene->n_times,
                 "the scene has a history (history_times), and -hyco_model_type %s does not support paths; use hybrid",
                 t->prototype->model->type);
  if (!t->prototype->model->traits.whole && !t->prototype->model->traits.cells) PetscFunctionReturn(PETSC_SUCCESS);
  t->whole_rid = t->prototype->model->traits.whole;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadAll(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(ReadTraining(t));
  PetscCall(ReadRID(t));
  PetscCall(CheckType(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetModelType(HycoReducer t, HycoROMType type)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheckGiven(type);
  PetscCall(HycoReducerSetType(t, type));
  t->pinned[HYCO_CHOICE_TYPE] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetPODTolerance(HycoReducer t, PetscReal tol)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheckValue(tol >= 0 && tol <= 1, "the tolerance of the POD is %g; it must lie between 0 and 1", (double)tol);
  t->tol[HYCO_SEED_DISPLACEMENT] = tol;
  t->pinned[HYCO_CHOICE_TOLERANCE] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetRIDLayers(HycoReducer t, PetscInt layers)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheckValue(layers >= 0, "the RID has %d layers; it must be 0 or more", (int)layers);
  t->layers = layers;
  t->pinned[HYCO_CHOICE_LAYERS] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerSetFromOptions(HycoReducer t)
{
  PetscBool before[sizeof(t->pinned) / sizeof(t->pinned[0])];

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  PetscCall(PetscMemcpy(before, t->pinned, sizeof(before)));
  PetscCall(HycoEntriesOverride(t->scene->options, PETSC_TRUE)); /* what a program has set since */
  PetscCall(ReadAll(t));
  for (size_t k = 0; k < sizeof(before) / sizeof(before[0]); k++) t->pinned[k] = (PetscBool)(t->pinned[k] || before[k]);
  PetscCall(CheckSVDOptions(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declares the reducer's options and those of all types. Each type's SetFromOptions declares its own options: all
   are set once. */
static PetscErrorCode DeclareAll(HycoReducer t)
{
  const char *const *types;

  PetscFunctionBegin;
  PetscCall(ReadAll(t));
  PetscCall(HycoTrainerNames(&types));
  for (PetscInt k = 0; types[k]; k++) PetscCall(HycoReducerSetType(t, types[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerDeclare(PetscOptions options)
{
  HycoReducer t;

  PetscFunctionBegin;
  PetscCall(ReducerCreate(PETSC_COMM_SELF, &t));
  HycoDeclare(t, options, DeclareAll, HycoReducerDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoReducerGetType, (HycoReducer t, HycoROMType *type), t, HYCO_REDUCER_CLASSID, HycoCheckGiven(type);
                 *type = t->prototype->model->type)

/* Without a search, or without held-out points to judge by, the present type is the only one. */
PetscErrorCode HycoReducerTries(HycoReducer t, const char types[], PetscBool *tries)
{
  const char *const *names;
  PetscBool searches;

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheckGiven(types);
  HycoCheckGiven(tries);
  searches = (PetscBool)(t->search && !t->pinned[HYCO_CHOICE_TYPE] && (t->validation || t->n_validation));
  /* types: a list of names in one text, as in the table of options. */
  *tries = (PetscBool)(strstr(types, t->prototype->model->type) != NULL);
  PetscCall(HycoTrainerNames(&names));
  for (PetscInt k = 0; names[k] && searches && !*tries; k++) {
    HycoTrainerOps trainer;

    if (!strstr(types, names[k])) continue;
    PetscCall(HycoTrainerFind(names[k], &trainer));
    /* A search takes types that offer settings; others must be named. */
    *tries = (PetscBool)(trainer.offers != NULL);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As the search's lines describe settings, so that both can be compared. */
PetscErrorCode HycoReducerView(HycoReducer t, PetscViewer viewer)
{
  HycoReducerSettings settings;
  char text[HYCO_LINE];

  PetscFunctionBegin;
  HycoViewBegin(t, HYCO_REDUCER_CLASSID, viewer);
  HycoReducerGetSettings(t, &settings);
  HycoReducerSettingsDescribe(&settings, sizeof(text), text);
  PetscCall(PetscViewerASCIIPrintf(viewer, "settings: %s%s\n", text, t->search ? "; searched if not given" : ""));
  PetscCall(PetscViewerASCIIPrintf(viewer, "snapshots: %s\n", t->folder[0] ? t->folder : "beside the model"));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoReducer, HYCO_REDUCER_CLASSID)

/* Cut at `length`: such texts are parts of one line. */
void HycoReducerSettingsDescribe(const HycoReducerSettings *r, size_t length, char text[])
{
  const char *kind = r ? HycoHybrids[r->hybrid] : NULL;

  if (!r || !text) return;
  /* As options, so that a line of a search can be repeated by them. */
  if (r->variant)
    snprintf(text, length, "%s, %s", r->type, r->variant);
  else if (!r->pod)
    snprintf(text, length, "%s", r->type);
  else if (!r->rid)
    snprintf(text, length, "%s, pod_tol %g", r->type, (double)r->pod_tol);
  else if (r->whole)
    snprintf(text, length, "%s, pod_tol %g, hybrid %s, the whole mesh as RID", r->type, (double)r->pod_tol, kind);
  else
    snprintf(text, length, "%s, pod_tol %g, hybrid %s, layers %d, contact extension %.3g%s%s", r->type,
             (double)r->pod_tol, kind, (int)r->layers, (double)r->contact_extension, r->plane ? ", at " : "",
             r->plane ? r->plane : "");
}

/* r borrows the type's name. */
void HycoReducerGetSettings(HycoReducer t, HycoReducerSettings *r)
{
  *r = (HycoReducerSettings){.type = t->prototype->model->type,
                             .pod = (PetscBool)!HycoReducerOwnModes(t, t->prototype),
                             .rid = (PetscBool)(t->prototype->model->traits.settings == HYCO_SETTINGS_RID),
                             .pod_tol = t->tol[HYCO_SEED_DISPLACEMENT],
                             .contact_extension = t->extension,
                             .layers = t->layers,
                             .hybrid = t->hybrid,
                             .whole = t->whole_rid,
                             .ridge = -1};
}
