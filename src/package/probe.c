/* The objects of PETSc that read options of hyco's prefixes, each made once to find out whether it reads an option. */
#include <hycoimpl.h>
#include <hycolinear.h>
#include <hycotao.h>
#include <stdio.h>

/* K = 1. */
static PetscErrorCode CreateOne(Mat *K)
{
  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, NULL, K));
  PetscCall(MatSetValue(*K, 0, 0, 1, INSERT_VALUES));
  PetscCall(HycoMatAssemble(*K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solvers of the primal form. */
static PetscErrorCode ProbeLinear(void)
{
  Mat K;
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(CreateOne(&K));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_primal_", K, PETSC_TRUE, &ksp));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(HycoIterativeSolver(PETSC_COMM_SELF, "hyco_primal_", K, &ksp));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProbeTao(const char type[])
{
  Tao tao;

  PetscFunctionBegin;
  PetscCall(TaoCreate(PETSC_COMM_SELF, &tao));
  PetscCall(TaoSetOptionsPrefix(tao, "hyco_"));
  PetscCall(TaoSetType(tao, type));
  PetscCall(HycoTaoSetKSPPrefix(tao));
  PetscCall(TaoSetFromOptions(tao));
  PetscCall(TaoDestroy(&tao));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MUMPS's controls are numbers. */
static PetscErrorCode ProbeMumps(const char name[])
{
  char dashed[HYCO_LINE];
  int k, end = 0;
  PetscBool set;

  PetscFunctionBegin;
  if ((sscanf(name, "hyco_mumps_icntl_%d%n", &k, &end) == 1 && k >= 1 && k <= 58 && !name[end]) ||
      (sscanf(name, "hyco_mumps_cntl_%d%n", &k, &end) == 1 && k >= 1 && k <= 15 && !name[end])) {
    PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
    PetscCall(PetscOptionsHasName(NULL, NULL, dashed, &set));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolversProbe(const char name[])
{
  const char **types;
  int n;

  PetscFunctionBegin;
  PetscCall(ProbeMumps(name));
  PetscCall(ProbeLinear());
  if (strncasecmp(name, "hyco_tao_", 9)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFunctionListGet(TaoList, &types, &n));
  for (int k = 0; k < n; k++) {
    char why[HYCO_LINE];
    PetscErrorCode caught;

    if (types[k]) HycoCatch(ProbeTao(types[k]), caught, why);
  }
  PetscCall(PetscFree(types));
  PetscFunctionReturn(PETSC_SUCCESS);
}
