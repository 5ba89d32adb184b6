/* Which nodes of facets carry contact forces: for contact/ and offline/. */
#ifndef HYCOCARRIERS_H
#define HYCOCARRIERS_H

#include <hycomesh.h>

/* The first of a facet's nodes that carries them: all do but the corners of faces of six nodes, to which a uniform
   pressure gives nothing. The middles of the sides have a third of the face each, which integrates products of degree 2
   exactly. */
static inline PetscInt HycoMeshFirstCarrier(HycoMesh mesh)
{
  return mesh->type == HYCO_TET10 ? HycoCellKinds[mesh->type].corners : 0;
}

#endif
