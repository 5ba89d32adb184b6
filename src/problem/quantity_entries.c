/* Numbers that a scene asks of each solution: output: {hoop: {max: sigma_tt, group: bore}}. */
#include <hycosceneimpl.h>
#include <string.h>

const char *const HycoQuantityFields[] = {
    "u",        "u_x",      "u_y",      "u_z",   "sigma_xx",    "sigma_yy",    "sigma_zz",    "sigma_xy", "sigma_yz",
    "sigma_xz", "sigma_rr", "sigma_tt", "mises", "principal_1", "principal_2", "principal_3", NULL};

static PetscErrorCode FindField(const char key[], const char text[], PetscInt *field)
{
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (*field = 0; HycoQuantityFields[*field]; ++*field) {
    if (strcasecmp(HycoQuantityFields[*field], text) == 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(HycoListAdd(list, ", ", HycoQuantityFields[*field]));
  }
  HycoFail("%s is \"%.100s\"; it must be one of %s", key, text, list);
}

PetscErrorCode HycoSceneReadQuantity(HycoScene s, PetscInt entry, const char name[], PetscInt field)
{
  HycoQuantity *q = NULL;

  PetscFunctionBegin;
  HycoCheck(HycoIsVariableName(name), "%s: \"%s\" cannot name an output; use letters, digits and _", s->key[entry],
            name);
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (strcasecmp(s->quantity[k].name, name) == 0) q = &s->quantity[k];
  }
  if (!q) {
    HycoCheck(s->n_quantities < HYCO_MAX_QUANTITIES, "the scene has more than %d outputs", HYCO_MAX_QUANTITIES);
    if (!s->quantity) PetscCall(PetscCalloc1(HYCO_MAX_QUANTITIES, &s->quantity));
    q = &s->quantity[s->n_quantities++];
    PetscCall(PetscStrallocpy(name, &q->name));
  }
  if (field > HYCO_QUANTITY_REACTION) {
    PetscCall(PetscFree(q->group));
    PetscCall(PetscStrallocpy(s->value[entry], &q->group));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoCheck(!q->given,
            "%s: the output %s already has one of max, min, mean and reaction; give each output its own name",
            s->key[entry], name);
  q->given = PETSC_TRUE;
  q->kind = (HycoQuantityKind)field;
  if (q->kind == HYCO_QUANTITY_REACTION) {
    const char *axis = s->value[entry];

    HycoCheck(axis[0] && !axis[1] && strchr("xyz", axis[0]), "%s is \"%.100s\"; a reaction must be along x, y or z",
              s->key[entry], axis);
    q->field = axis[0] - 'x';
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FindField(s->key[entry], s->value[entry], &q->field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoSceneHasReactions(HycoScene s)
{
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].kind == HYCO_QUANTITY_REACTION) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode HycoSceneCheckQuantities(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_quantities * s->n_parameters; k++)
    HycoCheck(strcasecmp(s->quantity[k / s->n_parameters].name, s->parameter[k % s->n_parameters]),
              "the output %s has the name of a parameter; give it another", s->quantity[k / s->n_parameters].name);
  for (PetscInt k = 0; k < s->n_quantities; k++)
    HycoCheck(s->quantity[k].given,
              "the output %s has no field; write output: {%s: {max: mises, group: ...}}, or min, mean or reaction",
              s->quantity[k].name, s->quantity[k].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
