/* hyco train -greedy: the loop's options, its output and its table. */
#include "driver.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Appends formatted text to the table. */
static PetscErrorCode GreedyReportAppend(GreedyLog *log, const char text[])
{
  const size_t length = strlen(text);

  PetscFunctionBegin;
  if (log->length + length + 1 > log->room) {
    /* Doubled, so that a long training appends in linear time. */
    log->room = 2 * (log->room + length) + 4096;
    PetscCall(PetscRealloc(log->room, &log->text));
  }
  PetscCall(PetscArraycpy(log->text + log->length, text, length + 1));
  log->length += length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* columns NULL: only the words. mu NULL: empty columns, for a step without a next point. */
PetscErrorCode DriverFormatPoint(HycoScene scene, const PetscReal mu[], char words[DRIVER_LINE],
                                 char columns[DRIVER_LINE])
{
  PetscInt n;
  const char *const *names;
  size_t w = 0, c = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, NULL, NULL));
  words[0] = '\0';
  if (columns) columns[0] = '\0';
  for (PetscInt p = 0; p < n && w < DRIVER_LINE && c < DRIVER_LINE; p++) {
    if (mu) {
      /* May count beyond the room, which ends the loop: the text is then cut. */
      w += (size_t)snprintf(words + w, DRIVER_LINE - w, "%s%s = %.6g", p ? ", " : "", names[p], (double)mu[p]);
      if (columns) c += (size_t)snprintf(columns + c, DRIVER_LINE - c, "%.12g", (double)mu[p]);
    }
    if (columns && c < DRIVER_LINE) c += (size_t)snprintf(columns + c, DRIVER_LINE - c, ",");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order of the columns is part of the format; parameters stand in the middle, since their number depends on
   the scene. */
static PetscErrorCode BeginTable(GreedyLog *log)
{
  PetscInt n;
  const char *const *names;

  PetscFunctionBegin;
  PetscCall(GreedyReportAppend(log, "iteration,snapshots,modes,rid_nodes,rid_elements,"));
  PetscCall(HycoSceneGetParameters(log->scene, &n, &names, NULL, NULL));
  for (PetscInt p = 0; p < n; p++) {
    PetscCall(GreedyReportAppend(log, names[p]));
    PetscCall(GreedyReportAppend(log, ","));
  }
  PetscCall(GreedyReportAppend(log, "eta,eta_u,eta_lambda,max_eta,mean_eta_u,mean_eta_lambda,infinite,seconds\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoGreedyMonitor: prints a line, and writes the table again with its row. */
static PetscErrorCode GreedyReportMonitor(const HycoGreedyStep *s, void *ctx)
{
  GreedyLog *log = (GreedyLog *)ctx;
  char words[DRIVER_LINE], columns[DRIVER_LINE], row[3 * DRIVER_LINE];

  PetscFunctionBegin;
  PetscCall(DriverFormatPoint(log->scene, s->worst, words, columns));
  PetscCall(DriverPrint(
      "greedy %3d: %d snapshots, %d modes, RID %d nodes; eta %.2e (u %.2e, forces %.2e) at %s; largest %.2e, "
      "infinite at %d of %d\n",
      (int)s->iteration, (int)s->n_samples, (int)s->n_modes, (int)s->rid_nodes, (double)s->eta, (double)s->eta_u,
      (double)s->eta_lambda, s->worst ? words : "no remaining point", (double)s->max_eta, (int)s->n_infinite,
      (int)s->n_points));
  snprintf(row, sizeof(row), "%d,%d,%d,%d,%d,%s%.8g,%.8g,%.8g,%.8g,%.8g,%.8g,%d,%.3f\n", (int)s->iteration,
           (int)s->n_samples, (int)s->n_modes, (int)s->rid_nodes, (int)s->rid_elements, columns, (double)s->eta,
           (double)s->eta_u, (double)s->eta_lambda, (double)s->max_eta, (double)s->mean_eta_u,
           (double)s->mean_eta_lambda, (int)s->n_infinite, (double)s->seconds);
  /* The head with the first row, when the scene's parameters are certainly known. */
  if (!log->length) PetscCall(BeginTable(log));
  PetscCall(GreedyReportAppend(log, row));
  if (log->table[0]) PetscCall(DriverWriteText(log->table, log->text));
  log->iterations = s->iteration;
  log->max_eta = s->max_eta;
  log->infinite = s->n_infinite;
  if (s->stop) PetscCall(PetscStrncpy(log->stop, s->stop, sizeof(log->stop)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scene NULL: only declares the options. */
PetscErrorCode DriverReadGreedy(HycoScene scene, HycoReducer reducer, HycoSamples *training, GreedyLog *log)
{
  PetscReal target = 1e-3, max_seconds = 0;
  PetscInt max_snapshots = 0;

  PetscFunctionBegin;
  log->scene = scene;
  PetscCall(DriverGetTrainingGrid(scene, training));
  PetscCall(DriverReadFiles(NULL, NULL, NULL, NULL, log->table));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsReal("-target", "greedy: stop when the indicator is no larger at any point of that grid", 0,
                            PETSC_MAX_REAL, &target, NULL));
  PetscCall(HycoOptionsInt("-max_snapshots", "greedy: stop at this number of solutions (0: no limit)", 0, PETSC_MAX_INT,
                           &max_snapshots, NULL));
  PetscCall(HycoOptionsReal("-max_seconds",
                            "greedy: stop after the iteration in which this time has passed (0: no limit)", 0,
                            PETSC_MAX_REAL, &max_seconds, NULL));
  PetscOptionsEnd();
  if (!scene) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(target > 0, "-target is 0; the target of the greedy indicator must be positive, for example 1e-3");
  log->target = target;
  PetscCall(HycoReducerSetGreedyStop(reducer, target, max_snapshots, max_seconds));
  PetscCall(HycoReducerSetGreedyMonitor(reducer, GreedyReportMonitor, log));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A miss only if -target was given, or if there are no points left to add. */
PetscErrorCode DriverJudgeGreedy(const GreedyLog *log)
{
  PetscBool asked;
  struct {
    PetscReal max_eta;
    PetscInt infinite;
    char stop[16];
  } end; /* known only on rank 0 */
  const char *why = "every point of -training_grid is solved: give a finer grid, or settings with more modes or layers";

  PetscFunctionBegin;
  end.max_eta = log->max_eta;
  end.infinite = log->infinite;
  PetscCall(PetscStrncpy(end.stop, log->stop, sizeof(end.stop)));
  /* The monitor runs on rank 0 only, and a miss must be raised on all. */
  PetscCallMPI(MPI_Bcast(&end, sizeof(end), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-target", &asked));
  if (strcmp(end.stop, "target") == 0 || (!asked && strcmp(end.stop, "points"))) PetscFunctionReturn(PETSC_SUCCESS);
  if (strcmp(end.stop, "snapshots") == 0)
    why = "-max_snapshots is reached: raise it, or give settings with more modes or layers";
  if (strcmp(end.stop, "seconds") == 0)
    why = "-max_seconds have passed: the same command with a larger value continues from here";
  PetscCall(DriverMissed("the largest indicator of the greedy training is %.2e (infinite at %d points), and -target is "
                         "%g; it stopped because %s",
                         (double)end.max_eta, (int)end.infinite, (double)log->target, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* max_eta is infinite where only the model has a contact force, or where a solve failed; `infinite` counts such
   points. */
void DriverReportGreedy(cJSON *json, const GreedyLog *log)
{
  cJSON *greedy = cJSON_AddObjectToObject(json, "greedy");

  cJSON_AddNumberToObject(greedy, "iterations", log->iterations);
  cJSON_AddStringToObject(greedy, "stop", log->stop);
  if (PetscIsInfReal(log->max_eta)) /* JSON cannot represent it */
    cJSON_AddNullToObject(greedy, "max_eta");
  else
    cJSON_AddNumberToObject(greedy, "max_eta", log->max_eta);
  cJSON_AddNumberToObject(greedy, "infinite", log->infinite);
}
