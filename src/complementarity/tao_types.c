/*
  hyco's complementarity methods as Tao types: HYCO_TAO_ACTIVE_SET and HYCO_TAO_LEMKE, and HYCO_TAO_SEMISMOOTH_NEWTON
  for the blocks of contact systems. In any program the first two solve the problem of the Tao (tao_newton.c). A form of
  HycoSolver knows more than a Hessian says: how to solve on a set with a factor, multigrid or coarser problems that it
  keeps. It therefore attaches a HycoTao as the type's data, whose functions take the place of the general ones: they
  solve, and the bounds are those of the Tao here too. The problem is unscaled; the monitor shows the number of active
  contacts as the function value and the number of changes as the residual.
*/
#include <hycotao.h>

/* Passes an iteration of the active set to TAO's monitors and the user's. */
static PetscErrorCode TaoTypeMonitor(PetscInt its, PetscInt n_active, PetscInt changes, void *ctx)
{
  const HycoTao t = (HycoTao)ctx;

  PetscFunctionBegin;
  t->tao->niter = its;
  PetscCall(TaoLogConvergenceHistory(t->tao, n_active, changes, 0, 0));
  PetscCall(TaoMonitor(t->tao, its, n_active, changes, 0, 1));
  if (t->monitor) PetscCall(t->monitor(its, n_active, changes, t->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's reason, for -tao_converged_reason; the caller reads t->status. */
static void SetReason(const HycoTao t)
{
  t->tao->niter = t->its;
  t->tao->reason = t->status == HYCO_LCP_SOLVED  ? TAO_CONVERGED_USER
                   : t->status == HYCO_LCP_LIMIT ? TAO_DIVERGED_MAXITS
                                                 : TAO_DIVERGED_USER;
}

/* Reads the bounds lo <= z of a form's dense problem from the Tao. *q: its constant term for z - lo where a bound is
   not 0, otherwise NULL. */
static PetscErrorCode ReadBounds(Tao tao, const HycoLCP *lcp, PetscReal **q)
{
  const PetscInt n = lcp->p + lcp->n;
  const PetscScalar *lo, *hi;
  PetscInt bad = -1;

  PetscFunctionBegin;
  *q = NULL;
  PetscCall(VecGetArrayRead(tao->XL, &lo));
  PetscCall(VecGetArrayRead(tao->XU, &hi));
  for (PetscInt i = 0; i < n; i++) {
    /* The methods know lower bounds of forces alone. */
    if (hi[i] < PETSC_INFINITY || (lo[i] > PETSC_NINFINITY) != (i >= lcp->p)) bad = i;
    if (i >= lcp->p && lo[i] != 0 && !*q) HycoDuplicate((size_t)n, lcp->q, q);
  }
  PetscCheck(bad < 0, PetscObjectComm((PetscObject)tao), PETSC_ERR_SUP,
             "%s on a dense problem: unknown %d of %d has the bounds %g and %g; expected: no bounds of the first %d, a "
             "finite lower one and no upper one of the others",
             ((PetscObject)tao)->type_name, (int)bad, (int)n, (double)lo[bad], (double)hi[bad], (int)lcp->p);
  for (PetscInt j = lcp->p; j < n && *q; j++) {
    /* q + M lo: the problem in z - lo, whose bounds are 0. */
    for (PetscInt i = 0; i < n; i++) (*q)[i] += lcp->M[(size_t)j * (size_t)n + (size_t)i] * lo[j];
  }
  PetscCall(VecRestoreArrayRead(tao->XL, &lo));
  PetscCall(VecRestoreArrayRead(tao->XU, &hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A form's dense problem by one of the methods, within the bounds of the Tao; cones have their own laws. */
static PetscErrorCode SolveDense(Tao tao, PetscErrorCode (*method)(HycoTao, const HycoLCP *))
{
  const HycoTao t = (HycoTao)tao->data;
  HycoLCP lcp = *t->lcp;
  PetscReal *q = NULL;
  const PetscScalar *lo;

  PetscFunctionBegin;
  if (!lcp.blocks) PetscCall(ReadBounds(tao, &lcp, &q));
  if (q) lcp.q = q;
  lcp.monitor = t->monitor || tao->numbermonitors || tao->hist_max ? TaoTypeMonitor : NULL;
  lcp.monitor_ctx = t;
  PetscCall(method(t, &lcp));
  SetReason(t);
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(tao->XL, &lo));
  /* Back from z - lo. */
  for (PetscInt i = lcp.p; i < lcp.p + lcp.n; i++) t->z[i] += lo[i];
  PetscCall(VecRestoreArrayRead(tao->XL, &lo));
  PetscCall(PetscFree(q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DenseActiveSet(HycoTao t, const HycoLCP *lcp)
{
  HycoLCP limited = *lcp;

  PetscFunctionBegin;
  limited.max_its = t->tao->max_it;
  PetscCall(HycoLCPActiveSet(&limited, t->active, t->z, &t->its, &t->status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a HycoTao as data the form's problem, otherwise that of the Tao. */
static PetscErrorCode SolveActiveSet(Tao tao)
{
  const HycoTao t = (HycoTao)tao->data;

  PetscFunctionBegin;
  if (!t)
    PetscCall(HycoTaoNewton(tao, PETSC_FALSE));
  else if (t->lcp)
    PetscCall(SolveDense(tao, DenseActiveSet));
  else {
    HycoActiveSet set = *t->set;

    set.max_its = tao->max_it;
    set.monitor = t->monitor || tao->numbermonitors || tao->hist_max ? TaoTypeMonitor : NULL;
    set.monitor_ctx = t;
    /* The form reads the bounds where a Tao has them: a program may have set others. */
    if (set.bounds) PetscCall(set.bounds(set.ctx, tao->XL, tao->XU));
    PetscCall(HycoActiveSetRun(&set, t->active, &t->its, &t->status));
    SetReason(t);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The iteration limit counts pivots. */
static PetscErrorCode DenseLemke(HycoTao t, const HycoLCP *lcp)
{
  PetscFunctionBegin;
  if (lcp->p)
    PetscCall(HycoLCPLemkeFree(lcp, t->tao->max_it, t->z, &t->its, &t->status));
  else
    PetscCall(HycoLCPLemke(lcp->n, lcp->M, lcp->q, t->tao->max_it, t->z, &t->its, &t->status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a dense problem behind it the Tao is one of a program: its Hessian is made dense, in Newton's loop. */
static PetscErrorCode SolveLemke(Tao tao)
{
  const HycoTao t = (HycoTao)tao->data;

  PetscFunctionBegin;
  if (!t) {
    PetscCall(HycoTaoNewton(tao, PETSC_TRUE));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(t->lcp, PetscObjectComm((PetscObject)tao), PETSC_ERR_SUP, "Lemke's method needs a dense matrix");
  PetscCall(SolveDense(tao, DenseLemke));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Starts from the forces of the last solution, or from none; the new ones are kept. */
static PetscErrorCode DenseSemismooth(HycoTao t, const HycoLCP *of)
{
  HycoLCP limited = *of;
  const HycoLCP *lcp = &limited;

  PetscFunctionBegin;
  limited.max_its = t->max_its;
  if (lcp->given && lcp->warm) {
    /* z is the start */
  } else if (lcp->warm && t->n_last == lcp->p + lcp->n && t->last)
    PetscCall(PetscArraycpy(t->z, t->last, t->n_last));
  else
    /* Without a start that fits, none: the chain of starts then begins with the normal forces. */
    PetscCall(PetscArrayzero(t->z, lcp->p + lcp->n));
  PetscCall(HycoLCPSemismooth(lcp, t->z, &t->its, &t->status));
  /* Forces of a failed solve would be a bad start: the last good ones stay. */
  if (t->status != HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(t->last));
  t->n_last = lcp->p + lcp->n;
  HycoDuplicate(t->n_last, t->z, &t->last);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z is the start of the next problem of the same size. */
static PetscErrorCode SolveSemismooth(Tao tao)
{
  const HycoTao t = (HycoTao)tao->data;

  PetscFunctionBegin;
  PetscCheck(t && t->lcp, PetscObjectComm((PetscObject)tao), PETSC_ERR_SUP,
             HYCO_TAO_SEMISMOOTH_NEWTON " solves contact systems of a HycoSolver; for bounds use " HYCO_TAO_ACTIVE_SET);
  PetscCall(SolveDense(tao, DenseSemismooth));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -..tao_ksp_, whose name TAO leaves to the type: without prefix for some; tao_bnk_ksp_, tao_bqnk_ksp_ of TAO's Newton
   types. */
PetscErrorCode HycoTaoSetKSPPrefix(Tao tao)
{
  /* Not yet there while a type is made: one of hyco's. */
  const char *type = ((PetscObject)tao)->type_name ? ((PetscObject)tao)->type_name : "";
  const PetscBool quasi = (PetscBool)!strncmp(type, "bqnk", 4);

  PetscFunctionBegin;
  if (!tao->ksp) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOptionsPrefix(tao->ksp, ((PetscObject)tao)->prefix));
  PetscCall(KSPAppendOptionsPrefix(tao->ksp, quasi                                              ? "tao_bqnk_"
                                             : !strncmp(type, "bn", 2) && strcmp(type, TAOBNCG) ? "tao_bnk_"
                                                                                                : "tao_"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver of the free unknowns' block: a factor, or -tao_ksp_type, -tao_pc_type. */
static PetscErrorCode CreateKSP(Tao tao)
{
  PetscMPIInt size;
  PC pc;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)tao), &size));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)tao), &tao->ksp));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)tao->ksp, (PetscObject)tao, 1));
  PetscCall(HycoTaoSetKSPPrefix(tao));
  PetscCall(KSPSetType(tao->ksp, KSPPREONLY));
  PetscCall(KSPGetPC(tao->ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  /* PETSc's own LU is for one process. */
  if (size > 1) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TaoTypeCreate(Tao tao, PetscErrorCode (*solve)(Tao))
{
  PetscFunctionBegin;
  PetscCall(TaoParametersInitialize(tao));
  tao->ops->solve = solve;
  tao->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For any program: -tao_type with this name. */
static PetscErrorCode CreateActiveSet(Tao tao)
{
  PetscFunctionBegin;
  PetscCall(TaoTypeCreate(tao, SolveActiveSet));
  PetscCall(CreateKSP(tao));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No KSP: pivots need none. */
static PetscErrorCode CreateLemke(Tao tao)
{
  return TaoTypeCreate(tao, SolveLemke);
}

/* Only with a HycoTao as data, which has the blocks. */
static PetscErrorCode CreateSemismooth(Tao tao)
{
  return TaoTypeCreate(tao, SolveSemismooth);
}

/* Once, by the package's start; a second registration replaces the first. */
PetscErrorCode HycoTaoRegisterAll(void)
{
  PetscFunctionBegin;
  PetscCall(TaoInitializePackage());
  PetscCall(TaoRegister(HYCO_TAO_ACTIVE_SET, CreateActiveSet));
  PetscCall(TaoRegister(HYCO_TAO_LEMKE, CreateLemke));
  PetscCall(TaoRegister(HYCO_TAO_SEMISMOOTH_NEWTON, CreateSemismooth));
  PetscFunctionReturn(PETSC_SUCCESS);
}
