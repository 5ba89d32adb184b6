/*
  Options. The code that reads an option declares it, between PetscObjectOptionsBegin() and PetscOptionsEnd(), with the
  functions below: its name, the form of its value, its meaning, its default (the object's value before), its range. A
  declaration pass creates an object of each class, calls its SetFromOptions, and records the declarations: the table of
  HycoGetOptionTable(). hyco -help, the check of the user's options and that of the scene's hyco: section use this
  table.
*/
#include <hycoimpl.h>
#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* Former names of options. */
static const struct {
  const char *before, *now;
} renamed[] = {
    {"hyco_trust_folds", "-hyco_validation, the number of held-out points on which the error estimates are calibrated"},
};

static HycoOptionList table;      /* the library's options, once recorded */
static HycoOptionList told;       /* options that -help has printed */
static HycoOptionList *recording; /* list that receives declarations instead of reading them; NULL: options are read */
static const char *readers = "";  /* HycoOptionsFor() */
static PetscErrorCode (*declare_all)(PetscOptions) = NULL;

/* Registered once for each list; destroying an empty list does nothing. */
static PetscErrorCode ForgetTable(void)
{
  PetscFunctionBegin;
  PetscCall(HycoOptionListDestroy(&table));
  PetscCall(HycoOptionListDestroy(&told));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Zeroed, so that it can be filled again. */
PetscErrorCode HycoOptionListDestroy(HycoOptionList *list)
{
  PetscFunctionBegin;
  if (!list) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < list->n; k++)
    PetscCall(PetscFree(list->option[k].name)); /* allocated together with the
                                                   others */
  PetscCall(PetscFree(list->option));
  list->n = list->room = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declarations may record others inside: the former list is restored, on errors too. With an empty database: no option
   is found, each is only noted. */
PetscErrorCode HycoOptionsRecord(HycoOptionList *list, PetscErrorCode (*declare)(PetscOptions))
{
  PetscOptions none;
  HycoOptionList *before = recording;

  PetscFunctionBegin;
  HycoCheckGiven(list);
  HycoCheckGiven(declare);
  PetscCall(PetscOptionsCreate(&none));
  recording = list;
  HycoFinally(declare(none), recording = before; readers = ""; PetscCall(PetscOptionsDestroy(&none)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A new type may declare options. Not while recording, which would free the list in use. */
PetscErrorCode HycoOptionsForgetTable(void)
{
  PetscFunctionBegin;
  if (!recording) PetscCall(HycoOptionListDestroy(&table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoOptionsSetDeclare(PetscErrorCode (*declare)(PetscOptions))
{
  declare_all = declare;
}

/* Made at the first use: programs that only solve never need it. Of all classes of the library; the program's own
   options are its commands'. */
PetscErrorCode HycoGetOptionTable(PetscInt *n, const HycoOption *options[])
{
  PetscFunctionBegin;
  if (!table.n) {
    PetscCall(HycoPackageCheck());
    PetscCall(HycoOptionsRecord(&table, declare_all));
    PetscCall(PetscRegisterFinalize(ForgetTable));
  }
  if (n) *n = table.n;
  if (options) *options = table.option;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An entry that ends with _ is a prefix: the rest of the name is the user's. Letter case is ignored, as PETSc does. */
const HycoOption *HycoOptionListFind(const HycoOptionList *list, const char name[])
{
  for (PetscInt k = 0; list && name && k < list->n; k++) {
    const char *entry = list->option[k].name;
    const size_t length = strlen(entry);

    if (strcasecmp(entry, name) == 0) return &list->option[k];
    if (entry[length - 1] == '_' && strlen(name) > length && strncasecmp(entry, name, length) == 0)
      return &list->option[k];
  }
  return NULL;
}

/* Case-insensitive, as PETSc's database is; without the dash. */
const HycoOption *HycoOptionFind(const char name[])
{
  (void)!HycoGetOptionTable(NULL, NULL);
  return HycoOptionListFind(&table, name);
}

static PetscErrorCode (*probe_all)(const char[]) = NULL;

void HycoOptionsSetProbe(PetscErrorCode (*probe)(const char name[]))
{
  probe_all = probe;
}

/* With a database of this option alone, which nothing else can read. Those that print, and options of solvers inside
   others, are read late: they count as read, as does one whose value is refused. */
PetscErrorCode HycoOptionsOfSolver(const char name[], PetscBool *prefix, PetscBool *reads)
{
  static const char *const prefixes[] = {"hyco_mumps_",   "hyco_primal_", "hyco_norm_",   "hyco_tao_",
                                         "hyco_pod_svd_", "hyco_pod_bv_", "hyco_pod_ds_", NULL};
  static const char *const late[] = {"view", "monitor", "reason", "error", "_mg_", "_sub_", "_pod_", "_norm_", NULL};
  char dashed[HYCO_LINE], why[HYCO_LINE], **names, **values;
  PetscOptions alone;
  PetscErrorCode caught;
  PetscInt n;

  PetscFunctionBegin;
  HycoCheckGiven(name);
  HycoCheckGiven(prefix);
  HycoCheckGiven(reads);
  *prefix = *reads = PETSC_FALSE;
  for (PetscInt k = 0; prefixes[k] && !*prefix; k++)
    *prefix = (PetscBool)(strncasecmp(name, prefixes[k], strlen(prefixes[k])) == 0);
  for (PetscInt k = 0; late[k] && *prefix; k++) *reads = (PetscBool)(*reads || strstr(name, late[k]));
  if (!*prefix || *reads || !probe_all) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
  PetscCall(PetscOptionsCreate(&alone));
  PetscCall(PetscOptionsSetValue(alone, dashed, NULL));
  /* Its value from the unread ones: to look it up would mark it as read. */
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt k = 0; k < n; k++) {
    if (strcasecmp(names[k], name) == 0) PetscCall(PetscOptionsSetValue(alone, dashed, values[k]));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscCall(PetscOptionsPush(alone));
  HycoCatch((*probe_all)(name), caught, why);
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsUsed(alone, name, reads));
  if (caught) *reads = PETSC_TRUE;
  PetscCall(PetscOptionsDestroy(&alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of earlier versions are named with their successors, instead of having no effect. */
PetscErrorCode HycoOptionsCheckName(const char name[])
{
  PetscFunctionBegin;
  HycoCheckGiven(name);
  for (size_t k = 0; k < sizeof(renamed) / sizeof(renamed[0]); k++)
    HycoCheck(strcasecmp(name, renamed[k].before), "the option -%s no longer exists; it is now %s", name,
              renamed[k].now);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Levenshtein distance of two words of fewer than 128 letters, letter case ignored. One row of the table is
   enough: `diagonal` keeps the entry that was overwritten. */
static PetscInt EditDistance(const char *a, const char *b)
{
  PetscInt row[129];
  const PetscInt m = a ? (PetscInt)strlen(a) : 128, n = b ? (PetscInt)strlen(b) : 128; /* NULL is far from all */

  if (m > 127 || n > 127) return PETSC_MAX_INT;
  for (PetscInt j = 0; j <= n; j++) row[j] = j;
  for (PetscInt i = 1; i <= m; i++) {
    PetscInt diagonal = row[0];

    row[0] = i;
    for (PetscInt j = 1; j <= n; j++) {
      PetscInt cost = diagonal + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));

      diagonal = row[j];
      row[j] = PetscMin(cost, 1 + PetscMin(row[j], row[j - 1]));
    }
  }
  return row[n];
}

/* A third of the letters may differ, at least two: more would suggest unrelated words. */
static PetscInt TooFar(const char *word)
{
  return !word ? 0 : PetscMax(2, (PetscInt)strlen(word) / 3) + 1;
}

/* The name becomes the nearest if it is nearer than *best. */
static void OptionsCompare(const char *word, const char *name, PetscInt *best, const char **nearest)
{
  const PetscInt distance = EditDistance(word, name);

  if (distance >= *best) return;
  *best = distance;
  *nearest = name;
}

/* For "did you mean": NULL if every name differs by more than a typing error. */
const char *HycoNearest(const char *word, PetscInt n, const char *const names[])
{
  const char *nearest = NULL;
  PetscInt best = TooFar(word);

  for (PetscInt k = 0; names && k < n; k++) OptionsCompare(word, names[k], &best, &nearest);
  return nearest;
}

/* NULL if nothing is near. */
const char *HycoOptionNearest(const char word[], const HycoOptionList *more)
{
  const HycoOptionList *lists[] = {&table, more};
  const char *nearest = NULL;
  PetscInt best = TooFar(word);

  (void)!HycoGetOptionTable(NULL, NULL);
  for (int l = 0; l < 2; l++) {
    for (PetscInt k = 0; lists[l] && k < lists[l]->n; k++) {
      const char *name = lists[l]->option[k].name;

      if (word && strncasecmp(name, word, strlen(word)) == 0) return name; /* an abbreviation */
      OptionsCompare(word, name, &best, &nearest);
    }
  }
  return nearest;
}

/* The text is borrowed; "" ends it. */
PetscErrorCode HycoOptionsFor(const char only[])
{
  PetscFunctionBegin;
  readers = only;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Splits a text "<form> meaning [default]"; missing parts are as given. One allocation. */
static PetscErrorCode MakeOption(const char name[], const char text[], const char form[], const char initial[],
                                 const char owner[], HycoOption *o)
{
  const size_t end = strlen(text);
  const char *close = text[0] == '<' ? strchr(text, '>') : NULL, *meaning = close ? close + 1 : text,
             *open = end && text[end - 1] == ']' ? strrchr(text, '[') : NULL;
  const size_t size = end + strlen(name) + strlen(form) + strlen(initial) + strlen(owner) + strlen(readers) + 16;
  char *block, *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(size, &block));
  at = block;
/* The name comes first: it is the block's address, by which it is freed. */
#define Put(field, ...) o->field = at, at += snprintf(at, size - (size_t)(at - block), __VA_ARGS__) + 1
  Put(name, "%s", name[0] == '-' ? name + 1 : name);
  while (*meaning == ' ') meaning++;
  if (close)
    Put(value, "%.*s", close == text + 1 ? 0 : (int)(close + 1 - text), text); /* <>: a flag */
  else
    Put(value, "%s", form);
  if (open) {
    Put(initial, "%.*s", (int)(text + end - 2 - open), open + 1);
    Put(meaning, "%.*s", (int)(open - meaning - (open > meaning && open[-1] == ' ')), meaning);
  } else {
    Put(initial, "%s", initial);
    Put(meaning, "%s", meaning);
  }
  Put(owner, "%s", owner);
  Put(only, "%s", readers);
#undef Put
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An option that is declared twice, for example by two types of a class, is listed once. */
static PetscErrorCode OptionsAppend(HycoOptionList *list, HycoOption *option)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < list->n; k++) {
    if (strcasecmp(list->option[k].name, option->name)) continue;
    PetscCall(PetscFree(option->name));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoGrow(list->n, list->room, list->option);
  list->option[list->n++] = *option;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The option with the object's prefix, without the dash, for messages. */
#define NAMED(items, name) (items)->prefix ? (items)->prefix : "", (name) + 1

/* Records or prints the declaration, or finds the value's text: with the object's prefix, in its own options or, if
   it has a prefix, in the global ones. */
static PetscErrorCode OptionsFind(HycoOptionItems items, const char name[], const char text[], const char form[],
                                  const char initial[], size_t room, const char **value, PetscBool *set)
{
  const char *owner = items->object ? items->object->class_name : items->title;
  PetscBool help = PETSC_FALSE;
  HycoOption option;

  PetscFunctionBegin;
  *set = PETSC_FALSE;
  *value = NULL;
  if (!recording) PetscCall(PetscOptionsHasHelp(NULL, &help)); /* the options of a scene do not contain -help */
  /* count: PETSc passes through the declarations more than once. */
  if (recording || (help && items->count == 1 && (items->prefix || !HycoOptionListFind(&told, name + 1)))) {
    PetscCall(MakeOption(name, text, form, initial, owner, &option));
    if (help && !told.n) PetscCall(PetscRegisterFinalize(ForgetTable));
    if (help)
      PetscCall((*PetscHelpPrintf)(items->comm, "  -%s%s %s: %s [%s]\n", items->prefix ? items->prefix : "",
                                   option.name, option.value, option.meaning, option.initial));
    PetscCall(OptionsAppend(recording ? recording : &told, &option));
  }
  if (recording) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsFindPair(items->options, items->prefix, name, value, set));
  /* A caller's prefix is set on the command line, not in the scene. */
  if (!*set && items->options && items->prefix) PetscCall(PetscOptionsFindPair(NULL, items->prefix, name, value, set));
  if (*set && !*value) *value = "";
  HycoCheckValue(!*set || strlen(*value) < room, "-%s%s is longer than %d characters", NAMED(items, name),
                 (int)room - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Present values are the defaults, which the help shows. */
PetscErrorCode HycoOptionsReal_Private(HycoOptionItems items, const char name[], const char text[], PetscReal lo,
                                       PetscReal hi, PetscReal *value, PetscBool *set)
{
  char initial[32], *end, *zero;
  const char *word;
  PetscBool given;
  double number;

  PetscFunctionBegin;
  snprintf(initial, sizeof(initial), "%g", (double)*value);
  zero = strstr(initial, "e-0");
  if (zero) memmove(zero + 2, zero + 3, strlen(zero + 3) + 1); /* 1e-8, not 1e-08 */
  PetscCall(OptionsFind(items, name, text, "<real>", initial, HYCO_LINE, &word, &given));
  if (set) *set = given;
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  /* The negated comparison also refuses not a number. */
  number = HycoNumber(word, &end);
  if (end == word || *end != '\0' || !(number >= lo && number <= hi))
    HycoFailAs(HYCO_ERR_VALUE, "-%s%s is \"%.500s\"; it must be a number from %g to %g", NAMED(items, name), word,
               (double)lo, (double)hi);
  *value = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole text must be a number: "3.7" and "3x" are refused. */
PetscErrorCode HycoOptionsInt_Private(HycoOptionItems items, const char name[], const char text[], PetscInt lo,
                                      PetscInt hi, PetscInt *value, PetscBool *set)
{
  char initial[32], *end;
  const char *word;
  PetscBool given;
  long number;

  PetscFunctionBegin;
  snprintf(initial, sizeof(initial), "%ld", (long)*value);
  PetscCall(OptionsFind(items, name, text, "<int>", initial, HYCO_LINE, &word, &given));
  if (set) *set = given;
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  errno = 0;
  number = strtol(word, &end, 10);
  if (end == word || *end != '\0' || errno || number < lo || number > hi) {
    if (hi == PETSC_MAX_INT)
      HycoFailAs(HYCO_ERR_VALUE, "-%s%s is \"%.500s\"; it must be a whole number, at least %d", NAMED(items, name),
                 word, (int)lo);
    HycoFailAs(HYCO_ERR_VALUE, "-%s%s is \"%.500s\"; it must be a whole number from %d to %d", NAMED(items, name), word,
               (int)lo, (int)hi);
  }
  *value = (PetscInt)number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The index of `word` in `words`, which ends with NULL. Letter case is ignored. */
static PetscErrorCode FindWord(HycoOptionItems items, const char name[], const char word[], const char *const words[],
                               PetscInt *index)
{
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (*index = 0; words[*index]; ++*index) {
    if (strcasecmp(word, words[*index]) == 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(HycoListAdd(list, ", ", words[*index]));
  }
  HycoFailAs(HYCO_ERR_VALUE, "-%s%s is \"%.200s\"; it must be one of: %s", NAMED(items, name), word, list);
}

/* An option without a value is true. */
PetscErrorCode HycoOptionsBool_Private(HycoOptionItems items, const char name[], const char text[], PetscBool *value,
                                       PetscBool *set)
{
  static const char *const words[] = {"false", "no", "off", "0", "true", "yes", "on", "1", NULL};
  const char *word;
  PetscInt index = 4;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(OptionsFind(items, name, text, "<bool>", *value ? "true" : "false", HYCO_LINE, &word, &given));
  if (set) *set = given;
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  if (word[0]) PetscCall(FindWord(items, name, word, words, &index));
  *value = (PetscBool)(index >= 4);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The words are the form in the help. */
PetscErrorCode HycoOptionsWord_Private(HycoOptionItems items, const char name[], const char text[],
                                       const char *const words[], PetscInt *index, PetscBool *set)
{
  char form[HYCO_LINE] = "<";
  const char *word, *initial = "";
  PetscBool given;
  PetscInt found;

  PetscFunctionBegin;
  for (PetscInt k = 0; words[k]; k++) {
    PetscCall(PetscStrlcat(form, k ? "|" : "", sizeof(form)));
    PetscCall(PetscStrlcat(form, words[k], sizeof(form)));
    if (k == *index) initial = words[k];
  }
  PetscCall(PetscStrlcat(form, ">", sizeof(form)));
  PetscCall(OptionsFind(items, name, text, form, initial, HYCO_LINE, &word, &given));
  if (set) *set = given;
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FindWord(items, name, word, words, &found));
  *index = found;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsString_Private(HycoOptionItems items, const char name[], const char text[], char value[],
                                         size_t length, PetscBool *set)
{
  const char *word;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(OptionsFind(items, name, text, "<text>", value, length, &word, &given));
  if (set) *set = given;
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckValue(word[0], "-%s%s needs a value", NAMED(items, name));
  PetscCall(PetscStrncpy(value, word, length));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The caller frees *list and its texts. "none" clears a list that a scene sets. */
PetscErrorCode HycoOptionsList_Private(HycoOptionItems items, const char name[], const char text[], PetscInt *n,
                                       char ***list, PetscBool *set)
{
  const char *word;
  PetscInt room = 1;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(OptionsFind(items, name, text, "<list>", "none", 4 * HYCO_LINE, &word, &given));
  if (set) *set = given;
  *n = 0;
  *list = NULL;
  if (!given || strcasecmp(word, "none") == 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (const char *c = word; *c; c++) room += *c == ',';
  PetscCall(PetscCalloc1(room + 1, list));
  for (; *n < room; word += strcspn(word, ",") + 1) {
    const size_t length = strcspn(word, ",");

    PetscCall(PetscMalloc1(length + 1, &(*list)[*n]));
    PetscCall(PetscStrncpy((*list)[(*n)++], word, length + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only declares: PETSc reads viewers itself. */
PetscErrorCode HycoOptionsName_Private(HycoOptionItems items, const char name[], const char text[])
{
  const char *word;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(OptionsFind(items, name, text, "<viewer>", "", 4 * HYCO_LINE, &word, &given));
  PetscFunctionReturn(PETSC_SUCCESS);
}
