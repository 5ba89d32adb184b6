/* Cones that a program registers: a Tresca threshold and Coulomb's law, in systems with closed-form and random answers,
   checked by the natural map and by a projected gradient method of this file. */
#include "check.h"
#include <hyco.h>
#include <math.h>
#include <petsctao.h>

/* -- the types, by public functions only -- */

/* The radius of the admissible tangential forces: the threshold, or the coefficient times the normal force; its
   derivative by y_n. */
static PetscReal Radius(HycoCone cone, const PetscReal data[], PetscReal y_n, PetscReal *slope)
{
  HycoConeType type;

  *slope = 0;
  if (HycoConeGetType(cone, &type)) return NAN;
  *slope = strcmp(type, "coulomb") == 0 && y_n > 0 ? data[0] : 0;
  return strcmp(type, "coulomb") == 0 ? data[0] * PetscMax(y_n, 0) : data[0];
}

static PetscReal Length(PetscInt size, const PetscReal y[])
{
  PetscReal sum = 0;

  for (PetscInt i = 1; i < size; i++) sum += y[i] * y[i];
  return PetscSqrtReal(sum);
}

static PetscErrorCode Project(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal z[])
{
  PetscInt size;
  PetscReal slope, radius = Radius(cone, data, y[0], &slope), length;

  PetscFunctionBegin;
  PetscCall(HycoConeGetSize(cone, &size));
  length = Length(size, y);
  z[0] = y[0] < 0 ? 0 : y[0];
  for (PetscInt i = 1; i < size; i++) z[i] = length <= radius ? y[i] : y[i] * radius / length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Derivative(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal J[])
{
  PetscInt size;
  PetscReal slope, radius = Radius(cone, data, y[0], &slope), length;

  PetscFunctionBegin;
  PetscCall(HycoConeGetSize(cone, &size));
  length = Length(size, y);
  PetscCall(PetscArrayzero(J, size * size));
  J[0] = y[0] > 0;
  for (PetscInt i = 1; i < size; i++) {
    const PetscBool stick = (PetscBool)(length < radius);

    if (!stick) J[i * size] = length > 0 ? slope * y[i] / length : 0;
    for (PetscInt j = 1; j < size; j++) {
      const PetscReal across = (i == j) - (length > 0 ? y[i] * y[j] / (length * length) : 0);

      J[i * size + j] = stick ? i == j : length > 0 && size > 2 ? radius / length * across : 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(HycoCone cone)
{
  const struct _HycoConeOps ops = {.project = Project, .derivative = Derivative};

  PetscFunctionBegin;
  PetscCall(HycoConeSetOps(cone, &ops, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeCone(const char type[], PetscInt size, HycoCone *cone)
{
  PetscFunctionBegin;
  PetscCall(HycoConeCreate(PETSC_COMM_WORLD, cone));
  PetscCall(HycoConeSetSize(*cone, size));
  PetscCall(HycoConeSetType(*cone, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- systems, given on every rank by arrays -- */

#define MOST 400 /* rows of a system */

typedef struct {
  PetscInt n, m, n_blocks; /* unknowns, rows, blocks */
  PetscReal *K, *B;        /* row by row: n x n, m x n */
  PetscReal F[MOST], D[MOST];
  PetscInt of[MOST], row[MOST + 1]; /* by block: its cone, its first row */
  PetscReal data[MOST];             /* by block; not used by nonnegative ones */
  PetscInt n_cones;
  HycoCone cone[3];
  /* hyco's */
  Mat K_, B_, Bt_;
  Vec F_, D_, x, L;
  PetscInt first, last; /* this rank's blocks */
  HycoSystem system;
} Case;

static PetscErrorCode Allocate(Case *c, PetscInt n, PetscInt m)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  c->n = n;
  c->m = m;
  PetscCall(PetscCalloc2(n * n, &c->K, m * n, &c->B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends a block. */
static PetscErrorCode AddBlock(Case *c, PetscInt cone, PetscReal value)
{
  PetscInt size;

  PetscFunctionBegin;
  PetscCall(HycoConeGetSize(c->cone[cone], &size));
  c->of[c->n_blocks] = cone;
  c->data[c->n_blocks] = value;
  c->row[c->n_blocks + 1] = c->row[c->n_blocks] + size;
  c->n_blocks++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cones with data on this rank's blocks, in their order. */
static PetscErrorCode SetBlocks(Case *c)
{
  PetscReal data[MOST];
  PetscInt count = 0;

  PetscFunctionBegin;
  for (PetscInt k = c->first; k < c->last; k++) {
    HycoConeType type;

    PetscCall(HycoConeGetType(c->cone[c->of[k]], &type));
    if (strcmp(type, HYCO_CONE_NONNEGATIVE) != 0) data[count++] = c->data[k];
  }
  PetscCall(HycoSystemSetBlocks(c->system, c->n_cones, c->cone, c->last - c->first, c->of + c->first, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The system; each rank has the rows of whole blocks. */
static PetscErrorCode Assemble(Case *c)
{
  PetscMPIInt rank, ranks;
  PetscInt rows, lo, hi;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  c->first = rank * c->n_blocks / ranks;
  c->last = (rank + 1) * c->n_blocks / ranks;
  rows = c->row[c->last] - c->row[c->first];
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, c->n, c->n, c->n, NULL, c->n, NULL, &c->K_));
  PetscCall(MatCreateVecs(c->K_, &c->x, &c->F_));
  PetscCall(MatGetOwnershipRange(c->K_, &lo, &hi));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, rows, hi - lo, c->m, c->n, c->n, NULL, c->n, NULL, &c->B_));
  PetscCall(MatCreateVecs(c->B_, NULL, &c->D_));
  PetscCall(VecDuplicate(c->D_, &c->L));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < c->n; j++) PetscCall(MatSetValue(c->K_, i, j, c->K[i * c->n + j], INSERT_VALUES));
    PetscCall(VecSetValue(c->F_, i, c->F[i], INSERT_VALUES));
  }
  for (PetscInt i = c->row[c->first]; i < c->row[c->last]; i++) {
    for (PetscInt j = 0; j < c->n; j++) PetscCall(MatSetValue(c->B_, i, j, c->B[i * c->n + j], INSERT_VALUES));
    PetscCall(VecSetValue(c->D_, i, c->D[i], INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(c->F_));
  PetscCall(VecAssemblyEnd(c->F_));
  PetscCall(VecAssemblyBegin(c->D_));
  PetscCall(VecAssemblyEnd(c->D_));
  PetscCall(MatAssemblyBegin(c->K_, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->K_, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(c->B_, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->B_, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(c->B_, MAT_INITIAL_MATRIX, &c->Bt_));
  PetscCall(HycoSystemCreate(PETSC_COMM_WORLD, &c->system));
  PetscCall(HycoSystemSetMatrices(c->system, c->K_, c->Bt_, c->B_, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(c->system, c->F_, c->D_));
  PetscCall(SetBlocks(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CaseDestroy(Case *c)
{
  PetscFunctionBegin;
  PetscCall(HycoSystemDestroy(&c->system));
  PetscCall(MatDestroy(&c->K_));
  PetscCall(MatDestroy(&c->B_));
  PetscCall(MatDestroy(&c->Bt_));
  PetscCall(VecDestroy(&c->F_));
  PetscCall(VecDestroy(&c->D_));
  PetscCall(VecDestroy(&c->x));
  PetscCall(VecDestroy(&c->L));
  for (PetscInt k = 0; k < c->n_cones; k++) PetscCall(HycoConeDestroy(&c->cone[k]));
  PetscCall(PetscFree2(c->K, c->B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole vector on every rank. */
static PetscErrorCode GetAll(Vec v, PetscReal all[])
{
  VecScatter scatter;
  Vec copy;
  const PetscScalar *a;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(v, &n));
  PetscCall(VecScatterCreateToAll(v, &scatter, &copy));
  PetscCall(VecScatterBegin(scatter, v, copy, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, v, copy, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(copy, &a));
  PetscCall(PetscArraycpy(all, a, n));
  PetscCall(VecRestoreArrayRead(copy, &a));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves by the type semismooth: x and L on every rank. */
static PetscErrorCode Solve(Case *c, HycoSolver solver, PetscReal x[], PetscReal L[], PetscInt *its)
{
  HycoReason reason;
  HycoKKT kkt;
  const char *method;

  PetscFunctionBegin;
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoSolverSetSystem(solver, c->system));
  PetscCall(HycoSolverSolve(solver, c->x, c->L));
  PetscCall(HycoSolverGetReason(solver, &reason));
  PetscCall(HycoSolverGetKKT(solver, &kkt));
  PetscCall(HycoSolverGetMethod(solver, &method));
  PetscCall(HycoSolverGetIterations(solver, its));
  CHECK(reason == HYCO_CONVERGED && strncmp(method, "semismooth dual", 15) == 0, "%s: %s", method,
        HycoReasonName(reason));
  CHECK(HycoKKTMax(&kkt) < 1e-10, "residual %g after %d iterations", (double)HycoKKTMax(&kkt), (int)*its);
  PetscCall(GetAll(c->x, x));
  PetscCall(GetAll(c->L, L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- closed forms -- */

/*
  Three contacts of a normal and dim - 1 tangential directions each, on unknowns of their own with the stiffnesses 2 and
  5, B = I, gaps 0.1, threshold 3: the first sticks (|f_t| = 2.5), the second slips (|f_t| = 5), the third is open. Stick:
  x = (0.1, 0), r = (f_n - 0.2, f_t). Slip: r_t = 3 f_t / |f_t|, x_t = (1 - 3 / |f_t|) f_t / 5. Open: r_n = 0, x_n = f_n / 2,
  and f_t = 0.
*/
static PetscErrorCode TestClosedForm(PetscInt dim)
{
  const PetscReal normal[3] = {4, 7, -1}, along[3][2] = {{1.5, 2}, {3, -4}, {0, 0}}, share = dim == 2 ? 0 : 1;
  PetscReal x[MOST], L[MOST], expected_x[9], expected_L[9];
  PetscInt its;
  HycoSolver solver;
  Case c;

  PetscFunctionBegin;
  PetscCall(Allocate(&c, 3 * dim, 3 * dim));
  c.n_cones = 1;
  PetscCall(MakeCone("tresca", dim, &c.cone[0]));
  for (PetscInt k = 0; k < 3; k++) {
    const PetscReal size = hypot(along[k][0], along[k][1]);

    PetscCall(AddBlock(&c, 0, 3));
    for (PetscInt i = 0; i < dim; i++) {
      const PetscInt r = k * dim + i;
      const PetscReal f_t = i == 0 ? 0 : share > 0 ? along[k][i - 1] : size, slip = size > 3 ? 3 / size : 1;

      c.K[r * c.n + r] = i ? 5 : 2;
      c.B[r * c.n + r] = 1;
      c.D[r] = i ? 0 : 0.1;
      c.F[r] = i ? f_t : normal[k];
      expected_L[r] = i ? slip * f_t : k < 2 ? normal[k] - 0.2 : 0;
      expected_x[r] = i ? (1 - slip) * f_t / 5 : k < 2 ? 0.1 : -0.5;
    }
  }
  PetscCall(Assemble(&c));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(Solve(&c, solver, x, L, &its));
  for (PetscInt i = 0; i < c.n; i++) {
    CHECK_NEAR(x[i], expected_x[i], 1e-14);
    CHECK_NEAR(L[i], expected_L[i], 1e-13);
  }
  for (PetscInt k = 0; k < 3; k++) c.data[k] = 10; /* all stick with a higher threshold */
  PetscCall(SetBlocks(&c));
  PetscCall(Solve(&c, solver, x, L, &its));
  for (PetscInt i = 1; i < dim; i++) CHECK_NEAR(x[dim + i], 0, 1e-14);
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block on a plane, pressed by 2 and pushed by 1, K = I: it slips with a coefficient of 0.3, r_t = 0.6, and sticks
   with 0.6. Its forces are not those without friction. */
static PetscErrorCode TestCoulomb(void)
{
  PetscReal x[MOST], L[MOST];
  PetscInt its;
  HycoSolver solver;
  Case c;

  PetscFunctionBegin;
  for (int stick = 0; stick < 2; stick++) {
    PetscCall(Allocate(&c, 2, 2));
    c.n_cones = 1;
    PetscCall(MakeCone("coulomb", 2, &c.cone[0]));
    PetscCall(AddBlock(&c, 0, stick ? 0.6 : 0.3));
    for (PetscInt i = 0; i < 2; i++) c.K[i * 2 + i] = c.B[i * 2 + i] = 1;
    c.F[0] = 2, c.F[1] = 1;
    PetscCall(Assemble(&c));
    PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
    PetscCall(Solve(&c, solver, x, L, &its));
    CHECK_NEAR(L[0], 2, 1e-14);
    CHECK_NEAR(L[1], stick ? 1 : 0.6, 1e-14);
    CHECK_NEAR(x[1], stick ? 0 : 0.4, 1e-14);
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(CaseDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the natural map, by hand -- */

/* One Tresca block of threshold 1, K = I, B = I, D = 0, at states that violate one condition each. */
static PetscErrorCode TestResiduals(void)
{
  /* x, L; penetration, adhesion, complementarity. l = |L|, d = |x| (1 without either). Row 1: w = -(1, 0), rho = 2,
     y = (2 + 2, 0): too little normal force by 2 = l. Row 2: |L_t| = 3 is 2 above the threshold, w = 0. Row 3: slip
     w_t = -0.5 with l/d = 2: y_t = 1 + 1, so that r_t = 1 is right. Row 4: the same with L_t = -1: y_t = 0, 1 off. */
  const PetscReal state[4][7] = {
      {1, 0, 2, 0, 1, 0, 1}, {0, 0, 1, 3, 0, 2. / 3, 2. / 3}, {0, 0.5, 1, 1, 0, 0, 0}, {0, 0.5, 1, -1, 0, 0, 1}};
  PetscMPIInt ranks;
  Case c;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  PetscCall(Allocate(&c, 2, 2));
  c.n_cones = 1;
  PetscCall(MakeCone("tresca", 2, &c.cone[0]));
  PetscCall(AddBlock(&c, 0, 1));
  for (PetscInt i = 0; i < 2; i++) c.K[i * 2 + i] = c.B[i * 2 + i] = 1;
  c.F[0] = c.F[1] = 1;
  PetscCall(Assemble(&c));
  for (int k = 0; k < 5; k++) {
    const PetscReal *s = state[PetscMin(k, 3)];
    HycoKKT kkt;

    for (PetscInt i = 0; i < 2; i++) {
      PetscCall(VecSetValue(c.x, i, s[i], INSERT_VALUES));
      PetscCall(VecSetValue(c.L, i, k == 4 ? NAN : s[2 + i], INSERT_VALUES));
    }
    PetscCall(VecAssemblyBegin(c.x));
    PetscCall(VecAssemblyEnd(c.x));
    PetscCall(VecAssemblyBegin(c.L));
    PetscCall(VecAssemblyEnd(c.L));
    PetscCall(HycoSystemComputeKKT(c.system, c.x, c.L, &kkt));
    if (k == 4) {
      CHECK(HycoKKTMax(&kkt) > 1, "NaN must not pass: %g", (double)HycoKKTMax(&kkt));
      continue;
    }
    CHECK_NEAR(kkt.penetration, s[4], 1e-15);
    CHECK_NEAR(kkt.adhesion, s[5], 1e-15);
    CHECK_NEAR(kkt.complementarity, s[6], 1e-15);
  }
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- random systems -- */

/* K = I + R R^T / n, B with m rows of random entries; `twice`: the last half repeats the first, rows and gaps. Blocks of 3,
   1 and 2 components in turn; those of several have the law `type`. */
static PetscErrorCode Random(const char type[], PetscInt triples, PetscBool twice, PetscReal value, Case *c)
{
  unsigned long long state = 11 + (unsigned long long)triples;
  const PetscInt m = 6 * triples, n = 2 * m;
  PetscReal *R;

  PetscFunctionBegin;
  PetscCall(Allocate(c, n, m));
  c->n_cones = 3;
  PetscCall(MakeCone(type, 3, &c->cone[0]));
  PetscCall(MakeCone(HYCO_CONE_NONNEGATIVE, 1, &c->cone[1]));
  PetscCall(MakeCone(type, 2, &c->cone[2]));
  for (PetscInt k = 0; k < 3 * triples; k++) PetscCall(AddBlock(c, k % 3, value));
  PetscCall(PetscMalloc1(n * n, &R));
  for (PetscInt k = 0; k < n * n; k++) R[k] = Draw(&state);
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < n; j++) {
      for (PetscInt k = 0; k < n; k++) c->K[i * n + j] += R[i * n + k] * R[j * n + k] / (PetscReal)n;
    }
    c->K[i * n + i] += 1;
    c->F[i] = 3 * Draw(&state);
  }
  for (PetscInt i = 0; i < m; i++) {
    const PetscInt like = twice && i >= m / 2 ? i - m / 2 : i;

    for (PetscInt j = 0; j < n; j++) c->B[i * n + j] = like < i ? c->B[like * n + j] : Draw(&state);
    c->D[i] = like < i ? c->D[like] : 0.3 * Draw(&state);
  }
  PetscCall(PetscFree(R));
  PetscCall(Assemble(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W = B K^-1 B^T and q = D - B K^-1 F, by Gaussian elimination of [K | B^T F]: no pivoting, as K is positive definite. */
static PetscErrorCode Condense(const Case *c, PetscReal W[], PetscReal q[])
{
  const PetscInt n = c->n, m = c->m, width = n + m + 1;
  PetscReal *A;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * width, &A));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < n; j++) A[i * width + j] = c->K[i * n + j];
    for (PetscInt j = 0; j < m; j++) A[i * width + n + j] = c->B[j * n + i];
    A[i * width + n + m] = c->F[i];
  }
  for (PetscInt p = 0; p < n; p++) {
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal factor = A[i * width + p] / A[p * width + p];

      for (PetscInt j = p; j < width && i != p; j++) A[i * width + j] -= factor * A[p * width + j];
    }
  }
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = 0; j <= m; j++) {
      PetscReal sum = 0;

      for (PetscInt p = 0; p < n; p++) sum += c->B[i * n + p] * A[p * width + n + j] / A[p * width + p];
      if (j < m)
        W[i * m + j] = sum;
      else
        q[i] = c->D[i] - sum;
    }
  }
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of one block: the projection, written without the class. */
static void Admit(const Case *c, PetscInt k, PetscBool coulomb, PetscReal r[])
{
  const PetscInt size = c->row[k + 1] - c->row[k];
  const PetscReal length = Length(size, r), radius = coulomb ? c->data[k] * PetscMax(r[0], 0) : c->data[k];

  r[0] = PetscMax(r[0], 0);
  for (PetscInt i = 1; i < size; i++) r[i] *= length > radius ? radius / length : 1;
}

/* The natural map at r with the step `rho`: the next iterate of the projected gradient method, and how far it is. */
static PetscReal Next(const Case *c, PetscBool coulomb, PetscReal rho, const PetscReal W[], const PetscReal q[],
                      const PetscReal r[], PetscReal next[])
{
  PetscReal change = 0;

  for (PetscInt i = 0; i < c->m; i++) {
    PetscReal w = q[i];

    for (PetscInt j = 0; j < c->m; j++) w += W[i * c->m + j] * r[j];
    next[i] = r[i] - rho * w;
  }
  for (PetscInt k = 0; k < c->n_blocks; k++) Admit(c, k, coulomb, next + c->row[k]);
  for (PetscInt i = 0; i < c->m; i++) change = PetscMax(change, PetscAbsReal(next[i] - r[i]));
  return change;
}

/* The solution by projected gradients with the step 1 / |W|_F, until they change nothing. */
static PetscErrorCode ProjectedGradients(const Case *c, const PetscReal W[], const PetscReal q[], PetscReal r[])
{
  PetscReal sum = 0, change = 1, next[MOST];
  PetscInt its = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->m * c->m; k++) sum += W[k] * W[k];
  PetscCall(PetscArrayzero(r, c->m));
  for (; change > 1e-14 && its < 200000; its++) {
    change = Next(c, PETSC_FALSE, 1 / PetscSqrtReal(sum), W, q, r, next);
    for (PetscInt i = 0; i < c->m; i++) r[i] = next[i]; /* by hand: gcc 14 takes the size of a copy for negative */
  }
  CHECK(change < 1e-13, "projected gradients change by %g after %d iterations", (double)change, (int)its);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many blocks of several components are open, slip, stick. */
static void Count(const Case *c, PetscBool coulomb, const PetscReal r[], PetscInt count[3])
{
  count[0] = count[1] = count[2] = 0;
  for (PetscInt k = 0; k < c->n_blocks; k++) {
    const PetscReal *own = r + c->row[k], radius = coulomb ? c->data[k] * own[0] : c->data[k];

    if (c->of[k] == 1) continue;
    if (own[0] == 0)
      count[0]++;
    else
      count[Length(c->row[k + 1] - c->row[k], own) >= radius * (1 - 1e-12) ? 1 : 2]++;
  }
}

/* Random systems: against projected gradients where the answer is unique by convexity, and the natural map. */
static PetscErrorCode TestRandom(const char type[], PetscInt triples, PetscBool twice, PetscReal value)
{
  const PetscBool coulomb = (PetscBool)(strcmp(type, "coulomb") == 0);
  PetscReal x[MOST], L[MOST], next[MOST], forces[MOST], *W, q[MOST];
  PetscInt its, more, count[3];
  HycoSolver solver;
  Case c;

  PetscFunctionBegin;
  PetscCall(Random(type, triples, twice, value, &c));
  PetscCall(PetscMalloc1(c.m * c.m, &W));
  PetscCall(Condense(&c, W, q));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(Solve(&c, solver, x, L, &its));
  Count(&c, coulomb, L, count);
  CHECK(count[0] && count[1] && count[2], "%d open, %d slip, %d stick", (int)count[0], (int)count[1], (int)count[2]);
  CHECK(Next(&c, coulomb, 1, W, q, L, next) < 1e-10, "the natural map moves by %g",
        (double)Next(&c, coulomb, 1, W, q, L, next));
  if (!coulomb) PetscCall(ProjectedGradients(&c, W, q, forces));
  for (PetscInt i = 0; i < c.m && !coulomb && !twice; i++) CHECK_NEAR(L[i], forces[i], 1e-10);
  for (PetscInt i = 0; i < c.m && !coulomb && twice; i++) { /* gaps are unique, forces are not */
    PetscReal sum = 0;

    for (PetscInt j = 0; j < c.m; j++) sum += W[i * c.m + j] * (L[j] - forces[j]);
    CHECK_NEAR(sum, 0, 1e-9);
  }
  PetscCall(Solve(&c, solver, x, L, &more)); /* starts from the solution */
  CHECK(more <= 1, "%d iterations from the solution, %d before", (int)more, (int)its);
  PetscCall(PetscFree(W));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with a given flexibility, on each process alone. */
static PetscErrorCode TestFlexibility(void)
{
  PetscReal x[MOST], L[MOST], *W, q[MOST];
  PetscInt its;
  HycoSystem system;
  HycoSolver solver;
  HycoReason reason;
  const char *method;
  PetscScalar *forces;
  Mat G;
  Vec g, l;
  Case c;

  PetscFunctionBegin;
  PetscCall(Random("tresca", 5, PETSC_FALSE, 0.5, &c));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(Solve(&c, solver, x, L, &its));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(PetscMalloc1(c.m * c.m, &W));
  PetscCall(Condense(&c, W, q));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, c.m, c.m, W, &G));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, c.m, q, &g));
  PetscCall(VecDuplicate(g, &l));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSystemSetFlexibility(system, G, g));
  c.first = 0, c.last = c.n_blocks;
  PetscCall(HycoSystemDestroy(&c.system));
  c.system = system;
  PetscCall(SetBlocks(&c));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoSolverSetSystem(solver, system));
  PetscCall(HycoSolverSolve(solver, NULL, l));
  PetscCall(HycoSolverGetReason(solver, &reason));
  PetscCall(HycoSolverGetMethod(solver, &method));
  CHECK(reason == HYCO_CONVERGED && strcmp(method, "semismooth condensed") == 0, "%s: %s", method,
        HycoReasonName(reason));
  PetscCall(VecGetArray(l, &forces));
  for (PetscInt i = 0; i < c.m; i++) CHECK_NEAR(forces[i], L[i], 1e-11);
  PetscCall(VecRestoreArray(l, &forces));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(MatDestroy(&G));
  PetscCall(VecDestroy(&g));
  PetscCall(VecDestroy(&l));
  PetscCall(PetscFree(W));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks that are all nonnegative: the active set solves, bitwise as without blocks; and the type semismooth, alike. */
static PetscErrorCode TestNonnegative(void)
{
  PetscReal x[MOST], L[3][MOST];
  PetscInt its;
  HycoSolver solver;
  const char *method;
  Case c;

  PetscFunctionBegin;
  PetscCall(Random(HYCO_CONE_NONNEGATIVE, 6, PETSC_FALSE, 0, &c));
  for (int k = 0; k < 2; k++) {
    PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
    PetscCall(HycoSolverSetSystem(solver, c.system));
    PetscCall(HycoSolverSolve(solver, c.x, c.L));
    PetscCall(HycoSolverGetMethod(solver, &method));
    CHECK(strcmp(method, "active_set dual") == 0, "%s", method);
    PetscCall(GetAll(c.L, L[k]));
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(HycoSystemSetBlocks(c.system, 0, NULL, 0, NULL, NULL));
  }
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(Solve(&c, solver, x, L[2], &its));
  PetscCall(HycoSolverDestroy(&solver));
  for (PetscInt i = 0; i < c.m; i++) {
    CHECK_NEAR(L[1][i], L[0][i], 0);
    CHECK_NEAR(L[2][i], L[0][i], 1e-12);
  }
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- refusals -- */

/* A solve fails with this text. */
static PetscErrorCode Refused(Case *c, HycoSolverType type, const char tao[], HycoForm form, const char text[])
{
  HycoSolver solver;

  PetscFunctionBegin;
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(HycoSolverSetSystem(solver, c->system));
  PetscCall(HycoSolverSetType(solver, type));
  PetscCall(HycoSolverSetTaoType(solver, tao));
  PetscCall(HycoSolverSetForm(solver, form));
  CHECK_FAILS(HycoSolverSolve(solver, c->x, c->L), text);
  PetscCall(HycoSolverDestroy(&solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The translations of two nodes in two directions as K's null space: unknowns n0, t0, n1, t1. */
static PetscErrorCode Loosen(Mat K)
{
  MatNullSpace kernel;
  PetscInt lo, hi;
  Vec motion[2];

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(K, &lo, &hi));
  for (PetscInt a = 0; a < 2; a++) {
    PetscCall(MatCreateVecs(K, &motion[a], NULL));
    for (PetscInt i = lo; i < hi; i++)
      PetscCall(VecSetValue(motion[a], i, i % 2 == a ? PetscSqrtReal(0.5) : 0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(motion[a]));
    PetscCall(VecAssemblyEnd(motion[a]));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 2, motion, &kernel));
  PetscCall(MatSetNullSpace(K, kernel));
  PetscCall(MatNullSpaceDestroy(&kernel));
  for (PetscInt a = 0; a < 2; a++) PetscCall(VecDestroy(&motion[a]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar of two nodes and stiffness 4 on a plane with the gap 0.5, which nothing else holds, pressed by 2 and pushed by 1:
   with a coefficient of 0.6 it sticks, r = (2, 1), x = (0.5, 0, 1, 0.25); with 0.3 no forces are in equilibrium. */
static PetscErrorCode TestFloating(void)
{
  const PetscReal expected[4] = {0.5, 0, 1, 0.25};
  PetscReal x[MOST], L[MOST];
  PetscInt its;
  HycoSolver solver;
  HycoReason reason;
  Case c;

  PetscFunctionBegin;
  for (int stick = 0; stick < 2; stick++) {
    PetscCall(Allocate(&c, 4, 2));
    c.n_cones = 1;
    PetscCall(MakeCone("coulomb", 2, &c.cone[0]));
    PetscCall(AddBlock(&c, 0, stick ? 0.6 : 0.3));
    for (PetscInt i = 0; i < 4; i++) c.K[i * 4 + i] = 4, c.K[i * 4 + (i + 2) % 4] = -4;
    for (PetscInt i = 0; i < 2; i++) c.B[i * 4 + i] = 1;
    c.D[0] = 0.5;
    c.F[2] = 2, c.F[3] = 1;
    PetscCall(Assemble(&c));
    PetscCall(Loosen(c.K_));
    PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
    if (stick) {
      PetscCall(Solve(&c, solver, x, L, &its));
      for (PetscInt i = 0; i < 4; i++) CHECK_NEAR(x[i], expected[i], 1e-13);
      for (PetscInt i = 0; i < 2; i++) CHECK_NEAR(L[i], 2 - i, 1e-13);
    } else {
      PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_SEMISMOOTH));
      PetscCall(HycoSolverSetSystem(solver, c.system));
      PetscCall(HycoSolverSolve(solver, c.x, c.L));
      PetscCall(HycoSolverGetReason(solver, &reason));
      CHECK(reason < 0, "%s", HycoReasonName(reason));
    }
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(CaseDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* hyco's type of Tao for blocks has no meaning without a contact system. */
static PetscErrorCode TestTaoAlone(void)
{
  Tao tao;
  Vec x;

  PetscFunctionBegin;
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, 1, PETSC_DETERMINE, &x));
  PetscCall(TaoCreate(PETSC_COMM_WORLD, &tao));
  PetscCall(TaoSetType(tao, "hyco_semismooth"));
  PetscCall(TaoSetSolution(tao, x));
  CHECK_FAILS(TaoSolve(tao), "hyco_semismooth solves contact systems of a HycoSolver");
  PetscCall(TaoDestroy(&tao));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Methods and forms that know forces >= 0 only, blocks that do not fit. */
static PetscErrorCode TestRefusals(void)
{
  HycoCone bare, unknown;
  Case c;

  PetscFunctionBegin;
  PetscCall(Random("tresca", 2, PETSC_FALSE, 1, &c));
  PetscCall(Refused(&c, HYCO_SOLVER_ACTIVE_SET, NULL, HYCO_FORM_AUTO, "active_set solves systems with contact forces"));
  PetscCall(Refused(&c, HYCO_SOLVER_LEMKE, NULL, HYCO_FORM_AUTO, "use -hyco_solver_type semismooth"));
  PetscCall(Refused(&c, HYCO_SOLVER_TAO, NULL, HYCO_FORM_AUTO, "gpcg solves systems"));
  PetscCall(Refused(&c, HYCO_SOLVER_TAO, "ssils", HYCO_FORM_AUTO, "ssils solves systems"));
  PetscCall(Refused(&c, HYCO_SOLVER_SEMISMOOTH, NULL, HYCO_FORM_PRIMAL, "the form primal takes contact forces >= 0"));
  PetscCall(Refused(&c, HYCO_SOLVER_SEMISMOOTH, NULL, HYCO_FORM_DUAL_FREE, "the form dual_free takes contact forces"));
  PetscCall(HycoConeCreate(PETSC_COMM_WORLD, &bare));
  CHECK_FAILS(HycoSystemSetBlocks(c.system, 1, &bare, c.last - c.first, NULL, NULL), "has no type");
  PetscCall(HycoConeSetType(bare, HYCO_CONE_NONNEGATIVE));
  CHECK_FAILS(HycoSystemSetBlocks(c.system, 1, &bare, c.last - c.first, NULL, NULL), "they must be as many");
  for (PetscInt k = 0; k < MOST; k++) c.of[k] = 1;
  CHECK_FAILS(HycoSystemSetBlocks(c.system, 1, &bare, c.last - c.first, c.of, NULL), "cones are 0 to 0");
  CHECK_FAILS(HycoConeSetSize(bare, 2), "call HycoConeSetSize() before HycoConeSetType()");
  PetscCall(HycoConeDestroy(&bare));
  PetscCall(HycoConeCreate(PETSC_COMM_WORLD, &unknown));
  CHECK_FAILS(HycoConeSetSize(unknown, 4), "it must have 1 to 3");
  CHECK_FAILS(HycoConeSetType(unknown, "tresa"), "did you mean tresca?");
  PetscCall(HycoConeDestroy(&unknown));
  PetscCall(CaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(HycoConeRegister("tresca", Create));
  PetscCall(HycoConeRegister("coulomb", Create));
  PetscCall(TestResiduals());
  PetscCall(TestClosedForm(2));
  PetscCall(TestClosedForm(3));
  PetscCall(TestCoulomb());
  PetscCall(TestRandom("tresca", 20, PETSC_FALSE, 0.5));
  PetscCall(TestRandom("tresca", 20, PETSC_TRUE, 0.3));
  PetscCall(TestRandom("tresca", 12, PETSC_TRUE, 0.3)); /* Newton's method alone does not solve it */
  PetscCall(TestRandom("coulomb", 20, PETSC_FALSE, 0.3));
  PetscCall(TestFloating());
  PetscCall(TestFlexibility());
  PetscCall(TestNonnegative());
  PetscCall(TestRefusals());
  PetscCall(TestTaoAlone());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
