/*
  Nonnegative least squares by TAO: min |A x - b|, x >= 0 is the bound-constrained quadratic problem of the normal
  equations, A^T A x - A^T b >= 0 complementary to x >= 0. Forming these costs m n^2 once, whereas the active set of
  HycoNNLS() costs m n for each column that enters; they square the condition number.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Optimality of x for min |A x - b|, x >= 0, recomputed from A (m x n, by columns): gradients relative to |a_j| |b|.
   residual (NULL: not wanted): |A x - b|. */
PetscErrorCode HycoNNLSCheck(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const PetscReal x[],
                             PetscReal rtol, PetscReal *residual, PetscBool *solved)
{
  PetscReal size = 0, sum = 0, *r;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m, &r));
  *solved = PETSC_TRUE;
  for (PetscInt i = 0; i < m; i++) r[i] = b[i];
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; x[j] != 0 && i < m; i++) r[i] -= A[(size_t)j * (size_t)m + (size_t)i] * x[j];
  }
  for (PetscInt i = 0; i < m; i++) {
    size += b[i] * b[i];
    sum += r[i] * r[i];
  }
  if (residual) *residual = PetscSqrtReal(sum);
  for (PetscInt j = 0; j < n; j++) {
    PetscReal g = 0, length = 0;

    for (PetscInt i = 0; i < m; i++) {
      const PetscReal a = A[(size_t)j * (size_t)m + (size_t)i];

      g += a * r[i];
      length += a * a;
    }
    /* Written with negations, so that NaN counts as unsolved. */
    if (!(x[j] >= 0) || !((x[j] > 0 ? PetscAbsReal(g) : g) <= rtol * PetscSqrtReal(length * size)))
      *solved = PETSC_FALSE;
  }
  PetscCall(PetscFree(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution counts only if HycoNNLSCheck() accepts it with rtol. */
PetscErrorCode HycoTaoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const char type[],
                           PetscReal rtol, PetscReal x[], PetscReal *residual, PetscBool *solved)
{
  const PetscBLASInt one = 1;
  const PetscReal unit = 1, zero = 0, minus = -1;
  PetscBLASInt mb, nb;
  PetscReal *M, *q;
  PetscInt its;
  HycoLCP lcp = {.n = n, .symmetric = PETSC_TRUE};
  HycoTao tao;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscMalloc2((size_t)n * (size_t)n, &M, n, &q));
  BLASgemm_("T", "N", &nb, &nb, &mb, &unit, A, &mb, A, &mb, &zero, M, &nb);
  BLASgemv_("T", &mb, &nb, &minus, A, &mb, b, &one, &zero, q, &one);
  lcp.M = M;
  lcp.q = q;
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, NULL, &tao));
  PetscCall(HycoTaoSetType(tao, type, 0));
  /* active NULL: only TAO's bound-constrained types may be asked for here. */
  PetscCall(HycoTaoSolveLCP(tao, &lcp, NULL, x, &its, solved));
  PetscCall(HycoTaoDestroy(&tao));
  PetscCall(HycoNNLSCheck(m, n, A, b, x, rtol, residual, solved));
  PetscCall(PetscFree2(M, q));
  PetscFunctionReturn(PETSC_SUCCESS);
}
