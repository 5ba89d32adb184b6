/* Options as declared by the classes: each is effective, with its prefix and from its database; views. */
#include "check.h"
#include <hyco.h>
#include <hycoromtype.h>
#include <hycosolverimpl.h>
#include <hycotrainer.h>
#include <unistd.h>

/* Whether an invalid value is refused when it is read: a folder, a group or a viewer may be any word. */
static PetscBool Refuses(const HycoOption *o)
{
  return (PetscBool)(strcmp(o->value, "<folder>") && strncmp(o->value, "<file", 5) && strcmp(o->value, "<viewer>") &&
                     strcmp(o->name, "hyco_rid_groups"));
}

/* An invalid value of any option gives one line that names the option. */
static PetscErrorCode TestHonoured(void)
{
  const HycoOption *table;
  PetscInt n, n_refused = 0;

  PetscFunctionBegin;
  PetscCall(HycoGetOptionTable(&n, &table));
  CHECK(n > 45, "%d options", (int)n);
  for (PetscInt k = 0; k < n; k++) {
    char dashed[128];
    PetscOptions options;

    CHECK(table[k].meaning[0] && table[k].owner[0], "-%s says nothing", table[k].name); /* a flag has no value */
    if (!Refuses(&table[k])) continue;
    n_refused++;
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", table[k].name));
    PetscCall(PetscOptionsCreate(&options));
    PetscCall(PetscOptionsSetValue(options, dashed, "@wrong"));
    CHECK_FAILS(HycoDeclareClasses(options), table[k].name);
    PetscCall(PetscOptionsDestroy(&options));
  }
  CHECK(n_refused > 40, "%d options are refused", (int)n_refused);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LateSetFromOptions(HycoReducer reducer)
{
  PetscReal value = 3;

  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)reducer);
  PetscCall(HycoOptionsReal("-hyco_late", "of a type that a program adds", 0, 9, &value, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TrainLate(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  ops->setfromoptions = LateSetFromOptions;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateLate(HycoROM model)
{
  static const HycoROMTraits traits = {.title = "late"};
  static const HycoROMOps ops = {NULL};

  PetscFunctionBegin;
  PetscCall(HycoROMSetOps(model, &ops, &traits, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A type that is registered after the options were listed has its options too, and its name is in the list of types. */
static PetscErrorCode TestLate(void)
{
  const HycoOption *table, *types;
  PetscInt before, n;

  PetscFunctionBegin;
  PetscCall(HycoGetOptionTable(&before, &table));
  CHECK(!HycoOptionFind("hyco_late"), "-hyco_late is there before its type");
  PetscCall(HycoROMRegister("late", CreateLate));
  PetscCall(HycoGetOptionTable(&n, &table));
  CHECK(n == before && !HycoOptionFind("hyco_late"), "a type without a training has options of it");
  PetscCall(HycoTrainerRegister("late", TrainLate));
  PetscCall(HycoGetOptionTable(&n, &table));
  CHECK(n == before + 1, "%d options, %d before the type was registered", (int)n, (int)before);
  CHECK(HycoOptionFind("hyco_late"), "-hyco_late is not there");
  types = HycoOptionFind("hyco_model_type");
  CHECK(types && strcmp(types->value, "<bodies|cubature|hybrid|late|projection|regression>") == 0, "the types are %s",
        types->value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver with a prefix reads its own options only. */
static PetscErrorCode TestPrefix(void)
{
  HycoSolver plain, other;
  PetscOptions own;

  PetscFunctionBegin;
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_solver_rtol", "1e-5"));
  PetscCall(PetscOptionsSetValue(NULL, "-other_hyco_solver_rtol", "1e-4"));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &plain));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &other));
  PetscCall(HycoSolverSetOptionsPrefix(other, "other_"));
  PetscCall(HycoSolverSetFromOptions(plain));
  PetscCall(HycoSolverSetFromOptions(other));
  CHECK_NEAR(plain->rtol, 1e-5, 0);
  CHECK_NEAR(other->rtol, 1e-4, 0);
  PetscCall(PetscOptionsCreate(&own)); /* a scene's: the prefix is also searched on the command line */
  PetscCall(PetscOptionsSetValue(own, "-hyco_solver_rtol", "1e-6"));
  PetscCall(PetscOptionsSetValue(NULL, "-other_hyco_solver_rtol", "1e-3"));
  PetscCall(PetscObjectSetOptions((PetscObject)plain, own));
  PetscCall(PetscObjectSetOptions((PetscObject)other, own));
  PetscCall(HycoSolverSetFromOptions(plain));
  PetscCall(HycoSolverSetFromOptions(other));
  CHECK_NEAR(plain->rtol, 1e-6, 0);
  CHECK_NEAR(other->rtol, 1e-3, 0);
  PetscCall(PetscOptionsSetValue(NULL, "-other_hyco_solver_rtol", "7"));
  CHECK_FAILS(HycoSolverSetFromOptions(other), "-other_hyco_solver_rtol is \"7\"");
  PetscCall(HycoSolverDestroy(&plain));
  PetscCall(HycoSolverDestroy(&other));
  PetscCall(PetscOptionsDestroy(&own));
  PetscCall(PetscOptionsClearValue(NULL, "-hyco_solver_rtol"));
  PetscCall(PetscOptionsClearValue(NULL, "-other_hyco_solver_rtol"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char told[1 << 16];

/* The text that `view` prints. */
#define VIEWED(call)                                                                                                   \
  do {                                                                                                                 \
    FILE *file_;                                                                                                       \
    PetscCall(PetscViewerASCIIOpen(PETSC_COMM_SELF, "view.txt", &viewer));                                             \
    PetscCall(call);                                                                                                   \
    PetscCall(PetscViewerDestroy(&viewer));                                                                            \
    file_ = fopen("view.txt", "r");                                                                                    \
    told[fread(told, 1, sizeof(told) - 1, file_)] = '\0';                                                              \
    fclose(file_);                                                                                                     \
    remove("view.txt");                                                                                                \
  } while (0)

/* The views of all classes print their settings. */
static PetscErrorCode TestViews(void)
{
  const char *source = getenv("HYCO_SOURCE");
  const PetscInt grid[] = {2, 2};
  const PetscReal mu[] = {0.07, 0.17};
  char folder[PETSC_MAX_PATH_LEN];
  PetscViewer viewer;
  HycoScene scene;
  HycoFOM fom;
  HycoSolver solver;
  HycoSamples samples;
  HycoReducer reducer;
  HycoSnapshots store;

  PetscFunctionBegin;
  snprintf(folder, sizeof(folder), "%s/examples/rope", source ? source : ".");
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_solver_view", ":solver_view.txt"));
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, scene, &fom));
  PetscCall(HycoFOMSolve(fom, 2, mu));
  CHECK(remove("solver_view.txt") == 0, "-hyco_solver_view wrote nothing");
  VIEWED(HycoFOMView(fom, viewer));
  CHECK(strstr(told, "HycoFOM") && strstr(told, "100 nodes, 99 cells, 98 contacts"), "%s", told);
  CHECK(strstr(told, "HycoSystem") && strstr(told, "98 contacts, symmetric"), "%s", told);
  PetscCall(HycoFOMGetSolver(fom, &solver));
  VIEWED(HycoSolverView(solver, viewer));
  CHECK(strstr(told, "type: active_set; form: auto") && strstr(told, "tolerance of the KKT residuals: 1e-08") &&
            strstr(told, "last solve: converged"),
        "%s", told);
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_FALSE));
  VIEWED(HycoSamplesView(samples, viewer));
  CHECK(strstr(told, "4 points of 2 parameters") && strstr(told, "mu1 = 0.1, mu2 = "), "%s", told);
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  VIEWED(HycoReducerView(reducer, viewer));
  CHECK(strstr(told, "settings: hybrid, pod_tol 1e-07, hybrid auto, layers 0"), "%s", told);
  PetscCall(HycoSnapshotsOpen(PETSC_COMM_SELF, scene, "view.snapshots", &store));
  VIEWED(HycoSnapshotsView(store, viewer));
  CHECK(strstr(told, "folder: view.snapshots"), "%s", told);
  PetscCall(HycoSnapshotsDestroy(&store));
  (void)!rmdir("view.snapshots");
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(PetscOptionsClearValue(NULL, "-hyco_solver_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestHonoured());
  PetscCall(TestLate());
  PetscCall(TestPrefix());
  PetscCall(TestViews());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
