/*
  HycoCone: the law of a contact, by a projection onto its admissible forces.

  The rows of a contact system are divided into blocks, one of each contact (HycoSystemSetBlocks()). A block has one
  component, r = (r_n), or one of each dimension, r = (r_n, r_t): the normal force first, >= 0 in compression. With
  w = D - B x, the gap w_n and the slip w_t on which these forces have work, the law of a block is

      r = P(r - (rho_n w_n, rho_t w_t))     for all rho_n > 0, rho_t > 0

  P depends on numbers of the block, its data: a threshold, a coefficient of friction. If the admissible forces do not
  depend on r, P is the projection onto them. Examples:

      contact without friction   P(y) = max(y_n, 0)                             type "nonnegative"
      Coulomb's law              P(y) = (y_n^+, y_t min(1, mu y_n^+ / |y_t|))   type "coulomb"
      a threshold g (Tresca)     P(y) = (max(y_n, 0), y_t min(1, g / |y_t|))    |r_t| <= g; r_t = -g w_t / |w_t| in slip

  A program adds types by HycoConeRegister(). Functions of a type are called on each rank for its own blocks, or for
  copies of all blocks, in any order.
*/
#ifndef HYCOCONE_H
#define HYCOCONE_H

#include <hycosys.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoCone *HycoCone;
typedef const char *HycoConeType;
#define HYCO_CONE_NONNEGATIVE "nonnegative" /* each component >= 0; no data */
#define HYCO_CONE_COULOMB                                                                                              \
  "coulomb" /* friction; data: mu and g, |r_t| <= mu r_n + g, with g = 0 for Coulomb's
                                           law */

/* The largest number of components of a block. */
#define HYCO_MAX_BLOCK 3

struct _HycoConeOps {
  /* z = P(y) for one block: data[n_data], y[size], z[size], in units of force. z is not y. Required. */
  PetscErrorCode (*project)(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal z[]);
  /* J = dP/dy, size x size row by row; where P has a kink, the derivative on either side. Required. */
  PetscErrorCode (*derivative)(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal J[]);
  /* May be NULL, for admissible forces that do not depend on r. frozen[n_data]: data with which they are those at r. */
  PetscErrorCode (*freeze)(HycoCone cone, const PetscReal data[], const PetscReal r[], PetscReal frozen[]);
  /* May be NULL. Frees the data of the type. */
  PetscErrorCode (*destroy)(HycoCone cone);
};

/* Adds a type, or replaces one of this name. create() sets the operations. Not collective. */
PetscErrorCode HycoConeRegister(const char name[], PetscErrorCode (*create)(HycoCone cone));

/* Creates a cone of blocks of one component, without a type. The caller owns it. Collective. */
PetscErrorCode HycoConeCreate(MPI_Comm comm, HycoCone *cone);
/* Frees; sets the handle to NULL; NULL-safe. Collective. */
PetscErrorCode HycoConeDestroy(HycoCone *cone);
/* Sets the number of components of a block, 1 to HYCO_MAX_BLOCK, the same on every rank; before the type. */
PetscErrorCode HycoConeSetSize(HycoCone cone, PetscInt size);
PetscErrorCode HycoConeGetSize(HycoCone cone, PetscInt *size);
/* Sets the type, once. Fails for an unknown one, with the list of the registered types. */
PetscErrorCode HycoConeSetType(HycoCone cone, HycoConeType type);
/* Borrowed; NULL without a type. */
PetscErrorCode HycoConeGetType(HycoCone cone, HycoConeType *type);
/* In create(): copies the operations, and sets the number of data of each block. */
PetscErrorCode HycoConeSetOps(HycoCone cone, const struct _HycoConeOps *ops, PetscInt n_data);
/* What the type needs beside the blocks' data. */
PetscErrorCode HycoConeSetData(HycoCone cone, void *data);
PetscErrorCode HycoConeGetData(HycoCone cone, void *data);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoConeView(HycoCone object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoConeViewFromOptions(HycoCone object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
