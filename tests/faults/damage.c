/*
  Files truncated at many lengths and with seeded flipped bits, in one process with limited address space: a sealed file
  is refused whatever bit changed; a file of format 3, without a seal, is refused if truncated; with a flipped bit it is
  refused or read, without a crash and without a huge allocation. Prints the counts for docs/limits/faults.csv.
*/
#include "../unit/check.h"
#include <hyco.h>
#include <hycoh5.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static char path[128];
static FILE *rows; /* faults/damage.csv: rows that table.py puts into docs/limits/faults.csv */

typedef struct {
  unsigned char *bytes;
  size_t size;
} Bytes;

static PetscErrorCode ReadBytes(const char name[], Bytes *b)
{
  FILE *file = fopen(name, "rb");

  PetscFunctionBegin;
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_USER, "%s cannot be opened", name);
  fseek(file, 0, SEEK_END);
  b->size = (size_t)ftell(file);
  rewind(file);
  PetscCall(PetscMalloc1(b->size, &b->bytes));
  PetscCheck(fread(b->bytes, 1, b->size, file) == b->size, PETSC_COMM_SELF, PETSC_ERR_USER, "%s cannot be read", name);
  fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void WriteBytes(const unsigned char *bytes, size_t size)
{
  FILE *file = fopen(path, "wb");

  if (!file || fwrite(bytes, 1, size, file) != size || fclose(file)) abort();
}

/* Whether the model is refused; its prediction if not. The message must name the file. */
static PetscErrorCode Try(PetscBool *refused, PetscReal *force)
{
  const PetscReal mu[2] = {0.07, 0.17};
  HycoROM model = NULL;
  HycoPrediction p = {0};
  PetscErrorCode code;
  char line[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoCatchBegin());
  code = HycoROMLoad(path, &model);
  if (!code) code = HycoROMPredict(model, 2, mu);
  if (!code) code = HycoROMGetPrediction(model, &p);
  PetscCall(HycoCatchEnd(code, line));
  PetscCall(HycoROMDestroy(&model));
  CHECK(!code || line[0], "a refusal without a word");
  *refused = (PetscBool)(code != 0);
  *force = p.total_contact_force;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model file that is cut anywhere is refused. */
static PetscErrorCode TestCuts(const char what[], const Bytes *b, size_t step)
{
  PetscInt n = 0, loaded = 0;

  PetscFunctionBegin;
  for (size_t length = 0; length < b->size; length += length + 40 < b->size ? step : 1) {
    PetscBool refused;
    PetscReal force;

    WriteBytes(b->bytes, length);
    PetscCall(Try(&refused, &force));
    CHECK(refused, "%s cut to %ld of %ld bytes is read", what, (long)length, (long)b->size);
    n++;
    loaded += !refused;
  }
  printf("%s cut at %d lengths: %d read\n", what, (int)n, (int)loaded);
  fprintf(rows, "\"%s: cut (%d lengths)\",all refused\n", what, (int)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model file with flipped bits is refused, or gives the right force. */
static PetscErrorCode TestFlips(const char what[], const Bytes *b, PetscInt n, PetscBool sealed)
{
  unsigned long long state = 6;
  PetscInt loaded = 0, other = 0;
  PetscBool refused;
  PetscReal right, force;

  PetscFunctionBegin;
  WriteBytes(b->bytes, b->size);
  PetscCall(Try(&refused, &right));
  CHECK(!refused, "%s is refused as it is", what);
  for (PetscInt k = 0; k < n; k++) {
    const size_t bit = (size_t)((Draw(&state) + 1) / 2 * 8 * (double)b->size);

    b->bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
    WriteBytes(b->bytes, b->size);
    b->bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
    PetscCall(Try(&refused, &force));
    CHECK(refused || !sealed, "%s with bit %ld flipped is read", what, (long)bit);
    loaded += !refused;
    other += !refused && force != right;
  }
  printf("%s with one of %d bits flipped: %d read, %d of them with another result\n", what, (int)n, (int)loaded,
         (int)other);
  if (sealed)
    fprintf(rows, "\"%s: one bit flipped (%d)\",all refused\n", what, (int)n);
  else
    fprintf(rows, "\"%s: one bit flipped (%d)\",\"no crash; %d are read, %d of these with another result\"\n", what,
            (int)n, (int)loaded, (int)other);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static double Seconds(void)
{
  return (double)clock() / CLOCKS_PER_SEC;
}

/* The cost of the seal for a file of the size of a large model: printed, and small. */
static PetscErrorCode TestSealTime(void)
{
  const PetscInt n = 37000000 / 8;
  unsigned char seal[HYCO_CHECKSUM];
  double written, seal_written, read, seal_read;
  PetscReal *v;
  size_t size;
  PetscBool sealed;
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &v));
  for (PetscInt k = 0; k < n; k++) v[k] = 1.0 / (double)(k + 1);
  written = -Seconds();
  PetscCall(HycoH5Create(path, &h));
  PetscCall(HycoH5WriteReal(h, "v", n, 1, v));
  PetscCall(HycoH5Close(&h, PETSC_TRUE));
  written += Seconds();
  seal_written = -Seconds();
  HycoChecksumMake(v, (size_t)n * sizeof(*v), seal);
  seal_written += Seconds();
  read = -Seconds();
  PetscCall(HycoH5Open(path, &h));
  PetscCall(HycoH5ReadReal(h, "v", n, 1, v));
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  read += Seconds();
  seal_read = -Seconds();
  PetscCall(HycoChecksumCheck(path, &size, &sealed));
  seal_read += Seconds();
  CHECK(sealed && v[1] == 0.5, "what was written is not what is read");
  CHECK(seal_written < 1 && seal_read < 1, "the seal takes %g s to make, %g s to check", seal_written, seal_read);
  fprintf(rows,
          "\"the seal of %.0f MB, in processor time\",\"%.0f ms of the %.0f ms of writing, %.0f ms of the %.0f ms of "
          "reading\"\n",
          (double)size / 1e6, 1e3 * seal_written, 1e3 * written, 1e3 * seal_read, 1e3 * read);
  PetscCall(PetscFree(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Trained in /tmp, in the current format. */
static PetscErrorCode Train(const char source[], const char type[], const char model[])
{
  const PetscInt grid[] = {3, 3};
  char folder[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;

  PetscFunctionBegin;
  snprintf(folder, sizeof(folder), "%s/examples/rope", source);
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, folder, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_FALSE));
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_model_type", type));
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, model, NULL));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const struct rlimit limit = {(rlim_t)4 << 30, (rlim_t)4 << 30};
  const char *source = getenv("HYCO_SOURCE");
  char folder[] = "/tmp/hyco_damage_XXXXXX", name[PETSC_MAX_PATH_LEN], command[PETSC_MAX_PATH_LEN];
  Bytes b;

  PetscFunctionBegin;
  PetscCheck(source && mkdtemp(folder), PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set, or no /tmp");
#if !defined(__SANITIZE_ADDRESS__)
  setrlimit(RLIMIT_AS, &limit);
#endif
  (void)limit;
  mkdir("faults", 0777);
  rows = fopen("faults/damage.csv", "w");
  PetscCheck(rows, PETSC_COMM_SELF, PETSC_ERR_USER, "faults/damage.csv cannot be written");
  snprintf(path, sizeof(path), "%s/damaged.h5", folder);
  PetscCall(TestSealTime());
  snprintf(name, sizeof(name), "%s/model.h5", folder);
  PetscCall(Train(source, HYCO_ROM_HYBRID, name));
  PetscCall(ReadBytes(name, &b));
  PetscCall(TestCuts("a hybrid model", &b, 97));
  PetscCall(TestFlips("a hybrid model", &b, 3000, PETSC_TRUE));
  PetscCall(PetscFree(b.bytes));
  snprintf(name, sizeof(name), "%s/model.h5", folder);
  PetscCall(Train(source, HYCO_ROM_BODIES, name));
  PetscCall(ReadBytes(name, &b));
  PetscCall(TestCuts("a model of bodies", &b, 997));
  PetscCall(TestFlips("a model of bodies", &b, 2000, PETSC_TRUE));
  PetscCall(PetscFree(b.bytes));
  snprintf(name, sizeof(name), "%s/tests/data/rope-hybrid-3.h5", source);
  PetscCall(ReadBytes(name, &b));
  PetscCall(TestCuts("a hybrid model of format 3, without a seal", &b, 997));
  PetscCall(TestFlips("a hybrid model of format 3, without a seal", &b, 2000, PETSC_FALSE));
  PetscCall(PetscFree(b.bytes));
  fclose(rows);
  snprintf(command, sizeof(command), "rm -r %s", folder);
  CHECK(system(command) == 0, "%s is left", folder);
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
