/* Coulomb's projection of a contact's forces (coulomb.c), for the cone and for programs of models. */
#ifndef HYCOCOULOMB_H
#define HYCOCOULOMB_H

#include <petscsys.h>

/* -- begin: in exported models too -- */
/* |y_t|, 0 in a block of the normal component alone. */
static inline PetscReal HycoTangential(PetscInt size, const PetscReal y[])
{
  PetscReal sum = 0;

  for (PetscInt i = 1; i < size; i++) sum += y[i] * y[i];
  return PetscSqrtReal(sum);
}

/* Not the projection onto a fixed convex set: the radius depends on y_n itself, so that J is not symmetric. */
static inline void HycoCoulombProject(PetscInt size, const PetscReal data[], const PetscReal y[], PetscReal z[])
{
  const PetscReal length = HycoTangential(size, y);
  PetscReal radius;

  z[0] = y[0] < 0 ? 0 : y[0]; /* keeps NaN */
  radius = data[0] * z[0] + data[1];
  for (PetscInt i = 1; i < size; i++) z[i] = length <= radius ? y[i] : y[i] * (radius / length);
}

/* Stick needs a radius: at an open contact nothing is kept. */
static inline void HycoCoulombDerivative(PetscInt size, const PetscReal data[], const PetscReal y[], PetscReal J[])
{
  const PetscReal length = HycoTangential(size, y), radius = data[0] * PetscMax(y[0], 0) + data[1];

  for (PetscInt i = 0; i < size * size; i++) J[i] = 0;
  J[0] = y[0] > 0;
  for (PetscInt i = 1; i < size && radius > 0; i++) {
    if (length <= radius) {
      J[i * size + i] = 1;
      continue;
    }
    /* Slip: dz_t/dy_n = mu y_t / |y_t|; along the direction of slip z_t does not change with y_t, so that in 2D this
       is the row's only entry. */
    J[i * size] = y[0] > 0 ? data[0] * (y[i] / length) : 0;
    for (PetscInt j = 1; j < size && size > 2; j++)
      J[i * size + j] = radius / length * ((i == j) - (y[i] / length) * (y[j] / length));
  }
}
/* -- end: in exported models too -- */

#endif
