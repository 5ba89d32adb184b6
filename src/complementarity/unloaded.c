/*
  Floating bodies on which no load acts: contact forces 0 solve w = q + M z, z = (x, forces), where a motion x leaves no
  gap negative, q + G x >= 0 with G the columns of x in M. The nearest one to a given x is a problem of least distance,
  a nonnegative least-squares problem in multipliers (C. L. Lawson, R. J. Hanson, Solving Least Squares Problems (1974),
  chapter 23).
*/
#include <hycoalgorithms.h>
#include <hycolcp.h>

/* Of the right-hand side 1 of the least squares, their residual: it is 0 but for its square root of eps, or no motion
   opens all contacts. */
#define OPENS_ALL 1e-8

/* G d >= -w, |d| least: with E = (G, -w)^T and u >= 0 of least |E u - e|, e = (0, 1), d = -r / r_last for r = E u -
   e. */
static PetscErrorCode LeastDistance(PetscInt p, PetscInt n, const PetscReal E[], PetscReal d[], PetscBool *exists)
{
  PetscReal *u, *e, *r, residual;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &u));
  PetscCall(PetscCalloc2(p + 1, &e, p + 1, &r));
  e[p] = 1;
  PetscCall(HycoNNLS(p + 1, n, E, e, u, &residual));
  for (PetscInt i = 0; i <= p; i++) r[i] = -e[i];
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt i = 0; i <= p; i++) r[i] += u[k] * E[k * (p + 1) + i];
  }
  *exists = (PetscBool)(residual > OPENS_ALL && r[p] < 0);
  for (PetscInt i = 0; i < p && *exists; i++) d[i] = -r[i] / r[p];
  PetscCall(PetscFree(u));
  PetscCall(PetscFree2(e, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M: N x N by columns, of which the first p are G; row[n]: the contacts' normal rows. x stays where it leaves no gap
   negative. */
PetscErrorCode HycoLCPUnload(PetscInt N, PetscInt p, PetscInt n, const PetscInt row[], const PetscReal M[],
                             const PetscReal q[], PetscReal x[], PetscBool *exists)
{
  PetscReal *E, *d, most = 0, least = 0, unit = 0;

  PetscFunctionBegin;
  *exists = PETSC_TRUE;
  PetscCall(PetscMalloc2(n * (p + 1) + 1, &E, p + 1, &d));
  for (PetscInt k = 0; k < n; k++) E[k * (p + 1) + p] = q[row[k]];
  for (PetscInt i = 0; i < p; i++) {
    const PetscReal round_off = HYCO_TANGENTIAL * HycoMotionReach(N, p, M, i);

    for (PetscInt k = 0; k < n; k++) {
      const PetscReal entry = M[(size_t)i * (size_t)N + (size_t)row[k]];
      PetscReal *column = E + k * (p + 1);

      column[i] = PetscAbsReal(entry) > round_off ? entry : 0;
      column[p] += column[i] * x[i];
      unit = PetscMax(unit, PetscAbsReal(column[i]));
    }
  }
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *w = &E[k * (p + 1) + p];

    most = PetscMax(most, PetscAbsReal(*w));
    least = PetscMin(least, *w);
    *w = -*w;
  }
  /* In units of the largest gap and of the motion that changes one by as much: both rows of E and d are of size 1, so
     that r_last does not cancel. */
  for (PetscInt k = 0; k < n && least < 0; k++) {
    for (PetscInt i = 0; i < p && unit > 0; i++) E[k * (p + 1) + i] /= unit;
    E[k * (p + 1) + p] /= most;
  }
  if (least < 0) PetscCall(LeastDistance(p, n, E, d, exists));
  for (PetscInt i = 0; i < p && least < 0 && *exists; i++) x[i] += most / unit * d[i];
  PetscCall(PetscFree2(E, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
