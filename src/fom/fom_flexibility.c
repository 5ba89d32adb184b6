/* B K^-1 B^T from the factorisation of the dual form. */
#include <hycofomimpl.h>

/* G = B K^-1 B^T: the upper triangle by rows, on rank 0 (m (m + 1) / 2 reals), in the order of the contacts on one
   rank. Computed with the dual form, whose matrix it is. Collective. */
PetscErrorCode HycoFOMFlexibility(HycoFOM f, const PetscReal mu[], PetscReal G[])
{
  const PetscReal *S;
  PetscInt m, *number = NULL, *row;
  size_t at = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneRefuseHistory(f->scene, "HycoFOMFlexibility()"));
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoSolverSetForm(f->solver, HYCO_FORM_DUAL));
  PetscCall(HycoFOMSolve(f, f->scene->n_parameters, mu));
  PetscCall(HycoSolverGetFlexibility(f->solver, &m, &S));
  if (f->size > 1) PetscCall(HycoFOMGetNumbers(f, &number));
  PetscCall(PetscMalloc1(m, &row));
  for (PetscInt k = 0; k < m && f->rank == 0; k++) row[number ? number[k] : k] = k;
  for (PetscInt j = 0; j < m && f->rank == 0; j++) {
    for (PetscInt i = j; i < m; i++)
      G[at++] = S[(size_t)PetscMin(row[i], row[j]) * (size_t)m + (size_t)PetscMax(row[i], row[j])];
  }
  PetscCall(PetscFree(number));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}
