/* Sources of options other than the command line, for the report. */
#include "driver.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "NAME": the options in the file, if it exists and has any. */
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

static void AddEnvironment(cJSON *object, const char name[])
{
  const char *text = getenv(name);

  if (text && text[strspn(text, " ")]) cJSON_AddStringToObject(object, name, text);
}

PetscErrorCode DriverReportSources(cJSON *json)
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
