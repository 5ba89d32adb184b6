/* The projection-based model (44): its data and its training. */
#ifndef HYCOPROJECTION_H
#define HYCOPROJECTION_H

#include <hycogalerkin.h>

/* The basis of the contact forces; fe: no basis, the finite-element multipliers as in the other models. */
typedef enum { HYCO_DUAL_FE, HYCO_DUAL_NNMF, HYCO_DUAL_SNAPSHOTS } HycoDual;
extern const char *const HycoDuals[]; /* their names in options and files; NULL ends */

/* The whole mesh is the RID; no full-order unknown, no dual snapshot. Also the first part of the data of the
   cubature model. */
typedef struct _n_HycoProjection {
  struct _n_HycoGalerkinModel galerkin;
  HycoDual dual;
  PetscInt l_lambda;
  PetscReal *V_lambda;   /* N_lambda x l_lambda column major, no entry negative, columns of unit 2-norm */
  PetscReal dual_misfit; /* |S_lambda - V_lambda H|^2 / |S_lambda|^2 with the best H >= 0 of the training */
} * HycoProjectionModel;

/* Training options and data of a run; the first part of t->training. */
typedef struct _n_HycoForceBasis {
  HycoDual dual;
  PetscInt max_its, vectors; /* of the factorisation; 0: as many vectors as modes */
  PetscInt n_supremizers;    /* how many modes, at the end, are supremizers */
} * HycoForceBasis;

/* In create: sets how forces enter the reduced system. */
void HycoProjectionInit(HycoProjectionModel projection);
PetscErrorCode HycoProjectionSetUp(HycoROM model);
PetscErrorCode HycoProjectionMove(HycoROM model, HycoH5 file);
PetscErrorCode HycoProjectionViewForces(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoProjectionDestroy(HycoROM model);

/* Implementations of the training ops (force_basis.c). HycoForceBasisSetFromOptions() sets the first part of
   t->training, whose `dual` is the default. */
PetscErrorCode HycoForceBasisSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoProjectionSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoProjectionModes(HycoReducer reducer, HycoSnapshots store);
PetscErrorCode HycoProjectionBuild(HycoROM model, HycoReducer reducer);
/* Parts of these on rank 0: V_lambda from the dual snapshots (fe: none); the check that refuses a useless model. */
PetscErrorCode HycoProjectionMakeBasis(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionJudge(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionReport(HycoReducer reducer, HycoROM model, HycoTraining *report);
PetscBool HycoProjectionOffers(HycoReducer reducer, PetscBool targets, size_t length, char why[]);

#endif
