/* Solves with a sparse K: direct, ordered by nested dissection, with its Schur complement; or iterative. */
#ifndef HYCOLINEAR_H
#define HYCOLINEAR_H

#include <hycoimpl.h>
#include <petscblaslapack.h>
#include <petscksp.h>

/* The state of K and B at the last setup of a form. */
typedef struct {
  PetscObjectId K, B; /* 0: none */
  PetscObjectState K_state, B_state;
} HycoOperatorState;

/* Whether K and B are unchanged since the last call; stores their state. */
PetscErrorCode HycoOperatorStateUpdate(HycoOperatorState *seen, Mat K, Mat B, PetscBool *same);
/* -- MUMPS on the saddle point of K and B; all calls collective on its communicator -- */

typedef struct _n_HycoDirect *HycoDirect;

PetscErrorCode HycoDirectCreate(MPI_Comm comm, HycoDirect *direct);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoDirectDestroy(HycoDirect *direct);
/* Moves as many unknowns as K's null space has dimensions to the dense problem, z = (x_pinned, L). */
PetscErrorCode HycoDirectPinKernel(HycoDirect direct, Mat K);
/* The same for n given unknowns of K, ascending. */
PetscErrorCode HycoDirectPin(HycoDirect direct, PetscInt n, const PetscInt pinned[]);
/* Those unknowns. Borrowed. */
const PetscInt *HycoDirectPinned(HycoDirect direct);
/* Orders and analyses [K Bt; B 0] (B and Bt may be NULL) unless the pattern is the last one's; bytes: the estimated
   memory of the factor on all ranks together. */
PetscErrorCode HycoDirectAnalyse(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscBool symmetric, PetscReal *bytes);
/* After HycoDirectAnalyse(): estimated floating-point operations of the factorisation. */
PetscReal HycoDirectOperations(HycoDirect direct);
/* Factors, after HycoDirectAnalyse() with the same matrices: S = B K^-1 Bt, m x m, column major, on every rank. */
PetscErrorCode HycoDirectFactor(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscReal S[], PetscBool *singular);
/* g = D - B K^-1 F on every rank; D (length m) is read on rank 0. v: the motions that are
   pinned, whose work is told from round-off as HycoMotionClean() does; NULL: it is left. */
PetscErrorCode HycoDirectReduce(HycoDirect direct, const Vec v[], const PetscReal stiffness[], PetscReal least, Vec F,
                                const PetscReal D[], PetscReal g[]);
/* The null space of K: its vectors, borrowed. */
PetscErrorCode HycoKernelVectors(Mat K, PetscInt *n, const Vec *v[]);
/* x = K^-1 (F - Bt L) with the F of the last HycoDirectReduce(); L (length m) is read on rank 0. */
PetscErrorCode HycoDirectExpand(HycoDirect direct, const PetscReal L[], Vec x);
/* The same for k right-hand sides, D = 0: g and L are m x k column major. */
PetscErrorCode HycoDirectReduceMany(HycoDirect direct, PetscInt k, const Vec F[], PetscReal g[]);
PetscErrorCode HycoDirectExpandMany(HycoDirect direct, PetscInt k, const Vec F[], const PetscReal L[], Vec x[]);
/* x = K^-1 r */
PetscErrorCode HycoDirectSolve(HycoDirect direct, Vec r, Vec x);

/* -- a singular K -- */

/* Dimension of the null space attached to K (0: none is attached). */
PetscErrorCode HycoKernelSize(Mat K, PetscInt *n);
/* That many unknowns, ascending, without which K is regular; the same on every rank. Collective. */
PetscErrorCode HycoKernelPins(Mat K, PetscInt n, PetscInt pinned[]);
/* The same for n orthonormal motions v. */
PetscErrorCode HycoMotionPins(PetscInt n, const Vec v[], PetscInt pinned[]);
/*
  The work of the forces F - b (b: NULL for 0) on K's null space, which no K x balances: the largest |z.(F - b)| of its
  vectors z, relative to |z|.(|F| + |b|), or to 1e-2 |z| max(|F|, |b|) if that is more; 0 without a null space. Left out
  is what the rounding of x adds to forces that are computed from K x, 16 eps |z|.|K_ii x_i|, but at most 1e-2.
  Collective.
*/
PetscErrorCode HycoKernelWork(Mat K, Vec x, Vec F, Vec b, PetscReal *share);
/* V (n x n, by columns): the n motions v at the pinned unknowns, on every rank. Collective. */
PetscErrorCode HycoMotionAtPins(PetscInt n, const Vec v[], const PetscInt pinned[], PetscReal V[]);
/* A (p x rows of B, by columns), on every rank: B z of p motions. work: like a vector of B's rows. Collective. */
PetscErrorCode HycoMotionRows(Mat B, PetscInt p, const Vec z[], Vec work, PetscReal A[]);
/* w[i], the same on every rank: the work of F on the combination of the n motions v that moves the unknown pinned[i] by
   1 and none of the others. It is set to 0 where it is round-off of its terms, or below `least` (of a force on the
   largest displacement of the motion), unless springs resist the motion. stiffness[n]: theirs; NULL: there are none.
   Collective. */
PetscErrorCode HycoMotionClean(PetscInt n, const Vec v[], const PetscReal stiffness[], const PetscInt pinned[], Vec F,
                               PetscReal least, PetscReal w[]);

/* place[i] on rank 0: position of unknown i (of n) in a fill-reducing order of K. Collective. */
PetscErrorCode HycoDissection(MPI_Comm comm, Mat K, PetscInt place[]);

/* -- dense systems on one process, in twice the working precision -- */

/* sum[0] + sum[1] += a b; sum[1] is the part below the precision of sum[0]. */
void HycoAddProduct(PetscReal a, PetscReal b, PetscReal sum[2]);
/* Iterative refinement of x, K x = b + low (low may be NULL: 0), K n x n column major with leading dimension lda, lu
   and ipiv its factors by LAPACK's getrf, until x is accurate to round-off or a step does not improve it. */
PetscErrorCode HycoRefine(PetscBLASInt n, const PetscReal K[], PetscBLASInt lda, const PetscReal lu[],
                          const PetscBLASInt ipiv[], const PetscReal b[], const PetscReal low[], PetscReal x[]);

/* -- PETSc's solvers -- */

/* A direct solver for a sparse K: MUMPS on several ranks or for a large K, PETSc's own if K is small or banded.
   Cholesky when symmetric. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp);

/* Whether K has so small an envelope in reverse Cuthill-McKee order that its factor has little fill; on several
   ranks only for a 1D mesh. Collective. */
PetscErrorCode HycoBanded(Mat K, PetscBool *thin);
/* Sets up a PCCHOLESKY for such a K. Collective. */
PetscErrorCode HycoBandedSolver(PC pc);
/* Factors the operators of such a solver, with more workspace if MUMPS requests it. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular);
/* A factor of a symmetric, definite A by such a solver (-hyco_norm_...; the caller owns it); `name` names A in the
   error message for a singular one. Collective. */
PetscErrorCode HycoDefiniteSolver(Mat A, const char name[], KSP *ksp);
/* A^-1 R for dense R (the caller owns X) with a temporary factor. Collective. */
PetscErrorCode HycoSolveColumns(Mat A, const char name[], Mat R, Mat *X);

/* Conjugate gradients with algebraic multigrid for a sparse, symmetric K, starting from the last solution. */
PetscErrorCode HycoIterativeSolver(MPI_Comm comm, const char prefix[], Mat K, KSP *ksp);

/* -- the same under constraints, K x + B^T l = f, B x = d, for a regular K; all calls collective -- */

typedef struct _n_HycoConstrained *HycoConstrained;

/* Sets up the multigrid for K, which is borrowed and must not change. No constraint yet. */
PetscErrorCode HycoConstrainedCreate(MPI_Comm comm, const char prefix[], Mat K, HycoConstrained *constrained);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoConstrainedDestroy(HycoConstrained *constrained);
/* Sets the rows of B (referenced) as the constraints; at: for each of this rank's rows an unknown of its node, a
   contact's slave. *singular: they are linearly dependent. */
PetscErrorCode HycoConstrainedSet(HycoConstrained constrained, Mat B, const PetscInt at[], PetscBool *singular);
/* |f| in the solver's norm: sqrt(f . M f), M the preconditioner. */
PetscErrorCode HycoConstrainedSize(HycoConstrained constrained, Vec f, PetscReal *size);
/* Improves x to a residual of `accuracy` times *size; *size is raised to a share of the initial residual if that is
   larger (without loads only the constraints act); d (as B x) is not read without constraints. its: number of
   iterations. */
PetscErrorCode HycoConstrainedSolve(HycoConstrained constrained, Vec f, Vec d, PetscReal accuracy, PetscReal *size,
                                    Vec x, PetscInt *its);
/* The constraints' forces l for which B^T l is closest to r = f - K x. */
PetscErrorCode HycoConstrainedForces(HycoConstrained constrained, Vec r, Vec l);
/* Borrowed. */
PetscErrorCode HycoConstrainedGetKSP(HycoConstrained constrained, KSP *ksp);

#endif
