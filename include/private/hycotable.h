/* The reduced stiffness at a few parameter values, from which it is interpolated (affine.c). All on one process. */
#ifndef HYCOTABLE_H
#define HYCOTABLE_H

#include <hycoalgorithms.h>
#include <hycogalerkin.h>

/* The most combinations of values. */
#define HYCO_TABLE_NODES 32

struct _n_HycoTable {
  PetscReal *x[HYCO_MAX_PARAMETERS]; /* ascending */
  HycoGridField values;              /* Kr's entries, in the order of HycoReducedEntries() */
  PetscInt n, *start, *column;       /* rows of a sparse Kr: n + 1, entries; n -1: dense */
};

/* n[p] values x[p] of each of the dim parameters, copied; the caller fills values.data. */
PetscErrorCode HycoTableCreate(const PetscInt n[], PetscReal *x[], PetscInt dim, PetscInt entries, HycoTable *table);
/* NULL-safe. */
PetscErrorCode HycoTableDestroy(HycoTable *table);
/* Stores the pattern of the model's Kr, if it is sparse; creates a sparse Kr with that pattern and zero entries. */
PetscErrorCode HycoTableKeepPattern(HycoROM model, HycoTable table);
PetscErrorCode HycoTableCreateSparse(HycoROM model);
/* Evaluates Kr at mu from the model's table. */
PetscErrorCode HycoTableFill(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoTableView(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoTableSave(HycoROM model, HycoH5 file);
/* Fails if the file's table is damaged. */
PetscErrorCode HycoTableLoad(HycoROM model, HycoH5 file);

#endif
