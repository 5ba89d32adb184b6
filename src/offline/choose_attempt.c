/*
  Which settings of a search are chosen, and which can no longer be chosen. `ratio` is the largest quotient of an error
  and its target; for an attempt that was dropped, a lower bound of it. The choice is the cheapest attempt whose ratio
  is at most max(1, WORTH_FASTER times the least ratio), but does not miss a limit if another does not. This bound only
  decreases with further attempts: settings that exceed it are excluded for good. So are settings whose ratio exceeds 1
  and the ratio of settings that are not more expensive: if those are excluded, so are these; and settings that cost no
  less than others that meet the targets, whatever their errors, which are then not computed.
*/
#include <hycoreducerimpl.h>

/* Factor of the best ratio up to which a cheaper model is taken: a quarter more of the error is little beside the
   factors between settings. */
#define WORTH_FASTER 1.25
/* Factor up to which ratios are equal: errors of solves with a residual of 1e-8 may be in another order on other
   numbers of ranks. */
#define TIED_RATIO (1 + 1e-6)

/* Whether it gave a model that was judged at all held-out points, or as far as necessary: a path that does not reach
   its end has the worst ratio. */
static PetscBool AttemptComplete(const HycoAttempt *a)
{
  return (PetscBool)(!a->failure[0] && !a->beaten_by);
}

/* The largest ratio that may be chosen (above): max(1, WORTH_FASTER times the least), but below HYCO_MISSES if the best
   is. */
static PetscReal AttemptBound(PetscInt n, const HycoAttempt attempt[], const HycoAttempt **best)
{
  *best = NULL;
  for (PetscInt k = 0; k < n; k++) {
    if (AttemptComplete(&attempt[k]) && (!*best || attempt[k].ratio < (*best)->ratio)) *best = &attempt[k];
  }
  if (!*best) return PETSC_INFINITY;
  return (*best)->ratio <= HYCO_MISSES ? PetscMin(HYCO_MISSES, PetscMax(1, WORTH_FASTER * (*best)->ratio))
                                       : WORTH_FASTER * (*best)->ratio;
}

/* Continuous and increasing: 1 at the target, HYCO_MISSES at the limit, so that one number orders errors with and
   without limits. Without a limit it stays below HYCO_MISSES. */
PetscReal HycoAttemptsQuotient(PetscReal target, PetscReal limit, PetscReal error)
{
  const PetscReal q = error / target, most = limit / target;

  if (q <= 1) return q;
  if (!(limit > 0)) return 1 + (HYCO_MISSES - 1) * (1 - 1 / q);
  return q <= most ? 1 + (HYCO_MISSES - 1) * (q - 1) / (most - 1) : HYCO_MISSES * q / most;
}

/* Of equal costs the first: attempts come in the order of their kinds. */
HycoAttempt *HycoAttemptsChoose(PetscInt n, HycoAttempt attempt[])
{
  HycoAttempt *chosen = NULL;
  const HycoAttempt *best;
  const PetscReal bound = AttemptBound(n, attempt, &best);

  for (PetscInt k = 0; k < n; k++) {
    if (!AttemptComplete(&attempt[k]) || attempt[k].ratio > bound) continue;
    if (!chosen || attempt[k].cost < chosen->cost) chosen = &attempt[k];
  }
  return chosen;
}

/* The ratio above which an attempt of this cost cannot be chosen any more: its held-out paths are then not predicted to
   the end. */
PetscReal HycoAttemptsLimit(PetscInt n, const HycoAttempt attempt[], PetscReal cost, PetscInt *beaten)
{
  const HycoAttempt *by;
  PetscReal limit = AttemptBound(n, attempt, &by);

  for (PetscInt k = 0; k < n; k++) {
    /* Below 1 all are equal: an attempt that meets the targets excludes dearer ones by its cost (MetFor()). */
    const PetscReal ratio = PetscMax(1, attempt[k].ratio);

    if (!AttemptComplete(&attempt[k]) || attempt[k].cost > cost || ratio >= limit) continue;
    limit = ratio;
    by = &attempt[k];
  }
  *beaten = by && limit < PETSC_INFINITY ? by->number : 0;
  return limit * TIED_RATIO;
}

/* Whether an attempt that is not more expensive meets the targets. */
static PetscBool IsMet(PetscInt n, const HycoAttempt attempt[], PetscReal cost)
{
  for (PetscInt k = 0; k < n; k++) {
    if (AttemptComplete(&attempt[k]) && attempt[k].ratio <= 1 && attempt[k].cost <= cost) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* An attempt was dropped for one that was refused later (scan, own training solutions): nothing excludes it any
   more. Each is reopened once. */
HycoAttempt *HycoAttemptsReopen(PetscInt n, HycoAttempt attempt[])
{
  PetscInt beaten;

  for (PetscInt k = 0; k < n; k++) {
    HycoAttempt *a = &attempt[k];

    /* In the order of the attempts, which is the order of their cost. */
    if (a->beaten_by && !a->reopened && !IsMet(n, attempt, a->cost) &&
        !(a->ratio > HycoAttemptsLimit(n, attempt, a->cost, &beaten)))
      return a;
  }
  return NULL;
}
