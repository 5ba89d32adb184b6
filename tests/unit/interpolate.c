/* Interpolation in parameter space: exactness, and the rule outside the points. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

/* A linear function of up to 3 parameters of very different sizes. */
static PetscReal Linear(PetscInt dim, const PetscReal x[])
{
  const PetscReal slope[3] = {3, -2e-4, 5e3};
  PetscReal value = 7;

  for (PetscInt p = 0; p < dim; p++) value += slope[p] * x[p];
  return value;
}

/* The size of parameter p. */
static PetscReal Size(PetscInt p)
{
  const PetscReal size[3] = {1, 1e4, 1e-3};

  return size[p];
}

/* At random x of the box: weights are nonnegative with sum 1, and linear functions are exact; at a point only its
   own weight is nonzero. */
static PetscErrorCode CheckLinear(PetscInt dim, PetscInt n, const PetscReal points[], const char what[])
{
  HycoInterpolant it;
  PetscReal *w;
  unsigned long long state = 7;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &w));
  PetscCall(HycoInterpolantCreate(dim, n, points, &it));
  for (PetscInt trial = 0; trial < 200; trial++) {
    PetscReal x[3], value = 0, sum = 0;

    for (PetscInt p = 0; p < dim; p++) x[p] = Size(p) * (0.5 + 0.5 * Draw(&state));
    PetscCall(HycoInterpolantGetWeights(it, x, w));
    for (PetscInt k = 0; k < n; k++) {
      CHECK(w[k] >= 0, "%s: weight %g", what, w[k]);
      value += w[k] * Linear(dim, points + k * dim);
      sum += w[k];
    }
    CHECK(fabs(sum - 1) < 1e-13, "%s: weights sum to %.17g", what, sum);
    CHECK(fabs(value - Linear(dim, x)) < 1e-11, "%s: %.17g for %.17g", what, value, Linear(dim, x));
  }
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoInterpolantGetWeights(it, points + k * dim, w));
    CHECK(fabs(w[k] - 1) < 1e-11, "%s: point %d has the weight %.17g at itself", what, (int)k, w[k]);
  }
  PetscCall(HycoInterpolantDestroy(&it));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The corners of the box, then points inside: scattered. */
static PetscErrorCode TestScattered(void)
{
  unsigned long long state = 11;

  PetscFunctionBegin;
  for (PetscInt dim = 1; dim <= 3; dim++) {
    PetscReal points[3 * 48];
    PetscInt n = 0;

    for (; n < (1 << dim); n++) {
      for (PetscInt p = 0; p < dim; p++) points[n * dim + p] = ((n >> p) & 1) * Size(p);
    }
    for (; n < 48; n++) {
      for (PetscInt p = 0; p < dim; p++) points[n * dim + p] = Size(p) * (0.5 + 0.5 * Draw(&state));
    }
    for (PetscInt some = 1 << dim; some <= 48; some += 5) PetscCall(CheckLinear(dim, some, points, "scattered"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A grid without one of its points in the middle of the list's order (a triangulation with many points on one
   circle), and with a repeated point. */
static PetscErrorCode TestGrid(void)
{
  PetscFunctionBegin;
  for (PetscInt dim = 1; dim <= 3; dim++) {
    PetscReal points[3 * 65], square = 0;
    PetscInt n = 0, side = 4, total = dim == 1 ? 4 : dim == 2 ? 16 : 64, inner = dim == 1 ? 1 : dim == 2 ? 5 : 21;
    PetscReal w[65], x[3];
    HycoInterpolant it;

    for (; n < total; n++) {
      for (PetscInt p = 0, rest = (7 * n + 3) % total; p < dim; p++, rest /= side)
        points[n * dim + p] = rest % side / 3.0 * Size(p);
    }
    PetscCall(CheckLinear(dim, n, points, "grid"));
    PetscCall(HycoInterpolantCreate(dim, n, points, &it));
    for (PetscInt p = 0; p < dim; p++) x[p] = 0.5 * Size(p);
    PetscCall(HycoInterpolantGetWeights(it, x, w)); /* multilinear: equal weights of the corners in the middle of a
                                                       cell */
    for (PetscInt k = 0; k < n; k++) square += w[k] * w[k];
    CHECK_NEAR(square, 1. / (1 << dim), 1e-14);
    PetscCall(HycoInterpolantDestroy(&it));
    for (PetscInt k = inner; k < n - 1; k++) { /* any but a corner of the box: those are 2^dim of total */
      PetscBool corner = PETSC_TRUE;

      for (PetscInt p = 0; p < dim; p++) {
        const PetscReal v = points[k * dim + p] / Size(p);

        corner = (PetscBool)(corner && (v < 0.1 || v > 0.9));
      }
      if (corner) continue;
      PetscCall(PetscArraymove(points + k * dim, points + (k + 1) * dim, (n - 1 - k) * dim));
      break;
    }
    PetscCall(CheckLinear(dim, n - 1, points, "grid without a point"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points outside the samples get the weights at the nearest end; samples in a line and twice the same. */
static PetscErrorCode TestOutside(void)
{
  const PetscReal line[3] = {1, 3, 2}, square[8] = {0, 0, 1, 0, 0, 1, 1, 1}, triangle[6] = {0, 0, 1, 0, 0, 1};
  const PetscReal flat[6] = {0, 0, 1, 1, 2, 2}, twice[4] = {0, 1, 0, 3};
  const PetscReal above = 9, below[2] = {-1, 0.5}, away[2] = {0.5, -2}, corner[2] = {-1, -1}, quarter = 1.5;
  HycoInterpolant it = NULL;
  PetscReal w[4], many[90];

  PetscFunctionBegin;
  PetscCall(HycoInterpolantCreate(1, 3, line, &it));
  PetscCall(HycoInterpolantGetWeights(it, &above, w));
  CHECK(w[0] == 0 && w[1] == 1 && w[2] == 0, "above the line: %g %g %g", w[0], w[1], w[2]);
  PetscCall(HycoInterpolantGetWeights(it, &quarter, w));
  CHECK(w[0] == 0.5 && w[1] == 0 && w[2] == 0.5, "between its first two: %g %g %g", w[0], w[1], w[2]);
  PetscCall(HycoInterpolantDestroy(&it));
  PetscCall(HycoInterpolantCreate(2, 4, square, &it));
  PetscCall(HycoInterpolantGetWeights(it, below, w));
  CHECK(w[0] == 0.5 && w[1] == 0 && w[2] == 0.5 && w[3] == 0, "left of the square: %g %g %g %g", w[0], w[1], w[2],
        w[3]);
  PetscCall(HycoInterpolantDestroy(&it));
  PetscCall(HycoInterpolantCreate(2, 3, triangle, &it));
  PetscCall(HycoInterpolantGetWeights(it, corner, w)); /* barycentric (3, -1, -1) */
  CHECK(w[0] == 1 && w[1] == 0 && w[2] == 0, "beyond a vertex: %g %g %g", w[0], w[1], w[2]);
  PetscCall(HycoInterpolantGetWeights(it, away, w)); /* (2.5, 0.5, -2) */
  CHECK_NEAR(w[0], 2.5 / 3, 1e-14);
  CHECK_NEAR(w[1], 0.5 / 3, 1e-14);
  CHECK_NEAR(w[2], 0, 0);
  PetscCall(HycoInterpolantDestroy(&it));
  PetscCall(HycoInterpolantCreate(1, 4, twice, &it)); /* 0 occurs twice: the first one has the weight */
  PetscCall(HycoInterpolantGetWeights(it, twice, w));
  CHECK(w[0] == 1 && w[1] == 0 && w[2] == 0 && w[3] == 0, "a point twice: %g %g %g %g", w[0], w[1], w[2], w[3]);
  PetscCall(HycoInterpolantDestroy(&it));
  CHECK_FAILS(HycoInterpolantCreate(2, 3, flat, &it), "lie on one line or plane");
  PetscCall(HycoInterpolantDestroy(&it));
  CHECK_FAILS(HycoInterpolantCreate(2, 2, flat, &it), "at least 3 are needed");
  PetscCall(HycoInterpolantDestroy(&it));
  CHECK_FAILS(HycoInterpolantCreate(0, 2, flat, &it), "2 points in 0 parameters cannot be interpolated");
  for (PetscInt k = 0; k < 10; k++) { /* the origin and the unit vectors of 9 dimensions: not a grid */
    for (PetscInt p = 0; p < 9; p++) many[k * 9 + p] = k == p + 1;
  }
  CHECK_FAILS(HycoInterpolantCreate(9, 10, many, &it), "interpolated for up to 8 parameters; here are 9");
  PetscCall(HycoInterpolantDestroy(&it));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestScattered());
  PetscCall(TestGrid());
  PetscCall(TestOutside());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
