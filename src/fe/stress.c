/* Stresses and energies of a displacement field, cell by cell. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>
#include <math.h>

/* The mean gradients of the shape functions in a cell, if its dilatation uses them. */
typedef struct {
  PetscBool used;
  PetscReal g[HYCO_CELL_NODES][3];
} Mean;

/* The mean dilatation of the cell (bbar): gradients averaged over the volume, for the trace of the strain alone.
   */
static PetscErrorCode GetMean(HycoFE fe, const HycoElement *el, PetscInt cell, Mean *mean)
{
  PetscFunctionBegin;
  mean->used = fe->bbar[fe->mesh->cell_body[cell]];
  if (mean->used) PetscCall(HycoMeanGradients(fe, el, cell, mean->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic strain and stress at point q of a cell (components beyond n_sigma are 0), and its volume. */
static PetscErrorCode AtPoint(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q, const PetscReal u[],
                              Mean *mean, PetscReal e[6], PetscReal s[6], PetscReal *w)
{
  const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
  PetscReal g[HYCO_CELL_NODES][3];

  PetscFunctionBegin;
  PetscCall(HycoGradients(fe, el, cell, q, g, w));
  HycoPointStrain(fe, el, cell, u, g, mean->used ? mean->g : NULL, e);
  /* Only normal components: thermal strain has no shear. */
  for (PetscInt k = 0; k < 3 && fe->thermal; k++) e[k] -= fe->thermal[cell * el->nq + q];
  for (PetscInt k = 0; k < 6; k++) s[k] = 0;
  HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, e, s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sigma[n_sigma] += the volume mean over a cell of the elastic stress C (e - e_thermal). */
static PetscErrorCode AddMean(HycoFE fe, const HycoElement *el, PetscInt cell, const PetscReal u[], PetscReal sigma[])
{
  PetscReal volume = 0, sum[6] = {0};
  Mean mean;

  PetscFunctionBegin;
  PetscCall(GetMean(fe, el, cell, &mean));
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal e[6], s[6], w;

    PetscCall(AtPoint(fe, el, cell, q, u, &mean, e, s, &w));
    for (PetscInt k = 0; k < fe->n_sigma; k++) sum[k] += w * s[k];
    volume += w;
  }
  for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[k] += sum[k] / volume;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume means by cell, sigma[n_cells][n_sigma]. */
PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sigma, fe->mesh->n_cells * fe->n_sigma));
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++)
    PetscCall(AddMean(fe, el, cell, u, sigma + cell * fe->n_sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the mean stress of a cell is its tangent times the mean strain: one tangent, and strains that are gradients.
   The element bbar changes no mean. */
static PetscBool IsUniform(HycoFE fe, const HycoElement *el, PetscInt cell)
{
  const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
  const PetscReal *tangent = fe->tangent + fe->tangent_start[cell];

  if (fe->formulation == HYCO_AXISYMMETRIC || fe->thermal) return PETSC_FALSE;
  for (PetscInt k = size; k < el->nq * size; k++) {
    if (tangent[k] != tangent[k % size]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The mean gradients g (3 nv) of a cell, unless they are those of the same nodes X (3 nv). */
static PetscErrorCode KeepMean(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal X[], PetscReal g[])
{
  const PetscInt *node = fe->mesh->cells + cell * el->nv;
  PetscReal volume = 0;
  PetscBool same = PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 3 * el->nv; k++) same = (PetscBool)(same && X[k] == fe->X[3 * node[k / 3] + k % 3]);
  /* Bit for bit: a body that does not move keeps its gradients. */
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArrayzero(g, 3 * el->nv));
  X[0] = NAN; /* not kept after an error */
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal own[HYCO_CELL_NODES][3], w;

    PetscCall(HycoGradients(fe, el, cell, q, own, &w));
    for (PetscInt k = 0; k < 3 * el->nv; k++) g[k] += w * own[k / 3][k % 3];
    volume += w;
  }
  for (PetscInt k = 0; k < 3 * el->nv; k++) g[k] /= volume;
  for (PetscInt k = 0; k < 3 * el->nv; k++) X[k] = fe->X[3 * node[k / 3] + k % 3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For many displacements on one mesh: the mean gradients of each cell are kept from the first call on, NaN marking
   those that are not there yet. *kept is freed by the caller, when nodes move. */
PetscErrorCode HycoFEStressMatrixKept(HycoFE fe, const PetscBool in[], const PetscReal u[], PetscReal **kept,
                                      PetscReal sigma[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt n = fe->mesh->n_cells, size = 3 * el->nv;

  PetscFunctionBegin;
  if (!*kept) {
    PetscCall(PetscMalloc1((size_t)n * (size_t)(2 * size) + 1, kept));
    for (PetscInt cell = 0; cell < n; cell++) (*kept)[(size_t)cell * (size_t)(2 * size)] = NAN;
  }
  PetscCall(PetscArrayzero(sigma, n * fe->n_sigma));
  for (PetscInt cell = 0; cell < n; cell++) {
    PetscReal *own = *kept + (size_t)cell * (size_t)(2 * size), *of = sigma + cell * fe->n_sigma, e[6], s[6] = {0};

    /* Cells that no output reads stay 0. */
    if (in && !in[cell]) continue;
    /* Moduli or temperature vary within the cell: the mean stress is not that of the mean strain. */
    if (!IsUniform(fe, el, cell)) {
      PetscCall(AddMean(fe, el, cell, u, of));
      continue;
    }
    PetscCall(KeepMean(fe, el, cell, own, own + size));
    HycoPointStrain(fe, el, cell, u, (PetscReal(*)[3])(own + size), NULL, e);
    HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell], e, s);
    PetscCall(PetscArraycpy(of, s, fe->n_sigma));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B^T C by: the tangents are symmetric. */
PetscErrorCode HycoFEAddStressDerivatives(HycoFE fe, PetscInt cell, const PetscReal by[6], PetscReal factor,
                                          PetscReal slope[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
  PetscReal push[HYCO_MAX_CELL_DOFS] = {0}, volume = 0;
  Mean mean;

  PetscFunctionBegin;
  PetscCall(GetMean(fe, el, cell, &mean));
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal g[HYCO_CELL_NODES][3], s[6] = {0}, w;

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, by, s);
    HycoPointForce(fe, el, g, mean.used ? mean.g : NULL, w, s, push);
    volume += w;
  }
  for (PetscInt k = 0; k < el->nv * fe->dim; k++)
    slope[fe->mesh->cells[cell * el->nv + k / fe->dim] * fe->dim + k % fe->dim] += factor / volume * push[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integration weights summed by cell (m^3; in 2D per unit thickness; axisymmetric: of the full ring). */
PetscErrorCode HycoFEVolumes(HycoFE fe, PetscReal volume[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++) {
    volume[cell] = 0;
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal g[HYCO_CELL_NODES][3], w;

      PetscCall(HycoGradients(fe, el, cell, q, g, &w));
      volume[cell] += w;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic energy by cell, sigma : e / 2 with the elastic strain, so that free thermal expansion stores nothing. */
PetscErrorCode HycoFEEnergy(HycoFE fe, const PetscReal u[], PetscReal energy[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++) {
    Mean mean;

    energy[cell] = 0;
    PetscCall(GetMean(fe, el, cell, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal e[6], s[6], w, density = 0;

      PetscCall(AtPoint(fe, el, cell, q, u, &mean, e, s, &w));
      for (PetscInt k = 0; k < 6; k++) density += s[k] * e[k];
      energy[cell] += w / 2 * density;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By cell, the part of 2 x energy that thermal strains contribute, so that u^T K u follows from the energies. */
PetscErrorCode HycoFEHeatWork(HycoFE fe, const PetscReal u[], PetscReal work[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(work, fe->mesh->n_cells));
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++) {
    const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
    Mean mean;

    /* Bodies without expansion contribute nothing. */
    if (!fe->scene->body[fe->mesh->cell_body[cell]].expansion) continue;
    PetscCall(GetMean(fe, el, cell, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      const PetscReal hot = fe->thermal[cell * el->nq + q], strain[6] = {hot, hot, hot, 0, 0, 0};
      PetscReal e[6], s[6], hot_stress[6] = {0, 0, 0, 0, 0, 0}, w, density = 0;

      PetscCall(AtPoint(fe, el, cell, q, u, &mean, e, s, &w));
      HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, strain,
                       hot_stress);
      for (PetscInt k = 0; k < 3; k++) density -= (2 * s[k] + hot_stress[k]) * strain[k]; /* e : C : (e - 2 eps) */
      work[cell] += w * density;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
