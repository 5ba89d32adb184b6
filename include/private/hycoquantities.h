/* The quantities (outputs) named in a scene, evaluated for a solution on a mesh. */
#ifndef HYCOQUANTITIES_H
#define HYCOQUANTITIES_H

#include <hycocontactimpl.h>

/* value[scene->n_quantities] from displacements u (n_dof) and cell stresses sigma (n_cells x n_sigma) on fe's mesh,
   or on the processes' parts of it; these three are needed if HycoSceneHasFieldOutputs(). reaction: n_dof, the
   supports' forces, if HycoSceneHasReactions(). contact: HycoContactResults(), the same on all processes;
   NULL: not known (NaN). without: n_quantities, those that are not measured; NULL: none. Fails if a group is empty, or
   for a component that the mesh does not have. Collective. */
PetscErrorCode HycoQuantitiesMeasure(MPI_Comm comm, HycoFE fe, const PetscBool without[], const PetscReal u[],
                                     const PetscReal sigma[], const PetscReal reaction[],
                                     const HycoContactResult contact[], PetscReal value[]);
/* slope (n_dof): the derivative of quantity k, a mean, with respect to the displacements of one process' mesh. */
PetscErrorCode HycoQuantityMeanDerivative(HycoFE fe, PetscInt k, const PetscReal u[], const PetscReal sigma[],
                                          PetscReal slope[]);
/* Marks the cells (n_cells) that quantity k of the scene needs, or all quantities. */
PetscErrorCode HycoQuantityMarkCells(HycoScene scene, HycoMesh mesh, PetscInt k, PetscBool needed[]);
PetscErrorCode HycoQuantitiesMarkCells(HycoScene scene, HycoMesh mesh, PetscBool needed[]);
/* Marks the cells that decide the quantities near a solution with these values: those of an extreme, and where the
   field is close to it; of a mean all; of reactions all, or (balanced: they follow from balance) one with a support;
   none of those `without`. */
PetscErrorCode HycoQuantitiesMarkDecisive(HycoFE fe, const PetscReal u[], const PetscReal sigma[],
                                          const PetscReal value[], const PetscBool without[], PetscBool balanced,
                                          PetscBool needed[]);
/* Whether it is the extreme or the mean of a stress in cells. */
PetscBool HycoQuantityOfStress(const HycoQuantity *q);
/* The same of a displacement. */
PetscBool HycoQuantityOfPosition(const HycoQuantity *q);
/* Marks the cells whose stresses the quantities need. */
PetscErrorCode HycoQuantitiesMarkStressed(HycoScene scene, HycoMesh mesh, PetscBool stressed[]);
/* Which reactions follow from balance (balance.c): balanced[k * n_bodies + b], for each quantity k the bodies b of
   whose loads and contact forces it is minus the sum; for no body: it does not follow. mesh: whole, or the processes'
   parts. Collective. */
/* part[b]: the first of the bodies that share nodes with body b or are tied to it, directly or by others.
   Collective. */
PetscErrorCode HycoJoinBodies(MPI_Comm comm, HycoScene scene, HycoMesh mesh, PetscInt part[]);
PetscErrorCode HycoQuantitiesBalance(MPI_Comm comm, HycoScene scene, HycoMesh mesh, PetscBool balanced[]);
/* Marks the cells (n_cells) with the loads of the bodies of[b], and those of all loads on facets, points and lines,
   which may be shared with other bodies. */
PetscErrorCode HycoMarkLoads(HycoScene scene, HycoMesh mesh, const PetscBool of[], PetscBool needed[]);
/* The same for the bodies in a balanced[]. */
PetscErrorCode HycoQuantitiesMarkLoads(HycoScene scene, HycoMesh mesh, const PetscBool balanced[], PetscBool needed[]);

#endif
