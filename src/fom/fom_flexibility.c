/* B K^-1 B^T from the factorisation of the dual form. */
#include <hycofomimpl.h>

PetscErrorCode HycoFOMFlexibility(HycoFOM f, const PetscReal mu[], PetscReal G[])
{
  const PetscReal *S;
  PetscInt m;
  size_t at = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneRefuseHistory(f->scene, "HycoFOMFlexibility()"));
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoSolverSetForm(f->solver, HYCO_FORM_DUAL));
  PetscCall(HycoFOMSolve(f, f->scene->n_parameters, mu));
  PetscCall(HycoSolverGetFlexibility(f->solver, &m, &S));
  for (PetscInt j = 0; j < m && f->rank == 0; j++) {
    PetscCall(PetscArraycpy(G + at, S + (size_t)j * (size_t)(m + 1), m - j));
    at += (size_t)(m - j);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
