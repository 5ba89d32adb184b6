/*
  Whether any contact forces balance the load on the rigid motions z that contact alone prevents:

    z_i.F = sum over contacts of (B z_i)_j L_j,   L >= 0

  The proximal point method decides it with a unit flexibility in place of S, so that no factor of K is needed.
*/
#include <hycoalgorithms.h>
#include <hycosolverimpl.h>

#define LEFT 1e-6 /* of the square of a motion: below, nothing is left of it */
/* The matrix of the problem is dense. */
#define HYCO_MOST_CONTACTS 3000

/* M = [0 A; -A^T I] and q = (-f', 0), with the motions z in place of pinned unknowns. Rows of contacts are gathered:
   the problem is small and identical on every rank. Only whether contact can balance the loads on the motions is asked,
   not the solution. */
static PetscErrorCode Fill(HycoSystem y, PetscInt p, const Vec z[], PetscReal M[], PetscReal q[])
{
  const size_t n = (size_t)(p + y->m);
  PetscReal *A;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(PetscMalloc1(p * y->m + 1, &A));
  PetscCall(HycoMotionRows(y->B, p, z, y->work_L, A));
  for (PetscInt i = 0; i < p; i++) {
    PetscCall(VecDot(y->F, z[i], &q[i]));
    q[i] = -q[i];
    for (PetscInt j = 0; j < y->m; j++) {
      M[(size_t)(p + j) * n + (size_t)i] = A[j * p + i];
      M[(size_t)i * n + (size_t)(p + j)] = -A[j * p + i];
    }
  }
  /* Any definite block would do: feasibility does not depend on it. */
  for (size_t j = (size_t)p; j < n; j++) M[j * n + j] = 1;
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds normal forces to the forces r that come nearest to the load f, so that the rest f - A r is a motion along which no
   contact opens: the one by which the bodies slide. First of all contacts, then, if that leaves nothing, of those with a
   force; else r stays. */
PetscErrorCode HycoBlocksLeaveSlide(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal f[],
                                    PetscReal r[])
{
  PetscReal *gram, *inverse, *rest, *x, size = 0, slide = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(p * p, &gram, p * p, &inverse, p, &rest, p, &x));
  PetscCall(PetscArraycpy(rest, f, p));
  for (PetscInt j = 0; j < blocks->row[blocks->n] * p; j++) rest[j % p] -= A[j] * r[j / p];
  for (PetscInt i = 0; i < p; i++) size += rest[i] * rest[i];
  for (PetscInt pass = 0; pass < 2 && !(slide > LEFT * size); pass++) {
    PetscCall(PetscArrayzero(gram, p * p));
    for (PetscInt k = 0; k < blocks->n; k++) {
      const PetscReal *a = A + blocks->row[k] * p;

      for (PetscInt i = 0; i < p * p && (!pass || r[blocks->row[k]] > 0); i++) gram[i] += a[i / p] * a[i % p];
    }
    PetscCall(HycoPseudoInverse(p, p, gram, 1e-12, inverse));
    PetscCall(PetscArrayzero(x, p));
    for (PetscInt i = 0; i < p * p; i++) x[i / p] += inverse[i] * rest[i % p];
    slide = 0;
    for (PetscInt i = 0; i < p; i++) {
      PetscReal left = rest[i];

      for (PetscInt j = 0; j < p; j++) left -= gram[i * p + j] * x[j];
      slide += left * left;
    }
    for (PetscInt k = 0; k < blocks->n && slide > LEFT * size; k++) {
      PetscReal *own = r + blocks->row[k];

      PetscReal more = 0;

      for (PetscInt i = 0; i < p; i++) more += A[blocks->row[k] * p + i] * x[i];
      if (!pass || *own > 0) *own += more;
    }
  }
  PetscCall(PetscFree4(gram, inverse, rest, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with other cones, as of friction, on the orthonormal motions; without forces that balance the load, the
   rest of it with L tells how the bodies move. */
static PetscErrorCode Slides(HycoSystem y, PetscInt p, const Vec z[], Vec L, PetscBool *slides)
{
  HycoBlocks *blocks;
  PetscReal *A, *f, *row;
  PetscInt lo, hi;
  PetscBool exists;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(HycoBlocksGather(HycoComm(y), y->blocks, &blocks));
  PetscCall(PetscMalloc3(p * y->m, &A, p, &f, y->m, &row));
  PetscCall(HycoMotionRows(y->B, p, z, y->work_L, A));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecDot(y->F, z[i], &f[i]));
  PetscCall(HycoBlocksBalance(blocks, p, A, f, 0, row, &exists));
  *slides = (PetscBool)!exists;
  if (*slides) PetscCall(HycoBlocksLeaveSlide(blocks, p, A, f, row));
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  if (*slides) PetscCall(HycoVecWrite(L, hi - lo, row + lo));
  PetscCall(PetscFree3(A, f, row));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the load lifts a floating body off, or moves it along: no contact forces balance it on the rigid modes. Otherwise
   a failure of the solver is its own. Collective. */
PetscErrorCode HycoSolverLifts(HycoSolver s, Vec L, PetscBool *lifts)
{
  HycoSystem y = s->system;
  HycoLCP lcp = {.n = y->m, .symmetric = PETSC_TRUE};
  HycoLCPStatus status;
  PetscInt its = 0, n;
  PetscReal *M, *q, *z;
  PetscBool *active;
  const Vec *motion;

  PetscFunctionBegin;
  /* The proximal point method ends on a ray if the problem is infeasible. */
  *lifts = PETSC_FALSE;
  if (!y->K) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoKernelVectors(y->K, &lcp.p, &motion));
  if (lcp.p && y->blocks) {
    PetscCall(Slides(y, lcp.p, motion, L, lifts));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* For too many contacts, where the dense problem is not set up: the residual of equilibrium says it approximately. */
  *lifts = (PetscBool)(lcp.p > 0 && s->kkt.stationarity > s->rtol);
  if (!lcp.p || !y->m || y->m > HYCO_MOST_CONTACTS) PetscFunctionReturn(PETSC_SUCCESS);
  n = lcp.p + y->m;
  PetscCall(PetscCalloc1((size_t)n * (size_t)n, &M));
  PetscCall(PetscCalloc3(n, &q, n, &z, y->m, &active));
  PetscCall(Fill(y, lcp.p, motion, M, q));
  lcp.M = M;
  lcp.q = q;
  PetscCall(HycoLCPProximal(&lcp, active, z, &its, &status));
  *lifts = (PetscBool)(status == HYCO_LCP_RAY);
  PetscCall(PetscFree(M));
  PetscCall(PetscFree3(q, z, active));
  PetscFunctionReturn(PETSC_SUCCESS);
}
