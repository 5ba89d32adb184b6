/*
  Contact forces outside the RID, (41): the nonnegative combination of dual snapshots that agrees with the RID's forces
  and vanishes where the predicted displacement leaves a gap. ([B D - D]_- in the paper's print is [B U - D]_-.)
  With many snapshots (41) has many minimisers that round-off would choose among: a small weight on the coefficients
  picks the one near the least norm.
*/
#include <hycoalgorithms.h>
#include <hycomodelimpl.h>

const char *const HycoReconstructSolvers[] = {"auto", "nnls", "tao", NULL};
enum { SOLVER_AUTO, SOLVER_NNLS, SOLVER_TAO };
#define RTOL 1e-8 /* of the optimality conditions, recomputed */

/* Lawson and Hanson's active set, or TAO; with auto or tao the other one where the first stops short. */
static PetscErrorCode Solve(PetscInt solver, PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[],
                            PetscReal c[])
{
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  if (solver == SOLVER_TAO) PetscCall(HycoTaoNNLS(m, n, A, b, HYCO_TAO_BNLS, RTOL, c, NULL, &solved));
  if (solved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoNNLS(m, n, A, b, c, NULL));
  if (solver != SOLVER_AUTO) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoNNLSCheck(m, n, A, b, c, RTOL, NULL, &solved));
  if (!solved) PetscCall(HycoTaoNNLS(m, n, A, b, HYCO_TAO_BNLS, RTOL, c, NULL, &solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weight, relative to the largest snapshot force in the RID. */
#define SMALL 1e-3

PetscErrorCode HycoModelReconstruct(HycoModel m)
{
  const PetscInt N = m->pairs.n, n = m->n_dual;
  PetscInt rows = m->m + n;
  PetscReal scale = 0;
  PetscReal *A, *b, *c, *open, force = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->m; k++) force += m->Lambda[m->contact[k]];
  if (m->m == N || !n || !m->m || force == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc4((m->m + N + n) * n, &A, m->m + N + n, &b, n, &c, N, &open));
  for (PetscInt k = 0; k < N; k++) {
    open[k] = -m->gap[k];
    for (PetscInt j = m->row_start[k]; j < m->row_start[k + 1]; j++) open[k] += m->row_value[j] * m->U[m->row_dof[j]];
    rows += open[k] < 0;
  }
  for (PetscInt k = 0; k < m->m; k++) {
    for (PetscInt j = 0; j < n; j++)
      scale = PetscMax(scale, m->S_lambda[(size_t)j * (size_t)N + (size_t)m->contact[k]]);
  }
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal *s = m->S_lambda + (size_t)j * (size_t)N;
    PetscInt r = 0;

    for (PetscInt k = 0; k < m->m; k++) A[j * rows + r++] = s[m->contact[k]];
    for (PetscInt k = 0; k < N; k++) {
      if (open[k] < 0) A[j * rows + r++] = open[k] * s[k];
    }
    for (PetscInt i = 0; i < n; i++) A[j * rows + r++] = i == j ? SMALL * scale : 0;
  }
  for (PetscInt r = 0; r < rows; r++) b[r] = r < m->m ? m->Lambda[m->contact[r]] : 0;
  PetscCall(Solve(m->reconstruct_solver, rows, n, A, b, c));
  for (PetscInt k = 0; k < N; k++) {
    if (m->in_rid[k]) continue;
    for (PetscInt j = 0; j < n; j++) m->Lambda[k] += c[j] * m->S_lambda[(size_t)j * (size_t)N + (size_t)k];
  }
  PetscCall(PetscFree4(A, b, c, open));
  PetscFunctionReturn(PETSC_SUCCESS);
}
