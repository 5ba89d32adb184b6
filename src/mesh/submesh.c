/*
  DMs from tables: of a whole mesh, and submeshes, which are chosen cells, facets and nodes of another mesh.
  DMPlexFilter() takes cells alone; here a facet without its cell is a point of its own, whose cone is its nodes in the
  order of its normal. It has the tag of the cell that it bounds, and in the labels of its groups the value HYCO_FACET +
  its number in that cell, as if it were this cell. Points are numbered cells, such facets, nodes; the subpoint IS gives
  the point of the other mesh, of such a facet its cell. (PETSc's subpoint map is a label, in which a point occurs
  once.)
*/
#include "plex.h"
#include <string.h>

#define SUBPOINTS "HycoSubpoints"
/* Instead of a number of groups: HycoSubmeshFirst(). */
#define ALL_BETWEEN -1

/* What of a mesh is taken. */
typedef struct {
  HycoMesh of;
  HycoScene scene; /* whose bodies have the cells of their groups; NULL: all groups list their cells */
  PetscInt n_cells, n_facets, n_nodes;
  PetscInt *cell, *facet, *node; /* their indices in `of`; facets: those without their cell */
  PetscInt *cell_at, *node_at;   /* by cell and node of `of`: its index here, or -1 */
} Cut;

/* The lists only; `of` and `scene` are borrowed. */
static PetscErrorCode CutDestroy(Cut *c)
{
  PetscFunctionBegin;
  HycoFreeAll(&c->cell, &c->facet, &c->node, &c->cell_at, &c->node_at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 0..n-1; the caller frees it. */
static PetscErrorCode SubmeshIdentity(PetscInt n, PetscInt **a)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, a));
  for (PetscInt k = 0; k < n; k++) (*a)[k] = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything. */
static PetscErrorCode CutAll(HycoMesh m, Cut *c)
{
  PetscFunctionBegin;
  *c = (Cut){.of = m, .n_cells = m->n_cells, .n_nodes = m->n_nodes};
  PetscCall(SubmeshIdentity(m->n_cells, &c->cell));
  PetscCall(SubmeshIdentity(m->n_nodes, &c->node));
  PetscCall(SubmeshIdentity(m->n_cells, &c->cell_at));
  PetscCall(SubmeshIdentity(m->n_nodes, &c->node_at));
  PetscCall(PetscMalloc1(m->n_facets, &c->facet));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    /* Facets with a cell follow from it. */
    if (m->facet_cell[f] < 0) c->facet[c->n_facets++] = f;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of the DM of a mesh; tables without a DM are numbered as in HycoPlexFromMesh(). */
static PetscInt CellPoint(HycoMesh m, PetscInt e)
{
  return m->cell_point ? m->cell_point[e] : e;
}
/* Vertices follow the cells in DMPlexCreateFromCellListPetsc(), hence the offset. */
static PetscInt NodePoint(HycoMesh m, PetscInt i)
{
  return m->node_point ? m->node_point[i] : m->n_cells + i;
}

/* A facet's number in its cell, which need not be in the mesh. */
static PetscErrorCode FacetNumber(HycoMesh m, PetscInt f, PetscInt *number)
{
  DMLabel label;

  PetscFunctionBegin;
  if (m->facet_cell[f] >= 0) {
    *number = HycoMeshFacetNumber(m, f);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  *number = HycoFacetCount(m->type) - 1; /* of tables without a DM; after a facet whose cell they have */
  if (!m->dm) PetscFunctionReturn(PETSC_SUCCESS);
  /* The facet's label value keeps the number when its cell was left behind. */
  PetscCall(HycoPlexGroupLabel(m->dm, m->group_name[m->facet_group[f]], &label));
  PetscCall(DMLabelGetValue(label, m->facet_point[f], number));
  *number -= HYCO_FACET;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the DM -- */

/* Sets the cones: of a cell its nodes, then the masters of its tied nodes. */
static PetscErrorCode SetCones(DM dm, const Cut *c)
{
  const PetscInt first = c ? c->n_cells + c->n_facets : 0;
  PetscInt node[HYCO_MAX_CELL_NODES], cone[HYCO_MAX_CELL_NODES];
  HycoMesh m = c ? c->of : NULL;

  PetscFunctionBegin;
  /* Without a mesh (c NULL, ranks other than 0) the chart is empty, but the calls are collective. */
  PetscCall(DMPlexSetChart(dm, 0, c ? first + c->n_nodes : 0));
  for (PetscInt e = 0; c && e < c->n_cells; e++)
    PetscCall(DMPlexSetConeSize(dm, e, HycoMeshCellNodes(m, c->cell[e], node)));
  for (PetscInt f = 0; c && f < c->n_facets; f++)
    PetscCall(DMPlexSetConeSize(dm, c->n_cells + f, HycoFacetCorners(m->nf, m->facets + c->facet[f] * m->nf)));
  /* Allocates the cones by the sizes set before; the cones themselves come after it. */
  PetscCall(DMSetUp(dm));
  for (PetscInt e = 0; c && e < c->n_cells; e++) {
    const HycoCellType shape = HycoMeshShape(m, c->cell[e]);
    const PetscInt n = HycoMeshCellNodes(m, c->cell[e], node), own = HycoCellKinds[shape].nv;

    /* Masters keep their order at the end of the cone; only the cell's own nodes are permuted. */
    for (PetscInt k = 0; k < n; k++) cone[k < own ? HycoConePlace(shape, k) : k] = first + c->node_at[node[k]];
    PetscCall(DMPlexSetCone(dm, e, cone));
  }
  for (PetscInt f = 0; c && f < c->n_facets; f++) {
    for (PetscInt v = 0; v < m->nf; v++) cone[v] = first + c->node_at[m->facets[c->facet[f] * m->nf + v]];
    PetscCall(DMPlexSetCone(dm, c->n_cells + f, cone));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A sorted stratum set at once: DMLabelSetValue() per point is slow for millions of points. */
static PetscErrorCode SetStratum(DMLabel label, PetscInt value, PetscInt n, const PetscInt point[])
{
  IS is;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, point, PETSC_COPY_VALUES, &is));
  PetscCall(ISSort(is));
  PetscCall(DMLabelSetStratumIS(label, value, is));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type of point p. */
static DMPolytopeType TypeOf(const Cut *c, PetscInt p)
{
  HycoMesh m = c->of;
  const PetscInt f = p - c->n_cells;

  if (f < 0) return HycoPlexTypes[HycoMeshShape(m, c->cell[p])];
  if (f >= c->n_facets || m->dim == 1) return DM_POLYTOPE_POINT;
  if (m->dim == 2) return DM_POLYTOPE_SEGMENT;
  return m->nf == 6 || HycoFacetCorners(m->nf, m->facets + c->facet[f] * m->nf) == 3 ? DM_POLYTOPE_TRIANGLE
                                                                                     : DM_POLYTOPE_QUADRILATERAL;
}

/* DMPlex would derive the types from the sizes of the cones. */
static PetscErrorCode SetTypes(DM dm, const Cut *c)
{
  PetscInt *of[DM_NUM_POLYTOPES] = {NULL}, n[DM_NUM_POLYTOPES] = {0};
  const PetscInt last = c ? c->n_cells + c->n_facets + c->n_nodes : 0;
  DMLabel label;

  PetscFunctionBegin;
  /* With ties a cell's cone has any size, and a facet without its cell has that of a smaller cell. */
  PetscCall(DMCreateLabel(dm, "celltype"));
  PetscCall(DMPlexGetCellTypeLabel(dm, &label));
  for (PetscInt p = 0; p < last; p++) n[TypeOf(c, p)]++;
  for (PetscInt t = 0; t < DM_NUM_POLYTOPES; t++) {
    if (n[t]) PetscCall(PetscMalloc1(n[t], &of[t]));
    n[t] = 0;
  }
  for (PetscInt p = 0; p < last; p++) of[TypeOf(c, p)][n[TypeOf(c, p)]++] = p;
  for (PetscInt t = 0; t < DM_NUM_POLYTOPES; t++) {
    if (n[t]) PetscCall(SetStratum(label, t, n[t], of[t]));
    PetscCall(PetscFree(of[t]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a DM from cones. With the masters in a cell's cone, every query for the cells around a node finds it: for
   shared nodes, the overlap, an RID. */
static PetscErrorCode FromCones(MPI_Comm comm, PetscInt dim, const Cut *c, DM *dm)
{
  PetscReal *xyz;

  PetscFunctionBegin;
  PetscCall(DMPlexCreate(comm, dm));
  PetscCall(DMSetDimension(*dm, dim));
  PetscCall(SetCones(*dm, c));
  /* Supports from cones, then the strata: a facet without its cell has height 0, as a cell. */
  PetscCall(DMPlexSymmetrize(*dm));
  PetscCall(DMPlexStratify(*dm));
  PetscCall(SetTypes(*dm, c));
  PetscCall(PetscMalloc1(c ? 3 * c->n_nodes : 0, &xyz));
  for (PetscInt i = 0; c && i < c->n_nodes; i++) PetscCall(PetscArraycpy(xyz + 3 * i, c->of->xyz + 3 * c->node[i], 3));
  PetscCall(DMPlexBuildCoordinatesFromCellList(*dm, 3, xyz));
  PetscCall(PetscFree(xyz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body of this name, or -1. */
static PetscInt BodyOf(HycoScene scene, const char name[])
{
  for (PetscInt k = 0; scene && k < scene->n_bodies; k++) {
    if (!strcmp(scene->body[k].name, name)) return k;
  }
  return -1;
}

/* Vertices and cells of a group have the value 1 + its dimension, also if there are none in a submesh. */
static PetscErrorCode FillMembers(DMLabel label, const Cut *c, PetscInt g)
{
  HycoMesh m = c->of;
  const PetscInt body = BodyOf(c->scene, m->group_name[g]), first = c->n_cells + c->n_facets;
  PetscInt *point, n = 0;

  /* A cell may be listed by several groups; bodies take theirs from cell_body, which submeshes keep also where the
     group's list is not complete. */
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(c->n_cells + c->n_nodes, &point));
  for (PetscInt e = 0; e < c->n_cells && body >= 0; e++) {
    if (m->cell_body[c->cell[e]] == body) point[n++] = e;
  }
  for (PetscInt k = m->group_cell_start[g]; body < 0 && k < m->group_cell_start[g + 1]; k++) {
    if (c->cell_at[m->group_cell[k]] >= 0) point[n++] = c->cell_at[m->group_cell[k]];
  }
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) {
    if (c->node_at[m->group_node[k]] >= 0) point[n++] = first + c->node_at[m->group_node[k]];
  }
  /* In a submesh an empty stratum still tells the group's dimension (TakeGroup()). */
  if (n || c->scene) PetscCall(SetStratum(label, 1 + m->group_dim[g], n, point));
  PetscCall(PetscFree(point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet is a value of its cell or, if the cell is not taken, of the facet's own point. c->facet ascends, so that
   one pass finds it. */
static PetscErrorCode FillFacets(DMLabel label, const Cut *c, PetscInt g)
{
  HycoMesh m = c->of;
  PetscInt *point, *number, *some, n = 0, next = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m->n_facets, &point, m->n_facets, &number, m->n_facets, &some));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt at = m->facet_cell[f] < 0 ? -1 : c->cell_at[m->facet_cell[f]];

    while (next < c->n_facets && c->facet[next] < f) next++;
    if (m->facet_group[f] != g || (at < 0 && (next == c->n_facets || c->facet[next] != f))) continue;
    point[n] = at < 0 ? c->n_cells + next : at;
    PetscCall(FacetNumber(m, f, &number[n++]));
  }
  /* One stratum per number, each filled at once. */
  for (PetscInt k = 0; k < HycoFacetCount(m->type); k++) {
    PetscInt of = 0;

    for (PetscInt f = 0; f < n; f++) {
      if (number[f] == k) some[of++] = point[f];
    }
    if (of) PetscCall(SetStratum(label, HYCO_FACET + k, of, some));
  }
  PetscCall(PetscFree3(point, number, some));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A label for each group, on every process. In 1D the DM of a whole mesh has facets as points. Names come from rank
   0, since DMPlexDistribute() needs the same labels in the same order on every rank. */
static PetscErrorCode AddLabels(DM dm, const Cut *c)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)dm);
  PetscInt n = c ? c->of->n_groups : 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, comm));
  for (PetscInt g = 0; g < n; g++) {
    char name[HYCO_LINE] = "";
    PetscBool has;
    DMLabel label;

    if (c) PetscCall(HycoPlexLabelName(c->of->group_name[g], sizeof(name), name));
    PetscCallMPI(MPI_Bcast(name, sizeof(name), MPI_CHAR, 0, comm));
    PetscCall(DMHasLabel(dm, name, &has));
    if (has) continue; /* of groups with the same name the first is used */
    PetscCall(DMCreateLabel(dm, name));
    PetscCall(DMGetLabel(dm, name, &label));
    if (c) PetscCall(FillMembers(label, c, g));
    /* In 1D a facet is a vertex, which is a point of the group already. */
    if (c && (c->of->dim > 1 || c->scene)) PetscCall(FillFacets(label, c, g));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets without cells have the tag of the cell that they bound: with the number in it, they sort as in the whole
   mesh. Tables without a DM do not tell that of another's cell: it gets that of the facet before it in its group. */
static PetscErrorCode AddTags(DM dm, const Cut *c)
{
  const PetscInt first = c ? c->n_cells + c->n_facets : 0, *tag_of = NULL;
  PetscInt *tag, next = 0, last = 0;
  IS tags = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(c ? first + c->n_nodes : 0, &tag));
  if (c && c->of->dm) PetscCall(PetscObjectQuery((PetscObject)c->of->dm, HYCO_TAGS, (PetscObject *)&tags));
  if (tags) PetscCall(ISGetIndices(tags, &tag_of));
  for (PetscInt e = 0; c && e < c->n_cells; e++) tag[e] = c->of->cell_id[c->cell[e]];
  for (PetscInt f = 0; c && f < c->of->n_facets; f++) {
    const PetscInt cell = c->of->facet_cell[f];

    /* A new group: the last cell says nothing about its facets. */
    if (!f || c->of->facet_group[f] != c->of->facet_group[f - 1]) last = 0;
    if (cell >= 0) last = c->of->cell_id[cell];
    if (next == c->n_facets || c->facet[next] != f) continue;
    tag[c->n_cells + next++] = cell < 0 && tags ? tag_of[c->of->facet_point[f]] : last;
  }
  for (PetscInt i = 0; c && i < c->n_nodes; i++) tag[first + i] = c->of->node_id[c->node[i]];
  if (tags) PetscCall(ISRestoreIndices(tags, &tag_of));
  PetscCall(HycoPlexSetTags(dm, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM of a mesh on rank 0 (m NULL elsewhere). Plain cells use PETSc's constructor; ties, collapsed cells and
   second order need cones of their own sizes. Collective. */
PetscErrorCode HycoPlexFromMesh(MPI_Comm comm, HycoMesh m, DM *dm)
{
  PetscInt head[3] = {m ? m->dim : 0, m ? m->nv : 0, m ? HycoMeshIsQuadratic(m) || m->mixed : 0}, *cone = NULL;
  HycoTies ties = m ? m->ties : NULL;
  Cut cut = {0}, *c = m ? &cut : NULL;

  PetscFunctionBegin;
  if (m) PetscCall(CutAll(m, c));
  /* Which constructor is called must be the same on all ranks: each is collective. */
  PetscCallMPI(MPI_Bcast(head, 3, MPIU_INT, 0, comm));
  PetscCall(HycoTiesBcast(comm, &ties));
  if (m && !ties && !head[2]) {
    PetscCall(PetscMalloc1(m->n_cells * m->nv, &cone));
    for (PetscInt k = 0; k < m->n_cells * m->nv; k++)
      cone[k / m->nv * m->nv + HycoConePlace(m->type, k % m->nv)] = m->cells[k];
  }
  if (ties || head[2])
    PetscCall(FromCones(comm, head[0], c, dm));
  else
    PetscCall(DMPlexCreateFromCellListPetsc(comm, head[0], m ? m->n_cells : 0, m ? m->n_nodes : 0, head[1], PETSC_FALSE,
                                            cone, 3, m ? m->xyz : NULL, dm));
  PetscCall(PetscFree(cone));
  PetscCall(HycoTiesAttach(*dm, ties));
  /* The received list belongs to this call; rank 0's belongs to the mesh. */
  if (!m) PetscCall(HycoTiesDestroy(&ties));
  PetscCall(AddLabels(*dm, c));
  PetscCall(AddTags(*dm, c));
  PetscCall(CutDestroy(&cut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- submeshes -- */

/* Borrowed; NULL: a whole mesh. The same IS tells plex.c that a DM is a submesh. */
PetscErrorCode HycoSubmeshGetPoints(DM dm, IS *points)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, SUBPOINTS, (PetscObject *)points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Selects the nodes: those of cells first, then those of facets, the others and the masters of tied nodes. The
   unknowns of assembled cells are then a leading block of the submesh. Or all ascending, as model files of former
   formats may have them. */
static PetscErrorCode SelectNodes(Cut *c, PetscBool ascending, PetscInt n_extra, const PetscInt extra[])
{
  enum { NOT, ALSO, IN_CELL };
  HycoMesh m = c->of;
  PetscInt *how, node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &how));
  PetscCall(PetscMalloc1(m->n_nodes, &c->node_at));
  for (PetscInt k = 0; k < n_extra; k++) how[extra[k]] = ALSO;
  for (PetscInt k = 0; k < c->n_facets * m->nf; k++) how[m->facets[c->facet[k / m->nf] * m->nf + k % m->nf]] = ALSO;
  for (PetscInt e = 0; e < c->n_cells; e++) {
    const PetscInt n = HycoMeshCellNodes(m, c->cell[e], node);

    for (PetscInt v = 0; v < n; v++) how[node[v]] = ascending ? ALSO : IN_CELL;
  }
  for (PetscInt k = 0; k < m->n_tied; k++) {
    for (PetscInt j = m->tied_start[k]; how[m->tied[k]] && j < m->tied_start[k + 1]; j++)
      /* Masters of tied nodes that no kept cell has: the nodes' displacements are sums over them. Those of kept
         cells' nodes are IN_CELL already. */
      how[m->tied_master[j]] = PetscMax(how[m->tied_master[j]], ALSO);
  }
  PetscCall(PetscMalloc1(m->n_nodes, &c->node));
  for (PetscInt i = 0; i < m->n_nodes; i++) c->node_at[i] = -1;
  for (PetscInt pass = IN_CELL; pass > NOT; pass--) {
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      if (how[i] != pass) continue;
      c->node_at[i] = c->n_nodes;
      c->node[c->n_nodes++] = i;
    }
  }
  PetscCall(PetscFree(how));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a facet is taken without its cell: n_all ALL_BETWEEN: if all of its nodes are in extra, the first ones; else
   if its group is listed. */
static PetscBool SubmeshIsTaken(HycoMesh m, PetscInt facet, PetscInt n_extra, PetscInt n_all,
                                const PetscInt all_facets[])
{
  PetscBool take = (PetscBool)(n_all == ALL_BETWEEN);

  for (PetscInt v = 0; take && v < m->nf; v++) take = (PetscBool)(m->facets[facet * m->nf + v] < n_extra);
  for (PetscInt k = 0; k < n_all; k++) take = (PetscBool)(take || m->facet_group[facet] == all_facets[k]);
  return take;
}

/* Facets that are taken and whose cell is not kept become points. */
static PetscErrorCode SubmeshSelect(Cut *c, PetscInt n_keep, const PetscInt keep[], PetscInt n_extra,
                                    const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[])
{
  HycoMesh m = c->of;

  PetscFunctionBegin;
  c->n_cells = n_keep;
  HycoDuplicate(n_keep, keep, &c->cell);
  PetscCall(PetscMalloc1(m->n_cells, &c->cell_at));
  for (PetscInt e = 0; e < m->n_cells; e++) c->cell_at[e] = -1;
  /* Where a kept cell is in the new mesh. */
  for (PetscInt k = 0; k < n_keep; k++) c->cell_at[keep[k]] = k;
  PetscCall(PetscMalloc1(m->n_facets, &c->facet));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_cell[f] >= 0 && c->cell_at[m->facet_cell[f]] >= 0) continue;
    if (SubmeshIsTaken(m, f, n_extra, n_all, all_facets)) c->facet[c->n_facets++] = f;
  }
  PetscCall(SelectNodes(c, (PetscBool)(n_all == ALL_BETWEEN), n_extra, extra));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not collective: each process has the IS of its own points. */
PetscErrorCode HycoSubmeshSetPoints(DM sub, PetscInt n, PetscInt point[])
{
  IS points;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, point, PETSC_OWN_POINTER, &points));
  PetscCall(PetscObjectCompose((PetscObject)sub, SUBPOINTS, (PetscObject)points));
  PetscCall(ISDestroy(&points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Composes the submesh with its points in the DM of the other mesh. */
static PetscErrorCode SetPoints(DM sub, const Cut *c)
{
  PetscInt *point, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(c->n_cells + c->n_facets + c->n_nodes, &point));
  for (PetscInt e = 0; e < c->n_cells; e++) point[n++] = CellPoint(c->of, c->cell[e]);
  for (PetscInt f = 0; f < c->n_facets; f++) {
    const PetscInt cell = c->of->facet_cell[c->facet[f]];

    point[n++] = cell >= 0 ? CellPoint(c->of, cell) : c->of->facet_point ? c->of->facet_point[c->facet[f]] : -1;
  }
  for (PetscInt i = 0; i < c->n_nodes; i++) point[n++] = NodePoint(c->of, c->node[i]);
  PetscCall(HycoSubmeshSetPoints(sub, n, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A DM of the chosen points, with what the whole mesh's DM has composed with it: ties, labels of groups, tags, the
   points in the whole mesh, the type of its cells. */
static PetscErrorCode MakeDM(MPI_Comm comm, const Cut *c, DM *dm)
{
  PetscFunctionBegin;
  PetscCall(FromCones(comm, c->of->dim, c, dm));
  PetscCall(HycoTiesAttach(*dm, c->of->ties));
  PetscCall(AddLabels(*dm, c));
  PetscCall(AddTags(*dm, c));
  PetscCall(SetPoints(*dm, c));
  PetscCall(HycoPlexSetType(*dm, c->of->type, c->of->mixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM alone, on a communicator with several ranks: each gives its own share. Collective. */
PetscErrorCode HycoPlexCut(MPI_Comm comm, HycoScene scene, HycoMesh of, PetscInt n_keep, const PetscInt keep[],
                           PetscInt n_extra, const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[],
                           DM *dm)
{
  Cut cut = {.of = of, .scene = scene};

  PetscFunctionBegin;
  PetscCall(SubmeshSelect(&cut, n_keep, keep, n_extra, extra, n_all, all_facets));
  PetscCall(MakeDM(comm, &cut, dm));
  PetscCall(CutDestroy(&cut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Local tables of the submesh on this process, with the places in the whole mesh, which the DM does not store. */
static PetscErrorCode SubmeshMake(const Cut *c, HycoMesh *sub)
{
  HycoMesh m = c->of;
  DM dm;

  PetscFunctionBegin;
  PetscCall(MakeDM(PETSC_COMM_SELF, c, &dm));
  /* The tables hold the reference that counts; this function's own is released also after an error. */
  HycoFinally(HycoPlexToMesh(dm, c->scene, sub), PetscCall(DMDestroy(&dm)));
  PetscCall(PetscMalloc1(c->n_nodes + 1, &(*sub)->node_whole));
  PetscCall(PetscMalloc1(c->n_cells + 1, &(*sub)->cell_whole));
  for (PetscInt i = 0; i < c->n_nodes; i++)
    (*sub)->node_whole[i] = m->node_whole ? m->node_whole[c->node[i]] : c->node[i];
  for (PetscInt e = 0; e < c->n_cells; e++)
    (*sub)->cell_whole[e] = m->cell_whole ? m->cell_whole[c->cell[e]] : c->cell[e];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells keep[], nodes extra[] and all facets of some groups of another mesh, as a mesh of this process. The order
   of the other mesh is kept. Not collective; the caller destroys it. */
PetscErrorCode HycoSubmesh(HycoScene scene, HycoMesh of, PetscInt n_keep, const PetscInt keep[], PetscInt n_extra,
                           const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[], HycoMesh *sub)
{
  Cut cut = {.of = of, .scene = scene};

  PetscFunctionBegin;
  PetscCall(SubmeshSelect(&cut, n_keep, keep, n_extra, extra, n_all, all_facets));
  HycoFinally(SubmeshMake(&cut, sub), PetscCall(CutDestroy(&cut)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of cells are kept with these, the others if all of their nodes are. */
PetscErrorCode HycoSubmeshFirst(HycoScene scene, HycoMesh of, PetscInt n, HycoMesh *sub)
{
  PetscInt *first;
  HycoMesh m;

  PetscFunctionBegin;
  PetscCall(SubmeshIdentity(PetscMax(n, of->n_cells), &first));
  PetscCall(HycoSubmesh(scene, of, of->n_cells, first, n, first, ALL_BETWEEN, NULL, sub));
  PetscCall(PetscFree(first));
  m = *sub;
  /* A node of a cell beyond the first n would have been added. */
  PetscCheck(m->n_nodes == n, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%d nodes of %d", (int)m->n_nodes, (int)n);
  m->n_whole_nodes = of->n_whole_nodes;
  m->n_whole_cells = of->n_whole_cells;
  m->whole_length = of->whole_length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For tables that came by a message or from a model file: nodes and cells keep their order, and the DM gets what
   MakeTables() would read back. */
PetscErrorCode HycoMeshCreateDM(HycoScene scene, HycoMesh m)
{
  Cut cut = {0};
  PetscInt next = 0;
  DM dm;

  PetscFunctionBegin;
  PetscCall(CutAll(m, &cut));
  cut.scene = scene;
  PetscCall(MakeDM(PETSC_COMM_SELF, &cut, &dm));
  PetscCall(HycoMeshSetDM(m, dm));
  /* Points are numbered cells, facets without cells, nodes: as MakeDM() makes them. */
  PetscCall(SubmeshIdentity(m->n_cells, &m->cell_point));
  PetscCall(PetscMalloc1(m->n_nodes, &m->node_point));
  PetscCall(PetscMalloc1(m->n_facets, &m->facet_point));
  for (PetscInt i = 0; i < m->n_nodes; i++) m->node_point[i] = cut.n_cells + cut.n_facets + i;
  for (PetscInt f = 0; f < m->n_facets; f++) m->facet_point[f] = m->facet_cell[f] < 0 ? cut.n_cells + next++ : -1;
  PetscCall(CutDestroy(&cut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* node[i]: the index in `of` of node i of the submesh, by an inverse table over the range of points. */
PetscErrorCode HycoSubmeshNodes(HycoMesh sub, HycoMesh of, PetscInt node[])
{
  PetscInt *at, first = PETSC_MAX_INT, last = 0;
  const PetscInt *point;
  IS points;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < of->n_nodes; i++) {
    /* Points of nodes are a range of the other DM: a table over it, not over all points. */
    first = PetscMin(first, NodePoint(of, i));
    last = PetscMax(last, NodePoint(of, i) + 1);
  }
  PetscCall(PetscMalloc1(PetscMax(last - first, 0), &at));
  for (PetscInt i = 0; i < of->n_nodes; i++) at[NodePoint(of, i) - first] = i;
  PetscCall(HycoSubmeshGetPoints(sub->dm, &points));
  PetscCall(ISGetIndices(points, &point));
  for (PetscInt i = 0; i < sub->n_nodes; i++) node[i] = at[point[sub->node_point[i]] - first];
  PetscCall(ISRestoreIndices(points, &point));
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}
