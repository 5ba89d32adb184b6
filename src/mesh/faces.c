/* The faces of cells. */
#include "plex.h"

/* Facets of a mesh's type; meshes of pyramids and prisms have the type hex8. */
static const PetscInt n_faces[HYCO_N_CELL_TYPES] = {2, 3, 4, 4, 6, 3, 4, 4, 4, 6, 6};
/* The nodes of a cell's facets, in gmsh's order of the cell's nodes. */
static const signed char face[HYCO_N_CELL_TYPES][6][HYCO_FACET_NODES] = {
    {{0}, {1}},
    {{0, 1}, {1, 2}, {2, 0}},
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
    {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
    {{0, 3, 2, 1}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}, {4, 5, 6, 7}},
    {{0, 1, 3}, {1, 2, 4}, {2, 0, 5}},
    {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}},
    {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}},
    {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 9, 7}, {0, 3, 2, 7, 8, 6}, {1, 2, 3, 5, 8, 9}},
    {{0, 3, 2, 1, 9, 13, 11, 8},
     {0, 1, 5, 4, 8, 12, 16, 10},
     {1, 2, 6, 5, 11, 14, 18, 12},
     {2, 3, 7, 6, 13, 15, 19, 14},
     {3, 0, 4, 7, 9, 10, 17, 15},
     {4, 5, 6, 7, 16, 18, 19, 17}},
    {{0, 3, 2, 1, 9, 13, 11, 8, 20},
     {0, 1, 5, 4, 8, 12, 16, 10, 21},
     {1, 2, 6, 5, 11, 14, 18, 12, 23},
     {2, 3, 7, 6, 13, 15, 19, 14, 24},
     {3, 0, 4, 7, 9, 10, 17, 15, 22},
     {4, 5, 6, 7, 16, 18, 19, 17, 25}}};

PetscInt HycoFacetCount(HycoCellType type)
{
  return n_faces[type];
}

const signed char *HycoFacetNodes(HycoCellType type, PetscInt number)
{
  return face[type][number];
}

/* Brings a collapsed quadrilateral to the form (a, b, c, c), with the same orientation. Others are left alone. */
void HycoFacetRepeatLast(PetscInt nf, PetscInt node[])
{
  PetscInt turned[4], k = 0;

  if (nf != 4) return;
  /* k: the first of the two equal places, which must become place 2; a rotation keeps the orientation. */
  while (k < 4 && node[k] != node[(k + 1) % 4]) k++;
  if (k == 4) return;
  for (PetscInt v = 0; v < 4; v++) turned[v] = node[(k + 2 + v) % 4];
  for (PetscInt v = 0; v < 4; v++) node[v] = turned[v];
}

/* Nodes of a facet in m->nf places; returns how many are different. The cell's repeated nodes appear in the facet
   too: 3 of 4 for a triangle, 1 or 2 for a facet that has collapsed to a point or an edge. */
PetscInt HycoMeshFace(HycoMesh m, PetscInt cell, PetscInt number, PetscInt node[])
{
  PetscInt n = 0;

  for (PetscInt v = 0; v < m->nf; v++) {
    PetscBool again = PETSC_FALSE;

    node[v] = m->cells[cell * m->nv + face[m->type][number][v]];
    /* Few nodes: comparing all pairs is cheaper than sorting. */
    for (PetscInt w = 0; w < v; w++) again = (PetscBool)(again || node[w] == node[v]);
    n += !again;
  }
  HycoFacetRepeatLast(m->nf, node);
  return n;
}

/* Whether each of n nodes is one of the others. */
static PetscBool AreAmong(PetscInt n, const PetscInt node[], const PetscInt other[])
{
  for (PetscInt v = 0; v < n; v++) {
    PetscBool here = PETSC_FALSE;

    for (PetscInt w = 0; w < n; w++) here = (PetscBool)(here || other[w] == node[v]);
    if (!here) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The facet of the cell with these nodes, as sets in both directions: in collapsed cells the number of entries
   does not distinguish a triangle from a quadrilateral. -1: none. */
PetscInt HycoCellFace(HycoMesh m, PetscInt cell, const PetscInt node[])
{
  for (PetscInt f = 0; f < n_faces[m->type]; f++) {
    PetscInt own[HYCO_FACET_NODES];

    (void)HycoMeshFace(m, cell, f, own);
    if (AreAmong(m->nf, node, own) && AreAmong(m->nf, own, node)) return f;
  }
  return -1;
}

/* Only for facets whose cell is in the mesh; FacetNumber() (submesh.c) serves the others. */
PetscInt HycoMeshFacetNumber(HycoMesh m, PetscInt facet)
{
  return HycoCellFace(m, m->facet_cell[facet], m->facets + facet * m->nf);
}
