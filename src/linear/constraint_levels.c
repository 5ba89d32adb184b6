/*
  Constraints on the levels of a multigrid for K. Each constraint belongs to a node (a contact to its slave). The
  constraints whose nodes are in one aggregate become up to three on the next level, namely the combinations caused by a
  translation of that aggregate: an orthonormal basis of the constraints' own normals there, as smoothed aggregation
  constructs its tentative interpolation from the rigid motions. B_{l+1} = A_l^T B_l P_l.
*/
#include "constrained.h"

/* Of the largest direction of an aggregate's normals: a tenth; smaller ones would make the coarse constraints nearly
   dependent (tests/fom/iterative.py). */
#define HYCO_DIRECTION 0.1
/* Up to this number of constraints on a level, every rank factors their matrix and solves with it: MUMPS's
   communication takes longer than the rest. */
#define HYCO_ALIKE 20000
/* Of the diagonal of the coarse matrices of constraints: half of the digits, as these may be almost dependent
   (tests/fom/iterative.py). */
#define HYCO_COARSE_SHIFT 1e-8

/* The constraints of a level, on every rank: their nodes' first unknowns, and their normals (3 each). */
typedef struct {
  PetscInt m, *at;
  PetscReal *normal;
} Known;

/* m = 0 as well, so that it may be called twice. */
static PetscErrorCode KnownFree(Known *k)
{
  PetscFunctionBegin;
  HycoFreeAll(&k->at, &k->normal);
  k->m = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K's hierarchy and the estimates of its eigenvalues stay: they do not depend on the set. */
PetscErrorCode HycoConstraintsFree(HycoConstrained c)
{
  PetscFunctionBegin;
  for (PetscInt l = 0; l < c->n; l++) {
    HycoLevel *v = &c->level[l];

    v->m = 0;
    HycoDestroyAll(&v->B, &v->DBt, &v->G_diagonal, &v->G, &v->mu, &v->mu_work);
  }
  if (c->Y) PetscCall(VecDestroyVecs(c->n_Y, &c->Y));
  HycoFreeAll(&c->S, &c->mu_all);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coarse node with the largest entries in the rows of one fine node. Smoothed interpolation reaches several
   aggregates; the node belongs to the one with the largest weights. */
static PetscErrorCode NodeAggregate(Mat P, PetscInt row, PetscInt rows, PetscInt coarse_size, PetscInt *aggregate)
{
  enum { MOST = 64 };
  PetscInt node[MOST], n_nodes = 0;
  PetscReal sum[MOST], best = 0;

  PetscFunctionBegin;
  *aggregate = -1;
  for (PetscInt r = row; r < row + rows; r++) {
    PetscInt n;
    const PetscInt *col;
    const PetscScalar *value;

    PetscCall(MatGetRow(P, r, &n, &col, &value));
    for (PetscInt k = 0; k < n; k++) {
      PetscInt j = 0;

      while (j < n_nodes && node[j] != col[k] / coarse_size) j++;
      /* A node that many aggregates reach is far inside the first ones, whose weights are the largest. */
      if (j == MOST) continue;
      if (j == n_nodes) {
        node[n_nodes] = col[k] / coarse_size;
        sum[n_nodes++] = 0;
      }
      sum[j] += value[k] * value[k];
    }
    PetscCall(MatRestoreRow(P, r, &n, &col, &value));
  }
  for (PetscInt j = 0; j < n_nodes; j++) {
    if (sum[j] <= best) continue;
    best = sum[j];
    *aggregate = node[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Once per hierarchy, by unknown of the finer level; -1: none (a decoupled row). */
static PetscErrorCode FindAggregates(HycoLevel *fine, Mat coarse)
{
  PetscInt lo, hi, rows, cols, aggregate;
  PetscScalar *a;

  PetscFunctionBegin;
  if (fine->aggregate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetBlockSize(fine->K, &rows));
  PetscCall(MatGetBlockSize(coarse, &cols));
  PetscCall(VecDuplicate(fine->z, &fine->aggregate));
  PetscCall(VecGetOwnershipRange(fine->aggregate, &lo, &hi));
  PetscCall(VecGetArray(fine->aggregate, &a));
  /* By node: all components of a node are in one aggregate. */
  for (PetscInt r = lo; r < hi; r += rows) {
    PetscCall(NodeAggregate(fine->P, r, rows, cols, &aggregate));
    for (PetscInt k = 0; k < rows; k++) a[r - lo + k] = aggregate;
  }
  PetscCall(VecRestoreArray(fine->aggregate, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constraints on the finest level: the entries of B at the node of unknown at[i] are the normal. Slaves have
   entries of their normal at their own node. */
static PetscErrorCode KnownOfB(Mat K, Mat B, const PetscInt at[], Known *known)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)B);
  PetscInt lo, hi, bs, n_all, *first;
  PetscReal *normal;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(K, &bs));
  PetscCall(MatGetSize(B, &known->m, NULL));
  PetscCall(MatGetOwnershipRange(B, &lo, &hi));
  PetscCall(PetscMalloc1(hi - lo, &first));
  PetscCall(PetscCalloc1(3 * (hi - lo), &normal));
  for (PetscInt r = lo; r < hi; r++) {
    PetscInt n, *mine = &first[r - lo];
    const PetscInt *col;
    const PetscScalar *value;

    /* The first unknown of the slave's node. */
    *mine = at[r - lo] / bs * bs;
    PetscCall(MatGetRow(B, r, &n, &col, &value));
    for (PetscInt k = 0; k < n; k++) {
      if (col[k] >= *mine && col[k] < *mine + PetscMin(bs, 3)) normal[3 * (r - lo) + col[k] - *mine] = value[k];
    }
    PetscCall(MatRestoreRow(B, r, &n, &col, &value));
  }
  PetscCall(HycoConcatenateAll(comm, hi - lo, first, MPIU_INT, sizeof(PetscInt), &n_all, &known->at));
  PetscCall(HycoConcatenateAll(comm, 3 * (hi - lo), normal, MPIU_REAL, sizeof(PetscReal), &n_all, &known->normal));
  HycoFreeAll(&first, &normal);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* aggregate[i] of each constraint. Aggregates of other ranks' nodes come by a scatter. */
static PetscErrorCode AggregatesAt(const HycoLevel *fine, const Known *known, PetscInt aggregate[])
{
  IS is;
  Vec here;
  VecScatter scatter;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, known->m, known->at, PETSC_USE_POINTER, &is));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, known->m, &here));
  /* Repeated indices are allowed: a node may have several constraints. */
  PetscCall(VecScatterCreate(fine->aggregate, is, here, NULL, &scatter));
  PetscCall(HycoScatter(scatter, fine->aggregate, here));
  PetscCall(VecGetArrayRead(here, &a));
  for (PetscInt i = 0; i < known->m; i++) aggregate[i] = (PetscInt)a[i];
  PetscCall(VecRestoreArrayRead(here, &a));
  HycoDestroyAll(&scatter, &here, &is);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An orthonormal basis of the columns of the normals' rows i[0..n), largest first: column j of q (leading dimension
   3 in `weight`) at each of them; the new constraints' normals. Returns their number. Gram-Schmidt with pivoting on
   three columns. */
static PetscInt ConstraintLevelsBasis(PetscInt n, const PetscInt i[], const PetscReal normal[], PetscReal weight[],
                                      PetscReal coarse[])
{
  PetscReal largest = 0;
  PetscInt made = 0;

  for (; made < 3; made++) {
    PetscReal best = 0;
    PetscInt column = 0;

    /* `weight` has the remaining columns from `made` on */
    for (PetscInt j = made; j < 3; j++) {
      PetscReal size = 0;

      for (PetscInt k = 0; k < n; k++) {
        if (made == 0) weight[3 * i[k] + j] = normal[3 * i[k] + j];
        size += PetscSqr(weight[3 * i[k] + j]);
      }
      /* Equal columns (symmetric surfaces) are taken in their order on any machine. */
      if (size > best * (1 + 1e-10)) {
        best = size;
        column = j;
      }
    }
    best = PetscSqrtReal(best);
    if (made == 0) largest = best;
    if (!(best > HYCO_DIRECTION * largest)) break;
    for (PetscInt k = 0; k < n; k++) {
      PetscReal *w = weight + 3 * i[k], keep = w[column];

      w[column] = w[made];
      w[made] = keep / best;
    }
    for (PetscInt j = made + 1; j < 3; j++) {
      PetscReal dot = 0;

      for (PetscInt k = 0; k < n; k++) dot += weight[3 * i[k] + j] * weight[3 * i[k] + made];
      for (PetscInt k = 0; k < n; k++) weight[3 * i[k] + j] -= dot * weight[3 * i[k] + made];
    }
    for (PetscInt j = 0; j < 3; j++) {
      coarse[3 * made + j] = 0;
      for (PetscInt k = 0; k < n; k++) coarse[3 * made + j] += weight[3 * i[k] + made] * normal[3 * i[k] + j];
    }
  }
  return made;
}

/* Coarse constraints and A: column first[i] + j has the entry weight[3 i + j] in row i, j < count[i]. By sorted
   aggregates, on every rank alike. */
static PetscErrorCode ConstraintLevelsCoarsen(const HycoLevel *fine, PetscInt coarse_size, const Known *known,
                                              Known *coarse, PetscInt first[], PetscInt count[], PetscReal weight[])
{
  PetscInt *aggregate, *order;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(known->m, &aggregate, known->m, &order));
  PetscCall(PetscMalloc1(3 * known->m, &coarse->at));
  PetscCall(PetscMalloc1(9 * known->m, &coarse->normal));
  coarse->m = 0;
  PetscCall(AggregatesAt(fine, known, aggregate));
  for (PetscInt i = 0; i < known->m; i++) order[i] = i;
  PetscCall(PetscSortIntWithPermutation(known->m, aggregate, order));
  for (PetscInt begin = 0, end; begin < known->m; begin = end) {
    PetscInt made = 0;

    for (end = begin + 1; end < known->m && aggregate[order[end]] == aggregate[order[begin]];) end++;
    /* Constraints on decoupled rows have no coarse displacement, and end here. */
    if (aggregate[order[begin]] >= 0)
      made = ConstraintLevelsBasis(end - begin, order + begin, known->normal, weight, coarse->normal + 3 * coarse->m);
    for (PetscInt k = begin; k < end; k++) {
      first[order[k]] = coarse->m;
      count[order[k]] = made;
    }
    for (PetscInt j = 0; j < made; j++) coarse->at[coarse->m++] = aggregate[order[begin]] * coarse_size;
  }
  PetscCall(PetscFree2(aggregate, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B of the next level. A has up to three entries in a row. */
static PetscErrorCode CoarseB(HycoLevel *fine, const Known *known, Mat coarse_K, Known *coarse, Mat *B)
{
  PetscInt *first, *count, lo, hi, bs;
  PetscReal *weight;
  Mat A, BP;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(coarse_K, &bs));
  PetscCall(PetscMalloc3(known->m, &first, known->m, &count, 3 * known->m, &weight));
  PetscCall(ConstraintLevelsCoarsen(fine, bs, known, coarse, first, count, weight));
  PetscCall(MatGetOwnershipRange(fine->B, &lo, &hi));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)fine->B), hi - lo, PETSC_DECIDE, known->m, coarse->m, 3, NULL, 3,
                         NULL, &A));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < count[i]; j++)
      PetscCall(MatSetValue(A, i, first[i] + j, weight[3 * i + j], INSERT_VALUES));
  }
  PetscCall(HycoMatAssemble(A));
  PetscCall(MatMatMult(fine->B, fine->P, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &BP));
  /* A^T B P: combinations of the constraints on the coarse unknowns. */
  PetscCall(MatTransposeMatMult(A, BP, MAT_INITIAL_MATRIX, PETSC_DEFAULT, B));
  HycoDestroyAll(&BP, &A);
  PetscCall(PetscFree3(first, count, weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver for G, whose diagonal entries are about 1; each rank has the factor. PCREDUNDANT: each rank factors the
   gathered matrix. */
static PetscErrorCode ConstraintLevelsRedundant(Mat G, KSP *ksp)
{
  KSP inner;
  PC pc;

  PetscFunctionBegin;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)G), ksp));
  PetscCall(KSPSetOperators(*ksp, G, G));
  /* No iteration: the projection onto the constraints must be exact. */
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCREDUNDANT));
  PetscCall(PCRedundantGetKSP(pc, &inner));
  PetscCall(KSPSetType(inner, KSPPREONLY));
  PetscCall(KSPGetPC(inner, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  /* Nested dissection: G couples neighbours on a surface. */
  PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGND));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses a solver for G by its size. Small ones redundantly, large ones by MUMPS. */
static PetscErrorCode SolverForG(Mat G, KSP *ksp)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)G);
  PetscInt m;

  PetscFunctionBegin;
  PetscCall(MatGetSize(G, &m, NULL));
  if (HycoSize(comm) > 1 && m <= HYCO_ALIKE)
    PetscCall(ConstraintLevelsRedundant(G, ksp));
  else
    PetscCall(HycoDirectSolver(comm, "hyco_primal_constraints_", G, PETSC_TRUE, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inverts or factors B D^-1 B^T. Scaled to a largest diagonal entry of 1, since PETSc's limit of a zero pivot is
   absolute. */
static PetscErrorCode PrepareG(HycoLevel *v, PetscReal shift, PetscBool *singular)
{
  Mat G;
  MatInfo info;
  Vec diagonal;
  PetscReal least, most;

  PetscFunctionBegin;
  PetscCall(MatTranspose(v->B, MAT_INITIAL_MATRIX, &v->DBt));
  PetscCall(MatDiagonalScale(v->DBt, v->inverse, NULL));
  PetscCall(MatMatMult(v->B, v->DBt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G));
  PetscCall(MatCreateVecs(v->B, NULL, &v->mu));
  HycoVecDuplicate(v->mu, &v->mu_work, &diagonal);
  PetscCall(MatGetDiagonal(G, diagonal));
  PetscCall(MatGetInfo(G, MAT_GLOBAL_SUM, &info));
  PetscCall(VecMin(diagonal, NULL, &least));
  *singular = (PetscBool) !(least > 0);
  /* One entry per row: no two constraints share an unknown, and G is its diagonal. */
  if (*singular || info.nz_used <= v->m) {
    PetscCall(VecReciprocal(diagonal));
    v->G_diagonal = diagonal;
    PetscCall(MatDestroy(&G));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecMax(diagonal, NULL, &most));
  PetscCall(VecScale(diagonal, 1 + shift));
  PetscCall(MatDiagonalSet(G, diagonal, INSERT_VALUES));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatSetOption(G, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(G, MAT_SPD, PETSC_TRUE));
  v->G_scale = 1 / most;
  PetscCall(MatScale(G, v->G_scale));
  PetscCall(SolverForG(G, &v->G));
  PetscCall(HycoFactor(v->G, singular));
  PetscCall(MatDestroy(&G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors the coarsest level's B K^-1 B^T on every rank. One coarse solve per constraint: there are few on this
   level. */
static PetscErrorCode PrepareCoarsest(HycoConstrained c, HycoLevel *v, PetscBool *singular)
{
  const PetscInt m = v->m;
  PetscBLASInt n, info;
  Vec unit;

  PetscFunctionBegin;
  if (!v->mu) PetscCall(MatCreateVecs(v->B, NULL, &v->mu));
  PetscCall(VecDuplicate(v->mu, &unit));
  PetscCall(VecDuplicateVecs(v->z, m, &c->Y));
  c->n_Y = m;
  PetscCall(PetscMalloc1(m, &c->mu_all));
  PetscCall(PetscMalloc1((size_t)m * (size_t)m, &c->S));
  for (PetscInt j = 0; j < m; j++) {
    PetscCall(VecSet(unit, 0));
    PetscCall(VecSetValue(unit, j, 1, INSERT_VALUES));
    PetscCall(HycoVecAssemble(unit));
    PetscCall(MatMultTranspose(v->B, unit, v->r));
    PetscCall(KSPSolve(c->coarse, v->r, c->Y[j]));
    PetscCall(MatMult(v->B, c->Y[j], v->mu));
    PetscCall(HycoVecGather(v->mu, c->S + (size_t)j * (size_t)m));
    /* A small shift: constraints that have become dependent on this level must not break the factor. */
    c->S[(size_t)j * (size_t)m + (size_t)j] *= 1 + HYCO_COARSE_SHIFT;
  }
  PetscCall(VecDestroy(&unit));
  PetscCall(PetscBLASIntCast(m, &n));
  LAPACKpotrf_("L", &n, c->S, &n, &info);
  *singular = (PetscBool)(info != 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the constraints B x = d (rows of B; at[i]: an unknown at the node of row i) and coarsens them; *singular:
   rows without entries or dependent ones. Replaces former constraints. Collective. */
PetscErrorCode HycoConstrainedSet(HycoConstrained c, Mat B, const PetscInt at[], PetscBool *singular)
{
  Known known = {0, NULL, NULL};

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoConstraintsFree(c));
  PetscCall(MatGetSize(B, &c->level->m, NULL));
  if (!c->level->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectReference((PetscObject)B));
  c->level->B = B;
  PetscCall(KnownOfB(c->level->K, B, at, &known));
  for (PetscInt l = 0; l < c->n && !*singular; l++) {
    HycoLevel *v = &c->level[l];
    Known coarse;

    /* Nothing is constrained on this level, nor on coarser ones. */
    if (!v->m) break;
    if (l == 0 || l + 1 < c->n) PetscCall(PrepareG(v, l ? HYCO_COARSE_SHIFT : 0, singular));
    if (*singular || l + 1 == c->n) break;
    PetscCall(FindAggregates(v, v[1].K));
    PetscCall(CoarseB(v, &known, v[1].K, &coarse, &v[1].B));
    /* The finer level's are not needed any more. */
    PetscCall(KnownFree(&known));
    known = coarse;
    v[1].m = known.m;
  }
  PetscCall(KnownFree(&known));
  if (c->coarse && c->level[c->n - 1].m && !*singular) PetscCall(PrepareCoarsest(c, &c->level[c->n - 1], singular));
  PetscFunctionReturn(PETSC_SUCCESS);
}
