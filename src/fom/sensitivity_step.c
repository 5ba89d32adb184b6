/*
  What the steps of a path hand on of their derivatives by the parameters. Elastic bodies have no memory but that of
  their contacts with friction: the slips of a step count from the surfaces' places at its begin, whose derivatives are
  those of the step before. Laws that flow count from their states at its begin. With K = d f_int / dU at the end of the
  step, the derivatives of f_int at fixed U, of the states and of the stresses are differences of the laws at points
  beside the parameters, from states that are moved along their derivatives.
*/
#include "sensitivity_step.h"
#include <hycoentries.h>
#include <hycomaterialimpl.h>

struct _n_HycoSensitivityStep {
  HycoFOM f;
  PetscReal t0;             /* the begin of the step */
  PetscBool has_friction;   /* the path has tangents in it */
  PetscInt n_dof;           /* of the surface, with friction: */
  PetscReal *u_old, *moved; /* its place at the begin of the step; beside it */
  PetscReal *du_old, *du;   /* the derivatives, n_dof for each parameter: at the begin, at the end */
  PetscReal *work;          /* of the work, pairs.n for each parameter */
  PetscReal *tangent;       /* 6 pairs.n: beside the path */
  PetscReal *force, *spent; /* 3 pairs.n, pairs.n: friction that is shown */
  HycoShear shear;
  HycoFEState state; /* room for one beside the path's */
  /* with laws that flow: */
  HycoFEState before, accepted;   /* a step's begin beside the path; the path's state while another is shown */
  PetscInt n_values, n_tangents;  /* of a state; of fe's tangents */
  PetscReal *dstate0, *dstate;    /* n_values for each parameter: the derivatives at the begin, at the end */
  PetscReal *value[2], *tangents; /* states at the two points; what the path had, as K */
  PetscReal size;                 /* of stresses */
  PetscBool failed;               /* a law, beside the path */
  Mat K;
  Vec f_int, f_path; /* of the state that is shown; that of the path */
};

/* Room for the laws' states. The path that is solved again stands at the end of the one before. */
static PetscErrorCode CreateStates(HycoSensitivityStep a)
{
  const HycoPath p = a->f->path;
  const HycoFE fe = p->fe;
  const PetscInt n_cells = fe->mesh->n_cells, nq = HycoElementGet(fe->mesh->type)->nq;
  const PetscInt np = a->f->scene->n_parameters, *start;

  PetscFunctionBegin;
  PetscCall(HycoFEStateCreate(fe, &a->before));
  PetscCall(HycoFEStateGet(a->before, &start, NULL));
  a->n_values = start[n_cells];
  if (n_cells) a->n_tangents = fe->tangent_start[n_cells - 1] + nq * fe->tangent_size[fe->mesh->cell_body[n_cells - 1]];
  PetscCall(PetscCalloc1((size_t)np * (size_t)a->n_values + 1, &a->dstate0));
  PetscCall(PetscMalloc1((size_t)np * (size_t)a->n_values + 1, &a->dstate));
  for (PetscInt j = 0; j < 2; j++) PetscCall(PetscMalloc1(a->n_values + 1, &a->value[j]));
  PetscCall(PetscMalloc1(a->n_tangents + 1, &a->tangents));
  PetscCall(VecDuplicate(a->f->U, &a->f_int));
  for (PetscInt k = 0; k < p->n_steps; k++) a->size = PetscMax(a->size, p->steps[k].mises);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityCreate(HycoFOM f, HycoSensitivityStep *along)
{
  const PetscInt np = f->scene->n_parameters, n = f->pairs.n;
  HycoSensitivityStep a;

  PetscFunctionBegin;
  PetscCall(PetscNew(along));
  a = *along;
  a->f = f;
  if (f->path->flows) PetscCall(CreateStates(a));
  if (!f->path->friction) PetscFunctionReturn(PETSC_SUCCESS);
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
static void ShowPath(HycoSensitivityStep a)
{
  HycoPath p = a->f->path;

  p->beside = a->f->fe->heat_is_load = PETSC_FALSE;
  if (a->accepted) {
    p->begin = a->accepted;
    p->f_old = a->f_path;
    a->accepted = NULL;
  }
  if (a->f->path->friction) a->f->pairs.shear = &a->f->path->friction->shear;
}

/* Also after an error. */
PetscErrorCode HycoSensitivityDestroy(HycoSensitivityStep *along)
{
  HycoSensitivityStep a = *along;

  PetscFunctionBegin;
  if (!a) PetscFunctionReturn(PETSC_SUCCESS);
  ShowPath(a);
  PetscCall(HycoFEStateDestroy(&a->state));
  PetscCall(HycoFEStateDestroy(&a->before));
  HycoDestroyAll(&a->K, &a->f_int);
  HycoFreeAll(&a->dstate0, &a->dstate, &a->value[0], &a->value[1], &a->tangents);
  HycoFreeAll(&a->u_old, &a->moved, &a->du_old, &a->du, &a->work, &a->tangent, &a->force, &a->spent, along);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivatives need a tangent that is exact, as those of the laws which have derivatives themselves. */
static PetscBool LawsHaveDerivatives(HycoScene s)
{
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    if (!s->body[b].law->linear && !s->body[b].law->slopes) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The laws from the begin of the step, moved by step along its derivative, to u; f_int in the path's f_local. The path
   exchanges its states when it accepts a step: the one at its begin is now the room of the next end. Not collective. */
static PetscErrorCode RunLaws(HycoSensitivityStep a, PetscInt parameter, PetscReal step, PetscReal u[],
                              PetscBool tangent)
{
  const HycoPath p = a->f->path;
  const HycoFE fe = p->fe;
  HycoFEState begin = p->end;
  HycoFEStepReport report;

  PetscFunctionBegin;
  if (!a->state) PetscCall(HycoFEStateCreate(fe, &a->state));
  for (PetscInt k = 0; k < fe->n_dof; k++) u[k] = fe->fixed[k] ? fe->u0[k] : u[k];
  HycoFEComplete(fe, u);
  if (p->flows && step != 0) {
    const PetscReal *slope = a->dstate0 + (size_t)parameter * (size_t)a->n_values;
    PetscReal *from, *to;

    PetscCall(HycoFEStateGet(begin, NULL, &from));
    PetscCall(HycoFEStateGet(a->before, NULL, &to));
    for (PetscInt i = 0; i < a->n_values; i++) to[i] = from[i] + step * slope[i];
    begin = a->before;
  }
  PetscCall(PetscArrayzero(p->f_local, fe->n_dof));
  PetscCall(HycoFEStep(fe, u, a->t0, p->t, begin, a->state, p->f_local, tangent, &report));
  a->failed = (PetscBool)(a->failed || report.failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same to U, whose fixed unknowns follow the parameters. Collective. */
static PetscErrorCode RunTo(HycoSensitivityStep a, PetscInt parameter, PetscReal step, Vec U, PetscBool tangent)
{
  PetscReal *u;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(a->f->fe->n_dof, &u));
  PetscCall(HycoFOMToLocal(a->f, U, u));
  HycoOnEach(HycoComm(a->f), RunLaws(a, parameter, step, u, tangent));
  PetscCall(PetscFree(u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K = d f_int / dU at the end of the step; what the path had is kept, so that it goes on with it. Collective. */
static PetscErrorCode LineariseTangent(HycoSensitivityStep a, PetscBool *able)
{
  const HycoPath p = a->f->path;

  PetscFunctionBegin;
  a->failed = PETSC_FALSE;
  if (!a->K) PetscCall(MatDuplicate(p->K, MAT_DO_NOT_COPY_VALUES, &a->K));
  PetscCall(MatCopy(p->K, a->K, SAME_NONZERO_PATTERN));
  PetscCall(PetscArraycpy(a->tangents, p->fe->tangent, a->n_tangents));
  PetscCall(RunTo(a, 0, 0, p->U, PETSC_TRUE));
  PetscCall((*p->ops->stiffness)(p));
  /* The pieces of friction are those of a solution. */
  if (p->has_friction) PetscCall(HycoPathSolveAgain(p, able));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path has its own K again. */
static PetscErrorCode LeaveTangent(HycoSensitivityStep a)
{
  const HycoPath p = a->f->path;

  PetscFunctionBegin;
  PetscCall(MatCopy(a->K, p->K, SAME_NONZERO_PATTERN));
  PetscCall(PetscArraycpy(p->fe->tangent, a->tangents, a->n_tangents));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityAdvance(HycoSensitivityStep a, PetscReal t0, PetscBool *able)
{
  const HycoPath p = a->f->path;
  PetscBool moves = PETSC_FALSE;

  PetscFunctionBegin;
  a->t0 = t0;
  a->has_friction = p->has_friction;
  if (a->f->path->friction) PetscCall(HycoPathFrictionMoves(p, &moves));
  *able = (PetscBool)(!moves && !p->contact.solver->iterative && LawsHaveDerivatives(p->scene));
  if (*able && p->flows) {
    PetscCall(LineariseTangent(a, able));
    if (!*able) PetscCall(LeaveTangent(a));
  } else
    p->beside = p->fe->heat_is_load = *able;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoSensitivityHasFriction(HycoSensitivityStep a)
{
  return a->has_friction;
}

PetscBool HycoSensitivityFlows(HycoSensitivityStep a)
{
  return a->f->path->flows;
}

/* f_int by the points of the cells, for a tenth of the work of their stiffnesses. */
PetscErrorCode HycoSensitivityImbalance(HycoSensitivityStep a, PetscInt parameter, PetscReal step, PetscReal u[],
                                        PetscReal r[])
{
  const HycoFE fe = a->f->fe;
  const PetscReal *f_int = a->f->path->f_local;
  const PetscBool heat = fe->heat_is_load;

  PetscFunctionBegin;
  fe->heat_is_load = PETSC_FALSE; /* f_int has it */
  PetscCall(HycoFELoads(fe, r));
  fe->heat_is_load = heat;
  HycoFEGeneralise(fe, r);
  PetscCall(RunLaws(a, parameter, step, u, PETSC_FALSE));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = fe->fixed[k] ? 0 : f_int[k] - r[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityRows(HycoSensitivityStep a, PetscInt parameter, PetscReal step, HycoRows *rows)
{
  HycoFOM f = a->f;

  PetscFunctionBegin;
  PetscCheck(a->n_dof == f->fe_surface->n_dof, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the surfaces changed along a path");
  for (PetscInt k = 0; k < a->n_dof; k++) a->moved[k] = a->u_old[k] + step * a->du_old[parameter * a->n_dof + k];
  PetscCall(HycoContactTangentRows(f->fe_surface, &f->pairs, f->path->friction->row, a->moved, a->tangent, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityCoefficients(HycoSensitivityStep a, PetscReal mu[])
{
  HycoFOM f = a->f;
  const PetscInt *row = f->path->friction->row;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    HycoExpr friction = f->scene->contact[f->pairs.contact[k]]->friction;
    PetscReal *at = mu + (a->has_friction ? row[k] : k);

    for (PetscInt i = 0; a->has_friction && i < row[k + 1] - row[k]; i++) at[i] = 0;
    *at = 0;
    if (friction) PetscCall(HycoExprEval(friction, f->fe_surface->mu, 1, f->fe_surface->X + 3 * f->pairs.slave[k], at));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivitySpend(HycoSensitivityStep a, PetscInt parameter, Vec L, Vec w, Vec dL, Vec dw)
{
  const HycoContactState s = a->f->path->friction;
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
static PetscErrorCode SurfaceDisplacements(HycoSensitivityStep a, Vec U, PetscReal u[])
{
  const HycoFE fe = a->f->fe_surface;

  PetscFunctionBegin;
  PetscCall(HycoFOMToSurface(a->f, U, u));
  for (PetscInt k = 0; k < fe->n_dof; k++) u[k] = fe->fixed[k] ? fe->u0[k] : u[k];
  HycoFEComplete(fe, u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest of the stresses' slopes, and of their jumps between the two sides, of this rank: v are the states at the
   parameters and at the points beside them. */
static void MeasureJumps(HycoSensitivityStep a, const HycoDifference *d, PetscReal *const v[3], PetscReal most[2])
{
  const HycoFE fe = a->f->fe;
  const PetscInt nq = HycoElementGet(fe->mesh->type)->nq, ns = fe->n_sigma, *start;
  const PetscReal *slope = a->dstate + (size_t)d->parameter * (size_t)a->n_values;

  PetscCallAbort(PETSC_COMM_SELF, HycoFEStateGet(a->state, &start, NULL));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const PetscInt width = (start[e + 1] - start[e]) / nq;

    for (PetscInt k = 0; k < nq * ns; k++) {
      /* A point's state begins with strain and stress (inelastic.c). */
      const PetscInt i = start[e] + k / ns * width + ns + k % ns;
      const PetscReal s[3] = {v[0][i], v[1][i], v[2][i]};

      most[0] = PetscMax(most[0], PetscAbsReal(slope[i]));
      most[1] = PetscMax(most[1], HycoDifferenceJump(d, a->size, PETSC_SMALL, s));
    }
  }
}

/* The derivatives of the states at the end of the step, of U + step dU. */
static PetscErrorCode TakeStates(HycoSensitivityStep a, const PetscReal mu[], const HycoDifference *d, Vec U, Vec dU,
                                 PetscBool *smooth)
{
  HycoFOM f = a->f;
  PetscReal *slope = a->dstate + (size_t)d->parameter * (size_t)a->n_values, at[HYCO_MAX_PARAMETERS], most[2] = {0, 0};
  PetscReal *v[3] = {NULL, a->value[0], a->value[1]}, *end;
  Vec V;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(U, &V));
  for (PetscInt j = 1; j < 3; j++) {
    HycoDifferencePoint(d, f->scene, mu, j, at);
    PetscCall(HycoFOMSetParameters(f, at));
    PetscCall(VecWAXPY(V, d->step[j], dU, U));
    PetscCall(RunTo(a, d->parameter, d->step[j], V, PETSC_FALSE));
    PetscCall(HycoFEStateGet(a->state, NULL, &end));
    PetscCall(PetscArraycpy(v[j], end, a->n_values));
  }
  PetscCall(VecDestroy(&V));
  PetscCall(HycoFEStateGet(a->accepted ? a->accepted : f->path->begin, NULL, &v[0]));
  for (PetscInt i = 0; i < a->n_values; i++)
    slope[i] = d->weight[0] * v[0][i] + d->weight[1] * v[1][i] + d->weight[2] * v[2][i];
  MeasureJumps(a, d, v, most);
  HycoAllreduce(most, 2, MPIU_REAL, MPI_MAX, HycoComm(f));
  *smooth = (PetscBool)(!a->failed && most[1] <= HYCO_KINK * most[0]);
  HycoAllreduce(smooth, 1, HYCO_MPI_BOOL, MPI_LAND, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityAccept(HycoSensitivityStep a, const PetscReal mu[], const HycoDifference *d, Vec U,
                                     Vec dU, PetscBool *smooth)
{
  HycoFOM f = a->f;
  PetscReal *du = a->du + d->parameter * a->n_dof, at[HYCO_MAX_PARAMETERS];
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, moves;
  Vec V;

  PetscFunctionBegin;
  *smooth = PETSC_TRUE;
  if (f->path->flows) PetscCall(TakeStates(a, mu, d, U, dU, smooth));
  if (!f->path->friction) PetscFunctionReturn(PETSC_SUCCESS);
  changed[d->parameter] = PETSC_TRUE;
  moves = HycoSceneChanges(f->scene, changed).nodes;
  PetscCall(VecDuplicate(U, &V));
  PetscCall(PetscArrayzero(du, a->n_dof));
  /* Where no support follows the parameter, the places are linear in U. */
  if (!HycoSceneSupportsChange(f->scene, NULL, changed, moves)) {
    for (PetscInt j = 0; j < 2; j++) {
      PetscCall(VecWAXPY(V, d->step[j], dU, U));
      PetscCall(SurfaceDisplacements(a, V, a->moved));
      for (PetscInt k = 0; k < a->n_dof; k++) du[k] += (j ? 1 : -1) * a->moved[k] / d->step[1];
    }
  } else {
    for (PetscInt j = 2; j >= 0; j--) {
      HycoDifferencePoint(d, f->scene, mu, j, at);
      PetscCall(HycoFOMSetParameters(f, at));
      PetscCall(VecWAXPY(V, d->step[j], dU, U));
      PetscCall(SurfaceDisplacements(a, V, a->moved));
      for (PetscInt k = 0; k < a->n_dof; k++) du[k] += d->weight[j] * a->moved[k];
    }
  }
  PetscCall(VecDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of a->tangent where the contacts are now. */
static PetscErrorCode StepTangentRows(HycoSensitivityStep a)
{
  HycoRows rows = {0};

  PetscFunctionBegin;
  HycoFinally(HycoSensitivityRows(a, 0, 0, &rows), PetscCall(HycoRowsDestroy(&rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The state and f_int of the path are those of f->U. */
static PetscErrorCode ShowState(HycoSensitivityStep a, PetscInt parameter, PetscReal step)
{
  HycoFOM f = a->f;
  HycoPath p = f->path;
  const PetscInt dim = f->part->dim;
  PetscScalar *f_int;

  PetscFunctionBegin;
  PetscCall(RunTo(a, parameter, step, f->U, PETSC_FALSE));
  PetscCall(VecGetArray(a->f_int, &f_int));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) {
    const PetscInt row = HycoMeshOwned(f->part, k / dim);

    if (row >= 0) f_int[row * dim + k % dim] = p->f_local[k];
  }
  PetscCall(VecRestoreArray(a->f_int, &f_int));
  if (!a->accepted) {
    a->accepted = p->begin;
    a->f_path = p->f_old;
  }
  p->begin = a->state;
  p->f_old = a->f_int;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSensitivityView(HycoSensitivityStep a, PetscInt parameter, PetscReal step, Vec L, Vec dL)
{
  HycoFOM f = a->f;
  const HycoContactState s = f->path->friction;
  const PetscScalar *r, *dr;

  PetscFunctionBegin;
  if (f->path->flows) PetscCall(ShowState(a, parameter, step));
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnEach(HycoComm(f), StepTangentRows(a));
  PetscCall(VecGetArrayRead(L, &r));
  PetscCall(VecGetArrayRead(dL, &dr));
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt c = 0; c < 3; c++) a->force[3 * k + c] = 0;
    for (PetscInt i = s->row[k] + 1; i < s->row[k + 1] && a->has_friction; i++) {
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

PetscErrorCode HycoSensitivityEnd(HycoSensitivityStep a)
{
  HycoFOM f = a->f;
  HycoPath p = f->path;
  PetscReal *du = a->du_old, *dstate = a->dstate0;

  PetscFunctionBegin;
  ShowPath(a);
  if (p->flows) {
    PetscCall(LeaveTangent(a));
    a->dstate0 = a->dstate;
    a->dstate = dstate;
  }
  if (!f->path->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SurfaceDisplacements(a, f->U, a->u_old));
  a->du_old = a->du;
  a->du = du;
  PetscFunctionReturn(PETSC_SUCCESS);
}
