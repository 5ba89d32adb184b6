/*
  The estimated errors of a condensed model. Along a parameter with n training values x_k the interpolation's remainder
  is f[x_1 .. x_n, mu] times the product of mu - x_k: training finds the divided differences of the errors by leaving
  values out, one order lower, and their decay (condense_errors.c); the product is known at any point. The sum over the
  parameters is the estimate, for the forces and for the displacement, plus the truncation error of the modes. Held-out
  solutions, if there are any, calibrate it by a factor.
*/
#include <hycocondensed.h>

static void Law(HycoCondensed c, const PetscReal mu[], PetscReal law[])
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

/* Features of the error: the estimates for the forces and for the displacement. */
PetscErrorCode HycoCondensedFeatures(HycoROM m, PetscReal misfit[2])
{
  PetscReal law[HYCO_N_LAWS];

  PetscFunctionBegin;
  Law((HycoCondensed)m->work, m->fe->mu, law);
  misfit[0] = PetscMax(0, law[HYCO_LAW_LAMBDA]);
  misfit[1] = PetscMax(0, law[HYCO_LAW_U]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedEstimate(HycoROM m, HycoPrediction *p)
{
  const HycoCondensed c = (HycoCondensed)m->work;
  PetscReal growth = 1, law[HYCO_N_LAWS];

  PetscFunctionBegin;
  if (c->law) {
    Law(c, m->fe->mu, law);
    for (PetscInt j = 0; j < HYCO_N_LAWS; j++) law[j] = law[j] < 0 ? -1 : PetscMax(HYCO_LAW_FLOOR, law[j]);
    p->estimated_error_u = law[HYCO_LAW_U];
    p->estimated_error_lambda = p->interpolation_error = law[HYCO_LAW_LAMBDA];
    p->estimated_error_u_full = law[HYCO_LAW_U_FULL];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt q = 0; q < c->dim; q++) {
    if (!c->affine[q]) growth *= HycoPolynomialGrowth(c->n[q], c->x[q], m->fe->mu[q]);
  }
  p->estimated_error_lambda = p->interpolation_error;
  if (c->errors_u[0] < 0) PetscFunctionReturn(PETSC_SUCCESS); /* an older file */
  p->estimated_error_u = c->errors_u[0] * growth;
  p->estimated_error_u_full = c->errors_u[1] * growth;
  PetscFunctionReturn(PETSC_SUCCESS);
}
