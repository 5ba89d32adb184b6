/*
  Initial active set by nested iteration if most unknowns are contacts. Starting without contact, the edges of a contact
  zone move by about one node in an iteration, so that the number of iterations grows with the mesh. Coarser problems,
  derived from the matrix, are solved first, each from the set of the next coarser one; an edge is then wrong by a few
  nodes at most.

  Classical coarsening: a maximal independent set of the strong couplings, chosen breadth first, is kept; the other
  unknowns are interpolated from it (J. Ruge, K. Stueben, Algebraic multigrid, in: Multigrid methods, SIAM 1987: direct
  interpolation); the coarse matrix is P^T K P. Coarse unknowns are unknowns of the finer level, with their bounds. This
  requires couplings of one sign, K_ij <= 0 off the diagonal after a change of sign of some unknowns: membranes and
  ropes have them. Elasticity in 2D and 3D does not, and then no initial set is computed.

  The levels are on rank 0; the coarser ones together need as much memory as the finest.
*/
#include "gap.h"

/* A problem of this size is solved from no contact. */
#define HYCO_COARSEST   24
#define HYCO_MAX_LEVELS 64
/* Limit of iterations on a coarse level, which only gives an initial set. */
#define HYCO_LEVEL_ITS 40
/* Share of a row's largest coupling from which one is strong: the usual 0.25 of classical multigrid (Ruge, Stueben). */
#define HYCO_STRONG 0.25

typedef struct {
  PetscInt n;
  Mat K, P; /* P: from the next coarser level */
  Vec f;
  PetscReal *bound;    /* PETSC_INFINITY: none */
  PetscBool *active;   /* at its bound */
  PetscInt *coarse_of; /* number in the next coarser level, -1: interpolated from that level */
} Level;

/* The rows of a sequential matrix, borrowed. */
typedef struct {
  Mat K;
  PetscInt n;
  const PetscInt *start, *col;
  const PetscScalar *value;
} Rows;

/* Restored by RowsRestore(). Direct access: MatGetRow() for each row of each pass would dominate. */
static PetscErrorCode RowsGet(Mat K, Rows *r)
{
  PetscBool done;

  PetscFunctionBegin;
  r->K = K;
  PetscCall(MatGetRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &r->n, &r->start, &r->col, &done));
  PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_SUP, "the matrix gives no access to its rows");
  PetscCall(MatSeqAIJGetArrayRead(K, &r->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the reverse order of RowsGet(); PETSc counts the borrowed arrays. */
static PetscErrorCode RowsRestore(Rows *r)
{
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(MatSeqAIJRestoreArrayRead(r->K, &r->value));
  PetscCall(MatRestoreRowIJ(r->K, 0, PETSC_FALSE, PETSC_FALSE, &r->n, &r->start, &r->col, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes the sign of unknowns without a bound if this makes all couplings <= 0: sign[i] = 1 or -1. Breadth first
   from the bounds, whose signs are fixed. */
static PetscErrorCode FindSigns(const Rows *r, const PetscReal bound[], PetscReal sign[], PetscBool *found)
{
  PetscInt *queue;

  PetscFunctionBegin;
  *found = PETSC_TRUE;
  PetscCall(PetscMalloc1(r->n, &queue));
  for (PetscInt i = 0; i < r->n; i++) sign[i] = 0;
  for (PetscInt pass = 0; pass < 2; pass++) { /* from those with a bound, then the ones not reached */
    for (PetscInt s = 0; s < r->n; s++) {
      PetscInt head = 0, tail = 0;

      /* Signs of unknowns with a bound are fixed to 1, because y <= bound would become a lower bound. */
      if (sign[s] != 0 || (pass == 0 && bound[s] >= PETSC_INFINITY)) continue;
      sign[s] = 1;
      queue[tail++] = s;
      while (head < tail) {
        const PetscInt i = queue[head++];

        for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
          const PetscInt j = r->col[k];

          if (j == i || r->value[k] == 0 || sign[j] != 0) continue;
          sign[j] = r->value[k] * sign[i] < 0 || bound[j] < PETSC_INFINITY ? 1 : -1;
          queue[tail++] = j;
        }
      }
    }
  }
  /* The signs were greedy: couplings between unknowns reached on different ways decide. */
  for (PetscInt i = 0; i < r->n; i++) {
    PetscReal diagonal = 0, worst = 0;

    for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
      if (r->col[k] == i)
        diagonal = r->value[k];
      else
        worst = PetscMax(worst, sign[i] * sign[r->col[k]] * r->value[k]);
    }
    if (!(diagonal > 0) || worst > 1e-10 * diagonal) *found = PETSC_FALSE;
  }
  PetscCall(PetscFree(queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weakest strong coupling of a row, as a negative number; 0: the row has no couplings. Couplings are negative
   here. */
static PetscReal NestedIterationStrong(const Rows *r, PetscInt i)
{
  PetscReal least = 0;

  for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
    if (r->col[k] != i) least = PetscMin(least, r->value[k]);
  }
  return HYCO_STRONG * least;
}

/* coarse_of: a maximal independent set, numbered in the order of the unknowns; returns its size. Breadth first in
   the matrix graph: about every second unknown of a chain is kept. */
static PetscErrorCode NestedIterationSplit(const Rows *r, PetscInt coarse_of[], PetscInt *n_coarse)
{
  PetscInt *queue, head = 0, tail = 0;
  PetscBool *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->n, &queue));
  PetscCall(PetscCalloc1(r->n, &seen));
  for (PetscInt i = 0; i < r->n; i++) coarse_of[i] = -1;
  for (PetscInt s = 0; s < r->n; s++) {
    if (seen[s]) continue;
    seen[s] = PETSC_TRUE;
    queue[tail++] = s;
    while (head < tail) {
      const PetscInt i = queue[head++];
      const PetscReal strong = NestedIterationStrong(r, i);
      PetscBool stays = (PetscBool)(strong < 0);

      for (PetscInt k = r->start[i]; strong < 0 && k < r->start[i + 1]; k++) {
        const PetscInt j = r->col[k];

        if (j == i || r->value[k] > strong) continue;
        /* A strong neighbour is coarse: this one is interpolated. */
        if (coarse_of[j] >= 0) stays = PETSC_FALSE;
        if (seen[j]) continue;
        seen[j] = PETSC_TRUE;
        queue[tail++] = j;
      }
      if (stays) coarse_of[i] = 0;
    }
  }
  *n_coarse = 0;
  for (PetscInt i = 0; i < r->n; i++) {
    /* Numbered in the order of the unknowns, so that the result does not depend on the search. */
    if (coarse_of[i] == 0) coarse_of[i] = (*n_coarse)++;
  }
  HycoFreeAll(&queue, &seen);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P: identity on the unknowns kept; elsewhere w_ij = -(sum_k K_ik / sum of its strong coarse K_ij) K_ij / K_ii.
   Classical direct interpolation: constants are reproduced where rows sum to zero. */
static PetscErrorCode NestedIterationInterpolate(const Rows *r, const PetscInt coarse_of[], PetscInt n_coarse, Mat *P)
{
  PetscInt *length, *col, longest = 1;
  PetscScalar *weight;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->n, &length));
  for (PetscInt i = 0; i < r->n; i++) {
    const PetscReal strong = NestedIterationStrong(r, i);

    length[i] = coarse_of[i] >= 0;
    for (PetscInt k = r->start[i]; coarse_of[i] < 0 && strong < 0 && k < r->start[i + 1]; k++)
      length[i] += r->col[k] != i && r->value[k] <= strong && coarse_of[r->col[k]] >= 0;
    longest = PetscMax(longest, length[i]);
  }
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, r->n, n_coarse, 0, length, P));
  PetscCall(PetscMalloc2(longest, &col, longest, &weight));
  for (PetscInt i = 0; i < r->n; i++) {
    const PetscReal strong = NestedIterationStrong(r, i);
    PetscReal diagonal = 0, all = 0, taken = 0;
    PetscInt n = 0;

    if (coarse_of[i] >= 0) {
      PetscCall(MatSetValue(*P, i, coarse_of[i], 1, INSERT_VALUES));
      continue;
    }
    for (PetscInt k = r->start[i]; strong < 0 && k < r->start[i + 1]; k++) {
      const PetscInt j = r->col[k];

      if (j == i) {
        diagonal = r->value[k];
        continue;
      }
      all += r->value[k];
      if (r->value[k] > strong || coarse_of[j] < 0) continue;
      taken += r->value[k];
      col[n] = coarse_of[j];
      weight[n++] = r->value[k];
    }
    /* n > 0 means taken < 0; rows without coarse neighbours stay empty, and interpolate 0. */
    for (PetscInt k = 0; k < n; k++) weight[k] *= -all / taken / diagonal;
    PetscCall(MatSetValues(*P, 1, &i, n, col, weight, INSERT_VALUES));
  }
  PetscCall(HycoMatAssemble(*P));
  PetscCall(PetscFree(length));
  PetscCall(PetscFree2(col, weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next coarser level; *made is false if the matrix is small, or cannot be coarsened. Bounds and loads of coarse
   unknowns are those of the finer level. Galerkin's coarse matrix P^T K P keeps symmetry and definiteness. */
static PetscErrorCode NestedIterationCoarsen(Level *fine, Level *coarse, PetscBool *made)
{
  Rows r;

  PetscFunctionBegin;
  *made = PETSC_FALSE;
  if (fine->n <= HYCO_COARSEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RowsGet(fine->K, &r));
  PetscCall(PetscMalloc1(fine->n, &fine->coarse_of));
  PetscCall(NestedIterationSplit(&r, fine->coarse_of, &coarse->n));
  /* A level that hardly shrinks would cost as much as the finer one. */
  *made = (PetscBool)(coarse->n > 0 && coarse->n <= 0.8 * fine->n);
  if (*made) PetscCall(NestedIterationInterpolate(&r, fine->coarse_of, coarse->n, &fine->P));
  PetscCall(RowsRestore(&r));
  if (!*made) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatPtAP(fine->K, fine->P, MAT_INITIAL_MATRIX, 2, &coarse->K));
  PetscCall(MatSetOption(coarse->K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatCreateVecs(coarse->K, &coarse->f, NULL));
  PetscCall(MatMultTranspose(fine->P, fine->f, coarse->f));
  PetscCall(PetscMalloc1(coarse->n, &coarse->bound));
  PetscCall(PetscCalloc1(coarse->n, &coarse->active));
  for (PetscInt i = 0; i < fine->n; i++) {
    if (fine->coarse_of[i] >= 0) coarse->bound[fine->coarse_of[i]] = fine->bound[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data of the iterations on a level. */
typedef struct {
  const Level *level;
  Vec y, rhs, residual, diagonal;
  Mat work;
  KSP ksp;
  PetscInt *at;
  PetscReal *at_bound;
} Solve;

/* The solve step of the active set method on a level. */
static PetscErrorCode SolveOnLevel(void *ctx, PetscBool active[], PetscBool *singular)
{
  const Solve *p = (const Solve *)ctx;
  const Level *l = p->level;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < l->n; i++) {
    if (!active[i]) continue;
    p->at[n] = i;
    p->at_bound[n++] = l->bound[i];
  }
  PetscCall(HycoSolveOnSet(l->K, p->work, p->ksp, l->f, n, p->at, p->at_bound, p->rhs, p->y, singular));
  if (*singular) PetscFunctionReturn(PETSC_SUCCESS);
  /* Forces are residuals at the closed unknowns. */
  PetscCall(MatMult(l->K, p->y, p->residual));
  PetscCall(VecAYPX(p->residual, -1, l->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which unknowns change sides: negative forces at closed ones, values beyond the bound at open ones, both beyond
   round-off. */
static PetscErrorCode NestedIterationViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Solve *p = (const Solve *)ctx;
  const Level *l = p->level;
  const PetscScalar *value, *force, *d;
  PetscReal size = 0, largest = 0;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->y, &value));
  PetscCall(VecGetArrayRead(p->residual, &force));
  PetscCall(VecGetArrayRead(p->diagonal, &d));
  for (PetscInt i = 0; i < l->n; i++) {
    /* The scale of values over the level: a violation of round-off does not change the set. */
    size = PetscMax(size, PetscAbsReal(value[i]));
    if (active[i]) largest = PetscMax(largest, PetscAbsReal(force[i]));
  }
  for (PetscInt i = 0; i < l->n; i++) {
    violates[i] = PETSC_FALSE;
    if (l->bound[i] < PETSC_INFINITY)
      violates[i] =
          active[i] ? HycoPulls(force[i], largest, d[i], l->bound[i]) : HycoPenetrates(value[i], l->bound[i], size);
  }
  PetscCall(VecRestoreArrayRead(p->y, &value));
  PetscCall(VecRestoreArrayRead(p->residual, &force));
  PetscCall(VecRestoreArrayRead(p->diagonal, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The active set method from l->active; y is the last solution. Only the set is used, whether or not it has converged.
   At most 40 iterations: the set need not be final. Started from the set of the coarser level, which is nearly right:
   few iterations a level (nested iteration). */
static PetscErrorCode SolveLevel(Level *l, Vec y)
{
  Solve p = {.level = l, .y = y};
  /* On rank 0 alone: no reductions. */
  const HycoActiveSet set = {.comm = MPI_COMM_NULL,
                             .n = l->n,
                             .max_its = HYCO_LEVEL_ITS,
                             .ctx = &p,
                             .solve = SolveOnLevel,
                             .violations = NestedIterationViolations};
  PetscInt its;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(l->K, MAT_COPY_VALUES, &p.work));
  PetscCall(HycoGapWork(p.work));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_primal_", p.work, PETSC_TRUE, &p.ksp));
  HycoVecDuplicate(y, &p.rhs, &p.residual, &p.diagonal);
  PetscCall(MatGetDiagonal(l->K, p.diagonal));
  PetscCall(PetscMalloc2(l->n, &p.at, l->n, &p.at_bound));
  PetscCall(HycoActiveSetRun(&set, l->active, &its, &status));
  PetscCall(PetscFree2(p.at, p.at_bound));
  HycoDestroyAll(&p.rhs, &p.residual, &p.diagonal, &p.work, &p.ksp);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The finer set: coarse unknowns keep their state; interpolated ones are relaxed once, and closed if this exceeds
   the bound. One Jacobi step with the coarse values. */
static PetscErrorCode NestedIterationProlong(Level *fine, const Level *coarse, Vec y)
{
  Vec fine_y, diagonal;
  const PetscScalar *value, *f, *d;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(fine->K, &fine_y, &diagonal));
  PetscCall(MatMult(fine->P, y, fine_y));
  PetscCall(MatGetDiagonal(fine->K, diagonal));
  PetscCall(VecGetArrayRead(fine_y, &value));
  PetscCall(VecGetArrayRead(fine->f, &f));
  PetscCall(VecGetArrayRead(diagonal, &d));
  for (PetscInt i = 0; i < fine->n; i++) {
    const PetscInt c = fine->coarse_of[i];

    /* What a Jacobi step from the interpolated value would exceed is closed. */
    fine->active[i] = c >= 0 ? coarse->active[c] : (PetscBool)(value[i] + f[i] / d[i] > fine->bound[i]);
  }
  PetscCall(VecRestoreArrayRead(fine_y, &value));
  PetscCall(VecRestoreArrayRead(fine->f, &f));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  HycoDestroyAll(&fine_y, &diagonal);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of a level that NestedIterationCoarsen() has begun and given up. NULL-safe in each part. */
static PetscErrorCode LevelDestroy(Level *l)
{
  PetscFunctionBegin;
  HycoDestroyAll(&l->K, &l->P, &l->f);
  HycoFreeAll(&l->bound, &l->active, &l->coarse_of);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From level 0 to the coarsest level and back; level 0 is not solved. A level is freed as soon as the finer set is
   known. */
static PetscErrorCode NestedIterationCascade(Level level[], PetscBool *made)
{
  PetscInt n = 1;
  PetscBool more = PETSC_TRUE;

  PetscFunctionBegin;
  /* Until a level is small or does not shrink. */
  while (more && n < HYCO_MAX_LEVELS) {
    PetscCall(NestedIterationCoarsen(&level[n - 1], &level[n], &more));
    n += more;
  }
  *made = (PetscBool)(n > 1);
  for (PetscInt l = n - 1; l > 0; l--) {
    Vec y;

    PetscCall(VecDuplicate(level[l].f, &y));
    PetscCall(SolveLevel(&level[l], y));
    PetscCall(NestedIterationProlong(&level[l - 1], &level[l], y));
    PetscCall(VecDestroy(&y));
    PetscCall(LevelDestroy(&level[l]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0's part: from the whole matrix, right-hand side and bounds to the set. made: couplings of one sign and at
   least one coarse level. */
static PetscErrorCode StartOnRoot(Mat K, Vec f, Vec bound, Vec set, PetscBool *made)
{
  Level *level;
  Rows r;
  Vec signs;
  PetscScalar *sign, *out;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(HYCO_MAX_LEVELS + 1, &level));
  PetscCall(MatGetSize(K, &level->n, NULL));
  PetscCall(PetscMalloc1(level->n, &level->bound));
  PetscCall(PetscCalloc1(level->n, &level->active));
  PetscCall(HycoVecRead(bound, level->n, level->bound));
  PetscCall(VecDuplicate(f, &signs));
  PetscCall(RowsGet(K, &r));
  PetscCall(VecGetArray(signs, &sign));
  PetscCall(FindSigns(&r, level->bound, sign, made));
  PetscCall(VecRestoreArray(signs, &sign));
  PetscCall(RowsRestore(&r));
  if (*made) {
    PetscCall(MatDuplicate(K, MAT_COPY_VALUES, &level->K));
    /* With these signs all couplings are negative: K is an M-matrix, on which sets of coarse problems are good
       starts. */
    PetscCall(MatDiagonalScale(level->K, signs, signs));
    PetscCall(VecDuplicate(f, &level->f));
    PetscCall(VecPointwiseMult(level->f, f, signs));
    PetscCall(NestedIterationCascade(level, made));
  }
  PetscCall(VecGetArray(set, &out));
  for (PetscInt i = 0; *made && i < level->n; i++) out[i] = level->active[i] ? 1 : 0;
  PetscCall(VecRestoreArray(set, &out));
  PetscCall(VecDestroy(&signs));
  PetscCall(LevelDestroy(level));
  PetscCall(PetscFree(level));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the whole matrix on rank 0, an empty one elsewhere. A submatrix of all rows on rank 0. */
static PetscErrorCode GatherMatrix(MPI_Comm comm, Mat K, Mat *whole)
{
  PetscInt n;
  Mat *part;
  IS all;

  PetscFunctionBegin;
  if (HycoSize(comm) == 1) {
    PetscCall(PetscObjectReference((PetscObject)K));
    *whole = K;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, HycoRank(comm) ? 0 : n, 0, 1, &all));
  PetscCall(MatCreateSubMatrices(K, 1, &all, &all, MAT_INITIAL_MATRIX, &part));
  /* MatDestroySubMatrices() gives up the other reference. */
  PetscCall(PetscObjectReference((PetscObject)part[0]));
  *whole = part[0];
  PetscCall(MatDestroySubMatrices(1, &part));
  PetscCall(ISDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* set: 1 where the bound is active in the coarse solutions, else 0 (distributed like f). *made is false if the matrix
   is not suitable. Collective. Worth it for obstacles along whole bodies, where a cold active set needs as many
   iterations as there are cells across the contact. */
PetscErrorCode HycoMultilevelStart(Mat K, Vec f, Vec bound, Vec set, PetscBool *made)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)K);
  PetscMPIInt rank;
  Mat whole;
  Vec f_root, bound_root, set_root;
  VecScatter scatter;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  /* Serial: coarse problems are cheap beside the factor of the fine one. */
  PetscCall(GatherMatrix(comm, K, &whole));
  PetscCall(VecScatterCreateToZero(f, &scatter, &f_root));
  HycoVecDuplicate(f_root, &bound_root, &set_root);
  PetscCall(HycoScatter(scatter, f, f_root));
  PetscCall(HycoScatter(scatter, bound, bound_root));
  *made = PETSC_FALSE;
  HycoOnRoot(comm, StartOnRoot(whole, f_root, bound_root, set_root, made));
  PetscCallMPI(MPI_Bcast(made, 1, HYCO_MPI_BOOL, 0, comm));
  if (*made) {
    PetscCall(VecScatterBegin(scatter, set_root, set, INSERT_VALUES, SCATTER_REVERSE));
    PetscCall(VecScatterEnd(scatter, set_root, set, INSERT_VALUES, SCATTER_REVERSE));
  }
  HycoDestroyAll(&scatter, &f_root, &bound_root, &set_root, &whole);
  PetscFunctionReturn(PETSC_SUCCESS);
}
