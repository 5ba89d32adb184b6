/* The discrete empirical interpolation method (section 4.2), and Q-DEIM by pivoted QR. */
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* values[k][j] = V[rows[k], j] on every rank, by a sum in which one rank has the row. Collective. Rows may repeat. */
PetscErrorCode HycoGatherRows(Mat V, PetscInt n, const PetscInt rows[], PetscReal values[])
{
  PetscInt lo, hi, cols, lda;
  const PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatGetSize(V, NULL, &cols));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArrayRead(V, &v));
  for (PetscInt k = 0; k < n; k++) {
    const PetscBool mine = (PetscBool)(rows[k] >= lo && rows[k] < hi);

    for (PetscInt j = 0; j < cols; j++)
      values[k * cols + j] = mine ? v[(size_t)j * (size_t)lda + (size_t)(rows[k] - lo)] : 0;
  }
  PetscCall(MatDenseRestoreArrayRead(V, &v));
  HycoAllreduce(values, n * cols, MPIU_REAL, MPI_SUM, PetscObjectComm((PetscObject)V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* c: V[index[0..k), 0..k) c = V[index[0..k), k]. Row-wise storage of `rows`, column-wise for LAPACK. Regular in exact
   arithmetic, as each row was chosen where the residual is not zero. */
static PetscErrorCode DEIMInterpolate(PetscInt k, PetscInt l, const PetscReal rows[], PetscReal c[])
{
  PetscReal *A;
  PetscBLASInt kb, one = 1, info, *ipiv;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(k * k, &A, k, &ipiv));
  for (PetscInt i = 0; i < k; i++) {
    for (PetscInt j = 0; j < k; j++) A[j * k + i] = rows[i * l + j];
    c[i] = rows[i * l + k];
  }
  PetscCall(PetscBLASIntCast(k, &kb));
  LAPACKgesv_(&kb, &one, A, &kb, ipiv, c, &kb, &info);
  PetscCall(PetscFree2(A, ipiv));
  HycoCheckModel(info == 0, "DEIM: the interpolation matrix of mode %d is singular", (int)k);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* index[k] (global row): where mode k differs most from its interpolation by the former ones; among entries equal to
   1e-10 the lowest row, so that the choice is the same on any number of ranks. Collective. The greedy algorithm of
   Chaturantabut and Sorensen (2010). */
PetscErrorCode HycoDEIM(Mat V, PetscInt index[])
{
  PetscInt l, lo, hi, lda;
  const PetscScalar *v;
  PetscReal *rows, *c, *r;
  MPI_Comm comm = PetscObjectComm((PetscObject)V);

  PetscFunctionBegin;
  PetscCall(MatGetSize(V, NULL, &l));
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(PetscMalloc3(l * l, &rows, l, &c, hi - lo, &r));
  for (PetscInt k = 0; k < l; k++) {
    PetscReal largest = 0, all;
    PetscInt at = PETSC_MAX_INT;

    /* On every rank alike, from the rows that all have gathered. */
    if (k) PetscCall(DEIMInterpolate(k, l, rows, c));
    PetscCall(MatDenseGetArrayRead(V, &v));
    for (PetscInt i = 0; i < hi - lo; i++) {
      r[i] = v[(size_t)k * (size_t)lda + (size_t)i];
      for (PetscInt j = 0; j < k; j++) r[i] -= v[(size_t)j * (size_t)lda + (size_t)i] * c[j];
      r[i] = PetscAbsReal(r[i]);
      largest = PetscMax(largest, r[i]);
    }
    PetscCall(MatDenseRestoreArrayRead(V, &v));
    PetscCallMPI(MPI_Allreduce(&largest, &all, 1, MPIU_REAL, MPI_MAX, comm));
    for (PetscInt i = hi - lo - 1; i >= 0; i--) {
      if (r[i] >= all * (1 - 1e-10)) at = lo + i;
    }
    PetscCallMPI(MPI_Allreduce(&at, &index[k], 1, MPIU_INT, MPI_MIN, comm));
    PetscCall(HycoGatherRows(V, 1, &index[k], rows + k * l));
  }
  PetscCall(PetscFree3(rows, c, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row with the largest squared length over all ranks; among equal ones (to 1e-10) the lowest. */
static PetscErrorCode LongestRow(Mat V, const PetscReal length2[], PetscInt *row)
{
  PetscInt lo, hi, at = PETSC_MAX_INT;
  PetscReal largest = 0, all;
  MPI_Comm comm = PetscObjectComm((PetscObject)V);

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  for (PetscInt i = 0; i < hi - lo; i++) largest = PetscMax(largest, length2[i]);
  PetscCallMPI(MPI_Allreduce(&largest, &all, 1, MPIU_REAL, MPI_MAX, comm));
  for (PetscInt i = hi - lo - 1; i >= 0; i--) {
    if (length2[i] >= all * (1 - 1e-10)) at = lo + i;
  }
  PetscCallMPI(MPI_Allreduce(&at, row, 1, MPIU_INT, MPI_MIN, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pivoted QR of V^T: the l rows that are best conditioned; fails for dependent columns. Collective. */
PetscErrorCode HycoQDEIM(Mat V, PetscInt index[])
{
  PetscInt l, found;

  PetscFunctionBegin;
  PetscCall(MatGetSize(V, NULL, &l));
  PetscCall(HycoQDEIMRank(V, index, &found));
  HycoCheckModel(found == l, "Q-DEIM: the basis has rank %d of %d", (int)found, (int)l);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same as far as there are nonzero rows; *found of them. Collective. */
PetscErrorCode HycoQDEIMRank(Mat V, PetscInt index[], PetscInt *found)
{
  Mat R;
  PetscInt l, lo, hi, lda;
  PetscScalar *r;
  PetscReal *pivot, *length2;

  PetscFunctionBegin;
  PetscCall(MatGetSize(V, NULL, &l));
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatDuplicate(V, MAT_COPY_VALUES, &R));
  PetscCall(MatDenseGetLDA(R, &lda));
  PetscCall(PetscMalloc2(l, &pivot, hi - lo, &length2));
  for (*found = 0; *found < l; (*found)++) {
    const PetscInt k = *found;
    PetscReal size2 = 0;

    /* Computed anew at each step: updated squares would lose their digits by cancellation. */
    PetscCall(PetscArrayzero(length2, hi - lo));
    PetscCall(MatDenseGetArray(R, &r));
    for (PetscInt j = 0; j < l; j++) {
      for (PetscInt i = 0; i < hi - lo; i++) length2[i] += PetscSqr(r[(size_t)j * (size_t)lda + (size_t)i]);
    }
    PetscCall(MatDenseRestoreArray(R, &r));
    /* Round-off is left in rows that were chosen. */
    for (PetscInt p = 0; p < k; p++) {
      if (index[p] >= lo && index[p] < hi) length2[index[p] - lo] = 0;
    }
    PetscCall(LongestRow(R, length2, &index[k]));
    PetscCall(HycoGatherRows(R, 1, &index[k], pivot));
    for (PetscInt j = 0; j < l; j++) size2 += pivot[j] * pivot[j];
    /* The rest is zero: V has no more independent columns. */
    if (!(size2 > 0)) break;
    PetscCall(MatDenseGetArray(R, &r));
    for (PetscInt i = 0; i < hi - lo; i++) {
      PetscReal dot = 0;

      for (PetscInt j = 0; j < l; j++) dot += r[(size_t)j * (size_t)lda + (size_t)i] * pivot[j];
      for (PetscInt j = 0; j < l; j++) r[(size_t)j * (size_t)lda + (size_t)i] -= dot / size2 * pivot[j];
    }
    PetscCall(MatDenseRestoreArray(R, &r));
  }
  PetscCall(PetscFree2(pivot, length2));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}
