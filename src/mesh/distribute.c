/* The mesh over the ranks: DMPlexDistribute() with this library's partitioner, and the tags sent after it. */
#include "plex.h"

PetscErrorCode HycoPlexSendTags(DM from, PetscSF sf, DM to)
{
  PetscInt first, last, *tag;
  const PetscInt *sent;
  IS tags;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)from, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(DMPlexGetChart(to, &first, &last));
  PetscCall(PetscCalloc1(last, &tag));
  PetscCall(ISGetIndices(tags, &sent));
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, sent, tag, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, sent, tag, MPI_REPLACE));
  PetscCall(ISRestoreIndices(tags, &sent));
  PetscCall(HycoPlexSetTags(to, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts what a distribution made (NULL: nothing) in a DM's place. */
static PetscErrorCode Replace(DM *dm, PetscSF sf, DM by)
{
  PetscFunctionBegin;
  if (!by) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPlexSendTags(*dm, sf, by));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(DMDestroy(dm));
  *dm = by;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshDistribute(DM *dm, HycoScene scene, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner by)
{
  PetscPartitioner partitioner;
  PetscSF sf;
  DM next;

  PetscFunctionBegin;
  PetscCall(DMPlexGetPartitioner(*dm, &partitioner));
  PetscCall(HycoPartitionerSetMesh(partitioner, whole, n_pairs, pairs, by));
  PetscCall(DMPlexDistribute(*dm, 0, &sf, &next));
  PetscCall(Replace(dm, sf, next));
  PetscCall(HycoPlexRefine(dm, scene, scene->refine));
  PetscCall(DMSetBasicAdjacency(*dm, PETSC_FALSE, PETSC_TRUE)); /* cells that share a vertex are neighbours */
  PetscCall(DMPlexDistributeOverlap(*dm, 1, &sf, &next));
  PetscCall(Replace(dm, sf, next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshLoad(MPI_Comm comm, HycoScene scene, DM *dm)
{
  HycoMesh mesh = NULL;

  PetscFunctionBegin;
  HycoOnRoot(comm, HycoMeshRead(scene, &mesh));
  PetscCall(HycoPlexFromMesh(comm, mesh, dm));
  if (mesh) PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshCreateWhole(MPI_Comm comm, HycoScene scene, HycoMesh *whole)
{
  PetscMPIInt size;
  PetscInt n_owned, first, *global;
  HycoMesh part;
  DM dm;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(HycoMeshLoad(comm, scene, &dm));
  PetscCall(HycoPlexRefine(&dm, scene, scene->refine));
  PetscCall(HycoPlexToMesh(dm, scene, &part, &n_owned, &first));
  PetscCall(DMDestroy(&dm));
  *whole = part;
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshGather(comm, part, n_owned, first, NULL, whole, &global));
  PetscCall(PetscFree(global));
  PetscCall(HycoMeshDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}
