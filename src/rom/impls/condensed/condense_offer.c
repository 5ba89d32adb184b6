/* Whether a search tries a condensed model: what its training costs, from the sizes of the scene. */
#include <hycocondensed.h>

#define MOST_BYTES 2e9
#define RESPONSES  200 /* of a path: assumed number beside those to the contacts */
#define ACTIVE     0.5 /* assumed share of active contacts in a sample of the forces, */
#define EXCHANGES  1   /* and number of sets whose factors cost as much as its own */

/* The stiffnesses at which there is a flexibility: one for a path. */
static PetscInt Stiffnesses(HycoReducer t)
{
  PetscInt n = 1;

  if (!t->scene->n_times) (void)!HycoReducerCountStiffnesses(t, t->samples, PETSC_FALSE, &n);
  return n;
}

PetscReal HycoCondensedWork(HycoReducer t)
{
  const PetscReal m = t->sizes[2], active = ACTIVE * m, dofs = (PetscReal)t->sizes[0] * t->sizes[3];
  const PetscReal factor = HycoReducerFactorWork(t), solve = HycoReducerSolveWork(t);

  if (!t->scene->n_times) {
    return (PetscReal)Stiffnesses(t) * (2 * factor + m * solve) +
           (PetscReal)HycoCondensedSamples((PetscInt)m) * EXCHANGES * active * active * active / 3;
  } else {
    const PetscReal n = m + RESPONSES;
    PetscInt held = 0;

    if (t->held) (void)!HycoSamplesGet(t->held, &held, NULL, NULL);
    return factor + n * solve + 4 * dofs * n * n +
           (PetscReal)held * HycoReducerSolvesOf(t) * PetscMin(n * n * n * 2 / 3, 4e5 * n);
  }
}

/* The columns of its POD are in memory; its flexibilities too. */
PetscBool HycoCondensedOffers(HycoReducer t, PetscBool targets, size_t length, char why[])
{
  const PetscReal m = t->sizes[2], dofs = (PetscReal)t->sizes[0] * t->sizes[3];
  const PetscReal bytes =
      t->scene->n_times ? 16 * dofs * (m + RESPONSES) : 8 * m * m * (2 + (PetscReal)Stiffnesses(t) / 2);

  (void)targets;
  if (!(m > 0)) return PETSC_FALSE;
  if (t->pod_memory > 0)
    snprintf(why, length,
             "its columns are not read in batches, and -hyco_pod_memory is given; name the type to train it");
  else if (bytes > MOST_BYTES)
    snprintf(why, length,
             "its %d contacts would take %.2g GB, and the search leaves out models above %g GB; name the type to train "
             "it",
             (int)m, 1e-9 * (double)bytes, 1e-9 * MOST_BYTES);
  else
    return PETSC_TRUE;
  return PETSC_FALSE;
}
