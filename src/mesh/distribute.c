/* Distributes the mesh over the ranks: DMPlexDistribute() with this library's partitioner; the tags are sent along. */
#include "plex.h"
#include <hycocontactimpl.h>
#include <string.h>

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
  PetscCall(HycoSFBcast(sf, MPIU_INT, 1, sent, tag));
  PetscCall(ISRestoreIndices(tags, &sent));
  PetscCall(HycoPlexSetTags(to, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces a DM by its distributed version (NULL: none). */
static PetscErrorCode Replace(DM *dm, PetscSF sf, DM by)
{
  HycoTies ties;

  PetscFunctionBegin;
  if (!by) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTiesOf(*dm, &ties));
  PetscCall(HycoTiesAttach(by, ties));
  PetscCall(HycoPlexSendTags(*dm, sf, by));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(DMDestroy(dm));
  *dm = by;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a refined mesh of which a rank has no cell: PETSc's overlap of such a mesh reads memory that is not its own
   (3.18). Collective. */
static PetscErrorCode CheckParts(DM dm)
{
  PetscInt start, end, least, all;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &start, &end));
  least = all = end - start;
  PetscCallMPI(MPI_Comm_size(HycoComm(dm), &size));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_INT, MPI_MIN, HycoComm(dm)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_INT, MPI_SUM, HycoComm(dm)));
  HycoCheck(least, "scene_refine: %d cells leave one of the %d ranks without any; use fewer ranks", (int)all,
            (int)size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshDistribute(DM *dm, HycoScene scene, HycoMesh whole, PetscInt n_pairs, const PetscInt pairs[],
                                  HycoPartitioner by, const char write[])
{
  PetscPartitioner partitioner;
  PetscBool done, mixed;
  PetscInt overlap, type;
  PetscSF sf;
  DM next;

  PetscFunctionBegin;
  PetscCall(DMPlexIsDistributed(*dm, &done));
  PetscCall(DMPlexGetOverlap(*dm, &overlap));
  HycoCheck(!overlap || !scene->refine, "scene_refine: the DM has an overlap; refine it before the overlap is added");
  if (!done) {
    PetscCall(DMPlexGetPartitioner(*dm, &partitioner));
    PetscCall(HycoPartitionerSetMesh(partitioner, whole, n_pairs, pairs, by));
    PetscCall(DMPlexDistribute(*dm, 0, &sf, &next));
    PetscCall(Replace(dm, sf, next));
  }
  if (scene->refine) PetscCall(CheckParts(*dm));
  PetscCall(HycoPlexRefine(dm, scene, scene->refine));
  if (overlap) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(!write[0] || !scene->n_ties, "hyco_mesh_write: a mesh with ties (%s) cannot be written as a DMPlex",
            scene->tie[0].name);
  if (write[0]) {
    PetscCall(HycoPlexType(*dm, &type, &mixed));
    HycoCheck(!HycoCellKinds[PetscMax(type, 0)].quadratic,
              "hyco_mesh_write: a mesh of %s cannot be written as a DMPlex; keep its gmsh file",
              HycoCellKinds[PetscMax(type, 0)].name);
    PetscCall(HycoPlexWrite(*dm, write));
  }
  PetscCall(DMSetBasicAdjacency(*dm, PETSC_FALSE, PETSC_TRUE)); /* cells that share a vertex are neighbours */
  PetscCall(DMPlexDistributeOverlap(*dm, 1, &sf, &next));
  PetscCall(Replace(dm, sf, next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates tags for a DM without them: its own numbers of cells and vertices, from 1. */
static PetscErrorCode NumberPoints(DM dm)
{
  PetscInt start[2], end[2], last, *tag;
  IS numbers[2];

  PetscFunctionBegin;
  PetscCall(DMPlexGetChart(dm, NULL, &last));
  PetscCall(PetscCalloc1(last, &tag));
  PetscCall(DMPlexGetHeightStratum(dm, 0, &start[0], &end[0]));
  PetscCall(DMPlexGetDepthStratum(dm, 0, &start[1], &end[1]));
  PetscCall(DMPlexGetCellNumbering(dm, &numbers[0]));
  PetscCall(DMPlexGetVertexNumbering(dm, &numbers[1]));
  for (PetscInt k = 0; k < 2; k++) {
    const PetscInt *number;

    PetscCall(ISGetIndices(numbers[k], &number));
    for (PetscInt p = start[k]; p < end[k]; p++) { /* -1 - number if another process owns the point */
      const PetscInt n = number[p - start[k]];

      tag[p] = 1 + (n < 0 ? -1 - n : n);
    }
    PetscCall(ISRestoreIndices(numbers[k], &number));
  }
  PetscCall(HycoPlexSetTags(dm, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For a DM that was not made from a mesh file: tags, and labels with the closure of their points on every process. */
static PetscErrorCode Complete(DM dm)
{
  PetscInt n, dim, depth;
  PetscObject tags;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, &tags));
  if (tags) PetscFunctionReturn(PETSC_SUCCESS); /* written by hyco, thus complete */
  PetscCall(NumberPoints(dm));
  PetscCall(DMGetDimension(dm, &dim));
  PetscCall(DMPlexGetDepth(dm, &depth));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &depth, 1, MPIU_INT, MPI_MAX, HycoComm(dm)));
  HycoCheck(depth == dim,
            "the DM has cells of dimension %d and points of %d depths; interpolate it (DMPlexInterpolate)", (int)dim,
            (int)depth + 1);
  PetscCall(DMGetNumLabels(dm, &n));
  for (PetscInt k = 0; k < n; k++) {
    const char *name;
    DMLabel label;

    PetscCall(DMGetLabelName(dm, k, &name));
    if (HycoPlexOwnLabel(name)) continue;
    PetscCall(DMGetLabel(dm, name, &label));
    PetscCall(DMPlexLabelComplete(dm, label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ties must be found in the mesh file, before it is refined or distributed. */
static PetscErrorCode CheckTies(HycoScene scene)
{
  size_t length;

  PetscFunctionBegin;
  if (!scene->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrlen(scene->mesh_path, &length));
  HycoCheck(!scene->dm && (length < 3 || strcmp(scene->mesh_path + length - 3, ".h5")),
            "tie %s: ties need the mesh as a gmsh file, not as a DMPlex", scene->tie[0].name);
  HycoCheck(!scene->refine, "tie %s: scene_refine cannot refine a mesh with ties; refine the file (gmsh -refine)",
            scene->tie[0].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadMesh(HycoScene scene, HycoMesh *mesh)
{
  HycoTies ties = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshRead(scene, mesh));
  if (!scene->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  ierr = HycoMeshCheckCells(*mesh);
  if (!ierr) ierr = HycoTiesFind(scene, *mesh, &ties);
  if (!ierr) ierr = HycoMeshSetTies(*mesh, ties);
  PetscCall(HycoTiesDestroy(&ties));
  if (ierr) PetscCall(HycoMeshDestroy(mesh));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshLoad(MPI_Comm comm, HycoScene scene, DM *dm)
{
  HycoMesh mesh = NULL;
  size_t length;

  PetscFunctionBegin;
  PetscCall(CheckTies(scene));
  if (scene->dm) {
    int same;

    PetscCallMPI(MPI_Comm_compare(comm, HycoComm(scene->dm), &same));
    HycoCheck(same == MPI_IDENT || same == MPI_CONGRUENT,
              "the scene's DM lives on other processes than the model; for training give -hyco_groups 1");
    PetscCall(DMClone(scene->dm, dm));
    PetscCall(Complete(*dm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscStrlen(scene->mesh_path, &length));
  if (length > 3 && strcmp(scene->mesh_path + length - 3, ".h5") == 0) {
    PetscCall(HycoPlexRead(comm, scene->mesh_path, dm));
    PetscCall(Complete(*dm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoOnRoot(comm, ReadMesh(scene, &mesh));
  PetscCall(HycoPlexFromMesh(comm, mesh, dm));
  if (mesh) PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshCreate(MPI_Comm comm, HycoScene scene, HycoMesh *mesh)
{
  DM dm;

  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(comm, scene, &dm));
  PetscCall(HycoPlexRefine(&dm, scene, scene->refine));
  PetscCall(HycoPlexToMesh(dm, scene, mesh));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
