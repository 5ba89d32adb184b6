/* The cubature's model: tested by modes over all of the bodies, its laws at some cells alone, each counted with a
   weight; contact as in the hybrid model, or by force vectors as in the projection-based one. */
#ifndef HYCOCUBATURE_H
#define HYCOCUBATURE_H

#include <hycoprojection.h>

/* Every node of the model's mesh is in A: it has the chosen cells, and the surfaces of contacts and loads. */
typedef struct {
  struct _n_HycoProjection projection;
  PetscReal *weight;  /* by cell of mesh, > 0 */
  PetscReal error[2]; /* of the training's reduced internal forces, 2-norm, of the bodies' volumes, the largest */
} * HycoCubatureROM;

/* What the options of the training say, and what a run makes of them. */
typedef struct {
  struct _n_HycoForceBasis forces;
  PetscReal tol;
  PetscInt n;        /* chosen cells; every rank */
  PetscReal *weight; /* of these, in the order of t->seeds_cell; every rank */
  PetscBool *near; /* by cell of the part: once in the sum, at a contact whose displacements are full order, at springs
                      and point loads */
  PetscReal error[2];     /* as the model has it; rank 0 */
  PetscInt n_full, *full; /* full-order displacements, by unknown of the contacts' surfaces, ascending; rank 0 */
} * HycoCubatureTraining;

/* Which displacements are full order, and the cells around them: c->full, c->near (cubature_contact.c). Collective. */
PetscErrorCode HycoCubatureFindContacts(HycoReducer reducer);
/* These as the model's. Rank 0. */
PetscErrorCode HycoCubatureSetFullOrder(HycoROM model, HycoReducer reducer);

/* What the cells of the whole mesh give to the reduced internal forces along the training paths (cubature_sample.c):
   the left singular vectors W (n_cells x n, rows in the file's order; the caller's) of the contributions, with their
   singular values sigma (PetscFree()), all that count beside `tol` of their energy; n 0: W is NULL. Collective. */
PetscErrorCode HycoCubatureSample(HycoReducer reducer, HycoSnapshots store, PetscReal tol, Mat *W, PetscInt *n,
                                  PetscReal **sigma);
/* Chooses the cells and their weights from these (cubature_weights.c): t->seeds_cell, c->weight. Collective. */
PetscErrorCode HycoCubatureChoose(HycoReducer reducer, Mat W, PetscInt n, const PetscReal sigma[]);
/* All cells, once each. */
PetscErrorCode HycoCubatureChooseAll(HycoReducer reducer);

#endif
