/* HycoSolver: tries forms and methods in order, and checks each by the recomputed residuals. */
#include <hycosolverimpl.h>
#include <string.h>

enum { ACTIVE_SET, TAO, LEMKE, SEMISMOOTH };
const char *const HycoSolverTypes[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE,
                                       HYCO_SOLVER_SEMISMOOTH, NULL};

/*
  The order in which methods are tried after a failure, from the chosen one on, and for which systems. An empty Tao type
  means the user's. Where a form has the dense problem, Lemke's method comes before TAO's types: it is faster and exact
  to round-off (docs/solvers.md). Elsewhere it needs the dual form with a factor, and comes after them. For systems with
  other cones than forces >= 0, those that have not the trait HYCO_TAO_CONES are left out.
*/
typedef struct {
  PetscInt type;
  const char *tao;
  PetscBool symmetric, nonsymmetric;
  PetscBool stays; /* only if the form of the last attempt accepts it */
} Candidate;
static const Candidate order[] = {{TAO, "", PETSC_TRUE, PETSC_TRUE, PETSC_FALSE},
                                  {SEMISMOOTH, HYCO_TAO_SEMISMOOTH_NEWTON, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE},
                                  {ACTIVE_SET, HYCO_TAO_ACTIVE_SET, PETSC_TRUE, PETSC_TRUE, PETSC_FALSE},
                                  {LEMKE, HYCO_TAO_LEMKE, PETSC_TRUE, PETSC_TRUE, PETSC_TRUE},
                                  {TAO, "gpcg", PETSC_TRUE, PETSC_FALSE, PETSC_FALSE},
                                  {TAO, "tron", PETSC_TRUE, PETSC_FALSE, PETSC_FALSE},
                                  {LEMKE, HYCO_TAO_LEMKE, PETSC_TRUE, PETSC_TRUE, PETSC_FALSE},
                                  {TAO, "ssils", PETSC_FALSE, PETSC_TRUE, PETSC_FALSE}};
static const Candidate *const by_default = &order[2];
#define N_CANDIDATES ((int)(sizeof(order) / sizeof(order[0])))

/* The names of the forms, by the values of HycoForm. */
static const char *const form_names[] = {"", "dual", "primal", "dual_free"};

/* Forms are created with the solver, since options declare their names. */
PetscErrorCode HycoSolverCreate(MPI_Comm comm, HycoSolver *solver)
{
  PetscFunctionBegin;
  HycoCheckGiven(solver);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*solver, HYCO_SOLVER_CLASSID, "HycoSolver", "Solver of contact systems", "Hyco", comm,
                              HycoSolverDestroy, HycoSolverView));
  (*solver)->rtol = HYCO_RESIDUAL;
  (*solver)->warm = PETSC_TRUE;
  (*solver)->fallback = PETSC_TRUE;
  /* -hyco_solver_multilevel false: the active set starts without contact. */
  (*solver)->multilevel = PETSC_TRUE;
  (*solver)->refine = PETSC_TRUE;
  PetscCall(HycoSolverCreateForms(*solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forms go before the factor that they share. */
PetscErrorCode HycoSolverDestroy(HycoSolver *solver)
{
  HycoSolver s;

  PetscFunctionBegin;
  HycoDestroyBegin(solver, HYCO_SOLVER_CLASSID);
  s = *solver;
  PetscCall(HycoSystemDestroy(&s->system));
  for (PetscInt k = 0; k < s->n_forms; k++) {
    /* A form without data has no destructor. */
    if (s->forms[k]->ops->destroy) PetscCall(s->forms[k]->ops->destroy(s->forms[k]));
    PetscCall(PetscFree(s->forms[k]));
  }
  PetscCall(PetscFree(s->forms));
  PetscCall(HycoStiffnessDestroy(&s->stiffness));
  PetscCall(PetscHeaderDestroy(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes a reference. Factors stay valid if K and B are the same objects in the same state. The same system may be set
   again after its matrices have changed. */
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

/* A word of -hyco_solver_type, in any case; a Tao type's name is for HycoSolverSetTaoType(). */
PetscErrorCode HycoSolverSetType(HycoSolver s, HycoSolverType type)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheckGiven(type);
  for (PetscInt k = 0; HycoSolverTypes[k]; k++) {
    PetscBool same;

    PetscCall(PetscStrcasecmp(type, HycoSolverTypes[k], &same));
    if (same) {
      s->type = k;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  HycoFail("the solver type \"%s\" is unknown; types are active_set, tao, lemke and semismooth", type);
}

/* NULL: by the system. */
PetscErrorCode HycoSolverSetTaoType(HycoSolver s, const char type[])
{
  char list[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  /* Also after an unknown type: the former one must not stay by accident. */
  s->tao_type[0] = '\0';
  if (!type) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTaoFindType(type, s->tao_type, list));
  HycoCheck(s->tao_type[0], "the TAO type \"%s\" is unknown; it must be one of: %s, or one that the program registers",
            type, list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSolverSetForm, (HycoSolver s, HycoForm form), s, HYCO_SOLVER_CLASSID,
                 PetscCall(PetscStrncpy(s->form_name, form_names[form], sizeof(s->form_name))))

/* 0: four fifths of the free memory. */
PetscErrorCode HycoSolverSetLinear(HycoSolver s, HycoLinear linear, PetscReal gigabytes)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheck(gigabytes >= 0, "the memory is %g GB; it must be 0 (the free memory) or more", (double)gigabytes);
  s->linear = linear;
  s->memory = 1e9 * gigabytes;
  /* The choice is made anew at the next solve, even if K is the same. */
  s->chosen_for = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each of the four relative residuals, all recomputed: no method's own measure decides. */
PetscErrorCode HycoSolverSetTolerance(HycoSolver s, PetscReal rtol)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  HycoCheck(rtol > 0 && rtol < 1, "the tolerance is %g; it must lie between 0 and 1", (double)rtol);
  s->rtol = rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSolverSetMaxIts, (HycoSolver s, PetscInt max_its), s, HYCO_SOLVER_CLASSID, s->max_its = max_its)
HycoDefineMethod(HycoSolverSetWarmStart, (HycoSolver s, PetscBool warm), s, HYCO_SOLVER_CLASSID, s->warm = warm)
HycoDefineMethod(HycoSolverSetMultilevel, (HycoSolver s, PetscBool multilevel), s, HYCO_SOLVER_CLASSID,
                 s->multilevel = multilevel)
HycoDefineMethod(HycoSolverSetFallback, (HycoSolver s, PetscBool fallback), s, HYCO_SOLVER_CLASSID,
                 s->fallback = fallback)
HycoDefineMethod(HycoSolverSetMonitor, (HycoSolver s, HycoMonitor monitor, void *ctx), s, HYCO_SOLVER_CLASSID,
                 s->monitor = monitor;
                 s->monitor_ctx = ctx)

/* -hyco_solver_form: auto, or a registered form's name. Registered forms, of extensions too, are words of the
   option. */
static PetscErrorCode ReadForm(HycoSolver s, HycoOptionItems PetscOptionsObject)
{
  const char **words;
  PetscInt form = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(s->n_forms + 2, &words));
  words[0] = "auto";
  for (PetscInt k = 0; k < s->n_forms; k++) {
    words[k + 1] = s->forms[k]->name;
    if (strcmp(s->form_name, s->forms[k]->name) == 0) form = k + 1;
  }
  ierr = HycoOptionsWord("-hyco_solver_form",
                         "full order: unknowns of the problem: forces (dual, for few contacts; dual_free without a "
                         "matrix) or gaps (primal, for as many contacts as unknowns)",
                         words, &form, NULL);
  /* The name is the form's own, in its spelling. */
  if (!ierr) ierr = PetscStrncpy(s->form_name, form ? words[form] : "", sizeof(s->form_name));
  PetscCall(PetscFree(words));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hyco_tao_type: one of TAO's types that are suitable for contact, or one that the program registers. */
static PetscErrorCode ReadTaoType(HycoSolver s, HycoOptionItems PetscOptionsObject, PetscBool typed)
{
  char type[HYCO_TAO_NAME] = "", list[HYCO_LINE];
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(HycoOptionsString(
      "-hyco_tao_type",
      "<gpcg|tron|...|ssils|...> solver of the type tao, which it implies, see docs/solvers.md (-hyco_tao_... "
      "sets its own options) [gpcg; ssils if nonsymmetric]",
      type, sizeof(type), &given));
  if (!given) PetscFunctionReturn(PETSC_SUCCESS);
  if (!typed) s->type = TAO;
  /* An option without effect is an error. */
  HycoCheck(s->type == TAO,
            "-hyco_tao_type has no effect here, because the solver type is %s; give -hyco_solver_type tao",
            HycoSolverTypes[s->type]);
  PetscCall(HycoTaoFindType(type, s->tao_type, list));
  HycoCheck(s->tao_type[0], "-hyco_tao_type is \"%s\"; it must be one of: %s, or one that the program registers", type,
            list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSolverSetOptionsPrefix, (HycoSolver s, const char prefix[]), s, HYCO_SOLVER_CLASSID,
                 PetscCall(PetscObjectSetOptionsPrefix((PetscObject)s, prefix)))

/* Values before the call are the defaults. Collective, as option errors are. */
PetscErrorCode HycoSolverSetFromOptions(HycoSolver s)
{
  PetscInt linear;
  PetscReal gigabytes;
  PetscBool typed;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  /* Present values are the defaults of the options. */
  linear = (PetscInt)s->linear;
  gigabytes = 1e-9 * s->memory;
  PetscObjectOptionsBegin((PetscObject)s);
  PetscCall(
      HycoOptionsWord("-hyco_solver_type",
                      "method for every contact problem (for a model active_set is used if a TAO type needs symmetry)",
                      HycoSolverTypes, &s->type, &typed));
  PetscCall(ReadTaoType(s, PetscOptionsObject, typed));
  PetscCall(HycoOptionsFor("full order"));
  PetscCall(ReadForm(s, PetscOptionsObject));
  PetscCall(HycoOptionsWord("-hyco_linear",
                            "solve with the stiffness by a factor (MUMPS), or by conjugate gradients with multigrid",
                            HycoLinearNames, &linear, NULL));
  PetscCall(HycoOptionsReal(
      "-hyco_memory", "<GB> memory of a factor above which the iterative solver is used (0: most of the free memory)",
      0, 1e9, &gigabytes, NULL));
  for (PetscInt k = 0; k < s->n_forms; k++) {
    if (s->forms[k]->ops->setfromoptions)
      PetscCall(s->forms[k]->ops->setfromoptions(s, s->forms[k], PetscOptionsObject));
  }
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsReal("-hyco_solver_rtol", "largest relative KKT residual that counts as solved", 1e-15, 0.1,
                            &s->rtol, NULL));
  PetscCall(
      HycoOptionsInt("-hyco_solver_max_its",
                     "largest number of iterations (0: of the active set from the number of contacts; of TAO 2000)", 0,
                     PETSC_MAX_INT, &s->max_its, NULL));
  PetscCall(HycoOptionsBool("-hyco_solver_fallback",
                            "if a method fails, try the next: active_set, then TAO's gpcg and tron, then lemke (lemke, "
                            "then ssils if nonsymmetric)",
                            &s->fallback, NULL));
  PetscCall(HycoOptionsBool("-hyco_solver_warm_start", "full order: start from the last solution's active contacts",
                            &s->warm, NULL));
  PetscCall(HycoOptionsName("-hyco_solver_view", "print form, method, tolerances and residuals after each solve"));
  PetscOptionsEnd();
  s->linear = (HycoLinear)linear;
  s->memory = 1e9 * gigabytes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of an object that exists for its options alone, so that help and checks of unknown options have them all. */
PetscErrorCode HycoSolverDeclare(PetscOptions options)
{
  HycoSolver s;

  PetscFunctionBegin;
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &s));
  HycoDeclare(s, options, HycoSolverSetFromOptions, HycoSolverDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For nonsymmetric systems of reduced models, which then use the active set method. */
PetscBool HycoSolverNeedsSymmetry(HycoSolver s)
{
  return (PetscBool)(s->type == TAO && HycoTaoTraits(s->tao_type) & HYCO_TAO_SYMMETRIC);
}

/* A Tao type that is the library's own has the word of the solver type; TAO's are named in addition. */
PetscErrorCode HycoSolverNameMethod(HycoSolver s, const char form[])
{
  PetscFunctionBegin;
  /* Not formatted, which costs as much as a part of a small prediction. */
  PetscCall(PetscStrncpy(s->method, s->now.word, sizeof(s->method)));
  for (int k = s->now.traits & HYCO_TAO_OWN ? 1 : 0; k < 2; k++) {
    PetscCall(PetscStrlcat(s->method, " ", sizeof(s->method)));
    PetscCall(PetscStrlcat(s->method, k ? form : s->now.type, sizeof(s->method)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A singular K is a reason of divergence, not an error. */
PetscErrorCode HycoSolverGiveUp(HycoSolver s, Vec x, Vec L)
{
  PetscFunctionBegin;
  s->reason = HYCO_DIVERGED_SINGULAR;
  PetscCall(VecSet(x, 0));
  if (L) PetscCall(VecSet(L, 0));
  PetscCall(HycoSolverNameMethod(s, s->form->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the method for this system. */
static PetscErrorCode SetMethod(HycoSolver s, const Candidate *c)
{
  const char *tao = c->tao;

  PetscFunctionBegin;
  if (!tao[0]) tao = s->tao_type[0] ? s->tao_type : s->system->symmetric ? "gpcg" : "ssils";
  s->now.word = HycoSolverTypes[c->type];
  PetscCall(PetscStrncpy(s->now.type, tao, sizeof(s->now.type)));
  s->now.traits = HycoTaoTraits(tao);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Asks the form; the reason of a form that could take the cones is kept. */
static PetscErrorCode SolverAccepts(HycoSolver s, HycoSolverForm form, PetscReal *cost, char why[HYCO_LINE])
{
  PetscFunctionBegin;
  if (s->system->W && !form->compliance) {
    *cost = -1;
    if (!why[0])
      HycoFormat(why, "the form %s takes no compliance of the contacts, which this system has; use dual", form->name);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (s->system->blocks && s->system->m && !form->cones) {
    *cost = -1;
    /* The first form's reason is the most telling one. */
    if (!why[0])
      HycoFormat(why, "the form %s takes contact forces >= 0 only, and this system has other cones; use dual",
                 form->name);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(form->ops->accepts(s, form, (PetscBool)(strcmp(form->name, s->form_name) == 0), cost, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The form `stay` if it accepts the system, else the cheapest; a form that the user asks for has no alternative.
   *form NULL: none, and `why` may say why. */
PetscErrorCode HycoSolverAcceptingForm(HycoSolver s, HycoSolverForm stay, HycoSolverForm *form, char why[HYCO_LINE])
{
  const PetscBool posed = (PetscBool)(s->system->K && s->system->m); /* whether there is a choice */
  PetscReal cost = -1, least = PETSC_MAX_REAL;

  PetscFunctionBegin;
  *form = NULL;
  why[0] = '\0';
  if (!stay && s->form_name[0] && posed && !s->falling_back) {
    stay = HycoSolverFindForm(s, s->form_name);
    PetscCall(SolverAccepts(s, stay, &cost, why));
    if (cost >= 0) *form = stay;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (stay) PetscCall(SolverAccepts(s, stay, &cost, why));
  if (cost >= 0) {
    *form = stay;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < s->n_forms; k++) {
    /* The cheapest; a form that refuses may say why, for the case that none accepts. */
    PetscCall(SolverAccepts(s, s->forms[k], &cost, why));
    if (cost < 0 || cost >= least) continue;
    least = cost;
    *form = s->forms[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The form of the first attempt: the user's, or the cheapest; then direct or iterative. The form is first found as
   for a direct solver: its factor decides whether iterations are needed. */
static PetscErrorCode FirstForm(HycoSolver s, HycoSolverForm *form)
{
  const PetscBool iterative = s->iterative;
  char why[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheck(!s->system->blocks || s->now.traits & HYCO_TAO_CONES,
            "%s solves systems with contact forces >= 0 only, and this one has other cones; use -hyco_solver_type "
            "semismooth",
            s->now.traits & HYCO_TAO_OWN ? s->now.word : s->now.type);
  HycoCheck(s->system->symmetric || !s->system->m || !(s->now.traits & HYCO_TAO_SYMMETRIC),
            "TAO's %s needs a symmetric system, and this one is not symmetric; use -hyco_tao_type ssils, asils, ssfls "
            "or asfls",
            s->now.type);
  /* Asked as for a direct solver: forms answer by s->iterative, which the choice below needs first. */
  s->iterative = PETSC_FALSE;
  PetscCall(HycoSolverAcceptingForm(s, NULL, form, why));
  s->iterative = iterative;
  if (!*form && !why[0])
    HycoFormat(why, "the form %s cannot solve this system; use -hyco_solver_form auto", s->form_name);
  PetscCheck(*form, HycoComm(s), PETSC_ERR_USER, "%s", why);
  PetscCall(HycoChooseLinear(s, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverNoteKSP(HycoSolver s, KSP ksp)
{
  KSPConvergedReason reason;
  const char *prefix;
  PetscInt its;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  if (reason < 0)
    HycoFormat(s->failure, "its KSP (-%sksp_...) ended by %s after %d iterations", prefix ? prefix : "",
               KSPConvergedReasons[reason], (int)its);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoSolverExplain(HycoSolver s, char why[HYCO_LINE])
{
  char text[HYCO_LINE];

  if (!s->failure[0] || !why[0] || s->reason >= 0) return;
  HycoFormat(text, "%.400s: %.500s", s->reason == HYCO_DIVERGED_SINGULAR ? "not converged" : why, s->failure);
  snprintf(why, HYCO_LINE, "%s", text);
}

/* The reason follows from the recomputed residuals alone; `solved` only distinguishes the text of a failure. */
static PetscErrorCode SolverJudge(HycoSolver s, Vec x, Vec L, PetscBool solved)
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_KKT, HycoSystemComputeKKT(s->system, x, L, &s->kkt));
  if (s->system->beyond <= s->rtol)
    s->reason = HYCO_CONVERGED;
  else if (s->by_factor && !s->failure[0] && !(s->kkt.stationarity <= 1e-3))
    s->reason = HYCO_DIVERGED_SINGULAR; /* K x = r was solved with a large residual */
  else if (s->reason != HYCO_DIVERGED_SINGULAR)
    s->reason = solved || s->kkt.stationarity > s->rtol ? HYCO_DIVERGED_RESIDUAL : HYCO_DIVERGED_ITERATIONS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with the current method on that form, and checks the result; adds its iterations. The form may change
   s->reason to singular. */
static PetscErrorCode SolverAttempt(HycoSolver s, HycoSolverForm form, Vec x, Vec L)
{
  const PetscInt its = s->its;
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  s->form = form;
  s->its = 0;
  /* For forms that say nothing: SolverJudge() decides by the residuals. */
  s->reason = HYCO_DIVERGED_RESIDUAL;
  s->by_factor = PETSC_TRUE;
  s->failure[0] = '\0';
  PetscCall(form->ops->solve(s, form, x, L, &solved));
  if (!s->failure[0] && !solved && s->now.traits && !(s->now.traits & HYCO_TAO_OWN))
    PetscCall(PetscStrncpy(s->failure, HycoTaoFailure(), sizeof(s->failure)));
  PetscCall(SolverJudge(s, x, L, solved));
  s->its += its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating bodies: of the forms, only the dual finds a solution where contact does not determine all rigid motions,
   and decides whether there is one. Not for cones: their dual problem has other failures. */
static PetscErrorCode DecideByForces(HycoSolver s, Vec x, Vec L)
{
  const HycoSolverForm dual = HycoSolverFindForm(s, "dual");
  char why[HYCO_LINE] = "", before[sizeof(s->method)];
  PetscReal cost = -1;
  PetscInt n_free = 0;

  PetscFunctionBegin;
  if (s->system->K) PetscCall(HycoKernelSize(s->system->K, &n_free));
  /* Supports determine everything, or nothing is left to decide by. */
  if (!n_free || !s->system->m || s->system->blocks || !s->fallback || s->form == dual)
    PetscFunctionReturn(PETSC_SUCCESS);
  s->falling_back = PETSC_TRUE;
  PetscCall(SetMethod(s, by_default));
  PetscCall(SolverAccepts(s, dual, &cost, why));
  if (cost < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrncpy(before, s->method, sizeof(before)));
  PetscCall(SolverAttempt(s, dual, x, L));
  PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "%s, then dual", before));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends the fallback method to the name of those before it. */
static PetscErrorCode NameFallback(HycoSolver s, const char before[])
{
  const PetscBool own = (PetscBool)(s->now.traits & HYCO_TAO_OWN);

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(s->method, sizeof(s->method), "%s, then %s%s%s", before, s->now.word, own ? "" : " ",
                          own ? "" : s->now.type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The form for a candidate; NULL: none accepts it. */
static PetscErrorCode FormOf(HycoSolver s, const Candidate *c, HycoSolverForm *form)
{
  char why[HYCO_LINE];

  PetscFunctionBegin;
  if (!s->falling_back)
    PetscCall(FirstForm(s, form));
  else
    PetscCall(HycoSolverAcceptingForm(s, s->form, form, why));
  if (s->falling_back && c->stays && *form != s->form) *form = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with one method; again if its form can solve with less round-off. *tried: a form accepts it. A refinement
   counts as part of the same method. */
static PetscErrorCode SolverTry(HycoSolver s, const Candidate *c, Vec x, Vec L, PetscBool *tried)
{
  char before[sizeof(s->method)];
  PetscBool better = PETSC_FALSE;
  HycoSolverForm form;

  PetscFunctionBegin;
  PetscCall(SetMethod(s, c));
  PetscCall(FormOf(s, c, &form));
  *tried = (PetscBool)(form != NULL);
  if (!form) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrncpy(before, s->method, sizeof(before)));
  PetscCall(SolverAttempt(s, form, x, L));
  /* A residual just above the tolerance may be round-off of the factor, which twice the precision removes. */
  if (s->reason < 0 && s->refine && form->ops->refine) PetscCall(form->ops->refine(s, form, &better));
  if (s->reason < 0 && better) PetscCall(SolverAttempt(s, form, x, L));
  if (s->falling_back) PetscCall(NameFallback(s, before));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether candidate k is next: the chosen method, or after it one that this system accepts and that was not tried.
   Candidates are unique by their Tao type. */
static PetscBool IsNext(HycoSolver s, int k, const PetscBool tried[], const char chosen[])
{
  if (!chosen[0]) return (PetscBool)(order[k].type == s->type);
  if (!(s->system->symmetric ? order[k].symmetric : order[k].nonsymmetric)) return PETSC_FALSE;
  if (s->system->blocks && !(HycoTaoTraits(order[k].tao) & HYCO_TAO_CONES)) return PETSC_FALSE;
  for (int j = 0; j < k; j++) {
    if (tried[j] && strcmp(order[j].tao, order[k].tao) == 0) return PETSC_FALSE;
  }
  return (PetscBool)(strcmp(order[k].tao, chosen) != 0);
}

/* Tries methods in order, from the chosen one on, until one converges. A singular K ends the attempts: other methods
   would meet the same factor. */
static PetscErrorCode SolverAttempts(HycoSolver s, Vec x, Vec L)
{
  char chosen[HYCO_TAO_NAME] = "";
  PetscBool tried[N_CANDIDATES] = {PETSC_FALSE};

  PetscFunctionBegin;
  for (int k = 0; k < N_CANDIDATES; k++) {
    if (!IsNext(s, k, tried, chosen)) continue;
    PetscCall(SolverTry(s, &order[k], x, L, &tried[k]));
    /* The type for which an empty entry stood: it must not be tried twice. */
    if (!chosen[0]) PetscCall(PetscStrncpy(chosen, s->now.type, sizeof(chosen)));
    if (!tried[k]) continue;
    if (s->reason > 0 || s->reason == HYCO_DIVERGED_SINGULAR || !s->fallback || !s->system->m) break;
    s->falling_back = PETSC_TRUE;
  }
  if (s->reason < 0) PetscCall(DecideByForces(s, x, L));
  if (s->falling_back && s->reason == HYCO_CONVERGED) s->reason = HYCO_CONVERGED_FALLBACK;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x and L (NULL without contact) in place; the reason tells whether the KKT residuals, recomputed from K, B, F, D,
   are below the tolerance. Collective. */
PetscErrorCode HycoSolverSolve(HycoSolver s, Vec x, Vec L)
{
  PetscInt n_free = 0;
  PetscReal begin = HycoNow();
  PetscBool lift_off = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  if (s->system) HycoCheckHandle(s->system, HYCO_SYSTEM_CLASSID);
  PetscCheck(s->system && (s->system->F || !s->system->n) && (s->system->K || s->system->W), PETSC_COMM_SELF,
             PETSC_ERR_ORDER,
             "call HycoSolverSetSystem(), with a system whose matrices and vectors are set, before HycoSolverSolve()");
  PetscCall(HycoSystemCheckBlocks(s->system));
  /* A factor made ahead by HycoSolverFactor() belongs to this solve. */
  s->seconds_factor = s->seconds_before;
  s->its = s->linear_its = s->linear_solves = s->linear_most = 0;
  s->falling_back = PETSC_FALSE;
  PetscCall(SolverAttempts(s, x, L));
  for (PetscInt k = 0; k < s->n_forms; k++) {
    if (s->forms[k]->ops->reset) PetscCall(s->forms[k]->ops->reset(s, s->forms[k]));
  }
  /* A failure with floating bodies is either a load that lifts them off or one of the solver. */
  if (s->reason < 0 && s->system->K) PetscCall(HycoKernelSize(s->system->K, &n_free));
  if (n_free) PetscCall(HycoSystemLiftOff(s->system, L, &lift_off));
  if (n_free) s->reason = lift_off ? HYCO_DIVERGED_FLOATING : HYCO_DIVERGED_HELD;
  /* What was passed for one solve ends here, whether or not it was used. */
  s->free = NULL;
  s->working_set = NULL;
  s->other = NULL;
  s->target = 0;
  s->seconds_solve = HycoNow() - begin - (s->seconds_factor - s->seconds_before);
  s->seconds_before = 0;
  PetscCall(HycoSolverViewFromOptions(s, NULL, "-hyco_solver_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factorisation alone, whose time counts for the next solve. Collective. */
PetscErrorCode HycoSolverFactor(HycoSolver s, PetscBool *singular)
{
  HycoSolverForm form = HycoSolverFindForm(s, s->system->m ? "dual" : "linear");

  PetscFunctionBegin;
  s->seconds_factor = 0;
  PetscCall(form->ops->setup(s, form, singular));
  s->seconds_before = s->seconds_factor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K x = r by the present factor, refined once. Collective. */
PetscErrorCode HycoSolverSolveLinear(HycoSolver s, Vec r, Vec x)
{
  HycoSystem y = s->system;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(HycoStiffnessSolve(s, r, x));
  PetscCall(MatMult(y->K, x, y->work_x[0]));
  /* One step of refinement: solutions of loads are combined later, and their errors with them. */
  PetscCall(VecAYPX(y->work_x[0], -1, r));
  PetscCall(HycoStiffnessSolve(s, y->work_x[0], y->work_x[1]));
  PetscCall(VecAXPY(x, 1, y->work_x[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSolverSetRefine, (HycoSolver s, PetscBool refine), s, HYCO_SOLVER_CLASSID, s->refine = refine)

/* x = K^-1 F is known to the caller (NULL: not): saves a solve. For one solve. */
PetscErrorCode HycoSolverSetFree(HycoSolver s, Vec x)
{
  PetscFunctionBegin;
  s->free = x;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not the same as a set to start from: what is not in it is not in the problem. Borrowed for one solve. */
PetscErrorCode HycoSolverSetWorkingSet(HycoSolver s, const PetscBool in[])
{
  PetscFunctionBegin;
  s->working_set = in;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not referenced: the caller keeps it until the solve. NULL: none. */
PetscErrorCode HycoSolverSetOtherStart(HycoSolver s, Vec L)
{
  PetscFunctionBegin;
  s->other = L;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Residual to which the next solve goes, with x and L as start; 0: the tolerance alone. */
PetscErrorCode HycoSolverSetTarget(HycoSolver s, PetscReal residual)
{
  PetscFunctionBegin;
  s->target = residual;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolverGetLinearIterations(HycoSolver s, PetscInt *its, PetscInt *most)
{
  PetscFunctionBegin;
  *its = s->linear_its;
  *most = s->linear_most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSolverGetReason, (HycoSolver s, HycoReason *reason), s, HYCO_SOLVER_CLASSID,
                 HycoCheckGiven(reason);
                 *reason = s->reason)
HycoDefineMethod(HycoSolverGetIterations, (HycoSolver s, PetscInt *its), s, HYCO_SOLVER_CLASSID, HycoCheckGiven(its);
                 *its = s->its)
HycoDefineMethod(HycoSolverGetKKT, (HycoSolver s, HycoKKT *kkt), s, HYCO_SOLVER_CLASSID, HycoCheckGiven(kkt);
                 *kkt = s->kkt)
HycoDefineMethod(HycoSolverGetMethod, (HycoSolver s, const char *method[]), s, HYCO_SOLVER_CLASSID,
                 HycoCheckGiven(method);
                 *method = s->method)
HycoDefineMethod(HycoSolverGetLinear, (HycoSolver s, const char *linear[]), s, HYCO_SOLVER_CLASSID,
                 HycoCheckGiven(linear);
                 *linear = s->linear_method)

/* Of the last solve: the factor's part is 0 if it was kept. */
PetscErrorCode HycoSolverGetSeconds(HycoSolver s, PetscReal *factor, PetscReal *solve)
{
  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SOLVER_CLASSID);
  if (factor) *factor = s->seconds_factor;
  if (solve) *solve = s->seconds_solve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sentences for the user, who needs to know what to do: the reasons of a model's and of a path's solves are among
   them. */
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
    return "no equilibrium: a body is held by contact only, and this load lifts it off";
  case HYCO_DIVERGED_HELD:
    return "not converged: a body is held by contact only, and its equilibrium was not found, although contact forces "
           "can balance this load; use -hyco_linear direct, or add a support or a spring";
  case HYCO_DIVERGED_NO_CONTACT_BASIS:
    return "not converged: the model has no contact forces, and bodies penetrate here; train on solutions with contact";
  case HYCO_DIVERGED_STEP:
    return "not converged: the history cannot continue, because its steps became too small";
  case HYCO_DIVERGED_DISPLACEMENT:
    return "not converged: the displacements are beyond any meaning; check the units of loads, densities and moduli, "
           "and the supports";
  case HYCO_DIVERGED_ENERGY:
    return "not converged: strain energy and work differ; stiffnesses differ by too much for double precision";
  case HYCO_DIVERGED_SURFACE:
    return "not converged: a slave meets nodes on which the model of bodies was not trained; train it on points as far "
           "away as this one, or solve full order (-hyco_fallback, hyco solve)";
  case HYCO_DIVERGED_ITERATIONS:
    return "not converged: limit of iterations reached, or a cycle";
  case HYCO_DIVERGED_SINGULAR:
    return "not converged: the stiffness is singular; check that supports hold every body";
  default:
    return reason ? "not a reason of hyco's" : "not solved";
  }
}

/* Also before the first solve: reason 0 means that there was none. */
PetscErrorCode HycoSolverView(HycoSolver s, PetscViewer viewer)
{
  const char *tao = "";

  PetscFunctionBegin;
  HycoViewBegin(s, HYCO_SOLVER_CLASSID, viewer);
  if (s->type == TAO) tao = s->tao_type[0] ? s->tao_type : "by the system";
  PetscCall(PetscViewerASCIIPrintf(viewer, "type: %s%s%s; form: %s\n", HycoSolverTypes[s->type], tao[0] ? ", " : "",
                                   tao, s->form_name[0] ? s->form_name : "auto"));
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
