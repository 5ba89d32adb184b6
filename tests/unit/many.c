/* Errors in the middle of many points, and points that differ between ranks: no memory is lost, no rank waits. */
#include "check.h"
#include <hyco.h>
#include <unistd.h>

/* Positive in the range of training, up to mu1 = 0.25; above 0.3 the assembly of the stiffness fails. */
#define YOUNG "x <= 0.5 ? 0.3 - mu1 : 0.15"

static char rope[PETSC_MAX_PATH_LEN];

static PetscErrorCode Train(HycoROMType type, const char path[])
{
  const PetscInt counts[2] = {3, 3};
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;

  PetscFunctionBegin;
  PetscCall(PetscOptionsSetValue(NULL, "-body_rope_young", YOUNG));
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_model_type", type));
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, rope, &scene));
  PetscCall(PetscOptionsClearValue(NULL, "-body_rope_young"));
  PetscCall(PetscOptionsClearValue(NULL, "-hyco_model_type"));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_FALSE));
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, path, NULL));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The third of n points fails in the order of solution; PETSc's memory before and after is the same. */
static PetscErrorCode FailInTheMiddle(HycoROM m, PetscInt n, const PetscReal mu[], const PetscReal expected[])
{
  HycoPrediction p[4];
  PetscInt n_contacts, n_nodes, dim;
  PetscReal *Lambda, *U, force = 0;
  PetscLogDouble before, after;

  PetscFunctionBegin;
  PetscCall(HycoROMGetSizes(m, &n_contacts, &n_nodes, &dim));
  PetscCall(PetscMalloc2(n * n_contacts, &Lambda, n * n_nodes * dim, &U));
  CHECK_FAILS(HycoROMSolveMany(m, n, 2, mu, p, Lambda, U), "Young's modulus must be positive"); /* creates objects
                                                                                                   that are created
                                                                                                   lazily */
  PetscCall(PetscMallocGetCurrentUsage(&before));
  CHECK_FAILS(HycoROMSolveMany(m, n, 2, mu, p, Lambda, U), "Young's modulus must be positive");
  PetscCall(PetscMallocGetCurrentUsage(&after));
  CHECK(before > 0, "PETSc keeps no books of its memory");
  CHECK(after == before, "%g bytes held before the error, %g after", before, after);
  CHECK_FAILS(HycoROMGetPrediction(m, p), "call HycoROMPredict() before");
  PetscCall(HycoROMSolveMany(m, 2, 2, mu, p, Lambda, NULL)); /* the two valid ones: the model has not changed */
  for (PetscInt k = 0; k < 2; k++) {
    CHECK(p[k].total_contact_force == expected[k], "force %.17g, before the error %.17g",
          (double)p[k].total_contact_force, (double)expected[k]);
  }
  for (PetscInt k = 0; k < n_contacts; k++) force += Lambda[k];
  CHECK_NEAR(force, expected[0], 1e-12 * expected[0]);
  PetscCall(PetscFree2(Lambda, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points in another order than that of solution: each result is in the place of its point; the points are solved by
   stiffness, so that both points before 0.35 are done when that one fails. */
static PetscErrorCode Unsorted(HycoROM m)
{
  const PetscReal mu[8] = {0.2, 0.3, 0.1, 0.3, 0.2, 0.1, 0.1, 0.1}, failing[6] = {0.35, 0.1, 0.2, 0.3, 0.1, 0.1};
  HycoPrediction p[4], single[4];
  PetscInt n_contacts, n_nodes, dim;
  PetscReal *Lambda;

  PetscFunctionBegin;
  PetscCall(HycoROMGetSizes(m, &n_contacts, &n_nodes, &dim));
  PetscCall(PetscMalloc1(4 * n_contacts, &Lambda));
  PetscCall(HycoROMSolveMany(m, 4, 2, mu, p, Lambda, NULL));
  for (PetscInt k = 0; k < 4; k++) {
    PetscReal force = 0;

    PetscCall(HycoROMPredict(m, 2, mu + 2 * k));
    PetscCall(HycoROMGetPrediction(m, &single[k]));
    for (PetscInt i = 0; i < n_contacts; i++) force += Lambda[k * n_contacts + i];
    CHECK_NEAR(p[k].total_contact_force, single[k].total_contact_force, 1e-12 * single[k].total_contact_force);
    CHECK_NEAR(force, single[k].total_contact_force, 1e-12 * single[k].total_contact_force);
    for (PetscInt j = 0; j < k; j++)
      CHECK(PetscAbsReal(single[k].total_contact_force - single[j].total_contact_force) > 1e-6,
            "points %d and %d cannot be told apart", (int)j, (int)k);
  }
  for (PetscInt k = 0; k < 3; k++) p[k].total_contact_force = -1;
  CHECK_FAILS(HycoROMSolveMany(m, 3, 2, failing, p, NULL, NULL), "Young's modulus must be positive");
  CHECK(p[0].total_contact_force == -1, "the point that fails has a force: %g", (double)p[0].total_contact_force);
  CHECK_NEAR(p[1].total_contact_force, single[0].total_contact_force, 1e-12);
  CHECK_NEAR(p[2].total_contact_force, single[3].total_contact_force, 1e-12);
  PetscCall(PetscFree(Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A batch of points, and again after errors in the middle of it: the same forces. */
static PetscErrorCode TestMany(HycoROMType type)
{
  const PetscReal mu[8] = {0.1, 0.1, 0.2, 0.3, 0.35, 0.1, 0.4, 0.1};
  PetscReal expected[2];
  char path[64];
  HycoROM m;
  HycoPrediction p[2];

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "many-%s-%d.h5", type, (int)getpid());
  PetscCall(Train(type, path));
  PetscCall(HycoROMLoad(path, &m));
  PetscCall(HycoROMSetExtrapolate(m, PETSC_TRUE));
  PetscCall(HycoROMSolveMany(m, 2, 2, mu, p, NULL, NULL));
  for (int k = 0; k < 2; k++) expected[k] = p[k].total_contact_force;
  CHECK(expected[0] > 0 && expected[1] > 0 && expected[0] != expected[1], "forces %g, %g", (double)expected[0],
        (double)expected[1]);
  for (int k = 0; k < 3; k++) PetscCall(FailInTheMiddle(m, 4, mu, expected));
  PetscCall(Unsorted(m));
  PetscCall(HycoROMDestroy(&m));
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A different point on each rank, or one of them outside: every rank gets the error, and then one point is solved by
   all. */
static PetscErrorCode TestOnePoint(void)
{
  PetscReal here[2] = {0.07, 0.17};
  PetscMPIInt rank, size;
  HycoScene scene;
  HycoFOM fom;
  HycoSummary summary;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, rope, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  for (int last = 0; last < 2 && size > 1; last++) {
    const PetscBool odd = (PetscBool)(rank == (last ? size - 1 : 0));

    here[1] = odd ? 0.2 : 0.17;
    CHECK_FAILS(HycoFOMSolve(fom, 2, here), "mu2 is 0.17 on one rank and 0.2 on another");
    here[1] = odd ? 0.7 : 0.17;
    CHECK_FAILS(HycoFOMSolve(fom, 2, here), "mu2 = 0.7 lies outside its range");
    here[1] = 0.17;
    CHECK_FAILS(HycoFOMSolve(fom, odd ? 1 : 2, here), "1 parameter values were given; the scene has 2");
  }
  PetscCall(HycoFOMSolve(fom, 2, here));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  CHECK_NEAR(summary.total_contact_force, 0.3502256293, 1e-9); /* an independent computation, tests/unit/api.c */
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  static const HycoROMType types[] = {HYCO_ROM_HYBRID, HYCO_ROM_PROJECTION, HYCO_ROM_BODIES};
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCheck(getenv("HYCO_SOURCE"), PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  snprintf(rope, sizeof(rope), "%s/examples/rope", getenv("HYCO_SOURCE"));
  PetscCall(TestOnePoint());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int k = 0; k < 3 && size == 1; k++) PetscCall(TestMany(types[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN_MEMORY
