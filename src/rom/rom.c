/* HycoROM: made, asked, destroyed. */
#include <hycocondensed.h>
#include <hycofields.h>
#include <hycotable.h>
#include <petscviewer.h>
#include <stdio.h>
#include <string.h>

PetscErrorCode HycoROMCreate(HycoROM *model)
{
  PetscFunctionBegin;
  PetscCall(HycoInitializePackage());
  PetscCall(PetscHeaderCreate(*model, HYCO_ROM_CLASSID, "HycoROM", "Reduced model", "Hyco", PETSC_COMM_SELF,
                              HycoROMDestroy, HycoROMView));
  (*model)->reconstruct = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetFromOptions(HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscObjectOptionsBegin((PetscObject)m);
  PetscCall(HycoOptionsFor("predict"));
  PetscCall(
      HycoOptionsBool("-hyco_fallback",
                      "predict solves full order on -scene where the reduced solve fails or its estimated error is "
                      "above a -target_...",
                      &m->full_order, NULL));
  PetscCall(HycoOptionsBool("-hyco_full_displacement",
                            "predict, condensed: displacements and stresses by one full solve on -scene with the "
                            "predicted forces",
                            &m->full_displacement, NULL));
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsBool("-hyco_reconstruct", "reconstruct the contact forces outside the RID by (41)",
                            &m->reconstruct, NULL));
  PetscCall(HycoOptionsWord("-hyco_reconstruct_solver",
                            "of (41): Lawson and Hanson's active set, or TAO's bnls; auto: TAO where the active set "
                            "stops short",
                            HycoReconstructSolvers, &m->reconstruct_solver, NULL));
  PetscCall(HycoOptionsName("-hyco_rom_view", "what is in a model, when it is loaded"));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMDeclare(PetscOptions options)
{
  HycoROM m;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&m));
  HycoDeclare(m, options, HycoROMSetFromOptions, HycoROMDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetFallback(HycoROM m, PetscBool *full_order, PetscBool *displacement)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  *full_order = m->full_order;
  *displacement = m->full_displacement;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMReset(HycoROM m)
{
  PetscFunctionBegin;
  m->ready = m->solved = PETSC_FALSE;
  PetscCall(HycoReconstructionDestroy(&m->reconstruction));
  PetscCall(HycoReducedDestroy(&m->reduced));
  PetscCall(HycoLoadsDestroy(&m->loads));
  PetscCall(HycoSolverDestroy(&m->solver));
  PetscCall(HycoSystemDestroy(&m->system));
  PetscCall(MatDestroy(&m->K));
  PetscCall(MatDestroy(&m->Kr));
  PetscCall(MatDestroy(&m->Br));
  PetscCall(MatDestroy(&m->Btr));
  PetscCall(VecDestroy(&m->F));
  PetscCall(VecDestroy(&m->Fr));
  PetscCall(VecDestroy(&m->Dr));
  PetscCall(VecDestroy(&m->x));
  PetscCall(VecDestroy(&m->L));
  PetscCall(HycoFEDestroy(&m->fe));
  PetscCall(HycoROMDestroyOwn(m));
  PetscCall(PetscFree(m->contact));
  PetscCall(PetscFree(m->fe_at));
  PetscCall(PetscFree(m->Vp));
  PetscCall(PetscFree(m->row_start));
  PetscCall(PetscFree(m->row_dof));
  PetscCall(PetscFree(m->row_value));
  PetscCall(PetscFree(m->gap));
  PetscCall(PetscFree(m->gamma));
  PetscCall(PetscFree(m->U));
  PetscCall(PetscFree(m->Lambda));
  PetscCall(PetscFree(m->stress));
  PetscCall(PetscFree(m->slave_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMDestroy(HycoROM *model)
{
  HycoROM m;

  PetscFunctionBegin;
  if (!model || !*model) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*model, HYCO_ROM_CLASSID);
  HycoDereference(model);
  m = *model;
  PetscCall(HycoROMReset(m));
  PetscCall(HycoNormsDestroy(&m->norms));
  PetscCall(HycoCondensedDestroy(&m->condensed));
  PetscCall(HycoTableDestroy(&m->table));
  PetscCall(HycoFEDestroy(&m->fe_whole));
  PetscCall(HycoPairsDestroy(&m->whole_pairs));
  PetscCall(HycoMeshDestroy(&m->whole));
  PetscCall(PetscFree(m->V_whole));
  PetscCall(PetscFree(m->U_whole));
  PetscCall(HycoPairsDestroy(&m->pairs));
  PetscCall(HycoMeshDestroy(&m->mesh));
  PetscCall(HycoSceneDestroy(&m->scene));
  PetscCall(PetscFree(m->role));
  PetscCall(PetscFree(m->in_rid));
  PetscCall(PetscFree(m->V));
  PetscCall(PetscFree(m->sigma));
  PetscCall(PetscFree(m->fe_dof));
  PetscCall(PetscFree(m->G));
  PetscCall(PetscFree(m->S_lambda));
  PetscCall(PetscFree(m->V_lambda));
  PetscCall(PetscFree(m->points));
  PetscCall(PetscFree(m->reach));
  PetscCall(PetscFree(m->master_reach));
  PetscCall(PetscFree(m->provenance));
  PetscCall(PetscFree(m->search));
  PetscCall(PetscHeaderDestroy(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetType(HycoROM m, HycoROMType *type)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  *type = m->type;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetScene(HycoROM m, HycoScene *scene)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  *scene = m->scene;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCheckScene(HycoROM m, HycoScene scene)
{
  unsigned long long hash;
  char text[32];

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCall(HycoSceneFingerprint(scene, &hash));
  snprintf(text, sizeof(text), "%016llx", hash);
  HycoCheck(
      strcmp(text, m->fingerprint) == 0,
      "%s was trained on another scene or mesh; give the scene, the mesh and the entries that it was trained with",
      m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetReconstruct(HycoROM m, PetscBool reconstruct)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  m->reconstruct = reconstruct;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetExtrapolate(HycoROM m, PetscBool extrapolate)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoSceneSetExtrapolate(m->scene, extrapolate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetMonitor(HycoROM m, HycoMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoROMSetUp(m));
  PetscCall(HycoSolverSetMonitor(m->solver, monitor, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSolved(HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before asking for its results");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of U's free unknowns u^T K u / 2, and the same without K's couplings: what round-off is relative to. */
static PetscErrorCode QuadraticForm(HycoROM m, PetscReal *energy, PetscReal *size)
{
  const PetscInt *ia, *ja;
  const PetscScalar *a;
  PetscInt n;
  PetscBool done;

  PetscFunctionBegin;
  *energy = *size = 0;
  PetscCall(MatGetRowIJ(m->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(MatSeqAIJGetArrayRead(m->K, &a));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal sum = 0;

    if (m->U[i] == 0) continue;
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++) {
      sum += a[k] * m->U[ja[k]];
      if (ja[k] == i) *size += a[k] * m->U[i] * m->U[i] / 2;
    }
    *energy += m->U[i] * sum / 2;
  }
  PetscCall(MatSeqAIJRestoreArrayRead(m->K, &a));
  PetscCall(MatRestoreRowIJ(m->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the RID's cells: from K, or cell by cell where K lacks the supports' part or a rigid motion drowns it: beyond 1e-5
   round-off would leave fewer than ten digits. */
PetscErrorCode HycoROMGetStrainEnergy(HycoROM m, PetscReal *energy)
{
  PetscReal *each, size = 0;

  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  *energy = 0;
  if (m->K && !m->table && !m->fe->lifted) PetscCall(QuadraticForm(m, energy, &size));
  if (m->K && !m->table && !m->fe->lifted && *energy >= 1e-5 * size) PetscFunctionReturn(PETSC_SUCCESS);
  *energy = 0;
  PetscCall(PetscMalloc1(m->mesh->n_cells, &each));
  PetscCall(HycoFEEnergy(m->fe, m->U, each));
  for (PetscInt e = 0; e < m->mesh->n_cells; e++) *energy += each[e];
  PetscCall(PetscFree(each));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums over the contacts that may carry a force. */
static void SumForces(HycoROM m, HycoPrediction *p)
{
  const PetscInt n = m->spread ? m->pairs.n : m->m;

  p->n_active = p->n_rid_active = 0;
  p->total_contact_force = p->lambda_max = p->lambda_norm2 = p->covered_force = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt k = m->spread ? i : m->contact[i];

    p->total_contact_force += m->Lambda[k];
    if (m->in_rid[k]) p->covered_force += m->Lambda[k];
    p->lambda_max = PetscMax(p->lambda_max, m->Lambda[k]);
    p->lambda_norm2 += m->Lambda[k] * m->Lambda[k];
  }
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt k = m->spread ? i : m->contact[i], presses = m->Lambda[k] > 1e-10 * p->lambda_max; /* no round-off */

    p->n_active += presses;
    if (m->in_rid[k]) p->n_rid_active += presses;
  }
  p->covered_force = p->total_contact_force > 0 ? p->covered_force / p->total_contact_force : 1;
  p->lambda_norm2 = PetscSqrtReal(p->lambda_norm2);
}

static PetscErrorCode MeasureContacts(HycoROM m, HycoPrediction *p)
{
  HycoContactState state;

  PetscFunctionBegin;
  PetscCall(HycoContactMeasure(m->fe, m->condensed ? &m->pairs : &m->own_pairs, m->U, m->Lambda, m->contact, &state));
  p->n_facing = state.n_facing;
  p->overlap = state.overlap;
  p->sliding = state.sliding;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses of the RID's cells and the numbers that need them or the reconstruction. */
PetscErrorCode HycoROMGetPrediction(HycoROM m, HycoPrediction *out)
{
  HycoPrediction *p;

  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  p = &m->prediction;
  p->dim = m->fe->dim;
  p->n_dof = m->n;
  p->type = m->type;
  p->n_multipliers = m->n_L;
  p->n_contacts = m->m;
  p->n_all_contacts = m->pairs.n;
  p->n_modes = m->l;
  p->n_fe_dofs = m->n_fe;
  p->rid_nodes = 0;
  for (PetscInt i = 0; i < m->fe->mesh->n_nodes; i++) p->rid_nodes += m->role[i] != HYCO_ROLE_OUTSIDE;
  p->rid_elements = m->mesh->n_cells;
  p->rid_fraction = (PetscReal)m->mesh->n_cells / m->whole_cells;
  p->condition = m->numbers[0];
  SumForces(m, p);
  p->u_norm2 = 0;
  for (PetscInt c = 0; c < 3; c++) p->u_min[c] = p->u_max[c] = 0;
  for (PetscInt k = 0, first = 1; k < m->fe->n_dof; k++) {
    const PetscInt c = k % p->dim;

    if (m->role[k / p->dim] == HYCO_ROLE_OUTSIDE) continue;
    if (first) p->u_min[c] = p->u_max[c] = m->U[k];
    if (c == p->dim - 1) first = 0;
    p->u_min[c] = PetscMin(p->u_min[c], m->U[k]);
    p->u_max[c] = PetscMax(p->u_max[c], m->U[k]);
    p->u_norm2 += m->U[k] * m->U[k];
  }
  p->u_norm2 = PetscSqrtReal(p->u_norm2);
  PetscCall(MeasureContacts(m, p));
  PetscCall(HycoTrustEstimate(m, p));
  *out = *p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetRID(HycoROM m, PetscInt *n_nodes, const PetscInt *node_ids[], const PetscReal *U[],
                             PetscInt *n_cells, const PetscInt *cell_ids[], const PetscReal *sigma[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  if (n_nodes) *n_nodes = m->mesh->n_nodes;
  if (node_ids) *node_ids = m->mesh->node_id;
  if (U) PetscCall(HycoROMComplete(m));
  if (U) *U = m->U;
  if (n_cells) *n_cells = m->mesh->n_cells;
  if (cell_ids) *cell_ids = m->mesh->cell_id;
  if (sigma) {
    PetscCall(HycoFEStress(m->fe, m->U, m->stress));
    *sigma = m->stress;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetLambda(HycoROM m, PetscInt *n_contacts, const PetscReal *Lambda[], const PetscInt *node_ids[],
                                const PetscInt *in_rid[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  if (n_contacts) *n_contacts = m->pairs.n;
  if (Lambda) *Lambda = m->Lambda;
  if (node_ids) *node_ids = m->slave_id;
  if (in_rid) *in_rid = m->in_rid;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U = r(u0) + V gamma (30), with the full-order values where there are any. */
PetscErrorCode HycoROMGetWholeU(HycoROM m, PetscInt *n_nodes, const PetscReal *U[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  if (!m->whole) PetscCall(HycoROMLoadWhole(m));
  if (!m->whole_current) {
    const PetscInt dim = m->fe->dim;

    PetscCall(HycoFESetParameters(m->fe_whole, m->fe->mu));
    for (PetscInt k = 0; k < m->fe_whole->n_dof; k++) {
      PetscReal sum = m->fe_whole->u0[k];

      for (PetscInt j = 0; j < m->l; j++) sum += m->V_whole[k * m->l + j] * m->gamma[j];
      m->U_whole[k] = sum;
    }
    for (PetscInt k = 0; k < m->n_fe; k++)
      m->U_whole[m->mesh->node_whole[m->fe_dof[k] / dim] * dim + m->fe_dof[k] % dim] = m->U[m->fe_dof[k]];
    m->whole_current = PETSC_TRUE;
  }
  if (n_nodes) *n_nodes = m->whole->n_nodes;
  if (U) *U = m->U_whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMWrite(HycoROM m, const char path[])
{
  const PetscReal *U;
  PetscReal *rid;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMGetWholeU(m, NULL, &U));
  PetscCall(PetscCalloc1(m->whole->n_cells, &rid));
  for (PetscInt e = 0; e < m->mesh->n_cells; e++) rid[m->mesh->cell_whole[e]] = 1;
  ierr = HycoSolutionWrite(path, m->fe_whole, &m->whole_pairs, U, m->Lambda, rid);
  PetscCall(PetscFree(rid));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ViewScan(HycoROM m, PetscViewer viewer)
{
  PetscFunctionBegin;
  if (!m->scan.n) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not scanned for a singular reduced stiffness\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "  scanned at %d points: smallest singular value %.2e of the largest",
                                   (int)m->scan.n, (double)m->scan.smallest));
  for (PetscInt p = 0; p < m->scene->n_parameters; p++)
    PetscCall(
        PetscViewerASCIIPrintf(viewer, "%s %s = %.6g", p ? "," : " at", m->scene->parameter[p], (double)m->scan.at[p]));
  if (m->scan.n_singular)
    PetscCall(PetscViewerASCIIPrintf(viewer, "; SINGULAR inside the ranges: the determinant has the other sign at %d",
                                     (int)m->scan.n_singular));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The RID, what is full order in it, what the reconstruction has. */
static PetscErrorCode ViewHybrid(HycoROM m, PetscViewer viewer)
{
  static const char *const words[] = {"auto", "rank: the fewest that give full row rank",
                                      "contact: all on the contact surfaces of the RID",
                                      "all of A, interface by ridge regression on the modes"};
  PetscInt nodes = 0, a = 0, in = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    nodes += m->role[i] != HYCO_ROLE_OUTSIDE;
    a += m->role[i] == HYCO_ROLE_A;
  }
  for (PetscInt k = 0; k < m->pairs.n; k++) in += m->in_rid[k];
  PetscCall(PetscViewerASCIIPrintf(viewer, "  modes that seeded the RID besides: %d dual, %d stress, %d force\n",
                                   (int)m->counts[0], (int)m->counts[1], (int)m->counts[2]));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  RID: %d of %d elements (%.1f %%), %d of %d nodes, %d in A; %d of %d contacts\n", (int)m->mesh->n_cells,
      (int)m->whole_cells, 100. * (double)m->mesh->n_cells / (double)m->whole_cells, (int)nodes, (int)m->whole_nodes,
      (int)a, (int)in, (int)m->pairs.n));
  if (m->pairs.n)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  full-order displacements: %d (%s)\n", (int)m->n_fe, words[m->hybrid]));
  if (m->hybrid == HYCO_HYBRID_ALL && m->G)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  ridge: %.0e of the first squared singular value\n", (double)m->ridge));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  dual snapshots for the reconstruction: %d\n", (int)m->n_dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMView(HycoROM m, PetscViewer viewer)
{
  static const char *const words[] = {"hybrid hyper-reduced", "projection-based", "condensed"};
  PetscInt pod;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  pod = m->type == HYCO_ROM_PROJECTION ? m->l - m->counts[1] : m->l;
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s model\n", words[m->type]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  trained on %d points; mean training errors: u %.2e, %sforces %.2e\n",
                                   (int)m->n_points, (double)m->numbers[1], m->type == HYCO_ROM_HYBRID ? "RID " : "",
                                   (double)m->numbers[2]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  displacement modes: %d (first singular value %.4g, last %.4g)\n",
                                   (int)pod, pod ? (double)m->sigma[0] : 0., pod ? (double)m->sigma[pod - 1] : 0.));
  if (m->type == HYCO_ROM_HYBRID)
    PetscCall(ViewHybrid(m, viewer));
  else
    PetscCall(m->condensed ? HycoCondensedView(m, viewer) : HycoProjectionView(m, viewer));
  if (m->numbers[0] > 0) /* else too large to be known */
    PetscCall(PetscViewerASCIIPrintf(viewer, "  condition of the reduced stiffness: %.2e\n", (double)m->numbers[0]));
  if (m->table) PetscCall(HycoTableView(m, viewer));
  if (m->type == HYCO_ROM_HYBRID) PetscCall(ViewScan(m, viewer));
  PetscCall(HycoTrustView(m, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s", m->provenance));
  PetscCall(HycoSceneView(m->scene, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoROM, HYCO_ROM_CLASSID)
