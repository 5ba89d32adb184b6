/* The place of each key among all different keys of all processes: process r sorts the keys of the r-th part of the
   range. */
#include "plex.h"
#include <stdlib.h>

/* By comparison: a difference would overflow for keys that are products of tags. */
static int RankKeysCompare(const void *a, const void *b)
{
  const PetscInt64 x = *(const PetscInt64 *)a, y = *(const PetscInt64 *)b;

  return (x > y) - (x < y);
}

/* start[r]: the first item of process r, which has counts[r]; start[size]: their number. */
static void RankKeysOffsets(PetscMPIInt size, const PetscMPIInt counts[], PetscMPIInt start[])
{
  start[0] = 0;
  for (PetscMPIInt r = 0; r < size; r++) start[r + 1] = start[r] + counts[r];
}

/* The places of the n keys that this process sorts, among its own; *n_own of them are different. A copy is sorted, as
   the places are needed in the order of the keys. */
static PetscErrorCode RankOwn(PetscInt n, const PetscInt64 key[], PetscInt place[], PetscInt *n_own)
{
  PetscInt64 *sorted;
  PetscInt m = 0;

  PetscFunctionBegin;
  HycoDuplicate(n, key, &sorted);
  if (n) qsort(sorted, (size_t)n, sizeof(*sorted), RankKeysCompare);
  for (PetscInt k = 0; k < n; k++) {
    /* Equal keys get one place. */
    if (!k || sorted[k] != sorted[m - 1]) sorted[m++] = sorted[k];
  }
  for (PetscInt k = 0; k < n; k++)
    place[k] = (PetscInt)((PetscInt64 *)bsearch(&key[k], sorted, (size_t)m, sizeof(*sorted), RankKeysCompare) - sorted);
  *n_own = m;
  PetscCall(PetscFree(sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* place[k] in 0..total-1: the position of key[k] among all distinct keys of all ranks, by ascending value. Equal keys
   get equal places. The range of keys is divided evenly; dense tags thus balance. Memory is that of the keys of a rank.
   Collective. A distributed sort by buckets: two exchanges, and no rank has all keys. */
PetscErrorCode HycoRankKeys(MPI_Comm comm, PetscInt n, const PetscInt64 key[], PetscInt place[], PetscInt *total)
{
  PetscMPIInt size, *n_send, *n_receive, *send, *receive;
  PetscInt64 most = 0, share, *out, *in;
  PetscInt *ranked, *back, *at, n_own, before = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  for (PetscInt k = 0; k < n; k++) most = PetscMax(most, key[k]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_INT64, MPI_MAX, comm));
  /* At least 1, and most / share < size: every key has a process. */
  share = most / size + 1;
  PetscCall(PetscCalloc4(size, &n_send, size, &n_receive, size + 1, &send, size + 1, &receive));
  for (PetscInt k = 0; k < n; k++) n_send[key[k] / share]++;
  PetscCallMPI(MPI_Alltoall(n_send, 1, MPI_INT, n_receive, 1, MPI_INT, comm));
  RankKeysOffsets(size, n_send, send);
  RankKeysOffsets(size, n_receive, receive);
  PetscCall(PetscMalloc4(n, &out, n, &at, n, &back, receive[size], &in));
  PetscCall(PetscMalloc1(receive[size], &ranked));
  for (PetscInt k = 0; k < n; k++) { /* send[r] advances to the end of r's keys, and is reset below */
    at[k] = send[key[k] / share]++;
    out[at[k]] = key[k];
  }
  RankKeysOffsets(size, n_send, send);
  PetscCallMPI(MPI_Alltoallv(out, n_send, send, MPIU_INT64, in, n_receive, receive, MPIU_INT64, comm));
  PetscCall(RankOwn(receive[size], in, ranked, &n_own));
  /* Process r has the r-th part of the range, so that the number of different keys before it is a sum over lower
     ranks. On rank 0 MPI leaves it undefined, hence 0 from the start. */
  PetscCallMPI(MPI_Exscan(&n_own, &before, 1, MPIU_INT, MPI_SUM, comm));
  for (PetscInt k = 0; k < receive[size]; k++) ranked[k] += before;
  PetscCallMPI(MPI_Alltoallv(ranked, n_receive, receive, MPIU_INT, back, n_send, send, MPIU_INT, comm));
  for (PetscInt k = 0; k < n; k++) place[k] = back[at[k]];
  PetscCallMPI(MPI_Allreduce(&n_own, total, 1, MPIU_INT, MPI_SUM, comm));
  PetscCall(PetscFree(ranked));
  PetscCall(PetscFree4(out, at, back, in));
  PetscCall(PetscFree4(n_send, n_receive, send, receive));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tags are PetscInt; the search itself works on 64 bits for keys of two tags (refine_mesh.c). */
PetscErrorCode HycoRankInts(MPI_Comm comm, PetscInt n, const PetscInt key[], PetscInt place[], PetscInt *total)
{
  PetscInt64 *wide;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &wide));
  for (PetscInt k = 0; k < n; k++) wide[k] = key[k];
  PetscCall(HycoRankKeys(comm, n, wide, place, total));
  PetscCall(PetscFree(wide));
  PetscFunctionReturn(PETSC_SUCCESS);
}
