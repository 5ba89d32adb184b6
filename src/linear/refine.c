/*
  Iterative refinement with residuals in twice the working precision (N. J. Higham, Accuracy and Stability of Numerical
  Algorithms (2002), chapter 12): x is accurate to round-off for condition numbers up to about 1e15, and does not depend
  on the summation order of the BLAS.
*/
#include <hycolinear.h>
#include <math.h>
#include <petscblaslapack.h>

#define MAX_STEPS 20

/* Two-product by fma and two-sum: sum[0] + sum[1] has about 32 digits. */
void HycoAddProduct(PetscReal a, PetscReal b, PetscReal sum[2])
{
  /* Compilers must not reorder this: the build sets no -ffast-math. */
  const PetscReal product = a * b, high = sum[0] + product, moved = high - sum[0];

  sum[1] += ((sum[0] - (high - moved)) + (product - moved)) + fma(a, b, -product);
  sum[0] = high;
}

/* r = b + low - K x, rounded once at the end. */
static void RefineResidual(PetscBLASInt n, const PetscReal K[], PetscBLASInt lda, const PetscReal b[],
                           const PetscReal low[], const PetscReal x[], PetscReal r[])
{
  for (PetscBLASInt i = 0; i < n; i++) {
    PetscReal sum[2] = {b[i], low ? low[i] : 0};

    for (PetscBLASInt j = 0; j < n; j++) HycoAddProduct(-K[(size_t)j * (size_t)lda + (size_t)i], x[j], sum);
    r[i] = sum[0] + sum[1];
  }
}

/* x in place; stops when a step does not halve the last change. K: n x n, by columns with leading dimension lda, lu
   and ipiv by getrf. */
PetscErrorCode HycoRefine(PetscBLASInt n, const PetscReal K[], PetscBLASInt lda, const PetscReal lu[],
                          const PetscBLASInt ipiv[], const PetscReal b[], const PetscReal low[], PetscReal x[])
{
  PetscReal *r, before = PETSC_MAX_REAL;
  PetscBLASInt one = 1, info;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &r));
  for (PetscInt step = 0; step < MAX_STEPS; step++) {
    PetscReal change = 0, size = 0;

    /* In twice the working precision: otherwise refinement would stop at the error of the residual. */
    RefineResidual(n, K, lda, b, low, x, r);
    LAPACKgetrs_("N", &n, &one, lu, &n, ipiv, r, &n, &info);
    for (PetscBLASInt i = 0; i < n; i++) {
      change = PetscMax(change, PetscAbsReal(r[i]));
      size = PetscMax(size, PetscAbsReal(x[i]));
    }
    if (!(change < before / 2)) break; /* also for NaN */
    for (PetscBLASInt i = 0; i < n; i++) x[i] += r[i];
    if (change <= PETSC_MACHINE_EPSILON * size) break;
    before = change;
  }
  PetscCall(PetscFree(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}
