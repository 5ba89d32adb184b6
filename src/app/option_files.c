/* Sources of options other than the command line: their check before PETSc reads them, and the report. */
#include "driver.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <strings.h>

#define DEEPEST 16 /* files that name each other */

static PetscBool OptionFileRead(const char path[], PetscBool yaml, int depth, char problem[HYCO_LINE]);

/* Follows the option files that a line of options names; a quoted name is not followed. strtok_r() changes the
   line: callers give a copy. */
static PetscBool FollowLine(char line[], int depth, char problem[HYCO_LINE])
{
  const char *before = "";
  char *word, *rest;

  for (word = strtok_r(line, " \t\r\n", &rest); word; word = strtok_r(NULL, " \t\r\n", &rest)) {
    const PetscBool yaml = (PetscBool)(strcasecmp(before, "-options_file_yaml") == 0);

    if ((yaml || strcasecmp(before, "-options_file") == 0) && !OptionFileRead(word, yaml, depth, problem))
      return PETSC_FALSE;
    /* The option of which the next word is the value. */
    before = word;
  }
  return PETSC_TRUE;
}

/* Whether PETSc can read an option file, if it exists, and those that it names; PETSc itself never ends if a file names
   itself, and gives no line of an error. */
static PetscBool OptionFileRead(const char path[], PetscBool yaml, int depth, char problem[HYCO_LINE])
{
  struct stat info; /* a pipe can be read only once */
  FILE *file = depth < DEEPEST && stat(path, &info) == 0 && S_ISREG(info.st_mode) ? fopen(path, "r") : NULL;
  char *line = NULL, wrong[HYCO_LINE];
  size_t room = 0;
  PetscBool good = PETSC_TRUE;

  if (depth == DEEPEST)
    snprintf(
        problem, HYCO_LINE,
        "the option file %.200s names itself, or files name each other more than %d times; remove an -options_file",
        path, DEEPEST);
  if (!file) return (PetscBool)(depth < DEEPEST);
  /* The whole file at once: YAML has no lines of its own. */
  if (yaml) {
    if (getdelim(&line, &room, '\0', file) > 0 && HycoYAMLHasProblem(line, wrong)) {
      snprintf(problem, HYCO_LINE, "the option file %.200s is not valid YAML: %.700s", path, wrong);
      good = PETSC_FALSE;
    }
  } else
    while (good && getline(&line, &room, file) > 0) {
      /* The characters with which PETSc begins a comment. strchr() also finds the end of an empty line. */
      if (!strchr("#%!", line[strspn(line, " \t")])) good = FollowLine(line, depth + 1, problem);
    }
  free(line);
  fclose(file);
  return good;
}

/* The same sources in the same order as PETSc reads them: ~/.petscrc, .petscrc, petscrc, the environment, the
   command line. */
PetscBool DriverCheckOptionFiles(int argc, char **argv)
{
  static const char *const files[] = {".petscrc", "petscrc"};
  const char *home = getenv("HOME"), *environment = getenv("PETSC_OPTIONS");
  char path[PETSC_MAX_PATH_LEN], problem[HYCO_LINE];
  PetscBool good = PETSC_TRUE, skip = PETSC_FALSE;

  for (int k = 1; k < argc; k++) skip = (PetscBool)(skip || strcmp(argv[k], "-skip_petscrc") == 0);
  snprintf(path, sizeof(path), "%s/.petscrc", home ? home : "");
  if (!skip && home) good = OptionFileRead(path, PETSC_FALSE, 0, problem);
  for (int k = 0; good && !skip && k < 2; k++) good = OptionFileRead(files[k], PETSC_FALSE, 0, problem);
  if (good && environment) {
    /* FollowLine() cuts the text, and the environment's must stay. */
    char *line = strdup(environment);

    good = (PetscBool)(!line || FollowLine(line, 0, problem));
    free(line);
  }
  for (int k = 1; good && k < argc - 1; k++) {
    const PetscBool yaml = (PetscBool)(strcasecmp(argv[k], "-options_file_yaml") == 0);

    if (yaml || strcasecmp(argv[k], "-options_file") == 0) good = OptionFileRead(argv[k + 1], yaml, 0, problem);
  }
  return good ? good : DriverRefuseEarly(problem);
}

/* "NAME": the options in the file, if it exists and has any. What the file says belongs to the report: results
   must be reproducible from it. */
static void AddFile(cJSON *object, const char path[])
{
  FILE *file = fopen(path, "r");
  char text[4 * DRIVER_LINE];
  size_t n;

  if (!file) return;
  n = fread(text, 1, sizeof(text) - 1, file);
  fclose(file);
  text[n] = '\0';
  if (n && !cJSON_HasObjectItem(object, path)) cJSON_AddStringToObject(object, path, text);
}

/* Blank values are none. */
static void AddEnvironment(cJSON *object, const char name[])
{
  const char *text = getenv(name);

  if (text && text[strspn(text, " ")]) cJSON_AddStringToObject(object, name, text);
}

/* Only if there are any: the key is absent in most reports. */
PetscErrorCode DriverReportOptionFiles(cJSON *json)
{
  cJSON *object = cJSON_CreateObject();
  PetscBool skip = PETSC_FALSE;
  char path[PETSC_MAX_PATH_LEN];
  const char *home = getenv("HOME");
  int argc;
  char **argv;

  PetscFunctionBegin;
  PetscCall(PetscGetArgs(&argc, &argv));
  AddEnvironment(object, "PETSC_OPTIONS");
  /* A result depends on options that are not on the command line: the report names their sources. */
  AddEnvironment(object, "PETSC_OPTIONS_YAML");
  for (int k = 1; k < argc; k++) skip = (PetscBool)(skip || strcmp(argv[k], "-skip_petscrc") == 0);
  if (!skip && home) {
    snprintf(path, sizeof(path), "%s/.petscrc", home);
    AddFile(object, path);
  }
  if (!skip) AddFile(object, ".petscrc");
  if (!skip) AddFile(object, "petscrc");
  for (int k = 2; k < argc - 1; k++) {
    if (strncmp(argv[k], "-options_file", 13) == 0) AddFile(object, argv[k + 1]);
  }
  if (cJSON_GetArraySize(object))
    cJSON_AddItemToObject(json, "options_from", object);
  else
    cJSON_Delete(object);
  PetscFunctionReturn(PETSC_SUCCESS);
}
