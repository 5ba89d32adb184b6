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
  The step J s = b, J = I - DP (I - rho M). Each block's DP = E L^T has a small rank, L orthonormal, so that

      s = b + E a,     A a = L^T (b - rho M b),     A = L^T rho M E + I - L^T E,     det A = det J.

  Unknowns a: none of an open contact, one of a contact that slips in 2D, all components of one that sticks. A free
  unknown (p) has E = L = 1.

  A is factored for a base DP. J then differs from its base J0 in the rows of the blocks whose DP has changed, which are
  c rows P:  J = J0 + P R,  s = s0 - Z (I + R Z)^-1 R s0,  J0 s0 = b,  J0 Z = P. Columns of Z are kept with the factor,
  as is the factor with the HycoConeStep, from one problem of a path to the next. Where too many rows have changed, or
  I + R Z is nearly singular, the present DP becomes the base.
*/
typedef struct {
  PetscInt n, p;                /* rows, and free unknowns before those of the blocks */
  const HycoBlocks *blocks;     /* borrowed, as M and rho */
  const PetscReal *M, *rho;     /* M column major, n x n */
  PetscBool symmetric;          /* M is, as it is not with free unknowns */
  PetscReal *DP, *base;         /* HYCO_BLOCK for each block, row by row: now, and of the factor */
  PetscInt *rank;               /* of each block's DP */
  PetscBool *stiff, has_stiff;  /* by row: without flexibility; once for an M */
  PetscInt m, *base_rank;       /* unknowns a of the base, of all blocks and of each */
  HycoConeTerms *left, *right;  /* m each: L^T rho, E */
  PetscReal *A, *rhs, *product; /* m x m column major; m; n */
  PetscBLASInt *pivot, info;
  PetscBool factored; /* A is the factor for the base, or singular: info */
  PetscBool nearly_singular;
  PetscBool lagged;             /* the factor of the base stands for that of J, which is near */
  PetscInt c, *changed, *block; /* rows whose DP has changed since the base, and their blocks */
  PetscInt n_columns, *column;  /* of Z; by row: its column, or -1 */
  PetscReal *Z, *Q;             /* n x HYCO_CONE_CHANGES; rows of (I - rho M) Z, row by row, as far as known: */
  PetscInt *known;              /* by row: the number of columns */
  PetscReal *S, *small;         /* c x c: the factor of I + R Z; c */
  PetscBLASInt *small_pivot;
  PetscBool updated; /* S is that of the present DP */
} HycoConeStep;

#define HYCO_CONE_CHANGES 128 /* most rows by which J differs from its base */

/* n_blocks, p + rows of the blocks; nothing is derived yet. */
PetscErrorCode HycoConeStepCreate(PetscInt p, const HycoBlocks *blocks, const PetscReal rho[], HycoConeStep *step);
PetscErrorCode HycoConeStepDestroy(HycoConeStep *step);
/* Another M, or M after a change: no factor is valid. */
void HycoConeStepSetMatrix(HycoConeStep *step, const PetscReal M[]);
/* DP at y, by the given blocks, of the same rows; *changes: how many unknowns joined or left. */
PetscErrorCode HycoConeStepDerive(HycoConeStep *step, const HycoBlocks *blocks, const PetscReal y[], PetscInt *changes);
/* DP = 1 for rows with a diagonal entry, and 0 for others. */
PetscErrorCode HycoConeStepStick(HycoConeStep *step);
/* s of b; `least`: A by least squares. *regular: J has a factor, and s is finite. */
PetscErrorCode HycoConeStepSolve(HycoConeStep *step, const PetscReal b[], PetscBool least, PetscReal s[],
                                 PetscBool *regular);
/* z = DP (z - rho (q + M z)), which is the point z + s of the step from y, if P(y) = DP y in all blocks (*served), as
   where the cones are Coulomb's; else nothing. */
PetscErrorCode HycoConeStepPoint(HycoConeStep *step, const PetscReal q[], const PetscReal y[], PetscReal z[],
                                 PetscBool *regular, PetscBool *served);
/* dz = DP (dz - rho (dq + M dz)) for k columns: the derivative of z by q, where DP is that of a solution. */
PetscErrorCode HycoConeStepTangent(HycoConeStep *step, PetscInt k, const PetscReal dq[], PetscReal dz[],
                                   PetscBool *regular);
/* The present DP becomes the base, if it is not. */
PetscErrorCode HycoConeStepRenew(HycoConeStep *step);
/* Other blocks of the same rows, for the problems that follow. */
void HycoConeStepSetBlocks(HycoConeStep *step, const HycoBlocks *blocks);
/* The sign of det J; 0: singular. */
PetscErrorCode HycoConeStepSign(HycoConeStep *step, PetscInt *sign);

#endif
