/*
  The part of the model's mesh that the reduced problem uses, without what only reconstruction, estimates and outputs
  need. The mesh has the nodes of every contact, the reduced problem only those of its cells and of A_lambda: they come
  first in the mesh, so that the cost of a prediction does not depend on the others.
*/
#include <hycogalerkin.h>

/* One past the last node that is needed: of a cell or a load in Omega_A, of a contact of A_lambda, of a facet whose
   normal is needed there. Nodes are ordered by first use, so that the first n are a mesh of their own. */
static PetscErrorCode CountNodes(HycoROM m, PetscInt *n)
{
  HycoMesh mesh = m->model->mesh;
  PetscBool *slave;
  PetscInt node[HYCO_MAX_CELL_NODES], last;

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt e = 0; e < mesh->n_cells; e++) {
    const PetscInt n_nodes = HycoMeshCellNodes(mesh, e, node);

    for (PetscInt v = 0; v < n_nodes; v++) *n = PetscMax(*n, node[v] + 1);
  }
  PetscCall(ISGetMinMax(m->model->rid, NULL, &last));
  *n = PetscMax(*n, last + 1);                    /* an empty set has the least integer as its largest node */
  PetscCall(PetscCalloc1(mesh->n_nodes, &slave)); /* with a measured normal or integrals */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    if (!m->model->in_rid[k]) continue;
    *n = PetscMax(*n, m->model->pairs.slave[k] + 1);
    for (PetscInt j = m->model->pairs.master_start[k]; j < m->model->pairs.master_start[k + 1]; j++)
      *n = PetscMax(*n, m->model->pairs.master[j] + 1);
    /* An averaged normal and a mortar read the facets around the slave, whose nodes may lie outside Omega_A. */
    if (HycoContactAverages(m->model->scene->contact[m->model->pairs.contact[k]]) ||
        m->model->scene->contact[m->model->pairs.contact[k]]->integrated)
      slave[m->model->pairs.slave[k]] = PETSC_TRUE;
  }
  for (PetscInt f = 0; f < mesh->n_facets; f++) {
    PetscBool any = PETSC_FALSE;

    for (PetscInt a = 0; a < mesh->nf; a++) any = (PetscBool)(any || slave[mesh->facets[f * mesh->nf + a]]);
    for (PetscInt a = 0; any && a < mesh->nf; a++) *n = PetscMax(*n, mesh->facets[f * mesh->nf + a] + 1);
  }
  /* In ascending order: masters that are added here may be tied in turn. */
  for (PetscInt k = 0; k < mesh->n_tied && mesh->tied[k] < *n; k++) { /* their masters may add nodes */
    for (PetscInt j = mesh->tied_start[k]; j < mesh->tied_start[k + 1]; j++)
      *n = PetscMax(*n, mesh->tied_master[j] + 1);
  }
  PetscCall(PetscFree(slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Selects the contacts of A_lambda, in the order of all. */
static PetscErrorCode SelectPairs(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoPairs *all = &m->model->pairs;

  PetscFunctionBegin;
  m->m = 0;
  PetscCall(PetscMalloc1(all->n, &m->contact));
  for (PetscInt k = 0; k < all->n; k++) {
    if (m->model->in_rid[k]) m->contact[m->m++] = k;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, m->m, m->contact, PETSC_COPY_VALUES, &g->sets.is_A_lambda));
  PetscCall(HycoPairsSelect(all, m->m, m->contact, NULL, &g->own_pairs));
  /* The masters that a slave may meet over the ranges: fixed here, so that B's pattern is known before the first
     prediction. */
  HycoPairsSetReach(&g->own_pairs, m->model->master_reach);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The submesh has the first n nodes, so that unknowns have the same numbers in both: V, fe_dof and sets serve for both.
   Cells beyond are needed by the full reconstruction only, which has the model's whole mesh. */
PetscErrorCode HycoGalerkinCreateOwn(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(CountNodes(m, &n));
  PetscCall(HycoSubmeshFirst(m->model->scene, m->model->mesh, n, &g->own));
  PetscCall(SelectPairs(m));
  if (HycoSceneHasFriction(m->model->scene)) {
    PetscCall(HycoGalerkinFrictionCreate(m));
    PetscCall(ISCreateStride(PETSC_COMM_SELF, m->n_L, 0, 1, &g->sets.is_rows));
  } else {
    PetscCall(PetscObjectReference((PetscObject)g->sets.is_A_lambda));
    g->sets.is_rows = g->sets.is_A_lambda;
  }
  m->of_fe = &g->own_pairs;
  m->spread = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The free unknowns of a set of nodes. */
static PetscErrorCode CreateUnknowns(HycoFE fe, IS nodes, IS *unknowns)
{
  const PetscInt *node;
  PetscInt n_nodes, n = 0, *dof;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(nodes, &n_nodes));
  PetscCall(ISGetIndices(nodes, &node));
  PetscCall(PetscMalloc1(n_nodes * fe->dim, &dof));
  for (PetscInt k = 0; k < n_nodes * fe->dim; k++) {
    const PetscInt i = node[k / fe->dim] * fe->dim + k % fe->dim;

    /* Fixed unknowns are decoupled rows, which (38) must not test. */
    if (!fe->fixed[i]) dof[n++] = i;
  }
  PetscCall(ISRestoreIndices(nodes, &node));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, dof, PETSC_COPY_VALUES, unknowns));
  PetscCall(PetscFree(dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Once: which components are fixed does not depend on parameters, but is known at some only. */
PetscErrorCode HycoGalerkinCreateSets(HycoROM m)
{
  HycoIndexSets *s = &((HycoGalerkin)m->work)->sets;
  IS interface;

  PetscFunctionBegin;
  if (s->is_A) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CreateUnknowns(m->fe, m->model->inside, &s->is_A));
  PetscCall(ISDifference(m->model->rid, m->model->inside, &interface));
  PetscCall(CreateUnknowns(m->fe, interface, &s->is_I));
  PetscCall(ISDestroy(&interface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A'_c, the unknowns on which B's rows act, and A_c, those of them in A. B's pattern follows the search of masters, so
   this is called whenever the rows are new. */
static PetscErrorCode CreateContactSets(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt *start, *column;
  PetscInt n, n_old = -1, n_rows, *dof;
  PetscBool done;

  PetscFunctionBegin;
  if (g->sets.is_Ac_all) PetscCall(ISGetLocalSize(g->sets.is_Ac_all, &n_old));
  PetscCall(MatGetRowIJ(g->B, 0, PETSC_FALSE, PETSC_FALSE, &n_rows, &start, &column, &done));
  n = start[n_rows];
  HycoDuplicate(n, column, &dof);
  PetscCall(MatRestoreRowIJ(g->B, 0, PETSC_FALSE, PETSC_FALSE, &n_rows, &start, &column, &done));
  PetscCall(PetscSortRemoveDupsInt(&n, dof));
  /* The set contains the earlier one: equal sizes mean equal sets. */
  if (n == n_old) { /* B's pattern grows, and the set with it */
    PetscCall(PetscFree(dof));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoDestroyAll(&g->sets.is_Ac, &g->sets.is_Ac_all);
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, dof, PETSC_OWN_POINTER, &g->sets.is_Ac_all));
  PetscCall(ISIntersect(g->sets.is_Ac_all, g->sets.is_A, &g->sets.is_Ac));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B on the RID's unknowns, with room for the masters that a slave may meet while surfaces move; rows of contacts
   outside A_lambda are empty. at: the row of B for each of own_rows. */
static PetscErrorCode CreateContactMatrix(HycoROM m, PetscInt n_own, const PetscInt at[], Mat *B)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt width = HycoPairsWidth(&g->own_pairs) * m->fe->dim, n = g->friction ? n_own : m->model->pairs.n;
  PetscInt *entries;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &entries));
  for (PetscInt k = 0; k < n_own; k++) entries[at[k]] = width;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, m->fe->n_dof, 0, entries, B));
  /* Mortars may meet more masters than at first. */
  PetscCall(MatSetOption(*B, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(PetscFree(entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries that are not in B's pattern so far, as normals turn and masters change on moved surfaces, stay in it. */
PetscErrorCode HycoGalerkinContactMatrix(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoRows *rows = &g->own_rows;
  const PetscInt *at;
  PetscInt n;
  PetscObjectState before, after;

  PetscFunctionBegin;
  if (g->current_B) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISGetLocalSize(g->sets.is_rows, &n));
  PetscCall(ISGetIndices(g->sets.is_rows, &at));
  /* Not a new matrix: entries that were ever used stay in the pattern, and products with B keep their symbolic part. */
  if (g->B)
    PetscCall(MatZeroEntries(g->B));
  else
    PetscCall(CreateContactMatrix(m, n, at, &g->B));
  PetscCall(MatGetNonzeroState(g->B, &before));
  for (PetscInt k = 0; k < n; k++)
    PetscCall(MatSetValues(g->B, 1, &at[k], rows->start[k + 1] - rows->start[k], rows->dof + rows->start[k],
                           rows->value + rows->start[k], ADD_VALUES));
  PetscCall(ISRestoreIndices(g->sets.is_rows, &at));
  PetscCall(HycoMatAssemble(g->B));
  /* PETSc counts changes of the pattern, so that the sets are rebuilt only then. */
  PetscCall(MatGetNonzeroState(g->B, &after));
  if (!g->sets.is_Ac || after != before) PetscCall(CreateContactSets(m));
  g->current_B = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinDestroyOwn(HycoGalerkin g)
{
  PetscFunctionBegin;
  HycoDestroyAll(&g->sets.is_A, &g->sets.is_I, &g->sets.is_Ac, &g->sets.is_Ac_all, &g->sets.is_rows,
                 &g->sets.is_A_lambda);
  PetscCall(HycoGalerkinFrictionDestroy(&g->friction));
  PetscCall(HycoMeshDestroy(&g->own));
  PetscCall(HycoPairsDestroy(&g->own_pairs));
  PetscCall(HycoRowsDestroy(&g->own_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows are packed in place, from the front: n never overtakes the entry that is read. */
PetscErrorCode HycoGalerkinOwnRows(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoRows *rows = &g->own_rows;
  const PetscReal none = g->own_pairs.room ? HycoContactNoGap(m->fe) : 0;
  PetscInt n = 0, lo = 0, at;

  PetscFunctionBegin;
  if (g->friction) {
    PetscCall(HycoGalerkinFrictionRows(m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoContactRows(m->fe, &g->own_pairs, rows));
  if (!g->own_pairs.room) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < m->m; k++) {
    const PetscInt hi = rows->start[k + 1];
    /* A contact that no map moves has kept its masters since training, which chose A_lambda by them. */
    PetscBool tested = (PetscBool)!HycoPairsMoved(&g->own_pairs, k);

    for (PetscInt t = lo; t < hi && !tested; t++) {
      PetscCall(ISLocate(g->sets.is_A, rows->dof[t], &at));
      tested = (PetscBool)(at >= 0);
    }
    for (PetscInt t = lo; tested && t < hi; t++, n++) {
      rows->dof[n] = rows->dof[t];
      rows->value[n] = rows->value[t];
    }
    /* A row that no unknown of A reads cannot be in (38), A_lambda of the present masters: it is made empty with a gap
       that never closes. */
    if (!tested) rows->gap[k] = none;
    rows->start[k + 1] = n;
    lo = hi;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
