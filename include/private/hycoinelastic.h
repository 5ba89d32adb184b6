/*
  Bodies with memory: what the finite elements do with laws that depend on the past. The state of every integration
  point at one instant, and a step of time from one state to the next for a given displacement (implicit Euler).

      HycoFESetParameters(fe, mu at t1);
      HycoFEStep(fe, u, t0, t1, begin, end, f_int, PETSC_TRUE, &report);      r = f_int - F + B^T L
      HycoFEAssembleStiffness(fe, K);                                         K = d f_int / d u
      ... accepted: HycoFEStateCopy(end, begin)
*/
#ifndef HYCOINELASTIC_H
#define HYCOINELASTIC_H

#include <hycofe.h>

typedef struct _n_HycoFEState *HycoFEState;

/* The virgin state of fe's cells: no strain, no stress, no inelastic strain, at the temperature that the first step
   begins with. The caller owns it. Not collective. */
PetscErrorCode HycoFEStateCreate(HycoFE fe, HycoFEState *state);
/* NULL-safe. */
PetscErrorCode HycoFEStateDestroy(HycoFEState *state);
/* Both made from one fe. */
PetscErrorCode HycoFEStateCopy(HycoFEState from, HycoFEState to);

/*
  All of the state as reals: those of cell e from values[start[e]] to values[start[e + 1]] (start: n_cells + 1), in the
  order of fe's mesh (cell_id has the tags); the integration points of a cell one after the other. What is written back
  into `values` is the state. How many reals a cell has depends on its body's law alone. Borrowed.
*/
PetscErrorCode HycoFEStateGet(HycoFEState state, const PetscInt **start, PetscReal **values);

/* Names of the laws' state variables, one of each, over all bodies. Borrowed. */
PetscErrorCode HycoFEStateGetNames(HycoFEState state, PetscInt *n, const char *const *names[]);

/*
  Averages over the cells (weights: volume) for outputs; any output may be NULL.
    sigma       n_cells x n_sigma
    mises       n_cells, the mean of the points' von Mises stress (1D: the stress's absolute value)
    inelastic   n_cells, accumulated equivalent inelastic strain, creep and plastic together
    temperature n_cells; 0 in a body that has none
  HycoFEStateVariable(): the state variable `name`; 0 in a body whose law has none of this name.
*/
PetscErrorCode HycoFEStateFields(HycoFE fe, HycoFEState state, PetscReal sigma[], PetscReal mises[],
                                 PetscReal inelastic[], PetscReal temperature[]);
PetscErrorCode HycoFEStateVariable(HycoFE fe, HycoFEState state, const char name[], PetscReal value[]);

/*
  What a step says of itself, of this rank's cells. To be reduced over the ranks by the caller: the least dt_factor, the
  largest increment, any failed; energies are summed over the cells whose first node is this rank's
  own, so that their sum over the ranks counts each cell once.

  With s_m = (s0 + s1) / 2 at each point, work = integral of s_m : (eps1 - eps0), and as an identity

      work = (stored at the end) - (stored at the begin) + dissipated + thermal + moduli

  without springs, whose energy `stored` and `potential` have, and whose forces are in f_int.
*/
typedef struct {
  PetscReal dt_factor;  /* what the laws would multiply the step by: 1, or less */
  PetscBool failed;     /* a law has no answer at a point; `end`, f_int and K are then of no use: cut the step */
  char why[HYCO_LINE];  /* "body clad, law j2: ... at x = ..., y = ..., z = ..." */
  PetscReal increment;  /* largest equivalent inelastic strain of the step */
  PetscReal work;       /* of the stresses */
  PetscReal stored;     /* at the end: elastic energy */
  PetscReal dissipated; /* s_m : inelastic strain of the step */
  PetscReal thermal;    /* s_m : thermal strain of the step */
  PetscReal moduli;     /* elastic energy that comes and goes with moduli that change in time, with its sign turned */
  PetscBool has_potential; /* whether every law is the gradient of one */
  PetscReal potential;     /* incremental: its gradient by u is f_int; valid with has_potential */
} HycoFEStepReport;

/*
  A step from `begin` at t0 to `end` at t1 (>= t0; with t1 = t0 the laws answer at once, without creep) for the
  displacement u at t1 (n_dof, local order, prescribed values in their places). fe is at the parameters of t1.

  f_int (n_dof, local order) gets the integral of B^T sigma added, thermal strains included, at every unknown, fixed
  ones too (reactions); what tied nodes have of it passes to those that they follow. This rank has all cells of its own
  nodes: the rows of owned nodes are complete without communication, those of others are to be ignored, as with K.

  tangent: fe's tangents become the consistent ones, d sigma / d eps of the step, of the bodies that flow; the next
  HycoFEAssembleStiffness() gives d f_int / d u (symmetric: a law's tangent that is not is replaced by its symmetric
  part). HycoFEElasticTangent() puts the elastic ones back, and HycoFESetParameters() does where it changes them.

  `begin` stays; begin and end differ. A point where a law has no answer is no error: report->failed. Errors: constants
  that leave their interval, a temperature below 0 K. Not collective.
*/
PetscErrorCode HycoFEStep(HycoFE fe, const PetscReal u[], PetscReal t0, PetscReal t1, HycoFEState begin,
                          HycoFEState end, PetscReal f_int[], PetscBool tangent, HycoFEStepReport *report);
PetscErrorCode HycoFEElasticTangent(HycoFE fe);

/*
  Steps on displacements that are known: HycoMarchBegin() from the virgin state, fe (borrowed) at the parameters of the
  first time; HycoMarchStep() with fe at those of t1, after which `state` is that of t1 and f_int (n_dof) its internal
  forces, whatever the report says. HycoMarchEnd() also after a failure. Not collective.
*/
typedef struct {
  HycoFE fe;
  HycoFEState state, end;
  PetscReal *f_int;
} HycoMarch;
PetscErrorCode HycoMarchBegin(HycoFE fe, HycoMarch *march);
PetscErrorCode HycoMarchStep(HycoMarch *march, const PetscReal u[], PetscReal t0, PetscReal t1,
                             HycoFEStepReport *report);
PetscErrorCode HycoMarchEnd(HycoMarch *march);

/* The internal forces of one cell from the state's stresses, the integral of B^T sigma (f: nv x dim, overwritten). */
PetscErrorCode HycoFEStateForce(HycoFE fe, HycoFEState state, PetscInt cell, PetscReal f[]);

/*
  The same of some bodies alone: those of laws that flow, or those of linear laws, whose stress and energy do not depend
  on the past. Of the other cells nothing is read or written, and the report leaves them out. Springs, whatever they
  hold, go with the bodies that flow.
*/
typedef enum { HYCO_BODIES_ALL, HYCO_BODIES_FLOWING, HYCO_BODIES_LINEAR } HycoBodies;
PetscErrorCode HycoFEStepBodies(HycoFE fe, HycoBodies bodies, const PetscReal u[], PetscReal t0, PetscReal t1,
                                HycoFEState begin, HycoFEState end, PetscReal f_int[], PetscBool tangent,
                                HycoFEStepReport *report);

/*
  What the linear bodies give to f_int at some nodes, K u less what the thermal strains push, for who comes to one time
  again and again: a product in place of their points. `nodes` (n_nodes; NULL: all): those whose rows are wanted.
  HycoLinearForceSet(): at fe's parameters; K: the linear bodies' tangents or the nodes' places may have changed.
  HycoLinearForceAdd(): added to f_int (n_dof). Not collective; destroying is NULL-safe.
*/
typedef struct _n_HycoLinearForce *HycoLinearForce;
PetscErrorCode HycoLinearForceCreate(HycoFE fe, const PetscBool nodes[], HycoLinearForce *force);
PetscErrorCode HycoLinearForceDestroy(HycoLinearForce *force);
PetscErrorCode HycoLinearForceSet(HycoLinearForce force, PetscBool K);
void HycoLinearForceAdd(HycoLinearForce force, const PetscReal u[], PetscReal f_int[]);

#endif
