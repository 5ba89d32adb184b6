/* hyco check: memory and time of a solve and a training. */
#include "check.h"
#include <stdio.h>

/* At the centre of the ranges, where contact is most probably as the user means it. */
PetscErrorCode CheckReportSolve(Check *check, HycoFOM fom)
{
  const PetscReal *lo, *hi;
  PetscReal *mu;
  PetscInt n;
  HycoSummary s;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(check->scene, &n, NULL, &lo, &hi));
  PetscCall(PetscMalloc1(n + 1, &mu));
  for (PetscInt p = 0; p < n; p++) mu[p] = (lo[p] + hi[p]) / 2;
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(PetscFree(mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  /* An error, not a warning: a scene that fails at its centre cannot be trained. */
  HycoCheck(s.reason > 0, "the solve at the centre of the ranges: %s", s.why);
  /* Measured times replace the estimates by operation counts in what follows. */
  check->in.first = s.seconds.total;
  check->in.next = s.seconds.solve;
  PetscCall(DriverPrint("solved at the centre: %d of %d contacts closed, total contact force %.10g\n", (int)s.n_active,
                        (int)s.n_contacts, (double)s.total_contact_force));
  ReportNumbers(check->json, {"n_active", s.n_active}, {"total_contact_force", s.total_contact_force});
  if (s.u_relative > 1 && check->warnings)
    CheckReportWarning(
        check,
        "the displacements at the centre of the ranges are %.1e times the extent of the mesh; are the units right?",
        (double)s.u_relative);
  if (s.n_contacts && !s.n_active && check->warnings)
    CheckReportWarning(check, "no contact closes at the centre of the ranges");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two digits: estimates are no better. */
static void CostSeconds(PetscReal t, char text[32])
{
  if (t < 60)
    snprintf(text, 32, "%.2g s", (double)t);
  else if (t < 7200)
    snprintf(text, 32, "%.2g minutes", (double)t / 60);
  else
    snprintf(text, 32, "%.2g hours", (double)t / 3600);
}

/* 8 bytes for each number of a solution, stored as it is. */
static PetscErrorCode PrintTraining(Check *check, HycoSamples samples, cJSON *object)
{
  const HycoInspection *in = &check->in;
  PetscInt n, n_stiff, n_times;
  PetscReal training, snapshots;
  char all[32];

  PetscFunctionBegin;
  PetscCall(HycoInspectionCountTraining(check->scene, samples, &n, &n_stiff));
  PetscCall(HycoSceneGetHistory(check->scene, &n_times, NULL));
  /* A new stiffness needs a factor; the others share one. A path shares nothing with another. */
  if (n_times) n_stiff = n;
  training = n_stiff * in->first + (n - n_stiff) * in->next;
  snapshots = 8 * in->n_values * n;
  CostSeconds(training, all);
  PetscCall(DriverPrint(
      "a training on %s%d solutions, including held-out ones: about %s of full-order solves, and %.3g MB of "
      "solutions; the reduction is not included\n",
      samples ? "" : "for example ", (int)n, all, 1e-6 * (double)snapshots));
  ReportNumbers(object, {"n_training", n}, {"n_stiffness", n_stiff}, {"seconds_training", training},
                {"snapshots_mb", 1e-6 * snapshots});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What train tries first: without the training solutions. */
static PetscErrorCode PrintBodies(Check *check, cJSON *object)
{
  const HycoInspection *in = &check->in;
  char least[32], most[32];

  PetscFunctionBegin;
  CostSeconds(in->body_training[0], least);
  CostSeconds(in->body_training[1], most);
  PetscCall(
      DriverPrint("a model of bodies, which train tries first, without the training solutions: %s to %s with held-out "
                  "solutions and reduction, and %.2g ms a prediction\n",
                  least, most, 1e3 * (double)in->body_prediction));
  ReportNumbers(object, {"seconds_bodies", in->body_training[0]}, {"seconds_bodies_most", in->body_training[1]},
                {"seconds_prediction", in->body_prediction});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An estimate of a path would need the number of its steps and of their iterations. */
static PetscErrorCode PrintPaths(Check *check, HycoSamples samples)
{
  PetscInt n, n_stiff;

  PetscFunctionBegin;
  PetscCall(HycoInspectionCountTraining(check->scene, samples, &n, &n_stiff));
  PetscCall(DriverPrint("a training on %s%d paths, including held-out ones: -check_solve measures the time of one\n",
                        samples ? "" : "for example ", (int)n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Estimates in order of magnitude, from the size of the factor; with -check_solve one solve was timed. */
PetscErrorCode CheckReportCost(Check *check, HycoSamples samples, PetscBool solved)
{
  const HycoInspection *in = &check->in;
  PetscInt n_times;
  char first[32], next[32];
  cJSON *object = cJSON_AddObjectToObject(check->json, "estimate");

  PetscFunctionBegin;
  PetscCall(HycoSceneGetHistory(check->scene, &n_times, NULL));
  CostSeconds(in->first, first);
  CostSeconds(in->next, next);
  /* A measured history is a whole path; unmeasured, one linear solve is all that can be estimated. */
  if (n_times && solved)
    PetscCall(DriverPrint("a full-order solve of the history, as measured: %s", first));
  else
    PetscCall(DriverPrint("%s, %s: %s, or %s if the stiffness is unchanged",
                          n_times ? "an iteration of a step of the history" : "a full-order solve",
                          solved ? "as measured" : "about", first, next));
  PetscCall(DriverPrint("; %.3g MB, of which %.3g MB for the factor\n", 1e-6 * (double)(in->resident + in->bytes),
                        1e-6 * (double)in->bytes));
  cJSON_AddBoolToObject(object, "measured", solved);
  ReportNumbers(object, {"factor_mb", 1e-6 * in->bytes}, {"solve_mb", 1e-6 * (in->resident + in->bytes)},
                {"seconds_first", in->first}, {"seconds_next", in->next});
  /* Without a measured path the number of its steps is not known, hence no time of a training. */
  if (!n_times || solved)
    PetscCall(PrintTraining(check, samples, object));
  else
    PetscCall(PrintPaths(check, samples));
  if (in->body_values) PetscCall(PrintBodies(check, object));
  if (in->no_bodies[0]) PetscCall(DriverPrint("no model of bodies: %s\n", in->no_bodies));
  if (in->no_bodies[0]) cJSON_AddStringToObject(object, "bodies_refused", in->no_bodies);
  PetscFunctionReturn(PETSC_SUCCESS);
}
