/*
  A complementarity method of one's own: projected Gauss-Seidel, registered as a type of Tao and chosen by name. A string of
  n beads hangs over a table: K u + L = F, 0 <= L complementary to the gap D - u >= 0.

      build/ladder/method [-n 12] [-hyco_tao_type tron] [-hyco_tao_monitor]

  What a type of Tao is given: the bounds, and H and f of w = H y - f as Hessian and gradient, scaled to a unit diagonal.
*/
#include <hyco.h>
#include <petsc/private/taoimpl.h>

/* Sweeps y_i = median(lo_i, y_i - (H y - f)_i / H_ii, hi_i) over a matrix on one process; *change: the largest step. */
static PetscErrorCode Sweep(Mat H, const PetscScalar f[], const PetscScalar lo[], const PetscScalar hi[], PetscScalar y[],
                            PetscReal *change)
{
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(H, &n, NULL));
  *change = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt entries;
    const PetscInt *column;
    const PetscScalar *value;
    PetscScalar w = -f[i], diagonal = 1, before = y[i];

    PetscCall(MatGetRow(H, i, &entries, &column, &value));
    for (PetscInt k = 0; k < entries; k++) {
      w += value[k] * y[column[k]];
      if (column[k] == i) diagonal = value[k];
    }
    PetscCall(MatRestoreRow(H, i, &entries, &column, &value));
    y[i] = PetscMin(hi[i], PetscMax(lo[i], y[i] - w / diagonal));
    *change = PetscMax(*change, PetscAbsScalar(y[i] - before));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode SolveProjected(Tao tao)
{
  Vec f;
  const PetscScalar *b, *lo, *hi;
  PetscScalar *y;
  PetscReal change = 1;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(tao->solution, &f)); /* the gradient at 0 is -f */
  PetscCall(VecSet(tao->solution, 0));
  PetscCall(TaoComputeGradient(tao, tao->solution, f));
  PetscCall(VecScale(f, -1));
  PetscCall(VecGetArrayRead(f, &b));
  PetscCall(VecGetArrayRead(tao->XL, &lo));
  PetscCall(VecGetArrayRead(tao->XU, &hi));
  for (tao->niter = 0; change > 1e-13 && tao->niter < tao->max_it; tao->niter++) {
    PetscCall(TaoMonitor(tao, tao->niter, 0, change, 0, 1));
    PetscCall(VecGetArray(tao->solution, &y));
    PetscCall(Sweep(tao->hessian, b, lo, hi, y, &change));
    PetscCall(VecRestoreArray(tao->solution, &y));
  }
  tao->reason = change > 1e-13 ? TAO_DIVERGED_MAXITS : TAO_CONVERGED_STEPTOL;
  PetscCall(VecRestoreArrayRead(f, &b));
  PetscCall(VecRestoreArrayRead(tao->XL, &lo));
  PetscCall(VecRestoreArrayRead(tao->XU, &hi));
  PetscCall(VecDestroy(&f));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateProjected(Tao tao)
{
  PetscFunctionBeginUser;
  tao->ops->solve = SolveProjected;
  PetscFunctionReturn(0);
}

/* K of a string of unit tension on [0, 1], a load per length of -8, a table at depth 1/2 below its ends. */
static PetscErrorCode Pose(PetscInt n, Mat *K, Mat *B, Vec *F, Vec *D)
{
  const PetscReal h = 1. / (PetscReal)(n + 1);

  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 3, NULL, K));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 1, NULL, B));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(MatSetValue(*K, i, i, 2 / h, INSERT_VALUES));
    if (i > 0) PetscCall(MatSetValue(*K, i, i - 1, -1 / h, INSERT_VALUES));
    if (i < n - 1) PetscCall(MatSetValue(*K, i, i + 1, -1 / h, INSERT_VALUES));
    PetscCall(MatSetValue(*B, i, i, -1, INSERT_VALUES)); /* B u <= D: -u <= 1/2 */
  }
  PetscCall(MatAssemblyBegin(*K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(*K, F, D));
  PetscCall(VecSet(*F, -8 * h));
  PetscCall(VecSet(*D, 0.5));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscInt n = 12, its;
  Mat K, B;
  Vec F, D, u, L;
  PetscScalar force;
  HycoSystem system;
  HycoSolver solver;
  HycoKKT kkt;
  const char *method;

  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(TaoRegister("projected", CreateProjected));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  PetscCall(Pose(n, &K, &B, &F, &D));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSystemSetMatrices(system, K, B, B, PETSC_TRUE)); /* B is diagonal: its own transpose */
  PetscCall(HycoSystemSetVectors(system, F, D));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_TAO));
  PetscCall(HycoSolverSetTaoType(solver, "projected"));
  PetscCall(HycoSolverSetFromOptions(solver));
  PetscCall(VecDuplicate(F, &u));
  PetscCall(VecDuplicate(D, &L));
  PetscCall(HycoSolverSolve(solver, u, L));
  PetscCall(HycoSolverGetMethod(solver, &method));
  PetscCall(HycoSolverGetIterations(solver, &its));
  PetscCall(HycoSolverGetKKT(solver, &kkt));
  PetscCall(VecSum(L, &force));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %d iterations, contact force %.12g, largest residual %.1e\n", method,
                        (int)its, (double)force, (double)HycoKKTMax(&kkt)));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&B));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&D));
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&L));
  PetscCall(HycoFinalize());
  return 0;
}
