/* Complementarity problems as arrays and vectors: the active set, Lemke's method, TAO. They know no contact system. */
#ifndef HYCOLCP_H
#define HYCOLCP_H

#include <hycoimpl.h>

/* Called after each iteration of an active set, on every rank: its number, active contacts, changes made. */
typedef PetscErrorCode (*HycoLCPMonitor)(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);

/* -- dense complementarity, w = q + M z >= 0, z >= 0, w.z = 0; M column major n x n; all replicated -- */

typedef enum { HYCO_LCP_SOLVED, HYCO_LCP_CYCLE, HYCO_LCP_SINGULAR, HYCO_LCP_LIMIT, HYCO_LCP_RAY } HycoLCPStatus;

/*
  The Cholesky factor of M_aa, M symmetric n x n, kept from one set and one right-hand side to the next until M changes
  and it is forgotten (NULL-safe). HycoSetFactorSolve(): z_a = -M_aa^-1 q_a, 0 elsewhere; *regular: no pivot was below
  `tol` of M's diagonal entry, and z is finite. The contacts stand in the order in which they joined, so that z depends
  on the past by round-off.
*/
typedef struct _n_HycoSetFactor *HycoSetFactor;
PetscErrorCode HycoSetFactorCreate(PetscInt n, HycoSetFactor *factor);
PetscErrorCode HycoSetFactorDestroy(HycoSetFactor *factor);
void HycoSetFactorForget(HycoSetFactor factor);
PetscErrorCode HycoSetFactorSolve(HycoSetFactor factor, const PetscReal M[], const PetscReal q[], PetscInt k,
                                  const PetscInt a[], PetscReal tol, PetscReal z[], PetscBool *regular);
/*
  Primal-dual active set from `active`, which returns the last set. `symmetric`: M is symmetric positive
  semidefinite; then `factor` may be that of M's last set, or one that was forgotten; NULL: each set is factored anew.
  Contacts that repeat others carry no force and leave the set; when their gaps contradict each other and the choice of
  the smaller ones does not end it, the status is SINGULAR. The monitor may be NULL.
*/
PetscErrorCode HycoLCPActiveSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                HycoSetFactor factor, PetscInt max_its, HycoLCPMonitor monitor, void *ctx,
                                PetscBool active[], PetscReal z[], PetscInt *its, HycoLCPStatus *status);
/*
  z with M_aa z_a = -q_a on the set a[0..*k), 0 elsewhere. Members that depend on others leave a (their z is 0), and *k
  becomes smaller. *singular: even the rest could not be solved. `factor` as HycoLCPActiveSet()'s.
*/
PetscErrorCode HycoLCPSolveOnSet(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric,
                                 HycoSetFactor factor, PetscInt *k, PetscInt a[], PetscReal z[], PetscBool *singular);
/* The rank of a symmetric positive semidefinite matrix (k x k, overwritten), scaled to a unit
   diagonal, to 1e-12. */
PetscErrorCode HycoGramRank(PetscInt k, PetscReal A[], PetscInt *rank);
/*
  The active set with p free unknowns before m contacts (bodies that contact alone holds): M and q as HycoDirectFactor()
  and HycoDirectReduce() give them, z = (x_pinned, L). SINGULAR: contact does not hold them under this load.
*/
PetscErrorCode HycoSolveHeld(PetscInt p, PetscInt m, const PetscReal M[], const PetscReal q[], PetscInt max_its,
                             HycoLCPMonitor monitor, void *ctx, PetscBool active[], PetscReal z[], PetscInt *its,
                             HycoLCPStatus *status);
/* Lemke's complementary pivoting. */
PetscErrorCode HycoLCPLemke(PetscInt n, const PetscReal M[], const PetscReal q[], PetscInt max_its, PetscReal z[],
                            PetscInt *its, HycoLCPStatus *status);
/* Hash of a set, for finding cycles. */
unsigned long long HycoSetHash(PetscInt n, const PetscBool active[]);

/* -- TAO -- */

/* TAO's types that hyco knows, by the index that the functions below take; from HYCO_TAO_SEMISMOOTH on semismooth. */
extern const char *const HycoTaoTypes[];
enum {
  HYCO_TAO_AUTO = -1,
  HYCO_TAO_GPCG = 0,
  HYCO_TAO_BNLS = 3,
  HYCO_TAO_BLMVM = 5,
  HYCO_TAO_BQPIP = 11,
  HYCO_TAO_SEMISMOOTH = 12
};
PetscBool HycoTaoSemismooth(PetscInt type);
/*
  min 1/2 y^T H y - f^T y, lo <= y <= hi, by a bound-constrained type, H symmetric; or w = H y - f >= 0, y >= 0, w.y = 0
  by a semismooth one, lo = 0, hi infinite, H assembled. Begins at y. H, f, lo, hi are scaled in place: they serve once.
  max_its 0: 2000. An error inside TAO is caught: *solved is false. Further options by -hyco_tao_. Collective.
*/
PetscErrorCode HycoTaoSolve(PetscInt type, PetscInt max_its, Mat H, Vec f, Vec lo, Vec hi, Vec y, PetscInt *its,
                            PetscBool *solved);
/* The same on dense, replicated arrays: w = q + M z >= 0, z >= 0, w.z = 0; M column major n x n. */
PetscErrorCode HycoTaoLCP(PetscInt n, const PetscReal M[], const PetscReal q[], PetscBool symmetric, PetscInt type,
                          PetscInt max_its, PetscReal z[], PetscInt *its, PetscBool *solved);
/*
  Whether x solves min |A x - b|_2, x >= 0 (A: m x n column major): no entry negative, and each of the gradient A^T (b -
  A x) within rtol of its column's length times |b| (where x is 0: not above it). `residual`, |A x - b|, may be NULL.
  Not collective.
*/
PetscErrorCode HycoNNLSCheck(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], const PetscReal x[],
                             PetscReal rtol, PetscReal *residual, PetscBool *solved);
/*
  The same problem by a bound-constrained TAO type on the normal equations; *solved is HycoNNLSCheck()'s. Not
  collective.
*/
PetscErrorCode HycoTaoNNLS(PetscInt m, PetscInt n, const PetscReal A[], const PetscReal b[], PetscInt type,
                           PetscReal rtol, PetscReal x[], PetscReal *residual, PetscBool *solved);
#endif
