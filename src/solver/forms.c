/* The registered forms of the contact system, and those of a solver. */
#include <hycoregistry.h>
#include <hycosolverimpl.h>
#include <string.h>

static PetscErrorCode AddOwn(void);
static HycoRegistry forms = {.add_own = AddOwn}; /* searched in the order of registration */

static PetscErrorCode AddOwn(void)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&forms, "dual", HycoSolverFormCreate_Dual));
  PetscCall(HycoRegistryAdd(&forms, "primal", HycoSolverFormCreate_Primal));
  PetscCall(HycoRegistryAdd(&forms, "dual_free", HycoSolverFormCreate_Shell));
  PetscCall(HycoRegistryAdd(&forms, "projected", HycoSolverFormCreate_Projected));
  PetscCall(HycoRegistryAdd(&forms, "linear", HycoSolverFormCreate_Linear));
  PetscCall(HycoRegistryAdd(&forms, "condensed", HycoSolverFormCreate_Flexibility));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverRegister(const char name[], HycoSolverFormCreate create)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&forms, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverCreateForms(HycoSolver s)
{
  const char *const *names;

  PetscFunctionBegin;
  PetscCall(HycoRegistryNames(&forms, &s->n_forms, &names));
  PetscCall(PetscCalloc1(s->n_forms, &s->forms));
  for (PetscInt k = 0; k < s->n_forms; k++) {
    HycoSolverFormCreate create;

    PetscCall(PetscNew(&s->forms[k]));
    PetscCall(PetscStrncpy(s->forms[k]->name, names[k], sizeof(s->forms[k]->name)));
    PetscCall(HycoRegistryFind(&forms, names[k], &create));
    PetscCall(create(s, s->forms[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoSolverForm HycoSolverFindForm(HycoSolver s, const char name[])
{
  for (PetscInt k = 0; k < s->n_forms; k++) {
    if (strcmp(s->forms[k]->name, name) == 0) return s->forms[k];
  }
  return NULL;
}
