/*
  Errors of the scene's outputs at held-out points: those of the final model compared with those of the stored
  full-order solutions, in the outputs' own units. Rank 0 evaluates both on the cells that the outputs need, by the
  functions of predict (output_cells.c). Outputs may pass through zero, so that no error is divided by the output
  itself.
*/
#include <hycoquantities.h>
#include <hycoreducerimpl.h>
#include <math.h>

/* The fields of a full-order solution; reactions of paths only, others follow from U. */
enum { DISPLACEMENT, STRESS, REACTION, N_FIELDS };
static const char *const fields[N_FIELDS] = {"U", "sigma", "reaction"};

/* Of a full-order solution the nodes and cells from the first to the last that the outputs need. Rank 0. */
typedef struct {
  HycoReducer t;
  HycoSamples points;
  HycoROM m;
  HycoSnapshots store;
  HycoFE fe; /* of the output cells (borrowed); NULL: the outputs need only results of contacts */
  PetscInt first[N_FIELDS], n[N_FIELDS];
  PetscReal *rows[N_FIELDS], *value[N_FIELDS]; /* these nodes or cells, then those of the mesh */
  PetscReal *lambda;
  HycoShear shear; /* of the full-order solution */
} Outputs;

/* The cells that the outputs need; the reactions that follow from balance, with the cells of their loads (NULL: there
   are no reactions). The meshes are on rank 0. Collective. */
static PetscErrorCode GatherCells(HycoReducer t, HycoMesh *mesh, PetscBool **balanced, HycoMesh *loaded)
{
  HycoMesh part = t->fom->part;
  PetscBool *needed;

  PetscFunctionBegin;
  *balanced = NULL;
  *loaded = NULL;
  PetscCall(PetscMalloc1(part->n_cells, &needed));
  /* A group without cells on a rank is no error there. */
  HycoOnEach(HycoComm(t), HycoQuantitiesMarkCells(t->scene, part, needed));
  PetscCall(HycoReducerGatherMesh(t, needed, mesh));
  if (HycoSceneHasReactions(t->scene)) {
    PetscCall(PetscCalloc1(t->scene->n_quantities * t->scene->n_bodies, balanced));
    /* Collective: a group's supports may lie on several ranks. */
    PetscCall(HycoQuantitiesBalance(HycoComm(t), t->scene, part, *balanced));
    HycoOnEach(HycoComm(t), HycoQuantitiesMarkLoads(t->scene, part, *balanced, needed));
    PetscCall(HycoReducerGatherMesh(t, needed, loaded));
  }
  PetscCall(PetscFree(needed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the model's output cells from these cells and the modes at their nodes. Collective; m: on rank 0. In
   training there is no file with the whole mesh: the model gets the cells and modes that it would read from it.
   HycoROMSetOutputCells() takes the arrays over. */
static PetscErrorCode MakeProbe(HycoReducer t, HycoROM m)
{
  HycoMesh mesh, loaded;
  PetscReal *columns, *V = NULL;
  PetscBool *balanced;
  PetscInt n;

  PetscFunctionBegin;
  if (!HycoSceneHasFieldOutputs(t->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GatherCells(t, &mesh, &balanced, &loaded));
  n = mesh ? mesh->n_nodes * t->sizes[3] : 0;
  PetscCall(PetscMalloc1((size_t)n * (size_t)t->l + 1, &columns));
  /* Rows of distributed modes, only those of the gathered nodes. */
  PetscCall(HycoReducerFetchRows(t, t->V, t->l, mesh ? mesh->n_nodes : 0, mesh ? mesh->node_whole : NULL, columns));
  if (mesh) PetscCall(PetscMalloc1((size_t)n * (size_t)t->l + 1, &V));
  for (PetscInt i = 0; i < n; i++) {
    /* Fetched by columns, used by rows. */
    for (PetscInt j = 0; j < t->l; j++)
      V[(size_t)i * (size_t)t->l + (size_t)j] = columns[(size_t)j * (size_t)n + (size_t)i];
  }
  PetscCall(PetscFree(columns));
  HycoOnRoot(HycoComm(t), HycoROMSetOutputCells(m, mesh, V, balanced, loaded));
  if (t->rank) PetscCall(PetscFree(balanced));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of values of a node or cell. */
static PetscInt JudgedOutputsWidth(const Outputs *o, int k)
{
  return k == STRESS ? o->fe->n_sigma : o->fe->dim;
}

/* The number of the mesh's nodes or cells, and their numbers in the whole mesh. */
static PetscInt JudgedOutputsPositions(const Outputs *o, int k, const PetscInt **at)
{
  *at = k == STRESS ? o->fe->mesh->cell_whole : o->fe->mesh->node_whole;
  return k == STRESS ? o->fe->mesh->n_cells : o->fe->mesh->n_nodes;
}

/* The ranges of rows of each field that the outputs' cells need: only these are read from the snapshots. Rows from
   the first to the last that is needed, one read for each field: outputs are often at one place of the mesh. */
static PetscErrorCode JudgedOutputsBegin(Outputs *o)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(o->m->model->pairs.n, &o->lambda));
  PetscCall(PetscCalloc2(3 * o->m->model->pairs.n, &o->shear.force, o->m->model->pairs.n, &o->shear.work));
  o->fe = HycoROMGetOutputCells(o->m);
  for (int k = 0; o->fe && k < N_FIELDS; k++) {
    const PetscInt *at, n = JudgedOutputsPositions(o, k, &at);
    PetscInt last = -1;

    /* An empty range if no cell is needed. */
    o->first[k] = PETSC_MAX_INT;
    for (PetscInt i = 0; i < n; i++) {
      o->first[k] = PetscMin(o->first[k], at[i]);
      last = PetscMax(last, at[i]);
    }
    o->n[k] = PetscMax(0, last + 1 - o->first[k]);
    PetscCall(
        PetscMalloc2(o->n[k] * JudgedOutputsWidth(o, k), &o->rows[k], n * JudgedOutputsWidth(o, k), &o->value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an error too. The friction of the last shown time returns to the contacts, which borrowed o->shear. */
static PetscErrorCode JudgedOutputsEnd(Outputs *o)
{
  PetscFunctionBegin;
  HycoTraceShow(o->m, o->m->trace.shown);
  for (int k = 0; k < N_FIELDS; k++) PetscCall(PetscFree2(o->rows[k], o->value[k]));
  PetscCall(PetscFree(o->lambda));
  PetscCall(PetscFree2(o->shear.force, o->shear.work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a field of the solution at mu; *has: the solution has it. */
static PetscErrorCode ReadField(Outputs *o, const PetscReal mu[], PetscInt step, int k, PetscBool *has)
{
  const PetscInt *at, n = JudgedOutputsPositions(o, k, &at), width = JudgedOutputsWidth(o, k);

  PetscFunctionBegin;
  *has = PETSC_TRUE;
  /* Files of earlier versions have none. */
  if (k == REACTION) PetscCall(HycoSnapshotsHas(o->store, mu, step, fields[k], has));
  if (!*has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSnapshotsReadRows(o->store, mu, step, fields[k], o->first[k] * width, o->n[k] * width, o->rows[k]));
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscArraycpy(o->value[k] + i * width, o->rows[k] + (at[i] - o->first[k]) * width, width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the contacts the friction of the solution. */
static PetscErrorCode ReadFriction(Outputs *o, const PetscReal mu[], PetscInt step)
{
  const PetscInt n = o->m->model->pairs.n;

  PetscFunctionBegin;
  if (!HycoSceneHasFriction(o->m->model->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; c < HYCO_SNAPSHOT_FRICTION; c++) {
    PetscCall(HycoSnapshotsReadRows(o->store, mu, step, HycoSnapshotFriction[c], 0, n, o->lambda));
    /* o->lambda serves as room for each component. */
    for (PetscInt k = 0; k < n; k++) *(c < 3 ? o->shear.force + 3 * k + c : o->shear.work + k) = o->lambda[k];
  }
  HycoTraceShowOther(o->m, &o->shear);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full-order outputs at mu, at listed time `step` of a history. */
static PetscErrorCode MeasureStored(Outputs *o, const PetscReal mu[], PetscInt step, PetscReal value[])
{
  const HycoScene scene = o->m->model->scene;
  PetscReal all[HYCO_MAX_PARAMETERS];
  PetscBool has[N_FIELDS] = {PETSC_FALSE};

  PetscFunctionBegin;
  for (int k = 0; o->fe && k < (HycoSceneHasReactions(scene) ? N_FIELDS : REACTION); k++)
    PetscCall(ReadField(o, mu, step, k, &has[k]));
  /* Tangential forces and work, where the scene has friction. */
  PetscCall(ReadFriction(o, mu, step));
  PetscCall(HycoSnapshotsReadRows(o->store, mu, step, "lambda", 0, o->m->model->pairs.n, o->lambda));
  /* Outputs are evaluated on the mesh and with the variables of this time. */
  HycoSceneSetTime(scene, mu, scene->n_times ? scene->times[step] : 0, all);
  PetscCall(HycoROMMeasureSolution(o->m, all, o->value[DISPLACEMENT], o->value[STRESS],
                                   has[REACTION] ? o->value[REACTION] : NULL, o->lambda, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs of a prediction; *known: they can be evaluated. They cannot if a law has no solution along the predicted
   path, which does not end the training. */
static PetscErrorCode MeasurePredicted(Outputs *o, const PetscReal mu[], HycoPrediction *p, PetscBool *known)
{
  char message[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoHeldOutPredict(o->m, o->store, mu));
  HycoCatch(HycoROMGetPrediction(o->m, p), ierr, message);
  *known = (PetscBool)!ierr;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The errors at one held-out point: the largest of the listed times of a path; NaN if not known. */
static PetscErrorCode JudgeOne(Outputs *o, const PetscReal mu[], HycoOutputErrors *e)
{
  HycoROM m = o->m;
  const PetscInt n_times = PetscMax(1, m->model->scene->n_times), n_q = m->model->scene->n_quantities;
  HycoPrediction p;
  PetscReal value[HYCO_MAX_QUANTITIES];
  PetscBool known = PETSC_FALSE, apart[HYCO_MAX_QUANTITIES] = {PETSC_FALSE};

  PetscFunctionBegin;
  PetscCall(MeasurePredicted(o, mu, &p, &known));
  for (PetscInt q = 0; !known && q < n_q; q++) e->error[q] = e->size[q] = NAN;
  if (!known) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt q = 0; q < n_q; q++) e->norm[q] = HycoOutputNorm(&m->model->scene->quantity[q], &p, NULL);
  for (PetscInt k = 0; k < n_times; k++) {
    const PetscReal *found = m->model->scene->n_times ? m->trace.step[k].quantity : p.quantity;

    PetscCall(MeasureStored(o, mu, k, value));
    for (PetscInt q = 0; q < n_q; q++) {
      const PetscBool arbitrary = (PetscBool)((m->model->scene->n_times ? m->trace.loose[k] : m->prediction.loose) &&
                                              HycoQuantityOfPosition(&m->model->scene->quantity[q]));
      const PetscReal error = arbitrary ? 0 : PetscAbsReal(found[q] - value[q]), size = PetscAbsReal(value[q]);

      /* A comparison with NaN is false: it must be kept by name. */
      e->error[q] = error > e->error[q] || PetscIsInfOrNanReal(error) ? error : e->error[q];
      e->size[q] = size > e->size[q] || PetscIsInfOrNanReal(size) ? size : e->size[q];
      apart[q] = (PetscBool)(apart[q] || arbitrary);
    }
  }
  /* Compared at no time with loads. */
  for (PetscInt q = 0; q < n_q; q++) {
    if (apart[q] && e->error[q] == 0) e->error[q] = NAN;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All points with converged predictions. */
static PetscErrorCode JudgeAll(Outputs *o, HycoHeldOut rows[], HycoOutputErrors e[])
{
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(o->points, &n, &n_par, &mu));
  for (PetscInt k = 0; k < n; k++) {
    /* A diverged prediction has no outputs to judge. */
    if (rows[k].converged < 0.5) continue;
    PetscCall(HycoReducerTell(o->t, "outputs", k, n));
    PetscCall(JudgeOne(o, mu + k * n_par, &e[k]));
    /* Again, now that the cells of the outputs are there: one feature is theirs. */
    PetscCall(HycoEstimatesFeatures(o->m, rows[k].feature));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model's output cells were made for this judgement; predictions make their own. */
static PetscErrorCode JudgeOnRoot(Outputs *o, HycoHeldOut rows[], HycoOutputErrors e[])
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = JudgedOutputsBegin(o);
  if (!ierr) ierr = JudgeAll(o, rows, e);
  PetscCall(JudgedOutputsEnd(o));
  PetscCall(HycoOutputCellsDestroy(&o->m->output_cells));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outputs of the stored fields are measured by the code that measures predictions: both have the same definition. */
PetscErrorCode HycoReducerJudgeOutputs(HycoReducer t, HycoSamples points, HycoROM m, HycoSnapshots store,
                                       HycoHeldOut rows[], HycoOutputErrors errors[])
{
  Outputs o = {.t = t, .points = points, .m = m, .store = store};

  PetscFunctionBegin;
  if (!t->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MakeProbe(t, m));
  HycoOnRoot(HycoComm(t), JudgeOnRoot(&o, rows, errors));
  PetscFunctionReturn(PETSC_SUCCESS);
}
