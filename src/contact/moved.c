/*
  The masters of surfaces that a map moves, searched for where the nodes are. A slave node has one if the master's
  nearest point opposes its normal, is within reach, and the node is not past the master's border.
*/
#include "partners.h"

/* Whether a map moves a node of a group. */
static PetscErrorCode IsMoved(HycoScene scene, HycoMesh m, const char group[], PetscBool *moved)
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "contact", group, &g));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1] && !*moved; k++) {
    const HycoBody *body = &scene->body[m->node_body[m->group_node[k]]];

    *moved = (PetscBool)(body->map[0] || body->map[1] || body->map[2]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsSetSearch(HycoScene scene, HycoMesh m, HycoPairs *pairs)
{
  PetscFunctionBegin;
  pairs->room = 0;
  pairs->n_searches = scene->n_contacts;
  PetscCall(PetscFree(pairs->search));
  PetscCall(PetscCalloc1(scene->n_contacts, &pairs->search));
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    const HycoContact *c = &scene->contact[k];
    HycoSearch *search = &pairs->search[k];

    search->reach = PETSC_MAX_REAL;
    if (c->type != HYCO_CONTACT_SURFACE) continue;
    PetscCall(IsMoved(scene, m, c->slave, &search->moved));
    PetscCall(IsMoved(scene, m, c->master, &search->moved));
    if (search->moved) pairs->room = m->nf;
  }
  if (!pairs->room) PetscCall(PetscFree(pairs->search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The master point of one slave node; n = 0: it has none. */
static PetscErrorCode Find(HycoPartners *t, PetscInt slave, PetscReal reach, HycoProjection *at)
{
  PetscBool past;

  PetscFunctionBegin;
  HycoPartnersProject(t, slave, PETSC_FALSE, at);
  if (at->n && at->distance > reach) at->n = 0;
  if (!at->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPartnersIsPast(t, slave, at, &past));
  if (past) at->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters of contacts first .. last - 1, all of one moved contact of the scene, after those of `first`. */
static PetscErrorCode FindRun(HycoFE fe, const HycoPairs *p, PetscInt first, PetscInt last, PetscInt start[],
                              PetscInt master[], PetscReal weight[])
{
  const PetscInt index = p->contact[first];
  HycoPartners t;

  PetscFunctionBegin;
  PetscCall(HycoPartnersCreate(fe, &fe->scene->contact[index], &t));
  for (PetscInt k = first; k < last; k++) {
    HycoProjection at;

    PetscCall(Find(&t, p->slave[k], p->search[index].reach, &at));
    for (PetscInt a = 0; a < at.n; a++) {
      master[start[k] + a] = at.node[a];
      weight[start[k] + a] = at.weight[a];
    }
    start[k + 1] = start[k] + at.n;
  }
  PetscCall(HycoPartnersDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsMove(HycoFE fe, HycoPairs *p)
{
  PetscInt *start, *master, kept;
  PetscReal *weight;

  PetscFunctionBegin;
  if (!p->room || p->place == fe->place) PetscFunctionReturn(PETSC_SUCCESS);
  kept = p->master_start[p->n];
  PetscCall(PetscMalloc1(p->n + 1, &start));
  PetscCall(PetscMalloc1(kept + p->n * p->room, &master));
  PetscCall(PetscMalloc1(kept + p->n * p->room, &weight));
  start[0] = 0;
  for (PetscInt k = 0, next; k < p->n; k = next) {
    const PetscInt lo = p->master_start[k], n = p->master_start[k + 1] - lo;

    next = k + 1;
    if (HycoPairsMoved(p, k)) {
      while (next < p->n && p->contact[next] == p->contact[k]) next++;
      PetscCall(FindRun(fe, p, k, next, start, master, weight));
      continue;
    }
    if (n) PetscCall(PetscArraycpy(master + start[k], p->master + lo, n));
    if (n) PetscCall(PetscArraycpy(weight + start[k], p->weight + lo, n));
    start[k + 1] = start[k] + n;
  }
  PetscCall(PetscFree(p->master_start));
  PetscCall(PetscFree(p->master));
  PetscCall(PetscFree(p->weight));
  p->master_start = start;
  p->master = master;
  p->weight = weight;
  p->place = fe->place;
  PetscFunctionReturn(PETSC_SUCCESS);
}
