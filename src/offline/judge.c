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

/* The worst of the listed times of training path k, in the path's own steps; what is small beside the path's largest is
   divided by a tenth of that. */
static PetscErrorCode PathErrors(HycoReducer t, HycoROM m, PetscInt k, PetscReal *u, PetscReal *lambda)
{
  const PetscInt n = m->scene->n_times, first = k * n;
  PetscReal size[2] = {0, 0}, eu, el;
  PetscReal *force;

  PetscFunctionBegin;
  *u = *lambda = 0;
  PetscCall(PetscCalloc1(n, &force));
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal *L = t->Lambda + (size_t)(first + j) * (size_t)t->sizes[2];

    for (PetscInt i = 0; i < m->m; i++) force[j] += L[m->contact[i]] * L[m->contact[i]];
    force[j] = PetscSqrtReal(force[j]);
    size[0] = PetscMax(size[0], t->U_norm[first + j]);
    size[1] = PetscMax(size[1], force[j]);
  }
  for (PetscInt j = 0; j < m->trace.n_listed; j++) {
    PetscCall(HycoROMSetStep(m, j));
    SnapshotErrors(t, m, first + j, &eu, &el);
    if (size[0] > 0) *u = PetscMax(*u, eu * t->U_norm[first + j] / PetscMax(t->U_norm[first + j], 0.1 * size[0]));
    if (force[j] > 0) el *= force[j] / PetscMax(force[j], HYCO_SMALL_FORCE * size[1]);
    if (force[j] > 0) *lambda = PetscMax(*lambda, el);
  }
  PetscCall(PetscFree(force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean training errors of the model as it stands. */
PetscErrorCode HycoReducerJudgeMeans(HycoReducer t, HycoROM m, PetscReal *u, PetscReal *lambda)
{
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, &n_par, &mu));
  m->reconstruct = PETSC_FALSE;
  *u = *lambda = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal eu, el;

    if (m->scene->n_times)
      PetscCall(HycoROMSetSteps(m, t->taken_start[k + 1] - t->taken_start[k], t->taken + t->taken_start[k]));
    PetscCall(HycoROMPredict(m, n_par, mu + k * n_par));
    if (m->scene->n_times)
      PetscCall(PathErrors(t, m, k, &eu, &el));
    else
      SnapshotErrors(t, m, k, &eu, &el);
    if (m->prediction.reason < 0 || !(eu < HYCO_JUDGED_WORST)) eu = HYCO_JUDGED_WORST;
    if (m->prediction.reason < 0 || !(el < HYCO_JUDGED_WORST)) el = HYCO_JUDGED_WORST;
    *u += eu / n;
    *lambda += el / n;
  }
  if (m->scene->n_times) PetscCall(HycoROMSetSteps(m, 0, NULL));
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
