/*
  The dual form: the flexibility S = B K^-1 Bt + W and the gap without forces g = D - B K^-1 F, from one factorisation,
  and the complementarity problem w = g + S L in the contact forces only, small and dense on every rank.
*/
#include <hycosolverimpl.h>
#include <string.h>

/* Lemke's dictionary has m^2 entries, all of which change in each of about m pivots: above this number of contacts
   it is not used as a fallback, and neither is the dual form where another form was chosen. */
#define HYCO_FALLBACK_MAX 3000

typedef struct {
  PetscInt m, p; /* numbers of contacts, and of unknowns pinned because K is singular: these come before the contacts
                    in S, g and L */
  PetscReal *S, *g, *L;
  PetscReal *bare; /* S without a compliance; NULL: S is */
  HycoOperatorState of_W;
  PetscBool *active;
  PetscBool started; /* active is the set of a solution */
  HycoConeFactor cone;
  PetscInt made; /* the factor of K that it belongs to: HycoStiffness */
  HycoTao tao;   /* on each rank alone, because the problem is replicated */
} Dual;

/* The usual form: one factorisation, then a dense problem. Cost 2: others are cheaper only for many contacts. */
static PetscErrorCode DualAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                  char why[HYCO_LINE])
{
  HycoSystem y = s->system;
  PetscInt p;

  PetscFunctionBegin;
  (void)asked;
  *cost = -1;
  if (!y->K || !y->m || s->iterative) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSystemPinned(y, &p));
  if (p && !y->symmetric && !(s->now.traits & HYCO_TAO_OWN)) {
    HycoFormat(why,
               "a body is held by contact only, for which TAO's %s needs a symmetric system; use -hyco_solver_type "
               "active_set, lemke or semismooth",
               s->now.type);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* A fallback must not ask for a dense matrix that the choice of forms has avoided. */
  if (s->falling_back && y->m > HYCO_FALLBACK_MAX && (s->form != form || s->now.traits & HYCO_TAO_DENSE))
    PetscFunctionReturn(PETSC_SUCCESS);
  *cost = 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By the symbolic analysis of [K B^T; B 0], which the factorisation reuses. The pins come
   before it, because they change the matrix that is analysed. */
static PetscErrorCode EstimateFactor(HycoSolver s, HycoSolverForm form, PetscReal *bytes)
{
  HycoStiffness *f = &s->stiffness;
  HycoSystem y = s->system;

  PetscFunctionBegin;
  (void)form;
  if (!f->direct) PetscCall(HycoDirectCreate(HycoComm(s), &f->direct));
  PetscCall(HycoSystemPin(y, f->direct));
  PetscCall(HycoDirectAnalyse(f->direct, y->K, y->Bt, y->B, y->symmetric, bytes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Allocates for m contacts and p pinned unknowns; a change drops the last solution's set. */
static PetscErrorCode DualResize(Dual *d, PetscInt m, PetscInt p)
{
  const PetscInt n = m + p;

  PetscFunctionBegin;
  HycoFreeAll(&d->S, &d->g, &d->L, &d->bare, &d->active);
  PetscCall(PetscMalloc1((size_t)n * (size_t)n + 1, &d->S));
  PetscCall(PetscCalloc1(n + 1, &d->g));
  PetscCall(PetscCalloc1(n + 1, &d->L));
  PetscCall(PetscCalloc1(m + 1, &d->active));
  d->m = m;
  d->p = p;
  /* A set of other contacts is no start. */
  d->started = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S += W. fresh: S is new; otherwise the factor of K, and S without the former W, are kept. */
static PetscErrorCode DualAddCompliance(HycoSolver s, Dual *d, PetscBool fresh)
{
  Mat W = s->system->W;
  const PetscInt m = d->m;
  const size_t n = (size_t)(m + d->p);
  PetscReal *block;
  PetscInt *row;
  PetscBool same = PETSC_FALSE;

  PetscFunctionBegin;
  if (fresh) PetscCall(PetscFree(d->bare));
  if (W) PetscCall(HycoOperatorStateUpdate(&d->of_W, W, NULL, &same));
  if (!(W || d->bare) || (W && d->bare && same)) PetscFunctionReturn(PETSC_SUCCESS);
  HycoConeFactorForget(d->cone);
  if (d->bare)
    PetscCall(PetscArraycpy(d->S, d->bare, n * n));
  else
    HycoDuplicate(n * n, d->S, &d->bare);
  if (!W) {
    PetscCall(PetscFree(d->bare));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc2((size_t)m * (size_t)m, &block, m, &row));
  for (PetscInt i = 0; i < m; i++) row[i] = i;
  PetscCall(HycoSystemCompliance(s->system, m, row, m, block));
  for (size_t k = 0; k < (size_t)m * (size_t)m; k++)
    d->S[((size_t)d->p + k / (size_t)m) * n + (size_t)d->p + k % (size_t)m] += block[k];
  PetscCall(PetscFree2(block, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S from one factorisation; the factor is kept while K and B are unchanged. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  Dual *d = (Dual *)form->data;
  HycoSystem y = s->system;
  PetscInt p;

  PetscFunctionBegin;
  PetscCall(HycoSystemPinned(y, &p));
  if (!d->S || d->m != y->m || d->p != p) {
    PetscCall(DualResize(d, y->m, p));
    /* S has to be computed into the new array, thus K factored again, even if it is unchanged. */
    s->stiffness.of.K = 0;
  }
  PetscCall(HycoStiffnessFactor(s, y->Bt, y->B, d->S, singular));
  if (d->made != s->stiffness.made) HycoConeFactorForget(d->cone);
  if (!*singular) PetscCall(DualAddCompliance(s, d, (PetscBool)(d->made != s->stiffness.made)));
  d->made = s->stiffness.made;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g = D - B K^-1 F, on every rank. */
static PetscErrorCode FreeGap(HycoSolver s, const Dual *d, Vec x)
{
  HycoSystem y = s->system;
  PetscInt p;
  const Vec *motion;
  const PetscReal *stiffness;

  PetscFunctionBegin;
  /* MUMPS reduces F and D to the Schur variables in one forward substitution; with s->free the displacements without
     forces are known. */
  if (!s->stiffness.lu && !s->free) {
    PetscCall(HycoVecGather(y->D, d->L));
    PetscCall(HycoSystemMotions(y, &p, &motion, &stiffness));
    PetscCall(HycoDirectReduce(s->stiffness.direct, motion, stiffness, y->rounding, y->F, d->L, d->g));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (s->free)
    PetscCall(VecCopy(s->free, x));
  else
    PetscCall(HycoStiffnessSolve(s, y->F, x));
  PetscCall(HycoSystemWork(y));
  PetscCall(MatMult(y->B, x, y->work_L));
  PetscCall(VecAYPX(y->work_L, -1, y->D));
  PetscCall(HycoVecGather(y->work_L, d->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the contacts of the last solution's set prevent all motions that the supports leave: where contacts travel,
   some may have no master any more, and a start from such a set would be singular. G, the rows of the motions, stands
   in the first p columns of S. By Cholesky's pivots of G^T G over the set, relative to the motions' squared lengths
   over all contacts, which have the same unit. */
static PetscErrorCode DualHolds(const Dual *d, PetscBool *holds)
{
  const size_t n = (size_t)(d->p + d->m), p = (size_t)d->p;
  PetscReal *gram, *all;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(p * p, &gram, p, &all));
  for (size_t i = p; i < n; i++) {
    const PetscReal *row = d->S + i * n;

    /* The diagonal over all contacts: the scale of each motion, whose unit may be a length or an angle. */
    for (size_t k = 0; k < p; k++) all[k] += row[k] * row[k];
    for (size_t k = 0; k < p * p && d->active[i - p]; k++) gram[k] += row[k / p] * row[k % p];
  }
  PetscCall(HycoCholesky("U", d->p, gram, all, holds));
  PetscCall(PetscFree2(gram, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the dense problem by the current method. Floating bodies start with every contact closed. */
static PetscErrorCode SolveForces(HycoSolver s, Dual *d, Vec start, PetscBool *solved)
{
  HycoBlocks *blocks = NULL;
  PetscReal *other = NULL;
  HycoLCP lcp = {.n = d->m,
                 .p = d->p,
                 .M = d->S,
                 .q = d->g,
                 .symmetric = s->system->symmetric,
                 .warm = s->warm,
                 .springs = (PetscBool)(s->system->soft != NULL),
                 .given = (PetscBool)(s->system->blocks != NULL),
                 .sign = s->system->blocks ? &s->sign : NULL,
                 .monitor = s->monitor,
                 .monitor_ctx = s->monitor_ctx};
  const PetscBool set = (PetscBool)(d->p && !strcmp(s->now.type, HYCO_TAO_ACTIVE_SET));
  char name[HYCO_LINE] = "dual";

  PetscFunctionBegin;
  if (d->p) HycoFormat(name, "dual, %d rigid motions held by contact", (int)d->p);
  PetscCall(HycoSolverNameMethod(s, name));
  if (s->warm && d->started && d->p) PetscCall(DualHolds(d, &d->started));
  /* A cold start: no contact closed, or all for floating bodies, which are otherwise singular. */
  for (PetscInt i = 0; i < d->m && (!s->warm || !d->started); i++) d->active[i] = (PetscBool)(d->p > 0);
  /* At each attempt: a fallback uses another method with the same object. */
  PetscCall(HycoTaoSetType(d->tao, s->now.type, s->max_its));
  if (s->system->blocks) PetscCall(HycoBlocksGather(HycoComm(s), s->system->blocks, &blocks));
  /* With friction a step may have several solutions: the path decides between them by its last forces. The unknowns
     of rigid motions begin at 0. */
  if (blocks) PetscCall(PetscArrayzero(d->L, d->p));
  if (blocks) PetscCall(HycoVecGather(start, d->L + d->p));
  if (blocks && !d->cone) PetscCall(HycoConeFactorCreate(&d->cone));
  if (blocks && s->other && !s->falling_back) {
    PetscCall(PetscCalloc1(d->p + d->m + 1, &other));
    PetscCall(HycoVecGather(s->other, other + d->p));
  }
  /* Borrowed until the problem is solved; NULL: the only starts are the last forces and those of the method. */
  lcp.other = other;
  lcp.blocks = blocks;
  lcp.cone = d->cone;
  PetscCall(HycoTaoSolveLCP(d->tao, &lcp, d->active, d->L, &s->its, solved));
  PetscCall(PetscFree(other));
  if (blocks)
    PetscCall(HycoBlocksAdmit(blocks, d->L + d->p)); /* inadmissible by round-off; the residuals are recomputed */
  for (PetscInt i = 0; i < d->m && !blocks; i++) {
    PetscReal *L = d->L + d->p + i;

    /* Active forces of floating bodies may be 0 at a degenerate vertex, so that the set is kept as it is; without
       them, and by other methods, it follows from the forces. */
    *L = set && !d->active[i] ? 0 : PetscMax(*L, 0);
    if (!set) d->active[i] = (PetscBool)(*L > 0);
  }
  /* A set of blocks is no set of closed rows. */
  d->started = (PetscBool)(*solved && !blocks);
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets this rank's part of the forces, which every rank has. All ranks have solved the same problem. */
static PetscErrorCode SetForces(const Dual *d, Vec L)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  PetscCall(HycoVecWrite(L, hi - lo, d->L + d->p + lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 F - K^-1 Bt L; the first term is known. */
static PetscErrorCode AddForces(HycoSolver s, Vec x, Vec L)
{
  HycoSystem y = s->system;
  PetscReal most;

  PetscFunctionBegin;
  /* Saves the solve if no contact is closed, as at the first steps of a path. */
  PetscCall(VecNorm(L, NORM_INFINITY, &most));
  if (most > 0) {
    PetscCall(MatMult(y->Bt, L, y->work_x[0]));
    PetscCall(HycoStiffnessSolve(s, y->work_x[0], x));
    PetscCall(VecAYPX(x, -1, s->free));
  } else
    PetscCall(VecCopy(s->free, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 (F - Bt L) */
static PetscErrorCode DualRecover(HycoSolver s, const Dual *d, Vec x, Vec L)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  /* The solution without contact is known: only that of the forces is added. */
  if (s->free)
    PetscCall(AddForces(s, x, L));
  else if (!s->stiffness.lu)
    PetscCall(HycoDirectExpand(s->stiffness.direct, d->L, x));
  else {
    PetscCall(MatMult(y->Bt, L, y->work_x[0]));
    PetscCall(VecAYPX(y->work_x[0], -1, y->F));
    PetscCall(HycoStiffnessSolve(s, y->work_x[0], x));
  }
  /* In twice the precision where the plain solve was not accurate enough. */
  if (s->stiffness.refined)
    PetscCall(HycoStiffnessRefine(s, d->L, x));
  else if (!d->p)
    PetscCall(HycoStiffnessCorrect(s, L, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes the forces by dL (m), and x accordingly. Linear: no contact problem is solved again. */
static PetscErrorCode DualShift(HycoSolver s, const PetscReal dL[], Vec x, Vec L)
{
  Vec change, force, move;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(L, &change));
  HycoVecDuplicate(x, &force, &move);
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  PetscCall(HycoVecWrite(change, hi - lo, dL + lo));
  /* With the factor that is there: one back and forward substitution. */
  PetscCall(MatMult(s->system->Bt, change, force));
  /* x follows the forces: dx = -K^-1 Bt dL. */
  PetscCall(HycoStiffnessSolve(s, force, move));
  PetscCall(VecAXPY(x, -1, move));
  PetscCall(VecAXPY(L, 1, change));
  HycoDestroyAll(&change, &force, &move);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If K is ill conditioned, the gaps of x are less accurate than those from S and g: S dL = D - B x corrects them.
   With dense K alone, which may be of reduced models with a condition number near 1e16. */
static PetscErrorCode CloseGaps(HycoSolver s, const Dual *d, Vec x, Vec L)
{
  HycoSystem y = s->system;
  PetscInt k = 0, *a;
  PetscReal *change, open = 0, size;
  PetscBool singular = PETSC_TRUE;
  Vec gap;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y->D, &gap));
  PetscCall(MatMult(y->B, x, gap));
  /* Of B x itself: gaps are judged relative to the displacements that cancel in them. */
  PetscCall(VecNorm(gap, NORM_INFINITY, &size));
  PetscCall(VecAYPX(gap, -1, y->D));
  PetscCall(HycoVecGather(gap, d->g));
  PetscCall(VecDestroy(&gap));
  PetscCall(PetscMalloc2(d->m, &a, d->m, &change));
  /* Of the closed contacts only: the others have no force to correct. */
  for (PetscInt i = 0; i < d->m; i++) {
    if (d->L[i] <= 0) continue;
    a[k++] = i;
    open = PetscMax(open, PetscAbsReal(d->g[i]));
  }
  if (open > 1e-10 * size) PetscCall(HycoLCPSolveOnSet(d->m, d->S, d->g, y->symmetric, NULL, &k, a, change, &singular));
  /* Forces stay nonnegative. */
  for (PetscInt i = 0; i < d->m && !singular; i++) change[i] = PetscMax(change[i], -d->L[i]);
  if (!singular) PetscCall(DualShift(s, change, x, L));
  PetscCall(PetscFree2(a, change));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the largest entry of S, its change by refinement: 4500 eps, solves with an accurate factor. */
#define SAME_FLEXIBILITY 1e-12

/* For a small dense K: computes S again, by solves refined in twice the working precision. Called after a failed
   attempt; *better: S has changed, so that another attempt may succeed. A condensed S of a stiff K has digits lost by
   cancellation, which can make the set cycle. */
static PetscErrorCode DualRefine(HycoSolver s, HycoSolverForm form, PetscBool *better)
{
  Dual *d = (Dual *)form->data;
  HycoStiffness *f = &s->stiffness;
  const size_t entries = (size_t)d->m * (size_t)d->m;
  PetscReal *before, change = 0, size = 0, begin = HycoNow();

  PetscFunctionBegin;
  *better = PETSC_FALSE;
  if (!f->lu || !f->of.K || f->refined || s->system->W) PetscFunctionReturn(PETSC_SUCCESS);
  /* For the comparison, and as the result where refinement changes nothing. */
  HycoDuplicate(entries, d->S, &before);
  HycoConeFactorForget(d->cone);
  f->refined = PETSC_TRUE;
  HycoLogged(HYCO_EVENT_FACTOR, HycoStiffnessCondense(s, s->system->Bt, s->system->B, d->S));
  for (size_t k = 0; k < entries; k++) {
    change = PetscMax(change, PetscAbsReal(d->S[k] - before[k]));
    size = PetscMax(size, PetscAbsReal(d->S[k]));
  }
  f->refined = *better = (PetscBool)(change > SAME_FLEXIBILITY * size);
  if (!*better) PetscCall(PetscArraycpy(d->S, before, entries));
  PetscCall(PetscFree(before));
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A refined factor is that of one solve: later systems start without it. */
static PetscErrorCode DualReset(HycoSolver s, HycoSolverForm form)
{
  PetscFunctionBegin;
  (void)form;
  if (s->stiffness.refined) s->stiffness.of.K = 0;
  s->stiffness.refined = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S and g, forces, displacements, and for dense K a correction. */
static PetscErrorCode DualSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Dual *d = (Dual *)form->data;
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(SetUp(s, form, &singular));
  if (singular) {
    PetscCall(HycoSolverGiveUp(s, x, L));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FreeGap(s, d, x));
  HycoLogged(HYCO_EVENT_FORCES, SolveForces(s, d, L, solved));
  PetscCall(SetForces(d, L));
  PetscCall(DualRecover(s, d, x, L));
  /* Reduced models: gaps that should be 0 have round-off of the dense factor, which one correction removes. */
  if (s->stiffness.lu && !s->system->W && !d->p && *solved && s->now.traits & HYCO_TAO_OWN && !s->system->blocks)
    PetscCall(CloseGaps(s, d, x, L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DualDestroy(HycoSolverForm form)
{
  Dual *d = (Dual *)form->data;

  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&d->tao));
  PetscCall(HycoConeFactorDestroy(&d->cone));
  HycoFreeAll(&d->S, &d->g, &d->L, &d->bare, &d->active, &form->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The dense problem is the same on every rank and solved by each alone: the communicator of its Tao object is that
   of one process. */
PetscErrorCode HycoSolverFormCreate_Dual(HycoSolver s, HycoSolverForm form)
{
  Dual *d;

  PetscFunctionBegin;
  PetscCall(PetscNew(&d));
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, (PetscObject)s, &d->tao));
  form->data = d;
  form->cones = form->compliance = PETSC_TRUE;
  *form->ops = (struct _HycoSolverFormOps){.accepts = DualAccepts,
                                           .estimate = EstimateFactor,
                                           .setup = SetUp,
                                           .solve = DualSolve,
                                           .refine = DualRefine,
                                           .reset = DualReset,
                                           .destroy = DualDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Valid until the next factorisation. */
void HycoSolverGetCondensed(HycoSolver s, PetscInt *m, PetscInt *p, const PetscReal *S[])
{
  const Dual *d = (const Dual *)HycoSolverFindForm(s, "dual")->data;

  *m = d->m;
  *p = d->p;
  *S = d->S;
}

/* The last dense problem and its solution z, with the p unknowns of motions first. Borrowed until the next solve;
   the blocks are set by the caller. */
void HycoSolverGetDense(HycoSolver s, HycoLCP *lcp, const PetscReal *z[])
{
  const Dual *d = (const Dual *)HycoSolverFindForm(s, "dual")->data;

  *lcp = (HycoLCP){.n = d->m, .p = d->p, .M = d->S, .q = d->g, .symmetric = s->system->symmetric, .cone = d->cone};
  *z = d->L;
}
