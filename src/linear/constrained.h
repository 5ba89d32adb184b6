/* Conjugate gradients under constraints, inside: the levels and their constraints. */
#ifndef CONSTRAINED_H
#define CONSTRAINED_H

#include <hycolinear.h>

typedef struct {
  Mat K, P;          /* borrowed; P: from the next coarser level, NULL on the coarsest */
  Mat product;       /* K as products take it, fastest */
  Vec inverse;       /* of K's diagonal D */
  Vec r, z, d, w;    /* work */
  Vec aggregate;     /* of each unknown: the next coarser level's node that interpolates it most, -1: none */
  PetscReal largest; /* eigenvalue of D^-1 K */
  PetscInt smooths;
  /* the constraints */
  PetscInt m;
  Mat B, DBt;     /* DBt = D^-1 B^T */
  Vec G_diagonal; /* the inverse of B D^-1 B^T where that is diagonal, else NULL */
  PetscReal G_scale;
  KSP G;           /* else the solver for G_scale times it */
  Vec mu, mu_work; /* as B x */
} HycoLevel;

struct _n_HycoConstrained {
  KSP ksp;                  /* conjugate gradients, preconditioned by a shell */
  PC pc, shell;             /* the multigrid for K that the shell makes use of; the shell, borrowed */
  KSP coarse;               /* borrowed from it; NULL: it is no multigrid */
  Vec residual, correction; /* of x */
  PetscInt n;
  HycoLevel *level; /* finest first */
  /* the coarsest level's constraints */
  PetscReal *S; /* the Cholesky factor of B K^-1 B^T, on every rank */
  Vec *Y;       /* K^-1 B^T */
  PetscInt n_Y;
  VecScatter all;
  Vec mu_all;
};

/* K, symmetric, by the blocks of its upper triangle, for products: a third of the memory's traffic. NULL: K has no
   blocks. Collective. */
PetscErrorCode HycoUpperBlocks(Mat K, Mat *upper);
/* z without what violates the constraints, orthogonal in D. */
PetscErrorCode HycoLevelProject(const HycoLevel *level, Vec z);
/* Frees the constraints of all levels. */
PetscErrorCode HycoConstraintsFree(HycoConstrained c);

#endif
