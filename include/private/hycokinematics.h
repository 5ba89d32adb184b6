/* The map from the reference cell to the moved cell. Included by fe/ and contact/. */
#ifndef HYCO_KINEMATICS_H
#define HYCO_KINEMATICS_H
#include <hycocontactimpl.h>

/* Determinant of the map from the reference cell to the nodes at X (3 a node of the mesh), at quadrature point q. */
PetscReal HycoDeterminant(const HycoElement *el, const PetscInt node[], const PetscReal X[], PetscInt q);
/* Gradients dN/dX (nv x 3) of the shape functions at quadrature point q, and |det J| w. In an axisymmetric scene the
   third component is N / r, the hoop strain of a radial displacement, and the weight that of the full circle. The
   weight is multiplied by the cell's in a cubature (fe->cell_weight). */
PetscErrorCode HycoGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q,
                             PetscReal g[HYCO_CELL_NODES][3], PetscReal *weight);
/* The weights of a cell's points (borrowed), computed once for each position of the nodes. */
PetscErrorCode HycoPointWeights(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal *weight[]);
/* Whether they are kept for fe's nodes (HycoFEKeepGradients()); then dN/dX, followed by the weight. */
static inline PetscBool HycoGradientsKept(HycoFE fe)
{
  return (PetscBool)(fe->kept && fe->kept_place == fe->place);
}
static inline PetscReal *HycoKeptGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q)
{
  return fe->kept + (size_t)(cell * el->nq + q) * (size_t)(3 * el->nv + 1);
}
/* Means over the cell of the dilatation of unit displacements, for the element bbar. */
PetscErrorCode HycoMeanGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal g[HYCO_CELL_NODES][3]);
/* The dilatation of a unit displacement of node a of a cell along c. */
static inline PetscReal HycoDilatation(HycoFE fe, PetscReal g[HYCO_CELL_NODES][3], PetscInt a, PetscInt c)
{
  return g[a][c] + (fe->formulation == HYCO_AXISYMMETRIC && c == 0 ? g[a][2] : 0);
}
/* The position of quadrature point q of a cell. */
void HycoPointPlace(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q, PetscReal x[3]);
/* Strain at a point of u (six components; those beyond n_sigma are 0), from the gradients g of the shape functions
   there; mean: the mean gradients of the element bbar, or NULL. */
void HycoPointStrain(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal u[],
                     PetscReal g[HYCO_CELL_NODES][3], PetscReal mean[HYCO_CELL_NODES][3], PetscReal strain[6]);
/* f += w B^T stress at that point, at the cell's unknowns (nv x dim). */
void HycoPointForce(HycoFE fe, const HycoElement *el, PetscReal g[HYCO_CELL_NODES][3],
                    PetscReal mean[HYCO_CELL_NODES][3], PetscReal w, const PetscReal stress[6], PetscReal f[]);
/* push (nv x dim) += the nodal forces of a cell's thermal strains, the sum of w B^T C eps, with fe's tangents. */
PetscErrorCode HycoCellHeat(HycoFE fe, PetscInt cell, PetscReal push[]);
/* Allocates temperatures and thermal strains; evaluates them at fe's nodes and mu where they have changed. */
PetscErrorCode HycoHeatCreate(HycoFE fe);
PetscErrorCode HycoFESetHeat(HycoFE fe, PetscBool all, const PetscBool changed[]);
/* Supports along a direction at fe's nodes: removes all; adds one, n.u = value of a support of the scene; builds the
   index by unknown, after the last. Their part in a cell's matrix: T^T Ke T. */
void HycoObliqueClear(HycoFE fe);
PetscErrorCode HycoObliqueAdd(HycoFE fe, PetscInt support, PetscInt node, const PetscReal direction[3], PetscReal value,
                              const char key[]);
PetscErrorCode HycoObliqueIndex(HycoFE fe);
void HycoObliqueStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
/* Tied nodes (tied.c): moves them to the position given by their masters, on moved nodes; marks their unknowns as
   fixed with their offset, once the supports along axes are set; checks a tied node with a support along a
   direction. Their part in a cell's matrix, which grows by the masters' nodes. */
PetscErrorCode HycoTiedPlace(HycoFE fe);
PetscErrorCode HycoTiedFix(HycoFE fe);
PetscErrorCode HycoTiedCheckOblique(HycoFE fe, const HycoFixed *fixed, PetscInt group, PetscInt node);
void HycoTiedStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
void HycoTiedComplete(HycoFE fe, PetscReal u[]);
void HycoTiedGeneralise(HycoFE fe, PetscReal f[]);
/* Finds the springs of fe's mesh; evaluates their matrices at fe's nodes and mu; adds those of a cell (counted: that
   this process counts) to its stiffness. The first and the last are NULL-safe. */
PetscErrorCode HycoSpringsCreate(HycoFE fe);
PetscErrorCode HycoSpringsSet(HycoFE fe);
void HycoSpringsAddStiffness(HycoFE fe, PetscInt cell, PetscBool counted, PetscReal Ke[]);
/* Removes from fe->constant the cells whose springs change with the parameters p with changed[p]. */
void HycoSpringsMarkVarying(HycoFE fe, const PetscBool changed[]);
PetscErrorCode HycoSpringsDestroy(HycoSprings *springs);
/* Allocates the tangents. */
PetscErrorCode HycoTangentsCreate(HycoFE fe);
/* Evaluates the tangents at fe's nodes and mu; all: also in cells that no parameter changes. */
PetscErrorCode HycoFESetTangents(HycoFE fe, PetscBool all, PetscBool moved, const PetscBool changed[]);
/* Outward normal times area weight (n dS, of the full circle in an axisymmetric scene) at point q of a facet of the
   moved body; in 1D the sign of the direction away from its cell. */
PetscErrorCode HycoFacetNormal(HycoFE fe, const HycoElement *el, PetscInt facet, PetscInt q, PetscReal n[3]);
/* The same without the factor 2 pi r of an axisymmetric scene, which is 0 on the axis. */
PetscErrorCode HycoFacetDirection(HycoFE fe, const HycoElement *el, PetscInt facet, PetscInt q, PetscReal n[3]);
/* In an axisymmetric scene: whether the mesh file has the node on the axis. */
PetscBool HycoNodeIsOnAxis(HycoFE fe, PetscInt node);
/* Whether a node has no share in the areas of its facets: on cells of second order, a node on the axis of an
   axisymmetric scene, where the integral of its function times r over a facet is 0. */
PetscBool HycoNodeHasNoArea(HycoFE fe, PetscInt node);
/* Computes the signs of the cells' volumes as drawn, and allocates fe->mirrored; computes fe->mirrored at fe's
   nodes. Fails if a map folds a body (turns only some of its cells inside out) or mirrors one of two bodies that
   share nodes. */
PetscErrorCode HycoMirrorCreate(HycoFE fe);
PetscErrorCode HycoMirrorFind(HycoFE fe);
/* For contact k without a free unknown: fails if the gap minus the prescribed displacements is negative by more than
   round-off; else returns it in *left >= 0. gap: as drawn. */
PetscErrorCode HycoContactCheckStill(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal gap, PetscReal *left);
/* Unit normals (n_nodes x 3; zero off the group) of the smooth surface that a group's facets approximate, on fe's
   moved nodes, the angle of uncertainty due to faceting, and the largest angle between facets nearby (n_nodes both).
   side: of nodes on edges the side whose facets count, else HYCO_ONE_SIDE (n_nodes). 2D, 3D. */
PetscErrorCode HycoSmoothNormals(HycoFE fe, PetscInt group, const PetscInt side[], PetscReal normal[],
                                 PetscReal doubt[], PetscReal bend[]);
/* Turns the normal of contact k so that the motions of fe->released are tangential there. */
void HycoTurnNormal(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal n[3]);

#endif
