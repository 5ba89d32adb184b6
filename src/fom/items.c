/* Nodes and cells of all ranks, on rank 0 in the order of the mesh file's tags, whatever the ranks. */
#include <hycopath.h>
#include <stdlib.h>

static int ByTag(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a, y = *(const PetscInt *)b;

  return (x > y) - (x < y);
}

/* Rank 0's order of the items with these tags (by index of the part). Collective. */
static PetscErrorCode Arrange(HycoFOM f, const PetscInt tag[], HycoItems *items)
{
  PetscInt *mine, *all, *sorted;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(items->n, &mine));
  for (PetscInt k = 0; k < items->n; k++) mine[k] = tag[items->own[k]];
  PetscCall(HycoConcatenate(HycoComm(f), items->n, mine, MPIU_INT, sizeof(PetscInt), &items->n_all, &all));
  PetscCall(PetscFree(mine));
  PetscCall(PetscMalloc1(2 * items->n_all, &sorted));
  PetscCall(PetscMalloc1(items->n_all, &items->tag));
  PetscCall(PetscMalloc1(items->n_all, &items->place));
  for (PetscInt k = 0; k < items->n_all; k++) {
    sorted[2 * k] = all[k];
    sorted[2 * k + 1] = k;
  }
  if (items->n_all) qsort(sorted, (size_t)items->n_all, 2 * sizeof(*sorted), ByTag);
  for (PetscInt k = 0; k < items->n_all; k++) {
    items->tag[k] = sorted[2 * k];
    items->place[sorted[2 * k + 1]] = k;
  }
  PetscCall(PetscFree(sorted));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoItemsFind(const HycoItems *items, PetscInt tag)
{
  const PetscInt *at = (const PetscInt *)bsearch(&tag, items->tag, (size_t)items->n_all, sizeof(tag), ByTag);

  return at ? (PetscInt)(at - items->tag) : -1;
}

PetscErrorCode HycoItemsBring(HycoFOM f, const HycoItems *items, PetscInt cols, const PetscReal value[],
                              PetscReal **out)
{
  PetscReal *mine, *all;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(items->n * cols, &mine));
  for (PetscInt k = 0; k < items->n; k++) PetscCall(PetscArraycpy(mine + k * cols, value + items->own[k] * cols, cols));
  PetscCall(HycoConcatenate(HycoComm(f), items->n * cols, mine, MPIU_REAL, sizeof(PetscReal), &n, &all));
  PetscCall(PetscFree(mine));
  *out = NULL;
  if (f->rank == 0) PetscCall(PetscMalloc1(n, out));
  for (PetscInt k = 0; k < n / cols; k++) PetscCall(PetscArraycpy(*out + items->place[k] * cols, all + k * cols, cols));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoItemsCreate(HycoFOM f, HycoItems *node, HycoItems *cell)
{
  HycoMesh m = f->part;

  PetscFunctionBegin;
  node->n = cell->n = 0;
  PetscCall(PetscMalloc1(m->n_nodes, &node->own));
  PetscCall(PetscMalloc1(m->n_cells, &cell->own));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (HycoMeshOwned(f->part, i) >= 0) node->own[node->n++] = i;
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (HycoMeshOwned(f->part, m->cells[e * m->nv]) >= 0) cell->own[cell->n++] = e;
  }
  PetscCall(Arrange(f, m->node_id, node));
  PetscCall(Arrange(f, m->cell_id, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoItemsDestroy(HycoItems *items)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(items->own));
  PetscCall(PetscFree(items->tag));
  PetscCall(PetscFree(items->place));
  items->n = items->n_all = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
