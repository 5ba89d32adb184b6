/*
  Laws at some integration points along known displacements, with the derivatives of their states by parameters: a
  step's derivative follows from that of the displacements, of the state before it, and of the data beside the
  parameters.
*/
#include <hycoinelastic.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

#define BESIDE 5 /* the data at the parameters, and at points beside them */

/* The data at a point of the parameters. */
typedef struct {
  PetscBool there, strained; /* strained: with strains, weights and places of its own */
  PetscInt place;            /* of x, a number of fe's; 0: none yet */
  PetscReal *x, *temperature, *thermal, *strain, *weight, *memory; /* memory: of the constants, by run */
} Data;

struct _n_HycoFEPoints {
  HycoFE fe; /* borrowed */
  PetscInt n, n_slopes, *point;
  PetscInt n_runs, *run;       /* points of one body that follow each other: run[n_runs + 1] */
  PetscInt n_state, *state_at; /* by run: its first state variable, n_runs + 1 */
  const PetscReal **constant;  /* by run: HYCO_MAX_DECLARED */
  Data data[BESIDE];           /* the first: at the parameters */
  PetscReal t0, t1;
  PetscBool fresh; /* no slope of this step has been taken */
  char *solved;    /* by point: solved_size bytes of the largest law */
  size_t size;
  PetscReal *elastic, *stress;                           /* n x n_sigma: strain without thermal strain */
  PetscReal *state0, *state, *nothing;                   /* at the begin and the end of the step */
  PetscReal *slope0, *slope;                             /* by parameter: n_state */
  PetscReal *along, *by_stress, *by_lost, *change, *hot; /* of the slope in hand */
};

/* NULL-safe. */
PetscErrorCode HycoFEPointsDestroy(HycoFEPoints *points)
{
  HycoFEPoints p = *points;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < BESIDE; k++)
    HycoFreeAll(&p->data[k].x, &p->data[k].temperature, &p->data[k].thermal, &p->data[k].strain, &p->data[k].weight,
                &p->data[k].memory);
  HycoFreeAll(&p->solved, &p->point, &p->run, &p->state_at, &p->constant, &p->elastic, &p->stress, &p->state0,
              &p->state, &p->nothing, &p->slope0, &p->slope, &p->along, &p->by_stress, &p->by_lost, &p->change, &p->hot,
              points);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static HycoMaterial LawOf(HycoFEPoints p, PetscInt run)
{
  const PetscInt nq = HycoElementGet(p->fe->mesh->type)->nq;

  return p->fe->scene->body[p->fe->mesh->cell_body[p->point[p->run[run]] / nq]].law;
}

PetscErrorCode HycoFEPointsCreate(HycoFE fe, PetscInt n, const PetscInt point[], PetscInt n_slopes,
                                  HycoFEPoints *points)
{
  const PetscInt ns = fe->n_sigma, nq = HycoElementGet(fe->mesh->type)->nq, *of = fe->mesh->cell_body;
  HycoFEPoints p;

  PetscFunctionBegin;
  PetscCall(PetscNew(points));
  p = *points;
  p->fe = fe;
  p->n = n;
  p->n_slopes = n_slopes;
  HycoDuplicate(n, point, &p->point);
  PetscCall(PetscCalloc1(n + 1, &p->run));
  PetscCall(PetscCalloc1(n + 1, &p->state_at));
  for (PetscInt i = 0; i < n; i++) {
    if (!i || of[point[i] / nq] != of[point[i - 1] / nq]) p->run[p->n_runs++] = i;
    p->run[p->n_runs] = i + 1;
  }
  for (PetscInt r = 0; r < p->n_runs; r++)
    p->state_at[r + 1] = p->state_at[r] + (p->run[r + 1] - p->run[r]) * LawOf(p, r)->n_state;
  p->n_state = p->state_at[p->n_runs];
  for (PetscInt r = 0; r < p->n_runs; r++) p->size = PetscMax(p->size, LawOf(p, r)->solved_size);
  PetscCall(PetscMalloc1(p->size * (size_t)n + 1, &p->solved));
  PetscCall(PetscCalloc1(p->n_runs * HYCO_MAX_DECLARED + 1, &p->constant));
  for (PetscInt k = 0; k < BESIDE; k++) {
    PetscCall(PetscMalloc1(3 * n + 1, &p->data[k].x));
    PetscCall(PetscCalloc1(n + 1, &p->data[k].temperature));
    PetscCall(PetscCalloc1(n + 1, &p->data[k].thermal));
    PetscCall(PetscMalloc1(n * ns + 1, &p->data[k].strain));
    PetscCall(PetscMalloc1(n + 1, &p->data[k].weight));
    PetscCall(PetscMalloc1(n * HYCO_MAX_DECLARED + 1, &p->data[k].memory));
  }
  PetscCall(PetscMalloc1(n * ns + 1, &p->elastic));
  PetscCall(PetscCalloc1(n * ns + 1, &p->stress));
  PetscCall(PetscCalloc1(n * ns + 1, &p->nothing));
  PetscCall(PetscMalloc1(n * ns + 1, &p->along));
  PetscCall(PetscMalloc1(n * ns + 1, &p->by_stress));
  PetscCall(PetscMalloc1(n * ns + 1, &p->by_lost));
  PetscCall(PetscMalloc1(n * HYCO_MAX_DECLARED + 1, &p->change));
  PetscCall(PetscMalloc1(n + 1, &p->hot));
  PetscCall(PetscCalloc1(p->n_state + 1, &p->state0));
  PetscCall(PetscCalloc1(p->n_state + 1, &p->state));
  PetscCall(PetscCalloc1(n_slopes * p->n_state + 1, &p->slope0));
  PetscCall(PetscCalloc1(n_slopes * p->n_state + 1, &p->slope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEPointsBegin(HycoFEPoints p)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(p->state0, p->n_state));
  PetscCall(PetscArrayzero(p->state, p->n_state));
  PetscCall(PetscArrayzero(p->stress, p->n * p->fe->n_sigma));
  PetscCall(PetscArrayzero(p->slope0, p->n_slopes * p->n_state));
  PetscCall(PetscArrayzero(p->slope, p->n_slopes * p->n_state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEPointsAccept(HycoFEPoints p)
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(p->state0, p->state, p->n_state));
  PetscCall(PetscArraycpy(p->slope0, p->slope, p->n_slopes * p->n_state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strains of u, n x n_sigma, and the weights (NULL: not wanted). */
static PetscErrorCode LawDerivativesStrains(HycoFEPoints p, const PetscReal u[], PetscReal strain[], PetscReal weight[])
{
  HycoFE fe = p->fe;
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt ns = fe->n_sigma;
  PetscReal g[HYCO_CELL_NODES][3], mean[HYCO_CELL_NODES][3], w, e[6];
  PetscInt last = -1;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < p->n; i++) {
    const PetscInt cell = p->point[i] / el->nq, q = p->point[i] % el->nq;
    const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
    PetscReal(*at)[3] = g;

    if (HycoGradientsKept(fe)) {
      at = (PetscReal(*)[3])HycoKeptGradients(fe, el, cell, q);
      w = ((const PetscReal *)at)[3 * el->nv];
    } else
      PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    if (bbar && cell != last) PetscCall(HycoMeanGradients(fe, el, cell, mean));
    last = cell;
    if (weight) weight[i] = w;
    HycoPointStrain(fe, el, cell, u, at, bbar ? mean : NULL, e);
    PetscCall(PetscArraycpy(strain + i * ns, e, ns));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u NULL: strains and places are those of the step. constant: by run, HYCO_MAX_DECLARED. */
static PetscErrorCode TakeData(HycoFEPoints p, const PetscReal u[], Data *d, const PetscReal *constant[])
{
  HycoFE fe = p->fe;
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < p->n; i++) {
    if (u && d->place != fe->place) HycoPointPlace(fe, el, p->point[i] / el->nq, p->point[i] % el->nq, d->x + 3 * i);
    if (fe->temperature) d->temperature[i] = fe->temperature[p->point[i]];
    if (fe->thermal) d->thermal[i] = fe->thermal[p->point[i]];
  }
  if (u) d->place = fe->place;
  if (u)
    PetscCall(LawDerivativesStrains(p, u, d->strain, d->weight));
  else {
    d->place = p->data[0].place;
    PetscCall(PetscArraycpy(d->x, p->data[0].x, 3 * p->n));
  }
  d->strained = (PetscBool)(u != NULL);
  for (PetscInt r = 0; r < p->n_runs; r++) {
    const HycoMaterial law = LawOf(p, r);

    PetscCall(HycoMaterialConstants(law, fe->mu, p->run[r + 1] - p->run[r], d->x + 3 * p->run[r],
                                    law->temperature ? d->temperature + p->run[r] : NULL,
                                    d->memory + p->run[r] * HYCO_MAX_DECLARED, constant + r * HYCO_MAX_DECLARED));
  }
  d->there = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law's points of a run. */
static HycoMaterialPoints RunOf(HycoFEPoints p, PetscInt r)
{
  const PetscInt ns = p->fe->n_sigma, at = p->run[r];

  return (HycoMaterialPoints){.n = p->run[r + 1] - at,
                              .dim = p->fe->dim,
                              .n_strain = ns,
                              .constant = p->constant + r * HYCO_MAX_DECLARED,
                              .dt = p->t1 - p->t0,
                              .strain0 = p->nothing + at * ns,
                              .strain = p->elastic + at * ns,
                              .stress0 = p->nothing + at * ns,
                              .temperature = LawOf(p, r)->temperature ? p->data[0].temperature + at : NULL,
                              .state0 = p->state0 + p->state_at[r],
                              .state = p->state + p->state_at[r],
                              .stress = p->stress + at * ns};
}

PetscErrorCode HycoFEPointsStep(HycoFEPoints p, const PetscReal u[], PetscReal t0, PetscReal t1, PetscReal s[],
                                PetscReal lost[])
{
  const PetscInt ns = p->fe->n_sigma, nq = HycoElementGet(p->fe->mesh->type)->nq;

  PetscFunctionBegin;
  p->t0 = t0;
  p->t1 = t1;
  p->fresh = PETSC_TRUE;
  for (PetscInt k = 1; k < BESIDE; k++) p->data[k].there = PETSC_FALSE;
  PetscCall(TakeData(p, u, &p->data[0], p->constant));
  for (PetscInt i = 0; i < p->n * ns; i++)
    p->elastic[i] = p->data[0].strain[i] - (i % ns < 3 ? p->data[0].thermal[i / ns] : 0);
  for (PetscInt r = 0; r < p->n_runs; r++) {
    HycoMaterialPoints m = RunOf(p, r);

    if (lost) m.tangent = lost + p->run[r] * ns * ns;
    PetscCall(HycoMaterialUpdate(LawOf(p, r), &m));
    HycoCheck(m.failed < 0, "the laws cannot be integrated along the predicted displacements at t = %.10g: %s",
              (double)t1, m.why ? m.why : "no answer");
  }
  for (PetscInt i = 0; i < p->n && s; i++) {
    const PetscReal *C = p->fe->tangent + p->fe->tangent_start[p->point[i] / nq] + p->point[i] % nq * ns * ns;

    HycoTangentApply(PETSC_FALSE, p->fe->dim, C, p->elastic + i * ns, s + i * ns);
    for (PetscInt c = 0; c < ns; c++) s[i * ns + c] -= p->stress[i * ns + c];
    for (PetscInt c = 0; c < ns * ns; c++) lost[i * ns * ns + c] = C[c] - lost[i * ns * ns + c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

const PetscReal *HycoFEPointsStress(HycoFEPoints p)
{
  return p->stress;
}

const PetscReal *HycoFEPointsWeights(HycoFEPoints p)
{
  return p->data[0].weight;
}

PetscBool HycoFEPointsChange(HycoFEPoints p, const PetscBool changed[], PetscBool *strains)
{
  const HycoScene s = p->fe->scene;
  const HycoChanges c = HycoSceneChanges(s, changed);

  *strains = (PetscBool)(c.nodes || HycoSceneSupportsChange(s, p->fe->mesh, changed, c.nodes));
  if (*strains) return PETSC_TRUE;
  for (PetscInt r = 0; r < p->n_runs; r++) {
    const HycoBody *body =
        &s->body[p->fe->mesh->cell_body[p->point[p->run[r]] / HycoElementGet(p->fe->mesh->type)->nq]];

    if (HycoDeclaredChanges(&body->law->constants, NULL, changed) || HycoExprChanges(body->temperature, changed) ||
        HycoExprChanges(body->reference, changed) || HycoExprChanges(body->expansion, changed))
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* At fe's parameters, which are not those of the step. */
PetscErrorCode HycoFEPointsPerturbed(HycoFEPoints p, PetscInt id, PetscBool changes, const PetscReal u[])
{
  const PetscReal **constant;

  PetscFunctionBegin;
  p->data[id].there = PETSC_FALSE;
  if (!changes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p->n_runs * HYCO_MAX_DECLARED + 1, &constant));
  HycoFinally(TakeData(p, u, &p->data[id], constant), PetscCall(PetscFree(constant)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weighted sum of the data of three points; of those that are not there, as at the parameters. */
#define SUM(p, id, weight, array, i)                                                                                   \
  ((weight)[0] * (p)->data[0].array[i] + (weight)[1] * (p)->data[(p)->data[(id)[1]].there ? (id)[1] : 0].array[i] +    \
   (weight)[2] * (p)->data[(p)->data[(id)[2]].there ? (id)[2] : 0].array[i])

static PetscBool LawDerivativesMove(HycoFEPoints p, const PetscInt id[3])
{
  return (PetscBool)(p->data[id[1]].there || p->data[id[2]].there);
}

static PetscBool LawStrainDerivatives(HycoFEPoints p, const PetscInt id[3])
{
  return (PetscBool)(LawDerivativesMove(p, id) && p->data[id[1]].strained && p->data[id[2]].strained);
}

void HycoFEPointsWeightDerivatives(HycoFEPoints p, const PetscReal weight[3], const PetscInt id[3], PetscReal slope[])
{
  for (PetscInt i = 0; i < p->n; i++) slope[i] = LawStrainDerivatives(p, id) ? SUM(p, id, weight, weight, i) : 0;
}

PetscErrorCode HycoFEPointsDerivatives(HycoFEPoints p, PetscInt k, const PetscReal weight[3], const PetscInt id[3],
                                       const PetscReal du[], PetscReal ds[], PetscReal dstress[], PetscBool *smooth)
{
  const PetscInt ns = p->fe->n_sigma;
  const PetscBool moves = LawDerivativesMove(p, id), strained = LawStrainDerivatives(p, id);
  PetscReal *lost = ds ? ds : p->by_lost, *stress = dstress ? dstress : p->by_stress, rate = 0, apart = 0;

  PetscFunctionBegin;
  PetscCall(LawDerivativesStrains(p, du, p->along, NULL));
  for (PetscInt i = 0; i < p->n && moves; i++) {
    p->hot[i] = SUM(p, id, weight, temperature, i);
    for (PetscInt c = 0; c < ns; c++) {
      if (strained) p->along[i * ns + c] += SUM(p, id, weight, strain, i * ns + c);
      if (c < 3) p->along[i * ns + c] -= SUM(p, id, weight, thermal, i);
    }
  }
  for (PetscInt r = 0; r < p->n_runs; r++) {
    const PetscInt at = p->run[r], n = p->run[r + 1] - at, n_constants = LawOf(p, r)->constants.n;
    const HycoMaterialPoints m = RunOf(p, r);
    const PetscReal *constant[HYCO_MAX_DECLARED];
    HycoMaterialDerivative d = {.strain = p->along + at * ns,
                                .state0 = p->slope0 + k * p->n_state + p->state_at[r],
                                .constant = moves ? constant : NULL,
                                .temperature = m.temperature ? p->hot + at : NULL,
                                .state = p->slope + k * p->n_state + p->state_at[r],
                                .stress = stress + at * ns,
                                .lost = lost + at * ns};

    for (PetscInt j = 0; j < n_constants; j++) {
      constant[j] = p->change + at * HYCO_MAX_DECLARED + j * n;
      for (PetscInt i = 0; i < n && moves; i++)
        p->change[at * HYCO_MAX_DECLARED + j * n + i] = SUM(p, id, weight, memory, at * HYCO_MAX_DECLARED + j * n + i);
    }
    PetscCall((*LawOf(p, r)->slopes)(LawOf(p, r), &m, p->fresh, p->solved + p->size * (size_t)at, &d));
    rate = PetscMax(rate, d.rate);
    apart = PetscMax(apart, d.apart);
  }
  p->fresh = PETSC_FALSE;
  /* On the border of yielding: only where the derivative stays there is it that of both sides. */
  *smooth = (PetscBool)(apart <= 1e-7 * rate);
  PetscFunctionReturn(PETSC_SUCCESS);
}
