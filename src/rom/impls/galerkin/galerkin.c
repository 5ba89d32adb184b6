/*
  The online phase: the hybrid system (38) is assembled on the RID only and solved.

    x = (gamma, U_fe): POD coefficients and full-order unknowns. With the modes zeroed on the full-order unknowns,

    U[A u I] = Vp gamma + E x_fe      test space: the same restricted to A      (39)-(40)

  (hybrid all: every unknown of A is full order and gamma = G U[A] is not an unknown; in a large model of paths it is
  one, with these as equations, and the matrix is sparse.) reduced_system.c fills the system.
*/
#include <hycoalgorithms.h>
#include <hycotable.h>
#include <petscblaslapack.h>

/* With more unknowns the reduced matrix is stored sparse (with a dense border of l modes). */
#define HYCO_DENSE_MAX 700
/* For a path with all of A full order, because its iterations multiply by the matrix many times. */
#define BORDERED_MIN 300

/* G minimises the weighted misfit of the modes on A's unknowns plus ridge times the square of the coefficients (Hoerl
   and Kennard 1970), by the normal equations, which are small. */
PetscErrorCode HycoGalerkinSetRidge(HycoROM m, PetscReal ridge)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  const PetscInt l = m->model->l, n = m->model->n_fe;
  PetscReal *X, *N, *weight;
  PetscBLASInt lb, nb, info;

  PetscFunctionBegin;
  PetscCall(HycoROMReset(m));
  PetscCall(PetscFree(g->G));
  g->ridge = ridge;
  PetscCall(
      PetscMalloc1(l * n, &g->G)); /* row major l x n is column major n x l: solve N Z = X^T, l x n column major */
  PetscCall(PetscMalloc3(l * n, &X, l * l, &N, l, &weight));
  /* Modes with small singular values are penalised more: they are less certain. */
  for (PetscInt j = 0; j < l; j++) weight[j] = ridge > 0 ? m->model->sigma[j] / m->model->sigma[0] : 1;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = 0; j < l; j++) X[k * l + j] = m->model->V[m->model->fe_dof[k] * l + j] * weight[j];
  }
  for (PetscInt i = 0; i < l; i++) {
    for (PetscInt j = 0; j < l; j++) {
      N[j * l + i] = i == j ? ridge : 0;
      for (PetscInt k = 0; k < n; k++) N[j * l + i] += X[k * l + i] * X[k * l + j];
    }
  }
  PetscCall(PetscBLASIntCast(l, &lb));
  PetscCall(PetscBLASIntCast(n, &nb));
  LAPACKpotrf_("U", &lb, N, &lb, &info);
  if (!info) LAPACKpotrs_("U", &lb, &nb, N, &lb, X, &lb, &info);
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = 0; j < l; j++) g->G[j * n + k] = info ? 0 : X[k * l + j] * weight[j];
  }
  PetscCall(PetscFree3(X, N, weight));
  /* Last: the work arrays are freed before, also if the normal equations are singular. */
  HycoCheckModel(!info || ridge > 0,
                 "-hyco_hybrid_ridge 0: the %d modes are not linearly independent on the %d unknowns of A; use -1",
                 (int)l, (int)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of unknowns. Bordered: gamma is kept as an unknown, so that Kr = K[A,A] with a border stays sparse
   instead of K[A,A] + (K V) G. */
static PetscErrorCode CountUnknowns(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt l = m->model->l;

  PetscFunctionBegin;
  /* Below BORDERED_MIN a dense matrix is faster than the sparse border; without a history the product (K V) G is done
     once per stiffness and pays off. */
  g->bordered = (PetscBool)(g->model->G && m->model->scene->n_times && l + m->model->n_fe > BORDERED_MIN);
  g->n_free = m->model->hybrid == HYCO_HYBRID_ALL && !g->bordered ? 0 : l;
  /* The modes' coefficients first, then the full-order displacements, in the order of fe_dof. */
  m->n = g->n_free + m->model->n_fe;
  if (!g->model->contact && !g->friction) m->n_L = m->m; /* otherwise set by the type, or the rows' number */
  HycoCheckModel(m->n > 0, "the model has no unknowns, because every training solution is zero; check the loads");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Dense up to the size where LAPACK's factor is faster than a sparse one. */
static PetscErrorCode CreateReduced(PetscInt rows, PetscInt cols, PetscBool dense, PetscInt per_row, Mat *A)
{
  PetscFunctionBegin;
  if (dense)
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, rows, cols, NULL, A));
  else {
    PetscCall(MatCreate(PETSC_COMM_SELF, A));
    PetscCall(MatSetSizes(*A, rows, cols, rows, cols));
    PetscCall(MatSetType(*A, MATSEQAIJ));
    PetscCall(MatSeqAIJSetPreallocation(*A, per_row, NULL));
    /* Rows of modes and of displacements differ in length: Preallocate() gives the exact room later. */
    PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything whose size does not depend on parameters; the first GalerkinAssemble() makes the matrices' patterns. */
PetscErrorCode HycoGalerkinSetUp(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscBool dense;

  PetscFunctionBegin;
  g->model = (HycoGalerkinModel)m->model->data;
  PetscCall(HycoGalerkinCreateOwn(m));
  PetscCall(HycoFECreate(m->model->scene, g->own->dm, &m->fe));
  PetscCall(CountUnknowns(m));
  dense = (PetscBool)((m->n <= HYCO_DENSE_MAX && !g->bordered) || (g->model->symmetric && !m->model->n_fe) ||
                      (g->model->G && !g->bordered));
  /* With a table K is never assembled. */
  if (!g->model->table) PetscCall(HycoFECreateMatrix(m->fe, PETSC_COMM_SELF, g->own->n_nodes, 0, &g->K));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->fe->n_dof, &g->F));
  PetscCall(g->model->table && !dense ? HycoTableCreateSparse(m) : CreateReduced(m->n, m->n, dense, 0, &g->Kr));
  PetscCall(MatCreateVecs(g->Kr, &g->x, &g->Fr));
  if (!dense && !m->model->scene->n_times) PetscCall(HycoLoadsCreate(m));
  /* Without contact forces in the RID the problem is one linear solve. */
  if (m->n_L) {
    PetscCall(CreateReduced(m->n_L, m->n, dense, g->n_free + 15, &g->Br));
    PetscCall(CreateReduced(m->n, m->n_L, dense, g->n_free + 15, &g->Btr));
    PetscCall(MatCreateVecs(g->Br, NULL, &g->L));
    PetscCall(VecDuplicate(g->L, &g->Dr));
  }
  PetscCall(HycoROMSetUpFields(m));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &g->system));
  /* the reduced problem is not symmetric and may have several solutions: the dual form, without warm start; a TAO
     type that needs symmetry is only for the full order */
  PetscCall(HycoSolverSetForm(m->solver, HYCO_FORM_DUAL));
  PetscCall(HycoSolverSetWarmStart(m->solver, PETSC_FALSE));
  if (HycoSolverNeedsSymmetry(m->solver)) PetscCall(HycoSolverSetType(m->solver, HYCO_SOLVER_ACTIVE_SET));
  if (m->model->scene->n_times) PetscCall(HycoGalerkinPathCreate(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The current rows of B belong to the matrix that goes: current_B must not survive it. */
PetscErrorCode HycoGalerkinReset(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  PetscCall(HycoReducedDestroy(&g->reduced));
  PetscCall(HycoLoadsDestroy(&g->loads));
  PetscCall(HycoGalerkinPathDestroy(&g->path));
  HycoDestroyAll(&g->system, &g->K, &g->B);
  g->current_B = PETSC_FALSE;
  HycoDestroyAll(&g->Kr, &g->Br, &g->Btr, &g->F, &g->D, &g->Fr, &g->Dr, &g->x, &g->L);
  PetscCall(HycoGalerkinDestroyOwn(g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinDestroy(HycoGalerkinModel g)
{
  PetscFunctionBegin;
  PetscCall(HycoTableDestroy(&g->table));
  PetscCall(PetscFree(g->G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only what the new parameters change; `ready` is false meanwhile, so that an error leaves nothing that looks valid. */
static PetscErrorCode GalerkinAssemble(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscBool first = PETSC_FALSE;

  PetscFunctionBegin;
  m->beyond_current = PETSC_FALSE;
  first = (PetscBool)!g->system->K;
  PetscCall(HycoFESetParameters(m->fe, mu));
  PetscCall(HycoGalerkinCreateSets(m));
  m->fe->ready = PETSC_FALSE; /* until everything that depends on it is assembled */
  /* Before anything can fail: solutions of another stiffness must not be used. */
  if (m->fe->stiffness_changed) HycoLoadsForget(g->loads);
  if (m->fe->stiffness_changed && g->model->table) {
    PetscCall(HycoReducedPrepare(m));
    HycoLogged(HYCO_EVENT_REDUCE, HycoTableFill(m, mu));
  } else if (m->fe->stiffness_changed) {
    HycoLogged(HYCO_EVENT_ASSEMBLE, HycoFEAssembleStiffness(m->fe, g->K));
    if (first && m->fe->n_constant) /* assembled again as in later assemblies, so that the sums have the same bits */
      HycoLogged(HYCO_EVENT_ASSEMBLE, HycoFEAssembleStiffness(m->fe, g->K));
    HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillStiffness(m));
  }
  HycoLogged(HYCO_EVENT_FORCE, HycoFEAssembleForce(m->fe, g->F));
  if (m->fe->contact_changed) g->current_B = PETSC_FALSE;
  if (m->fe->contact_changed || m->fe->gap_changed) HycoLogged(HYCO_EVENT_CONTACT, HycoGalerkinOwnRows(m));
  if (m->n_L && m->fe->contact_changed) HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillContact(m));
  HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillVectors(m));
  m->fe->ready = PETSC_TRUE;
  if (first) {
    PetscCall(HycoSystemSetMatrices(g->system, g->Kr, g->Btr, g->Br, g->model->symmetric));
    PetscCall(HycoSystemSetVectors(g->system, g->Fr, g->Dr));
    PetscCall(HycoSolverSetSystem(m->solver, g->system));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced system at mu without its solution, for the scan of the determinant. Results of the last prediction
   are void afterwards. */
PetscErrorCode HycoGalerkinAssemble(HycoROM m, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMSetUp(m));
  m->solved = m->whole_current = PETSC_FALSE;
  PetscCall(GalerkinAssemble(m, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets gamma, and U on the nodes of fe's mesh. U = u0 + V gamma, and the full-order unknowns as solved: the modes there
   are only their continuation. */
PetscErrorCode HycoGalerkinExpand(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscScalar *x;
  const PetscReal one = 1;
  PetscBLASInt l, n_dof, inc = 1;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(g->x, &x));
  for (PetscInt j = 0; j < m->model->l; j++) {
    /* With G (hybrid all) gamma follows from U[A], also where it is an unknown beside it. */
    m->gamma[j] = g->n_free && !g->model->G ? x[j] : 0;
    for (PetscInt f = 0; g->model->G && f < m->model->n_fe; f++)
      m->gamma[j] += g->model->G[j * m->model->n_fe + f] * x[g->n_free + f];
  }
  PetscCall(PetscArraycpy(m->U, m->fe->u0, m->fe->n_dof));
  PetscCall(PetscBLASIntCast(m->model->l, &l));
  PetscCall(PetscBLASIntCast(m->fe->n_dof, &n_dof));
  if (l) BLASgemv_("T", &l, &n_dof, &one, m->model->V, &l, m->gamma, &inc, &one, m->U, &inc);
  for (PetscInt f = 0; f < m->model->n_fe; f++) m->U[m->model->fe_dof[f]] = x[g->n_free + f];
  HycoFEComplete(m->fe, m->U);
  PetscCall(VecRestoreArrayRead(g->x, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets gamma, U on the nodes of mesh, Lambda on A_lambda. */
PetscErrorCode HycoGalerkinUnpack(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinExpand(m));
  /* Force vectors reach contacts outside A_lambda: the next solution must not keep their forces there. */
  if (m->spread) PetscCall(PetscArrayzero(m->Lambda, m->model->pairs.n));
  m->spread = PETSC_FALSE;
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  /* Force vectors: Lambda is their combination. */
  if (g->model->expand) {
    PetscCall(g->model->expand(m));
    m->spread = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArrayRead(g->L, &L));
  for (PetscInt k = 0; k < m->m; k++) m->Lambda[m->contact[k]] = L[HycoGalerkinFirstRow(g, k)];
  PetscCall(VecRestoreArrayRead(g->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Seconds are measured by part: training compares settings by them. */
PetscErrorCode HycoGalerkinSolve(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoPrediction *p = &m->prediction;
  const char *method;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  if (g->path) {
    PetscCall(HycoGalerkinPathSolve(m, mu));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(GalerkinAssemble(m, mu));
  p->seconds.assemble = HycoNow() - begin;
  /* Before the solve: the solution without contact comes from the table of loads, if it is affine in them. */
  HycoLogged(HYCO_EVENT_SOLVE, HycoLoadsSetFree(m, mu));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(m->solver, g->x, g->L));
  PetscCall(HycoSolverGetSeconds(m->solver, &p->seconds.factor, &p->seconds.solve));
  PetscCall(HycoSolverGetReason(m->solver, &p->reason));
  PetscCall(HycoSolverGetIterations(m->solver, &p->iterations));
  PetscCall(HycoSolverGetKKT(m->solver, &p->kkt));
  PetscCall(HycoSolverGetMethod(m->solver, &method));
  PetscCall(PetscStrncpy(p->method, method, sizeof(p->method)));
  PetscCall(HycoGalerkinUnpack(m));
  PetscCall(HycoGalerkinCheckContactBasis(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Infinite, as the largest number, for a singular matrix. */
PetscErrorCode HycoGalerkinCondition(HycoROM m, PetscReal *condition)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  Mat dense;
  PetscScalar *a;
  PetscReal smallest, largest;

  PetscFunctionBegin;
  *condition = 0;
  if (m->n > 2500) PetscFunctionReturn(PETSC_SUCCESS); /* an SVD would take minutes */
  /* Densely: the reduced matrix is small, and nonsymmetric, so that no iterative estimate would be safe. */
  PetscCall(MatConvert(g->Kr, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(MatDenseGetArray(dense, &a));
  PetscCall(HycoExtremeSingularValues(m->n, m->n, a, &smallest, &largest));
  PetscCall(MatDenseRestoreArray(dense, &a));
  PetscCall(MatDestroy(&dense));
  *condition = smallest > 0 ? largest / smallest : PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u^T K u / 2 over the free unknowns, and the same without K's couplings, to which round-off is relative. */
static PetscErrorCode QuadraticForm(HycoROM m, PetscReal *energy, PetscReal *size)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt *ia, *ja;
  const PetscScalar *a;
  PetscInt n;
  PetscBool done;

  PetscFunctionBegin;
  *energy = *size = 0;
  PetscCall(MatGetRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(MatSeqAIJGetArrayRead(g->K, &a));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal sum = 0;

    /* Most unknowns outside the RID are exactly 0, and their rows of K are empty. */
    if (m->U[i] == 0) continue;
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++) {
      sum += a[k] * m->U[ja[k]];
      /* The diagonal alone: what the displacements would store node by node, the size of the terms that cancel. */
      if (ja[k] == i) *size += a[k] * m->U[i] * m->U[i] / 2;
    }
    *energy += m->U[i] * sum / 2;
  }
  PetscCall(MatSeqAIJRestoreArrayRead(g->K, &a));
  PetscCall(MatRestoreRowIJ(g->K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The energy of the RID's cells: from K, unless the supports' part is missing or a rigid motion dominates: above a
   ratio of 1e5 fewer than ten digits would be accurate. */
PetscErrorCode HycoGalerkinEnergy(HycoROM m, PetscReal *energy, PetscBool *known)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscReal size = 0;

  PetscFunctionBegin;
  *known = PETSC_FALSE;
  if (!g->K || g->model->table || m->fe->lifted || m->fe->n_oblique || m->fe->mesh->n_tied)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(QuadraticForm(m, energy, &size));
  *known = (PetscBool)(*energy >= 1e-5 * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed objects, at the last solve's parameters; D has all contacts; those outside A_lambda are not set, as B's
   rows there are empty. */
PetscErrorCode HycoGalerkinLocal(HycoROM m, HycoLocal *local)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscScalar *gap;

  PetscFunctionBegin;
  if (m->m) PetscCall(HycoGalerkinContactMatrix(m));
  if (m->m && !g->D) PetscCall(MatCreateVecs(g->B, NULL, &g->D));
  if (m->m) {
    /* Rows of the RID's contacts; own_rows is in their order. */
    PetscCall(VecGetArrayWrite(g->D, &gap));
    for (PetscInt k = 0; k < m->m; k++) gap[m->contact[k]] = g->own_rows.gap[k];
    PetscCall(VecRestoreArrayWrite(g->D, &gap));
  }
  *local = (HycoLocal){g->K, g->B, g->F, g->D, g->sets.is_A, g->sets.is_I, g->sets.is_A_lambda};
  PetscFunctionReturn(PETSC_SUCCESS);
}
