/* hyco predict of a model of paths: a line a step, the table, the series, the report. */
#include "driver.h"

/* The columns of the table and of the report's history; of the RID where full order has the mesh. */
enum {
  TIME,
  SUBSTEPS,
  CUTS,
  ITERATIONS,
  MOST,
  ACTIVE_ITS,
  ACTIVE,
  FORCE,
  LAMBDA_MAX,
  U_NORM,
  MISES,
  INELASTIC,
  RESIDUAL,
  KKT,
  SECONDS,
  N_COLUMNS
};
static const char *const columns[N_COLUMNS] = {"t",
                                               "substeps",
                                               "cuts",
                                               "iterations",
                                               "most_iterations",
                                               "active_set_iterations",
                                               "n_active",
                                               "total_contact_force",
                                               "lambda_max",
                                               "rid_u_norm2",
                                               "rid_mises",
                                               "rid_inelastic",
                                               "residual",
                                               "kkt_max",
                                               "seconds"};

static void Fill(const HycoStep *s, PetscReal v[N_COLUMNS])
{
  v[TIME] = s->t;
  v[SUBSTEPS] = s->substeps;
  v[CUTS] = s->cuts;
  v[ITERATIONS] = s->iterations;
  v[MOST] = s->most_iterations;
  v[ACTIVE_ITS] = s->active_set_iterations;
  v[ACTIVE] = s->n_active;
  v[FORCE] = s->total_contact_force;
  v[LAMBDA_MAX] = s->lambda_max;
  v[U_NORM] = s->u_norm2;
  v[MISES] = s->mises;
  v[INELASTIC] = s->inelastic;
  v[RESIDUAL] = s->residual;
  v[KKT] = s->kkt;
  v[SECONDS] = s->seconds;
}

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
  PetscCall(PetscCalloc1(path->n * N_COLUMNS + 1, &path->value));
  for (PetscInt k = 0; k < h.n; k++) Fill(&h.step[k], path->value + k * N_COLUMNS);
  HycoBcast(path->value, path->n * N_COLUMNS, MPIU_REAL, PETSC_COMM_WORLD);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverSayReducedPath(HycoScene scene, const PetscReal mu[], const DriverReducedPath *path,
                                    const char table[])
{
  PetscInt n_par, n_times;
  PetscReal *point;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  for (PetscInt k = 0; k < path->n; k++) {
    const PetscReal *v = path->value + k * N_COLUMNS;

    PetscCall(
        Say("t %-11.10g %3d of %d: %d step%s, %d iteration%s%s, %d closed, force %.8g, inelastic %.3g, mises %.5g\n",
            (double)v[TIME], (int)k + 1, (int)n_times, (int)v[SUBSTEPS], v[SUBSTEPS] == 1 ? "" : "s",
            (int)v[ITERATIONS], v[ITERATIONS] == 1 ? "" : "s", v[CUTS] > 0 ? ", cut" : "", (int)v[ACTIVE],
            (double)v[FORCE], (double)v[INELASTIC], (double)v[MISES]));
  }
  if (!table[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(path->n * n_par + 1, &point));
  for (PetscInt k = 0; k < path->n; k++) PetscCall(PetscArraycpy(point + k * n_par, mu, n_par));
  PetscCall(DriverWriteTable(table, scene, path->n, point, N_COLUMNS, columns, path->value));
  PetscCall(PetscFree(point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverReportReducedPath(cJSON *json, const DriverReducedPath *path)
{
  cJSON *history = cJSON_AddObjectToObject(json, "history");

  cJSON_AddBoolToObject(history, "ended", path->ended);
  cJSON_AddNumberToObject(history, "t_end", path->t);
  for (PetscInt c = 0; c < N_COLUMNS; c++) {
    cJSON *array = cJSON_AddArrayToObject(history, columns[c]);

    for (PetscInt k = 0; k < path->n; k++)
      cJSON_AddItemToArray(array, cJSON_CreateNumber(path->value[k * N_COLUMNS + c]));
  }
}
