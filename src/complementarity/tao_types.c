/*
  hyco's complementarity methods as Tao types: HYCO_TAO_ACTIVE_SET and HYCO_TAO_LEMKE. They read the unscaled problem
  from the HycoTao. Their monitor shows the number of active contacts as the function value and the number of changes as
  the residual.
*/
#include <hycotao.h>

static PetscErrorCode GetProblem(Tao tao, HycoTao *t)
{
  PetscFunctionBegin;
  PetscCall(TaoGetApplicationContext(tao, t));
  PetscCheck(*t && (*t)->tao == tao, PetscObjectComm((PetscObject)tao), PETSC_ERR_ARG_WRONGSTATE,
             "hyco's types of Tao work inside HycoSolver only; use -hyco_solver_type");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Passes an iteration of the active set to TAO's monitors and the user's. */
static PetscErrorCode Monitor(PetscInt its, PetscInt n_active, PetscInt changes, void *ctx)
{
  const HycoTao t = (HycoTao)ctx;

  PetscFunctionBegin;
  t->tao->niter = its;
  PetscCall(TaoLogConvergenceHistory(t->tao, n_active, changes, 0, 0));
  PetscCall(TaoMonitor(t->tao, its, n_active, changes, 0, 1));
  if (t->monitor) PetscCall(t->monitor(its, n_active, changes, t->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void SetReason(const HycoTao t)
{
  t->tao->niter = t->its;
  t->tao->reason = t->status == HYCO_LCP_SOLVED  ? TAO_CONVERGED_USER
                   : t->status == HYCO_LCP_LIMIT ? TAO_DIVERGED_MAXITS
                                                 : TAO_DIVERGED_USER;
}

static PetscErrorCode SolveActiveSet(Tao tao)
{
  HycoTao t;
  PetscBool watched;

  PetscFunctionBegin;
  PetscCall(GetProblem(tao, &t));
  watched = (PetscBool)(t->monitor || tao->numbermonitors || tao->hist_max);
  if (t->lcp) {
    HycoLCP lcp = *t->lcp;

    lcp.max_its = tao->max_it;
    lcp.monitor = watched ? Monitor : NULL;
    lcp.monitor_ctx = t;
    PetscCall(HycoLCPActiveSet(&lcp, t->active, t->z, &t->its, &t->status));
  } else {
    HycoActiveSet set = *t->set;

    set.max_its = tao->max_it;
    set.monitor = watched ? Monitor : NULL;
    set.monitor_ctx = t;
    PetscCall(HycoActiveSetRun(&set, t->active, &t->its, &t->status));
  }
  SetReason(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveLemke(Tao tao)
{
  HycoTao t;

  PetscFunctionBegin;
  PetscCall(GetProblem(tao, &t));
  PetscCheck(t->lcp && !t->lcp->p, PetscObjectComm((PetscObject)tao), PETSC_ERR_SUP,
             "Lemke's method needs a dense matrix, and no free unknowns");
  PetscCall(HycoLCPLemke(t->lcp->n, t->lcp->M, t->lcp->q, tao->max_it, t->z, &t->its, &t->status));
  SetReason(t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateActiveSet(Tao tao)
{
  PetscFunctionBegin;
  tao->ops->solve = SolveActiveSet;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateLemke(Tao tao)
{
  PetscFunctionBegin;
  tao->ops->solve = SolveLemke;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTaoRegisterAll(void)
{
  PetscErrorCode (*create)(Tao);

  PetscFunctionBegin;
  PetscCall(TaoInitializePackage());
  PetscCall(PetscFunctionListFind(TaoList, HYCO_TAO_LEMKE, &create));
  if (create) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TaoRegister(HYCO_TAO_ACTIVE_SET, CreateActiveSet));
  PetscCall(TaoRegister(HYCO_TAO_LEMKE, CreateLemke));
  PetscFunctionReturn(PETSC_SUCCESS);
}
