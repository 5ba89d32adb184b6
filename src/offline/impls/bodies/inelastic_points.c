/*
  Modes of what is inelastic. While K stays along a path, displacements are linear in loads, contact forces and the
  nodal forces of what the stresses of inelastic bodies lack of the elastic ones,

      s = C (eps - eps_th) - sigma,

  at all integration points. A replay of the training paths gives s at the listed times; POD of each path, then of all,
  gives the modes, with the points' weights w in the norm: rows are sqrt(w) s, point after point.
*/
#include <hycoalgorithms.h>
#include <hycoinelasticpoints.h>
#include <hycokinematics.h>

/* Data of a replay. */
typedef struct {
  HycoReducer t;
  HycoTrainingReplay replay;
  HycoFE fe;                /* this rank's part */
  PetscReal *value, *scale; /* by point: sqrt(w) s; sqrt(w), 0 where the body is elastic */
  Mat S, U;                 /* of a path, a column for each listed time; displacements minus their lifting */
} Sampler;

/* The rows of a cell in the matrices of this file: n_sigma numbers for each integration point. */
PetscInt HycoPointRows(HycoReducer t)
{
  return HycoElementGet(t->fom->part->type)->nq * t->fom->fe->n_sigma;
}

/* The displacements of column k of the snapshots. Collective. The columns are in the file's order, the part's
   nodes with ghosts: rows travel between ranks. */
static PetscErrorCode InelasticPointsDisplacement(void *ctx, PetscInt k, PetscReal u[])
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

/* sqrt(w) of all points of inelastic bodies, which do not move along a path. */
static PetscErrorCode InelasticPointsWeigh(HycoFE fe, PetscReal scale[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  PetscReal g[HYCO_CELL_NODES][3], w;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    for (PetscInt q = 0; q < el->nq && HycoInelasticFlows(fe, e); q++) {
      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      /* Squares of scaled stresses sum to an integral, so that the POD's norm is L2 and not one that follows the
         mesh. */
      scale[e * el->nq + q] = PetscSqrtReal(w);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the column of a listed time. Collective. */
static PetscErrorCode InelasticPointsRecord(void *ctx, PetscInt k)
{
  Sampler *s = (Sampler *)ctx;
  const PetscInt nq = HycoElementGet(s->fe->mesh->type)->nq, ns = s->fe->n_sigma,
                 step = k % HycoSnapshotsSteps(s->t->scene);
  PetscScalar *a;
  PetscInt lda;

  PetscFunctionBegin;
  /* At the path's own parameters: bodies of other paths may be larger. */
  if (step == 0) HycoOnEach(HycoComm(s->t), InelasticPointsWeigh(s->fe, s->scale));
  for (PetscInt i = 0; i < s->fe->mesh->n_cells * nq; i++) {
    /* Points of elastic bodies stay 0: no mode has them, and Q-DEIM does not choose them. */
    if (!(s->scale[i] > 0)) continue;
    HycoFEInelasticStress(s->fe, s->replay.march.state, i / nq, i % nq, s->value + i * ns);
    for (PetscInt c = 0; c < ns; c++) s->value[i * ns + c] *= s->scale[i];
  }
  PetscCall(MatDenseGetLDA(s->S, &lda));
  PetscCall(MatDenseGetArray(s->S, &a));
  PetscCall(HycoFOMToRows(s->t->fom, HYCO_ON_CELLS, MPIU_REAL, nq * ns, s->value, a + (size_t)step * (size_t)lda));
  PetscCall(MatDenseRestoreArray(s->S, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part's fe must be at parameters before displacements can be read, since their lifting is subtracted. */
static PetscErrorCode CreateSampler(HycoReducer t, HycoSnapshots store, Sampler *s)
{
  HycoMesh part = t->fom->part;
  const PetscInt nq = HycoElementGet(part->type)->nq, size = HycoPointRows(t);
  const HycoFileOrder *order;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *s = (Sampler){.t = t, .fe = t->fom->fe};
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  /* All columns at once: steps of a path are replayed in order. */
  PetscCall(HycoReducerGetDisplacements(t, store, &s->U));
  PetscCall(HycoFOMGetRows(t->fom, &order));
  PetscCall(PetscCalloc1(part->n_cells * size + 1, &s->value));
  PetscCall(PetscCalloc1(part->n_cells * nq + 1, &s->scale));
  /* A column for each listed time of one path: paths are merged one by one. */
  PetscCall(MatCreateDense(HycoComm(t), (order ? order->n[HYCO_ON_CELLS] : part->n_cells) * size, PETSC_DECIDE,
                           t->sizes[1] * size, HycoSnapshotsSteps(t->scene), NULL, &s->S));
  PetscCall(HycoTrainingReplayCreate(t, InelasticPointsDisplacement, InelasticPointsRecord, s, &s->replay));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each path is replayed once with the laws, since snapshots keep displacements and no strains. */
static PetscErrorCode FollowAll(Sampler *s, HycoSnapshots store, PetscReal tol, HycoPathModes *modes)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->samples, &n, NULL, NULL));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoReducerTell(s->t, "inelastic strains of the paths", k, n));
    PetscCall(HycoTrainingReplayFollow(&s->replay, store, k));
    PetscCall(HycoMatAssemble(s->S));
    /* Each path is compressed before the next is replayed: memory does not grow with their number. */
    PetscCall(HycoPathModesAdd(s->t, s->S, tol, modes));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes of sqrt(w) s at all points: their Euclidean product is then the integral. */
PetscErrorCode HycoPointsSample(HycoReducer t, HycoSnapshots store, PetscReal tol, HycoBasis *basis)
{
  HycoPathModes modes = {0};
  PetscInt N, n_rows;
  PetscErrorCode ierr;
  Sampler s;

  PetscFunctionBegin;
  PetscCall(CreateSampler(t, store, &s));
  PetscCall(MatGetSize(s.S, &N, NULL));
  PetscCall(MatGetLocalSize(s.S, &n_rows, NULL));
  /* The sampler's matrices go before the join, which needs as much memory again. */
  ierr = FollowAll(&s, store, tol, &modes);
  PetscCall(HycoTrainingReplayDestroy(&s.replay));
  HycoFreeAll(&s.value, &s.scale);
  HycoDestroyAll(&s.S, &s.U);
  if (!ierr) ierr = HycoPathModesJoin(t, &modes, N, n_rows, tol, 0, basis);
  PetscCall(HycoPathModesDestroy(&modes));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- modes on the part -- */

/* From the file's rows to the part's cells. */
PetscErrorCode HycoPointsMode(HycoReducer t, const HycoBasis *modes, PetscInt k, PetscReal value[])
{
  const PetscScalar *rows;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(modes->V, &lda));
  PetscCall(MatDenseGetArrayRead(modes->V, &rows));
  PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_CELLS, HycoPointRows(t), rows + (size_t)k * (size_t)lda, value));
  PetscCall(MatDenseRestoreArrayRead(modes->V, &rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to force[], the nodal forces of a cell under stresses that are given at its points. */
PetscErrorCode HycoPointsCellForce(HycoFE fe, PetscInt e, const PetscReal value[], PetscReal force[])
{
  const PetscInt n = fe->mesh->nv * fe->dim, nq = HycoElementGet(fe->mesh->type)->nq, ns = fe->n_sigma;
  PetscReal B[6 * HYCO_MAX_CELL_DOFS], w;

  PetscFunctionBegin;
  for (PetscInt q = 0; q < nq; q++) {
    /* value = sqrt(w) s, and the force of s is w B^T s: the factor left is sqrt(w). */
    PetscCall(HycoFEPointRows(fe, e, q, B, &w));
    for (PetscInt d = 0; d < ns * n; d++) force[d % n] += PetscSqrtReal(w) * B[d] * value[q * ns + d / n];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of this rank's cells, ghosts included: nodes of its own have all of theirs. */
PetscErrorCode HycoPointsForces(HycoFE fe, const PetscReal value[], PetscReal force[])
{
  const PetscInt n = fe->mesh->nv * fe->dim, size = HycoElementGet(fe->mesh->type)->nq * fe->n_sigma;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscReal own[HYCO_MAX_CELL_DOFS] = {0};

    /* Elastic cells have no inelastic stress, whatever the modes' rows hold. */
    if (!HycoInelasticFlows(fe, e)) continue;
    PetscCall(HycoPointsCellForce(fe, e, value + e * size, own));
    for (PetscInt k = 0; k < n; k++) force[HycoCellUnknown(fe->mesh, e, k)] += own[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- points -- */

/* Sets the rows of some points to 0, n each. All components of a point leave together, since a law gives them
   together. */
static PetscErrorCode ZeroPoints(Mat V, PetscInt n, PetscInt count, const PetscInt point[])
{
  PetscInt lo, hi, l, lda;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatGetSize(V, NULL, &l));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArray(V, &v));
  for (PetscInt k = 0; k < count * n; k++) {
    /* Points are numbered over the whole mesh, rows over all components. */
    const PetscInt row = point[k / n] * n + k % n;

    for (PetscInt j = 0; j < l && row >= lo && row < hi; j++) v[(size_t)j * (size_t)lda + (size_t)(row - lo)] = 0;
  }
  PetscCall(MatDenseRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q-DEIM on what is left, round after round: each round gives up to l further points, so that the system at the points
   is overdetermined and noise is averaged. Q-DEIM (Drmac and Gugercin 2016): pivots of a QR factorisation with column
   exchange of V^T. */
PetscErrorCode HycoPointsChoose(const HycoBasis *modes, PetscInt n, PetscInt rounds, PetscInt *count, PetscInt point[])
{
  PetscInt found = 1;
  Mat rest;

  PetscFunctionBegin;
  *count = 0;
  if (!modes->l) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDuplicate(modes->V, MAT_COPY_VALUES, &rest));
  for (PetscInt k = 0; k < rounds && found; k++) {
    PetscInt *index = point + *count;

    /* Rank-revealing: rows of which nothing is left give no points, and the rounds end. */
    HycoLogged(HYCO_EVENT_DEIM, HycoQDEIMRank(rest, index, &found));
    for (PetscInt j = 0; j < found; j++) index[j] /= n;
    PetscCall(ZeroPoints(rest, n, found, index));
    *count += found;
  }
  PetscCall(MatDestroy(&rest));
  PetscCall(PetscSortRemoveDupsInt(count, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P = pseudoinverse of the modes at the chosen points, by which coefficients follow from the laws there; 1 / smallest
   singular value is the amplification of their errors. */
PetscErrorCode HycoPointsInverse(const HycoBasis *modes, PetscInt n, PetscInt count, const PetscInt point[],
                                 PetscReal P[], PetscReal there[], PetscReal *smallest)
{
  const PetscInt rows = count * n, l = modes->l;
  PetscReal largest, *columns;
  PetscInt *row;

  PetscFunctionBegin;
  /* Its inverse is the amplification of errors; no mode amplifies nothing. */
  *smallest = 1;
  if (!l) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(rows, &row, rows * l, &columns));
  for (PetscInt i = 0; i < rows; i++) row[i] = point[i / n] * n + i % n;
  PetscCall(HycoGatherRows(modes->V, rows, row, there));
  for (PetscInt i = 0; i < rows * l; i++) columns[i % l * rows + i / l] = there[i];
  PetscCall(HycoPseudoInverse(rows, l, columns, 0, P));
  PetscCall(HycoExtremeSingularValues(rows, l, columns, smallest, &largest));
  PetscCall(PetscFree2(row, columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}
