/* The types of reduced models: registered, set, described. */
#include <hycoromimpl.h>
#include <hycoromtypes.h>
#include <stdlib.h>
#include <string.h>

static PetscFunctionList list = NULL;
static PetscBool registered = PETSC_FALSE;
static const char **sorted = NULL; /* the names in the list; made when asked for */

/* PETSc may begin again after PetscFinalize(). */
static PetscErrorCode Forget(void)
{
  PetscFunctionBegin;
  PetscCall(PetscFunctionListDestroy(&list));
  PetscCall(PetscFree(sorted));
  registered = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMRegisterAll(void)
{
  PetscFunctionBegin;
  if (registered) PetscFunctionReturn(PETSC_SUCCESS);
  registered = PETSC_TRUE;
  PetscCall(HycoInitializePackage());
  PetscCall(PetscRegisterFinalize(Forget));
  PetscCall(HycoROMRegister(HYCO_ROM_HYBRID, HycoROMCreate_Hybrid));
  PetscCall(HycoROMRegister(HYCO_ROM_PROJECTION, HycoROMCreate_Projection));
  PetscCall(HycoROMRegister(HYCO_ROM_CONDENSED, HycoROMCreate_Condensed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMRegister(const char name[], PetscErrorCode (*create)(HycoROM))
{
  PetscFunctionBegin;
  PetscCall(HycoROMRegisterAll());
  PetscCall(PetscFunctionListAdd(&list, name, create));
  PetscCall(PetscFree(sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int Compare(const void *a, const void *b)
{
  return strcmp(*(const char *const *)a, *(const char *const *)b);
}

PetscErrorCode HycoROMTypeNames(const char *const **names)
{
  const char **found;
  int n;

  PetscFunctionBegin;
  PetscCall(HycoROMRegisterAll());
  if (sorted) {
    *names = sorted;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscFunctionListGet(list, &found, &n));
  while (n && !found[n - 1]) n--; /* releases of PETSc count a NULL at the end, or do not */
  PetscCall(PetscMalloc1(n + 1, &sorted));
  PetscCall(PetscArraycpy(sorted, found, n));
  sorted[n] = NULL;
  qsort(sorted, (size_t)n, sizeof(*sorted), Compare);
  PetscCall(PetscFree(found));
  *names = sorted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetType(HycoROM m, HycoROMType type)
{
  PetscErrorCode (*create)(HycoROM);
  const char *const *names;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(PetscFunctionListFind(list, type, &create));
  HycoCheck(create,
            "%s%sthere is no type of reduced model \"%s\" here; a program that has its own registers it by "
            "HycoROMRegister()",
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

PetscErrorCode HycoROMSetOps(HycoROM m, const HycoROMOps *ops, const HycoROMTraits *traits, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  *m->ops = *ops;
  m->traits = *traits;
  m->data = data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetData(HycoROM m, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  *(void **)data = m->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}
