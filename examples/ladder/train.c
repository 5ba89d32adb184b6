/*
  Step 2: learn a reduced model from solutions, then predict.

      build/ladder/train -scene examples/rope -model rope.h5 -mu 0.07,0.17

  HycoReducer solves the points of a set full order (they are kept in MODEL.snapshots: an interrupted run goes on),
  finds the bases, the reduced integration domain and the full-order displacements in it, and writes one file. HycoROM
  needs that file alone. A prediction estimates its own errors, as far as the training has held solutions out.
*/
#include <hyco.h>

/* 6 x 6 points, the centres of a grid's cells. Options set the reduction: -hyco_pod_tol 1e-9. */
static PetscErrorCode Train(HycoScene scene, const char file[])
{
  const PetscInt grid[] = {6, 6};
  HycoSamples samples;
  HycoReducer reducer;
  HycoTraining t;

  PetscFunctionBeginUser;
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_TRUE));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, file, &t));
  PetscCall(
      PetscPrintf(PETSC_COMM_WORLD, "%d training solutions, %d modes, RID of %d elements; held-out error of u %.2e\n",
                  (int)t.n_samples, (int)t.n_modes, (int)t.rid_elements, (double)t.held_out.largest[HYCO_ERROR_U]));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoScene scene;
  HycoROM model;
  HycoPrediction p;
  char folder[PETSC_MAX_PATH_LEN] = "examples/rope", file[PETSC_MAX_PATH_LEN] = "rope.h5";
  PetscReal mu[2] = {0.07, 0.17};
  PetscInt n = 2;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-scene", folder, sizeof(folder), NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-model", file, sizeof(file), NULL));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n, NULL));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(Train(scene, file));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(HycoROMLoad(file, &model)); /* on each rank separately: a model is small */
  PetscCall(HycoROMPredict(model, 2, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: force %.10g, estimated error of u %.1e\n", HycoReasonName(p.reason),
                        (double)p.total_contact_force, (double)p.estimated_error_u));
  PetscCall(HycoROMDestroy(&model));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
