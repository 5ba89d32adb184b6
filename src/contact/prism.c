/* The patches near a facet, in the tree of the nearest points: those that a prism along the facet's normal may meet. */
#include "nearest.h"
#include <hycovector.h>

/* Whether a box may meet the prism, by the ball around the box. */
static PetscBool MayMeet(const HycoBox *b, const HycoPrism *p)
{
  PetscReal r[3], half[3], along, radius;

  for (PetscInt c = 0; c < 3; c++) {
    r[c] = (b->lo[c] + b->hi[c]) / 2 - p->centre[c];
    half[c] = (b->hi[c] - b->lo[c]) / 2;
  }
  radius = HycoLength(half);
  along = HycoDot(r, p->normal);
  /* Along the normal and across it, each with the ball's radius: cheap and never too small. */
  if (PetscAbsReal(along) > p->along + radius) return PETSC_FALSE;
  return (PetscBool)(HycoTangentialLength(r, p->normal) <= p->radius + radius);
}

/* No order and no exact test: the caller cuts polygons anyway, and a missed patch would be an error. */
static void PrismCollect(HycoPatches s, PetscInt t, PetscInt lo, PetscInt hi, const HycoPrism *p, PetscInt *n,
                         PetscInt patch[])
{
  const PetscInt mid = (lo + hi) / 2;

  if (!MayMeet(&s->box[t], p)) return;
  if (hi - lo > HYCO_LEAF) {
    PrismCollect(s, 2 * t + 1, lo, mid, p, n, patch);
    PrismCollect(s, 2 * t + 2, mid, hi, p, n, patch);
    return;
  }
  for (PetscInt k = lo; k < hi; k++) patch[(*n)++] = s->item[k].index;
}

/* Ascending: sums over them do not depend on the tree. */
PetscErrorCode HycoPatchesWithin(HycoPatches s, const HycoPrism *prism, PetscInt *n, PetscInt patch[])
{
  PetscFunctionBegin;
  *n = 0;
  PrismCollect(s, 0, 0, s->n, prism, n, patch);
  PetscCall(PetscSortInt(*n, patch));
  PetscFunctionReturn(PETSC_SUCCESS);
}
