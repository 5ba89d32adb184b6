/* Dense linear complementarity: w = q + M z >= 0, z >= 0, w.z = 0, by the active set and by Lemke's method; motions without forces. */
#include "check.h"
#include <hycosolverimpl.h>
#include <math.h>

/* Largest violation of the three conditions, relative to the size of q. */
static double Violation(PetscInt n, const PetscReal M[], const PetscReal q[], const PetscReal z[])
{
  double worst = 0, size = 0, size_z = 0;

  for (PetscInt i = 0; i < n; i++) {
    size = fmax(size, fabs(q[i]));
    size_z = fmax(size_z, fabs(z[i]));
  }
  for (PetscInt i = 0; i < n; i++) {
    double w = q[i];

    for (PetscInt j = 0; j < n; j++) w += M[j * n + i] * z[j];
    worst = fmax(worst, -w / (size > 0 ? size : 1));
    worst = fmax(worst, -z[i] / (size_z > 0 ? size_z : 1));
    worst = fmax(worst, fabs(w * z[i]) / (size * size_z > 0 ? size * size_z : 1));
  }
  return worst;
}

static PetscBool Symmetric(PetscInt n, const PetscReal M[])
{
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < j; i++) {
      if (M[j * n + i] != M[i * n + j]) return PETSC_FALSE;
    }
  }
  return PETSC_TRUE;
}

/* HycoLCPActiveSet() with its own factor if M is symmetric. */
static PetscErrorCode ActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                PetscInt max_its, PetscBool active[], PetscReal z[], PetscInt *its,
                                HycoLCPStatus *status)
{
  HycoLCP lcp = {.n = n, .M = M, .q = q, .symmetric = symmetric, .max_its = max_its};

  PetscFunctionBegin;
  if (symmetric) PetscCall(HycoSetFactorCreate(n, &lcp.factor));
  PetscCall(HycoLCPActiveSet(&lcp, active, z, its, status));
  PetscCall(HycoSetFactorDestroy(&lcp.factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both methods from the empty set; Lemke's must solve; the active set must solve or report that it did not. */
static PetscErrorCode Both(const char what[], PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool must,
                           PetscReal z_lemke[])
{
  PetscBool *active;
  PetscReal *z;
  PetscInt its;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &active));
  PetscCall(PetscMalloc1(n, &z));
  PetscCall(HycoLCPLemke(n, M, q, 20 * n + 100, z_lemke, &its, &status));
  CHECK(status == HYCO_LCP_SOLVED, "Lemke, %s, n = %d: status %d", what, (int)n, (int)status);
  CHECK(Violation(n, M, q, z_lemke) < 1e-10, "Lemke, %s, n = %d: violation %g", what, (int)n,
        Violation(n, M, q, z_lemke));
  PetscCall(ActiveSet(n, M, q, Symmetric(n, M), 10 * n + 50, active, z, &its, &status));
  CHECK(status == HYCO_LCP_SOLVED || !must, "active set, %s, n = %d: status %d", what, (int)n, (int)status);
  if (status == HYCO_LCP_SOLVED) {
    double size = 0, apart = 0;

    CHECK(Violation(n, M, q, z) < 1e-10, "active set, %s, n = %d: violation %g", what, (int)n, Violation(n, M, q, z));
    for (PetscInt i = 0; i < n; i++) { /* P-matrices: one solution */
      size = fmax(size, fabs(z[i]));
      apart = fmax(apart, fabs(z[i] - z_lemke[i]));
    }
    CHECK(apart <= 1e-9 * size, "%s, n = %d: the two methods differ by %g of %g", what, (int)n, apart, size);
  } else {
    CHECK(status == HYCO_LCP_CYCLE || status == HYCO_LCP_LIMIT || status == HYCO_LCP_SINGULAR,
          "active set, %s: status %d", what, (int)status);
  }
  PetscCall(PetscFree(active));
  PetscCall(PetscFree(z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nonsymmetric, positive definite: R R^T / n + 0.1 I + skew: a P-matrix (Cottle, Pang, Stone 1992, theorem 3.1.6). */
static PetscErrorCode TestRandom(void)
{
  const PetscInt sizes[] = {1, 2, 3, 5, 10, 40, 120, 300};
  unsigned long long state = 12345;

  PetscFunctionBegin;
  for (size_t t = 0; t < sizeof(sizes) / sizeof(sizes[0]); t++) {
    const PetscInt n = sizes[t];
    PetscReal *R, *M, *q, *z;

    PetscCall(PetscMalloc4(n * n, &R, n * n, &M, n, &q, n, &z));
    for (PetscInt k = 0; k < n * n; k++) R[k] = Draw(&state);
    for (PetscInt i = 0; i < n; i++) {
      q[i] = Draw(&state);
      for (PetscInt j = 0; j < n; j++) {
        M[j * n + i] = (i == j ? 0.1 : 0) + (i < j ? R[j * n + i] : -R[i * n + j]) * (i == j ? 0 : 1.0 / (double)n);
        for (PetscInt k = 0; k < n; k++) M[j * n + i] += R[k * n + i] * R[k * n + j] / (double)n;
      }
    }
    PetscCall(Both("random P-matrix", n, M, q, PETSC_FALSE, z));
    for (PetscInt i = 0; i < n; i++) q[i] = fabs(q[i]);
    PetscCall(Both("q >= 0", n, M, q, PETSC_TRUE, z));
    for (PetscInt i = 0; i < n; i++) CHECK_NEAR(z[i], 0, 0); /* w = q, z = 0 solves it */
    PetscCall(PetscFree4(R, M, q, z));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Murty's triangular matrices with 2s, hard for pivoting: with q = -e the solution of the lower triangular one is
   z = (1, 0, ..., 0) (forward substitution), of the upper one z = (0, ..., 0, 1). K. G. Murty, Math. Programming Study 7
   (1978) 61-73. */
static PetscErrorCode TestMurty(void)
{
  PetscFunctionBegin;
  for (PetscInt n = 1; n <= 50; n++) {
    for (int upper = 0; upper < 2; upper++) {
      const PetscInt one = upper ? n - 1 : 0;
      PetscReal *M, *q, *z;

      PetscCall(PetscCalloc1(n * n, &M));
      PetscCall(PetscMalloc2(n, &q, n, &z));
      for (PetscInt j = 0; j < n; j++) {
        q[j] = -1;
        for (PetscInt i = 0; i < n; i++) M[j * n + i] = i == j ? 1 : ((upper ? i < j : i > j) ? 2 : 0);
      }
      PetscCall(Both(upper ? "Murty, upper" : "Murty, lower", n, M, q, PETSC_FALSE, z));
      for (PetscInt i = 0; i < n; i++) CHECK_NEAR(z[i], i == one ? 1 : 0, 1e-12);
      PetscCall(PetscFree(M));
      PetscCall(PetscFree2(q, z));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ben Gharbia and Gilbert's P-matrix, on which the active set cycles from {1}: {1}, {1,3}, {2,3}, {1,2}, {1,3}; the
   solution is z = e / 3, by symmetry. I. Ben Gharbia, J. C. Gilbert, Math. Programming 134 (2012) 349-364. */
static PetscErrorCode TestCycle(void)
{
  const PetscReal M[9] = {1, 2, 0, 0, 1, 2, 2, 0, 1}, q[3] = {-1, -1, -1}; /* columns of [1 0 2; 2 1 0; 0 2 1] */
  PetscBool active[3] = {PETSC_TRUE, PETSC_FALSE, PETSC_FALSE};
  PetscReal z[3];
  PetscInt its;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(ActiveSet(3, M, q, PETSC_FALSE, 100, active, z, &its, &status));
  CHECK(status == HYCO_LCP_CYCLE, "expected a cycle, found status %d", (int)status);
  CHECK(its == 4, "expected 4 iterations until a set comes back, found %d", (int)its);
  PetscCall(HycoLCPLemke(3, M, q, 100, z, &its, &status));
  CHECK(status == HYCO_LCP_SOLVED, "Lemke: status %d", (int)status);
  for (PetscInt i = 0; i < 3; i++) CHECK_NEAR(z[i], 1.0 / 3, 1e-14);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The string's flexibility, inverse of tridiag(-1, 2, -1): min(i,j) (n + 1 - max(i,j)) / (n + 1), closed form; a flat
   obstacle at distance d under a unit load; and gaps that are zero exactly where nothing pushes (degenerate). */
static PetscErrorCode TestString(void)
{
  const PetscInt sizes[] = {1, 2, 7, 50, 98, 300};

  PetscFunctionBegin;
  for (size_t t = 0; t < sizeof(sizes) / sizeof(sizes[0]); t++) {
    const PetscInt n = sizes[t];
    PetscReal *M, *q, *z, sum = 0;

    PetscCall(PetscMalloc3(n * n, &M, n, &q, n, &z));
    for (PetscInt j = 0; j < n; j++) {
      for (PetscInt i = 0; i < n; i++)
        M[j * n + i] = (double)((PetscMin(i, j) + 1) * (n - PetscMax(i, j))) / (double)(n + 1);
    }
    /* free deflection under e: i (n + 1 - i) / 2; the gap is half of its largest */
    for (PetscInt i = 0; i < n; i++) q[i] = (n + 1) * (n + 1) / 16.0 - (i + 1) * (n - i) / 2.0;
    PetscCall(Both("string", n, M, q, PETSC_TRUE, z));
    for (PetscInt i = 0; i < n; i++) sum += z[i];
    CHECK(n < 7 || (sum > 0 && sum < n), "the obstacle carries a part of the load %d, found %g", (int)n, sum);
    PetscCall(PetscArrayzero(q, n));
    PetscCall(Both("string, no load, no gap", n, M, q, PETSC_TRUE, z));
    for (PetscInt i = 0; i < n; i++) CHECK_NEAR(z[i], 0, 0);
    /* the load pushes up on one half, down on the other: all gaps zero */
    for (PetscInt i = 0; i < n; i++) {
      q[i] = 0;
      for (PetscInt j = 0; j < n; j++) q[i] -= M[j * n + i] * (2 * j < n ? 1 : -1);
    }
    PetscCall(Both("string, zero gaps", n, M, q, PETSC_TRUE, z));
    PetscCall(PetscFree3(M, q, z));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No solution: M = 0 and q < 0; both methods must report it. */
static PetscErrorCode TestNone(void)
{
  const PetscReal M[4] = {0, 0, 0, 0}, q[2] = {-1, 1};
  PetscBool active[2] = {PETSC_FALSE, PETSC_FALSE};
  PetscReal z[2];
  PetscInt its;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(HycoLCPLemke(2, M, q, 100, z, &its, &status));
  CHECK(status == HYCO_LCP_RAY, "expected a ray, found status %d", (int)status);
  PetscCall(ActiveSet(2, M, q, PETSC_TRUE, 100, active, z, &its, &status));
  CHECK(status == HYCO_LCP_SINGULAR, "expected a singular set, found status %d", (int)status);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factor updated from set to set, growing, shrinking and at random, gives the same solutions as a new one for
   each; a matrix that is not definite on the set is detected, and later solutions are right again. */
static PetscErrorCode TestFactor(void)
{
  enum { n = 60 };
  HycoSetFactor kept, fresh;
  PetscReal C[n * n], M[n * n], q[n], z[n], other[n];
  PetscInt a[n], seed = 7;
  PetscBool regular;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n * n; i++) C[i] = sin(1.3 * i) + cos(0.7 * i * i);
  for (PetscInt i = 0; i < n; i++) {
    q[i] = cos(2.1 * i);
    for (PetscInt j = 0; j < n; j++) {
      M[j * n + i] = i == j;
      for (PetscInt k = 0; k < n; k++) M[j * n + i] += C[k * n + i] * C[k * n + j];
    }
  }
  PetscCall(HycoSetFactorCreate(n, &kept));
  PetscCall(HycoSetFactorCreate(n, &fresh));
  for (PetscInt step = 0; step < 200; step++) {
    PetscInt k = 0;
    double size = 0, apart = 0;

    for (PetscInt i = 0; i < n; i++) {
      seed = (seed * 1103 + 12345) % 65536;
      if (step < 50 ? i < step : step < 100 ? i < 100 - step : seed % 3 > 0) a[k++] = i;
    }
    PetscCall(HycoSetFactorSolve(kept, M, q, k, a, 1e-12, z, &regular));
    CHECK(regular, "step %d: not regular", (int)step);
    HycoSetFactorForget(fresh);
    PetscCall(HycoSetFactorSolve(fresh, M, q, k, a, 1e-12, other, &regular));
    for (PetscInt i = 0; i < n; i++) {
      size = fmax(size, fabs(other[i]));
      apart = fmax(apart, fabs(other[i] - z[i]));
    }
    CHECK(apart <= 1e-9 * size, "step %d, %d contacts: %g apart", (int)step, (int)k, apart);
    for (PetscInt j = 0; j < k; j++) {
      double w = q[a[j]];

      for (PetscInt i = 0; i < n; i++) w += M[i * n + a[j]] * z[i];
      CHECK(fabs(w) < 1e-9, "step %d: a gap of %g is left", (int)step, w);
    }
  }
  M[5 * n + 5] = -M[5 * n + 5];
  for (PetscInt i = 0; i < 10; i++) a[i] = i;
  HycoSetFactorForget(kept);
  PetscCall(HycoSetFactorSolve(kept, M, q, 10, a, 1e-12, z, &regular));
  CHECK(!regular, "a negative diagonal entry was not noticed");
  PetscCall(HycoSetFactorSolve(kept, M, q, 5, a, 1e-12, z, &regular));
  CHECK(regular, "the contacts before it are regular");
  PetscCall(HycoSetFactorDestroy(&kept));
  PetscCall(HycoSetFactorDestroy(&fresh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two identical contacts: the smaller gap is decisive; one of them may carry the force, the other none. */
static PetscErrorCode TestTwice(void)
{
  const PetscReal M[4] = {2, 2, 2, 2}, q[4][2] = {{-4, -4}, {-4, -6}, {-6, -4}, {-4, 1}};
  const PetscReal force[4] = {2, 3, 3, 2}; /* largest -q / 2 */

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) {
    for (int symmetric = 0; symmetric < 2; symmetric++) {
      PetscBool active[2] = {PETSC_FALSE, PETSC_FALSE};
      PetscReal z[2];
      PetscInt its;
      HycoLCPStatus status;

      PetscCall(ActiveSet(2, M, q[k], (PetscBool)symmetric, 100, active, z, &its, &status));
      CHECK(status == HYCO_LCP_SOLVED, "case %d: status %d", k, (int)status);
      CHECK_NEAR(z[0] + z[1], force[k], 1e-14);
      CHECK(z[0] * z[1] == 0, "case %d: forces %g, %g: one of them must be zero", k, z[0], z[1]);
      CHECK(active[0] + active[1] == 1, "case %d: the other must leave the set", k);
      PetscCall(HycoLCPLemke(2, M, q[k], 100, z, &its, &status));
      CHECK(status == HYCO_LCP_SOLVED, "Lemke, case %d: status %d", k, (int)status);
      CHECK_NEAR(z[0] + z[1], force[k], 1e-14);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M = C C^T with the rows e1, e2, (e1 + e2): the third is the sum of the first two; all three have negative gaps,
   consistent (-1, -1, -2) or not. Two independent contacts then give x = -C^T z, and Violation() checks the third. */
static PetscErrorCode TestThree(void)
{
  const PetscReal M[9] = {1, 0, 1, 0, 1, 1, 1, 1, 2}, q[4][3] = {{-1, -1, -2}, {-1, -1, -3}, {-1, -1, -1}, {-2, 1, -2}};

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) {
    PetscBool active[3] = {PETSC_FALSE, PETSC_FALSE, PETSC_FALSE};
    PetscReal z[3];
    PetscInt its;
    HycoLCPStatus status;

    PetscCall(HycoLCPLemke(3, M, q[k], 100, z, &its, &status));
    CHECK(status == HYCO_LCP_SOLVED && Violation(3, M, q[k], z) < 1e-14, "Lemke, case %d: status %d, violation %g", k,
          (int)status, Violation(3, M, q[k], z));
    PetscCall(ActiveSet(3, M, q[k], PETSC_TRUE, 100, active, z, &its, &status));
    CHECK(status == HYCO_LCP_SOLVED || status == HYCO_LCP_SINGULAR, "case %d: status %d", k, (int)status);
    CHECK(status != HYCO_LCP_SOLVED || Violation(3, M, q[k], z) < 1e-14, "case %d: violation %g", k,
          Violation(3, M, q[k], z));
    CHECK(status == HYCO_LCP_SOLVED || k == 1 || k == 3, "case %d: its gaps agree, it must be solved", k);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two planes across each other, and motions in units that change their gaps by little: the nearest place in both. */
static PetscErrorCode TestUnload(void)
{
  const PetscReal unit = 1e-5 / 3, q[4] = {0, 0, -1, -0.5};
  const PetscReal M[16] = {0, 0, unit, -unit, 0, 0, unit, unit};
  const PetscInt row[2] = {2, 3};
  PetscReal x[2] = {0, 0};
  PetscBool exists;

  PetscFunctionBegin;
  PetscCall(HycoLCPUnload(4, 2, 2, row, M, q, x, &exists));
  CHECK(exists, "such a place exists");
  CHECK_NEAR(unit * x[0], 0.25, 1e-14);
  CHECK_NEAR(unit * x[1], 0.75, 1e-14);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestUnload());
  PetscCall(TestFactor());
  PetscCall(TestTwice());
  PetscCall(TestThree());
  PetscCall(TestRandom());
  PetscCall(TestMurty());
  PetscCall(TestCycle());
  PetscCall(TestString());
  PetscCall(TestNone());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
