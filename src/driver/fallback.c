/* hyco predict -hyco_fallback: full order where the reduced model cannot be trusted as far as is asked. */
#include "driver.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

PetscErrorCode DriverReadTarget(const char name[], PetscReal *target)
{
  char text[PETSC_MAX_PATH_LEN], *end;

  PetscFunctionBegin;
  *target = 0;
  PetscCall(DriverGet(name, PETSC_FALSE, text));
  if (!text[0]) PetscFunctionReturn(PETSC_SUCCESS);
  *target = strtod(text, &end);
  HycoCheck(end != text && !*end && *target > 0 && *target <= 1,
            "-%s is \"%s\"; it must be a relative error above 0 and at most 1: 1e-2 is one percent", name, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReadFallback(HycoModel model, PetscBool extrapolate, Fallback *f)
{
  HycoScene scene;
  PetscOptions options;
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoModelGetScene(model, &scene));
  PetscCall(HycoSceneGetOptions(scene, &options));
  PetscCall(HycoOptionsBool(options, "hyco_fallback", &f->on));
  PetscCall(DriverReadTarget("target_u", &f->target_u));
  PetscCall(DriverReadTarget("target_lambda", &f->target_lambda));
  PetscCall(DriverGet("scene", PETSC_FALSE, path));
  HycoCheck(f->on || (!(f->target_u > 0) && !(f->target_lambda > 0)),
            "-target_u and -target_lambda say when hyco predict solves full order instead: give -hyco_fallback too");
  HycoCheck(f->on || !path[0], "hyco predict needs no -scene but with -hyco_fallback, which solves full order on it");
  if (!f->on) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(path[0], "-hyco_fallback solves full order where the reduced model is not enough: give its -scene too");
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &f->scene));
  PetscCall(HycoModelCheckScene(model, f->scene));
  PetscCall(HycoSceneSetExtrapolate(f->scene, extrapolate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverEndFallback(Fallback *f)
{
  PetscFunctionBegin;
  PetscCall(HycoFOMDestroy(&f->fom));
  PetscCall(HycoSceneDestroy(&f->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverWantsFullOrder(const Fallback *f, const HycoPrediction *p, char why[DRIVER_LINE])
{
  why[0] = '\0';
  if (!f->on) return;
  if (p->reason <= 0)
    snprintf(why, DRIVER_LINE, "the reduced solve did not converge");
  else if (!(f->target_u > 0) && !(f->target_lambda > 0))
    return;
  else if ((f->target_u > 0 && p->estimated_error_u < 0) || (f->target_lambda > 0 && p->estimated_error_lambda < 0))
    snprintf(why, DRIVER_LINE, "the model does not estimate its error of %s",
             f->target_u > 0 && p->estimated_error_u < 0 ? "u" : "the contact forces");
  else if (f->target_u > 0 && p->estimated_error_u > f->target_u)
    snprintf(why, DRIVER_LINE, "the estimated error of u is %.2g, above %g", (double)p->estimated_error_u,
             (double)f->target_u);
  else if (f->target_lambda > 0 && p->estimated_error_lambda > f->target_lambda)
    snprintf(why, DRIVER_LINE, "the estimated error of the contact forces is %.2g, above %g",
             (double)p->estimated_error_lambda, (double)f->target_lambda);
}

PetscErrorCode DriverSolveFullOrder(Fallback *f, PetscInt n, const PetscReal mu[], HycoPrediction *p)
{
  HycoSummary s;
  HycoSolver solver;
  const char *method;

  PetscFunctionBegin;
  if (!f->fom) PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, f->scene, &f->fom));
  PetscCall(HycoFOMSolve(f->fom, n, mu));
  PetscCall(HycoFOMGetSummary(f->fom, &s));
  PetscCall(HycoFOMGetSolver(f->fom, &solver));
  PetscCall(HycoSolverGetMethod(solver, &method));
  PetscCall(PetscStrncpy(p->method, method, sizeof(p->method)));
  p->reason = s.reason;
  p->kkt = s.kkt;
  p->iterations = s.iterations;
  p->n_active = p->n_rid_active = s.n_active;
  p->n_dof = p->n_fe_dofs = s.n_dof;
  p->n_multipliers = p->n_contacts = p->n_all_contacts = s.n_contacts;
  p->n_modes = 0;
  p->total_contact_force = s.total_contact_force;
  p->lambda_max = s.lambda_max;
  p->lambda_norm2 = s.lambda_norm2;
  p->u_norm2 = s.u_norm2;
  f->strain_energy = s.strain_energy;
  p->covered_force = 1;
  for (PetscInt c = 0; c < 3; c++) {
    p->u_min[c] = s.u_min[c];
    p->u_max[c] = s.u_max[c];
  }
  p->seconds = s.seconds;
  PetscFunctionReturn(PETSC_SUCCESS);
}
