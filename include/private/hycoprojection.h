/* The projection-based model (44): its data and its training. */
#ifndef HYCOPROJECTION_H
#define HYCOPROJECTION_H

#include <hycogalerkin.h>

/* The basis of the contact forces; fe: none, the true multipliers of the other models. */
typedef enum { HYCO_DUAL_FE, HYCO_DUAL_NNMF, HYCO_DUAL_SNAPSHOTS } HycoDual;
extern const char *const HycoDuals[]; /* their words, as options and files have them; NULL ends */

/* The whole mesh is the RID; no full-order unknown, no dual snapshot. It begins the data of the cubature's model, too.
 */
typedef struct _n_HycoProjection {
  struct _n_HycoGalerkin galerkin;
  HycoDual dual;
  PetscInt l_lambda;
  PetscReal *V_lambda;   /* N_lambda x l_lambda column major, no entry negative, columns of unit 2-norm */
  PetscReal dual_misfit; /* |S_lambda - V_lambda H|^2 / |S_lambda|^2, the best H >= 0 that training found */
} * HycoProjectionROM;

/* What the options of the training say, and what a run makes of them; it begins t->training. */
typedef struct _n_HycoForceBasis {
  HycoDual dual;
  PetscInt max_its, vectors; /* of the factorisation; 0: as many as there are modes */
  PetscInt n_supremizers;    /* of the modes, the last */
} * HycoForceBasis;

/* In create: how forces go into the reduced system. */
void HycoProjectionInit(HycoProjectionROM projection);
PetscErrorCode HycoProjectionSetUp(HycoROM model);
PetscErrorCode HycoProjectionMove(HycoROM model, HycoH5 file);
PetscErrorCode HycoProjectionViewForces(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoProjectionDestroy(HycoROM model);

/* The training's part of the ops (force_basis.c); HycoForceBasisSetFromOptions(): into what t->training begins with,
   whose `dual` is the default. */
PetscErrorCode HycoForceBasisSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoProjectionSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoProjectionModes(HycoReducer reducer, HycoSnapshots store);
PetscErrorCode HycoProjectionBuild(HycoROM model, HycoReducer reducer);
/* Its parts on rank 0: V_lambda from the dual snapshots (fe: none); the judgement, which refuses a useless model. */
PetscErrorCode HycoProjectionMakeBasis(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionJudge(HycoROM model, HycoReducer reducer);
PetscErrorCode HycoProjectionReport(HycoReducer reducer, HycoROM model, HycoTraining *report);
PetscBool HycoProjectionOffers(HycoReducer reducer, PetscBool targets);

#endif
