/*
  The part of the model's mesh that the reduced problem uses, without what only reconstruction, estimates and outputs
  need. The mesh has the nodes of every contact, the reduced problem only those of its cells and of A_lambda: they come
  first in the mesh, so that the cost of a prediction does not depend on the others.
*/
#include <hycogalerkin.h>

/* One past the last node that is needed: of a cell or a load in Omega_A, of a contact of A_lambda, of a facet whose
   normal is needed there. */
static PetscErrorCode CountNodes(HycoROM m, PetscInt *n)
{
  HycoMesh mesh = m->mesh;
  PetscBool *slave;
  PetscInt node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt e = 0; e < mesh->n_cells; e++) {
    const PetscInt n_nodes = HycoMeshCellNodes(mesh, e, node);

    for (PetscInt v = 0; v < n_nodes; v++) *n = PetscMax(*n, node[v] + 1);
  }
  for (PetscInt i = *n; i < mesh->n_nodes; i++) *n = m->role[i] == HYCO_ROLE_A ? i + 1 : *n;
  PetscCall(PetscCalloc1(mesh->n_nodes, &slave)); /* with a measured normal */
  for (PetscInt k = 0; k < m->pairs.n; k++) {
    if (!m->in_rid[k]) continue;
    *n = PetscMax(*n, m->pairs.slave[k] + 1);
    for (PetscInt j = m->pairs.master_start[k]; j < m->pairs.master_start[k + 1]; j++)
      *n = PetscMax(*n, m->pairs.master[j] + 1);
    if (HycoContactAverages(m->scene->contact[m->pairs.contact[k]])) slave[m->pairs.slave[k]] = PETSC_TRUE;
  }
  for (PetscInt f = 0; f < mesh->n_facets; f++) {
    PetscBool any = PETSC_FALSE;

    for (PetscInt a = 0; a < mesh->nf; a++) any = (PetscBool)(any || slave[mesh->facets[f * mesh->nf + a]]);
    for (PetscInt a = 0; any && a < mesh->nf; a++) *n = PetscMax(*n, mesh->facets[f * mesh->nf + a] + 1);
  }
  for (PetscInt k = 0; k < mesh->n_tied && mesh->tied[k] < *n; k++) { /* their masters may add nodes */
    for (PetscInt j = mesh->tied_start[k]; j < mesh->tied_start[k + 1]; j++)
      *n = PetscMax(*n, mesh->tied_master[j] + 1);
  }
  PetscCall(PetscFree(slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A view of mesh with its first n nodes: it has its own facets and groups, and shares the rest. */
static PetscErrorCode ViewMesh(HycoMesh mesh, PetscInt n, HycoMesh *own)
{
  HycoMesh o;
  PetscInt count = 0;

  PetscFunctionBegin;
  PetscCall(PetscNew(own));
  o = *own;
  *o = *mesh;
  o->n_nodes = n;
  while (o->n_tied && o->tied[o->n_tied - 1] >= n) o->n_tied--;
  o->n_facets = 0;
  PetscCall(PetscMalloc1(mesh->n_facets * mesh->nf, &o->facets));
  PetscCall(PetscMalloc1(mesh->n_facets, &o->facet_group));
  PetscCall(PetscMalloc1(mesh->n_facets, &o->facet_cell));
  for (PetscInt f = 0; f < mesh->n_facets; f++) {
    PetscBool inside = PETSC_TRUE;

    for (PetscInt a = 0; a < mesh->nf; a++) inside = (PetscBool)(inside && mesh->facets[f * mesh->nf + a] < n);
    if (!inside) continue;
    PetscCall(PetscArraycpy(o->facets + o->n_facets * mesh->nf, mesh->facets + f * mesh->nf, mesh->nf));
    o->facet_group[o->n_facets] = mesh->facet_group[f];
    o->facet_cell[o->n_facets++] = mesh->facet_cell[f];
  }
  PetscCall(PetscMalloc1(mesh->n_groups + 1, &o->group_start));
  PetscCall(PetscMalloc1(mesh->group_start[mesh->n_groups], &o->group_node));
  o->group_start[0] = 0;
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    for (PetscInt k = mesh->group_start[g]; k < mesh->group_start[g + 1]; k++) {
      if (mesh->group_node[k] < n) o->group_node[count++] = mesh->group_node[k];
    }
    o->group_start[g + 1] = count;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Selects the contacts of A_lambda, in the order of all. */
static PetscErrorCode SelectPairs(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  const HycoPairs *all = &m->pairs;

  PetscFunctionBegin;
  m->m = 0;
  PetscCall(PetscMalloc1(all->n, &m->contact));
  for (PetscInt k = 0; k < all->n; k++) {
    if (m->in_rid[k]) m->contact[m->m++] = k;
  }
  PetscCall(HycoPairsSelect(all, m->m, m->contact, NULL, &g->own_pairs));
  HycoPairsSetReach(&g->own_pairs, m->master_reach);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinCreateOwn(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(CountNodes(m, &n));
  PetscCall(ViewMesh(m->mesh, n, &g->own));
  PetscCall(SelectPairs(m));
  PetscCall(HycoRowsCreate(&g->own_pairs, m->mesh->dim, &g->own_rows));
  m->of_fe = &g->own_pairs;
  m->spread = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Free unknowns of fe's mesh with a role. */
static PetscErrorCode CreateUnknowns(HycoROM m, PetscInt role, IS *is)
{
  PetscInt n = 0, *dof;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->fe->n_dof, &dof));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    if (m->role[i / m->mesh->dim] == role && !m->fe->fixed[i]) dof[n++] = i;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, dof, PETSC_COPY_VALUES, is));
  PetscCall(PetscFree(dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinCreateSets(HycoROM m)
{
  HycoIndexSets *s = &((HycoGalerkin)m->data)->sets;

  PetscFunctionBegin;
  PetscCall(CreateUnknowns(m, HYCO_ROLE_A, &s->is_A));
  PetscCall(CreateUnknowns(m, HYCO_ROLE_INTERFACE, &s->is_I));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, m->m, m->contact, PETSC_COPY_VALUES, &s->is_A_lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A'_c, the unknowns on which the rows act, and A_c, those of them in A. */
static PetscErrorCode CreateContactSets(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  PetscInt n = 0, *dof;
  PetscBool *acts;

  PetscFunctionBegin;
  PetscCall(ISDestroy(&g->sets.is_Ac));
  PetscCall(ISDestroy(&g->sets.is_Ac_all));
  PetscCall(PetscCalloc1(m->fe->n_dof, &acts));
  PetscCall(PetscMalloc1(m->fe->n_dof, &dof));
  for (PetscInt t = 0; t < g->own_rows.start[m->m]; t++) acts[g->own_rows.dof[t]] = PETSC_TRUE;
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    if (acts[i]) dof[n++] = i;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, dof, PETSC_COPY_VALUES, &g->sets.is_Ac_all));
  PetscCall(ISIntersect(g->sets.is_Ac_all, g->sets.is_A, &g->sets.is_Ac));
  PetscCall(PetscFree(dof));
  PetscCall(PetscFree(acts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinContactMatrix(HycoROM m, Mat *B)
{
  const HycoRows *rows = &((HycoGalerkin)m->data)->own_rows;

  PetscFunctionBegin;
  PetscCall(CreateContactSets(m));
  PetscCall(MatCreate(PETSC_COMM_SELF, B));
  PetscCall(MatSetSizes(*B, m->m, m->fe->n_dof, m->m, m->fe->n_dof));
  PetscCall(MatSetType(*B, MATSEQAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*B, HycoPairsWidth(&m->pairs) * m->mesh->dim, NULL));
  for (PetscInt k = 0; k < m->m; k++)
    PetscCall(MatSetValues(*B, 1, &k, rows->start[k + 1] - rows->start[k], rows->dof + rows->start[k],
                           rows->value + rows->start[k], INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*B, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyView(HycoMesh *mesh)
{
  PetscFunctionBegin;
  if (!*mesh) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*mesh)->facets));
  PetscCall(PetscFree((*mesh)->facet_group));
  PetscCall(PetscFree((*mesh)->facet_cell));
  PetscCall(PetscFree((*mesh)->group_start));
  PetscCall(PetscFree((*mesh)->group_node));
  PetscCall(PetscFree(*mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinDestroyOwn(HycoGalerkin g)
{
  PetscFunctionBegin;
  PetscCall(ISDestroy(&g->sets.is_A));
  PetscCall(ISDestroy(&g->sets.is_I));
  PetscCall(ISDestroy(&g->sets.is_Ac));
  PetscCall(ISDestroy(&g->sets.is_Ac_all));
  PetscCall(ISDestroy(&g->sets.is_A_lambda));
  PetscCall(DestroyView(&g->own));
  PetscCall(HycoPairsDestroy(&g->own_pairs));
  PetscCall(HycoRowsDestroy(&g->own_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinOwnRows(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->data;
  HycoRows *rows = &g->own_rows;
  const PetscInt dim = m->mesh->dim;
  const PetscReal none = g->own_pairs.room ? HycoContactNoGap(m->fe) : 0;
  PetscInt n = 0, lo = 0;

  PetscFunctionBegin;
  PetscCall(HycoContactRows(m->fe, &g->own_pairs, rows->start, rows->dof, rows->value, rows->gap));
  if (!g->own_pairs.room) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < m->m; k++) {
    const PetscInt hi = rows->start[k + 1];
    PetscBool tested = (PetscBool)!HycoPairsMoved(&g->own_pairs, k);

    for (PetscInt t = lo; t < hi; t++) tested = (PetscBool)(tested || m->role[rows->dof[t] / dim] == HYCO_ROLE_A);
    for (PetscInt t = lo; tested && t < hi; t++, n++) {
      rows->dof[n] = rows->dof[t];
      rows->value[n] = rows->value[t];
    }
    if (!tested) rows->gap[k] = none;
    rows->start[k + 1] = n;
    lo = hi;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
