/* The reduced system for gradients: x the coefficients and full-order unknowns, L the multipliers,
   w = (K x + Bt L - F, D - B x). */
#include <hycogalerkin.h>

/* z NULL: the sizes alone. */
PetscErrorCode HycoGalerkinUnknowns(HycoROM m, PetscInt *p, PetscInt *n, PetscReal z[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  *p = m->n;
  *n = m->n_L;
  if (!z) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoVecRead(g->x, m->n, z));
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoVecRead(g->L, m->n_L, z + m->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles at mu without a solve; w NULL: the state is moved, nothing is computed. */
PetscErrorCode HycoGalerkinResidual(HycoROM m, const PetscReal mu[], const PetscReal z[], PetscReal w[],
                                    PetscReal *size)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscReal gap;
  Vec r, s;

  PetscFunctionBegin;
  /* Without mu only z moves, and the assembled system stays. */
  if (mu) PetscCall(HycoGalerkinAssemble(m, mu));
  PetscCall(HycoVecWrite(g->x, m->n, z));
  if (m->n_L) PetscCall(HycoVecWrite(g->L, m->n_L, z + m->n));
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  *size = 0;
  PetscCall(VecDuplicate(g->x, &r));
  PetscCall(MatMult(g->Kr, g->x, r));
  if (m->n_L) PetscCall(MatMultAdd(g->Btr, g->L, r, r));
  PetscCall(VecAXPY(r, -1, g->Fr));
  PetscCall(HycoVecRead(r, m->n, w));
  PetscCall(VecDestroy(&r));
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(g->L, &s));
  PetscCall(MatMult(g->Br, g->x, s));
  /* The larger of B x and D is what a gap near 0 is a difference of. */
  PetscCall(VecNorm(s, NORM_INFINITY, size));
  PetscCall(VecNorm(g->Dr, NORM_INFINITY, &gap));
  *size = PetscMax(*size, gap);
  PetscCall(VecAYPX(s, -1, g->Dr));
  PetscCall(HycoVecRead(s, m->n_L, w + m->n));
  PetscCall(VecDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds scale times A to M (n rows) from entry `to` on: row i of A in the row to_row[i], column j in to_column[j]; NULL:
   i, j; -1: left out. */
static PetscErrorCode AddTo(Mat A, PetscReal scale, size_t n, const PetscInt to_row[], const PetscInt to_column[],
                            PetscReal M[])
{
  PetscInt rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, &rows, NULL));
  for (PetscInt i = 0; i < rows; i++) {
    const PetscInt row = to_row ? to_row[i] : i, *column;
    const PetscScalar *value;
    PetscInt entries;

    if (row < 0) continue;
    PetscCall(MatGetRow(A, i, &entries, &column, &value));
    for (PetscInt j = 0; j < entries; j++) {
      const PetscInt at = to_column ? to_column[column[j]] : column[j];

      /* Entries of contacts that are open have no column. */
      if (at >= 0) M[(size_t)at * n + (size_t)row] += scale * value[j];
    }
    PetscCall(MatRestoreRow(A, i, &entries, &column, &value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M = [K Bt; -B 0] of the k contacts, by columns: w of contacts is D - B x. */
PetscErrorCode HycoGalerkinJacobian(HycoROM m, PetscInt k, const PetscInt contact[], PetscReal M[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const size_t n = (size_t)(m->n + k);
  PetscInt *at;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(M, n * n));
  PetscCall(AddTo(g->Kr, 1, n, NULL, NULL, M));
  if (!k) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->n_L, &at));
  for (PetscInt i = 0; i < m->n_L; i++) at[i] = -1;
  for (PetscInt j = 0; j < k; j++) at[contact[j]] = m->n + j;
  PetscCall(AddTo(g->Btr, 1, n, NULL, at, M));
  /* The second row has w = D - B x, hence the sign. */
  PetscCall(AddTo(g->Br, -1, n, at, NULL, M));
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}
