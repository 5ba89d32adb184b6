/*
  Rows of B that do not change in the bodies' axes from one prediction to the next, as where a stated normal turns with
  a body or the bodies do not move past each other: C_b B_b^T and B_b C_b B_b^T do not either, in any term of C_b. A
  column of each is computed when its contact is in a problem for the first time, and kept.
*/
#include <hycobodies.h>

#define SAME_ENTRY 1e-14 /* of 1, the largest entry of B: 45 eps, weights of one master found again */
#define MOST_BYTES 1e9

/* Whether the rows are the last ones. */
static PetscBool RowCacheIsSame(HycoBodiesWork o, PetscInt m)
{
  const HycoBodiesRowCache *kept = &o->kept;

  if (!kept->start) return PETSC_FALSE;
  /* Cheapest first: a contact that has another number of masters differs here. */
  for (PetscInt k = 0; k <= m; k++) {
    if (kept->start[k] != o->row_start[k]) return PETSC_FALSE;
  }
  for (PetscInt e = 0; e < o->row_start[m]; e++) {
    /* Values within round-off are the same: a point that is computed anew in the body's axes has other last digits. */
    if (kept->at[e] != o->row_at[e] || PetscAbsReal(kept->value[e] - o->row[e]) > SAME_ENTRY) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The arrays P and W stay, with NULL entries: the next rows have as many. */
static PetscErrorCode ForgetColumns(HycoBodiesRowCache *kept, PetscInt n)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; kept->P && i < n; i++) HycoFreeAll(&kept->P[i], &kept->W[i], &kept->blend[i]);
  kept->bytes = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After Reset() `bodies` is NULL, and there is nothing to count. */
PetscErrorCode HycoBodiesResetRowCache(HycoBodiesWork o)
{
  HycoBodiesRowCache *kept = &o->kept;

  PetscFunctionBegin;
  if (o->bodies) PetscCall(ForgetColumns(kept, kept->m * o->bodies->n));
  HycoFreeAll(&kept->start, &kept->at, &kept->value, &kept->P, &kept->W, &kept->blend, &kept->at_weights);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first prediction only takes the rows; columns are worth their memory once the same rows have come twice. The
   products depend on the rows B and on nothing else that a parameter of loads or gaps changes. */
PetscErrorCode HycoBodiesKeepRows(HycoBodiesWork o, PetscInt m)
{
  HycoBodiesRowCache *kept = &o->kept;
  const PetscInt n = m * o->bodies->n;

  PetscFunctionBegin;
  kept->same = RowCacheIsSame(o, m);
  if (kept->same && !kept->P) {
    PetscCall(PetscCalloc1(n + 1, &kept->P));
    PetscCall(PetscCalloc1(n + 1, &kept->W));
    PetscCall(PetscCalloc1(n + 1, &kept->blend));
    PetscCall(PetscCalloc1(n + 1, &kept->at_weights));
  }
  if (kept->same) PetscFunctionReturn(PETSC_SUCCESS);
  kept->count++;
  /* Columns are products with the old rows. */
  PetscCall(ForgetColumns(kept, n));
  HycoFreeAll(&kept->start, &kept->at, &kept->value);
  kept->m = m;
  HycoDuplicate(m + 1, o->row_start, &kept->start);
  HycoDuplicate(o->row_start[m] + 1, o->row_at, &kept->at);
  HycoDuplicate(o->row_start[m] + 1, o->row, &kept->value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W[j] = the products of P, the displacements of body b, with the rows. */
static void RowCacheMultiply(HycoBodiesWork o, PetscInt b, const PetscReal P[], PetscReal W[])
{
  const PetscInt lo = o->bodies->start[b], hi = o->bodies->start[b + 1];

  for (PetscInt j = 0; j < o->kept.m; j++) {
    W[j] = 0;
    for (PetscInt e = o->row_start[j]; e < o->row_start[j + 1]; e++) {
      if (o->row_at[e] >= lo && o->row_at[e] < hi) W[j] += o->row[e] * P[o->row_at[e] - lo];
    }
  }
}

/* Of contact k in body b, if its row has entries there. */
static PetscErrorCode KeepInBody(HycoBodiesWork o, PetscInt k, PetscInt b)
{
  HycoBodiesRowCache *kept = &o->kept;
  const HycoSubstructure *own = &o->bodies->body[b];
  const PetscInt lo = o->bodies->start[b], at = k * o->bodies->n + b;
  const size_t n = (size_t)own->n;

  PetscFunctionBegin;
  for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++) {
    /* P sums C's columns over the row's entries in this body, then W multiplies by all rows: n + m numbers for
       each term. */
    const PetscInt place = o->row_at[e] - lo;

    if (place < 0 || place >= own->n) continue;
    if (!kept->P[at]) {
      PetscCall(PetscCalloc1((size_t)own->C.n_terms * n, &kept->P[at]));
      PetscCall(PetscMalloc1((size_t)own->C.n_terms * (size_t)kept->m, &kept->W[at]));
      kept->bytes += 8 * (PetscReal)own->C.n_terms * (PetscReal)(own->n + kept->m);
    }
    for (PetscInt t = 0; t < own->C.n_terms; t++)
      HycoFlexibilityAdd(&own->C, t, place, o->row[e], kept->P[at] + (size_t)t * n);
  }
  for (PetscInt t = 0; t < own->C.n_terms && kept->P[at]; t++)
    RowCacheMultiply(o, b, kept->P[at] + (size_t)t * n, kept->W[at] + (size_t)t * (size_t)kept->m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contacts are made one by one as they close: those that never do cost neither time nor memory. */
PetscErrorCode HycoBodiesKeep(HycoBodiesWork o, PetscInt n, const PetscInt contact[])
{
  HycoBodiesRowCache *kept = &o->kept;
  const PetscInt bodies = o->bodies->n;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n && kept->same; i++) {
    PetscBool known = PETSC_FALSE;

    /* A contact's column is there if any body has it; a row with no entry at all is looked at again each time, at
       no cost. */
    for (PetscInt b = 0; b < bodies; b++) known = (PetscBool)(known || kept->P[contact[i] * bodies + b]);
    for (PetscInt b = 0; b < bodies && !known; b++) PetscCall(KeepInBody(o, contact[i], b));
    /* The columns so far stay allocated until the rows change; from here on the callers compute without them. */
    if (kept->bytes > MOST_BYTES) kept->same = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1 / kappa and the weights are applied here, so that the kept columns serve any stiffness and shape at these
   rows. */
void HycoBodiesRowCacheGet(HycoBodiesWork o, PetscInt k, PetscInt n, const PetscInt contact[], PetscReal row[])
{
  const HycoSubstructures b = o->bodies;

  for (PetscInt i = 0; i < n; i++) row[i] = 0;
  for (PetscInt j = 0; j < b->n; j++) {
    /* W[k][j] is null where contact k does not touch body j. */
    const PetscReal *W = o->kept.W[k * b->n + j], scale = 1 / o->kappa[j];

    for (PetscInt i = 0; W && i < n; i++) {
      PetscReal blended;

      HycoFlexibilityBlend(&b->body[j].C, o->share[j], 1, (size_t)o->kept.m, W + contact[i], &blended);
      row[i] += scale * blended;
    }
  }
}

/* P of contact k in body j at the present weights; made once for these. */
static PetscErrorCode BlendColumn(HycoBodiesWork o, PetscInt k, PetscInt j, const PetscReal **column)
{
  HycoBodiesRowCache *kept = &o->kept;
  const HycoSubstructure *own = &o->bodies->body[j];
  const PetscInt at = k * o->bodies->n + j;

  PetscFunctionBegin;
  *column = kept->P[at];
  if (own->C.n_terms == 1 && o->share[j][0] == 1) PetscFunctionReturn(PETSC_SUCCESS);
  if (!kept->blend[at]) {
    PetscCall(PetscMalloc1(own->n + 1, &kept->blend[at]));
    kept->bytes += 8 * (PetscReal)own->n;
    /* No weights have this number: the room is not yet a column. */
    kept->at_weights[at] = -1;
  }
  *column = kept->blend[at];
  if (kept->at_weights[at] == kept->weights[j]) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFlexibilityBlend(&own->C, o->share[j], own->n, (size_t)own->n, kept->P[at], kept->blend[at]);
  /* Weights are compared by their number, which grows with each change, and not entry by entry. */
  kept->at_weights[at] = kept->weights[j];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u -= C B^T Lambda, blended between the samples; kappa is the body's stiffness relative to that of its samples. */
PetscErrorCode HycoBodiesRowCacheDisplace(HycoBodiesWork o, PetscInt m, const PetscReal Lambda[], PetscReal u[])
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < b->n; j++) {
    const HycoSubstructure *own = &b->body[j];
    for (PetscInt k = 0; k < m; k++) {
      const PetscReal *P = o->kept.P[k * b->n + j], force = -Lambda[k] / o->kappa[j];

      /* Most contacts are open: their columns are neither made nor read. */
      if (!P || Lambda[k] == 0) continue;
      PetscCall(BlendColumn(o, k, j, &P));
      HycoBodiesAdd(own->n, force, P, u + b->start[j]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
