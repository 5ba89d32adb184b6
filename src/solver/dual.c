/*
  The dual form: the flexibility S = B K^-1 Bt and the gap without forces g = D - B K^-1 F, from one factorisation, and
  the complementarity problem w = g + S L in the contact forces alone, small and dense on every rank.
*/
#include <hycosolverimpl.h>
#include <petscblaslapack.h>

/* A residual below this share of F needs no refinement: the residuals are judged by 1e-8. */
#define REFINE 1e-10

/* Makes room for m contacts and p pinned unknowns; a change forgets the last solution's set. */
static PetscErrorCode Resize(HycoSolver s, PetscInt p)
{
  const PetscInt m = s->system->m, n = m + p;

  PetscFunctionBegin;
  if (s->m == m && s->p == p && s->S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(s->S));
  PetscCall(PetscFree(s->X));
  PetscCall(PetscFree(s->g));
  PetscCall(PetscFree(s->L));
  PetscCall(PetscFree(s->active));
  PetscCall(PetscMalloc1((size_t)n * (size_t)n + 1, &s->S));
  PetscCall(PetscCalloc1(n + 1, &s->g));
  PetscCall(PetscCalloc1(n + 1, &s->L));
  PetscCall(PetscCalloc1(m + 1, &s->active));
  s->m = m;
  s->p = p;
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
    PetscCall(PetscFree(s->X));
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
  HycoSystem y = s->system;
  PetscInt p;

  PetscFunctionBegin;
  if (!s->direct) PetscCall(HycoDirectCreate(HycoComm(s), &s->direct));
  PetscCall(HycoKernelSize(y->K, &p));
  PetscCall(Resize(s, p));
  PetscCall(HycoDirectPinKernel(s->direct, y->K));
  PetscCall(HycoDirectAnalyse(s->direct, y->K, y->Bt, y->B, y->symmetric, &s->bytes));
  PetscCall(HycoDirectFactor(s->direct, y->K, y->Bt, y->B, s->S, singular));
  PetscCall(HycoNameLinear(s, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n right-hand sides b and their solutions x, refined; low: what b could not hold, NULL where that is nothing. */
static PetscErrorCode RefineDense(HycoSolver s, PetscInt n, const PetscReal b[], const PetscReal low[], PetscReal x[])
{
  const PetscScalar *K;
  PetscInt lda;
  PetscBLASInt ld;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(s->system->K, &lda));
  PetscCall(PetscBLASIntCast(lda, &ld));
  PetscCall(MatDenseGetArrayRead(s->system->K, &K));
  for (PetscInt j = 0; j < n; j++)
    PetscCall(HycoRefine(s->n_lu, K, ld, s->lu, s->ipiv, b + (size_t)j * (size_t)s->n_lu, low,
                         x + (size_t)j * (size_t)s->n_lu));
  PetscCall(MatDenseRestoreArrayRead(s->system->K, &K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = B X, each entry rounded once; symmetric where it should be. */
static void RefineProduct(HycoSolver s, const PetscReal B[], const PetscReal X[])
{
  const size_t m = (size_t)s->m, n = (size_t)s->n_lu;

  for (size_t j = 0; j < m; j++) {
    for (size_t i = 0; i < m; i++) {
      PetscReal sum[2] = {0, 0};

      for (size_t k = 0; k < n; k++) HycoAddProduct(B[k * m + i], X[j * n + k], sum);
      s->S[j * m + i] = sum[0] + sum[1];
    }
  }
  for (size_t j = 0; j < m && s->system->symmetric; j++) {
    for (size_t i = 0; i < j; i++) s->S[i * m + j] = s->S[j * m + i] = 0.5 * (s->S[i * m + j] + s->S[j * m + i]);
  }
}

/* S = B K^-1 Bt with everything dense on one process. */
static PetscErrorCode CondenseDense(HycoSolver s)
{
  const PetscScalar *b, *bt;
  PetscReal *X, one = 1, zero = 0;
  PetscBLASInt m, n = s->n_lu, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(s->m, &m));
  if (!s->X) PetscCall(PetscMalloc1((size_t)n * (size_t)m, &s->X));
  X = s->X;
  PetscCall(MatDenseGetArrayRead(s->system->Bt, &bt));
  PetscCall(PetscArraycpy(X, bt, (size_t)n * (size_t)m));
  PetscCall(MatDenseRestoreArrayRead(s->system->Bt, &bt));
  LAPACKgetrs_("N", &n, &m, s->lu, &n, s->ipiv, X, &n, &info);
  if (s->refined) {
    PetscCall(MatDenseGetArrayRead(s->system->Bt, &bt));
    PetscCall(RefineDense(s, m, bt, NULL, X));
    PetscCall(MatDenseRestoreArrayRead(s->system->Bt, &bt));
  }
  PetscCall(MatDenseGetArrayRead(s->system->B, &b));
  if (s->refined)
    RefineProduct(s, b, X);
  else
    BLASgemm_("N", "N", &m, &m, &n, &one, b, &m, X, &n, &zero, s->S, &m);
  PetscCall(MatDenseRestoreArrayRead(s->system->B, &b));
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
    if (s->refined) {
      const PetscScalar *b;

      PetscCall(VecGetArrayRead(r, &b));
      PetscCall(RefineDense(s, 1, b, NULL, v));
      PetscCall(VecRestoreArrayRead(r, &b));
    }
    PetscCall(VecRestoreArray(x, &v));
  } else
    PetscCall(HycoDirectSolve(s->direct, r, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factor and flexibility, unless K and B are as they were. */
static PetscErrorCode SetUpDual(HycoSolver s, PetscBool *singular)
{
  HycoSystem y = s->system;
  PetscBool same, dense, dense_B = PETSC_TRUE;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoOperatorStateUpdate(&s->condensed, y->K, y->B, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  s->condensed.K = 0; /* until it is done */
  PetscCall(PetscObjectTypeCompare((PetscObject)y->K, MATSEQDENSE, &dense));
  if (!dense)
    HycoLogged(HYCO_EVENT_FACTOR, FactorSparse(s, singular));
  else {
    if (y->B) PetscCall(PetscObjectTypeCompare((PetscObject)y->B, MATSEQDENSE, &dense_B));
    PetscCheck(dense_B, PETSC_COMM_SELF, PETSC_ERR_SUP, "a dense K needs a dense B");
    PetscCall(Resize(s, 0));
    HycoLogged(HYCO_EVENT_FACTOR, FactorDense(s, singular));
    if (y->m && !*singular) HycoLogged(HYCO_EVENT_FACTOR, CondenseDense(s));
  }
  if (!*singular) PetscCall(HycoOperatorStateUpdate(&s->condensed, y->K, y->B, &same));
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
  if (size == 1) {
    PetscCall(VecGetLocalSize(v, &n));
    PetscCall(VecGetArrayRead(v, &local));
    PetscCall(PetscArraycpy(all, local, n));
    PetscCall(VecRestoreArrayRead(v, &local));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
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

/* Bodies that contact alone holds. */
static PetscErrorCode SolveHeld(HycoSolver s, PetscInt type, PetscBool *solved)
{
  const PetscInt max_its = s->max_its ? s->max_its : 50 + 4 * s->m;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCheck(type == HYCO_TYPE_ACTIVE_SET, HycoComm(s), PETSC_ERR_USER,
             "contact alone holds a body, and %s cannot solve that; use -hyco_solver_type active_set",
             HycoSolverTypes[type]);
  for (PetscInt i = 0; i < s->m && (!s->warm || !s->started); i++) s->active[i] = PETSC_TRUE;
  PetscCall(
      HycoSolveHeld(s->p, s->m, s->S, s->g, max_its, s->monitor, s->monitor_ctx, s->active, s->L, &s->its, &status));
  *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  for (PetscInt i = 0; i < s->m; i++) s->L[s->p + i] = s->active[i] ? PetscMax(s->L[s->p + i], 0) : 0;
  s->started = *solved;
  PetscCall(
      PetscSNPrintf(s->method, sizeof(s->method), "active_set dual, %d rigid motions held by contact", (int)s->p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveForces(HycoSolver s, PetscInt type, PetscBool *solved)
{
  const PetscInt max_its = s->max_its ? s->max_its : 50 + 4 * s->m;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(s->method, HycoSolverTypes[type], sizeof(s->method)));
  PetscCall(PetscStrlcat(s->method, " dual", sizeof(s->method)));
  if (type == HYCO_TYPE_TAO) {
    PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "tao %s dual", HycoTaoTypes[s->tao]));
    PetscCall(HycoTaoLCP(s->m, s->S, s->g, s->system->symmetric, s->tao, s->max_its, s->L, &s->its, solved));
  } else if (type == HYCO_TYPE_LEMKE) {
    PetscCall(HycoLCPLemke(s->m, s->S, s->g, 50 * (s->m + 10), s->L, &s->its, &status));
    *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  } else {
    if (!s->warm || !s->started) PetscCall(PetscArrayzero(s->active, s->m));
    PetscCall(HycoLCPActiveSet(s->m, s->S, s->g, s->system->symmetric, NULL, max_its, s->monitor, s->monitor_ctx,
                               s->active, s->L, &s->its, &status));
    *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  }
  for (PetscInt i = 0; i < s->m; i++) {
    s->L[i] = PetscMax(s->L[i], 0); /* round-off below zero; the residuals are recomputed */
    s->active[i] = (PetscBool)(s->L[i] > 0);
  }
  s->started = *solved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g = D - B K^-1 F, on every rank. */
static PetscErrorCode FreeGap(HycoSolver s, Vec x)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  if (!s->lu && !s->free) {
    PetscCall(GatherVec(HycoComm(s), y->D, s->L));
    PetscCall(HycoDirectReduce(s->direct, y->F, s->L, s->g));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (s->free)
    PetscCall(VecCopy(s->free, x));
  else
    PetscCall(SolveK(s, y->F, x));
  PetscCall(HycoSystemWork(y));
  PetscCall(MatMult(y->B, x, y->work_L));
  PetscCall(VecAYPX(y->work_L, -1, y->D));
  PetscCall(GatherVec(HycoComm(s), y->work_L, s->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = F - Bt L - K x */
static PetscErrorCode Residual(HycoSystem y, Vec x, Vec L, Vec work, Vec r)
{
  PetscFunctionBegin;
  if (y->m) {
    PetscCall(MatMult(y->Bt, L, r));
    PetscCall(VecAYPX(r, -1, y->F));
  } else
    PetscCall(VecCopy(y->F, r));
  if (!x) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(y->K, x, work));
  PetscCall(VecAXPY(r, -1, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 F - K^-1 Bt L, the first of them known. */
static PetscErrorCode AddForces(HycoSolver s, Vec x, Vec L)
{
  HycoSystem y = s->system;
  PetscReal most;

  PetscFunctionBegin;
  PetscCall(VecNorm(L, NORM_INFINITY, &most));
  if (most > 0) {
    PetscCall(MatMult(y->Bt, L, y->work_x[0]));
    PetscCall(SolveK(s, y->work_x[0], x));
    PetscCall(VecAYPX(x, -1, s->free));
  } else
    PetscCall(VecCopy(s->free, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x is refined against F - Bt L, which double precision does not hold. */
static PetscErrorCode RefineRecovered(HycoSolver s, Vec x)
{
  HycoSystem y = s->system;
  const size_t n = (size_t)s->n_lu;
  const PetscScalar *F, *bt = NULL;
  PetscScalar *v;
  PetscReal *b, *low;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &b, n, &low));
  if (y->m) PetscCall(MatDenseGetArrayRead(y->Bt, &bt));
  PetscCall(VecGetArrayRead(y->F, &F));
  for (size_t i = 0; i < n; i++) {
    PetscReal sum[2] = {F[i], 0};

    for (size_t k = 0; k < (size_t)y->m; k++) HycoAddProduct(-bt[k * n + i], s->L[k], sum);
    b[i] = sum[0];
    low[i] = sum[1];
  }
  PetscCall(VecRestoreArrayRead(y->F, &F));
  if (y->m) PetscCall(MatDenseRestoreArrayRead(y->Bt, &bt));
  PetscCall(VecGetArray(x, &v));
  PetscCall(RefineDense(s, 1, b, low, v));
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(PetscFree2(b, low));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 (F - Bt L), with one step of refinement when round-off shows. */
static PetscErrorCode Recover(HycoSolver s, Vec x, Vec L)
{
  HycoSystem y = s->system;
  Vec r, work;
  PetscReal size, residual;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  r = y->work_x[0];
  work = y->work_x[1];
  if (s->free && y->m)
    PetscCall(AddForces(s, x, L));
  else if (y->m && !s->lu)
    PetscCall(HycoDirectExpand(s->direct, s->L, x));
  else {
    PetscCall(Residual(y, NULL, L, work, r));
    PetscCall(SolveK(s, r, x));
  }
  if (s->refined) {
    PetscCall(RefineRecovered(s, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecNorm(y->F, NORM_2, &size));
  PetscCall(Residual(y, x, L, work, r));
  PetscCall(VecNorm(r, NORM_2, &residual));
  if (residual > REFINE * size && !s->p) {
    PetscCall(SolveK(s, r, work));
    PetscCall(VecAXPY(x, 1, work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's part of the forces that every rank has. */
static PetscErrorCode SetForces(HycoSolver s, Vec L)
{
  PetscInt lo, hi;
  PetscScalar *l;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  PetscCall(VecGetArray(L, &l));
  PetscCall(PetscArraycpy(l, s->L + s->p + lo, hi - lo));
  PetscCall(VecRestoreArray(L, &l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces change by dL (m), and x with them. */
static PetscErrorCode Shift(HycoSolver s, const PetscReal dL[], Vec x, Vec L)
{
  Vec change, force, move;
  PetscInt lo, hi;
  PetscScalar *c;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(L, &change));
  PetscCall(VecDuplicate(x, &force));
  PetscCall(VecDuplicate(x, &move));
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  PetscCall(VecGetArray(change, &c));
  PetscCall(PetscArraycpy(c, dL + lo, hi - lo));
  PetscCall(VecRestoreArray(change, &c));
  PetscCall(MatMult(s->system->Bt, change, force));
  PetscCall(SolveK(s, force, move));
  PetscCall(VecAXPY(x, -1, move));
  PetscCall(VecAXPY(L, 1, change));
  PetscCall(VecDestroy(&change));
  PetscCall(VecDestroy(&force));
  PetscCall(VecDestroy(&move));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where K is ill conditioned, x misses the gaps under the forces by more than S and g know: S dL = D - B x closes them.
 */
static PetscErrorCode CloseGaps(HycoSolver s, Vec x, Vec L)
{
  HycoSystem y = s->system;
  PetscInt k = 0, *a;
  PetscReal *change, open = 0, size;
  PetscBool singular = PETSC_TRUE;
  Vec gap;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y->D, &gap));
  PetscCall(MatMult(y->B, x, gap));
  PetscCall(VecNorm(gap, NORM_INFINITY, &size));
  PetscCall(VecAYPX(gap, -1, y->D));
  PetscCall(GatherVec(HycoComm(s), gap, s->g));
  PetscCall(VecDestroy(&gap));
  PetscCall(PetscMalloc2(s->m, &a, s->m, &change));
  for (PetscInt i = 0; i < s->m; i++) {
    if (s->L[i] <= 0) continue;
    a[k++] = i;
    open = PetscMax(open, PetscAbsReal(s->g[i]));
  }
  if (open > 1e-10 * size) PetscCall(HycoLCPSolveOnSet(s->m, s->S, s->g, y->symmetric, NULL, &k, a, change, &singular));
  for (PetscInt i = 0; i < s->m && !singular; i++) change[i] = PetscMax(change[i], -s->L[i]);
  if (!singular) PetscCall(Shift(s, change, x, L));
  PetscCall(PetscFree2(a, change));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where refinement changes S by no more than this share of its largest entry, nothing was lost to round-off. */
#define SAME_FLEXIBILITY 1e-12

PetscErrorCode HycoDualRefine(HycoSolver s, PetscBool *done)
{
  const size_t entries = (size_t)s->m * (size_t)s->m;
  PetscReal *before, change = 0, size = 0, begin = HycoNow();

  PetscFunctionBegin;
  *done = PETSC_FALSE;
  if (!s->lu || !s->condensed.K || !s->system->m) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDuplicate(entries, s->S, &before);
  s->refined = PETSC_TRUE;
  HycoLogged(HYCO_EVENT_FACTOR, CondenseDense(s));
  for (size_t k = 0; k < entries; k++) {
    change = PetscMax(change, PetscAbsReal(s->S[k] - before[k]));
    size = PetscMax(size, PetscAbsReal(s->S[k]));
  }
  s->refined = *done = (PetscBool)(change > SAME_FLEXIBILITY * size);
  if (!*done) PetscCall(PetscArraycpy(s->S, before, entries));
  PetscCall(PetscFree(before));
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoDualForget(HycoSolver s)
{
  if (s->refined) s->condensed.K = 0;
  s->refined = PETSC_FALSE;
}

PetscErrorCode HycoSolverFactor(HycoSolver s, PetscBool *singular)
{
  PetscFunctionBegin;
  s->seconds_factor = 0;
  PetscCall(SetUpDual(s, singular));
  s->seconds_before = s->seconds_factor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSolveLinear(HycoSolver s, Vec r, Vec x)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(SolveK(s, r, x));
  PetscCall(MatMult(y->K, x, y->work_x[0]));
  PetscCall(VecAYPX(y->work_x[0], -1, r));
  PetscCall(SolveK(s, y->work_x[0], y->work_x[1]));
  PetscCall(VecAXPY(x, 1, y->work_x[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetFree(HycoSolver s, Vec x)
{
  PetscFunctionBegin;
  s->free = x;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolveDual(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved)
{
  PetscBool singular;

  PetscFunctionBegin;
  if (s->iterative && !s->system->m) {
    PetscCall(HycoSolveIterative(s, x, solved));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SetUpDual(s, &singular));
  if (singular) {
    s->reason = HYCO_DIVERGED_SINGULAR;
    *solved = PETSC_FALSE;
    PetscCall(PetscStrncpy(s->method, "dual", sizeof(s->method)));
    PetscCall(VecSet(x, 0));
    if (L) PetscCall(VecSet(L, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!s->system->m) {
    PetscCall(PetscStrncpy(s->method, "linear", sizeof(s->method)));
    *solved = PETSC_TRUE;
    PetscCall(Recover(s, x, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FreeGap(s, x));
  HycoLogged(HYCO_EVENT_FORCES, s->p ? SolveHeld(s, type, solved) : SolveForces(s, type, solved));
  PetscCall(SetForces(s, L));
  PetscCall(Recover(s, x, L));
  if (s->lu && !s->p && *solved && type != HYCO_TYPE_TAO) PetscCall(CloseGaps(s, x, L));
  PetscFunctionReturn(PETSC_SUCCESS);
}
