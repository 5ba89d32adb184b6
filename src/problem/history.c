/* The history of a scene: its listed times, its tables, and the variables for expressions. */
#include <hycoentries.h>
#include <hycocontactimpl.h>
#include <string.h>

#define TABLES "history_tables_"

/* Reads a finite number at `text`; *text moves past it and the following blanks. */
static PetscBool TakeNumber(const char **text, PetscReal *value)
{
  char *end;

  *value = HycoNumber(*text, &end);
  if (end == *text || PetscIsInfOrNanReal(*value)) return PETSC_FALSE;
  *text = end + strspn(end, " ");
  return PETSC_TRUE;
}

/* "0 1,2 3": rows of `width` numbers separated by commas; *n is -1 if the text has another form. YAML's [[0, 1],
   [2, 3]] arrives in this form from HycoEntriesFlatten(). The caller frees *value, also if *n is -1. */
static PetscErrorCode ReadRows(const char text[], PetscInt width, PetscInt *n, PetscReal **value)
{
  /* As many rows as commas and one more: the loop below ends there, whatever else the text has. */
  PetscInt room = 1;
  PetscBool right = PETSC_TRUE;

  PetscFunctionBegin;
  for (const char *c = text; *c; c++) room += *c == ',';
  PetscCall(PetscMalloc1(room * width, value));
  for (*n = 0; right && *n < room; ++*n) {
    text += strspn(text, " ");
    for (PetscInt k = 0; right && k < width; k++) right = TakeNumber(&text, *value + *n * width + k);
    /* Each row ends in a comma and the last in the text's end: too many or too few numbers in a row are found here. */
    right = (PetscBool)(right && *text == (*n + 1 < room ? ',' : '\0'));
    text++;
  }
  if (!right) *n = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Times must increase strictly: a step of no length has no rate. */
static PetscErrorCode CheckTimes(const char key[], PetscInt n, const PetscReal t[])
{
  PetscFunctionBegin;
  for (PetscInt k = 1; k < n; k++)
    HycoCheck(t[k] > t[k - 1], "%s goes %s: %.10g follows %.10g; times must increase", key,
              t[k] < t[k - 1] ? "back in time" : "on without time", (double)t[k], (double)t[k - 1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces former times: the last of repeated entries counts, as for other options. */
static PetscErrorCode ReadTimes(HycoScene s, const char key[], const char text[])
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(PetscFree(s->times));
  PetscCall(ReadRows(text, 1, &n, &s->times));
  HycoCheck(n >= 2, "%s is \"%.200s\"; at least two numbers are expected, with the beginning of the path first", key,
            text);
  PetscCall(CheckTimes(key, n, s->times));
  s->n_times = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a variable for the scene's expressions: a table, or the time, which comes before them. Expressions distinguish
   upper and lower case, options do not; the time t is no option, so that a parameter or a table may be T. */
static PetscErrorCode AddVariable(HycoScene s, const char key[], const char name[])
{
  const PetscBool time = (PetscBool)(s->n_variables == s->n_parameters);

  PetscFunctionBegin;
  /* strcmp for t only; all else is an option's name, in which PETSc ignores the case. */
  for (PetscInt p = 0; p < s->n_variables; p++)
    HycoCheck((time || p == s->n_parameters ? strcmp : strcasecmp)(s->parameter[p], name),
              "%s: %s is already the name of %s; give each variable its own name", key, name,
              p < s->n_parameters    ? "a parameter"
              : p == s->n_parameters ? "the time"
                                     : "a table");
  /* Expressions have one array of values for parameters, time and tables, of this size. */
  HycoCheck(s->n_variables < HYCO_MAX_PARAMETERS,
            "%s: the scene has more than %d variables (parameters, t and the tables of the history)", key,
            HYCO_MAX_PARAMETERS);
  PetscCall(PetscStrallocpy(name, &s->parameter[s->n_variables]));
  s->n_variables++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A table is a variable of expressions, of the name after history_tables_. It is counted before its rows are read, so
   that an error in them leaves a scene that can be destroyed. */
static PetscErrorCode ReadTable(HycoScene s, const char key[], const char text[])
{
  const char *name = key + strlen(TABLES);
  HycoTimeTable *table = &s->table[s->n_tables];
  PetscReal *row = NULL, *t, *value;
  PetscInt n;

  PetscFunctionBegin;
  HycoCheck(HycoIsVariableName(name),
            "%s: \"%s\" cannot name a table; use letters, digits and _, and none of x, y, z, pi", key, name);
  PetscCall(AddVariable(s, key, name));
  s->n_tables++;
  PetscCall(ReadRows(text, 2, &n, &row));
  PetscCall(PetscMalloc1(PetscMax(n, 1), &t));
  PetscCall(PetscMalloc1(PetscMax(n, 1), &value));
  for (PetscInt k = 0; k < n; k++) {
    /* Two arrays, since the interpolation searches the times alone. */
    t[k] = row[2 * k];
    value[k] = row[2 * k + 1];
  }
  table->t = t;
  table->value = value;
  table->n = n;
  PetscCall(PetscFree(row));
  /* After the rows are freed: a failed check returns at once. */
  HycoCheck(n > 0, "%s is \"%.200s\"; a table needs rows of two numbers, time and value: [[0, 1], [10, 2.5]]", key,
            text);
  PetscCall(CheckTimes(key, n, table->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First the times, then the variable t, then the tables: HycoSceneSetTime() relies on this order of variables. */
PetscErrorCode HycoSceneReadHistory(HycoScene s)
{
  const char *table = NULL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_entries; k++) {
    /* A table's times mean nothing without a path, so this is refused rather than ignored. */
    if (strcasecmp(s->key[k], "history_times") == 0) PetscCall(ReadTimes(s, s->key[k], s->value[k]));
    if (strncasecmp(s->key[k], TABLES, strlen(TABLES)) == 0) table = s->key[k];
  }
  HycoCheck(s->n_times || !table, "%s is a table of a history without times; write history: {times: [0, ...]}", table);
  if (!s->n_times) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AddVariable(s, "history_times", "t"));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (strncasecmp(s->key[k], TABLES, strlen(TABLES)) == 0) PetscCall(ReadTable(s, s->key[k], s->value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By the entry, not by its value: a coefficient that is 0 at some parameters still makes the problem one of a path
   with tangents, since types of models and sizes may not depend on mu. */
PetscBool HycoSceneHasFriction(HycoScene s)
{
  for (PetscInt k = 0; s && k < s->n_contacts; k++) {
    if (s->contact[k]->friction) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* After all entries are read, which may come in any order. What a model precomputes must not change along the
   path. */
PetscErrorCode HycoSceneCheckHistory(HycoScene s)
{
  PetscBool in_time[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};

  PetscFunctionBegin;
  for (PetscInt p = s->n_parameters; p < s->n_variables; p++) in_time[p] = PETSC_TRUE;
  /* Maps, stiffnesses of springs and normals enter what is precomputed: K, and the pairs of contacts. */
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    for (PetscInt c = 0; c < 3; c++)
      HycoCheck(!HycoExprChanges(s->body[b].map[c], in_time),
                "%s changes in time; a map must be constant in time, because it gives the positions before the history "
                "begins",
                HycoExprKey(s->body[b].map[c]));
  }
  for (PetscInt k = 0; k < 4 * s->n_springs; k++) {
    HycoExpr stiffness = s->spring[k / 4].stiffness[k % 4];

    HycoCheck(!HycoExprChanges(stiffness, in_time),
              "%s changes in time; the stiffness of a spring must be constant in time", HycoExprKey(stiffness));
  }
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    HycoCheck(!HycoDeclaredChanges(&s->contact[k]->entries, "gap", in_time),
              "contact %s: its normal changes in time; only the gap and the friction may change in time",
              ((PetscObject)s->contact[k])->name);
    /* Friction's force depends on where the slave came from, which a single solve does not know. */
    HycoCheck(!s->contact[k]->friction || s->n_times,
              "%s: friction depends on the path of the loads, and the scene has no history; write history: {times: [0, "
              "...]}",
              HycoExprKey(s->contact[k]->friction));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tables and times alone: their names are among those of the variables, which the scene frees. */
PetscErrorCode HycoSceneDestroyHistory(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_tables; k++) {
    HycoFreeAll(&s->table[k].t, &s->table[k].value);
  }
  PetscCall(PetscFree(s->times));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* out: parameters, then the time, then the tables' values; without a history only the parameters. */
void HycoSceneSetTime(HycoScene s, const PetscReal mu[], PetscReal t, PetscReal out[])
{
  for (PetscInt p = 0; p < s->n_parameters; p++) out[p] = mu[p];
  if (!s->n_times) return;
  out[s->n_parameters] = t;
  for (PetscInt k = 0; k < s->n_tables; k++) out[s->n_parameters + 1 + k] = HycoTableValue(&s->table[k], t);
}

/* A step ends at each listed time and at each row of a table, where a load's rate jumps. PETSC_MAX_REAL: there is
   none left. */
PetscReal HycoSceneNextStop(HycoScene s, PetscReal t)
{
  PetscReal next = PETSC_MAX_REAL;

  /* From the end, so that the last one kept is the earliest after t. */
  for (PetscInt k = s->n_times - 1; k >= 0 && s->times[k] > t; k--) next = s->times[k];
  for (PetscInt j = 0; j < s->n_tables; j++) {
    const HycoTimeTable *table = &s->table[j];

    for (PetscInt k = 0; k < table->n; k++) {
      if (table->t[k] > t) next = PetscMin(next, table->t[k]);
    }
  }
  return next;
}

PetscErrorCode HycoSceneGetHistory(HycoScene s, PetscInt *n, const PetscReal *times[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SCENE_CLASSID);
  if (n) *n = s->n_times;
  if (times) *times = s->times;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* what: the method that cannot follow a path. */
PetscErrorCode HycoSceneRefuseHistory(HycoScene s, const char what[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SCENE_CLASSID);
  HycoCheck(!s->n_times,
            "the scene has a history (history_times), and %s is for scenes without one; use hyco solve -mu for a path "
            "at full order, or hyco train -grid N,N,... for a reduced model",
            what);
  PetscFunctionReturn(PETSC_SUCCESS);
}
