/* A symmetric matrix stored by the blocks of its upper triangle (MATSBAIJ), created faster than by MatConvert(),
   which inserts entry by entry. */
#include "constrained.h"

/* The columns of a block row's blocks from the diagonal on, ascending; column: room for all entries of its rows.
   Entries below the diagonal block are not stored. */
static PetscErrorCode RowBlocks(Mat K, PetscInt block, PetscInt bs, PetscInt *n_blocks, PetscInt column[])
{
  PetscFunctionBegin;
  *n_blocks = 1;
  column[0] = block;
  for (PetscInt r = block * bs; r < (block + 1) * bs; r++) {
    PetscInt n;
    const PetscInt *col;

    PetscCall(MatGetRow(K, r, &n, &col, NULL));
    for (PetscInt k = 0; k < n; k++) {
      /* Columns of a row are ascending: equal blocks follow each other. */
      if (col[k] / bs > block && col[k] / bs != column[*n_blocks - 1]) column[(*n_blocks)++] = col[k] / bs;
    }
    PetscCall(MatRestoreRow(K, r, &n, &col, NULL));
  }
  PetscCall(PetscSortRemoveDupsInt(n_blocks, column));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies their values; value[] has the room. Blocks are filled up with zeros. */
static PetscErrorCode CopyRow(Mat K, PetscInt block, PetscInt bs, PetscInt column[], PetscScalar value[], Mat upper)
{
  PetscInt blocks, width;

  PetscFunctionBegin;
  PetscCall(RowBlocks(K, block, bs, &blocks, column));
  width = blocks * bs;
  /* A block may lack entries that the row's other unknowns have. */
  PetscCall(PetscArrayzero(value, bs * width));
  for (PetscInt r = 0; r < bs; r++) {
    PetscInt n, at = 0;
    const PetscInt *col;
    const PetscScalar *v;

    PetscCall(MatGetRow(K, block * bs + r, &n, &col, &v));
    for (PetscInt k = 0; k < n; k++) { /* both are ascending */
      if (col[k] / bs < block) continue;
      while (column[at] < col[k] / bs) at++;
      value[r * width + at * bs + col[k] % bs] = v[k];
    }
    PetscCall(MatRestoreRow(K, block * bs + r, &n, &col, &v));
  }
  PetscCall(MatSetValuesBlocked(upper, 1, &block, blocks, column, value, INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The longest row of this rank. */
static PetscErrorCode LongestRow(Mat K, PetscInt *longest)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  *longest = 0;
  PetscCall(MatGetOwnershipRange(K, &lo, &hi));
  for (PetscInt r = lo; r < hi; r++) {
    PetscInt n;

    /* By rows, which any type of matrix gives, one at a time. */
    PetscCall(MatGetRow(K, r, &n, NULL, NULL));
    *longest = PetscMax(*longest, n);
    PetscCall(MatRestoreRow(K, r, &n, NULL, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *upper is NULL for matrices without blocks. Products with K take a third of the memory traffic. Collective. */
PetscErrorCode HycoUpperBlocks(Mat K, Mat *upper)
{
  PetscInt bs, lo, hi, n, blocks, longest, *here, *there, *column;
  PetscScalar *value;

  PetscFunctionBegin;
  *upper = NULL;
  PetscCall(MatGetBlockSize(K, &bs));
  if (bs < 2) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(MatGetOwnershipRange(K, &lo, &hi));
  PetscCall(LongestRow(K, &longest));
  PetscCall(PetscCalloc2((hi - lo) / bs, &here, (hi - lo) / bs, &there));
  PetscCall(PetscMalloc2(bs * longest + 1, &column, bs * bs * (bs * longest + 1), &value));
  /* Exact counts by block row, of this rank's and of later columns: an estimate would make the insertion slow. */
  for (PetscInt b = lo / bs; b < hi / bs; b++) {
    PetscCall(RowBlocks(K, b, bs, &blocks, column));
    for (PetscInt k = 0; k < blocks; k++) (column[k] < hi / bs ? here : there)[b - lo / bs]++;
  }
  PetscCall(MatCreateSBAIJ(PetscObjectComm((PetscObject)K), bs, hi - lo, hi - lo, n, n, 0, here, 0, there, upper));
  for (PetscInt b = lo / bs; b < hi / bs; b++) PetscCall(CopyRow(K, b, bs, column, value, *upper));
  PetscCall(HycoMatAssemble(*upper));
  PetscCall(PetscFree2(column, value));
  PetscCall(PetscFree2(here, there));
  PetscFunctionReturn(PETSC_SUCCESS);
}
