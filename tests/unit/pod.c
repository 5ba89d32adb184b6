/* POD (17)-(18): known singular values, orthonormality, the energy criterion, the Gram and the tall path. On any
   number of ranks. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

static SVD svd; /* of all tests, whose matrices differ in size */

/* Orthonormal columns for any n: the discrete cosine transform. */
static double Cosine(PetscInt n, PetscInt i, PetscInt j)
{
  return j == 0 ? sqrt(1.0 / (double)n)
                : sqrt(2.0 / (double)n) * cos(PETSC_PI * ((double)i + 0.5) * (double)j / (double)n);
}

/* S = sum_k s_k c_k(N) c_k(n)^T: its singular values are s (r of them). */
static PetscErrorCode Make(PetscInt N, PetscInt n, PetscInt r, const PetscReal s[], Mat *S)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, N, n, NULL, S));
  PetscCall(MatGetOwnershipRange(*S, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < n; j++) {
      PetscReal value = 0;

      for (PetscInt k = r - 1; k >= 0; k--) value += s[k] * Cosine(N, i, k) * Cosine(n, j, k);
      PetscCall(MatSetValue(*S, i, j, value, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*S, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*S, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V^T V = I to orthonormal, and mode k is +-c_k to a cosine less than 1 by `skew`, its largest entry positive. */
static PetscErrorCode CheckModes(Mat V, PetscInt N, PetscInt l, const PetscReal s[], PetscReal orthonormal,
                                 PetscReal skew)
{
  Mat G;
  PetscReal *value;
  PetscInt *row;

  PetscFunctionBegin;
  PetscCall(MatTransposeMatMult(V, V, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G));
  PetscCall(PetscMalloc2(PetscMax(N, l) * l, &value, PetscMax(N, l), &row));
  for (PetscInt i = 0; i < PetscMax(N, l); i++) row[i] = i;
  PetscCall(HycoGatherRows(G, l, row, value));
  for (PetscInt i = 0; i < l * l; i++) CHECK_NEAR(value[i], i / l == i % l ? 1 : 0, orthonormal);
  PetscCall(HycoGatherRows(V, N, row, value));
  for (PetscInt k = 0; k < l; k++) {
    PetscReal dot = 0, highest = 0, lowest = 0;

    for (PetscInt i = 0; i < N; i++) {
      dot += value[i * l + k] * Cosine(N, i, k);
      highest = fmax(highest, value[i * l + k]);
      lowest = fmin(lowest, value[i * l + k]);
    }
    CHECK(fabs(fabs(dot) - 1) < skew, "mode %d of %d rows, sigma %g: cosine with the exact one %.10g", (int)k, (int)N,
          s[k], dot);
    CHECK(highest >= -lowest * (1 - 1e-6), "mode %d: its entries run from %g to %g", (int)k, lowest, highest);
  }
  PetscCall(PetscFree2(value, row));
  PetscCall(MatDestroy(&G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Singular values 1, 0.1, ..., 1e-12: found to 1e-3 relative, on a small, a square, a wide and a tall matrix. */
static PetscErrorCode TestKnown(void)
{
  const PetscInt sizes[][2] = {{60, 13}, {13, 13}, {20, 40}, {1999, 20}, {2500, 13}, {6000, 30}};
  PetscReal s[13], sigma[64];
  Mat S, V;
  PetscInt l;

  PetscFunctionBegin;
  for (int k = 0; k < 13; k++) s[k] = pow(10, -k);
  for (size_t t = 0; t < sizeof(sizes) / sizeof(sizes[0]); t++) {
    const PetscInt N = sizes[t][0], n = sizes[t][1];

    PetscCall(Make(N, n, 13, s, &S));
    PetscCall(HycoPOD(svd, S, 0, 3e-13, 0, &V, &l, sigma));
    CHECK(l == 13, "%d x %d: expected 13 modes, found %d", (int)N, (int)n, (int)l);
    for (int k = 0; k < 13; k++)
      CHECK(fabs(sigma[k] / s[k] - 1) < 1e-3, "%d x %d: expected sigma %g, found %.10g", (int)N, (int)n, s[k],
            sigma[k]);
    PetscCall(CheckModes(V, N, l, s, 1e-13, 1e-6));
    PetscCall(MatDestroy(&V));
    PetscCall(MatDestroy(&S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (18) by hand for s = 1, 1e-1, 1e-2, 1e-3: left out after 1: 1.0e-2, after 2: 1.0e-4, after 3: 9.9e-7. */
static PetscErrorCode TestCriterion(void)
{
  const PetscReal s[4] = {1, 1e-1, 1e-2, 1e-3};
  const struct {
    PetscReal tol, noise;
    PetscInt max_modes, l;
  } cases[] = {{0.5, 0, 0, 1},  {1.1e-2, 0, 0, 1}, {9e-3, 0, 0, 2}, {1e-4, 0, 0, 2},  {9e-5, 0, 0, 3},
               {9e-7, 0, 0, 4}, {0, 1e-11, 0, 4},  {0, 5e-3, 0, 3}, {0, 1e-11, 2, 2}, {9e-3, 1e-11, 3, 2}};
  const PetscInt rows[] = {40, 2100};
  PetscReal sigma[8];
  Mat S, V;
  PetscInt l;

  PetscFunctionBegin;
  for (int r = 0; r < 2; r++) {
    PetscCall(Make(rows[r], 8, 4, s, &S));
    for (size_t t = 0; t < sizeof(cases) / sizeof(cases[0]); t++) {
      PetscCall(HycoPOD(svd, S, cases[t].tol, cases[t].noise, cases[t].max_modes, &V, &l, sigma));
      CHECK(l == cases[t].l, "%d rows, tol %g, noise %g, at most %d: expected %d modes, found %d", (int)rows[r],
            cases[t].tol, cases[t].noise, (int)cases[t].max_modes, (int)cases[t].l, (int)l);
      PetscCall(MatDestroy(&V));
    }
    PetscCall(MatDestroy(&S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of zeros have no mode, columns of one direction have one. */
static PetscErrorCode TestZeroAndOne(void)
{
  const PetscReal zero = 0, one = 7;
  const PetscInt rows[] = {30, 2500};
  PetscReal sigma[5];
  Mat S, V;
  PetscInt l;

  PetscFunctionBegin;
  for (int r = 0; r < 2; r++) {
    PetscCall(Make(rows[r], 5, 1, &zero, &S));
    PetscCall(HycoPOD(svd, S, 1e-7, 1e-11, 0, &V, &l, sigma));
    CHECK(l == 0 && !V, "%d rows of zeros: expected no mode, found %d", (int)rows[r], (int)l);
    CHECK_NEAR(sigma[0], 0, 0);
    PetscCall(MatDestroy(&S));
    PetscCall(Make(rows[r], 5, 1, &one, &S));
    PetscCall(HycoPOD(svd, S, 0, 1e-11, 0, &V, &l, sigma));
    CHECK(l == 1, "%d rows of rank one: found %d modes", (int)rows[r], (int)l);
    CHECK_NEAR(sigma[0], 7, 7e-13);
    CHECK(sigma[1] < 7e-13, "second singular value %g", sigma[1]);
    PetscCall(CheckModes(V, rows[r], 1, &one, 1e-13, 1e-6));
    PetscCall(MatDestroy(&V));
    PetscCall(MatDestroy(&S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Gram path on diag(4, 1, 0.25) as G = S^T M S: sigma = 2, 1, 0.5; S W orthonormal means W^T G W = I. */
static PetscErrorCode TestGram(void)
{
  const PetscReal G[9] = {4, 0, 0, 0, 1, 0, 0, 0, 0.25};
  PetscReal *W, sigma[3];
  PetscInt l;

  PetscFunctionBegin;
  PetscCall(HycoPODGram(3, G, 0.1, 1e-7, &W, &l, sigma)); /* left out after 1: 1.25 / 5.25; after 2: 0.25 / 5.25 */
  CHECK(l == 2, "expected 2 modes, found %d", (int)l);
  CHECK_NEAR(sigma[0], 2, 1e-14);
  CHECK_NEAR(sigma[1], 1, 1e-14);
  CHECK_NEAR(sigma[2], 0.5, 1e-14);
  for (PetscInt a = 0; a < l; a++) {
    for (PetscInt b = 0; b < l; b++) {
      PetscReal dot = 0;

      for (int k = 0; k < 3; k++) dot += W[a * 3 + k] * G[4 * k] * W[b * 3 + k];
      CHECK_NEAR(dot, a == b ? 1 : 0, 1e-13);
    }
  }
  PetscCall(PetscFree(W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SLEPc's types: the modes that (18) takes are those of tsqr; if the type finds them inaccurately, it returns fewer,
   and these are right. S has singular values 1, 0.1, ..., 1e-12, in units where they are tiny. */
static PetscErrorCode TestTypes(void)
{
  const struct {
    const char *type;
    PetscInt least; /* this many are accurate, at least */
  } types[] = {{SVDLAPACK, 11}, {SVDTRLANCZOS, 7}, {SVDCROSS, 6}, {SVDCYCLIC, 5}, {SVDRANDOMIZED, 7}};
  const PetscInt sizes[][2] = {{20, 40}, {600, 14}};
  PetscMPIInt ranks;
  PetscReal s[14] = {0}, sigma[64];
  Mat S, V;
  PetscInt l;

  PetscFunctionBegin;
  for (int k = 0; k < 13; k++) s[k] = 1e-6 * pow(10, -k);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  for (size_t t = 0; t < sizeof(types) / sizeof(types[0]); t++) {
    SVD other;

    /* on several ranks SLEPc 3.25 reports convergence without a triplet, which HycoPOD() refuses */
    if (ranks > 1 && SLEPC_VERSION_GE(3, 22, 0) && !strcmp(types[t].type, SVDRANDOMIZED)) continue;
    PetscCall(HycoPODCreateSVD(PETSC_COMM_WORLD, &other));
    PetscCall(SVDSetType(other, types[t].type));
    for (size_t z = 0; z < sizeof(sizes) / sizeof(sizes[0]); z++) {
      const PetscInt N = sizes[z][0], n = sizes[z][1];

      PetscCall(Make(N, n, 13, s, &S));
      PetscCall(HycoPOD(other, S, 2e-8, 1e-11, 0, &V, &l, sigma)); /* left out after 4: 1.0e-8; after 3: 1.0e-6 */
      CHECK(l == 4, "%s, %d x %d: expected 4 modes, found %d", types[t].type, (int)N, (int)n, (int)l);
      for (int k = 0; k < l; k++) CHECK_NEAR(sigma[k], s[k], 1e-6 * s[k]);
      PetscCall(CheckModes(V, N, l, s, 1e-9, 1e-4));
      PetscCall(MatDestroy(&V));
      PetscCall(HycoPOD(other, S, 0, 1e-11, 0, &V, &l, sigma));
      CHECK(l >= types[t].least && l <= 13, "%s, %d x %d: %d modes", types[t].type, (int)N, (int)n, (int)l);
      for (int k = 0; k < l; k++) CHECK_NEAR(sigma[k], s[k], 2e-3 * s[k]);
      CHECK(sigma[l] < fmax(1.2 * s[l], 1e-7 * s[0]), "%s: %g for what it leaves out", types[t].type, sigma[l]);
      PetscCall(CheckModes(V, N, l, s, 1e-9, 2e-3)); /* the last ones' singular values are good to 1e-3 */
      PetscCall(MatDestroy(&V));
      PetscCall(MatDestroy(&S));
    }
    PetscCall(SVDDestroy(&other));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns first .. first + n - 1 of S. */
static PetscErrorCode TakeColumns(Mat S, PetscInt first, PetscInt n, Mat *part)
{
  Mat view;

  PetscFunctionBegin;
  PetscCall(MatDenseGetSubMatrix(S, PETSC_DECIDE, PETSC_DECIDE, first, first + n, &view));
  PetscCall(MatDuplicate(view, MAT_COPY_VALUES, part));
  PetscCall(MatDenseRestoreSubMatrix(S, &view));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns that arrive in blocks of one or several: the modes and singular values are those of all together, above
   the loss of the merges, and never more than that are stored. */
static PetscErrorCode TestMerged(void)
{
  const PetscInt N = 900, n = 40, blocks[] = {1, 7, 15, 40};
  const PetscReal lost = 1e-11;
  PetscReal s[16], sigma[64];
  Mat S, V;
  PetscInt l;

  PetscFunctionBegin;
  for (int k = 0; k < 16; k++) s[k] = pow(10, -k);
  PetscCall(Make(N, n, 16, s, &S));
  for (size_t b = 0; b < sizeof(blocks) / sizeof(blocks[0]); b++) {
    Mat merged = NULL;
    PetscInt held = 0;

    for (PetscInt first = 0; first < n; first += blocks[b]) {
      const PetscInt count = PetscMin(blocks[b], n - first);
      Mat part;

      PetscCall(TakeColumns(S, first, count, &part));
      PetscCall(HycoPODMerge(svd, PetscSqr(lost) * count / n, &merged, &part));
      CHECK(!part, "the block is not freed");
      PetscCall(MatGetSize(merged, NULL, &l));
      held = PetscMax(held, l);
    }
    CHECK(held <= 14, "blocks of %d: %d columns held", (int)blocks[b], (int)held);
    PetscCall(HycoPOD(svd, merged, 0, 3e-10, 0, &V, &l, sigma));
    CHECK(l == 10, "blocks of %d: expected 10 modes, found %d", (int)blocks[b], (int)l);
    for (int k = 0; k < l; k++) CHECK_NEAR(sigma[k], s[k], lost);
    PetscCall(CheckModes(V, N, l, s, 1e-13, 1e-3));
    PetscCall(MatDestroy(&V));
    PetscCall(MatDestroy(&merged));
  }
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Merging columns of zeros gives no modes. */
static PetscErrorCode TestMergedZeros(void)
{
  const PetscReal zero = 0;
  Mat S, merged = NULL;

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscCall(Make(50, 3, 1, &zero, &S));
    PetscCall(HycoPODMerge(svd, 1e-20, &merged, &S));
    CHECK(!merged, "columns of zeros have modes");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two of three rows are zero, as those of other bodies: the singular values and modes are those of the rest, and the modes
   are exactly zero there. */
static PetscErrorCode TestZeroRows(void)
{
  const PetscInt sizes[][2] = {{900, 13}, {60, 13}};

  PetscFunctionBegin;
  for (int t = 0; t < 2; t++) {
    const PetscInt N = sizes[t][0], n = sizes[t][1], some = N / 3;
    PetscReal sigma[13], *value;
    PetscInt lo, hi, l, *row;
    Mat S, V;

    PetscCall(MatCreateDense(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, N, n, NULL, &S));
    PetscCall(MatGetOwnershipRange(S, &lo, &hi));
    for (PetscInt i = lo; i < hi; i++) {
      for (PetscInt j = 0; j < n && i % 3 == 1; j++) {
        PetscReal sum = 0;

        for (PetscInt k = n - 1; k >= 0; k--) sum += pow(10, -k) * Cosine(some, i / 3, k) * Cosine(n, j, k);
        PetscCall(MatSetValue(S, i, j, sum, INSERT_VALUES));
      }
    }
    PetscCall(HycoMatAssemble(S));
    PetscCall(HycoPOD(svd, S, 5e-16, 0, 0, &V, &l, sigma));
    CHECK(l == 8, "%d modes", (int)l);
    for (PetscInt k = 0; k < l; k++) CHECK_NEAR(sigma[k], pow(10, -k), 1e-7 * pow(10, -k));
    PetscCall(PetscMalloc2(N * l, &value, N, &row));
    for (PetscInt i = 0; i < N; i++) row[i] = i;
    PetscCall(HycoGatherRows(V, N, row, value));
    for (PetscInt k = 0; k < l; k++) {
      PetscReal dot = 0;

      for (PetscInt i = 0; i < N; i++) {
        CHECK(i % 3 == 1 || value[i * l + k] == 0, "row %d of mode %d", (int)i, (int)k);
        if (i % 3 == 1) dot += value[i * l + k] * Cosine(some, i / 3, k);
      }
      CHECK_NEAR(fabs(dot), 1, 1e-9);
    }
    PetscCall(PetscFree2(value, row));
    HycoDestroyAll(&V, &S);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(HycoPODCreateSVD(PETSC_COMM_WORLD, &svd));
  PetscCall(TestKnown());
  PetscCall(TestZeroRows());
  PetscCall(TestCriterion());
  PetscCall(TestZeroAndOne());
  PetscCall(TestTypes());
  PetscCall(TestMerged());
  PetscCall(TestMergedZeros());
  PetscCall(SVDDestroy(&svd));
  PetscCall(TestGram());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
