/* HycoSnapshots: the store of full-order solutions, a folder with one file per parameter value; resumable. */
#ifndef HYCOSNAPSHOTS_H
#define HYCOSNAPSHOTS_H

#include <hycofom.h>
#include <hycosamples.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSnapshots *HycoSnapshots;

/* Called on rank 0 of the store's communicator after each solution of its group: at least done of n are stored, by all
   groups; at the end once with n of n. */
typedef PetscErrorCode (*HycoProgress)(PetscInt done, PetscInt n, void *ctx);

/* Opens (creates if missing) the folder. Collective on `comm`. It keeps a reference to the scene. The caller owns it.
 */
PetscErrorCode HycoSnapshotsOpen(MPI_Comm comm, HycoScene scene, const char folder[], HycoSnapshots *snapshots);
/* Closes; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoSnapshotsDestroy(HycoSnapshots *snapshots);
/*
  Solves full order at each sample that is not in the store yet. Collective. -hyco_groups G splits the communicator:
  G samples at a time, which the groups take from a queue, one after the other: none waits while a sample is left. Each
  solution is written to a temporary name and renamed, so that a run that was killed resumes and loses at most the
  samples in flight. Fails, naming the sample, when a solve does not converge; the other groups then end theirs: a path
  with its next iteration, another solution once it is stored.
*/
PetscErrorCode HycoSnapshotsFill(HycoSnapshots snapshots, HycoSamples samples, HycoProgress progress, void *ctx);
/* solved[n_groups]: how many samples each group of ranks has solved since the store was opened; those that it had are
   not counted. On every rank. Borrowed until the next HycoSnapshotsFill(). Not collective. */
PetscErrorCode HycoSnapshotsGetSolved(HycoSnapshots snapshots, PetscInt *n_groups, const PetscInt *solved[]);

/* How many groups of ranks solve n samples side by side: -hyco_groups, or as many as fit in half the memory when each
   factors the stiffness of its own mesh. Collective. */
PetscErrorCode HycoSnapshotsChooseGroups(MPI_Comm comm, HycoScene scene, PetscInt n, PetscInt *groups);

/* Prints it, in words, on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSnapshotsView(HycoSnapshots object, PetscViewer viewer);
/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSnapshotsViewFromOptions(HycoSnapshots object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
