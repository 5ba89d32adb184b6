/* HycoSystem: references K, Bt, B, F, D; recomputes the KKT residuals. */
#include <hycosolverimpl.h>

/* References only: matrices and vectors stay the caller's, and may change between solves. */
PetscErrorCode HycoSystemCreate(MPI_Comm comm, HycoSystem *system)
{
  PetscFunctionBegin;
  HycoCheckGiven(system);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*system, HYCO_SYSTEM_CLASSID, "HycoSystem", "Contact system", "Hyco", comm,
                              HycoSystemDestroy, HycoSystemView));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Created again from the new vectors, whose layout may differ. */
PetscErrorCode HycoSystemFreeWork(HycoSystem s)
{
  PetscFunctionBegin;
  HycoDestroyAll(&s->work_x[0], &s->work_x[1], &s->work_L, &s->work_W);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work vectors are created at the first use: many systems never need them. */
PetscErrorCode HycoSystemWork(HycoSystem s)
{
  PetscFunctionBegin;
  if (s->F && !s->work_x[0]) HycoVecDuplicate(s->F, &s->work_x[0], &s->work_x[1]);
  if (s->m && !s->work_L) PetscCall(VecDuplicate(s->D, &s->work_L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives up the references; the objects live as long as their owners keep them. */
PetscErrorCode HycoSystemDestroy(HycoSystem *system)
{
  HycoSystem s;

  PetscFunctionBegin;
  HycoDestroyBegin(system, HYCO_SYSTEM_CLASSID);
  s = *system;
  HycoDestroyAll(&s->K, &s->Bt, &s->B, &s->W, &s->F, &s->D);
  PetscCall(HycoBlocksDestroy(&s->blocks));
  PetscCall(HycoSystemFreeWork(s));
  PetscCall(PetscHeaderDestroy(system));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K = 0: all x are free, and Bt is the transpose of B. */
static PetscErrorCode SetFree(HycoSystem s, Mat B)
{
  PetscBool dense;
  PetscInt lda = 0;

  PetscFunctionBegin;
  HycoCheckGiven(B);
  PetscCall(PetscObjectTypeCompare((PetscObject)B, MATSEQDENSE, &dense));
  if (dense) PetscCall(MatDenseGetLDA(B, &lda));
  PetscCall(MatGetSize(B, &s->m, &s->n));
  PetscCheck(dense && (lda == s->m || !s->m), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "without K, B must be dense on one process, without gaps");
  PetscCall(PetscObjectReference((PetscObject)B));
  HycoDestroyAll(&s->K, &s->B, &s->Bt, &s->W);
  s->B = B;
  s->symmetric = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* References K, Bt (n x m), B (m x n); Bt need not be the transpose of B in reduced systems. Replaces a given
   flexibility. */
PetscErrorCode HycoSystemSetMatrices(HycoSystem s, Mat K, Mat Bt, Mat B, PetscBool symmetric)
{
  PetscInt rows, cols;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  if (!K) {
    PetscCall(SetFree(s, B));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(K, &rows, &cols));
  PetscCheck(rows == cols, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "K is %d x %d; it must be square", (int)rows, (int)cols);
  PetscCheck(!B == !Bt, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "B and Bt must both be given, or neither");
  s->n = rows;
  s->m = 0;
  if (B) {
    PetscInt tr, tc;

    PetscCall(MatGetSize(B, &s->m, &cols));
    PetscCall(MatGetSize(Bt, &tr, &tc));
    PetscCheck(cols == s->n && tr == s->n && tc == s->m, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
               "B is %d x %d and Bt %d x %d with K of size %d: they do not match", (int)s->m, (int)cols, (int)tr,
               (int)tc, (int)s->n);
    PetscCall(PetscObjectReference((PetscObject)B));
    PetscCall(PetscObjectReference((PetscObject)Bt));
  }
  /* References first, then the old ones are given up: the new object may be the old one. */
  PetscCall(PetscObjectReference((PetscObject)K));
  HycoDestroyAll(&s->K, &s->B, &s->Bt, &s->W);
  s->K = K;
  s->B = B;
  s->Bt = Bt;
  s->symmetric = symmetric;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed; any pointer may be NULL. */
PetscErrorCode HycoSystemGetMatrices(HycoSystem s, Mat *K, Mat *Bt, Mat *B)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  if (K) *K = s->K;
  if (Bt) *Bt = s->Bt;
  if (B) *B = s->B;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* References F (n) and D (m). */
PetscErrorCode HycoSystemSetVectors(HycoSystem s, Vec F, Vec D)
{
  PetscInt n, m = 0;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  HycoCheckGiven(F);
  PetscCall(VecGetSize(F, &n));
  if (D) PetscCall(VecGetSize(D, &m));
  PetscCheck(s->K || s->B, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoSystemSetMatrices() before HycoSystemSetVectors()");
  PetscCheck(n == s->n && m == s->m, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "F has length %d and D %d where %d and %d are expected", (int)n, (int)m, (int)s->n, (int)s->m);
  PetscCall(PetscObjectReference((PetscObject)F));
  if (D) PetscCall(PetscObjectReference((PetscObject)D));
  /* Work vectors have the layout of F and D. */
  if (F != s->F || D != s->D) PetscCall(HycoSystemFreeWork(s));
  HycoDestroyAll(&s->F, &s->D);
  s->F = F;
  s->D = D;
  s->rounding = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoSystemSetRounding(HycoSystem s, PetscReal rounding)
{
  s->rounding = rounding;
}

/* Borrowed; F is NULL where the flexibility is given, and D is then the gap without forces. */
PetscErrorCode HycoSystemGetVectors(HycoSystem s, Vec *F, Vec *D)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  if (F) *F = s->F;
  if (D) *D = s->D;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails unless the blocks cover these rows. On every rank with its own rows. */
static PetscErrorCode CheckCover(PetscInt n_cones, const HycoCone cones[], PetscInt n, const PetscInt cone_of[],
                                 const PetscReal data[], PetscInt rows)
{
  HycoBlocks *blocks;
  PetscInt covered;

  PetscFunctionBegin;
  PetscCall(HycoBlocksCreate(n_cones, cones, n, cone_of, data, &blocks));
  covered = blocks->row[n];
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscCheck(covered == rows, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "the blocks have %d components, and the system has %d rows on this rank; they must be as many",
             (int)covered, (int)rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of rows on this rank. */
static PetscErrorCode CountRows(HycoSystem s, PetscInt *rows)
{
  PetscFunctionBegin;
  *rows = 0;
  if (s->W || s->B) PetscCall(MatGetLocalSize(s->W ? s->W : s->B, rows, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks of rows with their cones, in the order of this rank's rows; n_cones 0 or nonnegative cones alone: none.
   Collective. */
PetscErrorCode HycoSystemSetBlocks(HycoSystem s, PetscInt n_cones, const HycoCone cones[], PetscInt n_blocks,
                                   const PetscInt cone_of[], const PetscReal data[])
{
  PetscInt rows;
  PetscBool other = PETSC_FALSE; /* a law that is not each row's force >= 0 */

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  PetscCheck(!n_cones || s->K || s->W, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoSystemSetMatrices() or HycoSystemSetFlexibility() before HycoSystemSetBlocks()");
  PetscCall(CountRows(s, &rows));
  if (n_cones) HycoOnEach(HycoComm(s), CheckCover(n_cones, cones, n_blocks, cone_of, data, rows));
  for (PetscInt c = 0; c < n_cones; c++) other = (PetscBool)(other || !cones[c]->nonnegative);
  PetscCall(HycoBlocksDestroy(&s->blocks));
  /* Nonnegative cones alone are the plain problem, for which all methods exist. */
  if (other) PetscCall(HycoBlocksCreate(n_cones, cones, n_blocks, cone_of, data, &s->blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only where there are cones: other methods need a regular K to stay regular. */
void HycoSystemSetSoft(HycoSystem s, const HycoSoft *soft)
{
  s->soft = soft && soft->n ? soft : NULL;
}

PetscErrorCode HycoSystemMotions(HycoSystem s, PetscInt *n, const Vec *v[], const PetscReal *stiffness[])
{
  PetscFunctionBegin;
  *stiffness = s->soft && s->blocks ? s->soft->stiffness : NULL;
  if (!s->soft || !s->blocks) {
    PetscCall(HycoKernelVectors(s->K, n, v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  *n = s->soft->n;
  *v = s->soft->v;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemPinned(HycoSystem s, PetscInt *n)
{
  PetscFunctionBegin;
  if (s->soft && s->blocks)
    *n = s->soft->n;
  else
    PetscCall(HycoKernelSize(s->K, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemPin(HycoSystem s, HycoDirect direct)
{
  PetscInt *pinned;

  PetscFunctionBegin;
  if (!s->soft || !s->blocks) {
    PetscCall(HycoDirectPinKernel(direct, s->K));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(s->soft->n, &pinned));
  PetscCall(HycoMotionPins(s->soft->n, s->soft->v, pinned));
  PetscCall(HycoDirectPin(direct, s->soft->n, pinned));
  PetscCall(PetscFree(pinned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrices may have been replaced since the blocks were set. */
PetscErrorCode HycoSystemCheckBlocks(HycoSystem s)
{
  PetscInt rows;
  int fits, all;

  PetscFunctionBegin;
  if (!s->blocks) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CountRows(s, &rows));
  fits = s->blocks->row[s->blocks->n] == rows;
  PetscCallMPI(MPI_Allreduce(&fits, &all, 1, MPI_INT, MPI_MIN, HycoComm(s)));
  PetscCheck(all, HycoComm(s), PETSC_ERR_ORDER,
             "the matrices have other rows than the blocks; call HycoSystemSetBlocks() after them");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest of the four: a solution counts as solved by it. */
PetscReal HycoKKTMax(const HycoKKT *kkt)
{
  if (!kkt) return PETSC_MAX_REAL;
  return PetscMax(PetscMax(kkt->stationarity, kkt->penetration), PetscMax(kkt->adhesion, kkt->complementarity));
}

/* 0 / 0 is 0: without forces and gaps there is no violation; x / 0 and NaN are infinite. */
static PetscReal SystemQuotient(PetscReal a, PetscReal b)
{
  if (PetscIsInfOrNanReal(a) || PetscIsInfOrNanReal(b)) return PETSC_MAX_REAL;
  return a == 0 ? 0 : b > 0 ? a / b : PETSC_MAX_REAL;
}

/* Removes from r the part due to the rounding of x, entries of at most 16 eps (|K_ii x_i| + |F_i|); returns their
   norm. Rounding x to doubles leaves a residual of this size whatever the solver does. *terms: the norm of K_ii x_i. */
static PetscErrorCode DropRounding(HycoSystem s, Vec x, Vec r, Vec diagonal, PetscReal *dropped, PetscReal *terms)
{
  PetscInt n;
  PetscReal squares[2] = {0, 0}, sum[2];
  PetscScalar *residual;
  const PetscScalar *K, *X, *F;

  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(s->K, diagonal));
  PetscCall(VecGetLocalSize(r, &n));
  PetscCall(VecGetArray(r, &residual));
  PetscCall(VecGetArrayRead(diagonal, &K));
  PetscCall(VecGetArrayRead(x, &X));
  PetscCall(VecGetArrayRead(s->F, &F));
  for (PetscInt i = 0; i < n; i++) {
    squares[1] += PetscSqr(K[i] * X[i]);
    /* Negated, so that a NaN stays in the residual. */
    if (!(PetscAbsReal(residual[i]) <= HYCO_NOTHING * (PetscAbsReal(K[i] * X[i]) + PetscAbsReal(F[i])))) continue;
    squares[0] += residual[i] * residual[i];
    residual[i] = 0;
  }
  PetscCall(VecRestoreArrayRead(x, &X));
  PetscCall(VecRestoreArrayRead(s->F, &F));
  PetscCall(VecRestoreArrayRead(diagonal, &K));
  PetscCall(VecRestoreArray(r, &residual));
  PetscCallMPI(MPI_Allreduce(squares, sum, 2, MPIU_REAL, MPI_SUM, HycoComm(s)));
  *dropped = PetscSqrtReal(sum[0]);
  *terms = PetscSqrtReal(sum[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the forces, a floating body's residual: a tenth of the tolerance of 1e-8; more is tested for the round-off of all
   terms of a row, because the body moves without any force. */
#define FLOATING_RESIDUAL 1e-9

/* The same by all terms of a row, which are more than the diagonal's: at most 4 eps sum |K_ij x_j|. Adds to *dropped.
   For K with a null space, whose x has no bound; each rank needs all of x. Collective. */
static PetscErrorCode DropTerms(HycoSystem s, Vec x, Vec r, PetscReal *dropped)
{
  PetscReal *all, square = 0;
  PetscInt lo, hi;
  PetscScalar *residual;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n, &all));
  PetscCall(HycoVecGather(x, all));
  PetscCall(MatGetOwnershipRange(s->K, &lo, &hi));
  PetscCall(VecGetArray(r, &residual));
  for (PetscInt i = lo; i < hi; i++) {
    PetscInt n;
    const PetscInt *cols;
    const PetscScalar *K;
    PetscReal sum = 0;

    if (residual[i - lo] == 0) continue;
    PetscCall(MatGetRow(s->K, i, &n, &cols, &K));
    for (PetscInt k = 0; k < n; k++) sum += PetscAbsReal(K[k] * all[cols[k]]);
    PetscCall(MatRestoreRow(s->K, i, &n, &cols, &K));
    if (!(PetscAbsReal(residual[i - lo]) <= 4 * PETSC_MACHINE_EPSILON * sum)) continue;
    square += PetscSqr(residual[i - lo]);
    residual[i - lo] = 0;
  }
  PetscCall(VecRestoreArray(r, &residual));
  HycoAllreduce(&square, 1, MPIU_REAL, MPI_SUM, HycoComm(s));
  *dropped = PetscSqrtReal(PetscSqr(*dropped) + square);
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |K x + Bt L - F|, and the part of F - Bt L that no x balances if K is singular: it is computed from the forces
   only, because K x has the round-off of x, which is unlimited there. Relative to the forces: where |K x| is above
   their sum, it is round-off too. Relative to the larger of |B^T L| and |F|; collective. */
static PetscErrorCode SystemStationarity(HycoSystem s, Vec x, Vec L, PetscReal *value, PetscReal *rounding)
{
  Vec Kx = s->work_x[0], BtL = s->work_x[1];
  MatNullSpace kernel = NULL;
  PetscReal nK, nB = 0, nF, nr, size, dropped = 0, terms = 0, free_work;

  PetscFunctionBegin;
  PetscCall(VecNorm(s->F, NORM_2, &nF));
  if (s->m) {
    PetscCall(MatMult(s->Bt, L, BtL));
    PetscCall(VecNorm(BtL, NORM_2, &nB));
  }
  PetscCall(HycoKernelWork(s->K, x, s->F, s->m ? BtL : NULL, &free_work));
  PetscCall(MatMult(s->K, x, Kx));
  PetscCall(VecNorm(Kx, NORM_2, &nK));
  if (s->m) PetscCall(VecAXPY(Kx, 1, BtL));
  PetscCall(VecAXPY(Kx, -1, s->F));
  PetscCall(DropRounding(s, x, Kx, BtL, &dropped, &terms));
  PetscCall(VecNorm(Kx, NORM_2, &nr));
  size = PetscMax(PetscMin(nK, nB + nF), PetscMax(nB, nF));
  PetscCall(MatGetNullSpace(s->K, &kernel));
  if (kernel && nr > FLOATING_RESIDUAL * size && nr < 1e-3 * size) {
    PetscCall(DropTerms(s, x, Kx, &dropped));
    PetscCall(VecNorm(Kx, NORM_2, &nr));
  }
  /* Without any force x is a rigid motion, whose K x is round-off of its terms. */
  if (size == 0) size = terms;
  /* Absolute: paths compare it with Newton's residual. */
  s->residual = nr;
  *value = PetscMax(SystemQuotient(nr, size), free_work);
  *rounding = SystemQuotient(dropped, size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residuals of the blocks' laws with the gaps w of the size size_w; size_L: that of the forces, `instead` if it
   is 0. The scale makes forces and gaps comparable: the law's residual is P(L - rho w) - L. */
static PetscErrorCode BlockKKT(HycoSystem s, const PetscReal w[], const PetscReal l[], PetscReal size_w,
                               PetscReal size_L, PetscReal instead, HycoKKT *kkt)
{
  const PetscReal force = size_L > 0 ? size_L : instead > 0 ? instead : 1;
  HycoNaturalMap map;
  PetscReal local[3], worst[3];

  PetscFunctionBegin;
  /* The map's parts: what is missing of a force, what lies outside its cone, and their difference. */
  PetscCall(HycoBlocksNaturalMap(s->blocks, size_w > 0 ? force / size_w : 1, l, w, &map));
  local[0] = map.missing, local[1] = map.outside, local[2] = map.map;
  /* Blocks are on the ranks of their rows. */
  PetscCallMPI(MPI_Allreduce(local, worst, 3, MPIU_REAL, MPI_MAX, HycoComm(s)));
  kkt->penetration = SystemQuotient(worst[0], force);
  kkt->adhesion = SystemQuotient(worst[1], force);
  kkt->complementarity = SystemQuotient(worst[2], force);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What stands for the size of the forces where there are none: the loads, or the gap over the largest flexibility. */
static PetscErrorCode InsteadOfForces(HycoSystem s, PetscReal *force)
{
  Vec diagonal;
  PetscReal size;

  PetscFunctionBegin;
  if (s->F) {
    PetscCall(VecNorm(s->F, NORM_INFINITY, &size));
    *force = s->size_B > 0 ? size / s->size_B : 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(s->D, &diagonal));
  PetscCall(MatGetDiagonal(s->W, diagonal));
  PetscCall(VecMax(diagonal, NULL, &size));
  PetscCall(VecDestroy(&diagonal));
  *force = SystemQuotient(s->size, size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemGaps(HycoSystem s, Vec x, Vec L, Vec w)
{
  PetscBool same;
  PetscReal size_x = 0, size_D = 0;

  PetscFunctionBegin;
  s->size = 0;
  if (s->n) {
    PetscCall(MatMult(s->B, x, w));
    PetscCall(VecAYPX(w, -1, s->D));
    /* The norm of B is computed once per B. */
    PetscCall(HycoOperatorStateUpdate(&s->seen_B, s->B, NULL, &same));
    if (!same) PetscCall(MatNorm(s->B, NORM_INFINITY, &s->size_B));
    PetscCall(VecNorm(x, NORM_INFINITY, &size_x));
    /* The size of the terms of D - B x, whose cancellation limits what any solver can reach. */
    s->size = s->size_B * size_x;
  } else
    PetscCall(VecCopy(s->D, w));
  if (s->K) PetscCall(VecNorm(s->D, NORM_INFINITY, &size_D));
  s->size = PetscMax(size_D, s->size);
  if (s->W) PetscCall(HycoSystemAddCompliance(s, L, w, &s->size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On one process there is nothing to exchange, not even with MPI's functions. */
PetscErrorCode HycoSystemMost(HycoSystem s, PetscMPIInt n, PetscReal value[])
{
  PetscFunctionBegin;
  if (HycoSize(HycoComm(s)) > 1) HycoAllreduce(value, n, MPIU_REAL, MPI_MAX, HycoComm(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Penetration, adhesion and complementarity of forces >= 0 with the gaps in `gap`; *beyond: the largest without the
   effect of rounding the terms of the gaps. Quotients first: products may overflow. */
static PetscErrorCode SystemSigns(HycoSystem s, Vec gap, Vec L, PetscReal size_L, HycoKKT *kkt, PetscReal *beyond)
{
  const PetscScalar *w, *l;
  PetscInt m;
  PetscReal worst[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(gap, &m));
  PetscCall(VecGetArrayRead(gap, &w));
  PetscCall(VecGetArrayRead(L, &l));
  for (PetscInt i = 0; i < m; i++) {
    /* Of a row that cannot close, a force alone is wrong. */
    const PetscBool open = (PetscBool)(w[i] >= PETSC_INFINITY);
    const PetscReal left = open ? 1 : w[i] == 0 ? 0 : w[i] / s->size, share = l[i] == 0 ? 0 : l[i] / size_L;
    PetscReal more = PetscAbsReal(left);

    if (!open && !(PetscAbsReal(left * share) <= PETSC_MAX_REAL)) worst[2] = PETSC_MAX_REAL; /* or NaN */
    worst[0] = PetscMax(worst[0], -left);
    worst[1] = PetscMax(worst[1], -share);
    worst[2] = PetscMax(worst[2], PetscAbsReal(left * share));
    if (s->terms && !open) more = PetscMax(more - HycoSystemGapRounding(s, i) / s->size, 0);
    worst[3] = PetscMax(worst[3], more * (left < 0 ? 1 : PetscAbsReal(share)));
  }
  PetscCall(VecRestoreArrayRead(gap, &w));
  PetscCall(VecRestoreArrayRead(L, &l));
  PetscCall(HycoSystemMost(s, 4, worst));
  kkt->penetration = worst[0];
  kkt->adhesion = worst[1];
  kkt->complementarity = worst[2];
  *beyond = PetscMax(worst[3], worst[1]);
  if (worst[2] >= PETSC_MAX_REAL) *beyond = PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residuals of the contacts at the gaps, with or without blocks. */
static PetscErrorCode SystemContacts(HycoSystem s, Vec x, Vec L, HycoKKT *kkt)
{
  const PetscScalar *w, *l;
  PetscReal size_L, instead = 0, beyond = 0;

  PetscFunctionBegin;
  PetscCall(HycoSystemGaps(s, x, L, s->work_L));
  PetscCall(HycoSystemSizes(s, x));
  PetscCall(VecNorm(L, NORM_INFINITY, &size_L));
  if (!s->blocks) {
    PetscCall(SystemSigns(s, s->work_L, L, size_L, kkt, &beyond));
    s->beyond = PetscMax(kkt->stationarity, s->terms ? beyond : HycoKKTMax(kkt));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!(size_L > 0)) PetscCall(InsteadOfForces(s, &instead));
  PetscCall(VecGetArrayRead(s->work_L, &w));
  PetscCall(VecGetArrayRead(L, &l));
  PetscCall(BlockKKT(s, w, l, s->size, size_L, instead, kkt));
  PetscCall(VecRestoreArrayRead(s->work_L, &w));
  PetscCall(VecRestoreArrayRead(L, &l));
  s->beyond = HycoKKTMax(kkt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The four KKT residuals of x and L, recomputed from K, B, F, D, W (none is taken from a solver): stationarity,
   penetration, negative forces, complementarity, each relative. Collective. */
PetscErrorCode HycoSystemComputeKKT(HycoSystem s, Vec x, Vec L, HycoKKT *kkt)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  HycoCheckGiven(kkt);
  PetscCall(PetscMemzero(kkt, sizeof(*kkt)));
  PetscCall(HycoSystemCheckBlocks(s));
  PetscCheck(s->F || (s->W && !s->n), PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoSystemSetVectors() before HycoSystemComputeKKT()");
  PetscCall(HycoSystemWork(s));
  if (s->K)
    PetscCall(SystemStationarity(s, x, L, &kkt->stationarity, &kkt->rounding));
  else if (s->n)
    PetscCall(HycoSystemFreeStationarity(s, L, &kkt->stationarity));
  if (PetscIsInfOrNanReal(kkt->stationarity)) kkt->stationarity = PETSC_MAX_REAL;
  s->beyond = kkt->stationarity;
  if (s->m) PetscCall(SystemContacts(s, x, L, kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Matrices by their sizes alone (ASCII_INFO): their entries would fill the screen. */
PetscErrorCode HycoSystemView(HycoSystem s, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(s, HYCO_SYSTEM_CLASSID, viewer);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%d unknowns, %d contacts, %s\n", (int)s->n, (int)s->m,
                                   s->symmetric ? "symmetric" : "not symmetric"));
  for (PetscInt c = 0; s->blocks && c < s->blocks->n_cones; c++)
    PetscCall(PetscViewerASCIIPrintf(viewer, "cone: %s, %d components\n", ((PetscObject)s->blocks->cone[c])->type_name,
                                     (int)s->blocks->cone[c]->size));
  /* Sizes and nonzeros. */
  PetscCall(PetscViewerPushFormat(viewer, PETSC_VIEWER_ASCII_INFO));
  if (s->K) PetscCall(MatView(s->K, viewer));
  if (s->B && s->m) PetscCall(MatView(s->B, viewer));
  if (s->W) PetscCall(MatView(s->W, viewer));
  PetscCall(PetscViewerPopFormat(viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoSystem, HYCO_SYSTEM_CLASSID)
