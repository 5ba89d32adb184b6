/* Isotropic linear elasticity. */
#include <hycomaterialimpl.h>

PetscErrorCode HycoElasticLame(HycoMaterial material, HycoMaterialPoints *p, PetscReal lame[])
{
  const PetscReal *young = p->constant[0], *poisson = p->constant[1];

  PetscFunctionBegin;
  (void)material;
  for (PetscInt i = 0; i < p->n; i++) {
    lame[2 * i] = p->dim == 1 ? 0 : young[i] * poisson[i] / ((1 + poisson[i]) * (1 - 2 * poisson[i]));
    lame[2 * i + 1] = p->dim == 1 ? young[i] : young[i] / (2 * (1 + poisson[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoElasticDeclare(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoMaterialDeclare(material, "young", "Young's modulus", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "poisson", "Poisson's ratio", 0, -1, 0.5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material)
{
  static const struct _HycoMaterialOps ops = {.isotropic = HycoElasticLame};

  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialSetOps(material, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
