/*
  A fill-reducing order of a sparse symmetric matrix: METIS's nested dissection of its graph of nodes (G. Karypis, V.
  Kumar, SIAM J. Sci. Comput. 20 (1998) 359-392). Debian's MUMPS is built without METIS, and accepts a given order.
*/
#include <hycolinear.h>
#include <metis.h>

/* Neighbours of this rank's rows by node of bs unknowns: CSR, columns global, without the node itself. By nodes: the
   graph is smaller by bs^2, and unknowns of a node stay together. */
static PetscErrorCode LocalGraph(Mat K, PetscInt bs, PetscInt *n_nodes, PetscInt **start, PetscInt **next)
{
  PetscInt lo, hi, n, room, *seen, at = 0;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(K, &lo, &hi));
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(MatGetInfo(K, MAT_LOCAL, &info));
  *n_nodes = (hi - lo) / bs;
  room = (PetscInt)info.nz_used;
  PetscCall(PetscMalloc1(*n_nodes + 1, start));
  PetscCall(PetscMalloc1(room + 1, next));
  PetscCall(PetscCalloc1(n / bs, &seen));
  (*start)[0] = 0;
  for (PetscInt r = lo; r < hi; r++) {
    const PetscInt *cols, node = r / bs;
    PetscInt nc;

    PetscCall(MatGetRow(K, r, &nc, &cols, NULL));
    for (PetscInt k = 0; k < nc; k++) {
      const PetscInt other = cols[k] / bs;

      /* Marked with the number of the node, so that nothing is reset between nodes. */
      if (other == node || seen[other] == node + 1) continue;
      seen[other] = node + 1;
      (*next)[at++] = other;
    }
    PetscCall(MatRestoreRow(K, r, &nc, &cols, NULL));
    (*start)[(r - lo) / bs + 1] = at;
  }
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* METIS on the whole graph: from degree and neighbours of each node to place[node]. On rank 0. METIS has 32-bit
   indices in most builds. */
static PetscErrorCode OrderingDissect(PetscInt n, const PetscInt degree[], const PetscInt next[], PetscInt place[])
{
  idx_t nv = (idx_t)n, *xadj, *adjncy, *perm, *iperm;
  int status;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n + 1, &xadj, n, &perm, n, &iperm));
  xadj[0] = 0;
  /* From degrees to starts: ranks could send their degrees as they were. */
  for (PetscInt i = 0; i < n; i++) xadj[i + 1] = xadj[i] + (idx_t)degree[i];
  PetscCall(PetscMalloc1(xadj[n] + 1, &adjncy));
  for (idx_t k = 0; k < xadj[n]; k++) adjncy[k] = (idx_t)next[k];
  status = METIS_NodeND(&nv, xadj, adjncy, NULL, NULL, perm, iperm);
  PetscCheck(status == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_NodeND failed (%d)", status);
  for (PetscInt i = 0; i < n; i++) place[i] = (PetscInt)iperm[i];
  PetscCall(PetscFree(adjncy));
  PetscCall(PetscFree3(xadj, perm, iperm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* place[i]: position of unknown i in the elimination, on rank 0. Collective. */
PetscErrorCode HycoDissection(MPI_Comm comm, Mat K, PetscInt place[])
{
  PetscInt bs, n_nodes = 0, *start, *next, n_all = 0, n_edges, *degree, *edges, *node = NULL;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(K, &bs));
  PetscCall(LocalGraph(K, bs, &n_nodes, &start, &next));
  PetscCall(HycoConcatenate(comm, start[n_nodes], next, MPIU_INT, sizeof(PetscInt), &n_edges, &edges));
  for (PetscInt i = 0; i < n_nodes; i++) start[i] = start[i + 1] - start[i];
  PetscCall(HycoConcatenate(comm, n_nodes, start, MPIU_INT, sizeof(PetscInt), &n_all, &degree));
  HycoFreeAll(&start, &next);
  if (HycoRank(comm) == 0) PetscCall(PetscMalloc1(n_all, &node));
  HycoOnRoot(comm, OrderingDissect(n_all, degree, edges, node));
  for (PetscInt i = 0; i < n_all; i++) {
    /* Nodes are ordered, unknowns of a node follow each other: a third of the graph. */
    for (PetscInt c = 0; c < bs; c++) place[i * bs + c] = node[i] * bs + c;
  }
  HycoFreeAll(&node, &degree, &edges);
  PetscFunctionReturn(PETSC_SUCCESS);
}
