/* Nonnegative least squares, Lawson and Hanson's algorithm on the normal equations of the passive set by QR. */
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* Least squares on the columns p[0..k) of A: z (k). */
static PetscErrorCode LeastSquares(PetscInt m, const PetscReal A[], const PetscReal b[], PetscInt k, const PetscInt p[],
                                   PetscReal z[], PetscBool *deficient)
{
  PetscReal *Ap, *y, *work;
  PetscBLASInt mb, kb, one = 1, lwork, info;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m * k, &Ap, PetscMax(m, k), &y, 64 * (k + 1), &work));
  for (PetscInt j = 0; j < k; j++) PetscCall(PetscArraycpy(Ap + j * m, A + p[j] * m, m));
  PetscCall(PetscArraycpy(y, b, m));
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(k, &kb));
  PetscCall(PetscBLASIntCast(64 * (k + 1), &lwork));
  LAPACKgels_("N", &mb, &kb, &one, Ap, &mb, y, &mb, work, &lwork, &info);
  *deficient = (PetscBool)(info != 0);
  /* a column that depends on the others to round-off is no better than one that does so exactly */
  for (PetscInt j = 0; j < k; j++)
    *deficient = (PetscBool)(*deficient || PetscAbsReal(Ap[j * m + j]) < 1e-12 * PetscAbsReal(Ap[0]));
  PetscCall(PetscArraycpy(z, y, k));
  PetscCall(PetscFree3(Ap, y, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = b - A x and the gradient w = A^T r. */
static void Gradient(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const PetscReal x[],
                     PetscReal r[], PetscReal w[])
{
  for (PetscInt i = 0; i < m; i++) r[i] = b[i];
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; x[j] != 0 && i < m; i++) r[i] -= A[j * m + i] * x[j];
  }
  for (PetscInt j = 0; j < n; j++) {
    w[j] = 0;
    for (PetscInt i = 0; i < m; i++) w[j] += A[j * m + i] * r[i];
  }
}

/* Moves from x towards z (on the passive set p) until an entry meets 0, which leaves the set; true when z itself is
 * reached. */
static PetscBool MoveTowards(PetscInt *k, PetscInt p[], const PetscReal z[], PetscReal x[], PetscBool passive[])
{
  PetscReal alpha = 1;
  PetscInt left = 0, blocking = -1;

  for (PetscInt j = 0; j < *k; j++) {
    const PetscReal step = z[j] < 0 ? x[p[j]] / (x[p[j]] - z[j]) : 0; /* z = 0: it is there already */

    if (z[j] <= 0 && (blocking < 0 || step < alpha)) {
      alpha = step;
      blocking = j;
    }
  }
  for (PetscInt j = 0; j < *k; j++) x[p[j]] += alpha * (z[j] - x[p[j]]);
  if (blocking < 0) return PETSC_TRUE;
  for (PetscInt j = 0; j < *k; j++) {
    if (j == blocking || x[p[j]] <= 0) {
      x[p[j]] = 0;
      passive[p[j]] = PETSC_FALSE;
    } else
      p[left++] = p[j];
  }
  *k = left;
  return PETSC_FALSE;
}

PetscErrorCode HycoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], PetscReal x[],
                        PetscReal *residual)
{
  PetscReal *r, *w, *z, tol = 0;
  PetscInt *p, k = 0;
  PetscBool *passive, *banned;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m, &r, n, &w, n, &z));
  PetscCall(PetscCalloc3(n, &p, n, &passive, n, &banned));
  PetscCall(PetscArrayzero(x, n));
  Gradient(m, n, A, b, x, r, w);
  for (PetscInt j = 0; j < n; j++) tol = PetscMax(tol, 1e-12 * PetscAbsReal(w[j]));
  for (PetscInt it = 0; it < 3 * n + 10; it++) {
    PetscInt best = -1;
    PetscBool deficient;

    for (PetscInt j = 0; j < n; j++) {
      if (!passive[j] && !banned[j] && w[j] > tol && (best < 0 || w[j] > w[best])) best = j;
    }
    if (best < 0 || k >= m) break;
    passive[best] = PETSC_TRUE;
    p[k++] = best;
    PetscCall(LeastSquares(m, A, b, k, p, z, &deficient));
    if (deficient || z[k - 1] <= 0) { /* no way down along this column */
      passive[best] = PETSC_FALSE;
      banned[best] = PETSC_TRUE;
      k--;
      continue;
    }
    while (!MoveTowards(&k, p, z, x, passive)) PetscCall(LeastSquares(m, A, b, k, p, z, &deficient));
    PetscCall(PetscArrayzero(banned, n));
    Gradient(m, n, A, b, x, r, w);
  }
  Gradient(m, n, A, b, x, r, w);
  if (residual) {
    *residual = 0;
    for (PetscInt i = 0; i < m; i++) *residual += r[i] * r[i];
    *residual = PetscSqrtReal(*residual);
  }
  PetscCall(PetscFree3(r, w, z));
  PetscCall(PetscFree3(p, passive, banned));
  PetscFunctionReturn(PETSC_SUCCESS);
}
