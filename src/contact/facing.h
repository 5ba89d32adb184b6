/* Normals, sizes and areas of surfaces on moved nodes: private to contact/. */
#ifndef HYCO_FACING_H
#define HYCO_FACING_H
#include <hycocontactimpl.h>

/* Share of the mesh's length: a smaller overlap is round-off. */
#define HYCO_ROUNDING 1e-12

/* Sum of n dS over the facets of `group` around each node (n_nodes x 3), of which the direction matters. */
PetscErrorCode HycoSurfaceVectors(HycoFE fe, PetscInt group, PetscReal vector[]);
/* The same, scaled to unit length; 0 if a node has no facet. */
PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[]);
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
