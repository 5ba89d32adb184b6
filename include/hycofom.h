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
} HycoSeconds;

/*
  What a solution amounts to, in scene units. Strain energy W = 1/2 U^T K U over free and fixed unknowns; external work
  F.U of the loads and R.u0 of the supports that move; gap work L.D with the gaps as drawn. Energy defect:
  |2 W - (external_work - gap_work)| / max(2 W, |external_work|, |gap_work|), 0 for a solution without round-off.
*/
typedef struct {
  PetscInt n_dof, n_contacts, n_active; /* free unknowns N, contacts N_lambda, contacts with L_i > 0 */
  PetscInt n_still;                     /* contacts between fixed unknowns, which have no effect */
  PetscInt n_dependent; /* closed contacts whose rows depend on others': with any, Lambda is not unique (U is) */
  PetscInt iterations, dim;
  PetscReal total_contact_force, lambda_max, lambda_norm2, u_norm2, u_min[3], u_max[3];
  PetscReal quantity[HYCO_MAX_QUANTITIES]; /* those of HycoSceneGetQuantities() */
  PetscInt n_facing;          /* contacts that may close: of moved surfaces the slave nodes that face a master */
  PetscReal overlap, sliding; /* largest initial overlap (length); largest motion of a closed contact along its
                                 surface, over the size of a facet: beyond 1 displacements are not small */
  PetscReal strain_energy, external_work, gap_work, energy_defect;
  HycoKKT kkt;
  HycoReason reason;
  HycoSeconds seconds;
  char regularised[512]; /* motions that nothing holds and -hyco_regularise took out, with "; " between */
  char free_motion[128]; /* one that contact alone prevents: "body block from moving along (0, 1, 0)"; "": none */
} HycoSummary;

/* What acts on the bodies: the supports of a group and the springs of a group, which hold them; all loads; all contacts
   (between bodies they add up to nothing). */
typedef enum {
  HYCO_REACTION_SUPPORT,
  HYCO_REACTION_SPRING,
  HYCO_REACTION_LOADS,
  HYCO_REACTION_CONTACT
} HycoReactionKind;
typedef struct {
  HycoReactionKind kind;
  const char *group;  /* of supports and springs; an unknown that two groups fix counts with the first. Borrowed */
  PetscReal force[3]; /* on the bodies; in an axisymmetric scene without the radius's component */
  PetscReal
      moment[3]; /* about the origin, at the moved nodes; 2D: the last component alone; 0 in an axisymmetric scene */
} HycoReaction;

/* A listed time of a history, and what it took to get there from the one before. Energies are since the first time. */
typedef struct {
  PetscInt index; /* among the listed times */
  PetscReal t;
  PetscInt substeps, cuts;                                              /* steps of time; attempts that were halved */
  PetscInt iterations, most_iterations, factors, active_set_iterations; /* contact systems, most in a substep; with a
                                                                           new stiffness; iterations inside them */
  PetscInt n_active;                                                    /* contacts with L_i > 0 */
  PetscReal total_contact_force, lambda_max, u_norm2;
  PetscReal mises, inelastic; /* largest of the cells' means: von Mises stress, accumulated inelastic strain */
  PetscReal residual, kkt;    /* largest of the substeps: of equilibrium, relative to the forces; of all four */
  PetscReal work, contact_work, stored, dissipated, thermal; /* of loads and supports; against contact; elastic energy;
                                                                dissipated; given to heat and to moduli that change */
  PetscReal energy_defect; /* largest of the substeps: of their balance, over the sum of the terms' sizes so far */
  PetscReal seconds, seconds_factor, seconds_solve, seconds_law;
  PetscReal quantity[HYCO_MAX_QUANTITIES]; /* those of HycoSceneGetQuantities() */
} HycoStep;

/* The path of the last solve of a scene with a history. */
typedef struct {
  PetscInt n;             /* times that were reached */
  const HycoStep *step;   /* n, borrowed until the next solve; if the path did not end, the last is no listed time */
  PetscBool ended;        /* the last listed time is reached */
  PetscReal t;            /* the last accepted time */
  const char *why;        /* if not ended: what the last attempt said. Borrowed */
  const char *newton;     /* "tangent" or "elastic" */
  PetscReal factor_cost;  /* solves that a factor costs, by the rule that -hyco_newton auto goes by */
  PetscInt n_orders;      /* steps whose iterations told an order of convergence */
  PetscReal order;        /* the median of these; of the tangent 2 */
  PetscInt n_taken;       /* accepted steps of time, with the first time */
  const PetscReal *taken; /* where they end. Borrowed; a path that was resumed has those since */
} HycoHistory;

/* Called at each listed time, on every rank; HycoFOMGetSolution() then gives the solution there. */
typedef PetscErrorCode (*HycoStepMonitor)(HycoFOM fom, const HycoStep *step, void *ctx);

/* Reads and distributes the scene's mesh over `comm` (which may be smaller than the scene's communicator).
   Collective on `comm`. It keeps a reference to the scene. The caller owns it. */
PetscErrorCode HycoFOMCreate(MPI_Comm comm, HycoScene scene, HycoFOM *fom);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoFOMDestroy(HycoFOM *fom);
/* The solver, to be configured. Borrowed. */
PetscErrorCode HycoFOMGetSolver(HycoFOM fom, HycoSolver *solver);

/* Assembles what depends on the parameters that changed and solves (16) at mu (length n). Collective. Fails, on
   every rank, outside the ranges and where the ranks do not ask for one point; not converging is no error: see
   HycoSummary.reason.
   A scene with a history is solved from its first time to its last (docs/history.md). What is asked for afterwards is
   of the last time that was reached: not converged, HYCO_DIVERGED_STEP, where that is not the last one listed. */
PetscErrorCode HycoFOMSolve(HycoFOM fom, PetscInt n, const PetscReal mu[]);
/*
  Solves K U = F - B^T Lambda at mu (length n) with the contact forces of somebody else: Lambda (n_contacts, read on
  rank 0, in the order of HycoFOMGetSolution's), as a condensed model predicts them. One factor of K, kept while it is.
  What is asked for afterwards is as after HycoFOMSolve(), with Lambda as given; the summary's residuals are those of
  all of (16), penetration and complementarity as far as Lambda is off, its reason that of the linear solve alone.
  Collective.
*/
PetscErrorCode HycoFOMSolveForces(HycoFOM fom, PetscInt n, const PetscReal mu[], const PetscReal Lambda[]);
/* The path of the last solve; n is 0 for a scene without history. Not collective. */
PetscErrorCode HycoFOMGetHistory(HycoFOM fom, HycoHistory *history);
/* Of a scene with a history: what is called at each listed time. Not collective. */
PetscErrorCode HycoFOMSetStepMonitor(HycoFOM fom, HycoStepMonitor monitor, void *ctx);
/* The system of the last solve (K with the fixed unknowns decoupled, F with their lifting). Borrowed. */
PetscErrorCode HycoFOMGetSystem(HycoFOM fom, HycoSystem *system);
/* What the last solution amounts to. Collective. */
PetscErrorCode HycoFOMGetSummary(HycoFOM fom, HycoSummary *summary);

/* What each contact of the scene carries in the last solution, in the scene's order. Collective. Borrowed until the
   next solve. */
PetscErrorCode HycoFOMGetContacts(HycoFOM fom, PetscInt *n, const HycoContactResult *result[]);
/* What holds and loads the bodies in the last solution: n results, those of supports and springs in the scene's order,
   then the loads and the contacts. balance: the largest component of their sum over the sum of all nodal forces' sizes.
   Collective. Borrowed until the next solve. */
PetscErrorCode HycoFOMGetReactions(HycoFOM fom, PetscInt *n, const HycoReaction *result[], PetscReal *balance);
/*
  The last solution on rank 0 (empty elsewhere), in the mesh file's order (ascending tags). Collective. Borrowed until
  the next solve:
    U       n_nodes x dim, displacement
    Lambda  n_contacts, contact forces (nodal forces, compression positive)
    sigma   n_cells x n_sigma, stress averaged over each cell: (xx) | (xx, yy, zz, xy) | (xx, yy, zz, xy, yz, xz)
*/
PetscErrorCode HycoFOMGetSolution(HycoFOM fom, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[]);
/* Of a scene with a history, before it is solved: the fields at its listed times (displacement, stress and its von
   Mises value, inelastic strain, temperature, the laws' state, contact) go to PATH.xdmf (`path`), which ParaView plays,
   and PATH.h5, or to PATH.vtkhdf, when the path ends, wherever that is. Collective. */
PetscErrorCode HycoFOMSetSeries(HycoFOM fom, const char path[]);
/* Writes the last solution to PATH.h5 and PATH.xdmf (`path` names the latter), or to PATH.vtkhdf. Collective. */
PetscErrorCode HycoFOMWrite(HycoFOM fom, const char path[]);
/* The same of at most n points, as the times 0, 1, ... of one series, each with its mesh and parameters: Begin; for
   each point HycoFOMSolve() and Add; End puts the file in its place. Not of a scene with a history. Collective. */
PetscErrorCode HycoFOMWriteBegin(HycoFOM fom, const char path[], PetscInt n);
PetscErrorCode HycoFOMWriteAdd(HycoFOM fom);
PetscErrorCode HycoFOMWriteEnd(HycoFOM fom);

/* Prints it, in words, on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoFOMView(HycoFOM object, PetscViewer viewer);
/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoFOMViewFromOptions(HycoFOM object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
