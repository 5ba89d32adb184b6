/* Normals and sizes of surfaces on moved nodes. */
#include "facing.h"
#include <hycokinematics.h>

static void Normalise(PetscReal v[3])
{
  const PetscReal length = PetscSqrtReal(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);

  for (PetscInt c = 0; c < 3; c++) v[c] = length > 0 ? v[c] / length : 0;
}

PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[])
{
  PetscFunctionBegin;
  PetscCall(HycoSurfaceVectors(fe, group, normal));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) Normalise(normal + 3 * i);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFacetDirection(HycoFE fe, PetscInt facet, PetscReal normal[3])
{
  const HycoElement *el = HycoElementGetFacet(fe->mesh->type);

  PetscFunctionBegin;
  normal[0] = normal[1] = normal[2] = 0;
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal n[3];

    PetscCall(HycoFacetNormal(fe, el, facet, q, n));
    for (PetscInt c = 0; c < 3; c++) normal[c] += n[c];
  }
  Normalise(normal);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoSurfaceSizes(HycoFE fe, PetscInt group, PetscReal size[])
{
  HycoMesh m = fe->mesh;
  const PetscInt nf = m->nf;

  for (PetscInt i = 0; i < m->n_nodes; i++) size[i] = 0;
  for (PetscInt k = 0; k < m->n_facets * nf; k++) {
    const PetscInt a = m->facets[k], b = m->facets[k / nf * nf + (k + 1) % nf];
    PetscReal sum = 0;

    if (m->facet_group[k / nf] != group) continue;
    for (PetscInt c = 0; c < 3; c++)
      sum += (fe->X[3 * a + c] - fe->X[3 * b + c]) * (fe->X[3 * a + c] - fe->X[3 * b + c]);
    size[a] = PetscMax(size[a], PetscSqrtReal(sum));
    size[b] = PetscMax(size[b], PetscSqrtReal(sum));
  }
}
