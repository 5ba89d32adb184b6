/* Small dense questions: pivots, singular values. */
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

PetscErrorCode HycoPivotColumns(PetscInt m, PetscInt n, PetscReal A[], PetscInt k, PetscInt pivot[])
{
  PetscReal *norm;
  PetscBool *taken;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &norm));
  PetscCall(PetscCalloc1(n, &taken));
  /* Gram-Schmidt with pivoting: of columns equally long (to 1e-10) the first is taken */
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

      if (taken[j] || norm[best] == 0) continue;
      for (PetscInt i = 0; i < m; i++) dot += A[j * m + i] * A[best * m + i];
      for (PetscInt i = 0; i < m; i++) A[j * m + i] -= dot / norm[best] * A[best * m + i];
    }
  }
  PetscCall(PetscFree(norm));
  PetscCall(PetscFree(taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExtremeSingularValues(PetscInt m, PetscInt n, const PetscReal A[], PetscReal *smallest,
                                         PetscReal *largest)
{
  PetscBLASInt mb, nb, one = 1, lwork, info;
  PetscReal *copy, *s, *work, none;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(64 * (m + n), &lwork));
  PetscCall(PetscMalloc3(m * n, &copy, PetscMin(m, n), &s, lwork, &work));
  PetscCall(PetscArraycpy(copy, A, m * n));
  LAPACKgesvd_("N", "N", &mb, &nb, copy, &mb, s, &none, &one, &none, &one, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "singular values did not converge (LAPACK gesvd: %d)",
             (int)info);
  *largest = s[0];
  *smallest = s[PetscMin(m, n) - 1];
  PetscCall(PetscFree3(copy, s, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
