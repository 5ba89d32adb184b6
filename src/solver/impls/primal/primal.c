/*
  The primal form, in gap coordinates: for each contact row one unknown (its pivot) is replaced by the row's value, so
  that B x <= D becomes the bound y_p <= D_i. With x = T y: Kg = T^T K T, f = T^T F, and the force of a contact is the
  residual at its pivot, L_i = (f - Kg y)_p. No dense matrix is formed, whatever the number of contacts.
*/
#include "gap.h"
#include <string.h>

/* This form is cheapest if contacts are more than a share of the unknowns, or so many that S would not fit in
   memory. */
#define HYCO_MANY 6000
/* A warm start that has not converged by then was far from the solution: coarser problems give a better start. */
#define HYCO_WARM_ITS 4
/* Of gaps and forces, the noise of iterative solves while the set changes: sets differ from the last one at few
   contacts, which accurate solves correct (tests/fom/iterative.py). */
#define HYCO_NOISE_FIRST 1e-5
/* Of gaps and forces, the least noise of iterative solves, if a residual requires it: 450 eps, a product with B. */
#define HYCO_NOISE_LEAST 1e-13

/* The value of a distributed vector at this rank's pivots. Pivots may be owned by other ranks. In the order of this
   rank's contacts without idle ones. */
static PetscErrorCode AtPivots(Vec v, VecScatter scatter, Vec work, PetscInt n, PetscReal out[])
{
  PetscFunctionBegin;
  PetscCall(HycoScatter(scatter, v, work));
  PetscCall(HycoVecRead(work, n, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data of the iterations. */
typedef struct {
  HycoSolver s;
  const Gap *gap;
  PetscInt n; /* this rank's contacts, without idle ones */
  PetscReal *bound, *value, *force, *diagonal, *at_d;
  PetscReal noise; /* error of iterative solves, as a share of the largest force and gap */
  PetscInt *at;
  Vec x, L;                          /* the caller's */
  Vec y, hi, f, rhs, residual, work; /* y <= hi: D at the pivots, infinite elsewhere */
  VecScatter scatter;
  PetscBool cold;
} Primal;

/* Evaluates the values at the pivots, and the forces. Forces are the residuals f - Kg y. */
static PetscErrorCode PrimalEvaluate(const Primal *p)
{
  PetscFunctionBegin;
  PetscCall(MatMult(p->gap->Kg, p->y, p->residual));
  PetscCall(VecAYPX(p->residual, -1, p->f));
  PetscCall(AtPivots(p->y, p->scatter, p->work, p->n, p->value));
  PetscCall(AtPivots(p->residual, p->scatter, p->work, p->n, p->force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bounds of the contacts' unknowns are those of the Tao. */
static PetscErrorCode PrimalBounds(void *ctx, Vec lo, Vec hi)
{
  const Primal *p = (const Primal *)ctx;

  PetscFunctionBegin;
  (void)lo;
  PetscCall(AtPivots(hi, p->scatter, p->work, p->n, p->bound));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solve step: closed contacts have y_p = D_i. */
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  const Primal *p = (const Primal *)ctx;
  const Gap *g = p->gap;
  PetscInt n = 0, its;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; k++) {
    if (!active[k]) continue;
    p->at[n] = g->pivot[k];
    p->at_d[n++] = p->bound[k];
  }
  PetscCall(HycoSolveOnSet(g->Kg, g->Kw, g->ksp, p->f, n, p->at, p->at_d, p->rhs, p->y, singular));
  PetscCall(KSPGetIterationNumber(g->ksp, &its));
  /* Counts of the report. */
  if (p->s->iterative) HycoCountLinear(p->s, its);
  if (p->s->iterative) PetscCall(HycoSolverNoteKSP(p->s, g->ksp));
  if (!*singular) PetscCall(PrimalEvaluate(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes over all ranks, so that a rank without contacts with forces judges alike; noise: of iterative solves. */
static PetscErrorCode PrimalViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Primal *p = (const Primal *)ctx;
  PetscReal size[2] = {0, 0}, sizes[2];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; k++) {
    size[0] = PetscMax(size[0], PetscMax(PetscAbsReal(p->bound[k]), PetscAbsReal(p->value[k])));
    if (active[k]) size[1] = PetscMax(size[1], PetscAbsReal(p->force[k]));
  }
  PetscCallMPI(MPI_Allreduce(size, sizes, 2, MPIU_REAL, MPI_MAX, HycoComm(p->s)));
  for (PetscInt k = 0; k < p->n; k++)
    violates[k] = (PetscBool)(active[k] ? p->force[k] < -p->noise * sizes[1] &&
                                              HycoPulls(p->force[k], sizes[1], p->diagonal[k], p->bound[k])
                                        : p->value[k] > p->bound[k] + p->noise * sizes[0] &&
                                              HycoPenetrates(p->value[k], p->bound[k], sizes[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set from coarser problems, if they exist: most unknowns are contacts, with couplings of one sign. A quarter of
   the unknowns: below it a cold start from no contact needs few iterations. */
static PetscErrorCode StartFromCoarse(const Primal *p, PetscBool active[], PetscBool *made)
{
  HycoSolver s = p->s;
  const Gap *g = p->gap;
  Vec set;

  PetscFunctionBegin;
  *made = PETSC_FALSE;
  if (!s->multilevel || 4 * s->system->m <= s->system->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(p->f, &set));
  PetscCall(HycoMultilevelStart(g->Kg, p->f, p->hi, set, made));
  if (*made) {
    PetscCall(AtPivots(set, p->scatter, p->work, p->n, p->value));
    /* The set came as a vector of 0 and 1. */
    for (PetscInt k = 0; k < p->n; k++) active[k] = (PetscBool)(p->value[k] > 0.5);
  }
  PetscCall(VecDestroy(&set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterative solves stop at residuals of 1 % of `noise`; smaller violations do not change the set. */
static PetscErrorCode SetAccuracy(Primal *p, PetscReal noise)
{
  PetscFunctionBegin;
  p->noise = noise;
  PetscCall(KSPSetTolerances(p->gap->ksp, noise / 100, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes x and the forces of the set, without negative ones if `clean`. x = T y; rows of idle contacts have no
   force. */
static PetscErrorCode PrimalFill(const Primal *p, PetscBool clean)
{
  const Gap *g = p->gap;
  PetscScalar *l;

  PetscFunctionBegin;
  PetscCall(MatMult(g->T, p->y, p->x));
  PetscCall(VecSet(p->L, 0));
  PetscCall(VecGetArray(p->L, &l));
  for (PetscInt k = 0; k < p->n; k++) {
    /* In between the signs of the forces tell which contacts pull. */
    if (!clean)
      l[g->contact[k]] = p->force[k];
    else if (g->active[k])
      l[g->contact[k]] = PetscMax(p->force[k], 0);
  }
  PetscCall(VecRestoreArray(p->L, &l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set has converged with inaccurate solves: continues with accurate ones, up to the target of the residual.
   First the accuracy of the set, then, with a target, that of the residual. */
static PetscErrorCode PrimalIsSettled(void *ctx, PetscBool *more)
{
  Primal *p = (Primal *)ctx;
  HycoSolver s = p->s;
  HycoKKT kkt;

  PetscFunctionBegin;
  /* The set was found with coarse solves: it must hold with accurate ones. */
  *more = (PetscBool)(p->noise > HYCO_SET_NOISE);
  if (*more) PetscCall(SetAccuracy(p, HYCO_SET_NOISE));
  if (*more || !s->iterative || !(s->target > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PrimalFill(p, PETSC_TRUE));
  PetscCall(HycoSystemComputeKKT(s->system, p->x, p->L, &kkt));
  *more = (PetscBool)(s->system->residual > s->target && p->noise > HYCO_NOISE_LEAST);
  if (*more) PetscCall(SetAccuracy(p, p->noise * PetscMin(0.03, 0.3 * s->target / s->system->residual)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces a set from the last solution that was far from the new one. Once, after HYCO_WARM_ITS iterations. */
static PetscErrorCode PrimalRestart(void *ctx, PetscInt its, PetscBool active[], PetscBool *fresh)
{
  const Primal *p = (const Primal *)ctx;

  PetscFunctionBegin;
  *fresh = PETSC_FALSE;
  if (!p->cold && its == HYCO_WARM_ITS) PetscCall(StartFromCoarse(p, active, fresh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set of a cold start: floating bodies start with all contacts closed. */
static PetscErrorCode StartCold(Primal *p, PetscBool active[])
{
  HycoSolver s = p->s;
  PetscInt n_free;
  PetscBool coarse = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoKernelSize(s->system->K, &n_free));
  for (PetscInt k = 0; k < p->n; k++) active[k] = (PetscBool)(n_free > 0);
  if (!n_free) PetscCall(StartFromCoarse(p, active, &coarse));
  if (coarse) PetscCall(PetscStrlcat(s->method, ", multilevel start", sizeof(s->method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set of the last solution, or of coarser problems, or none. Collective. */
static PetscErrorCode ActiveSet(Primal *p, Gap *g, PetscBool *solved)
{
  HycoSolver s = p->s;
  HycoActiveSet set = {.comm = HycoComm(s),
                       .n = p->n,
                       .max_its = s->max_its ? s->max_its : 100 + s->system->m,
                       .one_by_one = PETSC_TRUE,
                       .ctx = p,
                       .bounds = PrimalBounds,
                       .solve = SolveOnSet,
                       .violations = PrimalViolations,
                       .restart = PrimalRestart,
                       .settled = PrimalIsSettled,
                       .monitor = s->monitor,
                       .monitor_ctx = s->monitor_ctx};
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(s->system->D, &set.first, NULL));
  /* From coarse to fine: the first sets are far from the last. */
  if (s->iterative) PetscCall(SetAccuracy(p, HYCO_NOISE_FIRST));
  p->cold = (PetscBool)(!s->warm || !g->started);
  if (p->cold) PetscCall(StartCold(p, g->active));
  PetscCall(HycoTaoSetType(g->tao, s->now.type, set.max_its));
  PetscCall(HycoTaoSolveSet(g->tao, &set, g->active, p->hi, p->y, &s->its, &status));
  if (status == HYCO_LCP_SINGULAR) s->reason = HYCO_DIVERGED_SINGULAR;
  /* Only a set that has converged is a start for the next solve. */
  g->started = *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the bound-constrained problem by a Tao type. min 1/2 y^T Kg y - f^T y with y_p <= D_i. TAO scales the
   Hessian in place, hence the copy. */
static PetscErrorCode BoundQP(Primal *p, Gap *g, PetscBool *solved)
{
  HycoSolver s = p->s;
  Vec lo;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(p->y, &lo));
  PetscCall(VecSet(lo, PETSC_NINFINITY));
  /* The start must be feasible: y is 0, and bounds of drawn overlaps are negative. */
  PetscCall(VecPointwiseMin(p->y, p->y, p->hi));
  PetscCall(VecCopy(p->f, p->rhs));
  if (g->H)
    PetscCall(MatCopy(g->Kg, g->H, SAME_NONZERO_PATTERN));
  else
    PetscCall(MatDuplicate(g->Kg, MAT_COPY_VALUES, &g->H));
  PetscCall(MatSetOption(g->H, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(HycoTaoSetType(g->tao, s->now.type, s->max_its));
  PetscCall(HycoTaoSolve(g->tao, g->H, p->rhs, lo, p->hi, p->y, &s->its, solved));
  PetscCall(PrimalEvaluate(p));
  for (PetscInt k = 0; k < p->n; k++) { /* scaling and its inverse may have moved a value from its bound */
    const PetscReal ulps = 8 * PETSC_MACHINE_EPSILON * PetscAbsReal(p->bound[k]);

    g->active[k] = (PetscBool)(p->value[k] >= p->bound[k] - ulps);
  }
  PetscCall(VecDestroy(&lo));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bounds in the order of the contacts without idle ones. y = 0 is the start; bounds are on y's entries at the
   pivots. */
static PetscErrorCode PrimalCreate(HycoSolver s, const Gap *g, Vec x, Primal *p)
{
  HycoSystem y = s->system;
  IS is;
  const PetscScalar *d;

  PetscFunctionBegin;
  p->s = s;
  p->gap = g;
  p->n = g->n;
  PetscCall(PetscCalloc6(p->n, &p->bound, p->n, &p->value, p->n, &p->force, p->n, &p->diagonal, p->n, &p->at_d, p->n,
                         &p->at));
  PetscCall(VecGetArrayRead(y->D, &d));
  PetscCall(VecDuplicate(x, &p->hi));
  PetscCall(VecSet(p->hi, PETSC_INFINITY));
  for (PetscInt k = 0; k < p->n; k++) {
    p->bound[k] = d[g->contact[k]];
    PetscCall(VecSetValue(p->hi, g->pivot[k], p->bound[k], INSERT_VALUES));
  }
  PetscCall(HycoVecAssemble(p->hi));
  PetscCall(VecRestoreArrayRead(y->D, &d));
  PetscCall(VecDuplicate(x, &p->y));
  PetscCall(VecSet(p->y, 0));
  HycoVecDuplicate(x, &p->f, &p->rhs, &p->residual);
  /* The loads in gap coordinates. */
  PetscCall(MatMultTranspose(g->T, y->F, p->f));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, p->n, g->pivot, PETSC_COPY_VALUES, &is));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, p->n, &p->work));
  PetscCall(VecScatterCreate(x, is, p->work, NULL, &p->scatter));
  PetscCall(ISDestroy(&is));
  PetscCall(MatGetDiagonal(g->Kg, p->rhs));
  PetscCall(AtPivots(p->rhs, p->scatter, p->work, p->n, p->diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chosen automatically if there are many contacts, or if K is solved iteratively. Cost 1 is below that of the dual
   form. */
static PetscErrorCode PrimalAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                    char why[HYCO_LINE])
{
  Gap *g = (Gap *)form->data;
  HycoSystem y = s->system;
  const PetscBool many = (PetscBool)(y->m > HYCO_MANY_SHARE * (PetscReal)y->n || y->m > HYCO_MANY);
  PetscBool aij, same;

  PetscFunctionBegin;
  *cost = -1;
  if (!y->K || !y->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)y->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  /* Not by itself where it could not solve; asked for, the reason is told. */
  if (!asked && (s->now.traits & HYCO_TAO_DENSE || !aij || !y->symmetric)) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->now.traits & HYCO_TAO_DENSE)
    HycoFormat(why,
               "%s%s needs the matrix of the dual form; use -hyco_solver_form dual, or -hyco_solver_type tao with "
               "dual_free",
               s->now.traits & HYCO_TAO_OWN ? "" : "TAO's ", s->now.traits & HYCO_TAO_OWN ? s->now.word : s->now.type);
  else if (!aij)
    HycoFormat(why, "the primal form needs a sparse K (AIJ); use -hyco_solver_form dual");
  else if (!y->symmetric)
    HycoFormat(why, "the primal form needs a symmetric system with contacts; use -hyco_solver_form dual");
  else if (asked && !s->iterative)
    *cost = 1;
  else if (many || s->iterative) {
    PetscCall(HycoOperatorStateUpdate(&g->seen, y->B, NULL, &same));
    /* Whether each contact has an unknown of its own: a property of B, found once. */
    if (!same) PetscCall(HycoGapPossible(y, &g->possible));
    if (g->possible) *cost = 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Never singular: with contacts as bounds K itself is not factored before the first set. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoGapSetUp(s, (Gap *)form->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Active set method or a Tao type, then x and L from y. */
static PetscErrorCode PrimalSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Gap *g = (Gap *)form->data;
  const PetscBool own = (PetscBool)(s->now.traits & HYCO_TAO_OWN);
  Primal p = {.noise = 0, .x = x, .L = L};

  PetscFunctionBegin;
  s->by_factor = own;
  PetscCall(HycoGapSetUp(s, g));
  PetscCall(PrimalCreate(s, g, x, &p));
  PetscCall(HycoSolverNameMethod(s, "primal"));
  PetscCall(own ? ActiveSet(&p, g, solved) : BoundQP(&p, g, solved));
  PetscCall(HycoNameLinear(s, g->ksp));
  /* if not solved, the set has changed since: its last forces show in the residuals */
  PetscCall(PrimalFill(&p, (PetscBool)(*solved || !own)));
  /* The form's matrices and its solver stay for the next solve. */
  PetscCall(PetscFree6(p.bound, p.value, p.force, p.diagonal, p.at_d, p.at));
  HycoDestroyAll(&p.y, &p.hi, &p.f, &p.rhs, &p.residual, &p.work, &p.scatter);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PrimalDestroy(HycoSolverForm form)
{
  Gap *g = (Gap *)form->data;

  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&g->tao));
  HycoDestroyAll(&g->ksp, &g->T, &g->Kg, &g->Kw, &g->H);
  HycoFreeAll(&g->pivot, &g->contact, &g->active, &form->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of this form, yet a field of the solver: HycoSolverSetMultilevel() sets the same one. */
static PetscErrorCode SetFromOptions(HycoSolver s, HycoSolverForm form, HycoOptionItems PetscOptionsObject)
{
  PetscFunctionBegin;
  (void)form;
  PetscCall(HycoOptionsBool("-hyco_solver_multilevel",
                            "full order, if every unknown belongs to a contact: start from coarser problems",
                            &s->multilevel, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only forces >= 0 (no cones): a bound is on one unknown each. */
PetscErrorCode HycoSolverFormCreate_Primal(HycoSolver s, HycoSolverForm form)
{
  Gap *g;

  PetscFunctionBegin;
  PetscCall(PetscNew(&g));
  PetscCall(HycoTaoCreate(HycoComm(s), (PetscObject)s, &g->tao));
  form->data = g;
  *form->ops = (struct _HycoSolverFormOps){.accepts = PrimalAccepts,
                                           .setup = SetUp,
                                           .solve = PrimalSolve,
                                           .setfromoptions = SetFromOptions,
                                           .destroy = PrimalDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
