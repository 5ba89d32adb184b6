/* Normals, sizes and areas of surfaces on moved nodes. */
#include "surface_normals.h"
#include <hycocarriers.h>
#include <hycokinematics.h>
#include <hycovector.h>

/* Unit normals at the nodes of a group (n_nodes x 3), zero elsewhere. */
PetscErrorCode HycoSurfaceNormals(HycoFE fe, PetscInt group, PetscReal normal[])
{
  PetscFunctionBegin;
  PetscCall(HycoSurfaceVectors(fe, group, normal));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) HycoNormalise(normal + 3 * i);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes that carry contact: all of the group, except for the first nodes of each facet whose functions have no
   positive integral (corners of second-order facets in 3D). */
void HycoSurfaceCarriers(HycoMesh m, PetscInt group, PetscBool carries[])
{
  for (PetscInt i = 0; i < m->n_nodes; i++) carries[i] = PETSC_FALSE;
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) carries[m->group_node[k]] = PETSC_TRUE;
  /* Not those all of whose facets lie on the axis of revolution. */
  for (PetscInt k = 0; m->facet_side && k < 2 * m->n_facets * m->nf; k++) {
    const PetscInt at = k % (m->n_facets * m->nf), other = k / (m->n_facets * m->nf);

    if (m->facet_group[at / m->nf] == group && (m->facet_side[at] != HYCO_NO_SIDE) == other)
      carries[m->facets[at]] = (PetscBool)other;
  }
  for (PetscInt f = 0; f < m->n_facets; f++) {
    /* A corner of a six-node triangle has a zero integral, one of an eight-node quadrilateral a negative one: a
       pressure would give it no force, or one in the wrong direction. */
    for (PetscInt v = 0; v < HycoMeshFirstCarrier(m) && m->facet_group[f] == group; v++)
      carries[m->facets[f * m->nf + v]] = PETSC_FALSE;
  }
}

/* n dS summed over the facet (m^2; axisymmetric: of the ring). */
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

/* By node, the longest edge of the group's facets around it, in the moved position; 0 at other nodes. */
void HycoSurfaceSizes(HycoFE fe, PetscInt group, PetscReal size[])
{
  HycoMesh m = fe->mesh;
  const PetscInt nf = m->nf, corners = HycoCellKinds[m->type].corners;

  for (PetscInt i = 0; i < m->n_nodes; i++) size[i] = 0;
  for (PetscInt k = 0; k < m->n_facets * corners; k++) {
    const PetscInt *node = m->facets + k / corners * nf, v = k % corners, ends[2] = {node[v], node[(v + 1) % corners]};
    const PetscReal length = HycoDistance(fe->X + 3 * ends[0], fe->X + 3 * ends[1]);

    /* Facets of all groups lie in one list. */
    if (m->facet_group[k / corners] != group) continue;
    for (PetscInt e = 0; e < 2; e++) size[ends[e]] = PetscMax(size[ends[e]], length);
    /* Middles of edges and of the facet have the size of the edges around them. */
    for (PetscInt w = corners; w < nf; w++) { /* second order: the middle of the edge, of the facet */
      if (w == corners + v || w == 2 * corners) size[node[w]] = PetscMax(size[node[w]], length);
    }
  }
}

/* Adds the values of tied nodes on a surface, by node and component (v, n_nodes x width), to their masters, which
   have the contact there. Vectors, of which only the direction matters, are added by the size of the weights: on cells
   of second order some are negative, and a sum could have the opposite direction. */
static void PassTied(HycoMesh m, PetscInt width, PetscReal v[])
{
  for (PetscInt k = 0; k < m->n_tied; k++) {
    const PetscReal *weight = m->ties->weight + m->tied_entry[k];

    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      const PetscReal w = weight[j - m->tied_start[k]];

      for (PetscInt c = 0; c < width; c++)
        v[m->tied_master[j] * width + c] += (width > 1 ? PetscAbsReal(w) : w) * v[m->tied[k] * width + c];
    }
  }
}

/* Adds n dS at a point of a facet to its node a, by the node's function N. Where a node has no area, on the axis, the
   sum would be round-off: it is then weighted by N^2, and along the axis, by symmetry. */
void HycoAddFacetVector(HycoFE fe, PetscInt node, PetscReal N, const PetscReal n[3], PetscReal vector[3])
{
  const PetscBool none = HycoNodeHasNoArea(fe, node);

  for (PetscInt c = none; c < 3; c++) vector[c] += (none ? N * N : N) * n[c];
}

/* Integral of N_a n dS by node: its direction is the node's averaged normal, and its length the node's area of a
   plane surface. */
PetscErrorCode HycoSurfaceVectors(HycoFE fe, PetscInt group, PetscReal vector[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(vector, 3 * m->n_nodes));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal n[3];

      PetscCall(HycoFacetNormal(fe, el, f, q, n));
      for (PetscInt a = 0; a < m->nf; a++) {
        const PetscInt node = m->facets[f * m->nf + a];

        HycoAddFacetVector(fe, node, el->N[q][a], n, vector + 3 * node);
      }
    }
  }
  /* A tied slave node has no contact of its own. */
  PassTied(m, 3, vector);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of each node (share, n_nodes) in the area of the surface `group`. Shares add up to the area of the surface,
   those of tied nodes included, as PassTied() hands them on. */
static PetscErrorCode SurfaceNormalShares(HycoFE fe, PetscInt group, PetscReal share[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(share, m->n_nodes));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    for (PetscInt q = 0; m->facet_group[f] == group && q < el->nq; q++) {
      PetscReal n[3];

      PetscCall(HycoFacetNormal(fe, el, f, q, n));
      for (PetscInt a = 0; a < m->nf; a++) {
        const PetscInt node = m->facets[f * m->nf + a];

        /* Nodes on the axis of second-order cells, to which a uniform pressure gives no force. */
        if (!HycoNodeHasNoArea(fe, node)) share[node] += el->N[q][a] * PetscSqrtReal(HycoDot(n, n));
      }
    }
  }
  PassTied(m, 1, share);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Areas of the contacts' slaves (m^2), by which forces become pressures. Not collective. Negative shares, of corners of
   second-order facets, belong to nodes that carry no contact. */
PetscErrorCode HycoContactAreas(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], PetscReal area[])
{
  PetscReal *share;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &share));
  /* The contacts of one scene entry are contiguous: the shares of a surface are integrated once. */
  for (PetscInt k = 0, next; k < pairs->n; k = next) {
    const HycoContact c = fe->scene->contact[pairs->contact[k]];
    PetscInt g = 0;

    next = HycoPairsRun(pairs, k);
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
    PetscCall(SurfaceNormalShares(fe, g, share));
    for (PetscInt i = k; i < next; i++) area[i] = share[pairs->slave[i]];
    if (!HycoContactAverages(c))
      PetscCall(HycoSidesFacing(fe, g, next - k, pairs->slave + k, normal + 3 * k, NULL, area + k));
    PetscCall(HycoSideSums(fe, g, next - k, pairs->slave + k, pairs->side + k, NULL, area + k));
  }
  PetscCall(PetscFree(share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A tenth of the shortest edge as drawn: nodes that are closer count as coincident. 0: no facets here. */
PetscReal HycoSurfaceTolerance(HycoMesh m, PetscInt group)
{
  const PetscInt corners = HycoCellKinds[m->type].corners;
  PetscReal shortest = PETSC_MAX_REAL;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    /* A collapsed quadrilateral has an edge of length 0, which must not count. */
    const PetscInt *node = m->facets + f * m->nf, n = HycoFacetCorners(corners, node);

    if (m->facet_group[f] != group) continue;
    for (PetscInt v = 0; v < n && n > 1; v++) /* the last edge ends at the first node */
      shortest = PetscMin(shortest, HycoDistance(m->xyz + 3 * node[v], m->xyz + 3 * node[(v + 1) % n]));
  }
  return shortest < PETSC_MAX_REAL ? shortest / 10 : 0;
}
