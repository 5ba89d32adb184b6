/*
  Fuzz target: the bytes change the datasets of a valid model file. First byte: which of the models of tests/data; then
  records of 12 bytes: dataset (1), unused (1), item (2, modulo the dataset's length), value (8). The file keeps its
  structure, and gets a valid seal, so that the reader's checks of the values are tested, not HDF5's checks of the
  structure. A model that loads then predicts, also on the whole mesh.
*/
#include "fuzz.h"
#include <hdf5.h>
#include <hycocompat.h>
#include <hycoromimpl.h>

#define N_MODELS 4
#define RECORD   12

typedef struct {
  size_t at, bytes, item; /* offset of the values in the file, their bytes, bytes of one value */
} Set;

typedef struct {
  uint8_t *bytes;
  size_t size, n; /* size without the seal */
  int sealed;
  Set set[128];
} Good;

static Good good[N_MODELS];
static char path[128];

static herr_t NoteSet(hid_t file, const char name[], const HycoH5Info *info, void *ctx)
{
  Good *g = (Good *)ctx;
  hid_t set, type;
  Set *s = &g->set[g->n];

  if (info->type != H5O_TYPE_DATASET || g->n == 128) return 0;
  set = H5Dopen2(file, name, H5P_DEFAULT);
  type = H5Dget_type(set);
  s->item = H5Tget_size(type);
  s->bytes = (size_t)H5Dget_storage_size(set);
  s->at = (size_t)H5Dget_offset(set);
  if (s->bytes) g->n++;
  H5Tclose(type);
  H5Dclose(set);
  return 0;
}

static void ReadGood(const char name[], Good *g)
{
  char file_name[1024];
  FILE *file;
  hid_t h;

  snprintf(file_name, sizeof(file_name), "%s/tests/data/%s", getenv("HYCO_SOURCE") ? getenv("HYCO_SOURCE") : ".", name);
  file = fopen(file_name, "rb");
  if (!file) abort();
  fseek(file, 0, SEEK_END);
  g->size = (size_t)ftell(file);
  rewind(file);
  g->bytes = malloc(g->size);
  if (!g->bytes || fread(g->bytes, 1, g->size, file) != g->size) abort();
  fclose(file);
  g->sealed = g->size > HYCO_CHECKSUM && !memcmp(g->bytes + g->size - HYCO_CHECKSUM, "hyco-sum", 8);
  if (g->sealed) g->size -= HYCO_CHECKSUM;
  h = H5Fopen(file_name, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (h < 0 || HycoH5Visit(h, NoteSet, g) < 0) abort();
  H5Fclose(h);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  FuzzStart();
  FuzzPath("model.h5", path);
  ReadGood("rope-hybrid-3.h5", &good[0]);
  ReadGood("rope-projection-3.h5", &good[1]);
  ReadGood("rope-hybrid-4-table.h5", &good[2]);
  ReadGood("rope-bodies-4.h5", &good[3]);
  return 0;
}

static void WriteChanged(const Good *g, const uint8_t *data, size_t size)
{
  uint8_t *bytes = malloc(g->size + HYCO_CHECKSUM);

  if (!bytes) abort();
  memcpy(bytes, g->bytes, g->size);
  for (; size >= RECORD; data += RECORD, size -= RECORD) {
    const Set *s = &g->set[data[0] % g->n];
    const size_t item = (size_t)(data[2] | data[3] << 8) % (s->bytes / s->item);

    memcpy(bytes + s->at + item * s->item, data + 4, s->item < 8 ? s->item : 8);
  }
  if (g->sealed) HycoChecksumMake(bytes, g->size, bytes + g->size);
  FuzzWrite(path, bytes, g->size + (g->sealed ? HYCO_CHECKSUM : 0));
  free(bytes);
}

static PetscErrorCode Predict(HycoROM model)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];
  HycoPrediction prediction;
  HycoScene scene;

  PetscFunctionBegin;
  PetscCall(HycoROMGetScene(model, &scene));
  for (PetscInt p = 0; p < scene->n_parameters; p++) mu[p] = scene->lo[p] / 2 + scene->hi[p] / 2;
  PetscCall(HycoROMPredict(model, scene->n_parameters, mu));
  PetscCall(HycoROMGetPrediction(model, &prediction));
  PetscCall(HycoROMGetWholeU(model, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  HycoROM model = NULL;
  PetscErrorCode code;

  if (!size) return 0;
  WriteChanged(&good[data[0] % N_MODELS], data + 1, size - 1);
  FUZZ_TRY(code, HycoROMLoad(path, &model));
  if (!code) FUZZ_TRY(code, Predict(model));
  if (HycoROMDestroy(&model)) abort();
  return 0;
}
