/* hyco check: memory and time of a solve and a training. */
#include "check.h"
#include <hycolinear.h>
#include <stdio.h>
#include <sys/resource.h>

/* Assumed number of solutions if no training points are given. */
#define TYPICAL_TRAINING 100
/* Speed of a sparse factorisation as a share of a matrix product's. */
#define SPARSE_SHARE 0.5

/* Memory of the process now, summed over all ranks. */
static PetscErrorCode Resident(PetscReal *bytes)
{
  struct rusage usage;
  PetscReal mine;

  PetscFunctionBegin;
  getrusage(RUSAGE_SELF, &usage);
  mine = 1024 * (PetscReal)usage.ru_maxrss;
  PetscCallMPI(MPI_Allreduce(&mine, bytes, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating-point operations per second of a small matrix product on this process. */
static PetscErrorCode Speed(PetscReal *flops)
{
  const PetscBLASInt n = 256;
  const PetscScalar one = 1, zero = 0;
  PetscScalar *a;
  PetscReal begin;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * n * n, &a));
  for (PetscInt k = 0; k < 3 * n * n; k++) a[k] = 1;
  *flops = 0;
  for (PetscInt k = 0; k < 10; k++) { /* the fastest, because others may use the machine */
    begin = HycoNow();
    BLASgemm_("N", "N", &n, &n, &n, &one, a, &n, a + n * n, &n, &zero, a + 2 * n * n, &n);
    *flops = PetscMax(*flops, 2. * n * n * n / PetscMax(HycoNow() - begin, 1e-9));
  }
  PetscCall(PetscFree(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportEstimate(Check *check, PetscReal assembly, Cost *cost)
{
  HycoFOM f = check->fom;
  HycoDirect probe;
  PetscReal begin = HycoNow(), speed = 1;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(Resident(&cost->resident));
  PetscCall(HycoDirectCreate(HycoComm(f), &probe));
  PetscCall(HycoDirectPinKernel(probe, f->K));
  PetscCall(HycoDirectAnalyse(probe, f->K, f->n_contacts ? f->Bt : NULL, f->n_contacts ? f->B : NULL, PETSC_TRUE,
                              &cost->bytes));
  PetscCall(Speed(&speed));
  PetscCall(MatGetInfo(f->K, MAT_GLOBAL_SUM, &info));
  cost->first = assembly + HycoNow() - begin + HycoDirectOperations(probe) / (SPARSE_SHARE * speed * f->size);
  cost->next = 20 * cost->bytes / 8 / (SPARSE_SHARE * speed * f->size); /* a few products with the factor */
  PetscCall(HycoDirectDestroy(&probe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportSolve(Check *check, const PetscReal mu[], Cost *cost)
{
  HycoSummary s;

  PetscFunctionBegin;
  PetscCall(HycoFOMSolve(check->fom, check->fom->scene->n_parameters, mu));
  PetscCall(HycoFOMGetSummary(check->fom, &s));
  HycoCheck(s.reason > 0, "the solve at the centre of the ranges: %s", s.why);
  cost->solved = PETSC_TRUE;
  cost->first = s.seconds.total;
  cost->next = s.seconds.solve;
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

PetscErrorCode CheckReportCountTraining(HycoScene s, HycoSamples samples, PetscBool given, Cost *cost)
{
  PetscBool reaches[HYCO_MAX_PARAMETERS], any = PETSC_FALSE;
  PetscInt n = TYPICAL_TRAINING, held;
  const PetscReal *mu = NULL;

  PetscFunctionBegin;
  HycoSceneReaches(s, reaches);
  for (PetscInt p = 0; p < s->n_parameters; p++) any = (PetscBool)(any || reaches[p]);
  if (given) PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  held = PetscMin(PetscMax(n, 20), 30);
  cost->n_training = n + held;
  cost->n_stiff = any ? n : 1;
  for (PetscInt k = 1; mu && any && k < n; k++) { /* previous ones */
    PetscBool seen = PETSC_FALSE;

    for (PetscInt j = 0; j < k && !seen; j++) {
      seen = PETSC_TRUE;
      for (PetscInt p = 0; p < s->n_parameters; p++)
        seen = (PetscBool)(seen && (!reaches[p] || mu[j * s->n_parameters + p] == mu[k * s->n_parameters + p]));
    }
    cost->n_stiff -= seen;
  }
  if (any) cost->n_stiff += held; /* held-out points may share stiffnesses, which is neglected here */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Seconds(PetscReal t, char text[32])
{
  if (t < 60)
    snprintf(text, 32, "%.2g s", (double)t);
  else if (t < 7200)
    snprintf(text, 32, "%.2g minutes", (double)t / 60);
  else
    snprintf(text, 32, "%.2g hours", (double)t / 3600);
}

static PetscErrorCode PrintTraining(Check *check, const Cost *cost, PetscBool given, cJSON *object)
{
  HycoFOM f = check->fom;
  const PetscReal values =
      2. * (PetscReal)f->n_nodes * f->fe->dim + (PetscReal)f->n_cells * f->fe->n_sigma + f->n_contacts;
  const PetscReal training = cost->n_stiff * cost->first + (cost->n_training - cost->n_stiff) * cost->next;
  const PetscReal snapshots = 8 * values * cost->n_training;
  char all[32];

  PetscFunctionBegin;
  Seconds(training, all);
  PetscCall(DriverPrint(
      "a training on %s%d solutions, including held-out ones: about %s of full-order solves, and %.3g MB of "
      "solutions; the reduction is not included\n",
      given ? "" : "for example ", (int)cost->n_training, all, 1e-6 * (double)snapshots));
  ReportNumbers(object, {"n_training", cost->n_training}, {"n_stiffness", cost->n_stiff},
                {"seconds_training", training}, {"snapshots_mb", 1e-6 * snapshots});
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportCost(Check *check, const Cost *cost, PetscBool given)
{
  const PetscInt n_times = check->fom->scene->n_times;
  char first[32], next[32];
  cJSON *object = cJSON_AddObjectToObject(check->json, "estimate");

  PetscFunctionBegin;
  Seconds(cost->first, first);
  Seconds(cost->next, next);
  if (n_times && cost->solved)
    PetscCall(DriverPrint("a full-order solve of the history, as measured: %s", first));
  else
    PetscCall(DriverPrint("%s, %s: %s, or %s if the stiffness is unchanged",
                          n_times ? "an iteration of a step of the history" : "a full-order solve",
                          cost->solved ? "as measured" : "about", first, next));
  PetscCall(DriverPrint("; %.3g MB, of which %.3g MB for the factor\n", 1e-6 * (double)(cost->resident + cost->bytes),
                        1e-6 * (double)cost->bytes));
  cJSON_AddBoolToObject(object, "measured", cost->solved);
  ReportNumbers(object, {"factor_mb", 1e-6 * cost->bytes}, {"solve_mb", 1e-6 * (cost->resident + cost->bytes)},
                {"seconds_first", cost->first}, {"seconds_next", cost->next});
  if (!n_times || cost->solved)
    PetscCall(PrintTraining(check, cost, given, object));
  else
    PetscCall(DriverPrint("a training on %s%d paths, including held-out ones: -check_solve measures the time of one\n",
                          given ? "" : "for example ", (int)cost->n_training));
  PetscFunctionReturn(PETSC_SUCCESS);
}
