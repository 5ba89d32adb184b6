/*
  The estimated errors of a condensed model. Along a parameter with n training values x_k the interpolation's remainder
  is f[x_1 .. x_n, mu] times the product of mu - x_k: training finds the divided difference of the errors by leaving
  values out, one order lower, and its decay (condense_errors.c); the product is known at any point. Summed over the
  parameters that is the law, of the forces as of the displacement, to which comes what the modes cut off. Held-out
  solutions, where there are any, give the scale by which the law is multiplied; without, it stands alone.
*/
#include <hycocondensed.h>

#define SHARE 0.95  /* of unseen points that the scaled law bounds */

void HycoCondensedLaw(HycoCondensed c, const PetscReal mu[], PetscReal law[])
{
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[j] = c->law ? HYCO_LAW_FLOOR : -1;
  if (!c->law) return;
  for (PetscInt p = 0; p < c->dim; p++) {
    const PetscReal *of = c->law + p * HYCO_N_LAWS;
    PetscReal shape = 1;

    if (c->affine[p] || c->n[p] == 1) continue;
    shape = c->flat[p] ? HycoPolynomialGrowth(c->n[p], c->x[p], mu[p])
                       : HycoPolynomialProduct(c->n[p], c->x[p], -1, mu[p]);
    for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[j] = of[j] < 0 || law[j] < 0 ? -1 : law[j] + of[j] * shape;
  }
  if (law[HYCO_LAW_U] >= 0) law[HYCO_LAW_U] += c->cut;
}

PetscErrorCode HycoCondensedCalibrate(HycoCondensed c, PetscInt n, const PetscReal error_u[],
                                      const PetscReal error_lambda[], const PetscReal law[])
{
  const PetscReal *error[2] = {error_u, error_lambda};
  const PetscInt of[2] = {HYCO_LAW_U, HYCO_LAW_LAMBDA};
  const PetscBool few = (PetscBool)(SHARE * (PetscReal)(n + 1) > (PetscReal)n); /* the law stands, above all of them */
  PetscReal *column;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &column));
  for (PetscInt k = 0; k < 2; k++) {
    for (PetscInt i = 0; i < n; i++) column[i] = law[i * HYCO_N_LAWS + of[k]];
    PetscCall(HycoConformalScale(n, error[k], column, SHARE, &c->scale[of[k]]));
    for (PetscInt i = 0; few && i < n; i++) {
      c->scale[of[k]] = column[i] > 0 ? PetscMax(PetscMax(1, c->scale[of[k]]), error[k][i] / column[i]) : -1;
      if (!(column[i] > 0)) break;
    }
  }
  c->scale[HYCO_LAW_U_FULL] = c->scale[HYCO_LAW_LAMBDA];
  PetscCall(PetscFree(column));
  PetscFunctionReturn(PETSC_SUCCESS);
}
