/*
  Bases and interpolation points (sections 4.1, 4.2): POD of displacements, stresses, generalised forces and
  multipliers, DEIM on each. Snapshot matrices are distributed over the ranks by rows; the POD of the multipliers runs
  on rank 0. HycoReducerReduce() reads the snapshots once; HycoReducerTakeBases() truncates the bases by the tolerances.
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>

const char *const HycoSeedFields[HYCO_N_SEEDS] = {"U", "sigma", "force", "lambda", "inelastic", "spring"};

/* The samples whose solutions are the columns of snapshot matrices; a path has several columns. */
PetscErrorCode HycoReducerSetColumns(HycoReducer t, HycoSamples columns)
{
  PetscFunctionBegin;
  t->columns = columns;
  PetscCall(HycoSamplesGet(columns, &t->n_s, NULL, NULL));
  t->n_s *= HycoSnapshotsSteps(t->scene);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns are ordered sample by sample, and within a sample by listed time. */
PetscErrorCode HycoReducerColumn(HycoReducer t, PetscInt k, PetscReal mu[])
{
  const PetscInt n_steps = HycoSnapshotsSteps(t->scene);
  const PetscReal *all;
  PetscInt n_par;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &all));
  HycoSceneSetTime(t->scene, all + k / n_steps * n_par, t->scene->n_times ? t->scene->times[k % n_steps] : 0, mu);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Subtracts the lifting r(u0) from snapshots: they are then zero on the fixed unknowns. */
static PetscErrorCode RemoveLifting(HycoReducer t, Mat S)
{
  PetscBool *fixed;
  PetscInt lda, n, n_rows;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(S, &n_rows, NULL));
  PetscCall(PetscMalloc1(n_rows, &fixed));
  /* Which unknowns are fixed is known by parts, snapshots lie by rows of the file. */
  PetscCall(HycoFOMToRows(t->fom, HYCO_ON_NODES, HYCO_MPI_BOOL, t->sizes[3], t->fom->fe->fixed, fixed));
  PetscCall(MatGetSize(S, NULL, &n));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(MatDenseGetArray(S, &s));
  for (PetscInt i = 0; i < n_rows; i++) {
    for (PetscInt j = 0; fixed[i] && j < n; j++) s[(size_t)j * (size_t)lda + (size_t)i] = 0;
  }
  PetscCall(MatDenseRestoreArray(S, &s));
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `divide`: rows of a basis to their node or cell. One entry is kept free, for a list that is never NULL. */
static PetscErrorCode AddSeeds(PetscInt n, const PetscInt add[], PetscInt divide, PetscInt *n_seeds, PetscInt **seeds)
{
  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(*n_seeds + n + 1) * sizeof(PetscInt), seeds));
  for (PetscInt k = 0; k < n; k++) (*seeds)[(*n_seeds)++] = add[k] / divide;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The product is small and needed whole: X^T Y is distributed by its rows, and MatCreateRedundantMatrix() gives it
   to every rank. */
PetscErrorCode HycoReducerMultiply(HycoReducer t, Mat X, Mat Y, PetscReal product[])
{
  Mat P, whole = NULL;
  const PetscScalar *p;
  PetscInt lda, rows, cols;

  PetscFunctionBegin;
  PetscCall(MatTransposeMatMult(X, Y, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &P));
  if (HycoSize(HycoComm(t)) > 1)
    /* Every rank has the same numbers afterwards, and takes the same decisions from them. */
    PetscCall(MatCreateRedundantMatrix(P, HycoSize(HycoComm(t)), PETSC_COMM_SELF, MAT_INITIAL_MATRIX, &whole));
  else {
    PetscCall(PetscObjectReference((PetscObject)P));
    whole = P;
  }
  PetscCall(MatGetSize(P, &rows, &cols));
  PetscCall(MatDenseGetLDA(whole, &lda));
  PetscCall(MatDenseGetArrayRead(whole, &p));
  for (PetscInt k = 0; k < cols; k++)
    PetscCall(PetscArraycpy(product + (size_t)k * (size_t)rows, p + (size_t)k * (size_t)lda, rows));
  PetscCall(MatDenseRestoreArrayRead(whole, &p));
  HycoDestroyAll(&whole, &P);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerGetDisplacements(HycoReducer t, HycoSnapshots store, Mat *S)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerReadField(t, store, HYCO_SEED_DISPLACEMENT, 0, t->n_s / HycoSnapshotsSteps(t->scene), S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without the lifting modes vanish where displacements are fixed, so that U = r(u0) + V gamma meets any prescribed
   values (30). By the file's rows, in which modes and DEIM points are numbered. */
PetscErrorCode HycoReducerReadField(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt first, PetscInt n,
                                    Mat *S)
{
  const PetscBool moves = (PetscBool)(kind == HYCO_SEED_DISPLACEMENT);

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetField(store, t->columns, first, n, HycoSeedFields[kind], moves ? t->sizes[3] : 1, S));
  if (moves) PetscCall(RemoveLifting(t, *S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q-DEIM chooses its points by a pivoted QR of V^T, which depends on the space of the modes and not on their
   order, with a better bound of the interpolation error than the greedy choice of DEIM (Drmac, Gugercin 2016). */
static PetscErrorCode ReducePoints(HycoReducer t, Mat V, PetscInt index[])
{
  PetscFunctionBegin;
  PetscCall(t->deim ? HycoQDEIM(V, index) : HycoDEIM(V, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One place for all PODs, so that the options hold for each of them. */
PetscErrorCode HycoReducerCreateSVD(HycoReducer t, MPI_Comm comm, SVD *svd)
{
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(HycoPODCreateSVD(comm, svd));
  PetscCall(SVDSetType(*svd, t->svd_type));
  PetscCall(PetscObjectGetOptionsPrefix((PetscObject)t, &prefix));
  /* -hyco_pod_svd_... : SLEPc adds "svd_" to the prefix. */
  PetscCall(SVDSetOptionsPrefix(*svd, prefix));
  PetscCall(SVDAppendOptionsPrefix(*svd, "hyco_pod_"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V's columns are orthonormal; singular values below the noise are left out, whatever tol is. */
PetscErrorCode HycoReducerPOD(HycoReducer t, Mat S, PetscReal tol, PetscInt max_modes, Mat *V, PetscInt *l,
                              PetscReal sigma[])
{
  SVD svd;

  PetscFunctionBegin;
  PetscCall(HycoReducerCreateSVD(t, PetscObjectComm((PetscObject)S), &svd));
  HycoLogged(HYCO_EVENT_POD, HycoPOD(svd, S, tol, t->noise, max_modes, V, l, sigma));
  PetscCall(SVDDestroy(&svd));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define DOMINANT        100   /* ratio of successive singular values */
#define VALUE_ROUND_OFF 1e-13 /* of the first singular value: 450 eps, below which values are round-off */

/* The number of leading modes that dominate the energy. A body on a soft spring moves rigidly by much more than it
   deforms: the energy is that of rigid motions, and a small share of it, or of its round-off, is all deformation. */
static PetscInt CountDominant(const HycoScene scene, PetscInt n, const PetscReal sigma[])
{
  /* A body has six rigid motions at most; the next value is compared, hence n - 1. */
  const PetscInt most = PetscMin(6 * scene->n_bodies, n - 1);
  PetscInt first = 0;

  for (PetscInt j = 0; scene->n_springs && j < most; j++) {
    if (sigma[j] > DOMINANT * sigma[j + 1] && sigma[j + 1] > VALUE_ROUND_OFF * sigma[0]) first = j + 1;
  }
  return first;
}

/* The part of S orthogonal to the columns of V. */
static PetscErrorCode ReduceDeflate(Mat V, Mat S, Mat *rest)
{
  Mat C, part;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(S, MAT_COPY_VALUES, rest));
  /* Dominant modes are larger by orders of magnitude: one projection would leave their round-off. */
  for (int twice = 0; twice < 2; twice++) {
    PetscCall(MatTransposeMatMult(V, *rest, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &C));
    PetscCall(MatMatMult(V, C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &part));
    PetscCall(MatAXPY(*rest, -1, part, SAME_NONZERO_PATTERN));
    HycoDestroyAll(&C, &part);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HycoReducerPOD(); leading modes that dominate the energy by far, in a scene with springs, come first, and the others
   are a POD of what is behind them. Collective on S. */
static PetscErrorCode DisplacementPOD(HycoReducer t, Mat S, PetscReal tol, PetscInt max_modes, Mat *V, PetscInt *l,
                                      PetscReal sigma[])
{
  PetscInt first, more, N, n;
  PetscReal *behind;
  Mat part, rest, W;

  PetscFunctionBegin;
  /* with springs all modes, because the tolerance applies to what is behind the dominant ones */
  PetscCall(HycoReducerPOD(t, S, t->scene->n_springs ? 0 : tol, max_modes, V, l, sigma));
  PetscCall(MatGetSize(S, &N, &n));
  first = PetscMin(CountDominant(t->scene, PetscMin(N, n), sigma), *l);
  if (!first || first == max_modes) PetscFunctionReturn(PETSC_SUCCESS);
  /* A copy, since *V is destroyed: the submatrix shares its array. */
  PetscCall(MatDenseGetSubMatrix(*V, PETSC_DECIDE, PETSC_DECIDE, 0, first, &part));
  PetscCall(MatDuplicate(part, MAT_COPY_VALUES, &W));
  PetscCall(MatDenseRestoreSubMatrix(*V, &part));
  PetscCall(MatDestroy(V));
  PetscCall(ReduceDeflate(W, S, &rest));
  PetscCall(PetscCalloc1(n + 1, &behind));
  PetscCall(HycoReducerPOD(t, rest, tol, PetscMax(0, max_modes - first), V, &more, behind));
  PetscCall(PetscArraycpy(sigma + first, behind, PetscMin(N, n) - first));
  PetscCall(PetscFree(behind));
  PetscCall(MatDestroy(&rest));
  if (more) PetscCall(HycoJoinColumns(&W, V, &part));
  *V = more ? part : W;
  *l = first + more;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many of the `found` modes the tolerance takes: fails if it takes more, for lack of accuracy. */
static PetscErrorCode PODRank(HycoReducer t, PetscInt n_sigma, const PetscReal sigma[], PetscReal tol,
                              PetscInt max_modes, PetscInt found, PetscInt *l)
{
  PetscInt first;

  PetscFunctionBegin;
  /* With springs rigid motions are taken first; the tolerance then applies to the energy of the deformation. */
  first = CountDominant(t->scene, n_sigma, sigma);
  *l = first + HycoPODRank(n_sigma - first, sigma + first, tol, t->noise, 0);
  /* The user's limit is no lack of accuracy. */
  if (max_modes > 0) *l = PetscMin(*l, max_modes);
  HycoCheckModel(*l <= found || tol == 0,
                 "-hyco_pod_svd_type %s finds only %d accurate modes, which leave out more than %g of the snapshots' "
                 "energy; use tsqr, or a larger -hyco_pod_tol",
                 t->svd_type, (int)found, (double)tol);
  *l = PetscMin(*l, found);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mode of a small path matters as much as one of a large path, since errors are relative to each path; hence the
   factor. */
PetscReal HycoPathScale(PetscReal first, PetscReal largest)
{
  const PetscReal slight = 1e-3; /* paths with smaller relative displacements may be noise */

  return largest / PetscMax(first, slight * largest);
}

/* A path is compressed to modes times singular values: their Gram matrix is that of the path, up to tol. */
PetscErrorCode HycoPathModesAdd(HycoReducer t, Mat path, PetscReal tol, HycoPathModes *modes)
{
  PetscReal *sigma;
  PetscInt N, columns, l;
  Vec scale;
  Mat V;

  PetscFunctionBegin;
  PetscCall(MatGetSize(path, &N, &columns));
  PetscCall(PetscCalloc1(columns + 1, &sigma));
  PetscCall(HycoReducerPOD(t, path, tol, 0, &V, &l, sigma));
  if (!l) PetscCall(MatDestroy(&V));
  if (l) {
    PetscCall(MatCreateVecs(V, &scale, NULL));
    /* Singular values are on every rank: rank 0 alone adds them. */
    for (PetscInt k = 0; k < l; k++) PetscCall(VecSetValue(scale, k, t->rank ? 0 : sigma[k], ADD_VALUES));
    PetscCall(HycoVecAssemble(scale));
    PetscCall(MatDiagonalScale(V, NULL, scale));
    PetscCall(VecDestroy(&scale));
  }
  PetscCall(PetscRealloc((size_t)(modes->n + 1) * sizeof(*modes->V), &modes->V));
  PetscCall(PetscRealloc((size_t)(modes->n + 1) * sizeof(*modes->first), &modes->first));
  /* A path without displacement counts with first = 0, and gives no column. */
  modes->V[modes->n] = l ? V : NULL;
  modes->first[modes->n++] = sigma[0];
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathModesDestroy(HycoPathModes *modes)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < modes->n; j++) PetscCall(MatDestroy(&modes->V[j]));
  HycoFreeAll(&modes->V, &modes->first);
  modes->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes of the paths side by side (N rows, n_rows on this rank), each path scaled to the size of the largest, so
   that paths with small displacements have the same weight. */
static PetscErrorCode JoinPaths(HycoReducer t, const HycoPathModes *modes, PetscInt N, PetscInt n_rows, Mat *joined)
{
  PetscInt n = 0, at = 0;
  PetscReal largest = 0;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < modes->n; j++) {
    PetscInt l = 0;

    if (modes->V[j]) PetscCall(MatGetSize(modes->V[j], NULL, &l));
    n += l;
    largest = PetscMax(largest, modes->first[j]);
  }
  PetscCall(MatCreateDense(HycoComm(t), n_rows, PETSC_DECIDE, N, PetscMax(n, 1), NULL, joined));
  for (PetscInt j = 0; j < modes->n; j++) {
    PetscInt l;

    /* A path without displacement (no load reaches it) has no modes. */
    if (!modes->V[j]) continue;
    PetscCall(MatGetSize(modes->V[j], NULL, &l));
    /* Modes carry their singular values, so that the second POD sees each path's energy. */
    PetscCall(MatScale(modes->V[j], HycoPathScale(modes->first[j], largest)));
    PetscCall(HycoCopyColumns(modes->V[j], l, *joined, at));
    at += l;
  }
  PetscCall(HycoMatAssemble(*joined));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for the larger of both numbers. */
PetscErrorCode HycoReducerTakeBasis(HycoReducer t, Mat S, PetscReal tol, PetscInt most, HycoBasis *basis)
{
  PetscInt N, n;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(PetscCalloc1(PetscMax(t->n_s, n) + 1, &basis->sigma));
  basis->n_sigma = PetscMin(N, n);
  PetscCall(DisplacementPOD(t, S, tol, most, &basis->V, &basis->l, basis->sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes of the paths are freed before the POD, which needs as much memory again. */
PetscErrorCode HycoPathModesJoin(HycoReducer t, HycoPathModes *modes, PetscInt N, PetscInt n_rows, PetscReal tol,
                                 PetscInt max_modes, HycoBasis *basis)
{
  Mat joined;

  PetscFunctionBegin;
  PetscCall(JoinPaths(t, modes, N, n_rows, &joined));
  PetscCall(HycoPathModesDestroy(modes));
  PetscCall(HycoReducerTakeBasis(t, joined, tol, max_modes, basis));
  PetscCall(MatDestroy(&joined));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements between the listed times enrich the modes at no further solve. */
PetscErrorCode HycoReducerReadPath(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt j, Mat *path)
{
  PetscInt n_par, N, n_rows;
  const PetscReal *mu;
  Mat listed, between;

  PetscFunctionBegin;
  PetscCall(HycoReducerReadField(t, store, kind, j, 1, &listed));
  *path = listed;
  /* Steps between listed times are stored for displacements alone. */
  if (kind != HYCO_SEED_DISPLACEMENT) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &mu));
  PetscCall(MatGetSize(listed, &N, NULL));
  PetscCall(MatGetLocalSize(listed, &n_rows, NULL));
  PetscCall(HycoSnapshotsGetBetween(store, mu + j * n_par, n_rows, N, &between));
  PetscCall(RemoveLifting(t, between));
  PetscCall(HycoJoinColumns(&listed, &between, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD of each path, then of these modes. */
static PetscErrorCode FindPathBasis(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscReal tol, PetscInt most)
{
  HycoPathModes modes = {0};
  PetscInt N = 0, n_rows = 0;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < t->n_s / HycoSnapshotsSteps(t->scene); j++) {
    Mat path;

    PetscCall(HycoReducerReadPath(t, store, kind, j, &path));
    PetscCall(MatGetSize(path, &N, NULL));
    PetscCall(MatGetLocalSize(path, &n_rows, NULL));
    PetscCall(HycoPathModesAdd(t, path, tol, &modes));
    /* One path at a time: all columns of all paths may not fit into memory. */
    PetscCall(MatDestroy(&path));
  }
  PetscCall(HycoPathModesJoin(t, &modes, N, n_rows, tol, most, &t->basis[kind]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD of a field of the snapshots: every mode above the noise, or (all false) those that the tolerance takes. */
static PetscErrorCode FindBasis(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscBool all)
{
  const PetscInt most = kind == HYCO_SEED_DISPLACEMENT ? t->max_modes : 0;
  const PetscReal tol = all ? 0 : t->tol[kind];
  Mat S;

  PetscFunctionBegin;
  /* Batches first: they have an own way for paths. */
  if (t->pod_memory > 0) {
    PetscCall(HycoReducerStreamBasis(t, store, kind, tol, most));
  } else if (t->scene->n_times) {
    PetscCall(FindPathBasis(t, store, kind, tol, most));
  } else {
    PetscCall(HycoReducerReadField(t, store, kind, 0, t->n_s, &S));
    PetscCall(HycoReducerTakeBasis(t, S, tol, most, &t->basis[kind]));
    PetscCall(MatDestroy(&S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first modes of a basis, by the tolerance: V (NULL: none; the caller owns it), and their number. A basis of
   the search has every mode: a smaller tolerance takes more of its first columns, without another POD. */
static PetscErrorCode CutBasis(HycoReducer t, PetscInt kind, Mat *V, PetscInt *l)
{
  const HycoBasis *basis = &t->basis[kind];
  const PetscInt most = kind == HYCO_SEED_DISPLACEMENT ? t->max_modes : 0;
  Mat part;

  PetscFunctionBegin;
  *V = NULL;
  PetscCall(PODRank(t, basis->n_sigma, basis->sigma, t->tol[kind], most, basis->l, l));
  t->counts[kind] = *l;
  /* A field that is zero in all solutions, as stresses of a rigid body. */
  if (!*l) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDenseGetSubMatrix(basis->V, PETSC_DECIDE, PETSC_DECIDE, 0, *l, &part));
  /* A copy, because the submatrix borrows the basis' array. */
  PetscCall(MatDuplicate(part, MAT_COPY_VALUES, V));
  PetscCall(MatDenseRestoreSubMatrix(basis->V, &part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of S at the nodes, by column; on the other ranks rows is empty. */
PetscErrorCode HycoReducerFetchRows(HycoReducer t, Mat S, PetscInt n_columns, PetscInt n, const PetscInt node[],
                                    PetscReal rows[])
{
  /* A star forest whose leaves are on rank 0: the other ranks only send, and give no nodes. */
  const PetscInt dim = t->sizes[3], n_rows = t->rank ? 0 : n * dim;
  const PetscScalar *s;
  PetscLayout layout;
  PetscInt *row, lda;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_rows, &row));
  for (PetscInt i = 0; i < n_rows; i++) row[i] = node[i / dim] * dim + i % dim;
  PetscCall(MatGetLayouts(S, &layout, NULL));
  PetscCall(PetscSFCreate(HycoComm(t), &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, n_rows, NULL, PETSC_OWN_POINTER, row));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(MatDenseGetArrayRead(S, &s));
  /* Column by column: the data of a star forest are contiguous, and a message stays small. */
  for (PetscInt k = 0; k < n_columns; k++) {
    PetscReal *column = rows + (size_t)k * (size_t)n_rows;

    PetscCall(HycoSFBcast(sf, MPIU_REAL, 1, s + (size_t)k * (size_t)lda, column));
  }
  PetscCall(MatDenseRestoreArrayRead(S, &s));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows that FetchBatch() fetches, and their destination. */
typedef struct {
  PetscInt n;
  const PetscInt *node;
  PetscReal *rows;
} Fetched;

/* A HycoBatchUse. */
static PetscErrorCode FetchBatch(HycoReducer t, PetscInt first, Mat S, void *ctx)
{
  Fetched *f = (Fetched *)ctx;
  const PetscInt n_rows = t->rank ? 0 : f->n * t->sizes[3];
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, NULL, &n));
  PetscCall(HycoReducerFetchRows(t, S, n, f->n, f->node, f->rows + (size_t)first * (size_t)n_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In batches, so that no more than one batch of whole fields is in memory. */
PetscErrorCode HycoReducerFetchSnapshots(HycoReducer t, PetscInt n, const PetscInt node[], PetscReal **rows)
{
  const PetscInt n_rows = t->rank ? 0 : n * t->sizes[3];
  Fetched f = {n, node, NULL};

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)n_rows * (size_t)t->n_s + 1, &f.rows));
  *rows = f.rows;
  PetscCall(HycoReducerEachBatch(t, FetchBatch, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoBatchUse: norms of displacements minus their lifting, and V^T of these. */
static PetscErrorCode ProjectBatch(HycoReducer t, PetscInt first, Mat S, void *ctx)
{
  HycoBasis *basis = &t->basis[HYCO_SEED_DISPLACEMENT];
  Mat X;

  PetscFunctionBegin;
  (void)ctx;
  PetscCall(MatDuplicate(S, MAT_COPY_VALUES, &X));
  PetscCall(RemoveLifting(t, X));
  PetscCall(MatGetColumnNorms(X, NORM_2, t->U_norm + first));
  /* All modes of the basis: any truncation takes the first rows of a column. */
  if (basis->l) PetscCall(HycoReducerMultiply(t, basis->V, X, basis->coefficients + (size_t)first * (size_t)basis->l));
  PetscCall(MatDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements: their norms, and V^T of the snapshots minus their lifting, by which a model is judged on the whole
   mesh at the cost of its modes. */
static PetscErrorCode ReduceDisplacements(HycoReducer t, HycoSnapshots store, PetscBool all)
{
  HycoBasis *basis = &t->basis[HYCO_SEED_DISPLACEMENT];
  const PetscInt n = t->n_s / HycoSnapshotsSteps(t->scene);

  PetscFunctionBegin;
  /* Kept with the lifting: rows of it are fetched for every attempt of a search. */
  if (!(t->pod_memory > 0)) PetscCall(HycoSnapshotsGetField(store, t->columns, 0, n, "U", t->sizes[3], &t->S));
  PetscCall(FindBasis(t, store, HYCO_SEED_DISPLACEMENT, all));
  HycoCheckModel(basis->l || !(basis->sigma[0] > 0), "-hyco_pod_tol %g leaves no mode; give a smaller value",
                 (double)t->tol[HYCO_SEED_DISPLACEMENT]);
  /* A type with modes of its own needs none of these. */
  HycoCheckModel(basis->l || HycoReducerOwnModes(t, t->prototype),
                 "every training solution has zero displacement, so that there are no modes; check the loads");
  PetscCall(PetscMalloc1(t->n_s, &t->U_norm));
  PetscCall(PetscMalloc1((size_t)basis->l * (size_t)t->n_s, &basis->coefficients));
  PetscCall(HycoReducerEachBatch(t, ProjectBatch, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses (points are cells) or generalised forces, also those of springs (points are nodes), if they seed the RID. */
static PetscErrorCode ReduceField(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscBool all)
{
  PetscFunctionBegin;
  if (t->seed[kind]) PetscCall(FindBasis(t, store, kind, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a basis seeds the RID of the current type. */
static PetscBool ReduceSeeds(HycoReducer t, PetscInt kind)
{
  return (PetscBool)(t->seed[kind] && !t->prototype->model->traits.cells);
}

/* DEIM on the modes taken from a basis. */
static PetscErrorCode SeedFrom(HycoReducer t, Mat V, PetscInt l, PetscInt kind, PetscInt divide, PetscInt *n_seeds,
                               PetscInt **seeds)
{
  PetscInt *index;

  PetscFunctionBegin;
  /* A basis may serve the modes without placing the RID. */
  if (!l || !ReduceSeeds(t, kind)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(l, &index));
  HycoLogged(HYCO_EVENT_DEIM, ReducePoints(t, V, index));
  PetscCall(AddSeeds(l, index, divide, n_seeds, seeds));
  PetscCall(PetscFree(index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes and the snapshots' coefficients. */
static PetscErrorCode TakeDisplacements(HycoReducer t)
{
  const HycoBasis *basis = &t->basis[HYCO_SEED_DISPLACEMENT];
  Mat V;

  PetscFunctionBegin;
  PetscCall(CutBasis(t, HYCO_SEED_DISPLACEMENT, &V, &t->l));
  HycoCheckModel(t->l || HycoReducerOwnModes(t, t->prototype), "-hyco_pod_tol %g leaves no mode; give a smaller value",
                 (double)t->tol[HYCO_SEED_DISPLACEMENT]);
  PetscCall(PetscMalloc1(PetscMax(t->n_s, basis->n_sigma) + 1, &t->sigma));
  PetscCall(PetscArraycpy(t->sigma, basis->sigma, PetscMax(t->n_s, basis->n_sigma) + 1));
  PetscCall(SeedFrom(t, V, t->l, HYCO_SEED_DISPLACEMENT, t->sizes[3], &t->n_seeds_node, &t->seeds_node));
  PetscCall(PetscMalloc1(t->l * t->n_s, &t->VtU));
  /* Coefficients of a truncated basis are the first ones: modes are orthonormal. */
  for (PetscInt k = 0; k < t->n_s; k++)
    PetscCall(PetscArraycpy(t->VtU + k * t->l, basis->coefficients + k * basis->l, t->l));
  t->V = V;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows chosen by DEIM from one field's modes, as seeds of the RID. Where a plane of symmetry is the RID, only
   displacements seed. */
static PetscErrorCode TakeField(HycoReducer t, PetscInt kind, PetscInt divide, PetscInt *n_seeds, PetscInt **seeds)
{
  Mat V;
  PetscInt l;

  PetscFunctionBegin;
  if (!ReduceSeeds(t, kind) || t->plane) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CutBasis(t, kind, &V, &l));
  PetscCall(SeedFrom(t, V, l, kind, divide, n_seeds, seeds));
  PetscCall(MatDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column k of B^T Lambda, by nodes in the distributed vectors' order. Rank 0 has the contacts and adds into rows
   of other ranks; MatAssembly sends them. */
static PetscErrorCode SetForces(HycoReducer t, PetscInt k, Mat R)
{
  HycoFOM f = t->fom;
  const PetscInt m = t->sizes[2], dim = t->sizes[3];
  HycoRows rows = {0};

  PetscFunctionBegin;
  PetscCall(HycoContactRows(f->fe_surface, &f->pairs, &rows));
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = rows.start[i]; j < rows.start[i + 1]; j++) {
      /* Rows of B act on the surfaces' mesh; the distributed vectors have global numbers. */
      const PetscInt at = rows.dof[j] / dim, node = f->surface->node_global ? f->surface->node_global[at] : at;

      PetscCall(MatSetValue(R, node * dim + rows.dof[j] % dim, k,
                            rows.value[j] * t->Lambda[(size_t)k * (size_t)m + (size_t)i], ADD_VALUES));
    }
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of length 1, zero where fixed; a column of zeros stays zero. */
PetscErrorCode HycoReducerUnitRows(HycoReducer t, Mat X, Mat *scaled)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = t->sizes[3];
  const HycoFileOrder *order;
  PetscInt n, rows, lda[2];
  PetscReal *size, *value;
  const PetscScalar *x;
  PetscScalar *y;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(t->fom, &order));
  rows = dim * (order ? order->n[HYCO_ON_NODES] : part->n_nodes);
  PetscCall(MatGetSize(X, NULL, &n));
  PetscCall(MatCreateDense(HycoComm(t), rows, PETSC_DECIDE, t->sizes[0] * dim, n, NULL, scaled));
  /* From the distributed vectors' order to the file's, through values at the part's nodes. */
  PetscCall(PetscMalloc2(n, &size, part->n_nodes * dim, &value));
  PetscCall(MatGetColumnNorms(X, NORM_2, size));
  PetscCall(MatDenseGetLDA(X, &lda[0]));
  PetscCall(MatDenseGetLDA(*scaled, &lda[1]));
  PetscCall(MatDenseGetArrayRead(X, &x));
  PetscCall(MatDenseGetArray(*scaled, &y));
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt i = 0; i < part->n_nodes * dim; i++) {
      const PetscInt place = HycoMeshOwned(part, i / dim);
      const PetscBool none = (PetscBool)(place < 0 || t->fom->fe->fixed[i] || size[k] == 0);

      value[i] = none ? 0 : x[(size_t)k * (size_t)lda[0] + (size_t)(place * dim + i % dim)] / size[k];
    }
    PetscCall(HycoFOMToRows(t->fom, HYCO_ON_NODES, MPIU_REAL, dim, value, y + (size_t)k * (size_t)lda[1]));
  }
  PetscCall(MatDenseRestoreArray(*scaled, &y));
  PetscCall(MatDenseRestoreArrayRead(X, &x));
  PetscCall(PetscFree2(size, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The supremizer of a force is the displacement on which it does most work in the H1 norm: M^-1 B^T Lambda. */
PetscErrorCode HycoReducerSupremizers(HycoReducer t, Mat *forces, Mat *supremizers)
{
  HycoFOM f = t->fom;
  const PetscInt n = t->n_s, n_own = f->part->n_owned * t->sizes[3];
  PetscReal mu[HYCO_MAX_PARAMETERS];
  Mat M, R;

  PetscFunctionBegin;
  PetscCall(MatCreateDense(HycoComm(t), n_own, PETSC_DECIDE, t->sizes[0] * t->sizes[3], n, NULL, &R));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoReducerColumn(t, k, mu));
    PetscCall(HycoFOMSetParameters(f, mu));
    /* B is that of the column's own parameters: rows turn and move with the bodies. */
    HycoOnRoot(HycoComm(t), SetForces(t, k, R));
  }
  PetscCall(HycoMatAssemble(R));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(t), f->part->n_owned, f->part->first, &M));
  HycoOnEach(HycoComm(t), HycoFEAssembleH1(f->fe, HycoMeshLength(f->part), M));
  PetscCall(HycoSolveColumns(M, "the H1 norm's matrix", R, supremizers));
  PetscCall(MatDestroy(&M));
  *forces = R;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gram matrix of the dual snapshots in the norm of the dual of H1: (B^T L)^T M^-1 (B^T L). On every rank. */
static PetscErrorCode DualGram(HycoReducer t, PetscReal G[])
{
  const PetscInt n = t->n_s;
  Mat R, X;

  PetscFunctionBegin;
  PetscCall(HycoReducerSupremizers(t, &R, &X));
  PetscCall(HycoReducerMultiply(t, R, X, G));
  for (PetscInt j = 0; j < n; j++) {
    /* Symmetric up to round-off: made so, as the eigensolver reads one triangle. */
    for (PetscInt i = 0; i <= j; i++) G[j * n + i] = G[i * n + j] = (G[j * n + i] + G[i * n + j]) / 2;
  }
  HycoDestroyAll(&X, &R);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves surfaces to the training point with the largest force of contact k. Collective; k: on rank 0. A contact of
   moved surfaces has other masters at each point: its seeds are those where it presses most. */
static PetscErrorCode MoveWherePresses(HycoReducer t, PetscInt k)
{
  const size_t m = (size_t)t->sizes[2];
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt most = 0;

  PetscFunctionBegin;
  if (!t->fom->searches) PetscFunctionReturn(PETSC_SUCCESS);
  /* Ties go to the first solution, the same on any number of ranks. */
  for (PetscInt q = 1; q < t->n_s && t->rank == 0; q++) {
    if (t->Lambda[(size_t)q * m + (size_t)k] > t->Lambda[(size_t)most * m + (size_t)k]) most = q;
  }
  PetscCallMPI(MPI_Bcast(&most, 1, MPIU_INT, 0, HycoComm(t)));
  PetscCall(HycoReducerColumn(t, most, mu));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  HycoOnRoot(HycoComm(t), HycoPairsMove(t->fom->fe_surface, &t->fom->pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD of the multipliers in (H1)', whose Gram matrix is G, and DEIM on it: l contacts. On rank 0. */
static PetscErrorCode DualPoints(HycoReducer t, const PetscReal G[], PetscInt *l, PetscInt index[])
{
  const PetscInt m = t->sizes[2], n = t->n_s;
  PetscReal *W, *sigma;
  Mat V;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &sigma));
  /* V = Lambda W: DEIM looks at values of contact forces, the norm at their effect. */
  PetscCall(HycoPODGram(n, G, t->tol[HYCO_SEED_DUAL], t->noise, &W, l, sigma));
  if (*l) {
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, *l, NULL, &V));
    PetscCall(MatDenseGetArray(V, &v));
    for (PetscInt j = 0; j < *l; j++) {
      for (PetscInt k = 0; k < n; k++) {
        for (PetscInt i = 0; i < m; i++) v[j * m + i] += t->Lambda[(size_t)k * (size_t)m + (size_t)i] * W[j * n + k];
      }
    }
    PetscCall(MatDenseRestoreArray(V, &v));
    HycoLogged(HYCO_EVENT_DEIM, ReducePoints(t, V, index));
    PetscCall(MatDestroy(&V));
  }
  HycoFreeAll(&W, &sigma);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of contact k, by their numbers in the whole mesh. The list grows: a contact of a mortar surface or of
   quadratic facets may have any number of masters. Rank 0. */
static PetscErrorCode AddContactNodes(HycoReducer t, PetscInt k, PetscInt *n, PetscInt **nodes)
{
  HycoFOM f = t->fom;
  const PetscInt *master;
  const PetscReal *weight;
  PetscInt masters;

  PetscFunctionBegin;
  HycoPairsMasters(&f->pairs, k, &masters, &master, &weight);
  PetscCall(PetscRealloc((size_t)(*n + masters + 1) * sizeof(**nodes), nodes));
  /* The slave first, then its masters: all of them must lie in the RID. */
  for (PetscInt j = -1; j < masters; j++) {
    const PetscInt node = j < 0 ? HycoPairsSlave(&f->pairs, k) : master[j];

    (*nodes)[(*n)++] = f->surface->node_whole ? f->surface->node_whole[node] : node;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of the contacts that DEIM selects from the dual snapshots, on every rank. Collective. Every rank goes
   through the loop, since MoveWherePresses() is collective; contacts are known on rank 0 alone. */
static PetscErrorCode DualSeeds(HycoReducer t, PetscInt *n_nodes, PetscInt **nodes)
{
  PetscReal *G;
  PetscInt l = 0, *index;

  PetscFunctionBegin;
  *n_nodes = 0;
  PetscCall(PetscMalloc2(t->n_s * t->n_s, &G, t->n_s, &index));
  /* The dual norm of H1 between forces: one solve with the norm's matrix per snapshot. */
  PetscCall(DualGram(t, G));
  HycoOnRoot(HycoComm(t), DualPoints(t, G, &l, index));
  PetscCallMPI(MPI_Bcast(&l, 1, MPIU_INT, 0, HycoComm(t)));
  t->counts[HYCO_SEED_DUAL] = l;
  for (PetscInt k = 0; k < l; k++) {
    PetscCall(MoveWherePresses(t, index[k]));
    if (t->rank == 0) PetscCall(AddContactNodes(t, index[k], n_nodes, nodes));
  }
  PetscCallMPI(MPI_Bcast(n_nodes, 1, MPIU_INT, 0, HycoComm(t)));
  /* Rank 0's list has grown in place; the others get exactly its length. */
  if (t->rank) PetscCall(PetscMalloc1(*n_nodes, nodes));
  HycoBcast(*nodes, *n_nodes, MPIU_INT, HycoComm(t));
  PetscCall(PetscFree2(G, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the dual snapshots. Rank 0. */
static PetscErrorCode ReadForces(HycoReducer t, HycoSnapshots store)
{
  const PetscInt m = t->sizes[2], steps = HycoSnapshotsSteps(t->scene);
  PetscInt n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &mu));
  PetscCall(PetscMalloc1((size_t)m * (size_t)t->n_s + 1, &t->Lambda));
  /* Contacts are stored in the order of the mesh file: the same for every partition. */
  for (PetscInt k = 0; k < t->n_s; k++)
    PetscCall(HycoSnapshotsReadRows(store, mu + k / steps * n_par, k % steps, HycoSeedFields[HYCO_SEED_DUAL], 0, m,
                                    t->Lambda + (size_t)k * (size_t)m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the dual snapshots on rank 0 and finds their seeds, which depend only on -hyco_rid_dual_tol. */
static PetscErrorCode ReduceForces(HycoReducer t, HycoSnapshots store)
{
  PetscFunctionBegin;
  HycoOnRoot(HycoComm(t), ReadForces(t, store));
  if (!t->seed[HYCO_SEED_DUAL] || !t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DualSeeds(t, &t->n_dual_seeds, &t->dual_seeds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only truncates: called for each attempt of a search, with the tolerances of its settings. */
PetscErrorCode HycoReducerTakeBases(HycoReducer t)
{
  const PetscInt dim = t->sizes[3], n_sigma = dim == 1 ? 1 : dim == 2 ? 4 : 6;

  PetscFunctionBegin;
  /* Of the former attempt; the whole bases stay. */
  PetscCall(HycoReducerDropBases(t));
  PetscCall(TakeDisplacements(t));
  PetscCall(TakeField(t, HYCO_SEED_STRESS, n_sigma, &t->n_seeds_cell, &t->seeds_cell));
  PetscCall(TakeField(t, HYCO_SEED_FORCE, dim, &t->n_seeds_node, &t->seeds_node));
  PetscCall(TakeField(t, HYCO_SEED_SPRING, dim, &t->n_seeds_node, &t->seeds_node));
  /* One component: the accumulated strain shows where laws act. */
  PetscCall(TakeField(t, HYCO_SEED_INELASTIC, 1, &t->n_seeds_cell, &t->seeds_cell));
  if (ReduceSeeds(t, HYCO_SEED_DUAL))
    PetscCall(AddSeeds(t->n_dual_seeds, t->dual_seeds, 1, &t->n_seeds_node, &t->seeds_node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The steps of predictions, where full order has chosen its own by their error in time: in each listed interval those
   of the training path with most of them. */
static PetscErrorCode ChooseStops(HycoReducer t, PetscInt n, PetscReal time_error)
{
  const HycoScene s = t->scene;

  PetscFunctionBegin;
  t->n_stops = 0;
  t->stops_error = time_error;
  for (PetscInt j = 1; j < s->n_times && time_error > 0; j++) {
    const PetscReal *most = NULL;
    PetscInt n_most = 0;

    for (PetscInt k = 0; k < n; k++) {
      const PetscReal *at = t->taken + t->taken_start[k], *end = t->taken + t->taken_start[k + 1];
      PetscInt count = 0;

      while (at < end && *at <= s->times[j - 1]) at++;
      while (at + count < end && at[count] < s->times[j]) count++;
      if (count > n_most) most = at;
      n_most = PetscMax(n_most, count);
    }
    PetscCall(PetscRealloc((size_t)(t->n_stops + n_most + 1) * sizeof(PetscReal), &t->stops));
    PetscCall(PetscArraycpy(t->stops + t->n_stops, most, n_most));
    t->n_stops += n_most;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the times of the steps of the training paths. Judging replays the training paths in the steps of full
   order, so that errors of time stepping do not count as the model's. */
static PetscErrorCode ReadTaken(HycoReducer t, HycoSnapshots store)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscReal time_error, most = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, &n, &n_par, &mu));
  PetscCall(PetscCalloc1(n + 1, &t->taken_start));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *taken;
    PetscInt count;

    PetscCall(HycoSnapshotsReadTaken(store, mu + k * n_par, &count, &taken, &time_error));
    PetscCall(PetscRealloc((size_t)(t->taken_start[k] + count + 1) * sizeof(PetscReal), &t->taken));
    PetscCall(PetscArraycpy(t->taken + t->taken_start[k], taken, count));
    /* All paths in one array, since each has its own number of steps. */
    t->taken_start[k + 1] = t->taken_start[k] + count;
    PetscCall(PetscFree(taken));
    most = PetscMax(most, time_error);
  }
  PetscCall(ChooseStops(t, n, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements first, which must give a mode; forces of contacts last, whose norm needs the mesh at each column's
   parameters. */
PetscErrorCode HycoReducerReduce(HycoReducer t, HycoSnapshots store, PetscBool all)
{
  PetscFunctionBegin;
  PetscCall(ReduceDisplacements(t, store, all));
  PetscCall(ReduceField(t, store, HYCO_SEED_STRESS, all));
  PetscCall(ReduceField(t, store, HYCO_SEED_FORCE, all));
  PetscCall(ReduceField(t, store, HYCO_SEED_SPRING, all));
  PetscCall(ReduceField(t, store, HYCO_SEED_INELASTIC, all));
  if (t->scene->n_times) HycoOnRoot(HycoComm(t), ReadTaken(t, store));
  /* Also where the RID is not seeded by forces: (41) needs them. */
  PetscCall(ReduceForces(t, store));
  PetscCall(HycoReducerTakeBases(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
