/* -gradient: derivatives of the outputs with respect to the parameters, in the report, the text and the columns of a table. */
#include "driver.h"
#include <string.h>

/* scene NULL: only declares the option. */
PetscErrorCode DriverReadGradient(HycoScene scene, PetscBool *gradient)
{
  PetscFunctionBegin;
  *gradient = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag(
      "-gradient", "derivatives of the outputs with respect to the parameters, in the report and the table", gradient));
  PetscOptionsEnd();
  if (scene && *gradient) PetscCall(HycoSceneRefuseHistory(scene, "-gradient"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
      cJSON *kink;

      cJSON_AddNumberToObject(of, names[p], g->value[at]);
      PetscCall(
          DriverPrint("%s %s %.6g%s", p ? "," : "", names[p], (double)g->value[at], g->kink[at] ? " (one-sided)" : ""));
      /* At a contact that is just about to close or open the derivative differs by side. */
      if (!g->kink[at]) continue;
      kink = cJSON_CreateObject();
      cJSON_AddStringToObject(kink, "output", outputs[q]);
      cJSON_AddStringToObject(kink, "parameter", names[p]);
      cJSON_AddItemToArray(kinks, kink);
    }
    PetscCall(DriverPrint("\n"));
  }
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

void DriverGradientFill(const DriverGradients *columns, const HycoGradient *g, PetscReal v[])
{
  if (!columns->n) return;
  v[columns->n - 1] = 0;
  for (PetscInt k = 0; k < columns->n - 1; k++) {
    v[k] = g->value[k];
    v[columns->n - 1] += g->kink[k];
  }
}
