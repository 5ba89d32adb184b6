/*
  The condensed model's data: what the contact forces and the modes' coefficients need at any parameter value,

      w = g + G L >= 0,  L >= 0,  w.L = 0        G = B K^-1 B^T,    g = D - B K^-1 F
      gamma = a - H L                            H = V^T K^-1 B^T,  a = V^T K^-1 F

  D comes from the scene itself, F as a sum of training loads; K^-1 is what is interpolated, by polynomials on a tensor
  grid of training values (condensed_given.c). All on one process.
*/
#ifndef HYCOCONDENSED_H
#define HYCOCONDENSED_H

#include <hycoalgorithms.h>
#include <hycocondensedpath.h>
#include <hycoreducerimpl.h>

enum { HYCO_FIELD_G, HYCO_FIELD_GAP, HYCO_FIELD_H, HYCO_FIELD_FREE, HYCO_N_FIELDS };
extern const char *const HycoGridFieldNames[]; /* as in files */

/* What is estimated: the displacement by the modes, the forces, the displacement that these forces make. */
#define HYCO_LAW_FLOOR 1e-10 /* no error is said to be smaller: round-off of the solutions that it is of */
enum { HYCO_LAW_U, HYCO_LAW_LAMBDA, HYCO_LAW_U_FULL, HYCO_N_LAWS };

/* Where D is evaluated: a mesh with every contact node, and room for the rows. Borrowed. */
typedef struct {
  HycoFE fe;
  HycoPairs *pairs;
  HycoRows rows;
} HycoGapSource;

typedef struct _n_HycoCondensed {
  PetscInt dim, m, l;                                               /* parameters, contacts, modes */
  PetscInt n[HYCO_MAX_PARAMETERS];                                  /* training values of each parameter */
  PetscReal *x[HYCO_MAX_PARAMETERS];                                /* ascending */
  PetscInt stiff[HYCO_MAX_PARAMETERS], affine[HYCO_MAX_PARAMETERS]; /* reaches K or B; is exact in it */
  HycoGridField field[HYCO_N_FIELDS]; /* G: the columns of its lower triangle, m (m + 1) / 2; H: l x m row major */
  PetscInt exact_gap;   /* the field of the gap is -B K^-1 F, and D the scene's; 0, of older files: it is g */
  PetscInt exact_loads; /* the fields of the gap and of a by what the load is of the training loads; 0: polynomials */
  PetscInt n_probes, n_theta, n_load; /* points for values of loads in space, values, training loads per stiffness */
  PetscReal *probe;                   /* n_probes x 3 */
  PetscReal *inverse, *theta_scale;   /* by node of G: n_load x n_theta; n_theta */
  PetscInt *node_stiff, *node_load;   /* by node of the whole grid: that of G, and its number among its loads */
  HycoScene scene;                    /* borrowed */
  HycoGapSource given;
  PetscReal *bounds;     /* by node of G: lower and upper of it by the middle node's G; 0, 0: none are known */
  PetscReal *Lambda;     /* m x nodes of the whole grid: training forces */
  PetscReal errors[3];   /* one value left out: G, g, forces; relative */
  PetscReal errors_u[2]; /* of older files: their estimates of u by the modes and of u with these forces; < 0: none */
  /* the law of the estimated errors (condensed_estimate.c) */
  PetscReal *law; /* dim x HYCO_N_LAWS: of a parameter's remainder; NULL: an older file */
  PetscInt *flat; /* dim: the remainder has no nodes, for the polynomial does not interpolate */
  PetscReal cut;  /* what the modes leave out of any displacement */
  /* training only: the error of the forces by parameter; the sample of each node of the whole grid */
  PetscReal by_parameter[HYCO_MAX_PARAMETERS];
  PetscInt hopeless;            /* the points were chosen: of this parameter more values were in vain; -1: none */
  PetscBool chosen, target_met; /* the points were chosen, and the target was reached */
  PetscInt *sample;
  /* online */
  PetscBool current; /* M and H hold the stiffness's parameters `at` */
  PetscReal at[HYCO_MAX_PARAMETERS];
  PetscBool solved; /* active is the set of the solution at `last` */
  PetscReal last[HYCO_MAX_PARAMETERS];
  PetscReal gap_size;                       /* largest of the gap's field */
  PetscReal *packed, *M, *work, *g, *H, *a; /* M: G, m x m */
  PetscBool *active;                        /* a solve's start */
  Mat flexibility;                          /* M; with g the system; the forces that solve it */
  Vec forces;
  HycoSystem system;
  HycoSolver solver; /* training only */
} * HycoCondensed;

/* What the modes are made of (condense_modes.c): snapshots, and responses K^-1 B^T P to patterns of forces at each node
   of the stiffness. Rank 0, but for r, q, Q and scale. */
typedef struct {
  PetscInt r, n_columns, q; /* all modes above the noise; snapshots and responses, which they span; patterns */
  PetscReal *Q, *scale;     /* orthonormal patterns, m x q column major; column j of P is Q_j scale_j */
  PetscReal *C;             /* r x n_columns: V^T of the columns, the snapshots' first, then node by node */
  PetscReal missed; /* of sampled forces held out of the patterns, what 95 % of them have outside the span, by the
                       displacement of the nearest snapshot */
} HycoResponses;

/* The contacts' nodes and facets alone, where D is evaluated. */
typedef struct {
  HycoMesh mesh;
  HycoPairs pairs;
  HycoFE fe;
  HycoRows rows;
} HycoSurfaces;

/* Its training: options, and what a run has made. */
typedef struct {
  PetscReal tol;     /* where the points are chosen */
  PetscReal pod_tol; /* of its modes, unless the reducer's is smaller */
  PetscInt max_values;
  HycoResponses responses;
  HycoCondensed condensed; /* under training; the grid on every rank, the fields on rank 0 */
  HycoSurfaces surfaces;   /* rank 0 */
  HycoCondensingPath path; /* of a scene with a history */
} * HycoCondensing;

static inline HycoCondensing Condensing(HycoReducer t)
{
  return (HycoCondensing)t->training;
}

/* The training's part of the ops: checks that scene and samples are fit, before hours of work; two values of each
   parameter, to begin with; solving and factoring on the way, the points that meet -hyco_condensed_tol, in *samples
   (the caller's); G at all its nodes, factoring where no file has it, and the modes l, sigma, V, VtU anew, with
   `responses`; the fields and their errors, handed to the model with numbers[]. */
PetscErrorCode HycoCondensedSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoCondensedResetTraining(HycoReducer reducer);
PetscErrorCode HycoCondensedBegin(HycoReducer reducer);
/* What it refuses with a history and without; a support that lets a body move. Collective. */
PetscErrorCode HycoCondensedCheckContacts(HycoReducer reducer);
PetscErrorCode HycoCondensedCheckSupports(HycoReducer reducer);
PetscErrorCode HycoCondensedStartPoints(HycoReducer reducer, HycoSamples *samples);
PetscErrorCode HycoCondensedChoosePoints(HycoReducer reducer, HycoSnapshots store, HycoSamples *samples);
PetscErrorCode HycoCondensedFindModes(HycoReducer reducer, HycoSnapshots store);
PetscErrorCode HycoCondensedBuild(HycoROM model, HycoReducer reducer);
/* G at all its nodes. Collective. */
PetscErrorCode HycoCondensedFlexibilities(HycoReducer reducer, HycoSnapshots store);
/* Responses to q patterns P of forces (m x q column major, on every rank) at these nodes, into the columns of S (n_dof
   x
   ..., dense) from `first` on. Collective. */
PetscErrorCode HycoCondensedResponses(HycoReducer reducer, HycoSnapshots store, PetscInt q, const PetscReal P[], Mat S,
                                      PetscInt first);
/* Its fields and degrees, of all modes or none; the errors where values are left out. Rank 0. */
PetscErrorCode HycoCondensedFillFields(HycoReducer reducer, PetscBool modes);
PetscErrorCode HycoCondensedLeaveOut(HycoReducer reducer);

PetscErrorCode HycoCondensedCreate(PetscInt dim, PetscInt m, PetscInt l, HycoCondensed *condensed);
/* NULL-safe. */
PetscErrorCode HycoCondensedFree(HycoCondensed *condensed);
/* The fields' tensors, sizes and memory once n, x, stiff and l are there; degrees: as many as there are nodes. */
PetscErrorCode HycoCondensedAllocate(HycoCondensed condensed);
/* Room for what is online. */
PetscErrorCode HycoCondensedPrepare(HycoCondensed condensed);
/* Ends the system of M and g. */
PetscErrorCode HycoCondensedResetSystem(HycoCondensed condensed);
/* In training: the forces of M and g as they are, from the active contacts given; *solved: the residuals are small. */
PetscErrorCode HycoCondensedSolveForces(HycoCondensed condensed, PetscReal forces[], PetscBool *solved);
/* A field at mu without the nodes with number `skip` along `axis` (-1, -1: all); g into c->g likewise, and D alone into
   c->given.gap. */
PetscErrorCode HycoCondensedEvaluate(HycoCondensed condensed, PetscInt field, const PetscReal mu[], PetscInt axis,
                                     PetscInt skip, PetscReal value[]);
PetscErrorCode HycoCondensedFreeGap(HycoCondensed condensed, const PetscReal mu[], PetscInt axis, PetscInt skip);
PetscErrorCode HycoCondensedBringGap(HycoCondensed condensed, const PetscReal mu[]);
/* Where loads in space are evaluated, at the mesh's parameters; *fit: no shape follows the stiffness. Collective. */
PetscErrorCode HycoCondensedSurveyLoads(HycoCondensed condensed, HycoFOM mesh, PetscBool *fit);
/* After it or with the file's points: what the weights of the training loads need. */
PetscErrorCode HycoCondensedPrepareLoads(HycoCondensed condensed);
/* The weights of the training loads (n_load) at node s of G whose sum is the load at mu; *span: it is one. */
PetscErrorCode HycoCondensedLoadWeights(HycoCondensed condensed, const PetscReal mu[], PetscInt s, PetscReal weight[],
                                        PetscBool *span);
/* The parameters of node k of the whole grid. */
void HycoCondensedPoint(HycoCondensed condensed, PetscInt k, PetscReal mu[]);
/* The laws of the errors as features, and as estimates (condensed_estimate.c). */
PetscErrorCode HycoCondensedFeatures(HycoROM model, PetscReal misfit[2]);
PetscErrorCode HycoCondensedEstimate(HycoROM model, HycoPrediction *prediction);
/* To and from the model's file. */
PetscErrorCode HycoCondensedMove(HycoROM model, HycoH5 file);
/* The bounds of G at its nodes. */
PetscErrorCode HycoCondensedBound(HycoCondensed condensed);
/* The node of the whole grid that is nearest to mu, and the square of its distance (may be NULL), each parameter
   scaled to its values. */
PetscInt HycoCondensedNearest(HycoCondensed condensed, const PetscReal mu[], PetscReal *distance2);
/* The node of a field's grid that node k of the whole grid lies on. */
PetscInt HycoCondensedNode(HycoCondensed condensed, const HycoGridField *field, PetscInt k);
/* M = G(mu), and whether it is positive definite beyond round-off (only semidefinite counts: contacts may repeat). */
PetscErrorCode HycoCondensedFlexibility(HycoCondensed condensed, const PetscReal mu[], PetscInt axis, PetscInt skip,
                                        PetscBool *definite);

#endif
