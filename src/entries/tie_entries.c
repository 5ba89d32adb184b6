/* Tied surfaces: tie: {glue: {slave: GROUP, master: GROUP, tolerance: LENGTH,
   method: mortar or collocation}}. */
#include <hycosceneimpl.h>
#include <string.h>

/* field: index in the scene's tie_fields. tolerance -1: the default, from the size of the mesh. Groups are only names
   here: the mesh is read later. */
PetscErrorCode HycoSceneReadTie(HycoScene s, PetscInt entry, const char name[], PetscInt field)
{
  HycoTie *tie = NULL;
  char **group;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_ties; k++) {
    if (strcmp(s->tie[k].name, name) == 0) tie = &s->tie[k];
  }
  if (!tie) {
    PetscCall(PetscRealloc((size_t)(s->n_ties + 1) * sizeof(*s->tie), &s->tie));
    tie = &s->tie[s->n_ties++];
    *tie = (HycoTie){.tolerance = -1, .mortar = PETSC_TRUE};
    PetscCall(PetscStrallocpy(name, &tie->name));
  }
  if (field == 2) {
    char *end;

    tie->tolerance = HycoNumber(s->value[entry], &end);
    HycoCheck(end != s->value[entry] && !*end && tie->tolerance >= 0 && !PetscIsInfOrNanReal(tie->tolerance),
              "%s is \"%.100s\"; it must be a length, 0 or more", s->key[entry], s->value[entry]);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (field == 3) {
    tie->mortar = (PetscBool)(strcmp(s->value[entry], "mortar") == 0);
    HycoCheck(tie->mortar || strcmp(s->value[entry], "collocation") == 0,
              "%s is \"%.100s\"; it must be mortar or collocation", s->key[entry], s->value[entry]);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* An option of the command line comes after the file, and replaces its text. */
  group = field ? &tie->master : &tie->slave;
  PetscCall(PetscFree(*group));
  PetscCall(PetscStrallocpy(s->value[entry], group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A surface that is tied to itself would have chains of ties. */
PetscErrorCode HycoSceneCheckTies(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_ties; k++) {
    const HycoTie *tie = &s->tie[k];

    HycoCheck(tie->slave && tie->master, "tie %s has no %s; write tie: %s: {slave: GROUP, master: GROUP}", tie->name,
              tie->slave ? "master" : "slave", tie->name);
    HycoCheck(strcmp(tie->slave, tie->master),
              "tie %s: its slave and its master are the same group, %s; give two groups", tie->name, tie->slave);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSceneDestroyTies(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_ties; k++) HycoFreeAll(&s->tie[k].name, &s->tie[k].slave, &s->tie[k].master);
  PetscCall(PetscFree(s->tie));
  PetscFunctionReturn(PETSC_SUCCESS);
}
