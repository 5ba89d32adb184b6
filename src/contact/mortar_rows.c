/*
  The rows of a mortar contact. On the part of a slave's facet that faces the master, the dual functions psi_i are
  biorthogonal to the nodes' functions N_k: the integral of psi_i N_k is D_i if k = i, else 0, where D_i is the integral
  of N_i (A. Popp, M. Gitterle, M. Gee, W. Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428-1465). The weighted gap of
  node i over D_i is then n_i . (sum of w_ij x_j - x_i), with w_ij the integral of psi_i N_j over D_i: a row as of other
  types, with more masters, the sum of whose weights is 1. The functions of each facet add up to 1, so that a uniform
  pressure acts as its consistent nodal forces on both sides, at borders of the master too.
*/
#include "mortar.h"
#include "surface_normals.h"
#include <hycocarriers.h>
#include <hycokinematics.h>
#include <petscblaslapack.h>

#define EMPTY_PIECE 1e-12 /* of a facet's area: 4500 eps, the clipping of two polygons */
/* Of a facet's area, the part that faces: on a smaller one dual functions have a condition above 1e3, and first order
   uses its own functions (tests/contact/mortar.py). */
#define SLIVER 1e-3
/* Of a second-order facet's area, the part that faces: on a smaller one it has no functions, because its own are
   negative in parts (tests/contact/mortar.py). */
#define SLIVER_TWO 5e-2
/* Of a facet's area, the parts that face: above 1 by more than the curvature of a surface gives, it faces two layers of
   the master. */
#define TWO_LAYERS 1.05
#define SNAP       1e-14 /* of 1, a weight of a row: 45 eps of the largest */
/* Of a facet's radius, a pivot: its nodes lie nearly on one line, and do not determine a linear function to three
   digits. */
#define UNDETERMINED 1e-3

/* The integrals of a slave's facet with one facet of the master. */
typedef struct {
  PetscInt nf, node[HYCO_FACET_NODES];
  PetscReal P[HYCO_FACET_NODES][HYCO_FACET_NODES]; /* of N_i N_j, [i of the slave][j of the master] */
} Block;

typedef struct {
  PetscInt row, node;
  PetscReal value;
} Term;

typedef struct {
  HycoFE fe;
  HycoMasterSearch t;
  HycoPatches patches;
  HycoRule rule;
  PetscInt corners, edges; /* edges: as in HycoSurfaceFacts */
  PetscReal reach;
  PetscInt *row;             /* by node and slot: its place among the slaves, -1: none */
  PetscInt n_slots, *slot;   /* of the slave's nodes on edges, as in HycoMasterSearch */
  PetscReal *D;              /* by row: of all facets */
  const HycoProjection *pin; /* by node: the point that a slave without a row follows (n = 0: none); NULL: no ties */
  PetscInt *taker;           /* with pin, by node: the row that takes its forces where no node of a facet can, or -1 */
  PetscInt n_near, *near;
  /* of the current facet */
  HycoPlane plane;
  PetscReal size, facing; /* its area; of the part that faces the master */
  PetscBool front;        /* only what lies in front of it can face it: the nearest part of the master does not */
  PetscReal M[HYCO_FACET_NODES][HYCO_FACET_NODES], own[HYCO_FACET_NODES]; /* integrals of N_i N_k, of N_i */
  PetscInt n_blocks, room_blocks;
  Block *block;
  PetscInt n_terms, room_terms;
  Term *term;
} Mortar;

/* Second-order quadrilaterals have products of degree 8, triangles of degree 4; on a circle the radius is one more. The
   degree of the quadrature rule follows. */
static PetscErrorCode MortarCreate(HycoFE fe, PetscInt slaves, PetscInt masters, PetscReal reach, PetscInt n,
                                   const PetscInt slave[], const PetscInt side[], Mortar *s)
{
  HycoMesh m = fe->mesh;
  const PetscInt order = HycoMeshIsQuadratic(m) ? 2 : 1;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  s->fe = fe;
  s->reach = reach;
  s->corners = HycoCellKinds[m->type].corners;
  PetscCall(
      HycoRuleCreate(m->dim, 2 * order * (s->corners == 4 ? 2 : 1) + (fe->formulation == HYCO_AXISYMMETRIC), &s->rule));
  PetscCall(HycoMasterSearchCreateOn(fe, slaves, masters, PETSC_FALSE, &s->t));
  if (side) PetscCall(HycoSurfaceSlots(fe, slaves, &s->n_slots, &s->slot));
  PetscCall(PetscMalloc3(m->n_nodes + s->n_slots, &s->row, n, &s->D, s->t.n, &s->near));
  PetscCall(PetscArrayzero(s->D, n));
  /* -1: a node of the surface that is no slave here (fixed, or another rank's). */
  for (PetscInt i = 0; i < m->n_nodes + s->n_slots; i++) s->row[i] = -1;
  for (PetscInt k = 0; k < n; k++) {
    PetscInt at = -1;

    if (side && side[k] >= 0) PetscCall(PetscFindInt(HYCO_SIDES * slave[k] + side[k], s->n_slots, s->slot, &at));
    s->row[at < 0 ? slave[k] : m->n_nodes + at] = k;
  }
  if (s->t.n && n) PetscCall(HycoPatchesCreate(fe->X, s->t.n, m->nf, s->corners, s->t.node, s->t.normal, &s->patches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of a partly filled one; the search goes last, because the patches borrow its arrays. */
static PetscErrorCode MortarDestroy(Mortar *s)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(s->row, s->D, s->near));
  HycoFreeAll(&s->taker, &s->slot);
  PetscCall(HycoPatchesDestroy(&s->patches));
  PetscCall(HycoMasterSearchDestroy(&s->t));
  HycoFreeAll(&s->block, &s->term);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- one facet -- */

/* Adds the integrals over an interval or a triangle of a piece; vertex: its corners. M and `own` are over the facing
   part only, so that dual functions are those of that part. */
static void AddSimplex(Mortar *s, const HycoPlane *plane, const HycoSide *slave, const HycoSide *master,
                       const PetscReal *const vertex[3], PetscReal size, Block *b)
{
  for (PetscInt q = 0; q < s->rule.n; q++) {
    const PetscReal *share = s->rule.share[q];
    PetscReal at[2], N[HYCO_FACET_NODES], other[HYCO_FACET_NODES], w = size * s->rule.weight[q];

    for (PetscInt c = 0; c < 2; c++)
      at[c] = share[0] * vertex[0][c] + share[1] * vertex[1][c] + share[2] * vertex[2][c];
    HycoSideFunctions(slave, at, N);
    HycoSideFunctions(master, at, other);
    /* 2 pi r dr dz: the radius at the point, on the slave's side; round-off on the axis may make it negative. */
    if (s->fe->formulation == HYCO_AXISYMMETRIC) {
      PetscReal r = plane->centre[0] + at[0] * plane->axis[0][0];

      w *= 2 * PETSC_PI * PetscMax(r, 0);
    }
    for (PetscInt i = 0; i < slave->nf; i++) {
      s->own[i] += w * N[i];
      for (PetscInt k = 0; k < slave->nf; k++) s->M[i][k] += w * N[i] * N[k];
      for (PetscInt j = 0; j < master->nf; j++) b->P[i][j] += w * N[i] * other[j];
    }
    s->facing += size * s->rule.weight[q];
  }
}

/* The distance of the two sides along the normal at the middle of a piece; below 0 they overlap. */
static PetscReal MortarRowHeight(const HycoSide *slave, const HycoSide *master, const HycoPiece *piece)
{
  PetscReal at[2] = {0, 0}, N[HYCO_FACET_NODES], height = 0;
  HycoSide flat;

  for (PetscInt k = 0; k < piece->n; k++) {
    for (PetscInt c = 0; c < 2; c++) at[c] += piece->at[k][c] / piece->n;
  }
  for (PetscInt side = 0; side < 2; side++) {
    /* Linear functions of the corners: a height differs from the exact one by the facet's curvature. */
    flat = side ? *slave : *master;
    flat.nf = flat.corners; /* heights are known at corners */
    HycoSideFunctions(&flat, at, N);
    for (PetscInt a = 0; a < flat.corners; a++) height += (side ? -1 : 1) * N[a] * flat.height[a];
  }
  return height;
}

/* Adds the piece of one facet of the master, unless it is farther than `limit`. */
static PetscErrorCode AddPiece(Mortar *s, const HycoPlane *plane, const HycoSide *slave, PetscInt patch,
                               PetscReal limit)
{
  HycoSide master;
  HycoPiece piece;
  PetscReal height;
  Block *b;

  PetscFunctionBegin;
  HycoSideSet(plane, s->t.nf, s->corners, s->t.node + patch * s->t.nf, s->t.X, &master);
  HycoPieceCut(plane->dim, slave, &master, &piece);
  /* The nearer of two layers is kept by the limit on the height, and slivers of round-off would only add masters. */
  if (!(piece.size > EMPTY_PIECE * s->size)) PetscFunctionReturn(PETSC_SUCCESS);
  height = MortarRowHeight(slave, &master, &piece);
  if (PetscAbsReal(height) > limit || (s->front && height < -HYCO_SAME_POINT * plane->radius))
    PetscFunctionReturn(PETSC_SUCCESS);
  HycoGrow(s->n_blocks, s->room_blocks, s->block);
  b = &s->block[s->n_blocks++];
  b->nf = master.nf;
  PetscCall(PetscArraycpy(b->node, master.node, master.nf));
  PetscCall(PetscMemzero(b->P, sizeof(b->P)));
  /* A fan of triangles from the first corner: pieces are convex. In 2D one round, over the interval. */
  for (PetscInt k = 1; k + 1 < PetscMax(piece.n, 3); k++) {
    const PetscReal *a = piece.at[0], *p = piece.at[k], *q = plane->dim == 2 ? piece.at[0] : piece.at[k + 1];
    const PetscReal *const vertex[3] = {a, p, q};
    const PetscReal size =
        plane->dim == 2 ? piece.size : PetscAbsReal((p[0] - a[0]) * (q[1] - a[1]) - (p[1] - a[1]) * (q[0] - a[0])) / 2;

    AddSimplex(s, plane, slave, &master, vertex, size, b);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All pieces at most `limit` away, of facets of the master that oppose the slave's. */
static PetscErrorCode AddPieces(Mortar *s, const HycoPlane *plane, const HycoSide *slave, PetscReal limit)
{
  PetscFunctionBegin;
  s->n_blocks = 0;
  s->facing = 0;
  PetscCall(PetscMemzero(s->M, sizeof(s->M)));
  PetscCall(PetscMemzero(s->own, sizeof(s->own)));
  for (PetscInt k = 0; k < s->n_near; k++) {
    const PetscReal *n = s->t.normal + 3 * s->near[k];

    /* Facets within 72 degrees of facing each other; a facet on the axis has no normal. */
    if (HycoDot(n, plane->normal) <= HYCO_OPPOSED && HycoDot(n, n) > 0)
      PetscCall(AddPiece(s, plane, slave, s->near[k], limit));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The area of a side in its own plane. */
static PetscReal SizeOf(PetscInt dim, const HycoSide *side)
{
  HycoPiece whole;

  HycoPieceCut(dim, side, side, &whole);
  return whole.size;
}

/* The nearest point of the master to the facet's centre. Where surfaces go round edges, and it is on a facet that does
   not oppose, the nearest one that does, in front: the wall of a corner, beside its floor. */
static void FindNearest(Mortar *s, HycoProjection *at)
{
  const HycoPlane *plane = &s->plane;
  HycoProjection opposed;

  HycoPatchesProject(s->patches, plane->centre, NULL, at);
  s->front = (PetscBool)((s->edges & HYCO_EDGES) && HycoDot(s->t.normal + 3 * at->patch, plane->normal) > HYCO_OPPOSED);
  if (!s->front) return;
  HycoPatchesProject(s->patches, plane->centre, plane->normal, &opposed);
  if (opposed.n) *at = opposed;
}

/* The pieces of facet f. Along its normal the master may be as far as a facet in the limit angle to it whose nearest
   point is as far as that of the middle; of two layers the nearer one is taken, by lower limits. */
static PetscErrorCode FindPieces(Mortar *s, PetscInt f, HycoSide *slave)
{
  HycoMesh m = s->fe->mesh;
  const PetscInt *node = m->facets + f * m->nf, corners = HycoFacetCorners(s->corners, node);
  const PetscReal *X[4];
  PetscReal normal[3], limit;
  HycoPlane *plane = &s->plane;
  HycoProjection at;
  HycoPrism prism;

  PetscFunctionBegin;
  s->n_blocks = 0;
  for (PetscInt a = 0; a < corners; a++) X[a] = s->fe->X + 3 * node[a];
  PetscCall(HycoFacetVector(s->fe, f, normal));
  HycoNormalise(normal);
  if (!(HycoDot(normal, normal) > 0)) PetscFunctionReturn(PETSC_SUCCESS); /* on the axis */
  HycoPlaneSet(m->dim, corners, X, normal, plane);
  HycoSideSet(plane, m->nf, s->corners, node, s->fe->X, slave);
  s->size = SizeOf(m->dim, slave);
  /* Its distance bounds how far the facing part can be. */
  FindNearest(s, &at);
  limit = PetscMin(s->reach, (at.distance + plane->radius) / -HYCO_OPPOSED);
  prism.radius = plane->radius;
  prism.along = limit + plane->radius; /* the facet may be warped */
  PetscCall(PetscArraycpy(prism.centre, plane->centre, 3));
  PetscCall(PetscArraycpy(prism.normal, plane->normal, 3));
  PetscCall(HycoPatchesWithin(s->patches, &prism, &s->n_near, s->near));
  do {
    PetscCall(AddPieces(s, plane, slave, limit));
    /* Counted twice, the slave's area faces more than itself: a second layer lies behind the first. */
    limit /= 2;
  } while (s->facing > TWO_LAYERS * s->size && limit > EMPTY_PIECE * plane->radius);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the integrals P of all blocks by those of the dual functions over D_i: M^-1 P, or P_i / D_i on slivers. */
static PetscErrorCode MakeDual(Mortar *s, const HycoSide *slave, PetscBool *usable)
{
  const PetscBool two = (PetscBool)(slave->nf > slave->corners);
  PetscScalar A[HYCO_FACET_NODES * HYCO_FACET_NODES];
  PetscBLASInt n, one = 1, info = 1, failed;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(slave->nf, &n));
  *usable = (PetscBool)(s->facing > (two ? SLIVER_TWO : 0) * s->size);
  if (!*usable) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < slave->nf; i++) {
    for (PetscInt k = 0; k < slave->nf; k++) A[i * slave->nf + k] = s->M[i][k];
  }
  /* M is the mass matrix of the facing part, thus positive definite there; info = 1 (its initial value) selects the
     slivers' branch below. */
  if (s->facing > SLIVER * s->size) LAPACKpotrf_("L", &n, A, &n, &info);
  for (PetscInt b = 0; b < s->n_blocks; b++) {
    PetscScalar *P = &s->block[b].P[0][0], column[HYCO_FACET_NODES];

    for (PetscInt j = 0; j < s->block[b].nf; j++) {
      for (PetscInt i = 0; i < slave->nf; i++) column[i] = P[i * HYCO_FACET_NODES + j];
      if (!info) LAPACKpotrs_("L", &n, &one, A, &n, column, &n, &failed);
      for (PetscInt i = 0; i < slave->nf; i++)
        P[i * HYCO_FACET_NODES + j] = !info ? column[i] : s->own[i] > 0 ? column[i] / s->own[i] : 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Terms of all facets are collected first and merged by row at the end: how many masters a row has is not known
   before. */
static PetscErrorCode AddTerm(Mortar *s, PetscInt row, PetscInt node, PetscReal value)
{
  PetscFunctionBegin;
  HycoGrow(s->n_terms, s->room_terms, s->term);
  s->term[s->n_terms++] = (Term){row, node, value};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds `value` times the dual mean over node i's part of the facet to a row. */
static PetscErrorCode AddMean(Mortar *s, PetscInt i, PetscInt row, PetscReal value)
{
  PetscFunctionBegin;
  for (PetscInt b = 0; b < s->n_blocks; b++) {
    for (PetscInt j = 0; j < s->block[b].nf; j++)
      PetscCall(AddTerm(s, row, s->block[b].node[j], value * s->block[b].P[i][j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a facet's node a has a function of positive integral, by which forces act on it. */
static PetscBool MortarRowCarriesForce(const Mortar *s, PetscInt a, PetscInt node)
{
  return (PetscBool)(a >= HycoMeshFirstCarrier(s->fe->mesh) && !HycoNodeHasNoArea(s->fe, node));
}

/* Node i of the facet follows its own point v_i instead of its dual mean p_i. So that the forces on both sides stay in
   balance, other nodes k of the facet take its function: psi_k + c_k psi_i, with sum of c_k = 1, and row k gets
   c_k D_i (p_i - v_i). c: in proportion to D_k; for second order extrapolated linearly, if the nodes k determine
   that. */
static PetscErrorCode AddPinned(Mortar *s, const HycoSide *slave, PetscInt i, const PetscReal c[])
{
  const HycoProjection *at = &s->pin[slave->node[i]];

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= slave->nf; k++) {
    /* One more taker than nodes: where none of the facet's nodes has a row. */
    const PetscInt row = k < slave->nf ? s->row[slave->node[k]] : s->taker[slave->node[i]];
    const PetscReal value = c[k] * s->own[i];

    if (c[k] == 0 || row < 0) continue;
    PetscCall(AddMean(s, i, row, value));
    /* Minus the part that the pinned point carries, so that the sum of the forces stays. */
    for (PetscInt a = 0; a < at->n; a++) PetscCall(AddTerm(s, row, at->node[a], -value * at->weight[a]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The shares c of node i for second order: of least squares among those with sum c_k = 1 and sum c_k (x_k - x_i) = 0;
   false if the nodes do not determine them. */
static PetscBool MortarRowExtrapolate(const Mortar *s, const HycoSide *slave, PetscInt i, const PetscBool takes[],
                                      PetscReal c[])
{
  const PetscInt size = s->plane.dim;
  PetscReal d[HYCO_FACET_NODES][3];
  PetscScalar A[9] = {0}, b[3] = {1, 0, 0};
  PetscBLASInt n = (PetscBLASInt)size, one = 1, info;

  for (PetscInt k = 0; k < slave->nf; k++) {
    PetscReal r[3];

    /* In widths of the facet: the matrix does not depend on the unit of length. */
    for (PetscInt e = 0; e < 3; e++)
      r[e] = (s->fe->X[3 * slave->node[k] + e] - s->fe->X[3 * slave->node[i] + e]) / s->plane.radius;
    d[k][0] = 1;
    for (PetscInt e = 1; e < size; e++) d[k][e] = HycoDot(r, s->plane.axis[e - 1]);
    for (PetscInt e = 0; takes[k] && e < size * size; e++) A[e] += d[k][e / size] * d[k][e % size];
  }
  LAPACKpotrf_("L", &n, A, &n, &info);
  /* Nodes on one line do not determine a plane. */
  for (PetscInt e = 0; e < size && !info; e++) info = PetscRealPart(A[e * size + e]) < UNDETERMINED;
  if (info) return PETSC_FALSE;
  LAPACKpotrs_("L", &n, &one, A, &n, b, &n, &info);
  for (PetscInt k = 0; k < slave->nf; k++) {
    c[k] = 0;
    for (PetscInt e = 0; takes[k] && e < size; e++) c[k] += PetscRealPart(b[e]) * d[k][e];
  }
  return PETSC_TRUE;
}

/* What the facet's nodes without a row leave to those with one; c[nf]: to another facet. */
static PetscErrorCode AddPins(Mortar *s, const HycoSide *slave)
{
  PetscBool takes[HYCO_FACET_NODES];
  PetscReal c[HYCO_FACET_NODES + 1], sum = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < slave->nf; k++) {
    takes[k] = (PetscBool)(s->row[slave->node[k]] >= 0 && MortarRowCarriesForce(s, k, slave->node[k]));
    if (takes[k]) sum += s->own[k];
  }
  for (PetscInt i = 0; i < slave->nf; i++) {
    /* A node with a row has its own mean, and keeps its forces. */
    if (!s->pin[slave->node[i]].n || s->row[slave->node[i]] >= 0) continue;
    c[slave->nf] = !(sum > 0);
    if (slave->nf == slave->corners || !MortarRowExtrapolate(s, slave, i, takes, c)) {
      for (PetscInt k = 0; k < slave->nf; k++) c[k] = takes[k] && sum > 0 ? s->own[k] / sum : 0;
    }
    PetscCall(AddPinned(s, slave, i, c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row of node a of facet f: of the node, or on an edge of the facet's side; -1: none. */
static PetscInt RowOf(const Mortar *s, PetscInt f, PetscInt a)
{
  const HycoMesh m = s->fe->mesh;
  const PetscInt at = f * m->nf + a, node = m->facets[at];
  PetscInt slot = -1;

  if (s->row[node] >= 0 || !s->n_slots || m->facet_side[at] < 0) return s->row[node];
  (void)PetscFindInt(HYCO_SIDES * node + m->facet_side[at], s->n_slots, s->slot, &slot);
  return slot < 0 ? -1 : s->row[m->n_nodes + slot];
}

/* Adds a facet's part to the rows of its nodes, in proportion to the nodes' integrals; a node without an integral takes
   the facet's: on the axis of cells of second order, and, in ties, the corners of their triangles. */
static PetscErrorCode AddFacet(Mortar *s, PetscInt f)
{
  HycoSide slave;
  PetscBool usable = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(FindPieces(s, f, &slave));
  if (s->n_blocks) PetscCall(MakeDual(s, &slave, &usable));
  for (PetscInt i = 0; usable && i < slave.nf; i++) {
    const PetscInt row = RowOf(s, f, i);
    const PetscReal share = MortarRowCarriesForce(s, i, slave.node[i]) ? s->own[i] : s->size;

    if (row < 0) continue;
    s->D[row] += share;
    PetscCall(AddMean(s, i, row, share));
  }
  /* Only ties pin nodes. */
  if (usable && s->pin) PetscCall(AddPins(s, &slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- rows -- */

/* The masters of one row, whose terms are term[0 .. n) of place[]: merged, ascending, with sum 1; 0: none. */
static PetscErrorCode MortarRowMerge(const Mortar *s, PetscInt n, PetscInt place[], PetscReal D, PetscInt node[],
                                     PetscReal weight[], PetscInt *n_masters)
{
  PetscReal sum = 0;
  PetscInt kept = 0, merged = 0;

  PetscFunctionBegin;
  *n_masters = 0;
  if (!(D > 0)) PetscFunctionReturn(PETSC_SUCCESS); /* second order: at a border that the master covers in part */
  for (PetscInt k = 0; k < n; k++) node[k] = s->term[place[k]].node;
  PetscCall(PetscSortIntWithArray(n, node, place));
  for (PetscInt k = 0; k < n; k++) {
    if (k && node[k] == node[merged - 1]) {
      weight[merged - 1] += s->term[place[k]].value / D;
      continue;
    }
    node[merged] = node[k];
    weight[merged++] = s->term[place[k]].value / D;
  }
  for (PetscInt k = 0; k < merged; k++) {
    /* Round-off would couple nodes that only share a corner with the facing part. The rest is scaled to the sum 1,
       so that rigid motions have no gap. */
    if (PetscAbsReal(weight[k]) < SNAP) continue;
    node[kept] = node[k];
    weight[kept] = weight[k];
    sum += weight[kept++];
  }
  for (PetscInt k = 0; k < kept; k++) weight[k] /= sum;
  *n_masters = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends all rows: the terms are counted by row first. */
static PetscErrorCode MortarRowAppend(const Mortar *s, PetscInt index, PetscInt n, const PetscInt slave[],
                                      const PetscInt side[], HycoPairs *pairs)
{
  PetscInt *start, *place, *node;
  PetscReal *weight;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n + 2, &start));
  PetscCall(PetscMalloc3(s->n_terms, &place, s->n_terms, &node, s->n_terms, &weight));
  /* Counting sort by row, two places ahead, so that the second loop leaves the starts in place. */
  for (PetscInt e = 0; e < s->n_terms; e++) start[s->term[e].row + 2]++;
  for (PetscInt k = 0; k < n; k++) start[k + 2] += start[k + 1];
  for (PetscInt e = 0; e < s->n_terms; e++) place[start[s->term[e].row + 1]++] = e;
  PetscCall(HycoPairsReserve(pairs, n, 0));
  PetscCall(PetscRealloc((size_t)(pairs->master_start[pairs->n] + s->n_terms + 1) * sizeof(PetscInt), &pairs->master));
  PetscCall(PetscRealloc((size_t)(pairs->master_start[pairs->n] + s->n_terms + 1) * sizeof(PetscReal), &pairs->weight));
  for (PetscInt k = 0; k < n; k++) {
    PetscInt masters;

    /* Terms of one master from several facets become one, divided by D of the row. */
    PetscCall(MortarRowMerge(s, start[k + 1] - start[k], place + start[k], s->D[k], node, weight, &masters));
    HycoPairsAppend(pairs, index, slave[k], side ? side[k] : HYCO_ONE_SIDE, masters, node, weight);
  }
  PetscCall(PetscFree3(place, node, weight));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By node of the slave without a row: the row of the nearest node that shares a facet with it, or with such a node. A
   node without a row, such as a fixed one, would otherwise leave its part of the pressure to nobody. */
static PetscErrorCode FindTakers(Mortar *s)
{
  HycoMesh m = s->fe->mesh;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &s->taker));
  for (PetscInt i = 0; i < m->n_nodes; i++) s->taker[i] = -1;
  for (PetscInt k = 0; k < 2 * m->n_facets; k++) { /* facets of nodes with rows, then the others */
    const PetscInt f = k % m->n_facets, *node = m->facets + f * m->nf;
    PetscInt row = -1;

    /* Two passes over the facets: nodes far from any row take that of a neighbour which took one. */
    if (m->facet_group[f] != s->t.slave) continue;
    for (PetscInt a = 0; a < m->nf; a++) {
      const PetscInt own = MortarRowCarriesForce(s, a, node[a]) ? s->row[node[a]] : -1;

      if (row < 0) row = own >= 0 || k < m->n_facets ? own : s->taker[node[a]];
    }
    for (PetscInt a = 0; a < m->nf; a++) {
      if (s->taker[node[a]] < 0) s->taker[node[a]] = row;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the order of the mesh's facets. A facet without rows of this rank is skipped, except in ties, whose pinned
   nodes give to rows of other facets. */
static PetscErrorCode MortarRowIntegrate(Mortar *s, PetscInt index, PetscInt n, const PetscInt slave[],
                                         const PetscInt side[], HycoPairs *pairs)
{
  HycoMesh m = s->fe->mesh;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets && s->patches; f++) {
    PetscBool any = (PetscBool)(s->pin != NULL);

    /* In a fixed order: sums do not depend on the ranks. */
    if (m->facet_group[f] != s->t.slave) continue;
    for (PetscInt a = 0; a < m->nf; a++) any = (PetscBool)(any || RowOf(s, f, a) >= 0);
    if (any) PetscCall(AddFacet(s, f));
  }
  PetscCall(MortarRowAppend(s, index, n, slave, side, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The slave's and the master's groups are those of t. `s` is destroyed after an error as well. */
static PetscErrorCode MortarRowRun(Mortar *s, PetscInt index, PetscInt n, const PetscInt slave[], const PetscInt side[],
                                   HycoPairs *pairs)
{
  PetscFunctionBegin;
  HycoFinally(MortarRowIntegrate(s, index, n, slave, side, pairs), PetscCall(MortarDestroy(s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slaves of this rank only, with all facets around them here: a row is then complete without communication. Not
   collective. */
PetscErrorCode HycoMortarRows(HycoContact c, HycoFE fe, const HycoPairs *of, PetscInt first, PetscInt last,
                              PetscReal reach, HycoPairs *pairs)
{
  const PetscInt n = last - first, *slave = of->slave + first, *side = of->side + first;
  PetscInt slaves, masters;
  Mortar s;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &slaves));
  PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->master, &masters));
  PetscCall(HycoLogEvent(HYCO_EVENT_SEARCH, PETSC_TRUE));
  /* Also after an error MortarRowRun() has freed what was made. */
  ierr = MortarCreate(fe, slaves, masters, reach, n, slave, side, &s);
  if (!ierr) ierr = HycoPairsEdges(fe, of, of->contact[first], &s.edges);
  if (!ierr) ierr = MortarRowRun(&s, of->contact[first], n, slave, side, pairs);
  PetscCall(HycoLogEvent(HYCO_EVENT_SEARCH, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the whole mesh, before it is distributed. No limit of the distance: the ties' tolerance has been checked at the
   nearest points. */
PetscErrorCode HycoMortarTie(HycoFE fe, PetscInt slaves, PetscInt masters, const HycoProjection pin[], PetscInt n,
                             const PetscInt slave[], HycoPairs *pairs)
{
  Mortar s;

  PetscFunctionBegin;
  PetscCall(MortarCreate(fe, slaves, masters, PETSC_MAX_REAL, n, slave, NULL, &s));
  s.pin = pin;
  PetscCall(FindTakers(&s));
  PetscCall(MortarRowRun(&s, 0, n, slave, NULL, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
