/* The gradient of a state at full order, and what a path carries of it from one step to the next. */
#ifndef SENSITIVITY_STEP_H
#define SENSITIVITY_STEP_H

#include <hycogradient.h>
#include <hycopath.h>

/* The derivatives by the parameters of what the steps of a path hand on: with friction the places of the surfaces, from
   which the next step's slips count, and the work so far; the laws' states. */
typedef struct _n_HycoSensitivityStep *HycoSensitivityStep;
PetscErrorCode HycoSensitivityCreate(HycoFOM fom, HycoSensitivityStep *along);
/* NULL-safe. */
PetscErrorCode HycoSensitivityDestroy(HycoSensitivityStep *along);
/* The step from t0 to the path's accepted state, with K as its consistent tangent; *able false: it has no derivatives
   by the system of its contacts. Collective, as all functions below but those that are named. */
PetscErrorCode HycoSensitivityAdvance(HycoSensitivityStep along, PetscReal t0, PetscBool *able);
/* Whether the step's contacts slide with friction: L, and all vectors like it, then have a row for each tangent. Not
   collective, as the next two. */
PetscBool HycoSensitivityHasFriction(HycoSensitivityStep along);
/* Whether the path depends on what the steps before it have left, and all forces on all parameters. */
PetscBool HycoSensitivityFlows(HycoSensitivityStep along);
/* As HycoFEImbalance(), of all cells, at the parameters of fe, `step` along a parameter; u is overwritten where it is
   fixed. */
PetscErrorCode HycoSensitivityImbalance(HycoSensitivityStep along, PetscInt parameter, PetscReal step, PetscReal u[],
                                        PetscReal r[]);
/* The rows with tangents at the parameters of fe_surface, `step` along a parameter. Not collective. */
PetscErrorCode HycoSensitivityRows(HycoSensitivityStep along, PetscInt parameter, PetscReal step, HycoRows *rows);
/* The coefficients there at the contacts' first rows, 0 at others. Not collective. */
PetscErrorCode HycoSensitivityCoefficients(HycoSensitivityStep along, PetscReal mu[]);
/* Adds what the step changes in the derivatives of the work: L and w = D - B U with their derivatives. */
PetscErrorCode HycoSensitivitySpend(HycoSensitivityStep along, PetscInt parameter, Vec L, Vec w, Vec dL, Vec dw);
/* Takes the places and states at the end of the step, for displacements U + step dU at the parameter's points; *smooth
   false: a law's slopes to the two sides differ, or it fails. */
PetscErrorCode HycoSensitivityAccept(HycoSensitivityStep along, const PetscReal mu[], const HycoDifference *difference,
                                     Vec U, Vec dU, PetscBool *smooth);
/* Shows outputs the friction of L + step dL (all rows) at fe's parameters; stresses and reactions are those of f->U, as
   the laws have it there. */
PetscErrorCode HycoSensitivityView(HycoSensitivityStep along, PetscInt parameter, PetscReal step, Vec L, Vec dL);
/* Ends the step, with the path at its own state again: what was shown is taken back, and what was taken is handed
   on. */
PetscErrorCode HycoSensitivityEnd(HycoSensitivityStep along);

/* The gradient of the present state at f's parameters, in `store` (NULL: its outputs are not wanted); along: of a step
   that HycoSensitivityAdvance() has begun; else NULL. *regular false: it has none by the system
   of its contacts; not at a point, where that is an error. */
PetscErrorCode HycoFOMStateGradient(HycoFOM fom, HycoSensitivityStep along, HycoGradientStore *store,
                                    HycoGradient *gradient, PetscBool *regular);

#endif
