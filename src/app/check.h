/* hyco check: what its pages share. */
#ifndef HYCO_CHECK_H
#define HYCO_CHECK_H
#include "driver.h"
#include <hycofomimpl.h>

/* One contact of the scene over the points that were checked. */
typedef struct {
  PetscInt n, facing_min, facing_max; /* contacts; those that may close, where they are fewest and most */
  PetscReal gap_min, gap_max;         /* of those that may close; max < min: none anywhere */
  PetscReal coarse; /* of most contacts: the slave's facets over the master's there; 0: not compared */
} ContactRange;

/* What was found; on rank 0, but for the first line. */
typedef struct {
  HycoFOM fom;   /* borrowed */
  HycoFOM whole; /* rank 0: on it alone, for what is looked at; fom on one rank */
  PetscInt n_points;
  cJSON *json, *warnings; /* the report, and its array "warnings" */
  ContactRange *contact;  /* by contact of the scene */
  PetscReal *stretch;     /* by body: of its most stretched cell, anywhere */
  PetscInt *stretched;    /* tag of that cell */
  PetscInt n_without;     /* contacts between fixed unknowns, where they are most */
} Check;

/* A warning: into the report; printed at the end. On rank 0. */
void CheckWarn(Check *check, const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

typedef struct {
  PetscBool solved;             /* measured by a solve at the centre, else estimated */
  PetscReal bytes, resident;    /* of a factor; of the process as it is, all ranks */
  PetscReal first, next;        /* seconds: a solve with a new stiffness, with that of the last */
  PetscInt n_training, n_stiff; /* solutions of a training, held-out ones included; stiffnesses among them */
} Cost;

/* -- check_mesh.c, on rank 0 -- */

/* Cells at fe's nodes: the most stretched of each body. */
void CheckCells(Check *check, HycoFE fe);
/* Bodies in several parts, and what is said of each; groups. */
PetscErrorCode CheckBodies(Check *check);
PetscErrorCode CheckGroups(Check *check);

/* -- check_contact.c, on rank 0 -- */

/* Gaps at fe's parameters; *first: facets of slave and master are compared, too. */
PetscErrorCode CheckGaps(Check *check, HycoFE fe, PetscBool first);
/* What the ranges of gaps say. */
void CheckContacts(Check *check);

/* -- check_cost.c; collective -- */

/* Of the system as it is assembled, which took `assembly` seconds: the factor's memory by MUMPS's analysis of the
   stiffness with the contacts, seconds by its count of operations. */
PetscErrorCode CheckEstimate(Check *check, PetscReal assembly, Cost *cost);
/* Seconds by a solve at mu; fails where that does not converge. */
PetscErrorCode CheckSolve(Check *check, const PetscReal mu[], Cost *cost);
/* The training's solutions and the stiffnesses among them: those of the points that are given, or a typical number. */
PetscErrorCode CheckCountTraining(HycoScene scene, HycoSamples samples, PetscBool given, Cost *cost);
PetscErrorCode CheckSayCost(Check *check, const Cost *cost, PetscBool given);

#endif
