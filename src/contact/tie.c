/*
  The search for ties: the masters of a slave node are those of the nearest point of the master's facets. Also contacts
  on tied nodes, which have no displacement of their own.
*/
#include "facing.h"
#include "nearest.h"

/* By node of the mesh: the tie of which it is a slave (-1: none), the point that it follows. */
typedef struct {
  PetscInt *tie;
  HycoProjection *at;
  PetscReal *tolerance; /* by tie */
} Found;

/* The master's facets in a tree, their nodes (the caller frees them), and whether a node is on them. */
static PetscErrorCode MakePatches(HycoMesh m, PetscInt group, PetscInt node[], PetscBool on[], HycoPatches *patches)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    for (PetscInt v = 0; v < m->nf; v++) on[m->facets[f * m->nf + v]] = PETSC_TRUE;
    PetscCall(PetscArraycpy(node + m->nf * n++, m->facets + f * m->nf, m->nf));
  }
  PetscCall(HycoPatchesCreate(m->xyz, n, m->nf, HycoCellKinds[m->type].corners, node, NULL, patches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the points that the slave nodes follow; nodes on both surfaces need none. */
static PetscErrorCode Project(HycoScene s, HycoMesh m, PetscInt k, PetscInt group, HycoPatches patches,
                              const PetscBool on[], Found *found)
{
  const HycoTie *tie = &s->tie[k];
  const PetscInt lo = m->group_start[group], n = m->group_start[group + 1] - lo;
  PetscInt missed = 0, farthest = -1;
  PetscReal most = 0;

  PetscFunctionBegin;
  /* Without a stated tolerance, nodes must coincide within a tenth of the shortest edge. */
  found->tolerance[k] = tie->tolerance < 0 ? HycoSurfaceTolerance(m, group) : tie->tolerance;
  for (PetscInt j = lo; j < lo + n; j++) {
    const PetscInt i = m->group_node[j];
    HycoProjection at;

    if (on[i]) continue;
    HycoCheck(found->tie[i] < 0,
              "node %d is a slave of the ties %s and %s, and a node can follow only one surface; exchange slave and "
              "master of one tie",
              (int)m->node_id[i], s->tie[PetscMax(found->tie[i], 0)].name, tie->name);
    HycoPatchesProject(patches, m->xyz + 3 * i, NULL, &at);
    found->tie[i] = k;
    found->at[i] = at;
    missed += at.distance > found->tolerance[k];
    if (at.distance <= found->tolerance[k] || at.distance <= most) continue;
    most = at.distance;
    farthest = i;
  }
  HycoCheck(!missed,
            "tie %s: %d of the %d nodes of %s have no point of %s within %g, the farthest is node %d (%.4g away); let "
            "the slave's surface end where the master's ends, exchange slave and master, or give a larger tolerance",
            tie->name, (int)missed, (int)n, tie->slave, tie->master, (double)found->tolerance[k],
            (int)m->node_id[PetscMax(farthest, 0)], (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One tie, with the tree of its master's facets. */
static PetscErrorCode FindOne(HycoScene s, HycoMesh m, PetscInt k, Found *found)
{
  const HycoTie *tie = &s->tie[k];
  PetscInt slave, master, *node;
  PetscBool *on;
  HycoPatches patches;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "tie", tie->slave, &slave));
  PetscCall(HycoMeshFindGroup(m, "tie", tie->master, &master));
  HycoCheck(m->group_start[slave] < m->group_start[slave + 1] && m->group_start[master] < m->group_start[master + 1],
            "tie %s: the group %s is empty", tie->name,
            m->group_start[slave] < m->group_start[slave + 1] ? tie->master : tie->slave);
  PetscCall(PetscMalloc1(m->n_facets * m->nf, &node));
  PetscCall(PetscCalloc1(m->n_nodes, &on));
  PetscCall(MakePatches(m, master, node, on, &patches));
  ierr = Project(s, m, k, slave, patches, on, found);
  PetscCall(HycoPatchesDestroy(&patches));
  PetscCall(PetscFree(node));
  PetscCall(PetscFree(on));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that no master node is itself tied. */
static PetscErrorCode CheckChains(HycoScene s, HycoMesh m, const Found *found)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt a = 0; found->tie[i] >= 0 && a < found->at[i].n; a++) {
      const PetscInt other = found->tie[found->at[i].node[a]];

      HycoCheck(other < 0,
                "tie %s: node %d, to which nodes of %s are tied, is itself a slave of the tie %s; exchange slave and "
                "master of one of them",
                s->tie[found->tie[i]].name, (int)m->node_id[found->at[i].node[a]], s->tie[found->tie[i]].slave,
                s->tie[PetscMax(other, 0)].name);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries by ascending slave node, which HycoMeshSetTies() relies on. */
static PetscErrorCode Find(HycoScene s, HycoMesh m, Found *found, HycoTies *ties)
{
  PetscInt n = 0;
  HycoTies t;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) found->tie[i] = -1;
  for (PetscInt k = 0; k < s->n_ties; k++) PetscCall(FindOne(s, m, k, found));
  PetscCall(CheckChains(s, m, found));
  for (PetscInt i = 0; i < m->n_nodes; i++) n += found->tie[i] >= 0 ? found->at[i].n : 0;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTiesCreate(n, m->type, ties));
  t = *ties;
  n = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const HycoProjection *at = &found->at[i];

    for (PetscInt a = 0; found->tie[i] >= 0 && a < at->n; a++, n++) {
      t->slave[n] = m->node_id[i];
      t->master[n] = m->node_id[at->node[a]];
      t->tie[n] = found->tie[i];
      t->body[n] = m->node_body[at->node[a]];
      t->weight[n] = at->weight[a];
      t->reach[n] = PetscMax(found->tolerance[found->tie[i]], 1e-9 * HycoMeshLength(m)); /* allows for round-off of
                                                                                            maps */
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ties of the scene on the whole mesh as drawn (NULL: none); the caller destroys them. One process. */
PetscErrorCode HycoTiesFind(HycoScene s, HycoMesh m, HycoTies *ties)
{
  Found found;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *ties = NULL;
  if (!s->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(m->n_nodes, &found.tie, m->n_nodes, &found.at, s->n_ties, &found.tolerance));
  ierr = Find(s, m, &found, ties);
  PetscCall(PetscFree3(found.tie, found.at, found.tolerance));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For contacts with a master surface: checks that none of its nodes is tied. */
static PetscErrorCode CheckMasters(HycoScene s, HycoMesh m)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    const HycoContact c = s->contact[k];
    PetscInt g = 0;

    if (!c->master) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", c->master, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      const PetscInt tied = HycoMeshTied(m, m->group_node[j]);

      HycoCheck(tied < 0,
                "contact %s: node %d of its master %s is a slave of the tie %s; exchange slave and master of the tie",
                c->name, (int)m->node_id[m->group_node[j]], c->master,
                s->tie[m->ties->tie[m->tied_entry[PetscMax(tied, 0)]]].name);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all masters of a tied slave are slaves of its contact. has: by node, its last contact. */
static PetscBool Followed(HycoMesh m, PetscInt tied, PetscInt contact, const PetscInt has[])
{
  for (PetscInt j = m->tied_start[tied]; j < m->tied_start[tied + 1]; j++) {
    if (has[m->tied_master[j]] != contact) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* which: the contacts that are kept. */
static PetscErrorCode Choose(HycoScene s, HycoMesh m, const HycoPairs *p, PetscInt has[], PetscInt *n, PetscInt which[])
{
  PetscFunctionBegin;
  *n = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++) has[i] = -1;
  /* Contacts of one scene entry are contiguous. */
  for (PetscInt k = 0, next; k < p->n; k = next) {
    next = HycoPairsRun(p, k);
    for (PetscInt j = k; j < next; j++) has[p->slave[j]] = p->contact[k];
    for (PetscInt j = k; j < next; j++) {
      const PetscInt tied = HycoMeshTied(m, p->slave[j]);

      if (tied < 0) which[(*n)++] = j;
      if (HycoMeshOwned(m, p->slave[j]) < 0) continue; /* of another rank */
      HycoCheck(tied < 0 || Followed(m, tied, p->contact[k], has),
                "contact %s: node %d is a slave of the tie %s, and its master nodes do not have this contact; exchange "
                "slave and master of the tie, or remove the node from the contact",
                s->contact[p->contact[k]]->name, (int)m->node_id[p->slave[j]],
                s->tie[m->ties->tie[m->tied_entry[PetscMax(tied, 0)]]].name);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes contacts of tied slaves, whose masters have the contact in their place. */
PetscErrorCode HycoPairsDropTied(HycoScene s, HycoMesh m, HycoPairs *p)
{
  PetscInt *has, *which, n;
  HycoPairs kept;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!m->n_tied) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckMasters(s, m));
  PetscCall(PetscMalloc2(m->n_nodes, &has, p->n, &which));
  ierr = Choose(s, m, p, has, &n, which);
  if (!ierr && n < p->n) {
    ierr = HycoPairsSelect(p, n, which, NULL, &kept);
    if (!ierr) ierr = HycoPairsDestroy(p);
    if (!ierr) *p = kept;
  }
  PetscCall(PetscFree2(has, which));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
