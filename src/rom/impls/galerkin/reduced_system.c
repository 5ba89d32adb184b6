/*
  The reduced system's matrices and vectors from those on the RID. Row i of K is used once: y = K[i,:] Vp gives its part
  on the modes, its entries on full-order unknowns the rest. Rows that no parameter changes are summed once and stored.
*/
#include <hycogalerkin.h>
#include <petsc/private/petscimpl.h> /* PetscObjectStateIncrease() */
#include <petscblaslapack.h>

struct _n_HycoReduced {
  PetscInt n_rows, n_constant, *row; /* free unknowns of A: first those that no parameter changes */
  PetscBool dense;                   /* whether Kr is dense */
  PetscScalar *constant;             /* contribution of the first n_constant rows to Kr; NULL: there is none */
  PetscReal *y, *value, *modes, *Y;  /* l; a row; n_free x n row major; hybrid all: n_fe x l row major */
  PetscInt *index;
};

PetscErrorCode HycoReducedCreateSparse(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscInt *nnz;
  const PetscInt *ia, *ja;
  PetscInt n;
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n, &nnz));
  PetscCall(MatGetRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  for (PetscInt k = 0; k < g->n_free; k++) nnz[k] = m->n;
  for (PetscInt k = 0; k < m->n_fe; k++) nnz[g->n_free + k] = g->n_free + ia[m->fe_dof[k] + 1] - ia[m->fe_dof[k]];
  PetscCall(MatRestoreRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(MatCreate(PETSC_COMM_SELF, &g->Kr));
  PetscCall(MatSetSizes(g->Kr, m->n, m->n, m->n, m->n));
  PetscCall(MatSetType(g->Kr, MATSEQAIJ));
  for (PetscInt k = 0; k < m->n; k++) nnz[k] = PetscMin(nnz[k], m->n);
  PetscCall(MatSeqAIJSetPreallocation(g->Kr, 0, nnz));
  PetscCall(PetscFree(nnz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedDestroy(HycoReduced *reduced)
{
  HycoReduced r = *reduced;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(r->row));
  PetscCall(PetscFree(r->constant));
  PetscCall(PetscFree5(r->y, r->value, r->index, r->modes, r->Y));
  PetscCall(PetscFree(*reduced));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of A, those whose cells are all constant first. */
static PetscErrorCode ListRows(HycoROM m, HycoReduced r)
{
  const PetscInt dim = m->fe->dim;
  PetscBool *varies;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->mesh->n_nodes, &varies));
  for (PetscInt e = 0; e < m->mesh->n_cells; e++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n = HycoMeshCellNodes(m->mesh, e, node);

    for (PetscInt v = 0; v < n && !m->fe->constant[e]; v++) varies[node[v]] = PETSC_TRUE;
  }
  PetscCall(PetscMalloc1(m->fe->n_dof, &r->row));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < m->fe->n_dof; i++) {
      if (m->role[i / dim] == HYCO_ROLE_A && !m->fe->fixed[i] && varies[i / dim] == (pass ? PETSC_TRUE : PETSC_FALSE))
        r->row[r->n_rows++] = i;
    }
    if (!pass) r->n_constant = r->n_rows;
  }
  PetscCall(PetscFree(varies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = K[i,:] Vp over the modes. */
static void RowTimesModes(HycoROM m, PetscInt n, const PetscInt col[], const PetscScalar val[], PetscReal y[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const PetscInt l = m->l;

  for (PetscInt j = 0; j < l; j++) y[j] = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = g->Vp + (size_t)col[k] * (size_t)l;

    for (PetscInt j = 0; j < l; j++) y[j] += val[k] * v[j];
  }
}

/* The part of row i of A on each unknown: `index`, `value`; returns their number. Modes first, all of them. */
static PetscInt ReducedRow(HycoROM m, PetscInt n, const PetscInt col[], const PetscScalar val[], PetscReal y[],
                           PetscInt index[], PetscReal value[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscInt count = 0;

  RowTimesModes(m, n, col, val, y);
  if (g->G && !g->bordered) {
    for (PetscInt f = 0; f < m->n_fe; f++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < m->l; j++) sum += y[j] * g->G[j * m->n_fe + f];
      index[f] = f;
      value[f] = sum;
    }
    for (PetscInt k = 0; k < n; k++) {
      if (g->fe_at[col[k]] >= 0) value[g->fe_at[col[k]]] += val[k];
    }
    return m->n_fe;
  }
  for (; count < g->n_free; count++) {
    index[count] = count;
    value[count] = y[count];
  }
  for (PetscInt k = 0; k < n; k++) {
    if (g->fe_at[col[k]] < 0) continue;
    index[count] = g->n_free + g->fe_at[col[k]];
    value[count++] = val[k];
  }
  return count;
}

/* The pattern of a sparse Kr: full rows of the modes; the modes and the neighbours in the others. */
static PetscErrorCode SetPattern(HycoROM m, const PetscInt ia[], const PetscInt ja[], const PetscScalar a[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoReduced r = g->reduced;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n; k++) {
    r->index[k] = k;
    r->value[k] = 0;
  }
  for (PetscInt j = 0; j < g->n_free; j++)
    PetscCall(MatSetValues(g->Kr, 1, &j, m->n, r->index, r->value, INSERT_VALUES));
  for (PetscInt k = 0; k < r->n_rows; k++) {
    const PetscInt i = r->row[k], row = g->n_free + g->fe_at[i];
    PetscInt count;

    if (g->fe_at[i] < 0) continue;
    count = ReducedRow(m, ia[i + 1] - ia[i], ja + ia[i], a + ia[i], r->y, r->index, r->value);
    PetscCall(MatSetValues(g->Kr, 1, &row, count, r->index, r->value, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(g->Kr, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(g->Kr, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows first .. last - 1 of the list. Those of full-order unknowns are stored in kr (start: Kr's rows, when sparse),
   the others are tested by the modes: modes += Vp_i^T (y, entries). */
static void AddRows(HycoROM m, PetscInt first, PetscInt last, const PetscInt ia[], const PetscInt ja[],
                    const PetscScalar a[], const PetscInt start[], PetscScalar kr[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoReduced r = g->reduced;

  for (PetscInt t = first; t < last; t++) {
    const PetscInt i = r->row[t], row = g->n_free + g->fe_at[i];
    const PetscInt count = ReducedRow(m, ia[i + 1] - ia[i], ja + ia[i], a + ia[i], r->y, r->index, r->value);
    const PetscReal *v = g->Vp + (size_t)i * (size_t)m->l;

    if (g->fe_at[i] < 0) {
      for (PetscInt j = 0; j < g->n_free; j++) {
        PetscReal *to = r->modes + (size_t)j * (size_t)m->n;

        for (PetscInt k = 0; k < g->n_free; k++) to[k] += v[j] * r->value[k];
        for (PetscInt k = g->n_free; k < count; k++) to[r->index[k]] += v[j] * r->value[k];
      }
    } else if (start)
      for (PetscInt k = 0; k < count; k++) kr[start[row] + k] = r->value[k];
    else
      for (PetscInt k = 0; k < count; k++) kr[(size_t)r->index[k] * (size_t)m->n + (size_t)row] = r->value[k];
  }
}

/* Stores the rows of the modes, which come before the others. */
static void PutModes(HycoROM m, const PetscInt start[], PetscScalar kr[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const size_t n = (size_t)m->n;

  for (size_t j = 0; j < (size_t)g->n_free; j++) {
    for (size_t k = 0; k < n; k++) kr[start ? (size_t)start[j] + k : k * n + j] += g->reduced->modes[j * n + k];
  }
}

/* The rows gamma - G U[A] = 0 of a sparse Kr. */
static void PutBorder(HycoROM m, const PetscInt start[], PetscScalar kr[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;

  for (PetscInt j = 0; j < g->n_free; j++) {
    PetscScalar *row = kr + start[j];

    for (PetscInt k = 0; k < g->n_free; k++) row[k] = k == j;
    for (PetscInt f = 0; f < m->n_fe; f++) row[g->n_free + f] = -g->G[j * m->n_fe + f];
  }
}

/* hybrid all: Kr = (K Vp) G + K[A,A], a dense product. */
static PetscErrorCode FillAll(HycoROM m, const PetscInt ia[], const PetscInt ja[], const PetscScalar a[],
                              PetscScalar kr[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoReduced r = g->reduced;
  PetscBLASInt n, l;
  const PetscReal one = 1, zero = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m->n_fe, &n));
  PetscCall(PetscBLASIntCast(m->l, &l));
  for (PetscInt t = 0; t < r->n_rows; t++) {
    const PetscInt i = r->row[t];

    RowTimesModes(m, ia[i + 1] - ia[i], ja + ia[i], a + ia[i], r->Y + (size_t)g->fe_at[i] * (size_t)m->l);
  }
  BLASgemm_("T", "T", &n, &n, &l, &one, r->Y, &l, g->G, &n, &zero, kr, &n);
  for (PetscInt t = 0; t < r->n_rows; t++) {
    const PetscInt i = r->row[t];

    for (PetscInt k = ia[i]; k < ia[i + 1]; k++) {
      if (g->fe_at[ja[k]] >= 0) kr[(size_t)g->fe_at[ja[k]] * (size_t)m->n + (size_t)g->fe_at[i]] += a[k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(HycoROM m, const PetscInt ia[], const PetscInt ja[], const PetscScalar a[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoReduced r;

  PetscFunctionBegin;
  PetscCall(PetscNew(&g->reduced));
  r = g->reduced;
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &r->dense));
  PetscCall(ListRows(m, r));
  PetscCall(PetscMalloc5(m->l, &r->y, m->n + 100, &r->value, m->n + 100, &r->index, g->n_free * m->n, &r->modes,
                         g->G && !g->bordered ? m->n_fe * m->l : 0, &r->Y));
  if (!r->dense && ia) PetscCall(SetPattern(m, ia, ja, a)); /* otherwise set from the table */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills Kr's n values; those of the constant rows are kept from the first time on. */
static PetscErrorCode FillRows(HycoROM m, const PetscInt ia[], const PetscInt ja[], const PetscScalar a[],
                               const PetscInt start[], PetscScalar kr[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoReduced r = g->reduced;
  const size_t n = start ? (size_t)start[m->n] : (size_t)m->n * (size_t)m->n;

  PetscFunctionBegin;
  if (!r->constant && r->n_constant) {
    PetscCall(PetscCalloc1(n, &r->constant));
    PetscCall(PetscArrayzero(r->modes, g->n_free * m->n));
    AddRows(m, 0, r->n_constant, ia, ja, a, start, r->constant);
    PutModes(m, start, r->constant);
  }
  if (r->constant)
    PetscCall(PetscArraycpy(kr, r->constant, n));
  else
    PetscCall(PetscArrayzero(kr, n));
  PetscCall(PetscArrayzero(r->modes, g->n_free * m->n));
  AddRows(m, r->n_constant, r->n_rows, ia, ja, a, start, kr);
  PutModes(m, start, kr);
  if (g->bordered) PutBorder(m, start, kr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedEntries(HycoROM m, PetscInt *n, PetscScalar *a[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const PetscInt *start, *columns;
  PetscScalar *all;
  PetscInt rows;
  PetscBool dense, done;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &dense));
  if (dense) {
    *n = m->n * m->n;
    PetscCall(MatDenseGetArray(g->Kr, &all));
    *a = all;
    PetscCall(MatDenseRestoreArray(g->Kr, &all)); /* they stay at the same address */
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &rows, &start, &columns, &done));
  *n = start[m->n];
  PetscCall(MatRestoreRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &rows, &start, &columns, &done));
  PetscCall(MatSeqAIJGetArray(g->Kr, &all));
  *a = all;
  PetscCall(MatSeqAIJRestoreArray(g->Kr, &all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedRows(HycoROM m, PetscInt row[])
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const PetscInt *start, *columns;
  PetscInt n;
  PetscBool dense, done;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &dense));
  if (dense) {
    for (PetscInt k = 0; k < m->n * m->n; k++) row[k] = k % m->n;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &columns, &done));
  for (PetscInt i = 0; i < m->n; i++) {
    for (PetscInt k = start[i]; k < start[i + 1]; k++) row[k] = i;
  }
  PetscCall(MatRestoreRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &columns, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedPrepare(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscFunctionBegin;
  if (!g->reduced) PetscCall(Create(m, NULL, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedFillStiffness(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const PetscInt *ia, *ja, *start = NULL, *columns;
  const PetscScalar *a;
  PetscScalar *kr;
  PetscInt n;
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(MatSeqAIJGetArrayRead(g->K, &a));
  if (!g->reduced) PetscCall(Create(m, ia, ja, a));
  if (g->reduced->dense) {
    PetscCall(MatDenseGetArrayWrite(g->Kr, &kr));
    PetscCall(g->G ? FillAll(m, ia, ja, a, kr) : FillRows(m, ia, ja, a, NULL, kr));
    PetscCall(MatDenseRestoreArrayWrite(g->Kr, &kr));
  } else {
    PetscCall(MatGetRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &columns, &done));
    PetscCall(MatSeqAIJGetArrayWrite(g->Kr, &kr));
    PetscCall(FillRows(m, ia, ja, a, start, kr));
    PetscCall(MatSeqAIJRestoreArrayWrite(g->Kr, &kr));
    PetscCall(MatRestoreRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &columns, &done));
  }
  PetscCall(PetscObjectStateIncrease((PetscObject)g->Kr));
  PetscCall(MatAssemblyBegin(g->Kr, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(g->Kr, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSeqAIJRestoreArrayRead(g->K, &a));
  PetscCall(MatRestoreRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B[A_lambda, A'_c] Vbar[A'_c,:] and Vbar[A_c,:]^T B[A_lambda, A_c]^T */
PetscErrorCode HycoReducedFillContact(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const HycoRows *rows = &g->own_rows;
  PetscReal *value;
  PetscInt *index, dim = m->fe->dim;

  PetscFunctionBegin;
  if (g->contact) {
    PetscCall(g->contact(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  value = g->reduced->value;
  index = g->reduced->index;
  PetscCall(MatZeroEntries(g->Br));
  PetscCall(MatZeroEntries(g->Btr));
  for (PetscInt k = 0; k < m->m; k++) {
    const PetscInt lo = rows->start[k], hi = rows->start[k + 1];
    PetscInt count = ReducedRow(m, hi - lo, rows->dof + lo, rows->value + lo, g->reduced->y, index, value);

    PetscCall(MatSetValues(g->Br, 1, &k, count, index, value, INSERT_VALUES));
    for (PetscInt j = 0; j < g->n_free; j++) {
      value[j] = 0;
      index[j] = j;
    }
    count = g->n_free;
    for (PetscInt t = lo; t < hi; t++) {
      const PetscInt i = rows->dof[t];

      if (m->role[i / dim] != HYCO_ROLE_A) continue;
      for (PetscInt j = 0; j < g->n_free; j++) value[j] += rows->value[t] * g->Vp[(size_t)i * (size_t)m->l + (size_t)j];
      if (g->fe_at[i] < 0) continue;
      index[count] = g->n_free + g->fe_at[i];
      value[count++] = rows->value[t];
    }
    PetscCall(MatSetValues(g->Btr, count, index, 1, &k, value, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(g->Br, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(g->Br, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(g->Btr, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(g->Btr, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducedTest(HycoROM m, const PetscScalar F[], Vec Fr)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscScalar *f;

  PetscFunctionBegin;
  PetscCall(VecSet(Fr, 0));
  PetscCall(VecGetArray(Fr, &f));
  for (PetscInt r = 0; r < g->reduced->n_rows; r++) {
    const PetscInt i = g->reduced->row[r];

    if (F[i] == 0) continue;
    if (g->fe_at[i] >= 0) f[g->n_free + g->fe_at[i]] += F[i];
    for (PetscInt j = 0; j < g->n_free; j++) f[j] += g->Vp[(size_t)i * (size_t)m->l + (size_t)j] * F[i];
  }
  PetscCall(VecRestoreArray(Fr, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vbar[A,:]^T F[A] and D[A_lambda] */
PetscErrorCode HycoReducedFillVectors(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const PetscScalar *F;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(g->F, &F));
  PetscCall(HycoReducedTest(m, F, g->Fr));
  PetscCall(VecRestoreArrayRead(g->F, &F));
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  if (g->gap) {
    PetscCall(g->gap(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArray(g->Dr, &d));
  for (PetscInt k = 0; k < m->m; k++) d[k] = g->own_rows.gap[k];
  PetscCall(VecRestoreArray(g->Dr, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
