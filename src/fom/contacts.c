/*
  The contacts of a full-order model on several ranks. Each rank has those of the slave nodes that it owns, on a mesh of
  the facets around these and around the masters' nodes that they may meet; it searches for their masters, and computes
  their rows, gaps and results. Ranks exchange these facets once for each set of positions that needs further ones.

  What a rank cannot decide alone (an error, whose text depends on all slaves, and nodes that are matched along normals)
  is found on rank 0 from the whole surfaces, as on one rank.
*/
#include <hycofomimpl.h>

/* The radii of the widest facet by which masters may move before further facets are fetched. */
#define SLACK 2

/* Adds to the nodes that this rank's contacts need; they stay sorted and different. Numbers in the distributed
   vectors. */
static PetscErrorCode AddNeeded(HycoFOM f, PetscInt n, const PetscInt node[])
{
  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(f->n_needed + n + 1) * sizeof(PetscInt), &f->needed));
  PetscCall(PetscArraycpy(f->needed + f->n_needed, node, n));
  f->n_needed += n;
  PetscCall(HycoSortUnique(&f->n_needed, f->needed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the slave nodes that this rank owns, and the masters of those that are tied. */
static PetscErrorCode AddSlaves(HycoFOM f)
{
  HycoMesh m = f->part;
  PetscInt n = 0, *node, room = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", f->scene->contact[k]->slave, &g));
    /* A tied slave counts with its masters, of which a mean over facets has any number. */
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      const PetscInt tied = HycoMeshTied(m, m->group_node[j]);

      room += 1 + (tied < 0 ? 0 : m->tied_start[tied + 1] - m->tied_start[tied]);
    }
  }
  PetscCall(PetscMalloc1(room, &node));
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", f->scene->contact[k]->slave, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      const PetscInt i = m->group_node[j], tied = HycoMeshTied(m, i);

      if (HycoMeshOwned(m, i) < 0) continue;
      node[n++] = m->node_global[i];
      for (PetscInt t = tied < 0 ? 0 : m->tied_start[tied]; tied >= 0 && t < m->tied_start[tied + 1]; t++)
        node[n++] = m->node_global[m->tied_master[t]];
    }
  }
  PetscCall(AddNeeded(f, n, node));
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fetches the facets around the needed nodes. Only around slaves of this rank, which has all masters that they may
   meet: the search is then local. */
static PetscErrorCode FetchSurface(HycoFOM f, HycoMesh *surface)
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->part->n_groups, &in));
  PetscCall(HycoMarkContactGroups(f->scene, f->part, in));
  PetscCall(HycoMeshRings(HycoComm(f), f->scene, f->part, in, f->n_needed, f->needed, surface));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A contact as it is sent: nodes by their numbers in the distributed vectors. One with more masters than a facet has
   nodes is sent in several pieces, of which all but the first say `more`. */
typedef struct {
  PetscInt contact, slave, side, number, more, n, master[HYCO_FACET_NODES];
  PetscReal weight[HYCO_FACET_NODES];
} Sent;

/* The pieces of a contact. */
static PetscInt FOMContactsPieces(const HycoPairs *p, PetscInt k)
{
  const PetscInt masters = p->master_start[k + 1] - p->master_start[k];

  return PetscMax(1, (masters + HYCO_FACET_NODES - 1) / HYCO_FACET_NODES);
}

/* The contacts in n pieces, which the caller frees. Padding is zeroed, as the struct is sent as bytes. */
static PetscErrorCode PackContacts(HycoMesh m, const HycoPairs *p, PetscInt *n, Sent **sent)
{
  PetscFunctionBegin;
  *n = 0;
  for (PetscInt k = 0; k < p->n; k++) *n += FOMContactsPieces(p, k);
  PetscCall(PetscCalloc1(*n, sent));
  *n = 0;
  for (PetscInt k = 0; k < p->n; k++) {
    for (PetscInt i = 0, lo = p->master_start[k]; i < FOMContactsPieces(p, k); i++, lo += HYCO_FACET_NODES) {
      Sent *s = &(*sent)[(*n)++];

      s->contact = p->contact[k];
      s->slave = m->node_global[p->slave[k]];
      s->side = p->side[k];
      /* The number of the contact in the order of one rank. */
      s->number = p->number ? p->number[k] : k;
      /* A mortar row has more masters than a facet: it travels in several pieces of one size. */
      s->more = i > 0;
      s->n = PetscMin(p->master_start[k + 1] - lo, HYCO_FACET_NODES);
      for (PetscInt j = 0; j < s->n; j++) {
        s->master[j] = m->node_global[p->master[lo + j]];
        s->weight[j] = p->weight[lo + j];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh's nodes by their numbers in the distributed vectors. */
typedef struct {
  PetscInt n, *global, *node;
} Places;

/* Local nodes sorted by their global numbers, for binary search. A table by global number would have the length of the
   whole mesh on each rank. */
static PetscErrorCode PlacesCreate(HycoMesh m, Places *p)
{
  PetscFunctionBegin;
  p->n = m->n_nodes;
  PetscCall(PetscMalloc2(p->n, &p->global, p->n, &p->node));
  for (PetscInt i = 0; i < p->n; i++) {
    p->global[i] = m->node_global[i];
    p->node[i] = i;
  }
  PetscCall(PetscSortIntWithArray(p->n, p->global, p->node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -1: the mesh does not have the node. */
static PetscInt PlaceOf(const Places *p, PetscInt global)
{
  PetscInt at = -1;

  (void)PetscFindInt(global, p->n, p->global, &at);
  return at < 0 ? -1 : p->node[at];
}

/* Appends contacts whose nodes are all on the mesh. The needed facets have been fetched, thus all nodes are found. */
static PetscErrorCode UnpackContacts(HycoMesh m, PetscInt n, const Sent sent[], HycoPairs *p)
{
  Places places;

  PetscFunctionBegin;
  PetscCall(PlacesCreate(m, &places));
  PetscCall(HycoPairsReserve(p, n, HYCO_FACET_NODES));
  for (PetscInt k = 0; k < n; k++) {
    PetscInt master[HYCO_FACET_NODES];

    for (PetscInt j = 0; j < sent[k].n; j++) master[j] = PlaceOf(&places, sent[k].master[j]);
    if (sent[k].more)
      HycoPairsAddMasters(p, sent[k].n, master, sent[k].weight);
    else
      HycoPairsAppend(p, sent[k].contact, PlaceOf(&places, sent[k].slave), sent[k].side, sent[k].n, master,
                      sent[k].weight);
  }
  PetscCall(PetscFree2(places.global, places.node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surfaces of all contacts on rank 0 (NULL elsewhere); in 1D the whole mesh, where facets need their cells.
   Collective. */
PetscErrorCode HycoFOMGatherSurface(HycoFOM f, HycoMesh *mesh)
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->part->n_groups, &in));
  PetscCall(HycoMarkContactGroups(f->scene, f->part, in));
  PetscCall(HycoMeshGather(f->scene, f->part, f->part->dim > 1 ? in : NULL, NULL, mesh));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts contacts by their numbers and makes them those of the whole surfaces; the pieces of one are together. Rank
   0. */
static PetscErrorCode PlaceGathered(HycoFOM f, HycoMesh mesh, PetscInt n, const Sent sent[], HycoPairs *p)
{
  PetscInt *place;
  Sent *sorted;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->n_contacts + 1, &place));
  PetscCall(PetscMalloc1(n, &sorted));
  for (PetscInt k = 0; k < n; k++) place[sent[k].number + 1]++;
  for (PetscInt k = 0; k < f->n_contacts; k++) place[k + 1] += place[k];
  /* A counting sort, which is stable: pieces keep their order. */
  for (PetscInt k = 0; k < n; k++) sorted[place[sent[k].number]++] = sent[k];
  PetscCall(UnpackContacts(mesh, n, sorted, p));
  HycoFreeAll(&sorted, &place);
  /* So that the gathered contacts find masters on moved positions as the ranks' own do. */
  PetscCall(HycoPairsSetSearch(f->scene, mesh, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All contacts on rank 0, in the order of one rank, with their surfaces: for errors and for results that need an order.
   The caller destroys both. Collective. Contacts are packed with their nodes' global numbers, which mean the same on
   every rank. */
PetscErrorCode HycoFOMGatherContacts(HycoFOM f, HycoMesh *mesh, HycoPairs *pairs)
{
  const HycoPairs *p = &f->pairs;
  MPI_Datatype type;
  Sent *mine, *all;
  PetscInt n_mine, n;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(pairs, sizeof(*pairs)));
  PetscCall(HycoFOMGatherSurface(f, mesh));
  PetscCall(PackContacts(f->surface, p, &n_mine, &mine));
  /* One count per contact: counts of bytes would overflow an int. */
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)sizeof(Sent), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(HycoConcatenate(HycoComm(f), n_mine, mine, type, sizeof(Sent), &n, &all));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  HycoOnRoot(HycoComm(f), PlaceGathered(f, *mesh, n, all, pairs));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends contacts of rank 0 to the ranks of their slaves. */
static PetscErrorCode SendContacts(HycoFOM f, HycoMesh mesh, const HycoPairs *whole, PetscInt *n_got, Sent **got)
{
  PetscInt *slave, n;
  PetscMPIInt *to;
  Sent *sent;

  PetscFunctionBegin;
  PetscCall(PackContacts(mesh, whole, &n, &sent));
  PetscCall(PetscMalloc2(n, &slave, n, &to));
  for (PetscInt k = 0; k < n; k++) slave[k] = sent[k].slave;
  /* To the owner of the slave: there its row of B is assembled. */
  PetscCall(HycoMeshOwners(HycoComm(f), f->part, n, slave, to));
  PetscCall(HycoSendRows(HycoComm(f), n, to, sizeof(Sent), sent, n_got, got));
  PetscCall(PetscFree2(slave, to));
  PetscCall(PetscFree(sent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the contacts on rank 0, or their error, and sends each to the rank of its slave. */
static PetscErrorCode FindWhole(HycoFOM f, HycoMesh mesh, HycoPairs *whole, PetscInt *n_got, Sent **got)
{
  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), HycoPairsFind(f->scene, mesh->dm, NULL, whole));
  PetscCall(SendContacts(f, mesh, whole, n_got, got));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fallback: contacts found on rank 0 are sent back, and their masters' facets are fetched. Correct for any scene,
   but its memory and time are those of one rank. */
static PetscErrorCode FindOnRoot(HycoFOM f, const HycoSurfaceFacts facts[])
{
  HycoPairs whole;
  HycoMesh mesh;
  Sent *got;
  PetscInt n_got, n = 0, *master;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(&whole, sizeof(whole)));
  /* Those of the failed search. */
  PetscCall(HycoPairsDestroy(&f->pairs));
  PetscCall(HycoFOMGatherSurface(f, &mesh));
  HycoFinally(FindWhole(f, mesh, &whole, &n_got, &got), PetscCall(HycoPairsDestroy(&whole));
              PetscCall(HycoMeshDestroy(&mesh)));
  PetscCall(PetscMalloc1(n_got * HYCO_FACET_NODES, &master));
  for (PetscInt k = 0; k < n_got; k++) {
    PetscCall(PetscArraycpy(master + n, got[k].master, got[k].n));
    n += got[k].n;
  }
  PetscCall(AddNeeded(f, n, master));
  PetscCall(PetscFree(master));
  PetscCall(HycoMeshDestroy(&f->surface));
  PetscCall(FetchSurface(f, &f->surface));
  PetscCall(UnpackContacts(f->surface, n_got, got, &f->pairs));
  /* Facts that a search on one rank would find itself; only for this call. */
  f->pairs.facts = facts;
  PetscCall(HycoPairsSetSearch(f->scene, f->surface, &f->pairs));
  f->pairs.facts = NULL;
  f->pairs.queries = n_got;
  PetscCall(PetscFree(got));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of the contacts in the order of the scene's contacts, then of the slaves' tags and sides. Keys of these:
   the numbers do not depend on the partition. */
static PetscErrorCode NumberContacts(HycoFOM f)
{
  HycoPairs *p = &f->pairs;
  PetscInt64 *key;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p->n, &key));
  PetscCall(PetscFree(p->number));
  PetscCall(PetscMalloc1(p->n + 1, &p->number));
  /* 64 bits: contacts times nodes exceed an int. */
  for (PetscInt k = 0; k < p->n; k++) {
    key[k] = (PetscInt64)p->contact[k] * f->part->n_whole_nodes + f->surface->node_whole[p->slave[k]];
    key[k] = (HYCO_SIDES + 1) * key[k] + HycoSideOf(p->side[k]) + 1; /* HYCO_ONE_SIDE: 0 */
  }
  PetscCall(HycoRankKeys(HycoComm(f), p->n, key, p->number, &f->n_contacts));
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Searches on this rank, and notes whether it has found its contacts. A rank's error must not be raised here: its
   text may differ from that on one rank. */
static PetscErrorCode FOMContactsTry(HycoFOM f, const HycoSurfaceFacts facts[], PetscBool *found)
{
  char message[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCatch(HycoPairsFind(f->scene, f->surface->dm, facts, &f->pairs), ierr, message);
  *found = (PetscBool)!ierr;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the contacts with the facets that the drawn positions need. A search on each rank; rank 0 repeats it if a
   rank fails or if what the ranks have found does not fit together. Collective. */
static PetscErrorCode FOMContactsSearch(HycoFOM f, HycoSurfaceFacts facts[])
{
  PetscInt n, *near;
  PetscBool found, agreed = PETSC_FALSE, moved = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoContactsFacts(HycoComm(f), f->scene, f->part, facts));
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) moved = (PetscBool)(moved || facts[k].moved);
  /* Without maps positions never change, and no slack is needed. */
  PetscCall(HycoContactsCandidates(HycoComm(f), f->fe, moved ? SLACK : 0, &n, &near));
  PetscCall(AddSlaves(f));
  PetscCall(AddNeeded(f, n, near));
  PetscCall(PetscFree(near));
  PetscCall(FetchSurface(f, &f->surface));
  PetscCall(FOMContactsTry(f, facts, &found));
  HycoAllreduce(&found, 1, HYCO_MPI_BOOL, MPI_LAND, HycoComm(f));
  if (found) PetscCall(HycoContactsSynchronise(HycoComm(f), f->scene, f->part, f->surface, &f->pairs, &agreed));
  if (!agreed) PetscCall(FindOnRoot(f, facts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of the masters on this rank's surfaces, at most of one contact, and of all ranks. For the report of
   -hyco_fom_view. */
static PetscErrorCode CountPatches(HycoFOM f)
{
  PetscFunctionBegin;
  f->patches[0] = f->patches[1] = 0;
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) {
    HycoContact c = f->scene->contact[k];
    PetscInt g = 0, here = 0, whole = 0;

    /* Obstacles and rigid masters have no facets to fetch. */
    if (!c->master || c->rigid) continue;
    PetscCall(HycoMeshFindGroup(f->part, "contact", c->master, &g));
    for (PetscInt i = 0; i < f->surface->n_facets; i++) here += f->surface->facet_group[i] == g;
    for (PetscInt i = 0; i < f->part->n_facets;
         i++) { /* a facet is counted by the rank that has its cell's first node */
      const PetscInt *cell = f->part->cells + f->part->facet_cell[i] * f->part->nv;

      whole += f->part->facet_group[i] == g && HycoMeshOwned(f->part, cell[0]) >= 0;
    }
    HycoAllreduce(&whole, 1, MPIU_INT, MPI_SUM, HycoComm(f));
    f->patches[0] = PetscMax(f->patches[0], here);
    f->patches[1] = PetscMax(f->patches[1], whole);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions as drawn; facets within the slack of moved surfaces are fetched at once. */
static PetscErrorCode FindContacts(HycoFOM f)
{
  HycoSurfaceFacts *facts;

  PetscFunctionBegin;
  /* The pairing is that of the drawing, whatever the first parameters are. */
  PetscCall(HycoFESetDrawn(f->fe));
  PetscCall(PetscMalloc1(f->scene->n_contacts, &facts));
  PetscCall(HycoLogEvent(HYCO_EVENT_SEARCH, PETSC_TRUE));
  HycoFinally(FOMContactsSearch(f, facts), PetscCall(HycoLogEvent(HYCO_EVENT_SEARCH, PETSC_FALSE));
              PetscCall(PetscFree(facts)));
  PetscCall(NumberContacts(f));
  PetscCall(CountPatches(f));
  f->width = HycoPairsWidth(&f->pairs);
  HycoAllreduce(&f->width, 1, MPIU_INT, MPI_MAX, HycoComm(f));
  f->searches = (PetscBool)(f->pairs.room > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the potential contacts and their numbers; with several ranks each has those of its slaves. Collective. */
PetscErrorCode HycoFOMFindContacts(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->size == 1) {
    /* One rank has everything: no copy, and node indices are those of the part. */
    f->surface = f->part;
    HycoOnRoot(HycoComm(f), HycoPairsFind(f->scene, f->part->dm, NULL, &f->pairs));
    f->n_contacts = f->pairs.n;
    f->width = HycoPairsWidth(&f->pairs);
    /* Some contact follows its master on moved surfaces. */
    f->searches = (PetscBool)(f->pairs.room > 0);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FindContacts(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all of the sorted nodes are among the needed ones. */
static PetscBool HasNeeded(HycoFOM f, PetscInt n, const PetscInt node[])
{
  for (PetscInt k = 0, at = 0; k < n; k++) {
    while (at < f->n_needed && f->needed[at] < node[k]) at++;
    if (at == f->n_needed || f->needed[at] != node[k]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Replaces the surfaces by those with more facets, and what depends on their nodes. Contacts keep their order, and
   thus the rows of B and Lambda. */
static PetscErrorCode FOMContactsRenew(HycoFOM f)
{
  HycoMesh before = f->surface;
  HycoPairs renumbered;
  Places places;
  PetscInt *index;

  PetscFunctionBegin;
  PetscCall(FetchSurface(f, &f->surface));
  PetscCall(PlacesCreate(f->surface, &places));
  PetscCall(PetscMalloc1(before->n_nodes, &index));
  /* Old nodes in the new surface: nodes are only added. */
  for (PetscInt i = 0; i < before->n_nodes; i++) index[i] = PlaceOf(&places, before->node_global[i]);
  PetscCall(PetscFree2(places.global, places.node));
  PetscCall(HycoPairsRenumber(&f->pairs, index, &renumbered));
  PetscCall(PetscFree(index));
  PetscCall(HycoPairsDestroy(&f->pairs));
  f->pairs = renumbered;
  /* It refers to the nodes of the former surface. */
  PetscCall(HycoFEDestroy(&f->fe_surface));
  PetscCall(HycoMeshDestroy(&before));
  PetscCall(CountPatches(f));
  PetscCall(HycoFOMSetUpSurface(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First without slack: mostly the facets at hand suffice, and nothing is sent but this question. */
static PetscErrorCode FetchMasters(HycoFOM f)
{
  PetscInt n, *near;
  PetscBool has;

  PetscFunctionBegin;
  /* Noted first: one question for each set of positions. */
  f->place = f->fe->place;
  PetscCall(HycoContactsCandidates(HycoComm(f), f->fe, 0, &n, &near));
  PetscCall(HycoSortUnique(&n, near));
  has = HasNeeded(f, n, near);
  PetscCall(PetscFree(near));
  HycoAllreduce(&has, 1, HYCO_MPI_BOOL, MPI_LAND, HycoComm(f));
  if (has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactsCandidates(HycoComm(f), f->fe, SLACK, &n, &near));
  PetscCall(AddNeeded(f, n, near));
  PetscCall(PetscFree(near));
  PetscCall(FOMContactsRenew(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the nodes of f->fe have moved: makes sure that every rank has the facets that its slaves may meet now.
   Collective. */
PetscErrorCode HycoFOMFetchMasters(HycoFOM f)
{
  PetscFunctionBegin;
  /* Fixed masters; all surfaces are here; or the nodes have not moved since. */
  if (!f->searches || f->gathered || f->place == f->fe->place) PetscFunctionReturn(PETSC_SUCCESS);
  HycoLogged(HYCO_EVENT_SEARCH, FetchMasters(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh with all facets around the nodes of this rank's surfaces, its fe at the current parameters, and the places of
   the surfaces' nodes there; the caller destroys them. Collective. Normals at the surfaces' border need facets of cells
   that other ranks have. */
PetscErrorCode HycoFOMWiden(HycoFOM f, HycoMesh *mesh, HycoFE *fe, PetscInt **index)
{
  HycoMesh m = f->surface;
  PetscBool *in;
  Places places;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->part->n_groups, &in));
  PetscCall(HycoMarkContactGroups(f->scene, f->part, in));
  PetscCall(HycoMeshRings(HycoComm(f), f->scene, f->part, in, m->n_nodes, m->node_global, mesh));
  PetscCall(PetscFree(in));
  PetscCall(HycoFECreate(f->scene, (*mesh)->dm, fe));
  PetscCall(HycoFESetParameters(*fe, f->fe->mu));
  /* The signs on which all ranks agree: this mesh has no cells to tell them. */
  PetscCall(PetscArraycpy((*fe)->mirrored, f->fe->mirrored, f->scene->n_bodies));
  PetscCall(PlacesCreate(*mesh, &places));
  PetscCall(PetscMalloc1(m->n_nodes, index));
  for (PetscInt i = 0; i < m->n_nodes; i++) (*index)[i] = PlaceOf(&places, m->node_global[i]);
  PetscCall(PetscFree2(places.global, places.node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces this rank's contacts by those of all ranks, on rank 0. */
PetscErrorCode HycoFOMKeepOnRoot(HycoFOM f)
{
  HycoPairs pairs;
  HycoMesh mesh;

  PetscFunctionBegin;
  PetscCall(HycoFOMGatherContacts(f, &mesh, &pairs));
  PetscCall(HycoPairsDestroy(&f->pairs));
  PetscCall(HycoMeshDestroy(&f->surface));
  f->pairs = pairs;
  f->surface = mesh;
  f->gathered = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* group[] must be false before; the groups of slaves and masters are set. */
PetscErrorCode HycoMarkContactGroups(HycoScene scene, HycoMesh mesh, PetscBool group[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2 * scene->n_contacts; k++) {
    HycoContact c = scene->contact[k / 2];
    PetscInt g = 0;

    if (k % 2 && !c->master) continue;
    PetscCall(HycoMeshFindGroup(mesh, "contact", k % 2 ? c->master : c->slave, &g));
    group[g] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the fe of this rank's surfaces, and the scatter from U to their nodes (ghosts of any rank). Collective. */
PetscErrorCode HycoFOMSetUpSurface(HycoFOM f)
{
  const PetscInt dim = f->part->dim;
  IS is;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), f->surface ? HycoFECreate(f->scene, f->surface->dm, &f->fe_surface) : PETSC_SUCCESS);
  /* Without U there is nothing to scatter. */
  if (f->gathered) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDestroyAll(&f->to_surface, &f->U_surface);
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->fe_surface->n_dof, &f->U_surface));
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, f->surface->n_nodes, f->surface->node_global, PETSC_COPY_VALUES, &is));
  PetscCall(VecScatterCreate(f->U, is, f->U_surface, NULL, &f->to_surface));
  PetscCall(ISDestroy(&is));
  PetscCall(PetscFree(f->u_surface));
  PetscCall(PetscCalloc1(f->fe_surface->n_dof, &f->u_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}
