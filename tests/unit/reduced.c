/*
  The reduced system of models (reduced_system.c) against products written out by its definition (38)-(40): with x the
  reduced unknowns, P from them to the unknowns of the RID, T the test functions, P on A alone,

    Kr = T^T K P,    Br = B P,    Btr = T^T B^T

  for dense and sparse matrices, each choice of full-order unknowns, at several parameters, with cells that none of them
  changes. The model's index sets are what (21)-(22), (32)-(37) say, without fixed unknowns.
*/
#include "check.h"
#include <hyco.h>
#include <hycogalerkin.h>
#include <unistd.h>

typedef struct {
  const char *scene;
  PetscInt n_options;
  const char *option[6][2];
  PetscInt n_points, n_parameters, counts[3];
  PetscReal mu[3][3];
  PetscBool dense, bordered;
} Case;

/* Young's modulus is no polynomial, so that the stiffness is not tabulated. */
#define BLOCKS                                                                                                         \
  "examples/blocks", 2,                                                                                                \
  {                                                                                                                    \
    {"-body_block_young", "2e5*(1+0.1*sin(500*crown))"},                                                               \
    {                                                                                                                  \
      "-hyco_hybrid", NULL                                                                                             \
    }                                                                                                                  \
  }
#define PELLET                                                                                                         \
  "examples/pellet/paper.yaml", 3,                                                                                     \
  {                                                                                                                    \
    {"-body_pellet_young", "1e5*(1+0.1*sin(200*radius))"}, {"-hyco_rid_contact_extension", "10"},                      \
    {                                                                                                                  \
      "-hyco_hybrid", "contact"                                                                                        \
    }                                                                                                                  \
  }
#define ROD                                                                                                            \
  "examples/rod", 4,                                                                                                   \
  {                                                                                                                    \
    {"-hyco_hybrid", "all"}, {"-hyco_rid_layers", "6"}, {"-hyco_hybrid_ridge", "1e-10"},                               \
    {                                                                                                                  \
      "-hyco_model_type", "hybrid"                                                                                     \
    }                                                                                                                  \
  }

static PetscErrorCode SetOptions(const Case *c, const char hybrid[], PetscBool on)
{
  PetscFunctionBegin;
  PetscCall(on ? PetscOptionsSetValue(NULL, "-hyco_search", "false") : PetscOptionsClearValue(NULL, "-hyco_search"));
  PetscCall(on ? PetscOptionsSetValue(NULL, "-hyco_validation", "0")
               : PetscOptionsClearValue(NULL, "-hyco_validation"));
  for (PetscInt k = 0; k < c->n_options; k++) {
    const char *value = c->option[k][1] ? c->option[k][1] : hybrid;

    PetscCall(on ? PetscOptionsSetValue(NULL, c->option[k][0], value) : PetscOptionsClearValue(NULL, c->option[k][0]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Train(const Case *c, const char hybrid[], const char path[])
{
  char name[PETSC_MAX_PATH_LEN];
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;

  PetscFunctionBegin;
  snprintf(name, sizeof(name), "%s/%s", getenv("HYCO_SOURCE"), c->scene);
  PetscCall(SetOptions(c, hybrid, PETSC_TRUE));
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, name, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, c->counts, PETSC_FALSE));
  PetscCall(HycoReducerCreate(PETSC_COMM_SELF, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, path, NULL));
  PetscCall(SetOptions(c, hybrid, PETSC_FALSE));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A written-out matrix, row major. */
typedef struct {
  PetscInt rows, columns;
  PetscReal *a;
} Dense;

static PetscErrorCode DenseCreate(PetscInt rows, PetscInt columns, Dense *d)
{
  PetscFunctionBegin;
  d->rows = rows;
  d->columns = columns;
  PetscCall(PetscCalloc1((size_t)rows * (size_t)columns, &d->a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal *At(const Dense *d, PetscInt i, PetscInt j)
{
  return d->a + (size_t)i * (size_t)d->columns + (size_t)j;
}

/* to += scale from, for rows. */
static void AddRow(PetscInt n, PetscReal scale, const PetscReal from[], PetscReal to[])
{
  for (PetscInt j = 0; j < n && scale != 0; j++) to[j] += scale * from[j];
}

/* P and T; T of unknowns that are not in A is zero. sets: by node, as in HycoROMGetDomain(). */
static PetscErrorCode WriteBases(HycoROM m, const PetscInt sets[], Dense *P, Dense *T)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt first = g->model->G && !g->bordered ? 0 : g->n_free;

  PetscFunctionBegin;
  PetscCall(DenseCreate(m->fe->n_dof, m->n, P));
  PetscCall(DenseCreate(m->fe->n_dof, m->n, T));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    const PetscBool inside = (PetscBool)(sets[i / m->fe->dim] == 2 && !m->fe->fixed[i]);
    PetscInt k = 0;

    while (k < m->model->n_fe && m->model->fe_dof[k] != i) k++;
    if (k < m->model->n_fe) {
      CHECK(inside, "the full-order unknown %d is not a free one of A", (int)i);
      *At(P, i, first + k) = *At(T, i, first + k) = 1;
      continue;
    }
    for (PetscInt j = 0; j < m->model->l && !m->fe->fixed[i]; j++) {
      if (first || !g->model->G) {
        *At(P, i, j) = m->model->V[i * m->model->l + j];
        if (inside && !g->bordered) *At(T, i, j) = m->model->V[i * m->model->l + j];
      } else
        AddRow(m->n, m->model->V[i * m->model->l + j], g->model->G + j * m->model->n_fe, At(P, i, 0));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T^T (A P), A given by rows; of rows without A: T^T A. */
static PetscErrorCode Project(Mat A, const Dense *P, const Dense *T, Dense *TAP)
{
  Dense AP;

  PetscFunctionBegin;
  PetscCall(DenseCreate(P->rows, P->columns, &AP));
  PetscCall(DenseCreate(T->columns, P->columns, TAP));
  for (PetscInt i = 0; i < P->rows; i++) {
    const PetscInt *column;
    const PetscScalar *value;
    PetscInt n;

    PetscCall(MatGetRow(A, i, &n, &column, &value));
    for (PetscInt k = 0; k < n; k++) AddRow(P->columns, value[k], At(P, column[k], 0), At(&AP, i, 0));
    PetscCall(MatRestoreRow(A, i, &n, &column, &value));
  }
  for (PetscInt i = 0; i < P->rows; i++) {
    for (PetscInt j = 0; j < T->columns; j++) AddRow(P->columns, *At(T, i, j), At(&AP, i, 0), At(TAP, j, 0));
  }
  PetscCall(PetscFree(AP.a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every entry of A agrees, relative to the largest. */
static PetscErrorCode Compare(const char name[], Mat A, const Dense *expected)
{
  PetscReal size = 0, lost = 0, nonzero = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < expected->rows; i++) {
    for (PetscInt j = 0; j < expected->columns; j++) {
      PetscScalar value;

      PetscCall(MatGetValue(A, i, j, &value));
      size = PetscMax(size, PetscAbsReal(*At(expected, i, j)));
      lost = PetscMax(lost, PetscAbsReal(value - *At(expected, i, j)));
      nonzero += value != 0;
    }
  }
  CHECK(nonzero > 0 && lost <= 1e-12 * size, "%s: %g of %g entries differ by up to %g, the largest is %g", name,
        (double)nonzero, (double)(expected->rows * expected->columns), (double)lost, (double)size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts' rows: Br = B P and Btr = T^T B^T. */
static PetscErrorCode CheckContact(HycoROM m, const Dense *P, const Dense *T)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoRows *rows = &g->own_rows;
  Dense B, Bt;

  PetscFunctionBegin;
  PetscCall(DenseCreate(m->m, m->n, &B));
  PetscCall(DenseCreate(m->n, m->m, &Bt));
  for (PetscInt k = 0; k < m->m; k++) {
    for (PetscInt t = rows->start[k]; t < rows->start[k + 1]; t++) {
      AddRow(m->n, rows->value[t], At(P, rows->dof[t], 0), At(&B, k, 0));
      for (PetscInt j = 0; j < m->n; j++) *At(&Bt, j, k) += rows->value[t] * *At(T, rows->dof[t], j);
    }
  }
  PetscCall(Compare("Br", g->Br, &B));
  PetscCall(Compare("Btr", g->Btr, &Bt));
  PetscCall(PetscFree(B.a));
  PetscCall(PetscFree(Bt.a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Members of a set of unknowns: free, and of nodes in so many sets, or -1 for any. Returns their number. */
static PetscErrorCode CheckSet(HycoROM m, const char name[], IS is, const PetscInt sets[], PetscInt in, PetscInt *n)
{
  const PetscInt *dof;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(is, n));
  PetscCall(ISGetIndices(is, &dof));
  for (PetscInt k = 0; k < *n; k++) {
    CHECK(!m->fe->fixed[dof[k]], "%s contains the fixed unknown %d", name, (int)dof[k]);
    CHECK(in < 0 || sets[dof[k] / m->fe->dim] == in, "%s contains unknown %d of a node of %d sets", name, (int)dof[k],
          (int)sets[dof[k] / m->fe->dim]);
    CHECK(!k || dof[k] > dof[k - 1], "%s is not sorted", name);
  }
  PetscCall(ISRestoreIndices(is, &dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sets have all free unknowns of their nodes, there are fixed ones beside them, and A_lambda has the contacts of
   the file. */
static PetscErrorCode CheckSets(HycoROM m, const PetscInt sets[])
{
  const HycoIndexSets *s = &((HycoGalerkin)m->work)->sets;
  const PetscInt *contact;
  PetscInt n[4], expected[3] = {0, 0, 0}, n_fixed = 0, n_contacts, in = 0;

  PetscFunctionBegin;
  PetscCall(CheckSet(m, "A", s->is_A, sets, 2, &n[2]));
  PetscCall(CheckSet(m, "I", s->is_I, sets, 1, &n[1]));
  PetscCall(CheckSet(m, "A_c", s->is_Ac, sets, 2, &n[0]));
  PetscCall(CheckSet(m, "A'_c", s->is_Ac_all, sets, -1, &n[3]));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    expected[sets[i / m->fe->dim]] += !m->fe->fixed[i];
    n_fixed += m->fe->fixed[i] && sets[i / m->fe->dim];
  }
  CHECK(n[2] == expected[2] && n[1] == expected[1], "%d unknowns in A and %d in I instead of %d and %d", (int)n[2],
        (int)n[1], (int)expected[2], (int)expected[1]);
  CHECK(n[1] > 0 && n_fixed > 0, "the RID has no free unknown on its interface, or none that is fixed");
  CHECK(n[0] > 0 && n[0] <= n[3], "A_c has %d unknowns, A'_c %d", (int)n[0], (int)n[3]);
  PetscCall(ISGetLocalSize(s->is_A_lambda, &n_contacts));
  PetscCall(ISGetIndices(s->is_A_lambda, &contact));
  for (PetscInt k = 0; k < n_contacts; k++) in += m->model->in_rid[contact[k]];
  for (PetscInt k = 0; k < m->model->pairs.n; k++) in -= m->model->in_rid[k];
  CHECK(in == 0 && n_contacts == m->m && m->m > 0, "A_lambda is not the set of the file");
  PetscCall(ISRestoreIndices(s->is_A_lambda, &contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSystem(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  Dense P, T, Kr;
  PetscInt *sets;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->model->mesh->n_nodes, &sets));
  PetscCall(HycoROMGetDomain(m, sets));
  PetscCall(CheckSets(m, sets));
  PetscCall(WriteBases(m, sets, &P, &T));
  PetscCall(Project(g->K, &P, &T, &Kr));
  for (PetscInt j = 0; j < g->n_free && g->bordered; j++) { /* gamma - G U[A] = 0 */
    *At(&Kr, j, j) = 1;
    for (PetscInt f = 0; f < m->model->n_fe; f++) *At(&Kr, j, g->n_free + f) = -g->model->G[j * m->model->n_fe + f];
  }
  PetscCall(Compare("Kr", g->Kr, &Kr));
  PetscCall(CheckContact(m, &P, &T));
  PetscCall(PetscFree(Kr.a));
  PetscCall(PetscFree(P.a));
  PetscCall(PetscFree(T.a));
  PetscCall(PetscFree(sets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced system of a trained model at several points, dense, sparse or bordered. */
static PetscErrorCode TestCase(const Case *c, const char hybrid[])
{
  char path[64];
  HycoROM m;
  HycoGalerkin g;
  PetscBool dense;

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "reduced-%s-%d.h5", hybrid, (int)getpid());
  PetscCall(Train(c, hybrid, path));
  PetscCall(HycoROMLoad(path, &m));
  for (PetscInt k = 0; k < c->n_points; k++) {
    PetscCall(HycoROMPredict(m, c->n_parameters, c->mu[k]));
    g = (HycoGalerkin)m->work;
    PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &dense));
    CHECK(!g->model->table && dense == c->dense && g->bordered == c->bordered,
          "%s: not the system that this case is for", hybrid);
    CHECK(c->bordered || (m->fe->n_constant > 0 && m->fe->n_constant < m->model->mesh->n_cells),
          "%d of %d cells do not depend on parameters", (int)m->fe->n_constant, (int)m->model->mesh->n_cells);
    PetscCall(CheckSystem(m));
  }
  PetscCall(HycoROMDestroy(&m));
  unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  const Case blocks = {BLOCKS, 3, 2, {3, 3}, {{0.03, 0.05}, {0.06, 0.05}, {0.06, 0.07}}, PETSC_TRUE, PETSC_FALSE};
  const Case pellet = {PELLET, 2, 2, {2, 2}, {{4.04, 0.5}, {4.09, 1}}, PETSC_FALSE, PETSC_FALSE};
  const Case rod = {ROD, 1, 3, {2, 1, 1}, {{0.05, 40, 1}}, PETSC_FALSE, PETSC_TRUE};

  PetscFunctionBegin;
  PetscCheck(getenv("HYCO_SOURCE"), PETSC_COMM_SELF, PETSC_ERR_USER, "HYCO_SOURCE is not set");
  PetscCall(TestCase(&blocks, "contact"));
  PetscCall(TestCase(&blocks, "rank"));
  PetscCall(TestCase(&blocks, "all"));
  PetscCall(TestCase(&pellet, "contact"));
  PetscCall(TestCase(&rod, "all"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
