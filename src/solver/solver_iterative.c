/* Iterative solves in the forms: what multigrid must know in gap coordinates, and problems without contact. */
#include <hycosolverimpl.h>

/* y = T^-1 x: each pivot holds its contact's B x. */
static PetscErrorCode ToGaps(HycoSolver s, Vec x, Vec y)
{
  Vec gap;
  const PetscScalar *g;

  PetscFunctionBegin;
  PetscCall(VecCopy(x, y));
  PetscCall(MatCreateVecs(s->system->B, NULL, &gap));
  PetscCall(MatMult(s->system->B, x, gap));
  PetscCall(VecGetArrayRead(gap, &g));
  for (PetscInt k = 0; k < s->n_pivots; k++) PetscCall(VecSetValue(y, s->pivot[k], g[s->contact[k]], INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(gap, &g));
  PetscCall(VecAssemblyBegin(y));
  PetscCall(VecAssemblyEnd(y));
  PetscCall(VecDestroy(&gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGapNearKernel(HycoSolver s, Mat Kw)
{
  MatNullSpace near = NULL, mine;
  PetscBool constant;
  PetscInt n;
  const Vec *x;
  Vec *y;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(s->system->K, &near));
  if (!near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &x));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicateVecs(x[0], n, &y));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(ToGaps(s, x[k], y[k]));
    for (PetscInt j = 0; j < k; j++) {
      PetscScalar dot;

      PetscCall(VecDot(y[k], y[j], &dot));
      PetscCall(VecAXPY(y[k], -dot, y[j]));
    }
    PetscCall(VecNormalize(y[k], NULL));
  }
  PetscCall(MatNullSpaceCreate(HycoComm(s), PETSC_FALSE, n, y, &mine));
  PetscCall(MatSetNearNullSpace(Kw, mine));
  PetscCall(MatNullSpaceDestroy(&mine));
  PetscCall(VecDestroyVecs(n, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp)
{
  KSPType method;
  PCType pc;
  MatSolverType package = NULL;
  PC handle;

  PetscFunctionBegin;
  if (!ksp) {
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "direct: mumps, %.3g GB estimated",
                            (double)(1e-9 * s->bytes)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(KSPGetType(ksp, &method));
  PetscCall(KSPGetPC(ksp, &handle));
  PetscCall(PCGetType(handle, &pc));
  if (!s->iterative) PetscCall(PCFactorGetMatSolverType(handle, &package));
  if (package)
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "direct: %s by %s", pc, package));
  else
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "iterative: %s with %s%s", method, pc,
                            s->why_iterative));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolveIterative(HycoSolver s, Vec x, PetscBool *solved)
{
  KSPConvergedReason why;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(s->method, "linear", sizeof(s->method)));
  PetscCall(HycoOperatorStateUpdate(&s->transformed, s->system->K, NULL, &same));
  if (!same) {
    PetscCall(KSPDestroy(&s->ksp_gap));
    PetscCall(HycoIterativeSolver(HycoComm(s), "hyco_primal_", s->system->K, &s->ksp_gap));
  }
  PetscCall(VecSet(x, 0));
  PetscCall(KSPSolve(s->ksp_gap, s->system->F, x));
  PetscCall(KSPGetConvergedReason(s->ksp_gap, &why));
  PetscCall(HycoNameLinear(s, s->ksp_gap));
  *solved = (PetscBool)(why > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
