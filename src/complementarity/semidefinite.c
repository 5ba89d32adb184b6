/*
  Floating bodies, supported only by contact: the dense problem in z = (x_pinned, L),

    [ K'    A ] [x_p]   [-f']   [0]
    [ -A^T  S ] [ L ] + [ g ] = [w],     0 <= w complementary to L >= 0

  by the active set method. It starts with every contact closed, so that contact prevents rigid motions if it can, and
  opens those under tension.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

typedef struct {
  PetscInt p, m, n; /* numbers of pinned unknowns, contacts, both */
  const PetscReal *M, *q;
  PetscReal flexibility; /* a typical S_ii as scale: L = L' / flexibility and K' flexibility are of order one like A */
  PetscInt k, *a;        /* the set: pinned unknowns, then active contacts */
  PetscReal *z, *w;
} Floating;

static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  Floating *h = (Floating *)ctx;
  PetscReal *A, *x, least = PETSC_MAX_REAL, most = 0;
  PetscBLASInt n, one = 1, info, *ipiv;
  size_t k;

  PetscFunctionBegin;
  for (h->k = 0; h->k < h->p; h->k++) h->a[h->k] = h->k;
  for (PetscInt i = 0; i < h->m; i++) {
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
  *singular = (PetscBool)(info != 0 || !(least > 1e-13 * most));
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
  for (PetscInt i = 0; i < h->p; i++) size = PetscMax(size, PetscAbsReal(h->z[i]));
  return size;
}

static PetscErrorCode Violations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Floating *h = (const Floating *)ctx;
  const PetscReal size_w = Slack(h);
  PetscReal size_z = 0;

  PetscFunctionBegin;
  for (PetscInt i = h->p; i < h->n; i++) size_z = PetscMax(size_z, PetscAbsReal(h->z[i]));
  for (PetscInt i = 0; i < h->m; i++)
    violates[i] = (PetscBool)(active[i] ? h->z[h->p + i] < -1e-12 * size_z : h->w[h->p + i] < -1e-12 * size_w);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoLCPSemidefinite(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                   HycoLCPStatus *status)
{
  const PetscInt n = lcp->p + lcp->n;
  Floating h = {lcp->p, lcp->n, n, lcp->M, lcp->q, 0, 0, NULL, z, NULL};
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
  PetscCall(PetscMalloc2(n, &h.a, n, &h.w));
  for (PetscInt i = lcp->p; i < n; i++)
    h.flexibility = PetscMax(h.flexibility, PetscAbsReal(lcp->M[(size_t)i * (size_t)n + (size_t)i]));
  if (h.flexibility == 0) h.flexibility = 1;
  PetscCall(HycoActiveSetRun(&e, active, its, status));
  PetscCall(PetscFree2(h.a, h.w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
