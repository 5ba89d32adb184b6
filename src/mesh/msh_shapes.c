/* Groups of a mesh file with cells of several shapes. */
#include "msh.h"

/* HYCO_N_CELL_TYPES: none of these. Also for facets: dimension and number of nodes determine the type. */
HycoCellType HycoMshType(int dim, PetscInt nv)
{
  int t = 0;

  while (t < HYCO_N_CELL_TYPES && (HycoCellKinds[t].dim != dim || HycoCellKinds[t].nv != nv)) t++;
  return (HycoCellType)t;
}

/* Elements of the group as collapsed ones of nv nodes; the room is kept. */
PetscErrorCode HycoMshWiden(HycoMshGroup *g, PetscInt nv)
{
  const HycoCellType shape = HycoMshType(g->dim, g->nv);
  PetscInt *node;

  PetscFunctionBegin;
  if (nv == g->nv) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(g->room * nv, &node));
  for (PetscInt e = 0; e < g->n; e++) {
    PetscCall(PetscArraycpy(node + e * nv, g->node + e * g->nv, g->nv));
    /* Repeats nodes, as a triangle (0, 1, 2, 2). */
    HycoShapeWiden(shape, nv, node + e * nv);
  }
  PetscCall(PetscFree(g->node));
  g->node = node;
  g->nv = nv;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quad4 or hex8 with repeated nodes -> gmsh's type of the smaller cell, with its nodes in node[]; 0 if the
   repetition is no known collapse. Files of other programs store prisms and triangles in this form. */
int HycoMshReduce(long long type, PetscInt node[])
{
  const PetscInt nv = type == 3 ? 4 : 8;
  HycoCellType shape = HYCO_TRI3;
  PetscInt own[8], wide[8], n = 0;

  if (type != 3 && type != 5) return 0;
  /* Read from places that the caller's file may fill otherwise, so that the result is only a guess until it is
     checked below. */
  if (type == 5) shape = HycoShapeOf(HYCO_HEX8, node);
  for (PetscInt v = 0; v < nv; v++) {
    /* Cyclic: in a quadrilateral the repeated pair may be the last and the first. */
    if (node[v] != node[(v + nv - 1) % nv]) own[n++] = node[v];
  }
  if (n != HycoCellKinds[shape].nv) return 0;
  for (PetscInt v = 0; v < n; v++) {
    for (PetscInt w = 0; w < v; w++) {
      if (own[w] == own[v]) return 0;
    }
    wide[v] = own[v];
  }
  HycoShapeWiden(shape, nv, wide);
  /* The widened cell must reproduce the input: another pattern of repetitions has the same number of nodes. */
  for (PetscInt v = 0; v < nv && type == 5; v++) {
    if (wide[v] != node[v]) return 0;
  }
  for (PetscInt v = 0; v < n; v++) node[v] = own[v];
  return shape == HYCO_TRI3 ? 2 : shape == HYCO_TET4 ? 4 : shape == HYCO_PRISM6 ? 6 : 7;
}
