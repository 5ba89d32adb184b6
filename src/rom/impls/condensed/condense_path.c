/*
  Training of the condensed model of paths (hycocondensedpath.h). A replay of the training paths gives, at each listed
  time, the inelastic forces of all cells, the forces of heat, supports and body forces on each, and the loads of all
  nodes. POD gives modes of each; one factor of K gives the responses to those of inelastic forces and loads, and to
  each contact; an orthonormal basis of all responses is V. Q-DEIM on the modes of the cells' forces chooses the cells.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>

enum { INELASTIC, INSIDE, LOADS, N_SAMPLED }; /* by cell; by cell; by node */

/* Data of a replay. */
typedef struct {
  HycoReducer t;
  HycoTrainingReplay replay;
  HycoFE fe;         /* this rank's part */
  PetscInt *flowing; /* by cell: its index among the inelastic ones, or -1 */
  PetscReal *Ke;     /* of these cells, nv dim square */
  PetscReal *value[N_SAMPLED];
  Mat S[N_SAMPLED]; /* for a path, a column for each listed time; rows in the file's order */
  Mat U;            /* displacements minus their lifting */
} Sampler;

/* -- unsupported scenes -- */

/* Refuses a load or support that is neither a sum over cells nor one over facets. */
static PetscErrorCode CheckLoads(HycoScene s)
{
  PetscBool oblique = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_fixed; k++) oblique = (PetscBool)(oblique || s->fixed[k].normal);
  HycoCheckModel(!s->n_springs && !s->n_point_loads && !s->n_ties && !oblique,
                 "the scene has %s, which a condensed model of paths does not support; train a hybrid model",
                 s->n_springs       ? "springs"
                 : s->n_point_loads ? "forces on points"
                 : s->n_ties        ? "ties"
                                    : "a support along a direction");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPathBegin(HycoReducer t)
{
  const HycoScene s = t->scene;

  PetscFunctionBegin;
  HycoCheckModel(t->sizes[3] > 1,
                 "-hyco_model_type condensed with a history is for 2D and 3D; in 1D use hybrid or projection");
  PetscCall(HycoCondensedCheckContacts(t));
  PetscCall(HycoCondensedCheckSupports(t));
  PetscCall(CheckLoads(s));
  for (PetscInt p = 0; p < s->n_variables; p++) {
    PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
    HycoChanges c;

    changed[p] = (PetscBool)(p >= s->n_parameters || s->hi[p] > s->lo[p]);
    c = HycoSceneChanges(s, changed);
    HycoCheckModel(!c.stiffness && !c.rows,
                   "%s affects %s, and a condensed model of paths has one stiffness and one set of contacts for all "
                   "paths; use -hyco_model_type hybrid or cubature",
                   s->parameter[p], c.stiffness ? "the stiffness" : "the contacts' directions");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode End(Mat A)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- samples -- */

static PetscErrorCode DestroySampler(Sampler *s)
{
  PetscFunctionBegin;
  PetscCall(HycoTrainingReplayDestroy(&s->replay));
  HycoFreeAll(&s->flowing, &s->Ke, &s->value[0], &s->value[1], &s->value[2]);
  for (PetscInt k = 0; k < N_SAMPLED; k++) PetscCall(MatDestroy(&s->S[k]));
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

/* Computes the forces of all cells of the part at the replay's time, and the loads of its nodes. */
static PetscErrorCode Measure(Sampler *s)
{
  HycoFE fe = s->fe;
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;

  PetscFunctionBegin;
  PetscCall(HycoFELoads(fe, s->value[LOADS]));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal heat[HYCO_MAX_CELL_DOFS], body[HYCO_MAX_CELL_DOFS] = {0};
    PetscReal *q = s->value[INELASTIC] + e * n, *inside = s->value[INSIDE] + e * n;

    PetscCall(HycoCondensedCellLoad(fe, e, inside, heat));
    PetscCall(HycoFEBodyForce(fe, e, body));
    for (PetscInt i = 0; i < n; i++) {
      s->value[LOADS][m->cells[e * m->nv + i / m->dim] * m->dim + i % m->dim] -= inside[i];
      inside[i] -= body[i];
    }
    if (s->flowing[e] >= 0)
      PetscCall(HycoCondensedCellForce(fe, e, s->Ke + (size_t)s->flowing[e] * (size_t)(n * n), heat, s->replay.u,
                                       s->replay.march.state, q, NULL));
  }
  for (PetscInt k = 0; k < fe->n_dof; k++) s->value[LOADS][k] = fe->fixed[k] ? 0 : s->value[LOADS][k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the column of a listed time. Collective. */
static PetscErrorCode Record(void *ctx, PetscInt k)
{
  Sampler *s = (Sampler *)ctx;
  const PetscInt n = s->fe->mesh->nv * s->fe->dim, step = k % HycoSnapshotsSteps(s->t->scene);

  PetscFunctionBegin;
  HycoOnEach(HycoComm(s->t), Measure(s));
  for (PetscInt field = 0; field < N_SAMPLED; field++) {
    const PetscBool on_nodes = (PetscBool)(field == LOADS);
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

/* Computes the elastic stiffness of the inelastic cells. */
static PetscErrorCode FindFlowing(Sampler *s)
{
  const PetscInt n_cells = s->fe->mesh->n_cells, n = s->fe->mesh->nv * s->fe->dim;
  PetscInt count = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_cells + 1, &s->flowing));
  for (PetscInt e = 0; e < n_cells; e++) s->flowing[e] = HycoCondensedFlows(s->fe, e) ? count++ : -1;
  PetscCall(PetscMalloc1((size_t)count * (size_t)(n * n) + 1, &s->Ke));
  for (PetscInt e = 0; e < n_cells; e++) {
    if (s->flowing[e] >= 0) PetscCall(HycoFEBodyStiffness(s->fe, e, s->Ke + (size_t)s->flowing[e] * (size_t)(n * n)));
  }
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
  for (PetscInt k = 0; k < N_SAMPLED; k++) {
    const PetscBool on_nodes = (PetscBool)(k == LOADS);
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
    for (PetscInt f = 0; f < N_SAMPLED; f++) {
      PetscCall(End(s->S[f]));
      PetscCall(HycoPathModesAdd(s->t, s->S[f], tol[f], &modes[f]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the modes of all sampled quantities, path by path. Collective. */
static PetscErrorCode Sample(HycoReducer t, HycoSnapshots store, HycoBasis basis[N_SAMPLED])
{
  const PetscReal tol[N_SAMPLED] = {Condensing(t)->path.tol, 0, 0};
  HycoPathModes modes[N_SAMPLED] = {{0}};
  PetscInt N[N_SAMPLED], n_rows[N_SAMPLED];
  PetscErrorCode ierr;
  Sampler s;

  PetscFunctionBegin;
  PetscCall(CreateSampler(t, store, &s));
  for (PetscInt f = 0; f < N_SAMPLED; f++) {
    PetscCall(MatGetSize(s.S[f], &N[f], NULL));
    PetscCall(MatGetLocalSize(s.S[f], &n_rows[f], NULL));
  }
  ierr = FollowAll(&s, store, tol, modes);
  PetscCall(DestroySampler(&s));
  for (PetscInt f = 0; f < N_SAMPLED; f++) {
    if (!ierr) ierr = HycoPathModesJoin(t, &modes[f], N[f], n_rows[f], tol[f], 0, &basis[f]);
    PetscCall(HycoPathModesDestroy(&modes[f]));
  }
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- responses -- */

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

/* Sums a mode of cells' forces, at the part's cells, at its nodes; a mode of nodes is unchanged. */
static PetscErrorCode PutModes(HycoReducer t, const HycoBasis *modes, HycoPlace place, Mat A, PetscInt first)
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

/* Sets B^T, a column for each contact. Rank 0. */
static PetscErrorCode PutContacts(HycoReducer t, Mat A, PetscInt first)
{
  HycoMesh surface = t->fom->surface;
  const PetscInt dim = surface->dim;
  HycoRows rows;

  PetscFunctionBegin;
  PetscCall(HycoRowsCreate(&t->fom->pairs, dim, &rows));
  PetscCall(HycoContactRows(t->fom->fe_surface, &t->fom->pairs, rows.start, rows.dof, rows.value, rows.gap));
  for (PetscInt k = 0; k < t->fom->pairs.n; k++) {
    for (PetscInt j = rows.start[k]; j < rows.start[k + 1]; j++) {
      const PetscInt node = rows.dof[j] / dim, global = surface->node_global ? surface->node_global[node] : node;

      PetscCall(MatSetValue(A, global * dim + rows.dof[j] % dim, first + k, rows.value[j], ADD_VALUES));
    }
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateColumns(HycoReducer t, PetscInt n, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(MatCreateDense(HycoComm(t), t->fom->part->n_owned * t->sizes[3], PETSC_DECIDE, t->sizes[0] * t->sizes[3], n,
                           NULL, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces l, sigma, V and VtU: a basis of the responses. Collective. */
static PetscErrorCode TakeAnswers(HycoReducer t, HycoSnapshots store, Mat K, const HycoBasis modes[N_SAMPLED])
{
  const PetscInt n[3] = {modes[INELASTIC].l, modes[LOADS].l, t->sizes[2]}, all = n[0] + n[1] + n[2];
  Mat R, X, S;

  PetscFunctionBegin;
  PetscCall(CreateColumns(t, all, &R));
  PetscCall(PutModes(t, &modes[INELASTIC], HYCO_ON_CELLS, R, 0));
  PetscCall(PutModes(t, &modes[LOADS], HYCO_ON_NODES, R, n[0]));
  HycoOnRoot(HycoComm(t), PutContacts(t, R, n[0] + n[1]));
  PetscCall(End(R));
  PetscCall(HycoSolveColumns(K, "the stiffness", R, &X));
  PetscCall(MatDestroy(&R));
  PetscCall(HycoReducerUnitRows(t, X, &S));
  PetscCall(MatDestroy(&X));
  PetscCall(End(S));
  HycoFreeAll(&t->sigma, &t->VtU);
  PetscCall(MatDestroy(&t->V));
  PetscCall(PetscCalloc1(PetscMax(all, t->n_s) + 1, &t->sigma));
  PetscCall(HycoReducerPOD(t, S, 0, 0, &t->V, &t->l, t->sigma));
  PetscCall(MatDestroy(&S));
  HycoCheckModel(t->l, "no load and no contact force moves the bodies, so that there are no modes; check the loads");
  PetscCall(HycoReducerGetDisplacements(t, store, &S));
  PetscCall(PetscMalloc1((size_t)t->l * (size_t)t->n_s, &t->VtU));
  PetscCall(HycoReducerMultiply(t, t->V, S, t->VtU));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- tables -- */

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

/* The cells of a basis' Q-DEIM points, then of those of its rows in the remaining cells, and so on: `rounds` times a
   cell for each mode, up to the rank. cell[]: room for them. Collective. */
static PetscErrorCode ChooseFor(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count, PetscInt cell[])
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

/* Chooses the model's cells, ascending: all, or those of the modes. Collective. */
static PetscErrorCode ChooseCells(HycoReducer t, const HycoBasis modes[N_SAMPLED])
{
  const PetscInt n = t->fom->part->nv * t->sizes[3], each = Condensing(t)->path.cells;
  PetscInt *cell, count = 0, more;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->sizes[1] + each * modes[INELASTIC].l + modes[INSIDE].l + 1, &cell));
  for (PetscInt e = 0; e < t->sizes[1] && !each; e++) cell[count++] = e;
  PetscCall(ChooseFor(&modes[INELASTIC], n, each, &more, cell + count));
  count += more;
  PetscCall(ChooseFor(&modes[INSIDE], n, PetscMin(each, 1), &more, cell + count));
  count += more;
  if (!count) cell[count++] = 0; /* no inelastic cell and no load inside: a mesh needs a cell */
  PetscCall(PetscSortRemoveDupsInt(&count, cell));
  PetscCall(PetscFree(t->seeds_cell));
  t->seeds_cell = cell;
  t->n_seeds_cell = count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table without modes: the rows of V at the nodes of each cell. Collective. */
static PetscErrorCode TabulateAll(HycoReducer t, PetscReal **table)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = part->dim, n = part->nv * dim, l = t->l, columns = t->sizes[1] * n;
  const PetscScalar *v;
  PetscReal *node;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)l * (size_t)columns + 1, table));
  PetscCall(PetscMalloc1(part->n_nodes * dim + 1, &node));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_NODES, dim, v + (size_t)j * (size_t)lda, node));
    for (PetscInt k = 0; k < part->n_cells * n; k++) {
      const PetscInt cell = part->cell_whole ? part->cell_whole[k / n] : k / n;

      if (HycoMeshOwned(part, part->cells[k / n * part->nv]) < 0) continue;
      (*table)[(size_t)(cell * n + k % n) * (size_t)l + (size_t)j] = node[part->cells[k / dim] * dim + k % dim];
    }
  }
  PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  PetscCall(PetscFree(node));
  HycoAllreduce(*table, l * columns, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V^T of the nodal sums of the modes of cells' forces, times the pseudo-inverse of the modes in the chosen cells: l
   x columns. `smallest`: the modes' smallest singular value there. Collective. */
static PetscErrorCode Tabulate(HycoReducer t, const HycoBasis *modes, Mat V, PetscReal **table, PetscReal *smallest)
{
  const PetscInt n = t->fom->part->nv * t->sizes[3], columns = t->n_seeds_cell * n, q = modes->l, l = t->l;
  PetscReal *there, *there_t, *P, *product, largest;
  PetscInt *row;
  Mat A;

  PetscFunctionBegin;
  *smallest = 1;
  if (!Condensing(t)->path.cells) {
    PetscCall(TabulateAll(t, table));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1((size_t)l * (size_t)columns + 1, table));
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CreateColumns(t, q, &A));
  PetscCall(PutModes(t, modes, HYCO_ON_CELLS, A, 0));
  PetscCall(End(A));
  PetscCall(PetscMalloc5(columns, &row, columns * q, &there, columns * q, &there_t, columns * q, &P, l * q, &product));
  PetscCall(HycoReducerMultiply(t, V, A, product));
  PetscCall(MatDestroy(&A));
  for (PetscInt i = 0; i < columns; i++) row[i] = t->seeds_cell[i / n] * n + i % n;
  PetscCall(HycoGatherRows(modes->V, columns, row, there_t));
  for (PetscInt i = 0; i < columns; i++) {
    for (PetscInt j = 0; j < q; j++) there[j * columns + i] = there_t[i * q + j];
  }
  PetscCall(HycoPseudoInverse(columns, q, there, 0, P)); /* q x columns */
  PetscCall(HycoExtremeSingularValues(columns, q, there, smallest, &largest));
  for (PetscInt i = 0; i < columns; i++) {
    for (PetscInt k = 0; k < q; k++) {
      for (PetscInt j = 0; j < l; j++) (*table)[(size_t)i * (size_t)l + (size_t)j] += product[k * l + j] * P[i * q + k];
    }
  }
  PetscCall(PetscFree5(row, there, there_t, P, product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes V^T K V and the cells' tables. Collective. */
static PetscErrorCode FillTable(HycoReducer t, Mat K, const HycoBasis modes[N_SAMPLED])
{
  HycoCondensedTable *c = &Condensing(t)->path.table;
  const HycoBasis V = {.V = t->V, .l = t->l};
  const PetscInt l = t->l;
  PetscReal smallest[2];
  Mat D, KD;

  PetscFunctionBegin;
  PetscCall(HycoCondensedTableFree(c));
  PetscCall(CreateColumns(t, l, &D));
  PetscCall(PutModes(t, &V, HYCO_ON_NODES, D, 0));
  PetscCall(End(D));
  PetscCall(MatMatMult(K, D, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &KD));
  PetscCall(PetscMalloc1((size_t)l * (size_t)l, &c->K));
  PetscCall(HycoReducerMultiply(t, D, KD, c->K));
  PetscCall(MatDestroy(&KD));
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < j; i++) c->K[i * l + j] = c->K[j * l + i] = (c->K[i * l + j] + c->K[j * l + i]) / 2;
  }
  PetscCall(Tabulate(t, &modes[INELASTIC], D, &c->inelastic, &smallest[0]));
  PetscCall(Tabulate(t, &modes[INSIDE], D, &c->loads, &smallest[1]));
  c->n_inelastic = modes[INELASTIC].l;
  c->n_loads = modes[INSIDE].l;
  c->amplification = 1 / smallest[0];
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole training, with one factor. Collective. */
static PetscErrorCode Condense(HycoReducer t, HycoSnapshots store, const HycoBasis modes[N_SAMPLED])
{
  HycoFOM f = t->fom;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  Mat K;

  PetscFunctionBegin;
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(t), f->part->n_owned, f->part->first, &K));
  HycoOnEach(HycoComm(t), HycoFEAssembleStiffness(f->fe, K));
  PetscCall(TakeAnswers(t, store, K, modes));
  PetscCall(ChooseCells(t, modes));
  PetscCall(FillTable(t, K, modes));
  PetscCall(MatDestroy(&K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPathModes(HycoReducer t, HycoSnapshots store)
{
  HycoBasis modes[N_SAMPLED] = {{NULL}};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = Sample(t, store, modes);
  if (!ierr) ierr = Condense(t, store, modes);
  for (PetscInt k = 0; k < N_SAMPLED; k++) {
    PetscCall(MatDestroy(&modes[k].V));
    PetscCall(PetscFree(modes[k].sigma));
  }
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
