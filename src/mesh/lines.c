/*
  A line in space: a group of nodes of dimension 1. Its segments are the edges of cells between two nodes of the group;
  a mesh keeps no others. Where an edge cuts a corner of the line, which can be with tetrahedra, that is refused.
*/
#include <hycomesh.h>
#include <stdlib.h>

/* Whether corners a < b of a cell are the ends of an edge. */
static PetscBool IsEdge(HycoCellType type, PetscInt a, PetscInt b)
{
  if (type == HYCO_TET4) return PETSC_TRUE;
  if (a < 4 && b >= 4) return (PetscBool)(b == a + 4);
  return (PetscBool)(b - a == 1 || b - a == 3);
}

/* A segment as one number, and back. */
static PetscInt64 Key(HycoMesh m, PetscInt a, PetscInt b)
{
  return (PetscInt64)PetscMin(a, b) * m->n_nodes + PetscMax(a, b);
}

static int Ascending(const void *a, const void *b)
{
  const PetscInt64 x = *(const PetscInt64 *)a, y = *(const PetscInt64 *)b;

  return (x > y) - (x < y);
}

/* The keys of the segments, ascending, each once. */
static PetscErrorCode FindKeys(HycoMesh m, const PetscBool in[], PetscInt *n, PetscInt64 **key)
{
  PetscInt room = 0, count = 0;

  PetscFunctionBegin;
  *n = 0;
  *key = NULL;
  for (PetscInt k = 0; k < m->n_cells * m->nv * m->nv; k++) {
    const PetscInt *cell = m->cells + k / (m->nv * m->nv) * m->nv, a = k / m->nv % m->nv, b = k % m->nv;

    if (a >= b || !in[cell[a]] || !in[cell[b]] || !IsEdge(m->type, a, b)) continue;
    if (count == room) {
      room = 2 * room + 64;
      PetscCall(PetscRealloc((size_t)room * sizeof(**key), key));
    }
    (*key)[count++] = Key(m, cell[a], cell[b]);
  }
  if (count) qsort(*key, (size_t)count, sizeof(**key), Ascending);
  for (PetscInt k = 0; k < count; k++) {
    if (!k || (*key)[k] != (*key)[k - 1]) (*key)[(*n)++] = (*key)[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No node of this process's own has more than two segments, or two that a third closes to a triangle. */
static PetscErrorCode CheckPath(HycoMesh m, PetscInt group, PetscInt n, const PetscInt64 key[], PetscInt next[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < 2 * m->n_nodes; i++) next[i] = -1;
  for (PetscInt k = 0; k < 2 * n; k++) {
    const PetscInt ends[2] = {(PetscInt)(key[k / 2] / m->n_nodes), (PetscInt)(key[k / 2] % m->n_nodes)};
    const PetscInt i = ends[k % 2], other = ends[1 - k % 2], place = next[2 * i] < 0 ? 0 : next[2 * i + 1] < 0 ? 1 : 2;

    HycoCheck(
        place < 2 || HycoMeshOwned(m, i) < 0,
        "the force on %s: more than two edges of the mesh between nodes of that group meet at node %d; give a line "
        "without branches, and cells that do not cut its corners",
        m->group_name[group], (int)m->node_id[i]);
    if (place < 2) next[2 * i + place] = other;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt a = next[2 * i], b = next[2 * i + 1];

    HycoCheck(a < 0 || b < 0 || HycoMeshOwned(m, i) < 0 || (next[2 * a] != b && next[2 * a + 1] != b),
              "the force on %s: a cell cuts the corner of the line at node %d; refine the mesh there",
              m->group_name[group], (int)m->node_id[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshLine(HycoMesh m, PetscInt group, PetscInt *n, PetscInt **segment)
{
  PetscBool *in;
  PetscInt *next;
  PetscInt64 *key;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &in));
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) in[m->group_node[k]] = PETSC_TRUE;
  PetscCall(FindKeys(m, in, n, &key));
  PetscCall(PetscFree(in));
  PetscCall(PetscMalloc1(2 * m->n_nodes, &next));
  ierr = CheckPath(m, group, *n, key, next);
  PetscCall(PetscFree(next));
  if (!ierr) ierr = PetscMalloc1(2 * *n, segment);
  for (PetscInt k = 0; k < *n && !ierr; k++) {
    (*segment)[2 * k] = (PetscInt)(key[k] / m->n_nodes);
    (*segment)[2 * k + 1] = (PetscInt)(key[k] % m->n_nodes);
  }
  PetscCall(PetscFree(key));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
