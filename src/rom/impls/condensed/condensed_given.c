/*
  Quantities that a condensed model evaluates from the scene at any parameter value: the gaps D, on the contact
  surfaces; and the loads, as combinations of the training loads. F is linear in the values theta of the scene's
  expressions for loads, body forces and prescribed displacements. With the values T (n_theta x n_load) of the training
  loads at one value of the parameters that change K or B, T c = theta(mu) gives F = sum of c_k F_k, and with the same
  c, of least norm, the solutions K^-1 F. Only K^-1 is interpolated. Where the shape in space of an expression changes
  with the parameters, F is no such sum: training detects this, and interpolates.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>

#define PROBES   6     /* nodes at which an expression in space is evaluated */
#define SINGULAR 1e-9  /* singular values below this share of the first count as 0 */
#define EXACT    1e-11 /* tolerance, as a share of the largest value of a load's expression */
#define ROUNDING 1e-14 /* share of the largest gap: smaller gaps are closed */

typedef PetscErrorCode (*Visit)(HycoCondensed c, HycoExpr expr, HycoMesh mesh, PetscInt group, PetscInt body,
                                void *ctx);

/* Visits each expression in which F is linear. With a mesh, finds the group of nodes on which it acts, or else the
   body. */
static PetscErrorCode ForEach(HycoCondensed c, HycoMesh mesh, Visit visit, void *ctx)
{
  const HycoScene s = c->scene;
  PetscInt group = -1;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    for (PetscInt k = 0; k < 3; k++) {
      if (s->body[b].force[k]) PetscCall(visit(c, s->body[b].force[k], mesh, -1, b, ctx));
    }
  }
  for (PetscInt f = 0; f < s->n_fixed; f++) {
    if (mesh) PetscCall(HycoMeshFindGroup(mesh, "fixed", s->fixed[f].group, &group));
    for (PetscInt k = 0; k < 3; k++) {
      if (s->fixed[f].value[k]) PetscCall(visit(c, s->fixed[f].value[k], mesh, group, -1, ctx));
    }
    if (s->fixed[f].normal) PetscCall(visit(c, s->fixed[f].normal, mesh, group, -1, ctx));
  }
  for (PetscInt f = 0; f < s->n_loads; f++) {
    if (mesh) PetscCall(HycoMeshFindGroup(mesh, "load", s->load[f].group, &group));
    if (s->load[f].pressure) PetscCall(visit(c, s->load[f].pressure, mesh, group, -1, ctx));
    for (PetscInt k = 0; k < 3; k++) {
      if (s->load[f].traction[k]) PetscCall(visit(c, s->load[f].traction[k], mesh, group, -1, ctx));
    }
  }
  for (PetscInt f = 0; f < s->n_point_loads; f++) {
    if (mesh) PetscCall(HycoMeshFindGroup(mesh, "force", s->point_load[f].group, &group));
    for (PetscInt k = 0; k < 3; k++) {
      if (s->point_load[f].force[k]) PetscCall(visit(c, s->point_load[f].force[k], mesh, group, -1, ctx));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the expressions allow it, and the number of their values; the points at which those in space are
   evaluated. */
typedef struct {
  HycoFOM fom;
  PetscBool fit;
  PetscInt n_theta, n_probes;
} Survey;

/* Nodes of a group (or, where that is < 0, of a body), evenly chosen in the file's order, with the first and the
   last. Collective. */
static PetscErrorCode ProbeNodes(HycoFOM f, PetscInt group, PetscInt body, PetscReal probe[3 * PROBES])
{
  HycoMesh m = f->part;
  const PetscInt first = group < 0 ? 0 : m->group_start[group],
                 last = group < 0 ? m->n_nodes : m->group_start[group + 1];
  PetscInt *node, *key, *place, n = 0, all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(last - first, &node, last - first, &key, last - first, &place));
  for (PetscInt k = first; k < last; k++) {
    const PetscInt i = group < 0 ? k : m->group_node[k];

    if ((group < 0 && m->node_body[i] != body) || HycoMeshOwned(m, i) < 0) continue;
    node[n] = i;
    key[n++] = m->node_whole ? m->node_whole[i] : i;
  }
  PetscCall(HycoRankInts(HycoComm(f), n, key, place, &all));
  PetscCall(PetscArrayzero(probe, 3 * PROBES));
  for (PetscInt k = 0; k < n * PROBES; k++) {
    if (place[k / PROBES] == k % PROBES * (all - 1) / (PROBES - 1))
      PetscCall(PetscArraycpy(probe + 3 * (k % PROBES), f->fe->X + 3 * node[k / PROBES], 3));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, probe, 3 * PROBES, MPIU_REAL, MPI_SUM, HycoComm(f)));
  PetscCall(PetscFree3(node, key, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Inspect(HycoCondensed c, HycoExpr expr, HycoMesh mesh, PetscInt group, PetscInt body, void *ctx)
{
  Survey *s = (Survey *)ctx;
  PetscBool stiff[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};

  PetscFunctionBegin;
  (void)mesh;
  for (PetscInt p = 0; p < c->dim; p++) stiff[p] = (PetscBool)(c->stiff[p] != 0);
  if (!HycoExprInSpace(expr)) {
    s->n_theta++;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (HycoExprChanges(expr, stiff))
    s->fit = PETSC_FALSE; /* its shape may depend on a map, and may not be finite
                             here */
  PetscCall(PetscRealloc(sizeof(PetscReal) * 3 * (size_t)(s->n_probes + PROBES), &c->probe));
  PetscCall(ProbeNodes(s->fom, body < 0 ? group : -1, body, c->probe + 3 * s->n_probes));
  s->n_probes += PROBES;
  s->n_theta += PROBES;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The values at mu in order. */
typedef struct {
  const PetscReal *mu;
  PetscInt n_theta, n_probes;
  PetscReal *theta; /* NULL: only counted */
} Values;

static PetscErrorCode Evaluate(HycoCondensed c, HycoExpr expr, HycoMesh mesh, PetscInt group, PetscInt body, void *ctx)
{
  Values *v = (Values *)ctx;
  const PetscReal origin[3] = {0, 0, 0};
  const PetscBool space = HycoExprInSpace(expr);
  const PetscInt n = space ? PROBES : 1;

  PetscFunctionBegin;
  (void)mesh;
  (void)group;
  (void)body;
  if (v->theta)
    PetscCall(HycoExprEval(expr, v->mu, n, space ? c->probe + 3 * v->n_probes : origin, v->theta + v->n_theta));
  v->n_theta += n;
  if (space) v->n_probes += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadValues(HycoCondensed c, const PetscReal mu[], PetscReal theta[])
{
  Values v = {mu, 0, 0, theta};

  PetscFunctionBegin;
  PetscCall(ForEach(c, NULL, Evaluate, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoCondensedPoint(HycoCondensed c, PetscInt k, PetscReal mu[])
{
  for (PetscInt p = c->dim - 1; p >= 0; p--) {
    mu[p] = c->x[p][k % c->n[p]];
    k /= c->n[p];
  }
}

/* Each node's node of the stiffness, and its number among those with the same one. */
static PetscErrorCode NumberLoads(HycoCondensed c)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor),
                 n_stiff = HycoTensorSize(&c->field[HYCO_FIELD_G].tensor);
  PetscInt *count;

  PetscFunctionBegin;
  PetscCall(PetscFree(c->node_stiff));
  PetscCall(PetscFree(c->node_load));
  PetscCall(PetscMalloc1(n, &c->node_stiff));
  PetscCall(PetscMalloc1(n, &c->node_load));
  PetscCall(PetscCalloc1(n_stiff, &count));
  for (PetscInt k = 0; k < n; k++) {
    c->node_stiff[k] = HycoCondensedNode(c, &c->field[HYCO_FIELD_G], k);
    c->node_load[k] = count[c->node_stiff[k]]++;
  }
  c->n_load = n / n_stiff;
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes T of each stiffness, scaled by rows, and its pseudo-inverse. */
static PetscErrorCode InvertLoads(HycoCondensed c)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), n_stiff = n / c->n_load;
  const size_t size = (size_t)c->n_theta * (size_t)c->n_load;
  PetscReal *T, *theta, mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscFree(c->inverse));
  PetscCall(PetscFree(c->theta_scale));
  PetscCall(PetscMalloc1(size * (size_t)n_stiff + 1, &c->inverse));
  PetscCall(PetscCalloc1(c->n_theta + 1, &c->theta_scale));
  PetscCall(PetscMalloc2(size * (size_t)n_stiff + 1, &T, c->n_theta + 1, &theta));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *column = T + (size_t)c->node_stiff[k] * size + (size_t)c->node_load[k] * (size_t)c->n_theta;

    HycoCondensedPoint(c, k, mu);
    PetscCall(LoadValues(c, mu, theta));
    for (PetscInt i = 0; i < c->n_theta; i++) {
      column[i] = theta[i];
      c->theta_scale[i] = PetscMax(c->theta_scale[i], PetscAbsReal(theta[i]));
    }
  }
  for (PetscInt i = 0; i < c->n_theta; i++) c->theta_scale[i] = c->theta_scale[i] > 0 ? 1 / c->theta_scale[i] : 1;
  for (size_t j = 0; j < size * (size_t)n_stiff; j++) T[j] *= c->theta_scale[j % (size_t)c->n_theta];
  for (PetscInt s = 0; s < n_stiff; s++)
    PetscCall(HycoPseudoInverse(c->n_theta, c->n_load, T + (size_t)s * size, SINGULAR, c->inverse + (size_t)s * size));
  PetscCall(PetscFree2(T, theta));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedSurveyLoads(HycoCondensed c, HycoFOM fom, PetscBool *fit)
{
  Survey s = {fom, PETSC_TRUE, 0, 0};

  PetscFunctionBegin;
  PetscCall(PetscFree(c->probe));
  for (PetscInt b = 0; b < c->scene->n_bodies; b++) {
    /* products of expressions, so that F is not a sum */
    if (HycoSceneHasInertia(c->scene, &c->scene->body[b], NULL)) s.fit = PETSC_FALSE;
  }
  PetscCall(ForEach(c, fom->part, Inspect, &s));
  c->n_probes = s.n_probes;
  *fit = s.fit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPrepareLoads(HycoCondensed c)
{
  Values v = {NULL, 0, 0, NULL};

  PetscFunctionBegin;
  PetscCall(ForEach(c, NULL, Evaluate, &v));
  HycoCheck(v.n_probes == c->n_probes, "the condensed model has %d points for its loads, and its scene needs %d",
            (int)c->n_probes, (int)v.n_probes);
  c->n_theta = v.n_theta;
  PetscCall(NumberLoads(c));
  PetscCall(InvertLoads(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedLoadWeights(HycoCondensed c, const PetscReal mu[], PetscInt s, PetscReal weight[],
                                        PetscBool *span)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  const PetscReal *P = c->inverse + (size_t)s * (size_t)c->n_theta * (size_t)c->n_load;
  PetscReal *theta, *training, at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(c->n_theta + 1, &theta, c->n_theta + 1, &training));
  PetscCall(LoadValues(c, mu, theta));
  for (PetscInt k = 0; k < c->n_load; k++) {
    weight[k] = 0;
    for (PetscInt i = 0; i < c->n_theta; i++) weight[k] += P[i * c->n_load + k] * c->theta_scale[i] * theta[i];
  }
  for (PetscInt j = 0; j < n; j++) {
    if (c->node_stiff[j] != s) continue;
    HycoCondensedPoint(c, j, at);
    PetscCall(LoadValues(c, at, training));
    for (PetscInt i = 0; i < c->n_theta; i++) theta[i] -= weight[c->node_load[j]] * training[i];
  }
  *span = PETSC_TRUE;
  for (PetscInt i = 0; i < c->n_theta; i++)
    *span = (PetscBool)(*span && PetscAbsReal(theta[i]) * c->theta_scale[i] <= EXACT);
  PetscCall(PetscFree2(theta, training));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weights of all nodes of the whole grid: those of G's nodes, times the weights of the loads of each. */
static PetscErrorCode Weights(HycoCondensed c, const PetscReal mu[], PetscInt axis, PetscInt skip,
                              const HycoTensor *degrees, PetscReal weight[])
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), n_stiff = n / c->n_load;
  HycoTensor t = c->field[HYCO_FIELD_G].tensor;
  PetscReal *theta, *w;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->dim; p++) t.degree[p] = c->stiff[p] ? degrees->degree[p] : 0;
  PetscCall(PetscMalloc2(c->n_theta + 1, &theta, n_stiff, &w));
  PetscCall(LoadValues(c, mu, theta));
  for (PetscInt i = 0; i < c->n_theta; i++) theta[i] *= c->theta_scale[i];
  PetscCall(HycoTensorWeights(&t, mu, axis, skip, w));
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal *P = c->inverse + (size_t)c->node_stiff[j] * (size_t)c->n_theta * (size_t)c->n_load;
    PetscReal share = 0;

    for (PetscInt i = 0; i < c->n_theta; i++) share += P[i * c->n_load + c->node_load[j]] * theta[i];
    weight[j] = w[c->node_stiff[j]] * share;
  }
  PetscCall(PetscFree2(theta, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedEvaluate(HycoCondensed c, PetscInt f, const PetscReal mu[], PetscInt axis, PetscInt skip,
                                     PetscReal value[])
{
  const HycoGridField *field = &c->field[f];
  PetscReal *weight;

  PetscFunctionBegin;
  if (!c->exact_loads || (f != HYCO_FIELD_GAP && f != HYCO_FIELD_FREE)) {
    PetscCall(HycoGridFieldEvaluate(field, mu, axis, skip, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(HycoTensorSize(&field->tensor), &weight));
  PetscCall(Weights(c, mu, axis, skip, &field->tensor, weight));
  PetscCall(HycoGridFieldSum(field, weight, value));
  PetscCall(PetscFree(weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedBringGap(HycoCondensed c, const PetscReal mu[])
{
  const HycoGapSource *d = &c->given;

  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(d->fe, mu));
  if (d->fe->contact_changed || d->fe->gap_changed)
    PetscCall(HycoContactRows(d->fe, d->pairs, d->rows.start, d->rows.dof, d->rows.value, d->rows.gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedFreeGap(HycoCondensed c, const PetscReal mu[], PetscInt axis, PetscInt skip)
{
  PetscReal size = c->gap_size;

  PetscFunctionBegin;
  PetscCall(HycoCondensedEvaluate(c, HYCO_FIELD_GAP, mu, axis, skip, c->g));
  if (c->exact_gap) {
    PetscCall(HycoCondensedBringGap(c, mu));
    for (PetscInt i = 0; i < c->m; i++) {
      size = PetscMax(size, PetscAbsReal(c->given.rows.gap[i]));
      c->g[i] += c->given.rows.gap[i];
    }
  }
  for (PetscInt i = 0; i < c->m; i++) { /* a closed gap without load is set to 0, so that round-off causes no force */
    if (PetscAbsReal(c->g[i]) <= ROUNDING * size) c->g[i] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
