/* Small dense matrices: pivots, singular values. */
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* pivot[0 .. k): the first k pivot columns of A (m x n, by columns, overwritten). */
PetscErrorCode HycoPivotColumns(PetscInt m, PetscInt n, PetscReal A[], PetscInt k, PetscInt pivot[])
{
  PetscReal *norm;
  PetscBool *taken;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &norm));
  PetscCall(PetscCalloc1(n, &taken));
  /* Gram-Schmidt with pivoting: among columns of equal length (to 1e-10) the first is taken */
  for (PetscInt step = 0; step < k; step++) {
    PetscInt best = -1;

    for (PetscInt j = 0; j < n; j++) {
      norm[j] = 0;
      for (PetscInt i = 0; i < m; i++) norm[j] += A[j * m + i] * A[j * m + i];
      if (!taken[j] && (best < 0 || norm[j] > norm[best] * (1 + 1e-10))) best = j;
    }
    pivot[step] = best;
    taken[best] = PETSC_TRUE;
    for (PetscInt j = 0; j < n; j++) {
      PetscReal dot = 0;

      /* A zero column may still be taken, if no other is left; it removes nothing. */
      if (taken[j] || norm[best] == 0) continue;
      for (PetscInt i = 0; i < m; i++) dot += A[j * m + i] * A[best * m + i];
      for (PetscInt i = 0; i < m; i++) A[j * m + i] -= dot / norm[best] * A[best * m + i];
    }
  }
  HycoFreeAll(&norm, &taken);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P (n x m) = A^+ by the SVD; singular values below tol of the largest are dropped. By columns; zero if A is empty. */
PetscErrorCode HycoPseudoInverse(PetscInt m, PetscInt n, const PetscReal A[], PetscReal tol, PetscReal P[])
{
  const PetscInt k = PetscMin(m, n);
  PetscBLASInt mb, nb, kb, lwork, info;
  PetscReal *copy, *s, *U, *Vt, *work;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(P, m * n));
  if (!k) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(k, &kb));
  PetscCall(PetscBLASIntCast(64 * (m + n), &lwork));
  PetscCall(PetscMalloc5(m * n, &copy, k, &s, m * k, &U, k * n, &Vt, lwork, &work));
  PetscCall(PetscArraycpy(copy, A, m * n));
  PetscCall(PetscFPTrapPush(PETSC_FP_TRAP_OFF)); /* its tests of the arithmetic */
  LAPACKgesvd_("S", "S", &mb, &nb, copy, &mb, s, U, &mb, Vt, &kb, work, &lwork, &info);
  PetscCall(PetscFPTrapPop());
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "singular values did not converge (LAPACK gesvd: %d)",
             (int)info);
  /* Dropped: directions in which A maps to round-off; their inverse would be noise. */
  for (PetscInt r = 0; r < k && s[r] > tol * s[0]; r++) {
    for (PetscInt j = 0; j < m; j++) {
      for (PetscInt i = 0; i < n; i++) P[j * n + i] += Vt[i * k + r] * U[r * m + j] / s[r];
    }
  }
  PetscCall(PetscFree5(copy, s, U, Vt, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* s: min(m, n), in descending order. */
PetscErrorCode HycoSingularValues(PetscInt m, PetscInt n, const PetscReal A[], PetscReal s[])
{
  PetscBLASInt mb, nb, one = 1, lwork, info;
  PetscReal *copy, *work, none;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(64 * (m + n), &lwork));
  PetscCall(PetscMalloc2(m * n, &copy, lwork, &work));
  PetscCall(PetscArraycpy(copy, A, m * n));
  PetscCall(PetscFPTrapPush(PETSC_FP_TRAP_OFF)); /* its tests of the arithmetic */
  LAPACKgesvd_("N", "N", &mb, &nb, copy, &mb, s, &none, &one, &none, &one, work, &lwork, &info);
  PetscCall(PetscFPTrapPop());
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "singular values did not converge (LAPACK gesvd: %d)",
             (int)info);
  PetscCall(PetscFree2(copy, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExtremeSingularValues(PetscInt m, PetscInt n, const PetscReal A[], PetscReal *smallest,
                                         PetscReal *largest)
{
  const PetscInt k = PetscMin(m, n);
  PetscReal *s;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(k, &s));
  PetscCall(HycoSingularValues(m, n, A, s));
  *largest = s[0];
  *smallest = s[k - 1];
  PetscCall(PetscFree(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest eigenvalue of A^T A, or with the LU factors of A of its inverse: power iterations from a fixed start.
   One significant digit of the ratio is enough: stops at a change of 1e-3. */
static PetscReal LargestOfSquare(PetscBLASInt n, const PetscReal A[], const PetscReal LU[], const PetscBLASInt ipiv[],
                                 PetscReal x[], PetscReal y[])
{
  const PetscBLASInt one = 1;
  const PetscReal unit = 1, zero = 0;
  PetscReal value = 0;

  /* No symmetry, so that it is not orthogonal to the vector that is looked for, and no random numbers: the same on
     any machine. */
  for (PetscInt i = 0; i < n; i++) x[i] = 1 + 0.5 * PetscSinReal((PetscReal)(i + 1));
  for (PetscInt it = 0; it < 200; it++) {
    PetscReal before = value, size = 0;
    PetscBLASInt info;

    for (PetscInt i = 0; i < n; i++) size += x[i] * x[i];
    size = PetscSqrtReal(size);
    if (!(size > 0) || PetscIsInfOrNanReal(size)) return size;
    for (PetscInt i = 0; i < n; i++) x[i] /= size;
    if (LU) {
      /* (A^T A)^-1 = A^-1 A^-T. */
      LAPACKgetrs_("T", &n, &one, LU, &n, ipiv, x, &n, &info);
      LAPACKgetrs_("N", &n, &one, LU, &n, ipiv, x, &n, &info);
    } else {
      BLASgemv_("N", &n, &n, &unit, A, &n, x, &one, &zero, y, &one);
      BLASgemv_("T", &n, &n, &unit, A, &n, y, &one, &zero, x, &one);
    }
    value = 0;
    for (PetscInt i = 0; i < n; i++) value += x[i] * x[i];
    value = PetscSqrtReal(value);
    if (PetscAbsReal(value - before) <= 1e-3 * value) return value;
  }
  return value;
}

/* Sign of det A and the reciprocal of its condition number, both from one LU factorisation; *ratio 0: singular. For the
   search of turning points. Estimates, not an SVD: it is called for every point of a scan. */
PetscErrorCode HycoSingularity(PetscInt n, const PetscReal A[], PetscInt *sign, PetscReal *ratio)
{
  PetscReal *LU, *x, *y, large, inverse;
  PetscBLASInt nb, info, *ipiv;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscMalloc4((size_t)n * (size_t)n, &LU, n, &x, n, &y, n, &ipiv));
  PetscCall(PetscArraycpy(LU, A, (size_t)n * (size_t)n));
  LAPACKgetrf_(&nb, &nb, LU, &nb, ipiv, &info);
  *sign = 1;
  *ratio = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal u = LU[(size_t)i * (size_t)n + (size_t)i];

    /* det A is the product of the pivots, with a change of sign for each exchange of rows. The product itself
       would overflow. */
    *sign *= (u > 0) - (u < 0);
    if (ipiv[i] != i + 1) *sign = -*sign;
  }
  if (*sign) {
    large = LargestOfSquare(nb, A, NULL, NULL, x, y);
    inverse = LargestOfSquare(nb, A, LU, ipiv, x, y);
    if (large > 0 && inverse > 0 && !PetscIsInfOrNanReal(inverse))
      /* Two roots: the product of the squares may overflow. */
      *ratio = 1 / PetscSqrtReal(large) / PetscSqrtReal(inverse);
  }
  PetscCall(PetscFree4(LU, x, y, ipiv));
  PetscFunctionReturn(PETSC_SUCCESS);
}
