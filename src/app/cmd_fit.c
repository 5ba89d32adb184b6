/*
  hyco fit: the parameter values at which a model's outputs are closest to targets, HycoROMFit(); the answer is solved
  once at full order.
*/
#include "driver.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MOST 64 /* parameters */
/* Misfit above which a fit says that its targets are not met: relative to the targets, as a target is known to three
   digits. */
#define UNMET 1e-3

typedef struct {
  HycoROM model;
  HycoScene scene;          /* the model's */
  PetscInt n, n_par, n_all; /* targets, parameters, outputs */
  PetscBool paths;
  PetscInt output[HYCO_MAX_QUANTITIES]; /* by target: its output, or n_all + that of its path's extreme */
  PetscReal target[HYCO_MAX_QUANTITIES];
  const PetscReal *lo, *hi;
  HycoFit fit;
  PetscReal mu[MOST], value[HYCO_MAX_QUANTITIES]; /* the answer, the outputs there */
} Fit;

/* -- options -- */

/* -fit_type, -fit_starts, -starts, whether -mu gives the start, and -hold_NAME (NaN: the parameter is free). */
typedef struct {
  PetscInt type, samples, starts;
  PetscBool given;
  PetscReal mu[MOST], held[MOST];
} Settings;
static const char *const types[] = {"brgn", "blmvm", NULL};

/* Also called by DeclareFit(), so that help shows these texts and defaults. */
static PetscErrorCode ReadSettings(Settings *s)
{
  *s = (Settings){.samples = 64, .starts = 1};

  PetscFunctionBegin;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(
      HycoOptionsWord("-fit_type",
                      "TAO type of the fit: regularised Gauss-Newton steps within the ranges, or a limited-memory "
                      "quasi-Newton method",
                      types, &s->type, NULL));
  PetscCall(HycoOptionsInt("-fit_starts", "predictions over the ranges, the best of which are starts without -mu", 1,
                           1000000, &s->samples, NULL));
  PetscCall(HycoOptionsInt("-starts", "fits from so many of them; the least misfit is the answer", 1, 1000, &s->starts,
                           NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An empty meaning: the option is declared once, as target_, in DeclareFit(). */
static PetscErrorCode ReadTarget(Fit *f, PetscInt output, const char name[])
{
  char key[DRIVER_LINE], text[PETSC_MAX_PATH_LEN], *end;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(key, sizeof(key), "target_%s", name));
  PetscCall(DriverGet(key, "", text));
  /* Outputs without a target are free. */
  if (!text[0]) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(f->n < HYCO_MAX_QUANTITIES, "-%s is one target too many; give at most %d", key, HYCO_MAX_QUANTITIES);
  /* Infinite targets would pass strtod(); no misfit could reach them. */
  f->target[f->n] = strtod(text, &end);
  HycoCheck(end != text && !*end && !PetscIsInfOrNanReal(f->target[f->n]), "-%s is \"%s\"; a number is expected", key,
            text);
  f->output[f->n++] = output;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses -target_foo if foo is no output; after the others are read. */
static PetscErrorCode CheckTargets(const char list[])
{
  char **keys, **values, bad[DRIVER_LINE] = "";
  PetscInt left;

  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(NULL, &left, &keys, &values));
  for (PetscInt k = 0; k < left; k++) {
    /* Those left over: ReadTarget() has read the ones of the model's outputs. */
    if (strncasecmp(keys[k], "target_", 7) == 0) PetscCall(PetscStrncpy(bad, keys[k], sizeof(bad)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &left, &keys, &values));
  HycoCheck(!bad[0], "-%s does not name an output; the model's outputs are: %s", bad, list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -target_OUTPUT for the outputs of the model. Names with errors are found last, when all right ones have been read. */
static PetscErrorCode ReadTargets(Fit *f)
{
  const char *names[HYCO_MAX_QUANTITIES];
  char list[HYCO_LINE] = "";
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  for (PetscInt q = 0; q < n; q++) {
    char path[DRIVER_LINE];

    PetscCall(ReadTarget(f, q, names[q]));
    PetscCall(HycoListAdd(list, ", ", names[q]));
    if (!f->paths) continue;
    PetscCall(PetscSNPrintf(path, sizeof(path), "path_%s", names[q]));
    PetscCall(ReadTarget(f, n + q, path));
  }
  /* All outputs may be targets twice for a path: at its last time, and over its times. */
  f->n_all = n;
  HycoCheck(n, "the model has no outputs to fit; train it on a scene with an entry output");
  PetscCall(CheckTargets(list));
  HycoCheck(f->n, "give -target_OUTPUT V for one of the model's outputs or more, which are: %s", list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the fit, the same on each rank -- */

/* The prediction at the answer is the model's last. */
static PetscErrorCode FitCommandRun(Fit *f, const Settings *s)
{
  HycoPrediction at;

  PetscFunctionBegin;
  PetscCall(HycoROMFit(f->model, f->n, f->output, f->target, s->given ? s->mu : NULL, s->held, s->samples, s->starts,
                       types[s->type], f->mu, &f->fit));
  PetscCall(HycoROMGetPrediction(f->model, &at));
  for (PetscInt k = 0; k < f->n; k++)
    f->value[k] = f->output[k] < f->n_all ? at.quantity[f->output[k]] : at.path_quantity[f->output[k] - f->n_all];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the answer -- */

/* The scene for the check: the model's, with the outputs that have targets. Collective. The full-order scene may
   have other outputs, in another order: at[] maps those with targets. */
static PetscErrorCode LoadScene(const Fit *f, const char path[], HycoScene *scene, PetscInt at[])
{
  const char *names[HYCO_MAX_QUANTITIES];
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, scene));
  PetscCall(DriverCheckMesh(*scene));
  /* The full-order solution would otherwise answer for another scene. */
  PetscCall(HycoROMCheckScene(f->model, *scene));
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  HycoSceneMatchQuantities(f->scene, *scene, at);
  for (PetscInt k = 0; k < f->n; k++)
    HycoCheck(at[f->output[k] % n] >= 0,
              "the scene has no output %s as the model has it; give its entries, as in training",
              names[f->output[k] % n]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One full-order solve at the answer: full[k], the outputs with targets. Collective. Fails before anything is
   written: an answer that full order cannot confirm is none. */
static PetscErrorCode FitCommandCheck(const Fit *f, HycoScene scene, const PetscInt at[], const PetscReal mu[],
                                      PetscReal full[])
{
  HycoFOM fom;
  HycoSummary summary;
  HycoHistory history;

  PetscFunctionBegin;
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, f->n_par, mu));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  HycoCheck(summary.reason > 0, "full order at the answer: %s; nothing was written", summary.why);
  PetscCall(HycoFOMGetHistory(fom, &history));
  for (PetscInt k = 0; k < f->n; k++)
    full[k] = f->output[k] < f->n_all ? summary.quantity[at[f->output[k]]]
                                      : history.path_quantity[at[f->output[k] - f->n_all]];
  PetscCall(HycoFOMDestroy(&fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The root mean square of the relative differences from the targets. */
static PetscReal FitCommandMean(const Fit *f, const PetscReal value[])
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < f->n; k++) sum += PetscSqr((value[k] - f->target[k]) / f->fit.scale[k]);
  return PetscSqrtReal(sum / (PetscReal)f->n);
}

/* full: the outputs of the full-order solve at the answer, or NULL without -scene. f->output counts the outputs at
   the last time first, then those over the path, hence the remainder. */
static PetscErrorCode PrintAnswer(const Fit *f, const PetscReal full[], cJSON *json)
{
  const char *names[HYCO_MAX_QUANTITIES], *units[HYCO_MAX_QUANTITIES];
  char words[DRIVER_LINE];
  const PetscReal *value = f->value;
  PetscInt n;
  cJSON *targets = cJSON_AddObjectToObject(json, "targets");

  PetscFunctionBegin;
  PetscCall(DriverFormatPoint(f->scene, f->mu, words, NULL));
  PetscCall(DriverPrint("found: %s\n", words));
  PetscCall(HycoSceneGetQuantities(f->scene, &n, names));
  PetscCall(HycoSceneGetQuantityUnits(f->scene, &n, units));
  for (PetscInt k = 0; k < f->n; k++) {
    char name[DRIVER_LINE];
    cJSON *of;

    PetscCall(PetscSNPrintf(name, sizeof(name), "%s%s", f->output[k] < n ? "" : "path_", names[f->output[k] % n]));
    of = cJSON_AddObjectToObject(targets, name);
    ReportNumbers(of, {"target", f->target[k]}, {"model", value[k]});
    PetscCall(DriverPrint("%s: target %.6g, model %.6g", name, (double)f->target[k], (double)value[k]));
    if (full) cJSON_AddNumberToObject(of, "full_order", full[k]);
    if (full) PetscCall(DriverPrint(", full order %.6g", (double)full[k]));
    PetscCall(DriverPrint("%s%s\n", units[f->output[k] % n][0] ? " " : "", units[f->output[k] % n]));
  }
  /* By the scales of the fit, so that outputs of different units weigh the same. */
  cJSON_AddNumberToObject(json, "misfit_model", FitCommandMean(f, value));
  PetscCall(DriverPrint("misfit (relative, root mean square): model %.2g", (double)FitCommandMean(f, value)));
  if (full) cJSON_AddNumberToObject(json, "misfit_full_order", FitCommandMean(f, full));
  if (full)
    PetscCall(DriverPrint(", full order %.2g\n", (double)FitCommandMean(f, full)));
  else
    PetscCall(DriverPrint("; not checked at full order, for which -scene is needed\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A fit that ended at no minimum is a miss (exit status 3), with its report written. */
static PetscErrorCode FitCommandReport(const Fit *f, const PetscReal held[], const PetscReal full[])
{
  const HycoFit *fit = &f->fit;
  const PetscReal *mu = f->mu;
  const char *const *names;
  cJSON *json, *ends, *kept;

  PetscFunctionBegin;
  PetscCall(ReportCreate("fit", f->scene, mu, &json));
  PetscCall(PrintAnswer(f, full, json));
  cJSON_AddNumberToObject(json, "evaluations", fit->evaluations);
  cJSON_AddStringToObject(json, "solver", fit->method);
  cJSON_AddBoolToObject(json, "converged", fit->converged);
  cJSON_AddBoolToObject(json, "kink", fit->kink);
  ReportNumbers(json, {"starts", (PetscReal)fit->n_starts}, {"starts_at_least", (PetscReal)fit->n_least},
                {"free", (PetscReal)fit->n_free}, {"determined", (PetscReal)fit->n_determined});
  ends = cJSON_AddArrayToObject(json, "at_ends");
  kept = cJSON_AddArrayToObject(json, "held");
  PetscCall(HycoSceneGetParameters(f->scene, NULL, &names, NULL, NULL));
  for (PetscInt p = 0; p < f->n_par; p++) {
    if (!PetscIsNanReal(held[p])) {
      cJSON_AddItemToArray(kept, cJSON_CreateString(names[p]));
      continue;
    }
    /* An answer at an end may lie beyond the range: the user must know. */
    if (mu[p] > f->lo[p] && mu[p] < f->hi[p]) continue;
    cJSON_AddItemToArray(ends, cJSON_CreateString(names[p]));
    PetscCall(DriverPrint("%s is at the end of its range\n", names[p]));
  }
  PetscCall(DriverPrint("%d predictions, with gradients (%s)\n", (int)fit->evaluations, fit->method));
  if (fit->n_starts > 1)
    PetscCall(DriverPrint("%d of %d starts ended at the least misfit\n", (int)fit->n_least, (int)fit->n_starts));
  if (fit->n_determined < fit->n_free)
    PetscCall(
        DriverPrint("NOT UNIQUE: %d parameters are free, and the targets determine %d of them or of their "
                    "combinations: the answer is one of many; hold parameters (-hold_NAME) or give more targets\n",
                    (int)fit->n_free, (int)fit->n_determined));
  /* Converged to a minimum that does not meet the targets: they may be out of reach, or another valley is. */
  if (fit->converged && fit->misfit > UNMET)
    PetscCall(DriverPrint("the targets are not met; the misfit may have lower minima elsewhere: other starts (-mu, "
                          "-starts, -fit_starts) may find them\n"));
  /* At a kink, where a contact opens or closes, the slope jumps, and Newton's steps cannot end there. */
  if (!fit->converged)
    PetscCall(DriverMissed("the fit ended%s, where the misfit %.2g is no minimum by its slope; start elsewhere (-mu, "
                           "-starts, -fit_starts)",
                           fit->kink ? " at a kink" : "", (double)fit->misfit));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -mu or -mu_NAME as the start, and what is held. Without -mu the start is searched; DriverGetPoint() would require all
   parameters. */
static PetscErrorCode ReadStart(const Fit *f, Settings *s)
{
  const char *const *names;
  char key[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(f->scene, NULL, &names, NULL, NULL));
  /* Only whether: DriverGetPoint() then reads and checks them. */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-mu", &s->given));
  for (PetscInt p = 0; p < f->n_par && !s->given; p++) {
    PetscCall(PetscSNPrintf(key, sizeof(key), "-mu_%s", names[p]));
    PetscCall(PetscOptionsHasName(NULL, NULL, key, &s->given));
  }
  PetscCall(DriverGetHeld(f->scene, s->held));
  if (s->given) PetscCall(DriverGetPoint(f->scene, s->held, s->mu));
  for (PetscInt p = 0; p < f->n_par && s->given; p++)
    HycoCheck(PetscIsNanReal(s->held[p]) || s->held[p] == s->mu[p],
              "-mu starts %s at %.10g, and -hold_%s keeps it at %.10g; give both the same value", names[p],
              (double)s->mu[p], names[p], (double)s->held[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The answer is that of rank 0: others may differ in the last bits. Collective. */
static PetscErrorCode RunOnEach(Fit *f, const Settings *s)
{
  PetscFunctionBegin;
  HycoOnEach(PETSC_COMM_WORLD, FitCommandRun(f, s));
  PetscCallMPI(MPI_Bcast(f->mu, MOST, MPIU_REAL, 0, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Bcast(&f->fit.converged, 1, HYCO_MPI_BOOL, 0, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareFit(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  Settings s;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, path, NULL));
  PetscCall(DriverGetPoint(NULL, NULL, NULL));
  PetscCall(DriverGetHeld(NULL, NULL));
  PetscCall(DriverGet("target_",
                      "<v> value that an output of the model should have: -target_OUTPUT v; of a path at its last "
                      "time, -target_path_OUTPUT v "
                      "for the largest over its listed times",
                      path));
  PetscCall(ReadSettings(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene, if given, is loaded and checked before the fit, so that a mismatch is not found only after it. */
PetscErrorCode CommandFit(void)
{
  Fit f = {0};
  Settings s;
  PetscReal full[HYCO_MAX_QUANTITIES];
  PetscInt at[HYCO_MAX_QUANTITIES];
  HycoScene scene = NULL;
  PetscInt n_times;
  char own[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(own, path, NULL, report, NULL));
  PetscCall(DriverRequire("model", path));
  PetscCall(ReadSettings(&s));
  HycoOnEach(PETSC_COMM_WORLD, HycoROMLoad(path, &f.model));
  PetscCall(HycoROMGetScene(f.model, &f.scene));
  PetscCall(HycoSceneGetParameters(f.scene, &f.n_par, NULL, &f.lo, &f.hi));
  PetscCall(HycoSceneGetHistory(f.scene, &n_times, NULL));
  f.paths = (PetscBool)(n_times > 0);
  PetscCall(ReadTargets(&f));
  PetscCall(ReadStart(&f, &s));
  if (own[0]) PetscCall(LoadScene(&f, own, &scene, at));
  /* The model alone would ignore settings of full order in silence. */
  else
    PetscCall(DriverRefuseOnly("full order", "it is for full order, which fit solves only with -scene"));
  PetscCall(DriverCheckLeftEarly());
  HycoStaged(HYCO_STAGE_ONLINE, RunOnEach(&f, &s));
  if (scene) HycoStaged(HYCO_STAGE_FULL_ORDER, FitCommandCheck(&f, scene, at, f.mu, full));
  /* Last, since it may end in a miss: the answer is complete by then. */
  PetscCall(FitCommandReport(&f, s.held, scene ? full : NULL));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(HycoROMDestroy(&f.model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
