/* Online data of the model of bodies on paths, and a step in time on it (bodies_newton.c). */
#ifndef BODIES_PATH_H
#define BODIES_PATH_H

#include <hycobodies.h>
#include <hycopath.h>

typedef struct _n_HycoBodiesLaws *HycoBodiesLaws;
typedef struct _n_HycoBodiesPath {
  struct _n_HycoBodiesWork bodies; /* the first, as in the model without a history */
  HycoPath path;
  HycoBodiesFriction friction; /* NULL: no contact has any */
  HycoBodiesSurface surface;   /* with the rows of the contact problem: with friction, also tangents */
  Vec alpha, L;
  PetscInt *at, *cell_at;   /* by unknown of the cells: of fe's mesh; by cell and its unknown: its row, or -1 */
  PetscInt *point, n_rows;  /* the points in the model's mesh; n_sigma rows each: */
  PetscReal *B, *T, *there; /* n_rows x (nv dim): strains; n_rows x m: as in HycoBodiesInelastic, at fe's nodes */
  PetscReal *weight;        /* by point: norm of its rows of T */
  PetscReal *BP, *response; /* rows x m: B P / kappa; n_rows x m: strains by alpha, */
  PetscReal *G;             /* rows x p: B Z, of the rigid motions that contact alone prevents */
  PetscReal *loads;         /* and n_rows x r: by loads */
  PetscReal **column;       /* by row: gaps of all contacts (`gaps` of them), strains, displacements of the cells for a
                               unit force; NULL: not needed yet */
  PetscInt gaps;            /* none with friction, which has a matrix of them */
  PetscBool fresh;          /* rows or stiffness have changed since the set was factored */
  PetscInt n_set, *set;     /* closed contacts; with friction, their rows */
  PetscReal *U;             /* n_set x n_set: upper factor of W_aa */
  PetscReal *Z, *S;         /* n_set x m: forces per alpha; n_rows x m: strains per alpha */
  PetscReal *z, *e0, *gap;  /* n_set, n_rows: the same at alpha = 0; by contact: gaps there, without forces */
  PetscReal *Y, *H, rho;    /* n_set x p: W_aa^-1 G; p x p: the factor of G^T Y; of G G^T that is added to W_aa */
  PetscReal *x, *x0;        /* p x m: the rigid motions per alpha; at alpha = 0 */
  PetscBool loose;          /* the closed contacts do not determine the rigid motions */
  PetscReal *u, *accepted;  /* n_dof: displacements, in the points' cells; of the last accepted time, on surfaces too */
  PetscReal *e, *s, *size;  /* n_rows: strains; what their stresses lack of the elastic ones; by point: of its terms */
  PetscReal *lost, *X;      /* n_rows x n_sigma: derivative of s; n_rows x m: times S */
  PetscReal *r, *J;         /* m, m x m */
  PetscBLASInt *pivot;      /* of J's factor, */
  PetscBool factored;       /* which belongs to this set, or one before of the same path */
  PetscBool summed;         /* S is that of the set */
  PetscReal *last;          /* by body: kappa and weights of its samples to which the columns belong, */
  PetscInt place;           /* and the place of fe's nodes */
  PetscBool always;         /* a new tangent in each iteration */
  PetscReal norm, floor;    /* of alpha and T^T s; of r: round-off */
  PetscReal *motions;       /* by listed time, and one more, x p: rigid motions x of the bodies there */
  HycoBodiesLaws laws;      /* the path's steps, for derivatives (bodies_laws.c); NULL: none yet */
  PetscReal misfit;         /* of s in the span of the modes at the points, the largest of the listed times */
} * HycoBodiesPath;

/* Forgets the responses of the contacts and the set, after a change of rows or stiffness; takes strains and responses
   of the modes at the present ones. */
PetscErrorCode HycoBodiesForget(HycoROM model);
/* Forgets the set alone. */
void HycoBodiesRestart(HycoROM model);
PetscErrorCode HycoBodiesScale(HycoROM model);
/* The displacements of the points' cells, without those prescribed there: u, for alpha and forces. */
PetscErrorCode HycoBodiesMoveCells(HycoROM model, const PetscReal alpha[], const PetscReal Lambda[]);
/* The same for any forces, on any contacts. */
PetscErrorCode HycoBodiesProbeCells(HycoROM model, const PetscReal alpha[], const PetscReal Lambda[]);
/* Newton's method on sets of contacts until one holds: alpha and the forces at t1 from those at t0; else a->why. */
PetscErrorCode HycoBodiesSearch(HycoROM model, PetscReal t0, PetscReal t1, PetscReal alpha[], PetscReal Lambda[],
                                HycoStepAttempt *a);
/* For derivatives at a converged step (frictionless): the set of these forces; w->loose: it determines no motion. With
   friction: the map of the forces at alpha. */
PetscErrorCode HycoBodiesTakeSet(HycoROM model, const PetscReal Lambda[]);
PetscErrorCode HycoBodiesTakeMap(HycoROM model, const PetscReal alpha[], HycoStepAttempt *a);
/* Factors J at w->lost; x = J^-1 x. */
PetscErrorCode HycoBodiesTangent(HycoROM model, HycoStepAttempt *a);
PetscErrorCode HycoBodiesSolveTangent(HycoBodiesPath work, PetscReal x[]);
/* dz, motions and forces by contact, from the change q of w at fixed forces. */
PetscErrorCode HycoBodiesMoveSet(HycoBodiesPath work, const PetscReal q[], PetscReal dz[]);

/* Derivatives of paths of bodies that deform inelastically (bodies_laws.c), as the ops `linearise`, `step_residual`,
   `perturbed`, `sensitivity` and `slope`; Record: of an accepted step; Begin: of a path. */
PetscErrorCode HycoBodiesLawsBegin(HycoROM model);
PetscErrorCode HycoBodiesLawsRecord(HycoROM model, const PetscReal alpha[]);
PetscErrorCode HycoBodiesLawsLinearise(HycoROM model, PetscInt k, PetscBool *able);
PetscErrorCode HycoBodiesLawsResidual(HycoROM model, const PetscInt **row, PetscReal w[], PetscReal *size);
PetscErrorCode HycoBodiesLawsPerturbed(HycoROM model, const PetscReal mu[], PetscInt point);
PetscErrorCode HycoBodiesLawsSensitivity(HycoROM model, PetscInt parameter, const PetscReal weight[3],
                                         const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                         PetscBool *regular);
void HycoBodiesLawsDerivatives(HycoROM model, PetscReal dU[]);
PetscErrorCode HycoBodiesLawsDestroy(HycoBodiesPath work);

#endif
