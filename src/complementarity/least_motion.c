/*
  Bodies along whose motions no contact force acts, as where friction alone would hold them and its coefficient is 0: of
  the solutions, which differ by these motions, the one in which the closed contacts slip least in the step, then the
  one with the least motion, where no gap becomes negative.
*/
#include <hycoconeimpl.h>
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Weight of a motion itself beside that of slips, whose square is round-off of 1: it decides only what no slip of a
   closed contact does. */
#define LAST_WEIGHT 1e-12
#define TINY_SLIP   1e-12 /* of the largest gap or slip: 4500 eps, the least squares that make it */

/* Coulomb's law: its first datum is the coefficient. */
PetscBool HycoBlockHasFriction(const HycoBlocks *b, PetscInt k)
{
  return (PetscBool)(b->row[k + 1] - b->row[k] > 1 && b->data[b->at[k]] > 0);
}

/* Adds to gram (p x p) the squares of the rows of block k on scaled motions. slip: the friction of a contact that slips
   along it, which turns with a motion across the slip and resists that one; NULL: the tangents hold as the normal does,
   if there is friction. */
static void AddHeld(const HycoBlocks *b, PetscInt k, PetscInt p, const PetscReal A[], const PetscReal scale[],
                    const PetscReal slip[], PetscReal gram[])
{
  const PetscInt first = b->row[k], size = HycoBlockHasFriction(b, k) ? b->row[k + 1] - first : 1;
  PetscReal square = 0;

  for (PetscInt c = 1; slip && c < size; c++) square += slip[c] * slip[c];
  for (PetscInt i = 0; i < p * p; i++) {
    PetscReal with[2] = {0, 0};

    for (PetscInt c = 1; square > 0 && c < size; c++) {
      with[0] += A[(first + c) * p + i / p] * slip[c] / square;
      with[1] += A[(first + c) * p + i % p] * slip[c] / square;
    }
    for (PetscInt c = 0; c < size; c++) {
      const PetscReal along = c && square > 0 ? slip[c] : 0, *a = A + (first + c) * p;

      gram[i] += (a[i / p] - along * with[0]) * (a[i % p] - along * with[1]) / (scale[i / p] * scale[i % p]);
    }
  }
}

/* The free motions (p x n by columns) of the rows of blocks with a force, on scaled motions: tangents hold where there
   is friction; r: the forces, where blocks slip by them; NULL: none does. */
static PetscErrorCode FreeMotions(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal scale[],
                                  const PetscBool closed[], const PetscBool slips[], const PetscReal r[], PetscInt *n,
                                  PetscReal N[])
{
  PetscReal *gram, *value, *work;
  PetscBLASInt size, lwork, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(p, &size));
  lwork = 8 * size;
  PetscCall(PetscCalloc3(p * p, &gram, p, &value, 8 * p, &work));
  for (PetscInt k = 0; k < b->n; k++) {
    if (closed[k]) AddHeld(b, k, p, A, scale, r && slips[k] ? r + b->row[k] : NULL, gram);
  }
  LAPACKsyev_("V", "U", &size, gram, &size, value, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  for (*n = 0; *n < p && value[*n] <= HYCO_FREE_MOTION; ++*n) {
    for (PetscInt i = 0; i < p; i++) N[*n * p + i] = gram[*n * p + i] / scale[i];
  }
  PetscCall(PetscFree3(gram, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the square of a . c - rhs. */
static void AddSquare(PetscInt n, PetscReal weight, const PetscReal a[], PetscReal rhs, PetscReal H[], PetscReal g[])
{
  for (PetscInt i = 0; i < n; i++) g[i] += weight * a[i] * rhs;
  for (PetscInt i = 0; i < n * n; i++) H[i] += weight * a[i / n] * a[i % n];
}

/* The row of A on the motions N. */
static void OnMotions(PetscInt p, PetscInt n, const PetscReal row[], const PetscReal N[], PetscReal a[])
{
  for (PetscInt k = 0; k < n; k++) {
    a[k] = 0;
    for (PetscInt i = 0; i < p; i++) a[k] += row[i] * N[k * p + i];
  }
}

/* c of least squares, and coordinates E (n x n by columns) in which their sum grows alike in all directions. */
static PetscErrorCode LeastSlip(PetscInt n, PetscReal H[], const PetscReal g[], PetscReal c[], PetscReal E[])
{
  PetscReal *value, *work;
  PetscBLASInt size, lwork, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &size));
  lwork = 8 * size;
  PetscCall(PetscMalloc2(n, &value, 8 * n, &work));
  LAPACKsyev_("V", "U", &size, H, &size, value, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  PetscCall(PetscArrayzero(c, n));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal y = 0;

    for (PetscInt i = 0; i < n; i++) {
      E[k * n + i] = H[k * n + i] / PetscSqrtReal(PetscMax(value[k], LAST_WEIGHT * LAST_WEIGHT));
      y += E[k * n + i] * g[i];
    }
    for (PetscInt i = 0; i < n; i++) c[i] += y * E[k * n + i];
  }
  PetscCall(PetscFree2(value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes c as little as possible such that the gaps of open contacts stay; *exists: as is always so but for
   round-off. */
static PetscErrorCode KeepGaps(const HycoBlocks *b, PetscInt p, PetscInt n, const PetscReal A[], const PetscReal w[],
                               const PetscBool closed[], const PetscReal N[], const PetscReal E[], PetscReal c[],
                               PetscBool *exists)
{
  PetscReal *M, *q, *a, *y, most = 0;
  PetscInt *row, m = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * b->n + 1, &M, b->n + 1, &q));
  PetscCall(PetscCalloc3(n, &a, n, &y, b->n + 1, &row));
  for (PetscInt j = 0; j < b->row[b->n]; j++) most = PetscMax(most, PetscAbsReal(w[j]));
  for (PetscInt k = 0; k < b->n; k++) {
    row[k] = k;
    q[k] = closed[k] ? most : w[b->row[k]];
    OnMotions(p, n, A + (size_t)b->row[k] * (size_t)p, N, a);
    for (PetscInt i = 0; i < n; i++) {
      M[i * b->n + k] = 0;
      for (PetscInt l = 0; l < n && !closed[k]; l++) M[i * b->n + k] -= a[l] * E[i * n + l];
      if (!closed[k]) q[k] -= a[i] * c[i];
    }
    if (PetscAbsReal(q[k]) <= TINY_SLIP * most) q[k] = 0;
    m += !closed[k];
  }
  *exists = PETSC_TRUE;
  if (m) PetscCall(HycoLCPUnload(b->n, n, b->n, row, M, q, y, exists));
  for (PetscInt i = 0; i < n * n; i++) c[i % n] += E[i] * y[i / n];
  PetscCall(PetscFree2(M, q));
  PetscCall(PetscFree3(a, y, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lengths of the motions on all rows: of one unit with them. */
static void ScaleMotions(const HycoBlocks *b, PetscInt p, const PetscReal A[], PetscReal scale[])
{
  for (PetscInt j = 0; j < p * b->row[b->n]; j++) scale[j % p] += PetscSqr(A[j]);
  for (PetscInt i = 0; i < p; i++) scale[i] = scale[i] > 0 ? PetscSqrtReal(scale[i]) : 1;
}

/* Of the free motions the one along the friction f (p) of the contacts that slip, in the metric of all rows: whatever
   the basis of the motions is, the same. */
static PetscErrorCode FrictionSensitivity(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal f[],
                                          PetscInt n, const PetscReal N[], PetscReal first[])
{
  const PetscBLASInt size = (PetscBLASInt)n, one = 1;
  PetscBLASInt info, *pivot;
  PetscReal *a, *gram, *c, most = 0;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(first, N, p));
  PetscCall(PetscCalloc4(n, &a, n * n, &gram, n, &c, n, &pivot));
  for (PetscInt j = 0; j < b->row[b->n]; j++) {
    OnMotions(p, n, A + (size_t)j * (size_t)p, N, a);
    AddSquare(n, 1, a, 0, gram, c);
  }
  OnMotions(p, n, f, N, c);
  LAPACKgesv_(&size, &one, gram, &size, pivot, c, &size, &info);
  for (PetscInt k = 0; k < n; k++) most = PetscMax(most, PetscAbsReal(c[k]));
  for (PetscInt i = 0; i < p && !info && most > 0; i++) {
    first[i] = 0;
    for (PetscInt k = 0; k < n; k++) first[i] += N[k * p + i] * c[k] / most;
  }
  PetscCall(PetscFree4(a, gram, c, pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slipping contacts hold no motion along their surface. */
PetscErrorCode HycoBlocksFreeMotions(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal r[],
                                     PetscInt *n, PetscReal first[])
{
  PetscReal *scale, *N, *f, most = 0;
  PetscBool *closed, *slips;

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(p, &scale, p * p, &N, p, &f, b->n + 1, &closed, b->n + 1, &slips));
  ScaleMotions(b, p, A, scale);
  for (PetscInt k = 0; k < b->n; k++) most = PetscMax(most, r[b->row[k]]);
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal force = r[b->row[k]];
    PetscReal shear = 0;

    for (PetscInt j = b->row[k] + 1; j < b->row[k + 1]; j++) shear += r[j] * r[j];
    closed[k] = (PetscBool)(most > 0 && force > HYCO_FORCE_ROUND_OFF * most);
    slips[k] = (PetscBool)(HycoBlockHasFriction(b, k) &&
                           PetscSqrtReal(shear) >= (1 - HYCO_CONE_BORDER) * b->data[b->at[k]] * force);
    for (PetscInt j = b->row[k] + 1; j < b->row[k + 1] && slips[k]; j++) {
      for (PetscInt i = 0; i < p; i++) f[i] += A[j * p + i] * r[j];
    }
  }
  *n = 0;
  if (most > 0) PetscCall(FreeMotions(b, p, A, scale, closed, slips, r, n, N));
  if (*n) PetscCall(FrictionSensitivity(b, p, A, f, *n, N, first));
  PetscCall(PetscFree5(scale, N, f, closed, slips));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A: p x rows by columns; w changes by -A^T x. */
PetscErrorCode HycoBlocksLeastSlip(const HycoBlocks *b, PetscInt p, const PetscReal A[], const PetscReal w[],
                                   const PetscReal r[], const PetscReal move[], PetscReal x[], PetscInt *n,
                                   PetscReal first[])
{
  PetscReal *scale, *N, *H, *g, *a, *c, *E, most = 0;
  PetscBool *closed, exists;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(p, &scale, p * p, &N, b->n + 1, &closed));
  ScaleMotions(b, p, A, scale);
  for (PetscInt k = 0; k < b->n; k++) most = PetscMax(most, r[b->row[k]]);
  for (PetscInt k = 0; k < b->n; k++) closed[k] = (PetscBool)(most > 0 && r[b->row[k]] > HYCO_FORCE_ROUND_OFF * most);
  PetscCall(FreeMotions(b, p, A, scale, closed, NULL, NULL, n, N));
  PetscCall(PetscArrayzero(x, p));
  PetscCall(PetscArraycpy(first, N, p));
  PetscCall(PetscCalloc5(*n * *n + 1, &H, *n + 1, &g, *n + 1, &a, *n + 1, &c, *n * *n + 1, &E));
  for (PetscInt k = 0; k < b->n && *n; k++) {
    for (PetscInt j = b->row[k] + 1; j < b->row[k + 1] && closed[k]; j++) {
      OnMotions(p, *n, A + (size_t)j * (size_t)p, N, a);
      AddSquare(*n, 1, a, w[j], H, g);
    }
  }
  for (PetscInt i = 0; i < p && *n; i++) {
    for (PetscInt k = 0; k < *n; k++) a[k] = N[k * p + i] * scale[i];
    AddSquare(*n, LAST_WEIGHT, a, -move[i] * scale[i], H, g);
  }
  if (*n) {
    PetscCall(LeastSlip(*n, H, g, c, E));
    PetscCall(KeepGaps(b, p, *n, A, w, closed, N, E, c, &exists));
    for (PetscInt i = 0; i < p * *n && exists; i++) x[i % p] += N[i] * c[i / p];
  }
  PetscCall(PetscFree3(scale, N, closed));
  PetscCall(PetscFree5(H, g, a, c, E));
  PetscFunctionReturn(PETSC_SUCCESS);
}
