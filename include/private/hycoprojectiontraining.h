/* The training of projection-based models: the basis of the contact forces. */
#ifndef HYCOPROJECTIONTRAINING_H
#define HYCOPROJECTIONTRAINING_H

#include <hycogalerkintraining.h>
#include <hycoprojection.h>

/* Training options and data of a run; the first part of t->training. */
typedef struct _n_HycoForceBasis {
  HycoDual dual;
  PetscInt max_its, vectors; /* of the factorisation; 0: as many vectors as modes */
  PetscInt n_supremizers;    /* how many modes, at the end, are supremizers */
} * HycoForceBasis;

/* Implementations of the training ops (force_basis.c). HycoForceBasisSetFromOptions() sets the first part of
   t->training, whose `dual` is the default. */
PetscErrorCode HycoForceBasisSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoProjectionModes(HycoReducer reducer, HycoSnapshots store);
/* Parts of these on rank 0: V_lambda from the dual snapshots (fe: none); the check that refuses a useless model. */
PetscErrorCode HycoProjectionMakeBasis(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionJudge(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionReport(HycoReducer reducer, HycoROM model, HycoTraining *report);

#endif
