/* HycoROM: a reduced model from a file. Types: hybrid hyper-reduced (38)-(41), which needs only the RID online;
   projection-based (44), on the whole mesh; cubature, on few weighted cells; bodies, condensed to their
   surfaces; regression over the parameters. */
#ifndef HYCOROM_H
#define HYCOROM_H

#include <hycofom.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoROM *HycoROM;

/* -hyco_model_type; a program may register others (hycoromtype.h). */
typedef const char *HycoROMType;
#define HYCO_ROM_HYBRID     "hybrid"
#define HYCO_ROM_PROJECTION "projection"
#define HYCO_ROM_CUBATURE   "cubature"
#define HYCO_ROM_REGRESSION "regression"
#define HYCO_ROM_BODIES     "bodies"

/* Which displacements of a hybrid model are full order: -hyco_hybrid. */
typedef enum {
  HYCO_HYBRID_AUTO,    /* contact, or all if every unknown of A belongs to a contact */
  HYCO_HYBRID_RANK,    /* the fewest that give full row rank (39)-(40) */
  HYCO_HYBRID_CONTACT, /* all on Gamma_A^C */
  HYCO_HYBRID_ALL      /* all of A; the interface follows from them through V: gamma = G U[A] */
} HycoHybrid;
extern const char *const HycoHybrids[]; /* their names; ends with NULL */

#define HYCO_UNSEEN 3 /* HycoPrediction.unseen above it: another regime than at the held-out points */
extern const char *const HycoFeatureNames[];

/* Summary of a prediction, in scene units. For a projection-based model the RID is the whole mesh. */
typedef struct {
  char type[32], title[64]; /* the type and its title; arrays, so that ranks can send the struct */
  PetscInt n_multipliers;   /* force unknowns: n_contacts, or the force vectors of a projection-based model */
  /* Reduced unknowns (modes + FE unknowns); contacts in the RID, and those of them that may close, as in
     HycoSummary. */
  PetscInt n_dof, n_contacts, n_modes, n_fe_dofs, n_facing;
  PetscReal overlap, sliding; /* as in HycoSummary, of the RID's contacts */
  /* Contacts on the whole surface; those with a force, there and in the RID. */
  PetscInt n_all_contacts, n_active, n_rid_active;
  PetscInt iterations, rid_nodes, rid_elements, dim;
  PetscReal rid_fraction;  /* share of the mesh's elements in the RID */
  PetscReal covered_force; /* share of the total contact force that the RID's own multipliers carry; 1 without force */
  PetscReal total_contact_force;                                   /* reconstructed, whole contact surface */
  PetscReal lambda_max, lambda_norm2, u_norm2, u_min[3], u_max[3]; /* Lambda everywhere; u over the RID */
  PetscReal quantity[HYCO_MAX_QUANTITIES];                         /* those of HycoSceneGetQuantities() */
  PetscReal condition;                                             /* 1-norm estimate of the reduced stiffness */
  /* Of a path, the largest over its listed times (else 0): the quantities (for `min` the smallest), the total contact
     force, the von Mises stress and the accumulated inelastic strain of the RID. */
  PetscReal path_quantity[HYCO_MAX_QUANTITIES];
  PetscReal path_force, path_mises, path_inelastic;
  /* -hyco_residual: worst and worst_contact of HycoROMGetEquilibrium(); else -1. */
  PetscReal residual, contact_residual;
  /* An upper estimate of the relative errors of u (whole mesh, 2-norm), of the stress (RID, 2-norm of the cells'
     values) and of all contact forces (2-norm; a force below a tenth of the largest held out in training counts as that
     tenth), calibrated at training on held-out solutions; < 0: the model has none, or the solve did not converge. */
  PetscReal estimated_error_u, estimated_error_sigma, estimated_error_lambda;
  PetscReal estimated_error_quantity[HYCO_MAX_QUANTITIES]; /* the same for the absolute error of quantity[], in its
                                                              unit; of a path at all of its listed times */
  /* What the displacement misses at contacts with a force: |B u - D|, weighted by the forces, relative to the largest
     displacement of the contacts' surfaces; < 0: not known. inconsistent: it is larger than at the held-out points by
     more than HYCO_UNSEEN, so that displacements, stresses and reactions do not follow the forces. */
  PetscReal inconsistency;
  PetscBool inconsistent;
  /* What the loads and contact forces on a body, with all that its supports can carry, miss of the balance of forces
     and moments: along each motion that the supports leave free, relative to the sum of the magnitudes there, the
     largest, of a path of all listed times. Without a history also with the reactions among the outputs that are
     measured from displacements, of groups with all supports of their bodies along the axis, relative to the magnitudes
     of all forces; < 0: not compared. unbalanced: it is larger than the estimated error of the contact forces and of
     the reaction. */
  PetscReal balance;
  PetscBool unbalanced;
  /* How much larger than at all held-out points an indicator of the errors is, at least 1, and its index in
     HycoFeatureNames (-1: none is). Above HYCO_UNSEEN the prediction is in a regime by which the model was not judged;
     the estimates are multiplied by it, up to 100. */
  PetscReal unseen;
  PetscInt unseen_feature;
  PetscReal beyond;       /* largest distance of a parameter from the region of training, as a share of its range */
  PetscBool gives_forces; /* HycoROMGivesForces() */
  PetscReal interpolation_error; /* bodies: bound of the forces' relative error; else 0 */
  HycoKKT kkt;     /* of the reduced system (38) or (44); bodies: of the contacts, and of floating bodies */
  char method[64]; /* name of the method */
  HycoReason reason;
  HycoSeconds seconds;
  PetscInt n_dependent; /* bodies: as in HycoSummary; else -1. If > 0, the contact forces have no estimate */
  /* bodies: the contact forces leave a motion of a body free, along which its position is arbitrary; on a path at a
     listed time with forces, with friction also at a time before. Displacements, outputs of them and the work of
     friction then have no estimate */
  PetscBool loose;
  /* bodies: which motion of a body the loads have work on, of a reason below 0; "": HycoReasonName() says all */
  char why[512];
  /* where `loose` is set: its body, as far as known its direction, on a path the times; as in HycoSummary */
  char free_motion[512];
} HycoPrediction;

/* Result of the scan for a singular reduced stiffness in the parameters' ranges. */
typedef struct {
  PetscInt n;          /* points; 0: not scanned (too many unknowns, or an older file) */
  PetscInt n_singular; /* points where its determinant has the less frequent sign; > 0: singular in the ranges */
  PetscReal smallest;  /* smallest singular value divided by the largest, minimum over the points */
  PetscReal at[32];    /* the parameter values of that point */
} HycoScan;

/* Opens a model file on this process alone; the whole-mesh part stays in the file. Not collective: every process that
   calls it opens the file for reading. The caller owns it. Errors: not a model, damaged, of another version. */
PetscErrorCode HycoROMLoad(const char path[], HycoROM *model);
/* Frees; sets the handle to NULL; NULL-safe. What handles share is freed with the last of them. */
PetscErrorCode HycoROMDestroy(HycoROM *model);
/*
  Creates another handle on the same model, as DMClone() does for meshes: what the file holds exists once, and each
  handle has its own options, last prediction and work space, so that several predictions live side by side; each is
  bitwise that of a model that was loaded alone. The caller owns it, and may destroy the two in any order. Not
  collective. The scene is shared too, so that HycoROMSetExtrapolate() is for all of them. Not for several threads, of
  which the scene's expressions and Debian's PETSc know nothing: use processes.
*/
PetscErrorCode HycoROMClone(HycoROM model, HycoROM *clone);
/* Borrowed from the library. */
PetscErrorCode HycoROMGetType(HycoROM model, HycoROMType *type);
/* Whether the model gives accurate forces of all contacts, as HycoFOMSolveForces() needs them. */
PetscErrorCode HycoROMGivesForces(HycoROM model, PetscBool *gives);
/* Gets the scene that is stored in the model. Borrowed. */
PetscErrorCode HycoROMGetScene(HycoROM model, HycoScene *scene);

/* Fails unless the model was trained on this scene and mesh (all entries except titles, ranges and options; the bytes
   of the mesh file). Collective on the scene's communicator. */
PetscErrorCode HycoROMCheckScene(HycoROM model, HycoScene scene);

/* Solves (38), (44) or the problem of the bodies at mu (length n), and reconstructs the contact forces, (41), V_lambda.
   Not collective. Fails outside the ranges of the training. A solve that does not converge is not an error: see
   HycoPrediction.reason. */
PetscErrorCode HycoROMPredict(HycoROM model, PetscInt n, const PetscReal mu[]);
/* Whether Predict accepts parameters outside the ranges of the training (default: no). There the estimated errors grow
   with the distance, and are not tested. */
PetscErrorCode HycoROMSetExtrapolate(HycoROM model, PetscBool extrapolate);
/* Gets the sizes of a prediction: contacts, nodes of the RID (with those of the contacts outside it), components. Any
   output may be NULL. */
PetscErrorCode HycoROMGetSizes(HycoROM model, PetscInt *n_contacts, PetscInt *n_nodes, PetscInt *dim);
/*
  Predicts at n points, mu n x n_parameters. The results are bitwise those of HycoROMPredict() (for a model of bodies to
  round-off), in the caller's order; points that share a stiffness share its factor. The caller's arrays, each of which
  may be NULL: prediction (n), Lambda (n x n_contacts), U (n x n_nodes x dim, as in HycoROMGetRID()). A solve that does
  not converge is not an error: see HycoPrediction.reason. Afterwards there is no last prediction. Not collective. Fails
  before any solve if a point lies outside the ranges; the message has its number, from 0.
*/
PetscErrorCode HycoROMSolveMany(HycoROM model, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                HycoPrediction prediction[], PetscReal Lambda[], PetscReal U[]);
/*
  HycoROMSolveMany() divided over the ranks of comm. Each rank has loaded the model. If all give the same n, mu, arrays
  and model, each solves a share of consecutive points and receives the results of all, and an error on a rank is one on
  all of them. Otherwise each rank solves its own points, and receives their results and errors alone. Collective on
  comm.
*/
PetscErrorCode HycoROMSolveShared(MPI_Comm comm, HycoROM model, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                  HycoPrediction prediction[], PetscReal Lambda[], PetscReal U[]);
/* Called after each point of HycoROMSolveMany() with its number, in the order in which the points are solved. The
   model's getters then return the results of that point. NULL: none. Not collective. */
typedef PetscErrorCode (*HycoPointMonitor)(HycoROM model, PetscInt point, void *ctx);
PetscErrorCode HycoROMSetPointMonitor(HycoROM model, HycoPointMonitor monitor, void *ctx);
/* Reads -hyco_reconstruct, -hyco_reconstruct_solver, -hyco_fallback, -hyco_full_displacement, -hyco_residual.
   HycoROMLoad() calls it. */
PetscErrorCode HycoROMSetFromOptions(HycoROM model);
/* -hyco_fallback and -hyco_full_displacement: whether the caller, who has the scene, should solve full order if a
   prediction is not accurate enough, and should solve once on the whole mesh with the predicted forces. */
PetscErrorCode HycoROMGetFallback(HycoROM model, PetscBool *full_order, PetscBool *displacement);
/* -hyco_residual: whether HycoROMGetPrediction() calls HycoROMGetEquilibrium(). */
PetscErrorCode HycoROMWantsEquilibrium(HycoROM model, PetscBool *wants);
/* Whether Predict reconstructs the forces outside the RID (default: yes). */
PetscErrorCode HycoROMSetReconstruct(HycoROM model, PetscBool reconstruct);
/* Called after each iteration of the active set. */
PetscErrorCode HycoROMSetMonitor(HycoROM model, HycoMonitor monitor, void *ctx);
/*
  For a model of paths (a scene with a history), HycoROMPredict() solves the path at mu, in steps chosen by the rules of
  full order (docs/history.md). HycoROMGetHistory() returns the listed times that it reached (n is 0 for other models).
  Results are those of the last of them, or of the time set by HycoROMSetStep(), 0 .. n - 1. HycoROMSetSteps()
  prescribes the times of the steps, for example those of a full-order path (HycoHistory.taken); a step is halved only
  if it fails. NULL: steps are chosen by the model. The array is borrowed for all later predictions. Not collective.
*/
PetscErrorCode HycoROMGetHistory(HycoROM model, HycoHistory *history);
PetscErrorCode HycoROMSetStep(HycoROM model, PetscInt k);
PetscErrorCode HycoROMSetSteps(HycoROM model, PetscInt n, const PetscReal t[]);
/* Gets the accumulated inelastic strain of the RID's cells (means) at that time. Borrowed until the next prediction. */
PetscErrorCode HycoROMGetInelastic(HycoROM model, PetscInt *n_cells, const PetscReal *inelastic[]);
/*
  Residuals of the last prediction of a path in the full-order equations, without a full-order solve, at each listed
  time that it reached (n), as fractions. residual: that of equilibrium on the whole mesh, |f_int - F + B^T L| in the
  dual of the elastic energy norm, divided by the largest |u| of the path in that norm. contact: |min(g, c L)| with the
  gaps g = D - B u, divided by d, where c is d divided by the largest contact force. d: the largest displacement of
  the path at the contacts, |B u|, or |u| of the slaves where that is more. Arrays are borrowed until the next call.
  why: NULL, or the reason of a failure; worst and worst_contact are then infinite, and n is 0.
*/
typedef struct {
  PetscInt n, at; /* at: the listed time of the worst residual */
  PetscReal worst, worst_contact;
  const PetscReal *residual, *contact;
  const char *why;
} HycoEquilibrium;
/* Replays the laws on the whole mesh, which is read from the file on first use. The elastic stiffness is factored
   there, and again if a parameter changes it. Not collective. Fails for a model without a history. */
PetscErrorCode HycoROMGetEquilibrium(HycoROM model, HycoEquilibrium *equilibrium);

/* Processor time of the training that made the model, in seconds; 0: not known. */
PetscErrorCode HycoROMGetTrainingCost(HycoROM model, PetscReal *cpu);
/* Gets the summary of the last prediction, with estimated errors. Fails before the first prediction. */
PetscErrorCode HycoROMGetPrediction(HycoROM model, HycoPrediction *prediction);
/*
  Gets the gradient of the model's outputs at the last prediction (hycofom.h), by the linear system of its closed
  contacts and differences of the model's data, never of predictions; of paths but those of bodies, by differences of
  two paths for each parameter in their steps. The prediction stays. Not collective. Fails without an output or a
  parameter, for a type without gradients, where the solve did not converge or a path did not end, and where the forces
  of closed contacts are not unique; after an error there is no last prediction.
*/
PetscErrorCode HycoROMGetGradient(HycoROM model, HycoGradient *gradient);

/* A fit: mu[] is the caller's. */
typedef struct {
  PetscReal misfit;                     /* root mean square of the relative differences from the targets */
  PetscReal scale[HYCO_MAX_QUANTITIES]; /* by target: what its difference is divided by */
  PetscBool converged, kink;     /* the slope of the misfit vanishes within the ranges; derivatives are one-sided */
  PetscInt evaluations;          /* predictions */
  PetscInt n_starts, n_least;    /* minimisations; those that ended at the least misfit */
  PetscInt n_free, n_determined; /* parameters that are not held; those that the targets determine near the answer, or
                                    combinations of them: with fewer it is one of many */
  char method[64];               /* TAO types of the best one */
} HycoFit;
#define HYCO_FIT_BRGN  "brgn"
#define HYCO_FIT_BLMVM "blmvm"
/*
  Finds the parameters within the ranges at which n outputs of the model are closest to targets, output[n] their indices
  (of a path at its last listed time; n_outputs more: their largest over the listed times, path_quantity): the least
  squares of (output - target) / |target| (a target of 0: over the largest output at the samples), on the model's
  gradients by the TAO type `type`, then by the other one if that ends at no minimum. It minimises from the n_starts
  best of n_samples predictions (n_starts, if these are more) over the ranges, or (start: not NULL) from there alone.
  held[n_parameters]: values within the ranges that parameters keep, NaN: it is free; NULL: all are. mu[n_parameters] is
  the best answer, and the last prediction the one there. Not collective; on several ranks answers may differ in the
  last bits. Fails where HycoROMGetGradient() does, and if no prediction at a start converges.
*/
PetscErrorCode HycoROMFit(HycoROM model, PetscInt n, const PetscInt output[], const PetscReal target[],
                          const PetscReal start[], const PetscReal held[], PetscInt n_samples, PetscInt n_starts,
                          const char type[], PetscReal mu[], HycoFit *fit);
/* Gets the strain energy of the last prediction on the RID's cells; this may cost as much as the prediction. */
PetscErrorCode HycoROMGetStrainEnergy(HycoROM model, PetscReal *energy);

/* Gets the displacement of the RID's nodes (n_nodes x dim) and the stress of its cells (n_cells x n_sigma, as in
   HycoFOMGetSolution), with the mesh-file tags of the nodes and cells. Any output may be NULL. Borrowed until the next
   prediction. */
PetscErrorCode HycoROMGetRID(HycoROM model, PetscInt *n_nodes, const PetscInt *node_ids[], const PetscReal *U[],
                             PetscInt *n_cells, const PetscInt *cell_ids[], const PetscReal *sigma[]);
/* Gets the contact forces of the whole contact surface (n_contacts, in the order of HycoFOMGetSolution()), the tags of
   the slave nodes, and whether each force is a multiplier of the RID (1) or reconstructed (0). Any output may be NULL.
   Borrowed. */
PetscErrorCode HycoROMGetLambda(HycoROM model, PetscInt *n_contacts, const PetscReal *Lambda[],
                                const PetscInt *node_ids[], const PetscInt *in_rid[]);
/* Gets the resultants of each contact of the scene in the last prediction, as HycoFOMGetContacts(): from the forces of
   HycoROMGetLambda(), of which those up to 1e-10 of the largest count as round-off, with exact normals, areas and
   positions. n: 0 if the model has not the forces of all contacts (HycoROMSetReconstruct()). Borrowed until the next
   call. */
PetscErrorCode HycoROMGetContacts(HycoROM model, PetscInt *n, const HycoContactResult *result[]);
/* Gets the displacement of the whole mesh, n_nodes x dim in the mesh file's order. Reads the whole-mesh part on first
   use. Borrowed. */
PetscErrorCode HycoROMGetWholeU(HycoROM model, PetscInt *n_nodes, const PetscReal *U[]);
/* Writes the last prediction on the whole mesh to `path` (.xdmf) and the .h5 beside it, or to `path` (.vtkhdf). For a
   path it writes all listed times, as HycoFOMSetSeries() does: the laws are replayed outside the RID, and the function
   fails if this is not possible. */
PetscErrorCode HycoROMWrite(HycoROM model, const char path[]);
/* Predicts at n points (n x n_parameters) and writes them to one file, as the times 0, 1, ... of a series, each with
   its mesh and parameters. Not for paths. */
PetscErrorCode HycoROMWriteMany(HycoROM model, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                const char path[]);
/*
  Errors of the last prediction against the last full-order solution at the same parameters; relative, as fractions.
  0/0 counts as 0; x/0 is PETSC_INFINITY. On a mesh that moves, H1 and its dual are those of the middle of the ranges.
*/
typedef struct {
  PetscReal u;               /* displacement of the whole mesh, 2-norm of the nodal values */
  PetscReal u_h1;            /* the same, H1 */
  PetscReal u_rid;           /* displacement of the RID's nodes, max norm */
  PetscReal sigma;           /* stress of the RID's cells, 2-norm of the cell values */
  PetscReal sigma_11;        /* its first component, max norm; 0 below 1e-12 of the largest stress */
  PetscReal sigma_norm2;     /* no error: the 2-norm of full order's stress there, by which sigma is divided */
  PetscReal lambda_rid;      /* the RID's own contact forces (Gamma_A^C), 2-norm */
  PetscReal lambda_rid_dual; /* the same, dual of H1 */
  PetscReal lambda;          /* all contact forces, reconstructed outside the RID, 2-norm */
  PetscReal lambda_dual;     /* the same, dual of H1 */
} HycoErrors;

/* Collective on the full-order model's communicator; model on its rank 0 (NULL elsewhere), where errors is set. Both
   must have been solved at the same parameters, on the same mesh. */
PetscErrorCode HycoROMCompare(HycoROM model, HycoFOM fom, HycoErrors *errors);

/*
  A program of its own for the predictions of a model, in a format of an extension or of a caller: an exporter writes it
  to `path`, completely or not at all, and describes it in lines of text that the caller frees (PetscFree).
  HycoROMExport() fails where the format is not known, and in one line that names what the format cannot hold of this
  model. Not collective.
*/
typedef PetscErrorCode (*HycoExporter)(HycoROM model, const char path[], char **description);
PetscErrorCode HycoExporterRegister(const char format[], HycoExporter write);
PetscErrorCode HycoROMExport(HycoROM model, const char format[], const char path[], char **description);

/* Describes the model on an ASCII viewer. */
PetscErrorCode HycoROMView(HycoROM model, PetscViewer viewer);

/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoROMViewFromOptions(HycoROM object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
