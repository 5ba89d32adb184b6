/* HycoReducer, inside. */
#ifndef HYCOREDUCERIMPL_H
#define HYCOREDUCERIMPL_H

#include <hycoromimpl.h>
#include <hycosnapshotsimpl.h>
#include <hycoreducer.h>
#include <slepcsvd.h>

enum {
  HYCO_SEED_DISPLACEMENT,
  HYCO_SEED_STRESS,
  HYCO_SEED_FORCE,
  HYCO_SEED_DUAL,
  HYCO_SEED_INELASTIC, /* of scenes with a history */
  HYCO_SEED_SPRING,    /* of scenes with springs: forces, too */
  HYCO_N_SEEDS
};

/* The basis of one field of the snapshots, which a recipe takes the first modes of. Every rank. */
typedef struct {
  Mat V; /* l modes, rows spread */
  PetscInt l, n_sigma;
  PetscReal *sigma;        /* n_sigma singular values (room for n_s + 1) */
  PetscReal *coefficients; /* displacements: l x n_s column major, V^T of the snapshots less their lifting; else NULL */
} HycoBasis;

/* What the search for a recipe (settings_search.c) chooses, unless the options have it. */
enum {
  HYCO_CHOICE_TYPE,
  HYCO_CHOICE_TOLERANCE,
  HYCO_CHOICE_LAYERS,
  HYCO_CHOICE_EXTENSION,
  HYCO_CHOICE_HYBRID,
  HYCO_CHOICE_WHOLE,
  HYCO_N_CHOICES
};

/* What a model made of a training solution. */
typedef struct {
  PetscReal u, lambda; /* errors, at most HYCO_JUDGED_WORST */
  PetscBool solved;
  PetscReal t; /* else, of a path: how far it came */
} HycoJudged;

struct _p_HycoReducer {
  PETSCHEADER(int);
  PetscMPIInt rank;
  HycoScene scene; /* referenced */
  /* user parameters */
  char folder[PETSC_MAX_PATH_LEN]; /* of snapshots; "": from the model's name */
  PetscReal tol[HYCO_N_SEEDS], noise, extension;
  PetscReal pod_memory; /* MB of all ranks for the snapshots of a field; 0: all at once */
  PetscInt max_modes, layers;
  char svd_type[32]; /* of PODs */
  PetscBool seed[HYCO_N_SEEDS], whole_rid;
  PetscInt deim; /* of each basis that seeds the RID: 0 DEIM, 1 Q-DEIM */
  PetscInt n_groups;
  char **groups, *region; /* n_groups, and NULL */
  const char *plane;      /* of the search for a recipe: a group more, and displacements alone seed; NULL: none */
  HycoHybrid hybrid;
  PetscReal ridge;  /* of the search for a recipe: known from an attempt, or what this one found; < 0: to be chosen */
  PetscBool trying; /* an attempt of that search: a model that no report tells of */
  PetscBool exhaustive;
  char doing[HYCO_LINE];    /* of that search, for the monitor of phases: the recipe */
  PetscInt most_full_order; /* hybrid all: the most full-order displacements; 0: no limit */
  PetscInt scan;            /* points per parameter; 0: chosen */
  PetscBool keep_singular;
  PetscInt n_validation; /* held-out solutions beside the training points; < 0: from their number */
  PetscBool search;      /* for what nobody pinned of the recipe */
  PetscBool pinned[HYCO_N_CHOICES];
  HycoAttemptMonitor attempt;
  HycoAddedMonitor added;
  void *attempt_ctx;
  PetscReal target[HYCO_N_ERRORS]; /* 0: none */
  PetscInt budget;                 /* solutions that may be added to meet the targets */
  HycoROM prototype;               /* a model of the type to be trained, without anything in it: its ops. Every rank */
  void *training;                  /* the type's options, and what a run has made */
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
  /* state of a run, rank 0 unless said */
  HycoSnapshots store;    /* borrowed, every rank */
  HycoSamples samples;    /* borrowed, every rank */
  HycoSamples validation; /* given by the user (borrowed; NULL: none). Every rank */
  HycoSamples held;       /* of this run; NULL: none. Every rank */
  struct _n_HycoHeldOut
      *judged_held; /* what the model just built makes of these, of paths; NULL: not known. Every rank */
  PetscInt drawn;   /* unseen points drawn so far */
  HycoBasis basis[HYCO_N_SEEDS];
  PetscInt n_dual_seeds, *dual_seeds; /* nodes */
  HycoFOM fom;                        /* every rank: the mesh over the ranks and its contacts, without matrices */
  HycoMet met;                        /* moved surfaces: what they meet, as far as it matters */
  PetscInt sizes[4];                  /* every rank: nodes, cells, contacts, dim */
  PetscInt n_seeds_node, n_seeds_cell, *seeds_node, *seeds_cell; /* every rank */
  PetscInt counts[HYCO_N_SEEDS];
  PetscInt l;             /* modes */
  PetscReal *sigma;       /* every rank: l */
  Mat V;                  /* every rank: the modes (at least l), rows spread */
  Mat S;                  /* every rank: displacements, n_dof x n_s, rows spread as V's; NULL with pod_memory */
  PetscReal *U_rid;       /* of these, the rows of the model's mesh, column major */
  PetscReal *V_rid;       /* and of V */
  PetscInt *surface_node; /* by node of the contacts' surfaces: that of the model's mesh, or -1 */
  PetscBool *fixed;       /* by unknown of the model's mesh */
  PetscInt *contact_row;  /* by node of the contacts' surfaces: its place in U_contact, or -1 */
  PetscReal *U_contact;   /* the rows of the contacts' nodes, column major */
  PetscInt n_contact_nodes;
  PetscReal *Lambda;     /* n_contacts x n_s column major */
  PetscReal *VtU;        /* l x n_s column major: V^T of the snapshots less their lifting */
  PetscReal *U_norm;     /* n_s: of the whole snapshot */
  PetscInt n_s;          /* columns of snapshots: a sample each, of a history one per listed time of each */
  PetscInt *taken_start; /* rank 0, of a history: n_samples + 1, where the times of a path's steps begin in */
  PetscReal *taken;
  HycoJudged *judged; /* rank 0, by sample: of HycoReducerJudge(); NULL: it was not called */
  unsigned long long fingerprint;
  PetscInt n_solvers, *solved; /* of the last run, every rank: groups of ranks, and the solutions of each */
  PetscBool *grown;            /* every rank, greedy: cells of its part in the RIDs so far; else NULL */
};

/* The scene's variables where column k of the snapshots is: all of mu (HYCO_MAX_PARAMETERS). */
PetscErrorCode HycoReducerColumn(HycoReducer t, PetscInt k, PetscReal mu[]);
/* t->n_s of the samples. */
PetscErrorCode HycoReducerCount(HycoReducer t);
/* Frees what one run leaves behind. */
PetscErrorCode HycoReducerReset(HycoReducer t);
/* Takes a registered type, with its options; the present one stays as it is. */
PetscErrorCode HycoReducerSetType(HycoReducer t, HycoROMType type);
/* The dual snapshots that are not zero (n_contacts x n column major, the caller's). Rank 0. */
PetscErrorCode HycoReducerDualSnapshots(HycoReducer t, PetscInt *n, PetscReal **S);
/* A number that the type reports. */
PetscErrorCode HycoTrainingAddFact(HycoTraining *report, const char name[], PetscReal value);
/* Frees the bases, seeds and snapshots, and keeps the mesh; what one recipe took of the bases alone. */
PetscErrorCode HycoReducerResetBases(HycoReducer t);
PetscErrorCode HycoReducerDropBases(HycoReducer t);
/* Begins a run: checks, the mesh, the store of snapshots. Collective. */
PetscErrorCode HycoReducerOpen(HycoReducer t, HycoSamples samples, const char path[], HycoSnapshots *store);
/* Ends it: the store's counts are kept, and it is destroyed. Collective. */
PetscErrorCode HycoReducerClose(HycoReducer t, HycoSnapshots *store);
/* From the bases: the RID, the model on it, in *model on every rank (the caller's; its whole-mesh part is the reducer's
   alone), and what it gave. `useful`: refuse a model that misses its own training solutions
   or is singular in the ranges. Collective. */
PetscErrorCode HycoReducerBuild(HycoReducer t, PetscBool useful, HycoROM *model, HycoTraining *report);
/* The useful model with its estimates, then its file, written once: a run that fails leaves what was there. Collective.
 */
PetscErrorCode HycoReducerFinish(HycoReducer t, HycoSnapshots store, const char path[], PetscBool learn,
                                 HycoTraining *report);
/* The SVD of its PODs, the caller's: with the reducer's type, and options -hyco_pod_svd_... to be read. */
PetscErrorCode HycoReducerCreateSVD(HycoReducer t, MPI_Comm comm, SVD *svd);
/* HycoPOD() by that; how many of the `found` modes that
   it gave the tolerance takes: fails where it takes more, for lack of accuracy. Collective on S; not collective. */
PetscErrorCode HycoReducerPOD(HycoReducer t, Mat S, PetscReal tol, PetscInt max_modes, Mat *V, PetscInt *l,
                              PetscReal sigma[]);
PetscErrorCode HycoReducerPODRank(HycoReducer t, PetscInt n_sigma, const PetscReal sigma[], PetscReal tol,
                                  PetscInt max_modes, PetscInt found, PetscInt *l);
/*
  The POD of paths: of each, then of these, each brought to the size of the largest: a slow one counts as much as a fast
  one. HycoPathModesAdd(): of a path's columns, which stay; the modes begin as {0}. HycoPathModesJoin() ends them: V, l,
  sigma and n_sigma of `basis`, the caller's (no mode: V is NULL or has no column), of N rows, n_rows here. tol 0: every
  mode above the noise. Collective. HycoPathModesDestroy() after a failure.
*/
typedef struct {
  PetscInt n;
  Mat *V;           /* the modes of each path, times their singular values; NULL: none */
  PetscReal *first; /* of these */
} HycoPathModes;
PetscErrorCode HycoPathModesAdd(HycoReducer t, Mat path, PetscReal tol, HycoPathModes *modes);
PetscErrorCode HycoPathModesJoin(HycoReducer t, HycoPathModes *modes, PetscInt N, PetscInt n_rows, PetscReal tol,
                                 PetscInt max_modes, HycoBasis *basis);
PetscErrorCode HycoPathModesDestroy(HycoPathModes *modes);
/* On rank 0 (column major; elsewhere empty) the first n_columns of S, a matrix of displacements, at nodes that rank 0
   gives by their numbers in the whole mesh; of all snapshots, the caller's to free. Collective. */
PetscErrorCode HycoReducerFetchRows(HycoReducer t, Mat S, PetscInt n_columns, PetscInt n, const PetscInt node[],
                                    PetscReal rows[]);
PetscErrorCode HycoReducerFetchSnapshots(HycoReducer t, PetscInt n, const PetscInt node[], PetscReal **rows);
/* use(t, first, S, ctx) for all displacements, in batches of columns from `first` on: all of them, or with pod_memory
   as many as that lets in. S is not to be changed. Collective. */
typedef PetscErrorCode (*HycoBatchUse)(HycoReducer t, PetscInt first, Mat S, void *ctx);
PetscErrorCode HycoReducerEachBatch(HycoReducer t, HycoBatchUse use, void *ctx);
/* The field of the store whose modes a seed is of. */
extern const char *const HycoSeedFields[HYCO_N_SEEDS];
/* A field of the n samples from `first` on, displacements less their lifting; of path j, displacements with the steps
   between its listed times. The caller's. Collective. */
PetscErrorCode HycoReducerReadField(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt first, PetscInt n,
                                    Mat *S);
PetscErrorCode HycoReducerReadPath(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscInt j, Mat *path);
/* POD of S into a basis; the same of a field of the store, read in batches that pod_memory bounds, of paths each as
   HycoPathModesAdd() and HycoPathModesJoin() do. Collective. */
PetscErrorCode HycoReducerTakeBasis(HycoReducer t, Mat S, PetscReal tol, PetscInt most, HycoBasis *basis);
PetscErrorCode HycoReducerStreamBasis(HycoReducer t, HycoSnapshots store, PetscInt kind, PetscReal tol, PetscInt most);
/* What brings a path with this first singular value to the size of the largest. */
PetscReal HycoPathScale(PetscReal first, PetscReal largest);
/* Displacements of all snapshots less their lifting, n_dof x n_s, the caller's; X^T Y of two matrices with the same
   rows, column major, on every rank. Collective. */
PetscErrorCode HycoReducerGetDisplacements(HycoReducer t, HycoSnapshots store, Mat *S);
PetscErrorCode HycoReducerMultiply(HycoReducer t, Mat X, Mat Y, PetscReal product[]);
/* The bases of all snapshots in the store and the points that seed the RID; all: every mode above the noise, so that
   HycoReducerTakeBases() can cut the bases again when the tolerances have changed. Collective. */
PetscErrorCode HycoReducerReduce(HycoReducer t, HycoSnapshots store, PetscBool all);
PetscErrorCode HycoReducerTakeBases(HycoReducer t);
/* Draws or takes the points that the model is judged by, and solves them: t->held, NULL where there are none.
   Collective. */
PetscErrorCode HycoReducerHoldOut(HycoReducer t, HycoSnapshots store);
/* From the solutions in the store to a model: bases, and of the recipes that the options leave open the one with the
   least cost online whose errors at the held-out points meet the targets (usual ones where none are given), or else
   with the least errors. Sets report->chosen, its number 0 where there was nothing to choose. *grown: the training
   points with those that were added to meet the targets, or NULL; the caller destroys it. Collective. */
PetscErrorCode HycoReducerLearn(HycoReducer t, HycoSnapshots store, HycoROM *model, HycoSamples *grown,
                                HycoTraining *report);
/* Of paths in 3D the group of the support that looks most like a plane of symmetry across the contacts, whose cells
   are then the first RID; else NULL. Borrowed from the scene. Collective. */
PetscErrorCode HycoReducerFindPlane(HycoReducer t, const char **group);
/*
  The laws again along the training paths (training_replay.c), on this rank's part, in the steps that full order took;
  between listed times displacements are linear in time. HycoTrainingReplayFollow() goes through one path (without a
  history: a point) and calls record(ctx, k) at each listed time, where k is its column of the snapshots, the part's fe
  is at its parameters and `u` and the march are there. displacement(ctx, k, u): that of column k at the part's nodes
  (n_dof) less its lifting. Both are collective, as all of it. HycoTrainingReplayDestroy() also after a failure.
*/
typedef struct {
  HycoReducer t; /* borrowed, as fe */
  HycoFE fe;
  PetscErrorCode (*displacement)(void *ctx, PetscInt k, PetscReal u[]), (*record)(void *ctx, PetscInt k);
  void *ctx;
  PetscReal *u; /* n_dof */
  HycoMarch march;
  PetscInt column;           /* that of `before`; -1: none */
  PetscReal *before, *after; /* n_dof: displacements of two listed times */
} HycoTrainingReplay;
PetscErrorCode HycoTrainingReplayCreate(HycoReducer t, PetscErrorCode (*displacement)(void *, PetscInt, PetscReal[]),
                                        PetscErrorCode (*record)(void *, PetscInt), void *ctx,
                                        HycoTrainingReplay *replay);
PetscErrorCode HycoTrainingReplayFollow(HycoTrainingReplay *replay, HycoSnapshots store, PetscInt path);
PetscErrorCode HycoTrainingReplayDestroy(HycoTrainingReplay *replay);
/* B^T of the dual snapshots, and M^-1 of it with the matrix M of the H1 norm: where each force works most. Both n_dof x
   n_s, dense, rows by the distributed vectors' order, the caller's. Collective. */
PetscErrorCode HycoReducerSupremizers(HycoReducer t, Mat *forces, Mat *supremizers);
/* Columns of unit length (0 where one has none, and where fixed) of dense X, rows by the distributed vectors' order,
   with the rows of the modes, by the file's (the caller's). Collective. */
PetscErrorCode HycoReducerUnitRows(HycoReducer t, Mat X, Mat *scaled);
/* Judges the model by the held-out solutions, calibrates the estimates of its errors on them and notes both in it (rank
   0): report->held_out, and n_held, the predictions behind the estimates (0: none; too few). Collective. */
PetscErrorCode HycoReducerCalibrate(HycoReducer t, HycoSnapshots store, HycoROM model, HycoTraining *report);

/* What a model gave at one held-out point, all PetscReal: errors (those of forces before division), of a path at its
   worst time, and at its end; the forces' sizes, whether it converged, the features of the estimates, the time of some
   repetitions. */
#define HYCO_HELD_REPEATS 3
typedef struct _n_HycoHeldOut {
  PetscReal error[HYCO_N_ERRORS], end[HYCO_N_ERRORS], size, rid_size, converged, feature[HYCO_TRUST_FEATURES],
      seconds[HYCO_HELD_REPEATS];
} HycoHeldOut;
/* What a prediction misses, by HycoErrorKind, and the size of what it is to be. */
typedef struct {
  PetscReal lost, size;
} HycoLost;
/* All of these but HYCO_ERROR_U, of the prediction as it stands, against a full-order solution: u at the nodes of the
   model's mesh (n_nodes * dim), sigma (n_cells * n_sigma; NULL: not compared) and inelastic (n_cells; NULL) in its
   cells, lambda (n_contacts). */
PetscErrorCode HycoROMMeasureRID(HycoROM model, const PetscReal u[], const PetscReal sigma[],
                                 const PetscReal inelastic[], const PetscReal lambda[], HycoLost lost[]);
/* The errors of a path from those of its n listed times (n x HYCO_N_ERRORS). */
void HycoPathErrorsJudge(PetscInt n, const HycoLost lost[], HycoPathErrors *errors);

/* Where the predictions of held-out paths end early: with the first of them, in the order of `order`, that does not
   reach its end or has an error above `most` times its target. */
typedef struct {
  PetscInt *order;         /* all held-out points */
  const PetscReal *target; /* by HycoErrorKind; 0: none */
  PetscReal most, force;   /* PETSC_INFINITY: any; that of HycoHeldOutForce() of all points */
  PetscBool all;           /* do not end early */
  PetscInt n;              /* out: so many were predicted, */
  PetscBool lost;          /* and the last of them ended it */
} HycoHeldOutRace;

/* Predicts at each held-out point, whose solution must be in the store, with the model just built; rows[n] on every
   rank. The ranks share the points out, and of each compare their rows of the whole mesh. race: of paths; NULL: all
   points. Collective. */
PetscErrorCode HycoReducerPredictHeldOut(HycoReducer t, HycoROM model, HycoSnapshots store, HycoHeldOutRace *race,
                                         HycoHeldOut rows[]);
/* The largest contact forces' 2-norm; a relative error, forces below a tenth of that one divided by the tenth
   (PETSC_INFINITY: not converged, or x/0); all of it in short. */
PetscReal HycoHeldOutForce(PetscInt n, const HycoHeldOut rows[]);
PetscReal HycoHeldOutError(const HycoHeldOut *row, HycoErrorKind kind, PetscReal force);
PetscErrorCode HycoHeldOutSummarise(PetscInt n, const HycoHeldOut rows[], PetscReal force, HycoValidation *validation);

/* Fills numbers[] of a model as it stands: condition and mean training errors; these alone, an unsolved or wild
   prediction counting as HYCO_JUDGED_WORST. Rank 0. */
#define HYCO_JUDGED_WORST 10.0
PetscErrorCode HycoReducerJudge(HycoReducer t, HycoROM model);
PetscErrorCode HycoReducerJudgeMeans(HycoReducer t, HycoROM model, PetscReal *u, PetscReal *lambda);
/* The same of paths, of settings in a race: `best` (a row a sample) is what the best so far made of them, its worst
   ones first come first, and `lost` says that the mean of u cannot become less, or, after some paths, that so far it is
   not. best NULL: it is lost where the mean reaches `most`. judged: all rows, unless it is lost. Rank 0. */
PetscErrorCode HycoReducerJudgeRace(HycoReducer t, HycoROM model, const HycoJudged best[], PetscReal most,
                                    HycoJudged judged[], PetscReal *u, PetscBool *lost);
/* To the monitor of phases: what the search for a recipe does with the one that it tries, `done` of n. */
PetscErrorCode HycoReducerTell(HycoReducer t, const char what[], PetscInt done, PetscInt n);
/* After HycoReducerJudge(): which training solutions that model does not reach, and which it misses most. Rank 0. */
void HycoReducerNameWorst(HycoReducer t, char text[HYCO_LINE]);

/* The settings as they stand. */
void HycoReducerGetRecipe(HycoReducer t, HycoRecipe *recipe);

/*
  Which of n attempts is taken (choose_recipe.c): the cheapest of those that meet the targets, or of those that miss
  them by little more than the best; NULL: none gave a model. HycoAttemptsLimit(): an attempt of that cost whose ratio
  exceeds the limit (at least 1) is not taken, whatever comes after; *beaten: the number of the attempt that keeps it
  from that (0: none, and the limit is PETSC_INFINITY). HycoAttemptsReopen(): an attempt that was dropped, and might be
  taken now that others were refused; NULL: none.
*/
HycoAttempt *HycoAttemptsChoose(PetscInt n, HycoAttempt attempt[]);
PetscReal HycoAttemptsLimit(PetscInt n, const HycoAttempt attempt[], PetscReal cost, PetscInt *beaten);
HycoAttempt *HycoAttemptsReopen(PetscInt n, HycoAttempt attempt[]);

#endif
