/*
  Converts hex20 to hex27: adds a node at the middle of each face and of each cell, at the position that the functions
  of quad8 and hex20 give. The triquadratic functions include the serendipity ones, so that bodies keep their shape.
*/
#include "plex.h"
#include "msh.h"
#include <stdlib.h>

#define CORNERS 8
#define MIDDLE  6  /* in place of a face's number: the cell */
#define ITSELF  -1 /* in place of a face's number: the quad8 */

/* A node to be created: the corners around it, of a face (4) or a cell (8), ascending, then -1; the element that
   needs it, and for which of its faces. */
typedef struct {
  PetscInt corner[CORNERS], group, element, face;
} Wanted;

/* Orders by corners first, so that all requests for one position are contiguous whatever element makes them;
   group, element and face only make the order total, as qsort() is not stable. */
static int FaceNodesCompare(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a, *q = (const PetscInt *)b; /* all members of Wanted are PetscInt */

  for (size_t k = 0; k < sizeof(Wanted) / sizeof(PetscInt); k++) {
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  }
  return 0;
}

/* Two requests for the same new node: that of a face comes from both of its cells, and from the facet of a group. */
static PetscBool AreOne(const Wanted *a, const Wanted *b)
{
  for (int k = 0; k < CORNERS; k++) {
    if (a->corner[k] != b->corner[k]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The nodes that determine the new node's position: n corners, then *n_sides middles of sides. */
static PetscInt FaceNodesAround(const HycoMsh *mesh, const Wanted *w, PetscInt node[20], PetscInt *n_sides)
{
  const HycoMshGroup *g = &mesh->group[w->group];
  const PetscInt *of = g->node + w->element * g->nv, n = w->face == MIDDLE ? 8 : 4;

  /* A hex20 has its 8 corners and 12 middles of edges in this order, a quad8 its 4 and 4; a face lists its own in
     the same way. */
  *n_sides = w->face == MIDDLE ? 12 : 4;
  for (PetscInt k = 0; k < n + *n_sides; k++)
    node[k] = of[w->face == MIDDLE || w->face == ITSELF ? k : HycoFacetNodes(HYCO_HEX20, w->face)[k]];
  return n;
}

/* Whether a group has such elements; how many nodes each needs. */
static PetscInt FaceNodesNeeded(const HycoMshGroup *g)
{
  return g->dim == 3 && g->nv == 20 ? 7 : g->dim == 2 && g->nv == 8 ? 1 : 0;
}

/* All of them; those at one position are contiguous. The caller frees them. */
static PetscErrorCode FaceNodesCollect(const HycoMsh *mesh, PetscInt *n, Wanted **list)
{
  PetscInt room = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < mesh->n_groups; k++) room += mesh->group[k].n * FaceNodesNeeded(&mesh->group[k]);
  PetscCall(PetscMalloc1(room, list));
  *n = 0;
  for (PetscInt k = 0; k < mesh->n_groups; k++) {
    const PetscInt each = FaceNodesNeeded(&mesh->group[k]);

    for (PetscInt j = 0; j < mesh->group[k].n * each; j++) {
      Wanted *w = &(*list)[(*n)++];
      PetscInt node[20], n_sides, n_corners;

      w->group = k;
      w->element = j / each;
      /* A quadrilateral of the boundary is its own face; a hexahedron has six. */
      w->face = each == 1 ? ITSELF : j % each;
      n_corners = FaceNodesAround(mesh, w, node, &n_sides);
      for (PetscInt c = 0; c < CORNERS; c++) w->corner[c] = c < n_corners ? node[c] : -1;
      /* Sorted corners name the position, whichever element looks at it. */
      PetscCall(PetscSortInt(n_corners, w->corner));
    }
  }
  if (*n) qsort(*list, (size_t)*n, sizeof(Wanted), FaceNodesCompare);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The middle of a face or a cell by the serendipity functions. */
static void FaceNodesPosition(const HycoMsh *mesh, const Wanted *w, PetscReal x[3])
{
  PetscInt node[20], n_sides;
  const PetscInt n = FaceNodesAround(mesh, w, node, &n_sides);

  for (PetscInt c = 0; c < 3; c++) {
    x[c] = 0;
    /* Quad8 at its middle: corners -1/4, middles of sides 1/2. Hex20: corners -1/4, middles of edges 1/4. */
    for (PetscInt k = 0; k < n; k++) x[c] -= mesh->xyz[3 * node[k] + c] / 4;
    for (PetscInt k = n; k < n + n_sides; k++) x[c] += mesh->xyz[3 * node[k] + c] * 2 / n;
  }
}

/* Extends a group's elements by the nodes they need. */
static PetscErrorCode FaceNodesWiden(HycoMshGroup *g)
{
  const PetscInt nv = g->nv + FaceNodesNeeded(g);
  PetscInt *node;

  PetscFunctionBegin;
  if (nv == g->nv) PetscFunctionReturn(PETSC_SUCCESS);
  /* Old nodes keep their places; the new ones follow them, as in gmsh's order of hex27 and quad9. The caller fills
     them in. */
  PetscCall(PetscMalloc1(g->n * nv, &node));
  for (PetscInt e = 0; e < g->n; e++) PetscCall(PetscArraycpy(node + e * nv, g->node + e * g->nv, g->nv));
  PetscCall(PetscFree(g->node));
  g->node = node;
  g->nv = nv;
  g->room = g->n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to the file's tables one node for each face and cell of its hex20, tagged after the largest tag, in the
   order of the corners' indices: the tags thus depend on the file alone. Coordinates come from the old nodes,
   before groups are widened. One process. */
PetscErrorCode HycoMshAddFaceNodes(const char path[], HycoMsh *mesh)
{
  Wanted *list;
  PetscInt n = 0, added = 0, at = mesh->n_nodes;

  PetscFunctionBegin;
  PetscCall(FaceNodesCollect(mesh, &n, &list));
  for (PetscInt k = 0; k < n; k++) added += !k || !AreOne(&list[k], &list[k - 1]);
  /* Before anything is changed: PETSC_MAX_INT itself is a sentinel (AddNode() in msh.c). */
  if (at && mesh->tag[at - 1] >= PETSC_MAX_INT - 1 - added) {
    PetscCall(PetscFree(list));
    HycoFail("%s: the nodes that its hex20 cells need for contact would have tags beyond %lld; renumber the mesh", path,
             (long long)PETSC_MAX_INT - 1);
  }
  PetscCall(PetscRealloc((size_t)(at + added) * sizeof(*mesh->tag), &mesh->tag));
  PetscCall(PetscRealloc((size_t)(3 * (at + added)) * sizeof(*mesh->xyz), &mesh->xyz));
  for (PetscInt k = 0; k < n; k++) {
    if (k && AreOne(&list[k], &list[k - 1])) continue;
    FaceNodesPosition(mesh, &list[k], mesh->xyz + 3 * at);
    mesh->tag[at] = mesh->tag[at - 1] + 1;
    at++;
  }
  /* Not earlier: FaceNodesPosition() reads groups of the old width. */
  for (PetscInt k = 0; k < mesh->n_groups; k++) PetscCall(FaceNodesWiden(&mesh->group[k]));
  /* The second pass counts positions as the first one did, and so finds each new node's index. */
  at = mesh->n_nodes - 1;
  for (PetscInt k = 0; k < n; k++) {
    HycoMshGroup *g = &mesh->group[list[k].group];
    const PetscInt face = list[k].face;

    at += !k || !AreOne(&list[k], &list[k - 1]);
    g->node[list[k].element * g->nv + (face == ITSELF   ? 8
                                       : face == MIDDLE ? 26
                                                        : HycoFacetNodes(HYCO_HEX27, face)[8])] = at;
  }
  mesh->n_nodes += added;
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}
