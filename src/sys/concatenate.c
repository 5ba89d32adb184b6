/* Gathers arrays of all ranks on rank 0. */
#include <hycoimpl.h>

PetscErrorCode HycoConcatenate(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                               PetscInt *n_all, void *all)
{
  PetscMPIInt rank, ranks, count, *counts, *offsets;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCall(PetscCalloc2(ranks, &counts, ranks + 1, &offsets));
  PetscCallMPI(MPI_Gather(&count, 1, MPI_INT, counts, 1, MPI_INT, 0, comm));
  for (PetscMPIInt r = 0; r < ranks && rank == 0; r++) offsets[r + 1] = offsets[r] + counts[r];
  *n_all = offsets[ranks];
  *(void **)all = NULL;
  if (rank == 0) PetscCall(PetscMalloc((size_t)(*n_all + 1) * size, (void **)all));
  PetscCallMPI(MPI_Gatherv(mine, count, type, *(void **)all, counts, offsets, type, 0, comm));
  PetscCall(PetscFree2(counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}
