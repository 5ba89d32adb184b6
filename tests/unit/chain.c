/*
  The order of fallbacks: TAO, the active set, Lemke's method, and the end. K = 2 I, B = I, Bt = 2 M and F = 0 make the
  complementarity problem w = D + M L of a small matrix M.
*/
#include "check.h"
#include <hycosolver.h>
#include <math.h>

#define N 3

typedef struct {
  HycoSystem system;
  HycoSolver solver;
  Vec F, D, x, L;
} Case;

static PetscErrorCode Dense(const PetscReal rows[N][N], PetscReal scale, Mat *A)
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, N, N, NULL, A));
  PetscCall(MatDenseGetArray(*A, &a));
  for (PetscInt i = 0; i < N; i++) {
    for (PetscInt j = 0; j < N; j++) a[j * N + i] = scale * rows[i][j];
  }
  PetscCall(MatDenseRestoreArray(*A, &a));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Begin(const PetscReal M[N][N], PetscBool symmetric, Case *c)
{
  const PetscReal one[N][N] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Mat K, B, Bt;

  PetscFunctionBegin;
  PetscCall(Dense(one, 2, &K));
  PetscCall(Dense(one, 1, &B));
  PetscCall(Dense(M, 2, &Bt));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, K, Bt, B, symmetric));
  PetscCall(MatCreateVecs(K, &c->x, &c->F));
  PetscCall(MatCreateVecs(K, &c->L, &c->D));
  PetscCall(VecSet(c->F, 0));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &c->solver));
  PetscCall(HycoSolverSetSystem(c->solver, c->system));
  PetscCall(HycoSolverSetForm(c->solver, HYCO_FORM_DUAL));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode End(Case *c)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverDestroy(&c->solver));
  PetscCall(HycoSystemDestroy(&c->system));
  PetscCall(VecDestroy(&c->F));
  PetscCall(VecDestroy(&c->D));
  PetscCall(VecDestroy(&c->x));
  PetscCall(VecDestroy(&c->L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with gaps q; checks the methods, the reason, and the residuals if converged. */
static PetscErrorCode Solve(Case *c, const PetscReal q[N], const char methods[], PetscBool converged, HycoReason reason)
{
  const char *method;
  HycoReason found;
  HycoKKT kkt;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < N; i++) PetscCall(VecSetValue(c->D, i, q[i], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(c->D));
  PetscCall(VecAssemblyEnd(c->D));
  PetscCall(VecSet(c->x, 0));
  PetscCall(VecSet(c->L, 0));
  PetscCall(HycoSystemSetVectors(c->system, c->F, c->D));
  PetscCall(HycoSolverSolve(c->solver, c->x, c->L));
  PetscCall(HycoSolverGetMethod(c->solver, &method));
  PetscCall(HycoSolverGetReason(c->solver, &found));
  PetscCall(HycoSystemComputeKKT(c->system, c->x, c->L, &kkt));
  CHECK(strcmp(method, methods) == 0, "expected \"%s\", found \"%s\"", methods, method);
  CHECK(found == reason, "%s: expected the reason %d, found %d", methods, (int)reason, (int)found);
  CHECK((found > 0) == converged && (HycoKKTMax(&kkt) <= 1e-8) == converged, "%s: reason %d, residual %g", methods,
        (int)found, HycoKKTMax(&kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Forces(const Case *c, PetscReal a, PetscReal b, PetscReal d)
{
  const PetscReal expected[N] = {a, b, d};
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(c->L, &L));
  for (PetscInt i = 0; i < N; i++) CHECK_NEAR(L[i], expected[i], 1e-12);
  PetscCall(VecRestoreArrayRead(c->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* I. Ben Gharbia, J. C. Gilbert, Math. Programming 134 (2012) 349-364: from the set {1} the active set cycles. A
   first solve ends with that set, and the second starts from it. */
static const PetscReal cycling[N][N] = {{1, 0, 2}, {2, 1, 0}, {0, 2, 1}}, inside[N] = {-1, 9, 9}, all[N] = {-1, -1, -1};
static const PetscReal spd[N][N] = {{2, -1, 0}, {-1, 2, -1}, {0, -1, 2}};

/* A failed active set is followed by the methods of the chain. */
static PetscErrorCode TestActiveSet(void)
{
  Case c;

  PetscFunctionBegin;
  for (int fallback = 0; fallback < 2; fallback++) {
    PetscCall(Begin(cycling, PETSC_FALSE, &c));
    PetscCall(HycoSolverSetFallback(c.solver, (PetscBool)fallback));
    PetscCall(Solve(&c, inside, "active_set dual", PETSC_TRUE, HYCO_CONVERGED));
    PetscCall(Forces(&c, 1, 0, 0));
    if (fallback) {
      PetscCall(Solve(&c, all, "active_set dual, then lemke", PETSC_TRUE, HYCO_CONVERGED_FALLBACK));
      PetscCall(Forces(&c, 1.0 / 3, 1.0 / 3, 1.0 / 3));
    } else
      PetscCall(Solve(&c, all, "active_set dual", PETSC_FALSE, HYCO_DIVERGED_ITERATIONS));
    PetscCall(End(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* bqpip cannot take infinite bounds: the active set solves z = M^-1 e = (3, 4, 3)/2, closed form. Limited to one
   iteration where it needs two (the free end opens), the active set fails and Lemke's method follows. */
static PetscErrorCode TestTao(void)
{
  const PetscReal mixed[N] = {-1, -1, 3};
  Case c;

  PetscFunctionBegin;
  for (int few = 0; few < 2; few++) {
    PetscCall(Begin(spd, PETSC_TRUE, &c));
    PetscCall(HycoSolverSetType(c.solver, HYCO_SOLVER_TAO));
    PetscCall(HycoSolverSetTaoType(c.solver, "bqpip"));
    if (few) PetscCall(HycoSolverSetMaxIts(c.solver, 1));
    if (few) {
      PetscCall(Solve(&c, mixed, "tao bqpip dual, then active_set, then lemke", PETSC_TRUE, HYCO_CONVERGED_FALLBACK));
      PetscCall(Forces(&c, 1, 1, 0)); /* 2 z1 - z2 = 1, -z1 + 2 z2 = 1; the third gap stays 3 - 1 = 2 */
    } else {
      PetscCall(Solve(&c, all, "tao bqpip dual, then active_set", PETSC_TRUE, HYCO_CONVERGED_FALLBACK));
      PetscCall(Forces(&c, 1.5, 2, 1.5));
    }
    PetscCall(End(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The end: w = -1 - z >= 0 has no solution, and no method reports one. */
static PetscErrorCode TestNone(void)
{
  const PetscReal minus[N][N] = {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  Case c;

  PetscFunctionBegin;
  PetscCall(Begin(minus, PETSC_FALSE, &c));
  PetscCall(Solve(&c, all, "active_set dual, then lemke, then tao ssils", PETSC_FALSE, HYCO_DIVERGED_RESIDUAL));
  PetscCall(End(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not a P-matrix (symmetric, indefinite), several solutions: Lemke's method finds one; zero gaps: no force. */
static PetscErrorCode TestSeveral(void)
{
  const PetscReal several[N][N] = {{1, 2, 0}, {2, 1, 0}, {0, 0, 1}}, zero[N] = {0, 0, 0};
  Case c;

  PetscFunctionBegin;
  PetscCall(Begin(several, PETSC_TRUE, &c)); /* (1, 1)/3, (1, 0) and (0, 1) in the first two */
  PetscCall(Solve(&c, all, "active_set dual, then lemke", PETSC_TRUE, HYCO_CONVERGED_FALLBACK));
  PetscCall(End(&c));
  PetscCall(Begin(spd, PETSC_TRUE, &c));
  PetscCall(Solve(&c, zero, "active_set dual", PETSC_TRUE, HYCO_CONVERGED));
  PetscCall(Forces(&c, 0, 0, 0));
  PetscCall(End(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A string of 20 cells pulled onto an obstacle, limited to one iteration where the contact needs several: TAO's gpcg
   follows, also after iterative solves (as if a factor would not fit in memory), where Lemke's method has no matrix. */
#define NODES 19

static PetscErrorCode BeginString(HycoLinear linear, Case *c)
{
  Mat K, B, Bt;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, NODES, NODES, 3, NULL, &K));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, NODES, NODES, 1, NULL, &B));
  for (PetscInt i = 0; i < NODES; i++) {
    PetscCall(MatSetValue(K, i, i, 2, INSERT_VALUES));
    if (i) PetscCall(MatSetValue(K, i, i - 1, -1, INSERT_VALUES));
    if (i < NODES - 1) PetscCall(MatSetValue(K, i, i + 1, -1, INSERT_VALUES));
    PetscCall(MatSetValue(B, i, i, 1, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(B, MAT_INITIAL_MATRIX, &Bt));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, K, Bt, B, PETSC_TRUE));
  PetscCall(MatCreateVecs(K, &c->x, &c->F));
  PetscCall(MatCreateVecs(K, &c->L, &c->D));
  PetscCall(VecSet(c->F, 1));
  PetscCall(VecSet(c->D, 10));
  PetscCall(HycoSystemSetVectors(c->system, c->F, c->D));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &c->solver));
  PetscCall(HycoSolverSetSystem(c->solver, c->system));
  PetscCall(HycoSolverSetLinear(c->solver, linear, 0));
  PetscCall(HycoSolverSetMultilevel(c->solver, PETSC_FALSE));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The active set with direct or iterative solves, stopped at its limit, is followed by TAO. */
static PetscErrorCode TestIterative(void)
{
  const HycoLinear linear[2] = {HYCO_LINEAR_DIRECT, HYCO_LINEAR_ITERATIVE};
  const char *method;
  HycoReason reason;
  Case c;

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    HycoKKT kkt; /* 0: iterative, no limit; 1: direct, limited; 2: iterative, limited */

    PetscCall(BeginString(linear[k != 1], &c));
    if (k) PetscCall(HycoSolverSetMaxIts(c.solver, 1));
    PetscCall(HycoSolverSolve(c.solver, c.x, c.L));
    PetscCall(HycoSolverGetMethod(c.solver, &method));
    PetscCall(HycoSolverGetReason(c.solver, &reason));
    PetscCall(HycoSystemComputeKKT(c.system, c.x, c.L, &kkt));
    CHECK(!strcmp(method, k ? "active_set primal, then tao gpcg" : "active_set primal"), "case %d: %s", k, method);
    CHECK(reason == (k ? HYCO_CONVERGED_FALLBACK : HYCO_CONVERGED), "case %d, %s: reason %d", k, method, (int)reason);
    CHECK(HycoKKTMax(&kkt) <= 1e-8, "case %d, %s: residual %g", k, method, HycoKKTMax(&kkt));
    PetscCall(End(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestIterative());
  PetscCall(TestActiveSet());
  PetscCall(TestTao());
  PetscCall(TestNone());
  PetscCall(TestSeveral());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
