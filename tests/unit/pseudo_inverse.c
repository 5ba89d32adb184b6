/* A pseudo-inverse. */
#include "check.h"
#include <hycoalgorithms.h>

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
  PetscCall(Inverts());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
