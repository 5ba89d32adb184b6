/*
  The nonnegative basis of the contact forces of a projection-based model (6.3, 6.4), made from the dual snapshots:
  their nonnegative factorisation, by default with as many vectors as there are displacement modes (the extended
  necessary condition l_u >= l_lambda), or the snapshots themselves (Haasdonk, Salomon, Wohlmuth, SIAM J. Numer. Anal.
  50 (2012) 2656-2676). With these the modes take in the snapshots' supremizers, without which they would be fewer than
  the forces to determine.
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>
#include <petscblaslapack.h>

/* Supremizers of unit length: this share of them beyond the modes is round-off. */
#define NEW 1e-8

/* X -= V V^T X twice; V row major. */
static PetscErrorCode RemoveModes(HycoReducer t, PetscInt N, PetscInt n, PetscReal X[])
{
  PetscBLASInt Nb, nb, l;
  const PetscReal one = 1, zero = 0, minus = -1;
  PetscReal *C;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(N, &Nb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(t->l, &l));
  PetscCall(PetscMalloc1(t->l * n, &C));
  for (PetscInt pass = 0; pass < 2; pass++) {
    BLASgemm_("N", "N", &l, &nb, &Nb, &one, t->V_whole, &l, X, &Nb, &zero, C, &l);
    BLASgemm_("T", "N", &Nb, &nb, &l, &minus, t->V_whole, &l, C, &l, &one, X, &Nb);
  }
  PetscCall(PetscFree(C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reducer's modes, their singular values and the snapshots' coefficients, with q more columns of Q (N x q). */
static PetscErrorCode Append(HycoReducer t, PetscInt N, PetscInt q, const PetscReal Q[])
{
  const PetscInt l = t->l, both = l + q;
  PetscReal *V, *VtU, *sigma;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(N * both, &V, both * t->n_s, &VtU, both, &sigma));
  for (PetscInt i = 0; i < N; i++) {
    PetscCall(PetscArraycpy(V + i * both, t->V_whole + i * l, l));
    for (PetscInt j = 0; j < q; j++) V[i * both + l + j] = Q[j * N + i];
  }
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscCall(PetscArraycpy(VtU + k * both, t->VtU + k * l, l));
    for (PetscInt j = 0; j < q; j++) {
      VtU[k * both + l + j] = 0;
      for (PetscInt i = 0; i < N; i++) VtU[k * both + l + j] += Q[j * N + i] * t->U[(size_t)k * (size_t)N + (size_t)i];
    }
  }
  for (PetscInt j = 0; j < both; j++) sigma[j] = j < l ? t->sigma[j] : 0;
  PetscCall(PetscFree(t->V_whole));
  PetscCall(PetscFree(t->VtU));
  PetscCall(PetscFree(t->sigma));
  HycoDuplicate(N * both, V, &t->V_whole);
  HycoDuplicate(both * t->n_s, VtU, &t->VtU);
  HycoDuplicate(both, sigma, &t->sigma);
  PetscCall(PetscFree3(V, VtU, sigma));
  t->l = both;
  t->n_supremizers = q;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerEnrich(HycoReducer t)
{
  const PetscInt N = t->sizes[0] * t->sizes[3], n = t->n_s;
  Mat R, X, Q;
  PetscScalar *x;
  PetscReal *size;
  PetscInt q = 0, found;

  PetscFunctionBegin;
  if (!t->sizes[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerSupremizers(t, &R, &X));
  PetscCall(MatDestroy(&R));
  PetscCall(PetscMalloc1(PetscMax(n, N), &size));
  PetscCall(MatGetColumnNorms(X, NORM_2, size));
  PetscCall(MatDenseGetArray(X, &x));
  for (PetscInt k = 0; k < n; k++) {
    PetscScalar *column = x + (size_t)k * (size_t)N;

    for (PetscInt i = 0; i < N; i++) column[i] = t->fe->fixed[i] || size[k] == 0 ? 0 : column[i] / size[k];
  }
  PetscCall(RemoveModes(t, N, n, x));
  PetscCall(MatDenseRestoreArray(X, &x));
  PetscCall(HycoPOD(X, 0, NEW, 0, &Q, &found, size));
  while (q < found && size[q] > NEW) q++;
  if (found) {
    PetscCall(MatDenseGetArray(Q, &x));
    if (q) PetscCall(Append(t, N, q, x));
    PetscCall(MatDenseRestoreArray(Q, &x));
    PetscCall(MatDestroy(&Q));
  }
  PetscCall(MatDestroy(&X));
  PetscCall(PetscFree(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each snapshot scaled to unit 2-norm. */
static PetscErrorCode FromSnapshots(HycoROM m, const PetscReal S[])
{
  const PetscInt N = m->pairs.n;

  PetscFunctionBegin;
  m->l_lambda = m->n_dual;
  for (PetscInt j = 0; j < m->n_dual; j++) {
    PetscReal length = 0;

    for (PetscInt i = 0; i < N; i++) length += S[j * N + i] * S[j * N + i];
    for (PetscInt i = 0; i < N; i++) m->V_lambda[j * N + i] = S[j * N + i] / PetscSqrtReal(length);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V_lambda from the model's dual snapshots, which it needs no more. */
static PetscErrorCode MakeBasis(HycoReducer t, HycoROM m)
{
  const PetscInt N = m->pairs.n, n = m->n_dual, k = t->nnmf_vectors ? PetscMin(t->nnmf_vectors, PetscMin(N, n)) : m->l;
  PetscReal *S;

  PetscFunctionBegin;
  HycoDuplicate(N * n, m->S_lambda, &S);
  for (PetscInt i = 0; i < N * n; i++) S[i] = PetscMax(S[i], 0); /* round-off of iterative solves */
  PetscCall(PetscMalloc1(N * PetscMax(n, k) + 1, &m->V_lambda));
  if (m->dual == HYCO_DUAL_SNAPSHOTS)
    PetscCall(FromSnapshots(m, S));
  else if (n)
    PetscCall(HycoNNMF(N, n, S, k, t->nnmf_max_its, m->V_lambda, &m->l_lambda, &m->dual_misfit));
  PetscCall(PetscFree(S));
  m->n_dual = 0;
  m->counts[1] = t->n_supremizers;
  m->counts[0] = t->counts[HYCO_SEED_DUAL] = m->l_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerProject(HycoReducer t, HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(MakeBasis(t, m));
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoReducerJudge(t, m));
  HycoCheckModel(
      m->numbers[1] < 0.5,
      "the projection-based model misses its own training displacements by %.0f %% on average (%d modes, %d force "
      "vectors, condition %.0e): take more modes (a smaller -hyco_pod_tol)",
      100 * (double)m->numbers[1], (int)m->l, (int)m->l_lambda, (double)m->numbers[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
