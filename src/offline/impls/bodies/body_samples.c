/*
  The samples of theta, the parameters that change the shape of bodies or the ratio of their moduli: a tensor grid of
  the extrema of Chebyshev polynomials, whose finer grids contain the coarser ones. If -e C <= C~ - C <= e C for every
  body, the same holds for W, and the two variational inequalities give |L~ - L|_W <= e |L~|_W, whatever touches. e is
  measured where the next finer grid has its nodes, so that these are not lost if that is needed; between these points
  it is an estimate.
*/
#include <hycobodiestraining.h>
#include <petscblaslapack.h>

#define MOST_VALUES 17
/* Of the flexibility, e at held-out samples: above it the model is refused, since forces may be wrong by a third. */
#define MOST_ERROR 0.3
#define ITERATIONS 30 /* of the power method */
/* Of the flexibility, e at held-out samples: below it no more samples than HYCO_BODIES_SAMPLES are added, which make
   predictions slower; a hundredth of the 1 % of forces that the search takes as accurate enough. */
#define SMALL_ERROR  1e-4
#define MOST_CHEAP   500 /* samples, where they are cheap; */
#define MOST_NUMBERS 2e7 /* numbers of their flexibilities, at most */

/* Node k of n along parameter p, in its own variable. Chebyshev points of the second kind (extrema), nested when their
   number n goes to 2 n - 1: former samples stay. Ends exactly, without round-off. */
static PetscReal BodySamplesNode(HycoReducer t, HycoSubstructures b, PetscInt p, PetscInt n, PetscInt k)
{
  const PetscReal share = (1 - PetscCosReal(PETSC_PI * ((PetscReal)k / (PetscReal)(n - 1)))) / 2;
  const PetscInt variable = b->variable[p];
  const PetscReal lo = t->scene->lo[b->theta[p]], hi = t->scene->hi[b->theta[p]];
  const PetscReal first = HycoBodiesVariable(variable, lo), last = HycoBodiesVariable(variable, hi);

  if (!k) return lo;
  if (k == n - 1) return hi;
  return HycoBodiesValue(variable, first + share * (last - first));
}

/* A node of the grid is a sample of the body only at the first value of the axes that do not change it, so that
   none is stored twice. */
PetscInt HycoBodiesSampleOf(HycoSubstructures b, PetscInt body, PetscInt k)
{
  const HycoTensor *t = &b->body[body].tensor;
  PetscInt index[HYCO_TENSOR_MAX_DIM], sample = 0;

  for (PetscInt p = b->n_theta - 1; p >= 0; p--) {
    /* The last axis is the fastest, as in HycoBodiesGrid(). */
    index[p] = k % b->n_nodes[p];
    k /= b->n_nodes[p];
  }
  for (PetscInt p = 0; p < b->n_theta; p++) {
    /* The body is the same at all nodes along this axis: the first of them is its sample. */
    if (t->n[p] == 1 && index[p]) return -1;
    sample = sample * t->n[p] + (t->n[p] > 1 ? index[p] : 0);
  }
  return sample;
}

/* Sets the values of theta from their numbers, and the bodies' tensors. Logarithms are interpolated where
   `logarithm` says so; HycoBodiesPoint() gives theta back without a round trip through them, exactly as it was
   condensed. */
static PetscErrorCode SetGrid(HycoReducer t, HycoSubstructures b)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) n += b->n_nodes[p];
  PetscCall(PetscFree(b->node));
  PetscCall(PetscMalloc1(n + 1, &b->node));
  n = 0;
  for (PetscInt p = 0; p < b->n_theta; p++) {
    for (PetscInt k = 0; k < b->n_nodes[p]; k++)
      b->node[n++] = HycoBodiesVariable(b->variable[p], BodySamplesNode(t, b, p, b->n_nodes[p], k));
  }
  /* Each body has the nodes of the axes that change it and one of the others. */
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt p = 0; p < b->n_theta; p++) b->body[k].tensor.n[p] = HycoBodiesAxis(b, k, p) ? b->n_nodes[p] : 1;
  }
  HycoBodiesSetTensors(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* k counts the nodes of the tensor grid, the last parameter fastest. */
void HycoBodiesPoint(HycoReducer t, PetscInt k, PetscReal theta[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;

  for (PetscInt p = b->n_theta - 1; p >= 0; p--) {
    theta[p] = BodySamplesNode(t, b, p, b->n_nodes[p], k % b->n_nodes[p]);
    k /= b->n_nodes[p];
  }
}

/* C of body k from its samples: how small terms are stored, see HycoFlexibilityCreate(). Rank 0. */
static PetscErrorCode TakeFlexibility(HycoReducer t, const HycoBodiesFactor *factor, PetscInt k, PetscReal least,
                                      PetscReal single)
{
  HycoSubstructure *s = &HycoTrainingOfBodies(t)->bodies->body[k];
  const HycoBodyFactor *body = &factor->body[k];
  const PetscReal **C;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_samples, &C));
  for (PetscInt j = 0; j < s->n_samples; j++) C[j] = body->record[body->sample[j]].C;
  PetscCall(HycoFlexibilityDestroy(&s->C));
  PetscCall(HycoFlexibilityCreate(&s->tensor, s->n, s->n, C, NULL, s->n_samples > 1 ? least : 0, single, &s->C));
  PetscCall(PetscFree(C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the records of the grid (n for each node) to the bodies. Rank 0. */
static PetscErrorCode TakeRecords(HycoReducer t, HycoBodiesFactor *factor, const PetscInt record[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt n = HycoBodiesGrid(b, 0, NULL);

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    HycoSubstructure *s = &b->body[k];
    HycoBodyFactor *body = &factor->body[k];
    /* Sizes of a sample's responses to the loads, of its rigid motions, and of the loads' work on these. */
    const size_t R = (size_t)(s->n * b->r), Z = (size_t)(s->n * b->p), work = (size_t)(b->p * b->r),
                 samples = (size_t)s->n_samples;

    HycoFreeAll(&s->R, &s->Z, &s->work, &s->gram, &body->sample);
    PetscCall(PetscCalloc1(b->r * b->r + 1, &s->gram));
    PetscCall(PetscMalloc1(samples, &body->sample));
    PetscCall(PetscMalloc1(samples * R + 1, &s->R));
    PetscCall(PetscMalloc1(samples * Z + 1, &s->Z));
    PetscCall(PetscMalloc1(samples * work + 1, &s->work));
    for (PetscInt j = 0; j < n; j++) {
      const HycoBodyRecord *r = &body->record[record[j * b->n + k]];
      const PetscInt at = HycoBodiesSampleOf(b, k, j);

      /* A body has a sample for each node of its own parameters only, which many nodes of the grid share. */
      if (at < 0) continue;
      body->sample[at] = record[j * b->n + k];
      PetscCall(PetscArraycpy(s->R + (size_t)at * R, r->R, R));
      PetscCall(PetscArraycpy(s->Z + (size_t)at * Z, r->Z, Z));
      PetscCall(PetscArraycpy(s->work + (size_t)at * work, r->work, work));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the bound -- */

/* record->L, the Cholesky factor of C in its lower triangle; made once, as the point is held out again. */
static PetscErrorCode BodySamplesFactor(PetscInt n, HycoBodyRecord *record)
{
  PetscBLASInt m, info;
  PetscReal most = 0, *L;

  PetscFunctionBegin;
  if (record->L) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(n, &m));
  PetscCall(PetscMalloc1((size_t)n * (size_t)n, &L));
  PetscCall(PetscArraycpy(L, record->C, (size_t)n * (size_t)n));
  record->L = L;
  for (PetscInt i = 0; i < n; i++) most = PetscMax(most, L[(size_t)i * (size_t)(n + 1)]);
  for (PetscInt i = 0; i < n; i++) L[(size_t)i * (size_t)(n + 1)] += 1e-13 * most; /* pinned unknowns do not move */
  /* The shift is far below any bound that matters, and pinned unknowns have zero rows. */
  LAPACKpotrf_("L", &m, L, &m, &info);
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "the flexibility of a body is not positive definite");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest |eigenvalue| of (D, C), D symmetric, from the factor L of C (both n x n). Power iteration on L^-1 D L^-T,
   symmetric, whose |eigenvalues| are those of the pencil; a few digits are enough for a bound. */
static PetscErrorCode BodySamplesLargest(PetscInt n, const PetscReal L[], const PetscReal D[], PetscReal *largest)
{
  PetscBLASInt m, one = 1;
  const PetscReal unit = 1, zero = 0;
  PetscReal *x, *y;

  PetscFunctionBegin;
  *largest = 0;
  PetscCall(PetscBLASIntCast(n, &m));
  PetscCall(PetscMalloc2(n, &x, n, &y));
  for (PetscInt i = 0; i < n; i++) x[i] = PetscSinReal(1.0 + i);
  for (PetscInt k = 0; k < ITERATIONS; k++) { /* x <- L^-1 D L^-T x */
    PetscReal size = 0;

    for (PetscInt i = 0; i < n; i++) size += x[i] * x[i];
    size = PetscSqrtReal(size);
    if (!(size > 0)) break;
    /* After an iteration on a vector of length 1, its length tends to the largest |eigenvalue|. */
    if (k) *largest = size;
    for (PetscInt i = 0; i < n; i++) x[i] /= size;
    BLAStrsm_("L", "L", "T", "N", &m, &one, &unit, L, &m, x, &m);
    BLASsymm_("L", "L", &m, &one, &unit, D, &m, x, &m, &zero, y, &m);
    BLAStrsm_("L", "L", "N", "N", &m, &one, &unit, L, &m, y, &m);
    PetscCall(PetscArraycpy(x, y, n));
  }
  PetscCall(PetscFree2(x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the products of the columns of R~ - R (R: n x r row major) in the norm of C^-1, C = L L^T. */
static PetscErrorCode AddGram(const HycoSubstructure *s, const PetscReal weight[], PetscInt r, const PetscReal L[],
                              const PetscReal R[])
{
  PetscBLASInt m, columns;
  const PetscReal unit = 1;
  PetscReal *D;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(s->n, &m));
  PetscCall(PetscBLASIntCast(r, &columns));
  PetscCall(PetscMalloc1(s->n * r + 1, &D));
  for (PetscInt i = 0; i < s->n * r; i++) {
    PetscReal *d = D + i % r * s->n + i / r;

    *d = -R[i];
    for (PetscInt q = 0; q < s->n_samples; q++) *d += weight[q] * s->R[(size_t)q * (size_t)(s->n * r) + (size_t)i];
  }
  if (r) BLAStrsm_("L", "L", "N", "N", &m, &columns, &unit, L, &m, D, &m);
  for (PetscInt i = 0; i < r * r; i++) {
    /* Summed over the held-out points, so that the quadratic form bounds the error at each of them. */
    for (PetscInt k = 0; k < s->n; k++) s->gram[i] += D[i / r * s->n + k] * D[i % r * s->n + k];
  }
  PetscCall(PetscFree(D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D = the flexibility of a body at the weights of its samples, from these or as it is stored, minus C. */
static PetscErrorCode BodySamplesDifference(const HycoSubstructure *s, const HycoBodyFactor *body,
                                            const PetscReal weight[], PetscBool stored, const PetscReal C[],
                                            PetscReal D[])
{
  const size_t n = (size_t)s->n;
  PetscReal *share;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->C.n_terms, &share));
  HycoFlexibilityShares(&s->C, s->n_samples, weight, share);
  PetscCall(PetscArrayzero(D, n * n));
  for (PetscInt d = 0; d < s->n && stored; d++) HycoFlexibilityColumn(&s->C, share, d, D + (size_t)d * n);
  for (PetscInt j = 0; j < s->n_samples && !stored; j++) {
    const PetscReal *sample = body->record[body->sample[j]].C;

    for (size_t i = 0; i < n * n; i++) D[i] += weight[j] * sample[i];
  }
  for (size_t i = 0; i < n * n; i++) D[i] -= C[i];
  PetscCall(PetscFree(share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point that is no sample, and the bodies' records there. */
typedef struct {
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt *record;
} Held;

/* e of all bodies at a point: of the samples, whose errors of R join gram, or of the flexibilities as they are stored.
   Rank 0. */
static PetscErrorCode BodySamplesBound(HycoSubstructures b, const HycoBodiesFactor *factor, const Held *held,
                                       PetscBool stored, PetscReal *e)
{
  PetscFunctionBegin;
  *e = 0;
  for (PetscInt k = 0; k < b->n; k++) {
    const HycoSubstructure *s = &b->body[k];
    HycoBodyRecord *record = &factor->body[k].record[held->record[k]];
    const size_t n = (size_t)PetscSqr(s->n);
    PetscReal *D, *weight, own;

    /* Nothing of this body is interpolated. */
    if (s->n_samples == 1 || !s->n) continue;
    PetscCall(PetscMalloc2(n + 1, &D, s->n_samples, &weight));
    PetscCall(HycoBodiesWeights(b, k, held->mu, weight));
    PetscCall(BodySamplesFactor(s->n, record));
    PetscCall(BodySamplesDifference(s, &factor->body[k], weight, stored, record->C, D));
    PetscCall(BodySamplesLargest(s->n, record->L, D, &own));
    *e = PetscMax(*e, own);
    if (!stored) PetscCall(AddGram(s, weight, b->r, record->L, record->R));
    PetscCall(PetscFree2(D, weight));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* e along axis p: at two nodes of the next finer grid, with the other parameters at a middle node. Collective. */
static PetscErrorCode BoundDirection(HycoReducer t, HycoBodiesFactor *factor, PetscInt axis, Held held[2], PetscReal *e)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;

  PetscFunctionBegin;
  *e = 0;
  for (PetscInt side = 0; side < 2; side++) {
    const PetscInt finer = 2 * b->n_nodes[axis] - 1;
    PetscReal theta[HYCO_MAX_PARAMETERS], own = 0;

    for (PetscInt p = 0; p < b->n_theta; p++) {
      theta[p] = p == axis ? BodySamplesNode(t, b, p, finer, side ? finer - 2 : 1)
                           : BodySamplesNode(t, b, p, b->n_nodes[p], b->n_nodes[p] / 2);
      held[side].mu[b->theta[p]] = theta[p];
    }
    PetscCall(HycoBodiesCondense(t, factor, theta, held[side].record));
    HycoOnRoot(HycoComm(t), BodySamplesBound(b, factor, &held[side], PETSC_FALSE, &own));
    PetscCallMPI(MPI_Bcast(&own, 1, MPIU_REAL, 0, HycoComm(t)));
    *e = PetscMax(*e, own);
    PetscCall(PetscFree(factor->between));
    /* Kept for MeasureLeft(): a point that is no sample, with a factor that may still be there. */
    HycoDuplicate(b->n_theta, theta, &factor->between);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Condenses at all nodes of the grid. Collective. */
static PetscErrorCode CondenseGrid(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscInt n, *record;

  PetscFunctionBegin;
  PetscCall(SetGrid(t, b));
  n = HycoBodiesGrid(b, 0, NULL);
  PetscCall(PetscMalloc1(n * b->n, &record));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal theta[HYCO_MAX_PARAMETERS];

    HycoBodiesPoint(t, k, theta);
    /* Nodes of the coarser grid, and those at which it was judged, are found among the records. */
    PetscCall(HycoBodiesCondense(t, factor, theta, record + k * b->n));
  }
  HycoOnRoot(HycoComm(t), TakeRecords(t, factor, record));
  PetscCall(PetscFree(record));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many samples there may be: without a limit of the user's more than most_samples where they are cheap.
   Collective. */
static PetscErrorCode FindRoom(HycoReducer t)
{
  const HycoBodiesTraining s = HycoTrainingOfBodies(t);
  const HycoSubstructures b = s->bodies;
  PetscReal numbers = 0, work = HycoReducerFactorWork(t), budget;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal n = (PetscReal)b->body[k].n;

    numbers += n * n;
    work += n * HycoReducerSolveWork(t) + n * n * n / 3;
  }
  PetscCall(HycoReducerSearchBudget(t, &budget));
  s->room = s->most_samples;
  if (!s->limited)
    s->room = PetscMax(s->room, PetscMin(PetscMin(budget / work, MOST_CHEAP), MOST_NUMBERS / PetscMax(numbers, 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The axis with the largest e that a finer grid may reduce, -1: none; then s->ended says what does not let it. */
static PetscInt BodySamplesWorst(HycoReducer t, HycoSubstructures b, const PetscReal e[])
{
  const HycoBodiesTraining s = HycoTrainingOfBodies(t);
  PetscReal most = 0;
  PetscInt worst = -1;

  for (PetscInt p = 0; p < b->n_theta; p++) {
    const PetscInt finer = 2 * b->n_nodes[p] - 1, n = HycoBodiesGrid(b, 0, NULL) / b->n_nodes[p] * finer;
    const char *name = t->scene->parameter[b->theta[p]];
    const PetscReal room = e[p] > SMALL_ERROR / b->n_theta ? s->room : (PetscReal)s->most_samples;
    const PetscBool ends = (PetscBool)(finer > MOST_VALUES || n > room);

    /* The axes' errors add up: each may use its share of the tolerance. */
    if (e[p] <= s->tol / b->n_theta) continue;
    if (!ends && (worst < 0 || e[p] > e[worst])) worst = p;
    if (!ends || e[p] <= most || (!s->limited && e[p] <= SMALL_ERROR / b->n_theta)) continue;
    most = e[p];
    if (finer > MOST_VALUES)
      snprintf(s->ended, sizeof(s->ended), "narrow the range of %s, of which %d values are not enough", name,
               (int)b->n_nodes[p]);
    else
      snprintf(s->ended, sizeof(s->ended), "give -hyco_bodies_max_samples %d or more, for more values of %s", (int)n,
               name);
  }
  return worst;
}

/* Ways to store a flexibility, the shortest first: shares of the tolerance below which terms are left out, and the size
   up to which they are in single precision; the last one is all of it. The noise of single precision acts on the
   stiffest parts of C, a term that is left out hardly does. */
static const struct {
  PetscReal least, single;
} ways[] = {{1e-2, PETSC_MAX_REAL}, {1e-2, 1e-2}, {1e-3, 1e-4}, {0, 0}};

/* The flexibilities in the first of these ways that adds to e of no axis more than it may; e becomes that of what is
   stored. Rank 0. */
static PetscErrorCode BodySamplesStore(HycoReducer t, const HycoBodiesFactor *factor, const Held held[], PetscReal e[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscReal tol = HycoTrainingOfBodies(t)->tol;
  PetscReal own, stored[HYCO_MAX_PARAMETERS];
  PetscBool fine = PETSC_FALSE;

  PetscFunctionBegin;
  for (size_t way = 0; !fine && way < sizeof(ways) / sizeof(*ways); way++) {
    for (PetscInt k = 0; k < b->n; k++)
      PetscCall(TakeFlexibility(t, factor, k, ways[way].least * tol, ways[way].single));
    fine = PETSC_TRUE;
    for (PetscInt p = 0; p < b->n_theta && ways[way].least > 0; p++) {
      stored[p] = 0;
      for (PetscInt side = 0; side < 2 && fine; side++) {
        PetscCall(BodySamplesBound(b, factor, &held[2 * p + side], PETSC_TRUE, &own));
        stored[p] = PetscMax(stored[p], own);
        fine = (PetscBool)(own <= e[p] + HYCO_SHORTENED * tol / b->n_theta);
      }
    }
    if (fine && ways[way].least > 0) PetscCall(PetscArraycpy(e, stored, b->n_theta));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One axis is refined at a time, the worst: a tensor grid that is fine in all of them would cost the product. What
   remains above the tolerance is no failure, it is in the bound. */
static PetscErrorCode BodySamplesRefine(HycoReducer t, HycoBodiesFactor *factor, Held held[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal e[HYCO_MAX_PARAMETERS] = {0};
  PetscInt worst;

  PetscFunctionBegin;
  PetscCall(FindRoom(t));
  do {
    HycoTrainingOfBodies(t)->ended[0] = '\0';
    PetscCall(CondenseGrid(t, factor));
    for (PetscInt p = 0; p < b->n_theta; p++) PetscCall(BoundDirection(t, factor, p, held + 2 * p, &e[p]));
    worst = BodySamplesWorst(t, b, e);
    /* Nested Chebyshev grids: all former samples stay nodes of the finer grid. */
    if (worst >= 0) b->n_nodes[worst] = 2 * b->n_nodes[worst] - 1;
  } while (worst >= 0);
  HycoOnRoot(HycoComm(t), BodySamplesStore(t, factor, held, e));
  HycoBcast(e, b->n_theta, MPIU_REAL, HycoComm(t));
  b->bound = 0;
  for (PetscInt p = 0; p < b->n_theta; p++) {
    b->bound += e[p];
    HycoCheckModel(e[p] <= MOST_ERROR,
                   "the flexibility of a body cannot be interpolated over %s: with %d values its relative error is "
                   "%.2g; %s, or train a hybrid model",
                   t->scene->parameter[b->theta[p]], (int)b->n_nodes[p], (double)e[p], HycoTrainingOfBodies(t)->ended);
  }
  /* What helps if the model misses: nothing else lowers its errors. */
  PetscCall(PetscStrncpy(t->remedy, HycoTrainingOfBodies(t)->ended, sizeof(t->remedy)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSample(HycoReducer t, HycoBodiesFactor *factor)
{
  const PetscInt n = 2 * HycoTrainingOfBodies(t)->bodies->n_theta;
  Held *held;
  PetscInt *record;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n + 1, &held, n * factor->n + 1, &record));
  for (PetscInt k = 0; k < n; k++) held[k].record = record + k * factor->n;
  HycoFinally(BodySamplesRefine(t, factor, held), PetscCall(PetscFree2(held, record)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
