/*
  Bodies with a history: the finite-element side of laws that depend on the past. The state of every integration point
  at one time, and a time step from one state to the next for a given displacement (implicit Euler).

    HycoFESetParameters(fe, mu at t1);
    HycoFEStep(fe, u, t0, t1, begin, end, f_int, PETSC_TRUE, &report);      r = f_int - F + B^T L
    HycoFEAssembleStiffness(fe, K);                                         K = d f_int / d u
    ... accepted: HycoFEStateCopy(end, begin)
*/
#ifndef HYCOINELASTIC_H
#define HYCOINELASTIC_H

#include <hycofe.h>

typedef struct _n_HycoFEState *HycoFEState;

/* The initial state of fe's cells: no strain, no stress, no inelastic strain, at the temperature at which the first
   step begins. The caller owns it. Not collective. */
PetscErrorCode HycoFEStateCreate(HycoFE fe, HycoFEState *state);
/* NULL-safe. */
PetscErrorCode HycoFEStateDestroy(HycoFEState *state);
/* Both must be created from the same fe. */
PetscErrorCode HycoFEStateCopy(HycoFEState from, HycoFEState to);

/*
  The whole state as reals: those of cell e are values[start[e]] to values[start[e + 1]] (start: n_cells + 1), in the
  order of fe's mesh (cell_id has the tags); the integration points of a cell one after the other. Writing to `values`
  changes the state. The number of reals of a cell depends only on its body's law. Borrowed.
*/
PetscErrorCode HycoFEStateGet(HycoFEState state, const PetscInt **start, PetscReal **values);

/* The names of the laws' state variables over all bodies, without repetition. Borrowed. */
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
  Result of a step over this rank's cells. The caller reduces it over the ranks: the least dt_factor, the largest
  increment, any failed; energies are summed over the cells whose first node this rank owns, so that their sum over the
  ranks counts each cell once.

  With s_m = (s0 + s1) / 2 at each point, work = integral of s_m : (eps1 - eps0), and as an identity

    work = (stored at the end) - (stored at the begin) + dissipated + thermal + moduli

  for the bodies without springs. The energy of springs is in `stored` and `potential`, their forces in f_int.
*/
typedef struct {
  PetscReal dt_factor;     /* factor by which the laws would change the step: 1, or less */
  PetscBool failed;        /* a law has no solution at a point; `end`, f_int and K are then invalid: reduce the step */
  char why[HYCO_LINE];     /* "body clad, law j2: ... at x = ..., y = ..., z = ..." */
  PetscReal increment;     /* largest equivalent inelastic strain of the step */
  PetscReal work;          /* of the stresses */
  PetscReal stored;        /* at the end: elastic energy */
  PetscReal dissipated;    /* s_m : inelastic strain of the step */
  PetscReal thermal;       /* s_m : thermal strain of the step */
  PetscReal moduli;        /* elastic energy due to moduli that change in time, with the sign reversed */
  PetscBool has_potential; /* whether every law has an incremental potential */
  PetscReal potential;     /* the incremental potential: its gradient by u is f_int; valid with has_potential */
} HycoFEStepReport;

/*
  A step from `begin` at t0 to `end` at t1 (>= t0; with t1 = t0 the response is instantaneous, without creep) for the
  displacement u at t1 (n_dof, local order, prescribed values included). fe is at the parameters of t1.

  The integral of B^T sigma, with the stress of thermal strains, is added to f_int (n_dof, local order) at every
  unknown, fixed ones too (reactions); the forces of tied nodes are added to their masters. This rank has all cells of
  the nodes that it owns: the rows of owned nodes are complete without communication, the others must be ignored, as
  with K.

  tangent: sets fe's tangents to the consistent ones, d sigma / d eps of the step, for the bodies with inelastic laws;
  the next HycoFEAssembleStiffness() gives d f_int / d u (symmetric: a tangent that is not is replaced by its symmetric
  part). HycoFEElasticTangent() restores the elastic ones, and so does HycoFESetParameters() where it changes them.

  `begin` is not changed; begin and end must differ. A point where a law has no solution is not an error:
  report->failed. Errors: constants outside their interval, a temperature below 0 K. Not collective.
*/
PetscErrorCode HycoFEStep(HycoFE fe, const PetscReal u[], PetscReal t0, PetscReal t1, HycoFEState begin,
                          HycoFEState end, PetscReal f_int[], PetscBool tangent, HycoFEStepReport *report);
PetscErrorCode HycoFEElasticTangent(HycoFE fe);
/* Whether a law of fe's cells deforms inelastically at once, as in yielding, under large strains. fe is at the
   parameters of t. Not collective. */
PetscErrorCode HycoFEYields(HycoFE fe, PetscReal t, PetscBool *yields);
/* rate[n_cells x points of a cell x n_sigma]: of the inelastic strain in the state at t, of displacements u, by a step
   of length dt without strain: of creep, and of no other flow; along the stress's deviator, with the norm of the
   equivalent strain. Linear cells are not written. *largest: equivalent
   inelastic strain of a point. fe is at the parameters of t. The state is not changed. Not collective. */
PetscErrorCode HycoFERates(HycoFE fe, const PetscReal u[], PetscReal t, PetscReal dt, HycoFEState state,
                           PetscReal rate[], PetscReal *largest);

/*
  Steps on known displacements: HycoTimeLoopBegin() from the initial state, with fe (borrowed) at the parameters of the
  first time; HycoTimeLoopStep() with fe at those of t1, after which `state` is that of t1 and f_int (n_dof) its
  internal forces, even if the report says that it failed. HycoTimeLoopEnd() also after a failure. Not collective.
*/
typedef struct {
  HycoFE fe;
  HycoFEState state, end;
  PetscReal *f_int;
} HycoTimeLoop;
PetscErrorCode HycoTimeLoopBegin(HycoFE fe, HycoTimeLoop *march);
PetscErrorCode HycoTimeLoopStep(HycoTimeLoop *march, const PetscReal u[], PetscReal t0, PetscReal t1,
                                HycoFEStepReport *report);
PetscErrorCode HycoTimeLoopEnd(HycoTimeLoop *march);

/* The internal forces of one cell from the state's stresses, the integral of B^T sigma (f: nv x dim, overwritten). */
PetscErrorCode HycoFEStateForce(HycoFE fe, HycoFEState state, PetscInt cell, PetscReal f[]);

/* The same for the bodies with inelastic laws only, with the springs. The other cells are neither read nor written, and
   are not in the report. */
typedef enum { HYCO_BODIES_ALL, HYCO_BODIES_FLOWING } HycoBodies;
PetscErrorCode HycoFEStepBodies(HycoFE fe, HycoBodies bodies, const PetscReal u[], PetscReal t0, PetscReal t1,
                                HycoFEState begin, HycoFEState end, PetscReal f_int[], PetscBool tangent,
                                HycoFEStepReport *report);
/* Stresses and energies of the cells with linear laws at u, which do not depend on the past, in the state; stored:
   their energy, without springs. For a mesh that one process has. */
PetscErrorCode HycoFELinearStress(HycoFE fe, const PetscReal u[], HycoFEState state, PetscReal *stored);
/* The stored energy, and the volume means of stress (n_cells x n_sigma) and von Mises stress (n_cells) at u, without a
   state; *served: false, and nothing is computed, unless all bodies are linear, isotropic and without an axis. */
PetscErrorCode HycoFELinearFields(HycoFE fe, const PetscReal u[], PetscReal sigma[], PetscReal mises[],
                                  PetscReal *stored, PetscBool *served);

/*
  Laws at some integration points, each the number of its cell times the points of a cell plus its own; all in bodies
  with inelastic laws, whose tangents in fe are the elastic ones. HycoFEPointRows(): B (n_sigma x (nv dim)), so that B
  u_e is the strain of a point, and its weight. HycoFEInelasticStress(): s = C (eps - thermal eps) - sigma in a state.
  HycoFEStepPoints(): s of n points (n x n_sigma) in the step from `begin` to strains at t1 (n x n_sigma, with thermal
  strains), the size of the terms of each (n), and its derivative C - C_t (n x n_sigma x n_sigma; NULL: not wanted); no
  state is written. A failure is reported as by HycoFEStep(). Not collective.
*/
PetscErrorCode HycoFEPointRows(HycoFE fe, PetscInt cell, PetscInt q, PetscReal B[], PetscReal *weight);
void HycoFEInelasticStress(HycoFE fe, HycoFEState state, PetscInt cell, PetscInt q, PetscReal s[]);
PetscErrorCode HycoFEStepPoints(HycoFE fe, PetscInt n, const PetscInt point[], const PetscReal strain[], PetscReal t0,
                                PetscReal t1, HycoFEState begin, PetscReal s[], PetscReal size[], PetscReal tangent[],
                                HycoFEStepReport *report);

/*
  Laws at some points (of bodies whose laws have `slopes`) along known displacements, with the derivatives of their
  states by n_slopes parameters. HycoFEPointsBegin(): the initial state. HycoFEPointsStep(): from the accepted state to
  u (n_dof) at t1, at fe's parameters; s and C - C_t as HycoFEStepPoints() (NULL: not wanted). HycoFEPointsPerturbed():
  keeps the data at fe's present parameters, and the strains of u there (NULL: those of the step), as those of point 1
  to 4 of a difference; changes false: all is as in the step. HycoFEPointsDerivatives(): the state's derivative by
  parameter k, du with displacements (n_dof); ds, dstress: n x n_sigma, or NULL; *smooth: false: a point leaves its
  yield surface. HycoFEPointsAccept(): the step's state becomes the accepted one. Stress and weights of the step are
  borrowed. Not collective.
*/
typedef struct _n_HycoFEPoints *HycoFEPoints;
PetscErrorCode HycoFEPointsCreate(HycoFE fe, PetscInt n, const PetscInt point[], PetscInt n_slopes,
                                  HycoFEPoints *points);
PetscErrorCode HycoFEPointsDestroy(HycoFEPoints *points);
PetscErrorCode HycoFEPointsBegin(HycoFEPoints points);
PetscErrorCode HycoFEPointsStep(HycoFEPoints points, const PetscReal u[], PetscReal t0, PetscReal t1, PetscReal s[],
                                PetscReal lost[]);
/* Whether parameters change the laws' data; *strains: also the strains of the same free displacements. */
PetscBool HycoFEPointsChange(HycoFEPoints points, const PetscBool changed[], PetscBool *strains);
PetscErrorCode HycoFEPointsPerturbed(HycoFEPoints points, PetscInt id, PetscBool changes, const PetscReal u[]);
PetscErrorCode HycoFEPointsDerivatives(HycoFEPoints points, PetscInt k, const PetscReal weight[3], const PetscInt id[3],
                                       const PetscReal du[], PetscReal ds[], PetscReal dstress[], PetscBool *smooth);
PetscErrorCode HycoFEPointsAccept(HycoFEPoints points);
const PetscReal *HycoFEPointsStress(HycoFEPoints points);
const PetscReal *HycoFEPointsWeights(HycoFEPoints points);
/* The derivative of the weights (n). */
void HycoFEPointsWeightDerivatives(HycoFEPoints points, const PetscReal weight[3], const PetscInt id[3],
                                   PetscReal slope[]);

/*
  The linear bodies' contribution to f_int at some nodes, K u minus the force of thermal strains, for repeated
  evaluations at one time: a matrix product in place of their integration points. `nodes` (n_nodes; NULL: all): the
  nodes whose rows are wanted. HycoLinearForceSet(): at fe's parameters; K: the linear bodies' tangents or the nodes'
  places may have changed. HycoLinearForceAdd(): adds to f_int (n_dof). Not collective; destroying is NULL-safe.
*/
typedef struct _n_HycoLinearForce *HycoLinearForce;
PetscErrorCode HycoLinearForceCreate(HycoFE fe, const PetscBool nodes[], HycoLinearForce *force);
PetscErrorCode HycoLinearForceDestroy(HycoLinearForce *force);
PetscErrorCode HycoLinearForceSet(HycoLinearForce force, PetscBool K);
void HycoLinearForceAdd(HycoLinearForce force, const PetscReal u[], PetscReal f_int[]);

#endif
