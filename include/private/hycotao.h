/* Internal to complementarity/: the Tao that solves HycoSolver's problems, and the data that it attaches to hyco's own
   types. */
#ifndef HYCOTAO_H
#define HYCOTAO_H

#include <hycolcp.h>
#include <petsc/private/taoimpl.h>
#include <petsctao.h>

struct _n_HycoTao {
  MPI_Comm comm;
  PetscObject owner; /* borrowed */
  PetscBool quiet;   /* another rank's Tao prints for the same problem */
  char type[HYCO_TAO_NAME];
  int traits;
  PetscInt max_its;
  Tao tao;                    /* kept while type, sizes and iteration limit are unchanged */
  char prefix[HYCO_TAO_NAME]; /* its options prefix */
  PetscInt n, N;              /* number of its unknowns, on this rank and on all */
  /* the problem for hyco's own types, unscaled */
  const HycoLCP *lcp;
  const HycoActiveSet *set; /* if it is not a dense problem */
  PetscReal *z;
  PetscBool *active;
  PetscInt its, n_free; /* n_free: leading unknowns of z without bounds in the Tao */
  HycoLCPStatus status;
  PetscReal *last; /* n_last forces of the last solution by a type for any cone */
  PetscInt n_last;
  HycoLCPMonitor monitor;
  void *monitor_ctx;
  Vec placed; /* z, because a Tao must have a solution vector */
  /* the problem for the others, scaled */
  Mat H, J;    /* H borrowed; J: the semismooth types' own copy */
  Vec F, w, d; /* F borrowed; slack; scale */
  PetscReal best;
  PetscInt best_at; /* least residual so far, and its iteration */
  Mat dense;        /* H of a dense problem */
  Vec f, lo, hi, y;
};

/* Minimises the Tao's f within its bounds by its Hessian and gradient; the quadratic models by Lemke's method, or by
   the active set. Collective. */
PetscErrorCode HycoTaoNewton(Tao tao, PetscBool lemke);

/* Gives the Tao's KSP its prefix: after the Tao's own prefix and type. */
PetscErrorCode HycoTaoSetKSPPrefix(Tao tao);

#endif
