/* hyco from a program of your own: a scene, a full-order solution, a reduced model, a prediction.

     examples/embed examples/rope model.h5 0.07 0.17
*/
#include <hyco.h>
#include <petscviewer.h>
#include <stdio.h>
#include <stdlib.h>

static PetscErrorCode Run(const char *folder, const char *file, PetscInt n, const PetscReal mu[])
{
  HycoScene scene;
  HycoFOM fom;
  HycoSummary full;
  HycoSamples samples;
  HycoReducer reducer;
  HycoROM model;
  HycoTraining training;
  HycoPrediction reduced;
  const PetscInt grid[] = {6, 6};

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom)); /* full order */
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &full));
  PetscCall(HycoSamplesCreate(scene, &samples)); /* the region of the model */
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_FALSE));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, file, &training));
  /* A model is written whatever its errors are: look at those of held-out solutions. */
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "largest held-out errors: u %.2g, contact forces %.2g\n",
                        (double)training.held_out.largest[HYCO_ERROR_U],
                        (double)training.held_out.largest[HYCO_ERROR_LAMBDA]));
  PetscCall(HycoROMLoad(file, &model)); /* predict; needs only the model file */
  PetscCall(HycoROMPredict(model, n, mu));
  PetscCall(HycoROMGetPrediction(model, &reduced));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "contact force: full order %.6f (%s), reduced %.6f (%s, %.0f us)\n",
                        (double)full.total_contact_force, HycoReasonName(full.reason),
                        (double)reduced.total_contact_force, HycoReasonName(reduced.reason),
                        1e6 * (double)reduced.seconds.total));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal mu[2];

  if (argc < 5) {
    fprintf(stderr,
            "usage: embed SCENE MODEL.h5 MU1 MU2, a scene of two parameters: embed examples/rope m.h5 0.07 0.17\n");
    return 2;
  }
  mu[0] = atof(argv[3]);
  mu[1] = atof(argv[4]);
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run(argv[1], argv[2], 2, mu));
  return (int)HycoFinalize();
}
