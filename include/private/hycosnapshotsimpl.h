/* HycoSnapshots, inside. */
#ifndef HYCOSNAPSHOTSIMPL_H
#define HYCOSNAPSHOTSIMPL_H

#include <hycofomimpl.h>
#include <hycosnapshots.h>

struct _p_HycoSnapshots {
  PETSCHEADER(int);
  HycoScene scene; /* referenced */
  char folder[PETSC_MAX_PATH_LEN];
  unsigned long long fingerprint;
};

/*
  One field of all samples as a dense matrix, a column per sample: "U" (n_nodes x dim unrolled), "lambda" (n_contacts),
  "sigma" (n_cells x n_sigma unrolled), "force" (as U). Rows in the mesh file's order, in contiguous blocks over comm,
  of whole blocks of rows: those of U that belong to a node stay together. Collective; the caller owns it. A field
  without rows gives a matrix of zero rows.
*/
PetscErrorCode HycoSnapshotsGetField(HycoSnapshots store, HycoSamples samples, const char field[], PetscInt block,
                                     Mat *S);
/* The n values from `first` on of one field of the solution at mu, into the caller's memory. Not collective. */
PetscErrorCode HycoSnapshotsReadRows(HycoSnapshots store, const PetscReal mu[], const char field[], PetscInt first,
                                     PetscInt n, PetscReal value[]);

#endif
