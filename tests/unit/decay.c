/* The decay of divided differences; a pseudo-inverse. */
#include "check.h"
#include <hycoalgorithms.h>
#include <math.h>

/* 1/(x + 1.5): differences of order k are c (x0 + 1.5)^-1 ..., whose ratio tends to 1 / (1.5 + sqrt(1.25)) in units
   of a quarter of the range; those of |x| do not decay in the long run. */
static PetscErrorCode Decays(void)
{
  PetscReal x[9], smooth[9], kink[9], decay[2];
  HycoTensor t = {1, {9}, {8}, {x}};

  PetscFunctionBegin;
  PetscCall(HycoChebyshevNodes(9, -1, 1, x));
  for (PetscInt k = 0; k < 9; k++) {
    smooth[k] = 1 / (x[k] + 1.5);
    kink[k] = fabs((double)x[k] - 0.1);
  }
  PetscCall(HycoTensorDecay(&t, 0, 1, smooth, &decay[0]));
  PetscCall(HycoTensorDecay(&t, 0, 1, kink, &decay[1]));
  CHECK(decay[0] > 0.3 && decay[0] < 0.55, "a pole at 1.5: %g", (double)decay[0]);
  CHECK(decay[1] > 0.6, "a kink: %g", (double)decay[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of rank 2: A P A = A, P A P = P, and A P symmetric. */
static PetscErrorCode Inverts(void)
{
  const PetscReal A[12] = {1, 2, 3, 2, 4, 6, 1, 0, 1, 3, 4, 7}; /* 3 x 4, columns: a, 2a, b, 2a + b - ... */
  PetscReal P[12], AP[9];

  PetscFunctionBegin;
  PetscCall(HycoPseudoInverse(3, 4, A, 1e-12, P));
  for (PetscInt i = 0; i < 3; i++) {
    for (PetscInt j = 0; j < 3; j++) {
      AP[i * 3 + j] = 0;
      for (PetscInt k = 0; k < 4; k++) AP[i * 3 + j] += A[k * 3 + i] * P[j * 4 + k];
    }
  }
  for (PetscInt i = 0; i < 3; i++) {
    for (PetscInt j = 0; j < 3; j++) CHECK_NEAR(AP[i * 3 + j], AP[j * 3 + i], 1e-14);
    for (PetscInt k = 0; k < 4; k++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < 3; j++) sum += AP[i * 3 + j] * A[k * 3 + j];
      CHECK_NEAR(sum, A[k * 3 + i], 1e-13);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(Decays());
  PetscCall(Inverts());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
