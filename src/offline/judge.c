/* A model under training against its own training solutions. */
#include <hycoreducerimpl.h>

/* Relative error of the last prediction against snapshot k: u on the whole mesh (by the coefficients: V is
 * orthonormal), forces on A_lambda. */
static void SnapshotErrors(HycoReducer t, HycoROM m, PetscInt k, PetscReal *u, PetscReal *lambda)
{
  const PetscInt dim = t->sizes[3];
  const PetscReal *U = t->U_rid + (size_t)k * (size_t)(m->mesh->n_nodes * dim),
                  *L = t->Lambda + (size_t)k * (size_t)t->sizes[2], *c = t->VtU + k * t->l;
  PetscReal sum, lost = 0, size = 0;

  sum = t->U_norm[k] * t->U_norm[k];
  for (PetscInt j = 0; j < t->l; j++) sum += (m->gamma[j] - c[j]) * (m->gamma[j] - c[j]) - c[j] * c[j];
  for (PetscInt f = 0; f < m->n_fe; f++) {
    const PetscInt dof = m->fe_dof[f];
    PetscReal by_modes = 0;

    for (PetscInt j = 0; j < m->l; j++) by_modes += m->V[dof * m->l + j] * m->gamma[j];
    sum += (m->U[dof] - U[dof]) * (m->U[dof] - U[dof]) - (by_modes - U[dof]) * (by_modes - U[dof]);
  }
  *u = t->U_norm[k] > 0 ? PetscSqrtReal(PetscMax(sum, 0)) / t->U_norm[k] : 0;
  for (PetscInt j = 0; j < m->m; j++) {
    lost += (m->Lambda[m->contact[j]] - L[m->contact[j]]) * (m->Lambda[m->contact[j]] - L[m->contact[j]]);
    size += L[m->contact[j]] * L[m->contact[j]];
  }
  *lambda = size > 0 ? PetscSqrtReal(lost / size) : lost > 0 ? HYCO_JUDGED_WORST : 0;
}

/* Mean training errors of the model as it stands. */
PetscErrorCode HycoReducerJudgeMeans(HycoReducer t, HycoROM m, PetscReal *u, PetscReal *lambda)
{
  PetscInt n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  m->reconstruct = PETSC_FALSE;
  *u = *lambda = 0;
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscReal eu, el;

    PetscCall(HycoROMPredict(m, n_par, mu + k * n_par));
    SnapshotErrors(t, m, k, &eu, &el);
    if (m->prediction.reason < 0 || !(eu < HYCO_JUDGED_WORST)) eu = HYCO_JUDGED_WORST;
    if (m->prediction.reason < 0 || !(el < HYCO_JUDGED_WORST)) el = HYCO_JUDGED_WORST;
    *u += eu / t->n_s;
    *lambda += el / t->n_s;
  }
  m->reconstruct = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerJudge(HycoReducer t, HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerJudgeMeans(t, m, &m->numbers[1], &m->numbers[2]));
  m->numbers[0] = 0;
  PetscTryTypeMethod(m, condition, &m->numbers[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
