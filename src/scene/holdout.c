/* HycoSamples: what is held out to judge by, and what is kept to learn from. */
#include <hycosceneimpl.h>

/* The distinct values of parameter p, ascending. */
static PetscErrorCode Distinct(PetscInt n, PetscInt n_par, const PetscReal mu[], PetscInt p, PetscInt *count,
                               PetscReal value[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) value[k] = mu[k * n_par + p];
  PetscCall(PetscSortReal(n, value));
  *count = n > 0;
  for (PetscInt k = 1; k < n; k++) {
    if (value[k] > value[*count - 1]) value[(*count)++] = value[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* number[k]: which value of the parameter that splits the set point k has; k itself where none does. */
static PetscErrorCode Number(PetscInt n, PetscInt n_par, const PetscReal mu[], PetscInt number[])
{
  PetscReal *value;
  PetscInt count, fewest = n / 2 + 1, by = -1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &value));
  for (PetscInt p = 0; p < n_par; p++) {
    PetscCall(Distinct(n, n_par, mu, p, &count, value));
    if (count < 3 || count >= fewest) continue;
    fewest = count;
    by = p;
  }
  if (by >= 0) PetscCall(Distinct(n, n_par, mu, by, &count, value));
  for (PetscInt k = 0; k < n; k++) {
    number[k] = k;
    if (by < 0) continue;
    for (number[k] = 0; value[number[k]] < mu[k * n_par + by];) number[k]++;
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSamplesHoldOut(HycoSamples samples, PetscInt every, PetscInt offset, HycoSamples *kept,
                                  HycoSamples *held)
{
  PetscInt n, n_par, *number;
  const PetscReal *mu;
  HycoScene scene;

  PetscFunctionBegin;
  HycoCheck(every > 1 && offset >= 0 && offset < every, "HycoSamplesHoldOut: every %d-th from %d on leaves nothing",
            (int)every, (int)offset);
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(HycoSamplesGetScene(samples, &scene));
  PetscCall(HycoSamplesCreate(scene, kept));
  PetscCall(HycoSamplesCreate(scene, held));
  PetscCall(PetscMalloc1(n, &number));
  PetscCall(Number(n, n_par, mu, number));
  for (PetscInt k = 0; k < n; k++)
    PetscCall(HycoSamplesAddPoint(number[k] % every == offset ? *held : *kept, mu + k * n_par));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}
