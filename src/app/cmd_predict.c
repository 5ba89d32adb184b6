/* hyco predict: the reduced model at one point, or over a set. */
#include "driver.h"
#include <hycoqueue.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define PIECES                                                                                                         \
  16                   /* number of pieces of a set for each rank: expensive points delay the end by at most one
                          piece */
#define LEAST_PIECE 64 /* number of points in a piece, unless a rank has fewer */

/* Negative: there is none, null in JSON. */
static void PredictCommandEstimate(cJSON *json, const char name[], PetscReal estimate)
{
  if (estimate >= 0)
    cJSON_AddNumberToObject(json, name, estimate);
  else
    cJSON_AddNullToObject(json, name);
}

/* Reports the estimated errors (null: none), and the distance from the region of training. */
static PetscErrorCode ReportEstimates(cJSON *json, HycoScene scene, const HycoPrediction *p)
{
  const char *names[HYCO_MAX_QUANTITIES];
  cJSON *outputs;
  PetscInt n;

  PetscFunctionBegin;
  PredictCommandEstimate(json, "estimated_error_u", p->estimated_error_u);
  PredictCommandEstimate(json, "estimated_error_sigma", p->estimated_error_sigma);
  PredictCommandEstimate(json, "estimated_error_lambda", p->estimated_error_lambda);
  PetscCall(HycoSceneGetQuantities(scene, &n, names));
  outputs = n ? cJSON_AddObjectToObject(json, "estimated_error_outputs") : NULL;
  for (PetscInt q = 0; q < n; q++) PredictCommandEstimate(outputs, names[q], p->estimated_error_quantity[q]);
  PredictCommandEstimate(json, "inconsistency", p->inconsistency);
  PredictCommandEstimate(json, "balance", p->balance);
  cJSON_AddNumberToObject(json, "unseen", p->unseen);
  /* The feature matters only where it is out of the range of the training. */
  if (p->unseen > HYCO_UNSEEN) cJSON_AddStringToObject(json, "unseen_feature", HycoFeatureNames[p->unseen_feature]);
  cJSON_AddBoolToObject(json, "extrapolated", p->beyond > 0);
  cJSON_AddNumberToObject(json, "beyond", p->beyond);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "estimated errors of the outputs: peak 0.012, tip none": absolute, in the units of the outputs. */
static PetscErrorCode PrintOutputEstimates(HycoScene scene, const HycoPrediction *p)
{
  const char *names[HYCO_MAX_QUANTITIES];
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(scene, &n, names));
  for (PetscInt q = 0; q < n; q++) {
    PetscCall(DriverPrint("%s%s ", q ? ", " : "estimated errors of the outputs: ", names[q]));
    /* Below 0: the model does not estimate this one. */
    if (p->estimated_error_quantity[q] >= 0)
      PetscCall(DriverPrint("%.3g", (double)p->estimated_error_quantity[q]));
    else
      PetscCall(DriverPrint("none"));
  }
  if (n) PetscCall(DriverPrint("\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* path: NULL without a history. */
static PetscErrorCode PrintEstimates(HycoScene scene, const HycoPrediction *p, const DriverReducedPath *path)
{
  const PetscReal estimate[3] = {p->estimated_error_u, p->estimated_error_sigma, p->estimated_error_lambda};
  char words[3][32], rid[DRIVER_LINE] = "";

  PetscFunctionBegin;
  PetscCall(DriverPrintDependent(p->n_dependent, path ? path->n : 0, path ? path->step : NULL));
  if (p->loose)
    PetscCall(DriverPrint("warning: no contact force keeps %s: its position is arbitrary\n",
                          p->free_motion[0] ? p->free_motion : "a body in its place"));
  for (PetscInt k = 0; k < 3; k++) {
    if (estimate[k] >= 0)
      DriverPercent(estimate[k], words[k]);
    else
      snprintf(words[k], sizeof(words[k]), "none");
  }
  PetscCall(DriverPrintBalance(p->balance));
  if (p->rid_fraction < 1)
    snprintf(rid, sizeof(rid), " (on %d of %.0f cells, rid = 1 in fields; no estimate covers the others)",
             (int)p->rid_elements, rint((double)(p->rid_elements / p->rid_fraction)));
  PetscCall(DriverPrint("estimated errors: u %s, stress %s%s, contact forces %s\n", words[0], words[1], rid, words[2]));
  PetscCall(PrintOutputEstimates(scene, p));
  DriverPercent(p->beyond, words[0]);
  if (p->beyond > 0)
    PetscCall(DriverPrint("EXTRAPOLATED: outside the region of training by %s of a range\n", words[0]));
  if (p->unseen > HYCO_UNSEEN)
    PetscCall(DriverPrint(
        "UNSEEN REGIME: the %s is %.3g times the largest at the held-out points; the estimates are multiplied "
        "by it (up to 100) or missing, and are not tested\n",
        HycoFeatureNames[p->unseen_feature], (double)p->unseen));
  /* A miss rather than an error: forces may be right although the displacements are not. */
  if (p->inconsistent)
    PetscCall(
        DriverMissed("the displacements do not follow the contact forces: at closed contacts they miss the gaps by "
                     "%.2g of the largest displacement there; add training points, or use -hyco_fallback%s",
                     (double)p->inconsistency, p->gives_forces ? " or -hyco_full_displacement" : ""));
  if (p->unbalanced)
    PetscCall(
        DriverMissed("contact forces, loads and supports do not balance: they miss %.2g of the forces and moments "
                     "on a body, more than the estimated error; add training points, or use -hyco_fallback",
                     (double)p->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not reported with full order, which has no RID. */
static void ReportRID(cJSON *json, const HycoPrediction *p)
{
  ReportNumbers(json, {"rid_nodes", p->rid_nodes}, {"rid_elements", p->rid_elements}, {"rid_fraction", p->rid_fraction},
                {"rid_contacts", p->n_contacts}, {"rid_active", p->n_rid_active});
}

/* carried: results of the contacts (n_carried; 0: not known). fallback: the reason for full order; "": not used.
   whole: u is that of the whole mesh. path: NULL, or with a history. gradient: NULL, or that of the prediction. */
static PetscErrorCode PredictCommandReport(HycoScene scene, const PetscReal mu[], const HycoPrediction *p,
                                           PetscInt n_carried, const HycoContactResult carried[], PetscReal energy,
                                           const char fallback[], PetscBool whole, const DriverReducedPath *path,
                                           const HycoGradient *gradient)
{
  cJSON *json;

  PetscFunctionBegin;
  PetscCall(ReportCreate("predict", scene, mu, &json));
  cJSON_AddStringToObject(json, "model_type", p->type);
  ReportNumbers(json, {"n_dof", p->n_dof}, {"n_multipliers", p->n_multipliers});
  cJSON_AddNumberToObject(json, "n_contacts", p->n_all_contacts); /* counted as in hyco solve */
  ReportNumbers(json, {"n_active", p->n_active}, {"active_set_iterations", p->iterations});
  cJSON_AddStringToObject(json, "solver", p->method);
  cJSON_AddBoolToObject(json, "converged", p->reason > 0);
  if (p->n_dependent >= 0) cJSON_AddBoolToObject(json, "forces_unique", p->n_dependent == 0);
  cJSON_AddBoolToObject(json, "position_arbitrary", p->loose);
  cJSON_AddStringToObject(json, "loose", p->free_motion);
  ReportNumbers(json, {"n_modes", p->n_modes}, {"n_fe_dofs", p->n_fe_dofs});
  /* Full order has no RID: a report of one would be that of the prediction it replaces. */
  if (!fallback[0]) ReportRID(json, p);
  ReportNumbers(json, {"covered_force", p->covered_force}, {"total_contact_force", p->total_contact_force},
                {"lambda_max", p->lambda_max}, {"lambda_norm2", p->lambda_norm2},
                {whole ? "u_norm2" : "rid_u_norm2", p->u_norm2});
  ReportVector(json, whole ? "u_min" : "rid_u_min", p->dim, p->u_min);
  ReportVector(json, whole ? "u_max" : "rid_u_max", p->dim, p->u_max);
  /* Different keys: a part's energy must not be taken for that of the whole. */
  cJSON_AddNumberToObject(json, whole ? "strain_energy" : "rid_strain_energy", energy);
  PetscCall(ReportContacts(json, p->n_contacts, p->n_facing, p->overlap, p->sliding));
  if (n_carried) PetscCall(DriverReportCarried(json, p->dim, n_carried, carried));
  PetscCall(ReportQuantities(json, scene, p->quantity));
  if (gradient) PetscCall(DriverReportGradient(json, scene, gradient));
  PetscCall(ReportEstimates(json, scene, p));
  cJSON_AddBoolToObject(json, "full_order", fallback[0] != '\0');
  if (fallback[0]) cJSON_AddStringToObject(json, "fallback", fallback);
  if (p->gives_forces) {
    PredictCommandEstimate(json, "interpolation_error", p->interpolation_error);
    cJSON_AddBoolToObject(json, "full_displacement", whole && !fallback[0]);
  }
  ReportKKT(json, &p->kkt);
  ReportSeconds(json, &p->seconds);
  if (path) PetscCall(DriverReportReducedPath(json, scene, path));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The words depend on what the type's numbers say, not on its name. */
static PetscErrorCode PrintReduced(const HycoPrediction *p)
{
  PetscFunctionBegin;
  if (p->gives_forces)
    PetscCall(DriverPrint("%s: %d contacts, %d modes\n", p->title, (int)p->n_contacts, (int)p->n_modes));
  else if (p->rid_fraction < 1 && p->n_multipliers != p->n_contacts && !p->n_fe_dofs)
    PetscCall(DriverPrint("%s: %d modes, %d force vectors for %d contacts; %d elements (%.1f %%)\n", p->title,
                          (int)p->n_modes, (int)p->n_multipliers, (int)p->n_contacts, (int)p->rid_elements,
                          100 * (double)p->rid_fraction));
  else if (p->n_fe_dofs || p->rid_fraction < 1)
    PetscCall(DriverPrint("%d modes, %d full-order displacements, %d contacts on an RID of %d elements (%.1f %%)\n",
                          (int)p->n_modes, (int)p->n_fe_dofs, (int)p->n_contacts, (int)p->rid_elements,
                          100 * (double)p->rid_fraction));
  else
    PetscCall(DriverPrint("%s: %d modes, %d force vectors for %d contacts; the whole mesh, %d elements\n", p->title,
                          (int)p->n_modes, (int)p->n_multipliers, (int)p->n_contacts, (int)p->rid_elements));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One path: writes what it reached, and fails if that is not its end. */
static PetscErrorCode PredictCommandPath(HycoROM model, HycoScene scene, const char output[], PetscBool derives)
{
  DriverReducedPath path = {0};
  HycoPrediction p = {0};
  HycoGradient gradient = {0};
  HycoContactResult *carried;
  PetscInt n, n_carried;
  PetscReal mu[64], energy = 0;
  char table[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(DriverGetPoint(scene, NULL, mu));
  PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, table));
  /* A path's steps depend on each other: one rank computes it. */
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMPredict(model, n, mu));
  PetscCall(DriverCheckLeftEarly());
  PetscCall(DriverGetReducedPath(model, &path));
  /* Not even one step: there is nothing to write. */
  HycoCheck(path.n, "no prediction: %s; nothing was written", path.why);
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetPrediction(model, &p));
  PetscCallMPI(MPI_Bcast(&p, sizeof(p), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(PrintReduced(&p));
  PetscCall(DriverPrintReducedPath(scene, mu, &path, table));
  if (output[0]) HycoOnRoot(PETSC_COMM_WORLD, HycoROMWrite(model, output));
  PetscCall(DriverPrint(
      "%d iterations; KKT residuals: stationarity %.1e, penetration %.1e, adhesion %.1e, complementarity %.1e\n",
      (int)p.iterations, (double)p.kkt.stationarity, (double)p.kkt.penetration, (double)p.kkt.adhesion,
      (double)p.kkt.complementarity));
  PetscCall(PrintEstimates(scene, &p, &path));
  PetscCall(DriverPrintEquilibrium(&path));
  PetscCall(DriverPrint("seconds: %.6f set-up, %.6f prediction\n", (double)p.seconds.setup, (double)p.seconds.total));
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetStrainEnergy(model, &energy));
  PetscCall(DriverGetCarried(model, scene, &n_carried, &carried));
  /* A path that ended early has none, and is an error below. */
  derives = (PetscBool)(derives && p.reason > 0);
  if (derives) HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetGradient(model, &gradient));
  PetscCall(PredictCommandReport(scene, mu, &p, n_carried, carried, energy, "", PETSC_FALSE, &path,
                                 derives ? &gradient : NULL));
  PetscCall(PetscFree(carried));
  PetscCall(PetscFree(path.step));
  HycoCheck(p.reason != HYCO_DIVERGED_STEP,
            "the history ends at t = %.10g: %s; the results up to this time are written", (double)path.t, path.why);
  HycoCheck(p.reason > 0, "%s; the results up to this time are written", HycoReasonName(p.reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of a set's table. */
enum {
  FORCE,
  LAMBDA_MAX,
  COVERED,
  ACTIVE,
  U_NORM,
  KKT,
  CONVERGED,
  ITERATIONS,
  SECONDS,
  ESTIMATE_U,
  ESTIMATE_SIGMA,
  ESTIMATE_LAMBDA,
  BEYOND,
  UNSEEN,
  INCONSISTENCY,
  BALANCE,
  FORCES_UNIQUE,
  FULL_ORDER,
  PATH_FORCE, /* only for paths */
  PATH_MISES,
  PATH_INELASTIC,
  RESIDUAL, /* if requested */
  CONTACT_RESIDUAL,
  N_COLUMNS
};
static const char *const columns[N_COLUMNS] = {"total_contact_force",
                                               "lambda_max",
                                               "covered_force",
                                               "n_active",
                                               "rid_u_norm2",
                                               "kkt_max",
                                               "converged",
                                               "active_set_iterations",
                                               "seconds",
                                               "estimated_error_u",
                                               "estimated_error_sigma",
                                               "estimated_error_lambda",
                                               "beyond",
                                               "unseen",
                                               "inconsistency",
                                               "balance",
                                               "forces_unique",
                                               "full_order",
                                               "largest_contact_force",
                                               "largest_rid_mises",
                                               "largest_rid_inelastic",
                                               "equilibrium_residual",
                                               "contact_residual"};

/* Numbers of columns: own: without the scene's quantities, more for paths; with them; for paths with their extremes
   too; with the estimates of their errors; with the results of contacts; width: with gradients. */
typedef struct {
  PetscInt own, with_quantities, with_extremes, with_estimates, with_carried, width;
  char path_name[HYCO_MAX_QUANTITIES][DRIVER_LINE], estimate_name[HYCO_MAX_QUANTITIES][DRIVER_LINE];
  DriverCarried carried;
  DriverGradients gradients;
  const char **names;
} Shape;

/* The caller frees the names, by DestroyShape(). Groups of columns follow each other; each number is the end of a
   group and the begin of the next. */
static PetscErrorCode ShapeOf(HycoROM model, HycoScene scene, Shape *s)
{
  PetscInt n_times, dim;
  PetscBool residual;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  PetscCall(HycoROMWantsEquilibrium(model, &residual));
  PetscCall(HycoROMGetSizes(model, NULL, NULL, &dim));
  PetscCall(DriverCarriedColumns(scene, dim, &s->carried));
  PetscCall(DriverGradientColumns(scene, &s->gradients));
  PetscCall(PetscMalloc1(N_COLUMNS + 3 * HYCO_MAX_QUANTITIES + s->carried.n_contacts * s->carried.each + s->gradients.n,
                         &s->names));
  /* Columns of paths are last among the own ones, so that a point's table ends before them. */
  s->own = n_times ? (residual ? N_COLUMNS : RESIDUAL) : PATH_FORCE;
  PetscCall(ReportColumns(scene, s->own, columns, &s->with_quantities, s->names));
  s->with_extremes = s->with_quantities;
  /* An output's extreme along the path beside its value at the end. */
  if (n_times) PetscCall(ReportExtremes(s->own, s->names, &s->with_extremes, s->path_name));
  s->with_estimates = s->with_extremes;
  for (PetscInt c = s->own; c < s->with_quantities; c++) {
    char *name = s->estimate_name[c - s->own];

    PetscCall(PetscSNPrintf(name, DRIVER_LINE, "estimated_error_output_%s", s->names[c]));
    s->names[s->with_estimates++] = name;
  }
  s->width = s->with_estimates;
  for (PetscInt c = 0; c < s->carried.n_contacts * s->carried.each; c++) s->names[s->width++] = s->carried.name[c];
  s->with_carried = s->width;
  for (PetscInt c = 0; c < s->gradients.n; c++) s->names[s->width++] = s->gradients.name[c];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyShape(Shape *s)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(s->carried.name));
  PetscCall(PetscFree(s->gradients.name));
  PetscCall(PetscFree(s->names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN: how a table marks that there is no estimate. */
static PetscReal PredictCommandValueOrNaN(PetscReal estimate)
{
  return estimate >= 0 ? estimate : NAN;
}

/* p's arrays follow the scene's order of quantities, as the columns do. */
static void FillRow(const HycoPrediction *p, PetscInt n_carried, const HycoContactResult carried[], const Shape *s,
                    PetscReal v[])
{
  v[FORCE] = p->total_contact_force;
  v[LAMBDA_MAX] = p->lambda_max;
  v[COVERED] = p->covered_force;
  v[ACTIVE] = p->n_active;
  v[U_NORM] = p->u_norm2;
  v[KKT] = HycoKKTMax(&p->kkt);
  v[CONVERGED] = p->reason > 0;
  v[ITERATIONS] = p->iterations;
  v[SECONDS] = p->seconds.total;
  /* PredictCommandValueOrNaN() makes not a number of what the model does not know. */
  v[ESTIMATE_U] = PredictCommandValueOrNaN(p->estimated_error_u);
  v[ESTIMATE_SIGMA] = PredictCommandValueOrNaN(p->estimated_error_sigma);
  v[ESTIMATE_LAMBDA] = PredictCommandValueOrNaN(p->estimated_error_lambda);
  v[BEYOND] = p->beyond;
  v[UNSEEN] = p->unseen;
  v[INCONSISTENCY] = PredictCommandValueOrNaN(p->inconsistency);
  v[BALANCE] = PredictCommandValueOrNaN(p->balance);
  v[FORCES_UNIQUE] = p->n_dependent < 0 ? NAN : p->n_dependent == 0;
  if (s->own > PATH_FORCE) {
    v[PATH_FORCE] = p->path_force;
    v[PATH_MISES] = p->path_mises;
    v[PATH_INELASTIC] = p->path_inelastic;
  }
  if (s->own > RESIDUAL) {
    v[RESIDUAL] = p->residual;
    v[CONTACT_RESIDUAL] = p->contact_residual;
  }
  for (PetscInt k = s->own; k < s->with_quantities; k++) v[k] = p->quantity[k - s->own];
  for (PetscInt k = s->with_quantities; k < s->with_extremes; k++) v[k] = p->path_quantity[k - s->with_quantities];
  for (PetscInt k = s->with_extremes; k < s->with_estimates; k++)
    v[k] = PredictCommandValueOrNaN(p->estimated_error_quantity[k - s->with_extremes]);
  DriverCarriedFill(&s->carried, n_carried, carried, v + s->with_estimates);
  /* A point that failed has no results, and its row stays. */
  for (PetscInt c = 0; c < s->with_carried && p->reason <= 0; c++) {
    const PetscBool known = (PetscBool)((c >= KKT && c <= SECONDS) || c == BEYOND || c == UNSEEN || c == FULL_ORDER);

    if (!known) v[c] = NAN;
  }
}

/* The table of a single point: a set's, with one row. whole: u is that of the whole mesh. gradient: NULL, or that of
   the prediction, which rank 0 has. */
static PetscErrorCode WriteRow(HycoROM model, HycoScene scene, const PetscReal mu[], const HycoPrediction *p,
                               PetscInt n_carried, const HycoContactResult carried[], PetscBool full_order,
                               PetscBool whole, const HycoGradient *gradient, const char table[])
{
  Shape s = {.gradients = {.on = (PetscBool)(gradient != NULL)}};
  PetscReal *v;
  DriverPiece all;
  DriverRows rows;

  PetscFunctionBegin;
  PetscCall(ShapeOf(model, scene, &s));
  PetscCall(PetscMalloc1(s.width, &v));
  FillRow(p, n_carried, carried, &s, v);
  v[FULL_ORDER] = full_order;
  if (whole) v[U_NORM] = NAN; /* not that of an RID */
  if (gradient && !HycoRank(PETSC_COMM_WORLD)) DriverGradientFill(&s.gradients, gradient, v + s.with_carried);
  rows = DriverRowsOfRoot(1, s.width, v, &all);
  PetscCall(DriverWriteTable(table, scene, mu, s.names, &rows));
  PetscCall(PetscFree(v));
  PetscCall(DestroyShape(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One point: rank 0 predicts while the others wait; all solve full order if the fallback requires it, or with its
   forces. */
static PetscErrorCode PredictCommandPoint(HycoROM model, HycoScene scene, Fallback *fallback, const char output[],
                                          PetscBool derives)
{
  HycoPrediction p = {0};
  HycoGradient gradient = {0};
  HycoContactResult *own;
  const HycoContactResult *carried;
  PetscInt n, n_carried;
  PetscReal mu[64], energy = 0;
  char why[DRIVER_LINE], covered[64] = "", table[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(DriverGetPoint(scene, NULL, mu));
  PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, table));
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMPredict(model, n, mu));
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetPrediction(model, &p));
  PetscCallMPI(MPI_Bcast(&p, sizeof(p), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(DriverCheckLeftEarly());
  DriverWantsFullOrder(fallback, &p, why);
  if (why[0]) {
    PetscCall(DriverSolveFullOrder(fallback, n, mu, &p));
    PetscCall(DriverPrint("FULL ORDER instead of the reduced model: %s\n", why));
  } else {
    PetscCall(PrintReduced(&p));
    if (fallback->displacement) {
      PetscCall(DriverSolveDisplacement(fallback, model, n, mu, &p));
      PetscCall(DriverPrint(
          "one full-order solve with these forces: displacements of the whole mesh, residuals of full order\n"));
    }
  }
  HycoCheck(p.reason > 0, "%s (KKT residuals: %.1e, %.1e, %.1e, %.1e); nothing was written",
            p.why[0] ? p.why : HycoReasonName(p.reason), (double)p.kkt.stationarity, (double)p.kkt.penetration,
            (double)p.kkt.adhesion, (double)p.kkt.complementarity);
  /* After the check of convergence, which a gradient requires. */
  if (derives) HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetGradient(model, &gradient));
  if (output[0] && (why[0] || fallback->displacement))
    PetscCall(HycoFOMWrite(fallback->fom, output));
  else if (output[0])
    HycoOnRoot(PETSC_COMM_WORLD, HycoROMWrite(model, output));
  if (!why[0] && p.n_contacts < p.n_all_contacts)
    snprintf(covered, sizeof(covered), " (%.1f %% of it in the RID)", 100 * (double)p.covered_force);
  PetscCall(DriverPrint("total contact force %.10g%s, %d of %d contacts active; %s after %d iterations\n",
                        (double)p.total_contact_force, covered, (int)p.n_active, (int)p.n_all_contacts,
                        HycoReasonName(p.reason), (int)p.iterations));
  PetscCall(DriverPrint("KKT residuals: stationarity %.1e, penetration %.1e, adhesion %.1e, complementarity %.1e\n",
                        (double)p.kkt.stationarity, (double)p.kkt.penetration, (double)p.kkt.adhesion,
                        (double)p.kkt.complementarity));
  if (!why[0]) PetscCall(PrintEstimates(scene, &p, NULL));
  PetscCall(DriverPrint("seconds: %.6f set-up, %.6f prediction\n", (double)p.seconds.setup, (double)p.seconds.total));
  if (why[0] || fallback->displacement)
    energy = fallback->strain_energy;
  else
    HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetStrainEnergy(model, &energy));
  PetscCall(DriverGetCarried(model, scene, &n_carried, &own));
  carried = own;
  if (why[0]) PetscCall(HycoFOMGetContacts(fallback->fom, &n_carried, &carried));
  if (table[0])
    PetscCall(WriteRow(model, scene, mu, &p, n_carried, carried, (PetscBool)(why[0] != '\0'),
                       (PetscBool)(why[0] || fallback->displacement), derives ? &gradient : NULL, table));
  PetscCall(PredictCommandReport(scene, mu, &p, n_carried, carried, energy, why,
                                 (PetscBool)(why[0] || fallback->displacement), NULL, derives ? &gradient : NULL));
  PetscCall(PetscFree(own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data for the rows of a piece. */
typedef struct {
  const Fallback *fallback;
  const Shape *shape;
  HycoQueue queue;
  PetscReal *value; /* of the piece */
  PetscInt n_unseen, n_inconsistent, n_unbalanced;
  DriverLacking *lacking;
} Taken;

/* A HycoPointMonitor: called after each point of a batch, whatever the order of the batch. It serves the queue, so
   that other ranks do not wait for this one. */
static PetscErrorCode TakePoint(HycoROM model, PetscInt k, void *ctx)
{
  Taken *t = (Taken *)ctx;
  PetscReal *v = t->value + (size_t)k * (size_t)t->shape->width;
  const HycoContactResult *carried;
  HycoPrediction p;
  HycoGradient gradient;
  PetscInt n;
  char why[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoQueueServe(t->queue));
  PetscCall(HycoROMGetPrediction(model, &p));
  PetscCall(HycoROMGetContacts(model, &n, &carried));
  FillRow(&p, n, carried, t->shape, v);
  /* Gradients of points that did not converge. */
  for (PetscInt c = t->shape->with_carried; c < t->shape->width; c++) v[c] = NAN;
  if (t->shape->gradients.on && p.reason > 0) {
    PetscErrorCode caught;

    PetscCall(HycoCatchBegin());
    caught = HycoROMGetGradient(model, &gradient);
    PetscCall(DriverGradientCatch(&t->shape->gradients, &gradient, caught, t->lacking, v + t->shape->with_carried));
  }
  DriverWantsFullOrder(t->fallback, &p, why);
  v[FULL_ORDER] = why[0] != '\0'; /* required; SolveRemaining() solves it */
  t->n_unseen += !why[0] && p.unseen > HYCO_UNSEEN;
  t->n_inconsistent += !why[0] && p.inconsistent;
  t->n_unbalanced += !why[0] && p.unbalanced;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of points in a piece. In grids, consecutive points have one stiffness and share its factor within a piece; a
   path can be a piece of its own. */
static PetscInt PieceSize(PetscInt n, PetscInt size, PetscBool paths)
{
  const PetscInt share = (n + size - 1) / size, least = paths ? 1 : LEAST_PIECE;

  return size == 1 ? PetscMax(1, n) : PetscMax((share + PIECES - 1) / PIECES, PetscMin(least, share));
}

/* Predicts the pieces that this rank takes from the queue. A rank that takes no piece sets up all the same, so that
   every rank reads the same options. */
static PetscErrorCode PredictQueued(HycoROM model, PetscInt each, PetscInt n_par, const PetscReal mu[], Taken *t,
                                    DriverRows *rows)
{
  PetscInt piece;

  PetscFunctionBegin;
  PetscCall(HycoROMSolveMany(model, 0, n_par, mu, NULL, NULL, NULL)); /* sets up, also if no piece is left */
  PetscCall(HycoROMSetPointMonitor(model, TakePoint, t));
  for (;;) {
    PetscInt first, n;

    PetscCall(HycoQueueTake(t->queue, &piece));
    if (piece < 0) break;
    first = piece * each;
    /* The last piece may be shorter. */
    n = PetscMin(each, rows->n - first);
    PetscCall(DriverRowsAdd(rows, first, n, &t->value));
    PetscCall(HycoROMSolveMany(model, n, n_par, mu + first * n_par, NULL, NULL, NULL));
  }
  /* The monitor's context is on the caller's stack. */
  PetscCall(HycoROMSetPointMonitor(model, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports the points of all ranks at which the model's estimates or displacements are in doubt. */
static PetscErrorCode PrintDoubts(PetscInt n, const Taken *t)
{
  PetscInt count[3] = {t->n_unseen, t->n_inconsistent, t->n_unbalanced};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  if (count[0])
    PetscCall(DriverPrint(
        "UNSEEN REGIME at %d of %d points: column unseen is above %d, and the estimates are not tested there\n",
        (int)count[0], (int)n, HYCO_UNSEEN));
  if (count[1])
    PetscCall(DriverMissed("the displacements do not follow the contact forces at %d of %d points (column "
                           "inconsistency); add training points, or use -hyco_fallback",
                           (int)count[1], (int)n));
  if (count[2])
    PetscCall(DriverMissed("contact forces, loads and supports do not balance at %d of %d points (column balance); add "
                           "training points, or use -hyco_fallback",
                           (int)count[2], (int)n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicts all points; each rank keeps the rows of those that it took. HycoQueueEnd() is called with errors too:
   other ranks would wait for this one's answers. */
static PetscErrorCode PredictAll(HycoROM model, const Fallback *fallback, PetscInt n_par, const PetscReal mu[],
                                 const Shape *s, DriverRows *rows)
{
  Taken taken = {.fallback = fallback, .shape = s, .lacking = &rows->lacking};
  PetscInt each;

  PetscFunctionBegin;
  each = PieceSize(rows->n, HycoSize(PETSC_COMM_WORLD), (PetscBool)(s->own > PATH_FORCE));
  PetscCall(
      HycoQueueCreate(PETSC_COMM_WORLD, HycoSize(PETSC_COMM_WORLD), (rows->n + each - 1) / each, NULL, &taken.queue));
  HycoOnEach(PETSC_COMM_WORLD, HycoQueueEnd(taken.queue, PredictQueued(model, each, n_par, mu, &taken, rows)));
  PetscCall(HycoQueueDestroy(&taken.queue));
  PetscCall(PrintDoubts(rows->n, &taken));
  PetscCall(DriverGradientsEnd(&rows->lacking));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of all ranks that are to be solved at full order, ascending. The caller frees them. Rank 0 has the
   list, then every rank: full order is solved by all together, in the same order. */
static PetscErrorCode ListRest(const DriverRows *rows, PetscInt *n, PetscInt **list)
{
  const MPI_Comm comm = PETSC_COMM_WORLD;
  PetscMPIInt length;
  PetscInt count = 0, room = 0, *mine;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < rows->n_pieces; p++) room += rows->piece[p].n;
  PetscCall(PetscMalloc1(room, &mine));
  for (PetscInt p = 0; p < rows->n_pieces; p++) {
    const DriverPiece *piece = &rows->piece[p];

    for (PetscInt k = 0; k < piece->n; k++) {
      /* 1 where DriverWantsFullOrder() gave a reason. */
      if (piece->value[(size_t)k * (size_t)rows->width + FULL_ORDER] > 0) mine[count++] = piece->first + k;
    }
  }
  PetscCall(HycoConcatenate(comm, count, mine, MPIU_INT, sizeof(PetscInt), n, list));
  PetscCall(PetscFree(mine));
  PetscCallMPI(MPI_Bcast(n, 1, MPIU_INT, 0, comm));
  if (HycoRank(comm)) PetscCall(PetscMalloc1(*n, list));
  PetscCall(PetscMPIIntCast(*n, &length));
  PetscCallMPI(MPI_Bcast(*list, length, MPIU_INT, 0, comm));
  /* Pieces arrive in the order of ranks; ascending, neighbours in a grid share a factor. */
  PetscCall(PetscSortInt(*n, *list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row of point k; NULL: it is on another rank. */
static PetscReal *FindRow(const DriverRows *rows, PetscInt k)
{
  for (PetscInt p = 0; p < rows->n_pieces; p++) {
    const DriverPiece *piece = &rows->piece[p];

    if (k >= piece->first && k < piece->first + piece->n)
      return piece->value + (size_t)(k - piece->first) * (size_t)rows->width;
  }
  return NULL;
}

/* Solves by all ranks together the points where the reduced model was not sufficient. After all predictions, so
   that the full-order model and its factor are made once. */
static PetscErrorCode SolveRemaining(Fallback *fallback, PetscInt n_par, const PetscReal mu[], const Shape *s,
                                     const DriverRows *rows)
{
  const HycoContactResult *carried;
  PetscInt n, n_carried, *list;

  PetscFunctionBegin;
  if (!fallback->on) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ListRest(rows, &n, &list));
  for (PetscInt i = 0; i < n; i++) {
    HycoPrediction p = {0};
    PetscReal *v = FindRow(rows, list[i]);

    PetscCall(DriverSolveFullOrder(fallback, n_par, mu + list[i] * n_par, &p));
    PetscCall(HycoFOMGetContacts(fallback->fom, &n_carried, &carried));
    /* The row is another rank's: it has taken part in the solve alone. */
    if (!v) continue;
    p.estimated_error_u = v[ESTIMATE_U]; /* the model's estimate, which required full order */
    p.estimated_error_sigma = v[ESTIMATE_SIGMA];
    p.estimated_error_lambda = v[ESTIMATE_LAMBDA];
    PetscCall(PetscArraycpy(p.estimated_error_quantity, v + s->with_extremes, s->with_estimates - s->with_extremes));
    p.beyond = v[BEYOND];
    p.unseen = v[UNSEEN];
    p.inconsistency = v[INCONSISTENCY];
    p.n_dependent = -1;
    FillRow(&p, n_carried, carried, s, v);
    v[U_NORM] = NAN; /* that of the whole mesh, not of an RID */
  }
  PetscCall(DriverPrint("%d of the %d points were solved at full order\n", (int)n, (int)rows->n));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The seconds are those of the predictions and solves, without the fields. */
static PetscErrorCode PredictCommandPoints(HycoROM model, HycoScene scene, Fallback *fallback, HycoSamples samples,
                                           const char output[], PetscBool derives)
{
  PetscInt n, n_par;
  Shape s = {.gradients = {.on = derives}};
  DriverRows rows = {0};
  const PetscReal *mu;
  PetscReal begin;
  char table[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, table));
  PetscCall(DriverCheckLeftEarly()); /* solver options are read by the first prediction */
  /* Columns are known before the first prediction: rows have their full width from the start. */
  PetscCall(ShapeOf(model, scene, &s));
  rows.n = n;
  rows.width = s.width;
  begin = HycoNow();
  PetscCall(PredictAll(model, fallback, n_par, mu, &s, &rows));
  PetscCall(SolveRemaining(fallback, n_par, mu, &s, &rows));
  begin = HycoNow() - begin;
  if (output[0]) HycoOnRoot(PETSC_COMM_WORLD, HycoROMWriteMany(model, n, n_par, mu, output));
  PetscCall(ReportSet("predict", table, scene, samples, s.names, &rows, begin));
  PetscCall(DestroyShape(&s));
  PetscCall(DriverRowsFree(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declare...() read every option once into variables that are not used: each option has one place in the code,
   where it is read, and help shows what is read there. */
PetscErrorCode DeclarePredict(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool flag;
  PetscReal target;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, path, path, path));
  PetscCall(DriverGetPoint(NULL, NULL, NULL));
  PetscCall(DriverGetSamples(NULL, PETSC_FALSE, NULL, NULL));
  PetscCall(DriverReadExtrapolate(&flag));
  PetscCall(DriverReadTarget(HYCO_ERROR_U, &target));
  PetscCall(DriverReadTarget(HYCO_ERROR_LAMBDA, &target));
  PetscCall(DriverReadMonitor(&flag));
  PetscCall(DriverReadGradient(&flag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank loads the model: for a set each predicts its share. Combinations of options that make no sense are
   refused before the first prediction. */
PetscErrorCode CommandPredict(void)
{
  HycoROM model = NULL;
  HycoScene scene;
  HycoSamples samples = NULL;
  Fallback fallback = {0};
  PetscBool set, monitor, extrapolate, residual, derives;
  PetscInt n_times;
  char path[PETSC_MAX_PATH_LEN], output[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(NULL, path, output, report, NULL));
  PetscCall(DriverRequire("model", path));
  PetscCall(DriverReadMonitor(&monitor));
  PetscCall(DriverReadExtrapolate(&extrapolate));
  /* On each rank; a damaged file fails on all, with one message. */
  HycoOnEach(PETSC_COMM_WORLD, HycoROMLoad(path, &model));
  PetscCall(HycoROMSetExtrapolate(model, extrapolate));
  PetscCall(HycoROMGetScene(model, &scene));
  /* Its steps factor dense matrices, as full order does. */
  if (HycoSceneHasFriction(scene)) DriverChooseKernels(NULL);
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  /* It loads the scene only if -hyco_fallback or the whole displacement asks for it. */
  PetscCall(DriverReadFallback(model, extrapolate, &fallback));
  PetscCall(DriverReadGradient(&derives));
  HycoCheck(!derives || !fallback.on,
            "-gradient is that of the model, and -hyco_fallback may replace its prediction; give "
            "one of them, or use hyco solve -gradient");
  if (!n_times) PetscCall(DriverRefuseOnly("history", "it is for scenes with a history, and the model's has none"));
  PetscCall(HycoROMWantsEquilibrium(model, &residual));
  HycoCheck(!residual || n_times,
            "-hyco_residual needs a model of paths, and the scene of %s has no history; remove it", path);
  /* Set on all ranks; DriverMonitor() prints on rank 0. */
  if (monitor) PetscCall(HycoROMSetMonitor(model, DriverMonitor, NULL));
  PetscCall(DriverHasSamples(scene, &set));
  if (set) {
    HycoCheck(!output[0] || !n_times,
              "-output of a model of paths needs a single point (-mu); use -table for a set of points");
    HycoCheck(!output[0] || !fallback.on,
              "-output of a set of points works without -hyco_fallback only; remove it, or give a single point (-mu)");
    HycoCheck(!fallback.displacement,
              "-hyco_full_displacement needs a single point (-mu); a set of points has only a -table, without fields");
    PetscCall(DriverGetSamples(scene, PETSC_FALSE, &samples, &set));
    HycoStaged(HYCO_STAGE_ONLINE, PredictCommandPoints(model, scene, &fallback, samples, output, derives));
  } else {
    HycoStaged(HYCO_STAGE_ONLINE, n_times ? PredictCommandPath(model, scene, output, derives)
                                          : PredictCommandPoint(model, scene, &fallback, output, derives));
  }
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(DriverEndFallback(&fallback));
  PetscCall(HycoROMDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
