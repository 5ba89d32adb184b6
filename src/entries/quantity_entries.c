/* Outputs named in a scene: output: {hoop: {max: sigma_tt, group: bore}}. */
#include <hycocontactimpl.h>
#include <string.h>

const char *const HycoQuantityFields[] = {
    "u",        "u_x",         "u_y",         "u_z",         "sigma_xx",         "sigma_yy",
    "sigma_zz", "sigma_xy",    "sigma_yz",    "sigma_xz",    "sigma_rr",         "sigma_tt",
    "mises",    "principal_1", "principal_2", "principal_3", "contact_pressure", NULL};

/* The index in HycoQuantityFields is the field's number in output/quantities.c. */
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

/* One letter: xy, for instance, would be taken for a shear stress. */
static PetscErrorCode FindAxis(const char key[], const char axis[], PetscInt *field)
{
  PetscFunctionBegin;
  HycoCheck(axis[0] && !axis[1] && strchr("xyz", axis[0]), "%s is \"%.100s\"; it must be one of x, y and z", key, axis);
  *field = axis[0] - 'x';
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* field: index in the scene's output_fields, whose order is that of HycoQuantityKind up to AREA; after it come group,
   contact and path. Entries of one output come in any order; what they must have together is checked by
   HycoSceneCheckQuantities(). */
PetscErrorCode HycoSceneReadQuantity(HycoScene s, PetscInt entry, const char name[], PetscInt field)
{
  HycoQuantity *q = NULL;

  PetscFunctionBegin;
  HycoCheck(HycoIsVariableName(name),
            "%s: \"%s\" cannot name an output; use letters, digits and _, and none of x, y, z, pi", s->key[entry],
            name);
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (strcasecmp(s->quantity[k].name, name) == 0) q = &s->quantity[k];
  }
  /* The first entry of this output. All have room at once, so that pointers to them stay valid. */
  if (!q) {
    HycoCheck(s->n_quantities < HYCO_MAX_QUANTITIES, "the scene has more than %d outputs", HYCO_MAX_QUANTITIES);
    if (!s->quantity) PetscCall(PetscCalloc1(HYCO_MAX_QUANTITIES, &s->quantity));
    q = &s->quantity[s->n_quantities++];
    PetscCall(PetscStrallocpy(name, &q->name));
  }
  if (field == HYCO_QUANTITY_AREA + 3) {
    static const char *const words[] = {"", "max", "min", "absolute"};
    PetscInt k = HYCO_EXTREME_MAX;

    while (k <= HYCO_EXTREME_ABSOLUTE && strcmp(words[k], s->value[entry])) k++;
    HycoCheck(k <= HYCO_EXTREME_ABSOLUTE, "%s is \"%.100s\"; it must be one of max, min and absolute", s->key[entry],
              s->value[entry]);
    q->path = (HycoExtreme)k;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (field > HYCO_QUANTITY_AREA) {
    /* An option may replace the text of the file. */
    char **place = field == HYCO_QUANTITY_AREA + 1 ? &q->group : &q->contact;

    PetscCall(PetscFree(*place));
    PetscCall(PetscStrallocpy(s->value[entry], place));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoCheck(
      !q->given,
      "%s: the output %s already has one of max, min, mean, reaction, force, moment, friction and area; give each "
      "output its own name",
      s->key[entry], name);
  q->given = PETSC_TRUE;
  q->kind = (HycoQuantityKind)field;
  if (field == HYCO_QUANTITY_FRICTION && strcmp(s->value[entry], "work") == 0)
    q->field = HYCO_FRICTION_WORK;
  else if (field == HYCO_QUANTITY_AREA)
    HycoCheck(strcmp(s->value[entry], "closed") == 0,
              "%s is \"%.100s\"; it must be closed: the area of closed contacts", s->key[entry], s->value[entry]);
  else if (field >= HYCO_QUANTITY_REACTION)
    PetscCall(FindAxis(s->key[entry], s->value[entry], &q->field));
  else
    PetscCall(FindField(s->key[entry], s->value[entry], &q->field));
  /* A field of contacts, not of nodes or cells: the extremes have kinds of their own, with other data. */
  if (field < HYCO_QUANTITY_REACTION && strcmp(HycoQuantityFields[q->field], "contact_pressure") == 0) {
    HycoCheck(
        q->kind != HYCO_QUANTITY_MEAN,
        "%s: there is no mean of contact_pressure; write max: or min: contact_pressure, or divide a force by an area",
        s->key[entry]);
    q->kind = q->kind == HYCO_QUANTITY_MAX ? HYCO_QUANTITY_PRESSURE : HYCO_QUANTITY_PRESSURE_MIN;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL: not given. */
static PetscBool SameText(const char a[], const char b[])
{
  return (PetscBool)(a && b ? !strcmp(a, b) : a == b);
}

/* at[k]: which of the other scene's outputs is the same as k; -1: none. By what is measured, not by name alone: a
   model's scene may be older. */
void HycoSceneMatchQuantities(HycoScene s, HycoScene other, PetscInt at[])
{
  for (PetscInt k = 0; s && other && at && k < s->n_quantities; k++) {
    const HycoQuantity *q = &s->quantity[k];

    at[k] = -1;
    for (PetscInt j = 0; j < other->n_quantities; j++) {
      const HycoQuantity *r = &other->quantity[j];

      if (!strcasecmp(q->name, r->name) && q->kind == r->kind && q->field == r->field && q->path == r->path &&
          SameText(q->group, r->group) && SameText(q->contact, r->contact))
        at[k] = j;
    }
  }
}

/* From kind `first` to `last`, in their order. */
PetscBool HycoSceneHasOutputs(HycoScene s, HycoQuantityKind first, HycoQuantityKind last)
{
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].kind >= first && s->quantity[k].kind <= last) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscBool HycoSceneHasReactions(HycoScene s)
{
  return HycoSceneHasOutputs(s, HYCO_QUANTITY_REACTION, HYCO_QUANTITY_REACTION);
}

/* Kinds are ordered: those of fields from MAX to REACTION, those of contacts from FORCE on. */
PetscBool HycoSceneHasFieldOutputs(HycoScene s)
{
  return HycoSceneHasOutputs(s, HYCO_QUANTITY_MAX, HYCO_QUANTITY_REACTION);
}

PetscBool HycoSceneHasContactOutputs(HycoScene s)
{
  return HycoSceneHasOutputs(s, HYCO_QUANTITY_FORCE, HYCO_QUANTITY_PRESSURE_MIN);
}

/* A quantity of contacts has a contact of the scene or none; one of a field has no contact. After all contacts are
   read. */
static PetscErrorCode CheckContact(HycoScene s, const HycoQuantity *q)
{
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  HycoCheck(q->kind >= HYCO_QUANTITY_FORCE || !q->contact,
            "the output %s names the contact %s, which is for force, moment, friction, area and contact_pressure; give "
            "a group instead",
            q->name, q->contact);
  if (q->kind < HYCO_QUANTITY_FORCE) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(s->n_contacts, "the output %s is for a contact, and the scene has none; remove it", q->name);
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    if (q->contact && strcmp(q->contact, s->contact[c]->name) == 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(HycoListAdd(list, ", ", s->contact[c]->name));
  }
  HycoCheck(!q->contact, "the output %s names the contact %s, which does not exist; the contacts of the scene are: %s",
            q->name, q->contact, list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outputs and parameters are columns of one table. */
PetscErrorCode HycoSceneCheckQuantities(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_quantities * s->n_parameters; k++)
    HycoCheck(strcasecmp(s->quantity[k / s->n_parameters].name, s->parameter[k % s->n_parameters]),
              "the output %s has the name of a parameter; give it another", s->quantity[k / s->n_parameters].name);
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    HycoCheck(
        s->quantity[k].given,
        "the output %s has no field; write output: {%s: {max: mises, group: ...}}, or min, mean, reaction, force, "
        "moment, friction or area",
        s->quantity[k].name, s->quantity[k].name);
    PetscCall(CheckContact(s, &s->quantity[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
