/* Shape functions and quadrature of the cells, tabulated once. */
#include <hycofe.h>

static HycoElement table[HYCO_N_CELL_TYPES], point, line3;
static PetscBool ready = PETSC_FALSE;

static const PetscReal corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                       {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

/* Products of linear functions on [-1, 1]^dim with two Gauss points a direction. */
static void Tensor(HycoElement *e, PetscInt dim)
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
        for (PetscInt d = 0; d < dim; d++) e->dN[q][a][c] *= d == c ? 1 : f[d];
      }
    }
  }
}

/* Barycentric functions on the unit simplex; points of degree 2 on the lines from the centre to the corners. */
static void Simplex(HycoElement *e, PetscInt dim)
{
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
static PetscReal Quadratic(PetscInt at, PetscReal x)
{
  return at ? x * (x + at) / 2 : 1 - x * x;
}

static PetscReal QuadraticSlope(PetscInt at, PetscReal x)
{
  return at ? x + at / 2.0 : -2 * x;
}

/* Three Gauss points. */
static const PetscReal gauss[3] = {-0.77459666924148337704, 0, 0.77459666924148337704},
                       gauss_weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
/* Nodes of quadrilaterals in gmsh's order. */
static const PetscInt node9[9][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}, {0, 0}};

/* Nodes: the ends, the middle. */
static void Line3(HycoElement *e)
{
  static const PetscInt node[3] = {-1, 1, 0};

  e->dim = 1;
  e->nv = e->nq = 3;
  for (PetscInt q = 0; q < 3; q++) {
    e->w[q] = gauss_weight[q];
    for (PetscInt a = 0; a < 3; a++) {
      e->N[q][a] = Quadratic(node[a], gauss[q]);
      e->dN[q][a][0] = QuadraticSlope(node[a], gauss[q]);
    }
  }
}

/* Products of quadratic functions; of eight nodes (serendipity) the corners' and the sides' take in what the middle's
   is there, so that it is none. */
static void Quad(HycoElement *e, PetscInt nv)
{
  e->dim = 2;
  e->nv = nv;
  e->nq = 9;
  for (PetscInt q = 0; q < 9; q++) {
    const PetscReal x = gauss[q % 3], y = gauss[q / 3],
                    f[3] = {(1 - x * x) * (1 - y * y), -2 * x * (1 - y * y), -2 * y * (1 - x * x)};

    e->w[q] = gauss_weight[q % 3] * gauss_weight[q / 3];
    for (PetscInt a = 0; a < nv; a++) {
      const PetscInt i = node9[a][0], j = node9[a][1];
      const PetscReal share = nv == 9 ? 0 : a < 4 ? -1.0 / 4 : 1.0 / 2; /* the middle's value where a quad8 has none */

      e->N[q][a] = Quadratic(i, x) * Quadratic(j, y) + share * f[0];
      e->dN[q][a][0] = QuadraticSlope(i, x) * Quadratic(j, y) + share * f[1];
      e->dN[q][a][1] = Quadratic(i, x) * QuadraticSlope(j, y) + share * f[2];
    }
  }
}

/* Barycentric functions L_a (2 L_a - 1) of the corners, 4 L_a L_b of the sides; six points of degree 4 (G. R. Cowper,
   Int. J. Numer. Meth. Engng 7 (1973) 405-408). */
static void Tri6(HycoElement *e)
{
  static const PetscReal near[2] = {0.816847572980458513080857, 0.108103018168070227363429},
                         weight[2] = {0.109951743655321867638326, 0.223381589678011465695007},
                         slope[3][2] = {{-1, -1}, {1, 0}, {0, 1}};

  e->dim = 2;
  e->nv = e->nq = 6;
  for (PetscInt q = 0; q < 6; q++) {
    PetscReal L[3];

    for (PetscInt a = 0; a < 3; a++) L[a] = a == q % 3 ? near[q / 3] : (1 - near[q / 3]) / 2;
    e->w[q] = weight[q / 3] / 2;
    for (PetscInt a = 0; a < 3; a++) {
      const PetscInt b = (a + 1) % 3;

      e->N[q][a] = L[a] * (2 * L[a] - 1);
      e->N[q][3 + a] = 4 * L[a] * L[b];
      for (PetscInt c = 0; c < 2; c++) {
        e->dN[q][a][c] = (4 * L[a] - 1) * slope[a][c];
        e->dN[q][3 + a][c] = 4 * (slope[a][c] * L[b] + L[a] * slope[b][c]);
      }
    }
  }
}

static void Tabulate(void)
{
  Tensor(&table[HYCO_LINE2], 1);
  Tensor(&table[HYCO_QUAD4], 2);
  Tensor(&table[HYCO_HEX8], 3);
  Simplex(&table[HYCO_TRI3], 2);
  Simplex(&table[HYCO_TET4], 3);
  Tri6(&table[HYCO_TRI6]);
  Quad(&table[HYCO_QUAD8], 8);
  Quad(&table[HYCO_QUAD9], 9);
  Line3(&line3);
  point.nv = point.nq = 1;
  point.w[0] = point.N[0][0] = 1;
  ready = PETSC_TRUE;
}

const HycoElement *HycoElementGet(HycoCellType type)
{
  if (!ready) Tabulate();
  return &table[type];
}

const HycoElement *HycoElementGetFacet(HycoCellType type)
{
  if (!ready) Tabulate();
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
  default:
    return &table[HYCO_QUAD4];
  }
}
