/*
  The linear problem in a complementarity method: on a set a of contacts, M_aa z_a = -q_a.

  Contacts may repeat each other (a node constrained twice, a surface on a symmetry plane): M_aa is then singular
  although the displacements are unique. Diagonal pivoting keeps as many contacts as M_aa has rank, the smaller gap
  first among equal pivots; the others depend on them and carry no force.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

/* A = D M_aa D with D = |diag|^-1/2 (0 for a contact with a zero diagonal). Contacts have different units and
   stiffnesses; the scaled matrix has a unit diagonal. */
static void CopyScaled(PetscInt n, const PetscReal M[], PetscInt k, const PetscInt a[], PetscReal A[], PetscReal d[])
{
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal diagonal = PetscAbsReal(M[(size_t)a[j] * (size_t)n + (size_t)a[j]]);

    d[j] = diagonal > 0 ? 1 / PetscSqrtReal(diagonal) : 0;
  }
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal *column = M + (size_t)a[j] * (size_t)n;

    for (PetscInt i = 0; i < k; i++) A[(size_t)j * (size_t)k + (size_t)i] = column[a[i]] * d[i] * d[j];
  }
}

/* Factors A (k x k, overwritten) and solves in place; *regular: no pivot below `tol` of the largest, and a finite
   solution. Cholesky if symmetric, else LU with partial pivoting. */
static PetscErrorCode RankRevealingSolve(PetscInt k, PetscReal A[], PetscBool symmetric, PetscReal tol, PetscReal x[],
                                         PetscBool *regular)
{
  PetscBLASInt n, one = 1, info = 0, *ipiv;
  PetscReal least = PETSC_MAX_REAL, most = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(k, &n));
  PetscCall(PetscMalloc1(k, &ipiv));
  if (symmetric)
    LAPACKpotrf_("L", &n, A, &n, &info);
  else
    LAPACKgetrf_(&n, &n, A, &n, ipiv, &info);
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal pivot = PetscAbsReal(A[(size_t)j * (size_t)k + (size_t)j]);

    /* Squares of Cholesky's diagonal are the pivots that LU has: one tolerance serves both. */
    least = PetscMin(least, symmetric ? pivot * pivot : pivot);
    most = PetscMax(most, symmetric ? pivot * pivot : pivot);
  }
  *regular = (PetscBool)(info == 0 && least > tol * most);
  if (*regular && symmetric) LAPACKpotrs_("L", &n, &one, A, &n, x, &n, &info);
  if (*regular && !symmetric) LAPACKgetrs_("N", &n, &one, A, &n, ipiv, x, &n, &info);
  for (PetscInt j = 0; j < k; j++) *regular = (PetscBool)(*regular && !PetscIsInfOrNanReal(x[j]));
  PetscCall(PetscFree(ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next pivot: the largest diagonal entry; among those equal to 1e-8, the smallest scaled gap. -1: the rest is
   dependent. */
static PetscInt NextPivot(PetscInt k, const PetscReal A[], const PetscReal gap[], const PetscBool kept[])
{
  PetscReal largest = 0;
  PetscInt best = -1;

  for (PetscInt i = 0; i < k; i++) {
    if (!kept[i]) largest = PetscMax(largest, PetscAbsReal(A[(size_t)i * (size_t)k + (size_t)i]));
  }
  for (PetscInt i = 0; i < k && largest > HYCO_DEPENDENT; i++) {
    if (kept[i] || PetscAbsReal(A[(size_t)i * (size_t)k + (size_t)i]) < largest * (1 - 1e-8)) continue;
    /* Equal pivots are contacts that repeat each other: the one that closes first carries the force. */
    if (best < 0 || gap[i] < gap[best]) best = i;
  }
  return best;
}

/* Diagonal pivoting of A (k x k, overwritten): kept[i] marks a largest set on which A is regular. The Schur
   complement is updated for all columns: O(k^2) for each pivot. */
static PetscErrorCode RankRevealingPivot(PetscInt k, PetscReal A[], const PetscReal gap[], PetscBool kept[])
{
  PetscReal *row;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(k, &row));
  PetscCall(PetscArrayzero(kept, k));
  for (PetscInt p = NextPivot(k, A, gap, kept); p >= 0; p = NextPivot(k, A, gap, kept)) {
    const PetscReal *column = A + (size_t)p * (size_t)k, pivot = column[p];

    kept[p] = PETSC_TRUE;
    /* Kept columns are not read again. */
    for (PetscInt j = 0; j < k; j++) row[j] = kept[j] ? 0 : A[(size_t)j * (size_t)k + (size_t)p] / pivot;
    for (PetscInt j = 0; j < k; j++) {
      if (row[j] == 0) continue;
      for (PetscInt i = 0; i < k; i++) A[(size_t)j * (size_t)k + (size_t)i] -= column[i] * row[j];
    }
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rank of a Gram matrix A (k x k, overwritten), by pivots of the scaled matrix. By the same pivots as sets of
   contacts are reduced, with the same tolerance. */
PetscErrorCode HycoGramRank(PetscInt k, PetscReal A[], PetscInt *rank)
{
  PetscReal *d;
  PetscBool *kept;

  PetscFunctionBegin;
  *rank = 0;
  PetscCall(PetscCalloc2(k, &d, k, &kept));
  for (PetscInt j = 0; j < k; j++) {
    const PetscReal diagonal = A[(size_t)j * (size_t)k + (size_t)j];

    d[j] = diagonal > 0 ? 1 / PetscSqrtReal(diagonal) : 0;
  }
  for (PetscInt j = 0; j < k; j++) {
    for (PetscInt i = 0; i < k; i++) A[(size_t)j * (size_t)k + (size_t)i] *= d[i] * d[j];
  }
  /* All gaps 0 from here: the order of pivots follows from the diagonal alone. */
  PetscCall(PetscArrayzero(d, k));
  PetscCall(RankRevealingPivot(k, A, d, kept));
  for (PetscInt j = 0; j < k; j++) *rank += kept[j];
  PetscCall(PetscFree2(d, kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One solve on a set. q and z are scaled with the matrix. */
static PetscErrorCode TrySet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric, PetscReal tol,
                             PetscInt k, const PetscInt a[], PetscReal A[], PetscReal z[], PetscBool *regular)
{
  PetscReal *x, *d;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(k, &x, k, &d));
  CopyScaled(n, M, k, a, A, d);
  /* The scaled problem: D M D (D^-1 z) = -D q. */
  for (PetscInt j = 0; j < k; j++) x[j] = -q[a[j]] * d[j];
  PetscCall(RankRevealingSolve(k, A, symmetric, tol, x, regular));
  for (PetscInt j = 0; *regular && j < k; j++) z[a[j]] = x[j] * d[j];
  PetscCall(PetscFree2(x, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First the kept factor or a plain one; if it is not regular, contacts are chosen by pivoting. On return a[0 .. *k)
   are those that carry force. */
PetscErrorCode HycoLCPSolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                 HycoSetFactor factor, PetscInt *k, PetscInt a[], PetscReal z[], PetscBool *singular)
{
  PetscReal *A, *d;
  PetscBool regular = PETSC_FALSE, *kept;
  PetscInt n_kept = 0;

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(PetscArrayzero(z, n));
  if (!*k) PetscFunctionReturn(PETSC_SUCCESS);
  if (factor) PetscCall(HycoSetFactorSolve(factor, M, q, *k, a, HYCO_DEPENDENT, z, &regular));
  if (regular) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1((size_t)*k * (size_t)*k, &A));
  if (!factor) PetscCall(TrySet(n, M, q, symmetric, symmetric ? HYCO_DEPENDENT : 1e-15, *k, a, A, z, &regular));
  if (!regular) {
    PetscCall(PetscMalloc2(*k, &d, *k, &kept));
    CopyScaled(n, M, *k, a, A, d);
    /* The gaps in the scale of the matrix; equal pivots with different gaps are repeated contacts, of which the
       smallest gap binds. */
    for (PetscInt j = 0; j < *k; j++) d[j] *= q[a[j]];
    PetscCall(RankRevealingPivot(*k, A, d, kept));
    for (PetscInt j = 0; j < *k; j++) {
      if (kept[j]) a[n_kept++] = a[j];
    }
    PetscCall(PetscFree2(d, kept));
    *k = n_kept;
    /* Tolerance 0: the pivoting has chosen the set already; only a failed factor counts. */
    if (n_kept) PetscCall(TrySet(n, M, q, symmetric, 0, n_kept, a, A, z, &regular));
    *singular = (PetscBool)(n_kept && !regular);
  }
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
