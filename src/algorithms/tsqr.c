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

/* Copies this rank's rows of the dense matrix A to B, which has the same number of columns: as many rows as both
   have, then zeros. Zero rows change neither R nor the singular values. */
static PetscErrorCode CopyRows(Mat A, Mat B)
{
  PetscInt n, rows, have, lda, ldb;
  const PetscScalar *a;
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, NULL, &n));
  PetscCall(MatGetLocalSize(A, &have, NULL));
  PetscCall(MatGetLocalSize(B, &rows, NULL));
  PetscCall(MatDenseGetLDA(A, &lda));
  PetscCall(MatDenseGetLDA(B, &ldb));
  PetscCall(MatDenseGetArrayRead(A, &a));
  PetscCall(MatDenseGetArrayWrite(B, &b));
  for (PetscInt j = 0; j < n; j++) {
    PetscScalar *column = b + (size_t)j * (size_t)ldb;

    PetscCall(PetscArraycpy(column, a + (size_t)j * (size_t)lda, PetscMin(have, rows)));
    if (have < rows) PetscCall(PetscArrayzero(column + have, rows - have));
  }
  PetscCall(MatDenseRestoreArrayWrite(B, &b));
  PetscCall(MatDenseRestoreArrayRead(A, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R = U s V^T: R (n x n, its upper triangle) is overwritten by U; Vt: n x n. Workspace by a query of LAPACK. The small
   triangle is the same on every rank, and decomposed by each. */
static PetscErrorCode DecomposeTriangle(PetscInt n, PetscScalar R[], PetscReal s[], PetscScalar Vt[])
{
  PetscBLASInt nb, one = 1, lwork = -1, info;
  PetscScalar size, none, *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  /* Of the factor only the upper triangle counts. */
  for (PetscInt j = 0; j < n; j++) PetscCall(PetscArrayzero(R + j * n + j + 1, n - j - 1));
  LAPACKgesvd_("O", "S", &nb, &nb, R, &nb, s, &none, &one, Vt, &nb, &size, &lwork, &info);
  lwork = (PetscBLASInt)size;
  PetscCall(PetscMalloc1(lwork, &work));
  LAPACKgesvd_("O", "S", &nb, &nb, R, &nb, s, &none, &one, Vt, &nb, work, &lwork, &info);
  PetscCall(PetscFree(work));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the singular value decomposition did not converge (LAPACK gesvd: %d)", (int)info);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q, whose n columns SLEPc's tall-skinny QR makes orthonormal: svd->U if each rank has at least n rows, as SLEPc
   requires, otherwise a copy padded with rows of zeros. SLEPc's tall-skinny QR assumes n rows on each rank. */
static PetscErrorCode MakeBasis(SVD svd, BV *Q)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)svd);
  const PetscInt n = svd->ncv;
  PetscInt rows, least;
  Mat q;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(svd->A, &rows, NULL));
  PetscCallMPI(MPI_Allreduce(&rows, &least, 1, MPIU_INT, MPI_MIN, comm));
  if (least >= n) {
    /* SLEPc's own basis, without a copy. The caller destroys *Q in both cases. */
    PetscCall(PetscObjectReference((PetscObject)svd->U));
    *Q = svd->U;
  } else {
    PetscCall(BVCreate(comm, Q));
    PetscCall(BVSetSizes(*Q, PetscMax(rows, n), PETSC_DETERMINE, n));
    PetscCall(BVSetType(*Q, BVMAT));
  }
  PetscCall(BVSetOrthogonalization(*Q, BV_ORTHOG_CGS, BV_ORTHOG_REFINE_IFNEEDED, PETSC_DEFAULT, BV_ORTHOG_BLOCK_TSQR));
  PetscCall(BVSetActiveColumns(*Q, 0, n));
  PetscCall(BVGetMat(*Q, &q));
  PetscCall(CopyRows(svd->A, q));
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
static PetscErrorCode Solve(SVD svd)
{
  const PetscInt n = svd->ncv;
  BV Q;
  Mat R, q, u;
  PetscScalar *r, *Vt;

  PetscFunctionBegin;
  PetscCall(MakeBasis(svd, &Q));
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
    PetscCall(CopyRows(q, u));
    PetscCall(BVRestoreMat(Q, &q));
    PetscCall(BVRestoreMat(svd->U, &u));
  }
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
static PetscErrorCode Create(SVD svd)
{
  PetscFunctionBegin;
  svd->ops->setup = SetUp;
  svd->ops->solve = Solve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Registered once: a program may start SLEPc itself. */
PetscErrorCode HycoSVDRegisterAll(void)
{
  PetscErrorCode (*create)(SVD);

  PetscFunctionBegin;
  PetscCall(SVDInitializePackage());
  PetscCall(PetscFunctionListFind(SVDList, HYCO_SVD_TSQR, &create));
  if (!create) PetscCall(SVDRegister(HYCO_SVD_TSQR, Create));
  PetscFunctionReturn(PETSC_SUCCESS);
}
