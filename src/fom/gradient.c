/*
  The gradient of the outputs at full order. With the set of closed contacts, K U + B^T L = F and B U = D hold along a
  parameter too, so that

    K U' + B^T L' = (F - K U - B^T L)',     B U' = (D - B U)'     (closed contacts)

  with the derivatives on the right at fixed U and L: differences of element sums and of rows of contacts. The factor
  is that of the solution. An output's derivative is its difference along U + h U', L + h L' on the mesh at mu + h.
  A step of a path has the same equations, with the derivatives of the step before in its data (sensitivity_step.h).
*/
#include "sensitivity_step.h"

/* Quarters of the step with laws that flow, whose stresses at given strains are curved: eps^(1/3). */
#define LAWS      2
#define NO_CHANGE 1e-8 /* of the largest change of a gap: the residual of the forces, 1e-8 */

typedef struct {
  HycoFOM f;
  HycoSensitivityStep along; /* NULL at a point */
  HycoGradientStore *store;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  HycoSolverTangent tangent;
  Vec U, L, r, g, dU, dL; /* the solution; changes of the data, of the solution */
  Vec R[3], W[5];         /* the data at the three points, and at closer ones */
  Vec C[3], dC, dW;       /* of friction: the coefficients, their change, that of the slacks */
  Vec normal;             /* the path's forces without friction */
  PetscReal size;         /* of gaps and displacements of the contacts */
  PetscReal *output;      /* 6 x n_outputs: at the three points, at closer ones */
  PetscBool stress;       /* the caller may hold the stresses */
  PetscBool has_friction; /* L has the rows of tangents */
  PetscBool regular;      /* the contacts determine the derivatives; */
  PetscBool remembers;    /* of a path: the next step depends on this one */
  PetscBool idle;         /* of a path: they do not, but nothing loads or moves the bodies */
  PetscInt parameter;     /* that is moved, */
  PetscReal step;         /* by how much, */
  PetscBool forces, all;  /* whether it changes those of the bodies, of all cells */
} Work;

/* Adds B^T L to the imbalance at this rank's surface nodes, and sets the gaps w = D - B U. */
static PetscErrorCode AddContacts(const Work *o, const PetscReal U[], const PetscReal lambda[], PetscReal force[],
                                  PetscReal w[])
{
  HycoFOM f = o->f;
  HycoRows rows = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (o->has_friction)
    ierr = HycoSensitivityRows(o->along, o->parameter, o->step, &rows);
  else
    ierr = HycoContactRows(f->fe_surface, &f->pairs, &rows);
  for (PetscInt k = 0; !ierr && k < rows.n; k++) {
    w[k] = rows.gap[k];
    for (PetscInt j = rows.start[k]; j < rows.start[k + 1]; j++) {
      /* A sum over the contacts of this rank; several may share a node. */
      force[rows.dof[j]] += rows.value[j] * lambda[k];
      w[k] -= rows.value[j] * U[rows.dof[j]];
    }
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R += B^T L, W = D - B U at the present parameters. Collective. By the rows at the moved positions, not by the matrix
   B, which belongs to the solution. */
static PetscErrorCode ContactData(Work *o, Vec R, Vec W)
{
  HycoFOM f = o->f;
  const PetscScalar *lambda;
  PetscScalar *w, *force;
  PetscReal *U;
  /* Room of the surface's size: o->r is free until GradientDifferentiate() fills it. */
  Vec at = f->to_surface ? f->U_surface : o->r;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->fe_surface->n_dof + 1, &U));
  PetscCall(HycoFOMToSurface(f, o->U, U));
  PetscCall(VecSet(at, 0));
  PetscCall(VecGetArray(at, &force));
  PetscCall(VecGetArray(W, &w));
  PetscCall(VecGetArrayRead(o->L, &lambda));
  HycoOnEach(HycoComm(f), AddContacts(o, U, lambda, force, w));
  PetscCall(VecRestoreArrayRead(o->L, &lambda));
  PetscCall(VecRestoreArray(W, &w));
  PetscCall(VecRestoreArray(at, &force));
  PetscCall(PetscFree(U));
  if (f->to_surface) {
    PetscCall(VecScatterBegin(f->to_surface, at, R, ADD_VALUES, SCATTER_REVERSE));
    PetscCall(VecScatterEnd(f->to_surface, at, R, ADD_VALUES, SCATTER_REVERSE));
  } else
    PetscCall(VecAXPY(R, 1, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coefficients of friction at the present parameters. Collective. */
static PetscErrorCode GradientCoefficients(Work *o, Vec C)
{
  PetscScalar *mu;

  PetscFunctionBegin;
  PetscCall(VecGetArray(C, &mu));
  HycoOnEach(HycoComm(o->f), HycoSensitivityCoefficients(o->along, mu));
  PetscCall(VecRestoreArray(C, &mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R = K U - F, of what the parameter changes. Collective. */
static PetscErrorCode GradientForces(Work *o, Vec R)
{
  HycoFOM f = o->f;
  const PetscInt dim = f->fe->dim;
  PetscReal *u, *local;
  PetscScalar *r;

  PetscFunctionBegin;
  if (!o->forces) {
    PetscCall(VecSet(R, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc2(f->fe->n_dof, &u, f->fe->n_dof, &local));
  PetscCall(HycoFOMToLocal(f, o->U, u));
  HycoOnEach(HycoComm(f), o->along && o->all ? HycoSensitivityImbalance(o->along, o->parameter, o->step, u, local)
                                             : HycoFEImbalance(f->fe, u, (PetscBool)!o->all, local));
  PetscCall(VecGetArray(R, &r));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) {
    const PetscInt row = HycoMeshOwned(f->part, k / dim);

    /* Complete at owned nodes, as the part has all cells around these. */
    if (row >= 0) r[row * dim + k % dim] = local[k];
  }
  PetscCall(VecRestoreArray(R, &r));
  PetscCall(PetscFree2(u, local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R[j] = K U - F + B^T L, w = D - B U, C[j], at the point j of d, with the free unknowns of the solution.
   Collective. */
static PetscErrorCode GradientData(Work *o, const HycoDifference *d, PetscInt j, Vec w)
{
  HycoFOM f = o->f;
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoDifferencePoint(d, f->scene, o->mu, j, at);
  o->parameter = d->parameter;
  o->step = d->step[j];
  /* Moves the mesh and the supports to mu; o->U keeps the free unknowns of the solution. */
  PetscCall(HycoFOMSetParameters(f, at));
  PetscCall(GradientForces(o, o->R[j]));
  if (f->n_contacts) PetscCall(ContactData(o, o->R[j], w));
  if (o->dC) PetscCall(GradientCoefficients(o, o->C[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The normal forces of L + step dL, as the model's. */
static PetscErrorCode SetNormal(Work *o, PetscReal step)
{
  HycoFOM f = o->f;
  const HycoContactState s = o->has_friction ? f->path->friction : NULL;
  const PetscScalar *L, *dL;
  PetscScalar *normal;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(o->L, &L));
  PetscCall(VecGetArrayRead(o->dL, &dL));
  PetscCall(VecGetArray(f->Lambda, &normal));
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    const PetscInt row = s ? s->row[k] : k;

    normal[k] = L[row] + step * dL[row];
  }
  PetscCall(VecRestoreArray(f->Lambda, &normal));
  PetscCall(VecRestoreArrayRead(o->dL, &dL));
  PetscCall(VecRestoreArrayRead(o->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs at mu of the solution moved by step times its change. Collective. */
static PetscErrorCode GradientMeasure(void *context, const PetscReal mu[], PetscReal step, PetscReal output[])
{
  Work *o = (Work *)context;
  HycoFOM f = o->f;
  const PetscInt dim = f->fe->dim;
  PetscScalar *u;

  PetscFunctionBegin;
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscCall(VecWAXPY(f->U, step, o->dU, o->U));
  PetscCall(VecGetArray(f->U, &u));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) {
    const PetscInt at = HycoMeshOwned(f->part, k / dim);

    /* Supports follow the parameter exactly, not by a derivative. */
    if (at >= 0 && f->fe->fixed[k]) u[at * dim + k % dim] = f->fe->u0[k];
  }
  PetscCall(VecRestoreArray(f->U, &u));
  if (f->n_contacts) PetscCall(SetNormal(o, step));
  /* Stresses are computed anew where an output needs them. */
  f->sigma_ready = PETSC_FALSE;
  PetscCall(HycoFOMGather(f));
  if (o->along) PetscCall(HycoSensitivityView(o->along, o->parameter, step, o->L, o->dL));
  PetscCall(HycoFOMMeasureQuantities(f, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the gap of a closed contact has different slopes to the two sides: its master changes. closer: the gaps
   nearer to mu are known too; otherwise *turns may be curvature. Collective. */
static PetscErrorCode MasterChanges(Work *o, const HycoDifference *d, PetscBool closer, PetscBool *turns)
{
  const PetscScalar *w[5], *L;
  PetscReal most, slope = 0;
  PetscInt rows;

  PetscFunctionBegin;
  *turns = PETSC_FALSE;
  PetscCall(VecMax(o->L, NULL, &most));
  PetscCall(VecGetLocalSize(o->L, &rows));
  PetscCall(VecGetArrayRead(o->L, &L));
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecGetArrayRead(o->W[j], &w[j]));
  for (PetscInt k = 0; k < rows; k++) {
    /* The largest rate of all gaps is the scale of a jump: a gap that does not change has only round-off. */
    if (L[k] > HYCO_UNDECIDED * most) slope = PetscMax(slope, PetscAbsReal((w[1][k] - w[0][k]) / d->step[1]));
  }
  HycoAllreduce(&slope, 1, MPIU_REAL, MPI_MAX, HycoComm(o->f));
  for (PetscInt k = 0; k < rows; k++) {
    const PetscReal v[3] = {w[0][k], w[1][k], w[2][k]}, near[3] = {w[0][k], w[3][k], w[4][k]};
    PetscReal jump;

    if (L[k] <= HYCO_UNDECIDED * most) continue;
    jump = HycoDifferenceJump(d, o->size, slope, v);
    *turns = (PetscBool)(*turns || (closer ? HycoDifferenceKinks(d, jump, near) : jump > 0));
  }
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecRestoreArrayRead(o->W[j], &w[j]));
  PetscCall(VecRestoreArrayRead(o->L, &L));
  HycoAllreduce(turns, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(o->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, with the data nearer to mu only where they are needed: d becomes closer, so that its points are on this
   side of a change of masters farther away. Collective. */
static PetscErrorCode FindTurns(Work *o, HycoDifference *d, PetscBool *turns)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < HYCO_GRADIENT_CLOSER; k++) {
    HycoDifference near = *d;

    PetscCall(MasterChanges(o, d, PETSC_FALSE, turns));
    if (!*turns) break;
    /* The size of a jump between slopes stays when the points come closer; that of curvature shrinks with them. */
    HycoDifferenceShrink(&near);
    for (PetscInt j = 1; j < 3; j++) PetscCall(GradientData(o, &near, j, o->W[2 + j]));
    PetscCall(MasterChanges(o, d, PETSC_TRUE, turns));
    for (PetscInt j = 1; j < 3; j++) {
      Vec W = o->W[j];

      o->W[j] = o->W[2 + j];
      o->W[2 + j] = W;
    }
    *d = near;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The change of the data: r of F - K U - B^T L, g of D - B U. Collective. */
static PetscErrorCode GradientDifferentiate(Work *o, HycoDifference *d, PetscBool *turns)
{
  HycoFOM f = o->f;

  PetscFunctionBegin;
  *turns = PETSC_FALSE;
  for (PetscInt j = 1; j < 3; j++) PetscCall(GradientData(o, d, j, o->W[j]));
  if (f->n_contacts) PetscCall(FindTurns(o, d, turns));
  /* A difference across a change of masters would mix two slopes. */
  if (*turns) HycoDifferenceTakeSide(d);
  if (d->weight[0] != 0)
    PetscCall(GradientData(o, d, 0, o->W[0]));
  else
    PetscCall(VecSet(o->R[0], 0));
  PetscCall(VecSet(o->r, 0));
  /* Minus: R = K U - F + B^T L, and r is the change of its negative. */
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecAXPY(o->r, -d->weight[j], o->R[j]));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecSet(o->g, 0));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecAXPY(o->g, d->weight[j], o->W[j]));
  if (!o->dC) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecSet(o->dC, 0));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecAXPY(o->dC, d->weight[j], o->C[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies at rest that contact alone holds: a change of the loads, or of a gap that is closed, has no derivative.
   Collective. */
static PetscErrorCode GradientAtRest(Work *o)
{
  const PetscScalar *w, *g;
  PetscReal most, load;
  PetscInt rows;

  PetscFunctionBegin;
  PetscCall(VecNorm(o->r, NORM_INFINITY, &load));
  PetscCall(VecNorm(o->g, NORM_INFINITY, &most));
  PetscCall(VecGetLocalSize(o->L, &rows));
  PetscCall(VecGetArrayRead(o->W[0], &w));
  PetscCall(VecGetArrayRead(o->g, &g));
  o->regular = (PetscBool)(load == 0);
  for (PetscInt k = 0; k < rows; k++)
    o->regular = (PetscBool)(o->regular && (w[k] > HYCO_UNDECIDED * o->size || PetscAbsReal(g[k]) <= NO_CHANGE * most));
  PetscCall(VecRestoreArrayRead(o->g, &g));
  PetscCall(VecRestoreArrayRead(o->W[0], &w));
  HycoAllreduce(&o->regular, 1, HYCO_MPI_BOOL, MPI_LAND, HycoComm(o->f));
  PetscCall(VecSet(o->dU, 0));
  PetscCall(VecSet(o->dL, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution's change. *kink: an undecided contact takes another state towards the two sides. Where the step is
   remembered, such a step has no derivative. Collective. */
static PetscErrorCode GradientSolve(Work *o, const HycoDifference *d, PetscBool *kink)
{
  PetscReal most = 0;

  PetscFunctionBegin;
  *kink = PETSC_FALSE;
  if (o->has_friction) {
    PetscCall(HycoSolverTangentSolveCones(o->tangent, o->r, o->g, o->dC, d->step[1], o->dU, o->dL, o->dW, &o->regular));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (o->idle) {
    PetscCall(GradientAtRest(o));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoSolverTangentSolve(o->tangent, o->r, o->g, d->sign, o->dU, o->dL, kink));
  if (!o->remembers) PetscFunctionReturn(PETSC_SUCCESS);
  if (o->dC) PetscCall(VecNorm(o->dC, NORM_INFINITY, &most));
  o->regular = (PetscBool)(!*kink && most == 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One column of the gradient. Collective. */
static PetscErrorCode GradientColumn(Work *o, PetscInt p, HycoGradient *gradient)
{
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, turns, kink, smooth;
  const PetscBool flows = (PetscBool)(o->along && HycoSensitivityFlows(o->along));
  HycoDifference d;
  HycoChanges c;

  PetscFunctionBegin;
  changed[p] = PETSC_TRUE;
  c = HycoSceneChanges(o->f->scene, changed);
  o->all = (PetscBool)(flows || c.nodes || c.stiffness);
  o->forces = (PetscBool)(flows || HycoSceneForcesChange(o->f->scene, changed));
  HycoDifferenceSet(o->f->scene, o->mu, p, HYCO_GRADIENT_STEP, &d);
  for (PetscInt k = 0; flows && k < LAWS; k++) HycoDifferenceShrink(&d);
  for (PetscInt k = 0; o->regular; k++) {
    PetscCall(GradientDifferentiate(o, &d, &turns));
    if (turns && o->remembers) o->regular = PETSC_FALSE;
    if (o->regular) PetscCall(GradientSolve(o, &d, &kink));
    if (!o->along || !o->regular) break;
    PetscCall(HycoSensitivityAccept(o->along, o->mu, &d, o->U, o->dU, &smooth));
    if (smooth) break;
    /* A point that yields between mu and the points beside it; or at mu. */
    o->regular = (PetscBool)(k < HYCO_GRADIENT_CLOSER);
    HycoDifferenceShrink(&d);
  }
  if (!o->regular) PetscFunctionReturn(PETSC_SUCCESS);
  if (o->has_friction) PetscCall(HycoSensitivitySpend(o->along, p, o->L, o->W[0], o->dL, o->dW));
  if (o->store)
    PetscCall(HycoGradientColumn(gradient, o->store, o->f->scene, o->mu, &d, (PetscBool)(turns || kink),
                                 GradientMeasure, o, o->output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors like the forces, and the size of gaps. Collective. */
static PetscErrorCode CreateContacts(Work *o)
{
  HycoFOM f = o->f;
  const Vec L = o->along ? f->path->contact.Lambda : f->Lambda, D = o->along ? f->path->contact.D : f->D;
  PetscReal bu = 0, d = 0;

  PetscFunctionBegin;
  HycoVecDuplicate(L, &o->L, &o->g, &o->dL);
  PetscCall(VecCopy(L, o->L));
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecDuplicate(L, &o->W[j]));
  PetscCall(VecNorm(D, NORM_INFINITY, &d));
  PetscCall(MatMult(o->along ? f->path->contact.B : f->B, f->U, o->g));
  PetscCall(VecNorm(o->g, NORM_INFINITY, &bu));
  o->size = PetscMax(d, bu);
  if (!o->along || !f->path->friction) PetscFunctionReturn(PETSC_SUCCESS);
  o->has_friction = HycoSensitivityHasFriction(o->along);
  HycoVecDuplicate(L, &o->C[0], &o->C[1], &o->C[2], &o->dC, &o->dW);
  PetscCall(VecDuplicate(f->Lambda, &o->normal));
  PetscCall(VecCopy(f->Lambda, o->normal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The system of the closed contacts. Where forces hold a body only by round-off the matrix may be regular.
   Collective. */
static PetscErrorCode GradientDetermine(Work *o)
{
  HycoFOM f = o->f;
  char name[HYCO_LINE] = "";
  PetscReal most = 0, moved;

  PetscFunctionBegin;
  PetscCall(HycoSolverTangentCreate(o->along ? f->path->contact.solver : f->solver, o->U, o->L,
                                    o->has_friction ? f->path->friction->L_before : NULL, &o->tangent, &o->regular));
  if (!f->n_contacts || o->has_friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(o->L, NORM_INFINITY, &most));
  if (most > 0) PetscCall(HycoFOMNameFreeMotion(f, name));
  o->regular = (PetscBool)(o->regular && !name[0]);
  if (o->along && !o->regular) {
    PetscCall(VecNorm(o->U, NORM_INFINITY, &moved));
    o->idle = o->regular = (PetscBool)(most == 0 && moved == 0 && !f->path->friction);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(o->regular || most > 0, HycoComm(f), PETSC_ERR_USER, HYCO_TANGENT_UNPRESSED);
  PetscCheck(!name[0], HycoComm(f), PETSC_ERR_USER, HYCO_GRADIENT_LOOSE, name);
  PetscCheck(
      o->regular, HycoComm(f), PETSC_ERR_USER,
      "the forces of the closed contacts are not unique here, or round-off, and have no derivative; remove contacts "
      "whose gaps follow from those of others");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors, the data at the solution, and the system of its closed contacts. Collective. Copies of U and L: the model
   moves while differences are taken. */
static PetscErrorCode GradientCreate(Work *o)
{
  HycoFOM f = o->f;
  HycoDifference d;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->mu, f->fe->mu, f->scene->n_variables));
  o->stress = f->sigma_ready;
  o->remembers = (PetscBool)(o->along && (f->path->friction || HycoSensitivityFlows(o->along)));
  PetscCall(PetscCalloc1(6 * f->scene->n_quantities + 1, &o->output));
  PetscCall(VecDuplicate(f->U, &o->U));
  PetscCall(VecCopy(f->U, o->U));
  HycoVecDuplicate(f->U, &o->r, &o->dU);
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecDuplicate(f->U, &o->R[j]));
  if (f->n_contacts) PetscCall(CreateContacts(o));
  /* Before GradientData() moves the mesh: the factor and B are those of the solution. */
  PetscCall(GradientDetermine(o));
  if (!o->regular) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDifferenceSet(f->scene, o->mu, 0, HYCO_GRADIENT_STEP, &d);
  PetscCall(GradientData(o, &d, 0, o->W[0]));
  if (!o->store) PetscFunctionReturn(PETSC_SUCCESS);
  /* Of this path, and not of one with other round-off: all three points are. */
  if (o->along) f->sigma_ready = PETSC_FALSE;
  if (o->along) PetscCall(HycoFOMGather(f));
  PetscCall(HycoFOMMeasureQuantities(f, o->output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution and the mesh are again what they were. Collective. */
static PetscErrorCode GradientRestore(Work *o)
{
  HycoFOM f = o->f;
  const HycoContactResult *results;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoFOMSetParameters(f, o->mu));
  PetscCall(VecCopy(o->U, f->U));
  if (f->n_contacts) PetscCall(VecCopy(o->normal ? o->normal : o->L, f->Lambda));
  f->sigma_ready = PETSC_FALSE;
  if (o->along) {
    PetscCall(HycoSensitivityEnd(o->along));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoFOMGather(f));
  if (o->stress) PetscCall(HycoFOMStress(f));
  /* The caller may hold the array, which must have the solution's values again. */
  if (f->contact_result) PetscCall(HycoFOMGetContacts(f, &n, &results));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also after an error: all handles start as NULL. */
static PetscErrorCode GradientDestroy(Work *o)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverTangentDestroy(&o->tangent));
  PetscCall(PetscFree(o->output));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecDestroy(&o->R[j]));
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecDestroy(&o->W[j]));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecDestroy(&o->C[j]));
  HycoDestroyAll(&o->U, &o->L, &o->r, &o->g, &o->dU, &o->dL, &o->dC, &o->dW, &o->normal);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses what has no gradient. Collective. */
static PetscErrorCode GradientCheck(HycoFOM f)
{
  HycoReason reason;

  PetscFunctionBegin;
  PetscCall(HycoGradientCheckScene(f->scene));
  /* Displacements recovered from given forces are no solution of the contact problem. */
  PetscCheck(f->solved && !f->given, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoFOMSolve() before HycoFOMGetGradient()");
  HycoCheck(!f->n_pins, "-hyco_regularise: a body that nothing holds has no gradient; add a support");
  if (f->path) PetscFunctionReturn(PETSC_SUCCESS);
  /* Derivatives of an unconverged state would be numbers without meaning. */
  PetscCall(HycoSolverGetReason(f->solver, &reason));
  HycoCheck(reason > 0, "there is no gradient: %s", HycoReasonName(reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMStateGradient(HycoFOM f, HycoSensitivityStep along, HycoGradientStore *store,
                                    HycoGradient *gradient, PetscBool *regular)
{
  Work o = {.f = f, .along = along, .store = store};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = GradientCreate(&o);
  if (!ierr && o.regular && !o.idle) gradient->n_undecided = HycoSolverTangentUndecided(o.tangent);
  for (PetscInt p = 0; !ierr && o.regular && p < gradient->n_parameters; p++) ierr = GradientColumn(&o, p, gradient);
  if (!ierr) ierr = GradientRestore(&o);
  *regular = o.regular;
  PetscCall(GradientDestroy(&o));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A linear solve for each parameter with the factor that is there; no contact problem is solved again. */
PetscErrorCode HycoFOMGetGradient(HycoFOM f, HycoGradient *gradient)
{
  PetscBool regular;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(gradient);
  PetscCall(GradientCheck(f));
  if (f->path) {
    PetscCall(HycoPathGradient(f, gradient));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoGradientCreate(f->scene, &f->gradient, gradient));
  /* The model may stand at mu + h: its solution is not to be used. */
  HycoOnError(HycoFOMStateGradient(f, NULL, &f->gradient, gradient, &regular), f->solved = PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
