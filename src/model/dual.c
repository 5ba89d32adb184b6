/*
  The nonnegative basis of the contact forces of a projection-based model (6.3, 6.4), made from the dual snapshots:
  their nonnegative factorisation, with as many vectors as there are displacement modes (the extended necessary
  condition l_u >= l_lambda), or the snapshots themselves (Haasdonk, Salomon, Wohlmuth, SIAM J. Numer. Anal. 50 (2012)
  2656-2681).
*/
#include <hycoalgorithms.h>
#include <hycotrainerimpl.h>

/* Each snapshot scaled to unit 2-norm. */
static PetscErrorCode FromSnapshots(HycoModel m, const PetscReal S[])
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
static PetscErrorCode MakeBasis(HycoTrainer t, HycoModel m)
{
  const PetscInt N = m->pairs.n, n = m->n_dual;
  PetscReal *S;

  PetscFunctionBegin;
  HycoDuplicate(N * n, m->S_lambda, &S);
  for (PetscInt k = 0; k < N * n; k++) S[k] = PetscMax(S[k], 0); /* round-off of iterative solves */
  PetscCall(PetscMalloc1(N * PetscMax(n, m->l) + 1, &m->V_lambda));
  if (m->dual == HYCO_DUAL_SNAPSHOTS)
    PetscCall(FromSnapshots(m, S));
  else if (n)
    PetscCall(HycoNNMF(N, n, S, m->l, t->nnmf_max_its, m->V_lambda, &m->l_lambda, &m->dual_misfit));
  PetscCall(PetscFree(S));
  m->n_dual = 0;
  m->counts[0] = t->counts[HYCO_SEED_DUAL] = m->l_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerProject(HycoTrainer t, HycoModel m)
{
  PetscFunctionBegin;
  PetscCall(MakeBasis(t, m));
  PetscCall(HycoModelSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoTrainerJudge(t, m));
  HycoCheck(
      m->numbers[1] < 0.5,
      "the projection-based model misses its own training displacements by %.0f %% on average (%d modes, %d force "
      "vectors, condition %.0e): take more modes (a smaller -hyco_pod_tol)",
      100 * (double)m->numbers[1], (int)m->l, (int)m->l_lambda, (double)m->numbers[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
