/* Models whose surfaces move past each other: private to the export. */
#ifndef HYCOTRAVEL_H
#define HYCOTRAVEL_H

#include <hycobodies.h>
#include "../../src/contact/master_search.h"
#include "export.h"

/* The problem of a model of bodies before its contacts: z are the rigid motions (p) and the forces at the places of the
   surfaces, w the loads' work on the motions and the displacements of the places, with the opposite sign. Beside it
   values that are functions of the parameters: the flexibility of each body over its first one, prescribed
   displacements, turns. */
typedef enum { FLEXIBLE, HELD, TURN } TravelFrom;
typedef struct {
  TravelFrom from;
  PetscInt index, part; /* body or unknown; term of the flexibility, entry of Q */
} TravelValue;
typedef struct {
  HycoROM m;
  HycoBodiesWork bodies; /* the model's */
  TravelValue *value;
  PetscInt n_values, *node; /* node: by node of the program, of the model's mesh */
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool placed; /* the model is at mu */
} * HycoTravel;
/* After a prediction. *travel NULL: no surface of the model moves. Fails with what cannot be exported. Adds the
   surfaces to out, which owns them. */
PetscErrorCode HycoTravelCreate(HycoROM m, HycoExportModel *out, HycoTravel *travel);
PetscErrorCode HycoTravelDestroy(HycoTravel *travel);
/* The weights of the samples of a model of bodies, between which those that change their shape or the ratio of their
   moduli are interpolated, as expressions in the scene's parameters; each once. The caller frees the texts and the
   array. */
PetscErrorCode HycoExportWeights(HycoROM m, PetscInt *n, char ***text);
/* z at the last prediction. */
void HycoTravelUnknowns(HycoTravel travel, PetscReal z[]);
/* w of z at mu, where HycoROMOps.expand then has the fields of z. */
PetscErrorCode HycoTravelResidual(HycoTravel travel, const PetscReal mu[], const PetscReal z[], PetscReal w[]);
/* The rigid motions at mu: places x p. */
PetscErrorCode HycoTravelMotions(HycoTravel travel, const PetscReal mu[], PetscReal Z[]);
/* Value i at the last mu. */
PetscReal HycoTravelValue(HycoTravel travel, PetscInt i);
/* The body that has a body of the scene, if it turns; -1: none. */
PetscInt HycoTravelBody(HycoTravel travel, PetscInt body);
/* The flexibilities, of which the program has the values from `first` on; how many numbers they have. */
PetscErrorCode HycoTravelBlocks(HycoTravel travel, PetscInt first, HycoExportModel *out);
PetscReal HycoTravelNumbers(HycoTravel travel);

#endif
