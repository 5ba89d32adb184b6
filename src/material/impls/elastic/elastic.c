/* Isotropic linear elasticity. */
#include <hycomaterialimpl.h>

/* Only Lame's constants: stresses and tangents are evaluated by the class, with kernels of their own. */
PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material)
{
  static const struct _HycoMaterialOps ops = {.isotropic = HycoElasticLame};

  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialSetOps(material, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
