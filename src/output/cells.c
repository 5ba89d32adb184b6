/* The cells of a mesh as rows of a file: with the same number of nodes each, or as a list by shape. */
#include <hycofields.h>
#include <hycoh5.h>

/* The gmsh node of a cell that is VTK's k-th. gmsh and VTK number middle nodes of edges and faces in different
   orders. */
static PetscInt FromGmsh(HycoCellType type, PetscInt k)
{
  static const signed char tet10[10] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8},
                           hex27[27] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 13, 9,  16, 18,
                                        19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26};

  if (type == HYCO_TET10) return tet10[k];
  return type == HYCO_HEX20 || type == HYCO_HEX27 ? hex27[k] : k;
}

/* The nodes of the cells (n_cells x nv) in the whole mesh. The caller frees them. With an order, numbers of the
   whole mesh, else those of the part. */
static PetscErrorCode CellsNodes(const HycoFileOrder *order, HycoMesh m, PetscBool vtk, PetscInt **cells)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells * m->nv, cells));
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    const PetscInt node = m->cells[k - k % m->nv + (vtk ? FromGmsh(m->type, k % m->nv) : k % m->nv)];

    (*cells)[k] = order ? m->node_whole[node] : node;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A row of node numbers for each cell, in the order of the mesh file; vtk: in VTK's order of the nodes within a
   cell. */
PetscErrorCode HycoFieldsWriteCells(HycoH5 h, const char name[], const HycoFileOrder *order, HycoMesh m, PetscBool vtk)
{
  PetscInt *cells;

  PetscFunctionBegin;
  PetscCall(CellsNodes(order, m, vtk, &cells));
  PetscCall(HycoFieldWrite(h, order, m->n_cells, name, HYCO_ON_CELLS, MPIU_INT, m->nv, m->nv, cells));
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the rows of this process. Repeated nodes, which pad the shapes of a mixed mesh, are left out. item: the
   shape's code, if codes are given, then its nodes. */
static PetscErrorCode ListRows(HycoMesh m, const unsigned char code[], PetscInt n, const PetscInt row[],
                               HycoCellList *l)
{
  PetscFunctionBegin;
  l->n = n;
  PetscCall(PetscMalloc1(n, &l->shape));
  PetscCall(PetscMalloc1(n + 1, &l->start));
  /* Room for the largest shape with its code; smaller shapes leave the end unused. */
  PetscCall(PetscMalloc1(n * (m->nv + 1), &l->item));
  l->start[0] = 0;
  for (PetscInt e = 0, at = 0; e < n; e++, row += m->nv) {
    l->shape[e] = (unsigned char)HycoShapeOf(m->type, row);
    if (code) l->item[at++] = code[l->shape[e]];
    for (PetscInt v = 0; v < m->nv; v++) {
      if (!v || row[v] != row[v - 1]) l->item[at++] = row[v];
    }
    l->start[e + 1] = at;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells of several types have different numbers of nodes: a flat list with the start of each cell. In parallel
   each rank has a block of the file's rows, and needs only where its block begins (a prefix sum), not the others'
   lists. */
PetscErrorCode HycoCellListCreate(const HycoFileOrder *order, HycoMesh m, const unsigned char code[], HycoCellList *l)
{
  const MPI_Comm comm = order ? order->comm : PETSC_COMM_SELF;
  PetscInt *cells;
  void *rows;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(l, sizeof(*l)));
  PetscCall(CellsNodes(order, m, PETSC_TRUE, &cells));
  PetscCall(HycoFieldRows(order, m->n_cells, HYCO_ON_CELLS, MPIU_INT, m->nv, cells, &rows));
  PetscCall(ListRows(m, code, order ? order->n[HYCO_ON_CELLS] : m->n_cells, (const PetscInt *)rows, l));
  if (rows != cells) PetscCall(PetscFree(rows));
  PetscCall(PetscFree(cells));
  /* Inclusive: this rank's own items are subtracted again. */
  PetscCallMPI(MPI_Scan(&l->start[l->n], &l->first, 1, MPIU_INT, MPI_SUM, comm));
  l->first -= l->start[l->n];
  PetscCallMPI(MPI_Allreduce(&l->start[l->n], &l->all, 1, MPIU_INT, MPI_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank writes its own part of one array, beginning at `first`. Collective on the communicator of h. */
PetscErrorCode HycoCellListWrite(HycoH5 h, const char name[], const HycoCellList *l)
{
  PetscFunctionBegin;
  PetscCall(HycoH5WriteRows(h, name, MPIU_INT, l->all, HYCO_H5_LINE, l->first, l->start[l->n], l->item));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCellListDestroy(HycoCellList *l)
{
  PetscFunctionBegin;
  HycoFreeAll(&l->shape, &l->start, &l->item);
  PetscFunctionReturn(PETSC_SUCCESS);
}
