/* The search for masters: its points are those without a tree, and those with fewer patches that contain them; pairs along
   the normals. */
#include "check.h"
#include "master_search.h"
#include <hycovector.h>

#define MOST_PATCHES 5000
#define N_SLAVES     1500

static unsigned long long state = 7;

/* A master of nf nodes a patch and its slaves. */
typedef struct {
  PetscReal X[3 * (2 * MOST_PATCHES + N_SLAVES)], outward[3 * (2 * MOST_PATCHES + N_SLAVES)], normal[3 * MOST_PATCHES];
  PetscInt node[4 * MOST_PATCHES], slave[N_SLAVES];
  HycoMasterSearch t;
} Surfaces;

static PetscInt AddNode(Surfaces *s, PetscReal x, PetscReal y, PetscReal z)
{
  PetscReal *X = s->X + 3 * s->t.n_nodes;

  X[0] = x;
  X[1] = y;
  X[2] = z;
  return s->t.n_nodes++;
}

static void AddPatch(Surfaces *s, PetscInt a, PetscInt b, PetscInt c, PetscInt d, PetscReal up)
{
  const PetscInt node[4] = {a, b, c, d};

  for (PetscInt k = 0; k < s->t.nf; k++) s->node[s->t.nf * s->t.n + k] = node[k];
  s->normal[3 * s->t.n++ + 2] = up;
}

/* A wavy strip of `along` x across cells, at a height: quadrilaterals, triangles, segments or points. */
static void AddStrip(Surfaces *s, PetscInt along, PetscInt across, PetscReal height, PetscReal up)
{
  const PetscInt first = s->t.n_nodes, wide = across + 1;

  for (PetscInt i = 0; i <= along; i++) {
    for (PetscInt j = 0; j <= across; j++)
      AddNode(s, i + 0.2 * Draw(&state), j + 0.2 * Draw(&state), height + 0.3 * Draw(&state));
  }
  for (PetscInt i = 0; i < along; i++) {
    for (PetscInt j = 0; j < across; j++) {
      const PetscInt a = first + i * wide + j, b = a + wide, c = b + 1, d = a + 1;

      AddPatch(s, a, b, c, d, up);
      if (s->t.nf == 3) AddPatch(s, a, c, d, d, up);
    }
  }
}

/* Slaves at the strip's nodes, near it and high above, and past its ends; some face away, one in ten has no normal. */
static void AddSlaves(Surfaces *s, PetscInt n_master, PetscReal along, PetscReal across)
{
  for (PetscInt k = 0; k < N_SLAVES; k++) {
    const PetscReal *at = s->X + 3 * (k * 7 % n_master);
    const PetscReal x = (0.55 * Draw(&state) + 0.5) * along, y = (0.6 * Draw(&state) + 0.5) * across;

    s->slave[k] = k % 3 ? AddNode(s, x, y, (k % 3 > 1 ? 5 : 0.5) * Draw(&state)) : AddNode(s, at[0], at[1], at[2]);
    s->outward[3 * s->slave[k] + 2] = k % 10 == 0 ? 0 : k % 10 == 1 ? 1 : -1;
  }
}

/* Two strips on each other, of which one faces away, and their slaves. */
static void Draws(Surfaces *s, PetscInt nf, PetscInt along, PetscInt across)
{
  memset(s, 0, sizeof(*s));
  s->t = (HycoMasterSearch){.nf = nf, .node = s->node, .normal = s->normal, .outward = s->outward, .X = s->X};
  AddStrip(s, along, across, 0, 1);
  AddStrip(s, along, across, -0.4, -1);
  AddSlaves(s, s->t.n_nodes, along, across);
}

/* The same points, to the bit; where a slave has no master (n = 0) nothing else counts. */
static PetscBool Same(const HycoProjection *p, const HycoProjection *q)
{
  if (p->n != q->n) return PETSC_FALSE;
  for (PetscInt a = 0; a < p->n; a++) {
    if (p->node[a] != q->node[a] || p->weight[a] != q->weight[a]) return PETSC_FALSE;
  }
  return (PetscBool)(!p->n || (p->patch == q->patch && p->distance == q->distance));
}

/* The least distance of the patches, one by one. */
static PetscErrorCode Nearest(const Surfaces *s, const PetscReal x[3], PetscReal *distance)
{
  PetscFunctionBegin;
  *distance = PETSC_MAX_REAL;
  for (PetscInt k = 0; k < s->t.n; k++) {
    HycoPatches one;
    HycoProjection p;

    PetscCall(HycoPatchesCreate(s->X, 1, s->t.nf, s->t.nf, s->node + k * s->t.nf, NULL, &one));
    HycoPatchesProject(one, x, NULL, &p);
    PetscCall(HycoPatchesDestroy(&one));
    *distance = PetscMin(*distance, p.distance);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both kinds of query at all slaves, and at each alone on the patches that are not farther from it than its nearest
   point; n_why[]: how often each verdict occurs. */
static PetscErrorCode Compare(Surfaces *s, PetscInt n_why[])
{
  static HycoProjection all[N_SLAVES];
  static HycoVerdict why[N_SLAVES];
  static PetscInt node[4 * MOST_PATCHES], number[MOST_PATCHES];
  static PetscReal normal[3 * MOST_PATCHES];

  PetscFunctionBegin;
  for (PetscInt moved = 0; moved < 2; moved++) {
    const HycoQuery query = {.moved = (PetscBool)moved, .tolerance = 0.3, .small = 1e-3};

    PetscCall(HycoMasterSearchFind(&s->t, &query, N_SLAVES, s->slave, all, why));
    for (PetscInt k = 0; k < N_SLAVES; k++) {
      HycoMasterSearch few = s->t;
      HycoProjection at, any;
      HycoVerdict here;

      n_why[why[k]]++;
      if (k % 30) continue;
      HycoMasterSearchProject(&s->t, s->slave[k], PETSC_TRUE, &any);
      few.patches = NULL;
      few.node = node;
      few.normal = normal;
      few.n = few.n_border = 0;
      few.border = NULL;
      few.at_border = NULL;
      for (PetscInt f = 0; f < s->t.n; f++) { /* not farther: by the distances of its nodes and their spread */
        const PetscReal *x = s->X + 3 * s->slave[k], *first = s->X + 3 * s->node[f * s->t.nf];

        if (HycoDistance(x, first) > any.distance + 3) continue;
        number[few.n] = f;
        PetscCall(PetscArraycpy(node + few.n * s->t.nf, s->node + f * s->t.nf, s->t.nf));
        PetscCall(PetscArraycpy(normal + 3 * few.n++, s->normal + 3 * f, 3));
      }
      PetscCall(HycoMasterSearchFind(&few, &query, 1, &s->slave[k], &at, &here));
      at.patch = at.n ? number[at.patch] : 0;
      CHECK(here == why[k] && Same(&all[k], &at),
            "nf %d, slave %d: verdict %d, distance %.17g; of all patches %d, %.17g", (int)s->t.nf, (int)k, (int)here,
            (double)at.distance, (int)why[k], (double)all[k].distance);
      PetscCall(HycoMasterSearchForget(&few));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The distance of the nearest point is that without a tree. */
static PetscErrorCode CompareNearest(Surfaces *s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < N_SLAVES; k += 100) {
    HycoProjection at;
    PetscReal distance;

    HycoMasterSearchProject(&s->t, s->slave[k], PETSC_TRUE, &at);
    PetscCall(Nearest(s, s->X + 3 * s->slave[k], &distance));
    CHECK(at.distance == distance, "slave %d: %.17g, without a tree %.17g", (int)k, (double)at.distance,
          (double)distance);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points are those of fewer patches, and those without a tree. */
static PetscErrorCode TestSame(Surfaces *s)
{
  PetscInt n_why[HYCO_PAST + 1] = {0};

  PetscFunctionBegin;
  for (PetscInt nf = 1; nf <= 4; nf++) {
    for (PetscInt shape = 0; shape < 2; shape++) {
      Draws(s, nf, shape ? 30 : 200, shape ? 30 : 3);
      PetscCall(Compare(s, n_why));
      PetscCall(CompareNearest(s));
      PetscCall(HycoMasterSearchForget(&s->t));
    }
  }
  for (PetscInt w = 0; w <= HYCO_PAST; w++) CHECK(n_why[w] > 0, "the verdict %d does not occur", (int)w);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all points, the one closest to the line along the mean of both normals. */
static PetscInt FindAlong(const Surfaces *s, const PetscReal x[3], const PetscReal out[3], PetscReal small)
{
  PetscReal least = small * small;
  PetscInt found = -1;

  for (PetscInt k = 0; k < s->t.n; k++) {
    const PetscReal *n = s->normal + 3 * k, *X = s->X + 3 * s->node[k];
    const PetscReal r[3] = {X[0] - x[0], X[1] - x[1], X[2] - x[2]};
    const PetscReal mean[3] = {out[0] - n[0], out[1] - n[1], out[2] - n[2]};
    const PetscReal along = HycoDot(r, mean), mm = HycoDot(mean, mean);
    const PetscReal off = PetscMax(HycoDot(r, r) - along * along / mm, 0);

    if (mm < 1e-2 || off > least) continue;
    least = off;
    found = k;
  }
  return found;
}

/* Pairs along the normals of two tubes, whatever their distance: as without a tree. */
static PetscErrorCode TestAlong(Surfaces *s)
{
  HycoPatches tube;
  PetscInt n_found = 0;

  PetscFunctionBegin;
  memset(s, 0, sizeof(*s));
  s->t = (HycoMasterSearch){.nf = 1};
  for (PetscInt k = 0; k < MOST_PATCHES; k++) {
    const PetscReal turn = 3 * Draw(&state), n[3] = {PetscCosReal(turn), PetscSinReal(turn), 0.1 * Draw(&state)};

    AddNode(s, 5 * n[0] + 0.1 * Draw(&state), 5 * n[1], 20 * Draw(&state));
    AddPatch(s, k, 0, 0, 0, 0);
    for (PetscInt c = 0; c < 3; c++) s->normal[3 * k + c] = -n[c];
    HycoNormalise(s->normal + 3 * k);
  }
  PetscCall(HycoPatchesCreate(s->X, s->t.n, 1, 1, s->node, s->normal, &tube));
  for (PetscInt k = 0; k < 300; k++) {
    const PetscReal turn = 3 * Draw(&state), out[3] = {PetscCosReal(turn), PetscSinReal(turn), 0};
    const PetscReal x[3] = {4 * out[0], 4 * out[1], 20 * Draw(&state)};
    const PetscInt right = FindAlong(s, x, out, 0.2);
    HycoProjection at;

    HycoPatchesAlongLine(tube, x, out, 0.2, &at);
    CHECK(at.n == (right >= 0) && (!at.n || at.patch == right), "point %d, without a tree %d", (int)at.patch,
          (int)right);
    n_found += at.n;
  }
  CHECK(n_found > 100 && n_found < 300, "%d of 300 have a point", (int)n_found);
  PetscCall(HycoPatchesDestroy(&tube));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  Surfaces *s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  PetscCall(TestSame(s));
  PetscCall(TestAlong(s));
  PetscCall(PetscFree(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
