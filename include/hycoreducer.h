/* HycoReducer: snapshots -> POD, DEIM -> reduced integration domain -> hybrid model in a file (sections 4 and 5); or
   snapshots -> POD, NNMF -> projection-based model in a file (6.3); or bodies condensed to their surfaces.
 */
#ifndef HYCOREDUCER_H
#define HYCOREDUCER_H

#include <hycorom.h>
#include <hycosnapshots.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoReducer *HycoReducer;

/* -- errors of a model -- */

typedef enum {
  HYCO_ERROR_U,
  HYCO_ERROR_U_RID,
  HYCO_ERROR_SIGMA,
  HYCO_ERROR_SIGMA_11,
  HYCO_ERROR_LAMBDA,
  HYCO_ERROR_LAMBDA_RID,
  HYCO_ERROR_INELASTIC,
  HYCO_N_ERRORS
} HycoErrorKind;                           /* the errors of HycoErrors without those in H1 */
extern const char *const HycoErrorKinds[]; /* their names: u, u_rid, sigma, ...; ends with NULL */

/* Errors of a path from HycoROMComparePath(), by kind. */
typedef struct {
  PetscInt n, n_full;             /* listed times that both paths reached, and the full-order one */
  PetscReal worst[HYCO_N_ERRORS]; /* of these times */
  PetscReal end[HYCO_N_ERRORS];   /* of the last */
  PetscInt at[HYCO_N_ERRORS];     /* where the worst is */
  PetscReal force, force_rid;     /* the largest contact forces of the full-order path: 2-norm, all and the RID's */
} HycoPathErrors;

/*
  Solves the full-order path at mu (length n), and the model's path in the same time steps, and compares them at the
  listed times. An error is the 2-norm or max norm of the difference, divided by that of full order or, if this is
  smaller, by a tenth of its largest value over the path, because before contact closes there is no force to relate to.
  x/0 is PETSC_INFINITY. Collective on the full-order model's communicator; model on its rank 0 (NULL elsewhere), where
  errors is set. Fails if the full-order path does not reach its end.
*/
PetscErrorCode HycoROMComparePath(HycoROM model, HycoFOM fom, PetscInt n, const PetscReal mu[], HycoPathErrors *errors);

/* Errors over a set of points, as fractions; for a path that of its worst listed time (HycoROMComparePath()). Errors of
   contact forces (HYCO_ERROR_LAMBDA and _RID) are divided by at least a tenth of the largest force of the set.
   PETSC_INFINITY if a solve did not converge. */
typedef struct {
  PetscInt n, not_converged;
  PetscInt loose; /* points at which the position of a body is arbitrary (HycoPrediction): displacements are not judged
                there */
  PetscReal largest[HYCO_N_ERRORS], median[HYCO_N_ERRORS], mean[HYCO_N_ERRORS];
  PetscInt worst[HYCO_N_ERRORS]; /* the point with the largest */
  PetscReal end[HYCO_N_ERRORS];  /* for paths, the largest at their last listed time; otherwise 0 */
  PetscReal seconds;             /* processor time of a prediction without outputs and estimates: mean over the points
                                    of the median of each */
} HycoValidation;

/* The settings that determine a model for given solutions; they are the options of the same names. */
typedef struct {
  HycoROMType type;                     /* borrowed from the library */
  PetscBool pod;                        /* pod_tol applies to this type */
  PetscBool rid;                        /* layers, extension, hybrid and whole apply to this type */
  PetscReal pod_tol, contact_extension; /* energy left out of the displacement basis; a length */
  PetscInt layers;
  HycoHybrid hybrid;
  PetscBool whole;   /* the whole mesh as the RID */
  const char *plane; /* group of a plane of symmetry whose cells are in the RID; NULL: none. Borrowed from the scene */
  PetscReal ridge;   /* hybrid all: of the interface's regression, as training has found it; < 0: not yet */
  /* of a type whose model can be made in several ways; NULL: its default. Borrowed from the type */
  const char *variant;
} HycoReducerSettings;

/* Describes settings: "hybrid, pod_tol 1e-10, hybrid contact, layers 1, contact extension 2.5". */
void HycoReducerSettingsDescribe(const HycoReducerSettings *settings, size_t length, char text[]);

/* Settings that the search tried. Borrowed by the monitor. */
typedef struct {
  PetscInt number, of; /* number, from 1 (0: no search); for the chosen settings also the total */
  HycoReducerSettings settings;
  PetscInt n_modes, n_fe_dofs, rid_nodes, rid_elements, rid_contacts;
  PetscInt n_unknowns; /* hybrid: displacements in A that are not fixed */
  PetscReal rid_fraction;
  PetscReal cost;          /* operations of an online solve at a new stiffness, estimated */
  PetscReal ratio;         /* the largest quotient of an error and its target; at most 1 if all targets are met */
  HycoErrorKind worst;     /* that error */
  HycoValidation held_out; /* errors at the held-out points at which it was judged, held_out.n */
  PetscInt n_held;         /* number of held-out points. For paths, settings are dropped at the first of them that the
                              model does not bring to its end, or whose error excludes their choice */
  PetscInt dropped_at;     /* that point; -1: it was judged at all */
  PetscInt beaten_by;      /* number of the settings that are chosen instead; 0: none, or the path has no end. If
                              dropped_at is -1, for their cost: it was not judged at any point */
  PetscBool reopened;      /* those settings were refused later: a later attempt has all points */
  char failure[512];       /* reason why there is no model; "": there is one */
} HycoAttempt;
/* Called on rank 0 after each attempt. */
typedef PetscErrorCode (*HycoAttemptMonitor)(const HycoAttempt *attempt, void *ctx);
/* Called on rank 0 before n solutions are added; `parameter` is the one whose values are too far apart, or -1. former:
   they are former held-out points, because the targets are missed at fresh ones. */
typedef PetscErrorCode (*HycoAddedMonitor)(PetscInt n, PetscInt parameter, PetscBool former, void *ctx);

/* Types or settings that the search did not try, and the reason. */
typedef struct {
  char what[64], why[512];
  PetscBool possible; /* by naming it */
} HycoLeftOut;
#define HYCO_MAX_LEFT_OUT 8

/* A quantity that a type of model reports about its training, with its name in reports. */
typedef struct {
  char name[48];
  PetscInt n;
  PetscReal value[3];
} HycoFact;
#define HYCO_MAX_FACTS 5

/* Errors of an output of the scene (HycoSceneGetQuantities()) at the held-out points, in its unit; of a path the
   largest of its listed times. Points whose prediction did not converge are left out. < 0: not known. */
typedef struct {
  PetscReal median, largest;
  PetscReal magnitude; /* the largest absolute value at full order */
  PetscBool estimated; /* the model estimates this error */
} HycoOutputValidation;

/* Results of a training. */
typedef struct {
  HycoROMType type;              /* borrowed from the library */
  char summary[1024];            /* text of the type about bases and RID; "": none */
  HycoFact fact[HYCO_MAX_FACTS]; /* quantities of the type */
  PetscInt n_facts;
  PetscBool stiffness; /* whether there is a reduced stiffness, with a condition */
  PetscInt n_samples, n_modes, n_dual_modes, n_stress_modes, n_force_modes; /* l_u and the sizes of the other bases */
  PetscInt n_fe_dofs, rid_nodes, rid_elements, rid_a_nodes, rid_contacts; /* FE unknowns, RID, nodes of A, |A_lambda| */
  PetscReal rid_fraction;                                                 /* share of the elements */
  PetscReal condition;             /* of the reduced stiffness, the largest over the judged snapshots */
  PetscReal error_u, error_lambda; /* mean relative training errors, 2-norm, displacement and RID contact forces; < 0:
                                      there is no training solution */
  HycoValidation held_out;         /* errors of the written model at held-out points; n 0: none. The largest also at
                                      n_corners training points at corners of the ranges */
  PetscInt n_corners;
  HycoOutputValidation output[HYCO_MAX_QUANTITIES]; /* of the written model, if held_out.n > 0 */
  PetscInt n_held;                         /* held-out predictions that calibrate the estimated errors; 0: none */
  HycoAttempt chosen;                      /* the settings chosen by the search */
  HycoLeftOut left_out[HYCO_MAX_LEFT_OUT]; /* n_left_out: what the search did not try */
  PetscInt n_left_out;
  char next[1024]; /* what would help if the errors are too large, beside more points; "": nothing in particular */
  PetscReal search_operations, solution_operations; /* estimated numbers, of all attempts and all solutions */
  PetscInt n_added;                                 /* solutions that were added to meet the targets, */
  PetscInt n_former;                                /* n_former of them former held-out points */
  PetscInt n_fresh; /* of the held-out points those drawn after solutions were added near others; 0: none was added */
  HycoScan scan;    /* singularity inside the parameters' ranges */
  PetscReal seconds_snapshots, seconds_reduction;
  PetscReal cpu_solution; /* processor time of a full-order solution with its outputs, mean; 0: none was solved now */
  PetscReal cpu;          /* of the training up to the estimates, all ranks; solutions found in the store count as that
                             mean. 0: not known */
  PetscInt n_lost;        /* points without an equilibrium, training and held-out; they are left out */
  const char *first_lost; /* the first of them, its body, direction and time. Borrowed until the next run */
  PetscReal sliding;      /* the largest of all solutions, as in HycoSummary */
  PetscReal time_error;   /* the largest of the paths that were solved now, as in HycoHistory */
} HycoTraining;

/* Gets solved[n_groups]: how many points each group of ranks has solved full order in the last run; those found in the
   snapshot folder are not counted. On every rank. Borrowed until the next run. Not collective. */
PetscErrorCode HycoReducerGetSolved(HycoReducer reducer, PetscInt *n_groups, const PetscInt *solved[]);
/* HycoSnapshotsGetBalance() of the last run. written: NULL before the first run. Borrowed until the next run. */
PetscErrorCode HycoReducerGetBalance(HycoReducer reducer, PetscInt *unsolved, const PetscReal *written[]);

/* Creates a reducer for a scene, to which it holds a reference. Collective on `comm`. The caller owns it. */
PetscErrorCode HycoReducerCreate(MPI_Comm comm, HycoScene scene, HycoReducer *reducer);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoReducerDestroy(HycoReducer *reducer);
/* Reads the options of a model and its training (hyco train -help) from the scene's options. Collective. */
PetscErrorCode HycoReducerSetFromOptions(HycoReducer reducer);
/* -hyco_model_type, -hyco_pod_tol (from 0 to 1), -hyco_rid_layers (0 or more): as given by an option, so that a search
   keeps them. HycoReducerSetFromOptions() replaces them if the option is given. */
PetscErrorCode HycoReducerSetModelType(HycoReducer reducer, HycoROMType type);
PetscErrorCode HycoReducerSetPODTolerance(HycoReducer reducer, PetscReal tol);
PetscErrorCode HycoReducerSetRIDLayers(HycoReducer reducer, PetscInt layers);
/* Gets the type of model that the options set (-hyco_model_type); a search may choose another. */
PetscErrorCode HycoReducerGetType(HycoReducer reducer, HycoROMType *type);
/* Whether the training may give a model of a type that a text names ("hybrid or cubature"): that of
   HycoReducerGetType(), or one that a search of the type tries. Not collective. */
PetscErrorCode HycoReducerTries(HycoReducer reducer, const char types[], PetscBool *tries);
/* Sets the folder of the snapshots (default: the model's name with .snapshots appended). */
PetscErrorCode HycoReducerSetSnapshotFolder(HycoReducer reducer, const char folder[]);
/* Called as snapshots are solved. */
PetscErrorCode HycoReducerSetProgress(HycoReducer reducer, HycoProgress progress, void *ctx);
/* Gets which solutions are solved, "snapshots" or "held-out solutions", for the progress. Not collective. */
PetscErrorCode HycoReducerGetSolving(HycoReducer reducer, const char *what[]);
/* Called on one rank in the other long phases (the samples of bodies, the search for settings): `done` of
   n, where n is 0 if it is not known. */
typedef PetscErrorCode (*HycoPhaseMonitor)(const char phase[], PetscInt done, PetscInt n, void *ctx);
PetscErrorCode HycoReducerSetPhaseMonitor(HycoReducer reducer, HycoPhaseMonitor monitor, void *ctx);
/* Solves the held-out points (HycoReducerSetValidation()) and, unless a type is accurate without them, the missing
   samples, reduces, and writes the model to `path` (under a temporary name, then renamed). Collective. `training` may
   be NULL. Fails if the errors of the model on its training solutions reach one half and, unless -hyco_keep_singular,
   if its reduced stiffness is singular inside the parameters' ranges. */
PetscErrorCode HycoReducerRun(HycoReducer reducer, HycoSamples samples, const char path[], HycoTraining *training);

/* Sets the held-out points, none of which may be a training point; they must outlive the training. NULL (the default):
   scattered points. */
PetscErrorCode HycoReducerSetValidation(HycoReducer reducer, HycoSamples validation);
/* Sets the number of scattered held-out points over the region of the training points (-hyco_validation). < 0, the
   default: from the number of training points. 0: none; then errors are not known, settings are not searched and
   estimates are not calibrated. */
PetscErrorCode HycoReducerSetValidationCount(HycoReducer reducer, PetscInt n);
/* Whether the settings that the options do not give are searched by these points (-hyco_search; default: true). */
PetscErrorCode HycoReducerSetSearch(HycoReducer reducer, PetscBool search);
PetscErrorCode HycoReducerSetAttemptMonitor(HycoReducer reducer, HycoAttemptMonitor attempt, HycoAddedMonitor added,
                                            void *ctx);
/* Sets the largest errors allowed at the held-out points (HYCO_N_ERRORS of them; 0: no target). If no settings meet
   them, solutions are added near the worst points, at most `budget` of them (< 0: as many as there were at first), and
   fresh held-out points judge the model; if it misses the targets there, the former ones are used for training too. */
PetscErrorCode HycoReducerSetTargets(HycoReducer reducer, const PetscReal target[], PetscInt budget);
/* Gets the errors at which a search calls a model accurate enough, and those above which a model misses, by kind (0:
   none): the targets that were set, or else defaults. Either may be NULL. */
PetscErrorCode HycoReducerGetTargets(HycoReducer reducer, PetscReal target[], PetscReal limit[]);

/* -- greedy training (section 5.4) -- */

/* Error indicators, which need no full-order solution; in the order of the values of -hyco_greedy_indicator. */
typedef enum {
  HYCO_INDICATOR_LOCAL,       /* (43): distance from the full-order problem on the RID, its interface interpolated */
  HYCO_INDICATOR_PENETRATION, /* (45): 2-norm of the penetration, a length */
  HYCO_INDICATOR_RESIDUAL     /* for paths only: HycoROMGetEquilibrium(), at the worst time */
} HycoIndicatorKind;

/* One iteration: a model from n_samples solutions, judged at every training point. Borrowed by the monitor. */
typedef struct {
  PetscInt iteration, n_samples, n_modes, rid_nodes, rid_elements; /* iteration 0: the start */
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
/* -hyco_greedy_indicator (default: local; for a scene with a history residual) */
PetscErrorCode HycoReducerSetGreedyIndicator(HycoReducer reducer, HycoIndicatorKind kind);
/* The loop ends when max_eta <= target (> 0, default 1e-3), with max_snapshots solutions (0, default: no limit), after
   max_seconds (0, default: no limit), or when every training point is solved. */
PetscErrorCode HycoReducerSetGreedyStop(HycoReducer reducer, PetscReal target, PetscInt max_snapshots,
                                        PetscReal max_seconds);
/*
  Like HycoReducerRun(), but chooses the samples. The loop begins with `start` (NULL: the corners of the parameters'
  ranges). It builds a model, evaluates the indicator at every point of `training` (at least two, distributed over the
  ranks), and adds the full-order solution of the worst point (the first in `training` if several are equal). The RID
  only grows, and there are at most as many modes as unknowns of A. Solutions in the snapshot folder are reused: a run
  that was killed repeats its choices without the solves. Collective. `training_report` may be NULL. -hyco_greedy_keep
  stores the model of each iteration in that folder as greedy-NNN.h5.
*/
PetscErrorCode HycoReducerRunGreedy(HycoReducer reducer, HycoSamples start, HycoSamples training, const char path[],
                                    HycoTraining *training_report);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoReducerView(HycoReducer object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoReducerViewFromOptions(HycoReducer object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
