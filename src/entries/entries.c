/*
  A scene's entries: read from YAML into the scene's own options database, overridden by the command line, and listed by
  key. Known entries have the form SECTION_NAME_FIELD: body_pellet_young, fixed_sym_x0_x.
*/
#include <hycosceneimpl.h>
#include <hycoentries.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static const char *const sections[] = {"scene_",    "parameter_", "constant_", "body_",    "fixed_",    "pressure_",
                                       "traction_", "force_",     "spring_",   "gravity_", "rotation_", "contact_",
                                       "hyco_",     "output_",    "history_",  "tie_"};

/* PETSc's own options share the database: the prefix decides. */
PetscBool HycoIsSceneKey(const char name[])
{
  for (size_t s = 0; name && s < sizeof(sections) / sizeof(sections[0]); s++) {
    if (strncasecmp(name, sections[s], strlen(sections[s])) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The names (without dash) of the options that are set in `options` (NULL: global) and are scene keys. */
static PetscErrorCode ListKeys(PetscOptions options, PetscBool method_only, PetscInt *n, char ***keys)
{
  char *all, *word, *rest;
  PetscInt room = 0;

  PetscFunctionBegin;
  *n = 0;
  *keys = NULL;
  /* One text of all options and values; a word that begins with a dash may also be a value, which HasName()
     excludes. */
  PetscCall(PetscOptionsGetAll(options, &all));
  for (word = all; *word; word++) room += *word == '-';
  PetscCall(PetscCalloc1(room + 1, keys));
  for (word = strtok_r(all, " ", &rest); word; word = strtok_r(NULL, " ", &rest)) {
    PetscBool set = PETSC_FALSE, seen = PETSC_FALSE;

    if (word[0] != '-' || !HycoIsSceneKey(word + 1)) continue;
    /* an unknown -hyco_ option on the command line may be meant for a solver (-hyco_tao_type): the caller checks it */
    if (!options && strncasecmp(word + 1, "hyco_", 5) == 0 && !HycoOptionFind(word + 1)) continue;
    if (method_only && strncasecmp(word + 1, "hyco_", 5)) continue;
    PetscCall(PetscOptionsHasName(options, NULL, word, &set));
    for (PetscInt k = 0; k < *n; k++) seen = (PetscBool)(seen || strcasecmp((*keys)[k], word + 1) == 0);
    if (set && !seen) PetscCall(PetscStrallocpy(word + 1, &(*keys)[(*n)++]));
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an option of any length. PetscOptionsGetString() needs the length beforehand, and cuts longer ones. */
static PetscErrorCode GetLong(PetscOptions options, const char key[], char **value)
{
  char dashed[HYCO_LINE];
  const char *text = NULL;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", key));
  PetscCall(PetscOptionsFindPair(options, NULL, dashed, &text, &set));
  PetscCall(PetscStrallocpy(set && text ? text : "", value));
  for (char *c = *value; *c; c++) { /* an entry is one line in a model file */
    if (*c == '\n' || *c == '\r' || *c == '\t') *c = ' ';
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the global database's entries over the scene's own; only those of the method if the scene is a model's. The
   command line wins over the scene, so that a study needs one file. */
PetscErrorCode HycoEntriesOverride(PetscOptions options, PetscBool method_only)
{
  PetscInt n;
  char **keys;

  PetscFunctionBegin;
  PetscCall(ListKeys(NULL, method_only, &n, &keys));
  for (PetscInt k = 0; k < n; k++) {
    char dashed[HYCO_LINE];
    char *value;

    PetscCall(GetLong(NULL, keys[k], &value));
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", keys[k]));
    PetscCall(PetscOptionsSetValue(options, dashed, value));
    HycoFreeAll(&value, &keys[k]);
  }
  PetscCall(PetscFree(keys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By key: the order in which the database lists them is no property of the scene. */
static int CompareEntries(const void *a, const void *b)
{
  return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Refuses entries that were not read: those of no known section, and those whose name has a blank. After all known
   entries have been read, PETSc's list of unused ones has the rest. */
static PetscErrorCode RefuseOthers(PetscOptions options)
{
  PetscInt n;
  char **names, **values, name[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(options, &n, &names, &values));
  if (n) snprintf(name, sizeof(name), "%.200s", names[0]);
  PetscCall(PetscOptionsLeftRestore(options, &n, &names, &values));
  HycoCheck(
      !name[0],
      "the scene's entry \"%s\" is unknown; the entries are scene, parameter, constant, body, fixed, tie, pressure, "
      "traction, force, spring, gravity, rotation, contact, history, output and hyco, and names have no blanks",
      name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene->key takes over the array; the number of entries grows as values are read, so that a scene that fails is freed
   to that point. Sorted: members of a section follow each other, bodies come before forces, and a fingerprint does not
   depend on the file's order. */
PetscErrorCode HycoEntriesList(HycoScene scene)
{
  PetscInt n;
  char **keys;

  PetscFunctionBegin;
  PetscCall(ListKeys(scene->options, PETSC_FALSE, &n, &keys));
  qsort(keys, (size_t)n, sizeof(*keys), CompareEntries);
  PetscCall(PetscCalloc1(n, &scene->value));
  scene->key = keys;
  for (PetscInt k = 0; k < n; k++) { /* a model file stores key, tab, value, end of line */
    char **value = &scene->value[scene->n_entries];

    if (keys[k][strcspn(keys[k], "\t\r\n\f\v")]) {
      char name[HYCO_LINE];

      snprintf(name, sizeof(name), "%.200s", keys[k]);
      for (; k < n; k++) PetscCall(PetscFree(keys[k]));
      HycoFail("the scene's entry \"%s\" has a blank in its name", name);
    }
    PetscCall(GetLong(scene->options, keys[k], value));
    keys[scene->n_entries] = keys[k];
    if (strlen(keys[k]) > 5 && strcmp(keys[k] + strlen(keys[k]) - 5, "_view") == 0 &&
        HycoOptionFind(keys[k])) { /* options of this run, not part of the scene's description */
      HycoFreeAll(value, &keys[scene->n_entries]);
    } else
      scene->n_entries++;
  }
  PetscCall(RefuseOthers(scene->options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marked as read: a scene serves commands that have no such solver. */
PetscErrorCode HycoEntriesShare(HycoScene scene)
{
  PetscFunctionBegin;
  PetscCall(PetscCalloc1(scene->n_entries + 1, &scene->shared));
  for (PetscInt k = 0; k < scene->n_entries; k++) {
    char dashed[HYCO_LINE];
    PetscBool solvers, reads, set;

    if (strncasecmp(scene->key[k], "hyco_", 5) || HycoOptionFind(scene->key[k])) continue;
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", scene->key[k]));
    PetscCall(PetscOptionsHasName(NULL, NULL, dashed, &set));
    if (set) continue;
    PetscCall(PetscOptionsSetValue(NULL, dashed, scene->value[k]));
    scene->shared[k] = PETSC_TRUE;
    PetscCall(HycoOptionsOfSolver(scene->key[k], &solvers, &reads));
    HycoCheck(reads, "the option %s is unknown: none of PETSc's solvers in hyco reads it", scene->key[k]);
    PetscCall(PetscOptionsHasName(NULL, NULL, dashed, &set));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoEntriesUnshare(HycoScene scene)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; scene->shared && k < scene->n_entries; k++) {
    char dashed[HYCO_LINE];

    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", scene->key[k]));
    if (scene->shared[k]) PetscCall(PetscOptionsClearValue(NULL, dashed));
  }
  PetscCall(PetscFree(scene->shared));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene's file and folder: `path` is a folder with scene.yaml, or the file. 16 characters of room for what is
   appended. */
static PetscErrorCode FindFile(const char path[], char file[PETSC_MAX_PATH_LEN], char folder[PETSC_MAX_PATH_LEN])
{
  struct stat info;
  char *slash;

  PetscFunctionBegin;
  HycoCheck(strlen(path) + 16 < PETSC_MAX_PATH_LEN, "the scene's path is too long");
  HycoCheckFile(stat(path, &info) == 0, "the scene %s does not exist; give a folder with scene.yaml, or a .yaml file",
                path);
  if (S_ISDIR(info.st_mode)) {
    snprintf(file, PETSC_MAX_PATH_LEN, "%s%sscene.yaml", path, path[strlen(path) - 1] == '/' ? "" : "/");
    HycoCheckFile(stat(file, &info) == 0, "the folder %s has no scene.yaml", path);
  } else {
    snprintf(file, PETSC_MAX_PATH_LEN, "%s", path);
  }
  /* Paths in the scene are relative to its file. */
  snprintf(folder, PETSC_MAX_PATH_LEN, "%s", file);
  slash = strrchr(folder, '/');
  if (slash)
    *slash = '\0';
  else
    snprintf(folder, PETSC_MAX_PATH_LEN, ".");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* libyaml and PETSc treat a byte 0 differently. A zero byte would end the text for one of them and not for the other,
   which would then check something else. */
static PetscBool IsText(const char file[])
{
  FILE *f = fopen(file, "rb");
  int byte;

  if (!f) return PETSC_FALSE;
  while ((byte = fgetc(f)) > 0)
    ;
  fclose(f);
  return (PetscBool)(byte == EOF);
}

/* The file's text, terminated by a byte 0; NULL if it has none. The caller frees it. By its size, so the file must
   be seekable; a pipe gives NULL, and PETSc reads it. */
static PetscErrorCode ReadText(const char file[], char **text)
{
  FILE *f = fopen(file, "rb");
  long size = f && fseek(f, 0, SEEK_END) == 0 ? ftell(f) : 0;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  *text = NULL;
  if (size > 0) {
    rewind(f);
    ierr = PetscCalloc1((size_t)size + 1, text);
    if (!ierr) (*text)[fread(*text, 1, (size_t)size, f)] = '\0';
  }
  if (f) fclose(f);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc reads the file itself, unless it has nested lists. */
static PetscErrorCode EntriesInsert(PetscOptions options, const char file[], char text[])
{
  PetscFunctionBegin;
  if (text && HycoEntriesFlatten(text))
    PetscCall(PetscOptionsInsertStringYAML(options, text));
  else
    PetscCall(PetscOptionsInsertFileYAML(PETSC_COMM_SELF, options, file, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Duplicate keys and nesting are checked before PETSc reads the text, which accepts both silently. PETSc's own errors
   name no file, and are replaced by a line that does. PETSc reads the same text that was checked. */
static PetscErrorCode ReadYAML(PetscOptions options, const char file[])
{
  char message[HYCO_LINE], *text;
  PetscErrorCode caught;

  PetscFunctionBegin;
  HycoCheck(IsText(file), "%s is not valid YAML for hyco: it contains a zero byte, or cannot be read", file);
  PetscCall(ReadText(file, &text));
  HycoOnError(text ? HycoEntriesCheck(text, file) : PETSC_SUCCESS, PetscCall(PetscFree(text)));
  HycoCatch(EntriesInsert(options, file, text), caught, message);
  PetscCall(PetscFree(text));
  HycoCheck(!caught || !strstr(message, "max number of options"),
            "%s has more than 512 entries, the limit of this PETSc (%d.%d); combine entries into one expression, or "
            "use a newer PETSc",
            file, PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR);
  HycoCheck(!caught, "%s is not valid YAML for hyco: %s", file, message);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank reads the file: it is small, and PETSc's options are local to a rank. Collective by the check of errors.
   The command line's entries are then put over those of the file. */
PetscErrorCode HycoEntriesRead(MPI_Comm comm, const char path[], PetscOptions *options, char folder[PETSC_MAX_PATH_LEN])
{
  char file[PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBegin;
  HycoOnEach(comm, FindFile(path, file, folder));
  PetscCall(PetscOptionsCreate(options));
  HycoOnEach(comm, ReadYAML(*options, file));
  PetscCall(HycoEntriesOverride(*options, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
