/*
  The active set for dense linear complementarity, w = q + M z >= 0, z >= 0, w.z = 0: the paper's section 6.2
  (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865-888, for its convergence).
*/
#include <hycolcp.h>

unsigned long long HycoSetHash(PetscInt n, const PetscBool active[])
{
  unsigned long long hash = HYCO_HASH_START;

  for (PetscInt i = 0; i < n; i++) {
    const unsigned char bit = active[i] ? 1 : 0;

    hash = HycoHash(hash, &bit, 1);
  }
  return hash;
}

/* w = q + M z of the contacts that are not active (if symmetric, else of all), and the size against which its zeros are
   round-off. */
static PetscReal Slack(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                       const PetscBool active[], PetscInt k, const PetscInt a[], const PetscReal z[], PetscReal w[])
{
  PetscReal size = 0;

  for (PetscInt i = 0; i < n; i++) {
    w[i] = q[i];
    size = PetscMax(size, PetscAbsReal(q[i]));
  }
  if (symmetric && k > n - k) { /* few rows, which are columns */
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal *row = M + (size_t)i * (size_t)n;

      for (PetscInt j = 0; j < n && !active[i]; j++) w[i] += row[j] * z[j];
    }
    return size;
  }
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal *column = M + (size_t)a[j] * (size_t)n;

    for (PetscInt i = 0; i < n; i++) w[i] += column[i] * z[a[j]];
  }
  return size;
}

/* Changes the contacts that violate. A contact set aside as dependent counts only beyond what dependence leaves over.
 */
static PetscInt Flip(PetscInt n, PetscReal size_w, const PetscReal z[], const PetscReal w[], const PetscBool aside[],
                     PetscBool active[])
{
  PetscInt changes = 0;
  PetscReal size_z = 0;

  for (PetscInt i = 0; i < n; i++) size_z = PetscMax(size_z, PetscAbsReal(z[i]));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal tol = aside[i] ? 1e-9 : 1e-13;
    const PetscBool flip = (PetscBool)(active[i] ? z[i] < -tol * size_z : w[i] < -tol * size_w);

    if (flip) active[i] = (PetscBool)!active[i];
    changes += flip;
  }
  return changes;
}

/* Contacts active but not in a[0..k): dependent on those, they are set aside and carry no force. */
static PetscInt SetAside(PetscInt n, PetscInt k, const PetscInt a[], PetscBool active[], PetscBool aside[])
{
  PetscInt count = 0;

  for (PetscInt i = 0; i < n; i++) aside[i] = active[i];
  for (PetscInt j = 0; j < k; j++) aside[a[j]] = PETSC_FALSE;
  for (PetscInt i = 0; i < n; i++) {
    if (aside[i]) active[i] = PETSC_FALSE;
    count += aside[i];
  }
  return count;
}

/* Whether the set was met before; remembers it. */
static PetscBool Met(PetscInt n, const PetscBool active[], PetscInt its, unsigned long long past[])
{
  past[its] = HycoSetHash(n, active);
  for (PetscInt t = 0; t < its; t++) {
    if (past[t] == past[its]) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode HycoLCPActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                HycoSetFactor factor, PetscInt max_its, HycoLCPMonitor monitor, void *ctx,
                                PetscBool active[], PetscReal z[], PetscInt *its, HycoLCPStatus *status)
{
  PetscInt *a, changes = 1, n_aside = 0;
  PetscReal *w, size;
  PetscBool *aside;
  unsigned long long *past;

  PetscFunctionBegin;
  *status = HYCO_LCP_LIMIT;
  PetscCall(PetscMalloc4(n, &a, n, &w, n, &aside, max_its + 1, &past));
  for (*its = 0; *its < max_its && changes;) {
    PetscInt k = 0;
    PetscBool singular;

    if (Met(n, active, *its, past)) { /* with dependent contacts: their gaps contradict each other */
      *status = n_aside ? HYCO_LCP_SINGULAR : HYCO_LCP_CYCLE;
      break;
    }
    for (PetscInt i = 0; i < n; i++) {
      if (active[i]) a[k++] = i;
    }
    (*its)++;
    PetscCall(HycoLCPSolveOnSet(n, M, q, symmetric, factor, &k, a, z, &singular));
    if (singular) {
      *status = HYCO_LCP_SINGULAR;
      break;
    }
    n_aside = SetAside(n, k, a, active, aside);
    size = Slack(n, M, q, symmetric, active, k, a, z, w);
    changes = Flip(n, size, z, w, aside, active);
    if (monitor) PetscCall(monitor(*its, k, changes, ctx));
    if (!changes) *status = HYCO_LCP_SOLVED;
  }
  PetscCall(PetscFree4(a, w, aside, past));
  PetscFunctionReturn(PETSC_SUCCESS);
}
