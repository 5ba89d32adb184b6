/*
  The primal form, in gap coordinates: of each contact row one unknown (its pivot) is replaced by the row's value, so
  that B x <= D becomes the bound y_p <= D_i. With x = T y: Kg = T^T K T, f = T^T F, and the force of a contact is the
  residual at its pivot, L_i = (f - Kg y)_p. No dense matrix appears, whatever the number of contacts.
*/
#include <hycosolverimpl.h>

/* A warm start that is not over by then began too far off: coarser problems give a better one. */
#define HYCO_WARM_ITS 4
/* Noise of iterative solves while the set changes, and in the last. */
#define HYCO_NOISE_FIRST 1e-5
#define HYCO_NOISE       1e-9

/* The value of a distributed vector at this rank's pivots. */
static PetscErrorCode AtPivots(Vec v, VecScatter scatter, Vec work, PetscInt n, PetscReal out[])
{
  const PetscScalar *w;

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter, v, work, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, v, work, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(work, &w));
  PetscCall(PetscArraycpy(out, w, n));
  PetscCall(VecRestoreArrayRead(work, &w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the iterations share. */
typedef struct {
  PetscInt lo, n; /* this rank's contacts, without the idle ones; their active set begins at lo */
  PetscReal *gap, *value, *force, *diagonal, *at_d;
  PetscReal noise; /* share of the largest force and gap that iterative solves leave */
  PetscInt *at;
  Vec f, rhs, residual, work;
  VecScatter scatter;
} Primal;

/* One pass of the active set: solve, then change every contact that violates (or only the last, after a cycle). */
static PetscErrorCode Step(HycoSolver s, Primal *p, Vec y, PetscBool one, PetscInt *changes)
{
  PetscInt n = 0, local = 0, last = -1, last_all;
  PetscReal size[2] = {0, 0}, sizes[2];
  PetscBool singular;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; k++) {
    if (!s->active[p->lo + k]) continue;
    p->at[n] = s->pivot[k];
    p->at_d[n++] = p->gap[k];
  }
  PetscCall(HycoSolveOnSet(s->Kg, s->Kw, s->ksp_gap, p->f, n, p->at, p->at_d, p->rhs, y, &singular));
  if (singular) s->reason = HYCO_DIVERGED_SINGULAR;
  PetscCall(MatMult(s->Kg, y, p->residual));
  PetscCall(VecAYPX(p->residual, -1, p->f));
  PetscCall(AtPivots(y, p->scatter, p->work, p->n, p->value));
  PetscCall(AtPivots(p->residual, p->scatter, p->work, p->n, p->force));
  for (PetscInt k = 0; k < p->n; k++) {
    size[0] = PetscMax(size[0], PetscMax(PetscAbsReal(p->gap[k]), PetscAbsReal(p->value[k])));
    if (s->active[p->lo + k]) size[1] = PetscMax(size[1], PetscAbsReal(p->force[k]));
  }
  PetscCallMPI(MPI_Allreduce(size, sizes, 2, MPIU_REAL, MPI_MAX, HycoComm(s)));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < p->n; k++) {
      const PetscInt i = p->lo + k;
      const PetscBool flip =
          s->active[i]
              ? p->force[k] < -p->noise * sizes[1] && HycoPulls(p->force[k], sizes[1], p->diagonal[k], p->gap[k])
              : p->value[k] > p->gap[k] + p->noise * sizes[0] && HycoPenetrates(p->value[k], p->gap[k], sizes[0]);

      if (!flip) continue;
      if (pass == 0)
        last = i;
      else if (!one || i == last_all) {
        s->active[i] = (PetscBool)!s->active[i];
        local++;
      }
    }
    if (pass == 0) PetscCallMPI(MPI_Allreduce(&last, &last_all, 1, MPIU_INT, MPI_MAX, HycoComm(s)));
  }
  PetscCallMPI(MPI_Allreduce(&local, changes, 1, MPIU_INT, MPI_SUM, HycoComm(s)));
  s->its++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Hash of the distributed set, the same on every rank. */
static PetscErrorCode SharedHash(HycoSolver s, const Primal *p, unsigned long long *hash)
{
  unsigned long long mine = HycoHash(HycoSetHash(p->n, s->active + p->lo), &p->lo, sizeof(p->lo));

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&mine, hash, 1, MPI_UNSIGNED_LONG_LONG, MPI_BXOR, HycoComm(s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(HycoSolver s, const Primal *p, PetscInt changes)
{
  PetscInt mine = 0, all;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; k++) mine += s->active[p->lo + k];
  PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_INT, MPI_SUM, HycoComm(s)));
  PetscCall(s->monitor(s->its, all, changes, s->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set from coarser problems, where they exist: most unknowns are contacts, coupled with one sign. */
static PetscErrorCode StartFromCoarse(HycoSolver s, const Primal *p, PetscBool *made)
{
  Vec bound, set;

  PetscFunctionBegin;
  *made = PETSC_FALSE;
  if (!s->multilevel || 4 * s->system->m <= s->system->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(p->f, &bound));
  PetscCall(VecDuplicate(p->f, &set));
  PetscCall(VecSet(bound, PETSC_INFINITY));
  for (PetscInt k = 0; k < p->n; k++) PetscCall(VecSetValue(bound, s->pivot[k], p->gap[k], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(bound));
  PetscCall(VecAssemblyEnd(bound));
  PetscCall(HycoMultilevelStart(s->Kg, p->f, bound, set, made));
  if (*made) {
    PetscCall(AtPivots(set, p->scatter, p->work, p->n, p->value));
    for (PetscInt k = 0; k < p->n; k++) s->active[p->lo + k] = (PetscBool)(p->value[k] > 0.5);
  }
  PetscCall(VecDestroy(&bound));
  PetscCall(VecDestroy(&set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterative solves leave residuals of 1 % of `noise`; changes of the set below it are not to be believed. */
static PetscErrorCode SetAccuracy(HycoSolver s, Primal *p, PetscReal noise)
{
  PetscFunctionBegin;
  p->noise = noise;
  PetscCall(KSPSetTolerances(s->ksp_gap, noise / 100, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A set that comes back means a cycle: from then on one contact changes at a time, which ends in exact arithmetic
  (K. G. Murty's least index rule). If a set comes back even so, round-off decides, and the residuals judge.
*/
static PetscErrorCode ActiveSet(HycoSolver s, Primal *p, Vec y, PetscBool *solved)
{
  const PetscInt max_its = s->max_its ? s->max_its : 100 + s->system->m;
  unsigned long long *past;
  PetscInt since = 0, n_free;
  PetscBool one = PETSC_FALSE, again = PETSC_FALSE, fresh = PETSC_FALSE;

  PetscFunctionBegin;
  *solved = PETSC_FALSE;
  PetscCall(PetscMalloc1(max_its + 1, &past));
  if (s->iterative) PetscCall(SetAccuracy(s, p, HYCO_NOISE_FIRST));
  if (!s->warm || !s->started) {
    PetscCall(HycoKernelSize(s->system->K, &n_free));
    for (PetscInt i = 0; i < s->system->m; i++)
      s->active[i] = (PetscBool)(n_free > 0); /* a body that contact alone holds begins held */
    if (!n_free) PetscCall(StartFromCoarse(s, p, &fresh));
    if (fresh) PetscCall(PetscStrlcat(s->method, ", multilevel start", sizeof(s->method)));
  }
  while (s->its < max_its && !*solved && !again && s->reason != HYCO_DIVERGED_SINGULAR) {
    PetscInt changes;

    if (s->warm && s->started && s->its == HYCO_WARM_ITS) { /* the last solution's set is far off */
      PetscCall(StartFromCoarse(s, p, &fresh));
      if (fresh) since = s->its;
    }
    PetscCall(SharedHash(s, p, &past[s->its]));
    for (PetscInt t = since; t < s->its && !again; t++) {
      if (past[t] != past[s->its]) continue;
      again = one;
      one = PETSC_TRUE;
      since = s->its;
    }
    PetscCall(Step(s, p, y, one, &changes));
    if (s->monitor) PetscCall(Report(s, p, changes));
    if (changes == 0 && p->noise > HYCO_NOISE) { /* the set settled: now in earnest */
      PetscCall(SetAccuracy(s, p, HYCO_NOISE));
      since = s->its;
    } else
      *solved = (PetscBool)(changes == 0);
  }
  PetscCall(PetscFree(past));
  s->started = *solved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO on the same bounds. */
static PetscErrorCode BoundQP(HycoSolver s, Primal *p, Vec y, PetscBool *solved)
{
  Mat H;
  Vec lo, hi;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, &lo));
  PetscCall(VecDuplicate(y, &hi));
  PetscCall(VecSet(lo, PETSC_NINFINITY));
  PetscCall(VecSet(hi, PETSC_INFINITY));
  for (PetscInt k = 0; k < p->n; k++) PetscCall(VecSetValue(hi, s->pivot[k], p->gap[k], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(hi));
  PetscCall(VecAssemblyEnd(hi));
  PetscCall(VecSet(y, 0));
  PetscCall(VecPointwiseMin(y, y, hi));
  PetscCall(VecCopy(p->f, p->rhs));
  PetscCall(MatDuplicate(s->Kg, MAT_COPY_VALUES, &H));
  PetscCall(MatSetOption(H, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(HycoTaoSolve(s->tao, s->max_its, H, p->rhs, lo, hi, y, &s->its, solved));
  PetscCall(MatDestroy(&H));
  PetscCall(MatMult(s->Kg, y, p->residual));
  PetscCall(VecAYPX(p->residual, -1, p->f));
  PetscCall(AtPivots(p->residual, p->scatter, p->work, p->n, p->force));
  PetscCall(AtPivots(y, p->scatter, p->work, p->n, p->value));
  for (PetscInt k = 0; k < p->n; k++) { /* a value on its bound has gone through a scale and back */
    const PetscReal ulps = 8 * PETSC_MACHINE_EPSILON * PetscAbsReal(p->gap[k]);

    s->active[p->lo + k] = (PetscBool)(p->value[k] >= p->gap[k] - ulps);
  }
  PetscCall(VecDestroy(&lo));
  PetscCall(VecDestroy(&hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PrimalCreate(HycoSolver s, Vec x, Primal *p)
{
  HycoSystem y = s->system;
  IS is;
  const PetscScalar *d;

  PetscFunctionBegin;
  p->noise = 0;
  PetscCall(VecGetOwnershipRange(y->D, &p->lo, NULL));
  p->n = s->n_pivots;
  PetscCall(
      PetscMalloc6(p->n, &p->gap, p->n, &p->value, p->n, &p->force, p->n, &p->diagonal, p->n, &p->at_d, p->n, &p->at));
  PetscCall(VecGetArrayRead(y->D, &d));
  for (PetscInt k = 0; k < p->n; k++) p->gap[k] = d[s->contact[k]];
  PetscCall(VecRestoreArrayRead(y->D, &d));
  PetscCall(VecDuplicate(x, &p->f));
  PetscCall(VecDuplicate(x, &p->rhs));
  PetscCall(VecDuplicate(x, &p->residual));
  PetscCall(MatMultTranspose(s->T, y->F, p->f));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, p->n, s->pivot, PETSC_COPY_VALUES, &is));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, p->n, &p->work));
  PetscCall(VecScatterCreate(x, is, p->work, NULL, &p->scatter));
  PetscCall(ISDestroy(&is));
  PetscCall(MatGetDiagonal(s->Kg, p->rhs));
  PetscCall(AtPivots(p->rhs, p->scatter, p->work, p->n, p->diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PrimalDestroy(Primal *p)
{
  PetscFunctionBegin;
  PetscCall(PetscFree6(p->gap, p->value, p->force, p->diagonal, p->at_d, p->at));
  PetscCall(VecDestroy(&p->f));
  PetscCall(VecDestroy(&p->rhs));
  PetscCall(VecDestroy(&p->residual));
  PetscCall(VecDestroy(&p->work));
  PetscCall(VecScatterDestroy(&p->scatter));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolvePrimal(HycoSolver s, PetscInt type, Vec x, Vec L, PetscBool *solved)
{
  Primal p;
  Vec y;
  PetscScalar *l;
  PetscBool aij;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)s->system->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCheck(aij, HycoComm(s), PETSC_ERR_USER, "the primal form needs a sparse K (AIJ); use -hyco_solver_form dual");
  PetscCheck(s->system->symmetric && s->system->m, HycoComm(s), PETSC_ERR_USER,
             "the primal form needs a symmetric system with contacts; use -hyco_solver_form dual");
  PetscCall(HycoGapSetUp(s));
  PetscCall(PrimalCreate(s, x, &p));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSet(y, 0));
  PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "%s primal", HycoSolverTypes[type]));
  if (type == HYCO_TYPE_TAO) {
    PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "tao %s primal", HycoTaoTypes[s->tao]));
    PetscCall(BoundQP(s, &p, y, solved));
  } else
    PetscCall(ActiveSet(s, &p, y, solved));
  PetscCall(HycoNameLinear(s, s->ksp_gap));
  PetscCall(MatMult(s->T, y, x));
  PetscCall(VecSet(L, 0));
  PetscCall(VecGetArray(L, &l));
  for (PetscInt k = 0; k < p.n; k++) {
    if (!*solved && type != HYCO_TYPE_TAO) /* the set has changed since: show what the residuals say of it */
      l[s->contact[k]] = p.force[k];
    else if (s->active[p.lo + k])
      l[s->contact[k]] = PetscMax(p.force[k], 0);
  }
  PetscCall(VecRestoreArray(L, &l));
  PetscCall(VecDestroy(&y));
  PetscCall(PrimalDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}
