/* Modes of what inelastic stresses lack of the elastic ones along the training paths, and the integration points that
   show their coefficients (inelastic_points.c). Rows of the modes are sqrt(w) s of all points, in the file's order of
   the cells: HycoPointRows() of each cell, n_sigma of each point. */
#ifndef HYCOINELASTICPOINTS_H
#define HYCOINELASTICPOINTS_H

#include <hycobodiestraining.h>

PetscInt HycoPointRows(HycoReducer reducer);
/* The modes; tol: of their energy. The caller owns them. Collective. */
PetscErrorCode HycoPointsSample(HycoReducer reducer, HycoSnapshots store, PetscReal tol, HycoBasis *basis);
/* Mode k at the points of the part (value: n_cells x HycoPointRows()). Collective. */
PetscErrorCode HycoPointsMode(HycoReducer reducer, const HycoBasis *modes, PetscInt k, PetscReal value[]);
/* Adds the nodal forces of such values, with the weights of fe's nodes: of one cell, to its unknowns (value:
   HycoPointRows()); of all, to force[n_dof]. */
PetscErrorCode HycoPointsCellForce(HycoFE fe, PetscInt cell, const PetscReal value[], PetscReal force[]);
PetscErrorCode HycoPointsForces(HycoFE fe, const PetscReal value[], PetscReal force[]);
/* The Q-DEIM points of a basis, then those of its rows at the remaining points, and so on: `rounds` times a point for
   each mode, up to the rank; ascending. n: rows of a point. point[]: room for rounds x modes. Collective. */
PetscErrorCode HycoPointsChoose(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count, PetscInt point[]);
/* The pseudo-inverse of the modes at these points: P, l x rows column major; the modes there (rows x l row major);
   their smallest singular value. Collective. */
PetscErrorCode HycoPointsInverse(const HycoBasis *modes, PetscInt n, PetscInt count, const PetscInt point[],
                                 PetscReal P[], PetscReal there[], PetscReal *smallest);

#endif
