/*
  The greedy loop of section 5.4: a model from the solutions so far, the indicator at every training point, and the
  full-order solution of the worst point is added. All choices depend only on the stored solutions, so that a run that
  was killed repeats them.
*/
#include <hycoalgorithms.h>
#include "greedy.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of an indicator: solves on other numbers of ranks differ by less; the lowest row is then taken
   (tests/training/greedy.py). */
#define TIED_INDICATOR 1e-9
/* Of the energy of the snapshots, what bases leave out by default: 450 eps, below which modes are round-off. */
#define DEFAULT_ENERGY 1e-13

typedef struct {
  HycoSnapshots store;
  HycoSamples samples;      /* the points solved so far, in the order of the choices */
  PetscInt n_par, n_points; /* of the training set */
  const PetscReal *points;  /* borrowed */
  PetscReal *value;         /* n_points x 4: eta, eta_u, eta_lambda, size */
  PetscBool *chosen;        /* n_points: those that the loop has chosen, also if they have no equilibrium */
  HycoROM model;            /* model of the current iteration, on every rank */
  PetscReal begin;
} Loop;

/* Adds the corners of the parameters' ranges, the last parameter fastest. */
static PetscErrorCode AddCorners(HycoReducer t, HycoSamples samples)
{
  const PetscInt n_par = t->scene->n_parameters;
  PetscInt counts[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoCheck(n_par <= 8, "the parameters' ranges have 2^%d corners; give the greedy training points to start from",
            (int)n_par);
  for (PetscInt p = 0; p < n_par; p++) counts[p] = 2;
  /* Two values each, ends included. (42) then interpolates in the whole box. */
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the loop's own set of samples, which will grow: each point once. Its own copy, because the loop adds
   points; (42) needs distinct points. */
static PetscErrorCode GreedyStart(HycoReducer t, HycoSamples start, HycoSamples *samples)
{
  PetscInt n, n_par;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(t->scene, samples));
  /* The corners of the ranges, so that (42) interpolates everywhere inside. */
  if (!start) {
    PetscCall(AddCorners(t, *samples));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoSamplesGet(start, &n, &n_par, &mu));
  for (PetscInt k = 0; k < n; k++) PetscCall(HycoSamplesAddPoint(*samples, mu + k * n_par));
  PetscCall(HycoSamplesDropTwins(*samples, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks the indicator: the replayed residual for paths, the others for solutions without a history. Here and not where
   the option is read: the scene is known only now. */
static PetscErrorCode CheckIndicator(HycoReducer t)
{
  const PetscBool residual = (PetscBool)(t->greedy.indicator == HYCO_INDICATOR_RESIDUAL);

  PetscFunctionBegin;
  HycoCheck(residual || !t->scene->n_times,
            "the scene has a history (history_times); for paths use -hyco_greedy_indicator residual");
  HycoCheck(!residual || t->scene->n_times,
            "-hyco_greedy_indicator residual is for paths, and the scene has no history; use local or penetration");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks before any solve: enough points to start from, not more than the limit, and points that (42) can
   interpolate. */
static PetscErrorCode CheckStart(HycoReducer t, PetscBool corners, HycoSamples samples)
{
  PetscInt n, n_par;
  const PetscReal *mu;
  HycoInterpolant interpolant = NULL;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, &n, &n_par, &mu));
  HycoCheck(!t->greedy.max_snapshots || t->greedy.max_snapshots >= n,
            "-max_snapshots is %d; at least %d are needed, because a greedy training first solves at the %d %s",
            (int)t->greedy.max_snapshots, (int)n, (int)n,
            corners ? "corners of the parameters' ranges" : "points given");
  if (!HycoIndicatorInterpolates(t->greedy.indicator)) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(n > n_par || n == t->greedy.max_snapshots,
            "the greedy training starts from %d point%s, and its indicator interpolates over %d parameters, which "
            "needs at least %d; give more points, or none (the corners are used)",
            (int)n, n == 1 ? "" : "s", (int)n_par, (int)n_par + 1);
  /* Tried and destroyed: it fails for points on a line or plane, before any solve. */
  PetscCall(HycoInterpolantCreate(n_par, n, mu, &interpolant));
  PetscCall(HycoInterpolantDestroy(&interpolant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves missing points, makes the bases and the model. The mesh is kept from one iteration to the next. Bases and
   model are made anew: an added solution changes all modes. Solved points are taken from the store. */
static PetscErrorCode BuildModel(HycoReducer t, Loop *loop, PetscInt iteration, HycoTraining *report)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerFill(t, loop->store, loop->samples, iteration ? NULL : t->progress));
  PetscCall(HycoReducerSetColumns(t, t->samples));
  PetscCall(HycoReducerResetBases(t));
  PetscCall(HycoReducerReduce(t, loop->store, PETSC_FALSE));
  if (t->trainer.modes) PetscCall((*t->trainer.modes)(t, loop->store));
  PetscCall(HycoReducerBuild(t, PETSC_FALSE, &loop->model, report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solutions on the unknowns of the model's mesh, n_dof x n_s row major, on every rank. Collective. */
static PetscErrorCode SpreadSnapshots(HycoReducer t, HycoROM m, PetscReal **U_at)
{
  const PetscInt n_dof = m->model->mesh->n_nodes * t->sizes[3];
  PetscReal *rows;

  PetscFunctionBegin;
  PetscCall(HycoReducerFetchSnapshots(t, t->rank ? 0 : m->model->mesh->n_nodes, m->model->mesh->node_whole, &rows));
  PetscCall(PetscMalloc1((size_t)n_dof * (size_t)t->n_s, U_at));
  for (PetscInt i = 0; t->rank == 0 && i < n_dof; i++) {
    /* An unknown's values at all solutions together: (42) is a sum over solutions for each unknown. */
    for (PetscInt k = 0; k < t->n_s; k++)
      (*U_at)[(size_t)i * (size_t)t->n_s + (size_t)k] = rows[(size_t)k * (size_t)n_dof + (size_t)i];
  }
  PetscCall(PetscFree(rows));
  for (PetscInt i = 0; i < n_dof; i++) /* by rows, because a message's length is an int */
    HycoBcast(*U_at + (size_t)i * (size_t)t->n_s, t->n_s, MPIU_REAL, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc's infinity is a large finite number; the table and comparisons need IEEE infinity. */
static PetscReal GreedyInfinite(PetscReal value)
{
  return value >= PETSC_INFINITY ? INFINITY : value;
}

/* Evaluates this rank's share of the training points. Not collective: points are dealt out in turn, and each value
   does not depend on earlier ones (no warm start). */
static PetscErrorCode EvaluateShare(HycoReducer t, Loop *loop, HycoROM m, const PetscReal U_at[])
{
  const PetscReal length = HycoMeshLength(t->fom->part);
  const PetscReal *solved;
  PetscInt n;
  HycoIndicator indicator;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(loop->samples, &n, NULL, &solved));
  PetscCall(HycoIndicatorCreate(m, t->greedy.indicator, n, solved, U_at, length, &indicator));
  for (PetscInt k = t->rank; k < loop->n_points; k += HycoSize(HycoComm(t))) {
    HycoIndication v;

    PetscCall(HycoIndicatorEvaluate(indicator, loop->points + k * loop->n_par, &v));
    /* Reduced by a maximum over ranks later: a NaN would be lost there. */
    loop->value[4 * k] = GreedyInfinite(v.eta);
    loop->value[4 * k + 1] = GreedyInfinite(v.eta_u);
    loop->value[4 * k + 2] = GreedyInfinite(v.eta_lambda);
    loop->value[4 * k + 3] = GreedyInfinite(v.size);
  }
  PetscCall(HycoIndicatorDestroy(&indicator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates the indicator at every training point, for every rank. */
static PetscErrorCode GreedyEvaluate(HycoReducer t, Loop *loop)
{
  HycoROM m = loop->model;
  PetscReal *U_at = NULL;
  PetscMPIInt count;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(4 * loop->n_points, &count));
  if (HycoIndicatorInterpolates(t->greedy.indicator)) PetscCall(SpreadSnapshots(t, m, &U_at));
  PetscCall(PetscArrayzero(loop->value, 4 * loop->n_points));
  HycoOnEach(HycoComm(t), EvaluateShare(t, loop, m, U_at));
  /* Others' entries are 0. Infinite ones stay so in the sum. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, loop->value, count, MPIU_REAL, MPI_SUM, HycoComm(t)));
  PetscCall(PetscFree(U_at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for a model that is kept in greedy-NNN.h5 beside the solutions, or only while it is judged on the whole
   mesh, which each rank reads. Collective. */
static PetscErrorCode EvaluateModel(HycoReducer t, Loop *loop, PetscInt iteration)
{
  const PetscBool whole = HycoIndicatorOnWhole(t->greedy.indicator);
  char path[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/greedy-%03d.h5", loop->store->folder, (int)iteration));
  if (t->greedy.keep || whole) PetscCall(HycoROMSave(loop->model, t->fom, t->l, t->V, path));
  if (whole) PetscCall(PetscStrncpy(loop->model->model->path, path, sizeof(loop->model->model->path)));
  ierr = GreedyEvaluate(t, loop);
  /* With an error too: it was written to be read by GreedyEvaluate() alone. */
  if (whole && !t->greedy.keep && t->rank == 0) remove(path);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of infinite values, the one with the larger numerator is worse; equal values are not. */
static PetscBool GreedyWorse(const PetscReal a[], const PetscReal b[])
{
  const PetscInt by = PetscIsInfReal(a[0]) && PetscIsInfReal(b[0]) ? 3 : 0;

  return (PetscBool)(PetscIsInfReal(b[by]) ? PETSC_FALSE : a[by] > b[by] * (1 + TIED_INDICATOR));
}

/* Distance from training point k to the nearest solution. Scaled to the ranges; only orders points, so that an
   error of HycoSamplesGet(), which has none here, gives 0. */
static PetscReal GreedyDistance(HycoReducer t, const Loop *loop, PetscInt k)
{
  const PetscReal *solved;
  PetscReal least = PETSC_MAX_REAL;
  PetscInt n;

  if (HycoSamplesGet(loop->samples, &n, NULL, &solved)) return 0;
  for (PetscInt j = 0; j < n; j++)
    least = PetscMin(least, HycoEstimatesDistance(t->scene, solved + j * loop->n_par, loop->points + k * loop->n_par));
  return least;
}

/* Whether training point a is solved before b: it is worse, or neither has a prediction and a is farther from the
   nearest solution. */
static PetscBool GreedyPrecedes(HycoReducer t, const Loop *loop, PetscInt a, PetscInt b)
{
  const PetscReal *of_a = loop->value + 4 * a, *of_b = loop->value + 4 * b;

  if (!PetscIsInfReal(of_a[3]) || !PetscIsInfReal(of_b[3])) return GreedyWorse(of_a, of_b);
  return (PetscBool)(GreedyDistance(t, loop, a) > GreedyDistance(t, loop, b) * (1 + TIED_INDICATOR));
}

/* The worst point that is not solved yet (-1: none is left), and the data for the monitor. */
static PetscErrorCode GreedyChoose(HycoReducer t, Loop *loop, PetscInt *worst, HycoGreedyStep *step)
{
  const PetscReal *solved;
  PetscInt n_solved, n_finite = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(loop->samples, &n_solved, NULL, &solved));
  *worst = -1;
  for (PetscInt k = 0; k < loop->n_points; k++) {
    const PetscReal *value = loop->value + 4 * k;
    PetscBool known = PETSC_FALSE;

    for (PetscInt j = 0; j < n_solved && !known; j++)
      PetscCall(PetscArraycmp(solved + j * loop->n_par, loop->points + k * loop->n_par, loop->n_par, &known));
    if (loop->chosen[k] && !known) continue; /* it has no equilibrium */
    step->n_points++;
    step->max_eta = PetscMax(step->max_eta, value[0]);
    /* Means of the finite ones; how many are infinite is reported beside them. */
    if (!PetscIsInfReal(value[0])) {
      step->mean_eta_u += value[1];
      step->mean_eta_lambda += value[2];
      n_finite++;
    }
    /* A solved point may still have the largest indicator, as of a poor model: solving it again would never end. */
    if (!known && (*worst < 0 || GreedyPrecedes(t, loop, k, *worst))) *worst = k;
  }
  step->n_infinite = step->n_points - n_finite;
  step->mean_eta_u /= PetscMax(n_finite, 1);
  step->mean_eta_lambda /= PetscMax(n_finite, 1);
  if (*worst < 0) PetscFunctionReturn(PETSC_SUCCESS);
  step->worst = loop->points + *worst * loop->n_par;
  step->eta = loop->value[4 * *worst];
  step->eta_u = loop->value[4 * *worst + 1];
  step->eta_lambda = loop->value[4 * *worst + 2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL: go on. The order matters for what is reported: a target that is met counts before a limit. */
static const char *WhyStop(HycoReducer t, const HycoGreedyStep *step)
{
  if (step->max_eta <= t->greedy.target) return "target";
  if (t->greedy.max_snapshots && step->n_samples >= t->greedy.max_snapshots) return "snapshots";
  if (t->greedy.max_seconds > 0 && step->seconds >= t->greedy.max_seconds) return "seconds";
  return step->worst ? NULL : "points";
}

/* One iteration of section 5.4: a model of the points so far, its indicator at all training points, the worst of which
   is added. The decision to stop uses rank 0's clock, so that it is the same on every rank. */
static PetscErrorCode GreedyIterate(HycoReducer t, Loop *loop, PetscInt iteration, HycoTraining *report,
                                    PetscBool *last)
{
  HycoGreedyStep step = {0};
  PetscInt worst = -1;

  PetscFunctionBegin;
  /* The former model before the next one is built: only one is in memory. */
  PetscCall(HycoROMDestroy(&loop->model));
  PetscCall(BuildModel(t, loop, iteration, report));
  PetscCall(EvaluateModel(t, loop, iteration));
  PetscCall(GreedyChoose(t, loop, &worst, &step));
  step.iteration = iteration;
  PetscCall(HycoSamplesGet(loop->samples, &step.n_samples, NULL, NULL));
  step.n_modes = report->n_modes;
  step.rid_nodes = report->rid_nodes;
  step.rid_elements = report->rid_elements;
  step.seconds = HycoNow() - loop->begin;
  PetscCallMPI(MPI_Bcast(&step.seconds, 1, MPIU_REAL, 0, HycoComm(t))); /* the ranks' clocks differ, but the decision
                                                                           must be the same */
  step.stop = WhyStop(t, &step);
  *last = (PetscBool)(step.stop != NULL);
  if (t->greedy.monitor) HycoOnRoot(HycoComm(t), t->greedy.monitor(&step, t->greedy.ctx));
  if (*last) PetscFunctionReturn(PETSC_SUCCESS);
  loop->chosen[worst] = PETSC_TRUE;
  PetscCall(HycoSamplesAddPoint(loop->samples, step.worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loop needs settings that are accurate for any points; those of the model itself are searched at the end. For
   paths in 3D it begins with the cells at a plane of symmetry, like that search. Collective. */
static PetscErrorCode SetSettings(HycoReducer t)
{
  const PetscBool *pinned = t->pinned;

  PetscFunctionBegin;
  t->plane = NULL;
  /* Settings that the user has fixed are the user's. */
  if (!t->search || t->prototype->model->traits.settings != HYCO_SETTINGS_RID) PetscFunctionReturn(PETSC_SUCCESS);
  if (!pinned[HYCO_CHOICE_TOLERANCE])
    t->tol[HYCO_SEED_DISPLACEMENT] = t->tol[HYCO_SEED_STRESS] = t->tol[HYCO_SEED_FORCE] = t->tol[HYCO_SEED_INELASTIC] =
        DEFAULT_ENERGY;
  if (!pinned[HYCO_CHOICE_HYBRID] && !pinned[HYCO_CHOICE_LAYERS] && !t->whole_rid)
    PetscCall(HycoReducerFindPlane(t, &t->plane));
  /* On a plane of symmetry all displacements of A are full order, see HycoReducerFindPlane(). */
  if (t->plane)
    t->hybrid = HYCO_HYBRID_ALL;
  else if (!pinned[HYCO_CHOICE_LAYERS])
    t->layers = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the model from the chosen solutions, and judges it by held-out ones. The held-out points are drawn now,
   apart from the solutions that the loop has chosen. */
static PetscErrorCode GreedyConclude(HycoReducer t, Loop *loop, const char path[], HycoTraining *report)
{
  const PetscBool learn = (PetscBool)(t->search && t->n_validation && t->scene->n_parameters);

  PetscFunctionBegin;
  PetscCall(HycoReducerHoldOut(t, loop->store));
  /* The growing RID of the loop must not bind the search. */
  if (learn) { /* each attempt has its own RID and bases */
    PetscCall(PetscFree(t->grown));
    PetscCall(HycoReducerResetBases(t));
  }
  PetscCall(HycoReducerFinish(t, loop->store, path, learn, report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterates until the loop ends. The last model is destroyed here: the final one is built with other settings. */
static PetscErrorCode RunLoop(HycoReducer t, Loop *loop, HycoTraining *report)
{
  PetscBool last = PETSC_FALSE;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  for (PetscInt iteration = 0; !last && !ierr; iteration++) ierr = GreedyIterate(t, loop, iteration, report, &last);
  PetscCall(HycoROMDestroy(&loop->model));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the loop's store is open. `grown` has the cells of the RID so far, which only grows. */
static PetscErrorCode RunOn(HycoReducer t, Loop *loop, const char path[], HycoTraining *report)
{
  PetscFunctionBegin;
  PetscCall(SetSettings(t));
  PetscCall(PetscCalloc1(t->fom->part->n_cells, &t->grown));
  PetscCall(RunLoop(t, loop, report));
  PetscCall(GreedyConclude(t, loop, path, report));
  report->seconds_reduction = HycoNow() - loop->begin;
  PetscCall(HycoReducerReset(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The store is closed and the set destroyed after an error too. */
PetscErrorCode HycoReducerRunGreedy(HycoReducer t, HycoSamples start, HycoSamples training, const char path[],
                                    HycoTraining *training_report)
{
  Loop loop = {0};
  HycoTraining report = {0};

  PetscFunctionBegin;
  HycoCheckHandle(t, HYCO_REDUCER_CLASSID);
  PetscCall(CheckIndicator(t));
  HycoCheck(!t->prototype->model->traits.cells,
            "train -greedy adds cells to the previous RID, and a %s model chooses all of its cells anew; train it on a "
            "grid or on points",
            t->prototype->model->traits.title);
  loop.begin = HycoNow();
  /* Takes and checks the set to be searched. */
  PetscCall(HycoSamplesGet(training, &loop.n_points, &loop.n_par, &loop.points));
  HycoCheck(
      loop.n_points > 1,
      "the greedy training has %d candidate point, and at least two are needed; give -training_grid 20,24, for example",
      (int)loop.n_points);
  PetscCall(PetscMalloc1(4 * loop.n_points, &loop.value));
  PetscCall(PetscCalloc1(loop.n_points, &loop.chosen));
  PetscCall(GreedyStart(t, start, &loop.samples));
  PetscCall(CheckStart(t, (PetscBool)!start, loop.samples));
  PetscCall(HycoReducerOpen(t, loop.samples, path, &loop.store));
  HycoFinally(RunOn(t, &loop, path, &report), PetscCall(HycoReducerClose(t, &loop.store)); report.sliding = t->sliding;
              report.cpu_solution = t->cpu_solution; report.time_error = t->time_error; report.n_lost = t->n_lost;
              report.first_lost = t->first_lost; PetscCall(HycoSamplesDestroy(&loop.samples));
              HycoFreeAll(&loop.value, &loop.chosen));
  if (training_report) *training_report = report;
  PetscFunctionReturn(PETSC_SUCCESS);
}
