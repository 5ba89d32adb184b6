/* A model against stored full-order solutions that it was not trained on: errors, and what an online solve takes. */
#include <hycotrainerimpl.h>

const char *const HycoErrorKinds[] = {"u", "u_rid", "sigma", "sigma_11", "lambda", "lambda_rid", NULL};

#define REPEATS 3 /* of the timing of each point */

/* A point: its errors (those of forces before division), the forces' sizes, convergence, and the seconds. */
enum { SIZE = HYCO_N_ERRORS, RID_SIZE, CONVERGED, SECONDS, N_ROW = SECONDS + REPEATS };

static PetscErrorCode Compare(HycoModel m, HycoSnapshots store, const PetscReal mu[], PetscReal row[])
{
  const PetscInt n_dof = m->whole_nodes * m->mesh->dim, n_sigma = m->whole_cells * m->fe->n_sigma;
  PetscReal *u, *sigma, *lambda;
  HycoErrors e;
  HycoForceErrors f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n_dof, &u, n_sigma, &sigma, m->pairs.n, &lambda));
  PetscCall(HycoSnapshotsRead(store, mu, "U", n_dof, u));
  PetscCall(HycoSnapshotsRead(store, mu, "sigma", n_sigma, sigma));
  PetscCall(HycoSnapshotsRead(store, mu, "lambda", m->pairs.n, lambda));
  PetscCall(HycoModelCompareFields(m, u, sigma, lambda, &e, &f));
  row[HYCO_ERROR_U] = e.u;
  row[HYCO_ERROR_U_RID] = e.u_rid;
  row[HYCO_ERROR_SIGMA] = e.sigma;
  row[HYCO_ERROR_SIGMA_11] = e.sigma_11;
  row[HYCO_ERROR_LAMBDA] = f.lost;
  row[HYCO_ERROR_LAMBDA_RID] = f.rid_lost;
  row[SIZE] = f.size;
  row[RID_SIZE] = f.rid_size;
  PetscCall(PetscFree3(u, sigma, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points first .. last-1 in their order, REPEATS times: what a load ramp keeps from one step to the next is kept. */
static PetscErrorCode ValidateShare(HycoModel m, HycoSnapshots store, PetscInt first, PetscInt last,
                                    const PetscReal mu[], PetscReal rows[])
{
  const PetscInt n_par = m->scene->n_parameters;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < REPEATS; r++) {
    for (PetscInt k = first; k < last; k++) {
      PetscReal *row = rows + k * N_ROW;

      PetscCall(HycoModelPredict(m, n_par, mu + k * n_par));
      row[SECONDS + r] = m->prediction.seconds.total;
      if (r) continue;
      row[CONVERGED] = m->prediction.reason > 0;
      PetscCall(Compare(m, store, mu + k * n_par, row));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces' errors divided, everything gathered. */
static PetscErrorCode Summarise(PetscInt n, const PetscReal rows[], HycoValidation *v)
{
  PetscReal force = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(v, sizeof(*v)));
  v->n = n;
  for (PetscInt k = 0; k < n; k++) force = PetscMax(force, rows[k * N_ROW + SIZE]);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *row = rows + k * N_ROW;
    PetscReal seconds[REPEATS];

    v->not_converged += row[CONVERGED] < 0.5;
    PetscCall(PetscArraycpy(seconds, row + SECONDS, REPEATS));
    PetscCall(PetscSortReal(REPEATS, seconds));
    v->seconds += seconds[REPEATS / 2] / n;
    for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
      const PetscReal size = row[j == HYCO_ERROR_LAMBDA ? SIZE : RID_SIZE],
                      by = j < HYCO_ERROR_LAMBDA ? 1 : PetscMax(size, HYCO_SMALL_FORCE * force);
      const PetscReal e = row[CONVERGED] < 0.5 ? PETSC_INFINITY
                          : by > 0             ? row[j] / by
                          : row[j] > 0         ? PETSC_INFINITY
                                               : 0;

      v->largest[j] = PetscMax(v->largest[j], e);
      v->mean[j] += e / n;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoModelValidate(MPI_Comm comm, HycoModel m, HycoSnapshots store, HycoSamples samples,
                                 HycoValidation *validation)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscReal *rows;
  PetscMPIInt rank, size, count;

  PetscFunctionBegin;
  HycoCheckHandle(m, "HycoModelLoad()");
  HycoCheckHandle(store, "HycoSnapshotsOpen()");
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCheck(n > 0 && n_par == m->scene->n_parameters, comm, PETSC_ERR_USER,
             "the validation points are none, or of another scene than the model");
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMPIIntCast(n * N_ROW, &count));
  PetscCall(PetscCalloc1(count, &rows));
  HycoOnEach(comm, ValidateShare(m, store, rank * n / size, (rank + 1) * n / size, mu, rows));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, rows, count, MPIU_REAL, MPI_SUM, comm));
  PetscCall(Summarise(n, rows, validation));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
