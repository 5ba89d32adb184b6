/* HycoTrainer: snapshots -> POD, DEIM -> reduced integration domain -> hybrid model in a file (sections 4 and 5); or
   snapshots -> POD, NNMF -> projection-based model in a file (6.3); or snapshots -> POD, B K^-1 B^T -> condensed model.
 */
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
  PetscInt hopeless;      /* the same: the parameter of which more values were in vain, for the dependence on it is not
                             smooth; -1: none */
  PetscInt hopeless_values; /* how many it has */
  PetscReal hopeless_error; /* the forces' error, one of them left out */
  PetscBool target_met;   /* condensed, points chosen: -hyco_condensed_tol was reached, by left_out's forces */
  PetscReal target;       /* the same: what it asked */
  PetscInt most_values;   /* the same: -hyco_condensed_max_values */
  PetscInt n_supremizers; /* of n_modes, -hyco_dual snapshots */
  PetscInt n_flexibilities; /* condensed: points at which B K^-1 B^T was factored */
  PetscReal left_out[3];    /* condensed: relative errors of flexibility, gap and forces, one training value left out */
  PetscInt n_samples, n_modes, n_dual_modes, n_stress_modes, n_force_modes; /* l_u and the sizes of the other bases */
  PetscInt n_fe_dofs, rid_nodes, rid_elements, rid_a_nodes, rid_contacts; /* FE unknowns, RID, nodes of A, |A_lambda| */
  PetscReal rid_fraction;                                                 /* share of the elements */
  PetscReal condition;             /* of the reduced stiffness, worst of the judged snapshots */
  PetscReal error_u, error_lambda; /* mean relative training errors, 2-norm, displacement and RID contact forces */
  PetscInt n_held;                 /* held-out predictions that calibrate the estimated errors; 0: none */
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
/* Whether HycoTrainerRun() chooses the points itself when it is given none: for a condensed model. */
PetscErrorCode HycoTrainerChooses(HycoTrainer trainer, PetscBool *chooses);
/* Called as snapshots are solved. */
PetscErrorCode HycoTrainerSetProgress(HycoTrainer trainer, HycoProgress progress, void *ctx);
/* Solves the samples that are missing, reduces, and writes the model to `path` (temporary name, then renamed).
   Collective. `training` may be NULL; so may `samples` for a condensed model, which then chooses them until its
   estimate of the forces' error is below -hyco_condensed_tol, or says in target_met that it is not. Fails for a model
   that misses its training solutions by half, and, unless -hyco_keep_singular, for one whose reduced stiffness is
   singular inside the parameters' ranges. */
PetscErrorCode HycoTrainerRun(HycoTrainer trainer, HycoSamples samples, const char path[], HycoTraining *training);

/* In how many parts the training solutions are held out, one after the other, to calibrate the estimated errors of a
   hybrid model (-hyco_trust_folds; default 3; 0: none). */
PetscErrorCode HycoTrainerSetTrustFolds(HycoTrainer trainer, PetscInt folds);

/* -- judging a model by stored solutions -- */

typedef enum {
  HYCO_ERROR_U,
  HYCO_ERROR_U_RID,
  HYCO_ERROR_SIGMA,
  HYCO_ERROR_SIGMA_11,
  HYCO_ERROR_LAMBDA,
  HYCO_ERROR_LAMBDA_RID,
  HYCO_N_ERRORS
} HycoErrorKind;                           /* of HycoErrors, those without H1 */
extern const char *const HycoErrorKinds[]; /* their words: u, u_rid, sigma, ...; NULL ends */

/* Errors over a set of points, as fractions. Of contact forces (HYCO_ERROR_LAMBDA and _RID), those smaller than a tenth
   of the largest of the set count as that tenth. PETSC_INFINITY where a solve did not converge. */
typedef struct {
  PetscInt n, not_converged;
  PetscReal largest[HYCO_N_ERRORS], mean[HYCO_N_ERRORS];
  PetscReal
      seconds; /* of an online solve, wall clock: the mean over the points, in their order, of each one's median */
} HycoValidation;

/* Predicts at each sample and compares with its solution, which must be in the store. `model` on every rank; the ranks
   share the samples out. Collective on `comm`. */
PetscErrorCode HycoModelValidate(MPI_Comm comm, HycoModel model, HycoSnapshots store, HycoSamples samples,
                                 HycoValidation *validation);

/* -- greedy training (section 5.4) -- */

/* What judges a model where no full-order solution is known; the order of -hyco_greedy_indicator's words. */
typedef enum {
  HYCO_INDICATOR_LOCAL,      /* (43): distance from the full-order problem on the RID, its interface interpolated */
  HYCO_INDICATOR_PENETRATION /* (45): 2-norm of the penetration, a length */
} HycoIndicatorKind;

/* One iteration: a model from n_samples solutions, judged at every training point. Borrowed by the monitor. */
typedef struct {
  PetscInt iteration, n_samples, n_modes, rid_nodes, rid_elements; /* iteration 0: the start alone */
  PetscInt n_points, n_infinite;    /* training points, and those where the indicator is x/0 or was not solved */
  const PetscReal *worst;           /* parameters (length n_parameters) of the point that is the worst of those */
  PetscReal eta, eta_u, eta_lambda; /* not solved yet, and its indicator (45: eta = eta_u); NULL and 0: none is left */
  PetscReal max_eta;                /* over all training points; this is what the target is for */
  PetscReal mean_eta_u, mean_eta_lambda; /* over those where the indicator is finite */
  PetscReal seconds;                     /* since the training began */
  const char *stop; /* NULL, or why this iteration is the last: target, snapshots, seconds, points */
} HycoGreedyStep;
/* Called on rank 0 after each iteration. */
typedef PetscErrorCode (*HycoGreedyMonitor)(const HycoGreedyStep *step, void *ctx);

PetscErrorCode HycoTrainerSetGreedyMonitor(HycoTrainer trainer, HycoGreedyMonitor monitor, void *ctx);
/* -hyco_greedy_indicator (default: local) */
PetscErrorCode HycoTrainerSetGreedyIndicator(HycoTrainer trainer, HycoIndicatorKind kind);
/* The loop ends when max_eta <= target (> 0, default 1e-3), with max_snapshots solutions (0, default: no limit), after
   max_seconds (0, default: no limit), or when every training point is solved. */
PetscErrorCode HycoTrainerSetGreedyStop(HycoTrainer trainer, PetscReal target, PetscInt max_snapshots,
                                        PetscReal max_seconds);
/*
  As HycoTrainerRun(), the samples chosen: from `start` (NULL: the corners of the parameters' ranges), the loop builds a
  model, evaluates the indicator at every point of `training` (at least two; shared out over the ranks), and adds the
  worst point's full-order solution, of equals the first in `training`. The RID only grows; the modes are no more than
  the unknowns of A. Solutions come from the snapshot folder when they are there: a run that was killed makes the same
  choices again, without their solves. Collective. `training_report` may be NULL. -hyco_greedy_keep keeps each
  iteration's model in that folder, named greedy-NNN.h5.
*/
PetscErrorCode HycoTrainerRunGreedy(HycoTrainer trainer, HycoSamples start, HycoSamples training, const char path[],
                                    HycoTraining *training_report);

#if defined(__cplusplus)
}
#endif
#endif
