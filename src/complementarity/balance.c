/*
  Whether forces of the cones balance a load on the motions of floating bodies: min |A r - f|, A the rows of the
  motions. Each step takes from every cone the ray that works most against the motion f - A r, and solves the
  nonnegative least-squares problem of these rays and of those with a force (fully corrective conditional gradients: M.
  Jaggi, Proc. ICML 28 (2013) 427-435). If no ray works against it, the bodies move so.
*/
#include <hycoalgorithms.h>
#include <hycolcp.h>
#include <string.h>

#define MOST_STEPS 200

PetscErrorCode HycoNormalsBalance(PetscInt p, PetscInt n, const PetscReal A[], const PetscReal f[], PetscReal rounding,
                                  PetscReal r[], PetscBool *exists)
{
  PetscReal size = 0, rest;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < p; i++) size += f[i] * f[i];
  PetscCall(HycoNNLS(p, n, A, f, r, &rest));
  *exists = (PetscBool) !(rest > PetscMax(HYCO_BALANCED * PetscSqrtReal(size), rounding));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rays of the problem; column of A times each. */
typedef struct {
  PetscInt n, *block;
  PetscReal *ray, *column, *force; /* HYCO_MAX_BLOCK, p and 1 for each */
} Rays;

/* Whether every law is a cone of these two kinds: others have no known rays. */
static PetscErrorCode HaveRays(const HycoBlocks *b, PetscBool *have)
{
  PetscFunctionBegin;
  *have = PETSC_TRUE;
  for (PetscInt k = 0; k < b->n && *have; k++) {
    const HycoCone cone = b->cone[b->of[k]];
    HycoConeType type;

    PetscCall(HycoConeGetType(cone, &type));
    *have = (PetscBool)(strcmp(type, HYCO_CONE_COULOMB) ? cone->nonnegative && b->row[k + 1] - b->row[k] == 1
                                                        : b->data[b->at[k] + 1] == 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ray of block k that works most against the motion d: its work, and length. */
static void BalanceBest(const HycoBlocks *b, PetscInt k, PetscInt p, const PetscReal A[], const PetscReal d[],
                        PetscReal ray[], PetscReal *work, PetscReal *length)
{
  const PetscInt size = b->row[k + 1] - b->row[k];
  const PetscReal mu = size > 1 ? b->data[b->at[k]] : 0;
  PetscReal with[HYCO_MAX_BLOCK] = {0}, slide = 0;

  *work = *length = 0;
  for (PetscInt c = 0; c < size; c++) {
    const PetscReal *column = A + (size_t)(b->row[k] + c) * (size_t)p;

    for (PetscInt i = 0; i < p; i++) with[c] += column[i] * d[i];
    for (PetscInt i = 0; i < p; i++) *length = PetscMax(*length, PetscAbsReal(column[i]));
    if (c) slide += with[c] * with[c];
  }
  slide = PetscSqrtReal(slide);
  for (PetscInt c = 0; c < size; c++) ray[c] = c ? (slide > 0 ? mu * with[c] / slide : 0) : 1;
  *work = with[0] + mu * slide;
}

/* Keeps the rays with a force, and adds the best of each block; *against: one of them works against d. */
static void BalanceRenew(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal d[], Rays *rays,
                         PetscBool *against)
{
  PetscReal size = 0;
  PetscInt kept = 0;

  *against = PETSC_FALSE;
  for (PetscInt i = 0; i < p; i++) size = PetscMax(size, PetscAbsReal(d[i]));
  for (PetscInt j = 0; j < rays->n; j++) {
    if (!(rays->force[j] > 0)) continue;
    rays->block[kept] = rays->block[j];
    for (PetscInt c = 0; c < HYCO_MAX_BLOCK; c++)
      rays->ray[kept * HYCO_MAX_BLOCK + c] = rays->ray[j * HYCO_MAX_BLOCK + c];
    for (PetscInt i = 0; i < p; i++) rays->column[kept * p + i] = rays->column[j * p + i];
    kept++;
  }
  for (PetscInt k = 0; k < b->n; k++) {
    PetscReal *ray = rays->ray + kept * HYCO_MAX_BLOCK, *column = rays->column + kept * p, work, length;

    BalanceBest(b, k, p, A, d, ray, &work, &length);
    if (!(work > HYCO_BALANCED * length * size)) continue;
    *against = PETSC_TRUE;
    for (PetscInt i = 0; i < p; i++) {
      column[i] = 0;
      for (PetscInt c = 0; c < b->row[k + 1] - b->row[k]; c++)
        column[i] += ray[c] * A[(size_t)(b->row[k] + c) * (size_t)p + (size_t)i];
    }
    rays->block[kept++] = k;
  }
  rays->n = kept;
}

/* A: p x rows by columns; r: by row. */
PetscErrorCode HycoBlocksBalance(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal f[],
                                 PetscReal rounding, PetscReal r[], PetscBool *exists)
{
  const PetscInt room = 2 * b->n + 2 * p + 1;
  PetscReal *d, size = 0, rest = 0, least;
  PetscBool against = PETSC_TRUE, known;
  Rays rays = {0};

  PetscFunctionBegin;
  PetscCall(HaveRays(b, &known));
  PetscCall(PetscArrayzero(r, b->row[b->n]));
  PetscCall(PetscMalloc5(p, &d, room, &rays.block, room * HYCO_MAX_BLOCK, &rays.ray, room * p, &rays.column, room,
                         &rays.force));
  PetscCall(PetscArraycpy(d, f, p));
  for (PetscInt i = 0; i < p; i++) size += f[i] * f[i];
  rest = size = PetscSqrtReal(size);
  least = PetscMax(HYCO_BALANCED * size, rounding);
  for (PetscInt k = 0; k < MOST_STEPS && known && rest > least; k++) {
    BalanceRenew(b, p, A, d, &rays, &against);
    if (!against) break;
    PetscCall(HycoNNLS(p, rays.n, rays.column, f, rays.force, &rest));
    PetscCall(PetscArraycpy(d, f, p));
    for (PetscInt j = 0; j < rays.n; j++) {
      for (PetscInt i = 0; i < p; i++) d[i] -= rays.force[j] * rays.column[j * p + i];
    }
    rest = 0;
    for (PetscInt i = 0; i < p; i++) rest += d[i] * d[i];
    rest = PetscSqrtReal(rest);
  }
  /* Not decided: as if there were forces. */
  *exists = (PetscBool)(!known || against || !(rest > least));
  for (PetscInt j = 0; j < rays.n && !*exists; j++) {
    const PetscInt first = b->row[rays.block[j]];

    for (PetscInt c = 0; c < b->row[rays.block[j] + 1] - first; c++)
      r[first + c] += rays.force[j] * rays.ray[j * HYCO_MAX_BLOCK + c];
  }
  PetscCall(PetscFree5(d, rays.block, rays.ray, rays.column, rays.force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
