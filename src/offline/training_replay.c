/* Replay of the laws along the training paths: gives stress and state at each listed time. */
#include <hycoreducerimpl.h>

/* column -1: no displacement has been read. The callbacks say where displacements come from and what is taken at each
   step. */
PetscErrorCode HycoTrainingReplayCreate(HycoReducer t, PetscErrorCode (*displacement)(void *, PetscInt, PetscReal[]),
                                        PetscErrorCode (*record)(void *, PetscInt), void *ctx, HycoTrainingReplay *r)
{
  PetscFunctionBegin;
  *r = (HycoTrainingReplay){
      .t = t, .fe = t->fom->fe, .displacement = displacement, .record = record, .ctx = ctx, .column = -1};
  PetscCall(PetscMalloc1(r->fe->n_dof, &r->u));
  PetscCall(PetscMalloc1(r->fe->n_dof, &r->before));
  PetscCall(PetscMalloc1(r->fe->n_dof, &r->after));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainingReplayDestroy(HycoTrainingReplay *r)
{
  PetscFunctionBegin;
  PetscCall(HycoTimeLoopEnd(&r->march));
  HycoFreeAll(&r->u, &r->before, &r->after);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u of training point k at a time, at fe's parameters. Collective. */
static PetscErrorCode TrainingReplayDisplace(HycoTrainingReplay *r, PetscInt k, PetscReal time)
{
  const HycoScene scene = r->t->scene;
  const PetscInt n = HycoSnapshotsSteps(scene);
  PetscReal share = 0;
  PetscInt at = 0;

  PetscFunctionBegin;
  if (scene->n_times > 1) {
    /* The interval with `time`; the last one for its end. */
    while (at + 2 < n && scene->times[at + 1] < time) at++;
    share = PetscMin(1, (time - scene->times[at]) / (scene->times[at + 1] - scene->times[at]));
  }
  /* Both ends are kept over the steps of an interval: reading is collective and costs a message. */
  if (r->column != k * n + at) {
    PetscCall((*r->displacement)(r->ctx, k * n + at, r->before));
    if (n > 1) PetscCall((*r->displacement)(r->ctx, k * n + at + 1, r->after));
  }
  r->column = k * n + at;
  for (PetscInt i = 0; i < r->fe->n_dof; i++)
    /* Prescribed displacements are those of this very time, the rest is interpolated. */
    r->u[i] = r->fe->u0[i] + (share > 0 ? (1 - share) * r->before[i] + share * r->after[i] : r->before[i]);
  HycoFEComplete(r->fe, r->u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrates the laws from t0 to t1, the time of fe and u. */
static PetscErrorCode TrainingReplayStep(HycoTrainingReplay *r, PetscReal t0, PetscReal t1)
{
  HycoFEStepReport report;

  PetscFunctionBegin;
  if (!r->march.state)
    PetscCall(HycoTimeLoopBegin(r->fe, &r->march)); /* after fe has been set to the path's first time */
  PetscCall(HycoTimeLoopStep(&r->march, r->u, t0, t1, &report));
  HycoCheckModel(!report.failed, "the laws cannot be integrated along the training displacements at t = %.10g: %s",
                 (double)t1, report.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrates the laws at the n times taken[]. The march begins anew for each path; a listed time is one of
   `taken`, to the bit. */
static PetscErrorCode TrainingReplayIntegrate(HycoTrainingReplay *r, PetscInt k, const PetscReal mu[], PetscInt n,
                                              const PetscReal taken[])
{
  const HycoScene scene = r->t->scene;
  const PetscInt steps = HycoSnapshotsSteps(scene);
  PetscReal all[HYCO_MAX_PARAMETERS];
  PetscInt step = 0;

  PetscFunctionBegin;
  /* States of the former path. */
  PetscCall(HycoTimeLoopEnd(&r->march));
  for (PetscInt i = 0; i < n; i++) {
    HycoSceneSetTime(scene, mu, taken[i], all);
    PetscCall(HycoFOMSetParameters(r->t->fom, all));
    PetscCall(TrainingReplayDisplace(r, k, taken[i]));
    /* A law without a solution on one rank ends the replay on all. */
    HycoOnEach(HycoComm(r->t), TrainingReplayStep(r, taken[PetscMax(i - 1, 0)], taken[i]));
    if (!scene->n_times || (step < scene->n_times && taken[i] == scene->times[step]))
      PetscCall((*r->record)(r->ctx, k * steps + step++));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In full order's own steps, so that states are those of the solutions. */
PetscErrorCode HycoTrainingReplayFollow(HycoTrainingReplay *r, HycoSnapshots store, PetscInt k)
{
  HycoReducer t = r->t;
  const PetscReal *mu;
  PetscReal *taken = NULL, time_error;
  PetscInt n_par, n = 1;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  if (t->scene->n_times)
    HycoOnEach(HycoComm(t), HycoSnapshotsReadTaken(store, mu + k * n_par, &n, &taken, &time_error));
  /* Without a history one time, 0, at which the laws are linear. */
  else
    PetscCall(PetscCalloc1(1, &taken));
  HycoFinally(TrainingReplayIntegrate(r, k, mu + k * n_par, n, taken), PetscCall(PetscFree(taken)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
