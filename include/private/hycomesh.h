/*
  HycoMesh: cells, nodes and groups as plain arrays on one process, made once from the process's part of a DMPlex, so
  that no element loop asks the DM. The same struct is the reduced mesh of a model; the element loop runs on any.
*/
#ifndef HYCOMESH_H
#define HYCOMESH_H

#include <hycosceneimpl.h>
#include <petscdmplex.h>
#include <petscsf.h>

typedef enum {
  HYCO_LINE2,
  HYCO_TRI3,
  HYCO_QUAD4,
  HYCO_TET4,
  HYCO_HEX8,
  HYCO_TRI6,
  HYCO_QUAD8,
  HYCO_QUAD9,
  HYCO_TET10,
  HYCO_HEX20,
  HYCO_HEX27,
  HYCO_N_CELL_TYPES
} HycoCellType;

/* The most nodes of a cell. */
#define HYCO_CELL_NODES 27
/* The most of a facet. */
#define HYCO_FACET_NODES 9

/* What is told of the types: names, dimensions, nodes of a cell and of its facets, how many of a facet's are corners,
   which come first. */
typedef struct {
  const char *name;
  PetscInt dim, nv, nf, corners;
  PetscBool quadratic;
} HycoCellKind;
extern const HycoCellKind HycoCellKinds[HYCO_N_CELL_TYPES];

typedef struct _n_HycoMesh *HycoMesh;

/* The scene's ties on the whole mesh, the same on all ranks: slave nodes with their masters, u_slave = sum of weight
   times u_master. Entries of a slave stand together, slaves and masters ascend. Counted references. */
typedef struct _n_HycoTies *HycoTies;
struct _n_HycoTies {
  PetscInt references, n;
  PetscInt *slave, *master;  /* tags in the mesh file */
  PetscInt *tie, *body;      /* of the scene; the body that moves the master */
  PetscReal *weight, *reach; /* how far the slave may lie from the place that its masters give */
};

/* Nodes of a cell's unknowns: its own, and those that its tied ones follow. */
#define HYCO_MAX_CELL_NODES (8 + 8 * 4) /* those of second order have no ties */

struct _n_HycoMesh {
  PetscInt dim, nv, nf; /* space dimension; nodes of a cell, of a facet */
  HycoCellType type;
  /* nodes, ascending by tag; in a part those of its cells, then the others */
  PetscInt n_nodes;
  PetscReal *xyz;          /* n_nodes x 3, as in the file (not moved) */
  PetscInt *node_id;       /* tag in the mesh file */
  PetscInt *node_body;     /* the body that moves it */
  PetscInt *node_global;   /* number in the distributed vectors; NULL: its own index */
  PetscInt *node_whole;    /* index in the whole mesh; NULL: its own index */
  PetscInt *node_point;    /* the DM's point, of tables made of one; else NULL */
  PetscInt n_owned, first; /* with node_global: the numbers of this process's own nodes, first .. first + n_owned - 1 */
  /* of the whole mesh of a part or a surface; 0: of this one */
  PetscInt n_whole_nodes, n_whole_cells;
  PetscReal whole_length;
  /* cells, ascending by tag */
  PetscInt n_cells;
  PetscInt *cells;      /* n_cells x nv, node indices */
  PetscInt *cell_id;    /* tag in the mesh file */
  PetscInt *cell_body;  /* index in scene->body */
  PetscInt *cell_whole; /* index in the whole mesh; NULL: its own index */
  PetscInt *cell_point; /* the DM's point, of tables made of one; else NULL */
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
  /* ties (ties.c); NULL where the scene has none. Of the nodes here that are tied, ascending: their masters, all of
     them here too; by cell, CSR: the nodes that its tied ones follow and that are not its own */
  HycoTies ties;
  PetscInt n_tied, *tied, *tied_start, *tied_entry; /* tied_start: n_tied + 1; tied_entry: of each, its first in ties */
  PetscInt *tied_master;                            /* nodes; their weights stand in ties */
  PetscInt *tied_at;                                /* by node: its place in tied, or -1 */
  PetscInt *follow_start, *follow;
};

/* The nodes of a cell's unknowns (room for HYCO_MAX_CELL_NODES); their number. */
static inline PetscInt HycoMeshCellNodes(HycoMesh m, PetscInt cell, PetscInt node[])
{
  PetscInt n = m->nv;

  for (PetscInt v = 0; v < m->nv; v++) node[v] = m->cells[cell * m->nv + v];
  for (PetscInt k = m->ties ? m->follow_start[cell] : 0; m->ties && k < m->follow_start[cell + 1]; k++)
    node[n++] = m->follow[k];
  return n;
}
/* A tied node's place in mesh->tied, or -1. */
static inline PetscInt HycoMeshTied(HycoMesh m, PetscInt node)
{
  return m->ties ? m->tied_at[node] : -1;
}

PetscErrorCode HycoMeshDestroy(HycoMesh *mesh);

/* Whether the mesh's cells are of second order. */
static inline PetscBool HycoMeshIsQuadratic(HycoMesh mesh)
{
  return HycoCellKinds[mesh->type].quadratic;
}
/* Reads and checks the scene's mesh file on this process alone. */
PetscErrorCode HycoMeshRead(HycoScene scene, HycoMesh *mesh);
/* Index of a group; fails with the list of those that exist. `key` says who asks. */
PetscErrorCode HycoMeshFindGroup(HycoMesh mesh, const char key[], const char name[], PetscInt *group);
/* The body that moves each node; fails where maps disagree, and where a mesh of the line or the plane leaves it. */
PetscErrorCode HycoMeshSetNodeBodies(HycoScene scene, HycoMesh mesh);
/* Whether every group that the scene names is in the mesh. */
PetscErrorCode HycoMeshCheckGroups(HycoMesh mesh, HycoScene scene);

/*
  The part of a whole mesh with the cells keep[0..n_keep) (ascending) and, after their nodes, extra[0..n_extra).
  Facets are kept if their cell is, or if their group is in all_facets[0..n_all), with their nodes.
  node_whole and cell_whole lead back. The caller owns it.
*/
PetscErrorCode HycoMeshExtract(HycoMesh whole, PetscInt n_keep, const PetscInt keep[], PetscInt n_extra,
                               const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[], HycoMesh *part);

/* Sorts a[0..*n), unless it is, and keeps one of each. */
PetscErrorCode HycoSortUnique(PetscInt *n, PetscInt a[]);

/* Its largest and (negated) smallest coordinates, as in the file. */
void HycoMeshEnds(HycoMesh mesh, PetscReal ends[6]);
/* The largest extent of the whole mesh, as in the file, along an axis. */
PetscReal HycoMeshLength(HycoMesh mesh);
/* The place of a node among this process's own, or -1: another's. */
static inline PetscInt HycoMeshOwned(HycoMesh m, PetscInt node)
{
  const PetscInt place = m->node_global ? m->node_global[node] - m->first : node;

  return !m->node_global || (place >= 0 && place < m->n_owned) ? place : -1;
}

/* The number of a facet in its cell. */
PetscInt HycoMeshFacetNumber(HycoMesh mesh, PetscInt facet);
/* The segments of a group of dimension 1 in space, n x 2 nodes, of second order n x 3 with the middles: the edges of
   cells between nodes of the group. Fails where they branch. The caller frees them. */
PetscErrorCode HycoMeshLine(HycoMesh mesh, PetscInt group, PetscInt *n, PetscInt **segment);
/* The ties of the mesh's nodes, by tag (NULL: none); takes a reference. Nodes and cells must be there. */
PetscErrorCode HycoMeshSetTies(HycoMesh mesh, HycoTies ties);
/* Room for n entries; one reference, which the last HycoTiesDestroy() gives back. */
PetscErrorCode HycoTiesCreate(PetscInt n, HycoTies *ties);
PetscErrorCode HycoTiesDestroy(HycoTies *ties);
/* Rank 0's ties on every rank (NULL: none). Collective. */
PetscErrorCode HycoTiesBcast(MPI_Comm comm, HycoTies *ties);
/* Those that are composed with a DM (borrowed), or NULL; composes them (takes a reference). */
PetscErrorCode HycoTiesOf(DM dm, HycoTies *ties);
PetscErrorCode HycoTiesAttach(DM dm, HycoTies ties);
/* Cells around each node, those too whose tied nodes follow it: CSR start[n_nodes + 1], cell[]. The caller frees both.
 */
PetscErrorCode HycoMeshNodeCells(HycoMesh mesh, PetscInt **start, PetscInt **cell);

/* What cuts the mesh: -hyco_partition. */
typedef enum { HYCO_PARTITION_METIS, HYCO_PARTITION_PTSCOTCH } HycoPartitioner;
extern const char *const HycoPartitioners[];

/*
  The scene's mesh as a DMPlex (src/mesh/plex.c), read on rank 0. Collective.
  HycoMeshDistribute() spreads it: the cells by METIS, those on the two sides of a contact on one rank where they can be
  (pairs: n_pairs x 2 node indices of rank 0's tables `whole`); refines it as the scene says; writes it to `write`
  in PETSc's HDF5 format, unless that is empty; and adds to each rank the cells that touch its own.
*/
PetscErrorCode HycoMeshLoad(MPI_Comm comm, HycoScene scene, DM *dm);
PetscErrorCode HycoMeshDistribute(DM *dm, HycoScene scene, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner by, const char write[]);
/* Tables of each process's part: the cells that touch a node of its own. On one process node_global, node_whole and
   cell_whole stay NULL. Collective. */
PetscErrorCode HycoPlexToMesh(DM dm, HycoScene scene, HycoMesh *mesh);
/* On rank 0 (elsewhere NULL) all of the parts, or with `in` (by group) the nodes and the facets of these groups and the
   cells with cell[e] (by cell of the part; NULL: none), with their nodes and facets; with the parts' node_global,
   node_whole and cell_whole. The caller owns it. Collective. */
PetscErrorCode HycoMeshGather(MPI_Comm comm, HycoMesh part, const PetscBool in[], const PetscBool cell[],
                              HycoMesh *mesh);
/* place[k]: how many different keys of all processes are smaller than key[k] >= 0. Collective. */
PetscErrorCode HycoRankInts(MPI_Comm comm, PetscInt n, const PetscInt key[], PetscInt place[], PetscInt *total);
PetscErrorCode HycoRankKeys(MPI_Comm comm, PetscInt n, const PetscInt64 key[], PetscInt place[], PetscInt *total);
/* A star forest from n nodes (leaves, by their numbers in the distributed vectors: those of the part itself, of a
   surface on rank 0) to the processes that own them (roots, by place). Collective; the caller destroys it. */
PetscErrorCode HycoMeshNodeSF(MPI_Comm comm, HycoMesh part, PetscInt n, const PetscInt global[], PetscSF *sf);

/* Values, `width` of a type at each point, from the roots of a star forest to its leaves; from the leaves to the roots,
   each of which has one leaf, or none and is left alone. Collective. */
PetscErrorCode HycoSFBcast(PetscSF sf, MPI_Datatype type, PetscInt width, const void *root, void *leaf);
PetscErrorCode HycoSFSend(PetscSF sf, MPI_Datatype type, PetscInt width, const void *leaf, void *root);

/* The order of the file: a part's own nodes, its own cells (those whose first node is) and rank 0's nodes of a surface
   as leaves of star forests, whose roots are the rows n[] from first[] that a process has of all. */
typedef enum { HYCO_ON_NODES, HYCO_ON_CELLS, HYCO_ON_SURFACE, HYCO_N_PLACES } HycoPlace;
typedef struct {
  MPI_Comm comm;
  PetscInt all[HYCO_N_PLACES], n[HYCO_N_PLACES], first[HYCO_N_PLACES];
  PetscSF sf[HYCO_N_PLACES];
} HycoFileOrder;
/* surface: on rank 0, NULL elsewhere. root: rank 0 has all rows, else each process as many. Collective. */
PetscErrorCode HycoFileOrderCreate(MPI_Comm comm, HycoMesh part, HycoMesh surface, PetscBool root,
                                   HycoFileOrder **order);
PetscErrorCode HycoFileOrderDestroy(HycoFileOrder **order);
/* Brings values (by node, cell or surface node, `components` of a type each) to the rows; rows without any are left
   alone. Collective. */
PetscErrorCode HycoFileOrderSend(const HycoFileOrder *order, HycoPlace place, MPI_Datatype type, PetscInt components,
                                 const void *value, void *rows);
/* The reverse: from the rows to all nodes or cells of the part, its own or not. Collective. */
PetscErrorCode HycoFileOrderFetch(const HycoFileOrder *order, HycoMesh part, HycoPlace place, PetscInt components,
                                  const PetscReal rows[], PetscReal value[]);

/* The scene's mesh as it is read, and refined: each process has the part that it has read (rank 0 all of a mesh file).
   Fails where the mesh, or a group of it, is missing. Collective; the caller owns it. */
PetscErrorCode HycoMeshCreate(MPI_Comm comm, HycoScene scene, HycoMesh *mesh);

#endif
