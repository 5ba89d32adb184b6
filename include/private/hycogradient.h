/* Derivatives of outputs with respect to the parameters: the data are differentiated by differences along one parameter,
   the solution by the linear system of its closed contacts. */
#ifndef HYCOGRADIENT_H
#define HYCOGRADIENT_H

#include <hycofomimpl.h>
#include <hycosceneimpl.h>

/* Contacts with more than this share of the largest force count as closed where their masters are compared. */
#define HYCO_GRADIENT_FORCE 1e-7

/* Fails for a scene without outputs or parameters, and for one with a history. */
PetscErrorCode HycoGradientCheckScene(HycoScene scene);

/* The points of a difference along a parameter: mu + step[k], the first with step 0, weight[k] of the data there. */
typedef struct {
  PetscInt parameter;
  PetscReal step[3], weight[3];
  int sign; /* the direction of one-sided derivatives: 1; at the upper end of the range -1 */
} HycoDifference;

/* Central where the range has room for it, else of the same order to the inside. */
void HycoDifferenceSet(HycoScene scene, const PetscReal mu[], PetscInt parameter, HycoDifference *difference);
/* The one-sided difference in the direction `sign`. */
void HycoDifferenceTakeSide(HycoDifference *difference);
/* mu + step[k], at[n_variables]. */
void HycoDifferencePoint(const HycoDifference *difference, HycoScene scene, const PetscReal mu[], PetscInt k,
                         PetscReal at[]);
/* The same difference with a quarter of its step. */
void HycoDifferenceShrink(HycoDifference *difference);
/* By how much the slopes to the two sides differ; 0: by no more than a small share of `slope` (0: of the larger one), or
   by the round-off of values of this size. */
PetscReal HycoDifferenceJump(const HycoDifference *difference, PetscReal size, PetscReal slope,
                             const PetscReal value[3]);
/* Whether such a jump is a kink, and not curvature: it stays at a quarter of the step, with the values `closer`. */
PetscBool HycoDifferenceKinks(const HycoDifference *difference, PetscReal jump, const PetscReal closer[3]);

/* Allocates for the scene's outputs and parameters. */
PetscErrorCode HycoGradientCreate(HycoScene scene, HycoGradientStore *store, HycoGradient *gradient);
/* NULL-safe. */
PetscErrorCode HycoGradientDestroy(HycoGradientStore *store);
/* Sets output[n_outputs] at the point `at` (n_variables) of a parameter's difference, which lies `step` from mu. */
typedef PetscErrorCode (*HycoGradientMeasure)(void *context, const PetscReal at[], PetscReal step, PetscReal output[]);
/* Sets the column of the difference's parameter from the outputs at mu and at its points beside it (value: 3 n_outputs), if
   their slopes are the same to both sides; false: they are not, and HycoGradientColumn() tells kinks from curvature. */
PetscBool HycoGradientSetSmooth(HycoGradient *gradient, HycoGradientStore *store, const HycoDifference *difference,
                                PetscBool kink, const PetscReal value[]);
/* Sets the column of the difference's parameter from the outputs at its points beside mu, and where their slopes differ
   also at those of a quarter of the step, which tell a kink from curvature. value: room for 6 n_outputs, the first
   n_outputs those at mu; kink: the solution has one. As collective as `measure`. */
PetscErrorCode HycoGradientColumn(HycoGradient *gradient, HycoGradientStore *store, HycoScene scene,
                                  const PetscReal mu[], const HycoDifference *difference, PetscBool kink,
                                  HycoGradientMeasure measure, void *context, PetscReal value[]);

#endif
