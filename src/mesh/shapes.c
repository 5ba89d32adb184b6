/* Shapes of first-order cells, and collapsed cells. */
#include <hycomesh.h>

#define BIT(shape) ((PetscInt)1 << (shape))

/* A single type is its own; several of first order are collapsed ones of quad4 or hex8. HYCO_N_CELL_TYPES: these
   cannot be in one mesh. */
HycoCellType HycoShapesType(PetscInt shapes)
{
  static const PetscInt plane = BIT(HYCO_TRI3) | BIT(HYCO_QUAD4),
                        space = BIT(HYCO_TET4) | BIT(HYCO_PYRAMID5) | BIT(HYCO_PRISM6) | BIT(HYCO_HEX8);

  for (PetscInt t = 0; t < HYCO_N_MESH_TYPES; t++) {
    if (shapes == BIT(t)) return (HycoCellType)t;
  }
  return shapes && !(shapes & ~plane) ? HYCO_QUAD4 : shapes && !(shapes & ~space) ? HYCO_HEX8 : HYCO_N_CELL_TYPES;
}

/* The node of the smaller cell at each place of the wider one; none is after its place. */
static const signed char *ShapesPositions(HycoCellType shape)
{
  static const signed char triangle[4] = {0, 1, 2, 2}, tetrahedron[8] = {0, 1, 2, 2, 3, 3, 3, 3},
                           pyramid[8] = {0, 1, 2, 3, 4, 4, 4, 4}, prism[8] = {0, 1, 2, 2, 3, 4, 5, 5};

  switch (shape) {
  case HYCO_TRI3:
    return triangle;
  case HYCO_TET4:
    return tetrahedron;
  case HYCO_PYRAMID5:
    return pyramid;
  case HYCO_PRISM6:
    return prism;
  default:
    return NULL;
  }
}

/* From the last place to the first, so that the copy may be in place: no node moves to an earlier place. */
void HycoShapeWiden(HycoCellType shape, PetscInt nv, PetscInt node[])
{
  const signed char *places = HycoCellKinds[shape].nv < nv ? ShapesPositions(shape) : NULL;

  for (PetscInt k = nv - 1; places && k >= 0; k--) node[k] = node[places[k]];
}

/* Two comparisons identify the shape of a collapsed cell, as its repeated places are fixed. */
HycoCellType HycoShapeOf(HycoCellType type, const PetscInt node[])
{
  if (type == HYCO_QUAD4) return node[2] == node[3] ? HYCO_TRI3 : HYCO_QUAD4;
  if (type != HYCO_HEX8) return type;
  if (node[4] == node[5]) return node[2] == node[3] ? HYCO_TET4 : HYCO_PYRAMID5;
  return node[2] == node[3] ? HYCO_PRISM6 : HYCO_HEX8;
}
