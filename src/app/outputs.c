/* Checks before any work that the files a command writes and reads are different. */
#include "driver.h"
#include <hycofile.h>
#include <hycoh5.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <strings.h>

/* The value of an option, "" if absent, without counting it as read. */
static PetscErrorCode OutputFileReadOption(const char name[], char value[PETSC_MAX_PATH_LEN])
{
  PetscInt n;
  char **names, **values;

  PetscFunctionBegin;
  value[0] = '\0';
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt k = 0; k < n; k++) {
    if (strcasecmp(names[k], name) == 0 && values[k]) PetscCall(PetscStrncpy(value, values[k], PETSC_MAX_PATH_LEN));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file given on the command line, or the scene. */
typedef struct {
  const char *what; /* "-report" */
  char path[PETSC_MAX_PATH_LEN];
  HycoFileIdentity identity;
} Named;

static Named outputs[8]; /* with room for the file being compared */
static PetscInt n_outputs;

/* Adds a file to be written, or (else) checks one to be read: it must not be one of those to be written, whatever
   its name. */
static PetscErrorCode OutputFileAdd(const char what[], const char path[], PetscBool output)
{
  Named *taken = &outputs[n_outputs];

  PetscFunctionBegin;
  if (!path[0]) PetscFunctionReturn(PETSC_SUCCESS);
  taken->what = what;
  PetscCall(PetscStrncpy(taken->path, path, sizeof(taken->path)));
  HycoFileIdentify(path, &taken->identity);
  /* Compared by device and inode where they exist: links and other names of one file are found. */
  for (const Named *other = outputs; other < taken; other++) {
    const Named *a = output ? other : taken, *b = output ? taken : other;

    if (!HycoFileSame(&a->identity, &b->identity)) continue;
    HycoCheck(strcmp(a->path, b->path), "%s and %s are the same file, %s; give each its own file", a->what, b->what,
              b->path);
    HycoFail("%s %s and %s %s are the same file; give each its own file", a->what, a->path, b->what, b->path);
  }
  n_outputs += output;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -output: the fields, and the file of numbers beside them. */
static PetscErrorCode AddFields(const char path[])
{
  char h5[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoFieldsCheckPath(path));
  PetscCall(HycoFieldsNumbers(path, h5));
  PetscCall(OutputFileAdd("-output", path, PETSC_TRUE));
  if (strcmp(path, h5)) PetscCall(OutputFileAdd("the .h5 file of -output", h5, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Beside the model by default: two models in one folder do not share solutions unless they are told to. */
PetscErrorCode DriverSnapshotFolder(const char model[], char folder[PETSC_MAX_PATH_LEN])
{
  PetscFunctionBegin;
  PetscCall(OutputFileReadOption("hyco_snapshots", folder));
  if (!folder[0]) snprintf(folder, PETSC_MAX_PATH_LEN, "%.*s.snapshots", PETSC_MAX_PATH_LEN - 16, model);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The folder of train's solutions: no file may have that name. */
static PetscErrorCode AddSnapshots(const char model[])
{
  char folder[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverSnapshotFolder(model, folder));
  PetscCall(OutputFileAdd("the snapshot folder", folder, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene.yaml of -scene, a folder or the file. */
static PetscErrorCode CheckSceneFile(void)
{
  char path[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN + 16];
  struct stat info;

  PetscFunctionBegin;
  PetscCall(OutputFileReadOption("scene", path));
  snprintf(file, sizeof(file), "%s%s", path, stat(path, &info) == 0 && S_ISDIR(info.st_mode) ? "/scene.yaml" : "");
  PetscCall(OutputFileAdd("-scene", file, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const written[] = {"-report", "-table", "-output", "-c", NULL};

/* Checks the written files against those that are read. Outputs first, then what is read: each input is compared
   with all outputs. Called before any file is opened. */
static PetscErrorCode CheckNames(PetscBool trains)
{
  static const char *const read[] = {"-points", "-validation_points"};
  char path[PETSC_MAX_PATH_LEN], model[PETSC_MAX_PATH_LEN], **argv;
  int argc;

  PetscFunctionBegin;
  /* The list is static: this may be called again. */
  n_outputs = 0;
  PetscCall(OutputFileReadOption("model", model));
  if (trains) PetscCall(OutputFileAdd("-model", model, PETSC_TRUE));
  for (PetscInt k = 0; written[k]; k++) {
    PetscCall(OutputFileReadOption(written[k] + 1, path));
    if (path[0])
      PetscCall(strcmp(written[k], "-output") ? OutputFileAdd(written[k], path, PETSC_TRUE) : AddFields(path));
  }
  PetscCall(OutputFileReadOption("hyco_checkpoint", path));
  PetscCall(OutputFileAdd("-hyco_checkpoint", path, PETSC_TRUE));
  PetscCall(OutputFileReadOption("hyco_write_fclib", path));
  PetscCall(OutputFileAdd("-hyco_write_fclib", path, PETSC_TRUE));
  /* The snapshots lie beside the model, and are written as well. */
  if (trains && model[0]) PetscCall(AddSnapshots(model));
  if (!trains) PetscCall(OutputFileAdd("-model", model, PETSC_FALSE));
  PetscCall(CheckSceneFile());
  for (size_t k = 0; k < sizeof(read) / sizeof(read[0]); k++) {
    PetscCall(OutputFileReadOption(read[k] + 1, path));
    PetscCall(OutputFileAdd(read[k], path, PETSC_FALSE));
  }
  PetscCall(PetscGetArgs(&argc, &argv));
  for (int k = 2; k < argc - 1; k++) { /* PETSc does not store an option of that name */
    if (strncmp(argv[k], "-options_file", 13) == 0) PetscCall(OutputFileAdd(argv[k], argv[k + 1], PETSC_FALSE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that a file can be written at `path`: its folder exists and is writable, or it is a device. A precious
   file is a model or a snapshot: -report m.h5 must not replace hours of work. */
static PetscErrorCode CheckPlace(const char name[], const char path[], HycoFileKind kind)
{
  char folder[PETSC_MAX_PATH_LEN];
  char *slash;
  PetscBool direct, precious = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoFileCheckPlace(name, path, kind, &direct));
  /* Through links: what counts is the folder in which the file really is. */
  HycoFileFollow(path, folder);
  slash = strrchr(folder, '/');
  /* "/file" is in "/", whose slash stays. */
  if (slash)
    slash[slash == folder] = '\0';
  else
    PetscCall(PetscStrncpy(folder, ".", sizeof(folder)));
  HycoCheck(direct ? access(path, W_OK) == 0 : access(folder, W_OK | X_OK) == 0,
            "-%s %s cannot be written; check that the folder exists and is writable", name, path);
  if (!direct && kind == HYCO_FILE_TEXT) PetscCall(HycoH5IsPrecious(path, &precious));
  HycoCheck(!precious, "-%s %s is a model or a snapshot and is not overwritten; give the %s another name", name, path,
            name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before anything is computed: folders that do not exist, files that cannot be written, names that are also
   inputs. What is found here costs seconds, at the end hours. */
static PetscErrorCode CheckFiles(PetscBool trains)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(CheckNames(trains));
  PetscCall(OutputFileReadOption("model", path));
  if (trains && path[0]) PetscCall(CheckPlace("model", path, HYCO_FILE_NUMBERS));
  for (PetscInt k = 0; k < n_outputs; k++)
    PetscCall(HycoFileSweep(outputs[k].path)); /* removes files left by killed
                                                  runs */
  for (PetscInt k = 0; written[k]; k++) {
    PetscCall(OutputFileReadOption(written[k] + 1, path));
    if (path[0]) PetscCall(CheckPlace(written[k] + 1, path, HYCO_FILE_TEXT));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0, whose line ends all ranks: other machines may not see the same folders. */
PetscErrorCode DriverCheckOutputs(const Command *command)
{
  PetscFunctionBegin;
  HycoOnRoot(PETSC_COMM_WORLD, CheckFiles((PetscBool)(command->run == CommandTrain)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh is named by the scene, so that it is known only after the scene is read. */
PetscErrorCode DriverCheckMesh(HycoScene scene)
{
  const char *mesh;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetMesh(scene, &mesh));
  HycoOnRoot(PETSC_COMM_WORLD, OutputFileAdd("the mesh", mesh, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
