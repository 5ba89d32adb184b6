/* An upper bound fitted to data: a log-linear model with nonnegative exponents, raised above a given share of the
   data. */
#include <hycoalgorithms.h>
#include <petscsys.h>

#define RIDGE 1e-1 /* relative to the square sum of a column: correlated features share the weight */

/* c >= 0 that minimises |X c - y|^2 about the means, regularised. */
static PetscErrorCode Fit(PetscInt n, PetscInt p, const PetscReal X[], const PetscReal y[], PetscReal c[])
{
  const PetscInt rows = n + p;
  PetscReal *A, *b, mean = 0, residual;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(rows * p, &A, rows, &b));
  for (PetscInt i = 0; i < n; i++) mean += y[i] / n;
  for (PetscInt i = 0; i < n; i++) b[i] = y[i] - mean;
  for (PetscInt j = 0; j < p; j++) {
    PetscReal at = 0, square = 0;

    for (PetscInt i = 0; i < n; i++) at += X[i * p + j] / n;
    for (PetscInt i = 0; i < n; i++) {
      A[j * rows + i] = X[i * p + j] - at;
      square += A[j * rows + i] * A[j * rows + i];
    }
    A[j * rows + n + j] = PetscSqrtReal(RIDGE * square);
  }
  PetscCall(HycoNNLS(rows, p, A, b, c, &residual));
  PetscCall(PetscFree2(A, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRaiseBound(PetscInt n, PetscInt p, const PetscReal X[], const PetscReal y[], PetscReal share,
                              PetscReal c[])
{
  PetscReal *above;

  PetscFunctionBegin;
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_PLIB, "there is nothing to bound");
  PetscCall(PetscMalloc1(n, &above));
  for (PetscInt i = 0; i < n; i++) {
    above[i] = y[i];
    for (PetscInt j = 0; j < p; j++) above[i] -= c[j] * X[i * p + j];
  }
  PetscCall(PetscSortReal(n, above));
  c[p] = above[PetscMin((PetscInt)PetscCeilReal(share * (PetscReal)(n + 1) * (1 - 1e-12)), n) - 1];
  PetscCall(PetscFree(above));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoUpperBound(PetscInt n, PetscInt telling, PetscInt p, const PetscReal X[], const PetscReal y[],
                              PetscReal share, PetscReal c[])
{
  PetscFunctionBegin;
  PetscCall(Fit(telling, p, X, y, c));
  PetscCall(HycoRaiseBound(n, p, X, y, share, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
