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
static PetscErrorCode FreeWork(HycoCondensed c)
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
  PetscCall(FreeWork(c));
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

/* Updates G and H, unless their parameters are unchanged. */
static PetscErrorCode BringStiffness(HycoROM m, const PetscReal mu[])
{
  HycoCondensed c = (HycoCondensed)m->work;
  PetscBool same = c->current, definite;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->dim; p++) same = (PetscBool)(same && (!c->stiff[p] || c->at[p] == mu[p]));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  c->current = PETSC_FALSE;
  PetscCall(HycoCondensedFlexibility(c, mu, -1, -1, &definite));
  HycoCheckModel(definite,
                 "the interpolated flexibility is not positive definite here (error %.1e with one value left out); "
                 "train on more values of the parameters that affect the stiffness",
                 (double)c->errors[0]);
  PetscCall(HycoGridFieldEvaluate(&c->field[HYCO_FIELD_H], mu, -1, -1, c->H));
  PetscCall(PetscArraycpy(c->at, mu, c->dim));
  c->current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Width(HycoCondensed c, PetscInt p)
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
    sum += PetscSqr((c->x[p][nearest] - mu[p]) / Width(c, p));
  }
  if (distance2) *distance2 = sum;
  return node;
}

/* The active contacts of the nearest training point, or of the last prediction if that is nearer. The solution does
   not depend on it, because the equations of the final set determine it. */
static void StartSet(HycoCondensed c, const PetscReal mu[])
{
  PetscReal there, back = 0;
  const PetscInt node = HycoCondensedNearest(c, mu, &there);

  for (PetscInt p = 0; p < c->dim; p++) back += PetscSqr((c->last[p] - mu[p]) / Width(c, p));
  for (PetscInt i = 0; (!c->solved || there < back) && i < c->m; i++)
    c->active[i] = (PetscBool)(c->Lambda[(size_t)node * (size_t)c->m + (size_t)i] > 0);
}

/* The result is in model->Lambda. */
static PetscErrorCode SolveForces(HycoROM m, const PetscReal mu[])
{
  HycoCondensed c = (HycoCondensed)m->work;
  HycoPrediction *p = &m->prediction;
  const char *method;

  PetscFunctionBegin;
  StartSet(c, mu);
  PetscCall(HycoSolverSetStartSet(m->solver, c->active));
  PetscCall(HycoSolverSolve(m->solver, NULL, c->forces));
  PetscCall(HycoSolverGetReason(m->solver, &p->reason));
  PetscCall(HycoSolverGetIterations(m->solver, &p->iterations));
  PetscCall(HycoSolverGetKKT(m->solver, &p->kkt));
  PetscCall(HycoSolverGetMethod(m->solver, &method));
  PetscCall(PetscStrncpy(p->method, method, sizeof(p->method)));
  c->solved = (PetscBool)(p->reason == HYCO_CONVERGED);
  for (PetscInt i = 0; i < c->m; i++) c->active[i] = (PetscBool)(m->Lambda[i] > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma = a - H L, and U = u0 + V gamma on the nodes of the reduced mesh. */
static PetscErrorCode Displacements(HycoROM m, const PetscReal mu[])
{
  HycoCondensed c = (HycoCondensed)m->work;
  const PetscInt l = m->model->l;

  PetscFunctionBegin;
  PetscCall(HycoCondensedEvaluate(c, HYCO_FIELD_FREE, mu, -1, -1, c->a));
  for (PetscInt j = 0; j < l; j++) {
    m->gamma[j] = c->a[j];
    for (PetscInt i = 0; i < c->m; i++) m->gamma[j] -= c->H[j * c->m + i] * m->Lambda[i];
  }
  if (!c->exact_gap) PetscCall(HycoCondensedBringGap(c, mu));
  PetscCall(HycoROMExpand(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(HycoROM m, const PetscReal mu[])
{
  HycoCondensed c = (HycoCondensed)m->work;
  HycoPrediction *p = &m->prediction;
  PetscReal begin = HycoNow(), solve;

  PetscFunctionBegin;
  PetscCall(BringStiffness(m, mu));
  PetscCall(HycoCondensedFreeGap(c, mu, -1, -1));
  solve = HycoNow();
  p->seconds.factor = 0;
  p->seconds.assemble = solve - begin;
  PetscCall(SolveForces(m, mu));
  PetscCall(PetscArraycpy(c->last, mu, c->dim));
  p->seconds.solve = HycoNow() - solve;
  PetscCall(Displacements(m, mu));
  p->interpolation_error = c->errors[2]; /* in older files; HycoEstimatesEvaluate() sets that of newer ones */
  for (PetscInt q = 0; q < c->dim; q++) {
    if (!c->affine[q]) p->interpolation_error *= HycoPolynomialGrowth(c->n[q], c->x[q], mu[q]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the system of M and g for this solver; forces: array for the result (m, borrowed), or NULL. */
static PetscErrorCode CreateSystem(HycoCondensed c, PetscReal forces[], HycoSolver solver)
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
    PetscCall(CreateSystem(c, NULL, c->solver));
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

static PetscErrorCode SetUp(HycoROM m)
{
  HycoCondensed c = (HycoCondensed)m->work;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  *c = *(HycoCondensed)m->model->data; /* the fields stay the model's */
  c->inverse = c->theta_scale = c->packed = c->M = c->work = c->g = c->H = c->a = NULL;
  c->node_stiff = c->node_load = NULL;
  c->active = NULL;
  c->solver = NULL;
  c->system = NULL;
  c->flexibility = NULL;
  c->forces = NULL;
  c->current = c->solved = PETSC_FALSE;
  PetscCall(HycoCondensedPrepare(c));
  c->given = (HycoGapSource){m->fe, &m->model->pairs, m->rows};
  c->scene = m->model->scene;
  if (c->exact_loads) PetscCall(HycoCondensedPrepareLoads(c));
  PetscCall(CreateSystem(c, m->Lambda, m->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View(HycoROM m, PetscViewer viewer)
{
  HycoCondensed c = (HycoCondensed)m->model->data;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  contacts: %d; flexibility at %d points, gap without forces at %d\n",
                                   (int)c->m, (int)HycoTensorSize(&c->field[HYCO_FIELD_G].tensor),
                                   (int)HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor)));
  for (PetscInt p = 0; p < c->dim; p++)
    PetscCall(PetscViewerASCIIPrintf(
        viewer, "  %s: %d values; degree %d of the flexibility, %d of the gap%s\n", m->model->scene->parameter[p],
        (int)c->n[p], (int)c->field[HYCO_FIELD_G].tensor.degree[p], (int)c->field[HYCO_FIELD_GAP].tensor.degree[p],
        c->affine[p] ? " (affine: exact)" : ""));
  if (c->exact_gap)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  from the scene itself: gaps%s\n", c->exact_loads ? ", loads" : ""));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  relative errors with one value left out: flexibility %.1e, gap %.1e, forces %.1e\n",
      (double)c->errors[0], (double)c->errors[1], (double)c->errors[2]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  fields and stresses on %d of %d elements, or the whole mesh\n",
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells));
  if (!m->model->estimates.n)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  error estimates: from values left out%s\n",
                                     !c->law && c->errors_u[0] < 0 ? ", none of u (an older file)" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(FreeWork((HycoCondensed)m->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(HycoROM m)
{
  HycoCondensed c = (HycoCondensed)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoCondensedFree(&c));
  m->model->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports the training points if they were chosen by this type. */
static void ReportPoints(HycoReducer t, HycoCondensed c, HycoTraining *r)
{
  const char *name = c->hopeless < 0 ? "" : t->scene->parameter[c->hopeless];

  if (!c->chosen || c->target_met) return;
  if (c->hopeless < 0)
    snprintf(r->missed, sizeof(r->missed),
             "-hyco_condensed_tol was not reached: the error of the forces, with one value left out, is %.1e, and %.1e "
             "was requested; raise -hyco_condensed_max_values, which is %d, or -hyco_condensed_tol",
             (double)c->errors[2], (double)Condensing(t)->tol, (int)Condensing(t)->max_values);
  else
    snprintf(
        r->missed, sizeof(r->missed),
        "-hyco_condensed_tol was not reached: with %d values of %s the error of the forces, with one value left "
        "out, is %.1e and falls slowly as values are added, and %.1e was requested; if the stiffness or the contacts "
        "have a jump or a kink in %s (for example of abs or max), train a hybrid model; if its range covers a "
        "decade, let its logarithm be the parameter; or raise -hyco_condensed_tol",
        (int)c->n[c->hopeless], name, (double)c->by_parameter[c->hopeless], (double)Condensing(t)->tol, name);
}

static PetscErrorCode Report(HycoReducer t, HycoROM m, HycoTraining *r)
{
  HycoCondensed c = (HycoCondensed)m->model->data;
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_G].tensor);

  PetscFunctionBegin;
  r->n_flexibilities = n;
  PetscCall(HycoTrainingAddFact(r, "n_flexibilities", (PetscReal)n));
  PetscCall(HycoTrainingAddFact(r, "left_out_flexibility_gap_forces", 0));
  r->fact[r->n_facts - 1].n = 3;
  PetscCall(PetscArraycpy(r->fact[r->n_facts - 1].value, c->errors, 3));
  snprintf(r->summary, sizeof(r->summary),
           "condensed: %d snapshots, flexibility at %d points; relative errors with one training value left out: "
           "flexibility %.1e, gap %.1e, forces %.1e; %d displacement modes\n",
           (int)r->n_samples, (int)n, (double)c->errors[0], (double)c->errors[1], (double)c->errors[2],
           (int)r->n_modes);
  ReportPoints(t, c, r);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Cost(HycoReducer t, const HycoAttempt *a)
{
  const PetscReal m = t->sizes[2];

  return m * m * ((PetscReal)a->n_flexibilities + m / 6.0) + 2 * (PetscReal)a->n_modes * (PetscReal)a->rid_contacts;
}

PetscErrorCode HycoROMCreate_Condensed(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "condensed",
                                       .work = sizeof(*(HycoCondensed)NULL),
                                       .settings = HYCO_SETTINGS_NONE,
                                       .constrains = PETSC_TRUE,
                                       .forces = PETSC_TRUE,
                                       .resultants = PETSC_TRUE,
                                       .history = PETSC_TRUE};
  static const HycoROMOps ops = {.setfromoptions = HycoCondensedSetFromOptions,
                                 .resettraining = HycoCondensedResetTraining,
                                 .begin = HycoCondensedBegin,
                                 .startpoints = HycoCondensedStartPoints,
                                 .choosepoints = HycoCondensedChoosePoints,
                                 .modes = HycoCondensedFindModes,
                                 .build = HycoCondensedBuild,
                                 .report = Report,
                                 .cost = Cost,
                                 .offers = HycoCondensedOffers,
                                 .work = HycoCondensedWork,
                                 .setup = SetUp,
                                 .reset = Reset,
                                 .solve = Solve,
                                 .features = HycoCondensedFeatures,
                                 .estimate = HycoCondensedEstimate,
                                 .view = View,
                                 .save = HycoCondensedMove,
                                 .load = HycoCondensedMove,
                                 .destroy = Destroy};
  HycoCondensed c;

  PetscFunctionBegin;
  PetscCall(HycoCondensedCreate(0, 0, 0, &c));
  PetscCall(HycoROMSetOps(m, &ops, &traits, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
