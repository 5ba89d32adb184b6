/*
  Finished pieces of a training that are no solutions: results of a body's factor, in files of the store's folder until
  the model is written. An interrupted training finds those that it had finished. A file is named by a hash of all that
  the piece follows from, so that a piece of other settings is another file; it is complete or absent.
*/
#include <hycofile.h>
#include <hycosnapshotsimpl.h>
#include <dirent.h>
#include <string.h>
#include <unistd.h>

#define PREFIX "bodies-"

unsigned long long HycoPieceAdd(unsigned long long key, size_t bytes, const void *data)
{
  unsigned char seal[HYCO_CHECKSUM];

  HycoChecksumMake(data, bytes, seal);
  return HycoHash(key, seal, sizeof(seal));
}

PetscErrorCode HycoPieceJoin(MPI_Comm comm, unsigned long long *key)
{
  const PetscMPIInt n = HycoSize(comm);
  unsigned long long *all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &all));
  PetscCallMPI(MPI_Allgather(key, 1, MPI_UNSIGNED_LONG_LONG, all, 1, MPI_UNSIGNED_LONG_LONG, comm));
  /* The number of ranks is a part of it: sums of other ranks differ by round-off. */
  *key = HycoHash(HYCO_HASH_START, all, (size_t)n * sizeof(*all));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PiecePath(HycoSnapshots s, unsigned long long key, char path[PETSC_MAX_PATH_LEN])
{
  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/" PREFIX "%016llx.h5", s->folder, key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RestartCacheOpen(HycoSnapshots s, const char path[], HycoH5 *h)
{
  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(path, "remove it and run again", h));
  HycoOnError(HycoSnapshotsCheckFile(s, *h, path), PetscCall(HycoH5Close(h, PETSC_FALSE)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses the folder if its pieces belong to another scene: one of them shows it. Rank 0. */
static PetscErrorCode CheckFolder(HycoSnapshots s)
{
  DIR *folder = opendir(s->folder);
  char path[PETSC_MAX_PATH_LEN] = "";
  HycoH5 h;

  PetscFunctionBegin;
  for (const struct dirent *e = folder ? readdir(folder) : NULL; e && !path[0]; e = readdir(folder)) {
    unsigned long long key;
    int end = 0;

    if (sscanf(e->d_name, PREFIX "%16llx.h5%n", &key, &end) == 1 && end && !e->d_name[end])
      PetscCall(PiecePath(s, key, path));
  }
  if (folder) closedir(folder);
  if (!path[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RestartCacheOpen(s, path, &h));
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Notes a file that the end of the training removes. The first one of a run looks at what is there. Rank 0. */
static PetscErrorCode RestartCacheNote(HycoSnapshots s, unsigned long long key)
{
  PetscFunctionBegin;
  if (!s->n_pieces) PetscCall(CheckFolder(s));
  PetscCall(PetscRealloc((size_t)(s->n_pieces + 1) * sizeof(*s->piece), &s->piece));
  s->piece[s->n_pieces++] = key;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* first[k]: of this rank's rows of array k; all[k]: rows of all ranks. Collective. */
static PetscErrorCode RestartCacheRows(MPI_Comm comm, PetscInt n, const HycoPieceArray array[], PetscInt first[],
                                       PetscInt all[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    PetscCallMPI(MPI_Scan(&array[k].n, &first[k], 1, MPIU_INT, MPI_SUM, comm));
    first[k] -= array[k].n;
    all[k] = array[k].n;
  }
  HycoAllreduce(all, n, MPIU_INT, MPI_SUM, comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const names[HYCO_PIECE_ARRAYS] = {"a", "b", "c", "d"};

/* This rank's rows. */
static PetscErrorCode RestartCacheRead(HycoSnapshots s, const char path[], PetscInt n, const HycoPieceArray array[],
                                       const PetscInt first[])
{
  HycoH5 h;
  PetscErrorCode ierr = PETSC_SUCCESS;
  PetscInt rows = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) rows += array[k].n;
  if (!rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RestartCacheOpen(s, path, &h));
  for (PetscInt k = 0; k < n && !ierr; k++) ierr = HycoH5ReadRows(h, names[k], first[k], array[k].n, 1, array[k].value);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSnapshotsFindPiece(HycoSnapshots s, unsigned long long key, PetscInt n, const HycoPieceArray array[],
                                      PetscBool *found)
{
  PetscInt first[HYCO_PIECE_ARRAYS], all[HYCO_PIECE_ARRAYS];
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&key, 1, MPI_UNSIGNED_LONG_LONG, 0, HycoComm(s)));
  PetscCall(PiecePath(s, key, path));
  HycoOnRoot(HycoComm(s), RestartCacheNote(s, key));
  /* One rank looks into the folder: others might see it in another state. */
  *found = (PetscBool)(HycoRank(HycoComm(s)) == 0 && access(path, F_OK) == 0);
  PetscCallMPI(MPI_Bcast(found, 1, HYCO_MPI_BOOL, 0, HycoComm(s)));
  if (!*found) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RestartCacheRows(HycoComm(s), n, array, first, all));
  HycoOnEach(HycoComm(s), RestartCacheRead(s, path, n, array, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fingerprint, by which a file of another scene is refused, then the arrays. Collective. */
static PetscErrorCode RestartCacheWrite(HycoSnapshots s, HycoH5 h, PetscInt n, const HycoPieceArray array[])
{
  PetscInt first[HYCO_PIECE_ARRAYS], all[HYCO_PIECE_ARRAYS];
  char fingerprint[32];

  PetscFunctionBegin;
  snprintf(fingerprint, sizeof(fingerprint), "%016llx", s->fingerprint);
  HycoOnRoot(HycoComm(s), HycoH5WriteText(h, "fingerprint", fingerprint));
  PetscCall(RestartCacheRows(HycoComm(s), n, array, first, all));
  for (PetscInt k = 0; k < n; k++) {
    if (all[k]) PetscCall(HycoH5WriteRows(h, names[k], MPIU_REAL, all[k], 1, first[k], array[k].n, array[k].value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSnapshotsKeepPiece(HycoSnapshots s, unsigned long long key, PetscInt n, const HycoPieceArray array[])
{
  char path[PETSC_MAX_PATH_LEN];
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&key, 1, MPI_UNSIGNED_LONG_LONG, 0, HycoComm(s)));
  PetscCall(PiecePath(s, key, path));
  PetscCall(HycoH5CreateShared(HycoComm(s), path, &h));
  ierr = RestartCacheWrite(s, h, n, array);
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSnapshotsDropPieces(HycoSnapshots s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_pieces; k++) {
    char path[PETSC_MAX_PATH_LEN];

    PetscCall(PiecePath(s, s->piece[k], path));
    (void)remove(path); /* another training with this folder may have removed it */
  }
  PetscCall(PetscFree(s->piece));
  s->n_pieces = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
