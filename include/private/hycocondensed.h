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
#include <hycoh5.h>
#include <hycoromimpl.h>

enum { HYCO_FIELD_G, HYCO_FIELD_GAP, HYCO_FIELD_H, HYCO_FIELD_FREE, HYCO_N_FIELDS };
extern const char *const HycoGridFieldNames[]; /* as in files */

/* What is estimated: the displacement by the modes, the forces, the displacement that these forces make. */
#define HYCO_LAW_FLOOR 1e-10 /* no error is said to be smaller: round-off of the solutions that it is of */
enum { HYCO_LAW_U, HYCO_LAW_LAMBDA, HYCO_LAW_U_FULL, HYCO_N_LAWS };

/* Where D is evaluated: a mesh with every contact node, and room for the rows. Borrowed. */
typedef struct {
  HycoFE fe;
  HycoPairs *pairs;
  PetscInt *start, *dof;
  PetscReal *value, *gap;
} HycoGapSource;

struct _n_HycoCondensed {
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
  PetscInt hopeless;    /* the points were chosen: of this parameter more values were in vain; -1: none */
  PetscBool target_met; /* the points were chosen, and the target was reached */
  PetscInt *sample;
  /* online */
  PetscBool current; /* M and H hold the stiffness's parameters `at` */
  PetscReal at[HYCO_MAX_PARAMETERS];
  PetscBool solved; /* active is the set of the solution at `last` */
  PetscReal last[HYCO_MAX_PARAMETERS];
  PetscReal gap_size;                           /* largest of the gap's field */
  PetscReal *packed, *M, *work, *g, *H, *a;     /* M: G, m x m */
  HycoSetFactor set_factor;                     /* of M on the active contacts */
  PetscBool *active;
};

PetscErrorCode HycoCondensedCreate(PetscInt dim, PetscInt m, PetscInt l, HycoCondensed *condensed);
/* NULL-safe. */
PetscErrorCode HycoCondensedDestroy(HycoCondensed *condensed);
/* The fields' tensors, sizes and memory once n, x, stiff and l are there; degrees: as many as there are nodes. */
PetscErrorCode HycoCondensedAllocate(HycoCondensed condensed);
/* Room for what is online. */
PetscErrorCode HycoCondensedPrepare(HycoCondensed condensed);
/* A field at mu without the nodes with number `skip` along `axis` (-1, -1: all); g into c->g likewise, and D alone into
   c->given.gap. */
PetscErrorCode HycoCondensedEvaluate(HycoCondensed condensed, PetscInt field, const PetscReal mu[], PetscInt axis,
                                     PetscInt skip, PetscReal value[]);
PetscErrorCode HycoCondensedFreeGap(HycoCondensed condensed, const PetscReal mu[], PetscInt axis, PetscInt skip);
PetscErrorCode HycoCondensedBringGap(HycoCondensed condensed, const PetscReal mu[]);
/* Where loads in space are evaluated, on a mesh with its nodes at X; *fit: no shape follows the stiffness. */
PetscErrorCode HycoCondensedSurveyLoads(HycoCondensed condensed, HycoMesh mesh, const PetscReal X[], PetscBool *fit);
/* After it or with the file's points: what the weights of the training loads need. */
PetscErrorCode HycoCondensedPrepareLoads(HycoCondensed condensed);
/* The weights of the training loads (n_load) at node s of G whose sum is the load at mu; *span: it is one. */
PetscErrorCode HycoCondensedLoadWeights(HycoCondensed condensed, const PetscReal mu[], PetscInt s, PetscReal weight[],
                                        PetscBool *span);
/* The parameters of node k of the whole grid. */
void HycoCondensedPoint(HycoCondensed condensed, PetscInt k, PetscReal mu[]);
/* The laws of the errors at mu; < 0: too few values, or an older file. */
void HycoCondensedLaw(HycoCondensed condensed, const PetscReal mu[], PetscReal law[]);
/* To and from the model's file. */
PetscErrorCode HycoCondensedSave(HycoROM model, HycoH5 file);
PetscErrorCode HycoCondensedLoad(HycoROM model, HycoH5 file);
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
