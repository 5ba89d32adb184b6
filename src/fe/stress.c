/* Stresses and energies of a displacement field, cell by cell. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

/* The mean gradients of the shape functions in a cell, if its dilatation uses them. */
typedef struct {
  PetscBool used;
  PetscReal g[HYCO_CELL_NODES][3];
} Mean;

/* Once for each cell, not for each point. */
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
  /* What is left causes stress. */
  for (PetscInt k = 0; k < 3 && fe->thermal; k++) e[k] -= fe->thermal[cell * el->nq + q];
  for (PetscInt k = 0; k < 6; k++) s[k] = 0;
  HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, e, s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[])
{
  PetscFunctionBegin;
  PetscCall(HycoFEStressIn(fe, NULL, u, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEStressIn(HycoFE fe, const PetscBool in[], const PetscReal u[], PetscReal sigma[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sigma, fe->mesh->n_cells * fe->n_sigma));
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++) {
    PetscReal volume = 0;
    Mean mean;

    if (in && !in[cell]) continue;
    PetscCall(GetMean(fe, el, cell, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal e[6], s[6], w;

      PetscCall(AtPoint(fe, el, cell, q, u, &mean, e, s, &w));
      for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[cell * fe->n_sigma + k] += w * s[k];
      volume += w;
    }
    /* A cell that passes HycoGradients() has a volume. */
    for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[cell * fe->n_sigma + k] /= volume;
  }
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
