/* Polynomials on tensor grids: exactness, convergence as in theory, and the leave-one-out error. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

/* (1 - 2 x + 3 x^3) (2 + y) at a grid node or a point; of degree 3 and 1. */
static PetscReal Product(PetscReal x, PetscReal y)
{
  return (1 - 2 * x + 3 * x * x * x) * (2 + y);
}

static PetscErrorCode Exact(void)
{
  const PetscReal x[5] = {-0.4, 0.1, 0.15, 0.9, 2}, y[2] = {1e3, 3e3};
  PetscReal data[10], w[10], error;
  HycoTensor t = {3, {5, 1, 2}, {4, 0, 1}, {x, NULL, y}};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 10; k++) data[k] = Product(x[k / 2], y[k % 2]);
  CHECK(HycoTensorSize(&t) == 10, "size %d", (int)HycoTensorSize(&t));
  PetscCall(HycoTensorChooseDegree(&t, 0, 1, data, &error));
  CHECK(t.degree[0] == 3, "degree %d for a cubic", (int)t.degree[0]);
  CHECK(error < 1e-12, "error %g for a cubic on five nodes", (double)error);
  for (PetscInt k = 0; k < 20; k++) {
    const PetscReal at[3] = {-0.4 + 0.12 * k, 7, 1e3 + 90 * k};
    PetscReal value = 0;

    PetscCall(HycoTensorWeights(&t, at, -1, -1, w));
    for (PetscInt j = 0; j < 10; j++) value += w[j] * data[j];
    CHECK_NEAR(value, Product(at[0], at[2]), 1e-11 * 1e5);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1/(x + 1.5) on n Chebyshev nodes of [-1, 1]: the error falls by 1.5 + sqrt(1.25) a node (Bernstein's ellipse). */
static PetscErrorCode Converges(void)
{
  PetscReal last = 0, out = 0;

  PetscFunctionBegin;
  for (PetscInt n = 4; n <= 20; n += 4) {
    PetscReal x[20], data[20], w[20], worst = 0;
    HycoTensor t = {1, {n}, {0}, {x}};

    PetscCall(HycoChebyshevNodes(n, -1, 1, x));
    for (PetscInt k = 0; k < n; k++) data[k] = 1 / (x[k] + 1.5);
    PetscCall(HycoTensorChooseDegree(&t, 0, 1, data, &out));
    CHECK(t.degree[0] == n - 1, "degree %d on %d nodes", (int)t.degree[0], (int)n);
    for (PetscInt k = 0; k <= 200; k++) {
      const PetscReal at = -1 + 0.01 * k;
      PetscReal value = 0;

      PetscCall(HycoTensorWeights(&t, &at, -1, -1, w));
      for (PetscInt j = 0; j < n; j++) value += w[j] * data[j];
      worst = PetscMax(worst, PetscAbsReal(value - 1 / (at + 1.5)));
    }
    if (last > 0) CHECK(fabs(log(last / worst) / log(pow(1.5 + sqrt(1.25), 4)) - 1) < 0.1, "%g, then %g", last, worst);
    CHECK(out * 2 > worst, "left out %g, true %g", (double)out, (double)worst); /* 2: the largest value */
    CHECK(out * 2 < 300 * worst, "left out %g, true %g", (double)out, (double)worst);
    last = worst;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Noise of 1e-3 on a line: least squares of a low degree, not interpolation, on 25 equidistant nodes. */
static PetscErrorCode Noise(void)
{
  PetscReal x[25], data[25], error;
  HycoTensor t = {1, {25}, {0}, {x}};
  unsigned long long state = 3;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 25; k++) {
    x[k] = k;
    data[k] = 1 + 0.1 * k + 1e-3 * Draw(&state);
  }
  PetscCall(HycoTensorChooseDegree(&t, 0, 1, data, &error));
  CHECK(t.degree[0] >= 1 && t.degree[0] <= 6, "degree %d", (int)t.degree[0]);
  CHECK(error < 2e-3, "error %g", (double)error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaving a node out changes the weights of the others only, whose sum stays 1. */
static PetscErrorCode Skips(void)
{
  const PetscReal x[4] = {0, 1, 2, 3}, expected[4] = {1, -3, 3, 0}; /* quadratic through three, at the fourth */
  PetscReal w[4];

  PetscFunctionBegin;
  PetscCall(HycoPolynomialWeights(4, x, 3, 3, 3, w));
  for (PetscInt k = 0; k < 4; k++) CHECK_NEAR(w[k], expected[k], 1e-13);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(Exact());
  PetscCall(Converges());
  PetscCall(Noise());
  PetscCall(Skips());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
