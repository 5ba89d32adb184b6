/* The tangents of the bodies' laws at the integration points. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

#define BATCH 64 /* cells of one body whose points a law takes together */

PetscErrorCode HycoTangentsCreate(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->scene->n_bodies, &fe->tangent_size));
  PetscCall(PetscMalloc1(m->n_cells, &fe->tangent_start));
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++)
    fe->tangent_size[b] = HycoMaterialTangentSize(fe->scene->body[b].law, fe->dim);
  for (PetscInt e = 0; e < m->n_cells; e++) {
    fe->tangent_start[e] = n;
    n += el->nq * fe->tangent_size[m->cell_body[e]];
  }
  PetscCall(PetscMalloc1(n, &fe->tangent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for a batch. */
typedef struct {
  PetscInt n, cell[BATCH];
  PetscReal *x, *constant, *tangent;
} Batch;

/* Tangents of the batch's cells. */
static PetscErrorCode Update(HycoFE fe, Batch *b)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);
  const PetscInt body = b->n ? m->cell_body[b->cell[0]] : 0, size = el->nq * fe->tangent_size[body];

  PetscFunctionBegin;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < b->n * el->nq; k++) {
    const PetscInt *node = m->cells + b->cell[k / el->nq] * m->nv;
    PetscReal *x = b->x + 3 * k;

    x[0] = x[1] = x[2] = 0;
    for (PetscInt a = 0; a < m->nv; a++) {
      for (PetscInt c = 0; c < 3; c++) x[c] += el->N[k % el->nq][a] * fe->X[3 * node[a] + c];
    }
  }
  PetscCall(
      HycoMaterialTangents(fe->scene->body[body].law, fe->dim, fe->mu, b->n * el->nq, b->x, b->constant, b->tangent));
  for (PetscInt k = 0; k < b->n; k++)
    PetscCall(PetscArraycpy(fe->tangent + fe->tangent_start[b->cell[k]], b->tangent + k * size, size));
  b->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UpdateAll(HycoFE fe, PetscBool all, Batch *b)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (fe->constant[e] && !all) continue;
    if (b->n == BATCH || (b->n && m->cell_body[e] != m->cell_body[b->cell[0]])) PetscCall(Update(fe, b));
    b->cell[b->n++] = e;
  }
  PetscCall(Update(fe, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFESetTangents(HycoFE fe, PetscBool all)
{
  const PetscInt n = BATCH * HycoElementGet(fe->mesh->type)->nq, ns = fe->n_sigma;
  Batch b = {.n = 0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * n, &b.x, HYCO_MAX_DECLARED * n, &b.constant, PetscMax(2, ns * ns) * n, &b.tangent));
  ierr = UpdateAll(fe, all, &b);
  PetscCall(PetscFree3(b.x, b.constant, b.tangent));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
