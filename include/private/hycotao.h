/* Inside complementarity/: the Tao that problems are posed to, and what hyco's own types take from it. */
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
  Tao tao;                    /* kept while type, sizes and limit stay */
  char prefix[HYCO_TAO_NAME]; /* its options prefix */
  PetscInt n, N;              /* its unknowns, on this rank and in all */
  /* the problem, for hyco's own types: as it was given */
  const HycoLCP *lcp;
  const HycoActiveSet *set; /* where it is no dense one */
  PetscReal *z;
  PetscBool *active;
  PetscInt its;
  HycoLCPStatus status;
  HycoLCPMonitor monitor;
  void *monitor_ctx;
  Vec placed; /* z, for a Tao must have a solution */
  /* for the others: scaled */
  Mat H, J;    /* H borrowed; J: the semismooth types' own copy */
  Vec F, w, d; /* F borrowed; slack; scale */
  PetscReal best;
  PetscInt best_at; /* least residual so far, and its iteration */
  Mat dense;        /* of a dense problem */
  Vec f, lo, hi, y;
};

#endif
