/* HycoQueue: tasks that groups of ranks take one by one until all are done. */
#ifndef HYCOQUEUE_H
#define HYCOQUEUE_H

#include <hycoprogram.h>

#if defined(__cplusplus)
extern "C" {
#endif

/*
  n tasks of one or several kinds: tasks of a kind share data that a group computes once (a factor of the stiffness). A
  group continues with its kind while tasks of it remain, then takes a kind that no group has begun, then one of the
  kind with most tasks left: no group is idle while a task is left. Counters in an MPI window on rank 0 record the tasks
  that are taken; there is no master process. Which group solves which task depends on the tasks' durations.

  If the network has no atomic operations of its own, a group that takes a task waits until rank 0 of the communicator
  is inside an MPI call.
*/
typedef struct _HycoQueue *HycoQueue;

/* Splits comm into n_groups (at least 1, at most its ranks) of consecutive ranks. kind[n]: the same on every rank,
   any numbers; NULL: one kind. Tasks of a kind are taken in order, kinds in the order of their first tasks.
   Collective on comm. The caller owns it. */
PetscErrorCode HycoQueueCreate(MPI_Comm comm, PetscInt n_groups, PetscInt n, const PetscInt kind[], HycoQueue *queue);
/* Frees; sets the handle to NULL; NULL-safe. Collective on comm. */
PetscErrorCode HycoQueueDestroy(HycoQueue *queue);
/* This rank's group. Borrowed. */
PetscErrorCode HycoQueueGetGroup(HycoQueue queue, MPI_Comm *group);
/* The group's next task; the previous one is then done. -1: none is left, or another group has failed. Collective on
   the group. */
PetscErrorCode HycoQueueTake(HycoQueue queue, PetscInt *task);
/* Number of tasks that all groups have done. Not collective, one rank of a group at a time. */
PetscErrorCode HycoQueueDone(HycoQueue queue, PetscInt *n);
/* Numbers the events of all groups, from 1, in the order of these calls; and the number of this group, from 0. Not
   collective, one rank of a group at a time. */
PetscErrorCode HycoQueueNumber(HycoQueue queue, PetscInt *number, PetscInt *group);
/* Lets other groups take tasks: to be called within a long task, where the network has no atomic operations of its own.
   Not collective. */
PetscErrorCode HycoQueueServe(HycoQueue queue);
/* Fails if another group has failed: call it within a long task, which then ends with this error. Collective on the
   group. */
PetscErrorCode HycoQueueHear(HycoQueue queue);
/* Returns the error of this group's work, 0 if none; the other groups receive it at their next Take or Hear. An
   error of HycoQueueHear() is dropped, because the failed group reports its own. Each rank calls it once, at the end
   of its work, within HycoOnEach() of comm. Not collective. */
PetscErrorCode HycoQueueEnd(HycoQueue queue, PetscErrorCode error);
/* Adds to done[n_groups] (room for the ranks of comm) the tasks that each group has done. Collective on comm. */
PetscErrorCode HycoQueueCount(HycoQueue queue, PetscInt *n_groups, PetscInt done[]);
/* Number of tasks that were not done when the first group found none to take: each is then in another group, so that it
   is smaller than the number of groups. 0 after a failure. Collective on comm. */
PetscErrorCode HycoQueueLeft(HycoQueue queue, PetscInt *n);

#if defined(__cplusplus)
}
#endif
#endif
