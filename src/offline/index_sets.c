/* The sets A, I and A_lambda of an RID, by node and by contact: (21)-(22), (32)-(37). */
#include <hycodomain.h>

/* The nodes of contact k: j = -1 the slave, then its masters. */
static PetscInt ContactNode(const HycoPairs *pairs, PetscInt k, PetscInt j)
{
  return j < 0 ? pairs->slave[k] : pairs->master[pairs->master_start[k] + j];
}

static PetscInt CountMasters(const HycoPairs *pairs, PetscInt k)
{
  return pairs->master_start[k + 1] - pairs->master_start[k];
}

/* Gamma_I^C, (32): of a contact that misses a node the gap cannot be computed, nor the force on those it has. */
static void CloseIncomplete(const HycoPairs *pairs, PetscInt role[])
{
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt masters = CountMasters(pairs, k);
    PetscBool missing = PETSC_FALSE;

    for (PetscInt j = -1; j < masters; j++)
      missing = (PetscBool)(missing || role[ContactNode(pairs, k, j)] == HYCO_ROLE_OUTSIDE);
    for (PetscInt j = -1; missing && j < masters; j++) {
      if (role[ContactNode(pairs, k, j)] == HYCO_ROLE_A) role[ContactNode(pairs, k, j)] = HYCO_ROLE_INTERFACE;
    }
  }
}

/*
  B[A_lambda, A_c] needs full row rank (property 1). A contact whose slave is in A has that node for itself. One whose
  slave is on the interface acts on masters alone: it stays if it has one master that no other contact has. Of a facet's
  masters, shared by several contacts, its force would be badly determined (errors several times larger were measured):
  they join the interface. So do all masters of such slaves on moved surfaces, which change. *lost: nodes that left A.
*/
static PetscErrorCode CloseDependent(HycoMesh m, const HycoPairs *pairs, PetscInt role[], PetscInt *lost)
{
  PetscBool *taken, *close;

  PetscFunctionBegin;
  *lost = 0;
  PetscCall(PetscCalloc2(m->n_nodes, &taken, m->n_nodes, &close));
  for (PetscInt k = 0; k < pairs->n; k++) {
    if (role[pairs->slave[k]] == HYCO_ROLE_A) taken[pairs->slave[k]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt masters = CountMasters(pairs, k), *node = pairs->master + pairs->master_start[k];

    if (role[pairs->slave[k]] == HYCO_ROLE_A || !masters) continue;
    if (masters == 1 && !taken[node[0]] && !HycoPairsMoved(pairs, k))
      taken[node[0]] = PETSC_TRUE;
    else {
      for (PetscInt j = 0; j < masters; j++) close[node[j]] = (PetscBool)(role[node[j]] == HYCO_ROLE_A);
    }
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (!close[i]) continue;
    role[i] = HYCO_ROLE_INTERFACE;
    (*lost)++;
  }
  PetscCall(PetscFree2(taken, close));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The roles of the nodes. */
static PetscErrorCode SetRoles(HycoMesh m, const HycoPairs *pairs, const PetscBool in[], PetscInt role[])
{
  PetscInt lost = 1;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) role[i] = HYCO_ROLE_OUTSIDE;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    if (in[k / m->nv]) role[m->cells[k]] = HYCO_ROLE_A;
  }
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) { /* connected to Omega_B */
    if (!in[k / m->nv] && role[m->cells[k]] == HYCO_ROLE_A) role[m->cells[k]] = HYCO_ROLE_INTERFACE;
  }
  CloseIncomplete(pairs, role);
  while (lost) PetscCall(CloseDependent(m, pairs, role, &lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (35)-(36): a contact is in A_lambda if its row acts on a free unknown of A_c. */
static PetscErrorCode FindContacts(HycoFE fe, HycoPairs *pairs, const PetscInt role[], PetscInt in_rid[])
{
  const PetscInt n = pairs->n, dim = fe->dim, entries = HycoPairsWidth(pairs) * dim * n;
  PetscInt *start, *dof;
  PetscReal *value, *gap;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(n + 1, &start, entries, &dof, entries, &value, n, &gap));
  PetscCall(HycoContactRows(fe, pairs, start, dof, value, gap));
  for (PetscInt k = 0; k < n; k++) {
    in_rid[k] = 0;
    for (PetscInt j = start[k]; j < start[k + 1]; j++) in_rid[k] = in_rid[k] || role[dof[j] / dim] == HYCO_ROLE_A;
  }
  PetscCall(PetscFree4(start, dof, value, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of moved surfaces, whose rows are those of one place: if any node that it meets is in A and not fixed. */
static void FindMovedContacts(HycoFE fe, const HycoPairs *rows, const PetscInt of[], const PetscInt role[],
                              PetscInt in_rid[])
{
  for (PetscInt r = 0; r < rows->n; r++) {
    for (PetscInt j = -1; j < CountMasters(rows, r); j++) {
      const PetscInt i = ContactNode(rows, r, j);

      for (PetscInt c = 0; c < fe->dim && role[i] == HYCO_ROLE_A; c++)
        in_rid[of[r]] = in_rid[of[r]] || !fe->fixed[i * fe->dim + c];
    }
  }
}

PetscErrorCode HycoRIDSets(HycoFE fe, HycoPairs *pairs, const HycoPairs *rows, const PetscInt of[],
                           const PetscBool in[], PetscInt role[], PetscInt in_rid[])
{
  PetscFunctionBegin;
  PetscCall(SetRoles(fe->mesh, rows, in, role));
  PetscCall(PetscArrayzero(in_rid, pairs->n));
  if (of)
    FindMovedContacts(fe, rows, of, role, in_rid);
  else
    PetscCall(FindContacts(fe, pairs, role, in_rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
