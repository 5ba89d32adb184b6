/*
  A line in space: a group of nodes of dimension 1. Its segments are the edges of cells between two nodes of the group,
  because a mesh stores no others. An edge that cuts a corner of the line (possible with tetrahedra) is refused.
*/
#include "plex.h"
#include <stdlib.h>

/* An edge: its ends as one number, its middle node if of second order (else -1). */
typedef struct {
  PetscInt64 key;
  PetscInt middle;
} Edge;

/* By keys alone: equal keys are the same edge, with the same middle node. */
static int LinesAscending(const void *a, const void *b)
{
  const PetscInt64 x = ((const Edge *)a)->key, y = ((const Edge *)b)->key;

  return (x > y) - (x < y);
}

/* The edge after corner k of a cell's face. */
static Edge EdgeOf(HycoMesh m, PetscInt cell, PetscInt number, PetscInt k)
{
  const PetscInt corners = HycoCellKinds[m->type].corners, *node = m->cells + cell * m->nv;
  const signed char *of = HycoFacetNodes(m->type, number);
  const PetscInt a = node[of[k]], b = node[of[(k + 1) % corners]];
  /* Both ends in one 64-bit key, smaller index first: edges are compared and sorted by one number. */
  const Edge edge = {(PetscInt64)PetscMin(a, b) * m->n_nodes + PetscMax(a, b),
                     HycoMeshIsQuadratic(m) ? node[of[corners + k]] : -1};

  return edge;
}

/* The edges with all nodes in the group, by ascending key, without repetition. A line load has no elements of its own
   in a 3D mesh: the edges are those of cells between nodes of the group. */
static PetscErrorCode FindEdges(HycoMesh m, const PetscBool in[], PetscInt *n, Edge **edge)
{
  /* Each edge of a cell occurs in two of its faces and in all cells around it; duplicates go after the sort. */
  const PetscInt corners = HycoCellKinds[m->type].corners, sides = HycoFacetCount(m->type) * corners;
  PetscInt room = 0, count = 0;

  PetscFunctionBegin;
  *n = 0;
  *edge = NULL;
  for (PetscInt k = 0; k < m->n_cells * sides; k++) {
    const Edge e = EdgeOf(m, k / sides, k % sides / corners, k % corners);

    if (e.key / m->n_nodes == e.key % m->n_nodes) continue; /* a side of a collapsed cell */
    if (!in[e.key / m->n_nodes] || !in[e.key % m->n_nodes] || (e.middle >= 0 && !in[e.middle])) continue;
    HycoGrow(count, room, *edge);
    (*edge)[count++] = e;
  }
  if (count) qsort(*edge, (size_t)count, sizeof(**edge), LinesAscending);
  for (PetscInt k = 0; k < count; k++) {
    if (!k || (*edge)[k].key != (*edge)[k - 1].key) (*edge)[(*n)++] = (*edge)[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that no node owned by this process has more than two segments, or two that a third closes to a triangle. The
   load per length would act on the wrong edges, without any other sign of it. */
static PetscErrorCode CheckPath(HycoMesh m, PetscInt group, PetscInt n, const Edge edge[], PetscInt next[])
{
  PetscFunctionBegin;
  /* next: two neighbours of each node along the line, -1: none. A node of another owner may lack cells here, and is
     checked there. */
  for (PetscInt i = 0; i < 2 * m->n_nodes; i++) next[i] = -1;
  for (PetscInt k = 0; k < 2 * n; k++) {
    const PetscInt ends[2] = {(PetscInt)(edge[k / 2].key / m->n_nodes), (PetscInt)(edge[k / 2].key % m->n_nodes)};
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

/* Segments (rows of 2 nodes, 3 of second order: ends, then the middle) of a group of dimension 1 in this process's
   part, by ascending key; the caller frees them. Not collective; branches are an error at the node's owner alone,
   who has all cells around it. */
PetscErrorCode HycoMeshLine(HycoMesh m, PetscInt group, PetscInt *n, PetscInt **segment)
{
  const PetscInt width = HycoMeshIsQuadratic(m) ? 3 : 2;
  PetscBool *in;
  PetscInt *next;
  Edge *edge;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &in));
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) in[m->group_node[k]] = PETSC_TRUE;
  PetscCall(FindEdges(m, in, n, &edge));
  PetscCall(PetscFree(in));
  PetscCall(PetscMalloc1(2 * m->n_nodes, &next));
  /* A branch has no direction in which a load per length could go on. */
  ierr = CheckPath(m, group, *n, edge, next);
  PetscCall(PetscFree(next));
  if (!ierr) ierr = PetscMalloc1(width * *n, segment);
  for (PetscInt k = 0; k < *n && !ierr; k++) {
    /* Both nodes of an edge were packed into one key to be sorted. */
    (*segment)[width * k] = (PetscInt)(edge[k].key / m->n_nodes);
    (*segment)[width * k + 1] = (PetscInt)(edge[k].key % m->n_nodes);
    if (width > 2) (*segment)[width * k + 2] = edge[k].middle;
  }
  PetscCall(PetscFree(edge));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
