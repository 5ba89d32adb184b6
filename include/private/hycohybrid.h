/* The hybrid hyper-reduced model (38)-(41): its data. */
#ifndef HYCOHYBRID_H
#define HYCOHYBRID_H

#include <hycogalerkin.h>

typedef struct _n_HycoReconstruction *HycoReconstruction;

typedef struct {
  struct _n_HycoGalerkinModel galerkin;
  PetscInt n_dual;             /* number of dual snapshots that are not zero */
  PetscReal *S_lambda;         /* N_lambda x n_dual column major; with friction a row for each normal and tangent */
  PetscInt reconstruct_solver; /* of (41), index in HycoReconstructSolvers */
} * HycoHybridModel;

typedef struct {
  struct _n_HycoGalerkin galerkin;
  HycoReconstruction reconstruction; /* data that (41) keeps between calls, created by the first */
} * HycoHybridWork;

/* (41): forces of all contacts from those of A_lambda (in model->Lambda) and the displacement. */
PetscErrorCode HycoHybridReconstruct(HycoROM model);
/* NULL-safe. */
PetscErrorCode HycoReconstructionDestroy(HycoReconstruction *reconstruction);
extern const char *const HycoReconstructSolvers[];

#endif
