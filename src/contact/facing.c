/* Normals and sizes of surfaces on moved nodes. */
#include "facing.h"
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
  const PetscInt corners = HycoCellKinds[m->type].corners;

  for (PetscInt i = 0; i < m->n_nodes; i++) carries[i] = PETSC_FALSE;
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) carries[m->group_node[k]] = PETSC_TRUE;
  for (PetscInt k = 0; k < m->n_facets * m->nf && m->type == HYCO_TET10; k++) {
    if (m->facet_group[k / m->nf] == group && k % m->nf < corners) carries[m->facets[k]] = PETSC_FALSE;
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
  const PetscInt nf = m->nf;

  for (PetscInt i = 0; i < m->n_nodes; i++) size[i] = 0;
  for (PetscInt k = 0; k < m->n_facets * nf; k++) {
    const PetscInt a = m->facets[k], b = m->facets[k / nf * nf + (k + 1) % nf];
    const PetscReal length = HycoDistance(fe->X + 3 * a, fe->X + 3 * b);

    if (m->facet_group[k / nf] != group) continue;
    size[a] = PetscMax(size[a], length);
    size[b] = PetscMax(size[b], length);
  }
}
