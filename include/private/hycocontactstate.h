/*
  HycoContactState: the contacts of a path whose scene has friction, at full order and in a model. Their rows with the
  cone of each, from the first step on; forces, slips and places at the last accepted times, from which the next step
  begins. A path owns that of its contact system (HycoPath.friction), a model that of its results.
*/
#ifndef HYCOCONTACTSTATE_H
#define HYCOCONTACTSTATE_H

#include <hycocone.h>
#include <hycocontactimpl.h>
#include <hycofe.h>
#include <hycofom.h>
#include <hycosolver.h>

typedef struct _n_HycoContactState *HycoContactState;
struct _n_HycoContactState {
  MPI_Comm comm;
  HycoPairs *pairs; /* borrowed: the contacts of this process, whose number stays */
  PetscInt n, dim;
  PetscInt *row;        /* n + 1: the first row of each contact: its normal, then dim - 1 tangents if it has friction */
  PetscInt *of;         /* n: its cone, */
  HycoCone cone[2];     /* without friction, and with */
  PetscReal *data, *mu; /* of the blocks (HycoSystemSetBlocks()); n */
  PetscReal *tangent;   /* 6 n */
  HycoShear shear;      /* forces, slips, work and states since the path began */
  PetscInt n_dof;
  PetscReal *u_old;       /* n_dof: of the surfaces at the last accepted time, from which the slip of a step counts */
  Vec L, L_before, ahead; /* by row: forces of the last two accepted times; a start of the next step */
  PetscInt n_taken;       /* accepted times so far, and the last two: */
  PetscReal t, t_before;
};

/* For the pairs of a process; no slip yet. Collective on comm. */
PetscErrorCode HycoContactStateCreate(MPI_Comm comm, HycoScene scene, HycoPairs *pairs, PetscInt dim,
                                      HycoContactState *state);
/* NULL-safe. */
PetscErrorCode HycoContactStateDestroy(HycoContactState *state);
/* At the start of a path: no forces, no slip, bodies at rest. */
PetscErrorCode HycoContactStateBegin(HycoContactState state);
/* The coefficients at the slaves' places, at fe's parameters; fails for a negative one. */
PetscErrorCode HycoContactStateCoefficients(HycoContactState state, HycoFE fe);
/* The same, and the rows of all contacts; the gap of a tangent is its displacement at the last accepted time. Local: a
   coefficient may be wrong on one rank only. */
PetscErrorCode HycoContactStateRows(HycoContactState state, HycoFE fe, HycoRows *rows);
/* Whether a coefficient is above 0. Collective. */
PetscErrorCode HycoContactStateHasFriction(HycoContactState state, PetscBool *has_friction);
/* The cones of the system of a step to t, and the solver's other start. Collective. */
PetscErrorCode HycoContactStateSetStep(HycoContactState state, PetscReal t, HycoSystem system, HycoSolver solver);
/* r, by row: the forces of the last two accepted times, extrapolated to the time t; has: there are enough times. */
PetscErrorCode HycoContactStateExtrapolate(HycoContactState state, PetscReal t, PetscReal r[], PetscBool *has);
/* Adds the slips -w_t of an accepted step, with the forces L and w of all rows. most: the largest displacement. */
void HycoContactStateAddSlips(HycoContactState state, const PetscReal L[], const PetscReal w[], PetscReal most);
/* The same; and the step's time, forces and displacements u (n_dof) are those from which the next one begins. */
PetscErrorCode HycoContactStateAccept(HycoContactState state, PetscReal t, const PetscReal L[], const PetscReal w[],
                                      PetscReal most, const PetscReal u[]);
/* The work and the number of slipping contacts of all processes, for a listed time. Collective. */
PetscErrorCode HycoContactStateMeasure(HycoContactState state, HycoStep *step);
/* L by row, from the normal forces and the vectors (3 n) of friction on the slaves, with the present tangents. */
void HycoContactStateForces(HycoContactState state, const PetscReal normal[], const PetscReal force[], PetscReal L[]);
/* The vectors of friction on the slaves (shear.force) from the forces L by row: the reverse. */
void HycoContactStateVectors(HycoContactState state, const PetscReal L[]);
/* The number of rows of these contacts: one each, or one for each dimension with friction. */
PetscInt HycoContactStateCountRows(HycoScene scene, const HycoPairs *pairs, PetscInt dim);

#endif
