/* Entries of PETSc's vectors in arrays, and assembly in one call. */
#include <hycoimpl.h>

/* Every rank gets all entries, for vectors of the contacts' size alone. Counts and offsets are ints of MPI, which
   PetscMPIIntCast() checks. */
PetscErrorCode HycoVecGather(Vec v, PetscReal all[])
{
  PetscMPIInt ranks, count, *counts, *offsets;
  const PetscInt *ranges;
  const PetscScalar *mine;
  PetscInt n;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(HycoComm(v), &ranks));
  PetscCall(VecGetLocalSize(v, &n));
  if (ranks == 1) {
    PetscCall(HycoVecRead(v, n, all));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetOwnershipRanges(v, &ranges));
  PetscCall(PetscMalloc2(ranks, &counts, ranks, &offsets));
  for (PetscMPIInt r = 0; r < ranks; r++) {
    PetscCall(PetscMPIIntCast(ranges[r + 1] - ranges[r], &counts[r]));
    PetscCall(PetscMPIIntCast(ranges[r], &offsets[r]));
  }
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCall(VecGetArrayRead(v, &mine));
  PetscCallMPI(MPI_Allgatherv(mine, count, MPIU_REAL, all, counts, offsets, MPIU_REAL, HycoComm(v)));
  PetscCall(VecRestoreArrayRead(v, &mine));
  PetscCall(PetscFree2(counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoVecRead(Vec v, PetscInt n, PetscReal value[])
{
  const PetscScalar *own;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(v, &own));
  PetscCall(PetscArraycpy(value, own, n));
  PetscCall(VecRestoreArrayRead(v, &own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoVecWrite(Vec v, PetscInt n, const PetscReal value[])
{
  PetscScalar *own;

  PetscFunctionBegin;
  PetscCall(VecGetArray(v, &own));
  PetscCall(PetscArraycpy(own, value, n));
  PetscCall(VecRestoreArray(v, &own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoScatter(VecScatter scatter, Vec from, Vec to)
{
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter, from, to, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, from, to, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMatAssemble(Mat A)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoVecAssemble(Vec v)
{
  PetscFunctionBegin;
  PetscCall(VecAssemblyBegin(v));
  PetscCall(VecAssemblyEnd(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
