/* The factor of semismooth Newton's method that is kept along a path (HycoConeFactor), with Coulomb's law in 2D: the
   forces are those of a new factor at each step, and after HycoConeFactorForget() those of another matrix. Contacts on a
   plane of symmetry, without tangential flexibility, leave the step regular. */
#include "check.h"
#include "semismooth.h"
#include <hycoconeimpl.h>
#include <hycolcp.h>
#include <math.h>

#define CONTACTS 40
#define ROWS     (2 * CONTACTS)
#define STEPS    30

typedef struct {
  PetscReal M[ROWS * ROWS], q[ROWS];
} Problem;

/* M = 1 + (smooth kernel of the distance, in both components), symmetric and positive definite: diagonally dominant. */
static void Fill(Problem *p, PetscReal width)
{
  for (PetscInt j = 0; j < ROWS; j++) {
    for (PetscInt i = 0; i < ROWS; i++) {
      const PetscReal away = PetscAbsReal((PetscReal)(i / 2 - j / 2)) / width;

      p->M[j * ROWS + i] = (i == j) + (i % 2 == j % 2 ? 0.05 : 0.01) * PetscExpReal(-away);
    }
  }
}

/* A pressure, and a shear that is applied and reversed: the zones of slip grow and vanish. */
static void Load(Problem *p, PetscInt step)
{
  const PetscReal shear = sin(0.3 * step);

  for (PetscInt k = 0; k < CONTACTS; k++) {
    const PetscReal x = (2. * k + 1) / CONTACTS - 1;

    p->q[2 * k] = 0.5 * x * x * 4 - 1;
    p->q[2 * k + 1] = 0.4 * shear * (1 + x);
  }
}

static PetscErrorCode Solve(const Problem *p, HycoBlocks *blocks, HycoConeFactor factor, PetscReal z[], PetscInt *its)
{
  const HycoLCP lcp = {.n = ROWS, .M = p->M, .q = p->q, .symmetric = PETSC_TRUE, .blocks = blocks, .cone = factor};
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(HycoLCPSemismooth(&lcp, z, its, &status));
  CHECK(status == HYCO_LCP_SOLVED, "status %d", (int)status);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Difference(const PetscReal a[], const PetscReal b[])
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < ROWS; i++) most = PetscMax(most, PetscAbsReal(a[i] - b[i]));
  return most;
}

/* States of both kinds occur and change, so that the updates are used; contacts that open have no force, exactly. */
static PetscErrorCode TestPath(Problem *p, HycoBlocks *blocks, HycoConeFactor factor)
{
  PetscReal kept[ROWS] = {0}, fresh[ROWS] = {0};
  PetscInt n_open = 0, n_slip = 0, n_stick = 0;

  PetscFunctionBegin;
  for (PetscInt step = 0; step < STEPS; step++) {
    PetscInt its;

    Load(p, step);
    PetscCall(Solve(p, blocks, factor, kept, &its));
    PetscCall(Solve(p, blocks, NULL, fresh, &its));
    CHECK(Difference(kept, fresh) < 1e-12, "step %d: %g, forces of the size of 1", (int)step,
          (double)Difference(kept, fresh));
    for (PetscInt k = 0; k < CONTACTS; k++) {
      const PetscReal radius = 0.3 * kept[2 * k];

      CHECK(kept[2 * k] == 0 || kept[2 * k] > 1e-9, "step %d: contact %d has the force %g", (int)step, (int)k,
            (double)kept[2 * k]);
      n_open += kept[2 * k] == 0;
      n_slip += radius > 0 && PetscAbsReal(kept[2 * k + 1]) > radius * (1 - 1e-9);
      n_stick += radius > 0 && PetscAbsReal(kept[2 * k + 1]) < radius * (1 - 1e-9);
    }
  }
  CHECK(n_open > STEPS && n_slip > STEPS && n_stick > STEPS, "%d open, %d slip, %d stick", (int)n_open, (int)n_slip,
        (int)n_stick);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of two starts the one with the smaller residual is taken: another one that is the solution, none that is worse. */
static PetscErrorCode TestStarts(Problem *p, HycoBlocks *blocks)
{
  PetscReal solution[ROWS] = {0}, z[ROWS] = {0}, far[ROWS];
  HycoLCP lcp = {.n = ROWS, .M = p->M, .q = p->q, .symmetric = PETSC_TRUE, .blocks = blocks, .other = solution};
  HycoLCPStatus status;
  PetscInt its, own;

  PetscFunctionBegin;
  Load(p, 4);
  PetscCall(Solve(p, blocks, NULL, solution, &own));
  PetscCall(HycoLCPSemismooth(&lcp, z, &its, &status));
  CHECK(status == HYCO_LCP_SOLVED && its == 0 && own > 0, "%d iterations from the solution, %d without", (int)its,
        (int)own);
  CHECK(Difference(z, solution) < 1e-12, "%g", (double)Difference(z, solution));
  for (PetscInt i = 0; i < ROWS; i++) {
    far[i] = 100;
    z[i] = 0;
  }
  lcp.other = far;
  PetscCall(HycoLCPSemismooth(&lcp, z, &its, &status));
  CHECK(its == own, "%d iterations, and %d without a worse start", (int)its, (int)own);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All contacts closed and at rest; every second one has no tangential flexibility. */
static PetscErrorCode TestPlane(Problem *p, HycoBlocks *blocks)
{
  PetscReal rho[ROWS], y[ROWS], b[ROWS], s[ROWS];
  HycoConeStep step;
  PetscInt changes;
  PetscBool regular;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < ROWS; i++) {
    rho[i] = 1;
    y[i] = i % 2 == 0;
    b[i] = i % 4 != 3;
    for (PetscInt j = 3; j < ROWS; j += 4) p->M[i * ROWS + j] = p->M[j * ROWS + i] = 0;
  }
  PetscCall(HycoConeStepCreate(0, blocks, rho, &step));
  HycoConeStepSetMatrix(&step, p->M);
  PetscCall(HycoConeStepDerive(&step, blocks, y, &changes));
  PetscCall(HycoConeStepSolve(&step, b, PETSC_FALSE, s, &regular));
  CHECK(regular, "a step with contacts on a plane of symmetry is regular");
  for (PetscInt i = 3; i < ROWS; i += 4) CHECK(s[i] == 0, "row %d: no force from a step of %g", (int)i, (double)s[i]);
  PetscCall(HycoConeStepDestroy(&step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  static Problem p;
  PetscReal data[2 * CONTACTS];
  HycoBlocks *blocks;
  HycoCone cone;
  HycoConeFactor factor;

  PetscFunctionBegin;
  PetscCall(HycoConeCreate(PETSC_COMM_SELF, &cone));
  PetscCall(HycoConeSetSize(cone, 2));
  PetscCall(HycoConeSetType(cone, HYCO_CONE_COULOMB));
  for (PetscInt k = 0; k < CONTACTS; k++) {
    data[2 * k] = 0.3;
    data[2 * k + 1] = 0;
  }
  PetscCall(HycoBlocksCreate(1, &cone, CONTACTS, NULL, data, &blocks));
  PetscCall(HycoConeFactorCreate(&factor));
  Fill(&p, 5);
  PetscCall(TestPath(&p, blocks, factor));
  Fill(&p, 2);
  HycoConeFactorForget(factor);
  PetscCall(TestPath(&p, blocks, factor));
  PetscCall(HycoConeFactorDestroy(&factor));
  PetscCall(TestStarts(&p, blocks));
  PetscCall(TestPlane(&p, blocks));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscCall(HycoConeDestroy(&cone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
