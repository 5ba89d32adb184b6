/* hyco compare: compares the reduced model with full order over a set of points, or of paths in full order's steps. */
#include "driver.h"
#include <hycoqueue.h>
#include <math.h>

/* The outputs that the scenes of a full-order solution and of a model have in common, and their numbers in both. */
typedef struct {
  PetscInt n, full[HYCO_MAX_QUANTITIES], reduced[HYCO_MAX_QUANTITIES];
  const char *names[HYCO_MAX_QUANTITIES];
  PetscBool placed[HYCO_MAX_QUANTITIES]; /* arbitrary where the position of a body is */
} Outputs;

/* By definition, not by name alone: the scene may have outputs that the model was not trained with. */
static PetscErrorCode CommonOutputs(HycoScene scene, HycoROM model, Outputs *outputs)
{
  const char *names[HYCO_MAX_QUANTITIES];
  HycoScene other;
  PetscInt n, at[HYCO_MAX_QUANTITIES];

  PetscFunctionBegin;
  PetscCall(HycoROMGetScene(model, &other));
  PetscCall(HycoSceneGetQuantities(scene, &n, names));
  HycoSceneMatchQuantities(scene, other, at);
  outputs->n = 0;
  for (PetscInt q = 0; q < n; q++) {
    /* Outputs that one of the two lacks are left out of the comparison, not refused. */
    if (at[q] < 0) continue;
    outputs->full[outputs->n] = q;
    outputs->reduced[outputs->n] = at[q];
    outputs->placed[outputs->n] = HycoSceneQuantityIsOfPosition(scene, q);
    outputs->names[outputs->n++] = names[q];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns that points and paths have in common; *sliding: the largest so far. */
static void FillCommon(const DriverColumns *c, const HycoSummary *s, const HycoPrediction *p, PetscReal row[],
                       PetscReal *sliding)
{
  const PetscReal estimate[] = {p->estimated_error_u, p->estimated_error_sigma, p->estimated_error_lambda};
  PetscReal *v = row + c->n_errors, *judged = row + c->estimates;

  *sliding = PetscMax(*sliding, PetscMax(s->sliding, p->sliding));
  v[DRIVER_CONVERGED] = p->reason > 0;
  v[DRIVER_KKT] = HycoKKTMax(&p->kkt);
  v[DRIVER_CPU_FOM] = s->seconds.cpu;
  v[DRIVER_CPU_ROM] = p->seconds.cpu;
  /* A negative estimate means none, which a table shows as not a number. */
  for (PetscInt k = 0; k < DRIVER_ESTIMATES; k++) judged[k] = estimate[k] >= 0 ? estimate[k] : NAN;
  judged[DRIVER_ESTIMATES] = p->unseen;
  judged[DRIVER_ESTIMATES + 1] = p->loose;
  judged[DRIVER_ESTIMATES + 2] = p->rid_fraction;
}

/* One point on one group: both solutions, and their difference. Both on this group's ranks. A failed full-order
   solution ends the command: there is nothing to compare with. */
static PetscErrorCode ComparePoint(HycoScene scene, HycoFOM fom, HycoROM model, PetscInt n_par, const PetscReal mu[],
                                   const Outputs *outputs, const DriverColumns *c, PetscReal v[], PetscReal *sliding,
                                   char free_motion[DRIVER_LINE])
{
  HycoSummary s;
  HycoPrediction p;
  HycoErrors e = {0};
  char words[DRIVER_LINE];

  PetscFunctionBegin;
  /* Each with its outputs, and the model's with its estimates, as a user asks for them. */
  PetscCall(HycoFOMSolve(fom, n_par, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  if (s.reason < 0) {
    PetscCall(DriverFormatPoint(scene, mu, words, NULL));
    HycoFail("the full-order solution at %s failed: %s; no comparison is possible", words, s.why);
  }
  PetscCall(HycoROMPredict(model, n_par, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  PetscCall(HycoROMCompare(model, fom, &e));
  /* Of an arbitrary position there is no error: full order has chosen another one. */
  v[DRIVER_U] = p.loose ? NAN : e.u;
  v[DRIVER_U_H1] = p.loose ? NAN : e.u_h1;
  v[DRIVER_U_RID] = p.loose ? NAN : e.u_rid;
  v[DRIVER_SIGMA] = e.sigma;
  v[DRIVER_SIGMA_11] = e.sigma_11;
  v[DRIVER_LAMBDA_RID] = e.lambda_rid;
  v[DRIVER_LAMBDA_RID_DUAL] = e.lambda_rid_dual;
  v[DRIVER_LAMBDA] = e.lambda;
  v[DRIVER_LAMBDA_DUAL] = e.lambda_dual;
  FillCommon(c, &s, &p, v, sliding);
  PetscCall(PetscStrncpy(free_motion, p.free_motion, DRIVER_LINE));
  /* The fallback solver of the contact problem, not full order. */
  v[c->n_errors + DRIVER_FALLBACK] = p.reason == HYCO_CONVERGED_FALLBACK;
  v[c->n_errors + DRIVER_COVERED] = p.covered_force;
  v[c->n_errors + DRIVER_LAMBDA_NORM] = s.lambda_norm2;
  v[c->n_errors + DRIVER_SIGMA_NORM] = e.sigma_norm2;
  /* Absolute, in the output's unit: outputs may be zero or change sign. */
  for (PetscInt q = 0; q < outputs->n && p.reason <= 0; q++) v[c->outputs + q] = NAN;
  for (PetscInt q = 0; q < outputs->n && p.reason > 0; q++) {
    const PetscReal error = PetscAbsReal(p.quantity[outputs->reduced[q]] - s.quantity[outputs->full[q]]);

    v[c->outputs + q] = p.loose && outputs->placed[q] ? NAN : error;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The errors of the outputs at the listed times that both paths reached, on the model's process: v: at their worst
   time, and at the end. loose: at one the position of a body is arbitrary. */
static PetscErrorCode CompareOutputs(HycoFOM fom, HycoROM model, PetscBool loose, const Outputs *outputs, PetscReal v[])
{
  HycoHistory full, reduced;
  PetscInt both;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetHistory(fom, &full));
  PetscCall(HycoROMGetHistory(model, &reduced));
  both = PetscMin(full.n, reduced.n);
  for (PetscInt q = 0; q < outputs->n; q++) {
    PetscReal *worst = &v[q], *end = &v[outputs->n + q];

    *worst = *end = loose && outputs->placed[q] ? NAN : both ? 0 : PETSC_INFINITY;
    for (PetscInt k = 0; k < both && !(loose && outputs->placed[q]); k++) {
      *end = PetscAbsReal(full.step[k].quantity[outputs->full[q]] - reduced.step[k].quantity[outputs->reduced[q]]);
      /* The form keeps NaN, which a maximum would drop. */
      *worst = *end <= *worst ? *worst : *end;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full-order path and the model's, and their difference; root: the rank that predicts and whose v is used. */
static PetscErrorCode ComparePath(HycoFOM fom, HycoROM model, PetscBool root, PetscInt n_par, const PetscReal mu[],
                                  const Outputs *outputs, const DriverColumns *c, PetscReal v[], PetscReal *sliding,
                                  char free_motion[DRIVER_LINE])
{
  HycoSummary s;
  HycoPrediction p = {0};
  HycoPathErrors e = {0};

  PetscFunctionBegin;
  PetscCall(HycoROMComparePath(model, fom, n_par, mu, &e));
  PetscCall(HycoFOMGetSummary(fom, &s));
  /* The first rank of the group predicts; the others only compare their rows. */
  if (root) PetscCall(HycoROMGetPrediction(model, &p));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    v[j] = e.worst[j];
    v[HYCO_N_ERRORS + j] = e.end[j];
    /* Compared at no time with loads. */
    if (p.loose && (j == HYCO_ERROR_U || j == HYCO_ERROR_U_RID) && e.worst[j] == 0) v[j] = v[HYCO_N_ERRORS + j] = NAN;
  }
  FillCommon(c, &s, &p, v, sliding);
  PetscCall(PetscStrncpy(free_motion, p.free_motion, DRIVER_LINE));
  v[c->n_errors + DRIVER_REACHED] = e.n;
  v[c->n_errors + DRIVER_ITERATIONS] = p.iterations;
  if (root && outputs->n) PetscCall(CompareOutputs(fom, model, p.loose, outputs, v + c->outputs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of a comparison, shared by a queue. value: rows of those that this rank's group takes. */
typedef struct {
  HycoScene scene;
  HycoROM model;
  HycoQueue queue;
  PetscInt n, n_par;
  const PetscReal *mu;
  PetscReal *value, *sliding; /* the largest of this rank's points */
  Outputs outputs;
  DriverColumns columns;
  PetscInt *loose; /* this rank's first point at which the position of a body is arbitrary, and its motion; n: none */
  char *free_motion;
} Points;

/* Every rank of a group takes the same point from the queue; rows are kept by its first rank, and `unused` takes
   those of the others. */
static PetscErrorCode CompareQueued(const Points *p, HycoFOM fom, PetscBool root, PetscReal unused[])
{
  PetscInt k, n_done;
  char word[] = "points:";

  PetscFunctionBegin;
  for (PetscBool first = PETSC_TRUE;; first = PETSC_FALSE) {
    char free_motion[DRIVER_LINE] = "";
    PetscReal *v;

    PetscCall(HycoQueueTake(p->queue, &k));
    /* The point before has been finished by taking the next one. */
    if (!first && HycoRank(PETSC_COMM_WORLD) == 0) {
      PetscCall(HycoQueueDone(p->queue, &n_done));
      PetscCall(DriverProgress(n_done, p->n, word));
    }
    if (k < 0) PetscFunctionReturn(PETSC_SUCCESS);
    /* Rows of other groups stay 0 on this rank, so that a sum over the ranks collects the table. */
    v = root ? p->value + k * p->columns.n : unused;
    PetscCall(p->columns.paths ? ComparePath(fom, p->model, root, p->n_par, p->mu + k * p->n_par, &p->outputs,
                                             &p->columns, v, p->sliding, free_motion)
                               : ComparePoint(p->scene, fom, p->model, p->n_par, p->mu + k * p->n_par, &p->outputs,
                                              &p->columns, v, p->sliding, free_motion));
    if (!root || !free_motion[0] || k >= *p->loose) continue;
    *p->loose = k;
    PetscCall(PetscStrncpy(p->free_motion, free_motion, DRIVER_LINE));
  }
}

/* A full-order model of its own for each group, whose factor it keeps from point to point. */
static PetscErrorCode CompareMine(const Points *p)
{
  HycoFOM fom;
  MPI_Comm group;
  PetscReal *unused;

  PetscFunctionBegin;
  /* Ranks other than the group's first compute the same values and drop them. */
  PetscCall(PetscMalloc1(p->columns.n, &unused));
  PetscCall(HycoQueueGetGroup(p->queue, &group));
  PetscCall(HycoFOMCreate(group, p->scene, &fom));
  PetscCall(CompareQueued(p, fom, (PetscBool)(HycoRank(group) == 0), unused));
  PetscCall(PetscFree(unused));
  PetscCall(HycoFOMDestroy(&fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers a row for each point on every rank. */
static PetscErrorCode CompareAll(Points *p)
{
  PetscInt *list;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p->n, &list));
  for (PetscInt k = 0; k < p->n; k++) list[k] = k;
  PetscCall(HycoSnapshotsCreateQueue(PETSC_COMM_WORLD, p->scene, p->n_par, p->mu, p->n, list, p->n, &p->queue));
  PetscCall(PetscFree(list));
  /* Zero for points of other groups: the sum over ranks is the table. */
  PetscCall(PetscCalloc1(p->n * p->columns.n, &p->value));
  HycoOnEach(PETSC_COMM_WORLD, HycoQueueEnd(p->queue, CompareMine(p)));
  HycoAllreduce(p->value, p->n * p->columns.n, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD);
  PetscCall(HycoQueueDestroy(&p->queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -mu, or -mu_NAME for each parameter: a set of one. Compared as a set, so that report and table have one form. */
static PetscErrorCode AddOnePoint(HycoScene scene, HycoSamples samples, PetscBool *given)
{
  PetscReal mu[64];

  PetscFunctionBegin;
  PetscCall(DriverHasPoint(scene, given));
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DriverGetPoint(scene, NULL, mu));
  PetscCall(HycoSamplesAddPoint(samples, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareCompare(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool extrapolate;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, path, NULL, path, path));
  PetscCall(DriverGetPoint(NULL, NULL, NULL));
  PetscCall(DriverGetSamples(NULL, PETSC_FALSE, NULL, NULL));
  PetscCall(DriverReadExtrapolate(&extrapolate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motion of the first point of all ranks. */
static PetscErrorCode PrintFreeMotion(const Points *p)
{
  PetscInt first = *p->loose;
  PetscMPIInt rank = HycoRank(PETSC_COMM_WORLD);

  PetscFunctionBegin;
  HycoAllreduce(&first, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD);
  if (first == p->n) PetscFunctionReturn(PETSC_SUCCESS);
  if (*p->loose != first) rank = HycoSize(PETSC_COMM_WORLD);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &rank, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Bcast(p->free_motion, DRIVER_LINE, MPI_CHAR, rank, PETSC_COMM_WORLD));
  PetscCall(DriverPrint("warning: no contact force keeps %s at point %d: its position is arbitrary\n", p->free_motion,
                        (int)first + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene and the model must belong together, which is checked before any solve. */
PetscErrorCode CommandCompare(void)
{
  HycoScene scene;
  HycoROM model = NULL;
  HycoSamples samples;
  Points p = {0};
  DriverPiece all;
  DriverRows rows;
  PetscBool given, contact, extrapolate;
  PetscReal sliding = 0, training;
  PetscInt n_times, loose;
  char free_motion[DRIVER_LINE] = "";
  char path[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN], table[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, file, NULL, report, table));
  PetscCall(DriverRequire("scene", path));
  PetscCall(DriverRequire("model", file));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  /* A model on every rank, since each group of ranks predicts its own points. */
  HycoOnEach(PETSC_COMM_WORLD, HycoROMLoad(file, &model));
  PetscCall(HycoROMCheckScene(model, scene));
  PetscCall(DriverReadExtrapolate(&extrapolate));
  PetscCall(HycoSceneSetExtrapolate(scene, extrapolate));
  PetscCall(HycoROMSetExtrapolate(model, extrapolate));
  PetscCall(DriverGetSamples(scene, PETSC_FALSE, &samples, &given));
  if (!given) PetscCall(AddOnePoint(scene, samples, &given));
  HycoCheck(given, "give the test points: -mu V,V,... for one, or -grid N,N,..., or -values_NAME V,V,... for each "
                   "parameter, or -points FILE.csv");
  PetscCall(HycoSamplesGet(samples, &p.n, &p.n_par, &p.mu));
  PetscCall(DriverCheckLeftEarly());
  PetscCall(HycoSceneHasContact(scene, &contact));
  p.scene = scene;
  p.model = model;
  PetscCall(CommonOutputs(scene, model, &p.outputs));
  PetscCall(HycoSceneGetHistory(scene, &n_times, NULL));
  PetscCall(DriverCompareColumns((PetscBool)(n_times > 0), p.outputs.n, p.outputs.names, &p.columns));
  p.sliding = &sliding;
  p.loose = &loose;
  p.free_motion = free_motion;
  loose = p.n;
  /* Afterwards rank 0 has all rows. */
  PetscCall(CompareAll(&p));
  HycoAllreduce(&sliding, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD);
  rows = DriverRowsOfRoot(p.n, p.columns.n, p.value, &all);
  /* Before the report, which fails if a prediction did not converge. */
  if (table[0]) PetscCall(DriverWriteTable(table, scene, p.mu, p.columns.names, &rows));
  PetscCall(DriverWarnSliding(sliding));
  PetscCall(PrintFreeMotion(&p));
  PetscCall(HycoROMGetTrainingCost(model, &training));
  PetscCall(DriverReportComparison(scene, contact, training, &p.columns, p.n, p.value));
  PetscCall(PetscFree(p.value));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
