/*
  A model under training against stored full-order solutions that it was not trained on: errors, what tells of them
  online, and what an online solve takes. The ranks share the predictions out; of each, every rank makes and compares
  its rows of the whole mesh, and hands the predicting one the solution on the RID.
*/
#include <hycoreducerimpl.h>

const char *const HycoErrorKinds[] = {"u", "u_rid", "sigma", "sigma_11", "lambda", "lambda_rid", "inelastic", NULL};

typedef struct {
  HycoReducer t;
  HycoROM m;
  HycoSnapshots store;
  PetscInt n_fields;                 /* the last of a history alone */
  PetscInt n[3], first[3], width[3]; /* this rank's nodes and cells in the file's order, values of each */
  PetscReal *value[3], *rid[3];      /* of a solution: these fields there, and in the model's mesh */
  PetscSF sf[3];                     /* from these to those */
  PetscReal *coefficient, *U;        /* of a prediction: gamma and the full-order unknowns; its displacement */
} Rows;

static const char *const fields[3] = {"U", "sigma", "inelastic"};

static PetscErrorCode RowsCreate(HycoReducer t, HycoROM m, HycoSnapshots store, Rows *r)
{
  HycoMesh mesh = m->mesh;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(r, sizeof(*r)));
  r->t = t;
  r->m = m;
  r->store = store;
  r->width[0] = t->sizes[3];
  r->width[1] = t->fom->fe->n_sigma;
  r->width[2] = 1;
  r->n_fields = t->scene->n_times ? 3 : 2;
  for (PetscInt k = 0; k < r->n_fields; k++) {
    const PetscInt n_rid = k ? mesh->n_cells : mesh->n_nodes;
    PetscLayout layout;

    PetscCall(PetscLayoutCreateFromSizes(HycoComm(t), PETSC_DECIDE, t->sizes[PetscMin(k, 1)], 1, &layout));
    PetscCall(PetscLayoutGetRange(layout, &r->first[k], &r->n[k]));
    r->n[k] -= r->first[k];
    PetscCall(PetscMalloc2(r->n[k] * r->width[k], &r->value[k], n_rid * r->width[k], &r->rid[k]));
    PetscCall(PetscSFCreate(HycoComm(t), &r->sf[k]));
    PetscCall(PetscSFSetGraphLayout(r->sf[k], layout, n_rid, NULL, PETSC_OWN_POINTER,
                                    k ? mesh->cell_whole : mesh->node_whole));
    PetscCall(PetscLayoutDestroy(&layout));
  }
  PetscCall(PetscMalloc2(m->l + m->n_fe, &r->coefficient, r->n[0] * r->width[0], &r->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RowsDestroy(Rows *r)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n_fields; k++) {
    PetscCall(PetscFree2(r->value[k], r->rid[k]));
    PetscCall(PetscSFDestroy(&r->sf[k]));
  }
  PetscCall(PetscFree2(r->coefficient, r->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* step: the listed time, of a history. */
static PetscErrorCode Read(Rows *r, const PetscReal mu[], PetscInt step)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n_fields; k++)
    PetscCall(HycoSnapshotsReadRows(r->store, mu, step, fields[k], r->first[k] * r->width[k], r->n[k] * r->width[k],
                                    r->value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution at mu: this rank's rows, and what the model's mesh has of it. Collective. */
static PetscErrorCode ReadSolution(Rows *r, const PetscReal mu[], PetscInt step)
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(r->t), Read(r, mu, step));
  for (PetscInt k = 0; k < r->n_fields; k++) {
    PetscMPIInt width;
    MPI_Datatype unit;

    PetscCall(PetscMPIIntCast(r->width[k], &width));
    PetscCallMPI(MPI_Type_contiguous(width, MPIU_REAL, &unit));
    PetscCallMPI(MPI_Type_commit(&unit));
    PetscCall(PetscSFBcastBegin(r->sf[k], unit, r->value[k], r->rid[k], MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(r->sf[k], unit, r->value[k], r->rid[k], MPI_REPLACE));
    PetscCallMPI(MPI_Type_free(&unit));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U = r(u0) + V gamma (30) with the full-order values, of the prediction that rank `of` has: this rank's rows.
   Collective. */
static PetscErrorCode MakeRows(Rows *r, const PetscReal mu[], PetscInt step, PetscMPIInt of)
{
  HycoReducer t = r->t;
  HycoROM m = r->m;
  PetscReal all[HYCO_MAX_PARAMETERS];
  const PetscInt dim = r->width[0], n = r->n[0] * dim;
  const PetscScalar *v;
  PetscInt lda;
  PetscMPIInt count;

  PetscFunctionBegin;
  if (t->rank == of) {
    PetscCall(PetscArraycpy(r->coefficient, m->gamma, m->l));
    for (PetscInt k = 0; k < m->n_fe; k++) r->coefficient[m->l + k] = m->U[m->fe_dof[k]];
  }
  PetscCall(PetscMPIIntCast(m->l + m->n_fe, &count));
  PetscCallMPI(MPI_Bcast(r->coefficient, count, MPIU_REAL, of, HycoComm(t)));
  HycoSceneSetTime(t->scene, mu, t->scene->n_times ? t->scene->times[step] : 0, all);
  PetscCall(HycoFOMSetParameters(t->fom, all));
  PetscCall(HycoReducerToRows(t, HYCO_ON_NODES, MPIU_REAL, dim, t->fom->fe->u0, r->U));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &v));
  for (PetscInt j = 0; j < m->l; j++) {
    for (PetscInt i = 0; i < n; i++) r->U[i] += v[(size_t)j * (size_t)lda + (size_t)i] * r->coefficient[j];
  }
  PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  for (PetscInt k = 0; k < m->n_fe; k++) {
    const PetscInt i = (m->mesh->node_whole[m->fe_dof[k] / dim] - r->first[0]) * dim + m->fe_dof[k] % dim;

    if (i >= 0 && i < n) r->U[i] = r->coefficient[m->l + k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the process that has predicted makes of it. */
static PetscErrorCode CompareRID(Rows *r, const PetscReal mu[], HycoHeldOut *row)
{
  HycoROM m = r->m;
  PetscReal *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsReadRows(r->store, mu, 0, "lambda", 0, m->pairs.n, lambda));
  PetscCall(HycoROMCompareRID(m, r->rid[0], r->rid[1], lambda, &e, &f));
  row->error[HYCO_ERROR_U_RID] = e.u_rid;
  row->error[HYCO_ERROR_SIGMA] = e.sigma;
  row->error[HYCO_ERROR_SIGMA_11] = e.sigma_11;
  row->error[HYCO_ERROR_LAMBDA] = f.lost;
  row->error[HYCO_ERROR_LAMBDA_RID] = f.rid_lost;
  row->size = f.size;
  row->rid_size = f.rid_size;
  PetscCall(PetscFree(lambda));
  if (row->converged > 0) PetscCall(HycoTrustMeasure(m, row->feature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The squares of the displacement that is missed, and of the solution's, over the whole mesh; the solution on the RID.
   Collective. */
static PetscErrorCode MeasureU(Rows *r, const PetscReal mu[], PetscInt step, PetscMPIInt of, PetscReal square[2])
{
  PetscFunctionBegin;
  PetscCall(ReadSolution(r, mu, step));
  PetscCall(MakeRows(r, mu, step, of));
  square[0] = square[1] = 0;
  for (PetscInt i = 0; i < r->n[0] * r->width[0]; i++) {
    square[0] += (r->U[i] - r->value[0][i]) * (r->U[i] - r->value[0][i]);
    square[1] += r->value[0][i] * r->value[0][i];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, square, 2, MPIU_REAL, MPI_SUM, HycoComm(r->t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the process that has predicted makes of listed time `step`, which the model shows. */
static PetscErrorCode MeasureStep(Rows *r, const PetscReal mu[], PetscInt step, const PetscReal square[2],
                                  HycoLost lost[])
{
  PetscReal *lambda;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsReadRows(r->store, mu, step, "lambda", 0, r->m->pairs.n, lambda));
  PetscCall(HycoROMMeasureRID(r->m, r->rid[0], r->rid[1], r->rid[2], lambda, lost));
  lost[HYCO_ERROR_U] = (HycoLost){PetscSqrtReal(square[0]), PetscSqrtReal(square[1])};
  PetscCall(PetscFree(lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A path in short; forces as they are before they are divided by what is large among the held-out paths. */
static PetscErrorCode ConcludePath(HycoROM m, PetscInt n, const HycoLost lost[], HycoHeldOut *row)
{
  HycoPathErrors e;

  PetscFunctionBegin;
  HycoPathErrorsJudge(n, lost, &e);
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) row->error[j] = e.worst[j];
  row->size = e.force;
  row->rid_size = e.force_rid;
  if (e.force > 0) row->error[HYCO_ERROR_LAMBDA] *= e.force;
  if (e.force_rid > 0) row->error[HYCO_ERROR_LAMBDA_RID] *= e.force_rid;
  if (row->converged > 0) PetscCall(HycoTrustMeasure(m, row->feature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last predicted path of rank `of`, at mu, at the listed times that it reached. Collective. */
static PetscErrorCode ComparePath(Rows *r, const PetscReal mu[], PetscMPIInt of, HycoHeldOut *row)
{
  const PetscBool mine = (PetscBool)(r->t->rank == of);
  PetscInt n = r->m->trace.n_listed;
  HycoLost *lost;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, of, HycoComm(r->t)));
  n = PetscMin(n, r->t->scene->n_times);
  PetscCall(PetscCalloc1(n * HYCO_N_ERRORS, &lost));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal square[2];

    HycoOnEach(HycoComm(r->t), mine ? HycoROMSetStep(r->m, k) : PETSC_SUCCESS);
    PetscCall(MeasureU(r, mu, k, of, square));
    HycoOnEach(HycoComm(r->t), mine ? MeasureStep(r, mu, k, square, lost + k * HYCO_N_ERRORS) : PETSC_SUCCESS);
  }
  HycoOnEach(HycoComm(r->t), mine ? ConcludePath(r->m, n, lost, row) : PETSC_SUCCESS);
  PetscCall(PetscFree(lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last prediction of rank `of`, at mu, whose row it is. Collective. */
static PetscErrorCode Compare(Rows *r, const PetscReal mu[], PetscMPIInt of, HycoHeldOut *row)
{
  PetscReal square[2];

  PetscFunctionBegin;
  PetscCall(MeasureU(r, mu, 0, of, square));
  if (r->t->rank == of) row->error[HYCO_ERROR_U] = HycoRelative(PetscSqrtReal(square[0]), PetscSqrtReal(square[1]));
  HycoOnEach(HycoComm(r->t), r->t->rank == of ? CompareRID(r, mu, row) : PETSC_SUCCESS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One held-out point; of a path in the steps that full order took. */
static PetscErrorCode PredictOne(HycoROM m, HycoSnapshots store, const PetscReal mu[])
{
  PetscReal *taken = NULL;
  PetscInt n;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (m->scene->n_times) {
    PetscCall(HycoSnapshotsReadTaken(store, mu, &n, &taken));
    PetscCall(HycoROMSetSteps(m, n, taken));
  }
  ierr = HycoROMPredict(m, m->scene->n_parameters, mu);
  if (taken) PetscCall(HycoROMSetSteps(m, 0, NULL));
  PetscCall(PetscFree(taken));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Predict(HycoROM m, HycoSnapshots store, const PetscReal mu[], PetscInt repeat, HycoHeldOut *row)
{
  PetscFunctionBegin;
  PetscCall(PredictOne(m, store, mu));
  row->seconds[repeat] = m->prediction.seconds.total;
  if (repeat) PetscFunctionReturn(PETSC_SUCCESS);
  row->converged = m->prediction.reason > 0;
  for (PetscInt j = 1; j < HYCO_HELD_REPEATS; j++) row->seconds[j] = row->seconds[0]; /* of a path once */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points first .. last-1 in their order, several times: what a load ramp keeps from one step to the next is kept. */
static PetscErrorCode PredictAgain(HycoROM m, HycoSnapshots store, PetscInt first, PetscInt last, const PetscReal mu[],
                                   HycoHeldOut rows[])
{
  PetscFunctionBegin;
  for (PetscInt r = 1; r < HYCO_HELD_REPEATS; r++) {
    for (PetscInt k = first; k < last; k++) PetscCall(Predict(m, store, mu + k * m->scene->n_parameters, r, &rows[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerPredictHeldOut(HycoReducer t, HycoROM m, HycoSnapshots store, HycoHeldOut rows[])
{
  PetscInt n, n_par, first, last;
  const PetscReal *mu;
  PetscMPIInt size, count;
  Rows r;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->held, &n, &n_par, &mu));
  PetscCallMPI(MPI_Comm_size(HycoComm(t), &size));
  PetscCall(PetscMPIIntCast(n * (PetscInt)(sizeof(*rows) / sizeof(PetscReal)), &count));
  PetscCall(PetscArrayzero(rows, n));
  first = t->rank * n / size;
  last = (t->rank + 1) * n / size;
  PetscCall(RowsCreate(t, m, store, &r));
  for (PetscInt step = 0; step * size < n + size; step++) { /* one point of each rank */
    const PetscInt k = first + step;

    HycoOnEach(HycoComm(t), k < last ? Predict(m, store, mu + k * n_par, 0, &rows[k]) : PETSC_SUCCESS);
    for (PetscMPIInt of = 0; of < size; of++) {
      const PetscInt j = of * n / size + step;

      if (j >= (of + 1) * n / size) continue;
      PetscCall(t->scene->n_times ? ComparePath(&r, mu + j * n_par, of, &rows[j])
                                  : Compare(&r, mu + j * n_par, of, &rows[j]));
    }
  }
  PetscCall(RowsDestroy(&r));
  if (!t->scene->n_times) HycoOnEach(HycoComm(t), PredictAgain(m, store, first, last, mu, rows));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, rows, count, MPIU_REAL, MPI_SUM, HycoComm(t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoHeldOutForce(PetscInt n, const HycoHeldOut rows[])
{
  PetscReal force = 0;

  for (PetscInt k = 0; k < n; k++) force = PetscMax(force, rows[k].size);
  return force;
}

PetscReal HycoHeldOutError(const HycoHeldOut *row, HycoErrorKind kind, PetscReal force)
{
  const PetscBool forces = (PetscBool)(kind == HYCO_ERROR_LAMBDA || kind == HYCO_ERROR_LAMBDA_RID);
  const PetscReal size = kind == HYCO_ERROR_LAMBDA ? row->size : row->rid_size,
                  by = forces ? PetscMax(size, HYCO_SMALL_FORCE * force) : 1;

  if (row->converged < 0.5) return PETSC_INFINITY;
  if (by > 0) return row->error[kind] / by;
  return row->error[kind] > 0 ? PETSC_INFINITY : 0;
}

PetscErrorCode HycoHeldOutSummarise(PetscInt n, const HycoHeldOut rows[], HycoValidation *v)
{
  const PetscReal force = HycoHeldOutForce(n, rows);
  PetscReal *error;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(v, sizeof(*v)));
  v->n = n;
  PetscCall(PetscMalloc1(n, &error));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal seconds[HYCO_HELD_REPEATS];

    v->not_converged += rows[k].converged < 0.5;
    PetscCall(PetscArraycpy(seconds, rows[k].seconds, HYCO_HELD_REPEATS));
    PetscCall(PetscSortReal(HYCO_HELD_REPEATS, seconds));
    v->seconds += seconds[HYCO_HELD_REPEATS / 2] / n;
  }
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    for (PetscInt k = 0; k < n; k++) {
      error[k] = HycoHeldOutError(&rows[k], (HycoErrorKind)j, force);
      if (error[k] > v->largest[j]) {
        v->largest[j] = error[k];
        v->worst[j] = k;
      }
      v->mean[j] += error[k] / n;
    }
    PetscCall(PetscSortReal(n, error));
    v->median[j] = error[n / 2];
  }
  PetscCall(PetscFree(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
