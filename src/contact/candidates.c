/*
  The nodes of the masters' surfaces that the slaves of each rank may meet. A rank's slave nodes are halved by recursive
  bisection (M. Berger, S. Bokhari, IEEE Trans. Comput. C-36 (1987) 570-580) into a tree of boxes. No slave is farther
  from its nearest point than the farthest corner of its box from any node of the master, so that facets farther away
  than the least of these distances cannot have it. Each rank tests the facets around its own nodes against all ranks'
  boxes, and sends the numbers of these nodes.
*/
#include "surface_normals.h"
#include "master_search.h"
#include <hycovector.h>

#define LEVELS  6
#define BLOCKS  (1 << LEVELS)    /* leaves of a rank's tree */
#define BOXES   (2 * BLOCKS - 1) /* its children of box b are 2 b + 1 and 2 b + 2 */
#define SAMPLES 256              /* nodes of the master that give the bound, of each rank */

/* A box of a tree; without slaves it has lo > hi. reach: how far a facet with their nearest points may be. */
typedef struct {
  PetscReal lo[3], hi[3], reach;
} Box;

typedef struct {
  MPI_Comm comm;
  PetscMPIInt size, rank;
  HycoFE fe;
  PetscInt slave, master;    /* groups */
  Box *tree;                 /* by rank, BOXES each */
  PetscReal margin, stretch; /* stretch: of the bound; more than 1 where the master is found along normals */
  PetscInt n, room, *node;   /* nodes that are sent, with their ranks */
  PetscMPIInt *to, *sent;    /* sent: by node of the part, the last rank, plus 1, to which it goes */
  PetscBool *on;             /* by node of the part: it has a facet of the master */
} Candidates;

/* A box begins with lo > hi, and grows with its points: a rank without slaves keeps it. */
static PetscBool IsEmpty(const Box *b)
{
  return (PetscBool)(b->lo[0] > b->hi[0]);
}

/* The distances of a point from the nearest and from the farthest point of a box. */
static void CandidatesDistances(const Box *b, const PetscReal x[3], PetscReal *least, PetscReal *most)
{
  PetscReal near[3], far[3];

  for (PetscInt c = 0; c < 3; c++) {
    near[c] = PetscMax(PetscMax(b->lo[c] - x[c], x[c] - b->hi[c]), 0);
    far[c] = PetscMax(b->hi[c] - x[c], x[c] - b->lo[c]);
  }
  *least = HycoLength(near);
  *most = HycoLength(far);
}

/* The tree of the points lo .. hi - 1 from box b on, halved along the longest side. */
static void CandidatesHalve(HycoPoint point[], PetscInt lo, PetscInt hi, PetscInt b, Box tree[])
{
  const PetscInt mid = (lo + hi) / 2;
  Box *box = &tree[b];
  PetscInt axis = 0;

  box->reach = PETSC_MAX_REAL;
  for (PetscInt c = 0; c < 3; c++) {
    box->lo[c] = PETSC_MAX_REAL;
    box->hi[c] = PETSC_MIN_REAL;
    for (PetscInt k = lo; k < hi; k++) {
      box->lo[c] = PetscMin(box->lo[c], point[k].x[c]);
      box->hi[c] = PetscMax(box->hi[c], point[k].x[c]);
    }
    axis = hi > lo && box->hi[c] - box->lo[c] > box->hi[axis] - box->lo[axis] ? c : axis;
  }
  /* A leaf. */
  if (b >= BLOCKS - 1) return;
  /* Empty halves still get their boxes: the tree is complete. */
  if (hi > lo) HycoPointsSplit(point, lo, mid, hi, axis);
  CandidatesHalve(point, lo, mid, 2 * b + 1, tree);
  CandidatesHalve(point, mid, hi, 2 * b + 2, tree);
}

/* The trees of all ranks. The boxes of this rank's own slaves, halved along their longest side, as leaves of a tree of
   fixed depth. */
static PetscErrorCode FindBoxes(Candidates *s)
{
  HycoMesh m = s->fe->mesh;
  HycoPoint *point;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->group_start[s->slave + 1] - m->group_start[s->slave], &point));
  for (PetscInt k = m->group_start[s->slave]; k < m->group_start[s->slave + 1]; k++) {
    const PetscInt i = m->group_node[k];

    if (HycoMeshOwned(m, i) < 0) continue;
    PetscCall(PetscArraycpy(point[n].x, s->fe->X + 3 * i, 3));
    point[n].index = n;
    n++;
  }
  CandidatesHalve(point, 0, n, 0, s->tree + (size_t)s->rank * BOXES);
  PetscCall(PetscFree(point));
  /* Every rank has all trees: 127 boxes per rank, whatever the mesh is. */
  PetscCallMPI(MPI_Allgather(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, s->tree, BOXES * sizeof(Box), MPI_BYTE, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lowers the reach of the leaves under a box to the distance of their farthest corners from a node of the master; that
   of a box is the largest under it. */
static void CandidatesLower(Box tree[], PetscInt b, const PetscReal x[3])
{
  Box *box = &tree[b];
  PetscReal least, most;

  if (IsEmpty(box)) return;
  CandidatesDistances(box, x, &least, &most);
  /* The node cannot lower any leaf in this box. */
  if (least >= box->reach) return;
  if (b >= BLOCKS - 1) {
    box->reach = PetscMin(box->reach, most);
    return;
  }
  CandidatesLower(tree, 2 * b + 1, x);
  CandidatesLower(tree, 2 * b + 2, x);
  box->reach = 0;
  for (PetscInt child = 2 * b + 1; child <= 2 * b + 2; child++) {
    if (!IsEmpty(&tree[child])) box->reach = PetscMax(box->reach, tree[child].reach);
  }
}

/* The reach of all boxes, from some of the master's nodes. */
static PetscErrorCode FindReach(Candidates *s)
{
  HycoMesh m = s->fe->mesh;
  const PetscInt first = m->group_start[s->master], n = m->group_start[s->master + 1] - first;
  PetscReal *reach;

  PetscFunctionBegin;
  /* A sample of the master's nodes of this rank is enough: each gives a valid bound, and more only tighten it. */
  for (PetscMPIInt r = 0; r < s->size; r++) {
    for (PetscInt k = 0; k < n; k += PetscMax(n / SAMPLES, 1))
      CandidatesLower(s->tree + (size_t)r * BOXES, 0, s->fe->X + 3 * m->group_node[first + k]);
  }
  PetscCall(PetscMalloc1((size_t)s->size * BOXES, &reach));
  for (PetscInt b = 0; b < s->size * BOXES; b++) reach[b] = s->tree[b].reach;
  /* Any rank's nodes of the master bound the distance. */
  HycoAllreduce(reach, s->size * BOXES, MPIU_REAL, MPI_MIN, s->comm);
  for (PetscInt b = s->size * BOXES - 1; b >= 0; b--) { /* children before their parents, whose reach is theirs */
    const PetscInt place = b % BOXES;
    Box *box = &s->tree[b], *child;

    if (IsEmpty(box)) continue;
    box->reach =
        s->stretch * reach[b] + s->margin + HYCO_LENGTH_ROUND_OFF * (HycoLength(box->lo) + HycoLength(box->hi));
    if (place >= BLOCKS - 1) continue;
    /* Its tree begins at b - place, where child 2 place + 1 lies place + 1 behind the box. */
    child = box + place + 1; /* 2 place + 1 in its tree */
    box->reach = PetscMax(IsEmpty(&child[0]) ? 0 : child[0].reach, IsEmpty(&child[1]) ? 0 : child[1].reach);
  }
  PetscCall(PetscFree(reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends a node of this rank to a rank; twice perhaps, where its facets are not near the same ranks. */
static PetscErrorCode CandidatesAdd(Candidates *s, PetscMPIInt rank, PetscInt node)
{
  PetscFunctionBegin;
  /* Each node is offered by its owner alone. */
  if (HycoMeshOwned(s->fe->mesh, node) < 0 || s->sent[node] == rank + 1) PetscFunctionReturn(PETSC_SUCCESS);
  s->sent[node] = rank + 1;
  if (s->n == s->room) {
    /* Doubling: the number of nodes near other ranks is not known before. */
    s->room = 2 * s->room + 256;
    PetscCall(PetscRealloc((size_t)s->room * sizeof(PetscInt), &s->node));
    PetscCall(PetscRealloc((size_t)s->room * sizeof(PetscMPIInt), &s->to));
  }
  s->to[s->n] = rank;
  s->node[s->n++] = s->fe->mesh->node_global[node];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a ball may have the nearest point of a slave under a box. */
static PetscBool IsNear(const Box tree[], PetscInt b, const PetscReal centre[3], PetscReal radius)
{
  PetscReal least, most;

  if (IsEmpty(&tree[b])) return PETSC_FALSE;
  CandidatesDistances(&tree[b], centre, &least, &most);
  /* Farther than any nearest point under this box can be. */
  if (least - radius > tree[b].reach) return PETSC_FALSE;
  if (b >= BLOCKS - 1) return PETSC_TRUE;
  return (PetscBool)(IsNear(tree, 2 * b + 1, centre, radius) || IsNear(tree, 2 * b + 2, centre, radius));
}

/* The ball around a facet's nodes. */
static PetscReal CandidatesBall(HycoFE fe, PetscInt facet, PetscReal centre[3])
{
  const PetscInt nf = fe->mesh->nf, *node = fe->mesh->facets + facet * nf;
  PetscReal radius = 0;

  for (PetscInt c = 0; c < 3; c++) {
    centre[c] = 0;
    for (PetscInt a = 0; a < nf; a++) centre[c] += fe->X[3 * node[a] + c] / nf;
  }
  for (PetscInt a = 0; a < nf; a++) radius = PetscMax(radius, HycoDistance(centre, fe->X + 3 * node[a]));
  return radius;
}

/* Where rows are integrals over the facets around a slave: these have points 2 radii R away, whose middles are as far
   from the master as the slave, plus R, and along the normal the master is farther than its nearest point is, by the
   limit of opposed normals. */
static PetscErrorCode WidenMargin(Candidates *s)
{
  HycoMesh m = s->fe->mesh;
  PetscReal most = 0, centre[3];

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] == s->slave) most = PetscMax(most, CandidatesBall(s->fe, f, centre));
  }
  HycoAllreduce(&most, 1, MPIU_REAL, MPI_MAX, s->comm);
  /* HYCO_OPPOSED is negative: the cosine of the largest angle at which normals face each other. */
  s->stretch = 1 / -HYCO_OPPOSED;
  s->margin += (3 + 3 * s->stretch) * most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How far beyond its bound a block searches: coincident points of HycoMasterSearchProject(), round-off, and `slack`
   times the widest facet. */
static PetscErrorCode FindMargin(Candidates *s, PetscBool integrated, PetscReal slack)
{
  HycoMesh m = s->fe->mesh;
  PetscReal most[2] = {0, 0}, centre[3]; /* radius, distance from the origin */

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    PetscReal radius;

    if (m->facet_group[f] != s->master) continue;
    radius = CandidatesBall(s->fe, f, centre);
    most[0] = PetscMax(most[0], radius);
    most[1] = PetscMax(most[1], HycoLength(centre) + radius);
  }
  /* The widest facet may be on another rank: every rank must search as far. */
  HycoAllreduce(most, 2, MPIU_REAL, MPI_MAX, s->comm);
  /* Round-off grows with the distance from the origin, not with the size of a facet. */
  s->margin = (2 * HYCO_SAME_POINT + slack) * most[0] + HYCO_LENGTH_ROUND_OFF * most[1];
  s->stretch = 1;
  if (integrated) PetscCall(WidenMargin(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends the nodes of near facets, and near nodes without a facet. */
static PetscErrorCode AddNear(Candidates *s)
{
  HycoMesh m = s->fe->mesh;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(s->on, m->n_nodes));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf;
    PetscReal centre[3], radius;

    if (m->facet_group[f] != s->master) continue;
    radius = CandidatesBall(s->fe, f, centre);
    /* A node of the group without a facet on this rank may still be a master of node pairs. */
    for (PetscInt a = 0; a < m->nf; a++) s->on[node[a]] = PETSC_TRUE;
    for (PetscMPIInt r = 0; r < s->size; r++) {
      /* The tree of boxes around the slaves of rank r: a facet's ball that meets none of them is not sent. */
      for (PetscInt a = 0; IsNear(s->tree + (size_t)r * BOXES, 0, centre, radius) && a < m->nf; a++)
        PetscCall(CandidatesAdd(s, r, node[a]));
    }
  }
  for (PetscInt k = m->group_start[s->master]; k < m->group_start[s->master + 1]; k++) {
    const PetscInt i = m->group_node[k];

    for (PetscMPIInt r = 0; r < s->size && !s->on[i]; r++) {
      if (IsNear(s->tree + (size_t)r * BOXES, 0, s->fe->X + 3 * i, 0)) PetscCall(CandidatesAdd(s, r, i));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends all nodes of the master to the ranks with slaves. A rigid body's master is one node, wherever it lies. Whether
   a rank has slaves is seen in the root of its tree, which is empty otherwise. */
static PetscErrorCode AddAll(Candidates *s)
{
  HycoMesh m = s->fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = m->group_start[s->master]; k < m->group_start[s->master + 1]; k++) {
    for (PetscMPIInt r = 0; r < s->size; r++) {
      if (!IsEmpty(&s->tree[(size_t)r * BOXES])) PetscCall(CandidatesAdd(s, r, m->group_node[k]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of master surfaces (numbers in the distributed vectors) that this rank's slaves may meet, for all
   contacts; slack: additional distance, in widths of a facet. The caller frees node[]. Collective. */
PetscErrorCode HycoContactsCandidates(MPI_Comm comm, HycoFE fe, PetscReal slack, PetscInt *n, PetscInt **node)
{
  HycoScene scene = fe->scene;
  Candidates s = {.comm = comm, .fe = fe};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &s.size));
  PetscCallMPI(MPI_Comm_rank(comm, &s.rank));
  PetscCall(PetscMalloc2((size_t)s.size * BOXES, &s.tree, fe->mesh->n_nodes, &s.on));
  PetscCall(PetscCalloc1(fe->mesh->n_nodes, &s.sent));
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    HycoContact c = scene->contact[k];
    PetscInt edges;

    if (!c->master) continue;
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &s.slave));
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->master, &s.master));
    /* Per contact: the ranks that a surface is near to differ. */
    PetscCall(PetscArrayzero(s.sent, fe->mesh->n_nodes));
    PetscCall(FindBoxes(&s));
    PetscCall(FindMargin(&s, c->integrated, slack));
    /* Where surfaces go round edges, a slave may face a part of the master that is not the nearest. */
    PetscCall(HycoContactEdges(scene, fe->mesh, c, &edges));
    HycoAllreduce(&edges, 1, MPIU_INT, MPI_BOR, comm);
    PetscCall(FindReach(&s));
    /* The one node of a rigid body is the master everywhere, too. */
    PetscCall(c->rigid || (edges & HYCO_EDGES) ? AddAll(&s) : AddNear(&s));
  }
  /* One exchange for all contacts. */
  PetscCall(HycoSendRows(comm, s.n, s.to, sizeof(PetscInt), s.node, n, node));
  PetscCall(PetscFree2(s.tree, s.on));
  HycoFreeAll(&s.sent, &s.node, &s.to);
  PetscFunctionReturn(PETSC_SUCCESS);
}
