/*
  The dual form: K factored once, the flexibility S = B K^-1 Bt by chunks of right-hand sides (X is never kept), the
  complementarity problem w = (D - B K^-1 F) + S L in the contact forces alone, small and dense on every rank.
*/
#include <hycosolverimpl.h>
#include <petscblaslapack.h>

#define CHUNK 64

/* Entries of this rank's rows of Bt. */
typedef struct {
  PetscInt n, *row, *col;
  PetscReal *value;
} Entries;

static PetscErrorCode ListEntries(Mat Bt, Entries *e)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(Bt, &lo, &hi));
  for (PetscInt pass = 0; pass < 2; pass++) {
    if (pass) PetscCall(PetscMalloc3(e->n, &e->row, e->n, &e->col, e->n, &e->value));
    e->n = 0;
    for (PetscInt r = lo; r < hi; r++) {
      PetscInt n;
      const PetscInt *cols;
      const PetscScalar *vals;

      PetscCall(MatGetRow(Bt, r, &n, &cols, &vals));
      for (PetscInt k = 0; k < n; k++) {
        if (pass) {
          e->row[e->n] = r - lo;
          e->col[e->n] = cols[k];
          e->value[e->n] = vals[k];
        }
        e->n++;
      }
      PetscCall(MatRestoreRow(Bt, r, &n, &cols, &vals));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers this rank's rows of a dense m x c matrix into every rank's columns S[first..]. */
static PetscErrorCode GatherColumns(HycoSolver s, Mat SX, PetscInt first, PetscInt c)
{
  PetscMPIInt size, *counts, *offsets;
  PetscInt lo, hi, lda;
  const PetscScalar *local;
  PetscReal *mine, *all;
  const PetscInt *ranges;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCall(MatGetOwnershipRange(SX, &lo, &hi));
  PetscCall(MatGetOwnershipRanges(SX, &ranges));
  PetscCall(PetscMalloc4(size, &counts, size, &offsets, (hi - lo) * c, &mine, s->m * c, &all));
  PetscCall(MatDenseGetLDA(SX, &lda));
  PetscCall(MatDenseGetArrayRead(SX, &local));
  for (PetscInt j = 0; j < c; j++)
    PetscCall(PetscArraycpy(mine + j * (hi - lo), local + (size_t)j * (size_t)lda, hi - lo));
  PetscCall(MatDenseRestoreArrayRead(SX, &local));
  for (PetscMPIInt r = 0; r < size; r++) {
    counts[r] = (PetscMPIInt)((ranges[r + 1] - ranges[r]) * c);
    offsets[r] = (PetscMPIInt)(ranges[r] * c);
  }
  PetscCallMPI(MPI_Allgatherv(mine, (PetscMPIInt)((hi - lo) * c), MPIU_REAL, all, counts, offsets, MPIU_REAL, s->comm));
  for (PetscMPIInt r = 0; r < size; r++) {
    const PetscInt rows = ranges[r + 1] - ranges[r];

    for (PetscInt j = 0; j < c; j++)
      PetscCall(
          PetscArraycpy(s->S + (size_t)(first + j) * (size_t)s->m + ranges[r], all + offsets[r] + j * rows, rows));
  }
  PetscCall(PetscFree4(counts, offsets, mine, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns first .. first + c of S. */
static PetscErrorCode CondenseChunk(HycoSolver s, Mat factor, const Entries *e, PetscInt first, PetscInt c)
{
  Mat R, X, SX;
  PetscInt rows, lda;
  PetscScalar *r;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(s->system->K, &rows, NULL));
  PetscCall(MatCreateDense(s->comm, rows, PETSC_DECIDE, s->system->n, c, NULL, &R));
  PetscCall(MatDuplicate(R, MAT_DO_NOT_COPY_VALUES, &X));
  PetscCall(MatDenseGetLDA(R, &lda));
  PetscCall(MatDenseGetArray(R, &r));
  for (PetscInt k = 0; k < e->n; k++) {
    if (e->col[k] >= first && e->col[k] < first + c)
      r[(size_t)(e->col[k] - first) * (size_t)lda + (size_t)e->row[k]] = e->value[k];
  }
  PetscCall(MatDenseRestoreArray(R, &r));
  PetscCall(MatAssemblyBegin(R, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(R, MAT_FINAL_ASSEMBLY));
  PetscCall(MatMatSolve(factor, R, X));
  PetscCall(MatMatMult(s->system->B, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &SX));
  PetscCall(GatherColumns(s, SX, first, c));
  PetscCall(MatDestroy(&SX));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Condense(HycoSolver s, Mat factor)
{
  Entries e = {0, NULL, NULL, NULL};
  const PetscInt m = s->m;

  PetscFunctionBegin;
  PetscCall(ListEntries(s->system->Bt, &e));
  for (PetscInt first = 0; first < m; first += CHUNK)
    PetscCall(CondenseChunk(s, factor, &e, first, PetscMin(CHUNK, m - first)));
  PetscCall(PetscFree3(e.row, e.col, e.value));
  if (!s->system->symmetric) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt j = 0; j < m; j++) {
    for (PetscInt i = 0; i < j; i++) {
      PetscReal *a = &s->S[(size_t)j * (size_t)m + (size_t)i], *b = &s->S[(size_t)i * (size_t)m + (size_t)j];

      *a = *b = (*a + *b) / 2;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes room for m contacts; a change of m forgets the last solution's set. */
static PetscErrorCode Resize(HycoSolver s)
{
  const PetscInt m = s->system->m;

  PetscFunctionBegin;
  if (s->m == m && s->S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(s->S));
  PetscCall(PetscFree(s->g));
  PetscCall(PetscFree(s->L));
  PetscCall(PetscFree(s->active));
  PetscCall(PetscMalloc1((size_t)m * (size_t)m + 1, &s->S));
  PetscCall(PetscCalloc1(m + 1, &s->g));
  PetscCall(PetscCalloc1(m + 1, &s->L));
  PetscCall(PetscCalloc1(m + 1, &s->active));
  s->m = m;
  s->started = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factor of a small dense K by LAPACK; a zero pivot is singular, not an error. */
static PetscErrorCode FactorDense(HycoSolver s, PetscBool *singular)
{
  const PetscScalar *k;
  PetscInt n, lda;
  PetscBLASInt info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(s->system->K, &n, NULL));
  if (s->n_lu != n) {
    PetscCall(PetscFree(s->lu));
    PetscCall(PetscFree(s->ipiv));
    PetscCall(PetscMalloc1((size_t)n * (size_t)n, &s->lu));
    PetscCall(PetscMalloc1(n, &s->ipiv));
    PetscCall(PetscBLASIntCast(n, &s->n_lu));
  }
  PetscCall(MatDenseGetLDA(s->system->K, &lda));
  PetscCall(MatDenseGetArrayRead(s->system->K, &k));
  for (PetscInt j = 0; j < n; j++)
    PetscCall(PetscArraycpy(s->lu + (size_t)j * (size_t)n, k + (size_t)j * (size_t)lda, n));
  PetscCall(MatDenseRestoreArrayRead(s->system->K, &k));
  LAPACKgetrf_(&s->n_lu, &s->n_lu, s->lu, &s->n_lu, s->ipiv, &info);
  *singular = (PetscBool)(info != 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FactorSparse(HycoSolver s, PetscBool *singular)
{
  Mat K = s->system->K, old = NULL;

  PetscFunctionBegin;
  if (s->ksp) PetscCall(KSPGetOperators(s->ksp, &old, NULL));
  if (old != K) {
    PetscCall(KSPDestroy(&s->ksp));
    PetscCall(HycoDirectSolver(s->comm, "hyco_dual_", K, s->system->symmetric, &s->ksp));
  }
  PetscCall(KSPSetOperators(s->ksp, K, K));
  PetscCall(HycoFactor(s->ksp, singular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = B K^-1 Bt with everything dense on one process. */
static PetscErrorCode CondenseDense(HycoSolver s)
{
  const PetscScalar *b, *bt;
  PetscReal *X, one = 1, zero = 0;
  PetscBLASInt m, n = s->n_lu, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(s->m, &m));
  PetscCall(PetscMalloc1((size_t)n * (size_t)m, &X));
  PetscCall(MatDenseGetArrayRead(s->system->Bt, &bt));
  PetscCall(PetscArraycpy(X, bt, (size_t)n * (size_t)m));
  PetscCall(MatDenseRestoreArrayRead(s->system->Bt, &bt));
  LAPACKgetrs_("N", &n, &m, s->lu, &n, s->ipiv, X, &n, &info);
  PetscCall(MatDenseGetArrayRead(s->system->B, &b));
  BLASgemm_("N", "N", &m, &m, &n, &one, b, &m, X, &n, &zero, s->S, &m);
  PetscCall(MatDenseRestoreArrayRead(s->system->B, &b));
  PetscCall(PetscFree(X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 r */
static PetscErrorCode SolveK(HycoSolver s, Vec r, Vec x)
{
  PetscFunctionBegin;
  if (s->lu) {
    PetscScalar *v;
    PetscBLASInt one = 1, info;

    PetscCall(VecCopy(r, x));
    PetscCall(VecGetArray(x, &v));
    LAPACKgetrs_("N", &s->n_lu, &one, s->lu, &s->n_lu, s->ipiv, v, &s->n_lu, &info);
    PetscCall(VecRestoreArray(x, &v));
  } else
    PetscCall(KSPSolve(s->ksp, r, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factor and flexibility, unless K and B are as they were. */
static PetscErrorCode SetUpDual(HycoSolver s, PetscBool *singular)
{
  HycoSystem y = s->system;
  PetscBool same_K, same_B, dense, dense_B = PETSC_FALSE;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare((PetscObject)y->K, MATSEQDENSE, &dense));
  if (y->B) PetscCall(PetscObjectTypeCompare((PetscObject)y->B, MATSEQDENSE, &dense_B));
  PetscCall(HycoSeenUpdate(&s->factored, y->K, NULL, &same_K));
  PetscCall(HycoSeenUpdate(&s->condensed, y->K, y->B, &same_B));
  if (!same_K && dense) PetscCall(FactorDense(s, singular));
  if (!same_K && !dense) PetscCall(FactorSparse(s, singular));
  if (!same_B && y->m && !*singular) {
    PetscCall(Resize(s));
    if (dense && dense_B)
      PetscCall(CondenseDense(s));
    else {
      PC pc;
      Mat factor;

      PetscCheck(!dense, PETSC_COMM_SELF, PETSC_ERR_SUP, "a dense K needs a dense B");
      PetscCall(KSPGetPC(s->ksp, &pc));
      PetscCall(PCFactorGetMatrix(pc, &factor));
      PetscCall(Condense(s, factor));
    }
  }
  if (*singular)
    s->factored.K = s->condensed.K = 0;
  else { /* factoring may have touched K's state */
    PetscCall(HycoSeenUpdate(&s->factored, y->K, NULL, &same_K));
    PetscCall(HycoSeenUpdate(&s->condensed, y->K, y->B, &same_B));
  }
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A distributed vector, whole on every rank. */
static PetscErrorCode GatherVec(MPI_Comm comm, Vec v, PetscReal all[])
{
  PetscMPIInt size, *counts, *offsets;
  const PetscInt *ranges;
  const PetscScalar *local;
  PetscInt n;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(VecGetOwnershipRanges(v, &ranges));
  PetscCall(PetscMalloc2(size, &counts, size, &offsets));
  for (PetscMPIInt r = 0; r < size; r++) {
    counts[r] = (PetscMPIInt)(ranges[r + 1] - ranges[r]);
    offsets[r] = (PetscMPIInt)ranges[r];
  }
  PetscCall(VecGetLocalSize(v, &n));
  PetscCall(VecGetArrayRead(v, &local));
  PetscCallMPI(MPI_Allgatherv(local, (PetscMPIInt)n, MPIU_REAL, all, counts, offsets, MPIU_REAL, comm));
  PetscCall(VecRestoreArrayRead(v, &local));
  PetscCall(PetscFree2(counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveForces(HycoSolver s, PetscInt type, PetscBool *solved)
{
  const PetscInt max_its = s->max_its ? s->max_its : 50 + 4 * s->m;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "%s dual", HycoSolverTypes[type]));
  if (type == HYCO_TYPE_TAO) {
    PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "tao %s dual", HycoTaoTypes[s->tao]));
    PetscCall(HycoTaoLCP(s->m, s->S, s->g, s->system->symmetric, s->tao, s->max_its, s->L, &s->its, solved));
  } else if (type == HYCO_TYPE_LEMKE) {
    PetscCall(HycoLCPLemke(s->m, s->S, s->g, 50 * (s->m + 10), s->L, &s->its, &status));
    *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  } else {
    if (!s->warm || !s->started) PetscCall(PetscArrayzero(s->active, s->m));
    PetscCall(HycoLCPActiveSet(s->m, s->S, s->g, s->system->symmetric, max_its, s->monitor, s->monitor_ctx, s->active,
                               s->L, &s->its, &status));
    *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  }
  for (PetscInt i = 0; i < s->m; i++) {
    s->L[i] = PetscMax(s->L[i], 0); /* round-off below zero; the residuals are recomputed */
    s->active[i] = (PetscBool)(s->L[i] > 0);
  }
  s->started = *solved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 (F - Bt L), with one step of refinement when round-off shows. */
static PetscErrorCode Recover(HycoSolver s, Vec x, Vec L)
{
  HycoSystem y = s->system;
  Vec r, dx;
  PetscReal size, residual;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &r));
  PetscCall(VecDuplicate(x, &dx));
  if (y->m) {
    PetscCall(MatMult(y->Bt, L, r));
    PetscCall(VecAYPX(r, -1, y->F));
  } else
    PetscCall(VecCopy(y->F, r));
  PetscCall(VecNorm(r, NORM_2, &size));
  PetscCall(SolveK(s, r, x));
  PetscCall(MatMult(y->K, x, dx));
  PetscCall(VecAXPY(r, -1, dx));
  PetscCall(VecNorm(r, NORM_2, &residual));
  if (residual > 1e-13 * size && residual < size) {
    PetscCall(SolveK(s, r, dx));
    PetscCall(VecAXPY(x, 1, dx));
  }
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&dx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  PetscBool singular;
  Vec gap;
  PetscScalar *l;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(SetUpDual(s, &singular));
  if (singular) {
    s->reason = HYCO_DIVERGED_SINGULAR;
    *solved = PETSC_FALSE;
    PetscCall(PetscStrncpy(s->method, "dual", sizeof(s->method)));
    PetscCall(VecSet(x, 0));
    if (L) PetscCall(VecSet(L, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!y->m) {
    PetscCall(PetscStrncpy(s->method, "linear", sizeof(s->method)));
    *solved = PETSC_TRUE;
    PetscCall(Recover(s, x, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SolveK(s, y->F, x));
  PetscCall(VecDuplicate(y->D, &gap));
  PetscCall(MatMult(y->B, x, gap));
  PetscCall(VecAYPX(gap, -1, y->D));
  PetscCall(GatherVec(s->comm, gap, s->g));
  PetscCall(VecDestroy(&gap));
  PetscCall(SolveForces(s, type, solved));
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  PetscCall(VecGetArray(L, &l));
  PetscCall(PetscArraycpy(l, s->L + lo, hi - lo));
  PetscCall(VecRestoreArray(L, &l));
  PetscCall(Recover(s, x, L));
  PetscFunctionReturn(PETSC_SUCCESS);
}
