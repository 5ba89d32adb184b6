/*
  Common to hybrid, projection-based and cubature models: a reduced system made from K, F,
  B and D on the RID by the modes, which a HycoSolver solves. What is constant is the first part of their `data`, what a
  prediction changes of their `work`. All on one process.
*/
#ifndef HYCOGALERKIN_H
#define HYCOGALERKIN_H

#include <hycoromimpl.h>

typedef struct _n_HycoReduced *HycoReduced;
typedef struct _n_HycoLoads *HycoLoads;
typedef struct _n_HycoTable *HycoTable;
typedef struct _n_HycoGalerkinPath *HycoGalerkinPath;
typedef struct _n_HycoGalerkinFriction *HycoGalerkinFriction;

/* The sets of (21)-(22), (32)-(37): contacts, and unknowns of the model's own mesh that are not fixed, once fe is at
   parameters. */
typedef struct {
  IS is_A_lambda;      /* contacts: indices in pairs */
  IS is_rows;          /* the rows of B that they have: the same, or with friction all of B's */
  IS is_A, is_I;       /* unknowns inside the RID, on its interface */
  IS is_Ac, is_Ac_all; /* A_c: unknowns of A at the nodes of these contacts; A'_c: with those on the interface. From
                          HycoGalerkinContactMatrix() */
} HycoIndexSets;

/* Monitored along a path: the sign of the tangent's determinant and its smallest singular value over the largest, by
   listed time; 0: not computed. */
typedef struct {
  PetscInt stride; /* number of listed times from one evaluation to the next; 0: none */
  PetscReal *sign, *ratio;
} HycoWatch;

/* Constant: what training makes and a file holds. */
typedef struct _n_HycoGalerkinModel {
  /* functions of the type: Br and Btr, and Dr, from own_rows; Lambda from L. NULL: each contact of A_lambda has a
     multiplier */
  PetscErrorCode (*contact)(HycoROM), (*gap)(HycoROM), (*expand)(HycoROM);
  PetscBool symmetric;
  PetscReal *G;    /* l x n_fe row major (hybrid all), else NULL */
  PetscReal ridge; /* of G, relative to sigma_1^2 */
  HycoTable table; /* Kr's entries as polynomials of the parameters; NULL: Kr is assembled */
  HycoScan scan;
} * HycoGalerkinModel;

/* Of a prediction: rom->work begins with it. */
typedef struct _n_HycoGalerkin {
  HycoGalerkinModel model;
  PetscInt n_free;       /* number of modes that are unknowns */
  PetscBool bordered;    /* hybrid all, large: gamma is an unknown beside U[A], with gamma = G U[A], and Kr is sparse */
  HycoReduced reduced;   /* submatrices, bases and products by which K and B are reduced; created when needed */
  HycoLoads loads;       /* solutions without contact shared by all loads; NULL: Kr is dense, or no parameter is of
                            this kind */
  HycoGalerkinPath path; /* of a scene with a history */
  HycoGalerkinFriction friction; /* of its contacts; NULL: none, or each contact has one row */
  HycoContactState state;        /* with it: of the contacts of A_lambda. The path's */
  HycoWatch watch;
  HycoIndexSets sets;
  Mat K, Kr, Br, Btr;
  Vec F, Fr, Dr, x, L;
  HycoMesh own;        /* the cells and the first nodes of mesh: the part that the reduced problem uses */
  HycoPairs own_pairs; /* the m contacts of A_lambda */
  HycoRows own_rows;   /* their rows, at fe's parameters; with friction a normal and its tangents */
  HycoSystem system;
  Mat B;               /* all contacts' rows over the unknowns of fe's mesh, those outside A_lambda empty; with friction
                          own_rows */
  PetscBool current_B; /* it is at fe's parameters */
  Vec D;               /* their gaps, for the indicator */
} * HycoGalerkin;

/* Common implementations of ops. */
PetscErrorCode HycoGalerkinSetUp(HycoROM model);
PetscErrorCode HycoGalerkinReset(HycoROM model);
PetscErrorCode HycoGalerkinSolve(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoGalerkinEnergy(HycoROM model, PetscReal *energy, PetscBool *known);
PetscErrorCode HycoGalerkinCondition(HycoROM model, PetscReal *condition);
PetscErrorCode HycoGalerkinView(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoGalerkinMove(HycoROM model, HycoH5 file);
/* Parts that are not fields of the ops; NULL-safe. */
PetscErrorCode HycoGalerkinDestroy(HycoGalerkinModel galerkin);
/* K, F and the rows of A_lambda's contacts on the RID before reduction, borrowed, as the last solve assembled them. */
PetscErrorCode HycoGalerkinLocal(HycoROM model, HycoLocal *local);

/* Ops of gradients (galerkin_gradient.c); expand is HycoGalerkinUnpack(). */
PetscErrorCode HycoGalerkinUnknowns(HycoROM model, PetscInt *p, PetscInt *n, PetscReal z[]);
PetscErrorCode HycoGalerkinResidual(HycoROM model, const PetscReal mu[], const PetscReal z[], PetscReal w[],
                                    PetscReal *size);
PetscErrorCode HycoGalerkinJacobian(HycoROM model, PetscInt k, const PetscInt contact[], PetscReal M[]);

/* hybrid all: G = diag(s) (X^T X + r s_1^2 I)^-1 X^T, X = V[A] diag(s); r = 0: the pseudo-inverse of V[A]. */
PetscErrorCode HycoGalerkinSetRidge(HycoROM model, PetscReal ridge);
/* Assembles K and the reduced system at mu, without solving: Kr, Br, Btr and the vectors are current, the prediction
   is not. */
PetscErrorCode HycoGalerkinAssemble(HycoROM model, const PetscReal mu[]);

/* The reduced system (38) from K, F, the contacts' rows and gaps on the RID (reduced_system.c): Kr; Br and Btr; Fr and
   Dr. HycoReducedDestroy() is NULL-safe. */
PetscErrorCode HycoReducedFillStiffness(HycoROM model);
PetscErrorCode HycoReducedFillContact(HycoROM model);
PetscErrorCode HycoReducedFillVectors(HycoROM model);
/* Vbar[A,:]^T F[A] of forces F on fe's unknowns. */
PetscErrorCode HycoReducedTest(HycoROM model, const PetscScalar F[], Vec Fr);
PetscErrorCode HycoReducedDestroy(HycoReduced *reduced);
/* Kr's entries in storage order, borrowed while Kr exists; the row of each. */
PetscErrorCode HycoReducedEntries(HycoROM model, PetscInt *n, PetscScalar *a[]);
PetscErrorCode HycoReducedRows(HycoROM model, PetscInt row[]);
/* Creates galerkin->reduced, if it does not exist: in place of HycoReducedFillStiffness(), where a table fills Kr. */
PetscErrorCode HycoReducedPrepare(HycoROM model);

/* The path of a scene with a history (galerkin_path.c): create in setup, solve, destroy (NULL-safe).
   HycoGalerkinUnpack(): gamma, U and Lambda from x and L. HycoGalerkinExpand(): U from x only. */
PetscErrorCode HycoGalerkinPathCreate(HycoROM model);
PetscErrorCode HycoGalerkinPathSolve(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoGalerkinPathDestroy(HycoGalerkinPath *path);
PetscErrorCode HycoGalerkinUnpack(HycoROM model);
PetscErrorCode HycoGalerkinExpand(HycoROM model);

/*
  Friction on the path (galerkin_friction.c), beyond the contacts of A_lambda, whose state is the path's.
  Create in set-up, after own_pairs, sets n_L; Destroy is NULL-safe. Begin at the start of a path; Rows sets own_rows,
  at fe's parameters of a step; Accept when x and L are those of an accepted step to t, with U and Lambda set; Show at a
  listed time, before HycoTraceRecord().
*/
PetscErrorCode HycoGalerkinFrictionCreate(HycoROM model);
PetscErrorCode HycoGalerkinFrictionDestroy(HycoGalerkinFriction *friction);
PetscErrorCode HycoGalerkinFrictionBegin(HycoROM model);
PetscErrorCode HycoGalerkinFrictionRows(HycoROM model);
PetscErrorCode HycoGalerkinFrictionAccept(HycoROM model, PetscReal t);
PetscErrorCode HycoGalerkinFrictionShow(HycoROM model);
/* The first row of contact k of A_lambda in own_rows, and the contact (number in A_lambda) of a row. */
PetscInt HycoGalerkinFirstRow(HycoGalerkin galerkin, PetscInt k);
PetscInt HycoGalerkinContactOf(HycoGalerkin galerkin, PetscInt row);
/* Borrowed: the first row of each contact of the scene (n + 1), and the forces by row at the last accepted time, which
   the reconstruction completes. */
const PetscInt *HycoGalerkinFrictionForces(HycoGalerkinFriction friction, PetscReal **force);

/* Solutions without contact that loads share while the stiffness is constant (loads.c). HycoLoadsCreate() needs Fr
   and x; HycoLoadsForget(): the stiffness has changed (NULL-safe); HycoLoadsSetFree() passes to the solver the
   solution without contact at mu, where the system is current, if it follows from those at the ends of the ranges. */
PetscErrorCode HycoLoadsCreate(HycoROM model);
PetscErrorCode HycoLoadsDestroy(HycoLoads *loads);
void HycoLoadsForget(HycoLoads loads);
PetscErrorCode HycoLoadsSetFree(HycoROM model, const PetscReal mu[]);

/* A model without a basis of contact forces: sets the reason to not converged if its displacement penetrates; the
   prediction's U is current. */
PetscErrorCode HycoGalerkinCheckContactBasis(HycoROM model);

/* Creates the part of the model's mesh that the reduced problem uses, and its contacts (reduced_mesh.c): the nodes
   of cells and of A_lambda, and those needed for measured normals there. A prediction without reconstruction
   evaluates nothing else. HycoGalerkinCreateSets(): the sets of unknowns, if they do not exist; fe is at parameters,
   from which its supports are known. */
PetscErrorCode HycoGalerkinCreateOwn(HycoROM model);
PetscErrorCode HycoGalerkinDestroyOwn(HycoGalerkin galerkin);
PetscErrorCode HycoGalerkinCreateSets(HycoROM model);
/* The rows of A_lambda's contacts at fe's parameters. On moved surfaces, a contact that acts on no free unknown of A
   gets an empty row: no equation of (38) would balance its force. */
PetscErrorCode HycoGalerkinOwnRows(HycoROM model);
/* Updates B to fe's parameters, and the sets A_c and A'_c of its rows. */
PetscErrorCode HycoGalerkinContactMatrix(HycoROM model);

#endif
