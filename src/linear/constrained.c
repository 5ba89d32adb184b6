/*
  Conjugate gradients on the displacements that satisfy constraints, K x + B^T l = f, B x = d, preconditioned by
  multigrid for K: one hierarchy serves all sets of constraints. The constraints are coarsened along with it
  (constraint_levels.c), and each smoother and correction is projected onto the displacements that satisfy them, as
  proposed by Braess and Sarazin (Appl. Numer. Math. 23 (1997) 3-19), and as in multigrid for contact (M. Adams, Numer.
  Linear Algebra Appl. 11 (2004) 141-153; T. Wiesner et al., Int. J. Numer. Meth. Engng 122 (2021) 3751-3779).
*/
#include "constrained.h"

/* Iterations for the estimate of a level's largest eigenvalue, the margin added to it, and the start of a smoother's
   interval: PETSc's defaults for Chebyshev's method. */
#define HYCO_EIGEN_ITS 10
/* Factor of the estimated largest eigenvalue: PETSc's default for Chebyshev's method. */
#define HYCO_EIGEN_SAFETY 1.1
/* Start of a smoother's interval as a share of its end: PETSc's default for Chebyshev's method. */
#define HYCO_EIGEN_LEAST 0.1

/* Share of the initial residual that is compared with the loads: without loads only the constraints act
   (tests/fom/iterative.py). */
#define HYCO_START 0.01

/* The largest eigenvalue of D^-1 K by Lanczos' method. The start has irregular entries by a hash of the row: the
   same estimate on any number of ranks, up to round-off. */
static PetscErrorCode LargestEigenvalue(Mat K, PetscReal *largest)
{
  KSP ksp;
  PC pc;
  Vec b, x;
  PetscScalar *v;
  PetscInt lo, hi;
  PetscReal least;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(K, &x, &b));
  PetscCall(VecGetOwnershipRange(b, &lo, &hi));
  PetscCall(VecGetArray(b, &v));
  for (PetscInt i = lo; i < hi; i++)
    v[i - lo] = (PetscReal)(HycoHash(HYCO_HASH_START, &i, sizeof(i)) >> 32) / 4294967296. - 0.5;
  PetscCall(VecRestoreArray(b, &v));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)K), &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetType(ksp, KSPCG));
  /* From the coefficients of conjugate gradients, at no further product. */
  PetscCall(KSPSetComputeSingularValues(ksp, PETSC_TRUE));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, HYCO_EIGEN_ITS));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPComputeExtremeSingularValues(ksp, largest, &least));
  HycoDestroyAll(&ksp, &b, &x);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The levels of the multigrid `pc`, finest first; of another preconditioner only the finest. Borrowed levels of
   PETSc's multigrid; work vectors and estimates are own. */
static PetscErrorCode ReadLevels(HycoConstrained c, Mat K)
{
  PetscBool multigrid;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)c->pc, &multigrid, PCGAMG, PCMG, PCML, ""));
  c->n = 1;
  if (multigrid) PetscCall(PCMGGetLevels(c->pc, &c->n));
  if (multigrid) PetscCall(PCMGGetCoarseSolve(c->pc, &c->coarse));
  PetscCall(PetscCalloc1(c->n, &c->level));
  for (PetscInt l = 0; l < c->n; l++) {
    HycoLevel *v = &c->level[l];
    KSP smoother;

    v->K = K;
    /* PETSc's default of Chebyshev steps, where no multigrid says another. */
    v->smooths = 2;
    if (multigrid) {
      PetscCall(PCMGGetSmoother(c->pc, c->n - 1 - l, &smoother));
      PetscCall(KSPGetOperators(smoother, NULL, &v->K));
      PetscCall(KSPGetTolerances(smoother, NULL, NULL, NULL, &v->smooths));
    }
    if (l + 1 < c->n) PetscCall(PCMGGetInterpolation(c->pc, c->n - 1 - l, &v->P));
    PetscCall(MatCreateVecs(v->K, &v->inverse, &v->z));
    PetscCall(MatGetDiagonal(v->K, v->inverse));
    PetscCall(VecReciprocal(v->inverse));
    HycoVecDuplicate(v->z, &v->r, &v->d, &v->w);
    /* The coarsest level is solved, not smoothed. */
    if (l + 1 < c->n) PetscCall(LargestEigenvalue(v->K, &v->largest));
    if (l + 1 < c->n) PetscCall(HycoUpperBlocks(v->K, &v->product));
    if (!v->product) PetscCall(PetscObjectReference((PetscObject)v->K));
    if (!v->product) v->product = v->K;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu = (B D^-1 B^T)^-1 mu Diagonal if no two constraints share an unknown. */
static PetscErrorCode SolveG(const HycoLevel *v, Vec mu)
{
  PetscFunctionBegin;
  if (v->G_diagonal)
    PetscCall(VecPointwiseMult(mu, mu, v->G_diagonal));
  else {
    PetscCall(KSPSolve(v->G, mu, v->mu_work));
    PetscCall(VecAXPBY(mu, v->G_scale, 0, v->mu_work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes from z what violates B z = 0, by D^-1 B^T: the projection that is orthogonal in D. */
PetscErrorCode HycoLevelProject(const HycoLevel *v, Vec z)
{
  PetscFunctionBegin;
  if (!v->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(v->B, z, v->mu));
  PetscCall(SolveG(v, v->mu));
  PetscCall(VecScale(v->mu, -1));
  PetscCall(MatMultAdd(v->DBt, v->mu, z, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes from r what constraint forces can balance: the transpose of HycoLevelProject(); v->mu: these forces,
   negative. */
static PetscErrorCode ProjectForce(const HycoLevel *v, Vec r)
{
  PetscFunctionBegin;
  if (!v->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMultTranspose(v->DBt, r, v->mu));
  PetscCall(SolveG(v, v->mu));
  PetscCall(VecScale(v->mu, -1));
  PetscCall(MatMultTransposeAdd(v->B, v->mu, r, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chebyshev steps on K z = r from the current z; r becomes the residual (without `residual`, that before the last
   step). Each step is projected, so that z satisfies the constraints throughout. */
static PetscErrorCode ConstrainedSmooth(HycoLevel *v, PetscBool residual, Vec r, Vec z)
{
  const PetscReal hi = HYCO_EIGEN_SAFETY * v->largest, lo = HYCO_EIGEN_LEAST * v->largest;
  const PetscReal theta = (hi + lo) / 2, delta = (hi - lo) / 2;
  PetscReal rho = delta / theta;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < v->smooths; k++) {
    const PetscReal before = rho;

    PetscCall(VecPointwiseMult(v->w, v->inverse, r));
    PetscCall(HycoLevelProject(v, v->w));
    if (k == 0)
      PetscCall(VecAXPBY(v->d, 1 / theta, 0, v->w));
    else {
      /* Chebyshev's recurrence on [lo, hi] (Y. Saad, Iterative Methods for Sparse Linear Systems (2003), algorithm
         12.1). */
      rho = 1 / (2 * theta / delta - before);
      PetscCall(VecAXPBY(v->d, 2 * rho / delta, rho * before, v->w));
    }
    PetscCall(VecAXPY(z, 1, v->d));
    if (k + 1 == v->smooths && !residual) break;
    PetscCall(MatMult(v->product, v->d, v->w));
    PetscCall(VecAXPY(r, -1, v->w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coarsest level: K z + B^T mu = r, B z = 0 by the multigrid's coarse solver and B K^-1 B^T. S is factored on
   every rank: m is small on this level. */
static PetscErrorCode SolveCoarsest(HycoConstrained c, HycoLevel *v, Vec r, Vec z)
{
  PetscBLASInt m, one = 1, info;
  PetscReal *mu = c->mu_all;

  PetscFunctionBegin;
  PetscCall(KSPSolve(c->coarse, r, z));
  if (!v->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(v->B, z, v->mu));
  PetscCall(HycoVecGather(v->mu, mu));
  PetscCall(PetscBLASIntCast(v->m, &m));
  LAPACKpotrs_("L", &m, &one, c->S, &m, mu, &m, &info);
  /* z - Y mu with Y = K^-1 B^T. */
  for (PetscInt k = 0; k < v->m; k++) mu[k] = -mu[k];
  PetscCall(VecMAXPY(z, v->m, mu, c->Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = M r, M symmetric, B z = 0; r is overwritten. Symmetric, as conjugate gradients need: the same smoother before
   and after, restriction transpose to interpolation. */
static PetscErrorCode ConstrainedCycle(HycoConstrained c, PetscInt l, Vec r, Vec z)
{
  HycoLevel *v = &c->level[l];

  PetscFunctionBegin;
  if (l + 1 == c->n) {
    PetscCall(SolveCoarsest(c, v, r, z));
    /* With a single level the shift of S leaves an error, and the finest level must satisfy the constraints exactly. */
    if (l == 0) PetscCall(HycoLevelProject(v, z));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecSet(z, 0));
  PetscCall(ConstrainedSmooth(v, PETSC_TRUE, r, z));
  PetscCall(ProjectForce(v, r));
  PetscCall(MatMultTranspose(v->P, r, v[1].r));
  PetscCall(ConstrainedCycle(c, l + 1, v[1].r, v[1].z));
  PetscCall(MatMult(v->P, v[1].z, v->d));
  PetscCall(HycoLevelProject(v, v->d));
  PetscCall(VecAXPY(z, 1, v->d));
  PetscCall(MatMult(v->product, v->d, v->w));
  PetscCall(VecAXPY(r, -1, v->w));
  PetscCall(ConstrainedSmooth(v, PETSC_FALSE, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of another preconditioner than multigrid only the projected application. */
static PetscErrorCode ConstrainedApply(PC shell, Vec r, Vec z)
{
  HycoConstrained c;
  HycoLevel *v;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(shell, &c));
  v = c->level;
  PetscCall(VecCopy(r, v->r));
  /* The multigrid cycle projects at each smoother. */
  if (c->coarse)
    PetscCall(ConstrainedCycle(c, 0, v->r, z));
  else {
    PetscCall(ProjectForce(v, v->r));
    PetscCall(PCApply(c->pc, v->r, z));
    PetscCall(HycoLevelProject(v, z));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the multigrid inside: the shell has nothing to show. */
static PetscErrorCode ConstrainedView(PC shell, PetscViewer viewer)
{
  HycoConstrained c;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(shell, &c));
  PetscCall(PCView(c->pc, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Conjugate gradients and multigrid for K, without constraints yet. The natural norm is that of the energy.
   Collective. */
PetscErrorCode HycoConstrainedCreate(MPI_Comm comm, const char prefix[], Mat K, HycoConstrained *constrained)
{
  HycoConstrained c;
  PC shell;
  PCType type;

  PetscFunctionBegin;
  PetscCall(PetscNew(&c));
  *constrained = c;
  PetscCall(HycoIterativeSolver(comm, prefix, K, &c->ksp));
  PetscCall(KSPSetNormType(c->ksp, KSP_NORM_NATURAL));
  PetscCall(KSPSetInitialGuessNonzero(c->ksp, PETSC_FALSE));
  PetscCall(KSPSetResidualHistory(c->ksp, NULL, PETSC_DECIDE, PETSC_TRUE));
  PetscCall(MatCreateVecs(K, &c->correction, &c->residual));
  PetscCall(KSPGetPC(c->ksp, &c->pc));
  PetscCall(PetscObjectReference((PetscObject)c->pc));
  /* Makes the hierarchy; the shell then takes the place of the multigrid, which c->pc keeps alive. */
  PetscCall(KSPSetUp(c->ksp));
  PetscCall(PCGetType(c->pc, &type));
  PetscCall(ReadLevels(c, K));
  PetscCall(PCCreate(comm, &shell));
  PetscCall(PCSetType(shell, PCSHELL));
  PetscCall(PCSetOperators(shell, c->level->product, K));
  PetscCall(PCShellSetName(shell, type));
  PetscCall(PCShellSetContext(shell, c));
  PetscCall(PCShellSetApply(shell, ConstrainedApply));
  PetscCall(PCShellSetView(shell, ConstrainedView));
  PetscCall(KSPSetPC(c->ksp, shell));
  c->shell = shell;
  PetscCall(PCDestroy(&shell)); /* the solver has a reference */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The levels' K, P and coarse solver are the multigrid's, which goes last. */
PetscErrorCode HycoConstrainedDestroy(HycoConstrained *constrained)
{
  HycoConstrained c = *constrained;

  PetscFunctionBegin;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoConstraintsFree(c));
  for (PetscInt l = 0; l < c->n; l++) {
    HycoDestroyAll(&c->level[l].product, &c->level[l].inverse, &c->level[l].r, &c->level[l].z, &c->level[l].d,
                   &c->level[l].w, &c->level[l].aggregate);
  }
  PetscCall(PetscFree(c->level));
  HycoDestroyAll(&c->residual, &c->correction, &c->ksp, &c->pc);
  PetscCall(PetscFree(*constrained));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed: whoever solves sets tolerances and reads counts on it, but the operators belong to the constrained
   solve. */
PetscErrorCode HycoConstrainedGetKSP(HycoConstrained c, KSP *ksp)
{
  PetscFunctionBegin;
  *ksp = c->ksp;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of f in the preconditioner, with which residuals are compared. */
PetscErrorCode HycoConstrainedSize(HycoConstrained c, Vec f, PetscReal *size)
{
  PetscScalar dot;

  PetscFunctionBegin;
  PetscCall(PCApply(c->shell, f, c->level->z));
  PetscCall(VecDot(f, c->level->z, &dot));
  *size = PetscSqrtReal(PetscMax(PetscRealPart(dot), 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x satisfies B x = d on return, with the residual below accuracy times *size, which grows with the first residual.
   Collective. */
PetscErrorCode HycoConstrainedSolve(HycoConstrained c, Vec f, Vec d, PetscReal accuracy, PetscReal *size, Vec x,
                                    PetscInt *its)
{
  HycoLevel *v = c->level;
  const PetscReal *history;
  PetscInt n;

  PetscFunctionBegin;
  if (v->m) { /* projects onto the constraints */
    PetscCall(MatMult(v->B, x, v->mu));
    PetscCall(VecAYPX(v->mu, -1, d));
    PetscCall(SolveG(v, v->mu));
    PetscCall(MatMultAdd(v->DBt, v->mu, x, x));
  }
  /* solves for a correction, so that the constraints' forces do not dominate the residual */
  PetscCall(MatMult(v->product, x, c->residual));
  PetscCall(VecAYPX(c->residual, -1, f));
  PetscCall(ProjectForce(v, c->residual));
  PetscCall(KSPSetTolerances(c->ksp, HYCO_START * accuracy, accuracy * *size, PETSC_DEFAULT, PETSC_DEFAULT));
  HycoLogged(HYCO_EVENT_ITERATE, KSPSolve(c->ksp, c->residual, c->correction));
  PetscCall(VecAXPY(x, 1, c->correction));
  PetscCall(KSPGetResidualHistory(c->ksp, &history, &n));
  /* Without loads the size of the forces is 0, and no relative accuracy could be reached. */
  if (n) *size = PetscMax(*size, HYCO_START * history[0]);
  PetscCall(KSPGetIterationNumber(c->ksp, its));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* force = (B D^-1 B^T)^-1 B D^-1 r: the multipliers that balance the residual best. */
PetscErrorCode HycoConstrainedForces(HycoConstrained c, Vec r, Vec force)
{
  HycoLevel *v = c->level;

  PetscFunctionBegin;
  PetscCall(MatMultTranspose(v->DBt, r, force));
  PetscCall(SolveG(v, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
