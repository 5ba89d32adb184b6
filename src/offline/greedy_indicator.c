/*
  Error indicators of section 5.4 and 6.6.2, which need no full-order solution.

  (43): snapshots interpolated at mu (42) are prescribed on the RID's interface I, and the full-order problem on A
  alone,

      K[A,A] U + B[A_lambda,A]^T L = F[A] - K[A,I] U_I,    0 <= L  complementary to  D - B[:,I] U_I - B[A_lambda,A] U >=
  0

  is one more contact system. Its distance from the model's prediction is measured in H1 on A (displacements) and in the
  dual of that space (contact forces).

  (45): the 2-norm of the predicted displacement's penetration, over all contacts.
*/
#include <hycoalgorithms.h>
#include <hycogreedy.h>
#include <hycolinear.h>
#include <math.h>

struct _n_HycoIndicator {
  HycoROM model; /* borrowed */
  HycoIndicatorKind kind;
  PetscInt n;            /* snapshots */
  const PetscReal *U_at; /* borrowed */
  HycoInterpolant interpolant;
  PetscReal *weight; /* n */
  /* the local problem, from the first evaluation */
  PetscInt n_A, *dof; /* free unknowns of A: dofs of the model's mesh, ascending */
  PetscInt *place;    /* by dof: place in dof, or -1 */
  IS is;
  Mat K, B, Bt, M, M_A;
  Vec interface, F_A, D, x, L, work, solution;
  Vec whole; /* n_dof */
  KSP norm;
  unsigned long long geometry; /* hash of the nodes that M belongs to */
  HycoSystem system;
  HycoSolver solver;
};

PetscErrorCode HycoIndicatorCreate(HycoROM model, HycoIndicatorKind kind, PetscInt n, const PetscReal points[],
                                   const PetscReal U_at[], HycoIndicator *indicator)
{
  HycoIndicator d;

  PetscFunctionBegin;
  PetscCall(PetscNew(&d));
  *indicator = d;
  d->model = model;
  d->kind = kind;
  d->n = n;
  d->U_at = U_at;
  PetscCall(HycoROMSetReconstruct(model, PETSC_FALSE));
  if (kind == HYCO_INDICATOR_PENETRATION) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n, &d->weight));
  PetscCall(HycoInterpolantCreate(model->scene->n_parameters, n, points, &d->interpolant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoIndicatorDestroy(HycoIndicator *indicator)
{
  HycoIndicator d;

  PetscFunctionBegin;
  if (!indicator || !*indicator) PetscFunctionReturn(PETSC_SUCCESS);
  d = *indicator;
  PetscCall(HycoInterpolantDestroy(&d->interpolant));
  PetscCall(PetscFree(d->weight));
  PetscCall(PetscFree(d->dof));
  PetscCall(PetscFree(d->place));
  PetscCall(HycoSolverDestroy(&d->solver));
  PetscCall(HycoSystemDestroy(&d->system));
  PetscCall(ISDestroy(&d->is));
  PetscCall(MatDestroy(&d->K));
  PetscCall(MatDestroy(&d->B));
  PetscCall(MatDestroy(&d->Bt));
  PetscCall(MatDestroy(&d->M));
  PetscCall(MatDestroy(&d->M_A));
  PetscCall(VecDestroy(&d->interface));
  PetscCall(VecDestroy(&d->whole));
  PetscCall(VecDestroy(&d->F_A));
  PetscCall(VecDestroy(&d->D));
  PetscCall(VecDestroy(&d->x));
  PetscCall(VecDestroy(&d->L));
  PetscCall(VecDestroy(&d->work));
  PetscCall(VecDestroy(&d->solution));
  PetscCall(KSPDestroy(&d->norm));
  PetscCall(PetscFree(*indicator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of A and what is sized by them, once the model stands at a parameter value. */
static PetscErrorCode SetUp(HycoIndicator d)
{
  HycoROM m = d->model;
  const PetscInt dim = m->mesh->dim;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->fe->n_dof, &d->dof));
  PetscCall(PetscMalloc1(m->fe->n_dof, &d->place));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    d->place[i] = -1;
    if (m->role[i / dim] != HYCO_ROLE_A || m->fe->fixed[i]) continue;
    d->place[i] = d->n_A;
    d->dof[d->n_A++] = i;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, d->n_A, d->dof, PETSC_COPY_VALUES, &d->is));
  PetscCall(VecDuplicate(m->F, &d->interface));
  PetscCall(VecDuplicate(m->F, &d->whole));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, d->n_A, &d->x));
  PetscCall(VecDuplicate(d->x, &d->F_A));
  PetscCall(VecDuplicate(d->x, &d->work));
  PetscCall(VecDuplicate(d->x, &d->solution));
  if (m->m) {
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->m, &d->L));
    PetscCall(VecDuplicate(d->L, &d->D));
  }
  PetscCall(HycoFECreateMatrix(m->fe, PETSC_COMM_SELF, m->fe->mesh->n_nodes, 0, &d->M));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &d->system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &d->solver));
  PetscCall(PetscObjectSetOptions((PetscObject)d->solver, m->scene->options));
  PetscCall(HycoSolverSetFromOptions(d->solver));
  PetscCall(HycoSolverSetWarmStart(d->solver, PETSC_FALSE)); /* no history: ranks share the points out */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of H1 on A, when the nodes have moved. */
static PetscErrorCode AssembleNorm(HycoIndicator d)
{
  HycoROM m = d->model;
  const unsigned long long now =
      HycoHash(HYCO_HASH_START, m->fe->X, (size_t)(3 * m->fe->mesh->n_nodes) * sizeof(PetscReal));
  PetscBool singular;

  PetscFunctionBegin;
  if (d->M_A && now == d->geometry) PetscFunctionReturn(PETSC_SUCCESS);
  d->geometry = now;
  PetscCall(KSPDestroy(&d->norm));
  PetscCall(MatDestroy(&d->M_A));
  if (!m->whole) PetscCall(HycoROMLoadWhole(m));
  PetscCall(HycoFEAssembleH1(m->fe, HycoMeshLength(m->whole), d->M));
  PetscCall(MatCreateSubMatrix(d->M, d->is, d->is, MAT_INITIAL_MATRIX, &d->M_A));
  PetscCall(MatSetOption(d->M_A, MAT_SPD, PETSC_TRUE));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_norm_", d->M_A, PETSC_TRUE, &d->norm));
  PetscCall(HycoFactor(d->norm, &singular));
  PetscCheck(!singular, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the H1 norm's matrix is singular");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (42) on the interface, zero elsewhere. */
static PetscErrorCode Interpolate(HycoIndicator d, const PetscReal mu[])
{
  HycoROM m = d->model;
  PetscScalar *u;

  PetscFunctionBegin;
  PetscCall(HycoInterpolantGetWeights(d->interpolant, mu, d->weight));
  PetscCall(VecSet(d->interface, 0));
  PetscCall(VecGetArray(d->interface, &u));
  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    if (m->role[i / m->mesh->dim] != HYCO_ROLE_INTERFACE || m->fe->fixed[i]) continue;
    for (PetscInt k = 0; k < d->n; k++) u[i] += d->weight[k] * d->U_at[(size_t)i * (size_t)d->n + (size_t)k];
  }
  PetscCall(VecRestoreArray(d->interface, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B[A_lambda, A] and its transpose. */
static PetscErrorCode AssembleContact(HycoIndicator d)
{
  HycoROM m = d->model;
  const HycoRows *rows = &m->own_rows;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&d->B));
  PetscCall(MatDestroy(&d->Bt));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, m->m, d->n_A, HycoPairsWidth(&m->pairs) * m->mesh->dim, NULL, &d->B));
  for (PetscInt k = 0; k < m->m; k++) {
    for (PetscInt j = rows->start[k]; j < rows->start[k + 1]; j++) {
      if (d->place[rows->dof[j]] < 0) continue;
      PetscCall(MatSetValue(d->B, k, d->place[rows->dof[j]], rows->value[j], INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(d->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(d->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(d->B, MAT_INITIAL_MATRIX, &d->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D[A_lambda] less what the interface takes of it. */
static PetscErrorCode AssembleGap(HycoIndicator d)
{
  HycoROM m = d->model;
  const HycoRows *rows = &m->own_rows;
  const PetscScalar *u;
  PetscScalar *gap;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(d->interface, &u));
  PetscCall(VecGetArray(d->D, &gap));
  for (PetscInt k = 0; k < m->m; k++) {
    gap[k] = rows->gap[k];
    for (PetscInt j = rows->start[k]; j < rows->start[k + 1]; j++) gap[k] -= rows->value[j] * u[rows->dof[j]];
  }
  PetscCall(VecRestoreArray(d->D, &gap));
  PetscCall(VecRestoreArrayRead(d->interface, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The local problem at the model's present parameters. Its K and B are made again when the model's were. */
static PetscErrorCode SolveLocal(HycoIndicator d, HycoReason *reason)
{
  HycoROM m = d->model;

  PetscFunctionBegin;
  if (!d->K || m->fe->stiffness_changed) {
    PetscCall(MatDestroy(&d->K));
    PetscCall(MatCreateSubMatrix(m->K, d->is, d->is, MAT_INITIAL_MATRIX, &d->K));
    PetscCall(MatSetOption(d->K, MAT_SPD, PETSC_TRUE));
  }
  if (m->m && (!d->B || m->fe->contact_changed)) PetscCall(AssembleContact(d));
  PetscCall(MatMult(m->K, d->interface, d->whole));
  PetscCall(VecAYPX(d->whole, -1, m->F));
  PetscCall(VecISCopy(d->whole, d->is, SCATTER_REVERSE, d->F_A));
  if (m->m) PetscCall(AssembleGap(d));
  PetscCall(HycoSystemSetMatrices(d->system, d->K, d->Bt, d->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(d->system, d->F_A, d->D));
  PetscCall(HycoSolverSetSystem(d->solver, d->system));
  PetscCall(HycoSolverSolve(d->solver, d->x, d->L));
  PetscCall(HycoSolverGetReason(d->solver, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |v| in H1 on A. */
static PetscErrorCode NormOfDisplacement(HycoIndicator d, Vec v, PetscReal *norm)
{
  PetscScalar square;

  PetscFunctionBegin;
  PetscCall(MatMult(d->M_A, v, d->work));
  PetscCall(VecDot(v, d->work, &square));
  *norm = PetscSqrtReal(PetscMax(square, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |L| in the dual of H1 on A: of the functional v -> L . B v. */
static PetscErrorCode NormOfForce(HycoIndicator d, Vec L, PetscReal *norm)
{
  PetscScalar square;

  PetscFunctionBegin;
  PetscCall(MatMult(d->Bt, L, d->work));
  PetscCall(KSPSolve(d->norm, d->work, d->solution));
  PetscCall(VecDot(d->work, d->solution, &square));
  *norm = PetscSqrtReal(PetscMax(square, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Quotient(PetscReal lost, PetscReal size)
{
  return size > 0 ? lost / size : lost > 0 ? INFINITY : 0;
}

/* (43), with the local solution in x and L, which are spent. */
static PetscErrorCode Distances(HycoIndicator d, HycoIndication *v)
{
  HycoROM m = d->model;
  PetscReal size, lost;
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(NormOfDisplacement(d, d->x, &size));
  PetscCall(VecGetArray(d->x, &a));
  for (PetscInt i = 0; i < d->n_A; i++) a[i] -= m->U[d->dof[i]];
  PetscCall(VecRestoreArray(d->x, &a));
  PetscCall(NormOfDisplacement(d, d->x, &lost));
  v->eta_u = Quotient(lost, size);
  v->size = lost;
  v->eta_lambda = 0;
  if (m->m) {
    PetscCall(NormOfForce(d, d->L, &size));
    PetscCall(VecGetArray(d->L, &a));
    for (PetscInt k = 0; k < m->m; k++) a[k] -= m->Lambda[m->contact[k]];
    PetscCall(VecRestoreArray(d->L, &a));
    PetscCall(NormOfForce(d, d->L, &lost));
    v->eta_lambda = Quotient(lost, size);
    v->size += lost;
  }
  v->eta = v->eta_u + v->eta_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (45) */
static PetscReal Penetration(HycoROM m)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < m->pairs.n; k++) {
    const PetscReal deep = HycoROMAddRow(m, k, -m->gap[k]);

    if (deep > 0) sum += deep * deep;
  }
  return PetscSqrtReal(sum);
}

PetscErrorCode HycoIndicatorEvaluate(HycoIndicator d, const PetscReal mu[], HycoIndication *v)
{
  HycoROM m = d->model;
  HycoReason reason = HYCO_CONVERGED;

  PetscFunctionBegin;
  PetscCall(HycoROMPredict(m, m->scene->n_parameters, mu));
  if (d->kind == HYCO_INDICATOR_PENETRATION) {
    PetscCall(HycoROMComplete(m));
    v->eta = v->eta_u = v->size = Penetration(m);
    v->eta_lambda = 0;
  } else {
    if (!d->dof) PetscCall(SetUp(d));
    PetscCall(AssembleNorm(d));
    PetscCall(Interpolate(d, mu));
    PetscCall(SolveLocal(d, &reason));
    PetscCall(Distances(d, v));
  }
  v->solved = (PetscBool)(m->prediction.reason > 0 && reason > 0 && !PetscIsNanReal(v->eta));
  if (!v->solved) v->eta = v->eta_u = v->eta_lambda = v->size = INFINITY;
  PetscFunctionReturn(PETSC_SUCCESS);
}
