/* A gmsh mesh file as read: its nodes, and the elements of its physical groups. */
#ifndef MSH_H
#define MSH_H

#include <hycoimpl.h>

/* The elements of one physical group. */
typedef struct {
  int dim, tag;
  char name[256]; /* as in the file, or group_DIM_TAG */
  PetscInt n, nv; /* number of elements, and of nodes of each */
  PetscInt *id;   /* n tags */
  PetscInt *node; /* n x nv, indices of the file's nodes */
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

/* Reads a file of format 2.2 or 4.1; fails unless its counts, tags, types and nodes are consistent. The caller
   destroys the result, also after a failure. One process. */
PetscErrorCode HycoMshRead(const char path[], HycoMsh *mesh);
/* Converts the file's hex20 to hex27, and its quad8 to quad9 (face_nodes.c); new nodes get the next tags, in the
   order of their faces' corners. */
PetscErrorCode HycoMshAddFaceNodes(const char path[], HycoMsh *mesh);
PetscErrorCode HycoMshDestroy(HycoMsh *mesh);

#endif
