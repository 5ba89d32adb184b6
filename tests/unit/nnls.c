/* min |A x - b|, x >= 0: the Karush-Kuhn-Tucker conditions, and cases solved by hand. */
#include "check.h"
#include <hycoalgorithms.h>
#include <hycolcp.h>
#include <math.h>

/* x >= 0, g = A^T (b - A x) <= 0, x.g = 0, and the residual returned is |A x - b|. Returns |A x - b|. */
static PetscErrorCode CheckKKT(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], PetscReal *norm)
{
  PetscReal *x, *r, residual, size = 0, scale = 0;

  PetscFunctionBegin;
  *norm = 0;
  PetscCall(PetscMalloc2(n, &x, m, &r));
  PetscCall(HycoNNLS(m, n, A, b, x, &residual));
  for (PetscInt i = 0; i < m; i++) {
    r[i] = b[i];
    for (PetscInt j = 0; j < n; j++) r[i] -= A[j * m + i] * x[j];
    *norm += r[i] * r[i];
    size += b[i] * b[i];
  }
  *norm = sqrt(*norm);
  size = sqrt(size);
  CHECK(fabs(residual - *norm) <= 1e-10 * size, "%d x %d: residual %.12g, recomputed %.12g", (int)m, (int)n, residual,
        *norm);
  for (PetscInt j = 0; j < n; j++) {
    PetscReal g = 0, length = 0;

    for (PetscInt i = 0; i < m; i++) {
      g += A[j * m + i] * r[i];
      length += A[j * m + i] * A[j * m + i];
    }
    scale = sqrt(length) * size;
    CHECK(x[j] >= 0, "%d x %d: x[%d] = %g", (int)m, (int)n, (int)j, x[j]);
    CHECK(g <= 1e-10 * scale, "%d x %d: gradient %g of %g at %d", (int)m, (int)n, g, scale, (int)j);
    CHECK(x[j] == 0 || fabs(g) <= 1e-10 * scale, "%d x %d: gradient %g where x = %g", (int)m, (int)n, g, x[j]);
  }
  PetscCall(PetscFree2(x, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Random problems: the conditions of optimality. */
static PetscErrorCode TestRandom(void)
{
  const PetscInt sizes[][2] = {{1, 1}, {5, 3}, {10, 10}, {40, 25}, {15, 40}, {98, 120}};
  unsigned long long state = 2024;

  PetscFunctionBegin;
  for (size_t t = 0; t < 4 * sizeof(sizes) / sizeof(sizes[0]); t++) {
    const PetscInt m = sizes[t / 4][0], n = sizes[t / 4][1];
    PetscReal *A, *b, *x, norm;

    PetscCall(PetscMalloc3(m * n, &A, m, &b, n, &x));
    for (PetscInt k = 0; k < m * n; k++) A[k] = Draw(&state) + (t % 2 ? 1 : 0);
    for (PetscInt i = 0; i < m; i++) b[i] = Draw(&state);
    if (t % 4 > 1) { /* b = A x with x >= 0: the residual vanishes */
      PetscCall(PetscArrayzero(b, m));
      for (PetscInt j = 0; j < n; j++) {
        x[j] = fmax(Draw(&state), 0);
        for (PetscInt i = 0; i < m; i++) b[i] += A[j * m + i] * x[j];
      }
    }
    PetscCall(CheckKKT(m, n, A, b, &norm));
    if (t % 4 > 1) CHECK(norm <= 1e-8, "%d x %d: b is in the cone, residual %g", (int)m, (int)n, norm);
    PetscCall(PetscFree3(A, b, x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A = I: x = max(b, 0). A column twice, a zero column, b = 0. */
static PetscErrorCode TestByHand(void)
{
  const PetscReal eye[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, b[3] = {2, -3, 0.5}, zero[3] = {0, 0, 0};
  const PetscReal twice[6] = {1, 1, 0, 1, 1, 0}, nothing[6] = {0, 0, 0, 1, 0, 0};
  const PetscReal alike[6] = {1, 1, 1, 1 + 1e-12, 1 + 1e-12, 1 + 1e-12}, sum[3] = {1, 1, 1};
  PetscReal x[3], residual, norm;

  PetscFunctionBegin;
  PetscCall(HycoNNLS(3, 3, eye, b, x, &residual));
  CHECK_NEAR(x[0], 2, 1e-15);
  CHECK_NEAR(x[1], 0, 0);
  CHECK_NEAR(x[2], 0.5, 1e-15);
  CHECK_NEAR(residual, 3, 1e-14);
  PetscCall(HycoNNLS(3, 3, eye, zero, x, &residual));
  CHECK_NEAR(x[0] + x[1] + x[2] + residual, 0, 0);
  PetscCall(CheckKKT(3, 2, twice, b, &norm)); /* both columns push the same way: |r|^2 with x = 0 is best */
  CHECK_NEAR(norm, sqrt(4 + 9 + 0.25), 1e-14);
  PetscCall(HycoNNLS(3, 2, alike, sum, x, NULL)); /* round-off does not affect the choice between equal columns */
  CHECK_NEAR(x[0], 1, 1e-9);
  CHECK_NEAR(x[1], 0, 0);
  PetscCall(CheckKKT(3, 2, nothing, b, &norm));
  CHECK_NEAR(norm, sqrt(9 + 0.25), 1e-14);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The problem of the reconstruction: moving bumps, agreement where required, a small weight on the coefficients, which
  makes the solution unique. The active set and each Newton or gradient-projection type of TAO agree.
*/
static PetscErrorCode TestTao(void)
{
  const PetscInt N = 90;
  const char *const types[] = {"gpcg", HYCO_TAO_BNLS};
  unsigned long long state = 5;

  PetscFunctionBegin;
  for (PetscInt n = 30; n <= 240; n *= 2) {
    const PetscInt m = N + n;
    PetscReal *A, *b, *x, *y, one, other, largest = 0;
    PetscBool solved;

    PetscCall(PetscCalloc4(m * n, &A, m, &b, n, &x, n, &y));
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal centre = (1 + Draw(&state)) / 2, width = 0.15 + 0.1 * Draw(&state);

      for (PetscInt i = 0; i < N; i++) A[j * m + i] = fmax(0, 1 - pow(((PetscReal)i / N - centre) / width, 2));
      A[j * m + N + j] = 1e-3;
    }
    for (PetscInt i = 0; i < N; i++) b[i] = fmax(0, 1 - pow(((PetscReal)i / N - 0.5) / 0.2, 2)) + 0.1 * Draw(&state);
    PetscCall(HycoNNLS(m, n, A, b, x, &one));
    PetscCall(HycoNNLSCheck(m, n, A, b, x, 1e-10, &other, &solved));
    CHECK(solved, "n = %d: the active set's solution is no minimum", (int)n);
    CHECK_NEAR(other, one, 1e-12);
    for (PetscInt j = 0; j < n; j++) largest = fmax(largest, x[j]);
    for (size_t t = 0; t < sizeof(types) / sizeof(types[0]); t++) {
      PetscCall(HycoTaoNNLS(m, n, A, b, types[t], 1e-9, y, &other, &solved));
      CHECK(solved, "n = %d: %s did not solve it", (int)n, types[t]);
      CHECK_NEAR(other, one, 1e-10);
      for (PetscInt j = 0; j < n; j++)
        CHECK(fabs(x[j] - y[j]) <= 1e-5 * largest, "n = %d, %s: x[%d] %g for %g", (int)n, types[t], (int)j, y[j], x[j]);
    }
    for (PetscInt j = 0; j < n; j++) y[j] = 1.01 * x[j];
    PetscCall(HycoNNLSCheck(m, n, A, b, y, 1e-9, NULL, &solved));
    CHECK(!solved, "n = %d: the check takes a wrong solution", (int)n);
    PetscCall(PetscFree4(A, b, x, y));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = 2 x_0 + noise in [0, 1], x_1 without weight, x_2 with a negative one: c_0 near 2, the others 0, and nine
   tenths of the rows below the bound, neither fewer nor many more. */
static PetscErrorCode TestBound(void)
{
  enum { N = 400 };
  PetscReal X[3 * N], y[N], c[4];
  PetscInt below = 0, own[N];

  PetscFunctionBegin;
  for (int i = 0; i < N; i++) {
    const PetscReal noise = (i * 37 % 101) / 101.;

    own[i] = i;
    X[3 * i] = i / 100.;
    X[3 * i + 1] = i % 2;
    X[3 * i + 2] = (i * 17 % 29) / 29.;
    y[i] = 2 * X[3 * i] - X[3 * i + 2] + noise;
  }
  PetscCall(HycoUpperBound(N, N, own, 3, X, y, 0.9, c));
  CHECK_NEAR(c[0], 2 / 1.1, 0.05); /* the ridge is a tenth of the column's square */
  CHECK(c[1] >= 0 && c[1] < 0.1, "x_1 says nothing, its weight is %g", (double)c[1]);
  CHECK_NEAR(c[2], 0, 0);
  for (int i = 0; i < N; i++)
    below += y[i] <= c[3] + c[0] * X[3 * i] + c[1] * X[3 * i + 1] + c[2] * X[3 * i + 2] + 1e-12;
  CHECK(below == 361, "expected 361 of 400 below, the number ceil(0.9 * 401); found %d", (int)below);
  c[0] = 1; /* given weights */
  c[1] = 3;
  PetscCall(HycoRaiseBound(N, own, 3, X, y, 0.9, c));
  below = 0;
  for (int i = 0; i < N; i++) below += y[i] <= c[3] + X[3 * i] + 3 * X[3 * i + 1] + 1e-12;
  CHECK(below == 361 && c[0] == 1 && c[1] == 3, "expected 361 of 400 below, found %d", (int)below);
  PetscCall(HycoUpperBound(5, 5, own, 3, X, y, 0.95, c)); /* fewer rows than the quantile needs: the largest */
  below = 0;
  for (int i = 0; i < 5; i++)
    below += y[i] <= c[3] + c[0] * X[3 * i] + c[1] * X[3 * i + 1] + c[2] * X[3 * i + 2] + 1e-12;
  CHECK(below == 5, "expected all of 5 below, found %d", (int)below);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights on the rows of one S: the results of the same problems in explicit form, whatever was solved before. */
static PetscErrorCode TestWeighted(void)
{
  const PetscInt N = 60, n = 100, m = N + n;
  PetscReal *S, *A, *b, *d, *h, *x, *y, *first, residual;
  unsigned long long state = 11;
  HycoWeighted weighted;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(N * n, &S, N, &d, N, &h, n, &first));
  PetscCall(PetscCalloc4(m * n, &A, m, &b, n, &x, n, &y));
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal centre = (1 + Draw(&state)) / 2, width = 0.15 + 0.1 * Draw(&state);

    for (PetscInt i = 0; i < N; i++) S[j * N + i] = fmax(0, 1 - pow(((PetscReal)i / N - centre) / width, 2));
  }
  PetscCall(HycoWeightedCreate(N, n, S, 1e-6, &weighted));
  for (PetscInt t = 0; t < 9; t++) {
    unsigned long long problem = 1 + (unsigned long long)(t % 8); /* the ninth is the first again */
    PetscReal largest = 0;

    for (PetscInt i = 0; i < N; i++) {
      d[i] = i % 3 ? pow(Draw(&problem), 2) : 1;
      b[i] = i % 3 ? 0 : fmax(0, 1 - pow(((PetscReal)i / N - 0.5) / 0.2, 2)) + 0.1 * Draw(&problem);
      h[i] = sqrt(d[i]) * b[i];
      for (PetscInt j = 0; j < n; j++) A[j * m + i] = sqrt(d[i]) * S[j * N + i];
    }
    for (PetscInt j = 0; j < n; j++) A[j * m + N + j] = 1e-3;
    PetscCall(HycoNNLS(m, n, A, b, x, &residual));
    PetscCall(HycoWeightedNNLS(weighted, d, h, 1e-10, y, &solved));
    CHECK(solved, "problem %d is not solved", (int)t);
    for (PetscInt j = 0; j < n; j++) largest = fmax(largest, x[j]);
    for (PetscInt j = 0; j < n; j++)
      CHECK(fabs(x[j] - y[j]) <= 1e-9 * largest, "problem %d: x[%d] = %.12g for %.12g", (int)t, (int)j, y[j], x[j]);
    if (t == 0) PetscCall(PetscArraycpy(first, y, n));
    for (PetscInt j = 0; j < n && t == 8; j++) CHECK_NEAR(y[j], first[j], 0); /* no dependence on earlier problems */
  }
  PetscCall(HycoWeightedDestroy(&weighted));
  PetscCall(PetscFree4(S, d, h, first));
  PetscCall(PetscFree4(A, b, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestWeighted());
  PetscCall(TestRandom());
  PetscCall(TestByHand());
  PetscCall(TestTao());
  PetscCall(TestBound());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
