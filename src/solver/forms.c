/* The registered forms of the contact system, and those of a solver. */
#include <hycoregistry.h>
#include <hycosolverimpl.h>
#include <string.h>

static HycoRegistry forms = {.sorted = PETSC_FALSE}; /* searched in the order of registration */

HycoDefineRegister(HycoSolverRegister, forms, HycoSolverFormCreate create)

/* A private instance of each form, since a form keeps factors and the last active set. */
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

/* A linear search: there are about six forms, and it is called a few times per solve. */
HycoSolverForm HycoSolverFindForm(HycoSolver s, const char name[])
{
  for (PetscInt k = 0; k < s->n_forms; k++) {
    if (strcmp(s->forms[k]->name, name) == 0) return s->forms[k];
  }
  return NULL;
}
