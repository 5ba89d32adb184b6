/*
  Modes of what is inelastic. While K stays along a path, displacements are linear in loads, contact forces and the
  nodal forces of the inelastic strains,

      q_e = integral over cell e of B^T C eps_in,

  which fill few modes. A replay of the training paths gives q of all cells at the listed times; POD of each path, then
  of all, gives the modes, and Q-DEIM the cells in which a model evaluates the laws.
*/
#include <hycoalgorithms.h>
#include <hycoinelasticmodes.h>
#include <hycokinematics.h>

/* Data of a replay. */
typedef struct {
  HycoReducer t;
  HycoTrainingReplay replay;
  HycoFE fe;         /* this rank's part */
  PetscInt *flowing; /* by cell: its index among the inelastic ones, or -1 */
  PetscReal *Ke;     /* of these cells, nv dim square */
  PetscReal *value;
  Mat S; /* for a path, a column for each listed time; rows in the file's order */
  Mat U; /* displacements minus their lifting */
} Sampler;

/* -- samples -- */

static PetscErrorCode DestroySampler(Sampler *s)
{
  PetscFunctionBegin;
  PetscCall(HycoTrainingReplayDestroy(&s->replay));
  HycoFreeAll(&s->flowing, &s->Ke, &s->value);
  PetscCall(MatDestroy(&s->S));
  PetscCall(MatDestroy(&s->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of column k of the snapshots. Collective. */
static PetscErrorCode Displacement(void *ctx, PetscInt k, PetscReal u[])
{
  Sampler *s = (Sampler *)ctx;
  const PetscScalar *columns;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(s->U, &lda));
  PetscCall(MatDenseGetArrayRead(s->U, &columns));
  PetscCall(HycoFOMFromRows(s->t->fom, HYCO_ON_NODES, s->fe->dim, columns + (size_t)k * (size_t)lda, u));
  PetscCall(MatDenseRestoreArrayRead(s->U, &columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the forces of all cells of the part at the replay's time. */
static PetscErrorCode Measure(Sampler *s)
{
  HycoFE fe = s->fe;
  const PetscInt n = fe->mesh->nv * fe->mesh->dim;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscReal heat[HYCO_MAX_CELL_DOFS];

    if (s->flowing[e] < 0) continue;
    PetscCall(HycoInelasticCellHeat(fe, e, heat));
    PetscCall(HycoInelasticCellForce(fe, e, s->Ke + (size_t)s->flowing[e] * (size_t)(n * n), heat, s->replay.u,
                                     s->replay.march.state, s->value + e * n, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the inelastic cells. */
static PetscErrorCode FindFlowing(Sampler *s)
{
  const PetscInt n_cells = s->fe->mesh->n_cells, n = s->fe->mesh->nv * s->fe->dim;
  PetscInt count = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_cells + 1, &s->flowing));
  for (PetscInt e = 0; e < n_cells; e++) s->flowing[e] = HycoInelasticFlows(s->fe, e) ? count++ : -1;
  PetscCall(PetscMalloc1((size_t)count * (size_t)(n * n) + 1, &s->Ke));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Their elastic stiffness, which does not change along a path. */
static PetscErrorCode Stiffen(Sampler *s)
{
  const PetscInt n_cells = s->fe->mesh->n_cells, n = s->fe->mesh->nv * s->fe->dim;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < n_cells; e++) {
    if (s->flowing[e] >= 0) PetscCall(HycoFEBodyStiffness(s->fe, e, s->Ke + (size_t)s->flowing[e] * (size_t)(n * n)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the column of a listed time. Collective. */
static PetscErrorCode Record(void *ctx, PetscInt k)
{
  Sampler *s = (Sampler *)ctx;
  const PetscInt n = s->fe->mesh->nv * s->fe->dim, step = k % HycoSnapshotsSteps(s->t->scene);
  PetscScalar *a;
  PetscInt lda;

  PetscFunctionBegin;
  if (step == 0) HycoOnEach(HycoComm(s->t), Stiffen(s));
  HycoOnEach(HycoComm(s->t), Measure(s));
  PetscCall(MatDenseGetLDA(s->S, &lda));
  PetscCall(MatDenseGetArray(s->S, &a));
  PetscCall(HycoFOMToRows(s->t->fom, HYCO_ON_CELLS, MPIU_REAL, n, s->value, a + (size_t)step * (size_t)lda));
  PetscCall(MatDenseRestoreArray(s->S, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSampler(HycoReducer t, HycoSnapshots store, Sampler *s)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = t->sizes[3], n = part->nv * dim;
  const HycoFileOrder *order;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *s = (Sampler){.t = t, .fe = t->fom->fe};
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  PetscCall(HycoReducerGetDisplacements(t, store, &s->U));
  HycoOnEach(HycoComm(t), FindFlowing(s));
  PetscCall(HycoFOMGetRows(t->fom, &order));
  PetscCall(PetscCalloc1(part->n_cells * n + 1, &s->value));
  PetscCall(MatCreateDense(HycoComm(t), (order ? order->n[HYCO_ON_CELLS] : part->n_cells) * n, PETSC_DECIDE,
                           t->sizes[1] * n, HycoSnapshotsSteps(t->scene), NULL, &s->S));
  PetscCall(HycoTrainingReplayCreate(t, Displacement, Record, s, &s->replay));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FollowAll(Sampler *s, HycoSnapshots store, PetscReal tol, HycoPathModes *modes)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->samples, &n, NULL, NULL));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoTrainingReplayFollow(&s->replay, store, k));
    PetscCall(MatAssemblyBegin(s->S, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(s->S, MAT_FINAL_ASSEMBLY));
    PetscCall(HycoPathModesAdd(s->t, s->S, tol, modes));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticSample(HycoReducer t, HycoSnapshots store, PetscReal tol, HycoBasis *basis)
{
  HycoPathModes modes = {0};
  PetscInt N, n_rows;
  PetscErrorCode ierr;
  Sampler s;

  PetscFunctionBegin;
  PetscCall(CreateSampler(t, store, &s));
  PetscCall(MatGetSize(s.S, &N, NULL));
  PetscCall(MatGetLocalSize(s.S, &n_rows, NULL));
  ierr = FollowAll(&s, store, tol, &modes);
  PetscCall(DestroySampler(&s));
  if (!ierr) ierr = HycoPathModesJoin(t, &modes, N, n_rows, tol, 0, basis);
  PetscCall(HycoPathModesDestroy(&modes));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- columns of nodal forces -- */

PetscErrorCode HycoInelasticColumns(HycoReducer t, PetscInt n, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(MatCreateDense(HycoComm(t), t->fom->part->n_owned * t->sizes[3], PETSC_DECIDE, t->sizes[0] * t->sizes[3], n,
                           NULL, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets column j of A from values at the part's unknowns, rows in the distributed vectors' order. */
static PetscErrorCode PutColumn(HycoReducer t, const PetscReal value[], Mat A, PetscInt j)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = part->dim;
  PetscScalar *a;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(A, &lda));
  PetscCall(MatDenseGetArray(A, &a));
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt place = HycoMeshOwned(part, i);

    if (place >= 0) PetscCall(PetscArraycpy(a + (size_t)j * (size_t)lda + (size_t)(place * dim), value + i * dim, dim));
  }
  PetscCall(MatDenseRestoreArray(A, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticPut(HycoReducer t, const HycoBasis *modes, Mat A)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = part->dim, n = part->nv * dim;
  const PetscScalar *rows;
  PetscReal *value, *node;
  PetscInt lda;

  PetscFunctionBegin;
  if (!modes->l) PetscFunctionReturn(PETSC_SUCCESS); /* V may be NULL */
  PetscCall(PetscMalloc2(part->n_cells * n, &value, part->n_nodes * dim, &node));
  PetscCall(MatDenseGetLDA(modes->V, &lda));
  for (PetscInt j = 0; j < modes->l; j++) {
    PetscCall(MatDenseGetArrayRead(modes->V, &rows));
    PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_CELLS, n, rows + (size_t)j * (size_t)lda, value));
    PetscCall(MatDenseRestoreArrayRead(modes->V, &rows));
    PetscCall(PetscArrayzero(node, part->n_nodes * dim));
    for (PetscInt k = 0; k < part->n_cells * n; k++) node[part->cells[k / dim] * dim + k % dim] += value[k];
    PetscCall(PutColumn(t, node, A, j));
  }
  PetscCall(PetscFree2(value, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- cells -- */

/* Sets the rows of some cells to 0, n each. */
static PetscErrorCode ZeroCells(Mat V, PetscInt n, PetscInt n_cells, const PetscInt cell[])
{
  PetscInt lo, hi, l, lda;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatGetSize(V, NULL, &l));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArray(V, &v));
  for (PetscInt k = 0; k < n_cells * n; k++) {
    const PetscInt row = cell[k / n] * n + k % n;

    for (PetscInt j = 0; j < l && row >= lo && row < hi; j++) v[(size_t)j * (size_t)lda + (size_t)(row - lo)] = 0;
  }
  PetscCall(MatDenseRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticChoose(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count,
                                   PetscInt cell[])
{
  PetscInt found = 1;
  Mat rest;

  PetscFunctionBegin;
  *count = 0;
  if (!modes->l) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDuplicate(modes->V, MAT_COPY_VALUES, &rest));
  for (PetscInt k = 0; k < rounds && found; k++) {
    PetscInt *index = cell + *count;

    HycoLogged(HYCO_EVENT_DEIM, HycoQDEIMRank(rest, index, &found));
    for (PetscInt j = 0; j < found; j++) index[j] /= n;
    PetscCall(ZeroCells(rest, n, found, index));
    *count += found;
  }
  PetscCall(MatDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticInverse(HycoReducer t, const HycoBasis *modes, PetscReal P[], PetscReal there[],
                                    PetscReal *smallest)
{
  const PetscInt n = t->fom->part->nv * t->sizes[3], columns = t->n_seeds_cell * n, q = modes->l;
  PetscReal *rows, largest;
  PetscInt *row;

  PetscFunctionBegin;
  *smallest = 1;
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(columns, &row, columns * q, &rows));
  for (PetscInt i = 0; i < columns; i++) row[i] = t->seeds_cell[i / n] * n + i % n;
  PetscCall(HycoGatherRows(modes->V, columns, row, rows));
  for (PetscInt i = 0; i < columns * q; i++) there[i % q * columns + i / q] = rows[i];
  PetscCall(HycoPseudoInverse(columns, q, there, 0, P));
  PetscCall(HycoExtremeSingularValues(columns, q, there, smallest, &largest));
  PetscCall(PetscFree2(row, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
