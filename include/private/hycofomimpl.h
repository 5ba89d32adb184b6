/* HycoFOM's struct and internal functions. */
#ifndef HYCOFOMIMPL_H
#define HYCOFOMIMPL_H

#include <hycocontactstate.h>
#include <hycocontactimpl.h>
#include <hycofom.h>
#include <hycoh5.h>
#include <hycosolverimpl.h>

/* The most rigid motions that -hyco_regularise releases. */
#define HYCO_MAX_PINS 12

/* The arrays of a HycoGradient. most: of a time of a path the largest of each output on it, borrowed; else NULL. */
typedef struct {
  PetscReal *value;
  PetscBool *kink;
  const PetscReal *most;
} HycoGradientStore;

typedef struct _n_HycoPath *HycoPath;

struct _p_HycoFOM {
  PETSCHEADER(int);
  PetscMPIInt rank, size;
  HycoScene scene; /* referenced */
  /* owned */
  DM dm; /* over the ranks */
  char mesh_write[PETSC_MAX_PATH_LEN];
  HycoMesh part;    /* each rank's cells */
  HycoMesh surface; /* each rank's contacts: facets around its slaves and the masters' nodes that these may meet; on one
                        rank the part itself */
  HycoFE fe;        /* on the part */
  HycoFE fe_surface;  /* on the surface; on one rank fe */
  HycoPairs pairs;    /* of the slaves that the rank owns, on the surface's nodes */
  PetscBool gathered; /* for training: rank 0 has all contacts on the whole surfaces, others none (surface NULL) */
  PetscInt n_needed, *needed, place; /* nodes around which the surface has all facets; the positions they are for */
  PetscInt patches[2];               /* the most facets of a contact's master: on this surface, on all of the mesh */
  PetscReal cpu;                     /* that of the last solve */
  PetscReal contact_cpu;             /* CPU seconds of this process so far in contacts: search, rows, B */
  HycoSystem system;
  HycoSolver solver;
  Mat K, B, Bt;
  Vec U, Lambda, F, D; /* a rank's rows of B, Lambda and D are its contacts, in the order of its pairs */
  PetscInt n_nodes, n_cells, n_contacts, n_free; /* of the whole mesh, on every rank */
  PetscInt width;                                /* most nodes of a contact, of all ranks */
  PetscBool searches;                            /* the scene has moved surfaces, whose masters are searched anew */
  VecScatter to_local, to_surface;               /* to_surface: NULL on one rank */
  Vec U_local, U_surface;
  HycoFileOrder *rows; /* NULL on one rank, and until it is first used */
  /* the last solution: displacements at the part's nodes and at the surface's, without released motions; stresses of
     the part's cells, on request; forces and gaps of the rank's contacts; on rank 0 the forces of all, on request */
  PetscReal *u, *u_surface, *sigma, *lambda, *gap, *lambda_all;
  struct _n_HycoFieldFile *set;      /* HycoFOMWriteBegin() */
  HycoContactResult *contact_result; /* HycoSceneResults(), on request */
  HycoReaction *reaction;            /* HycoFOMGetReactions() */
  PetscReal *u_all, *sigma_all;      /* on rank 0, on request, in the file's order; on one rank u and sigma */
  PetscBool solved, sigma_ready, all_ready;
  /* U under given forces: its factor of K; residuals of the whole of (16); whether it is the last solution */
  HycoSystem given_system;
  HycoSolver given_solver;
  Vec given_F;
  HycoKKT given_kkt;
  PetscBool given;
  /* -hyco_regularise: unconstrained rigid motions, orthonormal, and the unknowns pinned for them, by tag and
     component */
  PetscBool regularise, pinned; /* pinned: the pins have been chosen */
  PetscReal regularise_tol;
  PetscInt partition; /* index in HycoPartitioners */
  PetscInt n_pins, n_released, pin_tag[HYCO_MAX_PINS], pin_component[HYCO_MAX_PINS];
  PetscInt n_turned; /* number of released motions for which the contacts' normals are turned */
  Vec *released;
  HycoPath path;              /* of a scene with a history, else NULL */
  HycoSoft soft;              /* with friction: rigid motions that soft springs hold, and those that nothing does */
  HycoGradientStore gradient; /* of HycoFOMGetGradient() */
  HycoSummary summary;
};

/* A model that has only its mesh, contacts and tables: for training, which reads stored solutions. Collective. */
PetscErrorCode HycoFOMCreateMesh(MPI_Comm comm, HycoScene scene, HycoFOM *fom);
/* Sets group[g] for the groups with a contact of the scene; leaves the others unchanged. */
PetscErrorCode HycoMarkContactGroups(HycoScene scene, HycoMesh mesh, PetscBool group[]);
/* Finds the contacts of each rank's slaves on the nodes as drawn; on the ranks' fe. Collective. */
PetscErrorCode HycoFOMFindContacts(HycoFOM fom);
/* After fe's nodes have moved: fetches further facets of masters, if slaves may meet them. Collective. */
PetscErrorCode HycoFOMFetchMasters(HycoFOM fom);
/* Creates fe_surface, and the scatter to its nodes. Collective. */
PetscErrorCode HycoFOMSetUpSurface(HycoFOM fom);
/* The contacts of all ranks in their order, on the whole surfaces, on rank 0 (elsewhere none, mesh NULL); they are
   destroyed by the caller. For errors, and for training, which replaces each rank's by them. Collective. */
PetscErrorCode HycoFOMGatherContacts(HycoFOM fom, HycoMesh *mesh, HycoPairs *pairs);
PetscErrorCode HycoFOMGatherSurface(HycoFOM fom, HycoMesh *mesh);
PetscErrorCode HycoFOMKeepOnRoot(HycoFOM fom);
/* This rank's surface with all facets around all of its nodes, at fe's parameters, and the nodes' places there. The
   caller destroys all three. Collective. */
PetscErrorCode HycoFOMWiden(HycoFOM fom, HycoMesh *mesh, HycoFE *fe, PetscInt **index);
/* On several ranks: the number of each row of B among all contacts, on rank 0 (elsewhere NULL). The caller frees it.
   Collective. */
PetscErrorCode HycoFOMGetNumbers(HycoFOM fom, PetscInt **number);
/* The forces of all contacts on rank 0, in their order. Borrowed; NULL elsewhere. Collective. */
PetscErrorCode HycoFOMGetLambda(HycoFOM fom, const PetscReal *lambda[]);
/* Sets Lambda from the forces of all contacts on rank 0 (elsewhere not read). Collective. */
PetscErrorCode HycoFOMSetLambda(HycoFOM fom, const PetscReal lambda[]);
/* Writes the forces of all contacts as a dataset, each rank its rows of Lambda. Collective. */
PetscErrorCode HycoFOMWriteForces(HycoFOM fom, HycoH5 h5, const char name[]);
/* Updates fe and fe_surface to mu; on several ranks also the masters on moved surfaces. Collective. */
PetscErrorCode HycoFOMSetParameters(HycoFOM fom, const PetscReal mu[]);
/* Why the solver would fail with the system just assembled, as no contact forces balance its loads; "": it would not,
   or with friction. Collective. */
PetscErrorCode HycoFOMLiftOff(HycoFOM fom, char why[HYCO_LINE]);
/* K, F, B, D at mu, in the system. Collective. */
PetscErrorCode HycoFOMAssemble(HycoFOM fom, const PetscReal mu[]);
/* After a solve: u, u_surface and lambda of U and Lambda. Collective. */
PetscErrorCode HycoFOMGather(HycoFOM fom);
/* A vector's values at the part's nodes; at the surface's nodes. Collective. */
PetscErrorCode HycoFOMToLocal(HycoFOM fom, Vec v, PetscReal value[]);
PetscErrorCode HycoFOMToSurface(HycoFOM fom, Vec v, PetscReal value[]);
/* Computes the stresses of the last solution in sigma. Collective. */
PetscErrorCode HycoFOMStress(HycoFOM fom);
/* The scene's quantities of the last solution (value[scene->n_quantities]). Collective. */
PetscErrorCode HycoFOMMeasureQuantities(HycoFOM fom, PetscReal value[]);
/* The file's order, distributed over the ranks; NULL on one rank. Borrowed. Collective. */
PetscErrorCode HycoFOMGetRows(HycoFOM fom, const HycoFileOrder **rows);
/* From reals in this rank's rows in the file's order to the part's nodes or cells, `components` each. Collective. */
PetscErrorCode HycoFOMFromRows(HycoFOM fom, HycoPlace place, PetscInt components, const PetscReal rows[],
                               PetscReal value[]);
/* From values at the part's nodes or cells, `components` of a type each, to this rank's rows in the file's order.
   Collective. */
PetscErrorCode HycoFOMToRows(HycoFOM fom, HycoPlace place, MPI_Datatype type, PetscInt components, const void *value,
                             void *rows);
/* Finds rigid motions that neither supports nor contact prevent, at fe's parameters: fails with their names, or pins
   as many unknowns, as supports of fe. Collective, before the assembly. */
PetscErrorCode HycoFOMRelease(HycoFOM fom);
/* Removes from F, assembled without the pins, its work on the released motions; fails if that work is not small.
   Collective. */
PetscErrorCode HycoFOMBalance(HycoFOM fom);
/* After a solve: fails if the contact forces are not balanced on the released motions. Collective. */
PetscErrorCode HycoFOMCheckContactBalance(HycoFOM fom);
/* Removes from u the released motions for which the contacts' normals are turned. Collective. */
PetscErrorCode HycoFOMTakeOutReleased(HycoFOM fom, Vec u);
/* Number of closed contacts of the last solution whose rows of B depend on the others; if it is not 0, the contact
   forces are not unique. Collective. */
PetscErrorCode HycoFOMCountDependent(HycoFOM fom, PetscInt *dependent);
/* The same for m rows and their gaps on one process, displacements u (n_dof) and normal forces lambda; slip: of
   contacts with friction, whose rows have tangents; else NULL: a row for each contact. */
PetscErrorCode HycoRowsCountDependent(const HycoRows *rows, PetscInt n_dof, const PetscReal u[],
                                      const PetscReal lambda[], HycoContactState slip, PetscInt *dependent);
/* Creates distributed vectors of the motions; VecDestroyVecs() destroys them. Collective. */
PetscErrorCode HycoFOMMotionVectors(HycoFOM fom, const HycoMotions *motions, Vec **v);
/* Finds the motions of `soft` at the present K, and forgets them. Collective. */
PetscErrorCode HycoFOMFindSoft(HycoFOM fom);
PetscErrorCode HycoFOMForgetSoft(HycoFOM fom);
/* w[p] = B v of the contacts with a force, 0 of the others; *size: the largest square of a B v with all. Collective. */
PetscErrorCode HycoFOMMoveClosed(HycoFOM fom, PetscInt p, const Vec v[], Vec w[], PetscReal *size);
/* name: a rigid motion, left free by supports and springs, on which no contact force of the solution acts; "": none.
   Collective. */
PetscErrorCode HycoFOMNameFreeMotion(HycoFOM fom, char name[HYCO_LINE]);
/* Changes the reason of a solution u (of the part's unknowns) whose displacements or energies are impossible.
   relative: the largest displacement, over the extent of the mesh. why: the reason in words, with the body or the
   number that shows it, for the contact forces L (NULL: none); empty if the solution is accepted. Collective. */
PetscErrorCode HycoFOMJudge(HycoFOM fom, const PetscReal u[], Vec L, PetscReal energy_defect, HycoReason *reason,
                            PetscReal *relative, char why[HYCO_LINE]);
/* Attaches to K the rigid motions that only contact prevents. Collective. */
PetscErrorCode HycoFOMSetMotions(HycoFOM fom);
/* The forces of supports in the last solution, at the part's unknowns (valid at the nodes it owns), 0 where nothing
   is fixed. Collective. */
PetscErrorCode HycoFOMReactions(HycoFOM fom, PetscReal r[]);
/* Generalised forces F - B^T Lambda of the last solution at the part's nodes, zero on fixed unknowns. Collective. */
PetscErrorCode HycoFOMGetForces(HycoFOM fom, PetscReal forces[]);
/* Sets strain_energy, external_work, gap_work and energy_defect from the last solution. Collective. */
PetscErrorCode HycoFOMEnergy(HycoFOM fom, HycoSummary *summary);

#endif
