/* The direct solver compared with dense algebra: S = B K^-1 B^T, g = D - B K^-1 F, x = K^-1 (F - B^T L), on any
   number of ranks. */
#include "check.h"
#include <hycosolverimpl.h>

#define N 60
#define M 7

static PetscReal stiffness[N * N], rows[M * N], inverse[N * N]; /* column major, rows by row; the same on every rank */

/* A chain with springs to the ground and a few far couplings; `stiff` scales the springs, 0 leaves the chain free. */
static PetscErrorCode MakeK(PetscReal stiff, PetscBool far, Mat *K)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(stiffness, N * N));
  for (PetscInt i = 0; i + 1 < N; i++) {
    const PetscInt j = far && i % 5 == 0 ? (i + 17) % N : i + 1;
    const PetscReal k = 1 + 0.3 * (PetscReal)(i % 4);

    stiffness[i * N + i] += k;
    stiffness[j * N + j] += k;
    stiffness[i * N + j] -= k;
    stiffness[j * N + i] -= k;
  }
  for (PetscInt i = 0; i < N; i += 7) stiffness[i * N + i] += stiff;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, N, N, N, NULL, N, NULL, K));
  PetscCall(MatGetOwnershipRange(*K, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < N; j++) {
      if (stiffness[i * N + j] != 0) PetscCall(MatSetValue(*K, i, j, stiffness[i * N + j], INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*K, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Row i closes unknowns 8 i and 8 i + 3. */
static PetscErrorCode MakeB(Mat *B, Mat *Bt)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(rows, M * N));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, M, N, 2, NULL, 2, NULL, B));
  PetscCall(MatGetOwnershipRange(*B, &lo, &hi));
  for (PetscInt i = 0; i < M; i++) {
    rows[i * N + 8 * i] = 1;
    rows[i * N + 8 * i + 3] = -0.5;
    if (i < lo || i >= hi) continue;
    PetscCall(MatSetValue(*B, i, 8 * i, 1, INSERT_VALUES));
    PetscCall(MatSetValue(*B, i, 8 * i + 3, -0.5, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(*B, MAT_INITIAL_MATRIX, Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K^-1 by elimination without pivoting: K is positive definite. */
static void Invert(void)
{
  static PetscReal work[N * N];

  for (PetscInt k = 0; k < N * N; k++) {
    work[k] = stiffness[k];
    inverse[k] = k / N == k % N;
  }
  for (PetscInt p = 0; p < N; p++) {
    const PetscReal pivot = work[p * N + p];

    for (PetscInt j = 0; j < N; j++) {
      work[p * N + j] /= pivot;
      inverse[p * N + j] /= pivot;
    }
    for (PetscInt i = 0; i < N; i++) {
      const PetscReal f = work[i * N + p];

      for (PetscInt j = 0; i != p && j < N; j++) {
        work[i * N + j] -= f * work[p * N + j];
        inverse[i * N + j] -= f * inverse[p * N + j];
      }
    }
  }
}

static PetscReal RowTimes(PetscInt i, const PetscReal x[])
{
  PetscReal sum = 0;

  for (PetscInt j = 0; j < N; j++) sum += rows[i * N + j] * x[j];
  return sum;
}

static PetscReal Force(PetscInt i)
{
  return 0.1 * (PetscReal)(i % 9) - 0.3;
}

/* x = K^-1 (F - B^T L), dense. */
static void Exact(const PetscReal L[], PetscReal x[])
{
  for (PetscInt i = 0; i < N; i++) {
    x[i] = 0;
    for (PetscInt j = 0; j < N; j++) {
      PetscReal r = Force(j);

      for (PetscInt k = 0; k < M; k++) r -= L ? rows[k * N + j] * L[k] : 0;
      x[i] += inverse[i * N + j] * r;
    }
  }
}

static PetscErrorCode CheckVec(Vec x, const PetscReal exact[])
{
  PetscInt lo, hi;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &lo, &hi));
  PetscCall(VecGetArrayRead(x, &a));
  for (PetscInt i = lo; i < hi; i++) CHECK_NEAR(a[i - lo], exact[i], 1e-11);
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckAll(HycoDirect direct, Mat K, Mat Bt, Mat B)
{
  PetscReal S[M * M], g[M], D[M], L[M], x[N], bytes;
  PetscBool singular;
  Vec F, U;
  PetscInt lo, hi;

  PetscFunctionBegin;
  Invert();
  for (PetscInt k = 0; k < M; k++) {
    D[k] = 0.2 + 0.05 * (PetscReal)k;
    L[k] = k % 2 ? 0.7 : 0;
  }
  PetscCall(MatCreateVecs(K, &U, &F));
  PetscCall(VecGetOwnershipRange(F, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) PetscCall(VecSetValue(F, i, Force(i), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(F));
  PetscCall(VecAssemblyEnd(F));
  PetscCall(HycoDirectAnalyse(direct, K, Bt, B, PETSC_TRUE, &bytes));
  CHECK(bytes > 0 && bytes < 1e9, "the estimate is %g bytes", (double)bytes);
  PetscCall(HycoDirectFactor(direct, K, Bt, B, S, &singular));
  CHECK(!singular, "K is regular");
  for (PetscInt i = 0; i < M; i++) {
    for (PetscInt j = 0; j < M; j++) {
      PetscReal column[N];

      for (PetscInt r = 0; r < N; r++) {
        column[r] = 0;
        for (PetscInt c = 0; c < N; c++) column[r] += inverse[r * N + c] * rows[j * N + c];
      }
      CHECK_NEAR(S[j * M + i], RowTimes(i, column), 1e-11);
    }
  }
  PetscCall(HycoDirectReduce(direct, NULL, NULL, 0, F, D, g));
  Exact(NULL, x);
  for (PetscInt i = 0; i < M; i++) CHECK_NEAR(g[i], D[i] - RowTimes(i, x), 1e-11);
  PetscCall(HycoDirectExpand(direct, L, U));
  Exact(L, x);
  PetscCall(CheckVec(U, x));
  PetscCall(HycoDirectSolve(direct, F, U)); /* K alone, after the reduction and before it */
  Exact(NULL, x);
  PetscCall(CheckVec(U, x));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A free chain: its null space is the constant; one unknown is pinned, and M is the bordered matrix. */
static PetscErrorCode TestPinned(void)
{
  Mat K, B, Bt;
  MatNullSpace kernel;
  HycoDirect direct;
  Vec v;
  PetscInt n, pin;
  PetscReal M_[(M + 1) * (M + 1)], bytes;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(MakeK(0, PETSC_FALSE, &K));
  PetscCall(MakeB(&B, &Bt));
  PetscCall(MatCreateVecs(K, &v, NULL));
  PetscCall(VecSet(v, 1 / PetscSqrtReal(N)));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &kernel));
  PetscCall(MatSetNullSpace(K, kernel));
  PetscCall(HycoKernelSize(K, &n));
  CHECK(n == 1, "one motion, found %d", (int)n);
  PetscCall(HycoKernelPins(K, n, &pin));
  CHECK(pin == 0, "of equals the lowest, found %d", (int)pin);
  PetscCall(HycoDirectCreate(PETSC_COMM_WORLD, &direct));
  PetscCall(HycoDirectPinKernel(direct, K));
  PetscCall(HycoDirectAnalyse(direct, K, Bt, B, PETSC_TRUE, &bytes));
  PetscCall(HycoDirectFactor(direct, K, Bt, B, M_, &singular));
  CHECK(!singular, "K without the pinned unknown is regular");
  CHECK_NEAR(M_[0], 0, 1e-12);       /* a rigid motion needs no force */
  for (PetscInt i = 0; i < M; i++) { /* and changes every row by B 1 = 0.5, with opposite signs in the border */
    CHECK_NEAR(M_[1 + i], -0.5, 1e-12);
    CHECK_NEAR(M_[(1 + i) * (M + 1)], 0.5, 1e-12);
  }
  PetscCall(HycoDirectDestroy(&direct));
  PetscCall(MatNullSpaceDestroy(&kernel));
  PetscCall(VecDestroy(&v));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns are solved with the matrix of a thin body too, which has a factor of its own on one rank alone. */
static PetscErrorCode TestThin(void)
{
  const PetscInt n = 3500;
  Mat A, R, X, AX;
  PetscInt lo, hi;
  PetscReal before, after;

  PetscFunctionBegin;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 3, NULL, 2, NULL, &A));
  PetscCall(MatGetOwnershipRange(A, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) {
    PetscCall(MatSetValue(A, i, i, 3, INSERT_VALUES));
    if (i) PetscCall(MatSetValue(A, i, i - 1, -1, INSERT_VALUES));
    if (i < n - 1) PetscCall(MatSetValue(A, i, i + 1, -1, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, hi - lo, PETSC_DECIDE, n, 2, NULL, &R));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < 2; j++) PetscCall(MatSetValue(R, i, j, PetscSinReal(i + j), INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(R, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(R, MAT_FINAL_ASSEMBLY));
  PetscCall(HycoSolveColumns(A, "the matrix of the test", R, &X));
  PetscCall(MatMatMult(A, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &AX));
  PetscCall(MatNorm(R, NORM_FROBENIUS, &before));
  PetscCall(MatAXPY(AX, -1, R, SAME_NONZERO_PATTERN));
  PetscCall(MatNorm(AX, NORM_FROBENIUS, &after));
  CHECK(before > 1 && after < 1e-12 * before, "right-hand side %g, residual %g", (double)before, (double)after);
  PetscCall(MatDestroy(&AX));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&R));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  Mat K, B, Bt;
  HycoDirect direct;

  PetscFunctionBegin;
  PetscCall(HycoDirectCreate(PETSC_COMM_WORLD, &direct));
  PetscCall(MakeB(&B, &Bt));
  for (int k = 0; k < 3; k++) { /* first the values change, then the pattern */
    PetscCall(MakeK(k == 1 ? 3 : 1, (PetscBool)(k == 2), &K));
    PetscCall(CheckAll(direct, K, Bt, B));
    PetscCall(MatScale(K, 2));
    for (PetscInt i = 0; i < N * N; i++) stiffness[i] *= 2;
    PetscCall(CheckAll(direct, K, Bt, B));
    PetscCall(MatDestroy(&K));
  }
  PetscCall(HycoDirectDestroy(&direct));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&Bt));
  PetscCall(TestPinned());
  PetscCall(TestThin());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
