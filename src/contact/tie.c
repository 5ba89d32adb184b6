/*
  The search for ties: the masters of a slave node are those of its mean over the slave's facets around it (by the
  integrals of mortar contacts), or of the nearest point of the master's facets. Also contacts on tied nodes, which have
  no displacement of their own.
*/
#include "surface_normals.h"
#include "mortar.h"

/* By node of the mesh: the tie of which it is a slave (-1: none), the nearest point of its master, its row in `mean`
   (-1: it follows the nearest point). */
typedef struct {
  PetscInt *tie, *row;
  HycoProjection *at;
  PetscReal *tolerance; /* by tie */
  HycoPairs mean;
} Found;

/* The master's facets in a tree, their nodes (the caller frees them), and whether a node is on them. */
static PetscErrorCode MakePatches(HycoMesh m, PetscInt group, PetscInt node[], PetscBool on[], HycoPatches *patches)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    /* A slave node that is on the master already is bonded by the mesh. */
    for (PetscInt v = 0; v < m->nf; v++) on[m->facets[f * m->nf + v]] = PETSC_TRUE;
    PetscCall(PetscArraycpy(node + m->nf * n++, m->facets + f * m->nf, m->nf));
  }
  PetscCall(HycoPatchesCreate(m->xyz, n, m->nf, HycoCellKinds[m->type].corners, node, NULL, patches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the points that the slave nodes follow; nodes on both surfaces need none. On the mesh as drawn: a tie glues
   what lies together there, whatever a map does afterwards. */
static PetscErrorCode TieProject(HycoScene s, HycoMesh m, PetscInt k, PetscInt group, HycoPatches patches,
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

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "tie", tie->slave, &slave));
  PetscCall(HycoMeshFindGroup(m, "tie", tie->master, &master));
  /* An empty side would silently leave the bodies apart. */
  HycoCheck(m->group_start[slave] < m->group_start[slave + 1] && m->group_start[master] < m->group_start[master + 1],
            "tie %s: the group %s is empty", tie->name,
            m->group_start[slave] < m->group_start[slave + 1] ? tie->master : tie->slave);
  PetscCall(PetscMalloc1(m->n_facets * m->nf, &node));
  PetscCall(PetscCalloc1(m->n_nodes, &on));
  PetscCall(MakePatches(m, master, node, on, &patches));
  HycoFinally(TieProject(s, m, k, slave, patches, on, found), PetscCall(HycoPatchesDestroy(&patches));
              HycoFreeAll(&node, &on));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters of tied node i and their weights; returns their number. */
static PetscInt TieMasters(const Found *found, PetscInt i, const PetscInt **node, const PetscReal **weight)
{
  PetscInt n = found->at[i].n;

  *node = found->at[i].node;
  *weight = found->at[i].weight;
  if (found->row[i] >= 0) HycoPairsMasters(&found->mean, found->row[i], &n, node, weight);
  return found->tie[i] < 0 ? 0 : n;
}

/* Checks that no master node is itself tied. */
static PetscErrorCode CheckChains(HycoScene s, HycoMesh m, const Found *found)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt *node;
    const PetscReal *weight;
    const PetscInt n = TieMasters(found, i, &node, &weight);

    for (PetscInt a = 0; a < n; a++) {
      const PetscInt other = found->tie[node[a]];

      /* A chain of ties would have to be eliminated in the right order. */
      HycoCheck(other < 0,
                "tie %s: node %d, to which nodes of %s are tied, is itself a slave of the tie %s; exchange slave and "
                "master of one of them",
                s->tie[found->tie[i]].name, (int)m->node_id[node[a]], s->tie[found->tie[i]].slave,
                s->tie[PetscMax(other, 0)].name);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- means -- */

/* What a tied node shares with its masters, by node: supports (bit c: component c) and groups of contacts and of
   supports along a direction. */
typedef struct {
  PetscInt n_groups, *group, *held;
} Shared;

/* Bits by component; on the axis component 0 is held by symmetry, as if by a support. */
static PetscErrorCode SharedCreate(HycoScene s, HycoMesh m, Shared *shared)
{
  PetscFunctionBegin;
  shared->n_groups = 0;
  PetscCall(PetscMalloc1(s->n_fixed + s->n_contacts, &shared->group));
  PetscCall(PetscCalloc1(m->n_nodes, &shared->held));
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", s->fixed[k].group, &g));
    /* A support along a normal holds a direction that differs from node to node: the masters must be in its group. */
    if (s->fixed[k].normal) shared->group[shared->n_groups++] = g;
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      for (PetscInt c = 0; c < 3; c++) shared->held[m->group_node[j]] |= (s->fixed[k].value[c] != NULL) << c;
    }
  }
  for (PetscInt k = 0; k < s->n_contacts; k++)
    PetscCall(HycoMeshFindGroup(m, "contact", s->contact[k]->slave, &shared->group[shared->n_groups++]));
  /* The axis holds the radius as a support does. */
  for (PetscInt i = 0; i < m->n_nodes && s->formulation == HYCO_AXISYMMETRIC; i++)
    shared->held[i] |= m->xyz[3 * i] <= 1e-9 * HycoMeshLength(m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A group's nodes are ascending. The only possible error of the search is a wrong argument, hence the abort in a
   function without an error code. */
static PetscBool IsIn(HycoMesh m, PetscInt group, PetscInt node)
{
  PetscInt at = -1;

  PetscCallAbort(PETSC_COMM_SELF, PetscFindInt(node, m->group_start[group + 1] - m->group_start[group],
                                               m->group_node + m->group_start[group], &at));
  return (PetscBool)(at >= 0);
}

/* Whether node i can follow its mean: the masters are not tied and have its supports and contacts, as those of the
   nearest point have where a plane of symmetry or a contact crosses the tie. */
static PetscBool CanFollow(HycoMesh m, const Shared *shared, const Found *found, PetscInt i)
{
  const PetscInt *node;
  const PetscReal *weight;
  const PetscInt n = TieMasters(found, i, &node, &weight);

  for (PetscInt a = 0; a < n; a++) {
    /* Masters must have every support that the slave has: otherwise the support would act on a node that does not move
       with it. */
    if (found->tie[node[a]] >= 0 || (shared->held[i] & ~shared->held[node[a]])) return PETSC_FALSE;
  }
  for (PetscInt g = 0; g < shared->n_groups; g++) {
    for (PetscInt a = 0; a < n && IsIn(m, shared->group[g], i); a++) {
      if (!IsIn(m, shared->group[g], node[a])) return PETSC_FALSE;
    }
  }
  return (PetscBool)(n > 0);
}

/* The means of the slaves of tie k without a pin. Those that cannot follow theirs are pinned to their nearest points;
   *refused counts them. */
static PetscErrorCode TryMeans(HycoFE fe, PetscInt k, const Shared *shared, HycoProjection pin[], Found *found,
                               PetscInt *refused)
{
  const HycoTie *tie = &fe->scene->tie[k];
  HycoMesh m = fe->mesh;
  const PetscInt first = found->mean.n;
  PetscInt slaves, masters, n = 0, *slave;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "tie", tie->slave, &slaves));
  PetscCall(HycoMeshFindGroup(m, "tie", tie->master, &masters));
  PetscCall(PetscMalloc1(m->group_start[slaves + 1] - m->group_start[slaves], &slave));
  for (PetscInt j = m->group_start[slaves]; j < m->group_start[slaves + 1]; j++) {
    if (!pin[m->group_node[j]].n) slave[n++] = m->group_node[j];
  }
  PetscCall(HycoMortarTie(fe, slaves, masters, pin, n, slave, &found->mean));
  *refused = 0;
  for (PetscInt j = 0; j < n; j++) {
    /* Before CanFollow(), which reads the masters through it; a refused one gets its nearest point back. */
    found->row[slave[j]] = first + j;
    if (CanFollow(m, shared, found, slave[j])) continue;
    pin[slave[j]] = found->at[slave[j]];
    found->row[slave[j]] = -1;
    (*refused)++;
  }
  PetscCall(PetscFree(slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The means of tie k. Nodes of both surfaces are pinned to themselves. A new pin changes the rows around it, so that
   they are computed again. */
static PetscErrorCode FindMeans(HycoFE fe, PetscInt k, const Shared *shared, Found *found)
{
  HycoMesh m = fe->mesh;
  const PetscInt first = found->mean.n;
  PetscInt slaves, refused;
  HycoProjection *pin;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "tie", fe->scene->tie[k].slave, &slaves));
  PetscCall(PetscCalloc1(m->n_nodes, &pin));
  for (PetscInt j = m->group_start[slaves]; j < m->group_start[slaves + 1]; j++) {
    const PetscInt i = m->group_node[j];

    if (found->tie[i] != k) pin[i] = (HycoProjection){.n = 1, .node = {i}, .weight = {1}};
  }
  /* Ends, because each round pins at least one node more, and pins are never released. */
  do {
    found->mean.n = first;
    PetscCall(TryMeans(fe, k, shared, pin, found, &refused));
  } while (refused);
  PetscCall(PetscFree(pin));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The means of all ties that have them, after the nearest points of all ties. As for mortar contacts, of which a tie is
   one that neither opens nor slides. */
static PetscErrorCode FindAllMeans(HycoScene s, HycoMesh m, Found *found)
{
  PetscBool any = PETSC_FALSE;
  Shared shared;
  HycoFE fe;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_ties; k++) any = (PetscBool)(any || s->tie[k].mortar);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  /* The integrals need outward normals; a mesh just read has its facets in the order of the file. */
  for (PetscInt f = 0; f < m->n_facets; f++) HycoMeshTurnFacet(m, m->facet_cell[f], m->facets + f * m->nf);
  PetscCall(HycoFECreateRead(s, m, &fe));
  PetscCall(HycoFESetDrawn(fe));
  PetscCall(SharedCreate(s, m, &shared));
  for (PetscInt k = 0; k < s->n_ties; k++) {
    if (s->tie[k].mortar) PetscCall(FindMeans(fe, k, &shared, found));
  }
  HycoFreeAll(&shared.group, &shared.held);
  PetscCall(HycoFEDestroy(&fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- all -- */

/* Cells have room for a limited number of masters, which a slave that is much coarser exceeds. */
static PetscErrorCode CheckRoom(HycoScene s, HycoMesh m, const Found *found)
{
  PetscInt *seen;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &seen));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt n = m->nv, tie = 0;

    for (PetscInt v = 0; v < m->nv; v++) {
      const PetscInt *node, i = m->cells[e * m->nv + v];
      const PetscReal *weight;
      const PetscInt masters = TieMasters(found, i, &node, &weight);

      if (masters) tie = found->tie[i];
      /* A master that several nodes of the cell follow counts once. Marked afterwards, with the number of the cell,
         so that nothing is reset. */
      for (PetscInt a = 0; a < masters; a++) n += seen[node[a]] != e + 1;
      for (PetscInt a = 0; a < masters; a++) seen[node[a]] = e + 1;
    }
    if (n > HYCO_MAX_CELL_NODES) {
      PetscCall(PetscFree(seen));
      HycoFail("tie %s: cell %d of its slave %s faces so many facets of %s that it follows %d nodes, more than %d; "
               "exchange slave and master, or give method: collocation",
               s->tie[tie].name, (int)m->cell_id[e], s->tie[tie].slave, s->tie[tie].master, (int)(n - m->nv),
               (int)(HYCO_MAX_CELL_NODES - m->nv));
    }
  }
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How far a slave may be from the point of its masters: the tolerance, which allows for round-off of maps. The mean may
   be farther than the nearest point. */
static PetscReal TieReach(HycoMesh m, const Found *found, PetscInt i)
{
  const PetscInt *node;
  const PetscReal *weight;
  const PetscInt n = TieMasters(found, i, &node, &weight);
  PetscReal at[3] = {0, 0, 0};

  for (PetscInt a = 0; a < n; a++) {
    for (PetscInt c = 0; c < 3; c++) at[c] += weight[a] * m->xyz[3 * node[a] + c];
  }
  /* Twice the distance as drawn: maps may stretch it. */
  return PetscMax(found->tolerance[found->tie[i]],
                  PetscMax(found->row[i] < 0 ? 0 : 2 * HycoDistance(at, m->xyz + 3 * i), 1e-9 * HycoMeshLength(m)));
}

/* Entries by ascending slave node, which HycoMeshSetTies() relies on. */
static PetscErrorCode TieFind(HycoScene s, HycoMesh m, Found *found, HycoTies *ties)
{
  PetscInt n = 0;
  HycoTies t;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) found->tie[i] = found->row[i] = -1;
  for (PetscInt k = 0; k < s->n_ties; k++) PetscCall(FindOne(s, m, k, found));
  /* After all nearest points: which nodes are tied decides who may follow a mean. */
  PetscCall(FindAllMeans(s, m, found));
  PetscCall(CheckChains(s, m, found));
  PetscCall(CheckRoom(s, m, found));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt *node;
    const PetscReal *weight;

    /* Counted first: the arrays have exactly these entries. */
    n += TieMasters(found, i, &node, &weight);
  }
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTiesCreate(n, m->type, ties));
  t = *ties;
  n = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt *node;
    const PetscReal *weight;
    const PetscInt masters = TieMasters(found, i, &node, &weight);

    for (PetscInt a = 0; a < masters; a++, n++) {
      t->slave[n] = m->node_id[i];
      t->master[n] = m->node_id[node[a]];
      t->tie[n] = found->tie[i];
      t->body[n] = m->node_body[node[a]];
      t->weight[n] = weight[a];
      t->reach[n] = TieReach(m, found, i);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ties of the scene on the whole mesh as drawn (NULL: none); the caller destroys them. One process. */
PetscErrorCode HycoTiesFind(HycoScene s, HycoMesh m, HycoTies *ties)
{
  Found found;

  PetscFunctionBegin;
  *ties = NULL;
  if (!s->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMemzero(&found.mean, sizeof(found.mean)));
  /* Zero contacts: starts exist even without means. */
  PetscCall(HycoPairsReserve(&found.mean, 0, 0));
  PetscCall(
      PetscMalloc4(m->n_nodes, &found.tie, m->n_nodes, &found.row, m->n_nodes, &found.at, s->n_ties, &found.tolerance));
  HycoFinally(TieFind(s, m, &found, ties), PetscCall(PetscFree4(found.tie, found.row, found.at, found.tolerance));
              PetscCall(HycoPairsDestroy(&found.mean)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For contacts with a master surface: checks that none of its nodes is tied. Slaves may be tied: DropTied() moves their
   contact to their masters. */
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

      /* A contact force on a tied node would have to pass to its masters inside the search. */
      HycoCheck(tied < 0,
                "contact %s: node %d of its master %s is a slave of the tie %s; exchange slave and master of the tie",
                c->name, (int)m->node_id[m->group_node[j]], c->master,
                s->tie[m->ties->tie[m->tied_entry[PetscMax(tied, 0)]]].name);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all masters of a tied slave are slaves of its contact. has: by node, its last contact. */
static PetscBool TieIsFollowed(HycoMesh m, PetscInt tied, PetscInt contact, const PetscInt has[])
{
  for (PetscInt j = m->tied_start[tied]; j < m->tied_start[tied + 1]; j++) {
    if (has[m->tied_master[j]] != contact) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* which: the contacts that are kept. */
static PetscErrorCode TieChoose(HycoScene s, HycoMesh m, const HycoPairs *p, PetscInt has[], PetscInt *n,
                                PetscInt which[])
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
      /* Its masters' contacts may be on the owner only. */
      if (HycoMeshOwned(m, p->slave[j]) < 0) continue; /* of another rank */
      HycoCheck(tied < 0 || TieIsFollowed(m, tied, p->contact[k], has),
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
  /* Nothing is tied: the pairs stay as they are. */
  if (!m->n_tied) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckMasters(s, m));
  PetscCall(PetscMalloc2(m->n_nodes, &has, p->n, &which));
  ierr = TieChoose(s, m, p, has, &n, which);
  if (!ierr && n < p->n) {
    /* A selection keeps the order, in which contacts are numbered. */
    ierr = HycoPairsSelect(p, n, which, NULL, &kept);
    if (!ierr) ierr = HycoPairsDestroy(p);
    if (!ierr) *p = kept;
  }
  PetscCall(PetscFree2(has, which));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
