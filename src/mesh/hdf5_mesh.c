/*
  Reads and writes meshes in PETSc's HDF5 format of a DMPlex, with all processes. The tags of a mesh that was read from
  another file are stored too, in the order of the file's points.
*/
#include "plex.h"
#include <hdf5.h>
#include <petscviewerhdf5.h>
#include <stdio.h>
#include <string.h>

#define TOPOLOGY "mesh" /* the name under which hyco writes */

/* The tags in the order of the points' global numbers, which run by depth. So that tags written beside the topology
   belong to its points in the file. */
static PetscErrorCode OrderTags(DM dm, IS *ordered)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)dm);
  PetscInt n = 0, all, first, last, *leaf, *to, *root;
  const PetscInt *tag, *number;
  PetscLayout layout;
  PetscSF sf;
  IS tags, numbers;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(DMPlexCreatePointNumbering(dm, &numbers));
  /* Global numbers: -1 - number where another rank owns the point, so that each is sent by its owner alone. */
  PetscCall(DMPlexGetChart(dm, &first, &last));
  PetscCall(PetscMalloc2(last - first, &leaf, last - first, &to));
  PetscCall(ISGetIndices(tags, &tag));
  PetscCall(ISGetIndices(numbers, &number));
  for (PetscInt p = 0; p < last - first; p++) {
    if (number[p] < 0) continue; /* owned by another process */
    leaf[n] = p;
    to[n++] = number[p];
  }
  PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, comm));
  /* The layout of the file's points, which ISView() writes in order; no rank has more than its block. */
  PetscCall(PetscLayoutCreateFromSizes(comm, PETSC_DECIDE, all, 1, &layout));
  PetscCall(PetscSFCreate(comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, n, leaf, PETSC_COPY_VALUES, to));
  PetscCall(PetscLayoutGetLocalSize(layout, &n));
  PetscCall(PetscMalloc1(n, &root));
  PetscCall(HycoSFSend(sf, MPIU_INT, 1, tag, root));
  PetscCall(ISRestoreIndices(numbers, &number));
  PetscCall(ISRestoreIndices(tags, &tag));
  PetscCall(ISCreateGeneral(comm, n, root, PETSC_OWN_POINTER, ordered));
  PetscCall(PetscObjectSetName((PetscObject)*ordered, HYCO_TAGS));
  PetscCall(PetscFree2(leaf, to));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(ISDestroy(&numbers));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Topology, labels, coordinates and tags, with all processes: nothing is gathered. Collective. */
PetscErrorCode HycoPlexWrite(DM dm, const char path[])
{
  PetscViewer viewer;
  IS tags;

  PetscFunctionBegin;
  PetscCall(OrderTags(dm, &tags));
  /* The viewer takes the group's name from the object; FindTopology() finds any name. */
  PetscCall(PetscObjectSetName((PetscObject)dm, TOPOLOGY));
  PetscCall(PetscViewerHDF5Open(PetscObjectComm((PetscObject)dm), path, FILE_MODE_WRITE, &viewer));
  PetscCall(PetscViewerPushFormat(viewer, PETSC_VIEWER_HDF5_PETSC));
  PetscCall(DMPlexTopologyView(dm, viewer));
  PetscCall(DMPlexLabelsView(dm, viewer));
  PetscCall(DMPlexCoordinatesView(dm, viewer));
  PetscCall(ISView(tags, viewer));
  PetscCall(ISDestroy(&tags));
  PetscCall(PetscViewerPopFormat(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the file has a DMPlex, and the name of its topology: the first one in the file; the first version of the
   format has no name. One process. */
static PetscErrorCode FindTopology(const char path[], size_t room, char name[])
{
  FILE *file = fopen(path, "rb");
  hid_t h, group;
  ssize_t length = -1;

  PetscFunctionBegin;
  HycoCheckFile(file, "the mesh %s cannot be opened", path);
  fclose(file);
  /* HDF5 would print its stack of errors for a file of another kind; the failure is reported by one line below. */
  H5E_BEGIN_TRY
  {
    h = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    group = h < 0 ? -1 : H5Gopen2(h, "/topologies", H5P_DEFAULT);
    if (group >= 0) length = H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, 0, name, room, H5P_DEFAULT);
    if (group >= 0) H5Gclose(group);
    if (group < 0 && h >= 0 && H5Lexists(h, "topology", H5P_DEFAULT) > 0) length = snprintf(name, room, "%s", TOPOLOGY);
    if (h >= 0) H5Fclose(h);
  }
  H5E_END_TRY
  HycoCheck(length > 0, "%s contains no mesh in PETSc's format (DMPlex, PETSC_VIEWER_HDF5_PETSC)", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the tags written by HycoPlexWrite(), along the star forest from the file's points to the DM's. */
static PetscErrorCode LoadTags(DM dm, PetscViewer viewer, PetscSF from_file)
{
  PetscInt n, last, *tag;
  const PetscInt *sent;
  PetscBool has;
  IS tags;

  PetscFunctionBegin;
  PetscCall(PetscViewerHDF5HasDataset(viewer, HYCO_TAGS, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  /* n: this rank's block of the file's points, the roots. */
  PetscCall(PetscSFGetGraph(from_file, &n, NULL, NULL, NULL));
  PetscCall(ISCreate(PetscObjectComm((PetscObject)dm), &tags));
  PetscCall(ISSetType(tags, ISGENERAL));
  PetscCall(PetscObjectSetName((PetscObject)tags, HYCO_TAGS));
  /* A loaded IS would get PETSC_DECIDE's layout, which differs from that of the file's points. */
  {
    PetscLayout layout;

    PetscCall(ISGetLayout(tags, &layout));
    PetscCall(PetscLayoutSetLocalSize(layout, n));
  }
  PetscCall(ISLoad(tags, viewer));
  PetscCall(DMPlexGetChart(dm, NULL, &last));
  PetscCall(PetscCalloc1(last, &tag));
  PetscCall(ISGetIndices(tags, &sent));
  PetscCall(HycoSFBcast(from_file, MPIU_INT, 1, sent, tag));
  PetscCall(ISRestoreIndices(tags, &sent));
  PetscCall(ISDestroy(&tags));
  PetscCall(HycoPlexSetTags(dm, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The topology arrives on rank 0 (PETSc 3.18), and is distributed later. The file is checked on rank 0 first,
   because a failing open on one rank leaves the others waiting. Collective. */
PetscErrorCode HycoPlexRead(MPI_Comm comm, const char path[], DM *dm)
{
  char name[HYCO_LINE] = "";
  PetscViewer viewer;
  PetscSF from_file;

  PetscFunctionBegin;
  HycoOnRoot(comm, FindTopology(path, sizeof(name), name));
  PetscCallMPI(MPI_Bcast(name, sizeof(name), MPI_CHAR, 0, comm));
  PetscCall(DMCreate(comm, dm));
  PetscCall(DMSetType(*dm, DMPLEX));
  PetscCall(PetscObjectSetName((PetscObject)*dm, name));
  PetscCall(PetscViewerHDF5Open(comm, path, FILE_MODE_READ, &viewer));
  PetscCall(PetscViewerPushFormat(viewer, PETSC_VIEWER_HDF5_PETSC));
  PetscCall(DMPlexTopologyLoad(*dm, viewer, &from_file));
  PetscCall(DMPlexLabelsLoad(*dm, viewer, from_file));
  PetscCall(DMPlexCoordinatesLoad(*dm, viewer, from_file));
  /* Tags in outputs are those of the file, whatever order PETSc gives the points. */
  PetscCall(LoadTags(*dm, viewer, from_file));
  PetscCall(PetscSFDestroy(&from_file));
  PetscCall(PetscViewerPopFormat(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
