/* Refinement with residuals in twice the working precision, on Hilbert matrices: integer entries, an exact solution. */
#include "check.h"
#include <hycolinear.h>
#include <math.h>

/* K = common / (i + j + 1), which is an integer, b = K x + low with x = 1, 2, ... */
static PetscErrorCode TestHilbert(PetscBLASInt n, PetscReal common, PetscReal low)
{
  PetscReal K[144], lu[144], b[12], rest[12], x[12], before = 0, after = 0;
  PetscBLASInt ipiv[12], one = 1, info;

  PetscFunctionBegin;
  for (PetscBLASInt i = 0; i < n; i++) {
    b[i] = 0;
    for (PetscBLASInt j = 0; j < n; j++) {
      lu[j * n + i] = K[j * n + i] = common / (i + j + 1);
      b[i] += K[j * n + i] * (j + 1);
    }
    rest[i] = low * K[i];
    x[i] = b[i];
  }
  LAPACKgetrf_(&n, &n, lu, &n, ipiv, &info);
  LAPACKgetrs_("N", &n, &one, lu, &n, ipiv, x, &n, &info);
  for (PetscBLASInt i = 0; i < n; i++) before = fmax(before, fabs(x[i] - (i + 1)));
  PetscCall(HycoRefine(n, K, n, lu, ipiv, b, low != 0 ? rest : NULL, x));
  for (PetscBLASInt i = 0; i < n; i++) after = fmax(after, fabs(x[i] - (i + 1) - (i == 0 ? low : 0)));
  CHECK(before > 1e-9, "n = %d: the factors alone leave %g; this is no test", (int)n, before);
  CHECK(after <= 2e-15 * n, "n = %d: %g before, %g after", (int)n, before, after);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum of products in twice the precision. */
static PetscErrorCode TestProduct(void)
{
  PetscReal sum[2] = {0, 0};

  PetscFunctionBegin;
  HycoAddProduct(1e8 + 1, 1e8 + 1, sum); /* 1e16 + 2e8 + 1 */
  HycoAddProduct(-1e8, 1e8, sum);
  HycoAddProduct(-2e8, 1, sum);
  CHECK(sum[0] + sum[1] == 1, "%g + %g", sum[0], sum[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestProduct());
  PetscCall(TestHilbert(8, 360360, 0)); /* condition 1.5e10 */
  PetscCall(TestHilbert(8, 360360, 1e-13));
  PetscCall(TestHilbert(10, 232792560, 0)); /* 1.6e13 */
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
