/* Assembly with known positions of entries: private to fe/. */
#ifndef HYCO_PLACES_H
#define HYCO_PLACES_H
#include <hycofe.h>

/* Assembles the stiffness into K if K is sequential and assembled, with the pattern of this mesh; *done: it was. */
PetscErrorCode HycoAssemblyMapAssemble(HycoFE fe, Mat K, PetscBool *done);
/* NULL-safe. */
PetscErrorCode HycoAssemblyMapDestroy(HycoAssemblyMap *places);

#endif
