/*
  Normals of the smooth surface that a group's facets approximate. A node's facets are weighted as on a circle or a
  sphere through it and its neighbours, for which the normal is then exact (N. Max, J. Graphics Tools 4 (1999) 1-6): the
  normal motion of a body of revolution that rotates in its seat is then zero, however irregular its facets are. Facets
  of second order have their own normal at each node; their mean is used.
*/
#include "surface_normals.h"
#include <hycokinematics.h>
#include <hycovector.h>

/* Cosine of the angle of two facets, below which they form an edge of the body: 46 degrees, as between the eight facets
   of a circle; others are a curved surface. */
#define BEND_COSINE 0.7
#define FLAT        1e-6 /* deviation of a plane's normals: coordinates in a mesh file have 6 digits at least */

/* Whether place k of the facets counts at its node. */
static PetscBool SmoothNormalCounts(HycoMesh m, const PetscInt side[], PetscInt k)
{
  return (PetscBool)(side[m->facets[k]] < 0 || m->facet_side[k] == side[m->facets[k]]);
}

/* The weight of the normal of a facet with nf corners at its corner v, from the next and the previous corner. */
static PetscReal SmoothNormalWeight(HycoFE fe, PetscInt nf, const PetscInt node[], PetscInt v)
{
  const PetscInt next = node[(v + 1) % nf], last = node[(v + nf - 1) % nf];
  const PetscReal *x = fe->X + 3 * node[v];
  const PetscReal a = HycoDistance(fe->X + 3 * next, x), b = HycoDistance(fe->X + 3 * last, x),
                  c = HycoDistance(fe->X + 3 * next, fe->X + 3 * last);
  /* By the law of cosines from the three lengths; clipped below, since round-off of a straight angle exceeds 1. */
  const PetscReal cosine = nf > 2 ? (a * a + b * b - c * c) / (2 * a * b) : 0;

  return nf == 2 ? 1 / a : PetscSqrtReal(PetscMax(1 - cosine * cosine, 0)) / (a * b);
}

typedef struct {
  const PetscInt *side;    /* n_nodes: of nodes on edges the side that counts; HYCO_ONE_SIDE: all facets */
  PetscReal *exact, *mean; /* n_nodes x 3: weighted by Max's weights, by areas */
  PetscReal *bend;         /* n_nodes: the largest angle between facets around the node */
  PetscInt *fan;           /* n_nodes: 0 if the facets form a closed ring around the node */
} Surface;

/* Max's weights are sin(angle) / (a b), in 2D 1 / a. Max (1999) chose them so that the normals at the nodes of a sphere
   are exact. */
static PetscErrorCode AddFacets(HycoFE fe, PetscInt group, Surface *s)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf, corners = HycoFacetCorners(m->nf, node);
    PetscReal n[3], unit[3];

    if (m->facet_group[f] != group) continue;
    PetscCall(HycoFacetVector(fe, f, n));
    for (PetscInt c = 0; c < 3; c++) unit[c] = n[c];
    HycoNormalise(unit);
    for (PetscInt v = 0; v < corners; v++) {
      const PetscReal weight = SmoothNormalWeight(fe, corners, node, v);

      if (!SmoothNormalCounts(m, s->side, f * m->nf + v)) continue;
      for (PetscInt c = 0; c < 3; c++) {
        s->exact[3 * node[v] + c] += weight * unit[c];
        s->mean[3 * node[v] + c] += n[c];
      }
      /* each neighbour occurs once as the next and once as the previous, except at a border */
      s->fan[node[v]] += corners == 2 ? (v ? 1 : -1) : node[(v + 1) % corners] - node[(v + corners - 1) % corners];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unit normal of a facet at its node v; for first order that of the facet. */
static PetscErrorCode NormalAt(HycoFE fe, PetscInt facet, PetscInt v, PetscReal n[3])
{
  /* Corners of second-order facets have their own tangents. */
  const HycoElement *nodes = HycoElementGetFacetNodes(fe->mesh->type);

  PetscFunctionBegin;
  if (nodes)
    PetscCall(HycoFacetDirection(fe, nodes, facet, v, n));
  else
    PetscCall(HycoFacetVector(fe, facet, n));
  HycoNormalise(n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For second order: the sums of the facets' normals at the nodes, exact[] and mean[]. A second-order facet has a normal
   of its own at each node, of an accuracy that needs no weights. */
static PetscErrorCode AddNodeNormals(HycoFE fe, PetscInt group, Surface *s)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
    PetscReal n[3];

    if (m->facet_group[k / m->nf] != group || !SmoothNormalCounts(m, s->side, k)) continue;
    PetscCall(NormalAt(fe, k / m->nf, k % m->nf, n));
    for (PetscInt c = 0; c < 3; c++) {
      s->exact[3 * m->facets[k] + c] += n[c];
      s->mean[3 * m->facets[k] + c] += n[c];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes bend[] from the facets' normals and their means; then, for each node, the largest over its facets' nodes
   in wide[]. */
static PetscErrorCode FindBends(HycoFE fe, PetscInt group, Surface *s, PetscReal wide[])
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
    const PetscInt i = m->facets[k];
    PetscReal n[3];

    if (m->facet_group[k / m->nf] != group || !SmoothNormalCounts(m, s->side, k)) continue;
    PetscCall(NormalAt(fe, k / m->nf, k % m->nf, n));
    /* Twice the distance from the mean is about the largest angle between the facets. */
    s->bend[i] = PetscMax(s->bend[i], 2 * HycoDistance(n, s->mean + 3 * i));
  }
  for (PetscInt f = 0; f < m->n_facets; f++) {
    PetscReal most = 0;

    if (m->facet_group[f] != group) continue;
    for (PetscInt v = 0; v < m->nf; v++) {
      const PetscReal bend = s->bend[m->facets[f * m->nf + v]];

      if (bend < BEND_COSINE) most = PetscMax(most, bend);
    }
    for (PetscInt v = 0; v < m->nf; v++) {
      if (SmoothNormalCounts(m, s->side, f * m->nf + v))
        wide[m->facets[f * m->nf + v]] = PetscMax(wide[m->facets[f * m->nf + v]], most);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Normals of the smooth surface at the group's nodes (n_nodes x 3), their possible errors (doubt, radians) and the
   angles between facets (bend). At a closed ring the error is of second order in the bend, at a border of first order.
   Not collective: all facets around the nodes must be in the mesh. These doubts decide which rigid motions of smooth
   surfaces contact does not resist. */
PetscErrorCode HycoSmoothNormals(HycoFE fe, PetscInt group, const PetscInt side[], PetscReal normal[],
                                 PetscReal doubt[], PetscReal bend[])
{
  HycoMesh m = fe->mesh;
  Surface s = {.side = side, .exact = normal};

  PetscFunctionBegin;
  PetscCall(HycoSurfaceSides(fe->scene, m));
  PetscCall(PetscArrayzero(normal, 3 * m->n_nodes));
  PetscCall(PetscArrayzero(bend, m->n_nodes));
  PetscCall(PetscCalloc3(3 * m->n_nodes, &s.mean, m->n_nodes, &s.bend, m->n_nodes, &s.fan));
  if (HycoMeshIsQuadratic(m))
    PetscCall(AddNodeNormals(fe, group, &s));
  else
    PetscCall(AddFacets(fe, group, &s));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    HycoNormalise(s.exact + 3 * i);
    HycoNormalise(s.mean + 3 * i);
  }
  PetscCall(FindBends(fe, group, &s, bend));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    doubt[i] = FLAT;
    /* On an edge of the body each facet is its own surface: there is no smooth normal to be in doubt about. */
    if (s.bend[i] >= BEND_COSINE) continue;
    if (s.fan[i] || HycoMeshIsQuadratic(m))
      doubt[i] += bend[i];
    else
      doubt[i] += 2 * HycoDistance(s.exact + 3 * i, s.mean + 3 * i) + bend[i] * bend[i] / 2;
  }
  PetscCall(PetscFree3(s.mean, s.bend, s.fan));
  PetscFunctionReturn(PETSC_SUCCESS);
}
