/* Stresses and energies of a displacement field, cell by cell. */
#include <hycokinematics.h>

/* The shape functions' mean gradients in a cell, where its dilatation is made of them. */
typedef struct {
  PetscBool used;
  PetscReal g[8][3];
} Mean;

/* sigma = lambda tr(eps) I + 2 mu eps at a point from the displacement gradient h[c][d] = du_c/dX_d. */
static void Stress(PetscInt dim, const PetscReal lame[2], PetscReal h[3][3], PetscReal s[6])
{
  const PetscReal volume = lame[0] * (h[0][0] + h[1][1] + h[2][2]);

  if (dim == 1) {
    s[0] = lame[1] * h[0][0];
    return;
  }
  for (PetscInt c = 0; c < 3; c++) s[c] = volume + 2 * lame[1] * h[c][c];
  s[3] = lame[1] * (h[0][1] + h[1][0]);
  s[4] = lame[1] * (h[1][2] + h[2][1]);
  s[5] = lame[1] * (h[0][2] + h[2][0]);
}

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

PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sigma, fe->mesh->n_cells * fe->n_sigma));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscReal volume = 0;
    Mean mean;

    PetscCall(GetMean(fe, el, e, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal g[8][3], h[3][3], s[6], w;

      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      Gradient(fe, e, u, g, &mean, h);
      Stress(fe->dim, fe->lame + 2 * (e * el->nq + q), h, s);
      for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[e * fe->n_sigma + k] += w * s[k];
      volume += w;
    }
    for (PetscInt k = 0; k < fe->n_sigma; k++) sigma[e * fe->n_sigma + k] /= volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEEnergy(HycoFE fe, const PetscReal u[], PetscReal energy[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    Mean mean;

    energy[e] = 0;
    PetscCall(GetMean(fe, el, e, &mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal g[8][3], h[3][3], s[6] = {0, 0, 0, 0, 0, 0}, w;

      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      Gradient(fe, e, u, g, &mean, h);
      Stress(fe->dim, fe->lame + 2 * (e * el->nq + q), h, s);
      energy[e] += w / 2 *
                   (s[0] * h[0][0] + s[1] * h[1][1] + s[2] * h[2][2] + s[3] * (h[0][1] + h[1][0]) +
                    s[4] * (h[1][2] + h[2][1]) + s[5] * (h[0][2] + h[2][0]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
