/*
  Lemke's complementary pivoting for w = q + M z >= 0, z >= 0, w.z = 0: C. E. Lemke, Management Sci. 11 (1965) 681-689,
  with the lexicographic rule of Cottle, Pang, Stone, The Linear Complementarity Problem (1992), section 4.4; finite
  whenever M is a P-matrix or copositive plus.

  The covering vector of the artificial variable is not (1, ..., 1): with that vector Murty's matrices need 2^n pivots,
  with an irregular one a few.

  The dictionary stores only the nonbasic columns, basic = value + T nonbasic; the inverse basis for the lexicographic
  rule consists of those of its columns that belong to a w. A pivot is a change of rank one; up to CHUNK pivots are
  collected in U, V (the dictionary is T - U V^T) and applied by one matrix product, so that a pivot costs a column and
  a row, not the whole dictionary. The last basis is solved anew, so that its round-off is that of one solve.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

#define CHUNK 48

/* Variables by number: w_i is i, z_i is n + i, the artificial z0 is 2 n. */
typedef struct {
  PetscInt n, waiting;
  PetscReal *T, *U, *V;            /* column major: n x (n + 1), n x CHUNK, (n + 1) x CHUNK */
  PetscReal *value, *column, *row; /* of the basic variables (n); of the pivot (n, n + 1) */
  PetscInt *basic, *nonbasic;      /* variable of each row (n), of each column (n + 1) */
  PetscInt *where;                 /* for each variable (2 n + 1): i if it is in row i, -1 - j if it is in column j */
  PetscInt *tied;
} Dictionary;

/* Entry i of the covering vector, in [1, 2): fractional parts of multiples of the golden ratio, plus 1. */
static PetscReal LemkeCover(PetscInt i)
{
  const PetscReal x = 0.6180339887498949 * (PetscReal)(i + 1);

  return 1 + x - PetscFloorReal(x);
}

/* Scaled to entries of order one, so that the tolerances of pivots have no unit. T is [M, cover] at first; n rows, n +
   1 columns, the last for the artificial variable. */
static PetscErrorCode DictionaryCreate(PetscInt n, const PetscReal M[], const PetscReal q[], PetscReal size_M,
                                       PetscReal size_q, Dictionary *d)
{
  PetscFunctionBegin;
  d->n = n;
  d->waiting = 0;
  PetscCall(PetscMalloc3((size_t)n * (size_t)(n + 1), &d->T, n * CHUNK, &d->U, (n + 1) * CHUNK, &d->V));
  PetscCall(PetscMalloc3(n, &d->value, n, &d->column, n + 1, &d->row));
  PetscCall(PetscMalloc4(n, &d->basic, n + 1, &d->nonbasic, 2 * n + 1, &d->where, n, &d->tied));
  for (size_t k = 0; k < (size_t)n * (size_t)n; k++) d->T[k] = M[k] / size_M;
  for (PetscInt i = 0; i < n; i++) {
    /* The covering vector: slightly different entries break ties of the first pivots. */
    d->T[(size_t)n * (size_t)n + (size_t)i] = LemkeCover(i);
    d->value[i] = q[i] / size_q;
    d->basic[i] = d->where[i] = i;
    d->nonbasic[i] = n + i;
    d->where[n + i] = -1 - i;
  }
  d->nonbasic[n] = 2 * n;
  d->where[2 * n] = -1 - n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entry (i, j) of the current dictionary, with the collected pivots. */
static PetscReal LemkeEntry(const Dictionary *d, PetscInt i, PetscInt j)
{
  const size_t n = (size_t)d->n;
  PetscReal sum = d->T[(size_t)j * n + (size_t)i];

  for (PetscInt k = 0; k < d->waiting; k++)
    sum -= d->U[(size_t)k * n + (size_t)i] * d->V[(size_t)k * (n + 1) + (size_t)j];
  return sum;
}

/* Numbers of rows and columns of T, and of collected pivots. */
static PetscErrorCode LemkeSizes(const Dictionary *d, PetscBLASInt *n, PetscBLASInt *cols, PetscBLASInt *waiting)
{
  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(d->n, n));
  PetscCall(PetscBLASIntCast(d->n + 1, cols));
  PetscCall(PetscBLASIntCast(d->waiting, waiting));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* column = T[:,j]. T without its waiting pivots, and these on top: T - U V^T. */
static PetscErrorCode FetchColumn(Dictionary *d, PetscInt j)
{
  PetscBLASInt n, cols, k, one = 1;
  const PetscReal plus = 1, minus = -1;

  PetscFunctionBegin;
  PetscCall(LemkeSizes(d, &n, &cols, &k));
  PetscCall(PetscArraycpy(d->column, d->T + (size_t)j * (size_t)n, n));
  if (k) BLASgemv_("N", &n, &k, &minus, d->U, &n, d->V + j, &cols, &plus, d->column, &one);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row = T[i,:]. As FetchColumn(). */
static PetscErrorCode FetchRow(Dictionary *d, PetscInt i)
{
  PetscBLASInt n, cols, k, one = 1;
  const PetscReal plus = 1, minus = -1;

  PetscFunctionBegin;
  PetscCall(LemkeSizes(d, &n, &cols, &k));
  for (PetscInt j = 0; j < cols; j++) d->row[j] = d->T[(size_t)j * (size_t)n + (size_t)i];
  if (k) BLASgemv_("N", &cols, &k, &minus, d->V, &cols, d->U + i, &n, &plus, d->row, &one);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One product for up to 48 pivots, at the speed of matrix multiplication. */
static PetscErrorCode LemkeApply(Dictionary *d)
{
  PetscBLASInt n, cols, k;
  const PetscReal plus = 1, minus = -1;

  PetscFunctionBegin;
  PetscCall(LemkeSizes(d, &n, &cols, &k));
  if (k) BLASgemm_("N", "T", &n, &cols, &k, &minus, d->U, &n, d->V, &cols, &plus, d->T, &n);
  d->waiting = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The variable of column c becomes basic in row r; d->column has T[:,c]. Stores row and column; the pivot is
   collected. */
static PetscErrorCode LemkePivot(Dictionary *d, PetscInt r, PetscInt c)
{
  const PetscInt n = d->n, enters = d->nonbasic[c], leaves = d->basic[r];
  const PetscReal p = d->column[r], step = -d->value[r] / p;

  PetscFunctionBegin;
  PetscCall(FetchRow(d, r));
  for (PetscInt k = 0; k < d->waiting; k++)
    /* Row r and column c are replaced below as a whole: the collected pivots must not act on their new entries. */
    d->U[(size_t)k * (size_t)n + (size_t)r] = d->V[(size_t)k * (size_t)(n + 1) + (size_t)c] = 0;
  for (PetscInt j = 0; j <= n; j++) d->T[(size_t)j * (size_t)n + (size_t)r] = -d->row[j] / p;
  for (PetscInt i = 0; i < n; i++) {
    d->T[(size_t)c * (size_t)n + (size_t)i] = d->column[i] / p;
    d->value[i] += d->column[i] * step;
  }
  d->T[(size_t)c * (size_t)n + (size_t)r] = 1 / p;
  d->value[r] = step;
  d->column[r] = 0;
  d->row[c] = 0;
  PetscCall(PetscArraycpy(d->U + (size_t)d->waiting * (size_t)n, d->column, n));
  for (PetscInt j = 0; j <= n; j++) d->V[(size_t)d->waiting * (size_t)(n + 1) + (size_t)j] = d->row[j] / p;
  if (++d->waiting == CHUNK) PetscCall(LemkeApply(d));
  d->basic[r] = enters;
  d->where[enters] = r;
  d->nonbasic[c] = leaves;
  d->where[leaves] = -1 - c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Among n_tied rows that may leave, the lexicographically least row of the inverse basis over the pivot. */
static PetscInt BreakTie(const Dictionary *d, PetscInt n_tied)
{
  PetscInt *tied = d->tied;

  for (PetscInt t = 0; t < n_tied; t++) {
    if (d->basic[tied[t]] == 2 * d->n) return tied[t]; /* the artificial variable leaves first */
  }
  /* Two passes for each column: least value, then all rows within round-off of it. */
  for (PetscInt w = 0; w < d->n && n_tied > 1; w++) {
    PetscReal least = PETSC_MAX_REAL;
    PetscInt left = 0;

    for (PetscInt pass = 0; pass < 2; pass++) {
      for (PetscInt t = 0; t < n_tied; t++) {
        const PetscInt i = tied[t];
        const PetscReal inverse = d->where[w] < 0 ? -LemkeEntry(d, i, -1 - d->where[w]) : d->where[w] == i;
        const PetscReal x = -inverse / d->column[i];

        if (pass == 0) least = PetscMin(least, x);
        if (pass == 1 && x <= least + 1e-11 * PetscMax(1, PetscAbsReal(least))) tied[left++] = i;
      }
    }
    n_tied = left;
  }
  return tied[0];
}

/* The row that leaves when the variable of d->column increases: the first whose value becomes 0; -1: none. */
static PetscInt LemkeLeaving(Dictionary *d)
{
  PetscReal size = 0, largest = 0, step = PETSC_MAX_REAL;
  PetscInt n_tied = 0;

  for (PetscInt i = 0; i < d->n; i++) {
    size = PetscMax(size, PetscAbsReal(d->column[i]));
    largest = PetscMax(largest, PetscAbsReal(d->value[i]));
  }
  for (PetscInt i = 0; i < d->n; i++) {
    /* Values below 0 are round-off of degenerate rows: their step is 0, not negative. */
    if (d->column[i] < -1e-11 * size) step = PetscMin(step, PetscMax(d->value[i], 0) / -d->column[i]);
  }
  for (PetscInt i = 0; i < d->n; i++) {
    if (d->column[i] < -1e-11 * size && d->value[i] + step * d->column[i] <= 1e-13 * largest) d->tied[n_tied++] = i;
  }
  return n_tied ? BreakTie(d, n_tied) : -1;
}

/* All pivots, from the first, in row `row`, to the end. Complementary pivoting (Lemke 1965): exactly one of each pair
   w_i, z_i is basic until the artificial variable leaves. */
static PetscErrorCode LemkeRun(Dictionary *d, PetscInt row, PetscInt max_its, PetscInt *its, HycoLCPStatus *status)
{
  const PetscInt n = d->n;
  PetscInt col = n;

  PetscFunctionBegin;
  PetscCall(FetchColumn(d, n));
  *status = HYCO_LCP_LIMIT;
  for (; *its < max_its; (*its)++) {
    const PetscInt left = d->basic[row];

    PetscCall(LemkePivot(d, row, col));
    if (left == 2 * n) {
      *status = HYCO_LCP_SOLVED;
      break;
    }
    /* w_i left: z_i enters; z_i left: w_i enters. */
    col = -1 - d->where[left < n ? left + n : left - n]; /* the complement of the variable that left enters */
    PetscCall(FetchColumn(d, col));
    row = LemkeLeaving(d);
    if (row < 0) {
      *status = HYCO_LCP_RAY;
      break;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest violation of w >= 0 relative to q, and of z >= 0 relative to z. A basis from many pivots may have lost
   digits; the comparison is with the original M and q. */
static PetscReal LemkeViolation(PetscInt n, const PetscReal M[], const PetscReal q[], const PetscReal z[])
{
  PetscReal worst = 0, size_q = 0, size_z = 0, least_z = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal w = q[i];

    for (PetscInt j = 0; j < n; j++) {
      /* Most components are 0 on a sparse contact. */
      if (z[j] != 0) w += M[(size_t)j * (size_t)n + (size_t)i] * z[j];
    }
    worst = PetscMax(worst, z[i] > 0 ? PetscAbsReal(w) : -w);
    size_q = PetscMax(size_q, PetscAbsReal(q[i]));
    size_z = PetscMax(size_z, PetscAbsReal(z[i]));
    least_z = PetscMin(least_z, z[i]);
  }
  return PetscMax(worst / size_q, size_z > 0 ? -least_z / size_z : 0);
}

/* z of the last basis: from the pivots or solved anew, whichever has the smaller violation. Solving anew on the support
   removes the round-off of all pivots. */
static PetscErrorCode LemkeUnpack(const Dictionary *d, const PetscReal M[], const PetscReal q[], PetscReal scale,
                                  PetscReal z[])
{
  PetscInt *a, k = 0;
  PetscReal *fresh;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(d->n, &a, d->n, &fresh));
  for (PetscInt i = 0; i < d->n; i++) {
    z[i] = 0;
    if (d->where[d->n + i] < 0) continue;
    z[i] = PetscMax(d->value[d->where[d->n + i]], 0) * scale;
    /* The support of z alone: degenerate contacts, basic with the value 0, may make M_aa singular. */
    if (z[i] > 0) a[k++] = i;
  }
  PetscCall(HycoLCPSolveOnSet(d->n, M, q, PETSC_FALSE, NULL, &k, a, fresh, &singular));
  if (!singular && LemkeViolation(d->n, M, q, fresh) < LemkeViolation(d->n, M, q, z)) {
    for (PetscInt i = 0; i < d->n; i++) z[i] = PetscMax(fresh[i], 0);
  }
  PetscCall(PetscFree2(a, fresh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z >= 0 (n) from M (n x n, by columns) and q; ends with a solution, on a ray (no solution for the matrices of the
   header) or at the limit. On one process. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status)
{
  Dictionary d;
  PetscInt row = -1;
  PetscReal size_M = 0, size_q = 0;

  PetscFunctionBegin;
  *its = 0;
  *status = HYCO_LCP_SOLVED;
  PetscCall(PetscArrayzero(z, n));
  for (PetscInt i = 0; i < n; i++) {
    size_M = PetscMax(size_M, PetscAbsReal(M[(size_t)i * (size_t)n + (size_t)i]));
    size_q = PetscMax(size_q, PetscAbsReal(q[i]));
    /* z0 enters with the value at which all of q + Cover z0 are >= 0; the row that then is 0 leaves. */
    if (q[i] < 0 && (row < 0 || q[i] / LemkeCover(i) <= q[row] / LemkeCover(row)))
      row = i; /* the last of equal ones: lexicographic rule */
  }
  /* q >= 0: z = 0 is the solution. */
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (size_M == 0) size_M = 1;
  PetscCall(DictionaryCreate(n, M, q, size_M, size_q, &d));
  PetscCall(LemkeRun(&d, row, max_its, its, status));
  if (*status == HYCO_LCP_SOLVED) PetscCall(LemkeUnpack(&d, M, q, size_q / size_M, z));
  /* Also of one whose run ended early: no state is left outside it. */
  PetscCall(PetscFree3(d.T, d.U, d.V));
  PetscCall(PetscFree3(d.value, d.column, d.row));
  PetscCall(PetscFree4(d.basic, d.nonbasic, d.where, d.tied));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Free unknowns in units in which their rows are as large as S: the method scales by the largest entry. unit[p]. */
static void LemkeUnits(const HycoLCP *lcp, PetscReal unit[])
{
  const size_t p = (size_t)lcp->p, n = p + (size_t)lcp->n;
  PetscReal size = 0;

  for (size_t j = p; j < n; j++) size = PetscMax(size, PetscAbsReal(lcp->M[j * n + j]));
  for (size_t i = 0; i < p; i++) {
    PetscReal most = 0;

    for (size_t j = p; j < n; j++) most = PetscMax(most, PetscAbsReal(lcp->M[j * n + i]));
    unit[i] = most > 0 && size > 0 ? size / most : 1;
  }
}

/* A free unknown is the difference of two nonnegative ones, x = x+ - x-: with [0 A; -A^T S] the larger matrix is
   positive semidefinite too, which the method needs. */
PetscErrorCode HycoLCPLemkeFree(const HycoLCP *lcp, PetscInt max_its, PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status)
{
  const size_t p = (size_t)lcp->p, n = p + (size_t)lcp->n, N = n + p;
  PetscReal *M, *q, *both, *unit;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(N * N, &M, N, &q, N, &both, p, &unit));
  LemkeUnits(lcp, unit);
  for (size_t j = 0; j < N; j++) {
    const size_t column = j < n ? j : j - n;
    const PetscReal sign = j < n ? 1 : -1, scale = column < p ? sign * unit[column] : 1;

    for (size_t i = 0; i < N; i++) {
      const size_t row = i < n ? i : i - n;

      M[j * N + i] = lcp->M[column * n + row] * scale * (row < p ? (i < n ? unit[row] : -unit[row]) : 1);
    }
    q[j] = column < p ? scale * lcp->q[column] : lcp->q[column];
  }
  PetscCall(HycoLCPLemke((PetscInt)N, M, q, max_its, both, its, status));
  PetscCall(PetscArraycpy(z, both, n));
  for (size_t i = 0; i < p; i++) z[i] = unit[i] * (both[i] - both[n + i]);
  PetscCall(PetscFree4(M, q, both, unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}
