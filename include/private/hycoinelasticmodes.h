/* Modes of the nodal forces of inelastic strains along the training paths, and the cells that show their coefficients
   (inelastic_modes.c). */
#ifndef HYCOINELASTICMODES_H
#define HYCOINELASTICMODES_H

#include <hycoinelasticpoints.h>

/* Sampled along the training paths: inelastic forces by cell; loads inside the bodies by cell; loads by node. */
enum { HYCO_SAMPLED_INELASTIC, HYCO_SAMPLED_INSIDE, HYCO_SAMPLED_LOADS, HYCO_N_SAMPLED };

/* The load of a cell from its supports and heat, K_e u0_e - heat_e, with fe's elastic tangents (load: nv x dim);
   heat_e (NULL: not wanted). */
PetscErrorCode HycoInelasticCellLoad(HycoFE fe, PetscInt cell, PetscReal load[], PetscReal heat[]);
/* The inelastic force of a cell in a state at u (q: nv x dim), 0 where it is round-off; Ke, heat: of the cell; the
   largest sum of magnitudes of the terms it is the difference of (NULL: not wanted). */
PetscErrorCode HycoInelasticCellForce(HycoFE fe, PetscInt cell, const PetscReal Ke[], const PetscReal heat[],
                                      const PetscReal u[], HycoFEState state, PetscReal q[], PetscReal *summands);

/* The modes of the first n_fields sampled quantities, rows in the file's order; tol: of the inelastic forces' energy,
   the others are complete. The caller owns them. Collective. */
PetscErrorCode HycoInelasticSample(HycoReducer reducer, HycoSnapshots store, PetscReal tol, PetscInt n_fields,
                                   HycoBasis *basis);
/* The cells of a basis' Q-DEIM points, then of those of its rows in the remaining cells, and so on: `rounds` times a
   cell for each mode, up to the rank; n: unknowns of a cell. cell[]: room for them. Collective. */
PetscErrorCode HycoInelasticChoose(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count,
                                   PetscInt cell[]);
/* The pseudo-inverse of the modes in the chosen cells, t->seeds_cell: P, l x columns column major; and the modes there,
   columns x l column major; their smallest singular value. Collective. */
PetscErrorCode HycoInelasticInverse(HycoReducer reducer, const HycoBasis *modes, PetscReal P[], PetscReal there[],
                                    PetscReal *smallest);
/* Columns of A from `first` on, rows in the distributed vectors' order: modes of cells' forces, summed at the nodes, or
   modes of nodes. Collective. */
PetscErrorCode HycoInelasticPut(HycoReducer reducer, const HycoBasis *modes, HycoPlace place, Mat A, PetscInt first);
/* An empty matrix of n such columns. */
PetscErrorCode HycoInelasticColumns(HycoReducer reducer, PetscInt n, Mat *A);

#endif
