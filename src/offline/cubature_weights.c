/*
  Empirical cubature (Hernandez, Caicedo, Ferrer, Comput. Methods Appl. Mech. Engrg. 313 (2017) 687-722; with the
  conditions of ECSW: Farhat, Avery, Chapman, Cortial, Int. J. Numer. Meth. Engng 98 (2014) 625-662): few cells and
  weights w >= 0 with

    W^T w = W^T 1,    sum of w_e vol_e over a body = its volume,

  W the leading singular vectors of the cells' contributions to the reduced internal forces. w = 1 is a solution;
  nonnegative least squares find one with at most as many cells as equations. Cells at contacts with full-order
  displacements have w = 1 and are not in these equations.
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>

/* Gathers column j of A (rows distributed) on rank 0. Collective. A column at a time: A may have hundreds, and
   rank 0 takes them into one array. */
static PetscErrorCode GatherColumn(Mat A, PetscInt j, PetscReal column[])
{
  VecScatter scatter;
  PetscInt n;
  Vec v, all;

  PetscFunctionBegin;
  PetscCall(MatDenseGetColumnVecRead(A, j, &v));
  PetscCall(VecScatterCreateToZero(v, &scatter, &all));
  PetscCall(HycoScatter(scatter, v, all));
  PetscCall(MatDenseRestoreColumnVecRead(A, j, &v));
  PetscCall(VecGetLocalSize(all, &n));
  PetscCall(HycoVecRead(all, n, column));
  HycoDestroyAll(&scatter, &all);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data of a cell: its volume, 0 if its weight is fixed to 1; its body; whether its weight is fixed to 1. */
#define N_NOTES 3

/* By cell of the part. Volumes of fixed cells are 0: they contribute the same to both sides of the body's
   equation. */
static PetscErrorCode FillNotes(HycoFE fe, const PetscBool near[], PetscReal value[])
{
  const PetscInt n = fe->mesh->n_cells;
  PetscReal *volume;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &volume));
  ierr = HycoFEVolumes(fe, volume);
  for (PetscInt e = 0; e < n; e++) {
    value[N_NOTES * e] = near && near[e] ? 0 : volume[e];
    value[N_NOTES * e + 1] = fe->mesh->cell_body[e];
    /* Cells with a full-order displacement have weight 1, and are not chosen. */
    value[N_NOTES * e + 2] = near && near[e];
  }
  PetscCall(PetscFree(volume));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* These data, a column each, rows in the file's order. Collective. Volume, body and whether a cell is kept in any case,
   as columns of a matrix, so that one gathering serves for them too. */
static PetscErrorCode WeightsData(HycoReducer t, const PetscBool near[], PetscInt n_rows, Mat *X)
{
  HycoFE fe = t->fom->fe;
  PetscReal *value, *rows;
  PetscScalar *x;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(N_NOTES * fe->mesh->n_cells, &value, N_NOTES * n_rows, &rows));
  /* An inverted cell on one rank is an error on all. */
  HycoOnEach(HycoComm(t), FillNotes(fe, near, value));
  PetscCall(HycoFOMToRows(t->fom, HYCO_ON_CELLS, MPIU_REAL, N_NOTES, value, rows));
  PetscCall(MatCreateDense(HycoComm(t), n_rows, PETSC_DECIDE, t->sizes[1], N_NOTES, NULL, X));
  PetscCall(MatDenseGetLDA(*X, &lda));
  PetscCall(MatDenseGetArray(*X, &x));
  for (PetscInt i = 0; i < n_rows; i++) {
    for (PetscInt j = 0; j < N_NOTES; j++) x[j * lda + i] = rows[N_NOTES * i + j];
  }
  PetscCall(MatDenseRestoreArray(*X, &x));
  PetscCall(HycoMatAssemble(*X));
  PetscCall(PetscFree2(value, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A: a column per cell, the n leading entries of its row of W (columns of n_cells in `vectors`), then a row per body
   of volumes over their 2-norm; b = A 1. */
static void FillSystem(PetscInt n_cells, PetscInt n, const PetscReal vectors[], PetscInt n_bodies,
                       const PetscReal volume[], const PetscReal body[], PetscReal A[], PetscReal b[])
{
  const PetscInt m = n + n_bodies;

  for (PetscInt i = 0; i < m; i++) {
    PetscReal size = 0;

    b[i] = 0;
    /* Volumes over their 2-norm: rows of length 1, as the singular vectors have. */
    for (PetscInt e = 0; e < n_cells && i >= n; e++) size += (PetscInt)body[e] == i - n ? volume[e] * volume[e] : 0;
    for (PetscInt e = 0; e < n_cells; e++) {
      PetscReal *a = A + (size_t)e * (size_t)m + (size_t)i;

      if (i < n)
        *a = vectors[(size_t)i * (size_t)n_cells + (size_t)e];
      else
        *a = (PetscInt)body[e] == i - n && size > 0 ? volume[e] / PetscSqrtReal(size) : 0;
      b[i] += *a;
    }
  }
}

/* The relative errors of the weights on all n vectors' integrals, and on the volumes. */
static void WeightsMeasure(PetscInt n_cells, PetscInt n, const PetscReal vectors[], const PetscReal sigma[],
                           PetscInt n_bodies, const PetscReal volume[], const PetscReal body[], const PetscReal w[],
                           PetscReal error[2])
{
  PetscReal lost = 0, size = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal missed = 0, all = 0;

    for (PetscInt e = 0; e < n_cells; e++) {
      missed += vectors[(size_t)i * (size_t)n_cells + (size_t)e] * (w[e] - 1);
      all += vectors[(size_t)i * (size_t)n_cells + (size_t)e];
    }
    /* Vectors are orthonormal: their singular values give each the weight that it has in the contributions. */
    lost += sigma[i] * missed * sigma[i] * missed;
    size += sigma[i] * all * sigma[i] * all;
  }
  error[0] = HycoRelative(PetscSqrtReal(lost), PetscSqrtReal(size));
  error[1] = 0;
  for (PetscInt b = 0; b < n_bodies; b++) {
    PetscReal missed = 0, all = 0;

    for (PetscInt e = 0; e < n_cells; e++) {
      if ((PetscInt)body[e] != b) continue;
      missed += volume[e] * (w[e] - 1);
      all += volume[e];
    }
    /* A body without any chosen cell would lose its whole volume: the largest, not the mean. */
    error[1] = PetscMax(error[1], HycoRelative(PetscAbsReal(missed), all));
  }
}

/* A monitor of NNLS: k cells so far. */
static PetscErrorCode ShowCells(void *ctx, PetscInt k, PetscInt most)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerTell((HycoReducer)ctx, "cells of the cubature", k, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the weights of all cells. On rank 0. */
static PetscErrorCode FindWeights(HycoReducer t, PetscReal fixed, PetscReal tol, PetscInt n, const PetscReal vectors[],
                                  const PetscReal sigma[], const PetscReal notes[], PetscReal w[], PetscReal error[2])
{
  const PetscInt n_cells = t->sizes[1], n_bodies = t->scene->n_bodies;
  const PetscReal *volume = notes, *body = notes + n_cells, *near = notes + 2 * n_cells;
  /* The POD's energy is a square, tol an error: tol^2 of the energy may be left. */
  const PetscInt leading = HycoPODRank(n, sigma, tol * tol, t->noise, 0), m = leading + n_bodies;
  PetscReal *A, *b;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((size_t)m * (size_t)n_cells, &A, m, &b));
  FillSystem(n_cells, leading, vectors, n_bodies, volume, body, A, b);
  PetscCall(HycoNNLSMonitored(m, n_cells, A, b, ShowCells, t, w, NULL));
  PetscCall(PetscFree2(A, b));
  for (PetscInt e = 0; e < n_cells; e++) w[e] = near[e] > 0 ? fixed : w[e];
  WeightsMeasure(n_cells, n, vectors, sigma, n_bodies, volume, body, w, error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights by nonnegative least squares (Lawson and Hanson 1974): few positive ones, and a tangent that stays definite
   (ECSW; Farhat et al. 2014). */
PetscErrorCode HycoCubatureFind(HycoReducer t, const PetscBool near[], PetscReal fixed, PetscReal tol, Mat W,
                                PetscInt n, const PetscReal sigma[], PetscReal w[], PetscReal error[2])
{
  const size_t n_cells = t->rank ? 0 : (size_t)t->sizes[1];
  PetscReal *vectors, *notes;
  PetscInt rows;
  Mat X;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(W, &rows, NULL));
  PetscCall(WeightsData(t, near, rows, &X));
  PetscCall(PetscMalloc2((size_t)n * n_cells + 1, &vectors, N_NOTES * n_cells + 1, &notes));
  /* All cells of n vectors on rank 0: nonnegative least squares is a serial algorithm. */
  for (PetscInt j = 0; j < n; j++) PetscCall(GatherColumn(W, j, vectors + (size_t)j * n_cells));
  for (PetscInt j = 0; j < N_NOTES; j++) PetscCall(GatherColumn(X, j, notes + (size_t)j * n_cells));
  PetscCall(MatDestroy(&X));
  HycoOnRoot(HycoComm(t), FindWeights(t, fixed, tol, n, vectors, sigma, notes, w, error));
  HycoBcast(error, 2, MPIU_REAL, HycoComm(t));
  PetscCall(PetscFree2(vectors, notes));
  PetscFunctionReturn(PETSC_SUCCESS);
}
