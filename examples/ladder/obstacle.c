/*
  hyco's complementarity methods in a program without a contact system: a membrane over a hemisphere psi, -laplace u >=
  0 and u >= psi, one of them an equation, by five points on a square. TAO takes a function, its gradient, its Hessian
  and bounds; -tao_type chooses the method: hyco_active_set (default), hyco_lemke, or one of TAO's (tron, gpcg).

      mpiexec -n 2 build/ladder/obstacle -n 65 -tao_monitor
  The solution is the hemisphere up to a radius a, and A log(2 / r) from there, where a^2 (1 + log(2 / a)) = 1 and
  A = a^2 / sqrt(1 - a^2) make value and slope continuous; on the border it is given. -ceiling bounds u from above too.
*/
#include <hyco.h>
#include <petsctao.h>

enum { B, LO, HI, EXACT, N_VECS };

typedef struct {
  PetscInt n;  /* n x n inner nodes */
  PetscReal a; /* radius of the contact */
  Mat A;       /* f(u) = u.A u / 2 - b.u, times h^2 */
  Vec *v;
} Membrane;

static PetscReal Radius(const Membrane *m, PetscInt i, PetscInt j)
{
  const PetscReal h = 4. / (m->n + 1), x = (i + 1) * h - 2, y = (j + 1) * h - 2;
  return PetscSqrtReal(x * x + y * y);
}

static PetscReal Exact(const Membrane *m, PetscReal r)
{
  return r < m->a ? PetscSqrtReal(1 - r * r) : m->a * m->a / PetscSqrtReal(1 - m->a * m->a) * PetscLogReal(2 / r);
}

static PetscErrorCode Row(const Membrane *m, PetscInt row, PetscReal ceiling)
{
  const PetscInt n = m->n, i = row % n, j = row / n;
  const PetscReal r = Radius(m, i, j), psi = r < 1 ? PetscSqrtReal(1 - r * r) : -10; /* a bound, which lemke needs */
  PetscScalar b = 0;

  PetscFunctionBeginUser;
  PetscCall(MatSetValue(m->A, row, row, 4, INSERT_VALUES));
  for (int side = 0; side < 4; side++) {
    const PetscInt x = i + (side == 0) - (side == 1), y = j + (side == 2) - (side == 3);

    if (x < 0 || y < 0 || x == n || y == n)
      b += Exact(m, Radius(m, x, y));
    else
      PetscCall(MatSetValue(m->A, row, y * n + x, -1, INSERT_VALUES));
  }
  PetscCall(VecSetValue(m->v[B], row, b, INSERT_VALUES));
  PetscCall(VecSetValue(m->v[LO], row, PetscMin(psi, ceiling), INSERT_VALUES));
  PetscCall(VecSetValue(m->v[HI], row, ceiling, INSERT_VALUES));
  PetscCall(VecSetValue(m->v[EXACT], row, Exact(m, r), INSERT_VALUES));
  PetscFunctionReturn(0);
}

static PetscErrorCode Assemble(Membrane *m, PetscReal ceiling, Vec *u)
{
  PetscInt first, last;

  PetscFunctionBeginUser;
  m->a = 0.5;
  for (int k = 0; k < 60; k++) m->a = 1 / PetscSqrtReal(1 + PetscLogReal(2 / m->a)); /* a contraction */
  PetscCall(
      MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, m->n * m->n, m->n * m->n, 5, NULL, 4, NULL, &m->A));
  PetscCall(MatCreateVecs(m->A, u, NULL));
  PetscCall(VecDuplicateVecs(*u, N_VECS, &m->v));
  PetscCall(MatGetOwnershipRange(m->A, &first, &last));
  for (PetscInt row = first; row < last; row++) PetscCall(Row(m, row, ceiling));
  PetscCall(MatAssemblyBegin(m->A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(m->A, MAT_FINAL_ASSEMBLY));
  for (int k = 0; k < N_VECS; k++) {
    PetscCall(VecAssemblyBegin(m->v[k]));
    PetscCall(VecAssemblyEnd(m->v[k]));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Objective(Tao tao, Vec u, PetscReal *f, Vec gradient, void *ctx)
{
  const Membrane *m = (const Membrane *)ctx;
  PetscScalar ug, ub;

  PetscFunctionBeginUser;
  (void)tao;
  PetscCall(MatMult(m->A, u, gradient));
  PetscCall(VecAXPY(gradient, -1, m->v[B]));
  PetscCall(VecDot(u, gradient, &ug));
  PetscCall(VecDot(u, m->v[B], &ub));
  *f = (ug - ub) / 2;
  PetscFunctionReturn(0);
}

static PetscErrorCode Hessian(Tao tao, Vec u, Mat H, Mat P, void *ctx)
{
  PetscFunctionBeginUser;
  (void)tao, (void)u, (void)H, (void)P, (void)ctx; /* constant */
  PetscFunctionReturn(0);
}

/* The conditions of the solution, recomputed: the largest distance of u to median(lo, u - (A u - b), hi). */
static PetscErrorCode Report(Tao tao, Membrane *m, Vec u)
{
  PetscReal f, residual, error;
  TaoConvergedReason reason;
  PetscInt its;
  Vec w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(u, &w));
  PetscCall(Objective(tao, u, &f, w, m));
  PetscCall(VecAYPX(w, -1, u));
  PetscCall(VecMedian(m->v[LO], w, m->v[HI], w));
  PetscCall(VecAXPY(w, -1, u));
  PetscCall(VecNorm(w, NORM_INFINITY, &residual));
  PetscCall(VecWAXPY(w, -1, m->v[EXACT], u));
  PetscCall(VecNorm(w, NORM_INFINITY, &error));
  PetscCall(VecDestroy(&w));
  PetscCall(TaoGetSolutionStatus(tao, &its, NULL, NULL, NULL, NULL, &reason));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: %d iterations, energy %.12g, residual %.1e, error %.3g\n",
                        TaoConvergedReasons[reason], (int)its, (double)f, (double)residual, (double)error));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  Membrane m = {.n = 33};
  PetscReal ceiling = PETSC_INFINITY;
  Vec u;
  Tao tao;

  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &m.n, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-ceiling", &ceiling, NULL));
  PetscCall(Assemble(&m, ceiling, &u));
  PetscCall(TaoCreate(PETSC_COMM_WORLD, &tao));
  PetscCall(TaoSetType(tao, HYCO_TAO_ACTIVE_SET));
  PetscCall(TaoSetSolution(tao, u));
  PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Objective, &m));
  PetscCall(TaoSetHessian(tao, m.A, m.A, Hessian, NULL));
  PetscCall(TaoSetVariableBounds(tao, m.v[LO], m.v[HI]));
  PetscCall(TaoSetTolerances(tao, 1e-10, 0, 0));
  PetscCall(TaoSetFromOptions(tao));
  PetscCall(TaoSolve(tao));
  PetscCall(Report(tao, &m, u));
  PetscCall(TaoDestroy(&tao));
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroyVecs(N_VECS, &m.v));
  PetscCall(MatDestroy(&m.A));
  return (int)HycoFinalize();
}
