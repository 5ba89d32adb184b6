/*
  Rigid motions and K: those that the supports leave free are its kernel, so that the solver can hold them by contact;
  all of them are what an algebraic multigrid must know (its near-kernel).
*/
#include <hycofomimpl.h>

static PetscErrorCode CheckHeld(HycoFOM f, const HycoMotions *motions)
{
  const PetscInt m = f->pairs.n;
  const size_t entries = (size_t)HycoPairsWidth(&f->pairs) * (size_t)f->fe->dim * (size_t)m;
  PetscInt *start, *dof;
  PetscReal *value, *gap;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(m + 1, &start, entries, &dof, entries, &value, m, &gap));
  ierr = HycoContactRows(f->fe_whole, &f->pairs, start, dof, value, gap);
  if (!ierr) ierr = HycoFECheckHeld(f->fe_whole, motions, m, start, dof, value);
  PetscCall(PetscFree4(start, dof, value, gap));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails when neither support nor contact holds a motion. Rank 0. */
static PetscErrorCode FindFree(HycoFOM f, HycoMotions *motions)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFEFreeMotions(f->fe_whole, motions));
  ierr = motions->n ? CheckHeld(f, motions) : 0;
  if (ierr) PetscCall(HycoMotionsDestroy(motions));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motions as distributed vectors; rank 0 has them. */
static PetscErrorCode Spread(HycoFOM f, const HycoMotions *motions, PetscInt n, Vec v[])
{
  const PetscInt dim = f->fe->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecDuplicate(f->U, &v[k]));
    for (PetscInt i = 0; f->rank == 0 && i < f->n_nodes * dim; i++) {
      const PetscInt node = f->global ? f->global[i / dim] : i / dim;

      PetscCall(VecSetValue(v[k], node * dim + i % dim,
                            motions->motion[(size_t)k * (size_t)(f->n_nodes * dim) + (size_t)i], INSERT_VALUES));
    }
    PetscCall(VecAssemblyBegin(v[k]));
    PetscCall(VecAssemblyEnd(v[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetKernel(HycoFOM f)
{
  HycoMotions motions = {0, NULL, NULL};
  MatNullSpace kernel;
  PetscInt n;
  Vec *v;

  PetscFunctionBegin;
  HycoOnRoot(f->comm, FindFree(f, &motions));
  n = motions.n;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, f->comm));
  f->summary.free_motion[0] = '\0'; /* rank 0 spreads the summary */
  if (f->rank == 0 && n)
    PetscCall(PetscStrncpy(f->summary.free_motion, motions.name[0], sizeof(f->summary.free_motion)));
  if (!n) {
    PetscCall(MatSetNullSpace(f->K, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &v));
  PetscCall(Spread(f, &motions, n, v));
  PetscCall(MatNullSpaceCreate(f->comm, PETSC_FALSE, n, v, &kernel));
  PetscCall(MatSetNullSpace(f->K, kernel));
  PetscCall(MatNullSpaceDestroy(&kernel));
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&v[k]));
  PetscCall(PetscFree(v));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modified Gram-Schmidt, twice; what depends on those before goes. */
static PetscErrorCode Orthonormalize(PetscInt *n, Vec v[])
{
  PetscInt kept = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < *n; k++) {
    PetscReal before, size;
    Vec w = v[k];

    PetscCall(VecNorm(w, NORM_2, &before));
    for (PetscInt j = 0; j < 2 * kept; j++) {
      PetscScalar dot;

      PetscCall(VecDot(w, v[j % kept], &dot));
      PetscCall(VecAXPY(w, -dot, v[j % kept]));
    }
    PetscCall(VecNorm(w, NORM_2, &size));
    if (size > 1e-8 * before) {
      PetscCall(VecScale(w, 1 / size));
      v[k] = v[kept];
      v[kept++] = w;
    }
  }
  for (PetscInt k = kept; k < *n; k++) PetscCall(VecDestroy(&v[k]));
  *n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Translations and rotations of the moved nodes, zero where fixed. */
static PetscErrorCode SetNearKernel(HycoFOM f)
{
  const PetscInt dim = f->fe->dim;
  MatNullSpace rigid, near;
  PetscInt n;
  const Vec *v;
  Vec x, *moves;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &x));
  PetscCall(VecSetBlockSize(x, dim));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = f->part->node_global ? f->part->node_global[i] : i;

    if (row < f->first || row >= f->first + f->n_owned) continue;
    for (PetscInt c = 0; c < dim; c++) PetscCall(VecSetValue(x, row * dim + c, f->fe->X[3 * i + c], INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(x));
  PetscCall(VecAssemblyEnd(x));
  PetscCall(MatNullSpaceCreateRigidBody(x, &rigid));
  PetscCall(MatNullSpaceGetVecs(rigid, NULL, &n, &v)); /* lent for reading */
  PetscCall(PetscMalloc1(n, &moves));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecDuplicate(v[k], &moves[k]));
    PetscCall(VecCopy(v[k], moves[k]));
    for (PetscInt i = 0; i < f->part->n_nodes * dim; i++) {
      const PetscInt node = f->part->node_global ? f->part->node_global[i / dim] : i / dim;

      if (f->fe->fixed[i] && node >= f->first && node < f->first + f->n_owned)
        PetscCall(VecSetValue(moves[k], node * dim + i % dim, 0, INSERT_VALUES));
    }
    PetscCall(VecAssemblyBegin(moves[k]));
    PetscCall(VecAssemblyEnd(moves[k]));
  }
  PetscCall(Orthonormalize(&n, moves));
  PetscCall(MatNullSpaceCreate(f->comm, PETSC_FALSE, n, moves, &near));
  PetscCall(MatSetNearNullSpace(f->K, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(MatNullSpaceDestroy(&rigid));
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&moves[k]));
  PetscCall(PetscFree(moves));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetMotions(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(SetKernel(f));
  PetscCall(SetNearKernel(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
