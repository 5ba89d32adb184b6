/* -gradient: derivatives of the outputs with respect to the parameters, in the report, the text and the columns of a
   table. */
#include "driver.h"
#include <string.h>

PetscErrorCode DriverReadGradient(PetscBool *gradient)
{
  PetscFunctionBegin;
  *gradient = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag(
      "-gradient", "derivatives of the outputs with respect to the parameters, in the report and the table", gradient));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* t: NULL, or the listed time, if it is not the last. */
static void AddKink(cJSON *kinks, const char output[], const char parameter[], const PetscReal *t)
{
  cJSON *kink = cJSON_CreateObject();

  cJSON_AddStringToObject(kink, "output", output);
  cJSON_AddStringToObject(kink, "parameter", parameter);
  if (t) cJSON_AddNumberToObject(kink, "t", *t);
  cJSON_AddItemToArray(kinks, kink);
}

/* The derivatives of a path: of its extremes, and of outputs at each listed time. */
static PetscErrorCode ReportPath(cJSON *json, cJSON *kinks, HycoScene scene, const HycoGradient *g)
{
  const PetscInt n = g->n_outputs * g->n_parameters;
  const char *outputs[HYCO_MAX_QUANTITIES];
  const char *const *names;
  const PetscReal *t;
  PetscInt count;
  cJSON *path = cJSON_AddObjectToObject(json, "gradient_path"),
        *times = cJSON_AddObjectToObject(json, "gradient_times");

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(scene, &count, outputs));
  PetscCall(HycoSceneGetParameters(scene, NULL, &names, NULL, NULL));
  PetscCall(HycoSceneGetHistory(scene, NULL, &t));
  for (PetscInt q = 0; q < g->n_outputs; q++) {
    cJSON *of = cJSON_AddObjectToObject(path, outputs[q]), *along = cJSON_AddObjectToObject(times, outputs[q]);

    for (PetscInt p = 0; p < g->n_parameters; p++) {
      const PetscInt at = q * g->n_parameters + p;
      cJSON *each = cJSON_AddArrayToObject(along, names[p]);
      char name[DRIVER_LINE];

      cJSON_AddNumberToObject(of, names[p], g->path[at]);
      PetscCall(PetscSNPrintf(name, sizeof(name), "path_%s", outputs[q]));
      if (g->path_kink[at]) AddKink(kinks, name, names[p], NULL);
      for (PetscInt k = 0; k < g->n_times; k++) {
        cJSON_AddItemToArray(each, cJSON_CreateNumber(g->times[k * n + at]));
        /* A kink at the last time is that of `gradient`, and listed with it. */
        if (g->times_kink[k * n + at] && k < g->n_times - 1) AddKink(kinks, outputs[q], names[p], &t[k]);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows are outputs, columns parameters. A derivative at a kink is marked where it stands, and listed apart,
   because a number alone does not show that it is one-sided. */
PetscErrorCode DriverReportGradient(cJSON *json, HycoScene scene, const HycoGradient *g)
{
  const char *outputs[HYCO_MAX_QUANTITIES];
  const char *const *names;
  PetscInt n;
  cJSON *object = cJSON_AddObjectToObject(json, "gradient"), *kinks;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(scene, &n, outputs));
  PetscCall(HycoSceneGetParameters(scene, NULL, &names, NULL, NULL));
  cJSON_AddNumberToObject(json, "gradient_undecided", g->n_undecided);
  kinks = cJSON_AddArrayToObject(json, "gradient_kinks");
  for (PetscInt q = 0; q < g->n_outputs; q++) {
    cJSON *of = cJSON_AddObjectToObject(object, outputs[q]);

    PetscCall(DriverPrint("gradient of %s:", outputs[q]));
    for (PetscInt p = 0; p < g->n_parameters; p++) {
      const PetscInt at = q * g->n_parameters + p;

      cJSON_AddNumberToObject(of, names[p], g->value[at]);
      PetscCall(
          DriverPrint("%s %s %.6g%s", p ? "," : "", names[p], (double)g->value[at], g->kink[at] ? " (one-sided)" : ""));
      if (g->kink[at]) AddKink(kinks, outputs[q], names[p], NULL);
    }
    PetscCall(DriverPrint("\n"));
  }
  if (g->n_times) PetscCall(ReportPath(json, kinks, scene, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One more column counts the one-sided derivatives of the row. */
PetscErrorCode DriverGradientColumns(HycoScene scene, DriverGradients *columns)
{
  const char *outputs[HYCO_MAX_QUANTITIES];
  const char *const *names;
  PetscInt n, n_par;

  PetscFunctionBegin;
  columns->n = 0;
  columns->name = NULL;
  /* `on` is set by the caller, the rest here. */
  if (!columns->on) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSceneGetQuantities(scene, &n, outputs));
  PetscCall(HycoSceneGetParameters(scene, &n_par, &names, NULL, NULL));
  columns->n = n * n_par + 1;
  PetscCall(PetscMalloc1(columns->n, &columns->name));
  for (PetscInt k = 0; k < n * n_par; k++)
    PetscCall(PetscSNPrintf(columns->name[k], DRIVER_LINE, "d_%s_d_%s", outputs[k / n_par], names[k % n_par]));
  PetscCall(PetscStrncpy(columns->name[n * n_par], "gradient_kinks", DRIVER_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All derivatives of a point, and last how many of them are one-sided. */
void DriverGradientFill(const DriverGradients *columns, const HycoGradient *g, PetscReal v[])
{
  if (!columns->n) return;
  v[columns->n - 1] = 0;
  for (PetscInt k = 0; k < columns->n - 1; k++) {
    v[k] = g->value[k];
    v[columns->n - 1] += g->kink[k];
  }
}

PetscErrorCode DriverGradientCatch(const DriverGradients *columns, const HycoGradient *g, PetscErrorCode caught,
                                   DriverLacking *lacking, PetscReal v[])
{
  char why[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoCatchEnd(caught, why));
  if (!caught) {
    DriverGradientFill(columns, g, v);
    lacking->n_found++;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The prediction stands: a point without a derivative must not cost the others of a set. */
  if (!lacking->n++) PetscCall(PetscStrncpy(lacking->why, why, sizeof(lacking->why)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A gradient that no point has is refused as that of a single point is: nothing is written. */
PetscErrorCode DriverGradientsEnd(DriverLacking *l)
{
  const MPI_Comm comm = PETSC_COMM_WORLD;
  PetscInt sum[2] = {l->n_found, l->n};
  PetscMPIInt size = HycoSize(comm), first = l->n ? HycoRank(comm) : size;

  PetscFunctionBegin;
  HycoAllreduce(sum, 2, MPIU_INT, MPI_SUM, comm);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first < size) PetscCallMPI(MPI_Bcast(l->why, HYCO_LINE, MPI_CHAR, first, comm));
  l->n_found = sum[0];
  l->n = sum[1];
  HycoCheck(!l->n || l->n_found, "%s", l->why);
  PetscFunctionReturn(PETSC_SUCCESS);
}
