/* The types of reduced models: registration, selection, description. */
#include <hycoregistry.h>
#include <hycoromimpl.h>
#include <hycoromtypes.h>
#include <string.h>

static PetscErrorCode AddOwn(void);
static HycoRegistry types = {.add_own = AddOwn, .sorted = PETSC_TRUE};

static PetscErrorCode AddOwn(void)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&types, HYCO_ROM_HYBRID, HycoROMCreate_Hybrid));
  PetscCall(HycoRegistryAdd(&types, HYCO_ROM_PROJECTION, HycoROMCreate_Projection));
  PetscCall(HycoRegistryAdd(&types, HYCO_ROM_CONDENSED, HycoROMCreate_Condensed));
  PetscCall(HycoRegistryAdd(&types, HYCO_ROM_CUBATURE, HycoROMCreate_Cubature));
  PetscCall(HycoRegistryAdd(&types, HYCO_ROM_REGRESSION, HycoROMCreate_Regression));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMRegister(const char name[], PetscErrorCode (*create)(HycoROM))
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&types, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMTypeNames(const char *const **names)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryNames(&types, NULL, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetType(HycoROM m, HycoROMType type)
{
  PetscErrorCode (*create)(HycoROM);
  const char *const *names;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoRegistryFind(&types, type, &create));
  HycoCheck(create, "%s%sthe type of reduced model \"%s\" is unknown; a program can add a type by HycoROMRegister()",
            m->path, m->path[0] ? ": problem/type is damaged, or another program's: " : "", type);
  PetscCheck(!m->data, PETSC_COMM_SELF, PETSC_ERR_ORDER, "HycoROMSetType: the model has a type");
  PetscCall(create(m));
  PetscCall(PetscObjectChangeTypeName((PetscObject)m, type));
  PetscCall(HycoROMTypeNames(&names));
  for (PetscInt k = 0; names[k]; k++) {
    if (strcmp(names[k], type) == 0) m->type = names[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMSetOps, (HycoROM m, const HycoROMOps *ops, const HycoROMTraits *traits, void *data), m,
                 HYCO_ROM_CLASSID, *m->ops = *ops;
                 m->traits = *traits; m->data = data)
HycoDefineMethod(HycoROMGetData, (HycoROM m, void *data), m, HYCO_ROM_CLASSID, *(void **)data = m->data)
