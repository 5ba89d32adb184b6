/*
  Results of each contact of the scene in a prediction. Normals, areas and node positions are those of full order at the
  same parameters, evaluated on the model's surfaces and updated when parameters change them; the forces are the
  prediction's.
*/
#include <hycoromimpl.h>

struct _n_HycoCarried {
  PetscBool ready; /* the geometry is that of the current mu */
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscReal *normal, *gap, *area; /* by potential contact */
  HycoContactResult *result;      /* by contact of the scene */
};

PetscErrorCode HycoCarriedDestroy(HycoCarried *carried)
{
  PetscFunctionBegin;
  if (!*carried) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*carried)->normal, &(*carried)->gap, &(*carried)->area, &(*carried)->result);
  PetscCall(PetscFree(*carried));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Created on demand. */
static PetscErrorCode Make(HycoROM m)
{
  HycoCarried c;

  PetscFunctionBegin;
  if (m->carried) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&c));
  m->carried = c;
  PetscCall(PetscMalloc1(3 * m->pairs.n, &c->normal));
  PetscCall(PetscMalloc1(m->pairs.n, &c->gap));
  PetscCall(PetscMalloc1(m->pairs.n, &c->area));
  PetscCall(PetscMalloc1(m->scene->n_contacts, &c->result));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates the geometry to fe's parameters, unless no change affects it. */
static PetscErrorCode Bring(HycoROM m, HycoFE fe)
{
  HycoCarried c = m->carried;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges changes;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < m->scene->n_variables; p++) changed[p] = (PetscBool)(!c->ready || fe->mu[p] != c->mu[p]);
  changes = HycoSceneChanges(m->scene, changed);
  if (c->ready && !changes.nodes && !changes.rows) PetscFunctionReturn(PETSC_SUCCESS);
  c->ready = PETSC_FALSE;
  PetscCall(HycoContactGeometry(fe, &m->pairs, c->normal, c->gap));
  PetscCall(HycoContactAreas(fe, &m->pairs, c->area));
  PetscCall(PetscArraycpy(c->mu, fe->mu, m->scene->n_variables));
  c->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether Lambda has the forces of all contacts. */
static PetscBool HasAll(HycoROM m)
{
  return (PetscBool)(!m->ops->reconstruct || m->reconstruct || m->m == m->pairs.n);
}

PetscErrorCode HycoROMSumContacts(HycoROM m, const PetscReal Lambda[], const HycoContactResult *result[])
{
  PetscReal most = 0;
  HycoFE fe;

  PetscFunctionBegin;
  *result = NULL;
  if (!HasAll(m)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMBringContacts(m, &fe));
  PetscCall(Make(m));
  PetscCall(Bring(m, fe));
  for (PetscInt k = 0; k < m->pairs.n; k++) most = PetscMax(most, Lambda[k]);
  HycoContactResults(fe, &m->pairs, m->carried->normal, m->carried->area, Lambda, HYCO_PRESSES * most,
                     m->carried->result);
  *result = m->carried->result;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMGetContacts(HycoROM m, PetscInt *n, const HycoContactResult *result[])
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before HycoROMGetContacts()");
  PetscCall(HycoROMSumContacts(m, m->Lambda, result));
  *n = *result ? m->scene->n_contacts : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
