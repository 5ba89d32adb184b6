/* A step of semismooth Newton's method on the unknowns that the contacts' states leave (semismooth.h). */
#include "semismooth.h"
#include <petscblaslapack.h>

/* Of the largest pivot, the least one: half of the digits are lost; least squares may then give another step. */
#define NEARLY_SINGULAR 1e-8
/* The base changes once half of its unknowns would be updated: their solves cost a factor then. */
#define LEAST_SHARE 2
/* Change of an entry of DP up to which its base may stand for it: the rod with friction in 3D takes half the time with
   the results of before to 1e-10 (scripts/friction-rod). */
#define NEAR_BASE   0.3
#define HOMOGENEOUS 1e-14 /* of y, P(y) - DP y: 45 eps, two evaluations of a cone's projection */
#define EMPTY_ROW   1e-13 /* of the longest row of DP: 450 eps, a product of two projections */
/* Of the block's largest diagonal entry of M: 4500 eps, a solve with K's factor; on a plane of symmetry the entry is 0.
   */
#define INFLEXIBLE 1e-12

/* Room for m = n unknowns: A is n x n at most. blocks and rho are borrowed until Destroy. */
PetscErrorCode HycoConeStepCreate(PetscInt p, const HycoBlocks *blocks, const PetscReal rho[], HycoConeStep *t)
{
  const PetscInt n = p + blocks->row[blocks->n];
  /* Updates of low rank have at most so many columns; a step with more factors anew. */
  const size_t most = HYCO_CONE_CHANGES;

  PetscFunctionBegin;
  *t = (HycoConeStep){.n = n, .p = p, .blocks = blocks, .rho = rho};
  PetscCall(PetscCalloc4((size_t)blocks->n * HYCO_BLOCK + 1, &t->DP, (size_t)blocks->n * HYCO_BLOCK + 1, &t->base,
                         blocks->n + 1, &t->rank, blocks->n + 1, &t->base_rank));
  /* A's unknowns are the ranks of the blocks' derivatives: open contacts have rank 0, slipping ones 1 (in 3D 2),
     sticking ones all of their rows. The room is that of all contacts sticking. */
  PetscCall(
      PetscMalloc6(n, &t->left, n, &t->right, (size_t)n * (size_t)n, &t->A, n, &t->rhs, n, &t->product, n, &t->pivot));
  PetscCall(PetscMalloc5(n + 1, &t->changed, n + 1, &t->block, n + 1, &t->column, n + 1, &t->known, n + 1, &t->stiff));
  PetscCall(PetscMalloc5((size_t)n * most, &t->Z, (size_t)n * most, &t->Q, most * most, &t->S, most, &t->small, most,
                         &t->small_pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M, rho and the blocks are borrowed. Grouped as allocated. */
PetscErrorCode HycoConeStepDestroy(HycoConeStep *t)
{
  PetscFunctionBegin;
  PetscCall(PetscFree4(t->DP, t->base, t->rank, t->base_rank));
  PetscCall(PetscFree6(t->left, t->right, t->A, t->rhs, t->product, t->pivot));
  PetscCall(PetscFree5(t->changed, t->block, t->column, t->known, t->stiff));
  PetscCall(PetscFree5(t->Z, t->Q, t->S, t->small, t->small_pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M is borrowed; its size is that of Create. */
void HycoConeStepSetMatrix(HycoConeStep *t, const PetscReal M[])
{
  t->M = M;
  t->factored = t->has_stiff = PETSC_FALSE;
}

/* Blocks are gathered anew for each solve, with other data; sizes and order stay, so that the factor does too. */
void HycoConeStepSetBlocks(HycoConeStep *t, const HycoBlocks *blocks)
{
  t->blocks = blocks;
}

/* Runs of nonzero entries are multiplied at once: forces are 0 at open contacts, which are often most. */
PetscErrorCode HycoAddDenseProduct(PetscInt n, const PetscReal M[], const PetscReal x[], PetscReal y[])
{
  const PetscBLASInt rows = (PetscBLASInt)n, each = 1;
  const PetscReal one = 1;

  PetscFunctionBegin;
  for (PetscInt j = 0, end; j < n; j = end + 1) {
    PetscBLASInt columns;

    /* x[end] is 0 or beyond the end: the next run starts after it. */
    for (end = j; end < n && x[end] != 0; end++) continue;
    columns = (PetscBLASInt)(end - j);
    if (columns) BLASgemv_("N", &rows, &columns, &one, M + (size_t)j * (size_t)n, &rows, x + j, &each, &one, y, &each);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- DP = E L^T -- */

/* Appends an unknown with the row l of L^T and the column e of E, of `size` entries from row `first` on. */
static void AddUnknown(HycoConeStep *t, PetscInt first, PetscInt size, const PetscReal l[], const PetscReal e[])
{
  HycoConeTerms *left = &t->left[t->m], *right = &t->right[t->m];

  left->n = right->n = 0;
  for (PetscInt i = 0; i < size; i++) {
    /* Sparse: an unknown of a sticking component has one term. */
    if (l[i] != 0) {
      left->row[left->n] = first + i;
      left->value[left->n++] = l[i] * t->rho[first + i];
    }
    if (e[i] != 0) {
      right->row[right->n] = first + i;
      right->value[right->n++] = e[i];
    }
  }
  t->m++;
}

/* Column k of L: the direction of the longest of the rows R without their parts along the columns before; returns its
   length. Rank-revealing: a derivative of rank r has r such columns, and the others are noise. */
static PetscReal SemismoothStepLongest(PetscInt size, const PetscReal R[], PetscInt k,
                                       PetscReal L[HYCO_MAX_BLOCK][HYCO_MAX_BLOCK])
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < size; i++) {
    PetscReal v[HYCO_MAX_BLOCK] = {0}, square = 0;

    for (PetscInt j = 0; j < size; j++) v[j] = R[i * size + j];
    /* Gram and Schmidt against the former columns of L. */
    for (PetscInt a = 0; a < k; a++) {
      PetscReal along = 0;

      for (PetscInt j = 0; j < size; j++) along += v[j] * L[a][j];
      for (PetscInt j = 0; j < size; j++) v[j] -= along * L[a][j];
    }
    for (PetscInt j = 0; j < size; j++) square += v[j] * v[j];
    if (!(PetscSqrtReal(square) > most)) continue;
    most = PetscSqrtReal(square);
    for (PetscInt j = 0; j < size; j++) L[k][j] = v[j] / most;
  }
  return most;
}

/* The rank of block k's DP: L spans its rows, E = DP L, whose columns become unknowns if `add`. */
static PetscInt SemismoothStepFactorise(HycoConeStep *t, PetscInt k, PetscBool add)
{
  const PetscInt first = t->p + t->blocks->row[k], size = t->blocks->row[k + 1] - t->blocks->row[k];
  const PetscReal *D = t->DP + (size_t)k * HYCO_BLOCK;
  PetscReal L[HYCO_MAX_BLOCK][HYCO_MAX_BLOCK], most = 0;

  for (PetscInt a = 0; a < size; a++) {
    PetscReal E[HYCO_MAX_BLOCK] = {0};
    const PetscReal length = SemismoothStepLongest(size, D, a, L);

    if (!a) most = length;
    /* The rest of the rows is dependent: the rank is a. */
    if (!(length > EMPTY_ROW * most)) return a;
    for (PetscInt i = 0; i < size && add; i++) {
      for (PetscInt j = 0; j < size; j++) E[i] += D[i * size + j] * L[a][j];
    }
    if (add) AddUnknown(t, first, size, L[a], E);
  }
  return size;
}

/* The present DP becomes the base, to be factored. */
static PetscErrorCode TakeBase(HycoConeStep *t)
{
  const PetscReal one = 1;

  PetscFunctionBegin;
  t->factored = t->updated = t->lagged = PETSC_FALSE;
  t->m = t->c = t->n_columns = 0;
  PetscCall(PetscArraycpy(t->base, t->DP, (size_t)t->blocks->n * HYCO_BLOCK));
  /* Motions without a cone are unknowns of their own. */
  for (PetscInt i = 0; i < t->p; i++) AddUnknown(t, i, 1, &one, &one);
  for (PetscInt k = 0; k < t->blocks->n; k++) t->rank[k] = t->base_rank[k] = SemismoothStepFactorise(t, k, PETSC_TRUE);
  for (PetscInt i = 0; i < t->n; i++) {
    /* No columns of Z and no rows of Q yet for this base. */
    t->column[i] = -1;
    t->known[i] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether block k has the state of the base, and its DP differs by little, as where a slip turns. */
static PetscBool IsNear(const HycoConeStep *t, PetscInt k)
{
  if (t->rank[k] != t->base_rank[k]) return PETSC_FALSE;
  for (PetscInt i = k * HYCO_BLOCK; i < (k + 1) * HYCO_BLOCK; i++) {
    if (PetscAbsReal(t->DP[i] - t->base[i]) > NEAR_BASE) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Lists the rows of DP that differ from the base, or those of blocks that are not near it; returns how many columns of
   Z are missing for them. t->column: the column of Z of each row, -1: none yet. */
static PetscInt SemismoothStepCompare(HycoConeStep *t, PetscBool all)
{
  PetscInt missing = 0;

  t->c = 0;
  for (PetscInt k = 0; k < t->blocks->n; k++) {
    const PetscInt first = t->p + t->blocks->row[k], size = t->blocks->row[k + 1] - t->blocks->row[k];
    const PetscReal *now = t->DP + (size_t)k * HYCO_BLOCK, *base = t->base + (size_t)k * HYCO_BLOCK;

    if (!all && IsNear(t, k)) continue;
    for (PetscInt i = 0; i < size; i++) {
      PetscBool same = PETSC_TRUE;

      for (PetscInt j = 0; j < size; j++) same = (PetscBool)(same && now[i * size + j] == base[i * size + j]);
      if (same) continue;
      /* A row that has changed before has its column already. */
      missing += t->column[first + i] < 0;
      t->block[t->c] = k;
      t->changed[t->c++] = first + i;
    }
  }
  return missing;
}

/* Whether row i of block k has no flexibility, as the tangential one along the normal of a plane of symmetry, and no
   motion of a floating body moves it. It stays out of DP: its equation w = 0 could not be met by its own force, and A
   would be singular. */
static PetscBool SemismoothStepInflexible(const HycoConeStep *t, PetscInt k, PetscInt i)
{
  const PetscInt first = t->p + t->blocks->row[k], end = t->p + t->blocks->row[k + 1];
  PetscReal most = 0, own = t->M[(size_t)(first + i) * (size_t)(t->n + 1)];

  for (PetscInt j = first; j < end; j++) {
    most = PetscMax(most, t->M[(size_t)j * (size_t)(t->n + 1)]);
    for (PetscInt c = 0; c < t->p; c++) {
      const PetscReal moves = PetscAbsReal(t->M[(size_t)c * (size_t)t->n + (size_t)j]);

      most = PetscMax(most, moves);
      if (j == first + i) own = PetscMax(own, moves);
    }
  }
  return (PetscBool) !(own > INFLEXIBLE * most);
}

/* Of all rows, once for an M. */
static const PetscBool *SemismoothStepStiff(HycoConeStep *t)
{
  for (PetscInt k = 0; k < t->blocks->n && !t->has_stiff; k++) {
    for (PetscInt i = 0; i < t->blocks->row[k + 1] - t->blocks->row[k]; i++)
      t->stiff[t->p + t->blocks->row[k] + i] = SemismoothStepInflexible(t, k, i);
  }
  t->has_stiff = PETSC_TRUE;
  return t->stiff;
}

/* Entries of DP are compared exactly: a step between the same states of contacts without slip in 3D has the same DP,
   and keeps the factor. */
PetscErrorCode HycoConeStepDerive(HycoConeStep *t, const HycoBlocks *blocks, const PetscReal y[], PetscInt *changes)
{
  const PetscBool *stiff = SemismoothStepStiff(t);
  PetscBool same = PETSC_TRUE;

  PetscFunctionBegin;
  *changes = 0;
  for (PetscInt k = 0; k < blocks->n; k++) {
    const PetscInt size = blocks->row[k + 1] - blocks->row[k], before = t->rank[k];
    PetscReal D[HYCO_BLOCK], *last = t->DP + (size_t)k * HYCO_BLOCK;
    PetscBool equal = PETSC_TRUE;

    PetscCall(HycoBlockDerivative(blocks, k, y + t->p + blocks->row[k], D));
    for (PetscInt i = 1; i < size; i++) {
      /* A direction in which nothing moves has no force: its derivative would make the matrix singular. */
      if (!stiff[t->p + blocks->row[k] + i]) continue;
      for (PetscInt j = 0; j < size; j++) D[i * size + j] = D[j * size + i] = 0;
    }
    for (PetscInt i = 0; i < size * size; i++) {
      equal = (PetscBool)(equal && D[i] == last[i]);
      last[i] = D[i];
    }
    if (equal) continue;
    same = PETSC_FALSE;
    t->rank[k] = SemismoothStepFactorise(t, k, PETSC_FALSE);
    *changes += PetscAbsInt(t->rank[k] - before);
  }
  if (t->factored && same) PetscFunctionReturn(PETSC_SUCCESS);
  t->updated = t->lagged = PETSC_FALSE;
  if (t->factored && t->info == 0) {
    const PetscInt most = PetscMin(HYCO_CONE_CHANGES, t->m / LEAST_SHARE);
    PetscInt missing = SemismoothStepCompare(t, PETSC_TRUE);

    /* Few changes: a low-rank update of the factor instead of a new one. */
    if (t->c <= most && t->n_columns + missing <= most) PetscFunctionReturn(PETSC_SUCCESS);
    /* Slips have turned in many contacts: an update for the others stands for J as long as it contracts. */
    missing = SemismoothStepCompare(t, PETSC_FALSE);
    t->lagged = (PetscBool)(!t->nearly_singular && t->c <= most && t->n_columns + missing <= most);
    if (t->lagged) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(TakeBase(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* DP = 1 in every block: all contacts closed and sticking, the linear problem w = 0 on all rows. Rows without
   flexibility have DP = 0, since no force can change their w. */
PetscErrorCode HycoConeStepStick(HycoConeStep *t)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(t->DP, (size_t)t->blocks->n * HYCO_BLOCK));
  for (PetscInt k = 0; k < t->blocks->n; k++) {
    const PetscInt size = t->blocks->row[k + 1] - t->blocks->row[k];

    for (PetscInt i = 0; i < size; i++) t->DP[k * HYCO_BLOCK + i * (size + 1)] = !SemismoothStepInflexible(t, k, i);
  }
  PetscCall(TakeBase(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- A and its factor -- */

/* Column by column, M E first; rows of L^T and columns of E are those of one block. */
static void SemismoothStepAssemble(HycoConeStep *t)
{
  const PetscInt m = t->m;
  /* Free unknowns have E = L = 1: 1 - L^T E is 0 there. */
  PetscInt a = t->p;

  for (PetscInt c = 0; c < m; c++) {
    const HycoConeTerms *right = &t->right[c];
    PetscReal *column = t->A + (size_t)c * (size_t)m, *ME = t->product;

    for (PetscInt j = 0; j < right->n; j++) {
      const PetscReal *M = t->M + (size_t)right->row[j] * (size_t)t->n, factor = right->value[j];

      for (PetscInt i = 0; i < t->n; i++) ME[i] = j ? ME[i] + factor * M[i] : factor * M[i];
    }
    for (PetscInt r = 0; r < m; r++) {
      const HycoConeTerms *left = &t->left[r];
      PetscReal sum = left->value[0] * ME[left->row[0]];

      for (PetscInt i = 1; i < left->n; i++) sum += left->value[i] * ME[left->row[i]];
      column[r] = sum;
    }
  }
  for (PetscInt k = 0; k < t->blocks->n; a += t->base_rank[k++]) { /* 1 - L^T E of each block */
    for (PetscInt r = a; r < a + t->base_rank[k]; r++) {
      for (PetscInt c = a; c < a + t->base_rank[k]; c++) {
        PetscReal sum = r == c;

        for (PetscInt i = 0; i < t->left[r].n; i++) {
          for (PetscInt j = 0; j < t->right[c].n; j++) {
            if (t->left[r].row[i] == t->right[c].row[j])
              sum -= t->left[r].value[i] / t->rho[t->left[r].row[i]] * t->right[c].value[j];
          }
        }
        t->A[(size_t)c * (size_t)m + (size_t)r] += sum;
      }
    }
  }
}

/* info > 0 is kept: a singular matrix is no error here. */
static void SemismoothStepFactor(HycoConeStep *t)
{
  const PetscBLASInt m = (PetscBLASInt)t->m;
  PetscReal least = PETSC_MAX_REAL, most = 0;

  /* Kept while DP and M are the same. */
  if (t->factored) return;
  SemismoothStepAssemble(t);
  t->info = 0;
  if (m) LAPACKgetrf_(&m, &m, t->A, &m, t->pivot, &t->info);
  t->factored = PETSC_TRUE;
  t->nearly_singular = (PetscBool)(t->info != 0);
  for (PetscInt a = 0; a < t->m; a++) {
    least = PetscMin(least, PetscAbsReal(t->A[(size_t)a * (size_t)(t->m + 1)]));
    most = PetscMax(most, PetscAbsReal(t->A[(size_t)a * (size_t)(t->m + 1)]));
  }
  if (least < NEARLY_SINGULAR * most) t->nearly_singular = PETSC_TRUE;
}

/* The shortest a of the least squares of an A without full rank. */
static PetscErrorCode LeastSquares(HycoConeStep *t, PetscBLASInt *info)
{
  const PetscBLASInt one = 1, m = (PetscBLASInt)t->m, lwork = 5 * m + 5 * 64 * m;
  PetscReal *value, *work, tol = HYCO_RANK;
  PetscBLASInt rank;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m, &value, lwork, &work));
  SemismoothStepAssemble(t);
  /* gelss overwrites A. */
  t->factored = PETSC_FALSE;
  LAPACKgelss_(&m, &m, &one, t->A, &m, t->rhs, &m, value, &tol, &rank, work, (PetscBLASInt *)&lwork, info);
  PetscCall(PetscFree2(value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L^T (b - rho M b) */
static PetscErrorCode RightHandSide(HycoConeStep *t, const PetscReal b[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(t->product, t->n));
  PetscCall(HycoAddDenseProduct(t->n, t->M, b, t->product));
  for (PetscInt a = 0; a < t->m; a++) {
    t->rhs[a] = 0;
    for (PetscInt i = 0; i < t->left[a].n; i++) {
      const PetscInt row = t->left[a].row[i];

      /* left has been multiplied by rho: the first term is L^T b. */
      t->rhs[a] += t->left[a].value[i] * (b[row] / t->rho[row] - t->product[row]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* s += E a */
static void AddForces(const HycoConeStep *t, const PetscReal a[], PetscReal s[])
{
  for (PetscInt k = 0; k < t->m; k++) {
    for (PetscInt i = 0; i < t->right[k].n; i++) s[t->right[k].row[i]] += t->right[k].value[i] * a[k];
  }
}

/* -- the update of the base -- */

/* The columns of Z that are missing: b is a unit vector. Z = inverse of the base times unit vectors, for the low-rank
   update (Woodbury). */
static PetscErrorCode AddColumns(HycoConeStep *t)
{
  const PetscInt n = t->n, before = t->n_columns;
  const PetscBLASInt m = (PetscBLASInt)t->m;
  PetscBLASInt count, info = 0;
  PetscReal *rhs;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < t->c; k++) {
    /* Numbers first, so that all missing columns are solved in one call. */
    if (t->column[t->changed[k]] < 0) t->column[t->changed[k]] = t->n_columns++;
  }
  count = (PetscBLASInt)(t->n_columns - before);
  if (!count) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1((size_t)t->m * (size_t)count + 1, &rhs));
  PetscCall(PetscArrayzero(t->Z + (size_t)before * (size_t)n, (size_t)n * (size_t)count));
  for (PetscInt k = 0; k < t->c; k++) {
    const PetscInt row = t->changed[k], column = t->column[row];
    const PetscReal *M = t->M + (size_t)row * (size_t)n;

    if (column < before) continue;
    /* The unit vector itself; AddForces() adds what the unknowns respond. */
    t->Z[(size_t)column * (size_t)n + (size_t)row] = 1;
    for (PetscInt a = 0; a < t->m; a++) {
      PetscReal sum = 0;

      for (PetscInt i = 0; i < t->left[a].n; i++) {
        const PetscInt at = t->left[a].row[i];

        sum += t->left[a].value[i] * ((at == row ? 1 / t->rho[at] : 0) - M[at]);
      }
      rhs[(size_t)(column - before) * (size_t)t->m + (size_t)a] = sum;
    }
  }
  if (m) LAPACKgetrs_("N", &m, &count, t->A, &m, t->pivot, rhs, &m, &info);
  for (PetscInt k = 0; k < count; k++)
    AddForces(t, rhs + (size_t)k * (size_t)t->m, t->Z + (size_t)(before + k) * (size_t)n);
  PetscCall(PetscFree(rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -rho (M Z)_row for `count` columns of Z. */
static void RowTimes(const HycoConeStep *t, PetscInt row, PetscInt count, const PetscReal Z[], PetscReal y[])
{
  const PetscBLASInt n = (PetscBLASInt)t->n, columns = (PetscBLASInt)count, one = 1, step = t->symmetric ? 1 : n;
  const PetscReal factor = -t->rho[row], add = 1;

  for (PetscInt c = 0; c < count; c++) y[c] = 0;
  BLASgemv_("T", &n, &columns, &factor, Z, &n, t->M + (size_t)row * (t->symmetric ? (size_t)n : 1), &step, &add, y,
            &one);
}

/* Whether row i of block k has DP = 1 in the base, as a closed contact's normal force, or a tangential one that sticks:
   (I - rho M) s is then s - b there, by the equation of s itself. */
static PetscBool IsFree(const HycoConeStep *t, PetscInt k, PetscInt i)
{
  const PetscInt size = t->blocks->row[k + 1] - t->blocks->row[k];
  const PetscReal *row = t->base + (size_t)k * HYCO_BLOCK + (size_t)(i * size);
  PetscBool is = PETSC_TRUE;

  for (PetscInt j = 0; j < size; j++) is = (PetscBool)(is && row[j] == (i == j));
  return is;
}

/* ((I - rho M) Z) in row i of block k for all columns. Only columns that are new since the last call. */
static const PetscReal *RowOfQ(HycoConeStep *t, PetscInt k, PetscInt i)
{
  const PetscInt row = t->p + t->blocks->row[k] + i;
  const PetscBool is = IsFree(t, k, i);
  const PetscInt known = t->known[row], count = t->n_columns - known;
  const PetscReal *Z = t->Z + (size_t)known * (size_t)t->n;
  PetscReal *Q = t->Q + (size_t)row * HYCO_CONE_CHANGES;

  if (count && !is) RowTimes(t, row, count, Z, Q + known);
  for (PetscInt c = known; c < t->n_columns; c++)
    Q[c] = t->Z[(size_t)c * (size_t)t->n + (size_t)row] + (is ? -(PetscReal)(t->column[row] == c) : Q[c]);
  t->known[row] = t->n_columns;
  return Q;
}

/* The change of row k's DP: *first row and size of its block. */
static PetscInt SemismoothStepChange(const HycoConeStep *t, PetscInt k, PetscInt *first,
                                     PetscReal change[HYCO_MAX_BLOCK])
{
  const PetscInt b = t->block[k], size = t->blocks->row[b + 1] - t->blocks->row[b];
  const size_t at = (size_t)b * HYCO_BLOCK + (size_t)((t->changed[k] - t->p - t->blocks->row[b]) * size);

  *first = t->p + t->blocks->row[b];
  for (PetscInt j = 0; j < size; j++) change[j] = t->DP[at + (size_t)j] - t->base[at + (size_t)j];
  return size;
}

/* The factor of I + R Z; *regular: it is not nearly singular. */
static PetscErrorCode SemismoothStepUpdate(HycoConeStep *t, PetscBool *regular)
{
  const PetscBLASInt c = (PetscBLASInt)t->c;
  PetscBLASInt info = 0;
  PetscReal least = PETSC_MAX_REAL, most = 0;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  /* S belongs to the present changes. */
  if (t->updated || !t->c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AddColumns(t));
  for (PetscInt r = 0; r < c; r++) {
    PetscReal change[HYCO_MAX_BLOCK];
    PetscInt first;
    const PetscInt size = SemismoothStepChange(t, r, &first, change);

    for (PetscInt k = 0; k < c; k++) t->S[k * c + r] = r == k;
    for (PetscInt j = 0; j < size; j++) {
      const PetscReal *Q = change[j] != 0 ? RowOfQ(t, t->block[r], j) : NULL;

      for (PetscInt k = 0; Q && k < c; k++) t->S[k * c + r] -= change[j] * Q[t->column[t->changed[k]]];
    }
  }
  LAPACKgetrf_(&c, &c, t->S, &c, t->small_pivot, &info);
  for (PetscInt k = 0; k < c; k++) {
    least = PetscMin(least, PetscAbsReal(t->S[k * (c + 1)]));
    most = PetscMax(most, PetscAbsReal(t->S[k * (c + 1)]));
  }
  /* A small pivot: the update loses digits, and a new base is taken. */
  *regular = t->updated = (PetscBool)(info == 0 && least >= NEARLY_SINGULAR * PetscMax(most, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (I - rho M) s - rho q in row i of block k, for the step of the base, or its point (q). */
static PetscReal SemismoothStepArgument(const HycoConeStep *t, PetscInt k, PetscInt i, const PetscReal q[],
                                        const PetscReal b[], const PetscReal s[])
{
  const PetscInt row = t->p + t->blocks->row[k] + i;
  PetscReal product;

  if (IsFree(t, k, i)) return s[row] - (b ? b[row] : 0);
  RowTimes(t, row, 1, s, &product);
  return s[row] + product - (q ? t->rho[row] * q[row] : 0);
}

/* s -= Z (I + R Z)^-1 R s; with q (b NULL) the right-hand side has changed with DP, too: s is a point, not a step. Rows
   in which DP is now 0 are those of b without round-off: open contacts have no force. */
static PetscErrorCode SemismoothStepCorrect(HycoConeStep *t, const PetscReal q[], const PetscReal b[], PetscReal s[])
{
  const PetscBLASInt one = 1, c = (PetscBLASInt)t->c, n = (PetscBLASInt)t->n;
  PetscBLASInt info = 0;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < c; r++) {
    PetscReal change[HYCO_MAX_BLOCK];
    PetscInt first;
    const PetscInt size = SemismoothStepChange(t, r, &first, change);

    t->small[r] = 0;
    for (PetscInt j = 0; j < size; j++) {
      /* The right-hand side with the new rows of DP, applied to the step of the base. */
      if (change[j] != 0) t->small[r] -= change[j] * SemismoothStepArgument(t, t->block[r], j, q, b, s);
    }
  }
  if (c) LAPACKgetrs_("N", &c, &one, t->S, &c, t->small_pivot, t->small, &c, &info);
  for (PetscInt r = 0; r < c; r++) {
    const PetscReal share = -t->small[r];

    BLASaxpy_(&n, &share, t->Z + (size_t)t->column[t->changed[r]] * (size_t)n, &one, s, &one);
  }
  for (PetscInt r = 0; r < c; r++) {
    const PetscInt k = t->block[r], row = t->changed[r], size = t->blocks->row[k + 1] - t->blocks->row[k];
    const PetscReal *D = t->DP + (size_t)k * HYCO_BLOCK + (row - t->p - t->blocks->row[k]) * size;
    PetscBool zero = PETSC_TRUE;

    for (PetscInt j = 0; j < size; j++) zero = (PetscBool)(zero && D[j] == 0);
    if (zero) s[row] = b ? b[row] : 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The base is factored, and its update; if that is nearly singular the present DP becomes the base. After it t->A has a
   factor, and t->S that of the update. */
static PetscErrorCode SemismoothStepPrepare(HycoConeStep *t)
{
  PetscBool regular;

  PetscFunctionBegin;
  SemismoothStepFactor(t);
  PetscCall(SemismoothStepUpdate(t, &regular));
  if (regular) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TakeBase(t));
  SemismoothStepFactor(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factor of the present J itself, in place of a former one with changes of low rank: for a step that did not
   lower the residual, which round-off of the update may be the cause of. */
PetscErrorCode HycoConeStepRenew(HycoConeStep *t)
{
  PetscFunctionBegin;
  if (t->c || t->lagged) PetscCall(TakeBase(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `least`: the least-squares step, for singular matrices. */
PetscErrorCode HycoConeStepSolve(HycoConeStep *t, const PetscReal b[], PetscBool least, PetscReal s[],
                                 PetscBool *regular)
{
  const PetscBLASInt one = 1;
  PetscBLASInt m, info = 0;
  PetscReal size = 0;

  PetscFunctionBegin;
  /* Least squares need the present matrix, not an update of another. */
  if (least) PetscCall(HycoConeStepRenew(t));
  if (!least) PetscCall(SemismoothStepPrepare(t));
  m = (PetscBLASInt)t->m;
  PetscCall(RightHandSide(t, b));
  PetscCall(PetscArraycpy(s, b, t->n));
  if (least && m) PetscCall(LeastSquares(t, &info));
  if (!least) info = t->info;
  if (!least && m && !info) LAPACKgetrs_("N", &m, &one, t->A, &m, t->pivot, t->rhs, &m, &info);
  if (!info) AddForces(t, t->rhs, s);
  if (!least && !info) PetscCall(SemismoothStepCorrect(t, NULL, b, s));
  for (PetscInt i = 0; i < t->n; i++) size += PetscAbsReal(s[i]);
  /* A nearly singular factor shows as infinite numbers. */
  *regular = (PetscBool)(info == 0 && !PetscIsInfOrNanReal(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether P(y) = DP y in all blocks. */
static PetscErrorCode IsHomogeneous(const HycoConeStep *t, const PetscReal y[], PetscBool *is)
{
  PetscFunctionBegin;
  *is = PETSC_TRUE;
  for (PetscInt k = 0; k < t->blocks->n && *is; k++) {
    const PetscInt first = t->p + t->blocks->row[k], size = t->blocks->row[k + 1] - t->blocks->row[k];
    const PetscReal *D = t->DP + (size_t)k * HYCO_BLOCK;
    PetscReal z[HYCO_MAX_BLOCK], rest = 0, most = 0;

    PetscCall(HycoBlockProject(t->blocks, k, y + first, z));
    for (PetscInt i = 0; i < size; i++) {
      for (PetscInt j = 0; j < size; j++) z[i] -= D[i * size + j] * y[first + j];
      rest = PetscMax(rest, PetscAbsReal(z[i]));
      most = PetscMax(most, PetscAbsReal(y[first + i]));
    }
    /* Not with frozen radii, whose disks do not scale with y. */
    *is = (PetscBool)(rest <= HOMOGENEOUS * most);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = DP (z - rho (q + M z)) for k columns q; one solve with the factor serves all. */
static PetscErrorCode SolvePoints(HycoConeStep *t, PetscInt k, const PetscReal q[], PetscReal z[], PetscBool *regular)
{
  const PetscBLASInt columns = (PetscBLASInt)k;
  PetscBLASInt m, info;
  PetscReal size = 0, *rhs;

  PetscFunctionBegin;
  if (t->lagged) PetscCall(TakeBase(t));
  PetscCall(SemismoothStepPrepare(t));
  m = (PetscBLASInt)t->m;
  info = t->info;
  PetscCall(PetscCalloc1((size_t)t->m * (size_t)k + 1, &rhs));
  for (PetscInt a = 0; a < t->m * k; a++) {
    const HycoConeTerms *left = &t->left[a % t->m];

    /* -L^T rho q: the fixed part of y on the present states. */
    for (PetscInt i = 0; i < left->n; i++) rhs[a] -= left->value[i] * q[a / t->m * t->n + left->row[i]];
  }
  if (m && !info) LAPACKgetrs_("N", &m, &columns, t->A, &m, t->pivot, rhs, &m, &info);
  PetscCall(PetscArrayzero(z, t->n * k));
  for (PetscInt j = 0; j < k && !info; j++) {
    AddForces(t, rhs + j * t->m, z + j * t->n);
    PetscCall(SemismoothStepCorrect(t, q + j * t->n, NULL, z + j * t->n));
  }
  for (PetscInt i = 0; i < t->n * k; i++) size += PetscAbsReal(z[i]);
  *regular = (PetscBool)(info == 0 && !PetscIsInfOrNanReal(size));
  PetscCall(PetscFree(rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution itself on the present pieces of P, where these are homogeneous: there is no cancellation in a step. */
PetscErrorCode HycoConeStepPoint(HycoConeStep *t, const PetscReal q[], const PetscReal y[], PetscReal z[],
                                 PetscBool *regular, PetscBool *served)
{
  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  *served = PETSC_FALSE;
  /* Steps alone have the right limit with a factor of another J. */
  if (!t->lagged) PetscCall(IsHomogeneous(t, y, served));
  if (*served) PetscCall(SolvePoints(t, 1, q, z, regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivative of the point: the same linear map, whatever P is between its pieces. */
PetscErrorCode HycoConeStepTangent(HycoConeStep *t, PetscInt k, const PetscReal dq[], PetscReal dz[],
                                   PetscBool *regular)
{
  PetscFunctionBegin;
  PetscCall(SolvePoints(t, k, dq, dz, regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of det A times that of the update. */
static PetscInt SignOfFactor(const HycoConeStep *t)
{
  PetscInt sign = t->info == 0;

  /* det A is the product of U's diagonal, with a change of sign for each exchange of rows; det A = det J. */
  for (PetscInt a = 0; a < t->m; a++) {
    if (t->A[(size_t)a * (size_t)(t->m + 1)] < 0) sign = -sign;
    if (t->pivot[a] != a + 1) sign = -sign;
  }
  for (PetscInt k = 0; k < t->c; k++) {
    if (t->S[k * (t->c + 1)] < 0) sign = -sign;
    if (t->small_pivot[k] != k + 1) sign = -sign;
  }
  return sign;
}

/* Of a factor of another J only a positive sign is taken, which proves nothing. */
PetscErrorCode HycoConeStepSign(HycoConeStep *t, PetscInt *sign)
{
  PetscFunctionBegin;
  PetscCall(SemismoothStepPrepare(t));
  *sign = SignOfFactor(t);
  if (!t->lagged || *sign > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TakeBase(t));
  PetscCall(SemismoothStepPrepare(t));
  *sign = SignOfFactor(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}
