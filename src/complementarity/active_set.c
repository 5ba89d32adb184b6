/*
  The primal-dual active set method, the paper's section 6.2 (convergence: Hintermueller, Ito, Kunisch, SIAM J. Optim.
  13 (2002) 865-888): solve with the contacts of the set closed and the others open, remove contacts under tension from
  the set and add those that penetrate, until the set does not change. This loop is used with functions for the solve on
  a set and for the violations: with a dense flexibility, one with free unknowns, gap coordinates, or a coarser level of
  these.
*/
#include <hycolcp.h>

/* State of the loop. */
typedef struct {
  unsigned long long *past; /* hashes of the previous sets */
  PetscInt room, since;     /* size of past; first iteration in which a repeated set is searched */
  PetscBool one;            /* a set was repeated: one contact changes at a time */
  PetscBool *violates;
} History;

/* Order matters: the hash identifies a set, with a probability of error of 2^-64 per pair. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[])
{
  unsigned long long hash = HYCO_HASH_START;

  for (PetscInt i = 0; i < n; i++) {
    const unsigned char bit = active[i] ? 1 : 0;

    hash = HycoHash(hash, &bit, 1);
  }
  return hash;
}

/* Hash of the distributed set, the same on every rank. */
static PetscErrorCode SetHash(const HycoActiveSet *e, const PetscBool active[], unsigned long long *hash)
{
  unsigned long long mine;

  PetscFunctionBegin;
  mine = *hash = HycoSetHash(e->n, active);
  if (e->comm == MPI_COMM_NULL) PetscFunctionReturn(PETSC_SUCCESS);
  /* The first contact's number tells the ranks apart: without it, equal sets on two ranks would cancel in the
     exclusive or. */
  mine = HycoHash(mine, &e->first, sizeof(e->first));
  PetscCallMPI(MPI_Allreduce(&mine, hash, 1, MPI_UNSIGNED_LONG_LONG, MPI_BXOR, e->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the set occurred before; stores it as that of iteration `its`. */
static PetscErrorCode ActiveSetRepeats(const HycoActiveSet *e, const PetscBool active[], PetscInt its, History *h,
                                       PetscBool *met)
{
  PetscFunctionBegin;
  HycoGrow(its, h->room, h->past);
  PetscCall(SetHash(e, active, &h->past[its]));
  *met = PETSC_FALSE;
  /* All hashes are compared: iterations are tens, and a solve on a set costs much more. */
  for (PetscInt t = h->since; t < its; t++) *met = (PetscBool)(*met || h->past[t] == h->past[its]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reduces over the ranks that share the contacts. */
static PetscErrorCode ActiveSetReduce(const HycoActiveSet *e, MPI_Op op, PetscInt *value)
{
  PetscFunctionBegin;
  if (e->comm != MPI_COMM_NULL) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 1, MPIU_INT, op, e->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes every contact with a violation; after a cycle only the last of them, which terminates in exact arithmetic
   (K. G. Murty's least index rule). */
static PetscErrorCode ActiveSetChange(const HycoActiveSet *e, const History *h, PetscBool active[], PetscInt *changes)
{
  PetscInt last = -1;

  PetscFunctionBegin;
  *changes = 0;
  if (h->one) {
    /* Numbers over all ranks: which contact changes does not depend on the partition. */
    for (PetscInt i = 0; i < e->n; i++) last = h->violates[i] ? e->first + i : last;
    PetscCall(ActiveSetReduce(e, MPI_MAX, &last));
  }
  for (PetscInt i = 0; i < e->n; i++) {
    if (!h->violates[i] || (h->one && e->first + i != last)) continue;
    active[i] = (PetscBool)!active[i];
    (*changes)++;
  }
  PetscCall(ActiveSetReduce(e, MPI_SUM, changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One iteration. */
static PetscErrorCode ActiveSetStep(const HycoActiveSet *e, PetscInt its, History *h, PetscBool active[],
                                    PetscInt *changes, PetscBool *singular)
{
  PetscInt n_active = 0;

  PetscFunctionBegin;
  PetscCall(e->solve(e->ctx, active, singular));
  /* The caller decides: a dependent contact leaves the set, or another method is tried. */
  if (*singular) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(e->violations(e->ctx, active, h->violates));
  /* Counted for a monitor alone. */
  for (PetscInt i = 0; e->monitor && i < e->n; i++) n_active += active[i];
  if (e->monitor) PetscCall(ActiveSetReduce(e, MPI_SUM, &n_active));
  PetscCall(ActiveSetChange(e, h, active, changes));
  if (e->monitor) PetscCall(e->monitor(its, n_active, *changes, e->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Runs from the given set to a solution, a repeated set (a cycle, unless changes one by one are allowed), or the
   limit; *its counts solves. Collective on e->comm (MPI_COMM_NULL: this process alone). */
PetscErrorCode HycoActiveSetRun(const HycoActiveSet *e, PetscBool active[], PetscInt *its, HycoLCPStatus *status)
{
  History h = {NULL, 0, 0, PETSC_FALSE, NULL};
  PetscBool last = PETSC_FALSE;

  PetscFunctionBegin;
  *status = HYCO_LCP_LIMIT;
  PetscCall(PetscMalloc1(e->n, &h.violates));
  for (*its = 0; *its < e->max_its && *status == HYCO_LCP_LIMIT && !last;) {
    PetscBool met = PETSC_FALSE, singular = PETSC_FALSE, more = PETSC_FALSE;
    PetscInt changes;

    if (e->restart) PetscCall(e->restart(e->ctx, *its, active, &more));
    /* A fresh set starts a new history. */
    if (more) h.since = *its;
    PetscCall(ActiveSetRepeats(e, active, *its, &h, &met));
    if (met && !e->one_by_one) {
      *status = HYCO_LCP_CYCLE;
      break;
    }
    if (met) { /* repeated in spite of single changes: round-off decides, and the residuals are checked later */
      last = h.one;
      h.one = PETSC_TRUE;
      h.since = *its;
    }
    (*its)++;
    PetscCall(ActiveSetStep(e, *its, &h, active, &changes, &singular));
    if (singular) *status = HYCO_LCP_SINGULAR;
    /* Singular: the status ends the loop. Changes: the next set is solved. */
    if (singular || changes) continue;
    more = PETSC_FALSE;
    /* A form may have solved a coarser or an inexact problem: more says that another round of sets follows. */
    if (e->settled) PetscCall(e->settled(e->ctx, &more));
    if (more)
      h.since = *its;
    else
      *status = HYCO_LCP_SOLVED;
  }
  HycoFreeAll(&h.violates, &h.past);
  PetscFunctionReturn(PETSC_SUCCESS);
}
