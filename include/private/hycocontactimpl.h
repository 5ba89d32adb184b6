/* HycoContact's struct, and HycoPairs: the potential contacts of a mesh with their rows of B and gaps D. */
#ifndef HYCOCONTACTIMPL_H
#define HYCOCONTACTIMPL_H

#include <hycocontact.h>
#include <hycofe.h>

struct _p_HycoContact {
  PETSCHEADER(struct _HycoContactOps);
  /* entries declared by the type */
  HycoDeclared entries;
  void *data;
  /* entries that the library reads, set after HycoContactComplete(); borrowed */
  const char *name, *slave, *master; /* slave, master: groups; master NULL: no masters */
  HycoExpr normal[3], gap, friction; /* NULL: not given */
  PetscBool matched;                 /* set by the type: no two contacts have the same master node */
  PetscBool integrated; /* set by the type: rows are integrals over the slave's facets around a node, with any
                                        number of masters */
  PetscBool rigid;      /* set by the type: the master is a node that moves with a rigid body, whose surface is given by
                      the normals and gaps at the slaves; its equilibrium sums the forces of all of the contact's
                      nodes */
};

/* After the scene's entries are read: fails if a required one is missing. */
PetscErrorCode HycoContactComplete(HycoContact contact);
/* Whether normals are averaged from the slave's facets. */
static inline PetscBool HycoContactAverages(HycoContact contact)
{
  return (PetscBool)(!contact->ops->normal && !contact->normal[0] && !contact->normal[1] && !contact->normal[2]);
}

PetscErrorCode HycoContactCreate_Obstacle(HycoContact contact);
PetscErrorCode HycoContactCreate_Pair(HycoContact contact);
PetscErrorCode HycoContactCreate_Surface(HycoContact contact);
PetscErrorCode HycoContactCreate_Mortar(HycoContact contact);
PetscErrorCode HycoContactCreate_Rigid(HycoContact contact);

/* Finds the scene's ties on a mesh that has all nodes and facets of their surfaces. Fails for a slave node without a
   master, and for a master node that is itself tied. NULL: none. The caller destroys them. */
PetscErrorCode HycoTiesFind(HycoScene scene, HycoMesh mesh, HycoTies *ties);

/* -- potential contacts: all on one process, on a mesh that has every contact node; or those of a rank's own slaves, on
   a mesh with the facets around these and around the masters that they may meet (HycoMeshRings()) -- */

/*
  N_lambda contacts in the order of the scene's contacts, then of the slave's tag. A contact's master point is the sum
  of weight[j] times node master[j], j in master_start[k] .. master_start[k+1] - 1: no node for an obstacle, one of
  weight 1 for a pair, up to four (of a facet, ascending, weights positive with sum 1) on a surface, any number with sum
  1 of a mortar.

  On surfaces that a map moves, every slave node is a contact, and HycoPairsMove() searches for its master point on the
  moved nodes. A slave node that faces no master then has no master nodes: its row of B is empty.
*/
typedef struct {
  PetscBool moved; /* a map may move the surfaces of this contact */
  PetscReal reach; /* largest distance of a master point from its slave on moved surfaces; PETSC_MAX_REAL: any */
  PetscInt edges;  /* as in HycoSurfaceFacts */
} HycoSearch;

/* What a rank's part of a contact's surfaces does not show of the whole ones. */
typedef struct {
  PetscBool moved; /* a map may move them */
  PetscReal small; /* a tenth of the shortest edge of the slave's facets; 0: it has none */
  PetscInt edges;  /* bits: HYCO_SLAVE_EDGE and so on (nearest.h) */
} HycoSurfaceFacts;

/* Friction in a solution, by contact: 3 components in the scene's axes. */
typedef struct {
  PetscReal *force; /* tangential force on the slave */
  PetscReal *slip;  /* sum of the slave's tangential displacements against the master while the contact was closed */
  PetscReal *work;  /* dissipated since the start; >= 0 */
  PetscReal *state; /* HYCO_OPEN, ... */
} HycoShear;
enum { HYCO_OPEN, HYCO_STICK, HYCO_SLIP };

/* A contact's side (HycoPairs) is one of those of its node, or HYCO_ONE_SIDE; with a mask of the facets that count,
   where others face nothing, it is 4 mask + side + 1. */
enum { HYCO_MASK_BITS = 28 };
static inline PetscInt HycoSideOf(PetscInt side)
{
  return side > HYCO_SIDES ? side % (HYCO_SIDES + 1) - 1 : side;
}
/* Whether a facet counts: of this side and rank at the node. */
static inline PetscBool HycoSideCounts(PetscInt side, PetscInt facet_side, PetscInt facet_rank)
{
  const PetscInt own = HycoSideOf(side), mask = side > HYCO_SIDES ? side / (HYCO_SIDES + 1) : 0;

  if (own != HYCO_ONE_SIDE && own != facet_side) return PETSC_FALSE;
  return (PetscBool)(!mask || (facet_rank < HYCO_MASK_BITS && (mask >> facet_rank & 1)));
}

typedef struct _n_HycoPairs {
  PetscInt n;
  PetscInt *slave;   /* node indices */
  PetscInt *contact; /* index in scene->contact */
  PetscInt *side;    /* HycoSideOf() of a slave on an edge: the side of the surface whose normal and area are the
                        contact's, else HYCO_ONE_SIDE, as where the scene gives the normal */
  PetscInt *master_start, *master;
  PetscReal *weight;
  /* masters of a contact on moved surfaces: most of those of one facet, of mortars as many as were met so far; 0: none
     is moved, all masters are final */
  PetscInt room;
  PetscInt place; /* place number (HycoFE) of the nodes at the last search */
  PetscInt n_searches;
  HycoSearch *search;  /* by contact of the scene; NULL where room is 0 */
  PetscInt *number;    /* of a rank's contacts: their numbers among those of all ranks; NULL: their own indices */
  PetscInt64 queries;  /* searches for a master so far */
  PetscReal *geometry; /* normals and gaps at the last HycoContactGeometry(), of fe->drawn; NULL: none */
  PetscInt drawn;
  const HycoShear *shear;        /* of the last solution; borrowed, not copied with the pairs; NULL: no friction */
  const HycoSurfaceFacts *facts; /* while the contacts of a rank's slaves are found (borrowed); else NULL */
} HycoPairs;

/* Finds the contacts of a DM, as HycoFECreate() takes it, on its nodes as drawn. Where no map moves the surfaces they
   are final, and a slave node without a master is an error. facts: of each contact of the scene, for the contacts of
   the slaves that this rank owns on its part of the surfaces; what all ranks must decide together is then left to
   HycoContactsSynchronise(), and what this rank alone cannot decide is an error. NULL: the DM has the whole
   surfaces. */
PetscErrorCode HycoPairsFind(HycoScene scene, DM dm, const HycoSurfaceFacts facts[], HycoPairs *pairs);
/* The facts about the surfaces of each contact of the scene (facts: scene->n_contacts). Collective. */
PetscErrorCode HycoContactsFacts(MPI_Comm comm, HycoScene scene, HycoMesh part, HycoSurfaceFacts facts[]);
/* The masters' nodes (numbers in the distributed vectors, perhaps repeated) that this rank's slaves may meet at the
   positions of fe, each rank's part of the mesh: with the facets around them a search has the result that it has on the
   whole surfaces. slack: by how many radii of the widest facet the nodes may move without further ones. The caller
   frees them. Collective. */
PetscErrorCode HycoContactsCandidates(MPI_Comm comm, HycoFE fe, PetscReal slack, PetscInt *n, PetscInt **node);
/* For each slave node the nearest node of the master, without any condition: pairs (n x 2), which a partition should
   leave together. The body of a rigid contact is in no pair: otherwise all of its surface would be on one rank. The
   caller frees them. */
PetscErrorCode HycoContactsNeighbours(HycoScene scene, HycoMesh mesh, PetscInt *n, PetscInt **pairs);
/* Whether the contacts that the ranks have found are those of the whole surfaces: each contact of the scene has some,
   of which not all are without a master, and nodes that must be matched are. If not, the whole surfaces give the
   contacts or the error. Collective. */
PetscErrorCode HycoContactsSynchronise(MPI_Comm comm, HycoScene scene, HycoMesh part, HycoMesh surface,
                                       const HycoPairs *pairs, PetscBool *agreed);
/* Removes contacts of tied nodes whose masters belong to the same contact: these move with their masters. Fails for
   other tied nodes of contacts. */
PetscErrorCode HycoPairsDropTied(HycoScene scene, HycoMesh mesh, HycoPairs *pairs);
PetscErrorCode HycoPairsDestroy(HycoPairs *pairs);
/* Searches for the masters of moved surfaces on fe's nodes, if these have moved since the last search; fe's mesh has
   the pairs' nodes and all facets that may be masters. Functions that use the contacts at fe's parameters call it
   themselves. */
PetscErrorCode HycoPairsMove(HycoFE fe, HycoPairs *pairs);
/* Creates the pairs' search if a map moves surfaces, on a mesh that has all of their nodes, or from pairs->facts; does
   nothing otherwise. */
PetscErrorCode HycoPairsSetSearch(HycoScene scene, HycoMesh mesh, HycoPairs *pairs);
/* Whether a map moves the surfaces of contact number `contact` of the scene; whether it moves those of contact k. */
static inline PetscBool HycoPairsFollows(const HycoPairs *pairs, PetscInt contact)
{
  return (PetscBool)(pairs->room && pairs->search[contact].moved);
}
static inline PetscBool HycoPairsMoved(const HycoPairs *pairs, PetscInt k)
{
  return HycoPairsFollows(pairs, pairs->contact[k]);
}
/* Sets how far a master point on moved surfaces may be from its slave, by contact of the scene; NULL: no change. */
void HycoPairsSetReach(HycoPairs *pairs, const PetscReal reach[]);
/* The slave node of contact k. */
static inline PetscInt HycoPairsSlave(const HycoPairs *pairs, PetscInt k)
{
  return pairs->slave[k];
}
/* Whether contact k is a slave node that faces no master. */
static inline PetscBool HycoPairsAlone(HycoScene scene, const HycoPairs *pairs, PetscInt k)
{
  return (PetscBool)(pairs->master_start[k] == pairs->master_start[k + 1] && scene->contact[pairs->contact[k]]->master);
}
/* One past the last contact that belongs to the same contact of the scene as k. */
static inline PetscInt HycoPairsRun(const HycoPairs *pairs, PetscInt k)
{
  PetscInt next = k + 1;

  while (next < pairs->n && pairs->contact[next] == pairs->contact[k]) next++;
  return next;
}
/* The masters of contact k: *n nodes with weights. Borrowed. */
static inline void HycoPairsMasters(const HycoPairs *pairs, PetscInt k, PetscInt *n, const PetscInt *node[],
                                    const PetscReal *weight[])
{
  *n = pairs->master_start[k + 1] - pairs->master_start[k];
  *node = pairs->master + pairs->master_start[k];
  *weight = pairs->weight + pairs->master_start[k];
}
/* value(slave) - sum of weights times value(master) of contact k, for `dim` values a node; the rest of d is 0. */
void HycoPairsJump(const HycoPairs *pairs, PetscInt k, PetscInt dim, const PetscReal value[], PetscReal d[3]);
/* Allocates n more contacts of `width` masters; adds one contact, or masters to the last one. Contacts are added in the
   order of the scene's. */
PetscErrorCode HycoPairsReserve(HycoPairs *pairs, PetscInt n, PetscInt width);
void HycoPairsAppend(HycoPairs *pairs, PetscInt contact, PetscInt slave, PetscInt side, PetscInt n,
                     const PetscInt node[], const PetscReal weight[]);
void HycoPairsAddMasters(HycoPairs *pairs, PetscInt n, const PetscInt node[], const PetscReal weight[]);
/* The contacts which[0..n) with node i renumbered as index[i] (NULL: unchanged), and their search and numbers. The
   caller destroys it. */
PetscErrorCode HycoPairsSelect(const HycoPairs *pairs, PetscInt n, const PetscInt which[], const PetscInt index[],
                               HycoPairs *out);
/* The same contacts with node i renumbered as index[i]. The caller destroys it. */
PetscErrorCode HycoPairsRenumber(const HycoPairs *pairs, const PetscInt index[], HycoPairs *out);
/* Sets node[i] for every slave and master node; leaves the others unchanged. */
void HycoPairsMark(const HycoPairs *pairs, PetscBool node[]);
/* The most nodes of one contact: a row of B has at most dim times as many entries. */
PetscInt HycoPairsWidth(const HycoPairs *pairs);
/* Normals n (n x 3) and gaps D (n) at fe's mu: given ones are evaluated at the master point (obstacle: the slave), a
   measured gap is n . (master point - slave), on moved nodes. Fails if surfaces overlap more than the scene allows,
   or if a pair's nodes no longer face each other. */
PetscErrorCode HycoContactGeometry(HycoFE fe, HycoPairs *pairs, PetscReal normal[], PetscReal gap[]);
/* Rows of B over the free unknowns, in CSR over local dofs (node * dim + component), and gaps D. Zero before the first
   use; the functions that compute them also give them room, because mortars may meet more masters at each position. */
typedef struct {
  PetscInt *start, *dof, n, room; /* n: rows; room: of dof and value */
  PetscReal *value, *gap;
  PetscBool filled; /* HycoContactRows() was called */
} HycoRows;
PetscErrorCode HycoRowsDestroy(HycoRows *rows);
/* The rows at fe's parameters, one for each contact, and D minus the contribution of the fixed unknowns; masters of
   moved surfaces are searched before. Fails if a row has no free unknown and the prescribed displacements penetrate. */
PetscErrorCode HycoContactRows(HycoFE fe, HycoPairs *pairs, HycoRows *rows);
/* The same with tangents: contact k has the rows row[k] .. row[k + 1] - 1, its normal, or its normal and dim - 1
   tangents (unit vectors: tangent, 2 x 3 reals a contact). The gap of a tangent's row is the displacement of the slave
   against the master along it in u (n_dof), minus the contribution of the fixed unknowns. */
PetscErrorCode HycoContactTangentRows(HycoFE fe, HycoPairs *pairs, const PetscInt row[], const PetscReal u[],
                                      PetscReal tangent[], HycoRows *rows);
/* Counts contacts that have no free unknown and no effect: empty rows, and fixed nodes at obstacles that are no
   contacts; fails if the prescribed displacements of one of these penetrate. start: of the rows. */
PetscErrorCode HycoContactCountStill(HycoFE fe, const HycoPairs *pairs, const PetscInt start[], PetscInt *n);
/* The gap that is stored for an empty row: positive, of the mesh's scale, and without meaning. */
PetscReal HycoContactNoGap(HycoFE fe);
/* Up to this size a distance between the surfaces as drawn is round-off, and counts as 0. */
PetscReal HycoContactTouches(HycoFE fe);
/* share[]: by contact of the scene whose given gap overlaps at every node by more than 1 % of an extent: the least
   overlap over the extent of its smaller body; else 0. fe: on all nodes of this rank, surface: on those of the
   contacts; gap: of the pairs, by HycoContactGeometry(). Collective. */
PetscErrorCode HycoContactInitialOverlap(MPI_Comm comm, HycoFE fe, HycoFE surface, const HycoPairs *pairs,
                                         const PetscReal gap[], PetscReal share[]);
/* Facts about the contacts of a solution u (n_dof), L (pairs->n entries, or by index). */
typedef struct {
  PetscInt n_facing; /* contacts that may close: slave nodes that face a master, and those at obstacles */
  PetscReal overlap; /* largest initial overlap, the gap negative before any displacement */
  PetscReal sliding; /* largest relative tangential motion of a closed contact, over the size of a facet */
} HycoContactFacts;
/* facet: as HycoContactFacets() gives them, of the contacts that no map moves; NULL: fe's mesh has the whole
   surfaces. */
PetscErrorCode HycoContactMeasure(HycoFE fe, HycoPairs *pairs, const PetscReal u[], const PetscReal L[],
                                  const PetscInt *index, const PetscReal facet[], HycoContactFacts *state);
/* The size of the facets over which the sliding of each contact is measured (pairs->n): the longest edge at the master,
   or else at the slave; 0: neither has any. */
PetscErrorCode HycoContactFacets(HycoFE fe, const HycoPairs *pairs, PetscReal facet[]);
/*
  Finds the combinations of `motions` that frictionless contact does not prevent because of the surfaces' shape: the
  motion is tangential at every contact, to within the faceting error, to a normal, the slave's surface, the master's,
  or the plane of the given normal. unconstrained: coefficients (n x motions->n, orthonormal) of all of them; names by
  HycoMotionsName() of each. alike: those of the largest set that is tangential in the same sense, which turned normals
  can release. The caller frees both. wide: on several ranks the surface with all facets around all nodes of fe's mesh,
  of which node i is node index[i] there (NULL: the same). The results are the same on all ranks. Collective.
*/
PetscErrorCode HycoFEFindUnconstrained(MPI_Comm comm, HycoFE fe, HycoFE wide, const PetscInt index[], HycoPairs *pairs,
                                       const HycoMotions *motions, PetscInt *n_unconstrained, PetscReal **unconstrained,
                                       PetscInt *n_alike, PetscReal **alike);
/* The longest edge around each node (n_nodes) of the facets of `group`; 0 where it has none. */
void HycoSurfaceSizes(HycoFE fe, PetscInt group, PetscReal size[]);
/* Tributary area (length in 2D, 1 in 1D) of each contact's slave node; 0 if its group is no surface. On an edge it is
   that of the contact's side, or, where the scene gives the normals (n x 3), of the sides that these leave. */
PetscErrorCode HycoContactAreas(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], PetscReal area[]);
/* Fails, on all processes, if a normal that the scene gives points into the slave's body or along its surface: at a
   slave that faces a master, or, without masters, at all. normal: of the pairs. Collective. */
PetscErrorCode HycoContactCheckNormals(MPI_Comm comm, HycoFE fe, const HycoPairs *pairs, const PetscReal normal[]);
/* The pressures of a process's contacts: forces over areas. A node without area, on the axis of an axisymmetric scene
   with cells of second order, has the mean pressure of itself and the middle of its facet. Collective. */
PetscErrorCode HycoContactPressures(MPI_Comm comm, HycoFE fe, const HycoPairs *pairs, const PetscReal area[],
                                    const PetscReal lambda[], PetscReal pressure[]);
/* Whether a quantity is of the part of a contact at the nodes of a group. */
static inline PetscBool HycoQuantityOfPart(const HycoQuantity *q)
{
  return (PetscBool)(q->kind >= HYCO_QUANTITY_FORCE && q->group);
}
/* How many results a scene has: of each contact, then of the part that each quantity is of. */
static inline PetscInt HycoSceneResults(HycoScene scene)
{
  return scene->n_contacts + scene->n_quantities;
}
/* Whether each potential contact (pairs->n) belongs to a quantity of contacts: its slave is of the quantity's contact
   and group. */
PetscErrorCode HycoPairsOfQuantity(HycoScene scene, HycoMesh mesh, const HycoPairs *pairs, const HycoQuantity *q,
                                   PetscBool of[]);
/* Fails if a quantity is of a part without contacts on all processes. Collective. */
PetscErrorCode HycoPairsCheckQuantities(MPI_Comm comm, HycoScene scene, HycoMesh mesh, const HycoPairs *pairs);
/* Results (result: HycoSceneResults(); names borrowed from the scene) at fe's mu, from the normals, areas, forces and
   pressures (pairs->n) of this process's potential contacts; a force of at most `least` counts as zero; without
   contacts the smallest pressure is PETSC_MAX_REAL. Not collective: the caller adds the processes. */
PetscErrorCode HycoContactResults(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal area[],
                                  const PetscReal lambda[], const PetscReal pressure[], PetscReal least,
                                  HycoContactResult result[]);
/* Marks the nodes of the contacts and, where masters lie between nodes, all of the master's group. */
PetscErrorCode HycoPairsMarkSurfaces(HycoScene scene, HycoMesh mesh, const HycoPairs *pairs, PetscBool node[]);

#endif
