/* hyco check: common declarations. */
#ifndef HYCO_CHECK_H
#define HYCO_CHECK_H
#include "driver.h"
#include <hycoinspect.h>

/* The report, on rank 0 except for `json`, which all ranks create. */
typedef struct {
  HycoScene scene; /* borrowed */
  HycoInspection in;
  cJSON *json, *warnings; /* the report, and its array "warnings" */
} Check;

/* Adds a warning to the report; it is printed at the end. */
void CheckReportWarning(Check *check, const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

/* -- check_mesh.c, check_contact.c: text and report, on rank 0 -- */

PetscErrorCode CheckReportMesh(Check *check);
PetscErrorCode CheckReportBodies(Check *check);
PetscErrorCode CheckReportGroups(Check *check);
PetscErrorCode CheckReportContacts(Check *check);
PetscErrorCode CheckReportTies(Check *check);
PetscErrorCode CheckReportMotions(Check *check);
void CheckReportLoads(Check *check);

/* -- check_cost.c -- */

/* Seconds from a solve at the centre of the ranges, in place of the estimates; fails if it does not converge.
   Collective. */
PetscErrorCode CheckReportSolve(Check *check, HycoFOM fom);
/* Of a solve, and of a training on these samples (NULL: on a typical number); solved: measured. */
PetscErrorCode CheckReportCost(Check *check, HycoSamples samples, PetscBool solved);

#endif
