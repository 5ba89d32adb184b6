/* HycoFOM: the full-order model of a scene, (16): assembled and solved for one parameter value after another. */
#ifndef HYCOFOM_H
#define HYCOFOM_H

#include <hycocontact.h>
#include <hycosolver.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoFOM *HycoFOM;

/* Seconds of the last solve, by stage. */
typedef struct {
  PetscReal setup, assemble, factor, solve, total;
  PetscReal cpu; /* processor time of all of it on all ranks that solve, with the outputs and estimates */
} HycoSeconds;

/*
  Summary of a solution, in scene units. Strain energy W = 1/2 U^T K U over free and fixed unknowns; external work
  F.U of the loads and R.u0 of the moving supports; gap work L.D with the initial gaps. Energy defect:
  |2 W - (external_work - gap_work)| / max(2 W, |external_work|, |gap_work|), 0 for a solution without round-off.
*/
typedef struct {
  PetscInt n_dof, n_contacts, n_active; /* free unknowns N, contacts N_lambda, contacts with L_i > 0 */
  PetscInt n_still;                     /* contacts between fixed unknowns, which have no effect */
  PetscInt n_dependent; /* closed contacts whose rows depend on those of others; if > 0, Lambda is not unique (U is); of
                           a path the most at a listed time */
  PetscInt iterations, dim;
  PetscReal total_contact_force, lambda_max, lambda_norm2, u_norm2, u_min[3], u_max[3];
  PetscReal u_relative; /* the largest displacement, over the extent of the mesh or the largest prescribed one */
  PetscReal quantity[HYCO_MAX_QUANTITIES]; /* those of HycoSceneGetQuantities() */
  PetscInt n_facing;          /* contacts that may close: on moved surfaces the slave nodes that face a master */
  PetscReal overlap, sliding; /* largest initial overlap (length); largest motion of a closed contact along its
                                 surface, over the size of a facet: above 1 displacements are not small */
  PetscReal strain_energy, external_work, gap_work, energy_defect;
  HycoKKT kkt;
  HycoReason reason;
  HycoSeconds seconds;
  char loose[512];       /* a motion of a body that contact alone may hold, where no contact has a force: its position
                            is arbitrary; "": none */
  char regularised[512]; /* unconstrained motions that -hyco_regularise removed, separated by "; " */
  char buried[512];      /* contacts whose given gap overlaps at every node by more than 1 % of the extent of a body, as
                            with the wrong sign: "fit (by 2 %), ..."; "": none */
  char why[512];         /* not converged: the reason in words, with the body or the number that shows it; else "" */
} HycoSummary;

/* Forces on the bodies: of the supports of a group, of the springs of a group, of all loads, of all contacts (between
   bodies their sum is zero). */
typedef enum {
  HYCO_REACTION_SUPPORT,
  HYCO_REACTION_SPRING,
  HYCO_REACTION_LOADS,
  HYCO_REACTION_CONTACT
} HycoReactionKind;
typedef struct {
  HycoReactionKind kind;
  const char *group;   /* of supports and springs; an unknown that two groups fix counts for the first. Borrowed */
  PetscReal force[3];  /* on the bodies; in an axisymmetric scene without the radial component */
  PetscReal moment[3]; /* about the origin, at the moved nodes; 2D: only the last component; axisymmetric: 0 */
} HycoReaction;

/* A listed time of a history, and the cost of reaching it from the previous one. Energies are since the first time. */
typedef struct {
  PetscInt index; /* among the listed times */
  PetscReal t;
  PetscInt substeps, cuts;                                              /* time steps; attempts that were halved */
  PetscInt iterations, most_iterations, factors, active_set_iterations; /* contact systems, most in a substep; with a
                                                                           new stiffness; iterations inside them */
  PetscInt linear_iterations, most_linear_iterations; /* of conjugate gradients, most in one solve; 0: factors solve */
  PetscInt n_active;                                  /* contacts with L_i > 0 */
  PetscReal total_contact_force, lambda_max, u_norm2;
  PetscReal mises, inelastic; /* largest of the cells' means: von Mises stress, accumulated inelastic strain */
  PetscReal residual, kkt;    /* largest of the substeps: of equilibrium, relative to the forces; of all four */
  PetscReal work, contact_work, stored, dissipated, thermal; /* of loads and supports; against contact; elastic energy;
                                                                dissipated; given to heat and to moduli that change */
  PetscReal energy_defect; /* largest of the substeps: of their balance, over the sum of the terms' sizes so far */
  PetscReal seconds, seconds_factor, seconds_solve, seconds_law;
  PetscReal sliding;                       /* as in HycoSummary; of a reduced model 0 */
  PetscReal friction_work;                 /* dissipated by friction since the start, a part of contact_work; >= 0 */
  PetscInt n_slipping;                     /* closed contacts with friction that slip */
  PetscInt disproven;                      /* substeps in which a determinant proves that there are further solutions */
  PetscInt n_dependent;                    /* as in HycoSummary, at this time; -1: not known */
  PetscReal quantity[HYCO_MAX_QUANTITIES]; /* those of HycoSceneGetQuantities() */
} HycoStep;

/* The path of the last solve of a scene with a history. */
typedef struct {
  PetscInt n;               /* times that were reached */
  const HycoStep *step;     /* n, borrowed until the next solve; if not ended, the last is not a listed time */
  PetscBool ended;          /* the last listed time is reached */
  PetscReal t;              /* the last accepted time */
  const char *why;          /* if not ended: the message of the last attempt. Borrowed */
  PetscBool no_equilibrium; /* if not ended: no contact forces balance the loads, and shorter steps change nothing */
  const char *newton;       /* "tangent" or "elastic" */
  PetscReal factor_cost;    /* cost of a factor, in solves, by the rule of -hyco_newton auto */
  PetscInt n_orders;        /* steps whose iterations gave an order of convergence */
  PetscReal order;          /* the median of these; 2 for the tangent */
  PetscInt n_taken;         /* number of accepted time steps, including the first time */
  const PetscReal *taken;   /* their ends. Borrowed */
  /* of each output of the scene the largest (for `min` the smallest) over the listed times that were reached */
  PetscReal path_quantity[HYCO_MAX_QUANTITIES];
  PetscInt n_bound;     /* number of steps that only -hyco_step_inelastic kept from growing; since a resumption */
  PetscReal time_error; /* sum of the steps' estimated errors of creep strains, relative to the largest inelastic
                           strain */
} HycoHistory;

/* The derivatives of the scene's outputs with respect to its parameters, in the unit of the output over that of the
   parameter. Where the derivatives to the two sides differ, `kink` is true, and the value is that towards larger
   parameter values (at the upper end of the range towards smaller ones): contacts with neither force nor gap, a change
   of master, cells that share the largest stress. Of a path, `value` is that at its last listed time. */
typedef struct {
  PetscInt n_outputs, n_parameters;
  PetscInt n_undecided;   /* contacts with neither force nor gap; 0 for a path */
  const PetscReal *value; /* n_outputs x n_parameters row major, in the orders of HycoSceneGetQuantities() and
                             HycoSceneGetParameters(). Borrowed until the next call */
  const PetscBool *kink;  /* the same shape. Borrowed */
  PetscInt n_times;       /* listed times; 0 without a history. Then, borrowed too: */
  const PetscReal *times; /* n_times x n_outputs x n_parameters: at each listed time; */
  const PetscBool *times_kink;
  const PetscReal *path; /* n_outputs x n_parameters: of the largest (for `min` the smallest) over the listed times */
  const PetscBool *path_kink;
} HycoGradient;

/* Called at each listed time, on every rank; HycoFOMGetSolution() then gives the solution there. */
typedef PetscErrorCode (*HycoStepMonitor)(HycoFOM fom, const HycoStep *step, void *ctx);

/* Reads and distributes the scene's mesh over `comm` (which may be smaller than the scene's communicator). Collective
   on `comm`. The model holds a reference to the scene. The caller owns the model. */
PetscErrorCode HycoFOMCreate(MPI_Comm comm, HycoScene scene, HycoFOM *fom);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoFOMDestroy(HycoFOM *fom);
/* Gets the solver, for configuration. Borrowed. */
PetscErrorCode HycoFOMGetSolver(HycoFOM fom, HycoSolver *solver);

/* Assembles what depends on the changed parameters, and solves (16) at mu (length n). Collective. Fails, on every rank,
   outside the ranges and if the ranks give different points. A solve that does not converge is not an error: see
   HycoSummary.reason. A scene with a history is solved from its first time to its last (docs/history.md). The results
   are then those of the last time that was reached; if this is not the last listed time, the reason is
   HYCO_DIVERGED_STEP. After refused values the last solution stays. */
PetscErrorCode HycoFOMSolve(HycoFOM fom, PetscInt n, const PetscReal mu[]);
/*
  Solves K U = F - B^T Lambda at mu (length n) with given contact forces Lambda (n_contacts, read on rank 0, in the
  order of HycoFOMGetSolution()), for example those predicted by a model of bodies. It needs one factor of K, which is
  kept while K does not change. Rigid motions that contact alone prevents are those that close the contacts with a
  force. The results are available as after HycoFOMSolve(), with Lambda as given. The summary's residuals are those of
  (16): penetration and complementarity show the errors of Lambda. Its reason is that of the linear solve. Collective.
*/
PetscErrorCode HycoFOMSolveForces(HycoFOM fom, PetscInt n, const PetscReal mu[], const PetscReal Lambda[]);
/* Gets the path of the last solve; n is 0 for a scene without a history. Not collective. */
PetscErrorCode HycoFOMGetHistory(HycoFOM fom, HycoHistory *history);
/* For a scene with a history: sets a function that is called at each listed time. Not collective. */
PetscErrorCode HycoFOMSetStepMonitor(HycoFOM fom, HycoStepMonitor monitor, void *ctx);
/* Gets the system of the last solve (K with the fixed unknowns decoupled, F with their lifting). Borrowed. */
PetscErrorCode HycoFOMGetSystem(HycoFOM fom, HycoSystem *system);
/* Gets the summary of the last solution. Collective. */
PetscErrorCode HycoFOMGetSummary(HycoFOM fom, HycoSummary *summary);

/*
  Gets the gradient at the last solution, by the linear system of its closed contacts with the factor of K: for each
  parameter one forward and one back substitution, and differences of element sums, contact rows and outputs, never of
  solutions. With a history: by differences of two paths for each parameter in the steps of this one, with a smaller
  tolerance of Newton's method. The solution stays. Collective; the same values on every rank. Fails without an output
  or a parameter, where a solve did not converge or a path did not end, for a solver without a factor (-hyco_linear),
  with -hyco_regularise, and where the forces of closed contacts are not unique; after an error there is no last
  solution.
*/
PetscErrorCode HycoFOMGetGradient(HycoFOM fom, HycoGradient *gradient);

/* Gets the resultants of each contact in the last solution, in the scene's order. Collective. Borrowed until the next
   solve. */
PetscErrorCode HycoFOMGetContacts(HycoFOM fom, PetscInt *n, const HycoContactResult *result[]);
/* Gets the forces on the bodies in the last solution: n results, those of supports and springs in the scene's order,
   then the loads and the contacts. balance: the largest component of their sum, divided by the sum of the magnitudes of
   all nodal forces. Collective. Borrowed until the next solve. */
PetscErrorCode HycoFOMGetReactions(HycoFOM fom, PetscInt *n, const HycoReaction *result[], PetscReal *balance);
/*
  Gets the last solution on rank 0 (empty on other ranks), in the mesh file's order (ascending tags). Collective.
  Borrowed until the next solve.

    U       n_nodes x dim, displacement
    Lambda  n_contacts, contact forces (nodal forces, compression positive)
    sigma   n_cells x n_sigma, stress averaged over each cell: (xx) in 1D, (xx, yy, zz, xy) in 2D,
            (xx, yy, zz, xy, yz, xz) in 3D
*/
PetscErrorCode HycoFOMGetSolution(HycoFOM fom, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[]);
/* For a scene with a history, before it is solved: requests that the fields at its listed times (displacement, stress
   and its von Mises value, inelastic strain, temperature, the laws' state, contact) are written to PATH.xdmf (`path`)
   and PATH.h5, or to PATH.vtkhdf, when the path ends, also if it ends early. Collective. */
PetscErrorCode HycoFOMSetSeries(HycoFOM fom, const char path[]);
/* Writes the last solution to PATH.h5 and PATH.xdmf (`path` names the latter), or to PATH.vtkhdf. Collective. */
PetscErrorCode HycoFOMWrite(HycoFOM fom, const char path[]);
/* Writes at most n points, as the times 0, 1, ... of one series, each with its mesh and parameters: Begin; for each
   point HycoFOMSolve() and Add; End completes the file. Not for a scene with a history. Collective. */
PetscErrorCode HycoFOMWriteBegin(HycoFOM fom, const char path[], PetscInt n);
PetscErrorCode HycoFOMWriteAdd(HycoFOM fom);
PetscErrorCode HycoFOMWriteEnd(HycoFOM fom);
/* The file of such an output that has the numbers: PATH.h5 for PATH.xdmf, PATH.vtkhdf itself; fails for other endings.
   Not collective. */
PetscErrorCode HycoFieldsNumbers(const char path[], char numbers[PETSC_MAX_PATH_LEN]);
/* Fails for other endings, and if a model or a snapshot would be overwritten. On this process alone. */
PetscErrorCode HycoFieldsCheckPath(const char path[]);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoFOMView(HycoFOM object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoFOMViewFromOptions(HycoFOM object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
