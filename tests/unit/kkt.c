/* HycoSystem's residuals and HycoSolver on systems small enough to solve by hand. */
#include "check.h"
#include <hycosolver.h>
#include <math.h>

typedef struct {
  Mat K, B, Bt;
  Vec F, D, x, L;
  HycoSystem system;
} Case;

/* K = diag(2, 4), F = (3, 4), one contact x_1 <= 0.5. */
static PetscErrorCode CaseCreate(Case *c)
{
  const PetscReal diagonal[2] = {2, 4}, force[2] = {3, 4};

  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 2, 2, 1, NULL, &c->K));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 2, 1, NULL, &c->B));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 2, &c->F));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 1, &c->D));
  for (PetscInt i = 0; i < 2; i++) {
    PetscCall(MatSetValue(c->K, i, i, diagonal[i], INSERT_VALUES));
    PetscCall(VecSetValue(c->F, i, force[i], INSERT_VALUES));
  }
  PetscCall(MatSetValue(c->B, 0, 0, 1, INSERT_VALUES));
  PetscCall(VecSet(c->D, 0.5));
  PetscCall(MatAssemblyBegin(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(c->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(c->B, MAT_INITIAL_MATRIX, &c->Bt));
  PetscCall(VecDuplicate(c->F, &c->x));
  PetscCall(VecDuplicate(c->D, &c->L));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, c->K, c->Bt, c->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(c->system, c->F, c->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CaseDestroy(Case *c)
{
  PetscFunctionBegin;
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

static PetscErrorCode SetState(Case *c, PetscReal x0, PetscReal x1, PetscReal force)
{
  PetscFunctionBegin;
  PetscCall(VecSetValue(c->x, 0, x0, INSERT_VALUES));
  PetscCall(VecSetValue(c->x, 1, x1, INSERT_VALUES));
  PetscCall(VecSet(c->L, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Residuals of given states, computed by hand. */
static PetscErrorCode TestResiduals(Case *c)
{
  HycoKKT kkt;

  PetscFunctionBegin;
  /* x = (1, 1), L = -1: K x = (2, 4), Bt L = (-1, 0), r = (-2, 0); |F| = 5 is the largest; B x - D = 0.5 = d / 2 */
  PetscCall(SetState(c, 1, 1, -1));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK_NEAR(kkt.stationarity, 0.4, 1e-15);
  CHECK_NEAR(kkt.penetration, 0.5, 1e-15);
  CHECK_NEAR(kkt.adhesion, 1, 1e-15);
  CHECK_NEAR(kkt.complementarity, 0.5, 1e-15);
  CHECK_NEAR(HycoKKTMax(&kkt), 1, 1e-15);
  /* x = (0, 1), L = 3: r = (0 + 3 - 3, 0) = 0; open by 0.5 = d (|x| = 1 makes d = 1: 0.5) with a force: 3 * 0.5 / 3 */
  PetscCall(SetState(c, 0, 1, 3));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK_NEAR(kkt.stationarity, 0, 1e-16);
  CHECK_NEAR(kkt.penetration, 0, 0);
  CHECK_NEAR(kkt.adhesion, 0, 0);
  CHECK_NEAR(kkt.complementarity, 0.5, 1e-15);
  /* the solution: x_1 = 0.5, L = 3 - 2 * 0.5 = 2, x_2 = 1 */
  PetscCall(SetState(c, 0.5, 1, 2));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK_NEAR(HycoKKTMax(&kkt), 0, 1e-16);
  /* r_2 = 4 (x_2 - 1): 4 eps is within the round-off of K_22 x_2 and F_2, 16 eps (4 + 4), and 256 eps is not; |F| = 5
   */
  for (int k = 0; k < 2; k++) {
    PetscCall(SetState(c, 0.5, 1 + (k ? 64 : 1) * PETSC_MACHINE_EPSILON, 2));
    PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
    CHECK_NEAR(kkt.stationarity, k ? 256 * PETSC_MACHINE_EPSILON / 5 : 0, 1e-18);
    CHECK_NEAR(kkt.rounding, k ? 0 : 4 * PETSC_MACHINE_EPSILON / 5, 1e-18);
  }
  /* a value that is not finite is not a solution */
  PetscCall(SetState(c, NAN, 1, 2));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK(HycoKKTMax(&kkt) > 1, "NaN must not pass: %g", (double)HycoKKTMax(&kkt));
  PetscCall(SetState(c, 0.5, 1, NAN));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK(HycoKKTMax(&kkt) > 1, "NaN must not pass: %g", (double)HycoKKTMax(&kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each method and form gives x = (0.5, 1), L = 2; and (0.375, 1), 0 after F_1 changes to 0.75. */
static PetscErrorCode TestSolvers(Case *c)
{
  const char *const types[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE};
  const HycoForm forms[] = {HYCO_FORM_AUTO, HYCO_FORM_DUAL, HYCO_FORM_PRIMAL};

  PetscFunctionBegin;
  for (int t = 0; t < 3; t++) {
    for (int f = 0; f < 3; f++) {
      HycoSolver solver;
      HycoReason reason;
      const PetscReal *x, *L;

      if (t == 2 && forms[f] == HYCO_FORM_PRIMAL) continue; /* Lemke's method is one of the dual form */
      PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
      PetscCall(HycoSolverSetSystem(solver, c->system));
      PetscCall(HycoSolverSetType(solver, types[t]));
      PetscCall(HycoSolverSetForm(solver, forms[f]));
      for (int k = 0; k < 2; k++) {
        PetscCall(VecSetValue(c->F, 0, k ? 0.75 : 3, INSERT_VALUES));
        PetscCall(HycoSolverSolve(solver, c->x, c->L));
        PetscCall(HycoSolverGetReason(solver, &reason));
        CHECK(reason == HYCO_CONVERGED, "%s, form %d: reason %d", types[t], f, (int)reason);
        PetscCall(VecGetArrayRead(c->x, &x));
        PetscCall(VecGetArrayRead(c->L, &L));
        CHECK_NEAR(x[0], k ? 0.375 : 0.5, 1e-8);
        CHECK_NEAR(x[1], 1, 1e-12);
        CHECK_NEAR(L[0], k ? 0 : 2, 1e-7);
        PetscCall(VecRestoreArrayRead(c->x, &x));
        PetscCall(VecRestoreArrayRead(c->L, &L));
      }
      PetscCall(HycoSolverDestroy(&solver));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A singular K is reported, not solved. */
static PetscErrorCode TestSingular(Case *c)
{
  HycoSolver solver;
  HycoReason reason = HYCO_CONVERGED;

  PetscFunctionBegin;
  PetscCall(MatSetValue(c->K, 1, 1, 0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->K, MAT_FINAL_ASSEMBLY));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, c->system));
  PetscCall(HycoSolverSolve(solver, c->x, c->L));
  PetscCall(HycoSolverGetReason(solver, &reason));
  CHECK(reason < 0, "K with a zero row: reason %d", (int)reason);
  PetscCall(HycoSolverDestroy(&solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the order of the methods -- */

/* A dense system K = I, B = I, Bt = M, F = 0: w = D + M L. M by columns, or NULL: M = 0 and B = 0. */
static PetscErrorCode ChainCreate(PetscInt n, const PetscReal M[], Case *c)
{
  Mat *all[3];

  PetscFunctionBegin;
  all[0] = &c->K, all[1] = &c->B, all[2] = &c->Bt;
  for (int k = 0; k < 3; k++) {
    PetscScalar *a;

    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, NULL, all[k]));
    PetscCall(MatDenseGetArray(*all[k], &a));
    for (PetscInt i = 0; i < n * n; i++) a[i] = k == 0 || (k == 1 && M) ? i % (n + 1) == 0 : k == 2 && M ? M[i] : 0;
    PetscCall(MatDenseRestoreArray(*all[k], &a));
    PetscCall(MatAssemblyBegin(*all[k], MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(*all[k], MAT_FINAL_ASSEMBLY));
  }
  PetscCall(MatCreateVecs(c->K, &c->x, &c->F));
  PetscCall(VecDuplicate(c->x, &c->D));
  PetscCall(VecDuplicate(c->x, &c->L));
  PetscCall(VecSet(c->F, 0));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, c->K, c->Bt, c->B, PETSC_FALSE));
  PetscCall(HycoSystemSetVectors(c->system, c->F, c->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Expect(HycoSolver solver, Case *c, const char what[], HycoReason reason, const char method[])
{
  HycoReason found;
  const char *name;

  PetscFunctionBegin;
  PetscCall(HycoSolverSolve(solver, c->x, c->L));
  PetscCall(HycoSolverGetReason(solver, &found));
  PetscCall(HycoSolverGetMethod(solver, &name));
  CHECK(found == reason, "%s: expected reason %d, found %d", what, (int)reason, (int)found);
  CHECK(!strcmp(name, method), "%s: expected the method \"%s\", found \"%s\"", what, method, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ben Gharbia and Gilbert's matrix (lcp.c): from the set {1} of a first solution the active set cycles, Lemke solves.
 */
static PetscErrorCode TestCycleThenLemke(void)
{
  const PetscReal M[9] = {1, 2, 0, 0, 1, 2, 2, 0, 1};
  const PetscInt at = 0;
  const PetscReal minus = -1, *L;
  HycoSolver solver;
  Case c;

  PetscFunctionBegin;
  PetscCall(ChainCreate(3, M, &c));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, c.system));
  for (int fallback = 0; fallback < 2; fallback++) {
    PetscCall(HycoSolverSetFallback(solver, (PetscBool)fallback));
    PetscCall(VecSet(c.D, 5));
    PetscCall(VecSetValues(c.D, 1, &at, &minus, INSERT_VALUES));
    PetscCall(Expect(solver, &c, "first", HYCO_CONVERGED, "active_set dual"));
    PetscCall(VecSet(c.D, -1));
    PetscCall(Expect(solver, &c, "cycle", fallback ? HYCO_CONVERGED_FALLBACK : HYCO_DIVERGED_ITERATIONS,
                     fallback ? "active_set dual, then lemke" : "active_set dual"));
  }
  PetscCall(VecGetArrayRead(c.L, &L));
  for (int i = 0; i < 3; i++) CHECK_NEAR(L[i], 1.0 / 3, 1e-14);
  PetscCall(VecRestoreArrayRead(c.L, &L));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_TAO));
  PetscCall(HycoSolverSetTaoType(solver, "tron"));
  CHECK_FAILS(HycoSolverSolve(solver, c.x, c.L), "tron needs a symmetric system, and this one is not symmetric; use");
  PetscCall(HycoSolverSetTaoType(solver, NULL));
  PetscCall(Expect(solver, &c, "semismooth by default", HYCO_CONVERGED, "tao ssils dual"));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing can open a gap of -1 (B = 0): the set is singular, Lemke's method ends on a ray, and the solve reports
   this. */
static PetscErrorCode TestRay(void)
{
  HycoSolver solver;
  Case c;

  PetscFunctionBegin;
  PetscCall(ChainCreate(2, NULL, &c));
  PetscCall(VecSet(c.D, -1));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, c.system));
  PetscCall(Expect(solver, &c, "no solution", HYCO_DIVERGED_ITERATIONS, "active_set dual, then lemke, then tao ssils"));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_LEMKE));
  PetscCall(Expect(solver, &c, "no solution", HYCO_DIVERGED_ITERATIONS, "lemke dual, then tao ssils"));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_TAO));
  PetscCall(Expect(solver, &c, "no solution", HYCO_DIVERGED_ITERATIONS, "tao ssils dual, then active_set, then lemke"));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One iteration is too few for TAO and for the active set; Lemke's method solves. Invalid requests are refused. */
static PetscErrorCode TestChain(Case *c)
{
  HycoSolver solver;
  const HycoForm forms[] = {HYCO_FORM_DUAL, HYCO_FORM_PRIMAL, HYCO_FORM_DUAL_FREE};
  const char *const names[] = {"tao bncg dual, then active_set, then lemke",
                               "tao bncg primal, then active_set, then tao gpcg, then tao tron, then lemke",
                               "tao bncg dual_free, then active_set, then lemke"};

  PetscFunctionBegin;
  PetscCall(VecSetValue(c->F, 0, 3, INSERT_VALUES));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, c->system));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_TAO));
  PetscCall(HycoSolverSetTaoType(solver, "bncg"));
  PetscCall(HycoSolverSetWarmStart(solver, PETSC_FALSE));
  PetscCall(HycoSolverSetMaxIts(solver, 1));
  for (int k = 0; k < 3; k++) {
    HycoReason reason;
    const char *name;

    PetscCall(HycoSolverSetForm(solver, forms[k]));
    PetscCall(HycoSolverSolve(solver, c->x, c->L));
    PetscCall(HycoSolverGetReason(solver, &reason));
    PetscCall(HycoSolverGetMethod(solver, &name));
    CHECK(reason > 0, "%s: reason %d", name, (int)reason);
    CHECK(!strncmp(names[k], name, strlen(name)), "expected \"%s\" or its beginning, found \"%s\"", names[k], name);
  }
  PetscCall(HycoSolverSetForm(solver, HYCO_FORM_PRIMAL));
  PetscCall(HycoSolverSetTaoType(solver, "asils"));
  CHECK_FAILS(HycoSolverSolve(solver, c->x, c->L), "asils needs the matrix of the dual form");
  PetscCall(HycoSolverSetForm(solver, HYCO_FORM_DUAL_FREE));
  PetscCall(HycoSolverSetTaoType(solver, "bqpip"));
  CHECK_FAILS(HycoSolverSolve(solver, c->x, c->L), "bqpip reads the matrix of the dual form");
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_LEMKE));
  CHECK_FAILS(HycoSolverSolve(solver, c->x, c->L), "lemke needs the matrix of the dual form");
  CHECK_FAILS(HycoSolverSetTaoType(solver, "newton"), "the TAO type \"newton\" is unknown");
  PetscCall(HycoSolverDestroy(&solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  Case c;

  PetscFunctionBegin;
  PetscCall(CaseCreate(&c));
  PetscCall(TestResiduals(&c));
  PetscCall(TestSolvers(&c));
  PetscCall(TestChain(&c));
  PetscCall(TestCycleThenLemke());
  PetscCall(TestRay());
  PetscCall(TestSingular(&c));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
