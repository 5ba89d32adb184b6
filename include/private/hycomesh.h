/*
  HycoMesh: the tables of a DM: cells, nodes and groups as plain arrays on one process, made once from its part of the
  DMPlex and kept with it, so that no element loop queries the DM. They live as long as the DM does.
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
  HYCO_N_MESH_TYPES, /* the types of meshes; the others are only shapes of single cells in meshes of hex8 */
  HYCO_PYRAMID5 = HYCO_N_MESH_TYPES,
  HYCO_PRISM6,
  HYCO_N_CELL_TYPES
} HycoCellType;

/* The most nodes of a cell. */
#define HYCO_CELL_NODES 27
/* The most nodes of a facet. */
#define HYCO_FACET_NODES 9

/* Properties of the cell types: names, dimensions, nodes of a cell and of its facets, and how many nodes of a facet
   are corners, which come first. */
typedef struct {
  const char *name;
  PetscInt dim, nv, nf, corners;
  PetscBool quadratic;
} HycoCellKind;
extern const HycoCellKind HycoCellKinds[HYCO_N_CELL_TYPES];

typedef struct _n_HycoMesh *HycoMesh;

/* The sides 0, 1, ... of a node on an edge of more than 40 degrees, at most one for each direction; of other nodes; of
   facets on the axis of revolution, which are no surface. */
enum { HYCO_NO_SIDE = -2, HYCO_ONE_SIDE = -1, HYCO_SIDES = 3 };

/*
  Shapes (shapes.c): a mesh of several types of first order, or of prisms or pyramids, has the type quad4 or hex8. Its
  smaller cells are collapsed: a node at several places of the cell, next to each other. The map of the wider type then
  reproduces the smaller one's functions: those of a repeated node add up. So is a triangle among a mesh's
  quadrilateral facets, whose last two nodes are the same.
*/
/* The type of a mesh with cells of these shapes, bits 1 << HycoCellType; HYCO_N_CELL_TYPES: there is none. */
HycoCellType HycoShapesType(PetscInt shapes);
/* Converts the nodes of a cell of this shape, or of a facet, to nv nodes (room for them). */
void HycoShapeWiden(HycoCellType shape, PetscInt nv, PetscInt node[]);
/* The shape of a cell in a mesh of a type. */
HycoCellType HycoShapeOf(HycoCellType type, const PetscInt node[]);
/* -- begin: in exported models too -- */
/* The number of corners of a facet with nf nodes of first order. */
static inline PetscInt HycoFacetCorners(PetscInt nf, const PetscInt node[])
{
  return nf == 4 && node[2] == node[3] ? 3 : nf;
}
/* -- end: in exported models too -- */

/* The scene's ties on the whole mesh, the same on all ranks: slave nodes with their masters, u_slave = sum of weight
   times u_master. Entries of a slave are contiguous; slaves and masters are in ascending order. Reference-counted. */
typedef struct _n_HycoTies *HycoTies;
struct _n_HycoTies {
  PetscInt references, n;
  HycoCellType type;         /* of the mesh's cells: the size of their cones does not tell it */
  PetscInt *slave, *master;  /* tags in the mesh file */
  PetscInt *tie, *body;      /* index of the tie in the scene; the body that moves the master */
  PetscReal *weight, *reach; /* largest distance of the slave from the position given by its masters */
};

/* Nodes of a cell's unknowns: its own, and the masters of its tied nodes. */
#define HYCO_MAX_CELL_NODES (HYCO_CELL_NODES * (1 + HYCO_FACET_NODES))

struct _n_HycoMesh {
  DM dm;                /* that owns these tables; NULL: they have no DM yet */
  PetscInt dim, nv, nf; /* space dimension; nodes of a cell, of a facet */
  HycoCellType type;
  PetscBool mixed; /* whether the whole mesh has collapsed cells */
  /* nodes, ascending by tag; in a part first those of its cells, then the others */
  PetscInt n_nodes;
  PetscReal *xyz;          /* n_nodes x 3, as in the file (not moved) */
  PetscInt *node_id;       /* tag in the mesh file */
  PetscInt *node_body;     /* the body that moves it */
  PetscInt *node_global;   /* number in the distributed vectors; NULL (never for want of nodes): its own index */
  PetscInt *node_whole;    /* index in the whole mesh; NULL as above */
  PetscInt *node_point;    /* point of the DM, in tables made from a DM; else NULL */
  PetscInt n_owned, first; /* with node_global: the numbers of this process's own nodes, first .. first + n_owned - 1 */
  /* of the whole mesh of a part or a surface; 0: of this one */
  PetscInt n_whole_nodes, n_whole_cells;
  PetscReal whole_length;
  PetscReal length; /* of its own bounding box, once HycoMeshLength() was asked for it; else 0 */
  /* cells, ascending by tag */
  PetscInt n_cells;
  PetscInt *cells;      /* n_cells x nv, node indices */
  PetscInt *cell_id;    /* tag in the mesh file */
  PetscInt *cell_body;  /* index in scene->body */
  PetscInt *cell_whole; /* index in the whole mesh; NULL as node_whole */
  PetscInt *cell_point; /* point of the DM, in tables made from a DM; else NULL */
  /* groups of the file, by name */
  PetscInt n_groups;
  char **group_name;
  PetscInt *group_dim;
  PetscInt *group_start, *group_node; /* nodes of group g: group_node[group_start[g] .. group_start[g+1]), ascending */
  /* facets of the groups of dimension dim - 1, nodes ordered so that the normal points out of their cell */
  PetscInt n_facets;
  PetscInt *facets;      /* n_facets x nf */
  PetscInt *facet_group; /* index of the group; a facet in two groups occurs twice */
  PetscInt *facet_cell;  /* the cell that it bounds; -1: not in this mesh */
  /* n_facets x nf: the side of its group's edge at the node, as drawn, HYCO_ONE_SIDE or HYCO_NO_SIDE; NULL until
     HycoSurfaceSides() */
  PetscInt *facet_side;
  /* n_facets x nf: its place among the facets of its group around the node, by tags; with facet_side, of groups with
     edges */
  PetscInt *facet_rank;
  PetscInt *facet_point; /* of a submesh: the point of the DM that is a facet without its cell, else -1; or NULL */
  /* cell groups that are no body (regions): cells of group g as CSR over groups */
  PetscInt *group_cell_start, *group_cell;
  /* ties (ties.c); NULL if the scene has none. The tied nodes of this mesh, ascending; their masters, all of which
     are in this mesh too; and by cell, in CSR: the masters of its tied nodes that are not its own nodes */
  HycoTies ties;
  PetscInt n_tied, *tied, *tied_start, *tied_entry; /* tied_start: n_tied + 1; tied_entry: index in ties of the first
                                                       entry of each */
  PetscInt *tied_master;                            /* nodes; their weights are in ties */
  PetscInt *tied_at;                                /* by node: its index in tied, or -1 */
  PetscInt *follow_start, *follow;
};

/* The distinct nodes of a cell (room for nv), in the order of its shape; returns their number. */
static inline PetscInt HycoMeshOwnNodes(HycoMesh m, PetscInt cell, PetscInt node[])
{
  const PetscInt *all = m->cells + cell * m->nv;
  PetscInt n = 0;

  for (PetscInt v = 0; v < m->nv; v++) {
    if (!v || all[v] != all[v - 1]) node[n++] = all[v];
  }
  return n;
}
/* The nodes of a cell's unknowns (room for HYCO_MAX_CELL_NODES): its own, then masters of tied nodes; returns their
   number. */
static inline PetscInt HycoMeshCellNodes(HycoMesh m, PetscInt cell, PetscInt node[])
{
  PetscInt n = HycoMeshOwnNodes(m, cell, node);

  for (PetscInt k = m->ties ? m->follow_start[cell] : 0; m->ties && k < m->follow_start[cell + 1]; k++)
    node[n++] = m->follow[k];
  return n;
}
/* Their number, with the repeated nodes of a collapsed cell. */
static inline PetscInt HycoMeshCellSize(HycoMesh m, PetscInt cell)
{
  return m->nv + (m->ties ? m->follow_start[cell + 1] - m->follow_start[cell] : 0);
}
/* A tied node's index in mesh->tied, or -1. */
static inline PetscInt HycoMeshTied(HycoMesh m, PetscInt node)
{
  return m->ties ? m->tied_at[node] : -1;
}

/* The shape of a cell. */
static inline HycoCellType HycoMeshShape(HycoMesh m, PetscInt cell)
{
  return HycoShapeOf(m->type, m->cells + cell * m->nv);
}

/* The tables of a DM (borrowed): those that it has, or, collectively, new ones for the scene. A DM that another program
   made gets tags and complete labels. Scenes that share a DM must have the same bodies. */
PetscErrorCode HycoMeshOf(DM dm, HycoScene scene, HycoMesh *mesh);
/* Gives tables that were read or received, with their ties, a DM of their own on this process. Not collective. */
PetscErrorCode HycoMeshCreateDM(HycoScene scene, HycoMesh mesh);
/* Releases the caller's reference to the tables' DM; frees tables without a DM. */
PetscErrorCode HycoMeshDestroy(HycoMesh *mesh);
/* Takes the tables from their DM, which is released: they outlive it. */
PetscErrorCode HycoMeshDetach(HycoMesh mesh);

/* Whether the mesh's cells are of second order. */
static inline PetscBool HycoMeshIsQuadratic(HycoMesh mesh)
{
  return HycoCellKinds[mesh->type].quadratic;
}
/* Reads and checks the scene's mesh file on this process alone. */
PetscErrorCode HycoMeshRead(HycoScene scene, HycoMesh *mesh);
/* Index of a group; fails with the list of existing groups. `key`: the scene's entry, for the message. */
PetscErrorCode HycoMeshFindGroup(HycoMesh mesh, const char key[], const char name[], PetscInt *group);
/* Sets the body that moves each node; fails if maps disagree, or if a 1D or 2D mesh has nodes off the line or plane. */
PetscErrorCode HycoMeshSetNodeBodies(HycoScene scene, HycoMesh mesh);
/* Checks that every group named in the scene is in the mesh. */
PetscErrorCode HycoMeshCheckGroups(HycoMesh mesh, HycoScene scene);

/*
  The submesh of `of` with the cells keep[0..n_keep) (ascending) and, after their nodes, extra[0..n_extra), as a DM on
  this process and its tables. A facet is kept, with its nodes, if its cell is, or if its group is in
  all_facets[0..n_all); so are the masters of tied nodes. node_whole and cell_whole are the numbers in the whole mesh.
  The caller owns it; not collective.
*/
PetscErrorCode HycoSubmesh(HycoScene scene, HycoMesh of, PetscInt n_keep, const PetscInt keep[], PetscInt n_extra,
                           const PetscInt extra[], PetscInt n_all, const PetscInt all_facets[], HycoMesh *sub);
/* The subpoint IS of a submesh's DM (borrowed; NULL: it is none): the points of the other DM, of a facet without its
   cell that cell. */
PetscErrorCode HycoSubmeshGetPoints(DM sub, IS *points);
/* The submesh of all cells and the first n nodes of `of`, with which its cells' nodes begin, and of the facets between
   these; nodes keep their indices. The caller owns it; not collective. */
PetscErrorCode HycoSubmeshFirst(HycoScene scene, HycoMesh of, PetscInt n, HycoMesh *sub);
/* node[i]: the node of `of` that is node i of its submesh. */
PetscErrorCode HycoSubmeshNodes(HycoMesh sub, HycoMesh of, PetscInt node[]);

/* Sorts a[0..*n), unless it is sorted, and removes repeated entries. */
PetscErrorCode HycoSortUnique(PetscInt *n, PetscInt a[]);

/* The largest and the negated smallest coordinates, as in the file. */
void HycoMeshEnds(HycoMesh mesh, PetscReal ends[6]);
/* The largest extent of the whole mesh, as in the file, along an axis. */
PetscReal HycoMeshLength(HycoMesh mesh);
/* Index of a node among the nodes that this process owns, or -1 if another process owns it. */
static inline PetscInt HycoMeshOwned(HycoMesh m, PetscInt node)
{
  const PetscInt place = m->node_global ? m->node_global[node] - m->first : node;

  return !m->node_global || (place >= 0 && place < m->n_owned) ? place : -1;
}

/* Turns the nodes of a facet of a cell (-1: unknown, kept) so that its normal points out of the cell. Facets of a mesh
   that was made from a DM are turned; those of one that was read are as in the file. */
void HycoMeshTurnFacet(HycoMesh mesh, PetscInt cell, PetscInt facet[]);
/* The number of a facet in its cell. */
PetscInt HycoMeshFacetNumber(HycoMesh mesh, PetscInt facet);
/* The segments of a group of dimension 1 in space, n x 2 nodes, of second order n x 3 with the middle nodes: the
   edges of cells between nodes of the group. Fails if they branch. The caller frees them. */
PetscErrorCode HycoMeshLine(HycoMesh mesh, PetscInt group, PetscInt *n, PetscInt **segment);
/* Sets the ties of the mesh's nodes, by tag (NULL: none); takes a reference. Nodes and cells must be set. */
PetscErrorCode HycoMeshSetTies(HycoMesh mesh, HycoTies ties);
/* Allocates n entries for a mesh of these cells, with one reference; the last HycoTiesDestroy() frees them. */
PetscErrorCode HycoTiesCreate(PetscInt n, HycoCellType type, HycoTies *ties);
PetscErrorCode HycoTiesDestroy(HycoTies *ties);
/* Sends rank 0's ties to every rank (NULL: none). Collective. */
PetscErrorCode HycoTiesBcast(MPI_Comm comm, HycoTies *ties);
/* The ties composed with a DM (borrowed), or NULL; composes them (takes a reference). */
PetscErrorCode HycoTiesOf(DM dm, HycoTies *ties);
PetscErrorCode HycoTiesAttach(DM dm, HycoTies ties);
/* Cells around each node, also those with a tied node whose master it is: CSR start[n_nodes + 1], cell[]. The caller
   frees both. */
PetscErrorCode HycoMeshNodeCells(HycoMesh mesh, PetscInt **start, PetscInt **cell);

/* The partitioner: -hyco_partition. */
typedef enum { HYCO_PARTITION_METIS, HYCO_PARTITION_PTSCOTCH } HycoPartitioner;
extern const char *const HycoPartitioners[];

/* The scene's mesh as a DMPlex, read on rank 0. Collective. */
PetscErrorCode HycoMeshLoad(MPI_Comm comm, HycoScene scene, DM *dm);
/* Creates a DM from rank 0's tables (NULL elsewhere), not distributed. Collective. */
PetscErrorCode HycoPlexFromMesh(MPI_Comm comm, HycoMesh mesh, DM *dm);
/* Reads PETSc's HDF5 format. Collective. */
PetscErrorCode HycoPlexRead(MPI_Comm comm, const char path[], DM *dm);
/* For a DM that was not made from a mesh file: tags, and labels with the closure of their points on every process.
   Collective. */
PetscErrorCode HycoPlexComplete(DM dm);
/* Halves all cells `times` times. New vertices get tags above the existing ones, in the order of their parents'. The
   DM must have no overlap. Groups are refined too; fails for one of the scene's whose lines or facets the DM does
   not know. Collective. */
PetscErrorCode HycoPlexRefine(DM *dm, HycoScene scene, PetscInt times);
/*
  Distributes it: the cells by METIS, those on the two sides of a contact on one rank where possible (pairs: n_pairs x 2
  node indices of rank 0's tables `whole`); refines it as given in the scene; writes it to `write` in PETSc's HDF5
  format, unless that is empty; and adds to each rank the cells that touch its own. Collective.
*/
PetscErrorCode HycoMeshDistribute(DM *dm, HycoScene scene, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner by, const char write[]);
/* Tables of each process's part: the cells that touch a node that it owns. On one process node_global, node_whole
   and cell_whole stay NULL. The caller owns a reference. Collective. */
PetscErrorCode HycoPlexToMesh(DM dm, HycoScene scene, HycoMesh *mesh);
/* The submesh on rank 0 (elsewhere NULL) of a distributed mesh with the nodes and facets of groups (in: by group) and
   the cells with cell[e] (by cell of the part; NULL: none), with the parts' node_global, node_whole and cell_whole; its
   subpoint IS numbers the points of all processes, those of rank 0 first. The caller owns it. Collective. */
PetscErrorCode HycoMeshGather(HycoScene scene, HycoMesh part, const PetscBool in[], const PetscBool cell[],
                              HycoMesh *mesh);
/* The nodes node[0..n) (numbers in the distributed vectors, of any ranks, perhaps repeated) with all facets of the
   groups in[] around them, the nodes of these, and the masters of tied ones, as a mesh of this process; around a node
   are also the facets of nodes that are tied to it. The mesh has no cells (1D: those of the facets), knows to which
   rank each node belongs (HycoMeshOwned()), and has all groups with its own nodes of them. The caller owns it.
   Collective. */
PetscErrorCode HycoMeshRings(MPI_Comm comm, HycoScene scene, HycoMesh part, const PetscBool in[], PetscInt n,
                             const PetscInt node[], HycoMesh *mesh);
/* The ranks that own nodes (numbers in the distributed vectors). Collective. */
PetscErrorCode HycoMeshOwners(MPI_Comm comm, HycoMesh part, PetscInt n, const PetscInt global[], PetscMPIInt owner[]);
/* place[k]: the number of different keys of all processes that are smaller than key[k] >= 0. Collective. */
PetscErrorCode HycoRankInts(MPI_Comm comm, PetscInt n, const PetscInt key[], PetscInt place[], PetscInt *total);
PetscErrorCode HycoRankKeys(MPI_Comm comm, PetscInt n, const PetscInt64 key[], PetscInt place[], PetscInt *total);
/* A star forest from n nodes (leaves, by their numbers in the distributed vectors: those of the part itself, or of a
   surface on rank 0) to the processes that own them (roots, by place). Collective; the caller destroys it. */
PetscErrorCode HycoMeshNodeSF(MPI_Comm comm, HycoMesh part, PetscInt n, const PetscInt global[], PetscSF *sf);

/* Sends values, `width` of a type at each point, from the roots of a star forest to its leaves; or from the leaves
   to the roots, each of which has at most one leaf; a root without a leaf is unchanged. Collective. */
PetscErrorCode HycoSFBcast(PetscSF sf, MPI_Datatype type, PetscInt width, const void *root, void *leaf);
PetscErrorCode HycoSFSend(PetscSF sf, MPI_Datatype type, PetscInt width, const void *leaf, void *root);

/* The order of the file: the nodes and cells that a part owns (it owns the cells whose first node it owns) are leaves
   of star forests, whose roots are the rows of each process, n[] from first[]. */
typedef enum { HYCO_ON_NODES, HYCO_ON_CELLS, HYCO_N_PLACES } HycoPlace;
typedef struct {
  MPI_Comm comm;
  PetscInt all[HYCO_N_PLACES], n[HYCO_N_PLACES], first[HYCO_N_PLACES];
  PetscSF sf[HYCO_N_PLACES];
} HycoFileOrder;
/* root: rank 0 has all rows, else all processes have about the same number. Collective. */
PetscErrorCode HycoFileOrderCreate(MPI_Comm comm, HycoMesh part, PetscBool root, HycoFileOrder **order);
PetscErrorCode HycoFileOrderDestroy(HycoFileOrder **order);
/* Sends values (by node, cell or surface node, `components` of a type each) to the rows; rows without a value are
   unchanged. Collective. */
PetscErrorCode HycoFileOrderSend(const HycoFileOrder *order, HycoPlace place, MPI_Datatype type, PetscInt components,
                                 const void *value, void *rows);
/* The reverse: from the rows to all nodes or cells of the part, owned or not. Collective. */
PetscErrorCode HycoFileOrderFetch(const HycoFileOrder *order, HycoMesh part, HycoPlace place, PetscInt components,
                                  const PetscReal rows[], PetscReal value[]);

/* The scene's mesh as it is read, and refined: each process has the part that it has read (rank 0 all of a mesh
   file). Fails if the mesh, or one of its groups, is missing. Collective; the caller owns it. */
PetscErrorCode HycoMeshCreate(MPI_Comm comm, HycoScene scene, HycoMesh *mesh);

#endif
