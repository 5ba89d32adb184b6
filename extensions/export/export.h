/* Export of a model's predictions to C99: what the files of the extension share. */
#ifndef HYCOEXPORT_H
#define HYCOEXPORT_H

#include <hycoalgorithms.h>
#include <hycoromimpl.h>
#include "runtime/expression.h"
#include "runtime/model.h"

/* Texts that grow. */
typedef struct {
  char *text;
  size_t n, room;
} HycoText;
PetscErrorCode HycoTextAdd(HycoText *text, const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

/* Expressions in reverse Polish notation, one after the other (runtime/expression.h). */
typedef struct {
  PetscInt n, room;
  PetscReal *text;
} HycoCode;
/* Adds an expression of the scene at the place x, minus (NULL: without) itself at another; x NULL: the place is given
   later. *at: where it begins, -1: it is no expression of names that are known; *uses: it has a parameter; *space: x, y
   or z. */
PetscErrorCode HycoParse(HycoScene scene, const char text[], const PetscReal x[3], const PetscReal minus[3],
                         HycoCode *code, PetscInt *at, PetscBool *uses, PetscBool *space);
/* The text of an entry with its body's temperature in place of the word; the caller frees it. */
PetscErrorCode HycoExportHeat(HycoScene scene, const char key[], const char text[], char **hot);

/* An expression of the scene in the parameters alone, at a fixed place, or what it changes from there to another
   (change). Two weights of samples are never multiplied. */
typedef struct {
  PetscInt code, n, place; /* where it begins, and its length; in the program, 1 and more */
  PetscBool change, weight;
} HycoAtom;
typedef struct {
  PetscInt n, room;
  HycoAtom *atom;
  HycoCode code;
} HycoAtoms;

/* The value of a variable at a share of its range; of the time at one of the listed intervals. */
PetscReal HycoVariableAt(HycoScene scene, PetscInt p, PetscReal share);

/* A function of the parameters: see product(). */
typedef struct {
  int of[4];
} HycoFunction;

/* The atoms of a scene: its parameters, and each entry's expression that has one, at some places x (n x 3) if it varies
   in space; of maps what they change from place to place, and unless `travels` also the places. */
PetscErrorCode HycoAtomsFind(HycoScene scene, PetscBool travels, PetscInt n, const PetscReal x[], HycoAtoms *atoms);
/* Adds the weight of a sample. */
PetscErrorCode HycoAtomsAddWeight(HycoScene scene, const char text[], HycoAtoms *atoms);
/* value[n x atoms->n]: at n points mu. */
PetscErrorCode HycoAtomsTabulate(HycoScene scene, const HycoAtoms *atoms, PetscInt n, const PetscReal mu[],
                                 PetscReal value[]);

/* Linear combinations of functions of the parameters that give data at points exactly: a subset of candidates. */
typedef struct {
  PetscInt n_points, n_atoms, stride, n_rows;
  const PetscReal *atom, *y;   /* n_points x n_atoms: their values; n_points x stride, of which */
  const PetscInt *row, *group; /* these rows; by row of y: its group, */
  const PetscReal *scale;      /* which has a scale of errors; 0: all is 0 */
} HycoFitData;
typedef struct {
  PetscInt n;
  HycoFunction *function;
  PetscReal *coefficient, *size; /* n x rows; the largest value of each function */
  PetscReal worst;               /* error at the points that were not fitted (each third), relative to the group */
  PetscInt worst_row;
} HycoExportFit;
PetscErrorCode HycoExportFitFree(HycoExportFit *fit);
/* The functions are those of a level: 1, a; from 1 on 1/c, a/c; from 2 on a b; from 3 on a b / c; from 4 on a b d. At
   level -1 they are those of seed[], and their products with one atom; at level -2 - k with atom k. They are chosen one
   by one, which may miss some that depend nearly on others; or (together) all, if they are few. worst > tol: they do
   not suffice, or are too many to be tried. The caller frees the fit. */
PetscErrorCode HycoFitFunctions(const HycoAtoms *atoms, PetscInt level, PetscBool together, PetscInt n_seeds,
                                const HycoFunction seed[], PetscReal tol, const HycoFitData *data, HycoExportFit *fit);
#define HYCO_FIT_LEVELS 5
/* value[n]: of the functions at mu. */
PetscErrorCode HycoFunctionsEvaluate(HycoScene scene, const HycoAtoms *atoms, PetscInt n, const HycoFunction f[],
                                     const PetscReal mu[], PetscReal value[]);

/* A program: the runtime's model, whose arrays it owns, and its names. */
typedef struct {
  Model m;
  HycoCode code;                             /* m.code */
  PetscInt n_contact, n_weights, n_flexible; /* entries of m.contact, m.weight, m.flexibility; */
  PetscInt n_surfaces, n_facets, n_border,
      n_states;                  /* surfaces, their facets and edges of borders; doubles of a state */
  char **name, **unit;           /* of outputs */
  PetscReal difference, seconds; /* largest difference from the model at the points that were checked; their time */
  PetscInt checked;
} HycoExportModel;
/* Entry n of an array that only this makes grow: its room is a power of 2. */
#define HYCO_ADD(n, array, ...)                                                                                        \
  do {                                                                                                                 \
    if (!((n) & ((n)-1))) PetscCall(PetscRealloc((size_t)PetscMax(1, 2 * (n)) * sizeof(*(array)), &(array)));          \
    (array)[n] = (__VA_ARGS__);                                                                                        \
  } while (0)
#define HYCO_APPEND(n, array, ...)                                                                                     \
  do {                                                                                                                 \
    HYCO_ADD(n, array, __VA_ARGS__);                                                                                   \
    (n)++;                                                                                                             \
  } while (0)
PetscErrorCode HycoExportModelFree(HycoExportModel *model, HycoScene scene);
/* The text of an entry of the scene; "": there is none. */
const char *HycoExportEntry(HycoScene scene, const char key[]);
/* Fails if FILE.c or FILE.h exists and was not written by an export. */
PetscErrorCode HycoExportCheckFiles(const char path[]);
/* Writes FILE.c and FILE.h beside it; describes them. */
PetscErrorCode HycoExportWrite(HycoExportModel *model, HycoScene scene, const char name[], const char path[],
                               char **description);

#endif
