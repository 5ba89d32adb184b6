/*
  Creates the table of the reduced stiffness (affine.c). Each parameter on which it depends gets as many values as the
  entries need to be polynomials along its range, then all combinations; the table must agree with the assembled matrix
  at points in between, otherwise there is no table and predictions assemble.
*/
#include <hycogalerkintraining.h>
#include <hycotable.h>

#define MOST    5       /* largest number of values of one parameter */
#define ENTRIES 5000000 /* largest number of entries in the table: 40 MB */
/* Of the largest entry of a row: 4500 eps, an interpolated table against the assembly. */
#define TABLE_AGREES 1e-12
#define N_CHECKS     3

/* The assembled matrix at mu. */
static PetscErrorCode AffineFitSample(HycoROM m, const PetscReal mu[], PetscInt entries, PetscReal value[])
{
  PetscScalar *a;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinAssemble(m, mu));
  PetscCall(HycoReducedEntries(m, &n, &a));
  PetscCheck(n == entries, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%d entries instead of %d", (int)n, (int)entries);
  PetscCall(PetscArraycpy(value, a, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the table reproduces the matrix at mu. At a point that made no entry of the table: agreement there is
   evidence of a polynomial. */
static PetscErrorCode AffineFitAgrees(HycoROM m, HycoTable t, const PetscReal mu[], PetscBool *agrees)
{
  const PetscInt entries = t->values.rows;
  PetscReal *here, *there, *largest;
  PetscInt *row;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(entries, &here, entries, &there, m->n, &largest));
  PetscCall(PetscMalloc1(entries, &row));
  PetscCall(AffineFitSample(m, mu, entries, here));
  /* Relative to the largest entry of its row: full-order rows and modes' rows differ by orders of magnitude. */
  PetscCall(HycoReducedRows(m, row));
  PetscCall(HycoGridFieldEvaluate(&t->values, mu, there));
  PetscCall(PetscArrayzero(largest, m->n));
  for (PetscInt k = 0; k < entries; k++) largest[row[k]] = PetscMax(largest[row[k]], PetscAbsReal(here[k]));
  *agrees = PETSC_TRUE;
  for (PetscInt k = 0; k < entries; k++)
    *agrees = (PetscBool)(*agrees && PetscAbsReal(here[k] - there[k]) <= TABLE_AGREES * largest[row[k]]);
  PetscCall(PetscFree3(here, there, largest));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Samples the entries at every node of the tensor grid, the last parameter fastest. */
static PetscErrorCode FillTable(HycoROM m, HycoTable t)
{
  const HycoTensor *tensor = &t->values.tensor;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt node = 0; node < HycoTensorSize(tensor); node++) {
    /* From the number of the node to its indices; the last is the fastest, as in HycoTensor. */
    for (PetscInt p = tensor->dim - 1, rest = node; p >= 0; p--) {
      mu[p] = t->x[p][rest % tensor->n[p]];
      rest /= tensor->n[p];
    }
    PetscCall(AffineFitSample(m, mu, t->values.rows, t->values.data + (size_t)node * (size_t)t->values.rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a table with n[p] values of each parameter, and checks it at some points off its nodes. */
static PetscErrorCode AffineFitTry(HycoROM m, const PetscInt n[], PetscInt entries, PetscInt varied, HycoTable *table,
                                   PetscBool *holds)
{
  const HycoScene s = m->model->scene;
  PetscReal *x[HYCO_MAX_PARAMETERS], mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    PetscCall(PetscMalloc1(n[p], &x[p]));
    /* Chebyshev points: interpolation of polynomials of degree n - 1 is exact and well conditioned. */
    PetscCall(HycoChebyshevNodes(n[p], s->lo[p], s->hi[p], x[p]));
  }
  PetscCall(HycoTableCreate(n, x, s->n_parameters, entries, table));
  for (PetscInt p = 0; p < s->n_parameters; p++) PetscCall(PetscFree(x[p]));
  PetscCall(FillTable(m, *table));
  *holds = PETSC_TRUE;
  for (PetscInt k = 0; k < N_CHECKS && *holds; k++) {
    for (PetscInt p = 0; p < s->n_parameters; p++) {
      /* Multiples of the golden ratio modulo 1: spread over the range and on no node. */
      const PetscReal golden = 0.6180339887498949 * (1 + k + 3 * p) + 0.1, part = golden - PetscFloorReal(golden);

      /* One parameter varies for its own degree; all together for the table itself. */
      mu[p] = varied < 0 || p == varied ? s->lo[p] + part * (s->hi[p] - s->lo[p]) : (s->lo[p] + s->hi[p]) / 2;
    }
    PetscCall(AffineFitAgrees(m, *table, mu, holds));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest number of values of parameter p that reproduce the matrix along its range; 0: more than MOST. */
static PetscErrorCode CountValues(HycoROM m, PetscInt p, PetscInt entries, PetscInt *count)
{
  PetscInt n[HYCO_MAX_PARAMETERS];
  PetscBool holds = PETSC_FALSE;

  PetscFunctionBegin;
  /* The others at one value, so that a trial has few nodes. */
  for (PetscInt q = 0; q < m->model->scene->n_parameters; q++) n[q] = 1;
  /* The first n that reproduces the entries gives their degree, n - 1. */
  for (n[p] = 2; n[p] <= MOST && !holds; n[p]++) {
    HycoTable table;

    PetscCall(AffineFitTry(m, n, entries, p, &table, &holds));
    PetscCall(HycoTableDestroy(&table));
    *count = n[p];
  }
  if (!holds) *count = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. Not finding a table is no failure: predictions then assemble. A stiffness that is a polynomial in the
   parameters is exact in the table; others are refused by AffineFitAgrees(), which is why no error is added. */
PetscErrorCode HycoGalerkinTabulate(HycoROM m, const PetscBool reaches[])
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  const HycoScene s = m->model->scene;
  PetscInt n[HYCO_MAX_PARAMETERS], nodes = 1, entries, varying = 0;
  PetscScalar *a;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool holds;
  HycoTable table;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    n[p] = 1;
    varying += reaches[p];
    mu[p] = (s->lo[p] + s->hi[p]) / 2;
  }
  /* Two values of each parameter are the least. */
  if (!varying || PetscPowInt(2, (int)varying) > HYCO_TABLE_NODES) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoGalerkinAssemble(m, mu));
  PetscCall(HycoReducedEntries(m, &entries, &a));
  for (PetscInt p = 0; p < s->n_parameters && nodes; p++) {
    if (reaches[p]) PetscCall(CountValues(m, p, entries, &n[p]));
    nodes *= n[p];
    if (nodes > HYCO_TABLE_NODES || (PetscReal)nodes * (PetscReal)entries > ENTRIES) nodes = 0;
  }
  if (!nodes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AffineFitTry(m, n, entries, -1, &table, &holds)); /* without a table, the model assembles */
  if (holds) PetscCall(HycoTableKeepPattern(m, table));
  if (holds)
    g->table = table;
  else
    PetscCall(HycoTableDestroy(&table));
  PetscFunctionReturn(PETSC_SUCCESS);
}
