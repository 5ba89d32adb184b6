/* Stresses and energies of a displacement field, cell by cell. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

/* The shape functions' mean gradients in a cell, where its dilatation is made of them. */
typedef struct {
  PetscBool used;
  PetscReal g[8][3];
} Mean;

/* h from the shape functions' gradients; with the cell's mean ones, the dilatation becomes theirs (the element bbar).
 */
static void Gradient(HycoFE fe, PetscInt cell, const PetscReal u[], PetscReal g[8][3], const Mean *mean,
                     PetscReal h[3][3])
{
  HycoMesh m = fe->mesh;
  PetscReal excess = 0;

  for (PetscInt c = 0; c < 3; c++) {
    for (PetscInt d = 0; d < 3; d++) {
      h[c][d] = 0;
      for (PetscInt a = 0; c < m->dim && a < m->nv; a++)
        h[c][d] += u[m->cells[cell * m->nv + a] * m->dim + c] * g[a][d];
    }
  }
  if (!mean->used) return;
  for (PetscInt c = 0; c < m->dim; c++) {
    for (PetscInt a = 0; a < m->nv; a++)
      excess += u[m->cells[cell * m->nv + a] * m->dim + c] * (mean->g[a][c] - g[a][c]);
  }
  for (PetscInt c = 0; c < 3; c++) h[c][c] += excess / 3;
}

static PetscErrorCode GetMean(HycoFE fe, const HycoElement *el, PetscInt cell, Mean *mean)
{
  PetscFunctionBegin;
  mean->used = fe->scene->body[fe->mesh->cell_body[cell]].bbar;
  if (mean->used) PetscCall(HycoMeanGradients(fe, el, cell, mean->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strain and stress at point q of a cell (components that are not n_sigma's are 0), and its volume. */
static PetscErrorCode AtPoint(HycoFE fe, const HycoElement *el, PetscInt cell, PetscInt q, const PetscReal u[],
                              const Mean *mean, PetscReal e[6], PetscReal s[6], PetscReal *w)
{
  const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
  PetscReal g[8][3], h[3][3];

  PetscFunctionBegin;
  PetscCall(HycoGradients(fe, el, cell, q, g, w));
  Gradient(fe, cell, u, g, mean, h);
  for (PetscInt k = 0; k < 6; k++) {
    e[k] = k < 3 ? h[k][k] : h[k == 4 ? 1 : 0][k == 3 ? 1 : 2] + h[k == 3 ? 1 : 2][k == 4 ? 1 : 0];
    s[k] = 0;
  }
  HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, e, s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sigma, fe->mesh->n_cells * fe->n_sigma));
  for (PetscInt cell = 0; cell < fe->mesh->n_cells; cell++) {
    PetscReal volume = 0;
    Mean mean;

    PetscCall(GetMean(fe, el, cell, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal e[6], s[6], w;

      PetscCall(AtPoint(fe, el, cell, q, u, &mean, e, s, &w));
      for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[cell * fe->n_sigma + k] += w * s[k];
      volume += w;
    }
    for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[cell * fe->n_sigma + k] /= volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
