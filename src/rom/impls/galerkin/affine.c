/*
  The reduced stiffness as a polynomial of the parameters on which it depends. K is linear in moduli, and quadratic in
  maps that stretch a body along its axes; the reduced matrix consists of sums of K's entries with constant weights, so
  that it is a polynomial too, determined by its values at few parameter values without the cells of the RID. Training
  finds the degrees, checks them, and stores the values in the file (affine_fit.c).
*/
#include <hycotable.h>
#include <petsc/private/petscimpl.h> /* PetscObjectStateIncrease() */
#include <petscviewer.h>

/* Copies the values x. The degree is n - 1: the table interpolates. */
PetscErrorCode HycoTableCreate(const PetscInt n[], PetscReal *x[], PetscInt dim, PetscInt entries, HycoTable *table)
{
  HycoTable t;

  PetscFunctionBegin;
  PetscCall(PetscNew(&t));
  *table = t;
  /* No pattern: a dense matrix, until HycoTableKeepPattern() says otherwise. */
  t->n = -1;
  t->values.rows = entries;
  t->values.tensor.dim = dim;
  for (PetscInt p = 0; p < dim; p++) {
    HycoDuplicate(n[p], x[p], &t->x[p]);
    t->values.tensor.n[p] = n[p];
    t->values.tensor.degree[p] = n[p] - 1;
    t->values.tensor.x[p] = t->x[p];
  }
  PetscCall(PetscMalloc1((size_t)entries * (size_t)HycoTensorSize(&t->values.tensor), &t->values.data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x[p] are allocated one by one, as counts differ by parameter. */
PetscErrorCode HycoTableDestroy(HycoTable *table)
{
  HycoTable t = *table;

  PetscFunctionBegin;
  if (!t) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < t->values.tensor.dim; p++) PetscCall(PetscFree(t->x[p]));
  HycoFreeAll(&t->values.data, &t->start, &t->column, table);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file without the RID's K cannot derive the pattern: it is stored with the entries. */
PetscErrorCode HycoTableKeepPattern(HycoROM m, HycoTable t)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt *start, *column;
  PetscInt n;
  PetscBool dense, done;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &dense));
  if (dense) PetscFunctionReturn(PETSC_SUCCESS);
  /* The pattern of Kr in the order in which the entries of the table lie. */
  PetscCall(MatGetRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &column, &done));
  t->n = n;
  HycoDuplicate(n + 1, start, &t->start);
  HycoDuplicate(start[n], column, &t->column);
  PetscCall(MatRestoreRowIJ(g->Kr, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &column, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pattern is that of training: the same for all parameters, so that one evaluation fills all entries. */
PetscErrorCode HycoTableCreateSparse(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoTable t = g->model->table;

  PetscFunctionBegin;
  /* A file of another number of modes would be read out of bounds. */
  HycoCheck(t->n == m->n, "%s: the table of the reduced stiffness has %d rows, the matrix %d: train the model again",
            m->model->path, (int)t->n, (int)m->n);
  PetscCall(MatCreate(PETSC_COMM_SELF, &g->Kr));
  PetscCall(MatSetSizes(g->Kr, m->n, m->n, m->n, m->n));
  PetscCall(MatSetType(g->Kr, MATSEQAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(g->Kr, t->start, t->column, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each entry of the reduced stiffness is interpolated by itself: no cell is assembled, and the cost does not depend on
   the mesh. */
PetscErrorCode HycoTableFill(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt n;
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(HycoReducedEntries(m, &n, &a));
  HycoCheck(n == g->model->table->values.rows,
            "%s: the table of the reduced stiffness has %d entries, the matrix %d: train the model again",
            m->model->path, (int)g->model->table->values.rows, (int)n);
  PetscCall(HycoGridFieldEvaluate(&g->model->table->values, mu, a));
  /* Entries were written behind PETSc's back: solvers see the new state and factor again. */
  PetscCall(PetscObjectStateIncrease((PetscObject)g->Kr));
  PetscCall(HycoMatAssemble(g->Kr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of nodes says the polynomial's degree in each parameter. */
PetscErrorCode HycoTableView(HycoROM m, PetscViewer viewer)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  const HycoTensor *t = &g->table->values.tensor;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  the reduced stiffness is a polynomial, tabulated at"));
  for (PetscInt p = 0, n = 0; p < t->dim; p++) {
    /* Parameters of one node do not change the stiffness. */
    if (t->n[p] > 1)
      PetscCall(PetscViewerASCIIPrintf(viewer, "%s %d values of %s", n++ ? " x" : "", (int)t->n[p],
                                       m->model->scene->parameter[p]));
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parameters one after the other in one dataset: HDF5 has no ragged rows. */
PetscErrorCode HycoTableSave(HycoROM m, HycoH5 h)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  const HycoTable t = g->table;
  const HycoTensor *tensor = &t->values.tensor;
  PetscReal *x;
  PetscInt all = 0;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < tensor->dim; p++) all += tensor->n[p];
  PetscCall(PetscMalloc1(all + 1, &x));
  all = 0;
  for (PetscInt p = 0; p < tensor->dim; p++) {
    for (PetscInt k = 0; k < tensor->n[p]; k++) x[all++] = t->x[p][k];
  }
  PetscCall(HycoH5WriteInt(h, "table/counts", tensor->dim, 1, tensor->n));
  if (t->n >= 0) PetscCall(HycoH5WriteInt(h, "table/start", t->n + 1, 1, t->start));
  if (t->n >= 0) PetscCall(HycoH5WriteInt(h, "table/column", t->values.rows, 1, t->column));
  PetscCall(HycoH5WriteReal(h, "table/parameters", all, 1, x));
  /* A row per node of the grid, so that a reader sees one stiffness as one row. */
  PetscCall(HycoH5WriteReal(h, "table/stiffness", HycoTensorSize(tensor), t->values.rows, t->values.data));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that the values are ascending, `count` of them for each parameter. */
static PetscErrorCode CheckParameters(HycoROM m, const PetscInt count[], const PetscReal x[])
{
  PetscFunctionBegin;
  for (PetscInt p = 0; p < m->model->scene->n_parameters; p++) {
    for (PetscInt k = 0; k < count[p]; k++, x++)
      HycoCheck(!k || *x > x[-1], "%s: table/parameters is damaged", m->model->path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads and checks the rows of a sparse matrix: contiguous, with ascending columns. */
static PetscErrorCode LoadPattern(HycoROM m, HycoH5 h)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  const HycoTable t = g->table;
  PetscInt one = 1, n = -1, *entries = &t->values.rows;
  PetscBool good;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadInt(h, "table/start", 0, *entries, &n, &one, &t->start));
  t->n = n - 1;
  PetscCall(HycoH5LoadInt(h, "table/column", 0, PetscMax(t->n - 1, 0), entries, &one, &t->column));
  good = (PetscBool)(n > 1 && t->start[0] == 0 && t->start[n - 1] == *entries);
  /* MatSeqAIJSetPreallocationCSR() takes rows as they are: a wrong one would be memory out of bounds. */
  for (PetscInt i = 0; i < t->n && good; i++) {
    good = (PetscBool)(t->start[i + 1] >= t->start[i]);
    for (PetscInt k = t->start[i] + 1; k < t->start[i + 1] && good; k++)
      good = (PetscBool)(t->column[k] > t->column[k - 1]);
  }
  HycoCheck(good, "%s: table/start is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the table, without a sparse matrix's rows; the caller frees the arrays, also after a refused file. */
static PetscErrorCode LoadValues(HycoROM m, HycoH5 h, PetscInt **count, PetscReal **x, PetscReal **data)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  PetscInt dim = m->model->scene->n_parameters, one = 1, all = 0, nodes = 1, rows = -1;
  PetscReal *of[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoH5LoadInt(h, "table/counts", 1, 16, &dim, &one, count));
  for (PetscInt p = 0; p < dim; p++) {
    all += (*count)[p];
    nodes *= (*count)[p];
    /* Before the product of the counts can overflow or ask for all memory. */
    HycoCheck(nodes <= HYCO_TABLE_NODES, "%s: table/counts is damaged", m->model->path);
  }
  PetscCall(HycoH5LoadReal(h, "table/parameters", &all, &one, x));
  PetscCall(CheckParameters(m, *count, *x));
  PetscCall(HycoH5LoadReal(h, "table/stiffness", &nodes, &rows, data));
  for (PetscInt p = 0, at = 0; p < dim; at += (*count)[p++]) of[p] = *x + at;
  PetscCall(HycoTableCreate(*count, of, dim, rows, &g->table));
  PetscCall(PetscArraycpy(g->table->values.data, *data, (size_t)nodes * (size_t)rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A dense table has no `start`. */
PetscErrorCode HycoTableLoad(HycoROM m, HycoH5 h)
{
  PetscInt *count = NULL;
  PetscReal *x = NULL, *data = NULL;

  PetscFunctionBegin;
  HycoFinally(LoadValues(m, h, &count, &x, &data), HycoFreeAll(&data, &x, &count));
  if (HycoH5Has(h, "table/start")) PetscCall(LoadPattern(m, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}
