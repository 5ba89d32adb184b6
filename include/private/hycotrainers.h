/* The training of the library's own types of reduced model, each in src/offline/impls. */
#ifndef HYCOTRAINERS_H
#define HYCOTRAINERS_H

#include <hycotrainer.h>

PetscErrorCode HycoTrainerCreate_Hybrid(HycoTrainerOps *ops);
PetscErrorCode HycoTrainerCreate_Projection(HycoTrainerOps *ops);
PetscErrorCode HycoTrainerCreate_Bodies(HycoTrainerOps *ops);

#endif
