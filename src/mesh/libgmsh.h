/*
  gmsh's library, loaded when a mesh is read: it brings a hundred libraries of its own (OpenCASCADE, FLTK, X11), which a
  run on a model alone need not wait for. The calls keep gmsh's names and arguments.
*/
#ifndef LIBGMSH_H
#define LIBGMSH_H

#include <gmshc.h>
#include <hycocompat.h>

#define HYCO_GMSH_CALLS(CALL)                                                                                          \
  CALL(gmshInitialize)                                                                                                 \
  CALL(gmshFinalize)                                                                                                   \
  CALL(gmshOpen)                                                                                                       \
  CALL(gmshOptionSetNumber)                                                                                            \
  CALL(gmshFree)                                                                                                       \
  CALL(gmshLoggerGetLastError)                                                                                         \
  CALL(gmshModelGetPhysicalGroups)                                                                                     \
  CALL(gmshModelGetPhysicalName)                                                                                       \
  CALL(gmshModelGetEntitiesForPhysicalGroup)                                                                           \
  CALL(gmshModelMeshGetElements)                                                                                       \
  CALL(gmshModelMeshGetNodes)

typedef struct {
#define HYCO_GMSH_DECLARE(name) __typeof__(name) *name;
  HYCO_GMSH_CALLS(HYCO_GMSH_DECLARE)
#undef HYCO_GMSH_DECLARE
} HycoGmsh;

/* The calls, the same at each time; fails where the library is not there. Not collective. */
PetscErrorCode HycoGmshLoad(const HycoGmsh **calls);

#endif
