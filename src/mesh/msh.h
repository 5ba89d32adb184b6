/* A gmsh mesh file as read: its nodes, and the elements of its physical groups. */
#ifndef MSH_H
#define MSH_H

#include <hycomesh.h>

/* The elements of one physical group. */
typedef struct {
  int dim, tag;
  char name[256];  /* as in the file, or group_DIM_TAG */
  PetscInt n, nv;  /* number of elements, and of nodes of each */
  PetscInt shapes; /* of the elements, bits 1 << HycoCellType */
  PetscInt *id;    /* n tags */
  PetscInt *node;  /* n x nv, indices of the file's nodes */
  PetscInt room;
  PetscInt body;  /* used by the caller */
  PetscInt inner; /* used by the caller */
} HycoMshGroup;

typedef struct {
  PetscInt n_nodes;
  PetscInt *tag;  /* ascending */
  PetscReal *xyz; /* n_nodes x 3 */
  PetscInt n_groups;
  HycoMshGroup *group; /* by dimension and tag */
} HycoMsh;

/* Some programs write triangles, prisms, ... as quadrilaterals and hexahedra with repeated nodes: the gmsh type of such
   an element, and its nodes in place of those of type 3 or 5. Returns 0 for other repetitions. */
int HycoMshReduce(long long type, PetscInt node[]);
/* The type of cells or facets with nv nodes; HYCO_N_CELL_TYPES: there is none. */
HycoCellType HycoMshType(int dim, PetscInt nv);
/* Reads a file of format 2.2 or 4.1; fails unless its counts, tags, types and nodes are consistent. The caller
   destroys the result, also after a failure. One process. */
PetscErrorCode HycoMshRead(const char path[], HycoMsh *mesh);
/* Converts the file's hex20 to hex27, and its quad8 to quad9 (face_nodes.c); new nodes get the next tags, in the
   order of their faces' corners. */
PetscErrorCode HycoMshAddFaceNodes(const char path[], HycoMsh *mesh);
/* Converts a group's cells or facets to nv nodes, which must be the width of their type or of a mesh of several
   types. */
PetscErrorCode HycoMshWiden(HycoMshGroup *g, PetscInt nv);
PetscErrorCode HycoMshDestroy(HycoMsh *mesh);

#endif
