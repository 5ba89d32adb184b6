/*
  Calibration of the estimated errors (trust.c). The training solutions are split into folds; for each, a model like the
  final one (same RID, modes of the other solutions alone) predicts what was held out, and its true errors stand beside
  its features. The law is fitted over held-out and training points and lifted above SHARE of the held-out errors. A
  fold's model knows less than the final one and its points lie farther away: the bound leans to the safe side.
*/
#include <hycoalgorithms.h>
#include <hycofile.h>
#include <hycotrainerimpl.h>
#include <unistd.h>

#define SHARE      0.95
#define MARGIN     1.5  /* on top: held-out points come in few groups, as a load ramp at one radius, and err alike */
#define SMALL      1e-2 /* of a feature's median: its floor */
#define TRIALS     100  /* of a fold's search for full-order unknowns, where the user says nothing */
#define NEGLIGIBLE 1e-3 /* of the errors' median: smaller ones count as that */

/* A prediction of a fold's model: features, errors, whether the point was held out. */
enum { U = HYCO_TRUST_FEATURES, LOST, SIZE, HELD, VALID, N_ROW };

/* The bases again from the present samples, the seeds of the RID kept. */
static PetscErrorCode ReduceAgain(HycoTrainer t, HycoSnapshots store)
{
  const PetscInt n_node = t->n_seeds_node, n_cell = t->n_seeds_cell;
  PetscInt *node = t->seeds_node, *cell = t->seeds_cell;

  PetscFunctionBegin;
  t->seeds_node = t->seeds_cell = NULL;
  PetscCall(HycoTrainerResetBases(t));
  t->seeds_node = node;
  t->seeds_cell = cell;
  t->n_seeds_node = n_node;
  t->n_seeds_cell = n_cell;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  PetscCall(HycoTrainerReduce(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One point: the model's prediction beside the stored solution. */
static PetscErrorCode Measure(HycoModel m, HycoSnapshots store, const PetscReal mu[], PetscBool held, PetscReal row[])
{
  const PetscInt n_dof = m->whole_nodes * m->mesh->dim;
  PetscReal *u, *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(HycoModelPredict(m, m->scene->n_parameters, mu));
  if (m->prediction.reason <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(n_dof, &u, m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsRead(store, mu, "U", n_dof, u));
  PetscCall(HycoSnapshotsRead(store, mu, "lambda", m->pairs.n, lambda));
  PetscCall(HycoModelCompareFields(m, u, NULL, lambda, &e, &f));
  PetscCall(HycoTrustMeasure(m, row));
  row[U] = e.u;
  row[LOST] = f.lost;
  row[SIZE] = f.size;
  row[HELD] = held;
  row[VALID] = !PetscIsInfOrNanReal(e.u) && !PetscIsInfOrNanReal(f.lost);
  PetscCall(PetscFree2(u, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's share of a fold: what is held out, and a part of the rest as large. */
static PetscErrorCode MeasureShare(HycoTrainer t, HycoModel m, HycoSnapshots store, HycoSamples kept, HycoSamples held,
                                   PetscReal *rows)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(t->comm, &size));
  for (PetscInt part = 0; part < 2; part++) {
    PetscInt n, n_par;
    const PetscReal *mu;

    PetscCall(HycoSamplesGet(part ? kept : held, &n, &n_par, &mu));
    for (PetscInt k = 0; k < n; k++, rows += N_ROW) {
      if (k % size != t->rank || (part && k % t->folds)) continue;
      PetscCall(Measure(m, store, mu + k * n_par, (PetscBool)!part, rows));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A fold: a model from what is kept at `file`, and its predictions into rows (n_s x N_ROW). Collective. */
static PetscErrorCode Fold(HycoTrainer t, HycoSnapshots store, HycoSamples kept, HycoSamples held, const char file[],
                           PetscReal rows[])
{
  HycoTraining report = {0};
  HycoModel m = NULL;

  PetscFunctionBegin;
  t->samples = kept;
  PetscCall(HycoSamplesGet(kept, &t->n_s, NULL, NULL));
  PetscCall(ReduceAgain(t, store));
  PetscCall(HycoTrainerBuild(t, PETSC_FALSE, file, &report));
  HycoOnEach(t->comm, HycoModelLoad(file, &m));
  HycoOnEach(t->comm, MeasureShare(t, m, store, kept, held, rows));
  PetscCall(HycoModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AllFolds(HycoTrainer t, HycoSamples samples, HycoSnapshots store, const char file[],
                               PetscReal rows[])
{
  PetscInt n, n_held, n_kept;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  for (PetscInt k = 0; k < t->folds; k++) {
    HycoSamples kept, held;

    PetscCall(HycoSamplesHoldOut(samples, t->folds, k, &kept, &held));
    PetscCall(HycoSamplesGet(held, &n_held, NULL, NULL));
    PetscCall(HycoSamplesGet(kept, &n_kept, NULL, NULL));
    if (n_held && n_kept) PetscCall(Fold(t, store, kept, held, file, rows + k * n * N_ROW));
    t->samples = samples;
    PetscCall(HycoSamplesDestroy(&kept));
    PetscCall(HycoSamplesDestroy(&held));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Median of what is positive among value[0], value[stride], ..., or `otherwise`. */
static PetscErrorCode Median(PetscInt n, const PetscReal value[], PetscInt stride, PetscReal otherwise,
                             PetscReal *median)
{
  PetscReal *positive;
  PetscInt m = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &positive));
  for (PetscInt i = 0; i < n; i++) {
    if (value[i * stride] > 0) positive[m++] = value[i * stride];
  }
  PetscCall(PetscSortReal(m, positive));
  *median = m ? positive[m / 2] : otherwise;
  PetscCall(PetscFree(positive));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The median distance of a training point from the nearest other: the floor of the feature "distance". */
static PetscErrorCode Spacing(HycoTrainer t, PetscReal *spacing)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscReal *nearest;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, &mu));
  PetscCall(PetscCalloc1(n, &nearest));
  for (PetscInt k = 0; n_par && k < n; k++) {
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal d = HycoTrustDistance(t->scene, mu + k * n_par, mu + j * n_par);

      if (d > 0 && (nearest[k] == 0 || d < nearest[k])) nearest[k] = d;
    }
  }
  PetscCall(Median(n, nearest, 1, 1, spacing));
  PetscCall(PetscFree(nearest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law of one error, a column of rows. */
static PetscErrorCode FitError(const HycoTrust *trust, PetscInt n, const PetscReal rows[], const PetscReal error[],
                               PetscReal coefficient[])
{
  const PetscInt p = HYCO_TRUST_FEATURES;
  PetscReal *X, *y, least;
  PetscBool *held;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n * p, &X, n, &y, n, &held));
  PetscCall(Median(n, error, 1, PETSC_SMALL, &least));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < p; j++) X[i * p + j] = PetscLogReal(1 + rows[i * N_ROW + j] / trust->floor[j]);
    y[i] = PetscLogReal(PetscMax(error[i], NEGLIGIBLE * least));
    held[i] = (PetscBool)(rows[i * N_ROW + HELD] > 0.5);
  }
  PetscCall(HycoUpperBound(n, p, X, y, held, SHARE, coefficient));
  coefficient[p] += PetscLogReal(MARGIN);
  PetscCall(PetscFree3(X, y, held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows that are filled, to the front; trust->n: how many of them were held out. */
static PetscInt Compact(PetscInt n, PetscReal rows[], HycoTrust *trust)
{
  PetscInt filled = 0;

  for (PetscInt i = 0; i < n; i++) {
    if (rows[i * N_ROW + VALID] < 0.5) continue;
    trust->n += rows[i * N_ROW + HELD] > 0.5;
    trust->force = PetscMax(trust->force, rows[i * N_ROW + SIZE]);
    for (PetscInt j = 0; j < N_ROW; j++) rows[filled * N_ROW + j] = rows[i * N_ROW + j];
    filled++;
  }
  return filled;
}

static PetscErrorCode FitAll(HycoTrainer t, PetscInt n, PetscReal rows[], HycoTrust *trust)
{
  PetscReal *error;

  PetscFunctionBegin;
  n = Compact(n, rows, trust);
  if (!trust->n) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt j = 0; j < HYCO_TRUST_FEATURES - 1; j++) {
    PetscCall(Median(n, rows + j, N_ROW, 1 / SMALL, &trust->floor[j]));
    trust->floor[j] *= SMALL;
  }
  PetscCall(Spacing(t, &trust->floor[HYCO_TRUST_FEATURES - 1]));
  PetscCall(PetscMalloc1(n, &error));
  for (PetscInt i = 0; i < n; i++) error[i] = rows[i * N_ROW + U];
  PetscCall(FitError(trust, n, rows, error, trust->u));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal size = PetscMax(rows[i * N_ROW + SIZE], HYCO_SMALL_FORCE * trust->force);

    error[i] = size > 0 ? rows[i * N_ROW + LOST] / size : 0;
  }
  PetscCall(FitError(trust, n, rows, error, trust->lambda));
  PetscCall(PetscFree(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fits, and writes the model at `path` once more with it. Rank 0. */
static PetscErrorCode Conclude(HycoTrainer t, PetscInt n, PetscReal rows[], const char path[], PetscInt *n_held)
{
  HycoModel m;
  HycoTrust trust = {0};

  PetscFunctionBegin;
  PetscCall(FitAll(t, n, rows, &trust));
  *n_held = trust.n;
  if (!trust.n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoModelLoad(path, &m));
  m->trust = trust;
  PetscCall(HycoModelRewrite(m, path));
  PetscCall(HycoModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerCalibrate(HycoTrainer t, HycoSnapshots store, const char path[], HycoTraining *report)
{
  HycoSamples samples = t->samples;
  char file[HYCO_FILE_NAME + 16], message[HYCO_LINE];
  PetscBool seed[HYCO_N_SEEDS];
  const PetscInt trials = t->trials;
  PetscErrorCode ierr;
  PetscReal *rows;
  PetscMPIInt count;
  PetscInt n;

  PetscFunctionBegin;
  report->n_held = 0;
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  if (t->type != HYCO_MODEL_HYBRID || t->folds < 2 || n < 4 * t->folds) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMPIIntCast(t->folds * n * N_ROW, &count));
  PetscCall(PetscCalloc1(count, &rows));
  PetscCall(PetscArraycpy(seed, t->seed, HYCO_N_SEEDS));
  PetscCall(PetscSNPrintf(file, sizeof(file), "%s.fold", path));
  if (!trials) t->trials = TRIALS;
  PetscCall(HycoCatchBegin()); /* a fold without a useful model leaves the estimate out; every rank hears the same */
  ierr = AllFolds(t, samples, store, file, rows);
  PetscCall(HycoCatchEnd(ierr, message));
  if (t->rank == 0) (void)unlink(file);
  t->trials = trials;
  t->samples = samples;
  PetscCall(PetscArraycpy(t->seed, seed, HYCO_N_SEEDS));
  PetscCall(HycoCatchNoModel(ierr, message));
  if (message[0]) {
    snprintf(report->no_estimate, sizeof(report->no_estimate), "with a part of the solutions held out: %.900s",
             message);
  } else {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, rows, count, MPIU_REAL, MPI_SUM, t->comm));
    HycoOnRoot(t->comm, Conclude(t, t->folds * n, rows, path, &report->n_held));
    PetscCallMPI(MPI_Bcast(&report->n_held, 1, MPIU_INT, 0, t->comm));
  }
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
