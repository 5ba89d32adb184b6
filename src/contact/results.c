/* Results of each contact of the scene: its resultant and moment on the slave's side, area, largest pressure. */
#include <hycocontactimpl.h>

/* Adds the contribution of potential contact k. */
static void Add(HycoFE fe, const PetscReal x[3], const PetscReal normal[3], PetscReal area, PetscReal lambda,
                HycoContactResult *r)
{
  const PetscBool around = (PetscBool)(fe->formulation == HYCO_AXISYMMETRIC);
  PetscReal push[3];

  r->n_active++;
  r->area += area;
  if (area > 0) r->pressure = PetscMax(r->pressure, lambda / area);
  for (PetscInt d = 0; d < 3; d++) push[d] = d < fe->dim ? -lambda * normal[d] : 0;
  if (around) push[0] = 0; /* the radial force is zero in the sum over the circle */
  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt e = (d + 1) % 3, g = (d + 2) % 3;

    r->force[d] += push[d];
    if (!around) r->moment[d] += x[e] * push[g] - x[g] * push[e];
  }
}

void HycoContactResults(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal area[],
                        const PetscReal lambda[], PetscReal least, HycoContactResult result[])
{
  for (PetscInt c = 0; c < fe->scene->n_contacts; c++)
    result[c] = (HycoContactResult){.name = fe->scene->contact[c]->name};
  for (PetscInt k = 0; k < pairs->n; k++) {
    HycoContactResult *r = &result[pairs->contact[k]];

    r->n++;
    if (lambda[k] > least) Add(fe, fe->X + 3 * pairs->slave[k], normal + 3 * k, area[k], lambda[k], r);
  }
}
