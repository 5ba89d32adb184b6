/*
  Whether any contact forces balance the load on the rigid motions z that contact alone prevents:

    z_i.F = sum over contacts of (B z_i)_j L_j,   L >= 0

  The proximal point method decides it with a unit flexibility in place of S, so that no factor of K is needed.
*/
#include <hycosolverimpl.h>

/* The matrix of the problem is dense. */
#define HYCO_MOST_CONTACTS 3000

/* M = [0 A; -A^T I] and q = (-f', 0), with the motions z in place of pinned unknowns. Rows of contacts are gathered:
   the problem is small and identical on every rank. Only whether contact can balance the loads on the motions is asked,
   not the solution. */
static PetscErrorCode Fill(HycoSystem y, PetscInt p, const Vec z[], PetscReal M[], PetscReal q[])
{
  const size_t n = (size_t)(p + y->m);
  PetscReal *row;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(PetscMalloc1(y->m + 1, &row));
  for (PetscInt i = 0; i < p; i++) {
    PetscCall(VecDot(y->F, z[i], &q[i]));
    q[i] = -q[i];
    PetscCall(MatMult(y->B, z[i], y->work_L));
    PetscCall(HycoVecGather(y->work_L, row));
    for (PetscInt j = 0; j < y->m; j++) {
      M[(size_t)(p + j) * n + (size_t)i] = row[j];
      M[(size_t)i * n + (size_t)(p + j)] = -row[j];
    }
  }
  /* Any definite block would do: feasibility does not depend on it. */
  for (size_t j = (size_t)p; j < n; j++) M[j * n + j] = 1;
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the load lifts a floating body off: no contact forces >= 0 balance it on the rigid modes. Otherwise a
   failure of the solver is its own. Collective. */
PetscErrorCode HycoSolverLifts(HycoSolver s, PetscBool *lifts)
{
  HycoSystem y = s->system;
  MatNullSpace kernel = NULL;
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
  PetscCall(MatGetNullSpace(y->K, &kernel));
  if (kernel) PetscCall(MatNullSpaceGetVecs(kernel, NULL, &lcp.p, &motion));
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
