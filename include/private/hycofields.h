/* Fields on a mesh, written to HDF5 with the XDMF that ParaView opens. */
#ifndef HYCOFIELDS_H
#define HYCOFIELDS_H

#include <hycocontactimpl.h>
#include <hycoh5.h>

typedef struct {
  const char *name;
  HycoPlace place;     /* of a mesh that one process has, a surface's nodes are its nodes */
  PetscInt components; /* 1, 3 (vector) or 6 (symmetric tensor xx, xy, xz, yy, yz, zz) */
  const PetscReal *data;
  PetscReal missing; /* of a surface: at the nodes off it */
} HycoField;

/* Writes `components` numbers, of type MPIU_REAL or MPIU_INT, of each node or cell in the file's order, as a set of
   cols columns. Collective with an order; without one this process has all n of them. */
PetscErrorCode HycoFieldWrite(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                              MPI_Datatype type, PetscInt components, PetscInt cols, const void *value);
/* The same of a field's data; n nodes or cells. */
PetscErrorCode HycoFieldWriteData(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[],
                                  const HycoField *field);

/* Contact results by slave node. */
typedef struct {
  PetscInt n;
  const PetscInt *node_id;
  const PetscReal *lambda, *gap;
} HycoContactTable;

/* What both kinds of .xdmf, of one solution and of a series, are made of: a name as XML has it; a cell type's; stress
   of cells (n_cells x ns: xx, yy, zz, xy, yz, xz) in ParaView's order xx, xy, xz, yy, yz, zz. */
void HycoFieldsEscape(const char name[], char out[6 * PETSC_MAX_PATH_LEN]);
const char *HycoFieldsTopology(HycoCellType type);
void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[]);
/* Of the same stresses: von Mises' (n_cells), the principal ones (n_cells x 3), the largest first. */
PetscErrorCode HycoStressInvariants(PetscInt n_cells, PetscInt dim, const PetscReal sigma[], PetscReal mises[],
                                    PetscReal principal[]);

/* The title, cell type, dimension, parameters and contact table (NULL: none). On one process. */
PetscErrorCode HycoFieldsWriteHead(HycoH5 h, HycoMesh mesh, HycoScene scene, const PetscReal mu[],
                                   const HycoContactTable *contact);
/* Nodes at X, tags, the cells with their nodes' places in the whole mesh, as sets of a group of the file. Collective
   with an order. */
PetscErrorCode HycoFieldsWriteMesh(HycoH5 h, const char group[], const HycoFileOrder *order, HycoMesh mesh,
                                   const PetscReal X[]);
/* The fields of a solution's contacts by node of their mesh (vector on slaves, minus on masters), gaps and slaves' tags
   by contact; filled on rank 0, where the contacts are (surface NULL elsewhere). Collective; to be destroyed after an
   error too. */
typedef struct {
  PetscReal *force, *pressure, *gap_node, *gap, *normal, *area;
  PetscInt *slave_id;
} HycoContactFields;
PetscErrorCode HycoContactFieldsCreate(MPI_Comm comm, HycoFE surface, HycoPairs *pairs, const PetscReal u[],
                                       const PetscReal lambda[], HycoContactFields *fields);
PetscErrorCode HycoContactFieldsDestroy(HycoContactFields *fields);
/* Fails unless `path` ends in .xdmf, and where the .h5 beside it is a model or a snapshot. On this process alone. */
PetscErrorCode HycoFieldsCheckPath(const char path[]);

/*
  Writes `path` (must end in .xdmf) and the .h5 beside it: displacement, of each cell stress, von Mises stress,
  principal stresses and body, contact force (vector on slaves, minus on masters), contact pressure, gap at the
  solution (NaN at nodes without a contact, or whose contact faces nothing), RID marker (may be NULL: none written), and
  in the .h5 the parameters and the contact table. u on fe, u_surface on the mesh of the pairs: with an order, of parts
  of a mesh, they are the part's and rank 0's (elsewhere `surface` is NULL), and the call is collective; NULL: this
  process has all.
*/
PetscErrorCode HycoSolutionWrite(const char path[], const HycoFileOrder *order, HycoFE fe, const PetscReal u[],
                                 HycoFE surface, HycoPairs *pairs, const PetscReal u_surface[],
                                 const PetscReal lambda[], const PetscReal *rid);

#endif
