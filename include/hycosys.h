/* The package: start, stop, version, and how options are declared. */
#ifndef HYCOSYS_H
#define HYCOSYS_H

#include <petscviewer.h>

#if !defined(PETSC_USE_REAL_DOUBLE) || defined(PETSC_USE_COMPLEX)
#error "hyco needs PETSc configured with real scalars in double precision"
#endif

#if defined(__cplusplus)
extern "C" {
#endif

/* One option, as the code that reads it declares it. */
typedef struct {
  const char *name;    /* "hyco_pod_tol", without the dash; "mu_": a name follows */
  const char *value;   /* "<real>", "<a|b|c>", "" for a flag */
  const char *initial; /* the default, as text */
  const char *meaning; /* one line */
  const char *owner;   /* the class whose objects read it: "HycoReducer" */
  const char *only;    /* what alone of these reads it: "hybrid or condensed"; "": all */
} HycoOption;

/* hyco's classes are PETSc's objects: reference counts, names, options prefixes, composed data, PetscObjectView(). */
PETSC_EXTERN PetscClassId HYCO_SCENE_CLASSID, HYCO_SAMPLES_CLASSID, HYCO_SYSTEM_CLASSID, HYCO_SOLVER_CLASSID,
    HYCO_FOM_CLASSID, HYCO_SNAPSHOTS_CLASSID, HYCO_REDUCER_CLASSID, HYCO_ROM_CLASSID, HYCO_MATERIAL_CLASSID,
    HYCO_CONTACT_CLASSID;

/* Registers the classes; whatever makes an object calls it. Not collective. */
PetscErrorCode HycoInitializePackage(void);

/* Starts PETSc (if needed) and SLEPc for hyco. Collective on all processes. `argc`, `argv` may be NULL. Where it starts
   PETSc, an error is one line on stderr, "hyco: error: ..."; PETSc's trace of the calls with HYCO_TRACE=1 in the
   environment, or by PetscPushErrorHandler(PetscTraceBackErrorHandler, NULL). */
PetscErrorCode HycoInitialize(int *argc, char ***argv);
/* Ends what HycoInitialize started. Collective on all processes. */
PetscErrorCode HycoFinalize(void);

/* The version as "major.minor.patch". Not collective. Borrowed. */
const char *HycoVersion(void);

/* Every -hyco_ option that the library's classes declare, in the order of the method; `*n` receives their number. Not
   collective. Borrowed, until a type is registered, or HycoFinalize(). */
PetscErrorCode HycoGetOptionTable(PetscInt *n, const HycoOption *table[]);

/*
  Declarations of options, between PetscObjectOptionsBegin(object) and PetscOptionsEnd(): as PETSc's calls of like
  names, with the object's prefix and options database, but a value that is not of the form or out of its range ends
  with one line that names it, and numbers have a decimal point in any locale. What the object has before is the
  default. The text is "meaning", "<form> meaning", "meaning [default]" or both: form and default as they are to be
  told, where the call's own are not enough. `set` (may be NULL): whether it was given. Collective on the object.
  - Real, Int: lo <= value <= hi
  - Bool, Flag: a flag takes no value
  - Word: index of one of `words`, which ends with NULL; < 0 is no word
  - String: length: of value
  - List: words with commas between: n of them and NULL, which the caller frees by PetscStrArrayDestroy(); "none": 0
  - Name: one that something else reads: PetscObjectViewFromOptions()
  - For: what alone reads those that follow, in words: HycoOption.only
*/
#if PETSC_VERSION_LT(3, 23, 0)
typedef PetscOptionItems *HycoOptionItems;
#else
typedef PetscOptionItems HycoOptionItems;
#endif
#define HycoOptionsReal(name, text, lo, hi, value, set)                                                                \
  HycoOptionsReal_Private(PetscOptionsObject, name, text, lo, hi, value, set)
#define HycoOptionsInt(name, text, lo, hi, value, set)                                                                 \
  HycoOptionsInt_Private(PetscOptionsObject, name, text, lo, hi, value, set)
#define HycoOptionsBool(name, text, value, set) HycoOptionsBool_Private(PetscOptionsObject, name, text, value, set)
#define HycoOptionsFlag(name, text, value)      HycoOptionsBool(name, "<> " text " []", value, NULL)
#define HycoOptionsWord(name, text, words, index, set)                                                                 \
  HycoOptionsWord_Private(PetscOptionsObject, name, text, words, index, set)
#define HycoOptionsString(name, text, value, length, set)                                                              \
  HycoOptionsString_Private(PetscOptionsObject, name, text, value, length, set)
#define HycoOptionsList(name, text, n, list, set) HycoOptionsList_Private(PetscOptionsObject, name, text, n, list, set)
#define HycoOptionsName(name, text)               HycoOptionsName_Private(PetscOptionsObject, name, text)
PetscErrorCode HycoOptionsReal_Private(HycoOptionItems items, const char name[], const char text[], PetscReal lo,
                                       PetscReal hi, PetscReal *value, PetscBool *set);
PetscErrorCode HycoOptionsInt_Private(HycoOptionItems items, const char name[], const char text[], PetscInt lo,
                                      PetscInt hi, PetscInt *value, PetscBool *set);
PetscErrorCode HycoOptionsBool_Private(HycoOptionItems items, const char name[], const char text[], PetscBool *value,
                                       PetscBool *set);
PetscErrorCode HycoOptionsWord_Private(HycoOptionItems items, const char name[], const char text[],
                                       const char *const words[], PetscInt *index, PetscBool *set);
PetscErrorCode HycoOptionsString_Private(HycoOptionItems items, const char name[], const char text[], char value[],
                                         size_t length, PetscBool *set);
PetscErrorCode HycoOptionsList_Private(HycoOptionItems items, const char name[], const char text[], PetscInt *n,
                                       char ***list, PetscBool *set);
PetscErrorCode HycoOptionsName_Private(HycoOptionItems items, const char name[], const char text[]);
PetscErrorCode HycoOptionsFor(const char only[]);

/* The name in `names[n]` nearest to `word` by edit distance, or NULL when none is close. Not collective. Borrowed. */
const char *HycoNearest(const char *word, PetscInt n, const char *const names[]);

#if defined(__cplusplus)
}
#endif
#endif
