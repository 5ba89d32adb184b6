/* Shape functions and quadrature of the first-order cells, tabulated once. */
#include <hycofe.h>

static HycoElement table[HYCO_N_CELL_TYPES], point;
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

static void Tabulate(void)
{
  Tensor(&table[HYCO_LINE2], 1);
  Tensor(&table[HYCO_QUAD4], 2);
  Tensor(&table[HYCO_HEX8], 3);
  Simplex(&table[HYCO_TRI3], 2);
  Simplex(&table[HYCO_TET4], 3);
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
  case HYCO_TET4:
    return &table[HYCO_TRI3];
  default:
    return &table[HYCO_QUAD4];
  }
}
