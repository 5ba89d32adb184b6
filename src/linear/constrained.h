/* Conjugate gradients under constraints, private to linear/: the levels and their constraints. */
#ifndef CONSTRAINED_H
#define CONSTRAINED_H

#include <hycolinear.h>

typedef struct {
  Mat K, P;          /* borrowed; P: interpolation from the next coarser level, NULL on the coarsest */
  Mat product;       /* K in the format with the fastest product */
  Vec inverse;       /* of the diagonal D of K */
  Vec r, z, d, w;    /* work */
  Vec aggregate;     /* for each unknown: the node of the next coarser level with the largest interpolation weight,
                        -1: none */
  PetscReal largest; /* largest eigenvalue of D^-1 K */
  PetscInt smooths;
  /* constraints */
  PetscInt m;
  Mat B, DBt;     /* DBt = D^-1 B^T */
  Vec G_diagonal; /* the inverse of B D^-1 B^T where that is diagonal, else NULL */
  PetscReal G_scale;
  KSP G;           /* else the solver for G times G_scale */
  Vec mu, mu_work; /* like B x */
} HycoLevel;

struct _n_HycoConstrained {
  KSP ksp;                  /* conjugate gradients, preconditioned by a shell */
  PC pc, shell;             /* the multigrid for K inside the shell; the shell, borrowed */
  KSP coarse;               /* borrowed from it; NULL: not a multigrid */
  Vec residual, correction; /* like x */
  PetscInt n;
  HycoLevel *level; /* finest first */
  /* constraints of the coarsest level */
  PetscReal *S; /* the Cholesky factor of B K^-1 B^T, on every rank */
  Vec *Y;       /* K^-1 B^T */
  PetscInt n_Y;
  PetscReal *mu_all; /* a work array for their forces */
};

/* Converts K, symmetric, to the blocks of its upper triangle, for products: a third of the memory traffic. NULL: K
   has no blocks. Collective. */
PetscErrorCode HycoUpperBlocks(Mat K, Mat *upper);
/* Removes from z the part that violates the constraints, orthogonal in D. */
PetscErrorCode HycoLevelProject(const HycoLevel *level, Vec z);
/* Frees the constraints of all levels. */
PetscErrorCode HycoConstraintsFree(HycoConstrained c);

#endif
