/*
  What the steps of a path hand on of their derivatives by the parameters. Elastic bodies have no memory but that of their
  contacts with friction: the slips of a step count from the surfaces' places at its begin, whose derivatives are those of
  the step before.
*/
#include "along.h"
#include <hycoentries.h>

struct _n_HycoAlong {
  HycoFOM f;
  PetscReal t0;             /* the begin of the step */
  PetscBool rubs;           /* the path has tangents in it */
  PetscInt n_dof;           /* of the surface, with friction: */
  PetscReal *u_old, *moved; /* its place at the begin of the step; beside it */
  PetscReal *du_old, *du;   /* the derivatives, n_dof for each parameter: at the begin, at the end */
  PetscReal *work;          /* of the work, pairs.n for each parameter */
  PetscReal *tangent;       /* 6 pairs.n: beside the path */
  PetscReal *force, *spent; /* 3 pairs.n, pairs.n: friction that is shown */
  HycoShear shear;
  HycoFEState state; /* room for one beside the path's */
};

PetscErrorCode HycoAlongCreate(HycoFOM f, HycoAlong *along)
{
  const PetscInt np = f->scene->n_parameters, n = f->pairs.n;
  HycoAlong a;

  PetscFunctionBegin;
  PetscCall(PetscNew(along));
  a = *along;
  a->f = f;
  if (!f->friction) PetscFunctionReturn(PETSC_SUCCESS);
  a->n_dof = f->fe_surface->n_dof;
  PetscCall(PetscCalloc1(a->n_dof + 1, &a->u_old));
  PetscCall(PetscMalloc1(a->n_dof + 1, &a->moved));
  PetscCall(PetscCalloc1(np * a->n_dof + 1, &a->du_old));
  PetscCall(PetscMalloc1(np * a->n_dof + 1, &a->du));
  PetscCall(PetscCalloc1(np * n + 1, &a->work));
  PetscCall(PetscMalloc1(6 * n + 1, &a->tangent));
  PetscCall(PetscMalloc1(3 * n + 1, &a->force));
  PetscCall(PetscMalloc1(n + 1, &a->spent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outputs are those of the path again. */
static void ShowPath(HycoAlong a)
{
  a->f->path->beside = a->f->fe->heat_is_load = PETSC_FALSE;
  if (a->f->friction) a->f->pairs.shear = &HycoFrictionSlip(a->f->friction)->shear;
}

/* Also after an error. */
PetscErrorCode HycoAlongDestroy(HycoAlong *along)
{
  HycoAlong a = *along;

  PetscFunctionBegin;
  if (!a) PetscFunctionReturn(PETSC_SUCCESS);
  ShowPath(a);
  PetscCall(HycoFEStateDestroy(&a->state));
  HycoFreeAll(&a->u_old, &a->moved, &a->du_old, &a->du, &a->work, &a->tangent, &a->force, &a->spent, along);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongStep(HycoAlong a, PetscReal t0, PetscBool *able)
{
  const HycoPath p = a->f->path;
  PetscBool moves = PETSC_FALSE;

  PetscFunctionBegin;
  a->t0 = t0;
  a->rubs = p->rubs;
  if (a->f->friction) PetscCall(HycoFrictionMoves(a->f, &moves));
  *able = (PetscBool)(!moves && !p->solver->iterative);
  a->f->path->beside = a->f->fe->heat_is_load = *able;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoAlongRubs(HycoAlong a)
{
  return a->rubs;
}

/* f_int by the points of the cells, for a tenth of the work of their stiffnesses. The path exchanges its states when it
   accepts a step: the one at its begin is now the room of the next end. */
static PetscErrorCode AddInternal(HycoAlong a, PetscReal u[], PetscReal r[])
{
  const HycoPath p = a->f->path;
  const HycoFE fe = p->fe;
  HycoFEStepReport report;

  PetscFunctionBegin;
  if (!a->state) PetscCall(HycoFEStateCreate(fe, &a->state));
  for (PetscInt k = 0; k < fe->n_dof; k++) u[k] = fe->fixed[k] ? fe->u0[k] : u[k];
  HycoFEComplete(fe, u);
  PetscCall(PetscArrayzero(p->f_local, fe->n_dof));
  PetscCall(HycoFEStep(fe, u, a->t0, p->t, p->end, a->state, p->f_local, PETSC_FALSE, &report));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] += p->f_local[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongImbalance(HycoAlong a, PetscReal u[], PetscReal r[])
{
  const HycoFE fe = a->f->fe;

  PetscFunctionBegin;
  fe->heat_is_load = PETSC_FALSE; /* f_int has it */
  PetscCall(HycoFELoads(fe, r));
  fe->heat_is_load = PETSC_TRUE;
  HycoFEGeneralise(fe, r);
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = -r[k];
  PetscCall(AddInternal(a, u, r));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = fe->fixed[k] ? 0 : r[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongRows(HycoAlong a, PetscInt parameter, PetscReal step, PetscInt start[], PetscInt dof[],
                             PetscReal value[], PetscReal gap[])
{
  HycoFOM f = a->f;

  PetscFunctionBegin;
  PetscCheck(a->n_dof == f->fe_surface->n_dof, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the surfaces changed along a path");
  for (PetscInt k = 0; k < a->n_dof; k++) a->moved[k] = a->u_old[k] + step * a->du_old[parameter * a->n_dof + k];
  PetscCall(HycoContactTangentRows(f->fe_surface, &f->pairs, HycoFrictionSlip(f->friction)->row, a->moved, a->tangent,
                                   start, dof, value, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongCoefficients(HycoAlong a, PetscReal mu[])
{
  HycoFOM f = a->f;
  const PetscInt *row = HycoFrictionSlip(f->friction)->row;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    HycoExpr friction = f->scene->contact[f->pairs.contact[k]]->friction;
    PetscReal *at = mu + (a->rubs ? row[k] : k);

    for (PetscInt i = 0; a->rubs && i < row[k + 1] - row[k]; i++) at[i] = 0;
    *at = 0;
    if (friction) PetscCall(HycoExprEval(friction, f->fe_surface->mu, 1, f->fe_surface->X + 3 * f->pairs.slave[k], at));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongSpend(HycoAlong a, PetscInt parameter, Vec L, Vec w, Vec dL, Vec dw)
{
  const HycoSlip *s = HycoFrictionSlip(a->f->friction);
  const PetscScalar *r, *g, *dr, *dg;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(L, &r));
  PetscCall(VecGetArrayRead(w, &g));
  PetscCall(VecGetArrayRead(dL, &dr));
  PetscCall(VecGetArrayRead(dw, &dg));
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt i = s->row[k] + 1; i < s->row[k + 1] && r[s->row[k]] > 0; i++)
      a->work[parameter * s->n + k] -= dr[i] * g[i] + r[i] * dg[i];
  }
  PetscCall(VecRestoreArrayRead(dw, &dg));
  PetscCall(VecRestoreArrayRead(dL, &dr));
  PetscCall(VecRestoreArrayRead(w, &g));
  PetscCall(VecRestoreArrayRead(L, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surface's displacements for the free unknowns of U, at fe's parameters. Collective. */
static PetscErrorCode Place(HycoAlong a, Vec U, PetscReal u[])
{
  const HycoFE fe = a->f->fe_surface;

  PetscFunctionBegin;
  PetscCall(HycoFOMToSurface(a->f, U, u));
  for (PetscInt k = 0; k < fe->n_dof; k++) u[k] = fe->fixed[k] ? fe->u0[k] : u[k];
  HycoFEComplete(fe, u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongTake(HycoAlong a, const PetscReal mu[], const HycoDifference *d, Vec U, Vec dU)
{
  HycoFOM f = a->f;
  PetscReal *du = a->du + d->parameter * a->n_dof, at[HYCO_MAX_PARAMETERS];
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, moves;
  Vec V;

  PetscFunctionBegin;
  if (!f->friction) PetscFunctionReturn(PETSC_SUCCESS);
  changed[d->parameter] = PETSC_TRUE;
  moves = HycoSceneChanges(f->scene, changed).nodes;
  PetscCall(VecDuplicate(U, &V));
  PetscCall(PetscArrayzero(du, a->n_dof));
  /* Where no support follows the parameter, the places are linear in U. */
  if (!HycoSceneSupportsChange(f->scene, NULL, changed, moves)) {
    for (PetscInt j = 0; j < 2; j++) {
      PetscCall(VecWAXPY(V, d->step[j], dU, U));
      PetscCall(Place(a, V, a->moved));
      for (PetscInt k = 0; k < a->n_dof; k++) du[k] += (j ? 1 : -1) * a->moved[k] / d->step[1];
    }
  } else {
    for (PetscInt j = 2; j >= 0; j--) {
      HycoDifferencePoint(d, f->scene, mu, j, at);
      PetscCall(HycoFOMSetParameters(f, at));
      PetscCall(VecWAXPY(V, d->step[j], dU, U));
      PetscCall(Place(a, V, a->moved));
      for (PetscInt k = 0; k < a->n_dof; k++) du[k] += d->weight[j] * a->moved[k];
    }
  }
  PetscCall(VecDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of a->tangent where the contacts are now. */
static PetscErrorCode Tangents(HycoAlong a)
{
  HycoFOM f = a->f;
  const PetscInt rows = HycoFrictionSlip(f->friction)->row[f->pairs.n];
  const PetscInt entries = HycoPairsWidth(&f->pairs) * f->fe->dim * rows;
  PetscInt *start, *dof;
  PetscReal *value, *gap;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(rows + 1, &start, entries, &dof, entries, &value, rows, &gap));
  HycoFinally(HycoAlongRows(a, 0, 0, start, dof, value, gap), PetscCall(PetscFree4(start, dof, value, gap)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongShow(HycoAlong a, PetscInt parameter, PetscReal step, Vec L, Vec dL)
{
  HycoFOM f = a->f;
  const HycoSlip *s = f->friction ? HycoFrictionSlip(f->friction) : NULL;
  const PetscScalar *r, *dr;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnEach(HycoComm(f), Tangents(a));
  PetscCall(VecGetArrayRead(L, &r));
  PetscCall(VecGetArrayRead(dL, &dr));
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt c = 0; c < 3; c++) a->force[3 * k + c] = 0;
    for (PetscInt i = s->row[k] + 1; i < s->row[k + 1] && a->rubs; i++) {
      const PetscReal *t = a->tangent + 6 * k + 3 * (i - s->row[k] - 1);

      for (PetscInt c = 0; c < 3; c++) a->force[3 * k + c] -= (r[i] + step * dr[i]) * t[c];
    }
    a->spent[k] = s->shear.work[k] + step * a->work[parameter * s->n + k];
  }
  PetscCall(VecRestoreArrayRead(dL, &dr));
  PetscCall(VecRestoreArrayRead(L, &r));
  a->shear = s->shear;
  a->shear.force = a->force;
  a->shear.work = a->spent;
  f->pairs.shear = &a->shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAlongEnd(HycoAlong a)
{
  HycoFOM f = a->f;
  PetscReal *du = a->du_old;

  PetscFunctionBegin;
  ShowPath(a);
  if (!f->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Place(a, f->U, a->u_old));
  a->du_old = a->du;
  a->du = du;
  PetscFunctionReturn(PETSC_SUCCESS);
}
