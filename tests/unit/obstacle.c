/* The active set's start from coarser problems: strings and membranes over obstacles, in any numbering. */
#include "check.h"
#include <hycosolverimpl.h>

/* nx x ny inner nodes of the unit square (ny 1: of the unit interval), fixed at the border, pulled down by `load`. */
typedef struct {
  PetscInt nx, ny, stride; /* node k has the number (stride k) mod n */
  PetscReal load;
  PetscReal (*depth)(PetscReal x, PetscReal y); /* the obstacle is at -depth; negative: none at this node */
  PetscReal cross;                              /* 0, or a positive coupling of diagonal neighbours */
} Shape;

typedef struct {
  Mat K, B, Bt;
  Vec F, D, x, L;
  HycoSystem system;
  HycoSolver solver;
} Case;

static PetscInt Number(const Shape *s, PetscInt i, PetscInt j)
{
  return (PetscInt)(((long long)s->stride * (i + (long long)j * s->nx)) % (s->nx * s->ny));
}

static PetscReal Step(const Shape *s)
{
  return 1. / (s->nx + 1);
}

static PetscReal Depth(const Shape *s, PetscInt i, PetscInt j)
{
  return s->depth((i + 1) * Step(s), (j + 1) * Step(s));
}

static PetscErrorCode AddNode(const Shape *s, PetscInt i, PetscInt j, Case *c)
{
  const PetscInt row = Number(s, i, j);
  const PetscReal h = Step(s), unit = s->ny == 1 ? 1 / h : 1; /* linear cells; five points */

  PetscFunctionBegin;
  PetscCall(MatSetValue(c->K, row, row, (s->ny == 1 ? 2 : 4 + 4 * s->cross) * unit, INSERT_VALUES));
  for (PetscInt a = -1; a <= 1; a++) {
    for (PetscInt b = -1; b <= 1; b++) {
      const PetscReal value = a && b ? s->cross : -1;

      if ((!a && !b) || i + a < 0 || i + a >= s->nx || j + b < 0 || j + b >= s->ny || value == 0) continue;
      PetscCall(MatSetValue(c->K, row, Number(s, i + a, j + b), value * unit, INSERT_VALUES));
    }
  }
  PetscCall(VecSetValue(c->F, row, -s->load * (s->ny == 1 ? h : h * h), INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Fill(const Shape *s, Case *c)
{
  PetscInt lo, hi, m = 0;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(c->K, &lo, &hi));
  for (PetscInt j = 0; j < s->ny; j++) {
    for (PetscInt i = 0; i < s->nx; i++) {
      const PetscInt row = Number(s, i, j);
      const PetscBool contact = (PetscBool)(Depth(s, i, j) >= 0);

      if (row >= lo && row < hi) {
        PetscCall(AddNode(s, i, j, c));
        if (contact) {
          PetscCall(MatSetValue(c->B, m, row, -1, INSERT_VALUES));
          PetscCall(VecSetValue(c->D, m, Depth(s, i, j), INSERT_VALUES));
        }
      }
      m += contact;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CaseCreate(const Shape *s, Case *c)
{
  const PetscInt n = s->nx * s->ny;
  PetscInt m = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) m += Depth(s, k % s->nx, k / s->nx) >= 0;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 9, NULL, 9, NULL, &c->K));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, m, n, 1, NULL, 1, NULL, &c->B));
  PetscCall(MatCreateVecs(c->K, &c->x, &c->F));
  PetscCall(MatCreateVecs(c->B, NULL, &c->D));
  PetscCall(VecDuplicate(c->D, &c->L));
  PetscCall(Fill(s, c));
  PetscCall(MatAssemblyBegin(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(c->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->B, MAT_FINAL_ASSEMBLY));
  PetscCall(VecAssemblyBegin(c->F));
  PetscCall(VecAssemblyEnd(c->F));
  PetscCall(VecAssemblyBegin(c->D));
  PetscCall(VecAssemblyEnd(c->D));
  PetscCall(MatTranspose(c->B, MAT_INITIAL_MATRIX, &c->Bt));
  PetscCall(HycoSystemCreate(PETSC_COMM_WORLD, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, c->K, c->Bt, c->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(c->system, c->F, c->D));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &c->solver));
  PetscCall(HycoSolverSetSystem(c->solver, c->system));
  PetscCall(HycoSolverSetForm(c->solver, HYCO_FORM_PRIMAL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CaseDestroy(Case *c)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverDestroy(&c->solver));
  PetscCall(HycoSystemDestroy(&c->system));
  PetscCall(MatDestroy(&c->K));
  PetscCall(MatDestroy(&c->B));
  PetscCall(MatDestroy(&c->Bt));
  PetscCall(VecDestroy(&c->F));
  PetscCall(VecDestroy(&c->D));
  PetscCall(VecDestroy(&c->x));
  PetscCall(VecDestroy(&c->L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves; returns the iterations, and whether the start came from coarser problems. */
static PetscErrorCode Run(Case *c, PetscInt *its, PetscBool *coarse)
{
  HycoReason reason;
  const char *method;

  PetscFunctionBegin;
  PetscCall(HycoSolverSolve(c->solver, c->x, c->L));
  PetscCall(HycoSolverGetReason(c->solver, &reason));
  CHECK(reason == HYCO_CONVERGED, "%s", HycoReasonName(reason));
  PetscCall(HycoSolverGetIterations(c->solver, its));
  PetscCall(HycoSolverGetMethod(c->solver, &method));
  *coarse = (PetscBool)(strstr(method, "multilevel") != NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest difference of x from the cold active set without a start. */
static PetscErrorCode AgainstCold(Case *c, PetscInt *its, PetscReal *difference)
{
  PetscBool coarse;
  PetscReal size;
  Vec x;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(c->x, &x));
  PetscCall(VecCopy(c->x, x));
  PetscCall(VecNorm(x, NORM_INFINITY, &size));
  PetscCall(HycoSolverSetMultilevel(c->solver, PETSC_FALSE));
  PetscCall(HycoSolverSetWarmStart(c->solver, PETSC_FALSE));
  PetscCall(Run(c, its, &coarse));
  CHECK(!coarse, "a start from coarser problems that was turned off");
  PetscCall(VecAXPY(x, -1, c->x));
  PetscCall(VecNorm(x, NORM_INFINITY, difference));
  *difference /= size;
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Flat(PetscReal x, PetscReal y)
{
  (void)x, (void)y;
  return 0.02;
}

static PetscReal Waves(PetscReal x, PetscReal y)
{
  return 0.01 + 0.05 * PetscSqr(PetscSinReal(9 * x) * PetscCosReal(4 * y));
}

/* Two thirds of the body have an obstacle below. */
static PetscReal Part(PetscReal x, PetscReal y)
{
  (void)y;
  return x < 2. / 3 ? 0.02 : -1;
}

/*
  A string of tension 1 under the load 1 over a flat obstacle at depth d: its shape is -(a x - x^2 / 2) up to x = a, a^2
  = 2 d, and it lies on the obstacle from there. Linear cells are exact at the nodes if a is one: a = 1/5 here.
*/
static PetscErrorCode TestString(PetscInt cells, PetscInt stride)
{
  const Shape s = {cells - 1, 1, stride, 1, Flat, 0};
  Case c;
  PetscInt its, lo, hi;
  PetscBool coarse;
  const PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(CaseCreate(&s, &c));
  PetscCall(Run(&c, &its, &coarse));
  CHECK(coarse && its <= 6, "%d cells: %d iterations", (int)cells, (int)its);
  PetscCall(VecGetOwnershipRange(c.x, &lo, &hi));
  PetscCall(VecGetArrayRead(c.x, &x));
  for (PetscInt i = 0; i < s.nx; i++) {
    const PetscReal at = PetscMin(0.2, PetscMin(i + 1, cells - 1 - i) * Step(&s));
    const PetscInt row = Number(&s, i, 0);

    if (row >= lo && row < hi) CHECK_NEAR(x[row - lo], at * at / 2 - 0.2 * at, 1e-15 * cells);
  }
  PetscCall(VecRestoreArrayRead(c.x, &x));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any obstacle: the same result as without the start, in at most `most` iterations where that takes at least `cold`. */
static PetscErrorCode TestSame(const Shape *s, PetscInt most, PetscInt cold)
{
  Case c;
  PetscInt its, its_cold;
  PetscBool coarse;
  PetscReal difference;

  PetscFunctionBegin;
  PetscCall(CaseCreate(s, &c));
  PetscCall(Run(&c, &its, &coarse));
  CHECK(coarse && its <= most, "%d x %d: %d iterations, expected at most %d", (int)s->nx, (int)s->ny, (int)its,
        (int)most);
  PetscCall(AgainstCold(&c, &its_cold, &difference));
  CHECK(difference < 1e-11, "%d x %d: %g from the cold solution", (int)s->nx, (int)s->ny, (double)difference);
  CHECK(its_cold >= cold, "%d x %d: %d cold iterations, expected at least %d", (int)s->nx, (int)s->ny, (int)its_cold,
        (int)cold);
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Load steps: a small one continues from the last set, a large one starts from the coarser problems. */
static PetscErrorCode TestSteps(void)
{
  const Shape s = {1999, 1, 1, 1, Flat, 0};
  const PetscReal factor[5] = {1.0005, 3, 0.9, 0.3, 40};
  Case c;
  PetscInt its;
  PetscBool coarse;

  PetscFunctionBegin;
  PetscCall(CaseCreate(&s, &c));
  PetscCall(Run(&c, &its, &coarse));
  for (PetscInt k = 0; k < 5; k++) {
    PetscCall(VecScale(c.F, factor[k]));
    PetscCall(Run(&c, &its, &coarse));
    CHECK(its <= (k == 0 ? 4 : 10), "load times %g: %d iterations", (double)factor[k], (int)its);
  }
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positive couplings, as in elasticity: there is no such start, and the active set alone gives the solution. */
static PetscErrorCode TestRefused(void)
{
  const Shape s = {24, 24, 1, 8, Flat, 0.25};
  Case c;
  PetscInt its, its_cold;
  PetscBool coarse;
  PetscReal difference;

  PetscFunctionBegin;
  PetscCall(CaseCreate(&s, &c));
  PetscCall(Run(&c, &its, &coarse));
  CHECK(!coarse, "a start with positive couplings");
  PetscCall(AgainstCold(&c, &its_cold, &difference));
  CHECK(its == its_cold && difference <= 1e-13, "%d iterations and %d, %g apart", (int)its, (int)its_cold,
        (double)difference);
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const Shape same[] = {{777, 1, 1, 3, Waves, 0}, {777, 1, 100, 3, Waves, 0}, {1000, 1, 7, 1, Part, 0},
                        {40, 40, 1, 6, Waves, 0}, {40, 40, 501, 6, Waves, 0}, {50, 50, 1, 4, Part, 0}};
  const PetscInt most[] = {6, 6, 6, 8, 8, 8}, cold[] = {20, 20, 40, 1, 1, 1};

  PetscFunctionBegin;
  for (PetscInt cells = 100; cells <= 100000; cells *= 10) PetscCall(TestString(cells, 1));
  PetscCall(TestString(100, 7));
  PetscCall(TestString(10000, 1000));
  for (PetscInt k = 0; k < 6; k++) PetscCall(TestSame(&same[k], most[k], cold[k]));
  PetscCall(TestSteps());
  PetscCall(TestRefused());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
