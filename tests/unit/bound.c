/* The scale of a law by held-out points: its quantile, none of too few, its word at points not used for it; the scales
   of a condensed model's estimates; how fast divided differences fall; a pseudo-inverse. */
#include "check.h"
#include <hycocondensed.h>
#include <math.h>

static PetscErrorCode Quantile(void)
{
  const PetscReal error[4] = {3, 1, 8, 2}, law[4] = {1, 1, 2, 4};
  PetscReal many[19], ones[19], scale;

  PetscFunctionBegin;
  PetscCall(HycoConformalScale(4, error, law, 0.8, &scale)); /* ceil(0.8 * 5) = 4: the largest of 3, 1, 4, 0.5 */
  CHECK_NEAR(scale, 4, 0);
  PetscCall(HycoConformalScale(4, error, law, 0.6, &scale));
  CHECK_NEAR(scale, 3, 0);
  PetscCall(HycoConformalScale(4, error, law, 0.95, &scale));
  CHECK(scale < 0, "four points bound no 95 %%, and gave %g", (double)scale);
  for (PetscInt i = 0; i < 19; i++) {
    many[i] = i;
    ones[i] = 1;
  }
  PetscCall(HycoConformalScale(19, many, ones, 0.95, &scale)); /* ceil(0.95 * 20) = 19, whatever the rounding */
  CHECK_NEAR(scale, 18, 0);
  PetscCall(HycoConformalScale(18, many, ones, 0.95, &scale));
  CHECK(scale < 0, "18 points bound no 95 %%, and gave %g", (double)scale);
  ones[7] = 0;
  PetscCall(HycoConformalScale(19, many, ones, 0.95, &scale));
  CHECK(scale < 0, "a law of 0 was scaled by %g", (double)scale);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of exchangeable ratios the next is bounded in 19 of 20 cases: 2000 draws within four standard deviations. */
static PetscErrorCode Covers(void)
{
  unsigned long long state = 11;
  PetscInt held = 0;

  PetscFunctionBegin;
  for (PetscInt trial = 0; trial < 2000; trial++) {
    PetscReal error[20], law[20], scale;

    for (PetscInt i = 0; i < 20; i++) {
      law[i] = exp(5 * (double)Draw(&state));
      error[i] = law[i] * exp(2 * (double)Draw(&state));
    }
    PetscCall(HycoConformalScale(19, error, law, 0.95, &scale));
    held += scale * law[19] >= error[19];
  }
  CHECK(fabs((double)held / 2000 - 0.95) < 0.02, "%d of 2000 bounded", (int)held);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Calibrates(void)
{
  HycoCondensed c;
  PetscReal u[19], lambda[19], law[19 * HYCO_N_LAWS];

  PetscFunctionBegin;
  PetscCall(HycoCondensedCreate(1, 1, 1, &c));
  for (PetscInt i = 0; i < 19; i++) {
    for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[i * HYCO_N_LAWS + j] = 1 + j;
    u[i] = 0.1 * (i + 1);
    lambda[i] = 10 * (i + 1);
  }
  PetscCall(HycoCondensedCalibrate(c, 19, u, lambda, law));
  CHECK_NEAR(c->scale[HYCO_LAW_U], 1.9, 1e-15);
  CHECK_NEAR(c->scale[HYCO_LAW_LAMBDA], 95, 1e-13);
  CHECK_NEAR(c->scale[HYCO_LAW_U_FULL], 95, 1e-13);
  PetscCall(HycoCondensedCalibrate(c, 5, u, lambda, law));
  CHECK_NEAR(c->scale[HYCO_LAW_U], 1, 0); /* errors of 0.1 to 0.5 by laws of 1 lower nothing: five are too few */
  CHECK_NEAR(c->scale[HYCO_LAW_LAMBDA], 25, 1e-13); /* above 50 by 2 */
  PetscCall(HycoCondensedDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1/(x + 1.5): differences of order k are c (x0 + 1.5)^-1 ..., whose fall tends to 1 / (1.5 + sqrt(1.25)) in units of
   a quarter of the range; |x| has none that lasts. */
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
  PetscCall(Quantile());
  PetscCall(Covers());
  PetscCall(Calibrates());
  PetscCall(Decays());
  PetscCall(Inverts());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
