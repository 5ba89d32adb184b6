/* Fields on a mesh, written to HDF5 with the XDMF that ParaView opens. */
#ifndef HYCOFIELDS_H
#define HYCOFIELDS_H

#include <hycocontactimpl.h>

typedef struct {
  const char *name;
  PetscBool on_cells;
  PetscInt components; /* 1, 3 (vector) or 6 (symmetric tensor xx, xy, xz, yy, yz, zz) */
  const PetscReal *data;
} HycoField;

/* Contact results by slave node. */
typedef struct {
  PetscInt n;
  const PetscInt *node_id;
  const PetscReal *lambda, *gap;
} HycoContactTable;

/* What both kinds of .xdmf, of one solution and of a series, are made of: a name as XML has it; a cell type's; stress of
   cells (n_cells x ns) in ParaView's order xx, xy, xz, yy, yz, zz. */
void HycoFieldsEscape(const char name[], char out[6 * PETSC_MAX_PATH_LEN]);
const char *HycoFieldsTopology(HycoCellType type);
void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[]);

/* Writes `path` (must end in .xdmf) and the .h5 beside it, both through temporary names. On this process alone. X:
   moved nodes (n_nodes x 3). The .h5 also holds node_id, cell_id, the parameters and the contact table. */
PetscErrorCode HycoFieldsWrite(const char path[], HycoMesh mesh, const PetscReal X[], HycoScene scene,
                               const PetscReal mu[], PetscInt n, const HycoField field[],
                               const HycoContactTable *contact);
/* Fails unless `path` ends in .xdmf, and where the .h5 beside it is a model or a snapshot. On this process alone. */
PetscErrorCode HycoFieldsCheckPath(const char path[]);

/*
  The usual fields from a solution on a whole mesh, then HycoFieldsWrite: displacement, stress, contact force (vector on
  slaves, minus on masters), contact pressure, gap at the solution, RID marker (may be NULL: none written).
*/
PetscErrorCode HycoSolutionWrite(const char path[], HycoFE fe, HycoPairs *pairs, const PetscReal u[],
                                 const PetscReal lambda[], const PetscReal *rid);

#endif
