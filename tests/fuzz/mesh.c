/* Fuzz target: the bytes are a gmsh mesh. A mesh that is accepted is assembled and solved. The scene is fixed:
   bodies "a" and, if the mesh contains the word "b", "b", in contact from "up" to "low"; "held" is fixed, "pushed"
   has a pressure. */
#include "fuzz.h"
#include <hycofom.h>
#include <hycosceneimpl.h>

static char path[128];

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  FuzzStart();
  FuzzPath("mesh.msh", path);
  return 0;
}

static PetscBool Holds(const uint8_t *data, size_t size, const char word[])
{
  const size_t n = strlen(word);

  for (size_t k = 0; k + n <= size; k++) {
    if (memcmp(data + k, word, n) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscErrorCode Solve(HycoScene *scene, HycoFOM *fom, PetscBool two, PetscBool pushed)
{
  static char *key[] = {"body_a_young", "fixed_held_x",   "scene_mesh",      "pressure_pushed", "body_b_young",
                        "fixed_held_y", "contact_c_type", "contact_c_slave", "contact_c_master"},
              *value[] = {"1", "0", "mesh.msh", "1e-3", "2", "0", "surface", "up", "low"};

  PetscFunctionBegin;
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, two ? 9 : pushed ? 4 : 3, key, value, fuzz_folder, scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, *scene, fom));
  PetscCall(HycoFOMSolve(*fom, 0, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  HycoScene scene = NULL;
  HycoFOM fom = NULL;
  PetscErrorCode code;

  FuzzWrite(path, data, size);
  FUZZ_TRY(code, Solve(&scene, &fom, Holds(data, size, "\"b\""), Holds(data, size, "\"pushed\"")));
  if (HycoFOMDestroy(&fom) || HycoSceneDestroy(&scene)) abort();
  return 0;
}
