/* The sets A, I and A_lambda of an RID, by node and by contact: (21)-(22), (32)-(37). */
#include <hycodomain.h>

/* The contacts with their nodes' sets. */
typedef struct {
  const HycoPairs *pairs;
  const PetscInt *index; /* by node of the pairs: its node of the reduced mesh */
  PetscInt n, *sets;     /* of the reduced mesh, as in HycoRIDSets() */
} Sets;

/* The nodes of contact k: j = -1 the slave, then its masters. `rows` of a moved contact lists it once for each set
   of masters. */
static PetscInt ContactNode(const HycoPairs *pairs, PetscInt k, PetscInt j)
{
  return j < 0 ? pairs->slave[k] : pairs->master[pairs->master_start[k] + j];
}

static PetscInt CountMasters(const HycoPairs *pairs, PetscInt k)
{
  return pairs->master_start[k + 1] - pairs->master_start[k];
}

static PetscInt *SetsOf(const Sets *s, PetscInt k, PetscInt j)
{
  return &s->sets[s->index[ContactNode(s->pairs, k, j)]];
}

/* Gamma_I^C, (32): if a contact lacks a node, neither its gap nor the force on its other nodes can be computed. */
static void CloseIncomplete(const Sets *s)
{
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    const PetscInt masters = CountMasters(s->pairs, k);
    PetscBool missing = PETSC_FALSE;

    for (PetscInt j = -1; j < masters; j++) missing = (PetscBool)(missing || *SetsOf(s, k, j) == 0);
    for (PetscInt j = -1; missing && j < masters; j++) {
      /* Nodes outside the RID (0) stay outside: the interface is part of it. */
      if (*SetsOf(s, k, j) == 2) *SetsOf(s, k, j) = 1;
    }
  }
}

/*
  B[A_lambda, A_c] needs full row rank (property 1). A contact whose slave is in A has that node for itself. One whose
  slave is on the interface acts only on masters: it is kept if it has one master that no other contact has. With
  masters shared by several contacts, its force would be ill determined (errors several times larger were measured):
  these masters join the interface. So do all masters of such slaves on moved surfaces, because they change. *lost:
  nodes removed from A.
*/
static PetscErrorCode CloseDependent(const Sets *s, PetscInt *lost)
{
  PetscBool *taken, *close;

  PetscFunctionBegin;
  *lost = 0;
  PetscCall(PetscCalloc2(s->n, &taken, s->n, &close));
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    if (*SetsOf(s, k, -1) == 2) taken[SetsOf(s, k, -1) - s->sets] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    const PetscInt masters = CountMasters(s->pairs, k);

    if (*SetsOf(s, k, -1) == 2 || !masters) continue;
    if (masters == 1 && !taken[SetsOf(s, k, 0) - s->sets] && !HycoPairsMoved(s->pairs, k))
      taken[SetsOf(s, k, 0) - s->sets] = PETSC_TRUE;
    else {
      /* Collected first, applied after the loop: the result does not depend on the order of contacts. */
      for (PetscInt j = 0; j < masters; j++) close[SetsOf(s, k, j) - s->sets] = (PetscBool)(*SetsOf(s, k, j) == 2);
    }
  }
  for (PetscInt i = 0; i < s->n; i++) {
    if (!close[i]) continue;
    s->sets[i] = 1;
    (*lost)++;
  }
  PetscCall(PetscFree2(taken, close));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (35)-(36): a contact is in A_lambda if its row acts on a free unknown of A_c. */
static PetscErrorCode FindContacts(HycoFE fe, HycoPairs *pairs, const Sets *s, PetscInt in_rid[])
{
  HycoRows rows = {0};

  PetscFunctionBegin;
  /* Rows at the training parameters: empty ones, without a master, are not in A_lambda. */
  PetscCall(HycoContactRows(fe, pairs, &rows));
  for (PetscInt k = 0; k < pairs->n; k++) {
    for (PetscInt j = rows.start[k]; j < rows.start[k + 1]; j++)
      in_rid[k] = in_rid[k] || s->sets[s->index[rows.dof[j] / fe->dim]] == 2;
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For moved surfaces, whose rows are those at one set of parameters: if any node that it meets is in A and not
   fixed. */
static void FindMovedContacts(HycoFE fe, const Sets *s, const PetscInt of[], PetscInt in_rid[])
{
  for (PetscInt r = 0; r < s->pairs->n; r++) {
    for (PetscInt j = -1; j < CountMasters(s->pairs, r); j++) {
      const PetscInt i = ContactNode(s->pairs, r, j);

      for (PetscInt c = 0; c < fe->dim && *SetsOf(s, r, j) == 2; c++)
        in_rid[of[r]] = in_rid[of[r]] || !fe->fixed[i * fe->dim + c];
    }
  }
}

/* The order is that of the definitions: incomplete contacts join I, then masters that would make B rank deficient,
   as long as that makes others so; A_lambda follows from the A that is left. */
PetscErrorCode HycoRIDSets(HycoFE fe, HycoPairs *pairs, const HycoPairs *rows, const PetscInt of[],
                           const PetscInt index[], PetscInt n, PetscInt sets[], PetscInt in_rid[])
{
  const Sets s = {rows, index, n, sets};
  PetscInt lost = 1;

  PetscFunctionBegin;
  CloseIncomplete(&s);
  /* A master that joins I may leave another contact incomplete. */
  while (lost) PetscCall(CloseDependent(&s, &lost));
  PetscCall(PetscArrayzero(in_rid, pairs->n));
  if (of)
    FindMovedContacts(fe, &s, of, in_rid);
  else
    PetscCall(FindContacts(fe, pairs, &s, in_rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
