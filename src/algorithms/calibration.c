/* An upper bound fitted to data: a log-linear model with nonnegative exponents, raised above a given share of the
   data. */
#include <hycoalgorithms.h>
#include <petscsys.h>

/* Of the square sum of a column: correlated features share the weight, as ten points determine five of them badly. */
#define RIDGE 1e-1
/* Spread of a column of logarithms, below which it is left out: a feature that varies by 1 % explains no error of other
   size. */
#define CONSTANT_FEATURE 1e-2
/* Probability that the tolerance limit holds: three of four trainings; more makes the bounds of few points useless
   (tests/drawn/run). */
#define CONFIDENCE       0.75
#define MANY_ABOVE       1   /* which counts if fewer values than this are expected above the quantile */
#define MOST_LEVERAGE    1.4 /* logarithm by which leaving a point out may raise its own excess: a factor of 4 */
#define MOST_ABOVE_LIMIT 1.4 /* logarithm by which a held-out error may lie above the limit: a factor of 4 */

/* c >= 0 that minimises |X c - y|^2 about the means, regularised. The ridge is added as p rows; the means are
   removed, since the constant is fitted separately. Exponents must not be negative: an estimate never falls as a
   feature grows. */
static PetscErrorCode CalibrationFit(PetscInt n, PetscInt p, const PetscReal X[], const PetscReal y[], PetscReal c[])
{
  const PetscInt rows = n + p;
  PetscReal *A, *b, mean = 0, residual;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(rows * p, &A, rows, &b));
  for (PetscInt i = 0; i < n; i++) mean += y[i] / n;
  for (PetscInt i = 0; i < n; i++) b[i] = y[i] - mean;
  for (PetscInt j = 0; j < p; j++) {
    PetscReal at = 0, square = 0;

    for (PetscInt i = 0; i < n; i++) at += X[i * p + j] / n;
    for (PetscInt i = 0; i < n; i++) {
      A[j * rows + i] = X[i * p + j] - at;
      square += A[j * rows + i] * A[j * rows + i];
    }
    if (n > 0 && square < CONSTANT_FEATURE * CONSTANT_FEATURE * n)
      PetscCall(PetscArrayzero(A + j * rows, n)); /* gcc 14: n < 0 */
    A[j * rows + n + j] = PetscSqrtReal(RIDGE * square);
  }
  PetscCall(HycoNNLS(rows, p, A, b, c, &residual));
  PetscCall(PetscFree2(A, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The standard normal quantile (Abramowitz and Stegun 26.2.23; its error is below 5e-4). */
static PetscReal NormalQuantile(PetscReal share)
{
  const PetscReal t = PetscSqrtReal(-2 * PetscLogReal(share > 0.5 ? 1 - share : share)),
                  z = t -
                      (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)));

  return share > 0.5 ? z : -z;
}

/* An upper tolerance limit of a normal sample of n independent values, with CONFIDENCE: the mean plus this many
   standard deviations (Natrella's approximation). */
static PetscReal ToleranceFactor(PetscInt n, PetscReal share)
{
  const PetscReal z = NormalQuantile(share), m = (PetscReal)PetscMax(n, 2);

  return z + NormalQuantile(CONFIDENCE) * PetscSqrtReal(1 / m + z * z / (2 * (m - 1)));
}

/* The limit that `share` of values like these n do not exceed. Among few values the quantile is their largest, which
   later ones exceed too often: the tolerance limit then counts, too. */
static PetscErrorCode CalibrationLimit(PetscInt n, PetscInt independent, PetscReal value[], PetscReal share,
                                       PetscReal *limit)
{
  PetscReal mean = 0, square = 0;

  PetscFunctionBegin;
  PetscCall(PetscSortReal(n, value));
  /* The (n + 1)-rule: of later values of the same distribution this share lies below on average. */
  *limit = value[PetscMin((PetscInt)PetscCeilReal(share * (PetscReal)(n + 1) * (1 - 1e-12)), n) - 1];
  *limit = PetscMax(*limit, value[n - 1] - MOST_ABOVE_LIMIT);
  if (n < 2 || (PetscReal)independent * (1 - share) >= MANY_ABOVE) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < n; i++) mean += value[i] / n;
  for (PetscInt i = 0; i < n; i++) square += PetscSqr(value[i] - mean) / (n - 1);
  *limit = PetscMax(*limit, mean + ToleranceFactor(independent, share) * PetscSqrtReal(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y minus the formula without its constant. */
static PetscReal CalibrationExcess(PetscInt p, const PetscReal X[], PetscReal y, const PetscReal c[])
{
  for (PetscInt j = 0; j < p; j++) y -= c[j] * X[j];
  return y;
}

/* Values of one group (of one solution) are not independent. Quadratic, for some hundred rows. */
static PetscInt CountGroups(PetscInt n, const PetscInt group[])
{
  PetscInt count = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscInt k = 0;

    while (k < i && group[k] != group[i]) k++;
    count += k == i;
  }
  return count;
}

/* c[p]: the constant such that `share` of the y lie below the formula with exponents c[0 .. p). X: n x p by rows, in
   logarithms. The exponents stay: for errors of too few rows to fit their own. */
PetscErrorCode HycoRaiseBound(PetscInt n, const PetscInt group[], PetscInt p, const PetscReal X[], const PetscReal y[],
                              PetscReal share, PetscReal c[])
{
  PetscReal *above;

  PetscFunctionBegin;
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_PLIB, "there is nothing to bound");
  PetscCall(PetscMalloc1(n, &above));
  for (PetscInt i = 0; i < n; i++) above[i] = CalibrationExcess(p, X + i * p, y[i], c);
  PetscCall(CalibrationLimit(n, CountGroups(n, group), above, share, &c[p]));
  PetscCall(PetscFree(above));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* above[]: by row, y minus the formula; on return y minus the formula that is fitted without the rows of its group,
   because a formula follows the rows to which it was fitted more closely than others. A row far from all others alone
   determines the formula there: its difference is raised by MOST_LEVERAGE at most. */
static PetscErrorCode LeaveOut(PetscInt n, PetscInt explanatory, const PetscInt group[], PetscInt p,
                               const PetscReal X[], const PetscReal y[], PetscReal above[])
{
  PetscReal *rest, *z, *c;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n * p, &rest, n, &z, p + 1, &c));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt kept = 0;

    for (PetscInt k = 0; k < explanatory; k++) {
      if (group[k] == group[i]) continue;
      PetscCall(PetscArraycpy(rest + kept * p, X + k * p, p));
      z[kept++] = y[k];
    }
    PetscCall(PetscArrayzero(c, p));
    if (kept) PetscCall(CalibrationFit(kept, p, rest, z, c));
    above[i] = PetscMin(CalibrationExcess(p, X + i * p, y[i], c), above[i] + MOST_LEVERAGE);
  }
  PetscCall(PetscFree3(rest, z, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exponents c[0 .. p) from the first `telling` rows, and the constant c[p] from all n rows, judged by fits without each
   row's group. Share of values below: `share`. Rows beyond `telling` have errors of round-off, which say nothing of the
   exponents. */
PetscErrorCode HycoUpperBound(PetscInt n, PetscInt explanatory, const PetscInt group[], PetscInt p, const PetscReal X[],
                              const PetscReal y[], PetscReal share, PetscReal c[])
{
  PetscReal *above;

  PetscFunctionBegin;
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_PLIB, "there is nothing to bound");
  PetscCall(CalibrationFit(explanatory, p, X, y, c));
  PetscCall(PetscMalloc1(n, &above));
  for (PetscInt i = 0; i < n; i++) above[i] = CalibrationExcess(p, X + i * p, y[i], c);
  PetscCall(LeaveOut(n, explanatory, group, p, X, y, above));
  PetscCall(CalibrationLimit(n, CountGroups(n, group), above, share, &c[p]));
  PetscCall(PetscFree(above));
  PetscFunctionReturn(PETSC_SUCCESS);
}
