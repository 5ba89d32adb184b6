/* Fuzz target: the bytes are a scene.yaml. A scene that loads is converted to its text form and back, and solved on
   a rope of eight elements (whatever mesh it names). */
#include "fuzz.h"
#include <hycofom.h>
#include <hycosceneimpl.h>

static char mesh[128], yaml[128];

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  FILE *file;

  (void)argc, (void)argv;
  FuzzStart();
  FuzzPath("rope.msh", mesh);
  FuzzPath("scene.yaml", yaml);
  file = fopen(mesh, "w");
  if (!file) abort();
  fprintf(file, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n0 1 \"ends\"\n1 2 \"rope\"\n"
                "$EndPhysicalNames\n$Nodes\n9\n");
  for (int k = 0; k < 9; k++) fprintf(file, "%d %g 0 0\n", k + 1, k / 8.0);
  fprintf(file, "$EndNodes\n$Elements\n10\n1 15 2 1 1 1\n2 15 2 1 2 9\n");
  for (int k = 1; k < 9; k++) fprintf(file, "%d 1 2 2 1 %d %d\n", k + 2, k, k + 1);
  fprintf(file, "$EndElements\n");
  fclose(file);
  return 0;
}

static PetscErrorCode RoundTrip(HycoScene scene)
{
  HycoScene again;
  char *text;

  PetscFunctionBegin;
  PetscCall(HycoSceneToText(scene, &text));
  PetscCall(HycoSceneFromText(PETSC_COMM_SELF, text, &again));
  PetscCheck(again->n_entries == scene->n_entries, PETSC_COMM_SELF, PETSC_ERR_PLIB, "entries were lost");
  PetscCall(HycoSceneDestroy(&again));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(HycoScene scene, HycoFOM *fom)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscFree(scene->mesh_path));
  PetscCall(PetscStrallocpy(mesh, &scene->mesh_path));
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, scene, fom));
  for (PetscInt p = 0; p < scene->n_parameters; p++) mu[p] = scene->lo[p];
  PetscCall(HycoFOMSolve(*fom, scene->n_parameters, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  HycoScene scene = NULL;
  HycoFOM fom = NULL;
  PetscErrorCode code;

  FuzzWrite(yaml, data, size);
  FUZZ_TRY(code, HycoSceneLoad(PETSC_COMM_SELF, yaml, &scene));
  if (code) return 0;
  FUZZ_TRY(code, RoundTrip(scene));
  if (code) abort(); /* a scene that is accepted must fit into a model file */
  FUZZ_TRY(code, Solve(scene, &fom));
  if (HycoFOMDestroy(&fom) || HycoSceneDestroy(&scene)) abort();
  return 0;
}
