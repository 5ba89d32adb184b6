/*
  Nonnegative least squares over a fixed S with row weights that differ from problem to problem: Lawson and Hanson's
  active set method (HycoNNLS()) on the normal equations. Only the columns of the Gram matrix that become passive are
  formed; once the set has converged, the gradient is computed from S itself and one step of refinement recovers the
  accuracy lost by the normal equations (A. Bjorck, Linear Algebra Appl. 88/89 (1987) 31-48, corrected seminormal
  equations).
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

struct _n_HycoWeighted {
  PetscInt m, n;
  const PetscReal *S; /* m x n column major, borrowed */
  PetscReal shift;
  const PetscReal *d, *h; /* of the current problem */
  PetscInt k, *p;         /* passive columns, in the order of joining */
  PetscReal *G, *R;       /* n x n: columns of the Gram matrix; Cholesky factor R^T R of G[p, p] by position in p */
  PetscBool *known, *passive, *banned;
  PetscReal *g, *w, *z, *t; /* S^T h, gradient, work, n each; a weighted column of S, m */
};

/* S is borrowed and must not change. For problems that differ in weights d and data h only: S, and all room, stays. */
PetscErrorCode HycoWeightedCreate(PetscInt m, PetscInt n, const PetscReal S[], PetscReal shift, HycoWeighted *weighted)
{
  HycoWeighted f;
  PetscBLASInt rows, columns;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &rows)); /* the products call BLAS with m and n */
  PetscCall(PetscBLASIntCast(n, &columns));
  PetscCall(PetscNew(&f));
  f->m = m;
  f->n = n;
  f->S = S;
  f->shift = shift;
  PetscCall(PetscMalloc2((size_t)n * (size_t)n, &f->G, (size_t)n * (size_t)n, &f->R));
  PetscCall(PetscMalloc4(n, &f->g, n, &f->w, n, &f->z, m, &f->t));
  PetscCall(PetscMalloc4(n, &f->p, n, &f->known, n, &f->passive, n, &f->banned));
  *weighted = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S is borrowed and stays. */
PetscErrorCode HycoWeightedDestroy(HycoWeighted *weighted)
{
  HycoWeighted f = *weighted;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree2(f->G, f->R));
  PetscCall(PetscFree4(f->g, f->w, f->z, f->t));
  PetscCall(PetscFree4(f->p, f->known, f->passive, f->banned));
  PetscCall(PetscFree(*weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = S^T t */
static void WeightedNNLSTransposed(HycoWeighted f, const PetscReal t[], PetscReal y[])
{
  const PetscBLASInt m = (PetscBLASInt)f->m, n = (PetscBLASInt)f->n, inc = 1;
  const PetscReal one = 1, zero = 0;

  BLASgemv_("T", &m, &n, &one, f->S, &m, t, &inc, &zero, y, &inc);
}

/* Column j of S^T diag(d) S + shift. Computed at the first use: few columns become passive. Valid for the d of the
   present call. */
static const PetscReal *WeightedNNLSGram(HycoWeighted f, PetscInt j)
{
  const PetscReal *s = f->S + (size_t)j * (size_t)f->m;
  PetscReal *column = f->G + (size_t)j * (size_t)f->n;

  if (f->known[j]) return column;
  for (PetscInt i = 0; i < f->m; i++) f->t[i] = f->d[i] * s[i];
  WeightedNNLSTransposed(f, f->t, column);
  column[j] += f->shift;
  f->known[j] = PETSC_TRUE;
  return column;
}

/* Makes column j passive; false if it depends on the passive ones. A row of the Cholesky factor, from the known
   columns. rest: what is left of the diagonal. */
static PetscBool WeightedNNLSAppend(HycoWeighted f, PetscInt j)
{
  const PetscReal *column = WeightedNNLSGram(f, j);
  PetscReal *r = f->R + (size_t)f->k * (size_t)f->n, rest = column[j];

  for (PetscInt i = 0; i < f->k; i++) {
    const PetscReal *other = f->R + (size_t)i * (size_t)f->n;

    r[i] = column[f->p[i]];
    for (PetscInt c = 0; c < i; c++) r[i] -= other[c] * r[c];
    r[i] /= other[i];
    rest -= r[i] * r[i];
  }
  /* In squares: a column of which less than 1e-7 is independent, the limit of normal equations. */
  if (!(rest > 1e-14 * column[j])) return PETSC_FALSE;
  r[f->k] = PetscSqrtReal(rest);
  f->p[f->k++] = j;
  return PETSC_TRUE;
}

/* z = G[p, p]^-1 y[p], by position in p */
static void WeightedNNLSSolve(HycoWeighted f, const PetscReal y[], PetscReal z[])
{
  for (PetscInt i = 0; i < f->k; i++) {
    const PetscReal *r = f->R + (size_t)i * (size_t)f->n;

    z[i] = y[f->p[i]];
    for (PetscInt c = 0; c < i; c++) z[i] -= r[c] * z[c];
    z[i] /= r[i];
  }
  for (PetscInt i = f->k - 1; i >= 0; i--) {
    const PetscReal *r = f->R + (size_t)i * (size_t)f->n;

    z[i] /= r[i];
    for (PetscInt c = 0; c < i; c++) z[c] -= r[c] * z[i];
  }
}

/* Moves from x towards z until an entry becomes 0, which then leaves the set; true if z itself is reached. */
static PetscBool MoveTowards(HycoWeighted f, const PetscReal z[], PetscReal x[])
{
  const PetscInt k = f->k;
  const PetscInt blocking = HycoNNLSStep(k, f->p, z, x);

  if (blocking < 0) return PETSC_TRUE;
  x[f->p[blocking]] = 0;
  f->k = 0;
  for (PetscInt j = 0; j < k; j++) {
    const PetscInt column = f->p[j];

    if (x[column] > 0 && WeightedNNLSAppend(f, column)) continue;
    x[column] = 0;
    f->passive[column] = PETSC_FALSE;
  }
  return PETSC_FALSE;
}

/* w = S^T h - G x from the passive columns. */
static void WeightedNNLSGradient(HycoWeighted f, const PetscReal x[])
{
  for (PetscInt i = 0; i < f->n; i++) f->w[i] = f->g[i];
  for (PetscInt j = 0; j < f->k; j++) {
    const PetscReal *column = f->G + (size_t)f->p[j] * (size_t)f->n, c = x[f->p[j]];

    for (PetscInt i = 0; i < f->n; i++) f->w[i] -= c * column[i];
  }
}

/* The same from S: w = S^T (h - d S x) - shift x. */
static void TrueGradient(HycoWeighted f, const PetscReal x[])
{
  for (PetscInt i = 0; i < f->m; i++) f->t[i] = 0;
  for (PetscInt j = 0; j < f->k; j++) {
    const PetscReal *s = f->S + (size_t)f->p[j] * (size_t)f->m, c = x[f->p[j]];

    for (PetscInt i = 0; i < f->m; i++) f->t[i] += c * s[i];
  }
  for (PetscInt i = 0; i < f->m; i++) f->t[i] = f->h[i] - f->d[i] * f->t[i];
  WeightedNNLSTransposed(f, f->t, f->w);
  for (PetscInt j = 0; j < f->k; j++) f->w[f->p[j]] -= f->shift * x[f->p[j]];
}

/* One step of refinement on the passive set, then the gradient: returns its largest entry where it should be zero or
   negative. The normal equations lose digits that S still has. */
static PetscReal WeightedNNLSRefine(HycoWeighted f, PetscReal x[])
{
  PetscReal worst = 0;

  TrueGradient(f, x);
  WeightedNNLSSolve(f, f->w, f->z);
  for (PetscInt j = 0; j < f->k; j++) x[f->p[j]] = PetscMax(x[f->p[j]] + f->z[j], 0);
  TrueGradient(f, x);
  for (PetscInt j = 0; j < f->n; j++)
    worst = PetscMax(worst, f->passive[j] && x[j] > 0 ? PetscAbsReal(f->w[j]) : f->w[j]);
  return worst;
}

/* The next column: among those allowed the one with the largest gradient; -1: none above tol. */
static PetscInt WeightedNNLSSteepest(HycoWeighted f, PetscReal tol)
{
  PetscInt best = -1;

  for (PetscInt j = 0; j < f->n; j++) {
    if (f->w[j] > tol && !f->passive[j] && !f->banned[j] && (best < 0 || f->w[j] > f->w[best])) best = j;
  }
  return best;
}

/* No column is passive at first: the gradient is then S^T h. d and h are borrowed until the next call. */
static PetscErrorCode WeightedNNLSBegin(HycoWeighted f, const PetscReal d[], const PetscReal h[], PetscReal x[],
                                        PetscReal *size)
{
  PetscFunctionBegin;
  f->d = d;
  f->h = h;
  f->k = 0;
  PetscCall(PetscArrayzero(x, f->n));
  PetscCall(PetscArrayzero(f->known, f->n));
  PetscCall(PetscArrayzero(f->passive, f->n));
  PetscCall(PetscArrayzero(f->banned, f->n));
  WeightedNNLSTransposed(f, h, f->g);
  PetscCall(PetscArraycpy(f->w, f->g, f->n));
  *size = 0;
  for (PetscInt j = 0; j < f->n; j++) *size = PetscMax(*size, PetscAbsReal(f->g[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x >= 0 (n) minimising the weighted problem: rows d (m) and h = d times the right-hand side (m). *solved: the
   gradient from S is at most rtol of the first. On one process. */
PetscErrorCode HycoWeightedNNLS(HycoWeighted f, const PetscReal d[], const PetscReal h[], PetscReal rtol, PetscReal x[],
                                PetscBool *solved)
{
  PetscReal size, worst = 0;

  PetscFunctionBegin;
  PetscCall(WeightedNNLSBegin(f, d, h, x, &size));
  for (PetscInt it = 0; it < 3 * f->n + 10; it++) {
    PetscInt best = WeightedNNLSSteepest(f, 1e-12 * size);

    /* The refinement costs two products with S, and is made only when the cheap gradient finds no column. */
    if (best < 0) { /* first by the normal equations, then by S */
      worst = WeightedNNLSRefine(f, x);
      best = WeightedNNLSSteepest(f, 1e-12 * size);
    }
    if (best < 0) break;
    f->banned[best] = PETSC_TRUE; /* until the set changes */
    if (!WeightedNNLSAppend(f, best)) continue;
    WeightedNNLSSolve(f, f->g, f->z);
    if (f->z[f->k - 1] <= 0) { /* not a descent direction */
      f->k--;
      continue;
    }
    f->passive[best] = PETSC_TRUE;
    while (!MoveTowards(f, f->z, x)) WeightedNNLSSolve(f, f->g, f->z);
    PetscCall(PetscArrayzero(f->banned, f->n));
    WeightedNNLSGradient(f, x);
    worst = PETSC_MAX_REAL; /* until the refinement */
  }
  *solved = (PetscBool)(worst <= rtol * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}
