/* Factors of sparse stiffness matrices, and when they can be reused. */
#include <hycolinear.h>
#include <petsc/private/petscimpl.h> /* PetscObjectStateGet() */

/* Whether K and B are the same objects in the same state as at the last call; notes the present ones. */
PetscErrorCode HycoOperatorStateUpdate(HycoOperatorState *seen, Mat K, Mat B, PetscBool *same)
{
  PetscObjectState k, b = 0;
  PetscObjectId K_id, B_id = 0;

  PetscFunctionBegin;
  PetscCall(PetscObjectStateGet((PetscObject)K, &k));
  if (B) PetscCall(PetscObjectStateGet((PetscObject)B, &b));
  PetscCall(PetscObjectGetId((PetscObject)K, &K_id));
  if (B) PetscCall(PetscObjectGetId((PetscObject)B, &B_id));
  /* Object and state: another matrix may have the same state count. */
  *same = (PetscBool)(seen->K == K_id && seen->B == B_id && seen->K_state == k && seen->B_state == b);
  seen->K = K_id;
  seen->B = B_id;
  seen->K_state = k;
  seen->B_state = b;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MUMPS: no output, with half as much workspace again as it requests. */
static PetscErrorCode PrepareMumps(PC pc, Mat K, const char prefix[])
{
  Mat factor;

  PetscFunctionBegin;
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(MatSetOptionsPrefixFactor(K, prefix)); /* before the factor is created, which otherwise would not read
                                                      its options */
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatMumpsSetIcntl(factor, 1, 0));
  PetscCall(MatMumpsSetIcntl(factor, 14, 50));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Own Cholesky or LU factor for small or banded matrices on one rank, MUMPS otherwise. Options with the prefix may
   choose others. Collective. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp)
{
  PC pc;
  PetscInt n;
  PetscBool thin = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, prefix));
  PetscCall(KSPSetOperators(*ksp, K, K));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, symmetric ? PCCHOLESKY : PCLU));
  /* A small matrix has little fill in any order. */
  if (symmetric && n > 3000) PetscCall(HycoBanded(K, &thin));
  if (thin)
    PetscCall(HycoBandedSolver(pc));
  else if (HycoSize(comm) > 1 || n > 3000)
    PetscCall(PrepareMumps(pc, K, prefix));
  else {
    PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERPETSC));
    PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGND));
  }
  PetscCall(KSPSetFromOptions(*ksp));
  /* A singular matrix is an answer for the callers, and must not end a program that sets
     -ksp_error_if_not_converged. */
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc treats pivots below 2.2e-14 as zero, whatever the unit: this scales the limit by the least diagonal entry.
   In N/m a soft model has small pivots that are no zeros. */
static PetscErrorCode ScaleZeroPivot(KSP ksp, PC pc)
{
  Mat K;
  Vec diagonal;
  PetscInt n;
  PetscReal least = PETSC_MAX_REAL, all;
  const PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(KSPGetOperators(ksp, &K, NULL));
  PetscCall(MatCreateVecs(K, &diagonal, NULL));
  PetscCall(MatGetDiagonal(K, diagonal));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  for (PetscInt i = 0; i < n; i++) {
    /* A zero on the diagonal says nothing about the unit. */
    if (d[i] != 0) least = PetscMin(least, PetscAbsScalar(d[i]));
  }
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecDestroy(&diagonal));
  PetscCallMPI(MPI_Allreduce(&least, &all, 1, MPIU_REAL, MPI_MIN, PetscObjectComm((PetscObject)K)));
  if (all < PETSC_MAX_REAL) PetscCall(PCFactorSetZeroPivot(pc, 100 * PETSC_MACHINE_EPSILON * all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors the operator of ksp; a failure sets *singular. Collective. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular)
{
  PC pc;
  PCFailedReason failed;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(ScaleZeroPivot(ksp, pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCGetFailedReason(pc, &failed));
  for (PetscInt room = 200; failed == PC_FACTOR_OUTMEMORY && room <= 3200;
       room *= 4) { /* MUMPS underestimated its workspace */
    Mat factor;

    PetscCall(PCFactorGetMatrix(pc, &factor));
    /* Per cent of workspace beyond the estimate. */
    PetscCall(MatMumpsSetIcntl(factor, 14, room));
    {
      Mat K;

      PetscCall(KSPGetOperators(ksp, &K, NULL));
      PetscCall(PetscObjectStateIncrease((PetscObject)K)); /* forces a new factorisation */
    }
    PetscCall(KSPSetUp(ksp));
    PetscCall(PCGetFailedReason(pc, &failed));
  }
  PetscCheck(failed != PC_FACTOR_OUTMEMORY, PetscObjectComm((PetscObject)ksp), PETSC_ERR_MEM,
             "a factorisation needs more memory than there is; use more ranks, or -hyco_linear iterative");
  *singular = (PetscBool)(failed != PC_NOERROR);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For mass-like matrices of norms, which are regular by construction. Collective. */
PetscErrorCode HycoDefiniteSolver(Mat A, const char name[], KSP *ksp)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)A);
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(MatSetOption(A, MAT_SPD, PETSC_TRUE));
  PetscCall(HycoDirectSolver(comm, "hyco_norm_", A, PETSC_TRUE, ksp));
  PetscCall(HycoFactor(*ksp, &singular));
  PetscCheck(!singular, comm, PETSC_ERR_PLIB, "%s is singular", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X = A^-1 R for a dense R; the caller destroys X. Collective. */
PetscErrorCode HycoSolveColumns(Mat A, const char name[], Mat R, Mat *X)
{
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(HycoDefiniteSolver(A, name, &ksp));
  PetscCall(MatDuplicate(R, MAT_DO_NOT_COPY_VALUES, X));
  /* By the solver, not its factor: a thin matrix on several ranks has none of its own (HycoBandedSolver()). */
  PetscCall(KSPMatSolve(ksp, R, *X));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
