/* The condensed model as a type: a prediction, reports, the parts that training and the file give. */
#include <hycocondensed.h>
#include <hycoromtypes.h>
#include <petscviewer.h>
#include <string.h>

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

/* The active contacts of the nearest training point, or of the last prediction if that is nearer. The solution does
   not depend on it, because the equations of the final set determine it. */
static void StartSet(HycoCondensed c, const PetscReal mu[])
{
  PetscReal there, back = 0;
  const PetscInt node = HycoCondensedNearest(c, mu, &there);

  for (PetscInt p = 0; p < c->dim; p++) back += PetscSqr((c->last[p] - mu[p]) / HycoCondensedWidth(c, p));
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
  PetscCall(HycoCondensedCreateSystem(c, m->Lambda, m->solver));
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
  PetscCall(HycoCondensedFreeWork((HycoCondensed)m->work));
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

/* Keeps the first l modes: the rows of H and the entries of a are ordered by mode. */
static PetscErrorCode CutModes(HycoCondensed c, PetscInt l)
{
  const PetscInt rows[2] = {l * c->m, l}, of[2] = {HYCO_FIELD_H, HYCO_FIELD_FREE};

  PetscFunctionBegin;
  for (PetscInt f = 0; f < 2; f++) {
    HycoGridField *field = &c->field[of[f]];
    const PetscInt n = HycoTensorSize(&field->tensor);

    for (PetscInt k = 1; k < n; k++)
      PetscCall(PetscArraymove(field->data + (size_t)k * (size_t)rows[f], field->data + (size_t)k * (size_t)field->rows,
                               rows[f]));
    field->rows = rows[f];
  }
  c->l = l;
  PetscCall(HycoCondensedPrepare(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedBuild(HycoROM m, HycoReducer t)
{
  HycoCondensed c = Condensing(t)->condensed, none = (HycoCondensed)m->model->data;

  PetscFunctionBegin;
  if (t->scene->n_times) {
    PetscCall(HycoCondensedTakePath(m));
    PetscCall((*m->ops->build)(m, t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoCondensedFillFields(t, PETSC_TRUE));
  PetscCall(HycoCondensedLeaveOut(t));
  PetscCall(HycoCondensedResetSystem(c));
  PetscCall(CutModes(c, t->l));
  PetscCall(HycoCondensedFree(&none));
  m->model->data = c;
  Condensing(t)->condensed = NULL;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->model->in_rid[k] = 1;
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoReducerJudge(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
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
