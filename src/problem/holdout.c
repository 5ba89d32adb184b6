/*
  HycoSamples: unseen points by which a model is judged. They are distributed over the region covered by a set of
  training points, by an additive recurrence: coordinate j of point k is the fractional part of 1/2 + k phi^-(j+1), with
  phi the root of phi^(d+1) = phi + 1 (M. Roberts' generalisation of the golden ratio to d dimensions). Every part of
  the sequence is evenly distributed, and it can be continued.
*/
#include <hycosceneimpl.h>

PetscErrorCode HycoSamplesReach(HycoScene s, PetscInt n, const PetscReal mu[], PetscReal lo[], PetscReal hi[])
{
  const PetscInt n_par = s->n_parameters;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &value));
  for (PetscInt p = 0; p < n_par; p++) {
    PetscReal step = 0;

    for (PetscInt k = 0; k < n; k++) value[k] = mu[k * n_par + p];
    PetscCall(PetscSortReal(n, value));
    for (PetscInt k = 1; k < n; k++) step = PetscMax(step, value[k] - value[k - 1]);
    step = 0.5 * step * (1 + 1e-9);
    lo[p] = n ? PetscMax(s->lo[p], value[0] - step) : s->lo[p];
    hi[p] = n ? PetscMin(s->hi[p], value[n - 1] + step) : s->hi[p];
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The root of x^(dim + 1) = x + 1 that is greater than 1. */
static PetscReal Ratio(PetscInt dim)
{
  PetscReal x = 2;

  for (PetscInt k = 0; k < 60; k++) x = PetscPowReal(1 + x, 1 / (PetscReal)(dim + 1));
  return x;
}

/* Coordinate j of point k, in dim dimensions. */
static PetscReal Coordinate(PetscInt dim, PetscInt j, PetscInt k)
{
  const PetscReal x = 0.5 + (PetscReal)k * PetscPowReal(Ratio(dim), -(PetscReal)(j + 1));

  return x - PetscFloorReal(x);
}

static PetscErrorCode Has(PetscInt n, PetscInt n_par, const PetscReal mu[], const PetscReal point[], PetscBool *has)
{
  PetscFunctionBegin;
  *has = PETSC_FALSE;
  for (PetscInt k = 0; k < n && !*has; k++) PetscCall(PetscArraycmp(mu + k * n_par, point, n_par, has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSamplesUnseen(HycoSamples samples, PetscInt first, PetscInt count, PetscInt together,
                                 const PetscBool slow[], HycoSamples *unseen)
{
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS], point[HYCO_MAX_PARAMETERS];
  PetscInt n, n_par, n_slow = 0;
  const PetscReal *mu;
  HycoScene scene;
  PetscBool seen;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(HycoSamplesGetScene(samples, &scene));
  PetscCall(HycoSamplesReach(scene, n, mu, lo, hi));
  PetscCall(HycoSamplesCreate(scene, unseen));
  for (PetscInt p = 0; p < n_par; p++) n_slow += slow && slow[p];
  if (!n_slow || n_slow == n_par) together = 1;
  for (PetscInt k = first; n_par && k < first + count; k++) {
    for (PetscInt p = 0; p < n_par; p++)
      point[p] = lo[p] + (hi[p] - lo[p]) * Coordinate(n_par, p, 1 + (slow && slow[p] ? k / together : k));
    PetscCall(Has(n, n_par, mu, point, &seen));
    if (!seen) PetscCall(HycoSamplesAddPoint(*unseen, point));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSamplesExcept(HycoSamples samples, HycoSamples seen, HycoSamples *rest)
{
  PetscInt n, m, n_par;
  const PetscReal *mu, *other;
  HycoScene scene;
  PetscBool twin;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(HycoSamplesGet(seen, &m, NULL, &other));
  PetscCall(HycoSamplesGetScene(samples, &scene));
  PetscCall(HycoSamplesCreate(scene, rest));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(Has(m, n_par, other, mu + k * n_par, &twin));
    if (!twin) PetscCall(HycoSamplesAddPoint(*rest, mu + k * n_par));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
