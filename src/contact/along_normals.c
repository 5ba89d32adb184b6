/*
  The search for a point along the normals of two surfaces, in the tree of the nearest points. A box of points and a box
  of their normals bound the distance of the points from their lines.
*/
#include "nearest.h"
#include <hycovector.h>

/* Squared length of the mean of two reversed unit normals, below which it gives no direction: normals that differ by
   more than 168 degrees. */
#define NO_LINE 1e-2

/* The search along a line for each point, and the best so far: squared distances from the line and from x, patch (-1:
   none). */
typedef struct {
  const PetscReal *x, *out;
  PetscReal off, rr;
  PetscInt patch;
} Line;

/* The least squared distance of the points in box t from their lines, by interval arithmetic and less round-off.
   Bounds the cross product of (x - patch) and the mean normal from below, and the mean normal from above. */
static PetscReal LeastOff(HycoPatches s, PetscInt t, const Line *l)
{
  const HycoBox *b = &s->box[t], *turn = &s->turn[t];
  PetscReal r[3][2], mean[3][2], rr = 0, mm = 0, sum = 0;

  for (PetscInt c = 0; c < 3; c++) {
    r[c][0] = b->lo[c] - l->x[c];
    r[c][1] = b->hi[c] - l->x[c];
    mean[c][0] = l->out[c] - turn->hi[c];
    mean[c][1] = l->out[c] - turn->lo[c];
    rr += PetscMax(r[c][0] * r[c][0], r[c][1] * r[c][1]);
    mm += PetscMax(mean[c][0] * mean[c][0], mean[c][1] * mean[c][1]);
  }
  /* No node of the box can give a line: a little less than the bound, against round-off. */
  if (mm < 0.99 * NO_LINE) return PETSC_MAX_REAL;
  for (PetscInt c = 0; c < 3; c++) { /* of the cross product */
    const PetscInt i = (c + 1) % 3, j = (c + 2) % 3;
    PetscReal least[2], most[2], away;

    for (PetscInt k = 0; k < 4; k++) {
      const PetscReal p = r[i][k / 2] * mean[j][k % 2], q = r[j][k / 2] * mean[i][k % 2];

      least[0] = k ? PetscMin(least[0], p) : p;
      most[0] = k ? PetscMax(most[0], p) : p;
      least[1] = k ? PetscMin(least[1], q) : q;
      most[1] = k ? PetscMax(most[1], q) : q;
    }
    away = PetscMax(PetscMax(least[0] - most[1], least[1] - most[0]), 0);
    sum += away * away;
  }
  /* Less than the exact bound by the round-off of the products, so that no nearest point is lost. */
  return sum / mm * (1 - 1e-12) - 1e-13 * rr;
}

/* Ties go to the nearer node, then to the smaller index: the result does not depend on the order of the tree. */
static void TryAlong(HycoPatches s, PetscInt patch, Line *l)
{
  const PetscReal *n = s->normal + 3 * patch, *X = s->X + 3 * s->node[patch];
  const PetscReal r[3] = {X[0] - l->x[0], X[1] - l->x[1], X[2] - l->x[2]};
  const PetscReal mean[3] = {l->out[0] - n[0], l->out[1] - n[1], l->out[2] - n[2]};
  const PetscReal rr = HycoDot(r, r), mm = HycoDot(mean, mean), along = HycoDot(r, mean);
  PetscReal off;

  /* Nodes without a normal (cancelling facets), or normals that do not face each other. */
  if (HycoDot(n, n) == 0 || mm < NO_LINE) return;
  off = PetscMax(rr - along * along / mm, 0);
  if (off > l->off) return;
  if (off == l->off && l->patch >= 0 && (rr > l->rr || (rr == l->rr && patch > l->patch))) return;
  l->off = off;
  l->rr = rr;
  l->patch = patch;
}

/* Updates the line with the items lo .. hi - 1 under box t, whose distance is at least `least`. */
static void SearchAlong(HycoPatches s, PetscInt t, PetscReal least, PetscInt lo, PetscInt hi, Line *l)
{
  const PetscInt mid = (lo + hi) / 2;
  PetscReal of[2];
  PetscBool right;

  if (least > l->off) return;
  for (PetscInt k = lo; k < hi && hi - lo <= HYCO_LEAF; k++) TryAlong(s, s->item[k].index, l);
  if (hi - lo <= HYCO_LEAF) return;
  for (PetscInt child = 0; child < 2; child++) of[child] = LeastOff(s, 2 * t + 1 + child, l);
  /* The child with the smaller bound first: the other one is then mostly skipped. */
  right = (PetscBool)(of[1] < of[0]);
  for (PetscInt child = 0; child < 2; child++, right = (PetscBool)!right)
    SearchAlong(s, 2 * t + 1 + right, of[right], right ? mid : lo, right ? hi : mid, l);
}

/* The node nearest to the line from x along the mean of its normal `out` and the node's reversed normal, within `small`
   of it (length); p->n = 0: none. Matches mirrored surfaces at any distance. `off` is squared: distances from the line
   are compared without roots. */
void HycoPatchesAlongLine(HycoPatches s, const PetscReal x[3], const PetscReal out[3], PetscReal small,
                          HycoProjection *p)
{
  Line line = {.x = x, .out = out, .off = small * small, .patch = -1};

  SearchAlong(s, 0, PETSC_MIN_REAL, 0, s->n, &line);
  p->n = 0;
  if (line.patch < 0) return;
  *p = (HycoProjection){1, {s->node[line.patch]}, line.patch, {1}, PetscSqrtReal(line.rr)};
}
