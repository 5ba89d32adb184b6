/* The map from the reference cell to the moved one: for fe/ and contact/. */
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
/* Means over the cell of the dilatation of unit displacements, which make that of the element bbar. */
PetscErrorCode HycoMeanGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal g[HYCO_CELL_NODES][3]);
/* The dilatation of a unit displacement of a cell's node a along c. */
static inline PetscReal HycoDilatation(HycoFE fe, PetscReal g[HYCO_CELL_NODES][3], PetscInt a, PetscInt c)
{
  return g[a][c] + (fe->formulation == HYCO_AXISYMMETRIC && c == 0 ? g[a][2] : 0);
}
/* The place of quadrature point q of a cell. */
void HycoPointPlace(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q, PetscReal x[3]);
/* Strain at a point of u (six components; those that are not n_sigma's are 0), from the shape functions' gradients g
   there; mean: those that make the dilatation of the element bbar, or NULL. */
void HycoPointStrain(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal u[],
                     PetscReal g[HYCO_CELL_NODES][3], PetscReal mean[HYCO_CELL_NODES][3], PetscReal strain[6]);
/* f += w B^T stress of that point, at the cell's unknowns (nv x dim). */
void HycoPointForce(HycoFE fe, const HycoElement *el, PetscReal g[HYCO_CELL_NODES][3],
                    PetscReal mean[HYCO_CELL_NODES][3], PetscReal w, const PetscReal stress[6], PetscReal f[]);
/* push (nv x dim) += what the thermal strains of a cell push, the sum of w B^T C eps, by fe's tangents. */
PetscErrorCode HycoCellHeat(HycoFE fe, PetscInt cell, PetscReal push[]);
/* Room for temperatures and thermal strains; fills them at fe's nodes and mu where what changed reaches them. */
PetscErrorCode HycoHeatCreate(HycoFE fe);
PetscErrorCode HycoFESetHeat(HycoFE fe, PetscBool all, const PetscBool changed[]);
/* Supports along a direction at fe's nodes: none; one more, of the scene's support, n.u = value; those by unknown,
   after the last. Their part in a cell's matrix: T^T Ke T. */
void HycoObliqueClear(HycoFE fe);
PetscErrorCode HycoObliqueAdd(HycoFE fe, PetscInt support, PetscInt node, const PetscReal direction[3], PetscReal value,
                              const char key[]);
PetscErrorCode HycoObliqueIndex(HycoFE fe);
void HycoObliqueStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
/* Tied nodes (tied.c): puts them where their masters say, on moved nodes; fixes what they differ by, once the supports
   along axes are set; checks one of a support along a direction. Their part in a cell's matrix, which grows by the
   nodes that they follow. */
PetscErrorCode HycoTiedPlace(HycoFE fe);
PetscErrorCode HycoTiedFix(HycoFE fe);
PetscErrorCode HycoTiedCheckOblique(HycoFE fe, const HycoFixed *fixed, PetscInt group, PetscInt node);
void HycoTiedStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
void HycoTiedComplete(HycoFE fe, PetscReal u[]);
void HycoTiedGeneralise(HycoFE fe, PetscReal f[]);
/* Finds the springs of fe's mesh; their matrices at fe's nodes and mu; those of a cell, added to its stiffness. The
   first and the last are NULL-safe. */
PetscErrorCode HycoSpringsCreate(HycoFE fe);
PetscErrorCode HycoSpringsSet(HycoFE fe);
void HycoSpringsAddStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
/* Takes the cells from fe->constant whose springs change with the parameters p with changed[p]. */
void HycoSpringsMarkVarying(HycoFE fe, const PetscBool changed[]);
PetscErrorCode HycoSpringsDestroy(HycoSprings *springs);
/* Room for the tangents. */
PetscErrorCode HycoTangentsCreate(HycoFE fe);
/* The tangents at fe's nodes and mu; all: of cells that no parameter reaches too. */
PetscErrorCode HycoFESetTangents(HycoFE fe, PetscBool all);
/* Outward normal times area weight (n dS, of the full circle in an axisymmetric scene) at point q of a facet, of the
   moved body; in 1D the sign away from its cell. */
PetscErrorCode HycoFacetNormal(HycoFE fe, const HycoElement *el, PetscInt facet, PetscInt q, PetscReal n[3]);
/* The signs of the cells as drawn, and room for fe->mirrored; finds fe->mirrored at fe's nodes. Fails when a map folds
   a body (some of its cells turned inside out) or mirrors one of two bodies that share nodes. */
PetscErrorCode HycoMirrorCreate(HycoFE fe);
PetscErrorCode HycoMirrorFind(HycoFE fe);
/* Of contact k, which has no free unknown: fails when what its prescribed displacements leave of the gap is negative by
   more than round-off; else *left >= 0. gap: as drawn. */
PetscErrorCode HycoContactCheckStill(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal gap, PetscReal *left);
/* Unit normals (n_nodes x 3; zero off the group) of the smooth surface behind a group's facets on fe's moved nodes, the
   angle by which faceting leaves each in doubt, and the largest angle between facets nearby (n_nodes both). 2D, 3D. */
PetscErrorCode HycoSmoothNormals(HycoFE fe, PetscInt group, PetscReal normal[], PetscReal doubt[], PetscReal bend[]);
/* Turns the normal of contact k so that the motions of fe->released are tangential there. */
void HycoTurnNormal(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal n[3]);

#endif
