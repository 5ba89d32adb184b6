/* Many predictions in one call: points with the same reduced stiffness are solved one after the other, so that each
   stiffness is assembled and factored once. */
#include <hycoromimpl.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  const PetscReal *mu;
  const PetscInt *order; /* of the parameters: first those that affect the stiffness or the contact rows */
  PetscInt n, at;
} Point;

/* By the parameters in p->order, then by the place in the batch: equal points stay in the caller's order. */
static int BatchCompare(const void *a, const void *b)
{
  const Point *p = a, *q = b;

  for (PetscInt k = 0; k < p->n; k++) {
    const PetscReal x = p->mu[p->order[k]], y = q->mu[p->order[k]];

    if (x != y) return x < y ? -1 : 1;
  }
  return p->at < q->at ? -1 : p->at > q->at;
}

/* Points in an order in which the parameters that the stiffness depends on change least often, so that consecutive
   points share its factor. The points themselves stay where they are: point[] refers to the caller's array. */
static PetscErrorCode BatchSort(HycoROM m, PetscInt n, const PetscReal mu[], PetscInt order[], Point point[])
{
  const PetscInt n_par = m->model->scene->n_parameters;
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  PetscInt count = 0;

  PetscFunctionBegin;
  HycoSceneReaches(m->fe->scene, reaches);
  /* Parameters that reach the stiffness first: they are the leading keys of the comparison, so that each new factor
     serves a whole run of points. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt p = 0; p < n_par; p++) {
      if (reaches[p] == (pass ? PETSC_FALSE : PETSC_TRUE)) order[count++] = p;
    }
  }
  for (PetscInt k = 0; k < n; k++) {
    const Point here = {mu + k * n_par, order, n_par, k};

    point[k] = here;
  }
  if (n) qsort(point, (size_t)n, sizeof(*point), BatchCompare);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes of the arrays that HycoROMSolveMany() fills; NULL: not wanted. */
PetscErrorCode HycoROMGetSizes(HycoROM m, PetscInt *n_contacts, PetscInt *n_nodes, PetscInt *dim)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  if (n_contacts) *n_contacts = m->model->pairs.n;
  if (n_nodes) *n_nodes = m->model->mesh->n_nodes;
  if (dim) *dim = m->model->mesh->dim;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the points in their sorted order; the results are in the order of the input. Each point is a cold solve, so
   that its result does not depend on its place in the batch. */
static PetscErrorCode SolveEach(HycoROM m, PetscInt n, const Point point[], HycoPrediction prediction[],
                                PetscReal Lambda[], PetscReal U[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    /* Results go to the caller's place of the point, whatever the order of the solves. */
    const size_t at = (size_t)point[k].at, n_dof = (size_t)(m->model->mesh->n_nodes * m->model->mesh->dim);

    PetscCall(HycoROMPredict(m, m->model->scene->n_parameters, point[k].mu));
    if (m->point_monitor) PetscCall((*m->point_monitor)(m, point[k].at, m->point_ctx));
    if (prediction) PetscCall(HycoROMGetPrediction(m, &prediction[at]));
    if (Lambda) PetscCall(PetscArraycpy(Lambda + at * (size_t)m->model->pairs.n, m->Lambda, m->model->pairs.n));
    /* Displacements outside the reduced problem's part are computed only if they are wanted. */
    if (U) PetscCall(HycoROMComplete(m));
    if (U) PetscCall(PetscArraycpy(U + at * n_dof, m->U, n_dof));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *at: the point that is checked. */
static PetscErrorCode CheckEach(HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[], PetscInt *at)
{
  PetscFunctionBegin;
  HycoCheckValue(n >= 0 && (mu || !n), "%d points were given%s", (int)n, mu ? "" : " at NULL");
  for (*at = 0; *at < n; ++*at)
    PetscCall(HycoSceneCheckParameters(m->model->scene, n_parameters, mu + *at * n_parameters));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first wrong point by its number; the only one needs none. */
PetscErrorCode HycoROMCheckPoints(HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[])
{
  char why[HYCO_LINE];
  PetscErrorCode caught;
  PetscInt at = 0;

  PetscFunctionBegin;
  HycoCatch(CheckEach(m, n, n_parameters, mu, &at), caught, why);
  if (caught && n > 1) HycoFailAs(caught, "points[%d]: %s", (int)at, why);
  if (caught) HycoFailAs(caught, "%s", why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All points are checked before the first is solved: a wrong one must not cost the time of those before it. Results are
   written to the caller's places, whatever the order of the solves. */
PetscErrorCode HycoROMSolveMany(HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                HycoPrediction prediction[], PetscReal Lambda[], PetscReal U[])
{
  PetscInt order[HYCO_MAX_PARAMETERS];
  Point *point;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoROMCheckPoints(m, n, n_parameters, mu));
  PetscCall(HycoROMSetUp(m));
  PetscCall(PetscMalloc1(n, &point));
  ierr = BatchSort(m, n, mu, order, point);
  if (!ierr) ierr = SolveEach(m, n, point, prediction, Lambda, U);
  /* Also after an error: the handle's vectors then belong to some point of the batch, which the getters must not
     show. */
  m->solved = PETSC_FALSE; /* a batch leaves no current solution */
  PetscCall(PetscFree(point));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives all ranks the rows of each, `bytes` per point. */
static PetscErrorCode BatchShare(MPI_Comm comm, size_t bytes, const PetscMPIInt count[], const PetscMPIInt first[],
                                 void *rows)
{
  MPI_Datatype row;

  PetscFunctionBegin;
  if (!rows || !bytes) PetscFunctionReturn(PETSC_SUCCESS);
  /* One row as a datatype: counts stay small, where bytes may exceed an int. */
  PetscCallMPI(MPI_Type_contiguous((int)bytes, MPI_BYTE, &row));
  PetscCallMPI(MPI_Type_commit(&row));
  PetscCallMPI(MPI_Allgatherv(MPI_IN_PLACE, 0, row, rows, count, first, row, comm));
  PetscCallMPI(MPI_Type_free(&row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all ranks give the same points to the same model, and take the same results. Collective. */
static PetscErrorCode AgreeOnBatch(MPI_Comm comm, HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                   PetscInt wanted, PetscBool *agree)
{
  const PetscInt sizes[] = {
      n, n_parameters, m->model->pairs.n, m->model->mesh->n_nodes, m->model->scene->extrapolate, wanted, m->model->l};
  const size_t bytes = mu && n > 0 && n_parameters > 0 ? (size_t)n * (size_t)n_parameters * sizeof(*mu) : 0;
  PetscInt64 ends[2];

  PetscFunctionBegin;
  ends[0] = (PetscInt64)HycoHash(HycoHash(HYCO_HASH_START, sizes, sizeof(sizes)), m->model->fingerprint,
                                 strlen(m->model->fingerprint));
  ends[0] = (PetscInt64)HycoHash((unsigned long long)ends[0], mu, bytes);
  ends[1] = ~ends[0]; /* the largest complement is that of the smallest */
  HycoAllreduce(ends, 2, MPIU_INT64, MPI_MAX, comm);
  *agree = (PetscBool)(ends[0] == ~ends[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contiguous shares, n r / size in 64 bits. Every rank has the model and gets all results; an error of one rank is
   raised on all. Ranks with points of their own solve them alone. */
PetscErrorCode HycoROMSolveShared(MPI_Comm comm, HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                  HycoPrediction prediction[], PetscReal Lambda[], PetscReal U[])
{
  PetscMPIInt size, *count, *first;
  PetscInt n_contacts, n_nodes, dim;
  size_t n_dof, at;
  PetscBool agree = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoROMGetSizes(m, &n_contacts, &n_nodes, &dim));
  PetscCall(AgreeOnBatch(comm, m, n, n_parameters, mu, !!prediction + 2 * !!Lambda + 4 * !!U, &agree));
  if (!agree) {
    PetscCall(HycoROMSolveMany(m, n, n_parameters, mu, prediction, Lambda, U));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* All of them first: their numbers are those of the caller. */
  PetscCall(HycoROMCheckPoints(m, n, n_parameters, mu));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMalloc2(size, &count, size, &first));
  for (PetscMPIInt r = 0; r < size; r++) {
    first[r] = (PetscMPIInt)((PetscInt64)n * r / size);
    count[r] = (PetscMPIInt)((PetscInt64)n * (r + 1) / size) - first[r];
  }
  /* Results go directly to their places in the arrays of all points, which are then exchanged in place. */
  n_dof = (size_t)(n_nodes * dim);
  at = (size_t)first[HycoRank(comm)];
  HycoOnEach(comm, HycoROMSolveMany(m, count[HycoRank(comm)], n_parameters, mu + at * (size_t)n_parameters,
                                    prediction ? prediction + at : NULL,
                                    Lambda ? Lambda + at * (size_t)n_contacts : NULL, U ? U + at * n_dof : NULL));
  PetscCall(BatchShare(comm, sizeof(*prediction), count, first, prediction));
  PetscCall(BatchShare(comm, (size_t)n_contacts * sizeof(*Lambda), count, first, Lambda));
  PetscCall(BatchShare(comm, n_dof * sizeof(*U), count, first, U));
  PetscCall(PetscFree2(count, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}
