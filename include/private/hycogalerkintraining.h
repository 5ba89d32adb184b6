/* The end of the training of models with a reduced stiffness (hycogalerkin.h). */
#ifndef HYCOGALERKINTRAINING_H
#define HYCOGALERKINTRAINING_H

#include <hycogalerkin.h>
#include <hycoreducerimpl.h>

/* Scans the ranges for a singular reduced stiffness, with the points distributed over the ranks: the result is
   stored in the model, or the model is refused; then makes the table. `model` on every rank; changed on rank 0.
   Collective. */
PetscErrorCode HycoGalerkinFinish(HycoReducer reducer, HycoROM model, HycoTraining *report);
/* Creates a table of the reduced stiffness if that is a polynomial of the parameters on which it depends. */
PetscErrorCode HycoGalerkinTabulate(HycoROM model, const PetscBool reaches[]);
PetscReal HycoGalerkinCost(HycoReducer reducer, const HycoAttempt *attempt);

#endif
