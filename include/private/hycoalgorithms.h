/* Algorithms on arrays and matrices alone: no scene, no mesh, no printing. */
#ifndef HYCOALGORITHMS_H
#define HYCOALGORITHMS_H

#include <hycoimpl.h>
#include <slepcsvd.h>

/* The default SVD type, accurate to round-off: tall-skinny QR of a dense matrix, then the SVD of the triangular
   factor. */
#define HYCO_SVD_TSQR "tsqr"
/* Registers HYCO_SVD_TSQR beside SLEPc's types. */
PetscErrorCode HycoSVDRegisterAll(void);
/* Creates an SVD of type HYCO_SVD_TSQR for HycoPOD(). The caller owns it. */
PetscErrorCode HycoPODCreateSVD(MPI_Comm comm, SVD *svd);

/*
  POD (17)-(18) in the 2-norm of a dense matrix S (N x n_s, any row distribution). V (N x l, the caller owns it) holds
  the first l left singular vectors, with the smallest l whose energy is at least 1 - tol. Singular values below noise *
  sigma_1 are never taken, nor more than max_modes (0: no limit). sigma (room for n_s) receives min(N, n_s) singular
  values. Sign of a mode: its entry of largest magnitude is positive. A zero matrix gives l = 0 and V = NULL. svd: this
  function sets its type, settings and options prefix, and reads its options. If the SVD type finds some modes
  inaccurately or not at all, the modes from the first of these on are left out; sigma then has one value for all their
  energy, followed by zeros; l is less than HycoPODRank() returns if (18) needs them. Collective on S, and on svd, which
  has the communicator of S.
*/
PetscErrorCode HycoPOD(SVD svd, Mat S, PetscReal tol, PetscReal noise, PetscInt max_modes, Mat *V, PetscInt *l,
                       PetscReal sigma[]);

/*
  POD of columns that arrive in blocks. *merged (NULL at first) becomes V diag(sigma) of [*merged S], without the modes
  of least energy that together have at most the share `loss` of it (NULL: all are zero). *S is freed and set to NULL.
  HycoPOD() of the last *merged has the singular values of all columns, up to the square root of the energy that the
  calls have cut off. svd: of type HYCO_SVD_TSQR. Needs twice the memory of [*merged S], and that of the result.
  Collective, as HycoPOD().
*/
PetscErrorCode HycoPODMerge(SVD svd, PetscReal loss, Mat *merged, Mat *S);
/* Copies the first n columns of the dense X into Y, which has the same rows, from column `at` on. Collective. */
PetscErrorCode HycoCopyColumns(Mat X, PetscInt n, Mat Y, PetscInt at);
/* Creates [A B] of dense matrices with the same rows on each rank, and destroys both. Collective. */
PetscErrorCode HycoJoinColumns(Mat *A, Mat *B, Mat *joined);

/* The number l of k singular values that HycoPOD() takes. It sums the tail, so that tol can be tiny. */
PetscInt HycoPODRank(PetscInt k, const PetscReal sigma[], PetscReal tol, PetscReal noise, PetscInt max_modes);

/*
  POD from a Gram matrix G = S^T M S (n_s x n_s, column major, on every rank): coefficients W (n_s x l, column major,
  the caller frees) such that S W is orthonormal in M. Singular values below 1e-7 of the first are lost to round-off.
  Not collective.
*/
PetscErrorCode HycoPODGram(PetscInt n_s, const PetscReal G[], PetscReal tol, PetscReal noise, PetscReal **W,
                           PetscInt *l, PetscReal sigma[]);

/*
  DEIM (Chaturantabut, Sorensen, SIAM J. Sci. Comput. 32 (2010) 2737-2764): l interpolation rows of the basis V
  (N x l). Of rows equally large (to 1e-10) the lowest is taken. Collective; index on every rank.
*/
PetscErrorCode HycoDEIM(Mat V, PetscInt index[]);
/*
  Q-DEIM (Drmac, Gugercin, SIAM J. Sci. Comput. 38 (2016) A631-A648): the first l pivots of QR with column pivoting of
  V^T, which do not change under a rotation of the modes. Ties and ranks as in HycoDEIM().
*/
PetscErrorCode HycoQDEIM(Mat V, PetscInt index[]);
/* The same, up to the rank of V, which may be less than l. */
PetscErrorCode HycoQDEIMRank(Mat V, PetscInt index[], PetscInt *rank);

/* Rows of a dense distributed matrix (n x cols row major), on every rank. Collective. */
PetscErrorCode HycoGatherRows(Mat V, PetscInt n, const PetscInt rows[], PetscReal values[]);

/* Coordinate j >= 0 of point k >= 1 of Halton's sequence, in (0, 1). */
PetscReal HycoHalton(PetscInt k, PetscInt j);

/* min |A x - b|_2, x >= 0: Lawson, Hanson, Solving Least Squares Problems (1974), chapter 23. A: m x n column major.
 * Not collective. */
PetscErrorCode HycoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], PetscReal x[],
                        PetscReal *residual);
/* The same; monitor(ctx, k, most) is called with each set of k columns, of `most` at most. */
PetscErrorCode HycoNNLSMonitored(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[],
                                 PetscErrorCode (*monitor)(void *ctx, PetscInt k, PetscInt most), void *ctx,
                                 PetscReal x[], PetscReal *residual);
/* Moves the k passive entries x[p[j]] towards z[j] until one of them becomes 0: returns its j, or -1 if z itself is
   reached. */
PetscInt HycoNNLSStep(PetscInt k, const PetscInt p[], const PetscReal z[], PetscReal x[]);

/*
  Fits c such that y <= sum_j c_j X_j + c[p] for `share` of rows like these n > 0; c_j >= 0 by regularised least squares
  over the first `telling` rows. c[p] is the quantile number ceil(share (n + 1)), at most the largest, of what the rows
  have above a formula fitted without their group; if groups are few, at least the upper tolerance limit of normal
  values (confidence 0.75). Rows with the same number group[i] depend on each other. X: n x p row major; c: p + 1. Not
  collective.
*/
PetscErrorCode HycoUpperBound(PetscInt n, PetscInt explanatory, const PetscInt group[], PetscInt p, const PetscReal X[],
                              const PetscReal y[], PetscReal share, PetscReal c[]);
/* Sets only c[p], for given c_j. */
PetscErrorCode HycoRaiseBound(PetscInt n, const PetscInt group[], PetscInt p, const PetscReal X[], const PetscReal y[],
                              PetscReal share, PetscReal c[]);

/*
  Many problems over one S (m x n column major, borrowed): min 1/2 sum_k d_k (S x)_k^2 - h^T S x + shift/2 |x|^2, x >=
  0, that is |diag(sqrt(d)) S x - b|^2 / 2 with h = sqrt(d) b. d >= 0 and h: m each. shift > 0 makes the solution
  unique. Nothing is allocated after Create; a solution does not depend on earlier problems. *solved: the optimality
  conditions, recomputed from S, hold to rtol of the largest entry of S^T h. Not collective.
*/
typedef struct _n_HycoWeighted *HycoWeighted;
PetscErrorCode HycoWeightedCreate(PetscInt m, PetscInt n, const PetscReal S[], PetscReal shift, HycoWeighted *weighted);
PetscErrorCode HycoWeightedDestroy(HycoWeighted *weighted);
PetscErrorCode HycoWeightedNNLS(HycoWeighted weighted, const PetscReal d[], const PetscReal h[], PetscReal rtol,
                                PetscReal x[], PetscBool *solved);

/*
  Nonnegative factorisation S ~ W H by at most max_its alternations from the NNDSVD start, which is deterministic. S: m
  x n column major, no entry negative (else an error). W (room for m x k, column major) receives n_vectors <= k columns
  of unit 2-norm, no entry negative; fewer than k if S has a smaller rank, none if S is zero. misfit = |S - W H|_F^2 /
  |S|_F^2 (0 for S = 0). The result is a local minimum. Not collective.
*/
PetscErrorCode HycoNNMF(PetscInt m, PetscInt n, const PetscReal S[], PetscInt k, PetscInt max_its, PetscReal W[],
                        PetscInt *n_vectors, PetscReal *misfit);

/* The first k columns chosen by QR with column pivoting of A (m x n column major, overwritten). Not collective. */
PetscErrorCode HycoPivotColumns(PetscInt m, PetscInt n, PetscReal A[], PetscInt k, PetscInt pivot[]);
/* The min(m, n) singular values s of A (m x n column major, kept), in descending order; their extremes. Not
   collective. */
PetscErrorCode HycoSingularValues(PetscInt m, PetscInt n, const PetscReal A[], PetscReal s[]);
PetscErrorCode HycoExtremeSingularValues(PetscInt m, PetscInt n, const PetscReal A[], PetscReal *smallest,
                                         PetscReal *largest);
/* The pseudo-inverse P (n x m column major) of A (m x n column major, kept); singular values below tol times the first
 * are taken as 0. Not collective. */
PetscErrorCode HycoPseudoInverse(PetscInt m, PetscInt n, const PetscReal A[], PetscReal tol, PetscReal P[]);
/* Sign of the determinant of A (n x n column major, kept; 0: singular), and its smallest singular value over the
 * largest, by power iterations to about 1e-3. Not collective. */
PetscErrorCode HycoSingularity(PetscInt n, const PetscReal A[], PetscInt *sign, PetscReal *ratio);

/*
  Interpolation in a space of dim parameters from n points (n x dim row major, repeated points allowed): weight[k] >= 0
  of point k with sum 1, such that linear functions are reproduced exactly inside the hull. Multilinear if the points
  form a grid (always with one parameter), else linear on the simplices of their Delaunay triangulation (up to 8
  parameters). Outside, a grid uses the nearest point of its box; a triangulation uses the simplex whose barycentric
  coordinates are least negative, with negative ones set to 0. Fails if the points lie on one line or plane. Not
  collective.
*/
#define HYCO_INTERPOLANT_MAX_DIM 32
typedef struct _n_HycoInterpolant *HycoInterpolant;
PetscErrorCode HycoInterpolantCreate(PetscInt dim, PetscInt n, const PetscReal points[], HycoInterpolant *interpolant);
PetscErrorCode HycoInterpolantDestroy(HycoInterpolant *interpolant);
PetscErrorCode HycoInterpolantGetWeights(HycoInterpolant interpolant, const PetscReal point[], PetscReal weight[]);

/*
  Polynomials on a tensor grid. Axis p has n[p] nodes x[p][], ascending (borrowed; not read where n[p] is 1), and a
  degree; the number of a grid node runs fastest along the last axis. Values at the grid nodes: data, a column of `rows`
  numbers per node. Not collective.
*/
#define HYCO_TENSOR_MAX_DIM 32
typedef struct {
  PetscInt dim, n[HYCO_TENSOR_MAX_DIM], degree[HYCO_TENSOR_MAX_DIM];
  const PetscReal *x[HYCO_TENSOR_MAX_DIM];
} HycoTensor;
/* The n roots of the Chebyshev polynomial on [lo, hi], ascending: nearly optimal nodes for interpolation. */
PetscErrorCode HycoChebyshevNodes(PetscInt n, PetscReal lo, PetscReal hi, PetscReal x[]);
/* weight[k] of node k in the value at `at` of the least-squares polynomial of that degree (interpolation: n - 1), or
   of the highest degree that the nodes allow. */
PetscErrorCode HycoPolynomialWeights(PetscInt n, const PetscReal x[], PetscInt degree, PetscReal at,
                                     PetscReal weight[]);
PetscInt HycoTensorSize(const HycoTensor *t);
/* The weights of all grid nodes. */
PetscErrorCode HycoTensorWeights(const HycoTensor *t, const PetscReal at[], PetscReal weight[]);
/* Q (nodes x nodes row major): at node i polynomial j, orthonormal on the nodes, j as the numbers of its degrees; the
   first is constant. */
PetscErrorCode HycoTensorPolynomials(const HycoTensor *t, PetscReal Q[]);

/* Values on a grid, rows x nodes column major. An axis on which they do not depend has one node. */
typedef struct {
  HycoTensor tensor;
  PetscInt rows;
  PetscReal *data;
} HycoGridField;
/* All rows at `at`. */
PetscErrorCode HycoGridFieldEvaluate(const HycoGridField *field, const PetscReal at[], PetscReal value[]);

#endif
