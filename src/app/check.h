/* hyco check: common declarations. */
#ifndef HYCO_CHECK_H
#define HYCO_CHECK_H
#include "driver.h"
#include <hycofomimpl.h>

/* One contact of the scene over the points that were checked. */
typedef struct {
  PetscInt n, facing_min, facing_max; /* number of contacts; of those that may close, the smallest and largest number */
  PetscReal gap_min, gap_max;         /* gaps of those that may close; max < min: no contact may close */
  PetscInt
      between; /* those whose masters are between nodes, as where meshes do not match, unless their type is for this */
  PetscReal coarse; /* slave's facet size over the master's there, where most contacts may close; 0: not compared */
} ContactRange;

/* Results; on rank 0, except for the first member. */
typedef struct {
  HycoFOM fom;   /* borrowed */
  HycoFOM whole; /* rank 0: the whole model on this rank, for inspection; fom on one rank */
  PetscInt n_points;
  cJSON *json, *warnings; /* the report, and its array "warnings" */
  ContactRange *contact;  /* by contact of the scene */
  PetscReal *stretch;     /* by body: the largest stretch of a cell */
  PetscInt *stretched;    /* tag of that cell */
  PetscInt n_without;     /* largest number of contacts between fixed unknowns */
} Check;

/* Adds a warning to the report; it is printed at the end. On rank 0. */
void CheckReportWarning(Check *check, const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

typedef struct {
  PetscBool solved;             /* measured by a solve at the centre, else estimated */
  PetscReal bytes, resident;    /* memory of a factor; of the processes now, all ranks */
  PetscReal first, next;        /* seconds of a solve with a new stiffness, with the last one */
  PetscInt n_training, n_stiff; /* solutions of a training, held-out ones included; number of different stiffnesses
                                   among them */
} Cost;

/* -- check_mesh.c, on rank 0 -- */

/* Finds the most stretched cell of each body at fe's nodes. */
void CheckReportCells(Check *check, HycoFE fe);
/* Reports bodies that consist of several parts, the description of each body; groups. */
PetscErrorCode CheckReportBodies(Check *check);
PetscErrorCode CheckReportGroups(Check *check);

/* -- check_contact.c, on rank 0 -- */

/* Measures the gaps at fe's parameters; *first: also compares facets of slave and master. */
PetscErrorCode CheckReportGaps(Check *check, HycoFE fe, PetscBool first);
/* Compares the facets of a tie's slave and master, for its report. */
PetscErrorCode CheckReportTie(Check *check, PetscInt tie, cJSON *report);
/* Reports the ranges of gaps. */
void CheckReportContacts(Check *check);

/* -- check_cost.c; collective -- */

/* For the assembled system, which took `assembly` seconds: the factor's memory by MUMPS's analysis of the stiffness
   with the contacts, seconds from its count of operations. */
PetscErrorCode CheckReportEstimate(Check *check, PetscReal assembly, Cost *cost);
/* Seconds from a solve at mu; fails if it does not converge. */
PetscErrorCode CheckReportSolve(Check *check, const PetscReal mu[], Cost *cost);
/* The number of solutions of the training and of the stiffnesses among them: for the given points, or a typical
   number. */
PetscErrorCode CheckReportCountTraining(HycoScene scene, HycoSamples samples, PetscBool given, Cost *cost);
PetscErrorCode CheckReportCost(Check *check, const Cost *cost, PetscBool given);

#endif
