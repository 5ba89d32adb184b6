/*
  Replay: stress and state outside the RID of a predicted path. A law is pointwise: the displacement V gamma(t) at each
  accepted time gives the state of every cell, without a solve. Also writes the series of fields on the whole mesh.
*/
#include <hycopath.h>
#include <hycoromimpl.h>

/* fe's parameters hold the point; the time and the tables follow from the step. */
PetscErrorCode HycoReplayMove(HycoReplay *r, PetscInt k)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoSceneSetTime(r->m->model->scene, r->m->fe->mu, r->m->trace.t[k], mu);
  PetscCall(HycoFESetParameters(r->march.fe, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing is solved here: the displacements of a path are known, and the laws follow them from the first time on,
   on any part of the mesh. */
PetscErrorCode HycoReplayBegin(HycoROM m, HycoFE fe, HycoReplay *r)
{
  PetscFunctionBegin;
  *r = (HycoReplay){.m = m, .march.fe = fe};
  PetscCall(HycoReplayMove(r, 0)); /* the initial state depends on the first temperature */
  PetscCall(HycoTimeLoopBegin(fe, &r->march));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The accepted times of the path are the steps: with others the implicit laws would give other states than the
   path itself. */
PetscErrorCode HycoReplayTry(HycoReplay *r, PetscInt k, const PetscReal u[], HycoFEStepReport *report)
{
  const PetscReal *t = r->m->trace.t;

  PetscFunctionBegin;
  PetscCall(HycoTimeLoopStep(&r->march, u, t[PetscMax(k - 1, 0)], t[k], report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first step has no duration: it gives the state at the path's begin. */
PetscErrorCode HycoReplayStep(HycoReplay *r, PetscInt k, const PetscReal u[])
{
  HycoFEStepReport report;

  PetscFunctionBegin;
  PetscCall(HycoReplayTry(r, k, u, &report));
  HycoCheck(!report.failed, "the laws cannot be integrated along the predicted displacements at t = %.10g: %s",
            (double)r->m->trace.t[k], report.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReplayEnd(HycoReplay *r)
{
  PetscFunctionBegin;
  PetscCall(HycoTimeLoopEnd(&r->march));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of the series at listed time j, the current time of the replay. */
static HycoSeriesSource ReplayFields(const HycoReplay *r, PetscInt j)
{
  HycoROM m = r->m;
  /* On one process the whole mesh has the surfaces: one FE serves both. */
  const HycoSeriesSource from = {.comm = PETSC_COMM_SELF,
                                 .fe = m->fe_whole,
                                 .state = r->march.state,
                                 .fe_surface = m->fe_whole,
                                 .pairs = &m->whole_pairs,
                                 .n_nodes = m->model->whole->n_nodes,
                                 .n_cells = m->model->whole->n_cells,
                                 .n_contacts = m->model->pairs.n,
                                 .u = m->U_whole,
                                 .u_surface = m->U_whole,
                                 .lambda = m->trace.Lambda + (size_t)j * (size_t)m->model->pairs.n,
                                 .mu = m->fe->mu,
                                 .t = m->trace.t[m->trace.at[j]]};

  return from;
}

/* Replays all accepted times in order, because states depend on those before, and writes the listed ones. */
static PetscErrorCode WriteTimes(HycoReplay *r, HycoSeries series)
{
  HycoROM m = r->m;
  HycoSeriesSource from = ReplayFields(r, 0);

  PetscFunctionBegin;
  HycoTraceShow(m, 0);
  PetscCall(HycoSeriesOpen(series, &from));
  for (PetscInt k = 0, j = 0; k < m->trace.n; k++) {
    PetscCall(HycoReplayMove(r, k));
    HycoTraceWholeU(m, k, m->U_whole);
    PetscCall(HycoReplayStep(r, k, m->U_whole));
    /* Steps between listed times are only marched through. */
    if (j == m->trace.n_listed || m->trace.at[j] != k) continue;
    /* The getters that the fields use read the selected time. */
    HycoTraceShow(m, j);
    from = ReplayFields(r, j++);
    PetscCall(HycoSeriesAddTime(series, &from));
  }
  PetscCall(HycoSeriesClose(series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The series is destroyed after an error, which removes what was written of it. */
PetscErrorCode HycoTraceWrite(HycoROM m, const char path[])
{
  HycoReplay r = {0};
  HycoSeries series;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMLoadWhole(m));
  m->whole_current = PETSC_FALSE; /* the replay overwrites U_whole */
  PetscCall(HycoSeriesCreate(PETSC_COMM_SELF, path, m->trace.n_listed, &series));
  ierr = HycoReplayBegin(m, m->fe_whole, &r);
  if (!ierr) ierr = WriteTimes(&r, series);
  PetscCall(HycoReplayEnd(&r));
  PetscCall(HycoSeriesDestroy(&series));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
