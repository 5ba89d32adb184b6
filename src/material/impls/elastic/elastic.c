/* Isotropic linear elasticity. */
#include <hycomaterialimpl.h>

PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material)
{
  static const struct _HycoMaterialOps ops = {.isotropic = HycoElasticLame};

  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialSetOps(material, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
