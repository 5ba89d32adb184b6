/*
  Proper orthogonal decomposition (section 4.1). Tall matrices: orthogonal factors by SLEPc's tall-skinny QR, then the
  SVD of the small triangle by LAPACK: singular values accurate to 1e-7 relative at 1e-12 of the first, where the
  cross-product matrix would have lost them at 1e-8. Matrices with few rows are gathered and decomposed whole.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>
#include <slepcbv.h>

/* Thin SVD of A (m x n column major, overwritten): s (min(m, n)) and the left vectors U (m x min(m, n)). */
static PetscErrorCode ThinSVD(PetscInt m, PetscInt n, PetscReal A[], PetscReal s[], PetscReal U[])
{
  PetscBLASInt mb, nb, kb, lwork = -1, info;
  PetscReal size, none;
  PetscReal *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(PetscMin(m, n), &kb));
  LAPACKgesvd_("S", "N", &mb, &nb, A, &mb, s, U, &mb, &none, &(PetscBLASInt){1}, &size, &lwork, &info);
  lwork = (PetscBLASInt)size;
  PetscCall(PetscMalloc1(lwork, &work));
  LAPACKgesvd_("S", "N", &mb, &nb, A, &mb, s, U, &mb, &none, &(PetscBLASInt){1}, work, &lwork, &info);
  PetscCall(PetscFree(work));
  (void)kb;
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the singular value decomposition did not converge (LAPACK gesvd: %d)", (int)info);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoPODRank(PetscInt k, const PetscReal s[], PetscReal tol, PetscReal noise, PetscInt max_modes)
{
  PetscReal total = 0, tail = 0;
  PetscInt l = k;

  for (PetscInt j = k - 1; j >= 0; j--) total += s[j] * s[j];
  while (l > 0 && tail + s[l - 1] * s[l - 1] <= tol * total) {
    tail += s[l - 1] * s[l - 1];
    l--;
  }
  while (l > 0 && !(s[l - 1] > noise * s[0])) l--;
  return max_modes > 0 ? PetscMin(l, max_modes) : l;
}

/* Whole matrix, column major, on every rank. */
static PetscErrorCode GatherDense(Mat S, PetscReal all[])
{
  PetscInt N, n, *rows;
  PetscReal *by_row;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(PetscMalloc2(N, &rows, N * n, &by_row));
  for (PetscInt i = 0; i < N; i++) rows[i] = i;
  PetscCall(HycoGatherRows(S, N, rows, by_row));
  for (PetscInt i = 0; i < N; i++) {
    for (PetscInt j = 0; j < n; j++) all[j * N + i] = by_row[i * n + j];
  }
  PetscCall(PetscFree2(rows, by_row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SmallPOD(Mat S, PetscReal tol, PetscReal noise, PetscInt max_modes, Mat *V, PetscInt *l,
                               PetscReal sigma[])
{
  PetscInt N, n, lo, hi, lda;
  PetscReal *A, *U;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(PetscMalloc2(N * n, &A, N * PetscMin(N, n), &U));
  PetscCall(GatherDense(S, A));
  PetscCall(ThinSVD(N, n, A, sigma, U));
  *l = HycoPODRank(PetscMin(N, n), sigma, tol, noise, max_modes);
  if (*l) {
    PetscCall(MatGetOwnershipRange(S, &lo, &hi));
    PetscCall(MatCreateDense(PetscObjectComm((PetscObject)S), hi - lo, PETSC_DECIDE, N, *l, NULL, V));
    PetscCall(MatDenseGetLDA(*V, &lda));
    PetscCall(MatDenseGetArray(*V, &v));
    for (PetscInt j = 0; j < *l; j++) PetscCall(PetscArraycpy(v + j * lda, U + j * N + lo, hi - lo));
    PetscCall(MatDenseRestoreArray(*V, &v));
  }
  PetscCall(PetscFree2(A, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TallPOD(Mat S, PetscReal tol, PetscReal noise, PetscInt max_modes, Mat *V, PetscInt *l,
                              PetscReal sigma[])
{
  PetscInt N, n;
  BV Q;
  Mat R, Ur;
  PetscScalar *r;
  PetscReal *A, *U;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(BVCreateFromMat(S, &Q));
  PetscCall(BVSetFromOptions(Q));
  PetscCall(BVSetOrthogonalization(Q, BV_ORTHOG_CGS, BV_ORTHOG_REFINE_IFNEEDED, PETSC_DEFAULT, BV_ORTHOG_BLOCK_TSQR));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, NULL, &R));
  PetscCall(BVOrthogonalize(Q, R));
  PetscCall(PetscMalloc2(n * n, &A, n * n, &U));
  PetscCall(MatDenseGetLDA(R, &lda));
  PetscCall(MatDenseGetArray(R, &r));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) A[j * n + i] = i <= j ? r[j * lda + i] : 0;
  }
  PetscCall(MatDenseRestoreArray(R, &r));
  PetscCall(ThinSVD(n, n, A, sigma, U));
  *l = HycoPODRank(n, sigma, tol, noise, max_modes);
  if (*l) {
    Mat W;

    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, U, &Ur));
    PetscCall(BVMultInPlace(Q, Ur, 0, *l));
    PetscCall(MatDestroy(&Ur));
    PetscCall(BVSetActiveColumns(Q, 0, *l));
    PetscCall(BVGetMat(Q, &W));
    PetscCall(MatDuplicate(W, MAT_COPY_VALUES, V));
    PetscCall(BVRestoreMat(Q, &W));
  }
  PetscCall(PetscFree2(A, U));
  PetscCall(MatDestroy(&R));
  PetscCall(BVDestroy(&Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mode's largest entry (the first of nearly equal ones) is made positive. */
static PetscErrorCode FixSigns(Mat V, PetscInt l)
{
  PetscInt lo, hi, lda;
  PetscScalar *v;
  MPI_Comm comm = PetscObjectComm((PetscObject)V);

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArray(V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscReal largest = 0, all, sign = 0, sum;
    PetscInt at = PETSC_MAX_INT, first;

    for (PetscInt i = 0; i < hi - lo; i++) largest = PetscMax(largest, PetscAbsScalar(v[j * lda + i]));
    PetscCallMPI(MPI_Allreduce(&largest, &all, 1, MPIU_REAL, MPI_MAX, comm));
    for (PetscInt i = hi - lo - 1; i >= 0; i--) {
      if (PetscAbsScalar(v[j * lda + i]) >= all * (1 - 1e-6)) at = lo + i;
    }
    PetscCallMPI(MPI_Allreduce(&at, &first, 1, MPIU_INT, MPI_MIN, comm));
    if (at == first && at != PETSC_MAX_INT) sign = v[j * lda + at - lo] < 0 ? -1 : 1;
    PetscCallMPI(MPI_Allreduce(&sign, &sum, 1, MPIU_REAL, MPI_SUM, comm));
    for (PetscInt i = 0; sum < 0 && i < hi - lo; i++) v[j * lda + i] = -v[j * lda + i];
  }
  PetscCall(MatDenseRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPOD(Mat S, PetscReal tol, PetscReal noise, PetscInt max_modes, Mat *V, PetscInt *l,
                       PetscReal sigma[])
{
  PetscInt N, n, rows;
  PetscMPIInt tall, all;
  MPI_Comm comm = PetscObjectComm((PetscObject)S);

  PetscFunctionBegin;
  *V = NULL;
  *l = 0;
  PetscCall(MatGetSize(S, &N, &n));
  if (!N || !n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(S, &rows, NULL));
  tall = rows >= n && N > 2000;
  PetscCallMPI(MPI_Allreduce(&tall, &all, 1, MPI_INT, MPI_MIN, comm));
  if (all)
    PetscCall(TallPOD(S, tol, noise, max_modes, V, l, sigma));
  else
    PetscCall(SmallPOD(S, tol, noise, max_modes, V, l, sigma));
  if (*l) PetscCall(FixSigns(*V, *l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPODGram(PetscInt n, const PetscReal G[], PetscReal tol, PetscReal noise, PetscReal **W, PetscInt *l,
                           PetscReal sigma[])
{
  PetscBLASInt nb, lwork, info;
  PetscReal *A, *values, *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscMalloc3(n * n, &A, n, &values, 64 * n, &work));
  PetscCall(PetscArraycpy(A, G, n * n));
  PetscCall(PetscBLASIntCast(64 * n, &lwork));
  LAPACKsyev_("V", "U", &nb, A, &nb, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the eigenvalues of the Gram matrix did not converge (LAPACK syev: %d)", (int)info);
  for (PetscInt j = 0; j < n; j++) sigma[j] = PetscSqrtReal(PetscMax(values[n - 1 - j], 0));
  *l = HycoPODRank(n, sigma, tol, PetscMax(noise, 1e-7), 0);
  PetscCall(PetscMalloc1(n * *l, W));
  for (PetscInt j = 0; j < *l; j++) {
    for (PetscInt i = 0; i < n; i++) (*W)[j * n + i] = A[(n - 1 - j) * n + i] / sigma[j];
  }
  PetscCall(PetscFree3(A, values, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
