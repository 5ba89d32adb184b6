/* HycoFOM: the full-order model of a scene, (16): assembled and solved for one parameter value after another. */
#ifndef HYCOFOM_H
#define HYCOFOM_H

#include <hycoscene.h>
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

/* Reads and distributes the scene's mesh over `comm` (which may be smaller than the scene's communicator).
   Collective on `comm`. It keeps a reference to the scene. The caller owns it. */
PetscErrorCode HycoFOMCreate(MPI_Comm comm, HycoScene scene, HycoFOM *fom);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoFOMDestroy(HycoFOM *fom);
/* The solver, to be configured. Borrowed. */
PetscErrorCode HycoFOMGetSolver(HycoFOM fom, HycoSolver *solver);

/* Assembles what depends on the parameters that changed and solves (16) at mu (length n). Collective. Fails, on
   every rank, outside the ranges and where the ranks do not ask for one point; not converging is no error: see
   HycoSummary.reason. */
PetscErrorCode HycoFOMSolve(HycoFOM fom, PetscInt n, const PetscReal mu[]);
/*
  Solves K U = F - B^T Lambda at mu (length n) with the contact forces of somebody else: Lambda (n_contacts, read on
  rank 0, in the order of HycoFOMGetSolution's), as a condensed model predicts them. One factor of K, kept while it is.
  What is asked for afterwards is as after HycoFOMSolve(), with Lambda as given; the summary's residuals are those of
  all of (16), penetration and complementarity as far as Lambda is off, its reason that of the linear solve alone.
  Collective.
*/
PetscErrorCode HycoFOMSolveForces(HycoFOM fom, PetscInt n, const PetscReal mu[], const PetscReal Lambda[]);
/* The system of the last solve (K with the fixed unknowns decoupled, F with their lifting). Borrowed. */
PetscErrorCode HycoFOMGetSystem(HycoFOM fom, HycoSystem *system);
/* What the last solution amounts to. Collective. */
PetscErrorCode HycoFOMGetSummary(HycoFOM fom, HycoSummary *summary);

/*
  The last solution on rank 0 (empty elsewhere), in the mesh file's order (ascending tags). Collective. Borrowed until
  the next solve:
    U       n_nodes x dim, displacement
    Lambda  n_contacts, contact forces (nodal forces, compression positive)
    sigma   n_cells x n_sigma, stress averaged over each cell: (xx) | (xx, yy, zz, xy) | (xx, yy, zz, xy, yz, xz)
*/
PetscErrorCode HycoFOMGetSolution(HycoFOM fom, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[]);
/* Writes the last solution to PATH.h5 and PATH.xdmf (`path` names the latter). Collective. */
PetscErrorCode HycoFOMWrite(HycoFOM fom, const char path[]);

/* Prints it, in words, on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoFOMView(HycoFOM object, PetscViewer viewer);
/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoFOMViewFromOptions(HycoFOM object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
