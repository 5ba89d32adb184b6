/*
  What of the model's mesh the reduced problem touches, apart from what only reconstruction, estimates and outputs ask
  for. The mesh has the nodes of every contact, the reduced problem only those of its cells and of A_lambda: they come
  first in the mesh, and a prediction costs the same whatever lies beyond.
*/
#include <hycoromimpl.h>

static PetscErrorCode CreateRows(const HycoPairs *pairs, PetscInt dim, HycoRows *rows)
{
  const PetscInt entries = HycoPairsWidth(pairs) * dim * pairs->n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n + 1, &rows->start));
  PetscCall(PetscMalloc1(entries, &rows->dof));
  PetscCall(PetscMalloc1(entries, &rows->value));
  PetscCall(PetscMalloc1(pairs->n, &rows->gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One past the last node that matters: of a cell, of a contact of A_lambda, of a facet whose normal counts there. */
static PetscErrorCode CountNodes(HycoROM m, PetscInt *n)
{
  HycoMesh mesh = m->mesh;
  PetscBool *slave;

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt k = 0; k < mesh->n_cells * mesh->nv; k++) *n = PetscMax(*n, mesh->cells[k] + 1);
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
  PetscCall(PetscFree(slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A view of mesh with its first n nodes: it has facets and groups of its own, and shares the rest. */
static PetscErrorCode ViewMesh(HycoMesh mesh, PetscInt n, HycoMesh *own)
{
  HycoMesh o;
  PetscInt count = 0;

  PetscFunctionBegin;
  PetscCall(PetscNew(own));
  o = *own;
  *o = *mesh;
  o->n_nodes = n;
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

/* The contacts of A_lambda, in the order of all. */
static PetscErrorCode SelectPairs(HycoROM m)
{
  const HycoPairs *all = &m->pairs;

  PetscFunctionBegin;
  m->m = 0;
  PetscCall(PetscMalloc1(all->n, &m->contact));
  for (PetscInt k = 0; k < all->n; k++) {
    if (m->in_rid[k]) m->contact[m->m++] = k;
  }
  PetscCall(HycoPairsSelect(all, m->m, m->contact, NULL, &m->own_pairs));
  HycoPairsSetReach(&m->own_pairs, m->master_reach);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCreateOwn(HycoROM m)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(CountNodes(m, &n));
  PetscCall(ViewMesh(m->mesh, n, &m->own));
  PetscCall(SelectPairs(m));
  PetscCall(CreateRows(&m->own_pairs, m->mesh->dim, &m->own_rows));
  m->spread = PETSC_FALSE;
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

PetscErrorCode HycoROMDestroyOwn(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoFEDestroy(&m->fe_beyond));
  PetscCall(PetscFree(m->beyond));
  PetscCall(DestroyView(&m->own));
  PetscCall(HycoPairsDestroy(&m->own_pairs));
  PetscCall(PetscFree(m->own_rows.start));
  PetscCall(PetscFree(m->own_rows.dof));
  PetscCall(PetscFree(m->own_rows.value));
  PetscCall(PetscFree(m->own_rows.gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMOwnRows(HycoROM m)
{
  HycoRows *rows = &m->own_rows;
  const PetscInt dim = m->mesh->dim;
  const PetscReal none = m->own_pairs.room ? HycoContactNoGap(m->fe) : 0;
  PetscInt n = 0, lo = 0;

  PetscFunctionBegin;
  PetscCall(HycoContactRows(m->fe, &m->own_pairs, rows->start, rows->dof, rows->value, rows->gap));
  if (!m->own_pairs.room) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < m->m; k++) {
    const PetscInt hi = rows->start[k + 1];
    PetscBool tested = (PetscBool)!HycoPairsMoved(&m->own_pairs, k);

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

/* The whole of mesh as nodes and surfaces alone: nobody asks for its cells' materials. */
static PetscErrorCode CreateBeyond(HycoROM m)
{
  HycoRows rows;

  PetscFunctionBegin;
  PetscCall(PetscNew(&m->beyond));
  *m->beyond = *m->mesh;
  m->beyond->n_cells = 0;
  PetscCall(HycoFECreate(m->scene, m->beyond, &m->fe_beyond));
  PetscCall(CreateRows(&m->pairs, m->mesh->dim, &rows));
  m->row_start = rows.start;
  m->row_dof = rows.dof;
  m->row_value = rows.value;
  m->gap = rows.gap;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMComplete(HycoROM m)
{
  const PetscInt l = m->l;
  HycoFE fe;

  PetscFunctionBegin;
  if (m->condensed || m->beyond_current) PetscFunctionReturn(PETSC_SUCCESS);
  if (!m->beyond) PetscCall(CreateBeyond(m));
  fe = m->fe_beyond;
  PetscCall(HycoFESetParameters(fe, m->fe->mu));
  if (fe->contact_changed || fe->gap_changed) {
    fe->ready = PETSC_FALSE; /* until its rows are there */
    PetscCall(HycoContactRows(fe, &m->pairs, m->row_start, m->row_dof, m->row_value, m->gap));
    fe->ready = PETSC_TRUE;
  }
  for (PetscInt i = m->fe->n_dof; i < fe->n_dof; i++) {
    const PetscReal *v = m->V + (size_t)i * (size_t)l;

    m->U[i] = fe->u0[i];
    for (PetscInt j = 0; j < l; j++) m->U[i] += v[j] * m->gamma[j];
  }
  m->beyond_current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
