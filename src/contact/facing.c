/* Normals and sizes of surfaces on moved nodes. */
#include "facing.h"
#include <hycocarriers.h>
#include <hycokinematics.h>
#include <hycovector.h>

PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[])
{
  PetscFunctionBegin;
  PetscCall(HycoSurfaceVectors(fe, group, normal));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) HycoNormalise(normal + 3 * i);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoSurfaceCarriers(HycoMesh m, PetscInt group, PetscBool carries[])
{
  for (PetscInt i = 0; i < m->n_nodes; i++) carries[i] = PETSC_FALSE;
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) carries[m->group_node[k]] = PETSC_TRUE;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    for (PetscInt v = 0; v < HycoMeshFirstCarrier(m) && m->facet_group[f] == group; v++)
      carries[m->facets[f * m->nf + v]] = PETSC_FALSE;
  }
}

PetscErrorCode HycoFacetVector(HycoFE fe, PetscInt facet, PetscReal vector[3])
{
  const HycoElement *el = HycoElementGetFacet(fe->mesh->type);

  PetscFunctionBegin;
  vector[0] = vector[1] = vector[2] = 0;
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal n[3];

    PetscCall(HycoFacetNormal(fe, el, facet, q, n));
    for (PetscInt c = 0; c < 3; c++) vector[c] += n[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoSurfaceSizes(HycoFE fe, PetscInt group, PetscReal size[])
{
  HycoMesh m = fe->mesh;
  const PetscInt nf = m->nf, corners = HycoCellKinds[m->type].corners;

  for (PetscInt i = 0; i < m->n_nodes; i++) size[i] = 0;
  for (PetscInt k = 0; k < m->n_facets * corners; k++) {
    const PetscInt *node = m->facets + k / corners * nf, v = k % corners, ends[2] = {node[v], node[(v + 1) % corners]};
    const PetscReal length = HycoDistance(fe->X + 3 * ends[0], fe->X + 3 * ends[1]);

    if (m->facet_group[k / corners] != group) continue;
    for (PetscInt e = 0; e < 2; e++) size[ends[e]] = PetscMax(size[ends[e]], length);
    for (PetscInt w = corners; w < nf; w++) { /* second order: the middle of the edge, of the facet */
      if (w == corners + v || w == 2 * corners) size[node[w]] = PetscMax(size[node[w]], length);
    }
  }
}
