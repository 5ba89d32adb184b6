/* Models whose surfaces move past each other: private to the export. */
#ifndef HYCOTRAVEL_H
#define HYCOTRAVEL_H

#include "../../src/contact/master_search.h"
#include "export.h"

/* The problem of a model of bodies before its contacts: z are the rigid motions (p) and the forces at the places of the
   surfaces, w the loads' work on the motions and the displacements of the places, with the opposite sign. Beside it values
   that are functions of the parameters: the flexibility of each body over its first one, prescribed displacements, turns. */
typedef struct _n_HycoTravel *HycoTravel;
/* After a prediction. *travel NULL: no surface of the model moves. Fails with what cannot be exported. Adds the surfaces to
   out, which owns them. */
PetscErrorCode HycoTravelCreate(HycoROM m, HycoExportModel *out, HycoTravel *travel);
PetscErrorCode HycoTravelDestroy(HycoTravel *travel);
PetscInt HycoTravelPlaces(HycoTravel travel);
/* The bodies; that of a place. */
PetscInt HycoTravelBodies(HycoTravel travel);
PetscInt HycoTravelAt(HycoTravel travel, PetscInt place);
/* z at the last prediction. */
void HycoTravelUnknowns(HycoTravel travel, PetscReal z[]);
/* w of z at mu, where HycoROMOps.expand then has the fields of z. */
PetscErrorCode HycoTravelResidual(HycoTravel travel, const PetscReal mu[], const PetscReal z[], PetscReal w[]);
/* The rigid motions at mu: places x p. */
PetscErrorCode HycoTravelMotions(HycoTravel travel, const PetscReal mu[], PetscReal Z[]);
/* How many values there are; value i at the last mu; the values of a group have one scale. */
PetscInt HycoTravelValues(HycoTravel travel);
PetscReal HycoTravelValue(HycoTravel travel, PetscInt i);
PetscInt HycoTravelGroup(HycoTravel travel, PetscInt i);
/* Whether a value is of the flexibility of body k. */
PetscBool HycoTravelIsFlexible(HycoTravel travel, PetscInt i, PetscInt k);
/* The body that has a body of the scene, if it turns; -1: none. Its turn Q at the last mu. */
PetscInt HycoTravelBody(HycoTravel travel, PetscInt body);
const PetscReal *HycoTravelTurn(HycoTravel travel, PetscInt k);
/* The program's number of the first value is known: sets those in out->surfaces. */
void HycoTravelStart(HycoTravel travel, PetscInt first, HycoExportModel *out);
/* The flexibilities, out->block, and how many numbers they have. */
PetscErrorCode HycoTravelBlocks(HycoTravel travel, PetscInt first, HycoExportModel *out);
PetscReal HycoTravelNumbers(HycoTravel travel);
/* X (3 a node) of out->surfaces at mu, by the parser that writes the program. */
PetscErrorCode HycoTravelPositions(const HycoExportModel *out, HycoScene scene, const PetscReal mu[], PetscReal X[]);

#endif
