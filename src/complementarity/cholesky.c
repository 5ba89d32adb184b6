/*
  The Cholesky factor of M_aa, updated from one active set to the next. The contacts are ordered by the time at which
  they joined: those that leave are mostly recent, and the rows before the first of them stay valid.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

struct _n_HycoSetFactor {
  PetscInt n, k, *a;        /* n contacts; k factored ones, in order */
  PetscReal *L, *x;         /* column major, leading dimension n; n */
  PetscBool *wanted, *kept; /* n */
};

/* Room for all n contacts, so that a set of any size can be factored. L is n x n by columns; a set of k contacts uses
   its leading k x k part. */
PetscErrorCode HycoSetFactorCreate(PetscInt n, HycoSetFactor *factor)
{
  HycoSetFactor f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&f));
  f->n = n;
  PetscCall(PetscMalloc1((size_t)n * (size_t)n, &f->L));
  PetscCall(PetscMalloc4(n, &f->a, n, &f->x, n, &f->wanted, n, &f->kept));
  *factor = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. */
PetscErrorCode HycoSetFactorDestroy(HycoSetFactor *factor)
{
  HycoSetFactor f = *factor;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(f->L));
  PetscCall(PetscFree4(f->a, f->x, f->wanted, f->kept));
  PetscCall(PetscFree(*factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For another matrix M. */
void HycoSetFactorForget(HycoSetFactor factor)
{
  if (factor) factor->k = 0;
}

/* Drops the first contact that is not in the set and all after it, and appends the other contacts of the set:
   returns their number; f->k of them are factored. */
static PetscInt CholeskyRearrange(HycoSetFactor f, PetscInt k, const PetscInt a[])
{
  PetscInt stay = 0, count;

  for (PetscInt i = 0; i < f->n; i++) f->wanted[i] = f->kept[i] = PETSC_FALSE;
  for (PetscInt j = 0; j < k; j++) f->wanted[a[j]] = PETSC_TRUE;
  /* The leading factored contacts that stay: their part of the factor is still valid. */
  while (stay < f->k && f->wanted[f->a[stay]]) f->kept[f->a[stay++]] = PETSC_TRUE;
  count = stay;
  for (PetscInt j = stay; j < f->k; j++) { /* in their former order */
    const PetscInt i = f->a[j];

    if (!f->wanted[i]) continue;
    f->kept[i] = PETSC_TRUE;
    f->a[count++] = i;
  }
  for (PetscInt j = 0; j < k; j++) {
    /* New contacts at the end, where appending costs one row each. */
    if (!f->kept[a[j]]) f->a[count++] = a[j];
  }
  f->k = stay;
  return count;
}

/* Computes rows f->k .. k - 1 of the factor; *regular: no pivot below `tol` of its diagonal entry. */
static PetscErrorCode CholeskyAppend(HycoSetFactor f, const PetscReal M[], PetscInt k, PetscReal tol,
                                     PetscBool *regular)
{
  const PetscReal one = 1, minus = -1;
  const size_t n = (size_t)f->n, done = (size_t)f->k;
  PetscReal *rows = f->L + done, *corner = f->L + done * n + done;
  PetscBLASInt ld, old, more, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(f->n, &ld));
  PetscCall(PetscBLASIntCast(f->k, &old));
  PetscCall(PetscBLASIntCast(k - f->k, &more));
  /* Only what changed: the valid rows' columns are reused by a triangular solve and a rank-k update. */
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal *column = M + (size_t)f->a[j] * n;

    for (PetscInt i = PetscMax(j, f->k); i < k; i++) f->L[(size_t)j * n + (size_t)i] = column[f->a[i]];
  }
  if (old) {
    /* New rows X of L: X L_old^T = M_new,old; then the corner's Schur complement M_new,new - X X^T, whose factor
       completes L. */
    BLAStrsm_("R", "L", "T", "N", &more, &old, &one, f->L, &ld, rows, &ld);
    BLASsyrk_("L", "N", &more, &old, &minus, rows, &ld, &one, corner, &ld);
  }
  LAPACKpotrf_("L", &more, corner, &ld, &info);
  *regular = (PetscBool)(info == 0);
  for (PetscInt j = f->k; j < k && *regular; j++) {
    const PetscReal pivot = f->L[(size_t)j * n + (size_t)j], diagonal = M[(size_t)f->a[j] * n + (size_t)f->a[j]];

    /* The pivot squared is what is left of M_jj once the contacts before are closed. */
    *regular = (PetscBool)(pivot * pivot > tol * diagonal); /* false for NaN */
  }
  /* After a failure the caller changes the set by pivoting; what potrf has overwritten is of no use. */
  f->k = *regular ? k : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = -M_aa^-1 q_a on the set a, 0 elsewhere; *regular is false for dependent contacts, and the factor is then
   dropped. M: n x n by columns, symmetric. */
PetscErrorCode HycoSetFactorSolve(HycoSetFactor f, const PetscReal M[], const PetscReal q[], PetscInt k,
                                  const PetscInt a[], PetscReal tol, PetscReal z[], PetscBool *regular)
{
  const PetscInt count = CholeskyRearrange(f, k, a);
  PetscBLASInt n, ld, one = 1, info;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  if (count > f->k) PetscCall(CholeskyAppend(f, M, count, tol, regular));
  if (!*regular) PetscFunctionReturn(PETSC_SUCCESS);
  /* In the order of the factor: f->a has all k contacts of the set, since count = k. */
  for (PetscInt j = 0; j < k; j++) f->x[j] = -q[f->a[j]];
  PetscCall(PetscBLASIntCast(k, &n));
  PetscCall(PetscBLASIntCast(f->n, &ld));
  if (k) LAPACKpotrs_("L", &n, &one, f->L, &ld, f->x, &n, &info);
  PetscCall(PetscArrayzero(z, f->n));
  for (PetscInt j = 0; j < k; j++) {
    z[f->a[j]] = f->x[j];
    *regular = (PetscBool)(*regular && !PetscIsInfOrNanReal(f->x[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* potrf accepts pivots of round-off size, whose solutions would be noise of any size. The comparison is false for
   NaN. */
PetscErrorCode HycoCholesky(const char triangle[], PetscInt n, PetscReal A[], const PetscReal scale[],
                            PetscBool *regular)
{
  PetscReal *diagonal;
  PetscBLASInt size, info = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &size));
  PetscCall(PetscMalloc1(n + 1, &diagonal));
  for (PetscInt k = 0; k < n; k++) diagonal[k] = scale ? scale[k] : A[(size_t)k * (size_t)(n + 1)];
  if (n) LAPACKpotrf_(triangle, &size, A, &size, &info);
  *regular = (PetscBool)!info;
  for (PetscInt k = 0; k < n && *regular; k++)
    *regular = (PetscBool)(PetscSqr(A[(size_t)k * (size_t)(n + 1)]) > HYCO_DEPENDENT * diagonal[k]);
  PetscCall(PetscFree(diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}
