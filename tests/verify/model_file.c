/*
  What a model's reduced mesh costs in a file, by three formats: the arrays of the model file, from which the DM is made;
  PETSc's own format of a DMPlex (topology, labels, coordinates, and the IS of tags and subpoints), from which the tables
  are made; and IS and Vec, from which both are made. Each is checked against the model. test_model_file MODEL FILE, the
  second a name for files; a line for the load of the whole model and for each: name, milliseconds (median), bytes.
*/
#include "../../src/mesh/plex.h"
#include <hycoh5.h>
#include <hycoromimpl.h>
#include <petscviewerhdf5.h>
#include <sys/stat.h>
#include <time.h>

#define TIMES 101

typedef struct {
  const char *name, *path;
  PetscErrorCode (*load)(HycoROM model, const char path[], HycoMesh *mesh);
} Way;

static PetscErrorCode Open(const char path[], PetscFileMode mode, PetscViewer *viewer)
{
  PetscFunctionBegin;
  PetscCall(PetscViewerHDF5Open(PETSC_COMM_SELF, path, mode, viewer));
  PetscCall(PetscViewerPushFormat(*viewer, PETSC_VIEWER_HDF5_PETSC));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteIS(PetscViewer viewer, const char name[], IS is)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectSetName((PetscObject)is, name));
  PetscCall(ISView(is, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteInts(PetscViewer viewer, const char name[], PetscInt n, const PetscInt values[])
{
  IS is;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, values, PETSC_USE_POINTER, &is));
  PetscCall(WriteIS(viewer, name, is));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadIS(PetscViewer viewer, const char name[], IS *is)
{
  PetscFunctionBegin;
  PetscCall(ISCreate(PETSC_COMM_SELF, is));
  PetscCall(ISSetType(*is, ISGENERAL));
  PetscCall(PetscObjectSetName((PetscObject)*is, name));
  PetscCall(ISLoad(*is, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadInts(PetscViewer viewer, const char name[], PetscInt *n, PetscInt **values)
{
  const PetscInt *read;
  IS is;

  PetscFunctionBegin;
  PetscCall(ReadIS(viewer, name, &is));
  PetscCall(ISGetLocalSize(is, n));
  PetscCall(ISGetIndices(is, &read));
  HycoDuplicate((size_t)*n, read, values);
  PetscCall(ISRestoreIndices(is, &read));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the model file's arrays -- */

static HycoH5 opened; /* the model's file: to open it, with its checksum, is a part of every way */

static PetscErrorCode LoadArrays(HycoROM model, const char path[], HycoMesh *mesh)
{
  PetscFunctionBegin;
  (void)path;
  PetscCall(HycoMeshMove(opened, "mesh", model->model->scene->n_bodies, mesh));
  PetscCall(HycoMeshCreateDM(model->model->scene, *mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- PETSc's format of a DMPlex -- */

static PetscErrorCode SavePlex(DM dm, const char path[])
{
  PetscViewer viewer;
  IS tags, points;

  PetscFunctionBegin;
  PetscCall(Open(path, FILE_MODE_WRITE, &viewer));
  PetscCall(PetscObjectSetName((PetscObject)dm, "mesh"));
  PetscCall(DMPlexTopologyView(dm, viewer));
  PetscCall(DMPlexLabelsView(dm, viewer));
  PetscCall(DMPlexCoordinatesView(dm, viewer));
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(HycoSubmeshGetPoints(dm, &points));
  PetscCall(WriteIS(viewer, "tags", tags));
  PetscCall(WriteIS(viewer, "points", points));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The types of cells are not in the file, and PETSc derives a wrong one of facets that are points: those of `of`. */
static PetscErrorCode CopyTypes(DM of, DM dm)
{
  DMLabel label, copy;

  PetscFunctionBegin;
  PetscCall(DMRemoveLabel(dm, "celltype", &label));
  PetscCall(DMLabelDestroy(&label));
  PetscCall(DMPlexGetCellTypeLabel(of, &label));
  PetscCall(DMLabelDuplicate(label, &copy));
  PetscCall(DMAddLabel(dm, copy));
  PetscCall(DMLabelDestroy(&copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Attach(HycoROM model, DM dm, PetscInt n, PetscInt tag[], PetscInt point[])
{
  HycoMesh of = model->model->mesh;

  PetscFunctionBegin;
  PetscCheck(n > 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "no points");
  PetscCall(HycoPlexSetTags(dm, tag));
  PetscCall(HycoSubmeshSetPoints(dm, n, point));
  PetscCall(HycoPlexSetType(dm, of->type, of->mixed));
  PetscCall(HycoTiesAttach(dm, of->ties));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadPlex(HycoROM model, const char path[], HycoMesh *mesh)
{
  PetscInt n, *tag, *point;
  PetscViewer viewer;
  PetscSF from_file;
  DM dm;

  PetscFunctionBegin;
  PetscCall(DMCreate(PETSC_COMM_SELF, &dm));
  PetscCall(DMSetType(dm, DMPLEX));
  PetscCall(PetscObjectSetName((PetscObject)dm, "mesh"));
  PetscCall(Open(path, FILE_MODE_READ, &viewer));
  PetscCall(DMPlexTopologyLoad(dm, viewer, &from_file));
  PetscCall(DMPlexLabelsLoad(dm, viewer, from_file));
  PetscCall(DMPlexCoordinatesLoad(dm, viewer, from_file));
  PetscCall(ReadInts(viewer, "tags", &n, &tag));
  PetscCall(ReadInts(viewer, "points", &n, &point));
  PetscCall(PetscSFDestroy(&from_file));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(CopyTypes(model->model->mesh->dm, dm));
  PetscCall(Attach(model, dm, n, tag, point));
  PetscCall(HycoPlexToMesh(dm, model->model->scene, mesh));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- IS and Vec: sizes, cones and types of the points, labels as (label, value, point) in three lists -- */

static PetscErrorCode SaveLabels(DM dm, PetscViewer viewer)
{
  PetscInt n_labels, n = 0, room = 0, *list[3];

  PetscFunctionBegin;
  PetscCall(DMGetNumLabels(dm, &n_labels));
  for (PetscInt pass = 0; pass < 2; pass++) {
    if (pass) PetscCall(PetscMalloc3(room, &list[0], room, &list[1], room, &list[2]));
    for (PetscInt l = 0; l < n_labels; l++) {
      const char *name;
      const PetscInt *value, *point;
      PetscInt n_values, n_points;
      IS values, points;
      DMLabel label;

      PetscCall(DMGetLabelName(dm, l, &name));
      if (HycoPlexOwnLabel(name)) continue;
      PetscCall(DMGetLabel(dm, name, &label));
      PetscCall(DMLabelGetValueIS(label, &values));
      PetscCall(ISGetLocalSize(values, &n_values));
      PetscCall(ISGetIndices(values, &value));
      for (PetscInt k = 0; k < n_values; k++) {
        PetscCall(DMLabelGetStratumSize(label, value[k], &n_points));
        if (!pass) room += n_points;
        if (!pass || !n_points) continue;
        PetscCall(DMLabelGetStratumIS(label, value[k], &points));
        PetscCall(ISGetIndices(points, &point));
        for (PetscInt p = 0; p < n_points; p++) {
          list[0][n] = l;
          list[1][n] = value[k];
          list[2][n++] = point[p];
        }
        PetscCall(ISRestoreIndices(points, &point));
        PetscCall(ISDestroy(&points));
      }
      PetscCall(ISRestoreIndices(values, &value));
      PetscCall(ISDestroy(&values));
    }
  }
  PetscCall(WriteInts(viewer, "label", room, list[0]));
  PetscCall(WriteInts(viewer, "value", room, list[1]));
  PetscCall(WriteInts(viewer, "labelled", room, list[2]));
  PetscCall(PetscFree3(list[0], list[1], list[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SaveObjects(DM dm, const char path[])
{
  PetscInt first, last, n = 0, *cones, *size, *type;
  PetscViewer viewer;
  IS tags, points;
  Vec x, plain;

  PetscFunctionBegin;
  PetscCall(Open(path, FILE_MODE_WRITE, &viewer));
  PetscCall(DMPlexGetChart(dm, &first, &last));
  PetscCall(DMPlexGetCones(dm, &cones));
  PetscCall(PetscMalloc2(last, &size, last, &type));
  for (PetscInt p = 0; p < last; p++) {
    DMPolytopeType of;

    PetscCall(DMPlexGetConeSize(dm, p, &size[p]));
    PetscCall(DMPlexGetCellType(dm, p, &of));
    type[p] = (PetscInt)of;
    n += size[p];
  }
  PetscCall(WriteInts(viewer, "cones", n, cones));
  PetscCall(WriteInts(viewer, "sizes", last, size));
  PetscCall(WriteInts(viewer, "types", last, type));
  PetscCall(PetscFree2(size, type));
  PetscCall(SaveLabels(dm, viewer));
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(HycoSubmeshGetPoints(dm, &points));
  PetscCall(WriteIS(viewer, "tags", tags));
  PetscCall(WriteIS(viewer, "points", points));
  PetscCall(DMGetCoordinates(dm, &x));
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n, &plain)); /* one of the DM has a view of its own */
  PetscCall(VecCopy(x, plain));
  PetscCall(PetscObjectSetName((PetscObject)plain, "coordinates"));
  PetscCall(VecView(plain, viewer));
  PetscCall(VecDestroy(&plain));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadLabels(HycoROM model, PetscViewer viewer, DM dm)
{
  PetscInt n, *label, *value, *point;

  PetscFunctionBegin;
  PetscCall(ReadInts(viewer, "label", &n, &label));
  PetscCall(ReadInts(viewer, "value", &n, &value));
  PetscCall(ReadInts(viewer, "labelled", &n, &point));
  for (PetscInt k = 0, end; k < n; k = end) {
    const char *name;
    DMLabel of;
    IS is;

    for (end = k; end < n && label[end] == label[k] && value[end] == value[k];) end++;
    PetscCall(DMGetLabelName(model->model->mesh->dm, label[k], &name));
    PetscCall(DMCreateLabel(dm, name));
    PetscCall(DMGetLabel(dm, name, &of));
    PetscCall(ISCreateGeneral(PETSC_COMM_SELF, end - k, point + k, PETSC_COPY_VALUES, &is));
    PetscCall(DMLabelSetStratumIS(of, value[k], is));
    PetscCall(ISDestroy(&is));
  }
  HycoFreeAll(&label, &value, &point);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadCones(PetscViewer viewer, DM dm)
{
  PetscInt n, n_cones, at = 0, *cones, *size, *type;
  DMLabel label;

  PetscFunctionBegin;
  PetscCall(ReadInts(viewer, "cones", &n_cones, &cones));
  PetscCall(ReadInts(viewer, "sizes", &n, &size));
  PetscCall(ReadInts(viewer, "types", &n, &type));
  PetscCall(DMPlexSetChart(dm, 0, n));
  for (PetscInt p = 0; p < n; p++) PetscCall(DMPlexSetConeSize(dm, p, size[p]));
  PetscCall(DMSetUp(dm));
  for (PetscInt p = 0; p < n; at += size[p++]) PetscCall(DMPlexSetCone(dm, p, cones + at));
  PetscCall(DMPlexSymmetrize(dm));
  PetscCall(DMPlexStratify(dm));
  PetscCall(DMCreateLabel(dm, "celltype"));
  PetscCall(DMPlexGetCellTypeLabel(dm, &label));
  for (PetscInt p = 0, end; p < n; p = end) {
    IS is;

    for (end = p; end < n && type[end] == type[p];) end++;
    PetscCall(ISCreateStride(PETSC_COMM_SELF, end - p, p, 1, &is));
    PetscCall(DMLabelSetStratumIS(label, type[p], is));
    PetscCall(ISDestroy(&is));
  }
  HycoFreeAll(&cones, &size, &type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadObjects(HycoROM model, const char path[], HycoMesh *mesh)
{
  PetscInt n, *tag, *point;
  const PetscScalar *x;
  PetscViewer viewer;
  Vec coordinates;
  DM dm;

  PetscFunctionBegin;
  PetscCall(DMPlexCreate(PETSC_COMM_SELF, &dm));
  PetscCall(DMSetDimension(dm, model->model->mesh->dim));
  PetscCall(Open(path, FILE_MODE_READ, &viewer));
  PetscCall(LoadCones(viewer, dm));
  PetscCall(VecCreate(PETSC_COMM_SELF, &coordinates));
  PetscCall(PetscObjectSetName((PetscObject)coordinates, "coordinates"));
  PetscCall(VecLoad(coordinates, viewer));
  PetscCall(VecGetArrayRead(coordinates, &x));
  PetscCall(DMPlexBuildCoordinatesFromCellList(dm, 3, x));
  PetscCall(VecRestoreArrayRead(coordinates, &x));
  PetscCall(VecDestroy(&coordinates));
  PetscCall(LoadLabels(model, viewer, dm));
  PetscCall(ReadInts(viewer, "tags", &n, &tag));
  PetscCall(ReadInts(viewer, "points", &n, &point));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(Attach(model, dm, n, tag, point));
  PetscCall(HycoPlexToMesh(dm, model->model->scene, mesh));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the measurement -- */

static PetscErrorCode Compare(HycoMesh a, HycoMesh b)
{
  PetscBool same = (PetscBool)(a->n_cells == b->n_cells && a->n_nodes == b->n_nodes && a->n_facets == b->n_facets);

  PetscFunctionBegin;
  for (PetscInt k = 0; same && k < a->n_cells * a->nv; k++) same = (PetscBool)(a->cells[k] == b->cells[k]);
  for (PetscInt k = 0; same && k < 3 * a->n_nodes; k++) same = (PetscBool)(a->xyz[k] == b->xyz[k]);
  for (PetscInt k = 0; same && k < a->n_nodes; k++) same = (PetscBool)(a->node_id[k] == b->node_id[k]);
  PetscCheck(same, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the mesh that was read is not that of the model");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Seconds of this process. */
static PetscReal Cpu(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (PetscReal)t.tv_sec + 1e-9 * (PetscReal)t.tv_nsec;
}

static PetscErrorCode Measure(HycoROM model, const Way *way)
{
  PetscReal took[TIMES];
  struct stat info;

  PetscFunctionBegin;
  for (int k = 0; k < TIMES; k++) {
    const PetscReal begin = Cpu();
    HycoMesh mesh;

    PetscCall(way->load(model, way->path, &mesh));
    took[k] = Cpu() - begin;
    PetscCall(Compare(model->model->mesh, mesh));
    PetscCall(HycoMeshDestroy(&mesh));
  }
  PetscCall(PetscSortReal(TIMES, took));
  PetscCheck(!stat(way->path, &info), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s is missing", way->path);
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s,%.3f,%ld\n", way->name, 1e3 * took[TIMES / 2], (long)info.st_size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadModel(HycoROM model, const char path[], HycoMesh *mesh)
{
  HycoROM m;

  PetscFunctionBegin;
  (void)model;
  PetscCall(HycoROMLoad(path, &m));
  *mesh = m->model->mesh;
  PetscCall(PetscObjectReference((PetscObject)(*mesh)->dm));
  PetscCall(HycoROMDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Run(const char path[], const char name[])
{
  char plex[PETSC_MAX_PATH_LEN], objects[PETSC_MAX_PATH_LEN];
  const Way ways[] = {{"whole model", path, LoadModel},
                      {"arrays", path, LoadArrays},
                      {"DMPlex", plex, LoadPlex},
                      {"IS and Vec", objects, LoadObjects}};
  HycoROM model;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(plex, sizeof(plex), "%s-plex.h5", name));
  PetscCall(PetscSNPrintf(objects, sizeof(objects), "%s-objects.h5", name));
  PetscCall(HycoROMLoad(path, &model));
  PetscCall(SavePlex(model->model->mesh->dm, plex));
  PetscCall(SaveObjects(model->model->mesh->dm, objects));
  PetscCall(HycoH5OpenOr(path, "", &opened));
  for (size_t k = 0; k < sizeof(ways) / sizeof(ways[0]); k++) PetscCall(Measure(model, &ways[k]));
  PetscCall(HycoH5Close(&opened, PETSC_FALSE));
  PetscCall(HycoROMDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode code;

  if (argc != 3) return 2;
  if (HycoInitialize(NULL, NULL)) return 2;
  code = Run(argv[1], argv[2]);
  if (HycoFinalize()) return 2;
  return code ? 1 : 0;
}
