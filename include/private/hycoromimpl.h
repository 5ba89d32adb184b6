/* HycoROM, inside. All on one process. */
#ifndef HYCOROMIMPL_H
#define HYCOROMIMPL_H

#include <hycodomain.h>
#include <hycocontactimpl.h>
#include <hycorom.h>
#include <hycosolverimpl.h>

typedef struct _n_HycoNorms *HycoNorms;
typedef struct _n_HycoCondensed *HycoCondensed;
typedef struct _n_HycoReconstruction *HycoReconstruction;
typedef struct _n_HycoReduced *HycoReduced;
typedef struct _n_HycoLoads *HycoLoads;
typedef struct _n_HycoTable *HycoTable;

/* Rows of B in CSR over dofs of a mesh, and D: see HycoContactRows(). */
typedef struct {
  PetscInt *start, *dof;
  PetscReal *value, *gap;
} HycoRows;

/* The basis of the contact forces; fe: none, the true multipliers of the hybrid model. */
typedef enum { HYCO_DUAL_FE, HYCO_DUAL_NNMF, HYCO_DUAL_SNAPSHOTS } HycoDual;
extern const char *const HycoDuals[]; /* their words, as options and files have them; NULL ends */

/* What an estimate of the error is made of (trust.c): log(1 + feature / floor), a coefficient each, and a constant. */
#define HYCO_TRUST_FEATURES 5
#define HYCO_TRUST_DISTANCE 3 /* which of them is the distance */
/* Contact forces below this share of the largest of a set count as that much where errors are divided by them. */
#define HYCO_SMALL_FORCE 0.1
typedef enum { HYCO_TRUST_U, HYCO_TRUST_SIGMA, HYCO_TRUST_LAMBDA, HYCO_N_TRUST } HycoTrustKind;
typedef struct {
  PetscInt n; /* held-out predictions behind the estimates; 0: not calibrated */
  PetscReal floor[HYCO_TRUST_FEATURES];
  PetscBool has[HYCO_N_TRUST];                          /* whether there is an estimate of this error */
  PetscReal law[HYCO_N_TRUST][HYCO_TRUST_FEATURES + 1]; /* coefficients >= 0, then the constant */
  PetscReal force; /* 2-norm of the largest contact forces held out: a tenth of it divides smaller ones' errors */
  PetscInt n_held; /* held-out predictions that the model was judged by; 0: none */
  PetscReal median[HYCO_N_TRUST], largest[HYCO_N_TRUST]; /* their relative errors; huge: not converged, or x/0 */
} HycoTrust;

struct _p_HycoROM {
  PETSCHEADER(int);
  char path[PETSC_MAX_PATH_LEN]; /* "" while training */
  /* the reduced problem's description, as in the file */
  HycoScene scene;
  HycoMesh mesh;           /* cells of Omega_A; its nodes and those of every contact */
  HycoPairs pairs;         /* all N_lambda contacts, node indices of mesh */
  PetscInt *role;          /* by node of mesh */
  PetscInt *in_rid;        /* by contact: in A_lambda */
  PetscReal *master_reach; /* moved surfaces: how far A_lambda's masters may be, by contact of the scene; NULL: none
                              is moved, or the file is older than their search */
  PetscInt l;              /* POD modes */
  PetscReal *V;            /* (mesh n_nodes * dim) x l, row major: the modes on the nodes of mesh */
  PetscReal *sigma;        /* l singular values */
  HycoHybrid hybrid;
  PetscReal ridge;        /* of G, relative to sigma_1^2 (hybrid all) */
  PetscInt n_fe, *fe_dof; /* full-order unknowns, dofs of mesh, ascending */
  PetscReal *G;           /* l x n_fe row major (hybrid all), else NULL */
  PetscInt n_dual;        /* dual snapshots that are not zero */
  PetscReal *S_lambda;    /* N_lambda x n_dual column major */
  PetscInt n_points;
  PetscReal *points; /* training points, n_points x n_parameters */
  PetscReal
      *reach; /* least, then largest values that training has seen of the parameters (trust.c); made when needed */
  char *provenance;
  char fingerprint[32]; /* of the scene and mesh that it was trained on */
  PetscInt whole_nodes, whole_cells;
  PetscInt counts[3]; /* modes of the dual, stress and force bases that seeded the RID; projection: force vectors,
                         supremizers among the l modes (the last, with singular value 0), 0 */
  HycoScan scan;
  HycoTrust trust;
  char *search;         /* how train -target_... chose it, in words; NULL: it was not chosen so */
  PetscReal numbers[3]; /* condition of the reduced stiffness, training errors of u and lambda */
  /* projection: the whole mesh is the RID; no full-order unknown, no dual snapshot */
  HycoROMType type;
  HycoDual dual;
  PetscInt l_lambda;
  PetscReal *V_lambda;     /* N_lambda x l_lambda column major, no entry negative, columns of unit 2-norm */
  PetscReal dual_misfit;   /* |S_lambda - V_lambda H|^2 / |S_lambda|^2, the best H >= 0 that training found */
  HycoCondensed condensed; /* else NULL */
  HycoTable table;         /* Kr's entries as polynomials of the parameters; NULL: assembled */
  /* the whole mesh, on demand */
  HycoMesh whole;
  HycoFE fe_whole;
  HycoPairs whole_pairs;
  PetscReal *V_whole, *U_whole;
  HycoNorms norms; /* made by the first comparison */
  /* online */
  PetscBool full_order, full_displacement; /* what its user, who has the scene, is to do: HycoROMGetFallback() */
  PetscInt reconstruct_solver;       /* of (41), index in HycoReconstructSolvers */
  HycoReconstruction reconstruction; /* what (41) keeps, made by the first */
  PetscBool ready, reconstruct, solved, whole_current;
  HycoFE fe;             /* on the RID's own nodes, the first of mesh; condensed: on mesh */
  PetscInt n_free, n, m; /* modes that are unknowns, all unknowns, contacts of A_lambda */
  PetscInt n_L;          /* multipliers of the reduced system: m, or l_lambda */
  PetscInt *contact;     /* m: index in pairs */
  PetscInt *fe_at;       /* by dof of mesh: place in fe_dof, or -1 */
  PetscReal *Vp;         /* V, zero on full-order and fixed unknowns */
  HycoReduced reduced;   /* how K goes into Kr, and what of it stays; made by the first */
  HycoLoads loads;       /* solutions without contact that loads share; NULL: a dense Kr, or no such parameter */
  Mat K, Kr, Br, Btr;
  Vec F, Fr, Dr, x, L;
  HycoMesh own;                  /* the cells and the first nodes of mesh: all that the reduced problem touches */
  HycoPairs own_pairs;           /* the m contacts of A_lambda */
  HycoRows own_rows;             /* theirs, at fe's parameters */
  HycoMesh beyond;               /* mesh without cells; NULL until somebody asks */
  HycoFE fe_beyond;              /* on it */
  PetscBool beyond_current;      /* U on all nodes of mesh, the rows of all contacts: HycoROMComplete() was called */
  PetscBool spread;              /* Lambda is not 0 outside A_lambda */
  PetscInt *row_start, *row_dof; /* rows of B over dofs of mesh, all contacts; current after HycoROMComplete() */
  PetscReal *row_value, *gap;
  HycoSystem system;
  HycoSolver solver;
  PetscReal *gamma, *U, *Lambda, *stress;
  PetscInt *slave_id; /* mesh-file tag of each contact's slave */
  HycoPrediction prediction;
};

PetscErrorCode HycoROMCreate(HycoROM *model);
/* Builds what the online phase needs from the description; again after the full-order set changed. */
PetscErrorCode HycoROMSetUp(HycoROM model);
PetscErrorCode HycoROMReset(HycoROM model);
/* hybrid all: G = diag(s) (X^T X + r s_1^2 I)^-1 X^T, X = V[A] diag(s); r = 0: the pseudo-inverse of V[A]. */
PetscErrorCode HycoROMSetRidge(HycoROM model, PetscReal ridge);
/* Sets the full-order unknowns (dofs of mesh, any order). */
PetscErrorCode HycoROMSetFE(HycoROM model, HycoHybrid hybrid, PetscInt n, const PetscInt dof[]);

/* The reduced system (38) from K, F, the contacts' rows and gaps on the RID (reduced.c): a sparse Kr, without entries;
   Kr; Br and Btr; Fr and Dr. HycoReducedDestroy() is NULL-safe. */
PetscErrorCode HycoReducedCreateSparse(HycoROM model);
PetscErrorCode HycoReducedFillStiffness(HycoROM model);
PetscErrorCode HycoReducedFillContact(HycoROM model);
PetscErrorCode HycoReducedFillVectors(HycoROM model);
PetscErrorCode HycoReducedDestroy(HycoReduced *reduced);

/* Kr's entries in the order in which it has them, borrowed while it lives; the row of each. */
PetscErrorCode HycoReducedEntries(HycoROM model, PetscInt *n, PetscScalar *a[]);
PetscErrorCode HycoReducedRows(HycoROM model, PetscInt row[]);
/* m->reduced, where a table fills Kr. */
PetscErrorCode HycoReducedPrepare(HycoROM model);

/* What loads share while the stiffness stays (loads.c). HycoLoadsCreate() needs Fr and x; HycoLoadsForget(): the
   stiffness has changed (NULL-safe); HycoLoadsSetFree() gives the solver the solution without contact at mu, where the
   system is current, if it is known by those of the ranges' ends. */
PetscErrorCode HycoLoadsCreate(HycoROM model);
PetscErrorCode HycoLoadsDestroy(HycoLoads *loads);
void HycoLoadsForget(HycoLoads loads);
PetscErrorCode HycoLoadsSetFree(HycoROM model, const PetscReal mu[]);

/* K and the reduced system at mu, without solving: Kr, Br, Btr and the vectors are current, the prediction is not. */
PetscErrorCode HycoROMAssemble(HycoROM model, const PetscReal mu[]);

/* A model without any contact force does not converge where its displacement penetrates; the prediction's U is current.
 */
PetscErrorCode HycoROMCheckForceless(HycoROM model);

/* The part of the model's mesh that the reduced problem touches, and its contacts (own.c): the nodes of cells and of
   A_lambda, and those that measured normals there ask for. Nothing else is evaluated by a prediction without
   reconstruction. */
PetscErrorCode HycoROMCreateOwn(HycoROM model);
PetscErrorCode HycoROMDestroyOwn(HycoROM model);
/* The rows of A_lambda's contacts at fe's parameters. On moved surfaces one that acts on no free unknown of A where it
   is has an empty row: no equation of (38) would answer its force. */
PetscErrorCode HycoROMOwnRows(HycoROM model);
/* Brings row_start, row_dof, row_value, gap of all contacts and U of all nodes of mesh to the last prediction. */
PetscErrorCode HycoROMComplete(HycoROM model);
/* start + B[k,:] U, after it. */
static inline PetscReal HycoROMAddRow(HycoROM model, PetscInt k, PetscReal start)
{
  for (PetscInt j = model->row_start[k]; j < model->row_start[k + 1]; j++)
    start += model->row_value[j] * model->U[model->row_dof[j]];
  return start;
}

/* (41): forces of all contacts from those of A_lambda (in model->Lambda) and the displacement. */
PetscErrorCode HycoROMReconstruct(HycoROM model);
/* NULL-safe. */
PetscErrorCode HycoReconstructionDestroy(HycoReconstruction *reconstruction);
extern const char *const HycoReconstructSolvers[];

/* (44), once the modes and the contacts' rows and gaps are there: V_lambda^T B V and its transpose; V_lambda^T D;
   Lambda from the system's multipliers. The rest of a projection-based model in words. */
PetscErrorCode HycoProjectionFillContact(HycoROM model);
PetscErrorCode HycoProjectionFillGap(HycoROM model);
PetscErrorCode HycoProjectionExpand(HycoROM model);
PetscErrorCode HycoProjectionView(HycoROM model, PetscViewer viewer);

/* The condensed model: what is online; the forces and the modes' coefficients at mu, all of the prediction; in words.
 */
PetscErrorCode HycoCondensedSetUp(HycoROM model);
PetscErrorCode HycoCondensedPredict(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoCondensedView(HycoROM model, PetscViewer viewer);

/* Condition number of the reduced stiffness of the last prediction (dense SVD). */
PetscErrorCode HycoROMCondition(HycoROM model, PetscReal *condition);

/* Norms of errors on the whole mesh (norms.c). Scene and mesh are borrowed. */
PetscErrorCode HycoNormsCreate(HycoScene scene, HycoMesh whole, HycoNorms *norms);
/* NULL-safe. */
PetscErrorCode HycoNormsDestroy(HycoNorms *norms);
/* H1 norm of u - minus (n_nodes * dim of the whole mesh; minus may be NULL). */
PetscErrorCode HycoNormH1(HycoNorms norms, const PetscReal u[], const PetscReal minus[], PetscReal *norm);
/* Norm in the dual of H1 of B^T (L - minus), of all contacts or those of the RID, B as at the last prediction; minus
   may be NULL. */
PetscErrorCode HycoNormDual(HycoNorms norms, HycoROM model, PetscBool rid_only, const PetscReal L[],
                            const PetscReal minus[], PetscReal *norm);

/* What tells of the last prediction's error without a full-order solution: feature[HYCO_TRUST_FEATURES], all >= 0. */
PetscErrorCode HycoTrustMeasure(HycoROM model, PetscReal feature[]);
/* The estimated errors of the last prediction, and how far outside the ranges it lies. */
PetscErrorCode HycoTrustEstimate(HycoROM model, HycoPrediction *prediction);
PetscErrorCode HycoTrustView(HycoROM model, PetscViewer viewer);
/* Distance of two points, each parameter scaled to its range. */
PetscReal HycoTrustDistance(HycoScene scene, const PetscReal a[], const PetscReal b[]);
/* Writes a model that came from a file once more, to `path`, with what was added to it since. */
PetscErrorCode HycoROMRewrite(HycoROM model, const char path[]);

/* The contact forces' part of a comparison before any division: 2-norms of what is missed and of the reference, of all
   contacts and of the RID's. */
typedef struct {
  PetscReal lost, size, rid_lost, rid_size;
} HycoForceErrors;

/* Errors of the last prediction against a full-order solution on the whole mesh: u (n_nodes * dim), sigma (n_cells *
   n_sigma; NULL: not compared), lambda (n_contacts). The errors in H1 and its dual are left alone. `forces` may be
   NULL. */
PetscErrorCode HycoROMCompareFields(HycoROM model, const PetscReal u[], const PetscReal sigma[],
                                    const PetscReal lambda[], HycoErrors *errors, HycoForceErrors *forces);

/* Writes the model; whole: the mesh and the modes on it (n_nodes * dim x l row major). */
PetscErrorCode HycoROMSave(HycoROM model, HycoMesh whole, const PetscReal V_whole[], const char path[]);
/* Reads the whole-mesh part. */
PetscErrorCode HycoROMLoadWhole(HycoROM model);

#endif
