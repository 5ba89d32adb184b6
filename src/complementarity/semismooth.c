/*
  Semismooth Newton's method for blocks of any cone, on the dense problem w = q + M z:

      F(z) = z - P(z - rho w) = 0,     J = I - DP (I - rho M)

  rho is 1/M_nn of the block's normal force and 1/mean M_tt of its other components. Rows in which DP is 0 (open
  contacts, slip in 2D) are eliminated. The steps are halved until |F| decreases, at last down to tiny ones: a component
  that hardly yields runs far past the border of its cone in a full step. It has no global convergence, so that there is
  a chain of starts: the given forces; the solution with the normal forces alone; forces after block Gauss-Seidel
  sweeps; forces after steps in which the admissible forces are those of the last step (freeze); the proximal point
  method, whose problems M + alpha, q - alpha z_k are regular where M has no full rank (P. Alart, A. Curnier, Comput.
  Methods Appl. Mech. Engng 92 (1991) 353-375; V. Acary, M. Bremond, O. Huber, in: Advanced Topics in Nonsmooth
  Dynamics, Springer 2018, 375-457). With nonnegative forces only, it is the active set method with a line search.

  Floating bodies: the first p entries of z are displacements with w = 0, scaled to forces by a typical flexibility.
  They start from the displacements that close the contacts with a force: otherwise every contact looks open. The sweeps
  are replaced by the solution in which every contact is closed and sticks.
*/
#include "semismooth.h"
#include <petscblaslapack.h>

#define MOST_ITS    100  /* of Newton's method from one start */
#define MOST_SWEEPS 30   /* of Gauss-Seidel before a start */
#define MOST_STEPS  100  /* of the proximal point method */
#define MOST_FROZEN 3    /* steps with frozen admissible forces before a start */
#define MOST_LEAST  1000 /* rows up to which a singular J is solved by least squares */
/* Of the forces that would close the gaps, or of those before: forces that are smaller are judged by this size, because
   they are round-off of these (tests/contact/friction.py). */
#define SMALLEST_FORCES 1e-4
/* Of the forces before: below it friction has locked nothing in; 100 times their residual of 1e-8
   (tests/contact/floating.py, bodies without a load). */
#define LOCKED 1e-6
#define SHIFT  1e-3  /* alpha of the proximal point method as a share of M's diagonal: its rate of convergence */
#define TIGHT  1e-14 /* of the forces, |F|: 45 eps, nothing is left to gain */
/* Of the forces, |F|: 4500 eps, a product with M; half of the iterations on fine meshes gained nothing below it
   (scripts/bench-friction). */
#define NO_FURTHER_STEP 1e-12
/* Of the forces, |F|: a hundredth of the residual of 1e-8 that the caller accepts, and round-off if a step does not
   halve it. */
#define SOLVED 1e-10
/* Of the forces, |F|: below it w is computed anew, because the round-off of updates is 1e-14 times some hundred steps.
   */
#define NEAR_SOLUTION 1e-6
/* Share of a step, the shortest at first: six halvings; with shorter ones only where none of these serves, a lap joint
   takes the fewest iterations (scripts/bench-friction). */
#define LEAST_STEP (1. / 64)
/* Share of a step, the shortest where no longer one decreases |F|: bodies on soft springs run far past the border of
   the cone (tests/contact/friction_random.py). */
#define TINY_STEP (1. / 65536)
#define MOST_SOFT 12 /* motions on soft supports: of two bodies */
/* Springs of motions as a share of a contact's stiffness, in the start with normal forces alone: as in the proximal
   method they move no force, and hold. */
#define START_SPRING 1e-4
/* Of the largest flexibility, what is left without motions on soft springs: springs of 1e-2 of the bodies' stiffness or
   less are motions (tests/contact/friction_random.py). */
#define SOFT_PART 1e-2
/* Share of the forces, |F|, from which a proximal step is followed by Newton's method: at larger ones the set of
   slipping contacts is another one (tests/contact/friction_random.py). */
#define TRY_NEWTON 0.1
#define MOST_ALL   200 /* iterations of all starts after which no proximal step begins */

typedef struct {
  const HycoLCP *lcp;
  const HycoBlocks *blocks;
  PetscInt n, p;                  /* length of z; free unknowns before the forces */
  const PetscReal *M, *q;         /* of the problem that is solved now: `M0`, or a proximal step's */
  const PetscReal *M0, *q0;       /* lcp's, scaled if p > 0 */
  PetscReal *scaled, flexibility; /* q0; of a typical contact; p > 0 */
  PetscReal *rho, *w, *y, *F;     /* n each; y = z - rho w */
  PetscReal *step, *trial;        /* n; 3 n: z, w and the change of w */
  PetscReal start;                /* the largest force at the start */
  PetscReal judged;               /* |F| without the round-off of the loads on free unknowns */
  HycoConeStep *linear;
  PetscBool no_equilibrium; /* no forces balance the loads */
  PetscBool near;           /* nor did they in an earlier problem of the path */
  PetscInt has_friction;    /* blocks with friction */
  PetscBool smooth; /* floating bodies, and a coefficient of friction is 0: J may lack rank along their motions */
  PetscBool soft;   /* the scales are those without motions on soft supports */
  PetscInt its;
} Newton;

/* The problem that is solved now. */
static void SemismoothSetCones(Newton *h, const PetscReal M[], const PetscReal q[])
{
  /* A factor stays valid while only q changes. */
  if (M != h->linear->M) HycoConeStepSetMatrix(h->linear, M);
  h->M = M;
  h->q = q;
}

/* Takes from d, the diagonal of M, what motions on soft supports add to it: every contact looks as if it yielded. A
   Cholesky factor with pivots: the columns of these motions come first, and leave little of M; else *soft is false. */
static PetscErrorCode TakeSoft(const Newton *h, PetscReal d[], PetscBool *soft)
{
  const PetscInt n = h->n, room = PetscMin(MOST_SOFT, n / 4);
  PetscReal *L, *rest, most = 0, mean = 0;
  PetscInt k;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((size_t)n * (size_t)room + 1, &L, n, &rest));
  PetscCall(PetscArraycpy(rest, d, n));
  for (PetscInt i = 0; i < n; i++) most = PetscMax(most, d[i]);
  for (k = 0; k < room; k++) {
    PetscReal *v = L + (size_t)k * (size_t)n, root;
    PetscInt at = 0;

    for (PetscInt i = 0; i < n; i++) {
      if (rest[i] > rest[at]) at = i;
    }
    if (!(rest[at] > SOFT_PART * most)) break;
    root = PetscSqrtReal(rest[at]);
    PetscCall(PetscArraycpy(v, h->M + (size_t)at * (size_t)n, n));
    for (PetscInt j = 0; j < k; j++) {
      for (PetscInt i = 0; i < n; i++) v[i] -= L[j * n + i] * L[j * n + at];
    }
    for (PetscInt i = 0; i < n; i++) {
      v[i] /= root;
      rest[i] = PetscMax(rest[i] - v[i] * v[i], 0);
    }
    rest[at] = 0;
  }
  *soft = (PetscBool)(k && k < room);
  for (PetscInt i = 0; i < n; i++) mean += rest[i] / (PetscReal)n;
  /* A tenth of the mean: a pivot has nothing left. */
  for (PetscInt i = 0; i < n && *soft; i++) {
    if (d[i] > 0) d[i] = PetscMax(rest[i], 0.1 * mean);
  }
  PetscCall(PetscFree2(L, rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scales, by block; a row without flexibility has that of the stiffest one. soft: NULL, or without motions on soft
   supports, if there are any. */
static PetscErrorCode SetScales(Newton *h, PetscBool *soft)
{
  const HycoBlocks *b = h->blocks;
  PetscReal most = 0, *rho;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(h->n + 1, &rho));
  for (PetscInt i = 0; i < h->n; i++) {
    rho[i] = i < h->p ? h->flexibility : h->M[(size_t)i * (size_t)h->n + (size_t)i];
    most = PetscMax(most, rho[i]);
  }
  if (soft) PetscCall(TakeSoft(h, rho, soft));
  h->soft = (PetscBool)(soft && *soft);
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt first = h->p + b->row[k], size = b->row[k + 1] - b->row[k];
    PetscReal mean = 0;

    for (PetscInt i = 1; i < size; i++) mean += rho[first + i] / (PetscReal)(size - 1);
    /* One rho for both tangents: the disk of tangential forces is isotropic, and P would depend on the choice of the
       tangents otherwise. */
    for (PetscInt i = 1; i < size; i++) rho[first + i] = mean;
  }
  for (PetscInt i = 0; i < h->n; i++) rho[i] = rho[i] > 0 ? 1 / rho[i] : most > 0 ? 1 / most : 1;
  /* A factor belongs to its scales. */
  PetscCall(PetscArraycmp(rho, h->rho, h->n, &same));
  if (!same) HycoConeStepSetMatrix(h->linear, h->M);
  PetscCall(PetscArraycpy(h->rho, rho, h->n));
  PetscCall(PetscFree(rho));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = q + M z */
static PetscErrorCode SemismoothSlack(Newton *h, const PetscReal z[])
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(h->w, h->q, h->n));
  PetscCall(HycoAddDenseProduct(h->n, h->M, z, h->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y and F at z with the slacks w; *norm = |F|_2, *size: the size of the forces, to which it is compared. F = z - P(z -
   rho w), zero at a solution; without bounds, as of free unknowns, F = rho w. Newton's method works on |F|, and the
   solution is judged without what no forces can balance. */
static PetscErrorCode SemismoothEvaluate(Newton *h, const PetscReal z[], PetscReal *norm, PetscReal *size)
{
  PetscReal sum = 0, judged = 0, most = 0, least = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < h->n; i++) h->y[i] = z[i] - h->rho[i] * h->w[i];
  for (PetscInt i = 0; i < h->p; i++) h->F[i] = h->y[i];
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    const PetscInt first = h->p + h->blocks->row[k];

    PetscCall(HycoBlockProject(h->blocks, k, h->y + first, h->F + first));
  }
  for (PetscInt i = 0; i < h->n; i++) {
    h->F[i] = z[i] - h->F[i];
    sum += h->F[i] * h->F[i];
    judged += PetscSqr(PetscMax(PetscAbsReal(h->F[i]) - (i < h->p ? h->lcp->rounding : 0), 0));
    if (i >= h->p) most = PetscMax(most, PetscAbsReal(z[i]));
    least = PetscMax(least, PetscAbsReal(h->rho[i] * h->q[i]));
  }
  *norm = PetscSqrtReal(sum);
  h->judged = PetscSqrtReal(judged);
  /* Forces that cancel, or vanish, leave round-off of the size of those that would close the gaps, or were there
     before. */
  *size = most > 0 ? PetscMax(most, SMALLEST_FORCES * PetscMax(least, h->start))
                   : PetscMax(least, SMALLEST_FORCES * h->start);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w, y and F at z. */
static PetscErrorCode SemismoothResidual(Newton *h, const PetscReal z[], PetscReal *norm, PetscReal *size)
{
  PetscFunctionBegin;
  PetscCall(SemismoothSlack(h, z));
  PetscCall(SemismoothEvaluate(h, z, norm, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* DP at z, a solution, for what follows from it: the sign, derivatives. */
static PetscErrorCode DeriveAt(Newton *h, const PetscReal z[])
{
  PetscReal norm, size;
  PetscInt changes;

  PetscFunctionBegin;
  PetscCall(SemismoothResidual(h, z, &norm, &size));
  PetscCall(HycoConeStepDerive(h->linear, h->blocks, h->y, &changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z + t s with the first t = 1, 1/2, ..., `shortest` that decreases |F|; *less: there is one. Else z is unchanged. w
   changes by t M s; near the solution it is computed anew, without the round-off of former changes. Where |F| is
   round-off it is not searched for a lucky decrease. */
static PetscErrorCode SemismoothSearch(Newton *h, PetscReal shortest, PetscReal z[], PetscReal *norm, PetscReal *size,
                                       PetscBool *less)
{
  /* Near round-off only the full step is tried, and half is enough. */
  const PetscReal before = *norm, least = before <= SOLVED * *size ? 1 : shortest;
  const PetscReal share = before <= SOLVED * *size ? 0.5 : 1e-4;
  const PetscBool near = (PetscBool)(before <= NEAR_SOLUTION * *size);
  PetscReal *trial = h->trial, *w = h->trial + h->n, *change = h->trial + 2 * h->n;

  PetscFunctionBegin;
  *less = PETSC_FALSE;
  PetscCall(PetscArraycpy(w, h->w, h->n));
  PetscCall(PetscArrayzero(change, h->n));
  if (!near) PetscCall(HycoAddDenseProduct(h->n, h->M, h->step, change));
  for (PetscReal t = 1; t >= least && !*less; t /= 2) {
    for (PetscInt i = 0; i < h->n; i++) {
      trial[i] = z[i] + t * h->step[i];
      h->w[i] = w[i] + t * change[i];
    }
    if (near) PetscCall(SemismoothSlack(h, trial));
    PetscCall(SemismoothEvaluate(h, trial, norm, size));
    /* Armijo's condition on |F|. */
    *less = (PetscBool)(*norm < (1 - share * t) * before);
  }
  if (*less) {
    PetscCall(PetscArraycpy(z, trial, h->n));
    /* Passing into the neighbourhood of the solution: w anew, without the drift of updates. */
    if (!near && *norm <= NEAR_SOLUTION * *size) PetscCall(SemismoothResidual(h, z, norm, size));
  } else {
    PetscCall(PetscArraycpy(h->w, w, h->n));
    PetscCall(SemismoothEvaluate(h, z, norm, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Passes an iteration to the monitor: the blocks with a force, and the rows of J that joined or left the kept ones. */
static PetscErrorCode SemismoothShow(const Newton *h, const PetscReal z[], PetscInt changes)
{
  PetscInt n_active = 0;

  PetscFunctionBegin;
  if (!h->lcp->monitor) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    PetscBool any = PETSC_FALSE;

    /* Exactly 0: P gives an open contact no force at all. */
    for (PetscInt i = h->blocks->row[k]; i < h->blocks->row[k + 1]; i++) any = (PetscBool)(any || z[i] != 0);
    n_active += any;
  }
  PetscCall((*h->lcp->monitor)(h->its, n_active, changes, h->lcp->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step to the solution on the present states: far from a solution directly, with fewer products with M, near it by
   its residual, which takes round-off away; `least`: by least squares. */
static PetscErrorCode SemismoothStep(Newton *h, const PetscReal z[], PetscBool near, PetscBool least,
                                     PetscBool *regular)
{
  PetscBool served = PETSC_FALSE;

  PetscFunctionBegin;
  if (!near && !least) PetscCall(HycoConeStepPoint(h->linear, h->q, h->y, h->step, regular, &served));
  /* The point itself was solved for: the step is its difference from z. */
  if (served) {
    for (PetscInt i = 0; i < h->n; i++) h->step[i] -= z[i];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The right-hand side of the step is -F; F comes back below. */
  for (PetscInt i = 0; i < h->n; i++) h->F[i] = -h->F[i];
  PetscCall(HycoConeStepSolve(h->linear, h->F, least, h->step, regular));
  for (PetscInt i = 0; i < h->n; i++) h->F[i] = -h->F[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step from z, and its search; a J without full rank, or one that is nearly singular, by least squares. */
static PetscErrorCode SemismoothImprove(Newton *h, PetscReal z[], PetscReal *norm, PetscReal *size, PetscBool *regular,
                                        PetscBool *less)
{
  const PetscReal before = *norm;
  const PetscBool lagged = h->linear->lagged;

  PetscFunctionBegin;
  *less = PETSC_FALSE;
  PetscCall(SemismoothStep(h, z, (PetscBool)(*norm <= NEAR_SOLUTION * *size), PETSC_FALSE, regular));
  /* By least squares below: else a body would run away along a motion that no force acts on. */
  if (*regular && !(h->smooth && h->linear->nearly_singular && h->linear->m <= MOST_LEAST))
    PetscCall(SemismoothSearch(h, LEAST_STEP, z, norm, size, less));
  /* A new factor where the present one does not contract; the next step begins with it. */
  if (*less && lagged && *norm > HYCO_LAGGED_CONTRACTION * before) PetscCall(HycoConeStepRenew(h->linear));
  if (!*less && *norm > SOLVED * *size &&
      !(h->smooth && h->linear->nearly_singular)) { /* by the residual, with a factor of J itself */
    PetscCall(HycoConeStepRenew(h->linear));
    PetscCall(SemismoothStep(h, z, PETSC_TRUE, PETSC_FALSE, regular));
    /* Not where forces are not unique: proximal steps find those near the last ones. */
    if (*regular)
      PetscCall(
          SemismoothSearch(h, h->linear->nearly_singular && !h->soft ? LEAST_STEP : TINY_STEP, z, norm, size, less));
  }
  /* Nothing to gain from least squares: the step was good, J is regular, or |F| is round-off already. */
  if (*less || !h->linear->nearly_singular || *norm <= SOLVED * *size) PetscFunctionReturn(PETSC_SUCCESS);
  if (!h->linear->m || h->linear->m > MOST_LEAST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SemismoothStep(h, z, PETSC_TRUE, PETSC_TRUE, regular));
  if (*regular) PetscCall(SemismoothSearch(h, LEAST_STEP, z, norm, size, less));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton's method from z. Ends where |F| is round-off, does not decrease, or J is singular. */
static PetscErrorCode SemismoothIterate(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const PetscInt most = h->lcp->max_its ? h->lcp->max_its : MOST_ITS;
  PetscReal norm, size;
  PetscBool regular = PETSC_TRUE, less = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(SemismoothResidual(h, z, &norm, &size));
  for (PetscInt k = 0; k < most && norm > NO_FURTHER_STEP * size && regular && less; k++) {
    PetscInt changes;

    PetscCall(HycoConeStepDerive(h->linear, h->blocks, h->y, &changes));
    PetscCall(SemismoothImprove(h, z, &norm, &size, &regular, &less));
    h->its++;
    PetscCall(SemismoothShow(h, z, changes));
  }
  /* By the residual alone, whatever ended the loop. */
  *status = h->judged <= SOLVED * size ? HYCO_LCP_SOLVED : regular ? HYCO_LCP_LIMIT : HYCO_LCP_SINGULAR;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sweeps of block Gauss-Seidel from z: each block takes one projected step, which is short enough to decrease the
   energy of a symmetric problem. The step is 1 over a row-sum bound of the block's matrix. */
static PetscErrorCode SemismoothSweep(Newton *h, PetscInt sweeps, PetscReal z[])
{
  const HycoBlocks *b = h->blocks;
  PetscReal y[HYCO_MAX_BLOCK], next[HYCO_MAX_BLOCK];

  PetscFunctionBegin;
  PetscCall(SemismoothSlack(h, z));
  for (PetscInt s = 0; s < sweeps; s++) {
    for (PetscInt k = 0; k < b->n; k++) {
      const PetscInt first = b->row[k], size = b->row[k + 1] - first;
      PetscReal bound = 0;

      /* The largest row sum bounds the block's largest eigenvalue, so that the step is not longer than its inverse. */
      for (PetscInt i = first; i < first + size; i++) {
        PetscReal sum = 0;

        for (PetscInt j = first; j < first + size; j++) sum += PetscAbsReal(h->M[(size_t)j * (size_t)h->n + (size_t)i]);
        bound = PetscMax(bound, sum);
      }
      for (PetscInt i = 0; i < size; i++)
        y[i] = z[first + i] - (bound > 0 ? 1 / bound : h->rho[first + i]) * h->w[first + i];
      PetscCall(HycoBlockProject(b, k, y, next));
      for (PetscInt j = 0; j < size; j++) {
        const PetscReal *column = h->M + (size_t)(first + j) * (size_t)h->n, change = next[j] - z[first + j];

        z[first + j] = next[j];
        for (PetscInt i = 0; change != 0 && i < h->n; i++) h->w[i] += column[i] * change;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The shortest displacements x of floating bodies by least squares of A x = target on the rows `in`; A: M's columns of
   x. The entries of z. */
static PetscErrorCode FitMotions(Newton *h, const PetscBool in[], const PetscReal target[], PetscReal z[])
{
  const PetscBLASInt one = 1;
  PetscReal *A, *rhs, *value, *work, tol = HYCO_RANK;
  PetscBLASInt n, p, m = 0, room, rank, info = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(h->n, &n));
  PetscCall(PetscBLASIntCast(h->p, &p));
  room = 64 * p + 5 * n;
  PetscCall(PetscCalloc4((size_t)n * (size_t)p, &A, n, &rhs, p, &value, room, &work));
  for (PetscInt i = h->p; i < h->n; i++) {
    if (!in[i]) continue;
    for (PetscInt c = 0; c < h->p; c++) A[c * n + m] = h->M[(size_t)c * (size_t)h->n + (size_t)i];
    rhs[m++] = target[i];
  }
  /* Rows of A beyond m are 0 and change nothing: the dimensions stay those of the arrays. */
  if (m) LAPACKgelss_(&n, &p, &one, A, &n, rhs, &n, value, &tol, &rank, work, &room, &info);
  for (PetscInt c = 0; c < h->p; c++) z[c] = m && info == 0 ? rhs[c] : 0;
  PetscCall(PetscFree4(A, rhs, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the forces of block k are inside its cone: slightly larger tangential ones are admissible too. */
static PetscErrorCode SemismoothIsSticking(const Newton *h, PetscInt k, const PetscReal z[], PetscBool *sticks)
{
  const PetscInt size = h->blocks->row[k + 1] - h->blocks->row[k];
  PetscReal more[HYCO_MAX_BLOCK], admitted[HYCO_MAX_BLOCK];

  PetscFunctionBegin;
  for (PetscInt i = 0; i < size; i++) more[i] = i ? z[i] * (1 + HYCO_CONE_BORDER) : z[i];
  PetscCall(HycoBlockProject(h->blocks, k, more, admitted));
  PetscCall(PetscArraycmp(more, admitted, size, sticks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements x of floating bodies for given forces: those that close the gaps of the blocks with a force, and where
   these are inside their cones let nothing slip. */
static PetscErrorCode SemismoothConsistent(Newton *h, PetscReal z[])
{
  const HycoBlocks *b = h->blocks;
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(h->n, &in));
  PetscCall(PetscArrayzero(z, h->p));
  PetscCall(SemismoothSlack(h, z));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt first = h->p + b->row[k];
    PetscBool sticks;

    PetscCall(SemismoothIsSticking(h, k, z + first, &sticks));
    for (PetscInt i = first; i < h->p + b->row[k + 1]; i++) {
      in[i] = (PetscBool)(z[first] > 0 && (i == first || sticks));
      /* A x = -w closes the gaps that the given forces leave. */
      h->w[i] = -h->w[i];
    }
  }
  PetscCall(FitMotions(h, in, h->w, z));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes away motions that no normal force resists, and which the solution without tangents has at will. */
static PetscErrorCode ShortenMotions(Newton *h, PetscReal z[])
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(h->n, &in));
  for (PetscInt k = 0; k < h->blocks->n; k++) in[h->p + h->blocks->row[k]] = PETSC_TRUE;
  PetscCall(PetscArrayzero(h->w, h->n));
  /* The gaps that the motions close are kept exactly, by the shortest motions that do so. */
  for (PetscInt c = 0; c < h->p; c++) {
    for (PetscInt i = h->p; i < h->n; i++) h->w[i] += h->M[(size_t)c * (size_t)h->n + (size_t)i] * z[c];
  }
  PetscCall(FitMotions(h, in, h->w, z));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Admissible forces, and displacements without motions that have run away. */
static PetscErrorCode SemismoothRestart(Newton *h, PetscReal z[])
{
  PetscFunctionBegin;
  PetscCall(HycoBlocksAdmit(h->blocks, z + h->p));
  if (h->p) PetscCall(SemismoothConsistent(h, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motions x that leave the bodies where they were, without forces: no contact slips, and those with a force before
   just touch, in the sense of least squares. *none: no load acts on a motion. */
static PetscErrorCode SemismoothLeastSlip(Newton *h, const PetscReal forces[], PetscReal x[], PetscBool *none)
{
  const HycoBlocks *b = h->blocks;
  PetscReal norm, size;
  PetscBool *in;

  PetscFunctionBegin;
  *none = PETSC_TRUE;
  PetscCall(PetscArrayzero(x, h->n));
  PetscCall(SemismoothResidual(h, x, &norm, &size));
  for (PetscInt i = 0; i < h->p; i++) *none = (PetscBool)(*none && PetscAbsReal(h->F[i]) <= SOLVED * size);
  if (!*none || !(h->start > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(h->n, &in));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt first = h->p + b->row[k];

    in[first] = (PetscBool)(forces[first] > 0);
    for (PetscInt i = first + 1; i < h->p + b->row[k + 1]; i++) in[i] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < h->n; i++) h->w[i] = -h->w[i];
  PetscCall(FitMotions(h, in, h->w, x));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether no forces are a solution with the motions x, which are z then. */
static PetscErrorCode SemismoothTryNoForce(Newton *h, const PetscReal x[], PetscReal z[], HycoLCPStatus *status)
{
  PetscReal norm, size;

  PetscFunctionBegin;
  PetscCall(SemismoothResidual(h, x, &norm, &size));
  *status = h->judged <= SOLVED * size ? HYCO_LCP_SOLVED : HYCO_LCP_LIMIT;
  if (*status == HYCO_LCP_SOLVED) PetscCall(PetscArraycpy(z, x, h->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same once the motions have opened what would overlap. */
static PetscErrorCode SemismoothUnload(Newton *h, PetscReal x[], PetscReal z[], HycoLCPStatus *status)
{
  const HycoBlocks *b = h->blocks;
  PetscInt *row;
  PetscBool exists;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->n + 1, &row));
  for (PetscInt k = 0; k < b->n; k++) row[k] = h->p + b->row[k];
  PetscCall(HycoLCPUnload(h->n, h->p, b->n, row, h->M, h->q, x, &exists));
  PetscCall(PetscFree(row));
  if (exists) PetscCall(SemismoothTryNoForce(h, x, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces z by the other start if its residual is smaller. */
static PetscErrorCode ChooseStart(Newton *h, PetscReal z[])
{
  PetscReal given, least, size, *other;

  PetscFunctionBegin;
  if (!h->lcp->other) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDuplicate(h->n, h->lcp->other, &other);
  PetscCall(SemismoothResidual(h, z, &given, &size));
  if (h->p) PetscCall(SemismoothConsistent(h, other));
  PetscCall(SemismoothResidual(h, other, &least, &size));
  if (least < given) PetscCall(PetscArraycpy(z, other, h->n));
  PetscCall(PetscFree(other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the given forces. Floating bodies have no start without any, as every contact would look open. Without loads
   they stay where they are; but forces that friction has locked in come before none with other motions. */
static PetscErrorCode FromForces(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscBool none = PETSC_FALSE;
  PetscReal *x = NULL, most = 0;
  HycoLCPStatus unloaded = HYCO_LCP_LIMIT;

  PetscFunctionBegin;
  *status = HYCO_LCP_LIMIT;
  if (h->p) {
    PetscCall(PetscMalloc1(h->n, &x));
    PetscCall(SemismoothLeastSlip(h, z, x, &none));
    if (none) PetscCall(SemismoothTryNoForce(h, x, z, status));
  }
  if (*status != HYCO_LCP_SOLVED && (!h->p || h->start > 0)) {
    if (h->p) PetscCall(SemismoothConsistent(h, z));
    PetscCall(ChooseStart(h, z));
    PetscCall(SemismoothIterate(h, z, status));
  }
  for (PetscInt i = h->p; i < h->n; i++) most = PetscMax(most, PetscAbsReal(z[i]));
  if (none && (*status != HYCO_LCP_SOLVED || most <= LOCKED * h->start))
    PetscCall(SemismoothUnload(h, x, z, &unloaded));
  if (unloaded == HYCO_LCP_SOLVED) *status = unloaded;
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the solution with normal forces alone. Which contacts are closed is then right as a rule, and only stick and
   slip are left. */
static PetscErrorCode FromNormal(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const HycoBlocks *b = h->blocks;
  const PetscInt p = h->p, m = p + b->n;
  HycoLCP normal = {.n = b->n, .p = p, .symmetric = h->lcp->symmetric};
  PetscInt its, *row;
  PetscBool *active;
  PetscReal *M, *q, *forces;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3((size_t)m * (size_t)m, &M, m, &q, m, &forces));
  PetscCall(PetscMalloc2(m, &row, b->n, &active));
  for (PetscInt i = 0; i < m; i++) row[i] = i < p ? i : p + b->row[i - p];
  for (PetscInt j = 0; j < m; j++) {
    q[j] = h->q[row[j]];
    forces[j] = 0;
    for (PetscInt i = 0; i < m; i++)
      M[(size_t)j * (size_t)m + (size_t)i] = h->M[(size_t)row[j] * (size_t)h->n + (size_t)row[i]];
    /* What soft springs alone resist without friction must not run far away: it is of no use to the start. */
    if (j < p && h->lcp->springs) M[(size_t)j * (size_t)(m + 1)] += START_SPRING * h->flexibility;
  }
  /* Where only tangents see a motion, its round-off in the normals would be all that there is of it. */
  for (PetscInt i = 0; i < p; i++) forces[i] = HycoMotionReach(h->n, p, h->M, i);
  HycoMotionsRound(p, b->n, forces, M);
  PetscCall(PetscArrayzero(forces, p));
  /* Floating bodies start with all contacts closed (semidefinite.c); others from the contacts with a force. */
  for (PetscInt k = 0; k < b->n; k++) active[k] = (PetscBool)(p > 0 || z[row[k]] > 0);
  normal.M = M;
  normal.q = q;
  PetscCall(HycoLCPActiveSet(&normal, active, forces, &its, status));
  h->its += its;
  PetscCall(PetscArrayzero(z, h->n));
  for (PetscInt i = 0; i < m && *status == HYCO_LCP_SOLVED; i++) z[row[i]] = forces[i];
  PetscCall(PetscFree3(M, q, forces));
  PetscCall(PetscFree2(row, active));
  if (*status != HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  if (p) PetscCall(ShortenMotions(h, z));
  /* Without friction it is the solution. */
  if (p && !h->has_friction) PetscCall(SemismoothTryNoForce(h, z, z, status));
  if (!p || h->has_friction || *status != HYCO_LCP_SOLVED) PetscCall(SemismoothIterate(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the solution in which every contact is closed and sticks, as far as there is one; then from its admissible
   forces. Contacts without a row have no force. A solution if nothing slips, as at the begin of many paths. */
static PetscErrorCode FromStick(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscBool regular;
  PetscReal *stuck;

  PetscFunctionBegin;
  /* DP = 1: the step from z = 0 is then the solution of w = 0 on all rows. */
  PetscCall(HycoConeStepStick(h->linear));
  for (PetscInt i = 0; i < h->p; i++) h->F[i] = -h->rho[i] * h->q[i];
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    const PetscInt first = h->blocks->row[k], size = h->blocks->row[k + 1] - first;

    for (PetscInt i = 0; i < size; i++) {
      const PetscInt row = h->p + first + i;

      h->F[row] = h->linear->DP[k * HYCO_BLOCK + i * (size + 1)] > 0 ? -h->rho[row] * h->q[row] : 0;
    }
  }
  PetscCall(HycoConeStepSolve(h->linear, h->F, (PetscBool)(h->linear->m <= MOST_LEAST), h->step, &regular));
  for (PetscInt i = 0; i < h->n; i++) z[i] = regular ? h->step[i] : 0;
  HycoDuplicate(h->n, z, &stuck);
  PetscCall(SemismoothIterate(h, z, status));
  if (*status != HYCO_LCP_SOLVED) {
    PetscCall(PetscArraycpy(z, stuck, h->n));
    PetscCall(SemismoothRestart(h, z));
    PetscCall(SemismoothIterate(h, z, status));
  }
  PetscCall(PetscFree(stuck));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Steps in which the admissible forces are those of the last one, then the problem itself. Each step is a problem with
   a fixed bound of friction, which is convex: the fixed-point method of Tresca's friction. */
static PetscErrorCode FromFrozen(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const HycoBlocks *b = h->blocks;
  HycoBlocks *frozen;
  PetscBool all = PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < b->n_cones; c++)
    all = (PetscBool)(all && (b->cone[c]->nonnegative || b->cone[c]->ops->freeze));
  if (!all) PetscFunctionReturn(PETSC_SUCCESS);
  /* A copy with its own data; the cones are shared. */
  PetscCall(HycoBlocksCreate(b->n_cones, b->cone, b->n, b->of, b->data, &frozen));
  h->blocks = frozen;
  for (PetscInt s = 0; s < MOST_FROZEN; s++) {
    for (PetscInt k = 0; k < b->n; k++) {
      const HycoCone cone = b->cone[b->of[k]];

      if (cone->ops->freeze)
        PetscCall((*cone->ops->freeze)(cone, b->data + b->at[k], z + h->p + b->row[k], frozen->data + b->at[k]));
    }
    PetscCall(SemismoothIterate(h, z, status));
  }
  h->blocks = b;
  PetscCall(HycoBlocksDestroy(&frozen));
  PetscCall(SemismoothIterate(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From z, then after sweeps; floating bodies from stick. */
static PetscErrorCode SemismoothStarts(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscFunctionBegin;
  PetscCall(SemismoothIterate(h, z, status));
  if (*status == HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  /* Sweeps over blocks cannot move a floating body. */
  if (h->p) {
    PetscCall(FromStick(h, z, status));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Forces of a failed start may lie outside their cones. */
  PetscCall(HycoBlocksAdmit(h->blocks, z));
  PetscCall(SemismoothSweep(h, MOST_SWEEPS, z));
  PetscCall(SemismoothIterate(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton's method on the problem itself from a copy of z, which its solution replaces; not one of many, where M has no
   full rank: proximal steps end at the nearest. */
static PetscErrorCode TryFrom(Newton *h, PetscReal z[], PetscReal copy[], HycoLCPStatus *status)
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(copy, z, h->n));
  PetscCall(SemismoothIterate(h, copy, status));
  if (h->linear->nearly_singular) *status = HYCO_LCP_SINGULAR;
  if (*status == HYCO_LCP_SOLVED) PetscCall(PetscArraycpy(z, copy, h->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The proximal point method from z: it ends if z solves the problem of lcp, and further steps gain nothing, or after
   many iterations. Proximal point problems are solved from the last z; if one fails, so does the method. For problems
   of which Newton's method cycles; each step is strongly monotone, and has one solution. */
static PetscErrorCode SemismoothProximal(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const size_t n = (size_t)h->n;
  PetscReal *M, *q, *alpha, *copy, before = PETSC_MAX_REAL;
  PetscBool done = PETSC_FALSE;

  PetscFunctionBegin;
  HycoDuplicate(n * n, h->M0, &M);
  PetscCall(PetscMalloc3(n, &q, n, &alpha, n, &copy));
  for (size_t i = 0; i < n; i++) {
    alpha[i] = SHIFT / h->rho[i];
    M[i * n + i] += alpha[i];
  }
  for (PetscInt k = 0; k < MOST_STEPS && !done; k++) {
    PetscReal norm, size;

    for (size_t i = 0; i < n; i++) q[i] = h->q0[i] - alpha[i] * z[i];
    SemismoothSetCones(h, M, q);
    PetscCall(SemismoothStarts(h, z, status));
    done = (PetscBool)(*status != HYCO_LCP_SOLVED || h->its > MOST_ALL);
    SemismoothSetCones(h, h->M0, h->q0);
    PetscCall(SemismoothResidual(h, z, &norm, &size));
    /* The status of the original problem, not of the proximal one. */
    *status = h->judged <= SOLVED * size ? HYCO_LCP_SOLVED : HYCO_LCP_LIMIT;
    done = (PetscBool)(done || norm <= TIGHT * size || (*status == HYCO_LCP_SOLVED && norm > before / 2));
    before = norm;
    if (*status == HYCO_LCP_SOLVED || norm > TRY_NEWTON * size) continue;
    PetscCall(TryFrom(h, z, copy, status));
    done = (PetscBool)(done || *status == HYCO_LCP_SOLVED);
  }
  PetscCall(PetscFree(M));
  PetscCall(PetscFree3(q, alpha, copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether no forces of the cones balance the loads on floating bodies: then z has those that come nearest. */
static PetscErrorCode HasNoEquilibrium(Newton *h, PetscReal z[])
{
  const PetscInt p = h->p, rows = h->n - p;
  PetscReal *A, *f, *r;
  PetscBool exists;

  PetscFunctionBegin;
  if (!p || h->lcp->springs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(p * rows, &A, p, &f, rows, &r));
  for (PetscInt i = 0; i < p; i++) {
    f[i] = -h->q0[i];
    for (PetscInt j = 0; j < rows; j++) A[j * p + i] = h->M0[(size_t)(p + j) * (size_t)h->n + (size_t)i];
  }
  PetscCall(HycoBlocksBalance(h->blocks, p, A, f, h->lcp->rounding * h->flexibility, r, &exists));
  h->no_equilibrium = (PetscBool)!exists;
  if (h->no_equilibrium) PetscCall(PetscArraycpy(z + p, r, rows));
  PetscCall(PetscFree3(A, f, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the forces of the last step, also with the scales of bodies that hang on soft supports; then from the solution
   without friction, which may be far from them: forces that friction has locked in are not there. Scales without soft
   motions stay only with a solution. */
static PetscErrorCode FromBefore(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscReal *given;
  PetscBool soft = PETSC_FALSE;

  PetscFunctionBegin;
  HycoDuplicate(h->n, z, &given);
  /* Near where a body slides away, a search among forces that do not exist is the dearest. */
  if (h->near) PetscCall(HasNoEquilibrium(h, z));
  if (h->no_equilibrium)
    *status = HYCO_LCP_RAY;
  else if (h->has_friction || !h->p)
    PetscCall(FromForces(h, z, status));
  else
    PetscCall(FromNormal(h, z, status));
  /* Before other starts: no start would find any. */
  if (*status != HYCO_LCP_SOLVED && !h->near) PetscCall(HasNoEquilibrium(h, z));
  if (h->no_equilibrium) *status = HYCO_LCP_RAY;
  /* Floating bodies have no soft motions: they are unknowns. */
  if (*status != HYCO_LCP_SOLVED && !h->p) PetscCall(SetScales(h, &soft));
  if (soft) {
    PetscCall(PetscArraycpy(z, given, h->n));
    PetscCall(FromForces(h, z, status));
    if (*status != HYCO_LCP_SOLVED) PetscCall(FromNormal(h, z, status));
    if (*status != HYCO_LCP_SOLVED) PetscCall(SetScales(h, NULL));
  }
  if (*status != HYCO_LCP_SOLVED && !h->no_equilibrium) PetscCall(FromNormal(h, z, status));
  PetscCall(PetscFree(given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The starts, one after the other. Scales are those of the original M for all. */
static PetscErrorCode SemismoothRunStarts(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscFunctionBegin;
  PetscCall(SetScales(h, NULL));
  if (h->lcp->blocks) {
    PetscCall(FromBefore(h, z, status));
    if (*status == HYCO_LCP_SOLVED || h->no_equilibrium) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SemismoothStarts(h, z, status));
  if (*status != HYCO_LCP_SOLVED && h->lcp->blocks) {
    PetscCall(SemismoothRestart(h, z));
    PetscCall(FromFrozen(h, z, status));
  }
  if (*status == HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SemismoothRestart(h, z));
  /* Last: it solves a sequence of problems, each with a full flexibility. */
  PetscCall(SemismoothProximal(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct _n_HycoConeFactor {
  HycoConeStep step;
  PetscInt n_blocks, *row; /* of the blocks that it is for; NULL: none yet */
  PetscBool slid;          /* in one of the problems a body slid away */
  PetscReal *rho;
  PetscReal *scaled, flexibility; /* with free unknowns: M in units of forces and lengths, NULL: not yet; of a typical
                                     contact */
};

/* Rows and columns of the free unknowns times a typical flexibility: M stays [0 A; -A^T W] in structure. Once for an
   M. */
static PetscErrorCode ScaleMatrix(HycoConeFactor f, PetscInt p, PetscInt n, const PetscReal M[], PetscBool springs)
{
  const size_t N = (size_t)n;
  PetscReal most = 0;

  PetscFunctionBegin;
  if (f->scaled) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDuplicate(N * N, M, &f->scaled);
  for (size_t i = (size_t)p; i < N; i++) most = PetscMax(most, PetscAbsReal(M[i * N + i]));
  f->flexibility = most > 0 ? most : 1;
  for (size_t i = 0; i < (size_t)p; i++) {
    /* Of rigid motions: round-off, by which a body that slides away would find a load. */
    for (size_t j = 0; j < (size_t)p && !springs; j++) f->scaled[i * N + j] = 0;
    for (size_t j = 0; j < N; j++) f->scaled[i * N + j] *= f->flexibility;
    for (size_t j = 0; j < N; j++) f->scaled[j * N + i] *= f->flexibility;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating bodies: z_i = x_i / flexibility for the free unknowns, so that all entries are forces and all w lengths; the
   factor has M so. */
static PetscErrorCode ScaleFree(Newton *h, HycoConeFactor f, PetscReal z[])
{
  PetscFunctionBegin;
  h->M0 = h->lcp->M;
  h->q0 = h->lcp->q;
  if (h->p) {
    PetscCall(ScaleMatrix(f, h->p, h->n, h->lcp->M, h->lcp->springs));
    PetscCall(PetscMalloc1(h->n, &h->scaled));
    PetscCall(PetscArraycpy(h->scaled, h->q0, h->n));
    for (PetscInt i = 0; i < h->p; i++) {
      h->scaled[i] *= f->flexibility;
      z[i] /= f->flexibility;
    }
    h->M0 = f->scaled;
    h->q0 = h->scaled;
    h->flexibility = f->flexibility;
  }
  SemismoothSetCones(h, h->M0, h->q0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without loads all forces may be round-off, also of the forces before, with which nothing is in equilibrium: they are
   0 then. */
static void DropRounding(const Newton *h, PetscReal z[])
{
  PetscReal most = 0, least = h->start;

  for (PetscInt i = h->p; i < h->n; i++) {
    most = PetscMax(most, PetscAbsReal(z[i]));
    least = PetscMax(least, PetscAbsReal(h->rho[i] * h->q[i]));
  }
  for (PetscInt i = h->p; i < h->n && most <= TIGHT * least; i++) z[i] = 0;
}

/* Empty: the first solve makes what it needs. A factor outlives the solves of a path. */
PetscErrorCode HycoConeFactorCreate(HycoConeFactor *factor)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The room for a problem. */
static PetscErrorCode SemismoothRelease(HycoConeFactor f)
{
  PetscFunctionBegin;
  if (!f->row) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoConeStepDestroy(&f->step));
  HycoFreeAll(&f->row, &f->rho, &f->scaled);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe, as paths without friction have none. */
PetscErrorCode HycoConeFactorDestroy(HycoConeFactor *factor)
{
  PetscFunctionBegin;
  if (!*factor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SemismoothRelease(*factor));
  PetscCall(PetscFree(*factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without the matrix the next solve factors anew; the arrays stay. To be called when S changes in place, which a
   pointer cannot show. NULL-safe. */
void HycoConeFactorForget(HycoConeFactor f)
{
  if (!f || !f->row) return;
  HycoConeStepSetMatrix(&f->step, NULL);
  f->slid = PETSC_FALSE;
  PetscCallVoid(PetscFree(f->scaled));
}

/* A negative sign of the determinant of J proves that the problem has other solutions as well, by the degree of F. */
PetscErrorCode HycoConeFactorSign(HycoConeFactor f, PetscInt *sign)
{
  PetscFunctionBegin;
  PetscCall(HycoConeStepSign(&f->step, sign));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoConeFactorSetBlocks(HycoConeFactor f, const HycoBlocks *blocks)
{
  HycoConeStepSetBlocks(&f->step, blocks);
}

/* With the DP of the last solution. */
PetscErrorCode HycoConeFactorTangent(HycoConeFactor f, PetscInt k, const PetscReal dq[], PetscReal dz[],
                                     PetscBool *regular)
{
  const PetscInt p = f->step.p, n = f->step.n;
  PetscReal *scaled = NULL;

  PetscFunctionBegin;
  if (p) {
    PetscCall(PetscMalloc1(n * k + 1, &scaled));
    for (PetscInt i = 0; i < n * k; i++) scaled[i] = dq[i] * (i % n < p ? f->flexibility : 1);
  }
  PetscCall(HycoConeStepTangent(&f->step, k, scaled ? scaled : dq, dz, regular));
  for (PetscInt i = 0; i < p * k; i++) dz[i / p * n + i % p] *= f->flexibility;
  PetscCall(PetscFree(scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two solutions with the same pieces have the same derivative. */
void HycoConeFactorGetPieces(HycoConeFactor f, PetscInt *n, const PetscReal *DP[])
{
  *n = f->n_blocks * HYCO_BLOCK;
  *DP = f->step.DP;
}

/* Makes the factor one for problems with these blocks. */
static PetscErrorCode SemismoothAdapt(HycoConeFactor f, PetscInt p, const HycoBlocks *blocks)
{
  PetscBool same = (PetscBool)(f->row && f->step.p == p && f->n_blocks == blocks->n);

  PetscFunctionBegin;
  /* Equal numbers of blocks may still have other sizes. */
  if (same) PetscCall(PetscArraycmp(f->row, blocks->row, blocks->n + 1, &same));
  if (!same) {
    PetscCall(SemismoothRelease(f));
    f->n_blocks = blocks->n;
    HycoDuplicate(blocks->n + 1, blocks->row, &f->row);
    PetscCall(PetscCalloc1(p + blocks->row[blocks->n] + 1, &f->rho));
    PetscCall(HycoConeStepCreate(p, blocks, f->rho, &f->step));
  }
  HycoConeStepSetBlocks(&f->step, blocks);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z: start and solution (p + n); lcp->blocks NULL: forces >= 0. On one process, or alike on every rank.
   SemismoothRunStarts() tries the starts one after the other until one converges. */
PetscErrorCode HycoLCPSemismooth(const HycoLCP *lcp, PetscReal z[], PetscInt *its, HycoLCPStatus *status)
{
  const PetscInt n = lcp->p + lcp->n;
  HycoBlocks *nonnegative = NULL;
  HycoConeFactor own = NULL, f = lcp->cone;
  Newton h = {.lcp = lcp, .blocks = lcp->blocks, .n = n, .p = lcp->p};

  PetscFunctionBegin;
  if (!lcp->blocks) PetscCall(HycoBlocksCreateNonnegative(lcp->n, &nonnegative));
  if (!lcp->blocks) h.blocks = nonnegative;
  if (!f) PetscCall(HycoConeFactorCreate(&own));
  if (own) f = own;
  PetscCall(SemismoothAdapt(f, lcp->p, h.blocks));
  h.linear = &f->step;
  h.linear->symmetric = (PetscBool)(lcp->symmetric && !lcp->p);
  h.rho = f->rho;
  PetscCall(PetscMalloc5(n, &h.w, n, &h.y, n, &h.F, n, &h.step, 3 * n, &h.trial));
  for (PetscInt k = 0; k < h.blocks->n && h.p; k++) {
    const PetscBool has_friction = HycoBlockHasFriction(h.blocks, k);

    h.has_friction += has_friction;
    h.smooth = (PetscBool)(h.smooth || (!has_friction && h.blocks->row[k + 1] - h.blocks->row[k] > 1));
  }
  PetscCall(ScaleFree(&h, f, z));
  for (PetscInt i = h.p; i < n; i++) h.start = PetscMax(h.start, PetscAbsReal(z[i]));
  h.near = f->slid;
  PetscCall(SemismoothRunStarts(&h, z, status));
  f->slid = (PetscBool)(f->slid || h.no_equilibrium);
  if (lcp->sign) *lcp->sign = 0;
  /* Before DropRounding() and the scaling back: z is that of h's problem. */
  if ((lcp->cone || lcp->sign) && *status == HYCO_LCP_SOLVED) PetscCall(DeriveAt(&h, z));
  if (lcp->sign && *status == HYCO_LCP_SOLVED) PetscCall(HycoConeStepSign(h.linear, lcp->sign));
  DropRounding(&h, z);
  for (PetscInt i = 0; i < h.p; i++) z[i] *= h.flexibility;
  *its = h.its;
  PetscCall(PetscFree5(h.w, h.y, h.F, h.step, h.trial));
  PetscCall(HycoConeFactorDestroy(&own));
  PetscCall(PetscFree(h.scaled));
  PetscCall(HycoBlocksDestroy(&nonnegative));
  PetscFunctionReturn(PETSC_SUCCESS);
}
