/*
  Derivatives of a path of elastic bodies with friction by its parameters, step by step. With s = B_t U, the slips since
  the begin, a step has w = (w_n, s_old - s), so that its problem moves by the change of the data and by s_old' of the
  step before. With r' and w' on its contacts' states (cone_tangent.c)

      s' = s_old' - w_t',      (work)' = -(r_t' . w_t + r_t . w_t')
*/
#include "bodies_friction.h"
#include <hycoentries.h>
#include <hycolcp.h>

struct _n_HycoBodiesSensitivity {
  HycoRows rows;            /* beside the path, with tangents, */
  PetscReal *tangent, *mu;  /* 6 n_contacts; 5 x n_contacts: coefficients, by point */
  PetscReal *none;          /* no displacement, and no forces */
  const PetscReal *before;  /* by row: the forces before the step. Borrowed */
  PetscReal *old;           /* by row: slips before the step */
  PetscReal *gap;           /* by row: without them */
  PetscReal *slip, *work;   /* by parameter: s' by row; of the work, by contact */
  PetscReal *slack;         /* p + rows: of the step; */
  PetscReal *q, *w;         /* the change of it, at fixed forces and in all */
  PetscReal *force, *spent; /* 3 n_contacts; n_contacts: friction that is shown */
  PetscReal size;           /* of gaps and displacements */
};

/* NULL-safe, also where no derivatives have been asked for. */
PetscErrorCode HycoBodiesSensitivityDestroy(HycoBodiesFriction f)
{
  HycoBodiesSensitivity a = f ? f->along : NULL;

  PetscFunctionBegin;
  if (!a) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoRowsDestroy(&a->rows));
  HycoFreeAll(&a->tangent, &a->mu, &a->none, &a->old, &a->gap, &a->slip, &a->work, &a->slack, &a->q, &a->w, &a->force,
              &a->spent, &f->along);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesTangentMake(HycoBodiesFriction f)
{
  const PetscInt n = f->all.n, N = f->p + n, parameters = f->normal.fe->scene->n_parameters;
  HycoBodiesSensitivity a;

  PetscFunctionBegin;
  if (f->along) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&f->along));
  a = f->along;
  PetscCall(PetscMalloc1(6 * f->state->n + 1, &a->tangent));
  PetscCall(PetscMalloc1(5 * f->state->n + 1, &a->mu));
  PetscCall(PetscCalloc1(PetscMax(f->normal.fe->n_dof, n), &a->none));
  PetscCall(PetscMalloc1(n + 1, &a->old));
  PetscCall(PetscMalloc1(n + 1, &a->gap));
  PetscCall(PetscMalloc1(parameters * n + 1, &a->slip));
  PetscCall(PetscMalloc1(parameters * f->state->n + 1, &a->work));
  PetscCall(PetscCalloc1(N + 1, &a->slack));
  PetscCall(PetscMalloc1(N + 1, &a->q));
  PetscCall(PetscMalloc1(N + 1, &a->w));
  PetscCall(PetscMalloc1(3 * f->state->n + 1, &a->force));
  PetscCall(PetscMalloc1(f->state->n + 1, &a->spent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The slips before the step along its tangents, and the gaps without them. */
static void TakeOld(HycoBodiesFriction f)
{
  HycoBodiesSensitivity a = f->along;

  for (PetscInt k = 0; k < f->state->n; k++) {
    PetscReal jump[3];

    HycoPairsJump(f->normal.pairs, k, f->state->dim, f->state->u_old, jump);
    for (PetscInt r = f->state->row[k]; r < f->state->row[k + 1]; r++) {
      const PetscReal *along = f->state->tangent + 6 * k + 3 * (r - f->state->row[k] - 1);

      a->old[r] = 0;
      if (r > f->state->row[k] && !HycoPairsAlone(f->normal.fe->scene, f->normal.pairs, k))
        a->old[r] = jump[0] * along[0] + jump[1] * along[1] + jump[2] * along[2];
      a->gap[r] = f->rows.gap[r] - a->old[r];
    }
  }
}

/* The forces of the path solve the step at once, and give the factor of its states. Without forces a solve would not
   know where the bodies were before, but the path has their motions. */
static PetscErrorCode BodiesTangentFind(HycoBodiesFriction f, HycoBodiesWork o, const PetscReal taken[],
                                        const PetscReal alpha[], PetscBool *able)
{
  const PetscInt N = f->p + f->all.n;
  PetscReal most = 0;
  PetscInt its;

  PetscFunctionBegin;
  for (PetscInt i = f->p; i < N; i++) most = PetscMax(most, PetscAbsReal(taken[i]));
  PetscCall(PetscArraycpy(f->z, taken, N));
  if (f->p && most == 0) {
    if (alpha) PetscCall(HycoBodiesStrain(o, &f->all, alpha));
    PetscCall(PetscArraycpy(o->x, taken, f->p));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoBodiesFrictionSolveContact(f, o, 0, alpha, PETSC_TRUE, &its, able));
  for (PetscInt i = f->p; i < N; i++)
    *able = (PetscBool)(*able && PetscAbsReal(f->z[i] - taken[i]) <= HYCO_RESIDUAL * most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSensitivityLinearise(HycoROM m, HycoBodiesFriction f, HycoBodiesWork o, PetscInt k,
                                              const PetscReal alpha[], PetscBool *able)
{
  const PetscInt n = f->all.n, N = f->p + n, parameters = m->model->scene->n_parameters;
  const PetscReal *taken = f->taken + (size_t)k * (size_t)N;
  HycoKKT kkt;

  PetscFunctionBegin;
  /* Others have followed a path since. */
  *able = (PetscBool)(f->n_taken == m->trace.n);
  if (!*able || k < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BodiesTangentMake(f));
  if (k) {
    PetscCall(PetscArraycpy(f->state->u_old, f->U, f->normal.fe->n_dof));
  } else {
    PetscCall(PetscArrayzero(f->state->u_old, f->normal.fe->n_dof));
    PetscCall(PetscArrayzero(f->along->slip, parameters * n));
    PetscCall(PetscArrayzero(f->along->work, parameters * f->state->n));
  }
  PetscCall(HycoBodiesFrictionPrepare(f, o, m->fe->mu));
  PetscCall(BodiesTangentFind(f, o, taken, alpha, able));
  PetscCall(HycoBodiesFrictionMove(f, o, &kkt));
  f->along->before = k ? taken - f->all.n : f->along->none;
  PetscCall(PetscArraycpy(f->along->slack + f->p, f->w, n));
  TakeOld(f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoBodiesSensitivityResidual(HycoBodiesFriction f, const PetscInt **row, PetscReal w[], PetscReal *size)
{
  HycoBodiesSensitivity a = f->along;

  *row = f->state->row;
  *size = f->most;
  for (PetscInt r = 0; r < f->all.n; r++) {
    w[r] = f->w[r] - a->old[r];
    if (f->rows.start[r] < f->rows.start[r + 1]) *size = PetscMax(*size, PetscAbsReal(a->gap[r]));
  }
  a->size = *size;
}

/* The rows with tangents where the model's contacts are. */
static PetscErrorCode TangentRows(HycoROM m, HycoBodiesFriction f)
{
  HycoBodiesSensitivity a = f->along;

  PetscFunctionBegin;
  PetscCall(HycoContactTangentRows(m->fe, &m->pairs, f->state->row, a->none, a->tangent, &a->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rows: m's contacts are those at mu. */
PetscErrorCode HycoBodiesSensitivityPerturbed(HycoROM m, HycoBodiesFriction f, const PetscReal mu[],
                                              const PetscInt row[], PetscBool rows, const PetscReal z[], PetscInt point,
                                              PetscReal w[])
{
  HycoBodiesSensitivity a = f->along;
  HycoBodiesSurface s = f->all;

  PetscFunctionBegin;
  if (rows) {
    PetscCall(HycoROMBringRows(m, mu));
    PetscCall(TangentRows(m, f));
    s.fe = m->fe;
    s.pairs = &m->pairs;
    s.rows = &a->rows;
  }
  for (PetscInt k = 0; k < f->state->n; k++) {
    HycoExpr friction = m->model->scene->contact[m->pairs.contact[k]]->friction;
    PetscReal *at = a->mu + point * f->state->n + k;

    *at = 0;
    if (friction) PetscCall(HycoExprEval(friction, mu, 1, m->fe->X + 3 * m->pairs.slave[k], at));
  }
  PetscCall(HycoBodiesNearSurface(m, &s, a->gap, mu, f->all.n, row, rows, z, point, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* point[0]: the path itself. */
PetscErrorCode HycoBodiesSensitivityAdvance(HycoBodiesFriction f, PetscInt parameter, const PetscReal weight[3],
                                            const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                            PetscBool *regular)
{
  HycoBodiesSensitivity a = f->along;
  const PetscInt n = f->all.n, p = f->p;
  const HycoLCP lcp = {.n = n, .p = p, .M = f->M, .blocks = f->blocks, .cone = f->factor};
  PetscReal *dmu = a->mu; /* in place of the path's own */

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(a->q, q, p + n));
  for (PetscInt i = 0; i < n; i++) a->q[p + i] += a->slip[parameter * n + i];
  for (PetscInt k = 0; k < f->state->n; k++) {
    dmu[k] = weight[0] * f->state->mu[k];
    for (PetscInt j = 1; j < 3; j++) dmu[k] += weight[j] * a->mu[point[j] * f->state->n + k];
  }
  PetscCall(HycoConeTangent(&lcp, a->before, f->z, a->slack, a->size, dmu, a->q, dz, a->w, regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoBodiesSensitivityAccept(HycoBodiesFriction f, PetscInt parameter, const PetscReal dz[])
{
  HycoBodiesSensitivity a = f->along;
  const PetscInt n = f->all.n, p = f->p;
  const PetscReal *r = f->z + p;
  PetscReal *slip = a->slip + parameter * n, *work = a->work + parameter * f->state->n;

  for (PetscInt k = 0; k < f->state->n; k++) {
    const PetscInt first = f->state->row[k];

    if (f->rows.start[first] == f->rows.start[first + 1]) continue;
    for (PetscInt i = first + 1; i < f->state->row[k + 1]; i++) {
      if (r[first] > 0) work[k] -= dz[p + i] * f->w[i] + r[i] * a->w[p + i];
      slip[i] -= a->w[p + i];
    }
  }
}

PetscErrorCode HycoBodiesSensitivityView(HycoROM m, HycoBodiesFriction f, PetscInt parameter, PetscBool rows,
                                         PetscReal step, const PetscReal dz[])
{
  HycoBodiesSensitivity a = f->along;
  const PetscReal *work = a->work + parameter * f->state->n, *tangent = rows ? a->tangent : f->state->tangent;
  HycoShear shear = m->trace.seen;

  PetscFunctionBegin;
  if (rows) PetscCall(TangentRows(m, f));
  for (PetscInt k = 0; k < f->state->n; k++) {
    const PetscInt first = f->state->row[k];

    for (PetscInt c = 0; c < 3; c++) a->force[3 * k + c] = 0;
    for (PetscInt i = f->p + first + 1; i < f->p + f->state->row[k + 1]; i++) {
      for (PetscInt c = 0; c < 3; c++)
        a->force[3 * k + c] -= (f->z[i] + step * dz[i]) * tangent[6 * k + 3 * (i - f->p - first - 1) + c];
    }
    a->spent[k] = shear.work[k] + step * work[k];
  }
  shear.force = a->force;
  shear.work = a->spent;
  HycoTraceShowOther(m, &shear);
  PetscFunctionReturn(PETSC_SUCCESS);
}
