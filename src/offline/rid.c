/*
  Omega_A as a label of the distributed DM: supports of the interpolation points, region of interest, contact extension,
  layers. A rank labels a new cell where it finds it; DMPlexLabelComplete() adds its closure and informs the other
  ranks, which then add their cells around the vertices. What depends on contacts is computed on rank 0, which has their
  surfaces.
*/
#include <hycocarriers.h>
#include <hycofomimpl.h>
#include <hycodomain.h>

typedef struct {
  HycoFOM f;
  HycoMesh part;
  DMLabel label;
  PetscInt *start, *around; /* cells around the part's nodes */
  PetscInt *own;            /* by place of this rank's nodes: room for data sent through the star forests */
  PetscSF to_part, to_surface;
} Rid;

/* On several ranks two star forests connect owned nodes with those of the parts (with their overlap) and of the
   surfaces, so that layers of the label grow across the ranks. */
static PetscErrorCode RidCreate(HycoFOM f, Rid *r)
{
  HycoMesh part = f->part, surface = f->surface;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(r, sizeof(*r)));
  r->f = f;
  r->part = part;
  PetscCall(DMLabelCreate(PETSC_COMM_SELF, "rid", &r->label));
  PetscCall(HycoMeshNodeCells(part, &r->start, &r->around));
  PetscCall(PetscMalloc1(part->n_owned, &r->own));
  /* On one rank a node's cells are all here. */
  if (f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshNodeSF(HycoComm(f), part, part->n_nodes, part->node_global, &r->to_part));
  PetscCall(HycoMeshNodeSF(HycoComm(f), part, surface ? surface->n_nodes : 0, surface ? surface->node_global : NULL,
                           &r->to_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By point of the DM: a label is of points, whatever local numbers the tables have. */
static PetscErrorCode RIDAdd(Rid *r, PetscInt cell)
{
  PetscFunctionBegin;
  PetscCall(DMLabelSetValue(r->label, r->part->cell_point[cell], HYCO_RID));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells around node i of the part; other ranks add theirs. */
static PetscErrorCode AddAround(Rid *r, PetscInt i)
{
  PetscFunctionBegin;
  for (PetscInt j = r->start[i]; j < r->start[i + 1]; j++) PetscCall(RIDAdd(r, r->around[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the part's nodes in a label after it is completed over the ranks. Collective. */
static PetscErrorCode MarkNodes(const Rid *r, DMLabel label, PetscBool node[])
{
  PetscFunctionBegin;
  PetscCall(DMPlexLabelComplete(r->f->dm, label));
  for (PetscInt i = 0; i < r->part->n_nodes; i++)
    PetscCall(DMLabelStratumHasPoint(label, HYCO_RID, r->part->node_point[i], &node[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends flags of the part's nodes to the surface's on rank 0; the reverse. Collective. */
static PetscErrorCode ToSurface(Rid *r, const PetscBool node[], PetscInt on[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < r->part->n_nodes; i++) {
    const PetscInt place = HycoMeshOwned(r->part, i);

    /* Owned nodes only: the roots of both star forests. */
    if (place >= 0) r->own[place] = node[i];
  }
  if (r->f->size == 1) {
    PetscCall(PetscArraycpy(on, r->own, r->part->n_nodes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoSFBcast(r->to_surface, MPIU_INT, 1, r->own, on));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks of the surfaces' nodes, which rank 0 has, on the nodes of every rank's part. */
static PetscErrorCode FromSurface(Rid *r, const PetscInt on[], PetscInt node[])
{
  PetscFunctionBegin;
  if (r->f->size == 1) {
    PetscCall(PetscArraycpy(node, on, r->part->n_nodes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArrayzero(r->own, r->part->n_owned));
  /* From rank 0 to the owners, then to every part that has the node. */
  PetscCall(HycoSFSend(r->to_surface, MPIU_INT, 1, on, r->own));
  PetscCall(HycoSFBcast(r->to_part, MPIU_INT, 1, r->own, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index in the part of a node or cell of the whole mesh; -1: not in the part. `of`: the part's numbers in the whole
   mesh, ascending. A serial mesh has no table: its numbers are those of the whole. */
static PetscErrorCode FindInPart(PetscInt n, const PetscInt of[], PetscInt whole, PetscInt *at)
{
  PetscFunctionBegin;
  *at = whole;
  if (of) PetscCall(PetscFindInt(whole, n, of, at));
  *at = PetscMax(*at, -1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells all of whose nodes are in the union of the points' supports (20). */
static PetscErrorCode AddSupports(Rid *r, const HycoRIDSettings *settings)
{
  HycoMesh m = r->part;
  Rid support = *r;
  PetscBool *covered;
  PetscInt at;

  PetscFunctionBegin;
  PetscCall(DMLabelCreate(PETSC_COMM_SELF, "support", &support.label));
  for (PetscInt k = 0; k < settings->n_nodes; k++) {
    PetscCall(FindInPart(m->n_nodes, m->node_whole, settings->nodes[k], &at));
    if (at >= 0) PetscCall(AddAround(&support, at));
  }
  for (PetscInt k = 0; k < settings->n_cells; k++) {
    PetscCall(FindInPart(m->n_cells, m->cell_whole, settings->cells[k], &at));
    if (at >= 0) PetscCall(RIDAdd(&support, at));
  }
  PetscCall(PetscMalloc1(m->n_nodes, &covered));
  PetscCall(MarkNodes(r, support.label, covered));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscBool all = PETSC_TRUE;

    /* Beside the supports' own cells those enclosed by them: Omega_A has no holes of one cell. */
    for (PetscInt v = 0; v < m->nv; v++) all = (PetscBool)(all && covered[m->cells[e * m->nv + v]]);
    if (all) PetscCall(RIDAdd(r, e));
  }
  PetscCall(PetscFree(covered));
  PetscCall(DMLabelDestroy(&support.label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the region of interest: cells of cell groups, cells behind facet groups, cells at nodes of smaller groups. */
static PetscErrorCode AddGroup(Rid *r, const char name[])
{
  HycoMesh m = r->part;
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "hyco_rid_groups", name, &g));
  if (m->group_dim[g] == m->dim) {
    for (PetscInt k = m->group_cell_start[g]; k < m->group_cell_start[g + 1]; k++)
      PetscCall(RIDAdd(r, m->group_cell[k]));
  } else if (m->group_dim[g] == m->dim - 1) {
    for (PetscInt f = 0; f < m->n_facets; f++) {
      /* The cell behind a facet has the unknowns that its load acts on. */
      if (m->facet_group[f] == g) PetscCall(RIDAdd(r, m->facet_cell[f]));
    }
  } else {
    for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) PetscCall(AddAround(r, m->group_node[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes where the user's expression is positive, with the cells around them. */
static PetscErrorCode AddRegion(Rid *r, const char text[])
{
  HycoMesh m = r->part;
  HycoExpr expr;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(HycoExprCreate("hyco_rid_region", text, 0, NULL, &expr));
  PetscCall(PetscMalloc1(m->n_nodes, &value));
  /* In the coordinates as drawn: a region does not depend on parameters. */
  PetscCall(HycoExprEval(expr, NULL, m->n_nodes, m->xyz, value));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (value[i] > 0) PetscCall(AddAround(r, i));
  }
  PetscCall(PetscFree(value));
  PetscCall(HycoExprDestroy(&expr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* near[i]: 1 for a node of Gamma^C closer than d to one of Gamma^C in Omega_A (in); 2 for the others of Gamma^C.
   Rank 0. */
static PetscErrorCode FindNear(HycoFOM f, const HycoPairs *pairs, PetscReal d, const PetscInt in[], PetscInt near[])
{
  HycoMesh m = f->surface;
  PetscBool *contact;
  PetscInt *list, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(m->n_nodes, &contact, m->n_nodes, &list));
  PetscCall(HycoPairsMarkSurfaces(f->scene, m, pairs, contact));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    /* Distances as drawn: the extension is a length of the scene's mesh. */
    if (contact[i] && in[i]) list[n++] = i;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    PetscBool close = PETSC_FALSE;

    for (PetscInt j = 0; contact[i] && !in[i] && j < n && !close; j++) {
      PetscReal sum = 0;

      for (PetscInt c = 0; c < 3; c++)
        sum += (m->xyz[3 * i + c] - m->xyz[3 * list[j] + c]) * (m->xyz[3 * i + c] - m->xyz[3 * list[j] + c]);
      close = (PetscBool)(sum < d * d);
    }
    /* 2 distinguishes contact nodes outside, whose cells are not added. */
    near[i] = !contact[i] ? 0 : close ? 1 : 2;
  }
  PetscCall(PetscFree2(contact, list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of nodes of a cell's smallest facet: smaller cells have triangles beside quadrilaterals. */
static PetscInt SmallestFacet(HycoMesh m, PetscInt cell)
{
  return HycoMeshShape(m, cell) == m->type ? m->nf : PetscMin(m->nf, 3);
}

/* Section 7.2: adds cells on Gamma^C with a node closer than d to a node of Gamma^C in Omega_A. Two star-forest
   trips: the distance is computed on rank 0, which has all of Gamma^C, cells are added where they are. */
static PetscErrorCode ExtendContact(Rid *r, const HycoPairs *pairs, PetscReal d)
{
  HycoMesh m = r->part;
  const PetscInt n_surface = r->f->surface ? r->f->surface->n_nodes : 0;
  PetscBool *node;
  PetscInt *in, *near_on, *near;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(m->n_nodes, &node, n_surface, &in, n_surface, &near_on, m->n_nodes, &near));
  PetscCall(MarkNodes(r, r->label, node));
  PetscCall(ToSurface(r, node, in));
  HycoOnRoot(HycoComm(r->f), FindNear(r->f, pairs, d, in, near_on));
  PetscCall(FromSurface(r, near_on, near));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt j = r->start[i]; near[i] == 1 && j < r->start[i + 1]; j++) {
      PetscInt on = 0, of[HYCO_CELL_NODES];
      const PetscInt n = HycoMeshOwnNodes(m, r->around[j], of);

      for (PetscInt v = 0; v < n; v++) on += near[of[v]] > 0;
      /* A cell with a facet on Gamma^C, not one that touches it in a node or an edge. */
      if (on >= SmallestFacet(m, r->around[j]) - HycoMeshFirstCarrier(m)) PetscCall(RIDAdd(r, r->around[j]));
    }
  }
  PetscCall(PetscFree4(node, in, near_on, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the masters, in the whole mesh, of the slaves in Omega_A (in), `width` each, padded by -1. Rank 0. */
static PetscErrorCode ListMasters(HycoFOM f, const HycoPairs *pairs, const PetscInt in[], PetscInt width, PetscInt *n,
                                  PetscInt list[])
{
  PetscFunctionBegin;
  *n = 0;
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt *master;
    const PetscReal *weight;
    PetscInt masters;

    HycoPairsMasters(pairs, k, &masters, &master, &weight);
    /* A pair's one master is found by its own cells. */
    if (masters < 2 || !in[HycoPairsSlave(pairs, k)]) continue;
    for (PetscInt j = 0; j < width; j++)
      list[*n * width + j] = j >= masters ? -1 : f->surface->node_whole ? f->surface->node_whole[master[j]] : master[j];
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells around node i of the part with all n nodes that are marked, or with a facet of them: a mortar's
   masters are those of many facets. */
static PetscErrorCode AddBehind(Rid *r, PetscInt i, PetscInt n, const PetscBool marked[])
{
  HycoMesh m = r->part;

  PetscFunctionBegin;
  for (PetscInt j = r->start[i]; j < r->start[i + 1]; j++) {
    PetscInt has = 0, of[HYCO_CELL_NODES];
    const PetscInt own = HycoMeshOwnNodes(m, r->around[j], of);

    for (PetscInt v = 0; v < own; v++) has += marked[of[v]];
    /* A cell with a whole facet of masters: cells that only touch at an edge are not behind the contact. */
    if (has >= PetscMin(n, SmallestFacet(m, r->around[j]))) PetscCall(RIDAdd(r, r->around[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells behind these masters, at most `width`; a cell has all of its nodes on its rank. marked: of the part's
   nodes, false before and after. */
static PetscErrorCode AddMasters(Rid *r, PetscInt width, const PetscInt master[], PetscInt node[], PetscBool marked[])
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (; n < width && master[n] >= 0; n++) {
    PetscCall(FindInPart(r->part->n_nodes, r->part->node_whole, master[n], &node[n]));
    /* Masters that this part does not have are another rank's. */
    if (node[n] >= 0) marked[node[n]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < n; k++) {
    if (node[k] >= 0) PetscCall(AddBehind(r, node[k], n, marked));
  }
  for (PetscInt k = 0; k < n; k++) {
    /* Undone one by one: clearing the whole array for each contact would cost nodes times contacts. */
    if (node[k] >= 0) marked[node[k]] = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For surfaces that do not match: adds the cells with the masters of the slaves in Omega_A, so that their gaps can
   be computed. (The other slaves of these masters then have nodes on the interface; adding their cells too would add
   all of Gamma^C.) */
static PetscErrorCode CompleteSlaves(Rid *r, const HycoPairs *pairs, PetscInt n_rows)
{
  const PetscInt n_surface = r->f->surface ? r->f->surface->n_nodes : 0;
  PetscInt *in, *list, *at, n = 0, width = r->f->rank ? 0 : HycoPairsWidth(pairs);
  PetscBool *node, *marked;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&width, 1, MPIU_INT, 0, HycoComm(r->f)));
  PetscCall(PetscMalloc4(r->part->n_nodes, &node, n_surface, &in, (size_t)width * (size_t)n_rows, &list, width, &at));
  PetscCall(PetscCalloc1(r->part->n_nodes, &marked));
  PetscCall(MarkNodes(r, r->label, node));
  /* Rank 0 has the contacts, the parts know which nodes are in the RID. */
  PetscCall(ToSurface(r, node, in));
  HycoOnRoot(HycoComm(r->f), ListMasters(r->f, pairs, in, width, &n, list));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, HycoComm(r->f)));
  HycoBcast(list, (size_t)width * (size_t)n, MPIU_INT, HycoComm(r->f));
  /* Every rank goes through all lists, and adds the cells of its part. */
  for (PetscInt k = 0; k < n; k++) PetscCall(AddMasters(r, width, list + (size_t)k * (size_t)width, at, marked));
  PetscCall(PetscFree(marked));
  PetscCall(PetscFree4(node, in, list, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* on[i]: node i belongs to a contact on moved surfaces with a node in Omega_A (in). Rank 0. */
static void MarkMet(HycoFOM f, const HycoPairs *pairs, const PetscInt in[], PetscInt on[])
{
  for (PetscInt i = 0; i < f->surface->n_nodes; i++) on[i] = 0;
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt slave = HycoPairsSlave(pairs, k), *master;
    const PetscReal *weight;
    PetscInt n, any = in[slave];

    if (!HycoPairsMoved(pairs, k)) continue;
    HycoPairsMasters(pairs, k, &n, &master, &weight);
    for (PetscInt j = 0; j < n; j++) any = any || in[master[j]];
    for (PetscInt j = -1; any && j < n; j++) on[j < 0 ? slave : master[j]] = 1;
  }
}

/* For moved surfaces: adds the cells around all nodes of contacts with a node in Omega_A. Otherwise, a slave outside
   would put all masters that it meets on the interface, and no contact node of the master's body would remain in A. */
static PetscErrorCode CompleteMoved(Rid *r, const HycoPairs *pairs)
{
  const PetscInt n_surface = r->f->surface ? r->f->surface->n_nodes : 0;
  PetscBool *node, grown = r->f->searches;
  PetscInt *in, *on, *take;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(r->part->n_nodes, &node, n_surface, &in, n_surface, &on, r->part->n_nodes, &take));
  while (grown) {
    PetscInt before, after;

    PetscCall(MarkNodes(r, r->label, node));
    PetscCall(ToSurface(r, node, in));
    if (r->f->rank == 0) MarkMet(r->f, pairs, in, on);
    PetscCall(FromSurface(r, on, take));
    /* Growth on any rank goes on: the label is complete over ranks only after MarkNodes(). */
    PetscCall(DMLabelGetStratumSize(r->label, HYCO_RID, &before));
    for (PetscInt i = 0; i < r->part->n_nodes; i++) {
      if (take[i]) PetscCall(AddAround(r, i));
    }
    PetscCall(DMLabelGetStratumSize(r->label, HYCO_RID, &after));
    grown = (PetscBool)(after > before);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &grown, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(r->f)));
  }
  PetscCall(PetscFree4(node, in, on, take));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells that share a node with Omega_A. MarkNodes() completes the label first: the layer grows from cells
   of other ranks as well. */
static PetscErrorCode AddLayer(Rid *r)
{
  PetscBool *node;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->part->n_nodes, &node));
  PetscCall(MarkNodes(r, r->label, node));
  for (PetscInt i = 0; i < r->part->n_nodes; i++) {
    if (node[i]) PetscCall(AddAround(r, i));
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells around all nodes of contacts with rigid bodies, and around the nodes of these bodies: if one were
   missing, Omega_A would have neither the body's equilibrium nor its load. */
static PetscErrorCode AddRigid(Rid *r, HycoScene scene)
{
  HycoMesh m = r->part;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 2 * scene->n_contacts; c++) {
    HycoContact contact = scene->contact[c / 2];
    /* Slave and master group in turn. */
    PetscInt g = 0;

    if (!contact->rigid) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", c % 2 ? contact->master : contact->slave, &g));
    for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) PetscCall(AddAround(r, m->group_node[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the regions that each rank can find by itself. */
static PetscErrorCode AddRegions(Rid *r, const HycoRIDSettings *settings)
{
  PetscInt at;

  PetscFunctionBegin;
  /* A model that has chosen its cells: nothing is added, not even for rigid bodies. */
  for (PetscInt k = 0; settings->exact && k < settings->n_cells; k++) {
    PetscCall(FindInPart(r->part->n_cells, r->part->cell_whole, settings->cells[k], &at));
    if (at >= 0) PetscCall(RIDAdd(r, at));
  }
  if (settings->exact) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; settings->whole && e < r->part->n_cells; e++) PetscCall(RIDAdd(r, e));
  for (PetscInt k = 0; k < settings->n_groups; k++) PetscCall(AddGroup(r, settings->groups[k]));
  /* All cells at the plane: the RID then cuts the bodies from side to side. */
  if (settings->plane) PetscCall(AddGroup(r, settings->plane));
  PetscCall(AddRigid(r, r->f->scene));
  if (settings->region) PetscCall(AddRegion(r, settings->region));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (20): the cells around the seeds, supports that single out a mode, the extension and whole contacts, then
   layers. Order: each step completes what the former one has cut. */
PetscErrorCode HycoRIDBuild(HycoFOM f, const HycoPairs *pairs, const HycoRIDSettings *settings, DMLabel *label)
{
  PetscInt n_rows = f->rank ? 0 : pairs->n;
  Rid r;

  PetscFunctionBegin;
  /* Room for the masters' list on every rank; the pairs are rank 0's. */
  PetscCallMPI(MPI_Bcast(&n_rows, 1, MPIU_INT, 0, HycoComm(f)));
  PetscCall(RidCreate(f, &r));
  HycoOnEach(HycoComm(f), AddRegions(&r, settings));
  /* exact: the cells are chosen by a cubature or by bodies, and nothing is added. */
  if (!settings->whole && !settings->exact) {
    PetscCall(AddSupports(&r, settings));
    if (settings->extension > 0) PetscCall(ExtendContact(&r, pairs, settings->extension));
    PetscCall(CompleteSlaves(&r, pairs, n_rows));
    PetscCall(CompleteMoved(&r, pairs));
    /* The contacts are completed before and after: layers count from complete contacts, and may cut others. */
    for (PetscInt k = 0; k < settings->layers; k++) PetscCall(AddLayer(&r));
    PetscCall(CompleteSlaves(&r, pairs, n_rows));
    PetscCall(CompleteMoved(&r, pairs));
  }
  PetscCall(DMPlexLabelComplete(f->dm, r.label));
  *label = r.label;
  HycoDestroyAll(&r.to_part, &r.to_surface);
  HycoFreeAll(&r.start, &r.around, &r.own);
  PetscFunctionReturn(PETSC_SUCCESS);
}
