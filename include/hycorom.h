/* HycoROM: the reduced model of a file, hybrid hyper-reduced (38)-(41), where online nothing of the full mesh is
   known; projection-based (44), on the whole mesh; with a cubature, on few weighted cells; condensed on the contact
   forces, interpolated over the parameters; or a regression over the parameters. */
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
#define HYCO_ROM_CONDENSED  "condensed"
#define HYCO_ROM_CUBATURE   "cubature"
#define HYCO_ROM_REGRESSION "regression"

/* Which displacements of a hybrid model are full order: -hyco_hybrid. */
typedef enum {
  HYCO_HYBRID_AUTO,    /* contact, or all where every unknown of A is a contact's */
  HYCO_HYBRID_RANK,    /* as many as give full row rank (39)-(40) */
  HYCO_HYBRID_CONTACT, /* every one on Gamma_A^C */
  HYCO_HYBRID_ALL      /* all of A; the interface follows from them through V: gamma = G U[A] */
} HycoHybrid;
extern const char *const HycoHybrids[]; /* their words; NULL ends */

/* What a prediction amounts to, in scene units. Of a projection-based model the RID is the whole mesh. */
typedef struct {
  char type[32], title[64]; /* the type, and in words; text, so that ranks may send the struct */
  PetscInt n_multipliers;   /* force unknowns: n_contacts, or the force vectors of a projection-based model */
  PetscInt n_dof, n_contacts, n_modes, n_fe_dofs;  /* reduced unknowns (modes + FE unknowns), contacts in the RID */
  PetscInt n_facing;                               /* contacts of the RID that may close, as in HycoSummary */
  PetscReal overlap, sliding;                      /* the same, of the RID's contacts */
  PetscInt n_all_contacts, n_active, n_rid_active; /* on the whole surface; those that press, there and in the RID */
  PetscInt iterations, rid_nodes, rid_elements, dim;
  PetscReal rid_fraction;  /* share of the mesh's elements in the RID */
  PetscReal covered_force; /* share of the total contact force that the RID's own multipliers carry; 1 without force */
  PetscReal total_contact_force;                                   /* reconstructed, whole contact surface */
  PetscReal lambda_max, lambda_norm2, u_norm2, u_min[3], u_max[3]; /* Lambda everywhere; u over the RID */
  PetscReal quantity[HYCO_MAX_QUANTITIES];                         /* those of HycoSceneGetQuantities() */
  PetscReal condition;                                             /* 1-norm estimate of the reduced stiffness */
  PetscReal
      path_quantity[HYCO_MAX_QUANTITIES]; /* of a path, over its listed times: the largest, of `min` the smallest */
  PetscReal path_force, path_mises,
      path_inelastic; /* of a path the largest of its listed times: total contact force, von
                         Mises stress and accumulated inelastic strain of the RID; else 0 */
  PetscReal residual,
      contact_residual; /* -hyco_residual: worst and worst_contact of HycoROMGetEquilibrium(); else -1 */
  /* An upper estimate of the relative errors of u (whole mesh, 2-norm), of the stress (RID, 2-norm of the cells'
     values) and of all contact forces (2-norm; a force below a tenth of the largest held out in training counts as that
     tenth), calibrated at training on held-out solutions; < 0: the model has none, or the solve did not converge. */
  PetscReal estimated_error_u, estimated_error_sigma, estimated_error_lambda;
  PetscReal estimated_error_u_full; /* condensed: of u by HycoFOMSolveForces() with these forces; else < 0 */
  PetscReal beyond; /* how far the parameters lie outside what training has seen: the most, as a share of the range */
  PetscBool gives_forces;        /* HycoROMGivesForces() */
  PetscReal interpolation_error; /* condensed: of the forces, relative, one training value left out, more outside
                                    the values; else 0 */
  HycoKKT kkt; /* of the reduced system (38) or (44); condensed: of w = g + G L, equilibrium (0) holding by its form */
  char method[64]; /* what solved, in words */
  HycoReason reason;
  HycoSeconds seconds;
} HycoPrediction;

/* What training's scan of the parameters' ranges found about the reduced stiffness. */
typedef struct {
  PetscInt n;          /* points; 0: not scanned (too many unknowns, or an older file) */
  PetscInt n_singular; /* points where its determinant has the rarer sign; more than 0: it is singular in the ranges */
  PetscReal smallest;  /* smallest singular value over the largest, the least of all points */
  PetscReal at[32];    /* the parameter values of that point */
} HycoScan;

/* Opens a model file on this process alone; the whole-mesh part stays in the file. Not collective: every process that
   calls it opens the file for reading. The caller owns it. Errors: not a model, damaged, of another version. */
PetscErrorCode HycoROMLoad(const char path[], HycoROM *model);
/* Frees; sets the handle to NULL; NULL-safe. */
PetscErrorCode HycoROMDestroy(HycoROM *model);
/* Borrowed from the library. */
PetscErrorCode HycoROMGetType(HycoROM model, HycoROMType *type);
/* Whether the model gives the forces of all contacts as those of the full order, as HycoFOMSolveForces() takes them. */
PetscErrorCode HycoROMGivesForces(HycoROM model, PetscBool *gives);
/* The scene that the model carries. Borrowed. */
PetscErrorCode HycoROMGetScene(HycoROM model, HycoScene *scene);

/* Fails unless the model was trained on this scene and mesh (its entries but titles, ranges and options; the mesh
   file's bytes). Collective on the scene's communicator. */
PetscErrorCode HycoROMCheckScene(HycoROM model, HycoScene scene);

/* Solves (38), (44) or the condensed problem at mu (length n) and reconstructs the contact forces, (41) or V_lambda.
   Not collective. Fails outside the trained ranges; not converging is no error: see HycoPrediction.reason. */
PetscErrorCode HycoROMPredict(HycoROM model, PetscInt n, const PetscReal mu[]);
/* Whether Predict takes parameters outside the trained ranges (default: it refuses them). There the estimated errors
   grow with the distance, and nothing has tested them. */
PetscErrorCode HycoROMSetExtrapolate(HycoROM model, PetscBool extrapolate);
/* Sizes of what a prediction gives: contacts, nodes of the RID (with those of the contacts outside it), components. Any
   output may be NULL. */
PetscErrorCode HycoROMGetSizes(HycoROM model, PetscInt *n_contacts, PetscInt *n_nodes, PetscInt *dim);
/*
  HycoROMPredict() at n points, mu n x n_parameters, with the same answers to the last bit (of a condensed model:
  to round-off) in the caller's order; inside, points that share their stiffness share its factor. The caller's arrays,
  each of which may be NULL: prediction (n), Lambda (n x n_contacts), U (n x n_nodes x dim, as HycoROMGetRID()'s). Not
  converging is no error: see HycoPrediction.reason. Afterwards no prediction is held. Not collective. Fails before any
  solve when a point lies outside the ranges.
*/
PetscErrorCode HycoROMSolveMany(HycoROM model, PetscInt n, PetscInt n_parameters, const PetscReal mu[],
                                HycoPrediction prediction[], PetscReal Lambda[], PetscReal U[]);
/* Called after each point of HycoROMSolveMany() with its number, in whatever order the points are solved: what is asked
   for is then of that point. NULL: nothing. Not collective. */
typedef PetscErrorCode (*HycoPointMonitor)(HycoROM model, PetscInt point, void *ctx);
PetscErrorCode HycoROMSetPointMonitor(HycoROM model, HycoPointMonitor monitor, void *ctx);
/* Reads -hyco_reconstruct, -hyco_reconstruct_solver, -hyco_fallback, -hyco_full_displacement, -hyco_residual;
   HycoROMLoad() does. */
PetscErrorCode HycoROMSetFromOptions(HycoROM model);
/* -hyco_fallback and -hyco_full_displacement: whether who has the scene is to solve full order where a prediction is
   not enough, and to solve once on the whole mesh with the predicted forces. */
PetscErrorCode HycoROMGetFallback(HycoROM model, PetscBool *full_order, PetscBool *displacement);
/* -hyco_residual: whether HycoROMGetPrediction() is to call HycoROMGetEquilibrium(). */
PetscErrorCode HycoROMWantsEquilibrium(HycoROM model, PetscBool *wants);
/* Whether Predict reconstructs the forces outside the RID (default: yes). */
PetscErrorCode HycoROMSetReconstruct(HycoROM model, PetscBool reconstruct);
/* Called after each iteration of the active set. */
PetscErrorCode HycoROMSetMonitor(HycoROM model, HycoMonitor monitor, void *ctx);
/*
  A model of paths, of a scene with a history: HycoROMPredict() solves the path at mu, in steps of its own choice by the
  rules of the full order (docs/history.md). HycoROMGetHistory() has the listed times that it reached (n is 0 for other
  models); what is asked for afterwards is of the last of them, or of that which HycoROMSetStep() names, 0 .. n - 1.
  HycoROMSetSteps() gives the times of the steps instead, as a full-order path took them (HycoHistory.taken): they are
  cut where they fail, and only there. NULL: its own choice. Borrowed, for all predictions to come. Not collective.
*/
PetscErrorCode HycoROMGetHistory(HycoROM model, HycoHistory *history);
PetscErrorCode HycoROMSetStep(HycoROM model, PetscInt k);
PetscErrorCode HycoROMSetSteps(HycoROM model, PetscInt n, const PetscReal t[]);
/* Accumulated inelastic strain of the RID's cells (mean), at that time. Borrowed until the next prediction. */
PetscErrorCode HycoROMGetInelastic(HycoROM model, PetscInt *n_cells, const PetscReal *inelastic[]);
/*
  How far the last prediction of a path is from the full order's equations, without a solution of them: at each listed
  time that it reached (n), as fractions. residual: of equilibrium on the whole mesh, |f_int - F + B^T L| in the dual
  of the elastic energy norm, beside the largest |u| of the path in that norm; contact: |min(g, c L)| with the gaps
  g = D - B u, beside the largest |B u| of the path, c the largest |B u| over the largest contact force. Arrays are
  borrowed until the next call. why: NULL, or why there is no answer; worst and worst_contact are then infinite, and n
  0.
*/
typedef struct {
  PetscInt n, at; /* at: the listed time of the worst residual */
  PetscReal worst, worst_contact;
  const PetscReal *residual, *contact;
  const char *why;
} HycoEquilibrium;
/* The laws are replayed on the whole mesh, which is read from the file on first use; the elastic stiffness is factored
   there, again where a parameter changes it. Not collective. Fails for a model without a history. */
PetscErrorCode HycoROMGetEquilibrium(HycoROM model, HycoEquilibrium *equilibrium);

/* What the last prediction amounts to, its errors estimated. Fails before the first. */
PetscErrorCode HycoROMGetPrediction(HycoROM model, HycoPrediction *prediction);
/* Strain energy of the last prediction on the RID's cells; it may cost as much as the prediction. */
PetscErrorCode HycoROMGetStrainEnergy(HycoROM model, PetscReal *energy);

/* Displacement of the RID's nodes (n_nodes x dim) and stress of its cells (n_cells x n_sigma, as HycoFOMGetSolution),
   with the mesh-file tags of the nodes and cells. Any output may be NULL. Borrowed until the next prediction. */
PetscErrorCode HycoROMGetRID(HycoROM model, PetscInt *n_nodes, const PetscInt *node_ids[], const PetscReal *U[],
                             PetscInt *n_cells, const PetscInt *cell_ids[], const PetscReal *sigma[]);
/* Contact forces of the whole contact surface (n_contacts, ordered as HycoFOMGetSolution's), the slave nodes' tags, and
   whether each is the RID's own multiplier (1) or reconstructed (0). Any output may be NULL. Borrowed. */
PetscErrorCode HycoROMGetLambda(HycoROM model, PetscInt *n_contacts, const PetscReal *Lambda[],
                                const PetscInt *node_ids[], const PetscInt *in_rid[]);
/* What each contact of the scene carries in the last prediction, as HycoFOMGetContacts(): by the forces of
   HycoROMGetLambda(), those up to 1e-10 of the largest being round-off, with full order's normals, areas and places.
   n: 0 where the model has not the forces of all contacts (HycoROMSetReconstruct()). Borrowed until the next call. */
PetscErrorCode HycoROMGetContacts(HycoROM model, PetscInt *n, const HycoContactResult *result[]);
/* Displacement of the whole mesh, n_nodes x dim in the mesh file's order: reads the whole-mesh part on first use.
 * Borrowed. */
PetscErrorCode HycoROMGetWholeU(HycoROM model, PetscInt *n_nodes, const PetscReal *U[]);
/* Writes the last prediction on the whole mesh to `path` (.xdmf) and the .h5 beside it, or to `path` (.vtkhdf). Of a
   path all of its listed times, as HycoFOMSetSeries() has them: the laws are replayed outside the RID, which fails
   where one has no answer. */
PetscErrorCode HycoROMWrite(HycoROM model, const char path[]);
/* Predicts at n points (n x n_parameters) and writes them to one file, as the times 0, 1, ... of a series, each with
   its mesh and parameters. Not of paths. */
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
  PetscReal sigma_11;        /* its first component, max norm */
  PetscReal lambda_rid;      /* the RID's own contact forces (Gamma_A^C), 2-norm */
  PetscReal lambda_rid_dual; /* the same, dual of H1 */
  PetscReal lambda;          /* all contact forces, reconstructed outside the RID, 2-norm */
  PetscReal lambda_dual;     /* the same, dual of H1 */
} HycoErrors;

/* Collective on the full-order model's communicator; model on its rank 0 (NULL elsewhere), errors filled there. Both
   must have been solved at the same parameters, on the same mesh. */
PetscErrorCode HycoROMCompare(HycoROM model, HycoFOM fom, HycoErrors *errors);

/* Prints what is in the model, in words, on an ASCII viewer. */
PetscErrorCode HycoROMView(HycoROM model, PetscViewer viewer);

/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoROMViewFromOptions(HycoROM object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
