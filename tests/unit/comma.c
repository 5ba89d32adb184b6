/* A program whose locale writes 0,5 for 0.5 reads scenes, meshes, points and options correctly. */
#include "check.h"
#include <hyco.h>
#include <locale.h>
#include <unistd.h>

static char model_path[128], points_path[128];

/* Sets a locale with a comma; false: this machine has none. */
static PetscBool SetComma(void)
{
  static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8",  "fr_FR.UTF-8", "fr_FR.utf8", "es_ES.UTF-8",
                                      "it_IT.UTF-8", "pt_BR.UTF-8", "ru_RU.UTF-8", "de_DE",      "fr_FR"};

  for (size_t k = 0; k < sizeof(names) / sizeof(names[0]); k++) {
    if (setlocale(LC_ALL, names[k]) && localeconv()->decimal_point[0] == ',') return PETSC_TRUE;
  }
  setlocale(LC_ALL, "C");
  return PETSC_FALSE;
}

/* Full order at the point of a file, and a model of nine points there. */
static PetscErrorCode Run(const char scene_path[], PetscReal force[2])
{
  const PetscInt counts[2] = {3, 3};
  const PetscReal *mu;
  HycoScene scene;
  HycoSamples point, grid;
  HycoFOM fom;
  HycoSummary summary;
  HycoReducer reducer;
  HycoROM model;
  HycoPrediction p;

  PetscFunctionBegin;
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, scene_path, &scene));
  PetscCall(HycoSamplesCreate(scene, &point));
  PetscCall(HycoSamplesAddFile(point, points_path));
  PetscCall(HycoSamplesGet(point, NULL, NULL, &mu));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, 2, mu));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  force[0] = summary.total_contact_force;
  PetscCall(HycoSamplesCreate(scene, &grid));
  PetscCall(HycoSamplesAddGrid(grid, counts, PETSC_TRUE));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerSetValidationCount(reducer, 0));
  PetscCall(HycoReducerRun(reducer, grid, model_path, NULL));
  PetscCall(HycoROMLoad(model_path, &model));
  PetscCall(HycoROMPredict(model, 2, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  force[1] = p.total_contact_force;
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&grid));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&point));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const char *source = getenv("HYCO_SOURCE");
  char scene[PETSC_MAX_PATH_LEN], command[512];
  PetscReal plain[2], comma[2];
  FILE *file;

  PetscFunctionBegin;
  CHECK(source, "HYCO_SOURCE names the tree");
  snprintf(scene, sizeof(scene), "%s/examples/rope", source ? source : ".");
  snprintf(model_path, sizeof(model_path), "/tmp/hyco_comma_%ld.h5", (long)getpid());
  snprintf(points_path, sizeof(points_path), "/tmp/hyco_comma_%ld.csv", (long)getpid());
  file = fopen(points_path, "w");
  fprintf(file, "mu1,mu2\n0.07,0.17\n");
  fclose(file);
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_pod_tol", "1.5e-9"));
  PetscCall(Run(scene, plain));
  if (SetComma()) {
    PetscCall(Run(scene, comma));
    CHECK_NEAR(comma[0], plain[0], 1e-14 * plain[0]);
    CHECK_NEAR(comma[1], plain[1], 1e-14 * plain[1]);
    CHECK(localeconv()->decimal_point[0] == ',', "the program's locale was changed");
    snprintf(command, sizeof(command), "%.1f", 0.5);
    CHECK(strcmp(command, "0,5") == 0, "the program writes %s", command);
    setlocale(LC_ALL, "C");
  } else
    printf("skipped: no locale with a comma is installed here\n");
  CHECK(plain[0] > 0.1 && plain[1] > 0.1, "forces %g and %g", (double)plain[0], (double)plain[1]);
  snprintf(command, sizeof(command), "rm -r %s %s %s.snapshots", points_path, model_path, model_path);
  CHECK(system(command) == 0, "%s", command);
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
