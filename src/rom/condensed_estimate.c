/*
  The estimated errors of a condensed model. Along a parameter with n training values x_k the interpolation's remainder
  is f[x_1 .. x_n, mu] times the product of mu - x_k: training finds the divided difference of the errors by leaving
  values out, one order lower, and its decay (condense_errors.c); the product is known at any point. Summed over the
  parameters that is the law, of the forces as of the displacement, to which comes what the modes cut off. Held-out
  solutions, where there are any, give the scale by which the law is multiplied; without, it stands alone.
*/
#include <hycocondensed.h>

void HycoCondensedLaw(HycoCondensed c, const PetscReal mu[], PetscReal law[])
{
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[j] = c->law ? HYCO_LAW_FLOOR : -1;
  if (!c->law) return;
  for (PetscInt p = 0; p < c->dim; p++) {
    const PetscReal *of = c->law + p * HYCO_N_LAWS;
    PetscReal shape = 1;

    if (c->affine[p] || c->n[p] == 1) continue;
    shape =
        c->flat[p] ? HycoPolynomialGrowth(c->n[p], c->x[p], mu[p]) : HycoPolynomialProduct(c->n[p], c->x[p], -1, mu[p]);
    for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[j] = of[j] < 0 || law[j] < 0 ? -1 : law[j] + of[j] * shape;
  }
  if (law[HYCO_LAW_U] >= 0) law[HYCO_LAW_U] += c->cut;
}
