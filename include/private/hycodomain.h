/* The reduced integration domain (sections 4.2 and 5.1), on the mesh over the ranks. */
#ifndef HYCODOMAIN_H
#define HYCODOMAIN_H

#include <hycocontactimpl.h>
#include <hycofom.h>

/* What an RID grows from, and how. */
typedef struct {
  PetscInt n_nodes, n_cells; /* DEIM points, by their numbers in the whole mesh: nodes of displacement, force and dual
                                modes; cells of stress modes */
  PetscInt *nodes, *cells;
  PetscInt layers;
  PetscReal extension; /* distance on the contact surfaces; 0: none */
  PetscInt n_groups;   /* region of interest */
  char **groups;
  const char *plane;  /* a group more, or NULL */
  const char *region; /* expression, or NULL */
  PetscBool whole;
  PetscBool exact; /* the cells and nothing else */
} HycoRIDRecipe;

/*
  The contacts of surfaces that a map moves, with all that they meet over the parameters: a row for each set of masters
  that a slave node has somewhere (nodes alone: the weights are not those of any place), none for one that meets
  nothing. Contacts on surfaces that stay have their one row.
*/
typedef struct {
  HycoPairs rows; /* on the mesh of the pairs */
  PetscInt *of;   /* the contact of each row, ascending */
} HycoMet;

/* How far from its slave a master point may be to matter (by contact of the scene): from the forces Lambda (n_contacts
   x n column major) at n points; PETSC_MAX_REAL where none presses. pairs: of the mesh of the contacts' surfaces. */
PetscErrorCode HycoMetReach(HycoScene scene, HycoMesh surface, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                            const PetscReal Lambda[], PetscReal reach[]);
/* What is met within reach (NULL: at any distance) at n points and over the ranges. The caller destroys it. */
PetscErrorCode HycoMetFind(HycoScene scene, HycoMesh surface, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                           const PetscReal reach[], HycoMet *met);
PetscErrorCode HycoMetDestroy(HycoMet *met);
/* The groups of moved surfaces, slaves and masters (room for twice the scene's contacts). */
PetscErrorCode HycoMovedGroups(HycoScene scene, HycoMesh mesh, const HycoPairs *pairs, PetscInt *n, PetscInt group[]);

/* Omega_A: the cells of the mesh's DM, with their closure, as the stratum HYCO_RID of a label, the caller's. The recipe
   is on every rank; pairs on rank 0, by the nodes of the contacts' surfaces: every contact, of moved surfaces all that
   they meet (HycoMet). Collective. */
#define HYCO_RID 1
PetscErrorCode HycoRIDBuild(HycoFOM mesh, const HycoPairs *pairs, const HycoRIDRecipe *recipe, DMLabel *rid);

/* A node's part in the reduced problem. */
enum {
  HYCO_ROLE_OUTSIDE,   /* no cell in Omega_A */
  HYCO_ROLE_INTERFACE, /* in Omega_A, and in Omega_B or on Gamma_I^C: the set I, (32) */
  HYCO_ROLE_A          /* in Omega_A only: the set A, (33) */
};

/* From the roles that cells alone give to the n nodes of the reduced mesh, those that contacts leave them, and
   in_rid[k]: whether contact k of pairs belongs to A_lambda (36). fe, pairs: on the contacts' surfaces, whose node i is
   index[i] of the reduced mesh. rows: what the contacts meet, and `of` which contact each is (HycoMet); pairs
   themselves and NULL where nothing is moved. On one process. */
PetscErrorCode HycoRIDSets(HycoFE fe, HycoPairs *pairs, const HycoPairs *rows, const PetscInt of[],
                           const PetscInt index[], PetscInt n, PetscInt role[], PetscInt in_rid[]);

#endif
