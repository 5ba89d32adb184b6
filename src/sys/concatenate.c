/* Rows of all ranks on rank 0 or on every rank, and rows from each rank to each other. */
#include <hycoimpl.h>

/* Ordered by rank. *all is allocated with room for one more, so that it is never NULL where the rows are. */
static PetscErrorCode ConcatenateParts(MPI_Comm comm, PetscBool everywhere, PetscInt n, const void *mine,
                                       MPI_Datatype type, size_t size, PetscInt *n_all, void *all)
{
  PetscMPIInt ranks, count, *counts, *offsets;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCall(PetscCalloc2(ranks, &counts, ranks + 1, &offsets));
  if (everywhere)
    PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, counts, 1, MPI_INT, comm));
  else
    PetscCallMPI(MPI_Gather(&count, 1, MPI_INT, counts, 1, MPI_INT, 0, comm));
  /* The counts stay 0 on the other ranks. */
  for (PetscMPIInt r = 0; r < ranks; r++) offsets[r + 1] = offsets[r] + counts[r];
  *n_all = offsets[ranks];
  *(void **)all = NULL;
  if (everywhere || HycoRank(comm) == 0) PetscCall(PetscMalloc((size_t)(*n_all + 1) * size, (void **)all));
  if (everywhere)
    PetscCallMPI(MPI_Allgatherv(mine, count, type, *(void **)all, counts, offsets, type, comm));
  else
    PetscCallMPI(MPI_Gatherv(mine, count, type, *(void **)all, counts, offsets, type, 0, comm));
  PetscCall(PetscFree2(counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoConcatenate(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                               PetscInt *n_all, void *all)
{
  PetscFunctionBegin;
  HycoCheckGiven(n_all);
  HycoCheckGiven(all);
  HycoCheckGiven(mine || !n);
  PetscCall(ConcatenateParts(comm, PETSC_FALSE, n, mine, type, size, n_all, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same on every rank. */
PetscErrorCode HycoConcatenateAll(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                                  PetscInt *n_all, void *all)
{
  return ConcatenateParts(comm, PETSC_TRUE, n, mine, type, size, n_all, all);
}

/* Row k goes to rank to[k]; rows of one sender keep their order. A row is one element of an MPI type, so that
   counts fit into an int. */
PetscErrorCode HycoSendRows(MPI_Comm comm, PetscInt n, const PetscMPIInt to[], size_t size, const void *row,
                            PetscInt *n_got, void *got)
{
  PetscMPIInt ranks, *counts, *places, *from, *offsets, n_all;
  MPI_Datatype type;
  char *sorted;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(PetscCalloc4(ranks, &counts, ranks + 1, &places, ranks, &from, ranks + 1, &offsets));
  PetscCall(PetscMalloc1((size_t)n * size, &sorted));
  for (PetscInt k = 0; k < n; k++) counts[to[k]]++;
  PetscCallMPI(MPI_Alltoall(counts, 1, MPI_INT, from, 1, MPI_INT, comm));
  for (PetscMPIInt r = 0; r < ranks; r++) {
    places[r + 1] = places[r] + counts[r];
    offsets[r + 1] = offsets[r] + from[r];
  }
  for (PetscInt k = 0; k < n; k++) /* places[r] advances to the end of r's rows */
    PetscCall(PetscMemcpy(sorted + (size_t)places[to[k]]++ * size, (const char *)row + (size_t)k * size, size));
  for (PetscMPIInt r = 0; r < ranks; r++) places[r] -= counts[r];
  n_all = offsets[ranks];
  PetscCall(PetscMalloc((size_t)(n_all + 1) * size, (void **)got));
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)size, MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Alltoallv(sorted, counts, places, type, *(void **)got, from, offsets, type, comm));
  PetscCallMPI(MPI_Type_free(&type));
  *n_got = n_all;
  PetscCall(PetscFree(sorted));
  PetscCall(PetscFree4(counts, places, from, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}
