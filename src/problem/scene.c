/* HycoScene: from entries to bodies, supports, loads, contacts and parameters. */
#include <hycoentries.h>
#include <hycocontactimpl.h>
#include <hycomaterialimpl.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Fields of a section's members; the name of a member is the text between the section and the field. */
static const char *const body_fields[] = {
    "element",   "map_x",    "map_y",   "map_z", "law", "temperature", "reference_temperature",
    "expansion", "law_type", "density", NULL};
static const char *const component_fields[] = {"x", "y", "z", NULL};
static const char *const fixed_fields[] = {"x", "y", "z", "normal", "direction_x", "direction_y", "direction_z", NULL};
static const char *const spring_fields[] = {"x", "y", "z", "normal", NULL};
static const char *const contact_fields[] = {"type", NULL};
static const char *const tie_fields[] = {"slave", "master", "tolerance", "method", NULL};
static const char *const output_fields[] = {"max",      "min",  "mean",  "reaction", "force", "moment",
                                            "friction", "area", "group", "contact",  "path",  NULL};
static const char *const scene_fields[] = {"title",       "mesh",       "parameters",  "refine", "formulation",
                                           "unit_length", "unit_force", "unit_stress", NULL};
static const char *const parameter_fields[] = {"range", "unit", "title", NULL};

/* Splits "body_pellet_young" after "body_" into "pellet" and the index of "young"; false if it does not end with a
   field. */
static PetscBool SplitKey(const char *rest, const char *const fields[], char name[HYCO_LINE], PetscInt *field)
{
  size_t length = strlen(rest), best = 0;

  for (PetscInt f = 0; fields[f]; f++) {
    size_t tail = strlen(fields[f]);

    /* The longest field that fits: "reference_temperature", not "temperature" of "body_a_reference". */
    if (tail > best && length > tail + 1 && rest[length - tail - 1] == '_' &&
        strcasecmp(rest + length - tail, fields[f]) == 0) {
      best = tail;
      *field = f;
    }
  }
  if (!best || length - best - 1 >= HYCO_LINE) return PETSC_FALSE;
  memcpy(name, rest, length - best - 1);
  name[length - best - 1] = '\0';
  return PETSC_TRUE;
}

/* declared: further fields, those of a law or a contact type; or NULL. Always fails. */
static PetscErrorCode UnknownKey(const char key[], const char what[], const HycoDeclared *declared,
                                 const char *const others[])
{
  char list[HYCO_LINE] = "";
  const char *last = strrchr(key, '_'), *near = NULL, *fields[HYCO_MAX_DECLARED + 16];
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt j = 0; declared && j < declared->n; j++) fields[n++] = declared->entry[j].name;
  for (PetscInt j = 0; others[j]; j++) fields[n++] = others[j];
  for (PetscInt j = 0; j < n; j++) {
    const size_t used = strlen(list);

    PetscCall(PetscSNPrintf(list + used, sizeof(list) - used, "%s%s", j ? ", " : "", fields[j]));
  }
  /* Compared with the key's last word: names of members may contain anything. */
  if (last) near = HycoNearest(last + 1, n, fields);
  if (near) HycoFail("the scene's entry %s is unknown; %s has: %s; did you mean %s?", key, what, list, near);
  HycoFail("the scene's entry %s is unknown; %s has: %s", key, what, list);
}

/* Finds or adds the member `name` of an array of structs whose first field is its name. Pointers to members are
   invalid afterwards: the array may move. New members are zero: all their expressions are not given. */
static PetscErrorCode SceneMember(const char name[], size_t size, PetscInt *n, void **array, PetscInt *index)
{
  char *items = (char *)*array;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < *n; k++) {
    char *known;

    /* By memcpy: the struct's type is not known here, and its first field is the pointer. */
    memcpy(&known, items + (size_t)k * size, sizeof(known));
    if (strcmp(known, name) == 0) {
      *index = k;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  PetscCall(PetscRealloc(((size_t)*n + 1) * size, array));
  items = (char *)*array;
  /* Zero is "not given" for every field, and what HycoSceneDestroy() skips. */
  memset(items + (size_t)*n * size, 0, size);
  {
    char *copy;

    PetscCall(PetscStrallocpy(name, &copy));
    memcpy(items + (size_t)*n * size, &copy, sizeof(copy));
  }
  *index = (*n)++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Option names do not distinguish case: the same entry in other letters replaces the former one, another entry for the
   same group is an error. */
static PetscErrorCode NewExpr(HycoScene s, PetscInt entry, HycoExpr *expr)
{
  PetscFunctionBegin;
  HycoCheck(!*expr || strcasecmp(HycoExprKey(*expr), s->key[entry]) == 0,
            "%s and %s are for the same group; remove one of them", HycoExprKey(*expr), s->key[entry]);
  PetscCall(HycoExprDestroy(expr)); /* the same entry in other letter case */
  PetscCall(HycoSceneExpression(s, s->key[entry], s->value[entry], expr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An expression that must not contain the temperature: all except constants of laws. */
static PetscErrorCode NewColdExpr(HycoScene s, PetscInt entry, HycoExpr *expr)
{
  PetscFunctionBegin;
  PetscCall(NewExpr(s, entry, expr));
  PetscCall(HycoExprRefuseHeat(*expr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two finite numbers separated by a comma. PETSc's own reader of arrays leaks memory when it fails. Strict: what
   follows the second number is an error. */
static PetscBool SplitRange(const char text[], PetscReal range[2])
{
  char *end;

  range[0] = HycoNumber(text, &end);
  if (end == text) return PETSC_FALSE;
  text = end + strspn(end, " ");
  if (*text++ != ',') return PETSC_FALSE;
  range[1] = HycoNumber(text, &end);
  if (end == text || end[strspn(end, " ")]) return PETSC_FALSE;
  return (PetscBool)(!PetscIsInfOrNanReal(range[0]) && !PetscIsInfOrNanReal(range[1]) && range[0] <= range[1]);
}

/* From the entry's text, so that the message can show the form that is expected. */
static PetscErrorCode ReadRange(HycoScene s, PetscInt p)
{
  char key[HYCO_LINE];
  const char *text = NULL;
  PetscReal range[2];
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(key, sizeof(key), "-parameter_%s_range", s->parameter[p]));
  PetscCall(PetscOptionsFindPair(s->options, NULL, key, &text, &set));
  HycoCheck(set && text && SplitRange(text, range),
            "parameter %s: its range is missing or wrong; write parameter: %s: range: [lowest, highest]",
            s->parameter[p], s->parameter[p]);
  s->lo[p] = range[0];
  s->hi[p] = range[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The commas are counted first: PETSc would silently drop names beyond the array's length. */
static PetscErrorCode ReadParameters(HycoScene s)
{
  PetscInt n = HYCO_MAX_PARAMETERS, commas = 0;
  const char *list = NULL;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsFindPair(s->options, NULL, "-scene_parameters", &list, &set));
  for (const char *c = set && list ? list : ""; *c; c++) commas += *c == ',';
  HycoCheck(commas < HYCO_MAX_PARAMETERS, "scene_parameters lists %d parameters; a scene has at most %d",
            (int)commas + 1, HYCO_MAX_PARAMETERS);
  PetscCall(PetscOptionsGetStringArray(s->options, NULL, "-scene_parameters", s->parameter, &n, &set));
  /* Set before the checks below: destroying the scene frees the names counted here. */
  s->n_parameters = s->n_variables = set ? n : 0;
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const char *name = s->parameter[p];

    HycoCheck(HycoIsVariableName(name),
              "scene_parameters: \"%s\" cannot name a parameter; use letters, digits and _, and none of x, y, z, pi",
              name);
    /* Without case, since parameter_NAME_range is an option, and PETSc's options have none. */
    for (PetscInt q = 0; q < p; q++)
      HycoCheck(strcasecmp(s->parameter[q], name), "scene_parameters: %s occurs twice; remove one of them", name);
    PetscCall(ReadRange(s, p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `element` says that the entry was given. */
static PetscErrorCode ReadElement(HycoScene s, PetscInt entry, HycoBody *body)
{
  const char *value = s->value[entry];

  PetscFunctionBegin;
  body->element = PETSC_TRUE;
  body->bbar = (PetscBool)(strcmp(value, "bbar") == 0);
  HycoCheck(body->bbar || strcmp(value, "standard") == 0, "%s is \"%s\"; it must be standard or bbar", s->key[entry],
            value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A section whose members have a type that declares entries: bodies with their laws, contacts. */
typedef struct {
  const char *what, *const *others; /* for messages; entries besides the declared ones */
  const char *nested;               /* prefix allowed before the declared ones; or NULL */
  PetscErrorCode (*create)(HycoScene, const char name[], PetscObject *object, HycoDeclared **declared,
                           PetscBool *given);
} Section;

/* The type's name given in the scene for a member. The last value given, as PETSc's database keeps it. */
static PetscErrorCode GetType(HycoScene s, const char section[], const char name[], const char field[],
                              const char **type, PetscBool *given)
{
  char dashed[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s_%s_%s", section, name, field));
  PetscCall(PetscOptionsFindPair(s->options, NULL, dashed, type, given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the law's texts, "-body_NAME_law_library" or "-body_NAME_library", on which its other declarations depend. */
static PetscErrorCode ReadTexts(HycoScene s, const char name[], HycoMaterial law)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < law->constants.n; j++) {
    HycoEntry *e = &law->constants.entry[j];
    char field[HYCO_LINE];
    const char *text = NULL;
    PetscBool set;

    /* Declared as texts; numbers are read with the other entries. */
    if (e->kind != HYCO_ENTRY_GROUP) continue;
    HycoFormat(field, "law_%s", e->name);
    PetscCall(GetType(s, "body", name, field, &text, &set));
    if (!set) PetscCall(GetType(s, "body", name, e->name, &text, &set));
    if (set && text) PetscCall(PetscStrallocpy(text, &e->text));
  }
  law->folder = s->folder;
  if (law->ops->declare) PetscCall((*law->ops->declare)(law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the law given in the scene for the body `name`. The caller owns it. Also for names that are only tried
   by SplitDeclared(): *given tells whether the scene names a type. */
static PetscErrorCode CreateLaw(HycoScene s, const char name[], PetscObject *object, HycoDeclared **declared,
                                PetscBool *given)
{
  const char *type = NULL;
  HycoMaterial law;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(GetType(s, "body", name, "law_type", &type, given));
  /* body_NAME_law is the short form of body_NAME_law_type. */
  if (!*given) PetscCall(GetType(s, "body", name, "law", &type, given));
  PetscCall(HycoMaterialCreate(PETSC_COMM_SELF, &law));
  /* The name of the body, which the law's messages show. */
  PetscCall(PetscObjectSetName((PetscObject)law, name));
  ierr = HycoMaterialSetType(law, *given ? type : HYCO_MATERIAL_ELASTIC);
  /* Texts, such as a law's file, decide which constants it declares: before the first constant is looked up. */
  if (!ierr) ierr = ReadTexts(s, name, law);
  if (ierr) PetscCall(HycoMaterialDestroy(&law));
  PetscCall(ierr);
  *declared = &law->constants;
  *object = (PetscObject)law;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for the contact `name`; an obstacle if the scene gives no type. */
static PetscErrorCode CreateContact(HycoScene s, const char name[], PetscObject *object, HycoDeclared **declared,
                                    PetscBool *given)
{
  const char *type = NULL;
  HycoContact contact;

  PetscFunctionBegin;
  PetscCall(GetType(s, "contact", name, "type", &type, given));
  PetscCall(HycoContactCreate(PETSC_COMM_SELF, &contact));
  PetscCall(PetscObjectSetName((PetscObject)contact, name));
  HycoOnError(HycoContactSetType(contact, *given ? type : HYCO_CONTACT_OBSTACLE),
              PetscCall(HycoContactDestroy(&contact)));
  *declared = &contact->entries;
  *object = (PetscObject)contact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const Section contacts = {"a contact of type", contact_fields, NULL, CreateContact};
static const Section bodies = {"a body of law", body_fields, "law_", CreateLaw};

/* Splits "a_b_young" into name and field: b_young of a if the type of a declares it, else young of a_b; NULL if
   neither. likely: the member that was probably meant, with its type, for the message; the caller destroys it. */
static PetscErrorCode SplitDeclared(HycoScene s, const Section *section, const char rest[], char name[HYCO_LINE],
                                    const char **field, PetscObject *likely, HycoDeclared **declared)
{
  PetscFunctionBegin;
  *field = NULL;
  for (const char *bar = strchr(rest, '_'); bar && !*field; bar = strchr(bar + 1, '_')) {
    PetscObject object;
    HycoDeclared *of_object;
    PetscBool given;

    /* A name is not empty, and fits name[]. */
    if (bar == rest || bar - rest >= HYCO_LINE) continue;
    memcpy(name, rest, (size_t)(bar - rest));
    name[bar - rest] = '\0';
    PetscCall((*section->create)(s, name, &object, &of_object, &given));
    if (HycoDeclaredFind(of_object, bar + 1)) *field = bar + 1;
    /* young may also be written as law_young: {law: {type: ..., young: ...}} in YAML is flattened so. */
    if (section->nested && strncasecmp(bar + 1, section->nested, strlen(section->nested)) == 0 &&
        HycoDeclaredFind(of_object, bar + 1 + strlen(section->nested)))
      *field = bar + 1 + strlen(section->nested);
    /* A member whose type the scene gives is surely meant; else the first one tried is the best guess. */
    if (given || !*likely) {
      PetscCall(PetscObjectDestroy(likely));
      *likely = object;
      *declared = of_object;
    } else
      PetscCall(PetscObjectDestroy(&object));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The member and the field of an entry that a type declares; fails if no type does. */
static PetscErrorCode FindDeclared(HycoScene s, const Section *section, const char key[], const char rest[],
                                   char name[HYCO_LINE], const char **field)
{
  PetscObject likely = NULL;
  HycoDeclared *declared = NULL;
  char what[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = SplitDeclared(s, section, rest, name, field, &likely, &declared);
  HycoFormat(what, "%s %s", section->what, likely ? likely->type_name : "...");
  /* UnknownKey() needs the declared fields of `likely`, which is destroyed only afterwards. */
  if (!ierr && !*field) ierr = UnknownKey(key, what, declared, section->others);
  PetscCall(PetscObjectDestroy(&likely));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body of that name; its law is created at its first entry, because the law decides which entries are valid. */
static PetscErrorCode FindBody(HycoScene s, const char name[], HycoBody **body)
{
  PetscInt k = 0;

  PetscFunctionBegin;
  PetscCall(SceneMember(name, sizeof(HycoBody), &s->n_bodies, (void **)&s->body, &k));
  *body = &s->body[k];
  if (!(*body)->law) {
    HycoDeclared *declared;
    PetscBool given;

    PetscCall(CreateLaw(s, name, (PetscObject *)&(*body)->law, &declared, &given));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields that every law has are read here, by their place in body_fields; all others must be constants that the body's
   law declares. */
static PetscErrorCode ReadBody(HycoScene s, PetscInt entry, const char rest[])
{
  const char *key = s->key[entry], *constant;
  char name[HYCO_LINE];
  PetscInt field = 0;
  HycoBody *body;

  PetscFunctionBegin;
  if (!SplitKey(rest, body_fields, name, &field)) {
    /* May create and drop laws of names that are tried; FindBody() then adds the one that was found. */
    PetscCall(FindDeclared(s, &bodies, key, rest, name, &constant));
    PetscCall(FindBody(s, name, &body));
    PetscCall(HycoDeclaredRead(s, key, s->value[entry], HycoDeclaredFind(&body->law->constants, constant)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FindBody(s, name, &body)); /* reads `law` */
  if (field == 0) PetscCall(ReadElement(s, entry, body));
  if (field > 0 && field < 4) PetscCall(NewColdExpr(s, entry, &body->map[field - 1]));
  if (field == 5) PetscCall(NewColdExpr(s, entry, &body->temperature));
  if (field == 6) PetscCall(NewColdExpr(s, entry, &body->reference));
  if (field == 7) PetscCall(NewExpr(s, entry, &body->expansion));
  if (field == 9) PetscCall(NewColdExpr(s, entry, &body->density));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact of that name; created at its first entry, since its type decides which entries are valid. */
static PetscErrorCode FindContact(HycoScene s, const char name[], HycoContact *contact)
{
  HycoDeclared *declared;
  PetscBool given;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    *contact = s->contact[k];
    if (strcmp(((PetscObject)*contact)->name, name) == 0) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscRealloc((size_t)(s->n_contacts + 1) * sizeof(*s->contact), &s->contact));
  /* Counted only afterwards: a failed creation has destroyed its object. */
  PetscCall(CreateContact(s, name, (PetscObject *)contact, &declared, &given));
  s->contact[s->n_contacts++] = *contact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `type` has been read when the contact was created; all other fields are those that the type declares. The type may
   come after the entries that it declares. */
static PetscErrorCode ReadContact(HycoScene s, PetscInt entry, const char rest[])
{
  const char *key = s->key[entry], *field;
  char name[HYCO_LINE];
  PetscInt type;
  HycoContact contact;

  PetscFunctionBegin;
  /* `type` alone is no field of a type: it is known without one. */
  if (SplitKey(rest, contact_fields, name, &type)) {
    PetscCall(FindContact(s, name, &contact)); /* reads it */
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FindDeclared(s, &contacts, key, rest, name, &field));
  PetscCall(FindContact(s, name, &contact));
  PetscCall(HycoDeclaredRead(s, key, s->value[entry], HycoDeclaredFind(&contact->entries, field)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next of the groups in an entry, "left" or "left,right"; NULL: no more. */
static char *NextGroup(char names[], char **rest)
{
  char *name = strtok_r(names, ",", rest);

  if (!name) return NULL;
  name += strspn(name, " ");
  while (*name && name[strlen(name) - 1] == ' ') name[strlen(name) - 1] = '\0';
  return name;
}

/* Whether the scene has a body of this name: bodies are read before forces. */
static PetscBool IsBody(HycoScene s, const char name[])
{
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    if (strcmp(s->body[b].name, name) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* A force per unit volume of a body, or on a group of points or lines. A name is a body's if there is one, else a
   group's: entries are sorted, and body_ comes before force_. */
static PetscErrorCode ReadForce(HycoScene s, PetscInt entry, const char name[], PetscInt field)
{
  PetscInt k = 0;
  HycoBody *body;

  PetscFunctionBegin;
  if (IsBody(s, name)) {
    PetscCall(FindBody(s, name, &body));
    PetscCall(NewColdExpr(s, entry, &body->force[field]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Points and lines exist only in the mesh: whether the group does is checked when the mesh is read. */
  PetscCall(SceneMember(name, sizeof(HycoPointLoad), &s->n_point_loads, (void **)&s->point_load, &k));
  PetscCall(NewColdExpr(s, entry, &s->point_load[k].force[field]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an entry of a section whose members are groups: its expression, for each of its groups. strtok_r() changes
   names[], which is the caller's copy. */
static PetscErrorCode ReadGroups(HycoScene s, PetscInt entry, char names[], PetscInt field)
{
  const char *key = s->key[entry];
  char *rest;

  PetscFunctionBegin;
  for (char *name = NextGroup(names, &rest); name; name = NextGroup(NULL, &rest)) {
    PetscInt k = 0;

    /* The section is told by the key; field is the component within it, as the caller's list has it. */
    if (strncasecmp(key, "force_", 6) == 0) {
      PetscCall(ReadForce(s, entry, name, field));
    } else if (strncasecmp(key, "spring_", 7) == 0) {
      PetscCall(SceneMember(name, sizeof(HycoSpring), &s->n_springs, (void **)&s->spring, &k));
      PetscCall(NewColdExpr(s, entry, &s->spring[k].stiffness[field]));
    } else if (strncasecmp(key, "fixed_", 6) == 0) {
      PetscCall(SceneMember(name, sizeof(HycoFixed), &s->n_fixed, (void **)&s->fixed, &k));
      PetscCall(NewColdExpr(s, entry,
                            field < 3    ? &s->fixed[k].value[field]
                            : field == 3 ? &s->fixed[k].normal
                                         : &s->fixed[k].direction[field - 4]));
    } else {
      PetscCall(SceneMember(name, sizeof(HycoLoad), &s->n_loads, (void **)&s->load, &k));
      PetscCall(NewColdExpr(s, entry, field < 0 ? &s->load[k].pressure : &s->load[k].traction[field]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads one entry of a section with members. field -1: a pressure, which has no field. */
static PetscErrorCode ReadMember(HycoScene s, PetscInt entry)
{
  const char *key = s->key[entry], *rest = strchr(key, '_') + 1, *what = NULL;
  char name[HYCO_LINE];
  PetscInt field = -1;

  PetscFunctionBegin;
  if (strncasecmp(key, "force_", 6) == 0) what = "a force";
  if (strncasecmp(key, "traction_", 9) == 0) what = "a traction";
  if (strncasecmp(key, "body_", 5) == 0) {
    PetscCall(ReadBody(s, entry, rest));
  } else if (strncasecmp(key, "fixed_", 6) == 0) {
    /* An unknown field is refused here with the section's list, before a member is added. */
    if (!SplitKey(rest, fixed_fields, name, &field)) PetscCall(UnknownKey(key, "a fixed group", NULL, fixed_fields));
    PetscCall(ReadGroups(s, entry, name, field));
  } else if (what) {
    if (!SplitKey(rest, component_fields, name, &field)) PetscCall(UnknownKey(key, what, NULL, component_fields));
    PetscCall(ReadGroups(s, entry, name, field));
  } else if (strncasecmp(key, "spring_", 7) == 0) {
    if (!SplitKey(rest, spring_fields, name, &field)) PetscCall(UnknownKey(key, "a spring", NULL, spring_fields));
    PetscCall(ReadGroups(s, entry, name, field));
  } else if (strncasecmp(key, "gravity_", 8) == 0 || strncasecmp(key, "rotation_", 9) == 0) {
    PetscCall(HycoSceneReadMotion(s, entry));
  } else if (strncasecmp(key, "tie_", 4) == 0) {
    if (!SplitKey(rest, tie_fields, name, &field)) PetscCall(UnknownKey(key, "a tie", NULL, tie_fields));
    PetscCall(HycoSceneReadTie(s, entry, name, field));
  } else if (strncasecmp(key, "output_", 7) == 0) {
    if (!SplitKey(rest, output_fields, name, &field)) PetscCall(UnknownKey(key, "an output", NULL, output_fields));
    PetscCall(HycoSceneReadQuantity(s, entry, name, field));
  } else if (strncasecmp(key, "pressure_", 9) == 0) {
    PetscCall(PetscStrncpy(name, rest, sizeof(name)));
    PetscCall(ReadGroups(s, entry, name, -1));
  } else {
    PetscCall(ReadContact(s, entry, rest));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene_, parameter_ and hyco_ entries are read elsewhere; this checks their names. Read before, by PETSc's
   database; unknown names would have no effect without a message. */
static PetscErrorCode CheckPlainEntry(HycoScene s, PetscInt entry)
{
  const char *key = s->key[entry];
  char name[HYCO_LINE];
  PetscInt field, n = 0;
  PetscBool known = PETSC_FALSE;

  PetscFunctionBegin;
  if (strncasecmp(key, "scene_", 6) == 0) {
    for (; scene_fields[n]; n++) known = (PetscBool)(known || strcasecmp(key + 6, scene_fields[n]) == 0);
    if (!known) PetscCall(UnknownKey(key, "scene", NULL, scene_fields));
  } else if (strncasecmp(key, "parameter_", 10) == 0) {
    if (!SplitKey(key + 10, parameter_fields, name, &field))
      PetscCall(UnknownKey(key, "a parameter", NULL, parameter_fields));
    for (PetscInt p = 0; p < s->n_parameters; p++) known = (PetscBool)(known || strcasecmp(s->parameter[p], name) == 0);
    HycoCheck(known, "the scene's entry %s is for a parameter that scene: parameters: does not list; add it there",
              key);
  } else if (!HycoOptionFind(key)) {
    const char *near = HycoOptionNearest(key, NULL);
    PetscBool solvers, reads;

    PetscCall(HycoOptionsOfSolver(key, &solvers, &reads));
    if (solvers) PetscFunctionReturn(PETSC_SUCCESS); /* HycoEntriesShare() judges it */
    /* First for the reasons it knows, such as an option of an older version; then for a likely typing error. */
    PetscCall(HycoOptionsCheckName(key));
    HycoCheck(!near, "the option %s is unknown; did you mean %s?", key, near);
    HycoFail("the option %s is unknown; hyco -help lists them", key);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of tables are free, so that only the beginning of a key can be checked. */
static PetscErrorCode CheckHistoryEntry(const char key[])
{
  static const char *const fields[] = {"times", "tables_NAME", NULL};

  PetscFunctionBegin;
  if (strcasecmp(key + 8, "times") && strncasecmp(key + 8, "tables_", 7))
    PetscCall(UnknownKey(key, "history", NULL, fields));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks thermal entries that require each other; sets the temperature of the law. An expansion needs the
   temperature of no strain. The law borrows the expression, which the body owns. */
static PetscErrorCode CheckHeat(HycoBody *body)
{
  PetscBool reads = body->law->heat;

  PetscFunctionBegin;
  /* A constant that is a function of T reads the temperature as much as a law that says so. */
  for (PetscInt j = 0; j < body->law->constants.n; j++)
    reads = (PetscBool)(reads || HycoExprInHeat(body->law->constants.entry[j].expr));
  HycoCheck(!body->expansion || (body->temperature && body->reference),
            "body %s has an expansion; it also needs temperature and reference_temperature", body->name);
  HycoCheck(body->expansion || !body->reference,
            "body %s has a reference_temperature but no expansion; give expansion: (1/K)", body->name);
  HycoCheck(!reads || body->temperature, "body %s has no temperature; its law %s needs one (K)", body->name,
            ((PetscObject)body->law)->type_name);
  body->law->temperature = body->temperature;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that each displacement along a direction has its direction, that this is constant, and that the scene has
   no history. */
static PetscErrorCode CheckSupports(HycoScene s)
{
  PetscBool every[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) every[p] = PETSC_TRUE;
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    const HycoFixed *fixed = &s->fixed[k];
    HycoExpr given = NULL;

    /* `given` is any component of the direction; the others are zero if not given. */
    for (PetscInt c = 0; c < 3; c++) {
      if (fixed->direction[c]) given = fixed->direction[c];
      /* The rotated unknowns are eliminated once for all parameters: a turning direction would change K's structure. */
      HycoCheck(!HycoExprChanges(fixed->direction[c], every),
                "%s changes with a parameter; the direction of a support must be constant",
                HycoExprKey(fixed->direction[c]));
    }
    HycoCheck(given || !fixed->normal,
              "%s has no direction; write fixed: %s: {normal: ..., direction: {x: ..., y: ..., z: ...}}",
              HycoExprKey(fixed->normal), fixed->group);
    HycoCheck(fixed->normal || !given,
              "%s is a direction without a support; write fixed: %s: {normal: 0, direction: ...}", HycoExprKey(given),
              fixed->group);
    HycoCheck(!fixed->normal || !s->n_times,
              "%s: supports along a direction are for scenes without a history; for a plane use a stiff spring along "
              "the normal",
              HycoExprKey(fixed->normal));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses scenes that cannot be solved, before a mesh is read. Only what needs no mesh: groups are checked when
   the mesh is read. */
static PetscErrorCode CheckScene(HycoScene s)
{
  PetscFunctionBegin;
  HycoCheck(s->n_bodies, "the scene has no body; write body: NAME: {young: ..., poisson: ...}");
  for (PetscInt k = 0; k < s->n_bodies; k++) {
    const HycoDeclared *d = &s->body[k].law->constants;

    for (PetscInt j = 0; j < d->n; j++)
      HycoCheck(!d->entry[j].required || d->entry[j].expr || d->entry[j].text, "body %s has no %s (%s)",
                s->body[k].name, d->entry[j].name, d->entry[j].title);
    /* In the order in which a user would mend them: bodies, contacts, supports, then what refers to them. */
    PetscCall(CheckHeat(&s->body[k]));
  }
  for (PetscInt k = 0; k < s->n_contacts; k++) PetscCall(HycoContactComplete(s->contact[k]));
  PetscCall(CheckSupports(s));
  PetscCall(HycoSceneCheckMotion(s));
  PetscCall(HycoSceneCheckHistory(s));
  PetscCall(HycoSceneCheckQuantities(s));
  PetscCall(HycoSceneCheckTies(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last entry of that name counts; a missing one is "", so that callers need no second case. */
static PetscErrorCode GetString(HycoScene s, const char key[], char **value)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(*value));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (strcasecmp(s->key[k], key) == 0) PetscCall(PetscStrallocpy(s->value[k], value));
  }
  if (!*value) PetscCall(PetscStrallocpy("", value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Twelve halvings multiply the cells of a 2D mesh by 16 million: more is a typing error. */
static PetscErrorCode ReadRefine(HycoScene s)
{
  char *text = NULL, *end;
  long times;

  PetscFunctionBegin;
  PetscCall(GetString(s, "scene_refine", &text));
  times = strtol(text, &end, 10);
  /* The text is freed before the check, which returns on failure; -1 keeps its verdict. */
  s->refine = *end || times < 0 || times > 12 ? -1 : (PetscInt)times;
  PetscCall(PetscFree(text));
  HycoCheck(
      s->refine >= 0,
      "scene_refine is the number of times that the mesh's cells are halved; it must be a whole number from 0 to 12");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No entry: the first name. */
static PetscErrorCode ReadFormulation(HycoScene s)
{
  static const char *const names[] = {"plane_strain", "plane_stress", "axisymmetric"};
  char *text = NULL;
  PetscBool known;

  PetscFunctionBegin;
  PetscCall(GetString(s, "scene_formulation", &text));
  /* s->formulation is 0 then, which is plane strain, the first of names[]. */
  known = (PetscBool)!text[0];
  for (PetscInt k = 0; k < 3; k++) {
    if (strcasecmp(text, names[k])) continue;
    s->formulation = (HycoFormulation)k;
    known = PETSC_TRUE;
  }
  PetscCall(PetscFree(text));
  HycoCheck(known, "scene_formulation must be plane_strain, plane_stress or axisymmetric");
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDimension HycoQuantityDimension(const HycoQuantity *q)
{
  if (q->kind == HYCO_QUANTITY_AREA) return HYCO_DIMENSION_AREA;
  if (q->kind == HYCO_QUANTITY_MOMENT || (q->kind == HYCO_QUANTITY_FRICTION && q->field == HYCO_FRICTION_WORK))
    return HYCO_DIMENSION_WORK;
  if (q->kind >= HYCO_QUANTITY_PRESSURE) return HYCO_DIMENSION_STRESS;
  if (q->kind >= HYCO_QUANTITY_REACTION) return HYCO_DIMENSION_FORCE;
  return HycoQuantityFields[q->field][0] == 'u' ? HYCO_DIMENSION_LENGTH : HYCO_DIMENSION_STRESS;
}

/* From the scene's units; "": not known, as of areas, whose dimension is that of the mesh. Products stand side by side,
   "N mm", "(N/mm) mm". */
void HycoQuantityUnit(HycoScene s, const HycoQuantity *q, char unit[HYCO_LINE])
{
  const char *length = s->unit[HYCO_UNIT_LENGTH], *force = s->unit[HYCO_UNIT_FORCE];
  const HycoDimension dimension = HycoQuantityDimension(q);
  const PetscBool quotient = (PetscBool)(strchr(force, '/') != NULL);

  unit[0] = '\0';
  if (dimension == HYCO_DIMENSION_WORK && force[0] && length[0])
    HycoFormat(unit, "%s%s%s %s", quotient ? "(" : "", force, quotient ? ")" : "", length);
  else if (dimension == HYCO_DIMENSION_STRESS)
    HycoFormat(unit, "%s", s->unit[HYCO_UNIT_STRESS]);
  else if (dimension == HYCO_DIMENSION_FORCE)
    HycoFormat(unit, "%s", force);
  else if (dimension == HYCO_DIMENSION_LENGTH)
    HycoFormat(unit, "%s", length);
}

/* The mesh may be missing: a program may give a DM. */
static PetscErrorCode FindMesh(HycoScene s, const char folder[])
{
  char *mesh = NULL, path[PETSC_MAX_PATH_LEN];
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(GetString(s, "scene_mesh", &mesh));
  /* On the command line a path is relative to the working folder, in the file to the scene's folder. */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-scene_mesh", &set));
  if (set || mesh[0] == '/' || !mesh[0])
    snprintf(path, sizeof(path), "%s", mesh);
  else
    snprintf(path, sizeof(path), "%s/%s", folder, mesh);
  PetscCall(PetscFree(mesh));
  PetscCall(PetscStrallocpy(path, &s->mesh_path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define WIDE_RANGE 10 /* ratio of a range's ends above which equal steps leave out the lower decades */

/* The parameters whose logarithm is sampled: of a modulus, or of a spring; one that also moves nodes is a length. */
static void FindWide(HycoScene s)
{
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, stiff = PETSC_FALSE, moves = PETSC_FALSE;

    changed[p] = PETSC_TRUE;
    for (PetscInt b = 0; b < s->n_bodies; b++) {
      stiff = (PetscBool)(stiff || HycoMaterialChanges(s->body[b].law, changed));
      for (PetscInt c = 0; c < 3; c++) moves = (PetscBool)(moves || HycoExprChanges(s->body[b].map[c], changed));
    }
    for (PetscInt k = 0; k < 4 * s->n_springs; k++)
      stiff = (PetscBool)(stiff || HycoExprChanges(s->spring[k / 4].stiffness[k % 4], changed));
    s->wide[p] = (PetscBool)(stiff && !moves && s->lo[p] > 0 && s->hi[p] > WIDE_RANGE * s->lo[p]);
  }
}

/* The ends are kept to the last bit. */
PetscReal HycoSceneBetween(HycoScene s, PetscInt p, PetscReal lo, PetscReal hi, PetscReal share)
{
  return s->wide[p] && lo > 0 ? lo * PetscPowReal(hi / lo, share) : lo + (hi - lo) * share;
}

/* Reads everything from the entries in scene->options. The order matters: variables and constants before the
   expressions that use them. */
static PetscErrorCode SceneBuild(HycoScene s, const char folder[])
{
  PetscFunctionBegin;
  PetscCall(PetscStrallocpy(folder, &s->folder));
  PetscCall(HycoEntriesList(s));
  PetscCall(GetString(s, "scene_title", &s->title));
  PetscCall(GetString(s, "scene_unit_length", &s->unit[HYCO_UNIT_LENGTH]));
  PetscCall(GetString(s, "scene_unit_force", &s->unit[HYCO_UNIT_FORCE]));
  PetscCall(GetString(s, "scene_unit_stress", &s->unit[HYCO_UNIT_STRESS]));
  /* The mesh's path is relative to the scene's folder; it is found before anything refers to groups. */
  PetscCall(FindMesh(s, folder));
  PetscCall(ReadRefine(s));
  PetscCall(ReadFormulation(s));
  /* Parameters, then t and the tables, then constants: the order of variables in expressions, which files keep. */
  PetscCall(ReadParameters(s));
  PetscCall(HycoSceneReadHistory(s));
  PetscCall(HycoSceneReadConstants(s));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    const char *key = s->key[k];

    if (strncasecmp(key, "scene_", 6) == 0 || strncasecmp(key, "parameter_", 10) == 0 ||
        strncasecmp(key, "hyco_", 5) == 0)
      PetscCall(CheckPlainEntry(s, k));
    else if (strncasecmp(key, "history_", 8) == 0)
      PetscCall(CheckHistoryEntry(key));
    else if (strncasecmp(key, "constant_", 9) == 0)
      continue; /* read by HycoSceneReadConstants() */
    else
      PetscCall(ReadMember(s, k));
  }
  PetscCall(CheckScene(s));
  FindWide(s);
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    char unit[HYCO_LINE];

    HycoQuantityUnit(s, &s->quantity[k], unit);
    PetscCall(PetscStrallocpy(unit, &s->quantity[k].unit));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reading the file is collective; building the scene from its entries is done by each rank for itself, and an error on
   one is raised on all. */
static PetscErrorCode LoadInto(HycoScene s, const char path[])
{
  char folder[PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBegin;
  HycoOnEach(HycoComm(s), HycoReserveBLAS());
  PetscCall(HycoEntriesRead(HycoComm(s), path, &s->options, folder));
  PetscCall(PetscObjectSetOptions((PetscObject)s, s->options));
  HycoOnEach(HycoComm(s), SceneBuild(s, folder));
  HycoOnEach(HycoComm(s), HycoEntriesShare(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSceneLoad(MPI_Comm comm, const char path[], HycoScene *scene)
{
  PetscFunctionBegin;
  PetscCheck(path && scene, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL,
             "HycoSceneLoad: the path or the handle's address is NULL");
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*scene, HYCO_SCENE_CLASSID, "HycoScene", "Scene of bodies in contact", "Hyco", comm,
                              HycoSceneDestroy, HycoSceneView));
  HycoOnError(LoadInto(*scene, path), PetscCall(HycoSceneDestroy(scene)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene of a program, from keys and values instead of a file. The command line still takes precedence. */
static PetscErrorCode FillFromEntries(HycoScene s, PetscInt n, char *const key[], char *const value[],
                                      const char folder[])
{
  PetscFunctionBegin;
  /* Here alone if the scene comes from a model's text. */
  PetscCall(HycoReserveBLAS());
  PetscCall(PetscOptionsCreate(&s->options));
  for (PetscInt k = 0; k < n; k++) {
    char dashed[HYCO_LINE];

    HycoCheck(HycoIsSceneKey(key[k]) && strlen(key[k]) < 256, "\"%.64s\" is not an entry of a scene", key[k]);
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", key[k]));
    PetscCall(PetscOptionsSetValue(s->options, dashed, value[k]));
  }
  PetscCall(HycoEntriesOverride(s->options, PETSC_TRUE));
  PetscCall(PetscObjectSetOptions((PetscObject)s, s->options));
  PetscCall(SceneBuild(s, folder));
  PetscCall(HycoEntriesShare(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank builds it from the same entries. Only options of the method are taken from the command line, since a
   model's scene is fixed. */
PetscErrorCode HycoSceneFromEntries(MPI_Comm comm, PetscInt n, char *const key[], char *const value[],
                                    const char folder[], HycoScene *scene)
{
  PetscFunctionBegin;
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*scene, HYCO_SCENE_CLASSID, "HycoScene", "Scene of bodies in contact", "Hyco", comm,
                              HycoSceneDestroy, HycoSceneView));
  HycoOnError(FillFromEntries(*scene, n, key, value, folder), PetscCall(HycoSceneDestroy(scene)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The command line again: a program may have set options since. */
PetscErrorCode HycoSceneGiveOptions(HycoScene scene, PetscObject object)
{
  PetscFunctionBegin;
  PetscCall(HycoEntriesOverride(scene->options, PETSC_TRUE));
  PetscCall(HycoOptionsInherit(object, (PetscObject)scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* key, tab, value, end of line; GetLong() has replaced tabs and ends of lines in values. The caller frees it. */
PetscErrorCode HycoSceneToText(HycoScene scene, char **text)
{
  size_t length = 1;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < scene->n_entries; k++) length += strlen(scene->key[k]) + strlen(scene->value[k]) + 2;
  PetscCall(PetscMalloc1(length, text));
  (*text)[0] = '\0';
  for (PetscInt k = 0; k < scene->n_entries; k++) {
    PetscCall(PetscStrlcat(*text, scene->key[k], length));
    PetscCall(PetscStrlcat(*text, "\t", length));
    PetscCall(PetscStrlcat(*text, scene->value[k], length));
    PetscCall(PetscStrlcat(*text, "\n", length));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Splits the text into keys and values. Changes the text: keys and values point into it. */
static PetscErrorCode SplitText(char text[], PetscInt *lines, char *key[], char *value[])
{
  char *line, *rest;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
    char *tab = strchr(line, '\t');

    HycoCheck(tab, "the model's scene text is damaged");
    *tab = '\0';
    key[n] = line;
    value[n] = tab + 1;
    n++;
  }
  *lines = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the text that a model file stores, a line for each entry. No file is read: the mesh of a model is in its
   file, and relative names are relative to the working folder. */
PetscErrorCode HycoSceneFromText(MPI_Comm comm, const char text[], HycoScene *scene)
{
  char *copy, **key, **value;
  PetscInt lines = 1;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *scene = NULL;
  /* SplitText() cuts its text into pieces; the caller's stays whole. */
  PetscCall(PetscStrallocpy(text, &copy));
  /* At most one line for each end of line, and one without. */
  for (const char *c = text; *c; c++) lines += *c == '\n';
  PetscCall(PetscMalloc2(lines, &key, lines, &value));
  ierr = SplitText(copy, &lines, key, value);
  if (!ierr) ierr = HycoSceneFromEntries(comm, lines, key, value, ".", scene);
  PetscCall(PetscFree2(key, value));
  PetscCall(PetscFree(copy));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of a scene that is half built: what was not reached is zero. */
PetscErrorCode HycoSceneDestroy(HycoScene *scene)
{
  HycoScene s;

  PetscFunctionBegin;
  HycoDestroyBegin(scene, HYCO_SCENE_CLASSID);
  s = *scene;
  /* First, so that a failure below leaves no handle to something half freed. */
  *scene = NULL;
  for (PetscInt k = 0; k < s->n_bodies; k++) {
    PetscCall(HycoMaterialDestroy(&s->body[k].law));
    for (PetscInt c = 0; c < 3; c++) {
      PetscCall(HycoExprDestroy(&s->body[k].map[c]));
      PetscCall(HycoExprDestroy(&s->body[k].force[c]));
    }
    PetscCall(HycoExprDestroy(&s->body[k].density));
    /* The law only borrows the temperature, and is gone by now. */
    PetscCall(HycoExprDestroy(&s->body[k].temperature));
    PetscCall(HycoExprDestroy(&s->body[k].reference));
    PetscCall(HycoExprDestroy(&s->body[k].expansion));
    PetscCall(PetscFree(s->body[k].name));
  }
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    for (PetscInt c = 0; c < 3; c++) {
      PetscCall(HycoExprDestroy(&s->fixed[k].value[c]));
      PetscCall(HycoExprDestroy(&s->fixed[k].direction[c]));
    }
    PetscCall(HycoExprDestroy(&s->fixed[k].normal));
    PetscCall(PetscFree(s->fixed[k].group));
  }
  for (PetscInt k = 0; k < s->n_loads; k++) {
    PetscCall(HycoExprDestroy(&s->load[k].pressure));
    for (PetscInt c = 0; c < 3; c++) PetscCall(HycoExprDestroy(&s->load[k].traction[c]));
    PetscCall(PetscFree(s->load[k].group));
  }
  for (PetscInt k = 0; k < s->n_point_loads; k++) {
    for (PetscInt c = 0; c < 3; c++) PetscCall(HycoExprDestroy(&s->point_load[k].force[c]));
    PetscCall(PetscFree(s->point_load[k].group));
  }
  for (PetscInt k = 0; k < s->n_springs; k++) {
    for (PetscInt c = 0; c < 4; c++) PetscCall(HycoExprDestroy(&s->spring[k].stiffness[c]));
    PetscCall(PetscFree(s->spring[k].group));
  }
  PetscCall(HycoSceneDestroyMotion(s));
  for (PetscInt k = 0; k < s->n_contacts; k++) PetscCall(HycoContactDestroy(&s->contact[k]));
  PetscCall(HycoEntriesUnshare(s));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    HycoFreeAll(&s->key[k], &s->value[k]);
  }
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    HycoFreeAll(&s->quantity[k].name, &s->quantity[k].group, &s->quantity[k].contact, &s->quantity[k].unit);
  }
  for (PetscInt p = 0; p < s->n_variables; p++) PetscCall(PetscFree(s->parameter[p]));
  PetscCall(HycoSceneDestroyHistory(s));
  PetscCall(HycoSceneDestroyTies(s));
  HycoFreeAll(&s->key, &s->value, &s->constant, &s->quantity, &s->body, &s->fixed, &s->load, &s->point_load, &s->spring,
              &s->contact, &s->title, &s->mesh_path, &s->folder, &s->unit[0], &s->unit[1], &s->unit[2]);
  PetscCall(DMDestroy(&s->dm));
  PetscCall(PetscOptionsDestroy(&s->options));
  PetscCall(PetscHeaderDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoScene, HYCO_SCENE_CLASSID)
