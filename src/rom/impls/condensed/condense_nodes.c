/*
  Solves at the nodes of the stiffness for a condensed training: G = B K^-1 B^T, and later X = K^-1 B^T P for patterns P
  of forces. Each is a file beside the snapshots, named by the node's parameters (and the patterns), so that after an
  interrupted run only the missing ones are solved.
*/
#include <hycocondensed.h>
#include <hycofields.h>
#include <hycoqueue.h>
#include <string.h>
#include <unistd.h>

/* The quantity solved for: G (q = 0), or the responses to q patterns (m x q, on every rank). */
typedef struct {
  PetscInt q;
  const PetscReal *P;
} Task;

/* The parameters of node k of G's grid (the first training value where G does not depend on a parameter), and those
   of the file. */
static void StiffPoint(HycoCondensed c, PetscInt k, PetscReal mu[], PetscReal key[])
{
  const HycoTensor *t = &c->field[HYCO_FIELD_G].tensor;

  for (PetscInt p = c->dim - 1; p >= 0; p--) {
    mu[p] = c->x[p][k % t->n[p]];
    key[p] = c->stiff[p] ? mu[p] : 0;
    k /= t->n[p];
  }
}

static PetscErrorCode Path(HycoReducer t, HycoSnapshots store, PetscInt k, const Task *task,
                           char path[PETSC_MAX_PATH_LEN])
{
  HycoCondensed c = Condensing(t)->condensed;
  PetscReal mu[HYCO_MAX_PARAMETERS], key[HYCO_MAX_PARAMETERS];
  unsigned long long hash;

  PetscFunctionBegin;
  StiffPoint(c, k, mu, key);
  hash = HycoHash(HYCO_HASH_START, key, (size_t)c->dim * sizeof(PetscReal));
  hash = HycoHash(hash, task->P, (size_t)c->m * (size_t)task->q * sizeof(PetscReal));
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/%s-%016llx.h5", store->folder,
                          task->q ? "responses" : "flexibility", hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes G, which rank 0 has, or X at the unknowns of each rank's part. Collective. */
static PetscErrorCode WriteData(HycoSnapshots store, HycoFOM fom, HycoH5 h, PetscInt q, PetscInt n_G,
                                const PetscReal data[])
{
  char fingerprint[32];
  const HycoFileOrder *rows;

  PetscFunctionBegin;
  snprintf(fingerprint, sizeof(fingerprint), "%016llx", store->fingerprint);
  HycoOnRoot(HycoComm(fom), HycoH5WriteText(h, "fingerprint", fingerprint));
  PetscCall(HycoFOMGetRows(fom, &rows));
  if (q)
    PetscCall(HycoFieldWrite(h, rows, fom->n_nodes, "X", HYCO_ON_NODES, MPIU_REAL, fom->fe->dim * q, q, data));
  else
    PetscCall(HycoH5WriteRows(h, "G", MPIU_REAL, n_G, 1, 0, fom->rank ? 0 : n_G, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteOne(HycoSnapshots store, HycoFOM fom, const char path[], PetscInt q, PetscInt n_G,
                               const PetscReal data[])
{
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCall(HycoH5CreateShared(HycoComm(fom), path, &h));
  ierr = WriteData(store, fom, h, q, n_G, data);
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads n rows from `start`; data NULL: only checks that the file belongs to this scene. */
static PetscErrorCode ReadOpen(HycoSnapshots store, HycoH5 h, const char path[], const char name[], PetscInt start,
                               PetscInt n, PetscInt cols, PetscReal data[])
{
  char mine[32], *text;
  PetscBool same;

  PetscFunctionBegin;
  snprintf(mine, sizeof(mine), "%016llx", store->fingerprint);
  PetscCall(HycoH5LoadText(h, "fingerprint", &text));
  same = (PetscBool)(strcmp(text, mine) == 0);
  PetscCall(PetscFree(text));
  HycoCheck(same, "%s belongs to another scene or mesh; remove the folder %s, or name another by -hyco_snapshots", path,
            store->folder);
  if (data) PetscCall(HycoH5ReadRows(h, name, start, n, cols, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadOne(HycoSnapshots store, const char path[], const char name[], PetscInt start, PetscInt n,
                              PetscInt cols, PetscReal data[])
{
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(path, "remove it and run again", &h));
  ierr = ReadOpen(store, h, path, name, start, n, cols, data);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* missing[]: the nodes of G's grid without a file. Rank 0. */
static PetscErrorCode FindMissing(HycoReducer t, HycoSnapshots store, const Task *task, PetscInt *n_missing,
                                  PetscInt missing[])
{
  const PetscInt n = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor);
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  *n_missing = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(Path(t, store, k, task, path));
    if (access(path, F_OK))
      missing[(*n_missing)++] = k;
    else
      PetscCall(ReadOne(store, path, "", 0, 0, 0, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves and writes one node of G's grid. data: room for it. */
static PetscErrorCode SolveOne(HycoReducer t, HycoSnapshots store, HycoFOM fom, PetscInt node, const Task *task,
                               PetscReal data[])
{
  PetscReal mu[HYCO_MAX_PARAMETERS], key[HYCO_MAX_PARAMETERS];
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  StiffPoint(Condensing(t)->condensed, node, mu, key);
  PetscCall(Path(t, store, node, task, path));
  if (task->q)
    PetscCall(HycoFOMResponses(fom, mu, task->q, task->P, data));
  else
    PetscCall(HycoFOMFlexibility(fom, mu, data));
  PetscCall(WriteOne(store, fom, path, task->q, Condensing(t)->condensed->field[HYCO_FIELD_G].rows, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's group takes nodes from the queue of the missing ones. data: room for one. */
static PetscErrorCode SolveQueued(HycoReducer t, HycoSnapshots store, HycoQueue queue, PetscInt n_missing,
                                  const PetscInt missing[], HycoFOM fom, const Task *task, PetscReal data[])
{
  PetscInt k, n_done;

  PetscFunctionBegin;
  for (PetscBool first = PETSC_TRUE;; first = PETSC_FALSE) {
    PetscCall(HycoQueueTake(queue, &k));
    if (!first && t->phase && t->rank == 0) {
      PetscCall(HycoQueueDone(queue, &n_done));
      PetscCall(t->phase(task->q ? "responses" : "flexibilities", n_done, n_missing, t->phase_ctx));
    }
    if (k < 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(SolveOne(t, store, fom, missing[k], task, data));
  }
}

static PetscErrorCode SolveGroup(HycoReducer t, HycoSnapshots store, HycoQueue queue, PetscInt n_missing,
                                 const PetscInt missing[], const Task *task)
{
  MPI_Comm group;
  HycoFOM fom;
  PetscReal *data;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoQueueGetGroup(queue, &group));
  PetscCall(HycoFOMCreate(group, t->scene, &fom));
  PetscCall(PetscMalloc1(task->q ? (size_t)fom->fe->n_dof * (size_t)task->q
                                 : (size_t)Condensing(t)->condensed->field[HYCO_FIELD_G].rows,
                         &data));
  ierr = SolveQueued(t, store, queue, n_missing, missing, fom, task, data);
  PetscCall(PetscFree(data));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves all nodes of G's grid without a file. Collective. */
static PetscErrorCode SolveMissing(HycoReducer t, HycoSnapshots store, const Task *task)
{
  const PetscInt n = HycoTensorSize(&Condensing(t)->condensed->field[HYCO_FIELD_G].tensor);
  PetscInt n_missing = 0, *missing, groups;
  HycoQueue queue;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &missing));
  HycoOnRoot(HycoComm(t), FindMissing(t, store, task, &n_missing, missing));
  PetscCallMPI(MPI_Bcast(&n_missing, 1, MPIU_INT, 0, HycoComm(t)));
  HycoBcast(missing, n_missing, MPIU_INT, HycoComm(t));
  if (n_missing) {
    PetscCall(HycoSnapshotsChooseGroups(HycoComm(t), t->scene, n, &groups));
    PetscCall(HycoQueueCreate(HycoComm(t), groups, n_missing, NULL, &queue));
    HycoOnEach(HycoComm(t), HycoQueueEnd(queue, SolveGroup(t, store, queue, n_missing, missing, task)));
    PetscCall(HycoQueueDestroy(&queue));
  }
  PetscCall(PetscFree(missing));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads G at all nodes from the files. Rank 0. */
static PetscErrorCode ReadFlexibilities(HycoReducer t, HycoSnapshots store, const Task *task)
{
  HycoGridField *G = &Condensing(t)->condensed->field[HYCO_FIELD_G];
  const PetscInt n = HycoTensorSize(&G->tensor);
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(PetscFree(G->data));
  PetscCall(PetscMalloc1((size_t)G->rows * (size_t)n, &G->data));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(Path(t, store, k, task, path));
    PetscCall(ReadOne(store, path, "G", 0, G->rows, 1, G->data + (size_t)k * (size_t)G->rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedFlexibilities(HycoReducer t, HycoSnapshots store)
{
  const Task task = {0, NULL};

  PetscFunctionBegin;
  PetscCall(SolveMissing(t, store, &task));
  HycoOnRoot(HycoComm(t), ReadFlexibilities(t, store, &task));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads n columns of node k's responses, from `first` on, into those of S from `at` on: this rank's rows. */
static PetscErrorCode ReadResponses(HycoReducer t, HycoSnapshots store, const Task *task, PetscInt k, PetscInt first,
                                    PetscInt n, Mat S, PetscInt at)
{
  const size_t q = (size_t)task->q;
  PetscInt lo, hi, lda;
  PetscScalar *s;
  PetscReal *rows;
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(S, &lo, &hi));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(PetscMalloc1((size_t)(hi - lo) * q + 1, &rows));
  PetscCall(MatDenseGetArray(S, &s));
  PetscCall(Path(t, store, k, task, path));
  PetscCall(ReadOne(store, path, "X", lo, hi - lo, task->q, rows));
  for (PetscInt j = 0; j < n; j++) {
    PetscScalar *column = s + (size_t)(at + j) * (size_t)lda;

    for (PetscInt i = 0; i < hi - lo; i++) column[i] = rows[(size_t)i * q + (size_t)(first + j)];
  }
  PetscCall(MatDenseRestoreArray(S, &s));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedRespond(HycoReducer t, HycoSnapshots store, PetscInt q, const PetscReal P[])
{
  const Task task = {q, P};

  PetscFunctionBegin;
  if (q) PetscCall(SolveMissing(t, store, &task));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedReadResponses(HycoReducer t, HycoSnapshots store, PetscInt q, const PetscReal P[],
                                          PetscInt node, PetscInt first, PetscInt n, Mat S, PetscInt at)
{
  const Task task = {q, P};

  PetscFunctionBegin;
  if (n) HycoOnEach(HycoComm(t), ReadResponses(t, store, &task, node, first, n, S, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}
