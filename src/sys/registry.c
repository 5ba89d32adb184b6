/* Registries of types: a PetscFunctionList each, and the names in a fixed order, which such a list need not keep. */
#include <hycoregistry.h>
#include <string.h>

static HycoRegistry *all = NULL; /* list of the registries in use */

/* PETSc may be initialised again after PetscFinalize(). */
static PetscErrorCode ForgetAll(void)
{
  PetscFunctionBegin;
  for (HycoRegistry *r = all; r; r = r->next) {
    PetscCall(PetscFunctionListDestroy(&r->create));
    PetscCall(PetscStrArrayDestroy(&r->name));
    r->n = 0;
    r->begun = PETSC_FALSE;
  }
  all = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The names are kept beside PETSc's list, which can be searched but not listed in an order; a name that is registered
   again replaces its function. */
static PetscErrorCode RegistryAdd(HycoRegistry *r, const char name[], HycoVoidFn *create)
{
  HycoVoidFn *former;
  PetscInt k;

  PetscFunctionBegin;
  PetscCall(PetscFunctionListFind(r->create, name, &former));
  PetscCall(PetscFunctionListAdd(&r->create, name, create));
  if (former) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscRealloc((size_t)(r->n + 2) * sizeof(*r->name), &r->name));
  for (k = r->n; k > 0 && r->sorted && strcmp(r->name[k - 1], name) > 0; k--) r->name[k] = r->name[k - 1];
  PetscCall(PetscStrallocpy(name, &r->name[k]));
  r->name[++r->n] = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every registry is forgotten in PetscFinalize(), so that a program can initialise PETSc again. Registries are static
   objects; each is chained in once. */
static PetscErrorCode RegistryBegin(HycoRegistry *r)
{
  PetscFunctionBegin;
  if (r->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPackageCheck());
  if (!all) PetscCall(PetscRegisterFinalize(ForgetAll));
  r->begun = PETSC_TRUE;
  r->next = all;
  all = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of options is made anew, as the new type may declare some. */
PetscErrorCode HycoRegistryAdd(HycoRegistry *r, const char name[], HycoVoidFn *create)
{
  PetscFunctionBegin;
  HycoCheckGiven(name);
  HycoCheckGiven(create);
  PetscCall(RegistryBegin(r));
  PetscCall(RegistryAdd(r, name, create));
  PetscCall(HycoOptionsForgetTable());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRegistryFind_Private(HycoRegistry *r, const char name[], HycoVoidFn **create)
{
  PetscFunctionBegin;
  PetscCall(RegistryBegin(r));
  PetscCall(PetscFunctionListFind(r->create, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed; ends with NULL. */
PetscErrorCode HycoRegistryNames(HycoRegistry *r, PetscInt *n, const char *const **names)
{
  PetscFunctionBegin;
  PetscCall(RegistryBegin(r));
  if (n) *n = r->n;
  *names = (const char *const *)r->name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "a, b or c", with a suggestion, for messages about an unknown name. In the order of registration, or sorted if the
   registry is. */
PetscErrorCode HycoRegistryList(HycoRegistry *r, const char name[], char list[HYCO_LINE])
{
  const char *near;

  PetscFunctionBegin;
  PetscCall(RegistryBegin(r));
  list[0] = '\0';
  for (PetscInt k = 0; k < r->n; k++) PetscCall(HycoListAdd(list, k + 1 < r->n ? ", " : " or ", r->name[k]));
  near = HycoNearest(name, r->n, (const char *const *)r->name);
  if (near) PetscCall(HycoListAdd(list, "; did you mean ", near));
  if (near) PetscCall(PetscStrlcat(list, "?", HYCO_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
