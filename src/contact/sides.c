/*
  The sides of a surface that goes round an edge. At a node whose facets lie on both sides of an edge a mean normal
  belongs to no side, and the area of a facet that faces nothing carries no force: there each side is a surface of its
  own, with its own normal, area and contact.
*/
#include "surface_normals.h"
#include "nearest.h"
#include <hycokinematics.h>
#include <hycovector.h>
#include <stdlib.h>

/* Cosine of the angle of two facets, below which they are on two sides: 40 degrees, more than on a circle of ten
   facets. */
#define EDGE_COSINE 0.766

/* The facets around a node, as places f * nf + a of facets[], of one group. */
typedef struct {
  HycoMesh m;
  PetscInt n, *place;
  const PetscReal *normal; /* by place, of length 1, as drawn; 0: on the axis of revolution, where no surface is */
  PetscInt *side, *rank;   /* by place */
} Star;

/* Of the drawing: the contacts and their order do not depend on the parameters. */
static PetscErrorCode FindNormals(HycoScene scene, HycoMesh m, PetscReal normal[])
{
  const HycoElement *nodes = HycoElementGetFacetNodes(m->type), *el = nodes ? nodes : HycoElementGetFacet(m->type);
  struct _n_HycoFE drawn = {.scene = scene, .mesh = m, .X = m->xyz, .formulation = scene->formulation};

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(scene->n_bodies, &drawn.mirrored));
  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
    PetscReal *n = normal + 3 * k;
    PetscBool axis = PETSC_TRUE;

    for (PetscInt a = 0; a < m->nf; a++)
      axis = (PetscBool)(axis && HycoNodeIsOnAxis(&drawn, m->facets[k / m->nf * m->nf + a]));
    n[0] = n[1] = n[2] = 0;
    if (!axis) PetscCall(HycoFacetDirection(&drawn, el, k / m->nf, nodes ? k % m->nf : 0, n));
    HycoNormalise(n);
  }
  PetscCall(PetscFree(drawn.mirrored));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the facet of place k comes before that of place j: by the tags of its nodes, which every part of a mesh
   has. */
static PetscErrorCode SidesPrecedes(HycoMesh m, PetscInt k, PetscInt j, PetscBool *before)
{
  PetscInt tag[2][HYCO_FACET_NODES], a = 0;

  PetscFunctionBegin;
  for (PetscInt t = 0; t < 2; t++) {
    for (a = 0; a < m->nf; a++) tag[t][a] = m->node_id[m->facets[(t ? j : k) / m->nf * m->nf + a]];
    PetscCall(PetscSortInt(m->nf, tag[t]));
  }
  for (a = 0; a + 1 < m->nf && tag[0][a] == tag[1][a];) a++;
  *before = (PetscBool)(tag[0][a] < tag[1][a]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives all facets that a chain of small angles joins to the k-th one its side, and finds the first of them. */
static PetscErrorCode FollowChain(Star *s, PetscInt k, PetscInt side, PetscInt *first)
{
  PetscFunctionBegin;
  s->side[s->place[k]] = side;
  for (PetscInt i = 0; i < s->n; i++) {
    const PetscInt other = s->place[i];
    PetscBool before;

    if (s->side[other] != HYCO_ONE_SIDE || HycoDot(s->normal + 3 * s->place[k], s->normal + 3 * other) < EDGE_COSINE)
      continue;
    PetscCall(SidesPrecedes(s->m, other, *first, &before));
    if (before) *first = other;
    PetscCall(FollowChain(s, i, side, first));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers the sides at a node. A node with one side, or with more than there are directions, is not divided. */
static PetscErrorCode DivideNode(Star *s)
{
  PetscInt n = 0, first[HYCO_SIDES + 1], number[HYCO_SIDES] = {0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    const PetscReal *normal = s->normal + 3 * s->place[k];

    s->side[s->place[k]] = HycoDot(normal, normal) > 0 ? HYCO_ONE_SIDE : HYCO_NO_SIDE;
  }
  for (PetscInt k = 0; k < s->n && n <= s->m->dim; k++) {
    if (s->side[s->place[k]] != HYCO_ONE_SIDE) continue;
    first[n] = s->place[k];
    PetscCall(FollowChain(s, k, n, &first[n]));
    n++;
  }
  for (PetscInt t = 0; t < n * n && n <= s->m->dim; t++) {
    PetscBool before = PETSC_FALSE;

    if (t / n != t % n) PetscCall(SidesPrecedes(s->m, first[t % n], first[t / n], &before));
    number[t / n] += before;
  }
  for (PetscInt k = 0; k < s->n; k++) {
    PetscInt *side = &s->side[s->place[k]];

    if (*side >= 0) *side = n > 1 && n <= s->m->dim ? number[*side] : HYCO_ONE_SIDE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet's place at a node of a group. */
typedef struct {
  PetscInt group, node, place;
} Corner;

static int CompareCorners(const void *a, const void *b)
{
  const Corner *p = (const Corner *)a, *q = (const Corner *)b;

  if (p->group != q->group) return p->group < q->group ? -1 : 1;
  if (p->node != q->node) return p->node < q->node ? -1 : 1;
  return (p->place > q->place) - (p->place < q->place);
}

/* The ranks at the nodes of each group. */
static PetscErrorCode RankFacets(Star *s, const Corner corner[])
{
  HycoMesh m = s->m;
  const PetscInt n = m->n_facets * m->nf;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    const Corner *of = &corner[k];

    for (PetscInt way = -1; way <= 1; way += 2) {
      for (PetscInt j = k + way; j >= 0 && j < n && corner[j].group == of->group && corner[j].node == of->node;
           j += way) {
        PetscBool before;

        PetscCall(SidesPrecedes(m, corner[j].place, of->place, &before));
        s->rank[of->place] += before;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Node by node of each group. */
static PetscErrorCode FindSides(Star *s, Corner corner[])
{
  HycoMesh m = s->m;
  const PetscInt n = m->n_facets * m->nf;
  PetscInt *place = s->place;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) corner[k] = (Corner){m->facet_group[k / m->nf], m->facets[k], k};
  if (n) qsort(corner, (size_t)n, sizeof(*corner), CompareCorners);
  for (PetscInt k = 0, next; k < n; k = next) {
    s->place = place + k;
    for (next = k; next < n && corner[next].group == corner[k].group && corner[next].node == corner[k].node; next++)
      place[next] = corner[next].place;
    s->n = next - k;
    PetscCall(DivideNode(s));
  }
  s->place = place;
  PetscCall(RankFacets(s, corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Made when they are first needed, of all groups: they belong to the mesh, whose drawing does not change. */
PetscErrorCode HycoSurfaceSides(HycoScene scene, HycoMesh m)
{
  const PetscInt n = m->n_facets * m->nf;
  Star s = {.m = m};
  PetscReal *normal;
  Corner *corner;

  PetscFunctionBegin;
  if (m->facet_side || m->dim == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(n, &s.place, 3 * n, &normal, n, &corner));
  PetscCall(PetscMalloc1(n + 1, &s.side));
  PetscCall(PetscCalloc1(n + 1, &s.rank));
  PetscCall(FindNormals(scene, m, normal));
  s.normal = normal;
  PetscCall(FindSides(&s, corner));
  m->facet_side = s.side;
  m->facet_rank = s.rank;
  PetscCall(PetscFree3(s.place, normal, corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ends of facets, by node, and the node at the other end. */
static int CompareEnds(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a, *q = (const PetscInt *)b;

  if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
  return (p[1] > q[1]) - (p[1] < q[1]);
}

/* Whether every edge (2D: end) of a group's facets at the nodes of this rank joins two of them. */
static PetscErrorCode IsClosed(HycoMesh m, PetscInt group, PetscBool *closed)
{
  const PetscInt corners = HycoCellKinds[m->type].corners;
  PetscInt *end, n = 0;

  PetscFunctionBegin;
  *closed = PETSC_TRUE;
  PetscCall(PetscMalloc1(4 * m->n_facets * corners + 1, &end));
  for (PetscInt k = 0; k < m->n_facets * corners; k++) {
    const PetscInt *node = m->facets + k / corners * m->nf, a = node[k % corners], b = node[(k + 1) % corners];

    /* A collapsed quadrilateral has an edge of one node. */
    if (m->facet_group[k / corners] != group || a == b) continue;
    for (PetscInt e = 0; e < (m->dim > 2 ? 2 : 1); e++) {
      if (HycoMeshOwned(m, e ? b : a) < 0) continue;
      end[2 * n] = e ? b : a;
      end[2 * n++ + 1] = m->dim < 3 ? 0 : e ? a : b;
    }
  }
  if (n) qsort(end, (size_t)n, 2 * sizeof(*end), CompareEnds);
  for (PetscInt k = 0, next; k < n; k = next) {
    for (next = k + 1; next < n && !CompareEnds(end + 2 * k, end + 2 * next);) next++;
    if (next < k + 2) *closed = PETSC_FALSE;
  }
  PetscCall(PetscFree(end));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At nodes of this rank, all of whose facets are here. */
PetscErrorCode HycoContactEdges(HycoScene scene, HycoMesh m, HycoContact c, PetscInt *edges)
{
  PetscBool closed;

  PetscFunctionBegin;
  *edges = 0;
  PetscCall(HycoSurfaceSides(scene, m));
  for (PetscInt of = 0; of < (c->master ? 2 : 1) && m->facet_side; of++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", of ? c->master : c->slave, &g));
    for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
      if (m->facet_group[k / m->nf] == g && m->facet_side[k] >= 0 && HycoMeshOwned(m, m->facets[k]) >= 0)
        *edges |= of ? HYCO_MASTER_EDGE : HYCO_SLAVE_EDGE;
    }
    if (of || m->dim == 1) continue;
    PetscCall(IsClosed(m, g, &closed));
    if (closed || *edges) *edges |= HYCO_SLAVE_ROUND;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On a part of the surfaces as all ranks have found them. */
PetscErrorCode HycoPairsEdges(HycoFE fe, const HycoPairs *p, PetscInt index, PetscInt *edges)
{
  PetscFunctionBegin;
  if (p->search)
    *edges = p->search[index].edges;
  else if (p->facts)
    *edges = p->facts[index].edges;
  else
    PetscCall(HycoContactEdges(fe->scene, fe->mesh, fe->scene->contact[index], edges));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HYCO_SIDES * node + side of the nodes of a group with several sides, ascending; the caller frees them. */
PetscErrorCode HycoSurfaceSlots(HycoFE fe, PetscInt group, PetscInt *n, PetscInt **slot)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  *n = 0;
  *slot = NULL;
  PetscCall(HycoSurfaceSides(fe->scene, m));
  for (PetscInt pass = 0; pass < 2 && m->facet_side; pass++) {
    if (pass && !*n) break;
    if (pass) PetscCall(PetscMalloc1(*n, slot));
    *n = 0;
    for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
      if (m->facet_group[k / m->nf] != group || m->facet_side[k] < 0) continue;
      if (pass) (*slot)[*n] = HYCO_SIDES * m->facets[k] + m->facet_side[k];
      (*n)++;
    }
  }
  PetscCall(HycoSortUnique(n, *slot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts at a node, chained: which of them a facet's part belongs to. */
typedef struct {
  HycoFE fe;
  PetscInt n, *head, *next; /* by node, by contact */
  const PetscInt *side;
  PetscReal *vector, *share, *own; /* own: n x 3, the sum without ties */
} Sums;

/* Adds the part N n dS of a facet's node to a contact, times a tie's weight. */
static void AddPart(Sums *s, PetscInt k, PetscInt node, PetscReal N, const PetscReal n[3], PetscReal weight)
{
  if (s->vector) HycoAddFacetVector(s->fe, node, PetscAbsReal(weight) * N, n, s->vector + 3 * k);
  if (s->share && !HycoNodeHasNoArea(s->fe, node)) s->share[k] += weight * N * HycoLength(n);
}

/* The facets at a tied node belong to the side of its master that they continue. */
static void AddTied(Sums *s, PetscInt tied, PetscReal N, const PetscReal n[3])
{
  HycoMesh m = s->fe->mesh;
  const PetscReal *weight = m->ties->weight + m->tied_entry[tied];

  for (PetscInt j = m->tied_start[tied]; j < m->tied_start[tied + 1]; j++) {
    const PetscInt master = m->tied_master[j];
    PetscInt best = -1;

    for (PetscInt k = s->head[master]; k >= 0; k = s->next[k]) {
      if (best < 0 || HycoDot(s->own + 3 * k, n) * HycoLength(s->own + 3 * best) >
                          HycoDot(s->own + 3 * best, n) * HycoLength(s->own + 3 * k))
        best = k;
    }
    if (best >= 0) AddPart(s, best, master, N, n, weight[j - m->tied_start[tied]]);
  }
}

/* The parts of all facets of the group: at nodes of contacts, or (tied) at tied nodes. */
static PetscErrorCode AddFacets(Sums *s, PetscInt group, PetscBool tied)
{
  HycoMesh m = s->fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    for (PetscInt q = 0; m->facet_group[f] == group && q < el->nq; q++) {
      PetscReal n[3];

      PetscCall(HycoFacetNormal(s->fe, el, f, q, n));
      for (PetscInt a = 0; a < m->nf; a++) {
        const PetscInt node = m->facets[f * m->nf + a], at = HycoMeshTied(m, node);

        if (tied && at >= 0) AddTied(s, at, el->N[q][a], n);
        for (PetscInt k = tied ? -1 : s->head[node]; k >= 0; k = s->next[k]) {
          if (HycoSideCounts(s->side[k], m->facet_side[f * m->nf + a], m->facet_rank[f * m->nf + a]))
            AddPart(s, k, node, el->N[q][a], n, 1);
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The integrals of N n dS (vector, n x 3) and of N dS (share) over the sides of the contacts that have one; other
   entries stay. Either may be NULL. */
PetscErrorCode HycoSideSums(HycoFE fe, PetscInt group, PetscInt n, const PetscInt node[], const PetscInt side[],
                            PetscReal vector[], PetscReal share[])
{
  HycoMesh m = fe->mesh;
  Sums s = {.fe = fe, .n = n, .side = side, .vector = vector, .share = share};
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) any = (PetscBool)(any || side[k] >= 0);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSurfaceSides(fe->scene, m));
  PetscCall(PetscMalloc3(fe->mesh->n_nodes, &s.head, n, &s.next, 3 * n, &s.own));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) s.head[i] = -1;
  for (PetscInt k = 0; k < n; k++) {
    if (side[k] < 0) continue;
    s.next[k] = s.head[node[k]];
    s.head[node[k]] = k;
    for (PetscInt c = 0; c < 3 && vector; c++) vector[3 * k + c] = 0;
    if (share) share[k] = 0;
  }
  PetscCall(AddFacets(&s, group, PETSC_FALSE));
  if (fe->mesh->n_tied) {
    /* Directions, for a choice that does not depend on what ties have added so far. */
    Sums own = s;

    own.vector = s.own;
    own.share = NULL;
    PetscCall(PetscArrayzero(s.own, 3 * n));
    PetscCall(AddFacets(&own, group, PETSC_FALSE));
    PetscCall(AddFacets(&s, group, PETSC_TRUE));
  }
  PetscCall(PetscFree3(s.head, s.next, s.own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unit normals of the sides of slots (n x 3), and their areas (NULL: not needed). */
PetscErrorCode HycoSlotNormals(HycoFE fe, PetscInt group, PetscInt n, const PetscInt slot[], PetscReal normal[],
                               PetscReal share[])
{
  PetscInt *node, *side;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &node, n, &side));
  for (PetscInt j = 0; j < n; j++) {
    node[j] = slot[j] / HYCO_SIDES;
    side[j] = slot[j] % HYCO_SIDES;
  }
  PetscCall(HycoSideSums(fe, group, n, node, side, normal, share));
  for (PetscInt j = 0; j < n; j++) HycoNormalise(normal + 3 * j);
  PetscCall(PetscFree2(node, side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first slot of a node, and their number. */
void HycoSlotsOf(PetscInt n, const PetscInt slot[], PetscInt node, PetscInt *first, PetscInt *count)
{
  PetscInt lo = 0, hi = n;

  while (lo < hi) {
    const PetscInt mid = (lo + hi) / 2;

    if (slot[mid] < HYCO_SIDES * node)
      lo = mid + 1;
    else
      hi = mid;
  }
  *first = lo;
  for (*count = 0; lo + *count < n && slot[lo + *count] / HYCO_SIDES == node;) (*count)++;
}

/* Nodes of smooth surfaces have one normal, the others that of each side. */
PetscErrorCode HycoSidesFacing(HycoFE fe, PetscInt group, PetscInt n, const PetscInt node[], const PetscReal normal[],
                               PetscReal cosine[], PetscReal area[])
{
  PetscReal *vector, *of, *share;
  PetscInt n_slots, *slot;

  PetscFunctionBegin;
  PetscCall(HycoSurfaceSlots(fe, group, &n_slots, &slot));
  PetscCall(PetscMalloc3(3 * fe->mesh->n_nodes, &vector, 3 * n_slots, &of, n_slots, &share));
  if (cosine) PetscCall(HycoSurfaceNormals(fe, group, vector));
  PetscCall(HycoSlotNormals(fe, group, n_slots, slot, of, share));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *out = vector + 3 * node[k];
    PetscReal best = -1, sum = 0;
    PetscInt first, count;

    HycoSlotsOf(n_slots, slot, node[k], &first, &count);
    for (PetscInt j = first; j < first + count; j++) {
      const PetscReal along = HycoDot(of + 3 * j, normal + 3 * k);

      best = PetscMax(best, along);
      sum += along >= -HYCO_OPPOSED ? share[j] : 0;
    }
    if (cosine && !count) best = HycoDot(out, out) > 0 ? HycoDot(out, normal + 3 * k) : 2;
    if (cosine) cosine[k] = best;
    if (area && sum > 0) area[k] = sum;
  }
  PetscCall(PetscFree3(vector, of, share));
  PetscCall(PetscFree(slot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The normals that the scene gives at nodes; *fixed: it does, and they do not depend on the parameters. */
static PetscErrorCode GivenNormals(HycoFE fe, HycoContact c, PetscInt n, const PetscInt node[], PetscReal normal[],
                                   PetscBool *fixed)
{
  PetscBool all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *fixed = (PetscBool)(!c->ops->normal && !HycoContactAverages(c));
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) all[p] = PETSC_TRUE;
  for (PetscInt d = 0; d < 3; d++) *fixed = (PetscBool)(*fixed && !HycoExprChanges(c->normal[d], all));
  for (PetscInt k = 0; k < 3 * n && *fixed; k++) {
    normal[k] = 0;
    if (c->normal[k % 3] && k % 3 < fe->dim)
      PetscCall(HycoExprEval(c->normal[k % 3], fe->mu, 1, fe->X + 3 * node[k / 3], &normal[k]));
  }
  for (PetscInt k = 0; k < n && *fixed; k++) HycoNormalise(normal + 3 * k);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the nodes of which no side leaves along the normal that the scene gives. */
static PetscErrorCode FindTurned(HycoFE fe, HycoContact c, PetscInt group, PetscInt n, const PetscInt node[],
                                 PetscBool turned[])
{
  PetscReal *normal, *cosine;
  PetscBool fixed;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * n, &normal, n, &cosine));
  PetscCall(GivenNormals(fe, c, n, node, normal, &fixed));
  if (fixed) PetscCall(HycoSidesFacing(fe, group, n, node, normal, cosine, NULL));
  for (PetscInt k = 0; k < n; k++) turned[k] = (PetscBool)(fixed && cosine[k] < -HYCO_OPPOSED);
  PetscCall(PetscFree2(normal, cosine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactSlaves(HycoFE fe, const HycoPairs *pairs, PetscInt index, PetscInt *n, PetscInt **slave,
                                 PetscInt **side)
{
  HycoMesh m = fe->mesh;
  HycoContact c = fe->scene->contact[index];
  PetscInt g = 0, n_nodes, edges, n_slots, *slot;
  PetscBool *carries, *turned;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
  n_nodes = m->group_start[g + 1] - m->group_start[g];
  PetscCall(HycoPairsEdges(fe, pairs, index, &edges));
  PetscCall(HycoSurfaceSlots(fe, g, &n_slots, &slot));
  PetscCall(PetscMalloc1(n_nodes + n_slots + 1, slave));
  PetscCall(PetscMalloc1(n_nodes + n_slots + 1, side));
  PetscCall(PetscMalloc1(m->n_nodes, &carries));
  PetscCall(PetscCalloc1(n_nodes, &turned));
  HycoSurfaceCarriers(m, g, carries);
  if (edges & HYCO_SLAVE_ROUND) PetscCall(FindTurned(fe, c, g, n_nodes, m->group_node + m->group_start[g], turned));
  *n = 0;
  for (PetscInt k = 0; k < n_nodes; k++) {
    const PetscInt i = m->group_node[m->group_start[g] + k];
    PetscInt first, sides;

    if (!carries[i] || turned[k]) continue;
    HycoSlotsOf(n_slots, slot, i, &first, &sides);
    if (!HycoContactAverages(c)) sides = 0;
    for (PetscInt j = 0; j < PetscMax(sides, 1); j++) {
      (*slave)[*n] = i;
      (*side)[(*n)++] = sides ? slot[first + j] % HYCO_SIDES : HYCO_ONE_SIDE;
    }
  }
  HycoFreeAll(&carries, &turned, &slot);
  PetscFunctionReturn(PETSC_SUCCESS);
}
