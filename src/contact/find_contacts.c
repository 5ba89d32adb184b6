/*
  Potential contacts: each of the scene's contacts adds its slave nodes with their masters, on the mesh as drawn; on
  surfaces that a map moves, masters are searched again whenever the nodes have moved.
*/
#include "surface_normals.h"
#include "master_search.h"
#include <hycokinematics.h>

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

/* Whether a map moves a surface of a contact. */
static PetscErrorCode IsSurfaceMoved(HycoScene scene, HycoMesh m, HycoContact c, PetscBool *moved)
{
  PetscFunctionBegin;
  PetscCall(IsMoved(scene, m, c->slave, moved));
  PetscCall(IsMoved(scene, m, c->master, moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tolerance and motion of each contact over all ranks: a rank alone sees only a part of the surface, and all must
   search alike. Collective. Ranks without a facet of the surface have nothing to say about its tolerance. */
PetscErrorCode HycoContactsFacts(MPI_Comm comm, HycoScene scene, HycoMesh part, HycoSurfaceFacts facts[])
{

  PetscFunctionBegin;
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    HycoContact c = scene->contact[k];
    /* One reduction with MPI_MIN for both. */
    PetscReal least[5] = {PETSC_MAX_REAL, 0, 0, 0, 1}; /* the tolerance, minus whether it is moved, minus its edges */
    PetscBool moved = PETSC_FALSE;
    PetscInt g = 0, edges;

    PetscCall(HycoMeshFindGroup(part, "contact", c->slave, &g));
    least[0] = HycoSurfaceTolerance(part, g);
    if (least[0] == 0) least[0] = PETSC_MAX_REAL; /* no facets here */
    if (c->ops->find) PetscCall(IsSurfaceMoved(scene, part, c, &moved));
    least[1] = moved ? -1 : 0;
    PetscCall(HycoContactEdges(scene, part, c, &edges));
    least[2] = -(edges & HYCO_SLAVE_EDGE);
    least[3] = -(edges & HYCO_MASTER_EDGE);
    least[4] = edges & HYCO_SLAVE_ROUND;
    HycoAllreduce(least, 5, MPIU_REAL, MPI_MIN, comm);
    facts[k].small = least[0] < PETSC_MAX_REAL ? least[0] : 0;
    facts[k].moved = (PetscBool)(least[1] < 0);
    facts[k].edges = (least[2] < 0 ? HYCO_SLAVE_ROUND : (PetscInt)least[4]) - (PetscInt)(least[2] + least[3]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks contacts whose masters are searched again after each motion, and sets the room for their masters. */
PetscErrorCode HycoPairsSetSearch(HycoScene scene, HycoMesh m, HycoPairs *pairs)
{
  PetscFunctionBegin;
  pairs->room = 0;
  pairs->n_searches = scene->n_contacts;
  PetscCall(PetscFree(pairs->search));
  PetscCall(PetscCalloc1(scene->n_contacts, &pairs->search));
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    HycoContact c = scene->contact[k];
    HycoSearch *search = &pairs->search[k];

    search->reach = PETSC_MAX_REAL;
    if (pairs->facts)
      search->edges = pairs->facts[k].edges;
    else
      PetscCall(HycoContactEdges(scene, m, c, &search->edges));
    if (!c->ops->find) continue;
    if (pairs->facts)
      search->moved = pairs->facts[k].moved;
    else
      PetscCall(IsSurfaceMoved(scene, m, c, &search->moved));
    /* A later search may find any point of a facet, which has at most nf masters; mortar rows raise it in
       HycoPairsMove(). */
    if (search->moved) pairs->room = m->nf;
  }
  /* No room and no search: nothing is moved, and HycoPairsMove() returns at once. */
  if (!pairs->room) PetscCall(PetscFree(pairs->search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Limits later searches to these distances (length, by contact of the scene); reach NULL: no limit. */
void HycoPairsSetReach(HycoPairs *pairs, const PetscReal reach[])
{
  for (PetscInt c = 0; reach && pairs->search && c < pairs->n_searches; c++) pairs->search[c].reach = reach[c];
}

/* Appends the contacts k .. next - 1 of one contact of the scene to `found`: with the masters that they meet now, if a
   map moves them. */
static PetscErrorCode FindRun(HycoFE fe, HycoPairs *p, PetscInt k, PetscInt next, HycoPairs *found)
{
  const PetscInt index = p->contact[k];
  const HycoContact c = fe->scene->contact[index];
  PetscInt widest = 0;

  PetscFunctionBegin;
  /* The whole run is passed at once, so that the type builds one tree for all of its slaves. */
  if (HycoPairsMoved(p, k)) {
    p->queries += next - k;
    PetscCall((*c->ops->find)(c, fe, p, k, next, found));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt j = k; j < next; j++) widest = PetscMax(widest, p->master_start[j + 1] - p->master_start[j]);
  PetscCall(HycoPairsReserve(found, next - k, widest));
  for (PetscInt j = k; j < next; j++)
    HycoPairsAppend(found, index, p->slave[j], p->side[j], p->master_start[j + 1] - p->master_start[j],
                    p->master + p->master_start[j], p->weight + p->master_start[j]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Searches the masters of moved surfaces at the current nodes of fe; others keep theirs. Nothing is done if the
   nodes are where they were at the last search. Not collective: candidates must be in the mesh. */
PetscErrorCode HycoPairsMove(HycoFE fe, HycoPairs *p)
{
  HycoPairs found = {0};
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  if (!p->room || p->place == fe->place) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPairsReserve(&found, 0, 0));
  for (PetscInt k = 0, next; k < p->n && !ierr; k = next) {
    next = HycoPairsRun(p, k);
    ierr = FindRun(fe, p, k, next, &found);
  }
  /* After an error the old masters stay, and so does the place: the next call searches again. */
  if (ierr) PetscCall(HycoPairsDestroy(&found));
  PetscCall(ierr);
  /* Slaves and their order do not change, only their masters: rows of B and lambda keep their numbers. */
  HycoFreeAll(&p->master_start, &p->master, &p->weight, &found.slave, &found.contact, &found.side);
  p->master_start = found.master_start;
  p->master = found.master;
  p->weight = found.weight;
  p->place = fe->place;
  /* Mortar rows may be wider than a facet. The room only grows: arrays that were made for it stay large enough. */
  for (PetscInt k = 0; k < p->n; k++) p->room = PetscMax(p->room, p->master_start[k + 1] - p->master_start[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of fixed components of each node. By supports alone: neither by ties nor by the axis. */
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
  /* One component for each such support, whatever its direction. */
  for (PetscInt k = 0; k < scene->n_fixed; k++) { /* along other directions */
    PetscInt g = 0;

    if (!scene->fixed[k].normal) continue;
    PetscCall(HycoMeshFindGroup(m, "fixed", scene->fixed[k].group, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++)
      held[m->group_node[j]] = PetscMin(held[m->group_node[j]] + 1, m->dim);
  }
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node may be the slave of at most as many contacts as it has free displacements: otherwise their forces are not
   unique. A rigid tool's nodes have none, and their contacts act on the masters. */
static PetscErrorCode CheckSlaves(HycoScene scene, HycoMesh m, const PetscInt held[], const HycoPairs *p)
{
  PetscInt *count, *first;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(m->n_nodes, &count, m->n_nodes, &first));
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt i = p->slave[k], free = m->dim - held[i];

    /* The sides of one contact are counted once: they differ by more than 40 degrees. */
    if (k && p->slave[k - 1] == i && p->contact[k - 1] == p->contact[k]) continue;
    /* The first contact, to be named beside the one too many. */
    if (!count[i]++) first[i] = p->contact[k];
    HycoCheck(!free || count[i] <= free,
              "node %d is a slave of %d contacts, among them %s and %s, and has %d free displacement%s, so that the "
              "forces would not be unique; remove it from one contact",
              (int)m->node_id[i], (int)count[i], scene->contact[first[i]]->name, scene->contact[p->contact[k]]->name,
              (int)free, free == 1 ? "" : "s");
  }
  PetscCall(PetscFree2(count, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the nodes of a contact without masters, except completely fixed ones, which cannot touch anything. For
   obstacles: there is no master to find, and the row of B has the slave's unknowns only. */
static PetscErrorCode AppendNodes(HycoFE fe, PetscInt index, const PetscInt held[], HycoPairs *p)
{
  HycoMesh m = fe->mesh;
  HycoContact c = fe->scene->contact[index];
  PetscInt g = 0, n, *slave, *side;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
  /* With facts this is a rank's part, on which a group may be empty. */
  HycoCheck(p->facts || m->group_start[g + 1] > m->group_start[g], "contact %s: the group %s is empty", c->name,
            m->group_name[g]);
  PetscCall(HycoContactSlaves(fe, p, index, &n, &slave, &side));
  PetscCall(HycoPairsReserve(p, n, 0));
  for (PetscInt k = 0; k < n; k++) {
    if (held[slave[k]] < m->dim) HycoPairsAppend(p, index, slave[k], side[k], 0, NULL, NULL);
  }
  HycoFreeAll(&slave, &side);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the contacts of the slaves that this rank owns. */
static PetscErrorCode KeepOwned(HycoMesh m, HycoPairs *p)
{
  PetscInt *which, n = 0;
  HycoPairs kept;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p->n, &which));
  for (PetscInt k = 0; k < p->n; k++) {
    if (HycoMeshOwned(m, p->slave[k]) >= 0) which[n++] = k;
  }
  /* On one rank, and where no slave is in the overlap, nothing is copied. */
  if (n < p->n) {
    PetscCall(HycoPairsSelect(p, n, which, NULL, &kept));
    PetscCall(HycoPairsDestroy(p));
    *p = kept;
  }
  PetscCall(PetscFree(which));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Setup by type, then what concerns several contacts: ties and slaves with several contacts. Masters of moved
   surfaces are found last. Ties are dropped before slaves are counted: a tied node has no unknown that a contact
   could act on. */
static PetscErrorCode FindAll(HycoFE fe, HycoPairs *pairs)
{
  HycoScene scene = fe->scene;
  PetscInt *held;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoFESetDrawn(fe));
  PetscCall(HycoMeshCheckCells(fe->mesh)); /* a degenerate cell would cause misleading messages about its facets */
  PetscCall(HycoPairsSetSearch(scene, fe->mesh, pairs));
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &held));
  PetscCall(CountHeld(scene, fe->mesh, held));
  for (PetscInt k = 0; k < scene->n_contacts && !ierr; k++) {
    HycoContact c = scene->contact[k];
    const PetscInt first = pairs->n;

    ierr = c->ops->setup ? (*c->ops->setup)(c, fe, k, pairs) : AppendNodes(fe, k, held, pairs);
    if (!ierr) ierr = HycoPairsMask(fe, k, first, pairs);
  }
  if (!ierr) ierr = HycoPairsDropTied(scene, fe->mesh, pairs);
  if (!ierr) ierr = CheckSlaves(scene, fe->mesh, held, pairs);
  PetscCall(PetscFree(held));
  PetscCall(ierr);
  if (pairs->facts) PetscCall(KeepOwned(fe->mesh, pairs));
  /* After the slaves of other ranks are dropped: their masters need not be here. */
  PetscCall(HycoPairsMove(fe, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All potential contacts on the mesh as drawn. facts: of a distributed mesh, of which dm is a part (NULL: it is the
   whole mesh, in which an empty group is an error). The caller destroys them, also after an error. Not collective. */
PetscErrorCode HycoPairsFind(HycoScene scene, DM dm, const HycoSurfaceFacts facts[], HycoPairs *pairs)
{
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(pairs, sizeof(*pairs)));
  PetscCall(HycoPairsReserve(pairs, 0, 0));
  if (!scene->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFECreate(scene, dm, &fe));
  /* Borrowed for the setup alone: the facts end with the caller. */
  pairs->facts = facts;
  HycoFinally(FindAll(fe, pairs), pairs->facts = NULL; PetscCall(HycoFEDestroy(&fe)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
