/*
  Floating bodies, supported only by contact: the dense problem in z = (x_pinned, L),

    [ K'    A ] [x_p]   [-f']   [0]
    [ -A^T  S ] [ L ] + [ g ] = [w],     0 <= w complementary to L >= 0

  by the active set method. It starts with every contact closed, so that contact prevents rigid motions if it can, and
  opens those under tension. Where a set does not determine L and x_p (contacts that repeat others, motions that no
  closed contact prevents), or no set is reached, the proximal point method continues (proximal.c).
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

typedef struct {
  PetscInt p, m, n; /* numbers of pinned unknowns, contacts, both */
  const PetscReal *M, *q;
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
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  Floating *h = (Floating *)ctx;
  PetscReal *A, *x, least = PETSC_MAX_REAL, most = 0;
  PetscBLASInt n, one = 1, info, *ipiv;
  size_t k;

  PetscFunctionBegin;
  for (h->k = 0; h->k < h->p; h->k++) h->a[h->k] = h->k;
  for (PetscInt i = 0; i < h->m; i++) {
    active[i] = (PetscBool)(active[i] && !h->idle[i]);
    if (active[i]) h->a[h->k++] = h->p + i;
  }
  k = (size_t)h->k;
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

/* Computes w; returns the size relative to which its zeros are round-off. */
static PetscReal Slack(const Floating *h)
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
static PetscErrorCode Violations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Floating *h = (const Floating *)ctx;
  const PetscReal size_w = Slack(h);
  PetscReal size_z = 0;

  PetscFunctionBegin;
  for (PetscInt i = h->p; i < h->n; i++) size_z = PetscMax(size_z, PetscAbsReal(h->z[i]));
  for (PetscInt i = 0; i < h->m; i++)
    violates[i] =
        (PetscBool)(!h->idle[i] && (active[i] ? h->z[h->p + i] < -1e-12 * size_z : h->w[h->p + i] < -1e-12 * size_w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The proximal method, and from its set the exact solution, if the set determines it. SolveOnSet() returns singular,
   hence the negation. */
static PetscErrorCode Continue(const HycoActiveSet *e, const HycoLCP *lcp, PetscBool active[], PetscReal z[],
                               PetscInt *its, HycoLCPStatus *status)
{
  Floating *h = (Floating *)e->ctx;
  PetscReal *found;
  PetscBool *set, *violates, exact;

  PetscFunctionBegin;
  PetscCall(HycoLCPProximal(lcp, active, z, its, status));
  if (*status != HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDuplicate((size_t)h->n, z, &found);
  HycoDuplicate((size_t)h->m, active, &set);
  PetscCall(PetscMalloc1(h->m, &violates));
  PetscCall(SolveOnSet(h, active, &exact));
  exact = (PetscBool)!exact;
  if (exact) PetscCall(Violations(h, active, violates));
  for (PetscInt i = 0; exact && i < h->m; i++) exact = (PetscBool)!violates[i];
  /* SolveOnSet() has overwritten both z and, of idle contacts, the set. */
  if (!exact) PetscCall(PetscArraycpy(z, found, h->n));
  if (!exact) PetscCall(PetscArraycpy(active, set, h->m));
  HycoFreeAll(&found, &set, &violates);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For lcp->p > 0; z = (x_pinned, L). On one process, or alike on every rank. One by one: sets that change at once may
   leave a body without any contact, and the matrix singular. */
PetscErrorCode HycoLCPSemidefinite(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                   HycoLCPStatus *status)
{
  const PetscInt n = lcp->p + lcp->n;
  Floating h = {.p = lcp->p, .m = lcp->n, .n = n, .M = lcp->M, .q = lcp->q, .z = z};
  const HycoActiveSet e = {.comm = MPI_COMM_NULL,
                           .n = lcp->n,
                           .max_its = lcp->max_its ? lcp->max_its : 50 + 4 * lcp->n,
                           .one_by_one = PETSC_TRUE,
                           .ctx = &h,
                           .solve = SolveOnSet,
                           .violations = Violations,
                           .monitor = lcp->monitor,
                           .monitor_ctx = lcp->monitor_ctx};

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n, &h.a, n, &h.w, lcp->n, &h.idle));
  for (PetscInt i = lcp->p; i < n; i++)
    h.flexibility = PetscMax(h.flexibility, PetscAbsReal(lcp->M[(size_t)i * (size_t)n + (size_t)i]));
  /* No contact moves anything: any scale serves. */
  if (h.flexibility == 0) h.flexibility = 1;
  FindIdle(&h);
  PetscCall(HycoActiveSetRun(&e, active, its, status));
  if (*status != HYCO_LCP_SOLVED && lcp->symmetric) PetscCall(Continue(&e, lcp, active, z, its, status));
  PetscCall(PetscFree3(h.a, h.w, h.idle));
  PetscFunctionReturn(PETSC_SUCCESS);
}
