/*
  The contact system of bodies: the compliance W = sum_b B_b C_b B_b^T of the contacts, known by the blocks that a
  solver asks for and by products, and the rigid motions x = free unknowns, B = B Z, F the loads' work on them, D the
  gaps without contact forces.
*/
#include <hycobodies.h>

/* The column of an unknown of body k in its flexibility, without kappa; made when it is needed for the first time. */
static PetscErrorCode ComplianceColumn(HycoBodiesWork o, PetscInt k, PetscInt unknown, const PetscReal **column)
{
  const HycoSubstructure *own = &o->bodies->body[k];
  const size_t n = (size_t)own->n, at = (size_t)unknown * n;
  PetscBool *there = &o->blended[o->bodies->start[k] + unknown];

  PetscFunctionBegin;
  *column = own->C.wide + at;
  if (own->n_samples == 1) PetscFunctionReturn(PETSC_SUCCESS);
  /* All n x n at first use, each column filled only on demand: most columns belong to unknowns that no closed
     contact reads. */
  if (!o->blend[k]) PetscCall(PetscMalloc1(n * n, &o->blend[k]));
  if (!*there) {
    HycoFlexibilityColumn(&own->C, o->share[k], unknown, o->blend[k] + at);
    *there = PETSC_TRUE;
  }
  *column = o->blend[k] + at;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* o->response of a contact: C row^T of each body that its row touches, without kappa. Made once at the present
   parameters: further problems, and the displacements, take it from there. */
static PetscErrorCode ComplianceRespond(HycoBodiesWork o, PetscInt contact)
{
  const HycoSubstructures b = o->bodies;
  PetscReal **response = o->response + contact * b->n;

  PetscFunctionBegin;
  if (o->responded[contact]) PetscFunctionReturn(PETSC_SUCCESS);
  o->responded[contact] = PETSC_TRUE;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt lo = b->start[k], hi = b->start[k + 1];
    PetscBool touched = PETSC_FALSE;

    for (PetscInt e = o->row_start[contact]; e < o->row_start[contact + 1]; e++) {
      const PetscReal *column;

      if (o->row_at[e] < lo || o->row_at[e] >= hi) continue;
      if (!response[k]) PetscCall(PetscMalloc1(hi - lo, &response[k]));
      PetscCall(ComplianceColumn(o, k, o->row_at[e] - lo, &column));
      for (PetscInt i = 0; i < hi - lo && !touched; i++) response[k][i] = o->row[e] * column[i];
      if (touched) HycoBodiesAdd(hi - lo, o->row[e], column, response[k]);
      touched = PETSC_TRUE;
    }
    /* At other parameters it touched this body. */
    if (!touched) PetscCall(PetscFree(response[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row[j] = W of the first of n contacts with them. */
static PetscErrorCode FillRow(HycoBodiesWork o, PetscInt n, const PetscInt contact[], PetscReal row[])
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  if (o->kept.same) {
    HycoBodiesRowCacheGet(o, contact[0], n, contact, row);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArrayzero(row, n));
  PetscCall(ComplianceRespond(o, contact[0]));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal *y = o->response[contact[0] * b->n + k], scale = 1 / o->kappa[k];
    const PetscInt lo = b->start[k], hi = b->start[k + 1];

    for (PetscInt j = 0; y && j < n; j++) {
      PetscReal sum = 0;

      for (PetscInt e = o->row_start[contact[j]]; e < o->row_start[contact[j] + 1]; e++) {
        if (o->row_at[e] >= lo && o->row_at[e] < hi) sum += o->row[e] * y[o->row_at[e] - lo];
      }
      row[j] += scale * sum;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HYCO_COMPLIANCE_BLOCK. Row k from the diagonal on; W is symmetric, and copying keeps it so to the last digit. */
static PetscErrorCode ComplianceFill(Mat W, PetscInt n, const PetscInt contact[], PetscInt lda, PetscScalar block[])
{
  HycoBodiesWork o;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(W, &o));
  /* May turn kept.same off (memory). */
  PetscCall(HycoBodiesKeep(o, n, contact));
  for (PetscInt k = 0; k < n; k++) {
    PetscScalar *row = block + (size_t)k * (size_t)lda;

    PetscCall(FillRow(o, n - k, contact + k, row + k));
    for (PetscInt j = k; j < n; j++) block[(size_t)j * (size_t)lda + (size_t)k] = row[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of contacts with a force are there: those of the blocks, or by HycoBodiesKeep(). */
PetscErrorCode HycoBodiesBend(HycoBodiesWork o, const PetscReal Lambda[])
{
  const HycoSubstructures b = o->bodies;
  const PetscInt m = o->n_contacts;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscArraycmp(o->bent_by, Lambda, m, &same));
  if (same && o->is_bent) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(o->bent_by, Lambda, m));
  o->is_bent = PETSC_TRUE;
  PetscCall(PetscArrayzero(o->bent, b->ns));
  /* Kept products P = C B^T, or those at the present parameters. */
  if (o->kept.same) PetscCall(HycoBodiesRowCacheDisplace(o, m, Lambda, o->bent));
  for (PetscInt k = 0; k < m && !o->kept.same; k++) {
    if (Lambda[k] == 0) continue;
    PetscCall(ComplianceRespond(o, k));
    for (PetscInt j = 0; j < b->n; j++) {
      const PetscReal *y = o->response[k * b->n + j];

      if (y) HycoBodiesAdd(b->body[j].n, -Lambda[k] / o->kappa[j], y, o->bent + b->start[j]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = W L: MatMult(). */
static PetscErrorCode ComplianceMult(Mat W, Vec L, Vec w)
{
  HycoBodiesWork o;
  const PetscScalar *l;
  PetscScalar *y;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(W, &o));
  PetscCall(VecGetArrayRead(L, &l));
  PetscCall(HycoBodiesBend(o, l));
  PetscCall(VecRestoreArrayRead(L, &l));
  PetscCall(VecGetArrayWrite(w, &y));
  for (PetscInt k = 0; k < o->n_contacts; k++) {
    y[k] = 0;
    for (PetscInt j = o->row_start[k]; j < o->row_start[k + 1]; j++) y[k] -= o->row[j] * o->bent[o->row_at[j]];
  }
  PetscCall(VecRestoreArrayWrite(w, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HYCO_COMPLIANCE_TERMS. Displacements along the surfaces too: where all contacts close without a gap, the others are
   round-off. free and the response to the forces may be huge and opposite, as their sum u is small. */
static PetscErrorCode ComplianceSizes(Mat W, Vec x, PetscReal *size, const PetscReal *terms[])
{
  HycoBodiesWork o;
  PetscReal most = 0;
  const PetscScalar *motion = NULL;
  PetscInt p;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(W, &o));
  p = o->bodies->p;
  if (p) PetscCall(VecGetArrayRead(x, &motion));
  for (PetscInt i = 0; i < o->bodies->ns; i++) {
    o->response_u[i] = o->bent[i];
    for (PetscInt j = 0; j < p; j++) o->response_u[i] += o->Z[i * p + j] * motion[j];
    most = PetscMax(most, PetscAbsReal(o->free[i] + o->response_u[i]));
  }
  if (p) PetscCall(VecRestoreArrayRead(x, &motion));
  for (PetscInt k = 0; k < o->n_contacts; k++) {
    PetscReal gap = o->gap[k], moved = 0;

    o->terms[k] = 0;
    if (o->row_start[k] == o->row_start[k + 1]) continue;
    for (PetscInt j = o->row_start[k]; j < o->row_start[k + 1]; j++) {
      const PetscReal row = o->row[j], free = o->free[o->row_at[j]], more = o->response_u[o->row_at[j]];

      gap += row * free;
      moved += PetscAbsReal(row * (free + more));
      o->terms[k] += PetscAbsReal(row) * (PetscAbsReal(free) + PetscAbsReal(more));
    }
    most = PetscMax(most, PetscMax(PetscAbsReal(gap), moved));
  }
  *size = most;
  *terms = o->terms;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesCreateSystem(HycoBodiesWork o)
{
  const PetscInt m = o->n_contacts, p = o->bodies->p;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(o->bodies->ns + 1, &o->bent));
  PetscCall(PetscCalloc1(o->bodies->ns + 1, &o->response_u));
  PetscCall(PetscCalloc1(m + 1, &o->bent_by));
  PetscCall(PetscCalloc1(m + 1, &o->terms));
  PetscCall(MatCreateShell(PETSC_COMM_SELF, m, m, m, m, o, &o->W));
  PetscCall(MatShellSetOperation(o->W, MATOP_MULT, (void (*)(void))ComplianceMult));
  PetscCall(PetscObjectComposeFunction((PetscObject)o->W, HYCO_COMPLIANCE_BLOCK, ComplianceFill));
  PetscCall(PetscObjectComposeFunction((PetscObject)o->W, HYCO_COMPLIANCE_TERMS, ComplianceSizes));
  PetscCall(MatSetUp(o->W));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m, &o->D));
  PetscCall(VecDuplicate(o->D, &o->L));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &o->system));
  if (!p) {
    PetscCall(HycoSystemSetFlexibility(o->system, o->W, o->D));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, p, &o->F));
  PetscCall(VecDuplicate(o->F, &o->motion));
  PetscCall(PetscCalloc1((size_t)m * (size_t)p + 1, &o->rows_B));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, p, o->rows_B, &o->B));
  PetscCall(HycoMatAssemble(o->B));
  PetscCall(HycoSystemSetMatrices(o->system, NULL, NULL, o->B, PETSC_TRUE));
  PetscCall(HycoSystemSetCompliance(o->system, o->W));
  PetscCall(HycoSystemSetVectors(o->system, o->F, o->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesDestroySystem(HycoBodiesWork o)
{
  PetscFunctionBegin;
  HycoDestroyAll(&o->system, &o->W, &o->B, &o->D, &o->F, &o->motion, &o->L);
  HycoFreeAll(&o->rows_B, &o->bent, &o->bent_by, &o->response_u, &o->terms);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesAddCompliance(HycoBodiesWork o, const PetscReal f[], PetscReal to[])
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    const HycoSubstructure *own = &b->body[k];
    PetscReal *u = to + b->start[k];

    for (PetscInt j = 0; j < own->n; j++) {
      const PetscReal force = f[b->start[k] + j] / o->kappa[k];

      const PetscReal *column;

      if (force == 0) continue;
      PetscCall(ComplianceColumn(o, k, j, &column));
      HycoBodiesAdd(own->n, -force, column, u);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoBodiesMotionRow(HycoBodiesWork o, PetscInt k, PetscReal g[])
{
  const PetscInt p = o->bodies->p;

  for (PetscInt i = 0; i < p; i++) g[i] = 0;
  for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++)
    HycoBodiesAdd(p, o->row[e], o->Z + o->row_at[e] * p, g);
}

/* The rows of the motions at the prepared parameters. */
static PetscErrorCode UpdateMotions(HycoBodiesWork o)
{
  const PetscInt m = o->n_contacts, p = o->bodies->p;
  PetscReal *g;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p, &g));
  for (PetscInt k = 0; k < m; k++) {
    HycoBodiesMotionRow(o, k, g);
    for (PetscInt i = 0; i < p; i++) o->rows_B[(size_t)i * (size_t)m + (size_t)k] = g[i];
  }
  PetscCall(PetscObjectStateIncrease((PetscObject)o->B));
  PetscCall(PetscFree(g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesUpdateSystem(HycoBodiesWork o)
{
  const PetscInt m = o->n_contacts, p = o->bodies->p;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(UpdateMotions(o));
  PetscCall(PetscObjectStateIncrease((PetscObject)o->W));
  PetscCall(VecGetArrayWrite(o->D, &v));
  /* An empty row is a contact without a master at this mu. */
  for (PetscInt k = 0; k < m; k++) v[k] = o->row_start[k] < o->row_start[k + 1] ? o->gap[k] : PETSC_INFINITY;
  PetscCall(VecRestoreArrayWrite(o->D, &v));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayWrite(o->F, &v));
  for (PetscInt i = 0; i < p; i++) v[i] = HycoBodiesLoadWork(o, i);
  PetscCall(VecRestoreArrayWrite(o->F, &v));
  HycoSystemSetRounding(o->system, HycoBodiesLoadRounding(o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For derivatives and friction, which need the same matrix as the solve. */
PetscErrorCode HycoBodiesMatrix(HycoBodiesWork o, PetscInt n, const PetscInt contact[], PetscReal M[])
{
  PetscFunctionBegin;
  PetscCall(UpdateMotions(o));
  PetscCall(HycoSystemFill(o->system, n, contact, M, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
