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

#define ROUNDING 256 /* units of round-off in sums of a cell's forces */

/* Data of a replay. */
typedef struct {
  HycoReducer t;
  PetscInt n_fields;
  HycoTrainingReplay replay;
  HycoFE fe;         /* this rank's part */
  PetscInt *flowing; /* by cell: its index among the inelastic ones, or -1 */
  PetscReal *Ke;     /* of these cells, nv dim square */
  PetscReal *value[HYCO_N_SAMPLED];
  Mat S[HYCO_N_SAMPLED]; /* for a path, a column for each listed time; rows in the file's order */
  Mat U;                 /* displacements minus their lifting */
} Sampler;

static PetscErrorCode End(Mat A)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- a cell's forces -- */

PetscErrorCode HycoInelasticCellLoad(HycoFE fe, PetscInt e, PetscReal load[], PetscReal heat[])
{
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], push[HYCO_MAX_CELL_DOFS] = {0}, u0[HYCO_MAX_CELL_DOFS];
  PetscBool lifted = PETSC_FALSE;

  PetscFunctionBegin;
  if (fe->scene->body[m->cell_body[e]].expansion) PetscCall(HycoCellHeat(fe, e, push));
  for (PetscInt k = 0; k < n; k++) {
    u0[k] = fe->u0[HycoCellUnknown(m, e, k)];
    lifted = (PetscBool)(lifted || u0[k] != 0);
    load[k] = -push[k];
    if (heat) heat[k] = push[k];
  }
  if (!lifted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEBodyStiffness(fe, e, Ke));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < n; j++) load[i] += Ke[i * n + j] * u0[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticCellForce(HycoFE fe, PetscInt e, const PetscReal Ke[], const PetscReal heat[],
                                      const PetscReal u[], HycoFEState state, PetscReal q[], PetscReal *summands)
{
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscReal f[HYCO_MAX_CELL_DOFS], most = 0, size = 0;

  PetscFunctionBegin;
  PetscCall(HycoFEStateForce(fe, state, e, f));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal sum = PetscAbsReal(heat[i]);

    q[i] = -heat[i] - f[i];
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal part = Ke[i * n + j] * u[HycoCellUnknown(m, e, j)];

      q[i] += part;
      sum += PetscAbsReal(part);
    }
    most = PetscMax(most, PetscAbsReal(q[i]));
    size = PetscMax(size, sum);
  }
  if (most <= ROUNDING * PETSC_MACHINE_EPSILON * size) PetscCall(PetscArrayzero(q, n));
  if (summands) *summands = size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- samples -- */

static PetscErrorCode DestroySampler(Sampler *s)
{
  PetscFunctionBegin;
  PetscCall(HycoTrainingReplayDestroy(&s->replay));
  HycoFreeAll(&s->flowing, &s->Ke, &s->value[0], &s->value[1], &s->value[2]);
  for (PetscInt k = 0; k < s->n_fields; k++) PetscCall(MatDestroy(&s->S[k]));
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

/* The load inside cell e, and its part of the loads of the nodes. */
static PetscErrorCode MeasureLoads(Sampler *s, PetscInt e, PetscReal inside[])
{
  HycoMesh m = s->fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscReal body[HYCO_MAX_CELL_DOFS] = {0};

  PetscFunctionBegin;
  PetscCall(HycoFEBodyForce(s->fe, e, body));
  for (PetscInt i = 0; i < n; i++) {
    s->value[HYCO_SAMPLED_LOADS][HycoCellUnknown(m, e, i)] -= inside[i];
    s->value[HYCO_SAMPLED_INSIDE][e * n + i] = inside[i] - body[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the forces of all cells of the part at the replay's time, and the loads of its nodes. */
static PetscErrorCode Measure(Sampler *s)
{
  HycoFE fe = s->fe;
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  const PetscBool loads = (PetscBool)(s->n_fields > HYCO_SAMPLED_LOADS);

  PetscFunctionBegin;
  if (loads) PetscCall(HycoFELoads(fe, s->value[HYCO_SAMPLED_LOADS]));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal heat[HYCO_MAX_CELL_DOFS], inside[HYCO_MAX_CELL_DOFS];

    if (!loads && s->flowing[e] < 0) continue;
    PetscCall(HycoInelasticCellLoad(fe, e, inside, heat));
    if (loads) PetscCall(MeasureLoads(s, e, inside));
    if (s->flowing[e] >= 0)
      PetscCall(HycoInelasticCellForce(fe, e, s->Ke + (size_t)s->flowing[e] * (size_t)(n * n), heat, s->replay.u,
                                       s->replay.march.state, s->value[HYCO_SAMPLED_INELASTIC] + e * n, NULL));
  }
  for (PetscInt k = 0; k < fe->n_dof && loads; k++) {
    if (fe->fixed[k]) s->value[HYCO_SAMPLED_LOADS][k] = 0;
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

  PetscFunctionBegin;
  if (step == 0) HycoOnEach(HycoComm(s->t), Stiffen(s));
  HycoOnEach(HycoComm(s->t), Measure(s));
  for (PetscInt field = 0; field < s->n_fields; field++) {
    const PetscBool on_nodes = (PetscBool)(field == HYCO_SAMPLED_LOADS);
    PetscScalar *a;
    PetscInt lda;

    PetscCall(MatDenseGetLDA(s->S[field], &lda));
    PetscCall(MatDenseGetArray(s->S[field], &a));
    PetscCall(HycoFOMToRows(s->t->fom, on_nodes ? HYCO_ON_NODES : HYCO_ON_CELLS, MPIU_REAL, on_nodes ? s->fe->dim : n,
                            s->value[field], a + (size_t)step * (size_t)lda));
    PetscCall(MatDenseRestoreArray(s->S[field], &a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSampler(HycoReducer t, HycoSnapshots store, PetscInt n_fields, Sampler *s)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = t->sizes[3], n = part->nv * dim;
  const HycoFileOrder *order;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *s = (Sampler){.t = t, .n_fields = n_fields, .fe = t->fom->fe};
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  PetscCall(HycoReducerGetDisplacements(t, store, &s->U));
  HycoOnEach(HycoComm(t), FindFlowing(s));
  PetscCall(HycoFOMGetRows(t->fom, &order));
  for (PetscInt k = 0; k < n_fields; k++) {
    const PetscBool on_nodes = (PetscBool)(k == HYCO_SAMPLED_LOADS);
    const PetscInt rows = on_nodes ? (order ? order->n[HYCO_ON_NODES] : part->n_nodes) * dim
                                   : (order ? order->n[HYCO_ON_CELLS] : part->n_cells) * n;

    PetscCall(PetscCalloc1((on_nodes ? part->n_nodes * dim : part->n_cells * n) + 1, &s->value[k]));
    PetscCall(MatCreateDense(HycoComm(t), rows, PETSC_DECIDE, on_nodes ? t->sizes[0] * dim : t->sizes[1] * n,
                             HycoSnapshotsSteps(t->scene), NULL, &s->S[k]));
  }
  PetscCall(HycoTrainingReplayCreate(t, Displacement, Record, s, &s->replay));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FollowAll(Sampler *s, HycoSnapshots store, const PetscReal tol[], HycoPathModes modes[])
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->samples, &n, NULL, NULL));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoTrainingReplayFollow(&s->replay, store, k));
    for (PetscInt f = 0; f < s->n_fields; f++) {
      PetscCall(End(s->S[f]));
      PetscCall(HycoPathModesAdd(s->t, s->S[f], tol[f], &modes[f]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticSample(HycoReducer t, HycoSnapshots store, PetscReal energy, PetscInt n_fields,
                                   HycoBasis *basis)
{
  const PetscReal tol[HYCO_N_SAMPLED] = {energy, 0, 0};
  HycoPathModes modes[HYCO_N_SAMPLED] = {{0}};
  PetscInt N[HYCO_N_SAMPLED], n_rows[HYCO_N_SAMPLED];
  PetscErrorCode ierr;
  Sampler s;

  PetscFunctionBegin;
  PetscCall(CreateSampler(t, store, n_fields, &s));
  for (PetscInt f = 0; f < n_fields; f++) {
    PetscCall(MatGetSize(s.S[f], &N[f], NULL));
    PetscCall(MatGetLocalSize(s.S[f], &n_rows[f], NULL));
  }
  ierr = FollowAll(&s, store, tol, modes);
  PetscCall(DestroySampler(&s));
  for (PetscInt f = 0; f < n_fields; f++) {
    if (!ierr) ierr = HycoPathModesJoin(t, &modes[f], N[f], n_rows[f], tol[f], 0, &basis[f]);
    PetscCall(HycoPathModesDestroy(&modes[f]));
  }
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

PetscErrorCode HycoInelasticPut(HycoReducer t, const HycoBasis *modes, HycoPlace place, Mat A, PetscInt first)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = part->dim, n = place == HYCO_ON_CELLS ? part->nv * dim : dim;
  const PetscScalar *rows;
  PetscReal *value, *node;
  PetscInt lda;

  PetscFunctionBegin;
  if (!modes->l) PetscFunctionReturn(PETSC_SUCCESS); /* V may be NULL */
  PetscCall(PetscMalloc2(PetscMax(part->n_cells * part->nv, part->n_nodes) * dim, &value, part->n_nodes * dim, &node));
  PetscCall(MatDenseGetLDA(modes->V, &lda));
  for (PetscInt j = 0; j < modes->l; j++) {
    PetscCall(MatDenseGetArrayRead(modes->V, &rows));
    PetscCall(HycoFOMFromRows(t->fom, place, n, rows + (size_t)j * (size_t)lda, value));
    PetscCall(MatDenseRestoreArrayRead(modes->V, &rows));
    PetscCall(PetscArrayzero(node, part->n_nodes * dim));
    for (PetscInt k = 0; k < part->n_cells * n && place == HYCO_ON_CELLS; k++)
      node[part->cells[k / dim] * dim + k % dim] += value[k];
    PetscCall(PutColumn(t, place == HYCO_ON_CELLS ? node : value, A, first + j));
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
