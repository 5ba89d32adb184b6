/*
  A singular K: floating bodies. The owner of the system attaches the null space (MatSetNullSpace()). As many unknowns
  as its dimension, chosen so that K without them is well conditioned, become unknowns of the dense problem.
*/
#include <hycolinear.h>
#include <petscblaslapack.h>

/* Of the sum of the loads, their work on a motion: 4.5e6 eps; only smaller work is tested for round-off, as the test
   costs a solve and a sum. */
#define SUSPECT_WORK 1e-9
/* Of the largest entry of a motion, another body's: 45 eps, the solve for the motion that moves one pin. */
#define OTHER_BODY 1e-14

/* Number of rigid modes attached to K: 0 if K is regular. */
PetscErrorCode HycoKernelSize(Mat K, PetscInt *n)
{
  MatNullSpace kernel = NULL;
  PetscBool constant = PETSC_FALSE;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(MatGetNullSpace(K, &kernel));
  if (kernel) PetscCall(MatNullSpaceGetVecs(kernel, &constant, n, NULL));
  /* The constant vector is no rigid motion of a vector field. */
  PetscCheck(!constant, PetscObjectComm((PetscObject)K), PETSC_ERR_SUP,
             "give the null space of K by vectors only (MatNullSpaceCreate() without the constant)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's rows of the n motions, row major. */
static PetscErrorCode NullSpaceRows(PetscInt n, const Vec v[], PetscInt *rows, PetscReal **row)
{
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(v[0], rows));
  /* An unknown's entries in all motions lie together: pivots are chosen by the length of such rows. */
  PetscCall(PetscMalloc1(*rows * n, row));
  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *a;

    PetscCall(VecGetArrayRead(v[k], &a));
    for (PetscInt i = 0; i < *rows; i++) (*row)[i * n + k] = a[i];
    PetscCall(VecRestoreArrayRead(v[k], &a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknown with the longest row, the lowest among equals; its row, scaled to length 1, on every rank. Equal
   within 1e-10, because symmetric bodies have many such rows. Collective. */
static PetscErrorCode NullSpaceLongestRow(MPI_Comm comm, PetscInt first, PetscInt rows, PetscInt n,
                                          const PetscReal row[], PetscInt *at, PetscReal unit[])
{
  PetscReal best = 0, largest;
  PetscInt mine = PETSC_MAX_INT;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < rows; i++) {
    PetscReal size = 0;

    for (PetscInt k = 0; k < n; k++) size += row[i * n + k] * row[i * n + k];
    if (size > best * (1 + 1e-10)) {
      best = size;
      mine = first + i;
    }
  }
  PetscCallMPI(MPI_Allreduce(&best, &largest, 1, MPIU_REAL, MPI_MAX, comm));
  /* Only ranks with a longest row take part; the lowest unknown of them is the same on any number of ranks. */
  if (best < largest * (1 - 1e-10)) mine = PETSC_MAX_INT;
  PetscCallMPI(MPI_Allreduce(&mine, at, 1, MPIU_INT, MPI_MIN, comm));
  for (PetscInt k = 0; k < n; k++)
    unit[k] = *at >= first && *at < first + rows ? row[(*at - first) * n + k] / PetscSqrtReal(largest) : 0;
  HycoAllreduce(unit, n, MPIU_REAL, MPI_SUM, comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n unknowns, ascending, such that K without them is regular: pivots of the motions' rows. Collective. */
PetscErrorCode HycoMotionPins(PetscInt n, const Vec v[], PetscInt pinned[])
{
  PetscInt rows, first;
  PetscReal *row, *unit;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetOwnershipRange(v[0], &first, NULL));
  PetscCall(NullSpaceRows(n, v, &rows, &row));
  PetscCall(PetscMalloc1(n, &unit));
  for (PetscInt p = 0; p < n; p++) { /* pivoted Gram-Schmidt on the rows */
    /* The row that is largest over all ranks; ties go to the smallest number. */
    PetscCall(NullSpaceLongestRow(PetscObjectComm((PetscObject)v[0]), first, rows, n, row, &pinned[p], unit));
    /* What the pin holds is removed from the other rows. */
    for (PetscInt i = 0; i < rows; i++) {
      PetscReal dot = 0;

      for (PetscInt k = 0; k < n; k++) dot += row[i * n + k] * unit[k];
      for (PetscInt k = 0; k < n; k++) row[i * n + k] -= dot * unit[k];
    }
  }
  PetscCall(PetscSortInt(n, pinned));
  HycoFreeAll(&row, &unit);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoKernelVectors(Mat K, PetscInt *n, const Vec *v[])
{
  MatNullSpace kernel = NULL;

  PetscFunctionBegin;
  *n = 0;
  *v = NULL;
  PetscCall(MatGetNullSpace(K, &kernel));
  if (kernel) PetscCall(MatNullSpaceGetVecs(kernel, NULL, n, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the null space of K. Collective. */
PetscErrorCode HycoKernelPins(Mat K, PetscInt n, PetscInt pinned[])
{
  const Vec *v;
  PetscInt all;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(K, &all, &v));
  PetscCall(HycoMotionPins(n, v, pinned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |z.(F - b)| without the round-off of K x, relative to the forces; least: of |z|. Limited to 1 %, so that a large x
   does not hide any load. */
static PetscErrorCode WorkOn(Vec z, Vec F, Vec b, Vec Kx, PetscReal least, Vec work, PetscReal *share)
{
  const Vec force[2] = {F, b};
  PetscReal on[2] = {0, 0}, all[2] = {0, 0}, norm, size, rounding;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < 2 && force[j]; j++) {
    PetscCall(VecPointwiseMult(work, force[j], z));
    PetscCall(VecSum(work, &on[j]));
    PetscCall(VecNorm(work, NORM_1, &all[j]));
  }
  PetscCall(VecPointwiseMult(work, Kx, z));
  PetscCall(VecNorm(work, NORM_1, &rounding));
  PetscCall(VecNorm(z, NORM_2, &norm));
  size = PetscMax(all[0] + all[1], least * norm);
  /* Of at most 1 per cent: beyond it an unbalanced load would be hidden. */
  rounding = PetscMin(HYCO_NOTHING * rounding, 1e-2 * size);
  *share = size > 0 ? PetscMax(PetscAbsReal(on[0] - on[1]) - rounding, 0) / size : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest share of the forces' work on a rigid mode that is unbalanced: no x changes it. Collective. */
PetscErrorCode HycoKernelWork(Mat K, Vec x, Vec F, Vec b, PetscReal *share)
{
  PetscReal norm[2] = {0, 0}, one = 0;
  const Vec *z;
  PetscInt n;
  Vec work, Kx;

  PetscFunctionBegin;
  *share = 0;
  PetscCall(HycoKernelVectors(K, &n, &z));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  HycoVecDuplicate(F, &work, &Kx);
  PetscCall(MatGetDiagonal(K, Kx));
  /* diag(K) x: the size of the terms of K x. */
  PetscCall(VecPointwiseMult(Kx, Kx, x));
  PetscCall(VecNorm(F, NORM_2, &norm[0]));
  if (b) PetscCall(VecNorm(b, NORM_2, &norm[1]));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(WorkOn(z[k], F, b, Kx, 1e-2 * PetscMax(norm[0], norm[1]), work, &one));
    *share = PetscMax(*share, one);
  }
  HycoDestroyAll(&work, &Kx);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V (n x n, by columns): the n motions v at the pinned unknowns, on every rank. Collective. */
PetscErrorCode HycoMotionAtPins(PetscInt n, const Vec v[], const PetscInt pinned[], PetscReal V[])
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v[0], &lo, &hi));
  PetscCall(PetscArrayzero(V, n * n));
  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *a;

    PetscCall(VecGetArrayRead(v[k], &a));
    for (PetscInt i = 0; i < n; i++) {
      if (pinned[i] >= lo && pinned[i] < hi) V[k * n + i] = a[pinned[i] - lo];
    }
    PetscCall(VecRestoreArrayRead(v[k], &a));
  }
  HycoAllreduce(V, n * n, MPIU_REAL, MPI_SUM, PetscObjectComm((PetscObject)v[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A (p x rows of B, by columns), on every rank: B z. work: of B's rows. */
PetscErrorCode HycoMotionRows(Mat B, PetscInt p, const Vec z[], Vec work, PetscReal A[])
{
  PetscReal *row;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(work, &n));
  PetscCall(PetscMalloc1(n + 1, &row));
  for (PetscInt i = 0; i < p; i++) {
    PetscCall(MatMult(B, z[i], work));
    PetscCall(HycoVecGather(work, row));
    for (PetscInt j = 0; j < n; j++) A[j * p + i] = row[j];
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The elimination that finds w leaves more round-off than the sum of its terms, and a body that loads in equilibrium
   with themselves do not move would be pushed by it. Only where w is small: elsewhere it keeps its digits. Springs on a
   motion do work on the deformation of the body too, which the sum lacks. */
PetscErrorCode HycoMotionClean(PetscInt n, const Vec v[], const PetscReal stiffness[], const PetscInt pinned[], Vec F,
                               PetscReal least, PetscReal w[])
{
  PetscBool any = PETSC_FALSE, resisted;
  PetscBLASInt size, one = 1, info, *pivot;
  PetscReal *V, *c, all;
  Vec motion, work;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(F, NORM_1, &all));
  for (PetscInt i = 0; i < n; i++) any = (PetscBool)(any || (w[i] != 0 && PetscAbsReal(w[i]) <= SUSPECT_WORK * all));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(n, &size));
  PetscCall(PetscMalloc3(n * n, &V, n, &c, n, &pivot));
  PetscCall(HycoMotionAtPins(n, v, pinned, V));
  LAPACKgetrf_(&size, &size, V, &size, pivot, &info);
  HycoVecDuplicate(F, &motion, &work);
  for (PetscInt i = 0; i < n && !info; i++) {
    PetscReal sum, terms, reach;

    if (w[i] == 0 || PetscAbsReal(w[i]) > SUSPECT_WORK * all) continue;
    /* The motion that moves this pin by 1 and no other one. */
    PetscCall(PetscArrayzero(c, n));
    c[i] = 1;
    LAPACKgetrs_("N", &size, &one, V, &size, pivot, c, &size, &info);
    PetscCall(VecZeroEntries(motion));
    resisted = PETSC_FALSE;
    for (PetscInt k = 0; k < n; k++) {
      /* Those of other bodies have round-off here. */
      if (!(PetscAbsReal(c[k]) > OTHER_BODY)) continue;
      PetscCall(VecAXPY(motion, c[k], v[k]));
      resisted = (PetscBool)(resisted || (stiffness && stiffness[k] != 0));
    }
    if (resisted) continue;
    PetscCall(VecNorm(motion, NORM_INFINITY, &reach));
    PetscCall(VecPointwiseMult(work, motion, F));
    PetscCall(VecSum(work, &sum));
    PetscCall(VecNorm(work, NORM_1, &terms));
    if (PetscAbsReal(sum) <= PetscMax(HYCO_WORK_ROUND_OFF * terms, least * reach)) w[i] = 0;
  }
  HycoDestroyAll(&motion, &work);
  PetscCall(PetscFree3(V, c, pivot));
  PetscFunctionReturn(PETSC_SUCCESS);
}
