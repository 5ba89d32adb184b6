/*
  The parts of a slave's facet that face facets of the master: both are projected onto the slave facet's plane along its
  normal, and the master's polygon is cut by the slave's (I. Sutherland, G. Hodgman, Comm. ACM 17 (1974) 32-42). Facets
  of second order are cut by the straight sides between their corners.
*/
#include "mortar.h"
#include <petscdt.h>

/* Newton's steps to a point of a quadrilateral; parallelograms need one. */
#define MOST_STEPS 30

/* Gauss' rule in one direction, on triangles in two of which the second has the length that the first leaves. */
PetscErrorCode HycoRuleCreate(PetscInt dim, PetscInt degree, HycoRule *rule)
{
  /* n points are exact up to degree 2 n - 1; the factor 1 - x of the collapsed square costs one degree more. */
  const PetscInt n = dim == 2 ? degree / 2 + 1 : (degree + 3) / 2;
  PetscReal x[5], w[5];

  PetscFunctionBegin;
  PetscCall(PetscDTGaussQuadrature(n, 0, 1, x, w));
  rule->n = dim == 2 ? n : n * n;
  for (PetscInt q = 0; q < rule->n; q++) {
    const PetscInt i = q % n, j = q / n;
    PetscReal *share = rule->share[q];

    share[1] = x[i];
    share[2] = dim == 2 ? 0 : x[j] * (1 - x[i]);
    share[0] = 1 - share[1] - share[2];
    rule->weight[q] = dim == 2 ? w[i] : 2 * w[i] * w[j] * (1 - x[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first axis is along the first side, less its part along the normal. */
void HycoPlaneSet(PetscInt dim, PetscInt corners, const PetscReal *const X[], const PetscReal normal[3],
                  HycoPlane *plane)
{
  PetscReal along;

  plane->dim = dim;
  plane->radius = 0;
  for (PetscInt c = 0; c < 3; c++) {
    plane->normal[c] = normal[c];
    plane->axis[0][c] = X[1][c] - X[0][c];
    plane->centre[c] = 0;
    for (PetscInt a = 0; a < corners; a++) plane->centre[c] += X[a][c] / corners;
  }
  /* The ball around the facet: which master facets may lie over it. */
  for (PetscInt a = 0; a < corners; a++) plane->radius = PetscMax(plane->radius, HycoDistance(X[a], plane->centre));
  along = HycoDot(plane->axis[0], normal);
  for (PetscInt c = 0; c < 3; c++) plane->axis[0][c] -= along * normal[c];
  HycoNormalise(plane->axis[0]);
  for (PetscInt c = 0; c < 3; c++) {
    /* The vector product of normal and first axis. */
    const PetscInt i = (c + 1) % 3, j = (c + 2) % 3;

    plane->axis[1][c] = normal[i] * plane->axis[0][j] - normal[j] * plane->axis[0][i];
  }
}

/* Coordinates in the plane and heights above it. A collapsed quadrilateral (last corner repeated) becomes a
   triangle, since its bilinear map is singular. */
void HycoSideSet(const HycoPlane *plane, PetscInt nf, PetscInt corners, const PetscInt node[], const PetscReal X[],
                 HycoSide *side)
{
  side->corners = nf == 4 ? HycoFacetCorners(nf, node) : corners;
  side->nf = nf == 4 ? side->corners : nf;
  for (PetscInt a = 0; a < side->nf; a++) side->node[a] = node[a];
  for (PetscInt a = 0; a < side->corners; a++) {
    PetscReal r[3];

    for (PetscInt c = 0; c < 3; c++) r[c] = X[3 * node[a] + c] - plane->centre[c];
    side->at[a][0] = HycoDot(r, plane->axis[0]);
    side->at[a][1] = plane->dim == 2 ? 0 : HycoDot(r, plane->axis[1]);
    /* Above the plane of the slave's facet: the gap between both sides is their difference. */
    side->height[a] = HycoDot(r, plane->normal);
  }
}

/* -- functions -- */

/* Twice the signed area of the triangle a b p: > 0 where p is to the left of ab. */
static PetscReal MortarPieceCross(const PetscReal a[2], const PetscReal b[2], const PetscReal p[2])
{
  return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

/* The bilinear functions of the corners. */
static void MortarPieceBilinear(const PetscReal xi[2], PetscReal N[4])
{
  N[0] = (1 - xi[0]) * (1 - xi[1]) / 4;
  N[1] = (1 + xi[0]) * (1 - xi[1]) / 4;
  N[2] = (1 + xi[0]) * (1 + xi[1]) / 4;
  N[3] = (1 - xi[0]) * (1 + xi[1]) / 4;
}

/* The reference coordinates of a point of a quadrilateral by Newton's method. */
static void InQuadrilateral(const HycoSide *s, const PetscReal p[2], PetscReal xi[2])
{
  xi[0] = xi[1] = 0;
  for (PetscInt it = 0; it < MOST_STEPS; it++) {
    PetscReal N[4], r[2], t[2][2], det, step[2];

    MortarPieceBilinear(xi, N);
    for (PetscInt c = 0; c < 2; c++) {
      const PetscReal x[4] = {s->at[0][c], s->at[1][c], s->at[2][c], s->at[3][c]};

      r[c] = p[c];
      for (PetscInt a = 0; a < 4; a++) r[c] -= N[a] * x[a];
      t[0][c] = ((1 - xi[1]) * (x[1] - x[0]) + (1 + xi[1]) * (x[2] - x[3])) / 4;
      t[1][c] = ((1 - xi[0]) * (x[3] - x[0]) + (1 + xi[0]) * (x[2] - x[1])) / 4;
    }
    det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
    /* Degenerate: the point so far is as good as any. */
    if (det == 0) return;
    step[0] = (r[0] * t[1][1] - r[1] * t[1][0]) / det;
    step[1] = (r[1] * t[0][0] - r[0] * t[0][1]) / det;
    /* Steps of at most half of the reference cell: from far outside a full step could leave the domain where the map is
       regular. */
    for (PetscInt c = 0; c < 2; c++) xi[c] += PetscMin(PetscMax(step[c], -1), 1);
    if (PetscMax(PetscAbsReal(step[0]), PetscAbsReal(step[1])) < 1e-14) return;
  }
}

/* At a point of the plane, thus after the projection along the slave's normal: the reference point of a
   quadrilateral is found by Newton's method on the straight-sided cell. */
void HycoSideFunctions(const HycoSide *s, const PetscReal p[2], PetscReal N[HYCO_FACET_NODES])
{
  PetscReal xi[2] = {0, 0}, slope[HYCO_FACET_NODES][3];

  if (s->corners == 2) {
    xi[0] = 2 * (p[0] - s->at[0][0]) / (s->at[1][0] - s->at[0][0]) - 1;
    N[0] = (1 - xi[0]) / 2;
    N[1] = (1 + xi[0]) / 2;
  } else if (s->corners == 3) {
    const PetscReal area = MortarPieceCross(s->at[0], s->at[1], s->at[2]);

    N[1] = xi[0] = MortarPieceCross(s->at[2], s->at[0], p) / area;
    N[2] = xi[1] = MortarPieceCross(s->at[0], s->at[1], p) / area;
    N[0] = 1 - N[1] - N[2];
  } else {
    InQuadrilateral(s, p, xi);
    MortarPieceBilinear(xi, N);
  }
  /* Second order: the functions of all nodes at this reference point. */
  if (s->nf > s->corners) HycoFacetFunctions(s->nf, xi, N, slope);
}

/* -- cuts -- */

/* Of a convex polygon, as a fan of triangles; negative if its corners turn clockwise. */
static PetscReal MortarPieceArea(PetscInt n, PetscReal at[][2])
{
  PetscReal area = 0;

  for (PetscInt k = 1; k + 1 < n; k++) area += MortarPieceCross(at[0], at[k], at[k + 1]) / 2;
  return area;
}

/* What is left of the edge from a to b, counterclockwise, of a convex polygon of n corners. */
static PetscInt MortarPieceKeep(const PetscReal a[2], const PetscReal b[2], PetscInt n, PetscReal at[8][2])
{
  PetscReal old[8][2];
  PetscInt kept = 0;

  PetscCallAbort(PETSC_COMM_SELF, PetscArraycpy(&old[0][0], &at[0][0], 2 * n));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *p = old[k], *q = old[(k + 1) % n], dp = MortarPieceCross(a, b, p), dq = MortarPieceCross(a, b, q);

    /* On the left of a counterclockwise edge is inside. */
    if (dp >= 0 && kept < 8) {
      at[kept][0] = p[0];
      at[kept++][1] = p[1];
    }
    /* The edge p q crosses the line only if its ends are on different sides; a corner on the line is already kept. */
    if ((dp < 0) == (dq < 0) || dp == 0 || dq == 0 || kept == 8) continue;
    for (PetscInt c = 0; c < 2; c++) at[kept][c] = p[c] + dp / (dp - dq) * (q[c] - p[c]);
    kept++;
  }
  return kept;
}

/* Sutherland and Hodgman clip by one side of the slave after the other. Each cut adds at most one corner to a convex
   polygon: 4 + 4 are the 8 of HycoPiece. Both facets are given by their corners in the plane; curved sides are cut as
   straight ones. */
void HycoPieceCut(PetscInt dim, const HycoSide *slave, const HycoSide *master, HycoPiece *piece)
{
  PetscInt n = master->corners;
  PetscReal at[4][2], sign;

  piece->size = 0;
  if (dim == 2) {
    const PetscReal *s[2] = {slave->at[0], slave->at[1]}, *m[2] = {master->at[0], master->at[1]};
    /* In 2D pieces are intervals on a line. */
    const PetscReal lo = PetscMax(PetscMin(s[0][0], s[1][0]), PetscMin(m[0][0], m[1][0])),
                    hi = PetscMin(PetscMax(s[0][0], s[1][0]), PetscMax(m[0][0], m[1][0]));

    piece->n = 2;
    piece->at[0][0] = lo;
    piece->at[1][0] = hi;
    piece->at[0][1] = piece->at[1][1] = 0;
    piece->size = PetscMax(hi - lo, 0);
    return;
  }
  for (PetscInt a = 0; a < slave->corners; a++) {
    for (PetscInt c = 0; c < 2; c++) at[a][c] = slave->at[a][c];
  }
  sign = MortarPieceArea(slave->corners, at);
  for (PetscInt a = 0; a < n; a++) {
    for (PetscInt c = 0; c < 2; c++) piece->at[a][c] = master->at[a][c];
  }
  for (PetscInt a = 0; a < slave->corners && n > 2; a++) {
    const PetscInt b = (a + 1) % slave->corners;

    /* A slave facet may be numbered clockwise in the plane's axes. */
    n = sign > 0 ? MortarPieceKeep(at[a], at[b], n, piece->at) : MortarPieceKeep(at[b], at[a], n, piece->at);
  }
  piece->n = n;
  if (n > 2) piece->size = PetscAbsReal(MortarPieceArea(n, piece->at));
}
