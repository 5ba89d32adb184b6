/*
  hyco train: its attempts, the errors of the model, and whether they are small enough. The library tries the settings
  (HycoReducerRun()); each attempt is a line, and a row in -table. Errors are those at held-out points, as in hyco
  compare.
*/
#include "driver.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Its own function: read only with targets, declared always. The default -1 is not shown. */
PetscErrorCode DriverReadBudget(PetscInt *budget)
{
  PetscFunctionBegin;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsInt(
      "-target_max_added",
      "train -target_...: largest number of solutions added to meet the targets (default: as many as were given) []", 0,
      1000000, budget, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A budget of added solutions has a meaning with targets only: without them nothing is added. */
PetscErrorCode DriverReadTargets(Search *s)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    PetscCall(DriverReadTarget((HycoErrorKind)j, &s->target[j]));
    s->on = (PetscBool)(s->on || s->target[j] > 0);
  }
  s->budget = -1;
  if (s->on) PetscCall(DriverReadBudget(&s->budget));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "1.2e-03", or "inf": a solve did not converge, or x/0. */
static void TrainingReportFormat(PetscReal value, char text[32])
{
  if (value > PETSC_MAX_REAL / 8)
    snprintf(text, 32, "inf");
  else
    snprintf(text, 32, "%.3g", (double)value);
}

/* "u 0.12 %, stress 3.4 %, forces 5 %" from one number per kind of error. */
static void DescribeErrors(PetscBool path, const PetscReal error[], char text[DRIVER_LINE])
{
  static const HycoErrorKind kinds[] = {HYCO_ERROR_U, HYCO_ERROR_SIGMA, HYCO_ERROR_LAMBDA, HYCO_ERROR_INELASTIC};
  static const char *const words[] = {"u", "stress", "forces", "inelastic strain"};
  size_t at = 0;

  for (size_t j = 0; j < (path ? 4 : 3); j++) {
    char percent[32];

    DriverPercent(error[kinds[j]], percent);
    at += (size_t)snprintf(text + at, DRIVER_LINE - at, "%s%s %s", j ? ", " : "", words[j],
                           error[kinds[j]] > PETSC_MAX_REAL / 8 ? "infinite"
                           : PetscIsNanReal(error[kinds[j]])    ? "not compared"
                                                                : percent);
  }
}

/* Whether the scene has a history, and thus inelastic strain. An error of the getter, which has none here, counts
   as no history. */
static PetscBool IsPath(const Search *s)
{
  PetscInt n = 0;

  (void)!HycoSceneGetHistory(s->scene, &n, NULL);
  return (PetscBool)(n > 0);
}

/* The number of kinds of error. */
static PetscInt CountKinds(const Search *s)
{
  return IsPath(s) ? HYCO_N_ERRORS : HYCO_ERROR_INELASTIC;
}

/* The table is kept as text and written anew after each attempt: a run that ends early leaves the rows so far. */
static PetscErrorCode TrainingReportAppend(Search *s, const char text[])
{
  const size_t n = strlen(text);

  PetscFunctionBegin;
  if (s->length + n + 1 > s->room) {
    s->room = 2 * (s->length + n + 1);
    PetscCall(PetscRealloc(s->room, &s->text));
  }
  memcpy(s->text + s->length, text, n + 1);
  s->length += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole table is written after each attempt: a search may take hours, and what was tried so far is on disk if
   it is killed. Quotes in a failure would end the field of a CSV reader. */
static PetscErrorCode AppendRow(Search *s, const HycoAttempt *a)
{
  char row[4 * DRIVER_LINE], number[32];
  const HycoReducerSettings *r = &a->settings;
  PetscBool none;
  size_t at;

  PetscFunctionBegin;
  if (!s->length) {
    PetscCall(TrainingReportAppend(
        s,
        "attempt,training_points,model_type,variant,pod_tol,rid_layers,rid_contact_extension,hybrid,rid_whole,n_modes,"
        "rid_elements,rid_fraction,held_out_points"));
    for (PetscInt j = 0; j < CountKinds(s); j++) {
      snprintf(row, sizeof(row), ",error_%s,median_%s", HycoErrorKinds[j], HycoErrorKinds[j]);
      PetscCall(TrainingReportAppend(s, row));
    }
    PetscCall(TrainingReportAppend(s, ",not_converged,seconds,operations,meets,failure\n"));
  }
  /* No model, or one that was not judged: NaN, not 0. */
  none = (PetscBool)(a->failure[0] || !a->held_out.n);
  at = (size_t)snprintf(row, sizeof(row), "%d,%d,%s,%s,%g,%d,%g,%s,%d,%d,%d,%.6g,%d", (int)++s->n, (int)s->n_points,
                        r->type, r->variant ? r->variant : "", (double)r->pod_tol, (int)r->layers,
                        (double)r->contact_extension, HycoHybrids[r->hybrid], (int)r->whole, (int)a->n_modes,
                        (int)a->rid_elements, (double)a->rid_fraction, a->failure[0] ? 0 : (int)a->held_out.n);
  for (PetscInt j = 0; j < 2 * CountKinds(s); j++) {
    TrainingReportFormat(none ? (PetscReal)NAN : (j % 2 ? a->held_out.median : a->held_out.largest)[j / 2], number);
    at += (size_t)snprintf(row + at, sizeof(row) - at, ",%s", number);
  }
  at += (size_t)snprintf(row + at, sizeof(row) - at, ",%d,%.6g,%.6g,%d,\"", (int)a->held_out.not_converged,
                         none ? NAN : (double)a->held_out.seconds, (double)a->cost, a->ratio <= 1);
  for (const char *c = a->failure; *c && at + 4 < sizeof(row); c++) row[at++] = *c == '"' ? '\'' : *c;
  snprintf(row + at, sizeof(row) - at, "\"\n");
  PetscCall(TrainingReportAppend(s, row));
  if (s->table[0]) PetscCall(DriverWriteText(s->table, s->text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "; meets the targets" or "; accurate enough", or where and why the attempt was dropped: " at 2 of 20 points, and
   dropped beside settings 1: ...". */
static PetscErrorCode DescribeEnd(const Search *s, const HycoAttempt *a, char text[DRIVER_LINE])
{
  PetscFunctionBegin;
  text[0] = '\0';
  if (a->ratio <= 1) snprintf(text, DRIVER_LINE, s->on ? "; meets the targets" : "; accurate enough");
  if (a->dropped_at >= 0 && !a->beaten_by)
    snprintf(text, DRIVER_LINE, "; dropped at held-out path %d of %d, which does not reach its end", (int)a->held_out.n,
             (int)a->n_held);
  if (a->beaten_by && a->dropped_at < 0)
    snprintf(text, DRIVER_LINE, "; not judged: settings %d are accurate enough and cost less", (int)a->beaten_by);
  else if (a->beaten_by)
    snprintf(text, DRIVER_LINE, "; dropped at held-out path %d of %d: settings %d are better", (int)a->held_out.n,
             (int)a->n_held, (int)a->beaten_by);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The title of the lines of the attempts. */
static PetscErrorCode PrintAim(const Search *s, PetscInt n_held)
{
  char aim[DRIVER_LINE];

  PetscFunctionBegin;
  DescribeErrors(IsPath(s), s->aim, aim);
  if (s->on)
    PetscCall(DriverPrint("settings, each judged at %d held-out points (largest errors):\n", (int)n_held));
  else
    PetscCall(DriverPrint("settings, each judged at %d held-out points (largest errors; enough are %s):\n", (int)n_held,
                          aim));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the attempt with the fewest operations within the limits, which need not be accurate enough to be chosen. */
static void KeepFastest(Search *s, const HycoAttempt *a)
{
  if (a->failure[0] || a->beaten_by || !a->held_out.n || a->held_out.n < a->n_held) return;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    if (s->limit[j] > 0 && a->held_out.largest[j] > s->limit[j]) return;
  }
  if (!s->fastest.number || a->cost < s->fastest.cost) s->fastest = *a;
}

#define WORTH_MENTIONING 2 /* times: a smaller gain is none to mention */
/* Target over the error that shall meet it, in an advice: a tenth, since a repeated training differs in the last
   digits. */
#define WIDER_TARGET 1.1

/* The trade that the search has met and not taken, with the targets that take it. */
static PetscErrorCode PrintFaster(const Search *s, const HycoTraining *t)
{
  static const HycoErrorKind kinds[] = {HYCO_ERROR_U, HYCO_ERROR_SIGMA, HYCO_ERROR_LAMBDA, HYCO_ERROR_INELASTIC};
  const HycoAttempt *a = &s->fastest;
  char errors[DRIVER_LINE], targets[DRIVER_LINE] = "";
  size_t at = 0;

  PetscFunctionBegin;
  if (s->on || !a->number || a->number == t->chosen.number || WORTH_MENTIONING * a->cost > t->chosen.cost)
    PetscFunctionReturn(PETSC_SUCCESS);
  DescribeErrors(IsPath(s), a->held_out.largest, errors);
  for (size_t j = 0; j < (IsPath(s) ? 4 : 3); j++)
    at += (size_t)snprintf(targets + at, sizeof(targets) - at, " -target_%s %.2g", HycoErrorKinds[kinds[j]],
                           WIDER_TARGET * (double)a->held_out.largest[kinds[j]]);
  PetscCall(DriverPrint("faster: settings %d take %.3g ms with %s; to have them:%s\n", (int)a->number,
                        1e3 * (double)a->held_out.seconds, errors, targets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoAttemptMonitor. Rank 0: HycoAttemptMonitor is called there only. */
static PetscErrorCode TrainingReportAttempted(const HycoAttempt *a, void *ctx)
{
  Search *s = (Search *)ctx;
  char what[DRIVER_LINE], errors[DRIVER_LINE], end[DRIVER_LINE];

  PetscFunctionBegin;
  if (a->number == 1) PetscCall(PrintAim(s, a->n_held));
  HycoReducerSettingsDescribe(&a->settings, sizeof(what), what);
  DescribeErrors(IsPath(s), a->held_out.largest, errors);
  PetscCall(DescribeEnd(s, a, end));
  if (a->failure[0])
    PetscCall(DriverPrint("  %2d %s: no model: %s\n", (int)a->number, what, a->failure));
  else if (!a->held_out.n)
    PetscCall(DriverPrint("  %2d %s: %d modes, RID %.1f %%%s\n", (int)a->number, what, (int)a->n_modes,
                          100 * (double)a->rid_fraction, end));
  else
    PetscCall(DriverPrint("  %2d %s: %d modes, RID %.1f %%; %s; %.3g ms%s\n", (int)a->number, what, (int)a->n_modes,
                          100 * (double)a->rid_fraction, errors, 1e3 * (double)a->held_out.seconds, end));
  KeepFastest(s, a);
  PetscCall(AppendRow(s, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoAddedMonitor. */
static PetscErrorCode TrainingReportAdded(PetscInt n, PetscInt parameter, PetscBool former, void *ctx)
{
  Search *s = (Search *)ctx;
  const char *const *names;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(s->scene, NULL, &names, NULL, NULL));
  s->n_points += n;
  /* Held-out points that decided where to add solutions are no fair judges any more. */
  if (former) {
    PetscCall(DriverPrint(
        "the targets are missed, at the held-out points or at fresh ones away from the added solutions: the "
        "search goes on with the fresh ones, and %d former ones become training points\n",
        (int)n));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(DriverPrint("no settings meet the targets: %d solutions are added where the errors are largest%s%s\n",
                        (int)n, parameter < 0 ? "" : "; the training values are too far apart in ",
                        parameter < 0 ? "" : names[parameter]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The aim is the library's: the user's targets, or its defaults and limits. */
PetscErrorCode DriverSetSearch(Search *s, HycoScene scene, HycoReducer reducer, PetscInt n_points)
{
  PetscFunctionBegin;
  s->scene = scene;
  s->n_points = n_points;
  PetscCall(HycoReducerSetTargets(reducer, s->target, s->budget));
  PetscCall(HycoReducerGetTargets(reducer, s->aim, s->limit));
  PetscCall(HycoReducerSetAttemptMonitor(reducer, TrainingReportAttempted, TrainingReportAdded, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports targets that are not met: a line and the exit status of a miss. One line for each error above its limit,
   each with what the user can do. */
static PetscErrorCode TrainingReportMisses(const Search *s, const HycoTraining *t)
{
  const PetscReal *limit = s->limit;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    char reached[32], asked[32];

    /* No limit for this kind. */
    if (!(limit[j] > 0) || !(t->held_out.largest[j] > limit[j])) continue;
    DriverPercent(t->held_out.largest[j], reached);
    DriverPercent(limit[j], asked);
    PetscCall(DriverMissed(
        "the error of %s is %s at the worst of %d held-out points, and %s %s; the model is written; %s%s%s",
        j == HYCO_ERROR_U           ? "u"
        : j == HYCO_ERROR_LAMBDA    ? "the contact forces"
        : j == HYCO_ERROR_INELASTIC ? "the inelastic strain"
                                    : HycoErrorKinds[j],
        t->held_out.largest[j] > PETSC_MAX_REAL / 8 ? "infinite" : reached, (int)t->held_out.n,
        s->on ? "the target is" : "without a target it should stay below", asked, t->next, t->next[0] ? "; or " : "",
        !t->chosen.settings.pod ? "try another type (-hyco_model_type; more training points change nothing in this "
                                  "one), or set looser targets"
        : s->on                 ? "give more training points, a larger -target_max_added, or a looser target"
                : "give more training points, with the ends of the ranges among them, let training add them (-target_u "
                  "5e-3 "
                  "-target_lambda 3e-2), or set looser targets"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the search did not try, in one line; several with the same reason together. */
static PetscErrorCode PrintLeftOut(const HycoTraining *t)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < t->n_left_out; k++) {
    const PetscBool last = (PetscBool)(k + 1 == t->n_left_out),
                    same = (PetscBool)(!last && strcmp(t->left_out[k].why, t->left_out[k + 1].why) == 0);

    PetscCall(DriverPrint("%s%s", k ? "" : "not tried: ", t->left_out[k].what));
    if (same)
      PetscCall(DriverPrint(", "));
    else
      PetscCall(DriverPrint(" (%s)%s", t->left_out[k].why, last ? "\n" : "; "));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A line for each output of the scene: its errors in its own unit, and its size. */
static PetscErrorCode PrintOutputs(const Search *s, const HycoTraining *t)
{
  const char *names[HYCO_MAX_QUANTITIES], *units[HYCO_MAX_QUANTITIES];
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(s->scene, &n, names));
  PetscCall(HycoSceneGetQuantityUnits(s->scene, &n, units));
  for (PetscInt q = 0; q < n; q++) {
    const HycoOutputValidation *o = &t->output[q];

    if (o->magnitude < 0)
      PetscCall(DriverPrint("output %s: its error is not known%s, and not estimated\n", names[q],
                            IsPath(s) ? " (snapshots from before a reaction was named do not have it)" : ""));
    else if (o->median < 0)
      PetscCall(DriverPrint("output %s: not compared, and not estimated, as the position of a body is arbitrary\n",
                            names[q]));
    else
      PetscCall(DriverPrint("output %s: errors median %.3g, largest %.3g; values up to %.4g%s%s%s\n", names[q],
                            (double)o->median, (double)o->largest, (double)o->magnitude, units[q][0] ? " " : "",
                            units[q], o->magnitude > 0 ? "" : "; no estimate: it is zero at all held-out points"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors of the model that is written, at all held-out points, not those of its attempt. */
PetscErrorCode DriverJudgeModel(const Search *s, const HycoTraining *t)
{
  char what[DRIVER_LINE], median[DRIVER_LINE], largest[DRIVER_LINE], end[DRIVER_LINE], fresh[DRIVER_LINE] = "";

  PetscFunctionBegin;
  if (t->chosen.number) {
    HycoReducerSettingsDescribe(&t->chosen.settings, sizeof(what), what);
    PetscCall(DriverPrint("chosen: settings %d of %d: %s\n", (int)t->chosen.number, (int)t->chosen.of, what));
    PetscCall(PrintLeftOut(t));
  }
  /* Without any there is nothing to judge, and no miss. */
  if (!t->held_out.n) {
    PetscCall(DriverPrint("no held-out points: the errors of this model are not known, and it cannot estimate them\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  DescribeErrors(IsPath(s), t->held_out.median, median);
  DescribeErrors(IsPath(s), t->held_out.largest, largest);
  if (t->n_fresh)
    snprintf(fresh, sizeof(fresh), ", %d of them fresh (no solution was added near them)", (int)t->n_fresh);
  PetscCall(DriverPrint("errors at %d held-out points%s: median %s; largest%s %s\n", (int)t->held_out.n, fresh, median,
                        t->n_corners ? ", also at corners of the training," : "", largest));
  if (t->held_out.loose)
    PetscCall(
        DriverPrint("at %d of them contact leaves a motion of a body free: displacements are arbitrary there, and not "
                    "judged\n",
                    (int)t->held_out.loose));
  DescribeErrors(IsPath(s), t->held_out.end, end);
  if (IsPath(s))
    PetscCall(
        DriverPrint("these are the errors at each path's worst listed time; the largest at the end are %s\n", end));
  PetscCall(PrintOutputs(s, t));
  if (!t->n_held)
    PetscCall(DriverPrint("the model does not estimate its errors: fewer than 10 predictions of held-out solutions\n"));
  PetscCall(PrintFaster(s, t));
  PetscCall(TrainingReportMisses(s, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number, or null where it is infinite, or not known. */
static void AddFinite(cJSON *object, const char name[], PetscReal value)
{
  if (!(value <= PETSC_MAX_REAL / 8))
    cJSON_AddNullToObject(object, name);
  else
    cJSON_AddNumberToObject(object, name, value);
}

/* held_out: outputs: {NAME: {median, largest, magnitude, estimated}}, in the outputs' units; null: not known. */
static void ReportOutputs(cJSON *held, const Search *s, const HycoTraining *t)
{
  const char *names[HYCO_MAX_QUANTITIES];
  PetscInt n = 0;
  cJSON *outputs;

  (void)!HycoSceneGetQuantities(s->scene, &n, names);
  outputs = n ? cJSON_AddObjectToObject(held, "outputs") : NULL;
  for (PetscInt q = 0; q < n; q++) {
    const HycoOutputValidation *o = &t->output[q];
    const PetscReal infinite = PETSC_MAX_REAL;
    cJSON *output = cJSON_AddObjectToObject(outputs, names[q]);

    AddFinite(output, "median", o->median < 0 ? infinite : o->median);
    AddFinite(output, "largest", o->median < 0 ? infinite : o->largest);
    AddFinite(output, "magnitude", o->magnitude < 0 ? infinite : o->magnitude);
    cJSON_AddBoolToObject(output, "estimated", o->estimated);
  }
}

/* Sections that do not apply are null or absent: 0 would read as an error of 0. */
void DriverReportModel(cJSON *json, const Search *s, const HycoTraining *t)
{
  const HycoAttempt *a = &t->chosen;
  cJSON *held;

  if (t->held_out.n) {
    held = cJSON_AddObjectToObject(json, "held_out");
    ReportNumbers(held, {"n", t->held_out.n}, {"fresh", t->n_fresh}, {"not_converged", t->held_out.not_converged},
                  {"online_seconds", t->held_out.seconds});
    for (PetscInt j = 0; j < CountKinds(s); j++) {
      cJSON *error = cJSON_AddObjectToObject(held, HycoErrorKinds[j]);

      AddFinite(error, "median", t->held_out.median[j]);
      AddFinite(error, "mean", t->held_out.mean[j]);
      AddFinite(error, "largest", t->held_out.largest[j]);
      if (IsPath(s)) AddFinite(error, "end", t->held_out.end[j]);
      if (s->target[j] > 0) cJSON_AddNumberToObject(error, "target", s->target[j]);
    }
    ReportOutputs(held, s, t);
  } else
    cJSON_AddNullToObject(json, "held_out");
  if (a->number) {
    cJSON *search = cJSON_AddObjectToObject(json, "search"), *left_out;

    /* Attempts count from the first search; `chosen` is numbered within the last one, hence the shift. */
    ReportNumbers(search, {"attempts", s->n}, {"chosen", s->n - a->of + a->number}, {"added", t->n_added},
                  {"former_held_out", t->n_former});
    cJSON_AddStringToObject(search, "model_type", a->settings.type);
    if (a->settings.variant) cJSON_AddStringToObject(search, "variant", a->settings.variant);
    ReportNumbers(search, {"pod_tol", a->settings.pod_tol}, {"rid_layers", a->settings.layers},
                  {"rid_contact_extension", a->settings.contact_extension});
    cJSON_AddStringToObject(search, "hybrid", HycoHybrids[a->settings.hybrid]);
    cJSON_AddBoolToObject(search, "rid_whole", a->settings.whole);
    ReportNumbers(search, {"operations", t->search_operations}, {"operations_of_solutions", t->solution_operations});
    left_out = cJSON_AddObjectToObject(search, "not_tried");
    for (PetscInt k = 0; k < t->n_left_out; k++)
      cJSON_AddStringToObject(left_out, t->left_out[k].what, t->left_out[k].why);
  }
}
