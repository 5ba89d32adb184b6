/* HycoReducer's struct and internal functions. */
#ifndef HYCOREDUCERIMPL_H
#define HYCOREDUCERIMPL_H

#include <hycoromimpl.h>
#include <hycosnapshotsimpl.h>
#include <hycotrainer.h>
#include <slepcsvd.h>

enum {
  HYCO_SEED_DISPLACEMENT,
  HYCO_SEED_STRESS,
  HYCO_SEED_FORCE,
  HYCO_SEED_DUAL,
  HYCO_SEED_INELASTIC, /* in scenes with a history */
  HYCO_SEED_SPRING,    /* in scenes with springs: also force snapshots */
  HYCO_N_SEEDS
};

/* The basis of one field of the snapshots, of which settings take the first modes. Every rank. */
typedef struct {
  Mat V; /* l modes, rows distributed */
  PetscInt l, n_sigma;
  PetscReal *sigma;        /* n_sigma singular values (room for n_s + 1) */
  PetscReal *coefficients; /* displacements: l x n_s column major, V^T of the snapshots minus their lifting; else
                              NULL */
} HycoBasis;

/* The settings that the search (settings_search.c) chooses, unless the options fix them. */
enum {
  HYCO_CHOICE_TYPE,
  HYCO_CHOICE_TOLERANCE,
  HYCO_CHOICE_LAYERS,
  HYCO_CHOICE_EXTENSION,
  HYCO_CHOICE_HYBRID,
  HYCO_CHOICE_WHOLE,
  HYCO_N_CHOICES
};

/* Result of a model at a training solution. */
typedef struct {
  PetscReal u, lambda; /* errors, at most HYCO_JUDGED_WORST */
  PetscBool solved;
  PetscReal t; /* otherwise, for a path: the time that it reached */
} HycoJudged;

struct _p_HycoReducer {
  PETSCHEADER(int);
  PetscMPIInt rank;
  HycoScene scene; /* referenced */
  /* user parameters */
  char folder[PETSC_MAX_PATH_LEN]; /* of snapshots; "": derived from the model's name */
  PetscReal tol[HYCO_N_SEEDS], noise, extension;
  PetscReal pod_memory; /* MB on all ranks for the snapshots of a field; 0: no limit */
  PetscInt max_modes, layers;
  char svd_type[32]; /* for the PODs */
  PetscBool seed[HYCO_N_SEEDS], whole_rid;
  PetscInt deim; /* for each basis that seeds the RID: 0 DEIM, 1 Q-DEIM */
  PetscInt n_groups;
  char **groups, *region; /* groups: n_groups entries, then NULL */
  const char *plane;      /* used by the search for settings: one more group, and only displacements seed; NULL: none */
  HycoHybrid hybrid;
  PetscReal ridge;  /* used by the search for settings: known from an attempt, or found by this one; < 0: to be
                       chosen */
  PetscBool trying; /* an attempt of the search: a model that is not reported */
  PetscBool exhaustive;
  PetscReal search_budget; /* operations of a search as a multiple of those of the solutions */
  PetscInt n_judged;       /* of an attempt, on rank 0: number of predictions at training points (with no solution
                              HYCO_UNSOLVED_WORK each), */
  PetscInt n_unknowns;     /* and of displacements in A that are not fixed */
  /* of an attempt without an accurate model: what else the user may do, of the type; "": nothing */
  char remedy[HYCO_LINE];
  char doing[HYCO_LINE];    /* of the search, for the monitor of phases: the settings of the attempt */
  PetscInt most_full_order; /* hybrid all: largest number of full-order displacements; 0: no limit */
  PetscInt scan;            /* points per parameter; 0: chosen by the library */
  PetscBool keep_singular;
  PetscInt n_validation; /* number of held-out solutions beside the training points; < 0: from the number of training
                            points */
  PetscBool search;      /* search for the settings that no option fixes */
  PetscBool pinned[HYCO_N_CHOICES];
  HycoAttemptMonitor attempt;
  HycoAddedMonitor added;
  void *attempt_ctx;
  PetscReal target[HYCO_N_ERRORS]; /* 0: none */
  PetscInt budget;                 /* largest number of solutions added to meet the targets */
  HycoROM prototype;               /* an empty model of the type to be trained, with its ops. Every rank */
  HycoTrainerOps trainer;          /* of its type */
  void *training;                  /* the type's options, and the data of a run */
  HycoProgress progress;
  HycoPhaseMonitor phase;
  void *progress_ctx, *phase_ctx;
  struct {
    HycoIndicatorKind indicator;
    PetscReal target, max_seconds;
    PetscInt max_snapshots;
    PetscBool keep;
    HycoGreedyMonitor monitor;
    void *ctx;
  } greedy;
  /* state of a run, on rank 0 unless stated otherwise */
  HycoSnapshots store;    /* borrowed, every rank */
  HycoSamples samples;    /* the training points; borrowed, every rank */
  HycoSamples columns;    /* those whose solutions the bases are made of: the training points, or for types with modes
                             of their own the held-out points; borrowed, every rank */
  HycoSamples validation; /* given by the user (borrowed; NULL: none). Every rank */
  HycoSamples held;       /* of this run; NULL: none. Every rank */
  struct _n_HycoHeldOut
      *judged_held; /* for paths: results of the last model built at these; NULL: not known. Every rank */
  PetscInt drawn;   /* number of unseen points drawn so far */
  HycoBasis basis[HYCO_N_SEEDS];
  PetscInt n_dual_seeds, *dual_seeds; /* nodes */
  HycoFOM fom;                        /* every rank: the distributed mesh and its contacts, without matrices */
  HycoMet met;                        /* moved surfaces: the masters that matter */
  PetscInt sizes[4];                  /* every rank: nodes, cells, contacts, dim */
  PetscInt n_seeds_node, n_seeds_cell, *seeds_node, *seeds_cell; /* every rank */
  PetscInt counts[HYCO_N_SEEDS];
  PetscInt l;        /* modes */
  PetscReal *sigma;  /* every rank: l */
  Mat V;             /* every rank: the modes (at least l), rows distributed */
  Mat S;             /* every rank: displacements, n_dof x n_s, rows distributed as V's; NULL with pod_memory */
  PetscInt *rid_row; /* by node of the model's mesh: its row in U_rid, or -1 */
  PetscReal *U_rid;  /* the rows of S at the nodes whose unknowns may stay full order, column major */
  PetscInt n_rid_nodes;
  PetscReal *V_rid;       /* the rows of V there */
  PetscInt *surface_node; /* by node of the contacts' surfaces: its node of the model's mesh, or -1 */
  PetscBool *fixed;       /* by unknown of the model's mesh */
  PetscReal *Lambda;      /* n_contacts x n_s column major */
  PetscReal *VtU;         /* l x n_s column major: V^T of the snapshots minus their lifting */
  PetscReal *U_norm;      /* n_s: of the whole snapshot */
  PetscInt n_s;           /* number of snapshot columns: one for each sample, with a history one for each listed time
                            of each sample */
  PetscInt *taken_start;  /* rank 0, with a history: n_samples + 1, where the times of each path's steps begin in */
  PetscReal *taken;
  PetscInt n_stops; /* those of predictions, and the largest of their errors in time: HycoModel */
  PetscReal *stops, stops_error;
  HycoJudged *judged; /* rank 0, by sample: results of HycoReducerJudge(); NULL: not called */
  unsigned long long fingerprint;
  PetscInt n_solvers, *solved; /* of the last run, every rank: number of groups of ranks, and of solutions of each */
  PetscReal cpu_solution;      /* HycoTraining */
  PetscReal cpu_begin;         /* of this rank, when the run began */
  PetscReal sliding;           /* of the last run's solutions, */
  PetscInt n_lost;             /* its points without an equilibrium, and the first of them */
  char first_lost[HYCO_LINE];
  PetscReal time_error; /* of those that were solved now */
  PetscInt unsolved;    /* of the last run, every rank: HycoSnapshotsGetBalance() */
  PetscReal *written;
  PetscReal solving;     /* seconds of its full-order solutions */
  PetscBool late;        /* the training points are solved when a type needs them; every rank */
  PetscBool solves_held; /* the solutions that are, or were last, solved are held out */
  PetscBool few;         /* the held-out points are those for types that are tried before; every rank */
  PetscBool *grown;      /* every rank, greedy: cells of its part that belong to the RIDs so far; else NULL */
};
/* Fails (no model) if the scene has contacts whose rows the type does not take. */
PetscErrorCode HycoReducerCheckContacts(HycoReducer t, const HycoROM type);
PetscErrorCode HycoReducerTakesCubature(HycoReducer t, PetscBool *takes);

/* The scene's variables of column k of the snapshots: all of mu (HYCO_MAX_PARAMETERS). */
PetscErrorCode HycoReducerColumn(HycoReducer t, PetscInt k, PetscReal mu[]);
/* Whether a type needs no training solutions: those of paths have the inelastic strains, from which its modes are
   made. */
static inline PetscBool HycoReducerOwnModes(HycoReducer t, const HycoROM type)
{
  return (PetscBool)(type->model->traits.own_modes && !(t->scene && t->scene->n_times));
}
/* The ways to make a model of the type that is set, which a search tries; NULL: one. */
static inline const char *const *HycoReducerVariants(HycoReducer t)
{
  return t->trainer.variants ? (*t->trainer.variants)(t) : NULL;
}
/* Sets t->columns, and t->n_s from it. */
PetscErrorCode HycoReducerSetColumns(HycoReducer t, HycoSamples columns);
/* Solves points that are not in the store; those without an equilibrium leave the set. HycoReducerSolve() counts the
   time. Collective. */
PetscErrorCode HycoReducerSolve(HycoReducer t, HycoSnapshots store, HycoSamples points);
PetscErrorCode HycoReducerFill(HycoReducer t, HycoSnapshots store, HycoSamples points, HycoProgress progress);
/* Frees the data of one run. */
PetscErrorCode HycoReducerReset(HycoReducer t);
/* The names of the types with a training, in order; NULL ends. */
PetscErrorCode HycoTrainerNames(const char *const **names);
/* The training of a type; fails without one. */
PetscErrorCode HycoTrainerFind(HycoROMType type, HycoTrainerOps *ops);
/* Sets a registered type, with its options; the present one may stay. */
PetscErrorCode HycoReducerSetType(HycoReducer t, HycoROMType type);
/* Empirical cubature (cubature_weights.c): from the left singular vectors W (n_cells x n, rows in the file's order) and
   singular values of the cells' contributions. The weights of all cells of the whole mesh (w: n_cells, on rank 0;
   `fixed` in the cells of the part that are `near`, which are in no equation) for the leading vectors, up to a share
   `tol`; the errors as in the model. Collective. */
PetscErrorCode HycoCubatureFind(HycoReducer reducer, const PetscBool near[], PetscReal fixed, PetscReal tol, Mat W,
                                PetscInt n, const PetscReal sigma[], PetscReal w[], PetscReal error[2]);
/* The nonzero dual snapshots (n_contacts x n column major, the caller owns them). Rank 0. */
PetscErrorCode HycoReducerDualSnapshots(HycoReducer t, PetscInt *n, PetscReal **S);
/* Adds a number that the type reports. */
PetscErrorCode HycoTrainingAddFact(HycoTraining *report, const char name[], PetscReal value);
/* Frees the bases, seeds and snapshots, and keeps the mesh; frees only what one attempt took from the bases. */
PetscErrorCode HycoReducerResetBases(HycoReducer t);
PetscErrorCode HycoReducerDropBases(HycoReducer t);
/* Begins a run: checks, the mesh, the store of snapshots. Collective. */
PetscErrorCode HycoReducerOpen(HycoReducer t, HycoSamples samples, const char path[], HycoSnapshots *store);
/* Ends it: keeps the store's counts and destroys the store. Collective. */
PetscErrorCode HycoReducerClose(HycoReducer t, HycoSnapshots *store);
/* From the bases: the RID, the model on it, in *model on every rank (the caller owns it; the reducer has its
   whole-mesh part), and the report. `useful`: refuse a model that misses its own training solutions or is singular
   in the ranges. Collective. */
PetscErrorCode HycoReducerBuild(HycoReducer t, PetscBool useful, HycoROM *model, HycoTraining *report);
/* The useful model with its estimates, then its file, written once: a run that fails leaves the former file.
   Collective. */
PetscErrorCode HycoReducerFinish(HycoReducer t, HycoSnapshots store, const char path[], PetscBool learn,
                                 HycoTraining *report);
/* Creates the SVD of its PODs, which the caller owns: with the reducer's type, and options -hyco_pod_svd_... to be
   read. */
PetscErrorCode HycoReducerCreateSVD(HycoReducer t, MPI_Comm comm, SVD *svd);
/* HycoPOD() with that SVD. Collective on S. */
PetscErrorCode HycoReducerPOD(HycoReducer t, Mat S, PetscReal tol, PetscInt max_modes, Mat *V, PetscInt *l,
                              PetscReal sigma[]);
/*
  The POD of paths: first of each path, then of these modes, each path scaled to the size of the largest, so that a path
  with small displacements has the same weight. HycoPathModesAdd(): adds a path's columns, which are kept; the modes
  begin as {0}. HycoPathModesJoin() sets V, l, sigma and n_sigma of `basis`, which the caller owns (no mode: V is NULL
  or has no column), with N rows, n_rows on this rank. tol 0: every mode above the noise. Collective.
  HycoPathModesDestroy() after a failure.
*/
typedef struct {
  PetscInt n;
  Mat *V;           /* the modes of each path, times their singular values; NULL: none */
  PetscReal *first; /* first singular value of each path */
} HycoPathModes;
PetscErrorCode HycoPathModesAdd(HycoReducer t, Mat path, PetscReal tol, HycoPathModes *modes);
PetscErrorCode HycoPathModesJoin(HycoReducer t, HycoPathModes *modes, PetscInt N, PetscInt n_rows, PetscReal tol,
                                 PetscInt max_modes, HycoBasis *basis);
PetscErrorCode HycoPathModesDestroy(HycoPathModes *modes);
/* contact[]: the nodes of the contacts' surfaces that every model's mesh has, whatever its cells: those of each
   contact, for moved surfaces all. Rank 0; others are left as they are. */
PetscErrorCode HycoReducerMarkContacts(HycoReducer t, PetscBool contact[]);
/* The marked cells of the mesh (by cell of the process's part) as a mesh on rank 0; elsewhere NULL. The caller owns it.
   Collective. */
PetscErrorCode HycoReducerGatherMesh(HycoReducer t, const PetscBool needed[], HycoMesh *mesh);
/* Sets the bodies that contact alone holds in the model, which is on rank 0 (free_bodies.c). Collective. */
PetscErrorCode HycoReducerFindFloating(HycoReducer t, HycoROM model);
/* On rank 0 (column major; empty elsewhere) the first n_columns of S, a matrix of displacements, at nodes that rank
   0 gives by their numbers in the whole mesh; or of all snapshots. The caller frees it. Collective. */
PetscErrorCode HycoReducerFetchRows(HycoReducer t, Mat S, PetscInt n_columns, PetscInt n, const PetscInt node[],
                                    PetscReal rows[]);
PetscErrorCode HycoReducerFetchSnapshots(HycoReducer t, PetscInt n, const PetscInt node[], PetscReal **rows);
/* Calls use(t, first, S, ctx) for all displacements, in batches of columns from `first` on: all of them, or with
   pod_memory as many as fit. S must not be changed. Collective. */
typedef PetscErrorCode (*HycoBatchUse)(HycoReducer t, PetscInt first, Mat S, void *ctx);
PetscErrorCode HycoReducerEachBatch(HycoReducer t, HycoBatchUse use, void *ctx);
/* The field of the store for each seed. */
extern const char *const HycoSeedFields[HYCO_N_SEEDS];
/* A field of the n samples from `first` on, displacements minus their lifting; of path j, displacements with the
   steps between its listed times. The caller owns it. Collective. */
PetscErrorCode HycoReducerReadField(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt first, PetscInt n,
                                    Mat *S);
PetscErrorCode HycoReducerReadPath(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt j, Mat *path);
/* POD of S into a basis; the same for a field of the store, read in batches within pod_memory, paths as in
   HycoPathModesAdd() and HycoPathModesJoin(). Collective. */
PetscErrorCode HycoReducerTakeBasis(HycoReducer t, Mat S, PetscReal tol, PetscInt most, HycoBasis *basis);
PetscErrorCode HycoReducerStreamBasis(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscReal tol, PetscInt most);
/* The factor that scales a path with this first singular value to the size of the largest. */
PetscReal HycoPathScale(PetscReal first, PetscReal largest);
/* Displacements of all snapshots minus their lifting, n_dof x n_s, owned by the caller; X^T Y of two matrices with
   the same rows, column major, on every rank. Collective. */
PetscErrorCode HycoReducerGetDisplacements(HycoReducer t, HycoSnapshots store, Mat *S);
PetscErrorCode HycoReducerMultiply(HycoReducer t, Mat X, Mat Y, PetscReal product[]);
/* The bases of all snapshots in the store and the points that seed the RID; all: every mode above the noise, so that
   HycoReducerTakeBases() can truncate the bases again when the tolerances have changed. Collective. */
PetscErrorCode HycoReducerReduce(HycoReducer t, HycoSnapshots store, PetscBool all);
PetscErrorCode HycoReducerTakeBases(HycoReducer t);
/* Held-out solutions of a search that begins with types with modes of their own, whose errors have bounds or are those
   of round-off; the least number that may serve instead of training solutions. */
#define HYCO_FEW_HELD 6
/* Draws or takes the held-out points, and solves them: t->held, NULL if there are none. Collective. */
PetscErrorCode HycoReducerHoldOut(HycoReducer t, HycoSnapshots store);
/* Adds the points that other types need, if there are few. Collective. */
PetscErrorCode HycoReducerHoldOutMore(HycoReducer t, HycoSnapshots store);
/* Replaces the held-out points by fresh ones, as many, and solves these; the user's own points stay, and fresh ones
   join them. Corners that training does not have are held out again. former: the points that no longer are (the caller
   owns it); n_fresh: the number of those that were not before. Collective. */
PetscErrorCode HycoReducerHoldOutFresh(HycoReducer t, HycoSnapshots store, HycoSamples *former, PetscInt *n_fresh);
/* From the solutions in the store to a model: bases, and of the settings that the options leave open those with the
   least online cost whose errors at the held-out points meet the targets (defaults if none are given), or else with
   the least errors. Sets report->chosen, its number 0 if there was no choice. *grown: the training points with those
   that were added to meet the targets, or NULL; the caller destroys it. Collective. */
PetscErrorCode HycoReducerLearn(HycoReducer t, HycoSnapshots store, HycoROM *model, HycoSamples *grown,
                                HycoTraining *report);
/*
  Estimated operations (search_work.c): of all solutions of the run; of a factor of K, and of a solve with it; of a
  search at most (PETSC_INFINITY: all attempts). HycoReducerSolvesOf(): the number of solves of a point, of a path in
  all of its steps. HycoReducerCountStiffnesses(): how many different stiffnesses or contact rows
  the points have; in_order: how often they change from one point to the next, with the first.
*/
PetscErrorCode HycoReducerSolutionsWork(HycoReducer t, PetscReal *operations);
PetscReal HycoReducerFactorWork(HycoReducer t);
PetscReal HycoReducerSolveWork(HycoReducer t);
PetscReal HycoReducerSolvesOf(HycoReducer t);
PetscErrorCode HycoReducerSearchBudget(HycoReducer t, PetscReal *operations);
PetscErrorCode HycoReducerCountStiffnesses(HycoReducer t, HycoSamples samples, PetscBool in_order, PetscInt *count);
/* For paths in 3D: the group of the support that is most probably a plane of symmetry across the contacts, whose
   cells are then the first RID; else NULL. Borrowed from the scene. Collective. */
PetscErrorCode HycoReducerFindPlane(HycoReducer t, const char **group);
/*
  Replay of the laws along the training paths (training_replay.c), on this rank's part, in the steps of full order;
  between listed times displacements are linear in time. HycoTrainingReplayFollow() goes through one path (without a
  history: one point) and calls record(ctx, k) at each listed time, where k is its column of the snapshots, the part's
  fe is at its parameters, and `u` and the march are at that time. displacement(ctx, k, u): the displacement of column k
  at the part's nodes (n_dof) minus its lifting. Both are collective, as all functions here. HycoTrainingReplayDestroy()
  also after a failure.
*/
typedef struct {
  HycoReducer t; /* borrowed, as fe */
  HycoFE fe;
  PetscErrorCode (*displacement)(void *ctx, PetscInt k, PetscReal u[]), (*record)(void *ctx, PetscInt k);
  void *ctx;
  PetscReal *u; /* n_dof */
  HycoTimeLoop march;
  PetscInt column;           /* the column of `before`; -1: none */
  PetscReal *before, *after; /* n_dof: displacements at two listed times */
} HycoTrainingReplay;
PetscErrorCode HycoTrainingReplayCreate(HycoReducer t, PetscErrorCode (*displacement)(void *, PetscInt, PetscReal[]),
                                        PetscErrorCode (*record)(void *, PetscInt), void *ctx,
                                        HycoTrainingReplay *replay);
PetscErrorCode HycoTrainingReplayFollow(HycoTrainingReplay *replay, HycoSnapshots store, PetscInt path);
PetscErrorCode HycoTrainingReplayDestroy(HycoTrainingReplay *replay);
/* B^T of the dual snapshots, and the supremizers M^-1 B^T of them with the matrix M of the H1 norm. Both n_dof x
   n_s, dense, rows in the distributed vectors' order, owned by the caller. Collective. */
PetscErrorCode HycoReducerSupremizers(HycoReducer t, Mat *forces, Mat *supremizers);
/* The columns of dense X, rows in the distributed vectors' order, scaled to unit length (0 if a column is 0, and
   where fixed), with rows as those of the modes, in the file's order (the caller owns it). Collective. */
PetscErrorCode HycoReducerUnitRows(HycoReducer t, Mat X, Mat *scaled);
/* Judges the model by the held-out solutions, calibrates its error estimates on them and stores both in it (rank 0):
   report->held_out, and n_held, the number of predictions behind the estimates (0: none, or too few). Collective. */
PetscErrorCode HycoReducerCalibrate(HycoReducer t, HycoSnapshots store, HycoROM model, HycoTraining *report);
/* The training points at corners of the ranges, at most `most`. The caller owns them. */
PetscErrorCode HycoReducerCorners(HycoReducer reducer, PetscInt most, HycoSamples *corners);

/* Result of a model at one held-out point, all PetscReal: errors (those of forces before division), for a path at
   its worst time, and at its end; the norms of forces and stress, whether it converged, the number of its group
   (calibrate.c), the features of the estimates, the time of some repetitions; 1 if the position of a body is arbitrary,
   and displacements are not judged. */
#define HYCO_HELD_REPEATS 3
typedef struct _n_HycoHeldOut {
  PetscReal error[HYCO_N_ERRORS], end[HYCO_N_ERRORS], size, rid_size, stress, converged, group, feature[HYCO_FEATURES],
      seconds[HYCO_HELD_REPEATS], loose;
} HycoHeldOut;
/* By HycoErrorKind, the norm of the error of a prediction, and that of the reference. */
typedef struct {
  PetscReal lost, size;
} HycoErrorNorm;
/* All of these except HYCO_ERROR_U, for the last prediction against a full-order solution: u at the nodes of the
   model's mesh (n_nodes * dim), sigma (n_cells * n_sigma; NULL: not compared) and inelastic (n_cells; NULL) in its
   cells, lambda (n_contacts). */
PetscErrorCode HycoROMMeasureRID(HycoROM model, const PetscReal u[], const PetscReal sigma[],
                                 const PetscReal inelastic[], const PetscReal lambda[], HycoErrorNorm lost[]);
/* The errors of a path from those of its n listed times (n x HYCO_N_ERRORS). */
/* Takes away errors of displacements at a listed time at which the position of a body is arbitrary. */
void HycoTraceExcludeDisplacements(HycoROM rom, PetscInt step, HycoErrorNorm lost[]);
void HycoPathErrorsJudge(PetscInt n, const HycoErrorNorm lost[], HycoPathErrors *errors);

/* Stops the predictions of held-out paths early: at the first one, in the order of `order`, that does not reach its
   end or has an error whose HycoAttemptsQuotient() is above `most`. */
typedef struct {
  PetscInt *order;                 /* all held-out points */
  const PetscReal *target, *limit; /* HycoReducerGetTargets() */
  PetscReal most, force;           /* most: PETSC_INFINITY: any; force: HycoHeldOutForce() of all points */
  PetscBool all;                   /* do not stop early */
  PetscInt n;                      /* result: the number of paths predicted, */
  PetscBool lost;                  /* and whether the last of them stopped it */
} HycoHeldOutEarlyStop;

/* Predicts with the last model built at each of n points, whose solutions must be in the store; rows[n] on every
   rank. The ranks share the points, and each compares its rows of the whole mesh. race: for paths; NULL: all points.
   Collective. */
PetscErrorCode HycoReducerPredictHeldOut(HycoReducer t, HycoSamples points, HycoROM model, HycoSnapshots store,
                                         HycoHeldOutEarlyStop *race, HycoHeldOut rows[]);
/* Judges the model at these corners too, whose rows follow the n held-out ones, and raises the largest errors.
   Collective. */
PetscErrorCode HycoReducerJudgeCorners(HycoReducer reducer, HycoSamples corners, PetscInt n, HycoROM model,
                                       HycoSnapshots store, HycoHeldOut rows[], HycoValidation *held_out);
/* Predicts at a held-out point of the store, a path in the steps of full order. */
PetscErrorCode HycoHeldOutPredict(HycoROM model, HycoSnapshots store, const PetscReal mu[]);
/* At one held-out point by output of the scene: the absolute error, and the largest absolute value at full order; for a
   path the largest of its listed times. NaN: not known. norm: of the field that it follows (HycoOutputNorm()). */
typedef struct {
  PetscReal error[HYCO_MAX_QUANTITIES], size[HYCO_MAX_QUANTITIES], norm[HYCO_MAX_QUANTITIES];
} HycoOutputErrors;
/* Predicts again with the final model at those of n points where rows[] converged, and sets errors[n], zero before, and
   the rows' features, on rank 0. Nothing if the scene has no outputs. Collective; model, rows and errors are those of
   rank 0. */
PetscErrorCode HycoReducerJudgeOutputs(HycoReducer t, HycoSamples points, HycoROM model, HycoSnapshots store,
                                       HycoHeldOut rows[], HycoOutputErrors errors[]);
/* The largest 2-norm of contact forces; a relative error, where forces below a tenth of that norm are divided by the
   tenth (PETSC_INFINITY: not converged, or x/0); a summary of all. */
PetscReal HycoHeldOutForce(PetscInt n, const HycoHeldOut rows[]);
PetscReal HycoHeldOutError(const HycoHeldOut *row, HycoErrorKind kind, PetscReal force);
PetscErrorCode HycoHeldOutSummarise(PetscInt n, const HycoHeldOut rows[], PetscReal force, HycoValidation *validation);

/* Sets numbers[] of the current model: condition and mean training errors; or only the errors, where a prediction
   that did not converge or is meaningless counts as HYCO_JUDGED_WORST. `most`: a mean error of u above it is of no
   interest, and both are then HYCO_JUDGED_WORST. Rank 0. */
/* Error of a model that gives no prediction: above the error 1 of the prediction 0. */
#define HYCO_JUDGED_WORST  10.0
#define HYCO_UNSOLVED_WORK 30 /* a prediction without a solution tries all methods: so many times the operations */
PetscErrorCode HycoReducerJudge(HycoReducer t, HycoROM model);
PetscErrorCode HycoReducerJudgeMeans(HycoReducer t, HycoROM model, PetscReal most, PetscReal *u, PetscReal *lambda);
/* The same for paths, to compare settings early: `best` (a row per sample) are the results of the best settings so
   far; samples where these were worst come first, and `lost` is set when the mean error of u cannot become smaller,
   or, after some paths, is not smaller so far. best NULL: lost when the mean reaches `most`. judged: all rows,
   unless lost. Rank 0. */
PetscErrorCode HycoReducerJudgeEarlyStop(HycoReducer t, HycoROM model, const HycoJudged best[], PetscReal most,
                                         HycoJudged judged[], PetscReal *u, PetscBool *lost);
/* To the monitor of phases, on rank 0: what is done, `done` of n, in a search with the settings that it tries. */
PetscErrorCode HycoReducerTell(HycoReducer t, const char what[], PetscInt done, PetscInt n);
/* After HycoReducerJudge(): which training solutions that model does not reach, and which have the largest errors.
   Rank 0. */
void HycoReducerNameWorst(HycoReducer t, char text[HYCO_LINE]);

/* The current settings. */
void HycoReducerGetSettings(HycoReducer t, HycoReducerSettings *settings);

/*
  Which of n attempts is chosen (choose_attempt.c): the cheapest of those that meet the targets, or of those whose
  errors exceed the best by little; NULL: none gave a model. HycoAttemptsLimit(): an attempt of that cost whose ratio
  exceeds the limit (at least 1) will not be chosen, whatever follows; *beaten: the number of the attempt that excludes
  it (0: none, and the limit is PETSC_INFINITY). HycoAttemptsReopen(): an attempt that was dropped, and may be chosen
  now that others were refused; NULL: none.
*/
/* Of an error and its target (> 0), at most 1 if it meets it; the largest quotient of a model is above HYCO_MISSES if
   and only if an error is above its limit (0: it has none). */
#define HYCO_MISSES 3
PetscReal HycoAttemptsQuotient(PetscReal target, PetscReal limit, PetscReal error);
HycoAttempt *HycoAttemptsChoose(PetscInt n, HycoAttempt attempt[]);
PetscReal HycoAttemptsLimit(PetscInt n, const HycoAttempt attempt[], PetscReal cost, PetscInt *beaten);
HycoAttempt *HycoAttemptsReopen(PetscInt n, HycoAttempt attempt[]);

#endif
