/*
  HycoSystem: the contact system, the problem that all models of the paper solve,

      K x + Bt L = F,     0 <= L  complementary to  D - B x + W L >= 0

  full order (16), hybrid hyper-reduced (38), projection-based (44) and local indicator (43), for which W = 0; bodies,
  whose x are the rigid motions that contact alone prevents, K = 0 and W their flexibility at the contacts. They differ
  in the code that builds K, Bt, B, W, F and D, not in the problem. A program may divide the rows into blocks, each with
  the law of a cone in place of the second condition (HycoSystemSetBlocks(), hycocone.h).
*/
#ifndef HYCOSYSTEM_H
#define HYCOSYSTEM_H

#include <hycocone.h>
#include <petscmat.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSystem *HycoSystem;

/*
  The four Karush-Kuhn-Tucker residuals, relative (dimensionless), recomputed from K, Bt, B, F, D:

    stationarity     |r|_2 / f, r = K x + Bt L - F without the entries up to the effect of rounding x to double
                     precision, 16 eps (|K_ii x_i| + |F_i|); f = max(|Bt L|_2, |F|_2), or |K x|_2 if that is more, but
                     at most the sum of the two. With a null space of K also the work of F - Bt L on it, relative to
                     the sum of its terms' sizes: K x has no part in it, however large x is
    penetration      max_i [B x - D]_i^+ / d, d = max(|D|_inf, |B|_inf |x|_inf), a gap of the scene's size
    adhesion         max_i [-L_i]^+ / |L|_inf
    complementarity  max_i |L_i (D - B x)_i| / (|L|_inf d)

  With blocks the last three are those of the natural map, z = P(L - (l/d) (D - B x)), l = |L|_inf (without forces
  |F|_inf/|B|_inf, with a given flexibility |g|_inf/max G_ii): penetration max [z_n - L_n]^+ / l, adhesion
  |L - P(L)|_inf / l, complementarity |z - L|_inf / l. For forces >= 0 they are 0 at the same states.

  A quotient 0/0 is 0. `rounding` is the stationarity of the entries left out. It grows with the square of the number of
  unknowns along a body (1e-11 on a rope of 1e3 nodes, 1e-5 on one of 1e6), and no solution in double precision has a
  smaller residual.
*/
typedef struct {
  PetscReal stationarity, penetration, adhesion, complementarity, rounding;
} HycoKKT;

/* Creates an empty system. Collective. The caller owns it. */
PetscErrorCode HycoSystemCreate(MPI_Comm comm, HycoSystem *system);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoSystemDestroy(HycoSystem *system);

/*
  Sets (references) the matrices: K n x n, Bt n x m, B m x n. B and Bt may be NULL: no contact. `symmetric` states that
  K is symmetric positive definite and Bt = B^T. If a body is held by contact only, K is semidefinite: attach its null
  space, an orthonormal basis, by MatSetNullSpace(). Changes of a matrix in place are detected by its state. For
  iterative solves, a vector of length m may be composed with B as HYCO_SLAVES. It has the node of each contact, given
  by the number of the node's first unknown. K NULL: K = 0, all x are free, as the rigid motions of bodies that are a
  compliance otherwise (HycoSystemSetCompliance()); B is dense on one process, Bt its transpose (NULL).
*/
#define HYCO_SLAVES "hyco_slaves"
PetscErrorCode HycoSystemSetMatrices(HycoSystem system, Mat K, Mat Bt, Mat B, PetscBool symmetric);
/* The matrices; each output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSystemGetMatrices(HycoSystem system, Mat *K, Mat *Bt, Mat *B);
/* Sets (references) F of length n and D of length m (NULL without contact). Without K an entry of D may be
   PETSC_INFINITY: this row cannot close. */
PetscErrorCode HycoSystemSetVectors(HycoSystem system, Vec F, Vec D);
/* The vectors; each output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSystemGetVectors(HycoSystem system, Vec *F, Vec *D);
/*
  Sets (references) the compliance of the contacts, W m x m, symmetric positive semidefinite, in the layout of B, after
  HycoSystemSetMatrices(), which takes it away, as NULL does. Of any type with MatMult() and rows (MatGetRow()). The
  dual form takes it, and without K the only one, condensed.
*/
PetscErrorCode HycoSystemSetCompliance(HycoSystem system, Mat W);
/*
  A system of W alone: w = g + G L >= 0 complementary to L >= 0, G = B K^-1 Bt m x m on one process, symmetric positive
  semidefinite, g = D - B K^-1 F. It has no displacements (x is NULL in a solve) and no stationarity. Replaces the
  matrices, and is replaced by HycoSystemSetMatrices().
*/
PetscErrorCode HycoSystemSetFlexibility(HycoSystem system, Mat G, Vec g);
/*
  Divides the rows of B (of G) into blocks, in their order on each rank: block k < n_blocks has the components and the
  law of cones[cone_of[k]] (cone_of NULL: of cones[0]), and the data of its type, data[] block after block (NULL if no
  cone has any). No block is divided between ranks. `cones` is the same on every rank; references are held, and the
  arrays copied: set them again when data change. n_cones 0, the default, and cones that are all "nonnegative": each row
  is a force >= 0, for which all methods and forms apply. Fails unless the blocks have as many components as this rank
  has rows; a solve fails if the matrices were replaced by others with other rows since. Collective.

  In a block of several components, w = D - B x is (gap, slip): a row of B for each direction, slave minus master, and D
  the initial gap and, with the opposite sign, the tangential displacement from which slip is counted (0: from rest).
*/
PetscErrorCode HycoSystemSetBlocks(HycoSystem system, PetscInt n_cones, const HycoCone cones[], PetscInt n_blocks,
                                   const PetscInt cone_of[], const PetscReal data[]);
/* The largest of the four residuals of `kkt`. Not collective. */
PetscReal HycoKKTMax(const HycoKKT *kkt);
/* Recomputes the residuals at x (length n), L (length m, or NULL without contact). Collective. */
PetscErrorCode HycoSystemComputeKKT(HycoSystem system, Vec x, Vec L, HycoKKT *kkt);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSystemView(HycoSystem object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSystemViewFromOptions(HycoSystem object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
