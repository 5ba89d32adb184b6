/* Gravity, and the centrifugal force of rotating bodies: the solution is static in the rotating frame. */
#include "inertia.h"
#include <hycovector.h>

/* Entries that do not depend on the position, evaluated at the origin. For gravity and axes: each is one vector for all
   bodies. */
static PetscErrorCode InertiaVector(HycoFE fe, HycoExpr const e[3], PetscReal v[3])
{
  const PetscReal nowhere[3] = {0, 0, 0};

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    v[c] = 0;
    if (e[c]) PetscCall(HycoExprEval(e[c], fe->mu, 1, nowhere, &v[c]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the axis: z in 2D, y in an axisymmetric scene; in 3D the scene gives it. */
static PetscErrorCode SetAxis(HycoFE fe, const HycoMotion *m, HycoAcceleration *a)
{
  PetscReal length;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    HycoCheck(fe->dim == 3 || !m->axis[c],
              "%s: the axis is given in 3D only; in 1D and 2D it is z, in an axisymmetric scene y; remove the entry",
              HycoExprKey(m->axis[c]));
    HycoCheck(fe->formulation != HYCO_AXISYMMETRIC || !m->through[c],
              "%s: an axisymmetric scene rotates about its axis", HycoExprKey(m->through[c]));
    HycoCheck(c < fe->dim || !m->through[c], "%s: the mesh has %d space dimension%s", HycoExprKey(m->through[c]),
              (int)fe->dim, fe->dim == 1 ? "" : "s");
  }
  PetscCall(InertiaVector(fe, m->axis, a->axis));
  PetscCall(InertiaVector(fe, m->through, a->through));
  /* Perpendicular to the plane, or the axis of revolution. */
  if (fe->dim < 3) a->axis[fe->formulation == HYCO_AXISYMMETRIC ? 1 : 2] = 1;
  length = HycoLength(a->axis);
  HycoCheck(length > 0, "rotation has no axis; write rotation: {axis: {z: 1}} or another direction");
  for (PetscInt c = 0; c < 3; c++) a->axis[c] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluated once per body and parameter value, not per point: gravity (m/s^2), axis, square of the angular velocity. */
PetscErrorCode HycoAccelerationSet(HycoFE fe, const HycoBody *body, HycoAcceleration *a)
{
  const HycoMotion *m = &fe->scene->motion;
  const PetscReal nowhere[3] = {0, 0, 0};
  PetscReal speed;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(a, sizeof(*a)));
  /* A body without density has no weight. */
  a->any = HycoSceneHasInertia(fe->scene, body, NULL);
  if (!a->any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(InertiaVector(fe, m->gravity, a->gravity));
  HycoCheck(fe->formulation != HYCO_AXISYMMETRIC || a->gravity[0] == 0,
            "gravity_x: in an axisymmetric scene x is the radius, and gravity acts along y");
  if (!m->speed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoExprEval(m->speed, fe->mu, 1, nowhere, &speed));
  a->square = speed * speed;
  PetscCall(SetAxis(fe, m, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rho (g + omega^2 r), r the vector from the axis (N/m^3). */
PetscErrorCode HycoInertiaForce(HycoFE fe, const HycoBody *body, const HycoAcceleration *a, const PetscReal x[3],
                                PetscReal force[3])
{
  PetscReal density, along = 0;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) force[c] = 0;
  if (!a->any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoExprEval(body->density, fe->mu, 1, x, &density));
  HycoCheck(density >= 0, "%s is %g at x = %g, y = %g, z = %g; a density must be 0 or more", HycoExprKey(body->density),
            (double)density, (double)x[0], (double)x[1], (double)x[2]);
  /* The distance vector is what is left of x - through without its part along the axis. */
  for (PetscInt c = 0; c < 3; c++) along += (x[c] - a->through[c]) * a->axis[c];
  for (PetscInt c = 0; c < 3; c++)
    force[c] = density * (a->gravity[c] + a->square * (x[c] - a->through[c] - along * a->axis[c]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
