/*
  Coulomb friction on the path of a hybrid model. In (38) each contact of A_lambda has its normal row and dim - 1
  tangents, with finite-element multipliers for all, so that the contacts of the RID obey the law of full order
  (fom/friction.c):

    r = P(r - rho w),     w = D - B[A_lambda, A'_c] V[A'_c] x     (HYCO_CONE_COULOMB),

  D of a tangent the displacement of the slave against the master along it at the last accepted time. Forces elsewhere
  follow from (41), which combines whole force vectors (hybrid/reconstruct.c), at each accepted time; slips are those
  of the displacements.
*/
#include <hycocoulomb.h>
#include <hycogalerkin.h>
#include <hycopath.h>

/* Of all contacts of the scene, on the model's mesh; those of A_lambda are the path's. */
struct _n_HycoGalerkinFriction {
  HycoContactState all;
  HycoRows rows;            /* with tangents */
  PetscReal *force, *slack; /* by row: of the last accepted time */
};

/* Once the contacts of A_lambda are known. */
PetscErrorCode HycoGalerkinFrictionCreate(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoGalerkinFriction f;

  PetscFunctionBegin;
  PetscCall(PetscNew(&g->friction));
  f = g->friction;
  PetscCall(HycoContactStateCreate(PETSC_COMM_SELF, m->model->scene, &m->pairs, m->model->mesh->dim, &f->all));
  m->n_L = HycoContactStateCountRows(m->model->scene, &g->own_pairs, m->model->mesh->dim);
  PetscCall(PetscCalloc2(f->all->row[m->pairs.n], &f->force, f->all->row[m->pairs.n], &f->slack));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. */
PetscErrorCode HycoGalerkinFrictionDestroy(HycoGalerkinFriction *friction)
{
  HycoGalerkinFriction f = *friction;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactStateDestroy(&f->all));
  PetscCall(HycoRowsDestroy(&f->rows));
  PetscCall(PetscFree2(f->force, f->slack));
  PetscCall(PetscFree(*friction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By number in A_lambda: a row is a contact without friction. */
PetscInt HycoGalerkinFirstRow(HycoGalerkin g, PetscInt k)
{
  return g->friction ? g->state->row[k] : k;
}

PetscInt HycoGalerkinContactOf(HycoGalerkin g, PetscInt row)
{
  PetscInt k = g->friction ? PetscMin(row, g->own_pairs.n - 1) : row; /* a contact has a row at least */

  while (HycoGalerkinFirstRow(g, k) > row) k--;
  return k;
}

/* NULL: none; rows are contacts then. */
const PetscInt *HycoGalerkinFrictionForces(HycoGalerkinFriction f, PetscReal **force)
{
  *force = f->force;
  return f->all->row;
}

/* The path starts from bodies at rest. */
PetscErrorCode HycoGalerkinFrictionBegin(HycoROM m)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;

  PetscFunctionBegin;
  m->friction = f->all;
  PetscCall(HycoContactStateBegin(f->all));
  PetscCall(PetscArrayzero(f->force, f->all->row[f->all->n]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an unknown of A is in row r, so that an equation of (38) has its force. */
static PetscErrorCode IsTested(HycoGalerkin g, PetscInt begin, PetscInt end, PetscBool *tested)
{
  PetscInt at;

  PetscFunctionBegin;
  *tested = PETSC_FALSE;
  for (PetscInt e = begin; e < end && !*tested; e++) {
    PetscCall(ISLocate(g->sets.is_A, g->own_rows.dof[e], &at));
    *tested = (PetscBool)(at >= 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of A_lambda at fe's parameters: B is constant along a path, gaps of tangents change with each step. A
   tangent that acts on no unknown of A (the slave held along it, its masters on the interface) is made empty, and
   carries no friction. Rows are packed in place, from the front. */
PetscErrorCode HycoGalerkinFrictionRows(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoContactState own = g->state;
  HycoRows *rows = &g->own_rows;
  PetscInt n = 0, begin = 0;

  PetscFunctionBegin;
  PetscCall(HycoContactStateRows(own, m->fe, rows));
  for (PetscInt k = 0; k < m->m; k++) {
    for (PetscInt r = own->row[k]; r < own->row[k + 1]; r++) {
      const PetscInt end = rows->start[r + 1];
      PetscBool tested = PETSC_TRUE;

      if (r > own->row[k]) PetscCall(IsTested(g, begin, end, &tested));
      for (PetscInt e = begin; e < end && tested; e++, n++) {
        rows->dof[n] = rows->dof[e];
        rows->value[n] = rows->value[e];
      }
      if (!tested) rows->gap[r] = 0;
      rows->start[r + 1] = n;
      begin = end;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multipliers by row of all contacts; forces elsewhere are zero. */
static PetscErrorCode TakeMultipliers(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoGalerkinFriction f = g->friction;
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f->force, f->all->row[f->all->n]));
  if (!m->n_L) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(g->L, &L));
  for (PetscInt k = 0; k < m->m; k++) {
    const PetscInt begin = HycoGalerkinFirstRow(g, k), end = HycoGalerkinFirstRow(g, k + 1);

    PetscCall(PetscArraycpy(f->force + f->all->row[m->contact[k]], L + begin, end - begin));
  }
  PetscCall(VecRestoreArrayRead(g->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies that contact alone holds: each contact's force is scaled as a whole, and stays in its cone. */
static PetscErrorCode GalerkinFrictionBalance(HycoROM m)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;

  PetscFunctionBegin;
  if (!m->model->floating) PetscFunctionReturn(PETSC_SUCCESS);
  HycoContactStateVectors(f->all, f->force);
  HycoTraceShowOther(m, &f->all->shear);
  PetscCall(HycoFloatingBalance(m));
  for (PetscInt k = 0; k < f->all->n; k++) {
    PetscReal *force = f->force + f->all->row[k];
    const PetscReal share = force[0] > 0 ? m->Lambda[k] / force[0] : 1;

    for (PetscInt r = 0; r < f->all->row[k + 1] - f->all->row[k]; r++) force[r] *= share;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = D - B U of all contacts at the accepted time; *most: the largest displacement. */
static PetscErrorCode ComputeSlips(HycoROM m, HycoFE fe, PetscReal *most)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;
  HycoRows *rows = &f->rows;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < f->all->row[f->all->n]; r++) {
    f->slack[r] = rows->gap[r];
    for (PetscInt e = rows->start[r]; e < rows->start[r + 1]; e++) f->slack[r] -= rows->value[e] * m->U[rows->dof[e]];
  }
  *most = 0;
  for (PetscInt i = 0; i < fe->n_dof; i++) *most = PetscMax(*most, PetscAbsReal(m->U[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coulomb's law for the tangential part of a reconstructed force, of n components: where r - rho w is outside the cone,
   the contact slips, and the force is on the cone. Elsewhere it sticks, and a slip that would do negative work is an
   error of the modes. */
static void GalerkinFrictionSlip(PetscReal mu, PetscReal rho, PetscInt n, PetscReal force[], PetscReal slack[])
{
  const PetscReal data[2] = {mu, 0};
  PetscReal y[3] = {force[0]}, work = 0;

  for (PetscInt j = 1; j < n; j++) y[j] = force[j] - rho * slack[j];
  if (HycoTangential(n, y) > mu * force[0]) HycoCoulombProject(n, data, y, force);
  for (PetscInt j = 1; j < n; j++) work -= force[j] * slack[j];
  for (PetscInt j = 1; j < n && work < 0; j++) slack[j] = 0;
}

/* The law outside the RID, with a rho that makes the largest force and displacement equally large. */
static void GalerkinFrictionApplyLaw(HycoROM m, PetscReal most)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;
  PetscReal force = 0;

  for (PetscInt k = 0; k < f->all->n; k++) force = PetscMax(force, f->force[f->all->row[k]]);
  for (PetscInt k = 0; k < f->all->n && most > 0; k++) {
    const PetscInt begin = f->all->row[k];

    if (!m->model->in_rid[k])
      GalerkinFrictionSlip(f->all->mu[k], force / most, f->all->row[k + 1] - begin, f->force + begin, f->slack + begin);
  }
}

/* An accepted step to t, whose x and L are the path's: forces and slips of all contacts. */
PetscErrorCode HycoGalerkinFrictionAccept(HycoROM m, PetscReal t)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;
  PetscReal most;
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(HycoROMComplete(m));
  PetscCall(HycoROMBringContacts(m, &fe));
  PetscCall(HycoContactStateRows(f->all, fe, &f->rows));
  PetscCall(TakeMultipliers(m));
  if (m->ops->reconstruct && m->reconstruct) HycoLogged(HYCO_EVENT_RECONSTRUCT, (*m->ops->reconstruct)(m));
  PetscCall(ComputeSlips(m, fe, &most));
  GalerkinFrictionApplyLaw(m, most);
  PetscCall(GalerkinFrictionBalance(m));
  PetscCall(HycoContactStateAccept(f->all, t, f->force, f->slack, most, m->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces of the last accepted time, which is recorded with the displacements there: an attempt after it may have
   left others. */
PetscErrorCode HycoGalerkinFrictionShow(HycoROM m)
{
  HycoGalerkinFriction f = ((HycoGalerkin)m->work)->friction;

  PetscFunctionBegin;
  m->beyond_current = PETSC_FALSE;
  PetscCall(HycoROMComplete(m));
  for (PetscInt k = 0; k < f->all->n; k++) m->Lambda[k] = f->force[f->all->row[k]];
  m->spread = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
