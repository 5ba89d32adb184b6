/*
  Floating bodies by the proximal point method (R. T. Rockafellar, SIAM J. Control Optim. 14 (1976) 877-898). Springs of
  stiffness kappa hold the pinned unknowns x at a centre: with r = f' - A L, which the springs carry,

    x = centre + r / kappa,   w = g - A^T x + S L = g - A^T (centre + f' / kappa) + (S + A^T A / kappa) L

  is a problem in the forces only, with a solution for any set of contacts. Then x becomes the centre. If there is an
  equilibrium, r tends to 0, also where contact leaves x free; x is then a nearest solution. There is none if the step
  r / kappa is a motion that closes no contact and on which the load has positive work (Farkas' lemma).
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Stiffness of the springs as a share of the contacts': the rate of convergence of the proximal steps, two or three of
   which end at 1e-11 (tests/contact/floating.py). */
#define SOFT_SPRING 1e-4
/* Of loads and contact forces, what springs may carry in the end: three digits below the residual of 1e-8
   (tests/contact/floating.py). */
#define SPRINGS_CARRY 1e-11
/* Of the largest closing of a contact: 4.5e5 eps, a motion by least squares; up to there it closes none. */
#define OPENS    1e-10
#define MOST_ITS 200
#define STALLED  10 /* steps without half of what the springs carry: a method's forces are not better */

typedef struct {
  const HycoLCP *lcp;
  const HycoHeldMethod *method; /* NULL: the active set */
  PetscReal soft;               /* SOFT_SPRING, or the method's */
  PetscInt p, m;
  PetscReal *S;                             /* m x m: S + A^T A / kappa */
  PetscReal *kappa, *centre, *x, *r, *step; /* p; step: r / kappa */
  PetscReal *gap;                           /* m: w for L = 0 */
} Proximal;

/* Column j of (A; S). */
static const PetscReal *ProximalColumn(const Proximal *h, PetscInt j)
{
  return h->lcp->M + (size_t)(h->p + j) * (size_t)(h->p + h->m);
}

/* A^T v */
static PetscReal ProximalClosingOf(const Proximal *h, PetscInt j, const PetscReal v[])
{
  const PetscReal *A = ProximalColumn(h, j);
  PetscReal sum = 0;

  for (PetscInt i = 0; i < h->p; i++) sum += A[i] * v[i];
  return sum;
}

/* Springs that are soft compared with the contacts that move their unknown. kappa_i = SOFT_SPRING times the stiffness
   that a contact gives to unknown i. */
static void SetSprings(Proximal *h)
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < h->p; i++) {
    for (PetscInt j = 0; j < h->m; j++) {
      const PetscReal *A = ProximalColumn(h, j), *S = A + h->p;

      /* 1 / S_jj is the stiffness of contact j, A_ij its arm on unknown i. */
      if (S[j] > 0) h->kappa[i] = PetscMax(h->kappa[i], h->soft * A[i] * A[i] / S[j]);
    }
    most = PetscMax(most, h->kappa[i]);
  }
  for (PetscInt i = 0; i < h->p; i++) {
    /* An unknown that no contact moves: any spring does, as the load on it must be 0 for an equilibrium. */
    if (h->kappa[i] == 0) h->kappa[i] = most > 0 ? most : 1;
  }
}

/* S + A^T A / kappa. The condensed matrix of the forces when the unknowns are held by springs kappa. */
static PetscErrorCode AddSprings(Proximal *h)
{
  const size_t p = (size_t)h->p, m = (size_t)h->m;
  const PetscReal one = 1;
  PetscReal *A;
  PetscBLASInt rows, cols;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(p * m, &A));
  PetscCall(PetscBLASIntCast(h->p, &rows));
  PetscCall(PetscBLASIntCast(h->m, &cols));
  for (size_t j = 0; j < m; j++) {
    const PetscReal *column = ProximalColumn(h, (PetscInt)j);

    /* Rows of the pinned unknowns over the square root of their spring. */
    for (size_t i = 0; i < p; i++) A[j * p + i] = column[i] / PetscSqrtReal(h->kappa[i]);
    PetscCall(PetscArraycpy(h->S + j * m, column + p, m));
  }
  BLASgemm_("T", "N", &cols, &cols, &rows, &one, A, &rows, A, &rows, &one, h->S, &cols);
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r and x for the forces L; NULL: for none. r: what is left of the load on the unknowns; x moves by it against the
   springs. */
static void ProximalPosition(Proximal *h, const PetscReal L[])
{
  for (PetscInt i = 0; i < h->p; i++) h->r[i] = -h->lcp->q[i];
  for (PetscInt j = 0; L && j < h->m; j++) {
    const PetscReal *A = ProximalColumn(h, j);

    for (PetscInt i = 0; i < h->p && L[j] != 0; i++) h->r[i] -= A[i] * L[j];
  }
  for (PetscInt i = 0; i < h->p; i++) h->x[i] = h->centre[i] + h->r[i] / h->kappa[i];
}

/* L, r and x for the present centre. The active set first; Lemke's method where dependent contacts make it cycle. */
static PetscErrorCode SolveForces(Proximal *h, PetscBool active[], PetscReal L[], PetscInt *its, HycoLCPStatus *status)
{
  const HycoLCP held = {.n = h->m,
                        .M = h->S,
                        .q = h->gap,
                        .symmetric = PETSC_TRUE,
                        .max_its = h->lcp->max_its,
                        .monitor = h->lcp->monitor,
                        .monitor_ctx = h->lcp->monitor_ctx};
  PetscInt more;

  PetscFunctionBegin;
  ProximalPosition(h, NULL);
  for (PetscInt j = 0; j < h->m; j++) {
    h->gap[j] = h->lcp->q[h->p + j] - ProximalClosingOf(h, j, h->x);
    if (h->S[(size_t)j * (size_t)h->m + (size_t)j] == 0) h->gap[j] = 0; /* a contact without a row */
  }
  if (h->method) {
    PetscCall(h->method->solve(h->method->ctx, &held, L, its));
    *status = HYCO_LCP_SOLVED; /* what the springs carry decides */
  } else {
    PetscCall(HycoLCPActiveSet(&held, active, L, &more, status));
    *its += more;
  }
  /* S + A^T A / kappa is semidefinite at least, for which Lemke's method ends with a solution if there is one. */
  if (*status != HYCO_LCP_SOLVED) {
    PetscCall(HycoLCPLemke(h->m, h->S, h->gap, 50 * (h->m + 10), L, &more, status));
    *its += more;
  }
  for (PetscInt j = 0; j < h->m; j++) {
    L[j] = PetscMax(L[j], 0);
    active[j] = (PetscBool)(L[j] > 0);
  }
  ProximalPosition(h, L);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the springs carry, relative to each unknown's own forces, but not to less than 1e-3 of the largest. */
static PetscReal ProximalImbalance(const Proximal *h, const PetscReal L[])
{
  PetscReal most = 0, worst = 0;

  /* The first pass finds the largest size, with which the second one compares. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < h->p; i++) {
      PetscReal size = PetscAbsReal(h->lcp->q[i]);

      for (PetscInt j = 0; j < h->m; j++) size += PetscAbsReal(ProximalColumn(h, j)[i]) * L[j];
      if (pass && h->r[i] != 0) worst = PetscMax(worst, PetscAbsReal(h->r[i]) / PetscMax(size, 1e-3 * most));
      most = PetscMax(most, size);
    }
  }
  return worst;
}

/* Whether the step r / kappa is a motion that closes no contact and on which the load has work. If not, *far: how many
   such steps the bodies may move until an open contact closes; 0 if the step closes a contact further. */
static PetscBool ProximalIsFreeMotion(Proximal *h, const PetscReal L[], PetscReal *far)
{
  PetscReal size = 0, work = 0;
  PetscBool none = PETSC_TRUE;

  *far = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < h->p; i++) {
    h->step[i] = h->r[i] / h->kappa[i];
    work -= h->lcp->q[i] * h->step[i];
  }
  for (PetscInt j = 0; j < h->m; j++) {
    PetscReal sum = 0;

    for (PetscInt i = 0; i < h->p; i++) sum += PetscAbsReal(ProximalColumn(h, j)[i] * h->step[i]);
    size = PetscMax(size, sum);
  }
  for (PetscInt j = 0; j < h->m; j++) {
    const PetscReal closing = ProximalClosingOf(h, j, h->step), *S = ProximalColumn(h, j) + h->p;
    PetscReal w = h->lcp->q[h->p + j] - ProximalClosingOf(h, j, h->x);

    if (closing <= OPENS * size) continue;
    none = PETSC_FALSE;
    for (PetscInt k = 0; k < h->m; k++) w += S[k] * L[k];
    /* A closed contact that the step would close further forbids any extra way. */
    *far = L[j] > 0 ? 0 : PetscMin(*far, PetscMax(w, 0) / closing);
  }
  if (none) *far = 0;
  return (PetscBool)(none && work > 0);
}

/* far: a long way without contact is covered at once, instead of by many small steps. */
static PetscErrorCode ProximalIterate(Proximal *h, PetscBool active[], PetscReal L[], PetscInt *its,
                                      HycoLCPStatus *status)
{
  PetscReal far, left, least = PETSC_MAX_REAL;
  PetscInt at = 0;

  PetscFunctionBegin;
  SetSprings(h);
  PetscCall(AddSprings(h));
  if (h->method) PetscCall(PetscArrayzero(L, h->m));
  for (PetscInt k = 0; k < MOST_ITS && !(h->method && k > at + STALLED); k++) {
    PetscCall(SolveForces(h, active, L, its, status));
    if (*status != HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
    left = ProximalImbalance(h, L);
    if (left <= SPRINGS_CARRY) PetscFunctionReturn(PETSC_SUCCESS);
    if (left <= least / 2) at = k;
    least = PetscMin(least, left);
    /* LIMIT stands until a further step balances the forces; it is what the caller sees after MOST_ITS. */
    *status = ProximalIsFreeMotion(h, L, &far) ? HYCO_LCP_RAY : HYCO_LCP_LIMIT;
    if (*status == HYCO_LCP_RAY) PetscFunctionReturn(PETSC_SUCCESS);
    for (PetscInt i = 0; i < h->p; i++) h->centre[i] = h->x[i] + far * h->step[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = (x_pinned, L) by the proximal point method; HYCO_LCP_RAY: no equilibrium exists. M must be symmetric in its
   block S. */
PetscErrorCode HycoLCPProximal(const HycoLCP *lcp, const HycoHeldMethod *method, PetscBool active[], PetscReal z[],
                               PetscInt *its, HycoLCPStatus *status)
{
  const PetscInt p = lcp->p, m = lcp->n;
  Proximal h = {.lcp = lcp, .method = method, .soft = method ? method->soft : SOFT_SPRING, .p = p, .m = m};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((size_t)m * (size_t)m, &h.S, m, &h.gap));
  PetscCall(PetscCalloc5(p, &h.kappa, p, &h.centre, p, &h.x, p, &h.r, p, &h.step));
  PetscCall(ProximalIterate(&h, active, z + p, its, status));
  /* The pinned unknowns of the last centre; forces are in place. */
  PetscCall(PetscArraycpy(z, h.x, p));
  PetscCall(PetscFree2(h.S, h.gap));
  PetscCall(PetscFree5(h.kappa, h.centre, h.x, h.r, h.step));
  PetscFunctionReturn(PETSC_SUCCESS);
}
