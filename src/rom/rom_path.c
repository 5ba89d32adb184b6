/* Data that a model of paths keeps of the last prediction: displacements at all accepted times, further results at
   the listed ones. */
#include <hycopath.h>
#include <hycoromimpl.h>

/* What the caller has set (times of steps, cuts) stays. */
PetscErrorCode HycoTraceFree(HycoROM m)
{
  HycoTrace *r = &m->trace;
  const HycoTrace empty = {.n_given = r->n_given, .given = r->given, .most_cuts = r->most_cuts, .rtol = r->rtol};

  PetscFunctionBegin;
  m->pairs.shear = m->whole_pairs.shear = NULL;
  m->friction = NULL;
  HycoFreeAll(&r->t, &r->gamma, &r->U_fe, &r->at, &r->loose, &r->Lambda, &r->sigma, &r->inelastic, &r->shear, &r->step);
  *r = empty;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Arrays are kept from path to path; `room` and the accepted steps grow in HycoTraceAdd(). */
PetscErrorCode HycoTraceBegin(HycoROM m)
{
  const PetscInt n_times = m->model->scene->n_times;
  HycoTrace *r = &m->trace;

  PetscFunctionBegin;
  /* Only counters: the arrays keep their room from path to path. */
  r->n = r->n_listed = r->shown = 0;
  PetscCall(PetscMemzero(&r->history, sizeof(r->history)));
  PetscCall(PetscFree(r->step));
  if (r->at) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n_times + 1, &r->at)); /* one more: the end of a path that ends early */
  PetscCall(PetscMalloc1(n_times + 1, &r->loose));
  PetscCall(PetscMalloc1((size_t)(n_times + 1) * (size_t)m->model->pairs.n + 1, &r->Lambda));
  PetscCall(PetscMalloc1((size_t)(n_times + 1) * (size_t)(m->model->mesh->n_cells * m->fe->n_sigma) + 1, &r->sigma));
  PetscCall(PetscMalloc1((size_t)(n_times + 1) * (size_t)m->model->mesh->n_cells + 1, &r->inelastic));
  if (HycoSceneHasFriction(m->model->scene))
    PetscCall(PetscCalloc1((size_t)(n_times + 1) * (size_t)(8 * m->model->pairs.n) + 1, &r->shear));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coefficients and full-order unknowns of an accepted time, from which all displacements follow: the states of the
   laws are not stored, a replay computes them. */
PetscErrorCode HycoTraceAdd(HycoROM m, PetscReal t)
{
  const size_t l = (size_t)m->model->l, n_fe = (size_t)m->model->n_fe;
  HycoTrace *r = &m->trace;

  PetscFunctionBegin;
  /* The number of accepted steps is not known in advance: cuts add some. */
  if (r->n == r->room) {
    r->room = 2 * r->room + 64;
    PetscCall(PetscRealloc((size_t)r->room * sizeof(PetscReal), &r->t));
    PetscCall(PetscRealloc(((size_t)r->room * l + 1) * sizeof(PetscReal), &r->gamma));
    PetscCall(PetscRealloc(((size_t)r->room * n_fe + 1) * sizeof(PetscReal), &r->U_fe));
  }
  r->t[r->n] = t;
  PetscCall(PetscArraycpy(r->gamma + (size_t)r->n * l, m->gamma, l));
  for (size_t k = 0; k < n_fe; k++) r->U_fe[(size_t)r->n * n_fe + k] = m->U[m->model->fe_dof[k]];
  r->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room of the listed time for what the type computes there; the caller fills stresses and inelastic strains. */
PetscErrorCode HycoTraceList(HycoROM m, PetscReal **sigma, PetscReal **inelastic)
{
  HycoTrace *r = &m->trace;
  const size_t k = (size_t)r->n_listed, n_cells = (size_t)m->model->mesh->n_cells;

  PetscFunctionBegin;
  /* The last accepted step is the one that has just reached the listed time. */
  r->at[r->n_listed] = r->n - 1;
  r->loose[r->n_listed] = PETSC_FALSE; /* unless the type knows better */
  r->shown = r->n_listed++;
  PetscCall(PetscArraycpy(r->Lambda + k * (size_t)m->model->pairs.n, m->Lambda, m->model->pairs.n));
  *sigma = r->sigma + k * n_cells * (size_t)m->fe->n_sigma;
  *inelastic = r->inelastic + k * n_cells;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm is over the RID, the sums over all contacts. A step begins with zeros. */
PetscErrorCode HycoTraceMeasure(HycoROM m, HycoStep *s)
{
  const PetscInt dim = m->fe->dim, *node;
  HycoContactFacts state;
  PetscInt n;

  PetscFunctionBegin;
  s->n_dependent = -1; /* unless the type knows its surfaces */
  PetscCall(HycoContactMeasure(m->fe, m->of_fe, m->U, m->Lambda, m->contact, m->model->facet, &state));
  s->sliding = state.sliding;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    s->total_contact_force += m->Lambda[k];
    s->lambda_max = PetscMax(s->lambda_max, m->Lambda[k]);
  }
  /* After the largest is known: a force of round-off is not active. */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) s->n_active += m->Lambda[k] > HYCO_FORCE_ROUND_OFF * s->lambda_max;
  PetscCall(ISGetLocalSize(m->model->rid, &n));
  PetscCall(ISGetIndices(m->model->rid, &node));
  for (PetscInt k = 0; k < n * dim; k++) s->u_norm2 += PetscSqr(m->U[node[k / dim] * dim + k % dim]);
  PetscCall(ISRestoreIndices(m->model->rid, &node));
  s->u_norm2 = PetscSqrtReal(s->u_norm2);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of the cells; with `linear` bodies at U, in `state` too only if it is needed for that. */
static PetscErrorCode ComputeFields(HycoROM m, PetscBool linear, HycoFEState state, PetscReal sigma[],
                                    PetscReal mises[], PetscReal inelastic[], HycoStep *s)
{
  PetscReal stored = 0;
  PetscBool served = PETSC_FALSE;

  PetscFunctionBegin;
  /* One pass over the cells without building a state; it declines where a law has one. */
  if (linear) PetscCall(HycoFELinearFields(m->fe, m->U, sigma, mises, &stored, &served));
  if (served) PetscCall(PetscArrayzero(inelastic, m->model->mesh->n_cells));
  if (linear && !served) PetscCall(HycoFELinearStress(m->fe, m->U, state, &stored));
  if (!served) PetscCall(HycoFEStateFields(m->fe, state, sigma, mises, inelastic, NULL));
  s->stored += stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At an accepted, listed time with the state there. */
PetscErrorCode HycoTraceRecord(HycoROM m, PetscBool linear, HycoFEState state, HycoStep *s)
{
  PetscReal *sigma, *inelastic, *mises;

  PetscFunctionBegin;
  PetscCall(HycoTraceList(m, &sigma, &inelastic));
  PetscCall(PetscMalloc1(m->model->mesh->n_cells, &mises));
  PetscCall(ComputeFields(m, linear, state, sigma, mises, inelastic, s));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    s->mises = PetscMax(s->mises, mises[e]);
    s->inelastic = PetscMax(s->inelastic, inelastic[e]);
  }
  PetscCall(PetscFree(mises));
  /* After the fields: the step's maxima belong to the same time. */
  PetscCall(HycoTraceMeasure(m, s));
  if (!m->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactStateMeasure(m->friction, s));
  PetscCall(HycoTraceListShear(m, &m->friction->shear));
  HycoTraceShow(m, m->trace.shown);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The options of time steps are those of full order, and mean the same. */
PetscErrorCode HycoTraceOptions(HycoROM m, HycoPath p)
{
  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)m);
  PetscCall(HycoPathSetFromOptions(p, PetscOptionsObject));
  PetscOptionsEnd();
  HycoCheck(!p->checkpoint[0] && !p->resume && !p->fclib[0] && !p->fclib_timed,
            "-hyco_checkpoint, -hyco_resume and -hyco_write_fclib are for hyco solve; a reduced path takes seconds");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the results of the whole path. */
static void RomPathSummarise(HycoPath p, HycoPrediction *out)
{
  out->kkt = p->kkt;
  if (out->reason > 0) out->reason = p->ended ? HYCO_CONVERGED : HYCO_DIVERGED_STEP;
  for (PetscInt k = 0; k < p->n_steps; k++) {
    out->iterations += p->steps[k].iterations;
    out->seconds.factor += p->steps[k].seconds_factor;
    out->seconds.solve += p->steps[k].seconds_solve;
  }
}

/* Given steps: those of the full order path, so that the error in time is that of both and cancels in comparisons.
   rtol of gradients is smaller, for differences of paths, and is restored. */
PetscErrorCode HycoTraceFollow(HycoROM m, HycoPath p, const PetscReal mu[])
{
  HycoPrediction *out = &m->prediction;
  const PetscReal rtol = p->rtol;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  out->iterations = 0;
  out->seconds.assemble = out->seconds.factor = out->seconds.solve = 0;
  out->reason = HYCO_CONVERGED; /* unless a listed time changes it */
  p->n_given = m->trace.n_given;
  p->given = m->trace.given;
  p->n_stops = m->model->n_stops;
  p->stops = m->model->stops;
  p->most_cuts = m->trace.most_cuts;
  /* A prediction must not depend on the path before it. */
  p->cold = PETSC_TRUE;
  PetscCall(HycoTraceBegin(m));
  if (m->trace.rtol > 0) p->rtol = PetscMin(rtol, m->trace.rtol);
  PetscCall(HycoPathBegin(p, mu));
  ierr = HycoPathRun(p);
  p->rtol = rtol;
  PetscCall(ierr);
  m->trace.n_cuts = p->n_cuts;
  HycoPathGetHistory(p, &m->trace.history);
  if (p->n_stops && !p->substeps && p->time_tol > 0) m->trace.history.time_error = m->model->time_error;
  RomPathSummarise(p, out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lifting is fe_whole's: the caller has moved it to the step (HycoReplayMove()). */
void HycoTraceWholeU(HycoROM m, PetscInt k, PetscReal U[])
{
  const HycoTrace *r = &m->trace;
  const PetscInt dim = m->model->mesh->dim;
  const PetscReal *gamma = r->gamma + (size_t)k * (size_t)m->model->l,
                  *U_fe = r->U_fe + (size_t)k * (size_t)m->model->n_fe;

  for (PetscInt i = 0; i < m->fe_whole->n_dof; i++) {
    const PetscReal *v = m->model->V_whole + (size_t)i * (size_t)m->model->l;

    U[i] = m->fe_whole->u0[i];
    for (PetscInt j = 0; j < m->model->l; j++) U[i] += v[j] * gamma[j];
  }
  /* Full-order unknowns over the modes' values, as in U; their numbers are those of the model's mesh. */
  for (PetscInt f = 0; f < m->model->n_fe; f++)
    U[m->model->mesh->node_whole[m->model->fe_dof[f] / dim] * dim + m->model->fe_dof[f] % dim] = U_fe[f];
  HycoFEComplete(m->fe_whole, U);
}

/* Largest values over the listed times, for the table of a set of paths. */
void HycoTraceSummary(HycoROM m, HycoPrediction *p)
{
  const HycoHistory *h = &m->trace.history;

  p->path_force = p->path_mises = p->path_inelastic = 0;
  for (PetscInt k = 0; k < h->n; k++) {
    p->path_force = PetscMax(p->path_force, h->step[k].total_contact_force);
    p->path_mises = PetscMax(p->path_mises, h->step[k].mises);
    p->path_inelastic = PetscMax(p->path_inelastic, h->step[k].inelastic);
  }
}

static PetscErrorCode CheckPath(HycoROM m, const char what[])
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before %s", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetHistory(HycoROM m, HycoHistory *history)
{
  PetscFunctionBegin;
  HycoCheckGiven(history);
  PetscCall(CheckPath(m, "HycoROMGetHistory()"));
  PetscCall(HycoROMMeasurePath(m));
  *history = m->trace.history;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Later getters, and features, refer to this time: rows, forces, friction and displacements are moved together. */
PetscErrorCode HycoROMSetStep(HycoROM m, PetscInt k)
{
  HycoTrace *r = &m->trace;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt at;

  PetscFunctionBegin;
  PetscCall(CheckPath(m, "HycoROMSetStep()"));
  PetscCheck(k >= 0 && k < r->n_listed, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "HycoROMSetStep: %d is not a listed time that the path reached; there are %d", (int)k, (int)r->n_listed);
  at = r->at[k];
  HycoSceneSetTime(m->model->scene, m->fe->mu, r->t[at], mu);
  /* Types with a reduced mesh have rows for its contacts alone; the rows of all follow on demand. */
  if (m->fe->mesh == m->model->mesh)
    PetscCall(HycoROMBringRows(m, mu));
  else
    PetscCall(HycoFESetParameters(m->fe, mu));
  PetscCall(PetscArraycpy(m->gamma, r->gamma + (size_t)at * (size_t)m->model->l, m->model->l));
  PetscCall(PetscArraycpy(m->Lambda, r->Lambda + (size_t)k * (size_t)m->model->pairs.n, m->model->pairs.n));
  PetscCall(HycoROMExpandModal(m));
  for (PetscInt f = 0; f < m->model->n_fe; f++)
    m->U[m->model->fe_dof[f]] = r->U_fe[(size_t)at * (size_t)m->model->n_fe + (size_t)f];
  /* After all free unknowns are set: tied and oblique nodes follow them. */
  HycoFEComplete(m->fe, m->U);
  HycoTraceShow(m, k);
  /* Lambda has entries at all contacts: the next solution must clear those outside its own. */
  m->spread = PETSC_TRUE;
  m->whole_current = m->beyond_current = PETSC_FALSE;
  r->shown = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* t is borrowed until it is replaced: predictions read it. */
PetscErrorCode HycoROMSetSteps(HycoROM m, PetscInt n, const PetscReal t[])
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheck(m->model->scene->n_times,
            "HycoROMSetSteps: the model's scene has no history, and its solution has no steps");
  for (PetscInt k = 0; t && k < n; k++)
    HycoCheckValue(PetscIsInfOrNanReal(t[k]) ? PETSC_FALSE : k == 0 || t[k] > t[k - 1],
                   "HycoROMSetSteps: the time %d is %g; times that increase are expected", (int)k, (double)t[k]);
  m->trace.n_given = t ? n : 0;
  m->trace.given = t;
  m->trace.most_cuts = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Limit of halved steps when training judges a model, which otherwise could take minutes to fail. */
#define JUDGED_CUTS 16

/* A path that needs many more steps than full order is a failure of the model, which judging it need not follow to
   its end. */
PetscErrorCode HycoROMSetJudgedSteps(HycoROM m, PetscInt n, const PetscReal t[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMSetSteps(m, n, t));
  m->trace.most_cuts = JUDGED_CUTS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetInelastic(HycoROM m, PetscInt *n_cells, const PetscReal *inelastic[])
{
  PetscFunctionBegin;
  PetscCall(CheckPath(m, "HycoROMGetInelastic()"));
  HycoCheck(m->model->scene->n_times,
            "HycoROMGetInelastic: the model's scene has no history, and its bodies have no inelastic strain");
  if (n_cells) *n_cells = m->model->mesh->n_cells;
  *inelastic = m->trace.inelastic + (size_t)m->trace.shown * (size_t)m->model->mesh->n_cells;
  PetscFunctionReturn(PETSC_SUCCESS);
}
