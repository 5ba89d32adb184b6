/* A program as a user writes it, with the error selected by its first argument. */
#include <hyco.h>
#include <string.h>

static PetscErrorCode Run(const char what[], const char folder[])
{
  const PetscReal far[2] = {9, 9};
  HycoScene scene = NULL;
  HycoFOM fom = NULL;
  HycoROM model;
  HycoSamples samples;

  PetscFunctionBeginUser;
  if (strcmp(what, "scene") == 0) PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, "/no/such", &scene));
  if (strcmp(what, "model") == 0) PetscCall(HycoROMLoad("/no/such.h5", &model));
  if (strcmp(what, "null") == 0) PetscCall(HycoFOMSolve(fom, 2, far));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  if (strcmp(what, "class") == 0) PetscCall(HycoFOMSolve((HycoFOM)scene, 2, far));
  if (strcmp(what, "samples") == 0) {
    PetscCall(HycoSamplesCreate(scene, &samples));
    PetscCall(HycoSamplesAddFile(samples, "/no/such.csv"));
  }
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  if (strcmp(what, "order") == 0) PetscCall(HycoFOMWrite(fom, "x.xdmf"));
  if (strcmp(what, "range") == 0) PetscCall(HycoFOMSolve(fom, 2, far));
  if (strcmp(what, "count") == 0) PetscCall(HycoFOMSolve(fom, 1, far));
  if (strcmp(what, "petsc") == 0) PetscCall(PetscOptionsSetAlias(NULL, "x", "-y"));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : ""));
  return (int)HycoFinalize();
}
