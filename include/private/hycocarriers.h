/* Which nodes of a facet take contact forces. Included by contact/ and offline/. */
#ifndef HYCOCARRIERS_H
#define HYCOCARRIERS_H

#include <hycomesh.h>

/* The first node of a facet that takes contact forces. All nodes do, except the corners of six-node faces: a uniform
   pressure gives no nodal force there. The middles of the sides have a third of the face each, which integrates
   products of degree 2 exactly. */
static inline PetscInt HycoMeshFirstCarrier(HycoMesh mesh)
{
  return mesh->type == HYCO_TET10 ? HycoCellKinds[mesh->type].corners : 0;
}

#endif
