/* HycoFOM, inside. */
#ifndef HYCOFOMIMPL_H
#define HYCOFOMIMPL_H

#include <hycofe.h>
#include <hycofom.h>
#include <hycosolverimpl.h>

struct _p_HycoFOM {
  MPI_Comm comm;
  PetscMPIInt rank, size;
  HycoScene scene; /* borrowed */
  /* owned */
  HycoMesh whole;  /* rank 0 */
  HycoMesh part;   /* each rank's cells; the whole mesh on one rank */
  HycoFE fe;       /* on the part */
  HycoFE fe_whole; /* on the whole mesh, rank 0 (the same as fe on one rank): contact */
  HycoPairs pairs; /* rank 0 */
  HycoSystem system;
  HycoSolver solver;
  Mat K, B, Bt;
  Vec U, Lambda, F, D;
  PetscInt n_owned, first;                       /* nodes */
  PetscInt n_nodes, n_cells, n_contacts, n_free; /* of the whole mesh, on every rank */
  PetscInt width;                                /* most nodes of a contact, on every rank */
  PetscInt *global;                              /* rank 0: distributed number of each whole node; NULL on one rank */
  VecScatter to_local, to_root, lambda_to_root;
  Vec U_local, U_root, lambda_root;
  /* the last solution on rank 0, in the file's order */
  PetscReal *u, *lambda, *sigma, *gap;
  PetscBool solved, sigma_ready;
  HycoSummary summary;
};

/* Attaches the rigid motions to K; fails when nothing holds one of the free ones. Collective. */
PetscErrorCode HycoFOMSetMotions(HycoFOM fom);
/* Generalised forces F - B^T Lambda of the last solution (n_nodes x dim) on rank 0, zero on fixed unknowns. Collective.
 */
PetscErrorCode HycoFOMGetForces(HycoFOM fom, PetscReal forces[]);
/* Fills strain_energy, external_work, gap_work and energy_defect from the last solution. Collective. */
PetscErrorCode HycoFOMEnergy(HycoFOM fom, HycoSummary *summary);

#endif
