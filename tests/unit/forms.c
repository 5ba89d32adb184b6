/* Forms of HycoSolver: a system with a given flexibility, a dense and a sparse K, and a form that the program
   registers. */
#include "check.h"
#include <hycosolverimpl.h>
#include <petsc/private/taoimpl.h>

/* w = g + G L with G = (2 1; 1 2) scale, g = (-1, 1): L = (1/2, 0) / scale, w = (0, 3/2). */
static PetscErrorCode TestFlexibility(void)
{
  const char *const types[] = {HYCO_SOLVER_ACTIVE_SET, HYCO_SOLVER_TAO, HYCO_SOLVER_LEMKE};
  const char *const words[] = {"active_set condensed", "tao gpcg condensed", "lemke condensed"};
  PetscScalar G[] = {2, 1, 1, 2}, g[] = {-1, 1}, L[2];
  Mat matrix;
  Vec free_gap, forces;
  HycoSystem system;
  HycoSolver solver;
  HycoKKT kkt;
  HycoReason reason;
  const char *method;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 2, 2, G, &matrix));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, 2, g, &free_gap));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, 2, L, &forces));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSystemSetFlexibility(system, matrix, free_gap));
  L[0] = 0.25; /* w = (-1/2, 5/4): penetration of half of the size of g, with a force */
  L[1] = 0;
  PetscCall(HycoSystemComputeKKT(system, NULL, forces, &kkt));
  CHECK_NEAR(kkt.stationarity, 0, 0);
  CHECK_NEAR(kkt.penetration, 0.5, 1e-15);
  CHECK_NEAR(kkt.adhesion, 0, 0);
  CHECK_NEAR(kkt.complementarity, 0.5, 1e-15);
  for (int t = 0; t < 3; t++) {
    PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
    PetscCall(HycoSolverSetSystem(solver, system));
    PetscCall(HycoSolverSetType(solver, types[t]));
    for (int scale = 1; scale <= 2; scale++) { /* a stored factor must not be used after G has changed */
      PetscCall(MatScale(matrix, scale));
      PetscCall(HycoSolverSolve(solver, NULL, forces));
      PetscCall(HycoSolverGetReason(solver, &reason));
      PetscCall(HycoSolverGetMethod(solver, &method));
      CHECK(reason == HYCO_CONVERGED && strcmp(method, words[t]) == 0, "%s: %s", method, HycoReasonName(reason));
      CHECK_NEAR(L[0], 0.5 / scale, 1e-12);
      CHECK_NEAR(L[1], 0, 0);
    }
    PetscCall(MatScale(matrix, 0.5));
    PetscCall(HycoSolverDestroy(&solver));
  }
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(VecDestroy(&free_gap));
  PetscCall(VecDestroy(&forces));
  PetscCall(MatDestroy(&matrix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One solver for a dense and a sparse K = 2, 4: the former factor must not serve the latter. A factor that is kept is
   named as well as a new one. */
static PetscErrorCode TestFactors(void)
{
  Mat K[2];
  Vec F, x;
  HycoSystem system;
  HycoSolver solver;
  HycoReason reason;
  const char *linear;
  const PetscScalar *value;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 1, 1, NULL, &K[0]));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, NULL, &K[1]));
  PetscCall(MatCreateVecs(K[0], &x, &F));
  PetscCall(VecSet(F, 8));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  for (int k = 0; k < 2; k++) {
    PetscCall(MatSetValue(K[k], 0, 0, 2 + 2 * k, INSERT_VALUES));
    PetscCall(MatAssemblyBegin(K[k], MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(K[k], MAT_FINAL_ASSEMBLY));
    PetscCall(HycoSystemSetMatrices(system, K[k], NULL, NULL, PETSC_TRUE));
    PetscCall(HycoSystemSetVectors(system, F, NULL));
    for (int again = 0; again < 2; again++) {
      PetscCall(HycoSolverSolve(solver, x, NULL));
      PetscCall(HycoSolverGetReason(solver, &reason));
      PetscCall(HycoSolverGetLinear(solver, &linear));
      PetscCall(VecGetArrayRead(x, &value));
      CHECK(reason == HYCO_CONVERGED, "K %d: %s", k, HycoReasonName(reason));
      CHECK_NEAR(value[0], 4. / (1 + k), 1e-14);
      PetscCall(VecRestoreArrayRead(x, &value));
      CHECK(!k || strncmp(linear, "direct: mumps", 13) == 0, "solve %d: \"%s\"", again, linear);
    }
  }
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSystemDestroy(&system));
  for (int k = 0; k < 2; k++) PetscCall(MatDestroy(&K[k]));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its result for everything: data[0] is x and L. */
static PetscErrorCode SolveMine(HycoSolver s, HycoSolverForm form, Vec x, Vec L, PetscBool *solved)
{
  PetscFunctionBegin;
  PetscCall(VecSet(x, *(PetscReal *)form->data));
  PetscCall(VecSet(L, *(PetscReal *)form->data));
  s->its = 1;
  s->by_factor = PETSC_FALSE; /* a wrong result does not mean that K is singular */
  *solved = PETSC_TRUE;
  PetscCall(HycoSolverNameMethod(s, form->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AcceptsMine(HycoSolver s, HycoSolverForm form, PetscBool asked, PetscReal *cost,
                                  char why[HYCO_LINE])
{
  PetscFunctionBegin;
  (void)form, (void)asked;
  *cost = s->system->K && !(s->now.traits & HYCO_TAO_DENSE) ? 0.5 : -1;
  if (*cost < 0) HycoFormat(why, "mine takes no dense matrix");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal answer = 1;

static PetscErrorCode CreateMine(HycoSolver s, HycoSolverForm form)
{
  PetscFunctionBegin;
  (void)s;
  form->data = &answer;
  form->ops->accepts = AcceptsMine;
  form->ops->solve = SolveMine;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x + L = 2, x <= 1; the system has the only references to its matrices and F, D. */
static PetscErrorCode OneContact(HycoSystem *system, Vec *x, Vec *L)
{
  Mat K;
  Vec F, D;

  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, NULL, &K));
  PetscCall(MatSetValue(K, 0, 0, 1, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(K, &F, &D));
  PetscCall(VecDuplicate(F, x));
  PetscCall(VecDuplicate(D, L));
  PetscCall(VecSet(F, 2));
  PetscCall(VecSet(D, 1));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, system));
  PetscCall(HycoSystemSetMatrices(*system, K, K, K, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(*system, F, D));
  PetscCall(MatDestroy(&K));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x + L = 2, x <= 1: x = L = 1. The cheapest form is chosen; after a wrong result the next method is tried, on
   another form if this one does not accept it. */
static PetscErrorCode TestRegistered(void)
{
  static const struct {
    PetscReal answer;
    HycoForm form;
    HycoReason reason;
    const char *method;
  } cases[] = {
      {1, HYCO_FORM_AUTO, HYCO_CONVERGED, "active_set mine"},
      {3, HYCO_FORM_AUTO, HYCO_CONVERGED_FALLBACK, "active_set mine, then tao gpcg, then tao tron, then lemke"},
      {3, HYCO_FORM_DUAL, HYCO_CONVERGED, "active_set dual"}};
  Vec x, L;
  HycoSystem system;
  HycoReason reason;
  const char *method;

  PetscFunctionBegin;
  PetscCall(HycoSolverRegister("mine", CreateMine));
  PetscCall(OneContact(&system, &x, &L));
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    HycoSolver solver;

    answer = cases[k].answer;
    PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
    PetscCall(HycoSolverSetSystem(solver, system));
    PetscCall(HycoSolverSetForm(solver, cases[k].form));
    PetscCall(HycoSolverSolve(solver, x, L));
    PetscCall(HycoSolverGetReason(solver, &reason));
    PetscCall(HycoSolverGetMethod(solver, &method));
    CHECK(reason == cases[k].reason && strcmp(method, cases[k].method) == 0, "case %d: %s, %s", (int)k, method,
          HycoReasonName(reason));
    PetscCall(HycoSolverDestroy(&solver));
  }
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A type of Tao of the library, whose bounds this test reads, and moves inwards by `moved`. */
static struct {
  PetscErrorCode (*create)(Tao), (*solve)(Tao);
  PetscReal moved, lo, hi, found; /* the bounds as the form has set them; the first solution of a run */
  PetscInt runs;
} watched;

static PetscErrorCode SolveWatched(Tao tao)
{
  Vec lo = tao->XL, hi = tao->XU, bound[2];
  const PetscReal by[] = {watched.moved, -watched.moved};
  PetscReal found;

  PetscFunctionBegin;
  watched.lo = PETSC_NINFINITY;
  watched.hi = PETSC_INFINITY;
  if (lo) PetscCall(VecMin(lo, NULL, &watched.lo));
  if (hi) PetscCall(VecMax(hi, NULL, &watched.hi));
  PetscCall(PetscObjectReference((PetscObject)lo));
  PetscCall(PetscObjectReference((PetscObject)hi));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecDuplicate(tao->solution, &bound[k]));
    PetscCall(VecSet(bound[k], (k ? watched.hi : watched.lo) + by[k]));
  }
  PetscCall(TaoSetVariableBounds(tao, bound[0], bound[1]));
  PetscCall(watched.solve(tao));
  PetscCall(TaoSetVariableBounds(tao, lo, hi));
  PetscCall(VecSum(tao->solution, &found));
  if (!watched.runs++) watched.found = found;
  for (int k = 0; k < 2; k++) PetscCall(VecDestroy(&bound[k]));
  PetscCall(VecDestroy(&lo));
  PetscCall(VecDestroy(&hi));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateWatched(Tao tao)
{
  PetscFunctionBegin;
  PetscCall(watched.create(tao));
  watched.solve = tao->ops->solve;
  tao->ops->solve = SolveWatched;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x + L = 2, x <= 1, or with a flexibility: each form sets the bounds of its unknown, force or B x, on the Tao, and
   the library's types read them there: with another bound there is another solution. */
static PetscErrorCode TestBounds(void)
{
  static const struct {
    const char *tao, *type;
    const char *form;
    PetscReal lo, hi, moved, expected;
  } cases[] = {{HYCO_TAO_ACTIVE_SET, HYCO_SOLVER_ACTIVE_SET, "dual", 0, PETSC_INFINITY, 1.5, 1.5},
               {HYCO_TAO_ACTIVE_SET, HYCO_SOLVER_ACTIVE_SET, "dual", 0, PETSC_INFINITY, 0.5, 1},
               {HYCO_TAO_LEMKE, HYCO_SOLVER_LEMKE, "dual", 0, PETSC_INFINITY, 1.5, 1.5},
               {HYCO_TAO_LEMKE, HYCO_SOLVER_LEMKE, "dual", 0, PETSC_INFINITY, 0.5, 1},
               {HYCO_TAO_ACTIVE_SET, HYCO_SOLVER_ACTIVE_SET, "primal", PETSC_NINFINITY, 1, 0.25, 0.75},
               {HYCO_TAO_ACTIVE_SET, HYCO_SOLVER_ACTIVE_SET, "projected", PETSC_NINFINITY, 1, 0.25, 0.75}};
  Vec x, L;
  HycoSystem system;

  PetscFunctionBegin;
  PetscCall(OneContact(&system, &x, &L));
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    HycoSolver solver;

    PetscCall(PetscFunctionListFind(TaoList, cases[k].tao, &watched.create));
    PetscCall(TaoRegister(cases[k].tao, CreateWatched));
    watched.moved = cases[k].moved;
    watched.runs = 0;
    PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
    PetscCall(HycoSolverSetSystem(solver, system));
    PetscCall(HycoSolverSetType(solver, cases[k].type));
    PetscCall(PetscStrncpy(solver->form_name, cases[k].form, sizeof(solver->form_name)));
    if (strcmp(cases[k].form, "projected") == 0) PetscCall(HycoSolverSetLinear(solver, HYCO_LINEAR_ITERATIVE, 0));
    PetscCall(HycoSolverSolve(solver, x, L));
    CHECK(watched.runs && watched.lo == cases[k].lo && watched.hi == cases[k].hi, "case %d: %d runs, bounds %g, %g",
          (int)k, (int)watched.runs, watched.lo, watched.hi);
    CHECK_NEAR(watched.found, cases[k].expected, 1e-9);
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(TaoRegister(cases[k].tao, watched.create));
  }
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestFactors());
  PetscCall(TestFlexibility());
  PetscCall(TestRegistered());
  PetscCall(TestBounds());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
