/* HycoSnapshots' struct and internal functions. */
#ifndef HYCOSNAPSHOTSIMPL_H
#define HYCOSNAPSHOTSIMPL_H

#include <hycofomimpl.h>
#include <hycoh5.h>
#include <hycoqueue.h>
#include <hycosnapshots.h>

struct _p_HycoSnapshots {
  PETSCHEADER(int);
  HycoScene scene; /* referenced */
  char folder[PETSC_MAX_PATH_LEN];
  unsigned long long fingerprint;
  PetscInt n_groups, *solved; /* largest number of groups that have solved at a time; number of solutions of each
                                 (room for every rank) */
  PetscBool monitor;          /* -hyco_groups_monitor */
  PetscInt unsolved;          /* see HycoSnapshotsGetBalance() */
  PetscReal bytes, *written;  /* bytes of solutions written by this rank, and by each */
  PetscReal spent;            /* processor time of the solutions of this rank's groups, counted on their first ranks */
  PetscInt timed;             /* their number */
  PetscReal cpu;              /* of a solution, mean */
  PetscInt n_timed;           /* of all ranks */
  PetscReal sliding;          /* the largest of all points that were filled: HycoSummary */
  PetscReal time_error;       /* the same of the paths that were solved: HycoHistory */
  PetscInt n_lost, room_lost; /* points of all fills without an equilibrium: their number and, on rank 0, their keys */
  unsigned long long *lost;
  char first_lost[HYCO_LINE];         /* the first of them, with the reason; "": there is none */
  HycoH5 last;                        /* the file that was read last, checked and open; or NULL */
  char last_path[PETSC_MAX_PATH_LEN]; /* its name */
  PetscInt n_pieces;                  /* finished pieces of this training that have files, by their keys; rank 0 */
  unsigned long long *piece;
};

/* Fails if an open file is not of this scene and mesh. Not collective. */
PetscErrorCode HycoSnapshotsCheckFile(HycoSnapshots store, HycoH5 file, const char path[]);

/* A finished piece of a training, up to HYCO_PIECE_ARRAYS arrays; n: of this rank's numbers, 0 on ranks that have
   none. */
#define HYCO_PIECE_ARRAYS 4
typedef struct {
  PetscInt n;
  PetscReal *value;
} HycoPieceArray;

/* The key of a piece, continued (start with HYCO_HASH_START); the same key on every rank, from those of all
   (collective). It must contain all that the piece follows from. */
unsigned long long HycoPieceAdd(unsigned long long key, size_t bytes, const void *data);
PetscErrorCode HycoPieceJoin(MPI_Comm comm, unsigned long long *key);
/* Reads a piece that this or an interrupted training has kept into the arrays, if there is one; keeps one; removes
   those of this training, once its model is written. The key is that of rank 0. Fails if the folder's pieces are of
   another scene. Collective; removing is not. */
PetscErrorCode HycoSnapshotsFindPiece(HycoSnapshots store, unsigned long long key, PetscInt n,
                                      const HycoPieceArray array[], PetscBool *found);
PetscErrorCode HycoSnapshotsKeepPiece(HycoSnapshots store, unsigned long long key, PetscInt n,
                                      const HycoPieceArray array[]);
PetscErrorCode HycoSnapshotsDropPieces(HycoSnapshots store);

/* Reads -hyco_groups_monitor; prints a line about this rank's group, with the event's number, on the group's first
   rank, if it was given. Collective; not collective. */
PetscErrorCode HycoSnapshotsReadMonitor(HycoSnapshots store);
PetscErrorCode HycoSnapshotsNote(HycoSnapshots store, HycoQueue queue, const char format[], ...)
    PETSC_ATTRIBUTE_FORMAT(3, 4);

/* Columns of a sample: 1, or the number of listed times of a history. */
static inline PetscInt HycoSnapshotsSteps(HycoScene scene)
{
  return PetscMax(1, scene->n_times);
}
/* Components of the tangential forces, and the dissipated work. */
#define HYCO_SNAPSHOT_FRICTION 4
extern const char *const HycoSnapshotFriction[HYCO_SNAPSHOT_FRICTION];
/*
  One field of the n samples from `first` on as a dense matrix, with a column per sample, for a scene with a history one
  per listed time of each, sample after sample: "U" (n_nodes x dim unrolled), "lambda" (n_contacts), "sigma" (n_cells x
  n_sigma unrolled), "force" (as U); with a history "inelastic" (n_cells, accumulated) and, if the scene of the first
  run names one as an output, "reaction" (as U); with friction HycoSnapshotFriction[] (n_contacts). Rows in the mesh
  file's order, in contiguous blocks over comm; the rows of a node or cell stay on one rank. Collective; the caller owns
  it. A field without rows gives a matrix of zero rows.
*/
PetscErrorCode HycoSnapshotsGetField(HycoSnapshots store, HycoSamples samples, PetscInt first, PetscInt n,
                                     const char field[], PetscInt block, Mat *S);
/* The number of rows of a field. Collective. */
PetscErrorCode HycoSnapshotsGetRows(HycoSnapshots store, HycoSamples samples, const char field[], PetscInt *n);
/* For a path, the displacements at full order's steps between listed times (at most five between two; none in files
   of older versions), a column each; `rows` rows of `total` on this rank. Collective; the caller owns it. */
PetscErrorCode HycoSnapshotsGetBetween(HycoSnapshots store, const PetscReal mu[], PetscInt rows, PetscInt total,
                                       Mat *U);
/* The n values from `first` on of one field of the solution at mu, with a history at listed time k (else 0), in the
   caller's memory. Not collective. */
PetscErrorCode HycoSnapshotsReadRows(HycoSnapshots store, const PetscReal mu[], PetscInt k, const char field[],
                                     PetscInt first, PetscInt n, PetscReal value[]);
/* Whether the solution there has a field. Not collective. */
PetscErrorCode HycoSnapshotsHas(HycoSnapshots store, const PetscReal mu[], PetscInt k, const char field[],
                                PetscBool *has);
/* The times of the steps of the path at mu (the caller frees them). Not collective. */
PetscErrorCode HycoSnapshotsReadTaken(HycoSnapshots store, const PetscReal mu[], PetscInt *n, PetscReal **taken,
                                      PetscReal *time_error);

#endif
