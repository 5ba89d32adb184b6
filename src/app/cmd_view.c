/* hyco view: describes a model or a scene. */
#include "driver.h"
#include <petscviewer.h>

PetscErrorCode DeclareView(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model is loaded on rank 0 alone, where it is printed; a scene on all, because its check of the mesh is
   collective. */
PetscErrorCode CommandView(void)
{
  char path[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN];
  HycoROM model = NULL;
  HycoScene scene;

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, file, NULL, NULL, NULL));
  /* Exactly one of the two. */
  HycoCheck(!path[0] != !file[0], "give -model FILE.h5 or -scene FOLDER");
  if (file[0]) {
    HycoOnRoot(PETSC_COMM_WORLD, HycoROMLoad(file, &model));
    PetscCall(DriverCheckLeft());
    if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(HycoROMView(model, PETSC_VIEWER_STDOUT_SELF));
    PetscCall(HycoROMDestroy(&model));
  } else {
    PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
    PetscCall(DriverCheckLeft());
    PetscCall(HycoSceneCheckMesh(PETSC_COMM_WORLD, scene));
    if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(HycoSceneView(scene, PETSC_VIEWER_STDOUT_SELF));
    PetscCall(HycoSceneDestroy(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
