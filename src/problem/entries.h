/* Entries of a scene: private to scene/. */
#ifndef HYCO_ENTRIES_H
#define HYCO_ENTRIES_H
#include <hycosceneimpl.h>

/* Reads the scene's file into `*options`, the command line's entries over it. Collective. */
PetscErrorCode HycoEntriesRead(MPI_Comm comm, const char path[], PetscOptions *options,
                               char folder[PETSC_MAX_PATH_LEN]);
/* Fails where a key stands twice in `text`, which is YAML; `file` names it in the message. */
PetscErrorCode HycoEntriesCheckTwice(const char text[], const char file[]);
/* Makes lists of scalars of the lists of lists in YAML, each row's numbers with blanks between; false: there are none.
 */
PetscBool HycoEntriesFlatten(char text[]);
/* Copies the global database's entries into `options`; method_only: those named hyco_ alone. */
PetscErrorCode HycoEntriesOverride(PetscOptions options, PetscBool method_only);
/* Fills scene->key, value from scene->options, sorted by key. */
PetscErrorCode HycoEntriesList(HycoScene scene);

#endif
