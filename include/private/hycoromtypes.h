/* The library's own types of reduced model, each in src/rom/impls. */
#ifndef HYCOROMTYPES_H
#define HYCOROMTYPES_H

#include <hycoromtype.h>

PetscErrorCode HycoROMCreate_Hybrid(HycoROM model);
PetscErrorCode HycoROMCreate_Projection(HycoROM model);
PetscErrorCode HycoROMCreate_Bodies(HycoROM model);

#endif
