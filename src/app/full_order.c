/* hyco predict with the scene: -hyco_fallback, full order where the reduced model is not accurate enough;
   -hyco_full_displacement, one full-order solve with a model's forces. */
#include "driver.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One option for each kind of error; 0: no target. train and predict share the names, so that a model is judged
   and used by the same number. */
PetscErrorCode DriverReadTarget(HycoErrorKind kind, PetscReal *target)
{
  static const char *const texts[HYCO_N_ERRORS] = {
      [HYCO_ERROR_U] = "<real> error of the displacement: train chooses the cheapest model whose held-out errors are "
                       "no larger; predict -hyco_fallback solves full order where the estimate is larger",
      [HYCO_ERROR_U_RID] = "<real> train: the same for the displacement over the RID, max norm",
      [HYCO_ERROR_SIGMA] = "<real> train: the same for the stress over the RID",
      [HYCO_ERROR_SIGMA_11] = "<real> train: the same for its first component, max norm",
      [HYCO_ERROR_LAMBDA] = "<real> train, predict: the same for all contact forces",
      [HYCO_ERROR_LAMBDA_RID] = "<real> train: the same for the RID's own contact forces",
      [HYCO_ERROR_INELASTIC] = "<real> train, scenes with a history: the same for the inelastic strain over the RID"};
  char name[64], text[PETSC_MAX_PATH_LEN], *end;

  PetscFunctionBegin;
  *target = 0;
  snprintf(name, sizeof(name), "target_%s", HycoErrorKinds[kind]);
  PetscCall(DriverGet(name, texts[kind], text));
  if (!text[0]) PetscFunctionReturn(PETSC_SUCCESS);
  /* 1 is a hundred per cent: a larger relative error is surely meant as a percentage. */
  *target = strtod(text, &end);
  HycoCheck(end != text && !*end && *target > 0 && *target <= 1,
            "-%s is \"%s\"; it must be a relative error above 0 and at most 1 (1e-2 is one per cent)", name, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene is read only if full order may be solved: a model needs no scene otherwise. */
PetscErrorCode DriverReadFallback(HycoROM model, PetscBool extrapolate, Fallback *f)
{
  HycoROMType type;
  HycoScene own;
  PetscBool forces;
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(HycoROMGetFallback(model, &f->on, &f->displacement));
  PetscCall(HycoROMGetType(model, &type));
  PetscCall(HycoROMGivesForces(model, &forces));
  HycoCheck(!f->displacement || forces,
            "-hyco_full_displacement needs accurate forces of all contacts, which models of bodies without a history "
            "have, and "
            "this model is %s; use -hyco_fallback",
            type);
  PetscCall(DriverReadTarget(HYCO_ERROR_U, &f->target_u));
  PetscCall(DriverReadTarget(HYCO_ERROR_LAMBDA, &f->target_lambda));
  /* -scene of predict is only for full order, as the checks below say. */
  PetscCall(DriverReadFiles(path, NULL, NULL, NULL, NULL));
  HycoCheck(f->on || (!(f->target_u > 0) && !(f->target_lambda > 0)),
            "-target_u and -target_lambda set when hyco predict solves full order instead; give -hyco_fallback too");
  HycoCheck(f->on || f->displacement || !path[0],
            "hyco predict uses -scene only with -hyco_fallback, which solves full order on it%s; remove -scene, or add "
            "the option",
            forces ? ", or -hyco_full_displacement" : "");
  if (!f->on && !f->displacement) {
    PetscCall(DriverRefuseOnly("full order", "it is for full order, which predict solves only with -hyco_fallback or "
                                             "-hyco_full_displacement"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoCheck(path[0], "%s: give its -scene too",
            f->on ? "-hyco_fallback solves full order where the reduced model is not accurate enough"
                  : "-hyco_full_displacement solves full order with the predicted forces");
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &f->scene));
  /* A path's failure cannot be mended by one solve at its end. */
  PetscCall(HycoSceneRefuseHistory(f->scene, "-hyco_fallback"));
  PetscCall(DriverCheckMesh(f->scene));
  PetscCall(HycoROMCheckScene(model, f->scene));
  PetscCall(HycoROMGetScene(model, &own));
  PetscCall(HycoSceneGetQuantities(own, &f->n_outputs, NULL));
  HycoSceneMatchQuantities(own, f->scene, f->output);
  /* As the model's: both accept the same parameters. */
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

/* The first reason that applies, the strongest first; estimates only against targets that are given. */
void DriverWantsFullOrder(const Fallback *f, const HycoPrediction *p, char why[DRIVER_LINE])
{
  why[0] = '\0';
  if (!f->on) return;
  if (p->reason <= 0)
    snprintf(why, DRIVER_LINE, "the reduced solve did not converge");
  else if (p->inconsistent)
    snprintf(why, DRIVER_LINE, "the displacements do not follow the contact forces (%.2g of their size)",
             (double)p->inconsistency);
  else if (p->unbalanced)
    snprintf(why, DRIVER_LINE, "contact forces, loads and supports do not balance (they miss %.2g)",
             (double)p->balance);
  else if (p->unseen > HYCO_UNSEEN)
    snprintf(why, DRIVER_LINE, "the %s is %.2g times that at any held-out point", HycoFeatureNames[p->unseen_feature],
             (double)p->unseen);
  /* What precedes needs no target: such predictions are wrong by any measure. */
  else if (!(f->target_u > 0) && !(f->target_lambda > 0))
    return;
  /* Negative: no estimate. A target cannot be promised without one. */
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

/* Takes the displacement's part of the summary, over the whole mesh. */
static PetscErrorCode TakeDisplacement(Fallback *f, const HycoSummary *s, HycoPrediction *p)
{
  const HycoReaction *reaction;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetReactions(f->fom, &n, &reaction, &p->balance));
  p->reason = s->reason;
  p->kkt = s->kkt;
  p->u_norm2 = s->u_norm2;
  p->n_facing = s->n_facing;
  p->overlap = s->overlap;
  p->sliding = s->sliding;
  f->strain_energy = s->strain_energy;
  /* Outputs that the full-order scene lacks are not known any more. */
  for (PetscInt k = 0; k < f->n_outputs; k++) p->quantity[k] = f->output[k] < 0 ? NAN : s->quantity[f->output[k]];
  for (PetscInt c = 0; c < 3; c++) {
    p->u_min[c] = s->u_min[c];
    p->u_max[c] = s->u_max[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 has the forces. The forces' own estimate stays, those of displacements do not apply any more. */
PetscErrorCode DriverSolveDisplacement(Fallback *f, HycoROM model, PetscInt n, const PetscReal mu[], HycoPrediction *p)
{
  const PetscReal *Lambda = NULL;
  const HycoReason reason = p->reason;
  HycoSummary s;

  PetscFunctionBegin;
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetLambda(model, NULL, &Lambda, NULL, NULL));
  /* Created at the first need: most predictions never need it. */
  if (!f->fom) PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, f->scene, &f->fom));
  PetscCall(HycoFOMSolveForces(f->fom, n, mu, Lambda));
  PetscCall(HycoFOMGetSummary(f->fom, &s));
  PetscCall(TakeDisplacement(f, &s, p));
  p->estimated_error_u = -1;                                                              /* that of the modes */
  for (PetscInt k = 0; k < HYCO_MAX_QUANTITIES; k++) p->estimated_error_quantity[k] = -1; /* of other displacements */
  if (s.reason > 0) p->reason = reason; /* the reason of the forces' solve */
  p->seconds.setup += s.seconds.setup;
  p->seconds.assemble += s.seconds.assemble;
  p->seconds.factor += s.seconds.factor;
  p->seconds.solve += s.seconds.solve;
  p->seconds.total += s.seconds.total;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills the prediction's fields from full order, so that reports and tables have one form. */
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
  PetscCall(TakeDisplacement(f, &s, p));
  p->iterations = s.iterations;
  p->n_active = p->n_rid_active = s.n_active;
  p->n_dof = p->n_fe_dofs = s.n_dof;
  p->n_multipliers = p->n_contacts = p->n_all_contacts = s.n_contacts;
  /* All of the reduced model's numbers are replaced: none of them describes this solution. */
  p->n_modes = 0;
  p->total_contact_force = s.total_contact_force;
  p->lambda_max = s.lambda_max;
  p->lambda_norm2 = s.lambda_norm2;
  /* Every contact is part of the system. */
  p->covered_force = 1;
  p->seconds = s.seconds;
  PetscFunctionReturn(PETSC_SUCCESS);
}
