/* HycoContact's struct, and HycoPairs: the potential contacts of a mesh with their rows of B and gaps D. */
#ifndef HYCOCONTACTIMPL_H
#define HYCOCONTACTIMPL_H

#include <hycocontact.h>
#include <hycofe.h>

struct _p_HycoContact {
  PETSCHEADER(struct _HycoContactOps);
  /* what the type declares */
  HycoDeclared entries;
  void *data;
  /* entries that the library reads, after HycoContactComplete(); borrowed */
  const char *name, *slave, *master; /* the last two: groups; master NULL: no masters */
  HycoExpr normal[3], gap;           /* NULL: not given */
  PetscBool rigid; /* set by the type: the master is a node that a rigid body moves with, whose surface the normals and
                      gaps at the slaves give; its equilibrium has the forces of all of the contact's nodes */
};

/* After the scene's entries are read: fails where one that is required is missing. */
PetscErrorCode HycoContactComplete(HycoContact contact);
/* Whether normals are averaged from the slave's facets. */
PetscBool HycoContactAverages(HycoContact contact);
/* Whether the rows of B, the gaps change where the parameters p with changed[p] do; adds to *rows, *gaps. */
void HycoContactChanges(HycoContact contact, const PetscBool changed[], PetscBool *rows, PetscBool *gaps);
/* Whether the contact's groups are in the mesh, and surfaces where they must be. */
PetscErrorCode HycoContactCheckGroups(HycoContact contact, HycoMesh mesh);

PetscErrorCode HycoContactCreate_Obstacle(HycoContact contact);
PetscErrorCode HycoContactCreate_Pair(HycoContact contact);
PetscErrorCode HycoContactCreate_Surface(HycoContact contact);
PetscErrorCode HycoContactCreate_Rigid(HycoContact contact);

/* The scene's ties on a mesh that has all nodes and facets of their surfaces; fails for nodes that have no master, and
   where a node that others follow follows another. NULL: none. The caller destroys them. */
PetscErrorCode HycoTiesFind(HycoScene scene, HycoMesh mesh, HycoTies *ties);

/* -- potential contacts: all on one process, over a mesh that has every contact node -- */

/*
  N_lambda contacts in the order of the scene's contacts, then of the slave's tag. A contact's master point is the sum
  of weight[j] times node master[j], j in master_start[k] .. master_start[k+1] - 1: no node for an obstacle, one of
  weight 1 for a pair, up to four (of a facet, ascending, weights positive with sum 1) on a surface.

  On surfaces that a map moves every slave node is a contact, and its master point is searched for where the nodes are:
  HycoPairsMove(). There a slave node that faces no master has no node either: its row of B is empty.
*/
typedef struct {
  PetscBool moved; /* a map may move the surfaces of this contact */
  PetscReal reach; /* then: how far from its slave a master point may be; PETSC_MAX_REAL: as far as it is */
} HycoSearch;

typedef struct _n_HycoPairs {
  PetscInt n;
  PetscInt *slave;   /* node indices */
  PetscInt *contact; /* index in scene->contact */
  PetscInt *master_start, *master;
  PetscReal *weight;
  PetscInt room;  /* most masters of a contact on moved surfaces; 0: none is moved, all were found once and for all */
  PetscInt place; /* that of the nodes at the last search (HycoFE) */
  PetscInt n_searches;
  HycoSearch *search; /* by contact of the scene; NULL where room is 0 */
} HycoPairs;

/* Contacts on the nodes as drawn: where no map moves the surfaces they are final, and a slave node without a master is
   an error. */
PetscErrorCode HycoPairsFind(HycoScene scene, HycoMesh mesh, HycoPairs *pairs);
/* Takes contacts of tied nodes out whose masters have the contact too: they move by these. Fails for other tied nodes
   of contacts. */
PetscErrorCode HycoPairsDropTied(HycoScene scene, HycoMesh mesh, HycoPairs *pairs);
PetscErrorCode HycoPairsDestroy(HycoPairs *pairs);
/* Searches for the masters of moved surfaces on fe's nodes, if those have moved since; fe's mesh has the pairs' nodes
   and the facets that may be masters. What works with the contacts at fe's parameters calls it itself. */
PetscErrorCode HycoPairsMove(HycoFE fe, HycoPairs *pairs);
/* Gives pairs their search where a map moves surfaces, on a mesh that has all nodes of these; else leaves it out. */
PetscErrorCode HycoPairsSetSearch(HycoScene scene, HycoMesh mesh, HycoPairs *pairs);
/* Whether a map moves the surfaces of the scene's contact number `contact`; whether contact k is on such. */
static inline PetscBool HycoPairsFollows(const HycoPairs *pairs, PetscInt contact)
{
  return (PetscBool)(pairs->room && pairs->search[contact].moved);
}
static inline PetscBool HycoPairsMoved(const HycoPairs *pairs, PetscInt k)
{
  return HycoPairsFollows(pairs, pairs->contact[k]);
}
/* How far from its slave a master point on moved surfaces may be, by contact of the scene; NULL: no change. */
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
/* One past the last contact of the same contact of the scene as k. */
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
/* Room for n more contacts of `width` masters, and one more of them. Contacts come in the order of the scene's. */
PetscErrorCode HycoPairsReserve(HycoPairs *pairs, PetscInt n, PetscInt width);
void HycoPairsAppend(HycoPairs *pairs, PetscInt contact, PetscInt slave, PetscInt n, const PetscInt node[],
                     const PetscReal weight[]);
/* The contacts which[0..n), ascending, with node i called index[i] (NULL: as it is), and their search. The caller
   destroys it. */
PetscErrorCode HycoPairsSelect(const HycoPairs *pairs, PetscInt n, const PetscInt which[], const PetscInt index[],
                               HycoPairs *out);
/* The same contacts with node i called index[i]. The caller destroys it. */
PetscErrorCode HycoPairsRenumber(const HycoPairs *pairs, const PetscInt index[], HycoPairs *out);
/* Sets node[i] for every slave and master node; the others are left alone. */
void HycoPairsMark(const HycoPairs *pairs, PetscBool node[]);
/* The most nodes of one contact: a row of B has at most dim times as many entries. */
PetscInt HycoPairsWidth(const HycoPairs *pairs);
/* Normals n (n x 3) and gaps D (n) at fe's mu: given ones are evaluated at the master point (obstacle: the slave), a
   measured gap is n . (master point - slave), on moved nodes. Fails where surfaces overlap more than the scene allows,
   and where a pair's nodes no longer face each other. */
PetscErrorCode HycoContactGeometry(HycoFE fe, HycoPairs *pairs, PetscReal normal[], PetscReal gap[]);
/*
  The rows of B over the free unknowns, in CSR over local dofs (node * dim + component), and D less what the fixed
  unknowns contribute: start[n + 1], dof[], value[] (room for HycoPairsWidth() dim n entries). Fails when a row has no
  free unknown and the prescribed displacements penetrate.
*/
PetscErrorCode HycoContactRows(HycoFE fe, HycoPairs *pairs, PetscInt start[], PetscInt dof[], PetscReal value[],
                               PetscReal gap[]);
/* How many contacts have no free unknown and no effect: empty rows, and the fixed nodes at obstacles that are no
   contacts; fails when the prescribed displacements of one of these penetrate. start: of the rows. */
PetscErrorCode HycoContactCountStill(HycoFE fe, const HycoPairs *pairs, const PetscInt start[], PetscInt *n);
/* The gap that stands for an empty row: it is positive and of the mesh's scale, and says nothing. */
PetscReal HycoContactNoGap(HycoFE fe);
/* What there is to know about the contacts of a solution u (n_dof), L (pairs->n, or where index leads). */
typedef struct {
  PetscInt n_facing; /* contacts that may close: slave nodes that face a master, and those of obstacles */
  PetscReal overlap; /* largest initial overlap, the gap negative before any displacement */
  PetscReal sliding; /* largest relative motion of a closed contact along its surface, over the size of a facet */
} HycoContactState;
PetscErrorCode HycoContactMeasure(HycoFE fe, HycoPairs *pairs, const PetscReal u[], const PetscReal L[],
                                  const PetscInt *index, HycoContactState *state);
/*
  The combinations of `motions` that frictionless contact does not hold by the shape of the surfaces: at every contact
  the motion is tangential, by more than faceting explains to no normal, to the slave's surface, to the master's, or to
  the given normal's plane. unheld: coefficients (n x motions->n, orthonormal) of all of them; names by
  HycoMotionsName() of each. alike: of the largest set that is tangential in one and the same sense, to be released by
  turning normals. The caller frees both.
*/
PetscErrorCode HycoFEFindUnheld(HycoFE fe, HycoPairs *pairs, const HycoMotions *motions, PetscInt *n_unheld,
                                PetscReal **unheld, PetscInt *n_alike, PetscReal **alike);
/* The longest edge around each node (n_nodes) of the facets of `group`; 0 where it has none. */
void HycoSurfaceSizes(HycoFE fe, PetscInt group, PetscReal size[]);
/* Area (length in 2D, 1 in 1D) that each contact's slave node stands for; 0 when its group is no surface. */
PetscErrorCode HycoContactAreas(HycoFE fe, const HycoPairs *pairs, PetscReal area[]);
/* What the contacts of the scene carry (result: room for all of them; names borrowed from the scene) at fe's mu, with
   the normals, areas and forces (pairs->n) of its potential contacts; those of at most `least` do not press. */
void HycoContactResults(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal area[],
                        const PetscReal lambda[], PetscReal least, HycoContactResult result[]);
/* The nodes of the contacts and, where masters lie between nodes, all of the master's group. */
PetscErrorCode HycoPairsMarkSurfaces(HycoScene scene, HycoMesh mesh, const HycoPairs *pairs, PetscBool node[]);

#endif
