/*
  The dual form without its matrix: S v = B K^-1 Bt v, one solve with K's factor for each product. TAO's
  bound-constrained types need no more. For so many contacts that S would not fit, on any number of ranks.
*/
#include <hycosolverimpl.h>

typedef struct {
  HycoSolver s;
  Vec force, motion; /* of K's unknowns */
  Vec diagonal;      /* an estimate of S's */
} Free;

static PetscErrorCode MultS(Mat S, Vec v, Vec Sv)
{
  Free *f;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(S, &f));
  PetscCall(MatMult(f->s->system->Bt, v, f->force));
  PetscCall(HycoDirectSolve(f->s->direct_free, f->force, f->motion));
  PetscCall(MatMult(f->s->system->B, f->motion, Sv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DiagonalS(Mat S, Vec d)
{
  Free *f;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(S, &f));
  PetscCall(VecCopy(f->diagonal, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal of B diag(K)^-1 B^T, which knows the units of each contact. */
static PetscErrorCode LocalDiagonal(HycoSystem y, Vec d)
{
  Mat scaled;
  Vec inverse;
  PetscScalar *out;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y->F, &inverse));
  PetscCall(MatGetDiagonal(y->K, inverse));
  PetscCall(VecReciprocal(inverse));
  PetscCall(MatDuplicate(y->B, MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, NULL, inverse));
  PetscCall(VecGetOwnershipRange(d, &lo, &hi));
  PetscCall(VecGetArray(d, &out));
  for (PetscInt r = lo; r < hi; r++) {
    PetscInt n;
    const PetscScalar *a, *b;

    PetscCall(MatGetRow(y->B, r, &n, NULL, &a));
    PetscCall(MatGetRow(scaled, r, &n, NULL, &b));
    out[r - lo] = 0;
    for (PetscInt k = 0; k < n; k++) out[r - lo] += a[k] * b[k];
    PetscCall(MatRestoreRow(scaled, r, &n, NULL, &b));
    PetscCall(MatRestoreRow(y->B, r, &n, NULL, &a));
  }
  PetscCall(VecRestoreArray(d, &out));
  PetscCall(MatDestroy(&scaled));
  PetscCall(VecDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* That diagonal d times the mean of v_i (S v)_i / d_i over v_i = +-1, about trace(S) / trace(d): one product. */
static PetscErrorCode EstimateDiagonal(Mat S, Free *f)
{
  Vec v, Sv;
  PetscScalar *p;
  PetscScalar ratio;
  PetscReal sum;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(LocalDiagonal(f->s->system, f->diagonal));
  PetscCall(VecDuplicate(f->diagonal, &v));
  PetscCall(VecDuplicate(f->diagonal, &Sv));
  PetscCall(VecGetOwnershipRange(v, &lo, &hi));
  PetscCall(VecGetArray(v, &p));
  for (PetscInt i = lo; i < hi; i++) /* signs without pattern, the same on any number of ranks */
    p[i - lo] = HycoHash(HYCO_HASH_START, &i, sizeof(i)) >> 32 & 1 ? 1 : -1;
  PetscCall(VecRestoreArray(v, &p));
  PetscCall(MatMult(S, v, Sv));
  PetscCall(VecDot(v, Sv, &ratio));
  PetscCall(VecNorm(f->diagonal, NORM_1, &sum));
  if (ratio > 0 && sum > 0) PetscCall(VecScale(f->diagonal, ratio / sum));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Sv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Factor(HycoSolver s, PetscBool *singular)
{
  Mat K = s->system->K;
  PetscBool same;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoOperatorStateUpdate(&s->factored_free, K, NULL, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  if (!s->direct_free) PetscCall(HycoDirectCreate(HycoComm(s), &s->direct_free));
  PetscCall(HycoDirectAnalyse(s->direct_free, K, NULL, NULL, s->system->symmetric, &s->bytes));
  PetscCall(HycoDirectFactor(s->direct_free, K, NULL, NULL, NULL, singular));
  if (*singular) s->factored_free.K = 0;
  PetscCall(HycoNameLinear(s, NULL));
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L from min 1/2 L^T S L + g^T L, L >= 0, with g = D - B K^-1 F. */
static PetscErrorCode Forces(HycoSolver s, Mat S, Vec x, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  Vec f, lo, hi;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(L, &f));
  PetscCall(VecDuplicate(L, &lo));
  PetscCall(VecDuplicate(L, &hi));
  PetscCall(HycoDirectSolve(s->direct_free, y->F, x));
  PetscCall(MatMult(y->B, x, f));
  PetscCall(VecAXPY(f, -1, y->D));
  PetscCall(VecSet(lo, 0));
  PetscCall(VecSet(hi, PETSC_INFINITY));
  PetscCall(VecSet(L, 0));
  PetscCall(HycoTaoSolve(s->tao, s->max_its, S, f, lo, hi, L, &s->its, solved));
  PetscCall(VecPointwiseMax(L, L, lo)); /* lo is 0 in any scale */
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&lo));
  PetscCall(VecDestroy(&hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 (F - Bt L), refined once. */
static PetscErrorCode Displacements(HycoSolver s, Free *f, Vec x, Vec L)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  PetscCall(VecSet(x, 0));
  for (PetscInt k = 0; k < 2; k++) {
    Vec r = f->force, dx = f->motion;

    PetscCall(MatMult(y->Bt, L, r));
    PetscCall(MatMultAdd(y->K, x, r, r));
    PetscCall(VecAYPX(r, -1, y->F));
    PetscCall(HycoDirectSolve(s->direct_free, r, dx));
    PetscCall(VecAXPY(x, 1, dx));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolveDualFree(HycoSolver s, Vec x, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  Free f = {s, NULL, NULL, NULL};
  Mat S;
  PetscInt m, n_free;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(HycoKernelSize(y->K, &n_free));
  PetscCheck(!n_free, HycoComm(s), PETSC_ERR_USER,
             "contact alone holds a body, and the form dual_free cannot solve that; use -hyco_solver_type active_set");
  PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "tao %s dual_free", HycoTaoTypes[s->tao]));
  PetscCall(Factor(s, &singular));
  if (singular) {
    s->reason = HYCO_DIVERGED_SINGULAR;
    *solved = PETSC_FALSE;
    PetscCall(VecSet(x, 0));
    PetscCall(VecSet(L, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetLocalSize(L, &m));
  PetscCall(MatCreateShell(HycoComm(s), m, m, y->m, y->m, &f, &S));
  PetscCall(MatShellSetOperation(S, MATOP_MULT, (void (*)(void))MultS));
  PetscCall(MatShellSetOperation(S, MATOP_MULT_TRANSPOSE, (void (*)(void))MultS)); /* symmetric */
  PetscCall(MatShellSetOperation(S, MATOP_GET_DIAGONAL, (void (*)(void))DiagonalS));
  PetscCall(MatSetOption(S, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(VecDuplicate(y->F, &f.force));
  PetscCall(VecDuplicate(y->F, &f.motion));
  PetscCall(VecDuplicate(y->D, &f.diagonal));
  PetscCall(EstimateDiagonal(S, &f));
  PetscCall(Forces(s, S, x, L, solved));
  PetscCall(Displacements(s, &f, x, L));
  PetscCall(VecDestroy(&f.force));
  PetscCall(VecDestroy(&f.motion));
  PetscCall(VecDestroy(&f.diagonal));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}
