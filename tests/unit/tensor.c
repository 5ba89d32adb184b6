/* Polynomials on tensor grids: exactness, convergence as in theory, least squares. */
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
  PetscReal data[10], w[10];
  HycoTensor t = {3, {5, 1, 2}, {3, 0, 1}, {x, NULL, y}};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 10; k++) data[k] = Product(x[k / 2], y[k % 2]);
  CHECK(HycoTensorSize(&t) == 10, "size %d", (int)HycoTensorSize(&t));
  for (PetscInt k = 0; k < 20; k++) {
    const PetscReal at[3] = {-0.4 + 0.12 * k, 7, 1e3 + 90 * k};
    PetscReal value = 0;

    PetscCall(HycoTensorWeights(&t, at, w));
    for (PetscInt j = 0; j < 10; j++) value += w[j] * data[j];
    CHECK_NEAR(value, Product(at[0], at[2]), 1e-11 * 1e5);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1/(x + 1.5) on n Chebyshev nodes of [-1, 1]: the error falls by 1.5 + sqrt(1.25) a node (Bernstein's ellipse). */
static PetscErrorCode Converges(void)
{
  PetscReal last = 0;

  PetscFunctionBegin;
  for (PetscInt n = 4; n <= 20; n += 4) {
    PetscReal x[20], data[20], w[20], worst = 0;
    HycoTensor t = {1, {n}, {n - 1}, {x}};

    PetscCall(HycoChebyshevNodes(n, -1, 1, x));
    for (PetscInt k = 0; k < n; k++) data[k] = 1 / (x[k] + 1.5);
    for (PetscInt k = 0; k <= 200; k++) {
      const PetscReal at = -1 + 0.01 * k;
      PetscReal value = 0;

      PetscCall(HycoTensorWeights(&t, &at, w));
      for (PetscInt j = 0; j < n; j++) value += w[j] * data[j];
      worst = PetscMax(worst, PetscAbsReal(value - 1 / (at + 1.5)));
    }
    if (last > 0) CHECK(fabs(log(last / worst) / log(pow(1.5 + sqrt(1.25), 4)) - 1) < 0.1, "%g, then %g", last, worst);
    last = worst;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quadratic through three nodes, at a fourth place; a line by least squares through four values that alternate. */
static PetscErrorCode Weights(void)
{
  const PetscReal x[4] = {0, 1, 2, 3}, expected[3] = {1, -3, 3}, line[4] = {-0.2, 0.1, 0.4, 0.7};
  PetscReal w[4];

  PetscFunctionBegin;
  PetscCall(HycoPolynomialWeights(3, x, 5, 3, w)); /* three nodes allow degree 2 */
  for (PetscInt k = 0; k < 3; k++) CHECK_NEAR(w[k], expected[k], 1e-13);
  PetscCall(HycoPolynomialWeights(4, x, 1, 3, w)); /* 1/4 + (x - 1.5) (3 - 1.5) / 5 */
  for (PetscInt k = 0; k < 4; k++) CHECK_NEAR(w[k], line[k], 1e-13);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The polynomials on the grid are orthonormal, the first is constant, and those of degrees above the data's have no
   part in them. */
static PetscErrorCode Polynomials(void)
{
  const PetscReal x[5] = {-0.4, 0.1, 0.15, 0.9, 2}, y[2] = {1e3, 3e3};
  HycoTensor t = {3, {5, 1, 2}, {4, 0, 1}, {x, NULL, y}};
  PetscReal Q[100];

  PetscFunctionBegin;
  PetscCall(HycoTensorPolynomials(&t, Q));
  for (PetscInt i = 0; i < 10; i++) {
    PetscReal part = 0;

    for (PetscInt j = 0; j < 10; j++) {
      PetscReal dot = 0;

      for (PetscInt k = 0; k < 10; k++) dot += Q[10 * k + i] * Q[10 * k + j];
      CHECK_NEAR(dot, i == j ? 1 : 0, 1e-13);
      part += Q[10 * j + i] * Product(x[j / 2], y[j % 2]);
    }
    CHECK_NEAR(Q[10 * i], PetscSqrtReal(0.1), 1e-14);
    CHECK((i >= 8) == (PetscAbsReal(part) < 1e-10 * 1e5), "polynomial %d: %g", (int)i, part);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(Polynomials());
  PetscCall(Exact());
  PetscCall(Converges());
  PetscCall(Weights());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
