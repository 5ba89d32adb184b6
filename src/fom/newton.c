/*
  A time step by Newton's method around the contact solver. With r = F - f_int(U) each iteration is one contact system,

    K U' + B^T L' = F - f_int(U) + K U,     0 <= L' complementary to D - B U' >= 0,

  K = d f_int / d U (tangent), or the elastic stiffness (elastic), whose factor and flexibility the solver keeps; that
  fixed-point iteration is accelerated by Anderson's method (D. G. Anderson, J. ACM 12 (1965) 547-560; H. F. Walker, P.
  Ni, SIAM J. Numer. Anal. 49 (2011) 1715-1735), which is restarted when contacts open or close. If the laws have a
  potential, tangent steps are shortened until it decreases (Armijo). In the third variant (modified) a tangent is kept
  with its factor, also from step to step, as long as the accelerated iterations contract well. The iterations end by
  the recomputed residual F - f_int - B^T L relative to the largest of these three; F alone may be zero.
*/
#include <hycopath.h>

/* Decrease of the potential as a share of its slope, at which a step is taken: the usual 1e-4 (Nocedal, Wright,
   Numerical Optimization, 3.1). */
#define ARMIJO     1e-4
#define SHORTENED  8 /* largest number of halvings of a step */
#define RENEW_FROM 8 /* expected number of further iterations above which a new tangent is made (modified) */
/* Iterations of a step of elastic bodies with friction, beyond which only round-off is left. */
#define FRICTION_ITS    5
#define LOADS_ROUND_OFF 1e-14 /* of the right-hand side of the contact system, the loads: 45 eps of K U */
/* Residual of a solve without a factor as a share of the iterate's: three digits an iteration, which Newton's method
   gains anyway (scripts/bench-history). */
#define FORCING 1e-3

/* Data of the previous iteration. */
typedef struct {
  PetscReal size, floor;             /* of forces: the largest of the three; the effect of rounding U */
  PetscReal residual[3];             /* norms, newest last */
  PetscReal potential, slope, share; /* the potential at the base of the step, its slope along the step, and the
                                        share of the step taken */
  PetscBool feasible, search;        /* feasible: the base satisfies the step's supports and gaps; search: and there
                                        is a potential */
} Progress;

/* Evaluates the law at U: state `end`, f_int, r = F - f_int - B^T L, with `tangent` the consistent tangents; and the
   magnitudes of the terms of r. floor: 16 eps |diag(K) U|: below it the residual is round-off of U. */
static PetscErrorCode NewtonEvaluate(HycoPath p, PetscReal t0, PetscReal t1, PetscBool tangent, HycoStepAttempt *a,
                                     Progress *now)
{
  PetscReal begin = HycoNow(), size[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(&a->law, sizeof(a->law)));
  PetscCall((*p->ops->step)(p, t0, t1, tangent, &a->law));
  a->seconds_law += HycoNow() - begin;
  now->residual[0] = now->residual[1]; /* also where a law fails: NewtonShorten() takes one back for each evaluation */
  now->residual[1] = now->residual[2];
  /* Stays where a law fails: such a step counts as diverged, not as stagnating. */
  now->residual[2] = PETSC_INFINITY;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(p->f_int, NORM_2, &size[0]));
  PetscCall(VecNorm(p->F, NORM_2, &size[1]));
  if (p->n_contacts) {
    PetscCall(MatMult(p->contact.Bt, p->contact.Lambda, p->work));
    PetscCall(VecNorm(p->work, NORM_2, &size[2]));
    /* ops->step left F - f_int in r. */
    PetscCall(VecAXPY(p->r, -1, p->work));
  }
  now->size = PetscMax(size[0], PetscMax(size[1], size[2]));
  PetscCall(VecNorm(p->r, NORM_2, &now->residual[2]));
  PetscCall(VecPointwiseMult(p->work, p->diagonal, p->U));
  PetscCall(VecNorm(p->work, NORM_2, &now->floor));
  now->floor *= HYCO_NOTHING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K (u0 - u) of supports that have moved, subtracted from the loads of the free unknowns; K_ii (u0 - u)_i at the
   others. By the lifting of HycoFEAssembleForce() for the differences of prescribed displacements in place of their
   values. */
PetscErrorCode HycoPathMoves(HycoPath p, const PetscScalar u[], Vec work, PetscBool *moved)
{
  HycoFE fe = p->fe;
  PetscInt count = 0;

  PetscFunctionBegin;
  /* The prescribed values come back below: only the assembly sees the differences. */
  PetscCall(PetscArraycpy(p->u0, fe->u0, fe->n_dof));
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    fe->u0[k] = HycoFESupports(fe, k) ? fe->u0[k] - u[k] : 0; /* the difference of a tied node from its masters stays
                                                                 0 */
    count += fe->u0[k] != 0;
  }
  /* Assembly is collective: all ranks must agree whether it runs. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, p->comm));
  *moved = (PetscBool)(count > 0);
  if (*moved) {
    const PetscBool lifted = fe->lifted;

    fe->lifted = PETSC_TRUE;
    HycoOnEach(p->comm, HycoFEAssembleForce(fe, work));
    fe->lifted = lifted;
  }
  PetscCall(PetscArraycpy(fe->u0, p->u0, fe->n_dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether K U + F - f_int may be round-off alone, which no contact forces of a floating body balance; *least: its size.
   With friction, or where contact alone holds a body. */
static PetscErrorCode NewtonRoundOff(HycoPath p, PetscReal *least)
{
  MatNullSpace kernel = NULL;
  PetscReal size[2];

  PetscFunctionBegin;
  *least = -1;
  PetscCall(MatGetNullSpace(p->K, &kernel));
  if (!p->has_friction && !kernel) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(p->rhs, NORM_INFINITY, &size[0]));
  PetscCall(VecPointwiseMult(p->work, p->diagonal, p->U));
  PetscCall(VecNorm(p->work, NORM_INFINITY, &size[1]));
  *least = PetscMax(LOADS_ROUND_OFF * size[0], HYCO_NOTHING * size[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rhs = K U + F - f_int: the right-hand side of the contact system. r is F - f_int - B^T L on entry, so that B^T L is
   added back. Where all loads vanish, their sum is round-off, and it is 0 then. The system's unknowns are U and L
   themselves and not their changes, since contact conditions are on the whole of both. first: of a step, which moves
   the supports; later iterates have their new values. *least: as of NewtonRoundOff(). */
static PetscErrorCode RightSide(HycoPath p, PetscBool first, PetscReal *least)
{
  PetscReal size = 0;

  PetscFunctionBegin;
  PetscCall(MatMult(p->K, p->U, p->rhs));
  PetscCall(NewtonRoundOff(p, least));
  PetscCall(VecAXPY(p->rhs, 1, p->r));
  if (p->n_contacts) PetscCall(MatMultAdd(p->contact.Bt, p->contact.Lambda, p->rhs, p->rhs));
  if (first) PetscCall((*p->ops->moves)(p, p->rhs));
  if (*least >= 0) PetscCall(VecNorm(p->rhs, NORM_INFINITY, &size));
  if (size <= *least) PetscCall(VecSet(p->rhs, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the values of K; the solver factors it at the next solve. */
static PetscErrorCode AssembleK(HycoPath p, PetscBool tangent)
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_ASSEMBLE, (*p->ops->stiffness)(p));
  p->tangent = tangent;
  p->kept = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual to which a contact system is solved without a factor: a share of that of the iterate. With a tangent the
   share decreases with the residual, which preserves the order of convergence (S. Eisenstat, H. Walker, SIAM J. Sci.
   Comput. 17 (1996) 16-32). */
static PetscReal NewtonTolerance(HycoPath p, const Progress *now)
{
  const PetscReal r = now->residual[2], least = PetscMax(0.1 * p->rtol * now->size, now->floor);
  const PetscReal share = p->tangent && r < FORCING * now->size ? r / now->size : FORCING;

  return PetscMax(least, share * r);
}

/* Solves the contact system at U: the solution is in G and L_new. U and L are the start of the solve: the active set
   of the last iterate is mostly right. */
static PetscErrorCode SolveSystem(HycoPath p, PetscBool first, const Progress *now, HycoStepAttempt *a)
{
  HycoReason reason;
  PetscReal factor, solve, least;
  PetscInt its, linear, most;

  PetscFunctionBegin;
  PetscCall(RightSide(p, first, &least));
  PetscCall(HycoSystemSetVectors(p->contact.system, p->rhs, p->contact.D));
  HycoSystemSetRounding(p->contact.system, PetscMax(least, 0));
  PetscCall(HycoSolverSetSystem(p->contact.solver, p->contact.system));
  PetscCall(VecCopy(p->U, p->G));
  if (p->n_contacts) PetscCall(VecCopy(p->contact.Lambda, p->contact.L_new));
  if (p->cold) PetscCall(HycoSolverSetWarmStart(p->contact.solver, PETSC_FALSE));
  /* A solver with a factor ignores it. */
  PetscCall(HycoSolverSetTarget(p->contact.solver, NewtonTolerance(p, now)));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(p->contact.solver, p->G, p->contact.L_new));
  if (p->cold) PetscCall(HycoSolverSetWarmStart(p->contact.solver, PETSC_TRUE));
  p->cold = PETSC_FALSE;
  PetscCall(HycoSolverGetReason(p->contact.solver, &reason));
  PetscCall(HycoSolverGetSeconds(p->contact.solver, &factor, &solve));
  PetscCall(HycoSolverGetIterations(p->contact.solver, &its));
  PetscCall(HycoSolverGetLinearIterations(p->contact.solver, &linear, &most));
  p->kept++;
  a->iterations++;
  /* Seconds of a new factor; 0: a kept one. */
  a->factors += factor > 0;
  a->active_its += its;
  a->linear_its += linear;
  a->most_linear = PetscMax(a->most_linear, most);
  a->seconds_factor += factor;
  a->seconds_solve += solve;
  if (reason < 0) HycoFormat(a->why, "%s", HycoReasonName(reason));
  if (reason < 0 && p->ops->judge) PetscCall((*p->ops->judge)(p, reason, a->why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathSolveAgain(HycoPath p, PetscBool *solved)
{
  const Progress now = {.residual = {0, 0, 0}};
  const PetscInt kept = p->kept;
  HycoStepAttempt a = {.why = ""};

  PetscFunctionBegin;
  PetscCall(SolveSystem(p, PETSC_FALSE, &now, &a));
  p->kept = kept;
  *solved = (PetscBool)!a.why[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step of Newton's method: to the system's solution; NewtonEvaluate() and NewtonShorten() determine the step length.
   The slope of the potential along the step is -(F - f_int) . dU. */
static PetscErrorCode NewtonAdvance(HycoPath p, PetscBool feasible, const HycoStepAttempt *a, Progress *now)
{
  PetscReal work;

  PetscFunctionBegin;
  PetscCall(VecCopy(p->U, p->U_last));
  if (p->n_contacts) PetscCall(VecCopy(p->contact.Lambda, p->contact.L_last));
  now->feasible = feasible;
  /* Friction has no potential: its forces depend on the normal ones. */
  now->search = (PetscBool)(feasible && a->law.has_potential && !p->has_friction);
  now->share = 1;
  if (now->search) { /* r + B^T L = F - f_int on the free unknowns; on the others U does not change */
    PetscCall(VecWAXPY(p->work, -1, p->U, p->G));
    PetscCall(VecDot(p->r, p->work, &now->slope));
    if (p->n_contacts) {
      PetscCall(MatMult(p->contact.B, p->work, p->contact.gap_work));
      PetscCall(VecDot(p->contact.gap_work, p->contact.Lambda, &work));
      now->slope += work;
    }
    now->slope = -now->slope;
    PetscCall(VecDot(p->F, p->U, &work));
    now->potential = a->law.potential - work;
  }
  PetscCall(VecCopy(p->G, p->U));
  if (p->n_contacts) PetscCall(VecCopy(p->contact.L_new, p->contact.Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the incremental potential has decreased enough; no if a law has no solution. The last term allows for
   round-off of the two sums. */
static PetscErrorCode IsLower(HycoPath p, const HycoStepAttempt *a, const Progress *now, PetscBool *lower)
{
  PetscReal work, potential;

  PetscFunctionBegin;
  *lower = PETSC_FALSE;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  *lower = PETSC_TRUE;
  /* Without a potential there is nothing to search on: the full step is taken. */
  if (!now->search) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(p->F, p->U, &work));
  potential = a->law.potential - work;
  *lower = (PetscBool)(potential <= now->potential + ARMIJO * now->share * now->slope +
                                        1e-12 * (PetscAbsReal(a->law.potential) + PetscAbsReal(work)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Halves the last step until the potential decreases, and evaluates there. The tangents of the last evaluation
   remain: those at the accepted point. */
static PetscErrorCode NewtonShorten(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a, Progress *now)
{
  PetscBool lower;

  PetscFunctionBegin;
  PetscCall(IsLower(p, a, now, &lower));
  for (PetscInt k = 0; k < SHORTENED && !lower && now->feasible; k++) {
    now->share /= 2;
    PetscCall(VecAXPBY(p->U, 0.5, 0.5, p->U_last));
    if (p->n_contacts) PetscCall(VecAXPBY(p->contact.Lambda, 0.5, 0.5, p->contact.L_last));
    /* NewtonEvaluate() shifts the residuals: those of the refused point are taken out of the history. */
    now->residual[2] = now->residual[1]; /* the previous one */
    now->residual[1] = now->residual[0];
    PetscCall(NewtonEvaluate(p, t0, t1, PETSC_TRUE, a, now));
    PetscCall(IsLower(p, a, now, &lower));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a contact is closed in exactly one of the two solutions. Forces of open contacts are exactly 0 after a
   solve. */
static PetscErrorCode SetChanged(HycoPath p, Vec a, Vec b, PetscBool *changed)
{
  const PetscScalar *x, *y;
  PetscInt n;
  PetscInt count = 0;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  if (!p->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(a, &n));
  PetscCall(VecGetArrayRead(a, &x));
  PetscCall(VecGetArrayRead(b, &y));
  for (PetscInt k = 0; k < n; k++) count += (x[k] > 0) != (y[k] > 0);
  PetscCall(VecRestoreArrayRead(a, &x));
  PetscCall(VecRestoreArrayRead(b, &y));
  /* One contact on one rank restarts the mixing on all. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, p->comm));
  *changed = (PetscBool)(count > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shifts the last differences by one place, and stores the newest, `vector` - `last`. Vectors are rotated, not
   copied. */
static PetscErrorCode NewtonStore(PetscInt n, Vec store[], Vec vector, Vec last)
{
  Vec oldest = store[0];

  PetscFunctionBegin;
  /* Full: the oldest vector becomes the newest. */
  if (n == HYCO_ANDERSON) {
    for (PetscInt k = 1; k < n; k++) store[k - 1] = store[k];
    store[n - 1] = oldest;
  }
  PetscCall(VecWAXPY(store[PetscMin(n, HYCO_ANDERSON - 1)], -1, last, vector));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma of min |g - sum of gamma_j dG_j|, by normal equations, n <= HYCO_ANDERSON, and dense elimination; a small ridge
   keeps dependent differences harmless. Anderson's acceleration (Walker and Ni 2011), type II. */
static PetscErrorCode LeastSquares(PetscInt n, Vec dG[], Vec g, PetscReal gamma[])
{
  PetscReal A[HYCO_ANDERSON][HYCO_ANDERSON], trace = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n && i < HYCO_ANDERSON; i++) {
    PetscCall(VecMDot(dG[i], n, dG, A[i]));
    trace += A[i][i];
  }
  PetscCall(VecMDot(g, n, dG, gamma));
  /* Also positive where all differences vanish. */
  for (PetscInt i = 0; i < n; i++) A[i][i] += 1e-13 * trace + PETSC_SQRT_MACHINE_EPSILON * PETSC_SMALL * PETSC_SMALL;
  for (PetscInt i = 0; i < n; i++) { /* positive definite: no pivoting */
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

/* The next iterate with a K that is kept: the system's solution, mixed with previous ones on the same contacts. The
   first of a step, k = 0, does not satisfy the step's supports and is left out; the mixing begins with k = 1. With
   another contact set the former differences belong to another linear map. */
static PetscErrorCode NewtonExtrapolate(HycoPath p, PetscInt k)
{
  PetscReal gamma[HYCO_ANDERSON];
  PetscBool changed = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(VecWAXPY(p->work, -1, p->U, p->G)); /* g */
  if (k > 1) PetscCall(SetChanged(p, p->contact.L_new, p->contact.L_last, &changed));
  /* The differences so far are forgotten. */
  if (k <= 1 || changed)
    p->n_mixed = 0;
  else {
    /* The newest first; the oldest is overwritten. */
    PetscCall(NewtonStore(p->n_mixed, p->dU, p->G, p->U_last));
    PetscCall(NewtonStore(p->n_mixed, p->dG, p->work, p->G_last));
    if (p->n_contacts) PetscCall(NewtonStore(p->n_mixed, p->contact.dL, p->contact.L_new, p->contact.L_last));
    p->n_mixed = PetscMin(p->n_mixed + 1, HYCO_ANDERSON);
  }
  PetscCall(VecCopy(p->G, p->U_last));
  PetscCall(VecCopy(p->work, p->G_last));
  PetscCall(VecCopy(p->G, p->U));
  if (p->n_contacts) {
    PetscCall(VecCopy(p->contact.L_new, p->contact.L_last));
    PetscCall(VecCopy(p->contact.L_new, p->contact.Lambda));
  }
  if (p->n_mixed) PetscCall(LeastSquares(p->n_mixed, p->dG, p->work, gamma));
  for (PetscInt j = 0; j < p->n_mixed; j++) {
    PetscCall(VecAXPY(p->U, -gamma[j], p->dU[j]));
    /* Forces are mixed like displacements: on a fixed set both are affine in the iterate. */
    if (p->n_contacts) PetscCall(VecAXPY(p->contact.Lambda, -gamma[j], p->contact.dL[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The four residuals of the nonlinear problem: with the right-hand side K U + F - f_int, K cancels in the first.
   Feasibility and complementarity of the contacts at U, stationarity by the residual of the nonlinear forces. */
static PetscErrorCode NewtonJudge(HycoPath p, const Progress *now, HycoStepAttempt *a, PetscReal *worst)
{
  HycoKKT *kkt = &p->kkt;
  const PetscReal size = now->size > 0 ? now->size : 1;
  PetscReal least;

  PetscFunctionBegin;
  PetscCall(RightSide(p, PETSC_FALSE, &least));
  PetscCall(HycoSystemSetVectors(p->contact.system, p->rhs, p->contact.D));
  HycoLogged(HYCO_EVENT_KKT, HycoSystemComputeKKT(p->contact.system, p->U, p->contact.Lambda, kkt));
  *worst = PetscMax(kkt->penetration, PetscMax(kkt->adhesion, kkt->complementarity));
  a->residual = now->residual[2] / size;
  kkt->rounding = now->residual[2] <= now->floor ? a->residual : 0;
  /* Below the floor the residual is no measure of equilibrium. */
  kkt->stationarity = kkt->rounding > 0 ? 0 : a->residual;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* log(r2 / r1) / log(r1 / r0), unless one of the three is round-off. Three residuals in the asymptotic range are
   needed. */
static void NewtonContractionOrder(const Progress *now, PetscInt k, HycoStepAttempt *a)
{
  const PetscReal *r = now->residual, least = 1e-13 * now->size + now->floor;

  if (k < 2 || !(r[2] > least) || !(r[2] < r[1]) || !(r[1] < 0.2 * r[0])) return;
  a->order = PetscLogReal(r[2] / r[1]) / PetscLogReal(r[1] / r[0]);
}

/* Whether a new tangent is cheaper than the iterations that the present one would need. Expected iterations by the
   last contraction rate against RENEW_FROM, in logarithms. */
static PetscBool NewtonIsStalling(HycoPath p, const Progress *now)
{
  const PetscReal *r = now->residual, target = PetscMax(p->rtol * now->size, now->floor), rate = r[2] / r[1];

  return (PetscBool)(p->kept > 0 && !(rate < 1 && PetscLogReal(target / r[2]) > RENEW_FROM * PetscLogReal(rate)));
}

/* Updates K at U. The evaluation at U gave no tangents; residuals are kept, as U is the same. For the modified method:
   a new tangent where the kept one contracts too slowly. */
static PetscErrorCode NewtonRenew(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a, Progress *now)
{
  const Progress here = *now;

  PetscFunctionBegin;
  PetscCall(NewtonEvaluate(p, t0, t1, PETSC_TRUE, a, now));
  *now = here;
  PetscCall(AssembleK(p, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterations of a step before it is halved, by HycoNewton; a step with at most half of them was easy. */
static const PetscInt usual_its[] = {0, 15, 60, 30};

/* One attempt: evaluate, test, assemble where needed, solve, advance. Ends with a->converged or a reason in a->why.
   least: the smallest residual so far, for the message; worst: of the contacts' conditions. */
static PetscErrorCode NewtonIterate(HycoPath p, PetscReal t0, PetscReal t1, HycoNewton method, HycoStepAttempt *a)
{
  const PetscBool tangent = (PetscBool)(method == HYCO_NEWTON_TANGENT);
  const PetscBool one = (PetscBool)(p->has_friction && !p->flows); /* one system is the solution */
  const PetscInt most = p->max_its ? p->max_its : one ? FRICTION_ITS : usual_its[method];
  Progress now = {.residual = {0, 0, 0}};
  PetscReal least = PETSC_MAX_REAL, worst = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; !a->why[0]; k++) {
    PetscBool fresh = PETSC_FALSE;

    PetscCall(NewtonEvaluate(p, t0, t1, tangent, a, &now));
    if (tangent && k) PetscCall(NewtonShorten(p, t0, t1, a, &now));
    if (a->law.failed) {
      HycoFormat(a->why, "%s", a->law.why);
      break;
    }
    if (tangent && !a->linear_its) NewtonContractionOrder(&now, k, a); /* else what the solves leave decides */
    if (k && now.residual[2] <= PetscMax(p->rtol * now.size, now.floor)) {
      PetscCall(NewtonJudge(p, &now, a, &worst));
      /* Of the contacts' residuals, which are relative. */
      a->converged = (PetscBool)(worst <= HYCO_RESIDUAL);
      if (a->converged && p->ops->judge) PetscCall((*p->ops->judge)(p, HYCO_CONVERGED, a->why));
      a->converged = (PetscBool)(a->converged && !a->why[0]);
      if (a->converged || a->why[0]) break;
    }
    if (k) least = PetscMin(least, now.residual[2] / (now.size > 0 ? now.size : 1));
    /* Or the iterates run away; NaN ends here too. */
    if (k == most || !(now.residual[2] <= 1e4 * PetscMax(now.size, now.floor))) {
      HycoFormat(a->why, "the residual of equilibrium is %.1e after %d iterations (%s)%s", (double)least, (int)k,
                 HycoNewtons[method], one ? ", as at the largest load that friction balances" : "");
      break;
    }
    if (method == HYCO_NEWTON_MODIFIED && k) fresh = NewtonIsStalling(p, &now);
    if (tangent) PetscCall(AssembleK(p, PETSC_TRUE));
    if (fresh) PetscCall(NewtonRenew(p, t0, t1, a, &now));
    PetscCall(SolveSystem(p, (PetscBool)(k == 0), &now, a));
    if (a->why[0]) break;
    if (tangent)
      PetscCall(NewtonAdvance(p, (PetscBool)(k > 0), a, &now));
    else
      PetscCall(NewtonExtrapolate(p, fresh ? 1 : k));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Undoes an attempt: U and Lambda of the last accepted time; states were never overwritten. */
PetscErrorCode HycoPathRestore(HycoPath p)
{

  PetscFunctionBegin;
  PetscCall(VecCopy(p->U_old, p->U));
  if (p->n_contacts) PetscCall(VecCopy(p->contact.L_old, p->contact.Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K is assembled here if it is elastic, else in the iterations. At the end of the step, t1: loads, gaps and
   temperatures of an implicit step (backward Euler). */
PetscErrorCode HycoPathAssemble(HycoPath p, PetscReal t1)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoSceneSetTime(p->scene, p->mu, t1, mu);
  PetscCall((*p->ops->assemble)(p, mu, (PetscBool)(HycoPathMethod(p) == HYCO_NEWTON_ELASTIC)));
  if (p->fe->stiffness_changed) p->tangent = PETSC_FALSE;
  PetscCall(HycoPathFrictionSetStep(p, t1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cost of a factorisation in units of a solve with it, by the growth of both with n_free. */
PetscReal HycoPathFactorCost(HycoPath p)
{
  return (p->fe->dim == 3 ? 0.15 : 0.03) * PetscSqrtReal((PetscReal)p->n_free);
}

/* From operation counts only, so that the choice is the same on any machine: the elastic variant needs up to five
   times as many iterations. */
HycoNewton HycoPathMethod(HycoPath p)
{
  if (!p->flows) return HYCO_NEWTON_ELASTIC;
  if (p->method != HYCO_NEWTON_AUTO) return (HycoNewton)p->method;
  return HycoPathFactorCost(p) > 5 ? HYCO_NEWTON_ELASTIC : HYCO_NEWTON_TANGENT;
}

/* A step from t0 to t1, U and Lambda in place. A variant with a kept K that fails is repeated with tangents before
   the step is halved. Collective. */
PetscErrorCode HycoPathAttempt(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a)
{
  HycoNewton method;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(a, sizeof(*a)));
  PetscCall(VecCopy(p->U, p->U_old));
  if (p->n_contacts) PetscCall(VecCopy(p->contact.Lambda, p->contact.L_old));
  PetscCall(HycoPathAssemble(p, t1));
  /* Models with an iteration of their own (bodies) need neither K nor its tangents here. */
  if (p->ops->iterate) {
    PetscCall((*p->ops->iterate)(p, t0, t1, a));
    if (!a->converged) PetscCall(HycoPathRestore(p));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  method = HycoPathMethod(p);
  if (p->tangent && method == HYCO_NEWTON_ELASTIC) {
    PetscCall(HycoFEElasticTangent(p->fe));
    PetscCall(AssembleK(p, PETSC_FALSE));
  }
  PetscCall(MatGetDiagonal(p->K, p->diagonal));
  PetscCall(NewtonIterate(p, t0, t1, method, a));
  if (!a->converged && p->flows && method != HYCO_NEWTON_TANGENT && p->method != HYCO_NEWTON_ELASTIC) {
    /* The first failure is forgotten; the second one is the reason. */
    a->why[0] = '\0';
    PetscCall(HycoPathRestore(p));
    PetscCall(NewtonIterate(p, t0, t1, HYCO_NEWTON_TANGENT, a));
  }
  a->easy = (PetscBool)(a->iterations <= usual_its[method] / 2);
  if (!a->converged) PetscCall(HycoPathRestore(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}
