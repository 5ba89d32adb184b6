/* A path's last accepted step, on file. */
#include <hycopath.h>

PetscErrorCode HycoPathSave(HycoFOM f)
{
  PetscFunctionBegin;
  (void)f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathLoad(HycoFOM f)
{
  PetscFunctionBegin;
  (void)f;
  PetscFunctionReturn(PETSC_SUCCESS);
}
