/* What friction adds to the contacts of a process, at full order and in a model: their rows, cones and coefficients,
   and the state that follows from the forces and slips of a step. */
#ifndef HYCOSLIP_H
#define HYCOSLIP_H

#include <hycocone.h>
#include <hycocontactimpl.h>
#include <hycofe.h>

typedef struct {
  PetscInt n, dim;
  PetscInt *row;        /* n + 1: the first row of each contact: its normal, then dim - 1 tangents if it has friction */
  PetscInt *of;         /* n: its cone, */
  HycoCone cone[2];     /* without friction, and with */
  PetscReal *data, *mu; /* of the blocks (HycoSystemSetBlocks()); n */
  PetscReal *tangent;   /* 6 n */
  HycoShear shear;
  PetscInt n_taken; /* accepted times so far, and the last two: */
  PetscReal t, t_before;
} HycoSlip;

/* For the pairs of a process; no slip yet. Collective on comm. */
PetscErrorCode HycoSlipCreate(MPI_Comm comm, HycoScene scene, const HycoPairs *pairs, PetscInt dim, HycoSlip *slip);
PetscErrorCode HycoSlipDestroy(HycoSlip *slip);
/* At the start of a path: no slip. */
PetscErrorCode HycoSlipBegin(HycoSlip *slip);
/* The coefficients at the slaves' places, at fe's parameters; fails for a negative one. */
PetscErrorCode HycoSlipCoefficients(HycoSlip *slip, HycoFE fe, const HycoPairs *pairs);
/* Whether one of this process is above 0. */
PetscBool HycoSlipHasFriction(const HycoSlip *slip);
/* Adds the slips -w_t of an accepted step, with the forces L and w of all rows. most: the largest displacement. */
void HycoSlipAdd(HycoSlip *slip, const PetscReal L[], const PetscReal w[], PetscReal most);
/* The time of an accepted step. */
void HycoSlipTake(HycoSlip *slip, PetscReal t);
/* r: forces L of the last accepted time, extrapolated with those before to the time t; false: there are not enough
   times. */
PetscBool HycoSlipExtrapolate(const HycoSlip *slip, PetscReal t, PetscInt n, const PetscReal L[],
                              const PetscReal before[], PetscReal r[]);
/* L by row, from the normal forces and the vectors (3 n) of friction on the slaves, with the present tangents. */
void HycoSlipForces(const HycoSlip *slip, const PetscReal normal[], const PetscReal force[], PetscReal L[]);
/* The vectors of friction on the slaves (shear.force) from the forces L by row: the reverse. */
void HycoSlipVectors(HycoSlip *slip, const PetscReal L[]);
/* The number of rows of these contacts: one each, or one for each dimension with friction. */
PetscInt HycoSlipCountRows(HycoScene scene, const HycoPairs *pairs, PetscInt dim);
/* sum: the work since the start and the number of slipping contacts of this process. */
void HycoSlipSum(const HycoSlip *slip, PetscReal sum[2]);

#endif
