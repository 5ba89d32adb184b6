/*
  The derivative of a solution of w = q + M z, z = P(z - rho w) with Coulomb's friction, where q and the coefficients
  change:

      z' = DP (z' - rho (q' + M z')) + g,     w' = q' + M z',

  g: along a slip mu' r_n. DP g = 0, so that z' - g solves the same system with q' + M g. Contacts on the border of two
  states serve if the derivative keeps them there, as where loads stay.

  Where nothing loads floating bodies, they are where the contacts slip least since the step before, moved on by as
  little as opens what would overlap (semismooth.c): x = x_s + d, of least squares of the rows of both sets.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Of friction mu r_n, or of the largest displacement: a tenth of the residual of the forces, 1e-8; nearer to it a
   contact may stick or slip. */
#define SLIP_BORDER 1e-9
/* Of the largest rate, of gaps that stay closed without a force: ten times HYCO_RATE_ROUND_OFF, as they follow from
   least squares of normals. */
#define MEETS_RATE 1e-6

static PetscReal ConeTangentLargest(PetscInt n, const PetscReal v[])
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < n; i++) most = PetscMax(most, PetscAbsReal(v[i]));
  return most;
}

/* Norm of the tangential components of a block. */
static PetscReal TangentialNorm(PetscInt size, const PetscReal v[])
{
  PetscReal sum = 0;

  for (PetscInt i = 1; i < size; i++) sum += v[i] * v[i];
  return PetscSqrtReal(sum);
}

/* The coefficient of a block: 0 without friction. */
static PetscReal ConeTangentCoefficient(const HycoBlocks *b, PetscInt k)
{
  return b->row[k + 1] - b->row[k] > 1 ? b->data[b->at[k]] : 0;
}

/* g of block k, with the piece of its law at the solution (row by row). */
static void AddFriction(PetscInt size, const PetscReal piece[], PetscReal mu, PetscReal d, const PetscReal r[],
                        const PetscReal w[], PetscReal g[])
{
  const PetscReal slip = TangentialNorm(size, w);
  PetscBool slips = PETSC_FALSE;

  for (PetscInt i = 1; i < size; i++) slips = (PetscBool)(slips || piece[i * size] != 0);
  for (PetscInt i = 1; i < size && r[0] > 0; i++) {
    if (slips) g[i] = d * r[0] * piece[i * size] / mu;
    /* Without friction there is no piece of slip: a force against it appears. */
    if (mu == 0 && slip > 0) g[i] = -d * r[0] * w[i] / slip;
  }
}

/* Sizes and rates against which a block's values are judged. */
typedef struct {
  PetscReal force, gap, rate_r, rate_w;
} Scales;

/* Whether the derivative keeps a block on the border of two states in both. d: of its coefficient. */
static PetscBool ConeTangentKeepsState(PetscInt size, PetscReal mu, PetscReal d, const Scales *s, const PetscReal r[],
                                       const PetscReal w[], const PetscReal dr[], const PetscReal dw[])
{
  const PetscReal force = TangentialNorm(size, r);
  PetscReal change = d * r[0] + mu * dr[0];

  if (r[0] <= HYCO_UNDECIDED * s->force && w[0] <= HYCO_UNDECIDED * s->gap)
    return (PetscBool)(PetscAbsReal(dr[0]) <= HYCO_RATE_ROUND_OFF * s->rate_r &&
                       PetscAbsReal(dw[0]) <= HYCO_RATE_ROUND_OFF * s->rate_w);
  if (size == 1 || r[0] <= HYCO_UNDECIDED * s->force) return PETSC_TRUE;
  if (force < (1 - SLIP_BORDER) * mu * r[0] || TangentialNorm(size, w) > SLIP_BORDER * s->gap) return PETSC_TRUE;
  for (PetscInt i = 1; i < size && force > 0; i++) change -= r[i] / force * dr[i];
  return (PetscBool)(PetscAbsReal(change) <= HYCO_RATE_ROUND_OFF * s->rate_r &&
                     TangentialNorm(size, dw) <= HYCO_RATE_ROUND_OFF * s->rate_w);
}

/* Whether a row of M is 0: its contact has no unknown. */
static PetscBool IsEmpty(PetscInt N, const PetscReal M[], PetscInt row)
{
  for (PetscInt j = 0; j < N; j++) {
    if (M[(size_t)j * (size_t)N + (size_t)row] != 0) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* x (p) of least squares of G x = target in m rows, G the first p columns of M. */
static PetscErrorCode ConeTangentFit(const HycoLCP *lcp, PetscInt m, const PetscInt row[], const PetscReal target[],
                                     PetscReal x[])
{
  const PetscInt p = lcp->p, N = p + lcp->n;
  const PetscBLASInt rows = (PetscBLASInt)PetscMax(m, p), columns = (PetscBLASInt)p, one = 1;
  const PetscBLASInt room = 64 * columns + 5 * rows;
  PetscReal *G, *rhs, *value, *work, tol = HYCO_RANK;
  PetscBLASInt rank, info;

  PetscFunctionBegin;
  PetscCall(PetscCalloc4((size_t)rows * (size_t)p, &G, rows, &rhs, p, &value, room, &work));
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt c = 0; c < p; c++) G[c * rows + i] = lcp->M[(size_t)c * (size_t)N + (size_t)row[i]];
    rhs[i] = target[row[i]];
  }
  LAPACKgelss_(&rows, &columns, &one, G, &rows, rhs, &rows, value, &tol, &rank, work, &room, &info);
  for (PetscInt c = 0; c < p; c++) x[c] = info ? 0 : rhs[c];
  PetscCall(PetscFree4(G, rhs, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = f + a G x in the rows of contacts. */
static void ConeTangentMove(const HycoLCP *lcp, PetscReal a, const PetscReal x[], const PetscReal f[], PetscReal y[])
{
  const PetscInt p = lcp->p, N = p + lcp->n;

  for (PetscInt i = p; i < N; i++) {
    y[i] = f[i];
    for (PetscInt c = 0; c < p; c++) y[i] += a * lcp->M[(size_t)c * (size_t)N + (size_t)i] * x[c];
  }
}

/* The derivative of the motions without forces; before: the forces of the step before. */
static PetscErrorCode ConeTangentAtRest(const HycoLCP *lcp, const PetscReal before[], const PetscReal z[],
                                        const PetscReal w[], PetscReal size, const PetscReal dq[], PetscReal dz[],
                                        PetscBool *regular)
{
  const HycoBlocks *b = lcp->blocks;
  const PetscInt p = lcp->p, n = lcp->n, N = p + n;
  const PetscReal rate = ConeTangentLargest(n, dq + p);
  PetscInt *slips, *closed, n_slips = 0, n_closed = 0;
  PetscReal *t, *x, *dx, moved = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n + 1, &slips, n + 1, &closed));
  PetscCall(PetscCalloc3(N + 1, &t, p, &x, p, &dx));
  for (PetscInt k = 0; k < b->n && ConeTangentLargest(n, before) > 0; k++) {
    for (PetscInt i = b->row[k]; i < b->row[k + 1]; i++) {
      if (i > b->row[k] || before[i] > 0) slips[n_slips++] = p + i;
    }
  }
  for (PetscInt k = 0; k < b->n; k++) {
    if (w[p + b->row[k]] <= HYCO_UNDECIDED * size) closed[n_closed++] = p + b->row[k];
  }
  /* Without forces w = q + G x. */
  ConeTangentMove(lcp, -1, z, w, t);
  for (PetscInt i = p; i < N; i++) t[i] = -t[i];
  if (n_slips) PetscCall(ConeTangentFit(lcp, n_slips, slips, t, x));
  for (PetscInt i = p; i < N; i++) t[i] = -dq[i];
  if (n_slips) PetscCall(ConeTangentFit(lcp, n_slips, slips, t, dz));
  for (PetscInt c = 0; c < p; c++) x[c] = z[c] - x[c];
  ConeTangentMove(lcp, 1, x, t, t);
  for (PetscInt i = p; i < N; i++) moved = PetscMax(moved, PetscAbsReal(t[i] + dq[i]));
  for (PetscInt i = p; i < N; i++) t[i] = -dq[i];
  ConeTangentMove(lcp, -1, dz, t, t);
  if (moved > HYCO_UNDECIDED * size) {
    /* What has moved the bodies on would overlap without that, and just touches. */
    *regular = (PetscBool)(n_closed > 0);
    if (n_closed) PetscCall(ConeTangentFit(lcp, n_closed, closed, t, dx));
  }
  for (PetscInt c = 0; c < p; c++) dz[c] += dx[c];
  ConeTangentMove(lcp, -1, dx, t, t);
  for (PetscInt i = 0; i < n_closed; i++)
    *regular = (PetscBool)(*regular && PetscAbsReal(t[closed[i]]) <= MEETS_RATE * rate);
  PetscCall(PetscFree2(slips, closed));
  PetscCall(PetscFree3(t, x, dx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lcp->cone has the pieces of the laws at z; dq: the caller's, overwritten. */
PetscErrorCode HycoConeTangent(const HycoLCP *lcp, const PetscReal before[], const PetscReal z[], const PetscReal w[],
                               PetscReal size, const PetscReal dmu[], PetscReal dq[], PetscReal dz[], PetscReal dw[],
                               PetscBool *regular)
{
  const HycoBlocks *b = lcp->blocks;
  const PetscInt p = lcp->p, n = lcp->n, N = p + n;
  const PetscReal *pieces;
  Scales s = {ConeTangentLargest(n, z + p), size, 0, ConeTangentLargest(n, dq + p)};
  PetscInt room;
  PetscReal *g;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  PetscCall(PetscArrayzero(dz, N));
  PetscCall(PetscArraycpy(dw, dq, N));
  if (p && !lcp->springs && s.force == 0) {
    /* A load that appears would close contacts on one side alone. */
    *regular = (PetscBool)(ConeTangentLargest(p, dq) == 0);
    if (*regular) PetscCall(ConeTangentAtRest(lcp, before, z, w, size, dq, dz, regular));
    ConeTangentMove(lcp, 1, dz, dw, dw);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoConeFactorSetBlocks(lcp->cone, b);
  HycoConeFactorGetPieces(lcp->cone, &room, &pieces);
  PetscCall(PetscCalloc1(N + 1, &g));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt at = p + b->row[k];

    if (dmu[k] != 0)
      AddFriction(b->row[k + 1] - b->row[k], pieces + (size_t)k * (size_t)(room / b->n), ConeTangentCoefficient(b, k),
                  dmu[k], z + at, w + at, g + at);
  }
  if (ConeTangentLargest(N, g) > 0) PetscCall(HycoAddDenseProduct(N, lcp->M, g, dq));
  if (ConeTangentLargest(N, dq) > 0) PetscCall(HycoConeFactorTangent(lcp->cone, 1, dq, dz, regular));
  for (PetscInt i = 0; i < N; i++) dz[i] += g[i];
  PetscCall(PetscFree(g));
  if (!*regular) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoAddDenseProduct(N, lcp->M, dz, dw));
  s.rate_r = ConeTangentLargest(n, dz + p);
  s.rate_w = PetscMax(s.rate_w, ConeTangentLargest(n, dw + p));
  for (PetscInt k = 0; k < b->n && *regular; k++) {
    const PetscInt at = p + b->row[k];

    *regular = ConeTangentKeepsState(b->row[k + 1] - b->row[k], ConeTangentCoefficient(b, k), dmu[k], &s, z + at,
                                     w + at, dz + at, dw + at);
    if (!*regular) *regular = IsEmpty(N, lcp->M, at);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
