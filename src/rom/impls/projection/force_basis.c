/*
  The nonnegative basis of the contact forces of a projection-based model (6.3, 6.4), made from the dual snapshots:
  their nonnegative factorisation, by default with as many vectors as there are displacement modes (the extended
  necessary condition l_u >= l_lambda), or the snapshots themselves (Haasdonk, Salomon, Wohlmuth, SIAM J. Numer. Anal.
  50 (2012) 2656-2676). With these the modes take in the snapshots' supremizers, without which they would be fewer than
  the forces to determine.
*/
#include <hycoalgorithms.h>
#include <hycoprojection.h>
#include <petscblaslapack.h>

/* What the options of this type say, and what a run makes of them. */
typedef struct {
  HycoDual dual;
  PetscInt max_its, vectors; /* of the factorisation; 0: as many as there are modes */
  PetscInt n_supremizers;    /* of the modes, the last */
} * Training;

PetscErrorCode HycoProjectionSetFromOptions(HycoReducer t)
{
  Training s;
  PetscInt dual = HYCO_DUAL_NNMF;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  s->max_its = 100;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsWord("-hyco_dual",
                            "forces: of the finite elements (hybrid); factorised dual snapshots, or they themselves "
                            "(projection) [fe; nnmf if projection]",
                            HycoDuals, &dual, NULL));
  PetscCall(HycoOptionsFor("projection"));
  PetscCall(HycoOptionsInt("-hyco_nnmf_vectors",
                           "vectors of the nonnegative factorisation (0: as many as displacement modes)", 0,
                           PETSC_MAX_INT, &s->vectors, NULL));
  PetscCall(HycoOptionsInt("-hyco_nnmf_max_its", "alternations of the nonnegative factorisation", 1, PETSC_MAX_INT,
                           &s->max_its, NULL));
  PetscOptionsEnd();
  s->dual = (HycoDual)dual;
  HycoCheckModel(s->dual != HYCO_DUAL_FE,
                 "-hyco_dual fe leaves a projection-based model with more forces than modes; use nnmf or snapshots");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where targets are given, with which it is the last resort. */
PetscBool HycoProjectionOffers(HycoReducer t, PetscBool targets)
{
  (void)t;
  return targets;
}

/* Supremizers of unit length: this share of them beyond the modes is round-off. */
#define NEW 1e-8

/* X -= V V^T X twice; V row major. */
static PetscErrorCode RemoveModes(HycoReducer t, PetscInt N, PetscInt n, PetscReal X[])
{
  PetscBLASInt Nb, nb, l;
  const PetscReal one = 1, zero = 0, minus = -1;
  PetscReal *C;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(N, &Nb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(t->l, &l));
  PetscCall(PetscMalloc1(t->l * n, &C));
  for (PetscInt pass = 0; pass < 2; pass++) {
    BLASgemm_("N", "N", &l, &nb, &Nb, &one, t->V_whole, &l, X, &Nb, &zero, C, &l);
    BLASgemm_("T", "N", &Nb, &nb, &l, &minus, t->V_whole, &l, C, &l, &one, X, &Nb);
  }
  PetscCall(PetscFree(C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reducer's modes, their singular values and the snapshots' coefficients, with q more columns of Q (N x q) and of
   these the coefficients QtU (q x n_s column major). Rank 0. */
static PetscErrorCode Append(HycoReducer t, PetscInt N, PetscInt q, const PetscReal Q[], const PetscReal QtU[])
{
  const PetscInt l = t->l, both = l + q;
  PetscReal *V, *VtU, *sigma;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(N * both, &V, both * t->n_s, &VtU, both, &sigma));
  for (PetscInt i = 0; i < N; i++) {
    PetscCall(PetscArraycpy(V + i * both, t->V_whole + i * l, l));
    for (PetscInt j = 0; j < q; j++) V[i * both + l + j] = Q[j * N + i];
  }
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscCall(PetscArraycpy(VtU + k * both, t->VtU + k * l, l));
    PetscCall(PetscArraycpy(VtU + k * both + l, QtU + k * q, q));
  }
  for (PetscInt j = 0; j < both; j++) sigma[j] = j < l ? t->sigma[j] : 0;
  PetscCall(PetscFree(t->V_whole));
  PetscCall(PetscFree(t->VtU));
  PetscCall(PetscFree(t->sigma));
  HycoDuplicate(N * both, V, &t->V_whole);
  HycoDuplicate(both * t->n_s, VtU, &t->VtU);
  HycoDuplicate(both, sigma, &t->sigma);
  PetscCall(PetscFree3(V, VtU, sigma));
  t->l = both;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the supremizers of the dual snapshots add to the modes: the first *q columns of Q. Rank 0. */
static PetscErrorCode FindSupremizers(HycoReducer t, Mat *Q, PetscInt *q)
{
  const PetscInt N = t->sizes[0] * t->sizes[3], n = t->n_s;
  Mat R, X;
  PetscScalar *x;
  PetscReal *size;
  PetscInt found;

  PetscFunctionBegin;
  if (!t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerSupremizers(t, &R, &X));
  PetscCall(MatDestroy(&R));
  PetscCall(PetscMalloc1(PetscMax(n, N), &size));
  PetscCall(MatGetColumnNorms(X, NORM_2, size));
  PetscCall(MatDenseGetArray(X, &x));
  for (PetscInt k = 0; k < n; k++) {
    PetscScalar *column = x + (size_t)k * (size_t)N;

    for (PetscInt i = 0; i < N; i++) column[i] = t->fe->fixed[i] || size[k] == 0 ? 0 : column[i] / size[k];
  }
  PetscCall(RemoveModes(t, N, n, x));
  PetscCall(MatDenseRestoreArray(X, &x));
  PetscCall(HycoReducerPOD(t, X, 0, 0, Q, &found, size));
  while (*q < found && size[*q] > NEW * PetscMax(1, size[0])) (*q)++;
  PetscCall(MatDestroy(&X));
  PetscCall(PetscFree(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q^T of the snapshots, for q columns that rank 0 has: q x n_s column major. */
static PetscErrorCode Coefficients(HycoReducer t, PetscInt N, PetscInt q, const PetscReal Q[], PetscReal QtU[])
{
  PetscInt n_own, *row;
  Mat spread;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(t->S, &n_own, NULL));
  PetscCall(MatCreateDense(HycoComm(t), n_own, PETSC_DECIDE, N, q, NULL, &spread));
  PetscCall(PetscMalloc1(t->rank ? 0 : N, &row));
  for (PetscInt i = 0; i < N && t->rank == 0; i++) row[i] = i;
  for (PetscInt j = 0; j < q && t->rank == 0; j++)
    PetscCall(MatSetValues(spread, N, row, 1, &j, Q + (size_t)j * (size_t)N, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(spread, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(spread, MAT_FINAL_ASSEMBLY));
  PetscCall(HycoReducerMultiply(t, spread, t->S, QtU));
  PetscCall(MatDestroy(&spread));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends to the modes what the supremizers of the dual snapshots add to them, so that l, V_whole, sigma (0 for these)
   and VtU have more columns. */
static PetscErrorCode Enrich(HycoReducer t)
{
  const PetscInt N = t->sizes[0] * t->sizes[3];
  PetscScalar *x = NULL;
  PetscReal *QtU;
  PetscInt q = 0;
  Mat Q = NULL;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(t), FindSupremizers(t, &Q, &q));
  PetscCallMPI(MPI_Bcast(&q, 1, MPIU_INT, 0, HycoComm(t)));
  ((Training)t->training)->n_supremizers = q;
  if (q) {
    PetscCall(PetscMalloc1(q * t->n_s, &QtU));
    if (Q) PetscCall(MatDenseGetArray(Q, &x));
    PetscCall(Coefficients(t, N, q, x, QtU));
    if (t->rank == 0) PetscCall(Append(t, N, q, x, QtU));
    if (Q) PetscCall(MatDenseRestoreArray(Q, &x));
    PetscCall(PetscFree(QtU));
  }
  PetscCall(MatDestroy(&Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionModes(HycoReducer t, HycoSnapshots store)
{
  Training s = (Training)t->training;

  PetscFunctionBegin;
  (void)store;
  s->n_supremizers = 0;
  if (s->dual == HYCO_DUAL_SNAPSHOTS) PetscCall(Enrich(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The n snapshots S, each scaled to unit 2-norm. */
static PetscErrorCode FromSnapshots(HycoROM m, PetscInt n, const PetscReal S[])
{
  HycoProjectionROM p = (HycoProjectionROM)m->data;
  const PetscInt N = m->pairs.n;

  PetscFunctionBegin;
  p->l_lambda = n;
  for (PetscInt j = 0; j < n; j++) {
    PetscReal length = 0;

    for (PetscInt i = 0; i < N; i++) length += S[j * N + i] * S[j * N + i];
    for (PetscInt i = 0; i < N; i++) p->V_lambda[j * N + i] = S[j * N + i] / PetscSqrtReal(length);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V_lambda from the dual snapshots. */
static PetscErrorCode MakeBasis(HycoReducer t, HycoROM m)
{
  HycoProjectionROM p = (HycoProjectionROM)m->data;
  const Training s = (Training)t->training;
  const PetscInt N = m->pairs.n;
  PetscInt n, k;
  PetscReal *S;

  PetscFunctionBegin;
  PetscCall(HycoReducerDualSnapshots(t, &n, &S));
  k = s->vectors ? PetscMin(s->vectors, PetscMin(N, n)) : m->l;
  for (PetscInt i = 0; i < N * n; i++) S[i] = PetscMax(S[i], 0); /* round-off of iterative solves */
  PetscCall(PetscMalloc1(N * PetscMax(n, k) + 1, &p->V_lambda));
  if (p->dual == HYCO_DUAL_SNAPSHOTS)
    PetscCall(FromSnapshots(m, n, S));
  else if (n)
    PetscCall(HycoNNMF(N, n, S, k, s->max_its, p->V_lambda, &p->l_lambda, &p->dual_misfit));
  PetscCall(PetscFree(S));
  m->counts[1] = s->n_supremizers;
  m->counts[0] = t->counts[HYCO_SEED_DUAL] = p->l_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionBuild(HycoROM m, HycoReducer t)
{
  HycoProjectionROM p = (HycoProjectionROM)m->data;

  PetscFunctionBegin;
  p->dual = ((Training)t->training)->dual;
  PetscCall(MakeBasis(t, m));
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoReducerJudge(t, m));
  HycoCheckModel(
      m->numbers[1] < 0.5,
      "the projection-based model misses its own training displacements by %.0f %% on average (%d modes, %d force "
      "vectors, condition %.0e): take more modes (a smaller -hyco_pod_tol)",
      100 * (double)m->numbers[1], (int)m->l, (int)p->l_lambda, (double)m->numbers[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  const HycoProjectionROM p = (HycoProjectionROM)m->data;
  const PetscInt n = ((Training)t->training)->n_supremizers;

  PetscFunctionBegin;
  PetscCall(HycoTrainingAddFact(r, "n_supremizers", (PetscReal)n));
  PetscCall(HycoTrainingAddFact(r, "dual_misfit", p->dual_misfit));
  snprintf(
      r->summary, sizeof(r->summary),
      "projection-based: %d snapshots; %d displacement modes, %d of them supremizers; %d force vectors, which leave "
      "out %.2e of the dual snapshots' energy\n",
      (int)r->n_samples, (int)r->n_modes, (int)n, (int)p->l_lambda, (double)p->dual_misfit);
  PetscFunctionReturn(PETSC_SUCCESS);
}
