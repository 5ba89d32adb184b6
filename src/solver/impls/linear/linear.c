/* K x = F without contact: by the factor of K, or by conjugate gradients with multigrid. */
#include <hycosolverimpl.h>

typedef struct {
  KSP ksp;          /* iterative */
  KSPNormType norm; /* its own measure, without a target */
  PetscReal rtol, atol;
  HycoOperatorState of;
} Linear;

/* Cost 0: without contact there is nothing else. */
static PetscErrorCode LinearAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                    char why[HYCO_LINE])
{
  PetscFunctionBegin;
  (void)form, (void)asked, (void)why;
  *cost = s->system->K && !s->system->m ? 0 : -1;
  if (s->iterative && s->linear != HYCO_LINEAR_ITERATIVE) *cost = -1; /* iterations only on request */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor is that of the solver, and shared with the other forms. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  PetscFunctionBegin;
  (void)form;
  PetscCall(HycoStiffnessFactor(s, NULL, NULL, NULL, singular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a target, x is the start, and the residual is measured without the preconditioner, as the target is. */
static PetscErrorCode SolveIterative(HycoSolver s, Linear *l, Vec x, PetscBool *solved)
{
  KSPConvergedReason why;
  PetscBool same;
  PetscInt its;
  PetscReal size;

  PetscFunctionBegin;
  /* A changed K gets a new hierarchy: its aggregates may depend on the values. */
  PetscCall(HycoOperatorStateUpdate(&l->of, s->system->K, NULL, &same));
  if (!same) {
    PetscCall(KSPDestroy(&l->ksp));
    PetscCall(HycoIterativeSolver(HycoComm(s), "hyco_primal_", s->system->K, &l->ksp));
    PetscCall(KSPGetNormType(l->ksp, &l->norm));
    PetscCall(KSPGetTolerances(l->ksp, &l->rtol, &l->atol, NULL, NULL));
  }
  if (s->target > 0) {
    PetscCall(VecNorm(s->system->F, NORM_2, &size));
    PetscCall(KSPSetNormType(l->ksp, KSP_NORM_UNPRECONDITIONED));
    /* Absolute, since the target is; but never above what the final check of the residual demands. */
    PetscCall(KSPSetTolerances(l->ksp, 0, PetscMin(s->target, 0.3 * s->rtol * size), PETSC_DEFAULT, PETSC_DEFAULT));
  } else {
    PetscCall(KSPSetNormType(l->ksp, l->norm));
    PetscCall(KSPSetTolerances(l->ksp, l->rtol, l->atol, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(VecSet(x, 0));
  }
  PetscCall(KSPSolve(l->ksp, s->system->F, x));
  PetscCall(KSPGetConvergedReason(l->ksp, &why));
  PetscCall(KSPGetIterationNumber(l->ksp, &its));
  HycoCountLinear(s, its);
  PetscCall(HycoSolverNoteKSP(s, l->ksp));
  PetscCall(HycoNameLinear(s, l->ksp));
  *solved = (PetscBool)(why > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x in place; L is not used. Without contacts: no active set, no loop. */
static PetscErrorCode LinearSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(s->method, "linear", sizeof(s->method)));
  /* No contacts and no factor: conjugate gradients alone. */
  if (s->iterative) {
    PetscCall(SolveIterative(s, (Linear *)form->data, x, solved));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SetUp(s, form, &singular));
  if (singular) {
    PetscCall(HycoSolverGiveUp(s, x, L));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoStiffnessSolve(s, s->system->F, x));
  PetscCall(HycoStiffnessCorrect(s, NULL, x));
  *solved = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LinearDestroy(HycoSolverForm form)
{
  Linear *l = (Linear *)form->data;

  PetscFunctionBegin;
  PetscCall(KSPDestroy(&l->ksp));
  PetscCall(PetscFree(form->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverFormCreate_Linear(HycoSolver s, HycoSolverForm form)
{
  Linear *l;

  PetscFunctionBegin;
  (void)s;
  PetscCall(PetscNew(&l));
  form->data = l;
  *form->ops = (struct _HycoSolverFormOps){
      .accepts = LinearAccepts, .setup = SetUp, .solve = LinearSolve, .destroy = LinearDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
