/*
  Floating bodies, supported only by contact: the dense problem in z = (x_pinned, L),

    [ K'    A ] [x_p]   [-f']   [0]
    [ -A^T  S ] [ L ] + [ g ] = [w],     0 <= w complementary to L >= 0

  by the active set method. It starts with every contact closed, so that contact prevents rigid motions if it can, and
  opens those under tension. Where a set does not determine L and x_p (contacts that repeat others, motions that no
  closed contact prevents), or no set is reached, the proximal point method continues (proximal.c). Its springs carry
  the round-off of the gaps, which is more than a load that is tiny beside loads that balance themselves: then the
  primal active set method of quadratic programming (J. Nocedal, S. J. Wright, Numerical Optimization (2006), algorithm
  16.3) for min L.S L / 2 + g.L, A L = f', L >= 0, from the forces of a few contacts that balance the load.
*/
#include <hycoalgorithms.h>
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Of the loads, along a motion that no contact meets: 4.5e5 eps, the work of thousands of loads
   (tests/contact/floating.py). */
#define FREE_LOAD 1e-10

typedef struct {
  PetscInt p, m, n; /* numbers of pinned unknowns, contacts, both */
  const PetscReal *M, *q;
  PetscBool symmetric;   /* K' and S */
  PetscReal flexibility; /* a typical S_ii as scale: L = L' / flexibility and K' flexibility are of order one like A */
  PetscInt k, *a;        /* the set: pinned unknowns, then active contacts */
  PetscReal *z, *w;
  PetscBool *idle; /* contacts without a row: slaves that face nothing, or whose unknowns are all fixed */
} Floating;

/* A contact without flexibility, on which no rigid motion works either, changes nothing: it is left out. */
static void FindIdle(Floating *h)
{
  for (PetscInt j = 0; j < h->m; j++) {
    const PetscReal *column = h->M + (size_t)(h->p + j) * (size_t)h->n;

    h->idle[j] = (PetscBool)(column[h->p + j] == 0);
    for (PetscInt i = 0; i < h->p; i++) h->idle[j] = (PetscBool)(h->idle[j] && column[i] == 0);
  }
}

/* By LU: the matrix is not symmetric in sign. Rows of unknowns are scaled by the typical flexibility. */
static PetscErrorCode SolveByPivots(Floating *h, PetscBool *singular)
{
  PetscReal *A, *x, least = PETSC_MAX_REAL, most = 0;
  PetscBLASInt n, one = 1, info, *ipiv;
  const size_t k = (size_t)h->k;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(h->k, &n));
  PetscCall(PetscMalloc3(k * k, &A, k, &x, k, &ipiv));
  for (size_t j = 0; j < k; j++) {
    const PetscReal column = h->a[j] < h->p ? 1 : 1 / h->flexibility;

    for (size_t i = 0; i < k; i++)
      A[j * k + i] =
          (h->a[i] < h->p ? h->flexibility : 1) * column * h->M[(size_t)h->a[j] * (size_t)h->n + (size_t)h->a[i]];
    x[j] = -h->q[h->a[j]] * (h->a[j] < h->p ? h->flexibility : 1);
  }
  LAPACKgetrf_(&n, &n, A, &n, ipiv, &info);
  for (size_t j = 0; j < k; j++) {
    least = PetscMin(least, PetscAbsReal(A[j * k + j]));
    most = PetscMax(most, PetscAbsReal(A[j * k + j]));
  }
  /* The scaled matrix has entries of order one; the negation also catches NaN. */
  *singular = (PetscBool)(info != 0 || !(least > 1e-13 * PetscMax(most, 1)));
  PetscCall(PetscArrayzero(h->z, h->n));
  if (!*singular) {
    LAPACKgetrs_("N", &n, &one, A, &n, ipiv, x, &n, &info);
    for (size_t j = 0; j < k; j++) h->z[h->a[j]] = x[j] / (h->a[j] < h->p ? 1 : h->flexibility);
  }
  PetscCall(PetscFree3(A, x, ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the symmetric S of the set regular: its factor, then (K' + A S^-1 A^T) x = f' + A S^-1 g, L = S^-1 (A^T x - g).
   Half of the operations of LU, and no pivots. *solved: both are regular. */
static PetscErrorCode SolveByCholesky(Floating *h, PetscBool *solved)
{
  const PetscInt p = h->p, n = h->k - p;
  const PetscReal unit = 1;
  PetscReal *S, *Y, *H;
  PetscBLASInt size, columns, motions, one = 1;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &size));
  PetscCall(PetscBLASIntCast(p + 1, &columns));
  PetscCall(PetscBLASIntCast(p, &motions));
  PetscCall(PetscMalloc3((size_t)n * (size_t)n + 1, &S, n * (p + 1) + 1, &Y, p * (p + 1), &H));
  for (PetscInt j = 0; j < n; j++) {
    /* S of the set, the rows of A^T beside it, and g as the last right-hand side: one triangular solve for all of
       them. */
    const PetscReal *column = h->M + (size_t)h->a[p + j] * (size_t)h->n;

    for (PetscInt i = j; i < n; i++) S[(size_t)j * (size_t)n + (size_t)i] = column[h->a[p + i]];
    for (PetscInt i = 0; i < p; i++) Y[i * n + j] = column[i];
    Y[p * n + j] = h->q[h->a[p + j]];
  }
  PetscCall(HycoCholesky("L", n, S, NULL, solved));
  if (*solved) {
    if (n) BLAStrsm_("L", "L", "N", "N", &size, &columns, &unit, S, &size, Y, &size);
    for (PetscInt i = 0; i < p; i++) {
      for (PetscInt j = 0; j <= p; j++) {
        /* K' + A S^-1 A^T = K' + Y^T Y, and its right-hand side as the column p. As few as there are motions. */
        H[j * p + i] = j < p ? h->M[(size_t)j * (size_t)h->n + (size_t)i] : -h->q[i];
        for (PetscInt k = 0; k < n; k++) H[j * p + i] += Y[i * n + k] * Y[j * n + k];
      }
    }
    /* Where no closed contact meets a motion, only round-off of K' is left of its entry, and the loads' motion is
       without bounds. */
    for (PetscInt i = 0; i < p; i++) *solved = (PetscBool)(*solved && H[i * (p + 1)] * h->flexibility > HYCO_DEPENDENT);
    if (*solved) PetscCall(HycoCholesky("L", p, H, NULL, solved));
  }
  if (*solved) {
    /* In place: the last columns become the solutions. */
    PetscReal *x = H + p * p, *L = Y + p * n;

    BLAStrsm_("L", "L", "N", "N", &motions, &one, &unit, H, &motions, x, &motions);
    BLAStrsm_("L", "L", "T", "N", &motions, &one, &unit, H, &motions, x, &motions);
    for (PetscInt k = 0; k < n; k++) {
      L[k] = -L[k];
      for (PetscInt i = 0; i < p; i++) L[k] += Y[i * n + k] * x[i];
    }
    if (n) BLAStrsm_("L", "L", "T", "N", &size, &one, &unit, S, &size, L, &size);
    PetscCall(PetscArrayzero(h->z, h->n));
    for (PetscInt i = 0; i < p; i++) h->z[i] = x[i];
    for (PetscInt k = 0; k < n; k++) h->z[h->a[p + k]] = L[k];
  }
  PetscCall(PetscFree3(S, Y, H));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution with the contacts of the set closed. */
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  Floating *h = (Floating *)ctx;
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  for (h->k = 0; h->k < h->p; h->k++) h->a[h->k] = h->k;
  for (PetscInt i = 0; i < h->m; i++) {
    active[i] = (PetscBool)(active[i] && !h->idle[i]);
    if (active[i]) h->a[h->k++] = h->p + i;
  }
  *singular = PETSC_FALSE;
  if (h->symmetric) PetscCall(SolveByCholesky(h, &solved));
  if (!solved) PetscCall(SolveByPivots(h, singular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes w; returns the size relative to which its zeros are round-off. */
static PetscReal SemidefiniteSlack(const Floating *h)
{
  PetscReal size = 0;

  for (PetscInt i = 0; i < h->n; i++) {
    h->w[i] = h->q[i];
    if (i >= h->p) size = PetscMax(size, PetscAbsReal(h->q[i]));
  }
  for (PetscInt j = 0; j < h->k; j++) {
    const PetscReal *column = h->M + (size_t)h->a[j] * (size_t)h->n;

    for (PetscInt i = h->p; i < h->n; i++) h->w[i] += column[i] * h->z[h->a[j]];
  }
  /* Gaps may all be 0 while bodies move: round-off of w is then that of the motions. */
  for (PetscInt i = 0; i < h->p; i++) size = PetscMax(size, PetscAbsReal(h->z[i]));
  return size;
}

/* Forces and slacks below 1e-12 of the largest are round-off. Idle contacts violate nothing. */
static PetscErrorCode SemidefiniteViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Floating *h = (const Floating *)ctx;
  const PetscReal size_w = SemidefiniteSlack(h);
  PetscReal size_z = 0;

  PetscFunctionBegin;
  for (PetscInt i = h->p; i < h->n; i++) size_z = PetscMax(size_z, PetscAbsReal(h->z[i]));
  for (PetscInt i = 0; i < h->m; i++)
    violates[i] =
        (PetscBool)(!h->idle[i] && (active[i] ? h->z[h->p + i] < -1e-12 * size_z : h->w[h->p + i] < -1e-12 * size_w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = q + M z, for all unknowns. */
static void SemidefiniteResidual(const Floating *h, const PetscReal z[], PetscReal r[])
{
  for (PetscInt i = 0; i < h->n; i++) r[i] = h->q[i];
  for (PetscInt j = 0; j < h->n; j++) {
    const PetscReal *column = h->M + (size_t)j * (size_t)h->n;

    for (PetscInt i = 0; i < h->n && z[j] != 0; i++) r[i] += column[i] * z[j];
  }
}

/* d: the change of z that closes the contacts of the set and balances the load, from r = q + M z. Its round-off is that
   of r, not of the gaps without forces, which loads that balance themselves may make large. */
static PetscErrorCode SolveChange(Floating *h, const PetscReal r[], PetscBool active[], PetscReal d[],
                                  PetscBool *singular)
{
  Floating change = *h;

  PetscFunctionBegin;
  change.q = r;
  change.z = d;
  PetscCall(SolveOnSet(&change, active, singular));
  h->k = change.k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the square of a column, what others leave of it: its length to 1e-6, far above the round-off of normals and below
   their angles on a smooth mesh. */
#define SPANS       1e-12
#define MOST_CLOSED 200 /* closed contacts: with more, the primal method, which changes one at a time, takes too long */

/* The part of column j of A that is independent of `rank` orthonormal Q, as a share of its squared length; it is
   appended to Q if `append`. */
static PetscReal SemidefinitePart(const Floating *h, PetscInt j, PetscInt rank, PetscReal Q[], PetscBool append)
{
  const PetscReal *A = h->M + (size_t)(h->p + j) * (size_t)h->n;
  PetscReal *rest = Q + rank * h->p, before = 0, after = 0;

  for (PetscInt i = 0; i < h->p; i++) {
    rest[i] = A[i];
    before += A[i] * A[i];
  }
  for (PetscInt c = 0; c < 2 * rank; c++) { /* twice, against cancellation */
    const PetscReal *q = Q + c % rank * h->p;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < h->p; i++) dot += q[i] * rest[i];
    for (PetscInt i = 0; i < h->p; i++) rest[i] -= dot * q[i];
  }
  for (PetscInt i = 0; i < h->p; i++) after += rest[i] * rest[i];
  for (PetscInt i = 0; i < h->p && append; i++) rest[i] /= PetscSqrtReal(after);
  return before > 0 ? after / before : 0;
}

/* Closes contacts beside those of the set until these meet all motions that any contact meets, always the one that adds
   most. */
static PetscErrorCode SemidefiniteSpan(const Floating *h, PetscBool active[])
{
  PetscReal *Q;
  PetscInt rank = 0, best = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((h->p + 1) * h->p, &Q));
  for (PetscInt j = 0; j < h->m && rank < h->p; j++) {
    if (active[j]) SemidefinitePart(h, j, rank++, Q, PETSC_TRUE);
  }
  while (rank < h->p && best >= 0) {
    PetscReal most = SPANS;

    best = -1;
    for (PetscInt j = 0; j < h->m; j++) {
      const PetscReal part = active[j] || h->idle[j] ? 0 : SemidefinitePart(h, j, rank, Q, PETSC_FALSE);

      if (part > most) best = j;
      most = PetscMax(most, part);
    }
    if (best < 0) break;
    active[best] = PETSC_TRUE;
    SemidefinitePart(h, best, rank++, Q, PETSC_TRUE);
  }
  PetscCall(PetscFree(Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces L >= 0 of a few contacts that balance the load, and z = (0, L). */
static PetscErrorCode SemidefiniteBegin(Floating *h, PetscBool active[], PetscReal z[], PetscBool *exists)
{
  PetscReal *A, *f, size = 0, rest;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(h->p * h->m + 1, &A, h->p, &f));
  PetscCall(PetscArrayzero(z, h->p));
  for (PetscInt i = 0; i < h->p; i++) {
    f[i] = -h->q[i];
    size += f[i] * f[i];
  }
  for (PetscInt j = 0; j < h->m; j++)
    PetscCall(PetscArraycpy(A + j * h->p, h->M + (size_t)(h->p + j) * (size_t)h->n, h->p));
  PetscCall(HycoNNLS(h->p, h->m, A, f, z + h->p, &rest));
  *exists = (PetscBool)(rest <= HYCO_BALANCED * PetscSqrtReal(size));
  for (PetscInt j = 0; j < h->m; j++) active[j] = (PetscBool)(z[h->p + j] > 0);
  PetscCall(PetscFree2(A, f));
  if (*exists) PetscCall(SemidefiniteSpan(h, active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the columns of the set span less without contact j: then equilibrium alone determines its force. */
static PetscErrorCode SemidefiniteNeeded(const Floating *h, const PetscBool active[], PetscInt j, PetscBool *needed)
{
  PetscReal *Q;
  PetscInt rank = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((h->p + 1) * h->p, &Q));
  for (PetscInt i = 0; i < h->m && rank < h->p; i++) {
    if (active[i] && i != j && SemidefinitePart(h, i, rank, Q, PETSC_TRUE) > SPANS) rank++;
  }
  *needed = (PetscBool)(rank < h->p && SemidefinitePart(h, j, rank, Q, PETSC_FALSE) > SPANS);
  PetscCall(PetscFree(Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z += d as far as no force becomes negative; *whole: all of it. Else the contact whose force becomes 0 leaves the set.
   The change of a force that equilibrium determines is round-off. */
static PetscErrorCode SemidefiniteAdvance(const Floating *h, PetscReal d[], PetscBool active[], PetscReal z[],
                                          PetscBool *whole)
{
  PetscBool needed = PETSC_TRUE;
  PetscReal step = 1;
  PetscInt last = -1;

  PetscFunctionBegin;
  while (needed) {
    step = 1;
    last = -1;
    for (PetscInt j = h->p; j < h->n; j++) {
      if (!active[j - h->p] || z[j] + step * d[j] >= 0) continue;
      step = z[j] / -d[j];
      last = j;
    }
    needed = PETSC_FALSE;
    if (last >= 0) PetscCall(SemidefiniteNeeded(h, active, last - h->p, &needed));
    if (needed) d[last] = 0;
  }
  for (PetscInt i = 0; i < h->n; i++) z[i] += i < h->p ? d[i] : step * d[i];
  *whole = (PetscBool)(last < 0);
  if (last < 0) PetscFunctionReturn(PETSC_SUCCESS);
  z[last] = 0;
  active[last - h->p] = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The open contact that penetrates most at the residual r, or, after many changes, the last one that does; -1: none
   does. */
static PetscInt SemidefinitePenetrates(const Floating *h, const PetscBool active[], const PetscReal z[],
                                       const PetscReal r[], PetscBool any)
{
  PetscReal size = 0, most;
  PetscInt worst = -1;

  for (PetscInt i = 0; i < h->n; i++) size = PetscMax(size, PetscAbsReal(i < h->p ? z[i] : h->q[i]));
  most = -1e-12 * size;
  for (PetscInt j = 0; j < h->m; j++) {
    if (active[j] || h->idle[j] || r[h->p + j] >= most) continue;
    worst = j;
    if (!any) most = r[h->p + j];
  }
  return worst;
}

/* The primal method. The solution on each set is corrected once before it is judged. */
static PetscErrorCode SemidefiniteImprove(Floating *h, PetscBool active[], PetscReal z[], PetscInt *its,
                                          HycoLCPStatus *status)
{
  const PetscInt most = 50 + 10 * h->n;
  PetscReal *r, *d;
  PetscBool exists = PETSC_FALSE, whole = PETSC_FALSE, corrected = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(h->n, &r, h->n, &d));
  PetscCall(SemidefiniteBegin(h, active, z, &exists));
  *status = exists ? HYCO_LCP_LIMIT : HYCO_LCP_RAY;
  for (PetscInt k = 0; k < most && *status == HYCO_LCP_LIMIT; k++) {
    PetscBool singular = PETSC_FALSE;
    PetscInt worst = -1;

    SemidefiniteResidual(h, z, r);
    if (whole) worst = SemidefinitePenetrates(h, active, z, r, (PetscBool)(2 * k > most));
    if (worst >= 0) active[worst] = PETSC_TRUE;
    if (whole && worst < 0 && corrected) *status = HYCO_LCP_SOLVED;
    if (*status == HYCO_LCP_SOLVED) break;
    corrected = (PetscBool)(whole && worst < 0);
    PetscCall(SolveChange(h, r, active, d, &singular));
    if (singular || h->k > h->p + MOST_CLOSED) *status = HYCO_LCP_SINGULAR;
    if (singular) break;
    PetscCall(SemidefiniteAdvance(h, d, active, z, &whole));
    (*its)++;
  }
  PetscCall(PetscFree2(r, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The exact solution on the set, if the set determines it; *exact: no contact violates a condition there. */
static PetscErrorCode TakeExact(Floating *h, PetscBool active[], PetscBool *singular, PetscBool *exact)
{
  PetscBool *violates;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(h->m, &violates));
  PetscCall(SolveOnSet(h, active, singular));
  *exact = (PetscBool) !*singular;
  if (*exact) PetscCall(SemidefiniteViolations(h, active, violates));
  for (PetscInt i = 0; *exact && i < h->m; i++) *exact = (PetscBool)!violates[i];
  PetscCall(PetscFree(violates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The proximal method, and from its set the exact solution; without a solution, or with one that its set does not have,
   the primal method. Where the set leaves a motion free, the nearest solution stays. */
static PetscErrorCode SemidefiniteContinue(const HycoActiveSet *e, const HycoLCP *lcp, PetscBool active[],
                                           PetscReal z[], PetscInt *its, HycoLCPStatus *status)
{
  Floating *h = (Floating *)e->ctx;
  PetscReal *found;
  PetscBool *set, exact = PETSC_FALSE, singular = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoLCPProximal(lcp, NULL, active, z, its, status));
  HycoDuplicate((size_t)h->n, z, &found);
  HycoDuplicate((size_t)h->m, active, &set);
  if (*status == HYCO_LCP_SOLVED) PetscCall(TakeExact(h, active, &singular, &exact));
  if (!exact && !singular) {
    HycoLCPStatus other = HYCO_LCP_LIMIT;

    PetscCall(SemidefiniteImprove(h, active, z, its, &other));
    exact = (PetscBool)(other == HYCO_LCP_SOLVED);
    if (exact) *status = other;
  }
  /* Both have overwritten z and the set. */
  if (!exact) PetscCall(PetscArraycpy(z, found, h->n));
  if (!exact) PetscCall(PetscArraycpy(active, set, h->m));
  HycoFreeAll(&found, &set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the terms of equilibrium: 4500 eps; more, and the solution is corrected once (tests/contact/floating.py, tiny
   loads beside loads that balance themselves). */
#define UNBALANCED 1e-12

/* Corrects the solution on the set where the round-off of large gaps leaves a part of a tiny load. */
static PetscErrorCode SemidefiniteCorrect(Floating *h, PetscBool active[], PetscReal z[])
{
  PetscReal *r, *d;
  PetscBool singular, off = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(h->n, &r, h->n, &d));
  SemidefiniteResidual(h, z, r);
  for (PetscInt i = 0; i < h->p; i++) {
    PetscReal size = PetscAbsReal(h->q[i]);

    for (PetscInt j = 0; j < h->n; j++) size += PetscAbsReal(h->M[(size_t)j * (size_t)h->n + (size_t)i] * z[j]);
    off = (PetscBool)(off || PetscAbsReal(r[i]) > UNBALANCED * size);
  }
  if (off) {
    PetscCall(SolveChange(h, r, active, d, &singular));
    for (PetscInt i = 0; i < h->n && !singular; i++) z[i] += d[i];
  }
  PetscCall(PetscFree2(r, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies without loads, which carry no force, from x = 0: they stay where they are, or move as little as contact asks
   for. Forces of round-off would be a solution relative to nothing. */
static PetscErrorCode SemidefiniteUnload(Floating *h, PetscBool active[], PetscBool *done)
{
  PetscInt *row;

  PetscFunctionBegin;
  *done = PETSC_TRUE;
  for (PetscInt i = 0; i < h->p; i++) *done = (PetscBool)(*done && h->q[i] == 0);
  if (!*done) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArrayzero(h->z, h->n));
  PetscCall(PetscMalloc1(h->m, &row));
  for (PetscInt i = 0; i < h->m; i++) row[i] = h->p + i;
  PetscCall(HycoLCPUnload(h->n, h->p, h->m, row, h->M, h->q, h->z, done));
  PetscCall(PetscFree(row));
  for (PetscInt i = 0; i < h->m && *done; i++) active[i] = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Holds the motions that no contact meets, as where friction alone would hold them, and takes the round-off of the
   loads from them: M and q then are copies. A motion under a load is left free. */
static PetscErrorCode HoldFree(HycoLCP *lcp, PetscReal **M, PetscReal **q)
{
  const PetscInt p = lcp->p;
  const size_t n = (size_t)(p + lcp->n);
  PetscReal *gram, *value, *work, most = 0, size = 0;
  PetscBLASInt rows, lwork, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(p, &rows));
  lwork = 8 * rows;
  PetscCall(PetscCalloc3(p * p, &gram, p, &value, 8 * p, &work));
  for (size_t j = (size_t)p; j < n; j++) {
    for (PetscInt i = 0; i < p * p; i++) gram[i] += lcp->M[j * n + (size_t)(i / p)] * lcp->M[j * n + (size_t)(i % p)];
    most = PetscMax(most, PetscAbsReal(lcp->M[j * n + j]));
  }
  LAPACKsyev_("V", "U", &rows, gram, &rows, value, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  for (PetscInt i = 0; i < p; i++) size += lcp->q[i] * lcp->q[i];
  for (PetscInt k = 0; k < p && value[k] <= HYCO_FREE_MOTION * value[p - 1] && most > 0; k++) {
    const PetscReal *v = gram + k * p;
    PetscReal load = 0;

    for (PetscInt i = 0; i < p; i++) load += v[i] * lcp->q[i];
    if (PetscAbsReal(load) > FREE_LOAD * PetscSqrtReal(size)) continue;
    if (!*M) {
      HycoDuplicate(n * n, lcp->M, M);
      HycoDuplicate(n, lcp->q, q);
      lcp->M = *M;
      lcp->q = *q;
    }
    for (PetscInt i = 0; i < p; i++) {
      (*q)[i] -= load * v[i];
      for (PetscInt j = 0; j < p; j++) (*M)[(size_t)i * n + (size_t)j] += v[i] * v[j] / most;
    }
  }
  PetscCall(PetscFree3(gram, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For lcp->p > 0; z = (x_pinned, L). On one process, or alike on every rank. One by one: sets that change at once may
   leave a body without any contact, and the matrix singular. */
static PetscErrorCode SemidefiniteSolve(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                        HycoLCPStatus *status)
{
  const PetscInt n = lcp->p + lcp->n;
  Floating h = {.p = lcp->p, .m = lcp->n, .n = n, .M = lcp->M, .q = lcp->q, .symmetric = lcp->symmetric, .z = z};
  const HycoActiveSet e = {.comm = MPI_COMM_NULL,
                           .n = lcp->n,
                           .max_its = lcp->max_its ? lcp->max_its : 50 + 4 * lcp->n,
                           .one_by_one = PETSC_TRUE,
                           .ctx = &h,
                           .solve = SolveOnSet,
                           .violations = SemidefiniteViolations,
                           .monitor = lcp->monitor,
                           .monitor_ctx = lcp->monitor_ctx};

  PetscBool done;

  PetscFunctionBegin;
  *its = 0;
  *status = HYCO_LCP_SOLVED;
  PetscCall(SemidefiniteUnload(&h, active, &done));
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(n, &h.a, n, &h.w, lcp->n, &h.idle));
  for (PetscInt i = lcp->p; i < n; i++)
    h.flexibility = PetscMax(h.flexibility, PetscAbsReal(lcp->M[(size_t)i * (size_t)n + (size_t)i]));
  /* No contact moves anything: any scale serves. */
  if (h.flexibility == 0) h.flexibility = 1;
  FindIdle(&h);
  PetscCall(HycoActiveSetRun(&e, active, its, status));
  if (*status == HYCO_LCP_SOLVED) PetscCall(SemidefiniteCorrect(&h, active, z));
  if (*status != HYCO_LCP_SOLVED && lcp->symmetric) PetscCall(SemidefiniteContinue(&e, lcp, active, z, its, status));
  PetscCall(PetscFree3(h.a, h.w, h.idle));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoLCPSemidefinite(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                   HycoLCPStatus *status)
{
  HycoLCP held = *lcp;
  PetscReal *M = NULL, *q = NULL;

  PetscFunctionBegin;
  PetscCall(HoldFree(&held, &M, &q));
  PetscCall(SemidefiniteSolve(&held, active, z, its, status));
  HycoFreeAll(&M, &q);
  PetscFunctionReturn(PETSC_SUCCESS);
}
