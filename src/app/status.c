/* The exit status of the command, and the message for missed targets. */
#include "driver.h"
#include <stdarg.h>
#include <stdio.h>

static cJSON *missed; /* messages of DriverMissed(), an array; NULL: none */

/* No error: the model or prediction is written, and the exit status is 3. Collective, with the same text on all
   ranks. */
PetscErrorCode DriverMissed(const char format[], ...)
{
  char text[DRIVER_LINE];
  va_list args;

  PetscFunctionBegin;
  va_start(args, format);
  vsnprintf(text, sizeof(text), format, args);
  va_end(args);
  if (HycoRank(PETSC_COMM_WORLD) == 0) {
    fprintf(stderr, "hyco: missed: %s\n", text);
    fflush(stderr);
  }
  /* All ranks keep the list: each builds the report, and the exit status must agree. */
  if (!missed) missed = cJSON_CreateArray();
  cJSON_AddItemToArray(missed, cJSON_CreateString(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A copy: the list is needed for the status afterwards. */
void DriverReportMissed(cJSON *json)
{
  if (missed) cJSON_AddItemToObject(json, "missed", cJSON_Duplicate(missed, cJSON_True));
}

/* An error outweighs a miss. */
int DriverEndStatus(PetscErrorCode ierr)
{
  const int status = ierr ? DRIVER_FAILED : missed ? DRIVER_MISSED : DRIVER_DONE;

  cJSON_Delete(missed);
  missed = NULL;
  return status;
}
