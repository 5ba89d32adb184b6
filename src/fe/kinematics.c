/* Jacobians of cells and facets. */
#include <hycokinematics.h>
#include <hycovector.h>

/* det dX/dxi at point q, with its sign. */
PetscReal HycoDeterminant(const HycoElement *el, const PetscInt node[], const PetscReal X[], PetscInt q)
{
  /* Directions that the mesh does not have keep 1, so that one formula serves all dimensions. */
  PetscReal J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  for (PetscInt c = 0; c < el->dim; c++) {
    for (PetscInt d = 0; d < el->dim; d++) {
      J[c][d] = 0;
      for (PetscInt a = 0; a < el->nv; a++) J[c][d] += X[3 * node[a] + c] * el->dN[q][a][d];
    }
  }
  return J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) +
         J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
}

/* The radius of a point from its shape functions N at these nodes. */
static PetscReal KinematicsRadius(HycoFE fe, PetscInt n, const PetscInt node[], const PetscReal N[])
{
  PetscReal r = 0;

  for (PetscInt a = 0; a < n; a++) r += N[a] * fe->X[3 * node[a]];
  return r;
}

/* g[a] = dN_a/dX at point q (in an axisymmetric scene g[a][2] = N_a / r, the hoop strain), weight = |det J| w (times
   2 pi r, times the cell's cubature weight). Kept values are used while the nodes are in place. */
PetscErrorCode HycoGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q,
                             PetscReal g[HYCO_CELL_NODES][3], PetscReal *weight)
{
  const PetscInt *node = fe->mesh->cells + cell * fe->mesh->nv, dim = el->dim;
  PetscReal J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, inv[3][3], det, size = 1;

  PetscFunctionBegin;
  /* Kept values have the factors of the weight in them. */
  if (HycoGradientsKept(fe)) {
    const PetscReal *kept = HycoKeptGradients(fe, el, cell, q);

    PetscCall(PetscArraycpy(&g[0][0], kept, 3 * el->nv));
    *weight = kept[3 * el->nv];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt c = 0; c < dim; c++) {
    PetscReal row = 0;

    for (PetscInt d = 0; d < dim; d++) {
      J[c][d] = 0;
      for (PetscInt a = 0; a < el->nv; a++) J[c][d] += fe->X[3 * node[a] + c] * el->dN[q][a][d];
      row += J[c][d] * J[c][d];
    }
    /* The product of the rows' lengths bounds det (Hadamard): the test for degeneration has no unit. */
    size *= PetscSqrtReal(row);
  }
  for (PetscInt c = 0; c < 3; c++) {
    for (PetscInt d = 0; d < 3; d++) {
      const PetscInt c1 = (c + 1) % 3, c2 = (c + 2) % 3, d1 = (d + 1) % 3, d2 = (d + 2) % 3;

      inv[d][c] = J[c1][d1] * J[c2][d2] - J[c1][d2] * J[c2][d1];
    }
  }
  det = J[0][0] * inv[0][0] + J[0][1] * inv[1][0] + J[0][2] * inv[2][0];
  HycoCheck(PetscAbsReal(det) > 1e-14 * size, "cell %d is degenerate: its volume vanishes at a quadrature point",
            (int)fe->mesh->cell_id[cell]);
  /* files number cells in either orientation: either sign is valid, but it must be the same in all of the cell */
  HycoCheck(!q || el->nv == dim + 1 || (det > 0) == (HycoDeterminant(el, node, fe->X, 0) > 0),
            "cell %d is inverted: its volume element changes sign; check its boundary and the order of its nodes "
            "(gmsh's order)",
            (int)fe->mesh->cell_id[cell]);
  for (PetscInt a = 0; a < el->nv; a++) {
    for (PetscInt c = 0; c < 3; c++) {
      g[a][c] = 0;
      for (PetscInt d = 0; c < dim && d < dim; d++) g[a][c] += el->dN[q][a][d] * inv[d][c] / det;
    }
  }
  *weight = PetscAbsReal(det) * el->w[q];
  if (fe->formulation == HYCO_AXISYMMETRIC) {
    /* Above 0 at a quadrature point: CheckAxis() keeps the cells on one side of the axis. */
    const PetscReal r = KinematicsRadius(fe, el->nv, node, el->N[q]);

    for (PetscInt a = 0; a < el->nv; a++) g[a][2] = el->N[q][a] / r;
    *weight *= 2 * PETSC_PI * r;
  }
  if (fe->cell_weight) *weight *= fe->cell_weight[cell];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without gradients, which many uses do not need, and kept by cell until nodes move. */
PetscErrorCode HycoPointWeights(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal *weight[])
{
  const PetscInt *node = fe->mesh->cells + cell * fe->mesh->nv;
  PetscReal *w;

  PetscFunctionBegin;
  if (!fe->weight) {
    PetscCall(PetscMalloc1(fe->mesh->n_cells * el->nq, &fe->weight));
    PetscCall(PetscCalloc1(fe->mesh->n_cells, &fe->weighed_at));
  }
  *weight = w = fe->weight + cell * el->nq;
  /* It rises when the body's nodes move. */
  if (fe->weighed_at[cell] == fe->moved_at[fe->mesh->cell_body[cell]]) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt q = 0; q < el->nq; q++) {
    w[q] = PetscAbsReal(HycoDeterminant(el, node, fe->X, q)) * el->w[q];
    if (fe->formulation == HYCO_AXISYMMETRIC) w[q] *= 2 * PETSC_PI * KinematicsRadius(fe, el->nv, node, el->N[q]);
    if (fe->cell_weight) w[q] *= fe->cell_weight[cell];
  }
  fe->weighed_at[cell] = fe->moved_at[fe->mesh->cell_body[cell]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean gradients of the cells of bodies with bbar, from the stored gradients. kept_mean is NULL while it is filled, so
   that HycoMeanGradients() computes. */
static PetscErrorCode KeepMeans(HycoFE fe, const HycoElement *el)
{
  PetscReal *mean = fe->kept_mean;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) any = (PetscBool)(any || fe->bbar[b]);
  /* Scenes without bbar store nothing. */
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  if (!mean) PetscCall(PetscCalloc1((size_t)fe->mesh->n_cells * (size_t)(3 * el->nv), &mean));
  fe->kept_mean = NULL; /* computed below */
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscReal g[HYCO_CELL_NODES][3];

    if (!fe->bbar[fe->mesh->cell_body[e]]) continue;
    PetscCall(HycoMeanGradients(fe, el, e, g));
    PetscCall(PetscArraycpy(mean + (size_t)e * (size_t)(3 * el->nv), &g[0][0], 3 * el->nv));
  }
  fe->kept_mean = mean;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores gradients and weights of all points, (3 nv + 1) reals each, for repeated steps on unmoved nodes. */
PetscErrorCode HycoFEKeepGradients(HycoFE fe)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const size_t size = (size_t)(3 * el->nv + 1), n = (size_t)(fe->mesh->n_cells * el->nq);
  PetscReal *kept = fe->kept;

  PetscFunctionBegin;
  if (HycoGradientsKept(fe)) PetscFunctionReturn(PETSC_SUCCESS);
  if (!kept) PetscCall(PetscMalloc1(n * size + 1, &kept));
  /* Or HycoGradients() would read what is not written yet. */
  fe->kept = NULL; /* computed below */
  for (size_t k = 0; k < n; k++) {
    PetscReal g[HYCO_CELL_NODES][3];
    PetscErrorCode ierr =
        HycoGradients(fe, el, (PetscInt)k / el->nq, (PetscInt)k % el->nq, g, kept + k * size + size - 1);

    if (ierr) PetscCall(PetscFree(kept));
    PetscCall(ierr);
    PetscCall(PetscArraycpy(kept + k * size, &g[0][0], 3 * el->nv));
  }
  fe->kept = kept;
  fe->kept_place = fe->place;
  PetscCall(KeepMeans(fe, el));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Degenerate and inverted cells of the mesh as drawn, before any parameter moves it. */
PetscErrorCode HycoMeshCheckCells(HycoMesh m)
{
  const HycoElement *el = HycoElementGet(m->type);
  /* A fe without a scene: only the mesh and the coordinates are read. */
  struct _n_HycoFE drawn = {.mesh = m, .dim = m->dim, .X = m->xyz};
  PetscReal g[HYCO_CELL_NODES][3], weight;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    for (PetscInt q = 0; q < el->nq; q++) PetscCall(HycoGradients(&drawn, el, e, q, g, &weight));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean dilatation of the cell: mean[a][c] = 1/V integral of d(tr eps)/du_ac, the bbar element's volumetric row. Hughes
   1980: the volumetric strain is the same at all points, so that it cannot lock. */
PetscErrorCode HycoMeanGradients(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal mean[HYCO_CELL_NODES][3])
{
  const PetscInt dim = el->dim;
  PetscReal g[HYCO_CELL_NODES][3], w, volume = 0;

  PetscFunctionBegin;
  /* Written by KeepMeans() for bodies with bbar only, which alone ask for it. */
  if (fe->kept_mean && fe->kept_place == fe->place) {
    PetscCall(PetscArraycpy(&mean[0][0], fe->kept_mean + (size_t)cell * (size_t)(3 * el->nv), 3 * el->nv));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArrayzero(&mean[0][0], 3 * el->nv));
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    volume += w;
    for (PetscInt a = 0; a < el->nv; a++) {
      for (PetscInt c = 0; c < dim; c++) mean[a][c] += w * HycoDilatation(fe, g, a, c);
    }
  }
  for (PetscInt a = 0; a < el->nv; a++) {
    for (PetscInt c = 0; c < dim; c++) mean[a][c] /= volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n dS w at point q of a facet (area-weighted), outward as the body lies now; without the axisymmetric factor. */
PetscErrorCode HycoFacetDirection(HycoFE fe, const HycoElement *el, PetscInt facet, PetscInt q, PetscReal n[3])
{
  HycoMesh m = fe->mesh;
  const PetscInt *node = m->facets + facet * m->nf;
  const PetscReal side = fe->mirrored[m->node_body[node[0]]] ? -1 : 1; /* facets are oriented outwards in the mesh
                                                                          file */
  PetscReal t[2][3] = {{0, 0, 0}, {0, 0, 1}};

  PetscFunctionBegin;
  if (m->dim == 1) {
    const PetscInt cell = m->facet_cell[facet];
    PetscReal middle;

    PetscCheck(cell >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "a point facet without its cell");
    /* The outward side is away from the other end of the cell. */
    middle = (fe->X[3 * m->cells[2 * cell]] + fe->X[3 * m->cells[2 * cell + 1]]) / 2;
    n[0] = fe->X[3 * node[0]] > middle ? 1 : -1;
    n[1] = n[2] = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt d = 0; d < el->dim; d++) {
    for (PetscInt c = 0; c < 3; c++) {
      t[d][c] = 0;
      for (PetscInt a = 0; a < el->nv; a++) t[d][c] += fe->X[3 * node[a] + c] * el->dN[q][a][d];
    }
  }
  /* In 2D the second tangent is the unit vector out of the plane. */
  HycoFacetCross((const PetscReal(*)[3])t, side * el->w[q], n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with the circumference 2 pi r. n dS times the weight of the quadrature point. */
PetscErrorCode HycoFacetNormal(HycoFE fe, const HycoElement *el, PetscInt facet, PetscInt q, PetscReal n[3])
{
  const PetscInt *node = fe->mesh->facets + facet * fe->mesh->nf;

  PetscFunctionBegin;
  PetscCall(HycoFacetDirection(fe, el, facet, q, n));
  for (PetscInt c = 0; fe->formulation == HYCO_AXISYMMETRIC && c < 3; c++)
    n[c] *= 2 * PETSC_PI * KinematicsRadius(fe, el->nv, node, el->N[q]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moved coordinates: expressions in space are those of the moved body. */
void HycoPointPlace(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q, PetscReal x[3])
{
  const PetscInt *node = fe->mesh->cells + cell * fe->mesh->nv;

  x[0] = x[1] = x[2] = 0;
  for (PetscInt a = 0; a < el->nv; a++) {
    for (PetscInt c = 0; c < 3; c++) x[c] += el->N[q][a] * fe->X[3 * node[a] + c];
  }
}

/* Strain (xx, yy, zz, 2 xy, 2 yz, 2 xz) of u; with mean, its trace is replaced by the cell's mean dilatation. */
void HycoPointStrain(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal u[],
                     PetscReal g[HYCO_CELL_NODES][3], PetscReal mean[HYCO_CELL_NODES][3], PetscReal e[6])
{
  HycoMesh m = fe->mesh;
  const PetscInt *node = m->cells + cell * m->nv;
  PetscReal h[3][3] = {{0}}, excess = 0;

  for (PetscInt a = 0; a < el->nv; a++) {
    const PetscReal *own = u + node[a] * m->dim;

    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt d = 0; d < 3; d++) h[c][d] += own[c] * g[a][d];
    }
  }
  if (fe->formulation == HYCO_AXISYMMETRIC) {
    /* g[a][2] = N_a / r times the radial displacement is the hoop strain; nothing else has a third component. */
    h[2][2] = h[0][2];
    h[0][2] = h[1][2] = 0;
  }
  for (PetscInt c = 0; mean && c < m->dim; c++) {
    for (PetscInt a = 0; a < el->nv; a++)
      excess += u[m->cells[cell * m->nv + a] * m->dim + c] * (mean[a][c] - HycoDilatation(fe, g, a, c));
  }
  for (PetscInt c = 0; mean && c < 3; c++) h[c][c] += excess / 3;
  for (PetscInt k = 0; k < 6; k++)
    e[k] = k < 3 ? h[k][k] : h[k == 4 ? 1 : 0][k == 3 ? 1 : 2] + h[k == 3 ? 1 : 2][k == 4 ? 1 : 0];
}

/* f += w B^T s, the transpose of HycoPointStrain() with the same bbar correction, so that K and forces agree. */
void HycoPointForce(HycoFE fe, const HycoElement *el, PetscReal g[HYCO_CELL_NODES][3],
                    PetscReal mean[HYCO_CELL_NODES][3], PetscReal w, const PetscReal s[6], PetscReal f[])
{
  static const PetscInt at[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}}; /* index of the stress component (c, d) */
  const PetscReal pressure = mean ? (s[0] + s[1] + s[2]) / 3 : 0;

  for (PetscInt a = 0; a < el->nv; a++) {
    for (PetscInt c = 0; c < fe->dim; c++) {
      /* The mean's dilatation in place of the point's. */
      PetscReal sum = mean ? pressure * (mean[a][c] - HycoDilatation(fe, g, a, c)) : 0;

      for (PetscInt d = 0; d < fe->dim; d++) sum += g[a][d] * s[at[c][d]];
      if (fe->formulation == HYCO_AXISYMMETRIC && c == 0) sum += g[a][2] * s[2];
      f[a * fe->dim + c] += w * sum;
    }
  }
}
