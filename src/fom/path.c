/*
  The full-order path: a HycoPath on distributed vectors, with the energies of its steps, the series of fields and the
  checkpoint.
*/
#include <hycopath.h>

/* A scene without times would ignore these options silently. */
PetscErrorCode HycoPathRefuseOptions(HycoFOM f)
{
  static const char *const name[] = {"-hyco_newton",         "-hyco_newton_rtol",     "-hyco_newton_max_its",
                                     "-hyco_step_inelastic", "-hyco_step_smallest",   "-hyco_step_error",
                                     "-hyco_substeps",       "-hyco_checkpoint",      "-hyco_resume",
                                     "-hyco_write_fclib",    "-hyco_write_fclib_time"};

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(name) / sizeof(name[0]); k++) {
    PetscBool set;

    PetscCall(PetscOptionsHasName(f->scene->options, NULL, name[k], &set));
    PetscCheck(!set, HycoComm(f), PETSC_ERR_USER, "%s is for scenes with a history, and this scene has none; remove it",
               name[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reduces the laws' report over all ranks. Sums, extremes and the text of the lowest rank that failed: the same
   report on all ranks. */
static PetscErrorCode ReduceReport(HycoFOM f, HycoFEStepReport *r)
{
  PetscReal sum[6] = {r->work, r->stored, r->dissipated, r->thermal, r->moduli, r->potential};
  /* dt_factor is a minimum: negated for MPI_MAX. */
  PetscReal most[4] = {-r->dt_factor, r->increment, (PetscReal)r->failed, (PetscReal)!r->has_potential};
  /* size: this rank has not failed. */
  PetscMPIInt lowest = r->failed ? f->rank : f->size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 6, MPIU_REAL, MPI_SUM, HycoComm(f)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 4, MPIU_REAL, MPI_MAX, HycoComm(f)));
  r->work = sum[0];
  r->stored = sum[1];
  r->dissipated = sum[2];
  r->thermal = sum[3];
  r->moduli = sum[4];
  r->potential = sum[5];
  r->dt_factor = -most[0];
  r->increment = most[1];
  r->has_potential = (PetscBool)(most[3] == 0);
  r->failed = (PetscBool)(most[2] > 0);
  if (!r->failed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_INT, MPI_MIN, HycoComm(f)));
  PetscCallMPI(MPI_Bcast(r->why, HYCO_LINE, MPI_CHAR, lowest, HycoComm(f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets this rank's rows of f_int from f_local; and r = F - f_int there, 0 where fixed. f_local is complete at owned
   nodes, so that no communication is needed. f_int are the stresses' nodal forces; r without contact forces, which
   RightSide() and the residual add. */
static PetscErrorCode TakeForces(HycoFOM f)
{
  HycoPath p = f->path;
  const PetscInt dim = f->part->dim;
  const PetscScalar *F;
  PetscScalar *f_int, *r;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->F, &F));
  PetscCall(VecGetArray(p->f_int, &f_int));
  PetscCall(VecGetArray(p->r, &r));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = HycoMeshOwned(f->part, i);

    for (PetscInt c = 0; row >= 0 && c < dim; c++) {
      const PetscInt k = row * dim + c;

      f_int[k] = p->f_local[i * dim + c];
      /* At supports the difference is a reaction. */
      r[k] = f->fe->fixed[i * dim + c] ? 0 : F[k] - f_int[k];
    }
  }
  PetscCall(VecRestoreArrayRead(p->F, &F));
  PetscCall(VecRestoreArray(p->f_int, &f_int));
  PetscCall(VecRestoreArray(p->r, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}
/* Updates f->fe to mu, K, B, D; the loads without the effect of moved supports. The path adds the effect of moved
   supports itself, by increments: p->F is without lifting. */
static PetscErrorCode FOMPathAssemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  HycoFOM f = (HycoFOM)p->ctx;
  PetscBool lifted;

  PetscFunctionBegin;
  (void)elastic;
  PetscCall(HycoFOMAssemble(f, mu));
  PetscCheck(!f->n_pins, p->comm, PETSC_ERR_USER,
             "-hyco_regularise is for scenes without a history; fix the unconstrained motion (%s)",
             f->summary.regularised);
  HycoPathContactGet(p, PETSC_FALSE)->B = f->B;
  HycoPathContactGet(p, PETSC_FALSE)->Bt = f->Bt;
  p->n_free = f->n_free;
  /* HycoFOMAssemble() has the lifting of all prescribed displacements in f->F, which the iterations overwrite as
     their right-hand side; p->F has the loads alone. */
  lifted = f->fe->lifted;
  f->fe->lifted = PETSC_FALSE;
  HycoOnEach(p->comm, HycoFEAssembleForce(f->fe, p->F));
  f->fe->lifted = lifted;
  if (p->friction) PetscCall(HycoFrictionAssemble(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Internal forces at U: scatter, complete eliminated unknowns, laws, reduction. Collective. */
static PetscErrorCode FOMPathStep(HycoPath p, PetscReal t0, PetscReal t1, PetscBool tangent, HycoFEStepReport *report)
{
  HycoFOM f = (HycoFOM)p->ctx;
  PetscScalar *u;

  PetscFunctionBegin;
  /* At each evaluation of the laws, the most frequent point that all ranks reach together. */
  if (p->interrupt) PetscCall((*p->interrupt)(p->interrupt_ctx));
  PetscCall(HycoScatter(f->to_local, f->U, f->U_local));
  PetscCall(PetscArrayzero(p->f_local, f->fe->n_dof));
  PetscCall(VecGetArray(f->U_local, &u));
  HycoFEComplete(f->fe, u);
  HycoOnEach(p->comm, HycoFEStep(f->fe, u, t0, t1, p->begin, p->end, p->f_local, tangent, report));
  PetscCall(VecRestoreArray(f->U_local, &u));
  PetscCall(ReduceReport(f, report));
  if (!report->failed) PetscCall(TakeForces(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* fe is at t, U that of the state. */
static PetscErrorCode FOMPathRates(HycoPath p, PetscReal t, PetscReal dt, HycoFEState state, PetscReal rate[],
                                   PetscReal *largest)
{
  HycoFOM f = (HycoFOM)p->ctx;
  PetscScalar *u;

  PetscFunctionBegin;
  PetscCall(HycoScatter(f->to_local, f->U, f->U_local));
  PetscCall(VecGetArray(f->U_local, &u));
  HycoFEComplete(f->fe, u);
  HycoOnEach(p->comm, HycoFERates(p->fe, u, t, dt, state, rate, largest));
  PetscCall(VecRestoreArray(f->U_local, &u));
  HycoAllreduce(largest, 1, MPIU_REAL, MPI_MAX, p->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the tangents that the last step() left in fe. */
static PetscErrorCode FOMPathStiffness(HycoPath p)
{
  PetscFunctionBegin;
  HycoOnEach(p->comm, HycoFEAssembleStiffness(p->fe, p->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the first iteration of a step the supports move to the new time's values. */
static PetscErrorCode FOMPathMoveSupports(HycoPath p, Vec rhs)
{
  HycoFOM f = (HycoFOM)p->ctx;
  const PetscScalar *u;
  PetscBool moved;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(f->U_local, &u));
  PetscCall(HycoPathMoves(p, u, p->work, &moved));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  if (!moved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecAXPY(rhs, 1, p->work));
  /* HycoPathMoves() assembled the loads together with the lifting: only the latter is wanted. */
  PetscCall(VecAXPY(rhs, -1, p->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean of two vectors times the change of U, over the free or the fixed unknowns. Trapezoidal rule; fixed
   unknowns of other ranks are counted by their owners. */
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

      /* Free unknowns: work of the loads. Fixed ones: internal forces times the motion of the supports. */
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

/* (L0 + L1) / 2 . B (U1 - U0): work of the bodies against the contact forces. */
static PetscErrorCode ContactWork(HycoFOM f, PetscReal *sum)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  *sum = 0;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  /* Tangential forces do work as well, with rows of their own. */
  if (p->friction) {
    PetscCall(HycoPathFrictionWork(p, sum));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecWAXPY(p->work, -1, p->U_old, f->U));
  PetscCall(MatMult(f->B, p->work, p->contact.gap_work));
  PetscCall(VecWAXPY(p->contact.L_new, 1, p->contact.L_old, f->Lambda));
  PetscCall(VecDot(p->contact.L_new, p->contact.gap_work, sum));
  *sum /= 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energies below it are round-off: eps |K_ii U_i| are forces without a meaning, as in Newton's method. */
static PetscErrorCode RoundingWork(HycoFOM f, PetscReal *work)
{
  const PetscScalar *u, *K;
  PetscReal sum = 0;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(f->U, &n));
  PetscCall(VecGetArrayRead(f->U, &u));
  PetscCall(VecGetArrayRead(f->path->diagonal, &K));
  for (PetscInt i = 0; i < n; i++) sum += PetscAbsReal(K[i]) * u[i] * u[i];
  PetscCall(VecRestoreArrayRead(f->path->diagonal, &K));
  PetscCall(VecRestoreArrayRead(f->U, &u));
  PetscCallMPI(MPI_Allreduce(&sum, work, 1, MPIU_REAL, MPI_SUM, HycoComm(f)));
  *work *= HYCO_NOTHING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The energies of the accepted step. With all forces at their mean over the step the balance  work of loads and
   supports = stored + dissipated + of heat and of moduli that change + work against contact  is an identity: its
   defect measures the equilibrium, since the laws give the energies and the loads give the work. The defect is
   relative to all energies exchanged so far, so that a step without any does not divide by round-off. */
static PetscErrorCode AddWork(HycoFOM f, const HycoFEStepReport *law, PetscReal *step_defect)
{
  HycoPath p = f->path;
  HycoWork *w = &p->work_done;
  /* Stored energy is a state, the others are increments. */
  PetscReal loads, supports, contact, stored = law->stored - w->stored, defect, rounding;

  PetscFunctionBegin;
  PetscCall(MeanWork(f, p->F_old, p->F, PETSC_FALSE, &loads));
  PetscCall(MeanWork(f, p->f_old, p->f_int, PETSC_TRUE, &supports));
  PetscCall(ContactWork(f, &contact));
  defect = PetscAbsReal(loads + supports - contact - stored - law->dissipated - law->thermal - law->moduli);
  w->size += PetscAbsReal(loads) + PetscAbsReal(supports) + PetscAbsReal(contact) + PetscAbsReal(stored) +
             PetscAbsReal(law->dissipated) + PetscAbsReal(law->thermal) + PetscAbsReal(law->moduli);
  PetscCall(RoundingWork(f, &rounding));
  /* Of this step; the largest of the path is kept. Rigid motions exchange nothing but round-off. */
  *step_defect = w->size > rounding ? HycoRelative(defect, w->size) : 0;
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

/* The criteria of a single solution, without the energy identity, which a path has by steps. A step with an absurd
   displacement is refused and halved, like one that did not converge. */
static PetscErrorCode JudgeStep(HycoPath p, HycoReason reason, char why[HYCO_LINE])
{
  HycoFOM f = (HycoFOM)p->ctx;
  PetscReal relative;
  const PetscScalar *u;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(f->U_local, &u));
  PetscCall(HycoFOMJudge(f, u, p->contact.L_new, 0, &reason, &relative, why));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  if (reason == HYCO_DIVERGED_FLOATING) HycoFormat(p->no_equilibrium, "%s", why);
  /* Within round-off of the largest load that friction balances: what ends the path is what comes after it. */
  if (reason == HYCO_DIVERGED_HELD && p->no_equilibrium[0]) HycoFormat(why, "%s", p->no_equilibrium);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the step's energies, keeps F and f_int for the next one. */
static PetscErrorCode FOMPathAccept(HycoPath p, const HycoStepAttempt *a)
{
  PetscReal defect = 0;

  PetscFunctionBegin;
  PetscCall(AddWork((HycoFOM)p->ctx, &a->law, &defect));
  PetscCall(VecCopy(p->F, p->F_old));
  PetscCall(VecCopy(p->f_int, p->f_old));
  p->now.energy_defect = PetscMax(p->now.energy_defect, defect);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FOMPathSurfaces(HycoPath p, PetscReal u[], PetscReal *most)
{
  HycoFOM f = (HycoFOM)p->ctx;

  PetscFunctionBegin;
  PetscCall(VecNorm(f->U, NORM_INFINITY, most));
  PetscCall(HycoFOMToSurface(f, f->U, u));
  HycoFEComplete(f->fe_surface, u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest values over the cells of all ranks. Volume means by cell, at the state of the accepted time. */
static PetscErrorCode FOMPathLargest(HycoFOM f, HycoStep *s)
{
  PetscReal *mises, *inelastic, most[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(f->part->n_cells, &mises, f->part->n_cells, &inelastic));
  /* Ghost cells included: their values are the owners'. */
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

/* Collective, like the other measures. At listed times only: a step costs no more communication than it must. */
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
    /* Counted in a real beside the sum: one reduction for both. */
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

/* After HycoFOMGather(). Collective. */
static PetscErrorCode MeasureSliding(HycoFOM f, PetscReal *sliding)
{
  HycoContactFacts state = {0};

  PetscFunctionBegin;
  if (f->n_contacts)
    HycoOnEach(HycoComm(f), HycoContactMeasure(f->fe_surface, &f->pairs, f->u_surface, f->lambda, NULL, NULL, &state));
  *sliding = state.sliding;
  HycoAllreduce(sliding, 1, MPIU_REAL, MPI_MAX, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without friction; with it, path_friction.c does this after each step. */
static PetscErrorCode NameFreeMotion(HycoFOM f, HycoPath p)
{
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMNameFreeMotion(f, name));
  if (!name[0]) PetscFunctionReturn(PETSC_SUCCESS);
  if (!p->loose[0]) p->loose_at[0] = p->t;
  if (!p->loose[0]) PetscCall(PetscStrncpy(p->loose, name, sizeof(p->loose)));
  p->loose_at[1] = p->t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Records a listed time. Energies are those since the start. */
static PetscErrorCode FOMPathRecord(HycoPath p)
{
  HycoFOM f = (HycoFOM)p->ctx;
  HycoStep *s = &p->now;

  PetscFunctionBegin;
  PetscCall(MeasureContacts(f, s));
  PetscCall(FOMPathLargest(f, s));
  PetscCall(VecNorm(f->U, NORM_2, &s->u_norm2));
  s->work = p->work_done.loads + p->work_done.supports;
  s->contact_work = p->work_done.contact;
  s->stored = p->work_done.stored;
  s->dissipated = p->work_done.dissipated;
  s->thermal = p->work_done.thermal + p->work_done.moduli;
  PetscCall(HycoFOMGather(f));
  f->solved = PETSC_TRUE;
  f->sigma_ready = f->all_ready = PETSC_FALSE;
  PetscCall(MeasureSliding(f, &s->sliding));
  if (f->n_contacts) PetscCall(HycoFOMCountDependent(f, &s->n_dependent));
  if (!p->friction && s->total_contact_force > 0) PetscCall(NameFreeMotion(f, p));
  PetscCall(HycoFOMMeasureQuantities(f, s->quantity));
  /* HycoPathSetUp() has room for all listed times and one more, the end of an incomplete path. */
  p->steps[p->n_steps++] = *s;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscCall(HycoSeriesAdd(f));
  if (p->monitor) PetscCall((*p->monitor)(f, &p->steps[p->n_steps - 1], p->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After each accepted step; does nothing without -hyco_checkpoint. */
static PetscErrorCode FOMPathSave(HycoPath p)
{
  PetscFunctionBegin;
  PetscCall(HycoPathSave((HycoFOM)p->ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full-order operations of a path; f's vectors are borrowed. Collective. Steps, iterations and halving are those of
   HycoPath, which reduced models share; this adds only what full order does differently. */
PetscErrorCode HycoFOMPathCreate(HycoFOM f)
{
  static const HycoPathOps ops = {.assemble = FOMPathAssemble,
                                  .step = FOMPathStep,
                                  .stiffness = FOMPathStiffness,
                                  .moves = FOMPathMoveSupports,
                                  .judge = JudgeStep,
                                  .rates = FOMPathRates,
                                  .accept = FOMPathAccept,
                                  .surfaces = FOMPathSurfaces,
                                  .record = FOMPathRecord,
                                  .save = FOMPathSave};
  HycoPath p = f->path;

  PetscFunctionBegin;
  p->ops = &ops;
  p->ctx = f;
  p->fe = f->fe;
  p->contact.system = f->system;
  p->contact.solver = f->solver;
  p->K = f->K;
  p->U = f->U;
  p->contact.Lambda = f->Lambda;
  /* The solver's right-hand side: the path writes K U + F - f_int there, and keeps its loads in a vector of its own. */
  p->rhs = f->F;
  p->contact.D = f->D;
  p->n_contacts = f->n_contacts;
  PetscCall(HycoPathSetUp(p));
  HycoVecDuplicate(f->U, &p->F_old, &p->f_old);
  if (f->n_contacts && HycoSceneHasFriction(f->scene)) PetscCall(HycoFrictionCreate(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path at mu, from its first time or from a checkpoint. Not reaching the end is no error. Collective. */
PetscErrorCode HycoPathSolve(HycoFOM f, const PetscReal mu[])
{
  HycoPath p = f->path;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  PetscCall(HycoPathBegin(p, mu));
  PetscCall(PetscMemzero(&p->work_done, sizeof(p->work_done)));
  PetscCall(VecSet(p->F_old, 0));
  PetscCall(VecSet(p->f_old, 0));
  /* The file's place is checked before the first step, not after hours. */
  PetscCall(HycoSeriesBegin(f));
  PetscCall(HycoPathCheckPlace(f));
  /* After all resets, which it overwrites. */
  if (p->resume) PetscCall(HycoPathLoad(f));
  PetscCall(HycoPathRun(p));
  /* A path that ends early still has its last listed time to show. */
  f->solved = (PetscBool)(p->n_steps > 0);
  PetscCall(HycoSeriesEnd(f));
  f->summary.seconds.total = HycoNow() - begin;
  PetscCall(HycoFOMViewFromOptions(f, NULL, "-hyco_fom_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Empty without a history. Borrowed until the next solve. */
PetscErrorCode HycoFOMGetHistory(HycoFOM f, HycoHistory *h)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(h);
  PetscCall(PetscMemzero(h, sizeof(*h)));
  if (f->path) HycoPathGetHistory(f->path, h);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called after each listed time, with the model at that time: fields may be written or read there. One monitor
   only, and it replaces the one between listed times. */
PetscErrorCode HycoFOMSetStepMonitor(HycoFOM f, HycoStepMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoFOMSetStepMonitor: the scene has no history, and its solution has no steps");
  f->path->monitor = monitor;
  f->path->between = NULL;
  f->path->monitor_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}
