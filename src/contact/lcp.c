/*
  Dense linear complementarity, w = q + M z >= 0, z >= 0, w.z = 0.

  Active set: the paper's section 6.2 (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865-888, for its
  convergence). Lemke: C. E. Lemke, Management Sci. 11 (1965) 681-689, with the lexicographic rule of Cottle, Pang,
  Stone, The Linear Complementarity Problem (1992), section 4.4; finite whenever M is a P-matrix or copositive plus.
*/
#include <hycosolverimpl.h>
#include <petscblaslapack.h>

unsigned long long HycoSetHash(PetscInt n, const PetscBool active[])
{
  unsigned long long hash = HYCO_HASH_START;

  for (PetscInt i = 0; i < n; i++) {
    const unsigned char bit = active[i] ? 1 : 0;

    hash = HycoHash(hash, &bit, 1);
  }
  return hash;
}

/* z on the set a[0..k): M_aa z_a = -q_a. */
static PetscErrorCode SolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt k, const PetscInt a[],
                                 PetscReal z[], PetscBool *singular)
{
  PetscReal *Maa, *za;
  PetscBLASInt nb, one = 1, info = 0, *ipiv;

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(PetscArrayzero(z, n));
  if (!k) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3((size_t)k * (size_t)k, &Maa, k, &za, k, &ipiv));
  for (PetscInt j = 0; j < k; j++) {
    za[j] = -q[a[j]];
    for (PetscInt i = 0; i < k; i++)
      Maa[(size_t)j * (size_t)k + (size_t)i] = M[(size_t)a[j] * (size_t)n + (size_t)a[i]];
  }
  PetscCall(PetscBLASIntCast(k, &nb));
  LAPACKgesv_(&nb, &one, Maa, &nb, ipiv, za, &nb, &info);
  *singular = (PetscBool)(info != 0);
  for (PetscInt j = 0; j < k && !info; j++) {
    z[a[j]] = za[j];
    if (PetscIsInfOrNanReal(za[j])) *singular = PETSC_TRUE;
  }
  PetscCall(PetscFree3(Maa, za, ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = q + M z, and the size against which its zeros are round-off. */
static PetscReal Slack(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt k, const PetscInt a[],
                       const PetscReal z[], PetscReal w[])
{
  PetscReal size = 0;

  for (PetscInt i = 0; i < n; i++) {
    w[i] = q[i];
    size = PetscMax(size, PetscAbsReal(q[i]));
  }
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal *column = M + (size_t)a[j] * (size_t)n;

    for (PetscInt i = 0; i < n; i++) w[i] += column[i] * z[a[j]];
  }
  return size;
}

PetscErrorCode HycoLCPActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its,
                                HycoMonitor monitor, void *ctx, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status)
{
  PetscInt *a;
  PetscReal *w;
  unsigned long long *past;

  PetscFunctionBegin;
  *status = HYCO_LCP_LIMIT;
  PetscCall(PetscMalloc3(n, &a, n, &w, max_its + 1, &past));
  for (*its = 0; *its < max_its;) {
    PetscInt k = 0, changes = 0;
    PetscBool singular;
    PetscReal size_w, size_z = 0;

    past[*its] = HycoSetHash(n, active);
    for (PetscInt t = 0; t < *its; t++) {
      if (past[t] == past[*its]) *status = HYCO_LCP_CYCLE;
    }
    if (*status == HYCO_LCP_CYCLE) break;
    for (PetscInt i = 0; i < n; i++) {
      if (active[i]) a[k++] = i;
    }
    (*its)++;
    PetscCall(SolveOnSet(n, M, q, k, a, z, &singular));
    if (singular) {
      *status = HYCO_LCP_SINGULAR;
      break;
    }
    size_w = Slack(n, M, q, k, a, z, w);
    for (PetscInt i = 0; i < n; i++) size_z = PetscMax(size_z, PetscAbsReal(z[i]));
    for (PetscInt i = 0; i < n; i++) {
      const PetscBool flip = (PetscBool)(active[i] ? z[i] < -1e-13 * size_z : w[i] < -1e-13 * size_w);

      if (flip) active[i] = (PetscBool)!active[i];
      changes += flip;
    }
    if (monitor) PetscCall(monitor(*its, k, changes, ctx));
    if (!changes) {
      *status = HYCO_LCP_SOLVED;
      break;
    }
  }
  PetscCall(PetscFree3(a, w, past));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The tableau: rows are basic variables; columns: 0 the right-hand side, 1..n the w, n+1..2n the z, 2n+1 the artificial
  z0. The columns of the w hold the inverse basis, which the lexicographic rule compares.
*/
typedef struct {
  PetscInt n, cols;
  PetscReal *a;    /* row major */
  PetscInt *basic; /* variable of each row, by column */
} Tableau;

#define ROW(t, i) ((t)->a + (size_t)(i) * (size_t)(t)->cols)

static void Pivot(Tableau *t, PetscInt row, PetscInt col)
{
  PetscReal *p = ROW(t, row), inv = 1 / p[col];

  for (PetscInt j = 0; j < t->cols; j++) p[j] *= inv;
  p[col] = 1;
  for (PetscInt i = 0; i < t->n; i++) {
    PetscReal *r = ROW(t, i), f = r[col];

    if (i == row || f == 0) continue;
    for (PetscInt j = 0; j < t->cols; j++) r[j] -= f * p[j];
    r[col] = 0;
  }
  t->basic[row] = col;
}

/* The leaving row for the entering column: least ratio, ties by the inverse basis; -1: a ray. z0 leaves when it may. */
static PetscInt Leaving(const Tableau *t, PetscInt col, PetscReal tol)
{
  PetscInt best = -1;

  for (PetscInt i = 0; i < t->n; i++) {
    const PetscReal *r = ROW(t, i), *b;

    if (r[col] <= tol) continue;
    if (best < 0) {
      best = i;
      continue;
    }
    b = ROW(t, best);
    for (PetscInt j = 0; j <= t->n; j++) {
      const PetscReal x = r[j] / r[col], y = b[j] / b[col];

      if (x < y - 1e-14 * (PetscAbsReal(x) + PetscAbsReal(y))) {
        best = i;
        break;
      }
      if (x > y + 1e-14 * (PetscAbsReal(x) + PetscAbsReal(y))) break;
      if (j == 0 && t->basic[i] == 2 * t->n + 1) {
        best = i;
        break;
      }
      if (j == 0 && t->basic[best] == 2 * t->n + 1) break;
    }
  }
  return best;
}

PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status)
{
  Tableau t = {n, 2 * n + 2, NULL, NULL};
  PetscInt row = -1, col;
  PetscReal size = 0;

  PetscFunctionBegin;
  *its = 0;
  *status = HYCO_LCP_SOLVED;
  PetscCall(PetscArrayzero(z, n));
  for (PetscInt i = 0; i < n; i++) {
    size = PetscMax(size, PetscAbsReal(M[(size_t)i * (size_t)n + (size_t)i]));
    if (q[i] < 0 && (row < 0 || q[i] < q[row])) row = i;
  }
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (size == 0) size = 1;
  PetscCall(PetscCalloc1((size_t)n * (size_t)t.cols, &t.a));
  PetscCall(PetscMalloc1(n, &t.basic));
  /* w - M z / size - z0 e = q, with z scaled by size so that the tableau is of order one */
  for (PetscInt i = 0; i < n; i++) {
    PetscReal *r = ROW(&t, i);

    r[0] = q[i];
    r[1 + i] = 1;
    for (PetscInt j = 0; j < n; j++) r[1 + n + j] = -M[(size_t)j * (size_t)n + (size_t)i] / size;
    r[2 * n + 1] = -1;
    t.basic[i] = 1 + i;
  }
  col = t.basic[row];
  Pivot(&t, row, 2 * n + 1);
  *status = HYCO_LCP_LIMIT;
  for (; *its < max_its; (*its)++) {
    const PetscInt entering = col <= n ? col + n : col - n;

    row = Leaving(&t, entering, 1e-13);
    if (row < 0) {
      *status = HYCO_LCP_RAY;
      break;
    }
    col = t.basic[row];
    Pivot(&t, row, entering);
    if (col == 2 * n + 1) {
      *status = HYCO_LCP_SOLVED;
      break;
    }
  }
  for (PetscInt i = 0; i < n; i++) {
    if (t.basic[i] > n && t.basic[i] <= 2 * n) z[t.basic[i] - n - 1] = PetscMax(ROW(&t, i)[0], 0) / size;
  }
  PetscCall(PetscFree(t.a));
  PetscCall(PetscFree(t.basic));
  PetscFunctionReturn(PETSC_SUCCESS);
}
