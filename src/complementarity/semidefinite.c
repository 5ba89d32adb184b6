/*
  Bodies that contact alone holds: the dense problem in z = (x_pinned, L),

      [ K'    A ] [x_p]   [-f']   [0]
      [ -A^T  S ] [ L ] + [ g ] = [w],     0 <= w complementary to L >= 0

  by the active set. It begins with every contact closed, which holds what contact can hold, and opens those that pull.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

typedef struct {
  PetscInt p, m, n; /* pinned, contacts, both */
  const PetscReal *M, *q;
  PetscReal flexibility; /* a typical S_ii: L = L' / flexibility and K' flexibility are of order one like A */
  PetscInt *a;           /* the set: the pinned, then the active */
  PetscReal *z, *w;
} Held;

static PetscErrorCode SolveOnSet(Held *h, PetscInt k, PetscBool *singular)
{
  PetscReal *A, *x, least = PETSC_MAX_REAL, most = 0;
  PetscBLASInt n, one = 1, info, *ipiv;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(k, &n));
  PetscCall(PetscMalloc3((size_t)k * (size_t)k, &A, k, &x, k, &ipiv));
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal column = h->a[j] < h->p ? 1 : 1 / h->flexibility;

    for (PetscInt i = 0; i < k; i++)
      A[(size_t)j * (size_t)k + (size_t)i] =
          (h->a[i] < h->p ? h->flexibility : 1) * column * h->M[(size_t)h->a[j] * (size_t)h->n + (size_t)h->a[i]];
    x[j] = -h->q[h->a[j]] * (h->a[j] < h->p ? h->flexibility : 1);
  }
  LAPACKgetrf_(&n, &n, A, &n, ipiv, &info);
  for (PetscInt j = 0; j < k; j++) {
    least = PetscMin(least, PetscAbsReal(A[(size_t)j * (size_t)k + (size_t)j]));
    most = PetscMax(most, PetscAbsReal(A[(size_t)j * (size_t)k + (size_t)j]));
  }
  *singular = (PetscBool)(info != 0 || !(least > 1e-13 * most));
  PetscCall(PetscArrayzero(h->z, h->n));
  if (!*singular) {
    LAPACKgetrs_("N", &n, &one, A, &n, ipiv, x, &n, &info);
    for (PetscInt j = 0; j < k; j++) h->z[h->a[j]] = x[j] / (h->a[j] < h->p ? 1 : h->flexibility);
  }
  PetscCall(PetscFree3(A, x, ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w, and what its round-off is measured against. */
static PetscReal Slack(Held *h, PetscInt k)
{
  PetscReal size = 0;

  for (PetscInt i = 0; i < h->n; i++) {
    h->w[i] = h->q[i];
    if (i >= h->p) size = PetscMax(size, PetscAbsReal(h->q[i]));
  }
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal *column = h->M + (size_t)h->a[j] * (size_t)h->n;

    for (PetscInt i = h->p; i < h->n; i++) h->w[i] += column[i] * h->z[h->a[j]];
  }
  for (PetscInt i = 0; i < h->p; i++) size = PetscMax(size, PetscAbsReal(h->z[i]));
  return size;
}

/* Changes the contacts that violate; only the last of them after a cycle. */
static PetscInt Flip(Held *h, PetscReal size_w, PetscBool one, PetscBool active[])
{
  PetscInt changes = 0, last = -1;
  PetscReal size_z = 0;

  for (PetscInt i = 0; i < h->m; i++) size_z = PetscMax(size_z, PetscAbsReal(h->z[h->p + i]));
  for (PetscInt i = 0; i < h->m; i++) {
    const PetscBool flip = (PetscBool)(active[i] ? h->z[h->p + i] < -1e-12 * size_z : h->w[h->p + i] < -1e-12 * size_w);

    if (!flip) continue;
    if (!one) active[i] = (PetscBool)!active[i];
    last = i;
    changes++;
  }
  if (one && changes) active[last] = (PetscBool)!active[last];
  return changes;
}

PetscErrorCode HycoSolveHeld(PetscInt p, PetscInt m, const PetscReal M[], const PetscReal q[], PetscInt max_its,
                             HycoLCPMonitor monitor, void *ctx, PetscBool active[], PetscReal z[], PetscInt *its,
                             HycoLCPStatus *status)
{
  Held h = {p, m, p + m, M, q, 0, NULL, z, NULL};
  unsigned long long *past;
  PetscBool one = PETSC_FALSE;
  PetscInt changes = 1;

  PetscFunctionBegin;
  *status = HYCO_LCP_LIMIT;
  PetscCall(PetscMalloc3(h.n, &h.a, h.n, &h.w, max_its + 1, &past));
  for (PetscInt i = p; i < h.n; i++)
    h.flexibility = PetscMax(h.flexibility, PetscAbsReal(M[(size_t)i * (size_t)h.n + (size_t)i]));
  if (h.flexibility == 0) h.flexibility = 1;
  for (*its = 0; *its < max_its && changes;) {
    PetscInt k = 0;
    PetscBool singular = PETSC_FALSE;

    past[*its] = HycoSetHash(m, active);
    for (PetscInt t = 0; t < *its; t++) one = (PetscBool)(one || past[t] == past[*its]);
    while (k < p) {
      h.a[k] = k;
      k++;
    }
    for (PetscInt i = 0; i < m; i++) {
      if (active[i]) h.a[k++] = p + i;
    }
    (*its)++;
    PetscCall(SolveOnSet(&h, k, &singular));
    if (singular) {
      *status = HYCO_LCP_SINGULAR;
      break;
    }
    changes = Flip(&h, Slack(&h, k), one, active);
    if (monitor) PetscCall(monitor(*its, k - p, changes, ctx));
    if (!changes) *status = HYCO_LCP_SOLVED;
  }
  PetscCall(PetscFree3(h.a, h.w, past));
  PetscFunctionReturn(PETSC_SUCCESS);
}
