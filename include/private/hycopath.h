/*
  HycoPath: the solution of a scene with a history, from its first time to its last. The time stepping and Newton's
  method (history.c, newton.c) are common: they run at full order on distributed vectors (path.c), and in a reduced
  model on small vectors. The ops implement what differs.
*/
#ifndef HYCOPATH_H
#define HYCOPATH_H

#include <hycocontactstate.h>
#include <hycofomimpl.h>
#include <hycoinelastic.h>

typedef struct _n_HycoSeries *HycoSeries;

/* The matrix of an iteration of a step: the consistent tangent; the elastic stiffness, whose factor is kept; a
   tangent that is kept as long as the iterations contract. */
typedef enum { HYCO_NEWTON_AUTO, HYCO_NEWTON_TANGENT, HYCO_NEWTON_ELASTIC, HYCO_NEWTON_MODIFIED } HycoNewton;
extern const char *const HycoNewtons[]; /* NULL ends */

#define HYCO_ANDERSON 5 /* depth of the acceleration */

/* An attempt at a time step. */
typedef struct {
  PetscBool converged, easy;
  char why[HYCO_LINE];              /* otherwise: the reason */
  PetscInt iterations;              /* number of contact systems solved */
  PetscInt factors;                 /* number of these with a new stiffness */
  PetscInt active_its;              /* iterations of the contact solver within them */
  PetscInt linear_its, most_linear; /* iterations of conjugate gradients: in all, most in one solve */
  PetscReal residual;               /* of equilibrium, relative to the largest of |f_int|, |F|, |B^T L| */
  PetscReal order;                  /* observed order of convergence; 0: too few iterations */
  PetscReal seconds_factor, seconds_solve, seconds_law;
  HycoFEStepReport law; /* reduced over all ranks */
} HycoStepAttempt;

typedef struct {
  PetscReal loads, supports, contact; /* work of loads, of moved supports, against contact forces */
  PetscReal stored, dissipated, thermal, moduli;
  PetscReal defect, size; /* defect of their balance, the largest of a step so far; the sum of the terms' magnitudes */
} HycoWork;

/* All are collective on the path's communicator. NULL for what a path does not do. */
typedef struct {
  /* Updates to mu (the scene's variables at the attempt's time): the borrowed objects below, F, and D; elastic: K
     too. */
  PetscErrorCode (*assemble)(HycoPath, const PetscReal mu[], PetscBool elastic);
  /* Evaluates the laws at U: the state `end`, f_int, and r = F - f_int, 0 where U is prescribed; the report over all
     ranks. */
  PetscErrorCode (*step)(HycoPath, PetscReal t0, PetscReal t1, PetscBool tangent, HycoFEStepReport *report);
  /* K from fe's tangents. */
  PetscErrorCode (*stiffness)(HycoPath);
  /* Adds the effect of supports that have moved since the last accepted time. */
  PetscErrorCode (*moves)(HycoPath, Vec rhs);
  /* Says why a contact system has no solution, for its reason, or why a converged step is not accepted; why is empty if
     it is. */
  PetscErrorCode (*judge)(HycoPath, HycoReason reason, char why[HYCO_LINE]);
  /* Replaces Newton's method on K, B and the solver: from U and Lambda at t0, with everything assembled at t1, to those
     at t1, `end` and kkt. */
  PetscErrorCode (*iterate)(HycoPath, PetscReal t0, PetscReal t1, HycoStepAttempt *);
  /* The rates of HycoFERates() in the state at t, `begin` or that of the attempt (`end`): all collective, largest over
     all ranks. NULL: steps are not chosen by their error. */
  PetscErrorCode (*rates)(HycoPath, PetscReal t, PetscReal dt, HycoFEState state, PetscReal rate[], PetscReal *largest);
  PetscErrorCode (*accept)(HycoPath, const HycoStepAttempt *);          /* the attempt becomes the state at t */
  PetscErrorCode (*surfaces)(HycoPath, PetscReal u[], PetscReal *most); /* friction: the displacements of the HycoFE
                                                                           whose rows B has, and the largest of all */
  PetscErrorCode (*record)(HycoPath); /* at a listed time, or at the last time reached: sets `now` */
  PetscErrorCode (*save)(HycoPath);   /* writes the checkpoint */
} HycoPathOps;

/* The contact system of an iteration, and what has an entry for each row of its B. */
typedef struct {
  HycoSystem system;
  HycoSolver solver;
  Mat B, Bt;
  Vec D, Lambda;
  Vec L_old, gap_work, L_last, L_new, dL[HYCO_ANDERSON]; /* of the path; NULL without contact */
} HycoPathContact;

struct _n_HycoPath {
  const HycoPathOps *ops;
  void *ctx; /* owner of the path */
  MPI_Comm comm;
  /* borrowed; matrices and system are those of the attempt's time */
  HycoScene scene;
  HycoFE fe;
  HycoPathContact contact;
  Mat K;
  Vec U, rhs;          /* the solution, with contact.Lambda, and the right-hand side of the contact system */
  PetscInt n_contacts; /* 0: no contact */
  PetscInt n_free;     /* number of unknowns */
  PetscBool cold;      /* the next contact system is solved without data from the last one */
  /* options */
  PetscInt method;            /* a HycoNewton */
  PetscInt max_its, substeps; /* substeps: 0: by the error in time */
  PetscReal rtol, bound, smallest, time_tol;
  char checkpoint[PETSC_MAX_PATH_LEN];
  PetscBool resume;
  char fclib[PETSC_MAX_PATH_LEN]; /* friction: a file for the problem of the step to this time; fclib_timed: given */
  PetscReal fclib_time;
  PetscBool fclib_timed;
  /* prescribed times of the steps; NULL: chosen by the path. Borrowed */
  PetscInt n_given;
  const PetscReal *given;
  /* times at which steps end as well, which the path may shorten; unless it has steps of its own (-hyco_substeps, or
     -hyco_step_error 0). Borrowed */
  PetscInt n_stops;
  const PetscReal *stops;
  PetscInt most_cuts, n_cuts; /* limit on the steps of the path that may be halved before it ends; 0: none; and their
                                 number */
  /* state of the laws at the last accepted time, and of the attempt */
  HycoFEState begin, end;
  /* like U: loads only, of the attempt; internal forces, the same */
  Vec F, f_int, r, U_old, work, diagonal;
  PetscReal *f_local, *u0; /* length: fe's n_dof */
  PetscBool tangent;       /* K is a tangent, not the elastic stiffness */
  PetscInt kept;           /* number of contact systems solved with this K */
  PetscBool flows;         /* some body's law is inelastic */
  /* Friction (path_friction.c): the state of the contacts of the system with tangents, which the path owns. Where there
     is another system without tangents, the path takes it while no coefficient is above 0 */
  HycoContactState friction; /* NULL: the scene has none */
  HycoPairs *pairs;          /* HycoPathSetContacts() */
  PetscBool has_friction;    /* `contact` has tangents: its forces have no potential */
  HycoPathContact other;     /* the one not used now; its data are the path's. Else empty */
  char loose[HYCO_LINE];     /* the first motion that no contact force held; "": none */
  PetscReal loose_at[2];     /* the first and the last time of one */
  char
      no_equilibrium[HYCO_LINE]; /* how a body slides away in a larger step, which halving cannot mend; "": none does */
  /* Anderson's acceleration: differences of iterates and residuals, newest last */
  PetscInt n_mixed;
  Vec dU[HYCO_ANDERSON], dG[HYCO_ANDERSON], U_last, G_last, G;
  /* current position on the path */
  PetscReal mu[HYCO_MAX_PARAMETERS], t, dt;
  PetscReal *rate[2];     /* by point: at t, and of the attempt; NULL: ops->rates is */
  PetscBool rates, rated; /* steps have an estimate of their error in time; rate[0] is known */
  PetscReal rated_by;     /* the length of the step that gave rate[0] */
  PetscReal time_error, largest,
      ahead;        /* sum of the steps' estimates; inelastic strain at t, and of any attempt since the
                                           last listed time */
  PetscInt step;    /* number of listed times reached: the index of the next one */
  HycoKKT kkt;      /* of the last accepted time */
  HycoStep now;     /* since the last listed time */
  PetscInt n_bound; /* number of accepted steps that only -hyco_step_inelastic kept from growing, without those before a
                  resumption */
  PetscInt n_steps;
  HycoStep *steps;
  PetscReal *orders; /* observed orders of the attempts that have one */
  PetscInt n_orders, room_orders;
  PetscReal *taken; /* times of the accepted steps, the first among them */
  PetscInt n_taken, room_taken;
  PetscBool ended; /* the last path reached its end */
  char why[HYCO_LINE];
  /* data of the full order */
  HycoWork work_done;
  Vec F_old, f_old;  /* of the last accepted time */
  HycoSeries series; /* NULL: none is requested */
  HycoStepMonitor monitor;
  PetscErrorCode (*between)(HycoFOM, void *ctx); /* NULL, or called at accepted steps that do not end at a listed
                                                    time */
  void *monitor_ctx;                             /* context of both */
  /* of elastic bodies: stresses and reactions are those of the displacements at hand, beside the path */
  PetscBool beside;
  PetscErrorCode (*passes)(HycoPath, PetscReal t0, void *ctx); /* NULL, or called after each accepted step, from t0 */
  void *passes_ctx;
  PetscErrorCode (*interrupt)(void *ctx); /* NULL, or called at each iteration; its error ends the path */
  void *interrupt_ctx;
};

/* Creates a path with the default options. The caller owns it. */
PetscErrorCode HycoPathNew(MPI_Comm comm, HycoScene scene, HycoPath *path);
/* Creates the vectors like U and Lambda (NULL: no contact), once U, Lambda and fe are set. */
PetscErrorCode HycoPathSetUp(HycoPath path);
/* NULL-safe. */
PetscErrorCode HycoPathFree(HycoPath *path);
/* Declares and reads -hyco_newton and the other options of paths. */
PetscErrorCode HycoPathSetFromOptions(HycoPath path, HycoOptionItems PetscOptionsObject);
/* Sets the initial state at the first time. Collective. */
PetscErrorCode HycoPathBegin(HycoPath path, const PetscReal mu[]);
/* Continues to the end of the path, or as far as possible: path->ended. Collective. */
PetscErrorCode HycoPathRun(HycoPath path);
/* One attempt, from the accepted state at t0 to t1: U, Lambda and the state `end`. Collective. */
PetscErrorCode HycoPathAttempt(HycoPath path, PetscReal t0, PetscReal t1, HycoStepAttempt *attempt);
/* Solves the contact system of the accepted step with K as it stands; U and Lambda stay, which are its solution.
   Collective. */
PetscErrorCode HycoPathSolveAgain(HycoPath path, PetscBool *solved);
/* Restores U and Lambda of the last accepted time. */
PetscErrorCode HycoPathRestore(HycoPath path);
/* Updates everything except the solution to t. Collective. */
PetscErrorCode HycoPathAssemble(HycoPath path, PetscReal t);
/* In ops->moves: the effect of supports that have moved away from u (fe's n_dof) is added to the loads of `work`, as
   in HycoFEAssembleForce(); *moved: there is some. Collective. */
PetscErrorCode HycoPathMoves(HycoPath path, const PetscScalar u[], Vec work, PetscBool *moved);
/* Estimated cost of a factor with its flexibility, in solves: measured in 3D, 24 at 29,000 unknowns and 50 at
   118,000, proportional to the square root of their number; in 2D a fifth of that. */
PetscReal HycoPathFactorCost(HycoPath path);
/* The method used for steps; not HYCO_NEWTON_AUTO. */
HycoNewton HycoPathMethod(HycoPath path);
/* Whether the value a of a quantity is beyond b, as an extreme over the times. */
PetscBool HycoPathIsBeyond(const HycoQuantity *quantity, PetscReal a, PetscReal b);
/* value[n_quantities]: the largest of each quantity over n >= 1 listed times; for `min` the smallest. */
void HycoPathExtremes(HycoScene scene, PetscInt n, const HycoStep step[], PetscReal value[]);
/* "body NAME from moving along ..." with the first and the last time at which it is so. */
void HycoPathNameTimes(const char name[], const PetscReal at[2], char text[HYCO_LINE]);
/* Fills the history with the path's results. */
void HycoPathGetHistory(HycoPath path, HycoHistory *history);

/* -- friction (path_friction.c), where the path has a state of its contacts. Collective -- */

/* Once the path has its solver: the contacts of its system (borrowed). If the scene has friction the path has it: their
   state, and the method for cones (the user's options after it). rows: of its B, of this process; may be NULL. */
PetscErrorCode HycoPathSetContacts(HycoPath path, HycoPairs *pairs, PetscInt *rows);
/* In ops->assemble: the rows of B and the gaps at fe's parameters, with tangents if the path has friction. Local. */
PetscErrorCode HycoPathRows(HycoPath path, HycoFE fe, HycoRows *rows);
/* The path's vectors of a contact system, whose Lambda is set. */
PetscErrorCode HycoPathContactSetUp(HycoPathContact *contact);
PetscErrorCode HycoPathContactReset(HycoPathContact *contact);
/* The system with tangents, or without: used now or not. */
HycoPathContact *HycoPathContactGet(HycoPath path, PetscBool tangents);
/* Called by the path: at its start, no slip; once a step is assembled, its cones; */
PetscErrorCode HycoPathFrictionBegin(HycoPath path);
PetscErrorCode HycoPathFrictionSetStep(HycoPath path, PetscReal t);
/* once it is accepted, before ops->accept: its forces on both systems; bodies stay along motions that no contact force
   acts on; */
PetscErrorCode HycoPathFrictionTake(HycoPath path);
/* after it: the step becomes the state of the contacts. */
PetscErrorCode HycoPathFrictionAccept(HycoPath path);
PetscErrorCode HycoPathFrictionDestroy(HycoPath path);
/* Whether a coefficient of 0 at a contact with a force lets a floating body of the accepted step move. */
PetscErrorCode HycoPathFrictionMoves(HycoPath path, PetscBool *moves);
/* In ops->accept: the work of the bodies against the contact forces in the step. */
PetscErrorCode HycoPathFrictionWork(HycoPath path, PetscReal *work);
/* -- full order: a HycoPath whose ctx is the HycoFOM -- */

PetscErrorCode HycoFOMPathCreate(HycoFOM fom);
/* Friction at full order (friction.c): the system with tangents, and what it adds to that of a step. */
PetscErrorCode HycoFrictionCreate(HycoFOM fom);
PetscErrorCode HycoFrictionAssemble(HycoFOM fom);
/* Its state in a checkpoint. `load` after the path is assembled at the checkpoint's time. */
PetscErrorCode HycoFrictionSave(HycoFOM fom, HycoH5 h5);
PetscErrorCode HycoFrictionLoad(HycoFOM fom);
/* Fails if an option of paths is given and the scene has no history. */
PetscErrorCode HycoPathRefuseOptions(HycoFOM fom);
/* The gradient of the last path, which is solved again: by its steps, else by the paths beside it. Collective. */
PetscErrorCode HycoPathGradient(HycoFOM fom, HycoGradient *gradient);
/* Solves the history at mu; if it does not reach its end, the summary's reason says so. Collective. */
PetscErrorCode HycoPathSolve(HycoFOM fom, const PetscReal mu[]);
/* Fails if the checkpoint or a file for FCLIB would overwrite a model, or the latter is for no step. Collective. */
PetscErrorCode HycoPathCheckPlace(HycoFOM fom);
/* Writes the checkpoint, if one is requested; resumes from it, if it exists. Collective. */
PetscErrorCode HycoPathSave(HycoFOM fom);
PetscErrorCode HycoPathLoad(HycoFOM fom);
/* The series of fields, if one is requested: created, the last time added, written. Collective. */
PetscErrorCode HycoSeriesBegin(HycoFOM fom);
PetscErrorCode HycoSeriesAdd(HycoFOM fom);
/* Restores the times before a checkpoint from the files beside it. */
PetscErrorCode HycoSeriesRestore(HycoFOM fom);
PetscErrorCode HycoSeriesEnd(HycoFOM fom);
PetscErrorCode HycoSeriesDestroy(HycoSeries *series);
/* The fields of a series at one time, for full order and reduced models: a HycoFE of each rank with the state of its
   cells, u on it, and the surface of the rank's contacts with displacements and forces. Borrowed. */
typedef struct {
  MPI_Comm comm;
  HycoFE fe;
  HycoFEState state;
  HycoFE fe_surface;
  HycoPairs *pairs;
  PetscInt n_nodes, n_cells, n_contacts; /* of the whole mesh */
  const HycoFileOrder *rows;             /* NULL on one rank */
  const PetscReal *u, *u_surface, *lambda, *mu;
  PetscReal t;
} HycoSeriesSource;
/* A HycoFieldFile of at most `most` times: created, the mesh written; a time added; renamed to its path. Collective. */
PetscErrorCode HycoSeriesCreate(MPI_Comm comm, const char path[], PetscInt most, HycoSeries *series);
PetscErrorCode HycoSeriesOpen(HycoSeries series, const HycoSeriesSource *from);
PetscErrorCode HycoSeriesAddTime(HycoSeries series, const HycoSeriesSource *from);
PetscErrorCode HycoSeriesClose(HycoSeries series);

#endif
