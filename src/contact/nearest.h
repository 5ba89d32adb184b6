/* The nearest point of a surface: private to contact/. */
#ifndef HYCO_NEAREST_H
#define HYCO_NEAREST_H
#include <hycomesh.h>

/* -- begin: in exported models too -- */
/* Bits: the slave, the master goes round an edge, or either does; the slave closes on itself, or goes round one. */
enum { HYCO_SLAVE_EDGE = 1, HYCO_MASTER_EDGE = 2, HYCO_EDGES = 3, HYCO_SLAVE_ROUND = 4 };

/* A point of a patch: sum of weight[a] times node[a]. Weights have sum 1, and are positive on patches of first order;
   nodes are in ascending order. n = 0: no point. */
typedef struct {
  PetscInt n, node[HYCO_FACET_NODES], patch;
  PetscReal weight[HYCO_FACET_NODES], distance;
} HycoProjection;

/* Product of two normals up to which they oppose each other: within 72 degrees, since beyond one surface looks along
   the other rather than at it. */
#define HYCO_OPPOSED -0.3

/* Of the coordinates' size, or the mesh's length: 45 eps, a mean of positions or a distance. */
#define HYCO_POSITION_ROUND_OFF 1e-14

/* A point with a number, which orders points of equal coordinates. */
typedef struct {
  PetscReal x[3];
  PetscInt index;
} HycoPoint;
/* -- end: in exported models too -- */
/* Rearranges the points lo .. hi - 1 so that those before `mid` come first along the axis. */
void HycoPointsSplit(HycoPoint point[], PetscInt lo, PetscInt mid, PetscInt hi, PetscInt axis);

/* -- begin: in exported models too -- */
/* The tree of the patches: its nodes are boxes; those of at most HYCO_LEAF patches have no children. */
#define HYCO_LEAF 4
typedef struct {
  PetscReal lo[3], hi[3];
} HycoBox;
typedef struct _n_HycoPatches *HycoPatches;
struct _n_HycoPatches {
  const PetscReal *X, *normal; /* borrowed, like node */
  PetscInt n, nf, corners;
  const PetscInt *node;
  HycoPoint *item; /* the patches' centres, in the order of the leaves */
  HycoBox *box;    /* of tree node t; its children are 2 t + 1 and 2 t + 2 */
  HycoBox *turn;   /* the normals of its points; NULL: no points with normals */
};
/* -- end: in exported models too -- */

/* n patches of nf nodes each, the first `corners` of them corners: with nf = corners 1 points, 2 segments, 3 triangles,
   4 bilinear quadrilaterals; else facets of second order (2, 3 or 4 corners). X: coordinates of nodes; normal (n x 3,
   of unit length, or 0 where there is none) may be NULL. X, node (n x nf) and normal are borrowed. The caller destroys
   it. */
PetscErrorCode HycoPatchesCreate(const PetscReal X[], PetscInt n, PetscInt nf, PetscInt corners, const PetscInt node[],
                                 const PetscReal normal[], HycoPatches *patches);
PetscErrorCode HycoPatchesDestroy(HycoPatches *patches);
/* The same in two steps, in the caller's memory: the number of boxes of n patches; the tree of patches whose members
   but `box` and `item`, of which the room is there, are set. */
PetscInt HycoPatchesBoxes(PetscInt n);
void HycoPatchesBuild(HycoPatches patches);
/* The patches' point nearest to x; among equally near ones that of the first patch, so that the result is the same
   with any more patches that are farther away. against: a unit normal that the patch must oppose, or NULL. */
void HycoPatchesProject(HycoPatches patches, const PetscReal x[3], const PetscReal against[3], HycoProjection *p);
/* For points (nf = 1) with normals: the one closest to the line through x along the mean of the unit normal `out` and
   of its own reversed; among equally close ones the nearest to x, then the first. n = 0 if none is within `small` of
   its line; points without a normal, or with nearly the same one, have no line. */
void HycoPatchesAlongLine(HycoPatches patches, const PetscReal x[3], const PetscReal out[3], PetscReal small,
                          HycoProjection *p);
/* Points within `along` of a facet's plane and within `radius` of its centre in the plane. */
typedef struct {
  PetscReal centre[3], normal[3], radius, along;
} HycoPrism;
/* The patches that may meet the prism and others near it, ascending (patch: room for all). */
PetscErrorCode HycoPatchesWithin(HycoPatches patches, const HycoPrism *prism, PetscInt *n, PetscInt patch[]);

#endif
