/*
  Operations of a search beside those of the full-order solutions. They are counted from the sizes of the scene, not
  measured, so that a search ends at the same attempt on any machine and number of ranks. Factors and solves are those
  of a nested dissection (George, SIAM J. Numer. Anal. 10 (1973) 345-363), in d unknowns per node; constants are orders
  of magnitude.
*/
#include <hycoreducerimpl.h>

#define FREE_WORK  5e10 /* operations that take seconds: a search with no more is not limited */
#define LAW        20   /* operations for an entry of a cell's stiffness or tangent */
#define SUBSTEPS   2    /* time steps of a path for each listed time, */
#define ITERATIONS 2    /* and iterations of a step */

/* A nested dissection's orders: n in 1D, n^(3/2) in 2D, n^2 in 3D, n the nodes. */
PetscReal HycoReducerFactorWork(HycoReducer t)
{
  const PetscReal n = t->sizes[0];

  if (t->sizes[3] == 1) return 10 * n;
  return t->sizes[3] == 2 ? 80 * n * PetscSqrtReal(n) : 500 * n * n;
}

/* Its fill: n log n in 2D, n^(4/3) in 3D. */
PetscReal HycoReducerSolveWork(HycoReducer t)
{
  const PetscReal n = t->sizes[0];

  if (t->sizes[3] == 1) return 10 * n;
  return t->sizes[3] == 2 ? 120 * n * PetscLog2Real(n + 1) : 180 * n * PetscPowReal(n, 1. / 3);
}

/* Operations are counted, not timed, so that a search takes the same way on every machine; a path counts as so
   many solves. */
PetscReal HycoReducerSolvesOf(HycoReducer t)
{
  return t->scene->n_times ? (PetscReal)t->scene->n_times * SUBSTEPS * ITERATIONS : 1;
}

/* Whether two points have the same stiffness. */
static PetscBool SearchWorkIsSameStiffness(HycoScene s, const PetscBool reaches[], const PetscReal a[],
                                           const PetscReal b[])
{
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    if (reaches[p] && a[p] != b[p]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Factors, not solves, are what full order costs. */
PetscErrorCode HycoReducerCountStiffnesses(HycoReducer t, HycoSamples samples, PetscBool in_order, PetscInt *count)
{
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  const PetscReal *mu;
  PetscInt n, n_par;

  PetscFunctionBegin;
  HycoSceneReaches(t->scene, reaches);
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  *count = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscBool seen = PETSC_FALSE;

    /* In order a factor is kept only from the point before; otherwise points are grouped by stiffness. */
    for (PetscInt j = in_order ? PetscMax(k - 1, 0) : 0; j < k && !seen; j++)
      seen = SearchWorkIsSameStiffness(t->scene, reaches, mu + j * n_par, mu + k * n_par);
    *count += !seen;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The measure of the search's budget: what the solutions cost by the same estimate as the attempts. */
PetscErrorCode HycoReducerSolutionsWork(HycoReducer t, PetscReal *work)
{
  const PetscReal dim = t->sizes[3],
                  cell = dim == 1   ? 2
                         : dim == 2 ? 8
                                    : 24,
                  assembly = LAW * (PetscReal)t->sizes[1] * cell * cell;
  HycoSamples sets[2] = {t->samples, t->held};

  PetscFunctionBegin;
  *work = 0;
  for (int k = 0; k < 2 && sets[k]; k++) { /* there may be no held-out points */
    PetscInt n, factors;

    PetscCall(HycoSamplesGet(sets[k], &n, NULL, NULL));
    PetscCall(HycoReducerCountStiffnesses(t, sets[k], PETSC_FALSE, &factors));
    /* Tangents change along each path, whatever its stiffness. */
    if (t->scene->n_times) factors = n;
    *work += HycoReducerSolvesOf(t) * ((PetscReal)factors * (HycoReducerFactorWork(t) + assembly) +
                                       (PetscReal)n * HycoReducerSolveWork(t) * (1 + (PetscReal)t->sizes[2] / 4));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A search may cost as much as the solutions it works on: without a limit the last, largest RIDs would take most
   of a training. */
PetscErrorCode HycoReducerSearchBudget(HycoReducer t, PetscReal *operations)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerSolutionsWork(t, operations));
  *operations = t->exhaustive ? PETSC_INFINITY : PetscMax(FREE_WORK, *operations) * t->search_budget;
  PetscFunctionReturn(PETSC_SUCCESS);
}
