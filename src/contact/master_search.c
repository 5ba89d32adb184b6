/* The surfaces of one contact on the current nodes: the master's patches in a tree, normals of both surfaces, the
   master's border. */
#include "surface_normals.h"
#include "master_search.h"
#include <stdlib.h>

/* -- begin: in exported models too -- */
/* Distance past the border of a surface as a share of the facet's shortest edge, up to which a slave's master is a
   point of the border: borders of two meshes of one surface need not meet (tests/contact/pairing.py). */
#define HYCO_PAST_BORDER 0.1
/* -- end: in exported models too -- */

/* The master's nodes, on an edge once for each side: a mean normal may oppose no slave. */
static PetscErrorCode FindNodes(HycoMasterSearch *t)
{
  HycoMesh m = t->fe->mesh;
  const PetscInt gm = t->master, room = m->group_start[gm + 1] - m->group_start[gm];
  PetscReal *normal, *of;
  PetscInt n_slots, *slot;
  PetscBool *carries;

  PetscFunctionBegin;
  PetscCall(HycoSurfaceSlots(t->fe, gm, &n_slots, &slot));
  PetscCall(PetscMalloc1(room + n_slots, &t->node));
  /* In 1D normals are zero, and every patch opposes. */
  PetscCall(PetscCalloc1(3 * (room + n_slots), &t->normal));
  PetscCall(PetscMalloc3(m->n_nodes, &carries, 3 * m->n_nodes, &normal, 3 * n_slots, &of));
  HycoSurfaceCarriers(m, gm, carries);
  if (m->dim > 1) PetscCall(HycoSurfaceNormals(t->fe, gm, normal));
  PetscCall(HycoSlotNormals(t->fe, gm, n_slots, slot, of, NULL));
  for (PetscInt k = m->group_start[gm]; k < m->group_start[gm + 1]; k++) {
    const PetscInt i = m->group_node[k];
    PetscInt first, count;

    if (!carries[i]) continue;
    HycoSlotsOf(n_slots, slot, i, &first, &count);
    for (PetscInt j = 0; j < PetscMax(count, 1); j++) {
      if (m->dim > 1) PetscCall(PetscArraycpy(t->normal + 3 * t->n, count ? of + 3 * (first + j) : normal + 3 * i, 3));
      t->node[t->n++] = i;
    }
  }
  PetscCall(PetscFree3(carries, normal, of));
  PetscCall(PetscFree(slot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Patches and their normals: the master's nodes (pair) or facets (surface). Borrowed data of fe: nodes must not move
   while the search exists. Normals are of length 1, outward from the master's body. */
static PetscErrorCode FindPatches(HycoMasterSearch *t)
{
  HycoMesh m = t->fe->mesh;
  const PetscInt gm = t->master;

  PetscFunctionBegin;
  t->nf = t->nodes ? 1 : m->nf;
  if (t->nodes) {
    PetscCall(FindNodes(t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(m->n_facets * t->nf, &t->node));
  /* In 1D normals are zero, and every patch opposes. */
  PetscCall(PetscCalloc1(3 * m->n_facets, &t->normal));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != gm) continue;
    if (m->dim > 1) PetscCall(HycoFacetVector(t->fe, f, t->normal + 3 * t->n));
    HycoNormalise(t->normal + 3 * t->n);
    PetscCall(PetscArraycpy(t->node + t->nf * t->n++, m->facets + f * m->nf, t->nf));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sides of the slave's nodes on edges as further slaves. */
static PetscErrorCode AddSlots(HycoMasterSearch *t)
{
  const HycoFE fe = t->fe;

  PetscFunctionBegin;
  PetscCall(HycoSurfaceSlots(fe, t->slave, &t->n_slots, &t->slot));
  if (!t->n_slots) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(3 * (t->n_nodes + t->n_slots), &t->own));
  PetscCall(PetscRealloc((size_t)(3 * (t->n_nodes + t->n_slots)) * sizeof(PetscReal), &t->outward));
  PetscCall(PetscArraycpy(t->own, fe->X, 3 * t->n_nodes));
  for (PetscInt j = 0; j < t->n_slots; j++)
    PetscCall(PetscArraycpy(t->own + 3 * (t->n_nodes + j), fe->X + 3 * (t->slot[j] / HYCO_SIDES), 3));
  t->X = t->own;
  PetscCall(HycoSlotNormals(fe, t->slave, t->n_slots, t->slot, t->outward + 3 * t->n_nodes, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoMasterSearchSlave(const HycoMasterSearch *t, PetscInt node, PetscInt side)
{
  PetscInt first, n;

  HycoMasterSearchSides(t, node, side, &first, &n);
  return side < 0 ? node : first;
}

void HycoMasterSearchSides(const HycoMasterSearch *t, PetscInt node, PetscInt side, PetscInt *first, PetscInt *n)
{
  HycoSlotsOf(t->n_slots, t->slot, node, first, n);
  *first = *n ? t->n_nodes + *first + PetscMin(PetscMax(side, 0), *n - 1) : node;
  if (!*n || side >= 0) *n = 1;
}

/* The groups of a contact by name: on a rank's part they may be empty, and the search then has no patches. `nodes`:
   masters are nodes (pair), not points of facets. */
PetscErrorCode HycoMasterSearchCreate(HycoFE fe, HycoContact c, PetscBool nodes, PetscInt edges, HycoMasterSearch *t)
{
  const PetscInt corners = HycoCellKinds[fe->mesh->type].corners;
  PetscInt slave, master;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &slave));
  PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->master, &master));
  PetscCall(HycoMasterSearchCreateOn(fe, slave, master, nodes, t));
  /* Facets of second order are projected on by their corners. */
  for (PetscInt k = 0; k < t->n * corners && t->nf > corners; k++)
    t->node[k] = t->node[k / corners * t->nf + k % corners];
  t->nf = PetscMin(t->nf, corners);
  t->edges = edges;
  PetscCall(AddSlots(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes are borrowed: fe stays there as long as the search exists. The tree and the border are made when they are
   needed. */
PetscErrorCode HycoMasterSearchCreateOn(HycoFE fe, PetscInt slave, PetscInt master, PetscBool nodes,
                                        HycoMasterSearch *t)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  t->fe = fe;
  t->nodes = nodes;
  t->n_nodes = fe->mesh->n_nodes;
  t->X = fe->X;
  t->slave = slave;
  t->master = master;
  PetscCall(FindPatches(t));
  PetscCall(PetscCalloc1(3 * t->n_nodes, &t->outward));
  /* In 1D a surface is a point, and any master point faces it. */
  if (fe->dim > 1) PetscCall(HycoSurfaceNormals(fe, t->slave, t->outward));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tree is built at the first query; a contact whose slaves are all on other ranks builds none. */
PetscErrorCode HycoMasterSearchReady(HycoMasterSearch *t)
{
  PetscFunctionBegin;
  if (!t->patches) PetscCall(HycoPatchesCreate(t->X, t->n, t->nf, t->nf, t->node, t->normal, &t->patches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drops the tree and the border, for other patches or positions. */
PetscErrorCode HycoMasterSearchForget(HycoMasterSearch *t)
{
  PetscFunctionBegin;
  PetscCall(HycoPatchesDestroy(&t->patches));
  HycoFreeAll(&t->border, &t->at_border);
  t->n_border = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMasterSearchDestroy(HycoMasterSearch *t)
{
  PetscFunctionBegin;
  PetscCall(HycoMasterSearchForget(t));
  HycoFreeAll(&t->node, &t->normal, &t->outward, &t->slot, &t->own);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- begin: in exported models too -- */
/* NULL: the slave has no normal (1D, or a group without facets). */
const PetscReal *HycoMasterSearchOutward(const HycoMasterSearch *t, PetscInt slave)
{
  const PetscReal *n = t->outward + 3 * slave;

  return HycoDot(n, n) > 0 ? n : NULL;
}

/* The shortest edge of a patch. */
static PetscReal ShortestEdge(const HycoMasterSearch *t, PetscInt patch)
{
  const PetscInt *node = t->node + patch * t->nf, corners = HycoFacetCorners(t->nf, node);
  PetscReal shortest = PETSC_MAX_REAL;

  for (PetscInt a = 0; a < corners; a++)
    shortest = PetscMin(shortest, HycoDistance(t->X + 3 * node[a], t->X + 3 * node[(a + 1) % corners]));
  return shortest;
}

/* The vector from the slave to its master point, at the current nodes. */
void HycoMasterSearchAcross(const HycoMasterSearch *t, PetscInt slave, const HycoProjection *at, PetscReal r[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    r[c] = -t->X[3 * slave + c];
    for (PetscInt a = 0; a < at->n; a++) r[c] += at->weight[a] * t->X[3 * at->node[a] + c];
  }
}

/* The nearest point whose facet opposes the slave's normal; any_side: the nearest point whatever its normal. Where
   the nearest one does not oppose, another facet at the same point may, within HYCO_SAME_POINT; where surfaces go round
   edges also a farther one that lies in front of the slave, as the wall of a corner near whose floor the slave is. */
void HycoMasterSearchProject(const HycoMasterSearch *t, PetscInt slave, PetscBool any_side, HycoProjection *at)
{
  const PetscReal *out = HycoMasterSearchOutward(t, slave), *x = t->X + 3 * slave;
  HycoProjection nearest;
  PetscReal r[3];

  HycoPatchesProject(t->patches, x, NULL, &nearest);
  *at = nearest;
  if (any_side || !out || !at->n || HycoDot(out, t->normal + 3 * at->patch) <= HYCO_OPPOSED) return;
  /* The second search has the condition on normals inside, and its result may be a far one, which is why distances
     are compared. */
  HycoPatchesProject(t->patches, x, out, at); /* at a corner: of the facets that contain the point */
  if (!at->n || at->distance <= nearest.distance + HYCO_SAME_POINT * ShortestEdge(t, at->patch)) return;
  HycoMasterSearchAcross(t, slave, at, r);
  if (!(t->edges & HYCO_EDGES) || HycoDot(r, out) < -HYCO_OPPOSED * at->distance) at->n = 0;
}

/* Edges as pairs of ascending nodes. */
static int CompareEdges(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a, *q = (const PetscInt *)b;

  if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
  return (p[1] > q[1]) - (p[1] < q[1]);
}

/* In the interior of a facet: no. */
PetscBool HycoMasterSearchOnBorder(const HycoMasterSearch *t, const HycoProjection *at)
{
  const PetscInt edge[2] = {at->node[0], at->n > 1 ? at->node[1] : at->node[0]};

  /* Facets of one node, or a point inside a facet: no border. */
  if (t->nf == 1 || at->n > 2 || at->n < 1 || (t->nf == 2 && at->n == 2)) return PETSC_FALSE;
  if (at->n == 1) return t->at_border[at->node[0]];
  return (PetscBool)(bsearch(edge, t->border, (size_t)t->n_border, 2 * sizeof(PetscInt), CompareEdges) != NULL);
}

/* Compares the tangential part of the vector from the node to its master point, in the facet's plane, with the
   tolerance. A projection onto the border's edge is past it if the node lies beyond, along the surface. */
PetscBool HycoMasterSearchIsOutside(const HycoMasterSearch *t, PetscInt slave, const HycoProjection *at)
{
  PetscReal r[3];

  HycoMasterSearchAcross(t, slave, at, r);
  return (PetscBool)(HycoTangentialLength(r, t->normal + 3 * at->patch) >
                     HYCO_PAST_BORDER * ShortestEdge(t, at->patch));
}
/* -- end: in exported models too -- */

/* Finds the edges (2D: ends) that belong to one facet only, and their nodes, unless they are there. */
PetscErrorCode HycoMasterSearchBorder(HycoMasterSearch *t)
{
  const PetscInt nf = t->nf, edges = t->n * nf;

  PetscFunctionBegin;
  if (t->at_border) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * edges, &t->border));
  PetscCall(PetscCalloc1(t->n_nodes, &t->at_border));
  for (PetscInt k = 0; k < edges; k++) {
    const PetscInt a = t->node[k], b = nf == 2 ? a : t->node[k / nf * nf + (k + 1) % nf];

    t->border[2 * k] = PetscMin(a, b);
    t->border[2 * k + 1] = PetscMax(a, b);
  }
  if (edges) qsort(t->border, (size_t)edges, 2 * sizeof(PetscInt), CompareEdges);
  /* After sorting, equal edges are neighbours: a run of one is a border. The array is compacted in place. */
  for (PetscInt k = 0, next; k < edges; k = next) {
    for (next = k + 1; next < edges && !CompareEdges(t->border + 2 * k, t->border + 2 * next);) next++;
    if (next > k + 1 || (nf > 2 && t->border[2 * k] == t->border[2 * k + 1])) continue; /* or a triangle's last side */
    for (PetscInt j = 0; j < 2; j++) {
      t->at_border[t->border[2 * k + j]] = PETSC_TRUE;
      t->border[2 * t->n_border + j] = t->border[2 * k + j];
    }
    t->n_border++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Made for messages alone, and therefore late. */
PetscErrorCode HycoMasterSearchAtBorder(HycoMasterSearch *t, const HycoProjection *at, PetscBool *border)
{
  PetscFunctionBegin;
  PetscCall(HycoMasterSearchBorder(t));
  *border = HycoMasterSearchOnBorder(t, at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The border is searched for only where a node may be past it. */
PetscErrorCode HycoMasterSearchIsPast(HycoMasterSearch *t, PetscInt slave, const HycoProjection *at, PetscBool *past)
{
  PetscFunctionBegin;
  *past = HycoMasterSearchIsOutside(t, slave, at);
  if (*past) PetscCall(HycoMasterSearchAtBorder(t, at, past));
  PetscFunctionReturn(PETSC_SUCCESS);
}
