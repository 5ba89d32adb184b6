/*
  A model under training against stored full-order solutions that it was not trained on: errors, what tells of them
  online, and what an online solve takes. The ranks share the predictions out; of each, every rank makes and compares
  its rows of the whole mesh, and hands the predicting one the solution on the RID.
*/
#include <hycocomparison.h>
#include <hycoreducerimpl.h>

const char *const HycoErrorKinds[] = {"u", "u_rid", "sigma", "sigma_11", "lambda", "lambda_rid", NULL};

static PetscErrorCode Read(HycoComparison *c, HycoSnapshots store, const PetscReal mu[])
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++)
    PetscCall(HycoSnapshotsReadRows(store, mu, k ? "sigma" : "U", c->first[k] * c->width[k], c->n[k] * c->width[k],
                                    c->value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the process that has predicted makes of it. */
static PetscErrorCode CompareRID(const HycoComparison *c, HycoROM m, HycoSnapshots store, const PetscReal mu[],
                                 HycoHeldOut *row)
{
  PetscReal *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsReadRows(store, mu, "lambda", 0, m->pairs.n, lambda));
  PetscCall(HycoROMCompareRID(m, c->rid[0], c->rid[1], lambda, &e, &f));
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

/* The last prediction of rank `of`, at mu, whose row it is. Collective. */
static PetscErrorCode Compare(HycoComparison *c, HycoReducer t, HycoROM m, HycoSnapshots store, const PetscReal mu[],
                              PetscMPIInt of, HycoHeldOut *row)
{
  const PetscScalar *V;
  PetscInt lda;
  PetscReal error;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), Read(c, store, mu));
  PetscCall(HycoComparisonBring(c));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &V));
  PetscCall(HycoComparisonPredict(c, m, of, V, lda));
  PetscCall(MatDenseRestoreArrayRead(t->V, &V));
  PetscCall(HycoComparisonError(c, &error));
  if (t->rank == of) row->error[HYCO_ERROR_U] = error;
  HycoOnEach(HycoComm(t), t->rank == of ? CompareRID(c, m, store, mu, row) : PETSC_SUCCESS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Predict(HycoROM m, const PetscReal mu[], PetscInt repeat, HycoHeldOut *row)
{
  PetscFunctionBegin;
  PetscCall(HycoROMPredict(m, m->scene->n_parameters, mu));
  row->seconds[repeat] = m->prediction.seconds.total;
  if (!repeat) row->converged = m->prediction.reason > 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points first .. last-1 in their order, several times: what a load ramp keeps from one step to the next is kept. */
static PetscErrorCode PredictAgain(HycoROM m, PetscInt first, PetscInt last, const PetscReal mu[], HycoHeldOut rows[])
{
  PetscFunctionBegin;
  for (PetscInt r = 1; r < HYCO_HELD_REPEATS; r++) {
    for (PetscInt k = first; k < last; k++) PetscCall(Predict(m, mu + k * m->scene->n_parameters, r, &rows[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerPredictHeldOut(HycoReducer t, HycoROM m, HycoSnapshots store, HycoHeldOut rows[])
{
  PetscInt n, n_par, first, last;
  const PetscReal *mu;
  PetscMPIInt size, count;
  HycoComparison c;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->held, &n, &n_par, &mu));
  PetscCallMPI(MPI_Comm_size(HycoComm(t), &size));
  PetscCall(PetscMPIIntCast(n * (PetscInt)(sizeof(*rows) / sizeof(PetscReal)), &count));
  PetscCall(PetscArrayzero(rows, n));
  first = t->rank * n / size;
  last = (t->rank + 1) * n / size;
  PetscCall(HycoComparisonCreate(t->fom, m, &c));
  for (PetscInt step = 0; step * size < n + size; step++) { /* one point of each rank */
    const PetscInt k = first + step;

    HycoOnEach(HycoComm(t), k < last ? Predict(m, mu + k * n_par, 0, &rows[k]) : PETSC_SUCCESS);
    for (PetscMPIInt of = 0; of < size; of++) {
      const PetscInt j = of * n / size + step;

      if (j < (of + 1) * n / size) PetscCall(Compare(&c, t, m, store, mu + j * n_par, of, &rows[j]));
    }
  }
  PetscCall(HycoComparisonDestroy(&c));
  HycoOnEach(HycoComm(t), PredictAgain(m, first, last, mu, rows));
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
  const PetscReal size = kind == HYCO_ERROR_LAMBDA ? row->size : row->rid_size,
                  by = kind < HYCO_ERROR_LAMBDA ? 1 : PetscMax(size, HYCO_SMALL_FORCE * force);

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
