/* The linear algebra of a step of semismooth Newton's method for blocks of any cone (semismooth_step.c). */
#ifndef SEMISMOOTH_H
#define SEMISMOOTH_H

#include <hycoconeimpl.h>
#include <hycolcp.h>

#define HYCO_BLOCK (HYCO_MAX_BLOCK * HYCO_MAX_BLOCK) /* room for a matrix of a block */

/* A row of L^T or a column of E, which are those of one block. */
typedef struct {
  PetscInt n, row[HYCO_MAX_BLOCK];
  PetscReal value[HYCO_MAX_BLOCK];
} HycoConeTerms;

/*
  The step J s = -F, J = I - DP (I - rho M). Each block's DP = E L^T has a small rank, L orthonormal, so that

      s = -F + E a,     A a = L^T (rho M F - F),     A = L^T rho M E + I - L^T E,     det A = det J.

  Unknowns a: none of an open contact, one of a contact that slips in 2D, all components of one that sticks. A free
  unknown (p) has E = L = 1. The factor of A is kept while DP is unchanged.
*/
typedef struct {
  PetscInt n, p;                /* rows, and free unknowns before those of the blocks */
  const HycoBlocks *blocks;     /* borrowed, as M and rho */
  const PetscReal *M, *rho;     /* M column major, n x n */
  PetscReal *DP;                /* HYCO_BLOCK for each block, row by row */
  PetscInt m, *rank;            /* unknowns a, of all blocks and of each */
  HycoConeTerms *left, *right;  /* m each: L^T rho, E */
  PetscReal *A, *rhs, *product; /* m x m column major; m; n */
  PetscBLASInt *pivot, info;
  PetscBool factored; /* A is the factor for DP, or singular: info */
  PetscBool nearly_singular;
} HycoConeStep;

/* n_blocks, p + rows of the blocks; nothing is derived yet. */
PetscErrorCode HycoConeStepCreate(PetscInt p, const HycoBlocks *blocks, const PetscReal rho[], HycoConeStep *step);
PetscErrorCode HycoConeStepDestroy(HycoConeStep *step);
/* Another M, or M after a change: no factor is valid. */
void HycoConeStepSetMatrix(HycoConeStep *step, const PetscReal M[]);
/* DP at y, by the given blocks, of the same rows; *changes: how many unknowns joined or left. */
PetscErrorCode HycoConeStepDerive(HycoConeStep *step, const HycoBlocks *blocks, const PetscReal y[], PetscInt *changes);
/* DP = 1 for rows with a diagonal entry, and 0 for others. */
PetscErrorCode HycoConeStepStick(HycoConeStep *step);
/* s; `least`: A by least squares. *regular: A has a factor, and s is finite. */
PetscErrorCode HycoConeStepSolve(HycoConeStep *step, const PetscReal F[], PetscBool least, PetscReal s[],
                                 PetscBool *regular);
/* The sign of det J; 0: singular. */
PetscErrorCode HycoConeStepSign(HycoConeStep *step, PetscInt *sign);
/* y += M x; columns of zero entries are skipped. */
PetscErrorCode HycoAddDenseProduct(PetscInt n, const PetscReal M[], const PetscReal x[], PetscReal y[]);

#endif
