/* Modes of the nodal forces of inelastic strains along the training paths, and the cells that show their coefficients
   (inelastic_modes.c). */
#ifndef HYCOINELASTICMODES_H
#define HYCOINELASTICMODES_H

#include <hycoinelasticforces.h>
#include <hycoreducerimpl.h>

/* The modes of the inelastic forces of all cells along the training paths, rows in the file's order; tol: energy left
   out. The caller owns them. Collective. */
PetscErrorCode HycoInelasticSample(HycoReducer reducer, HycoSnapshots store, PetscReal tol, HycoBasis *basis);
/* The cells of a basis' Q-DEIM points, then of those of its rows in the remaining cells, and so on: `rounds` times a
   cell for each mode, up to the rank; n: unknowns of a cell. cell[]: room for them. Collective. */
PetscErrorCode HycoInelasticChoose(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count,
                                   PetscInt cell[]);
/* The pseudo-inverse of the modes in the chosen cells, t->seeds_cell: P, l x columns column major; and the modes there,
   columns x l column major; their smallest singular value. Collective. */
PetscErrorCode HycoInelasticInverse(HycoReducer reducer, const HycoBasis *modes, PetscReal P[], PetscReal there[],
                                    PetscReal *smallest);
/* The columns of A, rows in the distributed vectors' order: modes of cells' forces, summed at the nodes. Collective. */
PetscErrorCode HycoInelasticPut(HycoReducer reducer, const HycoBasis *modes, Mat A);
/* An empty matrix of n such columns. */
PetscErrorCode HycoInelasticColumns(HycoReducer reducer, PetscInt n, Mat *A);

#endif
