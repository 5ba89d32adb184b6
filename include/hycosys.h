/* The package: start, stop, version, and the table of options that every class reads. */
#ifndef HYCOSYS_H
#define HYCOSYS_H

#include <petscviewer.h>

#if !defined(PETSC_USE_REAL_DOUBLE) || defined(PETSC_USE_COMPLEX)
#error "hyco needs PETSc configured with real scalars in double precision"
#endif

#if defined(__cplusplus)
extern "C" {
#endif

/* One option: its name without the dash, the form of its value, its default and its meaning. */
typedef struct {
  const char *name;    /* "hyco_pod_tol" */
  const char *value;   /* "<real>", "<a|b|c>", "" for a flag */
  const char *initial; /* the default, as text */
  const char *meaning; /* one line */
} HycoOption;

/* hyco's classes are PETSc's objects: reference counts, names, options prefixes, composed data, PetscObjectView(). */
PETSC_EXTERN PetscClassId HYCO_SCENE_CLASSID, HYCO_SAMPLES_CLASSID, HYCO_SYSTEM_CLASSID, HYCO_SOLVER_CLASSID,
    HYCO_FOM_CLASSID, HYCO_SNAPSHOTS_CLASSID, HYCO_REDUCER_CLASSID, HYCO_ROM_CLASSID, HYCO_MATERIAL_CLASSID, HYCO_CONTACT_CLASSID;

/* Registers the classes; whatever makes an object calls it. Not collective. */
PetscErrorCode HycoInitializePackage(void);

/* Starts PETSc (if needed) and SLEPc for hyco. Collective on all processes. `argc`, `argv` may be NULL. */
PetscErrorCode HycoInitialize(int *argc, char ***argv);
/* Ends what HycoInitialize started. Collective on all processes. */
PetscErrorCode HycoFinalize(void);

/* The version as "major.minor.patch". Not collective. Borrowed. */
const char *HycoVersion(void);

/* Every -hyco_ option of the library, in the order of the method; `*n` receives their number. Not collective. Borrowed.
 */
PetscErrorCode HycoGetOptionTable(PetscInt *n, const HycoOption *table[]);

/* The name in `names[n]` nearest to `word` by edit distance, or NULL when none is close. Not collective. Borrowed. */
const char *HycoNearest(const char *word, PetscInt n, const char *const names[]);

#if defined(__cplusplus)
}
#endif
#endif
