/*
  The masters that slave nodes of moved surfaces meet over the parameters: at the training points, and at points of the
  ranges until these give no new ones. A purely geometric search, on a mesh of the surfaces without cells.
*/
#include <hycoalgorithms.h>
#include <hycodomain.h>
#include <hycovector.h>

#define MOST_POINTS 500 /* points of the ranges */
#define FRUITLESS   50  /* successive points without a new master after which the search ends */
/* A contact is followed up to this multiple of the longest distance that closed in training, plus a share of a
   facet. */
#define REACH_FACTOR 2
/* Distance beyond what closed in training up to which contacts are followed, in facets: half, as a master is known to
   half a facet. */
#define REACH_FACET 0.5

/* The slave nodes of moved surfaces, on a mesh of these surfaces. */
typedef struct {
  HycoMesh mesh;
  HycoFE fe;
  HycoPairs pairs;
  PetscInt *node; /* their nodes in the mesh from which they are cut */
  PetscInt *of;   /* contact of each of pairs */
} Surfaces;

static PetscErrorCode SurfacesDestroy(Surfaces *s)
{
  PetscFunctionBegin;
  PetscCall(HycoPairsDestroy(&s->pairs));
  PetscCall(HycoFEDestroy(&s->fe));
  if (s->mesh) PetscCall(HycoMeshDestroy(&s->mesh));
  HycoFreeAll(&s->of, &s->node);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slave and master of each contact that follows its master; pairs->room 0: no surface moves. */
PetscErrorCode HycoMovedGroups(HycoScene scene, HycoMesh m, const HycoPairs *pairs, PetscInt *n, PetscInt group[])
{
  PetscFunctionBegin;
  *n = 0;
  for (PetscInt k = 0; k < scene->n_contacts && pairs->room; k++) {
    if (!HycoPairsFollows(pairs, k)) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k]->slave, &group[(*n)++]));
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k]->master, &group[(*n)++]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The moved surfaces as a mesh without cells: geometry alone decides which masters a slave meets. */
static PetscErrorCode CutSurfaces(HycoScene scene, HycoMesh whole, const HycoPairs *pairs, HycoMesh *mesh)
{
  PetscInt *group, *extra, n_groups, n_extra = 0;
  PetscBool *on;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(2 * scene->n_contacts, &group, whole->n_nodes, &extra));
  PetscCall(PetscCalloc1(whole->n_nodes, &on));
  PetscCall(HycoMovedGroups(scene, whole, pairs, &n_groups, group));
  for (PetscInt g = 0; g < n_groups; g++) {
    for (PetscInt k = whole->group_start[group[g]]; k < whole->group_start[group[g] + 1]; k++)
      on[whole->group_node[k]] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < whole->n_nodes; i++) {
    if (on[i]) extra[n_extra++] = i;
  }
  /* No cell, all facets of the groups. */
  PetscCall(HycoSubmesh(scene, whole, 0, NULL, n_extra, extra, n_groups, group, mesh));
  PetscCall(PetscFree(on));
  PetscCall(PetscFree2(group, extra));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The moved contacts on a mesh of their surfaces, which is moved to many parameter values at little cost. One fe
   for thousands of parameter values: a full one would evaluate laws and loads each time. */
static PetscErrorCode SurfacesCreate(HycoScene scene, HycoMesh whole, const HycoPairs *all, Surfaces *s)
{
  PetscInt *index, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  /* Slave and master surfaces of moved contacts alone. */
  PetscCall(CutSurfaces(scene, whole, all, &s->mesh));
  PetscCall(HycoFECreate(scene, s->mesh->dm, &s->fe));
  PetscCall(PetscMalloc1(s->mesh->n_nodes, &s->node));
  PetscCall(HycoSubmeshNodes(s->mesh, whole, s->node));
  PetscCall(PetscMalloc1(whole->n_nodes, &index));
  /* Both directions: rows of the small mesh, nodes of the whole. */
  for (PetscInt i = 0; i < s->mesh->n_nodes; i++) index[s->node[i]] = i;
  PetscCall(PetscMalloc1(all->n, &s->of));
  for (PetscInt k = 0; k < all->n; k++) {
    /* The others keep the masters that they have as drawn. */
    if (HycoPairsMoved(all, k)) s->of[n++] = k;
  }
  PetscCall(HycoPairsSelect(all, n, s->of, index, &s->pairs));
  PetscCall(PetscFree(index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The distance from slave k to its master point. */
static PetscReal MasterReachDistance(const Surfaces *s, PetscInt k)
{
  PetscReal r[3];

  HycoPairsJump(&s->pairs, k, 3, s->fe->X, r);
  return HycoLength(r);
}

/* The longest edge of a group's facets, as drawn. An edge of nf nodes in a cycle; of facets of second order half
   edges, or diagonals. */
static PetscReal LongestEdge(HycoMesh m, PetscInt group)
{
  PetscReal longest = 0;

  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) {
    const PetscReal *x = m->xyz + 3 * m->facets[k], *y = m->xyz + 3 * m->facets[k / m->nf * m->nf + (k + 1) % m->nf];

    if (m->facet_group[k / m->nf] == group) longest = PetscMax(longest, HycoDistance(x, y));
  }
  return longest;
}

/* The farthest way over which a contact with a force has come, with a margin: masters beyond it cannot be met by one
   that closes. */
PetscErrorCode HycoMetReach(HycoScene scene, HycoMesh whole, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                            const PetscReal Lambda[], PetscReal reach[])
{
  Surfaces s;

  PetscFunctionBegin;
  PetscCall(SurfacesCreate(scene, whole, pairs, &s));
  for (PetscInt c = 0; c < scene->n_contacts; c++) reach[c] = -1;
  for (PetscInt q = 0; q < n; q++) {
    PetscCall(HycoFESetParameters(s.fe, mu + q * scene->n_parameters));
    PetscCall(HycoPairsMove(s.fe, &s.pairs));
    for (PetscInt k = 0; k < s.pairs.n; k++) {
      const PetscInt c = s.pairs.contact[k];

      /* Only contacts that carry a force: others may be at any distance. */
      if (Lambda[(size_t)q * (size_t)pairs->n + (size_t)s.of[k]] > 0 && !HycoPairsAlone(scene, &s.pairs, k))
        reach[c] = PetscMax(reach[c], MasterReachDistance(&s, k));
    }
  }
  for (PetscInt c = 0; c < scene->n_contacts; c++) {
    PetscInt g = 0;

    if (reach[c] < 0) {
      /* No solution closes it: nothing is known, and nothing is left out. */
      reach[c] = PETSC_MAX_REAL;
      continue;
    }
    PetscCall(HycoMeshFindGroup(whole, "contact", scene->contact[c]->slave, &g));
    reach[c] = REACH_FACTOR * reach[c] + REACH_FACET * LongestEdge(whole, g);
  }
  PetscCall(SurfacesDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters that slaves have met: lists of distinct sets of nodes, by slave. */
typedef struct {
  PetscInt n, room, *head; /* by contact of the surfaces: its last row, or -1 */
  struct {
    PetscInt n, first, next; /* its nodes: node[first .. first + n) */
  } * row;
  PetscInt n_nodes, room_nodes, *node;
} Lists;

/* Adds the contacts' current masters; *grown counts the new ones. l->head[k] begins the list of contact k, newest
   first; nodes of all lists are in one array. */
static PetscErrorCode MasterReachAddMasters(const HycoPairs *p, Lists *l, PetscInt *grown)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt *node;
    const PetscReal *weight;
    PetscInt r = l->head[k], n;
    PetscBool same = PETSC_FALSE;

    HycoPairsMasters(p, k, &n, &node, &weight);
    if (!n) continue;
    /* Few sets for each slave: a linear search of its list. */
    for (; r >= 0 && !same; r = l->row[r].next) {
      same = (PetscBool)(l->row[r].n == n);
      for (PetscInt a = 0; a < n && same; a++) same = (PetscBool)(l->node[l->row[r].first + a] == node[a]);
    }
    if (same) continue;
    HycoGrow(l->n, l->room, l->row);
    if (l->n_nodes + n > l->room_nodes) {
      l->room_nodes = 2 * (l->room_nodes + n) + 256;
      PetscCall(PetscRealloc((size_t)l->room_nodes * sizeof(*l->node), &l->node));
    }
    l->row[l->n].n = n;
    l->row[l->n].first = l->n_nodes;
    PetscCall(PetscArraycpy(l->node + l->n_nodes, node, n));
    l->n_nodes += n;
    l->row[l->n].next = l->head[k];
    l->head[k] = l->n++;
    (*grown)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the masters at these parameters to the lists; *grown counts what is new, so that the caller can stop when
   nothing is. */
static PetscErrorCode NoteAt(Surfaces *s, const PetscReal mu[], Lists *l, PetscInt *grown)
{
  PetscFunctionBegin;
  *grown = 0;
  PetscCall(HycoFESetParameters(s->fe, mu));
  PetscCall(HycoPairsMove(s->fe, &s->pairs));
  PetscCall(MasterReachAddMasters(&s->pairs, l, grown));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether parameter p moves a body. */
static PetscBool MasterReachIsMoving(HycoScene scene, PetscInt p)
{
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, moves = PETSC_FALSE;

  changed[p] = PETSC_TRUE;
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    for (PetscInt c = 0; c < 3; c++) moves = (PetscBool)(moves || HycoExprChanges(scene->body[b].map[c], changed));
  }
  return moves;
}

/* Adds points of the ranges, in the parameters that move something; the others as in mu. A Halton sequence in the
   parameters that move bodies; it ends when FRUITLESS points give no new master. HycoHalton() (Halton 1960) fills the
   ranges evenly for any number of points. */
static PetscErrorCode NoteBetween(Surfaces *s, HycoScene scene, const PetscReal mu[], Lists *l)
{
  const PetscInt n_par = scene->n_parameters;
  PetscReal at[HYCO_MAX_PARAMETERS];
  PetscInt fruitless = 0;

  PetscFunctionBegin;
  for (PetscInt k = 1; k <= MOST_POINTS && fruitless < FRUITLESS; k++) {
    PetscInt grown, moving = 0;

    for (PetscInt p = 0; p < n_par; p++) {
      at[p] = mu[p];
      if (MasterReachIsMoving(scene, p)) at[p] = scene->lo[p] + (scene->hi[p] - scene->lo[p]) * HycoHalton(k, moving++);
    }
    /* No parameter moves anything: training points are all there is. */
    if (!moving) break;
    PetscCall(NoteAt(s, at, l, &grown));
    fruitless = grown ? 0 : fruitless + 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts the lists to contacts on the whole mesh, after those on surfaces that are not moved. */
static PetscErrorCode MasterReachCollect(const Surfaces *s, const HycoPairs *pairs, const Lists *l, HycoMet *met)
{
  HycoPairs *out = &met->rows;
  const PetscInt most = pairs->n + l->n;
  PetscInt at = 0, widest = 0, *node;
  PetscReal *shares;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++)
    widest = PetscMax(widest, pairs->master_start[k + 1] - pairs->master_start[k]);
  for (PetscInt r = 0; r < l->n; r++) widest = PetscMax(widest, l->row[r].n);
  PetscCall(PetscMalloc2(widest, &node, widest, &shares));
  PetscCall(PetscMalloc1(most, &met->of));
  PetscCall(HycoPairsSelect(pairs, 0, NULL, NULL, out));
  PetscCall(HycoPairsReserve(out, most, widest));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscBool moved = HycoPairsMoved(pairs, k);
    const PetscInt *master;
    const PetscReal *weight;
    PetscInt n;

    HycoPairsMasters(pairs, k, &n, &master, &weight);
    if (!moved) met->of[out->n] = k;
    if (!moved) HycoPairsAppend(out, pairs->contact[k], pairs->slave[k], pairs->side[k], n, master, weight);
    for (PetscInt r = moved ? l->head[at] : -1; r >= 0; r = l->row[r].next) {
      for (PetscInt a = 0; a < l->row[r].n; a++) {
        node[a] = s->node[l->node[l->row[r].first + a]];
        /* Weights do not matter for the RID: only which nodes a row may read. */
        shares[a] = 1 / (PetscReal)l->row[r].n;
      }
      met->of[out->n] = k;
      HycoPairsAppend(out, pairs->contact[k], pairs->slave[k], pairs->side[k], l->row[r].n, node, shares);
    }
    at += moved;
  }
  PetscCall(PetscFree2(node, shares));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Training points first, which are certain to be visited; met->of: the contact of each row, since a moved one has
   several. */
PetscErrorCode HycoMetFind(HycoScene scene, HycoMesh whole, const HycoPairs *pairs, PetscInt n, const PetscReal mu[],
                           const PetscReal reach[], HycoMet *met)
{
  Surfaces s;
  Lists l = {0};
  PetscInt grown;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(met, sizeof(*met)));
  PetscCall(SurfacesCreate(scene, whole, pairs, &s));
  /* A slave's search is limited to distances that may close: far masters would enlarge the RID for nothing. */
  HycoPairsSetReach(&s.pairs, reach);
  PetscCall(PetscMalloc1(s.pairs.n, &l.head));
  for (PetscInt k = 0; k < s.pairs.n; k++) l.head[k] = -1;
  for (PetscInt k = 0; k < n; k++) PetscCall(NoteAt(&s, mu + k * scene->n_parameters, &l, &grown));
  if (n) PetscCall(NoteBetween(&s, scene, mu, &l));
  PetscCall(MasterReachCollect(&s, pairs, &l, met));
  HycoFreeAll(&l.head, &l.row, &l.node);
  PetscCall(SurfacesDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMetDestroy(HycoMet *met)
{
  PetscFunctionBegin;
  PetscCall(HycoPairsDestroy(&met->rows));
  PetscCall(PetscFree(met->of));
  PetscFunctionReturn(PETSC_SUCCESS);
}
