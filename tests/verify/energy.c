/*
  The energies of full-order solutions, one line for each point: test_energy SCENE V,V V,V ... [options]. Points with
  the same stiffness share a factorisation, so that a ramp costs little more than one solve.
*/
#include <hyco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static PetscErrorCode Solve(HycoFOM fom, const char text[])
{
  HycoSummary s;
  PetscReal mu[16];
  PetscInt n = 16;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsSetValue(NULL, "-point", text));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-point", mu, &n, &set));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCheck(s.reason > 0, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "%s at %s", HycoReasonName(s.reason), text);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d %.17g %.17g %.17g %.17g\n", (int)s.n_active, (double)s.strain_energy,
                        (double)s.external_work, (double)s.gap_work, (double)s.energy_defect));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  HycoScene scene;
  HycoFOM fom;

  PetscCall(HycoInitialize(&argc, &argv));
  PetscCheck(argc > 2, PETSC_COMM_WORLD, PETSC_ERR_USER, "test_energy SCENE V,V ...");
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, argv[1], &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  for (int k = 2; k < argc && argv[k][0] != '-'; k++) PetscCall(Solve(fom, argv[k]));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  return (int)HycoFinalize();
}
