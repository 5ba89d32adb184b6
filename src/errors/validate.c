/* A model against stored full-order solutions that it was not trained on: errors, what tells of them online, and what
   an online solve takes. */
#include <hycoreducerimpl.h>

const char *const HycoErrorKinds[] = {"u", "u_rid", "sigma", "sigma_11", "lambda", "lambda_rid", "inelastic", NULL};

/* A path in the store. */
typedef struct {
  HycoROM m;
  HycoSnapshots store;
  const PetscReal *mu;
} Stored;

static PetscErrorCode ReadStored(void *ctx, PetscInt k, PetscReal u[], PetscReal sigma[], PetscReal inelastic[],
                                 PetscReal lambda[])
{
  const Stored *s = (const Stored *)ctx;
  const HycoROM m = s->m;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsRead(s->store, s->mu, k, "U", m->whole_nodes * m->mesh->dim, u));
  PetscCall(HycoSnapshotsRead(s->store, s->mu, k, "sigma", m->whole_cells * m->fe->n_sigma, sigma));
  PetscCall(HycoSnapshotsRead(s->store, s->mu, k, "inelastic", m->whole_cells, inelastic));
  PetscCall(HycoSnapshotsRead(s->store, s->mu, k, "lambda", m->pairs.n, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces as they are before they are divided by what is large among the held-out paths. */
static PetscErrorCode ComparePath(HycoROM m, HycoSnapshots store, const PetscReal mu[], HycoHeldOut *row)
{
  Stored stored = {m, store, mu};
  const HycoPathSource source = {m->scene->n_times, ReadStored, &stored};
  HycoPathErrors e;

  PetscFunctionBegin;
  PetscCall(HycoROMMeasurePath(m, &source, &e));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) row->error[j] = e.worst[j];
  row->size = e.force;
  row->rid_size = e.force_rid;
  if (e.force > 0) row->error[HYCO_ERROR_LAMBDA] *= e.force;
  if (e.force_rid > 0) row->error[HYCO_ERROR_LAMBDA_RID] *= e.force_rid;
  if (row->converged > 0) PetscCall(HycoTrustMeasure(m, row->feature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(HycoROM m, HycoSnapshots store, const PetscReal mu[], HycoHeldOut *row)
{
  const PetscInt n_dof = m->whole_nodes * m->mesh->dim, n_sigma = m->whole_cells * m->fe->n_sigma;
  PetscReal *u, *sigma, *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n_dof, &u, n_sigma, &sigma, m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsRead(store, mu, 0, "U", n_dof, u));
  PetscCall(HycoSnapshotsRead(store, mu, 0, "sigma", n_sigma, sigma));
  PetscCall(HycoSnapshotsRead(store, mu, 0, "lambda", m->pairs.n, lambda));
  PetscCall(HycoROMCompareFields(m, u, sigma, lambda, &e, &f));
  row->error[HYCO_ERROR_U] = e.u;
  row->error[HYCO_ERROR_U_RID] = e.u_rid;
  row->error[HYCO_ERROR_SIGMA] = e.sigma;
  row->error[HYCO_ERROR_SIGMA_11] = e.sigma_11;
  row->error[HYCO_ERROR_LAMBDA] = f.lost;
  row->error[HYCO_ERROR_LAMBDA_RID] = f.rid_lost;
  row->size = f.size;
  row->rid_size = f.rid_size;
  PetscCall(PetscFree3(u, sigma, lambda));
  if (row->converged > 0) PetscCall(HycoTrustMeasure(m, row->feature));
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

/* Points first .. last-1 in their order, several times: what a load ramp keeps from one step to the next is kept. */
static PetscErrorCode PredictShare(HycoROM m, HycoSnapshots store, PetscInt first, PetscInt last, const PetscReal mu[],
                                   HycoHeldOut rows[])
{
  const PetscInt n_par = m->scene->n_parameters;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < (m->scene->n_times ? 1 : HYCO_HELD_REPEATS); r++) {
    for (PetscInt k = first; k < last; k++) {
      PetscCall(PredictOne(m, store, mu + k * n_par));
      rows[k].seconds[r] = m->prediction.seconds.total;
      for (PetscInt j = 0; j < HYCO_HELD_REPEATS && m->scene->n_times; j++) rows[k].seconds[j] = rows[k].seconds[0];
      if (r) continue;
      rows[k].converged = m->prediction.reason > 0;
      if (m->scene->n_times)
        PetscCall(ComparePath(m, store, mu + k * n_par, &rows[k]));
      else
        PetscCall(Compare(m, store, mu + k * n_par, &rows[k]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMPredictHeldOut(MPI_Comm comm, HycoROM m, HycoSnapshots store, HycoSamples samples,
                                     HycoHeldOut rows[])
{
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscMPIInt rank, size, count;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMPIIntCast(n * (PetscInt)(sizeof(*rows) / sizeof(PetscReal)), &count));
  PetscCall(PetscArrayzero(rows, n));
  HycoOnEach(comm, PredictShare(m, store, rank * n / size, (rank + 1) * n / size, mu, rows));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, rows, count, MPIU_REAL, MPI_SUM, comm));
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

PetscErrorCode HycoROMValidate(MPI_Comm comm, HycoROM m, HycoSnapshots store, HycoSamples samples,
                               HycoValidation *validation)
{
  PetscInt n, n_par;
  HycoHeldOut *rows;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckHandle(store, HYCO_SNAPSHOTS_CLASSID);
  PetscCall(HycoSamplesGet(samples, &n, &n_par, NULL));
  PetscCheck(n > 0 && n_par == m->scene->n_parameters, comm, PETSC_ERR_USER,
             "the validation points are none, or of another scene than the model");
  PetscCall(PetscMalloc1(n, &rows));
  PetscCall(HycoROMPredictHeldOut(comm, m, store, samples, rows));
  PetscCall(HycoHeldOutSummarise(n, rows, validation));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
