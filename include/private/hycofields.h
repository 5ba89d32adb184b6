/* Fields on a mesh, written to HDF5 with an XDMF file for ParaView, or as VTKHDF. */
#ifndef HYCOFIELDS_H
#define HYCOFIELDS_H

#include <hycocontactimpl.h>
#include <hycoh5.h>

typedef struct {
  const char *name;
  HycoPlace place;
  PetscInt components; /* 1, 3 (vector) or 6 (symmetric tensor xx, xy, xz, yy, yz, zz) */
  const PetscReal *data;
} HycoField;

/* Converts values by node or cell (n, of `components` numbers each) to this rank's rows in the file's order, 0 where no
   process has a value. Without an order, returns `value` itself; otherwise the caller frees them
   by PetscFree(). Collective. */
PetscErrorCode HycoFieldRows(const HycoFileOrder *order, PetscInt n, HycoPlace place, MPI_Datatype type,
                             PetscInt components, const void *value, void **rows);
/* Writes `components` numbers, of type MPIU_REAL or MPIU_INT, of each node or cell in the file's order, as a dataset
   of cols columns. Collective with an order; without one this process has all n of them. */
PetscErrorCode HycoFieldWrite(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                              MPI_Datatype type, PetscInt components, PetscInt cols, const void *value);
/* The same for a field's data; n nodes or cells. */
PetscErrorCode HycoFieldWriteData(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[],
                                  const HycoField *field);

/* Stress of cells (n_cells x ns: xx, yy, zz, xy, yz, xz) in XDMF's order xx, xy, xz, yy, yz, zz. */
void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[]);
/* For the same stresses: von Mises stress (n_cells), the principal stresses (n_cells x 3), the largest first. */
PetscErrorCode HycoStressInvariants(PetscInt n_cells, PetscInt dim, const PetscReal sigma[], PetscReal mises[],
                                    PetscReal principal[]);

/* Writes nodes at X, tags, and the cells with their nodes' places in the whole mesh, as datasets of a group of the
   file; vtk: nodes of a cell in VTK's order, which is XDMF's too, else in gmsh's. Collective with an order. */
PetscErrorCode HycoFieldsWriteMesh(HycoH5 h, const char group[], const HycoFileOrder *order, HycoMesh mesh,
                                   const PetscReal X[], PetscBool vtk);
/* Stress at nodes from that of cells (n_cells x n_sigma): the mean over the cells around a node, weighted by volume,
   of one body; where bodies share nodes, of the first one. Valid at the nodes that the process owns, all of whose
   cells it has. As tensors in XDMF's order (n_nodes x 6), with von Mises stress (n_nodes). */
PetscErrorCode HycoNodalStress(HycoFE fe, const PetscReal sigma[], PetscReal tensor[], PetscReal mises[]);
/* Writes only the cells: nv columns, in which collapsed cells have repeated nodes. */
PetscErrorCode HycoFieldsWriteCells(HycoH5 h, const char name[], const HycoFileOrder *order, HycoMesh mesh,
                                    PetscBool vtk);
/* This rank's cells in the file's order, by shape: item[start[e] .. start[e + 1]) are the distinct nodes of its e-th
   cell, in VTK's order, after the code of its shape unless `code` is NULL. Of the `all` items of all ranks its own are
   those from `first` on. Create is collective with an order; the caller destroys the list. */
typedef struct {
  PetscInt n, first, all, *start, *item;
  unsigned char *shape; /* n, HycoCellType */
} HycoCellList;
PetscErrorCode HycoCellListCreate(const HycoFileOrder *order, HycoMesh mesh, const unsigned char code[],
                                  HycoCellList *list);
/* Writes the items as a dataset of one dimension. */
PetscErrorCode HycoCellListWrite(HycoH5 h, const char name[], const HycoCellList *list);
PetscErrorCode HycoCellListDestroy(HycoCellList *list);
/* The fields of a solution's contacts by node of their mesh (vector on slaves, negative on masters), gaps and
   slaves' tags by contact: each rank's of its own contacts. Collective; must be destroyed after an error too. */
typedef struct {
  PetscReal *force, *pressure, *gap_node, *gap, *normal, *area, *pressure_of; /* pressure_of: by contact */
  PetscReal *which; /* by node: the number of the contact whose slave it is, of several the first; NaN: none */
  PetscInt *slave_id;
  PetscBool has_friction;             /* on every rank: there are fields of friction */
  PetscReal *traction, *slip, *state; /* by node: tangential force over area and sum of slips of the slave, 3 each;
                                         HYCO_OPEN, ... */
} HycoContactFields;
PetscErrorCode HycoContactFieldsCreate(MPI_Comm comm, HycoFE surface, HycoPairs *pairs, const PetscReal u[],
                                       const PetscReal lambda[], HycoContactFields *fields);
/* Turns the fields by node of the surface into those by node of fe's mesh, the rank's part, from the contacts of all
   ranks (nothing to do where the two are the same mesh); corners of six-node facets then have a pressure too.
   Collective. */
PetscErrorCode HycoContactFieldsToPart(MPI_Comm comm, HycoFE fe, HycoMesh surface, HycoContactFields *fields);
PetscErrorCode HycoContactFieldsDestroy(HycoContactFields *fields);
/* Writes a value of each contact (MPIU_INT or MPIU_REAL; value: of the process's own) as a dataset in the order of all
   n contacts. Collective. */
PetscErrorCode HycoContactsWrite(MPI_Comm comm, HycoH5 h, const char name[], const HycoPairs *pairs, PetscInt n,
                                 MPI_Datatype type, const void *value);

/*
  A file of fields on one mesh (src/output/field_file.c): PATH.xdmf and PATH.h5, or PATH.vtkhdf, which ParaView, VTK and
  pyvista open. It has one solution (most = 0), or at most `most` times or points of a set. Open creates it with the
  mesh at X; Add writes fields: those of a time between BeginTime and EndTime, those of a point between BeginPoint,
  which has a mesh and parameters of its own, and EndTime. Commit renames it to its final name, and writes the text of
  an .xdmf. Order, mesh and scene are borrowed. All are collective on comm.
*/
#define HYCO_MOST_FIELDS 32
typedef struct _n_HycoFieldFile *HycoFieldFile;
struct _n_HycoFieldFile {
  MPI_Comm comm;
  char path[PETSC_MAX_PATH_LEN], h5_path[PETSC_MAX_PATH_LEN];
  PetscBool vtk;
  PetscInt most, n;           /* times: at most, written so far */
  PetscBool points;           /* each with a mesh and parameters of its own */
  PetscInt n_items;           /* length of mesh/topology, the mixed cells in the .h5 */
  PetscReal *t, *mu;          /* mu: n_parameters, for each point */
  const HycoFileOrder *order; /* NULL: this process has all */
  HycoMesh mesh;
  HycoScene scene;
  HycoH5 h;
  PetscInt n_fields;
  HycoField field[HYCO_MOST_FIELDS]; /* of the last time, without data */
  char name[HYCO_MOST_FIELDS][64];
};
PetscErrorCode HycoFieldFileCreate(MPI_Comm comm, const char path[], PetscInt most, PetscBool points,
                                   HycoFieldFile *file);
PetscErrorCode HycoFieldFileOpen(HycoFieldFile file, const HycoFileOrder *order, HycoMesh mesh, HycoScene scene,
                                 const PetscReal X[], const PetscReal mu[]);
PetscErrorCode HycoFieldFileBeginTime(HycoFieldFile file, PetscReal t);
PetscErrorCode HycoFieldFileBeginPoint(HycoFieldFile file, const PetscReal X[], const PetscReal mu[]);
PetscErrorCode HycoFieldFileAdd(HycoFieldFile file, const HycoField *field);
/* The same for rows in the file's order. */
PetscErrorCode HycoFieldFileAddRows(HycoFieldFile file, const HycoField *field, const PetscReal rows[]);
PetscErrorCode HycoFieldFileEndTime(HycoFieldFile file);
PetscErrorCode HycoFieldFileCommit(HycoFieldFile file);
PetscErrorCode HycoFieldFileDestroy(HycoFieldFile *file);
/* Number of all nodes or cells. Not collective. */
PetscInt HycoFieldFileCount(HycoFieldFile file, HycoPlace place);
/* "step-0003/nodes/displacement": name of a field of time k in the .h5. */
void HycoFieldName(const HycoField *field, PetscInt k, char name[HYCO_LINE]);
/* The parts of a .vtkhdf (src/output/vtkhdf.c): the mesh, the nodes of a point, the last field of the current time
   with the name of its dataset, the times. Collective. */
PetscErrorCode HycoVTKWriteMesh(HycoFieldFile file, const PetscReal X[]);
PetscErrorCode HycoVTKWritePoints(HycoFieldFile file, const PetscReal X[]);
PetscErrorCode HycoVTKWriteField(HycoFieldFile file, const HycoField *field, const PetscReal rows[],
                                 char set[HYCO_LINE]);
PetscErrorCode HycoVTKWriteTimes(HycoFieldFile file);

/* A solution: u on fe, u_surface on the mesh of the pairs. With an order, these are this rank's part, and the contacts
   of its slaves; order NULL: this process has everything. rid: marks cells, or NULL. Borrowed. */
typedef struct {
  const HycoFileOrder *order;
  HycoFE fe, surface;
  HycoPairs *pairs;
  const PetscReal *u, *u_surface, *lambda, *rid;
} HycoSolution;

/*
  Writes `path` (HycoFieldFile): displacement; for each cell stress, von Mises stress, principal stresses and body; at
  nodes the mean stress of the cells around, contact force (vector on slaves, negative on masters), contact pressure,
  gap at the solution (NaN at nodes without a contact, or whose contact faces no master), RID marker; in an .h5 the
  parameters and the contact table. Collective with an order.
*/
PetscErrorCode HycoSolutionWrite(const char path[], const HycoSolution *solution);
/* Adds the same to a file of a set of points, one solution after the other. */
PetscErrorCode HycoSolutionAdd(HycoFieldFile file, const HycoSolution *solution);

#endif
