/* HycoTrainer: snapshots -> POD, DEIM -> reduced integration domain -> hybrid model in a file (sections 4 and 5); or
   snapshots -> POD, NNMF -> projection-based model in a file (6.3). */
#ifndef HYCOTRAINER_H
#define HYCOTRAINER_H

#include <hycomodel.h>
#include <hycosnapshots.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoTrainer *HycoTrainer;

/* What a training gave. */
typedef struct {
  HycoModelType type;
  PetscReal dual_misfit;  /* projection: share of the dual snapshots' squares that their nonnegative basis leaves out */
  PetscInt n_supremizers; /* of n_modes, -hyco_dual snapshots */
  PetscInt n_samples, n_modes, n_dual_modes, n_stress_modes, n_force_modes; /* l_u and the sizes of the other bases */
  PetscInt n_fe_dofs, rid_nodes, rid_elements, rid_a_nodes, rid_contacts; /* FE unknowns, RID, nodes of A, |A_lambda| */
  PetscReal rid_fraction;                                                 /* share of the elements */
  PetscReal condition;             /* of the reduced stiffness, worst of the judged snapshots */
  PetscReal error_u, error_lambda; /* mean relative training errors, 2-norm, displacement and RID contact forces */
  HycoScan scan;                   /* singularity inside the parameters' ranges */
  PetscReal seconds_snapshots, seconds_reduction;
} HycoTraining;

/* A trainer for a scene, which must outlive it. Collective on `comm`. The caller owns it. */
PetscErrorCode HycoTrainerCreate(MPI_Comm comm, HycoScene scene, HycoTrainer *trainer);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoTrainerDestroy(HycoTrainer *trainer);
/* Reads the -hyco_model_type, -hyco_dual, -hyco_nnmf_, -hyco_pod_, -hyco_deim_, -hyco_rid_, -hyco_hybrid, -hyco_scan
   options from the scene's options. Collective. */
PetscErrorCode HycoTrainerSetFromOptions(HycoTrainer trainer);
/* Where the snapshots live (default: the model's name with .snapshots appended). */
PetscErrorCode HycoTrainerSetSnapshotFolder(HycoTrainer trainer, const char folder[]);
/* Called as snapshots are solved. */
PetscErrorCode HycoTrainerSetProgress(HycoTrainer trainer, HycoProgress progress, void *ctx);
/* Solves the samples that are missing, reduces, and writes the model to `path` (temporary name, then renamed).
   Collective. `training` may be NULL. Fails for a model that misses its training solutions by half, and, unless
   -hyco_keep_singular, for one whose reduced stiffness is singular inside the parameters' ranges. */
PetscErrorCode HycoTrainerRun(HycoTrainer trainer, HycoSamples samples, const char path[], HycoTraining *training);

#if defined(__cplusplus)
}
#endif
#endif
