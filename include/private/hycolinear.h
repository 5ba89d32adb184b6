/* Solves with a sparse K: direct, ordered by nested dissection, with its Schur complement; iterative. */
#ifndef HYCOLINEAR_H
#define HYCOLINEAR_H

#include <hycoimpl.h>
#include <petscblaslapack.h>
#include <petscksp.h>

/* What a form keeps between solves while K and B stay as they are. */
typedef struct {
  PetscObjectId K, B; /* 0: none */
  PetscObjectState K_state, B_state;
} HycoOperatorState;

/* Whether K and B are those last seen, unchanged; then remember them. */
PetscErrorCode HycoOperatorStateUpdate(HycoOperatorState *seen, Mat K, Mat B, PetscBool *same);
/* -- MUMPS on the saddle point of K and B; all calls collective on its communicator -- */

typedef struct _n_HycoDirect *HycoDirect;

PetscErrorCode HycoDirectCreate(MPI_Comm comm, HycoDirect *direct);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoDirectDestroy(HycoDirect *direct);
/* Leaves as many unknowns as K has a kernel to the dense problem, z = (x_pinned, L). */
PetscErrorCode HycoDirectPinKernel(HycoDirect direct, Mat K);
/* Orders and analyses [K Bt; B 0] (B and Bt may be NULL) unless the pattern is the last one's; bytes: what the factor
   is estimated to take on all ranks together. */
PetscErrorCode HycoDirectAnalyse(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscBool symmetric, PetscReal *bytes);
/* After HycoDirectAnalyse(): floating-point operations that the factor is estimated to take. */
PetscReal HycoDirectOperations(HycoDirect direct);
/* Factors, after HycoDirectAnalyse() with the same matrices: S = B K^-1 Bt, m x m, column major, on every rank. */
PetscErrorCode HycoDirectFactor(HycoDirect direct, Mat K, Mat Bt, Mat B, PetscReal S[], PetscBool *singular);
/* g = D - B K^-1 F on every rank; D (length m) is read on rank 0. */
PetscErrorCode HycoDirectReduce(HycoDirect direct, Vec F, const PetscReal D[], PetscReal g[]);
/* x = K^-1 (F - Bt L) with the F of the last HycoDirectReduce(); L (length m) is read on rank 0. */
PetscErrorCode HycoDirectExpand(HycoDirect direct, const PetscReal L[], Vec x);
/* x[j] = K^-1 r[j] of k right-hand sides at once, which share the reading of the factor; a K without kernel. */
PetscErrorCode HycoDirectSolveMany(HycoDirect direct, PetscInt k, Vec r[], Vec x[]);
/* x = K^-1 r */
PetscErrorCode HycoDirectSolve(HycoDirect direct, Vec r, Vec x);

/* -- a singular K -- */

/* How many motions the attached kernel of K has (0: none is attached). */
PetscErrorCode HycoKernelSize(Mat K, PetscInt *n);
/* As many unknowns, ascending, without which K is regular; the same on every rank. Collective. */
PetscErrorCode HycoKernelPins(MPI_Comm comm, Mat K, PetscInt n, PetscInt pinned[]);

/* place[i] on rank 0: position of unknown i (of n) in a fill-reducing order of K. Collective. */
PetscErrorCode HycoDissection(MPI_Comm comm, Mat K, PetscInt place[]);

/* -- dense systems on one process, in twice the working precision -- */

/* sum[0] + sum[1] += a b; sum[1] is what sum[0] cannot hold. */
void HycoAddProduct(PetscReal a, PetscReal b, PetscReal sum[2]);
/* Refines x, K x = b + low (low may be NULL: 0), K n x n column major with leading dimension lda, lu and ipiv its
   factors by LAPACK's getrf, until x is right to round-off or no step helps. */
PetscErrorCode HycoRefine(PetscBLASInt n, const PetscReal K[], PetscBLASInt lda, const PetscReal lu[],
                          const PetscBLASInt ipiv[], const PetscReal b[], const PetscReal low[], PetscReal x[]);

/* -- PETSc's solvers -- */

/* A direct solver for a sparse K: MUMPS on several ranks or large, PETSc's own when small or thin. Cholesky when
   symmetric. */
PetscErrorCode HycoDirectSolver(MPI_Comm comm, const char prefix[], Mat K, PetscBool symmetric, KSP *ksp);

/* Whether K has so short an envelope in reverse Cuthill-McKee order that its factor hardly fills; on several ranks only
   a line's has. Collective. */
PetscErrorCode HycoBanded(Mat K, PetscBool *thin);
/* Sets up a PCCHOLESKY for such a K. Collective. */
PetscErrorCode HycoBandedSolver(PC pc);
/* Factors the operators of such a solver, with more workspace when MUMPS asks for it. */
PetscErrorCode HycoFactor(KSP ksp, PetscBool *singular);
/* A factor of a symmetric, definite A by such a solver (-hyco_norm_...; the caller's), which A is named in the error of
   a singular one. Collective. */
PetscErrorCode HycoDefiniteSolver(Mat A, const char name[], KSP *ksp);
/* A^-1 R of dense R (X: the caller's) by such a factor, which goes. Collective. */
PetscErrorCode HycoSolveColumns(Mat A, const char name[], Mat R, Mat *X);

/* Conjugate gradients with algebraic multigrid for a sparse, symmetric K, from the last solution. */
PetscErrorCode HycoIterativeSolver(MPI_Comm comm, const char prefix[], Mat K, KSP *ksp);

/* -- the same under constraints, K x + B^T l = f, B x = d, for a regular K; all calls collective -- */

typedef struct _n_HycoConstrained *HycoConstrained;

/* Sets the multigrid for K up; K is borrowed and must not change. No constraint yet. */
PetscErrorCode HycoConstrainedCreate(MPI_Comm comm, const char prefix[], Mat K, HycoConstrained *constrained);
/* Frees; sets the handle to NULL. NULL-safe. */
PetscErrorCode HycoConstrainedDestroy(HycoConstrained *constrained);
/* The rows of B (referenced) are the constraints from now on; at: for each of this rank's rows an unknown of the node
   that it belongs to, a contact's slave. *singular: they depend on each other. */
PetscErrorCode HycoConstrainedSet(HycoConstrained constrained, Mat B, const PetscInt at[], PetscBool *singular);
/* |f| as the solver measures it: sqrt(f . M f), M the preconditioner. */
PetscErrorCode HycoConstrainedSize(HycoConstrained constrained, Vec f, PetscReal *size);
/* x from what it is, to a residual of `accuracy` times *size, which grows to a share of the residual at the start if
   that is more (without loads the constraints alone act); d (as B x) is not read without constraints. its: what it
   took. */
PetscErrorCode HycoConstrainedSolve(HycoConstrained constrained, Vec f, Vec d, PetscReal accuracy, PetscReal *size,
                                    Vec x, PetscInt *its);
/* The constraints' forces l for which B^T l is closest to r = f - K x. */
PetscErrorCode HycoConstrainedForces(HycoConstrained constrained, Vec r, Vec l);
/* Borrowed. */
PetscErrorCode HycoConstrainedGetKSP(HycoConstrained constrained, KSP *ksp);

#endif
