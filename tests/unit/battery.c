/*
  Every complementarity method through HycoSolver on every class of problems. The table `rules` defines which method is
  suitable for which class: a suitable one must find the known solution alone, to the tolerance; an unsuitable one must
  report this (a refusal, or not converged), and never return another result. The results are written as a table:
  battery.csv, one column for each class.
*/
#include "check.h"
#include <fnmatch.h>
#include <hycosolver.h>
#include <math.h>
#include <petscblaslapack.h>
#include <stdlib.h>

static const PetscInt sizes[] = {1, 2, 3, 5, 10, 50, 200, 500, 2000};
#define N_SIZES ((int)(sizeof(sizes) / sizeof(sizes[0])))

/* -- problems -- */

typedef struct {
  MPI_Comm comm;
  Mat K, B, Bt;
  Vec F, D, x, L, reference; /* reference: the displacements, known or (unknown) of the first method that converged */
  PetscBool known;
  HycoSystem system;
} Problem;

static PetscErrorCode Finish(Problem *p, PetscBool symmetric)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(p->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(p->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyBegin(p->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(p->B, MAT_FINAL_ASSEMBLY));
  if (!p->Bt) PetscCall(MatTranspose(p->B, MAT_INITIAL_MATRIX, &p->Bt));
  PetscCall(HycoSystemCreate(p->comm, &p->system));
  PetscCall(HycoSystemSetMatrices(p->system, p->K, p->Bt, p->B, symmetric));
  PetscCall(MatCreateVecs(p->K, &p->x, &p->F));
  PetscCall(VecDuplicate(p->x, &p->reference));
  PetscCall(MatCreateVecs(p->Bt, &p->L, NULL));
  PetscCall(VecDuplicate(p->L, &p->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProblemDestroy(Problem *p)
{
  PetscFunctionBegin;
  PetscCall(HycoSystemDestroy(&p->system));
  PetscCall(MatDestroy(&p->K));
  PetscCall(MatDestroy(&p->B));
  PetscCall(MatDestroy(&p->Bt));
  PetscCall(VecDestroy(&p->F));
  PetscCall(VecDestroy(&p->D));
  PetscCall(VecDestroy(&p->x));
  PetscCall(VecDestroy(&p->L));
  PetscCall(VecDestroy(&p->reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constructs a problem from its solution: x, forces L and open gaps w (one of the two zero); F = K x + Bt L, D = B x
   + w. */
static PetscErrorCode Choose(Problem *p, PetscReal (*force)(PetscInt), PetscReal (*open)(PetscInt))
{
  PetscInt lo, hi;
  Vec w;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(p->reference, &lo, &hi));
  for (PetscInt i = lo; i < hi; i++)
    PetscCall(VecSetValue(p->reference, i, sin(1 + 0.7 * (double)i) + cos(0.05 * (double)i), INSERT_VALUES));
  PetscCall(VecGetOwnershipRange(p->L, &lo, &hi));
  PetscCall(VecDuplicate(p->L, &w));
  for (PetscInt i = lo; i < hi; i++) {
    PetscCall(VecSetValue(p->L, i, force(i), INSERT_VALUES));
    PetscCall(VecSetValue(w, i, open(i), INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(p->L));
  PetscCall(VecAssemblyEnd(p->L));
  PetscCall(VecAssemblyBegin(w));
  PetscCall(VecAssemblyEnd(w));
  PetscCall(VecAssemblyBegin(p->reference));
  PetscCall(VecAssemblyEnd(p->reference));
  PetscCall(MatMult(p->K, p->reference, p->F));
  PetscCall(MatMultAdd(p->Bt, p->L, p->F, p->F));
  PetscCall(MatMultAdd(p->B, p->reference, w, p->D));
  PetscCall(VecDestroy(&w));
  p->known = PETSC_TRUE;
  PetscCall(HycoSystemSetVectors(p->system, p->F, p->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Size(PetscInt i)
{
  return 1.2 + sin(3.1 * (double)i);
}

/* Every second contact has a force, the others are open. */
static PetscReal Force(PetscInt i)
{
  return i % 2 == 0 ? Size(i) : 0;
}

static PetscReal Open(PetscInt i)
{
  return i % 2 == 0 ? 0 : Size(i);
}

/* One third has a force, one third is open, one third neither: closed without force. */
static PetscReal ForceThird(PetscInt i)
{
  return i % 3 == 0 ? Size(i) : 0;
}

static PetscReal OpenThird(PetscInt i)
{
  return i % 3 == 1 ? Size(i) : 0;
}

static PetscErrorCode Dense(PetscInt rows, PetscInt cols, Mat *A, PetscScalar **a)
{
  PetscFunctionBegin;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, rows, cols, NULL, A));
  PetscCall(MatDenseGetArray(*A, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nonsymmetric through Bt: K = 2 I, B = I, Bt = 2 M, so that B K^-1 Bt = M. */
static PetscErrorCode Nonsymmetric(PetscInt n, PetscErrorCode (*fill)(PetscInt, PetscScalar[]), Problem *p)
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(Dense(n, n, &p->K, &a));
  for (PetscInt i = 0; i < n; i++) a[i * n + i] = 2;
  PetscCall(MatDenseRestoreArray(p->K, &a));
  PetscCall(Dense(n, n, &p->B, &a));
  for (PetscInt i = 0; i < n; i++) a[i * n + i] = 1;
  PetscCall(MatDenseRestoreArray(p->B, &a));
  PetscCall(Dense(n, n, &p->Bt, &a));
  PetscCall(fill(n, a));
  for (PetscInt k = 0; k < n * n; k++) a[k] *= 2;
  PetscCall(MatDenseRestoreArray(p->Bt, &a));
  PetscCall(MatAssemblyBegin(p->Bt, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(p->Bt, MAT_FINAL_ASSEMBLY));
  PetscCall(Finish(p, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 0.1 I + R R^T / 5 (R: n x 5) + skew / sqrt(n): positive definite, so a P-matrix (Cottle, Pang, Stone 1992, 3.1.6). */
static PetscErrorCode FillP(PetscInt n, PetscScalar M[])
{
  unsigned long long state = 4711 + (unsigned long long)n;
  PetscReal *R;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(5 * n, &R));
  for (PetscInt k = 0; k < 5 * n; k++) R[k] = Draw(&state);
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i <= j; i++) {
      const PetscReal skew = i == j ? 0 : Draw(&state) / sqrt((double)n);
      PetscReal sum = i == j ? 0.1 : 0;

      for (PetscInt k = 0; k < 5; k++) sum += R[5 * i + k] * R[5 * j + k] / 5;
      M[j * n + i] = sum + skew;
      M[i * n + j] = sum - skew;
    }
  }
  PetscCall(PetscFree(R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeP(PetscInt n, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(Nonsymmetric(n, FillP, p));
  PetscCall(Choose(p, Force, Open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FillMurty(PetscInt n, PetscScalar M[])
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) M[j * n + i] = i == j ? 1 : i > j ? 2 : 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Murty (1978): D - B K^-1 F = -e; solved by the force 1 at the first contact: x = -M L = -(1, 2, ..., 2). */
static PetscErrorCode MakeMurty(PetscInt n, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(Nonsymmetric(n, FillMurty, p));
  PetscCall(VecSet(p->F, 0));
  PetscCall(VecSet(p->D, -1));
  PetscCall(VecSet(p->reference, -2));
  PetscCall(VecSetValue(p->reference, 0, -1, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(p->reference));
  PetscCall(VecAssemblyEnd(p->reference));
  p->known = PETSC_TRUE;
  PetscCall(HycoSystemSetVectors(p->system, p->F, p->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K = I, B = R, so that S = R R^T. */
static PetscErrorCode FromRoot(PetscInt cols, Mat R, Problem *p)
{
  PetscScalar *a;

  PetscFunctionBegin;
  p->B = R;
  PetscCall(Dense(cols, cols, &p->K, &a));
  for (PetscInt i = 0; i < cols; i++) a[i * cols + i] = 1;
  PetscCall(MatDenseRestoreArray(p->K, &a));
  PetscCall(Finish(p, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeSPD(PetscInt n, Problem *p)
{
  unsigned long long state = 99 + (unsigned long long)n;
  PetscScalar *a;
  Mat R;

  PetscFunctionBegin;
  PetscCall(Dense(n, n, &R, &a));
  for (PetscInt k = 0; k < n * n; k++) a[k] = Draw(&state) / sqrt((double)n) + (k % (n + 1) ? 0 : 0.5);
  PetscCall(MatDenseRestoreArray(R, &a));
  PetscCall(FromRoot(n, R, p));
  PetscCall(Choose(p, Force, Open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The half-space (Boussinesq): a patch of points with unit spacing displaces another by 1/distance, itself by 4
   ln(1+sqrt 2) (the mean over its square). R: the Cholesky factor. */
static PetscErrorCode MakeHalfSpace(PetscInt n, Problem *p)
{
  const PetscInt side = (PetscInt)ceil(sqrt((double)n));
  PetscScalar *a;
  PetscBLASInt nb = (PetscBLASInt)n, info;
  Mat R;

  PetscFunctionBegin;
  PetscCall(Dense(n, n, &R, &a));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++)
      a[j * n + i] =
          i == j ? 4 * log(1 + sqrt(2.0)) : 1 / hypot((double)(i / side - j / side), (double)(i % side - j % side));
  }
  LAPACKpotrf_("L", &nb, a, &nb, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the half-space's flexibility is positive definite");
  for (PetscInt j = 1; j < n; j++) {
    for (PetscInt i = 0; i < j; i++) a[j * n + i] = 0;
  }
  PetscCall(MatDenseRestoreArray(R, &a));
  PetscCall(FromRoot(n, R, p));
  PetscCall(Choose(p, Force, Open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact i repeats contact i mod r: with the same gap, or one wider by 0.5. */
static PetscInt repeated_rank;

static PetscReal OpenRepeated(PetscInt i)
{
  const PetscInt base = i % repeated_rank;

  return (base % 2 == 0 ? 0 : Size(base)) + (i >= repeated_rank && base % 3 == 0 ? 0.5 : 0);
}

static PetscReal ForceBase(PetscInt i)
{
  return i < repeated_rank ? Force(i) : 0;
}

static PetscErrorCode MakeRepeated(PetscInt n, Problem *p)
{
  const PetscInt r = PetscMax(1, n / 2);
  unsigned long long state = 7 + (unsigned long long)n;
  PetscScalar *a;
  Mat R;

  PetscFunctionBegin;
  repeated_rank = r;
  PetscCall(Dense(n, r, &R, &a));
  for (PetscInt j = 0; j < r; j++) {
    for (PetscInt i = 0; i < r; i++) a[j * n + i] = Draw(&state) / sqrt((double)r) + (i == j ? 0.5 : 0);
    for (PetscInt i = r; i < n; i++) a[j * n + i] = a[j * n + i % r];
  }
  PetscCall(MatDenseRestoreArray(R, &a));
  PetscCall(FromRoot(r, R, p));
  PetscCall(Choose(p, ForceBase, OpenRepeated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- sparse and distributed -- */

static PetscErrorCode Sparse(MPI_Comm comm, PetscInt rows, PetscInt cols, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(MatCreateAIJ(comm, PETSC_DECIDE, PETSC_DECIDE, rows, cols, 5, NULL, 5, NULL, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Laplacian on a grid, its nodes numbered through the depth first; stiffness 1e5; contacts: the surface. Fixed
   below and at both ends. Depth 1: a string in which every node may touch. */
static PetscErrorCode Grid(PetscInt n, PetscInt depth, PetscInt copies, Problem *p)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  p->comm = PETSC_COMM_WORLD;
  PetscCall(Sparse(p->comm, n * depth, n * depth, &p->K));
  PetscCall(Sparse(p->comm, copies * n, n * depth, &p->B));
  PetscCall(MatGetOwnershipRange(p->K, &lo, &hi));
  for (PetscInt r = lo; r < hi; r++) {
    const PetscInt i = r / depth, j = r % depth;

    PetscCall(MatSetValue(p->K, r, r, depth == 1 ? 2e5 : j == 0 ? 3e5 : 4e5, INSERT_VALUES));
    if (i > 0) PetscCall(MatSetValue(p->K, r, r - depth, -1e5, INSERT_VALUES));
    if (i < n - 1) PetscCall(MatSetValue(p->K, r, r + depth, -1e5, INSERT_VALUES));
    if (j > 0) PetscCall(MatSetValue(p->K, r, r - 1, -1e5, INSERT_VALUES));
    if (j < depth - 1) PetscCall(MatSetValue(p->K, r, r + 1, -1e5, INSERT_VALUES));
  }
  PetscCall(MatSetOption(p->K, MAT_SPD, PETSC_TRUE));
  PetscCall(MatGetOwnershipRange(p->B, &lo, &hi));
  for (PetscInt r = lo; r < hi; r++) PetscCall(MatSetValue(p->B, r, (r % n) * depth, 1, INSERT_VALUES));
  PetscCall(Finish(p, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A string under load 1e5 h^2 over a flat obstacle at half of its free deflection: one contact interval. */
static PetscErrorCode MakeObstacle(PetscInt n, Problem *p)
{
  const PetscReal h = 1 / (double)(n + 1);

  PetscFunctionBegin;
  PetscCall(Grid(n, 1, 1, p));
  PetscCall(VecSet(p->F, 1e5 * h * h));
  PetscCall(VecSet(p->D, 1.0 / 16));
  PetscCall(HycoSystemSetVectors(p->system, p->F, p->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeDegenerate(PetscInt n, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(Grid(n, 1, 1, p));
  PetscCall(Choose(p, ForceThird, OpenThird));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeSurface(PetscInt n, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(Grid(n, PetscMin(n, 12), 1, p));
  PetscCall(Choose(p, Force, Open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every surface node constrained twice. */
static PetscErrorCode MakeTwice(PetscInt n, Problem *p)
{
  const PetscInt half = PetscMax(1, n / 2);

  PetscFunctionBegin;
  repeated_rank = half;
  PetscCall(Grid(half, PetscMin(half, 12), 2, p));
  PetscCall(Choose(p, ForceBase, OpenRepeated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  const char *name, *title;
  PetscBool sparse;
  PetscInt largest;
  PetscErrorCode (*make)(PetscInt n, Problem *p);
} Class;

static const Class classes[] = {
    {"P", "nonsymmetric P", PETSC_FALSE, 2000, MakeP},
    {"murty", "Murty", PETSC_FALSE, 500, MakeMurty},
    {"spd", "random SPD", PETSC_FALSE, 500, MakeSPD},
    {"halfspace", "half-space 1/r", PETSC_FALSE, 2000, MakeHalfSpace},
    {"repeated", "dependent rows", PETSC_FALSE, 500, MakeRepeated},
    {"surface", "2D surface", PETSC_TRUE, 500, MakeSurface},
    {"obstacle", "obstacle", PETSC_TRUE, 2000, MakeObstacle},
    {"degenerate", "zero gaps, zero forces", PETSC_TRUE, 2000, MakeDegenerate},
    {"twice", "nodes constrained twice", PETSC_TRUE, 500, MakeTwice},
};
#define N_CLASSES ((int)(sizeof(classes) / sizeof(classes[0])))

/* -- methods -- */

typedef struct {
  char name[48];
  HycoSolverType type;
  HycoForm form;
  const char *tao;
  PetscBool many; /* takes hundreds of iterations */
} Method;

static int ListMethods(Method list[])
{
  static const char *const bound[] = {"gpcg", "tron",  "bntr",   "bnls",   "bntl",   "blmvm",
                                      "bncg", "bqnls", "bqnkls", "bqnktr", "bqnktl", "bqpip"};
  static const char *const semismooth[] = {"ssils", "asils", "ssfls", "asfls"};
  static const char *const forms[] = {"", "dual", "primal", "dual_free"}; /* by HycoForm */
  const Method first[] = {{"active_set dual", HYCO_SOLVER_ACTIVE_SET, HYCO_FORM_DUAL, NULL, PETSC_FALSE},
                          {"active_set primal", HYCO_SOLVER_ACTIVE_SET, HYCO_FORM_PRIMAL, NULL, PETSC_FALSE},
                          {"lemke dual", HYCO_SOLVER_LEMKE, HYCO_FORM_DUAL, NULL, PETSC_FALSE}};
  int n = 0;

  for (; n < 3; n++) list[n] = first[n];
  for (int k = 0; k < 4; k++, n++) {
    list[n] = (Method){"", HYCO_SOLVER_TAO, HYCO_FORM_DUAL, semismooth[k], PETSC_FALSE};
    snprintf(list[n].name, sizeof(list[n].name), "tao %s dual", semismooth[k]);
  }
  for (int form = HYCO_FORM_DUAL; form <= HYCO_FORM_DUAL_FREE; form++) {
    for (int k = 0; k < 12; k++, n++) {
      list[n] = (Method){"", HYCO_SOLVER_TAO, (HycoForm)form, bound[k], (PetscBool)(k >= 5)};
      snprintf(list[n].name, sizeof(list[n].name), "tao %s %s", bound[k], forms[form]);
    }
  }
  return n;
}

/* Which method is suitable for which class, by patterns; the first match applies; none: suitable for every size.
   fit: up to this size; 0: unsuitable, it ends not converged or, if the reason says so, with a refusal. */
typedef struct {
  const char *method, *class;
  PetscInt fit;
  const char *reason;
} Rule;

static const Rule rules[] = {
    {"tao [gtb]* dual*", "P", 0, "refused, nonsymmetric"},
    {"tao [gtb]* dual*", "murty", 0, "refused, nonsymmetric"},
    {"* primal", "P", 0, "refused, nonsymmetric"},
    {"* primal", "murty", 0, "refused, nonsymmetric"},
    {"* primal", "spd", 0, "refused, contacts share unknowns"},
    {"* primal", "halfspace", 0, "refused, contacts share unknowns"},
    {"* primal", "repeated", 0, "refused, contacts share unknowns"},
    {"* primal", "twice", 0, "refused, contacts share unknowns"},
    {"tao bqpip dual_free", "*", 0, "refused, reads the matrix"},
    {"tao bqpip *", "*", 0, "cannot take infinite bounds"},
    /* first-order and quasi-Newton types: their convergence depends on round-off, which differs between BLAS
       libraries */
    {"tao bqn* *", "*", 0, "convergence depends on round-off"},
    {"tao blmvm *", "*", 0, "convergence depends on round-off"},
    {"tao bncg *", "*", 0, "convergence depends on round-off"},
    /* from here on: suitable up to a size */
    {"tao [sa]sils *", "murty", 200, ""},
    {"tao [sa]sfls *", "obstacle", 200, ""},
    {"tao [sa]s* *", "twice", 200, ""}, /* with 500, the kernels for some processors end at residuals of 3e-8 */
    {"tao [sa]s* *", "*", 500, ""},     /* above, one factor in each iteration takes too long for the test */
    {"tao tron dual", "twice", 50, ""}, /* singular: PETSc 3.22's ends at residuals of 3e-7 with 200 */
    {"tao b[ln]* *", "halfspace", 500, ""},
    {"tao bn* primal", "obstacle", 500, ""},
    {"tao * dual_free", "halfspace", 500, ""},
};

/* The size up to which `method` must solve problems of class `c`, and, if 0, why. */
static PetscInt Fit(const char method[], const Class *c, const char *reason[])
{
  *reason = "";
  for (size_t k = 0; k < sizeof(rules) / sizeof(rules[0]); k++) {
    if (fnmatch(rules[k].method, method, 0) || fnmatch(rules[k].class, c->name, 0)) continue;
    *reason = rules[k].reason;
    return rules[k].fit;
  }
  return c->largest;
}

/* -- runs -- */

typedef struct {
  PetscInt runs, solved, largest, its; /* at the largest size for which it is suitable: its iterations and seconds */
  PetscReal seconds, worst;            /* worst residual of all sizes */
} Cell;

typedef struct {
  PetscBool refused;
  HycoReason reason;
  PetscInt its;
  PetscReal seconds, kkt, apart;
} Outcome;

static PetscErrorCode Solve(Problem *p, HycoSolver solver, const Method *m, PetscBool fallback, Outcome *o)
{
  HycoKKT kkt;
  PetscErrorCode caught;
  char message[HYCO_LINE];
  PetscReal begin, factor, size;

  PetscFunctionBegin;
  PetscCall(HycoSolverSetType(solver, m->type));
  PetscCall(HycoSolverSetForm(solver, m->form));
  PetscCall(HycoSolverSetTaoType(solver, m->tao));
  PetscCall(HycoSolverSetFallback(solver, fallback));
  PetscCall(VecSet(p->x, 0));
  PetscCall(VecSet(p->L, 0));
  begin = HycoNow();
  PetscCall(HycoCatchBegin());
  caught = HycoSolverSolve(solver, p->x, p->L);
  PetscCall(HycoCatchEnd(caught, message));
  memset(o, 0, sizeof(*o));
  o->refused = (PetscBool)(caught != 0);
  if (caught) {
    CHECK(strstr(message, "use -hyco_"), "%s: a refusal that says what to use, found \"%s\"", m->name, message);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoSolverGetSeconds(solver, &factor, NULL));
  o->seconds = HycoNow() - begin - factor;
  PetscCall(HycoSolverGetReason(solver, &o->reason));
  PetscCall(HycoSolverGetIterations(solver, &o->its));
  PetscCall(HycoSystemComputeKKT(p->system, p->x, p->L, &kkt));
  o->kkt = HycoKKTMax(&kkt);
  if (!p->known && o->reason > 0) PetscCall(VecCopy(p->x, p->reference));
  if (o->reason > 0) p->known = PETSC_TRUE;
  PetscCall(VecNorm(p->reference, NORM_INFINITY, &size));
  PetscCall(VecAXPY(p->x, -1, p->reference));
  PetscCall(VecNorm(p->x, NORM_INFINITY, &o->apart));
  o->apart /= size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One method on one problem of size n: checks the rules. Above the sizes for which it is suitable, it is not
   counted. */
static PetscErrorCode Try(Problem *p, HycoSolver solver, const Method *m, const Class *c, PetscInt n, PetscBool fit,
                          const char reason[], Cell *cell)
{
  Outcome o;
  PetscBool right;

  PetscFunctionBegin;
  PetscCall(Solve(p, solver, m, PETSC_FALSE, &o));
  right = (PetscBool)(o.reason == HYCO_CONVERGED && o.kkt <= 1e-8 && o.apart <= 1e-5);
  cell->runs++;
  cell->solved += right;
  if (right && fit) {
    cell->largest = n;
    cell->its = o.its;
    cell->seconds = o.seconds;
    cell->worst = PetscMax(cell->worst, o.kkt);
  }
  if (fit)
    CHECK(right, "%s on %s, n = %d: %s, reason %d, KKT %.1e, apart from the solution by %.1e, %d iterations", m->name,
          c->name, (int)n, o.refused ? "refused" : "fit", (int)o.reason, o.kkt, o.apart, (int)o.its);
  else if (!strncmp(reason, "refused", 7)) /* (one contact shares its unknowns with no other) */
    CHECK(o.refused || (n < 3 && m->form == HYCO_FORM_PRIMAL), "%s on %s, n = %d: not refused", m->name, c->name,
          (int)n);
  else
    CHECK(o.refused || o.reason < 0 || right, "%s on %s, n = %d: unfit, and yet converged, KKT %.1e, apart by %.1e",
          m->name, c->name, (int)n, o.kkt, o.apart);
  if (fit || o.refused || n != 50) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Solve(p, solver, m, PETSC_TRUE, &o));
  CHECK(o.reason > 0 && o.kkt <= 1e-8 && o.apart <= 1e-5,
        "%s on %s, n = %d: the next methods must solve; reason %d, KKT %.1e, apart by %.1e", m->name, c->name, (int)n,
        (int)o.reason, o.kkt, o.apart);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RunClass(const Class *c, PetscInt largest, PetscBool few, int n_methods, const Method methods[],
                               Cell cells[])
{
  PetscFunctionBegin;
  for (int k = 0; k < N_SIZES && sizes[k] <= PetscMin(c->largest, largest); k++) {
    Problem p;
    HycoSolver solver;

    PetscCall(PetscMemzero(&p, sizeof(p)));
    p.comm = PETSC_COMM_SELF;
    PetscCall(c->make(sizes[k], &p));
    PetscCall(HycoSolverCreate(p.comm, &solver));
    PetscCall(HycoSolverSetSystem(solver, p.system));
    PetscCall(HycoSolverSetWarmStart(solver, PETSC_FALSE));
    for (int m = 0; m < n_methods; m++) {
      const char *reason;
      const PetscInt fit = Fit(methods[m].name, c, &reason);

      if (few && methods[m].many) continue;
      /* an unsuitable one, on small problems or the next larger one, must not report convergence with a wrong result */
      if (sizes[k] <= (fit ? fit : 50) || (fit < 500 && k && sizes[k - 1] == fit))
        PetscCall(Try(&p, solver, &methods[m], c, sizes[k], (PetscBool)(sizes[k] <= fit), reason, &cells[m]));
    }
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(ProblemDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the table -- */

static void WriteCell(FILE *out, const Cell *cell, const char reason[])
{
  const double s = cell->seconds;

  if (!cell->runs)
    fprintf(out, " |");
  else if (!strncmp(reason, "refused", 7))
    fprintf(out, " %s |", reason);
  else if (reason[0])
    fprintf(out, " unfit, %d of %d: %s |", (int)cell->solved, (int)cell->runs, reason);
  else
    fprintf(out, " ok to %d: %d its, %.0e, %.*f %s |", (int)cell->largest, (int)cell->its, cell->worst,
            s < 0.01 || s >= 1 ? 1 : 0, s < 1 ? 1e3 * s : s, s < 1 ? "ms" : "s");
}

static PetscErrorCode Write(const char path[], int n_methods, const Method methods[], const Cell *cells)
{
  FILE *out = fopen(path, "w");

  PetscFunctionBegin;
  CHECK(out, "%s cannot be written", path);
  if (!out) PetscFunctionReturn(PETSC_SUCCESS);
  fprintf(out, "| method |");
  for (int c = 0; c < N_CLASSES; c++) fprintf(out, " %s |", classes[c].title);
  fprintf(out, "\n|---|");
  for (int c = 0; c < N_CLASSES; c++) fprintf(out, "---|");
  for (int m = 0; m < n_methods; m++) {
    fprintf(out, "\n| %s |", methods[m].name);
    for (int c = 0; c < N_CLASSES; c++) {
      const char *reason;
      const PetscInt fit = Fit(methods[m].name, &classes[c], &reason);

      WriteCell(out, &cells[c * n_methods + m], fit ? "" : reason);
    }
  }
  fprintf(out, "\n");
  fclose(out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- measurements for scripts/bench-solvers -- */

static int Ascending(const void *a, const void *b)
{
  return *(const PetscReal *)a > *(const PetscReal *)b ? 1 : -1;
}

/* A method on the form that hyco chooses for it, alone: a line of class, unknowns, contacts, method, reason,
   iterations, median of five times (without the factor) and recomputed residual. */
static PetscErrorCode MeasureOne(Problem *p, HycoSolver solver, const Class *c, const char name[])
{
  const PetscBool own = (PetscBool)(!strcmp(name, HYCO_SOLVER_ACTIVE_SET) || !strcmp(name, HYCO_SOLVER_LEMKE));
  const Method m = {"", own ? name : HYCO_SOLVER_TAO, HYCO_FORM_AUTO, own ? NULL : name, PETSC_FALSE};
  PetscReal seconds[5];
  PetscInt n, contacts;
  Outcome o = {.refused = PETSC_FALSE};

  PetscFunctionBegin;
  for (int k = 0; k < 5 && !o.refused; k++) {
    PetscCall(Solve(p, solver, &m, PETSC_FALSE, &o));
    seconds[k] = o.seconds;
  }
  qsort(seconds, 5, sizeof(seconds[0]), Ascending);
  PetscCall(VecGetSize(p->F, &n));
  PetscCall(VecGetSize(p->D, &contacts));
  if (o.refused)
    printf("%s,%d,%d,%s,refused,,,\n", c->name, (int)n, (int)contacts, name);
  else
    printf("%s,%d,%d,%s,%s,%d,%.3g,%.1e\n", c->name, (int)n, (int)contacts, name, o.reason > 0 ? "converged" : "failed",
           (int)o.its, (double)seconds[2], (double)o.kkt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -measure CLASS,... -methods NAME,... on problems of size -largest. */
static PetscErrorCode Measure(char *list[], PetscInt n, PetscInt size)
{
  char *methods[16];
  PetscInt n_methods = 16;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetStringArray(NULL, NULL, "-methods", methods, &n_methods, &given));
  for (PetscInt k = 0; k < n; k++) {
    const Class *c = classes;
    Problem p = {.known = PETSC_FALSE};
    HycoSolver solver;

    while (c < classes + N_CLASSES && strcmp(c->name, list[k])) c++;
    PetscCheck(c < classes + N_CLASSES, PETSC_COMM_SELF, PETSC_ERR_USER, "no class %s", list[k]);
    p.comm = PETSC_COMM_SELF;
    PetscCall(c->make(size, &p));
    PetscCall(HycoSolverCreate(p.comm, &solver));
    PetscCall(HycoSolverSetSystem(solver, p.system));
    PetscCall(HycoSolverSetWarmStart(solver, PETSC_FALSE));
    for (PetscInt m = 0; given && m < n_methods; m++) PetscCall(MeasureOne(&p, solver, c, methods[m]));
    PetscCall(HycoSolverDestroy(&solver));
    PetscCall(ProblemDestroy(&p));
    PetscCall(PetscFree(list[k]));
  }
  for (PetscInt m = 0; given && m < n_methods; m++) PetscCall(PetscFree(methods[m]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  Method methods[64];
  const int n = ListMethods(methods);
  Cell *cells;
  PetscInt largest = PETSC_MAX_INT; /* -largest N: no larger problems */
  PetscMPIInt size, rank;
  char path[32], *measured[16];
  PetscInt n_measured = 16;
  PetscBool measure;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (size > 1 || !getenv("HYCO_LONG"))
    largest = 200; /* HYCO_LONG (scripts/solver-tables, ctest -C Long): 2000, minutes */
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-largest", &largest, NULL));
  PetscCall(PetscOptionsGetStringArray(NULL, NULL, "-measure", measured, &n_measured, &measure));
  if (measure) {
    PetscCall(Measure(measured, n_measured, largest));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1(N_CLASSES * n, &cells));
  for (int c = 0; c < N_CLASSES; c++) {
    const PetscReal begin = HycoNow();

    if (size > 1 && !classes[c].sparse) continue; /* dense systems are on one process */
    PetscCall(RunClass(&classes[c], largest, (PetscBool)(size > 1), n, methods, cells + c * n));
    if (!rank) printf("%s: %.1f s\n", classes[c].name, HycoNow() - begin);
  }
  snprintf(path, sizeof(path), size > 1 ? "battery_%d.md" : "battery.md", (int)size);
  if (!rank) PetscCall(Write(path, n, methods, cells));
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
