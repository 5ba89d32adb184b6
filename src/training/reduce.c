/*
  Bases and interpolation points (sections 4.1, 4.2): POD of displacements, stresses, generalised forces and
  multipliers, DEIM on each. Snapshot matrices are spread over the ranks by rows; the multipliers' norm needs rank 0
  alone.
*/
#include <hycoalgorithms.h>
#include <hycotrainerimpl.h>

/* Snapshots less their lifting r(u0): zero on the fixed unknowns. */
static PetscErrorCode RemoveLifting(HycoTrainer t, Mat S)
{
  const PetscInt n_dof = t->sizes[0] * t->sizes[3];
  PetscBool *fixed;
  PetscInt lo, hi, lda, n;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_dof, &fixed));
  if (t->rank == 0) PetscCall(PetscArraycpy(fixed, t->fe->fixed, n_dof));
  PetscCallMPI(MPI_Bcast(fixed, (PetscMPIInt)(n_dof * (PetscInt)sizeof(PetscBool)), MPI_BYTE, 0, t->comm));
  PetscCall(MatGetOwnershipRange(S, &lo, &hi));
  PetscCall(MatGetSize(S, NULL, &n));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(MatDenseGetArray(S, &s));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; fixed[i] && j < n; j++) s[(size_t)j * (size_t)lda + (size_t)(i - lo)] = 0;
  }
  PetscCall(MatDenseRestoreArray(S, &s));
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddSeeds(PetscInt n, const PetscInt add[], PetscInt divide, PetscInt *n_seeds, PetscInt **seeds)
{
  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(*n_seeds + n + 1) * sizeof(PetscInt), seeds));
  for (PetscInt k = 0; k < n; k++) (*seeds)[(*n_seeds)++] = add[k] / divide;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerToRoot(HycoTrainer t, Mat S, PetscBool row_major, PetscReal **out)
{
  PetscInt N, n, lo, hi, lda;
  PetscMPIInt size, *counts, *offsets;
  const PetscInt *ranges;
  const PetscScalar *s;
  PetscReal *mine, *all = NULL;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(t->comm, &size));
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(MatGetOwnershipRange(S, &lo, &hi));
  PetscCall(MatGetOwnershipRanges(S, &ranges));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(PetscMalloc3(size, &counts, size, &offsets, (size_t)(hi - lo) * (size_t)n, &mine));
  if (t->rank == 0) PetscCall(PetscMalloc1((size_t)N * (size_t)n + 1, &all));
  PetscCall(MatDenseGetArrayRead(S, &s));
  for (PetscInt i = 0; i < hi - lo; i++) {
    for (PetscInt j = 0; j < n; j++) mine[(size_t)i * (size_t)n + (size_t)j] = s[(size_t)j * (size_t)lda + (size_t)i];
  }
  PetscCall(MatDenseRestoreArrayRead(S, &s));
  {
    MPI_Datatype row;

    PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)n, MPIU_REAL, &row));
    PetscCallMPI(MPI_Type_commit(&row));
    for (PetscMPIInt r = 0; r < size; r++) {
      counts[r] = (PetscMPIInt)(ranges[r + 1] - ranges[r]);
      offsets[r] = (PetscMPIInt)ranges[r];
    }
    PetscCallMPI(MPI_Gatherv(mine, (PetscMPIInt)(hi - lo), row, all, counts, offsets, row, 0, t->comm));
    PetscCallMPI(MPI_Type_free(&row));
  }
  PetscCall(PetscFree3(counts, offsets, mine));
  if (t->rank == 0 && !row_major) {
    PetscReal *columns;

    PetscCall(PetscMalloc1((size_t)N * (size_t)n + 1, &columns));
    for (PetscInt i = 0; i < N; i++) {
      for (PetscInt j = 0; j < n; j++)
        columns[(size_t)j * (size_t)N + (size_t)i] = all[(size_t)i * (size_t)n + (size_t)j];
    }
    PetscCall(PetscFree(all));
    all = columns;
  }
  *out = all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerMultiply(HycoTrainer t, Mat X, Mat Y, PetscReal product[])
{
  Mat P, whole = NULL;
  const PetscScalar *p;
  PetscInt lda, rows, cols;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(MatTransposeMatMult(X, Y, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &P));
  PetscCallMPI(MPI_Comm_size(t->comm, &size));
  if (size > 1)
    PetscCall(MatCreateRedundantMatrix(P, size, PETSC_COMM_SELF, MAT_INITIAL_MATRIX, &whole));
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
  PetscCall(MatDestroy(&whole));
  PetscCall(MatDestroy(&P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V^T of the snapshots and their norms, which judge a model on the whole mesh at the cost of its modes. */
static PetscErrorCode Project(HycoTrainer t, Mat S, Mat V)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->l * t->n_s, &t->VtU));
  PetscCall(PetscMalloc1(t->n_s, &t->U_norm));
  PetscCall(MatGetColumnNorms(S, NORM_2, t->U_norm));
  PetscCall(HycoTrainerMultiply(t, V, S, t->VtU));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerGetDisplacements(HycoTrainer t, HycoSnapshots store, Mat *S)
{
  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetField(store, t->samples, "U", S));
  PetscCall(RemoveLifting(t, *S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Points(HycoTrainer t, Mat V, PetscInt index[])
{
  PetscFunctionBegin;
  PetscCall(t->deim ? HycoQDEIM(V, index) : HycoDEIM(V, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The primal basis V, and DEIM on it. */
static PetscErrorCode ReduceDisplacements(HycoTrainer t, HycoSnapshots store)
{
  Mat S, V;
  PetscInt *index;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetField(store, t->samples, "U", &S));
  PetscCall(HycoTrainerToRoot(t, S, PETSC_FALSE, &t->U));
  PetscCall(RemoveLifting(t, S));
  PetscCall(PetscMalloc1(t->n_s + 1, &t->sigma));
  HycoLogged(HYCO_EVENT_POD, HycoPOD(S, t->tol[HYCO_SEED_DISPLACEMENT], t->noise, t->max_modes, &V, &t->l, t->sigma));
  HycoCheckModel(t->l || !(t->sigma[0] > 0), "-hyco_pod_tol %g leaves no mode; give less",
            (double)t->tol[HYCO_SEED_DISPLACEMENT]);
  HycoCheckModel(t->l, "every training solution has zero displacement; there is nothing to learn");
  t->counts[HYCO_SEED_DISPLACEMENT] = t->l;
  if (t->seed[HYCO_SEED_DISPLACEMENT]) {
    PetscCall(PetscMalloc1(t->l, &index));
    HycoLogged(HYCO_EVENT_DEIM, Points(t, V, index));
    PetscCall(AddSeeds(t->l, index, t->sizes[3], &t->n_seeds_node, &t->seeds_node));
    PetscCall(PetscFree(index));
  }
  PetscCall(Project(t, S, V));
  PetscCall(HycoTrainerToRoot(t, V, PETSC_TRUE, &t->V_whole));
  PetscCall(MatDestroy(&V));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD and DEIM of stresses (points are cells) or generalised forces (points are nodes). */
static PetscErrorCode SeedFrom(HycoTrainer t, HycoSnapshots store, const char field[], PetscInt kind, PetscInt divide,
                               PetscInt *n_seeds, PetscInt **seeds)
{
  Mat S, V;
  PetscInt *index, l;
  PetscReal *sigma;

  PetscFunctionBegin;
  if (!t->seed[kind]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSnapshotsGetField(store, t->samples, field, &S));
  PetscCall(PetscMalloc1(t->n_s, &sigma));
  HycoLogged(HYCO_EVENT_POD, HycoPOD(S, t->tol[kind], t->noise, 0, &V, &l, sigma));
  t->counts[kind] = l;
  if (l) {
    PetscCall(PetscMalloc1(l, &index));
    HycoLogged(HYCO_EVENT_DEIM, Points(t, V, index));
    PetscCall(AddSeeds(l, index, divide, n_seeds, seeds));
    PetscCall(PetscFree(index));
    PetscCall(MatDestroy(&V));
  }
  PetscCall(PetscFree(sigma));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerSupremizers(HycoTrainer t, Mat *forces, Mat *supremizers)
{
  const PetscInt m = t->sizes[2], n = t->n_s, dim = t->sizes[3], entries = HycoPairsWidth(&t->pairs) * dim * m;
  PetscInt *start, *dof, n_par;
  PetscReal *value, *gap;
  const PetscReal *mu;
  Mat M, R, X;
  PetscScalar *r;
  KSP ksp;
  PetscBool singular;
  PC pc;
  Mat factor;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  PetscCall(PetscMalloc4(m + 1, &start, entries, &dof, entries, &value, m, &gap));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, t->sizes[0] * dim, n, NULL, &R));
  PetscCall(MatDenseGetArray(R, &r));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(HycoFESetParameters(t->fe, mu + k * n_par));
    PetscCall(HycoContactRows(t->fe, &t->pairs, start, dof, value, gap));
    for (PetscInt i = 0; i < m; i++) {
      for (PetscInt j = start[i]; j < start[i + 1]; j++)
        r[(size_t)k * (size_t)(t->sizes[0] * dim) + (size_t)dof[j]] +=
            value[j] * t->Lambda[(size_t)k * (size_t)m + (size_t)i];
    }
  }
  PetscCall(MatDenseRestoreArray(R, &r));
  PetscCall(HycoFECreateMatrix(t->fe, PETSC_COMM_SELF, t->sizes[0], 0, &M));
  PetscCall(HycoFEAssembleH1(t->fe, HycoMeshLength(t->whole), M));
  PetscCall(MatSetOption(M, MAT_SPD, PETSC_TRUE));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_norm_", M, PETSC_TRUE, &ksp));
  PetscCall(HycoFactor(ksp, &singular));
  PetscCheck(!singular, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the H1 norm's matrix is singular");
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatDuplicate(R, MAT_DO_NOT_COPY_VALUES, &X));
  PetscCall(MatMatSolve(factor, R, X));
  PetscCall(MatDestroy(&M));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(PetscFree4(start, dof, value, gap));
  *forces = R;
  *supremizers = X;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gram matrix of the dual snapshots in the norm of the dual of H1: (B^T L)^T M^-1 (B^T L). On rank 0. */
static PetscErrorCode DualGram(HycoTrainer t, PetscReal G[])
{
  const PetscInt n = t->n_s;
  Mat R, X, GX;
  PetscScalar *r;

  PetscFunctionBegin;
  PetscCall(HycoTrainerSupremizers(t, &R, &X));
  PetscCall(MatTransposeMatMult(R, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &GX));
  PetscCall(MatDenseGetArray(GX, &r));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) G[j * n + i] = (r[j * n + i] + r[i * n + j]) / 2;
  }
  PetscCall(MatDenseRestoreArray(GX, &r));
  PetscCall(MatDestroy(&GX));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD of the multipliers in (H1)', DEIM on it: the nodes of each point's contact are seeds. On rank 0. */
static PetscErrorCode DualSeeds(HycoTrainer t, PetscInt *n_nodes, PetscInt nodes[])
{
  const PetscInt m = t->sizes[2], n = t->n_s;
  PetscReal *G, *W, *sigma;
  PetscInt l, *index;
  Mat V;
  PetscScalar *v;

  PetscFunctionBegin;
  *n_nodes = 0;
  PetscCall(PetscMalloc2(n * n, &G, n, &sigma));
  PetscCall(DualGram(t, G));
  PetscCall(HycoPODGram(n, G, t->tol[HYCO_SEED_DUAL], t->noise, &W, &l, sigma));
  t->counts[HYCO_SEED_DUAL] = l;
  if (l) {
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, l, NULL, &V));
    PetscCall(MatDenseGetArray(V, &v));
    for (PetscInt j = 0; j < l; j++) {
      for (PetscInt k = 0; k < n; k++) {
        for (PetscInt i = 0; i < m; i++) v[j * m + i] += t->Lambda[(size_t)k * (size_t)m + (size_t)i] * W[j * n + k];
      }
    }
    PetscCall(MatDenseRestoreArray(V, &v));
    PetscCall(PetscMalloc1(l, &index));
    HycoLogged(HYCO_EVENT_DEIM, Points(t, V, index));
    for (PetscInt k = 0; k < l; k++) {
      nodes[(*n_nodes)++] = t->pairs.slave[index[k]];
      for (PetscInt j = t->pairs.master_start[index[k]]; j < t->pairs.master_start[index[k] + 1]; j++)
        nodes[(*n_nodes)++] = t->pairs.master[j];
    }
    PetscCall(PetscFree(index));
    PetscCall(MatDestroy(&V));
  }
  PetscCall(PetscFree(W));
  PetscCall(PetscFree2(G, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReduceForces(HycoTrainer t, HycoSnapshots store)
{
  Mat S;
  PetscInt *nodes, n = 0;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetField(store, t->samples, "lambda", &S));
  PetscCall(HycoTrainerToRoot(t, S, PETSC_FALSE, &t->Lambda));
  PetscCall(MatDestroy(&S));
  if (!t->seed[HYCO_SEED_DUAL] || !t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(5 * t->n_s, &nodes));
  HycoOnRoot(t->comm, DualSeeds(t, &n, nodes));
  if (t->rank == 0) PetscCall(AddSeeds(n, nodes, 1, &t->n_seeds_node, &t->seeds_node));
  PetscCall(PetscFree(nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerReduce(HycoTrainer t, HycoSnapshots store)
{
  const PetscInt dim = t->sizes[3], n_sigma = dim == 1 ? 1 : dim == 2 ? 4 : 6;

  PetscFunctionBegin;
  PetscCall(ReduceDisplacements(t, store));
  PetscCall(SeedFrom(t, store, "sigma", HYCO_SEED_STRESS, n_sigma, &t->n_seeds_cell, &t->seeds_cell));
  PetscCall(SeedFrom(t, store, "force", HYCO_SEED_FORCE, dim, &t->n_seeds_node, &t->seeds_node));
  PetscCall(ReduceForces(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}
