/* The public classes called in the wrong order or with NULL: the message, on every rank. */
#include "check.h"
#include <hyco.h>

/* NULL objects and arguments are refused by name. */
static PetscErrorCode TestNull(void)
{
  HycoSummary summary;
  HycoSystem system = NULL;
  HycoSolver solver = NULL;
  HycoScene scene = NULL;
  HycoFOM fom = NULL;
  HycoROM model = NULL;
  HycoSamples samples = NULL;
  HycoSnapshots snapshots = NULL;
  HycoReducer reducer = NULL;
  HycoPrediction prediction;
  HycoReason reason;
  HycoKKT kkt;
  PetscInt n;
  const PetscReal *mu, point[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(HycoSystemDestroy(&system)); /* Destroy is NULL-safe */
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSnapshotsDestroy(&snapshots));
  PetscCall(HycoReducerDestroy(&reducer));
  CHECK_FAILS(HycoSystemComputeKKT(system, NULL, NULL, &kkt), "the handle is NULL; create it by HycoSystemCreate()");
  CHECK_FAILS(HycoSystemSetVectors(system, NULL, NULL), "the handle is NULL; create it by HycoSystemCreate()");
  CHECK_FAILS(HycoSolverSolve(solver, NULL, NULL), "the handle is NULL; create it by HycoSolverCreate()");
  CHECK_FAILS(HycoSolverGetReason(solver, &reason), "the handle is NULL; create it by HycoSolverCreate()");
  CHECK_FAILS(HycoSolverSetType(solver, HYCO_SOLVER_TAO), "the handle is NULL; create it by HycoSolverCreate()");
  CHECK_FAILS(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL), "the handle is NULL; create it by HycoSceneLoad()");
  CHECK_FAILS(HycoSceneCheckParameters(scene, 2, point), "the handle is NULL; create it by HycoSceneLoad()");
  CHECK_FAILS(HycoSamplesCreate(scene, &samples), "the handle is NULL; create it by HycoSceneLoad()");
  CHECK_FAILS(HycoSamplesGet(samples, &n, NULL, &mu), "the handle is NULL; create it by HycoSamplesCreate()");
  CHECK_FAILS(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom), "the handle is NULL; create it by HycoSceneLoad()");
  CHECK_FAILS(HycoFOMSolve(fom, 2, point), "the handle is NULL; create it by HycoFOMCreate()");
  CHECK_FAILS(HycoFOMSolveForces(fom, 2, point, point), "the handle is NULL; create it by HycoFOMCreate()");
  CHECK_FAILS(HycoFOMGetSummary(fom, &summary), "the handle is NULL; create it by HycoFOMCreate()");
  CHECK_FAILS(HycoROMPredict(model, 2, point), "the handle is NULL; create it by HycoROMLoad()");
  CHECK_FAILS(HycoROMGetPrediction(model, &prediction), "the handle is NULL; create it by HycoROMLoad()");
  CHECK_FAILS(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer), "the handle is NULL; create it by HycoSceneLoad()");
  CHECK_FAILS(HycoReducerSetFromOptions(reducer), "the handle is NULL; create it by HycoReducerCreate()");
  CHECK_FAILS(HycoSnapshotsFill(snapshots, samples, NULL, NULL),
              "the handle is NULL; create it by HycoSnapshotsOpen()");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver without a system, and queries before Solve, are refused. */
static PetscErrorCode TestSolverOrder(void)
{
  HycoSystem system;
  HycoSolver solver;
  HycoKKT kkt;
  Mat K, B;
  Vec F;

  PetscFunctionBegin;
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, 3, &F));
  PetscCall(MatCreateConstantDiagonal(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, 3, 3, 2, &K));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, 3, 2, NULL, &B));
  PetscCall(HycoSystemCreate(PETSC_COMM_WORLD, &system));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  CHECK_FAILS(HycoSystemSetVectors(system, F, NULL), "call HycoSystemSetMatrices() before HycoSystemSetVectors()");
  CHECK_FAILS(HycoSystemComputeKKT(system, F, NULL, &kkt), "call HycoSystemSetVectors() before HycoSystemComputeKKT()");
  CHECK_FAILS(HycoSolverSolve(solver, F, NULL), "call HycoSolverSetSystem()");
  PetscCall(HycoSolverSetSystem(solver, system));
  CHECK_FAILS(HycoSolverSolve(solver, F, NULL), "matrices and vectors are set, before HycoSolverSolve()");
  CHECK_FAILS(HycoSystemSetMatrices(system, B, NULL, NULL, PETSC_FALSE), "K is 3 x 2; it must be square");
  CHECK_FAILS(HycoSystemSetMatrices(system, K, NULL, B, PETSC_FALSE), "B and Bt must both be given, or neither");
  CHECK_FAILS(HycoSystemSetMatrices(system, K, B, B, PETSC_FALSE), "do not match");
  PetscCall(HycoSystemSetMatrices(system, K, NULL, NULL, PETSC_TRUE));
  CHECK_FAILS(HycoSystemSetVectors(system, F, F), "F has length 3 and D 3 where 3 and 0 are expected");
  CHECK_FAILS(HycoSolverSetType(solver, "newton"), "the solver type \"newton\" is unknown");
  CHECK_FAILS(HycoSolverSetTolerance(solver, 2), "it must lie between 0 and 1");
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSystemDestroy(&system));
  CHECK(!solver && !system, "Destroy must clear the handles");
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&B));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the rope: queries before Solve fail; a point outside the ranges; then the numbers of an independent
   computation. */
static PetscErrorCode TestFOMOrder(void)
{
  const PetscReal inside[2] = {0.07, 0.17}, outside[2] = {0.04, 0.17};
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoFOM fom;
  HycoSummary summary;
  HycoROM model;

  PetscFunctionBegin;
  PetscCheck(getenv("HYCO_SOURCE"), PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  snprintf(folder, sizeof(folder), "%s/examples/rope", getenv("HYCO_SOURCE"));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  CHECK_FAILS(HycoFOMGetSummary(fom, &summary), "call HycoFOMSolve() before HycoFOMGetSummary()");
  CHECK_FAILS(HycoFOMGetSolution(fom, NULL, NULL, NULL, NULL, NULL, NULL),
              "call HycoFOMSolve() before HycoFOMGetSolution()");
  CHECK_FAILS(HycoFOMWrite(fom, "/tmp/x.xdmf"), "call HycoFOMSolve() before HycoFOMWrite()");
  CHECK_FAILS(HycoFOMSolve(fom, 2, outside), "mu1 = 0.04 lies outside its range [0.05, 0.25]");
  CHECK_FAILS(HycoFOMSolve(fom, 1, inside), "1 parameter values were given; the scene has 2: mu1");
  CHECK_FAILS(HycoROMLoad("/no/such.h5", &model), "/no/such.h5");
  PetscCall(HycoFOMSolve(fom, 2, inside));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  CHECK(summary.n_active == 17, "expected 17 active, found %d", (int)summary.n_active);
  CHECK_NEAR(summary.total_contact_force, 0.3502256293, 1e-9);
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces of a solution given to HycoFOMSolveForces(): its displacement, its residuals, on the rope; other forces
   give other results, with larger residuals. */
static PetscErrorCode TestForces(void)
{
  const PetscReal mu[2] = {0.07, 0.17};
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoFOM fom;
  HycoSummary one, summary;
  PetscReal *forces;
  PetscInt n;
  const PetscReal *Lambda;

  PetscFunctionBegin;
  snprintf(folder, sizeof(folder), "%s/examples/rope", getenv("HYCO_SOURCE"));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, 2, mu));
  PetscCall(HycoFOMGetSummary(fom, &one));
  PetscCall(HycoFOMGetSolution(fom, NULL, NULL, &n, &Lambda, NULL, NULL));
  PetscCall(PetscMalloc1(n, &forces));
  PetscCall(PetscArraycpy(forces, Lambda, n));
  PetscCall(HycoFOMSolveForces(fom, 2, mu, forces));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  CHECK(summary.reason == HYCO_CONVERGED && HycoKKTMax(&summary.kkt) < 1e-9, "reason %d", (int)summary.reason);
  CHECK_NEAR(summary.u_norm2, one.u_norm2, 1e-10);
  CHECK_NEAR(summary.total_contact_force, one.total_contact_force, 1e-15);
  for (PetscInt k = 0; k < n; k++) forces[k] *= 0.9; /* equilibrium holds, and the rope penetrates the obstacle */
  PetscCall(HycoFOMSolveForces(fom, 2, mu, forces));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  CHECK(summary.reason == HYCO_CONVERGED && summary.kkt.stationarity < 1e-9, "reason %d", (int)summary.reason);
  CHECK(summary.kkt.penetration > 1e-3, "penetration %g", (double)summary.kkt.penetration);
  CHECK_NEAR(summary.total_contact_force, 0.9 * one.total_contact_force, 1e-14);
  PetscCall(HycoFOMSolve(fom, 2, mu)); /* and later solves are not affected */
  PetscCall(HycoFOMGetSummary(fom, &summary));
  CHECK_NEAR(summary.total_contact_force, one.total_contact_force, 1e-14);
  CHECK(HycoKKTMax(&summary.kkt) < 1e-9, "residuals of another solve");
  PetscCall(PetscFree(forces));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A batch in arbitrary order, with repeated stiffnesses: each result equals that of a single call, to the last bit. */
static PetscErrorCode TestMany(void)
{
  const PetscReal mu[6][2] = {{0.2, 0.3}, {0.07, 0.17}, {0.2, -0.02}, {0.11, 0.4}, {0.07, 0.45}, {0.2, 0.3}};
  const PetscReal outside[2][2] = {{0.2, 0.3}, {0.2, 0.6}};
  const PetscInt grid[2] = {5, 6};
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;
  HycoROM model, single;
  HycoPrediction all[6], one;
  PetscInt n, n_nodes, dim;
  const PetscReal *L, *u;
  PetscReal *Lambda, *U;

  PetscFunctionBegin;
  snprintf(folder, sizeof(folder), "%s/examples/rope", getenv("HYCO_SOURCE"));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_FALSE));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, "many.h5", NULL));
  PetscCall(HycoROMLoad("many.h5", &model));
  PetscCall(HycoROMLoad("many.h5", &single));
  PetscCall(HycoROMGetSizes(model, &n, &n_nodes, &dim));
  CHECK(n == 98 && dim == 1, "%d contacts, %d components", (int)n, (int)dim);
  PetscCall(PetscMalloc2(6 * n, &Lambda, 6 * n_nodes * dim, &U));
  CHECK_FAILS(HycoROMSolveMany(model, 2, 2, outside[0], NULL, NULL, NULL), "mu2 = 0.6 lies outside its range");
  PetscCall(HycoROMSolveMany(model, 6, 2, mu[0], all, Lambda, U));
  CHECK_FAILS(HycoROMGetPrediction(model, &one), "call HycoROMPredict() before getting");
  for (PetscInt k = 0; k < 6; k++) {
    PetscCall(HycoROMPredict(single, 2, mu[k]));
    PetscCall(HycoROMGetPrediction(single, &one));
    PetscCall(HycoROMGetLambda(single, NULL, &L, NULL, NULL));
    PetscCall(HycoROMGetRID(single, NULL, NULL, &u, NULL, NULL, NULL));
    CHECK(all[k].reason > 0 && all[k].total_contact_force > 0, "point %d: no solution, or no contact", (int)k);
    CHECK_NEAR(all[k].total_contact_force, one.total_contact_force, 0);
    for (PetscInt i = 0; i < n; i++) CHECK_NEAR(Lambda[k * n + i], L[i], 0);
    for (PetscInt i = 0; i < n_nodes * dim; i++) CHECK_NEAR(U[k * n_nodes * dim + i], u[i], 0);
  }
  PetscCall(PetscFree2(Lambda, U));
  PetscCall(HycoROMDestroy(&single));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  CHECK(HycoVersion()[0] >= '0' && HycoVersion()[0] <= '9', "the version is \"%s\"", HycoVersion());
  PetscCall(TestNull());
  PetscCall(TestSolverOrder());
  PetscCall(TestFOMOrder());
  PetscCall(TestForces());
  PetscCall(TestMany());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
