/*
  HycoSamples: points spread over a box. Inside they follow a sequence that fills it evenly; a share of them lies at its
  corners and on its faces, where models fail in ways that no point inside shows.

  Scattered points follow Halton's sequence over the parameters' ranges. Unseen points, by which a model is judged, are
  distributed over the region covered by a set of training points, by an additive recurrence: coordinate j of point k is
  the fractional part of 1/2 + k phi^-(j+1), with phi the root of phi^(d+1) = phi + 1 (M. Roberts' generalisation of the
  golden ratio to d dimensions). Every part of this sequence is evenly distributed, and it can be continued.
*/
#include <hycoalgorithms.h>
#include <hycosceneimpl.h>

#define FEW_PARAMETERS 3       /* parameters of which scattered points have the corners twice as soon */
#define MOST           15      /* more dimensions have too many corners to count */
#define BETWEEN        1000003 /* distance of the parts of a sequence that are used for different places */

/* The places of successive points or groups; with few parameters, scattered points have corners AGAIN, else inside. */
typedef enum { INSIDE, CORNER, FACE, AGAIN, N_PLACES } Place;

/* Dimensions of the box: those with a range; the first n_lead are shared by a group of points. */
typedef struct {
  PetscInt n, n_lead, of[HYCO_MAX_PARAMETERS];
} Axes;

/* Those of shared[] first (NULL: every one is); if they are all or none, every point is a group of its own. */
static void FindAxes(PetscInt n_par, const PetscReal lo[], const PetscReal hi[], const PetscBool shared[], Axes *axes)
{
  *axes = (Axes){0};
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt p = 0; p < n_par; p++) {
      if (lo[p] < hi[p] && (shared && shared[p]) == (pass == 0)) axes->of[axes->n++] = p;
    }
    if (pass == 0) axes->n_lead = axes->n;
  }
  if (!axes->n_lead) axes->n_lead = axes->n;
}

/* The number of corners of dim dimensions. */
static PetscInt HoldoutCorners(PetscInt dim)
{
  return (PetscInt)1 << PetscMin(dim, MOST);
}

/* Corner k of dim dimensions, a bit for each, in an order that spreads them: each even one is followed by its
   opposite. */
static PetscInt HoldoutCorner(PetscInt dim, PetscInt k)
{
  const PetscInt half = PetscMax(HoldoutCorners(dim) / 2, 1), step = (PetscInt)(0.618 * (PetscReal)half) | 1,
                 pair = k / 2 * step % half;

  return k % 2 ? 2 * half - 1 - pair : pair;
}

/* Moves the point to corner k of the axes from .. to-1. */
static void PutAtCorner(const Axes *axes, PetscInt from, PetscInt to, PetscInt k, const PetscReal lo[],
                        const PetscReal hi[], PetscReal point[])
{
  const PetscInt bits = HoldoutCorner(to - from, k % HoldoutCorners(to - from));

  for (PetscInt j = from; j < to; j++) {
    const PetscInt p = axes->of[j];

    point[p] = bits >> (j - from) % MOST & 1 ? hi[p] : lo[p];
  }
}

/* Moves the point to face k, of which successive ones belong to different axes; within a group to both ends of an axis
   that the group does not share. */
static void PutOnFace(const Axes *axes, PetscInt k, PetscInt member, const PetscReal lo[], const PetscReal hi[],
                      PetscReal point[])
{
  const PetscInt j = k % axes->n, p = axes->of[j], end = k / axes->n + (j >= axes->n_lead ? member : 0);

  point[p] = end % 2 ? hi[p] : lo[p];
}

/* Halton's sequence, dense in the ranges after any number of points, so that more points extend a set instead of
   replacing it. Inner points alone would leave the boundary of the box, on which errors are largest, to
   extrapolation: hence the turns of corners and faces. When all corners are there their turns go to inner points.
   */
PetscErrorCode HycoSamplesAddScattered(HycoSamples samples, PetscInt count)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt n_par, n_inside = 0, n_corners = 0, n_faces = 0;
  HycoScene s;
  Axes axes;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, NULL, &n_par, NULL));
  PetscCall(HycoSamplesGetScene(samples, &s));
  HycoCheckValue(count >= 1 && count <= 100000000, "%d scattered points; 1 to 100 million are expected", (int)count);
  FindAxes(n_par, s->lo, s->hi, NULL, &axes);
  for (PetscInt k = 0; k < count; k++) {
    const Place place = (Place)(k % N_PLACES);
    /* On a single axis a face is a corner. */
    const PetscBool face = (PetscBool)(place == FACE && axes.n > 1),
                    corner = (PetscBool)((place == CORNER || (place == AGAIN && axes.n <= FEW_PARAMETERS)) &&
                                         n_corners < HoldoutCorners(axes.n));
    /* Each face has its own part of the sequence, else points on neighbouring faces would be projections of each
       other. */
    const PetscInt faces = 2 * axes.n, number = face ? n_faces / faces + n_faces % faces * BETWEEN : n_inside;

    for (PetscInt p = 0; p < n_par; p++) mu[p] = HycoSceneBetween(s, p, s->lo[p], s->hi[p], HycoHalton(1 + number, p));
    if (corner)
      PutAtCorner(&axes, 0, axes.n, n_corners++, s->lo, s->hi, mu);
    else if (face)
      PutOnFace(&axes, n_faces++, 0, s->lo, s->hi, mu);
    else
      n_inside++;
    PetscCall(HycoSamplesAddPoint(samples, mu));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lo, hi: half a step beyond the outermost training values, within the ranges. step: the largest gap between
   values of a parameter; 1e-9 so that the middle of two is inside. */
PetscErrorCode HycoSamplesReach(HycoScene s, PetscInt n, const PetscReal mu[], PetscReal lo[], PetscReal hi[])
{
  const PetscInt n_par = s->n_parameters;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &value));
  for (PetscInt p = 0; p < n_par; p++) {
    PetscReal step = 0;

    for (PetscInt k = 0; k < n; k++) value[k] = mu[k * n_par + p];
    PetscCall(PetscSortReal(n, value));
    for (PetscInt k = 1; k < n; k++) step = PetscMax(step, value[k] - value[k - 1]);
    /* Beyond half a step from the outermost value a point is no longer among the trained ones, and errors there say
       nothing about the training. */
    step = 0.5 * step * (1 + 1e-9);
    /* Never outside the ranges: the model refuses such parameters. */
    lo[p] = n ? PetscMax(s->lo[p], value[0] - step) : s->lo[p];
    hi[p] = n ? PetscMin(s->hi[p], value[n - 1] + step) : s->hi[p];
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The root of x^(dim + 1) = x + 1 that is greater than 1. The iteration contracts: 60 steps reach round-off for
   any dimension. */
static PetscReal HoldoutRatio(PetscInt dim)
{
  PetscReal x = 2;

  for (PetscInt k = 0; k < 60; k++) x = PetscPowReal(1 + x, 1 / (PetscReal)(dim + 1));
  return x;
}

/* Coordinate j of point k, in dim dimensions. */
static PetscReal HoldoutCoordinate(PetscInt dim, PetscInt j, PetscInt k)
{
  const PetscReal x = 0.5 + (PetscReal)k * PetscPowReal(HoldoutRatio(dim), -(PetscReal)(j + 1));

  return x - PetscFloorReal(x);
}

/* Exactly equal: training points and those of a repeated run are the same numbers. */
static PetscErrorCode HoldoutContains(PetscInt n, PetscInt n_par, const PetscReal mu[], const PetscReal point[],
                                      PetscBool *has)
{
  PetscFunctionBegin;
  *has = PETSC_FALSE;
  for (PetscInt k = 0; k < n && !*has; k++) PetscCall(PetscArraycmp(mu + k * n_par, point, n_par, has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unseen points as they are drawn. */
typedef struct {
  HycoScene scene;
  HycoSamples seen, drawn;
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS];
  Axes axes;
  PetscInt n_par, together, corner; /* corner: that of the group's shared axes; -1: none is left */
} Drawing;

/* Whether training has the point, or it was drawn already. */
static PetscErrorCode IsTaken(const Drawing *d, const PetscReal point[], PetscBool *taken)
{
  PetscInt n, m;
  const PetscReal *mu, *nu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(d->seen, &n, NULL, &mu));
  PetscCall(HycoSamplesGet(d->drawn, &m, NULL, &nu));
  PetscCall(HoldoutContains(n, d->n_par, mu, point, taken));
  if (!*taken) PetscCall(HoldoutContains(m, d->n_par, nu, point, taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the axes that a group does not share to the first of their corners that is not taken. Corners that
   training has say nothing about unseen points. */
static PetscErrorCode SeekCorner(const Drawing *d, PetscReal point[], PetscBool *found)
{
  const Axes *axes = &d->axes;
  PetscBool taken = PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < HoldoutCorners(axes->n - axes->n_lead) && taken; k++) {
    /* The leading axes, which the group shares, keep the values that point[] has. */
    PutAtCorner(axes, axes->n_lead, axes->n, k, d->lo, d->hi, point);
    PetscCall(IsTaken(d, point, &taken));
  }
  *found = (PetscBool)!taken;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds a corner of the shared axes, from number `first` on, that has one which is not taken. d->corner is -1 if
   training and earlier draws have all of them. */
static PetscErrorCode SeekGroupCorner(Drawing *d, PetscInt first)
{
  const PetscInt n = HoldoutCorners(d->axes.n_lead);
  PetscReal point[HYCO_MAX_PARAMETERS];
  PetscBool found = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(point, d->lo, d->n_par));
  d->corner = -1;
  for (PetscInt k = 0; k < n && !found; k++) {
    /* Cyclic from `first`, so that successive groups begin at different corners and all are used before one is
       repeated. */
    PutAtCorner(&d->axes, 0, d->axes.n_lead, (first + k) % n, d->lo, d->hi, point);
    PetscCall(SeekCorner(d, point, &found));
    if (found) d->corner = (first + k) % n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Point k of the sequence inside the part for its place, after `turn` points that were taken. */
static void HoldoutRecur(const Drawing *d, PetscInt k, PetscInt turn, PetscReal point[])
{
  const PetscInt group = k / d->together, place = group % N_PLACES, round = group / N_PLACES, faces = 2 * d->axes.n;
  const PetscInt number = place == INSIDE   ? 2 * round
                          : place == AGAIN  ? 2 * round + 1
                          : place == CORNER ? BETWEEN + round
                                            : (2 + round % faces) * BETWEEN + round / faces; /* a part for each face */

  for (PetscInt p = 0; p < d->n_par; p++) point[p] = d->lo[p];
  for (PetscInt j = 0; j < d->axes.n; j++) {
    const PetscInt p = d->axes.of[j], n = j < d->axes.n_lead ? number : number * d->together + k % d->together;
    /* Within a group the shared axes stay: they cost a factor. */
    const PetscInt later = j < d->axes.n_lead && d->axes.n_lead < d->axes.n ? 0 : 3 * turn * BETWEEN;

    point[p] = HycoSceneBetween(d->scene, p, d->lo[p], d->hi[p], HoldoutCoordinate(d->n_par, p, 1 + n + later));
  }
}

/* Draws point k. */
static PetscErrorCode HoldoutDraw(const Drawing *d, PetscInt k, PetscReal point[])
{
  const PetscInt group = k / d->together, place = group % N_PLACES;
  const PetscBool corner = (PetscBool)(place == CORNER && d->corner >= 0),
                  face = (PetscBool)(place == FACE && d->axes.n > 1);
  PetscBool taken = PETSC_TRUE;

  PetscFunctionBegin;
  /* A corner whose free corners are all taken falls through to the sequence below, at the corner's shared axes only. */
  if (corner) {
    PetscBool found;

    HoldoutRecur(d, k, 0, point);
    PutAtCorner(&d->axes, 0, d->axes.n_lead, d->corner, d->lo, d->hi, point);
    PetscCall(SeekCorner(d, point, &found));
    if (found) PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* turn moves along the sequence until a point is new; the low-discrepancy sequence never ends, so the loop does. */
  for (PetscInt turn = 0; taken; turn++) {
    HoldoutRecur(d, k, turn, point);
    if (corner) PutAtCorner(&d->axes, 0, d->axes.n_lead, d->corner, d->lo, d->hi, point);
    if (face && (!turn || group / N_PLACES % d->axes.n < d->axes.n_lead)) /* else its value is the only free one */
      PutOnFace(&d->axes, group / N_PLACES, k % d->together, d->lo, d->hi, point);
    PetscCall(IsTaken(d, point, &taken));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points first .. first + count - 1 of the sequence: continued, it gives the same points as if drawn at once.
   slow[]: parameters that change the stiffness, of which `together` points share a value. The caller owns *unseen,
   also after an error. */
PetscErrorCode HycoSamplesOutsideTraining(HycoSamples samples, PetscInt first, PetscInt count, PetscInt together,
                                          const PetscBool slow[], HycoSamples *unseen)
{
  Drawing d = {.seen = samples, .together = together, .corner = -1};
  PetscReal point[HYCO_MAX_PARAMETERS];
  PetscInt n;
  const PetscReal *mu;
  PetscBool point_alone = PETSC_TRUE;
  HycoScene scene;

  PetscFunctionBegin;
  HycoCheckGiven(unseen);
  HycoCheckValue(first >= 0 && count >= 0 && together >= 1,
                 "held-out points from %d, %d of them, %d together; at least 0, 0 and 1 are expected", (int)first,
                 (int)count, (int)together);
  PetscCall(HycoSamplesGet(samples, &n, &d.n_par, &mu));
  PetscCall(HycoSamplesGetScene(samples, &scene));
  d.scene = scene;
  /* Within the training's reach: the drawn points are to judge interpolation, which is all that a model promises. The
     reach of one point has no other: within the ranges. */
  PetscCall(HycoSamplesReach(scene, n, mu, d.lo, d.hi));
  for (PetscInt p = 0; p < d.n_par; p++) point_alone = (PetscBool)(point_alone && d.lo[p] == d.hi[p]);
  for (PetscInt p = 0; p < d.n_par && point_alone; p++) {
    d.lo[p] = scene->lo[p];
    d.hi[p] = scene->hi[p];
  }
  PetscCall(HycoSamplesCreate(scene, unseen));
  d.drawn = *unseen;
  FindAxes(d.n_par, d.lo, d.hi, slow, &d.axes);
  /* If every axis is slow a group would consist of one point drawn repeatedly. */
  if (d.axes.n_lead == d.axes.n) d.together = 1;
  for (PetscInt k = first; d.axes.n && k < first + count; k++) {
    const PetscInt group = k / d.together;

    /* Also at the first point when continued in the middle of a group, whose corner is then found again. */
    if (group % N_PLACES == CORNER && (k % d.together == 0 || k == first))
      PetscCall(SeekGroupCorner(&d, group / N_PLACES));
    PetscCall(HoldoutDraw(&d, k, point));
    PetscCall(HycoSamplesAddPoint(*unseen, point));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both sets are of one scene: their points have the same components in the same order. A point in both occurs
   twice. */
PetscErrorCode HycoSamplesAddSet(HycoSamples samples, HycoSamples other)
{
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(other, &n, &n_par, &mu));
  for (PetscInt k = 0; k < n; k++) PetscCall(HycoSamplesAddPoint(samples, mu + k * n_par));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The caller owns *rest. */
PetscErrorCode HycoSamplesExcept(HycoSamples samples, HycoSamples seen, HycoSamples *rest)
{
  PetscInt n, m, n_par;
  const PetscReal *mu, *other;
  HycoScene scene;
  PetscBool twin;

  PetscFunctionBegin;
  HycoCheckGiven(rest);
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  PetscCall(HycoSamplesGet(seen, &m, NULL, &other));
  PetscCall(HycoSamplesGetScene(samples, &scene));
  PetscCall(HycoSamplesCreate(scene, rest));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HoldoutContains(m, n_par, other, mu + k * n_par, &twin));
    /* Points are compared exactly: files keep all digits of what was trained. */
    if (!twin) PetscCall(HycoSamplesAddPoint(*rest, mu + k * n_par));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
