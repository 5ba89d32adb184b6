/*
  HycoMesh: cells, nodes and groups as plain arrays on one process. The same struct is the whole mesh on rank 0, each
  rank's part of it, and the reduced mesh of a model; the element loop runs on any of them.
*/
#ifndef HYCOMESH_H
#define HYCOMESH_H

#include <hycosceneimpl.h>

typedef enum { HYCO_LINE2, HYCO_TRI3, HYCO_QUAD4, HYCO_TET4, HYCO_HEX8, HYCO_N_CELL_TYPES } HycoCellType;

typedef struct _n_HycoMesh *HycoMesh;

struct _n_HycoMesh {
  PetscInt dim, nv, nf; /* space dimension; nodes of a cell, of a facet */
  HycoCellType type;
  /* nodes, ascending by tag; in a part those of its cells, then the others */
  PetscInt n_nodes;
  PetscReal *xyz;        /* n_nodes x 3, as in the file (not moved) */
  PetscInt *node_id;     /* tag in the mesh file */
  PetscInt *node_body;   /* the body that moves it */
  PetscInt *node_global; /* number in the distributed vectors; NULL: its own index */
  PetscInt *node_whole;  /* index in the whole mesh; NULL: its own index */
  /* cells, ascending by tag */
  PetscInt n_cells;
  PetscInt *cells;      /* n_cells x nv, node indices */
  PetscInt *cell_id;    /* tag in the mesh file */
  PetscInt *cell_body;  /* index in scene->body */
  PetscInt *cell_whole; /* index in the whole mesh; NULL: its own index */
  /* groups of the file, by name */
  PetscInt n_groups;
  char **group_name;
  PetscInt *group_dim;
  PetscInt *group_start, *group_node; /* nodes of group g: group_node[group_start[g] .. group_start[g+1]), ascending */
  /* facets of the groups of dimension dim - 1, nodes ordered so that the normal points out of their cell */
  PetscInt n_facets;
  PetscInt *facets;      /* n_facets x nf */
  PetscInt *facet_group; /* index of the group; a facet in two groups stands twice */
  PetscInt *facet_cell;  /* the cell it bounds; -1: not in this mesh */
  /* cell groups that are no body (regions): cells of group g as CSR over groups */
  PetscInt *group_cell_start, *group_cell;
};

PetscErrorCode HycoMeshDestroy(HycoMesh *mesh);

/* Reads and checks the scene's mesh file on this process alone. */
PetscErrorCode HycoMeshRead(HycoScene scene, HycoMesh *mesh);
/* Index of a group; fails with the list of those that exist. `key` says who asks. */
PetscErrorCode HycoMeshFindGroup(HycoMesh mesh, const char key[], const char name[], PetscInt *group);
/* Whether every group that the scene names is in the mesh. */
PetscErrorCode HycoMeshCheckGroups(HycoMesh mesh, HycoScene scene);

/*
  The part of a whole mesh with the cells keep[0..n_keep) (ascending) and, after their nodes, extra[0..n_extra).
  Facets are kept if their cell is, or if their group is in all_facets[0..n_all), with their nodes.
  node_whole and cell_whole lead back. The caller owns it.
*/
PetscErrorCode HycoMeshExtract(HycoMesh whole, PetscInt n_keep, const PetscInt keep[], PetscInt n_extra,
                               const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[], HycoMesh *part);

/* The largest extent of the mesh, as in the file, along an axis. */
PetscReal HycoMeshLength(HycoMesh mesh);

/* Cells around each node: CSR start[n_nodes + 1], cell[]. The caller frees both. */
PetscErrorCode HycoMeshNodeCells(HycoMesh mesh, PetscInt **start, PetscInt **cell);

/* What cuts the mesh: -hyco_partition. */
typedef enum { HYCO_PARTITION_METIS, HYCO_PARTITION_PTSCOTCH } HycoPartitioner;
extern const char *const HycoPartitioners[];

/* part[e] in 0..n_parts-1 for each cell; the cells of a pair (n_pairs x 2 node indices) tied. On one process. */
PetscErrorCode HycoMeshPartition(HycoMesh mesh, PetscInt n_pairs, const PetscInt pairs[], HycoPartitioner partitioner,
                                 PetscInt n_parts, PetscInt part[]);

/* Spreads rank 0's whole mesh over comm: each rank receives its part. Pairs (n_pairs x 2 node indices slave, master,
   rank 0) stay on one rank where they can: always, when no master has two slaves. n_owned, first: this rank's rows of
   nodes in the distributed numbering. On one rank *part = whole. Collective. */
PetscErrorCode HycoMeshDistribute(MPI_Comm comm, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner partitioner, HycoMesh *part, PetscInt *n_owned, PetscInt *first,
                                  PetscInt **global_of_whole);

#endif
