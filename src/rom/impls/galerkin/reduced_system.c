/*
  The reduced system (38) from K[A, A+I] and B[A_lambda, A'_c], which are submatrices on the model's index sets, and
  products of them with the modes. With x = (gamma, U_f), the unknowns of the RID are P x, P = [V | E], where V has zero
  rows at the full-order unknowns f and E is the identity there; the test space is P[A, :]. In blocks, with A = m + f:

    Kr = | V[m]^T K[m,:] V   (K[f,A] V[A])^T |     since K is symmetric
         |              K[f,:] P             |

  hybrid all, dense: gamma = G U[A], so that Kr = (K[A,:] V) G + K[A,A]. Rows of K that no parameter changes contribute
  once. Submatrices of K have every unknown as a column, one stride, which PETSc copies 3 times faster than a general
  set: columns outside A + I belong to fixed unknowns, where K has no couplings and V is zero.
*/
#include <hycogalerkin.h>

/* Rows of K[A, :] and their products. Of an empty set there are none. */
typedef struct {
  PetscInt n_full, *row; /* the row of Kr of each full-order unknown */
  IS tested, full;       /* m, f */
  Mat K_m, V_m, KV, M;   /* K[m,:], V[m], K[m,:] V, V[m]^T K[m,:] V */
  Mat K_f, U, F;         /* K[f,:], K[f,A] V[A], K[f,:] P */
} Rows;

/* For a set of unknowns: B[A_lambda, set], P[set, :], their product. */
typedef struct {
  Mat B, P, BP;
} ContactProduct;

struct _n_HycoReduced {
  IS all;                            /* every unknown of fe's mesh */
  Mat V, V_A, P;                     /* n_dof rows; V_A: zero outside A; P: with the modes that are unknowns */
  Rows varying;                      /* rows that a parameter changes; hybrid all, dense: all rows */
  Mat constant;                      /* M of the others */
  Mat KV, G;                         /* hybrid all, dense: K[A,:] V; G, l x n_fe */
  PetscScalar *modes;                /* Kr's rows of the modes, n_free x n row major */
  PetscInt *index;                   /* 0, 1, ..., n - 1 */
  PetscBool dense, filled, all_full; /* Kr is dense; has been filled; its unknowns are U[A], and gamma = G U[A] */
  Vec u, gamma;                      /* without arrays of their own */
  ContactProduct all_c, Ac;          /* for A'_c and A_c */
  PetscObjectState pattern;          /* of B, for which these are */
};

/* The matrices of one group of rows, all made by MatCreateSubMatrix() or products on the model's IS. */
static PetscErrorCode DestroyRows(Rows *s)
{
  Mat *const each[] = {&s->K_m, &s->V_m, &s->KV, &s->M, &s->K_f, &s->U, &s->F};

  PetscFunctionBegin;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(each); k++) PetscCall(MatDestroy(each[k]));
  HycoDestroyAll(&s->tested, &s->full);
  PetscCall(PetscFree(s->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyContact(ContactProduct *c)
{
  PetscFunctionBegin;
  HycoDestroyAll(&c->B, &c->P, &c->BP);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V_A may be V itself: both are counted references. */
PetscErrorCode HycoReducedDestroy(HycoReduced *reduced)
{
  HycoReduced r = *reduced;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DestroyRows(&r->varying));
  PetscCall(DestroyContact(&r->all_c));
  PetscCall(DestroyContact(&r->Ac));
  HycoDestroyAll(&r->all, &r->V, &r->V_A, &r->P, &r->constant, &r->KV, &r->G);
  PetscCall(PetscFree2(r->modes, r->index));
  HycoDestroyAll(&r->u, &r->gamma);
  PetscCall(PetscFree(*reduced));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the bases -- */

/* A matrix that is stored row major. PETSc's dense matrices lie by columns: the same array is the transpose. */
static PetscErrorCode CreateRowMajor(PetscInt rows, PetscInt columns, PetscReal a[], Mat *A)
{
  Mat At;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, columns, rows, a, &At));
  PetscCall(MatTranspose(At, MAT_INITIAL_MATRIX, A));
  PetscCall(MatDestroy(&At));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V and V_A; if only fixed unknowns, where V is zero, are outside A, they are the same. */
static PetscErrorCode CreateModes(HycoROM m, HycoReduced r)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt n_A;
  IS rest;

  PetscFunctionBegin;
  PetscCall(CreateRowMajor(m->fe->n_dof, m->model->l, m->model->V, &r->V));
  /* Full-order unknowns are represented by E alone. */
  PetscCall(MatZeroRows(r->V, m->model->n_fe, m->model->fe_dof, 0, NULL, NULL));
  PetscCall(ISGetLocalSize(g->sets.is_A, &n_A));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) n_A += m->fe->fixed[i];
  if (n_A == m->fe->n_dof) {
    PetscCall(PetscObjectReference((PetscObject)r->V));
    r->V_A = r->V;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatDuplicate(r->V, MAT_COPY_VALUES, &r->V_A));
  PetscCall(ISComplement(g->sets.is_A, 0, m->fe->n_dof, &rest));
  PetscCall(MatZeroRowsIS(r->V_A, rest, 0, NULL, NULL));
  PetscCall(ISDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P[unknowns, :]: of a full-order unknown its unit vector; of others V, or with gamma = G U[A] V G. */
static PetscErrorCode CreateP(HycoROM m, IS unknowns, PetscBool with_G, Mat *P)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt n_modes = with_G ? m->n : g->n_free, *dof;
  const PetscScalar one = 1;
  PetscScalar *v;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(unknowns, &n));
  PetscCall(ISGetIndices(unknowns, &dof));
  PetscCall(PetscMalloc1(m->n, &v));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, m->n, PetscMax(1, n_modes), NULL, P));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *modes = m->model->V + (size_t)dof[i] * (size_t)m->model->l;
    PetscInt at;

    PetscCall(PetscFindInt(dof[i], m->model->n_fe, m->model->fe_dof, &at));
    if (at >= 0) {
      at += g->n_free;
      PetscCall(MatSetValues(*P, 1, &i, 1, &at, &one, INSERT_VALUES));
      continue;
    }
    /* By rows of V: one row of P is a combination of the modes, or through G of the unknowns of A. */
    for (PetscInt j = 0; j < n_modes; j++) {
      v[j] = with_G ? 0 : modes[j];
      for (PetscInt k = 0; with_G && k < m->model->l; k++) v[j] += modes[k] * g->model->G[k * m->n + j];
    }
    /* A fixed unknown's row is empty: its value is in u0 and moves to the right-hand side. */
    if (!m->fe->fixed[dof[i]]) PetscCall(MatSetValues(*P, 1, &i, n_modes, g->reduced->index, v, INSERT_VALUES));
  }
  PetscCall(HycoMatAssemble(*P));
  PetscCall(PetscFree(v));
  PetscCall(ISRestoreIndices(unknowns, &dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vectors u and gamma get arrays of the caller by VecPlaceArray(): no copies in each residual. */
PetscErrorCode HycoReducedPrepare(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r;

  PetscFunctionBegin;
  if (g->reduced) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&g->reduced));
  r = g->reduced;
  /* No coefficients among the unknowns: gamma = G U[A] throughout. */
  r->all_full = (PetscBool)(g->model->G && !g->bordered);
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &r->dense));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, m->fe->n_dof, 0, 1, &r->all));
  PetscCall(PetscCalloc2(g->n_free * m->n, &r->modes, m->n, &r->index));
  for (PetscInt k = 0; k < m->n; k++) r->index[k] = k;
  PetscCall(CreateModes(m, r));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, m->fe->n_dof, NULL, &r->u));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, m->model->l, NULL, &r->gamma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the stiffness -- */

/* The unknowns of cells that a parameter changes. Rows of K outside this set are multiplied once; for each new
   stiffness only these are. */
static PetscErrorCode CreateVarying(HycoROM m, IS *unknowns)
{
  PetscInt n = 0, *dof;
  PetscBool *varies;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes, &varies));
  PetscCall(PetscMalloc1(m->fe->n_dof, &dof));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    /* A cell is constant if neither its law, its map nor its temperature depends on a parameter. */
    const PetscInt n_nodes = m->fe->constant[e] ? 0 : HycoMeshCellNodes(m->model->mesh, e, node);

    for (PetscInt v = 0; v < n_nodes; v++) varies[node[v]] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    if (varies[i / m->fe->dim]) dof[n++] = i;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, dof, PETSC_COPY_VALUES, unknowns));
  HycoFreeAll(&dof, &varies);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of K[A, :] in a set (ISIntersect()) or not in it (ISDifference()). Where these are all of K's rows but those
   of fixed unknowns, the submatrix is K itself: MatCreateSubMatrix() returns it if rows and columns are the same
   stride. */
static PetscErrorCode CreateRows(HycoROM m, IS in, PetscErrorCode (*of)(IS, IS, IS *), Rows *s)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;
  const PetscInt *dof;
  PetscInt n_tested, n_A;
  IS fe, tested, columns;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, m->model->n_fe, m->model->fe_dof, PETSC_COPY_VALUES, &fe));
  PetscCall(ISDifference(g->sets.is_A, fe, &tested));
  /* Two kinds of rows: full-order unknowns test with their shape function, the rest of A with the modes. */
  PetscCall((*of)(fe, in, &s->full));
  PetscCall((*of)(tested, in, &s->tested));
  HycoDestroyAll(&tested, &fe);
  PetscCall(ISGetLocalSize(s->full, &s->n_full));
  PetscCall(PetscMalloc1(s->n_full, &s->row));
  PetscCall(ISGetIndices(s->full, &dof));
  for (PetscInt k = 0; k < s->n_full; k++) {
    PetscCall(PetscFindInt(dof[k], m->model->n_fe, m->model->fe_dof, &s->row[k]));
    /* Unknowns of x come after the coefficients. */
    s->row[k] += g->n_free;
  }
  PetscCall(ISRestoreIndices(s->full, &dof));
  PetscCall(ISGetLocalSize(s->tested, &n_tested));
  PetscCall(ISGetLocalSize(g->sets.is_A, &n_A));
  if (!n_tested || !g->n_free)
    PetscCall(ISDestroy(&s->tested));
  else if (n_tested == n_A && r->V_A == r->V) {
    PetscCall(ISDestroy(&s->tested));
    PetscCall(PetscObjectReference((PetscObject)r->all));
    s->tested = r->all;
  }
  if (!s->tested) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISCreateStride(PETSC_COMM_SELF, m->model->l, 0, 1, &columns));
  PetscCall(MatCreateSubMatrix(r->V, s->tested, columns, MAT_INITIAL_MATRIX, &s->V_m));
  PetscCall(ISDestroy(&columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The submatrices of K on these rows, and their products. */
static PetscErrorCode ReducedSystemMultiply(HycoROM m, MatReuse reuse, Rows *s)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;

  PetscFunctionBegin;
  if (s->tested) {
    PetscCall(MatCreateSubMatrix(g->K, s->tested, r->all, reuse, &s->K_m));
    PetscCall(MatMatMult(s->K_m, r->V, reuse, PETSC_DETERMINE, &s->KV));
    /* An inner dimension of 0 would leave M stale in some releases of PETSc: `tested` is NULL then. */
    PetscCall(MatTransposeMatMult(s->V_m, s->KV, reuse, PETSC_DETERMINE, &s->M));
  }
  if (!s->n_full) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateSubMatrix(g->K, s->full, r->all, reuse, &s->K_f));
  PetscCall(MatMatMult(s->K_f, r->P, reuse, PETSC_DETERMINE, &s->F));
  if (g->n_free && !g->bordered) PetscCall(MatMatMult(s->K_f, r->V_A, reuse, PETSC_DETERMINE, &s->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A row of Kr. A sparse one has its pattern from the first time on. MatSetValuesRow() skips the search for each column,
   which is most of the time of a small insertion. */
static PetscErrorCode PutRow(HycoROM m, PetscInt row, PetscInt n, const PetscInt column[], const PetscScalar value[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  if (g->reduced->filled && !g->reduced->dense)
    PetscCall(MatSetValuesRow(g->Kr, row, value));
  else
    PetscCall(MatSetValues(g->Kr, 1, &row, n, column, value, INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of full-order unknowns, and their columns in the rows of the modes. F's columns are already in the order of
   x. */
static PetscErrorCode PutFull(HycoROM m, const Rows *s)
{
  const PetscScalar *u;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_full; k++) {
    const PetscInt *column;
    const PetscScalar *value;
    PetscInt n;

    PetscCall(MatGetRow(s->F, k, &n, &column, &value));
    PetscCall(PutRow(m, s->row[k], n, column, value));
    PetscCall(MatRestoreRow(s->F, k, &n, &column, &value));
  }
  /* U: columns of full-order unknowns in the rows that the modes test. */
  if (!s->U) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDenseGetArrayRead(s->U, &u));
  for (PetscInt j = 0; j < m->model->l; j++) {
    for (PetscInt k = 0; k < s->n_full; k++)
      ((HycoGalerkin)m->work)->reduced->modes[j * m->n + s->row[k]] = u[j * s->n_full + k];
  }
  PetscCall(MatDenseRestoreArrayRead(s->U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds M, l x l, to the modes' part of their rows. */
static PetscErrorCode AddModes(HycoROM m, Mat M)
{
  const PetscScalar *a;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  /* PETSc's dense matrices lie by columns, `modes` by rows. */
  PetscCall(MatDenseGetArrayRead(M, &a));
  for (PetscInt i = 0; i < m->model->l; i++) {
    for (PetscInt j = 0; j < m->model->l; j++)
      ((HycoGalerkin)m->work)->reduced->modes[i * m->n + j] += a[j * m->model->l + i];
  }
  PetscCall(MatDenseRestoreArrayRead(M, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of the modes; of a bordered system gamma - G U[A] = 0, which stay. */
static PetscErrorCode PutModes(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;

  PetscFunctionBegin;
  /* These rows are the definition of gamma and do not depend on the parameters. */
  if (g->bordered && r->filled) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < g->n_free; i++) {
    PetscScalar *row = r->modes + i * m->n;

    PetscCall(PetscArrayzero(row, m->model->l));
    if (g->bordered) row[i] = 1;
    for (PetscInt f = 0; g->bordered && f < m->model->n_fe; f++)
      row[m->model->l + f] = -g->model->G[i * m->model->n_fe + f];
  }
  PetscCall(AddModes(m, r->constant));
  PetscCall(AddModes(m, r->varying.M));
  for (PetscInt i = 0; i < g->n_free; i++) PetscCall(PutRow(m, i, m->n, r->index, r->modes + i * m->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for a sparse Kr: full rows of the modes; the modes and the neighbours in the others. */
static PetscErrorCode ReducedSystemPreallocate(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt *n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n, &n));
  for (PetscInt j = 0; j < g->n_free; j++) n[j] = m->n;
  for (PetscInt k = 0; k < m->model->n_fe; k++) {
    /* A full-order unknown couples with its neighbours in K and, through the others, with all modes. */
    PetscCall(MatGetRow(g->K, m->model->fe_dof[k], &n[g->n_free + k], NULL, NULL));
    PetscCall(MatRestoreRow(g->K, m->model->fe_dof[k], NULL, NULL, NULL));
    n[g->n_free + k] = PetscMin(m->n, g->n_free + n[g->n_free + k]);
  }
  PetscCall(MatSeqAIJSetPreallocation(g->Kr, 0, n));
  PetscCall(PetscFree(n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first time: the rows, and what those that no parameter changes contribute to Kr. */
static PetscErrorCode ReducedSystemStart(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;
  Rows constant = {0};
  PetscInt n;
  IS varying;

  PetscFunctionBegin;
  if (m->model->n_fe) PetscCall(CreateP(m, r->all, PETSC_FALSE, &r->P));
  PetscCall(CreateVarying(m, &varying));
  PetscCall(ISGetLocalSize(varying, &n));
  /* If a third varies, splitting the rows costs more than multiplying all of them. */
  if (r->all_full ||
      (!m->model->n_fe && r->V_A == r->V && 3 * n >= m->fe->n_dof)) { /* K itself is faster than a copy */
    PetscCall(ISDestroy(&varying));
    PetscCall(CreateRows(m, r->all, ISIntersect, &r->varying));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!r->dense) PetscCall(ReducedSystemPreallocate(m));
  PetscCall(CreateRows(m, varying, ISIntersect, &r->varying));
  PetscCall(CreateRows(m, varying, ISDifference, &constant));
  PetscCall(ISDestroy(&varying));
  /* Once: what no parameter changes is a constant l x l block and constant rows. */
  PetscCall(ReducedSystemMultiply(m, MAT_INITIAL_MATRIX, &constant));
  PetscCall(PutFull(m, &constant));
  r->constant = constant.M;
  constant.M = NULL;
  PetscCall(DestroyRows(&constant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* hybrid all, dense: (K[A,:] V) G + K[A,A] */
static PetscErrorCode PutAll(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;

  PetscFunctionBegin;
  if (r->filled)
    PetscCall(MatMatMult(r->varying.K_f, r->V, MAT_REUSE_MATRIX, PETSC_DETERMINE, &r->KV));
  else {
    PetscCall(MatMatMult(r->varying.K_f, r->V, MAT_INITIAL_MATRIX, PETSC_DETERMINE, &r->KV));
    PetscCall(CreateRowMajor(m->model->l, m->model->n_fe, g->model->G, &r->G));
    /* Into Kr itself, without a temporary of its size. */
    PetscCall(MatProductCreateWithMat(r->KV, r->G, NULL, g->Kr));
    PetscCall(MatProductSetType(g->Kr, MATPRODUCT_AB));
    PetscCall(MatProductSetFromOptions(g->Kr));
    PetscCall(MatProductSymbolic(g->Kr));
  }
  PetscCall(MatProductNumeric(g->Kr));
  /* K[A,A] is the part of the unknowns themselves. */
  PetscCall(MatAXPY(g->Kr, 1, r->varying.F, SUBSET_NONZERO_PATTERN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first call makes all matrices and products, later ones reuse their patterns: K's must not change. */
PetscErrorCode HycoReducedFillStiffness(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r;

  PetscFunctionBegin;
  PetscCall(HycoReducedPrepare(m));
  r = g->reduced;
  if (!r->filled) PetscCall(ReducedSystemStart(m));
  PetscCall(ReducedSystemMultiply(m, r->filled ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &r->varying));
  /* Otherwise row by row, since Kr may be sparse. */
  if (r->all_full)
    PetscCall(PutAll(m));
  else {
    PetscCall(PutFull(m, &r->varying));
    PetscCall(PutModes(m));
  }
  r->filled = PETSC_TRUE;
  PetscCall(HycoMatAssemble(g->Kr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the array of values itself, by which a table of the stiffness is written and read. */
PetscErrorCode HycoReducedEntries(HycoROM m, PetscInt *n, PetscScalar *a[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
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
  /* The array stays where it is; the caller reads or writes it before the next assembly. */
  PetscCall(MatSeqAIJRestoreArray(g->Kr, &all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row of each entry in the array of HycoReducedEntries(). */
PetscErrorCode HycoReducedRows(HycoROM m, PetscInt row[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt *start, *columns;
  PetscInt n;
  PetscBool dense, done;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)g->Kr, MATSEQDENSE, &dense));
  if (dense) {
    /* PETSc's dense matrix lies by columns. */
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

/* -- the contacts -- */

/* A product, or its transpose, as a matrix of the system. B^T is kept as a matrix of its own: the solver multiplies by
   both, and rows are contiguous in each. */
static PetscErrorCode PutProduct(Mat product, PetscBool transposed, Mat to)
{
  PetscInt rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(product, &rows, NULL));
  /* Entries that have left the product keep their place in the pattern, with 0. */
  PetscCall(MatZeroEntries(to));
  for (PetscInt k = 0; k < rows; k++) {
    const PetscInt *column;
    const PetscScalar *value;
    PetscInt n;

    PetscCall(MatGetRow(product, k, &n, &column, &value));
    if (transposed)
      PetscCall(MatSetValues(to, n, column, 1, &k, value, INSERT_VALUES));
    else
      PetscCall(MatSetValues(to, 1, &k, n, column, value, INSERT_VALUES));
    PetscCall(MatRestoreRow(product, k, &n, &column, &value));
  }
  PetscCall(HycoMatAssemble(to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B[A_lambda, set] P[set, :], made again if B's pattern has grown, and P if the set has. */
static PetscErrorCode MultiplyContact(HycoROM m, IS set, PetscBool grown, ContactProduct *c)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt n, n_P = -1;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(set, &n));
  if (c->P) PetscCall(MatGetSize(c->P, &n_P, NULL));
  /* MAT_REUSE_MATRIX requires the patterns of the first call. */
  if (grown) {
    HycoDestroyAll(&c->BP, &c->B);
  }
  /* P has a row for each unknown of the set, which grows with B. */
  if (n != n_P) {
    PetscCall(MatDestroy(&c->P));
    PetscCall(CreateP(m, set, g->reduced->all_full, &c->P));
  }
  PetscCall(MatCreateSubMatrix(g->B, g->sets.is_rows, set, grown ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, &c->B));
  PetscCall(MatMatMult(c->B, c->P, grown ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, PETSC_DETERMINE, &c->BP));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Br = B[A_lambda, A'_c] P[A'_c, :] and Btr = P[A_c, :]^T B[A_lambda, A_c]^T, from one product if A_c is A'_c. */
PetscErrorCode HycoReducedFillContact(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r;
  PetscInt n_Ac, n_all;
  PetscObjectState pattern;
  PetscBool grown;

  PetscFunctionBegin;
  /* Force vectors instead of multipliers: the type has its own products (44). */
  if (g->model->contact) {
    PetscCall(g->model->contact(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoReducedPrepare(m));
  PetscCall(HycoGalerkinContactMatrix(m));
  r = g->reduced;
  PetscCall(MatGetNonzeroState(g->B, &pattern));
  grown = (PetscBool)(!r->all_c.BP || pattern != r->pattern);
  r->pattern = pattern;
  PetscCall(MultiplyContact(m, g->sets.is_Ac_all, grown, &r->all_c));
  PetscCall(PutProduct(r->all_c.BP, PETSC_FALSE, g->Br));
  PetscCall(ISGetLocalSize(g->sets.is_Ac, &n_Ac));
  PetscCall(ISGetLocalSize(g->sets.is_Ac_all, &n_all));
  /* With obstacles and pairs A_c is A'_c: one product serves both (Property 1 of the paper). */
  if (n_Ac < n_all) PetscCall(MultiplyContact(m, g->sets.is_Ac, (PetscBool)(grown || !r->Ac.BP), &r->Ac));
  PetscCall(PutProduct(n_Ac < n_all ? r->Ac.BP : r->all_c.BP, PETSC_TRUE, g->Btr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of fixed unknowns are zero in V_A: F may have reactions there. */
PetscErrorCode HycoReducedTest(HycoROM m, const PetscScalar F[], Vec Fr)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoReduced r = g->reduced;
  PetscScalar *f;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(Fr, &f));
  if (g->n_free && !g->bordered) {
    /* The caller's arrays in place of copies; they are reset in the opposite order. */
    PetscCall(VecPlaceArray(r->u, F));
    PetscCall(VecPlaceArray(r->gamma, f));
    PetscCall(MatMultTranspose(r->V_A, r->u, r->gamma));
    PetscCall(VecResetArray(r->gamma));
    PetscCall(VecResetArray(r->u));
  } else
    PetscCall(PetscArrayzero(f, g->n_free));
  for (PetscInt k = 0; k < m->model->n_fe; k++) f[g->n_free + k] = F[m->model->fe_dof[k]];
  PetscCall(VecRestoreArrayWrite(Fr, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vbar[A,:]^T F[A] and D[A_lambda]. The right-hand sides of the reduced system; D is taken at the contacts of A_lambda
   only. */
PetscErrorCode HycoReducedFillVectors(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscScalar *F;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(g->F, &F));
  PetscCall(HycoReducedTest(m, F, g->Fr));
  PetscCall(VecRestoreArrayRead(g->F, &F));
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  /* V_lambda^T D in place of D. */
  if (g->model->gap) {
    PetscCall(g->model->gap(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArray(g->Dr, &d));
  for (PetscInt k = 0; k < m->n_L; k++) d[k] = g->own_rows.gap[k];
  PetscCall(VecRestoreArray(g->Dr, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
