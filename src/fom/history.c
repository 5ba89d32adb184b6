/*
  The path of a scene with a history: from its first time, with an instantaneous response, through the listed times, in
  steps that are halved after a failure or a large inelastic increment and grow after easy steps. A rejected step
  changes nothing: state, displacements and forces are those of the last accepted time.
*/
#include <hycopath.h>
#include <hycomaterialimpl.h>
#include <stdlib.h>
#include <string.h>

/* Smallest step before a body slides away, as a share of the whole time: a step of twice this length was refused, so
   that the time of sliding is known to 6 digits (tests/paths/history.py). */
#define SLIDING_STEP 5e-7
#define GROWTH       1.5 /* factor of a step after an easy one: two easy steps double it */
/* Inelastic strain of a whole path: 4500 eps of a strain of 1, round-off of elastic strains; less has no error in time.
   */
#define CREEP_ROUND_OFF 1e-12
/* Of an interval's strain, that by which the error of a step with less is judged: relaxation (n = 3 to 8, to a tenth of
   the stress) takes 150 to 250 steps, and its strain is right to 0.4 %. */
#define LEAST_STRAIN 0.01
/* Time of the differences for a rate, as a share of a step: stresses do not change in it. */
#define RATE_STEP 1e-4
/* Step over the length that the error permits, above which it is repeated: a step of 1.3 has 1.7 times the error of
   second order that it may have. */
#define REPEAT_FROM 1.3
/* Next step over the length that the error permits: the usual 0.8, as rejected steps cost more than short ones. */
#define AIM 0.8
/* Next step over the last that was too long, at least: an estimate far outside of its range does not decide more. */
#define LEAST_CUT 0.05

const char *const HycoNewtons[] = {"auto", "tangent", "elastic", "modified", NULL};

/* Defaults of a path; scene NULL: for the declaration of options alone. */
PetscErrorCode HycoPathNew(MPI_Comm comm, HycoScene scene, HycoPath *path)
{
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(PetscNew(&p));
  p->comm = comm;
  p->scene = scene;
  p->rtol = 1e-10;
  p->bound = 1e-3;
  p->smallest = 1e-10;
  p->time_tol = 1e-2;
  /* Without inelastic laws the stiffness is constant and one iteration solves a step. */
  p->flows = (PetscBool)(scene && HycoSceneFlows(scene));
  *path = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work vectors like U and Lambda, which the owner has set. Collective. */
PetscErrorCode HycoPathSetUp(HycoPath p)
{
  /* In the layout of the model's unknowns: of the whole mesh, or of a reduced system. */
  Vec *likeU[] = {&p->F, &p->f_int, &p->r, &p->U_old, &p->work, &p->diagonal, &p->U_last, &p->G_last, &p->G};

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(likeU) / sizeof(likeU[0]); k++) PetscCall(VecDuplicate(p->U, likeU[k]));
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) HycoVecDuplicate(p->U, &p->dU[j], &p->dG[j]);
  if (p->n_contacts) PetscCall(HycoPathContactSetUp(&p->contact));
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->f_local));
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->u0));
  PetscCall(PetscCalloc1(p->scene->n_times + 1, &p->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathContactSetUp(HycoPathContact *c)
{
  PetscFunctionBegin;
  HycoVecDuplicate(c->Lambda, &c->L_old, &c->gap_work, &c->L_last, &c->L_new);
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) PetscCall(VecDuplicate(c->Lambda, &c->dL[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathContactReset(HycoPathContact *c)
{
  PetscFunctionBegin;
  HycoDestroyAll(&c->L_old, &c->gap_work, &c->L_last, &c->L_new);
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) PetscCall(VecDestroy(&c->dL[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. U, Lambda, K and the system belong to the model of the path. */
PetscErrorCode HycoPathFree(HycoPath *path)
{
  HycoPath p = *path;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPathFrictionDestroy(p));
  PetscCall(HycoPathContactReset(&p->contact));
  HycoDestroyAll(&p->F, &p->F_old, &p->f_int, &p->f_old, &p->r, &p->U_old, &p->work, &p->diagonal, &p->U_last,
                 &p->G_last, &p->G);
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) HycoDestroyAll(&p->dU[j], &p->dG[j]);
  PetscCall(HycoSeriesDestroy(&p->series));
  PetscCall(HycoFEStateDestroy(&p->begin));
  PetscCall(HycoFEStateDestroy(&p->end));
  HycoFreeAll(&p->f_local, &p->u0, &p->steps, &p->orders, &p->taken, &p->rate[0], &p->rate[1], path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For paths at full order and of models; PetscOptionsObject: that of the caller's PetscObjectOptionsBegin(). */
PetscErrorCode HycoPathSetFromOptions(HycoPath p, HycoOptionItems PetscOptionsObject)
{
  PetscFunctionBegin;
  PetscCall(HycoOptionsWord("-hyco_newton",
                            "history: iterate with the tangent, with the elastic stiffness, whose factor is kept, or "
                            "with a tangent that is kept while this is faster (auto: the cheapest by operation counts)",
                            HycoNewtons, &p->method, NULL));
  PetscCall(HycoOptionsReal("-hyco_newton_rtol",
                            "history: tolerance of the residual of equilibrium, relative to the largest of the forces",
                            1e-14, 1e-2, &p->rtol, NULL));
  PetscCall(HycoOptionsInt(
      "-hyco_newton_max_its",
      "history: number of contact systems after which a step is halved (0: tangent 15, modified 30, elastic 60)", 0,
      100000, &p->max_its, NULL));
  PetscCall(HycoOptionsReal("-hyco_step_inelastic",
                            "history: largest increment of inelastic strain in a step; a larger step is halved", 1e-12,
                            1e3, &p->bound, NULL));
  PetscCall(HycoOptionsReal("-hyco_step_smallest", "history: smallest step, as a share of the whole time", 1e-15, 1,
                            &p->smallest, NULL));
  PetscCall(HycoOptionsReal("-hyco_step_error",
                            "history: estimated error of creep strains in a step, relative to the larger of the step's "
                            "strain and a hundredth of the largest inelastic strain, above which it is shortened (0: "
                            "none is; not with -hyco_substeps)",
                            0, 1e3, &p->time_tol, NULL));
  PetscCall(HycoOptionsInt(
      "-hyco_substeps", "history: smallest number of steps from one listed time to the next (0: by -hyco_step_error)",
      0, 1000000000, &p->substeps, NULL));
  PetscCall(HycoOptionsString("-hyco_checkpoint",
                              "<file.h5> history: store the last accepted step there, for -hyco_resume", p->checkpoint,
                              sizeof(p->checkpoint), NULL));
  PetscCall(HycoOptionsString("-hyco_write_fclib",
                              "<file.h5> history: store the problem of the contacts with friction, of the step that "
                              "ends at a listed time, in FCLIB's layout",
                              p->fclib, sizeof(p->fclib), NULL));
  PetscCall(HycoOptionsReal("-hyco_write_fclib_time", "history: that listed time (default: the last)", -PETSC_MAX_REAL,
                            PETSC_MAX_REAL, &p->fclib_time, &p->fclib_timed));
  PetscCall(
      HycoOptionsBool("-hyco_resume", "history: continue from the checkpoint, if there is one", &p->resume, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To the first time with a virgin state. K must be assembled anew if a former path left a tangent in it. Collective.
   The laws' state at the first temperature has no strain, and displacements are zero: loads begin from nothing. */
PetscErrorCode HycoPathBegin(HycoPath p, const PetscReal mu[])
{
  PetscReal all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(p->mu, mu, p->scene->n_parameters));
  p->t = p->scene->times[0];
  p->no_equilibrium[0] = p->loose[0] = '\0';
  p->step = p->n_steps = p->n_orders = p->n_taken = p->n_cuts = p->n_bound = 0;
  p->time_error = p->largest = p->ahead = p->rated_by = 0;
  p->rated = PETSC_FALSE;
  /* The first step goes as far as the listed times and the kinks allow. */
  p->dt = PETSC_MAX_REAL;
  p->ended = PETSC_FALSE;
  p->why[0] = '\0';
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscCall(VecSet(p->U, 0));
  if (p->n_contacts) PetscCall(VecSet(p->contact.Lambda, 0));
  if (p->tangent) p->fe->ready = PETSC_FALSE; /* K must be assembled again */
  p->tangent = PETSC_FALSE;
  PetscCall(HycoFEStateDestroy(&p->begin));
  PetscCall(HycoFEStateDestroy(&p->end));
  HycoSceneSetTime(p->scene, mu, p->t, all);
  HycoOnEach(p->comm, HycoFESetParameters(p->fe, all)); /* the initial state depends on the first temperature */
  HycoOnEach(p->comm, HycoFEStateCreate(p->fe, &p->begin));
  HycoOnEach(p->comm, HycoFEStateCreate(p->fe, &p->end));
  p->fe->ready = PETSC_FALSE; /* nothing is assembled for it yet */
  PetscCall(HycoPathFrictionBegin(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The observed order of convergence, for the report; 0: not observed. */
static PetscErrorCode NoteOrder(HycoPath p, PetscReal order)
{
  PetscFunctionBegin;
  if (order <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  HycoGrow(p->n_orders, p->room_orders, p->orders);
  p->orders[p->n_orders++] = order;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the attempt the state of the path at t1. States are exchanged, not copied: the former begin is the room of
   the next end. */
static PetscErrorCode HistoryAccept(HycoPath p, PetscReal t1, const HycoStepAttempt *a)
{
  const PetscReal t0 = p->t;
  HycoFEState state = p->begin;

  PetscFunctionBegin;
  p->begin = p->end;
  p->end = state;
  p->t = t1;
  p->now.substeps++;
  /* Over the steps since the last listed time, whose row of the table has them. */
  p->now.residual = PetscMax(p->now.residual, a->residual);
  p->now.kkt = PetscMax(p->now.kkt, HycoKKTMax(&p->kkt));
  p->now.most_iterations = PetscMax(p->now.most_iterations, a->iterations);
  PetscCall(NoteOrder(p, a->order));
  /* Accepted times, which a reduced path may repeat. */
  HycoGrow(p->n_taken, p->room_taken, p->taken);
  p->taken[p->n_taken++] = p->t;
  /* Last: the op may read the accepted time and state. */
  PetscCall(HycoPathFrictionTake(p));
  PetscCall((*p->ops->accept)(p, a));
  PetscCall(HycoPathFrictionAccept(p));
  /* At the listed time ops->record gathers, and calls the monitor. */
  if (p->between && p->t < p->scene->times[p->step]) {
    PetscCall(HycoFOMGather((HycoFOM)p->ctx));
    PetscCall((*p->between)((HycoFOM)p->ctx, p->monitor_ctx));
  }
  if (p->passes) PetscCall((*p->passes)(p, t0, p->passes_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of rejected attempts counts too. */
static void HistoryCount(HycoPath p, const HycoStepAttempt *a)
{
  p->now.iterations += a->iterations;
  p->now.factors += a->factors;
  p->now.active_set_iterations += a->active_its;
  p->now.linear_iterations += a->linear_its;
  p->now.most_linear_iterations = PetscMax(p->now.most_linear_iterations, a->most_linear);
  p->now.seconds_factor += a->seconds_factor;
  p->now.seconds_solve += a->seconds_solve;
  p->now.seconds_law += a->seconds_law;
  /* A cut is counted once, where it happens. */
  if (a->converged) return;
  p->now.cuts++;
  p->n_cuts++;
}

/* An estimate of the error of creep strains in a step; allowed: the length at which it is as large as it may be. */
typedef struct {
  PetscReal error, allowed, largest;
} TimeError;

/* Points of the laws of this rank. */
static PetscInt CountRates(HycoPath p)
{
  return p->fe->mesh->n_cells * HycoElementGet(p->fe->mesh->type)->nq;
}

/* The rates at the begin of the first step; those of others are known. Collective. */
static PetscErrorCode FirstRates(HycoPath p, PetscReal h)
{
  const PetscInt n = p->flows && p->ops->rates ? CountRates(p) * p->fe->n_sigma : 0;

  PetscFunctionBegin;
  p->rates = (PetscBool)(p->flows && p->ops->rates && !p->given);
  if (!p->rates || p->rated) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < 2 && !p->rate[k]; k++) PetscCall(PetscCalloc1(n + 1, &p->rate[k]));
  /* As after the step before where the path goes on from a checkpoint, so that its steps are the same. */
  if (!(p->rated_by > 0)) p->rated_by = h;
  PetscCall((*p->ops->rates)(p, p->t, RATE_STEP * p->rated_by, p->begin, p->rate[0], &p->largest));
  p->rated = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Implicit Euler takes the rate at the end of a step for its mean: the estimate is half of the rate's change times the
   length, over all points, and at most the point's strain, as where creep begins with an infinite rate. Collective. */
static PetscErrorCode EstimateTime(HycoPath p, PetscReal h, PetscReal t1, TimeError *e)
{
  const PetscInt n = CountRates(p), ns = p->fe->n_sigma;
  PetscReal most[2] = {0, 0}, permitted;

  PetscFunctionBegin;
  PetscCall((*p->ops->rates)(p, t1, RATE_STEP * h, p->end, p->rate[1], &e->largest));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal strain = 0, change = 0;

    for (PetscInt c = i * ns; c < (i + 1) * ns; c++) {
      strain += PetscSqr(h * p->rate[1][c]);
      change += PetscSqr(h * (p->rate[1][c] - p->rate[0][c]) / 2);
    }
    strain = PetscSqrtReal(strain);
    change = PetscSqrtReal(change);

    /* Later a rate that falls within the step, as of a load that goes, has strained the point by more. */
    most[0] = PetscMax(most[0], p->largest > CREEP_ROUND_OFF ? change : PetscMin(change, strain));
    most[1] = PetscMax(most[1], strain);
  }
  HycoAllreduce(most, 2, MPIU_REAL, MPI_MAX, p->comm);
  e->error = most[0];
  p->ahead = PetscMax(p->ahead, e->largest);
  permitted = p->time_tol * PetscMax(most[1], LEAST_STRAIN * p->ahead);
  /* Nor where the sum is small. */
  permitted = PetscMax(permitted, p->time_tol * p->ahead - p->time_error);
  if (e->error > 0 && p->ahead > CREEP_ROUND_OFF && p->time_tol > 0 && !p->substeps)
    e->allowed = h * permitted / e->error;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rates at the end of the accepted step are those at the begin of the next. */
static void TakeRates(HycoPath p, PetscReal h, const TimeError *e)
{
  PetscReal *rate = p->rate[0];

  if (!p->rates) return;
  p->rate[0] = p->rate[1];
  p->rate[1] = rate;
  p->rated_by = h;
  p->time_error += e->error;
  p->largest = e->largest;
}

/* One attempt at a step to `stop`, or by p->dt; advances p->t if it is accepted. The rest of the interval is divided
   evenly: no tiny last step. 1e-9 allows for round-off of rest / dt. */
static PetscErrorCode TryStep(HycoPath p, PetscReal stop)
{
  const PetscReal rest = stop - p->t, n = PetscCeilReal(rest / p->dt - 1e-9), h = n > 1 ? rest / n : rest;
  const PetscReal t1 = n > 1 ? p->t + h : stop;
  TimeError e = {.allowed = PETSC_MAX_REAL};
  HycoStepAttempt a;

  PetscFunctionBegin;
  PetscCall(FirstRates(p, h));
  PetscCall(HycoPathAttempt(p, p->t, t1, &a));
  if (a.converged && p->rates) PetscCall(EstimateTime(p, h, t1, &e));
  if (a.converged && ((a.law.increment > p->bound && !p->given) || REPEAT_FROM * e.allowed < h)) {
    a.converged = PETSC_FALSE;
    /* A converged step is rejected for its accuracy: what it found is undone. */
    HycoFormat(a.why, "the increment of inelastic strain is %.1e in one step", (double)a.law.increment);
    if (REPEAT_FROM * e.allowed < h) HycoFormat(a.why, "the error in time of one step is %.1e", (double)e.error);
    PetscCall(HycoPathRestore(p));
  }
  HistoryCount(p, &a);
  if (!a.converged) {
    /* At least halved; a law may ask for less. */
    p->dt = h * PetscMin(0.5, a.law.dt_factor > 0 ? a.law.dt_factor : 0.5);
    p->dt = PetscMin(p->dt, PetscMax(e.allowed, LEAST_CUT * h));
    PetscCall(PetscStrncpy(p->why, a.why, sizeof(p->why)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HistoryAccept(p, t1, &a));
  TakeRates(p, h, &e);
  /* The next size: prescribed times are followed as given; a law's wish to shorten goes before growth. */
  if (p->given)
    p->dt = PetscMax(p->dt, GROWTH * h);
  else if (a.law.dt_factor < 1)
    p->dt = h * PetscMax(a.law.dt_factor, 0.1);
  else if (GROWTH * a.law.increment <= p->bound && a.easy)
    p->dt = PetscMax(p->dt, GROWTH * h);
  else
    /* Converged easily, but the bound on the inelastic increment forbids growth: counted for the report. */
    p->n_bound += a.easy;
  /* Whatever convergence permits. */
  p->dt = PetscMin(p->dt, PetscMax(AIM * e.allowed, LEAST_CUT * h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next of the prescribed times, or of the stops, if any. */
static PetscReal NextGiven(HycoPath p)
{
  const PetscBool stops = (PetscBool)(!p->given && !p->substeps && p->time_tol > 0);
  const PetscInt n = p->given ? p->n_given : stops ? p->n_stops : 0;
  const PetscReal *at = p->given ? p->given : p->stops;

  for (PetscInt k = 0; k < n; k++) {
    if (at[k] > p->t) return at[k];
  }
  return PETSC_MAX_REAL;
}

/* From the previous listed time to the next; false: the step has become too small, or too many were halved. Stops
   are also the kinks of the scene's functions of time, so that no step jumps over one. */
static PetscErrorCode HistoryReach(HycoPath p, PetscReal end, PetscBool *reached)
{
  const HycoScene s = p->scene;
  PetscReal least = p->smallest * (s->times[s->n_times - 1] - s->times[0]);

  PetscFunctionBegin;
  *reached = PETSC_TRUE;
  while (p->t < end && *reached) {
    const PetscReal t = p->t, stop = PetscMin(HycoSceneNextStop(s, p->t), NextGiven(p));

    /* Prescribed times replace the request. */
    if (p->substeps > 1 && !p->given) p->dt = PetscMin(p->dt, (end - s->times[p->step - 1]) / (PetscReal)p->substeps);
    PetscCall(HycoInterruptCheck());
    PetscCall(TryStep(p, stop));
    /* Where a body slides away in a larger step, its time is known well enough: steps just before it are the
       dearest. */
    if (p->no_equilibrium[0] && p->has_friction)
      least = PetscMax(least, SLIDING_STEP * (s->times[s->n_times - 1] - s->times[0]));
    if (p->t == t && (p->dt < least || (p->most_cuts && p->n_cuts > p->most_cuts))) *reached = PETSC_FALSE;
    /* At the listed time itself HistoryAdvance() saves, after the time is recorded. */
    if (p->t > t && p->t < end && p->ops->save) PetscCall((*p->ops->save)(p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the first time the response is instantaneous: there is no step to halve. */
static PetscErrorCode HistoryStart(HycoPath p, PetscBool *reached)
{
  HycoStepAttempt a;

  PetscFunctionBegin;
  /* A step of no length: laws respond elastically, rates have no time. */
  PetscCall(HycoPathAttempt(p, p->t, p->t, &a));
  HistoryCount(p, &a);
  *reached = a.converged;
  if (a.converged)
    PetscCall(HistoryAccept(p, p->t, &a));
  else
    HycoFormat(p->why, "at the first time, where all loads are applied at once: %s", a.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Records a listed time, or the time beyond which the path cannot continue. */
static PetscErrorCode HistoryRecord(HycoPath p)
{
  PetscFunctionBegin;
  p->now.index = p->step;
  p->now.t = p->t;
  if (p->friction) PetscCall(HycoContactStateMeasure(p->friction, &p->now));
  PetscCall((*p->ops->record)(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To the next listed time; false: it cannot be reached. The first listed time is an instantaneous response, later
   ones are integrated. */
static PetscErrorCode HistoryAdvance(HycoPath p, PetscBool *reached)
{
  HycoScene s = p->scene;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  if (p->step)
    PetscCall(HistoryReach(p, s->times[p->step], reached));
  else
    PetscCall(HistoryStart(p, reached));
  /* Before the record is made, which stores it. */
  p->now.seconds += HycoNow() - begin;
  if (!*reached) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HistoryRecord(p));
  p->step++;
  p->ahead = p->largest;
  /* After each listed time at the latest; the full order also saves between. */
  if (p->ops->save) PetscCall((*p->ops->save)(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the path has not reached its end because no contact forces balance the loads. */
static PetscBool LacksEquilibrium(HycoPath p)
{
  return (PetscBool)(!p->ended && p->no_equilibrium[0] && strstr(p->why, p->no_equilibrium));
}

/* All listed times from the current one; stops at the first that cannot be reached, which is no error: p->ended is
   false and p->why says why. Collective. The last accepted time is recorded too, so that its fields can be looked
   at. */
PetscErrorCode HycoPathRun(HycoPath p)
{
  PetscBool reached = PETSC_TRUE;

  PetscFunctionBegin;
  while (p->step < p->scene->n_times && reached) PetscCall(HistoryAdvance(p, &reached));
  p->ended = reached;
  if (!reached && p->step && !LacksEquilibrium(p)) {
    char why[HYCO_LINE];

    HycoFormat(why, "its steps became too small: %s", p->why);
    HycoFormat(p->why, "%s", why);
  }
  if (!reached) PetscCall(HycoPathAssemble(p, p->t)); /* returns from the time that was not reached */
  if (!reached && p->now.substeps) PetscCall(HistoryRecord(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoPathNameTimes(const char name[], const PetscReal at[2], char text[HYCO_LINE])
{
  char to[32] = "";

  if (at[1] > at[0]) snprintf(to, sizeof(to), " to %g", (double)at[1]);
  HycoFormat(text, "%s (t = %g%s)", name, (double)at[0], to);
}

/* The quantity's own extreme, unless the scene names another for the path. */
PetscBool HycoPathIsBeyond(const HycoQuantity *q, PetscReal a, PetscReal b)
{
  const PetscBool least = (PetscBool)(q->kind == HYCO_QUANTITY_MIN || q->kind == HYCO_QUANTITY_PRESSURE_MIN);

  if (q->path == HYCO_EXTREME_ABSOLUTE) return (PetscBool)(PetscAbsReal(a) > PetscAbsReal(b));
  return (PetscBool)(q->path == HYCO_EXTREME_MIN || (least && q->path == HYCO_EXTREME_OWN) ? a < b : a > b);
}

/* Over the listed times, at which outputs are measured; with its sign. */
void HycoPathExtremes(HycoScene scene, PetscInt n, const HycoStep step[], PetscReal value[])
{
  for (PetscInt q = 0; q < scene->n_quantities; q++) {
    value[q] = step[0].quantity[q];
    for (PetscInt k = 1; k < n; k++) {
      if (HycoPathIsBeyond(&scene->quantity[q], step[k].quantity[q], value[q])) value[q] = step[k].quantity[q];
    }
  }
}

/* Reals, for the median. */
static int HistoryAscending(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return (x > y) - (x < y);
}

/* Borrowed until the next solve. The order is the median of those observed. */
void HycoPathGetHistory(HycoPath p, HycoHistory *h)
{
  h->n = p->n_steps;
  h->step = p->steps;
  h->ended = p->ended;
  h->t = p->t;
  h->why = p->why;
  h->no_equilibrium = LacksEquilibrium(p);
  h->newton = HycoNewtons[HycoPathMethod(p)];
  h->factor_cost = HycoPathFactorCost(p);
  h->n_bound = p->n_bound;
  h->time_error = p->largest > CREEP_ROUND_OFF ? p->time_error / p->largest : 0;
  h->n_orders = p->n_orders;
  h->n_taken = p->n_taken;
  h->taken = p->taken;
  if (p->n_steps) HycoPathExtremes(p->scene, p->n_steps, p->steps, h->path_quantity);
  /* In place: the order in time is not needed again. */
  if (p->n_orders) qsort(p->orders, (size_t)p->n_orders, sizeof(*p->orders), HistoryAscending);
  if (p->n_orders) h->order = p->orders[p->n_orders / 2];
}
