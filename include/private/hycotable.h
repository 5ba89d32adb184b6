/* The reduced stiffness at few parameter values, from which it is interpolated (table.c). All on one process. */
#ifndef HYCOTABLE_H
#define HYCOTABLE_H

#include <hycoalgorithms.h>
#include <hycogalerkin.h>

/* At most so many combinations of values. */
#define HYCO_TABLE_NODES 32

struct _n_HycoTable {
  PetscReal *x[HYCO_MAX_PARAMETERS]; /* ascending */
  HycoGridField values;              /* Kr's entries, as HycoReducedEntries() has them */
  PetscInt n, *start, *column;       /* a sparse Kr's rows: n + 1, entries; n -1: dense */
};

/* n[p] values x[p] of each of the dim parameters, copied; values.data is for the caller to fill. */
PetscErrorCode HycoTableCreate(const PetscInt n[], PetscReal *x[], PetscInt dim, PetscInt entries, HycoTable *table);
/* NULL-safe. */
PetscErrorCode HycoTableDestroy(HycoTable *table);
/* The pattern of the model's Kr, if sparse; a sparse Kr with that pattern, its entries zero. */
PetscErrorCode HycoTableKeepPattern(HycoROM model, HycoTable table);
PetscErrorCode HycoTableCreateSparse(HycoROM model);
/* Kr at mu by the model's table. */
PetscErrorCode HycoTableFill(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoTableView(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoTableSave(HycoROM model, HycoH5 file);
/* Fails when the file's table is damaged. */
PetscErrorCode HycoTableLoad(HycoROM model, HycoH5 file);

#endif
