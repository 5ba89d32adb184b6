/* Compares the path of a model with that of full order, at the listed times. */
#include <hycopath.h>
#include <hycoreducerimpl.h>

/* Each kind of error at its worst time and at the end. Relative to at least HYCO_SMALL_FORCE of the path's largest
   value: at times without load the relative error of a value near 0 would be large and mean nothing. */
void HycoPathErrorsJudge(PetscInt n, const HycoErrorNorm lost[], HycoPathErrors *e)
{
  const HycoPathErrors none = {.n = n};

  *e = none;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    PetscReal size = 0;

    for (PetscInt k = 0; k < n; k++) size = PetscMax(size, lost[k * HYCO_N_ERRORS + j].size);
    for (PetscInt k = 0; k < n; k++) {
      const HycoErrorNorm *here = &lost[k * HYCO_N_ERRORS + j];

      e->end[j] = HycoRelative(here->lost, PetscMax(here->size, HYCO_SMALL_FORCE * size));
      /* Equal errors: the first time. After the loop e->end is that of the last one. */
      if (e->end[j] <= e->worst[j]) continue;
      e->worst[j] = e->end[j];
      e->at[j] = k;
    }
    if (j == HYCO_ERROR_LAMBDA) e->force = size;
    if (j == HYCO_ERROR_LAMBDA_RID) e->force_rid = size;
  }
}

/* Of an arbitrary position there is no error: full order has chosen another one. */
void HycoTraceExcludeDisplacements(HycoROM m, PetscInt step, HycoErrorNorm lost[])
{
  if (m->trace.loose[step]) lost[HYCO_ERROR_U].lost = lost[HYCO_ERROR_U_RID].lost = 0;
}

/* The full-order path on rank 0, stored as its listed times are reached. */
typedef struct {
  PetscInt n_dof, n_sigma, n_cells, n_contacts, n;
  PetscReal *value; /* for each time u, sigma, inelastic, lambda */
} Kept;

static PetscReal *ComparePathTime(const Kept *kept, PetscInt k)
{
  return kept->value + (size_t)k * (size_t)(kept->n_dof + kept->n_sigma + kept->n_cells + kept->n_contacts);
}

/* A HycoStepMonitor. HycoFOMGetSolution() gathers on rank 0 and is collective; the inelastic strains are of this rank's
   cells and are sent by the file's order. Full order's fields at all listed times, since the reduced path is predicted
   only when it has ended. */
static PetscErrorCode ComparePathKeep(HycoFOM f, const HycoStep *step, void *ctx)
{
  Kept *kept = (Kept *)ctx;
  const PetscReal *u, *sigma, *lambda;
  /* Only rank 0 allocated the room. */
  PetscReal *to = f->rank ? NULL : ComparePathTime(kept, step->index), *mine;
  HycoFileOrder *all;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetSolution(f, NULL, &u, NULL, &lambda, NULL, &sigma));
  PetscCall(PetscMalloc1(f->part->n_cells, &mine));
  PetscCall(HycoFEStateFields(f->fe, f->path->begin, NULL, NULL, mine, NULL));
  if (f->rank == 0) {
    PetscCall(PetscArraycpy(to, u, kept->n_dof));
    PetscCall(PetscArraycpy(to + kept->n_dof, sigma, kept->n_sigma));
    PetscCall(PetscArraycpy(to + kept->n_dof + kept->n_sigma + kept->n_cells, lambda, kept->n_contacts));
  }
  if (f->size == 1)
    PetscCall(PetscArraycpy(to + kept->n_dof + kept->n_sigma, mine, kept->n_cells));
  else {
    PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, PETSC_TRUE, &all));
    PetscCall(HycoFileOrderSend(all, HYCO_ON_CELLS, MPIU_REAL, 1, mine, to ? to + kept->n_dof + kept->n_sigma : NULL));
    PetscCall(HycoFileOrderDestroy(&all));
  }
  PetscCall(PetscFree(mine));
  kept->n = step->index + 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The errors of the model at listed time k: U on the whole mesh, the others on the RID and the contacts. From the
   whole mesh's fields to those of the RID by its maps node_whole and cell_whole. */
static PetscErrorCode ComparePathMeasure(HycoROM m, const Kept *kept, PetscInt k, HycoErrorNorm lost[])
{
  const PetscInt dim = m->model->mesh->dim, ns = m->fe->n_sigma;
  const PetscReal *u = ComparePathTime(kept, k), *sigma = u + kept->n_dof, *inelastic = sigma + kept->n_sigma,
                  *lambda = inelastic + kept->n_cells, *found;
  PetscReal *u_rid, *sigma_rid, *inelastic_rid, square[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(HycoROMSetStep(m, k));
  /* Both in the order of the mesh file on rank 0, hence plain differences. */
  PetscCall(HycoROMGetWholeU(m, NULL, &found));
  for (PetscInt i = 0; i < kept->n_dof; i++) {
    square[0] += (found[i] - u[i]) * (found[i] - u[i]);
    square[1] += u[i] * u[i];
  }
  PetscCall(PetscMalloc3(m->model->mesh->n_nodes * dim, &u_rid, m->model->mesh->n_cells * ns, &sigma_rid,
                         m->model->mesh->n_cells, &inelastic_rid));
  for (PetscInt i = 0; i < m->model->mesh->n_nodes; i++)
    PetscCall(PetscArraycpy(u_rid + i * dim, u + m->model->mesh->node_whole[i] * dim, dim));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    PetscCall(PetscArraycpy(sigma_rid + e * ns, sigma + m->model->mesh->cell_whole[e] * ns, ns));
    inelastic_rid[e] = inelastic[m->model->mesh->cell_whole[e]];
  }
  PetscCall(HycoROMMeasureRID(m, u_rid, sigma_rid, inelastic_rid, lambda, lost));
  lost[HYCO_ERROR_U] = (HycoErrorNorm){PetscSqrtReal(square[0]), PetscSqrtReal(square[1])};
  HycoTraceExcludeDisplacements(m, k, lost);
  PetscCall(PetscFree3(u_rid, sigma_rid, inelastic_rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicts in the same steps, and computes the errors. Rank 0. */
static PetscErrorCode ComparePathErrors(HycoROM m, PetscInt n, const PetscReal mu[], const HycoHistory *h, Kept *kept,
                                        HycoPathErrors *e)
{
  PetscInt reached;
  HycoErrorNorm *lost;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  /* Else ComparePathTime() would be read beyond its end. */
  HycoCheck(m->model->whole_nodes * m->model->mesh->dim == kept->n_dof && m->model->whole_cells == kept->n_cells &&
                m->model->pairs.n == kept->n_contacts,
            "the model was trained on a mesh of %d nodes and %d cells, and the scene's mesh has %d cells; compare on "
            "the training mesh",
            (int)m->model->whole_nodes, (int)m->model->whole_cells, (int)kept->n_cells);
  /* The same steps: else the difference would contain the error of time integration. */
  PetscCall(HycoROMSetSteps(m, h->n_taken, h->taken));
  HycoFinally(HycoROMPredict(m, n, mu), PetscCall(HycoROMSetSteps(m, 0, NULL)));
  /* A prediction may end before the path does. */
  reached = PetscMin(kept->n, m->trace.n_listed);
  PetscCall(PetscMalloc1(reached * HYCO_N_ERRORS, &lost));
  for (PetscInt k = 0; k < reached; k++) PetscCall(ComparePathMeasure(m, kept, k, lost + k * HYCO_N_ERRORS));
  HycoPathErrorsJudge(reached, lost, e);
  e->n_full = kept->n;
  PetscCall(PetscFree(lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path is solved, and kept on rank 0. Collective. One that ends early is a reference at the listed times before. */
static PetscErrorCode CompareRowCache(HycoROM m, HycoFOM f, PetscInt n, const PetscReal mu[], Kept *kept,
                                      HycoPathErrors *e)
{
  HycoHistory h;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(f, &h));
  HycoCheck(h.n, "full order reaches no listed time of the path: %s; no comparison is possible", h.why);
  HycoOnRoot(HycoComm(f), ComparePathErrors(m, n, mu, &h, kept, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Memory: a whole solution for each listed time, on rank 0. */
PetscErrorCode HycoROMComparePath(HycoROM m, HycoFOM f, PetscInt n, const PetscReal mu[], HycoPathErrors *e)
{
  Kept kept = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoROMComparePath: the scene has no history; use HycoROMCompare()");
  kept.n_dof = f->n_nodes * f->fe->dim;
  kept.n_sigma = f->n_cells * f->fe->n_sigma;
  kept.n_cells = f->n_cells;
  kept.n_contacts = f->n_contacts;
  if (f->rank == 0)
    PetscCall(PetscMalloc1((size_t)(kept.n_dof + kept.n_sigma + kept.n_cells + kept.n_contacts) *
                               (size_t)(f->scene->n_times + 1),
                           &kept.value));
  PetscCall(HycoFOMSetStepMonitor(f, ComparePathKeep, &kept));
  ierr = HycoFOMSolve(f, n, mu);
  /* The monitor is removed first, on success and failure, as `kept` is on this stack. */
  PetscCall(HycoFOMSetStepMonitor(f, NULL, NULL));
  if (!ierr) ierr = CompareRowCache(m, f, n, mu, &kept, e);
  PetscCall(PetscFree(kept.value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
