/* Entries of a scene: the text of a scene, shared by entries/ and problem/. */
#ifndef HYCOENTRIES_H
#define HYCOENTRIES_H
#include <hycosceneimpl.h>

/* Reads the scene's file into `*options`, overridden by the command line's entries. Collective. */
PetscErrorCode HycoEntriesRead(MPI_Comm comm, const char path[], PetscOptions *options,
                               char folder[PETSC_MAX_PATH_LEN]);
/* Fails, with the line, if the text is no YAML, is none that PETSc can read, or has a key twice; `file` is its name in
   the message. */
PetscErrorCode HycoEntriesCheck(const char text[], const char file[]);
/* Converts nested lists in YAML into lists of scalars, with the numbers of a row separated by blanks; false: there
   are none. */
PetscBool HycoEntriesFlatten(char text[]);
/* Copies the global database's entries into `options`; method_only: only those named hyco_. */
PetscErrorCode HycoEntriesOverride(PetscOptions options, PetscBool method_only);
/* Fills scene->key and value from scene->options, sorted by key. */
PetscErrorCode HycoEntriesList(HycoScene scene);
/* Puts the scene's options of PETSc's solvers into the global ones, which these read, unless they are there; removes
   them again. */
PetscErrorCode HycoEntriesShare(HycoScene scene);
PetscErrorCode HycoEntriesUnshare(HycoScene scene);

#endif
