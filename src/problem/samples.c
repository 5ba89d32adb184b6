/* HycoSamples: grids, products, single points and CSV files of parameter values. */
#include <hycoalgorithms.h>
#include <hycosceneimpl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct _p_HycoSamples {
  PETSCHEADER(int);
  HycoScene scene; /* referenced */
  PetscInt n, room;
  PetscReal *mu; /* n x n_parameters */
};

/* Keeps a reference to the scene, whose ranges the sets of points need at each call. */
PetscErrorCode HycoSamplesCreate(HycoScene scene, HycoSamples *samples)
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(samples);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*samples, HYCO_SAMPLES_CLASSID, "HycoSamples", "Points of the parameter space", "Hyco",
                              HycoComm(scene), HycoSamplesDestroy, HycoSamplesView));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*samples)->scene = scene;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene lives on, if others refer to it. */
PetscErrorCode HycoSamplesDestroy(HycoSamples *samples)
{
  PetscFunctionBegin;
  HycoDestroyBegin(samples, HYCO_SAMPLES_CLASSID);
  PetscCall(HycoSceneDestroy(&(*samples)->scene));
  PetscCall(PetscFree((*samples)->mu));
  PetscCall(PetscHeaderDestroy(samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSamplesGetScene, (HycoSamples s, HycoScene *scene), s, HYCO_SAMPLES_CLASSID, *scene = s->scene)

/* All ranks add the same points; nothing is communicated. */
PetscErrorCode HycoSamplesAddPoint(HycoSamples s, const PetscReal mu[])
{
  PetscInt P;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  P = s->scene->n_parameters;
  PetscCall(HycoSceneCheckParameters(s->scene, P, mu));
  /* Doubled, so that adding n points costs O(n); +16 begins from none. */
  if (s->n == s->room) {
    s->room = 2 * s->room + 16;
    /* A scene without parameters has points of no values, of which there may still be one. */
    PetscCall(PetscRealloc((size_t)s->room * (size_t)PetscMax(P, 1) * sizeof(PetscReal), &s->mu));
  }
  PetscCall(PetscArraycpy(s->mu + s->n * P, mu, P));
  s->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last parameter changes fastest. The count is checked before each product, which could overflow. */
PetscErrorCode HycoSamplesAddProduct(HycoSamples s, const PetscInt counts[], const PetscReal *const values[])
{
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt total = 1;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(counts);
  HycoCheckGiven(values);
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
    HycoCheckValue(counts[p] >= 1, "parameter %s has %d values; at least 1 is needed", s->scene->parameter[p],
                   (int)counts[p]);
    /* By a quotient: the product itself could exceed 32 bits. */
    HycoCheckValue(total <= 100000000 / counts[p], "the set has more than 100 million points; use fewer per parameter");
    total *= counts[p];
    HycoCheckValue(values[p], "the values of parameter %s are NULL", s->scene->parameter[p]);
  }
  for (PetscInt k = 0; k < total; k++) {
    /* k in a number system whose digits have the bases counts[p]. */
    PetscInt rest = k;

    for (PetscInt p = s->scene->n_parameters - 1; p >= 0; p--) {
      mu[p] = values[p][rest % counts[p]];
      rest /= counts[p];
    }
    PetscCall(HycoSamplesAddPoint(s, mu));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All combinations of the values, which this function frees. */
static PetscErrorCode TakeProduct(HycoSamples s, const PetscInt counts[], PetscReal *values[])
{
  const PetscErrorCode ierr = HycoSamplesAddProduct(s, counts, (const PetscReal *const *)values);

  PetscFunctionBegin;
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) PetscCall(PetscFree(values[p]));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tensor grid with at least `least` values of each parameter that has a range; of one value the middle. All
   counts are checked before memory is allocated. closed: with both ends, else midpoints of equal cells. */
static PetscErrorCode AddGrid(HycoSamples s, const PetscInt counts[], PetscBool closed, PetscInt least)
{
  PetscReal *values[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
    const PetscInt needed = s->scene->lo[p] < s->scene->hi[p] ? least : 1;

    HycoCheckValue(counts[p] >= needed && counts[p] <= 100000000,
                   "the grid has %d points for %s; at least %d are needed", (int)counts[p], s->scene->parameter[p],
                   (int)needed);
  }
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
    const PetscReal lo = s->scene->lo[p], hi = s->scene->hi[p];
    const PetscInt n = counts[p];
    const PetscBool ends = (PetscBool)(closed && n > 1);

    PetscCall(PetscMalloc1(n, &values[p]));
    for (PetscInt k = 0; k < n; k++) {
      /* The last one is exactly hi: round-off could put it outside the range. */
      values[p][k] = ends ? (k == n - 1 ? hi : lo + k * (hi - lo) / (n - 1)) : lo + (k + 0.5) * (hi - lo) / n;
    }
  }
  PetscCall(TakeProduct(s, counts, values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A closed grid has the ends of the ranges, and thus at least 2 points for each parameter; a centred one begins
   half a step inside, and may have a single one. */
PetscErrorCode HycoSamplesAddGrid(HycoSamples s, const PetscInt counts[], PetscBool closed)
{
  PetscFunctionBegin;
  HycoCheckGiven(counts);
  PetscCall(AddGrid(s, counts, closed, closed ? 2 : 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One value, the middle of the range, is permitted, unlike in a closed grid. */
PetscErrorCode HycoSamplesAddTrainingGrid(HycoSamples s, const PetscInt counts[])
{
  PetscFunctionBegin;
  HycoCheckGiven(counts);
  PetscCall(AddGrid(s, counts, PETSC_TRUE, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For interpolation by polynomials: equidistant nodes have Lebesgue constants that grow exponentially with their
   number, Chebyshev's only logarithmically. */
PetscErrorCode HycoSamplesAddChebyshev(HycoSamples s, const PetscInt counts[])
{
  PetscReal *values[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(counts);
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
    /* All counts before the first allocation: a failed check would leak the nodes of the former parameters. */
    HycoCheckValue(counts[p] >= 1 && counts[p] <= 100000000, "the grid has %d points for %s; at least 1 is needed",
                   (int)counts[p], s->scene->parameter[p]);
  }
  for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
    PetscCall(PetscMalloc1(counts[p], &values[p]));
    PetscCall(HycoChebyshevNodes(counts[p], s->scene->lo[p], s->scene->hi[p], values[p]));
  }
  PetscCall(TakeProduct(s, counts, values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The header's columns: column[c] = parameter of column c. column[] has room for all parameters; names are
   compared with their letter case. */
static PetscErrorCode ReadHeader(HycoSamples s, const char path[], char *line, PetscInt column[])
{
  const PetscInt P = s->scene->n_parameters;
  char *word, *rest;
  PetscInt c = 0;

  PetscFunctionBegin;
  for (word = strtok_r(line, ", \t\r\n", &rest); word; word = strtok_r(NULL, ", \t\r\n", &rest), c++) {
    PetscInt p = 0;

    /* Names must match exactly, since expressions distinguish the case of parameters. */
    while (p < P && strcmp(word, s->scene->parameter[p])) p++;
    HycoCheck(p < P && c < P, "%s: the column \"%s\" is not a parameter of the scene, or there are too many columns",
              path, word);
    /* With each column a parameter and none twice, P columns are all of them. */
    for (PetscInt b = 0; b < c; b++) HycoCheck(column[b] != p, "%s: the column %s occurs twice", path, word);
    column[c] = p;
  }
  HycoCheck(c == P, "%s: its first line names %d of the scene's %d parameters", path, (int)c, (int)P);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The header gives the order of the columns, so that files of other programs need not be rearranged; each line must
   have exactly one number per parameter. */
static PetscErrorCode ReadLines(HycoSamples s, const char path[], FILE *file)
{
  const PetscInt P = s->scene->n_parameters, before = s->n;
  char line[4096];
  PetscInt column[HYCO_MAX_PARAMETERS], number = 0;

  PetscFunctionBegin;
  while (fgets(line, sizeof(line), file)) {
    PetscReal mu[HYCO_MAX_PARAMETERS];
    char *next = line;

    number++;
    if (number == 1) {
      PetscCall(ReadHeader(s, path, HycoSkipMark(line), column));
      continue;
    }
    /* Blank lines, such as one at the end of a file, are no points. */
    if (line[strspn(line, " \t\r\n")] == '\0') continue;
    for (PetscInt c = 0; c < P; c++) {
      char *end;

      /* HycoNumber() and not strtod(), which obeys the locale's decimal comma. */
      mu[column[c]] = HycoNumber(next, &end);
      end += strspn(end, " \t\r\n");
      HycoCheck(end != next && (*end == (c == P - 1 ? '\0' : ',')),
                "%s, line %d: %d numbers separated by commas are expected", path, (int)number, (int)P);
      next = end + 1;
    }
    PetscCall(HycoSamplesAddPoint(s, mu));
  }
  HycoCheck(s->n > before,
            "%s contains no point; a header with the parameters' names is expected, then a point per line (numbers "
            "separated by commas)",
            path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file is closed whether or not its lines are valid. */
static PetscErrorCode ReadFile(HycoSamples s, const char path[])
{
  FILE *file = fopen(path, "r");

  PetscFunctionBegin;
  HycoCheckFile(file, "the file of points %s cannot be opened", path);
  HycoFinally(ReadLines(s, path, file), fclose(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSamplesAddFile, (HycoSamples s, const char path[]), s, HYCO_SAMPLES_CLASSID, HycoCheckGiven(path);
                 HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID); HycoOnEach(HycoComm(s->scene), ReadFile(s, path)))

typedef struct {
  unsigned long long hash;
  PetscInt at;
} Keyed;

/* By hash, then by place, so that of equal points the first comes first. */
static int CompareKeyed(const void *a, const void *b)
{
  const Keyed *x = (const Keyed *)a, *y = (const Keyed *)b;

  return x->hash != y->hash ? (x->hash > y->hash) - (x->hash < y->hash) : (x->at > y->at) - (x->at < y->at);
}

/* twin[k]: an earlier point has the same values as point k. By hashes: comparing all pairs of a million points
   would take hours. Points of equal hash are compared themselves. */
static PetscErrorCode FindTwins(HycoSamples s, PetscBool twin[])
{
  const PetscInt P = s->scene->n_parameters;
  Keyed *key;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n, &key));
  for (PetscInt k = 0; k < s->n; k++) {
    key[k].hash = HycoHash(HYCO_HASH_START, s->mu + k * P, (size_t)P * sizeof(PetscReal));
    key[k].at = k;
  }
  if (s->n) qsort(key, (size_t)s->n, sizeof(*key), CompareKeyed);
  for (PetscInt k = 0; k < s->n; k++) {
    PetscBool same = PETSC_FALSE;

    /* Within a run of equal hashes all earlier ones are compared; CompareKeyed() keeps them in the order of points, so
       that the first occurrence is the one that stays. */
    for (PetscInt j = k - 1; j >= 0 && !same && key[j].hash == key[k].hash; j--)
      PetscCall(PetscArraycmp(s->mu + key[j].at * P, s->mu + key[k].at * P, P, &same));
    twin[key[k].at] = same;
  }
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All ranks remove the same points. */
PetscErrorCode HycoSamplesDrop(HycoSamples s, const PetscBool drop[])
{
  PetscInt P, n;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(drop);
  P = s->scene->n_parameters;
  n = s->n;
  s->n = 0;
  /* Moved in place: no point moves to a larger number. PetscArraymove() since source and target may be the same. */
  for (PetscInt k = 0; k < n; k++) {
    if (!drop[k]) PetscCall(PetscArraymove(s->mu + s->n++ * P, s->mu + k * P, P));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order of the others stays. */
PetscErrorCode HycoSamplesDropTwins(HycoSamples s, PetscInt *n_dropped)
{
  PetscInt n;
  PetscBool *twin;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  n = s->n;
  PetscCall(PetscMalloc1(s->n + 1, &twin));
  PetscCall(FindTwins(s, twin));
  PetscCall(HycoSamplesDrop(s, twin));
  if (n_dropped) *n_dropped = n - s->n;
  PetscCall(PetscFree(twin));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu is borrowed, until the next point is added. */
PetscErrorCode HycoSamplesGet(HycoSamples s, PetscInt *n_points, PetscInt *n_parameters, const PetscReal *mu[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SAMPLES_CLASSID);
  HycoCheckHandle(s->scene, HYCO_SCENE_CLASSID);
  if (n_points) *n_points = s->n;
  if (n_parameters) *n_parameters = s->scene->n_parameters;
  if (mu) *mu = s->mu;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSamplesView(HycoSamples s, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(s, HYCO_SAMPLES_CLASSID, viewer);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%d points of %d parameters\n", (int)s->n, (int)s->scene->n_parameters));
  for (PetscInt k = 0; k < s->n; k++) {
    char line[HYCO_LINE] = "", value[64];

    for (PetscInt p = 0; p < s->scene->n_parameters; p++) {
      snprintf(value, sizeof(value), "%.40s = %g", s->scene->parameter[p],
               (double)s->mu[k * s->scene->n_parameters + p]);
      PetscCall(HycoListAdd(line, ", ", value));
    }
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s\n", line));
  }
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoSamples, HYCO_SAMPLES_CLASSID)
