/*
  Systems with a compliance W and without K: w = D - B x + W L, B^T L = F with free unknowns x, or none, on one process.
  Of a dense W without x the whole problem is solved, and the factor of the closed contacts kept while W is unchanged.
  Of any other W only the block of some contacts is asked for: those of the working set, and the ones that their forces
  close beside them join.
*/
#include <hycosolverimpl.h>
#include <string.h>

#define ROUNDS        60 /* of joining contacts */
#define COARSE_STRIDE 4  /* one of so many contacts is in the first problem of bodies that contact alone holds */
#define SMALL_PROBLEM 64 /* contacts that are all in it */

typedef struct {
  PetscInt m, n, *contact; /* n: contacts in the problem */
  PetscBool *active, *in;
  PetscBool started; /* active is the set of a solution */
  HycoSetFactor factor;
  HycoConeFactor cone;
  HycoOperatorState of;
  HycoTao tao;
  PetscReal *M, *q, *z; /* of the n contacts */
} Condensed;

/* The only form without K. */
static PetscErrorCode CondensedAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                       char why[HYCO_LINE])
{
  PetscFunctionBegin;
  (void)form, (void)asked, (void)why;
  *cost = s->system->K ? -1 : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *singular stays false: a singular block of W appears only once a set is solved. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  Condensed *f = (Condensed *)form->data;
  HycoSystem y = s->system;
  PetscBool same;

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  if (f->m != y->m || !f->active) {
    HycoFreeAll(&f->active, &f->in, &f->contact);
    PetscCall(HycoSetFactorDestroy(&f->factor));
    PetscCall(PetscCalloc1(y->m + 1, &f->active));
    PetscCall(PetscCalloc1(y->m + 1, &f->in));
    PetscCall(PetscMalloc1(y->m + 1, &f->contact));
    PetscCall(HycoSetFactorCreate(y->m, &f->factor));
    f->m = y->m;
    f->started = PETSC_FALSE;
  }
  /* The factor of the active set belongs to the former W. */
  PetscCall(HycoOperatorStateUpdate(&f->of, y->W, NULL, &same));
  if (!same) HycoSetFactorForget(f->factor);
  if (!same) HycoConeFactorForget(f->cone);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole problem of a dense W: starts from the set of the last solution. */
static PetscErrorCode SolveDense(HycoSolver s, Condensed *f, HycoLCP lcp, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  PetscScalar *l;

  PetscFunctionBegin;
  if (!s->warm || !f->started) PetscCall(PetscArrayzero(f->active, f->m));
  if (y->blocks && !f->cone) PetscCall(HycoConeFactorCreate(&f->cone));
  /* Kept over the solves with one W: it belongs to the form, not to the problem. */
  lcp.factor = f->factor;
  lcp.cone = f->cone;
  PetscCall(MatDenseGetArrayRead(y->W, &lcp.M));
  PetscCall(VecGetArrayRead(y->D, &lcp.q));
  PetscCall(VecGetArray(L, &l));
  if (s->other && y->blocks && !s->falling_back) PetscCall(VecGetArrayRead(s->other, &lcp.other));
  PetscCall(HycoTaoSolveLCP(f->tao, &lcp, f->active, l, &s->its, solved));
  if (lcp.other) PetscCall(VecRestoreArrayRead(s->other, &lcp.other));
  if (y->blocks) PetscCall(HycoBlocksAdmit(y->blocks, l)); /* inadmissible by round-off; residuals are recomputed */
  for (PetscInt i = 0; i < f->m && !y->blocks; i++) l[i] = PetscMax(l[i], 0);
  PetscCall(VecRestoreArray(L, &l));
  PetscCall(VecRestoreArrayRead(y->D, &lcp.q));
  PetscCall(MatDenseRestoreArrayRead(y->W, &lcp.M));
  f->started = (PetscBool)(*solved && !y->blocks);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- where contacts join -- */

/* Makes the problem that of every `stride`-th contact that may close. */
static PetscErrorCode TakeEvery(HycoSystem y, Condensed *f, PetscInt stride)
{
  const PetscScalar *D;
  PetscInt n = 0;

  PetscFunctionBegin;
  f->n = 0;
  PetscCall(VecGetArrayRead(y->D, &D));
  for (PetscInt k = 0; k < f->m; k++) {
    f->in[k] = (PetscBool)(y->blocks || (D[k] < PETSC_INFINITY && n++ % stride == 0));
    if (f->in[k]) f->contact[f->n++] = k;
  }
  PetscCall(VecRestoreArrayRead(y->D, &D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first problem: the working set. Without one every contact, or, where contact alone holds bodies, one of
   COARSE_STRIDE, whose forces push the bodies together about as those of all do, so that the contacts which these
   bodies still meet are few more than those that close. *n: contacts that may close; *size: their largest gap. */
static PetscErrorCode CondensedBegin(HycoSolver s, Condensed *f, PetscInt *n, PetscReal *size)
{
  HycoSystem y = s->system;
  const PetscScalar *D;

  PetscFunctionBegin;
  *n = f->n = 0;
  *size = 0;
  PetscCall(VecGetArrayRead(y->D, &D));
  for (PetscInt k = 0; k < f->m; k++) {
    if (D[k] >= PETSC_INFINITY) continue;
    *size = PetscMax(*size, PetscAbsReal(D[k]));
    ++*n;
  }
  PetscCall(VecRestoreArrayRead(y->D, &D));
  if (!s->working_set) {
    PetscCall(TakeEvery(y, f, y->n && *n > SMALL_PROBLEM ? COARSE_STRIDE : 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < f->m; k++) {
    f->in[k] = s->working_set[k];
    if (f->in[k]) f->contact[f->n++] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces and unknowns of a problem that is solved. A method other than the active set says by its forces which
   contacts are closed. */
static PetscErrorCode CondensedTake(HycoSolver s, Condensed *f, Vec x, Vec L)
{
  HycoSystem y = s->system;
  const PetscInt p = y->n;
  const PetscBool set = (PetscBool)!strcmp(s->now.type, HYCO_TAO_ACTIVE_SET);
  PetscScalar *l;

  PetscFunctionBegin;
  if (y->blocks) PetscCall(HycoBlocksAdmit(y->blocks, f->z + p));
  PetscCall(VecGetArray(L, &l));
  for (PetscInt k = 0; k < f->n; k++) {
    PetscReal *z = f->z + p + k;

    if (!set) f->active[k] = (PetscBool)(*z > 0);
    /* Negative by round-off; the residuals are recomputed. */
    if (!y->blocks) *z = p && !f->active[k] ? 0 : PetscMax(*z, 0);
    l[f->contact[k]] = *z;
  }
  PetscCall(VecRestoreArray(L, &l));
  if (p) PetscCall(HycoVecWrite(x, p, f->z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One problem. All contacts in it are closed at the start: most of them are, and with free unknowns the first matrix
   would be singular otherwise. */
static PetscErrorCode SolveProblem(HycoSolver s, Condensed *f, HycoLCP lcp, Vec x, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  const size_t N = (size_t)(y->n + f->n);
  PetscInt its = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(N * N + 1, &f->M));
  PetscCall(PetscCalloc2(N + 1, &f->q, N + 1, &f->z));
  PetscCall(HycoSystemFill(y, f->n, f->contact, f->M, f->q));
  /* Blocks are all in the problem, from the given forces. */
  if (y->blocks) PetscCall(HycoVecRead(L, f->n, f->z + y->n));
  for (PetscInt k = 0; k < f->n; k++) f->active[k] = PETSC_TRUE;
  lcp.n = f->n;
  lcp.p = y->n;
  lcp.M = f->M;
  lcp.q = f->q;
  lcp.rounding = y->rounding;
  PetscCall(HycoTaoSolveLCP(f->tao, &lcp, f->active, f->z, &its, solved));
  /* TAO's word does not end the rounds: the residuals are recomputed. */
  if (!(s->now.traits & HYCO_TAO_OWN)) *solved = PETSC_TRUE;
  s->its += its;
  PetscCall(CondensedTake(s, f, x, L));
  PetscCall(PetscFree(f->M));
  PetscCall(PetscFree2(f->q, f->z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes from the first problem of some contacts those that it has opened: they stand for others, which may close. */
static void DropOpen(Condensed *f)
{
  PetscInt n = 0;

  for (PetscInt k = 0; k < f->n; k++) {
    f->in[f->contact[k]] = f->active[k];
    if (f->active[k]) f->contact[n++] = f->contact[k];
  }
  f->n = n;
}

/* Adds the contacts outside the problem that penetrate by more than `least`; *more: there are some. */
static PetscErrorCode CondensedJoin(HycoSystem y, Condensed *f, PetscReal least, Vec x, Vec L, PetscBool *more)
{
  const PetscScalar *w;

  PetscFunctionBegin;
  *more = PETSC_FALSE;
  PetscCall(HycoSystemWork(y));
  PetscCall(HycoSystemGaps(y, x, L, y->work_L));
  PetscCall(VecGetArrayRead(y->work_L, &w));
  for (PetscInt k = 0; k < f->m; k++) {
    if (f->in[k] || w[k] >= -least) continue;
    f->in[k] = *more = PETSC_TRUE;
    f->contact[f->n++] = k;
  }
  PetscCall(VecRestoreArrayRead(y->work_L, &w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contacts only join, so that the rounds end; those that need no force get none from the problem itself. */
static PetscErrorCode SolveRounds(HycoSolver s, Condensed *f, const HycoLCP *lcp, Vec x, Vec L, PetscBool *solved)
{
  HycoSystem y = s->system;
  PetscReal size;
  PetscBool more = PETSC_TRUE;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(CondensedBegin(s, f, &n, &size));
  *solved = PETSC_TRUE;
  if (y->n) PetscCall(VecSet(x, 0));
  /* Contacts outside the last problem keep 0. */
  if (!y->blocks) PetscCall(VecSet(L, 0));
  for (PetscInt round = 0; more && *solved && round < ROUNDS; round++) {
    if (f->n) PetscCall(SolveProblem(s, f, *lcp, x, L, solved));
    if (!*solved && y->n && f->n < n) {
      /* Some contacts may not hold the bodies that all do. */
      PetscCall(VecSet(L, 0));
      PetscCall(TakeEvery(y, f, 1));
      *solved = PETSC_TRUE;
      continue;
    }
    if (!round && y->n && f->n < n) DropOpen(f);
    PetscCall(CondensedJoin(y, f, HYCO_NO_PENETRATION * size, x, L, &more));
  }
  /* Penetrating contacts were left out of the last problem: its forces are no solution. */
  *solved = (PetscBool)(*solved && !more);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CondensedSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Condensed *f = (Condensed *)form->data;
  HycoSystem y = s->system;
  const HycoLCP lcp = {.n = y->m,
                       .symmetric = PETSC_TRUE,
                       .blocks = y->blocks,
                       .sign = y->blocks ? &s->sign : NULL,
                       .warm = s->warm,
                       .given = (PetscBool)(y->blocks != NULL),
                       .monitor = s->monitor,
                       .monitor_ctx = s->monitor_ctx};
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(SetUp(s, form, &singular));
  PetscCall(HycoSolverNameMethod(s, "condensed"));
  PetscCall(HycoTaoSetType(f->tao, s->now.type, s->max_its));
  s->by_factor = PETSC_FALSE;
  if (y->dense_W && !y->n)
    PetscCall(SolveDense(s, f, lcp, L, solved));
  else
    PetscCall(SolveRounds(s, f, &lcp, x, L, solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W is the caller's. */
static PetscErrorCode CondensedDestroy(HycoSolverForm form)
{
  Condensed *f = (Condensed *)form->data;

  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&f->tao));
  PetscCall(HycoSetFactorDestroy(&f->factor));
  PetscCall(HycoConeFactorDestroy(&f->cone));
  HycoFreeAll(&f->active, &f->in, &f->contact, &form->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its Tao object is of one process, as W is: models of bodies, and systems given by their flexibility. */
PetscErrorCode HycoSolverFormCreate_Condensed(HycoSolver s, HycoSolverForm form)
{
  Condensed *f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&f));
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, (PetscObject)s, &f->tao));
  form->data = f;
  form->cones = form->compliance = PETSC_TRUE;
  *form->ops = (struct _HycoSolverFormOps){
      .accepts = CondensedAccepts, .setup = SetUp, .solve = CondensedSolve, .destroy = CondensedDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
