/*
  Which recipe of a search is taken, and which cannot be any more. `ratio` is the largest quotient of an error and its
  target, of an attempt that was dropped a lower bound of it. Taken is the cheapest of those whose ratio is at most
  max(1, LITTLE times the least ratio). That bound only falls as attempts come: what exceeds it stays out. So does what
  exceeds 1 and the ratio of a recipe that is no dearer: where that one is out, it is out too.
*/
#include <hycoreducerimpl.h>

#define LITTLE 1.25       /* a model that misses by so much more than the best is as good, if it is cheaper */
#define TIE    (1 + 1e-6) /* closer ratios may be in either order, on other numbers of ranks */

/* It gave a model that was judged at all held-out points, or as far as it matters: a path without its end is the worst.
 */
static PetscBool Complete(const HycoAttempt *a)
{
  return (PetscBool)(!a->failure[0] && !a->beaten_by);
}

static PetscReal Bound(PetscInt n, const HycoAttempt attempt[], const HycoAttempt **best)
{
  *best = NULL;
  for (PetscInt k = 0; k < n; k++) {
    if (Complete(&attempt[k]) && (!*best || attempt[k].ratio < (*best)->ratio)) *best = &attempt[k];
  }
  return *best ? PetscMax(1, LITTLE * (*best)->ratio) : PETSC_INFINITY;
}

HycoAttempt *HycoAttemptsChoose(PetscInt n, HycoAttempt attempt[])
{
  HycoAttempt *chosen = NULL;
  const HycoAttempt *best;
  const PetscReal bound = Bound(n, attempt, &best);

  for (PetscInt k = 0; k < n; k++) {
    if (!Complete(&attempt[k]) || attempt[k].ratio > bound) continue;
    if (!chosen || attempt[k].cost < chosen->cost) chosen = &attempt[k];
  }
  return chosen;
}

PetscReal HycoAttemptsLimit(PetscInt n, const HycoAttempt attempt[], PetscReal cost, PetscInt *beaten)
{
  const HycoAttempt *by;
  PetscReal limit = Bound(n, attempt, &by);

  for (PetscInt k = 0; k < n; k++) {
    const PetscReal ratio = PetscMax(1, attempt[k].ratio);

    if (!Complete(&attempt[k]) || attempt[k].cost > cost || ratio >= limit) continue;
    limit = ratio;
    by = &attempt[k];
  }
  *beaten = by && limit < PETSC_INFINITY ? by->number : 0;
  return limit * TIE;
}

HycoAttempt *HycoAttemptsReopen(PetscInt n, HycoAttempt attempt[])
{
  PetscInt beaten;

  for (PetscInt k = 0; k < n; k++) {
    HycoAttempt *a = &attempt[k];

    if (a->beaten_by && !a->reopened && !(a->ratio > HycoAttemptsLimit(n, attempt, a->cost, &beaten))) return a;
  }
  return NULL;
}
