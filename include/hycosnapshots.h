/* HycoSnapshots: the store of full-order solutions, a folder with one file per parameter value; resumable. */
#ifndef HYCOSNAPSHOTS_H
#define HYCOSNAPSHOTS_H

#include <hycofom.h>
#include <hycosamples.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSnapshots *HycoSnapshots;
typedef struct _HycoQueue *HycoQueue; /* hycoqueue.h */

/* Called on rank 0 of the store's communicator after each solution of its group: at least `done` of n solutions are
   stored, by all groups. At the end it is called once with n of n. */
typedef PetscErrorCode (*HycoProgress)(PetscInt done, PetscInt n, void *ctx);

/* Opens the folder, or creates it. Collective on `comm`. The store holds a reference to the scene. The caller owns it.
 */
PetscErrorCode HycoSnapshotsOpen(MPI_Comm comm, HycoScene scene, const char folder[], HycoSnapshots *snapshots);
/* Closes; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoSnapshotsDestroy(HycoSnapshots *snapshots);
/*
  Solves full order at each sample that is not in the store yet. Collective. -hyco_groups G splits the communicator into
  G groups, which take the samples from a queue, one at a time: no group waits while a sample is left. Each solution is
  written under a temporary name and renamed, so that a run that was killed can resume and loses at most the samples in
  progress. Samples at which no contact forces balance the loads are noted in the folder, and removed from the set.
  Fails, with the sample, if another solve does not converge. The other groups then stop: a path at its next
  iteration, another solution when it is stored.
*/
PetscErrorCode HycoSnapshotsFill(HycoSnapshots snapshots, HycoSamples samples, HycoProgress progress, void *ctx);
/* solved[n_groups]: how many samples each group of ranks has solved since the store was opened; those that it had are
   not counted. On every rank. Borrowed until the next HycoSnapshotsFill(). Not collective. */
PetscErrorCode HycoSnapshotsGetSolved(HycoSnapshots snapshots, PetscInt *n_groups, const PetscInt *solved[]);
/* The balance of the work since the store was opened. unsolved: how many samples were not solved yet when the first
   group found none to begin; each was in another group, so that it is smaller than their number (the largest of several
   fills). written: the bytes of solutions written by each rank of the store's communicator. On every rank. Borrowed
   until the next HycoSnapshotsFill(). Not collective. */
PetscErrorCode HycoSnapshotsGetBalance(HycoSnapshots snapshots, PetscInt *unsolved, const PetscReal *written[]);

/* Gets the number of groups of ranks that solve n samples at the same time: -hyco_groups, or as many as fit into half
   of the memory if each factors the stiffness of its own mesh. Collective. */
PetscErrorCode HycoSnapshotsChooseGroups(MPI_Comm comm, HycoScene scene, PetscInt n, PetscInt *groups);
/* Creates a queue of the points list[n] of mu (n_par each) for as many groups as HycoSnapshotsChooseGroups() chooses
   for n_all, the points of the whole set: a solution does not depend on how many others are missing. Points with a
   common stiffness, and thus a common factor, are of one kind. Everything is the same on every rank. Collective. */
PetscErrorCode HycoSnapshotsCreateQueue(MPI_Comm comm, HycoScene scene, PetscInt n_par, const PetscReal mu[],
                                        PetscInt n, const PetscInt list[], PetscInt n_all, HycoQueue *queue);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSnapshotsView(HycoSnapshots object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSnapshotsViewFromOptions(HycoSnapshots object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
