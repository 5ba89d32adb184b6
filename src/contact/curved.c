/*
  The nearest point of a facet of second order: inside it, where the tangents are orthogonal to the distance, or on one
  of its sides. The squared distance is minimised in the coordinates of the reference facet by Gauss-Newton steps. They
  converge at the ratio of the distance to the radius of curvature, which is small for surfaces that nearly touch.
*/
#include "curved.h"
#include <hycofe.h>
#include <hycovector.h>

#define SMALL_STEP 1e-15 /* of the reference facet, whose size is 1: 4.5 eps, a step's round-off */
/* Factor of the squared distance up to which a step brings no farther: 1 and 4500 eps, the shape functions' round-off.
   */
#define NO_FARTHER (1 + 1e-12)
/* Steps that end farther outside the reference facet do not return into it. */
#define FAR_OUTSIDE 3

/* The squared distance at a point of the reference facet; the vector from x and the tangents there, and the weights. */
static PetscReal CurvedFacetEvaluate(const HycoCurved *f, const PetscReal x[3], const PetscReal at[2], PetscReal r[3],
                                     PetscReal tangent[2][3], PetscReal w[])
{
  PetscReal slope[HYCO_FACET_NODES][3];

  HycoFacetFunctions(f->nf, at, w, slope);
  for (PetscInt c = 0; c < 3; c++) {
    r[c] = -x[c];
    tangent[0][c] = tangent[1][c] = 0;
    for (PetscInt a = 0; a < f->nf; a++) {
      r[c] += w[a] * f->X[a][c];
      /* A line has one tangent. */
      for (PetscInt d = 0; d < (f->corners > 2 ? 2 : 1); d++) tangent[d][c] += slope[a][d] * f->X[a][c];
    }
  }
  return HycoDot(r, r);
}

/* The Gauss-Newton step, at most 1 long; its length, 0 where the facet is degenerate. */
static PetscReal GaussNewtonStep(const HycoCurved *f, const PetscReal r[3], PetscReal tangent[2][3], PetscReal step[2])
{
  const PetscReal a = HycoDot(tangent[0], tangent[0]), b = HycoDot(tangent[0], tangent[1]),
                  d = HycoDot(tangent[1], tangent[1]), g0 = HycoDot(tangent[0], r), g1 = HycoDot(tangent[1], r);
  const PetscReal det = f->corners > 2 ? a * d - b * b : a;
  PetscReal length;

  /* Negated, so that NaN counts as degenerate as well; the caller then keeps the present point. */
  if (!(det > (f->corners > 2 ? 1e-28 * a * d : 0))) return 0;
  /* -(T^T T)^-1 T^T r for the tangents T. */
  step[0] = f->corners > 2 ? (b * g1 - d * g0) / det : -g0 / det;
  step[1] = f->corners > 2 ? (b * g0 - a * g1) / det : 0;
  length = PetscMax(PetscAbsReal(step[0]), PetscAbsReal(step[1]));
  /* Half of the reference facet's width at most: beyond it the quadratic functions fold back. */
  for (PetscInt k = 0; k < 2; k++) step[k] /= PetscMax(length, 1);
  return PetscMin(length, 1);
}

/* Minimises the squared distance from `at`, on a line between its ends, and returns it. */
static PetscReal CurvedFacetDescend(const HycoCurved *f, const PetscReal x[3], PetscReal at[2], PetscReal w[])
{
  PetscReal r[3], tangent[2][3], best = CurvedFacetEvaluate(f, x, at, r, tangent, w);

  for (PetscInt it = 0; it < 100 && PetscMax(PetscAbsReal(at[0]), PetscAbsReal(at[1])) < FAR_OUTSIDE; it++) {
    PetscReal step[2], length = GaussNewtonStep(f, r, tangent, step), trial[2], next = PETSC_MAX_REAL;

    /* Halves the step until the distance does not grow; equality within round-off is accepted, so that the last
       steps converge. */
    for (; length > SMALL_STEP; length /= 2) {
      for (PetscInt k = 0; k < 2; k++) trial[k] = at[k] + step[k];
      if (f->corners == 2) trial[0] = PetscMin(PetscMax(trial[0], -1), 1);
      next = CurvedFacetEvaluate(f, x, trial, r, tangent, w);
      if (next <= NO_FARTHER * best) break;
      for (PetscInt k = 0; k < 2; k++) step[k] /= 2;
    }
    if (!(length > SMALL_STEP) || (trial[0] == at[0] && trial[1] == at[1])) break;
    best = next;
    for (PetscInt k = 0; k < 2; k++) at[k] = trial[k];
  }
  return CurvedFacetEvaluate(f, x, at, r, tangent, w);
}

/* Without a tolerance: a minimum on a side is found by the search along the sides, with exact zeros as weights. */
static PetscBool IsInside(const HycoCurved *f, const PetscReal at[2])
{
  if (f->corners == 3) return (PetscBool)(at[0] >= 0 && at[1] >= 0 && at[0] + at[1] <= 1);
  return (PetscBool)(PetscMax(PetscAbsReal(at[0]), PetscAbsReal(at[1])) <= 1);
}

/* The nearest point of a line, from the nearest of its nodes. */
static PetscReal OnLine(const HycoCurved *line, const PetscReal x[3], PetscReal w[3])
{
  /* Reference coordinates of the ends and of the middle: the start of the descent is the nearest node. */
  static const PetscReal place[3] = {-1, 1, 0};
  PetscReal at[2] = {0, 0}, best = PETSC_MAX_REAL;

  for (PetscInt a = 0; a < 3; a++) {
    const PetscReal d = HycoDistance(line->X[a], x);

    if (d >= best) continue;
    best = d;
    at[0] = place[a];
  }
  return CurvedFacetDescend(line, x, at, w);
}

/* Squared distance of x from a second-order facet, with the weights of its nodes at the nearest point. Sides are
   always tried, since the interior minimum may be a local one. */
PetscReal HycoCurvedProject(const HycoCurved *f, const PetscReal x[3], PetscReal w[HYCO_FACET_NODES])
{
  PetscReal at[2] = {f->corners == 3 ? 1.0 / 3 : 0, f->corners == 3 ? 1.0 / 3 : 0}, best;

  if (f->corners == 2) return OnLine(f, x, w);
  best = CurvedFacetDescend(f, x, at, w);
  /* The minimum of the extended facet is no point of it. */
  if (!IsInside(f, at)) best = PETSC_MAX_REAL;
  for (PetscInt k = 0; k < f->corners; k++) {
    /* An edge: its two corners and the node in its middle. */
    const PetscInt of[3] = {k, (k + 1) % f->corners, f->corners + k};
    const HycoCurved line = {3, 2, {f->X[of[0]], f->X[of[1]], f->X[of[2]]}};
    PetscReal along[HYCO_FACET_NODES], d = OnLine(&line, x, along);

    if (d >= best) continue;
    best = d;
    for (PetscInt a = 0; a < f->nf; a++) w[a] = 0;
    for (PetscInt a = 0; a < 3; a++) w[of[a]] = along[a];
  }
  return best;
}

/* The facet is the linear one through its corners plus, for each further node, its distance from where the functions
   of the nodes before it place it, times a function between 0 and 1. A box that contains the facet, for the tree:
   nodes alone do not bound a curved facet. */
void HycoCurvedBox(const HycoCurved *f, PetscReal lo[3], PetscReal hi[3])
{
  const PetscInt corners = f->corners, sides = corners == 2 ? 1 : corners;

  for (PetscInt c = 0; c < 3; c++) {
    PetscReal up = 0, down = 0, middle = 0;

    lo[c] = hi[c] = f->X[0][c];
    for (PetscInt k = 0; k < corners; k++) {
      lo[c] = PetscMin(lo[c], f->X[k][c]);
      hi[c] = PetscMax(hi[c], f->X[k][c]);
      middle -= f->X[k][c] / 4;
    }
    /* In the hierarchical basis a side's function is between 0 and 1, so that `off` bounds what the side adds to the
       linear facet. */
    for (PetscInt k = 0; k < sides; k++) {
      const PetscReal off = f->X[corners + k][c] - (f->X[k][c] + f->X[(k + 1) % corners][c]) / 2;

      up += PetscMax(off, 0);
      down -= PetscMin(off, 0);
      middle += f->X[corners + k][c] / 2;
    }
    /* The bubble of the middle node is the last in the hierarchy: `middle` is where the eight functions before it
       place its point. */
    if (f->nf > corners + sides) {
      up += PetscMax(f->X[f->nf - 1][c] - middle, 0);
      down -= PetscMin(f->X[f->nf - 1][c] - middle, 0);
    }
    lo[c] -= down;
    hi[c] += up;
  }
}
