/*
  The gradient of the outputs at full order. With the set of closed contacts, K U + B^T L = F and B U = D hold along a
  parameter too, so that

    K U' + B^T L' = (F - K U - B^T L)',     B U' = (D - B U)'     (closed contacts)

  with the derivatives on the right at fixed U and L: differences of element sums and of rows of contacts. The factor
  is that of the solution. An output's derivative is its difference along U + h U', L + h L' on the mesh at mu + h.
*/
#include <hycofomimpl.h>
#include <hycogradient.h>
#include <hycopath.h>

typedef struct {
  HycoFOM f;
  HycoGradientStore *store;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  HycoSolverTangent tangent;
  Vec U, L, r, g, dU, dL; /* the solution; changes of the data, of the solution */
  Vec R[3], W[5];         /* the data at the three points, and at closer ones */
  PetscReal size;         /* of gaps and displacements of the contacts */
  PetscReal *output;      /* 6 x n_outputs: at the three points, at closer ones */
  PetscBool stress;       /* the caller may hold the stresses */
} Work;

/* Subtracts B^T L from the imbalance at this rank's surface nodes, and sets the gaps w = D - B U. */
static PetscErrorCode AddContacts(HycoFOM f, const PetscReal U[], const PetscReal lambda[], PetscReal force[],
                                  PetscReal w[])
{
  const PetscInt entries = HycoPairsWidth(&f->pairs) * f->fe_surface->dim * f->pairs.n;
  PetscInt *start, *dof;
  PetscReal *value;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(f->pairs.n + 1, &start, entries, &dof, entries, &value));
  ierr = HycoContactRows(f->fe_surface, &f->pairs, start, dof, value, w);
  for (PetscInt k = 0; !ierr && k < f->pairs.n; k++) {
    for (PetscInt j = start[k]; j < start[k + 1]; j++) {
      /* A sum over the contacts of this rank; several may share a node. */
      force[dof[j]] += value[j] * lambda[k];
      w[k] -= value[j] * U[dof[j]];
    }
  }
  PetscCall(PetscFree3(start, dof, value));
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
  /* Room of the surface's size: o->r is free until Differentiate() fills it. */
  Vec at = f->to_surface ? f->U_surface : o->r;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->fe_surface->n_dof + 1, &U));
  PetscCall(HycoFOMToSurface(f, o->U, U));
  PetscCall(VecSet(at, 0));
  PetscCall(VecGetArray(at, &force));
  PetscCall(VecGetArray(W, &w));
  PetscCall(VecGetArrayRead(o->L, &lambda));
  HycoOnEach(HycoComm(f), AddContacts(f, U, lambda, force, w));
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

/* R = K U - F + B^T L, W = D - B U at mu, with the free unknowns of the solution. Collective. */
static PetscErrorCode Data(Work *o, const PetscReal mu[], Vec R, Vec W)
{
  HycoFOM f = o->f;
  const PetscInt dim = f->fe->dim;
  PetscReal *u, *local;
  PetscScalar *r;

  PetscFunctionBegin;
  /* Moves the mesh and the supports to mu; o->U keeps the free unknowns of the solution. */
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscCall(PetscMalloc2(f->fe->n_dof, &u, f->fe->n_dof, &local));
  PetscCall(HycoFOMToLocal(f, o->U, u));
  HycoOnEach(HycoComm(f), HycoFEImbalance(f->fe, u, local));
  PetscCall(VecGetArray(R, &r));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) {
    const PetscInt at = HycoMeshOwned(f->part, k / dim);

    /* Complete at owned nodes, as the part has all cells around these. */
    if (at >= 0) r[at * dim + k % dim] = local[k];
  }
  PetscCall(VecRestoreArray(R, &r));
  PetscCall(PetscFree2(u, local));
  if (f->n_contacts) PetscCall(ContactData(o, R, W));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs at mu of the solution moved by step times its change. Collective. */
static PetscErrorCode Measure(void *context, const PetscReal mu[], PetscReal step, PetscReal output[])
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
  if (f->n_contacts) PetscCall(VecWAXPY(f->Lambda, step, o->dL, o->L));
  /* Stresses are computed anew where an output needs them. */
  f->sigma_ready = PETSC_FALSE;
  PetscCall(HycoFOMGather(f));
  PetscCall(HycoFOMMeasureQuantities(f, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the gap of a closed contact has different slopes to the two sides: its master changes. closer: the gaps
   nearer to mu are known too; otherwise *turns may be curvature. Collective. */
static PetscErrorCode Turns(Work *o, const HycoDifference *d, PetscBool closer, PetscBool *turns)
{
  HycoFOM f = o->f;
  const PetscScalar *w[5], *L;
  PetscReal most, slope = 0;

  PetscFunctionBegin;
  *turns = PETSC_FALSE;
  PetscCall(VecMax(o->L, NULL, &most));
  PetscCall(VecGetArrayRead(o->L, &L));
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecGetArrayRead(o->W[j], &w[j]));
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    /* The largest rate of all gaps is the scale of a jump: a gap that does not change has only round-off. */
    if (L[k] > HYCO_GRADIENT_FORCE * most) slope = PetscMax(slope, PetscAbsReal((w[1][k] - w[0][k]) / d->step[1]));
  }
  HycoAllreduce(&slope, 1, MPIU_REAL, MPI_MAX, HycoComm(f));
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    const PetscReal v[3] = {w[0][k], w[1][k], w[2][k]}, near[3] = {w[0][k], w[3][k], w[4][k]};
    PetscReal jump;

    if (L[k] <= HYCO_GRADIENT_FORCE * most) continue;
    jump = HycoDifferenceJump(d, o->size, slope, v);
    *turns = (PetscBool)(*turns || (closer ? HycoDifferenceKinks(d, jump, near) : jump > 0));
  }
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecRestoreArrayRead(o->W[j], &w[j]));
  PetscCall(VecRestoreArrayRead(o->L, &L));
  HycoAllreduce(turns, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, with the data nearer to mu only where they are needed: d becomes closer, so that its points are on this side of
   a change of masters farther away. Collective. */
static PetscErrorCode FindTurns(Work *o, HycoDifference *d, PetscBool *turns)
{
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < HYCO_GRADIENT_CLOSER; k++) {
    HycoDifference near = *d;

    PetscCall(Turns(o, d, PETSC_FALSE, turns));
    if (!*turns) break;
    /* The size of a jump between slopes stays when the points come closer; that of curvature shrinks with them. */
    HycoDifferenceShrink(&near);
    for (PetscInt j = 1; j < 3; j++) {
      HycoDifferencePoint(&near, o->f->scene, o->mu, j, at);
      PetscCall(Data(o, at, o->R[j], o->W[2 + j]));
    }
    PetscCall(Turns(o, d, PETSC_TRUE, turns));
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
static PetscErrorCode Differentiate(Work *o, HycoDifference *d, PetscBool *turns)
{
  HycoFOM f = o->f;
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *turns = PETSC_FALSE;
  for (PetscInt j = 1; j < 3; j++) {
    HycoDifferencePoint(d, f->scene, o->mu, j, at);
    PetscCall(Data(o, at, o->R[j], o->W[j]));
  }
  if (f->n_contacts) PetscCall(FindTurns(o, d, turns));
  /* A difference across a change of masters would mix two slopes. */
  if (*turns) HycoDifferenceTakeSide(d);
  PetscCall(VecSet(o->r, 0));
  /* Minus: R = K U - F + B^T L, and r is the change of its negative. */
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecAXPY(o->r, -d->weight[j], o->R[j]));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecSet(o->g, 0));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecAXPY(o->g, d->weight[j], o->W[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One column of the gradient. Collective. */
static PetscErrorCode Column(Work *o, PetscInt p, HycoGradient *gradient)
{
  HycoDifference d;
  PetscBool turns, kink;

  PetscFunctionBegin;
  HycoDifferenceSet(o->f->scene, o->mu, p, HYCO_GRADIENT_STEP, &d);
  PetscCall(Differentiate(o, &d, &turns));
  /* kink: an undecided contact takes another state towards the two sides. */
  PetscCall(HycoSolverTangentSolve(o->tangent, o->r, o->g, d.sign, o->dU, o->dL, &kink));
  PetscCall(HycoGradientColumn(gradient, o->store, o->f->scene, o->mu, &d, (PetscBool)(turns || kink), Measure, o,
                               o->output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors, the data at the solution, and the system of its closed contacts. Collective. Copies of U and L: the model
   moves while differences are taken. */
static PetscErrorCode Create(Work *o)
{
  HycoFOM f = o->f;
  PetscReal bu = 0, d = 0;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->mu, f->fe->mu, f->scene->n_variables));
  o->stress = f->sigma_ready;
  PetscCall(PetscCalloc1(6 * f->scene->n_quantities + 1, &o->output));
  PetscCall(VecDuplicate(f->U, &o->U));
  PetscCall(VecCopy(f->U, o->U));
  HycoVecDuplicate(f->U, &o->r, &o->dU);
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecDuplicate(f->U, &o->R[j]));
  if (f->n_contacts) {
    PetscCall(VecDuplicate(f->Lambda, &o->L));
    PetscCall(VecCopy(f->Lambda, o->L));
    HycoVecDuplicate(f->Lambda, &o->g, &o->dL);
    for (PetscInt j = 0; j < 5; j++) PetscCall(VecDuplicate(f->Lambda, &o->W[j]));
    PetscCall(VecNorm(f->D, NORM_INFINITY, &d));
    PetscCall(MatMult(f->B, f->U, o->g));
    PetscCall(VecNorm(o->g, NORM_INFINITY, &bu));
    o->size = PetscMax(d, bu);
  }
  /* Before Data() moves the mesh: the factor and B are those of the solution. */
  PetscCall(HycoSolverTangentCreate(f->solver, o->U, o->L, &o->tangent));
  PetscCall(Data(o, o->mu, o->R[0], o->W[0]));
  PetscCall(HycoFOMMeasureQuantities(f, o->output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution and the mesh are again what they were. Collective. */
static PetscErrorCode Restore(Work *o)
{
  HycoFOM f = o->f;
  const HycoContactResult *results;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoFOMSetParameters(f, o->mu));
  PetscCall(VecCopy(o->U, f->U));
  if (f->n_contacts) PetscCall(VecCopy(o->L, f->Lambda));
  f->sigma_ready = PETSC_FALSE;
  PetscCall(HycoFOMGather(f));
  if (o->stress) PetscCall(HycoFOMStress(f));
  /* The caller may hold the array, which must have the solution's values again. */
  if (f->contact_result) PetscCall(HycoFOMGetContacts(f, &n, &results));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also after an error: all handles start as NULL. */
static PetscErrorCode Destroy(Work *o)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverTangentDestroy(&o->tangent));
  PetscCall(PetscFree(o->output));
  for (PetscInt j = 0; j < 3; j++) PetscCall(VecDestroy(&o->R[j]));
  for (PetscInt j = 0; j < 5; j++) PetscCall(VecDestroy(&o->W[j]));
  HycoDestroyAll(&o->U, &o->L, &o->r, &o->g, &o->dU, &o->dL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses what has no gradient. Collective. */
static PetscErrorCode Check(HycoFOM f)
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

/* A linear solve for each parameter with the factor that is there; no contact problem is solved again. */
PetscErrorCode HycoFOMGetGradient(HycoFOM f, HycoGradient *gradient)
{
  Work o = {.f = f};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(Check(f));
  if (f->path) {
    PetscCall(HycoPathGradient(f, gradient));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  o.store = &f->gradient;
  PetscCall(HycoGradientCreate(f->scene, o.store, gradient));
  ierr = Create(&o);
  if (!ierr) gradient->n_undecided = HycoSolverTangentUndecided(o.tangent);
  for (PetscInt p = 0; !ierr && p < gradient->n_parameters; p++) ierr = Column(&o, p, gradient);
  if (!ierr) ierr = Restore(&o);
  /* The model may stand at mu + h: its solution is not to be used. */
  if (ierr) f->solved = PETSC_FALSE;
  PetscCall(Destroy(&o));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
