/*
  Proper orthogonal decomposition (section 4.1): an SVD by SLEPc, and the selection of its left singular vectors. An
  iterative SVD type, or one that uses the cross-product matrix, finds small singular values inaccurately or not at all,
  even if it reports convergence: its modes are taken up to the first that fails a check, and the energy of the others
  counts as left out.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

/* Of a mode's singular value, its recomputed error: a mode with three digits serves; of the SVDs that lose accuracy the
   modes at round-off have none (tests/training/pod_types.py). */
#define ACCURATE_VALUE 1e-3
/* Cosine of the angle between modes: the energies of (18) then add up to 9 digits (tests/training/pod_types.py). */
#define ORTHONORMAL 1e-9
#define FIRST       16 /* number of triplets requested at first; doubled until sufficient */

/* The options may choose another SVD type. */
PetscErrorCode HycoPODCreateSVD(MPI_Comm comm, SVD *svd)
{
  PetscFunctionBegin;
  PetscCall(HycoSVDRegisterAll());
  PetscCall(SVDCreate(comm, svd));
  PetscCall(SVDSetType(*svd, HYCO_SVD_TSQR));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest l whose left-out energy is at most tol of the whole (18); values below noise times the first are
   round-off. Summed from the smallest. 0 modes if all values are zero. */
PetscInt HycoPODRank(PetscInt k, const PetscReal s[], PetscReal tol, PetscReal noise, PetscInt max_modes)
{
  PetscReal total = 0, tail = 0;
  PetscInt l = k;

  /* From the smallest, so that their sum is not lost in that of the large ones. */
  for (PetscInt j = k - 1; j >= 0; j--) total += s[j] * s[j];
  while (l > 0 && tail + s[l - 1] * s[l - 1] <= tol * total) {
    tail += s[l - 1] * s[l - 1];
    l--;
  }
  while (l > 0 && !(s[l - 1] > noise * s[0])) l--;
  return max_modes > 0 ? PetscMin(l, max_modes) : l;
}

/* Makes a mode's largest entry (the first of nearly equal ones) positive. Singular vectors have no sign; with this
   rule, models are the same on any number of ranks. Collective. */
static PetscErrorCode FixSigns(Mat V, PetscInt l)
{
  PetscInt lo, hi, lda;
  PetscScalar *v;
  MPI_Comm comm = PetscObjectComm((PetscObject)V);

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(V, &lo, &hi));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArray(V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscReal largest = 0, all, sign = 0, sum;
    PetscInt at = PETSC_MAX_INT, first;
    PetscScalar *column = v + (size_t)j * (size_t)lda;

    /* The largest magnitude of all ranks first, then the first row that reaches it, so that round-off between
       equal entries of a symmetric mode does not decide. */
    for (PetscInt i = 0; i < hi - lo; i++) largest = PetscMax(largest, PetscAbsScalar(column[i]));
    PetscCallMPI(MPI_Allreduce(&largest, &all, 1, MPIU_REAL, MPI_MAX, comm));
    for (PetscInt i = hi - lo - 1; i >= 0; i--) {
      if (PetscAbsScalar(column[i]) >= all * (1 - 1e-6)) at = lo + i;
    }
    PetscCallMPI(MPI_Allreduce(&at, &first, 1, MPIU_INT, MPI_MIN, comm));
    if (at == first && at != PETSC_MAX_INT) sign = column[at - lo] < 0 ? -1 : 1;
    /* Only the owner of this row has a sign; the sum broadcasts it. */
    PetscCallMPI(MPI_Allreduce(&sign, &sum, 1, MPIU_REAL, MPI_SUM, comm));
    for (PetscInt i = 0; sum < 0 && i < hi - lo; i++) column[i] = -column[i];
  }
  PetscCall(MatDenseRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the first `most` triplets of S; fixed: the options give another number. */
static PetscErrorCode PODSolve(SVD svd, Mat S, PetscInt most, PetscBool *fixed)
{
  PetscInt N, n, asked;
  SVDType type;
  char name[64];

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, &n));
  PetscCall(SVDReset(svd));
  PetscCall(SVDGetType(svd, &type));
  PetscCall(PetscStrncpy(name, type, sizeof(name)));
  PetscCall(SVDSetType(svd, SVDLAPACK)); /* and back: otherwise an inner eigensolver keeps the previous problem's
                                            sizes */
  PetscCall(SVDSetType(svd, name));
  PetscCall(SVDSetOperators(svd, S, NULL));
  PetscCall(SVDSetImplicitTranspose(svd, (PetscBool)(N >= n))); /* no second copy of S; tsqr transposes wide matrices */
  PetscCall(SVDSetDimensions(svd, most, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(SVDSetWhichSingularTriplets(svd, SVD_LARGEST));
  PetscCall(SVDSetFromOptions(svd));
  PetscCall(SVDGetDimensions(svd, &asked, NULL, NULL));
  *fixed = (PetscBool)(asked != most);
  PetscCall(SVDSolve(svd));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first k left singular vectors, distributed like the rows of S. SLEPc stores them by its own vectors; a dense
   matrix is what the models need. Those of the last solve of svd. */
static PetscErrorCode GetVectors(SVD svd, Mat S, PetscInt k, Mat *V)
{
  PetscInt N, rows;
  Vec v;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &N, NULL));
  PetscCall(MatGetLocalSize(S, &rows, NULL));
  PetscCall(MatCreateDense(PetscObjectComm((PetscObject)S), rows, PETSC_DECIDE, N, k, NULL, V));
  for (PetscInt j = 0; j < k; j++) {
    PetscCall(MatDenseGetColumnVecWrite(*V, j, &v));
    PetscCall(SVDGetSingularTriplet(svd, j, NULL, v, NULL));
    PetscCall(MatDenseRestoreColumnVecWrite(*V, j, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of modes, of the first k, that are orthonormal and whose images under S^T have the length of their
   singular values. A mode is as inaccurate as its product with any former one. */
static PetscErrorCode CountAccurate(Mat S, Mat V, PetscInt k, const PetscReal sigma[], PetscInt *accurate)
{
  PetscInt lo, hi, lda;
  const PetscScalar *g;
  PetscReal *stretch, *skew;
  Mat product;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(k, &stretch));
  PetscCall(PetscCalloc1(k, &skew));
  PetscCall(MatTransposeMatMult(S, V, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  /* |S^T v_j| = sigma_j for an exact left singular vector. */
  PetscCall(MatGetColumnNorms(product, NORM_2, stretch));
  PetscCall(MatDestroy(&product));
  PetscCall(MatTransposeMatMult(V, V, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(MatGetOwnershipRange(product, &lo, &hi));
  PetscCall(MatDenseGetLDA(product, &lda));
  PetscCall(MatDenseGetArrayRead(product, &g));
  for (PetscInt j = 0; j < k; j++) {
    for (PetscInt i = lo; i < hi; i++) {
      /* A pair counts against the later of the two: the first ones, of large singular values, stay usable. */
      PetscReal *worst = &skew[PetscMax(i, j)];

      *worst = PetscMax(*worst, PetscAbsScalar(g[j * lda + i - lo] - (i == j)));
    }
  }
  PetscCall(MatDenseRestoreArrayRead(product, &g));
  PetscCall(MatDestroy(&product));
  HycoAllreduce(skew, k, MPIU_REAL, MPI_MAX, PetscObjectComm((PetscObject)S));
  for (*accurate = 0; *accurate < k; ++*accurate) {
    const PetscReal s = sigma[*accurate];

    /* The first inaccurate mode ends the basis, since all after it have smaller singular values. */
    if (!(PetscAbsReal(stretch[*accurate] - s) <= ACCURATE_VALUE * s && skew[*accurate] <= ORTHONORMAL)) break;
  }
  HycoFreeAll(&stretch, &skew);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The k singular values of a solved problem; 0 if not found. */
static PetscErrorCode GetValues(SVD svd, PetscInt k, PetscReal sigma[], PetscInt *found)
{
  PetscFunctionBegin;
  PetscCall(SVDGetConverged(svd, found));
  *found = PetscMin(*found, k);
  for (PetscInt j = 0; j < *found; j++) PetscCall(SVDGetSingularTriplet(svd, j, &sigma[j], NULL, NULL));
  PetscCall(PetscArrayzero(sigma + *found, k - *found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For types other than tsqr: as few triplets as the criterion needs, as far as they are accurate. The rest of the
   energy size^2 becomes the next singular value, so that (18) includes it. The number of triplets doubles until the
   criterion (18) is met. */
static PetscErrorCode SolveAccurate(SVD svd, Mat S, PetscReal size, PetscReal tol, PetscReal noise, PetscInt max_modes,
                                    PetscInt k, PetscReal sigma[], PetscInt *accurate)
{
  PetscInt found = 0, limit = k;
  PetscBool fixed = PETSC_FALSE, more = PETSC_TRUE, cyclic;
  Mat V;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)svd, SVDCYCLIC, &cyclic));
  if (cyclic) limit = (k + 2) / 3; /* with more, SLEPc 3.18 returns triplets beyond k, which are round-off */
  for (PetscInt most = PetscMin(limit, FIRST); more; most = PetscMin(limit, 2 * most)) {
    PetscReal rest = size * size;

    PetscCall(PODSolve(svd, S, most, &fixed));
    PetscCall(GetValues(svd, k, sigma, &found));
    PetscCall(GetVectors(svd, S, found, &V));
    PetscCall(CountAccurate(S, V, found, sigma, accurate));
    PetscCall(MatDestroy(&V));
    PetscCall(PetscInfo(svd, "%d singular values of %d, %d of them accurate\n", (int)found, (int)k, (int)*accurate));
    for (PetscInt j = 0; j < *accurate; j++) rest -= sigma[j] * sigma[j];
    /* The energy that no accurate mode has: the criterion then counts it as left out. */
    if (*accurate < k) sigma[*accurate] = PetscSqrtReal(PetscMax(rest, 0));
    if (*accurate < k) PetscCall(PetscArrayzero(sigma + *accurate + 1, k - *accurate - 1));
    more = (PetscBool)(!fixed && most < limit && *accurate >= PetscMin(most, found) &&
                       HycoPODRank(k, sigma, tol, noise, max_modes) > *accurate);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V (N x l, distributed like S): modes of the columns of S by (17) and (18); sigma: min(N, n) values. V is NULL if l
   = 0; the caller destroys it. S is scaled and restored. Collective. */
PetscErrorCode HycoPOD(SVD svd, Mat S, PetscReal tol, PetscReal noise, PetscInt max_modes, Mat *V, PetscInt *l,
                       PetscReal sigma[])
{
  PetscInt N, n, k, found;
  PetscBool tsqr, fixed;
  PetscReal size, unit;

  PetscFunctionBegin;
  *V = NULL;
  *l = 0;
  PetscCall(MatGetSize(S, &N, &n));
  k = PetscMin(N, n);
  PetscCall(PetscArrayzero(sigma, k));
  PetscCall(MatNorm(S, NORM_FROBENIUS, &size));
  if (!k || size == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompare((PetscObject)svd, HYCO_SVD_TSQR, &tsqr)); /* backward stable: no check needed */
  unit = PetscPowReal(2, PetscCeilReal(PetscLog2Real(size))); /* exact in both directions; SLEPc's tolerances are
                                                                 absolute */
  PetscCall(MatScale(S, 1 / unit));
  if (tsqr) {
    PetscCall(PODSolve(svd, S, k, &fixed));
    PetscCall(GetValues(svd, k, sigma, &found));
  } else
    PetscCall(SolveAccurate(svd, S, size / unit, tol, noise, max_modes, k, sigma, &found));
  PetscCall(MatScale(S, unit));
  for (PetscInt j = 0; j < k; j++) sigma[j] *= unit;
  if (!found) {
    SVDType type;

    PetscCall(SVDGetType(svd, &type));
    HycoFail("the SVD type %s found no mode of the solutions that is accurate; take another, or the default, %s", type,
             HYCO_SVD_TSQR);
  }
  *l = PetscMin(found, HycoPODRank(k, sigma, tol, noise, max_modes));
  if (*l) {
    PetscCall(GetVectors(svd, S, *l, V));
    PetscCall(FixSigns(*V, *l));
  }
  PetscCall(SVDReset(svd));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* POD from a Gram matrix G (n x n): W (n x l) such that S W has orthonormal columns. Eigenvalues are squares, hence
   values below 1e-7 of the first are round-off. The caller frees W. sigma: n values, those beyond l included. */
PetscErrorCode HycoPODGram(PetscInt n, const PetscReal G[], PetscReal tol, PetscReal noise, PetscReal **W, PetscInt *l,
                           PetscReal sigma[])
{
  PetscBLASInt nb, lwork, info;
  PetscReal *A, *values, *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscMalloc3(n * n, &A, n, &values, 64 * n, &work));
  PetscCall(PetscArraycpy(A, G, n * n));
  PetscCall(PetscBLASIntCast(64 * n, &lwork));
  LAPACKsyev_("V", "U", &nb, A, &nb, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the eigenvalues of the Gram matrix did not converge (LAPACK syev: %d)", (int)info);
  /* LAPACK's values ascend, and round-off makes the smallest ones negative. */
  for (PetscInt j = 0; j < n; j++) sigma[j] = PetscSqrtReal(PetscMax(values[n - 1 - j], 0));
  *l = HycoPODRank(n, sigma, tol, PetscMax(noise, 1e-7), 0);
  PetscCall(PetscMalloc1(n * *l, W));
  for (PetscInt j = 0; j < *l; j++) {
    for (PetscInt i = 0; i < n; i++) (*W)[j * n + i] = A[(n - 1 - j) * n + i] / sigma[j];
  }
  PetscCall(PetscFree3(A, values, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
