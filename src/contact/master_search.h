/* The search for one contact's masters: private to contact/. */
#ifndef HYCO_MASTER_SEARCH_H
#define HYCO_MASTER_SEARCH_H
#include "nearest.h"
#include <hycocontactimpl.h>
#include <hycovector.h>

/* -- begin: in exported models too -- */
/* Of a facet's shortest edge: points that are nearer coincide; mesh files have 6 digits at least. */
#define HYCO_SAME_POINT 1e-6

typedef struct {
  HycoFE fe;                  /* borrowed; its nodes are those of the search */
  PetscInt slave, master;     /* groups */
  PetscBool nodes;            /* whether patches are the master's nodes, or its facets */
  PetscInt n_nodes;           /* of the search */
  const PetscReal *X;         /* n_nodes x 3, borrowed */
  HycoPatches patches;        /* the master's; NULL until HycoMasterSearchReady() */
  PetscInt n, nf, *node;      /* patches' nodes, n x nf */
  PetscReal *normal;          /* n x 3, of the patches (for a pair: of its nodes); 0: unknown */
  PetscReal *outward;         /* by node and slot x 3, outward normal of the slave's surface; 0: unknown */
  PetscInt n_slots, *slot;    /* nodes on an edge of the slave, HYCO_SIDES * node + side, ascending: in searches the
                                 slave n_nodes + j is the j-th of them, with its own normal */
  PetscReal *own;             /* X with the slots' positions; NULL: there are none */
  PetscInt edges;             /* as in HycoSurfaceFacts */
  PetscInt n_border, *border; /* edges (2D: ends) of one facet only, as sorted pairs of nodes; created when needed */
  PetscBool *at_border;       /* by node; NULL: not created */
} HycoMasterSearch;
/* -- end: in exported models too -- */

/* Creates the search on fe's nodes; edges: as in HycoSurfaceFacts. The caller destroys it. */
PetscErrorCode HycoMasterSearchCreate(HycoFE fe, HycoContact contact, PetscBool nodes, PetscInt edges,
                                      HycoMasterSearch *search);
/* The same between two groups, whose edges have no sides. */
PetscErrorCode HycoMasterSearchCreateOn(HycoFE fe, PetscInt slave, PetscInt master, PetscBool nodes,
                                        HycoMasterSearch *search);
PetscErrorCode HycoMasterSearchDestroy(HycoMasterSearch *search);
/* Creates the tree of the patches, unless it exists: before the first projection. */
PetscErrorCode HycoMasterSearchReady(HycoMasterSearch *search);
/* The node and the side of a slave of the search; the slave of a side (HYCO_ONE_SIDE: the node as a whole). */
static inline PetscInt HycoMasterSearchNode(const HycoMasterSearch *search, PetscInt slave)
{
  return slave < search->n_nodes ? slave : search->slot[slave - search->n_nodes] / HYCO_SIDES;
}
static inline PetscInt HycoMasterSearchSide(const HycoMasterSearch *search, PetscInt slave)
{
  return slave < search->n_nodes ? HYCO_ONE_SIDE : search->slot[slave - search->n_nodes] % HYCO_SIDES;
}
PetscInt HycoMasterSearchSlave(const HycoMasterSearch *search, PetscInt node, PetscInt side);
/* The slaves first .. first + n - 1 of a contact: its side, or, without one, all sides of its node. */
void HycoMasterSearchSides(const HycoMasterSearch *search, PetscInt node, PetscInt side, PetscInt *first, PetscInt *n);
/* Frees what was created when it was needed: the tree and the border. */
PetscErrorCode HycoMasterSearchForget(HycoMasterSearch *search);
/* The slave node's outward normal; NULL: unknown, because its group is not a surface. */
const PetscReal *HycoMasterSearchOutward(const HycoMasterSearch *search, PetscInt slave);
/* The nearest point of the master; n = 0 if its normal does not oppose the slave's, unless any_side. */
void HycoMasterSearchProject(const HycoMasterSearch *search, PetscInt slave, PetscBool any_side, HycoProjection *at);
/* The vector from the slave node to that point. */
void HycoMasterSearchAcross(const HycoMasterSearch *search, PetscInt slave, const HycoProjection *at, PetscReal r[3]);
/* Whether a point is on the master's border: on an edge with one facet, or at a node of such an edge. */
PetscErrorCode HycoMasterSearchAtBorder(HycoMasterSearch *search, const HycoProjection *at, PetscBool *border);
/* The same, once the border is there (HycoMasterSearchBorder()). */
PetscBool HycoMasterSearchOnBorder(const HycoMasterSearch *search, const HycoProjection *at);
PetscErrorCode HycoMasterSearchBorder(HycoMasterSearch *search);
/* Whether a slave node is beside its facet by more than a tenth of the facet's shortest edge in its plane: past the
   border, if the point is on it. */
PetscBool HycoMasterSearchIsOutside(const HycoMasterSearch *search, PetscInt slave, const HycoProjection *at);
/* Whether a slave node is past the master's border, by more than a tenth of the facet's shortest edge in its plane. */
PetscErrorCode HycoMasterSearchIsPast(HycoMasterSearch *search, PetscInt slave, const HycoProjection *at,
                                      PetscBool *past);

/* Position of a slave node relative to the master: within reach and in front of it; too far; all of the master
   turned away; to the side, as for a pair that does not match; past the border. */
typedef enum { HYCO_FOUND, HYCO_FAR, HYCO_TURNED, HYCO_ASKEW, HYCO_PAST } HycoVerdict;

/* The n slave nodes with their masters (at[k].n = 0: none), at most `tolerance` away; below `small`, a tenth of the
   slave's shortest edge, they touch. */
typedef struct {
  PetscInt n;
  PetscInt *slave;
  PetscReal tolerance, small;
  HycoProjection *at;
  HycoVerdict *why;
  PetscBool part; /* they are those of this rank, of whose master only a part is here */
} HycoMatch;

/* The queries of a search, as drawn or (moved) on surfaces that a map moves: there the verdict is HYCO_FOUND, and n = 0
   where the nearest point is farther than the tolerance, turned away or past the border. */
typedef struct {
  PetscBool moved;
  PetscReal tolerance, small; /* as in HycoMatch; small: as drawn */
} HycoQuery;

/* The masters of n slave nodes. */
PetscErrorCode HycoMasterSearchFind(HycoMasterSearch *search, const HycoQuery *query, PetscInt n,
                                    const PetscInt slave[], HycoProjection at[], HycoVerdict why[]);
/* The same of one contact, the best over the sides of the node that it stands for; whether a result is better than
   another: it has a master, and a nearer one, or looks at one that is too far. */
PetscErrorCode HycoMasterSearchNearest(HycoMasterSearch *search, const HycoQuery *query, PetscInt node, PetscInt side,
                                       HycoProjection *at, HycoVerdict *why);
PetscBool HycoVerdictIsBetter(const HycoProjection *at, HycoVerdict why, const HycoProjection *best, HycoVerdict other);
/* Slaves that are too far and lie on a side of a body none of whose slaves has a master (met), while others have: they
   count as turned away, like the sides that look elsewhere. On whole surfaces. */
PetscErrorCode HycoMasterSearchForgive(const HycoMasterSearch *search, PetscInt n, const PetscInt slave[],
                                       const PetscBool met[], HycoVerdict why[]);
/* A type's choice of masters from the nearest points. */
typedef PetscErrorCode (*HycoSettle)(HycoMasterSearch *search, HycoContact contact, HycoMatch *match);
/* What to do about n slave nodes without a master, as the end of a message. */
typedef PetscErrorCode (*HycoRemedy)(HycoMasterSearch *search, HycoContact contact, PetscInt n, const PetscInt node[],
                                     char text[HYCO_LINE]);

/* The master of one slave node, at most `tolerance` away. Beyond `small`, the direction to it must be within the
   angle for opposed normals of the slave's normal, and must not lead past the border. */
PetscErrorCode HycoMasterSearchJudge(HycoMasterSearch *search, PetscInt slave, PetscReal tolerance, PetscReal small,
                                     HycoProjection *at, HycoVerdict *why);
/* Adds all slave nodes with their masters to pairs; settle NULL: without masters, which are searched for elsewhere. */
PetscErrorCode HycoMasterSearchMatch(HycoContact contact, HycoFE fe, PetscInt index, PetscBool nodes, HycoSettle settle,
                                     HycoRemedy remedy, HycoPairs *pairs);
/* The entries of a type with slave and master. */
PetscErrorCode HycoMasterSearchDeclare(HycoContact contact);

#endif
