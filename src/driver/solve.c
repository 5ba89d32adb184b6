/* hyco solve: one parameter value, full order. */
#include "driver.h"

static PetscErrorCode Report(HycoScene scene, const PetscReal mu[], HycoFOM fom, const HycoSummary *s)
{
  cJSON *json;
  HycoSolver solver;
  const char *method;

  PetscFunctionBegin;
  PetscCall(ReportCreate("solve", scene, mu, &json));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  PetscCall(HycoSolverGetMethod(solver, &method));
  cJSON_AddNumberToObject(json, "n_dof", s->n_dof);
  cJSON_AddNumberToObject(json, "n_contacts", s->n_contacts);
  cJSON_AddNumberToObject(json, "n_active", s->n_active);
  cJSON_AddNumberToObject(json, "active_set_iterations", s->iterations);
  cJSON_AddStringToObject(json, "solver", method);
  cJSON_AddBoolToObject(json, "converged", s->reason > 0);
  cJSON_AddNumberToObject(json, "total_contact_force", s->total_contact_force);
  cJSON_AddNumberToObject(json, "lambda_max", s->lambda_max);
  cJSON_AddNumberToObject(json, "lambda_norm2", s->lambda_norm2);
  cJSON_AddNumberToObject(json, "u_norm2", s->u_norm2);
  ReportVector(json, "u_min", s->dim, s->u_min);
  ReportVector(json, "u_max", s->dim, s->u_max);
  cJSON_AddNumberToObject(json, "strain_energy", s->strain_energy);
  cJSON_AddNumberToObject(json, "external_work", s->external_work);
  cJSON_AddNumberToObject(json, "gap_work", s->gap_work);
  cJSON_AddNumberToObject(json, "energy_defect", s->energy_defect);
  ReportKKT(json, &s->kkt);
  ReportSeconds(json, &s->seconds);
  PetscCall(Say("%d unknowns, %d contacts, %d active after %d iterations (%s)\n", (int)s->n_dof, (int)s->n_contacts,
                (int)s->n_active, (int)s->iterations, method));
  PetscCall(Say("total contact force %.10g, largest %.6g; strain energy %.10g, identity to %.1e\n",
                (double)s->total_contact_force, (double)s->lambda_max, (double)s->strain_energy,
                (double)s->energy_defect));
  PetscCall(Say("KKT residuals: stationarity %.1e, penetration %.1e, adhesion %.1e, complementarity %.1e\n",
                (double)s->kkt.stationarity, (double)s->kkt.penetration, (double)s->kkt.adhesion,
                (double)s->kkt.complementarity));
  PetscCall(Say("seconds: %.3f assemble, %.3f factor, %.3f solve\n", (double)s->seconds.assemble,
                (double)s->seconds.factor, (double)s->seconds.solve));
  PetscCall(ReportWrite(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CommandSolve(void)
{
  HycoScene scene;
  HycoFOM fom;
  HycoSolver solver;
  HycoSummary summary;
  PetscInt n;
  PetscReal mu[64];
  PetscBool monitor;
  char path[PETSC_MAX_PATH_LEN], output[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverGet("scene", PETSC_TRUE, path));
  PetscCall(DriverGet("output", PETSC_FALSE, output));
  PetscCall(DriverGet("report", PETSC_FALSE, report));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-hyco_monitor", &monitor));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(HycoSceneGetParameters(scene, &n, NULL, NULL, NULL));
  PetscCall(DriverGetPoint(scene, mu));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMGetSolver(fom, &solver));
  if (monitor) PetscCall(HycoSolverSetMonitor(solver, DriverMonitor, NULL));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &summary));
  PetscCall(DriverCheckLeft());
  HycoCheck(summary.reason > 0, "%s (KKT residuals: %.1e, %.1e, %.1e, %.1e); nothing was written",
            HycoReasonName(summary.reason), (double)summary.kkt.stationarity, (double)summary.kkt.penetration,
            (double)summary.kkt.adhesion, (double)summary.kkt.complementarity);
  if (output[0]) PetscCall(HycoFOMWrite(fom, output));
  PetscCall(Report(scene, mu, fom, &summary));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
