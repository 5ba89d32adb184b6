/* hyco solve on a scene with a history: a line a step, the table, the series, the report. */
#include "driver.h"

/* The columns of the table and of the report's history. */
enum {
  TIME,
  SUBSTEPS,
  CUTS,
  ITERATIONS,
  MOST,
  FACTORS,
  ACTIVE_ITS,
  ACTIVE,
  FORCE,
  LAMBDA_MAX,
  U_NORM,
  MISES,
  INELASTIC,
  RESIDUAL,
  KKT,
  WORK,
  CONTACT_WORK,
  STORED,
  DISSIPATED,
  THERMAL,
  DEFECT,
  SECONDS,
  N_COLUMNS
};
static const char *const columns[N_COLUMNS] = {"t",
                                               "substeps",
                                               "cuts",
                                               "iterations",
                                               "most_iterations",
                                               "factors",
                                               "active_set_iterations",
                                               "n_active",
                                               "total_contact_force",
                                               "lambda_max",
                                               "u_norm2",
                                               "mises",
                                               "inelastic",
                                               "residual",
                                               "kkt_max",
                                               "work",
                                               "contact_work",
                                               "stored",
                                               "dissipated",
                                               "thermal",
                                               "energy_defect",
                                               "seconds"};

static void Fill(const HycoStep *s, PetscReal v[N_COLUMNS])
{
  v[TIME] = s->t;
  v[SUBSTEPS] = s->substeps;
  v[CUTS] = s->cuts;
  v[ITERATIONS] = s->iterations;
  v[MOST] = s->most_iterations;
  v[FACTORS] = s->factors;
  v[ACTIVE_ITS] = s->active_set_iterations;
  v[ACTIVE] = s->n_active;
  v[FORCE] = s->total_contact_force;
  v[LAMBDA_MAX] = s->lambda_max;
  v[U_NORM] = s->u_norm2;
  v[MISES] = s->mises;
  v[INELASTIC] = s->inelastic;
  v[RESIDUAL] = s->residual;
  v[KKT] = s->kkt;
  v[WORK] = s->work;
  v[CONTACT_WORK] = s->contact_work;
  v[STORED] = s->stored;
  v[DISSIPATED] = s->dissipated;
  v[THERMAL] = s->thermal;
  v[DEFECT] = s->energy_defect;
  v[SECONDS] = s->seconds;
}

PetscErrorCode DriverSayStep(HycoFOM fom, const HycoStep *s, void *ctx)
{
  DriverPath *path = (DriverPath *)ctx;

  PetscFunctionBegin;
  (void)fom;
  if (!path->checked) PetscCall(DriverCheckLeft()); /* the solvers have read theirs */
  path->checked = PETSC_TRUE;
  PetscCall(
      Say("t %-11.10g %3d of %d: %d step%s, %d iteration%s%s, %d closed, force %.8g, inelastic %.3g, mises %.5g\n",
          (double)s->t, (int)s->index + 1, (int)path->n, (int)s->substeps, s->substeps == 1 ? "" : "s",
          (int)s->iterations, s->iterations == 1 ? "" : "s", s->cuts ? ", cut" : "", (int)s->n_active,
          (double)s->total_contact_force, (double)s->inelastic, (double)s->mises));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteTable(HycoScene scene, const PetscReal mu[], const HycoHistory *h, const char table[])
{
  PetscReal *value, *point;
  PetscInt n_par;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, NULL, NULL));
  PetscCall(PetscMalloc2(h->n * N_COLUMNS, &value, h->n * n_par, &point));
  for (PetscInt k = 0; k < h->n; k++) {
    Fill(&h->step[k], value + k * N_COLUMNS);
    PetscCall(PetscArraycpy(point + k * n_par, mu, n_par));
  }
  PetscCall(DriverWriteTable(table, scene, h->n, point, N_COLUMNS, columns, value));
  PetscCall(PetscFree2(value, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverReportHistory(cJSON *json, const HycoHistory *h)
{
  cJSON *history = cJSON_AddObjectToObject(json, "history"), *array[N_COLUMNS];
  PetscReal v[N_COLUMNS], sum[N_COLUMNS] = {0}, seconds[3] = {0, 0, 0};

  cJSON_AddBoolToObject(history, "ended", h->ended);
  cJSON_AddNumberToObject(history, "t_end", h->t);
  cJSON_AddStringToObject(history, "newton", h->newton);
  cJSON_AddNumberToObject(history, "factor_in_solves", h->factor_cost);
  cJSON_AddNumberToObject(history, "newton_order", h->order);
  cJSON_AddNumberToObject(history, "newton_orders", h->n_orders);
  for (PetscInt c = 0; c < N_COLUMNS; c++) array[c] = cJSON_AddArrayToObject(history, columns[c]);
  for (PetscInt k = 0; k < h->n; k++) {
    Fill(&h->step[k], v);
    for (PetscInt c = 0; c < N_COLUMNS; c++) {
      cJSON_AddItemToArray(array[c], cJSON_CreateNumber(v[c]));
      sum[c] += v[c];
    }
    seconds[0] += h->step[k].seconds_factor;
    seconds[1] += h->step[k].seconds_solve;
    seconds[2] += h->step[k].seconds_law;
  }
  cJSON_AddNumberToObject(history, "seconds_factor", seconds[0]);
  cJSON_AddNumberToObject(history, "seconds_solve", seconds[1]);
  cJSON_AddNumberToObject(history, "seconds_law", seconds[2]);
}

static PetscErrorCode SayEnd(const HycoHistory *h)
{
  PetscInt substeps = 0, iterations = 0, factors = 0, cuts = 0;
  PetscReal residual = 0, defect = 0, seconds[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < h->n; k++) {
    const HycoStep *s = &h->step[k];

    substeps += s->substeps;
    iterations += s->iterations;
    factors += s->factors;
    cuts += s->cuts;
    residual = PetscMax(residual, s->kkt);
    defect = PetscMax(defect, s->energy_defect);
    seconds[0] += s->seconds;
    seconds[1] += s->seconds_factor;
    seconds[2] += s->seconds_solve;
    seconds[3] += s->seconds_law;
  }
  PetscCall(Say("%d steps (%d cut), %d iterations with the %s stiffness, %d factors", (int)substeps, (int)cuts,
                (int)iterations, h->newton, (int)factors));
  if (h->n_orders) PetscCall(Say("; order of convergence %.2f (median of %d)", (double)h->order, (int)h->n_orders));
  PetscCall(Say("\nlargest KKT residual %.1e, energy balance to %.1e\n", (double)residual, (double)defect));
  PetscCall(Say("seconds: %.3f in all, %.3f factors, %.3f solves, %.3f laws\n", (double)seconds[0], (double)seconds[1],
                (double)seconds[2], (double)seconds[3]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverEndHistory(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char table[])
{
  HycoHistory h;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(fom, &h));
  if (h.n && table[0]) PetscCall(WriteTable(scene, mu, &h, table));
  if (h.ended) PetscCall(SayEnd(&h));
  HycoCheck(h.ended || h.n, "no solution: %s; nothing was written", h.why);
  HycoCheck(h.ended,
            "the history ends at t = %.10g, beyond which its steps have become too small: %s; what was reached is "
            "written",
            (double)h.t, h.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}
