/* HycoROM's struct and internal functions. All on one process, except HycoROMBroadcast(). */
#ifndef HYCOROMIMPL_H
#define HYCOROMIMPL_H

#include <hycodomain.h>
#include <hycocontactimpl.h>
#include <hycoromtype.h>
#include <hycofomimpl.h>
#include <hycoinelastic.h>
#include <hycosolverimpl.h>

typedef struct _n_HycoOutputCells *HycoOutputCells;
typedef struct _n_HycoCarried *HycoCarried;
typedef struct _n_HycoResultants *HycoResultants;
typedef struct _n_HycoFloating *HycoFloating;
typedef struct _n_HycoBalance *HycoBalance;

/* Terms of an error estimate (error_estimate.c): log(1 + feature / floor) with a coefficient for each feature, and a
   constant. */
#define HYCO_ESTIMATE_FEATURES 5
#define HYCO_ESTIMATE_DISTANCE 3 /* index of the distance among the features */
#define HYCO_FEATURES          9 /* the same and further ones, by which regimes unlike the held-out ones are noticed */
/* Of the largest force of a set: the size by which errors of smaller forces are divided; a tenth, since a nearly
   unloaded point would otherwise decide the largest relative error. */
#define HYCO_SMALL_FORCE 0.1
typedef enum { HYCO_ESTIMATE_U, HYCO_ESTIMATE_SIGMA, HYCO_ESTIMATE_LAMBDA, HYCO_N_ESTIMATES } HycoEstimateKind;
/* Of the largest absolute value of an output: the residual of a solve, 1e-8 at most and 1e-10 as a rule; smaller errors
   are not told from round-off. */
#define HYCO_OUTPUT_ROUND_OFF 1e-10
/* Error of a quantity of the scene, in its unit, for a path the largest of its listed times. */
typedef struct {
  PetscBool has; /* whether there is an estimate */
  PetscReal law[HYCO_ESTIMATE_FEATURES + 1];
  PetscReal magnitude;       /* its largest absolute value at the held-out points; < 0: not known, as the next two */
  PetscReal median, largest; /* of the errors there */
  /* Of types whose errors do not follow the features, at the held-out points: the largest norm of the field that the
     output follows, forces or displacements (HycoOutputNorm()); the largest error over that norm; over the absolute
     error of the field. norm 0: not known. */
  PetscReal norm, relative, amplified;
} HycoOutputEstimate;
typedef struct {
  PetscInt n; /* held-out predictions behind the estimates; 0: not calibrated */
  PetscReal floor[HYCO_ESTIMATE_FEATURES];
  PetscReal reached[HYCO_FEATURES]; /* the features' largest values at the held-out points; < 0: not known */
  PetscBool has[HYCO_N_ESTIMATES];  /* whether there is an estimate of this error */
  PetscReal law[HYCO_N_ESTIMATES][HYCO_ESTIMATE_FEATURES + 1]; /* coefficients >= 0, then the constant */
  PetscReal force; /* 2-norm of the largest held-out contact forces: errors of forces below a tenth of it are divided
                      by that tenth */
  PetscInt n_held; /* number of held-out predictions by which the model was judged; 0: none */
  /* their relative errors; very large: not converged, or x/0 */
  PetscReal median[HYCO_N_ESTIMATES], largest[HYCO_N_ESTIMATES];
  PetscReal cpu;      /* of the training, processor time; 0: not known (older files) */
  PetscInt n_outputs; /* 0: not judged (older files) */
  HycoOutputEstimate output[HYCO_MAX_QUANTITIES];
} HycoEstimates;

/* The path of the last prediction, for a scene with a history. `room` and `n` count accepted steps; the arrays of
   listed times are allocated for all of them. */
typedef struct {
  PetscInt n_given; /* prescribed times of the steps; NULL: chosen by the path. Borrowed */
  const PetscReal *given;
  PetscInt most_cuts, n_cuts; /* as in HycoPath; not 0 where training judges; of the last path */
  PetscReal rtol;             /* 0, or a tolerance of Newton's method below that of the options */
  PetscInt n, room;
  PetscReal *t, *gamma, *U_fe; /* n, n x l, n x n_fe */
  PetscInt n_listed, shown;    /* number of listed times reached; the one to which gamma, U and Lambda belong */
  PetscInt *at;                /* by listed time: its accepted step */
  PetscBool *loose;            /* by listed time: the position of a body is arbitrary (HycoPrediction) */
  PetscReal *Lambda, *sigma, *inelastic;
  PetscReal *shear; /* 8 n_contacts by listed time: force, slip, work, state; NULL: no friction */
  HycoShear seen;   /* borrows those of a listed time, or others */
  HycoHistory history;
  HycoStep *step; /* n_listed: its steps with the scene's quantities; NULL: not evaluated yet, or there are none */
} HycoTrace;

/* What a file holds: constant once training or loading has ended, and shared by the HycoROMs that HycoROMClone() makes.
   A type's own is in `data`. */
typedef struct _n_HycoModel *HycoModel;
struct _n_HycoModel {
  PetscInt references;
  HycoROMType type; /* the registry's string */
  HycoROMTraits traits;
  char path[PETSC_MAX_PATH_LEN]; /* "": was never in a file */
  HycoScene scene;
  HycoMesh mesh;           /* cells of Omega_A; its nodes and those of every contact */
  HycoPairs pairs;         /* all N_lambda contacts, node indices of mesh */
  IS rid, inside;          /* nodes of mesh: those of Omega_A; of them the set A (33), the others are the set I (32) */
  PetscInt *in_rid;        /* by contact: in A_lambda */
  PetscInt *closed;        /* by contact: has a force in some training solution; NULL: not known (older files) */
  PetscReal *master_reach; /* moved surfaces: largest distance of a master point, by contact of the scene; NULL: none
                              is moved, or the file is older than this search */
  PetscReal *facet;        /* by contact: HycoContactFacets(); NULL: an older file */
  PetscInt l;              /* POD modes */
  PetscReal *V;            /* (mesh n_nodes * dim) x l, row major: the modes on the nodes of mesh */
  PetscReal *sigma;        /* l singular values */
  HycoHybrid hybrid;
  PetscInt n_fe, *fe_dof; /* full-order displacements: dofs of mesh, ascending; hybrid models only */
  HycoFloating floating;  /* the bodies that contact alone holds (floating.c); NULL: there are none, or an older file */
  PetscInt n_points;
  PetscReal *points; /* training points, n_points x n_parameters */
  PetscInt n_stops;  /* of a history: times between the listed ones at which steps of predictions end as well, */
  PetscReal *stops, time_error; /* and the largest estimate of full order's error in time: HycoHistory */
  PetscReal *reach; /* least, then largest parameter values of the region of training (error_estimate.c); created
                        when needed */
  char *provenance;
  char fingerprint[32]; /* of the scene and mesh that it was trained on */
  PetscInt whole_nodes, whole_cells;
  PetscInt counts[3]; /* modes of the dual, stress and force bases that seeded the RID; projection: force vectors,
                         supremizers among the l modes (the last ones, with singular value 0), 0 */
  HycoEstimates estimates;
  char *search;         /* how train -target_... chose the settings, in words; NULL: it did not */
  PetscReal numbers[3]; /* condition number of the reduced stiffness (0: not known, or none), training errors of u and
                           lambda */
  /* the whole mesh, read when needed */
  HycoMesh whole;
  PetscReal *V_whole;
  HycoPairs whole_pairs;
  void *data;
};

/* Some contacts in place of all, at parameters of their own, and the forces there (near.c). */
typedef struct {
  HycoFE fe; /* on mesh, without the data of cells */
  HycoPairs pairs;
  HycoRows rows;
  HycoCarried carried;
  PetscReal *Lambda;
} HycoNear;

/* A model, with its last prediction and what is allocated to make one. */
struct _p_HycoROM {
  PETSCHEADER(HycoROMOps);
  HycoModel model;
  /* options and callbacks */
  PetscBool full_order, full_displacement; /* full-order actions requested from the caller, who has the scene:
                                              HycoROMGetFallback() */
  PetscBool wants_equilibrium;             /* -hyco_residual: each prediction computes the residual */
  PetscBool reconstruct;
  HycoPointMonitor point_monitor;
  void *point_ctx;
  /* what setup allocates */
  PetscBool ready;
  HycoFE fe;                 /* on mesh, or on a mesh of its first nodes (galerkin) */
  PetscInt n, n_L;           /* numbers of unknowns and multipliers of the reduced problem */
  PetscInt m, *contact;      /* the contacts of A_lambda: index in pairs */
  HycoPairs *of_fe;          /* the same contacts on fe's mesh */
  HycoContactState friction; /* of all contacts, on the path of a prediction; borrowed. NULL: none */
  HycoPairs pairs;           /* the model's, with what predictions change: masters on moved surfaces, and friction */
  PetscInt *slave_id;        /* mesh-file tag of each contact's slave */
  PetscBool spread;          /* Lambda may be nonzero outside A_lambda */
  HycoSolver solver;
  void *work; /* the type's */
  /* created when needed */
  HycoFE fe_beyond;             /* on mesh without its cells */
  HycoFE fe_whole;              /* on whole */
  HycoPairs whole_pairs;        /* as `pairs`, on whole */
  char loose[HYCO_LINE];        /* where prediction.loose is set: "body NAME in its place", or "body NAME from moving
                                   along ..." */
  HycoFE fe_floating;           /* on the loaded cells of the bodies that contact alone holds */
  HycoRigid *rigid;             /* their motions at the last prediction, if parameters change them */
  HycoOutputCells output_cells; /* of the scene's quantities */
  HycoOutputCells few;          /* those of them that decide the quantities near a prediction; NULL: not needed yet */
  HycoCarried carried;          /* results of the contacts (contact_results.c) */
  HycoBalance balance;          /* data kept by HycoROMGetEquilibrium() */
  HycoGradientStore gradient;   /* of HycoROMGetGradient() */
  HycoNear near[2];             /* for it: to the two sides of the prediction */
  HycoRows rows;                /* of B over dofs of mesh, all contacts; current after HycoROMComplete() */
  /* the last prediction */
  PetscBool solved;
  PetscBool measured;       /* its quantities are in `prediction` */
  PetscBool beyond_current; /* U on all nodes of mesh and the rows of all contacts are current: HycoROMComplete() was
                               called */
  PetscBool whole_current;  /* U_whole is current */
  PetscBool balanced;       /* balance belongs to it */
  PetscReal stretch; /* growth of the errors of what is interpolated, 1 or less inside; the ops `features` sets it */
  /* of the forces and moments on the bodies; corrected: before forces were scaled for it; < 0: they are not compared.
     Of a path the largest */
  PetscReal imbalance;
  PetscReal corrected;
  PetscReal remainder; /* of (41): the relative difference of the forces in the RID; of a path the largest */
  PetscReal *gamma, *U, *Lambda, *stress, *U_whole;
  PetscInt n_modal, *modal; /* the unknowns of fe that are not full-order ones; NULL: not needed yet */
  HycoTrace trace;          /* of a scene with a history */
  HycoPrediction prediction;
};

PetscErrorCode HycoROMCreate(HycoROM *model);
/* Called in the solve of a type that has paths. HycoTraceAdd(): the accepted step whose gamma and U are the model's,
   at fe's parameters. HycoTraceList(): at a listed time, Lambda, and the stresses (n_cells x n_sigma) and inelastic
   strains of the RID's cells (rom_path.c). */
PetscErrorCode HycoTraceBegin(HycoROM model);
PetscErrorCode HycoTraceAdd(HycoROM model, PetscReal t);
PetscErrorCode HycoTraceList(HycoROM model, PetscReal **sigma, PetscReal **inelastic);
/* For that listed time, with friction: the state of the contacts. HycoTraceShow(): the model's contacts have the
   friction of listed time k; call it before their results are evaluated. HycoTraceShowOther(): or this one, which is
   borrowed. */
PetscErrorCode HycoTraceListShear(HycoROM model, const HycoShear *shear);
void HycoTraceShow(HycoROM model, PetscInt k);
void HycoTraceShowOther(HycoROM model, const HycoShear *shear);
/* For that listed time, once m->Lambda has all contacts: its forces, and the norm of U in the RID. */
PetscErrorCode HycoTraceMeasure(HycoROM model, HycoStep *step);
/* In a type that steps along paths: reads the options of paths; solves the path at mu, and sets the prediction; at a
   listed time, its results over the model's cells and all contacts, with U and Lambda set (linear: `state` lacks the
   bodies with linear laws, whose energy is added). */
struct _n_HycoPath;
PetscErrorCode HycoTraceOptions(HycoROM model, struct _n_HycoPath *path);
PetscErrorCode HycoTraceFollow(HycoROM model, struct _n_HycoPath *path, const PetscReal mu[]);
PetscErrorCode HycoTraceRecord(HycoROM model, PetscBool linear, HycoFEState state, HycoStep *step);
PetscErrorCode HycoTraceFree(HycoROM model);
/* HycoROMSetSteps() for a path that training judges: it ends if too many of these steps are halved. */
PetscErrorCode HycoROMSetJudgedSteps(HycoROM model, PetscInt n, const PetscReal t[]);
/* Writes the fields of the path at its listed times on the whole mesh, as HycoFOMSetSeries() does (replay.c). */
PetscErrorCode HycoTraceWrite(HycoROM model, const char path[]);
/*
  Replay of the laws along the path of the last prediction, on `fe` (with any cells): HycoReplayBegin(), then for each
  accepted step k from 0 on HycoReplayMove(), which sets fe to its time and parameters, and HycoReplayStep() with the
  displacements u (n_dof) there, after which the march has its state and internal forces; fails if a law has no
  solution. HycoReplayTry() puts this into the report instead. HycoReplayEnd() also after a failure.
*/
typedef struct {
  HycoROM m; /* borrowed */
  HycoTimeLoop march;
} HycoReplay;
PetscErrorCode HycoReplayBegin(HycoROM model, HycoFE fe, HycoReplay *replay);
PetscErrorCode HycoReplayMove(HycoReplay *replay, PetscInt k);
PetscErrorCode HycoReplayStep(HycoReplay *replay, PetscInt k, const PetscReal u[]);
PetscErrorCode HycoReplayTry(HycoReplay *replay, PetscInt k, const PetscReal u[], HycoFEStepReport *report);
PetscErrorCode HycoReplayEnd(HycoReplay *replay);
/* Sets the part of a prediction that describes the path. */
void HycoTraceSummary(HycoROM model, HycoPrediction *prediction);
/* U of the whole mesh (n_dof) from the stored data of accepted step k, with fe_whole at its parameters. */
void HycoTraceWholeU(HycoROM model, PetscInt k, PetscReal U[]);
/* Builds the online data from the description; called again after the full-order set has changed. */
PetscErrorCode HycoROMSetUp(HycoROM model);
/* Checks n points as HycoROMPredict() does one; the error has the number of the point. */
PetscErrorCode HycoROMCheckPoints(HycoROM model, PetscInt n, PetscInt n_parameters, const PetscReal mu[]);
/* Frees the online data. */
PetscErrorCode HycoROMReset(HycoROM model);
/* The names of the registered types, in alphabetical order; NULL ends. Borrowed, until another is registered. */
PetscErrorCode HycoROMTypeNames(const char *const **names);
/* In a type's setup: creates gamma, U, Lambda, stress, slave tags and the solver, once fe is set. */
PetscErrorCode HycoROMSetUpFields(HycoROM model);
/* In a type's solve, after HycoROMSetUpDefault(): updates rows and gaps to mu where they have changed; U = u0 + V
   gamma. */
PetscErrorCode HycoROMBringRows(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoROMExpand(HycoROM model);
/* The same at the unknowns that are not full-order ones alone; the others, then HycoFEComplete(), are the caller's. */
PetscErrorCode HycoROMExpandModal(HycoROM model);
/* The number of modes with a singular value: those of a POD. */
PetscInt HycoROMCountPOD(HycoROM model);
/* Creates the sets of nodes from their number at each node of mesh: 0, 1 (on the interface I), or 2 (in A); NULL: all
   are in A. HycoROMGetDomain(): these numbers. */
PetscErrorCode HycoROMSetDomain(HycoROM model, const PetscInt sets[]);
PetscErrorCode HycoROMGetDomain(HycoROM model, PetscInt sets[]);
/* Sets the full-order unknowns (dofs of mesh, any order). */
PetscErrorCode HycoROMSetFE(HycoROM model, HycoHybrid hybrid, PetscInt n, const PetscInt dof[]);

/* The contacts of a handle: a copy where predictions search for masters, else the model's arrays. Drop frees the
   copy. */
PetscErrorCode HycoROMTakePairs(const HycoPairs *of, HycoPairs *own);
PetscErrorCode HycoROMDropPairs(HycoPairs *own);
/* Whether supports of fe hold a displacement of a row of these contacts. */
PetscBool HycoRowsAreHeld(HycoFE fe, const HycoPairs *pairs);
/* Updates the rows and gaps of all contacts, and U on all nodes of mesh, to the last prediction. */
PetscErrorCode HycoROMComplete(HycoROM model);
/* Updates only the rows and gaps; fe: at the last prediction's parameters, on a mesh with the nodes and facets of
   all contacts. Borrowed. */
PetscErrorCode HycoROMBringContacts(HycoROM model, HycoFE *fe);
/* start + B[k,:] U, after HycoROMComplete(). */
static inline PetscReal HycoROMAddRow(HycoROM model, PetscInt k, PetscReal start)
{
  for (PetscInt j = model->rows.start[k]; j < model->rows.start[k + 1]; j++)
    start += model->rows.value[j] * model->U[model->rows.dof[j]];
  return start;
}

/* The scene's quantities of the last prediction, of a path also those of its listed times (output_cells.c). */
PetscErrorCode HycoROMMeasureQuantities(HycoROM model, HycoPrediction *prediction);
/* For a path: evaluates them in its history's steps; done once. */
PetscErrorCode HycoROMMeasurePath(HycoROM model);
/* Sets the model up in training, where it has no whole mesh: the cells that the quantities need, with the numbers of
   their nodes and cells in the whole mesh, and the modes at their unknowns (n_dof x l, row major); the reactions that
   follow from balance, and the cells with the loads of their bodies (NULL, NULL: there are no reactions). Takes
   ownership of all. */
PetscErrorCode HycoROMSetOutputCells(HycoROM model, HycoMesh mesh, PetscReal V[], PetscBool balanced[],
                                     HycoMesh loaded);
/* The gradient at the state that the model and its type's problem have, into the arrays of `store` (n_outputs x
   n_parameters); *regular: false, without a gradient: forces of closed contacts are not unique (fails without a
   history). */
PetscErrorCode HycoROMStateGradient(HycoROM model, HycoGradientStore *store, HycoGradient *gradient,
                                    PetscBool *regular);
/* The gradient of a predicted path. */
PetscErrorCode HycoROMPathGradient(HycoROM model, HycoGradient *gradient);
/* Until HycoROMUnfocusOutputs() the quantities are measured on the cells that decide them near the last prediction,
   whose quantities are value[], just measured. *focused: they are on cells, not only of contacts. */
PetscErrorCode HycoROMFocusOutputs(HycoROM model, const PetscReal value[], PetscBool *focused);
PetscErrorCode HycoROMUnfocusOutputs(HycoROM model);
/* value[n_quantities] without a history, on cells at mu. */
PetscErrorCode HycoROMMeasureAt(HycoROM model, const PetscReal mu[], PetscReal value[]);
/* Of focused outputs, of types with the op `perturbed`: means over cells, facets or nodes are not measured, but known
   by their slopes at that prediction. The change of these in value[], from[] at the prediction, along `step` times
   changes of gamma (l) and of U; mu: where prescribed displacements are, NULL: at the prediction. */
PetscErrorCode HycoROMChangeMeans(HycoROM model, const PetscReal mu[], const PetscReal from[], PetscReal step,
                                  const PetscReal dgamma[], const PetscReal dU[], PetscReal value[]);
/* Marks the modes (l) and full-order displacements (dofs of mesh) on which they depend. */
void HycoROMOutputsRead(HycoROM model, PetscBool modes[], PetscBool dofs[]);
/* Whether no output needs displacements: results of contacts, and reactions that follow from balance. */
PetscBool HycoROMOutputsAreForces(HycoROM model);
/* Whether, with displacements and forces that do not change, the parameters p with changed[p] change the outputs of
   focused cells: those that are measured, and those known by slopes; held: they
   change displacements that supports prescribe to the latter. */
void HycoROMParametersEnter(HycoROM model, const PetscBool changed[], PetscBool *measured, PetscBool *slopes,
                            PetscBool *held);
/*
  The derivatives of the stresses of a path where bodies flow. HycoROMFocusPath(): as HycoROMFocusOutputs() for all
  listed times, which have been measured, with the laws' points there. HycoROMOutputsStep(): their step to accepted time
  k, from the first one on; HycoROMOutputsSensitivity(): then its derivative by the difference's parameter, with those
  of displacements; *smooth: false: a point leaves its yield surface. HycoROMOutputsMove(): quantities are those of
  stresses moved so along a parameter. HycoROMOutputsFlow(): there are such stresses. HycoROMOutputsFollow(): all
  quantities have derivatives so.
*/
PetscErrorCode HycoROMFocusPath(HycoROM model, PetscBool *focused);
PetscBool HycoROMPathIsFocused(HycoROM model);
PetscErrorCode HycoROMOutputsStep(HycoROM model, PetscInt k);
struct _n_HycoDifference;
PetscErrorCode HycoROMOutputsSensitivity(HycoROM model, const PetscReal mu[],
                                         const struct _n_HycoDifference *difference, const PetscReal dgamma[],
                                         const PetscReal dU[], PetscBool *smooth);
void HycoROMOutputsMove(HycoROM model, PetscInt parameter, PetscReal step);
PetscBool HycoROMOutputsFlow(HycoROM model);
PetscBool HycoROMOutputsFollow(HycoROM model);
/* Makes near[] of these n contacts, with the forces of the last prediction. HycoROMExchange(): near[side] takes the
   place of the model's contacts, which it has until the next call: motions of fe do not move what the prediction
   left. */
PetscErrorCode HycoROMMakeNear(HycoROM model, PetscInt n, const PetscInt contact[]);
void HycoROMExchange(HycoROM model, PetscInt side);
PetscErrorCode HycoNearDestroy(HycoNear *near);
/* On that mesh; NULL: the quantities need only results of contacts. Borrowed. */
HycoFE HycoROMGetOutputCells(HycoROM model);
/* Of a type with exact displacements beside modes: the share of the contact forces at nodes of cells, of those whose
   stresses the outputs need, that have modes at other nodes; 0: none, another type, or the
   outputs have not been measured. */
PetscErrorCode HycoROMShareDiscontinuous(HycoROM model, PetscReal *share);
/* The displacements and cell stresses there, of the last HycoROMMeasureQuantities() without a history; NULL as
   above. */
void HycoROMGetOutputFields(HycoROM model, const PetscReal *u[], const PetscReal *sigma[]);
/* The quantities of another solution at the last prediction's parameters, mu[] with the time of a history: u and sigma
   at the nodes and cells of the output cells (NULL: the model has none), Lambda of all contacts. reaction: for a path
   the supports' forces at these nodes (NULL: not known, NaN); else not needed. */
PetscErrorCode HycoROMMeasureSolution(HycoROM model, const PetscReal mu[], const PetscReal u[], const PetscReal sigma[],
                                      const PetscReal reaction[], const PetscReal Lambda[], PetscReal value[]);
/* Results of each contact of the scene for forces Lambda (of all contacts) at the last prediction's parameters; NULL
   if the model does not have all forces. Borrowed until the next call. */
PetscErrorCode HycoROMSumContacts(HycoROM model, const PetscReal Lambda[], const HycoContactResult *result[]);
/* Whether the model has the forces of all contacts. */
PetscBool HycoROMHasAllForces(HycoROM model);
/* The sum of the same contact forces on the bodies of[b] of the scene along an axis; if it has all. */
PetscErrorCode HycoROMPushBodies(HycoROM model, const PetscReal Lambda[], const PetscBool of[], PetscInt axis,
                                 PetscReal *force);

/*
  Equilibrium of bodies that contact alone holds (floating.c). HycoFloatingCreate(): n rigid motions that no support or
  spring prevents, the bodies of[n x n_bodies] that each moves, whether parameters change them, the mesh of the cells
  with these bodies' loads (NULL: none), and then supports;
  takes ownership of the mesh, after an error too. HycoFloatingMove(): writes it to the model file or reads it.
  HycoFloatingBalance(): at the last prediction's parameters, scales the positive forces in Lambda, each by the
  exponential of a linear combination of its works on the motions, so that the forces' work on each motion is that of
  the loads; forces that cannot do that stay as they are; raises `imbalance` and `corrected` by what is left and what
  was before. After HycoROMSetUp(). All are NULL-safe.
*/
PetscErrorCode HycoFloatingCreate(PetscInt n, const HycoRigid rigid[], PetscInt n_bodies, const PetscInt of[],
                                  PetscBool moves, HycoMesh loaded, HycoFloating *floating);
PetscErrorCode HycoFloatingMove(HycoH5 file, HycoROM model);
PetscErrorCode HycoFloatingBalance(HycoROM model);
PetscErrorCode HycoFloatingDestroy(HycoFloating *floating);
/* What n forces (force[at[k]]; at NULL: force[k]) miss of the balance with the loads along p motions, relative to the
   magnitudes of all terms of a motion, the largest: work[n x p] per force, load[p], size[p] of the loads' terms.
   rounding: work per reach of a motion that is not counted. */
PetscReal HycoROMImbalance(PetscInt p, PetscInt n, const PetscReal work[], const PetscInt at[], const PetscReal force[],
                           const PetscReal load[], const PetscReal size[], PetscReal rounding);
/* Writes a mesh below prefix/, or reads it and creates *mesh. */
PetscErrorCode HycoMeshMove(HycoH5 file, const char prefix[], PetscInt n_bodies, HycoMesh *mesh);

/* The reactions that follow from balance (resultants.c): balanced[] by HycoQuantitiesBalance(), the mesh of the cells
   marked by HycoQuantitiesMarkLoads(); takes ownership of both, after an error too. */
PetscErrorCode HycoResultantsCreate(HycoROM model, PetscBool balanced[], HycoMesh loaded, HycoResultants *resultants);
/* From the model's whole mesh. */
PetscErrorCode HycoResultantsFind(HycoROM model, HycoResultants *resultants);
/* Whether all reactions of a prediction follow. */
PetscBool HycoResultantsSuffice(HycoROM model, HycoResultants resultants);
/* The bodies from whose balance quantity q follows, if contact acts on them from outside; NULL otherwise. Borrowed. */
const PetscBool *HycoResultantsPushed(HycoROM model, HycoResultants resultants, PetscInt q);
const PetscBool *HycoROMGetPushed(HycoROM model, PetscInt q);
/* Whether a quantity is a reaction that follows from balance. */
PetscBool HycoResultantsFollow(HycoROM model, HycoResultants resultants, PetscInt q);
PetscBool HycoROMFollowsFromBalance(HycoROM model, PetscInt q);
/* Sets the quantities that follow from forces Lambda of a prediction and the loads at mu[]. NULL-safe. */
PetscErrorCode HycoResultantsSet(HycoROM model, HycoResultants resultants, const PetscReal mu[],
                                 const PetscReal Lambda[], PetscReal value[]);
/* What a reaction that does not follow, of this value, misses of the balance with the loads and contact forces of the
   last prediction, and the sum of the magnitudes of the forces; 0, 0: not known, as its group has not all supports of
   its bodies along the axis. NULL-safe. */
PetscErrorCode HycoResultantsMiss(HycoROM model, HycoResultants resultants, PetscInt q, PetscReal value,
                                  PetscReal *miss, PetscReal *size);
PetscErrorCode HycoROMGetMiss(HycoROM model, PetscInt q, PetscReal value, PetscReal *miss, PetscReal *size);
PetscErrorCode HycoResultantsDestroy(HycoResultants *resultants);
/* NULL-safe. */
PetscErrorCode HycoCarriedDestroy(HycoCarried *carried);
PetscErrorCode HycoOutputCellsDestroy(HycoOutputCells *cells);
PetscErrorCode HycoBalanceDestroy(HycoBalance *balance);

/* Features that indicate the last prediction's error without a full-order solution: feature[HYCO_FEATURES], all >= 0.
 */
PetscErrorCode HycoEstimatesFeatures(HycoROM model, PetscReal feature[]);
/* The estimated errors of the last prediction, and how far outside the ranges it lies. */
PetscErrorCode HycoEstimatesEvaluate(HycoROM model, HycoPrediction *prediction);
PetscErrorCode HycoEstimatesView(HycoROM model, PetscViewer viewer);
/* The norm of the predicted field that decides the output q, forces or displacements; kind (or NULL): of its error. */
PetscReal HycoOutputNorm(const HycoQuantity *q, const HycoPrediction *prediction, HycoEstimateKind *kind);
/* Distance of two points, with each parameter scaled to its range. */
PetscReal HycoEstimatesDistance(HycoScene scene, const PetscReal a[], const PetscReal b[]);
/* The contact forces' part of a comparison before any division: 2-norms of the error and of the reference, over all
   contacts and over the RID's. */
typedef struct {
  PetscReal lost, size, rid_lost, rid_size;
} HycoForceErrors;

/* Errors of the last prediction on the RID and of its forces against a full-order solution: u at the nodes of the
   model's mesh (n_nodes * dim), sigma in its cells (n_cells * n_sigma; NULL: not compared), lambda (n_contacts). The
   errors on the whole mesh are not changed. `forces` may be NULL. */
PetscErrorCode HycoROMCompareRID(HycoROM model, const PetscReal u[], const PetscReal sigma[], const PetscReal lambda[],
                                 HycoErrors *errors, HycoForceErrors *forces);

/* Writes rank 0's model and, each rank its rows, the distributed mesh with its first l modes V (rows in the file's
   order). Collective. */
PetscErrorCode HycoROMSave(HycoROM model, HycoFOM mesh, PetscInt l, Mat V, const char path[]);
/* Reads or writes the names of a mesh's groups. */
PetscErrorCode HycoMeshMoveGroupNames(HycoH5 file, const char name[], HycoMesh mesh);
/* The whole-mesh part of the file, by rows (whole_mesh.c). Collective. */
PetscErrorCode HycoROMWriteWhole(HycoH5 file, HycoFOM mesh, PetscInt l, Mat V);
/* Copies the model of rank 0, without its whole-mesh part, to every rank, through the bytes that HycoROMSave()
   writes; an existing *model of another rank is destroyed first. Collective. */
PetscErrorCode HycoROMBroadcast(MPI_Comm comm, HycoROM *model);
/* Reads the whole-mesh part, unless it is already read. */
PetscErrorCode HycoROMLoadWhole(HycoROM model);
PetscErrorCode HycoROMFreeWhole(HycoROM model);
/* The index of a dataset's text in a list of words. */
PetscErrorCode HycoROMLoadWord(HycoROM model, HycoH5 file, const char name[], const char *const words[],
                               PetscInt *index);

#endif
