/*
  Finds the masters of a contact's slave nodes on the mesh as drawn: projections on the other surface, checked by the
  orientation of the two; nodes without a master are listed. The types pass functions for what differs.
*/
#include "surface_normals.h"
#include "master_search.h"
#include <stdlib.h>
#include <string.h>

/* A slave node without a master. */
typedef struct {
  PetscReal distance;
  PetscInt node;
  HycoVerdict why;
} Missed;

/* Equal distances by node, for one message on any number of ranks. */
static int FarthestFirst(const void *a, const void *b)
{
  const Missed *p = (const Missed *)a, *q = (const Missed *)b;

  if (p->distance != q->distance) return p->distance > q->distance ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

/* Angle in degrees between a slave's normal and the direction to its master point, or between opposed normals. */
static PetscReal PairingAngle(const HycoMasterSearch *t, PetscInt slave, HycoVerdict why, const HycoProjection *at)
{
  const PetscReal *out = HycoMasterSearchOutward(t, slave);
  PetscReal r[3], cosine = -HycoDot(out, t->normal + 3 * at->patch);

  HycoMasterSearchAcross(t, slave, at, r);
  if (why == HYCO_ASKEW) cosine = PetscAbsReal(HycoDot(out, r)) / at->distance;
  return PetscAcosReal(PetscMax(PetscMin(cosine, 1), -1)) * 180 / PETSC_PI;
}

/* "12 (0.5 away, past its border)" */
static PetscErrorCode PairingDescribe(HycoMasterSearch *t, const Missed *missed, size_t room, char text[])
{
  HycoProjection at;
  PetscBool border = PETSC_FALSE;
  size_t used;

  PetscFunctionBegin;
  HycoMasterSearchProject(t, missed->node, PETSC_FALSE, &at);
  /* First among facets that face it, then among all: the message needs a distance in any case. */
  if (!at.n) HycoMasterSearchProject(t, missed->node, PETSC_TRUE, &at);
  PetscCall(HycoMasterSearchAtBorder(t, &at, &border));
  snprintf(text, room, "%d (%.4g away%s", (int)t->fe->mesh->node_id[HycoMasterSearchNode(t, missed->node)],
           (double)at.distance, border ? ", past its border" : "");
  used = strlen(text);
  if (missed->why == HYCO_TURNED || missed->why == HYCO_ASKEW)
    snprintf(text + used, room - used, ", %.0f degrees %s", (double)PairingAngle(t, missed->node, missed->why, &at),
             missed->why == HYCO_TURNED ? "turned away from it" : "off the normal");
  PetscCall(PetscStrlcat(text, ")", room));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails with the number n of slave nodes without a master, the five farthest of them, and the remedy. */
static PetscErrorCode PairingReportUnmatched(HycoMasterSearch *t, HycoContact c, HycoRemedy remedy, PetscInt n,
                                             Missed missed[], const HycoMatch *m)
{
  char list[HYCO_LINE / 2] = "", what[HYCO_LINE];
  PetscInt *node;

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchReady(t));
  /* The farthest first: they show what is wrong with the surfaces. */
  qsort(missed, (size_t)n, sizeof(Missed), FarthestFirst);
  for (PetscInt k = 0; k < PetscMin(n, 5); k++) {
    char one[HYCO_LINE / 2];

    PetscCall(PairingDescribe(t, &missed[k], sizeof(one), one));
    if (k) PetscCall(PetscStrlcat(list, ", ", sizeof(list)));
    PetscCall(PetscStrlcat(list, one, sizeof(list)));
  }
  PetscCall(PetscMalloc1(n, &node));
  for (PetscInt k = 0; k < n; k++) node[k] = missed[k].node; /* slaves of the search */
  /* The type knows what helps: another tolerance, another type, other surfaces. */
  PetscCall((*remedy)(t, c, n, node, what));
  PetscCall(PetscFree(node));
  HycoFail("contact %s: %d of the %d nodes of %s have no %s of %s within %g: %snode%s %s; %s", c->name, (int)n,
           (int)m->n, c->slave, t->nodes ? "node" : "point", c->master, (double)m->tolerance,
           n > 5 ? "the farthest are " : "", n > 1 ? "s" : "", list, what);
}

/* Checks that no node is on both surfaces. */
static PetscErrorCode CheckApart(const HycoMasterSearch *t, HycoContact c)
{
  HycoMesh m = t->fe->mesh;
  PetscBool *master;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &master));
  /* A node on both sides would be in contact with itself. */
  for (PetscInt k = 0; k < t->n * t->nf; k++) master[t->node[k]] = PETSC_TRUE;
  for (PetscInt k = m->group_start[t->slave]; k < m->group_start[t->slave + 1]; k++)
    HycoCheck(!master[m->group_node[k]],
              "contact %s: node %d is in both %s and %s; the two surfaces must not share nodes", c->name,
              (int)m->node_id[m->group_node[k]], c->slave, c->master);
  PetscCall(PetscFree(master));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if no slave node has a master: with the distance of the nearest one that faces it, if any does. For the type
   surface with a tolerance, where nodes that face nothing are allowed, but not all of them. */
static PetscErrorCode RefuseAll(HycoMasterSearch *t, HycoContact c, const HycoMatch *m)
{
  PetscReal nearest = PETSC_MAX_REAL;
  PetscInt node = -1;

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchReady(t));
  for (PetscInt k = 0; k < m->n; k++) {
    HycoProjection at;
    HycoVerdict why;

    PetscCall(HycoMasterSearchJudge(t, m->slave[k], PETSC_MAX_REAL, 0, &at, &why));
    /* Of those that face the master: the others need another remedy. */
    if (why != HYCO_FOUND || at.distance >= nearest) continue;
    nearest = at.distance;
    node = m->slave[k];
  }
  HycoCheck(node >= 0, "contact %s: no node of %s faces %s within %g; check that these are the surfaces in contact",
            c->name, c->slave, c->master, (double)m->tolerance);
  HycoFail("contact %s: no node of %s is within contact_%s_tolerance %g of %s; the nearest that faces it, node %d, is "
           "%.4g away: give a larger tolerance, or remove the contact",
           c->name, c->slave, c->name, (double)m->tolerance, c->master,
           (int)t->fe->mesh->node_id[HycoMasterSearchNode(t, node)], (double)nearest);
}

/* Adds each slave node with its master, or fails for those without one. n = 0 in a match: a node that faces no master,
   and may do so. */
static PetscErrorCode AppendMatched(HycoMasterSearch *t, HycoContact c, PetscInt index, HycoRemedy remedy,
                                    const HycoMatch *m, Missed missed[], HycoPairs *p)
{
  PetscInt n_missed = 0, n_alone = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n; k++) {
    if (m->why[k] != HYCO_FOUND) {
      const Missed here = {m->at[k].distance, m->slave[k], m->why[k]};

      /* All nodes without a master are collected, so that the message can name the farthest ones. */
      missed[n_missed++] = here;
      continue;
    }
    n_alone += !m->at[k].n;
    HycoPairsAppend(p, index, HycoMasterSearchNode(t, m->slave[k]),
                    HycoContactAverages(c) ? HycoMasterSearchSide(t, m->slave[k]) : HYCO_ONE_SIDE, m->at[k].n,
                    m->at[k].node, m->at[k].weight);
  }
  if (n_missed) PetscCall(PairingReportUnmatched(t, c, remedy, n_missed, missed, m));
  if (n_alone == m->n && !m->part) PetscCall(RefuseAll(t, c, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether slave i of a node's sides is kept, of which `best` is the first that is not worse than the others: each with
   a master, if the normals are those of the sides; else the nearest, or the best. A slave that does not look at the
   master has no contact if its surface closes on itself or goes round an edge: such a surface has them by nature. */
static PetscBool IsKept(const HycoMasterSearch *t, HycoContact c, const HycoMatch *m, PetscInt i, PetscInt best)
{
  if (m->why[best] != HYCO_FOUND && m->why[best] != HYCO_FAR && (t->edges & HYCO_SLAVE_ROUND)) return PETSC_FALSE;
  return (PetscBool)(i == best || (m->why[i] == HYCO_FOUND && HycoContactAverages(c)));
}

/* On a part the surfaces are not whole: there it is an error, and the whole ones are searched. */
static PetscErrorCode ForgiveFar(HycoMasterSearch *t, HycoMatch *m)
{
  PetscBool *met;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n, &met));
  for (PetscInt k = 0; k < m->n; k++) met[k] = (PetscBool)(m->why[k] == HYCO_FOUND && m->at[k].n);
  PetscCall(HycoMasterSearchForgive(t, m->n, m->slave, met, m->why));
  PetscCall(PetscFree(met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two sides of a node have the same facet of the master. */
static PetscBool MeetSame(const HycoMatch *m, PetscInt i, PetscInt j)
{
  return (PetscBool)(m->why[i] == HYCO_FOUND && m->why[j] == HYCO_FOUND && m->at[i].n && m->at[j].n &&
                     m->at[i].patch == m->at[j].patch);
}

/* Leaves out the sides of nodes on edges that have no contact. Two that meet one facet of the master alike, as those of
   a blade, are one contact of the node. */
static void DropSides(const HycoMasterSearch *t, HycoContact c, HycoMatch *m)
{
  PetscInt n = 0;

  for (PetscInt k = 0, next, best = 0; k < m->n; k = next) {
    for (next = best = k; next < m->n; next++) {
      if (HycoMasterSearchNode(t, m->slave[next]) != HycoMasterSearchNode(t, m->slave[k])) break;
      if (HycoVerdictIsBetter(&m->at[next], m->why[next], &m->at[best], m->why[best])) best = next;
    }
    for (PetscInt i = k; i < next; i++) {
      if (i != best && MeetSame(m, i, best)) m->slave[best] = HycoMasterSearchNode(t, m->slave[best]);
    }
    for (PetscInt i = k; i < next; i++) {
      if (!IsKept(t, c, m, i, best) || (i != best && MeetSame(m, i, best))) continue;
      m->slave[n] = m->slave[i];
      m->at[n] = m->at[i];
      m->why[n++] = m->why[i];
    }
  }
  m->n = n;
}

/* The whole matching, once the search and the slave nodes exist. */
static PetscErrorCode PairingMatch(HycoMasterSearch *t, HycoContact c, PetscInt index, HycoSettle settle,
                                   HycoRemedy remedy, HycoMatch *m, HycoPairs *p)
{
  HycoQuery query = {.moved = PETSC_FALSE};
  Missed *missed;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  m->part = (PetscBool)(p->facts != NULL);
  /* Empty on a rank, or an empty group: only the latter is an error. */
  if (m->part && !m->n) PetscFunctionReturn(PETSC_SUCCESS); /* no slave of this rank */
  HycoCheck(m->n && t->n, "contact %s: the group %s is empty", c->name, m->n ? c->master : c->slave);
  PetscCall(HycoPairsReserve(p, m->n, t->nf));
  PetscCall(CheckApart(t, c));
  /* Without `settle`, masters are found on moved nodes: here only the slaves are listed. */
  for (PetscInt k = 0; k < m->n && !settle; k++)
    HycoPairsAppend(p, index, HycoMasterSearchNode(t, m->slave[k]), HycoMasterSearchSide(t, m->slave[k]), 0, NULL,
                    NULL);
  if (!settle) PetscFunctionReturn(PETSC_SUCCESS);
  m->small = m->part ? p->facts[index].small : HycoSurfaceTolerance(t->fe->mesh, t->slave);
  PetscCall(HycoContactGetLength(c, "tolerance", &m->tolerance));
  if (m->tolerance < 0) m->tolerance = m->small;
  PetscCall(PetscMalloc3(m->n, &m->at, m->n, &m->why, m->n, &missed));
  query.tolerance = m->tolerance;
  query.small = m->small;
  p->queries += m->n;
  ierr = HycoMasterSearchFind(t, &query, m->n, m->slave, m->at, m->why);
  if (!ierr && !m->part) ierr = ForgiveFar(t, m);
  if (!ierr) DropSides(t, c, m);
  if (!ierr) ierr = (*settle)(t, c, m);
  if (!ierr) ierr = AppendMatched(t, c, index, remedy, m, missed, p);
  PetscCall(PetscFree3(m->at, m->why, missed));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a node is tied to nodes that take contact forces. */
static PetscBool PairingIsTied(HycoMesh m, PetscInt node, const PetscBool carries[])
{
  const PetscInt tied = HycoMeshTied(m, node);
  PetscBool all = (PetscBool)(tied >= 0);

  for (PetscInt j = all ? m->tied_start[tied] : 0; all && j < m->tied_start[tied + 1]; j++)
    all = carries[m->tied_master[j]];
  return all;
}

/* The slave nodes that take contact forces, without tied nodes that follow others of them and without those of other
   ranks, on edges each of their sides (each: where their normals are the contacts'); the caller frees them. */
static PetscErrorCode FindSlaves(const HycoMasterSearch *t, PetscBool each, PetscInt *n, PetscInt **slave)
{
  HycoMesh m = t->fe->mesh;
  PetscBool *carries;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscMalloc1(m->n_nodes, &carries));
  PetscCall(PetscMalloc1(m->group_start[t->slave + 1] - m->group_start[t->slave] + t->n_slots, slave));
  /* Which nodes a uniform pressure pushes, by the cell type. */
  HycoSurfaceCarriers(m, t->slave, carries);
  for (PetscInt k = m->group_start[t->slave]; k < m->group_start[t->slave + 1]; k++) {
    const PetscInt i = m->group_node[k];

    PetscInt first = i, sides = 1;

    if (!carries[i] || HycoMeshOwned(m, i) < 0 || PairingIsTied(m, i, carries)) continue;
    if (each) HycoMasterSearchSides(t, i, HYCO_ONE_SIDE, &first, &sides);
    for (PetscInt j = first; j < first + sides; j++) (*slave)[(*n)++] = j;
  }
  PetscCall(PetscFree(carries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the contacts of one scene entry to the pairs: the search, the type's settling of the matches, errors with the
   type's remedy. nodes: masters are nodes, not points of facets. Not collective. */
PetscErrorCode HycoMasterSearchMatch(HycoContact c, HycoFE fe, PetscInt index, PetscBool nodes, HycoSettle settle,
                                     HycoRemedy remedy, HycoPairs *pairs)
{
  HycoMasterSearch t;
  HycoMatch m = {0};
  PetscInt *slave, edges;

  PetscFunctionBegin;
  PetscCall(HycoPairsEdges(fe, pairs, index, &edges));
  PetscCall(HycoMasterSearchCreate(fe, c, nodes, edges, &t));
  /* Where the scene gives a normal, a node that is only listed has one contact. */
  PetscCall(FindSlaves(&t, (PetscBool)(settle || HycoContactAverages(c)), &m.n, &slave));
  m.slave = slave;
  HycoFinally(PairingMatch(&t, c, index, settle, remedy, &m, pairs), PetscCall(PetscFree(slave));
              PetscCall(HycoMasterSearchDestroy(&t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for pair, surface and mortar, so that a scene may change between them by the type alone. */
PetscErrorCode HycoMasterSearchDeclare(HycoContact c)
{
  PetscFunctionBegin;
  PetscCall(HycoContactDeclare(c, "slave", "slave group", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclare(c, "master", "master group", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclare(c, "tolerance", "largest distance as drawn", HYCO_ENTRY_LENGTH, PETSC_FALSE));
  PetscCall(HycoContactDeclareNormal(c));
  PetscCall(HycoContactDeclare(c, "gap", "the initial gap", HYCO_ENTRY_EXPRESSION, PETSC_FALSE));
  PetscCall(HycoContactDeclare(c, "overlap", "largest overlap before any load", HYCO_ENTRY_LENGTH, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
