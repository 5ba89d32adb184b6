/* Handles on one model: each prediction is bitwise that of a model loaded alone, whatever the others predict meanwhile;
   what the file holds exists once; handles are destroyed in any order. Every type, and paths. */
#include "check.h"
#include <hyco.h>
#include <hycomaterialimpl.h>
#include <hycoromimpl.h>
#include <unistd.h>

static const char *source;

/* The options of a case, a name and its value each; they are cleared again. */
static PetscErrorCode SetOptions(const char *const option[], PetscBool set)
{
  PetscFunctionBegin;
  for (int k = 0; option[k]; k += 2)
    PetscCall(set ? PetscOptionsSetValue(NULL, option[k], option[k + 1]) : PetscOptionsClearValue(NULL, option[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Train(const char example[], const PetscInt counts[], const char *const option[],
                            const char path[])
{
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;

  PetscFunctionBegin;
  PetscCall(SetOptions(option, PETSC_TRUE));
  snprintf(folder, sizeof(folder), "%s/examples/%s", source, example);
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, folder, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_FALSE));
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, path, NULL));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscCall(SetOptions(option, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a prediction gives, copied: forces, displacements of the whole mesh, stresses. */
typedef struct {
  PetscInt n[3];
  PetscReal *value[3];
  PetscReal total;
} Result;

static PetscErrorCode Predict(HycoROM m, const PetscReal mu[2], Result *r)
{
  const PetscReal *each[3];
  HycoPrediction p;
  PetscInt dim;

  PetscFunctionBegin;
  PetscCall(HycoROMPredict(m, 2, mu));
  PetscCall(HycoROMGetPrediction(m, &p));
  r->total = p.total_contact_force;
  PetscCall(HycoROMGetSizes(m, NULL, NULL, &dim));
  PetscCall(HycoROMGetLambda(m, &r->n[0], &each[0], NULL, NULL));
  PetscCall(HycoROMGetWholeU(m, &r->n[1], &each[1]));
  r->n[1] *= dim;
  PetscCall(HycoROMGetRID(m, NULL, NULL, NULL, &r->n[2], NULL, &each[2]));
  r->n[2] *= HycoStrainSize(dim);
  for (int k = 0; k < 3; k++) HycoDuplicate(r->n[k], each[k], &r->value[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Drop(Result *r)
{
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(PetscFree(r->value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void CheckEqual(const char type[], int call, const Result *found, const Result *expected)
{
  static const char *const what[] = {"forces", "displacements", "stresses"};

  for (int k = 0; k < 3; k++)
    CHECK(found->n[k] == expected->n[k] &&
              !memcmp(found->value[k], expected->value[k], (size_t)found->n[k] * sizeof(PetscReal)),
          "%s, call %d: %s are not those of a model loaded alone (total force %.17g, alone %.17g)", type, call, what[k],
          (double)found->total, (double)expected->total);
}

/* Four calls on three handles, one of which is destroyed before the last. */
static PetscErrorCode TestHandles(const char type[], const char path[], const PetscReal mu[4][2])
{
  HycoROM handle[3];
  Result alone[4], found;

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) {
    HycoROM fresh;

    PetscCall(HycoROMLoad(path, &fresh));
    PetscCall(Predict(fresh, mu[k], &alone[k]));
    PetscCall(HycoROMDestroy(&fresh));
    for (int j = 0; j < k; j++) CHECK(alone[k].total != alone[j].total, "%s: points %d and %d are alike", type, j, k);
  }
  PetscCall(HycoROMLoad(path, &handle[0]));
  PetscCall(HycoROMClone(handle[0], &handle[1]));
  PetscCall(HycoROMClone(handle[1], &handle[2]));
  CHECK(handle[0]->model == handle[2]->model && handle[0]->model->references == 3, "%s: %d handles", type,
        (int)handle[0]->model->references);
  for (int k = 0; k < 3; k++) PetscCall(HycoROMPredict(handle[k], 2, mu[k]));
  for (int k = 0; k < 3; k++) { /* each has kept its own */
    HycoPrediction p;

    PetscCall(HycoROMGetPrediction(handle[k], &p));
    CHECK(p.total_contact_force == alone[k].total, "%s, handle %d: force %.17g, alone %.17g", type, k,
          (double)p.total_contact_force, (double)alone[k].total);
  }
  PetscCall(HycoROMDestroy(&handle[0])); /* the one that was loaded */
  PetscCall(Predict(handle[2], mu[3], &found));
  CheckEqual(type, 3, &found, &alone[3]);
  PetscCall(Drop(&found));
  PetscCall(HycoROMDestroy(&handle[2]));
  PetscCall(Predict(handle[1], mu[1], &found));
  CheckEqual(type, 1, &found, &alone[1]);
  PetscCall(Drop(&found));
  PetscCall(HycoROMDestroy(&handle[1]));
  for (int k = 0; k < 4; k++) PetscCall(Drop(&alone[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A handle more takes less memory than the model's modes on the whole mesh beside those on its own. */
static PetscErrorCode TestMemory(const char type[], const char path[], const PetscReal mu[2])
{
  PetscLogDouble begin, one, two;
  HycoROM first, second;
  Result r;

  PetscFunctionBegin;
  PetscCall(PetscMallocGetCurrentUsage(&begin));
  PetscCall(HycoROMLoad(path, &first));
  PetscCall(Predict(first, mu, &r));
  PetscCall(Drop(&r));
  PetscCall(PetscMallocGetCurrentUsage(&one));
  PetscCall(HycoROMClone(first, &second));
  PetscCall(Predict(second, mu, &r));
  PetscCall(Drop(&r));
  PetscCall(PetscMallocGetCurrentUsage(&two));
  CHECK(begin > 0, "PETSc keeps no books of its memory");
  CHECK(two - one <= one - begin - (PetscLogDouble)first->model->l * first->model->whole->n_nodes * sizeof(PetscReal),
        "%s: the model takes %g bytes, a handle more %g", type, one - begin, two - one);
  PetscCall(HycoROMDestroy(&second));
  PetscCall(HycoROMDestroy(&first));
  PetscCall(PetscMallocGetCurrentUsage(&two));
  CHECK(two == begin, "%s: %g bytes before, %g after", type, begin, two);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of one handle are not the others'; a clone begins with those of its origin. */
static PetscErrorCode TestOptions(const char path[])
{
  HycoROM first, second;

  PetscFunctionBegin;
  PetscCall(HycoROMLoad(path, &first));
  PetscCall(HycoROMSetReconstruct(first, PETSC_FALSE));
  PetscCall(HycoROMClone(first, &second));
  CHECK(!second->reconstruct, "the clone reconstructs");
  PetscCall(HycoROMSetReconstruct(second, PETSC_TRUE));
  CHECK(!first->reconstruct, "the option of the clone is its origin's");
  CHECK_FAILS(HycoROMClone(NULL, &second), "HycoROMClone");
  PetscCall(HycoROMDestroy(&first));
  PetscCall(HycoROMDestroy(&second));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestCase(const char example[], const char *const option[], const PetscReal mu[4][2])
{
  const char *const type = option[1];
  const PetscInt counts[2] = {3, 3};
  char path[64];

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "clone-%s-%s-%d.h5", example, type, (int)getpid());
  PetscCall(Train(example, counts, option, path));
  PetscCall(TestHandles(type, path, mu));
  PetscCall(TestMemory(type, path, mu[0]));
  PetscCall(TestOptions(path));
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction of a handle's path stays its own while another predicts, and when that one is destroyed. */
static PetscErrorCode TestFriction(void)
{
  const char *const option[] = {"-hyco_model_type", HYCO_ROM_BODIES, "-history_times", "0,1,2", NULL};
  const PetscReal mu[2][3] = {{1300, 0.17, 0.06}, {2200, 0.3, 0.03}};
  const PetscInt counts[3] = {2, 1, 1};
  const HycoContactResult *result;
  PetscReal work[2];
  PetscInt n;
  HycoROM handle[2];
  char path[64];

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "clone-friction-%d.h5", (int)getpid());
  PetscCall(Train("lapjoint", counts, option, path));
  for (int k = 0; k < 2; k++) {
    PetscCall(HycoROMLoad(path, &handle[0]));
    PetscCall(HycoROMPredict(handle[0], 3, mu[k]));
    PetscCall(HycoROMGetContacts(handle[0], &n, &result));
    work[k] = result[0].friction_work;
    PetscCall(HycoROMDestroy(&handle[0]));
  }
  CHECK(work[0] > 0 && work[1] > 0 && work[0] != work[1], "works of friction %g and %g", (double)work[0],
        (double)work[1]);
  PetscCall(HycoROMLoad(path, &handle[0]));
  PetscCall(HycoROMClone(handle[0], &handle[1]));
  for (int k = 0; k < 2; k++) PetscCall(HycoROMPredict(handle[k], 3, mu[k]));
  PetscCall(HycoROMGetContacts(handle[0], &n, &result));
  CHECK(!handle[0]->model->pairs.shear, "the friction of a prediction is in the model");
  CHECK(result[0].friction_work == work[0], "beside another handle %g, alone %g", (double)result[0].friction_work,
        (double)work[0]);
  PetscCall(HycoROMDestroy(&handle[1]));
  PetscCall(HycoROMGetContacts(handle[0], &n, &result));
  CHECK(result[0].friction_work == work[0], "after another handle %g, alone %g", (double)result[0].friction_work,
        (double)work[0]);
  PetscCall(HycoROMDestroy(&handle[0]));
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  static const struct {
    const char *type;
    PetscBool rope, ring;
  } cases[] = {{HYCO_ROM_HYBRID, PETSC_TRUE, PETSC_TRUE},
               {HYCO_ROM_PROJECTION, PETSC_TRUE, PETSC_FALSE},
               {HYCO_ROM_BODIES, PETSC_TRUE, PETSC_TRUE},
               {HYCO_ROM_CUBATURE, PETSC_FALSE, PETSC_TRUE},
               {HYCO_ROM_REGRESSION, PETSC_TRUE, PETSC_TRUE}};
  const PetscReal rope[4][2] = {{0.1, 0.1}, {0.2, 0.3}, {0.07, 0.45}, {0.2, 0.1}};
  const PetscReal ring[4][2] = {{0.007, 1.1}, {0.015, 0.7}, {0.01, 1.7}, {0.015, 1.1}};

  PetscFunctionBegin;
  source = getenv("HYCO_SOURCE");
  PetscCheck(source, PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  for (int k = 0; k < 5; k++) {
    const char *const still[] = {"-hyco_model_type", cases[k].type, NULL};
    const char *const path[] = {"-hyco_model_type", cases[k].type, "-history_times", "0,1,2", NULL};

    if (cases[k].rope) PetscCall(TestCase("rope", still, rope));
    if (cases[k].ring) PetscCall(TestCase("ring", path, ring));
  }
  PetscCall(TestFriction());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN_MEMORY
