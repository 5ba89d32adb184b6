/* The cubature model: test functions on all of the bodies, material laws in some cells only, each with a weight;
   contact as in the hybrid model, or by force vectors as in the projection-based one. */
#ifndef HYCOCUBATURE_H
#define HYCOCUBATURE_H

#include <hycoprojectiontraining.h>

/* Every node of the model's mesh is in A: the mesh has the chosen cells, and the surfaces of contacts and loads. */
typedef struct {
  struct _n_HycoProjection projection;
  PetscReal *weight;  /* by cell of mesh, > 0 */
  PetscReal error[2]; /* relative 2-norm errors of the training's reduced internal forces and of the bodies' volumes,
                         the largest */
} * HycoCubatureModel;

/* Training options, and the data of a run. */
typedef struct {
  struct _n_HycoForceBasis forces;
  PetscReal tol;
  PetscInt n;         /* chosen cells; every rank */
  PetscReal *weight;  /* ordered as t->seeds_cell; every rank */
  PetscBool *near;    /* by cell of the part: counted once, with weight 1: at a contact with full-order displacements,
                         at springs and point loads */
  PetscReal error[2]; /* as in the model; rank 0 */
  PetscInt n_full, *full; /* full-order displacements: unknowns of the contacts' surfaces, ascending; rank 0 */
} * HycoCubatureTraining;

/* Finds which displacements are full order, and the cells around them: c->full, c->near (cubature_contact.c).
   Collective. */
PetscErrorCode HycoCubatureFindContacts(HycoReducer reducer);
/* Sets these as the full-order unknowns of the model. Rank 0. */
PetscErrorCode HycoCubatureSetFullOrder(HycoROM model, HycoReducer reducer);

/* Contributions of the cells of the whole mesh to the reduced internal forces along the training paths
   (cubature_sample.c): the left singular vectors W (n_cells x n, rows in the file's order; the caller owns it) of
   the contributions, with their singular values sigma (PetscFree()), those above `tol` of the energy; n 0: W is
   NULL. Collective. */
PetscErrorCode HycoCubatureSample(HycoReducer reducer, HycoSnapshots store, PetscReal tol, Mat *W, PetscInt *n,
                                  PetscReal **sigma);
/* Chooses the cells and their weights from these (cubature_weights.c): t->seeds_cell, c->weight. Collective. */
PetscErrorCode HycoCubatureChoose(HycoReducer reducer, Mat W, PetscInt n, const PetscReal sigma[]);
/* Chooses all cells, with weight 1. */
PetscErrorCode HycoCubatureChooseAll(HycoReducer reducer);

#endif
