/*
  hyco's types of Tao on the problem of any Tao: min f(x), lo <= x <= hi, by its gradient, Hessian and bounds. Newton's
  method: each iteration minimises the quadratic model f + g.d + d.H d / 2 within the bounds, exactly, and searches
  along the step d, which is feasible; so a quadratic f takes one iteration. The model is minimised by the primal-dual
  active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865-888): a set of 2 n bounds of which those in the
  set are closed, where the other unknowns solve the block of H that an IS selects; or, n bounds from below, by Lemke's
  method. Convergence is decided by the projected gradient at the new x, by TAO's test. Without an objective (H need not
  be symmetric then: a variational inequality) the steps are full.
*/
#include <hycotao.h>

/* The model at the iterate x. */
typedef struct {
  Tao tao;
  Mat H;
  Vec x, g, lo, hi; /* of the Tao */
  Vec d, w, p;      /* the step, its gradient w = g + H d; work */
  PetscReal f;
  PetscInt n, first; /* unknowns of this rank */
  PetscBool objective;
} Model;

/* Fills with this rank's free unknowns: those with no bound in the set. Global numbers, as the block of H is
   selected by them. */
static PetscErrorCode TaoNewtonFree(const Model *m, const PetscBool active[], IS *is, PetscInt *n_free)
{
  PetscInt k = 0, *rows;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n, &rows));
  for (PetscInt i = 0; i < m->n; i++) {
    /* Two entries for each unknown: its lower and its upper bound. */
    if (!active[2 * i] && !active[2 * i + 1]) rows[k++] = m->first + i;
  }
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)m->x), k, rows, PETSC_OWN_POINTER, is));
  PetscCall(ISGetSize(*is, n_free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* d = bound - x on the set, 0 elsewhere. */
static PetscErrorCode TaoNewtonClose(const Model *m, const PetscBool active[])
{
  const PetscScalar *x, *lo, *hi;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(m->x, &x));
  PetscCall(VecGetArrayRead(m->lo, &lo));
  PetscCall(VecGetArrayRead(m->hi, &hi));
  PetscCall(VecGetArrayWrite(m->d, &d));
  for (PetscInt i = 0; i < m->n; i++) d[i] = active[2 * i] ? lo[i] - x[i] : active[2 * i + 1] ? hi[i] - x[i] : 0;
  PetscCall(VecRestoreArrayWrite(m->d, &d));
  PetscCall(VecRestoreArrayRead(m->x, &x));
  PetscCall(VecRestoreArrayRead(m->lo, &lo));
  PetscCall(VecRestoreArrayRead(m->hi, &hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The block of H on the free unknowns; parallel dense ones as AIJ, which has a factor. A matrix without entries has
   none: conjugate gradients, unless options say otherwise. The block's pattern changes with the set: a new factor
   for each. */
static PetscErrorCode SetBlock(const Model *m, IS is)
{
  KSP ksp = m->tao->ksp;
  Mat block;
  PC pc;
  PetscBool rows, dense;

  PetscFunctionBegin;
  PetscCall(MatCreateSubMatrix(m->H, is, is, MAT_INITIAL_MATRIX, &block));
  PetscCall(MatHasOperation(m->H, MATOP_GET_ROW, &rows));
  PetscCall(PetscObjectTypeCompare((PetscObject)block, MATMPIDENSE, &dense));
  if (dense) PetscCall(MatConvert(block, MATAIJ, MAT_INPLACE_MATRIX, &block));
  /* The size of the block differs from that of the last set. */
  PetscCall(KSPReset(ksp));
  PetscCall(KSPSetOperators(ksp, block, block));
  PetscCall(KSPGetPC(ksp, &pc));
  if (!rows) {
    PetscCall(KSPSetType(ksp, KSPCG));
    PetscCall(KSPSetTolerances(ksp, 1e-12, 0, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(PCSetType(pc, PCNONE));
  }
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(MatDestroy(&block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* d on the free unknowns, where w = 0. A singular block or a diverged solve ends the iteration. */
static PetscErrorCode SolveFree(const Model *m, IS is, PetscBool *singular)
{
  KSPConvergedReason why;
  PetscReal size;
  Vec rhs, y;

  PetscFunctionBegin;
  PetscCall(SetBlock(m, is));
  PetscCall(VecGetSubVector(m->w, is, &rhs));
  PetscCall(VecDuplicate(rhs, &y));
  PetscCall(KSPSolve(m->tao->ksp, rhs, y));
  PetscCall(VecRestoreSubVector(m->w, is, &rhs));
  PetscCall(KSPGetConvergedReason(m->tao->ksp, &why));
  PetscCall(VecNorm(y, NORM_2, &size));
  /* An iteration limit leaves an inexact step, which the line search judges. */
  *singular = (PetscBool)((why < 0 && why != KSP_DIVERGED_ITS) || PetscIsInfOrNanReal(size));
  PetscCall(VecScale(y, -1));
  if (!*singular) PetscCall(VecISCopy(m->d, is, SCATTER_FORWARD, y));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = g + H d is the multiplier on the set, and 0 on the free unknowns. */
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  const Model *m = (const Model *)ctx;
  PetscInt n_free;
  IS is;

  PetscFunctionBegin;
  PetscCall(TaoNewtonClose(m, active));
  PetscCall(MatMultAdd(m->H, m->d, m->g, m->w));
  PetscCall(TaoNewtonFree(m, active, &is, &n_free));
  *singular = PETSC_FALSE;
  if (n_free) PetscCall(SolveFree(m, is, singular));
  PetscCall(ISDestroy(&is));
  /* d has changed on the free unknowns; n_free is the number over all ranks, so that all take the same branch. */
  if (n_free) PetscCall(MatMultAdd(m->H, m->d, m->g, m->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Beyond round-off: free unknowns outside a bound, and bounds in the set whose multiplier has the wrong sign. */
static PetscErrorCode TaoNewtonViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Model *m = (const Model *)ctx;
  const PetscScalar *p, *w, *lo, *hi;
  PetscReal size_x, size_g, size_w;

  PetscFunctionBegin;
  PetscCall(VecWAXPY(m->p, 1, m->d, m->x));
  PetscCall(VecNorm(m->p, NORM_INFINITY, &size_x));
  PetscCall(VecNorm(m->g, NORM_INFINITY, &size_g));
  PetscCall(VecNorm(m->w, NORM_INFINITY, &size_w));
  size_w = 1e-12 * PetscMax(size_w, size_g);
  size_x *= 1e-13;
  PetscCall(VecGetArrayRead(m->p, &p));
  PetscCall(VecGetArrayRead(m->w, &w));
  PetscCall(VecGetArrayRead(m->lo, &lo));
  PetscCall(VecGetArrayRead(m->hi, &hi));
  for (PetscInt i = 0; i < m->n; i++) {
    const PetscBool below = active[2 * i], above = active[2 * i + 1];

    /* Equal bounds fix the unknown, whose multiplier may have either sign. */
    violates[2 * i] = (PetscBool)(below ? w[i] < -size_w && lo[i] < hi[i] : !above && p[i] < lo[i] - size_x);
    violates[2 * i + 1] = (PetscBool)(above ? w[i] > size_w && lo[i] < hi[i] : !below && p[i] > hi[i] + size_x);
  }
  PetscCall(VecRestoreArrayRead(m->p, &p));
  PetscCall(VecRestoreArrayRead(m->w, &w));
  PetscCall(VecRestoreArrayRead(m->lo, &lo));
  PetscCall(VecRestoreArrayRead(m->hi, &hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |x - median(lo, x - g, hi)|, 0 at a solution; also for the model: x + d, w. Overwrites p. The measure of
   optimality for bounds, by which TAO's tolerances are tested. */
static PetscErrorCode ProjectedGradient(const Model *m, Vec x, Vec g, PetscReal *size)
{
  PetscFunctionBegin;
  PetscCall(VecWAXPY(m->p, -1, g, x));
  PetscCall(VecMedian(m->lo, m->p, m->hi, m->p));
  PetscCall(VecAXPY(m->p, -1, x));
  PetscCall(VecNorm(m->p, NORM_2, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Passes an iterate to TAO's history and monitors. */
static PetscErrorCode TaoNewtonShow(const Model *m, PetscReal f, PetscReal residual, PetscReal step)
{
  PetscInt linear_its = 0;

  PetscFunctionBegin;
  if (m->tao->ksp) PetscCall(KSPGetTotalIterations(m->tao->ksp, &linear_its));
  PetscCall(TaoLogConvergenceHistory(m->tao, f, residual, 0, linear_its));
  PetscCall(TaoMonitor(m->tao, m->tao->niter, f, residual, 0, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One solve on a set: the model's value and projected gradient, those of a quadratic f itself. An iteration of the
   inner loop counts as one of the Tao. */
static PetscErrorCode TaoNewtonMonitor(PetscInt its, PetscInt n_active, PetscInt changes, void *ctx)
{
  const Model *m = (const Model *)ctx;
  PetscReal residual, gd, wd;
  Vec y;

  PetscFunctionBegin;
  (void)its, (void)n_active;
  m->tao->niter++;
  /* The last set's step is measured by TaoNewtonMove() on f itself. */
  if (!changes) PetscFunctionReturn(PETSC_SUCCESS); /* shown after the step */
  PetscCall(VecDuplicate(m->x, &y));
  PetscCall(VecWAXPY(y, 1, m->d, m->x));
  PetscCall(ProjectedGradient(m, y, m->w, &residual));
  PetscCall(VecDot(m->g, m->d, &gd));
  PetscCall(VecDot(m->w, m->d, &wd));
  PetscCall(VecDestroy(&y));
  PetscCall(TaoNewtonShow(m, m->f + (gd + wd) / 2, residual, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bounds on which x lies, and which hold it. A bound with a gradient that pushes away from it is not in the set. */
static PetscErrorCode StartSet(const Model *m, PetscBool active[])
{
  const PetscScalar *x, *g, *lo, *hi;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(m->x, &x));
  PetscCall(VecGetArrayRead(m->g, &g));
  PetscCall(VecGetArrayRead(m->lo, &lo));
  PetscCall(VecGetArrayRead(m->hi, &hi));
  for (PetscInt i = 0; i < m->n; i++) {
    /* An unknown whose bounds coincide is always on one. */
    active[2 * i] = (PetscBool)(x[i] <= lo[i] && (g[i] > 0 || lo[i] >= hi[i]));
    active[2 * i + 1] = (PetscBool)(!active[2 * i] && x[i] >= hi[i] && g[i] < 0);
  }
  PetscCall(VecRestoreArrayRead(m->x, &x));
  PetscCall(VecRestoreArrayRead(m->g, &g));
  PetscCall(VecRestoreArrayRead(m->lo, &lo));
  PetscCall(VecRestoreArrayRead(m->hi, &hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The limit is what is left of the Tao's iterations. */
static PetscErrorCode StepByActiveSet(Model *m, HycoLCPStatus *status)
{
  HycoActiveSet set = {.comm = PetscObjectComm((PetscObject)m->x),
                       .first = 2 * m->first,
                       .n = 2 * m->n,
                       .max_its = PetscMax(1, m->tao->max_it - m->tao->niter),
                       .one_by_one = PETSC_TRUE,
                       .ctx = m,
                       .solve = SolveOnSet,
                       .violations = TaoNewtonViolations,
                       .monitor = TaoNewtonMonitor,
                       .monitor_ctx = m};
  PetscBool *active;
  PetscInt its;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(set.n, &active));
  /* Newton's iterates settle on one set of bounds, so that late steps begin with theirs. */
  PetscCall(StartSet(m, active));
  PetscCall(HycoActiveSetRun(&set, active, &its, status));
  PetscCall(PetscFree(active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All of H on every rank, column major. Dense on every rank: Lemke's method is sequential. */
static PetscErrorCode GatherHessian(Mat H, PetscInt N, PetscReal M[])
{
  const PetscScalar *entries;
  Mat dense, *whole;
  IS all;

  PetscFunctionBegin;
  /* Any matrix type of the program, also a shell with entries by products. */
  PetscCall(MatConvert(H, MATDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, N, 0, 1, &all));
  PetscCall(MatCreateSubMatrices(dense, 1, &all, &all, MAT_INITIAL_MATRIX, &whole));
  PetscCall(MatDenseGetArrayRead(whole[0], &entries));
  PetscCall(PetscArraycpy(M, entries, (size_t)N * (size_t)N));
  PetscCall(MatDenseRestoreArrayRead(whole[0], &entries));
  PetscCall(MatDestroySubMatrices(1, &whole));
  HycoDestroyAll(&all, &dense);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = x + d - lo: w = q + H z >= 0, z >= 0, w.z = 0 with q = g + H (lo - x). All ranks compute the same z, and each
   takes its part. */
static PetscErrorCode StepByLemke(Model *m, HycoLCPStatus *status)
{
  PetscScalar *d;
  PetscReal *M, *q, *z;
  PetscInt N, its;

  PetscFunctionBegin;
  PetscCall(VecGetSize(m->x, &N));
  PetscCall(PetscCalloc3((size_t)N * (size_t)N, &M, N, &q, N, &z));
  PetscCall(GatherHessian(m->H, N, M));
  /* d = lo - x: then w = g + H (lo - x) is q. */
  PetscCall(VecWAXPY(m->d, -1, m->x, m->lo));
  PetscCall(MatMultAdd(m->H, m->d, m->g, m->w));
  PetscCall(HycoVecGather(m->w, q));
  PetscCall(HycoLCPLemke(N, M, q, PetscMax(1, m->tao->max_it - m->tao->niter), z, &its, status));
  m->tao->niter += its;
  PetscCall(VecGetArray(m->d, &d));
  for (PetscInt i = 0; i < m->n; i++) d[i] += z[m->first + i];
  PetscCall(VecRestoreArray(m->d, &d));
  PetscCall(PetscFree3(M, q, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f and its gradient at x. f is not needed without a line search. */
static PetscErrorCode TaoNewtonEvaluate(Model *m)
{
  PetscFunctionBegin;
  if (m->objective)
    PetscCall(TaoComputeObjectiveAndGradient(m->tao, m->x, &m->f, m->g));
  else
    PetscCall(TaoComputeGradient(m->tao, m->x, m->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves x along d, within the bounds, by the first of 1, 1/2, 1/4, ... with a sufficient decrease of f beyond
   *round-off; step: that share of d, 0 if there is none; *small: it does not change x beyond round-off. x + d is
   projected first, as round-off may leave the bounds. */
static PetscErrorCode TaoNewtonMove(Model *m, PetscReal *step, PetscBool *small)
{
  const PetscReal before = m->f;
  PetscReal slope, size_x, size_d;

  PetscFunctionBegin;
  PetscCall(VecCopy(m->x, m->p));
  PetscCall(VecAXPY(m->x, 1, m->d));
  PetscCall(VecMedian(m->lo, m->x, m->hi, m->x));
  PetscCall(VecWAXPY(m->d, -1, m->p, m->x));
  PetscCall(VecDot(m->g, m->d, &slope));
  PetscCall(VecNorm(m->x, NORM_INFINITY, &size_x));
  PetscCall(VecNorm(m->d, NORM_INFINITY, &size_d));
  *small = (PetscBool)(size_d <= 1e-12 * size_x);
  for (*step = 1; m->objective && *step > 1e-10; *step /= 2) {
    PetscCall(VecWAXPY(m->x, *step, m->d, m->p));
    PetscCall(TaoComputeObjective(m->tao, m->x, &m->f));
    /* Armijo's condition; near the solution decreases are below the round-off of f. */
    if (m->f <= before + 1e-4 * *step * PetscMin(slope, 0) + 1e-13 * PetscAbsReal(before)) break;
  }
  if (*step <= 1e-10) {
    *step = 0;
    PetscCall(VecCopy(m->p, m->x));
  }
  PetscCall(TaoNewtonEvaluate(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One Newton iteration. Stops are TAO's tests, a step at round-off, or a line search without decrease. */
static PetscErrorCode TaoNewtonIterate(Model *m, PetscErrorCode (*minimise)(Model *, HycoLCPStatus *))
{
  Tao tao = m->tao;
  HycoLCPStatus status;
  PetscReal step = 0, residual;
  PetscBool small = PETSC_FALSE;

  PetscFunctionBegin;
  /* The user's hook of TaoSetUpdate(), as in TAO's own types. */
  if (tao->ops->update) PetscCall((*tao->ops->update)(tao, tao->niter, tao->user_update));
  PetscCall(TaoComputeHessian(tao, m->x, tao->hessian, tao->hessian_pre));
  PetscCall(minimise(m, &status));
  if (status == HYCO_LCP_SINGULAR || status == HYCO_LCP_RAY) {
    tao->reason = TAO_DIVERGED_USER;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(TaoNewtonMove(m, &step, &small));
  PetscCall(ProjectedGradient(m, m->x, m->g, &residual));
  PetscCall(TaoNewtonShow(m, m->f, residual, step));
  PetscCall((*tao->ops->convergencetest)(tao, tao->cnvP));
  if (tao->reason != TAO_CONTINUE_ITERATING) PetscFunctionReturn(PETSC_SUCCESS);
  if (small)
    tao->reason = TAO_CONVERGED_STEPTOL;
  else if (step == 0)
    tao->reason = TAO_DIVERGED_LS_FAILURE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the Tao must have, and its default: no bounds. */
static PetscErrorCode TaoNewtonRead(Tao tao, PetscBool lemke, Model *m)
{
  PetscReal least, most;
  PetscBool with_gradient;

  PetscFunctionBegin;
  PetscCheck(tao->hessian, PetscObjectComm((PetscObject)tao), PETSC_ERR_ORDER,
             "the Tao has no Hessian, which %s needs; call TaoSetHessian() before TaoSolve()",
             ((PetscObject)tao)->type_name);
  *m = (Model){.tao = tao, .H = tao->hessian, .x = tao->solution};
  if (!tao->gradient) PetscCall(VecDuplicate(m->x, &tao->gradient));
  if (!tao->XL) {
    PetscCall(VecDuplicate(m->x, &tao->XL));
    PetscCall(VecSet(tao->XL, PETSC_NINFINITY));
  }
  if (!tao->XU) {
    PetscCall(VecDuplicate(m->x, &tao->XU));
    PetscCall(VecSet(tao->XU, PETSC_INFINITY));
  }
  /* After the defaults: a routine of the user's may set bounds at each solve. */
  PetscCall(TaoComputeVariableBounds(tao));
  m->g = tao->gradient;
  m->lo = tao->XL;
  m->hi = tao->XU;
  PetscCall(VecMin(m->lo, NULL, &least));
  PetscCall(VecMin(m->hi, NULL, &most));
  PetscCheck(!lemke || (least > PETSC_NINFINITY && most >= PETSC_INFINITY), PetscObjectComm((PetscObject)tao),
             PETSC_ERR_SUP,
             "%s needs a finite lower bound of every unknown, and no upper one; use " HYCO_TAO_ACTIVE_SET,
             ((PetscObject)tao)->type_name);
  PetscCall(VecGetLocalSize(m->x, &m->n));
  PetscCall(VecGetOwnershipRange(m->x, &m->first, NULL));
  PetscCall(TaoIsObjectiveDefined(tao, &m->objective));
  PetscCall(TaoIsObjectiveAndGradientDefined(tao, &with_gradient));
  m->objective = (PetscBool)(m->objective || with_gradient);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The general method of both types for a Tao of any program. Collective. */
PetscErrorCode HycoTaoNewton(Tao tao, PetscBool lemke)
{
  Model m;
  PetscReal residual;

  PetscFunctionBegin;
  PetscCall(TaoNewtonRead(tao, lemke, &m));
  HycoVecDuplicate(m.x, &m.d, &m.w, &m.p);
  /* The start is projected onto the bounds. */
  PetscCall(VecMedian(m.lo, m.x, m.hi, m.x));
  PetscCall(PetscObjectStateIncrease((PetscObject)m.x)); /* VecMedian() does not on ranks without rows, whose cached
                                                            norm would then remain, and only there */
  PetscCall(TaoNewtonEvaluate(&m));
  PetscCall(ProjectedGradient(&m, m.x, m.g, &residual));
  tao->reason = TAO_CONTINUE_ITERATING;
  PetscCall(TaoNewtonShow(&m, m.f, residual, 0));
  PetscCall((*tao->ops->convergencetest)(tao, tao->cnvP));
  while (tao->reason == TAO_CONTINUE_ITERATING) PetscCall(TaoNewtonIterate(&m, lemke ? StepByLemke : StepByActiveSet));
  HycoDestroyAll(&m.d, &m.w, &m.p);
  PetscFunctionReturn(PETSC_SUCCESS);
}
