/* Export of a model's predictions to C99: what the files of the extension share. */
#ifndef HYCOEXPORT_H
#define HYCOEXPORT_H

#include <hycoalgorithms.h>
#include <hycoromimpl.h>
#include "runtime/model.h"

/* An expression of the scene in the parameters alone: its text at a place x, which is fixed, or what it changes from there
   to the place `to`, as the entries of a turn by a map. Two weights of samples are never multiplied. */
typedef struct {
  const char *key, *text; /* borrowed from the scene */
  PetscBool change, weight;
  PetscReal x[3], to[3];
} HycoAtom;

/* A function of the parameters: the product of atoms a, b and d over atom c; each -1: 1. */
typedef struct {
  PetscInt a, b, c, d;
} HycoFunction;

/* The weights of the samples of a model of bodies, between which those that change their shape or the ratio of their moduli
   are interpolated, as expressions in the scene's parameters; each once. The caller frees the texts and the array. */
PetscErrorCode HycoExportWeights(HycoROM m, PetscInt *n, char ***text);

/* Texts that grow. */
typedef struct {
  char *text;
  size_t n, room;
} HycoText;
PetscErrorCode HycoTextAdd(HycoText *text, const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);
/* Inserts words at a position. */
PetscErrorCode HycoTextInsert(HycoText *text, size_t at, const char words[]);

/* Evaluates an expression of the scene at a place x, and writes it in C (c: NULL: does not) with the parameters in mu[]; x
   NULL: only writes it, with the place in x[]. *valid: it is one, in names that are known; *uses: it has a parameter; *space:
   x, y or z. */
PetscErrorCode HycoTranslate(HycoScene scene, const char text[], const PetscReal x[3], const PetscReal mu[],
                             PetscReal *value, HycoText *c, PetscBool *valid, PetscBool *uses, PetscBool *space);

/* The same of an atom, which is valid. */
PetscErrorCode HycoAtomTranslate(HycoScene scene, const HycoAtom *atom, const PetscReal mu[], PetscReal *value,
                                 HycoText *c);

/* The atoms of a scene: its parameters, and each entry's expression that has one, at some places x (n x 3) if it varies in
   space; of maps what they change from place to place, and unless `travels` also the places. */
PetscErrorCode HycoAtomsFind(HycoScene scene, PetscBool travels, PetscInt n, const PetscReal x[], PetscInt *n_atoms,
                             HycoAtom **atom);

/* Adds the weight of a sample, which is borrowed. */
PetscErrorCode HycoAtomsAddWeight(HycoScene scene, const char text[], PetscInt *n_atoms, HycoAtom **atom);

/* value[n x n_atoms]: of the atoms at n points mu. */
PetscErrorCode HycoAtomsTabulate(HycoScene scene, PetscInt n_atoms, const HycoAtom atom[], PetscInt n,
                                 const PetscReal mu[], PetscReal value[]);

/* Linear combinations of functions of the parameters that give data at points exactly: a subset of candidates. */
typedef struct {
  PetscInt n_points, n_rows; /* y: n_points x n_rows */
  const PetscReal *atom, *y; /* atom: n_points x atoms: their values */
  const PetscInt *group;     /* by row: its group, */
  const PetscReal *scale;    /* which has a scale of errors; 0: all is 0 */
} HycoFitData;
typedef struct {
  PetscInt n;
  HycoFunction *function;
  PetscReal *coefficient; /* n_rows x n */
  PetscReal worst;        /* error at the points that were not fitted (each third), relative to the group */
  PetscInt worst_row;
} HycoExportFit;
/* The functions are those of a level: 1, a; from 1 on 1/c, a/c; from 2 on a b; from 3 on a b / c; from 4 on a b d. At level -1 they are those of
   seed[], and their products with one atom; at level -2 - k with atom k. worst > tol: they do not suffice, or are too many to be tried. The caller frees both arrays. */
PetscErrorCode HycoFitFunctions(PetscInt n_atoms, const HycoAtom atom[], PetscInt level, PetscInt n_seeds,
                                const HycoFunction seed[], PetscReal tol, const HycoFitData *data, HycoExportFit *fit);
#define HYCO_FIT_LEVELS 5
/* value[n]: of the functions at mu. */
PetscErrorCode HycoFunctionsEvaluate(HycoScene scene, const HycoAtom atom[], PetscInt n, const HycoFunction f[],
                                     const PetscReal mu[], PetscReal value[]);

/* A program: the runtime's model, whose arrays it owns but for the ranges and tables of the scene, and its names. */
typedef struct {
  Model m;
  PetscInt n_contact, n_weights, n_states; /* entries of m.contact, m.weight; doubles of a state */
  PetscReal difference, seconds; /* largest difference from the model at the points that were checked; their time */
  PetscInt n_atoms, checked;
  const HycoAtom *atom; /* borrowed */
  HycoFunction *function;
  char **name, **unit;                  /* of outputs */
  Surfaces surfaces;                    /* n_nodes 0: none moves, and m has none */
  PetscInt n_surfaces, n_border, *body; /* surfaces; edges of all borders; by node: its body */
  PetscReal *drawn;                     /* nodes as drawn, n_nodes x 3 */
} HycoExportModel;
PetscErrorCode HycoExportAddOutput(HycoExportModel *model, const Output *output, const char name[], const char unit[]);
PetscErrorCode HycoExportAddContact(HycoExportModel *model, PetscInt contact);
PetscErrorCode HycoExportAddWeight(HycoExportModel *model, PetscReal weight);
PetscErrorCode HycoExportAddTerm(HycoExportModel *model, PetscInt value, PetscInt function, PetscInt n,
                                 const PetscReal term[]);
PetscErrorCode HycoExportModelFree(HycoExportModel *model);
/* The text of an entry of the scene; "": there is none. */
const char *HycoExportEntry(HycoScene scene, const char key[]);
/* Fails if FILE.c or FILE.h exists and was not written by an export. */
PetscErrorCode HycoExportCheckFiles(const char path[]);
/* Writes FILE.c and FILE.h beside it; describes them. */
PetscErrorCode HycoExportWrite(const HycoExportModel *model, HycoScene scene, const char name[], const char path[],
                               char **description);

#endif
