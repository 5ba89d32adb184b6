/*
  What the cubature has to integrate: with a state of the laws at a training point, each cell e gives V_e^T f_e to the
  reduced internal forces, f_e the integral of B^T sigma over the cell less its body forces. States come from a replay
  of the laws along the training paths, on the displacements r(u0) + V gamma of the snapshots' coefficients (between
  listed times linear in time), in the steps that full order took. A column for each mode and listed time; a time counts
  by its size, as errors are judged. Of each path the singular vectors, then of these.
*/
#include <hycocubature.h>

#define SHARE 1e-2 /* of the energy that may be missed, what the vectors leave out */

typedef struct {
  HycoReducer t;
  HycoFE fe;                /* this rank's part */
  PetscReal *V, *u, *f, *g; /* the modes there, n_dof x l row major; n_dof; n_dof; cells x l */
  PetscInt n_rows;          /* this rank's cells in the file's order */
  PetscReal *rows;          /* n_rows x l row major */
  HycoFEState begin, end;
} Sampler;

static PetscErrorCode Destroy(Sampler *s)
{
  PetscFunctionBegin;
  PetscCall(HycoFEStateDestroy(&s->begin));
  PetscCall(HycoFEStateDestroy(&s->end));
  HycoFreeAll(&s->V, &s->u, &s->f, &s->g, &s->rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes at the nodes of the part. Collective. */
static PetscErrorCode FetchModes(Sampler *s)
{
  HycoReducer t = s->t;
  const PetscInt n_dof = s->fe->n_dof, l = t->l;
  const PetscScalar *v;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscCall(HycoFOMFromRows(t->fom, s->fe->dim, v + (size_t)j * (size_t)lda, s->u));
    for (PetscInt i = 0; i < n_dof; i++) s->V[(size_t)i * (size_t)l + (size_t)j] = s->u[i];
  }
  PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(HycoReducer t, Sampler *s)
{
  const HycoFileOrder *order;
  const PetscInt l = t->l;

  PetscFunctionBegin;
  *s = (Sampler){.t = t, .fe = t->fom->fe};
  PetscCall(HycoFOMGetRows(t->fom, &order));
  s->n_rows = order ? order->n[HYCO_ON_CELLS] : t->fom->part->n_cells;
  PetscCall(PetscMalloc1((size_t)s->fe->n_dof * (size_t)l + 1, &s->V));
  PetscCall(PetscMalloc1(s->fe->n_dof, &s->u));
  PetscCall(PetscMalloc1(s->fe->n_dof, &s->f));
  PetscCall(PetscMalloc1((size_t)t->fom->part->n_cells * (size_t)l + 1, &s->g));
  PetscCall(PetscCalloc1((size_t)s->n_rows * (size_t)l + 1, &s->rows));
  PetscCall(FetchModes(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u of training point k at a time. */
static void Displace(Sampler *s, PetscInt k, PetscReal time)
{
  const HycoScene scene = s->t->scene;
  const PetscInt l = s->t->l, n = HycoSnapshotsSteps(scene);
  const PetscReal *a = s->t->VtU + (size_t)(k * n) * (size_t)l;
  PetscReal share = 0;
  PetscInt at = 0;

  if (scene->n_times > 1) {
    while (at + 2 < n && scene->times[at + 1] < time) at++;
    share = PetscMin(1, (time - scene->times[at]) / (scene->times[at + 1] - scene->times[at]));
  }
  a += (size_t)at * (size_t)l;
  for (PetscInt i = 0; i < s->fe->n_dof; i++) {
    const PetscReal *v = s->V + (size_t)i * (size_t)l;

    s->u[i] = s->fe->u0[i];
    for (PetscInt j = 0; j < l; j++) s->u[i] += v[j] * (share > 0 ? (1 - share) * a[j] + share * a[l + j] : a[j]);
  }
  HycoFEComplete(s->fe, s->u);
}

/* The laws from t0 to t1, which fe is at. */
static PetscErrorCode Step(Sampler *s, PetscInt k, PetscReal t0, PetscReal t1)
{
  HycoFEState state = s->begin;
  HycoFEStepReport report;

  PetscFunctionBegin;
  if (!s->begin) {
    PetscCall(HycoFEStateCreate(s->fe, &s->begin));
    PetscCall(HycoFEStateCreate(s->fe, &s->end));
    state = s->begin;
  }
  Displace(s, k, t1);
  PetscCall(HycoFEStep(s->fe, s->u, t0, t1, s->begin, s->end, s->f, PETSC_FALSE, &report));
  HycoCheckModel(!report.failed, "the laws have no answer to the training displacements at t = %.10g: %s", (double)t1,
                 report.why);
  s->begin = s->end;
  s->end = state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g += f V[dof,:], by the unknowns in the place of a displacement that a support along a direction gives. */
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

/* g: V_e^T f_e of the part's cells; 0 of those that are in the sum once. */
static PetscErrorCode Project(Sampler *s)
{
  HycoMesh m = s->fe->mesh;
  const PetscInt l = s->t->l, n = m->nv * m->dim;
  const PetscBool *near = ((HycoCubatureTraining)s->t->training)->near;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal f[HYCO_MAX_CELL_DOFS], load[HYCO_MAX_CELL_DOFS] = {0}, *g = s->g + (size_t)e * (size_t)l;

    for (PetscInt j = 0; j < l; j++) g[j] = 0;
    if (near && near[e]) continue;
    PetscCall(HycoFEStateForce(s->fe, s->begin, e, f));
    PetscCall(HycoFEBodyForce(s->fe, e, load));
    for (PetscInt k = 0; k < n; k++)
      AddForce(s, m->cells[e * m->nv + k / m->dim] * m->dim + k % m->dim, f[k] - load[k], g);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The l columns of listed time `step`. Collective. */
static PetscErrorCode Record(Sampler *s, PetscInt step, Mat J)
{
  const PetscInt l = s->t->l;
  PetscScalar *a;
  PetscInt lda;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(s->t), Project(s));
  PetscCall(HycoFOMToRows(s->t->fom, HYCO_ON_CELLS, MPIU_REAL, l, s->g, s->rows));
  PetscCall(MatDenseGetLDA(J, &lda));
  PetscCall(MatDenseGetArray(J, &a));
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < s->n_rows; i++)
      a[(size_t)(step * l + j) * (size_t)lda + (size_t)i] = s->rows[(size_t)i * (size_t)l + (size_t)j];
  }
  PetscCall(MatDenseRestoreArray(J, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Training point k, the laws stepping at the n times taken[]. Collective. */
static PetscErrorCode Follow(Sampler *s, PetscInt k, PetscInt n, const PetscReal taken[], Mat J)
{
  HycoReducer t = s->t;
  const HycoScene scene = t->scene;
  PetscReal all[HYCO_MAX_PARAMETERS];
  const PetscReal *mu;
  PetscInt n_par, step = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  PetscCall(HycoFEStateDestroy(&s->begin));
  PetscCall(HycoFEStateDestroy(&s->end));
  for (PetscInt i = 0; i < n; i++) {
    HycoSceneSetTime(scene, mu + k * n_par, taken[i], all);
    PetscCall(HycoFOMSetParameters(t->fom, all));
    HycoOnEach(HycoComm(t), Step(s, k, taken[PetscMax(i - 1, 0)], taken[i]));
    if (!scene->n_times || (step < scene->n_times && taken[i] == scene->times[step])) PetscCall(Record(s, step++, J));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each listed time's columns divided by their size, small ones by the tenth of the largest that errors are divided by.
   Collective. */
static PetscErrorCode Balance(HycoReducer t, Mat J)
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
  PetscCall(PetscFree(norm));
  PetscCall(PetscFree(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The singular vectors of J in *W (NULL: none; the caller's), as many as the tolerance takes, and the singular values.
   Collective. */
static PetscErrorCode Decompose(HycoReducer t, Mat J, PetscReal tol, Mat *W, PetscInt *n, PetscReal **sigma)
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
  const PetscReal *mu;
  PetscReal *taken = NULL, *sigma;
  PetscInt n_par, n_taken = 1;
  PetscScalar *a;
  PetscInt lda;
  PetscErrorCode ierr;
  Mat J;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  if (t->scene->n_times)
    HycoOnEach(HycoComm(t), HycoSnapshotsReadTaken(store, mu + k * n_par, &n_taken, &taken));
  else
    PetscCall(PetscCalloc1(1, &taken));
  PetscCall(
      MatCreateDense(HycoComm(t), s->n_rows, PETSC_DECIDE, t->sizes[1], HycoSnapshotsSteps(t->scene) * t->l, NULL, &J));
  ierr = Follow(s, k, n_taken, taken, J);
  PetscCall(PetscFree(taken));
  if (!ierr) ierr = Balance(t, J);
  if (!ierr) ierr = Decompose(t, J, tol, W, n, &sigma);
  PetscCall(MatDestroy(&J));
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

/* All points' vectors side by side. Collective. */
static PetscErrorCode Join(Sampler *s, HycoSnapshots store, PetscReal tol, Mat *joined)
{
  HycoReducer t = s->t;
  PetscInt points, all = 0, at = 0, *n;
  Mat *W;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &points, NULL, NULL));
  PetscCall(PetscCalloc2(points, &W, points, &n));
  for (PetscInt k = 0; k < points; k++) {
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
  PetscCall(MatAssemblyBegin(*joined, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*joined, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscFree2(W, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCubatureSample(HycoReducer t, HycoSnapshots store, PetscReal tol, Mat *W, PetscInt *n,
                                  PetscReal **sigma)
{
  Sampler s;
  Mat J = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(Create(t, &s));
  ierr = Join(&s, store, SHARE * tol, &J);
  PetscCall(Destroy(&s));
  if (!ierr) ierr = Decompose(t, J, SHARE * tol, W, n, sigma);
  PetscCall(MatDestroy(&J));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
