/*
  POD of columns that arrive in blocks: hierarchical approximate POD along a chain (Himpele, Leibner, Rave, SIAM J. Sci.
  Comput. 40 (2018) A3267-A3292). The columns so far are stored as V diag(sigma), with their left singular vectors and
  values up to the truncation error: if the blocks lose energies with the sum e^2, every singular value has an error of
  at most e, and so does the projection error of all columns onto the modes.
*/
#include <hycoalgorithms.h>

/* Overwrites V by V diag(sigma). The scaled modes stand for the columns that they came from. */
static PetscErrorCode ScaleModes(Mat V, PetscInt l, const PetscReal sigma[])
{
  PetscInt rows, lda;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(V, &rows, NULL));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArray(V, &v));
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < rows; i++) v[(size_t)j * (size_t)lda + (size_t)i] *= sigma[j];
  }
  PetscCall(MatDenseRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without communication: both matrices have the same rows on each rank. */
PetscErrorCode HycoCopyColumns(Mat X, PetscInt n, Mat Y, PetscInt at)
{
  Mat from, to;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDenseGetSubMatrix(X, PETSC_DECIDE, PETSC_DECIDE, 0, n, &from));
  PetscCall(MatDenseGetSubMatrix(Y, PETSC_DECIDE, PETSC_DECIDE, at, at + n, &to));
  PetscCall(MatCopy(from, to, SAME_NONZERO_PATTERN));
  PetscCall(MatDenseRestoreSubMatrix(Y, &to));
  PetscCall(MatDenseRestoreSubMatrix(X, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A B] with the same distribution; A and B are destroyed. Collective. */
PetscErrorCode HycoJoinColumns(Mat *A, Mat *B, Mat *joined)
{
  PetscInt N, n[2], rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(*A, &N, &n[0]));
  PetscCall(MatGetSize(*B, NULL, &n[1]));
  PetscCall(MatGetLocalSize(*A, &rows, NULL));
  PetscCall(MatCreateDense(PetscObjectComm((PetscObject)*A), rows, PETSC_DECIDE, N, n[0] + n[1], NULL, joined));
  PetscCall(HycoCopyColumns(*A, n[0], *joined, 0));
  PetscCall(HycoCopyColumns(*B, n[1], *joined, n[0]));
  PetscCall(HycoMatAssemble(*joined));
  HycoDestroyAll(A, B);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the columns of S, which is destroyed, to the merged ones; loss: energy that may be left out, relative.
   *merged NULL: nothing yet. Collective. */
PetscErrorCode HycoPODMerge(SVD svd, PetscReal loss, Mat *merged, Mat *S)
{
  PetscInt N, n, l;
  PetscReal *sigma;
  Mat all, V;

  PetscFunctionBegin;
  if (*merged)
    PetscCall(HycoJoinColumns(merged, S, &all));
  else {
    all = *S;
    *S = NULL;
  }
  PetscCall(MatGetSize(all, &N, &n));
  PetscCall(PetscMalloc1(n + 1, &sigma));
  /* V Sigma instead of the snapshots: V Sigma has their singular values and left singular vectors, and as many
     columns as are kept. */
  PetscCall(HycoPOD(svd, all, loss, 0, 0, &V, &l, sigma));
  PetscCall(MatDestroy(&all));
  if (l) PetscCall(ScaleModes(V, l, sigma));
  *merged = l ? V : NULL;
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}
