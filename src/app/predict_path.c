/* hyco predict for a model of paths: its output as text, table and report. */
#include "driver.h"

/* The history is broadcast, since all ranks write the report's arrays; the equilibrium stays on rank 0, which
   prints it. */
PetscErrorCode DriverGetReducedPath(HycoROM model, DriverReducedPath *path)
{
  HycoHistory h = {0};

  PetscFunctionBegin;
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetHistory(model, &h));
  path->ended = h.ended;
  path->t = h.t;
  path->n = h.n;
  path->time_error = h.time_error;
  if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(PetscStrncpy(path->why, h.why, sizeof(path->why)));
  PetscCallMPI(MPI_Bcast(path, sizeof(*path), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(PetscMalloc1(path->n, &path->step));
  if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(PetscArraycpy(path->step, h.step, path->n));
  HycoBcast(path->step, path->n * (PetscInt)sizeof(*path->step), MPI_BYTE, PETSC_COMM_WORLD);
  PetscCall(HycoROMWantsEquilibrium(model, &path->balanced));
  if (path->n && path->balanced) HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetEquilibrium(model, &path->equilibrium));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the path reached is printed and written, also if it ended early. */
PetscErrorCode DriverPrintReducedPath(HycoScene scene, const PetscReal mu[], const DriverReducedPath *path,
                                      const char table[])
{
  PetscInt n_times;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  for (PetscInt k = 0; k < path->n; k++) PetscCall(DriverPrintStep(&path->step[k], n_times, PETSC_TRUE));
  PetscCall(DriverWarnSteps(path->time_error));
  PetscCall(DriverWriteSteps(table, scene, mu, PETSC_TRUE, path->n, path->step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relative to the path's size, not to each time's: at vanishing loads the ratio would be one of round-off. */
PetscErrorCode DriverPrintEquilibrium(const DriverReducedPath *path)
{
  const HycoEquilibrium *e = &path->equilibrium;
  char words[3][32];

  PetscFunctionBegin;
  if (!path->balanced) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->why) {
    PetscCall(DriverPrint("equilibrium on the whole mesh is not known: %s\n", e->why));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  DriverPercent(e->worst, words[0]);
  DriverPercent(e->n ? e->residual[e->n - 1] : 0, words[1]);
  DriverPercent(e->worst_contact, words[2]);
  PetscCall(
      DriverPrint("equilibrium on the whole mesh: largest residual %s of the path's size, at t = %.10g; %s at the end; "
                  "residual of the contact conditions %s\n",
                  words[0], (double)path->step[e->at].t, words[1], words[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "equilibrium": null if a law has no solution. */
static void ReportEquilibrium(cJSON *json, const DriverReducedPath *path)
{
  const HycoEquilibrium *e = &path->equilibrium;
  cJSON *object;

  if (e->why) {
    cJSON_AddNullToObject(json, "equilibrium");
    return;
  }
  object = cJSON_AddObjectToObject(json, "equilibrium");
  ReportNumbers(object, {"worst", e->worst}, {"t", path->step[e->at].t}, {"worst_contact", e->worst_contact});
  ReportVector(object, "residual", e->n, e->residual);
  ReportVector(object, "contact", e->n, e->contact);
}

/* Keys as in solve; those on the RID have a prefix. */
PetscErrorCode DriverReportReducedPath(cJSON *json, HycoScene scene, const DriverReducedPath *path)
{
  cJSON *history = cJSON_AddObjectToObject(json, "history");

  PetscFunctionBegin;
  cJSON_AddBoolToObject(history, "ended", path->ended);
  cJSON_AddNumberToObject(history, "t_end", path->t);
  cJSON_AddNumberToObject(history, "time_error", path->time_error);
  PetscCall(DriverReportSteps(history, scene, PETSC_TRUE, path->n, path->step));
  if (path->balanced) ReportEquilibrium(json, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}
