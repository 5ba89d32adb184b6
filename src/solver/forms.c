/* The forms of the contact system that are registered, and a solver's own. */
#include <hycosolverimpl.h>
#include <string.h>

static PetscFunctionList forms = NULL;

/* PETSc's lists end with PetscFinalize(). */
static PetscErrorCode Forget(void)
{
  PetscFunctionBegin;
  PetscCall(PetscFunctionListDestroy(&forms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Add(const char name[], HycoSolverFormCreate create)
{
  PetscFunctionBegin;
  if (!forms) PetscCall(PetscRegisterFinalize(Forget));
  PetscCall(PetscFunctionListAdd(&forms, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RegisterAll(void)
{
  PetscFunctionBegin;
  if (forms) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Add("dual", HycoSolverFormCreate_Dual));
  PetscCall(Add("primal", HycoSolverFormCreate_Primal));
  PetscCall(Add("dual_free", HycoSolverFormCreate_Shell));
  PetscCall(Add("linear", HycoSolverFormCreate_Linear));
  PetscCall(Add("condensed", HycoSolverFormCreate_Flexibility));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverRegister(const char name[], HycoSolverFormCreate create)
{
  PetscFunctionBegin;
  PetscCall(RegisterAll());
  PetscCall(Add(name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverCreateForms(HycoSolver s)
{
  const char **names;
  int n;

  PetscFunctionBegin;
  PetscCall(RegisterAll());
  PetscCall(PetscFunctionListGet(forms, &names, &n));
  while (n && !names[n - 1]) n--; /* older versions of PETSc count the NULL at the end */
  s->n_forms = n;
  PetscCall(PetscCalloc1(n, &s->forms));
  for (int k = 0; k < n; k++) {
    HycoSolverFormCreate create;

    PetscCall(PetscNew(&s->forms[k]));
    PetscCall(PetscStrncpy(s->forms[k]->name, names[k], sizeof(s->forms[k]->name)));
    PetscCall(PetscFunctionListFind(forms, names[k], &create));
    PetscCall(create(s, s->forms[k]));
  }
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoSolverForm HycoSolverFindForm(HycoSolver s, const char name[])
{
  for (PetscInt k = 0; k < s->n_forms; k++) {
    if (strcmp(s->forms[k]->name, name) == 0) return s->forms[k];
  }
  return NULL;
}
