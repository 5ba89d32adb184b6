/* The projection-based model (44). */
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

/* In create: sets how forces enter the reduced system. */
void HycoProjectionInit(HycoProjectionModel projection);
PetscErrorCode HycoProjectionSetUp(HycoROM model);
PetscErrorCode HycoProjectionMove(HycoROM model, HycoH5 file);
PetscErrorCode HycoProjectionViewForces(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoProjectionDestroy(HycoROM model);

#endif
