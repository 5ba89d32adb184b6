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
  "sigma" (n_cells x n_sigma unrolled), "force" (as U). Rows in the mesh file's order, in contiguous blocks over comm.
  Collective; the caller owns it. A field without rows gives a matrix of zero rows.
*/
PetscErrorCode HycoSnapshotsGetField(HycoSnapshots store, HycoSamples samples, const char field[], Mat *S);
/* One field of the solution at mu, n values into the caller's memory, on this process alone. Not collective. */
PetscErrorCode HycoSnapshotsRead(HycoSnapshots store, const PetscReal mu[], const char field[], PetscInt n,
                                 PetscReal value[]);

#endif
