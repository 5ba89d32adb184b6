/*
  hyco train -target_u ...: the cheapest recipe that meets the targets on solutions that no model was trained on.

  An attempt is what hyco train does with the options -hyco_model_type, -hyco_pod_tol, -hyco_rid_layers and
  -hyco_rid_contact_extension as it sets them; those given on the command line stay as they are. RIDs grow from the
  smallest; on each the tolerance tightens until the targets are met. A larger RID is then worth trying with looser
  tolerances only.
*/
#include "driver.h"
#include <hycofile.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const tolerances[] = {"1e-5", "1e-7", "1e-9", "1e-11", "1e-13"};
enum { N_TOLERANCES = sizeof(tolerances) / sizeof(tolerances[0]), MOST_LAYERS = 2 };

/* What is searched, unless the command line says it. */
static const char *const searched[] = {"-hyco_model_type", "-hyco_pod_tol", "-hyco_rid_layers",
                                       "-hyco_rid_contact_extension"};
enum { TYPE, TOLERANCE, LAYERS, EXTENSION, N_SEARCHED };

typedef struct {
  HycoScene scene; /* of the command line alone. Borrowed */
  HycoSamples training, validation;
  HycoSnapshots store;
  PetscBool pinned[N_SEARCHED];
  Search *out;
} Work;

PetscErrorCode DriverReadTargets(Search *s)
{
  char name[64];

  PetscFunctionBegin;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    PetscCall(PetscSNPrintf(name, sizeof(name), "target_%s", HycoErrorKinds[j]));
    PetscCall(DriverReadTarget(name, &s->target[j]));
    s->on = (PetscBool)(s->on || s->target[j] > 0);
  }
  if (s->on) PetscCall(DriverGet("table", PETSC_FALSE, s->table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest ratio of an error to its target; at most 1: they are met. */
static PetscReal Ratio(const Search *s, const Attempt *a, PetscInt *worst)
{
  PetscReal ratio = 0;

  *worst = 0;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    if (!(s->target[j] > 0) || a->v.largest[j] / s->target[j] <= ratio) continue;
    ratio = a->v.largest[j] / s->target[j];
    *worst = j;
  }
  return a->failure[0] ? PETSC_INFINITY : ratio;
}

static void Describe(const Attempt *a, char text[DRIVER_LINE])
{
  int at = snprintf(text, DRIVER_LINE, "%s", a->option[TYPE]);

  if (a->option[TOLERANCE][0])
    at += snprintf(text + at, DRIVER_LINE - (size_t)at, ", pod_tol %s", a->option[TOLERANCE]);
  if (a->option[LAYERS][0]) at += snprintf(text + at, DRIVER_LINE - (size_t)at, ", layers %s", a->option[LAYERS]);
  if (a->option[EXTENSION][0])
    snprintf(text + at, DRIVER_LINE - (size_t)at, ", contact extension %s", a->option[EXTENSION]);
}

/* "1.2e-03", or "inf": a solve did not converge, or x/0. */
static void Number(PetscReal value, char text[32])
{
  if (value > PETSC_MAX_REAL / 8)
    snprintf(text, 32, "inf");
  else
    snprintf(text, 32, "%.3g", (double)value);
}

/* The errors that have a target: "u 0.0012, lambda 0.034". */
static void DescribeErrors(const Search *s, const Attempt *a, char text[DRIVER_LINE])
{
  size_t at = 0;

  text[0] = '\0';
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    char number[32];

    Number(a->v.largest[j], number);
    if (s->target[j] > 0 && at + 64 < DRIVER_LINE)
      at += (size_t)snprintf(text + at, DRIVER_LINE - at, "%s%s %s", at ? ", " : "", HycoErrorKinds[j], number);
  }
}

static PetscErrorCode SayAttempt(const Search *s, const Attempt *a)
{
  char what[DRIVER_LINE], errors[DRIVER_LINE];
  PetscInt worst;
  const PetscReal ratio = Ratio(s, a, &worst);

  PetscFunctionBegin;
  Describe(a, what);
  DescribeErrors(s, a, errors);
  if (a->failure[0])
    PetscCall(Say("attempt %d: %s: no model: %s\n", (int)a->number, what, a->failure));
  else
    PetscCall(Say("attempt %d: %s: %d modes, RID %.1f %%; largest errors %s; %.3g ms; %s%s\n", (int)a->number, what,
                  (int)a->t.n_modes, 100 * (double)a->t.rid_fraction, errors, 1e3 * (double)a->v.seconds,
                  ratio <= 1 ? "meets" : "misses ", ratio <= 1 ? "" : HycoErrorKinds[worst]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table so far, a row per attempt. */
static PetscErrorCode WriteTable(const Search *s)
{
  const size_t room = (size_t)(s->n + 1) * 2 * DRIVER_LINE;
  size_t at = 0;
  char *text;
  PetscInt worst;

  PetscFunctionBegin;
  if (!s->table[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(room, &text));
  at += (size_t)snprintf(text, room,
                         "attempt,model_type,pod_tol,rid_layers,rid_contact_extension,n_modes,rid_elements,"
                         "rid_fraction");
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++)
    at += (size_t)snprintf(text + at, room - at, ",error_%s", HycoErrorKinds[j]);
  at += (size_t)snprintf(text + at, room - at, ",not_converged,seconds,meets,failure\n");
  for (PetscInt k = 0; k < s->n; k++) {
    const Attempt *a = &s->attempt[k];
    char number[32];

    at += (size_t)snprintf(text + at, room - at, "%d,%s,%s,%s,%s,%d,%d,%.6g", (int)a->number, a->option[TYPE],
                           a->option[TOLERANCE], a->option[LAYERS], a->option[EXTENSION], (int)a->t.n_modes,
                           (int)a->t.rid_elements, (double)a->t.rid_fraction);
    for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
      Number(a->failure[0] ? NAN : a->v.largest[j], number);
      at += (size_t)snprintf(text + at, room - at, ",%s", number);
    }
    at += (size_t)snprintf(text + at, room - at, ",%d,%.6g,%d,\"%s\"\n", (int)a->v.not_converged,
                           a->failure[0] ? NAN : (double)a->v.seconds, Ratio(s, a, &worst) <= 1, a->failure);
  }
  HycoOnRoot(PETSC_COMM_WORLD, DriverWriteText(s->table, text));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts the recipe where the next scene that is loaded finds it. */
static PetscErrorCode SetOptions(const Work *w, const Attempt *a)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < N_SEARCHED; k++) {
    if (w->pinned[k]) continue;
    if (a->option[k][0])
      PetscCall(PetscOptionsSetValue(NULL, searched[k], a->option[k]));
    else
      PetscCall(PetscOptionsClearValue(NULL, searched[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As hyco train with the attempt's options, from the solutions in the store, to `path`. */
static PetscErrorCode TrainOnce(const Work *w, const char path[], PetscBool calibrate, HycoScene *scene,
                                HycoTrainer *trainer, HycoTraining *t)
{
  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, w->out->scene, scene));
  PetscCall(HycoTrainerCreate(PETSC_COMM_WORLD, *scene, trainer));
  PetscCall(HycoTrainerSetFromOptions(*trainer));
  PetscCall(HycoTrainerSetSnapshotFolder(*trainer, w->out->folder));
  if (!calibrate) PetscCall(HycoTrainerSetTrustFolds(*trainer, 0));
  PetscCall(HycoTrainerRun(*trainer, w->training, path, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Trains one recipe and judges it; one that gives no useful model is an attempt that failed. Collective. */
static PetscErrorCode Try(Work *w, Attempt *a)
{
  HycoScene scene = NULL;
  HycoTrainer trainer = NULL;
  HycoModel model = NULL;
  PetscErrorCode ierr;
  char file[HYCO_FILE_NAME], message[HYCO_LINE];
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(HycoFileScratch(PETSC_COMM_WORLD, w->out->model, "attempt", file));
  PetscCall(SetOptions(w, a));
  PetscCall(HycoCatchBegin());
  ierr = TrainOnce(w, file, PETSC_FALSE, &scene, &trainer, &a->t);
  PetscCall(HycoCatchEnd(ierr, message));
  PetscCall(HycoCatchNoModel(ierr, message));
  if (!message[0]) {
    HycoOnEach(PETSC_COMM_WORLD, HycoModelLoad(file, &model));
    PetscCall(HycoModelValidate(PETSC_COMM_WORLD, model, w->store, w->validation, &a->v));
  }
  PetscCall(PetscStrncpy(a->failure, message, sizeof(a->failure)));
  for (char *c = a->failure; *c; c++) {
    if (*c == '"') *c = '\''; /* it will stand between quotes */
  }
  if (rank == 0) (void)unlink(file);
  PetscCall(HycoModelDestroy(&model));
  PetscCall(HycoTrainerDestroy(&trainer));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next attempt in line, tried, said and written; its worst error over the target (infinite: no model). */
static PetscErrorCode Next(Work *w, const char type[], const char tolerance[], const char layers[],
                           const char extension[], PetscReal *ratio)
{
  Search *s = w->out;
  const char *const value[N_SEARCHED] = {type, tolerance, layers, extension};
  Attempt *a;
  PetscInt worst;

  PetscFunctionBegin;
  PetscCheck(s->n < MAX_ATTEMPTS, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "the search has no end");
  a = &s->attempt[s->n];
  a->number = ++s->n;
  for (PetscInt k = 0; k < N_SEARCHED; k++) PetscCall(PetscStrncpy(a->option[k], value[k], sizeof(a->option[k])));
  PetscCall(Try(w, a));
  PetscCall(SayAttempt(s, a));
  PetscCall(WriteTable(s));
  *ratio = Ratio(s, a, &worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A condensed model that its points, scene or contacts forbid: no tolerance gives one. */
static PetscBool Forbidden(const Search *s)
{
  const Attempt *last = &s->attempt[s->n - 1];

  return (PetscBool)(last->failure[0] && strcmp(last->option[TYPE], HycoModelTypes[HYCO_MODEL_CONDENSED]) == 0);
}

/* The tolerances before number `most`, loosest first, until one meets (*most becomes its number) or the errors have
   grown twice in a row: more modes on a fixed RID do harm. */
static PetscErrorCode Tighten(Work *w, const char type[], const char layers[], const char extension[], PetscInt *most)
{
  char given[64];
  PetscReal ratio = PETSC_INFINITY, last = PETSC_INFINITY;
  PetscInt worse = 0;

  PetscFunctionBegin;
  if (w->pinned[TOLERANCE]) {
    PetscCall(PetscOptionsGetString(NULL, NULL, searched[TOLERANCE], given, sizeof(given), NULL));
    if (*most) PetscCall(Next(w, type, given, layers, extension, &ratio));
    if (ratio <= 1) *most = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < *most && worse < 2; k++) {
    PetscCall(Next(w, type, tolerances[k], layers, extension, &ratio));
    worse = ratio >= last ? worse + 1 : 0;
    last = ratio;
    if (ratio <= 1) *most = k;
    if (Forbidden(w->out)) break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The hybrid model's RIDs, from small to large: layers, and where the scene extends the contact, less and more of it.
 */
static PetscErrorCode SearchHybrid(Work *w, const char type[])
{
  PetscInt most = N_TOLERANCES, last = MOST_LAYERS;
  PetscReal extension = 0;
  PetscOptions options;
  char layers[64] = "", reach[64] = "";

  PetscFunctionBegin;
  PetscCall(HycoSceneGetOptions(w->scene, &options));
  PetscCall(HycoOptionsReal(options, "hyco_rid_contact_extension", 0, PETSC_MAX_REAL, &extension));
  if (w->pinned[LAYERS]) last = 0;
  for (PetscInt n = 0; n <= last; n++) {
    if (w->pinned[LAYERS])
      PetscCall(PetscOptionsGetString(NULL, NULL, searched[LAYERS], layers, sizeof(layers), NULL));
    else
      PetscCall(PetscSNPrintf(layers, sizeof(layers), "%d", (int)n));
    for (PetscInt k = 0; k < 2; k++) {
      if ((w->pinned[EXTENSION] || !(extension > 0)) && k == 0) continue;
      if (extension > 0) snprintf(reach, sizeof(reach), "%g", (double)(k * extension));
      PetscCall(Tighten(w, type, layers, reach, &most));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SearchTypes(Work *w)
{
  char given[64] = "";

  PetscFunctionBegin;
  if (w->pinned[TYPE]) PetscCall(PetscOptionsGetString(NULL, NULL, searched[TYPE], given, sizeof(given), NULL));
  for (PetscInt k = 0; HycoModelTypes[k]; k++) {
    PetscInt most = N_TOLERANCES;

    if (given[0] && strcasecmp(given, HycoModelTypes[k])) continue;
    if (k == HYCO_MODEL_HYBRID)
      PetscCall(SearchHybrid(w, HycoModelTypes[k]));
    else
      PetscCall(Tighten(w, HycoModelTypes[k], "", "", &most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cheapest online of those that meet; of times within a twentieth the earlier; fails, with the best, if none does.
 */
static PetscErrorCode Choose(Search *s)
{
  const Attempt *nearest = NULL, *chosen = NULL;
  char what[DRIVER_LINE] = "", errors[DRIVER_LINE] = "";
  PetscInt worst;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    const Attempt *a = &s->attempt[k];
    const PetscReal ratio = Ratio(s, a, &worst);

    if (ratio <= 1 && (!chosen || a->v.seconds < 0.95 * chosen->v.seconds)) chosen = a;
    if (!a->failure[0] && (!nearest || ratio < Ratio(s, nearest, &worst))) nearest = a;
  }
  s->chosen = chosen;
  if (chosen) PetscFunctionReturn(PETSC_SUCCESS);
  if (!nearest) HycoFail("none of the %d attempts gave a model; the last: %s", (int)s->n, s->attempt[s->n - 1].failure);
  Describe(nearest, what);
  DescribeErrors(s, nearest, errors);
  HycoFail(
      "none of the %d attempts meets the targets, and no model was written; attempt %d (%s) comes nearest: %s. Give "
      "more training points, or loosen the target%s",
      (int)s->n, (int)nearest->number, what, errors, s->table[0] ? "; the table has all attempts" : "");
}

/* What view shows of the search. */
static PetscErrorCode Note(const Search *s)
{
  char text[3 * DRIVER_LINE], what[DRIVER_LINE];
  size_t at;

  PetscFunctionBegin;
  Describe(s->chosen, what);
  at = (size_t)snprintf(text, sizeof(text), "  chosen by its errors on %d held-out solutions, of %d attempts: %s\n",
                        (int)s->chosen->v.n, (int)s->n, what);
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    at += (size_t)snprintf(text + at, sizeof(text) - at, "    %-10s mean %.2e, largest %.2e", HycoErrorKinds[j],
                           (double)s->chosen->v.mean[j], (double)s->chosen->v.largest[j]);
    if (s->target[j] > 0) at += (size_t)snprintf(text + at, sizeof(text) - at, ", target %.2e", (double)s->target[j]);
    at += (size_t)snprintf(text + at, sizeof(text) - at, "\n");
  }
  snprintf(text + at, sizeof(text) - at, "    online: %.3g ms\n", 1e3 * (double)s->chosen->v.seconds);
  PetscCall(HycoModelNote(s->model, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No point is in both sets. */
static PetscErrorCode CheckApart(HycoSamples training, HycoSamples validation)
{
  PetscInt n, m, n_par;
  const PetscReal *a, *b;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(training, &n, &n_par, &a));
  PetscCall(HycoSamplesGet(validation, &m, NULL, &b));
  HycoCheck(n > 0 && m > 0,
            "%d points leave %d to train on and %d to validate by: give more, or -validation_grid N,N,... beside them",
            (int)(n + m), (int)n, (int)m);
  for (PetscInt k = 0; k < m; k++) {
    for (PetscInt j = 0; j < n; j++) {
      PetscCall(PetscArraycmp(a + j * n_par, b + k * n_par, n_par, &same));
      HycoCheck(!same, "validation point number %d is a training point too; a model is judged by others", (int)k + 1);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All solutions, those to learn from and those to judge by. */
static PetscErrorCode FillStore(Work *w, HycoSamples samples, HycoSamples validation)
{
  char word[] = "snapshots:";

  PetscFunctionBegin;
  if (validation) {
    PetscInt n, n_par;
    const PetscReal *mu;

    PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
    PetscCall(HycoSamplesCreate(w->scene, &w->training));
    for (PetscInt k = 0; k < n; k++) PetscCall(HycoSamplesAddPoint(w->training, mu + k * n_par));
    w->validation = validation;
  } else
    PetscCall(HycoSamplesHoldOut(samples, 4, 2, &w->training, &w->validation));
  PetscCall(CheckApart(w->training, w->validation));
  PetscCall(HycoSnapshotsOpen(PETSC_COMM_WORLD, w->scene, w->out->folder, &w->store));
  PetscCall(HycoSnapshotsFill(w->store, w->training, DriverProgress, word));
  PetscCall(HycoSnapshotsFill(w->store, w->validation, DriverProgress, word));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverTrainForTargets(Search *s, HycoScene scene, HycoSamples samples, HycoSamples validation,
                                     HycoTraining *t)
{
  const PetscReal begin = HycoNow();
  Work w = {0};
  HycoScene mine = NULL;
  HycoTrainer trainer = NULL;
  PetscOptions options;

  PetscFunctionBegin;
  w.scene = scene;
  w.out = s;
  PetscCall(PetscSNPrintf(s->folder, sizeof(s->folder), "%s.snapshots", s->model));
  PetscCall(HycoSceneGetOptions(scene, &options));
  PetscCall(PetscOptionsGetString(options, NULL, "-hyco_snapshots", s->folder, sizeof(s->folder), NULL));
  for (PetscInt k = 0; k < N_SEARCHED; k++) PetscCall(PetscOptionsHasName(NULL, NULL, searched[k], &w.pinned[k]));
  PetscCall(PetscCalloc1(MAX_ATTEMPTS, &s->attempt));
  PetscCall(FillStore(&w, samples, validation));
  s->seconds_solutions = HycoNow() - begin;
  PetscCall(SearchTypes(&w));
  PetscCall(Choose(s));
  PetscCall(SetOptions(&w, s->chosen));
  PetscCall(TrainOnce(&w, s->model, PETSC_TRUE, &mine, &trainer, t));
  HycoOnRoot(PETSC_COMM_WORLD, Note(s));
  s->seconds_attempts = HycoNow() - begin - s->seconds_solutions;
  PetscCall(Say("chosen: attempt %d of %d; seconds of the search: %.2f solutions, %.2f attempts\n",
                (int)s->chosen->number, (int)s->n, (double)s->seconds_solutions, (double)s->seconds_attempts));
  PetscCall(HycoTrainerDestroy(&trainer));
  PetscCall(HycoSceneDestroy(&mine));
  PetscCall(HycoSnapshotsDestroy(&w.store));
  PetscCall(HycoSamplesDestroy(&w.training));
  PetscCall(HycoSamplesDestroy(&w.validation));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverReportTargets(cJSON *json, const Search *s)
{
  cJSON *search = cJSON_AddObjectToObject(json, "search"), *errors, *seconds;

  cJSON_AddNumberToObject(search, "attempts", s->n);
  cJSON_AddNumberToObject(search, "chosen", s->chosen->number);
  for (PetscInt k = 0; k < N_SEARCHED; k++) cJSON_AddStringToObject(search, searched[k] + 6, s->chosen->option[k]);
  cJSON_AddNumberToObject(search, "validation_points", s->chosen->v.n);
  cJSON_AddNumberToObject(search, "online_seconds", s->chosen->v.seconds);
  seconds = cJSON_AddObjectToObject(search, "seconds");
  cJSON_AddNumberToObject(seconds, "solutions", s->seconds_solutions);
  cJSON_AddNumberToObject(seconds, "attempts", s->seconds_attempts);
  cJSON_AddNumberToObject(seconds, "total", s->seconds_solutions + s->seconds_attempts);
  errors = cJSON_AddObjectToObject(search, "largest_errors");
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++)
    cJSON_AddNumberToObject(errors, HycoErrorKinds[j], s->chosen->v.largest[j]);
}
