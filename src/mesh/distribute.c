/*
  The mesh over the ranks: rank 0 cuts the cell graph with METIS, paired contact cells tied by heavy edges, and sends
  each rank the cells that touch the nodes it owns. Each rank can then assemble its rows without its neighbours.
*/
#include <hycomesh.h>

/* owner[i] = rank of node i: the lowest rank among its cells'; a master follows its slave (of several the last). */
static PetscErrorCode OwnNodes(PetscMPIInt size, HycoMesh m, PetscInt n_pairs, const PetscInt pairs[],
                               HycoPartitioner partitioner, PetscInt owner[])
{
  PetscInt *part;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells, &part));
  PetscCall(HycoMeshPartition(m, n_pairs, pairs, partitioner, size, part));
  for (PetscInt i = 0; i < m->n_nodes; i++) owner[i] = size;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) owner[m->cells[k]] = PetscMin(owner[m->cells[k]], part[k / m->nv]);
  for (PetscInt k = 0; k < n_pairs; k++) owner[pairs[2 * k + 1]] = owner[pairs[2 * k]];
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SendInts(MPI_Comm comm, PetscMPIInt to, PetscInt n, const PetscInt data[])
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Send(&n, 1, MPIU_INT, to, 1, comm));
  PetscCallMPI(MPI_Send(data, (PetscMPIInt)n, MPIU_INT, to, 2, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReceiveInts(MPI_Comm comm, PetscInt *n, PetscInt **data)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Recv(n, 1, MPIU_INT, 0, 1, comm, MPI_STATUS_IGNORE));
  PetscCall(PetscMalloc1(*n, data));
  PetscCallMPI(MPI_Recv(*data, (PetscMPIInt)*n, MPIU_INT, 0, 2, comm, MPI_STATUS_IGNORE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SendMesh(MPI_Comm comm, PetscMPIInt to, HycoMesh m)
{
  const PetscInt head[5] = {m->dim, m->nv, m->nf, (PetscInt)m->type, m->n_groups};

  PetscFunctionBegin;
  PetscCall(SendInts(comm, to, 5, head));
  PetscCall(SendInts(comm, to, m->n_nodes, m->node_id));
  PetscCall(SendInts(comm, to, m->n_nodes, m->node_body));
  PetscCall(SendInts(comm, to, m->n_nodes, m->node_global));
  PetscCall(SendInts(comm, to, m->n_nodes, m->node_whole));
  PetscCallMPI(MPI_Send(m->xyz, (PetscMPIInt)(3 * m->n_nodes), MPIU_REAL, to, 3, comm));
  PetscCall(SendInts(comm, to, m->n_cells * m->nv, m->cells));
  PetscCall(SendInts(comm, to, m->n_cells, m->cell_id));
  PetscCall(SendInts(comm, to, m->n_cells, m->cell_body));
  PetscCall(SendInts(comm, to, m->n_cells, m->cell_whole));
  PetscCall(SendInts(comm, to, m->n_groups, m->group_dim));
  PetscCall(SendInts(comm, to, m->n_groups + 1, m->group_start));
  PetscCall(SendInts(comm, to, m->group_start[m->n_groups], m->group_node));
  PetscCall(SendInts(comm, to, m->n_groups + 1, m->group_cell_start));
  PetscCall(SendInts(comm, to, m->group_cell_start[m->n_groups], m->group_cell));
  PetscCall(SendInts(comm, to, m->n_facets * m->nf, m->facets));
  PetscCall(SendInts(comm, to, m->n_facets, m->facet_group));
  PetscCall(SendInts(comm, to, m->n_facets, m->facet_cell));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    char name[256];

    PetscCall(PetscStrncpy(name, m->group_name[g], sizeof(name)));
    PetscCallMPI(MPI_Send(name, sizeof(name), MPI_CHAR, to, 4, comm));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReceiveMesh(MPI_Comm comm, HycoMesh *mesh)
{
  HycoMesh m;
  PetscInt n, *head;

  PetscFunctionBegin;
  PetscCall(PetscNew(&m));
  PetscCall(ReceiveInts(comm, &n, &head));
  m->dim = head[0];
  m->nv = head[1];
  m->nf = head[2];
  m->type = (HycoCellType)head[3];
  m->n_groups = head[4];
  PetscCall(PetscFree(head));
  PetscCall(ReceiveInts(comm, &m->n_nodes, &m->node_id));
  PetscCall(ReceiveInts(comm, &n, &m->node_body));
  PetscCall(ReceiveInts(comm, &n, &m->node_global));
  PetscCall(ReceiveInts(comm, &n, &m->node_whole));
  PetscCall(PetscMalloc1(3 * m->n_nodes, &m->xyz));
  PetscCallMPI(MPI_Recv(m->xyz, (PetscMPIInt)(3 * m->n_nodes), MPIU_REAL, 0, 3, comm, MPI_STATUS_IGNORE));
  PetscCall(ReceiveInts(comm, &n, &m->cells));
  PetscCall(ReceiveInts(comm, &m->n_cells, &m->cell_id));
  PetscCall(ReceiveInts(comm, &n, &m->cell_body));
  PetscCall(ReceiveInts(comm, &n, &m->cell_whole));
  PetscCall(ReceiveInts(comm, &n, &m->group_dim));
  PetscCall(ReceiveInts(comm, &n, &m->group_start));
  PetscCall(ReceiveInts(comm, &n, &m->group_node));
  PetscCall(ReceiveInts(comm, &n, &m->group_cell_start));
  PetscCall(ReceiveInts(comm, &n, &m->group_cell));
  PetscCall(ReceiveInts(comm, &n, &m->facets));
  PetscCall(ReceiveInts(comm, &m->n_facets, &m->facet_group));
  PetscCall(ReceiveInts(comm, &n, &m->facet_cell));
  PetscCall(PetscMalloc1(m->n_groups, &m->group_name));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    char name[256];

    PetscCallMPI(MPI_Recv(name, sizeof(name), MPI_CHAR, 0, 4, comm, MPI_STATUS_IGNORE));
    PetscCall(PetscStrallocpy(name, &m->group_name[g]));
  }
  *mesh = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of rank r: the cells that touch a node of r. */
static PetscErrorCode CutPart(HycoMesh whole, PetscInt r, const PetscInt owner[], const PetscInt global[],
                              HycoMesh *part)
{
  PetscInt *keep, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(whole->n_cells, &keep));
  for (PetscInt e = 0; e < whole->n_cells; e++) {
    PetscBool mine = PETSC_FALSE;

    for (PetscInt v = 0; v < whole->nv; v++) mine = (PetscBool)(mine || owner[whole->cells[e * whole->nv + v]] == r);
    if (mine) keep[n++] = e;
  }
  PetscCall(HycoMeshExtract(whole, n, keep, 0, NULL, 0, NULL, part));
  PetscCall(PetscMalloc1((*part)->n_nodes, &(*part)->node_global));
  for (PetscInt i = 0; i < (*part)->n_nodes; i++) (*part)->node_global[i] = global[(*part)->node_whole[i]];
  PetscCall(PetscFree(keep));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshDistribute(MPI_Comm comm, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner partitioner, HycoMesh *part, PetscInt *n_owned, PetscInt *first,
                                  PetscInt **global_of_whole)
{
  PetscMPIInt rank, size;
  PetscInt *owner = NULL, *counts, *global = NULL;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  *global_of_whole = NULL;
  if (size == 1) {
    *part = whole;
    *n_owned = whole->n_nodes;
    *first = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1(size + 1, &counts));
  if (rank == 0) PetscCall(PetscMalloc2(whole->n_nodes, &owner, whole->n_nodes, &global));
  HycoOnRoot(comm, OwnNodes(size, whole, n_pairs, pairs, partitioner, owner));
  if (rank == 0) {
    for (PetscInt i = 0; i < whole->n_nodes; i++) counts[owner[i] + 1]++;
    for (PetscInt r = 0; r < size; r++) counts[r + 1] += counts[r];
  }
  PetscCallMPI(MPI_Bcast(counts, size + 1, MPIU_INT, 0, comm));
  *first = counts[rank];
  *n_owned = counts[rank + 1] - counts[rank];
  if (rank == 0) {
    for (PetscInt i = 0; i < whole->n_nodes; i++) global[i] = counts[owner[i]]++;
    for (PetscMPIInt r = size - 1; r >= 0; r--) {
      HycoMesh cut;

      PetscCall(CutPart(whole, r, owner, global, &cut));
      if (r) {
        PetscCall(SendMesh(comm, r, cut));
        PetscCall(HycoMeshDestroy(&cut));
      } else
        *part = cut;
    }
    HycoDuplicate(whole->n_nodes, global, global_of_whole);
    PetscCall(PetscFree2(owner, global));
  } else
    PetscCall(ReceiveMesh(comm, part));
  PetscCall(PetscFree(counts));
  PetscFunctionReturn(PETSC_SUCCESS);
}
