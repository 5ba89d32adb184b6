/* The errors of a model in training on its own training solutions. */
#include <hycoreducerimpl.h>
#include <stdio.h>
#include <string.h>

/* Relative error of the last prediction against snapshot k: u on the whole mesh (from the coefficients, because V is
   orthonormal), forces on A_lambda. */
static void SnapshotErrors(HycoReducer t, HycoROM m, PetscInt k, PetscReal *u, PetscReal *lambda)
{
  const PetscInt dim = t->sizes[3];
  const PetscReal *U = t->U_rid + (size_t)k * (size_t)(t->n_rid_nodes * dim),
                  *L = t->Lambda + (size_t)k * (size_t)t->sizes[2], *c = t->VtU + k * t->l;
  PetscReal sum, lost = 0, size = 0;

  sum = t->U_norm[k] * t->U_norm[k];
  /* |U - V gamma|^2 = |U|^2 - |c|^2 + |gamma - c|^2 with c = V^T U and orthonormal V: no loop over the mesh. */
  for (PetscInt j = 0; j < t->l; j++) sum += (m->gamma[j] - c[j]) * (m->gamma[j] - c[j]) - c[j] * c[j];
  for (PetscInt f = 0; f < m->model->n_fe; f++) {
    const PetscInt dof = m->model->fe_dof[f];
    const PetscReal exact = U[t->rid_row[dof / dim] * dim + dof % dim];
    PetscReal by_modes = 0;

    for (PetscInt j = 0; j < m->model->l; j++) by_modes += m->model->V[dof * m->model->l + j] * m->gamma[j];
    /* Unknowns kept full order have their own values instead of the modes'. */
    sum += (m->U[dof] - exact) * (m->U[dof] - exact) - (by_modes - exact) * (by_modes - exact);
  }
  *u = t->U_norm[k] > 0 ? PetscSqrtReal(PetscMax(sum, 0)) / t->U_norm[k] : 0;
  for (PetscInt j = 0; j < m->m; j++) {
    lost += (m->Lambda[m->contact[j]] - L[m->contact[j]]) * (m->Lambda[m->contact[j]] - L[m->contact[j]]);
    size += L[m->contact[j]] * L[m->contact[j]];
  }
  *lambda = size > 0 ? PetscSqrtReal(lost / size) : lost > 0 ? HYCO_JUDGED_WORST : 0;
}

/* The worst of the listed times of training path k, in the path's own steps; errors of quantities below a tenth of
   the path's largest are divided by that tenth. */
static PetscErrorCode PathErrors(HycoReducer t, HycoROM m, PetscInt k, PetscReal *u, PetscReal *lambda)
{
  const PetscInt n = m->model->scene->n_times, first = k * n;
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
    if (size[0] > 0 && !m->trace.loose[j])
      *u = PetscMax(*u, eu * t->U_norm[first + j] / PetscMax(t->U_norm[first + j], 0.1 * size[0]));
    if (force[j] > 0) el *= force[j] / PetscMax(force[j], HYCO_SMALL_FORCE * size[1]);
    /* Without a force in the path's solution at this time there is nothing to compare with. */
    if (force[j] > 0) *lambda = PetscMax(*lambda, el);
  }
  PetscCall(PetscFree(force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates the current model at training point k. A failure counts as HYCO_JUDGED_WORST, so that means stay
   finite and comparable. `solved` is for the message. */
static PetscErrorCode JudgeSample(HycoReducer t, HycoROM m, PetscInt k, const PetscReal mu[], HycoJudged *j)
{
  const PetscBool path = (PetscBool)(m->model->scene->n_times > 0);

  PetscFunctionBegin;
  if (path)
    PetscCall(HycoROMSetJudgedSteps(m, t->taken_start[k + 1] - t->taken_start[k], t->taken + t->taken_start[k]));
  PetscCall(HycoROMPredict(m, m->model->scene->n_parameters, mu));
  if (path)
    PetscCall(PathErrors(t, m, k, &j->u, &j->lambda));
  else
    SnapshotErrors(t, m, k, &j->u, &j->lambda);
  /* A path that ends early has a negative reason, as a solve that diverges. */
  j->solved = (PetscBool)(m->prediction.reason >= 0);
  /* The work of the search is counted: an unsolved point costs its attempts. */
  t->n_judged += j->solved ? 1 : HYCO_UNSOLVED_WORK;
  j->t = m->trace.history.t;
  if (!j->solved || !(j->u < HYCO_JUDGED_WORST)) j->u = HYCO_JUDGED_WORST;
  if (!j->solved || !(j->lambda < HYCO_JUDGED_WORST)) j->lambda = HYCO_JUDGED_WORST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Means over the samples; the errors of each in judged (NULL: not needed). Ends when the mean error of u exceeds
   `most`: the means are then HYCO_JUDGED_WORST. */
static PetscErrorCode JudgeAll(HycoReducer t, HycoROM m, PetscReal most, HycoJudged judged[], PetscReal *u,
                               PetscReal *lambda)
{
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, &n, &n_par, &mu));
  /* (41) does not change what is judged here, and would cost more than the solve. */
  m->reconstruct = PETSC_FALSE;
  *u = *lambda = 0;
  for (PetscInt k = 0; k < n && *u <= most; k++) {
    HycoJudged j;

    if (judged) PetscCall(HycoReducerTell(t, "training points", k, n));
    PetscCall(JudgeSample(t, m, k, mu + k * n_par, &j));
    *u += j.u / n;
    *lambda += j.lambda / n;
    if (judged) judged[k] = j;
  }
  if (*u > most) *u = *lambda = HYCO_JUDGED_WORST;
  /* Predictions of the user choose their own steps again. */
  if (m->model->scene->n_times) PetscCall(HycoROMSetSteps(m, 0, NULL));
  m->reconstruct = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smallest number of paths after which a race is decided. */
#define LEAST_RACED 3

/* Predicts the training paths one by one, and stops when this model has lost: its sum of errors reaches that of the
   best settings over all paths, or, from LEAST_RACED paths on, theirs over the same paths. A mean over all paths is
   compared, so that the sum may stop as soon as it is reached: errors are not negative. */
static PetscErrorCode JudgeUntilLost(HycoReducer t, HycoROM m, PetscInt n, const PetscInt order[],
                                     const HycoJudged best[], PetscReal most, HycoJudged judged[], PetscBool *lost)
{
  PetscInt n_par;
  const PetscReal *mu;
  PetscReal mine = 0, its = 0, all = n * most;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &mu));
  /* Without a former best the limit is `most` times the number of paths. */
  for (PetscInt k = 0; k < n && best; k++) all = (k ? all : 0) + best[k].u;
  *lost = PETSC_FALSE;
  for (PetscInt k = 0; k < n && !*lost; k++) {
    const PetscInt i = order[k];

    PetscCall(HycoReducerTell(t, "training paths", k, n));
    PetscCall(JudgeSample(t, m, i, mu + i * n_par, &judged[i]));
    mine += judged[i].u;
    its += best ? best[i].u : 0;
    *lost = (PetscBool)(mine >= all || (best && k + 1 >= LEAST_RACED && mine >= its));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m->reconstruct is off: forces outside the RID are not judged, and cost more than the solve. */
PetscErrorCode HycoReducerJudgeEarlyStop(HycoReducer t, HycoROM m, const HycoJudged best[], PetscReal most,
                                         HycoJudged judged[], PetscReal *u, PetscBool *lost)
{
  PetscInt n, *order;
  PetscReal *key;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, &n, NULL, NULL));
  PetscCall(PetscMalloc2(n, &order, n, &key));
  for (PetscInt k = 0; k < n; k++) {
    order[k] = k;
    /* The worst paths of the best settings first: a loser is found after few paths. */
    key[k] = best ? -best[k].u : 0;
  }
  if (best) PetscCall(PetscSortRealWithArrayInt(n, key, order));
  m->reconstruct = PETSC_FALSE;
  PetscCall(JudgeUntilLost(t, m, n, order, best, most, judged, lost));
  PetscCall(HycoROMSetSteps(m, 0, NULL));
  m->reconstruct = PETSC_TRUE;
  PetscCall(PetscFree2(order, key));
  *u = 0;
  for (PetscInt k = 0; k < n && !*lost; k++) *u += judged[k].u / n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerJudgeMeans(HycoReducer t, HycoROM m, PetscReal most, PetscReal *u, PetscReal *lambda)
{
  PetscFunctionBegin;
  PetscCall(JudgeAll(t, m, most, NULL, u, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An attempt of a search is judged by held-out points: its training errors would cost as much again. -1: not
   known. */
PetscErrorCode HycoReducerJudge(HycoReducer t, HycoROM m)
{
  PetscInt n;

  PetscFunctionBegin;
  /* Models of bodies learn from samples of their own: no training solution exists. */
  if (t->columns != t->samples) { /* there is no training solution */
    m->model->numbers[0] = 0;
    m->model->numbers[1] = m->model->numbers[2] = -1;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (t->trying) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->columns, &n, NULL, NULL));
  PetscCall(PetscFree(t->judged));
  PetscCall(PetscMalloc1(n, &t->judged));
  PetscCall(JudgeAll(t, m, PETSC_INFINITY, t->judged, &m->model->numbers[1], &m->model->numbers[2]));
  m->model->numbers[0] = 0;
  /* After the predictions: the matrix of the last one is there. */
  PetscTryTypeMethod(m, condition, &m->model->numbers[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. Not an error without a monitor. */
PetscErrorCode HycoReducerTell(HycoReducer t, const char what[], PetscInt done, PetscInt n)
{
  char phase[2 * HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoInterruptCheck());
  if (!t->phase || t->rank) PetscFunctionReturn(PETSC_SUCCESS);
  snprintf(phase, sizeof(phase), "%s%s%s", t->doing, t->doing[0] ? ": " : "", what);
  PetscCall((*t->phase)(phase, done, n, t->phase_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define NAMED 3 /* as many as fit in a line */

/* "; 2 of 9 paths do not reach their end: gap = 0.004 (t = 3.1), gap = 0.005 (t = 6)" */
static PetscInt NameUnsolved(HycoReducer t, PetscInt n, const PetscReal mu[], char text[HYCO_LINE])
{
  const PetscBool path = (PetscBool)(t->scene->n_times > 0);
  PetscInt missing = 0, named = 0;
  size_t length;

  for (PetscInt k = 0; k < n; k++) missing += !t->judged[k].solved;
  if (!missing) return 0;
  HycoFormat(text, "; %d of %d %s: ", (int)missing, (int)n,
             path ? "paths do not reach their end" : "solves do not converge");
  for (PetscInt k = 0; k < n && named < NAMED; k++) {
    char at[HYCO_LINE], when[64] = "";

    /* Only the first NAMED are named; the message has one line. */
    if (t->judged[k].solved) continue;
    /* Parameters by name: the point can be repeated by the command line. */
    HycoSceneNamePoint(t->scene, mu + k * t->scene->n_parameters, at);
    if (path) snprintf(when, sizeof(when), " (t = %.6g)", (double)t->judged[k].t);
    length = strlen(text);
    snprintf(text + length, HYCO_LINE - length, "%s%s%s", named++ ? "; " : "", at, when);
  }
  length = strlen(text);
  if (missing > named) snprintf(text + length, HYCO_LINE - length, "; and %d more", (int)(missing - named));
  return missing;
}

/* Ends a message: which training points made the model be refused. */
void HycoReducerNameWorst(HycoReducer t, char text[HYCO_LINE])
{
  PetscInt n, n_par, worst = -1, missing;
  const PetscReal *mu;
  char at[HYCO_LINE];
  size_t length;

  text[0] = '\0';
  /* Nothing is known before training points are judged. */
  if (!t->judged || HycoSamplesGet(t->columns, &n, &n_par, &mu)) return;
  missing = NameUnsolved(t, n, mu, text);
  for (PetscInt k = 0; k < n; k++) {
    if (t->judged[k].solved && (worst < 0 || t->judged[k].u > t->judged[worst].u)) worst = k;
  }
  if (worst < 0) return;
  HycoSceneNamePoint(t->scene, mu + worst * n_par, at);
  length = strlen(text);
  snprintf(text + length, HYCO_LINE - length, "; the worst%s, by %.0f %%%s, at %s", missing ? " of the others" : "",
           100 * (double)t->judged[worst].u, t->judged[worst].u < HYCO_JUDGED_WORST ? "" : " or more", at);
}
