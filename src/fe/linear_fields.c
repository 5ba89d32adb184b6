/*
  Fields of bodies whose laws are linear, isotropic and not of the element bbar, at displacements u: what
  HycoFELinearStress() and HycoFEStateFields() compute, in one pass and without the state of the points. It is a large
  part of a reduced path with friction.
*/
#include <hycoinelastic.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

/* Numbers of one kind of several cells, which follow each other; functions of them go into both clones of their
   caller. */
#if defined(__GNUC__)
#define LANES   4
#define INLINED static inline __attribute__((always_inline))
typedef PetscReal Lanes __attribute__((vector_size(LANES * sizeof(PetscReal)), aligned(sizeof(PetscReal)), may_alias));
#else
#define LANES   1
#define INLINED static inline
typedef PetscReal Lanes;
#endif

/* Sums over the points of the cells: of stress, von Mises stress, energy density, each times the weight; and of the
   weights. */
typedef struct {
  Lanes stress[6], mises, stored, volume;
} Sums;

/* Whether the pass serves all cells of fe. */
static PetscBool LinearFieldsIsUsable(HycoFE fe)
{
  if (fe->dim == 1 || fe->formulation == HYCO_AXISYMMETRIC) return PETSC_FALSE;
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) {
    if (!fe->scene->body[b].law->linear || fe->bbar[b] || fe->tangent_size[b] != 2) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

INLINED PetscReal At(const Lanes *x, PetscInt l)
{
  return ((const PetscReal *)x)[l];
}

/* Cell `lane` of a group; the last group has its last cell more than once. */
INLINED PetscInt CellOf(HycoFE fe, PetscInt group, PetscInt lane)
{
  return PetscMin(group * LANES + lane, fe->mesh->n_cells - 1);
}

/* Gradients and weights by group of cells, point and number: nv x dim gradients and the weight, of LANES cells each. */
static PetscErrorCode KeepLanes(HycoFE fe, const HycoElement *el, PetscInt n_groups)
{
  const PetscInt dim = fe->dim, size = el->nv * dim + 1;
  PetscReal *to;

  PetscFunctionBegin;
  if (fe->lanes && fe->lanes_place == fe->place) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEKeepGradients(fe));
  if (!fe->lanes) PetscCall(PetscMalloc1((size_t)(n_groups * el->nq * size) * LANES + 1, &fe->lanes));
  to = fe->lanes;
  for (PetscInt k = 0; k < n_groups * el->nq; k++) {
    for (PetscInt i = 0; i < size; i++) {
      for (PetscInt l = 0; l < LANES; l++) {
        const PetscReal *g = HycoKeptGradients(fe, el, CellOf(fe, k / el->nq, l), k % el->nq);

        *to++ = g[i + 1 < size ? i / dim * 3 + i % dim : 3 * el->nv];
      }
    }
  }
  fe->lanes_place = fe->place;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement gradients h[c][d] at a point from the gradients g of the shape functions and the displacements v. */
INLINED void AddGradients(PetscInt dim, PetscInt nv, const Lanes g[], const Lanes v[], Lanes h[3][3])
{
  for (PetscInt a = 0; a < nv; a++) {
    for (PetscInt c = 0; c < dim; c++) {
      for (PetscInt d = 0; d < dim; d++) h[c][d] += v[a * dim + c] * g[a * dim + d];
    }
  }
}

/* Adds a point of weight w. C: Lame's constants, and the thermal strain. Engineering shear strains, in the order xx yy
   zz xy yz xz; in 2D plane strain. Inlined for each dimension. */
INLINED void AddPoint(PetscInt dim, const Lanes *w, const Lanes C[3], Lanes h[3][3], Sums *s)
{
  const PetscInt ns = dim == 2 ? 4 : 6;
  Lanes strain[6], stress[6], stored = {0}, mean, square = {0}, volume;

  for (PetscInt c = 0; c < 3; c++) strain[c] = h[c][c] - C[2];
  strain[3] = h[0][1] + h[1][0];
  strain[4] = h[1][2] + h[2][1];
  strain[5] = h[0][2] + h[2][0];
  volume = C[0] * (strain[0] + strain[1] + strain[2]);
  for (PetscInt c = 0; c < 3; c++) stress[c] = volume + 2 * C[1] * strain[c];
  for (PetscInt c = 3; c < ns; c++) stress[c] = C[1] * strain[c];
  for (PetscInt c = 0; c < ns; c++) stored += stress[c] * strain[c];
  mean = (stress[0] + stress[1] + stress[2]) * (1. / 3);
  for (PetscInt c = 0; c < 3; c++) square += (stress[c] - mean) * (stress[c] - mean);
  for (PetscInt c = 3; c < ns; c++) square += 2 * stress[c] * stress[c];
  for (PetscInt c = 0; c < ns; c++) s->stress[c] += *w * stress[c];
  square = 1.5 * square;
  for (PetscInt l = 0; l < LANES; l++) ((PetscReal *)&square)[l] = PetscSqrtReal(((PetscReal *)&square)[l]);
  /* The mean of the equivalent stresses, not that of the mean stress. */
  s->mises += *w * square;
  s->stored += *w * stored / 2;
  s->volume += *w;
}

/* All sums of a group of cells in one loop over its points. */
INLINED void AddCells(PetscInt dim, HycoFE fe, const HycoElement *el, PetscInt group, const Lanes v[], Sums *sums)
{
  const PetscInt size = el->nv * dim + 1;
  const Lanes *g = (const Lanes *)fe->lanes + (size_t)(group * el->nq) * (size_t)size;
  const PetscReal *tangent[LANES], *thermal[LANES];
  Sums s = *sums;

  for (PetscInt l = 0; l < LANES; l++) {
    tangent[l] = fe->tangent + fe->tangent_start[CellOf(fe, group, l)];
    thermal[l] = fe->thermal ? fe->thermal + CellOf(fe, group, l) * el->nq : NULL;
  }
  for (PetscInt q = 0; q < el->nq; q++, g += size) {
    Lanes C[3] = {{0}}, h[3][3] = {{{0}}};

    for (PetscInt l = 0; l < LANES; l++) {
      for (PetscInt k = 0; k < 2; k++) ((PetscReal *)&C[k])[l] = tangent[l][2 * q + k];
      if (thermal[l]) ((PetscReal *)&C[2])[l] = thermal[l][q];
    }
    AddGradients(dim, el->nv, g, v, h);
    AddPoint(dim, g + size - 1, C, h, &s);
  }
  *sums = s;
}

HYCO_FOUR_AT_ONCE static void AddGroup2(HycoFE fe, const HycoElement *el, PetscInt group, const Lanes v[], Sums *s)
{
  AddCells(2, fe, el, group, v, s);
}

HYCO_FOUR_AT_ONCE static void AddGroup3(HycoFE fe, const HycoElement *el, PetscInt group, const Lanes v[], Sums *s)
{
  AddCells(3, fe, el, group, v, s);
}

/* *served false: another law, bbar or an axisymmetric scene; the caller takes the general way. */
PetscErrorCode HycoFELinearFields(HycoFE fe, const PetscReal u[], PetscReal sigma[], PetscReal mises[],
                                  PetscReal *stored, PetscBool *served)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, ns = fe->n_sigma, n_groups = (fe->mesh->n_cells + LANES - 1) / LANES;

  PetscFunctionBegin;
  *served = LinearFieldsIsUsable(fe);
  if (!*served) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KeepLanes(fe, el, n_groups));
  *stored = 0;
  for (PetscInt group = 0; group < n_groups; group++) {
    Lanes v[HYCO_MAX_CELL_DOFS];
    Sums s = {.volume = {0}};

    for (PetscInt l = 0; l < LANES; l++) {
      const PetscInt *node = fe->mesh->cells + CellOf(fe, group, l) * el->nv;

      for (PetscInt a = 0; a < el->nv; a++) {
        for (PetscInt c = 0; c < dim; c++) ((PetscReal *)&v[a * dim + c])[l] = u[node[a] * dim + c];
      }
    }
    if (dim == 2)
      AddGroup2(fe, el, group, v, &s);
    else
      AddGroup3(fe, el, group, v, &s);
    for (PetscInt l = 0; l < LANES && group * LANES + l < fe->mesh->n_cells; l++) {
      const PetscInt e = group * LANES + l;

      for (PetscInt c = 0; c < ns; c++) sigma[e * ns + c] = At(&s.stress[c], l) / At(&s.volume, l);
      mises[e] = At(&s.mises, l) / At(&s.volume, l);
      *stored += At(&s.stored, l);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
