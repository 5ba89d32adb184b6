/*
  What hybrid and projection-based models share: a reduced system made from K, F, B and D on the RID by the modes, which
  a HycoSolver solves. It begins the `data` of both. All on one process.
*/
#ifndef HYCOGALERKIN_H
#define HYCOGALERKIN_H

#include <hycoreducerimpl.h>

typedef struct _n_HycoReduced *HycoReduced;
typedef struct _n_HycoLoads *HycoLoads;
typedef struct _n_HycoTable *HycoTable;
typedef struct _n_HycoGalerkinPath *HycoGalerkinPath;

/* The sets of (21)-(22), (32)-(37): unknowns of the model's own mesh without the fixed ones, and contacts. */
typedef struct {
  IS is_A, is_I;       /* unknowns inside the RID, on its interface */
  IS is_A_lambda;      /* contacts: indices in pairs */
  IS is_Ac, is_Ac_all; /* A_c: of A, those that these act on; A'_c: with those on the interface. From
                    HycoGalerkinContactMatrix() */
} HycoIndexSets;

/* What is looked at along a path: the sign of the tangent's determinant and its smallest singular value over the
   largest, by listed time; 0: not looked at. */
typedef struct {
  PetscInt stride; /* listed times from one look to the next; 0: none */
  PetscReal *sign, *ratio;
} HycoWatch;

typedef struct _n_HycoGalerkin {
  /* the type's own: Br and Btr, and Dr, from own_rows; Lambda from L. NULL: each contact of A_lambda has a multiplier
   */
  PetscErrorCode (*contact)(HycoROM), (*gap)(HycoROM), (*expand)(HycoROM);
  /* of a path, in place of sums over the RID's cells: Kr at fe's tangents; what is to be added to Fr; f_int at U and
     the state of the laws, and the size of what it is a difference of. NULL: there are none */
  PetscErrorCode (*stiffness)(HycoROM), (*add_loads)(HycoROM),
      (*forces)(HycoROM, HycoFEState, Vec f_int, PetscReal *summands);
  PetscBool symmetric;
  /* as in the file */
  PetscReal *G;    /* l x n_fe row major (hybrid all), else NULL */
  PetscReal ridge; /* of G, relative to sigma_1^2 */
  HycoTable table; /* Kr's entries as polynomials of the parameters; NULL: assembled */
  HycoScan scan;
  /* online */
  PetscInt n_free;       /* modes that are unknowns */
  PetscBool bordered;    /* hybrid all, large: gamma is unknown beside U[A], with gamma = G U[A], and Kr sparse */
  PetscInt *fe_at;       /* by dof of mesh: place in fe_dof, or -1 */
  PetscReal *Vp;         /* V, zero on full-order and fixed unknowns */
  HycoReduced reduced;   /* how K goes into Kr, and what of it stays; made by the first */
  HycoLoads loads;       /* solutions without contact that loads share; NULL: a dense Kr, or no such parameter */
  HycoGalerkinPath path; /* of a scene with a history */
  HycoWatch watch;
  HycoIndexSets sets;
  Mat K, Kr, Br, Btr;
  Vec F, Fr, Dr, x, L;
  HycoMesh own;        /* the cells and the first nodes of mesh: all that the reduced problem touches */
  HycoPairs own_pairs; /* the m contacts of A_lambda */
  HycoRows own_rows;   /* theirs, at fe's parameters */
  HycoSystem system;
  Mat B; /* B[A_lambda, :] and D[A_lambda], for the indicator */
  Vec D;
} * HycoGalerkin;

/* Ops that both have. */
PetscErrorCode HycoGalerkinSetUp(HycoROM model);
PetscErrorCode HycoGalerkinReset(HycoROM model);
PetscErrorCode HycoGalerkinSolve(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoGalerkinEnergy(HycoROM model, PetscReal *energy, PetscBool *known);
PetscErrorCode HycoGalerkinCondition(HycoROM model, PetscReal *condition);
PetscErrorCode HycoGalerkinView(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoGalerkinMove(HycoROM model, HycoH5 file);
/* What of it is no field of the ops: NULL-safe parts of the data. */
PetscErrorCode HycoGalerkinDestroy(HycoGalerkin galerkin);
/* The ranges scanned for a singular reduced stiffness, the points spread over the ranks: kept in the model, or refused;
   then the table. `model` on every rank; changed on rank 0. Collective. */
PetscErrorCode HycoGalerkinFinish(HycoReducer reducer, HycoROM model, HycoTraining *report);
/* Gives the model a table of its reduced stiffness if that is a polynomial of the parameters that reach it. */
PetscErrorCode HycoGalerkinTabulate(HycoROM model, const PetscBool reaches[]);
PetscReal HycoGalerkinCost(HycoReducer reducer, const HycoAttempt *attempt);
/* K, F and the rows of A_lambda's contacts on the RID before reduction, borrowed, as the last solve assembled them. */
PetscErrorCode HycoGalerkinLocal(HycoROM model, HycoLocal *local);

/* hybrid all: G = diag(s) (X^T X + r s_1^2 I)^-1 X^T, X = V[A] diag(s); r = 0: the pseudo-inverse of V[A]. */
PetscErrorCode HycoGalerkinSetRidge(HycoROM model, PetscReal ridge);
/* K and the reduced system at mu, without solving: Kr, Br, Btr and the vectors are current, the prediction is not. */
PetscErrorCode HycoGalerkinAssemble(HycoROM model, const PetscReal mu[]);

/* The reduced system (38) from K, F, the contacts' rows and gaps on the RID (reduced_system.c): a sparse Kr, without
   entries; Kr; Br and Btr; Fr and Dr. HycoReducedDestroy() is NULL-safe. */
PetscErrorCode HycoReducedCreateSparse(HycoROM model);
PetscErrorCode HycoReducedFillStiffness(HycoROM model);
PetscErrorCode HycoReducedFillContact(HycoROM model);
PetscErrorCode HycoReducedFillVectors(HycoROM model);
/* Vbar[A,:]^T F[A] of forces F on fe's unknowns. */
PetscErrorCode HycoReducedTest(HycoROM model, const PetscScalar F[], Vec Fr);
PetscErrorCode HycoReducedDestroy(HycoReduced *reduced);
/* Kr's entries in the order in which it has them, borrowed while it lives; the row of each. */
PetscErrorCode HycoReducedEntries(HycoROM model, PetscInt *n, PetscScalar *a[]);
PetscErrorCode HycoReducedRows(HycoROM model, PetscInt row[]);
/* galerkin->reduced, where a table fills Kr. */
PetscErrorCode HycoReducedPrepare(HycoROM model);

/* The path of a scene with a history (galerkin_path.c): made by setup; solved; NULL-safe. HycoGalerkinUnpack(): gamma,
   U and Lambda from x and L. HycoGalerkinExpand(): U of x alone. */
PetscErrorCode HycoGalerkinPathCreate(HycoROM model);
PetscErrorCode HycoGalerkinPathSolve(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoGalerkinPathDestroy(HycoGalerkinPath *path);
PetscErrorCode HycoGalerkinUnpack(HycoROM model);
PetscErrorCode HycoGalerkinExpand(HycoROM model);

/* What loads share while the stiffness stays (loads.c). HycoLoadsCreate() needs Fr and x; HycoLoadsForget(): the
   stiffness has changed (NULL-safe); HycoLoadsSetFree() gives the solver the solution without contact at mu, where the
   system is current, if it is known by those of the ranges' ends. */
PetscErrorCode HycoLoadsCreate(HycoROM model);
PetscErrorCode HycoLoadsDestroy(HycoLoads *loads);
void HycoLoadsForget(HycoLoads loads);
PetscErrorCode HycoLoadsSetFree(HycoROM model, const PetscReal mu[]);

/* A model without any contact force does not converge where its displacement penetrates; the prediction's U is current.
 */
PetscErrorCode HycoGalerkinCheckForceless(HycoROM model);

/* The part of the model's mesh that the reduced problem touches, and its contacts (reduced_mesh.c): the nodes of cells
   and of A_lambda, and those that measured normals there ask for. Nothing else is evaluated by a prediction without
   reconstruction. HycoGalerkinCreateSets(): once fe is on it. */
PetscErrorCode HycoGalerkinCreateOwn(HycoROM model);
PetscErrorCode HycoGalerkinDestroyOwn(HycoGalerkin galerkin);
PetscErrorCode HycoGalerkinCreateSets(HycoROM model);
/* The rows of A_lambda's contacts at fe's parameters. On moved surfaces one that acts on no free unknown of A where it
   is has an empty row: no equation of (38) would answer its force. */
PetscErrorCode HycoGalerkinOwnRows(HycoROM model);
/* B[A_lambda, :] at fe's parameters as a matrix, over the unknowns of fe's mesh (the caller destroys it), with the sets
   A_c and A'_c of its rows. */
PetscErrorCode HycoGalerkinContactMatrix(HycoROM model, Mat *B);

#endif
