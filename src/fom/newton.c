/*
  One step of time by Newton's method around the contact solver. With r = F - f_int(U) each iteration is one contact
  system,

      K U' + B^T L' = F - f_int(U) + K U,     0 <= L' complementary to D - B U' >= 0,

  K = d f_int / d U (tangent), or the elastic stiffness (elastic), whose factor and flexibility the solver keeps; that
  fixed-point iteration is accelerated by Anderson's method (D. G. Anderson, J. ACM 12 (1965) 547-560; H. F. Walker, P.
  Ni, SIAM J. Numer. Anal. 49 (2011) 1715-1735), which begins anew where contacts open or close. Where the laws are
  gradients of a potential, tangent steps are shortened until it falls (Armijo). What ends the iterations is the
  recomputed residual F - f_int - B^T L relative to the largest of these three; F alone may be nothing.
*/
#include <hycopath.h>

#define ARMIJO    1e-4
#define SHORTENED 8 /* times that a step is halved at most */

/* What an iteration knows of the one before. */
typedef struct {
  PetscReal size, floor;             /* of forces: the largest of the three; what rounding U makes of them */
  PetscReal residual[3];             /* norms, newest last */
  PetscReal potential, slope, share; /* at the base of the step, along it, of it that was taken */
  PetscBool feasible, search;        /* the base is at the step's supports and gaps; and there is a potential */
} Progress;

/* The law over all ranks. */
static PetscErrorCode ReduceReport(HycoFOM f, HycoFEStepReport *r)
{
  PetscReal sum[6] = {r->work, r->stored, r->dissipated, r->thermal, r->moduli, r->potential};
  PetscReal most[4] = {-r->dt_factor, r->increment, (PetscReal)r->failed, (PetscReal)!r->has_potential};
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

/* This rank's rows of f_local; and r = F - f_int there, 0 where fixed. */
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
      r[k] = f->fe->fixed[i * dim + c] ? 0 : F[k] - f_int[k];
    }
  }
  PetscCall(VecRestoreArrayRead(p->F, &F));
  PetscCall(VecRestoreArray(p->f_int, &f_int));
  PetscCall(VecRestoreArray(p->r, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law at U: state `end`, f_int, r = F - f_int - B^T L, with `tangent` the consistent tangents; the sizes of what r
   is made of. */
static PetscErrorCode Evaluate(HycoFOM f, PetscReal t0, PetscReal t1, PetscBool tangent, HycoAttempt *a, Progress *now)
{
  HycoPath p = f->path;
  const PetscScalar *u;
  PetscReal begin = HycoNow(), size[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(PetscArrayzero(p->f_local, f->fe->n_dof));
  PetscCall(PetscMemzero(&a->law, sizeof(a->law)));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  HycoOnEach(HycoComm(f), HycoFEStep(f->fe, u, t0, t1, p->begin, p->end, p->f_local, tangent, &a->law));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscCall(ReduceReport(f, &a->law));
  a->seconds_law += HycoNow() - begin;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TakeForces(f));
  PetscCall(VecNorm(p->f_int, NORM_2, &size[0]));
  PetscCall(VecNorm(p->F, NORM_2, &size[1]));
  if (f->n_contacts) {
    PetscCall(MatMult(f->Bt, f->Lambda, p->work));
    PetscCall(VecNorm(p->work, NORM_2, &size[2]));
    PetscCall(VecAXPY(p->r, -1, p->work));
  }
  now->size = PetscMax(size[0], PetscMax(size[1], size[2]));
  now->residual[0] = now->residual[1];
  now->residual[1] = now->residual[2];
  PetscCall(VecNorm(p->r, NORM_2, &now->residual[2]));
  PetscCall(VecPointwiseMult(p->work, p->diagonal, f->U));
  PetscCall(VecNorm(p->work, NORM_2, &now->floor));
  now->floor *= 16 * PETSC_MACHINE_EPSILON;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K (u0 - U) of the supports that have moved, taken from the loads of the free unknowns; K_ii (u0 - U)_i at the others.
 */
static PetscErrorCode AddMoves(HycoFOM f, Vec rhs)
{
  HycoPath p = f->path;
  HycoFE fe = f->fe;
  const PetscScalar *u;
  PetscInt moved = 0;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(p->u0, fe->u0, fe->n_dof));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    fe->u0[k] = fe->fixed[k] ? fe->u0[k] - u[k] : 0;
    moved += fe->u0[k] != 0;
  }
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &moved, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  if (moved) {
    const PetscBool lifted = fe->lifted;

    fe->lifted = PETSC_TRUE;
    HycoOnEach(HycoComm(f), HycoFEAssembleForce(fe, p->work));
    fe->lifted = lifted;
    PetscCall(VecAXPY(rhs, 1, p->work));
    PetscCall(VecAXPY(rhs, -1, p->F));
  }
  PetscCall(PetscArraycpy(fe->u0, p->u0, fe->n_dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f->F = K U + F - f_int: what the contact system has on its right side. */
static PetscErrorCode RightSide(HycoFOM f)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  PetscCall(MatMult(f->K, f->U, f->F));
  PetscCall(VecAXPY(f->F, 1, p->r));
  if (f->n_contacts) PetscCall(MatMultAdd(f->Bt, f->Lambda, f->F, f->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AssembleK(HycoFOM f, PetscBool tangent)
{
  PetscFunctionBegin;
  PetscCall(HycoLogEvent(HYCO_EVENT_ASSEMBLE, PETSC_TRUE));
  HycoOnEach(HycoComm(f), HycoFEAssembleStiffness(f->fe, f->K));
  PetscCall(HycoLogEvent(HYCO_EVENT_ASSEMBLE, PETSC_FALSE));
  f->path->tangent = tangent;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact system at U: its solution in G and L_new. */
static PetscErrorCode SolveSystem(HycoFOM f, PetscBool first, HycoAttempt *a)
{
  HycoPath p = f->path;
  HycoReason reason;
  PetscReal factor, solve;
  PetscInt its;

  PetscFunctionBegin;
  PetscCall(RightSide(f));
  if (first) PetscCall(AddMoves(f, f->F));
  PetscCall(HycoSystemSetVectors(f->system, f->F, f->D));
  PetscCall(HycoSolverSetSystem(f->solver, f->system));
  PetscCall(VecCopy(f->U, p->G));
  if (f->n_contacts) PetscCall(VecCopy(f->Lambda, p->L_new));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(f->solver, p->G, p->L_new));
  PetscCall(HycoSolverGetReason(f->solver, &reason));
  PetscCall(HycoSolverGetSeconds(f->solver, &factor, &solve));
  PetscCall(HycoSolverGetIterations(f->solver, &its));
  a->iterations++;
  a->factors += factor > 0;
  a->active_its += its;
  a->seconds_factor += factor;
  a->seconds_solve += solve;
  if (reason < 0) HycoFormat(a->why, "%s", HycoReasonName(reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step of Newton's method: to the system's solution; Evaluate() and Shorten() see how far. */
static PetscErrorCode Advance(HycoFOM f, PetscBool feasible, const HycoAttempt *a, Progress *now)
{
  HycoPath p = f->path;
  PetscReal work;

  PetscFunctionBegin;
  PetscCall(VecCopy(f->U, p->U_last));
  if (f->n_contacts) PetscCall(VecCopy(f->Lambda, p->L_last));
  now->feasible = feasible;
  now->search = (PetscBool)(feasible && a->law.has_potential);
  now->share = 1;
  if (now->search) { /* r + B^T L = F - f_int on the free unknowns; along the others U stays */
    PetscCall(VecWAXPY(p->work, -1, f->U, p->G));
    PetscCall(VecDot(p->r, p->work, &now->slope));
    if (f->n_contacts) {
      PetscCall(MatMult(f->B, p->work, p->gap_work));
      PetscCall(VecDot(p->gap_work, f->Lambda, &work));
      now->slope += work;
    }
    now->slope = -now->slope;
    PetscCall(VecDot(p->F, f->U, &work));
    now->potential = a->law.potential - work;
  }
  PetscCall(VecCopy(p->G, f->U));
  if (f->n_contacts) PetscCall(VecCopy(p->L_new, f->Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the incremental potential has fallen enough; a law that has no answer says no. */
static PetscErrorCode IsLower(HycoFOM f, const HycoAttempt *a, const Progress *now, PetscBool *lower)
{
  PetscReal work, potential;

  PetscFunctionBegin;
  *lower = PETSC_FALSE;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  *lower = PETSC_TRUE;
  if (!now->search) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(f->path->F, f->U, &work));
  potential = a->law.potential - work;
  *lower = (PetscBool)(potential <= now->potential + ARMIJO * now->share * now->slope +
                                        1e-12 * (PetscAbsReal(a->law.potential) + PetscAbsReal(work)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Halves the last step until the potential falls, and evaluates there. */
static PetscErrorCode Shorten(HycoFOM f, PetscReal t0, PetscReal t1, HycoAttempt *a, Progress *now)
{
  HycoPath p = f->path;
  PetscBool lower;

  PetscFunctionBegin;
  PetscCall(IsLower(f, a, now, &lower));
  for (PetscInt k = 0; k < SHORTENED && !lower && now->feasible; k++) {
    now->share /= 2;
    PetscCall(VecAXPBY(f->U, 0.5, 0.5, p->U_last));
    if (f->n_contacts) PetscCall(VecAXPBY(f->Lambda, 0.5, 0.5, p->L_last));
    now->residual[2] = now->residual[1]; /* that of the place before */
    now->residual[1] = now->residual[0];
    PetscCall(Evaluate(f, t0, t1, PETSC_TRUE, a, now));
    PetscCall(IsLower(f, a, now, &lower));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a contact is closed in one of the two solutions alone. */
static PetscErrorCode SetChanged(HycoFOM f, Vec a, Vec b, PetscBool *changed)
{
  const PetscScalar *x, *y;
  PetscInt n;
  PetscInt count = 0;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(a, &n));
  PetscCall(VecGetArrayRead(a, &x));
  PetscCall(VecGetArrayRead(b, &y));
  for (PetscInt k = 0; k < n; k++) count += (x[k] > 0) != (y[k] > 0);
  PetscCall(VecRestoreArrayRead(a, &x));
  PetscCall(VecRestoreArrayRead(b, &y));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  *changed = (PetscBool)(count > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last differences move by one place, and the newest is `vector` - `last`. */
static PetscErrorCode Push(PetscInt n, Vec store[], Vec vector, Vec last)
{
  Vec oldest = store[0];

  PetscFunctionBegin;
  if (n == HYCO_ANDERSON) {
    for (PetscInt k = 1; k < n; k++) store[k - 1] = store[k];
    store[n - 1] = oldest;
  }
  PetscCall(VecWAXPY(store[PetscMin(n, HYCO_ANDERSON - 1)], -1, last, vector));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma of min |g - sum of gamma_j dG_j|, by normal equations with a trace of ridge; n <= HYCO_ANDERSON. */
static PetscErrorCode LeastSquares(PetscInt n, Vec dG[], Vec g, PetscReal gamma[])
{
  PetscReal A[HYCO_ANDERSON][HYCO_ANDERSON], trace = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n && i < HYCO_ANDERSON; i++) {
    PetscCall(VecMDot(dG[i], n, dG, A[i]));
    trace += A[i][i];
  }
  PetscCall(VecMDot(g, n, dG, gamma));
  for (PetscInt i = 0; i < n; i++) A[i][i] += 1e-13 * trace + PETSC_SQRT_MACHINE_EPSILON * PETSC_SMALL * PETSC_SMALL;
  for (PetscInt i = 0; i < n; i++) { /* definite: no pivots */
    for (PetscInt r = i + 1; r < n; r++) {
      const PetscReal share = A[r][i] / A[i][i];

      for (PetscInt c = i; c < n; c++) A[r][c] -= share * A[i][c];
      gamma[r] -= share * gamma[i];
    }
  }
  for (PetscInt i = n - 1; i >= 0; i--) {
    for (PetscInt c = i + 1; c < n; c++) gamma[i] -= A[i][c] * gamma[c];
    gamma[i] /= A[i][i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next iterate of the elastic variant: the system's solution, mixed with those before it on the same contacts. The
   first of a step, k = 0, is not at the step's supports and is left out. */
static PetscErrorCode Mix(HycoFOM f, PetscInt k)
{
  HycoPath p = f->path;
  PetscReal gamma[HYCO_ANDERSON];
  PetscBool changed = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(VecWAXPY(p->work, -1, f->U, p->G)); /* g */
  if (k > 1) PetscCall(SetChanged(f, p->L_new, p->L_last, &changed));
  if (k <= 1 || changed)
    p->n_mixed = 0;
  else {
    PetscCall(Push(p->n_mixed, p->dU, p->G, p->U_last));
    PetscCall(Push(p->n_mixed, p->dG, p->work, p->G_last));
    if (f->n_contacts) PetscCall(Push(p->n_mixed, p->dL, p->L_new, p->L_last));
    p->n_mixed = PetscMin(p->n_mixed + 1, HYCO_ANDERSON);
  }
  PetscCall(VecCopy(p->G, p->U_last));
  PetscCall(VecCopy(p->work, p->G_last));
  PetscCall(VecCopy(p->G, f->U));
  if (f->n_contacts) {
    PetscCall(VecCopy(p->L_new, p->L_last));
    PetscCall(VecCopy(p->L_new, f->Lambda));
  }
  if (p->n_mixed) PetscCall(LeastSquares(p->n_mixed, p->dG, p->work, gamma));
  for (PetscInt j = 0; j < p->n_mixed; j++) {
    PetscCall(VecAXPY(f->U, -gamma[j], p->dU[j]));
    if (f->n_contacts) PetscCall(VecAXPY(f->Lambda, -gamma[j], p->dL[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The four residuals of the nonlinear problem: with K U + F - f_int as the right side, K falls out of the first. */
static PetscErrorCode Judge(HycoFOM f, const Progress *now, HycoAttempt *a, PetscReal *worst)
{
  HycoKKT *kkt = &f->path->kkt;
  const PetscReal size = now->size > 0 ? now->size : 1;

  PetscFunctionBegin;
  PetscCall(RightSide(f));
  PetscCall(HycoSystemSetVectors(f->system, f->F, f->D));
  HycoLogged(HYCO_EVENT_KKT, HycoSystemComputeKKT(f->system, f->U, f->Lambda, kkt));
  *worst = PetscMax(kkt->penetration, PetscMax(kkt->adhesion, kkt->complementarity));
  a->residual = now->residual[2] / size;
  kkt->rounding = now->residual[2] <= now->floor ? a->residual : 0;
  kkt->stationarity = kkt->rounding > 0 ? 0 : a->residual;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* log(r2 / r1) / log(r1 / r0), where none of the three is round-off yet. */
static void Observe(const Progress *now, PetscInt k, HycoAttempt *a)
{
  const PetscReal *r = now->residual, least = 1e-13 * now->size + now->floor;

  if (k < 2 || !(r[2] > least) || !(r[2] < r[1]) || !(r[1] < 0.2 * r[0])) return;
  a->order = PetscLogReal(r[2] / r[1]) / PetscLogReal(r[1] / r[0]);
}

static PetscErrorCode Iterate(HycoFOM f, PetscReal t0, PetscReal t1, PetscBool elastic, PetscInt most, HycoAttempt *a)
{
  HycoPath p = f->path;
  Progress now = {.residual = {0, 0, 0}};
  PetscReal least = PETSC_MAX_REAL, worst = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; !a->why[0]; k++) {
    PetscCall(Evaluate(f, t0, t1, (PetscBool)!elastic, a, &now));
    if (!elastic && k) PetscCall(Shorten(f, t0, t1, a, &now));
    if (a->law.failed) {
      HycoFormat(a->why, "%s", a->law.why);
      break;
    }
    if (!elastic) Observe(&now, k, a);
    if (k && now.residual[2] <= PetscMax(p->rtol * now.size, now.floor)) {
      PetscCall(Judge(f, &now, a, &worst));
      a->converged = (PetscBool)(worst <= 1e-8);
      if (a->converged) break;
    }
    if (k) least = PetscMin(least, now.residual[2] / (now.size > 0 ? now.size : 1));
    if (k == most || !(now.residual[2] <= 1e4 * PetscMax(now.size, now.floor))) {
      HycoFormat(a->why, "the residual of equilibrium is %.1e after %d iterations (%s)", (double)least, (int)k,
                 elastic ? "elastic" : "tangent");
      break;
    }
    if (!elastic) PetscCall(AssembleK(f, PETSC_TRUE));
    PetscCall(SolveSystem(f, (PetscBool)(k == 0), a));
    if (a->why[0]) break;
    if (elastic)
      PetscCall(Mix(f, k));
    else
      PetscCall(Advance(f, (PetscBool)(k > 0), a, &now));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathRestore(HycoFOM f)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  PetscCall(VecCopy(p->U_old, f->U));
  if (f->n_contacts) PetscCall(VecCopy(p->L_old, f->Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathAssemble(HycoFOM f, PetscReal t1)
{
  HycoPath p = f->path;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool lifted;

  PetscFunctionBegin;
  HycoSceneSetTime(f->scene, p->mu, t1, mu);
  PetscCall(HycoFOMAssemble(f, mu));
  if (f->fe->stiffness_changed) p->tangent = PETSC_FALSE;
  PetscCheck(!f->n_pins, HycoComm(f), PETSC_ERR_USER,
             "-hyco_regularise is for scenes without a history; fix what holds no body (%s)", f->summary.regularised);
  lifted = f->fe->lifted;
  f->fe->lifted = PETSC_FALSE;
  HycoOnEach(HycoComm(f), HycoFEAssembleForce(f->fe, p->F));
  f->fe->lifted = lifted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoPathFactorCost(HycoFOM f)
{
  return (f->fe->dim == 3 ? 0.15 : 0.03) * PetscSqrtReal((PetscReal)f->n_free);
}

/* By counts alone, so that a choice repeats on any machine: the elastic variant takes up to five times as many
   iterations. */
PetscBool HycoPathPrefersElastic(HycoFOM f)
{
  const HycoPath p = f->path;

  if (!p->flows || p->method != HYCO_NEWTON_AUTO) return (PetscBool)(!p->flows || p->method == HYCO_NEWTON_ELASTIC);
  return (PetscBool)(HycoPathFactorCost(f) > 5);
}

PetscErrorCode HycoPathAttempt(HycoFOM f, PetscReal t0, PetscReal t1, HycoAttempt *a)
{
  HycoPath p = f->path;
  PetscBool elastic;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(a, sizeof(*a)));
  PetscCall(VecCopy(f->U, p->U_old));
  if (f->n_contacts) PetscCall(VecCopy(f->Lambda, p->L_old));
  PetscCall(HycoPathAssemble(f, t1));
  elastic = HycoPathPrefersElastic(f);
  if (p->tangent && elastic) {
    PetscCall(HycoFEElasticTangent(f->fe));
    PetscCall(AssembleK(f, PETSC_FALSE));
  }
  PetscCall(MatGetDiagonal(f->K, p->diagonal));
  PetscCall(Iterate(f, t0, t1, elastic, p->max_its ? p->max_its : elastic ? 60 : 15, a));
  if (!a->converged && elastic && p->flows && p->method == HYCO_NEWTON_AUTO) {
    a->why[0] = '\0';
    PetscCall(HycoPathRestore(f));
    PetscCall(Iterate(f, t0, t1, PETSC_FALSE, p->max_its ? p->max_its : 15, a));
  }
  a->easy = (PetscBool)(a->iterations <= (elastic ? 30 : 7));
  if (!a->converged) PetscCall(HycoPathRestore(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
