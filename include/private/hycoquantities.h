/* The quantities that a scene names, of a solution on a mesh. */
#ifndef HYCOQUANTITIES_H
#define HYCOQUANTITIES_H

#include <hycocontactimpl.h>

/* value[scene->n_quantities] of displacements u (n_dof) and cell stresses sigma (n_cells x n_sigma) on fe's mesh, or on
   the parts of it that the processes have; these three where HycoSceneAsksFields(), reaction: n_dof, the
   supports' forces, where HycoSceneHasReactions(); contact: what each contact of the scene carries, the same on all
   processes, NULL: not known (NaN). Fails where a group is empty, and for a component that the mesh does not have.
   Collective. */
PetscErrorCode HycoQuantitiesMeasure(MPI_Comm comm, HycoFE fe, const PetscReal u[], const PetscReal sigma[],
                                     const PetscReal reaction[], const HycoContactResult contact[], PetscReal value[]);
/* Marks the cells (n_cells) that the scene's quantities need. */
PetscErrorCode HycoQuantitiesMarkCells(HycoScene scene, HycoMesh mesh, PetscBool needed[]);

#endif
