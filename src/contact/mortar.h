/* Mortar contacts and ties: private to contact/. */
#ifndef HYCO_MORTAR_H
#define HYCO_MORTAR_H
#include "master_search.h"

/* Most points of a rule on a triangle. */
#define HYCO_MORTAR_POINTS 25

/* A facet in the plane of a slave's facet: coordinates along two axes of the plane (2D: one), and along its normal. */
typedef struct {
  PetscInt nf, corners, node[HYCO_FACET_NODES]; /* nf: functions, 3 on a collapsed quadrilateral */
  PetscReal at[4][2], height[4];                /* of the corners */
} HycoSide;

/* The plane of a slave's facet: the centre of its corners, its outward normal, and two axes. */
typedef struct {
  PetscInt dim;
  PetscReal centre[3], normal[3], axis[2][3], radius; /* radius: of the ball around the corners */
} HycoPlane;

/* A rule on an interval or a triangle: shares of its corners and of its size. */
typedef struct {
  PetscInt n;
  PetscReal share[HYCO_MORTAR_POINTS][3], weight[HYCO_MORTAR_POINTS];
} HycoRule;

/* The part of a slave's facet that faces one facet of the master: its corners in the plane, in 2D the ends. */
typedef struct {
  PetscInt n;
  PetscReal at[8][2], size;
} HycoPiece;

/* A rule that integrates polynomials of the degree exactly over intervals (dim 2) or triangles (dim 3). */
PetscErrorCode HycoRuleCreate(PetscInt dim, PetscInt degree, HycoRule *rule);
/* The plane of a facet with `corners` corners at X and the normal n of unit length. */
void HycoPlaneSet(PetscInt dim, PetscInt corners, const PetscReal *const X[], const PetscReal normal[3],
                  HycoPlane *plane);
/* A facet in a plane. X: coordinates of the mesh's nodes. */
void HycoSideSet(const HycoPlane *plane, PetscInt nf, PetscInt corners, const PetscInt node[], const PetscReal X[],
                 HycoSide *side);
/* The functions of a side's nodes at a point of the plane. */
void HycoSideFunctions(const HycoSide *side, const PetscReal at[2], PetscReal N[HYCO_FACET_NODES]);
/* The common part of two sides in the plane; size 0: none. */
void HycoPieceCut(PetscInt dim, const HycoSide *slave, const HycoSide *master, HycoPiece *piece);
/* Appends the contacts first .. last - 1 of `of` to pairs, with their masters at fe's nodes at most `reach` away. */
PetscErrorCode HycoMortarRows(HycoContact contact, HycoFE fe, const HycoPairs *of, PetscInt first, PetscInt last,
                              PetscReal reach, HycoPairs *pairs);
/* The same for a tie of two groups on fe's nodes: rows of the n slaves; the slave group's other nodes follow the points
   pin[] (by node), and the rows around them take over the forces of their functions. */
PetscErrorCode HycoMortarTie(HycoFE fe, PetscInt slaves, PetscInt masters, const HycoProjection pin[], PetscInt n,
                             const PetscInt slave[], HycoPairs *pairs);

#endif
