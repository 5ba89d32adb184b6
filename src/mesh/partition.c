/*
  A PetscPartitioner that cuts the graph of cells that share a facet. Edges between the cells on the two sides of a
  contact are heavy, so that no cut separates them. METIS; PT-Scotch (through PETSc) on request and if METIS fails.
*/
#include "plex.h"
#include <metis.h>
#include <petsc/private/partitionerimpl.h>
#include <petscmat.h>

/* A cut contact costs as much as 1000 cut facets (METIS has integer weights). */
#define CUT_CONTACT_COST 1000

/* Neighbours of each cell in CSR, with the weight of each edge. */
typedef struct {
  idx_t *xadj, *adjncy, *weight;
} Graph;

const char *const HycoPartitioners[] = {"metis", "ptscotch", NULL};

/* The cell graph: cells sharing a facet, plus cells on the two sides of a contact. */
static PetscErrorCode CellGraph(HycoMesh m, PetscInt n_pairs, const PetscInt pairs[], Graph *graph)
{
  idx_t ne = (idx_t)m->n_cells, nn = (idx_t)m->n_nodes, zero = 0, *eptr, *eind, *x, *a;
  idx_t ncommon = (idx_t)(m->mixed ? m->dim : m->nf); /* in a mixed mesh the nodes of the smallest facets */
  PetscInt *start, *around, *extra_of, n_extra = 0;
  idx_t *tie;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(ne + 1, &eptr, m->n_cells * m->nv, &eind));
  eptr[0] = 0;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt node[HYCO_CELL_NODES];
    const PetscInt n = HycoMeshOwnNodes(m, e, node);

    for (PetscInt v = 0; v < n; v++) eind[eptr[e] + v] = (idx_t)node[v];
    eptr[e + 1] = eptr[e] + (idx_t)n;
  }
  PetscCheck(METIS_MeshToDual(&ne, &nn, eptr, eind, &ncommon, &zero, &x, &a) == METIS_OK, PETSC_COMM_SELF,
             PETSC_ERR_LIB, "METIS_MeshToDual failed");
  PetscCall(PetscFree2(eptr, eind));
  PetscCall(HycoMeshNodeCells(m, &start, &around));
  /* One edge for each pair of nodes, between the first cells of the two. extra_of counts, tie lists both ends. */
  PetscCall(PetscMalloc2(m->n_cells + 1, &extra_of, 2 * n_pairs, &tie));
  PetscCall(PetscArrayzero(extra_of, m->n_cells + 1));
  for (PetscInt k = 0; k < n_pairs; k++) {
    for (PetscInt side = 0; side < 2; side++) tie[2 * n_extra + side] = (idx_t)around[start[pairs[2 * k + side]]];
    if (tie[2 * n_extra] == tie[2 * n_extra + 1]) continue;
    for (PetscInt side = 0; side < 2; side++) extra_of[tie[2 * n_extra + side]]++;
    n_extra++;
  }
  PetscCall(PetscMalloc1(m->n_cells + 1, &graph->xadj));
  PetscCall(PetscMalloc1(x[ne] + 2 * n_extra, &graph->adjncy));
  PetscCall(PetscMalloc1(x[ne] + 2 * n_extra, &graph->weight));
  graph->xadj[0] = 0;
  for (idx_t e = 0; e < ne; e++) {
    idx_t at = graph->xadj[e];

    for (idx_t k = x[e]; k < x[e + 1]; k++, at++) {
      graph->adjncy[at] = a[k];
      graph->weight[at] = 1;
    }
    graph->xadj[e + 1] = at + (idx_t)extra_of[e];
    /* From here on the next free place of cell e's heavy edges, no longer their number. */
    extra_of[e] = (PetscInt)at;
  }
  for (PetscInt k = 0; k < n_extra; k++) {
    for (PetscInt side = 0; side < 2; side++) {
      const PetscInt at = extra_of[tie[2 * k + side]]++;

      graph->adjncy[at] = tie[2 * k + 1 - side];
      graph->weight[at] = CUT_CONTACT_COST;
    }
  }
  METIS_Free(x);
  METIS_Free(a);
  PetscCall(PetscFree2(extra_of, tie));
  HycoFreeAll(&start, &around);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* METIS with edge weights alone: cells cost the same. Returns done = false on any failure, for instance of memory. */
static PetscErrorCode ByMetis(PetscInt n, const Graph *g, PetscInt n_parts, PetscInt part[], PetscBool *done)
{
  idx_t ne = (idx_t)n, ncon = 1, parts = (idx_t)n_parts, cut, *p;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &p));
  *done = (PetscBool)(METIS_PartGraphKway(&ne, &ncon, g->xadj, g->adjncy, NULL, NULL, g->weight, &parts, NULL, NULL,
                                          NULL, &cut, p) == METIS_OK);
  /* idx_t is METIS's integer, of 32 or 64 bits, and need not be PetscInt. */
  for (PetscInt e = 0; e < n; e++) part[e] = (PetscInt)p[e];
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PT-Scotch by PETSc's MatPartitioning on this process, for the same graph. Copies, since METIS's integers may be of
   another size than PETSc's. */
static PetscErrorCode ByScotch(PetscInt n, const Graph *g, PetscInt n_parts, PetscInt part[])
{
  PetscInt *i, *j, *weight;
  Mat graph;
  MatPartitioning partitioning;
  IS is;
  const PetscInt *p;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &i));
  PetscCall(PetscMalloc1(g->xadj[n], &j));
  PetscCall(PetscMalloc1(g->xadj[n], &weight));
  for (PetscInt e = 0; e <= n; e++) i[e] = (PetscInt)g->xadj[e];
  for (PetscInt k = 0; k < i[n]; k++) {
    j[k] = (PetscInt)g->adjncy[k];
    weight[k] = (PetscInt)g->weight[k];
  }
  PetscCall(MatCreateMPIAdj(PETSC_COMM_SELF, n, n, i, j, weight, &graph)); /* takes ownership of the arrays */
  PetscCall(MatPartitioningCreate(PETSC_COMM_SELF, &partitioning));
  PetscCall(MatPartitioningSetAdjacency(partitioning, graph));
  PetscCall(MatPartitioningSetType(partitioning, MATPARTITIONINGPTSCOTCH));
  PetscCall(MatPartitioningSetNParts(partitioning, n_parts));
  /* Heavy edges hold both sides of a contact on one rank. */
  PetscCall(MatPartitioningSetUseEdgeWeights(partitioning, PETSC_TRUE));
  PetscCall(MatPartitioningApply(partitioning, &is));
  PetscCall(ISGetIndices(is, &p));
  PetscCall(PetscArraycpy(part, p, n));
  PetscCall(ISRestoreIndices(is, &p));
  PetscCall(ISDestroy(&is));
  PetscCall(MatPartitioningDestroy(&partitioning));
  PetscCall(MatDestroy(&graph));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives each part that has no cell one of the largest part, while that has two: METIS leaves parts of a few cells
   empty, and a rank without cells works for nothing. From the last cells on, which leaves the largest part connected as
   a rule. */
static PetscErrorCode FillParts(PetscInt n, PetscInt n_parts, PetscInt part[])
{
  PetscInt *size;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n_parts, &size));
  for (PetscInt c = 0; c < n; c++) size[part[c]]++;
  for (PetscInt p = 0; p < n_parts; p++) {
    PetscInt largest = 0;

    for (PetscInt k = 1; k < n_parts; k++) {
      if (size[k] > size[largest]) largest = k;
    }
    if (size[p] || size[largest] < 2) continue;
    /* Ends: the largest part has at least two cells. */
    for (PetscInt c = n - 1; !size[p]; c--) {
      if (part[c] == largest) part[c] = p, size[p] = 1, size[largest]--;
    }
  }
  PetscCall(PetscFree(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data that DMPlexDistribute() does not pass on: the mesh and its contacts. Borrowed. */
typedef struct {
  HycoMesh mesh; /* NULL if there are no cells */
  PetscInt n_pairs;
  const PetscInt *pairs;
  HycoPartitioner by;
} Data;

/* METIS fails for graphs that PT-Scotch divides; the fallback keeps the run alive. */
static PetscErrorCode PartitionCut(const Data *d, PetscInt n_parts, PetscInt part[])
{
  Graph graph;
  PetscBool done = PETSC_FALSE;

  PetscFunctionBegin;
  /* METIS does not expect fewer cells than parts. */
  for (PetscInt e = 0; e < d->mesh->n_cells; e++) part[e] = e;
  if (d->mesh->n_cells <= n_parts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CellGraph(d->mesh, d->n_pairs, d->pairs, &graph));
  if (d->by == HYCO_PARTITION_METIS) PetscCall(ByMetis(d->mesh->n_cells, &graph, n_parts, part, &done));
  if (!done) PetscCall(ByScotch(d->mesh->n_cells, &graph, n_parts, part));
  PetscCall(FillParts(d->mesh->n_cells, n_parts, part));
  HycoFreeAll(&graph.xadj, &graph.adjncy, &graph.weight);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the cells by part. The operation of a PetscPartitioner: sizes per part, and the cells grouped by part,
   ascending in each. All cells are on rank 0; other ranks have n = 0. */
static PetscErrorCode PartitionCells(PetscPartitioner partitioner, PetscInt n_parts, PetscInt n, PetscInt start[],
                                     PetscInt adjacent[], PetscSection weights,
                                     HYCO_EDGE_WEIGHTS_ARGUMENT PetscSection targets, PetscSection sizes, IS *partition)
{
  Data *d = (Data *)partitioner->data;
  PetscInt *part, *cells, at = 0;

  PetscFunctionBegin;
  (void)start, (void)adjacent, (void)weights, (void)targets;
  PetscCall(PetscMalloc1(n, &part));
  HycoOnEach(PetscObjectComm((PetscObject)partitioner), n && d->mesh ? PartitionCut(d, n_parts, part) : PETSC_SUCCESS);
  for (PetscInt c = 0; c < n; c++) PetscCall(PetscSectionAddDof(sizes, part[c], 1));
  PetscCall(PetscMalloc1(n, &cells));
  for (PetscInt p = 0; p < n_parts; p++) {
    for (PetscInt c = 0; c < n; c++) {
      /* Cells ascending within a part: the order of the mesh file survives distribution. */
      if (part[c] == p) cells[at++] = c;
    }
  }
  PetscCall(PetscFree(part));
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)partitioner), n, cells, PETSC_OWN_POINTER, partition));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only the copy of Data is owned, not what it points to. */
static PetscErrorCode PartitionDestroy(PetscPartitioner partitioner)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(partitioner->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called by PetscPartitionerSetType(), before HycoPartitionerSetMesh() fills the data. Registered as a type of
   PetscPartitioner, so that DMPlexDistribute() uses it. */
static PetscErrorCode PartitionCreate(PetscPartitioner partitioner)
{
  Data *d;

  PetscFunctionBegin;
  PetscCall(PetscNew(&d));
  partitioner->data = d;
  partitioner->noGraph = PETSC_TRUE; /* DMPlex's graph would have an edge for each vertex that two cells share */
  partitioner->ops->partition = PartitionCells;
  partitioner->ops->destroy = PartitionDestroy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Registering again is harmless, and no start of the library has to do it. `pairs`: 2 x n_pairs node indices,
   slave and master. Borrows mesh and pairs until the partition is made. */
PetscErrorCode HycoPartitionerSetMesh(PetscPartitioner partitioner, HycoMesh mesh, PetscInt n_pairs,
                                      const PetscInt pairs[], HycoPartitioner by)
{
  const Data data = {mesh, n_pairs, pairs, by};

  PetscFunctionBegin;
  /* PETSc replaces an entry of the same name. The type is set in code, so that -petscpartitioner_type has no effect
     here. */
  PetscCall(PetscPartitionerRegister(HYCO_PARTITIONER, PartitionCreate));
  PetscCall(PetscPartitionerSetType(partitioner, HYCO_PARTITIONER));
  *(Data *)partitioner->data = data;
  PetscFunctionReturn(PETSC_SUCCESS);
}
