/*
  Error indicators of sections 5.4 and 6.6.2, which need no full-order solution.

  (43): snapshots interpolated at mu (42) are prescribed on the RID's interface I, and the full-order problem on A
  alone,

    K[A,A] U + B[A_lambda,A]^T L = F[A] - K[A,I] U_I,    0 <= L  complementary to  D - B[:,I] U_I - B[A_lambda,A] U >= 0

  is one more contact system. Its distance from the model's prediction is measured in H1 on A (displacements) and in the
  dual of that space (contact forces).

  (45): the 2-norm of the predicted displacement's penetration, over all contacts.

  For paths: the residual of the full-order equations (equilibrium and contact) along the predicted path, at the worst
  listed time of each (src/rom/equilibrium.c). Targets and held-out errors refer to the worst time, too; a sum over the
  times would depend on how densely they are listed.
*/
#include <hycoalgorithms.h>
#include "greedy.h"
#include <hycolinear.h>

struct _n_HycoIndicator {
  HycoROM model; /* borrowed */
  HycoIndicatorKind kind;
  PetscInt n;            /* snapshots */
  const PetscReal *U_at; /* borrowed */
  PetscReal length;      /* of the whole mesh */
  HycoInterpolant interpolant;
  PetscReal *weight; /* n */
  /* the local problem, created by the first evaluation */
  HycoLocal local;        /* that of the model's last prediction */
  HycoOperatorState seen; /* operators from which K and B below were made */
  Mat K, B, Bt, M, M_A;
  Vec interface, F_A, D, x, L, work, solution;
  Vec whole, gap; /* n_dof; of all contacts */
  KSP norm;
  unsigned long long geometry; /* hash of the nodes for which M was assembled */
  HycoSystem system;
  HycoSolver solver;
};

/* (42) limits the number of parameters, which the caller checks. */
PetscBool HycoIndicatorInterpolates(HycoIndicatorKind kind)
{
  return (PetscBool)(kind == HYCO_INDICATOR_LOCAL);
}

/* Each rank then holds the whole mesh and a factor of the elastic stiffness. */
PetscBool HycoIndicatorOnWhole(HycoIndicatorKind kind)
{
  return (PetscBool)(kind == HYCO_INDICATOR_RESIDUAL);
}

/* Reconstruction of forces outside the RID is off, except for residuals: (43) compares in A_lambda only, and (45)
   displacements. */
PetscErrorCode HycoIndicatorCreate(HycoROM model, HycoIndicatorKind kind, PetscInt n, const PetscReal points[],
                                   const PetscReal U_at[], PetscReal length, HycoIndicator *indicator)
{
  HycoIndicator d;

  PetscFunctionBegin;
  PetscCall(PetscNew(&d));
  *indicator = d;
  d->model = model;
  d->kind = kind;
  d->n = n;
  d->U_at = U_at;
  d->length = length;
  PetscCall(HycoROMSetReconstruct(model, (PetscBool)(kind == HYCO_INDICATOR_RESIDUAL)));
  if (!HycoIndicatorInterpolates(kind)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n, &d->weight));
  /* Once per iteration: the triangulation depends on the solved points alone. */
  PetscCall(HycoInterpolantCreate(model->model->scene->n_parameters, n, points, &d->interpolant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also half made: what does not exist is NULL. */
PetscErrorCode HycoIndicatorDestroy(HycoIndicator *indicator)
{
  HycoIndicator d;

  PetscFunctionBegin;
  if (!indicator || !*indicator) PetscFunctionReturn(PETSC_SUCCESS);
  d = *indicator;
  PetscCall(HycoInterpolantDestroy(&d->interpolant));
  PetscCall(PetscFree(d->weight));
  HycoDestroyAll(&d->solver, &d->system, &d->K, &d->B, &d->Bt, &d->M, &d->M_A, &d->gap, &d->interface, &d->whole,
                 &d->F_A, &d->D, &d->x, &d->L, &d->work, &d->solution, &d->norm);
  PetscCall(PetscFree(*indicator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the objects whose size depends on A, once the model is at a parameter value. */
static PetscErrorCode SetUp(HycoIndicator d)
{
  HycoROM m = d->model;
  PetscInt n_A;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(d->local.is_A, &n_A));
  HycoVecDuplicate(d->local.F, &d->interface, &d->whole);
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n_A, &d->x));
  HycoVecDuplicate(d->x, &d->F_A, &d->work, &d->solution);
  if (m->m) {
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->m, &d->L));
    PetscCall(VecDuplicate(d->L, &d->D));
    PetscCall(VecDuplicate(d->local.D, &d->gap));
  }
  /* The norm's matrix on the model's mesh, of which A is taken. */
  PetscCall(HycoFECreateMatrix(m->fe, PETSC_COMM_SELF, m->fe->mesh->n_nodes, 0, &d->M));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &d->system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &d->solver));
  PetscCall(HycoOptionsInherit((PetscObject)d->solver, (PetscObject)m));
  /* The scene's options: the local problem is solved as full order would be. */
  PetscCall(HycoSolverSetFromOptions(d->solver));
  PetscCall(HycoSolverSetWarmStart(d->solver, PETSC_FALSE)); /* no warm start, because the ranks share the points */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles the norm of H1 on A if the nodes have moved. By a hash of the coordinates: parameters that do not move
   nodes leave M and its factor. */
static PetscErrorCode AssembleNorm(HycoIndicator d)
{
  HycoROM m = d->model;
  const unsigned long long now =
      HycoHash(HYCO_HASH_START, m->fe->X, (size_t)(3 * m->fe->mesh->n_nodes) * sizeof(PetscReal));

  PetscFunctionBegin;
  if (d->M_A && now == d->geometry) PetscFunctionReturn(PETSC_SUCCESS);
  d->geometry = now;
  HycoDestroyAll(&d->norm, &d->M_A);
  /* Gradients times the mesh's length, so that both parts of the norm have one unit. */
  PetscCall(HycoFEAssembleH1(m->fe, d->length, d->M));
  PetscCall(MatCreateSubMatrix(d->M, d->local.is_A, d->local.is_A, MAT_INITIAL_MATRIX, &d->M_A));
  PetscCall(HycoDefiniteSolver(d->M_A, "the H1 norm's matrix", &d->norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (42) on the interface, zero elsewhere. */
static PetscErrorCode IndicatorInterpolate(HycoIndicator d, const PetscReal mu[])
{
  const PetscInt *dof;
  PetscScalar *u;
  PetscInt n_I;

  PetscFunctionBegin;
  PetscCall(HycoInterpolantGetWeights(d->interpolant, mu, d->weight));
  PetscCall(VecSet(d->interface, 0));
  PetscCall(VecGetArray(d->interface, &u));
  PetscCall(ISGetLocalSize(d->local.is_I, &n_I));
  PetscCall(ISGetIndices(d->local.is_I, &dof));
  for (PetscInt i = 0; i < n_I; i++) {
    /* Rows of U_at are unknowns, so that the sum over snapshots is contiguous. */
    for (PetscInt k = 0; k < d->n; k++) u[dof[i]] += d->weight[k] * d->U_at[(size_t)dof[i] * (size_t)d->n + (size_t)k];
  }
  PetscCall(ISRestoreIndices(d->local.is_I, &dof));
  PetscCall(VecRestoreArray(d->interface, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the local problem at the model's current parameters. K and B are recomputed if the model's were. */
static PetscErrorCode SolveLocal(HycoIndicator d, HycoReason *reason)
{
  const HycoLocal *y = &d->local;
  HycoROM m = d->model;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(HycoOperatorStateUpdate(&d->seen, y->K, y->B, &same));
  if (!same) {
    HycoDestroyAll(&d->K, &d->B, &d->Bt);
    PetscCall(MatCreateSubMatrix(y->K, y->is_A, y->is_A, MAT_INITIAL_MATRIX, &d->K));
    /* K[A,A] with the interface prescribed is definite: I holds the RID. */
    PetscCall(MatSetOption(d->K, MAT_SPD, PETSC_TRUE));
  }
  if (m->m && !same) {
    PetscCall(MatCreateSubMatrix(y->B, y->is_A_lambda, y->is_A, MAT_INITIAL_MATRIX, &d->B));
    PetscCall(MatTranspose(d->B, MAT_INITIAL_MATRIX, &d->Bt));
  }
  PetscCall(MatMult(y->K, d->interface, d->whole)); /* F[A] - K[A,I] U_I, D - B[:,I] U_I */
  PetscCall(VecAYPX(d->whole, -1, y->F));
  /* SCATTER_REVERSE: from the long vector to that of the index set. */
  PetscCall(VecISCopy(d->whole, y->is_A, SCATTER_REVERSE, d->F_A));
  if (m->m) {
    PetscCall(MatMult(y->B, d->interface, d->gap));
    PetscCall(VecAYPX(d->gap, -1, y->D));
    PetscCall(VecISCopy(d->gap, y->is_A_lambda, SCATTER_REVERSE, d->D));
  }
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

/* |L| in the dual of H1 on A: of the functional v -> L . B v. sqrt((B^T L) . M^-1 (B^T L)), by one solve with the
   factor of M on A. */
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

/* (43), with the local solution in x and L, which are overwritten. */
static PetscErrorCode IndicatorDistances(HycoIndicator d, HycoIndication *v)
{
  HycoROM m = d->model;
  PetscReal size, lost;
  PetscScalar *a;
  const PetscInt *dof;
  PetscInt n_A;

  PetscFunctionBegin;
  /* The norm of the local solution first: x becomes the difference. */
  PetscCall(NormOfDisplacement(d, d->x, &size));
  PetscCall(VecGetArray(d->x, &a));
  PetscCall(ISGetLocalSize(d->local.is_A, &n_A));
  PetscCall(ISGetIndices(d->local.is_A, &dof));
  for (PetscInt i = 0; i < n_A; i++) a[i] -= m->U[dof[i]];
  PetscCall(ISRestoreIndices(d->local.is_A, &dof));
  PetscCall(VecRestoreArray(d->x, &a));
  PetscCall(NormOfDisplacement(d, d->x, &lost));
  v->eta_u = HycoRelative(lost, size);
  v->size = lost;
  v->eta_lambda = 0;
  if (m->m) {
    PetscCall(NormOfForce(d, d->L, &size));
    PetscCall(VecGetArray(d->L, &a));
    for (PetscInt k = 0; k < m->m; k++) a[k] -= m->Lambda[m->contact[k]];
    PetscCall(VecRestoreArray(d->L, &a));
    PetscCall(NormOfForce(d, d->L, &lost));
    v->eta_lambda = HycoRelative(lost, size);
    v->size += lost;
  }
  v->eta = v->eta_u + v->eta_lambda;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (45) */
static PetscReal IndicatorPenetration(HycoROM m)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal deep = HycoROMAddRow(m, k, -m->rows.gap[k]);

    /* B V gamma - D, positive where the contact penetrates. */
    if (deep > 0) sum += deep * deep;
  }
  return PetscSqrtReal(sum);
}

/* (43) for the last prediction. */
static PetscErrorCode EvaluateLocal(HycoIndicator d, const PetscReal mu[], HycoReason *reason, HycoIndication *v)
{
  HycoROM m = d->model;

  PetscFunctionBegin;
  HycoCheck(m->ops->local,
            "-hyco_greedy_indicator local needs the system on the RID, which a %s model does not have; use penetration",
            m->model->type);
  /* Matrices at the last prediction's parameters: no further assembly. */
  PetscUseTypeMethod(m, local, &d->local);
  if (!d->system) PetscCall(SetUp(d));
  PetscCall(AssembleNorm(d));
  PetscCall(IndicatorInterpolate(d, mu));
  PetscCall(SolveLocal(d, reason));
  /* Also if the local problem was not solved; the caller then replaces the values. */
  PetscCall(IndicatorDistances(d, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the last predicted path; infinite if a law has no solution. The residual on the whole mesh needs no local solve:
   the path is replayed for it. */
static PetscErrorCode EvaluateResidual(HycoIndicator d, HycoIndication *v)
{
  HycoEquilibrium e;

  PetscFunctionBegin;
  PetscCall(HycoROMGetEquilibrium(d->model, &e));
  v->eta_u = e.worst;
  v->eta_lambda = e.worst_contact;
  v->eta = v->size = e.worst + e.worst_contact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whatever is not solved gets infinity in all four: HycoIndication.size then orders by distance (greedy.c). */
PetscErrorCode HycoIndicatorEvaluate(HycoIndicator d, const PetscReal mu[], HycoIndication *v)
{
  HycoROM m = d->model;
  HycoReason reason = HYCO_CONVERGED;

  PetscFunctionBegin;
  PetscCall(HycoROMPredict(m, m->model->scene->n_parameters, mu));
  if (d->kind == HYCO_INDICATOR_PENETRATION) {
    /* Penetration counts at all contacts, also outside the RID. */
    PetscCall(HycoROMComplete(m));
    v->eta = v->eta_u = v->size = IndicatorPenetration(m);
    v->eta_lambda = 0;
  } else if (d->kind == HYCO_INDICATOR_LOCAL)
    PetscCall(EvaluateLocal(d, mu, &reason, v));
  else if (m->prediction.reason > 0)
    PetscCall(EvaluateResidual(d, v));
  v->solved = (PetscBool)(m->prediction.reason > 0 && reason > 0 && !PetscIsNanReal(v->eta));
  if (!v->solved) v->eta = v->eta_u = v->eta_lambda = v->size = PETSC_INFINITY;
  PetscFunctionReturn(PETSC_SUCCESS);
}
