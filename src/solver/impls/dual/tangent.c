/* The derivative of a solution by the system of its closed contacts, with friction of its pieces, with the factor and
   the flexibility of the dual form: one forward and one back substitution for each change of the data. */
#include <hycosolverimpl.h>

struct _n_HycoSolverTangent {
  HycoSolver s; /* borrowed */
  PetscInt m, p;
  PetscReal *q, *z;    /* p + m */
  HycoTangent tangent; /* NULL without contacts, and with blocks: */
  HycoBlocks *blocks;
  PetscReal *w, *dw, *dmu; /* p + m; p + m; by row, then by block */
  PetscReal *before;       /* m: the forces before the step */
  PetscReal size;          /* of gaps and displacements */
};

/* Also of a partly created one. The solver and its factor are borrowed. */
PetscErrorCode HycoSolverTangentDestroy(HycoSolverTangent *tangent)
{
  HycoSolverTangent t = *tangent;

  PetscFunctionBegin;
  if (!t) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTangentDestroy(&t->tangent));
  PetscCall(HycoBlocksDestroy(&t->blocks));
  HycoFreeAll(&t->q, &t->z, &t->w, &t->dw, &t->dmu, &t->before, tangent);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoSolverTangentUndecided(HycoSolverTangent t)
{
  return t->tangent ? HycoTangentUndecided(t->tangent) : 0;
}

/* The gaps of the contacts in the solution, on every rank. */
static PetscErrorCode DualTangentGaps(HycoSolverTangent t, Vec x, Vec L, PetscReal gap[])
{
  HycoSystem y = t->s->system;
  PetscReal sizes[2];

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(MatMult(y->B, x, y->work_L));
  /* The size of the terms of D - B x, against which open and closed are told apart. */
  PetscCall(VecNorm(y->work_L, NORM_INFINITY, &sizes[0]));
  PetscCall(VecNorm(y->D, NORM_INFINITY, &sizes[1]));
  t->size = PetscMax(sizes[0], sizes[1]);
  PetscCall(VecAYPX(y->work_L, -1, y->D));
  if (y->W) PetscCall(HycoSystemAddCompliance(y, L, y->work_L, &t->size));
  PetscCall(HycoVecGather(y->work_L, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The states of the contacts in the solution, and the matrix of the closed ones. */
static PetscErrorCode DualTangentClose(HycoSolverTangent t, Vec x, Vec L, PetscBool *regular)
{
  PetscReal *force, *gap;
  const PetscReal *S;

  PetscFunctionBegin;
  HycoSolverGetCondensed(t->s, &t->m, &t->p, &S);
  PetscCall(PetscMalloc2(t->m, &force, t->m, &gap));
  PetscCall(DualTangentGaps(t, x, L, gap));
  PetscCall(HycoVecGather(L, force));
  PetscCall(HycoTangentCreate(t->p, PETSC_TRUE, t->m, S, force, gap, t->size, &t->tangent, regular));
  PetscCall(PetscFree2(force, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The gaps and slips of the last solve, whose cone has the pieces. */
static PetscErrorCode TakePieces(HycoSolverTangent t, Vec x, Vec L, Vec before)
{
  const PetscInt n = t->p + t->m;

  PetscFunctionBegin;
  PetscCall(HycoBlocksGather(HycoComm(t->s), t->s->system->blocks, &t->blocks));
  PetscCall(PetscCalloc1(n + 1, &t->w));
  PetscCall(PetscMalloc1(n + 1, &t->dw));
  PetscCall(PetscMalloc1(n + 1, &t->dmu));
  PetscCall(PetscMalloc1(t->m + 1, &t->before));
  PetscCall(DualTangentGaps(t, x, L, t->w + t->p));
  PetscCall(HycoVecGather(before, t->before));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HycoSolverFactor() factors only if K and B have changed since the solve; the primal form has no factor of K alone,
   and gets one here. */
static PetscErrorCode SetUp(HycoSolverTangent t, Vec x, Vec L, Vec before, PetscBool *regular)
{
  HycoSolver s = t->s;
  PetscBool singular;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
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
  PetscCall(HycoSystemPinned(s->system, &t->p));
  PetscCall(PetscMalloc1(t->m + t->p, &t->q));
  PetscCall(PetscMalloc1(t->m + t->p, &t->z));
  if (s->system->blocks)
    PetscCall(TakePieces(t, x, L, before));
  else
    PetscCall(DualTangentClose(t, x, L, regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x and L must be the solution of the present system: the states of the contacts are read from its gaps and forces.
   After an error *tangent is NULL. */
PetscErrorCode HycoSolverTangentCreate(HycoSolver s, Vec x, Vec L, Vec before, HycoSolverTangent *tangent,
                                       PetscBool *regular)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCall(PetscNew(tangent));
  (*tangent)->s = s;
  HycoOnError(SetUp(*tangent, x, L, before, regular), PetscCall(HycoSolverTangentDestroy(tangent)));
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
  PetscCall(HycoDirectReduce(direct, NULL, NULL, 0, r, t->z, t->q));
  PetscCall(HycoTangentSolve(t->tangent, t->q, sign, t->z, kink));
  PetscCall(HycoDirectExpand(direct, t->z, dx));
  PetscCall(VecGetOwnershipRange(dL, &lo, &hi));
  PetscCall(HycoVecWrite(dL, hi - lo, t->z + t->p + lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverTangentSolveCones(HycoSolverTangent t, Vec r, Vec g, Vec mu, PetscReal step, Vec dx, Vec dL,
                                           Vec dw, PetscBool *regular)
{
  HycoDirect direct = t->s->stiffness.direct;
  const PetscReal *z, *stiffness;
  const Vec *motion;
  PetscReal least = t->s->system->rounding, size;
  HycoLCP lcp;
  PetscInt lo, hi, p;

  PetscFunctionBegin;
  PetscCheck(direct, HycoComm(t->s), PETSC_ERR_SUP, "the derivative of a solution is for a sparse K");
  HycoSolverGetDense(t->s, &lcp, &z);
  lcp.blocks = t->blocks;
  lcp.springs = (PetscBool)(t->s->system->soft != NULL);
  PetscCall(HycoSystemMotions(t->s->system, &p, &motion, &stiffness));
  PetscCall(HycoVecGather(g, t->z));
  /* Also where all forces have vanished. */
  for (PetscInt i = 0; i < t->m; i++) least = PetscMax(least, PETSC_MACHINE_EPSILON * PetscAbsReal(t->before[i]));
  least *= 2 / PetscAbsReal(step);
  PetscCall(HycoDirectReduce(direct, motion, stiffness, least, r, t->z, t->q));
  PetscCall(VecNorm(r, NORM_INFINITY, &size));
  for (PetscInt i = 0; i < t->p && size <= least; i++) t->q[i] = 0;
  PetscCall(HycoVecGather(mu, t->dmu));
  /* Ascending: what is overwritten has been read. */
  for (PetscInt k = 0; k < t->blocks->n; k++) t->dmu[k] = t->dmu[t->blocks->row[k]];
  PetscCall(HycoConeTangent(&lcp, t->before, z, t->w, t->size, t->dmu, t->q, t->z, t->dw, regular));
  if (!*regular) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoDirectExpand(direct, t->z, dx));
  PetscCall(VecGetOwnershipRange(dL, &lo, &hi));
  PetscCall(HycoVecWrite(dL, hi - lo, t->z + t->p + lo));
  PetscCall(HycoVecWrite(dw, hi - lo, t->dw + t->p + lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}
