/* HycoTrainer, inside. */
#ifndef HYCOTRAINERIMPL_H
#define HYCOTRAINERIMPL_H

#include <hycomodelimpl.h>
#include <hycosnapshotsimpl.h>
#include <hycotrainer.h>

enum { HYCO_SEED_DISPLACEMENT, HYCO_SEED_STRESS, HYCO_SEED_FORCE, HYCO_SEED_DUAL, HYCO_N_SEEDS };

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
  HycoProgress progress;
  void *progress_ctx;
  /* state of a run, rank 0 unless said */
  HycoSamples samples; /* borrowed, every rank */
  HycoMesh whole;
  HycoPairs pairs;
  HycoFE fe;                                                     /* on the whole mesh */
  PetscInt sizes[4];                                             /* every rank: nodes, cells, contacts, dim */
  PetscInt n_seeds_node, n_seeds_cell, *seeds_node, *seeds_cell; /* every rank */
  PetscInt counts[HYCO_N_SEEDS];
  PetscInt l;
  PetscReal *sigma;      /* every rank: l */
  PetscReal *V_whole;    /* (n_nodes * dim) x l row major */
  PetscReal *U, *Lambda; /* snapshots, column major: n_dof x n_s, n_contacts x n_s */
  PetscReal *VtU;        /* l x n_s column major: V^T of the snapshots less their lifting */
  PetscReal *U_norm;     /* n_s: of the whole snapshot */
  PetscInt n_s;
  unsigned long long fingerprint;
};

/* Frees what one run leaves behind. */
PetscErrorCode HycoTrainerReset(HycoTrainer t);
/* The bases of all snapshots in the store and the points that seed the RID. Collective. */
PetscErrorCode HycoTrainerReduce(HycoTrainer t, HycoSnapshots store);
/* Chooses the full-order displacements of a model under training; numbers[] of the model are filled. Rank 0. */
PetscErrorCode HycoTrainerChooseHybrid(HycoTrainer t, HycoModel model);
/* Scans the ranges for a singular reduced stiffness, the points spread over the ranks: the model at `candidate`
   (removed) goes to `path` with what was found, or is refused. Collective. */
PetscErrorCode HycoTrainerScan(HycoTrainer t, const char candidate[], const char path[], HycoScan *found);

#endif
