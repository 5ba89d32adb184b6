/*
  Choice of the condensed model's training points: Leja points of each range, which interpolate about as well as
  Chebyshev points and are nested, so that every solution is reused. The parameter whose left-out values cause the
  largest error of the forces gets another value until the sum over the parameters is below the target, or until its
  error decreases so slowly that the target cannot be reached within the limit: polynomials converge geometrically if
  the dependence is smooth, and algebraically if it has a kink. The modes are computed for the final points.
*/
#include <hycocondensed.h>

/* If everything is affine in a parameter, two values are exact; the modes need solutions in between, of all such
   parameters together no more than AFFINE_POINTS. */
#define AFFINE_VALUES 5
#define AFFINE_POINTS 32
#define FIRST_VALUES  3
#define LEJA_GRID     2000
#define TIE           1e-6 /* relative: among nearly equal errors the first parameter is refined */

#define LOOK_BACK                                                                                                      \
  4                /* number of values over which the decrease of an error is measured, with at least twice as         \
                      many */
#define SLOW   0.7 /* ratio per value above which the dependence is not smooth */
#define BEYOND 1.5 /* multiple of the largest number of values that the present decrease would require */

/* n Leja points of [lo, hi]: the ends, then each point maximises the product of the distances to the previous ones. */
static void LejaPoints(PetscInt n, PetscReal lo, PetscReal hi, PetscReal x[])
{
  for (PetscInt k = 0; k < n; k++) {
    PetscReal best = -1;

    x[k] = k ? hi : lo;
    for (PetscInt g = 0; k > 1 && g <= LEJA_GRID; g++) {
      const PetscReal at = lo + (hi - lo) * (PetscReal)g / LEJA_GRID;
      PetscReal product = 1;

      for (PetscInt j = 0; j < k; j++) product *= 4 * PetscAbsReal(at - x[j]) / (hi - lo);
      if (product <= best * (1 + 1e-9)) continue;
      best = product;
      x[k] = at;
    }
  }
}

static PetscErrorCode MakeSamples(HycoScene s, const PetscInt counts[], HycoSamples *samples)
{
  PetscReal *x[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(s, samples));
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    PetscCall(PetscMalloc1(counts[p], &x[p]));
    LejaPoints(counts[p], s->lo[p], s->hi[p], x[p]);
  }
  PetscCall(HycoSamplesAddProduct(*samples, counts, (const PetscReal *const *)x));
  for (PetscInt p = 0; p < s->n_parameters; p++) PetscCall(PetscFree(x[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes another set of points on the same mesh. */
static PetscErrorCode TakeSamples(HycoReducer t, const PetscInt counts[], HycoSamples *samples)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerResetBases(t));
  PetscCall(HycoSamplesDestroy(samples));
  PetscCall(MakeSamples(t->scene, counts, samples));
  t->samples = *samples;
  PetscCall(HycoReducerSetColumns(t, *samples));
  PetscCall(HycoCondensedBegin(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes solutions, flexibilities and the errors of leaving values out, by parameter. */
static PetscErrorCode Estimate(HycoReducer t, HycoSnapshots store)
{
  HycoCondensed c = Condensing(t)->condensed;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsFill(store, t->samples, t->progress, t->progress_ctx));
  PetscCall(HycoReducerReduce(t, store, PETSC_FALSE));
  PetscCall(HycoReducerFetchContacts(t));
  PetscCall(HycoCondensedFlexibilities(t, store));
  HycoOnRoot(HycoComm(t), HycoCondensedFillFields(t, PETSC_FALSE));
  HycoOnRoot(HycoComm(t), HycoCondensedLeaveOut(t));
  PetscCallMPI(MPI_Bcast(c->by_parameter, HYCO_MAX_PARAMETERS, MPIU_REAL, 0, HycoComm(t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameter to refine; -1: the target is met, or (*met is false) none may have more values. */
static PetscInt Choose(HycoReducer t, PetscBool *met)
{
  HycoCondensed c = Condensing(t)->condensed;
  PetscReal sum = 0;
  PetscInt worst = -1;

  for (PetscInt p = 0; p < c->dim; p++) {
    sum += c->by_parameter[p];
    if (c->n[p] >= Condensing(t)->max_values || c->affine[p] || c->n[p] == 1) continue;
    if (worst < 0 || c->by_parameter[p] > (1 + TIE) * c->by_parameter[worst]) worst = p;
  }
  *met = (PetscBool)(sum <= Condensing(t)->tol);
  return *met ? -1 : worst;
}

/* The errors of the parameters by number of values. */
typedef struct {
  PetscInt most;
  PetscReal *error; /* dim x (most + 1) */
} History;

/* Whether more values of p are useless: with the decrease of its error so far the target cannot be reached. */
static PetscBool IsHopeless(HycoReducer t, const History *h, PetscInt p)
{
  HycoCondensed c = Condensing(t)->condensed;
  const PetscInt n = c->n[p];
  const PetscReal *e = h->error + p * (h->most + 1);
  PetscReal best = e[n], before = e[n - LOOK_BACK > 0 ? n - LOOK_BACK : 0], rate;

  if (n < 2 * LOOK_BACK || !(before > 0)) return PETSC_FALSE;
  for (PetscInt k = n - 1; k > n - 2; k--) best = PetscMin(best, e[k]); /* every second value may be slightly worse */
  rate = PetscPowReal(best / before, 1.0 / LOOK_BACK);
  if (rate < SLOW) return PETSC_FALSE;
  return (PetscBool)(rate >= 1 || (PetscReal)n + PetscLogReal(Condensing(t)->tol / best) / PetscLogReal(rate) >
                                      BEYOND * (PetscReal)h->most);
}

/* The number of values of each parameter in which everything is affine. */
static PetscInt CountAffineValues(HycoScene s, HycoCondensed c)
{
  PetscInt n = AFFINE_VALUES;
  PetscReal dim = 0;

  for (PetscInt p = 0; p < s->n_parameters; p++) dim += c->affine[p] && s->hi[p] > s->lo[p];
  while (n > 2 && PetscPowReal((PetscReal)n, dim) > AFFINE_POINTS) n--;
  return n;
}

PetscErrorCode HycoCondensedChoosePoints(HycoReducer t, HycoSnapshots store, HycoSamples *samples)
{
  HycoScene s = t->scene;
  const PetscInt n_affine = CountAffineValues(s, Condensing(t)->condensed);
  PetscInt counts[HYCO_MAX_PARAMETERS], worst = 0;
  History h = {Condensing(t)->max_values, NULL};

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(s->n_parameters * (h.most + 1) + 1, &h.error));
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const PetscInt n = Condensing(t)->condensed->affine[p] ? n_affine : FIRST_VALUES;

    counts[p] = s->hi[p] > s->lo[p] ? PetscMin(n, Condensing(t)->max_values) : 1;
  }
  while (worst >= 0) {
    PetscCall(TakeSamples(t, counts, samples));
    PetscCall(Estimate(t, store));
    worst = Choose(t, &Condensing(t)->condensed->target_met);
    for (PetscInt p = 0; p < s->n_parameters; p++)
      h.error[p * (h.most + 1) + counts[p]] = Condensing(t)->condensed->by_parameter[p];
    Condensing(t)->condensed->hopeless = worst >= 0 && IsHopeless(t, &h, worst) ? worst : -1;
    if (Condensing(t)->condensed->hopeless >= 0) break;
    if (worst >= 0) counts[worst]++;
  }
  Condensing(t)->condensed->chosen = PETSC_TRUE;
  PetscCall(PetscFree(h.error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedStartPoints(HycoReducer t, HycoSamples *samples)
{
  PetscInt counts[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < t->scene->n_parameters; p++) counts[p] = t->scene->hi[p] > t->scene->lo[p] ? 2 : 1;
  PetscCall(MakeSamples(t->scene, counts, samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}
