/*
  Derivatives of a path of bodies that deform inelastically by its parameters, step by step. A step solves r(alpha) =
  T^T s(e) - alpha = 0, with the contact forces z(alpha) on its states. At the step's solution, with J = -dr / dalpha at
  the laws' tangents there,

      J alpha' = T^T s' + T'^T s,     z' = z'_0 + Z alpha'

  where s' and z'_0 are the derivatives at the same alpha: by the data, and by the laws' states before the step, which
  have derivatives of their own (law_slopes.c); then these states follow from alpha' and z'. On the border of yielding,
  or of two states of a contact, the derivative serves if it stays there.
*/
#include "bodies_path.h"
#include <hycoentries.h>
#include <petscblaslapack.h>

struct _n_HycoBodiesLaws {
  PetscInt n_taken, room, width; /* by accepted step: alpha, and without friction x and the forces */
  PetscReal *taken;
  HycoFE fe; /* the model's mesh, for the laws and beside the path; NULL: no derivatives have been asked for */
  HycoFEPoints points;
  PetscInt *row;             /* by contact: itself */
  const PetscReal *alpha;    /* of the step */
  PetscReal *dalpha;         /* m */
  PetscReal *u, *du;         /* n_dof: beside the step; along the parameter in hand, without prescribed ones */
  PetscReal *cells, *dcells; /* nd: displacements, and along the parameter */
  PetscReal *ds, *weight;    /* n_rows; by point */
  PetscReal *w, *z, *q;      /* p + rows */
  PetscReal size;            /* of gaps */
};

PetscErrorCode HycoBodiesLawsDestroy(HycoBodiesPath w)
{
  HycoBodiesLaws o = w->laws;

  PetscFunctionBegin;
  if (!o) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEPointsDestroy(&o->points));
  PetscCall(HycoFEDestroy(&o->fe));
  HycoFreeAll(&o->taken, &o->row, &o->dalpha, &o->u, &o->du, &o->cells, &o->dcells, &o->ds, &o->weight, &o->w, &o->z,
              &o->q, &w->laws);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesLawsBegin(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (!w->path->flows) PetscFunctionReturn(PETSC_SUCCESS);
  if (!w->laws) PetscCall(PetscNew(&w->laws));
  w->laws->n_taken = 0;
  w->laws->width = w->bodies.bodies->inelastic->m + (w->friction ? 0 : w->bodies.bodies->p + w->surface.n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesLawsRecord(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  const PetscInt l = w->bodies.bodies->inelastic->m, p = w->bodies.bodies->p;
  PetscReal *to;

  PetscFunctionBegin;
  if (!o) PetscFunctionReturn(PETSC_SUCCESS);
  if (o->n_taken == o->room) {
    o->room = 2 * o->room + 64;
    PetscCall(PetscRealloc((size_t)o->room * (size_t)o->width * sizeof(PetscReal) + 1, &o->taken));
  }
  to = o->taken + (size_t)o->n_taken++ * (size_t)o->width;
  PetscCall(PetscArraycpy(to, alpha, l));
  if (w->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(to + l, w->bodies.x, p));
  PetscCall(HycoVecRead(w->path->contact.Lambda, w->surface.n, to + l + p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesLawsMake(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt N = w->bodies.bodies->p + w->surface.n;

  PetscFunctionBegin;
  if (o->fe) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFECreate(m->model->scene, m->model->mesh->dm, &o->fe));
  PetscCall(HycoFEPointsCreate(o->fe, in->n_points, w->point, m->model->scene->n_parameters, &o->points));
  PetscCall(PetscMalloc1(w->surface.n + 1, &o->row));
  for (PetscInt k = 0; k < w->surface.n; k++) o->row[k] = k;
  PetscCall(PetscCalloc1(in->m + 1, &o->dalpha));
  PetscCall(PetscMalloc1(m->fe->n_dof, &o->u));
  PetscCall(PetscCalloc1(m->fe->n_dof, &o->du));
  PetscCall(PetscMalloc1(in->nd + 1, &o->cells));
  PetscCall(PetscMalloc1(in->nd + 1, &o->dcells));
  PetscCall(PetscMalloc1(w->n_rows + 1, &o->ds));
  PetscCall(PetscMalloc1(in->n_points + 1, &o->weight));
  PetscCall(PetscMalloc1(N + 1, &o->w));
  PetscCall(PetscMalloc1(N + 1, &o->z));
  PetscCall(PetscMalloc1(N + 1, &o->q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every law that deforms inelastically has derivatives by its data. */
static PetscBool LawsHaveDerivatives(HycoScene s)
{
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    if (!s->body[b].law->linear && !s->body[b].law->slopes) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The forces, and what they are for other alpha. */
static PetscErrorCode LineariseContacts(HycoROM m, PetscInt k, HycoStepAttempt *a, PetscBool *able)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  const PetscInt l = w->bodies.bodies->inelastic->m, p = w->bodies.bodies->p;

  PetscFunctionBegin;
  if (w->friction) {
    PetscCall(HycoBodiesSensitivityLinearise(m, w->friction, &w->bodies, k, w->n_rows ? o->alpha : NULL, able));
    if (*able && w->n_rows) PetscCall(HycoBodiesTakeMap(m, o->alpha, a));
  } else {
    const PetscReal *x = o->alpha + l;

    PetscCall(HycoBodiesTakeSet(m, x + p));
    PetscCall(PetscArraycpy(w->bodies.x, x, p));
    PetscCall(PetscArraycpy(m->Lambda, x + p, w->surface.n));
    PetscCall(HycoBodiesStrain(&w->bodies, &w->surface, o->alpha));
    HycoBodiesDisplacementsOfForces(&w->bodies, &w->surface, m->Lambda);
  }
  *able = (PetscBool)(*able && !a->why[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws at the step's displacements, from the state before it. */
static PetscErrorCode LineariseLaws(HycoROM m, PetscInt k, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscReal *t = m->trace.t;

  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(o->fe, m->fe->mu));
  PetscCall(HycoFEKeepGradients(o->fe));
  if (k)
    PetscCall(HycoFEPointsAccept(o->points));
  else
    PetscCall(HycoFEPointsBegin(o->points));
  PetscCall(HycoBodiesMoveCells(m, o->alpha, w->friction ? HycoBodiesFrictionForces(w->friction) : m->Lambda));
  for (PetscInt i = 0; i < in->nd; i++) o->cells[i] = w->u[w->at[i]];
  PetscCall(HycoFEPointsStep(o->points, w->u, t[PetscMax(k - 1, 0)], t[k], w->s, w->lost));
  PetscCall(HycoBodiesTangent(m, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesLawsLinearise(HycoROM m, PetscInt k, PetscBool *able)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  HycoStepAttempt a = {.why = ""};

  PetscFunctionBegin;
  *able = (PetscBool)(o && o->n_taken == m->trace.n && LawsHaveDerivatives(m->model->scene));
  if (!*able || k < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BodiesLawsMake(m));
  o->alpha = o->taken + (size_t)k * (size_t)o->width;
  w->bodies.alpha = o->alpha;
  w->bodies.dalpha = o->dalpha;
  PetscCall(LineariseContacts(m, k, &a, able));
  if (*able && w->n_rows) PetscCall(LineariseLaws(m, k, &a));
  *able = (PetscBool)(*able && !a.why[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesLawsResidual(HycoROM m, const PetscInt **row, PetscReal w[], PetscReal *size)
{
  HycoBodiesPath o = (HycoBodiesPath)m->work;
  const PetscInt p = o->bodies.bodies->p;

  PetscFunctionBegin;
  *row = o->laws->row;
  HycoBodiesGaps(m, w + p, size);
  o->laws->size = *size;
  PetscCall(PetscArraycpy(o->laws->w + p, w + p, o->surface.n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu[] differs from the model's parameters by one, whose difference has this point. */
PetscErrorCode HycoBodiesLawsPerturbed(HycoROM m, const PetscReal mu[], PetscInt point)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  const PetscReal *own = w->bodies.mu;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, strains;

  PetscFunctionBegin;
  if (!w->n_rows) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < m->model->scene->n_variables; p++) changed[p] = (PetscBool)(mu[p] != own[p]);
  if (!HycoFEPointsChange(o->points, changed, &strains)) {
    PetscCall(HycoFEPointsPerturbed(o->points, point, PETSC_FALSE, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (strains) PetscCall(HycoFESetParameters(o->fe, own));
  for (PetscInt i = 0; i < o->fe->n_dof && strains; i++) o->u[i] = w->u[i] - o->fe->u0[i];
  PetscCall(HycoFESetParameters(o->fe, mu));
  for (PetscInt i = 0; i < o->fe->n_dof && strains; i++) o->u[i] += o->fe->u0[i];
  PetscCall(HycoFEPointsPerturbed(o->points, point, PETSC_TRUE, strains ? o->u : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws' derivatives for the motions and forces dz, and those of alpha. */
static PetscErrorCode LawDerivativesOfMotions(HycoROM m, PetscInt parameter, const PetscReal weight[3],
                                              const PetscInt point[3], const PetscReal dz[], PetscBool *smooth)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;

  PetscFunctionBegin;
  PetscCall(HycoBodiesCellsDerivatives(&w->bodies, w->surface.n, o->row, weight + 1, point + 1, dz, o->dalpha, o->cells,
                                       o->dcells));
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) o->du[w->at[i]] = o->dcells[i];
  PetscCall(HycoFEPointsDerivatives(o->points, parameter, weight, point, o->du, o->ds, NULL, smooth));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* dalpha = J^-1 (T^T s' + T'^T s). */
static PetscErrorCode SolveStrains(HycoROM m, const PetscReal weight[3], const PetscInt point[3])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  const PetscInt l = w->bodies.bodies->inelastic->m, ns = m->fe->n_sigma;
  const PetscReal *own = HycoFEPointsWeights(o->points),
                  of = m->fe->dim == 3 || m->fe->formulation == HYCO_AXISYMMETRIC ? 3 : 2;

  PetscFunctionBegin;
  HycoFEPointsWeightDerivatives(o->points, weight, point, o->weight);
  PetscCall(PetscArrayzero(o->dalpha, l));
  for (PetscInt i = 0; i < w->n_rows; i++) {
    /* T follows the size of its point, w^((of - 1) / of) (bodies_newton.c). */
    const PetscReal scale = (of - 1) / of * o->weight[i / ns] / own[i / ns];

    HycoBodiesAdd(l, o->ds[i] + scale * w->s[i], w->T + i * l, o->dalpha);
  }
  PetscCall(HycoBodiesSolveTangent(w, o->dalpha));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* q -= B P dalpha, in the rows of contacts. */
static void AddStrains(HycoBodiesPath w, PetscReal q[])
{
  const PetscInt l = w->bodies.bodies->inelastic->m;

  for (PetscInt k = 0; k < w->surface.n; k++) {
    for (PetscInt i = 0; i < l; i++) q[w->bodies.bodies->p + k] -= w->BP[k * l + i] * w->laws->dalpha[i];
  }
}

/* Whether contacts without force and gap stay so, for the change q of the gaps at fixed forces, and dz. */
static PetscBool BodiesLawsStateStays(HycoROM m, const PetscReal q[], const PetscReal dz[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  const PetscInt p = w->bodies.bodies->p;
  PetscReal most = 0, rate[2] = {0, 0};

  for (PetscInt k = 0; k < w->surface.n; k++) {
    most = PetscMax(most, m->Lambda[k]);
    rate[0] = PetscMax(rate[0], PetscAbsReal(dz[p + k]));
    rate[1] = PetscMax(rate[1], PetscAbsReal(q[p + k]));
  }
  for (PetscInt k = 0; k < w->surface.n; k++) {
    PetscReal gap = q[p + k];

    if (m->Lambda[k] > HYCO_UNDECIDED * most || o->w[p + k] > HYCO_UNDECIDED * o->size ||
        w->bodies.row_start[k] == w->bodies.row_start[k + 1])
      continue;
    for (PetscInt d = 0; d < p; d++) gap -= w->G[k * p + d] * dz[d];
    for (PetscInt i = 0; i < w->n_set; i++) gap += w->column[w->set[i]][k] * dz[p + w->set[i]];
    if (PetscAbsReal(dz[p + k]) > HYCO_RATE_ROUND_OFF * rate[0] || PetscAbsReal(gap) > HYCO_RATE_ROUND_OFF * rate[1])
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* dz on the contacts' states for the change q of the gaps at fixed forces and alpha. */
static PetscErrorCode BodiesLawsRespond(HycoROM m, PetscInt parameter, const PetscReal weight[3],
                                        const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                        PetscBool *regular)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt N = w->bodies.bodies->p + w->surface.n;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  if (w->friction) {
    PetscCall(HycoBodiesSensitivityAdvance(w->friction, parameter, weight, point, q, dz, regular));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt i = 0; i < N && w->bodies.bodies->p; i++) any = (PetscBool)(any || q[i] != 0);
  /* Without loads floating bodies have no place. */
  *regular = (PetscBool)(!any || !w->loose);
  PetscCall(HycoBodiesMoveSet(w, q, dz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesLawsSensitivity(HycoROM m, PetscInt parameter, const PetscReal weight[3],
                                         const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                         PetscBool *regular)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesLaws o = w->laws;
  PetscBool smooth = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(o->dalpha, w->bodies.bodies->inelastic->m));
  PetscCall(PetscArraycpy(o->q, q, w->bodies.bodies->p + w->surface.n));
  /* Whether the contacts keep their states is not yet known. */
  PetscCall(BodiesLawsRespond(m, parameter, weight, point, o->q, dz, regular));
  if (w->n_rows && (*regular || w->friction)) {
    /* Beside the step it was elsewhere. */
    PetscCall(HycoFESetParameters(o->fe, w->bodies.mu));
    PetscCall(HycoFEKeepGradients(o->fe));
    PetscCall(LawDerivativesOfMotions(m, parameter, weight, point, dz, &smooth));
    PetscCall(SolveStrains(m, weight, point));
    AddStrains(w, o->q);
    PetscCall(BodiesLawsRespond(m, parameter, weight, point, o->q, dz, regular));
    PetscCall(LawDerivativesOfMotions(m, parameter, weight, point, dz, &smooth));
  }
  *regular = (PetscBool)(*regular && smooth);
  if (*regular && w->friction)
    HycoBodiesSensitivityAccept(w->friction, parameter, dz);
  else if (*regular)
    *regular = BodiesLawsStateStays(m, o->q, dz);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After HycoBodiesLawsSensitivity(): the displacements of the points' cells are not those of the modes. */
void HycoBodiesLawsDerivatives(HycoROM m, PetscReal dU[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) dU[w->at[i]] = w->laws->du[w->at[i]];
}
