/*
  Tied nodes: u_slave = sum of weights times u_master. The unknown of a slave's displacement is replaced by the
  difference from this sum, which is 0, so that the bodies on both sides share the masters' unknowns. A cell with a tied
  node has rows and columns for its masters: they are at the end of its cone in the DM (plex.c), so that queries for the
  cells around a node include it.
*/
#include <hycomesh.h>

#define TIES "HycoTies"

/* Arrays of n entries (slave, master, weight), grouped by slave. Counted references: meshes, DMs and submeshes
   share one list. */
PetscErrorCode HycoTiesCreate(PetscInt n, HycoCellType type, HycoTies *ties)
{
  HycoTies t;

  PetscFunctionBegin;
  PetscCall(PetscNew(ties));
  t = *ties;
  t->references = 1;
  t->n = n;
  t->type = type;
  PetscCall(PetscCalloc1(n, &t->slave));
  PetscCall(PetscCalloc1(n, &t->master));
  PetscCall(PetscCalloc1(n, &t->tie));
  PetscCall(PetscCalloc1(n, &t->body));
  PetscCall(PetscCalloc1(n, &t->weight));
  PetscCall(PetscCalloc1(n, &t->reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Releases one reference; NULL-safe. */
PetscErrorCode HycoTiesDestroy(HycoTies *ties)
{
  HycoTies t = *ties;

  PetscFunctionBegin;
  *ties = NULL;
  if (!t || --t->references) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&t->slave, &t->master, &t->tie, &t->body, &t->weight, &t->reach, &t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0's ties on all ranks: slaves and masters are known by tags, so that every rank finds those of its part.
   The list is that of the tied nodes alone. Collective. */
PetscErrorCode HycoTiesBcast(MPI_Comm comm, HycoTies *ties)
{
  PetscInt head[2] = {*ties ? (*ties)->n : 0, *ties ? (PetscInt)(*ties)->type : 0}, n;
  HycoTies t;

  PetscFunctionBegin;
  HycoBcast(head, 2, MPIU_INT, comm);
  n = head[0];
  /* Also the other ranks then keep NULL: a scene without ties costs nothing. */
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  if (!*ties) PetscCall(HycoTiesCreate(n, (HycoCellType)head[1], ties));
  t = *ties;
  HycoBcast(t->slave, n, MPIU_INT, comm);
  HycoBcast(t->master, n, MPIU_INT, comm);
  HycoBcast(t->tie, n, MPIU_INT, comm);
  HycoBcast(t->body, n, MPIU_INT, comm);
  HycoBcast(t->weight, n, MPIU_REAL, comm);
  HycoBcast(t->reach, n, MPIU_REAL, comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The container's destructor in the form of PETSc's version (hycocompat.h). */
static PetscErrorCode DestroyAttached(HycoContained contained)
{
  HycoTies ties = (HycoTies)HycoContainedContext(contained);

  PetscFunctionBegin;
  PetscCall(HycoTiesDestroy(&ties));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The container holds a reference, released with the DM. */
PetscErrorCode HycoTiesAttach(DM dm, HycoTies ties)
{
  PetscContainer container;

  PetscFunctionBegin;
  if (!ties) PetscFunctionReturn(PETSC_SUCCESS);
  ties->references++;
  PetscCall(PetscContainerCreate(PETSC_COMM_SELF, &container));
  PetscCall(PetscContainerSetPointer(container, ties));
  PetscCall(PetscContainerSetCtxDestroy(container, DestroyAttached));
  PetscCall(PetscObjectCompose((PetscObject)dm, TIES, (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed: valid as long as the DM, or a reference of the caller's own. */
PetscErrorCode HycoTiesOf(DM dm, HycoTies *ties)
{
  PetscContainer container;

  PetscFunctionBegin;
  *ties = NULL;
  PetscCall(PetscObjectQuery((PetscObject)dm, TIES, (PetscObject *)&container));
  if (container) PetscCall(PetscContainerGetPointer(container, (void **)ties));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One past the last entry of the slave of entry k. */
static PetscInt TieEnd(HycoTies t, PetscInt k)
{
  PetscInt end = k + 1;

  while (end < t->n && t->slave[end] == t->slave[k]) end++;
  return end;
}

/* Finds the tied nodes of the mesh and their masters. node: nodes by ascending tag (tag). */
static PetscErrorCode FindTied(HycoMesh m, const PetscInt tag[], const PetscInt node[])
{
  HycoTies t = m->ties;
  PetscInt *entry;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &entry));
  for (PetscInt i = 0; i < m->n_nodes; i++) m->tied_at[i] = entry[i] = -1;
  for (PetscInt k = 0; k < t->n; k = TieEnd(t, k)) {
    PetscInt at;

    /* A negative `at`: the slave is in another part of the mesh. */
    PetscCall(PetscFindInt(t->slave[k], m->n_nodes, tag, &at));
    if (at >= 0) entry[node[at]] = k;
    m->n_tied += at >= 0;
  }
  PetscCall(PetscMalloc1(m->n_tied, &m->tied));
  PetscCall(PetscMalloc1(m->n_tied, &m->tied_entry));
  PetscCall(PetscMalloc1(m->n_tied + 1, &m->tied_start));
  PetscCall(PetscMalloc1(t->n, &m->tied_master));
  /* Counted again while the lists are filled, in the order of the nodes, not of the ties. */
  m->n_tied = m->tied_start[0] = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt k = m->n_tied;

    if (entry[i] < 0) continue;
    m->tied_at[i] = m->n_tied++;
    m->tied[k] = i;
    m->tied_entry[k] = entry[i];
    m->tied_start[k + 1] = m->tied_start[k];
    for (PetscInt j = entry[i]; j < TieEnd(t, entry[i]); j++) {
      PetscInt at;

      PetscCall(PetscFindInt(t->master[j], m->n_nodes, tag, &at));
      PetscCheck(at >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "node %d is tied to a node that this part of the mesh does not have", (int)t->slave[j]);
      m->tied_master[m->tied_start[k + 1]++] = node[at];
    }
  }
  PetscCall(PetscFree(entry));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters of a cell's nodes that are not nodes of the cell, ascending; returns their number. They are the
   additional rows and columns of the cell's matrix. */
static PetscInt TieMasters(HycoMesh m, PetscInt cell, PetscInt follow[])
{
  const PetscInt *own = m->cells + cell * m->nv;
  PetscInt n = 0;

  for (PetscInt v = 0; v < m->nv; v++) {
    const PetscInt k = m->tied_at[own[v]];

    for (PetscInt j = k < 0 ? 0 : m->tied_start[k]; k >= 0 && j < m->tied_start[k + 1]; j++) {
      const PetscInt master = m->tied_master[j];
      PetscBool known = PETSC_FALSE;
      PetscInt at = n;

      for (PetscInt w = 0; w < m->nv; w++) known = (PetscBool)(known || own[w] == master);
      for (PetscInt w = 0; w < n; w++) known = (PetscBool)(known || follow[w] == master);
      if (known) continue;
      /* Insertion: a cell follows tens of nodes at most. */
      for (; at > 0 && follow[at - 1] > master; at--) follow[at] = follow[at - 1];
      follow[at] = master;
      n++;
    }
  }
  return n;
}

/* By cell, the masters that its tied nodes follow; sizes first, then the lists. */
static PetscErrorCode FindTiedNodes(HycoMesh m)
{
  PetscInt follow[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells + 1, &m->follow_start));
  m->follow_start[0] = 0;
  for (PetscInt e = 0; e < m->n_cells; e++) m->follow_start[e + 1] = m->follow_start[e] + TieMasters(m, e, follow);
  PetscCall(PetscMalloc1(m->follow_start[m->n_cells], &m->follow));
  for (PetscInt e = 0; e < m->n_cells; e++) (void)TieMasters(m, e, m->follow + m->follow_start[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the ties of local tables (NULL: none) and finds which of its nodes are tied; shares the list by
   reference. Needs node_id and cells. Not collective. */
PetscErrorCode HycoMeshSetTies(HycoMesh m, HycoTies ties)
{
  PetscInt *tag, *node;

  PetscFunctionBegin;
  PetscCall(HycoTiesDestroy(&m->ties));
  HycoFreeAll(&m->tied, &m->tied_start, &m->tied_entry, &m->tied_master, &m->tied_at, &m->follow_start, &m->follow);
  m->n_tied = 0;
  if (!ties) PetscFunctionReturn(PETSC_SUCCESS);
  ties->references++;
  m->ties = ties;
  PetscCall(PetscMalloc1(m->n_nodes, &m->tied_at));
  PetscCall(PetscMalloc2(m->n_nodes, &tag, m->n_nodes, &node));
  PetscCall(PetscArraycpy(tag, m->node_id, m->n_nodes));
  for (PetscInt i = 0; i < m->n_nodes; i++) node[i] = i;
  PetscCall(PetscSortIntWithArray(m->n_nodes, tag, node));
  PetscCall(FindTied(m, tag, node));
  PetscCall(PetscFree2(tag, node));
  /* The reverse lists too: which tied nodes follow a node. */
  PetscCall(FindTiedNodes(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
