/*
  Polynomials on tensor grids by weights of their nodes: value(at) = sum of weight[k] data[k], interpolation if the
  degree is one less than the number of nodes, least squares if it is lower. On each axis the weights are sums of
  products of polynomials that are orthonormal on the nodes, made by Arnoldi's process on x (Brubeck, Nakatsukasa,
  Trefethen, SIAM Rev. 63 (2021) 405-415), which spans the same space as Chebyshev polynomials and is well conditioned
  on any nodes.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* Errors below this share of the data are round-off: the lowest degree with such an error is taken. */
#define ROUNDING 1e-12
/* With at most this number of nodes, only inner ones choose the degree: extrapolation to an end is a poor test for
   smooth data, and favours low degrees. With more nodes the ends distinguish noise from data. */
#define FEW  5
#define MANY 12

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

/* weight[n] of the polynomial's value at `at` by the nodes' data; without node `skip` (-1: none), whose weight is 0.
   The degree is limited by the number of nodes. */
PetscErrorCode HycoPolynomialWeights(PetscInt n, const PetscReal x[], PetscInt degree, PetscInt skip, PetscReal at,
                                     PetscReal weight[])
{
  const PetscInt n_kept = skip >= 0 && skip < n ? n - 1 : n, top = PetscMin(degree, n_kept - 1);
  PetscReal *s, *P, middle, half;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(weight, n));
  if (!n_kept) PetscFunctionReturn(PETSC_SUCCESS);
  middle = (x[0] + x[n - 1]) / 2;
  half = x[n - 1] > x[0] ? (x[n - 1] - x[0]) / 2 : 1;
  PetscCall(PetscMalloc2(n_kept + 1, &s, (top + 1) * (n_kept + 1), &P));
  for (PetscInt k = 0, at_k = 0; k < n; k++) {
    if (k != skip) s[at_k++] = (x[k] - middle) / half;
  }
  s[n_kept] = (at - middle) / half;
  for (PetscInt d = 0; d <= top; d++) {
    const PetscReal *p = P + d * (n_kept + 1);

    NextPolynomial(n_kept, s, d, P);
    for (PetscInt k = 0, at_k = 0; k < n; k++) {
      if (k == skip) continue;
      weight[k] += p[at_k] * p[n_kept];
      at_k++;
    }
  }
  PetscCall(PetscFree2(s, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How much larger the node polynomial is at `at` outside the nodes than inside: by this factor an interpolation
   error grows. */
PetscReal HycoPolynomialGrowth(PetscInt n, const PetscReal x[], PetscReal at)
{
  PetscReal inside = 0, there = 1;

  if (n < 2 || (at >= x[0] && at <= x[n - 1])) return 1;
  for (PetscInt k = 0; k < n; k++) there *= PetscAbsReal(at - x[k]) / (x[n - 1] - x[0]);
  for (PetscInt s = 1; s < 20 * n; s++) {
    const PetscReal y = x[0] + (x[n - 1] - x[0]) * (PetscReal)s / (20 * (PetscReal)n);
    PetscReal product = 1;

    for (PetscInt k = 0; k < n; k++) product *= PetscAbsReal(y - x[k]) / (x[n - 1] - x[0]);
    inside = PetscMax(inside, product);
  }
  return PetscMax(1, there / inside);
}

/* Product of the distances to the nodes, in units of a quarter of the range, where Chebyshev nodes give about 2. */
PetscReal HycoPolynomialProduct(PetscInt n, const PetscReal x[], PetscInt skip, PetscReal at)
{
  PetscReal product = 1;

  for (PetscInt k = 0; k < n; k++) {
    if (k != skip) product *= 4 * PetscAbsReal(at - x[k]) / (x[n - 1] - x[0]);
  }
  return product;
}

PetscInt HycoTensorSize(const HycoTensor *t)
{
  PetscInt size = 1;

  for (PetscInt p = 0; p < t->dim; p++) size *= t->n[p];
  return size;
}

/* Weights of all nodes (their product over the axes), the last axis fastest; along `axis` without node `skip`. */
PetscErrorCode HycoTensorWeights(const HycoTensor *t, const PetscReal at[], PetscInt axis, PetscInt skip,
                                 PetscReal weight[])
{
  PetscReal *w;
  PetscInt size = 1, most = 1;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < t->dim; p++) most = PetscMax(most, t->n[p]);
  PetscCall(PetscMalloc1(most, &w));
  weight[0] = 1;
  for (PetscInt p = 0; p < t->dim; p++) {
    if (t->n[p] == 1) continue;
    PetscCall(HycoPolynomialWeights(t->n[p], t->x[p], t->degree[p], p == axis ? skip : -1, at[p], w));
    for (PetscInt k = size - 1; k >= 0; k--) { /* from the end, because the product grows in place */
      for (PetscInt j = t->n[p] - 1; j >= 0; j--) weight[k * t->n[p] + j] = weight[k] * w[j];
    }
    size *= t->n[p];
  }
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distance in memory between neighbours along an axis. */
static PetscInt Stride(const HycoTensor *t, PetscInt axis)
{
  PetscInt stride = 1;

  for (PetscInt p = axis + 1; p < t->dim; p++) stride *= t->n[p];
  return stride;
}

/* The error for nodes first .. last along the axis. By the weights of a prediction from the other nodes on the line. */
static PetscErrorCode LeaveOut(const HycoTensor *t, PetscInt axis, PetscInt first_out, PetscInt last_out, PetscInt rows,
                               const PetscReal data[], PetscReal *error)
{
  const PetscInt n = t->n[axis], size = HycoTensorSize(t), stride = Stride(t, axis);
  PetscReal *w, *lost, worst = 0, largest = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * n, &w, rows, &lost));
  for (PetscInt i = 0; i < n; i++)
    PetscCall(HycoPolynomialWeights(n, t->x[axis], t->degree[axis], i, t->x[axis][i], w + i * n));
  for (PetscInt k = 0; k < size; k++) {
    const PetscInt i = k / stride % n, first = k - i * stride;
    const PetscReal *own = data + (size_t)k * (size_t)rows;
    PetscReal square = 0, own_square = 0;

    for (PetscInt r = 0; r < rows; r++) own_square += own[r] * own[r];
    largest = PetscMax(largest, own_square);
    if (i < first_out || i > last_out) continue;
    PetscCall(PetscArraycpy(lost, own, rows));
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal *other = data + (size_t)(first + j * stride) * (size_t)rows, weight = w[i * n + j];

      if (j == i) continue;
      for (PetscInt r = 0; r < rows; r++) lost[r] -= weight * other[r];
    }
    for (PetscInt r = 0; r < rows; r++) square += lost[r] * lost[r];
    worst = PetscMax(worst, square);
  }
  PetscCall(PetscFree2(w, lost));
  *error = largest > 0 ? PetscSqrtReal(worst / largest) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out each node along `axis` and predicts it from the others on its line: the largest error, 2-norm of a
   column, over the largest column. With interpolation this is the error for one degree less. */
static PetscErrorCode LeaveOneOut(const HycoTensor *t, PetscInt axis, PetscInt rows, const PetscReal data[],
                                  PetscReal *error)
{
  PetscFunctionBegin;
  PetscCall(LeaveOut(t, axis, 0, t->n[axis] - 1, rows, data, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of the divided differences over nodes first .. first + n - 1 of all lines along an axis. Scaled by a
   quarter of the range, so that orders can be compared. */
static PetscReal Difference(const HycoTensor *t, PetscInt axis, PetscInt first, PetscInt n, PetscInt rows,
                            const PetscReal data[])
{
  const PetscInt all = t->n[axis], size = HycoTensorSize(t), stride = Stride(t, axis);
  const PetscReal *x = t->x[axis], unit = (x[all - 1] - x[0]) / 4;
  PetscReal square = 0;

  for (PetscInt k = 0; k < size; k++) {
    if (k / stride % all) continue;
    for (PetscInt r = 0; r < rows; r++) {
      PetscReal sum = 0;

      for (PetscInt i = first; i < first + n; i++) {
        PetscReal weight = 1;

        for (PetscInt j = first; j < first + n; j++) weight *= j == i ? 1 : unit / (x[i] - x[j]);
        sum += weight * data[(size_t)(k + i * stride) * (size_t)rows + (size_t)r];
      }
      square += sum * sum;
    }
  }
  return PetscSqrtReal(square);
}

/* Decay of the divided differences of the highest orders: below 1 the polynomials converge. 1: no statement. */
PetscErrorCode HycoTensorDecay(const HycoTensor *t, PetscInt axis, PetscInt rows, const PetscReal data[],
                               PetscReal *decay)
{
  const PetscInt n = t->n[axis];
  PetscReal whole = 0, d[3] = {0, 0, 0}; /* of orders n - 1, n - 2, n - 3 */

  PetscFunctionBegin;
  *decay = 1;
  for (PetscInt order = 0; order < 3 && order < n; order++) { /* the mean of both ends, because one may be larger */
    d[order] = PetscSqrtReal(Difference(t, axis, 0, n - order, rows, data) *
                             Difference(t, axis, order, n - order, rows, data));
  }
  for (size_t k = 0; k < (size_t)HycoTensorSize(t) * (size_t)rows; k++) whole += data[k] * data[k];
  if (n < 3 || d[0] <= ROUNDING * PetscSqrtReal(whole)) PetscFunctionReturn(PETSC_SUCCESS);
  *decay = d[1] > 0 ? d[0] / d[1] : 1;
  if (n > 3 && d[2] > 0) *decay = PetscMax(*decay, PetscSqrtReal(d[0] / d[2]));
  *decay = PetscMin(*decay, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the degree along the axis by leave-one-out errors; *error: that of the chosen degree. Noise favours a lower
   degree, smooth data the highest. */
PetscErrorCode HycoTensorChooseDegree(HycoTensor *t, PetscInt axis, PetscInt rows, const PetscReal data[],
                                      PetscReal *error)
{
  const PetscInt n = t->n[axis], first = n >= FEW && n <= MANY, last = n - 1 - first;
  PetscInt best = n - 1;

  PetscFunctionBegin;
  t->degree[axis] = n - 1;
  *error = 0;
  if (n == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LeaveOut(t, axis, first, last, rows, data, error));
  for (PetscInt d = n - 2; d >= 0; d--) { /* n - 2 with one node left out is the same as n - 1: taken if exact */
    PetscReal e;

    t->degree[axis] = d;
    PetscCall(LeaveOut(t, axis, first, last, rows, data, &e));
    if (e > ROUNDING && e > *error / 2) continue; /* the higher degree unless the lower one halves the error */
    best = d;
    *error = PetscMin(e, *error);
  }
  t->degree[axis] = best;
  PetscCall(LeaveOneOut(t, axis, rows, data, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[rows] = data weight, data rows x nodes by columns. */
PetscErrorCode HycoGridFieldSum(const HycoGridField *f, const PetscReal weight[], PetscReal value[])
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
PetscErrorCode HycoGridFieldEvaluate(const HycoGridField *f, const PetscReal at[], PetscInt axis, PetscInt skip,
                                     PetscReal value[])
{
  PetscReal *w;

  PetscFunctionBegin;
  if (!f->rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(HycoTensorSize(&f->tensor), &w));
  PetscCall(HycoTensorWeights(&f->tensor, at, axis, skip, w));
  PetscCall(HycoGridFieldSum(f, w, value));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
