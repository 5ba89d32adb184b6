/* HycoQueue: counters in an MPI-3 window, updated by atomic operations. */
#include <hycoqueue.h>
#include <hycoimpl.h>

/* The first counters of the window, followed by those of the kinds: groups that failed, tasks done, kinds begun,
   events. */
enum { FAILED, DONE, BEGUN, EVENTS, N_COUNTERS };

struct _HycoQueue {
  MPI_Comm comm, group; /* comm borrowed */
  PetscMPIInt rank;     /* rank in the group */
  PetscInt n_groups, color, n_kinds;
  PetscInt *first, *order; /* n_kinds + 1; the tasks, ordered by kind */
  PetscInt kind;           /* the kind whose tasks this group takes; -1: none yet */
  PetscInt n_taken;
  PetscInt n_left;      /* number of tasks not done when this group found none to take; 0 before, or after a failure */
  PetscBool busy, told; /* busy: a task was taken and is not done; told: another group has failed */
  MPI_Win window;       /* MPI_WIN_NULL: one group, whose ranks all have the same counters */
  PetscInt *counter;    /* N_COUNTERS + n_kinds; with a window only on rank 0 of comm */
};

/* Orders the tasks by kind, the kinds by their first tasks. A group that keeps to one kind reuses what it has set
   up for it, for example a factor. O(n times kinds). */
static PetscErrorCode SortKinds(HycoQueue q, PetscInt n, const PetscInt kind[])
{
  PetscInt at = 0;
  PetscBool *sorted;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n + 1, &q->first, n, &q->order));
  PetscCall(PetscCalloc1(n, &sorted));
  for (PetscInt i = 0; i < n; i++) {
    if (sorted[i]) continue;
    q->first[q->n_kinds++] = at;
    /* Those of kind[i] in their own order; kind NULL: all are of one kind. */
    for (PetscInt j = i; j < n; j++) {
      if (sorted[j] || (kind && kind[j] != kind[i])) continue;
      q->order[at++] = j;
      sorted[j] = PETSC_TRUE;
    }
  }
  q->first[q->n_kinds] = n;
  PetscCall(PetscFree(sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The counters are in a window on rank 0, which other ranks access without rank 0's help where the network has atomic
   operations. One group needs no window. */
static PetscErrorCode OpenWindow(HycoQueue q)
{
  const PetscInt n = N_COUNTERS + q->n_kinds;
  PetscMPIInt rank;

  PetscFunctionBegin;
  q->window = MPI_WIN_NULL;
  if (q->n_groups == 1) {
    PetscCall(PetscCalloc1(n, &q->counter));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCallMPI(MPI_Comm_rank(q->comm, &rank));
  PetscCallMPI(MPI_Win_allocate(rank ? 0 : n * (MPI_Aint)sizeof(PetscInt), sizeof(PetscInt), MPI_INFO_NULL, q->comm,
                                &q->counter, &q->window));
  /* Once for the queue's life: passive target, so that rank 0 need not take part. */
  PetscCallMPI(MPI_Win_lock_all(0, q->window));
  if (rank == 0) PetscCall(PetscArrayzero(q->counter, n));
  PetscCallMPI(MPI_Win_sync(q->window));
  PetscCallMPI(MPI_Barrier(q->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contiguous ranks form a group, which usually share a node. kind NULL: all tasks are of one kind. Collective. Tasks
   are taken, not assigned: groups that are faster take more. */
PetscErrorCode HycoQueueCreate(MPI_Comm comm, PetscInt n_groups, PetscInt n, const PetscInt kind[], HycoQueue *queue)
{
  PetscMPIInt rank;
  HycoQueue q;

  PetscFunctionBegin;
  HycoCheckGiven(queue);
  PetscCall(PetscNew(&q));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  q->comm = comm;
  q->n_groups = n_groups;
  q->color = (PetscInt)rank * n_groups / HycoSize(comm);
  q->kind = -1;
  PetscCallMPI(MPI_Comm_split(comm, (PetscMPIInt)q->color, rank, &q->group));
  PetscCallMPI(MPI_Comm_rank(q->group, &q->rank));
  PetscCall(SortKinds(q, n, kind));
  PetscCall(OpenWindow(q));
  *queue = q;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: freeing a window waits for all ranks. */
PetscErrorCode HycoQueueDestroy(HycoQueue *queue)
{
  HycoQueue q = queue ? *queue : NULL;

  PetscFunctionBegin;
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  if (q->window != MPI_WIN_NULL) {
    PetscCallMPI(MPI_Win_unlock_all(q->window));
    PetscCallMPI(MPI_Win_free(&q->window));
  } else
    PetscCall(PetscFree(q->counter));
  PetscCallMPI(MPI_Comm_free(&q->group));
  PetscCall(PetscFree2(q->first, q->order));
  PetscCall(PetscFree(*queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoQueueGetGroup(HycoQueue q, MPI_Comm *group)
{
  PetscFunctionBegin;
  HycoCheckGiven(q);
  *group = q->group;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to a counter atomically; returns its former value. more = 0 reads. MPI_Fetch_and_op() needs no lock between
   ranks. */
static PetscErrorCode QueueAdd(HycoQueue q, PetscInt counter, PetscInt more, PetscInt *before)
{
  PetscFunctionBegin;
  if (q->window != MPI_WIN_NULL) {
    PetscCallMPI(MPI_Fetch_and_op(&more, before, MPIU_INT, 0, (MPI_Aint)counter, MPI_SUM, q->window));
    PetscCallMPI(MPI_Win_flush(0, q->window));
  } else {
    *before = q->counter[counter];
    q->counter[counter] += more;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the next kind for this group: one that no group has begun, or the one with most tasks left; -1: none has
   any. The first choice spreads the groups over the kinds; later they help where most is left. */
static PetscErrorCode NextKind(HycoQueue q)
{
  PetscInt begun, most = 0;

  PetscFunctionBegin;
  PetscCall(QueueAdd(q, BEGUN, 1, &begun));
  q->kind = begun < q->n_kinds ? begun : -1;
  for (PetscInt k = 0; k < q->n_kinds && begun >= q->n_kinds; k++) {
    PetscInt taken, left;

    PetscCall(QueueAdd(q, N_COUNTERS + k, 0, &taken));
    left = q->first[k + 1] - q->first[k] - taken;
    if (left <= most) continue;
    most = left;
    q->kind = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next task; -1: none. On the group's rank that accesses the counters. `busy` is of the whole group, whose first
   rank calls this. */
static PetscErrorCode TakeTask(HycoQueue q, PetscInt *task)
{
  PetscInt failed, done, at;

  PetscFunctionBegin;
  *task = -1;
  /* Taking the next task says that the former is done. */
  if (q->busy) PetscCall(QueueAdd(q, DONE, 1, &done));
  PetscCall(QueueAdd(q, FAILED, 0, &failed));
  if (failed) PetscFunctionReturn(PETSC_SUCCESS);
  if (q->kind < 0) PetscCall(NextKind(q));
  while (q->kind >= 0 && *task < 0) {
    PetscCall(QueueAdd(q, N_COUNTERS + q->kind, 1, &at));
    if (q->first[q->kind] + at < q->first[q->kind + 1])
      *task = q->order[q->first[q->kind] + at];
    else
      PetscCall(NextKind(q));
  }
  if (*task >= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(QueueAdd(q, DONE, 0, &done));
  q->n_left = q->first[q->n_kinds] - done;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective on the group, all of whose ranks get the same task. */
PetscErrorCode HycoQueueTake(HycoQueue q, PetscInt *task)
{
  PetscFunctionBegin;
  HycoCheckGiven(q);
  if (q->rank == 0 || q->window == MPI_WIN_NULL) PetscCall(TakeTask(q, task));
  PetscCallMPI(MPI_Bcast(task, 1, MPIU_INT, 0, q->group));
  q->n_taken += q->busy;
  q->busy = (PetscBool)(*task >= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoQueueDone(HycoQueue q, PetscInt *n)
{
  PetscFunctionBegin;
  HycoCheckGiven(q);
  PetscCall(QueueAdd(q, DONE, 0, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers from 1 in the order in which events happen over all groups, for the log. */
PetscErrorCode HycoQueueNumber(HycoQueue q, PetscInt *number, PetscInt *group)
{
  PetscFunctionBegin;
  HycoCheckGiven(q);
  PetscCall(QueueAdd(q, EVENTS, 1, number));
  ++*number;
  *group = q->color;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between tasks: with some networks, MPI serves other ranks' accesses only while this rank calls it. */
PetscErrorCode HycoQueueServe(HycoQueue q)
{
  int found;

  PetscFunctionBegin;
  HycoCheckGiven(q);
  if (q->window != MPI_WIN_NULL)
    PetscCallMPI(MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, q->group, &found, MPI_STATUS_IGNORE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective on the group: all its ranks fail together, so that none waits for another. A group that works for hours
   asks between its steps. */
PetscErrorCode HycoQueueHear(HycoQueue q)
{
  PetscInt failed = 0;

  PetscFunctionBegin;
  HycoCheckGiven(q);
  if (q->rank == 0) PetscCall(QueueAdd(q, FAILED, 0, &failed));
  PetscCallMPI(MPI_Bcast(&failed, 1, MPIU_INT, 0, q->group));
  q->told = (PetscBool)(failed > 0);
  HycoCheck(!failed, "another group of ranks has failed");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not after an error that only says that another group failed: that group reports its own. */
PetscErrorCode HycoQueueEnd(HycoQueue q, PetscErrorCode error)
{
  PetscInt before;

  PetscFunctionBegin;
  HycoCheckGiven(q);
  if (!error || q->told) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(QueueAdd(q, FAILED, 1, &before));
  PetscCall(error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective; more than 0 means that some tasks were taken by groups that had not finished them. */
PetscErrorCode HycoQueueLeft(HycoQueue q, PetscInt *n)
{
  PetscFunctionBegin;
  HycoCheckGiven(q);
  PetscCallMPI(MPI_Allreduce(&q->n_left, n, 1, MPIU_INT, MPI_MAX, q->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* done[]: added to what is there; one rank of each group counts. */
PetscErrorCode HycoQueueCount(HycoQueue q, PetscInt *n_groups, PetscInt done[])
{
  PetscInt *count;

  PetscFunctionBegin;
  HycoCheckGiven(q);
  PetscCall(PetscCalloc1(q->n_groups, &count));
  if (q->rank == 0) count[q->color] = q->n_taken;
  HycoAllreduce(count, q->n_groups, MPIU_INT, MPI_SUM, q->comm);
  for (PetscInt c = 0; c < q->n_groups; c++) done[c] += count[c];
  *n_groups = q->n_groups;
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}
