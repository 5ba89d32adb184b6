/* Factors of sparse stiffnesses, and knowing when they are still good. */
#include <hycolinear.h>
#include <petsc/private/petscimpl.h> /* PetscObjectStateGet() */

PetscErrorCode HycoSeenUpdate(HycoSeen *seen, Mat K, Mat B, PetscBool *same)
{
  PetscObjectState k, b = 0;
  PetscObjectId K_id, B_id = 0;

  PetscFunctionBegin;
  PetscCall(PetscObjectStateGet((PetscObject)K, &k));
  if (B) PetscCall(PetscObjectStateGet((PetscObject)B, &b));
  PetscCall(PetscObjectGetId((PetscObject)K, &K_id));
  if (B) PetscCall(PetscObjectGetId((PetscObject)B, &B_id));
  *same = (PetscBool)(seen->K == K_id && seen->B == B_id && seen->K_state == k && seen->B_state == b);
  seen->K = K_id;
  seen->B = B_id;
  seen->K_state = k;
  seen->B_state = b;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MUMPS: quiet, with half as much workspace again as it asks for. */
static PetscErrorCode PrepareMumps(PC pc, Mat K, const char prefix[])
{
  Mat factor;

  PetscFunctionBegin;
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(MatSetOptionsPrefixFactor(K, prefix)); /* before the factor is made, or it would not see its options */
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatMumpsSetIcntl(factor, 1, 0));
  PetscCall(MatMumpsSetIcntl(factor, 14, 50));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp)
{
  PC pc;
  PetscInt n;
  PetscMPIInt size;
  PetscBool thin = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, prefix));
  PetscCall(KSPSetOperators(*ksp, K, K));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, symmetric ? PCCHOLESKY : PCLU));
  if (symmetric && n > 3000) PetscCall(HycoThin(K, &thin));
  if (thin)
    PetscCall(HycoThinSolver(pc));
  else if (size > 1 || n > 3000)
    PetscCall(PrepareMumps(pc, K, prefix));
  else {
    PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERPETSC));
    PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGND));
  }
  PetscCall(KSPSetFromOptions(*ksp));
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular)
{
  PC pc;
  PCFailedReason failed;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCGetFailedReason(pc, &failed));
  for (PetscInt room = 200; failed == PC_FACTOR_OUTMEMORY && room <= 3200;
       room *= 4) { /* MUMPS underestimated its workspace */
    Mat factor;

    PetscCall(PCFactorGetMatrix(pc, &factor));
    PetscCall(MatMumpsSetIcntl(factor, 14, room));
    {
      Mat K;

      PetscCall(KSPGetOperators(ksp, &K, NULL));
      PetscCall(PetscObjectStateIncrease((PetscObject)K)); /* so that it is factored again */
    }
    PetscCall(KSPSetUp(ksp));
    PetscCall(PCGetFailedReason(pc, &failed));
  }
  *singular = (PetscBool)(failed != PC_NOERROR);
  PetscFunctionReturn(PETSC_SUCCESS);
}
