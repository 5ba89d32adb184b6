/*
  The nonnegative basis of the contact forces of a projection-based model (6.3, 6.4), made from the dual snapshots:
  their nonnegative factorisation, by default with as many vectors as there are displacement modes (the extended
  necessary condition l_u >= l_lambda), or the snapshots themselves (Haasdonk, Salomon, Wohlmuth, SIAM J. Numer. Anal.
  50 (2012) 2656-2676). With the snapshots the supremizers are added to the modes, which otherwise would be too few to
  determine the forces.
*/
#include <hycoalgorithms.h>
#include <hycoprojectiontraining.h>
#include <hycotrainers.h>
#include <petscblaslapack.h>

/* Shared by projection and cubature, whose defaults of `dual` the caller has set. Declared here once: the help shows
   one entry for both types. */
PetscErrorCode HycoForceBasisSetFromOptions(HycoReducer t)
{
  HycoForceBasis s = (HycoForceBasis)t->training;
  PetscInt dual = (PetscInt)s->dual;

  PetscFunctionBegin;
  s->max_its = 100;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor(""));
  PetscCall(
      HycoOptionsWord("-hyco_dual",
                      "contact forces: finite-element multipliers (hybrid, cubature), or combinations of factorised "
                      "dual snapshots or of the dual snapshots (projection, cubature) [fe; nnmf if projection]",
                      HycoDuals, &dual, NULL));
  /* The help lists them under these types; others refuse them. */
  PetscCall(HycoOptionsFor("projection or cubature"));
  PetscCall(HycoOptionsInt("-hyco_nnmf_vectors",
                           "number of vectors of the nonnegative factorisation (0: that of the displacement modes)", 0,
                           PETSC_MAX_INT, &s->vectors, NULL));
  PetscCall(HycoOptionsInt("-hyco_nnmf_max_its", "iterations of the nonnegative factorisation", 1, PETSC_MAX_INT,
                           &s->max_its, NULL));
  PetscOptionsEnd();
  s->dual = (HycoDual)dual;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nonnegative vectors are the default: few unknowns. The store of settings is freed with the training. */
static PetscErrorCode SetFromOptions(HycoReducer t)
{
  HycoForceBasis s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  s->dual = HYCO_DUAL_NNMF;
  PetscCall(HycoForceBasisSetFromOptions(t));
  /* With a multiplier per contact V^T B^T has fewer rows than columns: forces would not be unique. */
  HycoCheckModel(s->dual != HYCO_DUAL_FE,
                 "-hyco_dual fe leaves a projection-based model with more forces than modes; use nnmf or snapshots");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Offered as a last resort if targets are given. It may need more modes than a hybrid model and assembles the
   whole mesh: only for a user who insists on targets. */
static PetscBool ForceBasisIsOffered(HycoReducer t, PetscBool targets, size_t length, char why[])
{
  (void)t, (void)length, (void)why;
  return targets;
}

#define NEW_SUPREMIZER 1e-8 /* of a supremizer's length 1, what is outside the modes: the square root of eps */

/* X -= V V^T X twice. */
static PetscErrorCode RemoveModes(HycoReducer t, Mat X)
{
  PetscBLASInt rows, n, l, lda[2];
  const PetscReal one = 1, minus = -1;
  const PetscScalar *v;
  PetscInt n_own, n_columns, ld[2];
  PetscScalar *x;
  PetscReal *C;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(X, &n_own, NULL));
  PetscCall(MatGetSize(X, NULL, &n_columns));
  PetscCall(MatDenseGetLDA(t->V, &ld[0]));
  PetscCall(MatDenseGetLDA(X, &ld[1]));
  PetscCall(PetscBLASIntCast(n_own, &rows));
  PetscCall(PetscBLASIntCast(n_columns, &n));
  PetscCall(PetscBLASIntCast(t->l, &l));
  for (int k = 0; k < 2; k++) PetscCall(PetscBLASIntCast(PetscMax(1, ld[k]), &lda[k]));
  PetscCall(PetscMalloc1(t->l * n_columns, &C));
  /* Once leaves round-off of the large part, of which a nearly dependent column would consist. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    PetscCall(HycoReducerMultiply(t, t->V, X, C));
    PetscCall(MatDenseGetArrayRead(t->V, &v));
    PetscCall(MatDenseGetArray(X, &x));
    BLASgemm_("N", "N", &rows, &n, &l, &minus, v, &lda[0], C, &l, &one, x, &lda[1]);
    PetscCall(MatDenseRestoreArray(X, &x));
    PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  }
  PetscCall(PetscFree(C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends q columns of Q to the reducer's modes, with their singular values and the snapshots' coefficients, of
   which QtU are those of Q (n_q x n_s column major). */
static PetscErrorCode ForceBasisAppend(HycoReducer t, PetscInt q, Mat Q, PetscInt n_q, const PetscReal QtU[])
{
  const PetscInt l = t->l, both = l + q;
  PetscReal *VtU, *sigma;
  PetscInt rows;
  Mat V;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(t->V, &rows, NULL));
  PetscCall(MatCreateDense(HycoComm(t), rows, PETSC_DECIDE, t->sizes[0] * t->sizes[3], both, NULL, &V));
  PetscCall(HycoCopyColumns(t->V, l, V, 0));
  PetscCall(HycoCopyColumns(Q, q, V, l));
  PetscCall(HycoMatAssemble(V));
  PetscCall(PetscMalloc1(both * t->n_s, &VtU));
  PetscCall(PetscMalloc1(both, &sigma));
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscCall(PetscArraycpy(VtU + k * both, t->VtU + k * l, l));
    PetscCall(PetscArraycpy(VtU + k * both + l, QtU + k * n_q, q));
  }
  /* Zero marks them as no modes of the POD (HycoROMCountPOD()). */
  for (PetscInt j = 0; j < both; j++) sigma[j] = j < l ? t->sigma[j] : 0;
  PetscCall(MatDestroy(&t->V));
  HycoFreeAll(&t->VtU, &t->sigma);
  t->V = V;
  t->VtU = VtU;
  t->sigma = sigma;
  t->l = both;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The basis and the result of ProjectBatch(). */
typedef struct {
  Mat Q;
  PetscInt n;
  PetscReal *QtU;
} Projected;

/* A HycoBatchUse: Q^T of displacements. */
static PetscErrorCode ProjectBatch(HycoReducer t, PetscInt first, Mat S, void *ctx)
{
  Projected *p = (Projected *)ctx;

  PetscFunctionBegin;
  PetscCall(HycoReducerMultiply(t, p->Q, S, p->QtU + (size_t)first * (size_t)p->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends to the modes the components of the supremizers of the dual snapshots that are orthogonal to them: l, V, sigma
   (0 for these) and VtU then have more columns. Supremizers keep the reduced saddle-point problem solvable (Ballarin et
   al. 2015): each force vector has a displacement that it works on. */
static PetscErrorCode ForceBasisEnrich(HycoReducer t)
{
  PetscReal *QtU, *size;
  PetscInt found, q = 0;
  Mat forces, all, X, Q;

  PetscFunctionBegin;
  if (!t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerSupremizers(t, &forces, &all));
  PetscCall(MatDestroy(&forces));
  PetscCall(HycoReducerUnitRows(t, all, &X));
  PetscCall(MatDestroy(&all));
  PetscCall(RemoveModes(t, X));
  PetscCall(PetscMalloc1(t->n_s + 1, &size));
  PetscCall(HycoReducerPOD(t, X, 0, 0, &Q, &found, size));
  /* Columns had unit length: singular values are shares. */
  while (q < found && size[q] > NEW_SUPREMIZER * PetscMax(1, size[0])) q++;
  PetscCall(PetscFree(size));
  PetscCall(MatDestroy(&X));
  ((HycoForceBasis)t->training)->n_supremizers = q;
  if (q) {
    PetscCall(PetscMalloc1(found * t->n_s, &QtU));
    PetscCall(HycoReducerEachBatch(t, ProjectBatch, &(Projected){Q, found, QtU}));
    PetscCall(ForceBasisAppend(t, q, Q, found, QtU));
    PetscCall(PetscFree(QtU));
  }
  PetscCall(MatDestroy(&Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the RID: modes and coefficients must be complete when the model is made. */
PetscErrorCode HycoProjectionModes(HycoReducer t, HycoSnapshots store)
{
  HycoForceBasis s = (HycoForceBasis)t->training;

  PetscFunctionBegin;
  (void)store;
  s->n_supremizers = 0;
  if (s->dual == HYCO_DUAL_SNAPSHOTS) PetscCall(ForceBasisEnrich(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The n snapshots S, each scaled to unit 2-norm. */
static PetscErrorCode FromSnapshots(HycoROM m, PetscInt n, const PetscReal S[])
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  const PetscInt N = m->model->pairs.n;

  PetscFunctionBegin;
  p->l_lambda = n;
  for (PetscInt j = 0; j < n; j++) {
    PetscReal length = 0;

    for (PetscInt i = 0; i < N; i++) length += S[j * N + i] * S[j * N + i];
    /* Scaling keeps a vector nonnegative, and its coefficient is then a force. */
    for (PetscInt i = 0; i < N; i++) p->V_lambda[j * N + i] = S[j * N + i] / PetscSqrtReal(length);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many vectors as displacement modes by default: with more, V_lambda^T B V would have dependent rows. */
PetscErrorCode HycoProjectionMakeBasis(HycoROM m, HycoReducer t)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  const HycoForceBasis s = (HycoForceBasis)t->training;
  const PetscInt N = m->model->pairs.n;
  PetscInt n, k;
  PetscReal *S;

  PetscFunctionBegin;
  p->dual = s->dual;
  /* Without snapshots that are zero. */
  PetscCall(HycoReducerDualSnapshots(t, &n, &S));
  /* No more than the rank of the snapshots. */
  k = s->vectors ? PetscMin(s->vectors, PetscMin(N, n)) : m->model->l;
  for (PetscInt i = 0; i < N * n; i++) S[i] = PetscMax(S[i], 0); /* negative by round-off of iterative solves */
  PetscCall(PetscMalloc1(N * PetscMax(n, k) + 1, &p->V_lambda));
  if (p->dual == HYCO_DUAL_SNAPSHOTS)
    PetscCall(FromSnapshots(m, n, S));
  else if (n && p->dual == HYCO_DUAL_NNMF)
    PetscCall(HycoNNMF(N, n, S, k, s->max_its, p->V_lambda, &p->l_lambda, &p->dual_misfit));
  PetscCall(PetscFree(S));
  m->model->counts[1] = s->n_supremizers;
  m->model->counts[0] = t->counts[HYCO_SEED_DUAL] = p->l_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model that misses its own training solutions by half is no model, whatever its held-out errors would be. */
PetscErrorCode HycoProjectionJudge(HycoROM m, HycoReducer t)
{
  const HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  char worst[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(HycoReducerJudge(t, m));
  /* Negated: an error that is not a number is refused too. */
  if (!(m->model->numbers[1] < 0.5)) HycoReducerNameWorst(t, worst);
  HycoCheckModel(m->model->numbers[1] < 0.5,
                 "the %s model misses its own training displacements by %.0f %% on average (%d modes, %d force "
                 "vectors, condition %.0e)%s: use more modes (a smaller -hyco_pod_tol)%s",
                 m->model->traits.title, 100 * (double)m->model->numbers[1], (int)m->model->l, (int)p->l_lambda,
                 (double)m->model->numbers[0], worst,
                 m->model->traits.cells ? ", or more cells (a smaller -hyco_cubature_tol)" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No full-order unknown: HYCO_HYBRID_CONTACT with an empty set. */
static PetscErrorCode ForceBasisBuild(HycoROM m, HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoProjectionMakeBasis(m, t));
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoProjectionJudge(m, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* dual_misfit is the part of the forces that no combination of the vectors represents. */
PetscErrorCode HycoProjectionReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  const HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  const PetscInt n = ((HycoForceBasis)t->training)->n_supremizers;

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

/* HycoGalerkinFinish() scans the ranges for a singular reduced stiffness, as for hybrid models. */
PetscErrorCode HycoTrainerCreate_Projection(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  *ops = (HycoTrainerOps){.setfromoptions = SetFromOptions,
                          .modes = HycoProjectionModes,
                          .build = ForceBasisBuild,
                          .finish = HycoGalerkinFinish,
                          .report = HycoProjectionReport,
                          .cost = HycoGalerkinCost,
                          .offers = ForceBasisIsOffered};
  PetscFunctionReturn(PETSC_SUCCESS);
}
