/* Facets of second order: the nearest point against the best of many, its weights, the box around the facet. */
#include "check.h"
#include "../../src/contact/curved.h"
#include <hycofe.h>
#include <hycovector.h>

/* Sample points in each direction of the reference facet. */
#define SAMPLES 60

typedef struct {
  const char *name;
  PetscInt nf, corners;
  PetscReal node[HYCO_FACET_NODES][2]; /* places of the nodes in the reference facet */
} Kind;

static const Kind kinds[] = {
    {"line", 3, 2, {{-1, 0}, {1, 0}, {0, 0}}},
    {"tri6", 6, 3, {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}}},
    {"quad8", 8, 4, {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}}},
    {"quad9", 9, 4, {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}, {0, 0}}},
};

/* The sample number k of the reference facet; false: none. */
static PetscBool Sample(const Kind *kind, PetscInt k, PetscReal at[2])
{
  const PetscInt i = k % (SAMPLES + 1), j = k / (SAMPLES + 1);

  at[0] = i / (PetscReal)SAMPLES;
  at[1] = j / (PetscReal)SAMPLES;
  if (kind->corners == 3) return (PetscBool)(i + j <= SAMPLES);
  for (PetscInt d = 0; d < 2; d++) at[d] = 2 * at[d] - 1;
  return (PetscBool)(kind->corners == 4 || j == 0);
}

static void Place(const HycoCurved *f, const PetscReal w[], PetscReal x[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    x[c] = 0;
    for (PetscInt a = 0; a < f->nf; a++) x[c] += w[a] * f->X[a][c];
  }
}

/* A facet whose sides are bent by up to a sixth of their length. */
static void Bend(const Kind *kind, unsigned long long *state, PetscReal X[HYCO_FACET_NODES][3], HycoCurved *f)
{
  f->nf = kind->nf;
  f->corners = kind->corners;
  for (PetscInt a = 0; a < kind->nf; a++) {
    for (PetscInt c = 0; c < 3; c++) X[a][c] = (c < 2 ? kind->node[a][c] : 0) + 0.15 * Draw(state);
    f->X[a] = X[a];
  }
}

/* No sample is nearer than the point found, which is that of its weights; a point of the facet is found itself. */
static void CheckFacet(const Kind *kind, const HycoCurved *f, const PetscReal x[3])
{
  PetscReal w[HYCO_FACET_NODES], N[HYCO_FACET_NODES], dN[HYCO_FACET_NODES][3], at[2], p[3], lo[3], hi[3],
      sum = 0, best = PETSC_MAX_REAL;
  const PetscReal found = PetscSqrtReal(HycoCurvedProject(f, x, w));

  HycoCurvedBox(f, lo, hi);
  for (PetscInt a = 0; a < f->nf; a++) sum += w[a];
  CHECK_NEAR(sum, 1, 1e-13);
  Place(f, w, p);
  CHECK_NEAR(HycoDistance(p, x), found, 1e-13);
  for (PetscInt k = 0; k < (SAMPLES + 1) * (SAMPLES + 1); k++) {
    if (!Sample(kind, k, at)) continue;
    HycoFacetFunctions(f->nf, at, N, dN);
    Place(f, N, p);
    best = PetscMin(best, HycoDistance(p, x));
    for (PetscInt c = 0; c < 3; c++)
      CHECK(lo[c] <= p[c] + 1e-14 && p[c] <= hi[c] + 1e-14, "%s: the point is in the box", kind->name);
    if (k % 97) continue;
    CHECK_NEAR(HycoCurvedProject(f, p, w), 0, 1e-24);
    for (PetscInt a = 0; a < f->nf; a++) CHECK_NEAR(w[a], N[a], 1e-10);
  }
  CHECK(found <= best + 1e-12, "%s: a point is at %.17g, found %.17g", kind->name, (double)best, (double)found);
  CHECK(found >= best - 0.1, "%s: the nearest sample is at %.17g, found %.17g", kind->name, (double)best,
        (double)found);
}

/* Straight sides: the box is that of the corners. */
static void CheckFlat(const Kind *kind)
{
  PetscReal X[HYCO_FACET_NODES][3] = {{0}}, lo[3], hi[3];
  HycoCurved f = {kind->nf, kind->corners, {NULL}};

  for (PetscInt a = 0; a < kind->nf; a++) {
    for (PetscInt c = 0; c < 2; c++) X[a][c] = kind->node[a][c];
    f.X[a] = X[a];
  }
  HycoCurvedBox(&f, lo, hi);
  CHECK_NEAR(lo[0], kind->corners == 3 ? 0 : -1, 0);
  CHECK_NEAR(hi[0], 1, 0);
  CHECK_NEAR(hi[2] - lo[2], 0, 0);
}

static PetscErrorCode Test(void)
{
  unsigned long long state = 5;

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(kinds) / sizeof(*kinds); k++) {
    CheckFlat(&kinds[k]);
    for (PetscInt a = 0; a < kinds[k].nf; a++) { /* a node's function is 1 there and the others are 0 */
      PetscReal N[HYCO_FACET_NODES], dN[HYCO_FACET_NODES][3];

      HycoFacetFunctions(kinds[k].nf, kinds[k].node[a], N, dN);
      for (PetscInt b = 0; b < kinds[k].nf; b++) CHECK_NEAR(N[b], a == b, 1e-15);
    }
    for (PetscInt trial = 0; trial < 200; trial++) {
      PetscReal X[HYCO_FACET_NODES][3], x[3];
      HycoCurved f;

      Bend(&kinds[k], &state, X, &f);
      for (PetscInt c = 0; c < 3; c++) x[c] = (c < 2 ? 1.5 : 0.3) * Draw(&state);
      CheckFacet(&kinds[k], &f, x);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
