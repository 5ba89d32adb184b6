/*
  Extensions: folders of extensions/ that register further types. CMake's HYCO_EXTENSIONS names those that are built,
  and writes the file that calls them.
*/
#ifndef HYCOEXTENSIONS_H
#define HYCOEXTENSIONS_H

#include <hycoimpl.h>

/* Registers the types of all extensions that are built. */
PetscErrorCode HycoExtensionsRegister(void);

/* Defines what an extension, named as its folder, does at the start: one PETSc call. */
#define HycoDefineExtension(name, call)                                                                                \
  PetscErrorCode HycoExtension_##name(void);                                                                           \
  PetscErrorCode HycoExtension_##name(void)                                                                            \
  {                                                                                                                    \
    PetscFunctionBegin;                                                                                                \
    PetscCall(call);                                                                                                   \
    PetscFunctionReturn(PETSC_SUCCESS);                                                                                \
  }

#endif
