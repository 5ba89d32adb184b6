/* HycoReducer: snapshots -> POD, DEIM -> reduced integration domain -> hybrid model in a file (sections 4 and 5); or
   snapshots -> POD, NNMF -> projection-based model in a file (6.3); or snapshots -> POD, B K^-1 B^T -> condensed model.
 */
#ifndef HYCOREDUCER_H
#define HYCOREDUCER_H

#include <hycorom.h>
#include <hycosnapshots.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoReducer *HycoReducer;

/* -- what a model is worth -- */

typedef enum {
  HYCO_ERROR_U,
  HYCO_ERROR_U_RID,
  HYCO_ERROR_SIGMA,
  HYCO_ERROR_SIGMA_11,
  HYCO_ERROR_LAMBDA,
  HYCO_ERROR_LAMBDA_RID,
  HYCO_ERROR_INELASTIC,
  HYCO_N_ERRORS
} HycoErrorKind;                           /* of HycoErrors, those without H1 */
extern const char *const HycoErrorKinds[]; /* their words: u, u_rid, sigma, ...; NULL ends */

/* Errors of a path as HycoROMComparePath() has them, by kind. */
typedef struct {
  PetscInt n, n_full;             /* listed times that both paths reached, and the full-order one */
  PetscReal worst[HYCO_N_ERRORS]; /* of these times */
  PetscReal end[HYCO_N_ERRORS];   /* of the last */
  PetscInt at[HYCO_N_ERRORS];     /* where the worst is */
  PetscReal force, force_rid;     /* the largest contact forces of the full-order path: 2-norm, all and the RID's */
} HycoPathErrors;

/*
  Solves the full-order path at mu (length n) and the model's in the same steps of time, and compares them at the listed
  times: the 2-norm or max norm of what is missed over that of the full order; where this is below a tenth of the path's
  largest, over that tenth, for before contact closes there is no force to be relative to. x/0 is PETSC_INFINITY.
  Collective on the full-order model's communicator; model on its rank 0 (NULL elsewhere), errors filled there. Fails
  where the full-order path does not reach its end.
*/
PetscErrorCode HycoROMComparePath(HycoROM model, HycoFOM fom, PetscInt n, const PetscReal mu[], HycoPathErrors *errors);

/* Errors over a set of points, as fractions; of a path its worst listed time (HycoROMComparePaths()). Of contact forces
   (HYCO_ERROR_LAMBDA and _RID), those smaller than a tenth of the largest of the set count as that tenth.
   PETSC_INFINITY where a solve did not converge. */
typedef struct {
  PetscInt n, not_converged;
  PetscReal largest[HYCO_N_ERRORS], median[HYCO_N_ERRORS], mean[HYCO_N_ERRORS];
  PetscInt worst[HYCO_N_ERRORS]; /* the point with the largest */
  PetscReal end[HYCO_N_ERRORS];  /* of paths, the largest at their last listed time; else 0 */
  PetscReal
      seconds; /* of an online solve, wall clock: the mean over the points, in their order, of each one's median */
} HycoValidation;

/* What decides a model beside its solutions; the options of the same names. */
typedef struct {
  HycoROMType type;                     /* borrowed from the library */
  PetscBool rid;                        /* layers, extension, hybrid and whole mean something to this type */
  PetscReal pod_tol, contact_extension; /* energy left out of the displacement basis; a length */
  PetscInt layers;
  HycoHybrid hybrid;
  PetscBool whole;   /* the whole mesh as the RID */
  const char *plane; /* the group of a plane of symmetry whose cells the RID has; NULL: none. Borrowed from the scene */
  PetscReal ridge;   /* hybrid all: of the interface's regression, as training has found it; < 0: not yet */
} HycoRecipe;

/* In words: "hybrid, pod_tol 1e-10, hybrid contact, layers 1, contact extension 2.5". */
void HycoRecipeDescribe(const HycoRecipe *recipe, size_t length, char text[]);

/* A recipe that the search for one tried. Borrowed by the monitor. */
typedef struct {
  PetscInt number, of; /* from 1 on (0: nothing was searched); chosen: of how many */
  HycoRecipe recipe;
  PetscInt n_modes, n_fe_dofs, n_flexibilities, rid_nodes, rid_elements, rid_contacts;
  PetscReal rid_fraction;
  PetscReal cost;          /* operations of an online solve at a new stiffness, estimated */
  PetscReal ratio;         /* the largest quotient of an error and its target: at most 1, they are met */
  HycoErrorKind worst;     /* that error */
  HycoValidation held_out; /* errors at the held-out points that it was judged at */
  PetscInt n_held;     /* held-out points that there are: of paths a recipe is dropped at the first of them, held_out.n
                          in all, that it does not bring to its end, or beside whose error it cannot be chosen */
  PetscInt dropped_at; /* that point; -1: it was judged at all */
  PetscInt beaten_by;  /* the number of the recipe that is chosen rather than it; 0: none, or the path has no end */
  PetscBool reopened;  /* that recipe was refused later: a later attempt has all points */
  char failure[512];   /* why it gave no model; "": it did */
} HycoAttempt;
/* Called on rank 0 after each attempt. */
typedef PetscErrorCode (*HycoAttemptMonitor)(const HycoAttempt *attempt, void *ctx);
/* Called on rank 0 when n solutions are to be added; the parameter whose values lie too far apart, or -1. */
typedef PetscErrorCode (*HycoAddedMonitor)(PetscInt n, PetscInt parameter, void *ctx);

/* A number that a type of model reports of its training, by the name that reports have. */
typedef struct {
  char name[48];
  PetscInt n;
  PetscReal value[3];
} HycoFact;
#define HYCO_MAX_FACTS 4

/* What a training gave. */
typedef struct {
  HycoROMType type;              /* borrowed from the library */
  char summary[512];             /* the type's own words on bases and RID; "": none */
  HycoFact fact[HYCO_MAX_FACTS]; /* and numbers */
  PetscInt n_facts;
  PetscBool stiffness;      /* it has a reduced stiffness, with a condition */
  char missed[1024];        /* points chosen: what was not reached, and what to do; "": nothing */
  PetscInt n_flexibilities; /* condensed: points at which B K^-1 B^T was factored */
  PetscInt n_samples, n_modes, n_dual_modes, n_stress_modes, n_force_modes; /* l_u and the sizes of the other bases */
  PetscInt n_fe_dofs, rid_nodes, rid_elements, rid_a_nodes, rid_contacts; /* FE unknowns, RID, nodes of A, |A_lambda| */
  PetscReal rid_fraction;                                                 /* share of the elements */
  PetscReal condition;             /* of the reduced stiffness, worst of the judged snapshots */
  PetscReal error_u, error_lambda; /* mean relative training errors, 2-norm, displacement and RID contact forces */
  HycoValidation held_out; /* errors of the model that was written, at points that it was not trained on; n 0: none */
  PetscInt n_held;         /* held-out predictions that calibrate the estimated errors; 0: none */
  HycoAttempt chosen;      /* of the search for a recipe */
  PetscInt n_added;        /* solutions that were added to meet the targets */
  HycoScan scan;           /* singularity inside the parameters' ranges */
  PetscReal seconds_snapshots, seconds_reduction;
} HycoTraining;

/* solved[n_groups]: how many points each group of ranks has solved full order in the last run; those found in the
   snapshot folder are not counted. On every rank. Borrowed until the next run. Not collective. */
PetscErrorCode HycoReducerGetSolved(HycoReducer reducer, PetscInt *n_groups, const PetscInt *solved[]);

/* A reducer for a scene, which is referenced. Collective on `comm`. The caller owns it. */
PetscErrorCode HycoReducerCreate(MPI_Comm comm, HycoScene scene, HycoReducer *reducer);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoReducerDestroy(HycoReducer *reducer);
/* Reads what decides a model and its training (hyco train -help), from the scene's options. Collective. */
PetscErrorCode HycoReducerSetFromOptions(HycoReducer reducer);
/* The type of model that the options ask for (-hyco_model_type); a search may take another. */
PetscErrorCode HycoReducerGetType(HycoReducer reducer, HycoROMType *type);
/* Where the snapshots live (default: the model's name with .snapshots appended). */
PetscErrorCode HycoReducerSetSnapshotFolder(HycoReducer reducer, const char folder[]);
/* Whether HycoReducerRun() chooses the points itself when it is given none: for a condensed model. */
PetscErrorCode HycoReducerChooses(HycoReducer reducer, PetscBool *chooses);
/* Called as snapshots are solved. */
PetscErrorCode HycoReducerSetProgress(HycoReducer reducer, HycoProgress progress, void *ctx);
/* Called on one rank in the other phases that may take long, flexibilities of condensed models and the search for
   settings: `done` of n, which is 0 while nobody knows it. */
typedef PetscErrorCode (*HycoPhaseMonitor)(const char phase[], PetscInt done, PetscInt n, void *ctx);
PetscErrorCode HycoReducerSetPhaseMonitor(HycoReducer reducer, HycoPhaseMonitor monitor, void *ctx);
/* Solves the samples that are missing, reduces, and writes the model to `path` (temporary name, then renamed).
   Collective. Beside them it solves the points that the model is judged by (HycoReducerSetValidation()). `training` may
   be NULL; so may `samples` for a condensed model, which then chooses them until its
   estimate of the forces' error is below -hyco_condensed_tol, or says in target_met that it is not. Fails for a model
   that misses its training solutions by half, and, unless -hyco_keep_singular, for one whose reduced stiffness is
   singular inside the parameters' ranges. */
PetscErrorCode HycoReducerRun(HycoReducer reducer, HycoSamples samples, const char path[], HycoTraining *training);

/* Points to judge the model by, none of them a training point; must outlive the training. NULL (the default): drawn. */
PetscErrorCode HycoReducerSetValidation(HycoReducer reducer, HycoSamples validation);
/* How many are drawn, all over what the training points reach (-hyco_validation): < 0, the default: from the number of
   training points; 0: none, so that neither errors are known nor a recipe is searched nor estimates are calibrated. */
PetscErrorCode HycoReducerSetValidationCount(HycoReducer reducer, PetscInt n);
/* Whether the recipe is searched by these points, as far as the options leave it open (-hyco_search; default: true). */
PetscErrorCode HycoReducerSetSearch(HycoReducer reducer, PetscBool search);
PetscErrorCode HycoReducerSetAttemptMonitor(HycoReducer reducer, HycoAttemptMonitor attempt, HycoAddedMonitor added,
                                            void *ctx);
/* What the errors at the held-out points may be (HYCO_N_ERRORS of them; 0: any). Where no recipe meets them, solutions
   are added near the worst points, `budget` of them at most (< 0: as many as there were at first). */
PetscErrorCode HycoReducerSetTargets(HycoReducer reducer, const PetscReal target[], PetscInt budget);

/* -- greedy training (section 5.4) -- */

/* What judges a model where no full-order solution is known; the order of -hyco_greedy_indicator's words. */
typedef enum {
  HYCO_INDICATOR_LOCAL,       /* (43): distance from the full-order problem on the RID, its interface interpolated */
  HYCO_INDICATOR_PENETRATION, /* (45): 2-norm of the penetration, a length */
  HYCO_INDICATOR_RESIDUAL     /* of paths, which have no other: HycoROMGetEquilibrium(), the worst time */
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

PetscErrorCode HycoReducerSetGreedyMonitor(HycoReducer reducer, HycoGreedyMonitor monitor, void *ctx);
/* -hyco_greedy_indicator (default: local; of a scene with a history residual) */
PetscErrorCode HycoReducerSetGreedyIndicator(HycoReducer reducer, HycoIndicatorKind kind);
/* The loop ends when max_eta <= target (> 0, default 1e-3), with max_snapshots solutions (0, default: no limit), after
   max_seconds (0, default: no limit), or when every training point is solved. */
PetscErrorCode HycoReducerSetGreedyStop(HycoReducer reducer, PetscReal target, PetscInt max_snapshots,
                                        PetscReal max_seconds);
/*
  As HycoReducerRun(), the samples chosen: from `start` (NULL: the corners of the parameters' ranges), the loop builds a
  model, evaluates the indicator at every point of `training` (at least two; shared out over the ranks), and adds the
  worst point's full-order solution, of equals the first in `training`. The RID only grows; the modes are no more than
  the unknowns of A. Solutions come from the snapshot folder when they are there: a run that was killed makes the same
  choices again, without their solves. Collective. `training_report` may be NULL. -hyco_greedy_keep keeps each
  iteration's model in that folder, named greedy-NNN.h5.
*/
PetscErrorCode HycoReducerRunGreedy(HycoReducer reducer, HycoSamples start, HycoSamples training, const char path[],
                                    HycoTraining *training_report);

/* Prints it, in words, on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoReducerView(HycoReducer object, PetscViewer viewer);
/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoReducerViewFromOptions(HycoReducer object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
