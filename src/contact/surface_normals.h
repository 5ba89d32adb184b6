/* Normals, sizes and areas of surfaces on moved nodes: private to contact/. */
#ifndef HYCO_SURFACE_NORMALS_H
#define HYCO_SURFACE_NORMALS_H
#include <hycocontactimpl.h>

/* Sum of n dS over the facets of `group` around each node (n_nodes x 3), of which the direction matters. */
PetscErrorCode HycoSurfaceVectors(HycoFE fe, PetscInt group, PetscReal vector[]);
/* The same, scaled to unit length; 0 if a node has no facet. */
PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[]);
/* Adds n dS at a point of a facet to the vector of its node, by the node's function N. */
void HycoAddFacetVector(HycoFE fe, PetscInt node, PetscReal N, const PetscReal n[3], PetscReal vector[3]);
/* Makes mesh->facet_side, unless it is there. */
PetscErrorCode HycoSurfaceSides(HycoScene scene, HycoMesh mesh);
/* The edges of a contact's groups, as in HycoSurfaceFacts, on this process. */
PetscErrorCode HycoContactEdges(HycoScene scene, HycoMesh mesh, HycoContact contact, PetscInt *edges);
/* The same of contact number `index`, as known to the pairs; else those of fe's mesh. */
PetscErrorCode HycoPairsEdges(HycoFE fe, const HycoPairs *pairs, PetscInt index, PetscInt *edges);
/* The slaves of a contact without a search, on edges each of their sides; where the scene gives a normal, on a surface
   that goes round an edge those of which a side leaves along it. The caller frees both arrays. */
PetscErrorCode HycoContactSlaves(HycoFE fe, const HycoPairs *pairs, PetscInt index, PetscInt *n, PetscInt **slave,
                                 PetscInt **side);
/* Masks the facets that face nothing around the slaves of contact `index`, whose pairs begin with `first`. */
PetscErrorCode HycoPairsMask(HycoFE fe, PetscInt index, PetscInt first, HycoPairs *pairs);
/* The nodes of a group with several sides: HYCO_SIDES * node + side, ascending; the caller frees them. */
PetscErrorCode HycoSurfaceSlots(HycoFE fe, PetscInt group, PetscInt *n, PetscInt **slot);
/* For nodes with a side: the sum of n dS (n x 3) and the area of the facets of that side; other entries stay. Either
   may be NULL. */
PetscErrorCode HycoSideSums(HycoFE fe, PetscInt group, PetscInt n, const PetscInt node[], const PetscInt side[],
                            PetscReal vector[], PetscReal share[]);
PetscErrorCode HycoSlotNormals(HycoFE fe, PetscInt group, PetscInt n, const PetscInt slot[], PetscReal normal[],
                               PetscReal share[]);
/* The slots of a node: *count from *first on. */
void HycoSlotsOf(PetscInt n, const PetscInt slot[], PetscInt node, PetscInt *first, PetscInt *count);
/* For nodes with given normals (n x 3): the cosine of the angle to the nearest outward normal of a side (2: the group
   has no facets there), and, of nodes with several sides, the area of those that the normal leaves. Either may be
   NULL. */
PetscErrorCode HycoSidesFacing(HycoFE fe, PetscInt group, PetscInt n, const PetscInt node[], const PetscReal normal[],
                               PetscReal cosine[], PetscReal area[]);
/* The integral of n dS over a facet. */
PetscErrorCode HycoFacetVector(HycoFE fe, PetscInt facet, PetscReal vector[3]);
/* Whether each node of a contact's group takes contact forces (carries: n_nodes; the others are PETSC_FALSE). */
void HycoSurfaceCarriers(HycoMesh mesh, PetscInt group, PetscBool carries[]);
/* The default tolerance of a search: a tenth of the shortest edge between the corners of the group's facets. */
PetscReal HycoSurfaceTolerance(HycoMesh mesh, PetscInt group);
/* Fails if measured gaps overlap more than the scene allows, or if a map has moved a pair's nodes apart along the
   surface. normal and gap as computed by HycoContactGeometry(). */
PetscErrorCode HycoContactCheck(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal gap[]);

#endif
