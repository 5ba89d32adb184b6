/* Forces of gravity and rotation per unit volume: private to fe/. */
#ifndef HYCO_INERTIA_H
#define HYCO_INERTIA_H
#include <hycokinematics.h>

/* The scene's gravity and rotation at fe's parameters. */
typedef struct {
  PetscBool any;
  PetscReal gravity[3], square, axis[3], through[3]; /* square: of the angular speed; axis: unit vector; through: a
                                                        point on the axis */
} HycoAcceleration;

/* For one body: zero if it has no density. Fails for an axis without a direction. */
PetscErrorCode HycoAccelerationSet(HycoFE fe, const HycoBody *body, HycoAcceleration *a);
/* density (gravity + speed^2 times the distance vector from the axis) at x; 0 where there is none. */
PetscErrorCode HycoInertiaForce(HycoFE fe, const HycoBody *body, const HycoAcceleration *a, const PetscReal x[3],
                                PetscReal force[3]);

#endif
