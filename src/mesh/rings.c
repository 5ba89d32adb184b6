/*
  The facets around given nodes, wherever these are: the rank that owns a node has all cells around it, and sends the
  facets around it, with their nodes, to each rank that asks. What arrives becomes a mesh without cells (1D: with those
  of the facets, whose normals need them), in the order of the tags, so that sums over facets do not depend on the
  partition.
*/
#include <hycomesh.h>
#include <stdlib.h>

/* Rows of `width` integers for other ranks. */
typedef struct {
  PetscInt width, n, room, *row;
  PetscMPIInt *to;
} Rows;

/* A new row for a rank. */
static PetscErrorCode NextRow(Rows *r, PetscMPIInt to, PetscInt **row)
{
  PetscFunctionBegin;
  if (r->n == r->room) {
    r->room = 2 * r->room + 256;
    PetscCall(PetscRealloc((size_t)(r->room * r->width) * sizeof(PetscInt), &r->row));
    PetscCall(PetscRealloc((size_t)r->room * sizeof(PetscMPIInt), &r->to));
  }
  r->to[r->n] = to;
  *row = r->row + r->n++ * r->width;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first three entries of every kind of row identify it; the rest is the same from every sender. */
static int CompareThree(const void *a, const void *b)
{
  const PetscInt *x = (const PetscInt *)a, *y = (const PetscInt *)b;

  for (PetscInt k = 0; k < 3; k++) {
    if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
  }
  return 0;
}

/* Replaces the rows by those that this rank receives, sorted by their first three entries, each once. */
static PetscErrorCode RingsExchange(MPI_Comm comm, Rows *r)
{
  PetscInt *got, n = 0, n_got;

  PetscFunctionBegin;
  /* Rows come from all ranks that have the item, so that equal ones are dropped after the sort. */
  PetscCall(HycoSendRows(comm, r->n, r->to, (size_t)r->width * sizeof(PetscInt), r->row, &n_got, &got));
  if (n_got) qsort(got, (size_t)n_got, (size_t)r->width * sizeof(PetscInt), CompareThree);
  for (PetscInt k = 0; k < n_got; k++) {
    /* Source and target may overlap once rows were dropped, hence PetscArraymove(). */
    if (n && !CompareThree(got + k * r->width, got + (n - 1) * r->width)) continue;
    PetscCall(PetscArraymove(got + n++ * r->width, got + k * r->width, r->width));
  }
  HycoFreeAll(&r->row, &r->to);
  r->row = got;
  r->n = r->room = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Items by node of the part in CSR. */
typedef struct {
  PetscInt *start, *item;
} List;

/* Counts (item NULL) or lists an item at a node. */
static void RingsListItem(List *list, PetscInt node, PetscInt item)
{
  if (!list->item)
    list->start[node + 1]++;
  else
    list->item[list->start[node]++] = item;
}

typedef struct {
  HycoMesh part;
  const PetscBool *in;  /* by group */
  List facets, groups;  /* by node: facets of these groups around it; all groups that it is in */
  PetscMPIInt *took[2]; /* by node, by facet: the last rank, plus 1, for which it is packed */
  PetscInt *at;         /* by place of an owned node: its index */
  Rows node, member, facet, cell;
} Packing;

/* The facets around each node: also around the masters of its tied nodes, to which these pass their part. */
static void NoteFacets(Packing *p)
{
  HycoMesh m = p->part;

  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
    const PetscInt i = m->facets[k], tied = HycoMeshTied(m, i);

    /* Groups that no contact reads stay at home. */
    if (!p->in[m->facet_group[k / m->nf]]) continue;
    RingsListItem(&p->facets, i, k / m->nf);
    for (PetscInt j = tied < 0 ? 0 : m->tied_start[tied]; tied >= 0 && j < m->tied_start[tied + 1]; j++)
      RingsListItem(&p->facets, m->tied_master[j], k / m->nf);
  }
}

/* Not only the groups of in[]: the receiver looks up others by node too, for instance those of supports. */
static void NoteGroups(Packing *p)
{
  HycoMesh m = p->part;

  for (PetscInt g = 0; g < m->n_groups; g++) {
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) RingsListItem(&p->groups, m->group_node[j], g);
  }
}

/* Makes a list by counting first. */
static PetscErrorCode MakeList(Packing *p, List *list, void (*note)(Packing *))
{
  const PetscInt n = p->part->n_nodes;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n + 1, &list->start));
  note(p);
  for (PetscInt i = 0; i < n; i++) list->start[i + 1] += list->start[i];
  /* Never of 0 entries: the second pass is recognised by item != NULL. */
  PetscCall(PetscMalloc1(list->start[n] + 1, &list->item));
  note(p); /* start[i] advances to the end of i's items */
  for (PetscInt i = n; i > 0; i--) list->start[i] = list->start[i - 1];
  list->start[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Packs a node, once for each rank, with its groups and, if it is tied, its masters. */
static PetscErrorCode PackNode(Packing *p, PetscMPIInt to, PetscInt i)
{
  HycoMesh m = p->part;
  const PetscInt tied = HycoMeshTied(m, i);
  PetscInt *row;

  PetscFunctionBegin;
  /* A mark per rank suffices, because requests are processed in the order of the ranks. */
  if (p->took[0][i] == to + 1) PetscFunctionReturn(PETSC_SUCCESS);
  p->took[0][i] = to + 1;
  /* A node: tag, two zeros, body, its numbers in the vectors and in the file, and the bits of three coordinates. */
  PetscCall(NextRow(&p->node, to, &row));
  row[0] = m->node_id[i];
  row[1] = row[2] = 0;
  row[3] = m->node_body[i];
  row[4] = m->node_global[i];
  row[5] = m->node_whole[i];
  PetscCall(PetscMemcpy(row + 6, m->xyz + 3 * i, 3 * sizeof(PetscReal)));
  for (PetscInt k = p->groups.start[i]; k < p->groups.start[i + 1]; k++) {
    PetscCall(NextRow(&p->member, to, &row));
    row[0] = p->groups.item[k];
    row[1] = m->node_id[i];
    row[2] = 0;
  }
  for (PetscInt j = tied < 0 ? 0 : m->tied_start[tied]; tied >= 0 && j < m->tied_start[tied + 1]; j++)
    /* Recursion of one level: a master is not tied itself. */
    PetscCall(PackNode(p, to, m->tied_master[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of a facet, with its nodes, and in 1D of its cell. */
static PetscErrorCode PackFacet(Packing *p, PetscMPIInt to, PetscInt f)
{
  HycoMesh m = p->part;
  const PetscInt e = m->facet_cell[f];
  PetscInt *row;

  PetscFunctionBegin;
  if (p->took[1][f] == to + 1) PetscFunctionReturn(PETSC_SUCCESS);
  p->took[1][f] = to + 1;
  /* A facet: group, tag of its cell, number in it (the order of the tables of a whole mesh), then its nodes' tags. */
  PetscCall(NextRow(&p->facet, to, &row));
  row[0] = m->facet_group[f];
  row[1] = m->cell_id[e];
  row[2] = HycoMeshFacetNumber(m, f);
  for (PetscInt v = 0; v < m->nf; v++) row[3 + v] = m->node_id[m->facets[f * m->nf + v]];
  for (PetscInt v = 0; v < m->nf; v++) PetscCall(PackNode(p, to, m->facets[f * m->nf + v]));
  if (m->dim > 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(NextRow(&p->cell, to, &row));
  row[0] = m->cell_id[e];
  row[1] = row[2] = 0;
  row[3] = m->cell_body[e];
  row[4] = m->cell_whole[e];
  for (PetscInt v = 0; v < m->nv; v++) row[5 + v] = m->node_id[m->cells[e * m->nv + v]];
  for (PetscInt v = 0; v < m->nv; v++) PetscCall(PackNode(p, to, m->cells[e * m->nv + v]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Packs the answer to the requests (rank, number of a node in the distributed vectors), in the order of the ranks. */
static PetscErrorCode RingsPack(Packing *p, PetscInt n, const PetscInt request[])
{
  HycoMesh m = p->part;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(m->n_nodes, &p->took[0], m->n_facets, &p->took[1], m->n_owned, &p->at));
  PetscCall(MakeList(p, &p->facets, NoteFacets));
  PetscCall(MakeList(p, &p->groups, NoteGroups));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (HycoMeshOwned(m, i) >= 0) p->at[HycoMeshOwned(m, i)] = i;
  }
  for (PetscInt k = 0; k < n; k++) {
    /* Requests name nodes of the distributed vectors, which are contiguous per rank. */
    const PetscInt i = p->at[request[2 * k + 1] - m->first];

    PetscCall(PackNode(p, (PetscMPIInt)request[2 * k], i));
    /* The requested node is sent even if no facet is around it. */
    for (PetscInt j = p->facets.start[i]; j < p->facets.start[i + 1]; j++)
      PetscCall(PackFacet(p, (PetscMPIInt)request[2 * k], p->facets.item[j]));
  }
  HycoFreeAll(&p->facets.start, &p->facets.item, &p->groups.start, &p->groups.item);
  PetscCall(PetscFree3(p->took[0], p->took[1], p->at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of nodes arrive sorted by tag; bisection gives the index. */
static PetscInt RingsFind(HycoMesh m, PetscInt tag)
{
  PetscInt at = -1;

  (void)PetscFindInt(tag, m->n_nodes, m->node_id, &at);
  return at;
}

/* Nodes from the rows that arrived, sorted by tag; coordinates were sent as their bit patterns in integers. */
static PetscErrorCode PlaceNodes(HycoMesh m, const Rows *r)
{
  PetscFunctionBegin;
  m->n_nodes = r->n;
  PetscCall(PetscMalloc1(r->n, &m->node_id));
  PetscCall(PetscMalloc1(r->n, &m->node_body));
  PetscCall(PetscMalloc1(r->n + 1, &m->node_global));
  PetscCall(PetscMalloc1(r->n + 1, &m->node_whole));
  PetscCall(PetscMalloc1(3 * r->n, &m->xyz));
  for (PetscInt i = 0; i < r->n; i++) {
    const PetscInt *row = r->row + i * r->width;

    /* Columns as they were packed: tag, keys, body, global and whole number, coordinates. */
    m->node_id[i] = row[0];
    m->node_body[i] = row[3];
    m->node_global[i] = row[4];
    m->node_whole[i] = row[5];
    PetscCall(PetscMemcpy(m->xyz + 3 * i, row + 6, 3 * sizeof(PetscReal)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells arrive in 1D alone, where a facet is a point and needs its cell for the normal. */
static PetscErrorCode PlaceCells(HycoMesh m, const Rows *r)
{
  PetscFunctionBegin;
  m->n_cells = r->n;
  PetscCall(PetscMalloc1(r->n, &m->cell_id));
  PetscCall(PetscMalloc1(r->n, &m->cell_body));
  PetscCall(PetscMalloc1(r->n + 1, &m->cell_whole));
  PetscCall(PetscMalloc1(r->n * m->nv, &m->cells));
  for (PetscInt e = 0; e < r->n; e++) {
    const PetscInt *row = r->row + e * r->width;

    m->cell_id[e] = row[0];
    m->cell_body[e] = row[3];
    m->cell_whole[e] = row[4];
    for (PetscInt v = 0; v < m->nv; v++) m->cells[e * m->nv + v] = RingsFind(m, row[5 + v]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet refers to nodes by tag: on this rank they have other numbers than on the one that sent it. */
static PetscErrorCode PlaceFacets(HycoMesh m, const Rows *r)
{
  PetscFunctionBegin;
  m->n_facets = r->n;
  PetscCall(PetscMalloc1(r->n, &m->facet_group));
  PetscCall(PetscMalloc1(r->n, &m->facet_cell));
  PetscCall(PetscMalloc1(r->n * m->nf, &m->facets));
  for (PetscInt f = 0; f < r->n; f++) {
    const PetscInt *row = r->row + f * r->width;

    m->facet_group[f] = row[0];
    m->facet_cell[f] = -1;
    /* Cells arrive in 1D alone; elsewhere the facet has no cell. */
    if (m->n_cells) PetscCall(PetscFindInt(row[1], m->n_cells, m->cell_id, &m->facet_cell[f]));
    for (PetscInt v = 0; v < m->nf; v++) m->facets[f * m->nf + v] = RingsFind(m, row[3 + v]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank has all groups in the same order, though perhaps without nodes: the indices of groups agree with the
   part's. */
static PetscErrorCode PlaceGroups(HycoMesh m, HycoMesh part, const Rows *r)
{
  PetscFunctionBegin;
  m->n_groups = part->n_groups;
  PetscCall(PetscMalloc1(m->n_groups, &m->group_name));
  for (PetscInt g = 0; g < m->n_groups; g++) PetscCall(PetscStrallocpy(part->group_name[g], &m->group_name[g]));
  HycoDuplicate(m->n_groups, part->group_dim, &m->group_dim);
  PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_start));
  PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_cell_start));
  PetscCall(PetscMalloc1(r->n, &m->group_node));
  /* Members are sorted by group, then tag: already CSR. */
  for (PetscInt k = 0; k < r->n; k++) {
    m->group_start[r->row[k * r->width] + 1]++;
    m->group_node[k] = RingsFind(m, r->row[k * r->width + 1]);
  }
  for (PetscInt g = 0; g < m->n_groups; g++) m->group_start[g + 1] += m->group_start[g];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh of what has arrived. */
static PetscErrorCode MakeMesh(const Packing *p, HycoMesh *mesh)
{
  HycoMesh part = p->part, m;

  PetscFunctionBegin;
  PetscCall(PetscNew(mesh));
  m = *mesh;
  m->dim = part->dim;
  m->nv = part->nv;
  m->nf = part->nf;
  m->type = part->type;
  m->mixed = part->mixed;
  /* The part's own range of numbers, so that HycoMeshOwned() tells which nodes of the ring this rank owns. */
  m->n_owned = part->n_owned;
  m->first = part->first;
  m->n_whole_nodes = part->n_whole_nodes;
  m->n_whole_cells = part->n_whole_cells;
  m->whole_length = part->whole_length;
  PetscCall(PlaceNodes(m, &p->node));
  PetscCall(PlaceCells(m, &p->cell));
  PetscCall(PlaceFacets(m, &p->facet));
  PetscCall(PlaceGroups(m, part, &p->member));
  PetscCall(HycoMeshSetTies(m, part->ties));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of groups in[] around n nodes (numbers in the distributed vectors, from any rank), as a mesh of this
   rank. Two messages between neighbours: requests, then rows. Memory is that of the rings. Collective; the caller
   destroys the mesh. */
PetscErrorCode HycoMeshRings(MPI_Comm comm, HycoScene scene, HycoMesh part, const PetscBool in[], PetscInt n,
                             const PetscInt node[], HycoMesh *mesh)
{
  Packing p = {.part = part, .in = in};
  PetscMPIInt *to;
  PetscInt *ask, *asked, n_asked;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &to, 2 * n, &ask));
  PetscCall(HycoMeshOwners(comm, part, n, node, to));
  for (PetscInt k = 0; k < n; k++) {
    ask[2 * k] = HycoRank(comm);
    ask[2 * k + 1] = node[k];
  }
  PetscCall(HycoSendRows(comm, n, to, 2 * sizeof(PetscInt), ask, &n_asked, &asked));
  PetscCall(PetscFree2(to, ask));
  /* Three reals need 6 integers of 32 bits, 3 of 64: rounded up. */
  p.node.width = 6 + (PetscInt)((3 * sizeof(PetscReal) + sizeof(PetscInt) - 1) / sizeof(PetscInt));
  p.member.width = 3;
  p.facet.width = 3 + part->nf;
  p.cell.width = 5 + part->nv;
  PetscCall(RingsPack(&p, n_asked, asked));
  PetscCall(PetscFree(asked));
  PetscCall(RingsExchange(comm, &p.node));
  PetscCall(RingsExchange(comm, &p.member));
  PetscCall(RingsExchange(comm, &p.facet));
  PetscCall(RingsExchange(comm, &p.cell));
  PetscCall(MakeMesh(&p, mesh));
  PetscCall(HycoMeshCreateDM(scene, *mesh));
  HycoFreeAll(&p.node.row, &p.node.to, &p.member.row, &p.member.to, &p.facet.row, &p.facet.to, &p.cell.row, &p.cell.to);
  PetscFunctionReturn(PETSC_SUCCESS);
}
