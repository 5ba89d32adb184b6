/* What one contact's search needs: private to assembly/. */
#ifndef HYCO_PARTNERS_H
#define HYCO_PARTNERS_H
#include "nearest.h"
#include <hycofe.h>

typedef struct {
  HycoFE fe;                  /* borrowed; its nodes are where the search is */
  PetscInt slave, master;     /* groups */
  HycoPatches patches;        /* the master's */
  PetscInt n, nf, *node;      /* patches' nodes, n x nf */
  PetscReal *normal;          /* n x 3, of the patches (a pair's: of its nodes); 0: unknown */
  PetscReal *outward;         /* by node of the mesh x 3, of the slave's surface; 0: unknown */
  PetscInt n_border, *border; /* edges (2D: ends) of one facet alone, as sorted pairs of nodes; made when asked */
  PetscBool *at_border;       /* by node of the mesh; NULL: not made */
} HycoPartners;

/* The search of a pair or surface contact on fe's nodes. The caller destroys it. */
PetscErrorCode HycoPartnersCreate(HycoFE fe, const HycoContact *contact, HycoPartners *partners);
PetscErrorCode HycoPartnersDestroy(HycoPartners *partners);
/* The slave node's outward normal; NULL: unknown, as on a group that is no surface. */
const PetscReal *HycoPartnersOutward(const HycoPartners *partners, PetscInt slave);
/* The nearest point of the master; n = 0 where it does not oppose the slave's normal, unless any_side. */
void HycoPartnersProject(const HycoPartners *partners, PetscInt slave, PetscBool any_side, HycoProjection *at);
/* From the slave node to that point. */
void HycoPartnersAcross(const HycoPartners *partners, PetscInt slave, const HycoProjection *at, PetscReal r[3]);
/* Whether a point lies on the master's border: on an edge that has one facet, at a node of such an edge. */
PetscErrorCode HycoPartnersAtBorder(HycoPartners *partners, const HycoProjection *at, PetscBool *border);
/* Whether a slave node lies past the master's border, by more than a tenth of the facet's shortest edge along it. */
PetscErrorCode HycoPartnersIsPast(HycoPartners *partners, PetscInt slave, const HycoProjection *at, PetscBool *past);

static inline PetscReal HycoDot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#endif
