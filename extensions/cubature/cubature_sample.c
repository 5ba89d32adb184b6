/*
  Samples for the cubature: with a state of the laws at a training point, each cell e contributes V_e^T f_e to the
  reduced internal forces, f_e the integral of B^T sigma over the cell minus its body forces. The states come from a
  replay of the laws along the training paths, on the displacements r(u0) + V gamma of the snapshots' coefficients
  (between listed times linear in time), in the steps of full order. There is a column for each mode and listed time,
  with the columns of a time divided by their size, as in the errors. The singular vectors are computed for each path,
  then of these.
*/
#include "cubature.h"

/* Of the tolerance of the energies: a hundredth, so that the truncation of the vectors does not decide which cells the
   weights need. */
#define TRUNCATION_SHARE 1e-2

typedef struct {
  HycoReducer t;
  HycoTrainingReplay replay;
  HycoFE fe;        /* this rank's part */
  PetscReal *V, *g; /* the modes on this part, n_dof x l row major; cells x l */
  PetscInt n_rows;  /* this rank's cells in the file's order */
  PetscReal *rows;  /* n_rows x l row major */
  Mat J;            /* of the current training point */
} Sampler;

/* Fetches the modes at the nodes of the part. Collective. */
static PetscErrorCode FetchModes(Sampler *s)
{
  HycoReducer t = s->t;
  const PetscInt n_dof = s->fe->n_dof, l = t->l;
  const PetscScalar *v;
  PetscReal *column;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_dof, &column));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_NODES, s->fe->dim, v + (size_t)j * (size_t)lda, column));
    for (PetscInt i = 0; i < n_dof; i++) s->V[(size_t)i * (size_t)l + (size_t)j] = column[i];
  }
  PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  PetscCall(PetscFree(column));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V gamma of column k of the snapshots. */
static PetscErrorCode CubatureSampleDisplacement(void *ctx, PetscInt k, PetscReal u[])
{
  const Sampler *s = (const Sampler *)ctx;
  const PetscInt l = s->t->l;
  const PetscReal *a = s->t->VtU + (size_t)k * (size_t)l;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < s->fe->n_dof; i++) {
    const PetscReal *v = s->V + (size_t)i * (size_t)l;

    u[i] = 0;
    for (PetscInt j = 0; j < l; j++) u[i] += v[j] * a[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g += f V[dof,:], for the unknowns after the elimination of supports along a direction. */
static void AddForce(const Sampler *s, PetscInt dof, PetscReal f, PetscReal g[])
{
  const PetscInt l = s->t->l, node = dof / s->fe->dim;
  const HycoOblique *oblique = HycoFEOblique(s->fe, dof);

  for (PetscInt d = -1; d < (oblique ? s->fe->dim : 0); d++) {
    const PetscReal *v = s->V + (size_t)(d < 0 ? dof : node * s->fe->dim + d) * (size_t)l;
    const PetscReal share = d < 0 ? f : f * oblique->a[d];

    for (PetscInt j = 0; j < l; j++) g[j] += v[j] * share;
  }
}

/* g: V_e^T f_e of the part's cells; 0 for cells with weight 1. */
static PetscErrorCode CubatureSampleProject(Sampler *s)
{
  HycoMesh m = s->fe->mesh;
  const PetscInt l = s->t->l, n = m->nv * m->dim;
  const PetscBool *near = ((HycoCubatureTraining)s->t->training)->near;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal f[HYCO_MAX_CELL_DOFS], load[HYCO_MAX_CELL_DOFS] = {0}, *g = s->g + (size_t)e * (size_t)l;

    for (PetscInt j = 0; j < l; j++) g[j] = 0;
    /* Cells of weight 1 take no part in the fit: theirs is exact. */
    if (near && near[e]) continue;
    PetscCall(HycoFEStateForce(s->fe, s->replay.march.state, e, f));
    PetscCall(HycoFEBodyForce(s->fe, e, load));
    for (PetscInt k = 0; k < n; k++)
      AddForce(s, m->cells[e * m->nv + k / m->dim] * m->dim + k % m->dim, f[k] - load[k], g);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the l columns of a listed time. Collective. */
static PetscErrorCode CubatureSampleRecord(void *ctx, PetscInt k)
{
  Sampler *s = (Sampler *)ctx;
  const PetscInt l = s->t->l, step = k % HycoSnapshotsSteps(s->t->scene);
  PetscScalar *a;
  PetscInt lda;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(s->t), CubatureSampleProject(s));
  PetscCall(HycoFOMToRows(s->t->fom, HYCO_ON_CELLS, MPIU_REAL, l, s->g, s->rows));
  PetscCall(MatDenseGetLDA(s->J, &lda));
  PetscCall(MatDenseGetArray(s->J, &a));
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < s->n_rows; i++)
      a[(size_t)(step * l + j) * (size_t)lda + (size_t)i] = s->rows[(size_t)i * (size_t)l + (size_t)j];
  }
  PetscCall(MatDenseRestoreArray(s->J, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for the whole part, cells and modes, as each listed time needs all of them at once. */
static PetscErrorCode CubatureSampleCreate(HycoReducer t, Sampler *s)
{
  const HycoFileOrder *order;
  const PetscInt l = t->l;

  PetscFunctionBegin;
  *s = (Sampler){.t = t, .fe = t->fom->fe};
  PetscCall(HycoFOMGetRows(t->fom, &order));
  s->n_rows = order ? order->n[HYCO_ON_CELLS] : t->fom->part->n_cells;
  PetscCall(PetscMalloc1((size_t)s->fe->n_dof * (size_t)l + 1, &s->V));
  PetscCall(PetscMalloc1((size_t)t->fom->part->n_cells * (size_t)l + 1, &s->g));
  PetscCall(PetscCalloc1((size_t)s->n_rows * (size_t)l + 1, &s->rows));
  PetscCall(FetchModes(s));
  PetscCall(HycoTrainingReplayCreate(t, CubatureSampleDisplacement, CubatureSampleRecord, s, &s->replay));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Divides each listed time's columns by their size, or by a tenth of the largest size if that is larger. Collective. */
static PetscErrorCode CubatureSampleBalance(HycoReducer t, Mat J)
{
  const PetscInt l = t->l, n = HycoSnapshotsSteps(t->scene);
  PetscReal *norm, *size, largest = 0;
  PetscScalar *a;
  PetscInt lda, rows;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * l, &norm));
  PetscCall(PetscCalloc1(n, &size));
  PetscCall(MatGetColumnNorms(J, NORM_2, norm));
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = 0; j < l; j++) size[k] += norm[k * l + j] * norm[k * l + j];
    size[k] = PetscSqrtReal(size[k]);
    largest = PetscMax(largest, size[k]);
  }
  PetscCall(MatGetLocalSize(J, &rows, NULL));
  PetscCall(MatDenseGetLDA(J, &lda));
  PetscCall(MatDenseGetArray(J, &a));
  for (PetscInt k = 0; k < n * l && largest > 0; k++) {
    for (PetscInt i = 0; i < rows; i++)
      a[(size_t)k * (size_t)lda + (size_t)i] /= PetscMax(size[k / l], HYCO_SMALL_FORCE * largest);
  }
  PetscCall(MatDenseRestoreArray(J, &a));
  HycoFreeAll(&norm, &size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The singular vectors of J in *W (NULL: none; the caller owns it), as many as the tolerance takes, and the singular
   values. Collective. */
static PetscErrorCode CubatureSampleDecompose(HycoReducer t, Mat J, PetscReal tol, Mat *W, PetscInt *n,
                                              PetscReal **sigma)
{
  PetscInt cells, columns;

  PetscFunctionBegin;
  PetscCall(MatGetSize(J, &cells, &columns));
  PetscCall(PetscCalloc1(PetscMin(cells, columns) + 1, sigma));
  PetscCall(HycoReducerPOD(t, J, tol, 0, W, n, *sigma));
  if (!*n) PetscCall(MatDestroy(W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The singular vectors of a training point, times their singular values. Collective. */
static PetscErrorCode SamplePoint(Sampler *s, HycoSnapshots store, PetscInt k, PetscReal tol, Mat *W, PetscInt *n)
{
  HycoReducer t = s->t;
  PetscReal *sigma;
  PetscScalar *a;
  PetscInt lda;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(MatCreateDense(HycoComm(t), s->n_rows, PETSC_DECIDE, t->sizes[1], HycoSnapshotsSteps(t->scene) * t->l, NULL,
                           &s->J));
  ierr = HycoTrainingReplayFollow(&s->replay, store, k);
  if (!ierr) ierr = CubatureSampleBalance(t, s->J);
  if (!ierr) ierr = CubatureSampleDecompose(t, s->J, tol, W, n, &sigma);
  PetscCall(MatDestroy(&s->J));
  PetscCall(ierr);
  if (*n) {
    PetscCall(MatDenseGetLDA(*W, &lda));
    PetscCall(MatDenseGetArray(*W, &a));
    for (PetscInt j = 0; j < *n; j++) {
      for (PetscInt i = 0; i < s->n_rows; i++) a[(size_t)j * (size_t)lda + (size_t)i] *= sigma[j];
    }
    PetscCall(MatDenseRestoreArray(*W, &a));
  }
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins all points' vectors in one matrix. Collective. */
static PetscErrorCode CubatureSampleJoin(Sampler *s, HycoSnapshots store, PetscReal tol, Mat *joined)
{
  HycoReducer t = s->t;
  PetscInt points, all = 0, at = 0, *n;
  Mat *W;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &points, NULL, NULL));
  PetscCall(PetscCalloc2(points, &W, points, &n));
  for (PetscInt k = 0; k < points; k++) {
    PetscCall(HycoReducerTell(t, "internal forces of training points", k, points));
    PetscCall(SamplePoint(s, store, k, tol, &W[k], &n[k]));
    all += n[k];
  }
  PetscCall(MatCreateDense(HycoComm(t), s->n_rows, PETSC_DECIDE, t->sizes[1], PetscMax(all, 1), NULL, joined));
  for (PetscInt k = 0; k < points; k++) {
    Mat part;

    if (!n[k]) continue;
    PetscCall(MatDenseGetSubMatrix(*joined, PETSC_DECIDE, PETSC_DECIDE, at, at + n[k], &part));
    PetscCall(MatCopy(W[k], part, SAME_NONZERO_PATTERN));
    PetscCall(MatDenseRestoreSubMatrix(*joined, &part));
    PetscCall(MatDestroy(&W[k]));
    at += n[k];
  }
  PetscCall(HycoMatAssemble(*joined));
  PetscCall(PetscFree2(W, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tolerance of the truncation is a share of that of the cells, since it applies twice, to each path and to all. */
PetscErrorCode HycoCubatureSample(HycoReducer t, HycoSnapshots store, PetscReal tol, Mat *W, PetscInt *n,
                                  PetscReal **sigma)
{
  Sampler s;
  Mat J = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(CubatureSampleCreate(t, &s));
  ierr = CubatureSampleJoin(&s, store, TRUNCATION_SHARE * tol, &J);
  PetscCall(HycoTrainingReplayDestroy(&s.replay));
  HycoFreeAll(&s.V, &s.g, &s.rows);
  if (!ierr) ierr = CubatureSampleDecompose(t, J, TRUNCATION_SHARE * tol, W, n, sigma);
  PetscCall(MatDestroy(&J));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
