/* Completes a prediction on demand: the rows of contacts and the displacements outside the part that the reduced
   problem uses. */
#include <hycoromimpl.h>

/* Creates fe_beyond without the mesh's cells: their materials are not needed. Created on demand: a prediction of
   displacements in the RID alone needs nothing beyond it. */
static PetscErrorCode CreateBeyond(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoFECreateSurface(m->model->scene, m->model->mesh->dm, &m->fe_beyond));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether supports hold a displacement in a row: then it is a part of the gap. */
PetscBool HycoRowsAreHeld(HycoFE fe, const HycoPairs *pairs)
{
  const PetscInt dim = fe->dim;

  for (PetscInt k = 0; k < pairs->n * dim; k++) {
    if (fe->fixed[pairs->slave[k / dim] * dim + k % dim]) return PETSC_TRUE;
  }
  for (PetscInt j = 0; j < pairs->master_start[pairs->n] * dim; j++) {
    if (fe->fixed[pairs->master[j / dim] * dim + j % dim]) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The rows of all contacts at mu on fe, which is on mesh or on mesh without cells. */
static PetscErrorCode BringRows(HycoROM m, HycoFE fe, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(fe, mu));
  /* fe knows whether its parameters since the last rows affect these. */
  if (m->rows.filled && !fe->contact_changed &&
      (!fe->gap_changed || (fe->supports_only && !fe->n_oblique && !HycoRowsAreHeld(fe, &m->pairs))))
    PetscFunctionReturn(PETSC_SUCCESS);
  fe->ready = PETSC_FALSE; /* until its rows are computed */
  PetscCall(HycoContactRows(fe, &m->pairs, &m->rows));
  fe->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of B and gaps at mu, for the contacts of the model's mesh. */
PetscErrorCode HycoROMBringRows(HycoROM m, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(BringRows(m, m->fe, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U = u0 + V gamma on the nodes of fe from the first unknown on. */
static void CompleteExpand(HycoROM m, HycoFE fe, PetscInt first)
{
  const PetscInt l = m->model->l;

  for (PetscInt i = first; i < fe->n_dof; i++) {
    const PetscReal *v = m->model->V + (size_t)i * (size_t)l;

    m->U[i] = fe->u0[i];
    for (PetscInt j = 0; j < l; j++) m->U[i] += v[j] * m->gamma[j];
  }
  HycoFEComplete(fe, m->U);
}

PetscErrorCode HycoROMExpand(HycoROM m)
{
  PetscFunctionBegin;
  CompleteExpand(m, m->fe, 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of fe that are not full-order ones, whose displacements the modes give. */
static PetscErrorCode FindModal(HycoROM m)
{
  PetscInt n = 0, f = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->fe->n_dof + 1, &m->modal));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    /* fe_dof is ascending, as I is: one pass over both. */
    while (f < m->model->n_fe && m->model->fe_dof[f] < i) f++;
    if (f == m->model->n_fe || m->model->fe_dof[f] != i) m->modal[n++] = i;
  }
  m->n_modal = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only the displacements that B beyond the RID multiplies, not all of them: gaps there need no more. The list is made
   once, since it follows from the pairs. */
PetscErrorCode HycoROMExpandModal(HycoROM m)
{
  const PetscInt l = m->model->l;

  PetscFunctionBegin;
  if (!m->modal) PetscCall(FindModal(m));
  for (PetscInt k = 0; k < m->n_modal; k++) {
    const PetscInt i = m->modal[k];
    const PetscReal *v = m->model->V + (size_t)i * (size_t)l;

    /* The modes vanish where displacements are prescribed (15), so that u0 alone is right there. */
    m->U[i] = m->fe->u0[i];
    for (PetscInt j = 0; j < l; j++) m->U[i] += v[j] * m->gamma[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If the reduced problem is on the whole of the model's mesh, its own rows are those of all contacts. */
PetscErrorCode HycoROMBringContacts(HycoROM m, HycoFE *fe)
{
  PetscFunctionBegin;
  *fe = m->fe;
  if (m->fe->mesh == m->model->mesh) PetscFunctionReturn(PETSC_SUCCESS);
  if (!m->fe_beyond) PetscCall(CreateBeyond(m));
  if (!m->beyond_current) PetscCall(BringRows(m, m->fe_beyond, m->fe->mu));
  *fe = m->fe_beyond;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Idempotent until the next prediction. The first unknowns are already set by the solve. */
PetscErrorCode HycoROMComplete(HycoROM m)
{
  HycoFE fe;

  PetscFunctionBegin;
  if (m->fe->mesh == m->model->mesh || m->beyond_current) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMBringContacts(m, &fe));
  CompleteExpand(m, fe, m->fe->n_dof);
  m->beyond_current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
