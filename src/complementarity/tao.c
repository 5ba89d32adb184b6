/*
  TAO on the contact problem. Its bound-constrained types minimise the quadratic

      min 1/2 y^T H y - f^T y,  lo <= y <= hi            H symmetric positive (semi)definite

  and its semismooth types solve the complementarity problem w = q + M z >= 0, z >= 0, w.z = 0, symmetric or not, by the
  Fischer-Burmeister function (T. S. Munson et al., INFORMS J. Comput. 13 (2001) 294-311). Both stop on absolute sizes,
  so the problem is scaled first: unit diagonal, right-hand side of size one. What TAO says is not evidence: the caller
  recomputes the residuals. A PETSC error inside TAO is caught: it means not solved, like a limit of iterations.
*/
#include <hycolcp.h>
#include <petsctao.h>

const char *const HycoTaoTypes[] = {"gpcg",   "tron",   "bntr",  "bnls",  "bntl",  "blmvm", "bncg",  "bqnls", "bqnkls",
                                    "bqnktr", "bqnktl", "bqpip", "ssils", "asils", "ssfls", "asfls", NULL};

PetscBool HycoTaoSemismooth(PetscInt type)
{
  return (PetscBool)(type >= HYCO_TAO_SEMISMOOTH);
}

typedef struct {
  Mat H;
  Vec f;
  PetscBool newton;
  PetscReal best; /* least residual so far, and its iteration */
  PetscInt best_at;
} Quadratic;

/* So many iterations without halving the residual end a run: few once it is small, where round-off rules; many above,
   and for first-order types, which may stand still for a while. */
static PetscInt Patience(const Quadratic *q)
{
  if (q->best <= 1e-10) return 5;
  return q->newton && q->best <= 1e-8 ? 20 : 300;
}

static PetscErrorCode Objective(Tao tao, Vec y, PetscReal *value, Vec gradient, void *ctx)
{
  Quadratic *q = (Quadratic *)ctx;
  PetscScalar yHy, fy;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(q->H, y, gradient));
  PetscCall(VecDot(y, gradient, &yHy));
  PetscCall(VecDot(y, q->f, &fy));
  PetscCall(VecAXPY(gradient, -1, q->f));
  *value = yHy / 2 - fy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Hessian(Tao tao, Vec y, Mat H, Mat P, void *ctx)
{
  PetscFunctionBegin;
  (void)tao, (void)y, (void)H, (void)P, (void)ctx; /* constant */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = M z - f */
static PetscErrorCode Slack(Tao tao, Vec z, Vec w, void *ctx)
{
  Quadratic *q = (Quadratic *)ctx;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(q->H, z, w));
  PetscCall(VecAXPY(w, -1, q->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The types overwrite J by their own Newton matrix: M again at each call. */
static PetscErrorCode Jacobian(Tao tao, Vec z, Mat J, Mat P, void *ctx)
{
  Quadratic *q = (Quadratic *)ctx;

  PetscFunctionBegin;
  (void)tao, (void)z, (void)P;
  PetscCall(MatCopy(q->H, J, SAME_NONZERO_PATTERN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's own test; and an end to iterations that round-off or stagnation makes useless. */
static PetscErrorCode Converged(Tao tao, void *ctx)
{
  Quadratic *q = (Quadratic *)ctx;
  TaoConvergedReason why;
  PetscInt it;
  PetscReal residual;

  PetscFunctionBegin;
  PetscCall(TaoDefaultConvergenceTest(tao, NULL));
  PetscCall(TaoGetSolutionStatus(tao, &it, NULL, &residual, NULL, NULL, &why));
  if (why != TAO_CONTINUE_ITERATING) PetscFunctionReturn(PETSC_SUCCESS);
  if (residual <= q->best / 2) {
    q->best = residual;
    q->best_at = it;
  } else if (it - q->best_at >= Patience(q))
    PetscCall(TaoSetConvergedReason(tao, q->best <= 1e-10 ? TAO_CONVERGED_USER : TAO_DIVERGED_USER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `krylov`: without a factor, which a singular H (dependent contacts) does not have. */
static PetscErrorCode SetBoundProblem(Tao tao, Quadratic *q, PetscBool krylov)
{
  PetscBool shell;
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Objective, q));
  PetscCall(TaoSetHessian(tao, q->H, q->H, Hessian, NULL));
  PetscCall(TaoSetTolerances(tao, 1e-13, 1e-14, 0));
  PetscCall(PetscObjectTypeCompare((PetscObject)q->H, MATSHELL, &shell));
  PetscCall(TaoGetKSP(tao, &ksp));
  if ((shell || krylov) && ksp) { /* a shell has no entries to precondition with */
    PC pc;

    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCNONE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetComplementarity(Tao tao, Quadratic *q, Mat J, Vec w, PetscBool krylov)
{
  KSP ksp;
  PC pc;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(TaoSetConstraintsRoutine(tao, w, Slack, q));
  PetscCall(TaoSetJacobianRoutine(tao, J, J, Jacobian, q));
  PetscCall(TaoSetTolerances(tao, 0, 0, 0));
  PetscCall(TaoSetFunctionLowerBound(tao, 1e-12)); /* 1e-8, its default, is too coarse; 1e-20 never stops */
  PetscCall(TaoGetKSP(tao, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, krylov ? PCNONE : PCLU));
  PetscCall(KSPSetType(ksp, krylov ? KSPGMRES : KSPPREONLY));
  PetscCall(VecGetSize(w, &n));
  if (krylov) PetscCall(KSPGMRESSetRestart(ksp, PetscMin(n, 200)));
  if (krylov) PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 2 * n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What may fail inside TAO. */
static PetscErrorCode Run(Tao tao, PetscInt type, PetscInt max_its, Quadratic *q, Vec lo, Vec hi, Vec y, Mat J, Vec w,
                          PetscBool krylov, PetscInt *its, PetscBool *solved)
{
  TaoConvergedReason why;

  PetscFunctionBegin;
  PetscCall(TaoSetType(tao, HycoTaoTypes[type]));
  PetscCall(TaoSetOptionsPrefix(tao, "hyco_"));
  PetscCall(TaoSetSolution(tao, y));
  PetscCall(TaoSetVariableBounds(tao, lo, hi));
  PetscCall(TaoSetMaximumIterations(tao, max_its ? max_its : 2000));
  PetscCall(TaoSetConvergenceTest(tao, Converged, q));
  if (HycoTaoSemismooth(type))
    PetscCall(SetComplementarity(tao, q, J, w, krylov));
  else
    PetscCall(SetBoundProblem(tao, q, krylov));
  PetscCall(TaoSetFromOptions(tao));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetConvergedReason(tao, &why));
  PetscCall(TaoGetIterationNumber(tao, its));
  *solved = (PetscBool)(why > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = d size y', lo and hi alike; f' = d f / size; H' = d H d: unit diagonal, max |f'| = 1. Infinite bounds stay. */
static PetscErrorCode Scale(Mat H, Vec f, Vec lo, Vec hi, Vec y, Vec d, PetscReal *size)
{
  PetscInt n;
  PetscScalar *v[5];
  Vec all[5];
  PetscReal mine = 0, largest = 0, most;

  PetscFunctionBegin;
  all[0] = f, all[1] = lo, all[2] = hi, all[3] = y, all[4] = d;
  PetscCall(MatGetDiagonal(H, d));
  PetscCall(VecNorm(d, NORM_INFINITY, &most));
  PetscCall(VecGetLocalSize(d, &n));
  for (int k = 0; k < 5; k++) PetscCall(VecGetArray(all[k], &v[k]));
  for (PetscInt i = 0; i < n; i++) {
    v[4][i] = most > 0 ? 1 / PetscSqrtReal(PetscMax(PetscAbsReal(v[4][i]), 1e-8 * most)) : 1;
    mine = PetscMax(mine, PetscMax(PetscAbsReal(v[0][i] * v[4][i]), PetscAbsReal(v[3][i] / v[4][i])));
  }
  PetscCallMPI(MPI_Allreduce(&mine, &largest, 1, MPIU_REAL, MPI_MAX, PetscObjectComm((PetscObject)d)));
  *size = largest > 0 ? largest : 1;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal unit = v[4][i] * *size;

    v[0][i] *= v[4][i] / *size;
    if (v[1][i] > PETSC_NINFINITY) v[1][i] /= unit;
    if (v[2][i] < PETSC_INFINITY) v[2][i] /= unit;
    v[3][i] /= unit;
  }
  for (int k = 0; k < 5; k++) PetscCall(VecRestoreArray(all[k], &v[k]));
  PetscCall(MatDiagonalScale(H, d, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One run of TAO from y; an error inside it is told by *failed. y ends finite. */
static PetscErrorCode CatchRun(PetscInt type, PetscInt max_its, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscBool krylov,
                               PetscInt *its, PetscBool *solved, PetscBool *failed)
{
  Quadratic q = {H, f, (PetscBool)(type < HYCO_TAO_BLMVM || HycoTaoSemismooth(type)), PETSC_MAX_REAL, 0};
  Tao tao;
  Vec w;
  Mat J = NULL;
  PetscReal norm;
  PetscErrorCode caught;
  char message[HYCO_LINE];

  PetscFunctionBegin;
  *its = 0;
  *solved = PETSC_FALSE;
  PetscCall(VecDuplicate(y, &w));
  if (HycoTaoSemismooth(type)) PetscCall(MatDuplicate(H, MAT_COPY_VALUES, &J));
  PetscCall(TaoCreate(PetscObjectComm((PetscObject)y), &tao));
  PetscCall(HycoCatchBegin());
  caught = Run(tao, type, max_its, &q, lo, hi, y, J, w, krylov, its, solved);
  if (caught)
    (void)TaoDestroy(&tao);
  else
    caught = TaoDestroy(&tao);
  PetscCall(HycoCatchEnd(caught, message));
  if (caught) PetscCall(PetscInfo(NULL, "TAO %s failed: %s\n", HycoTaoTypes[type], message));
  if (caught) *solved = PETSC_FALSE;
  *failed = (PetscBool)(caught != 0);
  PetscCall(VecNorm(y, NORM_2, &norm));
  if (PetscIsInfOrNanReal(norm)) PetscCall(VecSet(y, 0));
  PetscCall(VecMedian(lo, y, hi, y));
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* | y - median(lo, y - (H y - f), hi) |, 0 at the solution. */
static PetscErrorCode Projected(Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscReal *size)
{
  Vec step;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, &step));
  PetscCall(MatMult(H, y, step));
  PetscCall(VecAXPY(step, -1, f));
  PetscCall(VecAYPX(step, -1, y));
  PetscCall(VecMedian(lo, step, hi, step));
  PetscCall(VecAXPY(step, -1, y));
  PetscCall(VecNorm(step, NORM_INFINITY, size));
  PetscCall(VecDestroy(&step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton types that stood still come through from elsewhere; the better of the two is kept. */
static PetscErrorCode SecondStart(PetscInt type, PetscInt max_its, Mat H, Vec f, Vec lo, Vec hi, Vec y,
                                  PetscBool krylov, PetscInt *its, PetscBool *solved)
{
  const PetscInt first_its = *its;
  Vec first;
  PetscReal before, after;
  PetscBool failed;

  PetscFunctionBegin;
  PetscCall(Projected(H, f, lo, hi, y, &before));
  if (before < 1e-10) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(y, &first));
  PetscCall(VecCopy(y, first));
  PetscCall(VecSet(y, 1));
  PetscCall(VecMedian(lo, y, hi, y));
  PetscCall(CatchRun(type, max_its, H, f, lo, hi, y, krylov, its, solved, &failed));
  *its += first_its;
  PetscCall(Projected(H, f, lo, hi, y, &after));
  if (!*solved && !(after < before)) PetscCall(VecCopy(first, y));
  PetscCall(VecDestroy(&first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTaoSolve(PetscInt type, PetscInt max_its, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its,
                            PetscBool *solved)
{
  Vec d;
  PetscReal size = 1;
  PetscBool failed;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, &d));
  PetscCall(Scale(H, f, lo, hi, y, d, &size));
  PetscCall(CatchRun(type, max_its, H, f, lo, hi, y, PETSC_FALSE, its, solved, &failed));
  if (failed) PetscCall(CatchRun(type, max_its, H, f, lo, hi, y, PETSC_TRUE, its, solved, &failed));
  if (!*solved && type < HYCO_TAO_BLMVM) PetscCall(SecondStart(type, max_its, H, f, lo, hi, y, failed, its, solved));
  PetscCall(VecPointwiseMult(y, y, d));
  PetscCall(VecScale(y, size));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each pair (z_i, w_i) the smaller is 0: a force that an interior or first-order type left where the gap is open. */
static void Clean(PetscInt n, const PetscReal M[], const PetscReal q[], PetscReal z[])
{
  PetscReal size_z = 0, size_q = 0;

  for (PetscInt i = 0; i < n; i++) {
    size_z = PetscMax(size_z, PetscAbsReal(z[i]));
    size_q = PetscMax(size_q, PetscAbsReal(q[i]));
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscReal w = q[i];

    if (z[i] == 0 || z[i] > 1e-9 * size_z) continue;
    for (PetscInt j = 0; j < n; j++) w += M[(size_t)j * (size_t)n + (size_t)i] * z[j];
    if (w * size_z > z[i] * size_q) z[i] = 0;
  }
}

PetscErrorCode HycoTaoLCP(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric, PetscInt type,
                          PetscInt max_its, PetscReal z[], PetscInt *its, PetscBool *solved)
{
  Mat H;
  Vec f, lo, hi, y;
  PetscScalar *h;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, NULL, &H));
  PetscCall(MatDenseGetArray(H, &h));
  PetscCall(PetscArraycpy(h, M, (size_t)n * (size_t)n));
  PetscCall(MatDenseRestoreArray(H, &h));
  PetscCall(MatAssemblyBegin(H, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(H, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(H, MAT_SYMMETRIC, symmetric));
  PetscCall(MatCreateVecs(H, &y, &f));
  PetscCall(VecDuplicate(y, &lo));
  PetscCall(VecDuplicate(y, &hi));
  PetscCall(VecSet(y, 0));
  PetscCall(VecSet(lo, 0));
  PetscCall(VecSet(hi, PETSC_INFINITY));
  PetscCall(VecGetArray(f, &h));
  for (PetscInt i = 0; i < n; i++) h[i] = -q[i];
  PetscCall(VecRestoreArray(f, &h));
  PetscCall(HycoTaoSolve(type, max_its, H, f, lo, hi, y, its, solved));
  PetscCall(VecGetArray(y, &h));
  PetscCall(PetscArraycpy(z, h, n));
  PetscCall(VecRestoreArray(y, &h));
  Clean(n, M, q, z);
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&lo));
  PetscCall(VecDestroy(&hi));
  PetscCall(MatDestroy(&H));
  PetscFunctionReturn(PETSC_SUCCESS);
}
