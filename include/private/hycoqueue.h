/* HycoQueue: tasks that groups of ranks take one by one until none is left. */
#ifndef HYCOQUEUE_H
#define HYCOQUEUE_H

#include <hycoimpl.h>

/*
  n tasks of one or several kinds: those of a kind share something that a group makes once (a factor of the stiffness).
  A group goes on with its kind while that has tasks, then begins a kind that no group has begun, then helps with the
  one that has most left: no group waits while a task is left. Counters in a window of MPI on rank 0 say what is taken;
  nobody hands out. Which group solves what depends on how long tasks take.

  Where the network has no atomic operations of its own, a group that takes a task waits until rank 0 of the
  communicator is in some call of MPI.
*/
typedef struct _HycoQueue *HycoQueue;

/* Splits comm into n_groups (at least 1, at most its ranks) of consecutive ranks. kind[n]: the same on every rank, any
   numbers; NULL: all of one kind. Tasks of a kind are taken in order, kinds in the order of their first tasks.
   Collective on comm. The caller owns it. */
PetscErrorCode HycoQueueCreate(MPI_Comm comm, PetscInt n_groups, PetscInt n, const PetscInt kind[], HycoQueue *queue);
/* Frees; sets the handle to NULL; NULL-safe. Collective on comm. */
PetscErrorCode HycoQueueDestroy(HycoQueue *queue);
/* This rank's group. Borrowed. */
PetscErrorCode HycoQueueGetGroup(HycoQueue queue, MPI_Comm *group);
/* The group's next task, the one before being done; -1: none is left, or another group has failed. Collective on the
   group. */
PetscErrorCode HycoQueueTake(HycoQueue queue, PetscInt *task);
/* How many tasks all groups have done. Not collective, one rank of a group at a time. */
PetscErrorCode HycoQueueDone(HycoQueue queue, PetscInt *n);
/* Fails where another group has failed: to be called within a long task, which ends with this error. Collective on the
   group. */
PetscErrorCode HycoQueueHear(HycoQueue queue);
/* The error of this group's work, 0 if none, handed through; the other groups hear of it with their next Take or Hear.
   An error of HycoQueueHear() is dropped: the failed group tells its own. To be called once, by each rank, at the end
   of its work, with HycoOnEach() of comm around. Not collective. */
PetscErrorCode HycoQueueEnd(HycoQueue queue, PetscErrorCode error);
/* Adds to done[n_groups] (room for the ranks of comm) the tasks that each group has done. Collective on comm. */
PetscErrorCode HycoQueueCount(HycoQueue queue, PetscInt *n_groups, PetscInt done[]);

#endif
