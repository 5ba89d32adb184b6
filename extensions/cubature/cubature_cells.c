/* The cells and weights of a cubature model (src/offline/cubature_weights.c). */
#include "cubature.h"

/* Stores the cells with positive weights on every rank. Collective; w: on rank 0. */
static PetscErrorCode CubatureCellsStore(HycoReducer t, const PetscReal w[])
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  const PetscInt n_cells = t->sizes[1];
  PetscInt n = 0;

  PetscFunctionBegin;
  HycoFreeAll(&c->weight, &t->seeds_cell);
  PetscCall(PetscMalloc1(n_cells, &c->weight));
  PetscCall(PetscMalloc1(n_cells, &t->seeds_cell));
  /* w NULL: another rank than 0, which gets the list below. */
  for (PetscInt e = 0; w && e < n_cells; e++) {
    if (!(w[e] > 0)) continue;
    t->seeds_cell[n] = e;
    c->weight[n++] = w[e];
  }
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, HycoComm(t)));
  HycoBcast(t->seeds_cell, n, MPIU_INT, HycoComm(t));
  HycoBcast(c->weight, n, MPIU_REAL, HycoComm(t));
  c->n = t->n_seeds_cell = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On every rank alike; without sampling, thus exact. */
PetscErrorCode HycoCubatureChooseAll(HycoReducer t)
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  PetscReal *w;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->sizes[1], &w));
  for (PetscInt e = 0; e < t->sizes[1]; e++) w[e] = 1;
  c->error[0] = c->error[1] = 0;
  PetscCall(CubatureCellsStore(t, w));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if the weights miss the tolerance by a factor of 10, since a model from them would be wrong without a sign
   of it online. */
PetscErrorCode HycoCubatureChoose(HycoReducer t, Mat W, PetscInt n, const PetscReal sigma[])
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  PetscReal *w;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->rank ? 1 : t->sizes[1], &w));
  PetscCall(HycoCubatureFind(t, c->near, 1, c->tol, W, n, sigma, w, c->error));
  HycoCheckModel(c->error[0] <= PetscMax(10 * c->tol, 1e-6) && c->error[1] <= 1e-3,
                 "the error of the cubature is %.1e in the internal forces of training and %.1e in a body's volume; "
                 "use another -hyco_cubature_tol, or fewer modes (-hyco_pod_tol)",
                 (double)c->error[0], (double)c->error[1]);
  PetscCall(CubatureCellsStore(t, t->rank ? NULL : w));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
