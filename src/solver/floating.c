/*
  Whether any contact forces balance the load on the rigid motions z that contact alone prevents:

    z_i.F = sum over contacts of (B z_i)_j L_j,   L >= 0

  Nonnegative least squares decide it, without a factor of K.
*/
#include <hycoalgorithms.h>
#include <hycosolverimpl.h>

/* Of the square of a motion, what forces leave of it: 0.1 % of its length; less is none. */
#define SLIDES_LEFT 1e-6

/* Adds normal forces to the forces r that come nearest to the load f, so that the rest f - A r is a motion along which
   no contact opens: the one by which the bodies slide. First of all contacts, then, if that leaves nothing, of those
   with a force; else r stays. */
PetscErrorCode HycoBlocksLeaveSlide(const HycoBlocks *blocks, PetscInt p, const PetscReal A[], const PetscReal f[],
                                    PetscReal r[])
{
  PetscReal *gram, *inverse, *rest, *x, size = 0, slide = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(p * p, &gram, p * p, &inverse, p, &rest, p, &x));
  PetscCall(PetscArraycpy(rest, f, p));
  for (PetscInt j = 0; j < blocks->row[blocks->n] * p; j++) rest[j % p] -= A[j] * r[j / p];
  for (PetscInt i = 0; i < p; i++) size += rest[i] * rest[i];
  for (PetscInt pass = 0; pass < 2 && !(slide > SLIDES_LEFT * size); pass++) {
    PetscCall(PetscArrayzero(gram, p * p));
    for (PetscInt k = 0; k < blocks->n; k++) {
      const PetscReal *a = A + blocks->row[k] * p;

      for (PetscInt i = 0; i < p * p && (!pass || r[blocks->row[k]] > 0); i++) gram[i] += a[i / p] * a[i % p];
    }
    PetscCall(HycoPseudoInverse(p, p, gram, 1e-12, inverse));
    PetscCall(PetscArrayzero(x, p));
    for (PetscInt i = 0; i < p * p; i++) x[i / p] += inverse[i] * rest[i % p];
    slide = 0;
    for (PetscInt i = 0; i < p; i++) {
      PetscReal left = rest[i];

      for (PetscInt j = 0; j < p; j++) left -= gram[i * p + j] * x[j];
      slide += left * left;
    }
    for (PetscInt k = 0; k < blocks->n && slide > SLIDES_LEFT * size; k++) {
      PetscReal *own = r + blocks->row[k];

      PetscReal more = 0;

      for (PetscInt i = 0; i < p; i++) more += A[blocks->row[k] * p + i] * x[i];
      if (!pass || *own > 0) *own += more;
    }
  }
  PetscCall(PetscFree4(gram, inverse, rest, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with other cones, as of friction, on the orthonormal motions; without forces that balance the load, the
   rest of it with L tells how the bodies move. */
static PetscErrorCode SolverFloatingNoEquilibrium(HycoSystem y, PetscInt p, const Vec z[], Vec L,
                                                  PetscBool *no_equilibrium)
{
  HycoBlocks *blocks;
  PetscReal *A, *f, *row;
  PetscInt lo, hi;
  PetscBool exists;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(HycoBlocksGather(HycoComm(y), y->blocks, &blocks));
  PetscCall(PetscMalloc3(p * y->m, &A, p, &f, y->m, &row));
  PetscCall(HycoMotionRows(y->B, p, z, y->work_L, A));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecDot(y->F, z[i], &f[i]));
  PetscCall(HycoBlocksBalance(blocks, p, A, f, 0, row, &exists));
  *no_equilibrium = (PetscBool)!exists;
  if (*no_equilibrium) PetscCall(HycoBlocksLeaveSlide(blocks, p, A, f, row));
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  if (*no_equilibrium) PetscCall(HycoVecWrite(L, hi - lo, row + lo));
  PetscCall(PetscFree3(A, f, row));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without other cones: the nearest forces of least squares in L, whose rest is a motion that closes no contact. */
static PetscErrorCode SolverFloatingLiftOff(HycoSystem y, PetscInt p, const Vec z[], Vec L, PetscBool *lift_off)
{
  PetscReal *A, *f, *row, all;
  PetscInt lo, hi;
  PetscBool exists;

  PetscFunctionBegin;
  PetscCall(HycoSystemWork(y));
  PetscCall(PetscMalloc3(p * y->m, &A, p, &f, y->m, &row));
  PetscCall(HycoMotionRows(y->B, p, z, y->work_L, A));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecDot(y->F, z[i], &f[i]));
  PetscCall(VecNorm(y->F, NORM_1, &all));
  PetscCall(HycoNormalsBalance(p, y->m, A, f, HYCO_LOADS_ROUND_OFF * all, row, &exists));
  *lift_off = (PetscBool)!exists;
  PetscCall(VecGetOwnershipRange(L, &lo, &hi));
  if (*lift_off) PetscCall(HycoVecWrite(L, hi - lo, row + lo));
  PetscCall(PetscFree3(A, f, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the load lifts a floating body off, or moves it along: no contact forces balance it on the rigid modes.
   Otherwise a failure of the solver is its own. Collective. */
PetscErrorCode HycoSystemLiftOff(HycoSystem y, Vec L, PetscBool *lift_off)
{
  PetscInt p;
  const Vec *motion;

  PetscFunctionBegin;
  *lift_off = PETSC_FALSE;
  if (!y->K) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoKernelVectors(y->K, &p, &motion));
  if (!p || !y->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(y->blocks ? SolverFloatingNoEquilibrium(y, p, motion, L, lift_off)
                      : SolverFloatingLiftOff(y, p, motion, L, lift_off));
  PetscFunctionReturn(PETSC_SUCCESS);
}
