/* The tables of any DM, which HycoFE and contacts work on: made when they are first asked for. */
#include "plex.h"

/* Not only for DMs of this library: HycoPlexComplete() adds what another program's DM lacks, and does nothing to one
   with tags. */
PetscErrorCode HycoMeshOf(DM dm, HycoScene scene, HycoMesh *mesh)
{
  PetscFunctionBegin;
  PetscCall(HycoMeshQuery(dm, mesh));
  if (*mesh) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPlexComplete(dm));
  PetscCall(HycoPlexToMesh(dm, scene, mesh));
  PetscCall(PetscObjectDereference((PetscObject)dm)); /* the caller's reference is enough */
  PetscFunctionReturn(PETSC_SUCCESS);
}
