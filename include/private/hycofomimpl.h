/* HycoFOM, inside. */
#ifndef HYCOFOMIMPL_H
#define HYCOFOMIMPL_H

#include <hycocontactimpl.h>
#include <hycofom.h>
#include <hycosolverimpl.h>

/* Most rigid motions that -hyco_regularise releases. */
#define HYCO_MAX_PINS 12

typedef struct _n_HycoPath *HycoPath;
typedef struct _n_HycoCompared *HycoCompared;

struct _p_HycoFOM {
  PETSCHEADER(int);
  PetscMPIInt rank, size;
  HycoScene scene; /* referenced */
  /* owned */
  DM dm; /* over the ranks */
  char mesh_write[PETSC_MAX_PATH_LEN];
  HycoMesh part;     /* each rank's cells */
  HycoMesh surface;  /* rank 0: nodes and facets of the contacts' groups (of a line all); the part on one rank */
  HycoFE fe;         /* on the part */
  HycoFE fe_surface; /* on the surface, rank 0 (the same as fe on one rank); NULL elsewhere */
  HycoPairs pairs;   /* rank 0, of the surface's nodes */
  HycoSystem system;
  HycoSolver solver;
  Mat K, B, Bt;
  Vec U, Lambda, F, D;
  PetscInt n_nodes, n_cells, n_contacts, n_free;   /* of the whole mesh, on every rank */
  PetscInt width;                                  /* most nodes of a contact, on every rank */
  PetscBool searches;                              /* the masters of moved surfaces, anew where they are */
  VecScatter to_local, to_surface, lambda_to_root; /* to_surface: NULL on one rank */
  Vec U_local, U_surface, lambda_root;
  HycoFileOrder *rows; /* NULL on one rank, and until it is needed */
  /* the last solution: displacements at the part's nodes and at the surface's (rank 0), without motions that were
     released; stresses of the part's cells, when asked for; on rank 0 the forces and gaps */
  PetscReal *u, *u_surface, *sigma, *lambda, *gap;
  struct _n_HycoFieldFile *set;      /* HycoFOMWriteBegin() */
  HycoContactResult *contact_result; /* by contact of the scene, when asked for */
  HycoReaction *reaction;            /* HycoFOMGetReactions() */
  PetscReal *u_all, *sigma_all;      /* on rank 0 when asked for, in the file's order; on one rank u and sigma */
  PetscBool solved, sigma_ready, all_ready;
  /* U under given forces: its factor of K; residuals of the whole of (16); whether the last solution is one */
  HycoSystem given_system;
  HycoSolver given_solver;
  Vec given_F;
  HycoKKT given_kkt;
  PetscBool given;
  /* -hyco_regularise: motions that nothing holds, orthonormal, and the unknowns pinned for them, by tag and component
   */
  PetscBool regularise, pinned; /* pinned: the pins are chosen */
  PetscReal regularise_tol;
  PetscInt partition; /* index in HycoPartitioners */
  PetscInt n_pins, n_released, pin_tag[HYCO_MAX_PINS], pin_component[HYCO_MAX_PINS];
  PetscInt n_turned; /* of released: those that the contacts' normals are turned for */
  Vec *released;
  HycoPath path;         /* of a scene with a history, else NULL */
  HycoCompared compared; /* what comparisons with a reduced model keep (errors/compare.c); NULL: none yet */
  HycoSummary summary;
};

/* NULL-safe. */
PetscErrorCode HycoComparedDestroy(HycoCompared *compared);
/* A model that has its mesh, contacts and tables alone: for training, which reads solutions of others. Collective. */
PetscErrorCode HycoFOMCreateMesh(MPI_Comm comm, HycoScene scene, HycoFOM *fom);
/* group[g]: whether a contact of the scene is on it; the others are left alone. */
PetscErrorCode HycoMarkContactGroups(HycoScene scene, HycoMesh mesh, PetscBool group[]);
/* Brings fe and fe_surface to mu. Collective. */
PetscErrorCode HycoFOMSetParameters(HycoFOM fom, const PetscReal mu[]);
/* K, F, B, D at mu, in the system. Collective. */
PetscErrorCode HycoFOMAssemble(HycoFOM fom, const PetscReal mu[]);
/* After a solve: u, u_surface and lambda of U and Lambda. Collective. */
PetscErrorCode HycoFOMGather(HycoFOM fom);
/* A vector's values at the part's nodes; at the surface's, on rank 0. Collective. */
PetscErrorCode HycoFOMToLocal(HycoFOM fom, Vec v, PetscReal value[]);
PetscErrorCode HycoFOMToSurface(HycoFOM fom, Vec v, PetscReal value[]);
/* The stresses of the last solution in sigma. Collective. */
PetscErrorCode HycoFOMStress(HycoFOM fom);
/* The scene's quantities of the last solution (value[scene->n_quantities]). Collective. */
PetscErrorCode HycoFOMMeasureQuantities(HycoFOM fom, PetscReal value[]);
/* The file's order, spread over the ranks; NULL on one. Borrowed. Collective. */
PetscErrorCode HycoFOMGetRows(HycoFOM fom, const HycoFileOrder **rows);
/* The reals of this rank's rows in the file's order, so many a node or cell, at the part's nodes or cells. Collective.
 */
PetscErrorCode HycoFOMFromRows(HycoFOM fom, HycoPlace place, PetscInt components, const PetscReal rows[],
                               PetscReal value[]);
/* Values of the part's nodes or cells, so many of a type each, as this rank's rows in the file's order. Collective. */
PetscErrorCode HycoFOMToRows(HycoFOM fom, HycoPlace place, MPI_Datatype type, PetscInt components, const void *value,
                             void *rows);
/* Looks for rigid motions that neither supports nor contact hold, at fe's parameters: fails with their names, or pins
   as many unknowns, as supports of fe. Collective, before the assembly. */
PetscErrorCode HycoFOMRelease(HycoFOM fom);
/* Takes from F, assembled without the pins, what it does on the released motions; fails if that is not little.
   Collective. */
PetscErrorCode HycoFOMBalance(HycoFOM fom);
/* After a solve: fails when the contact forces are not balanced on the released motions. Collective. */
PetscErrorCode HycoFOMCheckContactBalance(HycoFOM fom);
/* Takes the released motions that the contacts' normals leave alone out of u. Collective. */
PetscErrorCode HycoFOMTakeOutReleased(HycoFOM fom, Vec u);
/* How many closed contacts of the last solution depend on the others, rows of B: with any, the contact forces are not
   unique. Rank 0. */
PetscErrorCode HycoFOMCountDependent(HycoFOM fom, PetscInt *dependent);
/* Attaches the rigid motions that contact alone holds to K. Collective. */
PetscErrorCode HycoFOMSetMotions(HycoFOM fom);
/* The forces of supports in the last solution, at the part's unknowns (its own nodes'), 0 where nothing is fixed.
   Collective. */
PetscErrorCode HycoFOMReactions(HycoFOM fom, PetscReal r[]);
/* Generalised forces F - B^T Lambda of the last solution at the part's nodes, zero on fixed unknowns. Collective. */
PetscErrorCode HycoFOMGetForces(HycoFOM fom, PetscReal forces[]);
/* Fills strain_energy, external_work, gap_work and energy_defect from the last solution. Collective. */
PetscErrorCode HycoFOMEnergy(HycoFOM fom, HycoSummary *summary);

/*
  What condensing the model on its forces takes, at mu: on rank 0, G = B K^-1 B^T as the columns of its lower triangle
  (m (m + 1) / 2). Solves at mu in the dual form on the way. Collective.
*/
PetscErrorCode HycoFOMFlexibility(HycoFOM fom, const PetscReal mu[], PetscReal G[]);
/* How the displacement answers contact forces at mu: X = K^-1 B^T P for q patterns P (n_contacts x q column major, read
   on rank 0), at the part's unknowns, n_dof x q row major. One factor of K alone. Collective. */
PetscErrorCode HycoFOMResponses(HycoFOM fom, const PetscReal mu[], PetscInt q, const PetscReal P[], PetscReal X[]);

#endif
