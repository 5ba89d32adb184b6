/* Files: written data are read back, a commit is a rename, and damaged files are refused in one line. */
#include "check.h"
#include <hycoh5.h>
#include <hycofile.h>
#include <glob.h>
#include <unistd.h>

static char path[128], partial[160];

/* Files with temporary names beside `path`. */
static int CountPartial(void)
{
  glob_t found;
  int n = glob(partial, 0, NULL, &found) == 0 ? (int)found.gl_pathc : 0;

  globfree(&found);
  return n;
}

static PetscErrorCode Write(PetscBool commit)
{
  const PetscReal real[6] = {1, -2.5, 1e-300, 1e300, 0, 3.141592653589793};
  const PetscInt whole[3] = {-7, 0, 2147483647};
  HycoH5 file;

  PetscFunctionBegin;
  PetscCall(HycoH5Create(path, &file));
  CHECK(CountPartial() == 1, "while writing, one of %s must exist", partial);
  PetscCall(HycoH5WriteReal(file, "real", 2, 3, real));
  PetscCall(HycoH5WriteInt(file, "group/deep/whole", 3, 1, whole));
  PetscCall(HycoH5WriteReal(file, "nothing", 0, 3, NULL));
  PetscCall(HycoH5WriteText(file, "text", "a line\nand \"another\": 7 %%"));
  PetscCall(HycoH5Close(&file, commit));
  CHECK(!file, "Close must clear the handle");
  CHECK(CountPartial() == 0, "after closing, %s must be gone", partial);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Written data are read back; without a commit no file is left. */
static PetscErrorCode TestRoundTrip(void)
{
  HycoH5 file;
  PetscReal real[6], *loaded;
  PetscInt *whole, rows = -1, cols = 1;
  char *text;

  PetscFunctionBegin;
  PetscCall(Write(PETSC_FALSE));
  CHECK(access(path, F_OK) != 0, "without commit no file may be left");
  PetscCall(Write(PETSC_TRUE));
  PetscCall(HycoH5Open(path, &file));
  CHECK(HycoH5Has(file, "real") && !HycoH5Has(file, "unreal"), "Has is wrong");
  PetscCall(HycoH5ReadReal(file, "real", 2, 3, real));
  CHECK_NEAR(real[1], -2.5, 0);
  CHECK_NEAR(real[2], 1e-300, 0);
  CHECK_NEAR(real[5], 3.141592653589793, 0);
  PetscCall(HycoH5ReadRows(file, "real", 1, 1, 3, real));
  CHECK_NEAR(real[0], 1e300, 0);
  PetscCall(HycoH5LoadInt(file, "group/deep/whole", -7, PETSC_MAX_INT, &rows, &cols, &whole));
  CHECK(rows == 3 && whole[0] == -7 && whole[2] == 2147483647, "expected 3 rows from -7 to 2147483647");
  PetscCall(PetscFree(whole));
  PetscCall(HycoH5GetSize(file, "nothing", &rows, &cols));
  CHECK(rows == 0 && cols == 3, "expected 0 x 3, found %d x %d", (int)rows, (int)cols);
  PetscCall(HycoH5LoadText(file, "text", &text));
  CHECK(strcmp(text, "a line\nand \"another\": 7 %%") == 0, "found \"%s\"", text);
  PetscCall(PetscFree(text));
  CHECK_FAILS(HycoH5ReadReal(file, "real", 3, 2, real), "real is 2 x 3, and 3 x 2 was expected");
  CHECK_FAILS(HycoH5ReadReal(file, "absent", 1, 1, real), "has no absent");
  CHECK_FAILS(HycoH5ReadRows(file, "real", 1, 2, 3, real), "real has 2 rows, and 3 are needed");
  rows = -1;
  cols = 1;
  CHECK_FAILS(HycoH5LoadInt(file, "group/deep/whole", 0, 10, &rows, &cols, &whole), "contains -7, outside 0 to 10");
  CHECK_FAILS(HycoH5LoadReal(file, "text", &rows, &cols, &loaded), "text is damaged");
  PetscCall(HycoH5Close(&file, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A refused read must close the file: otherwise HDF5 would return data from memory when it is opened again. */
static PetscErrorCode TestReleased(void)
{
  HycoH5 file = NULL;
  FILE *f = fopen(path, "wb"); /* the same file, now empty */

  PetscFunctionBegin;
  fclose(f);
  CHECK_FAILS(HycoH5Open(path, &file), "damaged");
  if (file) PetscCall(HycoH5Close(&file, PETSC_FALSE));
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every truncation of the file is refused when it is opened or read; also a missing file, and one that is not HDF5. */
static PetscErrorCode TestDamaged(void)
{
  HycoH5 file = NULL;
  FILE *f;
  char *bytes;
  long size;

  PetscFunctionBegin;
  PetscCall(Write(PETSC_TRUE));
  f = fopen(path, "rb");
  fseek(f, 0, SEEK_END);
  size = ftell(f);
  rewind(f);
  PetscCall(PetscMalloc1(size, &bytes));
  CHECK(fread(bytes, 1, (size_t)size, f) == (size_t)size, "the file cannot be read");
  fclose(f);
  for (long length = 0; length < size; length += size / 40 + 1) {
    PetscReal real[6];
    char line[HYCO_LINE];
    PetscErrorCode code;

    f = fopen(path, "wb");
    fwrite(bytes, 1, (size_t)length, f);
    fclose(f);
    file = NULL;
    PetscCall(HycoCatchBegin());
    code = HycoH5Open(path, &file);
    if (!code) code = HycoH5ReadReal(file, "real", 2, 3, real);
    PetscCall(HycoCatchEnd(code, line));
    CHECK(code && strstr(line, "damaged"), "cut to %ld of %ld bytes: \"%s\"", length, size, line);
    if (file) PetscCall(HycoH5Close(&file, PETSC_FALSE));
  }
  PetscCall(PetscFree(bytes));
  f = fopen(path, "w");
  fprintf(f, "plain text\n");
  fclose(f);
  CHECK_FAILS(HycoH5Open(path, &file), "is not an HDF5 file, or it is damaged");
  unlink(path);
  CHECK_FAILS(HycoH5Open(path, &file), "cannot be opened: no such file, or not readable");
  CHECK_FAILS(HycoH5Create("/no/such/folder/a.h5", &file), "/no/such/folder/a.h5 cannot be written");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Temporary names: unique to this process, distinguished from other files, removed when their process has ended. */
/* The temporary name of a file just begun; `before` names existed already. */
static PetscErrorCode Begin(size_t before, HycoFile *file, char name[HYCO_FILE_NAME])
{
  glob_t found;

  PetscFunctionBegin;
  PetscCall(HycoFileCreate(path, HYCO_FILE_NUMBERS, file));
  glob(partial, 0, NULL, &found);
  CHECK(found.gl_pathc == before + 1, "%d temporary files, expected %d", (int)found.gl_pathc, (int)before + 1);
  name[0] = '\0';
  for (size_t k = 0; k < found.gl_pathc; k++) { /* its number is the largest */
    if (strcmp(found.gl_pathv[k], name) > 0) snprintf(name, HYCO_FILE_NAME, "%s", found.gl_pathv[k]);
  }
  globfree(&found);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Temporary names differ and tell their file; those of processes that have ended are removed. */
static PetscErrorCode TestTemporary(void)
{
  char mine[HYCO_FILE_NAME], other[HYCO_FILE_NAME], owner[HYCO_FILE_NAME], dead[2 * HYCO_FILE_NAME];
  const char *tag;
  unsigned node;
  HycoFile first, second;
  FILE *f;

  PetscFunctionBegin;
  PetscCall(Begin(0, &first, mine));
  PetscCall(Begin(1, &second, other));
  CHECK(strcmp(mine, other), "two temporary names are both %s", mine);
  PetscCall(HycoFileClose(&second, PETSC_FALSE));
  CHECK(access(other, F_OK) != 0 && access(path, F_OK) != 0, "%s was given up, and must be gone", other);
  HycoFileOwner(mine, owner);
  CHECK(strcmp(owner, path) == 0, "%s belongs to %s", mine, owner);
  HycoFileOwner("a.hyco-b/c.hyco-h5", owner);
  CHECK(strcmp(owner, "a.hyco-b/c.hyco-h5") == 0, "a name that is not temporary became %s", owner);
  tag = strstr(mine, ".hyco-");
  CHECK(sscanf(tag, ".hyco-%8x-", &node) == 1, "%s has no node", mine);
  snprintf(dead, sizeof(dead), "%s.hyco-%08x-%d-0.partial.fold", path, node, 0x3fffffff); /* beyond any process id */
  f = fopen(dead, "w");
  fclose(f);
  PetscCall(HycoFileSweep("/tmp/another"));
  CHECK(access(dead, F_OK) == 0, "another file's sweep took %s", dead);
  PetscCall(HycoFileSweep(path));
  CHECK(access(dead, F_OK) != 0, "%s must be gone", dead);
  CHECK(access(mine, F_OK) == 0, "%s, which lives, must stay", mine);
  PetscCall(HycoFileClose(&first, PETSC_TRUE));
  CHECK(access(mine, F_OK) != 0 && access(path, F_OK) == 0, "%s must have become %s", mine, path);
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  snprintf(path, sizeof(path), "/tmp/hyco_test_%ld.h5", (long)getpid());
  snprintf(partial, sizeof(partial), "%s.hyco-*.partial", path);
  PetscCall(TestRoundTrip());
  PetscCall(TestReleased());
  PetscCall(TestDamaged());
  PetscCall(TestTemporary());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
