/* HycoQueue: each task once, no group idle while one is left, tasks of a kind in one group, failures reported, events
   numbered. One rank in each group. */
#include "check.h"
#include <hycoqueue.h>

static PetscMPIInt rank, size;

/* Takes all remaining tasks; once[]: how often this rank took each. */
static PetscErrorCode TakeAll(HycoQueue queue, PetscInt once[])
{
  PetscInt k;

  PetscFunctionBegin;
  for (;;) {
    PetscCall(HycoQueueTake(queue, &k));
    if (k < 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(HycoQueueServe(queue));
    once[k]++;
  }
}

/* 60 tasks of 7 kinds on each number of groups. */
static PetscErrorCode EachOnce(void)
{
  PetscFunctionBegin;
  for (PetscInt groups = 1; groups <= size; groups++) {
    PetscInt kind[60], once[60] = {0}, n, done, left, *count, sum = 0;
    MPI_Comm group;
    PetscMPIInt first;
    HycoQueue queue;

    for (PetscInt k = 0; k < 60; k++) kind[k] = k * k % 13;
    PetscCall(PetscCalloc1(size, &count));
    PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, groups, 60, kind, &queue));
    PetscCall(TakeAll(queue, once));
    PetscCall(HycoQueueGetGroup(queue, &group));
    PetscCallMPI(MPI_Comm_rank(group, &first));
    for (PetscInt k = 0; first && k < 60; k++) once[k] = 0; /* the ranks of a group take the same */
    HycoAllreduce(once, 60, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    for (PetscInt k = 0; k < 60; k++)
      CHECK(once[k] == 1, "task %d of %d groups: %d times", (int)k, (int)groups, (int)once[k]);
    PetscCall(HycoQueueCount(queue, &n, count));
    PetscCall(HycoQueueDone(queue, &done));
    PetscCall(HycoQueueLeft(queue, &left));
    for (PetscInt c = 0; c < n; c++) sum += count[c];
    CHECK(n == groups && sum == 60 && done == 60, "groups %d, tasks %d and %d", (int)n, (int)sum, (int)done);
    CHECK(left >= 0 && left < groups, "%d tasks are left where one of %d groups is idle", (int)left, (int)groups);
    PetscCall(HycoQueueDestroy(&queue));
    CHECK(!queue, "the handle stays");
    PetscCall(PetscFree(count));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* However long one group's task takes, the others do all the rest: it ends its first one when nothing else is left. */
static PetscErrorCode NoneIdle(void)
{
  const PetscInt n = 40;

  PetscFunctionBegin;
  for (PetscMPIInt slow = 0; slow < size && size > 1; slow++) {
    PetscInt once[40] = {0}, mine = 0, k, done = 0, left;
    HycoQueue queue;

    PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, size, n, NULL, &queue));
    if (rank == slow) PetscCall(HycoQueueTake(queue, &k));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    while (rank == slow && done < n - 1) PetscCall(HycoQueueDone(queue, &done));
    if (rank != slow) PetscCall(TakeAll(queue, once));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (rank == slow) PetscCall(TakeAll(queue, once));
    for (k = 0; k < n; k++) mine += once[k];
    if (rank == slow) CHECK(mine == 0, "%d tasks were left for it", (int)mine);
    PetscCall(HycoQueueLeft(queue, &left));
    CHECK(left > 0 && left < size, "%d tasks are left where one of %d groups is idle", (int)left, (int)size);
    PetscCall(HycoQueueDestroy(&queue));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One group takes a kind after the other, each in order; several begin with different kinds. */
static PetscErrorCode Kinds(void)
{
  const PetscInt kind[9] = {5, 2, 5, 9, 2, 9, 5, 2, 9}, sorted[9] = {0, 2, 6, 1, 4, 7, 3, 5, 8};
  PetscInt begun[9] = {0}, k;
  HycoQueue queue;

  PetscFunctionBegin;
  PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, 1, 9, kind, &queue));
  for (PetscInt i = 0; i < 9; i++) {
    PetscCall(HycoQueueTake(queue, &k));
    CHECK(k == sorted[i], "task %d is %d, not %d", (int)i, (int)k, (int)sorted[i]);
  }
  PetscCall(HycoQueueDestroy(&queue));
  if (size > 3) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, size, 9, kind, &queue));
  PetscCall(HycoQueueTake(queue, &k));
  begun[k] = 1;
  HycoAllreduce(begun, 9, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  for (k = 0; k < size; k++) CHECK(begun[sorted[3 * k]] == 1, "kind %d is not begun by one group", (int)k);
  PetscCall(HycoQueueDestroy(&queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last group fails in its first task, while the others are in theirs. */
static PetscErrorCode FailOne(HycoQueue queue)
{
  PetscInt k;

  PetscFunctionBegin;
  PetscCall(HycoQueueTake(queue, &k));
  HycoCheck(rank < size - 1, "task %d is wrong", (int)k);
  for (;;) PetscCall(HycoQueueHear(queue));
}

static PetscErrorCode FailSynced(HycoQueue queue)
{
  PetscFunctionBegin;
  HycoOnEach(PETSC_COMM_WORLD, HycoQueueEnd(queue, FailOne(queue)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All end with the error of the group that failed, and no further task is taken. */
static PetscErrorCode Failure(void)
{
  PetscInt k;
  HycoQueue queue;

  PetscFunctionBegin;
  PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, size, 40, NULL, &queue));
  CHECK_FAILS(FailSynced(queue), "is wrong");
  PetscCall(HycoQueueTake(queue, &k));
  CHECK(k < 0, "task %d is taken after a failure", (int)k);
  PetscCall(HycoQueueDestroy(&queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The events of all groups have the numbers from 1 on, each once. */
static PetscErrorCode Events(void)
{
  const PetscInt n = 5;
  PetscInt number, group, last = 0, sum = 0;
  HycoQueue queue;

  PetscFunctionBegin;
  PetscCall(HycoQueueCreate(PETSC_COMM_WORLD, size, 1, NULL, &queue));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoQueueNumber(queue, &number, &group));
    CHECK(group == rank && number > last && number <= n * size, "group %d, event %d", (int)group, (int)number);
    last = number;
    sum += number;
  }
  HycoAllreduce(&sum, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(sum == n * size * (n * size + 1) / 2, "the numbers' sum is %d", (int)sum);
  PetscCall(HycoQueueDestroy(&queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(EachOnce());
  PetscCall(NoneIdle());
  PetscCall(Kinds());
  PetscCall(Failure());
  PetscCall(Events());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
