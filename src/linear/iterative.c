/*
  For stiffness matrices whose factor does not fit in memory: conjugate gradients with smoothed aggregation (PETSc's
  GAMG), which gets the rigid motions from the matrix's near-null space. -hyco_primal_pc_type hypre selects BoomerAMG
  instead.
*/
#include <hycolinear.h>

/* The accuracy is far below that of a solution, as active set methods read signs from residuals. The limit of 2000
   iterations ends stagnation; the caller judges by the residual. */
PetscErrorCode HycoIterativeSolver(MPI_Comm comm, const char prefix[], Mat K, KSP *ksp)
{
  PC pc;

  PetscFunctionBegin;
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, prefix));
  PetscCall(KSPSetOperators(*ksp, K, K));
  PetscCall(KSPSetType(*ksp, KSPCG));
  PetscCall(KSPSetInitialGuessNonzero(*ksp, PETSC_TRUE));
  PetscCall(KSPSetTolerances(*ksp, 1e-11, 1e-300, 1e10, 2000));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCGAMG));
  PetscCall(PCGAMGSetType(pc, PCGAMGAGG));
  /* Aggregates depend on the pattern; the next set changes few entries. */
  PetscCall(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
