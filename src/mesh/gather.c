/*
  Gathers chosen cells, facets and nodes of a distributed mesh on rank 0. Each rank cuts the DM of its share, whose
  points migrate to rank 0 (DMPlexMigrate()); the submesh is made of them. A share has the cells of facets too, since a
  facet is a label's value of its cell. To migrate from the whole DM would cost its size for every label.
*/
#include "plex.h"

/* What a point has in the distributed mesh: whether it is chosen, or needed for another; its numbers. */
enum { KIND, GLOBAL, WHOLE, NUMBER, N_COLUMNS };
enum { NEEDED = 1, CHOSEN };

typedef struct {
  MPI_Comm comm;
  PetscMPIInt rank;
  HycoScene scene;
  HycoMesh part;
  const PetscBool *in;     /* by group; NULL: all of the mesh */
  const PetscBool *cell;   /* by cell, in addition to the groups; NULL: none */
  PetscInt n, *kind;       /* points of the part's DM; of each what it is */
  DM share, root;          /* this rank's; the gathered points, on rank 0 */
  PetscInt *of[N_COLUMNS]; /* by point of root */
} Gather;

/* Combines the values of a point on all ranks that have it. */
static PetscErrorCode GatherAgree(const Gather *g, MPI_Op op, PetscInt value[])
{
  PetscInt n_roots;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(DMGetPointSF(g->part->dm, &sf));
  PetscCall(PetscSFGetGraph(sf, &n_roots, NULL, NULL, NULL));
  /* No star forest is set on one rank. */
  if (n_roots < 0) PetscFunctionReturn(PETSC_SUCCESS);
  /* Leaves (copies of a point) to its owner with the operation, then the owner's result back: every copy has the
     same value. */
  PetscCall(PetscSFReduceBegin(sf, MPIU_INT, value, value, op));
  PetscCall(PetscSFReduceEnd(sf, MPIU_INT, value, value, op));
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, value, value, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, value, value, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds what each point of the part is. */
static PetscErrorCode GatherChoose(Gather *g)
{
  HycoMesh m = g->part;
  PetscInt *kind, node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(DMPlexGetChart(m->dm, NULL, &g->n));
  PetscCall(PetscCalloc1(g->n, &g->kind));
  kind = g->kind;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    /* A facet travels as a label value of its cell, so that the cell is needed though it is not chosen itself. */
    if (g->in && g->in[m->facet_group[f]]) kind[m->cell_point[m->facet_cell[f]]] = NEEDED;
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (!g->in || (g->cell && g->cell[e])) kind[m->cell_point[e]] = CHOSEN;
  }
  for (PetscInt k = 0; k < m->n_groups; k++) {
    for (PetscInt j = m->group_start[k]; g->in && g->in[k] && j < m->group_start[k + 1]; j++)
      kind[m->node_point[m->group_node[j]]] = CHOSEN;
  }
  /* First pass: chosen points over all ranks. A cell's nodes follow in a second pass at every rank that has the
     cell, because the owner of a node need not have the group's facet in its tables. */
  PetscCall(GatherAgree(g, MPI_MAX, kind));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt n = HycoMeshCellNodes(m, e, node), of = kind[m->cell_point[e]];

    for (PetscInt v = 0; v < n; v++) kind[m->node_point[node[v]]] = PetscMax(kind[m->node_point[node[v]]], of);
  }
  for (PetscInt k = 0; k < m->n_tied; k++) { /* the masters of tied nodes */
    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      PetscInt *master = &kind[m->node_point[m->tied_master[j]]];

      *master = PetscMax(*master, kind[m->node_point[m->tied[k]]]);
    }
  }
  PetscCall(GatherAgree(g, MPI_MAX, kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cuts this rank's share: the cells whose first node it owns, their nodes, and those that it owns. */
static PetscErrorCode CutShare(Gather *g)
{
  HycoMesh m = g->part;
  PetscInt *keep, *extra, n_keep = 0, n_extra = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n_cells, &keep, m->n_nodes, &extra));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    /* One sender per cell: of the ranks that have it in their overlap only the owner of its first node. */
    if (g->kind[m->cell_point[e]] && HycoMeshOwned(m, m->cells[e * m->nv]) >= 0) keep[n_keep++] = e;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (g->kind[m->node_point[i]] && HycoMeshOwned(m, i) >= 0) extra[n_extra++] = i;
  }
  PetscCall(HycoPlexCut(g->comm, g->scene, m, n_keep, keep, n_extra, extra, 0, NULL, &g->share));
  PetscCall(PetscFree2(keep, extra));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the facets of the share's cells that are in the tables of other ranks, which own one of their nodes. */
static PetscErrorCode AddFacets(const Gather *g, PetscInt n, const PetscInt point[])
{
  HycoMesh m = g->part;
  PetscInt *facets; /* by cell, a bit for each facet in the group */

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(g->n, &facets));
  for (PetscInt k = 0; k < m->n_groups; k++) {
    DMLabel label;

    if (m->group_dim[k] != m->dim - 1) continue;
    PetscCall(PetscArrayzero(facets, g->n));
    for (PetscInt f = 0; f < m->n_facets; f++) {
      if (m->facet_group[f] == k) facets[m->cell_point[m->facet_cell[f]]] |= 1 << HycoMeshFacetNumber(m, f);
    }
    /* A facet is in the tables of ranks that own one of its nodes; the cell may be sent by another rank. The bits
       of all of them are combined at the cell. */
    PetscCall(GatherAgree(g, MPI_BOR, facets));
    PetscCall(HycoPlexGroupLabel(g->share, m->group_name[k], &label));
    for (PetscInt c = 0; c < n; c++) {
      for (PetscInt number = 0; facets[point[c]] >> number; number++) {
        if (facets[point[c]] >> number & 1) PetscCall(DMLabelSetValue(label, c, HYCO_FACET + number));
      }
    }
  }
  PetscCall(PetscFree(facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the point star forest of the shares, from that of the mesh: nodes of other ranks' are leaves. own[]: the
   others. */
static PetscErrorCode SetPointSF(const Gather *g, PetscInt n, const PetscInt point[], PetscBool own[])
{
  PetscInt *at, *leaf, n_roots, n_leaves, n_mine = 0, v0;
  const PetscInt *local;
  const PetscSFNode *to;
  PetscSFNode *remote;
  PetscSF sf, mine;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) own[k] = PETSC_TRUE;
  PetscCall(DMGetPointSF(g->part->dm, &sf));
  PetscCall(PetscSFGetGraph(sf, &n_roots, &n_leaves, &local, &to));
  if (n_roots < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMPlexGetDepthStratum(g->share, 0, &v0, NULL));
  PetscCall(PetscMalloc2(g->n, &at, n, &leaf));
  PetscCall(PetscMalloc1(n, &remote));
  /* at[p]: the point of the share that is point p of the part, or -1. */
  for (PetscInt p = 0; p < g->n; p++) at[p] = -1;
  for (PetscInt k = 0; k < n; k++) at[point[k]] = k;
  for (PetscInt j = 0; j < n_leaves; j++) {
    const PetscInt p = local ? local[j] : j;

    /* Also -1, points that the share does not have, since v0 >= 0. */
    if (at[p] < v0) continue; /* a cell is sent by one rank */
    own[at[p]] = PETSC_FALSE;
    leaf[n_mine] = at[p];
    remote[n_mine++].rank = to[j].rank;
  }
  /* The number of the node in the share of its owner, which has all chosen nodes that it owns. */
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, at, at, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, at, at, MPI_REPLACE));
  for (PetscInt j = 0; j < n_mine; j++) remote[j].index = at[point[leaf[j]]];
  PetscCall(PetscSFCreate(g->comm, &mine));
  PetscCall(PetscSFSetGraph(mine, n, n_mine, leaf, PETSC_COPY_VALUES, remote, PETSC_OWN_POINTER));
  PetscCall(DMSetPointSF(g->share, mine));
  PetscCall(PetscSFDestroy(&mine));
  PetscCall(PetscFree2(at, leaf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The star forest from rank 0's points, cells before nodes, to those of the shares. */
static PetscErrorCode CreateSF(const Gather *g, PetscInt n, const PetscBool own[], PetscSF *sf)
{
  PetscInt v0, n_all[2], n_mine;
  PetscSFNode *mine, *all[2], *remote = NULL;

  PetscFunctionBegin;
  PetscCall(DMPlexGetDepthStratum(g->share, 0, &v0, NULL));
  PetscCall(PetscMalloc1(n, &mine));
  for (PetscInt k = 0; k < 2; k++) {
    n_mine = 0;
    for (PetscInt p = k ? v0 : 0; p < (k ? n : v0); p++) {
      if (own[p]) mine[n_mine++] = (PetscSFNode){g->rank, p};
    }
    /* Gathered on rank 0 in the order of the ranks: all cells first, then all nodes, as a DMPlex of cells and
       vertices is numbered. An entry is two integers (rank, point). */
    PetscCall(HycoConcatenate(g->comm, 2 * n_mine, mine, MPIU_INT, sizeof(PetscInt), &n_all[k], &all[k]));
    n_all[k] = g->rank ? 0 : n_all[k] / 2;
  }
  PetscCall(PetscMalloc1(n_all[0] + n_all[1], &remote));
  for (PetscInt k = 0; k < 2; k++) {
    if (n_all[k]) PetscCall(PetscArraycpy(remote + (k ? n_all[0] : 0), all[k], n_all[k]));
    PetscCall(PetscFree(all[k]));
  }
  PetscCall(PetscFree(mine));
  PetscCall(PetscSFCreate(g->comm, sf));
  /* Roots: the n points of each share; leaves: the gathered points, contiguous, on rank 0 alone. */
  PetscCall(PetscSFSetGraph(*sf, n, n_all[0] + n_all[1], NULL, PETSC_OWN_POINTER, remote, PETSC_OWN_POINTER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends what a share's points have in the distributed mesh; its own points are numbered rank after rank. */
static PetscErrorCode SendColumns(Gather *g, PetscSF sf, PetscInt n, const PetscInt point[])
{
  HycoMesh m = g->part;
  PetscInt *value[N_COLUMNS], *mine, n_root, first = 0;

  PetscFunctionBegin;
  /* Point numbers of different ranks would coincide; the offset makes them unique over the ranks. */
  PetscCallMPI(MPI_Exscan(&g->n, &first, 1, MPIU_INT, MPI_SUM, g->comm));
  PetscCall(PetscMalloc3(g->n, &value[GLOBAL], g->n, &value[WHOLE], n, &mine));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    value[GLOBAL][m->node_point[i]] = m->node_global[i];
    value[WHOLE][m->node_point[i]] = m->node_whole[i];
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    /* Cells have no unknowns. The arrays have entries for points of the overlap without tables too, which no share
       takes. */
    value[GLOBAL][m->cell_point[e]] = -1;
    value[WHOLE][m->cell_point[e]] = m->cell_whole[e];
  }
  value[KIND] = g->kind;
  PetscCall(DMPlexGetChart(g->root, NULL, &n_root));
  for (PetscInt c = 0; c < N_COLUMNS; c++) {
    for (PetscInt k = 0; k < n; k++) mine[k] = c == NUMBER ? first + point[k] : value[c][point[k]];
    PetscCall(PetscMalloc1(n_root, &g->of[c]));
    PetscCall(HycoSFBcast(sf, MPIU_INT, 1, mine, g->of[c]));
  }
  PetscCall(PetscFree3(value[GLOBAL], value[WHOLE], mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends the points of the shares, with tags and ties. DMPlex moves points, cones and labels; tags and ties are not
   known to it. */
static PetscErrorCode GatherMigrate(Gather *g)
{
  PetscBool *own;
  PetscInt n;
  const PetscInt *point;
  HycoTies ties;
  IS points;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(HycoSubmeshGetPoints(g->share, &points));
  PetscCall(ISGetLocalSize(points, &n));
  PetscCall(ISGetIndices(points, &point));
  PetscCall(PetscMalloc1(n, &own));
  PetscCall(AddFacets(g, n, point));
  PetscCall(SetPointSF(g, n, point, own));
  PetscCall(CreateSF(g, n, own, &sf));
  /* On the communicator of the part, as DMPlexMigrate() needs it; only rank 0 gets points. */
  PetscCall(DMPlexCreate(g->comm, &g->root));
  PetscCall(DMPlexMigrate(g->share, sf, g->root));
  PetscCall(HycoPlexSendTags(g->share, sf, g->root));
  PetscCall(SendColumns(g, sf, n, point));
  PetscCall(HycoTiesOf(g->share, &ties));
  PetscCall(HycoTiesAttach(g->root, ties));
  PetscCall(HycoPlexSetType(g->root, g->part->type, g->part->mixed));
  PetscCall(ISRestoreIndices(points, &point));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree(own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the numbers in the distributed mesh: rank 0 has all nodes. */
static PetscErrorCode GatherNumbers(const Gather *g, HycoMesh sub)
{
  HycoMesh m = g->part;
  const PetscInt *point;
  PetscInt n, *number;
  IS points;

  PetscFunctionBegin;
  PetscCall(HycoSubmeshGetPoints(sub->dm, &points));
  PetscCall(ISGetLocalSize(points, &n));
  PetscCall(ISGetIndices(points, &point));
  PetscCall(PetscMalloc1(n, &number));
  PetscCall(PetscMalloc1(sub->n_nodes + 1, &sub->node_global));
  for (PetscInt k = 0; k < n; k++) number[k] = g->of[NUMBER][point[k]];
  for (PetscInt i = 0; i < sub->n_nodes; i++) {
    sub->node_global[i] = g->of[GLOBAL][point[sub->node_point[i]]];
    sub->node_whole[i] = g->of[WHOLE][point[sub->node_point[i]]];
  }
  for (PetscInt e = 0; e < sub->n_cells; e++) sub->cell_whole[e] = g->of[WHOLE][point[sub->cell_point[e]]];
  PetscCall(ISRestoreIndices(points, &point));
  PetscCall(HycoSubmeshSetPoints(sub->dm, n, number));
  /* first stays 0: rank 0 counts as the owner of all nodes of a gathered mesh, so that HycoMeshOwned() holds for
     each. */
  sub->n_owned = sub->n_whole_nodes = m->n_whole_nodes;
  sub->n_whole_cells = m->n_whole_cells;
  sub->whole_length = m->whole_length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the submesh. Rank 0. */
static PetscErrorCode MakeSubmesh(const Gather *g, HycoMesh *sub)
{
  PetscInt *keep, *extra, *all, n_keep = 0, n_extra = 0, n_all = 0;
  HycoMesh m;

  PetscFunctionBegin;
  PetscCall(HycoPlexToTables(g->root, PETSC_COMM_SELF, g->scene, &m));
  PetscCall(PetscMalloc3(m->n_cells, &keep, m->n_nodes, &extra, m->n_groups, &all));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (g->of[KIND][m->cell_point[e]] == CHOSEN) keep[n_keep++] = e;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (g->of[KIND][m->node_point[i]] == CHOSEN) extra[n_extra++] = i;
  }
  for (PetscInt k = 0; k < m->n_groups; k++) {
    m->group_dim[k] = g->part->group_dim[k]; /* also of groups without points here */
    /* Groups that are gathered as a whole keep the facets without a cell here. */
    if (g->in && g->in[k]) all[n_all++] = k;
  }
  /* The gathered points include cells that were only needed for their facets; the submesh drops them and makes their
     facets points. */
  HycoFinally(HycoSubmesh(g->scene, m, n_keep, keep, n_extra, extra, n_all, all, sub),
              PetscCall(PetscFree3(keep, extra, all));
              PetscCall(HycoMeshDestroy(&m)));
  PetscCall(GatherNumbers(g, *sub));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chosen cells, facets and nodes of a distributed mesh as one mesh on rank 0 (NULL elsewhere): groups in[] (NULL:
   everything) and cells cell[] (NULL: none). Rows, tags and unknowns keep the numbers of the distributed mesh.
   Collective; the cost is that of the chosen points, not of the mesh. */
PetscErrorCode HycoMeshGather(HycoScene scene, HycoMesh part, const PetscBool in[], const PetscBool cell[],
                              HycoMesh *mesh)
{
  Gather g = {.comm = HycoComm(part->dm), .scene = scene, .part = part, .in = in, .cell = cell};

  PetscFunctionBegin;
  *mesh = NULL;
  PetscCallMPI(MPI_Comm_rank(g.comm, &g.rank));
  PetscCall(GatherChoose(&g));
  /* Each rank cuts its own points before they travel. */
  PetscCall(CutShare(&g));
  PetscCall(GatherMigrate(&g));
  HycoOnRoot(g.comm, MakeSubmesh(&g, mesh));
  for (PetscInt c = 0; c < N_COLUMNS; c++) PetscCall(PetscFree(g.of[c]));
  PetscCall(PetscFree(g.kind));
  HycoDestroyAll(&g.share, &g.root);
  PetscFunctionReturn(PETSC_SUCCESS);
}
