/*
  Potential contacts: the nodes of an obstacle's group, pairs of nodes by minimal distance between two surfaces (section
  3), or a surface's nodes projected on the facets of another. They are found on the mesh as it stands in the file; on
  surfaces that a map moves, anew wherever the nodes are.
*/
#include <hycokinematics.h>
#include "partners.h"
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

/* How a slave node lies to the master: within reach and in front of it; too far; turned away from all of it; off to the
   side, as of a pair that does not match; past the border. */
typedef enum { MET, FAR, TURNED, ASKEW, PAST } Verdict;

/* A slave node without a master. */
typedef struct {
  PetscReal distance;
  PetscInt node;
  Verdict why;
} Missed;

static int FarthestFirst(const void *a, const void *b)
{
  const Missed *p = (const Missed *)a, *q = (const Missed *)b;

  if (p->distance != q->distance) return p->distance > q->distance ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

/* The master of one slave node, at most `tolerance` away. Farther than `small` the way to it must be as near to the
   slave's normal as normals must oppose, and not lead past the border. */
static PetscErrorCode Judge(HycoPartners *t, PetscInt slave, PetscReal tolerance, PetscReal small, HycoProjection *at,
                            Verdict *why)
{
  const PetscReal *out = HycoPartnersOutward(t, slave);
  PetscReal r[3];
  PetscBool past = PETSC_FALSE;

  PetscFunctionBegin;
  *why = MET;
  HycoPartnersProject(t, slave, PETSC_FALSE, at);
  if (!at->n) {
    *why = TURNED;
    HycoPartnersProject(t, slave, PETSC_TRUE, at);
  }
  if (*why == MET && at->distance > tolerance) *why = FAR;
  if (*why != MET || !out || at->distance <= small) PetscFunctionReturn(PETSC_SUCCESS);
  HycoPartnersAcross(t, slave, at, r);
  if (PetscAbsReal(HycoDot(r, out)) < -HYCO_OPPOSED * at->distance) *why = ASKEW;
  PetscCall(HycoPartnersIsPast(t, slave, at, &past));
  if (past) *why = PAST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Degrees between a slave's normal and the way to its master point, or by which the normals miss each other. */
static PetscReal Angle(const HycoPartners *t, PetscInt slave, Verdict why, const HycoProjection *at)
{
  const PetscReal *out = HycoPartnersOutward(t, slave);
  PetscReal r[3], cosine = -HycoDot(out, t->normal + 3 * at->patch);

  HycoPartnersAcross(t, slave, at, r);
  if (why == ASKEW) cosine = PetscAbsReal(HycoDot(out, r)) / at->distance;
  return PetscAcosReal(PetscMax(PetscMin(cosine, 1), -1)) * 180 / PETSC_PI;
}

/* "12 (0.5 away, past its border)" */
static PetscErrorCode Describe(HycoPartners *t, const Missed *missed, size_t room, char text[])
{
  HycoProjection at;
  PetscBool border = PETSC_FALSE;
  size_t used;

  PetscFunctionBegin;
  HycoPartnersProject(t, missed->node, PETSC_FALSE, &at);
  if (!at.n) HycoPartnersProject(t, missed->node, PETSC_TRUE, &at);
  PetscCall(HycoPartnersAtBorder(t, &at, &border));
  snprintf(text, room, "%d (%.4g away%s", (int)t->fe->mesh->node_id[missed->node], (double)at.distance,
           border ? ", past its border" : "");
  used = strlen(text);
  if (missed->why == TURNED || missed->why == ASKEW)
    snprintf(text + used, room - used, ", %.0f degrees %s", (double)Angle(t, missed->node, missed->why, &at),
             missed->why == TURNED ? "turned away from it" : "off the normal");
  PetscCall(PetscStrlcat(text, ")", room));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What to do about nodes without a master. */
static PetscErrorCode Remedy(HycoPartners *t, const HycoContact *c, PetscInt n, const Missed missed[],
                             char text[HYCO_LINE])
{
  PetscBool facing = PETSC_FALSE;
  PetscReal farthest = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    HycoProjection at;
    Verdict why;

    PetscCall(Judge(t, missed[k].node, PETSC_MAX_REAL, 0, &at, &why));
    facing = (PetscBool)(facing || why == MET);
    farthest = PetscMax(farthest, at.distance);
  }
  if (c->type == HYCO_CONTACT_PAIR)
    snprintf(text, HYCO_LINE, "mesh both surfaces alike, or take type: surface");
  else if (facing)
    snprintf(text, HYCO_LINE,
             "draw the surfaces closer, or allow the distance by contact_%s_tolerance %.4g: nodes that face no %s then "
             "have no contact",
             c->name, 1.01 * (double)farthest, c->master);
  else
    snprintf(text, HYCO_LINE, "leave nodes that face no %s out of %s, or extend %s", c->master, c->slave, c->master);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of cells without volume no facet has a side: they are the error. */
static PetscErrorCode CheckVolumes(HycoFE fe)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  PetscReal g[8][3], weight;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) PetscCall(HycoGradients(fe, el, e, 0, g, &weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the n slave nodes that have no master, the farthest five of them. */
static PetscErrorCode Complain(HycoPartners *t, const HycoContact *c, PetscInt n, Missed missed[], PetscInt slaves,
                               PetscReal tolerance)
{
  char list[HYCO_LINE / 2] = "", remedy[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(CheckVolumes(t->fe));
  qsort(missed, (size_t)n, sizeof(Missed), FarthestFirst);
  for (PetscInt k = 0; k < PetscMin(n, 5); k++) {
    char one[HYCO_LINE / 2];

    PetscCall(Describe(t, &missed[k], sizeof(one), one));
    if (k) PetscCall(PetscStrlcat(list, ", ", sizeof(list)));
    PetscCall(PetscStrlcat(list, one, sizeof(list)));
  }
  PetscCall(Remedy(t, c, n, missed, remedy));
  HycoFail("contact %s: %d of the %d nodes of %s have no %s of %s within %g: %snode%s %s; %s", c->name, (int)n,
           (int)slaves, c->slave, c->type == HYCO_CONTACT_PAIR ? "node" : "point", c->master, (double)tolerance,
           n > 5 ? "the farthest are " : "", n > 1 ? "s" : "", list, remedy);
}

/* A contact; at: its master point, NULL: it has none. */
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

/* No node is on both surfaces. */
static PetscErrorCode CheckApart(const HycoPartners *t, const HycoContact *c)
{
  HycoMesh m = t->fe->mesh;
  PetscBool *master;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &master));
  for (PetscInt k = 0; k < t->n * t->nf; k++) master[t->node[k]] = PETSC_TRUE;
  for (PetscInt k = m->group_start[t->slave]; k < m->group_start[t->slave + 1]; k++)
    HycoCheck(!master[m->group_node[k]], "contact %s: node %d is in both %s and %s; the two surfaces must be apart",
              c->name, (int)m->node_id[m->group_node[k]], c->slave, c->master);
  PetscCall(PetscFree(master));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A pair's master has one slave. */
static PetscErrorCode CheckPartner(HycoMesh m, const HycoContact *c, PetscInt slave, const HycoProjection *at,
                                   PetscInt partner_of[])
{
  const PetscInt j = at->node[0];

  PetscFunctionBegin;
  if (c->type != HYCO_CONTACT_PAIR) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(partner_of[j] < 0,
            "contact %s: nodes %d and %d of %s are both nearest to node %d of %s; mesh both surfaces alike, or take "
            "type: surface",
            c->name, (int)m->node_id[partner_of[j]], (int)m->node_id[slave], c->slave, (int)m->node_id[j], c->master);
  partner_of[j] = slave;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether each slave node (but those that need none) has a master of its own at most `far` away. */
static PetscErrorCode AreMatched(HycoMesh m, PetscInt n, const HycoProjection at[], const PetscBool *needs,
                                 PetscReal far, PetscBool *matched)
{
  PetscBool *taken;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &taken));
  *matched = PETSC_TRUE;
  for (PetscInt k = 0; k < n && *matched; k++) {
    if (!at[k].n && needs && !needs[k]) continue;
    *matched = (PetscBool)(at[k].n == 1 && at[k].distance <= far && !taken[at[k].node[0]]);
    if (*matched) taken[at[k].node[0]] = PETSC_TRUE;
  }
  PetscCall(PetscFree(taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The master node that lies most along the mean of both normals from a slave node: mirrored surfaces match so, however
   far apart they are. n = 0 where it misses that line by more than `small`. */
static void ProjectAlong(const HycoPartners *t, PetscInt slave, PetscReal small, HycoProjection *at)
{
  const PetscReal *out = HycoPartnersOutward(t, slave);
  PetscReal best = small * small;

  at->n = 0;
  for (PetscInt j = 0; out && j < t->n; j++) {
    const PetscReal *n = t->normal + 3 * j;
    const HycoProjection here = {1, {t->node[j]}, j, {1}, 0};
    PetscReal r[3], mean[3], rr, mm, off;

    for (PetscInt c = 0; c < 3; c++) mean[c] = out[c] - n[c];
    mm = HycoDot(mean, mean);
    if (HycoDot(n, n) == 0 || mm < 1e-2) continue; /* of no direction */
    HycoPartnersAcross(t, slave, &here, r);
    rr = HycoDot(r, r);
    off = PetscMax(rr - HycoDot(r, mean) * HycoDot(r, mean) / mm, 0);
    if (off > best || (off == best && at->n && rr >= at->distance * at->distance)) continue;
    best = off;
    *at = here;
    at->distance = PetscSqrtReal(rr);
  }
}

/* How far apart the nodes of a pair may lie along their normals: as said; else at any distance if the surfaces touch
   somewhere. */
static PetscReal Farthest(const HycoContact *c, PetscInt n, const HycoProjection at[], PetscReal small)
{
  if (c->tolerance >= 0) return c->tolerance;
  for (PetscInt k = 0; k < n; k++) {
    if (at[k].n && at[k].distance <= small) return PETSC_MAX_REAL;
  }
  return small;
}

/* The nodes of a pair whose surfaces do not coincide as drawn, along the normals, where those match all slave nodes
   that face the master one by one; the others have no contact (n = 0). */
static PetscErrorCode MatchAlong(HycoPartners *t, const HycoContact *c, PetscInt n, const PetscInt slave[],
                                 PetscReal small, HycoProjection at[], Verdict why[], PetscBool *matched)
{
  HycoProjection *along;
  PetscBool *needs;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &along, n, &needs));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *out = HycoPartnersOutward(t, slave[k]);
    HycoProjection nearest;

    ProjectAlong(t, slave[k], small, &along[k]);
    HycoPartnersProject(t, slave[k], PETSC_TRUE, &nearest);
    needs[k] = (PetscBool)(!out || HycoDot(out, t->normal + 3 * nearest.patch) <= HYCO_OPPOSED);
  }
  PetscCall(AreMatched(t->fe->mesh, n, along, needs, Farthest(c, n, at, small), matched));
  for (PetscInt k = 0; *matched && k < n; k++) {
    at[k] = along[k];
    if (at[k].n && HycoDot(HycoPartnersOutward(t, slave[k]), t->normal + 3 * at[k].patch) > HYCO_OPPOSED) at[k].n = 0;
    why[k] = MET;
  }
  PetscCall(PetscFree2(along, needs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters of all nodes of a contact's slave. n = 0: one that faces none and has no contact, where the scene states
   how far masters may be. */
static PetscErrorCode Project(HycoPartners *t, const HycoContact *c, PetscInt n, const PetscInt slave[],
                              PetscReal tolerance, PetscReal small, HycoProjection at[], Verdict why[])
{
  PetscBool matched;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) PetscCall(Judge(t, slave[k], tolerance, small, &at[k], &why[k]));
  if (c->type == HYCO_CONTACT_PAIR) {
    PetscCall(AreMatched(t->fe->mesh, n, at, NULL, PetscMin(small, tolerance), &matched));
    for (PetscInt k = 0; k < n; k++) matched = (PetscBool)(matched && why[k] == MET);
    if (!matched) PetscCall(MatchAlong(t, c, n, slave, small, at, why, &matched));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < n && c->tolerance >= 0; k++) {
    if (why[k] == MET || why[k] == FAR) continue;
    at[k].n = 0;
    why[k] = MET;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each node of a contact's slave with its master, or a complaint about those that have none. */
static PetscErrorCode AppendPartners(HycoPartners *t, const HycoContact *c, PetscInt index, HycoProjection at[],
                                     Verdict why[], Missed missed[], HycoPairs *p)
{
  HycoMesh m = t->fe->mesh;
  const PetscInt *slave = m->group_node + m->group_start[t->slave],
                 n = m->group_start[t->slave + 1] - m->group_start[t->slave];
  const PetscReal small = DefaultTolerance(m, t->slave), tolerance = c->tolerance >= 0 ? c->tolerance : small;
  PetscInt *partner_of, n_missed = 0, n_alone = 0;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(Project(t, c, n, slave, tolerance, small, at, why));
  PetscCall(PetscMalloc1(m->n_nodes, &partner_of));
  for (PetscInt i = 0; i < m->n_nodes; i++) partner_of[i] = -1;
  for (PetscInt k = 0; k < n && !ierr; k++) {
    if ((why[k] == MET || why[k] == ASKEW) && at[k].n) ierr = CheckPartner(m, c, slave[k], &at[k], partner_of);
    if (why[k] != MET) {
      const Missed here = {at[k].distance, slave[k], why[k]};

      missed[n_missed++] = here;
      continue;
    }
    n_alone += !at[k].n;
    if (!ierr) ierr = Append(p, index, slave[k], &at[k]);
  }
  PetscCall(PetscFree(partner_of));
  PetscCall(ierr);
  if (n_missed) PetscCall(Complain(t, c, n_missed, missed, n, tolerance));
  HycoCheck(n_alone < n, "contact %s: no node of %s faces %s within %g: are the two surfaces those that meet?", c->name,
            c->slave, c->master, (double)tolerance);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each node of a moved slave: its master is searched for where it is. */
static PetscErrorCode AppendMoved(const HycoPartners *t, PetscInt index, HycoPairs *p)
{
  HycoMesh m = t->fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = m->group_start[t->slave]; k < m->group_start[t->slave + 1]; k++)
    PetscCall(Append(p, index, m->group_node[k], NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts of a pair or surface contact. */
static PetscErrorCode FindPartners(HycoFE fe, PetscInt index, HycoPairs *p)
{
  const HycoContact *c = &fe->scene->contact[index];
  HycoMesh m = fe->mesh;
  HycoPartners t;
  HycoProjection *at;
  Verdict *why;
  Missed *missed;
  PetscInt n;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoPartnersCreate(fe, c, &t));
  n = m->group_start[t.slave + 1] - m->group_start[t.slave];
  HycoCheck(n && t.n, "contact %s: the group %s is empty", c->name, n ? c->master : c->slave);
  PetscCall(Reserve(p, n, t.nf));
  PetscCall(PetscMalloc3(n, &at, n, &why, n, &missed));
  ierr = CheckApart(&t, c);
  if (!ierr)
    ierr = p->room && p->search[index].moved ? AppendMoved(&t, index, p)
                                             : AppendPartners(&t, c, index, at, why, missed, p);
  PetscCall(PetscFree3(at, why, missed));
  PetscCall(HycoPartnersDestroy(&t));
  PetscCall(ierr);
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
static PetscErrorCode FindContact(HycoFE fe, PetscInt index, const PetscInt held[], HycoPairs *pairs)
{
  const HycoContact *c = &fe->scene->contact[index];
  PetscInt g = 0;

  PetscFunctionBegin;
  if (c->type == HYCO_CONTACT_OBSTACLE) {
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
    PetscCall(FindObstacle(fe->scene, fe->mesh, index, g, held, pairs));
  } else
    PetscCall(FindPartners(fe, index, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails for a cell without volume. */
static PetscErrorCode CheckCells(HycoFE fe)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  PetscReal g[8][3], weight;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    for (PetscInt q = 0; q < el->nq; q++) PetscCall(HycoGradients(fe, el, e, q, g, &weight));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FindAll(HycoFE fe, HycoPairs *pairs)
{
  HycoScene scene = fe->scene;
  PetscInt *held;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoFESetDrawn(fe));
  PetscCall(CheckCells(fe)); /* a broken cell explains what its facets seem to do */
  PetscCall(HycoPairsSetSearch(scene, fe->mesh, pairs));
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &held));
  PetscCall(CountHeld(scene, fe->mesh, held));
  for (PetscInt k = 0; k < scene->n_contacts && !ierr; k++) ierr = FindContact(fe, k, held, pairs);
  PetscCall(PetscFree(held));
  PetscCall(ierr);
  PetscCall(CheckSlaves(scene, fe->mesh, pairs));
  PetscCall(HycoPairsMove(fe, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsFind(HycoScene scene, HycoMesh m, HycoPairs *pairs)
{
  HycoFE fe;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(pairs, sizeof(*pairs)));
  PetscCall(Reserve(pairs, 0, 0));
  if (!scene->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFECreate(scene, m, &fe));
  ierr = FindAll(fe, pairs);
  PetscCall(HycoFEDestroy(&fe));
  PetscCall(ierr);
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
  PetscCall(PetscFree(pairs->search));
  pairs->n = pairs->room = pairs->place = 0;
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
  out->room = pairs->room;
  out->place = 0;
  out->n_searches = pairs->n_searches;
  if (pairs->search) HycoDuplicate(pairs->n_searches, pairs->search, &out->search);
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
  PetscInt most = pairs->n ? 1 + pairs->room : 0;

  for (PetscInt k = 0; k < pairs->n; k++)
    most = PetscMax(most, 1 + pairs->master_start[k + 1] - pairs->master_start[k]);
  return most;
}
