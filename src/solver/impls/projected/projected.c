/*
  The projected form: the active set method in the displacements, each set solved by conjugate gradients on the
  displacements that close its contacts, with multigrid for K (linear/constrained.c). Nothing is factored, K is not
  copied, and one multigrid serves every set. Solves are inaccurate while the set changes and become accurate when it
  has converged.
*/
#include "../primal/gap.h"
#include <string.h>

/* Of the loads, the residual of the first solves: the set changes at few contacts afterwards (tests/fom/iterative.py).
   */
#define HYCO_FIRST 1e-3
/* Factor of the accuracy after each converged set: two rounds to HYCO_LAST (scripts/bench scale). */
#define HYCO_SHARPEN 3e-4
/* Of the loads, the residual of the final solves: a hundredth of the tolerance of 1e-8; increased if the recomputed
   residual requires it. */
#define HYCO_LAST  1e-10
#define HYCO_LEAST 1e-15 /* of the loads, the least residual of solves: 4.5 eps, no solve is better */
/* Violations that change the set, as a multiple of the accuracy; at least HYCO_SET_NOISE. */
#define HYCO_BELIEVED 30

/* Data of the form. */
typedef struct {
  HycoConstrained constrained;
  HycoOperatorState made, seen; /* K of the multigrid; B from which `possible` and `node` were computed */
  PetscBool possible;
  PetscInt *node, *contact, n; /* contacts of this rank that are not idle: an unknown of their nodes, their rows */
  PetscBool *active;           /* of this rank's n */
  PetscBool started;           /* active is the set of a solution */
  HycoTao tao;
} Projected;

/* Data of the iterations. */
typedef struct {
  HycoSolver s;
  Projected *form;
  PetscReal *bound, *value, *force;
  PetscReal accuracy, size; /* relative accuracy of solves; size of the loads */
  PetscInt *at;             /* work */
  PetscBool *solved;        /* the set of the last solve */
  PetscInt n_sets;          /* number of sets so far */
  Vec x, d, l, r, gap, L;   /* d, l: for the active rows; gap: B x, the unknowns of the Tao, whose bounds are D */
} Run;

/* The node of each contact: its slave if B has one, else that of an entry that no other contact has. `possible` is
   of all ranks: each contact needs an unknown of its own, so that closed rows are independent. */
static PetscErrorCode FindNodes(HycoSystem y, Projected *f)
{
  PetscInt lo, hi, *pivot;
  PetscMPIInt differs, any;
  const PetscInt before = f->n;
  const PetscScalar *s = NULL;
  Vec slave;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  HycoFreeAll(&f->node, &f->contact);
  PetscCall(PetscMalloc1(hi - lo, &f->node));
  PetscCall(PetscMalloc1(hi - lo, &f->contact));
  PetscCall(PetscMalloc1(hi - lo, &pivot));
  /* The pivots are not used as coordinates here: their existence proves that any closed rows are independent. */
  PetscCall(HycoGapPivots(y, pivot, &f->possible));
  PetscCall(PetscObjectQuery((PetscObject)y->B, HYCO_SLAVES, (PetscObject *)&slave));
  if (slave) PetscCall(VecGetArrayRead(slave, &s));
  f->n = 0;
  for (PetscInt k = 0; k < hi - lo; k++) {
    if (pivot[k] == HYCO_IDLE) continue;
    f->contact[f->n] = k;
    f->node[f->n++] = s ? (PetscInt)s[k] : pivot[k];
  }
  if (slave) PetscCall(VecRestoreArrayRead(slave, &s));
  PetscCall(PetscFree(pivot));
  differs = !f->active || f->n != before;
  PetscCallMPI(MPI_Allreduce(&differs, &any, 1, MPI_INT, MPI_MAX, HycoComm(y)));
  if (any) {
    PetscCall(PetscFree(f->active));
    PetscCall(PetscCalloc1(f->n + 1, &f->active));
    f->started = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bounds of B x are those of the Tao. */
static PetscErrorCode ProjectedBounds(void *ctx, Vec lo, Vec hi)
{
  const Run *p = (const Run *)ctx;
  const PetscScalar *d;

  PetscFunctionBegin;
  (void)lo;
  PetscCall(VecGetArrayRead(hi, &d));
  for (PetscInt k = 0; k < p->form->n; k++) p->bound[k] = d[p->form->contact[k]];
  PetscCall(VecRestoreArrayRead(hi, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the active rows of B and their nodes as constraints. Only if the set differs from that of the last solve on any
   rank. Constraints are projected out of the residuals, so that the multigrid of K serves every set. */
static PetscErrorCode SetConstraints(Run *p, const PetscBool active[], PetscBool *singular)
{
  const Projected *f = p->form;
  Mat B = p->s->system->B, rows;
  PetscInt n = 0, lo, *row;
  PetscMPIInt differs = (PetscMPIInt)!p->n_sets, any;
  PetscScalar *d;
  IS is;

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  /* Coarsening the constraints costs several products, and a sharpened solve of the same set needs none of it. */
  for (PetscInt k = 0; k < f->n; k++) differs = differs || p->solved[k] != active[k];
  PetscCallMPI(MPI_Allreduce(&differs, &any, 1, MPI_INT, MPI_MAX, HycoComm(p->s)));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  p->n_sets++;
  PetscCall(PetscArraycpy(p->solved, active, f->n));
  PetscCall(MatGetOwnershipRange(B, &lo, NULL));
  PetscCall(PetscMalloc1(f->n, &row));
  for (PetscInt k = 0; k < f->n; k++) {
    if (!active[k]) continue;
    row[n] = lo + f->contact[k];
    p->at[n++] = f->node[k];
  }
  PetscCall(ISCreateGeneral(HycoComm(B), n, row, PETSC_OWN_POINTER, &is));
  /* On each rank the rows of its own contacts, in their order, like d and l. */
  PetscCall(MatCreateSubMatrix(B, is, NULL, MAT_INITIAL_MATRIX, &rows));
  PetscCall(HycoConstrainedSet(f->constrained, rows, p->at, singular));
  HycoDestroyAll(&p->d, &p->l);
  PetscCall(MatCreateVecs(rows, NULL, &p->d));
  PetscCall(VecDuplicate(p->d, &p->l));
  PetscCall(VecGetArray(p->d, &d));
  n = 0;
  for (PetscInt k = 0; k < f->n; k++) {
    if (active[k]) d[n++] = p->bound[k];
  }
  PetscCall(VecRestoreArray(p->d, &d));
  HycoDestroyAll(&rows, &is);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates the contacts' B x, and the forces of the active ones. Forces of the active rows by least squares from
   the residual K x - F. */
static PetscErrorCode ProjectedEvaluate(Run *p, const PetscBool active[])
{
  const Projected *f = p->form;
  HycoSystem y = p->s->system;
  const PetscScalar *v;
  PetscInt n = 0, m;

  PetscFunctionBegin;
  PetscCall(MatMult(y->B, p->x, p->gap));
  PetscCall(VecGetArrayRead(p->gap, &v));
  for (PetscInt k = 0; k < f->n; k++) {
    p->value[k] = v[f->contact[k]];
    p->force[k] = 0;
  }
  PetscCall(VecRestoreArrayRead(p->gap, &v));
  PetscCall(VecGetSize(p->l, &m));
  /* No active contact: all forces are 0. */
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(y->K, p->x, p->r));
  PetscCall(VecAYPX(p->r, -1, y->F));
  PetscCall(HycoConstrainedForces(f->constrained, p->r, p->l));
  PetscCall(VecGetArrayRead(p->l, &v));
  for (PetscInt k = 0; k < f->n; k++) {
    /* Rows of the constraints are the active contacts in their order. */
    if (active[k]) p->force[k] = v[n++];
  }
  PetscCall(VecRestoreArrayRead(p->l, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The present x is the start: sets mostly differ by few contacts. */
static PetscErrorCode SolveOnSet(void *ctx, PetscBool active[], PetscBool *singular)
{
  Run *p = (Run *)ctx;
  PetscInt its;

  PetscFunctionBegin;
  PetscCall(SetConstraints(p, active, singular));
  if (*singular) PetscFunctionReturn(PETSC_SUCCESS);
  /* The size of the loads in the preconditioner's norm, to which residuals are relative. */
  if (p->size < 0) PetscCall(HycoConstrainedSize(p->form->constrained, p->s->system->F, &p->size));
  PetscCall(HycoConstrainedSolve(p->form->constrained, p->s->system->F, p->d, p->accuracy, &p->size, p->x, &its));
  HycoCountLinear(p->s, its);
  PetscCall(ProjectedEvaluate(p, active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Violations below the accuracy of the solve do not change the set. */
static PetscErrorCode ProjectedViolations(void *ctx, const PetscBool active[], PetscBool violates[])
{
  const Run *p = (const Run *)ctx;
  const Projected *f = p->form;
  /* Coarse solves: a force of the size of their error has no sign. */
  const PetscReal noise = PetscMax(HYCO_BELIEVED * p->accuracy, p->s->target > 0 ? 0 : HYCO_SET_NOISE);
  PetscReal size[2] = {0, 0}, sizes[2];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->n; k++) {
    size[0] = PetscMax(size[0], PetscMax(PetscAbsReal(p->bound[k]), PetscAbsReal(p->value[k])));
    size[1] = PetscMax(size[1], PetscAbsReal(p->force[k]));
  }
  PetscCallMPI(MPI_Allreduce(size, sizes, 2, MPIU_REAL, MPI_MAX, HycoComm(p->s)));
  for (PetscInt k = 0; k < f->n; k++)
    violates[k] =
        (PetscBool)(active[k] ? p->force[k] < -noise * sizes[1] : p->value[k] > p->bound[k] + noise * sizes[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets L to the forces of the set, without negative ones. */
static PetscErrorCode FillForces(const Run *p, PetscBool clean, const PetscBool active[], Vec L)
{
  PetscScalar *l;

  PetscFunctionBegin;
  PetscCall(VecSet(L, 0));
  PetscCall(VecGetArray(L, &l));
  for (PetscInt k = 0; k < p->form->n; k++) {
    /* Negative forces of round-off would count as adhesion. */
    if (active[k]) l[p->form->contact[k]] = clean ? PetscMax(p->force[k], 0) : p->force[k];
  }
  PetscCall(VecRestoreArray(L, &l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reduces the accuracy by a factor. A given start may already be more accurate than the present one. By what the
   last solve has reached, if that is less. */
static PetscErrorCode ProjectedSharpen(Run *p, PetscReal factor)
{
  KSP ksp;
  PetscReal left;

  PetscFunctionBegin;
  PetscCall(HycoConstrainedGetKSP(p->form->constrained, &ksp));
  PetscCall(KSPGetResidualNorm(ksp, &left));
  if (p->s->target > 0 && p->size > 0) p->accuracy = PetscMin(p->accuracy, left / p->size);
  p->accuracy = PetscMax(p->accuracy * factor, 0.03 * HYCO_LEAST);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set has converged: solves more accurately, to the final accuracy and further if the residual requires it. With a
   target of the residual, the set of the previous solve goes there directly. */
static PetscErrorCode ProjectedIsSettled(void *ctx, PetscBool *more)
{
  Run *p = (Run *)ctx;
  HycoSolver s = p->s;
  HycoKKT kkt;
  PetscReal missing;

  PetscFunctionBegin;
  *more = PETSC_TRUE;
  if (p->accuracy > 2 * HYCO_LAST && !(s->target > 0 && p->n_sets == 1)) {
    p->accuracy = PetscMax(HYCO_LAST, HYCO_SHARPEN * p->accuracy);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FillForces(p, PETSC_TRUE, p->solved, p->L));
  PetscCall(HycoSystemComputeKKT(s->system, p->x, p->L, &kkt));
  /* By how much the recomputed residual exceeds a third of the tolerance. */
  missing = kkt.stationarity / (0.3 * s->rtol);
  if (s->target > 0) missing = PetscMax(missing, s->system->residual / s->target);
  *more = (PetscBool)(missing > 1 && p->accuracy > HYCO_LEAST);
  if (*more) PetscCall(ProjectedSharpen(p, PetscMin(0.03, 0.3 / missing)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a target the start is 0, so that equal problems have equal iterations. With a target the caller's x is a good
   start, since a path calls again with little changed. */
static PetscErrorCode RunCreate(HycoSolver s, Projected *f, Vec x, Run *p)
{
  PetscFunctionBegin;
  *p = (Run){.s = s, .form = f, .accuracy = HYCO_FIRST, .size = -1, .x = x};
  PetscCall(PetscCalloc5(f->n, &p->bound, f->n, &p->value, f->n, &p->force, f->n, &p->at, f->n, &p->solved));
  if (!(s->target > 0)) PetscCall(VecSet(x, 0));
  PetscCall(VecDuplicate(x, &p->r));
  PetscCall(VecDuplicate(s->system->D, &p->gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For solves without a factor, by the active set method; an obstacle along a whole body is left to the primal form,
   which starts from coarser problems. */
static PetscErrorCode ProjectedAccepts(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                       char why[HYCO_LINE])
{
  Projected *f = (Projected *)form->data;
  HycoSystem y = s->system;
  const PetscBool iterative = (PetscBool)(s->iterative || (asked && s->linear == HYCO_LINEAR_ITERATIVE));
  const PetscBool own = (PetscBool)(s->now.traits & HYCO_TAO_OWN && !(s->now.traits & HYCO_TAO_DENSE));
  PetscBool aij = PETSC_FALSE, same;
  PetscInt p = 0;

  PetscFunctionBegin;
  *cost = -1;
  if (!y->K || !y->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)y->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (aij) PetscCall(HycoKernelSize(y->K, &p));
  if (iterative && own && aij && y->symmetric && !p) {
    PetscCall(HycoOperatorStateUpdate(&f->seen, y->B, NULL, &same));
    if (!same) PetscCall(FindNodes(y, f));
    /* Below the primal form with few contacts, above it with many. */
    if (f->possible) *cost = y->m > HYCO_MANY_SHARE * (PetscReal)y->n ? 2 : 0.5;
  }
  if (asked && *cost < 0)
    HycoFormat(why, "the form projected needs -hyco_linear iterative, the type active_set, a symmetric system with "
                    "supports, and for each contact an unknown of its own; use -hyco_solver_form auto");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multigrid of K; constraints are set for each active set. */
static PetscErrorCode SetUp(HycoSolver s, HycoSolverForm form, PetscBool *singular)
{
  Projected *f = (Projected *)form->data;
  PetscBool same;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  *singular = PETSC_FALSE;
  PetscCall(HycoOperatorStateUpdate(&f->made, s->system->K, NULL, &same));
  /* K is the same: a ramp and a path keep their multigrid. */
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoConstrainedDestroy(&f->constrained));
  PetscCall(HycoConstrainedCreate(HycoComm(s), "hyco_primal_", s->system->K, &f->constrained));
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the number of conjugate-gradient iterations into the report. Iterations of all sets of this solve. */
static PetscErrorCode NameSolves(HycoSolver s, const Projected *f)
{
  KSP ksp;
  char words[64];

  PetscFunctionBegin;
  PetscCall(HycoConstrainedGetKSP(f->constrained, &ksp));
  PetscCall(HycoSolverNoteKSP(s, ksp));
  PetscCall(HycoNameLinear(s, ksp));
  PetscCall(PetscSNPrintf(words, sizeof(words), "; %d iterations in %d solves, at most %d", (int)s->linear_its,
                          (int)s->linear_solves, (int)s->linear_most));
  PetscCall(PetscStrlcat(s->linear_method, words, sizeof(s->linear_method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cold or warm active set; accuracy grows by ProjectedIsSettled(). */
static PetscErrorCode ProjectedSolve(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  Projected *f = (Projected *)form->data;
  HycoActiveSet set = {.comm = HycoComm(s),
                       .n = f->n,
                       .max_its = s->max_its ? s->max_its : 100 + s->system->m,
                       .one_by_one = PETSC_TRUE,
                       .bounds = ProjectedBounds,
                       .solve = SolveOnSet,
                       .violations = ProjectedViolations,
                       .settled = ProjectedIsSettled,
                       .monitor = s->monitor,
                       .monitor_ctx = s->monitor_ctx};
  HycoLCPStatus status;
  PetscBool singular;
  Run p;

  PetscFunctionBegin;
  PetscCall(HycoSolverNameMethod(s, "projected"));
  PetscCall(SetUp(s, form, &singular));
  PetscCall(RunCreate(s, f, x, &p));
  p.L = L;
  set.ctx = &p;
  PetscCall(VecGetOwnershipRange(s->system->D, &set.first, NULL));
  /* A cold start has no contact. */
  if (!s->warm || !f->started) PetscCall(PetscArrayzero(f->active, f->n));
  PetscCall(HycoTaoSetType(f->tao, s->now.type, set.max_its));
  PetscCall(HycoTaoSolveSet(f->tao, &set, f->active, s->system->D, p.gap, &s->its, &status));
  if (status == HYCO_LCP_SINGULAR) s->reason = HYCO_DIVERGED_SINGULAR;
  f->started = *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  PetscCall(NameSolves(s, f));
  PetscCall(FillForces(&p, *solved, p.solved, L)); /* if not solved, the set has changed since */
  /* The multigrid and its constraints stay with the form. */
  PetscCall(PetscFree5(p.bound, p.value, p.force, p.at, p.solved));
  HycoDestroyAll(&p.d, &p.l, &p.r, &p.gap);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProjectedDestroy(HycoSolverForm form)
{
  Projected *f = (Projected *)form->data;

  PetscFunctionBegin;
  PetscCall(HycoTaoDestroy(&f->tao));
  PetscCall(HycoConstrainedDestroy(&f->constrained));
  HycoFreeAll(&f->node, &f->contact, &f->active, &form->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only forces >= 0 (no cones), by the active set method. */
PetscErrorCode HycoSolverFormCreate_Projected(HycoSolver s, HycoSolverForm form)
{
  Projected *f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&f));
  PetscCall(HycoTaoCreate(HycoComm(s), (PetscObject)s, &f->tao));
  form->data = f;
  *form->ops = (struct _HycoSolverFormOps){
      .accepts = ProjectedAccepts, .setup = SetUp, .solve = ProjectedSolve, .destroy = ProjectedDestroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
