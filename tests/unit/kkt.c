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
  /* not finite is no solution */
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

      if (t == 2 && forms[f] == HYCO_FORM_PRIMAL) continue; /* Lemke's is a method of the dual form */
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

/* A singular K is told, not solved. */
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

static PetscErrorCode Test(void)
{
  Case c;

  PetscFunctionBegin;
  PetscCall(CaseCreate(&c));
  PetscCall(TestResiduals(&c));
  PetscCall(TestSolvers(&c));
  PetscCall(TestSingular(&c));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
