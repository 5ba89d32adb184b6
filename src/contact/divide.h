/* The division of a search for masters over several ranks: private to contact/. */
#ifndef HYCO_DIVIDE_H
#define HYCO_DIVIDE_H
#include "partners.h"

/* The slave nodes of one rank and the patches of their search. Its nodes are the slaves, then the patches' nodes in
   ascending order. */
typedef struct {
  PetscInt n_slaves, n_patches, n_nodes; /* n_nodes: of the patches */
  PetscInt *patch, *global, *node;       /* numbers on rank 0 of the patches, of their nodes; the patches' nodes */
  PetscReal *X, *outward, *normal;       /* by node, by slave, by patch; x 3 */
} HycoTeamPart;
#define HYCO_TEAM_SIZES 3

static inline PetscInt HycoTeamIntegers(const PetscInt size[HYCO_TEAM_SIZES], PetscInt nf)
{
  return (1 + nf) * size[1] + size[2];
}

static inline PetscInt HycoTeamReals(const PetscInt size[HYCO_TEAM_SIZES])
{
  return 6 * size[0] + 3 * size[1] + 3 * size[2];
}

/* On rank 0: the division of a search. */
typedef struct {
  const HycoPartners *t;
  PetscMPIInt ranks;
  const PetscInt *node;                 /* of the slaves, by their numbers in the search */
  HycoPoint *slave;                     /* the slaves in the order of the ranks */
  PetscReal *centre, *radius, at_least; /* balls around the patches; how far beyond its bound a block searches */
  PetscInt *first;                      /* ranks + 1: the slaves of each rank */
  PetscInt **patch, **global;           /* by rank, as in a part; owned */
  PetscInt *size;                       /* HYCO_TEAM_SIZES by rank */
  PetscInt *seen;                       /* by node of the search */
  PetscBool *near;                      /* by patch: work */
} HycoTeamPlan;

/* Divides n slaves over the ranks. The caller destroys the plan, also after an error. */
PetscErrorCode HycoTeamPlanCreate(const HycoPartners *t, PetscInt n, const PetscInt slave[], PetscMPIInt ranks,
                                  HycoTeamPlan *p);
PetscErrorCode HycoTeamPlanDestroy(HycoTeamPlan *p);
/* A part in the two arrays in which it is sent. */
void HycoTeamPartSet(HycoTeamPart *p, const PetscInt size[HYCO_TEAM_SIZES], PetscInt integer[], PetscReal real[]);
/* Fills the arrays of a rank's part; p->seen[] then has the part's number of each of its nodes. */
void HycoTeamPlanFill(HycoTeamPlan *p, PetscMPIInt rank, PetscInt integer[], PetscReal real[]);

#endif
