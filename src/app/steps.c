/* The listed times of a path, for solve and predict: a line each, the table, the report's history. */
#include "driver.h"
#include <math.h>
#include <stddef.h>

/* A quantity of a listed time: its column in solve and in predict (NULL: none), its offset in HycoStep. */
typedef struct {
  const char *full, *reduced;
  size_t at;
  enum { REAL, COUNT, NONE } kind; /* PetscReal; PetscInt; whether a PetscInt is 0, NaN below it */
} Column;

#define BOTH(name, member, kind)                                                                                       \
  {                                                                                                                    \
    name, name, offsetof(HycoStep, member), kind                                                                       \
  }
#define ON_RID(name, member)                                                                                           \
  {                                                                                                                    \
    name, "rid_" name, offsetof(HycoStep, member), REAL                                                                \
  }
#define FULL_ONLY(name, member, kind)                                                                                  \
  {                                                                                                                    \
    name, NULL, offsetof(HycoStep, member), kind                                                                       \
  }

static const Column columns[] = {
    BOTH("t", t, REAL),
    BOTH("substeps", substeps, COUNT),
    BOTH("cuts", cuts, COUNT),
    BOTH("iterations", iterations, COUNT),
    BOTH("most_iterations", most_iterations, COUNT),
    BOTH("factors", factors, COUNT),
    BOTH("active_set_iterations", active_set_iterations, COUNT),
    FULL_ONLY("linear_iterations", linear_iterations, COUNT),
    FULL_ONLY("most_linear_iterations", most_linear_iterations, COUNT),
    BOTH("n_active", n_active, COUNT),
    BOTH("total_contact_force", total_contact_force, REAL),
    BOTH("lambda_max", lambda_max, REAL),
    ON_RID("u_norm2", u_norm2),
    ON_RID("mises", mises),
    ON_RID("inelastic", inelastic),
    BOTH("residual", residual, REAL),
    BOTH("kkt_max", kkt, REAL),
    BOTH("forces_unique", n_dependent, NONE),
    BOTH("sliding", sliding, REAL),
    FULL_ONLY("work", work, REAL),
    FULL_ONLY("contact_work", contact_work, REAL),
    FULL_ONLY("stored", stored, REAL),
    FULL_ONLY("dissipated", dissipated, REAL),
    FULL_ONLY("thermal", thermal, REAL),
    FULL_ONLY("energy_defect", energy_defect, REAL),
    BOTH("seconds", seconds, REAL),
    /* of scenes with friction */
    BOTH("friction_work", friction_work, REAL),
    BOTH("n_slipping", n_slipping, COUNT),
    BOTH("disproven", disproven, COUNT),
};
enum { N_COLUMNS = sizeof(columns) / sizeof(columns[0]), N_FRICTION = 3 };

/* Those of friction are the last ones. */
static PetscInt CountColumns(HycoScene scene)
{
  return HycoSceneHasFriction(scene) ? N_COLUMNS : N_COLUMNS - N_FRICTION;
}

/* NULL: the quantity has no meaning for that kind of path. */
static const char *NameOf(const Column *c, PetscBool reduced)
{
  return reduced ? c->reduced : c->full;
}

/* By offset: one table describes columns, report and struct. */
static PetscReal ValueOf(const Column *c, const HycoStep *s)
{
  const char *at = (const char *)s + c->at;
  PetscInt n;

  if (c->kind == REAL) return *(const PetscReal *)(const void *)at;
  n = *(const PetscInt *)(const void *)at;
  return c->kind == COUNT ? (PetscReal)n : n < 0 ? NAN : n == 0;
}

/* A line as soon as a listed time is reached: paths may take hours. The widths are those of usual values, so that
   lines are aligned. reduced: the stress is that of the RID's cells. */
PetscErrorCode DriverPrintStep(const HycoStep *s, PetscInt n, PetscBool reduced)
{
  PetscFunctionBegin;
  PetscCall(DriverPrint(
      "t %-11.10g %3d of %d: %d step%s, %d iteration%s%s, %d closed, force %.8g, inelastic %.3g, mises%s %.5g\n",
      (double)s->t, (int)s->index + 1, (int)n, (int)s->substeps, s->substeps == 1 ? "" : "s", (int)s->iterations,
      s->iterations == 1 ? "" : "s", s->cuts ? ", cut" : "", (int)s->n_active, (double)s->total_contact_force,
      (double)s->inelastic, reduced ? " of the RID" : "", (double)s->mises));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A warning, no error: closed contacts with dependent rows leave the nodal forces undetermined, while all that
   follows from B^T L is unique. */
PetscErrorCode DriverPrintDependent(PetscInt n_dependent, PetscInt n, const HycoStep step[])
{
  const char *before = " at t =";

  PetscFunctionBegin;
  if (n_dependent <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DriverPrint("contact forces are not unique"));
  for (PetscInt k = 0; k < n; k++) {
    if (step[k].n_dependent <= 0) continue;
    PetscCall(DriverPrint("%s %.10g", before, (double)step[k].t));
    before = ",";
  }
  PetscCall(
      DriverPrint(": %d closed contact%s linearly on the others (more slaves than their masters' unknowns, or friction "
                  "of two contacts at a node); without friction, displacements and resultants are unique\n",
                  (int)n_dependent, n_dependent > 1 ? "s depend" : " depends"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverPrintBalance(PetscReal balance)
{
  PetscFunctionBegin;
  if (balance >= 0)
    PetscCall(DriverPrint("balance of loads, contact and supports, forces and moments of each body: to %.1e\n",
                          (double)balance));
  else
    PetscCall(
        DriverPrint("balance of forces: not compared, as supports carry what is left, or the path ended early\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu in each row: tables of several paths can be put together. */
PetscErrorCode DriverWriteSteps(const char table[], HycoScene scene, const PetscReal mu[], PetscBool reduced,
                                PetscInt n, const HycoStep step[])
{
  const char *own[N_COLUMNS], *names[N_COLUMNS + HYCO_MAX_QUANTITIES];
  PetscReal *value, *point;
  PetscInt n_par, n_own = 0, width;
  DriverPiece all;
  DriverRows rows;

  PetscFunctionBegin;
  if (!n || !table[0]) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; c < CountColumns(scene); c++) {
    /* Some columns exist only for full order or only for reduced paths. */
    if (NameOf(&columns[c], reduced)) own[n_own++] = NameOf(&columns[c], reduced);
  }
  PetscCall(ReportColumns(scene, n_own, own, &width, names));
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  PetscCall(PetscMalloc2(n * width, &value, n * n_par, &point));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *v = value + k * width;

    for (PetscInt c = 0; c < CountColumns(scene); c++) {
      if (NameOf(&columns[c], reduced)) *v++ = ValueOf(&columns[c], &step[k]);
    }
    PetscCall(PetscArraycpy(v, step[k].quantity, width - n_own));
    PetscCall(PetscArraycpy(point + k * n_par, mu, n_par));
  }
  /* All ranks have the steps; rank 0's are written. */
  rows = DriverRowsOfRoot(n, width, value, &all);
  PetscCall(DriverWriteTable(table, scene, point, names, &rows));
  PetscCall(PetscFree2(value, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An array for each column of a path's table. A column that this kind of path does not know is NaN at its first
   time already, and is left out rather than filled with null. */
PetscErrorCode DriverReportSteps(cJSON *history, HycoScene scene, PetscBool reduced, PetscInt n, const HycoStep step[])
{
  const char *names[HYCO_MAX_QUANTITIES];
  cJSON *outputs;
  PetscInt n_quantities;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < CountColumns(scene); c++) {
    const char *name = NameOf(&columns[c], reduced);
    const PetscBool known = (PetscBool) !(n && PetscIsNanReal(ValueOf(&columns[c], &step[0])));
    cJSON *array = name && known ? cJSON_AddArrayToObject(history, name) : NULL;

    for (PetscInt k = 0; array && k < n; k++)
      cJSON_AddItemToArray(array, cJSON_CreateNumber(ValueOf(&columns[c], &step[k])));
  }
  PetscCall(HycoSceneGetQuantities(scene, &n_quantities, names));
  outputs = n_quantities ? cJSON_AddObjectToObject(history, "outputs") : NULL;
  for (PetscInt q = 0; q < n_quantities; q++) {
    cJSON *array = cJSON_AddArrayToObject(outputs, names[q]);

    for (PetscInt k = 0; k < n; k++) cJSON_AddItemToArray(array, cJSON_CreateNumber(step[k].quantity[q]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
