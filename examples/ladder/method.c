/*
  A complementarity method of one's own, registered as a type of Tao and chosen by option: projected Gauss-Seidel.

      build/ladder/method -scene examples/blocks -mu 0.05,0.06 -hyco_solver_type tao -hyco_tao_type projected

  A type of Tao is given the bounds and w = H y - f by its Hessian and gradient, scaled to a unit diagonal; in the dual
  form y are the contact forces. hyco recomputes the KKT residuals, and falls back on its own methods where they are too
  large.
*/
#include <hyco.h>
#include <petsc/private/taoimpl.h>

/* y_i = median(lo_i, y_i - (H y - f)_i / H_ii, hi_i), row by row, on one process; *change: the largest step. */
static PetscErrorCode Sweep(Mat H, const PetscScalar f[], const PetscScalar lo[], const PetscScalar hi[], PetscInt n,
                            PetscScalar y[], PetscReal *change)
{
  PetscFunctionBeginUser;
  *change = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt entries;
    const PetscInt *column;
    const PetscScalar *value;
    PetscScalar w = -f[i], diagonal = 1, before = y[i];

    PetscCall(MatGetRow(H, i, &entries, &column, &value));
    for (PetscInt k = 0; k < entries; k++) w += value[k] * y[column[k]];
    for (PetscInt k = 0; k < entries; k++) diagonal = column[k] == i ? value[k] : diagonal;
    PetscCall(MatRestoreRow(H, i, &entries, &column, &value));
    y[i] = PetscMin(hi[i], PetscMax(lo[i], y[i] - w / diagonal));
    *change = PetscMax(*change, PetscAbsScalar(y[i] - before));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Solve(Tao tao)
{
  Vec vec[4] = {tao->gradient, tao->XL, tao->XU, tao->solution};
  PetscScalar *f, *lo, *hi, *y, **at[4] = {&f, &lo, &hi, &y};
  PetscInt n;
  PetscReal change = 1;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(tao->solution, &n));
  PetscCall(VecSet(tao->solution, 0));
  PetscCall(VecDuplicate(tao->solution, &vec[0]));
  PetscCall(TaoComputeGradient(tao, tao->solution, vec[0])); /* -f, where y = 0 */
  PetscCall(VecScale(vec[0], -1));
  for (tao->niter = 0; change > 1e-12 && tao->niter < tao->max_it; tao->niter++) {
    PetscCall(TaoMonitor(tao, tao->niter, 0, change, 0, 1));
    for (int k = 0; k < 4; k++) PetscCall(VecGetArray(vec[k], at[k]));
    PetscCall(Sweep(tao->hessian, f, lo, hi, n, y, &change));
    for (int k = 0; k < 4; k++) PetscCall(VecRestoreArray(vec[k], at[k]));
  }
  tao->reason = change > 1e-12 ? TAO_DIVERGED_MAXITS : TAO_CONVERGED_STEPTOL;
  PetscCall(VecDestroy(&vec[0]));
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(Tao tao)
{
  PetscFunctionBeginUser;
  tao->ops->solve = Solve;
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoScene scene;
  HycoFOM fom;
  HycoSolver solver;
  HycoSummary s;
  const char *method;
  char folder[PETSC_MAX_PATH_LEN] = "examples/blocks";
  PetscReal mu[8];
  PetscInt n = 8;

  PetscFunctionBeginUser;
  PetscCall(TaoRegister("projected", Create)); /* before a solver reads -hyco_tao_type */
  PetscCall(PetscOptionsGetString(NULL, NULL, "-scene", folder, sizeof(folder), NULL));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n, NULL));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  PetscCall(HycoSolverGetMethod(solver, &method));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s by %s: %d iterations, force %.12g, largest residual %.1e\n",
                        HycoReasonName(s.reason), method, (int)s.iterations, (double)s.total_contact_force,
                        (double)HycoKKTMax(&s.kkt)));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
