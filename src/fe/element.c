/* Shape functions and quadrature of the cells, tabulated once. */
#include <hycofe.h>

static HycoElement table[HYCO_N_CELL_TYPES], point, line3;
static HycoElement line3_nodes, tri6_nodes, quad9_nodes; /* quadrature points at the nodes, of weight 1 */
static PetscBool ready = PETSC_FALSE;

static const PetscReal corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                       {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

/* Products of linear functions on [-1, 1]^dim with two Gauss points in each direction. Two points integrate the
   stiffness of a parallelogram or parallelepiped exactly. */
static void ElementTensor(HycoElement *e, PetscInt dim)
{
  const PetscReal g = 1 / PetscSqrtReal(3.0);

  e->dim = dim;
  e->nv = e->nq = 1 << dim;
  for (PetscInt q = 0; q < e->nq; q++) {
    e->w[q] = 1;
    for (PetscInt a = 0; a < e->nv; a++) {
      PetscReal f[3];

      for (PetscInt c = 0; c < dim; c++) f[c] = (1 + corner[a][c] * g * corner[q][c]) / 2;
      e->N[q][a] = 1;
      for (PetscInt c = 0; c < dim; c++) {
        e->N[q][a] *= f[c];
        e->dN[q][a][c] = corner[a][c] / 2;
        /* The slope along c times the values along the others. */
        for (PetscInt d = 0; d < dim; d++) e->dN[q][a][c] *= d == c ? 1 : f[d];
      }
    }
  }
}

/* Barycentric functions on the unit simplex; points of degree 2 on the lines from the centre to the corners. */
static void ElementSimplex(HycoElement *e, PetscInt dim)
{
  /* Barycentric coordinates of the points: one near its corner, the others far from theirs. */
  const PetscReal near = dim == 2 ? 2.0 / 3 : 0.58541019662496845446, far = dim == 2 ? 1.0 / 6 : 0.13819660112501051518;

  e->dim = dim;
  e->nv = e->nq = dim + 1;
  for (PetscInt q = 0; q < e->nq; q++) {
    e->w[q] = (dim == 2 ? 1.0 / 2 : 1.0 / 6) / e->nq;
    for (PetscInt a = 0; a < e->nv; a++) {
      e->N[q][a] = a == q ? near : far;
      for (PetscInt c = 0; c < dim; c++) e->dN[q][a][c] = a == 0 ? -1 : (a == c + 1);
    }
  }
}

/* Quadratic functions of one coordinate on [-1, 1]: 1 at `at` (-1, 0 or 1), 0 at the other two. */
static PetscReal ElementQuadratic(PetscInt at, PetscReal x)
{
  return at ? x * (x + at) / 2 : 1 - x * x;
}

/* The derivative of ElementQuadratic(). */
static PetscReal QuadraticDerivative(PetscInt at, PetscReal x)
{
  return at ? x + at / 2.0 : -2 * x;
}

/* Three Gauss points. */
static const PetscReal gauss[3] = {-0.77459666924148337704, 0, 0.77459666924148337704},
                       gauss_weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
/* Nodes of lines and quadrilaterals in gmsh's order. */
static const PetscInt node3[3] = {-1, 1, 0};
static const PetscInt node9[9][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}, {0, 0}};

/* Functions of a line: the ends, the middle. */
static void LineAt(PetscReal x, PetscReal N[], PetscReal dN[][3])
{
  for (PetscInt a = 0; a < 3; a++) {
    N[a] = ElementQuadratic(node3[a], x);
    dN[a][0] = QuadraticDerivative(node3[a], x);
  }
}

/* Tabulated at the Gauss points, or with unit weights at the nodes, which gives nodal normals. */
static void ElementLine3(HycoElement *e, PetscBool at_nodes)
{
  e->dim = 1;
  e->nv = e->nq = 3;
  for (PetscInt q = 0; q < 3; q++) {
    e->w[q] = at_nodes ? 1 : gauss_weight[q];
    LineAt(at_nodes ? node3[q] : gauss[q], e->N[q], e->dN[q]);
  }
}

/* Products of quadratic functions. With eight nodes (serendipity), the functions of the corners and the sides
   include the middle's, in proportion to their values there. */
static void QuadAt(PetscInt nv, PetscReal x, PetscReal y, PetscReal N[], PetscReal dN[][3])
{
  /* The middle's function and its slopes. */
  const PetscReal f[3] = {(1 - x * x) * (1 - y * y), -2 * x * (1 - y * y), -2 * y * (1 - x * x)};

  for (PetscInt a = 0; a < nv; a++) {
    const PetscInt i = node9[a][0], j = node9[a][1];
    const PetscReal share = nv == 9 ? 0 : a < 4 ? -1.0 / 4 : 1.0 / 2; /* share of the middle's function in a quad8 */

    N[a] = ElementQuadratic(i, x) * ElementQuadratic(j, y) + share * f[0];
    dN[a][0] = QuadraticDerivative(i, x) * ElementQuadratic(j, y) + share * f[1];
    dN[a][1] = ElementQuadratic(i, x) * QuadraticDerivative(j, y) + share * f[2];
  }
}

/* Quad8 and quad9 share their first eight nodes in gmsh's order. Three by three points, with which the mass of quad9 is
   exact as well; at_nodes: the functions at the nodes themselves. */
static void ElementQuad(HycoElement *e, PetscInt nv, PetscBool at_nodes)
{
  e->dim = 2;
  e->nv = nv;
  e->nq = 9;
  for (PetscInt q = 0; q < 9; q++) {
    e->w[q] = at_nodes ? 1 : gauss_weight[q % 3] * gauss_weight[q / 3];
    QuadAt(nv, at_nodes ? node9[q][0] : gauss[q % 3], at_nodes ? node9[q][1] : gauss[q / 3], e->N[q], e->dN[q]);
  }
}

/* The ends of a simplex's sides, of a triangle the first three. */
static const PetscInt side[6][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}};

/* Functions of a quadratic simplex of nv nodes at the point with barycentric coordinates L: L_a (2 L_a - 1) for
   corners, 4 L_a L_b for sides. side[]: the two corners of each side, in gmsh's order. */
static void SimplexAt(PetscInt dim, PetscInt nv, const PetscReal L[4], PetscReal N[], PetscReal dN[][3])
{
  static const PetscReal slope[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  for (PetscInt a = 0; a <= dim; a++) {
    N[a] = L[a] * (2 * L[a] - 1);
    for (PetscInt c = 0; c < dim; c++) dN[a][c] = (4 * L[a] - 1) * slope[a][c];
  }
  for (PetscInt k = 0; k < nv - dim - 1; k++) {
    const PetscInt a = side[k][0], b = side[k][1], at = dim + 1 + k;

    N[at] = 4 * L[a] * L[b];
    for (PetscInt c = 0; c < dim; c++) dN[at][c] = 4 * (slope[a][c] * L[b] + L[a] * slope[b][c]);
  }
}

/* Six points of degree 4 (G. R. Cowper, Int. J. Numer. Meth. Engng 7 (1973) 405-408). */
static void ElementTri6(HycoElement *e, PetscBool at_nodes)
{
  static const PetscReal near[2] = {0.816847572980458513080857, 0.108103018168070227363429},
                         weight[2] = {0.109951743655321867638326, 0.223381589678011465695007};

  e->dim = 2;
  e->nv = e->nq = 6;
  for (PetscInt q = 0; q < 6; q++) {
    PetscReal L[4] = {0};

    for (PetscInt a = 0; a < 3; a++) {
      /* Values at the nodes themselves, for gaps and normals there. */
      if (at_nodes)
        L[a] = q < 3 ? a == q : a == side[q - 3][0] || a == side[q - 3][1] ? 0.5 : 0;
      else
        L[a] = a == q % 3 ? near[q / 3] : (1 - near[q / 3]) / 2;
    }
    e->w[q] = at_nodes ? 1 : weight[q / 3] / 2;
    SimplexAt(2, 6, L, e->N[q], e->dN[q]);
  }
}

/* Fourteen points of degree 5, weights positive (N. J. Walkington, Quadrature on simplices of arbitrary dimension,
   Carnegie Mellon University (2000)): two orbits of four, one of six. */
static void ElementTet10(HycoElement *e)
{
  static const PetscReal far[2] = {0.310885919263300609797, 0.0927352503108912264023},
                         weight[3] = {0.112687925718015850799, 0.0734930431163619495437, 0.0425460207770814664381},
                         pair = 0.0455037041256496494919;

  e->dim = 3;
  e->nv = 10;
  e->nq = 14;
  for (PetscInt q = 0; q < 14; q++) {
    const PetscInt orbit = PetscMin(q / 4, 2);
    PetscReal L[4];

    for (PetscInt a = 0; a < 4; a++) {
      if (orbit < 2)
        L[a] = a == q % 4 ? 1 - 3 * far[orbit] : far[orbit];
      else
        L[a] = a == side[q - 8][0] || a == side[q - 8][1] ? pair : 0.5 - pair;
    }
    e->w[q] = weight[orbit] / 6;
    SimplexAt(3, 10, L, e->N[q], e->dN[q]);
  }
}

/* Nodes of hexahedra in gmsh's order: corners, edges, faces, the middle. */
static const PetscInt node27[27][3] = {
    {-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1},  {-1, 1, 1}, {0, -1, -1},
    {-1, 0, -1},  {-1, -1, 0}, {1, 0, -1}, {1, -1, 0},  {0, 1, -1},  {1, 1, 0},  {-1, 1, 0}, {0, -1, 1}, {-1, 0, 1},
    {1, 0, 1},    {0, 1, 1},   {0, 0, -1}, {0, -1, 0},  {-1, 0, 0},  {1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {0, 0, 0}};

/* Function of the node at r (serendipity): products, for corners times r.x - 2. */
static void SerendipityAt(const PetscInt r[3], const PetscReal x[3], PetscReal *N, PetscReal dN[3])
{
  const PetscBool at_corner = (PetscBool)(r[0] && r[1] && r[2]);
  PetscReal f[3], slope[3], sum = at_corner ? -2 : 1;

  for (PetscInt c = 0; c < 3; c++) {
    f[c] = r[c] ? (1 + r[c] * x[c]) / 2 : 1 - x[c] * x[c];
    slope[c] = r[c] ? r[c] / 2.0 : -2 * x[c];
    if (at_corner) sum += r[c] * x[c];
  }
  *N = f[0] * f[1] * f[2] * sum;
  for (PetscInt c = 0; c < 3; c++) {
    const PetscReal others = f[(c + 1) % 3] * f[(c + 2) % 3];

    dN[c] = slope[c] * others * sum + (at_corner ? f[c] * others * r[c] : 0);
  }
}

/* Function of the node at r: products of quadratic functions. */
static void ProductAt(const PetscInt r[3], const PetscReal x[3], PetscReal *N, PetscReal dN[3])
{
  PetscReal f[3];

  for (PetscInt c = 0; c < 3; c++) f[c] = ElementQuadratic(r[c], x[c]);
  *N = f[0] * f[1] * f[2];
  for (PetscInt c = 0; c < 3; c++) dN[c] = QuadraticDerivative(r[c], x[c]) * f[(c + 1) % 3] * f[(c + 2) % 3];
}

/* 27 Gauss points for both: either kind has terms of degree 2 in each coordinate. */
static void ElementHex(HycoElement *e, PetscInt nv)
{
  e->dim = 3;
  e->nv = nv;
  e->nq = 27;
  for (PetscInt q = 0; q < 27; q++) {
    /* The first coordinate runs fastest. */
    const PetscInt at[3] = {q % 3, q / 3 % 3, q / 9};
    const PetscReal x[3] = {gauss[at[0]], gauss[at[1]], gauss[at[2]]};

    e->w[q] = gauss_weight[at[0]] * gauss_weight[at[1]] * gauss_weight[at[2]];
    for (PetscInt a = 0; a < nv; a++) (nv == 20 ? SerendipityAt : ProductAt)(node27[a], x, &e->N[q][a], e->dN[q][a]);
  }
}

/* At the first use; constant afterwards. */
static void ElementTabulate(void)
{
  ElementTensor(&table[HYCO_LINE2], 1);
  ElementTensor(&table[HYCO_QUAD4], 2);
  ElementTensor(&table[HYCO_HEX8], 3);
  ElementSimplex(&table[HYCO_TRI3], 2);
  ElementSimplex(&table[HYCO_TET4], 3);
  ElementTri6(&table[HYCO_TRI6], PETSC_FALSE);
  ElementQuad(&table[HYCO_QUAD8], 8, PETSC_FALSE);
  ElementQuad(&table[HYCO_QUAD9], 9, PETSC_FALSE);
  ElementTet10(&table[HYCO_TET10]);
  ElementHex(&table[HYCO_HEX20], 20);
  ElementHex(&table[HYCO_HEX27], 27);
  ElementLine3(&line3, PETSC_FALSE);
  ElementLine3(&line3_nodes, PETSC_TRUE);
  ElementTri6(&tri6_nodes, PETSC_TRUE);
  ElementQuad(&quad9_nodes, 9, PETSC_TRUE);
  /* A facet of a line: its area is 1. */
  point.nv = point.nq = 1;
  point.w[0] = point.N[0][0] = 1;
  ready = PETSC_TRUE;
}

/* Valid for the process's life. The tables are made by the first call, which must not come from two threads at once. */
const HycoElement *HycoElementGet(HycoCellType type)
{
  if (!ready) ElementTabulate();
  return &table[type];
}

/* The element of a cell's facets; in 1D a point of weight 1. Facets of pyramids and prisms are quadrilaterals, of which
   triangles repeat a node. */
const HycoElement *HycoElementGetFacet(HycoCellType type)
{
  if (!ready) ElementTabulate();
  switch (type) {
  case HYCO_LINE2:
    return &point;
  case HYCO_TRI3:
  case HYCO_QUAD4:
    return &table[HYCO_LINE2];
  case HYCO_TRI6:
  case HYCO_QUAD8:
  case HYCO_QUAD9:
    return &line3;
  case HYCO_TET4:
    return &table[HYCO_TRI3];
  case HYCO_TET10:
    return &table[HYCO_TRI6];
  case HYCO_HEX20:
    return &table[HYCO_QUAD8];
  case HYCO_HEX27:
    return &table[HYCO_QUAD9];
  default:
    return &table[HYCO_QUAD4];
  }
}

/* The facet's functions and slopes at its own nodes, for normals at carriers; NULL where contacts use the integral
   instead. First-order facets have one normal, or are averaged by area. */
const HycoElement *HycoElementGetFacetNodes(HycoCellType type)
{
  if (!ready) ElementTabulate();
  switch (type) {
  case HYCO_TET10:
    return &tri6_nodes;
  case HYCO_HEX27:
    return &quad9_nodes;
  default:
    return HycoCellKinds[type].dim == 2 && HycoCellKinds[type].quadratic ? &line3_nodes : NULL;
  }
}

/* Functions and slopes of a second-order facet (nf 3, 6, 8 or 9) at local coordinates, for projections onto curved
   surfaces. */
void HycoFacetFunctions(PetscInt nf, const PetscReal at[2], PetscReal N[HYCO_FACET_NODES],
                        PetscReal dN[HYCO_FACET_NODES][3])
{
  if (nf == 3) {
    LineAt(at[0], N, dN);
  } else if (nf == 6) {
    const PetscReal L[4] = {1 - at[0] - at[1], at[0], at[1], 0};

    SimplexAt(2, nf, L, N, dN);
  } else
    QuadAt(nf, at[0], at[1], N, dN);
}
