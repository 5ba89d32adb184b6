/* The runtime of exported models: problems with known solutions, with bodies that contact alone holds, dependent contacts,
   sets from which the bodies get loose; principal stresses. */
#include "check.h"
#include "../../src/contact/master_search.h"
#include <math.h>

#include "../../extensions/export/runtime/runtime.c"

enum { N = 24, P = 3 };

/* A problem of n contacts and p motions whose solution has forces in about half of the contacts and gaps in the others. */
typedef struct {
  double offset[P + N], W[N * (N + 1) / 2], A[P * N], L[N];
  Model model;
} Problem;

static int one = 0;

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
  o->model = (Model){.n_functions = 1,
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
  Work work;
  int its;

  PetscFunctionBegin;
  *status = DIVERGED;
  *kkt = *error = 1;
  PetscCall(PetscMalloc1(work_size(&o->model), &memory));
  place(&o->model, memory, &work);
  work.f[0] = 1;
  *status = predict(&o->model, &work, NULL, kkt, &its);
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

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestKnown());
  PetscCall(TestDependent());
  PetscCall(TestLoose());
  PetscCall(TestPrincipal());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
