/*
  Compares a model in training with stored full-order solutions that were not used for its training: errors, features of
  the error estimates, and online times. The ranks share the predictions; for each, every rank computes and compares its
  rows of the whole mesh, and sends the solution on the RID to the predicting rank.
*/
#include <hycocomparison.h>
#include <hycoreducerimpl.h>

const char *const HycoErrorKinds[] = {"u", "u_rid", "sigma", "sigma_11", "lambda", "lambda_rid", "inelastic", NULL};

typedef struct {
  HycoReducer t;
  HycoSamples points;
  HycoROM m;
  HycoSnapshots store;
  HycoComparison c;
} Rows;

static const char *const fields[HYCO_COMPARED] = {"U", "sigma", "inelastic"};

/* Reads a solution; step: the listed time, with a history. Each rank its rows of the fields; all ranks have the
   file open. */
static PetscErrorCode HeldOutRead(Rows *r, const PetscReal mu[], PetscInt step)
{
  HycoComparison *c = &r->c;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_fields; k++)
    PetscCall(HycoSnapshotsReadRows(r->store, mu, step, fields[k], c->first[k] * c->width[k], c->n[k] * c->width[k],
                                    c->value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The comparison on the RID, on the predicting process. Only where the prediction was made: the model's mesh and
   its contacts are on one process. Forces' errors stay absolute until the largest of all points is known. */
static PetscErrorCode CompareRID(Rows *r, const PetscReal mu[], HycoHeldOut *row)
{
  HycoROM m = r->m;
  PetscReal *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->model->pairs.n, &lambda));
  PetscCall(HycoSnapshotsReadRows(r->store, mu, 0, "lambda", 0, m->model->pairs.n, lambda));
  PetscCall(HycoROMCompareRID(m, r->c.rid[0], r->c.rid[1], lambda, &e, &f));
  row->error[HYCO_ERROR_U_RID] = e.u_rid;
  row->error[HYCO_ERROR_SIGMA] = e.sigma;
  row->stress = e.sigma_norm2;
  row->error[HYCO_ERROR_SIGMA_11] = e.sigma_11;
  row->error[HYCO_ERROR_LAMBDA] = f.lost;
  row->error[HYCO_ERROR_LAMBDA_RID] = f.rid_lost;
  row->size = f.size;
  row->rid_size = f.rid_size;
  PetscCall(PetscFree(lambda));
  /* Features of a diverged solution would be fitted to. */
  if (row->converged > 0) PetscCall(HycoEstimatesFeatures(m, row->feature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The squares of the displacement's error, and of the solution, over the whole mesh; and the solution on the RID.
   Collective. The part's fe is moved to mu: its lifting and supports are those of the point. */
static PetscErrorCode MeasureU(Rows *r, const PetscReal mu[], PetscInt step, PetscMPIInt of, PetscReal square[2])
{
  HycoReducer t = r->t;
  PetscReal all[HYCO_MAX_PARAMETERS];
  const PetscScalar *V;
  PetscInt lda;

  PetscFunctionBegin;
  /* Each rank reads its rows of the stored solution. */
  HycoOnEach(HycoComm(t), HeldOutRead(r, mu, step));
  PetscCall(HycoComparisonBring(&r->c));
  HycoSceneSetTime(t->scene, mu, t->scene->n_times ? t->scene->times[step] : 0, all);
  PetscCall(HycoFOMSetParameters(t->fom, all));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &V));
  /* The model's displacement on all rows, from its coefficients and V, without the whole mesh on one rank. */
  PetscCall(HycoComparisonPredict(&r->c, r->m, of, V, lda));
  PetscCall(MatDenseRestoreArrayRead(t->V, &V));
  PetscCall(HycoComparisonSquares(&r->c, square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The comparison at listed time `step`, which the model has selected, on the predicting process. */
static PetscErrorCode MeasureStep(Rows *r, const PetscReal mu[], PetscInt step, const PetscReal square[2],
                                  HycoErrorNorm lost[])
{
  PetscReal *lambda;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->m->model->pairs.n, &lambda));
  PetscCall(HycoSnapshotsReadRows(r->store, mu, step, "lambda", 0, r->m->model->pairs.n, lambda));
  PetscCall(HycoROMMeasureRID(r->m, r->c.rid[0], r->c.rid[1], r->c.rid[2], lambda, lost));
  /* Squares of the whole mesh, which all ranks have summed. */
  lost[HYCO_ERROR_U] = (HycoErrorNorm){PetscSqrtReal(square[0]), PetscSqrtReal(square[1])};
  HycoTraceExcludeDisplacements(r->m, step, lost);
  /* Forces that are not unique differ without an error. */
  if (r->m->trace.history.step[step].n_dependent > 0)
    lost[HYCO_ERROR_LAMBDA].lost = lost[HYCO_ERROR_LAMBDA_RID].lost = 0;
  PetscCall(PetscFree(lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the errors of a path; those of forces before the division that depends on all held-out paths. */
static PetscErrorCode ConcludePath(HycoROM m, PetscInt n, const HycoErrorNorm lost[], HycoHeldOut *row)
{
  HycoPathErrors e;

  PetscFunctionBegin;
  HycoPathErrorsJudge(n, lost, &e);
  row->size = e.force;
  row->rid_size = e.force_rid;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    const PetscReal force = j == HYCO_ERROR_LAMBDA       ? e.force
                            : j == HYCO_ERROR_LAMBDA_RID ? e.force_rid
                                                         : 0,
                    by = force > 0 ? force : 1;

    /* HycoPathErrors divides by the path's own forces; here that is taken back. */
    row->error[j] = e.worst[j] * by;
    row->end[j] = e.end[j] * by;
  }
  if (row->converged > 0) PetscCall(HycoEstimatesFeatures(m, row->feature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares the last predicted path of rank `of`, at mu, at the listed times that it reached. Collective. */
static PetscErrorCode ComparePath(Rows *r, const PetscReal mu[], PetscMPIInt of, HycoHeldOut *row)
{
  const PetscBool mine = (PetscBool)(r->t->rank == of);
  PetscInt n = r->m->trace.n_listed;
  HycoErrorNorm *lost;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, of, HycoComm(r->t)));
  /* A path that ended early was compared as far as it came. */
  n = PetscMin(n, r->t->scene->n_times);
  PetscCall(PetscCalloc1(n * HYCO_N_ERRORS, &lost));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal square[2];

    /* An error of the one rank that predicts must end the comparison on all. */
    HycoOnEach(HycoComm(r->t), mine ? HycoROMSetStep(r->m, k) : PETSC_SUCCESS);
    PetscCall(MeasureU(r, mu, k, of, square));
    HycoOnEach(HycoComm(r->t), mine ? MeasureStep(r, mu, k, square, lost + k * HYCO_N_ERRORS) : PETSC_SUCCESS);
  }
  if (mine) row->loose = r->m->prediction.loose && row->converged > 0;
  HycoOnEach(HycoComm(r->t), mine ? ConcludePath(r->m, n, lost, row) : PETSC_SUCCESS);
  PetscCall(PetscFree(lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares the last prediction of rank `of`, at mu; the row belongs to that rank. Collective. */
static PetscErrorCode HeldOutCompare(Rows *r, const PetscReal mu[], PetscMPIInt of, HycoHeldOut *row)
{
  PetscReal square[2];

  PetscFunctionBegin;
  PetscCall(MeasureU(r, mu, 0, of, square));
  if (r->t->rank == of) row->error[HYCO_ERROR_U] = HycoRelative(PetscSqrtReal(square[0]), PetscSqrtReal(square[1]));
  HycoOnEach(HycoComm(r->t), r->t->rank == of ? CompareRID(r, mu, row) : PETSC_SUCCESS);
  /* Of an arbitrary position there is no error: full order has chosen another one. */
  if (r->t->rank == of && r->m->prediction.loose && r->m->prediction.reason > 0) {
    row->error[HYCO_ERROR_U] = row->error[HYCO_ERROR_U_RID] = 0;
    row->loose = 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The steps are reset also after an error: they are borrowed from `taken`, which is freed here. */
PetscErrorCode HycoHeldOutPredict(HycoROM m, HycoSnapshots store, const PetscReal mu[])
{
  PetscReal *taken = NULL, time_error;
  PetscInt n;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (m->model->scene->n_times) {
    PetscCall(HycoSnapshotsReadTaken(store, mu, &n, &taken, &time_error));
    /* Full order's own steps: otherwise the error would include that of different steps in time. */
    PetscCall(HycoROMSetJudgedSteps(m, n, taken));
  }
  ierr = HycoROMPredict(m, m->model->scene->n_parameters, mu);
  if (taken) PetscCall(HycoROMSetSteps(m, 0, NULL));
  PetscCall(PetscFree(taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A repetition measures time alone; the median counts, because the machine may be busy at one of them. */
static PetscErrorCode HeldOutPredict(HycoROM m, HycoSnapshots store, const PetscReal mu[], PetscInt repeat,
                                     HycoHeldOut *row)
{
  PetscFunctionBegin;
  PetscCall(HycoHeldOutPredict(m, store, mu));
  row->seconds[repeat] = m->prediction.seconds.cpu;
  if (repeat) PetscFunctionReturn(PETSC_SUCCESS);
  row->converged = m->prediction.reason > 0;
  for (PetscInt j = 1; j < HYCO_HELD_REPEATS; j++) row->seconds[j] = row->seconds[0]; /* a path is predicted once */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicts points first .. last-1 in their order, several times, with the data that a load ramp keeps from one step
   to the next. */
static PetscErrorCode PredictAgain(HycoROM m, HycoSnapshots store, PetscInt first, PetscInt last, const PetscReal mu[],
                                   HycoHeldOut rows[])
{
  PetscFunctionBegin;
  for (PetscInt r = 1; r < HYCO_HELD_REPEATS; r++) {
    for (PetscInt k = first; k < last; k++)
      PetscCall(HeldOutPredict(m, store, mu + k * m->model->scene->n_parameters, r, &rows[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Divides errors of stresses below a share of the largest of the set by that share, as those of forces: a body that
   only moves has the stress of round-off. */
static void GuardStress(PetscInt n, HycoHeldOut rows[])
{
  PetscReal largest = 0;

  for (PetscInt k = 0; k < n; k++) largest = PetscMax(largest, rows[k].stress);
  for (PetscInt k = 0; k < n; k++) {
    if (rows[k].stress > 0 && rows[k].stress < HYCO_SMALL_FORCE * largest)
      rows[k].error[HYCO_ERROR_SIGMA] *= rows[k].stress / (HYCO_SMALL_FORCE * largest);
  }
}

/* Points of a scene without a history: a block of them for each rank, one point of each block at a time. */
static PetscErrorCode PredictPoints(Rows *r, HycoHeldOut rows[])
{
  HycoReducer t = r->t;
  PetscInt n, n_par, first, last;
  const PetscReal *mu;
  PetscMPIInt size, count;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(r->points, &n, &n_par, &mu));
  PetscCallMPI(MPI_Comm_size(HycoComm(t), &size));
  PetscCall(PetscMPIIntCast(n * (PetscInt)(sizeof(*rows) / sizeof(PetscReal)), &count));
  /* Blocks of neighbours: they share a stiffness, whose factor the rank keeps. */
  first = t->rank * n / size;
  last = (t->rank + 1) * n / size;
  for (PetscInt step = 0; step * size < n + size; step++) {
    const PetscInt k = first + step;

    HycoOnEach(HycoComm(t), k < last ? HeldOutPredict(r->m, r->store, mu + k * n_par, 0, &rows[k]) : PETSC_SUCCESS);
    for (PetscMPIInt of = 0; of < size; of++) {
      /* Every rank compares every point: its rows of the whole mesh. */
      const PetscInt j = of * n / size + step;

      if (j < (of + 1) * n / size) PetscCall(HeldOutCompare(r, mu + j * n_par, of, &rows[j]));
    }
  }
  HycoOnEach(HycoComm(t), PredictAgain(r->m, r->store, first, last, mu, rows));
  /* HycoHeldOut consists of PetscReal alone; rows of other ranks are 0 here. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, rows, count, MPIU_REAL, MPI_SUM, HycoComm(t)));
  GuardStress(n, rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether it ends the race. */
static PetscBool HeldOutHasLost(const HycoHeldOutEarlyStop *race, const HycoHeldOut *row)
{
  if (race->all) return PETSC_FALSE;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    if (race->target[j] > 0 && HycoAttemptsQuotient(race->target[j], race->limit[j],
                                                    HycoHeldOutError(row, (HycoErrorKind)j, race->force)) > race->most)
      return PETSC_TRUE;
  }
  return (PetscBool)(row->converged < 0.5);
}

/* Held-out paths in the order of the race, one for each rank at a time. Those after the one that ends it are
   ignored, so that the result does not depend on the number of ranks. */
static PetscErrorCode PredictPaths(Rows *r, HycoHeldOutEarlyStop *race, HycoHeldOut rows[])
{
  HycoReducer t = r->t;
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(r->points, &n, &n_par, &mu));
  while (race->n < n && !race->lost) {
    const PetscInt here = PetscMin(HycoSize(HycoComm(t)), n - race->n), *point = race->order + race->n,
                   mine = t->rank < here ? point[t->rank] : -1;

    HycoOnRoot(HycoComm(t), HycoReducerTell(t, "held-out paths", race->n, n));
    /* As many paths at once as ranks; those after a lost one were predicted in vain. */
    HycoOnEach(HycoComm(t),
               mine < 0 ? PETSC_SUCCESS : HeldOutPredict(r->m, r->store, mu + mine * n_par, 0, &rows[mine]));
    for (PetscMPIInt of = 0; of < here; of++) {
      HycoHeldOut *row = &rows[point[of]];

      if (race->lost) {
        PetscCall(PetscMemzero(row, sizeof(*row)));
        continue;
      }
      PetscCall(ComparePath(r, mu + point[of] * n_par, of, row));
      PetscCallMPI(MPI_Bcast(row, (PetscMPIInt)(sizeof(*row) / sizeof(PetscReal)), MPIU_REAL, of, HycoComm(t)));
      race->n++;
      race->lost = HeldOutHasLost(race, row);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All of them, in their order. A race without an end, in the order of the points. */
static PetscErrorCode PredictAllPaths(Rows *r, PetscInt n, HycoHeldOut rows[])
{
  HycoHeldOutEarlyStop race = {.all = PETSC_TRUE};

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &race.order));
  for (PetscInt k = 0; k < n; k++) race.order[k] = k;
  HycoFinally(PredictPaths(r, &race, rows), PetscCall(PetscFree(race.order)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rows[] has a place for every point; collective, as fields are compared by the ranks that have them. */
PetscErrorCode HycoReducerPredictHeldOut(HycoReducer t, HycoSamples points, HycoROM m, HycoSnapshots store,
                                         HycoHeldOutEarlyStop *race, HycoHeldOut rows[])
{
  Rows r = {t, points, m, store, {0}};
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(points, &n, NULL, NULL));
  /* Rows of points that a race leaves out stay 0: not predicted. */
  PetscCall(PetscArrayzero(rows, n));
  PetscCall(HycoComparisonCreate(t->fom, m, &r.c));
  if (!t->scene->n_times)
    PetscCall(PredictPoints(&r, rows));
  else
    PetscCall(race ? PredictPaths(&r, race, rows) : PredictAllPaths(&r, n, rows));
  PetscCall(HycoComparisonDestroy(&r.c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest force of the set, of which a tenth is the least denominator of errors: where contact just begins any
   relative error is large. */
PetscReal HycoHeldOutForce(PetscInt n, const HycoHeldOut rows[])
{
  PetscReal force = 0;

  for (PetscInt k = 0; k < n; k++) force = PetscMax(force, rows[k].size);
  return force;
}

/* One of row->error or row->end, after division. Forces are divided by the larger of their own size and a share of the
   largest of all points: where a contact just closes any error would be infinite. */
static PetscReal HeldOutDivided(const HycoHeldOut *row, HycoErrorKind kind, PetscReal force, PetscReal error)
{
  const PetscBool forces = (PetscBool)(kind == HYCO_ERROR_LAMBDA || kind == HYCO_ERROR_LAMBDA_RID);
  const PetscReal size = kind == HYCO_ERROR_LAMBDA ? row->size : row->rid_size,
                  by = forces ? PetscMax(size, HYCO_SMALL_FORCE * force) : 1;

  if (row->converged < 0.5) return PETSC_INFINITY;
  /* Where the position of a body is arbitrary, displacements are compared at no time with loads. */
  if (row->loose > 0 && (kind == HYCO_ERROR_U || kind == HYCO_ERROR_U_RID) && error == 0) return NAN;
  if (by > 0) return error / by;
  return error > 0 ? PETSC_INFINITY : 0;
}

PetscReal HycoHeldOutError(const HycoHeldOut *row, HycoErrorKind kind, PetscReal force)
{
  return HeldOutDivided(row, kind, force, row->error[kind]);
}

/* Infinite errors make the mean infinite, the median of the others stays. Points that were not compared (NaN) do not
   enter; where none was, nor do they have a value. */
PetscErrorCode HycoHeldOutSummarise(PetscInt n, const HycoHeldOut rows[], PetscReal force, HycoValidation *v)
{
  PetscReal *error;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(v, sizeof(*v)));
  v->n = n;
  PetscCall(PetscMalloc1(n, &error));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal seconds[HYCO_HELD_REPEATS];

    v->not_converged += rows[k].converged < 0.5;
    v->loose += rows[k].loose > 0;
    PetscCall(PetscArraycpy(seconds, rows[k].seconds, HYCO_HELD_REPEATS));
    PetscCall(PetscSortReal(HYCO_HELD_REPEATS, seconds));
    /* The median of the repeats: the first one touches cold memory. */
    v->seconds += seconds[HYCO_HELD_REPEATS / 2] / n;
  }
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    PetscInt m = 0;

    for (PetscInt k = 0; k < n; k++) {
      error[m] = HycoHeldOutError(&rows[k], (HycoErrorKind)j, force);
      if (PetscIsNanReal(error[m])) continue;
      v->end[j] = PetscMax(v->end[j], HeldOutDivided(&rows[k], (HycoErrorKind)j, force, rows[k].end[j]));
      if (error[m] > v->largest[j]) {
        v->largest[j] = error[m];
        v->worst[j] = k;
      }
      v->mean[j] += error[m++];
    }
    PetscCall(PetscSortReal(m, error));
    v->mean[j] /= PetscMax(m, 1);
    /* Infinite errors sort last. */
    v->median[j] = m ? error[m / 2] : 0;
    if (n && !m) v->median[j] = v->largest[j] = v->end[j] = v->mean[j] = NAN;
  }
  PetscCall(PetscFree(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
