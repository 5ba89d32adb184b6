/* What the dual form's factorisation leaves behind, for those who reduce it: the flexibility, and solves with K. */
#include <hycosolverimpl.h>

PetscErrorCode HycoSolverGetFlexibility(HycoSolver s, PetscInt *m, const PetscReal *S[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCheck(!s->iterative, HycoComm(s), HYCO_ERR_NO_MODEL,
             "the flexibility B K^-1 B^T needs a factor of the stiffness, and the solver chose iterations%s: give more "
             "memory (-hyco_memory), or -hyco_linear direct",
             s->why_iterative);
  PetscCheck(!s->p, HycoComm(s), HYCO_ERR_NO_MODEL,
             "contact alone holds a body: K^-1 does not exist, and there is no flexibility B K^-1 B^T");
  PetscCheck(s->S && s->condensed.K && s->reason != HYCO_DIVERGED_SINGULAR, HycoComm(s), HYCO_ERR_NO_MODEL,
             "the stiffness is singular (is a body held by nothing?): there is no flexibility B K^-1 B^T");
  *m = s->m;
  *S = s->S;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverApplyInverse(HycoSolver s, PetscInt k, Vec r[], Vec x[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCheck(!s->iterative, HycoComm(s), HYCO_ERR_NO_MODEL,
             "a condensed model needs a factor of the stiffness, and the solver chose iterations%s: give more memory "
             "(-hyco_memory), or -hyco_linear direct",
             s->why_iterative);
  PetscCheck(s->direct && s->condensed.K && !s->p, HycoComm(s), PETSC_ERR_ORDER,
             "call HycoSolverSolve() in the dual form on a regular, sparse K first");
  PetscCall(HycoDirectSolveMany(s->direct, k, r, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
