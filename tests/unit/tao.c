/* hyco's types of Tao on problems of a Tao alone: any bounds, matrices, ranks; f not quadratic; no objective; refusals.
 */
#include "check.h"
#include <petsctao.h>

/* f(x) = x.H x / 2 - b.x + cubic sum |x_i|^3 / 3: convex if H is positive definite. */
typedef struct {
  Mat H, J; /* J: what the Tao has, H + its diagonal */
  Vec b, x, lo, hi;
  PetscReal cubic;
} Problem;

static PetscErrorCode Gradient(Tao tao, Vec x, Vec g, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  Vec cubes;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(p->H, x, g));
  PetscCall(VecAXPY(g, -1, p->b));
  PetscCall(VecDuplicate(x, &cubes));
  PetscCall(VecCopy(x, cubes));
  PetscCall(VecAbs(cubes));
  PetscCall(VecPointwiseMult(cubes, cubes, x));
  PetscCall(VecAXPY(g, p->cubic, cubes));
  PetscCall(VecDestroy(&cubes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Objective(Tao tao, Vec x, PetscReal *f, Vec g, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  PetscReal xg, xb, norm, cubes = 0, sum;
  const PetscScalar *a;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(Gradient(tao, x, g, ctx));
  PetscCall(VecDot(x, g, &xg));
  PetscCall(VecDot(x, p->b, &xb));
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(x, &a));
  for (PetscInt i = 0; i < n; i++) cubes += PetscPowReal(PetscAbsReal(a[i]), 3);
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscCallMPI(MPI_Allreduce(&cubes, &sum, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(VecNorm(x, NORM_2, &norm));    /* collective, unless it is cached: the same on every rank */
  *f = (xg - xb) / 2 - p->cubic * sum / 6; /* x.g = x.H x - b.x + cubic sum |x|^3 */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Hessian(Tao tao, Vec x, Mat J, Mat P, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  Vec diagonal;

  PetscFunctionBegin;
  (void)tao, (void)P;
  if (p->cubic == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCopy(p->H, J, SAME_NONZERO_PATTERN));
  PetscCall(VecDuplicate(x, &diagonal));
  PetscCall(VecCopy(x, diagonal));
  PetscCall(VecAbs(diagonal));
  PetscCall(VecScale(diagonal, 2 * p->cubic));
  PetscCall(MatDiagonalSet(J, diagonal, ADD_VALUES));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H = R R^T + shift I + skew (S - S^T) of order n, the same on any number of ranks; lo and hi by unknown: both, one, or
   none, or equal ones. `sparse`: AIJ, else dense. */
static PetscErrorCode Create(PetscInt n, PetscReal shift, PetscReal skew, PetscBool sparse, Problem *p)
{
  unsigned long long state = 5 + (unsigned long long)n;
  PetscReal *R, *S;
  PetscInt first, last;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * n, &R, n * n, &S));
  for (PetscInt k = 0; k < n * n; k++) R[k] = Draw(&state) / PetscSqrtReal(n);
  for (PetscInt k = 0; k < n * n; k++) S[k] = Draw(&state) / PetscSqrtReal(n);
  if (sparse)
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, n, NULL, n, NULL, &p->H));
  else
    PetscCall(MatCreateDense(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, NULL, &p->H));
  PetscCall(MatCreateVecs(p->H, &p->x, &p->b));
  PetscCall(VecDuplicate(p->x, &p->lo));
  PetscCall(VecDuplicate(p->x, &p->hi));
  PetscCall(MatGetOwnershipRange(p->H, &first, &last));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal b = 2 * Draw(&state), width = i % 5 == 4 ? 0 : 0.2;

    for (PetscInt j = 0; j < n && i >= first && i < last; j++) {
      PetscScalar value = i == j ? shift : skew * (S[i * n + j] - S[j * n + i]);

      for (PetscInt k = 0; k < n; k++) value += R[i * n + k] * R[j * n + k];
      PetscCall(MatSetValue(p->H, i, j, value, INSERT_VALUES));
    }
    if (i < first || i >= last) continue;
    PetscCall(VecSetValue(p->b, i, b, INSERT_VALUES));
    PetscCall(VecSetValue(p->lo, i, i % 3 == 2 ? PETSC_NINFINITY : -width, INSERT_VALUES));
    PetscCall(VecSetValue(p->hi, i, i % 4 == 3 ? PETSC_INFINITY : width, INSERT_VALUES));
  }
  PetscCall(PetscFree2(R, S));
  PetscCall(MatAssemblyBegin(p->H, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(p->H, MAT_FINAL_ASSEMBLY));
  PetscCall(VecAssemblyBegin(p->b));
  PetscCall(VecAssemblyEnd(p->b));
  PetscCall(VecAssemblyBegin(p->lo));
  PetscCall(VecAssemblyEnd(p->lo));
  PetscCall(VecAssemblyBegin(p->hi));
  PetscCall(VecAssemblyEnd(p->hi));
  PetscCall(MatDuplicate(p->H, MAT_COPY_VALUES, &p->J));
  p->cubic = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(Problem *p)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&p->H));
  PetscCall(MatDestroy(&p->J));
  PetscCall(VecDestroy(&p->b));
  PetscCall(VecDestroy(&p->x));
  PetscCall(VecDestroy(&p->lo));
  PetscCall(VecDestroy(&p->hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Multiply(Mat shell, Vec x, Vec y)
{
  Mat H;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(shell, &H));
  PetscCall(MatMult(H, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Bounds(Tao tao, Vec lo, Vec hi, void *ctx)
{
  const Problem *p = (const Problem *)ctx;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(VecCopy(p->lo, lo));
  PetscCall(VecCopy(p->hi, hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A Tao of that type for the problem, in which the bounds come from vectors or a routine. */
static PetscErrorCode CreateTao(Problem *p, const char type[], PetscBool objective, PetscBool routine, Tao *tao)
{
  PetscFunctionBegin;
  PetscCall(TaoCreate(PETSC_COMM_WORLD, tao));
  PetscCall(TaoSetType(*tao, type));
  PetscCall(TaoSetSolution(*tao, p->x));
  if (objective)
    PetscCall(TaoSetObjectiveAndGradient(*tao, NULL, Objective, p));
  else
    PetscCall(TaoSetGradient(*tao, NULL, Gradient, p));
  PetscCall(TaoSetHessian(*tao, p->J, p->J, Hessian, p));
  if (routine)
    PetscCall(TaoSetVariableBoundsRoutine(*tao, Bounds, p));
  else
    PetscCall(TaoSetVariableBounds(*tao, p->lo, p->hi));
  PetscCall(TaoSetTolerances(*tao, 1e-11, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |x - median(lo, x - g(x), hi)|, recomputed. */
static PetscErrorCode Residual(Problem *p, PetscReal *size)
{
  Vec g;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(p->x, &g));
  PetscCall(Gradient(NULL, p->x, g, p));
  PetscCall(VecAYPX(g, -1, p->x));
  PetscCall(VecMedian(p->lo, g, p->hi, g));
  PetscCall(VecAXPY(g, -1, p->x));
  PetscCall(VecNorm(g, NORM_INFINITY, size));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(Problem *p, const char what[], const char type[], PetscBool objective, PetscReal start)
{
  TaoConvergedReason reason;
  PetscReal residual;
  PetscInt its;
  Tao tao;

  PetscFunctionBegin;
  PetscCall(CreateTao(p, type, objective, (PetscBool)(start != 0), &tao));
  PetscCall(VecSet(p->x, start));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetConvergedReason(tao, &reason));
  PetscCall(TaoGetIterationNumber(tao, &its));
  PetscCall(Residual(p, &residual));
  CHECK(reason > 0 && residual <= 1e-10, "%s by %s: reason %d, residual %g", what, type, (int)reason, residual);
  CHECK(its <= 60, "%s by %s: %d sets", what, type, (int)its);
  PetscCall(VecSet(p->x, start)); /* again by the same Tao */
  PetscCall(TaoSolve(tao));
  PetscCall(Residual(p, &residual));
  CHECK(residual <= 1e-10, "%s by %s, again: residual %g", what, type, residual);
  PetscCall(TaoDestroy(&tao));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Problems with bounds on both sides, convex and nonsymmetric, dense and sparse. */
static PetscErrorCode TestBoxes(void)
{
  const PetscInt sizes[] = {1, 2, 7, 40};

  PetscFunctionBegin;
  for (int k = 0; k < 16; k++) {
    const PetscBool sparse = (PetscBool)(k & 1), skew = (PetscBool)(k & 2);
    Problem p;

    PetscCall(Create(sizes[k / 4], 0.1, skew ? 1 : 0, sparse, &p));
    PetscCall(Solve(&p, skew ? "nonsymmetric" : "convex", HYCO_TAO_ACTIVE_SET, (PetscBool)!skew, 0));
    PetscCall(Solve(&p, skew ? "nonsymmetric" : "convex", HYCO_TAO_ACTIVE_SET, PETSC_FALSE, 3));
    p.cubic = skew ? 0 : 5;
    if (!skew) PetscCall(Solve(&p, "not quadratic", HYCO_TAO_ACTIVE_SET, PETSC_TRUE, 3));
    p.cubic = 0;
    PetscCall(MatCopy(p.H, p.J, SAME_NONZERO_PATTERN));
    PetscCall(VecSet(p.lo, -0.1));
    PetscCall(VecSet(p.hi, PETSC_INFINITY));
    PetscCall(Solve(&p, skew ? "nonsymmetric, lower bounds" : "lower bounds", HYCO_TAO_LEMKE, (PetscBool)!skew, 0));
    PetscCall(Destroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A Hessian without entries; a Tao without bounds; a solution at the start. */
static PetscErrorCode TestOthers(void)
{
  PetscInt n;
  Problem p;
  Mat shell;
  PetscReal residual;
  Tao tao;

  PetscFunctionBegin;
  PetscCall(Create(40, 0.1, 0, PETSC_TRUE, &p));
  PetscCall(VecGetLocalSize(p.x, &n));
  PetscCall(MatCreateShell(PETSC_COMM_WORLD, n, n, 40, 40, p.H, &shell));
  PetscCall(MatShellSetOperation(shell, MATOP_MULT, (void (*)(void))Multiply));
  PetscCall(MatDestroy(&p.J));
  p.J = shell;
  PetscCall(Solve(&p, "without entries", HYCO_TAO_ACTIVE_SET, PETSC_TRUE, 0));
  PetscCall(VecSet(p.lo, PETSC_NINFINITY));
  PetscCall(VecSet(p.hi, PETSC_INFINITY));
  PetscCall(TaoCreate(PETSC_COMM_WORLD, &tao));
  PetscCall(TaoSetType(tao, HYCO_TAO_ACTIVE_SET));
  PetscCall(TaoSetSolution(tao, p.x));
  PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Objective, &p));
  CHECK_FAILS(TaoSolve(tao), "TaoSetHessian()");
  PetscCall(TaoSetHessian(tao, p.H, p.H, Hessian, &p));
  PetscCall(TaoSolve(tao));
  PetscCall(Residual(&p, &residual));
  CHECK(residual <= 1e-10, "without bounds: residual %g", residual);
  PetscCall(TaoSetTolerances(tao, 1e-9, 0, 0));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetIterationNumber(tao, &n));
  CHECK(n == 0, "from the solution: %d iterations", (int)n);
  PetscCall(TaoDestroy(&tao));
  PetscCall(Destroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No solution: min -x (H = 0); the set of the free unknowns is singular. A limit of iterations. Bounds that a type does
   not take. */
static PetscErrorCode TestFailures(void)
{
  TaoConvergedReason reason;
  Problem p;
  Tao tao;

  PetscFunctionBegin;
  PetscCall(Create(7, 0.1, 0, PETSC_TRUE, &p));
  PetscCall(CreateTao(&p, HYCO_TAO_LEMKE, PETSC_TRUE, PETSC_FALSE, &tao));
  CHECK_FAILS(TaoSolve(tao), HYCO_TAO_ACTIVE_SET);
  PetscCall(TaoSetType(tao, HYCO_TAO_ACTIVE_SET));
  PetscCall(TaoSetMaximumIterations(tao, 1));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetConvergedReason(tao, &reason));
  CHECK(reason == TAO_DIVERGED_MAXITS, "one iteration: reason %d", (int)reason);
  PetscCall(TaoDestroy(&tao));
  PetscCall(MatZeroEntries(p.H));
  PetscCall(MatZeroEntries(p.J));
  PetscCall(VecSet(p.b, 1));
  PetscCall(VecSet(p.lo, 0));
  PetscCall(VecSet(p.hi, PETSC_INFINITY));
  for (int k = 0; k < 2; k++) {
    PetscCall(CreateTao(&p, k ? HYCO_TAO_LEMKE : HYCO_TAO_ACTIVE_SET, PETSC_TRUE, PETSC_FALSE, &tao));
    PetscCall(VecSet(p.x, 0));
    PetscCall(TaoSolve(tao));
    PetscCall(TaoGetConvergedReason(tao, &reason));
    CHECK(reason < 0, "unbounded: reason %d", (int)reason);
    PetscCall(TaoDestroy(&tao));
  }
  PetscCall(Destroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestBoxes());
  PetscCall(TestOthers());
  PetscCall(TestFailures());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
