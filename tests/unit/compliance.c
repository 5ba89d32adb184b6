/* A compliance in HycoSystem against closed forms: beside a regular K (dense, sparse, divided), with free unknowns, and
   alone; residuals, refusals and the derivative. */
#include "check.h"
#include <hycosolverimpl.h>

static const char *const types[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE, HYCO_SOLVER_SEMISMOOTH};

/* diag(a, b), of that type. */
static PetscErrorCode Diagonal(MPI_Comm comm, MatType type, PetscReal a, PetscReal b, Mat *A)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, PETSC_DECIDE, PETSC_DECIDE, 2, 2));
  PetscCall(MatSetType(*A, type));
  PetscCall(MatSetUp(*A));
  PetscCall(MatGetOwnershipRange(*A, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) PetscCall(MatSetValue(*A, i, i, i ? b : a, INSERT_VALUES));
  PetscCall(HycoMatAssemble(*A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Fill(Vec v, const PetscReal value[])
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v, &lo, &hi));
  PetscCall(HycoVecWrite(v, hi - lo, value + lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solved(HycoSolver solver, Vec x, Vec L, PetscInt n, const PetscReal at[], PetscInt m,
                             const PetscReal forces[])
{
  PetscReal found[4];
  HycoReason reason;
  const char *method;

  PetscFunctionBegin;
  PetscCall(HycoSolverSolve(solver, x, L));
  PetscCall(HycoSolverGetReason(solver, &reason));
  PetscCall(HycoSolverGetMethod(solver, &method));
  CHECK(reason == HYCO_CONVERGED, "%s: %s", method, HycoReasonName(reason));
  if (n) PetscCall(HycoVecGather(x, found));
  for (PetscInt i = 0; i < n; i++) CHECK_NEAR(found[i], at[i], 1e-10);
  PetscCall(HycoVecGather(L, found));
  for (PetscInt i = 0; i < m; i++) CHECK_NEAR(found[i], forces[i], 1e-10);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K = diag(2, 4), F = (4, 4), x_1 - W L_1 <= 1/2: L_1 = 1.5 / (1/2 + W), x_1 = (4 - L_1) / 2, x_2 = 1. The factor of K
   is kept where W alone changes. */
static PetscErrorCode TestBeside(MPI_Comm comm, MatType type)
{
  const PetscReal load[] = {4, 4}, gap[] = {0.5, 10}, change[] = {1, 0};
  Mat K, B, W;
  Vec F, D, x, L, dx, dL;
  HycoSystem system;
  HycoSolver solver;
  PetscInt made;

  PetscFunctionBegin;
  PetscCall(Diagonal(comm, type, 2, 4, &K));
  PetscCall(Diagonal(comm, type, 1, 1, &B));
  PetscCall(Diagonal(comm, type, 1, 0, &W));
  PetscCall(MatCreateVecs(K, &x, &F));
  HycoVecDuplicate(F, &D, &L, &dx, &dL);
  PetscCall(Fill(F, load));
  PetscCall(Fill(D, gap));
  PetscCall(HycoSystemCreate(comm, &system));
  PetscCall(HycoSystemSetMatrices(system, K, B, B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(system, F, D));
  PetscCall(HycoSolverCreate(comm, &solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  PetscCall(HycoSolverSetFallback(solver, PETSC_FALSE));
  for (int t = 0; t < 4; t++) {
    PetscCall(HycoSolverSetType(solver, types[t]));
    for (int k = 0; k < 3; k++) {
      const PetscReal w = k == 2 ? 0 : 1 + 2 * k, forces[] = {1.5 / (0.5 + w), 0}, at[] = {2 - forces[0] / 2, 1};

      PetscCall(MatScale(W, k == 1 ? 3 : 1));
      PetscCall(HycoSystemSetCompliance(system, w > 0 ? W : NULL));
      made = solver->stiffness.made;
      PetscCall(Solved(solver, x, L, 2, at, 2, forces));
      CHECK(!made || made == solver->stiffness.made, "%d factors instead of %d", (int)solver->stiffness.made,
            (int)made);
    }
    PetscCall(MatScale(W, 1. / 3));
  }
  PetscCall(HycoSystemSetCompliance(system, W));
  PetscCall(HycoSolverSetForm(solver, HYCO_FORM_PRIMAL));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_ACTIVE_SET));
  CHECK_FAILS(HycoSolverSolve(solver, x, L), "primal takes no compliance");
  PetscCall(HycoSolverSetForm(solver, HYCO_FORM_AUTO));
  PetscCall(HycoSolverSolve(solver, x, L));
  if (strcmp(type, MATDENSE)) { /* D + g: L' = -2/3, x' = 1/3; F + r: x' = L' = 1/3 */
    HycoSolverTangent tangent;
    PetscBool regular, kink;
    PetscReal found[2];

    PetscCall(HycoSolverTangentCreate(solver, x, L, NULL, &tangent, &regular));
    CHECK(regular, "the contact is closed");
    for (int k = 0; k < 2; k++) {
      PetscCall(VecSet(F, 0));
      PetscCall(VecSet(D, 0));
      PetscCall(Fill(k ? F : D, change));
      PetscCall(HycoSolverTangentSolve(tangent, F, D, 1, dx, dL, &kink));
      PetscCall(HycoVecGather(dx, found));
      CHECK_NEAR(found[0], 1. / 3, 1e-12);
      PetscCall(HycoVecGather(dL, found));
      CHECK_NEAR(found[0], k ? 1. / 3 : -2. / 3, 1e-12);
    }
    PetscCall(HycoSolverTangentDestroy(&tangent));
  }
  HycoDestroyAll(&solver, &system, &K, &B, &W, &F, &D, &x, &L, &dx, &dL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K = 0, rows x <= L_1, x <= 0.1 + L_2, and one that cannot close, under the load 2: x = 1.05, L = (1.05, 0.95, 0). */
static PetscErrorCode TestFree(PetscBool dense)
{
  const PetscReal at[] = {1.05}, forces[] = {1.05, 0.95, 0}, gap[] = {0, 0.1, PETSC_INFINITY}, state[] = {1, 0.5, 0};
  static const char *const taos[] = {"gpcg", "tron", "bntr", "bnls", "blmvm", "bqnkls", "ssils"};
  Mat B, W;
  Vec F, D, x, L;
  HycoSystem system;
  HycoSolver solver;
  HycoReason reason;
  HycoKKT kkt;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 3, 1, NULL, &B));
  if (dense)
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 3, 3, NULL, &W));
  else
    PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 3, 3, 1, NULL, &W));
  for (PetscInt i = 0; i < 3; i++) {
    PetscCall(MatSetValue(B, i, 0, 1, INSERT_VALUES));
    PetscCall(MatSetValue(W, i, i, 1, INSERT_VALUES));
  }
  PetscCall(HycoMatAssemble(B));
  PetscCall(HycoMatAssemble(W));
  PetscCall(MatCreateVecs(B, &x, &D));
  PetscCall(VecDuplicate(x, &F));
  PetscCall(VecDuplicate(D, &L));
  PetscCall(Fill(D, gap));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSystemSetMatrices(system, NULL, NULL, B, PETSC_TRUE));
  PetscCall(HycoSystemSetCompliance(system, W));
  PetscCall(HycoSystemSetVectors(system, F, D));
  PetscCall(VecSet(F, 2));
  PetscCall(VecSet(x, 1));
  PetscCall(Fill(L, state)); /* w = (0, -0.4) beside 1; 1.5 of the load 2 */
  PetscCall(HycoSystemComputeKKT(system, x, L, &kkt));
  CHECK_NEAR(kkt.stationarity, 0.5 / 3.5, 1e-12);
  CHECK_NEAR(kkt.penetration, 0.4, 1e-15);
  CHECK_NEAR(kkt.adhesion, 0, 0);
  CHECK_NEAR(kkt.complementarity, 0.2, 1e-15);
  for (size_t t = 0; t < 3 + sizeof(taos) / sizeof(taos[0]); t++) {
    PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
    PetscCall(HycoSolverSetSystem(solver, system));
    PetscCall(HycoSolverSetFallback(solver, PETSC_FALSE));
    PetscCall(HycoSolverSetType(solver, t < 3 ? types[t + (t > 0)] : HYCO_SOLVER_TAO));
    if (t >= 3) PetscCall(HycoSolverSetTaoType(solver, taos[t - 3]));
    PetscCall(VecSet(F, 2));
    PetscCall(Solved(solver, x, L, 1, at, 3, forces));
    PetscCall(VecSet(F, -2)); /* nothing pulls back */
    PetscCall(HycoSolverSolve(solver, x, L));
    PetscCall(HycoSolverGetReason(solver, &reason));
    CHECK(reason < 0, "method %d: %s", (int)t, HycoReasonName(reason));
    PetscCall(HycoSolverDestroy(&solver));
  }
  HycoDestroyAll(&system, &B, &W, &F, &D, &x, &L);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A sparse W = (2 1; 1 2) alone, gaps -1 and -0.2: the first contact closes, L = (1/2, 0), and keeps the second open
   (w = 0.3). From a working set without the first, which joins. */
static PetscErrorCode TestAlone(void)
{
  const PetscReal gap[] = {-1, -0.2}, forces[] = {0.5, 0};
  const PetscBool in[] = {PETSC_FALSE, PETSC_TRUE};
  Mat W;
  Vec D, L;
  HycoSystem system;
  HycoSolver solver;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 2, 2, 2, NULL, &W));
  for (PetscInt k = 0; k < 4; k++) PetscCall(MatSetValue(W, k / 2, k % 2, k / 2 == k % 2 ? 2 : 1, INSERT_VALUES));
  PetscCall(HycoMatAssemble(W));
  PetscCall(MatCreateVecs(W, &D, &L));
  PetscCall(Fill(D, gap));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  CHECK_FAILS(HycoSystemSetCompliance(system, W), "HycoSystemSetMatrices() first");
  PetscCall(HycoSystemSetFlexibility(system, W, D));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  for (int k = 0; k < 8; k++) {
    PetscCall(HycoSolverSetType(solver, types[k / 2]));
    PetscCall(HycoSolverSetWorkingSet(solver, k % 2 ? in : NULL));
    PetscCall(Solved(solver, NULL, L, 0, NULL, 2, forces));
  }
  HycoDestroyAll(&solver, &system, &W, &D, &L);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestBeside(PETSC_COMM_SELF, MATDENSE));
  PetscCall(TestBeside(PETSC_COMM_SELF, MATAIJ));
  PetscCall(TestBeside(PETSC_COMM_WORLD, MATAIJ));
  PetscCall(TestFree(PETSC_TRUE));
  PetscCall(TestFree(PETSC_FALSE));
  PetscCall(TestAlone());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
