/* The package: initialisation, version, and declarations of options. */
#ifndef HYCOSYS_H
#define HYCOSYS_H

#include <petscviewer.h>

#if !defined(PETSC_USE_REAL_DOUBLE) || defined(PETSC_USE_COMPLEX)
#error "hyco needs PETSc configured with real scalars in double precision"
#endif

#if defined(__cplusplus)
extern "C" {
#endif

/* An option, as declared by the code that reads it. */
typedef struct {
  const char *name;    /* "hyco_pod_tol", without the dash; "mu_": a name follows */
  const char *value;   /* "<real>", "<a|b|c>", "" for a flag */
  const char *initial; /* the default, as text */
  const char *meaning; /* one line */
  const char *owner;   /* the class whose objects read it: "HycoReducer" */
  const char *only;    /* the types that read it, "hybrid or cubature", or for what: "full order"; "": all */
} HycoOption;

/* hyco's classes are PETSc objects, with reference counts, names, options prefixes, composed data and
   PetscObjectView(). */
PETSC_EXTERN PetscClassId HYCO_SCENE_CLASSID, HYCO_SAMPLES_CLASSID, HYCO_SYSTEM_CLASSID, HYCO_SOLVER_CLASSID,
    HYCO_FOM_CLASSID, HYCO_SNAPSHOTS_CLASSID, HYCO_REDUCER_CLASSID, HYCO_ROM_CLASSID, HYCO_MATERIAL_CLASSID,
    HYCO_CONTACT_CLASSID, HYCO_CONE_CLASSID;

/* Registers the classes, their types, and hyco's types of Tao: what HycoInitialize() does after PETSc's and SLEPc's own
   initialisation, for a program that has called those. Without it no object can be created. Not collective. */
PetscErrorCode HycoInitializePackage(void);

/*
  hyco's types of Tao, for any program: TaoSetType(tao, HYCO_TAO_ACTIVE_SET) or -tao_type. They minimise f(x), lo <= x
  <= hi (TaoSetVariableBounds()), by TaoSetObjectiveAndGradient() and TaoSetHessian(), on any number of ranks; a
  quadratic f exactly, others by Newton's method with a line search. The iterations are sets (pivots). Without an
  objective the gradient may be any function with H as Jacobian, so that H need not be symmetric.
  - active set: H may be indefinite only outside the free unknowns' blocks, whose factor is that of TaoGetKSP()
    (-tao_ksp_type, -tao_pc_type): LU, by MUMPS on several ranks; conjugate gradients for a matrix without entries
  - lemke: H is gathered on every rank as a dense matrix; each lo is finite, each hi infinite
  examples/ladder/obstacle.c is a program.
*/
#define HYCO_TAO_ACTIVE_SET "hyco_active_set"
#define HYCO_TAO_LEMKE      "hyco_lemke"

/* Initialises PETSc (if needed), SLEPc and hyco's package. Collective on all processes. `argc`, `argv` may be NULL. If
   it initialises PETSc, errors are printed as one line on stderr, "hyco: error: ...". HYCO_TRACE=1 in the environment,
   or PetscPushErrorHandler(PetscTraceBackErrorHandler, NULL), adds PETSc's call stack. */
PetscErrorCode HycoInitialize(int *argc, char ***argv);
/* Finalises what HycoInitialize() initialised. Collective on all processes. */
PetscErrorCode HycoFinalize(void);

/* Errors from now on are kept in place of being printed, for a program that reports them itself; PETSC_FALSE: as before
   the last HycoKeepErrors(PETSC_TRUE). It forgets the kept error. Not collective. */
PetscErrorCode HycoKeepErrors(PetscBool keep);
/* The line of the last error that was kept on this rank; "": none. Not collective. Borrowed until the next error. */
const char *HycoKeptError(void);
/* 'v': a value that the caller gave was wrong; 'f': a file does not exist; 0: another error. Not collective. */
char HycoKeptErrorKind(void);

/* The version as "major.minor.patch". Not collective. Borrowed. */
const char *HycoVersion(void);

/* Gets every -hyco_ option that the library's classes declare, in the order of the method, and their number `*n`. Not
   collective. Borrowed, until a type is registered or HycoFinalize() is called. */
PetscErrorCode HycoGetOptionTable(PetscInt *n, const HycoOption *table[]);

/*
  Declarations of options, between PetscObjectOptionsBegin(object) and PetscOptionsEnd(). They work like PETSc's
  functions of similar names, with the object's prefix and options database. A value of the wrong form or out of its
  range is an error of one line that names the option, and numbers have a decimal point in any locale. The value before
  the call is the default. The text is "meaning", "<form> meaning", "meaning [default]" or both, if form and default
  should be described differently from the function's own. `set` (may be NULL): whether the option was given. Collective
  on the object.
  - Real, Int: lo <= value <= hi
  - Bool, Flag: a flag takes no value
  - Word: index of one of `words`, which ends with NULL; < 0: none
  - String: length: of value
  - List: words separated by commas: n of them and NULL, which the caller frees by PetscStrArrayDestroy(); "none": 0
  - Name: an option that another function reads: PetscObjectViewFromOptions()
  - For: the types that read the following options, or for what: HycoOption.only
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

/* Returns the name in `names[n]` nearest to `word` by edit distance, or NULL if none is close. Not collective.
   Borrowed. */
const char *HycoNearest(const char *word, PetscInt n, const char *const names[]);

#if defined(__cplusplus)
}
#endif
#endif
