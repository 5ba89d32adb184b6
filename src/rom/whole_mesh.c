/* The whole-mesh part of a model file: the mesh in the file's order and the modes on it, written by rows from all
   ranks, read when a field on the whole mesh is asked for. */
#include <hycofields.h>
#include <hycoromimpl.h>
#include <string.h>

#define IN(name) "whole/" name

/* Writes n integers of `width` each, at given places among all ranks'. Collective. */
static PetscErrorCode WritePlaced(MPI_Comm comm, HycoH5 h, const char name[], PetscInt all, PetscInt width, PetscInt n,
                                  const PetscInt place[], const PetscInt value[])
{
  PetscLayout layout;
  PetscSF sf;
  PetscInt first, last, *rows;

  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(comm, PETSC_DECIDE, all, 1, &layout));
  PetscCall(PetscLayoutGetRange(layout, &first, &last));
  PetscCall(PetscMalloc1((last - first) * width, &rows));
  PetscCall(PetscSFCreate(comm, &sf));
  /* Rows go to the rank that writes their place: a block of rows each, one write of HDF5. */
  PetscCall(PetscSFSetGraphLayout(sf, layout, n, NULL, PETSC_OWN_POINTER, place));
  PetscCall(HycoSFSend(sf, MPIU_INT, width, value, rows));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&layout));
  HycoFinally(HycoH5WriteRows(h, name, MPIU_INT, all, width, first, last - first, rows), PetscCall(PetscFree(rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the nodes of groups, group by group. Collective. */
static PetscErrorCode WriteGroupNodes(MPI_Comm comm, HycoH5 h, HycoMesh m, PetscInt n_nodes)
{
  PetscInt64 *key;
  PetscInt *node, *place, *start, n = 0, all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m->group_start[m->n_groups], &key, m->group_start[m->n_groups], &node,
                         m->group_start[m->n_groups], &place));
  PetscCall(PetscCalloc1(m->n_groups + 1, &start));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) {
      const PetscInt i = m->group_node[k];

      if (HycoMeshOwned(m, i) < 0) continue;
      node[n] = m->node_whole ? m->node_whole[i] : i;
      /* 64 bits: groups times nodes exceed 32 on large meshes. Sorted by group, then by number in the whole mesh. */
      key[n] = (PetscInt64)g * n_nodes + node[n];
      n++;
      start[g + 1]++;
    }
  }
  HycoAllreduce(start, m->n_groups + 1, MPIU_INT, MPI_SUM, comm);
  for (PetscInt g = 0; g < m->n_groups; g++) start[g + 1] += start[g];
  PetscCall(HycoRankKeys(comm, n, key, place, &all));
  HycoOnRoot(comm, HycoH5WriteInt(h, IN("group_start"), m->n_groups + 1, 1, start));
  PetscCall(WritePlaced(comm, h, IN("group_node"), all, 1, n, place, node));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree3(key, node, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a group is that of a body, whose cells cell_body gives. */
static PetscBool IsBody(HycoScene scene, const char name[])
{
  for (PetscInt k = 0; k < scene->n_bodies; k++) {
    if (strcmp(scene->body[k].name, name) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Writes the cells of groups that are no bodies, group by group. Collective. */
static PetscErrorCode WriteGroupCells(HycoFOM f, HycoH5 h)
{
  HycoMesh m = f->part;
  const PetscInt most = m->group_cell_start[m->n_groups];
  PetscInt64 *key;
  PetscInt *cell, *place, *start, n = 0, all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(most, &key, most, &cell, most, &place));
  PetscCall(PetscCalloc1(m->n_groups + 1, &start));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    for (PetscInt k = m->group_cell_start[g]; k < m->group_cell_start[g + 1] && !IsBody(f->scene, m->group_name[g]);
         k++) {
      const PetscInt e = m->group_cell[k], *node = m->cells + e * m->nv;
      PetscInt least = node[0];

      /* On one rank alone, as facets. */
      for (PetscInt v = 1; v < m->nv; v++) least = PetscMin(least, node[v]);
      if (HycoMeshOwned(m, least) < 0) continue;
      cell[n] = m->cell_whole ? m->cell_whole[e] : e;
      key[n] = (PetscInt64)g * f->n_cells + cell[n];
      n++;
      start[g + 1]++;
    }
  }
  HycoAllreduce(start, m->n_groups + 1, MPIU_INT, MPI_SUM, HycoComm(f));
  for (PetscInt g = 0; g < m->n_groups; g++) start[g + 1] += start[g];
  PetscCall(HycoRankKeys(HycoComm(f), n, key, place, &all));
  HycoOnRoot(HycoComm(f), HycoH5WriteInt(h, IN("group_cell_start"), m->n_groups + 1, 1, start));
  PetscCall(WritePlaced(HycoComm(f), h, IN("group_cell"), all, 1, n, place, cell));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree3(key, cell, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the facets, group by group in the order of their cells. Collective. */
static PetscErrorCode WriteFacets(MPI_Comm comm, HycoH5 h, HycoMesh m, PetscInt n_cells)
{
  PetscInt64 *key;
  PetscInt *nodes, *group, *cell, *place, n = 0, all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(m->n_facets, &key, m->n_facets * m->nf, &nodes, m->n_facets, &group, m->n_facets, &cell,
                         m->n_facets, &place));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf, e = m->facet_cell[f];
    PetscInt least = node[0]; /* a facet belongs to the rank of its node with the smallest tag */

    for (PetscInt v = 1; v < m->nf; v++) least = PetscMin(least, node[v]);
    /* Each facet on exactly one rank: overlap cells bring it to several. */
    if (HycoMeshOwned(m, least) < 0) continue;
    for (PetscInt v = 0; v < m->nf; v++) nodes[n * m->nf + v] = m->node_whole ? m->node_whole[node[v]] : node[v];
    group[n] = m->facet_group[f];
    cell[n] = m->cell_whole ? m->cell_whole[e] : e;
    /* Group, then cell, then facet of the cell: an order that no partition changes. */
    key[n] = ((PetscInt64)group[n] * n_cells + cell[n]) * 8 + HycoMeshFacetNumber(m, f);
    n++;
  }
  PetscCall(HycoRankKeys(comm, n, key, place, &all));
  PetscCall(WritePlaced(comm, h, IN("facets"), all, m->nf, n, place, nodes));
  PetscCall(WritePlaced(comm, h, IN("facet_group"), all, 1, n, place, group));
  PetscCall(WritePlaced(comm, h, IN("facet_cell"), all, 1, n, place, cell));
  PetscCall(PetscFree5(key, nodes, group, cell, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the small datasets. On one process. */
static PetscErrorCode WriteHead(HycoH5 h, HycoMesh m)
{
  PetscInt head[2] = {(PetscInt)m->type, m->dim};

  PetscFunctionBegin;
  PetscCall(HycoH5WriteInt(h, IN("head"), 2, 1, head));
  PetscCall(HycoH5WriteInt(h, IN("group_dim"), m->n_groups, 1, m->group_dim));
  PetscCall(HycoMeshMoveGroupNames(h, IN("group_name"), m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the first l columns of V, row by row. Collective. */
static PetscErrorCode WriteModes(HycoH5 h, PetscInt l, Mat V)
{
  PetscInt all, first, last, lda;
  const PetscScalar *v;
  PetscReal *rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(V, &all, NULL));
  PetscCall(MatGetOwnershipRange(V, &first, &last));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(PetscMalloc1((size_t)(last - first) * (size_t)l, &rows));
  PetscCall(MatDenseGetArrayRead(V, &v));
  for (PetscInt i = 0; i < last - first; i++) {
    /* The file has the modes of one unknown together, as predictions read them; PETSc's dense matrix lies by
       columns. */
    for (PetscInt j = 0; j < l; j++) rows[(size_t)i * (size_t)l + (size_t)j] = v[(size_t)j * (size_t)lda + (size_t)i];
  }
  PetscCall(MatDenseRestoreArrayRead(V, &v));
  HycoFinally(HycoH5WriteRows(h, IN("V"), MPIU_REAL, all, l, first, last - first, rows), PetscCall(PetscFree(rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Groups and facets are sorted by keys, fields by the file's order: the bytes do not depend on the partition. */
PetscErrorCode HycoROMWriteWhole(HycoH5 h, HycoFOM f, PetscInt l, Mat V)
{
  HycoMesh m = f->part;
  const HycoFileOrder *order;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  /* Small data once, from rank 0; the rest by rows of all ranks. */
  HycoOnRoot(HycoComm(f), WriteHead(h, m));
  PetscCall(HycoFieldsWriteMesh(h, "whole", order, m, m->xyz, PETSC_FALSE));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, IN("node_body"), HYCO_ON_NODES, MPIU_INT, 1, 1, m->node_body));
  PetscCall(HycoFieldWrite(h, order, m->n_cells, IN("cell_body"), HYCO_ON_CELLS, MPIU_INT, 1, 1, m->cell_body));
  PetscCall(WriteGroupNodes(HycoComm(f), h, m, f->n_nodes));
  PetscCall(WriteGroupCells(f, h));
  PetscCall(WriteFacets(HycoComm(f), h, m, f->n_cells));
  PetscCall(WriteModes(h, l, V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells of groups that are no bodies; older files have none. */
static PetscErrorCode LoadGroupCells(HycoH5 h, HycoMesh m)
{
  PetscFunctionBegin;
  if (!HycoH5Has(h, IN("group_cell"))) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&m->group_cell_start, &m->group_cell);
  PetscCall(HycoH5Starts(h, IN("group_cell_start"), m->n_groups, &m->group_cell_start));
  PetscCall(HycoH5Int(h, IN("group_cell"), 0, m->n_cells - 1, &m->group_cell_start[m->n_groups], 1, &m->group_cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the whole mesh and the modes on it; the contacts get its numbers of nodes. */
static PetscErrorCode LoadWholeMesh(HycoH5 h, HycoModel m, HycoMesh *whole)
{
  PetscInt n_dof;

  PetscFunctionBegin;
  PetscCall(HycoMeshMove(h, "whole", m->scene->n_bodies, whole));
  PetscCall(LoadGroupCells(h, *whole));
  PetscCall(HycoMeshSetTies(*whole, m->mesh->ties));
  PetscCall(HycoMeshCreateDM(m->scene, *whole));
  n_dof = (*whole)->n_nodes * (*whole)->dim;
  PetscCall(HycoH5Real(h, "whole/V", &n_dof, m->l, &m->V_whole));
  /* The two parts of a file may come from different writes after damage. */
  HycoCheck((*whole)->n_nodes == m->whole_nodes && (*whole)->n_cells == m->whole_cells, "%s: the whole mesh is damaged",
            m->path);
  PetscCall(HycoPairsRenumber(&m->pairs, m->mesh->node_whole, &m->whole_pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens the whole-mesh part in the file or image of the model: all of it, or nothing, so that the next attempt starts
   anew. */
static PetscErrorCode OpenWhole(HycoModel m)
{
  HycoMesh whole = NULL;
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (m->whole) PetscFunctionReturn(PETSC_SUCCESS);
  /* Before training has written the file there is none to read from. */
  PetscCheck(m->path[0], PETSC_COMM_SELF, PETSC_ERR_PLIB, "a model in training has no whole mesh");
  PetscCall(HycoH5OpenOr(m->path, "train the model again", &h));
  ierr = LoadWholeMesh(h, m, &whole);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  if (!ierr) {
    m->whole = whole;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (whole) PetscCall(HycoMeshDestroy(&whole));
  PetscCall(PetscFree(m->V_whole));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of this handle; the mesh and its modes belong to the model that clones share. */
PetscErrorCode HycoROMFreeWhole(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoFEDestroy(&m->fe_whole));
  PetscCall(HycoROMDropPairs(&m->whole_pairs));
  PetscCall(PetscFree(m->U_whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Per handle an fe and U; the mesh is read by the first that asks. */
PetscErrorCode HycoROMLoadWhole(HycoROM m)
{
  PetscFunctionBegin;
  if (m->U_whole) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(OpenWhole(m->model));
  PetscCall(HycoROMFreeWhole(m)); /* what a failed attempt has left */
  PetscCall(HycoROMTakePairs(&m->model->whole_pairs, &m->whole_pairs));
  m->whole_pairs.shear = m->pairs.shear;
  PetscCall(HycoFECreate(m->model->scene, m->model->whole->dm, &m->fe_whole));
  PetscCall(PetscMalloc1((size_t)m->model->whole->n_nodes * (size_t)m->model->whole->dim, &m->U_whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}
