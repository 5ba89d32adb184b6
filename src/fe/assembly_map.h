/* Assembly by known places: private to fe/. */
#ifndef HYCO_PLACES_H
#define HYCO_PLACES_H
#include <hycofe.h>

/* The stiffness into K, if K is sequential and assembled, with the pattern that this mesh gives it; *done says so. */
PetscErrorCode HycoAssemblyMapAssemble(HycoFE fe, Mat K, PetscBool *done);
/* NULL-safe. */
PetscErrorCode HycoAssemblyMapDestroy(HycoAssemblyMap *places);

#endif
