/*
  Projection of points on a surface: its patches are in a tree of bounding boxes that is split at the median, so that n
  points find their nearest patch in about n log n steps, whatever the sizes of the patches.
*/
#include "nearest.h"
#include "curved.h"
#include <hycovector.h>

/* -- begin: in exported models too -- */
#define SNAP_WEIGHT 1e-12 /* of 1, a weight of a master: 4500 eps, a projection onto an edge or a node */

/* Whether p comes before q along an axis. Equal coordinates are ordered by index: the tree is the same on any number
   of ranks. */
static PetscBool NearestPrecedes(const HycoPoint *p, const HycoPoint *q, PetscInt axis)
{
  return (PetscBool)(p->x[axis] < q->x[axis] || (p->x[axis] == q->x[axis] && p->index < q->index));
}

/* The median of the first, the middle and the last point: with it, sorted points are halved. */
static HycoPoint NearestPivot(const HycoPoint *first, const HycoPoint *middle, const HycoPoint *last, PetscInt axis)
{
  const HycoPoint *lo = NearestPrecedes(first, last, axis) ? first : last, *hi = lo == first ? last : first;

  return NearestPrecedes(middle, lo, axis) ? *lo : NearestPrecedes(middle, hi, axis) ? *middle : *hi;
}

/* Reorders point[lo .. hi) such that those before mid are the smallest along the axis: selection without a complete
   sort, n steps on average. */
void HycoPointsSplit(HycoPoint point[], PetscInt lo, PetscInt mid, PetscInt hi, PetscInt axis)
{
  while (hi - lo > 1 && lo < mid && mid < hi) { /* Hoare's selection */
    /* The median of three: sorted input, as nodes of a structured mesh, must not be the worst case. */
    const HycoPoint pivot = NearestPivot(&point[lo], &point[lo + (hi - lo) / 2], &point[hi - 1], axis);
    PetscInt i = lo, j = hi - 1;

    while (i <= j) {
      while (NearestPrecedes(&point[i], &pivot, axis)) i++;
      while (NearestPrecedes(&pivot, &point[j], axis)) j--;
      if (i <= j) {
        const HycoPoint kept = point[i];

        point[i++] = point[j];
        point[j--] = kept;
      }
    }
    if (mid <= j)
      hi = j + 1;
    else if (mid >= i)
      lo = i;
    else
      return;
  }
}

#ifndef HYCO_EXPORTED
/* Borrows the coordinates; the corners come first among the nodes, then the middles of sides. */
static HycoCurved NearestCurved(HycoPatches s, PetscInt patch)
{
  HycoCurved facet = {.nf = s->nf, .corners = s->corners};

  for (PetscInt a = 0; a < s->nf; a++) facet.X[a] = s->X + 3 * s->node[patch * s->nf + a];
  return facet;
}

#endif
/* A box that contains a patch. Of first order the nodes bound the patch, also a bilinear one. */
static void NearestEnclose(HycoPatches s, PetscInt patch, HycoBox *b)
{
  const PetscInt *node = s->node + patch * s->nf;

#ifndef HYCO_EXPORTED
  /* A curved facet bulges beyond its nodes. */
  if (s->corners < s->nf) {
    const HycoCurved facet = NearestCurved(s, patch);

    HycoCurvedBox(&facet, b->lo, b->hi);
    return;
  }
#endif
  for (PetscInt c = 0; c < 3; c++) {
    b->lo[c] = b->hi[c] = s->X[3 * node[0] + c];
    for (PetscInt a = 1; a < s->nf; a++) {
      b->lo[c] = PetscMin(b->lo[c], s->X[3 * node[a] + c]);
      b->hi[c] = PetscMax(b->hi[c], s->X[3 * node[a] + c]);
    }
  }
}

/* The box of the vectors v of the points item[0 .. n). Empty for n = 0: the largest numbers as the lower end. */
static HycoBox VectorBox(PetscInt n, const HycoPoint item[], const PetscReal v[])
{
  HycoBox b;

  for (PetscInt c = 0; c < 3; c++) {
    b.lo[c] = PETSC_MAX_REAL;
    b.hi[c] = PETSC_MIN_REAL;
    for (PetscInt k = 0; k < n; k++) {
      b.lo[c] = PetscMin(b.lo[c], v[3 * item[k].index + c]);
      b.hi[c] = PetscMax(b.hi[c], v[3 * item[k].index + c]);
    }
  }
  return b;
}

/* Builds box t of the items lo .. hi - 1, split at the median of the centres along its longest side. */
static void NearestBuild(HycoPatches s, PetscInt t, PetscInt lo, PetscInt hi)
{
  HycoBox *b = &s->box[t];
  PetscInt axis = 0;

  for (PetscInt c = 0; c < 3; c++) {
    b->lo[c] = PETSC_MAX_REAL;
    b->hi[c] = PETSC_MIN_REAL;
  }
  for (PetscInt k = lo; k < hi; k++) {
    HycoBox one;

    NearestEnclose(s, s->item[k].index, &one);
    for (PetscInt c = 0; c < 3; c++) {
      b->lo[c] = PetscMin(b->lo[c], one.lo[c]);
      b->hi[c] = PetscMax(b->hi[c], one.hi[c]);
    }
  }
  /* The longest side, so that boxes become cubes and few of them meet a query. */
  for (PetscInt c = 1; c < 3; c++) axis = b->hi[c] - b->lo[c] > b->hi[axis] - b->lo[axis] ? c : axis;
  /* A box of normals: whole branches that face away are skipped. */
  if (s->turn) s->turn[t] = VectorBox(hi - lo, s->item + lo, s->normal);
  if (hi - lo <= HYCO_LEAF) return;
  HycoPointsSplit(s->item, lo, (lo + hi) / 2, hi, axis);
  NearestBuild(s, 2 * t + 1, lo, (lo + hi) / 2);
  NearestBuild(s, 2 * t + 2, (lo + hi) / 2, hi);
}

/* A complete binary tree in an array, of the depth of the larger half at each split: no pointers, and children by
   2 t + 1. */
PetscInt HycoPatchesBoxes(PetscInt n)
{
  PetscInt boxes = 1;

  for (PetscInt most = n; most > HYCO_LEAF; most = (most + 1) / 2) boxes = 2 * boxes + 1;
  return boxes;
}

/* From the centres of the patches on. */
void HycoPatchesBuild(HycoPatches s)
{
  for (PetscInt k = 0; k < s->n; k++) {
    s->item[k].index = k;
    for (PetscInt c = 0; c < 3; c++) {
      s->item[k].x[c] = 0;
      for (PetscInt a = 0; a < s->nf; a++) s->item[k].x[c] += s->X[3 * s->node[k * s->nf + a] + c] / s->nf;
    }
  }
  NearestBuild(s, 0, 0, s->n);
}
/* -- end: in exported models too -- */

/* nf nodes and `corners` corners per patch (corners < nf: second order); normal: n x 3 or NULL. Borrows X, node and
   normal, which must stay in place. */
PetscErrorCode HycoPatchesCreate(const PetscReal X[], PetscInt n, PetscInt nf, PetscInt corners, const PetscInt node[],
                                 const PetscReal normal[], HycoPatches *patches)
{
  const PetscInt boxes = HycoPatchesBoxes(n);
  HycoPatches s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  s->X = X;
  s->normal = normal;
  s->n = n;
  s->nf = nf;
  s->corners = corners;
  s->node = node;
  PetscCall(PetscMalloc1(n, &s->item));
  PetscCall(PetscMalloc1(boxes, &s->box));
  /* Boxes of normals serve the search along lines between nodes. */
  if (nf == 1 && normal) PetscCall(PetscMalloc1(boxes, &s->turn));
  HycoPatchesBuild(s);
  *patches = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coordinates, nodes and normals are borrowed and stay. */
PetscErrorCode HycoPatchesDestroy(HycoPatches *patches)
{
  PetscFunctionBegin;
  if (!*patches) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*patches)->item, &(*patches)->box, &(*patches)->turn, patches);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- begin: in exported models too -- */
/* Squared distance from x to the combination w of n points. */
static PetscReal NearestDistance2(PetscInt n, const PetscReal *const X[], const PetscReal w[], const PetscReal x[3])
{
  PetscReal sum = 0;

  for (PetscInt c = 0; c < 3; c++) {
    PetscReal r = -x[c];

    for (PetscInt a = 0; a < n; a++) r += w[a] * X[a][c];
    sum += r * r;
  }
  return sum;
}

/* The orthogonal projection onto a triangle's plane; whether it is inside the triangle. */
static PetscBool InTriangle(const PetscReal *const X[], const PetscReal x[3], PetscReal w[4])
{
  PetscReal a[3], b[3], r[3], aa, ab, bb, det;

  for (PetscInt c = 0; c < 3; c++) {
    a[c] = X[1][c] - X[0][c];
    b[c] = X[2][c] - X[0][c];
    r[c] = x[c] - X[0][c];
  }
  aa = HycoDot(a, a);
  ab = HycoDot(a, b);
  bb = HycoDot(b, b);
  /* Relative to the edges: a degenerate triangle is left to its edges. */
  det = aa * bb - ab * ab;
  if (!(det > 1e-28 * aa * bb)) return PETSC_FALSE;
  w[1] = (bb * HycoDot(a, r) - ab * HycoDot(b, r)) / det;
  w[2] = (aa * HycoDot(b, r) - ab * HycoDot(a, r)) / det;
  w[0] = 1 - w[1] - w[2];
  return (PetscBool)(w[0] >= 0 && w[1] >= 0 && w[2] >= 0);
}

/* The point of a bilinear patch where its tangents are orthogonal to x - point, by Newton's method from its centre;
   whether it is inside. Where the distance is not convex, a Gauss-Newton step is used. */
static PetscBool InQuadrilateral(const PetscReal *const X[], const PetscReal x[3], PetscReal w[4])
{
  PetscReal at[2] = {0, 0}, t[2][3], r[3], twist[3];

  for (PetscInt it = 0; it < 50; it++) {
    const PetscReal m0 = 1 - at[0], p0 = 1 + at[0], m1 = 1 - at[1], p1 = 1 + at[1];
    PetscReal a, b, d, g[2], step[2], det, size;

    for (PetscInt c = 0; c < 3; c++) {
      t[0][c] = (m1 * (X[1][c] - X[0][c]) + p1 * (X[2][c] - X[3][c])) / 4;
      t[1][c] = (m0 * (X[3][c] - X[0][c]) + p0 * (X[2][c] - X[1][c])) / 4;
      r[c] = (m0 * m1 * X[0][c] + p0 * m1 * X[1][c] + p0 * p1 * X[2][c] + m0 * p1 * X[3][c]) / 4 - x[c];
      twist[c] = (X[0][c] - X[1][c] + X[2][c] - X[3][c]) / 4;
    }
    a = HycoDot(t[0], t[0]);
    b = HycoDot(t[0], t[1]) + HycoDot(r, twist);
    d = HycoDot(t[1], t[1]);
    /* The twist term makes the Hessian indefinite far from the patch. */
    if (!(a * d - b * b > 1e-3 * a * d)) b = HycoDot(t[0], t[1]);
    det = a * d - b * b;
    if (!(det > 1e-28 * a * d)) return PETSC_FALSE;
    g[0] = HycoDot(t[0], r);
    g[1] = HycoDot(t[1], r);
    step[0] = (b * g[1] - d * g[0]) / det;
    step[1] = (b * g[0] - a * g[1]) / det;
    size = PetscMax(PetscAbsReal(step[0]), PetscAbsReal(step[1]));
    for (PetscInt k = 0; k < 2; k++) at[k] += step[k] / PetscMax(size, 1);
    if (size < 1e-14) break;
    if (PetscMax(PetscAbsReal(at[0]), PetscAbsReal(at[1])) > 10) return PETSC_FALSE;
  }
  if (PetscMax(PetscAbsReal(at[0]), PetscAbsReal(at[1])) > 1) return PETSC_FALSE;
  w[0] = (1 - at[0]) * (1 - at[1]) / 4;
  w[1] = (1 + at[0]) * (1 - at[1]) / 4;
  w[2] = (1 + at[0]) * (1 + at[1]) / 4;
  w[3] = (1 - at[0]) * (1 + at[1]) / 4;
  return PETSC_TRUE;
}

/* The nearest point of one patch: inside it, or on one of its edges. Returns the squared distance. */
static PetscReal OnPatch(HycoPatches s, PetscInt patch, const PetscReal x[3], PetscReal w[])
{
  const PetscInt nf = HycoFacetCorners(s->nf, s->node + patch * s->nf), edges = nf == 2 ? 1 : nf;
  const PetscReal *X[4];
  PetscReal best = PETSC_MAX_REAL;

#ifndef HYCO_EXPORTED
  if (s->corners < s->nf) {
    const HycoCurved facet = NearestCurved(s, patch);

    return HycoCurvedProject(&facet, x, w);
  }
#endif
  /* Edges are always tried: for a warped quadrilateral the inner stationary point need not be the nearest. */
  for (PetscInt a = 0; a < nf; a++) X[a] = s->X + 3 * s->node[patch * s->nf + a];
  if ((nf == 3 && InTriangle(X, x, w)) || (nf == 4 && InQuadrilateral(X, x, w))) best = NearestDistance2(nf, X, w, x);
  for (PetscInt k = 0; k < edges; k++) {
    const PetscInt l = (k + 1) % nf;
    PetscReal e[3], r[3], along[4] = {0, 0, 0, 0}, length, at, d;

    for (PetscInt c = 0; c < 3; c++) {
      e[c] = X[l][c] - X[k][c];
      r[c] = x[c] - X[k][c];
    }
    length = HycoDot(e, e);
    at = length > 0 ? PetscMin(PetscMax(HycoDot(e, r) / length, 0), 1) : 0;
    along[l] = at;
    along[k] = nf > 1 ? 1 - at : 1;
    d = NearestDistance2(nf, X, along, x);
    if (d >= best) continue;
    best = d;
    for (PetscInt a = 0; a < nf; a++) w[a] = along[a];
  }
  return best;
}

/* A lower bound for all patches in the box, 0 inside it: what is larger than the best so far is not searched. */
static PetscReal BoxDistance2(const HycoBox *b, const PetscReal x[3])
{
  PetscReal sum = 0;

  for (PetscInt c = 0; c < 3; c++) {
    const PetscReal out = PetscMax(PetscMax(b->lo[c] - x[c], x[c] - b->hi[c]), 0);

    sum += out * out;
  }
  return sum;
}

/* Whether a patch opposes the given normal; a patch without a normal always does. */
static PetscBool NearestIsOpposed(HycoPatches s, PetscInt patch, const PetscReal *against)
{
  const PetscReal *n = s->normal ? s->normal + 3 * patch : NULL;

  return (PetscBool)(!against || !n || HycoDot(n, n) == 0 || HycoDot(n, against) <= HYCO_OPPOSED);
}

/* A query, and the nearest point so far: its squared distance, patch and weights. */
typedef struct {
  const PetscReal *x, *against;
  PetscReal round_off, limit; /* limit: of a squared distance that is not larger, whatever the round-off */
  PetscReal best, w[HYCO_FACET_NODES];
  PetscInt patch;
} Query;

/* The limit is a little larger than the best: a patch at the same distance but for round-off must still be visited,
   so that ties go to the smaller number on any tree. */
static void SetBest(Query *q, PetscReal best, PetscInt patch, const PetscReal w[])
{
  const PetscReal limit = PetscSqrtReal(best) + q->round_off;

  q->best = best;
  q->limit = limit * limit;
  q->patch = patch;
  for (PetscInt a = 0; a < HYCO_FACET_NODES; a++) q->w[a] = w[a];
}

/* Updates the query with the nearest of the items lo .. hi - 1 under box t; the nearer child is searched first. Branch
   and bound: a box farther than the best so far is not entered. */
static void NearestSearch(HycoPatches s, PetscInt t, PetscInt lo, PetscInt hi, Query *q)
{
  const PetscInt mid = (lo + hi) / 2;
  PetscBool right;

  if (BoxDistance2(&s->box[t], q->x) > q->limit) return;
  if (hi - lo > HYCO_LEAF) {
    right = (PetscBool)(BoxDistance2(&s->box[2 * t + 2], q->x) < BoxDistance2(&s->box[2 * t + 1], q->x));
    for (PetscInt child = 0; child < 2; child++, right = (PetscBool)!right)
      NearestSearch(s, 2 * t + 1 + right, right ? mid : lo, right ? hi : mid, q);
    return;
  }
  for (PetscInt k = lo; k < hi; k++) {
    PetscReal trial[HYCO_FACET_NODES] = {0}, d;

    if (!NearestIsOpposed(s, s->item[k].index, q->against)) continue;
    d = OnPatch(s, s->item[k].index, q->x, trial);
    /* Equal distances go to the smaller patch number, whatever the order of the search. */
    if (d < q->best || (d == q->best && s->item[k].index < q->patch)) SetBest(q, d, s->item[k].index, trial);
  }
}

/* The round-off of a distance is relative to the coordinates, not to the distance itself. */
static PetscReal LargestCoordinate(const PetscReal lo[3], const PetscReal hi[3])
{
  PetscReal most = 0;

  for (PetscInt c = 0; c < 3; c++) most = PetscMax(most, PetscMax(PetscAbsReal(lo[c]), PetscAbsReal(hi[c])));
  return most;
}

/* The nearest point of all patches that oppose `against` (NULL: of all), with the nodes in ascending order and
   weights that add up to 1; weights within round-off of 0 are dropped. */
void HycoPatchesProject(HycoPatches s, const PetscReal x[3], const PetscReal against[3], HycoProjection *p)
{
  const PetscReal none[HYCO_FACET_NODES] = {0}, *w;
  Query q = {.x = x, .against = against};
  PetscReal sum = 0;
  PetscInt patch;

  q.round_off = HYCO_POSITION_ROUND_OFF * (LargestCoordinate(s->box[0].lo, s->box[0].hi) + LargestCoordinate(x, x));
  SetBest(&q, PETSC_MAX_REAL, 0, none);
  NearestSearch(s, 0, 0, s->n, &q);
  patch = q.patch;
  w = q.w;
  p->patch = patch;
  p->distance = PetscSqrtReal(q.best);
  p->n = 0;
  for (PetscInt a = 0; a < s->nf; a++) {
    PetscInt at = p->n;

    /* A projection onto an edge or a node must have only its nodes as masters: HycoMasterSearchAtBorder() reads the
       number. */
    if (PetscAbsReal(w[a]) < SNAP_WEIGHT) continue;
    for (; at > 0 && p->node[at - 1] > s->node[patch * s->nf + a]; at--) {
      p->node[at] = p->node[at - 1];
      p->weight[at] = p->weight[at - 1];
    }
    p->node[at] = s->node[patch * s->nf + a];
    p->weight[at] = w[a];
    p->n++;
    sum += w[a];
  }
  for (PetscInt a = 0; a < p->n; a++) p->weight[a] /= sum;
}
/* -- end: in exported models too -- */
