/* Derivatives of outputs with respect to the parameters: the data are differentiated by differences along one
   parameter, the solution by the linear system of its closed contacts; a path by that of each of its steps, where its
   type has it, else by the paths beside it, in its own steps in time. */
#ifndef HYCOGRADIENT_H
#define HYCOGRADIENT_H

#include <hycofomimpl.h>
#include <hycosceneimpl.h>

/* Why there is no derivative where no contact force keeps a body. */
#define HYCO_GRADIENT_LOOSE                                                                                            \
  "no contact force keeps %s: its position is arbitrary here, and has no derivative; support it, or take a point at "  \
  "which contact holds it"

/* Fails for a scene without outputs or parameters. */
PetscErrorCode HycoGradientCheckScene(HycoScene scene);

/* The points of a difference along a parameter: mu + step[k], the first with step 0, weight[k] of the data there. */
typedef struct _n_HycoDifference {
  PetscInt parameter;
  PetscReal step[3], weight[3];
  int sign; /* the direction of one-sided derivatives: 1; at the upper end of the range -1 */
} HycoDifference;

/* Step as a share of a parameter's range, of differences of data: the error of a central difference is then about 1e-9
   (its square), that of round-off 1e-11. */
#define HYCO_GRADIENT_STEP   3e-5
#define HYCO_GRADIENT_CLOSER 2 /* differences of a quarter of the step, where slopes jump */
/* Step as a share of a parameter's range, of differences of paths: their round-off is that of Newton's method
   (HYCO_TIGHT_NEWTON), 1e-8 of a slope, as is the square of the step. */
#define HYCO_GRADIENT_PATH_STEP 1e-4
/* Central where the range has room for it, else of the same order to the inside. share: the step's, of the range. */
void HycoDifferenceSet(HycoScene scene, const PetscReal mu[], PetscInt parameter, PetscReal share,
                       HycoDifference *difference);
/* The one-sided difference in the direction `sign`. */
void HycoDifferenceTakeSide(HycoDifference *difference);
/* mu + step[k], at[n_variables]. */
void HycoDifferencePoint(const HycoDifference *difference, HycoScene scene, const PetscReal mu[], PetscInt k,
                         PetscReal at[]);
/* The same difference with a quarter of its step. */
void HycoDifferenceShrink(HycoDifference *difference);
/* By how much the slopes to the two sides differ; 0: by no more than a small share of `slope` (0: of the larger one),
   or by the round-off of values of this size. */
PetscReal HycoDifferenceJump(const HycoDifference *difference, PetscReal size, PetscReal slope,
                             const PetscReal value[3]);
/* Whether such a jump is a kink, and not curvature: it stays at a quarter of the step, with the values `closer`. */
PetscBool HycoDifferenceKinks(const HycoDifference *difference, PetscReal jump, const PetscReal closer[3]);

/* Allocates for the scene's outputs, parameters and listed times. */
PetscErrorCode HycoGradientCreate(HycoScene scene, HycoGradientStore *store, HycoGradient *gradient);
/* NULL-safe. */
PetscErrorCode HycoGradientDestroy(HycoGradientStore *store);
/* Sets output[n_outputs] at the point `at` (n_variables) of a parameter's difference, which lies `step` from mu. */
typedef PetscErrorCode (*HycoGradientMeasure)(void *context, const PetscReal at[], PetscReal step, PetscReal output[]);
/* Sets the column of the difference's parameter from the outputs at its points beside mu, and where their slopes differ
   also at those of a quarter of the step, which tell a kink from curvature. value: room for 6 gradient->n_outputs, the
   first n_outputs those at mu; kink: the solution has one. As collective as `measure`. */
PetscErrorCode HycoGradientColumn(HycoGradient *gradient, HycoGradientStore *store, HycoScene scene,
                                  const PetscReal mu[], const HycoDifference *difference, PetscBool kink,
                                  HycoGradientMeasure measure, void *context, PetscReal value[]);

/* -- paths -- */

/* most[n_quantities]: the largest of each output at the listed times, without its sign. */
void HycoPathLargest(HycoScene scene, const HycoStep step[], PetscReal most[]);
/* Solves the path at mu in the steps of the solution, as far as its end, without monitors and files; *step: at its
   n_times listed times, with the outputs. Borrowed until the next call. */
typedef PetscErrorCode (*HycoGradientFollow)(void *context, const PetscReal mu[], const HycoStep *step[]);
/* Fails if such a path did not end, or halved a step. */
PetscErrorCode HycoPathCheckPerturbed(PetscBool ended, PetscInt cuts, const char why[]);
/* Sets the gradient of a path from the paths at the points beside mu. step: n_times, of the solution, read before
   `follow` is called. As collective as `follow`. */
PetscErrorCode HycoGradientOfPath(HycoScene scene, const PetscReal mu[], const HycoStep step[],
                                  HycoGradientStore *store, HycoGradient *gradient, HycoGradientFollow follow,
                                  void *context);

/* Sets the derivatives of the extremes over the listed times from those at these, which are set. */
void HycoGradientOfExtremes(HycoScene scene, const PetscReal mu[], const HycoStep step[], HycoGradientStore *store,
                            const HycoGradient *gradient);

#endif
