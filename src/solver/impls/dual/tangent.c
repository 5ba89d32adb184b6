/* The derivative of a solution by the system of its closed contacts, with the factor and the flexibility of the dual
   form: one forward and one back substitution for each change of the data. */
#include <hycosolverimpl.h>

struct _n_HycoSolverTangent {
  HycoSolver s; /* borrowed */
  PetscInt m, p;
  HycoTangent tangent; /* NULL without contacts */
  PetscReal *q, *z;    /* p + m */
};

/* Also of a partly created one. The solver and its factor are borrowed. */
PetscErrorCode HycoSolverTangentDestroy(HycoSolverTangent *tangent)
{
  HycoSolverTangent t = *tangent;

  PetscFunctionBegin;
  if (!t) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTangentDestroy(&t->tangent));
  HycoFreeAll(&t->q, &t->z, tangent);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoSolverTangentUndecided(HycoSolverTangent t)
{
  return t->tangent ? HycoTangentUndecided(t->tangent) : 0;
}

/* The states of the contacts in the solution, and the matrix of the closed ones. */
static PetscErrorCode Close(HycoSolverTangent t, Vec x, Vec L)
{
  HycoSystem y = t->s->system;
  PetscReal *force, *gap, *flexibility, sizes[2], most;
  const PetscReal *S;
  PetscInt *state;
  PetscBool regular;
  const PetscInt n = t->p + t->m;

  PetscFunctionBegin;
  HycoSolverGetCondensed(t->s, &t->m, &t->p, &S);
  PetscCall(PetscMalloc4(t->m, &force, t->m, &gap, t->m, &flexibility, t->m, &state));
  PetscCall(HycoSystemWork(y));
  PetscCall(MatMult(y->B, x, y->work_L));
  /* The size of the terms of D - B x, against which open and closed are told apart. */
  PetscCall(VecNorm(y->work_L, NORM_INFINITY, &sizes[0]));
  PetscCall(VecNorm(y->D, NORM_INFINITY, &sizes[1]));
  PetscCall(VecAYPX(y->work_L, -1, y->D));
  PetscCall(HycoVecGather(y->work_L, gap));
  PetscCall(HycoVecGather(L, force));
  for (PetscInt i = 0; i < t->m; i++) flexibility[i] = S[(size_t)(t->p + i) * (size_t)n + (size_t)(t->p + i)];
  PetscCall(HycoTangentStates(t->m, force, gap, PetscMax(sizes[0], sizes[1]), flexibility, state));
  PetscCall(HycoTangentCreate(t->p, PETSC_TRUE, t->m, S, state, &t->tangent, &regular));
  PetscCall(PetscFree4(force, gap, flexibility, state));
  PetscCall(VecNorm(L, NORM_INFINITY, &most));
  PetscCheck(regular || most > 0, HycoComm(t->s), PETSC_ERR_USER, HYCO_TANGENT_UNPRESSED);
  PetscCheck(
      regular, HycoComm(t->s), PETSC_ERR_USER,
      "the forces of the closed contacts are not unique here, or round-off, and have no derivative; remove contacts "
      "whose gaps follow from those of others");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HycoSolverFactor() factors only if K and B have changed since the solve; the primal form has no factor of K alone,
   and gets one here. */
static PetscErrorCode SetUp(HycoSolverTangent t, Vec x, Vec L)
{
  HycoSolver s = t->s;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCheck(!s->iterative, HycoComm(s), PETSC_ERR_USER,
             "a gradient at full order needs a factor of the stiffness, and the solver chose iterations%s; allow more "
             "memory (-hyco_memory), or use -hyco_linear direct",
             s->why_iterative);
  PetscCall(HycoSolverFactor(s, &singular));
  PetscCheck(!singular, HycoComm(s), PETSC_ERR_USER,
             "the stiffness is singular, so that there is no gradient; check that supports hold every body");
  /* Without contacts K alone gives the derivative. */
  if (!s->system->m) PetscFunctionReturn(PETSC_SUCCESS);
  t->m = s->system->m;
  PetscCall(HycoKernelSize(s->system->K, &t->p));
  PetscCall(PetscMalloc1(t->m + t->p, &t->q));
  PetscCall(PetscMalloc1(t->m + t->p, &t->z));
  PetscCall(Close(t, x, L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x and L must be the solution of the present system: the states of the contacts are read from its gaps and forces.
   After an error *tangent is NULL. */
PetscErrorCode HycoSolverTangentCreate(HycoSolver s, Vec x, Vec L, HycoSolverTangent *tangent)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCall(PetscNew(tangent));
  (*tangent)->s = s;
  HycoOnError(SetUp(*tangent, x, L), PetscCall(HycoSolverTangentDestroy(tangent)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Condensation of (r, g) to the contacts, the system of the closed ones, and expansion: the steps of the dual form,
   with the active set given. MUMPS keeps the reduced right-hand side between the two, so that no other solve may
   come between. */
PetscErrorCode HycoSolverTangentSolve(HycoSolverTangent t, Vec r, Vec g, int sign, Vec dx, Vec dL, PetscBool *kink)
{
  HycoDirect direct = t->s->stiffness.direct;
  PetscInt lo, hi;

  PetscFunctionBegin;
  *kink = PETSC_FALSE;
  /* Without contacts, x' = K^-1 r. */
  if (!t->tangent) {
    PetscCall(HycoStiffnessSolve(t->s, r, dx));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(direct, HycoComm(t->s), PETSC_ERR_SUP, "the derivative of a solution is for a sparse K");
  PetscCall(HycoVecGather(g, t->z));
  PetscCall(HycoDirectReduce(direct, NULL, 0, r, t->z, t->q));
  PetscCall(HycoTangentSolve(t->tangent, t->q, sign, t->z, kink));
  PetscCall(HycoDirectExpand(direct, t->z, dx));
  PetscCall(VecGetOwnershipRange(dL, &lo, &hi));
  PetscCall(HycoVecWrite(dL, hi - lo, t->z + t->p + lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}
