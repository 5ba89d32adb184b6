/* Gathers a distributed mesh on rank 0: all of it, or the surfaces of some groups. */
#include <hycomesh.h>
#include <stdlib.h>
#include <string.h>

/* Rows of integers that one rank sends; on rank 0 all rows, sorted by their first entries. */
typedef struct {
  PetscInt width, n, room, n_all;
  PetscInt *mine, *all;
} Rows;

static PetscErrorCode AddRow(Rows *r, const PetscInt row[])
{
  PetscFunctionBegin;
  if (r->n == r->room) {
    r->room = 2 * r->room + 64;
    PetscCall(PetscRealloc((size_t)(r->room * r->width) * sizeof(PetscInt), &r->mine));
  }
  PetscCall(PetscArraycpy(r->mine + r->n++ * r->width, row, r->width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareThree(const void *a, const void *b)
{
  const PetscInt *x = (const PetscInt *)a, *y = (const PetscInt *)b;

  for (PetscInt k = 0; k < 3; k++) {
    if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
  }
  return 0;
}

static PetscErrorCode GatherRows(MPI_Comm comm, Rows *r)
{
  PetscFunctionBegin;
  PetscCall(HycoConcatenate(comm, r->n * r->width, r->mine, MPIU_INT, sizeof(PetscInt), &r->n_all, &r->all));
  PetscCall(PetscFree(r->mine));
  r->n_all /= r->width;
  if (r->n_all) qsort(r->all, (size_t)r->n_all, (size_t)r->width * sizeof(PetscInt), CompareThree);
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  HycoMesh part;
  const PetscBool *in;   /* by group; NULL: all of the mesh */
  const PetscBool *keep; /* by cell, in addition to the groups; NULL: none */
  PetscBool *take;       /* by node of the part */
  Rows node, cell, facet, member, region;
} Gather;

static PetscBool Owns(const Gather *g, PetscInt node)
{
  return (PetscBool)(HycoMeshOwned(g->part, node) >= 0);
}

static PetscBool Keeps(const Gather *g, PetscInt cell)
{
  return (PetscBool)(!g->in || (g->keep && g->keep[cell]));
}

/* The row of a node: tag, 0, 0, body, numbers in the distributed vectors and in the whole mesh; of a cell, which
   belongs to the rank of its first node: tag, 0, 0, body, number in the whole mesh, nodes' tags; of a facet: group,
   tag of its cell, index among this rank's, nodes' tags. */
static PetscErrorCode Pack(Gather *g)
{
  HycoMesh m = g->part;
  PetscInt row[5 + HYCO_CELL_NODES] = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &g->take));
  for (PetscInt i = 0; i < m->n_nodes; i++) g->take[i] = (PetscBool)!g->in;
  for (PetscInt k = 0; k < m->n_groups; k++) {
    for (PetscInt j = m->group_start[k]; g->in && g->in[k] && j < m->group_start[k + 1]; j++)
      g->take[m->group_node[j]] = PETSC_TRUE;
  }
  for (PetscInt e = 0; g->keep && e < m->n_cells; e++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n = HycoMeshCellNodes(m, e, node);

    for (PetscInt v = 0; v < n && g->keep[e]; v++) g->take[node[v]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < m->n_tied; k++) { /* and the masters of tied nodes */
    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++)
      g->take[m->tied_master[j]] = (PetscBool)(g->take[m->tied_master[j]] || g->take[m->tied[k]]);
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt node[6] = {m->node_id[i], 0, 0, m->node_body[i], m->node_global[i], m->node_whole[i]};

    g->take[i] = (PetscBool)(g->take[i] && Owns(g, i));
    if (g->take[i]) PetscCall(AddRow(&g->node, node));
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (!Keeps(g, e) || !Owns(g, m->cells[e * m->nv])) continue;
    row[0] = m->cell_id[e];
    row[1] = row[2] = 0;
    row[3] = m->cell_body[e];
    row[4] = m->cell_whole[e];
    for (PetscInt v = 0; v < m->nv; v++) row[5 + v] = m->node_id[m->cells[e * m->nv + v]];
    PetscCall(AddRow(&g->cell, row));
  }
  for (PetscInt f = 0; f < m->n_facets; f++) {
    PetscInt least = m->facets[f * m->nf]; /* a facet belongs to the rank of its node with the smallest tag */

    for (PetscInt v = 1; v < m->nf; v++) least = PetscMin(least, m->facets[f * m->nf + v]);
    if (!Owns(g, least) || (g->in && !g->in[m->facet_group[f]] && !Keeps(g, m->facet_cell[f]))) continue;
    row[0] = m->facet_group[f];
    row[1] = m->cell_id[m->facet_cell[f]];
    row[2] = f;
    for (PetscInt v = 0; v < m->nf; v++) row[3 + v] = m->node_id[m->facets[f * m->nf + v]];
    PetscCall(AddRow(&g->facet, row));
  }
  for (PetscInt k = 0; k < m->n_groups; k++) {
    const PetscInt group[3] = {k, 0, 0};

    PetscCall(PetscArraycpy(row, group, 3));
    for (PetscInt j = m->group_start[k]; j < m->group_start[k + 1]; j++) {
      row[1] = m->node_id[m->group_node[j]];
      if (g->take[m->group_node[j]]) PetscCall(AddRow(&g->member, row));
    }
    for (PetscInt j = m->group_cell_start[k]; j < m->group_cell_start[k + 1]; j++) {
      const PetscInt e = m->group_cell[j];

      row[1] = m->cell_id[e];
      if (Keeps(g, e) && Owns(g, m->cells[e * m->nv])) PetscCall(AddRow(&g->region, row));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index of a tag, or -1. */
static PetscInt Find(PetscInt n, const PetscInt tag[], PetscInt value)
{
  PetscInt at = -1;

  (void)PetscFindInt(value, n, tag, &at);
  return at < 0 ? -1 : at;
}

/* Sets the coordinates of the nodes in the order of their tags; they arrive in the order of the ranks, with tags
   `sent`. */
static PetscErrorCode PlaceNodes(Gather *g, HycoMesh m, PetscInt n, const PetscInt sent[], const PetscReal xyz[])
{
  PetscFunctionBegin;
  m->n_nodes = n;
  PetscCall(PetscMalloc1(n, &m->node_id));
  PetscCall(PetscMalloc1(n, &m->node_body));
  PetscCall(PetscMalloc1(n, &m->node_global));
  PetscCall(PetscMalloc1(n, &m->node_whole));
  PetscCall(PetscMalloc1(3 * n, &m->xyz));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt *row = g->node.all + i * g->node.width;

    m->node_id[i] = row[0];
    m->node_body[i] = row[3];
    m->node_global[i] = row[4];
    m->node_whole[i] = row[5];
  }
  for (PetscInt k = 0; k < n; k++) PetscCall(PetscArraycpy(m->xyz + 3 * Find(n, m->node_id, sent[k]), xyz + 3 * k, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PlaceCells(Gather *g, HycoMesh m)
{
  const PetscInt width = g->cell.width;

  PetscFunctionBegin;
  m->n_cells = g->cell.n_all;
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_id));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_body));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_whole));
  PetscCall(PetscMalloc1(m->n_cells * m->nv, &m->cells));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    m->cell_id[e] = g->cell.all[e * width];
    m->cell_body[e] = g->cell.all[e * width + 3];
    m->cell_whole[e] = g->cell.all[e * width + 4];
    for (PetscInt v = 0; v < m->nv; v++)
      m->cells[e * m->nv + v] = Find(m->n_nodes, m->node_id, g->cell.all[e * width + 5 + v]);
  }
  m->n_facets = g->facet.n_all;
  PetscCall(PetscMalloc1(m->n_facets, &m->facet_group));
  PetscCall(PetscMalloc1(m->n_facets, &m->facet_cell));
  PetscCall(PetscMalloc1(m->n_facets * m->nf, &m->facets));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *row = g->facet.all + f * g->facet.width;

    m->facet_group[f] = row[0];
    m->facet_cell[f] = Find(m->n_cells, m->cell_id, row[1]);
    for (PetscInt v = 0; v < m->nf; v++) m->facets[f * m->nf + v] = Find(m->n_nodes, m->node_id, row[3 + v]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* CSR lists over the groups from rows (group, tag, 0). */
static PetscErrorCode PlaceMembers(PetscInt n_groups, const Rows *r, PetscInt n, const PetscInt tag[], PetscInt **start,
                                   PetscInt **member)
{
  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n_groups + 1, start));
  PetscCall(PetscMalloc1(r->n_all, member));
  for (PetscInt k = 0; k < r->n_all; k++) {
    (*start)[r->all[3 * k] + 1]++;
    (*member)[k] = Find(n, tag, r->all[3 * k + 1]);
  }
  for (PetscInt g = 0; g < n_groups; g++) (*start)[g + 1] += (*start)[g];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshGather(MPI_Comm comm, HycoMesh part, const PetscBool in[], const PetscBool cell[],
                              HycoMesh *mesh)
{
  Gather g = {.part = part, .in = in, .keep = cell};
  PetscMPIInt rank;
  PetscReal *xyz, *all;
  PetscInt *tag, *sent, n, k = 0;
  HycoMesh m;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  g.node.width = 6;
  g.cell.width = 5 + part->nv;
  g.facet.width = 3 + part->nf;
  g.member.width = g.region.width = 3;
  PetscCall(Pack(&g));
  PetscCall(PetscMalloc2(3 * g.node.n, &xyz, g.node.n, &tag));
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    if (!g.take[i]) continue;
    tag[k] = part->node_id[i];
    PetscCall(PetscArraycpy(xyz + 3 * k++, part->xyz + 3 * i, 3));
  }
  PetscCall(HycoConcatenate(comm, 3 * k, xyz, MPIU_REAL, sizeof(PetscReal), &n, &all));
  PetscCall(HycoConcatenate(comm, k, tag, MPIU_INT, sizeof(PetscInt), &n, &sent));
  PetscCall(PetscFree2(xyz, tag));
  PetscCall(GatherRows(comm, &g.node));
  PetscCall(GatherRows(comm, &g.cell));
  PetscCall(GatherRows(comm, &g.facet));
  PetscCall(GatherRows(comm, &g.member));
  PetscCall(GatherRows(comm, &g.region));
  *mesh = NULL;
  if (rank == 0) {
    PetscCall(PetscNew(&m));
    m->dim = part->dim;
    m->nv = part->nv;
    m->nf = part->nf;
    m->type = part->type;
    m->mixed = part->mixed;
    m->n_owned = m->n_whole_nodes = part->n_whole_nodes; /* rank 0 owns all */
    m->n_whole_cells = part->n_whole_cells;
    m->whole_length = part->whole_length;
    m->n_groups = part->n_groups;
    PetscCall(PetscMalloc1(m->n_groups, &m->group_name));
    for (PetscInt j = 0; j < m->n_groups; j++) PetscCall(PetscStrallocpy(part->group_name[j], &m->group_name[j]));
    HycoDuplicate(m->n_groups, part->group_dim, &m->group_dim);
    PetscCall(PlaceNodes(&g, m, n, sent, all));
    PetscCall(PlaceCells(&g, m));
    PetscCall(PlaceMembers(m->n_groups, &g.member, m->n_nodes, m->node_id, &m->group_start, &m->group_node));
    PetscCall(HycoMeshSetTies(m, part->ties));
    PetscCall(PlaceMembers(m->n_groups, &g.region, m->n_cells, m->cell_id, &m->group_cell_start, &m->group_cell));
    *mesh = m;
  }
  PetscCall(PetscFree(all));
  PetscCall(PetscFree(sent));
  PetscCall(PetscFree(g.take));
  PetscCall(PetscFree(g.node.all));
  PetscCall(PetscFree(g.cell.all));
  PetscCall(PetscFree(g.facet.all));
  PetscCall(PetscFree(g.member.all));
  PetscCall(PetscFree(g.region.all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
