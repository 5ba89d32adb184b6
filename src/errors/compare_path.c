/* The path of a model against that of the full order, at the listed times. */
#include <hycopath.h>
#include <hycoreducerimpl.h>

/* Each kind at its worst time and at the end. */
static void Judge(PetscInt n, const HycoLost lost[], HycoPathErrors *e)
{
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    PetscReal size = 0;

    for (PetscInt k = 0; k < n; k++) size = PetscMax(size, lost[k * HYCO_N_ERRORS + j].size);
    for (PetscInt k = 0; k < n; k++) {
      const HycoLost *here = &lost[k * HYCO_N_ERRORS + j];

      e->end[j] = HycoRelative(here->lost, PetscMax(here->size, HYCO_SMALL_FORCE * size));
      if (e->end[j] <= e->worst[j]) continue;
      e->worst[j] = e->end[j];
      e->at[j] = k;
    }
    if (j == HYCO_ERROR_LAMBDA) e->force = size;
    if (j == HYCO_ERROR_LAMBDA_RID) e->force_rid = size;
  }
}

PetscErrorCode HycoROMMeasurePath(HycoROM m, const HycoPathSource *source, HycoPathErrors *e)
{
  const PetscInt n_sigma = m->whole_cells * m->fe->n_sigma;
  PetscReal *u, *sigma, *inelastic, *lambda;
  HycoLost *lost;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(e, sizeof(*e)));
  e->n_full = source->n;
  e->n = PetscMin(source->n, m->trace.n_listed);
  PetscCall(PetscMalloc5(m->whole_nodes * m->mesh->dim, &u, n_sigma, &sigma, m->whole_cells, &inelastic, m->pairs.n,
                         &lambda, e->n * HYCO_N_ERRORS, &lost));
  for (PetscInt k = 0; k < e->n; k++) {
    PetscCall((*source->read)(source->ctx, k, u, sigma, inelastic, lambda));
    PetscCall(HycoROMSetStep(m, k));
    PetscCall(HycoROMMeasureErrors(m, u, sigma, inelastic, lambda, lost + k * HYCO_N_ERRORS));
  }
  Judge(e->n, lost, e);
  PetscCall(PetscFree5(u, sigma, inelastic, lambda, lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full-order path on rank 0, as its listed times come. */
typedef struct {
  PetscInt n_dof, n_sigma, n_cells, n_contacts, n;
  PetscReal *value; /* of each time u, sigma, inelastic, lambda */
} Kept;

static PetscReal *At(const Kept *kept, PetscInt k)
{
  return kept->value + (size_t)k * (size_t)(kept->n_dof + kept->n_sigma + kept->n_cells + kept->n_contacts);
}

/* A HycoStepMonitor. */
static PetscErrorCode Keep(HycoFOM f, const HycoStep *step, void *ctx)
{
  Kept *kept = (Kept *)ctx;
  const PetscReal *u, *sigma;
  PetscReal *to = f->rank ? NULL : At(kept, step->index), *mine;
  HycoFileOrder *all;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetSolution(f, NULL, &u, NULL, NULL, NULL, &sigma));
  PetscCall(PetscMalloc1(f->part->n_cells, &mine));
  PetscCall(HycoFEStateFields(f->fe, f->path->begin, NULL, NULL, mine, NULL));
  if (f->rank == 0) {
    PetscCall(PetscArraycpy(to, u, kept->n_dof));
    PetscCall(PetscArraycpy(to + kept->n_dof, sigma, kept->n_sigma));
    PetscCall(PetscArraycpy(to + kept->n_dof + kept->n_sigma + kept->n_cells, f->lambda, kept->n_contacts));
  }
  if (f->size == 1)
    PetscCall(PetscArraycpy(to + kept->n_dof + kept->n_sigma, mine, kept->n_cells));
  else {
    PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, f->surface, PETSC_TRUE, &all));
    PetscCall(HycoFileOrderSend(all, HYCO_ON_CELLS, MPIU_REAL, 1, mine, to ? to + kept->n_dof + kept->n_sigma : NULL));
    PetscCall(HycoFileOrderDestroy(&all));
  }
  PetscCall(PetscFree(mine));
  kept->n = step->index + 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadKept(void *ctx, PetscInt k, PetscReal u[], PetscReal sigma[], PetscReal inelastic[],
                               PetscReal lambda[])
{
  const Kept *kept = (const Kept *)ctx;
  const PetscReal *from = At(kept, k);

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(u, from, kept->n_dof));
  PetscCall(PetscArraycpy(sigma, from + kept->n_dof, kept->n_sigma));
  PetscCall(PetscArraycpy(inelastic, from + kept->n_dof + kept->n_sigma, kept->n_cells));
  PetscCall(PetscArraycpy(lambda, from + kept->n_dof + kept->n_sigma + kept->n_cells, kept->n_contacts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The prediction in the same steps, and its errors. Rank 0. */
static PetscErrorCode Compare(HycoROM m, PetscInt n, const PetscReal mu[], const HycoHistory *h, Kept *kept,
                              HycoPathErrors *e)
{
  const HycoPathSource source = {kept->n, ReadKept, kept};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheck(m->whole_nodes * m->mesh->dim == kept->n_dof && m->whole_cells == kept->n_cells &&
                m->pairs.n == kept->n_contacts,
            "the model was trained on a mesh of %d nodes and %d cells, and the scene's has %d cells: compare on the "
            "training mesh",
            (int)m->whole_nodes, (int)m->whole_cells, (int)kept->n_cells);
  PetscCall(HycoROMSetSteps(m, h->n_taken, h->taken));
  ierr = HycoROMPredict(m, n, mu);
  PetscCall(HycoROMSetSteps(m, 0, NULL));
  PetscCall(ierr);
  PetscCall(HycoROMMeasurePath(m, &source, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMComparePath(HycoROM m, HycoFOM f, PetscInt n, const PetscReal mu[], HycoPathErrors *e)
{
  Kept kept = {0};
  HycoHistory h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoROMComparePath: the scene has no history; HycoROMCompare() is for its solutions");
  kept.n_dof = f->n_nodes * f->fe->dim;
  kept.n_sigma = f->n_cells * f->fe->n_sigma;
  kept.n_cells = f->n_cells;
  kept.n_contacts = f->n_contacts;
  if (f->rank == 0)
    PetscCall(PetscMalloc1((size_t)(kept.n_dof + kept.n_sigma + kept.n_cells + kept.n_contacts) *
                               (size_t)(f->scene->n_times + 1),
                           &kept.value));
  PetscCall(HycoFOMSetStepMonitor(f, Keep, &kept));
  ierr = HycoFOMSolve(f, n, mu);
  PetscCall(HycoFOMSetStepMonitor(f, NULL, NULL));
  PetscCall(ierr);
  PetscCall(HycoFOMGetHistory(f, &h));
  HycoCheck(h.ended, "the full-order path ends at t = %.10g: %s; there is nothing to compare with", (double)h.t, h.why);
  HycoOnRoot(HycoComm(f), Compare(m, n, mu, &h, &kept, e));
  PetscCall(PetscFree(kept.value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
