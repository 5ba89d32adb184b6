/* The reduced integration domain (sections 4.2 and 5.1) on a whole mesh, on one process. */
#ifndef HYCODOMAIN_H
#define HYCODOMAIN_H

#include <hycofe.h>

/* What an RID grows from, and how. */
typedef struct {
  PetscInt n_nodes, n_cells; /* DEIM points: nodes of displacement, force and dual modes; cells of stress modes */
  PetscInt *nodes, *cells;
  PetscInt layers;
  PetscReal extension; /* distance on the contact surfaces; 0: none */
  PetscInt n_groups;   /* region of interest */
  char **groups;
  const char *region; /* expression, or NULL */
  PetscBool whole;
} HycoRIDRecipe;

/* in[e] = whether cell e belongs to Omega_A. */
PetscErrorCode HycoRIDBuild(HycoScene scene, HycoMesh whole, const HycoPairs *pairs, const HycoRIDRecipe *recipe,
                            PetscBool in[]);

/* A node's part in the reduced problem. */
enum {
  HYCO_ROLE_OUTSIDE,   /* no cell in Omega_A */
  HYCO_ROLE_INTERFACE, /* in Omega_A, and in Omega_B or on Gamma_I^C: the set I, (32) */
  HYCO_ROLE_A          /* in Omega_A only: the set A, (33) */
};

/* role[i] of each whole node, and in_rid[k]: whether contact k belongs to A_lambda (36). */
PetscErrorCode HycoRIDSets(HycoMesh whole, const HycoPairs *pairs, const PetscBool in[], PetscInt role[],
                           PetscInt in_rid[]);

#endif
