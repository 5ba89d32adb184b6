/* Registries of types. */
#include <hycoregistry.h>
#include <string.h>

static HycoRegistry *all = NULL; /* list of the registries in use */

/* PETSc may be initialised again after PetscFinalize(). */
static PetscErrorCode ForgetAll(void)
{
  PetscFunctionBegin;
  for (HycoRegistry *r = all; r; r = r->next) {
    for (PetscInt k = 0; k < r->n; k++) PetscCall(PetscFree(r->name[k]));
    PetscCall(PetscFree(r->name));
    PetscCall(PetscFree(r->create));
    r->n = 0;
    r->begun = PETSC_FALSE;
  }
  all = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Begin(HycoRegistry *r)
{
  PetscFunctionBegin;
  if (r->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoInitializePackage());
  if (!all) PetscCall(PetscRegisterFinalize(ForgetAll));
  r->begun = r->adding_own = PETSC_TRUE;
  r->next = all;
  all = r;
  PetscCall(r->add_own());
  r->adding_own = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The index of a name; -1: not found. */
static PetscInt Place(const HycoRegistry *r, const char name[])
{
  for (PetscInt k = 0; k < r->n; k++) {
    if (strcmp(r->name[k], name) == 0) return k;
  }
  return -1;
}

PetscErrorCode HycoRegistryAdd_Private(HycoRegistry *r, const char name[], HycoVoidFn *create)
{
  PetscInt k;

  PetscFunctionBegin;
  PetscCall(Begin(r));
  k = Place(r, name);
  if (k < 0) {
    PetscCall(PetscRealloc((size_t)(r->n + 2) * sizeof(*r->name), &r->name));
    PetscCall(PetscRealloc((size_t)(r->n + 1) * sizeof(*r->create), &r->create));
    for (k = r->n; k > 0 && r->sorted && strcmp(r->name[k - 1], name) > 0; k--) {
      r->name[k] = r->name[k - 1];
      r->create[k] = r->create[k - 1];
    }
    PetscCall(PetscStrallocpy(name, &r->name[k]));
    r->name[++r->n] = NULL;
  }
  r->create[k] = create;
  if (!r->adding_own) PetscCall(HycoOptionsForgetTable());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRegistryFind_Private(HycoRegistry *r, const char name[], HycoVoidFn **create)
{
  PetscInt k;

  PetscFunctionBegin;
  PetscCall(Begin(r));
  k = Place(r, name);
  *create = k < 0 ? NULL : r->create[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRegistryNames(HycoRegistry *r, PetscInt *n, const char *const **names)
{
  PetscFunctionBegin;
  PetscCall(Begin(r));
  if (n) *n = r->n;
  *names = (const char *const *)r->name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRegistryList(HycoRegistry *r, const char name[], char list[HYCO_LINE])
{
  const char *near;

  PetscFunctionBegin;
  PetscCall(Begin(r));
  list[0] = '\0';
  for (PetscInt k = 0; k < r->n; k++) PetscCall(HycoListAdd(list, k + 1 < r->n ? ", " : " or ", r->name[k]));
  near = HycoNearest(name, r->n, (const char *const *)r->name);
  if (near) PetscCall(HycoListAdd(list, "; did you mean ", near));
  if (near) PetscCall(PetscStrlcat(list, "?", HYCO_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
