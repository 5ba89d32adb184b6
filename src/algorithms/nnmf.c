/*
  Nonnegative matrix factorisation S ~ W H (section 6.3): alternating nonnegative least squares, each half solved by
  projected gradients (Lin, Neural Computation 19 (2007) 2756-2779), from the NNDSVD start (Boutsidis, Gallopoulos,
  Pattern Recognition 41 (2008) 1350-1362). Deterministic: the same S gives the same factors. There are many local
  minima; this start finds one of them.
*/
#include <hycoalgorithms.h>
#include <petscblaslapack.h>

#define INNER_ITS          1000  /* projected-gradient iterations for one half */
#define STEPS              20    /* trial step lengths of one projected gradient */
#define GRADIENT_ROUND_OFF 1e-14 /* of the matrix, scaled to norm 1: 45 eps, a gradient's round-off */

/* C = op(A) op(B), m x n with inner dimension k, column major, contiguous. */
static PetscErrorCode NNMFProduct(const char transpose[2], PetscInt m, PetscInt n, PetscInt k, const PetscReal A[],
                                  const PetscReal B[], PetscReal C[])
{
  PetscBLASInt mb, nb, kb, lda, ldb;
  const PetscReal one = 1, zero = 0;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(k, &kb));
  lda = transpose[0] == 'T' ? kb : mb;
  ldb = transpose[1] == 'T' ? nb : kb;
  BLASgemm_(&transpose[0], &transpose[1], &mb, &nb, &kb, &one, A, &lda, B, &ldb, &zero, C, &mb);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One half: min 1/2 tr(X^T G X) - tr(C^T X), X >= 0, X and C k x n, G k x k. */
typedef struct {
  PetscInt k, n;
  const PetscReal *G, *C;
  PetscReal *gradient, *step, *Gstep;
} Half;

/* Norm of the gradient, without the entries that keep X at 0. */
static PetscReal ProjectedNorm(PetscInt n, const PetscReal gradient[], const PetscReal X[])
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) {
    if (gradient[i] < 0 || X[i] > 0) sum += gradient[i] * gradient[i];
  }
  return PetscSqrtReal(sum);
}

/* Of |S - W H|^2 / 2 in one factor: (W^T W) H - W^T S. Both products are made once for a half step, so that an
   inner iteration costs k^2 n. */
static PetscErrorCode NNMFGradient(const Half *h, const PetscReal X[])
{
  PetscFunctionBegin;
  PetscCall(NNMFProduct("NN", h->k, h->n, h->k, h->G, X, h->gradient));
  for (PetscInt i = 0; i < h->k * h->n; i++) h->gradient[i] -= h->C[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* step = [X - alpha gradient]_+ - X; whether the decrease is at least a hundredth of the linear prediction. The
   condition is that of Lin (2007), which needs no value of the function. */
static PetscErrorCode NNMFTry(const Half *h, const PetscReal X[], PetscReal alpha, PetscBool *enough)
{
  const PetscBLASInt one = 1;
  PetscBLASInt size;
  PetscReal slope, curve;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(h->k * h->n, &size));
  for (PetscInt i = 0; i < size; i++) h->step[i] = PetscMax(X[i] - alpha * h->gradient[i], 0) - X[i];
  slope = BLASdot_(&size, h->gradient, &one, h->step, &one);
  PetscCall(NNMFProduct("NN", h->k, h->n, h->k, h->G, h->step, h->Gstep));
  curve = BLASdot_(&size, h->Gstep, &one, h->step, &one);
  *enough = (PetscBool)(0.99 * slope + 0.5 * curve <= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Projected gradients on one half until their norm is below tol; returns their number. The step length of the last
   iteration is tried first. Projected gradients with a line search by factors of ten (Lin 2007). */
static PetscErrorCode SolveHalf(const Half *h, PetscReal tol, PetscReal X[], PetscInt *its)
{
  const PetscInt n = h->k * h->n;
  PetscReal alpha = 1;

  PetscFunctionBegin;
  for (*its = 0; *its < INNER_ITS; (*its)++) {
    PetscBool enough = PETSC_FALSE, shrink = PETSC_FALSE, done = PETSC_FALSE;
    PetscReal kept = 0;

    PetscCall(NNMFGradient(h, X));
    if (!(ProjectedNorm(n, h->gradient, X) > tol)) break;
    for (PetscInt t = 0; t < STEPS && !done; t++) { /* shorter until the decrease is sufficient, or longer as long as
                                                       it is */
      PetscCall(NNMFTry(h, X, alpha, &enough));
      if (t == 0) shrink = (PetscBool)!enough;
      if (enough) kept = alpha;
      done = (PetscBool)(enough == shrink);
      if (!done) alpha *= shrink ? 0.1 : 10;
    }
    if (kept == 0) break; /* no decrease: round-off */
    alpha = kept;
    for (PetscInt i = 0; i < n; i++) X[i] = PetscMax(X[i] - alpha * h->gradient[i], 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The larger one of the parts of u v^T with u and v split by sign: its sign and size. The smaller part is zeroed by the
   start; signs of singular vectors are arbitrary. size: the product of both parts' lengths. */
static PetscReal LargerPart(PetscInt m, const PetscReal u[], PetscInt n, const PetscReal v[], PetscInt stride,
                            PetscReal *sign, PetscReal *length_u, PetscReal *length_v)
{
  PetscReal square[2][2] = {{0, 0}, {0, 0}}, size[2];

  for (PetscInt i = 0; i < m; i++) square[0][u[i] < 0] += u[i] * u[i];
  for (PetscInt j = 0; j < n; j++) square[1][v[j * stride] < 0] += v[j * stride] * v[j * stride];
  for (PetscInt part = 0; part < 2; part++) size[part] = PetscSqrtReal(square[0][part] * square[1][part]);
  *sign = size[0] >= size[1] * (1 - 1e-10) ? 1 : -1;
  *length_u = PetscSqrtReal(square[0][*sign < 0]);
  *length_v = PetscSqrtReal(square[1][*sign < 0]);
  return size[*sign < 0];
}

/* NNDSVD of S: Wt (k x m) and H (k x n). Columns beyond the numerical rank of S are zero and stay zero. Boutsidis and
   Gallopoulos (2008): deterministic, so that training is repeatable. */
static PetscErrorCode NNMFStart(PetscInt m, PetscInt n, const PetscReal S[], PetscInt k, PetscReal Wt[], PetscReal H[])
{
  const PetscInt r = PetscMin(m, n);
  PetscReal *A, *s, *U, *Vt, *work;
  PetscBLASInt mb, nb, rb, lwork, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(m, &mb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast(r, &rb));
  PetscCall(PetscBLASIntCast(64 * (m + n), &lwork));
  PetscCall(PetscMalloc5(m * n, &A, r, &s, m * r, &U, r * n, &Vt, lwork, &work));
  PetscCall(PetscArraycpy(A, S, m * n));
  PetscCall(PetscFPTrapPush(PETSC_FP_TRAP_OFF)); /* its tests of the arithmetic */
  LAPACKgesvd_("S", "S", &mb, &nb, A, &mb, s, U, &mb, Vt, &rb, work, &lwork, &info);
  PetscCall(PetscFPTrapPop());
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "the singular value decomposition did not converge (LAPACK gesvd: %d)", (int)info);
  PetscCall(PetscArrayzero(Wt, k * m));
  PetscCall(PetscArrayzero(H, k * n));
  /* Each singular pair is split into its positive and negative parts; the larger of the two products is the best
     nonnegative approximation of rank 1 of the pair. */
  for (PetscInt c = 0; c < PetscMin(k, r) && s[c] > 1e-12 * s[0]; c++) {
    const PetscReal *u = U + c * m, *v = Vt + c;
    PetscReal sign, size, length_u, length_v;

    size = LargerPart(m, u, n, v, r, &sign, &length_u, &length_v);
    if (!(size > 0)) continue;
    size = PetscSqrtReal(s[c] * size);
    for (PetscInt i = 0; i < m; i++) Wt[i * k + c] = size / length_u * PetscMax(sign * u[i], 0);
    for (PetscInt j = 0; j < n; j++) H[j * k + c] = size / length_v * PetscMax(sign * v[j * r], 0);
  }
  PetscCall(PetscFree5(A, s, U, Vt, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* min over Y >= 0 of |S - Y^T X| (X given) or |S - X^T Y|: sets the Gram matrix and right-hand side of the other
   factor. S: m x n; `of_W`: Y is Wt, else H. Each half is a convex problem with k x k matrices. */
static PetscErrorCode SetHalf(PetscInt m, PetscInt n, PetscInt k, const PetscReal S[], PetscBool of_W,
                              const PetscReal other[], PetscReal G[], PetscReal C[], Half *h)
{
  PetscFunctionBegin;
  h->k = k;
  h->n = of_W ? m : n;
  PetscCall(NNMFProduct("NT", k, k, of_W ? n : m, other, other, G));
  PetscCall(NNMFProduct(of_W ? "NT" : "NN", k, h->n, of_W ? n : m, other, S, C));
  h->G = G;
  h->C = C;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each half is solved only as accurately as the other needs: its tolerance drops when it has nothing to do. */
static PetscErrorCode NNMFAlternate(PetscInt m, PetscInt n, PetscInt k, const PetscReal S[], PetscInt max_its,
                                    PetscReal Wt[], PetscReal H[], PetscReal room[])
{
  const PetscInt size = k * PetscMax(m, n);
  PetscReal *factor[2] = {Wt, H}, *G = room, *C = G + k * k, tol[2], first = 0;
  Half h = {0, 0, NULL, NULL, C + size, C + 2 * size, C + 3 * size};

  PetscFunctionBegin;
  for (PetscInt it = 0; it < max_its; it++) {
    PetscReal norm[2];
    PetscInt its;

    for (PetscInt f = 0; f < 2; f++) {
      PetscCall(SetHalf(m, n, k, S, (PetscBool)(f == 0), factor[1 - f], G, C, &h));
      PetscCall(NNMFGradient(&h, factor[f]));
      norm[f] = ProjectedNorm(k * h.n, h.gradient, factor[f]);
    }
    if (it == 0) {
      first = PetscSqrtReal(norm[0] * norm[0] + norm[1] * norm[1]);
      tol[0] = tol[1] = PetscMax(1e-3 * first, GRADIENT_ROUND_OFF);
    }
    if (norm[0] + norm[1] <= PetscMax(1e-8 * first, GRADIENT_ROUND_OFF)) break; /* stationary */
    for (PetscInt f = 0; f < 2; f++) {
      PetscCall(SetHalf(m, n, k, S, (PetscBool)(f == 0), factor[1 - f], G, C, &h));
      PetscCall(SolveHalf(&h, tol[f], factor[f], &its));
      if (its == 0) tol[f] = PetscMax(tol[f] / 10, GRADIENT_ROUND_OFF);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |S - Wt^T H|^2 / |S|^2 for the scaled S, whose norm is 1. From the factors, not from the halves' values. */
static PetscErrorCode NNMFMisfit(PetscInt m, PetscInt n, PetscInt k, const PetscReal S[], const PetscReal Wt[],
                                 const PetscReal H[], PetscReal *misfit)
{
  PetscReal *P;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m * n, &P));
  PetscCall(NNMFProduct("TN", m, n, k, Wt, H, P));
  *misfit = 0;
  for (PetscInt i = 0; i < m * n; i++) *misfit += (S[i] - P[i]) * (S[i] - P[i]);
  PetscCall(PetscFree(P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W (m x *n_vectors): columns of length 1 of the factorisation with k columns, without those that are not used;
   *misfit: |S - W H|^2 / |S|^2. S >= 0, m x n by columns. On one process. */
PetscErrorCode HycoNNMF(PetscInt m, PetscInt n, const PetscReal S[], PetscInt k, PetscInt max_its, PetscReal W[],
                        PetscInt *n_vectors, PetscReal *misfit)
{
  PetscReal *scaled, *Wt, *H, *room, norm = 0;

  PetscFunctionBegin;
  *n_vectors = 0;
  *misfit = 0;
  for (PetscInt i = 0; i < m * n; i++) {
    PetscCheck(S[i] >= 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "a nonnegative factorisation of a matrix with the entry %g", (double)S[i]);
    norm += S[i] * S[i];
  }
  if (norm == 0) PetscFunctionReturn(PETSC_SUCCESS);
  norm = PetscSqrtReal(norm);
  PetscCall(PetscMalloc4(m * n, &scaled, k * m, &Wt, k * n, &H, k * k + 4 * k * PetscMax(m, n), &room));
  /* GRADIENT_ROUND_OFF is absolute, while forces may have any unit. */
  for (PetscInt i = 0; i < m * n; i++) scaled[i] = S[i] / norm;
  PetscCall(NNMFStart(m, n, scaled, k, Wt, H));
  PetscCall(NNMFAlternate(m, n, k, scaled, max_its, Wt, H, room));
  PetscCall(NNMFMisfit(m, n, k, scaled, Wt, H, misfit));
  for (PetscInt c = 0; c < k; c++) {
    PetscReal length = 0, use = 0;

    for (PetscInt i = 0; i < m; i++) length += Wt[i * k + c] * Wt[i * k + c];
    for (PetscInt j = 0; j < n; j++) use += H[j * k + c] * H[j * k + c];
    /* A vector that no snapshot uses would be an unknown without effect. */
    if (!(length * use > 0)) continue;
    for (PetscInt i = 0; i < m; i++) W[*n_vectors * m + i] = Wt[i * k + c] / PetscSqrtReal(length);
    (*n_vectors)++;
  }
  PetscCall(PetscFree4(scaled, Wt, H, room));
  PetscFunctionReturn(PETSC_SUCCESS);
}
