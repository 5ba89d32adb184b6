/*
  The online phase: the hybrid system (38) assembled on the RID alone and solved.

  x = (gamma, U_fe): POD coefficients and full-order unknowns. With the modes zeroed on the full-order unknowns,

      U[A u I] = Vp gamma + E x_fe      test space: the same restricted to A      (39)-(40)

  (hybrid all: every unknown of A is full order and gamma = G U[A] is no unknown.) reduced.c fills the system.
*/
#include <hycoalgorithms.h>
#include <hycotable.h>
#include <petscblaslapack.h>

/* Beyond this many unknowns the reduced matrix is stored sparse (a dense border of l modes). */
#define HYCO_DENSE_MAX 700

PetscErrorCode HycoROMSetFE(HycoROM m, HycoHybrid hybrid, PetscInt n, const PetscInt dof[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMReset(m));
  PetscCall(PetscFree(m->fe_dof));
  PetscCall(PetscFree(m->G));
  HycoDuplicate(n, dof, &m->fe_dof);
  PetscCall(PetscSortInt(n, m->fe_dof));
  m->n_fe = n;
  m->hybrid = hybrid;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetRidge(HycoROM m, PetscReal ridge)
{
  const PetscInt l = m->l, n = m->n_fe;
  PetscReal *X, *N, *weight;
  PetscBLASInt lb, nb, info;

  PetscFunctionBegin;
  PetscCall(HycoROMReset(m));
  PetscCall(PetscFree(m->G));
  m->ridge = ridge;
  PetscCall(
      PetscMalloc1(l * n, &m->G)); /* row major l x n is column major n x l: solve N Z = X^T, l x n column major */
  PetscCall(PetscMalloc3(l * n, &X, l * l, &N, l, &weight));
  for (PetscInt j = 0; j < l; j++) weight[j] = ridge > 0 ? m->sigma[j] / m->sigma[0] : 1;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = 0; j < l; j++) X[k * l + j] = m->V[m->fe_dof[k] * l + j] * weight[j];
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
  HycoCheckModel(!info || ridge > 0,
                 "-hyco_hybrid_ridge 0: the %d modes are not independent on the %d unknowns of A; take -1", (int)l,
                 (int)n);
  if (!info) LAPACKpotrs_("U", &lb, &nb, N, &lb, X, &lb, &info);
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = 0; j < l; j++) m->G[j * n + k] = info ? 0 : X[k * l + j] * weight[j];
  }
  PetscCall(PetscFree3(X, N, weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places of the full-order unknowns, modes zeroed on them. */
static PetscErrorCode SetUpBasis(HycoROM m)
{
  const PetscInt n_dof = m->fe->n_dof, l = m->l;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_dof, &m->fe_at));
  HycoDuplicate(n_dof * l, m->V, &m->Vp);
  for (PetscInt k = 0; k < n_dof; k++) m->fe_at[k] = -1;
  for (PetscInt k = 0; k < m->n_fe; k++) {
    m->fe_at[m->fe_dof[k]] = k;
    PetscCall(PetscArrayzero(m->Vp + m->fe_dof[k] * l, l));
  }
  m->n_free = m->hybrid == HYCO_HYBRID_ALL ? 0 : l;
  m->n = m->n_free + m->n_fe;
  PetscCall(PetscMalloc1(m->pairs.n, &m->slave_id));
  for (PetscInt k = 0; k < m->pairs.n; k++) m->slave_id[k] = m->mesh->node_id[m->pairs.slave[k]];
  m->n_L = m->type == HYCO_ROM_PROJECTION ? m->l_lambda : m->m;
  HycoCheckModel(m->n > 0, "the model has no unknown: every training solution is zero");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateReduced(HycoROM m, PetscInt rows, PetscInt cols, PetscBool dense, Mat *A)
{
  PetscFunctionBegin;
  if (dense)
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, rows, cols, NULL, A));
  else {
    PetscCall(MatCreate(PETSC_COMM_SELF, A));
    PetscCall(MatSetSizes(*A, rows, cols, rows, cols));
    PetscCall(MatSetType(*A, MATSEQAIJ));
    PetscCall(MatSeqAIJSetPreallocation(*A, m->n_free + 15, NULL));
    PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMSetUp(HycoROM m)
{
  PetscBool dense, interface = PETSC_FALSE;

  PetscFunctionBegin;
  if (m->ready) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMReset(m)); /* what a refusal has left half made */
  if (m->type == HYCO_ROM_CONDENSED) {
    PetscCall(HycoCondensedSetUp(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoROMCreateOwn(m));
  PetscCall(HycoFECreate(m->scene, m->own, &m->fe));
  PetscCall(SetUpBasis(m));
  for (PetscInt i = 0; i < m->own->n_nodes; i++)
    interface = (PetscBool)(interface || m->role[i] == HYCO_ROLE_INTERFACE);
  dense = (PetscBool)(m->n <= HYCO_DENSE_MAX || m->type == HYCO_ROM_PROJECTION ||
                      (m->hybrid == HYCO_HYBRID_ALL && interface));
  if (!m->table) PetscCall(HycoFECreateMatrix(m->fe, PETSC_COMM_SELF, m->own->n_nodes, 0, &m->K));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->fe->n_dof, &m->F));
  if (dense)
    PetscCall(CreateReduced(m, m->n, m->n, PETSC_TRUE, &m->Kr));
  else
    PetscCall(m->table ? HycoTableCreateSparse(m) : HycoReducedCreateSparse(m));
  PetscCall(MatCreateVecs(m->Kr, &m->x, &m->Fr));
  if (!dense) PetscCall(HycoLoadsCreate(m));
  if (m->n_L) {
    PetscCall(CreateReduced(m, m->n_L, m->n, dense, &m->Br));
    PetscCall(CreateReduced(m, m->n, m->n_L, dense, &m->Btr));
    PetscCall(MatCreateVecs(m->Br, NULL, &m->L));
    PetscCall(VecDuplicate(m->L, &m->Dr));
  }
  PetscCall(PetscCalloc1(m->l, &m->gamma));
  PetscCall(PetscCalloc1(m->mesh->n_nodes * m->mesh->dim, &m->U));
  PetscCall(PetscCalloc1(m->pairs.n, &m->Lambda));
  PetscCall(PetscMalloc1(m->mesh->n_cells * m->fe->n_sigma, &m->stress));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &m->system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &m->solver));
  PetscCall(HycoSolverSetWarmStart(m->solver,
                                   PETSC_FALSE)); /* the nonsymmetric problem may have several solutions: no history */
  PetscCall(PetscObjectSetOptions((PetscObject)m->solver, m->scene->options));
  PetscCall(HycoSolverSetFromOptions(m->solver));
  /* the reduced problem is not symmetric and may have several solutions: the dual form, no history; a TAO type that
     needs symmetry is meant for the full order */
  PetscCall(HycoSolverSetForm(m->solver, HYCO_FORM_DUAL));
  PetscCall(HycoSolverSetWarmStart(m->solver, PETSC_FALSE));
  if (HycoSolverNeedsSymmetry(m->solver)) PetscCall(HycoSolverSetType(m->solver, HYCO_SOLVER_ACTIVE_SET));
  m->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Assemble(HycoROM m, const PetscReal mu[])
{
  PetscBool first = PETSC_FALSE;

  PetscFunctionBegin;
  m->beyond_current = PETSC_FALSE;
  first = (PetscBool)!m->system->K;
  PetscCall(HycoFESetParameters(m->fe, mu));
  m->fe->ready = PETSC_FALSE; /* until all that depends on it is assembled */
  if (m->fe->stiffness_changed) HycoLoadsForget(m->loads);
  if (m->fe->stiffness_changed && m->table) {
    PetscCall(HycoReducedPrepare(m));
    HycoLogged(HYCO_EVENT_REDUCE, HycoTableFill(m, mu));
  } else if (m->fe->stiffness_changed) {
    HycoLogged(HYCO_EVENT_ASSEMBLE, HycoFEAssembleStiffness(m->fe, m->K));
    if (first && m->fe->n_constant) /* again in the order of all that come: the same sums to the last bit */
      HycoLogged(HYCO_EVENT_ASSEMBLE, HycoFEAssembleStiffness(m->fe, m->K));
    HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillStiffness(m));
  }
  HycoLogged(HYCO_EVENT_FORCE, HycoFEAssembleForce(m->fe, m->F));
  if (m->fe->contact_changed || m->fe->gap_changed) HycoLogged(HYCO_EVENT_CONTACT, HycoROMOwnRows(m));
  if (m->n_L && m->fe->contact_changed) HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillContact(m));
  HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillVectors(m));
  m->fe->ready = PETSC_TRUE;
  if (first) {
    PetscCall(HycoSystemSetMatrices(m->system, m->Kr, m->Btr, m->Br, m->type == HYCO_ROM_PROJECTION));
    PetscCall(HycoSystemSetVectors(m->system, m->Fr, m->Dr));
    PetscCall(HycoSolverSetSystem(m->solver, m->system));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMAssemble(HycoROM m, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMSetUp(m));
  m->solved = m->whole_current = PETSC_FALSE;
  PetscCall(Assemble(m, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma, U on the nodes of mesh, Lambda on A_lambda. */
static PetscErrorCode Unpack(HycoROM m)
{
  const PetscScalar *x, *L;
  const PetscReal one = 1;
  PetscBLASInt l, n_dof, inc = 1;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(m->x, &x));
  for (PetscInt j = 0; j < m->l; j++) {
    m->gamma[j] = m->n_free ? x[j] : 0;
    for (PetscInt f = 0; m->G && f < m->n_fe; f++) m->gamma[j] += m->G[j * m->n_fe + f] * x[f];
  }
  PetscCall(PetscArraycpy(m->U, m->fe->u0, m->fe->n_dof));
  PetscCall(PetscBLASIntCast(m->l, &l));
  PetscCall(PetscBLASIntCast(m->fe->n_dof, &n_dof));
  if (l) BLASgemv_("T", &l, &n_dof, &one, m->Vp, &l, m->gamma, &inc, &one, m->U, &inc);
  for (PetscInt f = 0; f < m->n_fe; f++) m->U[m->fe_dof[f]] = x[m->n_free + f];
  PetscCall(VecRestoreArrayRead(m->x, &x));
  if (m->spread) PetscCall(PetscArrayzero(m->Lambda, m->pairs.n));
  m->spread = PETSC_FALSE;
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  if (m->type == HYCO_ROM_PROJECTION) {
    PetscCall(HycoProjectionExpand(m));
    m->spread = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArrayRead(m->L, &L));
  for (PetscInt k = 0; k < m->m; k++) m->Lambda[m->contact[k]] = L[k];
  PetscCall(VecRestoreArrayRead(m->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMPredict(HycoROM m, PetscInt n, const PetscReal mu[])
{
  HycoPrediction *p;
  const char *method;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  p = &m->prediction;
  PetscCall(HycoSceneCheckParameters(m->scene, n, mu));
  m->solved = m->whole_current = PETSC_FALSE;
  HycoLogged(HYCO_EVENT_SETUP, HycoROMSetUp(m));
  p->seconds.setup = HycoNow() - begin;
  if (m->type == HYCO_ROM_CONDENSED) {
    PetscCall(HycoCondensedPredict(m, mu));
    m->solved = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  begin = HycoNow();
  PetscCall(Assemble(m, mu));
  p->seconds.assemble = HycoNow() - begin;
  HycoLogged(HYCO_EVENT_SOLVE, HycoLoadsSetFree(m, mu));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(m->solver, m->x, m->L));
  PetscCall(HycoSolverGetSeconds(m->solver, &p->seconds.factor, &p->seconds.solve));
  PetscCall(HycoSolverGetReason(m->solver, &p->reason));
  PetscCall(HycoSolverGetIterations(m->solver, &p->iterations));
  PetscCall(HycoSolverGetKKT(m->solver, &p->kkt));
  PetscCall(HycoSolverGetMethod(m->solver, &method));
  PetscCall(PetscStrncpy(p->method, method, sizeof(p->method)));
  PetscCall(Unpack(m));
  PetscCall(HycoROMCheckForceless(m));
  if (m->reconstruct && p->reason > 0 && m->type == HYCO_ROM_HYBRID)
    HycoLogged(HYCO_EVENT_RECONSTRUCT, HycoROMReconstruct(m));
  p->seconds.total = HycoNow() - begin;
  m->solved = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCondition(HycoROM m, PetscReal *condition)
{
  Mat dense;
  PetscScalar *a;
  PetscReal smallest, largest;

  PetscFunctionBegin;
  *condition = 0;
  if (m->n > 2500 || m->condensed) PetscFunctionReturn(PETSC_SUCCESS); /* an SVD would take minutes */
  PetscCall(MatConvert(m->Kr, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(MatDenseGetArray(dense, &a));
  PetscCall(HycoExtremeSingularValues(m->n, m->n, a, &smallest, &largest));
  PetscCall(MatDenseRestoreArray(dense, &a));
  PetscCall(MatDestroy(&dense));
  *condition = smallest > 0 ? largest / smallest : PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
