/*
  Coulomb's law as a cone: with the trial forces y = r - rho w the radius of the disk of tangential forces is mu P_+(y_n),

    P(y) = (y_n^+, y_t min(1, R / |y_t|)),     R = mu y_n^+ + g.

  The data of a block are mu and g. Forces that the law admits have g = 0; with mu = 0 it is a threshold g (Tresca), as in
  an iteration in which the radius is that of the last one (freeze).
*/
#include <hycoconeimpl.h>

/* |y_t|, 0 in a block of the normal component alone. */
static PetscReal Tangential(PetscInt size, const PetscReal y[])
{
  PetscReal sum = 0;

  for (PetscInt i = 1; i < size; i++) sum += y[i] * y[i];
  return PetscSqrtReal(sum);
}

/* Not the projection onto a fixed convex set: the radius depends on y_n itself, so that J is not symmetric. */
static PetscErrorCode Project(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal z[])
{
  const PetscReal length = Tangential(cone->size, y);
  PetscReal radius;

  PetscFunctionBegin;
  z[0] = y[0] < 0 ? 0 : y[0]; /* keeps NaN */
  radius = data[0] * z[0] + data[1];
  for (PetscInt i = 1; i < cone->size; i++) z[i] = length <= radius ? y[i] : y[i] * (radius / length);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stick needs a radius: at an open contact nothing is kept. */
static PetscErrorCode Derivative(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal J[])
{
  const PetscInt size = cone->size;
  const PetscReal length = Tangential(size, y), radius = data[0] * PetscMax(y[0], 0) + data[1];

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(J, size * size));
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu = 0 and the threshold of the last forces (Tresca's law): with it P is the projection onto a fixed convex set. */
static PetscErrorCode Freeze(HycoCone cone, const PetscReal data[], const PetscReal r[], PetscReal frozen[])
{
  PetscFunctionBegin;
  (void)cone;
  frozen[0] = 0;
  frozen[1] = data[0] * PetscMax(r[0], 0) + data[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not nonnegative even where the coefficient is 0: the tangential rows then have the one admissible force 0. */
PetscErrorCode HycoConeCreate_Coulomb(HycoCone cone)
{
  const struct _HycoConeOps ops = {.project = Project, .derivative = Derivative, .freeze = Freeze};

  PetscFunctionBegin;
  PetscCall(HycoConeSetOps(cone, &ops, 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}
