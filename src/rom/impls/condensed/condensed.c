/*
  The condensed model, online: the exact dual problem of linear elasticity, small and dense in the forces, with its
  matrix and vector interpolated over the parameters (hycocondensed.h). Interpolated entry by entry, G may be indefinite
  between nodes: bounds of the nodes' matrices by one of them, computed in training, may prove that it is not; otherwise
  a Cholesky factorisation checks it, and an indefinite point is refused. With a definite G the solution is unique, so
  that the start of the active set, the forces of the nearest training point, affects only the time.
*/
#include <hycocondensed.h>
#include <hycoromtypes.h>
#include <petscblaslapack.h>
#include <petscviewer.h>

const char *const HycoGridFieldNames[] = {"G", "g", "H", "a"};

/* An eigenvalue of G less negative than this share of its largest diagonal entry is round-off. */
#define SEMIDEFINITE 1e-12

PetscErrorCode HycoCondensedCreate(PetscInt dim, PetscInt m, PetscInt l, HycoCondensed *condensed)
{
  HycoCondensed c;

  PetscFunctionBegin;
  PetscCall(PetscNew(&c));
  c->dim = dim;
  c->m = m;
  c->l = l;
  c->hopeless = -1;
  *condensed = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees what HycoCondensedPrepare() and the solves have allocated. */
PetscErrorCode HycoCondensedFreeWork(HycoCondensed c)
{
  PetscFunctionBegin;
  HycoFreeAll(&c->inverse, &c->theta_scale, &c->node_stiff, &c->node_load, &c->packed, &c->M, &c->work, &c->g, &c->H,
              &c->a, &c->active);
  PetscCall(HycoCondensedResetSystem(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedFree(HycoCondensed *condensed)
{
  HycoCondensed c = *condensed;

  PetscFunctionBegin;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < c->dim; p++) PetscCall(PetscFree(c->x[p]));
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) PetscCall(PetscFree(c->field[f].data));
  HycoFreeAll(&c->Lambda, &c->bounds, &c->law, &c->flat, &c->sample, &c->probe);
  PetscCall(HycoCondensedFreeWork(c));
  PetscCall(PetscFree(*condensed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedAllocate(HycoCondensed c)
{
  const PetscInt rows[HYCO_N_FIELDS] = {c->m * (c->m + 1) / 2, c->m, c->l * c->m, c->l};

  PetscFunctionBegin;
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) {
    HycoGridField *field = &c->field[f];
    const PetscBool all = (PetscBool)(f == HYCO_FIELD_GAP || f == HYCO_FIELD_FREE);

    field->rows = rows[f];
    field->tensor.dim = c->dim;
    for (PetscInt p = 0; p < c->dim; p++) {
      field->tensor.n[p] = all || c->stiff[p] ? c->n[p] : 1;
      field->tensor.x[p] = c->x[p];
      field->tensor.degree[p] = field->tensor.n[p] - 1;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPrepare(HycoCondensed c)
{
  const HycoGridField *gap = &c->field[HYCO_FIELD_GAP];
  const size_t m = (size_t)c->m;

  PetscFunctionBegin;
  c->gap_size = 0;
  for (size_t k = 0; k < (size_t)HycoTensorSize(&gap->tensor) * m; k++)
    c->gap_size = PetscMax(c->gap_size, PetscAbsReal(gap->data[k]));
  c->current = PETSC_FALSE; /* H is allocated anew */
  PetscCall(PetscFree(c->H));
  PetscCall(PetscFree(c->a));
  PetscCall(PetscMalloc1(c->l * c->m + 1, &c->H));
  PetscCall(PetscMalloc1(c->l + 1, &c->a));
  if (c->M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m * (m + 1) / 2 + 1, &c->packed));
  PetscCall(PetscMalloc1(m * m + 1, &c->M));
  PetscCall(PetscMalloc1(m + 1, &c->g));
  PetscCall(PetscCalloc1(m + 1, &c->active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt HycoCondensedNode(HycoCondensed c, const HycoGridField *f, PetscInt k)
{
  PetscInt index[HYCO_MAX_PARAMETERS], node = 0;

  for (PetscInt p = c->dim - 1; p >= 0; p--) {
    index[p] = k % c->n[p];
    k /= c->n[p];
  }
  for (PetscInt p = 0; p < c->dim; p++) node = node * f->tensor.n[p] + (f->tensor.n[p] > 1 ? index[p] : 0);
  return node;
}

#define TILE 64

/* Expands the columns of the lower triangle to both triangles of M, by tiles for cache locality. */
static void Unpack(PetscInt m, const PetscReal packed[], PetscReal M[])
{
  for (PetscInt jb = 0; jb < m; jb += TILE) {
    for (PetscInt ib = jb; ib < m; ib += TILE) {
      for (PetscInt j = jb; j < PetscMin(jb + TILE, m); j++) {
        const PetscReal *column = packed + (size_t)j * (size_t)(2 * m - j + 1) / 2;

        for (PetscInt i = PetscMax(ib, j); i < PetscMin(ib + TILE, m); i++) {
          M[(size_t)j * (size_t)m + (size_t)i] = column[i - j];
          M[(size_t)i * (size_t)m + (size_t)j] = column[i - j];
        }
      }
    }
  }
}

/* Whether a packed matrix, shifted by a share of its largest diagonal entry, has a Cholesky factor. */
static PetscErrorCode HasFactor(HycoCondensed c, const PetscReal packed[], PetscReal share, PetscBool *definite)
{
  PetscReal largest = 0;
  PetscBLASInt m, info;

  PetscFunctionBegin;
  if (!c->work) PetscCall(PetscMalloc1((size_t)c->m * (size_t)c->m, &c->work));
  Unpack(c->m, packed, c->work);
  for (PetscInt i = 0; i < c->m; i++) largest = PetscMax(largest, c->work[(size_t)i * (size_t)(c->m + 1)]);
  for (PetscInt i = 0; i < c->m; i++) c->work[(size_t)i * (size_t)(c->m + 1)] += share * largest;
  PetscCall(PetscBLASIntCast(c->m, &m));
  LAPACKpotrf_("L", &m, c->work, &m, &info);
  *definite = (PetscBool)(info == 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The narrowest of some intervals about the ratio of the traces with lower R <= G_k <= upper R, R the middle node's
   matrix. */
static PetscErrorCode BoundNode(HycoCondensed c, const PetscReal R[], const PetscReal G[], PetscReal bound[2])
{
  static const PetscReal widths[] = {0.01, 0.05, 0.2, 0.5};
  const PetscInt rows = c->field[HYCO_FIELD_G].rows;
  PetscReal *difference, trace[2] = {0, 0};
  PetscBool definite = PETSC_FALSE;

  PetscFunctionBegin;
  bound[0] = bound[1] = 0; /* not found */
  PetscCall(PetscMalloc1(rows, &difference));
  for (PetscInt j = 0, at = 0; j < c->m; at += c->m - j++) {
    trace[0] += R[at];
    trace[1] += G[at];
  }
  for (int k = 0; k < 4 && !definite; k++) {
    const PetscReal low = (1 - widths[k]) * trace[1] / trace[0], high = (1 + widths[k]) * trace[1] / trace[0];

    for (PetscInt r = 0; r < rows; r++) difference[r] = G[r] - low * R[r];
    PetscCall(HasFactor(c, difference, 0, &definite));
    if (!definite) continue;
    for (PetscInt r = 0; r < rows; r++) difference[r] = high * R[r] - G[r];
    PetscCall(HasFactor(c, difference, 0, &definite));
    if (!definite) continue;
    bound[0] = low;
    bound[1] = high;
  }
  PetscCall(PetscFree(difference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedBound(HycoCondensed c)
{
  const HycoGridField *G = &c->field[HYCO_FIELD_G];
  const PetscInt n = HycoTensorSize(&G->tensor);
  const PetscReal *R = G->data + (size_t)(n / 2) * (size_t)G->rows;
  PetscBool definite;

  PetscFunctionBegin;
  PetscCall(PetscFree(c->bounds));
  PetscCall(PetscFree(c->law));
  PetscCall(PetscFree(c->flat));
  PetscCall(PetscCalloc1(2 * n, &c->bounds));
  PetscCall(HasFactor(c, R, 0, &definite));
  for (PetscInt k = 0; definite && k < n; k++) {
    if (k == n / 2)
      c->bounds[2 * k] = c->bounds[2 * k + 1] = 1;
    else
      PetscCall(BoundNode(c, R, G->data + (size_t)k * (size_t)G->rows, c->bounds + 2 * k));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether sum of w_k G_k >= (sum of w_k times its lower or, where w_k < 0, upper bound) R proves definiteness. */
static PetscErrorCode KnownDefinite(HycoCondensed c, const PetscReal mu[], PetscInt axis, PetscInt skip,
                                    PetscBool *known)
{
  const HycoTensor *t = &c->field[HYCO_FIELD_G].tensor;
  const PetscInt n = HycoTensorSize(t);
  PetscReal *w, sum = 0;

  PetscFunctionBegin;
  *known = PETSC_TRUE;
  PetscCall(PetscMalloc1(n, &w));
  PetscCall(HycoTensorWeights(t, mu, axis, skip, w));
  for (PetscInt k = 0; k < n; k++) {
    sum += w[k] * c->bounds[2 * k + (w[k] < 0)];
    if (c->bounds[2 * k] <= 0 && w[k] < 0) *known = PETSC_FALSE;
  }
  *known = (PetscBool)(*known && sum > 1e-3);
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedFlexibility(HycoCondensed c, const PetscReal mu[], PetscInt axis, PetscInt skip,
                                        PetscBool *definite)
{
  PetscFunctionBegin;
  PetscCall(HycoGridFieldEvaluate(&c->field[HYCO_FIELD_G], mu, axis, skip, c->packed));
  Unpack(c->m, c->packed, c->M);
  if (c->flexibility) PetscCall(PetscObjectStateIncrease((PetscObject)c->flexibility));
  PetscCall(KnownDefinite(c, mu, axis, skip, definite));
  if (!*definite) PetscCall(HasFactor(c, c->packed, SEMIDEFINITE, definite));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoCondensedWidth(HycoCondensed c, PetscInt p)
{
  return c->n[p] > 1 ? c->x[p][c->n[p] - 1] - c->x[p][0] : 1;
}

PetscInt HycoCondensedNearest(HycoCondensed c, const PetscReal mu[], PetscReal *distance2)
{
  PetscReal sum = 0;
  PetscInt node = 0;

  for (PetscInt p = 0; p < c->dim; p++) {
    PetscInt nearest = 0;

    for (PetscInt k = 1; k < c->n[p]; k++) {
      if (PetscAbsReal(c->x[p][k] - mu[p]) < PetscAbsReal(c->x[p][nearest] - mu[p])) nearest = k;
    }
    node = node * c->n[p] + nearest;
    sum += PetscSqr((c->x[p][nearest] - mu[p]) / HycoCondensedWidth(c, p));
  }
  if (distance2) *distance2 = sum;
  return node;
}

/* Creates the system of M and g for this solver; forces: array for the result (m, borrowed), or NULL. */
PetscErrorCode HycoCondensedCreateSystem(HycoCondensed c, PetscReal forces[], HycoSolver solver)
{
  Vec g;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, c->m, c->m, c->M, &c->flexibility));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, c->m, c->g, &g));
  if (forces)
    PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, c->m, forces, &c->forces));
  else
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, c->m, &c->forces));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &c->system));
  PetscCall(HycoSystemSetFlexibility(c->system, c->flexibility, g));
  PetscCall(HycoSolverSetSystem(solver, c->system));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedResetSystem(HycoCondensed c)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverDestroy(&c->solver));
  PetscCall(HycoSystemDestroy(&c->system));
  PetscCall(MatDestroy(&c->flexibility));
  PetscCall(VecDestroy(&c->forces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedSolveForces(HycoCondensed c, PetscReal forces[], PetscBool *solved)
{
  const PetscScalar *L;
  HycoReason reason;

  PetscFunctionBegin;
  if (!c->solver) { /* there are many samples, and one that is not solved is left out: no other method is tried */
    PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &c->solver));
    PetscCall(HycoSolverSetType(c->solver, HYCO_SOLVER_ACTIVE_SET));
    PetscCall(HycoSolverSetFallback(c->solver, PETSC_FALSE));
    PetscCall(HycoCondensedCreateSystem(c, NULL, c->solver));
  }
  PetscCall(HycoSolverSetStartSet(c->solver, c->active));
  PetscCall(HycoSolverSolve(c->solver, NULL, c->forces));
  PetscCall(HycoSolverGetReason(c->solver, &reason));
  *solved = (PetscBool)(reason > 0);
  PetscCall(VecGetArrayRead(c->forces, &L));
  PetscCall(PetscArraycpy(forces, L, c->m));
  PetscCall(VecRestoreArrayRead(c->forces, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}
