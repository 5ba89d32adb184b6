/* The types of reduced models: registration, selection, description. */
#include <hycoregistry.h>
#include <hycoromimpl.h>
#include <hycoromtypes.h>
#include <string.h>

static HycoRegistry types = {.sorted = PETSC_TRUE};
static const char former[] = "condensed"; /* a type of earlier versions, whose models have files */

HycoDefineRegister(HycoROMRegister, types, PetscErrorCode (*create)(HycoROM))

PetscErrorCode HycoROMTypeNames(const char *const **names)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryNames(&types, NULL, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The name that is kept is the registry's own string, which outlives the caller's. */
PetscErrorCode HycoROMSetType(HycoROM m, HycoROMType type)
{
  PetscErrorCode (*create)(HycoROM);
  const char *const *names;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(type);
  PetscCall(HycoRegistryFind(&types, type, &create));
  HycoCheck(
      create || strcmp(type, former),
      "%s%sa model of the former type %s, which models of bodies replace: train the scene again (-hyco_model_type "
      "bodies, or without this option)",
      m->model->path, m->model->path[0] ? ": " : "", former);
  /* A file can name a type that only another program registers. */
  HycoCheck(create, "%s%sthe type of reduced model \"%s\" is unknown; a program can add a type by HycoROMRegister()",
            m->model->path, m->model->path[0] ? ": problem/type is damaged, or another program's: " : "", type);
  PetscCheck(!m->model->data, PETSC_COMM_SELF, PETSC_ERR_ORDER, "HycoROMSetType: the model has a type");
  /* Before the name is set: an error leaves a handle without a type. */
  PetscCall(create(m));
  PetscCall(PetscObjectChangeTypeName((PetscObject)m, type));
  PetscCall(HycoROMTypeNames(&names));
  for (PetscInt k = 0; names[k]; k++) {
    if (strcmp(names[k], type) == 0) m->model->type = names[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMSetOps, (HycoROM m, const HycoROMOps *ops, const HycoROMTraits *traits, void *data), m,
                 HYCO_ROM_CLASSID, HycoCheckGiven(ops);
                 HycoCheckGiven(traits); *m->ops = *ops; m->model->traits = *traits; m->model->data = data)
HycoDefineMethod(HycoROMGetData, (HycoROM m, void *data), m, HYCO_ROM_CLASSID, HycoCheckGiven(data);
                 *(void **)data = m->model->data)
HycoDefineMethod(HycoROMGetWork, (HycoROM m, void *work), m, HYCO_ROM_CLASSID, HycoCheckGiven(work);
                 *(void **)work = m->work)
