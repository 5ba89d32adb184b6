/* DEIM and Q-DEIM on a basis small enough to compute by hand, pivoted columns and singular values. On any number of
   ranks. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

static PetscErrorCode Make(PetscInt rows, PetscInt cols, const PetscReal v[], Mat *V)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, rows, cols, NULL, V));
  PetscCall(MatGetOwnershipRange(*V, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++) {
    for (PetscInt j = 0; j < cols; j++) PetscCall(MatSetValue(*V, i, j, v[i * cols + j], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*V, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*V, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Columns (1 2 -4 0 1), (1 1 1 3 0), (0 1 0 0 2).
  1: largest of column 1 is row 2 (-4).
  2: c = 1 / -4; residual 1.25 1.5 0 3 0.25: row 3.
  3: c solves rows 2, 3: c2 = 0 (row 3: 0 c1 + 3 c2 = 0), c1 = 0; residual 0 1 0 0 2: row 4.
*/
static PetscErrorCode TestByHand(void)
{
  const PetscReal v[15] = {1, 1, 0, 2, 1, 1, -4, 1, 0, 0, 3, 0, 1, 0, 2};
  const PetscInt expected[3] = {2, 3, 4};
  PetscInt index[3];
  PetscReal rows[6];
  const PetscInt wanted[2] = {4, 0};
  Mat V;

  PetscFunctionBegin;
  PetscCall(Make(5, 3, v, &V));
  PetscCall(HycoDEIM(V, index));
  for (int k = 0; k < 3; k++)
    CHECK(index[k] == expected[k], "expected row %d, found %d", (int)expected[k], (int)index[k]);
  PetscCall(HycoGatherRows(V, 2, wanted, rows));
  for (int k = 0; k < 6; k++) CHECK_NEAR(rows[k], v[3 * wanted[k / 3] + k % 3], 0);
  PetscCall(MatDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Q-DEIM on rows (1 1), (0 2), (3 0), (0 -2): the longest is row 2; orthogonalising the others against (1 0) leaves (0
  1), (0 2), (0 -2): row 1, which ties with row 3. A rotation of the modes changes nothing (it would change DEIM's
  points).
*/
static PetscErrorCode TestPivotedQR(void)
{
  const PetscReal v[8] = {1, 1, 0, 2, 3, 0, 0, -2}, c = cos(0.7), s = sin(0.7);
  PetscReal turned[8];
  PetscInt index[2];

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 4; i++) {
    turned[2 * i] = c * v[2 * i] - s * v[2 * i + 1];
    turned[2 * i + 1] = s * v[2 * i] + c * v[2 * i + 1];
  }
  for (int k = 0; k < 2; k++) {
    Mat V;

    PetscCall(Make(4, 2, k ? turned : v, &V));
    PetscCall(HycoQDEIM(V, index));
    CHECK(index[0] == 2 && index[1] == 1, "expected rows 2, 1, found %d, %d", (int)index[0], (int)index[1]);
    PetscCall(MatDestroy(&V));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows equally large up to round-off: the lowest is taken. */
static PetscErrorCode TestTie(void)
{
  const PetscReal v[6] = {0.5, 1, -1, 1 + 1e-14, 1, 0.2};
  PetscInt index[1];
  Mat V;

  PetscFunctionBegin;
  PetscCall(Make(6, 1, v, &V));
  PetscCall(HycoDEIM(V, index));
  CHECK(index[0] == 1, "expected row 1, found %d", (int)index[0]);
  PetscCall(MatDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The property of any DEIM: l rows, each once, on which the basis is regular. */
static PetscErrorCode TestProperty(PetscErrorCode (*deim)(Mat, PetscInt[]))
{
  const PetscInt n = 60, l = 12;
  unsigned long long state = 99;
  PetscReal *v, *P, smallest, largest;
  PetscInt index[12];
  Mat V;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * l, &v, l * l, &P));
  for (PetscInt k = 0; k < n * l; k++) v[k] = Draw(&state);
  PetscCall(Make(n, l, v, &V));
  PetscCall(deim(V, index));
  PetscCall(HycoGatherRows(V, l, index, P));
  PetscCall(HycoExtremeSingularValues(l, l, P, &smallest, &largest));
  CHECK(smallest > 1e-3 * largest, "singular values of the chosen rows from %g to %g", smallest, largest);
  for (PetscInt a = 0; a < l; a++) {
    for (PetscInt b = 0; b < a; b++) CHECK(index[a] != index[b], "row %d twice", (int)index[a]);
  }
  PetscCall(MatDestroy(&V));
  PetscCall(PetscFree2(v, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sign of the determinant (rows exchanged: the other one), and of [1 1; 0 1] the golden ratio's square between its
   singular values; a random matrix as by its SVD; 0 where two rows are equal. */
static PetscErrorCode TestSingularity(void)
{
  const PetscReal J[4] = {1, 0, 1, 1}, swapped[4] = {0, 1, 1, 1}, equal[4] = {1, 1, 2, 2}, minus[1] = {-2};
  const PetscInt n = 30;
  unsigned long long state = 7;
  PetscReal *A, ratio, smallest, largest;
  PetscInt sign;

  PetscFunctionBegin;
  PetscCall(HycoSingularity(2, J, &sign, &ratio));
  CHECK(sign == 1, "sign %d", (int)sign);
  CHECK_NEAR(ratio, (3 - sqrt(5)) / 2, 1e-3);
  PetscCall(HycoSingularity(2, swapped, &sign, &ratio));
  CHECK(sign == -1, "sign %d", (int)sign);
  PetscCall(HycoSingularity(2, equal, &sign, &ratio));
  CHECK(sign == 0 && ratio == 0, "sign %d, ratio %g", (int)sign, ratio);
  PetscCall(HycoSingularity(1, minus, &sign, &ratio));
  CHECK(sign == -1, "sign %d", (int)sign);
  CHECK_NEAR(ratio, 1, 1e-14);
  PetscCall(PetscMalloc1(n * n, &A));
  for (PetscInt k = 0; k < n * n; k++) A[k] = Draw(&state);
  PetscCall(HycoSingularity(n, A, &sign, &ratio));
  PetscCall(HycoExtremeSingularValues(n, n, A, &smallest, &largest));
  CHECK_NEAR(ratio * largest / smallest, 1, 0.02);
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns (1 0), (0 3), (2 2), (0 3): the longest is column 1 (|.|^2 = 9; column 3 ties); the rest of the others is
   (1 0), (2 0), 0: then column 2. Singular values of diag(3, 4): 3 and 4; of [1 1; 0 1]: the golden ratio and its
   inverse. */
static PetscErrorCode TestDense(void)
{
  PetscReal A[8] = {1, 0, 0, 3, 2, 2, 0, 3};
  const PetscReal D[4] = {3, 0, 0, 4}, J[4] = {1, 0, 1, 1};
  PetscInt pivot[2];
  PetscReal smallest, largest;

  PetscFunctionBegin;
  PetscCall(HycoPivotColumns(2, 4, A, 2, pivot));
  CHECK(pivot[0] == 1 && pivot[1] == 2, "expected columns 1, 2, found %d, %d", (int)pivot[0], (int)pivot[1]);
  PetscCall(HycoExtremeSingularValues(2, 2, D, &smallest, &largest));
  CHECK_NEAR(smallest, 3, 1e-14);
  CHECK_NEAR(largest, 4, 1e-14);
  PetscCall(HycoExtremeSingularValues(2, 2, J, &smallest, &largest));
  CHECK_NEAR(largest, (1 + sqrt(5)) / 2, 1e-14);
  CHECK_NEAR(smallest, (sqrt(5) - 1) / 2, 1e-14);
  PetscCall(TestSingularity());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestByHand());
  PetscCall(TestTie());
  PetscCall(TestPivotedQR());
  PetscCall(TestProperty(HycoDEIM));
  PetscCall(TestProperty(HycoQDEIM));
  PetscCall(TestDense());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
