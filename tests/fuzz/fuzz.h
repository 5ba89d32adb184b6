/* Common code of the fuzz targets. A target is LLVMFuzzerTestOneInput(): one input, which may be refused, but may
   not crash, leak, hang or allocate without bounds. Run by libFuzzer (scripts/fuzz), or by replay.c over the stored
   corpus (ctest). */
#ifndef FUZZ_H
#define FUZZ_H

#include <dirent.h>
#include <hycoimpl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char fuzz_folder[64]; /* of this process: the input as a file, and further files */

/* A file in the process's folder. */
static inline void FuzzPath(const char name[], char path[128])
{
  snprintf(path, 128, "%s/%s", fuzz_folder, name);
}

static inline void FuzzWrite(const char path[], const void *data, size_t size)
{
  FILE *file = fopen(path, "wb");

  if (!file || fwrite(data, 1, size, file) != size || fclose(file)) abort();
}

/* At the end of the process: removes its folder and the files in it. */
static inline void FuzzRemove(void)
{
  DIR *folder = opendir(fuzz_folder);
  char path[512];

  for (struct dirent *e = folder ? readdir(folder) : NULL; e; e = readdir(folder)) {
    snprintf(path, sizeof(path), "%s/%s", fuzz_folder, e->d_name);
    if (e->d_name[0] != '.') unlink(path);
  }
  if (folder) closedir(folder);
  rmdir(fuzz_folder);
}

static inline void FuzzStart(void)
{
  setenv("PETSC_OPTIONS", "-no_signal_handler", 1); /* the fuzzer handles signals */
  setenv("OMPI_MCA_opal_signal", "", 1);
  snprintf(fuzz_folder, sizeof(fuzz_folder), "/tmp/hyco-fuzz-XXXXXX");
  if (!mkdtemp(fuzz_folder) || atexit(FuzzRemove) || HycoInitialize(NULL, NULL)) abort();
}

/* Runs `call`, which may be refused; an error of PETSc without a message of hyco is a failure. */
#define FUZZ_TRY(code, call)                                                                                           \
  do {                                                                                                                 \
    char line_[HYCO_LINE];                                                                                             \
    if (HycoCatchBegin()) abort();                                                                                     \
    (code) = (call);                                                                                                   \
    if (HycoCatchEnd((code), line_)) abort();                                                                          \
    if ((code) && getenv("HYCO_FUZZ_SHOW")) fprintf(stderr, "%s\n", line_);                                            \
  } while (0)

#endif
