/*
  The offline phase (sections 4.1, 4.2, 5): snapshots -> POD -> DEIM -> RID -> sets -> reduced model -> file.
  Matrices of snapshots are spread over the ranks; the mesh, the RID and the model live on rank 0.
*/
#include <hycoalgorithms.h>
#include <hycotrainerimpl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

PetscErrorCode HycoTrainerCreate(MPI_Comm comm, HycoScene scene, HycoTrainer *trainer)
{
  HycoTrainer t;

  PetscFunctionBegin;
  HycoCheckHandle(scene, "HycoSceneLoad()");
  PetscCall(PetscNew(&t));
  PetscCallMPI(MPI_Comm_dup(comm, &t->comm));
  PetscCallMPI(MPI_Comm_rank(t->comm, &t->rank));
  t->scene = scene;
  t->noise = 1e-11;
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->tol[k] = k == HYCO_SEED_DUAL ? 1e-1 : 1e-7;
  t->seed[HYCO_SEED_DISPLACEMENT] = t->seed[HYCO_SEED_STRESS] = t->seed[HYCO_SEED_FORCE] = PETSC_TRUE;
  *trainer = t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What one run leaves behind. */
static PetscErrorCode ResetRun(HycoTrainer t)
{
  PetscFunctionBegin;
  PetscCall(HycoFEDestroy(&t->fe));
  PetscCall(HycoPairsDestroy(&t->pairs));
  PetscCall(HycoMeshDestroy(&t->whole));
  PetscCall(PetscFree(t->seeds_node));
  PetscCall(PetscFree(t->seeds_cell));
  PetscCall(PetscFree(t->sigma));
  PetscCall(PetscFree(t->V_whole));
  PetscCall(PetscFree(t->U));
  PetscCall(PetscFree(t->Lambda));
  PetscCall(PetscFree(t->VtU));
  PetscCall(PetscFree(t->U_norm));
  t->n_seeds_node = t->n_seeds_cell = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerDestroy(HycoTrainer *trainer)
{
  HycoTrainer t;

  PetscFunctionBegin;
  if (!trainer || !*trainer) PetscFunctionReturn(PETSC_SUCCESS);
  t = *trainer;
  PetscCall(ResetRun(t));
  for (PetscInt k = 0; k < t->n_groups; k++) PetscCall(PetscFree(t->groups[k]));
  PetscCall(PetscFree(t->region));
  PetscCallMPI(MPI_Comm_free(&t->comm));
  PetscCall(PetscFree(*trainer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerSetSnapshotFolder(HycoTrainer t, const char folder[])
{
  PetscFunctionBegin;
  HycoCheckHandle(t, "HycoTrainerCreate()");
  PetscCall(PetscStrncpy(t->folder, folder, sizeof(t->folder)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerSetProgress(HycoTrainer t, HycoProgress progress, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(t, "HycoTrainerCreate()");
  t->progress = progress;
  t->progress_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadSeedKinds(HycoTrainer t)
{
  static const char *const words[HYCO_N_SEEDS] = {"displacement", "stress", "force", "dual"};
  char *list[16];
  PetscInt n = 16;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetStringArray(t->scene->options, NULL, "-hyco_rid_modes", list, &n, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < HYCO_N_SEEDS; k++) t->seed[k] = PETSC_FALSE;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt k = 0;

    while (k < HYCO_N_SEEDS && strcmp(list[i], words[k])) k++;
    if (k == HYCO_N_SEEDS)
      HycoFail("-hyco_rid_modes has \"%s\"; its words are displacement, stress, force and dual", list[i]);
    t->seed[k] = PETSC_TRUE;
    PetscCall(PetscFree(list[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerSetFromOptions(HycoTrainer t)
{
  static const char *const hybrids[] = {"auto", "rank", "contact", "all", NULL};
  PetscOptions o;
  PetscInt hybrid, n = 64;
  PetscBool set;
  char text[4 * HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckHandle(t, "HycoTrainerCreate()");
  o = t->scene->options;
  hybrid = (PetscInt)t->hybrid;
  PetscCall(PetscOptionsGetString(o, NULL, "-hyco_snapshots", t->folder, sizeof(t->folder), NULL));
  PetscCall(HycoOptionsReal(o, "hyco_pod_tol", 0, 1, &t->tol[HYCO_SEED_DISPLACEMENT]));
  t->tol[HYCO_SEED_STRESS] = t->tol[HYCO_SEED_FORCE] = t->tol[HYCO_SEED_DISPLACEMENT];
  PetscCall(HycoOptionsReal(o, "hyco_rid_stress_tol", 0, 1, &t->tol[HYCO_SEED_STRESS]));
  PetscCall(HycoOptionsReal(o, "hyco_rid_force_tol", 0, 1, &t->tol[HYCO_SEED_FORCE]));
  PetscCall(HycoOptionsReal(o, "hyco_rid_dual_tol", 0, 1, &t->tol[HYCO_SEED_DUAL]));
  PetscCall(HycoOptionsReal(o, "hyco_pod_noise", 0, 1, &t->noise));
  PetscCall(HycoOptionsInt(o, "hyco_pod_max_modes", 0, PETSC_MAX_INT, &t->max_modes));
  PetscCall(HycoOptionsInt(o, "hyco_rid_layers", 0, PETSC_MAX_INT, &t->layers));
  PetscCall(HycoOptionsReal(o, "hyco_rid_contact_extension", 0, PETSC_MAX_REAL, &t->extension));
  PetscCall(HycoOptionsBool(o, "hyco_rid_whole", &t->whole_rid));
  PetscCall(HycoOptionsWord(o, "hyco_hybrid", hybrids, &hybrid));
  PetscCall(HycoOptionsInt(o, "hyco_hybrid_trials", 0, PETSC_MAX_INT / 8, &t->trials));
  t->hybrid = (HycoHybrid)hybrid;
  PetscCall(ReadSeedKinds(t));
  for (PetscInt k = 0; k < t->n_groups; k++) PetscCall(PetscFree(t->groups[k]));
  PetscCall(PetscOptionsGetStringArray(o, NULL, "-hyco_rid_groups", t->groups, &n, &set));
  t->n_groups = set ? n : 0;
  PetscCall(PetscOptionsGetString(o, NULL, "-hyco_rid_region", text, sizeof(text), &set));
  PetscCall(PetscFree(t->region));
  if (set) PetscCall(PetscStrallocpy(text, &t->region));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole mesh on rank 0, its sizes everywhere. */
static PetscErrorCode ReadMesh(HycoTrainer t)
{
  PetscInt n_par, group = 0;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  HycoOnRoot(t->comm, HycoMeshRead(t->scene, &t->whole));
  HycoOnRoot(t->comm, HycoPairsFind(t->scene, t->whole, &t->pairs));
  for (PetscInt k = 0; k < t->n_groups; k++)
    HycoOnRoot(t->comm, HycoMeshFindGroup(t->whole, "hyco_rid_groups", t->groups[k], &group));
  if (t->rank == 0) {
    PetscCall(HycoFECreate(t->scene, t->whole, &t->fe));
    t->sizes[0] = t->whole->n_nodes;
    t->sizes[1] = t->whole->n_cells;
    t->sizes[2] = t->pairs.n;
    t->sizes[3] = t->whole->dim;
  }
  HycoOnRoot(t->comm, HycoFESetParameters(t->fe, mu));
  PetscCallMPI(MPI_Bcast(t->sizes, 4, MPIU_INT, 0, t->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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

/* Gathers a distributed dense matrix on rank 0, row major or column major. */
static PetscErrorCode ToRoot(HycoTrainer t, Mat S, PetscBool row_major, PetscReal **out)
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

/* V^T of the snapshots and their norms, which judge a model on the whole mesh at the cost of its modes. */
static PetscErrorCode Project(HycoTrainer t, Mat S, Mat V)
{
  Mat P, whole = NULL;
  const PetscScalar *p;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->l * t->n_s, &t->VtU));
  PetscCall(PetscMalloc1(t->n_s, &t->U_norm));
  PetscCall(MatGetColumnNorms(S, NORM_2, t->U_norm));
  PetscCall(MatTransposeMatMult(V, S, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &P));
  {
    PetscMPIInt size;

    PetscCallMPI(MPI_Comm_size(t->comm, &size));
    if (size > 1)
      PetscCall(MatCreateRedundantMatrix(P, size, PETSC_COMM_SELF, MAT_INITIAL_MATRIX, &whole));
    else {
      PetscCall(PetscObjectReference((PetscObject)P));
      whole = P;
    }
  }
  PetscCall(MatDenseGetLDA(whole, &lda));
  PetscCall(MatDenseGetArrayRead(whole, &p));
  for (PetscInt k = 0; k < t->n_s; k++) PetscCall(PetscArraycpy(t->VtU + k * t->l, p + k * lda, t->l));
  PetscCall(MatDenseRestoreArrayRead(whole, &p));
  PetscCall(MatDestroy(&whole));
  PetscCall(MatDestroy(&P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The primal basis V, and DEIM on it. */
static PetscErrorCode ReduceDisplacements(HycoTrainer t, HycoSnapshots store)
{
  Mat S, V;
  PetscInt *index;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsGetField(store, t->samples, "U", &S));
  PetscCall(ToRoot(t, S, PETSC_FALSE, &t->U));
  PetscCall(RemoveLifting(t, S));
  PetscCall(PetscMalloc1(t->n_s + 1, &t->sigma));
  PetscCall(HycoPOD(S, t->tol[HYCO_SEED_DISPLACEMENT], t->noise, t->max_modes, &V, &t->l, t->sigma));
  PetscCheck(t->l, t->comm, PETSC_ERR_USER, "every training solution has zero displacement; there is nothing to learn");
  t->counts[HYCO_SEED_DISPLACEMENT] = t->l;
  if (t->seed[HYCO_SEED_DISPLACEMENT]) {
    PetscCall(PetscMalloc1(t->l, &index));
    PetscCall(HycoDEIM(V, index));
    PetscCall(AddSeeds(t->l, index, t->sizes[3], &t->n_seeds_node, &t->seeds_node));
    PetscCall(PetscFree(index));
  }
  PetscCall(Project(t, S, V));
  PetscCall(ToRoot(t, V, PETSC_TRUE, &t->V_whole));
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
  PetscCall(HycoPOD(S, t->tol[kind], t->noise, 0, &V, &l, sigma));
  t->counts[kind] = l;
  if (l) {
    PetscCall(PetscMalloc1(l, &index));
    PetscCall(HycoDEIM(V, index));
    PetscCall(AddSeeds(l, index, divide, n_seeds, seeds));
    PetscCall(PetscFree(index));
    PetscCall(MatDestroy(&V));
  }
  PetscCall(PetscFree(sigma));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gram matrix of the dual snapshots in the norm of the dual of H1: (B^T L)^T M^-1 (B^T L). On rank 0. */
static PetscErrorCode DualGram(HycoTrainer t, PetscReal G[])
{
  const PetscInt m = t->sizes[2], n = t->n_s, dim = t->sizes[3];
  PetscInt *start, *dof, n_par;
  PetscReal *value, *gap;
  const PetscReal *mu;
  Mat M, R, X, GX;
  PetscScalar *r;
  KSP ksp;
  PetscBool singular;
  PC pc;
  Mat factor;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  PetscCall(PetscMalloc4(m + 1, &start, 6 * m, &dof, 6 * m, &value, m, &gap));
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
  PetscCall(HycoFEAssembleH1(t->fe, M));
  PetscCall(MatSetOption(M, MAT_SPD, PETSC_TRUE));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_dual_", M, PETSC_TRUE, &ksp));
  PetscCall(HycoFactor(ksp, &singular));
  PetscCheck(!singular, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the H1 norm's matrix is singular");
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatDuplicate(R, MAT_DO_NOT_COPY_VALUES, &X));
  PetscCall(MatMatSolve(factor, R, X));
  PetscCall(MatTransposeMatMult(R, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &GX));
  PetscCall(MatDenseGetArray(GX, &r));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) G[j * n + i] = (r[j * n + i] + r[i * n + j]) / 2;
  }
  PetscCall(MatDenseRestoreArray(GX, &r));
  PetscCall(MatDestroy(&GX));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&R));
  PetscCall(MatDestroy(&M));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(PetscFree4(start, dof, value, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD of the multipliers in (H1)', DEIM on it: both nodes of each point's contact are seeds. On rank 0. */
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
    PetscCall(HycoDEIM(V, index));
    for (PetscInt k = 0; k < l; k++) {
      nodes[(*n_nodes)++] = t->pairs.slave[index[k]];
      if (t->pairs.master[index[k]] >= 0) nodes[(*n_nodes)++] = t->pairs.master[index[k]];
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
  PetscCall(ToRoot(t, S, PETSC_FALSE, &t->Lambda));
  PetscCall(MatDestroy(&S));
  if (!t->seed[HYCO_SEED_DUAL] || !t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * t->n_s, &nodes));
  HycoOnRoot(t->comm, DualSeeds(t, &n, nodes));
  if (t->rank == 0) PetscCall(AddSeeds(n, nodes, 1, &t->n_seeds_node, &t->seeds_node));
  PetscCall(PetscFree(nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Omega_A and the reduced mesh: its cells, their nodes, the nodes and surfaces of every contact. */
static PetscErrorCode CutDomain(HycoTrainer t, HycoModel m)
{
  HycoRIDRecipe recipe = {t->n_seeds_node, t->n_seeds_cell, t->seeds_node, t->seeds_cell, t->layers,
                          t->extension,    t->n_groups,     t->groups,     t->region,     t->whole_rid};
  HycoMesh whole = t->whole;
  PetscBool *in;
  PetscInt *role, *keep, *extra, *index, n_keep = 0, n_extra = 0, n_all = 0, all[64];

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(whole->n_cells, &in, whole->n_nodes, &role, whole->n_cells, &keep, 2 * t->pairs.n, &extra,
                         whole->n_nodes, &index));
  PetscCall(HycoRIDBuild(t->scene, whole, &t->pairs, &recipe, in));
  PetscCall(PetscMalloc1(t->pairs.n, &m->in_rid));
  PetscCall(HycoRIDSets(whole, &t->pairs, in, role, m->in_rid));
  for (PetscInt e = 0; e < whole->n_cells; e++) {
    if (in[e]) keep[n_keep++] = e;
  }
  for (PetscInt k = 0; k < t->pairs.n; k++) {
    extra[n_extra++] = t->pairs.slave[k];
    if (t->pairs.master[k] >= 0) extra[n_extra++] = t->pairs.master[k];
  }
  for (PetscInt k = 0; k < t->scene->n_contacts && n_all < 64; k++)
    PetscCall(HycoMeshFindGroup(whole, "contact", t->scene->contact[k].slave, &all[n_all++]));
  PetscCall(HycoMeshExtract(whole, n_keep, keep, n_extra, extra, n_all, all, &m->mesh));
  PetscCall(PetscMalloc1(m->mesh->n_nodes, &m->role));
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    m->role[i] = role[m->mesh->node_whole[i]];
    index[m->mesh->node_whole[i]] = i;
  }
  m->pairs.n = t->pairs.n;
  PetscCall(PetscMalloc1(t->pairs.n, &m->pairs.slave));
  PetscCall(PetscMalloc1(t->pairs.n, &m->pairs.master));
  HycoDuplicate(t->pairs.n, t->pairs.contact, &m->pairs.contact);
  for (PetscInt k = 0; k < t->pairs.n; k++) {
    m->pairs.slave[k] = index[t->pairs.slave[k]];
    m->pairs.master[k] = t->pairs.master[k] < 0 ? -1 : index[t->pairs.master[k]];
  }
  PetscCall(PetscFree5(in, role, keep, extra, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes on the reduced mesh, the dual snapshots that are not zero, the training points, where it all came from. */
static PetscErrorCode FillModel(HycoTrainer t, HycoModel m)
{
  const PetscInt dim = t->sizes[3], N = t->sizes[2];
  PetscInt n_par;
  const PetscReal *mu;
  char *text;
  char line[2 * HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &m->n_points, &n_par, &mu));
  m->l = t->l;
  HycoDuplicate(t->l, t->sigma, &m->sigma);
  PetscCall(PetscMalloc1(m->mesh->n_nodes * dim * m->l, &m->V));
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++)
    PetscCall(PetscArraycpy(m->V + i * dim * m->l, t->V_whole + m->mesh->node_whole[i] * dim * m->l, dim * m->l));
  PetscCall(PetscMalloc1((size_t)N * (size_t)t->n_s + 1, &m->S_lambda));
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscReal size = 0;

    for (PetscInt i = 0; i < N; i++) size += t->Lambda[(size_t)k * (size_t)N + (size_t)i];
    if (size > 0)
      PetscCall(PetscArraycpy(m->S_lambda + (size_t)(m->n_dual++) * (size_t)N, t->Lambda + (size_t)k * (size_t)N, N));
  }
  HycoDuplicate(m->n_points * n_par, mu, &m->points);
  m->whole_nodes = t->sizes[0];
  m->whole_cells = t->sizes[1];
  m->counts[0] = t->counts[HYCO_SEED_DUAL];
  m->counts[1] = t->counts[HYCO_SEED_STRESS];
  m->counts[2] = t->counts[HYCO_SEED_FORCE];
  snprintf(line, sizeof(line), "  written by hyco %s with PETSc %d.%d.%d\n", HycoVersion(), PETSC_VERSION_MAJOR,
           PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR);
  PetscCall(PetscStrallocpy(line, &m->provenance));
  /* the model has a scene of its own, read from the text it will carry */
  PetscCall(HycoSceneToText(t->scene, &text));
  PetscCall(HycoSceneFromText(PETSC_COMM_SELF, text, &m->scene));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Report(HycoTrainer t, HycoModel m, HycoTraining *r)
{
  r->n_samples = t->n_s;
  r->n_modes = t->l;
  r->n_dual_modes = t->counts[HYCO_SEED_DUAL];
  r->n_stress_modes = t->counts[HYCO_SEED_STRESS];
  r->n_force_modes = t->counts[HYCO_SEED_FORCE];
  r->n_fe_dofs = m->n_fe;
  r->rid_nodes = r->rid_a_nodes = r->rid_contacts = 0;
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    r->rid_nodes += m->role[i] != HYCO_ROLE_OUTSIDE;
    r->rid_a_nodes += m->role[i] == HYCO_ROLE_A;
  }
  for (PetscInt k = 0; k < m->pairs.n; k++) r->rid_contacts += m->in_rid[k];
  r->rid_elements = m->mesh->n_cells;
  r->rid_fraction = (PetscReal)m->mesh->n_cells / m->whole_cells;
  r->condition = m->numbers[0];
  r->error_u = m->numbers[1];
  r->error_lambda = m->numbers[2];
}

/* Rank 0: the RID, the model on it, its full-order displacements, the file. */
static PetscErrorCode BuildAndSave(HycoTrainer t, const char path[], HycoTraining *report)
{
  HycoModel m;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoModelCreate(&m));
  ierr = CutDomain(t, m);
  if (!ierr) ierr = FillModel(t, m);
  if (!ierr) ierr = HycoTrainerChooseHybrid(t, m);
  if (!ierr) ierr = HycoModelSave(m, t->whole, t->V_whole, path);
  if (!ierr) Report(t, m, report);
  PetscCall(HycoModelDestroy(&m));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model's place can be written before hours of work. */
static PetscErrorCode CheckWritable(const char path[])
{
  char probe[PETSC_MAX_PATH_LEN + 16];
  FILE *file;

  PetscFunctionBegin;
  snprintf(probe, sizeof(probe), "%s.partial", path);
  file = fopen(probe, "wb");
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_USER,
             "the model %s cannot be written: is there such a folder, may you write there?", path);
  fclose(file);
  unlink(probe);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerRun(HycoTrainer t, HycoSamples samples, const char path[], HycoTraining *training)
{
  HycoSnapshots store;
  HycoTraining report = {0};
  char folder[PETSC_MAX_PATH_LEN];
  PetscReal begin = HycoNow(), solved;

  PetscFunctionBegin;
  HycoCheckHandle(t, "HycoTrainerCreate()");
  PetscCall(ResetRun(t));
  t->samples = samples;
  PetscCall(HycoSamplesGet(samples, &t->n_s, NULL, NULL));
  PetscCheck(t->n_s > 0, t->comm, PETSC_ERR_USER, "the set of training points is empty");
  HycoOnRoot(t->comm, CheckWritable(path));
  PetscCall(ReadMesh(t));
  if (t->folder[0])
    PetscCall(PetscStrncpy(folder, t->folder, sizeof(folder)));
  else
    PetscCall(PetscSNPrintf(folder, sizeof(folder), "%s.snapshots", path));
  PetscCall(HycoSnapshotsOpen(t->comm, t->scene, folder, &store));
  PetscCall(HycoSnapshotsFill(store, samples, t->progress, t->progress_ctx));
  solved = HycoNow();
  PetscCall(ReduceDisplacements(t, store));
  PetscCall(SeedFrom(t, store, "sigma", HYCO_SEED_STRESS,
                     t->sizes[3] == 1   ? 1
                     : t->sizes[3] == 2 ? 4
                                        : 6,
                     &t->n_seeds_cell, &t->seeds_cell));
  PetscCall(SeedFrom(t, store, "force", HYCO_SEED_FORCE, t->sizes[3], &t->n_seeds_node, &t->seeds_node));
  PetscCall(ReduceForces(t, store));
  PetscCall(HycoSnapshotsDestroy(&store));
  HycoOnRoot(t->comm, BuildAndSave(t, path, &report));
  PetscCallMPI(MPI_Bcast(&report, sizeof(report), MPI_BYTE, 0, t->comm));
  report.seconds_snapshots = solved - begin;
  report.seconds_reduction = HycoNow() - solved;
  if (training) *training = report;
  PetscFunctionReturn(PETSC_SUCCESS);
}
