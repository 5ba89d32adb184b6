/* hyco predict of a model of paths: what it reached, in words, in the table, in the report. */
#include "driver.h"

PetscErrorCode DriverGetReducedPath(HycoROM model, DriverReducedPath *path)
{
  HycoHistory h = {0};
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetHistory(model, &h));
  path->ended = h.ended;
  path->t = h.t;
  path->n = h.n;
  if (rank == 0) PetscCall(PetscStrncpy(path->why, h.why, sizeof(path->why)));
  PetscCallMPI(MPI_Bcast(path, sizeof(*path), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(PetscMalloc1(path->n, &path->step));
  if (rank == 0) PetscCall(PetscArraycpy(path->step, h.step, path->n));
  HycoBcast(path->step, path->n * (PetscInt)sizeof(*path->step), MPI_BYTE, PETSC_COMM_WORLD);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverSayReducedPath(HycoScene scene, const PetscReal mu[], const DriverReducedPath *path,
                                    const char table[])
{
  PetscInt n_times;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  for (PetscInt k = 0; k < path->n; k++) PetscCall(DriverSayStep(&path->step[k], n_times));
  PetscCall(DriverWriteSteps(table, scene, mu, PETSC_TRUE, path->n, path->step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReportReducedPath(cJSON *json, HycoScene scene, const DriverReducedPath *path)
{
  cJSON *history = cJSON_AddObjectToObject(json, "history");

  PetscFunctionBegin;
  cJSON_AddBoolToObject(history, "ended", path->ended);
  cJSON_AddNumberToObject(history, "t_end", path->t);
  PetscCall(DriverReportSteps(history, scene, PETSC_TRUE, path->n, path->step));
  PetscFunctionReturn(PETSC_SUCCESS);
}
