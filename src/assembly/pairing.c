/*
  Potential contacts: the nodes of an obstacle's group, pairs of nodes by minimal distance between two surfaces (section
  3), or a surface's nodes projected on the facets of another; found on the mesh as it stands in the file.
*/
#include "nearest.h"
#include <hycofe.h>
#include <stdlib.h>
#include <string.h>

static PetscReal Distance(HycoMesh m, PetscInt i, PetscInt j)
{
  PetscReal sum = 0;

  for (PetscInt c = 0; c < 3; c++)
    sum += (m->xyz[3 * i + c] - m->xyz[3 * j + c]) * (m->xyz[3 * i + c] - m->xyz[3 * j + c]);
  return PetscSqrtReal(sum);
}

/* The tolerance when none is stated: a tenth of the shortest edge between the slave's facet corners. */
static PetscReal DefaultTolerance(HycoMesh m, PetscInt group)
{
  PetscReal shortest = PETSC_MAX_REAL;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    for (PetscInt v = 0; v < m->nf && m->nf > 1; v++) /* the last edge leads back to the first node */
      shortest = PetscMin(shortest, Distance(m, m->facets[f * m->nf + v], m->facets[f * m->nf + (v + 1) % m->nf]));
  }
  return shortest < PETSC_MAX_REAL ? shortest / 10 : 0;
}

/* A slave node too far from the master. */
typedef struct {
  PetscReal distance;
  PetscInt node;
} Missed;

static int FarthestFirst(const void *a, const void *b)
{
  const Missed *p = (const Missed *)a, *q = (const Missed *)b;

  if (p->distance != q->distance) return p->distance > q->distance ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

/* What one contact's search needs: the master's patches, and for pairs the slave that each node has found. */
typedef struct {
  HycoPatches patches;
  PetscInt n, nf, *node; /* patches' nodes, n x nf */
  PetscInt *partner_of;  /* by node, or -1 */
  Missed *missed;
} Partners;

/* Whether a point of a surface lies on its border: the edge that it is on, or an edge at the node that it is, has one
   facet. */
static PetscBool AtBorder(const Partners *t, const HycoProjection *p)
{
  const PetscInt nf = t->nf;

  if (nf == 1 || p->n > 2) return PETSC_FALSE;
  for (PetscInt k = 0; k < t->n * nf; k++) { /* each edge of each facet (2D: each end) */
    const PetscInt a = t->node[k], b = nf == 2 ? a : t->node[k / nf * nf + (k + 1) % nf];
    PetscInt shared = 0;
    PetscBool on = (PetscBool)(a == p->node[0] || b == p->node[0]);

    if (p->n == 2) on = (PetscBool)(on && nf > 2 && (a == p->node[1] || b == p->node[1]));
    for (PetscInt g = 0; on && g < t->n; g++) {
      PetscInt has = 0;

      for (PetscInt v = 0; v < nf; v++) has += t->node[g * nf + v] == a || t->node[g * nf + v] == b;
      shared += has == (a == b ? 1 : 2);
    }
    if (on && shared == 1) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Names the n slave nodes that are too far from the master, the farthest five of them. */
static PetscErrorCode Complain(HycoMesh m, const HycoContact *c, const Partners *t, PetscInt n, PetscInt slaves,
                               PetscReal tolerance)
{
  const PetscBool pair = (PetscBool)(c->type == HYCO_CONTACT_PAIR);
  char list[HYCO_LINE / 2] = "";

  PetscFunctionBegin;
  qsort(t->missed, (size_t)n, sizeof(Missed), FarthestFirst);
  for (PetscInt k = 0; k < PetscMin(n, 5); k++) {
    const size_t used = strlen(list);
    HycoProjection at;

    HycoPatchesProject(t->patches, m->xyz + 3 * t->missed[k].node, &at);
    snprintf(list + used, sizeof(list) - used, "%s%d (%.4g away%s)", k ? ", " : "", (int)m->node_id[t->missed[k].node],
             (double)at.distance, AtBorder(t, &at) ? ", past its border" : "");
  }
  HycoFail("contact %s: %d of the %d nodes of %s have no %s of %s within %g: %snode%s %s; %s, or raise "
           "contact_%s_tolerance",
           c->name, (int)n, (int)slaves, c->slave, pair ? "node" : "point", c->master, (double)tolerance,
           n > 5 ? "the farthest are " : "", n > 1 ? "s" : "", list,
           pair ? "mesh both surfaces alike, take type: surface" : "draw the surfaces closer, extend the master",
           c->name);
}

static PetscErrorCode Append(HycoPairs *p, PetscInt contact, PetscInt slave, const HycoProjection *at)
{
  PetscInt *end = p->master_start + p->n;

  PetscFunctionBegin;
  p->slave[p->n] = slave;
  p->contact[p->n++] = contact;
  end[1] = end[0];
  for (PetscInt a = 0; at && a < at->n; a++) {
    p->master[end[1]] = at->node[a];
    p->weight[end[1]++] = at->weight[a];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for `contacts` more contacts of `width` master nodes. */
static PetscErrorCode Reserve(HycoPairs *p, PetscInt contacts, PetscInt width)
{
  const PetscInt n = p->n + contacts;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->slave));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->contact));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->master_start));
  if (!p->n) p->master_start[0] = 0;
  PetscCall(PetscRealloc((size_t)(p->master_start[p->n] + contacts * width + 1) * sizeof(PetscInt), &p->master));
  PetscCall(PetscRealloc((size_t)(p->master_start[p->n] + contacts * width + 1) * sizeof(PetscReal), &p->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PartnersCreate(HycoMesh m, const HycoContact *c, PetscInt gs, PetscInt gm, Partners *t)
{
  PetscFunctionBegin;
  t->n = 0;
  t->nf = c->type == HYCO_CONTACT_PAIR ? 1 : m->nf;
  PetscCall(PetscMalloc1(PetscMax(m->group_start[gm + 1] - m->group_start[gm], m->n_facets * t->nf), &t->node));
  if (c->type == HYCO_CONTACT_PAIR) {
    for (PetscInt k = m->group_start[gm]; k < m->group_start[gm + 1]; k++) t->node[t->n++] = m->group_node[k];
  } else {
    for (PetscInt f = 0; f < m->n_facets; f++) {
      if (m->facet_group[f] == gm) PetscCall(PetscArraycpy(t->node + t->nf * t->n++, m->facets + f * m->nf, t->nf));
    }
  }
  PetscCall(HycoPatchesCreate(m, t->n, t->nf, t->node, &t->patches));
  PetscCall(PetscMalloc1(m->group_start[gs + 1] - m->group_start[gs], &t->missed));
  PetscCall(PetscMalloc1(m->n_nodes, &t->partner_of));
  for (PetscInt i = 0; i < m->n_nodes; i++) t->partner_of[i] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PartnersDestroy(Partners *t)
{
  PetscFunctionBegin;
  PetscCall(HycoPatchesDestroy(&t->patches));
  PetscCall(PetscFree(t->node));
  PetscCall(PetscFree(t->missed));
  PetscCall(PetscFree(t->partner_of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The two surfaces are apart, and a pair's master has one slave. */
static PetscErrorCode CheckPartner(HycoMesh m, const HycoContact *c, PetscInt slave, const HycoProjection *at,
                                   PetscInt partner_of[])
{
  const PetscInt j = at->node[0];

  PetscFunctionBegin;
  for (PetscInt a = 0; a < at->n; a++)
    HycoCheck(at->node[a] != slave, "contact %s: node %d is in both %s and %s; the two surfaces must be apart", c->name,
              (int)m->node_id[slave], c->slave, c->master);
  if (c->type != HYCO_CONTACT_PAIR) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(partner_of[j] < 0,
            "contact %s: nodes %d and %d of %s are both nearest to node %d of %s; mesh both surfaces alike, or take "
            "type: surface",
            c->name, (int)m->node_id[partner_of[j]], (int)m->node_id[slave], c->slave, (int)m->node_id[j], c->master);
  partner_of[j] = slave;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each node of group gs with its nearest master node (pair) or its projection on the master's facets (surface). */
static PetscErrorCode FindPartners(HycoMesh m, const HycoContact *c, PetscInt index, PetscInt gs, Partners *t,
                                   HycoPairs *p)
{
  const PetscInt *slave = m->group_node + m->group_start[gs], n_slave = m->group_start[gs + 1] - m->group_start[gs];
  const PetscReal tolerance = c->tolerance >= 0 ? c->tolerance : DefaultTolerance(m, gs);
  PetscInt missed = 0;

  PetscFunctionBegin;
  HycoCheck(n_slave && t->n, "contact %s: the group %s is empty", c->name, n_slave ? c->master : c->slave);
  PetscCall(Reserve(p, n_slave, t->nf));
  for (PetscInt k = 0; k < n_slave; k++) {
    HycoProjection at;

    HycoPatchesProject(t->patches, m->xyz + 3 * slave[k], &at);
    if (at.distance > tolerance) {
      t->missed[missed].distance = at.distance;
      t->missed[missed++].node = slave[k];
      continue;
    }
    PetscCall(CheckPartner(m, c, slave[k], &at, t->partner_of));
    PetscCall(Append(p, index, slave[k], &at));
  }
  if (missed) PetscCall(Complain(m, c, t, missed, n_slave, tolerance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node's row pivot in gap coordinates is its own: no node may be the slave of two contacts. */
static PetscErrorCode CheckSlaves(HycoScene scene, HycoMesh m, const HycoPairs *p)
{
  PetscInt *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &seen));
  for (PetscInt i = 0; i < m->n_nodes; i++) seen[i] = -1;
  for (PetscInt k = 0; k < p->n; k++) {
    HycoCheck(seen[p->slave[k]] < 0, "node %d is a slave of the contacts %s and %s; a node may be the slave of one",
              (int)m->node_id[p->slave[k]], scene->contact[seen[p->slave[k]]].name, scene->contact[p->contact[k]].name);
    seen[p->slave[k]] = p->contact[k];
  }
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An obstacle's nodes, but those that are wholly fixed: they cannot meet it. */
static PetscErrorCode FindObstacle(HycoScene scene, HycoMesh m, PetscInt index, PetscInt group, const PetscInt held[],
                                   HycoPairs *p)
{
  PetscFunctionBegin;
  HycoCheck(m->group_start[group + 1] > m->group_start[group], "contact %s: the group %s is empty",
            scene->contact[index].name, m->group_name[group]);
  PetscCall(Reserve(p, m->group_start[group + 1] - m->group_start[group], 0));
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) {
    if (held[m->group_node[k]] < m->dim) PetscCall(Append(p, index, m->group_node[k], NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of fixed components of each node. */
static PetscErrorCode CountHeld(HycoScene scene, HycoMesh m, PetscInt held[])
{
  PetscBool *fixed;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes * m->dim, &fixed));
  for (PetscInt k = 0; k < scene->n_fixed; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", scene->fixed[k].group, &g));
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt j = m->group_start[g]; scene->fixed[k].value[c] && j < m->group_start[g + 1]; j++)
        fixed[m->group_node[j] * m->dim + c] = PETSC_TRUE;
    }
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    held[i] = 0;
    for (PetscInt c = 0; c < m->dim; c++) held[i] += fixed[i * m->dim + c];
  }
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts of scene->contact[index]. */
static PetscErrorCode FindContact(HycoScene scene, HycoMesh m, PetscInt index, const PetscInt held[], HycoPairs *pairs)
{
  const HycoContact *c = &scene->contact[index];
  PetscInt gs = 0, gm = 0;
  Partners partners = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &gs));
  if (c->type == HYCO_CONTACT_OBSTACLE) {
    PetscCall(FindObstacle(scene, m, index, gs, held, pairs));
  } else {
    PetscCall(HycoMeshFindGroup(m, "contact", c->master, &gm));
    PetscCall(PartnersCreate(m, c, gs, gm, &partners));
    ierr = FindPartners(m, c, index, gs, &partners, pairs);
    PetscCall(PartnersDestroy(&partners));
    PetscCall(ierr);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsFind(HycoScene scene, HycoMesh m, HycoPairs *pairs)
{
  PetscInt *held;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(pairs, sizeof(*pairs)));
  PetscCall(Reserve(pairs, 0, 0));
  PetscCall(PetscMalloc1(m->n_nodes, &held));
  PetscCall(CountHeld(scene, m, held));
  for (PetscInt k = 0; k < scene->n_contacts && !ierr; k++) ierr = FindContact(scene, m, k, held, pairs);
  PetscCall(PetscFree(held));
  PetscCall(ierr);
  PetscCall(CheckSlaves(scene, m, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsDestroy(HycoPairs *pairs)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(pairs->slave));
  PetscCall(PetscFree(pairs->contact));
  PetscCall(PetscFree(pairs->master_start));
  PetscCall(PetscFree(pairs->master));
  PetscCall(PetscFree(pairs->weight));
  pairs->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsRenumber(const HycoPairs *pairs, const PetscInt index[], HycoPairs *out)
{
  const PetscInt n = pairs->n, entries = pairs->master_start[n];

  PetscFunctionBegin;
  out->n = n;
  HycoDuplicate(n, pairs->slave, &out->slave);
  HycoDuplicate(n, pairs->contact, &out->contact);
  HycoDuplicate(n + 1, pairs->master_start, &out->master_start);
  HycoDuplicate(entries, pairs->master, &out->master);
  HycoDuplicate(entries, pairs->weight, &out->weight);
  for (PetscInt k = 0; k < n; k++) out->slave[k] = index[out->slave[k]];
  for (PetscInt j = 0; j < entries; j++) out->master[j] = index[out->master[j]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoPairsMark(const HycoPairs *pairs, PetscBool node[])
{
  for (PetscInt k = 0; k < pairs->n; k++) {
    node[pairs->slave[k]] = PETSC_TRUE;
    for (PetscInt j = pairs->master_start[k]; j < pairs->master_start[k + 1]; j++) node[pairs->master[j]] = PETSC_TRUE;
  }
}

PetscInt HycoPairsWidth(const HycoPairs *pairs)
{
  PetscInt most = 0;

  for (PetscInt k = 0; k < pairs->n; k++)
    most = PetscMax(most, 1 + pairs->master_start[k + 1] - pairs->master_start[k]);
  return most;
}
