/* Points in the parameter space, from the command line. */
#include "driver.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Numbers separated by commas, in new memory. */
static PetscErrorCode ParseNumbers(const char name[], const char text[], PetscInt *n, PetscReal **values)
{
  const char *at = text;

  PetscFunctionBegin;
  *n = 0;
  /* A number and a comma take two characters at least. */
  PetscCall(PetscMalloc1(strlen(text) / 2 + 2, values));
  for (;;) {
    char *end;

    (*values)[*n] = strtod(at, &end);
    HycoCheck(end != at && (*end == ',' || *end == '\0') && !PetscIsInfOrNanReal((*values)[*n]),
              "-%s is \"%s\"; numbers separated by commas are expected", name, text);
    (*n)++;
    if (*end == '\0') break;
    at = end + 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For messages: "a,b,c". */
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

/* Refuses -mu_foo if foo is not a parameter. `prefix` is "mu_", "values_" or "hold_". */
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

    /* PETSc's options have no letter case. */
    if (strncasecmp(keys[k], prefix, strlen(prefix))) continue;
    for (PetscInt p = 0; p < n; p++) known = (PetscBool)(known || strcasecmp(keys[k] + strlen(prefix), names[p]) == 0);
    if (!known) PetscCall(PetscStrncpy(bad, keys[k], sizeof(bad)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &left, &keys, &values));
  PetscCall(ListNames(scene, list));
  HycoCheck(!bad[0], "-%s does not name a parameter; the scene's parameters are: %s", bad, list[0] ? list : "(none)");
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

/* The positions of a grid's values. TRAINING: the default of training, closed, with the middle for one value. */
enum { CENTRED, CLOSED, CHEBYSHEV, TRAINING };

/* Sets *type if -grid_type is given. TRAINING is no word of the option: it is the default of training, which
   differs from closed for one value. */
static PetscErrorCode ReadGridType(PetscInt *type)
{
  static const char *const types[] = {"centred", "closed", "chebyshev", NULL};
  PetscInt word = *type == TRAINING ? CLOSED : *type;
  PetscBool given;

  PetscFunctionBegin;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsWord("-grid_type",
                            "positions of the values: cell centres; with both ends of the ranges, the default of "
                            "training; or roots of Chebyshev polynomials",
                            types, &word, &given));
  PetscOptionsEnd();
  /* Otherwise TRAINING stays, which is no word of the list. */
  if (given) *type = word;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of -prefixNAME for each parameter, in new memory, or NULL; how many are given, and a name without.
   scene NULL: only declares. `missing` is the last name without a value, for the message. */
static PetscErrorCode GetNamed(HycoScene scene, const char prefix[], const char meaning[], PetscInt count[],
                               PetscReal *values[], PetscInt *given, const char **missing)
{
  PetscInt n;
  const char *const *names;
  char text[PETSC_MAX_PATH_LEN], key[DRIVER_LINE];

  PetscFunctionBegin;
  *given = 0;
  if (!scene) {
    PetscCall(DriverGet(prefix, meaning, text));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CheckNamed(scene, prefix));
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  for (PetscInt p = 0; p < n; p++) {
    /* Set for all first: the caller frees what is there, also after a missing one. */
    values[p] = NULL;
    PetscCall(PetscSNPrintf(key, sizeof(key), "%s%s", prefix, names[p]));
    PetscCall(DriverGet(key, "", text));
    if (!text[0])
      *missing = names[p];
    else {
      PetscCall(ParseNumbers(key, text, &count[p], &values[p]));
      ++*given;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Either -mu with all or a -mu_NAME for each: a mixture is refused, since it would not be clear which counts. held:
   values of those that need no -mu_NAME (NaN: it needs one; NULL: all do). */
PetscErrorCode DriverGetPoint(HycoScene scene, const PetscReal held[], PetscReal mu[])
{
  PetscInt n, m, count[64], given;
  const char *const *names, *missing;
  char text[PETSC_MAX_PATH_LEN], list[DRIVER_LINE];
  PetscReal *values[64], *all;

  PetscFunctionBegin;
  PetscCall(
      DriverGet("mu", "<v,v,...> values of all parameters, in the scene's order; or one by one: -mu_NAME v", text));
  PetscCall(
      GetNamed(scene, "mu_", "<v> value of the parameter NAME: -mu_radius 4.06", count, values, &given, &missing));
  if (!scene) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  PetscCall(ListNames(scene, list));
  if (text[0]) {
    PetscCall(ParseNumbers("mu", text, &m, &all));
    HycoCheck(m == n, "-mu has %d values; the scene has %d parameters: %s", (int)m, (int)n, n ? list : "(none)");
    PetscCall(PetscArraycpy(mu, all, n));
    PetscCall(PetscFree(all));
  }
  for (PetscInt p = 0; p < n; p++) {
    if (!values[p] && held && !text[0] && !PetscIsNanReal(held[p])) {
      mu[p] = held[p];
      given++;
    }
    if (!values[p]) continue;
    HycoCheck(count[p] == 1, "-mu_%s has %d values; one is expected", names[p], (int)count[p]);
    HycoCheck(!text[0], "-mu gives every parameter, and -mu_%s gives one of them again; remove one of the two",
              names[p]);
    mu[p] = values[p][0];
    PetscCall(PetscFree(values[p]));
  }
  PetscCall(ListRanges(scene, list));
  /* A scene without parameters needs neither. */
  HycoCheck(text[0] || given == n, "the scene has %d parameters (%s); give -mu with all of them, or -mu_NAME for each",
            (int)n, list);
  /* The ranges, unless extrapolation is allowed. */
  PetscCall(HycoSceneCheckParameters(scene, n, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outside the region of training no estimate is tested: the user must say that this is meant. */
PetscErrorCode DriverReadExtrapolate(PetscBool *extrapolate)
{
  PetscFunctionBegin;
  *extrapolate = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-extrapolate",
                            "permit predictions outside the ranges of the training, where the model is not tested",
                            extrapolate));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hold_NAME v: held[p] is the value that a parameter keeps, NaN where none is given. Ranges are the fit's to check. */
PetscErrorCode DriverGetHeld(HycoScene scene, PetscReal held[])
{
  PetscInt n, count[64], given;
  const char *const *names, *missing;
  PetscReal *values[64];

  PetscFunctionBegin;
  PetscCall(GetNamed(scene, "hold_", "<v> value that the parameter NAME of a fit keeps: -hold_radius 4.06", count,
                     values, &given, &missing));
  if (!scene) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  for (PetscInt p = 0; p < n; p++) {
    held[p] = NAN;
    if (!values[p]) continue;
    HycoCheck(count[p] == 1, "-hold_%s has %d values; one is expected", names[p], (int)count[p]);
    held[p] = values[p][0];
    PetscCall(PetscFree(values[p]));
  }
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

/* -mu or any -mu_NAME: whether a single point was asked for. The values are read and checked later. */
PetscErrorCode DriverHasPoint(HycoScene scene, PetscBool *given)
{
  PetscFunctionBegin;
  PetscCall(HasNamed(scene, "-mu", "-mu_", given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By presence alone: the values are read, and checked, later. */
PetscErrorCode DriverHasSamples(HycoScene scene, PetscBool *given)
{
  PetscFunctionBegin;
  PetscCall(HasNamed(scene, "-grid", "-values_", given));
  if (!*given) PetscCall(PetscOptionsHasName(NULL, NULL, "-points", given));
  if (!*given) PetscCall(PetscOptionsHasName(NULL, NULL, "-scatter", given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The grid that the option `name` gives as `text`; `type` applies unless -grid_type is given. -grid_type applies
   to any of the grids on the command line. */
static PetscErrorCode AddGrid(HycoScene scene, HycoSamples samples, const char name[], PetscInt type, const char text[])
{
  PetscInt n, m, counts[64];
  PetscReal *values;
  char list[DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(ReadGridType(&type));
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(ListNames(scene, list));
  PetscCall(ParseNumbers(name, text, &m, &values));
  HycoCheck(m == n && n > 0, "-%s has %d numbers; the scene has %d parameters: %s", name, (int)m, (int)n,
            n ? list : "(none)");
  for (PetscInt p = 0; p < n; p++) {
    /* Whole numbers are read as reals, so that 2.5 is refused rather than cut. */
    HycoCheck(values[p] >= 1 && values[p] <= 1e8 && values[p] == PetscFloorReal(values[p]),
              "-%s is \"%s\"; whole numbers, at least 1, are expected", name, text);
    counts[p] = (PetscInt)values[p];
  }
  PetscCall(PetscFree(values));
  if (type == CHEBYSHEV)
    PetscCall(HycoSamplesAddChebyshev(samples, counts));
  else if (type == TRAINING)
    PetscCall(HycoSamplesAddTrainingGrid(samples, counts));
  else
    PetscCall(HycoSamplesAddGrid(samples, counts, (PetscBool)(type == CLOSED)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene = NULL only declares the option, for help. Candidates cost an indicator each, not a solve. */
PetscErrorCode DriverGetTrainingGrid(HycoScene scene, HycoSamples *samples)
{
  char text[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverGet("training_grid",
                      "<n,n,...> greedy: the grid of candidate points, closed unless -grid_type is centred", text));
  if (!scene) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(text[0], "a greedy training needs candidate points; give -training_grid N,N,...");
  PetscCall(HycoSamplesCreate(scene, samples));
  PetscCall(AddGrid(scene, *samples, "training_grid", CLOSED, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The user's own held-out points; *samples = NULL: none are given, and the training scatters its own. With both
   sets it would be unclear which one judges the model. */
PetscErrorCode DriverGetValidation(HycoScene scene, HycoSamples *samples)
{
  char grid[PETSC_MAX_PATH_LEN], points[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  *samples = NULL;
  PetscCall(DriverGet("validation_grid",
                      "<n,n,...> train: the grid of held-out points, closed unless -grid_type is centred (default: "
                      "scattered points, -hyco_validation)",
                      grid));
  PetscCall(DriverGet("validation_points", "<file.csv> train: the held-out points, as a file of points", points));
  HycoCheck(!grid[0] || !points[0],
            "there are two sets of held-out points; give -validation_grid or -validation_points");
  if (!grid[0] && !points[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesCreate(scene, samples));
  if (grid[0])
    PetscCall(AddGrid(scene, *samples, "validation_grid", CLOSED, grid));
  else
    PetscCall(HycoSamplesAddFile(*samples, points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All combinations of -values_NAME for every parameter. The order of the points is that of the scene's parameters,
   the last one fastest. */
static PetscErrorCode AddValues(HycoScene scene, HycoSamples samples, PetscInt *n_sets)
{
  PetscInt n, count[64], given;
  const char *missing = "";
  PetscReal *values[64];

  PetscFunctionBegin;
  PetscCall(GetNamed(scene, "values_",
                     "<v,v,...> a set of points: values of the parameter NAME, combined with those of the others",
                     count, values, &given, &missing));
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  HycoCheck(given == n, "-values_ are given for %d of the %d parameters; -values_%s is missing", (int)given, (int)n,
            missing);
  PetscCall(HycoSamplesAddProduct(samples, count, (const PetscReal *const *)values));
  for (PetscInt p = 0; p < n; p++) PetscCall(PetscFree(values[p]));
  ++*n_sets;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n points of the sequence, or n,m: those after the first m, which are those of a training with m. */
static PetscErrorCode AddScattered(HycoScene scene, HycoSamples samples, const char text[])
{
  PetscInt m, n_par;
  PetscReal *value, count, after;
  const PetscReal *mu;
  HycoSamples all;

  PetscFunctionBegin;
  PetscCall(ParseNumbers("scatter", text, &m, &value));
  count = m == 1 || m == 2 ? value[0] : 0;
  after = m == 2 ? value[1] : 0;
  PetscCall(PetscFree(value));
  HycoCheck(count >= 1 && after >= 0 && count + after <= 1e8 && count == PetscFloorReal(count) &&
                after == PetscFloorReal(after),
            "-scatter is \"%s\"; one whole number, at least 1, is expected, or n,m for the n points after the first m",
            text);
  PetscCall(HycoSamplesCreate(scene, &all));
  PetscCall(HycoSamplesAddScattered(all, (PetscInt)(count + after)));
  PetscCall(HycoSamplesGet(all, NULL, &n_par, &mu));
  for (PetscInt k = 0; k < (PetscInt)count; k++)
    PetscCall(HycoSamplesAddPoint(samples, mu + ((PetscInt)after + k) * n_par));
  PetscCall(HycoSamplesDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exactly one kind of set. closed: the default of training, where the ends of the ranges must be solved. */
PetscErrorCode DriverGetSamples(HycoScene scene, PetscBool closed, HycoSamples *samples, PetscBool *given)
{
  char grid[PETSC_MAX_PATH_LEN], points[PETSC_MAX_PATH_LEN], scatter[PETSC_MAX_PATH_LEN];
  PetscInt n_sets = 0, n, type = CENTRED;

  PetscFunctionBegin;
  PetscCall(DriverGet("grid", "<n,n,...> a set of points: a grid with n values per parameter", grid));
  /* Only declares; a grid reads it when it is added. */
  if (!scene) PetscCall(ReadGridType(&type));
  if (scene) PetscCall(HycoSamplesCreate(scene, samples));
  PetscCall(AddValues(scene, scene ? *samples : NULL, &n_sets));
  PetscCall(DriverGet(
      "points", "<file.csv> a set of points: a header with the parameters' names, then a point per line", points));
  PetscCall(DriverGet("scatter",
                      "<n[,m]> a set of points: n points spread over the ranges, corners and faces included, with many "
                      "values of each parameter; for training with 3 parameters or more. With m those after the first "
                      "m: unseen by a training with -scatter m",
                      scatter));
  if (!scene) PetscFunctionReturn(PETSC_SUCCESS);
  n_sets += (grid[0] != '\0') + (points[0] != '\0') + (scatter[0] != '\0');
  HycoCheck(n_sets <= 1,
            "there are several sets of points; give only one of -grid, -values_NAME, -points and -scatter");
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  /* Test points lie in the middle of cells, where training on a closed grid has none. */
  if (grid[0])
    PetscCall(AddGrid(scene, *samples, "grid", closed ? TRAINING : CENTRED, grid));
  else if (points[0])
    PetscCall(HycoSamplesAddFile(*samples, points));
  else if (scatter[0])
    PetscCall(AddScattered(scene, *samples, scatter));
  else if (!n) /* a scene without parameters has one point */
    PetscCall(HycoSamplesAddPoint(*samples, NULL));
  *given = (PetscBool)(n_sets || !n);
  PetscFunctionReturn(PETSC_SUCCESS);
}
