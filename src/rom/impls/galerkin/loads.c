/*
  In most scenes F is affine in loads and supports. The solutions without contact for F at the least values of the
  parameters on which neither the stiffness nor a contact row depends, and for the change of F over each one's range,
  give that of any load as a sum, once for each stiffness:

    K^-1 F(mu) = X_0 + sum_j t_j X_j,    t_j = (mu_j - lo_j) / (hi_j - lo_j)

  They depend on the ranges, not on earlier predictions, so that results do not depend on the order of the points. F
  itself is assembled at each mu: if it is not that sum, its system is solved.
*/
#include <hycogalerkin.h>

/* With more parameters a single prediction would cost more than a ramp gains. */
#define MAX_LOADS 3
#define AFFINE    1e-13 /* of a load's largest entry: 450 eps, the sum of up to eight loads */

struct _n_HycoLoads {
  PetscInt n, parameter[MAX_LOADS];
  PetscBool current, affine, given[1 + MAX_LOADS]; /* given: the vector is not zero */
  Vec F[1 + MAX_LOADS], X[1 + MAX_LOADS], sum;
};

/* n + 1 of each: the constant part is number 0. */
PetscErrorCode HycoLoadsDestroy(HycoLoads *loads)
{
  HycoLoads p = *loads;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt j = 0; j <= p->n; j++) {
    HycoDestroyAll(&p->F[j], &p->X[j]);
  }
  PetscCall(VecDestroy(&p->sum));
  PetscCall(PetscFree(*loads));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* None, or too many parameters of this kind: g->loads stays NULL, and each load is solved. */
PetscErrorCode HycoLoadsCreate(HycoROM m)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoScene s = m->model->scene;
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  PetscInt n = 0, parameter[HYCO_MAX_PARAMETERS];
  HycoLoads p;

  PetscFunctionBegin;
  HycoSceneReaches(m->fe->scene, reaches);
  for (PetscInt j = 0; j < s->n_parameters; j++) {
    /* Only parameters that leave the stiffness alone: K^-1 of them is one factor. */
    if (!reaches[j] && s->hi[j] > s->lo[j]) parameter[n++] = j;
  }
  if (!n || n > MAX_LOADS) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&p));
  g->loads = p;
  p->n = n;
  PetscCall(PetscArraycpy(p->parameter, parameter, n));
  for (PetscInt j = 0; j <= n; j++) {
    PetscCall(VecDuplicate(g->Fr, &p->F[j]));
    PetscCall(VecDuplicate(g->x, &p->X[j]));
  }
  PetscCall(VecDuplicate(g->Fr, &p->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The combination of load solutions belongs to one stiffness. NULL-safe. */
void HycoLoadsForget(HycoLoads loads)
{
  if (loads) loads->current = PETSC_FALSE;
}

/* y = v_0 + sum_j t_j v_j */
static PetscErrorCode LoadsSum(HycoLoads p, const Vec v[], const PetscReal t[], Vec y)
{
  PetscFunctionBegin;
  PetscCall(VecCopy(v[0], y));
  for (PetscInt j = 1; j <= p->n; j++) {
    if (p->given[j] && t[j] != 0) PetscCall(VecAXPY(y, t[j], v[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loads are affine in the parameters: 1 and each parameter's place between the ends of its range. Between 0 and 1,
   so that coefficients of different parameters are of one size. */
static void LoadsCoordinates(HycoROM m, const PetscReal mu[], PetscReal t[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoLoads p = g->loads;

  t[0] = 1;
  for (PetscInt j = 0; j < p->n; j++) {
    const PetscInt q = p->parameter[j];

    t[j + 1] = (mu[q] - m->model->scene->lo[q]) / (m->model->scene->hi[q] - m->model->scene->lo[q]);
  }
}

/* Whether m->Fr, assembled at mu, is the sum. */
static PetscErrorCode IsSum(HycoROM m, const PetscReal t[], PetscBool *is)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoLoads p = g->loads;
  PetscReal size, apart;

  PetscFunctionBegin;
  PetscCall(VecNorm(g->Fr, NORM_INFINITY, &size));
  PetscCall(LoadsSum(p, p->F, t, p->sum));
  PetscCall(VecAXPY(p->sum, -1, g->Fr));
  PetscCall(VecNorm(p->sum, NORM_INFINITY, &apart));
  /* Tested on the assembled vector at each mu: an expression may be affine at the middle by chance and not
     elsewhere. */
  *is = (PetscBool)(apart <= AFFINE * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m->Fr at the parameters mu, which differ from the current ones only in loads. */
static PetscErrorCode ForceAt(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(m->fe, mu));
  PetscCall(HycoFEAssembleForce(m->fe, g->F));
  PetscCall(HycoReducedFillVectors(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Samples the vectors F, and checks whether that at the middle of the ranges is their sum. */
static PetscErrorCode SampleForces(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoLoads p = g->loads;
  PetscReal at[HYCO_MAX_PARAMETERS], t[1 + MAX_LOADS];

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(at, mu, m->model->scene->n_parameters));
  for (PetscInt j = 0; j < p->n; j++) at[p->parameter[j]] = m->model->scene->lo[p->parameter[j]];
  /* F[0] at the lower ends; F[j] is the change by parameter j alone. Products of two loads are not found here but by
     the check at the middle. */
  for (PetscInt j = 0; j <= p->n; j++) {
    PetscReal size;

    if (j) at[p->parameter[j - 1]] = m->model->scene->hi[p->parameter[j - 1]];
    PetscCall(ForceAt(m, at));
    if (j) at[p->parameter[j - 1]] = m->model->scene->lo[p->parameter[j - 1]];
    PetscCall(VecCopy(g->Fr, p->F[j]));
    if (j) PetscCall(VecAXPY(p->F[j], -1, p->F[0]));
    PetscCall(VecNorm(p->F[j], NORM_INFINITY, &size));
    p->given[j] = (PetscBool)(size > 0);
  }
  for (PetscInt j = 0; j < p->n; j++)
    at[p->parameter[j]] = 0.5 * m->model->scene->lo[p->parameter[j]] + 0.5 * m->model->scene->hi[p->parameter[j]];
  PetscCall(ForceAt(m, at));
  LoadsCoordinates(m, at, t);
  PetscCall(IsSum(m, t, &p->affine));
  /* Back at the caller's point, whose right-hand side is solved next. */
  PetscCall(ForceAt(m, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves K x = F anew at the corners of the loads' ranges, for a stiffness that has changed. Forces that the corner
   solves left at other parameters make the assembly not current. */
static PetscErrorCode LoadsRenew(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoLoads p = g->loads;
  PetscBool singular;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoSolverFactor(m->solver, &singular));
  ierr = SampleForces(m, mu);
  if (ierr) m->fe->ready = PETSC_FALSE; /* it is at other parameters */
  PetscCall(ierr);
  /* A singular stiffness has no such solutions; the solver reports it. */
  p->affine = (PetscBool)(p->affine && !singular);
  for (PetscInt j = 0; j <= p->n && p->affine; j++) {
    /* A load that is 0 over its range needs no solve. */
    if (p->given[j])
      PetscCall(HycoSolverSolveLinear(m->solver, p->F[j], p->X[j]));
    else
      PetscCall(VecSet(p->X[j], 0));
  }
  p->current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solution set for another mu is taken back first, also where the loads turn out not to be affine. */
PetscErrorCode HycoLoadsSetFree(HycoROM m, const PetscReal mu[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const HycoLoads p = g->loads;
  PetscReal t[1 + MAX_LOADS];
  PetscBool is;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSolverSetFree(m->solver, NULL));
  /* The first prediction with this stiffness pays a solve for each load; the later ones of a ramp none. */
  if (!p->current) PetscCall(LoadsRenew(m, mu));
  if (!p->affine) PetscFunctionReturn(PETSC_SUCCESS);
  LoadsCoordinates(m, mu, t);
  PetscCall(IsSum(m, t, &is));
  if (!is) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LoadsSum(p, p->X, t, p->sum));
  PetscCall(HycoSolverSetFree(m->solver, p->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
