/*
  HycoSystem: the one problem of the paper,

      K x + Bt L = F,     0 <= L  complementary to  D - B x >= 0

  full order (16), hybrid hyper-reduced (38), projection-based (44), local indicator (43): they differ in who
  builds K, Bt, B, F and D, not in what is solved.
*/
#ifndef HYCOSYSTEM_H
#define HYCOSYSTEM_H

#include <hycosys.h>
#include <petscmat.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSystem *HycoSystem;

/*
  The four Karush-Kuhn-Tucker residuals, relative (dimensionless), recomputed from K, Bt, B, F, D:
    stationarity     |r|_2 / max(|K x|_2, |Bt L|_2, |F|_2), r = K x + Bt L - F without the entries that are no larger
                     than what rounding x to double precision makes of them, 16 eps (|K_ii x_i| + |F_i|)
    penetration      max_i [B x - D]_i^+ / d       d = max(|D|_inf, |B|_inf |x|_inf), a gap of the scene's size
    adhesion         max_i [-L_i]^+ / |L|_inf
    complementarity  max_i |L_i (D - B x)_i| / (|L|_inf d)
  A quotient 0/0 is 0. `rounding` is the stationarity of the entries left out. It grows with the square of the unknowns
  along a body (1e-11 on a rope of 1e3 nodes, 1e-5 on one of 1e6), and no solution in double precision does better.
*/
typedef struct {
  PetscReal stationarity, penetration, adhesion, complementarity, rounding;
} HycoKKT;

/* An empty system. Collective. The caller owns it. */
PetscErrorCode HycoSystemCreate(MPI_Comm comm, HycoSystem *system);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoSystemDestroy(HycoSystem *system);

/*
  Sets (references) the matrices: K n x n, Bt n x m, B m x n. B and Bt may be NULL: no contact. `symmetric` says
  that K is symmetric positive definite and Bt = B^T. Where contact alone holds a body, K is only semidefinite: attach
  its kernel, an orthonormal basis, by MatSetNullSpace(). Changing a matrix in place is noticed through its state. A
  vector of length m that is composed with B as HYCO_SLAVES says, for iterative solves, which node each contact belongs
  to: the number of its first unknown.
*/
#define HYCO_SLAVES "hyco_slaves"
PetscErrorCode HycoSystemSetMatrices(HycoSystem system, Mat K, Mat Bt, Mat B, PetscBool symmetric);
/* The matrices; each output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSystemGetMatrices(HycoSystem system, Mat *K, Mat *Bt, Mat *B);
/* Sets (references) F of length n and D of length m (NULL without contact). */
PetscErrorCode HycoSystemSetVectors(HycoSystem system, Vec F, Vec D);
/*
  Sets (references) a system whose flexibility is given instead of K: w = g + G L >= 0 complementary to L >= 0, G = B
  K^-1 Bt m x m, dense, on one process, symmetric positive semidefinite, g = D - B K^-1 F. It has no displacements: x is
  NULL where it is solved, and no stationarity. Replaces what was set, and is replaced by HycoSystemSetMatrices().
*/
PetscErrorCode HycoSystemSetFlexibility(HycoSystem system, Mat G, Vec g);
/* The largest of the four residuals of `kkt`. Not collective. */
PetscReal HycoKKTMax(const HycoKKT *kkt);
/* Recomputes the residuals at x (length n), L (length m, or NULL without contact). Collective. */
PetscErrorCode HycoSystemComputeKKT(HycoSystem system, Vec x, Vec L, HycoKKT *kkt);

/* Prints it, in words, on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSystemView(HycoSystem object, PetscViewer viewer);
/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSystemViewFromOptions(HycoSystem object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
