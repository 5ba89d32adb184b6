/* HycoTrainer, inside. */
#ifndef HYCOTRAINERIMPL_H
#define HYCOTRAINERIMPL_H

#include <hycocondensed.h>
#include <hycomodelimpl.h>
#include <hycosnapshotsimpl.h>
#include <hycotrainer.h>

enum { HYCO_SEED_DISPLACEMENT, HYCO_SEED_STRESS, HYCO_SEED_FORCE, HYCO_SEED_DUAL, HYCO_N_SEEDS };

/* What the modes of a condensed model are made of (condense_modes.c): snapshots, and responses K^-1 B^T P to patterns
   of forces at each node of the stiffness. Rank 0, but for r, q, Q and scale. */
typedef struct {
  PetscInt r, n_columns, q; /* all modes above the noise; snapshots and responses, which they span; patterns */
  PetscReal *Q, *scale;     /* orthonormal patterns, m x q column major; column j of P is Q_j scale_j */
  PetscReal *C;             /* r x n_columns: V^T of the columns, the snapshots' first, then node by node */
  PetscReal missed; /* of sampled forces held out of the patterns, what 95 % of them have outside the span, by the
                       displacement of the nearest snapshot */
} HycoResponses;

struct _p_HycoTrainer {
  MPI_Comm comm;
  PetscMPIInt rank;
  HycoScene scene; /* borrowed */
  /* user parameters */
  char folder[PETSC_MAX_PATH_LEN]; /* of snapshots; "": from the model's name */
  PetscReal tol[HYCO_N_SEEDS], noise, extension;
  PetscInt max_modes, layers, trials;
  PetscBool seed[HYCO_N_SEEDS], whole_rid;
  PetscInt deim; /* of each basis that seeds the RID: 0 DEIM, 1 Q-DEIM */
  PetscInt n_groups;
  char *groups[64], *region;
  HycoHybrid hybrid;
  PetscReal ridge; /* hybrid all; < 0: chosen */
  PetscInt scan;   /* points per parameter; 0: chosen */
  PetscBool keep_singular;
  PetscInt folds; /* that calibrate the estimated errors; 0: none */
  HycoModelType type;
  HycoDual dual;
  PetscInt nnmf_max_its, nnmf_vectors;
  PetscReal condensed_tol; /* where the points are chosen */
  PetscInt condensed_max_values;
  HycoProgress progress;
  void *progress_ctx;
  struct {
    HycoIndicatorKind indicator;
    PetscReal target, max_seconds;
    PetscInt max_snapshots;
    PetscBool keep;
    HycoGreedyMonitor monitor;
    void *ctx;
  } greedy;
  /* state of a run, rank 0 unless said */
  HycoSamples samples; /* borrowed, every rank */
  HycoMesh whole;
  HycoPairs pairs;
  HycoFE fe;                                                     /* on the whole mesh */
  PetscInt sizes[4];                                             /* every rank: nodes, cells, contacts, dim */
  PetscInt n_seeds_node, n_seeds_cell, *seeds_node, *seeds_cell; /* every rank */
  PetscInt counts[HYCO_N_SEEDS];
  PetscInt l, n_supremizers; /* modes, and how many of them (the last) Enrich added */
  PetscReal *sigma;          /* every rank: l */
  PetscReal *V_whole;        /* (n_nodes * dim) x l row major */
  PetscReal *U, *Lambda;     /* snapshots, column major: n_dof x n_s, n_contacts x n_s */
  PetscReal *VtU;            /* l x n_s column major: V^T of the snapshots less their lifting */
  PetscReal *U_norm;         /* n_s: of the whole snapshot */
  PetscInt n_s;
  unsigned long long fingerprint;
  HycoResponses responses;
  HycoCondensed condensed; /* of a condensed model under training; the grid on every rank, the fields on rank 0 */
  PetscBool *grown;        /* rank 0, greedy: cells of the RIDs so far; else NULL */
};

/* Frees what one run leaves behind. */
PetscErrorCode HycoTrainerReset(HycoTrainer t);
/* Frees the bases, seeds and snapshots, and keeps the mesh. */
PetscErrorCode HycoTrainerResetBases(HycoTrainer t);
/* Begins a run: checks, the mesh, the store of snapshots (the caller destroys it). Collective. */
PetscErrorCode HycoTrainerOpen(HycoTrainer t, HycoSamples samples, const char path[], HycoSnapshots *store);
/* From the bases: the RID, the model on it, its full-order displacements, the file; what it gave, on every rank.
   `useful`: refuse a model that misses its own training solutions. Collective. */
PetscErrorCode HycoTrainerBuild(HycoTrainer t, PetscBool useful, const char path[], HycoTraining *report);
/* The useful model and its estimates, made beside `path` and then put in its place: a run that fails leaves what was
   there. Collective. */
PetscErrorCode HycoTrainerFinish(HycoTrainer t, HycoSnapshots store, const char path[], HycoTraining *report);
/* Displacements of all snapshots less their lifting, n_dof x n_s, the caller's; X^T Y of two matrices with the same
   rows, column major, on every rank; a dense matrix on rank 0, row or column major (the caller frees). Collective. */
PetscErrorCode HycoTrainerGetDisplacements(HycoTrainer t, HycoSnapshots store, Mat *S);
PetscErrorCode HycoTrainerMultiply(HycoTrainer t, Mat X, Mat Y, PetscReal product[]);
PetscErrorCode HycoTrainerToRoot(HycoTrainer t, Mat S, PetscBool row_major, PetscReal **out);
/* The bases of all snapshots in the store and the points that seed the RID. Collective. */
PetscErrorCode HycoTrainerReduce(HycoTrainer t, HycoSnapshots store);
/* Chooses the full-order displacements of a model under training; numbers[] of the model are filled. Rank 0. */
PetscErrorCode HycoTrainerChooseHybrid(HycoTrainer t, HycoModel model);
/* Scans the ranges for a singular reduced stiffness, the points spread over the ranks: the model at `candidate`
   (removed) goes to `path` with what was found, or is refused. Collective. */
PetscErrorCode HycoTrainerScan(HycoTrainer t, const char candidate[], const char path[], HycoScan *found);
/* Gives the model a table of its reduced stiffness if that is a polynomial of the parameters that reach it. Rank 0. */
PetscErrorCode HycoTrainerTabulate(HycoModel model, const PetscBool reaches[]);
/* B^T of the dual snapshots, and M^-1 of it with the matrix M of the H1 norm: where each force works most. Both n_dof x
   n_s, dense, the caller's. Rank 0. */
PetscErrorCode HycoTrainerSupremizers(HycoTrainer t, Mat *forces, Mat *supremizers);
/* Appends to the modes what the supremizers of the dual snapshots add to them, so that l, V_whole, sigma (0 for these)
   and VtU have more columns. Rank 0. */
PetscErrorCode HycoTrainerEnrich(HycoTrainer t);
/* The force basis of a projection-based model under training from its dual snapshots; fills numbers[]. Rank 0. */
PetscErrorCode HycoTrainerProject(HycoTrainer t, HycoModel model);
/* Calibrates the estimated errors of the hybrid model at `path` and writes it once more: report->n_held held-out
   predictions, or 0 and why in report->no_estimate. The bases are a fold's afterwards. Fails where a fold does, unless
   that says that it has no useful model. Collective. */
PetscErrorCode HycoTrainerCalibrate(HycoTrainer t, HycoSnapshots store, const char path[], HycoTraining *report);
/* A condensed model: checks that scene and samples are fit for one, before hours of work; G at all its nodes, factoring
   where no file has it; responses to q patterns P of forces (m x q column major, on every rank) at these nodes, into
   the columns of S (n_dof x ..., dense) from `first` on. Collective. */
PetscErrorCode HycoTrainerBeginCondensed(HycoTrainer t);
PetscErrorCode HycoTrainerFlexibility(HycoTrainer t, HycoSnapshots store);
PetscErrorCode HycoTrainerResponses(HycoTrainer t, HycoSnapshots store, PetscInt q, const PetscReal P[], Mat S,
                                    PetscInt first);
/* Its modes, once G is there: l, sigma, V_whole, VtU anew, and `responses`. Collective. */
PetscErrorCode HycoTrainerFindModes(HycoTrainer t, HycoSnapshots store);
/* The points of a condensed training that names none: two values of each parameter, to begin with; after
   HycoTrainerBeginCondensed(), solving and factoring on the way, those that meet -hyco_condensed_tol, in *samples (the
   caller's), the bases made. Collective. */
PetscErrorCode HycoTrainerStartPoints(HycoTrainer t, HycoSamples *samples);
PetscErrorCode HycoTrainerChoosePoints(HycoTrainer t, HycoSnapshots store, HycoSamples *samples);
/* Its fields and degrees, of all modes or none; the errors where values are left out; all of it, handed to the model,
   with numbers[]. Rank 0. */
PetscErrorCode HycoTrainerFillFields(HycoTrainer t, PetscBool modes);
PetscErrorCode HycoTrainerLeaveOut(HycoTrainer t);
PetscErrorCode HycoTrainerCondense(HycoTrainer t, HycoModel model);
/* Fills numbers[]: condition and mean training errors of the model as it stands. Rank 0. */
PetscErrorCode HycoTrainerJudge(HycoTrainer t, HycoModel model);

#endif
