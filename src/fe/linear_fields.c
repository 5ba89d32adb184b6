/*
  Fields of bodies whose laws are linear, isotropic and not of the element bbar, at displacements u: what
  HycoFELinearStress() and HycoFEStateFields() compute, in one pass and without the state of the points. It is a large
  part of a reduced path with friction.
*/
#include <hycoinelastic.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

/* Sums over the points of a cell: of stress, von Mises stress, energy density, each times the weight; and of the weights. */
typedef struct {
  PetscReal stress[6], mises, stored, volume;
} Sums;

/* Whether the pass serves all cells of fe. */
static PetscBool Serves(HycoFE fe)
{
  if (fe->dim == 1 || fe->formulation == HYCO_AXISYMMETRIC) return PETSC_FALSE;
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) {
    if (!fe->scene->body[b].law->linear || fe->bbar[b] || fe->tangent_size[b] != 2) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The strain at a point from the gradients g of the shape functions (nv x 3) and the displacements v of the nodes. */
static inline void Strain2(PetscInt nv, const PetscReal g[], const PetscReal v[], PetscReal strain[6])
{
  PetscReal xx = 0, yy = 0, xy = 0, yx = 0;

  for (PetscInt a = 0; a < nv; a++) {
    const PetscReal gx = g[3 * a], gy = g[3 * a + 1], u = v[2 * a], w = v[2 * a + 1];

    xx += u * gx;
    xy += u * gy;
    yx += w * gx;
    yy += w * gy;
  }
  strain[0] = xx;
  strain[1] = yy;
  /* Plane strain; other formulations are not served here. */
  strain[2] = 0;
  strain[3] = xy + yx;
}

/* Engineering shear strains, in the order xx yy zz xy yz xz. */
static inline void Strain3(PetscInt nv, const PetscReal g[], const PetscReal v[], PetscReal strain[6])
{
  PetscReal h[3][3] = {{0}};

  for (PetscInt a = 0; a < nv; a++) {
    for (PetscInt c = 0; c < 3; c++) {
      for (PetscInt d = 0; d < 3; d++) h[c][d] += v[3 * a + c] * g[3 * a + d];
    }
  }
  for (PetscInt c = 0; c < 3; c++) strain[c] = h[c][c];
  strain[3] = h[0][1] + h[1][0];
  strain[4] = h[1][2] + h[2][1];
  strain[5] = h[0][2] + h[2][0];
}

/* Adds a point of weight w; C: Lame's constants. Inlined for each number of components ns. */
static inline void AddPoint(PetscInt ns, PetscReal w, const PetscReal C[], PetscReal hot, PetscReal strain[6], Sums *s)
{
  PetscReal stress[6], stored = 0, mean, square = 0, volume;

  for (PetscInt c = 0; c < 3; c++) strain[c] -= hot;
  volume = C[0] * (strain[0] + strain[1] + strain[2]);
  for (PetscInt c = 0; c < 3; c++) stress[c] = volume + 2 * C[1] * strain[c];
  for (PetscInt c = 3; c < ns; c++) stress[c] = C[1] * strain[c];
  for (PetscInt c = 0; c < ns; c++) stored += stress[c] * strain[c];
  mean = (stress[0] + stress[1] + stress[2]) * (1. / 3);
  for (PetscInt c = 0; c < 3; c++) square += (stress[c] - mean) * (stress[c] - mean);
  for (PetscInt c = 3; c < ns; c++) square += 2 * stress[c] * stress[c];
  for (PetscInt c = 0; c < ns; c++) s->stress[c] += w * stress[c];
  /* The mean of the equivalent stresses, not that of the mean stress. */
  s->mises += w * PetscSqrtReal(1.5 * square);
  s->stored += w * stored / 2;
  s->volume += w;
}

/* All sums of a cell in one loop over its points. */
static inline void AddCell(PetscInt dim, HycoFE fe, const HycoElement *el, PetscInt e, const PetscReal v[], Sums *sums)
{
  Sums s = {.volume = 0};

  for (PetscInt q = 0; q < el->nq; q++) {
    const PetscReal *g = HycoKeptGradients(fe, el, e, q);
    PetscReal strain[6];

    if (dim == 2)
      Strain2(el->nv, g, v, strain);
    else
      Strain3(el->nv, g, v, strain);
    AddPoint(dim == 2 ? 4 : 6, g[3 * el->nv], fe->tangent + fe->tangent_start[e] + 2 * q,
             fe->thermal ? fe->thermal[e * el->nq + q] : 0, strain, &s);
  }
  *sums = s;
}

/* *served false: another law, bbar or an axisymmetric scene; the caller takes the general way. */
PetscErrorCode HycoFELinearFields(HycoFE fe, const PetscReal u[], PetscReal sigma[], PetscReal mises[],
                                  PetscReal *stored, PetscBool *served)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, ns = fe->n_sigma;

  PetscFunctionBegin;
  *served = Serves(fe);
  if (!*served) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEKeepGradients(fe));
  *stored = 0;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const PetscInt *node = fe->mesh->cells + e * el->nv;
    PetscReal v[HYCO_MAX_CELL_DOFS];
    Sums s;

    for (PetscInt a = 0; a < el->nv; a++) {
      for (PetscInt c = 0; c < dim; c++) v[a * dim + c] = u[node[a] * dim + c];
    }
    /* A constant dimension, so that the compiler unrolls the loops. */
    if (dim == 2)
      AddCell(2, fe, el, e, v, &s);
    else
      AddCell(3, fe, el, e, v, &s);
    for (PetscInt c = 0; c < ns; c++) sigma[e * ns + c] = s.stress[c] / s.volume;
    mises[e] = s.mises / s.volume;
    *stored += s.stored;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
