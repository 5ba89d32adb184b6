/* Full order in 2D and 3D, by a factor and by iterations, which need the rigid motions: the energy identity, the
   force of the pellet (tests/fom/solve.py) and the plate's balance of energy. */
#include "check.h"
#include <hycofom.h>
#include <hycosolver.h>

/* The scene's summary at mu. */
static PetscErrorCode Solve(const char name[], HycoLinear linear, PetscInt n, const PetscReal mu[],
                            HycoSummary *summary)
{
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoFOM fom;
  HycoSolver solver;

  PetscFunctionBegin;
  PetscCheck(getenv("HYCO_SOURCE"), PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  snprintf(folder, sizeof(folder), "%s/examples/%s", getenv("HYCO_SOURCE"), name);
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  PetscCall(HycoSolverSetLinear(solver, linear, 0));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, summary));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  CHECK(summary->reason > 0, "%s: %s", name, HycoReasonName(summary->reason));
  CHECK(HycoKKTMax(&summary->kkt) <= 1e-8, "%s: residual %g", name, HycoKKTMax(&summary->kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const PetscReal plate[2] = {2, 0.5}, pellet[2] = {4.06, 1};
  PetscReal u[2];
  HycoSummary s;

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    const HycoLinear linear = k ? HYCO_LINEAR_ITERATIVE : HYCO_LINEAR_DIRECT;

    PetscCall(Solve("plate", linear, 2, plate, &s));
    CHECK(s.dim == 2 && !s.n_contacts, "plate: dimension %d, %d contacts", (int)s.dim, (int)s.n_contacts);
    u[k] = s.u_norm2;
    PetscCall(Solve("pellet", linear, 2, pellet, &s));
    CHECK(s.dim == 3 && s.n_active == 45, "pellet: dimension %d, %d active", (int)s.dim, (int)s.n_active);
    CHECK_NEAR(s.total_contact_force, 1409.70532353, 1e-7 * 1409.7);
  }
  CHECK_NEAR(u[1], u[0], 1e-7 * u[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
