/*
  The dual form without its matrix: S v = B K^-1 Bt v, one solve with K's factor for each product, which is sufficient
  for TAO's bound-constrained types. For so many contacts that S would not fit in memory, on any number of ranks.
*/
#include <hycosolverimpl.h>

typedef struct {
  HycoSolver s;
  Vec force, motion; /* like K's unknowns */
  Vec diagonal;      /* an estimate of S's diagonal */
  HycoTao tao;
} Shell;

/* Only on request, for Tao types that need products alone. */
static PetscErrorCode DualShellAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                       char why[HYCO_LINE])
{
  const int traits = s->now.traits;
  PetscInt p = 0;

  PetscFunctionBegin;
  (void)form;
  *cost = -1;
  if (!asked || !s->system->K || !s->system->m || s->iterative) PetscFunctionReturn(PETSC_SUCCESS);
  /* From here on the form was asked for by name, so that what it cannot do is said, with an alternative. */
  PetscCall(HycoKernelSize(s->system->K, &p));
  if (traits & (HYCO_TAO_OWN | HYCO_TAO_DENSE))
    HycoFormat(why,
               "%s%s needs the matrix of the dual form; use -hyco_solver_form dual, or -hyco_solver_type tao with "
               "dual_free",
               traits & HYCO_TAO_OWN ? "" : "TAO's ", traits & HYCO_TAO_OWN ? s->now.word : s->now.type);
  else if (traits & HYCO_TAO_ENTRIES)
    HycoFormat(why, "TAO's %s reads the matrix of the dual form; use -hyco_solver_form dual", s->now.type);
  else if (!s->system->symmetric)
    HycoFormat(why, "the form dual_free needs a symmetric system; use -hyco_solver_form dual");
  else if (p)
    HycoFormat(
        why, "a body is held by contact only, which the form dual_free cannot solve; use -hyco_solver_type active_set");
  else
    *cost = 4;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One product: a multiplication by B^T, a solve, a multiplication by B. S = B K^-1 B^T is never formed: its m columns
   would be m solves. */
static PetscErrorCode MultS(Mat S, Vec v, Vec Sv)
{
  Shell *f;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(S, &f));
  PetscCall(MatMult(f->s->system->Bt, v, f->force));
  PetscCall(HycoStiffnessSolve(f->s, f->force, f->motion));
  PetscCall(MatMult(f->s->system->B, f->motion, Sv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An estimate is enough: it only scales TAO's unknowns. */
static PetscErrorCode DiagonalS(Mat S, Vec d)
{
  Shell *f;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(S, &f));
  PetscCall(VecCopy(f->diagonal, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal of B diag(K)^-1 B^T, which has the unit of each contact. Exact diagonals would need a solve per
   contact. */
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
  /* Columns of B over the diagonal of K. */
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
  HycoDestroyAll(&scaled, &inverse);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* That diagonal d times the mean of v_i (S v)_i / d_i over v_i = +-1, about trace(S) / trace(d): one product. TAO's
   types scale their problem by this diagonal. */
static PetscErrorCode EstimateDiagonal(Mat S, Shell *f)
{
  Vec v, Sv;
  PetscScalar *p;
  PetscScalar ratio;
  PetscReal sum;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(LocalDiagonal(f->s->system, f->diagonal));
  HycoVecDuplicate(f->diagonal, &v, &Sv);
  PetscCall(VecGetOwnershipRange(v, &lo, &hi));
  PetscCall(VecGetArray(v, &p));
  for (PetscInt i = lo; i < hi; i++) /* irregular signs, the same on any number of ranks */
    p[i - lo] = HycoHash(HYCO_HASH_START, &i, sizeof(i)) >> 32 & 1 ? 1 : -1;
  PetscCall(VecRestoreArray(v, &p));
  PetscCall(MatMult(S, v, Sv));
  PetscCall(VecDot(v, Sv, &ratio));
  PetscCall(VecNorm(f->diagonal, NORM_1, &sum));
  /* Otherwise the local diagonal alone serves: scaling needs orders of magnitude. */
  if (ratio > 0 && sum > 0) PetscCall(VecScale(f->diagonal, ratio / sum));
  HycoDestroyAll(&v, &Sv);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor alone, without Schur variables: S is never formed. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  PetscFunctionBegin;
  (void)form;
  PetscCall(HycoStiffnessFactor(s, NULL, NULL, NULL, singular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L from min 1/2 L^T S L + g^T L, L >= 0, with g = D - B K^-1 F. Bound-constrained quadratic problem; S is symmetric
   here. */
static PetscErrorCode DualShellForces(const Shell *p, Mat S, Vec x, Vec L, PetscBool *solved)
{
  HycoSolver s = p->s;
  HycoSystem y = s->system;
  Vec f, lo, hi;

  PetscFunctionBegin;
  HycoVecDuplicate(L, &f, &lo, &hi);
  PetscCall(HycoStiffnessSolve(s, y->F, x));
  PetscCall(MatMult(y->B, x, f));
  /* f = B K^-1 F - D: the penetration without contact, which the forces must close. */
  PetscCall(VecAXPY(f, -1, y->D));
  PetscCall(VecSet(lo, 0));
  PetscCall(VecSet(hi, PETSC_INFINITY));
  PetscCall(VecSet(L, 0));
  PetscCall(HycoTaoSetType(p->tao, s->now.type, s->max_its));
  PetscCall(HycoTaoSolve(p->tao, S, f, lo, hi, L, &s->its, solved));
  PetscCall(VecPointwiseMax(L, L, lo)); /* lo is 0 */
  HycoDestroyAll(&f, &lo, &hi);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 (F - Bt L), refined once. The second pass refines by the residual of the first one. */
static PetscErrorCode DualShellDisplacements(HycoSolver s, Shell *f, Vec x, Vec L)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  PetscCall(VecSet(x, 0));
  for (PetscInt k = 0; k < 2; k++) {
    Vec r = f->force, dx = f->motion;

    PetscCall(MatMult(y->Bt, L, r));
    /* In the first pass x = 0: the residual is the load itself. */
    PetscCall(MatMultAdd(y->K, x, r, r));
    PetscCall(VecAYPX(r, -1, y->F));
    PetscCall(HycoStiffnessSolve(s, r, dx));
    PetscCall(VecAXPY(x, 1, dx));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor is kept; vectors and the shell are of this solve. */
static PetscErrorCode DualShellSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Shell *f = (Shell *)form->data;
  HycoSystem y = s->system;
  Mat S;
  PetscInt m;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(HycoSolverNameMethod(s, "dual_free"));
  PetscCall(SetUp(s, form, &singular));
  if (singular) {
    PetscCall(HycoSolverGiveUp(s, x, L));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetLocalSize(L, &m));
  PetscCall(MatCreateShell(HycoComm(s), m, m, y->m, y->m, f, &S));
  PetscCall(MatShellSetOperation(S, MATOP_MULT, (void (*)(void))MultS));
  PetscCall(MatShellSetOperation(S, MATOP_MULT_TRANSPOSE, (void (*)(void))MultS)); /* S is symmetric */
  PetscCall(MatShellSetOperation(S, MATOP_GET_DIAGONAL, (void (*)(void))DiagonalS));
  /* TAO's Newton types take conjugate gradients then. */
  PetscCall(MatSetOption(S, MAT_SYMMETRIC, PETSC_TRUE));
  HycoVecDuplicate(y->F, &f->force, &f->motion);
  PetscCall(VecDuplicate(y->D, &f->diagonal));
  PetscCall(EstimateDiagonal(S, f));
  PetscCall(DualShellForces(f, S, x, L, solved));
  PetscCall(DualShellDisplacements(s, f, x, L));
  HycoDestroyAll(&f->force, &f->motion, &f->diagonal, &S);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DualShellDestroy(HycoSolverForm form)
{
  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&((Shell *)form->data)->tao));
  PetscCall(PetscFree(form->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L is distributed here, in contrast to the dual form, and so is its Tao object. */
PetscErrorCode HycoSolverFormCreate_Shell(HycoSolver s, HycoSolverForm form)
{
  Shell *f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&f));
  f->s = s;
  PetscCall(HycoTaoCreate(HycoComm(s), (PetscObject)s, &f->tao));
  form->data = f;
  *form->ops = (struct _HycoSolverFormOps){
      .accepts = DualShellAccepts, .setup = SetUp, .solve = DualShellSolve, .destroy = DualShellDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
