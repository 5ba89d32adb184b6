/*
  Wrong use of the C API: every public call with NULL, after Destroy, with sizes that do not match; reuse after an
  error; two models at once; creation and destruction a thousand times without growth. Messages on every rank.
*/
#include "../unit/check.h"
#include <hyco.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char geo[PETSC_MAX_PATH_LEN], data[PETSC_MAX_PATH_LEN], rope[PETSC_MAX_PATH_LEN], hybrid[PETSC_MAX_PATH_LEN],
    blocks[PETSC_MAX_PATH_LEN], projection[PETSC_MAX_PATH_LEN];
static FILE *rows; /* faults/api.csv: rows that table.py puts into docs/limits/faults.csv */
static const PetscReal inside[2] = {0.07, 0.17}, outside[2] = {0.04, 0.17};

/* A handle that was destroyed is NULL, and NULL is refused by name. */
static PetscErrorCode TestDestroyed(void)
{
  const char *title;
  const PetscInt counts[2] = {2, 2};
  HycoScene scene;
  HycoSamples samples;
  HycoFOM fom;
  HycoROM model;
  HycoSolver solver;
  HycoSystem system;
  HycoErrors errors;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoROMLoad(hybrid, &model));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  CHECK(!model && !fom && !samples && !scene, "Destroy must clear the handles");
  PetscCall(HycoROMDestroy(&model)); /* twice */
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  CHECK_FAILS(HycoSceneGetTitle(scene, &title), "create it by HycoSceneLoad()");
  CHECK_FAILS(HycoSceneView(scene, PETSC_VIEWER_STDOUT_SELF), "create it by HycoSceneLoad()");
  CHECK_FAILS(HycoSamplesAddGrid(samples, counts, PETSC_FALSE), "create it by HycoSamplesCreate()");
  CHECK_FAILS(HycoSamplesAddPoint(samples, inside), "create it by HycoSamplesCreate()");
  CHECK_FAILS(HycoSamplesAddFile(samples, "p.csv"), "create it by HycoSamplesCreate()");
  CHECK_FAILS(HycoFOMGetSolver(fom, &solver), "create it by HycoFOMCreate()");
  CHECK_FAILS(HycoFOMGetSystem(fom, &system), "create it by HycoFOMCreate()");
  CHECK_FAILS(HycoFOMWrite(fom, "x.xdmf"), "create it by HycoFOMCreate()");
  CHECK_FAILS(HycoFOMGetSolution(fom, NULL, NULL, NULL, NULL, NULL, NULL), "create it by HycoFOMCreate()");
  CHECK_FAILS(HycoROMGetScene(model, &scene), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMSetReconstruct(model, PETSC_TRUE), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMGetLambda(model, NULL, NULL, NULL, NULL), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMGetWholeU(model, NULL, NULL), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMWrite(model, "x.xdmf"), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMView(model, PETSC_VIEWER_STDOUT_SELF), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMCompare(model, fom, &errors), "create it by HycoFOMCreate()");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Objects reference what they use: the scene or the system may be destroyed first by its creator. An object of
   another class, or none, is refused by name. */
static PetscErrorCode TestReferences(void)
{
  char none[1024] = {0};
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;
  HycoFOM fom;
  HycoROM model, again;
  HycoSolver solver;
  HycoSystem system;
  Mat K;
  Vec F, x;
  HycoReason reason;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoROMLoad(hybrid, &model));
  CHECK_FAILS(HycoROMPredict((HycoROM)fom, 2, inside), "not a HycoROM");
  CHECK_FAILS(HycoROMPredict((HycoROM)fom, 2, inside), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMPredict((HycoROM)none, 2, inside), "create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMCheckScene(model, (HycoScene)samples), "create it by HycoSceneLoad()");
  PetscCall(HycoSceneDestroy(&scene)); /* before the objects that reference it */
  PetscCall(HycoSamplesAddPoint(samples, inside));
  PetscCall(HycoFOMSolve(fom, 2, inside));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoFOMDestroy(&fom));
  again = model;
  PetscCall(PetscObjectReference((PetscObject)model));
  PetscCall(HycoROMDestroy(&model));
  CHECK(!model, "Destroy must clear the handle");
  PetscCall(HycoROMPredict(again, 2, inside));
  PetscCall(HycoROMDestroy(&again));

  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, NULL, &K));
  PetscCall(MatSetValue(K, 0, 0, 2, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(K, &x, &F));
  PetscCall(VecSet(F, 6));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSystemSetMatrices(system, K, NULL, NULL, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(system, F, NULL));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  CHECK_FAILS(HycoSolverSetSystem(solver, (HycoSystem)solver), "create it by HycoSystemCreate()");
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(HycoSolverSolve(solver, x, NULL));
  PetscCall(HycoSolverGetReason(solver, &reason));
  CHECK(reason > 0, "solved: 2 x = 6");
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(MatDestroy(&K));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL where an address is required. */
static PetscErrorCode TestNullPlaces(void)
{
  HycoScene scene = NULL;
  HycoROM model = NULL;

  PetscFunctionBegin;
  CHECK_FAILS(HycoSceneLoad(PETSC_COMM_WORLD, NULL, &scene), "is NULL");
  CHECK_FAILS(HycoSceneLoad(PETSC_COMM_WORLD, rope, NULL), "is NULL");
  CHECK_FAILS(HycoROMLoad(NULL, &model), "is NULL");
  CHECK_FAILS(HycoROMLoad(hybrid, NULL), "is NULL");
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoROMLoad(hybrid, &model));
  CHECK_FAILS(HycoROMPredict(model, 2, NULL), "is NULL");
  CHECK_FAILS(HycoSceneCheckParameters(scene, 2, NULL), "is NULL");
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Invalid sets of points: no value, too many, an empty part of them; the set is then unchanged. */
static PetscErrorCode TestSamples(void)
{
  const PetscReal value[1] = {0.1}, *const values[2] = {value, value};
  const PetscInt none[2] = {1, 0}, many[2] = {100000, 100000}, one[2] = {1, 1};
  PetscInt n;
  HycoScene scene;
  HycoSamples samples;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  CHECK_FAILS(HycoSamplesAddProduct(samples, none, values), "parameter mu2 has 0 values; at least 1 is needed");
  CHECK_FAILS(HycoSamplesAddProduct(samples, many, values), "more than 100 million points");
  CHECK_FAILS(HycoSamplesAddGrid(samples, none, PETSC_FALSE), "the grid has 0 points for mu2; at least 1 are needed");
  CHECK_FAILS(HycoSamplesAddGrid(samples, one, PETSC_TRUE), "the grid has 1 points for mu1; at least 2 are needed");
  CHECK_FAILS(HycoSamplesAddChebyshev(samples, none), "the grid has 0 points for mu2; at least 1 is needed");
  CHECK_FAILS(HycoSamplesAddPoint(samples, outside), "lies outside its range");
  PetscCall(HycoSamplesAddPoint(samples, inside));
  PetscCall(HycoSamplesGet(samples, &n, NULL, NULL));
  CHECK(n == 1, "the set has %d points; the one that was good is expected", (int)n);
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The wrong order, sizes that do not match; then the right call on the same handle gives the right numbers. */
static PetscErrorCode TestAfterError(void)
{
  const PetscReal nan[2] = {NAN, 0.1};
  HycoScene scene;
  HycoFOM fom;
  HycoROM model, other;
  HycoSummary summary;
  HycoPrediction p;
  HycoErrors errors;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, rope, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, scene, &fom));
  PetscCall(HycoROMLoad(hybrid, &model));
  CHECK_FAILS(HycoROMGetPrediction(model, &p), "call HycoROMPredict() before");
  CHECK_FAILS(HycoROMWrite(model, "/tmp/x.xdmf"), "call HycoROMPredict() before");
  CHECK_FAILS(HycoROMCompare(model, fom, &errors), "before");
  for (int k = 0; k < 3; k++) {
    CHECK_FAILS(HycoFOMSolve(fom, 1, inside), "1 parameter values were given; the scene has 2");
    CHECK_FAILS(HycoFOMSolve(fom, 2, outside), "lies outside its range");
    CHECK_FAILS(HycoFOMSolve(fom, 2, nan), "mu1");
    CHECK_FAILS(HycoROMPredict(model, 3, inside), "3 parameter values were given; the scene has 2");
    CHECK_FAILS(HycoROMPredict(model, 2, outside), "lies outside its range");
    CHECK_FAILS(HycoROMPredict(model, 2, nan), "mu1");
    CHECK_FAILS(HycoROMLoad("/no/such.h5", &other), "/no/such.h5");
    PetscCall(HycoFOMSolve(fom, 2, inside));
    PetscCall(HycoFOMGetSummary(fom, &summary));
    CHECK_NEAR(summary.total_contact_force, 0.3502256293, 1e-9); /* an independent computation, tests/unit/api.c */
    CHECK_FAILS(HycoFOMWrite(fom, "/no/such/folder/x.xdmf"), "cannot be written");
    PetscCall(HycoROMPredict(model, 2, inside));
    PetscCall(HycoROMGetPrediction(model, &p));
    CHECK_NEAR(p.total_contact_force, 0.32557839822014933, 1e-12); /* the result when the test was written */
    CHECK_FAILS(HycoROMWrite(model, "/no/such/folder/x.xdmf"), "cannot be written");
  }
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A training without points, with invalid settings; a full-order problem of another mesh. */
static PetscErrorCode TestTraining(void)
{
  const PetscReal shift[2] = {0.05, 0.06};
  HycoScene scene, other;
  HycoSamples samples;
  HycoReducer reducer;
  HycoSnapshots store;
  HycoSolver solver;
  HycoROM model;
  HycoFOM fom;
  HycoErrors errors;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  CHECK_FAILS(HycoReducerSetGreedyStop(reducer, 0, 0, 0), "it must be positive, for example 1e-3");
  CHECK_FAILS(HycoReducerSetGreedyStop(reducer, 1e-3, -1, 0), "they must not be negative");
  CHECK_FAILS(HycoReducerSetTargets(reducer, (const PetscReal[HYCO_N_ERRORS]){-1}, 0), "target of the error u is -1");
  CHECK_FAILS(HycoReducerRun(reducer, NULL, "none.h5", NULL), "give the training points");
  CHECK_FAILS(HycoReducerRun(reducer, samples, "none.h5", NULL), "the set of training points is empty");
  CHECK(access("none.h5", F_OK) != 0, "a training that was refused has written a model");
  PetscCall(HycoSnapshotsOpen(PETSC_COMM_WORLD, scene, "none.snapshots", &store));
  CHECK_FAILS(HycoSnapshotsFill(store, samples, NULL, NULL), "the set of samples is empty");
  PetscCall(HycoSnapshotsDestroy(&store));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  rmdir("none.snapshots");
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  CHECK_FAILS(HycoSolverSetLinear(solver, HYCO_LINEAR_AUTO, -1), "it must be 0 (the free memory) or more");
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, blocks, &other));
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, other, &fom));
  PetscCall(HycoFOMSolve(fom, 2, shift));
  PetscCall(HycoROMLoad(hybrid, &model));
  PetscCall(HycoROMPredict(model, 2, inside));
  CHECK_FAILS(HycoROMCompare(model, fom, &errors), "the model was trained on a mesh of 100 nodes and 99 cells");
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&other));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two models, used in turn, are independent. */
static PetscErrorCode TestTwo(void)
{
  HycoROM a, b;
  HycoPrediction p, q;
  const PetscReal elsewhere[2] = {0.2, 0.4};

  PetscFunctionBegin;
  PetscCall(HycoROMLoad(hybrid, &a));
  PetscCall(HycoROMLoad(projection, &b));
  for (int k = 0; k < 2; k++) {
    PetscCall(HycoROMPredict(a, 2, inside));
    PetscCall(HycoROMPredict(b, 2, k ? elsewhere : inside));
    PetscCall(HycoROMGetPrediction(a, &p));
    PetscCall(HycoROMGetPrediction(b, &q));
    CHECK_NEAR(p.total_contact_force, 0.32557839822014933, 1e-12);
    CHECK(strcmp(p.type, HYCO_ROM_HYBRID) == 0 && strcmp(q.type, HYCO_ROM_PROJECTION) == 0, "types %s, %s", p.type,
          q.type);
    if (!k) CHECK_NEAR(q.total_contact_force, 0.350993482, 1e-9); /* the result when the file was written */
  }
  PetscCall(HycoROMDestroy(&a));
  PetscCall(HycoROMPredict(b, 2, inside));
  PetscCall(HycoROMGetPrediction(b, &q));
  CHECK_NEAR(q.total_contact_force, 0.350993482, 1e-9);
  PetscCall(HycoROMDestroy(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static long Resident(void)
{
  long pages = 0, resident = 0;
  FILE *file = fopen("/proc/self/statm", "r");

  if (!file || fscanf(file, "%ld %ld", &pages, &resident) != 2) return -1;
  fclose(file);
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

static PetscErrorCode Once(void)
{
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;
  HycoROM model = NULL;
  HycoSolver solver;
  HycoSystem system;
  char line[HYCO_LINE];
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, rope, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddPoint(samples, inside));
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoROMLoad(hybrid, &model));
  PetscCall(HycoROMPredict(model, 2, inside));
  PetscCall(HycoCatchBegin());
  code = HycoROMPredict(model, 2, outside);
  PetscCall(HycoCatchEnd(code, line));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refusals must free their memory too: a file that is not a model, a folder without a scene, 1000 times. (A
   scene.yaml that libyaml refuses leaves 64 kB in PETSc 3.18, which does not free its parser.) */
static PetscErrorCode OnceRefused(void)
{
  HycoScene scene = NULL;
  HycoROM model = NULL;
  char line[HYCO_LINE];
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(HycoCatchBegin());
  code = HycoROMLoad(geo, &model);
  if (code) code = HycoSceneLoad(PETSC_COMM_SELF, data, &scene);
  PetscCall(HycoCatchEnd(code, line));
  CHECK(code, "rope.geo is read as a model or a scene");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Memory does not grow in a thousand repetitions. */
static PetscErrorCode TestGrowth(const char what[], PetscErrorCode (*once)(void), long most)
{
  long before, after;

  PetscFunctionBegin;
  for (int k = 0; k < 100; k++) PetscCall(once()); /* libraries have allocated their permanent memory by now */
  before = Resident();
  for (int k = 0; k < 1000; k++) PetscCall(once());
  after = Resident();
  printf("%s 1000 times: %ld kB to %ld kB resident\n", what, before, after);
  fprintf(rows, "\"C API: %s, 1000 times\",memory grows by %ld kB\n", what, after - before);
#if !defined(__SANITIZE_ADDRESS__)
  CHECK(before > 0 && after - before < most, "%s grew from %ld to %ld kB", what, before, after);
#endif
  (void)most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const char *source = getenv("HYCO_SOURCE");
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCheck(source, PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  snprintf(geo, sizeof(geo), "%s/examples/rope/rope.geo", source);
  snprintf(data, sizeof(data), "%s/tests/data", source);
  snprintf(rope, sizeof(rope), "%s/examples/rope", source);
  snprintf(blocks, sizeof(blocks), "%s/examples/blocks", source);
  snprintf(hybrid, sizeof(hybrid), "%s/tests/data/rope-hybrid-3.h5", source);
  snprintf(projection, sizeof(projection), "%s/tests/data/rope-projection-3.h5", source);
  PetscCall(TestDestroyed());
  PetscCall(TestReferences());
  PetscCall(TestNullPlaces());
  PetscCall(TestSamples());
  PetscCall(TestAfterError());
  PetscCall(TestTraining());
  PetscCall(TestTwo());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1) {
    mkdir("faults", 0777);
    rows = fopen("faults/api.csv", "w");
    PetscCheck(rows, PETSC_COMM_SELF, PETSC_ERR_USER, "faults/api.csv cannot be written");
    fprintf(rows, "\"C API: NULL, destroyed, copies of destroyed handles, handles of another kind, wrong order, wrong "
                  "sizes, reuse after an error, two models at once\",\"refused "
                  "by name; afterwards the numbers are right\"\n");
    PetscCall(TestGrowth("create, use, destroy", Once, 1000));
    PetscCall(TestGrowth("refused", OnceRefused, 1000));
    fclose(rows);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
