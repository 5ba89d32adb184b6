/* S ~ W H, W, H >= 0: known factorisations, the optimum for one vector, decrease of the misfit, degenerate matrices. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

/* n draws from [0, 1), `zeros` in ten of them replaced by 0. */
static void Fill(unsigned long long *state, PetscInt n, PetscInt zeros, PetscReal a[])
{
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal draw = (Draw(state) + 1) / 2;

    a[i] = (PetscInt)(10 * (Draw(state) + 1) / 2) < zeros ? 0 : draw;
  }
}

/* S = W H, W m x k, H k x n, column major. */
static void Multiply(PetscInt m, PetscInt n, PetscInt k, const PetscReal W[], const PetscReal H[], PetscReal S[])
{
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < m; i++) {
      S[j * m + i] = 0;
      for (PetscInt c = 0; c < k; c++) S[j * m + i] += W[c * m + i] * H[j * k + c];
    }
  }
}

/* No entry negative, columns of unit length; the returned misfit is at least that of the best H >= 0 for this W. */
static PetscErrorCode CheckFactors(PetscInt m, PetscInt n, const PetscReal S[], PetscInt k, const PetscReal W[],
                                   PetscReal misfit)
{
  PetscReal *x, residual, lost = 0, size = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(k, &x));
  for (PetscInt c = 0; c < k; c++) {
    PetscReal length = 0;

    for (PetscInt i = 0; i < m; i++) {
      CHECK(W[c * m + i] >= 0, "W(%d, %d) = %g", (int)i, (int)c, W[c * m + i]);
      length += W[c * m + i] * W[c * m + i];
    }
    CHECK_NEAR(length, 1, 1e-13);
  }
  for (PetscInt j = 0; j < n; j++) {
    PetscCall(HycoNNLS(m, k, W, S + j * m, x, &residual));
    lost += residual * residual;
    for (PetscInt i = 0; i < m; i++) size += S[j * m + i] * S[j * m + i];
  }
  CHECK(misfit >= lost / size - 1e-12, "misfit %g, but no H leaves less than %g", misfit, lost / size);
  CHECK(misfit <= 1.2 * lost / size + 1e-6, "misfit %g, and the best H leaves %g", misfit, lost / size);
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Separable factors (each column of W has a row of its own) are recovered: the columns themselves, in any order. */
static PetscErrorCode TestRecovered(void)
{
  const PetscInt m = 30, n = 40, k = 4;
  unsigned long long state = 7;
  PetscReal *T, *H, *S, *W, misfit;
  PetscInt found;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(m * k, &T, k * n, &H, m * n, &S, m * k, &W));
  Fill(&state, m * k, 0, T);
  Fill(&state, k * n, 3, H);
  for (PetscInt c = 0; c < k; c++) { /* blocks of seven rows for each column, two rows common to all */
    for (PetscInt i = 0; i < m - 2; i++) T[c * m + i] = i / 7 == c ? T[c * m + i] + 0.1 : 0;
  }
  Multiply(m, n, k, T, H, S);
  PetscCall(HycoNNMF(m, n, S, k, 500, W, &found, &misfit));
  CHECK(found == k, "%d vectors of %d", (int)found, (int)k);
  CHECK(misfit < 1e-6, "an exact factorisation exists; misfit %g", misfit);
  for (PetscInt c = 0; c < k; c++) {
    PetscReal best = 0, length = 0;

    for (PetscInt i = 0; i < m; i++) length += T[c * m + i] * T[c * m + i];
    for (PetscInt f = 0; f < found; f++) {
      PetscReal dot = 0;

      for (PetscInt i = 0; i < m; i++) dot += T[c * m + i] * W[f * m + i];
      best = fmax(best, dot / sqrt(length));
    }
    CHECK(best > 1 - 1e-4, "column %d of W: cosine %.8g with the nearest one found", (int)c, best);
  }
  PetscCall(PetscFree4(T, H, S, W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* k = 1: by Perron and Frobenius the first singular vector is nonnegative, so that the misfit is that of the SVD. It
   decreases with k and with the iterations, never below the SVD's; repeated calls give the same bits. */
static PetscErrorCode TestMisfits(void)
{
  const PetscInt m = 25, n = 35, ks[4] = {1, 3, 6, 12}, its[3] = {1, 10, 200};
  unsigned long long state = 99;
  PetscReal *S, *W, *again, *sigma, total = 0, before = 1, misfit, same;
  PetscInt found, other;
  Mat A, V;
  SVD svd;
  PetscInt l;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(m * n, &S, m * m, &W, m * m, &again, n, &sigma));
  Fill(&state, m * n, 5, S);
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, n, S, &A));
  PetscCall(HycoPODCreateSVD(PETSC_COMM_SELF, &svd));
  PetscCall(HycoPOD(svd, A, 0, 0, 0, &V, &l, sigma));
  PetscCall(SVDDestroy(&svd));
  for (PetscInt j = 0; j < m; j++) total += sigma[j] * sigma[j];
  for (PetscInt t = 0; t < 4; t++) {
    PetscReal least = 0, longer = 1;

    for (PetscInt j = ks[t]; j < m; j++) least += sigma[j] * sigma[j] / total;
    for (PetscInt i = 0; i < 3; i++) {
      PetscCall(HycoNNMF(m, n, S, ks[t], its[i], W, &found, &misfit));
      CHECK(misfit <= longer + 1e-12, "k = %d: %g after %d iterations, %g before", (int)ks[t], misfit, (int)its[i],
            longer);
      longer = misfit;
    }
    CHECK(misfit >= least - 1e-12, "k = %d: misfit %g below the SVD's %g", (int)ks[t], misfit, least);
    CHECK(misfit < before, "k = %d: misfit %g, with fewer vectors %g", (int)ks[t], misfit, before);
    before = misfit;
    if (ks[t] == 1) CHECK_NEAR(misfit, least, 1e-8);
    PetscCall(CheckFactors(m, n, S, found, W, misfit));
    PetscCall(HycoNNMF(m, n, S, ks[t], its[2], again, &other, &same));
    CHECK(other == found && same == misfit && memcmp(W, again, sizeof(*W) * (size_t)(m * found)) == 0,
          "k = %d: two runs differ", (int)ks[t]);
  }
  PetscCall(MatDestroy(&V));
  PetscCall(MatDestroy(&A));
  PetscCall(PetscFree4(S, W, again, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Zero; one column; one row; rank 1 with more vectors requested; a negative entry. */
static PetscErrorCode TestDegenerate(void)
{
  PetscReal S[12] = {0}, W[16], misfit, T[3] = {1, 0, 2}, H[4] = {1, 3, 0, 0.5};
  PetscInt found;

  PetscFunctionBegin;
  PetscCall(HycoNNMF(3, 4, S, 2, 100, W, &found, &misfit));
  CHECK(found == 0 && misfit == 0, "zero: %d vectors, misfit %g", (int)found, misfit);
  Multiply(3, 4, 1, T, H, S);
  PetscCall(HycoNNMF(3, 4, S, 3, 100, W, &found, &misfit));
  CHECK(found == 1 && misfit < 1e-20, "rank 1: %d vectors, misfit %g", (int)found, misfit);
  for (PetscInt i = 0; i < 3; i++) CHECK_NEAR(W[i], T[i] / sqrt(5), 1e-12);
  PetscCall(HycoNNMF(3, 1, T, 2, 100, W, &found, &misfit));
  CHECK(found == 1 && misfit < 1e-20, "one column: %d vectors, misfit %g", (int)found, misfit);
  for (PetscInt i = 0; i < 3; i++) CHECK_NEAR(W[i], T[i] / sqrt(5), 1e-12);
  PetscCall(HycoNNMF(1, 4, H, 2, 100, W, &found, &misfit));
  CHECK(found == 1 && W[0] == 1 && misfit < 1e-20, "one row: %d vectors, W = %g, misfit %g", (int)found, W[0], misfit);
  S[5] = -1;
  CHECK_FAILS(HycoNNMF(3, 4, S, 2, 100, W, &found, &misfit), "the entry -1");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestRecovered());
  PetscCall(TestMisfits());
  PetscCall(TestDegenerate());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
