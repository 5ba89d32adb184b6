/*
  The path of a scene with a history: from its first time, where bodies answer at once, through the listed times, in
  steps that are halved where they fail or flow too much and grow where they were easy. What is not accepted leaves no
  trace: state, displacements and forces are those of the last accepted time.
*/
#include <hycopath.h>
#include <hycomaterialimpl.h>
#include <stdlib.h>

#define GROWTH 1.5

static const char *const newton_names[] = {"auto", "tangent", "elastic", NULL};

PetscErrorCode HycoPathSetFromOptions(HycoFOM f, HycoOptionItems PetscOptionsObject)
{
  HycoPath p;

  PetscFunctionBegin;
  if (!f->path) {
    PetscCall(PetscNew(&f->path));
    f->path->rtol = 1e-10;
    f->path->bound = 1e-3;
    f->path->smallest = 1e-10;
    f->path->substeps = 1;
  }
  p = f->path;
  PetscCall(HycoOptionsWord("-hyco_newton",
                            "history: iterate with the tangent, or with the elastic stiffness, whose factor is kept "
                            "(auto: what takes less time by the number of unknowns)",
                            newton_names, &p->method, NULL));
  PetscCall(HycoOptionsReal("-hyco_newton_rtol",
                            "history: residual of equilibrium, relative to the largest of the forces", 1e-14, 1e-2,
                            &p->rtol, NULL));
  PetscCall(HycoOptionsInt("-hyco_newton_max_its",
                           "history: contact systems of a step before it is cut (0: tangent 15, elastic 60)", 0, 100000,
                           &p->max_its, NULL));
  PetscCall(HycoOptionsReal("-hyco_step_inelastic", "history: largest inelastic strain of a step; beyond, it is halved",
                            1e-12, 1e3, &p->bound, NULL));
  PetscCall(HycoOptionsReal("-hyco_step_smallest", "history: no step is cut below this share of the whole time", 1e-15,
                            1, &p->smallest, NULL));
  PetscCall(HycoOptionsInt("-hyco_substeps", "history: at least as many steps from one listed time to the next", 1,
                           1000000000, &p->substeps, NULL));
  PetscCall(HycoOptionsString("-hyco_checkpoint",
                              "<file.h5> history: the last accepted step is kept there, to be resumed from",
                              p->checkpoint, sizeof(p->checkpoint), NULL));
  PetscCall(HycoOptionsBool("-hyco_resume", "history: go on from the checkpoint, if it is there", &p->resume, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathRefuseOptions(HycoFOM f)
{
  static const char *const name[] = {"-hyco_newton",         "-hyco_newton_rtol",   "-hyco_newton_max_its",
                                     "-hyco_step_inelastic", "-hyco_step_smallest", "-hyco_substeps",
                                     "-hyco_checkpoint",     "-hyco_resume"};

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(name) / sizeof(name[0]); k++) {
    PetscBool set;

    PetscCall(PetscOptionsHasName(f->scene->options, NULL, name[k], &set));
    PetscCheck(!set, HycoComm(f), PETSC_ERR_USER, "%s is for scenes with a history, and this one has none", name[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathCreate(HycoFOM f)
{
  HycoPath p = f->path;
  Vec *likeU[] = {&p->F,    &p->F_old,    &p->f_int,  &p->f_old,  &p->r, &p->U_old,
                  &p->work, &p->diagonal, &p->U_last, &p->G_last, &p->G};
  Vec *likeL[] = {&p->L_old, &p->gap_work, &p->L_last, &p->L_new};

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(likeU) / sizeof(likeU[0]); k++) PetscCall(VecDuplicate(f->U, likeU[k]));
  for (size_t k = 0; k < sizeof(likeL) / sizeof(likeL[0]) && f->n_contacts; k++)
    PetscCall(VecDuplicate(f->Lambda, likeL[k]));
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) {
    PetscCall(VecDuplicate(f->U, &p->dU[j]));
    PetscCall(VecDuplicate(f->U, &p->dG[j]));
    if (f->n_contacts) PetscCall(VecDuplicate(f->Lambda, &p->dL[j]));
  }
  PetscCall(PetscMalloc1(f->fe->n_dof, &p->f_local));
  PetscCall(PetscMalloc1(f->fe->n_dof, &p->u0));
  PetscCall(PetscCalloc1(f->scene->n_times + 1, &p->steps));
  for (PetscInt b = 0; b < f->scene->n_bodies; b++) p->flows = (PetscBool)(p->flows || !f->scene->body[b].law->linear);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathDestroy(HycoFOM f)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  {
    Vec *vec[] = {&p->F,      &p->F_old,  &p->f_int, &p->f_old, &p->r,        &p->U_old,  &p->work, &p->diagonal,
                  &p->U_last, &p->G_last, &p->G,     &p->L_old, &p->gap_work, &p->L_last, &p->L_new};

    for (size_t k = 0; k < sizeof(vec) / sizeof(vec[0]); k++) PetscCall(VecDestroy(vec[k]));
  }
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) {
    PetscCall(VecDestroy(&p->dU[j]));
    PetscCall(VecDestroy(&p->dG[j]));
    PetscCall(VecDestroy(&p->dL[j]));
  }
  PetscCall(HycoSeriesDestroy(&p->series));
  PetscCall(HycoFEStateDestroy(&p->begin));
  PetscCall(HycoFEStateDestroy(&p->end));
  PetscCall(PetscFree(p->f_local));
  PetscCall(PetscFree(p->u0));
  PetscCall(PetscFree(p->steps));
  PetscCall(PetscFree(p->orders));
  PetscCall(PetscFree(f->path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The virgin bodies, at the first time. */
static PetscErrorCode Begin(HycoFOM f, const PetscReal mu[])
{
  HycoPath p = f->path;
  PetscReal all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(p->mu, mu, f->scene->n_parameters));
  p->t = f->scene->times[0];
  p->step = p->n_steps = p->n_orders = 0;
  p->dt = PETSC_MAX_REAL;
  p->ended = PETSC_FALSE;
  p->why[0] = '\0';
  PetscCall(PetscMemzero(&p->work_done, sizeof(p->work_done)));
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscCall(VecSet(f->U, 0));
  PetscCall(VecSet(p->F_old, 0));
  PetscCall(VecSet(p->f_old, 0));
  if (f->n_contacts) PetscCall(VecSet(f->Lambda, 0));
  if (p->tangent) f->fe->ready = PETSC_FALSE; /* K is to be assembled again */
  p->tangent = PETSC_FALSE;
  PetscCall(HycoFEStateDestroy(&p->begin));
  PetscCall(HycoFEStateDestroy(&p->end));
  HycoSceneSetTime(f->scene, mu, p->t, all);
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, all)); /* the state is made at the first temperature */
  HycoOnEach(HycoComm(f), HycoFEStateCreate(f->fe, &p->begin));
  HycoOnEach(HycoComm(f), HycoFEStateCreate(f->fe, &p->end));
  f->fe->ready = PETSC_FALSE; /* nothing of it is assembled yet */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean of two vectors times what U has changed by, over the free or the fixed unknowns. */
static PetscErrorCode MeanWork(HycoFOM f, Vec before, Vec after, PetscBool on_fixed, PetscReal *work)
{
  const PetscInt dim = f->part->dim;
  const PetscScalar *a, *b, *u, *u_old;
  PetscReal sum = 0;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(before, &a));
  PetscCall(VecGetArrayRead(after, &b));
  PetscCall(VecGetArrayRead(f->U, &u));
  PetscCall(VecGetArrayRead(f->path->U_old, &u_old));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = HycoMeshOwned(f->part, i);

    for (PetscInt c = 0; row >= 0 && c < dim; c++) {
      const PetscInt k = row * dim + c;

      if (f->fe->fixed[i * dim + c] == on_fixed) sum += (a[k] + b[k]) / 2 * (u[k] - u_old[k]);
    }
  }
  PetscCall(VecRestoreArrayRead(before, &a));
  PetscCall(VecRestoreArrayRead(after, &b));
  PetscCall(VecRestoreArrayRead(f->U, &u));
  PetscCall(VecRestoreArrayRead(f->path->U_old, &u_old));
  PetscCallMPI(MPI_Allreduce(&sum, work, 1, MPIU_REAL, MPI_SUM, HycoComm(f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (L0 + L1) / 2 . B (U1 - U0): what the bodies do against the contact forces. */
static PetscErrorCode ContactWork(HycoFOM f, PetscReal *sum)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  *sum = 0;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecWAXPY(p->work, -1, p->U_old, f->U));
  PetscCall(MatMult(f->B, p->work, p->gap_work));
  PetscCall(VecWAXPY(p->L_new, 1, p->L_old, f->Lambda));
  PetscCall(VecDot(p->L_new, p->gap_work, sum));
  *sum /= 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The energies of the accepted step. With all forces at their mean over the step the balance

      work of loads and supports = stored + dissipated + of heat and of moduli that change + work against contact

  is an identity: its defect measures equilibrium, by energies that the laws compute and works that the loads do.
*/
static PetscErrorCode AddWork(HycoFOM f, const HycoFEStepReport *law, PetscReal *step_defect)
{
  HycoPath p = f->path;
  HycoWork *w = &p->work_done;
  PetscReal loads, supports, contact, stored = law->stored - w->stored, defect;

  PetscFunctionBegin;
  PetscCall(MeanWork(f, p->F_old, p->F, PETSC_FALSE, &loads));
  PetscCall(MeanWork(f, p->f_old, p->f_int, PETSC_TRUE, &supports));
  PetscCall(ContactWork(f, &contact));
  defect = PetscAbsReal(loads + supports - contact - stored - law->dissipated - law->thermal - law->moduli);
  w->size += PetscAbsReal(loads) + PetscAbsReal(supports) + PetscAbsReal(contact) + PetscAbsReal(stored) +
             PetscAbsReal(law->dissipated) + PetscAbsReal(law->thermal) + PetscAbsReal(law->moduli);
  *step_defect = HycoRelative(defect, w->size);
  w->defect = PetscMax(w->defect, *step_defect);
  w->loads += loads;
  w->supports += supports;
  w->contact += contact;
  w->stored = law->stored;
  w->dissipated += law->dissipated;
  w->thermal += law->thermal;
  w->moduli += law->moduli;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode NoteOrder(HycoPath p, PetscReal order)
{
  PetscFunctionBegin;
  if (order <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (p->n_orders == p->room_orders) {
    p->room_orders = 2 * p->room_orders + 64;
    PetscCall(PetscRealloc((size_t)p->room_orders * sizeof(*p->orders), &p->orders));
  }
  p->orders[p->n_orders++] = order;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The attempt becomes the state of the path at t1. */
static PetscErrorCode Accept(HycoFOM f, PetscReal t1, const HycoAttempt *a)
{
  HycoPath p = f->path;
  HycoFEState state = p->begin;
  PetscReal defect = 0;

  PetscFunctionBegin;
  PetscCall(AddWork(f, &a->law, &defect));
  p->begin = p->end;
  p->end = state;
  PetscCall(VecCopy(p->F, p->F_old));
  PetscCall(VecCopy(p->f_int, p->f_old));
  p->t = t1;
  p->now.substeps++;
  p->now.residual = PetscMax(p->now.residual, a->residual);
  p->now.kkt = PetscMax(p->now.kkt, HycoKKTMax(&p->kkt));
  p->now.energy_defect = PetscMax(p->now.energy_defect, defect);
  p->now.most_iterations = PetscMax(p->now.most_iterations, a->iterations);
  PetscCall(NoteOrder(p, a->order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Count(HycoPath p, const HycoAttempt *a)
{
  p->now.iterations += a->iterations;
  p->now.factors += a->factors;
  p->now.active_set_iterations += a->active_its;
  p->now.seconds_factor += a->seconds_factor;
  p->now.seconds_solve += a->seconds_solve;
  p->now.seconds_law += a->seconds_law;
  if (!a->converged) p->now.cuts++;
}

/* The largest over the cells of all ranks. */
static PetscErrorCode Largest(HycoFOM f, HycoStep *s)
{
  PetscReal *mises, *inelastic, most[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(f->part->n_cells, &mises, f->part->n_cells, &inelastic));
  PetscCall(HycoFEStateFields(f->fe, f->path->begin, NULL, mises, inelastic, NULL));
  for (PetscInt e = 0; e < f->part->n_cells; e++) {
    most[0] = PetscMax(most[0], mises[e]);
    most[1] = PetscMax(most[1], inelastic[e]);
  }
  PetscCall(PetscFree2(mises, inelastic));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPI_MAX, HycoComm(f)));
  s->mises = most[0];
  s->inelastic = most[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MeasureContacts(HycoFOM f, HycoStep *s)
{
  const PetscScalar *l;
  PetscReal sum[2] = {0, 0};
  PetscInt n;

  PetscFunctionBegin;
  s->total_contact_force = s->lambda_max = 0;
  s->n_active = 0;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(f->Lambda, &n));
  PetscCall(VecGetArrayRead(f->Lambda, &l));
  for (PetscInt k = 0; k < n; k++) {
    sum[0] += l[k];
    sum[1] += l[k] > 0;
    s->lambda_max = PetscMax(s->lambda_max, l[k]);
  }
  PetscCall(VecRestoreArrayRead(f->Lambda, &l));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, HycoComm(f)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &s->lambda_max, 1, MPIU_REAL, MPI_MAX, HycoComm(f)));
  s->total_contact_force = sum[0];
  s->n_active = (PetscInt)sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path has reached a time that is told of: a listed one, or the one beyond which it does not get. */
static PetscErrorCode Record(HycoFOM f)
{
  HycoPath p = f->path;
  HycoStep *s = &p->now;

  PetscFunctionBegin;
  s->index = p->step;
  s->t = p->t;
  PetscCall(MeasureContacts(f, s));
  PetscCall(Largest(f, s));
  PetscCall(VecNorm(f->U, NORM_2, &s->u_norm2));
  s->work = p->work_done.loads + p->work_done.supports;
  s->contact_work = p->work_done.contact;
  s->stored = p->work_done.stored;
  s->dissipated = p->work_done.dissipated;
  s->thermal = p->work_done.thermal + p->work_done.moduli;
  PetscCall(HycoFOMGather(f));
  f->solved = PETSC_TRUE;
  f->sigma_ready = f->all_ready = PETSC_FALSE;
  p->steps[p->n_steps++] = *s;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscCall(HycoSeriesAdd(f));
  if (p->monitor) PetscCall((*p->monitor)(f, &p->steps[p->n_steps - 1], p->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One attempt at a step to `stop`, or as far as p->dt goes; p->t moves on if it is accepted. */
static PetscErrorCode TryStep(HycoFOM f, PetscReal stop)
{
  HycoPath p = f->path;
  const PetscReal rest = stop - p->t, n = PetscCeilReal(rest / p->dt - 1e-9), h = n > 1 ? rest / n : rest;
  HycoAttempt a;

  PetscFunctionBegin;
  PetscCall(HycoPathAttempt(f, p->t, n > 1 ? p->t + h : stop, &a));
  if (a.converged && a.law.increment > p->bound) {
    a.converged = PETSC_FALSE;
    HycoFormat(a.why, "an inelastic strain of %.1e in one step", (double)a.law.increment);
    PetscCall(HycoPathRestore(f));
  }
  Count(p, &a);
  if (!a.converged) {
    p->dt = h * PetscMin(0.5, a.law.dt_factor > 0 ? a.law.dt_factor : 0.5);
    PetscCall(PetscStrncpy(p->why, a.why, sizeof(p->why)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Accept(f, n > 1 ? p->t + h : stop, &a));
  if (a.law.dt_factor < 1)
    p->dt = h * PetscMax(a.law.dt_factor, 0.1);
  else if (GROWTH * a.law.increment <= p->bound && a.easy)
    p->dt = PetscMax(p->dt, GROWTH * h);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the listed time before to the next; false: the step has become too small. */
static PetscErrorCode Reach(HycoFOM f, PetscReal end, PetscBool *reached)
{
  HycoScene s = f->scene;
  HycoPath p = f->path;
  const PetscReal least = p->smallest * (s->times[s->n_times - 1] - s->times[0]);

  PetscFunctionBegin;
  *reached = PETSC_TRUE;
  while (p->t < end && *reached) {
    const PetscReal t = p->t, stop = HycoSceneNextStop(s, p->t);

    if (p->substeps > 1) p->dt = PetscMin(p->dt, (end - s->times[p->step - 1]) / (PetscReal)p->substeps);
    PetscCall(TryStep(f, stop));
    if (p->t == t && p->dt < least) *reached = PETSC_FALSE;
    if (p->t > t && p->t < end) PetscCall(HycoPathSave(f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the first time bodies answer at once: there is no step to cut. */
static PetscErrorCode Start(HycoFOM f, PetscBool *reached)
{
  HycoPath p = f->path;
  HycoAttempt a;

  PetscFunctionBegin;
  PetscCall(HycoPathAttempt(f, p->t, p->t, &a));
  Count(p, &a);
  *reached = a.converged;
  if (a.converged)
    PetscCall(Accept(f, p->t, &a));
  else
    HycoFormat(p->why, "at the first time, where all that acts comes at once: %s", a.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On from where the path is; false: no further. */
static PetscErrorCode Advance(HycoFOM f, PetscBool *reached)
{
  HycoScene s = f->scene;
  HycoPath p = f->path;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  if (p->step)
    PetscCall(Reach(f, s->times[p->step], reached));
  else
    PetscCall(Start(f, reached));
  p->now.seconds += HycoNow() - begin;
  if (!*reached) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Record(f));
  p->step++;
  PetscCall(HycoPathSave(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathSolve(HycoFOM f, const PetscReal mu[])
{
  HycoPath p = f->path;
  PetscReal begin = HycoNow();
  PetscBool reached = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(Begin(f, mu));
  PetscCall(HycoSeriesBegin(f));
  PetscCall(HycoPathCheckPlace(f));
  if (p->resume) PetscCall(HycoPathLoad(f));
  while (p->step < f->scene->n_times && reached) PetscCall(Advance(f, &reached));
  p->ended = reached;
  if (!reached) PetscCall(HycoPathAssemble(f, p->t)); /* from the time that was not reached */
  if (!reached && p->now.substeps) PetscCall(Record(f));
  f->solved = (PetscBool)(p->n_steps > 0);
  PetscCall(HycoSeriesEnd(f));
  f->summary.seconds.total = HycoNow() - begin;
  PetscCall(HycoFOMViewFromOptions(f, NULL, "-hyco_fom_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoPathSummary(HycoFOM f, HycoSummary *s)
{
  const HycoPath p = f->path;

  s->iterations = 0;
  s->seconds.factor = s->seconds.solve = 0;
  for (PetscInt k = 0; k < p->n_steps; k++) {
    s->iterations += p->steps[k].iterations;
    s->seconds.factor += p->steps[k].seconds_factor;
    s->seconds.solve += p->steps[k].seconds_solve;
  }
  s->kkt = p->kkt;
  s->reason = p->ended ? HYCO_CONVERGED : HYCO_DIVERGED_STEP;
  s->strain_energy = p->work_done.stored;
  s->external_work = p->work_done.loads + p->work_done.supports;
  s->gap_work = p->work_done.contact;
  s->energy_defect = p->work_done.defect;
}

static int Ascending(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return (x > y) - (x < y);
}

PetscErrorCode HycoFOMGetHistory(HycoFOM f, HycoHistory *h)
{
  HycoPath p;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  p = f->path;
  PetscCall(PetscMemzero(h, sizeof(*h)));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  h->n = p->n_steps;
  h->step = p->steps;
  h->ended = p->ended;
  h->t = p->t;
  h->why = p->why;
  h->newton = HycoPathPrefersElastic(f) ? "elastic" : "tangent";
  h->factor_cost = HycoPathFactorCost(f);
  h->n_orders = p->n_orders;
  if (p->n_orders) qsort(p->orders, (size_t)p->n_orders, sizeof(*p->orders), Ascending);
  if (p->n_orders) h->order = p->orders[p->n_orders / 2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetStepMonitor(HycoFOM f, HycoStepMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoFOMSetStepMonitor: the scene has no history, and its solution no steps");
  f->path->monitor = monitor;
  f->path->monitor_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}
