/*
  Replay: stress and state outside the RID of a predicted path. A law is pointwise: with the displacement V gamma(t) at
  each accepted time it gives the state of every cell of the whole mesh, without a solve. Into a series of fields.
*/
#include <hycopath.h>
#include <hycoromimpl.h>

typedef struct {
  HycoROM m;
  HycoSeries series;
  HycoFEState begin, end;
  PetscReal *f_int; /* nobody asks for */
} Replay;

/* The whole mesh at the time of accepted step k. */
static PetscErrorCode MoveTo(HycoROM m, PetscInt k)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoSceneSetTime(m->scene, m->fe->mu, m->trace.t[k], mu);
  PetscCall(HycoFESetParameters(m->fe_whole, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws from accepted step k - 1 to k. */
static PetscErrorCode StepTo(Replay *r, PetscInt k)
{
  HycoROM m = r->m;
  const PetscReal *t = m->trace.t;
  HycoFEState state = r->begin;
  HycoFEStepReport report;

  PetscFunctionBegin;
  PetscCall(MoveTo(m, k));
  HycoTraceWholeU(m, k, m->U_whole);
  PetscCall(PetscArrayzero(r->f_int, m->fe_whole->n_dof));
  PetscCall(HycoFEStep(m->fe_whole, m->U_whole, t[PetscMax(k - 1, 0)], t[k], r->begin, r->end, r->f_int, PETSC_FALSE,
                       &report));
  HycoCheck(!report.failed, "outside the RID the laws have no answer to the predicted displacements at t = %.10g: %s",
            (double)t[k], report.why);
  r->begin = r->end;
  r->end = state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the series shows of listed time j, where the replay is. */
static HycoSeriesSource Look(const Replay *r, PetscInt j)
{
  HycoROM m = r->m;
  const HycoSeriesSource from = {.comm = PETSC_COMM_SELF,
                                 .fe = m->fe_whole,
                                 .state = r->begin,
                                 .fe_surface = m->fe_whole,
                                 .pairs = &m->whole_pairs,
                                 .n_nodes = m->whole->n_nodes,
                                 .n_cells = m->whole->n_cells,
                                 .n_contacts = m->pairs.n,
                                 .u = m->U_whole,
                                 .u_surface = m->U_whole,
                                 .lambda = m->trace.Lambda + (size_t)j * (size_t)m->pairs.n,
                                 .mu = m->fe->mu,
                                 .t = m->trace.t[m->trace.at[j]]};

  return from;
}

static PetscErrorCode Run(Replay *r)
{
  const HycoTrace *trace = &r->m->trace;
  HycoSeriesSource from;

  PetscFunctionBegin;
  PetscCall(MoveTo(r->m, 0)); /* the state is made at the first temperature */
  PetscCall(HycoFEStateCreate(r->m->fe_whole, &r->begin));
  PetscCall(HycoFEStateCreate(r->m->fe_whole, &r->end));
  PetscCall(PetscMalloc1(r->m->fe_whole->n_dof, &r->f_int));
  from = Look(r, 0);
  PetscCall(HycoSeriesOpen(r->series, &from));
  for (PetscInt k = 0, j = 0; k < trace->n; k++) {
    PetscCall(StepTo(r, k));
    if (j == trace->n_listed || trace->at[j] != k) continue;
    from = Look(r, j++);
    PetscCall(HycoSeriesAddTime(r->series, &from));
  }
  PetscCall(HycoSeriesClose(r->series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTraceWrite(HycoROM m, const char path[])
{
  Replay r = {.m = m};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoROMLoadWhole(m));
  m->whole_current = PETSC_FALSE; /* U_whole is the replay's */
  PetscCall(HycoSeriesCreate(PETSC_COMM_SELF, path, &r.series));
  ierr = Run(&r);
  PetscCall(HycoSeriesDestroy(&r.series));
  PetscCall(HycoFEStateDestroy(&r.begin));
  PetscCall(HycoFEStateDestroy(&r.end));
  PetscCall(PetscFree(r.f_int));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
