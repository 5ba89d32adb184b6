/* Normals and sizes of surfaces on moved nodes: private to contact/. */
#ifndef HYCO_FACING_H
#define HYCO_FACING_H
#include <hycocontactimpl.h>

/* Sum of n dS over the facets of `group` around each node (n_nodes x 3). */
PetscErrorCode HycoSurfaceVectors(HycoFE fe, PetscInt group, PetscReal vector[]);
/* The same, of unit length; 0 where a node has no facet. */
PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[]);
/* The integral of n dS over a facet. */
PetscErrorCode HycoFacetVector(HycoFE fe, PetscInt facet, PetscReal vector[3]);
/* Whether each node of a contact's group carries its forces (carries: n_nodes; the others are PETSC_FALSE). */
void HycoSurfaceCarriers(HycoMesh mesh, PetscInt group, PetscBool carries[]);
/* Fails where measured gaps overlap more than the scene allows, or a map has moved a pair's nodes apart along the
   surface. normal and gap as HycoContactGeometry() gives them. */
PetscErrorCode HycoContactCheck(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal gap[]);

#endif
