/* Options of the command line: checked, read, explained. */
#include "driver.h"
#include <hycofields.h>
#include <hycofile.h>
#include <hycoh5.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The driver's own options, for -help; which command takes which stands in the table of commands. */
static const HycoOption own[] = {
    {"scene", "<folder>", "",
     "folder with scene.yaml, or the YAML file; every entry can be overridden: -body_NAME_young 2e5"},
    {"model", "<file.h5>", "", "the reduced model: written by train, read by the others"},
    {"mu", "<v,v,...>", "", "parameter values in declared order; or one by one: -mu_NAME v"},
    {"mu_", "<v>", "", "the parameter NAME: -mu_radius 4.06"},
    {"grid", "<n,n,...>", "", "a set of points: n per parameter"},
    {"grid_type", "<centred|closed|chebyshev>", "centred",
     "cell centres; with both ends of the ranges; or the roots of Chebyshev polynomials (for a condensed model)"},
    {"values_", "<v,v,...>", "", "a set of points: values of the parameter NAME, all combined"},
    {"points", "<file.csv>", "", "a set of points: a header with the names, then a point per line"},
    {"greedy", "", "", "add solutions where an error indicator is worst, from the corners of the ranges or -grid ..."},
    {"training_grid", "<n,n,...>", "",
     "greedy: the grid of points to choose from, closed unless -grid_type says centred"},
    {"target", "<real>", "1e-3", "greedy: stop when the indicator is no larger anywhere on that grid"},
    {"max_snapshots", "<int>", "0", "greedy: stop with so many solutions (0: no limit)"},
    {"max_seconds", "<real>", "0", "greedy: stop after the iteration in which this has passed (0: no limit)"},
    {"extrapolate", "", "", "predict outside the trained ranges too, where nothing has tested the model"},
    {"target_u", "<real>", "",
     "train: choose the cheapest model whose errors on held-out solutions are no larger; predict -hyco_fallback: solve "
     "full order where the estimated error is"},
    {"target_u_rid", "<real>", "", "train: the same for the displacement over the RID, max norm"},
    {"target_sigma", "<real>", "", "train: the same for the stress over the RID"},
    {"target_sigma_11", "<real>", "", "train: the same for its first component, max norm"},
    {"target_lambda", "<real>", "", "train, predict: the same for all contact forces"},
    {"target_lambda_rid", "<real>", "", "train: the same for the RID's own contact forces"},
    {"target_max_added", "<int>", "",
     "train -target_...: at most so many solutions are added to meet the targets (default: as many as were given)"},
    {"validation_grid", "<n,n,...>", "",
     "train: the solutions to judge the model by, closed unless -grid_type says centred (else they are drawn: "
     "-hyco_validation)"},
    {"validation_points", "<file.csv>", "", "the same, as a file of points"},
    {"output", "<file.xdmf>", "", "fields for ParaView; the numbers in the .h5 beside it"},
    {"report", "<file.json>", "", "the result as one JSON object"},
    {"table", "<file.csv>", "", "a line per point"},
    {"hyco_monitor", "", "", "a line per iteration of the active set"},
};

/* Options of PETSc, SLEPc and the solvers inside: known by their beginnings, checked by who reads them. */
static const char *const foreign[] = {"hyco_mumps_",
                                      "hyco_primal_",
                                      "hyco_norm_",
                                      "hyco_tao_",
                                      "log_",
                                      "info",
                                      "malloc",
                                      "memory_view",
                                      "options_",
                                      "mat_",
                                      "vec_",
                                      "ksp_",
                                      "pc_",
                                      "bv_",
                                      "svd_",
                                      "st_",
                                      "ds_",
                                      "tao_",
                                      "on_error_",
                                      "start_in_debugger",
                                      "stop_for_debugger",
                                      "fp_trap",
                                      "error_output",
                                      "check_pointer",
                                      "nox",
                                      "viewer_",
                                      "citations",
                                      "use_gpu",
                                      "skip_petscrc",
                                      "no_signal",
                                      "petsc_",
                                      "device_",
                                      NULL};

static PetscBool TakesOption(const Command *command, const char name[])
{
  const char *at = command->options;
  size_t n = strlen(name);

  for (; *at; at += strcspn(at, " ") + (at[strcspn(at, " ")] == ' ')) {
    const size_t length = strcspn(at, " ");

    if (at[length - 1] == '_' ? n > length && strncasecmp(at, name, length) == 0
                              : n == length && strncasecmp(at, name, length) == 0)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscBool IsForeign(const char name[])
{
  for (PetscInt k = 0; foreign[k]; k++) {
    if (strncasecmp(name, foreign[k], strlen(foreign[k])) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscBool IsSceneEntry(const char name[])
{
  static const char *const begin[] = {"scene_",    "parameter_", "body_",    "fixed_", "pressure_",
                                      "traction_", "force_",     "contact_", NULL};

  for (PetscInt k = 0; begin[k]; k++) {
    if (strncasecmp(name, begin[k], strlen(begin[k])) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The commands that take an option which this one does not: "solve, predict"; "" if none does. */
static void ListTakers(const char name[], char list[DRIVER_LINE])
{
  size_t at = 0;

  list[0] = '\0';
  for (PetscInt c = 0; commands[c].name; c++) {
    if (TakesOption(&commands[c], name))
      at += (size_t)snprintf(list + at, DRIVER_LINE - at, "%s%s", at ? ", " : "", commands[c].name);
  }
}

static PetscErrorCode Unknown(const Command *command, const char name[])
{
  const HycoOption *table;
  PetscInt n, m = 0;
  const char *names[96], *near;
  char copy[DRIVER_LINE], takers[DRIVER_LINE], *rest;

  PetscFunctionBegin;
  HycoCheck(strncasecmp(name, "hyco_", 5) || strcasecmp(name + 5, "trust_folds"),
            "hyco %s knows no option -%s: it is now -hyco_validation, the number of held-out points that the estimates "
            "of errors are "
            "calibrated on",
            command->name, name);
  ListTakers(name, takers);
  HycoCheck(!takers[0], "hyco %s knows no option -%s; what does: hyco %s", command->name, name, takers);
  PetscCall(HycoGetOptionTable(&n, &table));
  for (PetscInt k = 0; k < n && m < 64; k++) names[m++] = table[k].name;
  PetscCall(PetscStrncpy(copy, command->options, sizeof(copy)));
  for (char *word = strtok_r(copy, " ", &rest); word && m < 96; word = strtok_r(NULL, " ", &rest)) names[m++] = word;
  near = NULL;
  for (PetscInt k = 0; k < m && !near; k++) {
    if (strncasecmp(names[k], name, strlen(name)) == 0) near = names[k]; /* the beginning of one */
  }
  if (!near) near = HycoNearest(name, m, names);
  if (near)
    HycoFail("hyco %s knows no option -%s; did you mean -%s%s? (hyco %s -help lists them)", command->name, name, near,
             near[strlen(near) - 1] == '_' ? "NAME" : "", command->name);
  HycoFail("hyco %s knows no option -%s (hyco %s -help lists them)", command->name, name, command->name);
}

/* Whether an option decides a model when that is trained. */
static PetscBool DecidesModel(const char name[])
{
  static const char *const training[] = {
      "hyco_model_type", "hyco_dual",    "hyco_nnmf_",      "hyco_pod_",          "hyco_deim_",
      "hyco_rid_",       "hyco_hybrid",  "hyco_scan",       "hyco_keep_singular", "hyco_condensed_",
      "hyco_snapshots",  "hyco_greedy_", "hyco_validation", "hyco_search",        NULL};

  for (PetscInt k = 0; training[k]; k++) {
    if (strncasecmp(name, training[k], strlen(training[k])) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Which commands read an option of a model's use; NULL: it is no such option. */
static const char *ReadersOf(const char name[])
{
  if (strcasecmp(name, "hyco_fallback") == 0 || strcasecmp(name, "hyco_full_displacement") == 0) return "predict";
  if (strncasecmp(name, "hyco_reconstruct", 16) == 0) return "train, predict, compare";
  return NULL;
}

/* An option of the reduction given where nothing is reduced, or of a model's use where none is used. */
static PetscErrorCode CheckCommand(const Command *command, const char name[])
{
  const char *readers = ReadersOf(name);

  PetscFunctionBegin;
  HycoCheck(command->run == CommandTrain || !DecidesModel(name),
            "hyco %s does not read -%s: it decides a model when that is trained", command->name, name);
  HycoCheck(!readers || strstr(readers, command->name), "hyco %s does not read -%s; what does: hyco %s", command->name,
            name, readers);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool IsKey(const char word[])
{
  return (PetscBool)(word[0] == '-' &&
                     (isalpha((unsigned char)word[1]) || (word[1] == '-' && isalpha((unsigned char)word[2]))));
}

PetscErrorCode DriverCheckArguments(const Command *command, int argc, char **argv)
{
  PetscFunctionBegin;
  for (int k = 2; k < argc; k++) {
    const char *name = argv[k] + (argv[k][1] == '-' ? 2 : 1);

    if (!IsKey(argv[k]))
      HycoFail(
          "\"%s\" is no option; options begin with a dash, and take one value each (values have commas between, and "
          "no space)",
          argv[k]);
    if (!TakesOption(command, name) && !HycoOptionKnown(name) && !IsForeign(name) &&
        !(IsSceneEntry(name) && TakesOption(command, "scene"))) {
      HycoCheck(k < 3 || !IsKey(argv[k - 1]) || !IsSceneEntry(argv[k - 1] + 1),
                "%s stands where %s expects its value, and reads as an option: a value that begins with a dash and a "
                "letter takes a blank first, %s \" %s\", or stands in scene.yaml",
                argv[k], argv[k - 1], argv[k - 1], argv[k]);
      PetscCall(Unknown(command, name));
    }
    PetscCall(CheckCommand(command, name));
    if (k + 1 < argc && !IsKey(argv[k + 1])) k++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The value of an option, "" if absent, without counting it as read. */
static PetscErrorCode Peek(const char name[], char value[PETSC_MAX_PATH_LEN])
{
  PetscInt n;
  char **names, **values;

  PetscFunctionBegin;
  value[0] = '\0';
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt k = 0; k < n; k++) {
    if (strcasecmp(names[k], name) == 0 && values[k]) PetscCall(PetscStrncpy(value, values[k], PETSC_MAX_PATH_LEN));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file that the command line names, or the scene. */
typedef struct {
  const char *what; /* "-report" */
  char path[PETSC_MAX_PATH_LEN];
  HycoFileIdentity identity;
} Named;

static Named outputs[8];
static PetscInt n_outputs;

static PetscErrorCode Identify(const char what[], const char path[], Named *named)
{
  PetscFunctionBegin;
  named->what = what;
  PetscCall(PetscStrncpy(named->path, path, sizeof(named->path)));
  HycoFileIdentify(path, &named->identity);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two names of one file, of which one is to be written. */
static PetscErrorCode CheckApart(const Named *a, const Named *b)
{
  PetscFunctionBegin;
  if (!HycoFileSame(&a->identity, &b->identity)) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(strcmp(a->path, b->path), "%s and %s are both %s; give each a file of its own", a->what, b->what, b->path);
  HycoFail("%s %s and %s %s are one file; give each a file of its own", a->what, a->path, b->what, b->path);
}

static PetscErrorCode AddOutput(const char what[], const char path[])
{
  PetscFunctionBegin;
  PetscCall(Identify(what, path, &outputs[n_outputs]));
  for (PetscInt k = 0; k < n_outputs; k++) PetscCall(CheckApart(&outputs[k], &outputs[n_outputs]));
  n_outputs++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInput(const char what[], const char path[])
{
  Named named;

  PetscFunctionBegin;
  if (!path[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Identify(what, path, &named));
  for (PetscInt k = 0; k < n_outputs; k++) PetscCall(CheckApart(&named, &outputs[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -output: the fields, and the numbers beside them. */
static PetscErrorCode AddFields(const char path[])
{
  char h5[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoFieldsCheckPath(path));
  snprintf(h5, sizeof(h5), "%.*s.h5", (int)strlen(path) - 5, path);
  PetscCall(AddOutput("-output", path));
  PetscCall(AddOutput("the numbers of -output", h5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where train keeps its solutions: no file may have that name. */
static PetscErrorCode AddSnapshots(const char model[])
{
  char folder[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(Peek("hyco_snapshots", folder));
  if (!folder[0]) snprintf(folder, sizeof(folder), "%.*s.snapshots", PETSC_MAX_PATH_LEN - 16, model);
  PetscCall(AddOutput("the snapshot folder", folder));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene.yaml of -scene, a folder or the file. */
static PetscErrorCode CheckSceneFile(void)
{
  char path[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN + 16];
  struct stat info;

  PetscFunctionBegin;
  PetscCall(Peek("scene", path));
  snprintf(file, sizeof(file), "%s%s", path, stat(path, &info) == 0 && S_ISDIR(info.st_mode) ? "/scene.yaml" : "");
  PetscCall(CheckInput("-scene", file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const written[] = {"-report", "-table", "-output", NULL};

/* What is written is told from what is read, whatever the names. */
static PetscErrorCode CheckNames(PetscBool trains)
{
  static const char *const read[] = {"-points", "-validation_points"};
  char path[PETSC_MAX_PATH_LEN], model[PETSC_MAX_PATH_LEN], **argv;
  int argc;

  PetscFunctionBegin;
  n_outputs = 0;
  PetscCall(Peek("model", model));
  if (trains && model[0]) PetscCall(AddOutput("-model", model));
  for (PetscInt k = 0; written[k]; k++) {
    PetscCall(Peek(written[k] + 1, path));
    if (path[0]) PetscCall(strcmp(written[k], "-output") ? AddOutput(written[k], path) : AddFields(path));
  }
  if (trains && model[0]) PetscCall(AddSnapshots(model));
  if (!trains) PetscCall(CheckInput("-model", model));
  PetscCall(CheckSceneFile());
  for (size_t k = 0; k < sizeof(read) / sizeof(read[0]); k++) {
    PetscCall(Peek(read[k] + 1, path));
    PetscCall(CheckInput(read[k], path));
  }
  PetscCall(PetscGetArgs(&argc, &argv));
  for (int k = 2; k < argc - 1; k++) { /* PETSc keeps no option of that name */
    if (strncmp(argv[k], "-options_file", 13) == 0) PetscCall(CheckInput(argv[k], argv[k + 1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file can be written at `path`: its folder is there and may be written, or it is a device. */
static PetscErrorCode CheckPlace(const char name[], const char path[], HycoFileKind kind)
{
  char folder[PETSC_MAX_PATH_LEN];
  char *slash;
  PetscBool direct, precious = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoFileCheckPlace(name, path, kind, &direct));
  HycoFileFollow(path, folder);
  slash = strrchr(folder, '/');
  if (slash)
    slash[slash == folder] = '\0';
  else
    PetscCall(PetscStrncpy(folder, ".", sizeof(folder)));
  HycoCheck(direct ? access(path, W_OK) == 0 : access(folder, W_OK | X_OK) == 0,
            "-%s %s cannot be written: is there such a folder, may you write there?", name, path);
  if (!direct && kind == HYCO_FILE_TEXT) PetscCall(HycoH5IsPrecious(path, &precious));
  HycoCheck(!precious, "-%s %s is a model or a snapshot, and stays one; give the %s another name", name, path, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckFiles(PetscBool trains)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(CheckNames(trains));
  PetscCall(Peek("model", path));
  if (trains && path[0]) PetscCall(CheckPlace("model", path, HYCO_FILE_NUMBERS));
  for (PetscInt k = 0; k < n_outputs; k++) PetscCall(HycoFileSweep(outputs[k].path)); /* what killed runs left */
  for (PetscInt k = 0; written[k]; k++) {
    PetscCall(Peek(written[k] + 1, path));
    if (path[0]) PetscCall(CheckPlace(written[k] + 1, path, HYCO_FILE_TEXT));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCheckOutputs(const Command *command)
{
  PetscFunctionBegin;
  HycoOnRoot(PETSC_COMM_WORLD, CheckFiles((PetscBool)(command->run == CommandTrain)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCheckMesh(HycoScene scene)
{
  const char *mesh;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetMesh(scene, &mesh));
  HycoOnRoot(PETSC_COMM_WORLD, CheckInput("the mesh", mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckLeft(PetscBool early, PetscBool tao)
{
  PetscInt n;
  char **names, **values, first[DRIVER_LINE] = "";

  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt k = 0; k < n && !first[0]; k++) {
    if (early && (strncasecmp(names[k], "hyco_mumps_", 11) == 0 || strncasecmp(names[k], "hyco_primal_", 12) == 0 ||
                  strncasecmp(names[k], "hyco_norm_", 10) == 0))
      continue;
    if (tao && strncasecmp(names[k], "hyco_tao_", 9) == 0) continue;
    if (strncmp(names[k], "options_left", 12) && strncmp(names[k], "skip_petscrc", 12) && strcmp(names[k], "nox"))
      PetscCall(PetscStrncpy(first, names[k], sizeof(first)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  HycoCheck(!first[0], "nothing reads the option -%s here; take it away, or see hyco -help", first);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCheckLeft(void)
{
  PetscFunctionBegin;
  PetscCall(CheckLeft(PETSC_FALSE, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCheckLeftEarly(HycoScene scene)
{
  static const char *const types[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE, NULL};
  PetscOptions options;
  PetscInt type = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetOptions(scene, &options));
  PetscCall(HycoOptionsWord(options, "hyco_solver_type", types, &type));
  PetscCall(CheckLeft(PETSC_TRUE, (PetscBool)(type == 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverGet(const char name[], PetscBool required, char value[PETSC_MAX_PATH_LEN])
{
  char dashed[DRIVER_LINE];
  const char *text = NULL;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
  value[0] = '\0';
  PetscCall(PetscOptionsFindPair(NULL, NULL, dashed, &text, &set));
  HycoCheck(!set || !text || strlen(text) < PETSC_MAX_PATH_LEN - 32,
            "-%s is longer than %d characters; put the points in a file: -points FILE.csv", name,
            PETSC_MAX_PATH_LEN - 32);
  if (set && text) PetscCall(PetscStrncpy(value, text, PETSC_MAX_PATH_LEN));
  HycoCheck(!set || value[0], "-%s needs a value", name);
  HycoCheck(set || !required, "-%s is missing (hyco -help explains it)", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers with commas between, into new memory. */
static PetscErrorCode ParseNumbers(const char name[], const char text[], PetscInt *n, PetscReal **values)
{
  const char *at = text;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscMalloc1(strlen(text) / 2 + 2, values));
  for (;;) {
    char *end;

    (*values)[*n] = strtod(at, &end);
    HycoCheck(end != at && (*end == ',' || *end == '\0') && !PetscIsInfOrNanReal((*values)[*n]),
              "-%s is \"%s\"; numbers with commas between are expected", name, text);
    (*n)++;
    if (*end == '\0') break;
    at = end + 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ListNames(HycoScene scene, char list[HYCO_LINE])
{
  PetscInt n;
  const char *const *names;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  list[0] = '\0';
  for (PetscInt p = 0; p < n; p++) PetscCall(HycoListAdd(list, ",", names[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -mu_foo where foo is no parameter. `prefix` is "mu_" or "values_". */
static PetscErrorCode CheckNamed(HycoScene scene, const char prefix[])
{
  PetscInt n, left;
  const char *const *names;
  char **keys, **values, bad[DRIVER_LINE] = "", list[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  PetscCall(PetscOptionsLeftGet(NULL, &left, &keys, &values));
  for (PetscInt k = 0; k < left; k++) {
    PetscBool known = PETSC_FALSE;

    if (strncasecmp(keys[k], prefix, strlen(prefix))) continue;
    for (PetscInt p = 0; p < n; p++) known = (PetscBool)(known || strcasecmp(keys[k] + strlen(prefix), names[p]) == 0);
    if (!known) PetscCall(PetscStrncpy(bad, keys[k], sizeof(bad)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &left, &keys, &values));
  PetscCall(ListNames(scene, list));
  HycoCheck(!bad[0], "-%s names no parameter; the scene's are: %s", bad, list[0] ? list : "(none)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "radius from 4.02 to 4.1, load from 0 to 1" */
static PetscErrorCode ListRanges(HycoScene scene, char list[DRIVER_LINE])
{
  PetscInt n;
  const char *const *names;
  const PetscReal *lo, *hi;
  size_t at = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, &lo, &hi));
  list[0] = '\0';
  for (PetscInt p = 0; p < n && at < DRIVER_LINE; p++)
    at += (size_t)snprintf(list + at, DRIVER_LINE - at, "%s%s from %g to %g", p ? ", " : "", names[p], (double)lo[p],
                           (double)hi[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverGetPoint(HycoScene scene, PetscReal mu[])
{
  PetscInt n, given = 0;
  const char *const *names;
  char text[PETSC_MAX_PATH_LEN], list[DRIVER_LINE], key[DRIVER_LINE];
  PetscBool whole;
  PetscReal *values;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  PetscCall(ListNames(scene, list));
  PetscCall(CheckNamed(scene, "mu_"));
  PetscCall(DriverGet("mu", PETSC_FALSE, text));
  whole = (PetscBool)(text[0] != '\0');
  if (whole) {
    PetscInt m;

    PetscCall(ParseNumbers("mu", text, &m, &values));
    HycoCheck(m == n, "-mu has %d values; the scene has %d parameters: %s", (int)m, (int)n, n ? list : "(none)");
    PetscCall(PetscArraycpy(mu, values, n));
    PetscCall(PetscFree(values));
  }
  for (PetscInt p = 0; p < n; p++) {
    PetscInt m;

    PetscCall(PetscSNPrintf(key, sizeof(key), "mu_%s", names[p]));
    PetscCall(DriverGet(key, PETSC_FALSE, text));
    if (!text[0]) continue;
    PetscCall(ParseNumbers(key, text, &m, &values));
    HycoCheck(m == 1, "-%s has %d values; one is expected", key, (int)m);
    HycoCheck(!whole, "-mu gives every parameter, and -%s gives one of them again; take one of the two away", key);
    mu[p] = values[0];
    given++;
    PetscCall(PetscFree(values));
  }
  PetscCall(ListRanges(scene, list));
  HycoCheck(whole || given == n, "the scene has %d parameters (%s); give -mu with all of them, or -mu_NAME for each",
            (int)n, list);
  PetscCall(HycoSceneCheckParameters(scene, n, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether -word, or a -prefixNAME of a parameter, was given. */
static PetscErrorCode HasNamed(HycoScene scene, const char word[], const char prefix[], PetscBool *given)
{
  PetscInt n;
  const char *const *names;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  PetscCall(PetscOptionsHasName(NULL, NULL, word, given));
  for (PetscInt p = 0; p < n && !*given; p++) {
    char key[DRIVER_LINE];

    PetscCall(PetscSNPrintf(key, sizeof(key), "%s%s", prefix, names[p]));
    PetscCall(PetscOptionsHasName(NULL, NULL, key, given));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverHasPoint(HycoScene scene, PetscBool *given)
{
  PetscFunctionBegin;
  PetscCall(HasNamed(scene, "-mu", "-mu_", given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverHasSamples(HycoScene scene, PetscBool *given)
{
  PetscFunctionBegin;
  PetscCall(HasNamed(scene, "-grid", "-values_", given));
  if (!*given) PetscCall(PetscOptionsHasName(NULL, NULL, "-points", given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The grid that the option `name` gives as `text`; its type unless -grid_type says otherwise: 0 centred, 1 closed, 2
 * Chebyshev. */
static PetscErrorCode AddGrid(HycoScene scene, HycoSamples samples, const char name[], PetscInt type, const char text[])
{
  static const char *const types[] = {"centred", "closed", "chebyshev", NULL};
  PetscInt n, m, counts[64];
  PetscReal *values;
  char list[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(ListNames(scene, list));
  PetscCall(HycoOptionsWord(NULL, "grid_type", types, &type));
  PetscCall(ParseNumbers(name, text, &m, &values));
  HycoCheck(m == n && n > 0, "-%s has %d numbers; the scene has %d parameters: %s", name, (int)m, (int)n,
            n ? list : "(none)");
  for (PetscInt p = 0; p < n; p++) {
    HycoCheck(values[p] >= 1 && values[p] <= 1e8 && values[p] == PetscFloorReal(values[p]),
              "-%s is \"%s\"; whole numbers, at least 1, are expected", name, text);
    counts[p] = (PetscInt)values[p];
  }
  PetscCall(PetscFree(values));
  if (type == 2)
    PetscCall(HycoSamplesAddChebyshev(samples, counts));
  else
    PetscCall(HycoSamplesAddGrid(samples, counts, (PetscBool)(type == 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverGetTrainingGrid(HycoScene scene, HycoSamples *samples)
{
  char text[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverGet("training_grid", PETSC_FALSE, text));
  HycoCheck(text[0], "give a greedy training the points to choose from: -training_grid N,N,...");
  PetscCall(HycoSamplesCreate(scene, samples));
  PetscCall(AddGrid(scene, *samples, "training_grid", 1, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverGetValidation(HycoScene scene, HycoSamples *samples)
{
  char grid[PETSC_MAX_PATH_LEN], points[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  *samples = NULL;
  PetscCall(DriverGet("validation_grid", PETSC_FALSE, grid));
  PetscCall(DriverGet("validation_points", PETSC_FALSE, points));
  HycoCheck(!grid[0] || !points[0], "give one set of points to validate by: -validation_grid or -validation_points");
  if (!grid[0] && !points[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesCreate(scene, samples));
  if (grid[0])
    PetscCall(AddGrid(scene, *samples, "validation_grid", 1, grid));
  else
    PetscCall(HycoSamplesAddFile(*samples, points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -values_NAME for every parameter, combined. */
static PetscErrorCode AddValues(HycoScene scene, HycoSamples samples, PetscBool *any)
{
  PetscInt n, counts[64], given = 0;
  const char *const *names;
  PetscReal *values[64];
  char text[PETSC_MAX_PATH_LEN], key[DRIVER_LINE], missing[DRIVER_LINE] = "";

  PetscFunctionBegin;
  PetscCall(CheckNamed(scene, "values_"));
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  for (PetscInt p = 0; p < n; p++) {
    values[p] = NULL;
    PetscCall(PetscSNPrintf(key, sizeof(key), "values_%s", names[p]));
    PetscCall(DriverGet(key, PETSC_FALSE, text));
    if (text[0]) {
      PetscCall(ParseNumbers(key, text, &counts[p], &values[p]));
      given++;
    } else
      PetscCall(PetscStrncpy(missing, names[p], sizeof(missing)));
  }
  *any = (PetscBool)(given > 0);
  HycoCheck(!given || given == n, "-values_ are given for %d of the %d parameters; -values_%s is missing", (int)given,
            (int)n, missing);
  if (given) PetscCall(HycoSamplesAddProduct(samples, counts, (const PetscReal *const *)values));
  for (PetscInt p = 0; p < n; p++) PetscCall(PetscFree(values[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverGetSamples(HycoScene scene, HycoSamples *samples, PetscBool *given)
{
  char text[PETSC_MAX_PATH_LEN];
  PetscInt n_sets = 0, n;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, samples));
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(DriverGet("grid", PETSC_FALSE, text));
  if (text[0]) {
    PetscCall(AddGrid(scene, *samples, "grid", 0, text));
    n_sets++;
  }
  PetscCall(AddValues(scene, *samples, &any));
  n_sets += any;
  PetscCall(DriverGet("points", PETSC_FALSE, text));
  if (text[0]) {
    PetscCall(HycoSamplesAddFile(*samples, text));
    n_sets++;
  }
  if (!n_sets && !n) { /* a scene without parameters has one point */
    PetscCall(HycoSamplesAddPoint(*samples, NULL));
    n_sets = 1;
  }
  HycoCheck(n_sets <= 1, "give one set of points: -grid, or -values_NAME, or -points");
  *given = (PetscBool)(n_sets == 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void HelpLine(const char *name, const char *value, const char *initial, const char *meaning)
{
  char left[128];

  snprintf(left, sizeof(left), "-%s%s %s", name, name[strlen(name) - 1] == '_' ? "NAME" : "", value);
  printf("  %-46s %s%s%s%s\n", left, meaning, initial[0] ? " [" : "", initial, initial[0] ? "]" : "");
}

void DriverHelp(const char *command)
{
  const HycoOption *table;
  PetscInt n;

  (void)!HycoGetOptionTable(&n, &table);
  printf("hyco %s: reduced and full-order models of parametrised unilateral contact\n\n", HycoVersion());
  for (PetscInt k = 0; commands[k].name; k++) {
    if (command && strcmp(command, commands[k].name)) continue;
    printf("  %s\n      %s\n", commands[k].usage, commands[k].meaning);
  }
  printf("\nOptions of %s%s\n", command ? "hyco " : "the commands", command ? command : "");
  for (size_t k = 0; k < sizeof(own) / sizeof(own[0]); k++) {
    PetscBool taken = (PetscBool)!command;

    for (PetscInt c = 0; command && commands[c].name; c++) {
      char probe[64];

      snprintf(probe, sizeof(probe), "%s%s", own[k].name, own[k].name[strlen(own[k].name) - 1] == '_' ? "x" : "");
      if (strcmp(commands[c].name, command) == 0 && TakesOption(&commands[c], probe)) taken = PETSC_TRUE;
    }
    if (taken) HelpLine(own[k].name, own[k].value, own[k].initial, own[k].meaning);
  }
  printf("\nOptions of the method (a scene may set them too, in its hyco: section without the prefix)\n");
  for (PetscInt k = 0; k < n; k++) {
    const char *readers = ReadersOf(table[k].name);

    if (command && strcmp(command, "train") && DecidesModel(table[k].name)) continue;
    if (command && readers && !strstr(readers, command)) continue;
    HelpLine(table[k].name, table[k].value, table[k].initial, table[k].meaning);
  }
  printf("\nPETSc's options work too: -log_view, -info, -hyco_mumps_icntl_14 100 (MUMPS, solver of K), "
         "-hyco_primal_..., -hyco_tao_type bntr.\n");
  printf("Exit status: 0 done; 1 an error, in one line; 3 a model is written, but it misses a target or the default "
         "bar.\n");
  printf("Under MPI: mpiexec -n 2 hyco ...; set OPENBLAS_NUM_THREADS=1.\n");
}
