/* HycoROM, inside. All on one process but HycoROMBroadcast(). */
#ifndef HYCOROMIMPL_H
#define HYCOROMIMPL_H

#include <hycodomain.h>
#include <hycocontactimpl.h>
#include <hycoromtype.h>
#include <hycofomimpl.h>
#include <hycoinelastic.h>
#include <hycosolverimpl.h>

typedef struct _n_HycoProbe *HycoProbe;
typedef struct _n_HycoCarried *HycoCarried;
typedef struct _n_HycoBalance *HycoBalance;

/* Rows of B in CSR over dofs of a mesh, and D: see HycoContactRows(). */
typedef struct {
  PetscInt *start, *dof;
  PetscReal *value, *gap;
} HycoRows;

/* What an estimate of the error is made of (error_estimate.c): log(1 + feature / floor), a coefficient each, and a
 * constant. */
#define HYCO_TRUST_FEATURES 5
#define HYCO_TRUST_DISTANCE 3 /* which of them is the distance */
/* Contact forces below this share of the largest of a set count as that much where errors are divided by them. */
#define HYCO_SMALL_FORCE 0.1
/* A predicted contact force up to this share of the largest is round-off. */
#define HYCO_PRESSES 1e-10
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

/* The path of the last prediction, of a scene with a history. `room` and `n` count accepted steps, the arrays of listed
   times have room for all of them. */
typedef struct {
  PetscInt n_given; /* times of steps to be taken; NULL: its own. Borrowed */
  const PetscReal *given;
  PetscInt most_cuts; /* of HycoPath; not 0 where training judges */
  PetscInt n, room;
  PetscReal *t, *gamma, *U_fe; /* n, n x l, n x n_fe */
  PetscInt n_listed, shown;    /* reached; the one that gamma, U, Lambda are of */
  PetscInt *at;                /* by listed time: its accepted step */
  PetscReal *Lambda, *sigma, *inelastic;
  HycoHistory history;
  HycoStep *step; /* n_listed: its steps with the scene's quantities; NULL: not measured yet, or there are none */
} HycoTrace;

/* What all types of reduced model have; a type's own is in `data`. */
struct _p_HycoROM {
  PETSCHEADER(HycoROMOps);
  HycoROMType type; /* the registry's own string */
  HycoROMTraits traits;
  char path[PETSC_MAX_PATH_LEN]; /* "": never was in a file */
  /* the description, as in the file */
  HycoScene scene;
  HycoMesh mesh;           /* cells of Omega_A; its nodes and those of every contact */
  HycoPairs pairs;         /* all N_lambda contacts, node indices of mesh */
  PetscInt *role;          /* by node of mesh */
  PetscInt *in_rid;        /* by contact: in A_lambda */
  PetscReal *master_reach; /* moved surfaces: how far masters may be, by contact of the scene; NULL: none is moved, or
                              the file is older than their search */
  PetscInt l;              /* POD modes */
  PetscReal *V;            /* (mesh n_nodes * dim) x l, row major: the modes on the nodes of mesh */
  PetscReal *sigma;        /* l singular values */
  HycoHybrid hybrid;
  PetscInt n_fe, *fe_dof; /* displacements that the modes do not give: dofs of mesh, ascending; hybrid models alone */
  PetscInt n_points;
  PetscReal *points; /* training points, n_points x n_parameters */
  PetscReal *reach; /* least, then largest values that training has seen of the parameters (error_estimate.c); made when
                       needed */
  char *provenance;
  char fingerprint[32]; /* of the scene and mesh that it was trained on */
  PetscInt whole_nodes, whole_cells;
  PetscInt counts[3]; /* modes of the dual, stress and force bases that seeded the RID; projection: force vectors,
                         supremizers among the l modes (the last, with singular value 0), 0 */
  HycoTrust trust;
  char *search; /* how train -target_... chose it, in words; NULL: it was not chosen so */
  PetscReal
      numbers[3]; /* condition of the reduced stiffness (0: not known, or none), training errors of u and lambda */
  /* the whole mesh, on demand */
  HycoMesh whole;
  PetscReal *V_whole, *U_whole;
  HycoFE fe_whole;
  HycoPairs whole_pairs;
  HycoBalance balance; /* what HycoROMGetEquilibrium() keeps; NULL: it was not called */
  PetscBool balanced;  /* it is that of the last prediction */
  HycoProbe probe;     /* of the scene's quantities; made by the first prediction that is asked for */
  HycoCarried carried; /* what the contacts carry (contact_results.c); made when somebody asks */
  HycoPointMonitor point_monitor;
  void *point_ctx;
  /* online */
  PetscBool full_order, full_displacement; /* what its user, who has the scene, is to do: HycoROMGetFallback() */
  PetscBool wants_equilibrium;             /* -hyco_residual: a prediction has it */
  PetscBool ready, reconstruct, solved, whole_current;
  HycoFE fe;                /* on mesh, or on its first nodes (galerkin) */
  PetscInt n, n_L;          /* unknowns and multipliers of the reduced problem */
  PetscInt m, *contact;     /* the contacts of A_lambda: index in pairs */
  HycoPairs *of_fe;         /* they, on fe's mesh */
  PetscInt *slave_id;       /* mesh-file tag of each contact's slave */
  HycoMesh beyond;          /* mesh without cells; NULL until somebody asks */
  HycoFE fe_beyond;         /* on it */
  PetscBool beyond_current; /* U on all nodes of mesh, the rows of all contacts: HycoROMComplete() was called */
  PetscBool spread;         /* Lambda is not 0 outside A_lambda */
  HycoRows rows;            /* of B over dofs of mesh, all contacts; current after HycoROMComplete() */
  HycoSolver solver;
  PetscReal *gamma, *U, *Lambda, *stress;
  HycoTrace trace; /* of a scene with a history */
  HycoPrediction prediction;
  void *data;
};

PetscErrorCode HycoROMCreate(HycoROM *model);
/* In the solve of a type that has paths: the accepted step whose gamma and U are the model's, at fe's parameters; and,
   of a listed time, Lambda, and the stresses (n_cells x n_sigma) and inelastic strains of the RID's cells (rom_path.c).
 */
PetscErrorCode HycoTraceBegin(HycoROM model);
PetscErrorCode HycoTraceAdd(HycoROM model, PetscReal t);
PetscErrorCode HycoTraceList(HycoROM model, PetscReal **sigma, PetscReal **inelastic);
/* Of that listed time, once m->Lambda is of all contacts: its forces, and the size of U in the RID. */
void HycoTraceMeasure(HycoROM model, HycoStep *step);
PetscErrorCode HycoTraceFree(HycoROM model);
/* HycoROMSetSteps() for a path that training judges: it ends where too many of these steps are cut. */
PetscErrorCode HycoROMSetJudgedSteps(HycoROM model, PetscInt n, const PetscReal t[]);
/* The fields of the path at its listed times on the whole mesh, as HycoFOMSetSeries() has them (replay.c). */
PetscErrorCode HycoTraceWrite(HycoROM model, const char path[]);
/*
  The laws again along the path of the last prediction, on `fe` (of whatever cells): HycoReplayBegin(), then of each
  accepted step k from 0 on HycoReplayMove(), with which fe stands at its time and parameters, and HycoReplayStep() with
  fe's displacements u (n_dof) there, after which the march has its state and internal forces; fails where a law has no
  answer. HycoReplayTry() says so in the report instead.
  HycoReplayEnd() also after a failure.
*/
typedef struct {
  HycoROM m; /* borrowed */
  HycoMarch march;
} HycoReplay;
PetscErrorCode HycoReplayBegin(HycoROM model, HycoFE fe, HycoReplay *replay);
PetscErrorCode HycoReplayMove(HycoReplay *replay, PetscInt k);
PetscErrorCode HycoReplayStep(HycoReplay *replay, PetscInt k, const PetscReal u[]);
PetscErrorCode HycoReplayTry(HycoReplay *replay, PetscInt k, const PetscReal u[], HycoFEStepReport *report);
PetscErrorCode HycoReplayEnd(HycoReplay *replay);
/* The path's part of a prediction. */
void HycoTraceSummary(HycoROM model, HycoPrediction *prediction);
/* U of the whole mesh (n_dof) from what accepted step k left of it, fe_whole being at its parameters. */
void HycoTraceWholeU(HycoROM model, PetscInt k, PetscReal U[]);
/* Builds what the online phase needs from the description; again after the full-order set changed. */
PetscErrorCode HycoROMSetUp(HycoROM model);
/* Frees what is online. */
PetscErrorCode HycoROMReset(HycoROM model);
/* The names of the registered types, in the alphabet's order; NULL ends. Borrowed, until another is registered. */
PetscErrorCode HycoROMTypeNames(const char *const **names);
/* In a type's setup: gamma, U, Lambda, stress, slave tags and the solver, once fe is there. */
PetscErrorCode HycoROMSetUpFields(HycoROM model);
/* In a type's solve, after HycoROMSetUpDefault(): rows and gaps at mu, as far as they have changed; U = u0 + V gamma.
 */
PetscErrorCode HycoROMBringRows(HycoROM model, const PetscReal mu[]);
PetscErrorCode HycoROMExpand(HycoROM model);
/* Modes with a singular value: those of a POD. */
PetscInt HycoROMCountPOD(HycoROM model);
/* Sets the full-order unknowns (dofs of mesh, any order). */
PetscErrorCode HycoROMSetFE(HycoROM model, HycoHybrid hybrid, PetscInt n, const PetscInt dof[]);

/* Room for the rows of contacts. */
PetscErrorCode HycoRowsCreate(const HycoPairs *pairs, PetscInt dim, HycoRows *rows);
PetscErrorCode HycoRowsDestroy(HycoRows *rows);
/* Brings the rows and gaps of all contacts and U of all nodes of mesh to the last prediction. */
PetscErrorCode HycoROMComplete(HycoROM model);
/* The rows and gaps alone; fe: at the last prediction's parameters, on a mesh with the nodes and facets of all
   contacts. Borrowed. */
PetscErrorCode HycoROMBringContacts(HycoROM model, HycoFE *fe);
/* start + B[k,:] U, after it. */
static inline PetscReal HycoROMAddRow(HycoROM model, PetscInt k, PetscReal start)
{
  for (PetscInt j = model->rows.start[k]; j < model->rows.start[k + 1]; j++)
    start += model->rows.value[j] * model->U[model->rows.dof[j]];
  return start;
}

/* The scene's quantities of the last prediction, of a path also those of its listed times (probe.c). */
PetscErrorCode HycoROMMeasureQuantities(HycoROM model, HycoPrediction *prediction);
/* Of a path: into its history's steps; done once. */
PetscErrorCode HycoROMMeasurePath(HycoROM model);
/* What each contact of the scene carries in forces Lambda (of all contacts) at the last prediction's parameters; NULL
   where the model has not the forces of all. Borrowed until the next call. */
PetscErrorCode HycoROMSumContacts(HycoROM model, const PetscReal Lambda[], const HycoContactResult *result[]);
/* NULL-safe. */
PetscErrorCode HycoCarriedDestroy(HycoCarried *carried);
PetscErrorCode HycoProbeDestroy(HycoProbe *probe);
PetscErrorCode HycoBalanceDestroy(HycoBalance *balance);

/* What tells of the last prediction's error without a full-order solution: feature[HYCO_TRUST_FEATURES], all >= 0. */
PetscErrorCode HycoTrustMeasure(HycoROM model, PetscReal feature[]);
/* The estimated errors of the last prediction, and how far outside the ranges it lies. */
PetscErrorCode HycoTrustEstimate(HycoROM model, HycoPrediction *prediction);
PetscErrorCode HycoTrustView(HycoROM model, PetscViewer viewer);
/* Distance of two points, each parameter scaled to its range. */
PetscReal HycoTrustDistance(HycoScene scene, const PetscReal a[], const PetscReal b[]);
/* The contact forces' part of a comparison before any division: 2-norms of what is missed and of the reference, of all
   contacts and of the RID's. */
typedef struct {
  PetscReal lost, size, rid_lost, rid_size;
} HycoForceErrors;

/* Errors of the last prediction on the RID and of its forces against a full-order solution: u at the nodes of the
   model's mesh (n_nodes * dim), sigma in its cells (n_cells * n_sigma; NULL: not compared), lambda (n_contacts). The
   errors on the whole mesh are left alone. `forces` may be NULL. */
PetscErrorCode HycoROMCompareRID(HycoROM model, const PetscReal u[], const PetscReal sigma[], const PetscReal lambda[],
                                 HycoErrors *errors, HycoForceErrors *forces);

/* Writes rank 0's model and, each rank its rows, the mesh over the ranks with its first l modes V (rows in the file's
   order). Collective. */
PetscErrorCode HycoROMSave(HycoROM model, HycoFOM mesh, PetscInt l, Mat V, const char path[]);
/* The names of a mesh's groups, to the file or from it. */
PetscErrorCode HycoMeshMoveGroupNames(HycoH5 file, const char name[], HycoMesh mesh);
/* The whole-mesh part of the file, by rows (whole_mesh.c). Collective. */
PetscErrorCode HycoROMWriteWhole(HycoH5 file, HycoFOM mesh, PetscInt l, Mat V);
/* The model of rank 0, without its whole-mesh part, on every rank, as the same bytes that HycoROMSave() writes; others'
 *model is destroyed first. Collective. */
PetscErrorCode HycoROMBroadcast(MPI_Comm comm, HycoROM *model);
/* Reads the whole-mesh part, unless it is there. */
PetscErrorCode HycoROMLoadWhole(HycoROM model);
PetscErrorCode HycoROMFreeWhole(HycoROM model);
/* The place of a dataset's text among words. */
PetscErrorCode HycoROMLoadWord(HycoROM model, HycoH5 file, const char name[], const char *const words[],
                               PetscInt *index);

#endif
