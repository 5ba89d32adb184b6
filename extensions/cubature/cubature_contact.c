/*
  The cubature model's full-order displacements (39)-(40), if each contact has its finite-element multiplier. For full
  row rank of B on them: all of the contacts' nodes (-hyco_hybrid contact), or one for each contact (rank): the
  component of its slave, or else of a master, with the largest entry of the row that no other contact uses. Their
  equations are the finite elements', so that the cells around them have weight 1, as do those with springs and point
  loads.
*/
#include "cubature.h"

/* Takes all of the contacts' nodes. */
static PetscErrorCode TakeAll(HycoReducer t, PetscBool take[])
{
  HycoFE fe = t->fom->fe_surface;
  PetscBool *contact;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(fe->mesh->n_nodes, &contact));
  HycoPairsMark(&t->fom->pairs, contact);
  for (PetscInt k = 0; k < fe->n_dof; k++) take[k] = (PetscBool)(contact[k / fe->dim] && !fe->fixed[k]);
  PetscCall(PetscFree(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest entry of a row, those of the slave first; -1: none is free. */
static PetscInt CubatureContactLargest(HycoFE fe, PetscInt slave, PetscInt n, const PetscInt dof[],
                                       const PetscReal value[], const PetscBool take[])
{
  PetscInt best = -1;

  for (PetscInt pass = 0; pass < 2 && best < 0; pass++) {
    for (PetscInt j = 0; j < n; j++) {
      const PetscBool of_slave = (PetscBool)(dof[j] / fe->dim == slave);

      if (fe->fixed[dof[j]] || take[dof[j]] || of_slave != (pass ? PETSC_FALSE : PETSC_TRUE)) continue;
      if (best < 0 || PetscAbsReal(value[j]) > (1 + 1e-8) * PetscAbsReal(value[best])) best = j;
    }
  }
  return best < 0 ? -1 : dof[best];
}

/* Takes one unknown for each contact. */
static PetscErrorCode TakeOneEach(HycoReducer t, PetscBool take[])
{
  const HycoPairs *pairs = &t->fom->pairs;
  HycoFE fe = t->fom->fe_surface;
  HycoRows rows = {0};

  PetscFunctionBegin;
  PetscCall(HycoContactRows(fe, &t->fom->pairs, &rows));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt first = rows.start[k];
    const PetscInt dof = CubatureContactLargest(fe, HycoPairsSlave(pairs, k), rows.start[k + 1] - first,
                                                rows.dof + first, rows.value + first, take);

    if (dof >= 0) take[dof] = PETSC_TRUE;
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets c->full, and their nodes by their numbers in the whole mesh, ascending. Rank 0. */
static PetscErrorCode ListFull(HycoReducer t, PetscInt *n, PetscInt node[])
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  HycoFE fe = t->fom->fe_surface;
  PetscBool *take;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscCalloc1(fe->n_dof, &take));
  PetscCall(PetscMalloc1(fe->n_dof, &c->full));
  PetscCall(t->hybrid == HYCO_HYBRID_RANK ? TakeOneEach(t, take) : TakeAll(t, take));
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    const PetscInt i = k / fe->dim, whole = fe->mesh->node_whole ? fe->mesh->node_whole[i] : i;

    if (!take[k]) continue;
    c->full[c->n_full++] = k;
    /* The unknowns of a node follow each other. */
    if (!*n || node[*n - 1] != whole) node[(*n)++] = whole;
  }
  PetscCall(PetscFree(take));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the part's cells with a node of a group. */
static PetscErrorCode MarkGroup(HycoMesh part, const char key[], const char name[], PetscBool near[])
{
  PetscBool *in;
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(part, key, name, &g));
  PetscCall(PetscCalloc1(part->n_nodes, &in));
  for (PetscInt k = part->group_start[g]; k < part->group_start[g + 1]; k++) in[part->group_node[k]] = PETSC_TRUE;
  for (PetscInt k = 0; k < part->n_cells * part->nv; k++) {
    if (in[part->cells[k]]) near[k / part->nv] = PETSC_TRUE;
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the cells of springs and point loads, which are not integrals over the bodies. */
static PetscErrorCode MarkSprings(HycoReducer t, PetscBool near[])
{
  const HycoScene s = t->scene;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_springs; k++) PetscCall(MarkGroup(t->fom->part, "spring", s->spring[k].group, near));
  for (PetscInt k = 0; k < s->n_point_loads; k++)
    PetscCall(MarkGroup(t->fom->part, "force", s->point_load[k].group, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the parameters of the first training point: with the option rank the choice depends on the normals there. Node
   lists are needed on every rank, because each marks its own cells. */
PetscErrorCode HycoCubatureFindContacts(HycoReducer t)
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  HycoMesh part = t->fom->part;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt n = 0, *node, at;

  PetscFunctionBegin;
  HycoFreeAll(&c->near, &c->full);
  c->n_full = 0;
  PetscCall(PetscCalloc1(part->n_cells, &c->near));
  HycoOnEach(HycoComm(t), MarkSprings(t, c->near));
  if (c->forces.dual != HYCO_DUAL_FE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  PetscCall(PetscMalloc1(t->sizes[0], &node));
  HycoOnRoot(HycoComm(t), ListFull(t, &n, node));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, HycoComm(t)));
  HycoBcast(node, n, MPIU_INT, HycoComm(t));
  for (PetscInt k = 0; k < part->n_cells * part->nv; k++) {
    PetscCall(PetscFindInt(part->node_whole ? part->node_whole[part->cells[k]] : part->cells[k], n, node, &at));
    if (at >= 0) c->near[k / part->nv] = PETSC_TRUE;
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From numbers on the contacts' surface to those of the model's mesh, which has all of that surface's nodes. */
PetscErrorCode HycoCubatureSetFullOrder(HycoROM m, HycoReducer t)
{
  const HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  const PetscInt dim = m->model->mesh->dim;
  PetscInt *dof;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(c->n_full, &dof));
  for (PetscInt k = 0; k < c->n_full; k++) dof[k] = t->surface_node[c->full[k] / dim] * dim + c->full[k] % dim;
  PetscCall(HycoROMSetFE(m, t->hybrid == HYCO_HYBRID_RANK ? HYCO_HYBRID_RANK : HYCO_HYBRID_CONTACT, c->n_full, dof));
  PetscCall(PetscFree(dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}
