/*
  The offline phase (sections 4.1, 4.2, 5): snapshots -> POD -> DEIM -> RID -> sets -> reduced model -> file. The mesh
  and the snapshot matrices are distributed over the ranks; the reduced mesh and the model are on rank 0.
*/
#include <hycoalgorithms.h>
#include <hycofile.h>
#include <hycoreducerimpl.h>
#include <string.h>

/* Reads the distributed mesh, its contacts on rank 0, its sizes on all ranks. Without matrices: training makes
   full-order models of its own for the solutions. */
static PetscErrorCode ReadMesh(HycoReducer t)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt group = 0;
  HycoFOM f;

  PetscFunctionBegin;
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMCreateMesh(HycoComm(t), t->scene, &t->fom));
  f = t->fom;
  HycoCheck(
      !t->scene->n_times || !f->searches,
      "the scene has a history, and a map moves a contact surface (type surface or mortar); reduced models do not "
      "support this: draw the bodies where the map puts them, use type pair, or solve at full order by hyco solve -mu");
  for (PetscInt k = 0; k < t->n_groups; k++)
    HycoOnRoot(HycoComm(t), HycoMeshFindGroup(f->part, "hyco_rid_groups", t->groups[k], &group));
  t->sizes[0] = f->n_nodes;
  t->sizes[1] = f->n_cells;
  t->sizes[2] = f->n_contacts;
  t->sizes[3] = f->part->dim;
  /* Supports and contacts of the mesh are known at parameters only; the first column's serve. */
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For moved surfaces, finds in t->met every contact's masters at the training points and over the ranges, as far as
   contacts may close. Rank 0. The reach comes first: it limits the search of the second to masters that a closing
   contact may meet. */
static PetscErrorCode BuildMasters(HycoReducer t, HycoROM m)
{
  HycoFOM f = t->fom;
  PetscInt n;
  const PetscReal *mu;

  PetscFunctionBegin;
  if (!f->searches) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->columns, &n, NULL, &mu));
  PetscCall(HycoMetDestroy(&t->met));
  PetscCall(PetscMalloc1(t->scene->n_contacts, &m->model->master_reach));
  PetscCall(HycoMetReach(t->scene, f->surface, &f->pairs, n, mu, t->Lambda, m->model->master_reach));
  PetscCall(HycoMetFind(t->scene, f->surface, &f->pairs, n, mu, m->model->master_reach, &t->met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also the groups of which the model's mesh has all facets, whether or not it has their cells: all[3 n_contacts]. */
static PetscErrorCode SurfacesOf(HycoReducer t, PetscBool contact[], PetscInt *n_all, PetscInt all[])
{
  HycoMesh surface = t->fom->surface;

  PetscFunctionBegin;
  HycoPairsMark(&t->fom->pairs, contact);
  PetscCall(HycoMovedGroups(t->scene, surface, &t->fom->pairs, n_all, all));
  /* Moved surfaces whole: a slave may meet any of their facets at some parameter. */
  for (PetscInt g = 0; g < *n_all; g++) {
    for (PetscInt k = surface->group_start[all[g]]; k < surface->group_start[all[g] + 1]; k++)
      contact[surface->group_node[k]] = PETSC_TRUE;
  }
  /* Slave groups whole as well: areas and averaged normals read all facets around a node. */
  for (PetscInt k = 0; k < t->scene->n_contacts; k++)
    PetscCall(HycoMeshFindGroup(surface, "contact", t->scene->contact[k]->slave, &all[(*n_all)++]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 3 groups a contact: slave and master of a moved one, and every slave. Marks the nodes of the surfaces' mesh that the
   model's contacts have, by the same rule as CutMesh(). */
PetscErrorCode HycoReducerMarkContacts(HycoReducer t, PetscBool contact[])
{
  PetscInt *all, n_all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * t->scene->n_contacts, &all));
  PetscCall(SurfacesOf(t, contact, &n_all, all));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells of the part in Omega_A; in greedy training also those of the previous RIDs. Collective. */
static PetscErrorCode FindCells(HycoReducer t, PetscBool in[])
{
  const HycoRIDSettings settings = {t->n_seeds_node, t->n_seeds_cell, t->seeds_node, t->seeds_cell,
                                    t->layers,       t->extension,    t->n_groups,   t->groups,
                                    t->plane,        t->region,       t->whole_rid,  t->prototype->model->traits.cells};
  HycoMesh part = t->fom->part;
  DMLabel rid;

  PetscFunctionBegin;
  /* Moved contacts have as many rows as masters that they meet over the ranges: the RID must have all of these. */
  HycoLogged(HYCO_EVENT_RID, HycoRIDBuild(t->fom, t->fom->searches ? &t->met.rows : &t->fom->pairs, &settings, &rid));
  for (PetscInt e = 0; e < part->n_cells; e++) {
    PetscCall(DMLabelStratumHasPoint(rid, HYCO_RID, part->cell_point[e], &in[e]));
    /* Greedy: an RID that loses cells from one iteration to the next would make the indicator jump. */
    if (t->grown) t->grown[e] = in[e] = (PetscBool)(in[e] || t->grown[e]);
  }
  PetscCall(DMLabelDestroy(&rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the model's mesh has the surfaces of loads. A cubature takes the work of surface loads from all of their
   facets, whether or not their cells have weights. */
static PetscBool LoadedSurfaces(HycoReducer t)
{
  return (PetscBool)(t->prototype->model->traits.cells && !t->prototype->model->traits.surfaces);
}

/* Gathers the RID's cells and the contacts' surfaces on rank 0; elsewhere NULL. */
static PetscErrorCode GatherCells(HycoReducer t, const PetscBool in[], HycoMesh *mesh)
{
  HycoMesh part = t->fom->part;
  PetscBool *group;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(part->n_groups, &group));
  PetscCall(HycoMarkContactGroups(t->scene, part, group));
  /* Facets with loads: a model of cells alone must integrate tractions on them. */
  for (PetscInt k = 0; LoadedSurfaces(t) && k < t->scene->n_loads; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(part, "load", t->scene->load[k].group, &g));
    group[g] = PETSC_TRUE;
  }
  PetscCall(HycoMeshGather(t->scene, part, group, in, mesh));
  PetscCall(PetscFree(group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* node[i]: the node of m that is node i of the contacts' surfaces, or -1. Rank 0. Through the numbers in the whole
   mesh, by which both meshes know their nodes. */
static PetscErrorCode FindSurface(HycoMesh surface, HycoMesh m, PetscInt node[])
{
  PetscInt *whole, *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n_nodes, &whole, m->n_nodes, &at));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    whole[i] = m->node_whole ? m->node_whole[i] : i;
    at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(m->n_nodes, whole, at));
  for (PetscInt i = 0; i < surface->n_nodes; i++) {
    PetscCall(PetscFindInt(surface->node_whole ? surface->node_whole[i] : i, m->n_nodes, whole, &node[i]));
    /* -1: a surface node that the RID does not contain. */
    node[i] = node[i] < 0 ? -1 : at[node[i]];
  }
  PetscCall(PetscFree2(whole, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model's mesh of the cells in[] (NULL: all) of `from`: these, their nodes, the nodes and surfaces of every
   contact; its nodes' numbers in the distributed vectors; for each node of the surfaces its node of that mesh (-1:
   none). Rank 0. */
static PetscErrorCode CutMesh(HycoReducer t, HycoMesh from, const PetscBool in[], HycoROM m, PetscInt **global)
{
  HycoMesh surface = t->fom->surface;
  PetscBool *contact;
  PetscInt *keep, *extra, *all, n_keep = 0, n_extra = 0, n_all = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(surface->n_nodes, &contact));
  PetscCall(PetscMalloc1(3 * t->scene->n_contacts + t->scene->n_loads, &all));
  PetscCall(PetscMalloc2(from->n_cells, &keep, surface->n_nodes, &extra));
  PetscCall(SurfacesOf(t, contact, &n_all, all));
  /* Pressures act on whole groups of facets, some of which have no kept cell. */
  for (PetscInt k = 0; LoadedSurfaces(t) && k < t->scene->n_loads; k++)
    PetscCall(HycoMeshFindGroup(from, "load", t->scene->load[k].group, &all[n_all++]));
  for (PetscInt e = 0; e < from->n_cells; e++) {
    if (!in || in[e]) keep[n_keep++] = e;
  }
  PetscCall(FindSurface(surface, from, extra));
  for (PetscInt i = 0; i < surface->n_nodes; i++) {
    if (contact[i]) extra[n_extra++] = extra[i];
  }
  PetscCall(HycoSubmesh(t->scene, from, n_keep, keep, n_extra, extra, n_all, all, &m->model->mesh));
  PetscCall(PetscMalloc1(m->model->mesh->n_nodes, global));
  PetscCall(HycoSubmeshNodes(m->model->mesh, from, *global));
  /* On one rank local and global numbers are the same, and there is no table. */
  for (PetscInt i = 0; i < m->model->mesh->n_nodes && from->node_global; i++)
    (*global)[i] = from->node_global[(*global)[i]];
  PetscCall(PetscFree(t->surface_node));
  PetscCall(PetscMalloc1(surface->n_nodes, &t->surface_node));
  PetscCall(FindSurface(surface, m->model->mesh, t->surface_node));
  PetscCall(PetscFree2(keep, extra));
  HycoFreeAll(&all, &contact);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Known only on a node's own rank: whether it has a cell outside Omega_A, and which of its components are fixed. */
#define BESIDE 8

/* What rank 0 must know about the RID's nodes, which other ranks own: which components are fixed, and whether a cell
   outside the RID has the node, which is then on the interface. Bits: a fixed component each, and BESIDE for a cell
   outside. */
static PetscErrorCode FetchNotes(HycoReducer t, const PetscBool in[], PetscInt n, const PetscInt global[],
                                 PetscInt note[])
{
  HycoMesh part = t->fom->part;
  HycoFE fe = t->fom->fe;
  PetscInt *of, *own, node[HYCO_MAX_CELL_NODES];
  PetscSF sf;

  PetscFunctionBegin;
  /* By owned node; a cell of Omega_B at a node of this rank is always in its part, because parts overlap by a
     layer. */
  PetscCall(PetscCalloc2(part->n_nodes, &of, part->n_owned, &own));
  for (PetscInt k = 0; k < fe->n_dof; k++) of[k / fe->dim] |= fe->fixed[k] ? 1 << k % fe->dim : 0;
  for (PetscInt e = 0; e < part->n_cells; e++) {
    const PetscInt n_nodes = HycoMeshCellNodes(part, e, node);

    for (PetscInt v = 0; v < n_nodes; v++) of[node[v]] |= in[e] ? 0 : BESIDE;
  }
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    if (HycoMeshOwned(part, i) >= 0) own[HycoMeshOwned(part, i)] = of[i];
  }
  PetscCall(HycoMeshNodeSF(HycoComm(t), part, n, global, &sf));
  PetscCall(HycoSFBcast(sf, MPIU_INT, 1, own, note));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree2(of, own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the model's index sets from these data. Rank 0. */
static PetscErrorCode TakeSets(HycoReducer t, HycoROM m, const PetscInt note[])
{
  HycoFOM f = t->fom;
  const PetscInt n = m->model->mesh->n_nodes, dim = m->model->mesh->dim;
  PetscInt *sets;

  PetscFunctionBegin;
  PetscCall(PetscFree(t->fixed));
  PetscCall(PetscMalloc1(n * dim, &t->fixed));
  /* The first bits of a node's note say which components are fixed, as found by the rank that owns it. */
  for (PetscInt k = 0; k < n * dim; k++) t->fixed[k] = (PetscBool)((note[k / dim] >> k % dim & 1) != 0);
  PetscCall(PetscCalloc1(n, &sets));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) { /* whether connected to Omega_B */
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n_nodes = HycoMeshCellNodes(m->model->mesh, e, node);

    /* A node beside cells of Omega_B is on the interface. */
    for (PetscInt v = 0; v < n_nodes; v++) sets[node[v]] = note[node[v]] & BESIDE ? 1 : 2;
  }
  PetscCall(PetscMalloc1(f->n_contacts, &m->model->in_rid));
  /* Contacts next: masters outside the RID take their slaves to the interface, (32)-(36). */
  PetscCall(HycoRIDSets(f->fe_surface, &f->pairs, f->searches ? &t->met.rows : &f->pairs,
                        f->searches ? t->met.of : NULL, t->surface_node, n, sets, m->model->in_rid));
  PetscCall(HycoROMSetDomain(m, sets));
  PetscCall(PetscFree(sets));
  PetscCall(HycoPairsRenumber(&f->pairs, t->surface_node, &m->model->pairs));
  PetscCall(PetscMalloc1(f->pairs.n + 1, &m->model->facet));
  PetscCall(HycoContactFacets(f->fe_surface, &f->pairs, m->model->facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses Omega_A on all ranks; creates on rank 0 the reduced mesh and its sets. Collective; m: on rank 0. */
static PetscErrorCode CutDomain(HycoReducer t, HycoROM m)
{
  HycoMesh gathered = NULL;
  PetscBool *in;
  PetscInt *global = NULL, *note, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->fom->part->n_cells, &in));
  PetscCall(FindCells(t, in));
  /* On one rank the part is the whole mesh, which is cut without a copy in between. */
  if (t->fom->size == 1)
    PetscCall(CutMesh(t, t->fom->part, in, m, &global));
  else {
    PetscCall(GatherCells(t, in, &gathered));
    HycoOnRoot(HycoComm(t), CutMesh(t, gathered, NULL, m, &global));
    PetscCall(HycoMeshDestroy(&gathered));
  }
  if (m) n = m->model->mesh->n_nodes;
  PetscCall(PetscMalloc1(n, &note));
  PetscCall(FetchNotes(t, in, n, global, note));
  /* Only rank 0 has m: the sets are of a mesh on one process. */
  HycoOnRoot(HycoComm(t), TakeSets(t, m, note));
  HycoFreeAll(&note, &global, &in);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact forces of the training solutions; the caller frees them. Room for all columns, since the number is known at
   the end. */
PetscErrorCode HycoReducerDualSnapshots(HycoReducer t, PetscInt *n, PetscReal **S)
{
  /* Columns without any force would only slow down NNMF and NNLS. */
  const size_t N = (size_t)t->sizes[2];

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscMalloc1(N * (size_t)t->n_s + 1, S));
  for (PetscInt k = 0; k < t->n_s; k++) {
    const PetscReal *L = t->Lambda + (size_t)k * N;
    PetscReal size = 0;

    for (size_t i = 0; i < N; i++) size += L[i];
    if (size > 0) PetscCall(PetscArraycpy(*S + (size_t)(*n)++ * N, L, N));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed arrays, a column for each training point. */
PetscErrorCode HycoReducerGetSolutions(HycoReducer t, PetscInt *n, const PetscReal *mu[], const PetscReal *Lambda[],
                                       const PetscReal *gamma[])
{
  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  PetscCall(HycoSamplesGet(t->columns, n, NULL, mu));
  if (Lambda) *Lambda = t->Lambda;
  if (gamma) *gamma = t->VtU;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facts are numbers of one type of model, which the report lists under their names without knowing the type. */
PetscErrorCode HycoTrainingAddFact(HycoTraining *r, const char name[], PetscReal value)
{
  HycoFact *fact = &r->fact[r->n_facts++];

  PetscFunctionBegin;
  PetscCheck(r->n_facts <= HYCO_MAX_FACTS, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "a type of model reports too many quantities");
  PetscCall(PetscStrncpy(fact->name, name, sizeof(fact->name)));
  fact->n = 1;
  fact->value[0] = value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Greedy: with more modes than unknowns in A, some would have no equation. Collective; m: on rank 0. The matrix of
   (31), V[A]^T K[A,A+I] V[A+I], has at most the rank |A|. VtU's columns are moved to the new length from the first
   on. */
static PetscErrorCode LimitModes(HycoReducer t, HycoROM m)
{
  const PetscInt dim = t->sizes[3], l = t->l, *node;
  PetscInt n, n_A = 0;

  PetscFunctionBegin;
  if (!t->grown) PetscFunctionReturn(PETSC_SUCCESS);
  if (m) {
    PetscCall(ISGetLocalSize(m->model->inside, &n));
    PetscCall(ISGetIndices(m->model->inside, &node));
    for (PetscInt k = 0; k < n * dim; k++) n_A += !t->fixed[node[k / dim] * dim + k % dim];
    PetscCall(ISRestoreIndices(m->model->inside, &node));
  }
  /* Only rank 0 has the sets, but all ranks have the bases that become shorter. */
  PetscCallMPI(MPI_Bcast(&n_A, 1, MPIU_INT, 0, HycoComm(t)));
  if (n_A >= l || !n_A) PetscFunctionReturn(PETSC_SUCCESS);
  t->l = n_A;
  for (PetscInt k = 1; k < t->n_s; k++) PetscCall(PetscArraymove(t->VtU + k * n_A, t->VtU + k * l, n_A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the modes on the reduced mesh, the training points, and the origin of the data. */
static PetscErrorCode FillModel(HycoReducer t, HycoROM m)
{
  const PetscInt n_dof = m->model->mesh->n_nodes * t->sizes[3];
  PetscInt n_par;
  const PetscReal *mu;
  char *text;
  char line[2 * HYCO_LINE];

  PetscFunctionBegin;
  /* The points, not the columns: the region of training is theirs. */
  PetscCall(HycoSamplesGet(t->samples, &m->model->n_points, &n_par, &mu));
  m->model->l = t->l;
  HycoDuplicate(t->l, t->sigma, &m->model->sigma);
  PetscCall(PetscMalloc1(n_dof * m->model->l, &m->model->V));
  for (PetscInt i = 0; i < n_dof; i++) {
    for (PetscInt j = 0; j < m->model->l; j++) m->model->V[i * m->model->l + j] = t->V_rid[j * n_dof + i];
  }
  HycoDuplicate(m->model->n_points * n_par, mu, &m->model->points);
  m->model->n_stops = t->n_stops;
  m->model->time_error = t->stops_error;
  HycoDuplicate(t->n_stops, t->stops, &m->model->stops);
  m->model->whole_nodes = t->sizes[0];
  m->model->whole_cells = t->sizes[1];
  m->model->counts[0] = t->counts[HYCO_SEED_DUAL];
  m->model->counts[1] = t->counts[HYCO_SEED_STRESS];
  m->model->counts[2] = t->counts[HYCO_SEED_FORCE];
  snprintf(line, sizeof(line), "  written by hyco %s with PETSc %d.%d.%d\n", HycoVersion(), PETSC_VERSION_MAJOR,
           PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR);
  PetscCall(PetscStrallocpy(line, &m->model->provenance));
  snprintf(m->model->fingerprint, sizeof(m->model->fingerprint), "%016llx", t->fingerprint);
  /* the model has its own scene, read from the text stored in its file */
  PetscCall(HycoSceneToText(t->scene, &text));
  PetscCall(HycoSceneFromText(PETSC_COMM_SELF, text, &m->model->scene));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills the report from the built model; the numbers of the last iteration of a greedy training are overwritten.
   t->columns differs from t->samples if the bases are those of held-out points: then there is no training
   solution. */
static PetscErrorCode BuildReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  PetscFunctionBegin;
  r->n_facts = 0; /* of the previous iteration */
  r->stiffness = m->model->traits.stiffness;
  r->chosen.settings.rid = (PetscBool)(m->model->traits.settings == HYCO_SETTINGS_RID);
  r->n_samples = t->columns == t->samples ? m->model->n_points : 0;
  r->n_modes = t->l;
  r->n_dual_modes = t->counts[HYCO_SEED_DUAL];
  r->n_stress_modes = t->counts[HYCO_SEED_STRESS];
  r->n_force_modes = t->counts[HYCO_SEED_FORCE];
  r->n_fe_dofs = m->model->n_fe;
  r->rid_contacts = 0;
  PetscCall(ISGetLocalSize(m->model->rid, &r->rid_nodes));
  PetscCall(ISGetLocalSize(m->model->inside, &r->rid_a_nodes));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) r->rid_contacts += m->model->in_rid[k];
  r->rid_elements = m->model->mesh->n_cells;
  r->rid_fraction = (PetscReal)m->model->mesh->n_cells / m->model->whole_cells;
  r->condition = m->model->numbers[0];
  r->error_u = m->model->numbers[1];
  r->error_lambda = m->model->numbers[2];
  if (t->trainer.report) PetscCall((*t->trainer.report)(t, m, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a model without a contact in its RID whose training solutions have contact forces, if it reconstructs
   forces from those in the RID. */
static PetscErrorCode CheckForces(HycoReducer t, HycoROM m)
{
  PetscBool presses = PETSC_FALSE, kept = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoOptionsInherit((PetscObject)t->prototype, (PetscObject)t));
  PetscCall(HycoROMSetFromOptions(t->prototype)); /* as for the model's predictions */
  /* One contact suffices here: how well the RID covers the force is judged on held-out points. */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) kept = (PetscBool)(kept || m->model->in_rid[k]);
  for (PetscInt k = 0; k < t->n_s * m->model->pairs.n; k++) presses = (PetscBool)(presses || t->Lambda[k] > 0);
  HycoCheckModel(!m->ops->reconstruct || !t->prototype->reconstruct || kept || !presses,
                 "the RID has no contact, and the training solutions have contact forces, so that the model would give "
                 "none; extend the RID to the contact (-hyco_rid_modes displacement,dual or -hyco_rid_groups GROUP), "
                 "or predict displacements only by -hyco_reconstruct false");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a cubature takes the scene's contacts and ties, for advice to try it. Not collective. */
PetscErrorCode HycoReducerTakesCubature(HycoReducer t, PetscBool *takes)
{
  HycoROM type;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&type));
  PetscCall(HycoROMSetType(type, "cubature"));
  *takes = (PetscBool)(t->scene->n_times && !t->scene->n_ties);
  for (PetscInt k = 0; k < t->scene->n_contacts; k++) {
    const HycoContact contact = t->scene->contact[k];

    *takes = (PetscBool)(*takes && (type->model->traits.integrals || !contact->integrated) &&
                         (type->model->traits.friction || !contact->friction));
  }
  PetscCall(HycoROMDestroy(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a model whose errors on its own training solutions reach one half. */
static PetscErrorCode CheckUseful(HycoReducer t, HycoROM m)
{
  char worst[HYCO_LINE] = "";
  PetscBool cubature;

  PetscFunctionBegin;
  PetscCall(HycoReducerTakesCubature(t, &cubature));
  /* `!(x < 0.5)` also refuses NaN. */
  if (!(m->model->numbers[1] < 0.5)) HycoReducerNameWorst(t, worst);
  HycoCheckModel(m->model->numbers[1] < 0.5,
                 "the model misses its own training displacements by %.0f %% on average (RID %d elements, %d modes, "
                 "condition %.0e)%s: enlarge the RID (-hyco_rid_layers 1, -hyco_rid_contact_extension LENGTH), or use "
                 "fewer modes (-hyco_pod_tol)%s",
                 100 * (double)m->model->numbers[1], (int)m->model->mesh->n_cells, (int)m->model->l,
                 (double)m->model->numbers[0], worst, cubature ? ", or -hyco_model_type cubature" : "");
  PetscCall(CheckForces(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Notes the contacts that have a force in some training solution. */
static PetscErrorCode TakeClosed(HycoReducer t, HycoROM m)
{
  const PetscInt N = m->model->pairs.n;

  PetscFunctionBegin;
  PetscCall(PetscFree(m->model->closed));
  PetscCall(PetscCalloc1(N, &m->model->closed));
  for (PetscInt k = 0; k < t->n_s; k++) {
    const PetscReal *L = t->Lambda + (size_t)k * (size_t)N;
    /* Relative to each solution's own largest: small loads close contacts too. */
    PetscReal most = 0;

    for (PetscInt i = 0; i < N; i++) most = PetscMax(most, L[i]);
    for (PetscInt i = 0; i < N; i++) m->model->closed[i] = m->model->closed[i] || L[i] > HYCO_FORCE_ROUND_OFF * most;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: builds the model on its RID, without online data. The model has been set up for judging: HycoROMReset()
   frees its online data, of which the file needs nothing, and a first prediction makes them again. */
static PetscErrorCode BuildModel(HycoReducer t, PetscBool useful, HycoROM m, HycoTraining *report)
{
  PetscFunctionBegin;
  PetscCall(FillModel(t, m));
  PetscCall((*t->trainer.build)(m, t));
  PetscCall(TakeClosed(t, m));
  /* Only for a model that will be used: a greedy iteration may pass through poor ones. */
  if (useful) PetscCall(CheckUseful(t, m));
  PetscCall(BuildReport(t, m, report));
  PetscCall(HycoROMReset(m));
  PetscCall(HycoOptionsInherit((PetscObject)m, (PetscObject)t));
  PetscCall(HycoROMSetFromOptions(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: creates a model with the masters that its contacts meet. The masters first: the mesh's cut keeps the surfaces
   that they lie on. */
static PetscErrorCode BeginOnRoot(HycoReducer t, HycoROM *model)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(model));
  ierr = HycoROMSetType(*model, t->prototype->model->type);
  if (!ierr) ierr = BuildMasters(t, *model);
  if (ierr) (void)!HycoROMDestroy(model);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model that failed half-built is destroyed here: the caller gets none. */
static PetscErrorCode BuildOnRoot(HycoReducer t, PetscBool useful, HycoROM *model, HycoTraining *report)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = BuildModel(t, useful, *model, report);
  if (ierr) (void)!HycoROMDestroy(model);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of the model's mesh whose displacements may stay full order: for types with settings of an RID those of A,
   and unless all of A is kept on the contacts' surfaces; for a cubature all; for other types none. Rank 0. */
static PetscErrorCode MarkJudged(HycoReducer t, HycoROM m, PetscBool judged[])
{
  const HycoROMTraits *traits = &t->prototype->model->traits;
  const PetscBool all = (PetscBool)(t->hybrid == HYCO_HYBRID_ALL);
  HycoMesh surface = t->fom->surface;
  PetscInt *sets;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->model->mesh->n_nodes; i++) judged[i] = (PetscBool)(traits->cells || all);
  /* Contact nodes, whose displacements `rank` and `contact` choose from. */
  for (PetscInt i = 0; surface && i < surface->n_nodes; i++) {
    if (t->surface_node[i] >= 0) judged[t->surface_node[i]] = PETSC_TRUE;
  }
  if (traits->cells) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->model->mesh->n_nodes, &sets));
  PetscCall(HycoROMGetDomain(m, sets));
  for (PetscInt i = 0; i < m->model->mesh->n_nodes; i++)
    judged[i] = (PetscBool)(judged[i] && (traits->surfaces || (traits->settings == HYCO_SETTINGS_RID && sets[i] == 2)));
  PetscCall(PetscFree(sets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fetches the snapshots' rows at these nodes to rank 0, where full-order displacements are judged: as few as possible,
   because they are a share of all snapshots on one rank. Collective. */
static PetscErrorCode FetchJudged(HycoReducer t, HycoROM m)
{
  const PetscInt n = m ? m->model->mesh->n_nodes : 0;
  PetscBool *judged;
  PetscInt *node;

  PetscFunctionBegin;
  HycoFreeAll(&t->U_rid, &t->rid_row);
  PetscCall(PetscMalloc1(n, &t->rid_row));
  PetscCall(PetscMalloc2(n, &judged, n, &node));
  t->n_rid_nodes = 0;
  if (m) PetscCall(MarkJudged(t, m, judged));
  for (PetscInt i = 0; i < n; i++) {
    t->rid_row[i] = judged[i] ? t->n_rid_nodes : -1;
    if (judged[i]) node[t->n_rid_nodes++] = m->model->mesh->node_whole[i];
  }
  /* Rows in the order of the list; rid_row says where each node's are. */
  PetscCall(HycoReducerFetchSnapshots(t, t->n_rid_nodes, node, &t->U_rid));
  PetscCall(PetscFree2(judged, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fetches to rank 0 the rows that the model is made of and judged by. Collective. */
static PetscErrorCode FetchOnModel(HycoReducer t, HycoROM m)
{
  const PetscInt n = m ? m->model->mesh->n_nodes : 0, *node = m ? m->model->mesh->node_whole : NULL;

  PetscFunctionBegin;
  PetscCall(FetchJudged(t, m));
  PetscCall(PetscFree(t->V_rid));
  PetscCall(PetscMalloc1((size_t)n * (size_t)t->sizes[3] * (size_t)t->l + 1, &t->V_rid));
  PetscCall(HycoReducerFetchRows(t, t->V, t->l, n, node, t->V_rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model of rank 0. Collective. */
static PetscErrorCode MakeModel(HycoReducer t, PetscBool useful, HycoROM *model, HycoTraining *report)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(t), BeginOnRoot(t, model));
  /* From here on collective calls: an error is the same on every rank, and the model of rank 0 is destroyed before
     it returns. */
  ierr = CutDomain(t, *model);
  if (!ierr) ierr = LimitModes(t, *model);
  if (!ierr) ierr = FetchOnModel(t, *model);
  if (!ierr) ierr = HycoReducerFindFloating(t, *model);
  if (ierr) (void)!HycoROMDestroy(model);
  PetscCall(ierr);
  HycoOnRoot(HycoComm(t), BuildOnRoot(t, useful, model, report));
  HycoFreeAll(&t->U_rid, &t->rid_row, &t->V_rid); /* before the other ranks' models, of which rank 0 has one too */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 builds from what has the RID's size, and all ranks get the bytes of its file: twice, because finish()
   scans on all ranks and adds its results. */
PetscErrorCode HycoReducerBuild(HycoReducer t, PetscBool useful, HycoROM *model, HycoTraining *report)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *model = NULL;
  HycoLogged(HYCO_EVENT_MODEL, MakeModel(t, useful, model, report)); /* ends on an error too: a search goes on */
  /* A report holds numbers and fixed arrays only; pointers in it are set anew below. */
  PetscCallMPI(MPI_Bcast(report, sizeof(*report), MPI_BYTE, 0, HycoComm(t)));
  report->type = report->chosen.settings.type = t->prototype->model->type; /* set on each rank */
  PetscCall(HycoROMBroadcast(HycoComm(t), model));
  if (!useful || !t->trainer.finish) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoLogEvent(HYCO_EVENT_SCAN, PETSC_TRUE));
  ierr = (*t->trainer.finish)(t, *model, report);
  PetscCall(HycoLogEvent(HYCO_EVENT_SCAN, PETSC_FALSE));
  /* A refused model (a singular stiffness) is not kept; the search goes on to the next. */
  if (ierr) (void)!HycoROMDestroy(model);
  PetscCall(ierr);
  /* Work arrays of the scan are made anew from the file's data on every rank. */
  PetscCall(HycoROMReset(*model));
  PetscCall(HycoROMBroadcast(HycoComm(t), model)); /* with the results */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One write at the very end: whatever fails before it leaves a model file of an earlier run as it was. */
PetscErrorCode HycoReducerFinish(HycoReducer t, HycoSnapshots store, const char path[], PetscBool learn,
                                 HycoTraining *report)
{
  HycoROM model = NULL;
  HycoSamples grown = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (learn)
    ierr = HycoReducerLearn(t, store, &model, &grown, report);
  else
    ierr = HycoReducerBuild(t, PETSC_TRUE, &model, report);
  /* Estimates are part of the model: they come before the file. */
  if (!ierr) ierr = HycoReducerCalibrate(t, store, model, report);
  PetscCall(HycoSamplesDestroy(&grown));
  if (!ierr) ierr = HycoROMSave(model, t->fom, t->l, t->V, path);
  PetscCall(HycoROMDestroy(&model));
  PetscCall(ierr);
  PetscCall(HycoSnapshotsDropPieces(store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks before the long computation that the model file can be written. */
static PetscErrorCode CheckWritable(const char path[])
{
  HycoFile probe;

  PetscFunctionBegin;
  PetscCall(HycoFileSweep(path));
  PetscCall(HycoFileCreate(path, HYCO_FILE_NUMBERS, &probe));
  PetscCall(HycoFileClose(&probe, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file is tried before hours of solutions; the mesh is read before the store, whose fingerprint contains it. */
PetscErrorCode HycoReducerOpen(HycoReducer t, HycoSamples samples, const char path[], HycoSnapshots *store)
{
  char folder[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  /* Nothing of a former training with the same handle may remain. */
  PetscCall(HycoReducerReset(t));
  t->samples = samples;
  /* The columns of bases are the training points, until types with modes of their own replace them. */
  PetscCall(HycoReducerSetColumns(t, samples));
  t->solving = 0;
  t->late = PETSC_FALSE;
  PetscCheck(t->n_s > 0, HycoComm(t), PETSC_ERR_USER, "the set of training points is empty");
  t->cpu_begin = HycoCPU();
  HycoOnRoot(HycoComm(t), CheckWritable(path));
  PetscCall(ReadMesh(t));
  if (t->folder[0])
    PetscCall(PetscStrncpy(folder, t->folder, sizeof(folder)));
  else
    PetscCall(PetscSNPrintf(folder, sizeof(folder), "%s.snapshots", path));
  PetscCall(HycoSnapshotsOpen(HycoComm(t), t->scene, folder, store));
  t->store = *store;
  t->fingerprint = (*store)->fingerprint;
  PetscCall(HycoReducerViewFromOptions(t, NULL, "-hyco_reducer_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts are copied, because the store owns them and ends here. */
PetscErrorCode HycoReducerClose(HycoReducer t, HycoSnapshots *store)
{
  const PetscInt *solved;
  const PetscReal *written;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetSolved(*store, &t->n_solvers, &solved));
  PetscCall(HycoSnapshotsGetBalance(*store, &t->unsolved, &written));
  t->sliding = (*store)->sliding;
  t->n_lost = (*store)->n_lost;
  HycoFormat(t->first_lost, "%s", (*store)->first_lost);
  t->cpu_solution = (*store)->cpu;
  t->time_error = (*store)->time_error;
  HycoFreeAll(&t->solved, &t->written);
  HycoDuplicate(t->n_solvers, solved, &t->solved);
  HycoDuplicate(HycoSize(HycoComm(t)), written, &t->written);
  t->store = NULL;
  PetscCall(HycoSnapshotsDestroy(store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points without an equilibrium leave the set. If that is most of them, the ranges are wrong, not the points; corners
   that are judged beside the held-out points may all be without. */
PetscErrorCode HycoReducerFill(HycoReducer t, HycoSnapshots store, HycoSamples points, HycoProgress progress)
{
  const PetscBool whole = (PetscBool)(points == t->samples || points == t->held);
  PetscInt n, left;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(points, &n, NULL, NULL));
  PetscCall(HycoSnapshotsFill(store, points, progress, t->progress_ctx));
  PetscCall(HycoSamplesGet(points, &left, NULL, NULL));
  HycoCheck(!whole || 2 * left >= n,
            "%d of %d %s points have no equilibrium, more than half; narrow the parameters' ranges, or give other "
            "points; one of them is %s",
            (int)(n - left), (int)n, points == t->held ? "held-out" : "training", store->first_lost);
  if (points == t->columns) PetscCall(HycoReducerSetColumns(t, points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solved points are in the store already and cost a look at their files. Their time is counted apart: it is that of
   full order, not of the reduction. */
PetscErrorCode HycoReducerSolve(HycoReducer t, HycoSnapshots store, HycoSamples points)
{
  const PetscReal begin = HycoNow();

  PetscFunctionBegin;
  t->solves_held = (PetscBool)(points != t->samples);
  HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerFill(t, store, points, t->progress));
  t->solving += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoReducerGetSolving, (HycoReducer t, const char *what[]), t, HYCO_REDUCER_CLASSID,
                 HycoCheckGiven(what);
                 *what = t->solves_held ? "held-out solutions" : "snapshots")

/* Default number of held-out points: enough for a bound for 95 % of future points if the training is large enough to
   justify their cost. */
#define LEAST_HELD 20
#define MOST_HELD  30
#define FEW_HELD   HYCO_FEW_HELD /* for types whose errors are known without them, and which are tried first */
#define TOGETHER   3             /* that share a stiffness, if loads or gaps are parameters too */
#define CYCLE                                                                                                          \
  (4 * TOGETHER) /* after as many points of the sequence the places inside, at corners, on faces
                                     repeat */

static PetscInt HeldByDefault(PetscInt n)
{
  return PetscMin(MOST_HELD, PetscMax(LEAST_HELD, n));
}

/* Held-out points that share a stiffness come together, `together` at a time, and cost one factor. */
static PetscErrorCode DrawHeld(HycoReducer t, PetscInt count, PetscInt together, HycoSamples *held)
{
  PetscInt n, n_par, slow[HYCO_MAX_PARAMETERS];
  PetscBool reaches[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, NULL));
  /* Negative: the user has not said how many. */
  if (count < 0) count = HeldByDefault(n);
  /* Rank 0 decides: points drawn must be the same everywhere. */
  if (t->rank == 0) HycoSceneReaches(t->scene, reaches);
  for (PetscInt p = 0; p < n_par; p++) slow[p] = t->rank == 0 && reaches[p];
  HycoBcast(slow, n_par, MPIU_INT, HycoComm(t));
  for (PetscInt p = 0; p < n_par; p++) reaches[p] = (PetscBool)slow[p];
  /* Whole cycles, so that a later draw begins with the same places and none is drawn twice. */
  t->drawn = (t->drawn + CYCLE - 1) / CYCLE * CYCLE;
  PetscCall(HycoSamplesOutsideTraining(t->samples, t->drawn, count, together, reaches, held));
  t->drawn += count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define LEAST_CLOSED 2  /* held-out points at which each contact shall have a force, or a ninth of them if more; */
#define FURTHER      12 /* at most so many more are drawn for that, */
#define NEAREST_GAPS 64 /* those with the smallest gaps among so many */

/* The scene's contact that has a force at the fewest of the held-out points, and at how many. Rank 0. */
static PetscErrorCode CountClosed(HycoReducer t, HycoSnapshots store, PetscInt *which, PetscInt *least)
{
  const HycoPairs *pairs = &t->fom->pairs;
  const PetscInt n_contacts = t->scene->n_contacts;
  PetscInt n, n_par, *closed;
  PetscBool *presses;
  PetscReal *force;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->held, &n, &n_par, &mu));
  PetscCall(PetscMalloc3(pairs->n + 1, &force, n_contacts, &presses, n_contacts, &closed));
  PetscCall(PetscArrayzero(closed, n_contacts));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(PetscArrayzero(presses, n_contacts));
    for (PetscInt step = 0; step < HycoSnapshotsSteps(t->scene); step++) {
      PetscCall(HycoSnapshotsReadRows(store, mu + k * n_par, step, HycoSeedFields[HYCO_SEED_DUAL], 0, pairs->n, force));
      for (PetscInt i = 0; i < pairs->n; i++)
        presses[pairs->contact[i]] = (PetscBool)(presses[pairs->contact[i]] || force[i] > 0);
    }
    for (PetscInt c = 0; c < n_contacts; c++) closed[c] += presses[c];
  }
  *least = n;
  *which = 0;
  for (PetscInt c = 0; c < n_contacts; c++) {
    if (closed[c] >= *least) continue;
    *least = closed[c];
    *which = c;
  }
  PetscCall(PetscFree3(force, presses, closed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest gap of a contact before any load at each of n points; a point that fails, where surfaces overlap, is the
   last one. Rank 0. */
static PetscErrorCode FindGaps(HycoReducer t, PetscInt which, PetscInt n, const PetscReal mu[], PetscReal gap[])
{
  HycoFOM f = t->fom;
  HycoRows rows = {0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal all[HYCO_MAX_PARAMETERS];
    char message[HYCO_LINE];
    PetscErrorCode ierr;

    gap[k] = PETSC_MAX_REAL;
    HycoSceneSetTime(t->scene, mu + k * t->scene->n_parameters, t->scene->n_times ? t->scene->times[0] : 0, all);
    PetscCall(HycoCatchBegin());
    ierr = HycoFESetParameters(f->fe_surface, all);
    if (!ierr) ierr = HycoContactRows(f->fe_surface, &f->pairs, &rows);
    PetscCall(HycoCatchEnd(ierr, message));
    for (PetscInt i = 0; i < f->pairs.n && !ierr; i++) {
      if (f->pairs.contact[i] == which) gap[k] = PetscMin(gap[k], rows.gap[i]);
    }
  }
  /* It is at the last point's parameters. */
  f->fe_surface->ready = PETSC_FALSE;
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds held-out points at which a contact is likely to have a force. Collective. */
static PetscErrorCode DrawClosed(HycoReducer t, PetscInt which)
{
  HycoSamples drawn;
  PetscInt n, n_par, order[NEAREST_GAPS];
  PetscReal gap[NEAREST_GAPS];
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(DrawHeld(t, NEAREST_GAPS, 1, &drawn));
  PetscCall(HycoSamplesGet(drawn, &n, &n_par, &mu));
  HycoOnRoot(HycoComm(t), FindGaps(t, which, n, mu, gap));
  HycoBcast(gap, n, MPIU_REAL, HycoComm(t));
  for (PetscInt k = 0; k < n; k++) order[k] = k;
  PetscCall(PetscSortRealWithArrayInt(n, gap, order));
  for (PetscInt k = 0; k < PetscMin(n, FEW_HELD); k++) PetscCall(HycoSamplesAddPoint(t->held, mu + order[k] * n_par));
  PetscCall(HycoSamplesDropTwins(t->held, NULL));
  PetscCall(HycoSamplesDestroy(&drawn));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the held-out points. Where contacts are open at nearly all of them, nothing would judge what a model does with
   contact: further points are drawn. */
static PetscErrorCode SolveHeld(HycoReducer t, HycoSnapshots store)
{
  PetscInt n, first;

  PetscFunctionBegin;
  PetscCall(HycoReducerSolve(t, store, t->held));
  PetscCall(HycoSamplesGet(t->held, &first, NULL, NULL));
  n = first;
  while (t->sizes[2] && !t->validation && t->n_validation < 0 && n < first + FURTHER) {
    PetscInt closed[2] = {0, 0}, before = n;

    HycoOnRoot(HycoComm(t), CountClosed(t, store, &closed[0], &closed[1]));
    HycoBcast(closed, 2, MPIU_INT, HycoComm(t));
    if (closed[1] >= PetscMax(LEAST_CLOSED, first / 9)) break;
    PetscCall(DrawClosed(t, closed[0]));
    PetscCall(HycoReducerSolve(t, store, t->held));
    PetscCall(HycoSamplesGet(t->held, &n, NULL, NULL));
    if (n == before) break; /* parameters without ranges have one point */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* FEW_HELD where types with modes of their own are tried first (t->few): the others come by
   HycoReducerHoldOutMore() if those do not suffice. */
PetscErrorCode HycoReducerHoldOut(HycoReducer t, HycoSnapshots store)
{
  PetscInt n, m;

  PetscFunctionBegin;
  t->drawn = 0;
  /* The user's own points are never reduced. */
  t->few = (PetscBool)(t->late && !t->validation && t->n_validation < 0);
  PetscCall(HycoSamplesDestroy(&t->held));
  if (t->validation) {
    /* A held-out point must not be trained on: it would judge nothing. */
    PetscCall(HycoSamplesExcept(t->validation, t->samples, &t->held));
    PetscCall(HycoSamplesGet(t->validation, &n, NULL, NULL));
    PetscCall(HycoSamplesGet(t->held, &m, NULL, NULL));
    HycoCheck(m, "each of the %d held-out points is also a training point; give other held-out points", (int)n);
  } else if (t->n_validation && t->scene->n_parameters)
    PetscCall(DrawHeld(t, t->few ? FEW_HELD : t->n_validation, t->few ? 1 : TOGETHER, &t->held));
  else
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SolveHeld(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A search that can decide by few points saves their solutions; when it cannot, this draws the rest. */
PetscErrorCode HycoReducerHoldOutMore(HycoReducer t, HycoSnapshots store)
{
  HycoSamples more;
  PetscInt n, n_held;

  PetscFunctionBegin;
  if (!t->few) PetscFunctionReturn(PETSC_SUCCESS);
  t->few = PETSC_FALSE;
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, NULL));
  PetscCall(HycoSamplesGet(t->held, &n_held, NULL, NULL));
  PetscCall(DrawHeld(t, PetscMax(FEW_HELD, HeldByDefault(n) - n_held), TOGETHER, &more));
  PetscCall(HycoSamplesAddSet(t->held, more));
  /* Drawn points may meet earlier ones, for instance corners. */
  PetscCall(HycoSamplesDropTwins(t->held, NULL));
  PetscCall(HycoSamplesDestroy(&more));
  PetscCall(SolveHeld(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* t->held is replaced before the solve, so that an error leaves a set that the reducer owns. */
PetscErrorCode HycoReducerHoldOutFresh(HycoReducer t, HycoSnapshots store, HycoSamples *former, PetscInt *n_fresh)
{
  HycoSamples fresh, held, others, last = t->held;
  PetscInt n, m = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(last, &n, NULL, NULL));
  /* The user's points stay in the set, and only the drawn ones are replaced. */
  if (t->validation) {
    PetscCall(HycoSamplesExcept(t->validation, t->samples, &held));
    PetscCall(HycoSamplesGet(held, &m, NULL, NULL));
  } else
    PetscCall(HycoSamplesCreate(t->scene, &held));
  PetscCall(DrawHeld(t, n > m ? n - m : -1, TOGETHER, &fresh));
  PetscCall(HycoSamplesAddSet(held, fresh));
  PetscCall(HycoSamplesDropTwins(held, NULL));
  /* Those that judge no more: they may become training points. */
  PetscCall(HycoSamplesExcept(last, held, former));
  t->held = held;
  ierr = HycoReducerSolve(t, store, held);
  PetscCall(HycoSamplesExcept(held, last, &others));
  PetscCall(HycoSamplesGet(others, n_fresh, NULL, NULL));
  HycoDestroyAll(&others, &fresh, &last);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the training points are solved only when a type needs them: one that does not may be tried first, and judged
   by held-out points. */
static PetscErrorCode DecideLate(HycoReducer t)
{
  const char *const *types;

  PetscFunctionBegin;
  PetscCall(HycoTrainerNames(&types));
  t->late = PETSC_FALSE;
  for (PetscInt k = 0; types[k] && t->scene->n_parameters && (t->validation || t->n_validation); k++) {
    HycoROM type;
    PetscBool tries;

    PetscCall(HycoReducerTries(t, types[k], &tries));
    PetscCall(HycoROMCreate(&type));
    PetscCall(HycoROMSetType(type, types[k]));
    /* One such type is enough: if it suffices, no training point is ever solved. */
    if (tries && HycoReducerOwnModes(t, type)) t->late = PETSC_TRUE;
    PetscCall(HycoROMDestroy(&type));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before any solve: contacts whose rows the type of model takes. */
PetscErrorCode HycoReducerCheckContacts(HycoReducer t, const HycoROM type)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < t->scene->n_contacts && !type->model->traits.integrals; k++)
    HycoCheckModel(!t->scene->contact[k]->integrated,
                   "contact %s has type %s, whose rows have more masters than a facet; a model of type %s does not "
                   "take them: train one of type bodies or hybrid, or use type: surface",
                   t->scene->contact[k]->name, ((PetscObject)t->scene->contact[k])->type_name, type->model->type);
  for (PetscInt k = 0; k < t->scene->n_contacts && !type->model->traits.friction; k++)
    HycoCheckModel(!t->scene->contact[k]->friction,
                   "contact %s has friction, which a model of type %s does not represent: train one of type bodies or "
                   "hybrid, or use hyco solve",
                   t->scene->contact[k]->name, type->model->type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Let the type refuse, solve, hold out, reduce. *solved: the seconds of HycoNow() when that is done, without those of
   solving. */
static PetscErrorCode RunOn(HycoReducer t, HycoSnapshots store, HycoSamples samples, const char path[],
                            HycoTraining *report, PetscReal *solved)
{
  PetscFunctionBegin;
  if (t->trainer.begin) PetscCall((*t->trainer.begin)(t));
  PetscCall(DecideLate(t));
  /* Otherwise when the search comes to a type that learns from solutions. */
  if (!t->late) PetscCall(HycoReducerSolve(t, store, samples));
  PetscCall(HycoReducerHoldOut(t, store));
  *solved = HycoNow() - t->solving;
  HycoStaged(HYCO_STAGE_REDUCTION, HycoReducerFinish(t, store, path, PETSC_TRUE, report));
  PetscCall(HycoReducerReset(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order: refuse, open, let the type refuse, solve, hold out, reduce. Every step is collective; an error is
   raised on all ranks, and the store closes. */
PetscErrorCode HycoReducerRun(HycoReducer t, HycoSamples samples, const char path[], HycoTraining *training)
{
  HycoSnapshots store;
  HycoSamples own;
  HycoTraining report = {0};
  PetscReal begin = HycoNow(), solved = 0;

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  HycoCheck(samples, "give the training points");
  /* Before hours of solutions: targets without points to judge by cannot be met. */
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++)
    HycoCheck(!(t->target[j] > 0) || t->validation || t->n_validation,
              "-target_%s needs held-out points, and -hyco_validation is 0; remove one of the two", HycoErrorKinds[j]);
  if (t->pinned[HYCO_CHOICE_TYPE] || !t->search) PetscCall(HycoReducerCheckContacts(t, t->prototype));
  /* A copy: points without an equilibrium leave it, and the given set is the caller's. */
  PetscCall(HycoSamplesCreate(t->scene, &own));
  HycoOnError(HycoSamplesAddSet(own, samples), PetscCall(HycoSamplesDestroy(&own)));
  HycoOnError(HycoReducerOpen(t, own, path, &store), PetscCall(HycoSamplesDestroy(&own)));
  HycoFinally(RunOn(t, store, own, path, &report, &solved), PetscCall(HycoReducerClose(t, &store));
              PetscCall(HycoSamplesDestroy(&own)));
  report.sliding = t->sliding;
  report.n_lost = t->n_lost;
  report.first_lost = t->first_lost;
  report.time_error = t->time_error;
  /* Late solves happen inside the reduction: their time is counted with the snapshots. */
  report.cpu_solution = t->cpu_solution;
  report.seconds_snapshots = solved - begin + t->solving;
  report.seconds_reduction = HycoNow() - solved - t->solving;
  if (training) *training = report;
  PetscFunctionReturn(PETSC_SUCCESS);
}
