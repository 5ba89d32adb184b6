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
  HycoContactResult *result;      /* HycoSceneResults() */
};

/* NULL-safe: results are made at the first request. */
PetscErrorCode HycoCarriedDestroy(HycoCarried *carried)
{
  PetscFunctionBegin;
  if (!*carried) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*carried)->normal, &(*carried)->gap, &(*carried)->area, &(*carried)->result, carried);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Created on demand. */
static PetscErrorCode ContactResultsMake(HycoROM m)
{
  HycoCarried c;

  PetscFunctionBegin;
  if (m->carried) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&c));
  m->carried = c;
  PetscCall(PetscMalloc1(3 * m->pairs.n, &c->normal));
  PetscCall(PetscMalloc1(m->pairs.n, &c->gap));
  /* Areas are those of the slave's nodes on the moved mesh, which a parameter may scale: they are filled per
     prediction, not here. */
  PetscCall(PetscMalloc1(m->pairs.n, &c->area));
  PetscCall(PetscMalloc1(HycoSceneResults(m->model->scene), &c->result));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates the geometry to fe's parameters, unless no change affects it. */
static PetscErrorCode ContactResultsUpdate(HycoROM m, HycoFE fe)
{
  HycoCarried c = m->carried;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges changes;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < m->model->scene->n_variables; p++)
    changed[p] = (PetscBool)(!c->ready || fe->mu[p] != c->mu[p]);
  changes = HycoSceneChanges(m->model->scene, changed);
  if (c->ready && !changes.nodes && !changes.rows) PetscFunctionReturn(PETSC_SUCCESS);
  /* Until all three arrays belong to mu. */
  c->ready = PETSC_FALSE;
  PetscCall(HycoContactGeometry(fe, &m->pairs, c->normal, c->gap));
  PetscCall(HycoContactAreas(fe, &m->pairs, c->normal, c->area));
  PetscCall(PetscArraycpy(c->mu, fe->mu, m->model->scene->n_variables));
  c->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without reconstruction a hybrid model has those of A_lambda alone, and sums over a contact of the scene would
   lack the others. */
PetscBool HycoROMHasAllForces(HycoROM m)
{
  return (PetscBool)(!m->ops->reconstruct || m->reconstruct || m->m == m->model->pairs.n);
}

/* Creates and updates the geometry; *least: a force up to it counts as zero. */
static PetscErrorCode ContactResultsPrepare(HycoROM m, const PetscReal Lambda[], HycoFE *fe, PetscReal *least)
{
  PetscReal most = 0;

  PetscFunctionBegin;
  PetscCall(HycoROMBringContacts(m, fe));
  PetscCall(ContactResultsMake(m));
  PetscCall(ContactResultsUpdate(m, *fe));
  for (PetscInt k = 0; k < m->pairs.n; k++) most = PetscMax(most, Lambda[k]);
  *least = HYCO_FORCE_ROUND_OFF * most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing where the model does not know all forces: a sum over a part would look like a resultant. Forces are given,
   not taken from m, because derivatives ask for those of moved states. */
PetscErrorCode HycoROMSumContacts(HycoROM m, const PetscReal Lambda[], const HycoContactResult *result[])
{
  PetscReal least, *pressure;
  HycoFE fe;

  PetscFunctionBegin;
  *result = NULL;
  if (!HycoROMHasAllForces(m)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ContactResultsPrepare(m, Lambda, &fe, &least));
  PetscCall(PetscMalloc1(m->pairs.n, &pressure));
  PetscCall(HycoContactPressures(PETSC_COMM_SELF, fe, &m->pairs, m->carried->area, Lambda, pressure));
  PetscCall(HycoContactResults(fe, &m->pairs, m->carried->normal, m->carried->area, Lambda, pressure, least,
                               m->carried->result));
  for (PetscInt c = 0; c < HycoSceneResults(m->model->scene); c++) {
    /* A minimum over nothing would be the largest number. */
    if (!m->carried->result[c].n) m->carried->result[c].pressure_min = 0;
  }
  PetscCall(PetscFree(pressure));
  *result = m->carried->result;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum of contact and friction forces on a set of bodies along an axis, by which reactions follow from balance.
   Internal pairs of two bodies of the set cancel, as both sides are added. */
PetscErrorCode HycoROMPushBodies(HycoROM m, const PetscReal Lambda[], const PetscBool of[], PetscInt axis,
                                 PetscReal *force)
{
  const PetscInt *body = m->model->mesh->node_body, *master;
  const PetscReal *weight;
  PetscReal least;
  PetscInt n;
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(ContactResultsPrepare(m, Lambda, &fe, &least));
  *force = 0;
  for (PetscInt k = 0; k < m->pairs.n; k++) {
    const HycoShear *shear = m->pairs.shear;
    /* The normal points out of the slave: the force on the slave is against it, that of friction as it is. */
    const PetscReal along = Lambda[k] * m->carried->normal[3 * k + axis] - (shear ? shear->force[3 * k + axis] : 0);

    if (Lambda[k] <= least || HycoPairsAlone(m->model->scene, &m->pairs, k)) continue;
    if (of[body[m->pairs.slave[k]]]) *force -= along;
    HycoPairsMasters(&m->pairs, k, &n, &master, &weight);
    for (PetscInt j = 0; j < n; j++) *force += of[body[master[j]]] ? weight[j] * along : 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n = 0: the model does not have all forces. */
PetscErrorCode HycoROMGetContacts(HycoROM m, PetscInt *n, const HycoContactResult *result[])
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(n);
  HycoCheckGiven(result);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before HycoROMGetContacts()");
  HycoTraceShow(m, m->trace.shown);
  PetscCall(HycoROMSumContacts(m, m->Lambda, result));
  *n = *result ? m->model->scene->n_contacts : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
