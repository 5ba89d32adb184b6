/* The training of the types of reduced models: registration, selection. */
#include <hycoreducerimpl.h>
#include <hycoregistry.h>

static HycoRegistry trainers = {.sorted = PETSC_TRUE};

HycoDefineRegister(HycoTrainerRegister, trainers, PetscErrorCode (*create)(HycoTrainerOps *))

PetscErrorCode HycoTrainerNames(const char *const **names)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryNames(&trainers, NULL, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Types without training are known to HycoROMRegister() alone: a program that only predicts links no training. */
PetscErrorCode HycoTrainerFind(HycoROMType type, HycoTrainerOps *ops)
{
  PetscErrorCode (*create)(HycoTrainerOps *);

  PetscFunctionBegin;
  PetscCall(HycoRegistryFind(&trainers, type, &create));
  HycoCheck(create,
            "models of type %s can be loaded, but not trained; a program adds the training by HycoTrainerRegister()",
            type);
  *ops = (HycoTrainerOps){0};
  PetscCall(create(ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
