/* TAO's bound-constrained solvers on a quadratic: min 1/2 y^T H y - f^T y, lo <= y <= hi. */
#include <hycosolverimpl.h>
#include <petsctao.h>

typedef struct {
  Mat H;
  Vec f;
} Quadratic;

static PetscErrorCode Objective(Tao tao, Vec y, PetscReal *value, Vec gradient, void *ctx)
{
  Quadratic *q = (Quadratic *)ctx;
  PetscScalar yHy, fy;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(q->H, y, gradient));
  PetscCall(VecDot(y, gradient, &yHy));
  PetscCall(VecDot(y, q->f, &fy));
  PetscCall(VecAXPY(gradient, -1, q->f));
  *value = yHy / 2 - fy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Hessian(Tao tao, Vec y, Mat H, Mat P, void *ctx)
{
  PetscFunctionBegin;
  (void)tao, (void)y, (void)H, (void)P, (void)ctx; /* constant */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTaoBoundQP(Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its, PetscBool *solved)
{
  Quadratic q = {H, f};
  Tao tao;
  TaoConvergedReason why;

  PetscFunctionBegin;
  PetscCall(TaoCreate(PetscObjectComm((PetscObject)y), &tao));
  PetscCall(TaoSetType(tao, TAOGPCG));
  PetscCall(TaoSetOptionsPrefix(tao, "hyco_"));
  PetscCall(TaoSetSolution(tao, y));
  PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Objective, &q));
  PetscCall(TaoSetHessian(tao, H, H, Hessian, NULL));
  PetscCall(TaoSetVariableBounds(tao, lo, hi));
  PetscCall(TaoSetTolerances(tao, 1e-13, 1e-14, 0));
  PetscCall(TaoSetFromOptions(tao));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetConvergedReason(tao, &why));
  PetscCall(TaoGetIterationNumber(tao, its));
  *solved = (PetscBool)(why > 0);
  PetscCall(TaoDestroy(&tao));
  PetscFunctionReturn(PETSC_SUCCESS);
}
