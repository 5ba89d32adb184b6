/* Distributes the mesh over the ranks: DMPlexDistribute() with this library's partitioner; the tags are sent along. */
#include "plex.h"
#include <string.h>

/* Broadcasts the tags (IS of this process, by point) along the migration star forest of points, because
   DMPlexDistribute() sends labels and coordinates but no composed object. Collective. */
PetscErrorCode HycoPlexSendTags(DM from, PetscSF sf, DM to)
{
  PetscInt first, last, *tag;
  const PetscInt *sent;
  IS tags;

  PetscFunctionBegin;
  /* Point p of the chart is entry p of the IS: charts of this library start at 0. */
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
static PetscErrorCode DistributeReplace(DM *dm, PetscSF sf, DM by)
{
  HycoTies ties;

  PetscFunctionBegin;
  if (!by) PetscFunctionReturn(PETSC_SUCCESS);
  /* Ties are known by tags on every rank, so that the new DM shares the list; tags need the star forest, before it
     is destroyed. */
  PetscCall(HycoTiesOf(*dm, &ties));
  PetscCall(HycoTiesAttach(by, ties));
  PetscCall(HycoPlexSendTags(*dm, sf, by));
  HycoDestroyAll(&sf, dm);
  *dm = by;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whole mesh on rank 0 -> a part of each rank, refined, then with one layer of overlap: every cell around an owned
   node is local, so that each rank assembles its rows of K and B without communication. Refinement comes before
   the overlap, which is one layer of refined cells. Replaces *dm. Collective. */
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
    /* Without overlap: it follows below, once the cells are refined. */
    PetscCall(HycoPartitionerSetMesh(partitioner, whole, n_pairs, pairs, by));
    PetscCall(DMPlexDistribute(*dm, 0, &sf, &next));
    PetscCall(DistributeReplace(dm, sf, next));
  }
  PetscCall(HycoPlexRefine(dm, scene, scene->refine));
  HycoCheck(!overlap || !write[0],
            "hyco_mesh_write: the DM has an overlap, and would have cells twice; write it before the overlap is added");
  if (overlap) PetscFunctionReturn(PETSC_SUCCESS);
  /* The file would have no ties, but the cones of tied cells with the masters at their end. */
  HycoCheck(!write[0] || !scene->n_ties, "hyco_mesh_write: a mesh with ties (%s) cannot be written as a DMPlex",
            scene->tie[0].name);
  /* Written before the overlap is added: the file has each cell once. */
  if (write[0]) {
    PetscCall(HycoPlexType(*dm, &type, &mixed));
    HycoCheck(!HycoCellKinds[PetscMax(type, 0)].quadratic,
              "hyco_mesh_write: a mesh of %s cannot be written as a DMPlex; keep its gmsh file",
              HycoCellKinds[PetscMax(type, 0)].name);
    PetscCall(HycoPlexWrite(*dm, write));
  }
  PetscCall(DMSetBasicAdjacency(*dm, PETSC_FALSE, PETSC_TRUE)); /* cells that share a vertex are neighbours */
  PetscCall(DMPlexDistributeOverlap(*dm, 1, &sf, &next));
  PetscCall(DistributeReplace(dm, sf, next));
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
  /* Only cells and vertices have tags; the tags of edges and faces stay 0, which no order depends on. */
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

/* For a DM that another program made: adds tags, requires faces and edges as points (a facet of a group must be one),
   and completes the labels, so that a group of facets contains its nodes. Collective. Tags order nodes and cells on any
   number of ranks, which DMPlex's own numbers do not. */
PetscErrorCode HycoPlexComplete(DM dm)
{
  PetscInt n, dim, depth;
  PetscObject tags;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, &tags));
  if (tags) PetscFunctionReturn(PETSC_SUCCESS); /* written by hyco, thus complete */
  PetscCall(NumberPoints(dm));
  PetscCall(DMGetDimension(dm, &dim));
  PetscCall(DMPlexGetDepth(dm, &depth));
  /* A rank without cells has depth -1 or 0, thus the maximum. */
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
