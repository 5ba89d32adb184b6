/* The search for one contact's masters: private to contact/. */
#ifndef HYCO_PARTNERS_H
#define HYCO_PARTNERS_H
#include "nearest.h"
#include <hycocontactimpl.h>
#include <hycovector.h>

typedef struct {
  HycoFE fe;                  /* borrowed; its nodes are those of the search */
  PetscInt slave, master;     /* groups */
  PetscBool nodes;            /* whether patches are the master's nodes, or its facets */
  HycoPatches patches;        /* the master's */
  PetscInt n, nf, *node;      /* patches' nodes, n x nf */
  PetscReal *normal;          /* n x 3, of the patches (for a pair: of its nodes); 0: unknown */
  PetscReal *outward;         /* by node of the mesh x 3, outward normal of the slave's surface; 0: unknown */
  PetscInt n_border, *border; /* edges (2D: ends) of one facet only, as sorted pairs of nodes; created when needed */
  PetscBool *at_border;       /* by node of the mesh; NULL: not created */
} HycoPartners;

/* The default tolerance: a tenth of the shortest edge between the corners of the group's facets. */
PetscReal HycoSurfaceTolerance(HycoMesh mesh, PetscInt group);
/* Creates the search on fe's nodes. The caller destroys it. */
PetscErrorCode HycoPartnersCreate(HycoFE fe, HycoContact contact, PetscBool nodes, HycoPartners *partners);
PetscErrorCode HycoPartnersDestroy(HycoPartners *partners);
/* The slave node's outward normal; NULL: unknown, because its group is not a surface. */
const PetscReal *HycoPartnersOutward(const HycoPartners *partners, PetscInt slave);
/* The nearest point of the master; n = 0 if its normal does not oppose the slave's, unless any_side. */
void HycoPartnersProject(const HycoPartners *partners, PetscInt slave, PetscBool any_side, HycoProjection *at);
/* The vector from the slave node to that point. */
void HycoPartnersAcross(const HycoPartners *partners, PetscInt slave, const HycoProjection *at, PetscReal r[3]);
/* Whether a point is on the master's border: on an edge with one facet, or at a node of such an edge. */
PetscErrorCode HycoPartnersAtBorder(HycoPartners *partners, const HycoProjection *at, PetscBool *border);
/* Whether a slave node is past the master's border, by more than a tenth of the facet's shortest edge in its plane. */
PetscErrorCode HycoPartnersIsPast(HycoPartners *partners, PetscInt slave, const HycoProjection *at, PetscBool *past);

/* Position of a slave node relative to the master: within reach and in front of it; too far; all of the master
   turned away; to the side, as for a pair that does not match; past the border. */
typedef enum { HYCO_MET, HYCO_FAR, HYCO_TURNED, HYCO_ASKEW, HYCO_PAST } HycoVerdict;

/* The n slave nodes with their masters (at[k].n = 0: none), at most `tolerance` away; below `small`, a tenth of the
   slave's shortest edge, they touch. */
typedef struct {
  PetscInt n;
  const PetscInt *slave;
  PetscReal tolerance, small;
  HycoProjection *at;
  HycoVerdict *why;
} HycoMatch;

/* A type's choice of masters from the nearest points. */
typedef PetscErrorCode (*HycoSettle)(HycoPartners *partners, HycoContact contact, HycoMatch *match);
/* What to do about n slave nodes without a master, as the end of a message. */
typedef PetscErrorCode (*HycoRemedy)(HycoPartners *partners, HycoContact contact, PetscInt n, const PetscInt node[],
                                     char text[HYCO_LINE]);

/* The master of one slave node, at most `tolerance` away. Beyond `small`, the direction to it must be within the
   angle for opposed normals of the slave's normal, and must not lead past the border. */
PetscErrorCode HycoPartnersJudge(HycoPartners *partners, PetscInt slave, PetscReal tolerance, PetscReal small,
                                 HycoProjection *at, HycoVerdict *why);
/* Adds all slave nodes with their masters to pairs; settle NULL: without masters, which are searched for elsewhere. */
PetscErrorCode HycoPartnersMatch(HycoContact contact, HycoFE fe, PetscInt index, PetscBool nodes, HycoSettle settle,
                                 HycoRemedy remedy, HycoPairs *pairs);
/* The entries of a type with slave and master. */
PetscErrorCode HycoPartnersDeclare(HycoContact contact);

#endif
