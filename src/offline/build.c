/*
  The offline phase (sections 4.1, 4.2, 5): snapshots -> POD -> DEIM -> RID -> sets -> reduced model -> file.
  Matrices of snapshots are spread over the ranks; the mesh, the RID and the model live on rank 0.
*/
#include <hycoalgorithms.h>
#include <hycofile.h>
#include <hycoreducerimpl.h>
#include <string.h>
#include <unistd.h>

/* The whole mesh on rank 0, its sizes everywhere. */
static PetscErrorCode ReadMesh(HycoReducer t)
{
  PetscInt n_par, group = 0;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  HycoOnRoot(HycoComm(t), HycoMeshRead(t->scene, &t->whole));
  HycoOnRoot(HycoComm(t), HycoPairsFind(t->scene, t->whole, &t->pairs));
  for (PetscInt k = 0; k < t->n_groups; k++)
    HycoOnRoot(HycoComm(t), HycoMeshFindGroup(t->whole, "hyco_rid_groups", t->groups[k], &group));
  HycoOnRoot(HycoComm(t), HycoFECreate(t->scene, t->whole, &t->fe));
  if (t->rank == 0) {
    t->sizes[0] = t->whole->n_nodes;
    t->sizes[1] = t->whole->n_cells;
    t->sizes[2] = t->pairs.n;
    t->sizes[3] = t->whole->dim;
  }
  HycoOnRoot(HycoComm(t), HycoFESetParameters(t->fe, mu));
  PetscCallMPI(MPI_Bcast(t->sizes, 4, MPIU_INT, 0, HycoComm(t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (35)-(36): a contact without a free unknown in A_c is not in A_lambda. */
static PetscErrorCode DropFixedContacts(HycoReducer t, const PetscInt role[], PetscInt in_rid[])
{
  const PetscInt n = t->pairs.n, entries = HycoPairsWidth(&t->pairs) * t->sizes[3] * n;
  PetscInt *start, *dof;
  PetscReal *value, *gap;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(n + 1, &start, entries, &dof, entries, &value, n, &gap));
  PetscCall(HycoContactRows(t->fe, &t->pairs, start, dof, value, gap));
  for (PetscInt k = 0; k < n; k++) {
    PetscBool free = PETSC_FALSE;

    for (PetscInt j = start[k]; j < start[k + 1]; j++)
      free = (PetscBool)(free || role[dof[j] / t->sizes[3]] == HYCO_ROLE_A);
    if (!free) in_rid[k] = 0;
  }
  PetscCall(PetscFree4(start, dof, value, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What moved surfaces meet: every contact's masters at the training points and over the ranges, as far as contacts may
   close. *rows, *of: of all contacts; those of the mesh as they are where nothing is moved (of: NULL). */
static PetscErrorCode Meet(HycoReducer t, HycoROM m, const HycoPairs **rows, const PetscInt **of)
{
  PetscInt n;
  const PetscReal *mu;

  PetscFunctionBegin;
  *rows = &t->pairs;
  *of = NULL;
  if (!t->pairs.room) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, &mu));
  PetscCall(HycoMetDestroy(&t->met));
  PetscCall(PetscMalloc1(t->scene->n_contacts, &m->master_reach));
  PetscCall(HycoMetReach(t->scene, t->whole, &t->pairs, n, mu, t->Lambda, m->master_reach));
  PetscCall(HycoMetFind(t->scene, t->whole, &t->pairs, n, mu, m->master_reach, &t->met));
  *rows = &t->met.rows;
  *of = t->met.of;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sets, and A_lambda by contact. */
static PetscErrorCode FindSets(HycoReducer t, const HycoPairs *rows, const PetscInt of[], const PetscBool in[],
                               PetscInt role[], PetscInt in_rid[])
{
  const PetscInt dim = t->sizes[3];
  PetscInt *row_in;

  PetscFunctionBegin;
  if (!of) {
    PetscCall(HycoRIDSets(t->whole, rows, in, role, in_rid));
    PetscCall(DropFixedContacts(t, role, in_rid));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(rows->n, &row_in));
  PetscCall(HycoRIDSets(t->whole, rows, in, role, row_in));
  PetscCall(PetscArrayzero(in_rid, t->pairs.n));
  for (PetscInt r = 0; r < rows->n; r++) {
    PetscBool free = PETSC_FALSE;

    for (PetscInt j = rows->master_start[r] - 1; row_in[r] && j < rows->master_start[r + 1]; j++) {
      const PetscInt i = j < rows->master_start[r] ? rows->slave[r] : rows->master[j];

      for (PetscInt c = 0; c < dim && role[i] == HYCO_ROLE_A; c++)
        free = (PetscBool)(free || !t->fe->fixed[i * dim + c]);
    }
    if (free) in_rid[of[r]] = 1;
  }
  PetscCall(PetscFree(row_in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes beside the RID that the model's mesh has: those of every contact, of moved surfaces all; and the groups
   whose facets it has, wherever their cells are. */
static PetscErrorCode SurfacesOf(HycoReducer t, PetscBool contact[], PetscInt *n_all, PetscInt all[])
{
  HycoMesh whole = t->whole;

  PetscFunctionBegin;
  HycoPairsMark(&t->pairs, contact);
  PetscCall(HycoMovedGroups(t->scene, whole, &t->pairs, n_all, all));
  for (PetscInt g = 0; g < *n_all; g++) {
    for (PetscInt k = whole->group_start[all[g]]; k < whole->group_start[all[g] + 1]; k++)
      contact[whole->group_node[k]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < t->scene->n_contacts; k++)
    PetscCall(HycoMeshFindGroup(whole, "contact", t->scene->contact[k]->slave, &all[(*n_all)++]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Omega_A and the reduced mesh: its cells, their nodes, the nodes and surfaces of every contact. */
static PetscErrorCode CutDomain(HycoReducer t, HycoROM m)
{
  HycoRIDRecipe recipe = {t->n_seeds_node, t->n_seeds_cell, t->seeds_node, t->seeds_cell, t->layers,
                          t->extension,    t->n_groups,     t->groups,     t->region,     t->whole_rid};
  HycoMesh whole = t->whole;
  const HycoPairs *rows;
  const PetscInt *of;
  PetscBool *in, *contact;
  PetscInt *role, *keep, *extra, *index, *all, n_keep = 0, n_extra = 0, n_all = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(whole->n_cells, &in, whole->n_nodes, &role, whole->n_cells, &keep, whole->n_nodes, &extra,
                         whole->n_nodes, &index));
  PetscCall(PetscCalloc1(whole->n_nodes, &contact));
  PetscCall(PetscMalloc1(3 * t->scene->n_contacts, &all));
  PetscCall(Meet(t, m, &rows, &of));
  HycoLogged(HYCO_EVENT_RID, HycoRIDBuild(t->scene, whole, rows, &recipe, in));
  for (PetscInt e = 0; t->grown && e < whole->n_cells; e++) t->grown[e] = in[e] = (PetscBool)(in[e] || t->grown[e]);
  PetscCall(PetscMalloc1(t->pairs.n, &m->in_rid));
  PetscCall(FindSets(t, rows, of, in, role, m->in_rid));
  PetscCall(SurfacesOf(t, contact, &n_all, all));
  for (PetscInt e = 0; e < whole->n_cells; e++) {
    if (in[e]) keep[n_keep++] = e;
  }
  for (PetscInt i = 0; i < whole->n_nodes; i++) {
    if (contact[i]) extra[n_extra++] = i;
  }
  PetscCall(HycoMeshExtract(whole, n_keep, keep, n_extra, extra, n_all, all, &m->mesh));
  PetscCall(PetscMalloc1(m->mesh->n_nodes, &m->role));
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    m->role[i] = role[m->mesh->node_whole[i]];
    index[m->mesh->node_whole[i]] = i;
  }
  PetscCall(HycoPairsRenumber(&t->pairs, index, &m->pairs));
  PetscCall(PetscFree(all));
  PetscCall(PetscFree(contact));
  PetscCall(PetscFree5(in, role, keep, extra, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Greedy: more modes than unknowns in A would leave some without an equation. */
static PetscErrorCode LimitModes(HycoReducer t, HycoROM m)
{
  const PetscInt dim = t->sizes[3], l = t->l;
  PetscInt n_A = 0;

  PetscFunctionBegin;
  if (!t->grown) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < m->mesh->n_nodes * dim; i++)
    n_A += m->role[i / dim] == HYCO_ROLE_A && !t->fe->fixed[m->mesh->node_whole[i / dim] * dim + i % dim];
  if (n_A >= l || !n_A) PetscFunctionReturn(PETSC_SUCCESS);
  t->l = n_A; /* rows of V and columns of V^T U move together */
  for (PetscInt i = 1; i < t->sizes[0] * dim; i++)
    PetscCall(PetscArraymove(t->V_whole + i * n_A, t->V_whole + i * l, n_A));
  for (PetscInt k = 1; k < t->n_s; k++) PetscCall(PetscArraymove(t->VtU + k * n_A, t->VtU + k * l, n_A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes on the reduced mesh, the dual snapshots that are not zero, the training points, where it all came from. */
static PetscErrorCode FillModel(HycoReducer t, HycoROM m)
{
  const PetscInt dim = t->sizes[3], N = t->sizes[2];
  PetscInt n_par;
  const PetscReal *mu;
  char *text;
  char line[2 * HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &m->n_points, &n_par, &mu));
  m->type = t->type;
  m->dual = t->dual;
  m->l = t->l;
  HycoDuplicate(t->l, t->sigma, &m->sigma);
  PetscCall(PetscMalloc1(m->mesh->n_nodes * dim * m->l, &m->V));
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++)
    PetscCall(PetscArraycpy(m->V + i * dim * m->l, t->V_whole + m->mesh->node_whole[i] * dim * m->l, dim * m->l));
  PetscCall(PetscMalloc1((size_t)N * (size_t)t->n_s + 1, &m->S_lambda));
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscReal size = 0;

    for (PetscInt i = 0; i < N; i++) size += t->Lambda[(size_t)k * (size_t)N + (size_t)i];
    if (size > 0)
      PetscCall(PetscArraycpy(m->S_lambda + (size_t)(m->n_dual++) * (size_t)N, t->Lambda + (size_t)k * (size_t)N, N));
  }
  HycoDuplicate(m->n_points * n_par, mu, &m->points);
  m->whole_nodes = t->sizes[0];
  m->whole_cells = t->sizes[1];
  m->counts[0] = t->counts[HYCO_SEED_DUAL];
  m->counts[1] = t->counts[HYCO_SEED_STRESS];
  m->counts[2] = t->counts[HYCO_SEED_FORCE];
  snprintf(line, sizeof(line), "  written by hyco %s with PETSc %d.%d.%d\n", HycoVersion(), PETSC_VERSION_MAJOR,
           PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR);
  PetscCall(PetscStrallocpy(line, &m->provenance));
  snprintf(m->fingerprint, sizeof(m->fingerprint), "%016llx", t->fingerprint);
  /* the model has a scene of its own, read from the text it will carry */
  PetscCall(HycoSceneToText(t->scene, &text));
  PetscCall(HycoSceneFromText(PETSC_COMM_SELF, text, &m->scene));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Report(HycoReducer t, HycoROM m, HycoTraining *r)
{
  r->type = m->type;
  r->dual_misfit = m->dual_misfit;
  if (m->condensed) {
    r->target_met = m->condensed->target_met;
    r->hopeless = m->condensed->hopeless;
    if (r->hopeless >= 0) {
      r->hopeless_values = m->condensed->n[r->hopeless];
      r->hopeless_error = m->condensed->by_parameter[r->hopeless];
    }
    r->target = t->condensed_tol;
    r->most_values = t->condensed_max_values;
    r->n_flexibilities = HycoTensorSize(&m->condensed->field[HYCO_FIELD_G].tensor);
    for (PetscInt k = 0; k < 3; k++) r->left_out[k] = m->condensed->errors[k];
  }
  r->n_supremizers = t->n_supremizers;
  r->n_samples = t->n_s;
  r->n_modes = t->l;
  r->n_dual_modes = t->counts[HYCO_SEED_DUAL];
  r->n_stress_modes = t->counts[HYCO_SEED_STRESS];
  r->n_force_modes = t->counts[HYCO_SEED_FORCE];
  r->n_fe_dofs = m->n_fe;
  r->rid_nodes = r->rid_a_nodes = r->rid_contacts = 0;
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    r->rid_nodes += m->role[i] != HYCO_ROLE_OUTSIDE;
    r->rid_a_nodes += m->role[i] == HYCO_ROLE_A;
  }
  for (PetscInt k = 0; k < m->pairs.n; k++) r->rid_contacts += m->in_rid[k];
  r->rid_elements = m->mesh->n_cells;
  r->rid_fraction = (PetscReal)m->mesh->n_cells / m->whole_cells;
  r->condition = m->numbers[0];
  r->error_u = m->numbers[1];
  r->error_lambda = m->numbers[2];
}

/* A hybrid model without a contact gives no force, also where its training solutions press. */
static PetscErrorCode CheckForces(HycoReducer t, HycoROM m)
{
  PetscBool reconstruct = PETSC_TRUE, presses = PETSC_FALSE, kept = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetBool(t->scene->options, NULL, "-hyco_reconstruct", &reconstruct, NULL));
  for (PetscInt k = 0; k < m->pairs.n; k++) kept = (PetscBool)(kept || m->in_rid[k]);
  for (PetscInt k = 0; k < t->n_s * m->pairs.n; k++) presses = (PetscBool)(presses || t->Lambda[k] > 0);
  HycoCheckModel(
      m->type != HYCO_ROM_HYBRID || !reconstruct || kept || !presses,
      "the RID has no contact, and the training solutions press: the model would give no force; let the RID reach "
      "the contact (-hyco_rid_modes displacement,dual or -hyco_rid_groups GROUP), or take displacements alone by "
      "-hyco_reconstruct false");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model that misses its own training solutions by half is refused. */
static PetscErrorCode CheckUseful(HycoReducer t, HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckModel(m->numbers[1] < 0.5,
                 "the model misses its own training displacements by %.0f %% on average (RID %d elements, %d modes, "
                 "condition %.0e): enlarge the RID (-hyco_rid_layers 1, "
                 "-hyco_rid_contact_extension LENGTH), or take fewer modes (-hyco_pod_tol)",
                 100 * (double)m->numbers[1], (int)m->mesh->n_cells, (int)m->l, (double)m->numbers[0]);
  PetscCall(CheckForces(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: the RID, the model on it, its full-order displacements, the file. */
static PetscErrorCode BuildAndSave(HycoReducer t, PetscBool useful, const char path[], HycoTraining *report)
{
  HycoROM m;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&m));
  ierr = t->dual == HYCO_DUAL_SNAPSHOTS ? HycoReducerEnrich(t) : PETSC_SUCCESS;
  if (!ierr) ierr = CutDomain(t, m);
  if (!ierr) ierr = LimitModes(t, m);
  if (!ierr) ierr = FillModel(t, m);
  if (!ierr)
    ierr = t->type == HYCO_ROM_PROJECTION  ? HycoReducerProject(t, m)
           : t->type == HYCO_ROM_CONDENSED ? HycoReducerCondense(t, m)
                                           : HycoReducerChooseHybrid(t, m);
  if (!ierr && useful) ierr = CheckUseful(t, m);
  if (!ierr) ierr = HycoROMSave(m, t->whole, t->V_whole, path);
  if (!ierr) Report(t, m, report);
  PetscCall(HycoROMDestroy(&m));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerBuild(HycoReducer t, PetscBool useful, const char path[], HycoTraining *report)
{
  char candidate[HYCO_FILE_NAME + 16];
  const PetscBool scan = (PetscBool)(useful && t->type != HYCO_ROM_CONDENSED); /* which has no reduced stiffness */

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(candidate, sizeof(candidate), "%s%s", path, scan ? ".candidate" : ""));
  PetscCall(HycoLogEvent(HYCO_EVENT_MODEL, PETSC_TRUE));
  HycoOnRoot(HycoComm(t), BuildAndSave(t, useful, candidate, report));
  PetscCall(HycoLogEvent(HYCO_EVENT_MODEL, PETSC_FALSE));
  PetscCallMPI(MPI_Bcast(report, sizeof(*report), MPI_BYTE, 0, HycoComm(t)));
  if (scan) HycoLogged(HYCO_EVENT_SCAN, HycoReducerScan(t, candidate, path, &report->scan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerFinish(HycoReducer t, HycoSnapshots store, const char path[], PetscBool learn,
                                 HycoTraining *report)
{
  char file[HYCO_FILE_NAME];
  HycoSamples grown = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFileScratch(HycoComm(t), path, "candidate", file));
  if (learn)
    ierr = HycoReducerLearn(t, store, file, &grown, report);
  else
    ierr = HycoReducerBuild(t, PETSC_TRUE, file, report);
  if (!ierr) ierr = HycoReducerCalibrate(t, store, file, report);
  PetscCall(HycoSamplesDestroy(&grown));
  if (ierr && t->rank == 0) (void)unlink(file);
  PetscCall(ierr);
  HycoOnRoot(HycoComm(t), HycoFileKeep(file, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model's place can be written before hours of work. */
static PetscErrorCode CheckWritable(const char path[])
{
  HycoFile probe;

  PetscFunctionBegin;
  PetscCall(HycoFileSweep(path));
  PetscCall(HycoFileCreate(path, HYCO_FILE_NUMBERS, &probe));
  PetscCall(HycoFileClose(&probe, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerOpen(HycoReducer t, HycoSamples samples, const char path[], HycoSnapshots *store)
{
  char folder[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoReducerReset(t));
  t->samples = samples;
  PetscCall(HycoSamplesGet(samples, &t->n_s, NULL, NULL));
  PetscCheck(t->n_s > 0, HycoComm(t), PETSC_ERR_USER, "the set of training points is empty");
  HycoOnRoot(HycoComm(t), CheckWritable(path));
  PetscCall(ReadMesh(t));
  if (t->folder[0])
    PetscCall(PetscStrncpy(folder, t->folder, sizeof(folder)));
  else
    PetscCall(PetscSNPrintf(folder, sizeof(folder), "%s.snapshots", path));
  PetscCall(HycoSnapshotsOpen(HycoComm(t), t->scene, folder, store));
  t->fingerprint = (*store)->fingerprint;
  PetscCall(HycoReducerViewFromOptions(t, NULL, "-hyco_reducer_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many points to judge by, when nobody says: enough for a bound of 95 % of the points to come where the training is
   large enough to pay for them. */
#define LEAST_HELD 20
#define MOST_HELD  30
#define TOGETHER   3 /* that share a stiffness, where loads or gaps are parameters too */

static PetscErrorCode DrawHeld(HycoReducer t, HycoSamples *held)
{
  PetscInt n, n_par, count = t->n_validation, slow[HYCO_MAX_PARAMETERS];
  PetscBool reaches[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, NULL));
  if (count < 0) count = PetscMin(MOST_HELD, PetscMax(LEAST_HELD, n));
  if (t->rank == 0) HycoSceneReaches(t->fe->scene, reaches);
  for (PetscInt p = 0; p < n_par; p++) slow[p] = t->rank == 0 && reaches[p];
  PetscCallMPI(MPI_Bcast(slow, (PetscMPIInt)n_par, MPIU_INT, 0, HycoComm(t)));
  for (PetscInt p = 0; p < n_par; p++) reaches[p] = (PetscBool)slow[p];
  PetscCall(HycoSamplesUnseen(t->samples, t->drawn, count, TOGETHER, reaches, held));
  t->drawn += count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerHoldOut(HycoReducer t, HycoSnapshots store)
{
  PetscInt n, m;

  PetscFunctionBegin;
  t->drawn = 0;
  PetscCall(HycoSamplesDestroy(&t->held));
  if (t->validation) {
    PetscCall(HycoSamplesExcept(t->validation, t->samples, &t->held));
    PetscCall(HycoSamplesGet(t->validation, &n, NULL, NULL));
    PetscCall(HycoSamplesGet(t->held, &m, NULL, NULL));
    HycoCheck(m, "each of the %d validation points is a training point too; a model is judged by others", (int)n);
  } else if (t->n_validation && t->scene->n_parameters)
    PetscCall(DrawHeld(t, &t->held));
  else
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSnapshotsFill(store, t->held, t->progress, t->progress_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerRun(HycoReducer t, HycoSamples samples, const char path[], HycoTraining *training)
{
  HycoSnapshots store;
  HycoSamples chosen = NULL;
  HycoTraining report = {0};
  PetscReal begin = HycoNow(), solved;
  const PetscBool choose = (PetscBool)!samples;

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheck(samples || t->type == HYCO_ROM_CONDENSED, "give the training points");
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++)
    HycoCheck(!(t->target[j] > 0) || t->validation || t->n_validation,
              "-target_%s judges the model at held-out points, and -hyco_validation is 0: there are none",
              HycoErrorKinds[j]);
  if (choose) {
    PetscCall(HycoReducerStartPoints(t, &chosen));
    samples = chosen;
  }
  PetscCall(HycoReducerOpen(t, samples, path, &store));
  if (t->type == HYCO_ROM_CONDENSED) PetscCall(HycoReducerBeginCondensed(t));
  if (choose)
    HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerChoosePoints(t, store, &chosen));
  else
    HycoStaged(HYCO_STAGE_FULL_ORDER, HycoSnapshotsFill(store, samples, t->progress, t->progress_ctx));
  HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerHoldOut(t, store));
  solved = HycoNow();
  if (choose) HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerFlexibility(t, store));
  if (choose) HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerFindModes(t, store));
  HycoStaged(HYCO_STAGE_REDUCTION, HycoReducerFinish(t, store, path, (PetscBool)!choose, &report));
  PetscCall(HycoReducerReset(t));
  PetscCall(HycoSnapshotsDestroy(&store));
  PetscCall(HycoSamplesDestroy(&chosen));
  report.seconds_snapshots = solved - begin;
  report.seconds_reduction = HycoNow() - solved;
  if (training) *training = report;
  PetscFunctionReturn(PETSC_SUCCESS);
}
