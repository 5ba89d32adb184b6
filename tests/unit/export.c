/* The runtime of exported models: problems with known solutions, with bodies that contact alone holds, dependent contacts,
   sets from which the bodies get loose; principal stresses; paths with friction, and their halved steps. */
#include "check.h"
#include "../../src/contact/master_search.h"
#include <math.h>

/* An expression that the test gives: see value_of(). */
#define value_of library_value_of
#include "../../extensions/export/runtime/expression.h"
#undef value_of
static double value_of(const double *code, const double v[], const double x[]);
#define FLOWS 0
#define SLIPS 1
#include "../../extensions/export/runtime/runtime.c"
#include <hycocoulomb.h>
#include "../../extensions/export/runtime/paths.c"

enum { N = 24, P = 3 };

/* A problem of n contacts and p motions whose solution has forces in about half of the contacts and gaps in the others. */
typedef struct {
  double offset[P + N], W[N * (N + 1) / 2], A[P * N], L[N];
  Model model;
} Problem;

static int one = 0, first[] = {0, 3, 6}, function[] = {0, -1, -1, -1, 1, -1, -1, -1, 2, -1, -1, -1};
static double constant[] = {NUMBER, 1, END};

/* rank: of W, without motions; a rank below the number of forces makes forces that are not unique. */
static void Make(int n, int p, int rank, unsigned long long *state, Problem *o)
{
  double root[N][N], x[P];

  for (int i = 0; i < n; i++) {
    for (int j = 0; j < rank; j++) root[i][j] = Draw(state);
  }
  for (int i = 0; i < n; i++) {
    for (int j = 0; j <= i; j++) o->W[i * (i + 1) / 2 + j] = dot((size_t)rank, root[i], root[j]);
    o->L[i] = fmax(Draw(state), 0);
  }
  for (int i = 0; i < p * n; i++) o->A[i] = i < n ? fabs(Draw(state)) + 0.1 : Draw(state);
  for (int i = 0; i < p; i++) {
    x[i] = 10 * Draw(state);
    o->offset[i] = -dot((size_t)n, o->A + i * n, o->L);
  }
  for (int i = 0; i < n; i++) {
    o->offset[p + i] = o->L[i] > 0 ? 0 : 0.1 + fabs(Draw(state));
    for (int j = 0; j < p; j++) o->offset[p + i] += o->A[j * n + i] * x[j];
    for (int j = 0; j < n; j++) o->offset[p + i] -= o->W[i > j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i] * o->L[j];
  }
  o->model = (Model){.n_atoms = 1,
                     .n_functions = 1,
                     .atom = first,
                     .function = function,
                     .code = constant,
                     .n_motions = p,
                     .n_places = n,
                     .n_contacts = n,
                     .n_stiffness = 1,
                     .tolerance = 1e-8,
                     .offset = o->offset,
                     .stiffness = &one,
                     .W = o->W,
                     .A = o->A};
}

/* Whether predict() solves it; *error: of the forces. */
static PetscErrorCode Solve(const Problem *o, int *status, double *kkt, double *error)
{
  char *memory;
  double rest[4] = {0};
  Work work;
  int its;

  PetscFunctionBegin;
  *status = DIVERGED;
  *kkt = *error = 1;
  PetscCall(PetscMalloc1(work_size(&o->model), &memory));
  place(&o->model, memory, &work);
  *status = advance(&o->model, &work, rest, 0, rest, NULL, kkt, &its);
  *error = 0;
  for (int i = 0; i < o->model.n_contacts; i++) *error = fmax(*error, fabs(work.z[o->model.n_motions + i] - o->L[i]));
  PetscCall(PetscFree(memory));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Random problems have the forces of their making. */
static PetscErrorCode TestKnown(void)
{
  unsigned long long state = 1;
  Problem o;
  int status;
  double kkt, error;

  PetscFunctionBegin;
  for (int k = 0; k < 2000; k++) {
    const int n = 4 + k % (N - 3), p = k % (P + 1);

    Make(n, p, N, &state, &o);
    PetscCall(Solve(&o, &status, &kkt, &error));
    CHECK(status == OK && kkt < 1e-10 && error < 1e-7,
          "problem %d, %d contacts, %d motions: status %d, residual %g, error %g", k, n, p, status, kkt, error);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Dependent contacts, whose forces are not unique, have some that solve the problem. */
static PetscErrorCode TestDependent(void)
{
  unsigned long long state = 2;
  Problem o;
  int status, solved = 0;
  double kkt, error;

  PetscFunctionBegin;
  for (int k = 0; k < 500; k++) {
    Make(N, 0, 8, &state, &o);
    PetscCall(Solve(&o, &status, &kkt, &error));
    solved += status == OK;
  }
  CHECK(solved == 500, "%d of 500 problems are solved", solved);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contradictory loads: a motion that no contact can hold has no solution. */
static PetscErrorCode TestLoose(void)
{
  unsigned long long state = 3;
  Problem o;
  int status;
  double kkt, error;

  PetscFunctionBegin;
  Make(6, 1, N, &state, &o);
  o.offset[0] = 1; /* pulls away: A L = -1 with A, L >= 0 */
  PetscCall(Solve(&o, &status, &kkt, &error));
  CHECK(status == DIVERGED && kkt > 1e-3, "status %d, residual %g", status, kkt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums, sums of squares and determinants of principal stresses, down to equal ones. */
static PetscErrorCode TestPrincipal(void)
{
  unsigned long long state = 4;
  double s[6], out[3];

  PetscFunctionBegin;
  for (int k = 0; k < 1000; k++) {
    double det;

    for (int i = 0; i < 6; i++) s[i] = k % 7 == 0 && i > 2 ? 0 : Draw(&state) * (k % 5 == 0 && i > 2 ? 1e-9 : 1);
    if (k % 3 == 0) s[1] = s[2] = s[0];
    principal(s, out);
    det = s[0] * (s[1] * s[2] - s[4] * s[4]) - s[3] * (s[3] * s[2] - s[4] * s[5]) + s[5] * (s[3] * s[4] - s[1] * s[5]);
    CHECK_NEAR(out[0] + out[1] + out[2], s[0] + s[1] + s[2], 1e-14);
    CHECK_NEAR(dot(3, out, out), dot(3, s, s) + 2 * dot(3, s + 3, s + 3), 1e-13);
    CHECK_NEAR(out[0] * out[1] * out[2], det, 1e-13);
    CHECK(out[0] >= out[1] && out[1] >= out[2], "they descend: %g, %g, %g", out[0], out[1], out[2]);
  }
  s[0] = 2, s[1] = s[2] = -1, s[3] = s[4] = s[5] = 0;
  CHECK_NEAR(item(MISES, 6, s), 3, 1e-15);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1, the time, the parameter. A step longer than `most` has no solution; parameters are on a straight line, 2 to 3. */
typedef struct {
  double last, most;
  int calls;
} Steps;

static Steps steps;
static double limited[] = {-1, 0, 0, VARIABLE, 1, END, VARIABLE, 0, END};

static double value_of(const double *code, const double v[], const double x[])
{
  if (*code >= 0) return library_value_of(code, v, x);
  steps.calls++;
  if (steps.last >= 0 && v[1] > steps.last + steps.most) return NAN;
  if (steps.last >= 0 && fabs(v[0] - (2 + v[1])) > 1e-12) steps.calls = 1000;
  steps.last = v[1];
  return 1;
}

/* The law of the last step, of blocks of `rows` with the coefficient mu. */
static PetscErrorCode CheckLaw(const Work *o, int rows, double mu)
{
  double most = 0;

  PetscFunctionBegin;
  for (int i = 0; i < N; i++) most = fmax(most, fabs(o->z[i]));
  for (int k = 0; k < N; k += rows) {
    const double *z = o->z + k, *w = o->w + k, force = HycoTangential(rows, z), slip = HycoTangential(rows, w);
    double power = 0;

    for (int i = 1; i < rows; i++) power -= z[i] * w[i];
    CHECK(z[0] >= 0 && w[0] > -1e-9 && z[0] * fabs(w[0]) <= 1e-9 * most, "normal: force %g, gap %g", z[0], w[0]);
    CHECK(force <= mu * z[0] + 1e-9 * most, "friction %g of %g", force, mu * z[0]);
    if (z[0] > 0 && force < mu * z[0] - 1e-7 * most) CHECK(slip < 1e-8, "it sticks, and slips by %g", slip);
    CHECK(fabs(power - force * slip) <= 1e-8 * most, "friction is against the slip: %g of %g", power, force * slip);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestPaths(void)
{
  unsigned long long random = 5;
  double root[N][N], W[N * (N + 1) / 2], offset[(N + 1) * 3] = {0}, values[4 * N + 8], mu[1], kkt, before;
  int row[N + 1], coefficient[N] = {0}, normal[N], its;
  char *memory;
  Work o;

  PetscFunctionBegin;
  for (int problem = 0; problem < 200; problem++) {
    const int rows = 2 + problem % 2;
    Model m = {.n_parameters = 1,
               .n_atoms = 3,
               .n_functions = 3,
               .atom = first,
               .function = function,
               .code = limited,
               .n_places = N,
               .n_contacts = N,
               .n_stiffness = 1,
               .n_values = 1,
               .tolerance = 1e-8,
               .least = 1e-3,
               .offset = offset,
               .stiffness = &one,
               .W = W,
               .n_slip = N / rows,
               .row = row,
               .coefficient = coefficient,
               .normal = normal};

    steps = (Steps){-1, problem % 4 ? 1 : 0.1, 0};
    for (int i = 0; i < N; i++) {
      for (int j = 0; j < N; j++) root[i][j] = Draw(&random);
      for (int j = 0; j <= i; j++) W[i * (i + 1) / 2 + j] = dot(N, root[i], root[j]) / N + (i == j ? 0.5 : 0);
      normal[i] = i % rows == 0;
      offset[3 * i] = normal[i] ? 0.3 * fabs(Draw(&random)) : 0;
      offset[3 * i + 1] = Draw(&random) - normal[i];
      offset[3 * i + 2] = normal[i] ? 0 : 0.3 * Draw(&random);
      if (i % rows == 0) row[i / rows] = i;
    }
    row[N / rows] = N;
    offset[3 * N] = 0.3;
    PetscCall(PetscMalloc1(work_size(&m), &memory));
    place(&m, memory, &o);
    CHECK(state_size(&m) <= sizeof(values) / sizeof(values[0]), "%d doubles", (int)state_size(&m));
    memset(values, 0, sizeof(values));
    before = 0;
    for (int k = 0; k < 5; k++) {
      double work = 0;

      mu[0] = 2 + k / 4.;
      CHECK(advance(&m, &o, mu, k / 4., values, NULL, &kkt, &its) == OK && kkt < 1e-10,
            "problem %d, step %d: residual %g", problem, k, kkt);
      PetscCall(CheckLaw(&o, rows, 0.3));
      for (int b = 0; b < m.n_slip; b++) work += state_of(&m, values).work[b];
      CHECK(work >= before && steps.last == k / 4., "work %g after %g, at %g", work, before, steps.last);
      before = work;
    }
    CHECK(before > 0 && steps.calls == (problem % 4 ? 5 : 1 + 5 + 3 * 4), "%d calls", steps.calls);
    PetscCall(PetscFree(memory));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestKnown());
  PetscCall(TestDependent());
  PetscCall(TestLoose());
  PetscCall(TestPrincipal());
  PetscCall(TestPaths());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
