/* B K^-1 B^T and V^T K^-1 B^T from one factorisation: K is symmetric, so that V^T K^-1 B^T = (B K^-1 V)^T. */
#include <hycofomimpl.h>

/* Mode j, from rank 0 in the file's order, to the distributed order. */
static PetscErrorCode PutMode(HycoFOM f, PetscInt l, PetscInt j, const PetscReal V[], Vec v)
{
  PetscFunctionBegin;
  if (f->rank == 0) {
    const PetscInt n = f->n_nodes * f->fe->dim;
    PetscScalar *root;

    PetscCall(VecGetArray(f->U_root, &root));
    for (PetscInt i = 0; i < n; i++) root[i] = V[(size_t)i * (size_t)l + (size_t)j];
    PetscCall(VecRestoreArray(f->U_root, &root));
  }
  PetscCall(VecScatterBegin(f->to_root, f->U_root, v, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(f->to_root, f->U_root, v, INSERT_VALUES, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Row j of H. */
static PetscErrorCode ModeRow(HycoFOM f, Vec v, Vec x, Vec Bx, PetscReal row[])
{
  const PetscScalar *root;

  PetscFunctionBegin;
  PetscCall(HycoSolverApplyInverse(f->solver, v, x));
  PetscCall(MatMult(f->B, x, Bx));
  PetscCall(VecScatterBegin(f->lambda_to_root, Bx, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->lambda_to_root, Bx, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
  if (f->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(f->lambda_root, &root));
  PetscCall(PetscArraycpy(row, root, f->n_contacts));
  PetscCall(VecRestoreArrayRead(f->lambda_root, &root));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMFlexibility(HycoFOM f, const PetscReal mu[], PetscInt l, const PetscReal V[], PetscReal G[],
                                  PetscReal H[])
{
  const PetscReal *S;
  PetscInt m;
  size_t at = 0;
  Vec v, x, Bx;

  PetscFunctionBegin;
  HycoCheckHandle(f, "HycoFOMCreate()");
  PetscCall(HycoSolverSetForm(f->solver, HYCO_FORM_DUAL));
  PetscCall(HycoFOMSolve(f, f->scene->n_parameters, mu));
  PetscCall(HycoSolverGetFlexibility(f->solver, &m, &S));
  for (PetscInt j = 0; j < m && G && f->rank == 0; j++) {
    PetscCall(PetscArraycpy(G + at, S + (size_t)j * (size_t)(m + 1), m - j));
    at += (size_t)(m - j);
  }
  PetscCall(VecDuplicate(f->U, &v));
  PetscCall(VecDuplicate(f->U, &x));
  PetscCall(VecDuplicate(f->Lambda, &Bx));
  for (PetscInt j = 0; j < l; j++) {
    PetscCall(PutMode(f, l, j, V, v));
    PetscCall(ModeRow(f, v, x, Bx, H + (f->rank ? 0 : j * m)));
  }
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&Bx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
