/*
  Assembly into a sequential matrix with an existing pattern: the positions of each cell's entries are known, so that
  the entries are added directly; cells that no parameter changes are summed once and stored.
*/
#include "assembly_map.h"
#include <petsc/private/petscimpl.h> /* PetscObjectStateIncrease() */

struct _n_HycoAssemblyMap {
  PetscObjectId matrix;
  PetscObjectState pattern;
  PetscInt *start;       /* of each cell's n x n offsets, n its nodes */
  PetscInt *offset;      /* offset of the first free unknown of node b in the rows of a's free unknowns */
  PetscScalar *constant; /* sum of the cells that no parameter changes; NULL: there are none */
};

/* Called where the fixed unknowns change, too: the offsets and the constant sum depend on them. */
PetscErrorCode HycoAssemblyMapDestroy(HycoAssemblyMap *places)
{
  PetscFunctionBegin;
  if (!*places) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*places)->start, &(*places)->offset, &(*places)->constant, places);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first free unknown of a node, -1: none. Free unknowns of a node are contiguous in a row of K, so that one
   offset per pair of nodes locates a dim x dim block. */
static PetscInt FirstFree(HycoFE fe, PetscInt node)
{
  for (PetscInt c = 0; c < fe->dim; c++) {
    if (!fe->fixed[node * fe->dim + c]) return node * fe->dim + c;
  }
  return -1;
}

/* False if a row lacks an entry: then the matrix was not created for this mesh. Offsets of all pairs of nodes of all
   cells: once per pattern, in place of a search for each entry of each assembly. */
static PetscBool FindOffsets(HycoFE fe, const PetscInt ia[], const PetscInt ja[], PetscInt offset[])
{
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n = HycoMeshCellNodes(fe->mesh, e, node);

    for (PetscInt k = 0; k < n * n; k++, offset++) {
      const PetscInt row = FirstFree(fe, node[k / n]), col = FirstFree(fe, node[k % n]);
      PetscInt at = 0;

      /* A pair without a free unknown is not used by AssemblyMapAdd(): any value does. */
      *offset = 0;
      if (row < 0 || col < 0) continue;
      /* A linear search: rows have some tens of entries, and it is done once. */
      while (ia[row] + at < ia[row + 1] && ja[ia[row] + at] != col) at++;
      if (ia[row] + at == ia[row + 1]) return PETSC_FALSE;
      *offset = at;
    }
  }
  return PETSC_TRUE;
}

/* Adds an element matrix, fixed unknowns reduced to their own diagonal. */
static void AssemblyMapAdd(HycoFE fe, const PetscInt offset[], PetscInt cell, const PetscReal Ae[], const PetscInt ia[],
                           PetscScalar a[])
{
  PetscInt node[HYCO_MAX_CELL_NODES];
  const PetscInt dim = fe->dim, nv = HycoMeshCellNodes(fe->mesh, cell, node), n = nv * dim;

  for (PetscInt r = 0; r < n; r++) {
    const PetscInt row = node[r / dim] * dim + r % dim;

    /* The row of a fixed unknown has its diagonal alone. */
    if (fe->fixed[row]) {
      a[ia[row]] += Ae[r * n + r];
      continue;
    }
    for (PetscInt b = 0; b < nv; b++) {
      PetscScalar *to = a + ia[row] + offset[r / dim * nv + b];
      const PetscBool *fixed = fe->fixed + node[b] * dim;
      const PetscReal *from = Ae + r * n + b * dim;

      for (PetscInt d = 0; d < dim; d++) {
        /* Fixed columns have no entries in a free row, so that free ones are contiguous. */
        if (!fixed[d]) *to++ += from[d];
      }
    }
  }
}

/* Adds the cells that parameters change, or the others. */
static PetscErrorCode AddCells(HycoFE fe, HycoAssemblyMap p, PetscBool constant, const PetscInt ia[], PetscScalar a[])
{
  PetscReal *Ke;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    /* The constant cells are summed once and copied into K at each parameter value. */
    if (fe->constant[e] != constant) continue;
    PetscCall(HycoFEElementRoom(fe, e, &Ke));
    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    AssemblyMapAdd(fe, p->offset + p->start[e], e, Ke, ia, a);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves *places NULL if the pattern does not fit; the caller then assembles by MatSetValues(). Places in the matrix's
   array are looked up once: later assemblies add without any search for columns. */
static PetscErrorCode AssemblyMapCreate(HycoFE fe, const PetscInt ia[], const PetscInt ja[], PetscInt n,
                                        HycoAssemblyMap *places)
{
  HycoAssemblyMap p;
  PetscInt node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(PetscNew(places));
  p = *places;
  PetscCall(PetscMalloc1(fe->mesh->n_cells + 1, &p->start));
  p->start[0] = 0;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const PetscInt n_nodes = HycoMeshCellNodes(fe->mesh, e, node);

    p->start[e + 1] = p->start[e] + n_nodes * n_nodes;
  }
  PetscCall(PetscMalloc1(p->start[fe->mesh->n_cells], &p->offset));
  if (!FindOffsets(fe, ia, ja, p->offset)) {
    PetscCall(HycoAssemblyMapDestroy(places));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Cells with fixed stiffness are summed now; later assemblies start with a copy of this sum. */
  if (fe->n_constant) {
    PetscCall(PetscCalloc1(ia[n], &p->constant));
    PetscCall(AddCells(fe, p, PETSC_TRUE, ia, p->constant));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K (n_dof x n_dof, sequential, assembled before) by direct addition; *done is false if this is not possible.
   Rewrites all values; the pattern stays. The map is kept in fe until the matrix or its nonzero pattern is another. */
PetscErrorCode HycoAssemblyMapAssemble(HycoFE fe, Mat K, PetscBool *done)
{
  const PetscInt *ia, *ja;
  PetscInt n;
  PetscObjectId id;
  PetscObjectState pattern;
  PetscScalar *a;
  PetscBool rows, assembled, sequential;

  /* Distributed meshes have numbers of other ranks in their rows. */
  PetscFunctionBegin;
  *done = PETSC_FALSE;
  PetscCall(MatAssembled(K, &assembled));
  PetscCall(PetscObjectTypeCompare((PetscObject)K, MATSEQAIJ, &sequential));
  /* The first assembly makes the pattern by MatSetValues(). */
  if (!assembled || !sequential || fe->mesh->node_global) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectGetId((PetscObject)K, &id));
  PetscCall(MatGetNonzeroState(K, &pattern));
  PetscCall(MatGetRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &rows));
  if (fe->places && (fe->places->matrix != id || fe->places->pattern != pattern))
    PetscCall(HycoAssemblyMapDestroy(&fe->places));
  if (!fe->places) PetscCall(AssemblyMapCreate(fe, ia, ja, n, &fe->places));
  if (fe->places) {
    fe->places->matrix = id;
    fe->places->pattern = pattern;
    /* Write access: the old values are not needed (nor copied from a device). */
    PetscCall(MatSeqAIJGetArrayWrite(K, &a));
    if (fe->places->constant)
      PetscCall(PetscArraycpy(a, fe->places->constant, ia[n]));
    else
      PetscCall(PetscArrayzero(a, ia[n]));
    PetscCall(AddCells(fe, fe->places, PETSC_FALSE, ia, a));
    PetscCall(MatSeqAIJRestoreArrayWrite(K, &a));
    /* The values were written past PETSc, which must know that they changed (a factor or norm may be cached). */
    PetscCall(PetscObjectStateIncrease((PetscObject)K));
    *done = PETSC_TRUE;
  }
  PetscCall(MatRestoreRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
