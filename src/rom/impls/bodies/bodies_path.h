/* Online data of the model of bodies on paths, and a step in time on it (bodies_newton.c). */
#ifndef BODIES_PATH_H
#define BODIES_PATH_H

#include <hycobodies.h>
#include <hycoinelasticforces.h>
#include <hycopath.h>

typedef struct _n_HycoBodiesPath {
  struct _n_HycoBodiesWork bodies; /* the first, as in the model without a history */
  HycoPath path;
  Vec alpha, L;
  PetscInt *at, *cell_at;        /* by unknown of the cells: of fe's mesh; by cell and its unknown: its row, or -1 */
  PetscReal *Ke, *heat, *weight; /* by cell: elastic stiffness, force of thermal strains, 2-norm of its part of T */
  PetscReal *BP, *response;      /* contacts x m: B P / kappa; nd x m: A / kappa */
  PetscReal **column;       /* by contact: gaps of all contacts, then cells, for a unit force; NULL: not needed yet */
  PetscBool fresh;          /* rows or stiffness have changed since the set was factored */
  PetscInt n_set, *set;     /* closed contacts */
  PetscReal *U;             /* n_set x n_set: upper factor of W_aa */
  PetscReal *Z, *S;         /* n_set x m: forces per alpha; nd x m: displacements of the cells per alpha */
  PetscReal *z, *u0;        /* n_set, nd: the same at alpha = 0 */
  PetscReal *u, *q, *r, *J; /* n_dof, columns of T, m, m x m */
  PetscBLASInt *pivot;      /* of J's factor, */
  PetscBool factored;       /* which belongs to the set */
  PetscBool always;         /* a new tangent in each iteration */
  PetscReal norm, floor;    /* of alpha and T q; of r: round-off */
  PetscReal misfit;         /* of q in the span of the modes in the cells, the largest of the listed times */
} * HycoBodiesPath;

static inline HycoBodiesSurface HycoBodiesSurfaceOf(HycoROM m)
{
  return (HycoBodiesSurface){m->fe, &m->model->pairs, &m->rows};
}

/* Forgets the responses of the contacts and the set, after a change of rows or stiffness, and scales those of the modes to
   the present one. */
PetscErrorCode HycoBodiesForget(HycoROM model);
void HycoBodiesScale(HycoROM model);
/* Newton's method on sets of contacts until one holds: alpha and the forces at t1 from those at t0; else a->why. */
PetscErrorCode HycoBodiesSearch(HycoROM model, PetscReal t0, PetscReal t1, PetscReal alpha[], PetscReal Lambda[],
                                HycoStepAttempt *a);

#endif
