/* The arrays of potential contacts. */
#include <hycocontactimpl.h>

/* Room for more contacts, with up to `width` masters each. */
PetscErrorCode HycoPairsReserve(HycoPairs *p, PetscInt contacts, PetscInt width)
{
  const PetscInt n = p->n + contacts;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->slave));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->contact));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->side));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &p->master_start));
  if (!p->n) p->master_start[0] = 0;
  /* One more than needed: arrays of no contacts are not NULL. */
  PetscCall(PetscRealloc((size_t)(p->master_start[p->n] + contacts * width + 1) * sizeof(PetscInt), &p->master));
  PetscCall(PetscRealloc((size_t)(p->master_start[p->n] + contacts * width + 1) * sizeof(PetscReal), &p->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The room must have been reserved. */
void HycoPairsAddMasters(HycoPairs *p, PetscInt n, const PetscInt node[], const PetscReal weight[])
{
  for (PetscInt a = 0; a < n; a++) {
    p->master[p->master_start[p->n]] = node[a];
    p->weight[p->master_start[p->n]++] = weight[a];
  }
}

/* The room must have been reserved. Masters' weights add up to 1. */
void HycoPairsAppend(HycoPairs *p, PetscInt contact, PetscInt slave, PetscInt side, PetscInt n, const PetscInt node[],
                     const PetscReal weight[])
{
  p->slave[p->n] = slave;
  p->side[p->n] = side;
  p->contact[p->n++] = contact;
  p->master_start[p->n] = p->master_start[p->n - 1];
  HycoPairsAddMasters(p, n, node, weight);
}

/* Ready for use again after HycoPairsReserve(). facts are borrowed, and queries, a count for the report, stay. */
PetscErrorCode HycoPairsDestroy(HycoPairs *pairs)
{
  PetscFunctionBegin;
  HycoFreeAll(&pairs->slave, &pairs->contact, &pairs->side, &pairs->master_start, &pairs->master, &pairs->weight,
              &pairs->search, &pairs->number, &pairs->geometry);
  pairs->n = pairs->room = pairs->place = pairs->drawn = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the contacts which[0 .. n); index: new numbers of nodes (NULL: unchanged). Masters of moved surfaces are
   then searched again, as the copy has no place. The caller destroys it. */
PetscErrorCode HycoPairsSelect(const HycoPairs *all, PetscInt n, const PetscInt which[], const PetscInt index[],
                               HycoPairs *out)
{
  PetscInt masters = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(out, sizeof(*out)));
  for (PetscInt i = 0; i < n; i++) masters += all->master_start[which[i] + 1] - all->master_start[which[i]];
  PetscCall(HycoPairsReserve(out, n, 0));
  PetscCall(PetscRealloc((size_t)(masters + 1) * sizeof(PetscInt), &out->master));
  PetscCall(PetscRealloc((size_t)(masters + 1) * sizeof(PetscReal), &out->weight));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt k = which[i], lo = all->master_start[k];

    HycoPairsAppend(out, all->contact[k], all->slave[k], all->side[k], all->master_start[k + 1] - lo, all->master + lo,
                    all->weight + lo);
  }
  for (PetscInt i = 0; index && i < n; i++) out->slave[i] = index[out->slave[i]];
  for (PetscInt j = 0; index && j < masters; j++) out->master[j] = index[out->master[j]];
  if (all->number) PetscCall(PetscMalloc1(n + 1, &out->number));
  for (PetscInt i = 0; all->number && i < n; i++) out->number[i] = all->number[which[i]];
  /* What was found out about the surfaces holds for a part of them. */
  out->facts = all->facts;
  out->queries = all->queries;
  out->room = all->room;
  out->n_searches = all->n_searches;
  /* Searches of moved surfaces go on with the copy's own contacts. */
  if (all->search) HycoDuplicate(all->n_searches, all->search, &out->search);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A copy with all contacts, on a mesh with other numbers of nodes. index: from the old nodes to the new ones. */
PetscErrorCode HycoPairsRenumber(const HycoPairs *pairs, const PetscInt index[], HycoPairs *out)
{
  PetscInt *which;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n, &which));
  for (PetscInt k = 0; k < pairs->n; k++) which[k] = k;
  PetscCall(HycoPairsSelect(pairs, pairs->n, which, index, out));
  PetscCall(PetscFree(which));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Difference of a nodal field at the slave and its master point, u_s - sum of w u_m, the field with dim components
   per node. */
void HycoPairsJump(const HycoPairs *p, PetscInt k, PetscInt dim, const PetscReal value[], PetscReal d[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    d[c] = c < dim ? value[p->slave[k] * dim + c] : 0;
    for (PetscInt j = p->master_start[k]; c < dim && j < p->master_start[k + 1]; j++)
      d[c] -= p->weight[j] * value[p->master[j] * dim + c];
  }
}

/* Adds to what is marked already: callers join the nodes of several sets. */
void HycoPairsMark(const HycoPairs *pairs, PetscBool node[])
{
  for (PetscInt k = 0; k < pairs->n; k++) {
    node[pairs->slave[k]] = PETSC_TRUE;
    for (PetscInt j = pairs->master_start[k]; j < pairs->master_start[k + 1]; j++) node[pairs->master[j]] = PETSC_TRUE;
  }
}

/* The largest number of nodes in a contact's row, also after later searches. */
PetscInt HycoPairsWidth(const HycoPairs *pairs)
{
  PetscInt most = pairs->n ? 1 + pairs->room : 0;

  for (PetscInt k = 0; k < pairs->n; k++)
    most = PetscMax(most, 1 + pairs->master_start[k + 1] - pairs->master_start[k]);
  return most;
}

/* Nodes that a contact has or may have later: of moved surfaces all of the master's. */
PetscErrorCode HycoPairsMarkSurfaces(HycoScene scene, HycoMesh m, const HycoPairs *pairs, PetscBool node[])
{
  PetscFunctionBegin;
  HycoPairsMark(pairs, node);
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    PetscInt g = 0;

    /* Types without a search at moved positions keep their masters. */
    if (!scene->contact[k]->ops->find) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k]->master, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) node[m->group_node[j]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
