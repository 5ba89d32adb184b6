/*
  The SVD type HYCO_SVD_TSQR, registered with SLEPc: tall-skinny QR (Demmel, Grigori, Hoemmen, Langou, SIAM J. Sci.
  Comput. 34 (2012) A206-A239) of a dense matrix with distributed rows, then the SVD of the triangular factor by LAPACK.
  Backward stable: singular values of 1e-12 of the first have a relative accuracy of 1e-7, whereas the cross-product
  matrix loses those below 1e-8. All triplets are found. For a matrix with fewer rows than columns SLEPc passes the
  transpose.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>
#include <slepc/private/svdimpl.h>
#include <slepcblaslapack.h>

/* SLEPc asks for the space of the solution before the solve. One iteration, all triplets: there is nothing to
   converge. */
static PetscErrorCode SetUp(SVD svd)
{
  PetscBool dense;

  PetscFunctionBegin;
  SVDCheckStandard(svd);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)svd->A, &dense, MATSEQDENSE, MATMPIDENSE, ""));
  PetscCheck(dense, PetscObjectComm((PetscObject)svd), PETSC_ERR_SUP,
             "the SVD type " HYCO_SVD_TSQR " takes dense matrices; with more columns than rows, not their implicit "
             "transpose");
  PetscCall(MatGetSize(svd->A, NULL, &svd->ncv));
  if (svd->max_it < 1) svd->max_it = 1;
  svd->leftbasis = PETSC_TRUE;
  PetscCall(DSSetType(svd->ds, DSSVD));
  PetscCall(SVDAllocateSolution(svd, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of A on this rank that take part: those with an entry, as of one body among several, or, if few rows have
   none, all. *whole: all of them on every rank, which has at least as many as there are columns. Collective. */
static PetscErrorCode FindRows(Mat A, PetscInt *count, PetscInt **row, PetscBool *whole)
{
  PetscInt n, rows, lda, most[2];
  const PetscScalar *a;
  PetscBool *any;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, NULL, &n));
  PetscCall(MatGetLocalSize(A, &rows, NULL));
  PetscCall(MatDenseGetLDA(A, &lda));
  PetscCall(PetscCalloc1(rows + 1, &any));
  PetscCall(PetscMalloc1(rows + 1, row));
  PetscCall(MatDenseGetArrayRead(A, &a));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < rows; i++) any[i] = (PetscBool)(any[i] || a[(size_t)j * (size_t)lda + (size_t)i] != 0);
  }
  PetscCall(MatDenseRestoreArrayRead(A, &a));
  *count = 0;
  for (PetscInt i = 0; i < rows; i++) {
    if (any[i]) (*row)[(*count)++] = i;
  }
  PetscCall(PetscFree(any));
  most[0] = 4 * *count > 3 * rows;
  most[1] = rows < n;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
  *whole = (PetscBool)(most[0] && !most[1]);
  if (!most[0]) PetscFunctionReturn(PETSC_SUCCESS);
  *count = rows;
  for (PetscInt i = 0; i < rows; i++) (*row)[i] = i;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies these rows of the dense matrix A to the first ones of B, or (back) the first ones of A to these of B; the
   others of B are 0. */
static PetscErrorCode CopyRows(Mat A, Mat B, PetscBool back, PetscInt count, const PetscInt row[])
{
  PetscInt n, rows, lda, ldb;
  const PetscScalar *a;
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, NULL, &n));
  PetscCall(MatGetLocalSize(B, &rows, NULL));
  PetscCall(MatDenseGetLDA(A, &lda));
  PetscCall(MatDenseGetLDA(B, &ldb));
  PetscCall(MatDenseGetArrayRead(A, &a));
  PetscCall(MatDenseGetArrayWrite(B, &b));
  for (PetscInt j = 0; j < n; j++) {
    const PetscScalar *from = a + (size_t)j * (size_t)lda;
    PetscScalar *to = b + (size_t)j * (size_t)ldb;

    PetscCall(PetscArrayzero(to, rows));
    for (PetscInt i = 0; i < count; i++) to[back ? row[i] : i] = from[back ? i : row[i]];
  }
  PetscCall(MatDenseRestoreArrayWrite(B, &b));
  PetscCall(MatDenseRestoreArrayRead(A, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R = U s V^T: R (n x n, its upper triangle) is overwritten by U; Vt: n x n. Workspace by a query of LAPACK. The small
   triangle is the same on every rank, and decomposed by each. */
static PetscErrorCode DecomposeTriangle(PetscInt n, PetscScalar R[], PetscReal s[], PetscScalar Vt[])
{
  PetscBLASInt nb, one = 1, lwork = -1, info, *integers;
  PetscScalar size, none, *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  /* Of the factor only the upper triangle counts. */
  for (PetscInt j = 0; j < n; j++) PetscCall(PetscArrayzero(R + j * n + j + 1, n - j - 1));
  PetscCall(PetscMalloc1(8 * n + 1, &integers));
  /* Divide and conquer: several times faster than QR iterations where there are hundreds of columns. */
  LAPACKgesdd_("O", &nb, &nb, R, &nb, s, &none, &one, Vt, &nb, &size, &lwork, integers, &info);
  lwork = (PetscBLASInt)size;
  PetscCall(PetscMalloc1(lwork, &work));
  LAPACKgesdd_("O", &nb, &nb, R, &nb, s, &none, &one, Vt, &nb, work, &lwork, integers, &info);
  HycoFreeAll(&work, &integers);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the singular value decomposition did not converge (LAPACK gesdd: %d)", (int)info);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q, whose n columns SLEPc's tall-skinny QR makes orthonormal: svd->U if all rows take part, otherwise of those that
   do, and of rows of zeros if they are fewer than n, as SLEPc requires. Zero rows change neither R nor the singular
   values. */
static PetscErrorCode MakeBasis(SVD svd, PetscBool whole, PetscInt count, const PetscInt row[], BV *Q)
{
  const PetscInt n = svd->ncv;
  Mat q;

  PetscFunctionBegin;
  if (whole) {
    /* SLEPc's own basis, without a copy. The caller destroys *Q in both cases. */
    PetscCall(PetscObjectReference((PetscObject)svd->U));
    *Q = svd->U;
  } else {
    PetscCall(BVCreate(PetscObjectComm((PetscObject)svd), Q));
    PetscCall(BVSetSizes(*Q, PetscMax(count, n), PETSC_DETERMINE, n));
    PetscCall(BVSetType(*Q, BVMAT));
  }
  PetscCall(BVSetOrthogonalization(*Q, BV_ORTHOG_CGS, BV_ORTHOG_REFINE_IFNEEDED, PETSC_DEFAULT, BV_ORTHOG_BLOCK_TSQR));
  PetscCall(BVSetActiveColumns(*Q, 0, n));
  PetscCall(BVGetMat(*Q, &q));
  PetscCall(CopyRows(svd->A, q, PETSC_FALSE, count, row));
  PetscCall(BVRestoreMat(*Q, &q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores this rank's rows of V = Vt^T. */
static PetscErrorCode StoreRight(BV V, PetscInt n, const PetscScalar Vt[])
{
  Mat right;
  PetscInt lo, hi, ld;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(BVSetActiveColumns(V, 0, n));
  PetscCall(BVGetMat(V, &right));
  PetscCall(MatGetOwnershipRange(right, &lo, &hi));
  PetscCall(MatDenseGetLDA(right, &ld));
  PetscCall(MatDenseGetArrayWrite(right, &v));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < n; j++) v[j * ld + i - lo] = Vt[i * n + j];
  }
  PetscCall(MatDenseRestoreArrayWrite(right, &v));
  PetscCall(BVRestoreMat(V, &right));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A = Q R, R = U s V^T: left vectors are Q U. Singular values from R are accurate to round-off of the largest, while a
   Gram matrix would lose half of the digits. */
static PetscErrorCode TSQRSolve(SVD svd)
{
  const PetscInt n = svd->ncv;
  BV Q;
  Mat R, q, u;
  PetscScalar *r, *Vt;
  PetscInt count = 0, *row = NULL;
  PetscBool whole = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(FindRows(svd->A, &count, &row, &whole));
  PetscCall(MakeBasis(svd, whole, count, row, &Q));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, NULL, &R));
  PetscCall(BVOrthogonalize(Q, R));
  PetscCall(PetscMalloc1(n * n, &Vt));
  PetscCall(MatDenseGetArray(R, &r));
  PetscCall(DecomposeTriangle(n, r, svd->sigma, Vt));
  PetscCall(MatDenseRestoreArray(R, &r));
  /* R has been overwritten by U. */
  PetscCall(BVMultInPlace(Q, R, 0, n));
  if (Q != svd->U) {
    PetscCall(BVSetActiveColumns(svd->U, 0, n));
    PetscCall(BVGetMat(svd->U, &u));
    PetscCall(BVGetMat(Q, &q));
    PetscCall(CopyRows(q, u, PETSC_TRUE, count, row));
    PetscCall(BVRestoreMat(Q, &q));
    PetscCall(BVRestoreMat(svd->U, &u));
  }
  PetscCall(PetscFree(row));
  PetscCall(StoreRight(svd->V, n, Vt));
  PetscCall(PetscFree(Vt));
  HycoDestroyAll(&R, &Q);
  svd->its = 1;
  svd->nconv = n;
  svd->reason = SVD_CONVERGED_TOL;
  PetscCall(SVDMonitor(svd, svd->its, svd->nconv, svd->sigma, svd->errest, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A type of SLEPc's SVD, so that options, monitors and views are those of the others. */
static PetscErrorCode TSQRCreate(SVD svd)
{
  PetscFunctionBegin;
  svd->ops->setup = SetUp;
  svd->ops->solve = TSQRSolve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Registered once: a program may start SLEPc itself. */
PetscErrorCode HycoSVDRegisterAll(void)
{
  PetscErrorCode (*create)(SVD);

  PetscFunctionBegin;
  PetscCall(SVDInitializePackage());
  PetscCall(PetscFunctionListFind(SVDList, HYCO_SVD_TSQR, &create));
  if (!create) PetscCall(SVDRegister(HYCO_SVD_TSQR, TSQRCreate));
  PetscFunctionReturn(PETSC_SUCCESS);
}
