/* The reduced integration domain (sections 4.2 and 5.1), on the mesh over the ranks. */
#ifndef HYCODOMAIN_H
#define HYCODOMAIN_H

#include <hycocontactimpl.h>
#include <hycofom.h>

/* What an RID grows from, and how. */
typedef struct {
  PetscInt n_nodes, n_cells; /* DEIM points, by their numbers in the whole mesh: nodes from displacement, force and
                                dual modes; cells from stress modes */
  PetscInt *nodes, *cells;
  PetscInt layers;
  PetscReal extension; /* distance on the contact surfaces; 0: none */
  PetscInt n_groups;   /* region of interest */
  char **groups;
  const char *plane;  /* one more group, or NULL */
  const char *region; /* expression, or NULL */
  PetscBool whole;
  PetscBool exact; /* only these cells */
} HycoRIDSettings;

/*
  The contacts of surfaces that a map moves, with all masters that they meet over the parameters: one row for each set
  of masters that a slave node has at some parameters (nodes only; the weights are not those of any parameters), none
  for a slave that meets no master. A contact on surfaces that do not move has one row.
*/
typedef struct {
  HycoPairs rows; /* on the mesh of the pairs */
  PetscInt *of;   /* the contact of each row, ascending */
} HycoMet;

/* By contact of the scene, how far from its slave a master point may be to matter: from the forces Lambda
   (n_contacts x n column major) at n points; PETSC_MAX_REAL if no contact of it presses. pairs: of the mesh of the
   contacts' surfaces. */
PetscErrorCode HycoMetReach(HycoScene scene, HycoMesh surface, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                            const PetscReal Lambda[], PetscReal reach[]);
/* Finds the masters within reach (NULL: at any distance) at n points and over the ranges. The caller destroys it. */
PetscErrorCode HycoMetFind(HycoScene scene, HycoMesh surface, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                           const PetscReal reach[], HycoMet *met);
PetscErrorCode HycoMetDestroy(HycoMet *met);
/* The groups of moved surfaces, slaves and masters (room for twice the scene's contacts). */
PetscErrorCode HycoMovedGroups(HycoScene scene, HycoMesh mesh, const HycoPairs *pairs, PetscInt *n, PetscInt group[]);

/* Omega_A: the cells of the mesh's DM, with their closure, as the stratum HYCO_RID of a label, which the caller
   owns. The settings are on every rank; pairs on rank 0, by the nodes of the contacts' surfaces: every contact, and
   for moved surfaces all masters that they meet (HycoMet). Collective. */
#define HYCO_RID 1
PetscErrorCode HycoRIDBuild(HycoFOM mesh, const HycoPairs *pairs, const HycoRIDSettings *settings, DMLabel *rid);

/* The sets of the n nodes of the reduced mesh, by node their number: 0 outside Omega_A, 1 in the set I, (32), 2 in the
   set A, (33). On entry I has the nodes that Omega_B shares, on return also those on Gamma_I^C. Sets in_rid[k]: whether
   contact k of pairs belongs to A_lambda (36). fe, pairs: on the contacts' surfaces, whose node i is index[i] of the
   reduced mesh. rows: the masters that the contacts meet, and `of`, the contact of each row (HycoMet); if no surface is
   moved, the pairs themselves and NULL. On one process. */
PetscErrorCode HycoRIDSets(HycoFE fe, HycoPairs *pairs, const HycoPairs *rows, const PetscInt of[],
                           const PetscInt index[], PetscInt n, PetscInt sets[], PetscInt in_rid[]);

#endif
