/* HycoSolver: chooses the form, runs the method, judges it by the recomputed residuals, falls back when it failed. */
#include <hycosolverimpl.h>

const char *const HycoSolverTypes[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE, NULL};

/* Lemke's dictionary has m^2 entries, and each of its some m pivots changes them all: beyond this it is no fallback. */
#define HYCO_LEMKE_MAX 3000

static const char *const forms[] = {"auto", "dual", "primal", "dual_free", NULL}; /* of HycoForm */

PetscErrorCode HycoSolverCreate(MPI_Comm comm, HycoSolver *solver)
{
  PetscFunctionBegin;
  PetscCall(HycoInitializePackage());
  PetscCall(PetscHeaderCreate(*solver, HYCO_SOLVER_CLASSID, "HycoSolver", "Solver of contact systems", "Hyco", comm,
                              HycoSolverDestroy, HycoSolverView));
  (*solver)->rtol = 1e-8;
  (*solver)->warm = PETSC_TRUE;
  (*solver)->fallback = PETSC_TRUE;
  (*solver)->tao_type = HYCO_TAO_AUTO;
  (*solver)->multilevel = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverDestroy(HycoSolver *solver)
{
  HycoSolver s;

  PetscFunctionBegin;
  if (!solver || !*solver) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*solver, HYCO_SOLVER_CLASSID);
  HycoDereference(solver);
  s = *solver;
  PetscCall(HycoSystemDestroy(&s->system));
  PetscCall(HycoDirectDestroy(&s->direct));
  PetscCall(KSPDestroy(&s->ksp_gap));
  PetscCall(HycoDirectDestroy(&s->direct_free));
  PetscCall(MatDestroy(&s->T));
  PetscCall(MatDestroy(&s->Kg));
  PetscCall(MatDestroy(&s->Kw));
  PetscCall(PetscFree(s->lu));
  PetscCall(PetscFree(s->X));
  PetscCall(PetscFree(s->ipiv));
  PetscCall(PetscFree(s->S));
  PetscCall(PetscFree(s->g));
  PetscCall(PetscFree(s->L));
  PetscCall(PetscFree(s->active));
  PetscCall(PetscFree(s->pivot));
  PetscCall(PetscFree(s->contact));
  PetscCall(PetscHeaderDestroy(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetSystem(HycoSolver s, HycoSystem system)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheckHandle(system, HYCO_SYSTEM_CLASSID);
  PetscCall(PetscObjectReference((PetscObject)system));
  PetscCall(HycoSystemDestroy(&s->system));
  s->system = system;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetType(HycoSolver s, HycoSolverType type)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  for (PetscInt k = 0; HycoSolverTypes[k]; k++) {
    PetscBool same;

    PetscCall(PetscStrcasecmp(type, HycoSolverTypes[k], &same));
    if (same) {
      s->type = k;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  HycoFail("the solver type \"%s\" is unknown; types are active_set, tao and lemke", type);
}

PetscErrorCode HycoSolverSetTaoType(HycoSolver s, const char type[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->tao_type = HYCO_TAO_AUTO;
  if (!type) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; HycoTaoTypes[k] && s->tao_type == HYCO_TAO_AUTO; k++) {
    PetscBool same;

    PetscCall(PetscStrcasecmp(type, HycoTaoTypes[k], &same));
    if (same) s->tao_type = k;
  }
  HycoCheck(s->tao_type != HYCO_TAO_AUTO,
            "the TAO type \"%s\" is unknown here; hyco -help lists those of -hyco_tao_type", type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetForm(HycoSolver s, HycoForm form)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->form = form;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetLinear(HycoSolver s, HycoLinear linear, PetscReal gigabytes)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheck(gigabytes >= 0, "the memory is %g GB; it must be 0 (what is free) or more", (double)gigabytes);
  s->linear = linear;
  s->memory = 1e9 * gigabytes;
  s->chosen_for = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetTolerance(HycoSolver s, PetscReal rtol)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheck(rtol > 0 && rtol < 1, "the tolerance is %g; it must lie between 0 and 1", (double)rtol);
  s->rtol = rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetMaxIts(HycoSolver s, PetscInt max_its)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->max_its = max_its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetWarmStart(HycoSolver s, PetscBool warm)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->warm = warm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetMultilevel(HycoSolver s, PetscBool multilevel)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->multilevel = multilevel;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetFallback(HycoSolver s, PetscBool fallback)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->fallback = fallback;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetMonitor(HycoSolver s, HycoMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  s->monitor = monitor;
  s->monitor_ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetOptionsPrefix(HycoSolver s, const char prefix[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCall(PetscObjectSetOptionsPrefix((PetscObject)s, prefix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverSetFromOptions(HycoSolver s)
{
  PetscInt form, linear;
  PetscReal gigabytes;
  PetscBool tao;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  form = (PetscInt)s->form;
  linear = (PetscInt)s->linear;
  gigabytes = 1e-9 * s->memory;
  PetscObjectOptionsBegin((PetscObject)s);
  PetscCall(
      HycoOptionsWord("-hyco_solver_type",
                      "method for every contact problem (a model's takes active_set where a TAO type needs symmetry)",
                      HycoSolverTypes, &s->type, NULL));
  PetscCall(HycoOptionsWord("-hyco_tao_type",
                            "<gpcg|tron|...|ssils|...> with the type tao: its solver; docs/solvers.md says which for "
                            "what (-hyco_tao_... sets its own options) [gpcg; ssils if nonsymmetric]",
                            HycoTaoTypes, &s->tao_type, &tao));
  PetscCall(
      HycoOptionsWord("-hyco_solver_form",
                      "full order: pose it in the forces (few contacts; _free: no matrix) or in the gaps (as many "
                      "as unknowns)",
                      forms, &form, NULL));
  PetscCall(HycoOptionsWord("-hyco_linear",
                            "solve with the stiffness by a factor (MUMPS), or by conjugate gradients with multigrid",
                            HycoLinearNames, &linear, NULL));
  PetscCall(HycoOptionsReal("-hyco_memory",
                            "<GB> what a factor may take before iterations do (0: most of what is free)", 0, 1e9,
                            &gigabytes, NULL));
  PetscCall(HycoOptionsReal("-hyco_solver_rtol", "largest relative KKT residual that counts as solved", 1e-15, 0.1,
                            &s->rtol, NULL));
  PetscCall(HycoOptionsInt("-hyco_solver_max_its",
                           "iterations of the active set or TAO (0: from the number of contacts; 2000)", 0,
                           PETSC_MAX_INT, &s->max_its, NULL));
  PetscCall(HycoOptionsBool("-hyco_solver_fallback",
                            "what is not solved is tried again: tao, then active_set, then lemke", &s->fallback, NULL));
  PetscCall(HycoOptionsBool("-hyco_solver_warm_start", "full order: start from the last solution's active contacts",
                            &s->warm, NULL));
  PetscCall(HycoOptionsBool("-hyco_solver_multilevel",
                            "full order, every unknown a contact: start from coarser problems", &s->multilevel, NULL));
  PetscCall(HycoOptionsName("-hyco_solver_view", "after each solve: form, method, tolerances, residuals"));
  PetscOptionsEnd();
  HycoCheck(!tao || s->type == HYCO_TYPE_TAO,
            "nothing reads the option -hyco_tao_type here: the type is %s; give -hyco_solver_type tao",
            HycoSolverTypes[s->type]);
  s->form = (HycoForm)form;
  s->linear = (HycoLinear)linear;
  s->memory = 1e9 * gigabytes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverDeclare(PetscOptions options)
{
  HycoSolver s;

  PetscFunctionBegin;
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &s));
  HycoDeclare(s, options, HycoSolverSetFromOptions, HycoSolverDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `direct`: x came from a solve with K, so that no equilibrium means no good solve. */
static PetscErrorCode Judge(HycoSolver s, Vec x, Vec L, PetscBool direct, PetscBool solved)
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_KKT, HycoSystemComputeKKT(s->system, x, L, &s->kkt));
  if (HycoKKTMax(&s->kkt) <= s->rtol)
    s->reason = HYCO_CONVERGED;
  else if (direct && !(s->kkt.stationarity <= 1e-3))
    s->reason = HYCO_DIVERGED_SINGULAR; /* K x = r was not even nearly solved */
  else if (s->reason != HYCO_DIVERGED_SINGULAR)
    s->reason = solved || s->kkt.stationarity > s->rtol ? HYCO_DIVERGED_RESIDUAL : HYCO_DIVERGED_ITERATIONS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One method on one form, judged. */
static PetscErrorCode Attempt(HycoSolver s, PetscInt type, HycoForm form, Vec x, Vec L)
{
  const PetscBool direct = (PetscBool)(form != HYCO_FORM_PRIMAL || type != HYCO_TYPE_TAO);
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  s->its = 0;
  s->reason = HYCO_DIVERGED_RESIDUAL;
  if (form == HYCO_FORM_PRIMAL)
    PetscCall(HycoSolvePrimal(s, type, x, L, &solved));
  else if (form == HYCO_FORM_DUAL_FREE && s->system->m)
    PetscCall(HycoSolveDualFree(s, x, L, &solved));
  else
    PetscCall(HycoSolveDual(s, type, x, L, &solved));
  PetscCall(Judge(s, x, L, direct, solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next method after one that did not solve: TAO, the active set, Lemke's; this one wants the dual form, whose
   factor an iterative solve is there to avoid. */
static PetscBool NextAttempt(const HycoSolver s, PetscInt *type, HycoForm *form)
{
  const PetscBool dense = (PetscBool)(s->system->m && s->system->m <= HYCO_LEMKE_MAX && !s->iterative);

  if (!s->fallback || s->reason > 0 || s->reason == HYCO_DIVERGED_SINGULAR || s->p) return PETSC_FALSE;
  if (*type == HYCO_TYPE_LEMKE || (*type == HYCO_TYPE_ACTIVE_SET && !dense)) return PETSC_FALSE;
  if (*form == HYCO_FORM_DUAL_FREE && !dense) return PETSC_FALSE;
  *type = *type == HYCO_TYPE_TAO ? HYCO_TYPE_ACTIVE_SET : HYCO_TYPE_LEMKE;
  if (*type == HYCO_TYPE_LEMKE || *form == HYCO_FORM_DUAL_FREE) *form = HYCO_FORM_DUAL;
  return PETSC_TRUE;
}

PetscErrorCode HycoSolverSolve(HycoSolver s, Vec x, Vec L)
{
  HycoForm form;
  PetscInt type, its, n_free = 0;
  PetscBool fell_back = PETSC_FALSE, refined = PETSC_FALSE;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  if (s->system) HycoCheckHandle(s->system, HYCO_SYSTEM_CLASSID);
  PetscCheck(s->system && s->system->F, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoSolverSetSystem(), with a system whose matrices and vectors are set, before HycoSolverSolve()");
  s->seconds_factor = s->seconds_before;
  type = s->type;
  PetscCall(HycoChooseForm(s, &form));
  PetscCall(HycoChooseLinear(s, &form));
  PetscCall(HycoChooseTao(s, form));
  PetscCall(Attempt(s, type, form, x, L));
  its = s->its;
  if (s->reason < 0 && form == HYCO_FORM_DUAL) PetscCall(HycoDualRefine(s, &refined));
  if (refined) {
    PetscCall(Attempt(s, type, form, x, L));
    its += s->its;
  }
  while (NextAttempt(s, &type, &form)) {
    char before[sizeof(s->method)], next[32];

    PetscCall(PetscStrncpy(before, s->method, sizeof(before)));
    PetscCall(Attempt(s, type, form, x, L));
    its += s->its;
    fell_back = PETSC_TRUE;
    PetscCall(PetscStrncpy(next, HycoSolverTypes[type], sizeof(next)));
    PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "%s, then %s", before, next));
  }
  s->its = its;
  HycoDualForget(s);
  if (s->reason < 0) PetscCall(HycoKernelSize(s->system->K, &n_free));
  if (n_free) s->reason = HYCO_DIVERGED_FLOATING;
  if (fell_back && s->reason == HYCO_CONVERGED) s->reason = HYCO_CONVERGED_FALLBACK;
  s->free = NULL;
  s->seconds_solve = HycoNow() - begin - (s->seconds_factor - s->seconds_before);
  s->seconds_before = 0;
  PetscCall(HycoSolverViewFromOptions(s, NULL, "-hyco_solver_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetReason(HycoSolver s, HycoReason *reason)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  *reason = s->reason;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetIterations(HycoSolver s, PetscInt *its)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  *its = s->its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetKKT(HycoSolver s, HycoKKT *kkt)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  *kkt = s->kkt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetMethod(HycoSolver s, const char *method[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  *method = s->method;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetLinear(HycoSolver s, const char *linear[])
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  *linear = s->linear_method;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetSeconds(HycoSolver s, PetscReal *factor, PetscReal *solve)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  if (factor) *factor = s->seconds_factor;
  if (solve) *solve = s->seconds_solve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *HycoReasonName(HycoReason reason)
{
  switch (reason) {
  case HYCO_CONVERGED:
    return "converged";
  case HYCO_CONVERGED_FALLBACK:
    return "converged by the fallback solver";
  case HYCO_DIVERGED_RESIDUAL:
    return "not converged: a KKT residual is above the tolerance";
  case HYCO_DIVERGED_FLOATING:
    return "not converged: contact alone holds a body, and this load takes it away";
  case HYCO_DIVERGED_NO_CONTACT_BASIS:
    return "not converged: the model has no contact force to give, and bodies penetrate here; train on solutions that "
           "press";
  case HYCO_DIVERGED_ITERATIONS:
    return "not converged: the limit of iterations, or a cycle";
  default:
    return "not converged: the stiffness is singular (is a body held by nothing?)";
  }
}

PetscErrorCode HycoSolverView(HycoSolver s, PetscViewer viewer)
{
  PetscBool ascii;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  PetscCall(HycoViewBegin((PetscObject)s, &viewer, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "type: %s%s%s; form: %s\n", HycoSolverTypes[s->type],
                                   s->type == HYCO_TYPE_TAO ? ", " : "",
                                   s->type != HYCO_TYPE_TAO ? ""
                                   : s->tao_type < 0        ? "by the system"
                                                            : HycoTaoTypes[s->tao_type],
                                   forms[s->form]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "tolerance of the KKT residuals: %g; iterations: at most %d%s\n",
                                   (double)s->rtol, (int)s->max_its, s->max_its ? "" : " (by the number of contacts)"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "solves with K: %s\n",
                                   s->linear_method[0] ? s->linear_method : HycoLinearNames[s->linear]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "fallback: %s; warm start: %s; start from coarser problems: %s\n",
                                   s->fallback ? "yes" : "no", s->warm ? "yes" : "no", s->multilevel ? "yes" : "no"));
  if (s->reason) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "last solve: %s, %s, %d iterations, largest residual %.1e\n",
                                     HycoReasonName(s->reason), s->method, (int)s->its, (double)HycoKKTMax(&s->kkt)));
  }
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoSolver, HYCO_SOLVER_CLASSID)
