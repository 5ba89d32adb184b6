/* A compliance of the contacts, w = D - B x + W L: its gaps, its blocks, and the problem of some contacts. */
#include <hycosolverimpl.h>

/* What W is asked for at each solve is looked up once: models are solved in microseconds. */
static PetscErrorCode TakeCompliance(HycoSystem s, Mat W)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)W));
  PetscCall(MatDestroy(&s->W));
  s->W = W;
  PetscCall(PetscObjectTypeCompare((PetscObject)W, MATSEQDENSE, &s->dense_W));
  PetscCall(PetscObjectQueryFunction((PetscObject)W, HYCO_COMPLIANCE_BLOCK, &s->block_W));
  PetscCall(PetscObjectQueryFunction((PetscObject)W, HYCO_COMPLIANCE_TERMS, &s->terms_W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Beside K and B, or without them where x are free or there are none. */
PetscErrorCode HycoSystemSetCompliance(HycoSystem s, Mat W)
{
  PetscInt rows, cols;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  if (!W) {
    PetscCall(MatDestroy(&s->W));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(W, &rows, &cols));
  PetscCheck(s->B && rows == cols && rows == s->m, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "W is %d x %d with %d contacts; call HycoSystemSetMatrices() first, and give one as large", (int)rows,
             (int)cols, (int)s->m);
  PetscCall(TakeCompliance(s, W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A system of forces alone. */
PetscErrorCode HycoSystemSetFlexibility(HycoSystem s, Mat G, Vec g)
{
  PetscInt rows, cols, m, lda = 0;
  PetscBool dense;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SYSTEM_CLASSID);
  HycoCheckGiven(G);
  HycoCheckGiven(g);
  PetscCall(PetscObjectTypeCompare((PetscObject)G, MATSEQDENSE, &dense));
  PetscCall(MatGetSize(G, &rows, &cols));
  PetscCall(VecGetSize(g, &m));
  if (dense) PetscCall(MatDenseGetLDA(G, &lda));
  /* BLAS and the factor of the set take the array of a dense one as it lies. */
  PetscCheck((!dense || lda == rows) && rows == cols && m == rows, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "G is %d x %d and g has length %d; G must be square, without gaps if it is dense, and g as long",
             (int)rows, (int)cols, (int)m);
  PetscCall(PetscObjectReference((PetscObject)g));
  PetscCall(TakeCompliance(s, G));
  HycoDestroyAll(&s->K, &s->B, &s->Bt, &s->F, &s->D);
  PetscCall(HycoSystemFreeWork(s));
  s->D = g;
  s->symmetric = PETSC_TRUE;
  s->n = 0;
  s->m = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By W's own function, or by its rows, those of each rank. */
PetscErrorCode HycoSystemCompliance(HycoSystem s, PetscInt n, const PetscInt contact[], PetscInt lda,
                                    PetscScalar block[])
{
  PetscInt *place, lo, hi;

  PetscFunctionBegin;
  if (s->block_W) {
    PetscCall((*s->block_W)(s->W, n, contact, lda, block));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(s->m + 1, &place));
  for (PetscInt k = 0; k < s->m; k++) place[k] = -1;
  for (PetscInt k = 0; k < n; k++) {
    place[contact[k]] = k;
    PetscCall(PetscArrayzero(block + (size_t)k * (size_t)lda, n));
  }
  PetscCall(MatGetOwnershipRange(s->W, &lo, &hi));
  for (PetscInt k = lo; k < hi; k++) {
    const PetscInt *column;
    const PetscScalar *value;
    PetscInt entries;

    if (place[k] < 0) continue;
    PetscCall(MatGetRow(s->W, k, &entries, &column, &value));
    for (PetscInt e = 0; e < entries; e++) {
      if (place[column[e]] >= 0) block[(size_t)place[column[e]] * (size_t)lda + (size_t)place[k]] = value[e];
    }
    PetscCall(MatRestoreRow(s->W, k, &entries, &column, &value));
  }
  PetscCall(PetscFree(place));
  /* Each rank has written its own rows. */
  for (PetscInt k = 0; k < n && HycoSize(HycoComm(s)) > 1; k++)
    HycoAllreduce(block + (size_t)k * (size_t)lda, (PetscMPIInt)n, MPIU_REAL, MPI_SUM, HycoComm(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemFill(HycoSystem s, PetscInt n, const PetscInt contact[], PetscReal M[], PetscReal q[])
{
  const size_t p = (size_t)s->n, N = p + (size_t)n;
  const PetscScalar *B = NULL, *F = NULL, *D;

  PetscFunctionBegin;
  if (p) PetscCall(MatDenseGetArrayRead(s->B, &B));
  for (size_t i = 0; i < p; i++) PetscCall(PetscArrayzero(M + i * N, p));
  for (size_t k = 0; k < (size_t)n; k++) {
    for (size_t i = 0; i < p; i++) {
      const PetscReal a = B[i * (size_t)s->m + (size_t)contact[k]];

      M[(p + k) * N + i] = a;
      M[i * N + p + k] = -a;
    }
  }
  if (p) PetscCall(MatDenseRestoreArrayRead(s->B, &B));
  PetscCall(HycoSystemCompliance(s, n, contact, (PetscInt)N, M + p * N + p));
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  if (p) PetscCall(VecGetArrayRead(s->F, &F));
  for (size_t i = 0; i < p; i++) q[i] = -F[i];
  if (p) PetscCall(VecRestoreArrayRead(s->F, &F));
  PetscCall(VecGetArrayRead(s->D, &D));
  for (size_t k = 0; k < (size_t)n; k++) q[p + k] = D[contact[k]];
  PetscCall(VecRestoreArrayRead(s->D, &D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W L. Few forces are nonzero: their columns of a dense W cost less than all. */
static PetscErrorCode ComplianceMultiply(HycoSystem s, Vec L, Vec move)
{
  const PetscInt m = s->m;
  const PetscScalar *W, *l;
  PetscScalar *v;

  PetscFunctionBegin;
  if (!s->dense_W) {
    PetscCall(MatMult(s->W, L, move));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecSet(move, 0));
  PetscCall(VecGetArray(move, &v));
  PetscCall(MatDenseGetArrayRead(s->W, &W));
  PetscCall(VecGetArrayRead(L, &l));
  for (PetscInt j = 0; j < m; j++) {
    const PetscScalar *column = W + (size_t)j * (size_t)m;

    for (PetscInt i = 0; l[j] != 0 && i < m; i++) v[i] += column[i] * l[j];
  }
  PetscCall(VecRestoreArrayRead(L, &l));
  PetscCall(MatDenseRestoreArrayRead(s->W, &W));
  PetscCall(VecRestoreArray(move, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemAddCompliance(HycoSystem s, Vec L, Vec w, PetscReal *size)
{
  const PetscScalar *move;
  PetscScalar *gap;
  PetscReal most = *size;
  PetscInt m;

  PetscFunctionBegin;
  if (!s->work_W) PetscCall(VecDuplicate(w, &s->work_W));
  PetscCall(ComplianceMultiply(s, L, s->work_W));
  PetscCall(VecGetLocalSize(w, &m));
  PetscCall(VecGetArrayRead(s->work_W, &move));
  PetscCall(VecGetArray(w, &gap));
  for (PetscInt i = 0; i < m; i++) {
    if (gap[i] >= PETSC_INFINITY) continue;
    most = PetscMax(most, PetscMax(PetscAbsReal(gap[i]), PetscAbsReal(move[i])));
    gap[i] += move[i];
  }
  PetscCall(VecRestoreArray(w, &gap));
  PetscCall(VecRestoreArrayRead(s->work_W, &move));
  PetscCall(HycoSystemMost(s, 1, &most));
  *size = most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemSizes(HycoSystem s, Vec x)
{
  PetscFunctionBegin;
  s->terms = NULL;
  if (s->W && s->terms_W) PetscCall((*s->terms_W)(s->W, x, &s->size, &s->terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoSystemGapRounding(HycoSystem s, PetscInt k)
{
  return s->terms ? PetscMin(HYCO_NOTHING * s->terms[k], HYCO_GAP_ROUND_OFF * s->size) : 0;
}

/* F - Bt L by free unknown, relative to the sizes of its terms: K = 0 has no part in it. Forces that balance
   themselves leave round-off. */
PetscErrorCode HycoSystemFreeStationarity(HycoSystem s, Vec L, PetscReal *value)
{
  const PetscScalar *B, *column, *F, *l;

  PetscFunctionBegin;
  *value = 0;
  PetscCall(MatDenseGetArrayRead(s->B, &B));
  PetscCall(VecGetArrayRead(s->F, &F));
  PetscCall(VecGetArrayRead(L, &l));
  column = B;
  for (PetscInt i = 0; i < s->n; i++, column += s->m) {
    PetscReal sum = F[i], terms = PetscAbsReal(F[i]), most = 0, all = 0;

    for (PetscInt k = 0; k < s->m; k++) {
      if (l[k] == 0) continue;
      sum -= column[k] * l[k];
      terms += PetscAbsReal(column[k] * l[k]);
      most = PetscMax(most, PetscAbsReal(column[k]));
      all += PetscAbsReal(l[k]);
    }
    sum = PetscAbsReal(sum) - PetscMax(s->rounding, HYCO_NOTHING * most * all);
    /* Negated: a NaN is no balance. */
    if (!(sum <= 0)) *value = PetscMax(*value, sum <= PETSC_MAX_REAL ? sum / terms : PETSC_MAX_REAL);
  }
  PetscCall(VecRestoreArrayRead(L, &l));
  PetscCall(VecRestoreArrayRead(s->F, &F));
  PetscCall(MatDenseRestoreArrayRead(s->B, &B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSystemMisfit(HycoSystem s, const PetscReal gap[], PetscReal *misfit)
{
  const PetscScalar *w, *D;

  PetscFunctionBegin;
  *misfit = 0;
  PetscCall(VecGetArrayRead(s->work_L, &w));
  PetscCall(VecGetArrayRead(s->D, &D));
  for (PetscInt k = 0; k < s->m && s->size > 0; k++) {
    if (D[k] < PETSC_INFINITY)
      *misfit = PetscMax(*misfit, (PetscAbsReal(gap[k] - w[k]) - HycoSystemGapRounding(s, k)) / s->size);
  }
  PetscCall(VecRestoreArrayRead(s->D, &D));
  PetscCall(VecRestoreArrayRead(s->work_L, &w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
