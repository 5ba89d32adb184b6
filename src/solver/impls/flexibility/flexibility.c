/*
  Systems with a given flexibility: w = g + G L, dense on one process, without displacements. The factor of G on the
  active contacts is kept from one solve to the next while G is unchanged.
*/
#include <hycosolverimpl.h>

typedef struct {
  PetscInt m;
  PetscBool *active;
  PetscBool started; /* active is the set of a solution */
  HycoSetFactor factor;
  HycoConeFactor cone;
  HycoOperatorState of;
  HycoTao tao;
} Flexibility;

/* The only form for a given G. */
static PetscErrorCode FlexibilityAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                         char why[HYCO_LINE])
{
  PetscFunctionBegin;
  (void)form, (void)asked, (void)why;
  *cost = s->system->G ? 0 : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *singular stays false: a singular block of G appears only once a set is solved. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  Flexibility *f = (Flexibility *)form->data;
  HycoSystem y = s->system;
  PetscBool same;

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  if (f->m != y->m || !f->active) {
    PetscCall(PetscFree(f->active));
    PetscCall(HycoSetFactorDestroy(&f->factor));
    PetscCall(PetscCalloc1(y->m + 1, &f->active));
    PetscCall(HycoSetFactorCreate(y->m, &f->factor));
    f->m = y->m;
    f->started = PETSC_FALSE;
  }
  /* The factor of the active set belongs to the former G. */
  PetscCall(HycoOperatorStateUpdate(&f->of, y->G, NULL, &same));
  if (!same) HycoSetFactorForget(f->factor);
  if (!same) HycoConeFactorForget(f->cone);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Starts from the given set, else from that of the last solution. */
static PetscErrorCode FlexibilitySolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Flexibility *f = (Flexibility *)form->data;
  HycoSystem y = s->system;
  HycoLCP lcp = {.n = y->m,
                 .symmetric = PETSC_TRUE,
                 .blocks = y->blocks,
                 .sign = y->blocks ? &s->sign : NULL,
                 .warm = s->warm,
                 .given = (PetscBool)(y->blocks != NULL),
                 .monitor = s->monitor,
                 .monitor_ctx = s->monitor_ctx};
  PetscScalar *l;
  PetscBool singular;

  PetscFunctionBegin;
  (void)x;
  PetscCall(SetUp(s, form, &singular));
  PetscCall(HycoSolverNameMethod(s, "condensed"));
  /* A given set counts for the first method alone: a fallback starts from none, as the set may be what has failed. */
  if (s->start_set && !s->falling_back)
    PetscCall(PetscArraycpy(f->active, s->start_set, f->m));
  else if (!s->start_set && (!s->warm || !f->started))
    PetscCall(PetscArrayzero(f->active, f->m));
  if (y->blocks && !f->cone) PetscCall(HycoConeFactorCreate(&f->cone));
  /* Kept over the solves with one G: it belongs to the form, not to the problem. */
  lcp.factor = f->factor;
  lcp.cone = f->cone;
  PetscCall(MatDenseGetArrayRead(y->G, &lcp.M));
  PetscCall(VecGetArrayRead(y->D, &lcp.q));
  PetscCall(VecGetArray(L, &l));
  if (s->other && y->blocks && !s->falling_back) PetscCall(VecGetArrayRead(s->other, &lcp.other));
  PetscCall(HycoTaoSetType(f->tao, s->now.type, s->max_its));
  PetscCall(HycoTaoSolveLCP(f->tao, &lcp, f->active, l, &s->its, solved));
  if (lcp.other) PetscCall(VecRestoreArrayRead(s->other, &lcp.other));
  if (y->blocks) PetscCall(HycoBlocksAdmit(y->blocks, l)); /* inadmissible by round-off; residuals are recomputed */
  for (PetscInt i = 0; i < f->m && !y->blocks; i++) l[i] = PetscMax(l[i], 0);
  PetscCall(VecRestoreArray(L, &l));
  PetscCall(VecRestoreArrayRead(y->D, &lcp.q));
  PetscCall(MatDenseRestoreArrayRead(y->G, &lcp.M));
  f->started = (PetscBool)(*solved && !y->blocks);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* G is the caller's. */
static PetscErrorCode FlexibilityDestroy(HycoSolverForm form)
{
  Flexibility *f = (Flexibility *)form->data;

  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&f->tao));
  PetscCall(HycoSetFactorDestroy(&f->factor));
  PetscCall(HycoConeFactorDestroy(&f->cone));
  HycoFreeAll(&f->active, &form->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its Tao object is of one process, as G is. For systems given by their flexibility, as models of bodies have: there is
   no K. */
PetscErrorCode HycoSolverFormCreate_Flexibility(HycoSolver s, HycoSolverForm form)
{
  Flexibility *f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&f));
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, (PetscObject)s, &f->tao));
  form->data = f;
  form->cones = PETSC_TRUE;
  *form->ops = (struct _HycoSolverFormOps){
      .accepts = FlexibilityAccepts, .setup = SetUp, .solve = FlexibilitySolve, .destroy = FlexibilityDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
