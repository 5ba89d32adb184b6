/*
  Step 1: a scene, its full-order solution, its contact forces.

      build/ladder/solve -scene examples/rope -mu 0.07,0.17

  A scene is a folder with a mesh and scene.yaml: bodies, supports, loads, contacts, parameters. HycoFOM assembles the
  contact system K U + B^T L = F, 0 <= L _|_ D - B U >= 0 at a value of the parameters and solves it. Whatever method
  ran, the four KKT residuals are recomputed: they say whether to believe the answer.
*/
#include <hyco.h>

/* L is stored on rank 0, in the mesh file's order. The call is collective: every rank makes it. */
static PetscErrorCode PrintForces(HycoFOM fom)
{
  PetscInt m, largest = 0;
  const PetscReal *L;

  PetscFunctionBeginUser;
  PetscCall(HycoFOMGetSolution(fom, NULL, NULL, &m, &L, NULL, NULL));
  for (PetscInt i = 0; i < m; i++) largest = L[i] > L[largest] ? i : largest;
  if (m) PetscCall(PetscPrintf(PETSC_COMM_SELF, "largest of %d forces: %.10g\n", (int)m, (double)L[largest]));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoScene scene;
  HycoFOM fom;
  HycoSummary s;
  char folder[PETSC_MAX_PATH_LEN] = "examples/rope";
  PetscReal mu[8];
  PetscInt n = 8;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-scene", folder, sizeof(folder), NULL));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n, NULL));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene)); /* entries can be overridden: -body_rope_young 2 */
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));    /* reads the mesh */
  PetscCall(HycoFOMSolve(fom, n, mu)); /* -hyco_solver_view describes it; -help lists the options */
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: %d of %d contacts closed, force %.10g\n", HycoReasonName(s.reason),
                        (int)s.n_active, (int)s.n_contacts, (double)s.total_contact_force));
  PetscCall(PetscPrintf(
      PETSC_COMM_WORLD, "KKT: equilibrium %.1e, penetration %.1e, adhesion %.1e, complementarity %.1e\n",
      (double)s.kkt.stationarity, (double)s.kkt.penetration, (double)s.kkt.adhesion, (double)s.kkt.complementarity));
  PetscCall(PrintForces(fom));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
