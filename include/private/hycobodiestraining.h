/* The training of models of bodies: how parameters enter the bodies, samples, loads, fields, inelastic modes. */
#ifndef HYCOBODIESTRAINING_H
#define HYCOBODIESTRAINING_H

#include <hycobodies.h>
#include <hycoreducerimpl.h>
#include <hycosnapshotsimpl.h>

/* Parameters that change the shape of bodies, at most. */
#define HYCO_MOST_THETA 3

/* How a parameter enters a body: the sum of these. */
enum {
  HYCO_ENTERS_LOADS = 1,  /* loads, prescribed displacements */
  HYCO_ENTERS_FACTOR = 2, /* one factor of the stiffness */
  HYCO_ENTERS_PLACE = 4,  /* a rigid motion or a mirror */
  HYCO_ENTERS_SIZE = 8,   /* a uniform scaling */
  HYCO_ENTERS_SHAPE = 16  /* anything else that changes the stiffness */
};

#define HYCO_BODIES_SAMPLES 60 /* of bodies that change, without an option */
/* Of a training's tolerance, what left out terms and single precision may add: a tenth, so that they do not decide. */
#define HYCO_SHORTENED 0.1
/* Share of the contacts that costs assume closed: announced against measured times (tests/models/bodies.py). */
#define HYCO_ASSUMED_CLOSED 0.3

/* The bodies of a mesh, and how each parameter enters each; on every rank. */
typedef struct {
  PetscInt n, n_parameters;
  char (*name)[64];    /* of the scene's bodies in it: "block", "block + plate" */
  PetscInt *of;        /* by node of the process's part: its body */
  PetscInt *enters;    /* n x n_parameters */
  PetscInt *support;   /* the same: the support (of scene->fixed) that does not turn with the body; -1: none */
  PetscBool *together; /* by body: similar to itself where all other parameters change at once */
} HycoBodyParts;

/* Finds them by evaluation at points of the ranges, with changes from the point mu; leaves fom's element loop without
   parameters. Collective. */
PetscErrorCode HycoBodyPartsFind(HycoFOM fom, const PetscReal mu[], HycoBodyParts *parts);
PetscErrorCode HycoBodyPartsDestroy(HycoBodyParts *parts);
/* "place: moves body cylinder rigidly; modulus: scales body block; no body needs a sample" */
PetscErrorCode HycoBodyPartsDescribe(HycoScene scene, const HycoBodyParts *parts, char text[HYCO_LINE]);
/* Why no model of these bodies can be made, in the words of training; "": it can. The contacts have been found.
   Collective. */
PetscErrorCode HycoBodyPartsRefuse(HycoFOM fom, const HycoBodyParts *parts, char why[HYCO_LINE]);
/* The number of parameters that change the shape of some body (of body b; b < 0: of any), and which. */
PetscInt HycoBodyPartsShapes(const HycoBodyParts *parts, PetscInt b, PetscInt parameter[]);
/* The first body that is not similar to itself at the same values of these; -1: none. */
PetscInt HycoBodyPartsFail(const HycoBodyParts *parts);

/* A body condensed at its own theta: that of `first` where it does not change the body. theta on every rank, else rank
   0. */
typedef struct {
  PetscReal *theta;            /* n_theta */
  PetscReal *C, *R, *Z, *work; /* n x n; n x r; n x p; p x r, where the body has none of the p motions 0 */
  PetscReal *L;                /* the Cholesky factor of C, once it is held out; rank 0 */
} HycoBodyRecord;

/* How laws in few cells give the coefficients of the inelastic forces. */
enum { HYCO_BODIES_AUTO, HYCO_BODIES_INTERPOLATION, HYCO_BODIES_CUBATURE };

/* Training: options and the data of a run. */
typedef struct {
  PetscReal pod_tol, tol, inelastic_tol, cubature_tol;
  PetscInt samples, most_samples, cells, laws; /* laws: how they are evaluated in few cells */
  PetscBool named;                             /* by an option */
  HycoBasis strains;                           /* modes of the inelastic forces; V is NULL without a history */
  PetscInt n_laws; /* points of the last model at which the laws are evaluated; 0: none yet */
  HycoBodyParts parts;
  HycoSubstructures bodies;  /* complete on rank 0 */
  PetscInt n_factors;        /* of single bodies */
  PetscBool filled;          /* modes are still many for the largest number of samples */
  PetscBool limited;         /* most_samples is the user's */
  PetscReal room;            /* samples that a finer grid may have */
  char ended[HYCO_LINE / 4]; /* what ended the sampling above the tolerance; "": nothing */
} * HycoBodiesTraining;

static inline HycoBodiesTraining HycoTrainingOfBodies(HycoReducer t)
{
  return (HycoBodiesTraining)t->training;
}

/* A body's block of K and its factors, with the unknowns of its surfaces last. Every rank. */
typedef struct {
  IS global;            /* its unknowns on this rank, in the distributed vectors */
  Mat K, N;             /* its block; N selects the unknowns of the surfaces, NULL: none */
  PetscInt p, *motion;  /* its rigid motions, by their numbers among all */
  PetscInt *pin;        /* its isostatic supports: unknowns of the block */
  HycoDirect direct;    /* the present factor, borrowed from: */
  PetscInt now, n_kept; /* now: which one */
  struct {
    HycoDirect direct;
    PetscReal *theta; /* NULL: not factored */
  } * kept;
  PetscReal bytes; /* of one */
  PetscInt n_records;
  HycoBodyRecord *record;
  PetscInt *sample; /* the records of its samples */
} HycoBodyFactor;

/* The factors of K, body by body, at a point of theta. Every rank. */
typedef struct {
  HycoFOM fom;
  PetscInt n, *owner; /* bodies; by node of this rank: its body */
  HycoBodyFactor *body;
  PetscReal *theta;     /* present, and of the nodes */
  PetscReal *between;   /* the last that was condensed to judge the samples */
  PetscBool assembled;  /* K is there, too */
  PetscInt n_condensed; /* points */
  PetscInt *pins;       /* of the first factor */
  PetscInt n_basis;
  Vec *basis; /* of the turned loads, orthonormal */
  PetscInt n_strains;
  Vec *strain;            /* K^-1 times the modes of the inelastic forces */
  PetscReal *score;       /* by cell of the part */
  PetscReal *moved;       /* by unknown of the part: largest sampled displacement */
  PetscBool *known;       /* by unknown of the part: on the surfaces; */
  PetscBool *bare;        /* the same: no mode has it, because the model's mesh does */
  PetscBool *in_mesh;     /* ns: the model's mesh has its node, whatever its cells */
  PetscInt *row;          /* of the unknowns inside in the distributed vectors */
  unsigned long long key; /* the common part of the keys of finished pieces */
} HycoBodiesFactor;

/* Whether the model has modes of inelastic forces: with a history, where a law is not linear. */
static inline PetscBool HycoBodiesFlow(HycoReducer t)
{
  return (PetscBool)(t->scene->n_times && HycoSceneFlows(t->scene));
}
PetscErrorCode HycoBodiesBegin(HycoReducer reducer);
PetscErrorCode HycoBodiesModes(HycoReducer reducer, HycoSnapshots store);
/* Operations of the training, after HycoBodiesBegin(); whether a search tries the type. */
PetscReal HycoBodiesOperations(HycoReducer reducer);
PetscBool HycoBodiesOffers(HycoReducer reducer, PetscBool targets, size_t length, char why[]);
/* The bodies' blocks, from the matrix N of the unknowns of all surfaces, whose columns are those of K. Collective. */
PetscErrorCode HycoBodiesSplit(HycoReducer reducer, Mat N, HycoBodiesFactor *factor);
/* Frees everything in it. Collective. */
PetscErrorCode HycoBodiesReleaseFactor(HycoBodiesFactor *factor);
/* Nodes and factors at theta; only bodies that theta changes are factored. Collective. */
PetscErrorCode HycoBodiesRefactor(HycoReducer reducer, HycoBodiesFactor *factor, const PetscReal theta[]);
/* Nodes at theta, without factors. Collective. */
PetscErrorCode HycoBodiesMoveTo(HycoReducer reducer, HycoBodiesFactor *factor, const PetscReal theta[]);
/* Keys of pieces that an interrupted training finds again (HycoSnapshotsFindPiece()): their common part, after
   HycoBodiesLoads() (collective); of `what` of body k (-1: all) at theta. */
PetscErrorCode HycoBodiesBeginKeys(HycoReducer reducer, HycoBodiesFactor *factor);
unsigned long long HycoBodiesKey(HycoSubstructures bodies, const HycoBodiesFactor *factor, const char what[],
                                 PetscInt k, const PetscReal theta[]);
/* record[n]: of each body its record at theta, condensed if there is none. Collective. */
PetscErrorCode HycoBodiesCondense(HycoReducer reducer, HycoBodiesFactor *factor, const PetscReal theta[],
                                  PetscInt record[]);
/* The basis of the loads and the cells by which they are evaluated. Collective. */
PetscErrorCode HycoBodiesLoads(HycoReducer reducer, HycoBodiesFactor *factor);
/* The values of theta and the bodies' samples there. Collective. */
PetscErrorCode HycoBodiesSample(HycoReducer reducer, HycoBodiesFactor *factor);
/* The table of the rigid motions, if the shape of a body that contact alone holds changes; after the samples.
   Collective. */
PetscErrorCode HycoBodiesTakeMotions(HycoReducer reducer, HycoBodiesFactor *factor);
/* Raises factor->score by the stresses of the displacements u (n_dof of the part, without prescribed ones) relative to
   the largest in their body. Collective. */
PetscErrorCode HycoBodiesAddScores(HycoReducer reducer, HycoBodiesFactor *factor, const PetscReal u[]);
/* The cells whose displacements are exact: t->seeds_cell, the unknowns inside, factor->known and row. Collective. */
PetscErrorCode HycoBodiesChooseCells(HycoReducer reducer, HycoBodiesFactor *factor);
/* The modes, as t->V, and H, a, g. Collective. */
PetscErrorCode HycoBodiesFields(HycoReducer reducer, HycoSnapshots store, HycoBodiesFactor *factor);
/* For n loads F: the displacements of the surfaces without contact (ns x n), and the work on the motions (p x n).
   Bodies without load are not solved. Collective. */
PetscErrorCode HycoBodiesReduce(HycoSubstructures bodies, HycoBodiesFactor *factor, PetscInt n, const Vec F[],
                                PetscReal u[], PetscReal work[]);
/* x = K^-1 F for n loads, with given motions and forces of the contacts z ((p + ns) x n; read on rank 0; NULL: 0).
   Collective. */
PetscErrorCode HycoBodiesExtend(HycoSubstructures bodies, HycoBodiesFactor *factor, PetscInt n, const Vec F[],
                                const PetscReal z[], Vec x[]);
/* Before the factor: modes of inelastic forces. After the samples: the cells of the model, and what the modes displace.
   Collective. */
PetscErrorCode HycoBodiesStrainModes(HycoReducer reducer, HycoSnapshots store);
PetscErrorCode HycoBodiesStrains(HycoReducer reducer, HycoBodiesFactor *factor);
/* Refuses scenes with a history that the model does not represent. Collective. */
PetscErrorCode HycoBodiesCheckPath(HycoReducer reducer);
/* theta of node k of the grid of all values, exactly as it was condensed. */
void HycoBodiesPoint(HycoReducer reducer, PetscInt k, PetscReal theta[]);
/* Which sample of a body node k of the grid of all values is, -1: none. */
PetscInt HycoBodiesSampleOf(HycoSubstructures bodies, PetscInt body, PetscInt k);

#endif
