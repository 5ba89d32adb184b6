/*
  The modes of a condensed model. u(mu) = K^-1 (F - B^T L) is nearly a polynomial in the parameters that change K and B
  for constant forces L, so that the solutions at the nodes of the stiffness span the solutions in between if each node
  has responses to the forces of all others. Training solutions alone are not sufficient: their POD lacks the
  displacements under a force of one node at the next node. Therefore, the forces are sampled over the region of
  training, where a sample costs only a complementarity problem; POD gives a few patterns of them; the responses to
  these are computed at each node; and the modes are a POD of snapshots and responses together.

  A contact that closes between the samples only has no force in them. Contacts that come near to closing in some sample
  are therefore patterns of their own. The coefficients H of the modes must be right for any forces, also for those that
  are in no pattern: otherwise the displacement lacks the whole response to them, with the rigid motion that it
  contains. The responses to a basis of all forces give them, where these are not too many numbers; they do not enter
  the POD.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>

#define SAMPLES       480 /* number of force samples: half over the whole region, half where contacts close or open */
#define WAYS          16  /* number of line segments between points */
#define LEAST_SAMPLES 16
#define FREE_CONTACTS                                                                                                  \
  700           /* with more contacts fewer samples, in inverse proportion to the square, because of their             \
                   cost; at least */
#define HELD  4 /* one of this many samples is held out of the patterns to judge them */
#define SHARE 0.95
#define ACTIVE                                                                                                         \
  1e-8                         /* share of the largest training force: contacts of a sample with a smaller force are   \
                                  open */
#define LEAST_STEP     0x1p-11 /* share of the training values' box: shorter segments are not bisected */
#define MOST_RESPONSES 5e7     /* numbers in all responses: 400 MB */
#define SMALL          1e-2
#define NEAR           0.1  /* a contact may close if its gap falls in some sample to this share of its range */
#define INDEPENDENT    1e-6 /* smaller parts of a unit force are round-off */

/* Tolerance for the modes: stresses lose digits by the derivative, and forces need more. */
static PetscReal Tolerance(HycoReducer t)
{
  return PetscMin(Condensing(t)->pod_tol, t->tol[HYCO_SEED_DISPLACEMENT]);
}

static PetscInt Corners(HycoCondensed c)
{
  return 1 << PetscMin(c->dim, 5);
}

/* Sample number `number` of the region of training, half a step beyond its values, within the ranges: first the
   corners, then points over the whole region. */
static void SamplePoint(HycoReducer t, PetscInt number, PetscReal mu[])
{
  const HycoCondensed c = Condensing(t)->condensed;

  for (PetscInt p = 0; p < c->dim; p++) {
    PetscReal step = 0, lo = c->x[p][0], hi = c->x[p][c->n[p] - 1], share = p < 5 ? number >> p & 1 : 0;

    for (PetscInt k = 1; k < c->n[p]; k++) step = PetscMax(step, c->x[p][k] - c->x[p][k - 1]);
    lo = PetscMin(lo, PetscMax(t->scene->lo[p], lo - step / 2));
    hi = PetscMax(hi, PetscMin(t->scene->hi[p], hi + step / 2));
    if (number >= Corners(c)) share = HycoHalton(number - Corners(c) + 1, p);
    mu[p] = lo + (hi - lo) * share;
  }
}

/* Whether a sample is held out of the patterns to judge them. */
static PetscBool Held(HycoCondensed c, PetscInt number)
{
  return (PetscBool)(number >= Corners(c) && number % HELD == 0);
}

/* By contact, the smallest and the largest remaining gap of the samples. */
typedef struct {
  PetscReal *least, *most;
} Gaps;

/* Takes the gaps w = g + G L of a sample. */
static void TakeGaps(HycoCondensed c, const PetscReal L[], Gaps *gaps)
{
  const PetscInt m = c->m;

  for (PetscInt i = 0; i < m; i++) {
    const PetscReal *row = c->M + (size_t)i * (size_t)m;
    PetscReal w = c->g[i];

    for (PetscInt j = 0; j < m; j++) w += row[j] * L[j];
    gaps->least[i] = PetscMin(gaps->least[i], w);
    gaps->most[i] = PetscMax(gaps->most[i], w);
  }
}

/* The forces at mu from the interpolated problem; zero if it is not solved. */
static PetscErrorCode SampleForces(HycoCondensed c, const PetscReal mu[], PetscReal L[], Gaps *gaps)
{
  const PetscReal *nearest = c->Lambda + (size_t)HycoCondensedNearest(c, mu, NULL) * (size_t)c->m;
  PetscBool definite, solved = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoCondensedFlexibility(c, mu, -1, -1, &definite));
  PetscCall(HycoCondensedFreeGap(c, mu, -1, -1));
  for (PetscInt i = 0; i < c->m; i++) c->active[i] = (PetscBool)(nearest[i] > 0);
  if (definite) PetscCall(HycoCondensedSolveForces(c, L, &solved));
  if (solved)
    TakeGaps(c, L, gaps);
  else
    PetscCall(PetscArrayzero(L, c->m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of contacts that are active in exactly one of two samples. All samples have the same threshold: where
   gaps and loads vanish together, the forces are round-off, which depends on the number of ranks. */
static PetscInt Differ(PetscInt m, const PetscReal a[], const PetscReal b[], PetscReal least)
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < m; i++) n += (a[i] > least) != (b[i] > least);
  return n;
}

/* The distance of two samples, with each parameter scaled to its training values. */
static PetscReal Apart(HycoCondensed c, const PetscReal a[], const PetscReal b[])
{
  PetscReal most = 0;

  for (PetscInt p = 0; p < c->dim; p++) {
    if (c->n[p] > 1) most = PetscMax(most, PetscAbsReal(a[p] - b[p]) / (c->x[p][c->n[p] - 1] - c->x[p][0]));
  }
  return most;
}

/* A part of a segment between two samples, and the number of active contacts in which these differ; 0: not bisected
   further. */
typedef struct {
  PetscInt from, to, differ;
} Way;

/* The point of sample k: halfway between the two neighbours on a segment whose active contacts differ most; the
   segment is then divided. If none differ, the next point of the whole region. For a constant active set, forces are
   affine in the affine parameters, so that the patterns depend on the active sets, of which there may be many in a
   small part of a segment. */
static void PointBetween(HycoReducer t, PetscInt k, Way way[], PetscInt *n_ways, PetscReal mu[])
{
  const PetscInt dim = Condensing(t)->condensed->dim;
  PetscInt best = 0;

  for (PetscInt j = 1; j < *n_ways; j++) best = way[j].differ > way[best].differ ? j : best;
  if (!*n_ways || !way[best].differ) {
    SamplePoint(t, k, mu + k * dim);
    return;
  }
  for (PetscInt p = 0; p < dim; p++) mu[k * dim + p] = (mu[way[best].from * dim + p] + mu[way[best].to * dim + p]) / 2;
  way[(*n_ways)++] = (Way){k, way[best].to, 0}; /* both are counted once the forces are known */
  way[best].to = k;
  way[best].differ = 0;
}

/* The largest training force. */
static PetscReal Largest(HycoReducer t)
{
  const size_t n = (size_t)t->n_s * (size_t)Condensing(t)->condensed->m;
  PetscReal largest = 0;

  for (size_t i = 0; i < n; i++) largest = PetscMax(largest, t->Lambda[i]);
  return largest;
}

/* n samples: their points (n x dim) and forces (m x n). */
static PetscErrorCode SampleAll(HycoReducer t, PetscInt n, PetscReal mu[], PetscReal L[], Gaps *gaps)
{
  HycoCondensed c = Condensing(t)->condensed;
  const PetscInt dim = c->dim, m = c->m;
  const PetscReal least = ACTIVE * Largest(t);
  PetscInt n_ways = 0;
  Way *way;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n + WAYS, &way));
  for (PetscInt k = 0; k < n; k++) {
    if (k < n / 2)
      SamplePoint(t, k, mu + k * dim);
    else
      PointBetween(t, k, way, &n_ways, mu);
    PetscCall(SampleForces(c, mu + k * dim, L + (size_t)k * (size_t)m, gaps));
    if (k && k <= WAYS && k < n / 2) way[n_ways++] = (Way){k - 1, k, 0};
    for (PetscInt j = 0; j < n_ways; j++) {
      const PetscInt from = way[j].from, to = way[j].to;

      if (from != k && to != k) continue;
      way[j].differ = Apart(c, mu + from * dim, mu + to * dim) < LEAST_STEP
                          ? 0
                          : Differ(m, L + (size_t)from * (size_t)m, L + (size_t)to * (size_t)m, least);
    }
  }
  PetscCall(PetscFree(way));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Norm of the part of a force outside the patterns' span. */
static PetscReal Missed(const HycoResponses *x, PetscInt m, PetscReal L[])
{
  PetscReal rest = 0;

  for (PetscInt j = 0; j < x->q; j++) {
    const PetscReal *Q = x->Q + (size_t)j * (size_t)m;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < m; i++) dot += Q[i] * L[i];
    for (PetscInt i = 0; i < m; i++) L[i] -= dot * Q[i];
  }
  for (PetscInt i = 0; i < m; i++) rest += L[i] * L[i];
  return PetscSqrtReal(rest);
}

/* Patterns of n forces (m x n), scaled so that all the samples have the weight of the snapshots. Rank 0. */
static PetscErrorCode Decompose(HycoReducer t, PetscInt n, PetscReal L[])
{
  HycoResponses *x = &Condensing(t)->responses;
  const PetscInt m = Condensing(t)->condensed->m,
                 nodes = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor);
  const PetscReal most = MOST_RESPONSES / ((PetscReal)(t->sizes[0] * t->sizes[3]) * (PetscReal)nodes);
  PetscReal *sigma;
  const PetscScalar *v;
  Mat F, Q;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(PetscMax(m, n), &sigma));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, n, L, &F));
  PetscCall(HycoReducerPOD(t, F, Tolerance(t), PetscMax(1, (PetscInt)PetscMin(most, 1e6)), &Q, &x->q, sigma));
  PetscCall(MatDestroy(&F));
  PetscCall(PetscMalloc1((size_t)m * (size_t)m + 1, &x->Q));
  PetscCall(PetscMalloc1(m + 1, &x->scale));
  for (PetscInt j = 0; j < x->q; j++) x->scale[j] = sigma[j] * PetscSqrtReal((PetscReal)t->n_s / (PetscReal)n);
  if (x->q) {
    PetscCall(MatDenseGetArrayRead(Q, &v));
    PetscCall(PetscArraycpy(x->Q, v, (size_t)m * (size_t)x->q));
    PetscCall(MatDenseRestoreArrayRead(Q, &v));
    PetscCall(MatDestroy(&Q));
  }
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the unit force of contact k, without its part in the patterns so far. */
static void AddContact(HycoResponses *x, PetscInt m, PetscInt k, PetscReal scale)
{
  PetscReal *e = x->Q + (size_t)x->q * (size_t)m, norm = 0;

  if (x->q == m) return;
  for (PetscInt i = 0; i < m; i++) e[i] = i == k;
  for (int twice = 0; twice < 2; twice++) norm = Missed(x, m, e);
  if (norm < INDEPENDENT) return;
  for (PetscInt i = 0; i < m; i++) e[i] /= norm;
  x->scale[x->q++] = scale;
}

/* Whether contact k has a force in some pattern. */
static PetscBool HasForce(const HycoResponses *x, PetscInt m, PetscInt k)
{
  for (PetscInt j = 0; j < x->q; j++) {
    if (PetscAbsReal(x->Q[(size_t)j * (size_t)m + (size_t)k]) > INDEPENDENT) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Contacts without a force in any sample that may close between them: each with the weight of one of n samples. */
static void AddNear(HycoReducer t, PetscInt n, const Gaps *gaps)
{
  HycoResponses *x = &Condensing(t)->responses;
  const PetscInt m = Condensing(t)->condensed->m;
  PetscReal sum = 0;

  for (PetscInt j = 0; j < x->q; j++) sum += x->scale[j] * x->scale[j];
  for (PetscInt k = 0; k < m && sum > 0; k++) {
    if (gaps->least[k] <= NEAR * (gaps->most[k] - gaps->least[k]) && !HasForce(x, m, k))
      AddContact(x, m, k, PetscSqrtReal(sum / (PetscReal)n));
  }
}

/* The rest of a basis of all forces, if the responses to it have not too many numbers. */
static void AddRest(HycoReducer t)
{
  HycoResponses *x = &Condensing(t)->responses;
  const PetscInt m = Condensing(t)->condensed->m,
                 nodes = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor);

  x->sampled = x->q;
  if ((PetscReal)(t->sizes[0] * t->sizes[3]) * (PetscReal)nodes * (PetscReal)m > MOST_RESPONSES) return;
  for (PetscInt k = 0; k < m && x->q; k++) AddContact(x, m, k, x->scale[0]);
}

/* The error of the patterns on the held-out samples, over the displacement of the nearest snapshot or a hundredth of
   the largest: the SHARE quantile. */
static PetscErrorCode JudgePatterns(HycoReducer t, PetscInt n, const PetscReal mu[], PetscReal L[])
{
  HycoCondensed c = Condensing(t)->condensed;
  PetscReal largest = 0, *missed;
  PetscInt n_held = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &missed));
  for (PetscInt k = 0; k < t->n_s; k++) largest = PetscMax(largest, t->U_norm[k]);
  for (PetscInt k = 0; largest > 0 && k < n; k++) {
    const PetscReal near = t->U_norm[c->sample[HycoCondensedNearest(c, mu + k * c->dim, NULL)]];

    if (!Held(c, k)) continue;
    missed[n_held++] =
        Missed(&Condensing(t)->responses, c->m, L + (size_t)k * (size_t)c->m) / PetscMax(near, SMALL * largest);
  }
  PetscCall(PetscSortReal(n_held, missed));
  Condensing(t)->responses.missed = n_held ? missed[(PetscInt)(SHARE * (PetscReal)(n_held - 1))] : 0;
  PetscCall(PetscFree(missed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoCondensedSamples(PetscInt m)
{
  const PetscReal share = PetscSqr((PetscReal)FREE_CONTACTS / (PetscReal)m);

  return m <= FREE_CONTACTS ? SAMPLES : PetscMax(LEAST_SAMPLES, (PetscInt)(share * SAMPLES));
}

static PetscErrorCode FindPatterns(HycoReducer t)
{
  HycoCondensed c = Condensing(t)->condensed;
  const size_t m = (size_t)c->m;
  const PetscInt n = HycoCondensedSamples(c->m);
  PetscReal *mu, *L, *used;
  PetscInt n_used = t->n_s;
  Gaps gaps;

  PetscFunctionBegin;
  PetscCall(HycoCondensedFillFields(t, PETSC_FALSE));
  PetscCall(
      PetscMalloc5(n * c->dim, &mu, m * (size_t)n, &L, m * (size_t)(t->n_s + n), &used, m, &gaps.least, m, &gaps.most));
  for (PetscInt i = 0; i < c->m; i++) {
    gaps.least[i] = PETSC_MAX_REAL;
    gaps.most[i] = -PETSC_MAX_REAL;
  }
  PetscCall(SampleAll(t, n, mu, L, &gaps));
  PetscCall(PetscArraycpy(used, t->Lambda, m * (size_t)t->n_s));
  for (PetscInt k = 0; k < n; k++) {
    if (!Held(c, k)) PetscCall(PetscArraycpy(used + m * (size_t)(n_used++), L + m * (size_t)k, m));
  }
  PetscCall(Decompose(t, n_used, used));
  AddNear(t, n_used, &gaps);
  PetscCall(JudgePatterns(t, n, mu, L));
  AddRest(t);
  PetscCall(PetscFree5(mu, L, used, gaps.least, gaps.most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends the patterns to every rank. */
static PetscErrorCode SpreadPatterns(HycoReducer t)
{
  HycoResponses *x = &Condensing(t)->responses;
  const PetscInt m = Condensing(t)->condensed->m;

  PetscFunctionBegin;
  PetscCall(HycoReducerFetchContacts(t)); /* for FindPatterns() and the build */
  HycoOnRoot(HycoComm(t), FindPatterns(t));
  PetscCallMPI(MPI_Bcast(&x->q, 1, MPIU_INT, 0, HycoComm(t)));
  PetscCallMPI(MPI_Bcast(&x->sampled, 1, MPIU_INT, 0, HycoComm(t)));
  if (t->rank) {
    PetscCall(PetscMalloc1(m * x->q + 1, &x->Q));
    PetscCall(PetscMalloc1(x->q + 1, &x->scale));
  }
  HycoBcast(x->Q, m * x->q, MPIU_REAL, HycoComm(t));
  HycoBcast(x->scale, x->q, MPIU_REAL, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for the responses to all patterns at all nodes. */
static PetscErrorCode Respond(HycoReducer t, HycoSnapshots store, PetscReal **P)
{
  const HycoResponses *x = &Condensing(t)->responses;
  const PetscInt m = Condensing(t)->condensed->m;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)m * (size_t)x->q + 1, P));
  for (PetscInt j = 0; j < x->q; j++) {
    for (PetscInt i = 0; i < m; i++) (*P)[j * m + i] = x->scale[j] * x->Q[j * m + i];
  }
  PetscCall(HycoCondensedRespond(t, store, x->q, *P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Snapshots and, node by node, the responses to the sampled patterns, as columns of one matrix. */
static PetscErrorCode Columns(HycoReducer t, HycoSnapshots store, const PetscReal P[], Mat *columns)
{
  const HycoResponses *x = &Condensing(t)->responses;
  const PetscInt nodes = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor);
  PetscInt n_own;
  Mat S;

  PetscFunctionBegin;
  PetscCall(HycoReducerGetDisplacements(t, store, &S));
  PetscCall(MatGetLocalSize(S, &n_own, NULL));
  PetscCall(MatCreateDense(HycoComm(t), n_own, PETSC_DECIDE, t->sizes[0] * t->sizes[3], t->n_s + nodes * x->sampled,
                           NULL, columns));
  PetscCall(HycoCopyColumns(S, *columns, 0));
  PetscCall(MatDestroy(&S));
  for (PetscInt k = 0; k < nodes; k++)
    PetscCall(HycoCondensedReadResponses(t, store, x->q, P, k, 0, x->sampled, *columns, t->n_s + k * x->sampled));
  PetscCall(MatAssemblyBegin(*columns, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*columns, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coefficients of the snapshots and of the responses to all patterns in the modes V: those of S and of the
   responses that it does not contain. */
static PetscErrorCode Coefficients(HycoReducer t, HycoSnapshots store, const PetscReal P[], Mat V, Mat S)
{
  HycoResponses *x = &Condensing(t)->responses;
  const PetscInt nodes = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor),
                 rest = x->q - x->sampled;
  const size_t r = (size_t)x->r;
  PetscReal *C;
  PetscInt n_own, N;
  Mat R;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r * (size_t)(t->n_s + nodes * x->q) + 1, &x->C));
  PetscCall(PetscMalloc1(r * (size_t)(t->n_s + nodes * x->sampled) + 1, &C));
  PetscCall(HycoReducerMultiply(t, V, S, C));
  PetscCall(PetscArraycpy(x->C, C, r * (size_t)t->n_s));
  PetscCall(MatGetLocalSize(S, &n_own, NULL));
  PetscCall(MatGetSize(S, &N, NULL));
  PetscCall(MatCreateDense(HycoComm(t), n_own, PETSC_DECIDE, N, rest, NULL, &R));
  for (PetscInt k = 0; k < nodes; k++) {
    PetscReal *to = x->C + r * (size_t)(t->n_s + k * x->q);

    PetscCall(PetscArraycpy(to, C + r * (size_t)(t->n_s + k * x->sampled), r * (size_t)x->sampled));
    if (!rest) continue;
    PetscCall(HycoCondensedReadResponses(t, store, x->q, P, k, x->sampled, rest, R, 0));
    PetscCall(HycoReducerMultiply(t, V, R, to + r * (size_t)x->sampled));
  }
  PetscCall(MatDestroy(&R));
  PetscCall(PetscFree(C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets l, sigma, V and VtU from all r modes V. */
static PetscErrorCode TakeModes(HycoReducer t, Mat V, PetscInt n_sigma, PetscReal sigma[])
{
  HycoResponses *x = &Condensing(t)->responses;

  PetscFunctionBegin;
  PetscCall(HycoReducerPODRank(t, n_sigma, sigma, Tolerance(t), t->max_modes, x->r, &t->l));
  HycoCheckModel(t->l, "-hyco_condensed_pod_tol %g leaves no mode; give a smaller value", (double)Tolerance(t));
  PetscCall(PetscFree(t->sigma));
  t->sigma = sigma;
  PetscCall(PetscFree(t->VtU));
  PetscCall(PetscMalloc1(t->l * t->n_s, &t->VtU));
  for (PetscInt k = 0; k < t->n_s; k++)
    PetscCall(PetscArraycpy(t->VtU + k * t->l, x->C + (size_t)k * (size_t)x->r, t->l));
  PetscCall(MatDestroy(&t->V));
  PetscCall(PetscObjectReference((PetscObject)V));
  t->V = V;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedFindModes(HycoReducer t, HycoSnapshots store)
{
  HycoResponses *x = &Condensing(t)->responses;
  PetscReal *sigma, *P;
  PetscInt n_sigma, n;
  Mat S, V;

  PetscFunctionBegin;
  PetscCall(HycoCondensedFlexibilities(t, store));
  PetscCall(SpreadPatterns(t));
  PetscCall(Respond(t, store, &P));
  PetscCall(Columns(t, store, P, &S));
  PetscCall(MatGetSize(S, &n_sigma, &n));
  n_sigma = PetscMin(n_sigma, n);
  PetscCall(PetscMalloc1(n + 1, &sigma));
  PetscCall(HycoReducerDisplacementPOD(t, S, 0, 0, &V, &x->r, sigma));
  PetscCall(Coefficients(t, store, P, V, S));
  PetscCall(TakeModes(t, V, n_sigma, sigma));
  PetscCall(PetscFree(P));
  PetscCall(MatDestroy(&V));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}
