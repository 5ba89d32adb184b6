/* The mesh as a DMPlex: private to src/mesh. */
#ifndef PLEX_H
#define PLEX_H

#include <hycomesh.h>
#include <petscdmplex.h>
#include <petscsf.h>

/* The value of a group's label for a cell with facet number k in the group: HYCO_FACET + k (DMs that are not
   interpolated). */
#define HYCO_FACET 10

/* The IS, composed with the DM, of the file's tags of all points of this process, 0 for edges and faces. */
#define HYCO_TAGS "HycoTags"
/* Attaches the file's tags of all points of this process; takes ownership. */
PetscErrorCode HycoPlexSetTags(DM dm, PetscInt tag[]);
/* Sends the tags of a DM's points along the star forest of their distribution to another DM. Collective. */
PetscErrorCode HycoPlexSendTags(DM from, PetscSF sf, DM to);
/* The vertices of a point; of a cell in gmsh's order (type: HYCO_N_CELL_TYPES for points that are not cells).
   `interpolated`: edges and faces are points of the DM. */
PetscErrorCode HycoPlexVertices(DM dm, PetscBool interpolated, HycoCellType type, PetscInt point, PetscInt n,
                                PetscInt vertex[]);
/* The HycoCellType of the mesh (-1: it has no cells), and whether it has collapsed cells. Collective. */
PetscErrorCode HycoPlexType(DM dm, PetscInt *type, PetscBool *mixed);
/* Sets them for a part, which need not have cells of all shapes, nor cells at all nodes. */
PetscErrorCode HycoPlexSetType(DM dm, HycoCellType type, PetscBool mixed);
/* Makes tables those of a DM, which then owns them; those that it has, or NULL. */
PetscErrorCode HycoMeshSetDM(HycoMesh mesh, DM dm);
PetscErrorCode HycoMeshQuery(DM dm, HycoMesh *mesh);
/* As HycoPlexToMesh(), for the processes of comm; PETSC_COMM_SELF for a DM with points on one alone. */
PetscErrorCode HycoPlexToTables(DM dm, MPI_Comm comm, HycoScene scene, HycoMesh *mesh);
/* DMPlex's types of cells; the position of a node of a cell in its cone (shape HYCO_N_CELL_TYPES: for points that are
   not cells). */
extern const DMPolytopeType HycoPlexTypes[HYCO_N_CELL_TYPES];
PetscInt HycoConePlace(HycoCellType shape, PetscInt node);
/* The shape of a cell. */
PetscErrorCode HycoPlexShape(DM dm, HycoCellType type, PetscInt cell, HycoCellType *shape);
/* Whether a label of this name is DMPlex's own. */
PetscBool HycoPlexOwnLabel(const char name[]);
/* The DM alone of a submesh, of each process's part as in HycoSubmesh(). Collective. */
PetscErrorCode HycoPlexCut(MPI_Comm comm, HycoScene scene, HycoMesh of, PetscInt n_keep, const PetscInt keep[],
                           PetscInt n_extra, const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[],
                           DM *dm);
/* Sets the subpoint IS of a submesh; takes ownership of point[n]. */
PetscErrorCode HycoSubmeshSetPoints(DM sub, PetscInt n, PetscInt point[]);
/* The name of a group's label, and the label. */
PetscErrorCode HycoPlexLabelName(const char group[], size_t room, char name[]);
PetscErrorCode HycoPlexGroupLabel(DM dm, const char group[], DMLabel *label);
/* The number of facets of a cell; the nodes of facet `number`, in gmsh's order: corners, middles of the sides,
   middle of the face. */
PetscInt HycoFacetCount(HycoCellType type);
const signed char *HycoFacetNodes(HycoCellType type, PetscInt number);
/* Turns a triangle of four nodes so that the last two are the repeated one. */
void HycoFacetRepeatLast(PetscInt nf, PetscInt node[]);
/* The nodes of a cell's face (nf; a triangle's last two are the same); returns the number of distinct ones, which for
   a face of a collapsed cell may be 1 or 2. */
PetscInt HycoMeshFace(HycoMesh mesh, PetscInt cell, PetscInt number, PetscInt node[]);
/* The number of the cell's face with exactly these nodes (nf, some may be repeated); -1: there is none. */
PetscInt HycoCellFace(HycoMesh mesh, PetscInt cell, const PetscInt node[]);

/* The registered PetscPartitioner type HYCO_PARTITIONER, for a mesh (this process's; NULL: no cells) with contacts,
   pairs of node indices. Both are borrowed until the partitioner has finished. */
#define HYCO_PARTITIONER "hyco"
PetscErrorCode HycoPartitionerSetMesh(PetscPartitioner partitioner, HycoMesh mesh, PetscInt n_pairs,
                                      const PetscInt pairs[], HycoPartitioner by);

/* Writes PETSc's HDF5 format, with the tags. The DM must have no overlap. Collective. */
PetscErrorCode HycoPlexWrite(DM dm, const char path[]);

#endif
