/* hyco export: the predictions of a model as a program of its own, in a format of an extension. */
#include "driver.h"

static PetscErrorCode ReadFile(char path[])
{
  PetscFunctionBegin;
  PetscCall(DriverGet("c", "<file.c> C99 without dependencies that predicts; file.h beside it declares it", path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareExport(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(NULL, path, NULL, NULL, NULL));
  PetscCall(DriverReadQuiet());
  PetscCall(ReadFile(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0. */
static PetscErrorCode ExportCommandRun(const char model[], const char path[])
{
  HycoROM m = NULL;
  char *description = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMLoad(model, &m));
  ierr = HycoROMExport(m, "c", path, &description);
  if (!ierr && !DriverIsQuiet()) ierr = PetscPrintf(PETSC_COMM_SELF, "%s", description);
  PetscCall(PetscFree(description));
  PetscCall(HycoROMDestroy(&m));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The export compares what it wrote with the model: an error there must reach every rank. */
PetscErrorCode CommandExport(void)
{
  char model[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(NULL, model, NULL, NULL, NULL));
  PetscCall(DriverReadQuiet());
  PetscCall(ReadFile(path));
  PetscCall(DriverRequire("model", model));
  PetscCall(DriverRequire("c", path));
  PetscCall(DriverCheckLeft());
  HycoOnRoot(PETSC_COMM_WORLD, ExportCommandRun(model, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}
