/* HYCO_ERR_NO_MODEL is distinguished from all other errors, on every rank. */
#include "check.h"
#include <string.h>

static PetscErrorCode NoModel(void)
{
  PetscFunctionBegin;
  HycoFailNoModel("no mode is left");
}

static PetscErrorCode Other(void)
{
  PetscFunctionBegin;
  HycoFail("the disk is full");
}

static PetscErrorCode OnRoot(PetscErrorCode (*call)(void))
{
  PetscFunctionBegin;
  HycoOnRoot(PETSC_COMM_WORLD, call());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Caught(PetscErrorCode (*call)(void), PetscErrorCode *code, char line[HYCO_LINE])
{
  PetscFunctionBegin;
  PetscCall(HycoCatchBegin());
  *code = OnRoot(call);
  PetscCall(HycoCatchEnd(*code, line));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  char line[HYCO_LINE];
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(Caught(NoModel, &code, line));
  CHECK(code == HYCO_ERR_NO_MODEL && strcmp(line, "no mode is left") == 0, "found %d: %s", (int)code, line);
  PetscCall(HycoCatchNoModel(code, line)); /* passes */
  PetscCall(HycoCatchNoModel(PETSC_SUCCESS, ""));
  PetscCall(Caught(Other, &code, line));
  CHECK(code == PETSC_ERR_USER && strcmp(line, "the disk is full") == 0, "found %d: %s", (int)code, line);
  CHECK_FAILS(HycoCatchNoModel(code, line), "the disk is full");
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
