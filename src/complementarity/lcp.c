/* The active set method for dense linear complementarity, w = q + M z >= 0, z >= 0, w.z = 0. */
#include <hycolcp.h>

/* Data of the iterations. */
typedef struct {
  const HycoLCP *lcp;
  PetscReal *z, *w;
  PetscInt k, *a, n_aside; /* the set; number of contacts removed as dependent */
  PetscBool *aside;
} Dense;

/* Computes w = q + M z for the contacts that are not active (all if M is not symmetric); returns the size relative
   to which its zeros are round-off. Of a symmetric M the fewer rows are read. */
static PetscReal LCPSlack(const Dense *d, const PetscBool active[])
{
  const PetscInt n = d->lcp->n;
  const PetscReal *M = d->lcp->M, *q = d->lcp->q;
  PetscReal size = 0;

  for (PetscInt i = 0; i < n; i++) {
    d->w[i] = q[i];
    size = PetscMax(size, PetscAbsReal(q[i]));
  }
  /* Only the slacks of open contacts count: with most contacts closed, their few rows cost less than the set's
     columns. */
  if (d->lcp->symmetric && d->k > n - d->k) { /* few rows, read as columns of the symmetric M */
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal *row = M + (size_t)i * (size_t)n;

      for (PetscInt j = 0; j < n && !active[i]; j++) d->w[i] += row[j] * d->z[j];
    }
    return size;
  }
  for (PetscInt j = 0; j < d->k; j++) {
    const PetscReal *column = M + (size_t)d->a[j] * (size_t)n;

    for (PetscInt i = 0; i < n; i++) d->w[i] += column[i] * d->z[d->a[j]];
  }
  return size;
}

/* A dependent contact violates only if it does so by more than the tolerance of the dependence. */
static PetscErrorCode LCPViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Dense *d = (const Dense *)ctx;
  const PetscReal size_w = LCPSlack(d, active);
  PetscReal size_z = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < d->lcp->n; i++) size_z = PetscMax(size_z, PetscAbsReal(d->z[i]));
  for (PetscInt i = 0; i < d->lcp->n; i++) {
    /* 1e-9 is far above the pivots that count as dependent (1e-12): a contact that was set aside would otherwise
       come back for round-off, and cycle. */
    const PetscReal tol = d->aside[i] ? 1e-9 : 1e-13;

    violates[i] = (PetscBool)(active[i] ? d->z[i] < -tol * size_z : d->w[i] < -tol * size_w);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contacts that depend on others of the set are removed from it, and carry no force. The callback of the active set's
   loop. */
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  Dense *d = (Dense *)ctx;
  const HycoLCP *lcp = d->lcp;

  PetscFunctionBegin;
  d->k = d->n_aside = 0;
  for (PetscInt i = 0; i < lcp->n; i++) {
    if (active[i]) d->a[d->k++] = i;
  }
  PetscCall(HycoLCPSolveOnSet(lcp->n, lcp->M, lcp->q, lcp->symmetric, lcp->factor, &d->k, d->a, d->z, singular));
  if (*singular) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < lcp->n; i++) d->aside[i] = active[i];
  for (PetscInt j = 0; j < d->k; j++) d->aside[d->a[j]] = PETSC_FALSE;
  for (PetscInt i = 0; i < lcp->n; i++) {
    /* Open for the loop, so that its gap is watched: it must be closed by the others. */
    if (d->aside[i]) active[i] = PETSC_FALSE;
    d->n_aside += d->aside[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Dense primal-dual active set from `active`, which is also the result; z: n (with p pinned unknowns p + n). On one
   process, or alike on every rank. Primal-dual active set (Hintermueller, Ito and Kunisch 2003): a Newton method whose
   iterates are sets, so that it ends with the exact solution or cycles. */
PetscErrorCode HycoLCPActiveSet(const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status)
{
  Dense d = {lcp, z, NULL, 0, NULL, 0, NULL};
  HycoActiveSet e = {.comm = MPI_COMM_NULL,
                     .n = lcp->n,
                     .max_its = lcp->max_its ? lcp->max_its : 50 + 4 * lcp->n,
                     .ctx = &d,
                     .solve = SolveOnSet,
                     .violations = LCPViolations,
                     .monitor = lcp->monitor,
                     .monitor_ctx = lcp->monitor_ctx};

  PetscFunctionBegin;
  /* Pinned unknowns without bounds: the matrix is semidefinite, and another loop is used. */
  if (lcp->p) {
    PetscCall(HycoLCPSemidefinite(lcp, active, z, its, status));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc3(lcp->n, &d.w, lcp->n, &d.a, lcp->n, &d.aside));
  PetscCall(HycoActiveSetRun(&e, active, its, status));
  if (*status == HYCO_LCP_CYCLE && d.n_aside)
    *status = HYCO_LCP_SINGULAR; /* dependent contacts with contradictory gaps */
  PetscCall(PetscFree3(d.w, d.a, d.aside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoMotionReach(PetscInt N, PetscInt p, const PetscReal M[], PetscInt i)
{
  PetscReal most = 0;

  for (PetscInt j = p; j < N; j++) most = PetscMax(most, PetscAbsReal(M[(size_t)i * (size_t)N + (size_t)j]));
  return most;
}

/* Else a body would be moved by as much as it takes to open a contact to which the motion is tangential. */
void HycoMotionsRound(PetscInt p, PetscInt n, const PetscReal reach[], PetscReal M[])
{
  const size_t size = (size_t)(p + n);

  for (size_t i = 0; i < (size_t)p; i++) {
    for (size_t j = (size_t)p; j < size; j++) {
      if (PetscAbsReal(M[i * size + j]) <= HYCO_TANGENTIAL * reach[i]) M[i * size + j] = M[j * size + i] = 0;
    }
  }
}
