/* hyco compare: the columns of its table, and its report. */
#include "driver.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Appends names; the text is kept in the struct, since tables borrow it. */
static PetscErrorCode CompareReportAdd(DriverColumns *c, PetscInt n, const char before[], const char *const names[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++, c->n++) {
    PetscCall(PetscSNPrintf(c->text[c->n], sizeof(c->text[c->n]), "%s%s", before, names[k]));
    c->names[c->n] = c->text[c->n];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order must be that of the enums DRIVER_... in driver.h, by which rows are filled. */
PetscErrorCode DriverCompareColumns(PetscBool paths, PetscInt n_outputs, const char *const outputs[], DriverColumns *c)
{
  static const char *const errors[] = {
      "u", "u_h1", "u_rid", "sigma", "sigma_11", "lambda_rid", "lambda_rid_dual", "lambda", "lambda_dual"};
  static const char *const point[] = {"converged",      "fallback",      "kkt_max",      "covered_force",
                                      "cpu_full_order", "cpu_predicted", "lambda_norm2", "sigma_norm2"};
  static const char *const path[] = {"converged",  "times_reached",  "kkt_max",
                                     "iterations", "cpu_full_order", "cpu_predicted"};
  static const char *const judged[] = {"estimated_error_u",      "estimated_error_sigma",
                                       "estimated_error_lambda", "unseen",
                                       "position_arbitrary",     "stress_covered"};

  PetscFunctionBegin;
  c->paths = paths;
  c->n = 0;
  PetscCall(paths ? CompareReportAdd(c, HYCO_N_ERRORS, "worst_", HycoErrorKinds)
                  : CompareReportAdd(c, DRIVER_LAMBDA_DUAL + 1, "error_", errors));
  if (paths) PetscCall(CompareReportAdd(c, HYCO_N_ERRORS, "end_", HycoErrorKinds));
  c->n_errors = c->n;
  PetscCall(paths ? CompareReportAdd(c, DRIVER_CPU_ROM + 1, "", path)
                  : CompareReportAdd(c, DRIVER_SIGMA_NORM + 1, "", point));
  c->estimates = c->n;
  PetscCall(CompareReportAdd(c, DRIVER_ESTIMATES + 3, "", judged));
  c->outputs = c->n;
  PetscCall(CompareReportAdd(c, n_outputs, paths ? "worst_output_" : "error_output_", outputs));
  if (paths) PetscCall(CompareReportAdd(c, n_outputs, "end_output_", outputs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For qsort(), ascending; NaN is excluded before. */
static int CompareReal(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return (x > y) - (x < y);
}

/* A relative error of a quantity with this norm, for the estimates: norms below a tenth of the set's largest count as
   this tenth. */
static PetscReal CompareReportRelativeError(PetscReal error, PetscReal size, PetscReal largest)
{
  return size > 0 ? error * size / PetscMax(size, 0.1 * largest) : error;
}

/* Guards the errors of stresses and contact forces at points: where they nearly vanish, an error is not divided by
   round-off. The table keeps them as they are. */
static void GuardErrors(const DriverColumns *c, PetscInt n, PetscReal value[])
{
  for (PetscInt j = DRIVER_SIGMA; j < c->n_errors; j++) {
    const PetscInt norm = c->n_errors + (j <= DRIVER_SIGMA_11 ? DRIVER_SIGMA_NORM : DRIVER_LAMBDA_NORM);
    PetscReal largest = 0;

    for (PetscInt k = 0; k < n; k++) largest = PetscMax(largest, value[k * c->n + norm]);
    for (PetscInt k = 0; k < n; k++)
      value[k * c->n + j] = CompareReportRelativeError(value[k * c->n + j], value[k * c->n + norm], largest);
  }
}

/* The errors to which an estimate is compared: of a path at its worst time; of a point guarded. */
static void TrueErrors(const DriverColumns *c, PetscInt kind, PetscInt n, const PetscReal value[], PetscReal error[])
{
  static const PetscInt of_path[] = {HYCO_ERROR_U, HYCO_ERROR_SIGMA, HYCO_ERROR_LAMBDA};
  static const PetscInt of_point[] = {DRIVER_U, DRIVER_SIGMA, DRIVER_LAMBDA};

  for (PetscInt k = 0; k < n; k++) error[k] = value[k * c->n + (c->paths ? of_path : of_point)[kind]];
}

/* The share of the points at which each estimate is at least the error, and the ratios of the two. */
static PetscErrorCode JudgeEstimates(cJSON *json, const DriverColumns *c, PetscInt n, const PetscReal value[])
{
  static const char *const words[] = {"u", "stress", "contact forces"};
  static const char *const keys[] = {"u", "sigma", "lambda"};
  cJSON *all = cJSON_AddObjectToObject(json, "estimates");
  PetscReal *ratio, *error;
  PetscInt unseen = 0, loose = 0;
  PetscReal covered = 1; /* the least share of the cells */

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &ratio, n, &error));
  for (PetscInt e = 0; e < DRIVER_ESTIMATES; e++) {
    PetscInt m = 0, bounded = 0, with = 0; /* points, those whose error is not 0 */
    PetscReal worst = 0;

    TrueErrors(c, e, n, value, error);
    for (PetscInt k = 0; k < n; k++) {
      const PetscReal estimate = value[k * c->n + c->estimates + e];

      /* No estimate, or no defined error: not a point of this statistic. */
      if (isnan(estimate) || !(error[k] <= PETSC_MAX_REAL / 8)) continue;
      bounded += error[k] <= estimate;
      /* Both quotients may have 0 below. */
      worst = PetscMax(worst, error[k] / PetscMax(estimate, PETSC_MIN_REAL));
      m++;
      if (error[k] > 0) ratio[with++] = estimate / error[k];
    }
    if (!m) continue;
    qsort(ratio, (size_t)with, sizeof(*ratio), CompareReal);
    ReportNumbers(cJSON_AddObjectToObject(all, keys[e]), {"bounded", (PetscReal)bounded / m},
                  {"median_ratio", with ? ratio[with / 2] : NAN}, {"worst_error_over_estimate", worst});
    PetscCall(
        DriverPrint("estimates of %s: at least the error at %.1f %% of the points", words[e], 100. * bounded / m));
    if (with)
      PetscCall(DriverPrint("; estimate / error %.3g in the median, error / estimate at most %.3g\n",
                            (double)ratio[with / 2], (double)worst));
    else
      PetscCall(DriverPrint(", where all errors are 0\n"));
  }
  for (PetscInt k = 0; k < n; k++) covered = PetscMin(covered, value[k * c->n + c->estimates + DRIVER_ESTIMATES + 2]);
  cJSON_AddNumberToObject(all, "stress_covered", covered);
  if (covered < 1)
    PetscCall(
        DriverPrint("errors and estimates of stress are of %.3g %% of the cells (rid = 1 in fields); stress in the "
                    "others is interpolated, and not compared\n",
                    100 * (double)covered));
  for (PetscInt k = 0; k < n; k++) loose += value[k * c->n + c->estimates + DRIVER_ESTIMATES + 1] > 0;
  cJSON_AddNumberToObject(all, "position_arbitrary", loose);
  if (loose)
    PetscCall(DriverPrint("at %d of %d contact leaves a motion of a body free: displacements and outputs of them are "
                          "arbitrary there, and "
                          "not compared\n",
                          (int)loose, (int)n));
  for (PetscInt k = 0; k < n; k++) unseen += value[k * c->n + c->estimates + DRIVER_ESTIMATES] > HYCO_UNSEEN;
  cJSON_AddNumberToObject(all, "unseen", unseen);
  if (unseen) PetscCall(DriverPrint("unseen regime at %d of %d points\n", (int)unseen, (int)n));
  PetscCall(PetscFree2(ratio, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Statistics of the rows. */
typedef struct {
  PetscReal cpu[2], kkt, covered[2]; /* means of full order and predicted; mean and least */
  PetscInt undefined, failed, fallback;
} Totals;

static void CompareReportSum(const DriverColumns *c, PetscInt n, const PetscReal value[], Totals *t)
{
  /* The least covered force begins at all of it. */
  *t = (Totals){.covered = {0, 1}};
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + k * c->n + c->n_errors;

    t->cpu[0] += v[DRIVER_CPU_FOM] / n;
    t->cpu[1] += v[DRIVER_CPU_ROM] / n;
    t->kkt = PetscMax(t->kkt, v[DRIVER_KKT]);
    t->failed += v[DRIVER_CONVERGED] < 0.5;
    if (c->paths) continue;
    t->fallback += v[DRIVER_FALLBACK] > 0.5;
    t->covered[0] += v[DRIVER_COVERED] / n;
    t->covered[1] = PetscMin(t->covered[1], v[DRIVER_COVERED]);
  }
}

/* A share of all says nothing, also of a model without an RID. */
static PetscErrorCode ReportPoints(cJSON *json, PetscBool contact, const Totals *t)
{
  PetscFunctionBegin;
  if (contact)
    ReportNumbers(cJSON_AddObjectToObject(json, "covered_force"), {"mean", t->covered[0]}, {"min", t->covered[1]});
  if (contact && t->covered[1] < 1)
    PetscCall(DriverPrint("contact force in the RID: mean %.1f %%, least %.1f %%\n", 100 * (double)t->covered[0],
                          100 * (double)t->covered[1]));
  ReportNumbers(json, {"undefined", t->undefined}, {"not_converged", t->failed}, {"fallback", t->fallback},
                {"kkt_max", t->kkt});
  PetscCall(
      DriverPrint("%d not converged, %d by the fallback solver, %d errors undefined (x/0); largest KKT residual %.1e\n",
                  (int)t->failed, (int)t->fallback, (int)t->undefined, (double)t->kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReportPaths(cJSON *json, const Totals *t)
{
  PetscFunctionBegin;
  ReportNumbers(json, {"undefined", t->undefined}, {"not_converged", t->failed}, {"kkt_max", t->kkt});
  PetscCall(DriverPrint("%d did not reach their end; largest KKT residual %.1e\n", (int)t->failed, (double)t->kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Guards a copy: the table has been written with the errors as they are. A prediction that failed makes the
   command fail, after its report. */
PetscErrorCode DriverReportComparison(HycoScene scene, PetscBool contact, PetscReal training, const DriverColumns *c,
                                      PetscInt n, const PetscReal given[])
{
  const PetscInt converged = c->n_errors + DRIVER_CONVERGED;
  PetscReal *value;
  Totals t;
  cJSON *json;

  PetscFunctionBegin;
  HycoDuplicate(n * c->n, given, &value);
  if (!c->paths) GuardErrors(c, n, value);
  CompareReportSum(c, n, value, &t);
  PetscCall(ReportCreate("compare", scene, NULL, &json));
  cJSON_AddNumberToObject(json, "n_points", n);
  PetscCall(DriverPrint("%d %s%s%s\n", (int)n, c->paths ? "path" : "point", n == 1 ? "" : "s",
                        c->paths ? ", each at its worst listed time and at its end" : ""));
  for (PetscInt k = 0; k < c->n_errors; k++) {
    /* Errors of forces mean nothing without contact. */
    if (contact || !strstr(c->names[k], "lambda"))
      ReportError(json, c->names[k], n, c->n, value, k, converged, &t.undefined);
  }
  for (PetscInt k = c->outputs; k < c->n; k++) ReportOutputError(json, c->names[k], n, c->n, value, k, converged);
  PetscCall(JudgeEstimates(json, c, n, value));
  PetscCall(DriverReportGain(json, c->paths ? "path" : "point", t.cpu[0], t.cpu[1], training));
  PetscCall(c->paths ? ReportPaths(json, &t) : ReportPoints(json, contact, &t));
  PetscCall(ReportWrite(&json));
  PetscCall(PetscFree(value));
  /* After the report is written, so that its numbers can be looked at. */
  HycoCheck(!t.failed, "%d of the %d %s; the errors do not include them", (int)t.failed, (int)n,
            c->paths ? "reduced paths did not reach their end" : "predictions did not converge");
  PetscFunctionReturn(PETSC_SUCCESS);
}
