/* A gmsh mesh file as read: its nodes, and the elements of its physical groups. */
#ifndef MSH_H
#define MSH_H

#include <hycoimpl.h>

/* The elements of one physical group. */
typedef struct {
  int dim, tag;
  char name[256]; /* as in the file, or group_DIM_TAG */
  PetscInt n, nv; /* elements, nodes of each */
  PetscInt *id;   /* n, tags */
  PetscInt *node; /* n x nv, indices of the file's nodes */
  PetscInt room;
  PetscInt body;  /* for the caller */
  PetscInt inner; /* for the caller */
} HycoMshGroup;

typedef struct {
  PetscInt n_nodes;
  PetscInt *tag;  /* ascending */
  PetscReal *xyz; /* n_nodes x 3 */
  PetscInt n_groups;
  HycoMshGroup *group; /* by dimension and tag */
} HycoMsh;

/* Reads a file of format 2.2 or 4.1; fails unless its counts, tags, types and nodes agree. The caller destroys what it
   gives, after a failure too. One process. */
PetscErrorCode HycoMshRead(const char path[], HycoMsh *mesh);
/* Makes hex27 of the file's hex20, quad9 of its quad8 (face_nodes.c); new nodes have the next tags, in the order of
   their faces' corners. */
PetscErrorCode HycoMshAddFaceNodes(const char path[], HycoMsh *mesh);
PetscErrorCode HycoMshDestroy(HycoMsh *mesh);

#endif
