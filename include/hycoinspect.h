/* HycoInspection: what a scene consists of and what its mesh, contacts and costs are, over the ranges of its
   parameters, without a solve; hyco check prints it. hyco.h does not include it. */
#ifndef HYCOINSPECT_H
#define HYCOINSPECT_H

#include <hycofom.h>
#include <hycosamples.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* What a parameter, the time or a table affects, by the entries that contain it. A map moves everything on its body;
   laws are those constants that do not affect the elastic stiffness. */
typedef enum {
  HYCO_AFFECTS_MAPS,
  HYCO_AFFECTS_STIFFNESS,
  HYCO_AFFECTS_LAWS,
  HYCO_AFFECTS_TEMPERATURES,
  HYCO_AFFECTS_ROWS, /* of contacts */
  HYCO_AFFECTS_GAPS,
  HYCO_AFFECTS_FRICTION, /* coefficients of friction */
  HYCO_AFFECTS_LOADS,
  HYCO_AFFECTS_SUPPORTS,
  HYCO_N_AFFECTED
} HycoAffected;
extern const char *const HycoAffectedNames[HYCO_N_AFFECTED];

typedef struct {
  const char *name;
  PetscBool affects[HYCO_N_AFFECTED];
  PetscBool wide; /* a positive stiffness that varies over more than a decade */
} HycoVariableInspection;

typedef struct {
  const char *name;
  PetscInt n_cells, n_parts;      /* parts share no node */
  PetscReal stretch;              /* largest length of a cell over its width, 1: regular; 0 in 1D */
  PetscInt stretched;             /* tag of that cell */
  PetscInt n_doubled, doubled[2]; /* nodes on another node of the body, away from contacts and ties: it is open there;
                                     tags of the first two */
} HycoBodyInspection;

typedef struct {
  const char *name, *type, *slave, *master; /* groups; master NULL: none */
  PetscBool quadratic;                      /* cells of second order */
  PetscInt n_slaves;                        /* nodes of the slave group */
  PetscInt n, facing_min, facing_max; /* number of contacts; of those that may close, the smallest and largest number */
  PetscReal gap_min, gap_max;         /* gaps of those that may close; max < min: no contact may close */
  PetscReal buried;     /* HycoSummary.buried: the largest share of an extent, at any of the points; 0: none */
  PetscInt between;     /* masters between nodes, as where meshes do not match, unless the type is for this */
  PetscBool integrated; /* the type integrates over facets: either side may be the finer */
  PetscReal coarse; /* slave's facet size over the master's, median, where most contacts may close; 0: not compared */
  PetscReal stiff_min, stiff_max; /* modulus of the slave's cells over the master's, extremes; 0: not compared */
  PetscReal tolerance;            /* of the search, where the scene states it and it decides; < 0: else */
} HycoContactInspection;

typedef struct {
  const char *name, *slave, *master;
  PetscInt n_nodes; /* of the slave */
  PetscReal coarse; /* as of a contact */
  PetscBool mortar; /* slaves follow means: either side may be the finer */
} HycoTieInspection;

/* Two groups of one dimension with nearly the same nodes, or with names that differ in letter case alone. */
typedef struct {
  const char *name[2];
  PetscInt n[2], common; /* nodes */
  PetscBool nodes, letters;
} HycoAlikeGroups;

typedef struct {
  /* of fom */
  PetscInt n_nodes, n_cells, n_free, n_fixed, n_contacts; /* nodes and cells; unknowns, fixed by supports and ties */
  PetscReal n_values;                                     /* numbers of a stored solution */
  PetscInt n_points;                                      /* of the ranges that were assembled */
  PetscBool corners; /* the centre and all corners; else the centre and both ends of each range */
  /* on rank 0 */
  PetscInt dim;
  PetscReal length;      /* the mesh's extent */
  const char *mesh;      /* path; NULL: of the program */
  const char *cell_type; /* the widest */
  PetscBool face_nodes;  /* hex20 cells of the file have become hex27 */
  PetscInt n_types, *cells;
  const char **type; /* types of cells that occur, and the number of cells of each */
  PetscInt n_bodies, n_scene_contacts, n_ties, n_variables, n_alike;
  HycoBodyInspection *body;
  HycoContactInspection *contact;
  HycoTieInspection *tie;
  HycoVariableInspection *variable; /* parameters, with a history then the time and its tables */
  HycoAlikeGroups *alike;
  PetscInt n_groups; /* of the mesh; by group: */
  const char **group;
  PetscBool *used, *empty;      /* some entry names it; it has no node of a body */
  PetscInt n_without;           /* largest number of contacts between fixed unknowns */
  char regularised[512];        /* motions that -hyco_regularise removes; "": none */
  PetscInt n_systems, n_lifted; /* assembled systems; those whose loads no contact forces balance (not with friction) */
  char lifted[1024];            /* the point of the first of these, and why a solve fails there; "": none */
  PetscInt n_motions, loose;    /* rigid motions that no support keeps; those of bodies that are not rigid */
  char **motion;                /* their names */
  char no_bodies[1024];         /* why training refuses a model of bodies; "": it does not, or was not asked */
  PetscBool loaded;             /* something moves the bodies at one of the points: a load, a support, heat, a gap */
  char bodies[1024];            /* how the parameters enter the bodies; "": not of this scene */
  PetscReal bytes, resident;    /* memory of a factor; of the processes now, all ranks */
  PetscReal first, next;        /* estimated seconds of a solve with a new stiffness, with the last one; on each rank */
  /* assumed values of the parameters that change bodies, of a model of bodies; 0: no such model */
  PetscInt body_values;
  PetscReal body_training[2], body_prediction; /* estimated seconds of its training, held-out solutions included, at
                                                  least and at most; of a prediction */
  HycoFOM whole;                               /* what the names belong to */
} HycoInspection;

/*
  Assembles K, F, B and D at the centre and the corners of the ranges (with a history at its first and last time) as a
  solve does, and inspects them. An error of the assembly is raised with the point. The caller destroys it.
  Collective.
*/
PetscErrorCode HycoInspect(HycoFOM fom, HycoInspection *inspection);
PetscErrorCode HycoInspectionDestroy(HycoInspection *inspection);
/* The number of solutions of a training on these samples (NULL: on a typical number), held-out ones included, and of
   the stiffnesses among them. Not collective. */
PetscErrorCode HycoInspectionCountTraining(HycoScene scene, HycoSamples samples, PetscInt *n_training,
                                           PetscInt *n_stiffness);

#if defined(__cplusplus)
}
#endif
#endif
