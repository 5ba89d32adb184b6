/*
  Gap coordinates: for each contact row one unknown (its pivot) is replaced by the row's value, so that B x <= D becomes
  the bound y_p <= D_i. x = T y, Kg = T^T K T.
*/
#include "gap.h"

/* For each contact of this rank (row of B) the unknown with its largest entry that no other contact has; HYCO_IDLE
   for an empty row, HYCO_NO_PIVOT if there is none. *all: every row has a pivot. Collective. */
PetscErrorCode HycoGapPivots(HycoSystem y, PetscInt pivot[], PetscBool *all)
{
  PetscMPIInt bad = 0, any;
  PetscInt lo, hi;
  Mat Bt = y->Bt;
  Vec count, mine;
  PetscInt first, last;
  PetscScalar *c;
  VecScatter scatter;
  IS is;
  PetscInt *need, n_need = 0, at = 0;
  const PetscScalar *shared;

  PetscFunctionBegin;
  /* the number of contacts of each unknown in this rank's rows */
  PetscCall(MatCreateVecs(Bt, NULL, &count));
  PetscCall(MatGetOwnershipRange(Bt, &first, &last));
  PetscCall(VecGetArray(count, &c));
  for (PetscInt r = first; r < last; r++) {
    PetscInt n;

    PetscCall(MatGetRow(Bt, r, &n, NULL, NULL));
    c[r - first] = n;
    PetscCall(MatRestoreRow(Bt, r, &n, NULL, NULL));
  }
  PetscCall(VecRestoreArray(count, &c));
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  /* The columns of this rank's rows of B: counted, then listed. Their counts may be on other ranks. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    if (pass) PetscCall(PetscMalloc1(n_need, &need));
    n_need = 0;
    for (PetscInt r = lo; r < hi; r++) {
      PetscInt n;
      const PetscInt *cols;

      PetscCall(MatGetRow(y->B, r, &n, &cols, NULL));
      for (PetscInt k = 0; k < n; k++, n_need++) {
        if (pass) need[n_need] = cols[k];
      }
      PetscCall(MatRestoreRow(y->B, r, &n, &cols, NULL));
    }
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n_need, need, PETSC_OWN_POINTER, &is));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n_need, &mine));
  PetscCall(VecScatterCreate(count, is, mine, NULL, &scatter));
  PetscCall(HycoScatter(scatter, count, mine));
  /* Counts are exact in reals; 1.5 allows for none. */
  PetscCall(VecGetArrayRead(mine, &shared));
  for (PetscInt r = lo; r < hi; r++) {
    PetscInt n;
    const PetscInt *cols;
    const PetscScalar *vals;
    PetscReal best = 0;

    PetscCall(MatGetRow(y->B, r, &n, &cols, &vals));
    pivot[r - lo] = n ? HYCO_NO_PIVOT : HYCO_IDLE;
    for (PetscInt k = 0; k < n; k++, at++) {
      /* The margin makes the choice among equal entries the first one on any number of ranks. The largest entry
         keeps 1 / B_ip, and thus the condition of T, small. */
      if (shared[at] < 1.5 && PetscAbsScalar(vals[k]) > best * (1 + 1e-12)) {
        best = PetscAbsScalar(vals[k]);
        pivot[r - lo] = cols[k];
      }
    }
    PetscCall(MatRestoreRow(y->B, r, &n, &cols, &vals));
    bad = bad || pivot[r - lo] == HYCO_NO_PIVOT;
  }
  PetscCallMPI(MPI_Allreduce(&bad, &any, 1, MPI_INT, MPI_MAX, HycoComm(y)));
  *all = (PetscBool)!any;
  PetscCall(VecRestoreArrayRead(mine, &shared));
  HycoDestroyAll(&scatter, &is, &mine, &count);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the gap coordinates exist for this B. Collective. They exist if each contact has an unknown that no other
   has. */
PetscErrorCode HycoGapPossible(HycoSystem y, PetscBool *possible)
{
  PetscInt lo, hi, *pivot;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  PetscCall(PetscMalloc1(hi - lo, &pivot));
  PetscCall(HycoGapPivots(y, pivot, possible));
  PetscCall(PetscFree(pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether every contact row has one entry: T is then diagonal. For instance obstacles with a normal along an axis. */
static PetscErrorCode OneEach(Mat B, PetscBool *diagonal)
{
  PetscInt lo, hi;
  PetscMPIInt more = 0, any;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(B, &lo, &hi));
  for (PetscInt r = lo; r < hi && !more; r++) {
    PetscInt n;

    PetscCall(MatGetRow(B, r, &n, NULL, NULL));
    /* An empty row is no obstacle: the contact is idle. */
    more = n > 1;
    PetscCall(MatRestoreRow(B, r, &n, NULL, NULL));
  }
  PetscCallMPI(MPI_Allreduce(&more, &any, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)B)));
  *diagonal = (PetscBool)!any;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Kg = T^T K T if each contact is on one unknown: without a matrix product. T = diag(1 / B_ip), so that the product
   is a scaling of rows and columns. */
static PetscErrorCode ScaleOnly(HycoSystem y, Gap *s)
{
  PetscInt lo, hi, n;
  Vec t;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(y->K, &t, NULL));
  PetscCall(VecSet(t, 1));
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  for (PetscInt r = lo; r < hi; r++) {
    const PetscScalar *vals;

    /* An idle contact has no unknown: T stays 1 there. */
    if (s->pivot[r - lo] == HYCO_IDLE) continue;
    PetscCall(MatGetRow(y->B, r, &n, NULL, &vals));
    PetscCall(VecSetValue(t, s->pivot[r - lo], 1 / vals[0], INSERT_VALUES));
    PetscCall(MatRestoreRow(y->B, r, &n, NULL, &vals));
  }
  PetscCall(HycoVecAssemble(t));
  PetscCall(VecGetLocalSize(t, &n));
  PetscCall(MatDestroy(&s->T));
  PetscCall(MatCreateAIJ(HycoComm(y), n, n, y->n, y->n, 1, NULL, 0, NULL, &s->T));
  PetscCall(MatDiagonalSet(s->T, t, INSERT_VALUES));
  PetscCall(MatDuplicate(y->K, MAT_COPY_VALUES, &s->Kg));
  PetscCall(MatDiagonalScale(s->Kg, t, t));
  PetscCall(VecDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T = I, except in a pivot's row: x_p = (y_p - sum_j B_ij y_j) / B_ip. Two passes: a MATPREALLOCATOR records the
   pattern, then the values follow. Other ranks own some pivots' rows. */
static PetscErrorCode BuildT(HycoSystem y, Gap *s)
{
  PetscInt lo, hi, first, last, bs;
  Mat shape;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(y->K, &first, &last));
  PetscCall(MatGetBlockSize(y->K, &bs));
  PetscCall(MatCreate(HycoComm(y), &shape));
  PetscCall(MatSetSizes(shape, last - first, last - first, y->n, y->n));
  PetscCall(MatSetBlockSize(shape, bs)); /* multigrid coarsens by node */
  PetscCall(MatSetType(shape, MATPREALLOCATOR));
  PetscCall(MatSetUp(shape));
  PetscCall(MatDestroy(&s->T));
  PetscCall(MatCreate(HycoComm(y), &s->T));
  PetscCall(MatSetSizes(s->T, last - first, last - first, y->n, y->n));
  PetscCall(MatSetBlockSize(s->T, bs));
  PetscCall(MatSetType(s->T, MATAIJ));
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  for (PetscInt pass = 0; pass < 2; pass++) {
    Mat A = pass ? s->T : shape;

    if (pass) PetscCall(MatPreallocatorPreallocate(shape, PETSC_TRUE, A));
    /* The flush orders the two: a pivot's row, which another rank may set, must overwrite this 1. */
    for (PetscInt r = first; r < last; r++) PetscCall(MatSetValue(A, r, r, 1, INSERT_VALUES));
    PetscCall(MatAssemblyBegin(A, MAT_FLUSH_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FLUSH_ASSEMBLY));
    for (PetscInt r = lo; r < hi; r++) {
      const PetscInt p = s->pivot[r - lo];
      PetscInt n;
      const PetscInt *cols;
      const PetscScalar *vals;
      PetscScalar Bp = 1;

      PetscCall(MatGetRow(y->B, r, &n, &cols, &vals));
      for (PetscInt k = 0; k < n; k++) {
        if (cols[k] == p) Bp = vals[k];
      }
      for (PetscInt k = 0; k < n; k++)
        PetscCall(MatSetValue(A, p, cols[k], cols[k] == p ? 1 / Bp : -vals[k] / Bp, INSERT_VALUES));
      PetscCall(MatRestoreRow(y->B, r, &n, &cols, &vals));
    }
    PetscCall(HycoMatAssemble(A));
  }
  PetscCall(MatDestroy(&shape));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the idle contacts from pivot, contact and the active set. Empty rows have no unknown, thus neither a bound
   nor a force. */
static PetscErrorCode DropIdle(Gap *s, PetscInt n)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(s->contact));
  PetscCall(PetscMalloc1(n, &s->contact));
  s->n = 0;
  for (PetscInt k = 0; k < n; k++) {
    if (s->pivot[k] == HYCO_IDLE) continue;
    s->contact[s->n] = k;
    /* In place: s->n never overtakes k. */
    s->pivot[s->n++] = s->pivot[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = T^-1 x: at each pivot the contact's B x. */
static PetscErrorCode ToGaps(HycoSystem s, const Gap *q, Vec x, Vec y)
{
  Vec gap;
  const PetscScalar *g;

  PetscFunctionBegin;
  /* Other unknowns stay what they are. */
  PetscCall(VecCopy(x, y));
  PetscCall(MatCreateVecs(s->B, NULL, &gap));
  PetscCall(MatMult(s->B, x, gap));
  PetscCall(VecGetArrayRead(gap, &g));
  for (PetscInt k = 0; k < q->n; k++) PetscCall(VecSetValue(y, q->pivot[k], g[q->contact[k]], INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(gap, &g));
  PetscCall(HycoVecAssemble(y));
  PetscCall(VecDestroy(&gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attaches K's near-null space to Kw, in gap coordinates, for multigrid. Orthonormalised, as multigrid expects; the
   modes of x are no modes of y. */
static PetscErrorCode NearKernel(HycoSystem s, const Gap *g)
{
  MatNullSpace near = NULL, mine;
  PetscBool constant;
  PetscInt n;
  const Vec *x;
  Vec *y;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(s->K, &near));
  if (!near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &x));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicateVecs(x[0], n, &y));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(ToGaps(s, g, x[k], y[k]));
    /* Modified Gram-Schmidt; the modes are few and nearly independent. */
    for (PetscInt j = 0; j < k; j++) {
      PetscScalar dot;

      PetscCall(VecDot(y[k], y[j], &dot));
      PetscCall(VecAXPY(y[k], -dot, y[j]));
    }
    PetscCall(VecNormalize(y[k], NULL));
  }
  PetscCall(MatNullSpaceCreate(HycoComm(s), PETSC_FALSE, n, y, &mine));
  PetscCall(MatSetNearNullSpace(g->Kw, mine));
  PetscCall(MatNullSpaceDestroy(&mine));
  PetscCall(VecDestroyVecs(n, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A new solver for the new Kw: KSPReset() leaves the levels of GAMG (PETSc 3.18), whose sizes change. */
static PetscErrorCode RenewSolver(HycoSolver s, Gap *g)
{
  PetscFunctionBegin;
  PetscCall(KSPDestroy(&g->ksp));
  if (s->iterative) PetscCall(NearKernel(s->system, g));
  PetscCall(s->iterative ? HycoIterativeSolver(HycoComm(s), "hyco_primal_", g->Kw, &g->ksp)
                         : HycoDirectSolver(HycoComm(s), "hyco_primal_", g->Kw, PETSC_TRUE, &g->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T, Kg and the solver for the current K and B; nothing is done if both are unchanged. The last active set stays if
   the contacts are the same. Collective. */
PetscErrorCode HycoGapSetUp(HycoSolver s, Gap *g)
{
  HycoSystem y = s->system;
  PetscBool same, possible = PETSC_FALSE, diagonal = PETSC_FALSE;
  PetscInt lo, hi, before = g->n;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  PetscCall(HycoOperatorStateUpdate(&g->transformed, y->K, y->B, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(y->B, &lo, &hi));
  PetscCall(PetscFree(g->pivot));
  PetscCall(PetscMalloc1(hi - lo, &g->pivot));
  PetscCall(HycoGapPivots(y, g->pivot, &possible));
  /* Else the next call would find the operators unchanged, and use the old T. */
  if (!possible) g->transformed.K = 0;
  PetscCheck(possible, HycoComm(s), PETSC_ERR_USER,
             "the primal form needs an unknown of its own for each contact; use -hyco_solver_form dual");
  HycoDestroyAll(&g->Kg, &g->Kw, &g->H);
  PetscCall(OneEach(y->B, &diagonal));
  if (diagonal)
    PetscCall(ScaleOnly(y, g));
  else {
    PetscCall(BuildT(y, g));
    PetscCall(MatPtAP(y->K, g->T, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &g->Kg));
  }
  PetscCall(DropIdle(g, hi - lo));
  PetscCall(MatSetOption(g->Kg, MAT_SYMMETRIC, PETSC_TRUE));
  /* Kw is changed for each set; Kg stays for the residuals, which are the forces. */
  PetscCall(MatDuplicate(g->Kg, MAT_COPY_VALUES, &g->Kw));
  PetscCall(HycoGapWork(g->Kw));
  PetscCall(RenewSolver(s, g));
  /* A rank's number may be the same while another's has changed: all drop their sets together. */
  before = (PetscInt)(!g->active || g->m != y->m || before != g->n);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &before, 1, MPIU_INT, MPI_MAX, HycoComm(s)));
  if (before) {
    PetscCall(PetscFree(g->active));
    PetscCall(PetscCalloc1(g->n + 1, &g->active));
    g->m = y->m;
    g->started = PETSC_FALSE;
  }
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of a work copy: symmetric positive definite, and rows that are zeroed keep their entries, so that the
   pattern and the analysis stay. */
PetscErrorCode HycoGapWork(Mat Kw)
{
  PetscFunctionBegin;
  PetscCall(MatSetOption(Kw, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(Kw, MAT_SPD, PETSC_TRUE));
  PetscCall(MatSetOption(Kw, MAT_KEEP_NONZERO_PATTERN, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step of refinement makes the residual small entry by entry (R. D. Skeel, Math. Comp. 35, 1980). Needed for the
   forces: they are residuals at the pivots. */
static PetscErrorCode SolveRefined(Mat Kw, KSP ksp, Vec rhs, Vec y)
{
  Vec r, dy;
  PetscBool iterative;

  PetscFunctionBegin;
  PetscCall(KSPSolve(ksp, rhs, y));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &iterative)); /* an iterative solver has its own accuracy */
  if (iterative) PetscFunctionReturn(PETSC_SUCCESS);
  HycoVecDuplicate(y, &r, &dy);
  PetscCall(MatMult(Kw, y, r));
  PetscCall(VecAYPX(r, -1, rhs));
  PetscCall(KSPSolve(ksp, r, dy));
  PetscCall(VecAXPY(y, 1, dy));
  HycoDestroyAll(&r, &dy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y: Kg y = f with y = d on the unknowns a (global numbers, this rank's), by elimination of these in the copy Kw.
   The mean diagonal in eliminated rows keeps the matrix well scaled. Collective. */
PetscErrorCode HycoSolveOnSet(Mat Kg, Mat Kw, KSP ksp, Vec f, PetscInt n, const PetscInt a[], const PetscReal d[],
                              Vec rhs, Vec y, PetscBool *singular)
{
  PetscScalar mean;
  PetscInt size;

  PetscFunctionBegin;
  /* Kg is needed again for the next set. */
  PetscCall(MatCopy(Kg, Kw, SAME_NONZERO_PATTERN));
  PetscCall(MatGetSize(Kg, &size, NULL));
  PetscCall(MatGetDiagonal(Kg, rhs));
  PetscCall(VecSum(rhs, &mean));
  mean /= size;
  for (PetscInt k = 0; k < n; k++) PetscCall(VecSetValue(y, a[k], d[k], INSERT_VALUES));
  PetscCall(HycoVecAssemble(y));
  PetscCall(VecCopy(f, rhs));
  PetscCall(MatZeroRowsColumns(Kw, n, a, mean, y, rhs));
  PetscCall(KSPSetOperators(ksp, Kw, Kw));
  PetscCall(HycoFactor(ksp, singular));
  if (!*singular) PetscCall(SolveRefined(Kw, ksp, rhs, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
