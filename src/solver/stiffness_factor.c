/* A factor of K for the forms: LAPACK's if K is dense, with refinement in twice the working precision where
   round-off is too large; otherwise MUMPS's, which also gives the flexibility. */
#include <hycosolverimpl.h>

/* Of F, the residual of a solve: a hundredth of the tolerance of 1e-8; less needs no refinement. */
#define REFINE 1e-10

/* The members of the solver's struct; the struct itself is part of the solver. */
PetscErrorCode HycoStiffnessDestroy(HycoStiffness *f)
{
  PetscFunctionBegin;
  PetscCall(HycoDirectDestroy(&f->direct));
  HycoFreeAll(&f->lu, &f->ipiv, &f->X);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A zero pivot means that K is singular; it is not an error. A copy, by columns without gaps, as getrf overwrites
   it. */
static PetscErrorCode FactorDense(HycoStiffness *f, Mat K, PetscBool *singular)
{
  const PetscScalar *k;
  PetscInt n, lda;
  PetscBLASInt info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(K, &n, NULL));
  if (f->n != n) {
    HycoFreeAll(&f->lu, &f->ipiv);
    PetscCall(PetscMalloc1((size_t)n * (size_t)n, &f->lu));
    PetscCall(PetscMalloc1(n, &f->ipiv));
    PetscCall(PetscBLASIntCast(n, &f->n));
  }
  PetscCall(MatDenseGetLDA(K, &lda));
  PetscCall(MatDenseGetArrayRead(K, &k));
  for (PetscInt j = 0; j < n; j++)
    PetscCall(PetscArraycpy(f->lu + (size_t)j * (size_t)n, k + (size_t)j * (size_t)lda, n));
  PetscCall(MatDenseRestoreArrayRead(K, &k));
  /* LU also for a symmetric K: that of a reduced model need not be definite. */
  LAPACKgetrf_(&f->n, &f->n, f->lu, &f->n, f->ipiv, &info);
  *singular = (PetscBool)(info != 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* E of the soft motions v: the springs' stiffness less the work of their forces K v on the deformation under them,
   which the pins allow. The Schur complement has it only to round-off of K. */
static PetscErrorCode SpringBlock(const HycoSoft *soft, Mat K, HycoDirect direct, PetscReal E[])
{
  const PetscInt p = soft->n;
  Vec force, *u;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(E, p * p));
  PetscCall(VecDuplicate(soft->v[0], &force));
  PetscCall(VecDuplicateVecs(force, p, &u));
  for (PetscInt a = 0; a < p; a++) {
    E[a * p + a] = soft->stiffness[a];
    if (soft->stiffness[a] == 0) continue;
    PetscCall(MatMult(K, soft->v[a], force));
    PetscCall(HycoDirectSolve(direct, force, u[a]));
    for (PetscInt b = 0; b <= a; b++) {
      PetscReal work = 0;

      if (soft->stiffness[b] != 0) PetscCall(VecDot(force, u[b], &work));
      E[a * p + b] -= work;
      if (b < a) E[b * p + a] -= work;
    }
  }
  PetscCall(VecDestroyVecs(p, &u));
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The block of the soft motions in S, from that in their coordinates; exactly 0 for a floating body. */
static PetscErrorCode SetSoftBlock(HycoSystem y, HycoDirect direct, PetscReal S[])
{
  const HycoSoft *soft = y->soft;
  const PetscInt p = soft->n, n = p + y->m, *pinned = HycoDirectPinned(direct);
  const PetscBLASInt size = (PetscBLASInt)p;
  PetscReal *V, *E, *work;
  PetscBLASInt *ipiv, info;

  PetscFunctionBegin;
  PetscCall(PetscCalloc4(p * p, &V, p * p, &E, p * p, &work, p, &ipiv));
  PetscCall(HycoMotionAtPins(p, soft->v, pinned, V));
  PetscCall(SpringBlock(soft, y->K, direct, E));
  /* C = V^-T E V^-1, by columns: V^T X = E, then V^T C = X^T since C is symmetric. */
  LAPACKgetrf_(&size, &size, V, &size, ipiv, &info);
  for (int twice = 0; twice < 2 && !info; twice++) {
    LAPACKgetrs_("T", &size, &size, V, &size, ipiv, E, &size, &info);
    for (PetscInt k = 0; k < p * p; k++) work[k] = E[k % p * p + k / p];
    PetscCall(PetscArraycpy(E, work, p * p));
  }
  for (PetscInt k = 0; k < p * p && !info; k++) S[(size_t)(k / p) * (size_t)n + (size_t)(k % p)] = E[k];
  PetscCall(PetscFree4(V, E, work, ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S: the Schur complement on contacts (and pinned unknowns), by columns on every rank; NULL: the factor alone. */
static PetscErrorCode FactorSparse(HycoSolver s, Mat Bt, Mat B, PetscReal S[], PetscBool *singular)
{
  HycoStiffness *f = &s->stiffness;
  HycoSystem y = s->system;
  PetscReal *unused = NULL; /* receives the Schur complement of a null space, which is not needed */
  PetscInt p;

  PetscFunctionBegin;
  /* Solves go by the factor that exists: that of a dense K before is given up. */
  HycoFreeAll(&f->lu, &f->ipiv);
  f->n = 0;
  if (!f->direct) PetscCall(HycoDirectCreate(HycoComm(s), &f->direct));
  PetscCall(HycoSystemPin(y, f->direct));
  PetscCall(HycoDirectAnalyse(f->direct, y->K, Bt, B, y->symmetric, &f->bytes));
  PetscCall(HycoSystemPinned(y, &p));
  if (!S) PetscCall(PetscMalloc1(p * p + 1, &unused));
  PetscCall(HycoDirectFactor(f->direct, y->K, Bt, B, S ? S : unused, singular));
  PetscCall(PetscFree(unused));
  if (S && !*singular && y->soft && y->blocks) PetscCall(SetSoftBlock(y, f->direct, S));
  PetscCall(HycoNameLinear(s, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refines the solutions x of n right-hand sides b; low: the part of b below its precision, NULL if zero. */
static PetscErrorCode RefineDense(HycoSolver s, PetscInt n, const PetscReal b[], const PetscReal low[], PetscReal x[])
{
  const HycoStiffness *f = &s->stiffness;
  const PetscScalar *K;
  PetscInt lda;
  PetscBLASInt ld;

  PetscFunctionBegin;
  /* K may be a part of a larger dense matrix. */
  PetscCall(MatDenseGetLDA(s->system->K, &lda));
  PetscCall(PetscBLASIntCast(lda, &ld));
  PetscCall(MatDenseGetArrayRead(s->system->K, &K));
  for (PetscInt j = 0; j < n; j++)
    PetscCall(HycoRefine(f->n, K, ld, f->lu, f->ipiv, b + (size_t)j * (size_t)f->n, low, x + (size_t)j * (size_t)f->n));
  PetscCall(MatDenseRestoreArrayRead(s->system->K, &K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = B X, each entry rounded once; made symmetric. Twice the working precision: S decides signs of small gaps. */
static void RefineProduct(HycoSolver s, const PetscReal B[], const PetscReal X[], PetscReal S[])
{
  const size_t m = (size_t)s->system->m, n = (size_t)s->stiffness.n;

  for (size_t j = 0; j < m; j++) {
    for (size_t i = 0; i < m; i++) {
      PetscReal sum[2] = {0, 0};

      /* Each product with its rounding error, summed in a pair of doubles. */
      for (size_t k = 0; k < n; k++) HycoAddProduct(B[k * m + i], X[j * n + k], sum);
      S[j * m + i] = sum[0] + sum[1];
    }
  }
  for (size_t j = 0; j < m && s->system->symmetric; j++) {
    for (size_t i = 0; i < j; i++) S[i * m + j] = S[j * m + i] = 0.5 * (S[i * m + j] + S[j * m + i]);
  }
}

/* S = B K^-1 Bt (m x m, by columns) for a dense K; B and Bt are dense without gaps. */
PetscErrorCode HycoStiffnessCondense(HycoSolver s, Mat Bt, Mat B, PetscReal S[])
{
  HycoStiffness *f = &s->stiffness;
  const size_t entries = (size_t)f->n * (size_t)s->system->m;
  const PetscScalar *b, *bt;
  const PetscReal one = 1, zero = 0;
  PetscBLASInt m, n = f->n, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(s->system->m, &m));
  /* Grows only: reduced models solve thousands of systems of the same size. */
  if (f->room < entries) {
    PetscCall(PetscFree(f->X));
    PetscCall(PetscMalloc1(entries, &f->X));
    f->room = entries;
  }
  PetscCall(MatDenseGetArrayRead(Bt, &bt));
  PetscCall(PetscArraycpy(f->X, bt, entries));
  LAPACKgetrs_("N", &n, &m, f->lu, &n, f->ipiv, f->X, &n, &info);
  if (f->refined) PetscCall(RefineDense(s, m, bt, NULL, f->X));
  PetscCall(MatDenseRestoreArrayRead(Bt, &bt));
  PetscCall(MatDenseGetArrayRead(B, &b));
  if (f->refined)
    RefineProduct(s, b, f->X, S);
  else
    BLASgemm_("N", "N", &m, &m, &n, &one, b, &m, f->X, &n, &zero, S, &m);
  PetscCall(MatDenseRestoreArrayRead(B, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 r by the current factor; with refinement if it is switched on. */
PetscErrorCode HycoStiffnessSolve(HycoSolver s, Vec r, Vec x)
{
  HycoStiffness *f = &s->stiffness;
  const PetscScalar *b;
  PetscScalar *v;
  PetscBLASInt one = 1, info;

  PetscFunctionBegin;
  /* Sparse: MUMPS refines by itself. */
  if (!f->lu) {
    PetscCall(HycoDirectSolve(f->direct, r, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecCopy(r, x));
  PetscCall(VecGetArray(x, &v));
  LAPACKgetrs_("N", &f->n, &one, f->lu, &f->n, f->ipiv, v, &f->n, &info);
  if (f->refined) {
    PetscCall(VecGetArrayRead(r, &b));
    PetscCall(RefineDense(s, 1, b, NULL, v));
    PetscCall(VecRestoreArrayRead(r, &b));
  }
  PetscCall(VecRestoreArray(x, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x for F - Bt L, whose low part is kept: the difference of large forces decides. */
PetscErrorCode HycoStiffnessRefine(HycoSolver s, const PetscReal L[], Vec x)
{
  HycoSystem y = s->system;
  const size_t n = (size_t)s->stiffness.n;
  const PetscScalar *F, *bt = NULL;
  PetscScalar *v;
  PetscReal *b, *low;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &b, n, &low));
  PetscCall(MatDenseGetArrayRead(y->Bt, &bt));
  PetscCall(VecGetArrayRead(y->F, &F));
  for (size_t i = 0; i < n; i++) {
    /* F - Bt L as an unevaluated sum of two doubles. */
    PetscReal sum[2] = {F[i], 0};

    for (size_t k = 0; k < (size_t)y->m; k++) HycoAddProduct(-bt[k * n + i], L[k], sum);
    b[i] = sum[0];
    low[i] = sum[1];
  }
  PetscCall(VecRestoreArrayRead(y->F, &F));
  PetscCall(MatDenseRestoreArrayRead(y->Bt, &bt));
  PetscCall(VecGetArray(x, &v));
  PetscCall(RefineDense(s, 1, b, low, v));
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(PetscFree2(b, low));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step of refinement if the residual is large: costs one solve, and mostly none. */
PetscErrorCode HycoStiffnessCorrect(HycoSolver s, Vec L, Vec x)
{
  HycoSystem y = s->system;
  Vec r, Kx;
  PetscReal size, residual;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  r = y->work_x[0];
  Kx = y->work_x[1];
  PetscCall(VecNorm(y->F, NORM_2, &size));
  if (L) {
    PetscCall(MatMult(y->Bt, L, r));
    PetscCall(VecAYPX(r, -1, y->F));
  } else
    PetscCall(VecCopy(y->F, r));
  PetscCall(MatMult(y->K, x, Kx));
  PetscCall(VecAXPY(r, -1, Kx));
  PetscCall(VecNorm(r, NORM_2, &residual));
  /* Mostly here. One step suffices, since the factor is that of K itself, with round-off as its only error. */
  if (residual <= REFINE * size) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoStiffnessSolve(s, r, Kx));
  PetscCall(VecAXPY(x, 1, Kx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the factor while K and B are the same objects in the same state; *singular is no error. Collective. */
PetscErrorCode HycoStiffnessFactor(HycoSolver s, Mat Bt, Mat B, PetscReal S[], PetscBool *singular)
{
  HycoStiffness *f = &s->stiffness;
  Mat K = s->system->K;
  PetscBool same, dense, dense_B = PETSC_TRUE;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoOperatorStateUpdate(&f->of, K, B, &same));
  if (same && !f->lu) PetscCall(HycoNameLinear(s, NULL));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  f->of.K = 0; /* invalid until completed */
  f->made++;
  PetscCall(PetscObjectTypeCompare((PetscObject)K, MATSEQDENSE, &dense));
  if (!dense)
    HycoLogged(HYCO_EVENT_FACTOR, FactorSparse(s, Bt, B, S, singular));
  else {
    if (B) PetscCall(PetscObjectTypeCompare((PetscObject)B, MATSEQDENSE, &dense_B));
    PetscCheck(dense_B, PETSC_COMM_SELF, PETSC_ERR_SUP, "a dense K needs a dense B");
    HycoLogged(HYCO_EVENT_FACTOR, FactorDense(f, K, singular));
    /* For a sparse K the Schur complement comes with the factor. */
    if (B && !*singular) HycoLogged(HYCO_EVENT_FACTOR, HycoStiffnessCondense(s, Bt, B, S));
  }
  /* Only a complete factor is marked as that of K. */
  if (!*singular) PetscCall(HycoOperatorStateUpdate(&f->of, K, B, &same));
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}
