/* Results of each contact of the scene: its resultant and moment on the slave's side, area, largest pressure. */
#include <hycocontactimpl.h>
#include <hycokinematics.h>
#include <string.h>

/* Adds the area and the force of the contacts of k's contact at the middle of k's facets, whose ends include k's slave
   node. */
static void AddMiddles(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscReal area[], const PetscReal lambda[],
                       PetscReal *size, PetscReal *force)
{
  HycoMesh m = fe->mesh;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf, group = m->facet_group[f];

    if (node[0] != pairs->slave[k] && node[1] != pairs->slave[k]) continue;
    if (strcmp(m->group_name[group], fe->scene->contact[pairs->contact[k]]->slave)) continue;
    for (PetscInt j = 0; j < pairs->n; j++) {
      if (pairs->contact[j] != pairs->contact[k] || pairs->slave[j] != node[2]) continue;
      *size += area[j];
      *force += lambda[j];
    }
  }
}

PetscReal HycoContactPressure(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscReal area[],
                              const PetscReal lambda[])
{
  PetscReal size = area[k], force = lambda[k];

  if (HycoNodeHasNoArea(fe, pairs->slave[k])) AddMiddles(fe, pairs, k, area, lambda, &size, &force);
  return size > 0 ? force / size : 0;
}

/* Adds the contribution of potential contact k. */
static void Add(HycoFE fe, const PetscReal x[3], const PetscReal normal[3], PetscReal area, PetscReal lambda,
                PetscReal pressure, HycoContactResult *r)
{
  const PetscBool around = (PetscBool)(fe->formulation == HYCO_AXISYMMETRIC);
  PetscReal push[3];

  r->n_active++;
  r->area += area;
  r->pressure = PetscMax(r->pressure, pressure);
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
    if (lambda[k] > least)
      Add(fe, fe->X + 3 * pairs->slave[k], normal + 3 * k, area[k], lambda[k],
          HycoContactPressure(fe, pairs, k, area, lambda), r);
  }
}
