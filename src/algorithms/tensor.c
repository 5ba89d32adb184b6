/*
  Polynomials on tensor grids by weights of their nodes: value(at) = sum of weight[k] data[k], interpolation if the
  degree is one less than the number of nodes, least squares if it is lower. On each axis the weights are sums of
  products of polynomials that are orthonormal on the nodes, made by Arnoldi's process on x (Brubeck, Nakatsukasa,
  Trefethen, SIAM Rev. 63 (2021) 405-415), which spans the same space as Chebyshev polynomials and is well conditioned
  on any nodes.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* Zeros of Chebyshev's polynomial on [lo, hi], ascending. */
PetscErrorCode HycoChebyshevNodes(PetscInt n, PetscReal lo, PetscReal hi, PetscReal x[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++)
    x[k] = (lo + hi) / 2 - (hi - lo) / 2 * PetscCosReal(PETSC_PI * (2 * k + 1) / (2 * (PetscReal)n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next orthonormal polynomial, x times the last one orthogonalised against the previous ones, at the n nodes
   and, as entry n, at the point. Orthogonalised twice, against round-off. */
static void NextPolynomial(PetscInt n, const PetscReal s[], PetscInt d, PetscReal P[])
{
  PetscReal *p = P + d * (n + 1), length = 0;

  for (PetscInt k = 0; k <= n; k++) p[k] = d ? s[k] * p[k - (n + 1)] : 1;
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt j = 0; j < d; j++) {
      const PetscReal *q = P + j * (n + 1);
      PetscReal dot = 0;

      for (PetscInt k = 0; k < n; k++) dot += p[k] * q[k];
      for (PetscInt k = 0; k <= n; k++) p[k] -= dot * q[k];
    }
  }
  for (PetscInt k = 0; k < n; k++) length += p[k] * p[k];
  for (PetscInt k = 0; k <= n; k++) p[k] /= PetscSqrtReal(length);
}

/* s[n + 1]: the nodes and the point `at` in [-1, 1], where the polynomials are of one size whatever the parameter's
   unit. */
static void TensorScale(PetscInt n, const PetscReal x[], PetscReal at, PetscReal s[])
{
  const PetscReal middle = (x[0] + x[n - 1]) / 2, half = x[n - 1] > x[0] ? (x[n - 1] - x[0]) / 2 : 1;

  for (PetscInt k = 0; k < n; k++) s[k] = (x[k] - middle) / half;
  s[n] = (at - middle) / half;
}

/* weight[n] of the polynomial's value at `at` by the nodes' data. The degree is limited by the number of nodes. */
PetscErrorCode HycoPolynomialWeights(PetscInt n, const PetscReal x[], PetscInt degree, PetscReal at, PetscReal weight[])
{
  const PetscInt top = PetscMin(degree, n - 1);
  PetscReal *s, *P;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(weight, n));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(n + 1, &s, (top + 1) * (n + 1), &P));
  TensorScale(n, x, at, s);
  for (PetscInt d = 0; d <= top; d++) {
    const PetscReal *p = P + d * (n + 1);

    NextPolynomial(n, s, d, P);
    for (PetscInt k = 0; k < n; k++) weight[k] += p[k] * p[n];
  }
  PetscCall(PetscFree2(s, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An empty product for no axis: a constant has one node. */
PetscInt HycoTensorSize(const HycoTensor *t)
{
  PetscInt size = 1;

  for (PetscInt p = 0; p < t->dim; p++) size *= t->n[p];
  return size;
}

/* Weights of all nodes (their product over the axes), the last axis fastest. Axes of one node have the weight 1. */
PetscErrorCode HycoTensorWeights(const HycoTensor *t, const PetscReal at[], PetscReal weight[])
{
  PetscReal *w;
  PetscInt size = 1, most = 1;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < t->dim; p++) most = PetscMax(most, t->n[p]);
  PetscCall(PetscMalloc1(most, &w));
  weight[0] = 1;
  for (PetscInt p = 0; p < t->dim; p++) {
    if (t->n[p] == 1) continue;
    PetscCall(HycoPolynomialWeights(t->n[p], t->x[p], t->degree[p], at[p], w));
    for (PetscInt k = size - 1; k >= 0; k--) { /* from the end, because the product grows in place */
      for (PetscInt j = t->n[p] - 1; j >= 0; j--) weight[k * t->n[p] + j] = weight[k] * w[j];
    }
    size *= t->n[p];
  }
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[rows] = data weight, data rows x nodes by columns. */
static PetscErrorCode TensorSum(const HycoGridField *f, const PetscReal weight[], PetscReal value[])
{
  const PetscReal one = 1, zero = 0;
  const PetscBLASInt step = 1;
  PetscBLASInt rows, nodes;

  PetscFunctionBegin;
  if (!f->rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(f->rows, &rows));
  PetscCall(PetscBLASIntCast(HycoTensorSize(&f->tensor), &nodes));
  BLASgemv_("N", &rows, &nodes, &one, f->data, &rows, weight, &step, &zero, value, &step);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field at a point of the parameters. */
PetscErrorCode HycoGridFieldEvaluate(const HycoGridField *f, const PetscReal at[], PetscReal value[])
{
  PetscReal *w;

  PetscFunctionBegin;
  if (!f->rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(HycoTensorSize(&f->tensor), &w));
  PetscCall(HycoTensorWeights(&f->tensor, at, w));
  PetscCall(TensorSum(f, w, value));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The products of the axes' polynomials, the last axis fastest. */
PetscErrorCode HycoTensorPolynomials(const HycoTensor *t, PetscReal Q[])
{
  const PetscInt size = HycoTensorSize(t);
  PetscReal *s, *P;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < size * size; i++) Q[i] = 1;
  for (PetscInt p = 0, after = size; p < t->dim; p++) {
    const PetscInt n = t->n[p];

    if (n == 1) continue;
    after /= n; /* nodes of the axes after this one */
    PetscCall(PetscMalloc2(n + 1, &s, n * (n + 1), &P));
    TensorScale(n, t->x[p], t->x[p][0], s);
    for (PetscInt d = 0; d < n; d++) NextPolynomial(n, s, d, P);
    for (PetscInt i = 0; i < size * size; i++) Q[i] *= P[i % size / after % n * (n + 1) + i / size / after % n];
    PetscCall(PetscFree2(s, P));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
