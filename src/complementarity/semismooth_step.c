/* A step of semismooth Newton's method on the unknowns that the contacts' states leave (semismooth.h). */
#include "semismooth.h"
#include <petscblaslapack.h>

#define RANK_TOL 1e-10 /* singular values of A relative to the largest that count as 0 */
#define SINGULAR 1e-8  /* least pivot of A relative to the largest: below, least squares may give another step */
#define ROUNDING 1e-13 /* rows of DP relative to the longest that count as 0 */

/* Room for m = n unknowns: A is n x n at most. blocks and rho are borrowed until Destroy. */
PetscErrorCode HycoConeStepCreate(PetscInt p, const HycoBlocks *blocks, const PetscReal rho[], HycoConeStep *t)
{
  const PetscInt n = p + blocks->row[blocks->n];

  PetscFunctionBegin;
  *t = (HycoConeStep){.n = n, .p = p, .blocks = blocks, .rho = rho};
  PetscCall(PetscCalloc2((size_t)blocks->n * HYCO_BLOCK + 1, &t->DP, blocks->n + 1, &t->rank));
  PetscCall(
      PetscMalloc6(n, &t->left, n, &t->right, (size_t)n * (size_t)n, &t->A, n, &t->rhs, n, &t->product, n, &t->pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoConeStepDestroy(HycoConeStep *t)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(t->DP, t->rank));
  PetscCall(PetscFree6(t->left, t->right, t->A, t->rhs, t->product, t->pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M is borrowed; its size is that of Create. */
void HycoConeStepSetMatrix(HycoConeStep *t, const PetscReal M[])
{
  t->M = M;
  t->factored = PETSC_FALSE;
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

/* The longest of the rows R without their parts along the k columns of L; returns its length. */
static PetscReal Longest(PetscInt size, const PetscReal R[], PetscInt k, PetscReal L[][HYCO_MAX_BLOCK],
                         PetscReal longest[])
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < size; i++) {
    PetscReal v[HYCO_MAX_BLOCK] = {0}, square = 0;

    for (PetscInt j = 0; j < size; j++) v[j] = R[i * size + j];
    for (PetscInt a = 0; a < k; a++) {
      PetscReal along = 0;

      for (PetscInt j = 0; j < size; j++) along += v[j] * L[a][j];
      for (PetscInt j = 0; j < size; j++) v[j] -= along * L[a][j];
    }
    for (PetscInt j = 0; j < size; j++) square += v[j] * v[j];
    if (!(PetscSqrtReal(square) > most)) continue;
    most = PetscSqrtReal(square);
    for (PetscInt j = 0; j < size; j++) longest[j] = v[j] / most;
  }
  return most;
}

/* The unknowns of block k: L spans the rows of DP, E = DP L. Returns their number. */
static PetscInt Factorise(HycoConeStep *t, PetscInt k)
{
  const PetscInt first = t->p + t->blocks->row[k], size = t->blocks->row[k + 1] - t->blocks->row[k];
  const PetscReal *D = t->DP + (size_t)k * HYCO_BLOCK;
  PetscReal L[HYCO_MAX_BLOCK][HYCO_MAX_BLOCK], most = 0;

  for (PetscInt a = 0; a < size; a++) {
    PetscReal E[HYCO_MAX_BLOCK] = {0};
    const PetscReal length = Longest(size, D, a, L, L[a]);

    if (!a) most = length;
    if (!(length > ROUNDING * most)) return a;
    for (PetscInt i = 0; i < size; i++) {
      for (PetscInt j = 0; j < size; j++) E[i] += D[i * size + j] * L[a][j];
    }
    AddUnknown(t, first, size, L[a], E);
  }
  return size;
}

/* Returns how many joined or left. */
static PetscInt FindUnknowns(HycoConeStep *t)
{
  const PetscReal one = 1;
  PetscInt changes = 0;

  t->factored = PETSC_FALSE;
  t->m = 0;
  for (PetscInt i = 0; i < t->p; i++) AddUnknown(t, i, 1, &one, &one);
  for (PetscInt k = 0; k < t->blocks->n; k++) {
    const PetscInt before = t->rank[k];

    t->rank[k] = Factorise(t, k);
    changes += PetscAbsInt(t->rank[k] - before);
  }
  return changes;
}

/* Entries of DP are compared exactly: a step between the same states of contacts without slip in 3D has the same DP,
   and keeps the factor. */
PetscErrorCode HycoConeStepDerive(HycoConeStep *t, const HycoBlocks *blocks, const PetscReal y[], PetscInt *changes)
{
  PetscBool same = t->factored;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < blocks->n; k++) {
    const PetscInt size = blocks->row[k + 1] - blocks->row[k];
    PetscReal D[HYCO_BLOCK], *last = t->DP + (size_t)k * HYCO_BLOCK;

    PetscCall(HycoBlockDerivative(blocks, k, y + t->p + blocks->row[k], D));
    for (PetscInt i = 0; i < size * size; i++) {
      same = (PetscBool)(same && D[i] == last[i]);
      last[i] = D[i];
    }
  }
  *changes = same ? 0 : FindUnknowns(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoConeStepStick(HycoConeStep *t)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(t->DP, (size_t)t->blocks->n * HYCO_BLOCK));
  for (PetscInt k = 0; k < t->blocks->n; k++) {
    const PetscInt first = t->p + t->blocks->row[k], size = t->blocks->row[k + 1] - t->blocks->row[k];

    for (PetscInt i = 0; i < size; i++)
      /* A row without flexibility stays out: its equation w = 0 could not be met by its own force. */
      t->DP[k * HYCO_BLOCK + i * (size + 1)] = t->M[(size_t)(first + i) * (size_t)(t->n + 1)] > 0;
  }
  (void)FindUnknowns(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- A and its factor -- */

/* Column by column; each entry has at most size^2 products, as rows of L^T and columns of E are those of one block. */
static void Assemble(HycoConeStep *t)
{
  const PetscInt m = t->m;
  /* Free unknowns have E = L = 1: 1 - L^T E is 0 there. */
  PetscInt a = t->p;

  for (PetscInt c = 0; c < m; c++) {
    const HycoConeTerms *right = &t->right[c];
    PetscReal *column = t->A + (size_t)c * (size_t)m;

    for (PetscInt j = 0; j < right->n; j++) {
      const PetscReal *M = t->M + (size_t)right->row[j] * (size_t)t->n, factor = right->value[j];

      for (PetscInt r = 0; r < m; r++) {
        const HycoConeTerms *left = &t->left[r];
        PetscReal sum = left->value[0] * M[left->row[0]];

        for (PetscInt i = 1; i < left->n; i++) sum += left->value[i] * M[left->row[i]];
        column[r] = j ? column[r] + factor * sum : factor * sum;
      }
    }
  }
  for (PetscInt k = 0; k < t->blocks->n; a += t->rank[k++]) { /* 1 - L^T E of each block */
    for (PetscInt r = a; r < a + t->rank[k]; r++) {
      for (PetscInt c = a; c < a + t->rank[k]; c++) {
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

static void Factor(HycoConeStep *t)
{
  const PetscBLASInt m = (PetscBLASInt)t->m;
  PetscReal least = PETSC_MAX_REAL, most = 0;

  /* Kept while DP and M are the same. */
  if (t->factored) return;
  Assemble(t);
  t->info = 0;
  if (m) LAPACKgetrf_(&m, &m, t->A, &m, t->pivot, &t->info);
  t->factored = PETSC_TRUE;
  t->nearly_singular = (PetscBool)(t->info != 0);
  for (PetscInt a = 0; a < t->m; a++) {
    least = PetscMin(least, PetscAbsReal(t->A[(size_t)a * (size_t)(t->m + 1)]));
    most = PetscMax(most, PetscAbsReal(t->A[(size_t)a * (size_t)(t->m + 1)]));
  }
  if (least < SINGULAR * most) t->nearly_singular = PETSC_TRUE;
}

/* The shortest a of the least squares of an A without full rank. */
static PetscErrorCode LeastSquares(HycoConeStep *t, PetscBLASInt *info)
{
  const PetscBLASInt one = 1, m = (PetscBLASInt)t->m, lwork = 5 * m + 5 * 64 * m;
  PetscReal *value, *work, tol = RANK_TOL;
  PetscBLASInt rank;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m, &value, lwork, &work));
  Assemble(t);
  /* gelss overwrites A. */
  t->factored = PETSC_FALSE;
  LAPACKgelss_(&m, &m, &one, t->A, &m, t->rhs, &m, value, &tol, &rank, work, (PetscBLASInt *)&lwork, info);
  PetscCall(PetscFree2(value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L^T (rho M F - F) */
static PetscErrorCode RightHandSide(HycoConeStep *t, const PetscReal F[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(t->product, t->n));
  PetscCall(HycoAddDenseProduct(t->n, t->M, F, t->product));
  for (PetscInt a = 0; a < t->m; a++) {
    t->rhs[a] = 0;
    for (PetscInt i = 0; i < t->left[a].n; i++) {
      const PetscInt row = t->left[a].row[i];

      t->rhs[a] += t->left[a].value[i] * (t->product[row] - F[row] / t->rho[row]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoConeStepSolve(HycoConeStep *t, const PetscReal F[], PetscBool least, PetscReal s[],
                                 PetscBool *regular)
{
  const PetscBLASInt one = 1, m = (PetscBLASInt)t->m;
  PetscBLASInt info = 0;
  PetscReal size = 0;

  PetscFunctionBegin;
  PetscCall(RightHandSide(t, F));
  for (PetscInt i = 0; i < t->n; i++) s[i] = -F[i];
  if (least && m) PetscCall(LeastSquares(t, &info));
  if (!least) Factor(t);
  if (!least) info = t->info;
  if (!least && m && !info) LAPACKgetrs_("N", &m, &one, t->A, &m, t->pivot, t->rhs, &m, &info);
  for (PetscInt a = 0; a < m && !info; a++) {
    for (PetscInt i = 0; i < t->right[a].n; i++) s[t->right[a].row[i]] += t->right[a].value[i] * t->rhs[a];
  }
  for (PetscInt i = 0; i < t->n; i++) size += PetscAbsReal(s[i]);
  *regular = (PetscBool)(info == 0 && !PetscIsInfOrNanReal(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoConeStepSign(HycoConeStep *t, PetscInt *sign)
{
  PetscFunctionBegin;
  Factor(t);
  /* det A is the product of U's diagonal, with a change of sign for each exchange of rows; det A = det J. */
  *sign = t->info == 0;
  for (PetscInt a = 0; a < t->m; a++) {
    if (t->A[(size_t)a * (size_t)(t->m + 1)] < 0) *sign = -*sign;
    if (t->pivot[a] != a + 1) *sign = -*sign;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
