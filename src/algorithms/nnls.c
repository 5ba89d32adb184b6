/* Nonnegative least squares: Lawson and Hanson's active set method; the passive columns are kept in a QR
   factorisation that grows with them. */
#include <hycoalgorithms.h>

/* Q R = A[:, p[0..k)], y = Q^T b; Q m x k and R column major with leading dimensions m and n. */
typedef struct {
  PetscInt m, n, k, *p;
  PetscReal *Q, *R, *y;
} Passive;

/* Appends column j of A by modified Gram-Schmidt, twice; false if it depends on the present ones. Dependent: less than
   1e-12 of its length remains. f->y is Q^T b, so that the solution on the set is one back substitution. */
static PetscBool NNLSAppend(Passive *f, const PetscReal A[], const PetscReal b[], PetscInt j)
{
  const PetscInt m = f->m, k = f->k;
  PetscReal *q = f->Q + (size_t)k * (size_t)m, *r = f->R + (size_t)k * (size_t)f->n, before = 0, after = 0;

  for (PetscInt i = 0; i < m; i++) {
    q[i] = A[(size_t)j * (size_t)m + (size_t)i];
    before += q[i] * q[i];
  }
  for (PetscInt c = 0; c < k; c++) r[c] = 0;
  /* Twice is enough (Kahan, Parlett): the second pass removes what cancellation left in the first. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt c = 0; c < k; c++) {
      const PetscReal *other = f->Q + (size_t)c * (size_t)m;
      PetscReal dot = 0;

      for (PetscInt i = 0; i < m; i++) dot += other[i] * q[i];
      for (PetscInt i = 0; i < m; i++) q[i] -= dot * other[i];
      r[c] += dot;
    }
  }
  for (PetscInt i = 0; i < m; i++) after += q[i] * q[i];
  /* Also false for NaN, which must not enter the set. */
  if (!(after > 1e-24 * before)) return PETSC_FALSE;
  r[k] = PetscSqrtReal(after);
  f->y[k] = 0;
  for (PetscInt i = 0; i < m; i++) {
    q[i] /= r[k];
    f->y[k] += q[i] * b[i];
  }
  f->p[f->k++] = j;
  return PETSC_TRUE;
}

/* z = R^-1 y */
static void BackSolve(const Passive *f, PetscReal z[])
{
  for (PetscInt i = f->k - 1; i >= 0; i--) {
    z[i] = f->y[i];
    for (PetscInt c = i + 1; c < f->k; c++) z[i] -= f->R[(size_t)c * (size_t)f->n + (size_t)i] * z[c];
    z[i] /= f->R[(size_t)i * (size_t)f->n + (size_t)i];
  }
}

/* Largest step from x towards z (by position in p) that keeps x >= 0, taken in place; returns the position of the
   entry that becomes 0, -1 if z is reached. */
PetscInt HycoNNLSStep(PetscInt k, const PetscInt p[], const PetscReal z[], PetscReal x[])
{
  PetscReal alpha = 1;
  PetscInt blocking = -1;

  for (PetscInt j = 0; j < k; j++) {
    const PetscReal step = z[j] < 0 ? x[p[j]] / (x[p[j]] - z[j]) : 0; /* z = 0: the entry already has this value */

    if (z[j] <= 0 && (blocking < 0 || step < alpha)) {
      alpha = step;
      blocking = j;
    }
  }
  for (PetscInt j = 0; j < k; j++) x[p[j]] += alpha * (z[j] - x[p[j]]);
  return blocking;
}

/* Moves from x towards z until an entry becomes 0, which then leaves the set; true if z itself is reached. The
   factorisation is made anew from the entries that stay: removals are rare. The inner loop of Lawson and Hanson. */
static PetscBool MoveTowards(Passive *f, const PetscReal A[], const PetscReal b[], const PetscReal z[], PetscReal x[],
                             PetscBool passive[])
{
  const PetscInt k = f->k;
  const PetscInt blocking = HycoNNLSStep(k, f->p, z, x);

  if (blocking < 0) return PETSC_TRUE;
  x[f->p[blocking]] = 0;
  f->k = 0;
  for (PetscInt j = 0; j < k; j++) {
    const PetscInt column = f->p[j];

    if (x[column] > 0 && NNLSAppend(f, A, b, column)) continue;
    x[column] = 0;
    passive[column] = PETSC_FALSE;
  }
  return PETSC_FALSE;
}

/* Of a gradient: equal columns differ by the round-off of their norms, 1e-14 with the condition 1e6; the first is then
   taken on every number of ranks (tests/unit/nnls.c). */
#define TIED_GRADIENT 1e-8

/* r = b - A x = b - Q Q^T b, and the gradient w = A^T r. */
static void NNLSGradient(const Passive *f, const PetscReal A[], const PetscReal b[], PetscReal r[], PetscReal w[])
{
  for (PetscInt i = 0; i < f->m; i++) r[i] = b[i];
  for (PetscInt c = 0; c < f->k; c++) {
    const PetscReal *q = f->Q + (size_t)c * (size_t)f->m;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < f->m; i++) dot += q[i] * r[i];
    for (PetscInt i = 0; i < f->m; i++) r[i] -= dot * q[i];
  }
  for (PetscInt j = 0; j < f->n; j++) {
    const PetscReal *a = A + (size_t)j * (size_t)f->m;

    w[j] = 0;
    for (PetscInt i = 0; i < f->m; i++) w[j] += a[i] * r[i];
  }
}

/* Lawson and Hanson's active set (1974), which ends after finitely many steps at a point that satisfies the KKT
   conditions. By columns; A and b are not changed. */
PetscErrorCode HycoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], PetscReal x[],
                        PetscReal *residual)
{
  PetscFunctionBegin;
  PetscCall(HycoNNLSMonitored(m, n, A, b, NULL, NULL, x, residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x >= 0 that minimises |A x - b|, A m x n by columns; monitor (NULL: none) after each column that enters. On one
   process. */
PetscErrorCode HycoNNLSMonitored(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[],
                                 PetscErrorCode (*monitor)(void *ctx, PetscInt k, PetscInt most), void *ctx,
                                 PetscReal x[], PetscReal *residual)
{
  const PetscInt most = PetscMin(m, n);
  Passive f = {m, n, 0, NULL, NULL, NULL, NULL};
  PetscReal *r, *w, *z, tol = 0;
  PetscBool *passive, *banned;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(n + 1, &f.p, (size_t)m * (size_t)(most + 1), &f.Q, (size_t)n * (size_t)(most + 1), &f.R, n + 1,
                         &f.y));
  PetscCall(PetscMalloc3(m, &r, n, &w, n + 1, &z));
  PetscCall(PetscCalloc2(n, &passive, n, &banned));
  PetscCall(PetscArrayzero(x, n));
  NNLSGradient(&f, A, b, r, w);
  /* Gradients below round-off of the first one are zero. */
  for (PetscInt j = 0; j < n; j++) tol = PetscMax(tol, 1e-12 * PetscAbsReal(w[j]));
  /* Lawson and Hanson's limit: the method is finite, but round-off could make it cycle. */
  for (PetscInt it = 0; it < 3 * n + 10 && f.k < most; it++) {
    PetscInt best = -1;

    for (PetscInt j = 0; j < n; j++) {
      if (!passive[j] && !banned[j] && w[j] > tol && (best < 0 || w[j] > (1 + TIED_GRADIENT) * w[best])) best = j;
    }
    if (best < 0) break;
    banned[best] = PETSC_TRUE; /* until the set changes */
    if (!NNLSAppend(&f, A, b, best)) continue;
    BackSolve(&f, z);
    if (z[f.k - 1] <= 0) { /* not a descent direction */
      f.k--;
      continue;
    }
    passive[best] = PETSC_TRUE;
    /* Lawson and Hanson's inner loop, which ends because each round removes a column. */
    while (!MoveTowards(&f, A, b, z, x, passive)) BackSolve(&f, z);
    PetscCall(PetscArrayzero(banned, n));
    NNLSGradient(&f, A, b, r, w);
    if (monitor) PetscCall((*monitor)(ctx, f.k, most));
  }
  /* r is that of the last gradient, thus of the present x. */
  if (residual) {
    *residual = 0;
    for (PetscInt i = 0; i < m; i++) *residual += r[i] * r[i];
    *residual = PetscSqrtReal(*residual);
  }
  PetscCall(PetscFree4(f.p, f.Q, f.R, f.y));
  PetscCall(PetscFree3(r, w, z));
  PetscCall(PetscFree2(passive, banned));
  PetscFunctionReturn(PETSC_SUCCESS);
}
