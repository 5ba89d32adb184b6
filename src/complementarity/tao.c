/*
  Complementarity problems solved by a Tao, which is kept from one to the next. TAO's bound-constrained types minimise

    min 1/2 y^T H y - f^T y,  lo <= y <= hi            H symmetric positive (semi)definite

  and its semismooth types solve the complementarity problem w = q + M z >= 0, z >= 0, w.z = 0, symmetric or not, by the
  Fischer-Burmeister function (T. S. Munson et al., INFORMS J. Comput. 13 (2001) 294-311). Both have absolute stopping
  criteria, so that the problem is scaled first: unit diagonal, right-hand side of size one. A type that a program
  registers gets the same: solution, bounds, Hessian, objective and its gradient H y - f. hyco's own types (tao_types.c)
  get the unscaled problem as data. TAO's convergence flag is not relied on: the caller recomputes the residuals. A
  PETSc error inside TAO is caught: it counts as not solved, like an iteration limit.
*/
#include <hycotao.h>

static const struct {
  const char *name;
  int traits;
} known[] = {{HYCO_TAO_ACTIVE_SET, HYCO_TAO_OWN}, /* checked first */
             {HYCO_TAO_LEMKE, HYCO_TAO_OWN | HYCO_TAO_DENSE},
             {HYCO_TAO_SEMISMOOTH_NEWTON, HYCO_TAO_OWN | HYCO_TAO_DENSE | HYCO_TAO_CONES},
             {"gpcg", HYCO_TAO_SYMMETRIC | HYCO_TAO_NEWTON | HYCO_TAO_RESTARTS},
             {"tron", HYCO_TAO_SYMMETRIC | HYCO_TAO_NEWTON | HYCO_TAO_RESTARTS},
             {"bntr", HYCO_TAO_SYMMETRIC | HYCO_TAO_NEWTON | HYCO_TAO_RESTARTS},
             {"bnls", HYCO_TAO_SYMMETRIC | HYCO_TAO_NEWTON | HYCO_TAO_RESTARTS},
             {"bntl", HYCO_TAO_SYMMETRIC | HYCO_TAO_NEWTON | HYCO_TAO_RESTARTS},
             {"blmvm", HYCO_TAO_SYMMETRIC},
             {"bncg", HYCO_TAO_SYMMETRIC},
             {"bqnls", HYCO_TAO_SYMMETRIC},
             {"bqnkls", HYCO_TAO_SYMMETRIC},
             {"bqnktr", HYCO_TAO_SYMMETRIC},
             {"bqnktl", HYCO_TAO_SYMMETRIC},
             {"bqpip", HYCO_TAO_SYMMETRIC | HYCO_TAO_ENTRIES},
             {"ssils", HYCO_TAO_DENSE | HYCO_TAO_SEMISMOOTH | HYCO_TAO_NEWTON},
             {"asils", HYCO_TAO_DENSE | HYCO_TAO_SEMISMOOTH | HYCO_TAO_NEWTON},
             {"ssfls", HYCO_TAO_DENSE | HYCO_TAO_SEMISMOOTH | HYCO_TAO_NEWTON},
             {"asfls", HYCO_TAO_DENSE | HYCO_TAO_SEMISMOOTH | HYCO_TAO_NEWTON}};

/* Unknown types have none: they get a bound-constrained problem. */
int HycoTaoTraits(const char type[])
{
  for (size_t k = 0; k < sizeof(known) / sizeof(known[0]); k++) {
    if (strcasecmp(known[k].name, type) == 0) return known[k].traits;
  }
  return 0;
}

/* name: the type as TAO knows it, "" if it is unknown; list: the names for a message. */
PetscErrorCode HycoTaoFindType(const char type[], char name[HYCO_TAO_NAME], char list[HYCO_LINE])
{
  static const char *const others[] = {"pounders", "brgn", "lcl",   "admm", "almm",
                                       "pdipm",    "ipm",  "shell", "snes", "bmrm"};
  PetscErrorCode (*create)(Tao);

  PetscFunctionBegin;
  list[0] = name[0] = '\0';
  for (size_t k = 0; k < sizeof(known) / sizeof(known[0]); k++) {
    /* hyco's own types have options of their own. */
    if (known[k].traits & HYCO_TAO_OWN) continue;
    if (strcasecmp(known[k].name, type) == 0) PetscCall(PetscStrncpy(name, known[k].name, HYCO_TAO_NAME));
    PetscCall(PetscStrlcat(list, list[0] ? ", " : "", HYCO_LINE));
    PetscCall(PetscStrlcat(list, known[k].name, HYCO_LINE));
  }
  /* Of TAO's others these need more than a bound problem has: some end the process. */
  for (size_t k = 0; k < sizeof(others) / sizeof(others[0]); k++) {
    if (strcasecmp(others[k], type) == 0) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscFunctionListFind(TaoList, type, &create));
  /* A type that the program has registered. */
  if (!name[0] && create) PetscCall(PetscStrncpy(name, type, HYCO_TAO_NAME));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* owner: its options prefix; quiet: of several ranks that solve the same problem only the first shows monitors. */
PetscErrorCode HycoTaoCreate(MPI_Comm comm, PetscObject owner, HycoTao *t)
{
  PetscMPIInt rank = 0;

  PetscFunctionBegin;
  PetscCall(HycoPackageCheck());
  PetscCall(PetscNew(t));
  (*t)->comm = comm;
  if (owner) PetscCallMPI(MPI_Comm_rank(PetscObjectComm(owner), &rank));
  (*t)->owner = owner;
  (*t)->quiet = (PetscBool)(HycoSize(comm) == 1 && rank > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Destroys what depends on the type and the size. */
static PetscErrorCode TaoReset(HycoTao t)
{
  PetscFunctionBegin;
  HycoDestroyAll(&t->tao, &t->J, &t->w, &t->d);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Destroys the copies of a dense problem. They are kept over solves of one size. */
static PetscErrorCode ResetDense(HycoTao t)
{
  PetscFunctionBegin;
  HycoDestroyAll(&t->dense, &t->f, &t->lo, &t->hi, &t->y);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. Collective on the communicator of Create. */
PetscErrorCode HycoTaoDestroy(HycoTao *t)
{
  PetscFunctionBegin;
  if (!*t) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TaoReset(*t));
  PetscCall(ResetDense(*t));
  PetscCall(VecDestroy(&(*t)->placed));
  HycoFreeAll(&(*t)->last, t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes effect at the next solve; another type drops the Tao. */
PetscErrorCode HycoTaoSetType(HycoTao t, const char type[], PetscInt max_its)
{
  PetscFunctionBegin;
  if (t->tao && (strcmp(t->type, type) || t->max_its != max_its)) PetscCall(TaoReset(t));
  if (!t->tao) {
    PetscCall(PetscStrncpy(t->type, type, sizeof(t->type)));
    t->traits = HycoTaoTraits(type);
    t->max_its = max_its;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the Tao for a problem of y's size, with the user's options, unless it exists; *made: it is new. TAO 3.18
   cannot change its size, hence a new one. */
static PetscErrorCode TaoPrepare(HycoTao t, Vec y, PetscInt max_its, PetscBool *made)
{
  PetscInt n, N;
  const char *prefix = NULL;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(y, &n));
  PetscCall(VecGetSize(y, &N));
  if (t->tao && (n != t->n || N != t->N)) PetscCall(TaoReset(t));
  *made = (PetscBool)!t->tao;
  if (!*made) PetscFunctionReturn(PETSC_SUCCESS);
  t->n = n;
  t->N = N;
  PetscCall(TaoCreate(t->comm, &t->tao));
  if (t->owner) PetscCall(PetscObjectGetOptionsPrefix(t->owner, &prefix));
  /* The owner's prefix first: several solvers in one program have options of their own. */
  PetscCall(PetscSNPrintf(t->prefix, sizeof(t->prefix), "%shyco_", prefix ? prefix : ""));
  PetscCall(TaoSetOptionsPrefix(t->tao, t->prefix));
  PetscCall(TaoSetType(t->tao, t->type));
  PetscCall(HycoTaoSetKSPPrefix(t->tao));
  if (t->traits & HYCO_TAO_OWN) { /* the form has its own solver on a set */
    t->tao->data = t;
    PetscCall(KSPDestroy(&t->tao->ksp));
  }
  PetscCall(TaoSetMaximumIterations(t->tao, max_its));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the user's -hyco_tao_... options. -hyco_tao_type is read by HycoSolver: it must not change the type of a
   fallback, or of another problem. The option is hidden during TaoSetFromOptions(). */
static PetscErrorCode ReadOptions(HycoTao t)
{
  char named[HYCO_TAO_NAME], option[2 * HYCO_TAO_NAME];
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(option, sizeof(option), "-%stao_type", t->prefix));
  PetscCall(PetscOptionsGetString(NULL, t->prefix, "-tao_type", named, sizeof(named), &given));
  if (given) PetscCall(PetscOptionsSetValue(NULL, option, t->type));
  HycoFinally(TaoSetFromOptions(t->tao), if (given) PetscCall(PetscOptionsSetValue(NULL, option, named)));
  if (!t->quiet) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TaoMonitorCancel(t->tao));
  t->tao->printreason = PETSC_FALSE;
  PetscCall(PetscOptionsHasName(NULL, t->prefix, "-tao_view", &given)); /* read here too, so that the check of
                                                                           options finds it used */
  PetscCall(PetscObjectSetOptionsPrefix((PetscObject)t->tao, "hyco_quiet_"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of iterations without halving the residual after which a run ends: small if the residual is small,
   where round-off dominates; larger above, and for first-order types, which may stagnate for a while. */
static PetscInt TaoStallLimit(const HycoTao t)
{
  /* The scaled problem has a size of one: this is its round-off. */
  if (t->best <= 1e-10) return 5;
  return t->traits & HYCO_TAO_NEWTON && t->best <= 1e-8 ? 20 : 300;
}

/* 1/2 y^T H y - f^T y and H y - f, by one product. */
static PetscErrorCode TaoObjective(Tao tao, Vec y, PetscReal *value, Vec gradient, void *ctx)
{
  HycoTao t = (HycoTao)ctx;
  PetscScalar yHy, fy;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(t->H, y, gradient));
  PetscCall(VecDot(y, gradient, &yHy));
  PetscCall(VecDot(y, t->F, &fy));
  PetscCall(VecAXPY(gradient, -1, t->F));
  /* The product with H is needed for the gradient anyway. */
  *value = yHy / 2 - fy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H is set by TaoSetHessian() and the same at all y. */
static PetscErrorCode TaoHessian(Tao tao, Vec y, Mat H, Mat P, void *ctx)
{
  PetscFunctionBegin;
  (void)tao, (void)y, (void)H, (void)P, (void)ctx; /* constant */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = M z - f. w and z are complementary: TAO's form of the problem. */
static PetscErrorCode TaoSlack(Tao tao, Vec z, Vec w, void *ctx)
{
  HycoTao t = (HycoTao)ctx;

  PetscFunctionBegin;
  (void)tao;
  PetscCall(MatMult(t->H, z, w));
  PetscCall(VecAXPY(w, -1, t->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The types overwrite J by their Newton matrix: each call restores M. */
static PetscErrorCode TaoJacobian(Tao tao, Vec z, Mat J, Mat P, void *ctx)
{
  HycoTao t = (HycoTao)ctx;

  PetscFunctionBegin;
  (void)tao, (void)z, (void)P;
  PetscCall(MatCopy(t->H, J, SAME_NONZERO_PATTERN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TAO's own test; also ends iterations at round-off level or without progress. */
static PetscErrorCode TaoConverged(Tao tao, void *ctx)
{
  HycoTao t = (HycoTao)ctx;
  TaoConvergedReason why;
  PetscInt it;
  PetscReal residual;

  PetscFunctionBegin;
  /* First: it has the user's tolerances and the limit of iterations. */
  PetscCall(TaoDefaultConvergenceTest(tao, NULL));
  PetscCall(TaoGetSolutionStatus(tao, &it, NULL, &residual, NULL, NULL, &why));
  if (why != TAO_CONTINUE_ITERATING) PetscFunctionReturn(PETSC_SUCCESS);
  if (residual <= t->best / 2) {
    t->best = residual;
    t->best_at = it;
  } else if (it - t->best_at >= TaoStallLimit(t))
    PetscCall(TaoSetConvergedReason(tao, t->best <= 1e-10 ? TAO_CONVERGED_USER : TAO_DIVERGED_USER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `krylov`: without a factor, because H is singular (dependent contacts). Tolerances near round-off: the problem is
   scaled to size one. */
static PetscErrorCode SetBoundProblem(HycoTao t, PetscBool krylov)
{
  PetscBool shell;
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(TaoSetObjectiveAndGradient(t->tao, NULL, TaoObjective, t));
  PetscCall(TaoSetHessian(t->tao, t->H, t->H, TaoHessian, NULL));
  /* 0 for the last: the initial residual may be as small as the solution's. */
  PetscCall(TaoSetTolerances(t->tao, 1e-13, 1e-14, 0));
  PetscCall(PetscObjectTypeCompare((PetscObject)t->H, MATSHELL, &shell));
  PetscCall(TaoGetKSP(t->tao, &ksp));
  if ((shell || krylov) && ksp) { /* a shell matrix has no entries for a preconditioner */
    PC pc;

    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCNONE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* LU of the Newton matrix, or GMRES where that is singular. */
static PetscErrorCode SetComplementarity(HycoTao t, PetscBool krylov)
{
  KSP ksp;
  PC pc;

  PetscFunctionBegin;
  if (!t->w) PetscCall(VecDuplicate(t->F, &t->w));
  /* TAO's semismooth types scale the Jacobian in place: H must stay. */
  if (!t->J) PetscCall(MatDuplicate(t->H, MAT_COPY_VALUES, &t->J));
  PetscCall(TaoSetConstraintsRoutine(t->tao, t->w, TaoSlack, t));
  PetscCall(TaoSetJacobianRoutine(t->tao, t->J, t->J, TaoJacobian, t));
  PetscCall(TaoSetTolerances(t->tao, 0, 0, 0));
  PetscCall(TaoSetFunctionLowerBound(t->tao, 1e-12)); /* its default, 1e-8, is too coarse; with 1e-20 it does not
                                                         stop */
  PetscCall(TaoGetKSP(t->tao, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, krylov ? PCNONE : PCLU));
  PetscCall(KSPSetType(ksp, krylov ? KSPGMRES : KSPPREONLY));
  if (krylov) PetscCall(KSPGMRESSetRestart(ksp, PetscMin(t->N, 200)));
  if (krylov) PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 2 * t->N));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of a run that may fail inside TAO. Options and callbacks are set once for a Tao; H is the caller's at
   each call. */
static PetscErrorCode TaoRun(HycoTao t, Vec lo, Vec hi, Vec y, PetscBool krylov, PetscInt *its, PetscBool *solved)
{
  TaoConvergedReason why;
  PetscBool made;

  PetscFunctionBegin;
  PetscCall(TaoPrepare(t, y, t->max_its ? t->max_its : 2000, &made));
  PetscCall(TaoSetSolution(t->tao, y));
  PetscCall(TaoSetVariableBounds(t->tao, lo, hi));
  /* The same test for all types, on the scaled residual. */
  if (made) PetscCall(TaoSetConvergenceTest(t->tao, TaoConverged, t));
  if (t->traits & HYCO_TAO_SEMISMOOTH) {
    if (made) PetscCall(SetComplementarity(t, krylov));
  } else if (made)
    PetscCall(SetBoundProblem(t, krylov));
  else
    PetscCall(TaoSetHessian(t->tao, t->H, t->H, TaoHessian, NULL));
  if (made) {
    PetscErrorCode caught;
    char said[HYCO_LINE];

    HycoCatch(ReadOptions(t), caught, said);
    if (caught) HycoFailAs(HYCO_ERR_VALUE, "an option -%stao_... is refused: %s", t->prefix, said);
  }
  /* Stagnation is counted from here. */
  t->best = PETSC_MAX_REAL;
  t->best_at = 0;
  PetscCall(TaoSolve(t->tao));
  PetscCall(TaoGetConvergedReason(t->tao, &why));
  PetscCall(TaoGetIterationNumber(t->tao, its));
  *solved = (PetscBool)(why > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = d size y', lo and hi likewise; f' = d f / size; H' = d H d: unit diagonal, max |f'| = 1. Infinite bounds are
   kept. Diagonal entries below 1e-8 of the largest are raised, so that the scaling stays finite. */
static PetscErrorCode TaoScale(Mat H, Vec f, Vec lo, Vec hi, Vec y, Vec d, PetscReal *size)
{
  PetscInt n;
  PetscScalar *v[5];
  Vec all[5];
  PetscReal mine = 0, largest = 0, most;

  PetscFunctionBegin;
  /* One loop over the five arrays; d is filled by it. */
  all[0] = f, all[1] = lo, all[2] = hi, all[3] = y, all[4] = d;
  PetscCall(MatGetDiagonal(H, d));
  PetscCall(VecNorm(d, NORM_INFINITY, &most));
  PetscCall(VecGetLocalSize(d, &n));
  for (int k = 0; k < 5; k++) PetscCall(VecGetArray(all[k], &v[k]));
  for (PetscInt i = 0; i < n; i++) {
    v[4][i] = most > 0 ? 1 / PetscSqrtReal(PetscMax(PetscAbsReal(v[4][i]), 1e-8 * most)) : 1;
    mine = PetscMax(mine, PetscMax(PetscAbsReal(v[0][i] * v[4][i]), PetscAbsReal(v[3][i] / v[4][i])));
  }
  PetscCallMPI(MPI_Allreduce(&mine, &largest, 1, MPIU_REAL, MPI_MAX, PetscObjectComm((PetscObject)d)));
  *size = largest > 0 ? largest : 1;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal unit = v[4][i] * *size;

    v[0][i] *= v[4][i] / *size;
    if (v[1][i] > PETSC_NINFINITY) v[1][i] /= unit;
    if (v[2][i] < PETSC_INFINITY) v[2][i] /= unit;
    v[3][i] /= unit;
  }
  for (int k = 0; k < 5; k++) PetscCall(VecRestoreArray(all[k], &v[k]));
  PetscCall(MatDiagonalScale(H, d, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char failure[HYCO_LINE];

const char *HycoTaoFailure(void)
{
  return failure;
}

/* One run of TAO from y; after an error inside it, sets *failed and destroys its Tao. y is finite at the end. TAO's
   errors are caught: a type may divide by zero or meet a singular matrix. A failed Tao is not used again. */
static PetscErrorCode CatchRun(HycoTao t, Vec lo, Vec hi, Vec y, PetscBool krylov, PetscInt *its, PetscBool *solved,
                               PetscBool *failed)
{
  PetscReal norm;
  PetscErrorCode caught;
  char message[HYCO_LINE];

  PetscFunctionBegin;
  *its = 0;
  *solved = PETSC_FALSE;
  PetscCall(HycoCatchBegin());
  caught = TaoRun(t, lo, hi, y, krylov, its, solved);
  /* After a failure its state is unknown; a Krylov solve was set up for this problem alone. */
  if (caught || !*solved || krylov) {
    const PetscErrorCode more = TaoDestroy(&t->tao);

    if (caught) t->tao = NULL;
    if (!caught) caught = more;
  }
  PetscCall(HycoCatchEnd(caught, message));
  if (caught == HYCO_ERR_VALUE) HycoFailAs(caught, "%s", message); /* the user's, not the problem's */
  if (caught) HycoFormat(failure, "TAO's %s failed: %s", t->type, message);
  if (caught) *solved = PETSC_FALSE;
  *failed = (PetscBool)(caught != 0);
  PetscCall(VecNorm(y, NORM_2, &norm));
  if (PetscIsInfOrNanReal(norm)) PetscCall(VecSet(y, 0));
  /* TAO may stop at an iterate outside the bounds by round-off. */
  PetscCall(VecMedian(lo, y, hi, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* | y - median(lo, y - (H y - f), hi) |, 0 at the solution. For the choice between two results. */
static PetscErrorCode TaoProjected(const HycoTao t, Vec lo, Vec hi, Vec y, PetscReal *size)
{
  Vec step;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, &step));
  PetscCall(MatMult(t->H, y, step));
  PetscCall(VecAXPY(step, -1, t->F));
  PetscCall(VecAYPX(step, -1, y));
  /* The projection onto the bounds. */
  PetscCall(VecMedian(lo, step, hi, step));
  PetscCall(VecAXPY(step, -1, y));
  PetscCall(VecNorm(step, NORM_INFINITY, size));
  PetscCall(VecDestroy(&step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton types that stagnate may converge from another start; the better of the two results is kept. */
static PetscErrorCode SecondStart(HycoTao t, Vec lo, Vec hi, Vec y, PetscBool krylov, PetscInt *its, PetscBool *solved)
{
  const PetscInt first_its = *its;
  Vec first;
  PetscReal before, after;
  PetscBool failed;

  PetscFunctionBegin;
  PetscCall(TaoProjected(t, lo, hi, y, &before));
  /* As good as it gets, in spite of TAO's word. */
  if (before < 1e-10) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(y, &first));
  PetscCall(VecCopy(y, first));
  /* The interior: all contacts with a force of the scaled problem's size. */
  PetscCall(VecSet(y, 1));
  PetscCall(VecMedian(lo, y, hi, y));
  PetscCall(CatchRun(t, lo, hi, y, krylov, its, solved, &failed));
  *its += first_its;
  PetscCall(TaoProjected(t, lo, hi, y, &after));
  if (!*solved && !(after < before)) PetscCall(VecCopy(first, y));
  PetscCall(VecDestroy(&first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y: start and solution; H, f, lo and hi are scaled in place and are not restored. *solved is TAO's word, and the
   caller checks. Collective. */
PetscErrorCode HycoTaoSolve(HycoTao t, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its, PetscBool *solved)
{
  PetscReal size = 1;
  PetscBool failed;
  Vec d;

  PetscFunctionBegin;
  t->H = H;
  t->F = f;
  PetscCall(VecDuplicate(y, &d));
  PetscCall(TaoScale(H, f, lo, hi, y, d, &size));
  failure[0] = '\0';
  PetscCall(CatchRun(t, lo, hi, y, PETSC_FALSE, its, solved, &failed));
  /* An error inside TAO, as a factor of a singular Hessian: once more without factors. */
  if (failed) PetscCall(CatchRun(t, lo, hi, y, PETSC_TRUE, its, solved, &failed));
  if (!*solved && t->traits & HYCO_TAO_RESTARTS) PetscCall(SecondStart(t, lo, hi, y, failed, its, solved));
  /* Back from the scaled unknowns. */
  PetscCall(VecPointwiseMult(y, y, d));
  PetscCall(VecScale(y, size));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bounds of a dense problem's z: none of its p free unknowns and of blocks whose law is no sign, 0 and infinity of
   the others. They are kept with the Tao. */
static PetscErrorCode SetForceBounds(HycoTao t, Vec z)
{
  const HycoBlocks *blocks = t->lcp->blocks;
  Vec lo, hi;
  PetscScalar *l;

  PetscFunctionBegin;
  /* Unchanged: an online solve of microseconds must not make vectors. */
  if (t->tao->XL && !blocks && t->n_free == t->lcp->p) PetscFunctionReturn(PETSC_SUCCESS);
  HycoVecDuplicate(z, &lo, &hi);
  PetscCall(VecSet(hi, PETSC_INFINITY));
  PetscCall(VecGetArrayWrite(lo, &l));
  /* Motions are free, forces not negative. */
  for (PetscInt i = 0; i < t->lcp->p + t->lcp->n; i++) l[i] = i < t->lcp->p ? PETSC_NINFINITY : 0;
  for (PetscInt k = 0; blocks && k < blocks->n; k++) {
    for (PetscInt i = blocks->row[k]; i < blocks->row[k + 1] && !blocks->cone[blocks->of[k]]->nonnegative; i++)
      l[t->lcp->p + i] = PETSC_NINFINITY;
  }
  PetscCall(VecRestoreArrayWrite(lo, &l));
  PetscCall(TaoSetVariableBounds(t->tao, lo, hi));
  t->n_free = blocks ? -1 : t->lcp->p;
  HycoDestroyAll(&lo, &hi);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves by hyco's own types, unscaled; y: the Tao's solution. Compared with a direct call, an online solve of the
   rope's models (the smallest ones) takes 1 us more, of 10 to 15 us. */
static PetscErrorCode SolveOwn(HycoTao t, Vec hi, Vec y, PetscInt max_its)
{
  PetscBool made;

  PetscFunctionBegin;
  PetscCall(TaoPrepare(t, y, max_its, &made));
  if (made) PetscCall(ReadOptions(t));
  if (t->set)
    PetscCall(TaoSetVariableBounds(t->tao, NULL, hi));
  else
    PetscCall(SetForceBounds(t, y));
  PetscCall(TaoSetMaximumIterations(t->tao, max_its)); /* -hyco_tao_max_it is for TAO's types, which this type may
                                                          replace as a fallback */
  PetscCall(TaoSetSolution(t->tao, y));
  PetscCall(TaoSolve(t->tao));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* hyco's active set with the functions of a form. Collective. */
PetscErrorCode HycoTaoSolveSet(HycoTao t, const HycoActiveSet *set, PetscBool active[], Vec hi, Vec y, PetscInt *its,
                               HycoLCPStatus *status)
{
  PetscFunctionBegin;
  /* The form solves on a set itself: there is no dense problem. */
  t->lcp = NULL;
  t->set = set;
  t->active = active;
  t->monitor = set->monitor;
  t->monitor_ctx = set->monitor_ctx;
  PetscCall(SolveOwn(t, hi, y, set->max_its));
  PetscCall(TaoSetVariableBounds(t->tao, NULL, NULL)); /* hi is as large as y: not kept */
  *its = t->its;
  *status = t->status;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each pair (z_i, w_i) sets the smaller to 0: interior and first-order types leave small forces at open gaps.
   Positive forces at clearly open gaps would count as active contacts. */
static void TaoClean(const HycoLCP *lcp, PetscReal z[])
{
  const PetscInt n = lcp->n;
  PetscReal size_z = 0, size_q = 0;

  for (PetscInt i = 0; i < n; i++) {
    size_z = PetscMax(size_z, PetscAbsReal(z[i]));
    size_q = PetscMax(size_q, PetscAbsReal(lcp->q[i]));
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscReal w = lcp->q[i];

    /* Only small forces are doubtful; larger ones are judged by the residuals. */
    if (z[i] == 0 || z[i] > 1e-9 * size_z) continue;
    for (PetscInt j = 0; j < n; j++) w += lcp->M[(size_t)j * (size_t)n + (size_t)i] * z[j];
    if (w * size_z > z[i] * size_q) z[i] = 0;
  }
}

/* Makes copies of M, -q and the bounds, for TAO's types, which overwrite and scale their matrix. start NULL: 0. */
static PetscErrorCode CopyDense(HycoTao t, const HycoLCP *lcp, const PetscReal start[])
{
  PetscScalar *h;
  PetscInt n = -1;

  PetscFunctionBegin;
  if (t->dense) PetscCall(MatGetSize(t->dense, &n, NULL));
  if (n != lcp->n) {
    PetscCall(TaoReset(t));
    PetscCall(ResetDense(t));
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, lcp->n, lcp->n, NULL, &t->dense));
    PetscCall(MatCreateVecs(t->dense, &t->y, &t->f));
    HycoVecDuplicate(t->y, &t->lo, &t->hi);
  }
  PetscCall(MatDenseGetArray(t->dense, &h));
  PetscCall(PetscArraycpy(h, lcp->M, (size_t)lcp->n * (size_t)lcp->n));
  PetscCall(MatDenseRestoreArray(t->dense, &h));
  PetscCall(HycoMatAssemble(t->dense));
  /* The matrix is used again for a problem of the same size, which may have another symmetry. */
  PetscCall(MatSetOption(t->dense, MAT_SYMMETRIC, lcp->symmetric));
  if (start)
    PetscCall(HycoVecWrite(t->y, lcp->n, start));
  else
    PetscCall(VecSet(t->y, 0));
  PetscCall(VecSet(t->lo, 0));
  PetscCall(VecSet(t->hi, PETSC_INFINITY));
  PetscCall(VecGetArray(t->f, &h));
  for (PetscInt i = 0; i < lcp->n; i++) h[i] = -lcp->q[i];
  PetscCall(VecRestoreArray(t->f, &h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the solution vector of hyco's own types, with z as its array. No copy of z: an online solve takes some
   microseconds. */
static PetscErrorCode PlaceSolution(HycoTao t, PetscInt n, PetscReal z[])
{
  PetscInt old = -1;

  PetscFunctionBegin;
  if (t->placed) PetscCall(VecGetSize(t->placed, &old));
  if (old != n) {
    /* A Tao of PETSc 3.18 keeps the size of its first solution. */
    PetscCall(TaoReset(t));
    PetscCall(VecDestroy(&t->placed));
    PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, NULL, &t->placed));
  }
  PetscCall(VecPlaceArray(t->placed, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bodies' problem with springs, from the forces before the springs moved. */
static PetscErrorCode TaoSolveHeld(void *ctx, const HycoLCP *held, PetscReal L[], PetscInt *its)
{
  HycoTao t = (HycoTao)ctx;
  PetscInt more = 0;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(CopyDense(t, held, L));
  PetscCall(HycoTaoSolve(t, t->dense, t->f, t->lo, t->hi, t->y, &more, &solved));
  PetscCall(HycoVecRead(t->y, held->n, L));
  TaoClean(held, L);
  *its += more;
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define STIFF 1 /* of springs relative to a contact: softer ones need fewer problems of more iterations each */

/* TAO's types know forces alone: those of bodies that springs hold, which are moved until they carry nothing. */
static PetscErrorCode TaoSolveFree(HycoTao t, const HycoLCP *lcp, PetscReal z[], PetscInt *its, PetscBool *solved)
{
  const HycoHeldMethod method = {TaoSolveHeld, t, STIFF};
  PetscBool *active;
  HycoLCPStatus status;

  PetscFunctionBegin;
  PetscCheck(lcp->symmetric, PETSC_COMM_SELF, PETSC_ERR_SUP, "TAO's types need a symmetric problem of free unknowns");
  *its = 0;
  PetscCall(PetscCalloc1(lcp->n + 1, &active));
  PetscCall(HycoLCPProximal(lcp, &method, active, z, its, &status));
  *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  PetscCall(PetscFree(active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A dense problem on one process (or alike on every rank), by hyco's or TAO's types. active: start and result of the
   active set, unused by others. */
PetscErrorCode HycoTaoSolveLCP(HycoTao t, const HycoLCP *lcp, PetscBool active[], PetscReal z[], PetscInt *its,
                               PetscBool *solved)
{
  const PetscInt limit = t->max_its ? t->max_its : 50 + 4 * lcp->n;

  PetscFunctionBegin;
  if (t->traits & HYCO_TAO_OWN) {
    t->lcp = lcp;
    t->set = NULL;
    t->z = z;
    t->active = active;
    t->monitor = lcp->monitor;
    t->monitor_ctx = lcp->monitor_ctx;
    PetscCall(PlaceSolution(t, lcp->p + lcp->n, z));
    PetscCall(SolveOwn(t, NULL, t->placed, t->traits & HYCO_TAO_DENSE ? 50 * (lcp->n + 10) : limit));
    /* Before z goes out of scope in the caller. */
    PetscCall(VecResetArray(t->placed));
    *its = t->its;
    *solved = (PetscBool)(t->status == HYCO_LCP_SOLVED);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (lcp->p) {
    PetscCall(TaoSolveFree(t, lcp, z, its, solved));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CopyDense(t, lcp, NULL));
  PetscCall(HycoTaoSolve(t, t->dense, t->f, t->lo, t->hi, t->y, its, solved));
  PetscCall(HycoVecRead(t->y, lcp->n, z));
  TaoClean(lcp, z);
  PetscFunctionReturn(PETSC_SUCCESS);
}
