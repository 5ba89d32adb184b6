/* Friction between the bodies of a model (bodies_friction.c), and the derivatives of its paths
   (bodies_sensitivity.c). */
#ifndef BODIES_FRICTION_H
#define BODIES_FRICTION_H

#include "bodies_path.h"

typedef struct _n_HycoBodiesSensitivity *HycoBodiesSensitivity;
struct _n_HycoBodiesFriction {
  HycoContactState state;
  HycoBodiesSurface normal, all; /* without and with tangents */
  HycoRows rows;
  PetscInt *contact; /* by row: of the scene */
  HycoBlocks *blocks;
  HycoTao tao;
  HycoConeFactor factor;
  PetscInt p;                    /* rigid motions */
  PetscReal *M;                  /* p + rows square: [0 G^T; -G W]; NULL: not computed yet */
  PetscBool present;             /* M is known to be that of these parameters */
  PetscInt rows_of, *weights_of; /* the rows and, by body, the weights */
  PetscReal *kappa_of;           /* and stiffness that it belongs to */
  PetscReal *q, *z, *ahead;      /* p + rows: of the step; its motions and forces; a start of it */
  PetscReal *pieces;             /* of the laws, when the derivative of the forces was taken */
  PetscReal *U, *w;              /* n_dof: of the surface at the step; by row */
  PetscReal most;                /* largest displacement */
  PetscInt n_taken, room;        /* accepted steps, and room for them */
  PetscBool loose;               /* an accepted state with forces left a motion free */
  PetscBool unloaded_body;       /* the last one has no forces, but loads */
  char name[HYCO_LINE];          /* loose: the first motion that was free, with its first and last time */
  PetscReal at[2];
  PetscReal *taken;            /* by accepted step: p + rows, its motions and forces */
  HycoBodiesSensitivity along; /* NULL: no derivatives have been asked for; bodies_sensitivity.c frees it */
};

#endif
