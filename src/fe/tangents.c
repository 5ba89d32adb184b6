/* The tangents of the bodies' laws at the integration points. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

#define BATCH 64 /* cells of one body whose points a law evaluates together */

/* Two reals per point for isotropic laws, n_sigma^2 otherwise; the offsets of cells are fixed for fe's life. */
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
    /* Cells of different laws have tangents of different size. */
    fe->tangent_start[e] = n;
    n += el->nq * fe->tangent_size[m->cell_body[e]];
  }
  PetscCall(PetscMalloc1(n, &fe->tangent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work arrays of a batch. */
typedef struct {
  PetscInt n, cell[BATCH];
  PetscReal *x, *temperature, *constant, *tangent;
} Batch;

/* Tangents of the batch's cells. */
static PetscErrorCode TangentsUpdate(HycoFE fe, Batch *b)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);
  const PetscInt body = b->n ? m->cell_body[b->cell[0]] : 0, size = el->nq * fe->tangent_size[body];
  const PetscBool hot = (PetscBool)(fe->scene->body[body].temperature != NULL);

  PetscFunctionBegin;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < b->n * el->nq; k++) {
    HycoPointPlace(fe, el, b->cell[k / el->nq], k % el->nq, b->x + 3 * k);
    /* Bodies without a temperature pass none: their laws do not read it. */
    if (hot) b->temperature[k] = fe->temperature[b->cell[k / el->nq] * el->nq + k % el->nq];
  }
  PetscCall(HycoMaterialTangents(fe->scene->body[body].law, fe->dim, fe->mu, b->n * el->nq, b->x,
                                 hot ? b->temperature : NULL, b->constant, b->tangent));
  for (PetscInt k = 0; k < b->n; k++)
    PetscCall(PetscArraycpy(fe->tangent + fe->tangent_start[b->cell[k]], b->tangent + k * size, size));
  b->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Batches of one body: a law is called for up to 64 cells at once. */
static PetscErrorCode UpdateAll(HycoFE fe, PetscBool all, const PetscBool same[], Batch *b)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    /* Neither nodes nor law change: the tangents of the call before stay. */
    if (!all && (fe->constant[e] || same[m->cell_body[e]])) continue;
    if (b->n == BATCH || (b->n && m->cell_body[e] != m->cell_body[b->cell[0]])) PetscCall(TangentsUpdate(fe, b));
    b->cell[b->n++] = e;
  }
  PetscCall(TangentsUpdate(fe, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic tangents at mu; all: also those of cells that no parameter changes. Otherwise those of bodies whose law has
   changed[] parameters (NULL: any), or varies in space where nodes have moved. Not collective. */
PetscErrorCode HycoFESetTangents(HycoFE fe, PetscBool all, PetscBool moved, const PetscBool changed[])
{
  const PetscInt n = BATCH * HycoElementGet(fe->mesh->type)->nq, ns = fe->n_sigma;
  PetscBool *same;
  Batch b = {.n = 0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(3 * n, &b.x, n, &b.temperature, HYCO_MAX_DECLARED * n, &b.constant, PetscMax(2, ns * ns) * n,
                         &b.tangent, fe->scene->n_bodies, &same));
  for (PetscInt k = 0; k < fe->scene->n_bodies; k++) {
    const HycoMaterial law = fe->scene->body[k].law;

    /* A flowing law's tangent at rest may have been overwritten by a step. */
    same[k] = (PetscBool)(changed && law->linear && !HycoMaterialChanges(law, changed) &&
                          !(moved && HycoMaterialInSpace(law)));
  }
  HycoFinally(UpdateAll(fe, all, same, &b), PetscCall(PetscFree5(b.x, b.temperature, b.constant, b.tangent, same)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
