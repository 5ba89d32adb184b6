/* hyco solve on a scene with a history: its output during and after the solve, the report. */
#include "driver.h"

#define ADVISED 50 /* steps from which a path is long enough for advice */

/* A HycoStepMonitor: after the first listed time all solvers have read their options. */
PetscErrorCode DriverMonitorStep(HycoFOM fom, const HycoStep *s, void *ctx)
{
  DriverPath *path = (DriverPath *)ctx;

  PetscFunctionBegin;
  (void)fom;
  PetscCall(DriverPrintStep(s, path->n, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The observed order of Newton's method is in the report because a wrong tangent still converges, only more
   slowly: 2 is the evidence for a consistent one. */
PetscErrorCode DriverReportHistory(cJSON *json, HycoScene scene, const HycoHistory *h)
{
  cJSON *history = cJSON_AddObjectToObject(json, "history");
  PetscReal seconds[3] = {0, 0, 0};

  PetscFunctionBegin;
  cJSON_AddBoolToObject(history, "ended", h->ended);
  cJSON_AddNumberToObject(history, "t_end", h->t);
  cJSON_AddStringToObject(history, "newton", h->newton);
  ReportNumbers(history, {"factor_in_solves", h->factor_cost}, {"newton_order", h->order},
                {"newton_orders", h->n_orders}, {"steps_limited", h->n_bound}, {"time_error", h->time_error});
  PetscCall(DriverReportSteps(history, scene, PETSC_FALSE, h->n, h->step));
  /* Sums over the steps, of which the table has each. */
  for (PetscInt k = 0; k < h->n; k++) {
    seconds[0] += h->step[k].seconds_factor;
    seconds[1] += h->step[k].seconds_solve;
    seconds[2] += h->step[k].seconds_law;
  }
  ReportNumbers(history, {"seconds_factor", seconds[0]}, {"seconds_solve", seconds[1]}, {"seconds_law", seconds[2]});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of counts and seconds, maxima of residuals and defects: one bad step must not vanish in a mean. */
static PetscErrorCode PrintEnd(const HycoHistory *h)
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
  PetscCall(DriverPrint("%d steps (%d halved), %d iterations with the %s stiffness, %d factors", (int)substeps,
                        (int)cuts, (int)iterations, h->newton, (int)factors));
  if (h->n_orders)
    PetscCall(DriverPrint("; order of convergence %.2f (median of %d)", (double)h->order, (int)h->n_orders));
  /* Most steps were limited by accuracy, not by convergence: the user may trade one for the other. */
  if (2 * h->n_bound > substeps && substeps >= ADVISED)
    PetscCall(
        DriverPrint("\n%d steps could be longer without -hyco_step_inelastic (1e-3 if not given): a larger one is "
                    "faster, with a larger error in time; compare the results",
                    (int)h->n_bound));
  PetscCall(DriverPrint("\n"));
  PetscCall(DriverWarnSteps(h->time_error));
  PetscCall(DriverPrint("largest KKT residual %.1e, energy balance to %.1e\n", (double)residual, (double)defect));
  PetscCall(DriverPrint("seconds: %.3f in all, %.3f factors, %.3f solves, %.3f laws\n", (double)seconds[0],
                        (double)seconds[1], (double)seconds[2], (double)seconds[3]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of what was reached is written before the failure is reported. */
PetscErrorCode DriverEndHistory(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char table[])
{
  HycoHistory h;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(fom, &h));
  PetscCall(DriverWriteSteps(table, scene, mu, PETSC_FALSE, h.n, h.step));
  if (h.ended) PetscCall(PrintEnd(&h));
  HycoCheck(h.ended || h.n, "no solution: %s; nothing was written", h.why);
  HycoCheck(h.ended, "the history ends at t = %.10g: %s; the results up to this time are written", (double)h.t, h.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}
