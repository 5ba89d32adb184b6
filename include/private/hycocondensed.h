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
extern const char *const HycoGridFieldNames[]; /* names in files */

/* The estimated errors: displacement by the modes, forces, displacement caused by these forces. */
#define HYCO_LAW_FLOOR 1e-10 /* least estimated error: round-off of the solutions */
enum { HYCO_LAW_U, HYCO_LAW_LAMBDA, HYCO_LAW_U_FULL, HYCO_N_LAWS };

/* Where D is evaluated: a mesh with every contact node, and space for the rows. Borrowed. */
typedef struct {
  HycoFE fe;
  HycoPairs *pairs;
  HycoRows rows;
} HycoGapSource;

typedef struct _n_HycoCondensed {
  PetscInt dim, m, l;                                               /* parameters, contacts, modes */
  PetscInt n[HYCO_MAX_PARAMETERS];                                  /* training values of each parameter */
  PetscReal *x[HYCO_MAX_PARAMETERS];                                /* ascending */
  PetscInt stiff[HYCO_MAX_PARAMETERS], affine[HYCO_MAX_PARAMETERS]; /* whether it changes K or B; whether K and B are
                                                                       affine in it */
  HycoGridField field[HYCO_N_FIELDS]; /* G: the columns of its lower triangle, m (m + 1) / 2; H: l x m row major */
  PetscInt exact_gap;   /* the field of the gap is -B K^-1 F, and D is evaluated from the scene; 0, in older files:
                           it is g */
  PetscInt exact_loads; /* the fields of the gap and of a are combined by the load's coefficients in the training
                           loads; 0: polynomials */
  PetscInt n_probes, n_theta, n_load; /* points at which loads that vary in space are evaluated, values, training
                                         loads per stiffness */
  PetscReal *probe;                   /* n_probes x 3 */
  PetscReal *inverse, *theta_scale;   /* by node of G: n_load x n_theta; n_theta */
  PetscInt *node_stiff, *node_load;   /* by node of the whole grid: its node of G, and its number among the loads
                                         there */
  HycoScene scene;                    /* borrowed */
  HycoGapSource given;
  PetscReal *bounds;     /* by node of G: lower and upper bound relative to the middle node's G; 0, 0: not known */
  PetscReal *Lambda;     /* m x nodes of the whole grid: training forces */
  PetscReal errors[3];   /* relative errors with one value left out: G, g, forces */
  PetscReal errors_u[2]; /* in older files: estimates of u by the modes and of u with these forces; < 0: none */
  /* the model of the estimated errors (condensed_estimate.c) */
  PetscReal *law; /* dim x HYCO_N_LAWS: of each parameter's remainder; NULL: an older file */
  PetscInt *flat; /* dim: there is no remainder, because the polynomial does not interpolate */
  PetscReal cut;  /* part of any displacement that the modes do not represent */
  /* training only: the error of the forces by parameter; the sample of each node of the whole grid */
  PetscReal by_parameter[HYCO_MAX_PARAMETERS];
  PetscInt hopeless;            /* the points were chosen: more values of this parameter do not reduce the error; -1:
                                   none */
  PetscBool chosen, target_met; /* the points were chosen, and the target was reached */
  PetscInt *sample;
  /* online data */
  PetscBool current; /* M and H are those of the stiffness parameters `at` */
  PetscReal at[HYCO_MAX_PARAMETERS];
  PetscBool solved; /* active is the set of the solution at `last` */
  PetscReal last[HYCO_MAX_PARAMETERS];
  PetscReal gap_size;                       /* largest entry of the gap's field */
  PetscReal *packed, *M, *work, *g, *H, *a; /* M: G, m x m */
  PetscBool *active;                        /* start of a solve */
  Mat flexibility;                          /* M as a Mat; with g the system; the forces that solve it */
  Vec forces;
  HycoSystem system;
  HycoSolver solver; /* training only */
} * HycoCondensed;

/* Snapshots and responses from which the modes are computed (condense_modes.c). Responses are K^-1 B^T P to patterns
   P of forces at each node of the stiffness. On rank 0, except r, q, Q and scale. */
typedef struct {
  PetscInt r, q, sampled; /* number of modes above the noise; of patterns; of those, the first, that were sampled, and
                             whose responses the modes span */
  PetscReal *Q, *scale;   /* orthonormal patterns, m x q column major; column j of P is Q_j scale_j */
  PetscReal *C;           /* V^T of the snapshots, then of the q responses node by node, r rows */
  PetscReal missed;       /* the part of held-out sampled forces outside the span, 95 % quantile, relative to the
                             displacement of the nearest snapshot */
} HycoResponses;

/* The contacts' nodes and facets only, where D is evaluated. */
typedef struct {
  HycoMesh mesh;
  HycoPairs pairs;
  HycoFE fe;
  HycoRows rows;
} HycoSurfaces;

/* Training of the condensed model: options, and the data of a run. */
typedef struct {
  PetscReal tol;     /* target for the choice of points */
  PetscReal pod_tol; /* POD tolerance of its modes, unless the reducer's is smaller */
  PetscInt max_values;
  HycoResponses responses;
  HycoCondensed condensed; /* the model in training; the grid on every rank, the fields on rank 0 */
  HycoSurfaces surfaces;   /* rank 0 */
  HycoCondensingPath path; /* of a scene with a history */
} * HycoCondensing;

static inline HycoCondensing Condensing(HycoReducer t)
{
  return (HycoCondensing)t->training;
}

/* Implementations of the training ops: check that scene and samples are suitable before the long computation; give
   two values of each parameter to begin with; find the points that meet -hyco_condensed_tol, solving and factoring
   as needed, in *samples (the caller owns it); G at all its nodes, factoring where no file has it, and the modes l,
   sigma, V, VtU with `responses`; the fields and their errors, put into the model with numbers[]. */
PetscErrorCode HycoCondensedSetFromOptions(HycoReducer reducer);
PetscErrorCode HycoCondensedResetTraining(HycoReducer reducer);
PetscErrorCode HycoCondensedBegin(HycoReducer reducer);
/* Number of samples of the forces of m contacts. */
PetscInt HycoCondensedSamples(PetscInt m);
/* Whether a search tries it, and its operations (condense_offer.c). */
PetscBool HycoCondensedOffers(HycoReducer reducer, PetscBool targets, size_t length, char why[]);
PetscReal HycoCondensedWork(HycoReducer reducer);
/* Checks that apply with a history and without, among them for a support that lets a body move. Collective. */
PetscErrorCode HycoCondensedCheckContacts(HycoReducer reducer);
PetscErrorCode HycoCondensedCheckSupports(HycoReducer reducer);
PetscErrorCode HycoCondensedStartPoints(HycoReducer reducer, HycoSamples *samples);
PetscErrorCode HycoCondensedChoosePoints(HycoReducer reducer, HycoSnapshots store, HycoSamples *samples);
PetscErrorCode HycoCondensedFindModes(HycoReducer reducer, HycoSnapshots store);
PetscErrorCode HycoCondensedBuild(HycoROM model, HycoReducer reducer);
/* G at all its nodes. Collective. */
PetscErrorCode HycoCondensedFlexibilities(HycoReducer reducer, HycoSnapshots store);
/* Solves for the responses to q patterns P of forces (m x q column major, on every rank) at all nodes, unless a file
   has them; then reads n of those of a node, from `first` on, into the columns of S (n_dof x ..., dense) from `at` on.
   Collective. */
PetscErrorCode HycoCondensedRespond(HycoReducer reducer, HycoSnapshots store, PetscInt q, const PetscReal P[]);
PetscErrorCode HycoCondensedReadResponses(HycoReducer reducer, HycoSnapshots store, PetscInt q, const PetscReal P[],
                                          PetscInt node, PetscInt first, PetscInt n, Mat S, PetscInt at);
/* Fills its fields and degrees, for all modes or none; and the errors with values left out. Rank 0. */
PetscErrorCode HycoCondensedFillFields(HycoReducer reducer, PetscBool modes);
PetscErrorCode HycoCondensedLeaveOut(HycoReducer reducer);

PetscErrorCode HycoCondensedCreate(PetscInt dim, PetscInt m, PetscInt l, HycoCondensed *condensed);
/* NULL-safe. */
PetscErrorCode HycoCondensedFree(HycoCondensed *condensed);
/* Allocates the fields' tensors, sizes and memory once n, x, stiff and l are set; the degrees are the highest. */
PetscErrorCode HycoCondensedAllocate(HycoCondensed condensed);
/* Allocates the online data. */
PetscErrorCode HycoCondensedPrepare(HycoCondensed condensed);
/* The width of the range of an interpolated parameter. */
PetscReal HycoCondensedWidth(HycoCondensed condensed, PetscInt p);
/* The system that forces[] solves; frees what the online phase has allocated. */
PetscErrorCode HycoCondensedCreateSystem(HycoCondensed condensed, PetscReal forces[], HycoSolver solver);
PetscErrorCode HycoCondensedFreeWork(HycoCondensed condensed);
/* Destroys the system of M and g. */
PetscErrorCode HycoCondensedResetSystem(HycoCondensed condensed);
/* In training: the forces for the current M and g, from the given active contacts; *solved: the residuals are small. */
PetscErrorCode HycoCondensedSolveForces(HycoCondensed condensed, PetscReal forces[], PetscBool *solved);
/* A field at mu without the nodes with number `skip` along `axis` (-1, -1: all); c->g likewise, and D alone in
   c->given.gap. */
PetscErrorCode HycoCondensedEvaluate(HycoCondensed condensed, PetscInt field, const PetscReal mu[], PetscInt axis,
                                     PetscInt skip, PetscReal value[]);
PetscErrorCode HycoCondensedFreeGap(HycoCondensed condensed, const PetscReal mu[], PetscInt axis, PetscInt skip);
PetscErrorCode HycoCondensedBringGap(HycoCondensed condensed, const PetscReal mu[]);
/* Finds where loads that vary in space are evaluated, at the mesh's parameters; *fit: no shape depends on the
   stiffness parameters. Collective. */
PetscErrorCode HycoCondensedSurveyLoads(HycoCondensed condensed, HycoFOM mesh, PetscBool *fit);
/* After HycoCondensedSurveyLoads(), or with the file's points: prepares the weights of the training loads. */
PetscErrorCode HycoCondensedPrepareLoads(HycoCondensed condensed);
/* The weights of the training loads (n_load) at node s of G whose sum is the load at mu; *span: the load is such a
   sum. */
PetscErrorCode HycoCondensedLoadWeights(HycoCondensed condensed, const PetscReal mu[], PetscInt s, PetscReal weight[],
                                        PetscBool *span);
/* The parameters of node k of the whole grid. */
void HycoCondensedPoint(HycoCondensed condensed, PetscInt k, PetscReal mu[]);
/* The error model's features, and its estimates (condensed_estimate.c). */
PetscErrorCode HycoCondensedFeatures(HycoROM model, PetscReal misfit[2]);
PetscErrorCode HycoCondensedEstimate(HycoROM model, HycoPrediction *prediction);
/* Reads from or writes to the model's file. */
PetscErrorCode HycoCondensedMove(HycoROM model, HycoH5 file);
/* The bounds of G at its nodes. */
PetscErrorCode HycoCondensedBound(HycoCondensed condensed);
/* The node of the whole grid that is nearest to mu, and the square of its distance (may be NULL), each parameter
   scaled to its values. */
PetscInt HycoCondensedNearest(HycoCondensed condensed, const PetscReal mu[], PetscReal *distance2);
/* The node of a field's grid that corresponds to node k of the whole grid. */
PetscInt HycoCondensedNode(HycoCondensed condensed, const HycoGridField *field, PetscInt k);
/* M = G(mu), and whether it is positive definite beyond round-off (it may be only semidefinite, if contacts repeat). */
PetscErrorCode HycoCondensedFlexibility(HycoCondensed condensed, const PetscReal mu[], PetscInt axis, PetscInt skip,
                                        PetscBool *definite);

#endif
