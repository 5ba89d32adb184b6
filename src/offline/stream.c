/*
  Snapshots that do not fit in memory together (-hyco_pod_memory): they are read from the store in batches, each of
  which is merged into the POD of the previous ones.
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>
#include <string.h>

/* Copies of each column needed by a merge: the joined matrix, its copy in the SVD, the resulting modes. */
#define COPIES 3
/* Of the noise, what all merges of batches may lose: a tenth of what decides which modes are above it. */
#define LOSS 0.1

/* Number of columns of N rows that fit in memory, over all ranks: the same on any number of them. */
static PetscInt StreamRoom(HycoReducer t, PetscInt N)
{
  return (PetscInt)PetscMin(1e6 * t->pod_memory / (COPIES * sizeof(PetscReal) * PetscMax(1, (PetscReal)N)), 1e9);
}

/* One call with t->S if it is kept. A batch has whole paths, and at least one. */
PetscErrorCode HycoReducerEachBatch(HycoReducer t, HycoBatchUse use, void *ctx)
{
  const PetscInt n_steps = HycoSnapshotsSteps(t->scene), n = t->n_s / n_steps;
  const PetscInt most = PetscMax(1, StreamRoom(t, t->sizes[0] * t->sizes[3]) / n_steps);

  PetscFunctionBegin;
  /* They are in memory: no reading, one batch. */
  if (t->S) {
    PetscCall((*use)(t, 0, t->S, ctx));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt first = 0; first < n; first += most) {
    Mat S;

    /* Read again in each pass: the price of not holding them. */
    PetscCall(HycoSnapshotsGetField(t->store, t->columns, first, PetscMin(most, n - first),
                                    HycoSeedFields[HYCO_SEED_DISPLACEMENT], t->sizes[3], &S));
    PetscCall((*use)(t, first * n_steps, S, ctx));
    PetscCall(MatDestroy(&S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A basis into which batches of columns of a field are merged. */
typedef struct {
  HycoReducer t;
  PetscInt kind, N, room; /* kind: the field's seed; its rows; number of columns that fit */
  SVD svd;
  Mat merged;
} Stream;

/* Number of columns of *merged: the modes so far. */
static PetscErrorCode CountModes(const Stream *s, PetscInt *l)
{
  PetscFunctionBegin;
  *l = 0;
  if (s->merged) PetscCall(MatGetSize(s->merged, NULL, l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if n more columns do not fit in addition to the modes so far. */
static PetscErrorCode CheckRoom(const Stream *s, PetscInt n)
{
  PetscInt l;

  PetscFunctionBegin;
  PetscCall(CountModes(s, &l));
  /* Before the columns are merged: afterwards the modes would be lost with the memory. */
  HycoCheck(l + n <= s->room,
            "-hyco_pod_memory %g has room for %d columns of the field %s, and its %d modes with %d more columns "
            "need at least %.3g; give more, or a larger -hyco_pod_noise, which keeps fewer modes",
            (double)s->t->pod_memory, (int)s->room, HycoSeedFields[s->kind], (int)l, (int)n,
            1e-6 * COPIES * sizeof(PetscReal) * (double)s->N * (double)(l + n) + 0.01);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Merges *S, a share of all columns, and frees it. */
static PetscErrorCode StreamMerge(Stream *s, PetscReal share, Mat *S)
{
  PetscFunctionBegin;
  /* Losses add up over the batches: each may lose its share. */
  HycoLogged(HYCO_EVENT_POD, HycoPODMerge(s->svd, PetscSqr(LOSS * s->t->noise) * share, &s->merged, S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Merges points, as many at a time as fit. */
static PetscErrorCode MergePoints(Stream *s, HycoSnapshots store)
{
  const PetscInt n = s->t->n_s;
  PetscInt l, count;
  Mat S;

  PetscFunctionBegin;
  for (PetscInt first = 0; first < n; first += count) {
    /* The modes so far stay in memory: they leave less room from batch to batch. */
    PetscCall(CheckRoom(s, 1));
    PetscCall(CountModes(s, &l));
    count = PetscMin(s->room - l, n - first);
    PetscCall(HycoReducerReadField(s->t, store, s->kind, first, count, &S));
    PetscCall(StreamMerge(s, (PetscReal)count / (PetscReal)n, &S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the modes of path j. CheckRoom() fails where a single path does not fit into the memory that the user
   allows. */
static PetscErrorCode ReadModes(const Stream *s, HycoSnapshots store, PetscReal tol, PetscInt j, HycoPathModes *modes)
{
  PetscInt n;
  Mat path;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoReducerReadPath(s->t, store, s->kind, j, &path));
  PetscCall(MatGetSize(path, NULL, &n));
  ierr = CheckRoom(s, n);
  if (!ierr) ierr = HycoPathModesAdd(s->t, path, tol, modes);
  PetscCall(MatDestroy(&path));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Merges paths one by one: first the size of each, then their modes, scaled by it. Two passes read every path
   twice: their scale needs the largest of all, and keeping them is what there is no memory for. */
static PetscErrorCode MergePaths(Stream *s, HycoSnapshots store, PetscReal tol)
{
  const PetscInt n = s->t->n_s / HycoSnapshotsSteps(s->t->scene);
  PetscReal largest = 0;

  PetscFunctionBegin;
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt j = 0; j < n; j++) {
      HycoPathModes modes = {0};

      PetscCall(ReadModes(s, store, tol, j, &modes));
      /* The first pass only finds the largest displacement of all paths. */
      if (pass && modes.V[0]) {
        PetscCall(MatScale(modes.V[0], HycoPathScale(modes.first[0], largest)));
        PetscCall(StreamMerge(s, 1 / (PetscReal)n, &modes.V[0]));
      }
      largest = PetscMax(largest, modes.first[0]);
      PetscCall(HycoPathModesDestroy(&modes));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the basis from the merged columns; empty if all were zero. */
static PetscErrorCode EndStream(Stream *s, PetscReal tol, PetscInt most)
{
  HycoBasis *basis = &s->t->basis[s->kind];

  PetscFunctionBegin;
  if (s->merged)
    PetscCall(HycoReducerTakeBasis(s->t, s->merged, tol, most, basis));
  else
    /* l = 0: the caller says that there is no mode. */
    PetscCall(PetscCalloc1(s->t->n_s + 1, &basis->sigma));
  HycoDestroyAll(&s->merged, &s->svd);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Incremental SVD: the modes so far and a new batch are merged by the SVD of both side by side (Brand 2006). */
PetscErrorCode HycoReducerStreamBasis(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscReal tol, PetscInt most)
{
  Stream s = {.t = t, .kind = kind};

  PetscFunctionBegin;
  /* Merging needs accurate small singular values, which Gram matrices lose. */
  HycoCheck(strcmp(t->svd_type, HYCO_SVD_TSQR) == 0,
            "-hyco_pod_memory computes PODs by the SVD type %s, and -hyco_pod_svd_type is %s; leave one of the two out",
            HYCO_SVD_TSQR, t->svd_type);
  PetscCall(HycoSnapshotsGetRows(store, t->columns, HycoSeedFields[kind], &s.N));
  s.room = StreamRoom(t, s.N);
  PetscCall(HycoReducerCreateSVD(t, HycoComm(t), &s.svd));
  PetscCall(t->scene->n_times ? MergePaths(&s, store, tol) : MergePoints(&s, store));
  PetscCall(EndStream(&s, tol, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}
