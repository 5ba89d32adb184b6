/*
  Semismooth Newton's method for blocks of any cone, on the dense problem w = q + M z:

      F(z) = z - P(z - rho w) = 0,     J = I - DP (I - rho M)

  rho is 1/M_nn of the block's normal force and 1/mean M_tt of its other components. Rows in which DP is 0 (open contacts,
  slip in 2D) are eliminated. The steps are halved until |F| decreases. It has no global convergence, so that there is
  a chain of starts: the given forces; forces after block Gauss-Seidel sweeps; the proximal point method, whose problems
  M + alpha, q - alpha z_k are regular where M has no full rank (P. Alart, A. Curnier, Comput. Methods Appl. Mech. Engng
  92 (1991) 353-375; V. Acary, M. Bremond, O. Huber, in: Advanced Topics in Nonsmooth Dynamics, Springer 2018, 375-457).
  With nonnegative forces only, it is the active set method with a line search.
*/
#include <hycoconeimpl.h>
#include <hycolcp.h>
#include <petscblaslapack.h>

#define MOST_ITS    100   /* of Newton's method from one start */
#define MOST_SWEEPS 30    /* of Gauss-Seidel before a start */
#define MOST_STEPS  100   /* of the proximal point method */
#define SHIFT       1e-3  /* alpha relative to M's diagonal: the proximal point method's rate of convergence */
#define TIGHT       1e-14 /* |F| relative to the forces: nothing is left to gain */
#define SOLVED      1e-10 /* the same: solved, if the steps gain nothing more */
#define LEAST_STEP  (1. / 64)
#define BLOCK       (HYCO_MAX_BLOCK * HYCO_MAX_BLOCK)

typedef struct {
  const HycoLCP *lcp;
  const HycoBlocks *blocks;
  PetscInt n;
  const PetscReal *M, *q;              /* of the problem that is solved now: lcp's, or a proximal step's */
  PetscReal *rho, *w, *y, *F;          /* n each; y = z - rho w */
  PetscReal *step, *trial;             /* n each */
  PetscReal *DP;                       /* BLOCK for each block */
  PetscInt n_kept, *kept, *kept_block; /* rows that are not eliminated, and their blocks */
  PetscBool *in;                       /* n: kept */
  PetscReal *J;                        /* n_kept x n_kept, column major */
  PetscBLASInt *pivot;
  PetscInt its;
} Newton;

/* The scales, by block; a row without flexibility has that of the stiffest one. */
static PetscErrorCode SetScales(Newton *h)
{
  const HycoBlocks *b = h->blocks;
  PetscReal most = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < h->n; i++) {
    h->rho[i] = h->M[(size_t)i * (size_t)h->n + (size_t)i];
    most = PetscMax(most, h->rho[i]);
  }
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt first = b->row[k], size = b->row[k + 1] - first;
    PetscReal mean = 0;

    for (PetscInt i = 1; i < size; i++) mean += h->rho[first + i] / (PetscReal)(size - 1);
    for (PetscInt i = 1; i < size; i++) h->rho[first + i] = mean;
  }
  for (PetscInt i = 0; i < h->n; i++) h->rho[i] = h->rho[i] > 0 ? 1 / h->rho[i] : most > 0 ? 1 / most : 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = q + M z Columns of zero forces are skipped. */
static PetscErrorCode Slack(Newton *h, const PetscReal z[])
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(h->w, h->q, h->n));
  for (PetscInt j = 0; j < h->n; j++) { /* few forces are nonzero */
    const PetscReal *column = h->M + (size_t)j * (size_t)h->n;

    for (PetscInt i = 0; z[j] != 0 && i < h->n; i++) h->w[i] += column[i] * z[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w, y and F at z; *norm = |F|_2, *size: the size of the forces, to which it is compared. */
static PetscErrorCode Residual(Newton *h, const PetscReal z[], PetscReal *norm, PetscReal *size)
{
  PetscReal sum = 0, most = 0, least = 0;

  PetscFunctionBegin;
  PetscCall(Slack(h, z));
  for (PetscInt i = 0; i < h->n; i++) h->y[i] = z[i] - h->rho[i] * h->w[i];
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    const PetscInt first = h->blocks->row[k];

    PetscCall(HycoBlockProject(h->blocks, k, h->y + first, h->F + first));
  }
  for (PetscInt i = 0; i < h->n; i++) {
    h->F[i] = z[i] - h->F[i];
    sum += h->F[i] * h->F[i];
    most = PetscMax(most, PetscAbsReal(z[i]));
    least = PetscMax(least, PetscAbsReal(h->rho[i] * h->q[i]));
  }
  *norm = PetscSqrtReal(sum);
  *size = most > 0 ? most : least;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivatives of P at y, and the rows that are kept; *changes: how many rows joined or left them. */
static PetscErrorCode Derive(Newton *h, PetscInt *changes)
{
  PetscFunctionBegin;
  h->n_kept = *changes = 0;
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    const PetscInt first = h->blocks->row[k], size = h->blocks->row[k + 1] - first;
    PetscReal *D = h->DP + (size_t)k * BLOCK;

    PetscCall(HycoBlockDerivative(h->blocks, k, h->y + first, D));
    for (PetscInt i = 0; i < size; i++) {
      PetscBool in = PETSC_FALSE;

      for (PetscInt j = 0; j < size; j++) in = (PetscBool)(in || D[i * size + j] != 0);
      *changes += in != h->in[first + i];
      h->in[first + i] = in;
      if (!in) continue;
      h->kept[h->n_kept] = first + i;
      h->kept_block[h->n_kept++] = k;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column c of J on the kept rows. J = I - DP (I - rho M), rows of one block share DP. */
static void Column(const Newton *h, PetscInt c, PetscReal column[])
{
  const PetscReal *M = h->M + (size_t)c * (size_t)h->n;

  for (PetscInt a = 0; a < h->n_kept; a++) {
    const PetscInt k = h->kept_block[a], first = h->blocks->row[k], size = h->blocks->row[k + 1] - first;
    const PetscReal *D = h->DP + (size_t)k * BLOCK + (h->kept[a] - first) * size;
    PetscReal sum = h->kept[a] == c ? 1 : 0;

    for (PetscInt j = 0; j < size; j++) sum += D[j] * (h->rho[first + j] * M[first + j] - (first + j == c ? 1 : 0));
    column[a] = sum;
  }
}

/* The step J s = -F; *regular: J has a factor, and s is finite. Rows with DP = 0 have s = -F and move to the
   right-hand side. */
static PetscErrorCode Step(Newton *h, PetscBool *regular)
{
  const PetscBLASInt one = 1;
  PetscBLASInt m, info = 0;
  PetscReal *rhs = h->trial, size = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(h->n_kept, &m));
  for (PetscInt i = 0; i < h->n; i++) h->step[i] = -h->F[i];
  for (PetscInt a = 0; a < m; a++) rhs[a] = -h->F[h->kept[a]];
  for (PetscInt c = 0, a = 0; c < h->n; c++) {
    PetscReal *column = h->J + (size_t)a * (size_t)m;

    if (h->in[c]) {
      Column(h, c, column);
      a++;
    } else if (h->step[c] != 0 && m) { /* the last column is the room of those that are not kept */
      column = h->J + (size_t)m * (size_t)m;
      Column(h, c, column);
      for (PetscInt i = 0; i < m; i++) rhs[i] -= column[i] * h->step[c];
    }
  }
  if (m) LAPACKgetrf_(&m, &m, h->J, &m, h->pivot, &info);
  if (m && info == 0) LAPACKgetrs_("N", &m, &one, h->J, &m, h->pivot, rhs, &m, &info);
  for (PetscInt a = 0; a < m; a++) h->step[h->kept[a]] = rhs[a];
  for (PetscInt i = 0; i < h->n; i++) size += PetscAbsReal(h->step[i]);
  *regular = (PetscBool)(info == 0 && !PetscIsInfOrNanReal(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z + t s with the first t = 1, 1/2, ..., 1/64 that decreases |F|; *less: there is one. Else z is unchanged. */
static PetscErrorCode Search(Newton *h, PetscReal z[], PetscReal *norm, PetscReal *size, PetscBool *less)
{
  const PetscReal before = *norm;

  PetscFunctionBegin;
  *less = PETSC_FALSE;
  for (PetscReal t = 1; t >= LEAST_STEP && !*less; t /= 2) {
    for (PetscInt i = 0; i < h->n; i++) h->trial[i] = z[i] + t * h->step[i];
    PetscCall(Residual(h, h->trial, norm, size));
    *less = (PetscBool)(*norm < (1 - 1e-4 * t) * before);
  }
  if (*less)
    PetscCall(PetscArraycpy(z, h->trial, h->n));
  else
    PetscCall(Residual(h, z, norm, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Passes an iteration to the monitor: the blocks with a force, and the rows of J that joined or left the kept ones. */
static PetscErrorCode Show(const Newton *h, const PetscReal z[], PetscInt changes)
{
  PetscInt n_active = 0;

  PetscFunctionBegin;
  if (!h->lcp->monitor) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < h->blocks->n; k++) {
    PetscBool any = PETSC_FALSE;

    for (PetscInt i = h->blocks->row[k]; i < h->blocks->row[k + 1]; i++) any = (PetscBool)(any || z[i] != 0);
    n_active += any;
  }
  PetscCall((*h->lcp->monitor)(h->its, n_active, changes, h->lcp->monitor_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton's method from z. Ends where |F| is round-off, does not decrease, or J is singular. */
static PetscErrorCode Iterate(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const PetscInt most = h->lcp->max_its ? h->lcp->max_its : MOST_ITS;
  PetscReal norm, size;
  PetscBool regular = PETSC_TRUE, less = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(Residual(h, z, &norm, &size));
  for (PetscInt k = 0; k < most && norm > TIGHT * size && regular && less; k++) {
    PetscInt changes;

    PetscCall(Derive(h, &changes));
    PetscCall(Step(h, &regular));
    if (regular) PetscCall(Search(h, z, &norm, &size, &less));
    h->its++;
    PetscCall(Show(h, z, changes));
  }
  *status = norm <= SOLVED * size ? HYCO_LCP_SOLVED : regular ? HYCO_LCP_LIMIT : HYCO_LCP_SINGULAR;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sweeps of block Gauss-Seidel from z: each block takes one projected step, which is short enough to decrease the
   energy of a symmetric problem. The step is 1 over a row-sum bound of the block's matrix. */
static PetscErrorCode Sweep(Newton *h, PetscInt sweeps, PetscReal z[])
{
  const HycoBlocks *b = h->blocks;
  PetscReal y[HYCO_MAX_BLOCK], next[HYCO_MAX_BLOCK];

  PetscFunctionBegin;
  PetscCall(Slack(h, z));
  for (PetscInt s = 0; s < sweeps; s++) {
    for (PetscInt k = 0; k < b->n; k++) {
      const PetscInt first = b->row[k], size = b->row[k + 1] - first;
      PetscReal bound = 0;

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

/* From z, then after sweeps. */
static PetscErrorCode Starts(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscFunctionBegin;
  PetscCall(Iterate(h, z, status));
  if (*status == HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksAdmit(h->blocks, z));
  PetscCall(Sweep(h, MOST_SWEEPS, z));
  PetscCall(Iterate(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The proximal point method from z: it ends if z solves the problem of lcp, and further steps gain nothing. Proximal
   point problems are solved from the last z; if one fails, so does the method. */
static PetscErrorCode Proximal(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  const size_t n = (size_t)h->n;
  const HycoLCP *lcp = h->lcp;
  PetscReal *M, *q, *alpha, before = PETSC_MAX_REAL;
  PetscBool done = PETSC_FALSE;

  PetscFunctionBegin;
  HycoDuplicate(n * n, lcp->M, &M);
  PetscCall(PetscMalloc2(n, &q, n, &alpha));
  for (size_t i = 0; i < n; i++) {
    alpha[i] = SHIFT / h->rho[i];
    M[i * n + i] += alpha[i];
  }
  for (PetscInt k = 0; k < MOST_STEPS && !done; k++) {
    PetscReal norm, size;

    for (size_t i = 0; i < n; i++) q[i] = lcp->q[i] - alpha[i] * z[i];
    h->M = M;
    h->q = q;
    PetscCall(Starts(h, z, status));
    done = (PetscBool)(*status != HYCO_LCP_SOLVED);
    h->M = lcp->M;
    h->q = lcp->q;
    PetscCall(Residual(h, z, &norm, &size));
    *status = norm <= SOLVED * size ? HYCO_LCP_SOLVED : HYCO_LCP_LIMIT;
    done = (PetscBool)(done || norm <= TIGHT * size || (*status == HYCO_LCP_SOLVED && norm > before / 2));
    before = norm;
  }
  PetscCall(PetscFree(M));
  PetscCall(PetscFree2(q, alpha));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales are those of the original M for all starts. */
static PetscErrorCode Chain(Newton *h, PetscReal z[], HycoLCPStatus *status)
{
  PetscFunctionBegin;
  PetscCall(SetScales(h));
  PetscCall(Starts(h, z, status));
  if (*status == HYCO_LCP_SOLVED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksAdmit(h->blocks, z));
  PetscCall(Proximal(h, z, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z: start and solution (n); lcp->blocks NULL: forces >= 0. On one process, or alike on every rank. */
PetscErrorCode HycoLCPSemismooth(const HycoLCP *lcp, PetscReal z[], PetscInt *its, HycoLCPStatus *status)
{
  const PetscInt n = lcp->n;
  HycoBlocks *nonnegative = NULL;
  Newton h = {.lcp = lcp, .blocks = lcp->blocks, .n = n, .M = lcp->M, .q = lcp->q};

  PetscFunctionBegin;
  if (!lcp->blocks) PetscCall(HycoBlocksCreateNonnegative(n, &nonnegative));
  if (!lcp->blocks) h.blocks = nonnegative;
  PetscCall(PetscMalloc6(n, &h.rho, n, &h.w, n, &h.y, n, &h.F, n, &h.step, n, &h.trial));
  PetscCall(PetscMalloc5((size_t)h.blocks->n * BLOCK, &h.DP, n, &h.kept, n, &h.kept_block, (size_t)(n + 1) * (size_t)n,
                         &h.J, n, &h.pivot));
  PetscCall(PetscCalloc1(n, &h.in));
  PetscCall(Chain(&h, z, status));
  *its = h.its;
  PetscCall(PetscFree6(h.rho, h.w, h.y, h.F, h.step, h.trial));
  PetscCall(PetscFree5(h.DP, h.kept, h.kept_block, h.J, h.pivot));
  PetscCall(PetscFree(h.in));
  PetscCall(HycoBlocksDestroy(&nonnegative));
  PetscFunctionReturn(PETSC_SUCCESS);
}
