/* hyco solve: full order, at one parameter value or over a set. */
#include "driver.h"
#include <math.h>

/* Prints remarks that the user should know. */
static PetscErrorCode SolveCommandRemarks(const HycoSummary *s, PetscInt n, const HycoStep step[])
{
  PetscFunctionBegin;
  if (s->regularised[0]) PetscCall(DriverPrint("regularised: neither supports nor contact keep %s\n", s->regularised));
  if (s->loose[0]) PetscCall(DriverPrint("warning: no contact force keeps %s: its position is arbitrary\n", s->loose));
  if (s->buried[0])
    PetscCall(
        DriverPrint("warning: every node of %s overlaps before any load, in share of the body's extent: is the sign of "
                    "the gap right (above 0 the surfaces are apart)?\n",
                    s->buried));
  if (s->n_still)
    PetscCall(DriverPrint("%d contact%s between fixed displacements: without effect\n", (int)s->n_still,
                          s->n_still > 1 ? "s lie" : " lies"));
  PetscCall(DriverPrintDependent(s->n_dependent, n, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints a warning of displacements that are hardly meant. */
static PetscErrorCode WarnOfUnits(PetscReal u_relative)
{
  PetscFunctionBegin;
  if (u_relative > 1)
    PetscCall(DriverPrint("warning: displacements of %.1e times the extent of the mesh; are the units right?\n",
                          (double)u_relative));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports the reactions, and the imbalance of all forces. */
static PetscErrorCode PrintReactions(cJSON *json, HycoFOM fom, PetscInt dim)
{
  static const char *const section[] = {"supports", "springs", "loads", "contact"};
  const HycoReaction *r;
  PetscReal balance = 0;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetReactions(fom, &n, &r, &balance));
  for (PetscInt k = 0; k < n; k++) {
    cJSON *one = cJSON_GetObjectItem(json, section[r[k].kind]);

    /* A section appears with its first member: a scene without springs has none. */
    if (!one) one = cJSON_AddObjectToObject(json, section[r[k].kind]);
    if (r[k].group[0]) one = cJSON_AddObjectToObject(one, r[k].group);
    ReportVector(one, "force", dim, r[k].force);
    /* In a plane there is only the moment about z. */
    if (dim == 2) ReportVector(one, "moment", 1, r[k].moment + 2);
    if (dim == 3) ReportVector(one, "moment", 3, r[k].moment);
    if (r[k].group[0])
      PetscCall(DriverPrint("%s %s: force on the bodies (%.6g, %.6g, %.6g)\n",
                            r[k].kind == HYCO_REACTION_SPRING ? "springs" : "support", r[k].group,
                            (double)r[k].force[0], (double)r[k].force[1], (double)r[k].force[2]));
  }
  cJSON_AddNumberToObject(json, "balance", balance);
  PetscCall(DriverPrintBalance(balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gradient: NULL, or that of the solution. Text and JSON together, so that both have the same numbers in the same
   order. */
static PetscErrorCode SolveCommandReport(HycoScene scene, const PetscReal mu[], HycoFOM fom, const HycoSummary *s,
                                         const HycoGradient *gradient)
{
  cJSON *json;
  HycoSolver solver;
  HycoHistory history;
  const HycoContactResult *carried;
  PetscInt n;
  const char *method, *linear;

  PetscFunctionBegin;
  PetscCall(ReportCreate("solve", scene, mu, &json));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  PetscCall(HycoSolverGetMethod(solver, &method));
  PetscCall(HycoSolverGetLinear(solver, &linear));
  if (!method[0]) method = HycoSceneHasFriction(scene) ? "semismooth" : "none"; /* friction has a solver of its own */
  if (!linear[0]) linear = HycoSceneHasFriction(scene) ? "direct" : "none";
  ReportNumbers(json, {"n_dof", s->n_dof}, {"n_contacts", s->n_contacts}, {"n_active", s->n_active},
                {"n_without_effect", s->n_still});
  cJSON_AddBoolToObject(json, "forces_unique", s->n_dependent == 0);
  cJSON_AddNumberToObject(json, "n_dependent", s->n_dependent);
  cJSON_AddStringToObject(json, "regularised", s->regularised);
  cJSON_AddBoolToObject(json, "position_arbitrary", s->loose[0] != '\0');
  cJSON_AddStringToObject(json, "loose", s->loose);
  cJSON_AddStringToObject(json, "buried", s->buried);
  cJSON_AddNumberToObject(json, "active_set_iterations", s->iterations);
  cJSON_AddStringToObject(json, "solver", method);
  cJSON_AddStringToObject(json, "linear", linear);
  cJSON_AddBoolToObject(json, "converged", s->reason > 0);
  ReportNumbers(json, {"total_contact_force", s->total_contact_force}, {"lambda_max", s->lambda_max},
                {"lambda_norm2", s->lambda_norm2}, {"u_norm2", s->u_norm2});
  ReportVector(json, "u_min", s->dim, s->u_min);
  ReportVector(json, "u_max", s->dim, s->u_max);
  ReportNumbers(json, {"u_relative", s->u_relative}, {"strain_energy", s->strain_energy},
                {"external_work", s->external_work}, {"gap_work", s->gap_work}, {"energy_defect", s->energy_defect});
  ReportKKT(json, &s->kkt);
  cJSON_AddNumberToObject(json, "rounding", s->kkt.rounding);
  ReportSeconds(json, &s->seconds);
  PetscCall(HycoFOMGetHistory(fom, &history));
  if (history.n) PetscCall(DriverReportHistory(json, scene, &history));
  PetscCall(DriverPrint("%d unknowns, %d contacts, %d active after %d iterations (%s)\n", (int)s->n_dof,
                        (int)s->n_contacts, (int)s->n_active, (int)s->iterations, method));
  PetscCall(SolveCommandRemarks(s, history.n, history.step));
  PetscCall(WarnOfUnits(s->u_relative));
  PetscCall(DriverPrint("total contact force %.10g, largest %.6g; strain energy %.10g, identity to %.1e\n",
                        (double)s->total_contact_force, (double)s->lambda_max, (double)s->strain_energy,
                        (double)s->energy_defect));
  PetscCall(HycoFOMGetContacts(fom, &n, &carried));
  PetscCall(DriverReportCarried(json, s->dim, n, carried));
  PetscCall(PrintReactions(json, fom, s->dim));
  PetscCall(ReportQuantities(json, scene, s->quantity));
  if (gradient) PetscCall(DriverReportGradient(json, scene, gradient));
  PetscCall(DriverPrint(
      "KKT residuals: stationarity %.1e (round-off %.1e), penetration %.1e, adhesion %.1e, complementarity %.1e\n",
      (double)s->kkt.stationarity, (double)s->kkt.rounding, (double)s->kkt.penetration, (double)s->kkt.adhesion,
      (double)s->kkt.complementarity));
  /* 0: the contacts have no masters to face. */
  if (s->n_facing && s->n_facing < s->n_contacts)
    PetscCall(DriverPrint("%d of the %d slave nodes face a master\n", (int)s->n_facing, (int)s->n_contacts));
  PetscCall(ReportContacts(json, s->n_contacts, s->n_facing, s->overlap, s->sliding));
  PetscCall(DriverPrint("seconds: %.3f assemble, %.3f factor, %.3f solve (%s)\n", (double)s->seconds.assemble,
                        (double)s->seconds.factor, (double)s->seconds.solve, linear));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene with a history: its path. The report is written for a path that reached its end; DriverEndHistory()
   fails for others, after the table. */
static PetscErrorCode SolveCommandPath(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char output[],
                                       const char table[], PetscBool derives)
{
  HycoSummary summary;
  DriverPath path = {0};
  HycoGradient gradient;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(HycoSceneGetHistory(scene, &path.n, NULL));
  if (output[0]) PetscCall(HycoFOMSetSeries(fom, output));
  /* Each step is printed as it is reached, since a path may take hours. */
  PetscCall(HycoFOMSetStepMonitor(fom, DriverMonitorStep, &path));
  PetscCall(HycoFOMSolve(fom, n, mu));
  /* Writes the table and fails if the path ended early; fields so far are written by the series itself. */
  PetscCall(DriverEndHistory(fom, scene, mu, table));
  if (derives) PetscCall(HycoFOMGetGradient(fom, &gradient));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  PetscCall(SolveCommandReport(scene, mu, fom, &summary, derives ? &gradient : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of a set's table. */
enum {
  FORCE,
  LAMBDA_MAX,
  ACTIVE,
  U_NORM,
  ENERGY,
  KKT,
  CONVERGED,
  ITERATIONS,
  SECONDS,
  PATH_FORCE, /* only for paths */
  PATH_MISES,
  PATH_INELASTIC,
  N_COLUMNS
};
static const char *const columns[N_COLUMNS] = {"total_contact_force",
                                               "lambda_max",
                                               "n_active",
                                               "u_norm2",
                                               "strain_energy",
                                               "kkt_max",
                                               "converged",
                                               "iterations",
                                               "seconds",
                                               "largest_contact_force",
                                               "largest_mises",
                                               "largest_inelastic"};

/* The table of a set: these columns (own: without those of paths), the scene's quantities, of paths at their end and
   their extremes, the results of its contacts, gradients. */
typedef struct {
  PetscInt own, with_quantities, with_extremes, with_carried, width;
  char path_name[HYCO_MAX_QUANTITIES][DRIVER_LINE];
  DriverCarried carried;
  DriverGradients gradients;
  const char **names;
  PetscReal *value;
} Table;

/* For n points, once dim is known. Room for all quantities first; the width is then that of the columns there are. */
static PetscErrorCode CreateTable(HycoScene scene, PetscInt dim, PetscInt n, Table *t)
{
  PetscInt n_times;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  PetscCall(DriverCarriedColumns(scene, dim, &t->carried));
  PetscCall(DriverGradientColumns(scene, &t->gradients));
  t->width = N_COLUMNS + 2 * HYCO_MAX_QUANTITIES + t->carried.n_contacts * t->carried.each + t->gradients.n;
  PetscCall(PetscMalloc1(t->width, &t->names));
  t->own = n_times ? N_COLUMNS : PATH_FORCE;
  PetscCall(ReportColumns(scene, t->own, columns, &t->with_quantities, t->names));
  t->with_extremes = t->with_quantities;
  if (n_times) PetscCall(ReportExtremes(t->own, t->names, &t->with_extremes, t->path_name));
  /* Outputs are fewer than the room. */
  t->width = t->with_extremes;
  for (PetscInt c = 0; c < t->carried.n_contacts * t->carried.each; c++) t->names[t->width++] = t->carried.name[c];
  t->with_carried = t->width;
  for (PetscInt c = 0; c < t->gradients.n; c++) t->names[t->width++] = t->gradients.name[c];
  PetscCall(PetscCalloc1(n * t->width, &t->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyTable(Table *t)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(t->carried.name));
  PetscCall(PetscFree(t->gradients.name));
  PetscCall(PetscFree(t->names));
  PetscCall(PetscFree(t->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a path adds to the fixed columns, and sums or extremes over its listed times in place of the last one's. */
static void FillPath(const HycoHistory *h, PetscReal v[])
{
  v[KKT] = v[ITERATIONS] = v[SECONDS] = v[PATH_FORCE] = v[PATH_MISES] = v[PATH_INELASTIC] = 0;
  for (PetscInt k = 0; k < h->n; k++) {
    const HycoStep *s = &h->step[k];

    v[KKT] = PetscMax(v[KKT], s->kkt);
    v[ITERATIONS] += s->iterations;
    v[SECONDS] += s->seconds;
    v[PATH_FORCE] = PetscMax(v[PATH_FORCE], s->total_contact_force);
    v[PATH_MISES] = PetscMax(v[PATH_MISES], s->mises);
    v[PATH_INELASTIC] = PetscMax(v[PATH_INELASTIC], s->inelastic);
  }
}

/* The layout of a row: fixed columns, outputs of the scene, resultants of the contacts, derivatives. The same
   order as the names in the table. */
static PetscErrorCode FillRow(HycoFOM fom, const HycoSummary *s, const Table *t, DriverLacking *lacking, PetscReal v[])
{
  const HycoContactResult *carried;
  HycoGradient gradient;
  HycoHistory h;
  PetscErrorCode caught;
  PetscInt n;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(fom, &h));
  solved = (PetscBool)(s->reason > 0 && (t->own == PATH_FORCE || h.ended));
  if (s->reason == HYCO_DIVERGED_STEP && !h.n) {
    for (PetscInt c = 0; c < t->width; c++) v[c] = NAN;
    v[CONVERGED] = v[ITERATIONS] = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  v[FORCE] = s->total_contact_force;
  v[LAMBDA_MAX] = s->lambda_max;
  v[ACTIVE] = s->n_active;
  v[U_NORM] = s->u_norm2;
  v[ENERGY] = s->strain_energy;
  v[KKT] = HycoKKTMax(&s->kkt);
  v[CONVERGED] = solved;
  v[ITERATIONS] = s->iterations;
  v[SECONDS] = s->seconds.total;
  if (t->own > PATH_FORCE) FillPath(&h, v);
  PetscCall(PetscArraycpy(v + t->own, s->quantity, t->with_quantities - t->own));
  PetscCall(PetscArraycpy(v + t->with_quantities, h.path_quantity, t->with_extremes - t->with_quantities));
  PetscCall(HycoFOMGetContacts(fom, &n, &carried));
  DriverCarriedFill(&t->carried, n, carried, v + t->with_extremes);
  /* A point that failed has no results, and its row stays. */
  for (PetscInt c = 0; c < t->with_carried && !solved; c++) {
    if (c < KKT || c > SECONDS) v[c] = NAN;
  }
  for (PetscInt c = 0; c < t->gradients.n; c++) v[t->with_carried + c] = NAN;
  if (!t->gradients.on || !solved) PetscFunctionReturn(PETSC_SUCCESS);
  /* Its errors are raised on every rank. */
  PetscCall(HycoCatchBegin());
  caught = HycoFOMGetGradient(fom, &gradient);
  PetscCall(DriverGradientCatch(&t->gradients, &gradient, caught, lacking, v + t->with_carried));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of a single point: a set's, with one row. gradient: NULL, or that of the solution. */
static PetscErrorCode WriteRow(HycoFOM fom, HycoScene scene, const PetscReal mu[], const HycoSummary *s,
                               const HycoGradient *gradient, const char table[])
{
  Table t = {.gradients = {.on = (PetscBool)(gradient != NULL)}};
  DriverPiece all;
  DriverRows rows;

  PetscFunctionBegin;
  PetscCall(CreateTable(scene, s->dim, 1, &t));
  t.gradients.on = PETSC_FALSE; /* it is known */
  PetscCall(FillRow(fom, s, &t, NULL, t.value));
  if (gradient) DriverGradientFill(&t.gradients, gradient, t.value + t.with_carried);
  rows = DriverRowsOfRoot(1, t.width, t.value, &all);
  PetscCall(DriverWriteTable(table, scene, mu, t.names, &rows));
  PetscCall(DestroyTable(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not converged: nothing is written, neither fields nor report. */
static PetscErrorCode SolveCommandPoint(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char output[],
                                        const char table[], PetscBool derives)
{
  HycoSummary summary;
  HycoGradient gradient;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  HycoCheck(summary.reason > 0, "%s (KKT residuals: %.1e, %.1e, %.1e, %.1e); nothing was written", summary.why,
            (double)summary.kkt.stationarity, (double)summary.kkt.penetration, (double)summary.kkt.adhesion,
            (double)summary.kkt.complementarity);
  /* Needs the factor of the solution, which is still there. */
  if (derives) PetscCall(HycoFOMGetGradient(fom, &gradient));
  if (output[0]) PetscCall(HycoFOMWrite(fom, output));
  if (table[0]) PetscCall(WriteRow(fom, scene, mu, &summary, derives ? &gradient : NULL, table));
  PetscCall(SolveCommandReport(scene, mu, fom, &summary, derives ? &gradient : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the points in their order, each from the last one's active contacts, by all ranks together. */
static PetscErrorCode SolveCommandPoints(HycoFOM fom, HycoScene scene, HycoSamples samples, const char output[],
                                         const char table[], PetscBool derives)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  Table t = {.gradients = {.on = derives}};
  DriverPiece all;
  DriverRows rows;
  DriverLacking lacking = {0};
  PetscReal begin, u_relative = 0;
  PetscInt n_loose = 0;
  char loose[DRIVER_LINE] = "";

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  if (output[0]) PetscCall(HycoFOMWriteBegin(fom, output, n));
  begin = HycoNow();
  for (PetscInt k = 0; k < n; k++) {
    HycoSummary s;
    HycoHistory h;

    PetscCall(HycoFOMSolve(fom, n_par, mu + k * n_par));
    PetscCall(HycoFOMGetSummary(fom, &s));
    if (s.loose[0] && !n_loose++) PetscCall(PetscStrncpy(loose, s.loose, sizeof(loose)));
    s.loose[0] = '\0'; /* of the set, below */
    if (k == 0) PetscCall(SolveCommandRemarks(&s, 0, NULL));
    /* The dimension is known from the first solution. */
    if (k == 0) PetscCall(CreateTable(scene, s.dim, n, &t));
    if (s.reason > 0) u_relative = PetscMax(u_relative, s.u_relative);
    /* Before the gradient: after an error of it there is no solution to write. */
    PetscCall(HycoFOMGetHistory(fom, &h));
    if (output[0] && (h.n || s.reason != HYCO_DIVERGED_STEP)) PetscCall(HycoFOMWriteAdd(fom));
    PetscCall(FillRow(fom, &s, &t, &lacking, t.value + k * t.width));
    PetscCall(DriverSetPhase(k + 1, n));
  }
  if (output[0]) PetscCall(HycoFOMWriteEnd(fom));
  PetscCall(WarnOfUnits(u_relative));
  if (n_loose)
    PetscCall(DriverPrint("warning: at %d of %d points no contact force keeps a body, the first: %s; its position is "
                          "arbitrary\n",
                          (int)n_loose, (int)n, loose));
  rows = DriverRowsOfRoot(n, t.width, t.value, &all);
  /* Every rank has counted every point. */
  rows.lacking = lacking;
  HycoCheck(!lacking.n || lacking.n_found, "%s", lacking.why);
  PetscCall(ReportSet("solve", table, scene, samples, t.names, &rows, HycoNow() - begin));
  PetscCall(DestroyTable(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareSolve(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool monitor;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, NULL, path, path, path));
  PetscCall(DriverGetPoint(NULL, NULL, NULL));
  PetscCall(DriverGetSamples(NULL, PETSC_FALSE, NULL, NULL));
  PetscCall(DriverReadMonitor(&monitor));
  PetscCall(DriverReadGradient(&monitor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CommandSolve(void)
{
  HycoScene scene;
  HycoSamples samples = NULL;
  HycoFOM fom;
  HycoSolver solver;
  PetscBool monitor, derives, set, checkpoint;
  PetscInt n_times;
  PetscReal mu[64];
  char path[PETSC_MAX_PATH_LEN], output[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN], table[PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, NULL, output, report, NULL));
  PetscCall(DriverRequire("scene", path));
  PetscCall(DriverReadMonitor(&monitor));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  PetscCall(DriverReadGradient(&derives));
  PetscCall(DriverHasSamples(scene, &set));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-hyco_checkpoint", &checkpoint));
  /* A series, and a checkpoint, are of one path. */
  HycoCheck(!set || !n_times || (!output[0] && !checkpoint),
            "%s of a scene with a history needs a single point (-mu); use -table for a set of points",
            output[0] ? "-output" : "-hyco_checkpoint");
  if (set) {
    PetscCall(DriverGetSamples(scene, PETSC_FALSE, &samples, &set));
  } else
    PetscCall(DriverGetPoint(scene, NULL, mu));
  PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, table));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  /* The handle is the FOM's: options have been read by its creation. */
  if (monitor) PetscCall(HycoSolverSetMonitor(solver, DriverMonitor, NULL));
  PetscCall(DriverCheckLeftEarly());
  HycoStaged(HYCO_STAGE_FULL_ORDER, set       ? SolveCommandPoints(fom, scene, samples, output, table, derives)
                                    : n_times ? SolveCommandPath(fom, scene, mu, output, table, derives)
                                              : SolveCommandPoint(fom, scene, mu, output, table, derives));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
