/*
  Coulomb's law as a cone: with the trial forces y = r - rho w the radius of the disk of tangential forces is mu
  P_+(y_n),

    P(y) = (y_n^+, y_t min(1, R / |y_t|)),     R = mu y_n^+ + g.

  The data of a block are mu and g. Forces that the law admits have g = 0; with mu = 0 it is a threshold g (Tresca), as
  in an iteration in which the radius is that of the last one (freeze).
*/
#include <hycoconeimpl.h>
#include <hycocoulomb.h>

static PetscErrorCode CoulombProject(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal z[])
{
  PetscFunctionBegin;
  HycoCoulombProject(cone->size, data, y, z);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CoulombDerivative(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal J[])
{
  PetscFunctionBegin;
  HycoCoulombDerivative(cone->size, data, y, J);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu = 0 and the threshold of the last forces (Tresca's law): with it P is the projection onto a fixed convex set. */
static PetscErrorCode CoulombFreeze(HycoCone cone, const PetscReal data[], const PetscReal r[], PetscReal frozen[])
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
  const struct _HycoConeOps ops = {.project = CoulombProject, .derivative = CoulombDerivative, .freeze = CoulombFreeze};

  PetscFunctionBegin;
  PetscCall(HycoConeSetOps(cone, &ops, 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}
