/*
  Uniform refinement. The DM is interpolated for it, so that facets are points: a group's label then contains its facets
  and cells with their closure, and DMPlex transfers labels to the refined points.
*/
#include "plex.h"
#include <hycocontactimpl.h>
#include <petscdmplextransform.h>
#include <string.h>

/* Memory of an interpolated DM for each of its cells while it is refined: about 100 for each point. */
#define BYTES(dim) (100 * (PetscReal)(1 << (dim)))

/* The facet of a cell with this number, as a point of the interpolated DM. Compared as sets of vertices, since
   DMPlex orders those of a face in its own way. -1: none. */
static PetscErrorCode FacetPoint(DM dm, HycoCellType type, PetscInt nv, PetscInt nf, PetscInt cell, PetscInt number,
                                 PetscInt *facet)
{
  const PetscInt *cone;
  const signed char *of = HycoFacetNodes(type, number);
  /* Room for first order alone: RefineMeshInterpolate() refuses other meshes. */
  PetscInt vertex[8], n;

  PetscFunctionBegin;
  PetscCall(HycoPlexVertices(dm, PETSC_TRUE, type, cell, nv, vertex));
  PetscCall(DMPlexGetConeSize(dm, cell, &n));
  PetscCall(DMPlexGetCone(dm, cell, &cone));
  *facet = -1;
  for (PetscInt k = 0; k < n && *facet < 0; k++) {
    PetscInt mine[4];
    PetscBool same = PETSC_TRUE;

    PetscCall(HycoPlexVertices(dm, PETSC_TRUE, HYCO_N_CELL_TYPES, cone[k], nf, mine));
    for (PetscInt v = 0; v < nf; v++) { /* as sets: a triangle of a hex8 mesh has a node twice */
      PetscBool has[2] = {PETSC_FALSE, PETSC_FALSE};

      for (PetscInt w = 0; w < nf; w++) {
        has[0] = (PetscBool)(has[0] || mine[v] == vertex[of[w]]);
        has[1] = (PetscBool)(has[1] || mine[w] == vertex[of[v]]);
      }
      same = (PetscBool)(same && has[0] && has[1]);
    }
    if (same) *facet = cone[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of a group: its cells, its facets, or its vertices if it consists of points. */
static PetscErrorCode AddOwnPoints(DM dm, HycoCellType type, PetscInt nv, PetscInt nf, DMLabel from, DMLabel to)
{
  PetscInt dim, n_values, n, facet = -1;
  const PetscInt *value, *point;
  IS values, points;

  PetscFunctionBegin;
  PetscCall(DMGetDimension(dm, &dim));
  PetscCall(DMLabelGetValueIS(from, &values));
  PetscCall(ISGetLocalSize(values, &n_values));
  PetscCall(ISGetIndices(values, &value));
  for (PetscInt k = 0; k < n_values; k++) {
    PetscCall(DMLabelGetStratumIS(from, value[k], &points));
    if (!points) continue;
    PetscCall(ISGetLocalSize(points, &n));
    PetscCall(ISGetIndices(points, &point));
    /* Values: 1 points, 1 + dimension cells and nodes, HYCO_FACET + number facets. Vertices of a group of cells or
       facets come back by the closure. */
    for (PetscInt j = 0; j < n; j++) {
      PetscInt depth;

      PetscCall(DMPlexGetPointDepth(dm, point[j], &depth));
      if (value[k] >= HYCO_FACET) {
        PetscCall(FacetPoint(dm, type, nv, nf, point[j], value[k] - HYCO_FACET, &facet));
        if (facet >= 0) PetscCall(DMLabelSetValue(to, facet, 1));
      } else if (value[k] == 1 || depth == dim)
        PetscCall(DMLabelSetValue(to, point[j], 1));
    }
    PetscCall(ISRestoreIndices(points, &point));
    PetscCall(ISDestroy(&points));
  }
  PetscCall(ISRestoreIndices(values, &value));
  PetscCall(ISDestroy(&values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an entry of the scene names a group. */
typedef struct {
  const char *group;
  PetscBool named;
} Asked;

/* A visitor of HycoSceneVisitGroups(): groups that the scene does not name may be of any kind. */
static PetscErrorCode RefineMeshCompare(const char key[], const char name[], void *context)
{
  Asked *asked = (Asked *)context;

  (void)key;
  if (!strcmp(name, asked->group)) asked->named = PETSC_TRUE;
  return PETSC_SUCCESS;
}

/* Refuses vertices of a group that belong to none of its cells or facets: those of lines in space, or of facets
   between cells. */
static PetscErrorCode CheckVertices(DM dm, HycoScene scene, const char name[], DMLabel from, DMLabel to)
{
  PetscInt n, v0, v1, value;
  const PetscInt *point;
  Asked asked = {name, PETSC_FALSE};

  PetscFunctionBegin;
  PetscCall(HycoSceneVisitGroups(scene, RefineMeshCompare, &asked));
  if (!asked.named) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMPlexGetDepthStratum(dm, 0, &v0, &v1));
  /* Values 1 + dimension of groups of lines, surfaces and volumes; points (1) are kept as they are. */
  for (PetscInt k = 2; k <= 4; k++) {
    IS points;

    PetscCall(DMLabelGetStratumIS(from, k, &points));
    if (!points) continue;
    PetscCall(ISGetLocalSize(points, &n));
    PetscCall(ISGetIndices(points, &point));
    for (PetscInt j = 0; j < n; j++) {
      PetscCall(DMLabelGetValue(to, point[j], &value));
      HycoCheck(value == 1 || point[j] < v0 || point[j] >= v1,
                "scene_refine: the group %s has lines in 3D or facets between two cells, which refinement does not "
                "support; give a group of points, of boundary facets or of cells",
                name);
    }
    PetscCall(ISRestoreIndices(points, &point));
    PetscCall(ISDestroy(&points));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Interpolates the DM, and its labels of facets. Groups are rebuilt: edges and faces are not in the labels yet, and
   facets change from values of cells to points. Vertices and cells keep their numbers, thus also their tags.
   Collective. */
static PetscErrorCode RefineMeshInterpolate(DM *dm, HycoScene scene)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)*dm);
  PetscInt n, last, *tag, dim, depth, type;
  PetscBool mixed;
  const PetscInt *had;
  IS tags;
  DM full;

  PetscFunctionBegin;
  PetscCall(DMGetDimension(*dm, &dim));
  PetscCall(DMPlexGetDepth(*dm, &depth));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &depth, 1, MPIU_INT, MPI_MAX, comm));
  if (depth == dim) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPlexType(*dm, &type, &mixed));
  HycoCheck(!HycoCellKinds[PetscMax(type, 0)].quadratic,
            "scene_refine needs first-order cells, and the mesh has %s; refine the file (gmsh -refine)",
            HycoCellKinds[PetscMax(type, 0)].name);
  PetscCall(DMPlexInterpolate(*dm, &full));
  PetscCall(PetscObjectQuery((PetscObject)*dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(DMPlexGetChart(full, NULL, &last));
  PetscCall(PetscCalloc1(last, &tag));
  PetscCall(ISGetLocalSize(tags, &n));
  PetscCall(ISGetIndices(tags, &had));
  /* DMPlexInterpolate() appends faces and edges after the old points, which keep their numbers. */
  PetscCall(PetscArraycpy(tag, had, n));
  PetscCall(ISRestoreIndices(tags, &had));
  PetscCall(HycoPlexSetTags(full, tag));
  PetscCall(DMGetNumLabels(*dm, &n));
  for (PetscInt k = 0; k < n; k++) {
    const char *name;
    DMLabel from, to;

    PetscCall(DMGetLabelName(*dm, k, &name));
    if (HycoPlexOwnLabel(name)) continue;
    PetscCall(DMGetLabel(*dm, name, &from));
    /* DMPlexInterpolate() has copied the label with its values for cells; it starts empty here. */
    PetscCall(DMRemoveLabel(full, name, NULL));
    PetscCall(DMCreateLabel(full, name));
    PetscCall(DMGetLabel(full, name, &to));
    PetscCall(AddOwnPoints(full, (HycoCellType)type, HycoCellKinds[type].nv, HycoCellKinds[type].nf, from, to));
    PetscCall(DMPlexLabelComplete(full, to));
    /* After the completion, whose closure brings back the vertices of facets and cells; what is then missing has
       neither. */
    HycoOnEach(comm, CheckVertices(full, scene, name, from, to));
  }
  PetscCall(DMDestroy(dm));
  *dm = full;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of type `type` into which a point is refined; n = 0: none. The r-th is DMPlexTransformGetTargetPoint(). */
static PetscErrorCode CountChildren(DMPlexTransform transform, PetscInt p, DMPolytopeType from, DMPolytopeType type,
                                    PetscInt *n)
{
  DMPolytopeType *types;
  PetscInt n_types, *size, *cone, *orientation;

  PetscFunctionBegin;
  *n = 0;
  /* Borrowed tables of the transform: the numbers of children by type. */
  PetscCall(DMPlexTransformCellTransform(transform, from, p, NULL, &n_types, &types, &size, &cone, &orientation));
  for (PetscInt k = 0; k < n_types; k++) {
    if (types[k] == type) *n = size[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The key that identifies a new vertex on a point: the tags of two vertices, or a cell's. */
static PetscErrorCode RefineMeshKey(DM dm, const PetscInt tag[], PetscInt p, PetscInt depth, PetscInt dim,
                                    PetscInt64 *key)
{
  PetscInt vertex[4], least = 0;
  /* An edge: its two ends. A quadrilateral: its smallest vertex and the opposite one, which no other face shares
     in a conforming mesh. These do not depend on the orientation or the partition. */
  const PetscInt n = depth == 1 ? 2 : 4;

  PetscFunctionBegin;
  *key = tag[p];
  if (depth == dim) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPlexVertices(dm, PETSC_TRUE, HYCO_N_CELL_TYPES, p, n, vertex));
  for (PetscInt v = 1; v < n; v++) least = tag[vertex[v]] < tag[vertex[least]] ? v : least;
  *key = (PetscInt64)tag[vertex[least]] * ((PetscInt64)1 << 31) + tag[vertex[(least + n / 2) % n]]; /* and its
                                                                                                       opposite
                                                                                                       vertex */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assigns tags to the vertices in the middle of edges (depth 1), faces or cells, after those below *last. */
static PetscErrorCode TagMiddles(DM dm, DMPlexTransform transform, const PetscInt tag[], PetscInt depth, PetscInt *last,
                                 PetscInt new_tag[])
{
  PetscInt first, end, n = 0, dim, total, *place, *child;
  PetscInt64 *key;

  PetscFunctionBegin;
  /* RefineMeshKey() has 31 bits for a tag. */
  HycoCheck(*last <= 0x7fffffff, "the mesh has node numbers above 2147483647 and is not refined; refine the file");
  PetscCall(DMGetDimension(dm, &dim));
  PetscCall(DMPlexGetDepthStratum(dm, depth, &first, &end));
  PetscCall(PetscMalloc3(end - first, &key, end - first, &place, end - first, &child));
  for (PetscInt p = first; p < end; p++) {
    DMPolytopeType type;
    PetscInt has;

    PetscCall(DMPlexGetCellType(dm, p, &type));
    PetscCall(CountChildren(transform, p, type, DM_POLYTOPE_POINT, &has));
    if (!has) continue;
    /* Triangles and tetrahedra have no vertex in their middle and are skipped above. */
    PetscCall(DMPlexTransformGetTargetPoint(transform, type, DM_POLYTOPE_POINT, p, 0, &child[n]));
    PetscCall(RefineMeshKey(dm, tag, p, depth, dim, &key[n++]));
  }
  PetscCall(HycoRankKeys(PetscObjectComm((PetscObject)dm), n, key, place, &total));
  HycoCheck(
      total < PETSC_MAX_INT - *last,
      "the refined mesh has more nodes than the integers of this PETSc can count; use a PETSc with 64-bit indices");
  /* A vertex that several ranks have gets the same key there, and hence the same tag. */
  for (PetscInt k = 0; k < n; k++) new_tag[child[k]] = *last + 1 + place[k];
  *last += total;
  PetscCall(PetscFree3(key, place, child));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assigns tags to the children of this rank's cells c0 to c1 - 1, whose places are given. */
static PetscErrorCode TagChildren(DM dm, DMPlexTransform transform, PetscInt c0, PetscInt c1, const PetscInt place[],
                                  PetscInt new_tag[])
{
  PetscFunctionBegin;
  for (PetscInt c = c0; c < c1; c++) {
    DMPolytopeType type;
    PetscInt n, child;

    PetscCall(DMPlexGetCellType(dm, c, &type));
    PetscCall(CountChildren(transform, c, type, type, &n));
    HycoCheck(
        place[c - c0] < (PETSC_MAX_INT - n) / n,
        "the refined mesh has more cells than the integers of this PETSc can count; use a PETSc with 64-bit indices");
    for (PetscInt r = 0; r < n; r++) {
      PetscCall(DMPlexTransformGetTargetPoint(transform, type, type, c, r, &child));
      /* Children of one parent are contiguous: a body's cells stay together in the order of the tags. */
      new_tag[child] = 1 + place[c - c0] * n + r;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assigns tags to the cells in the order of their parents'. Collective. */
static PetscErrorCode TagCells(DM dm, DMPlexTransform transform, const PetscInt tag[], PetscInt new_tag[])
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)dm);
  PetscInt c0, c1, *place, total;

  PetscFunctionBegin;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &c0, &c1));
  PetscCall(PetscMalloc1(c1 - c0, &place));
  /* Places of the tags over all ranks: children of a cell follow each other as their parents do. */
  PetscCall(HycoRankInts(comm, c1 - c0, tag + c0, place, &total));
  HycoOnEach(comm, TagChildren(dm, transform, c0, c1, place, new_tag));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One uniform refinement with tags that do not depend on the partition: old vertices keep theirs, then the middles
   of edges, faces and cells follow. Collective. */
static PetscErrorCode RefineOnce(DM *dm)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)*dm);
  DMPlexTransform transform;
  PetscInt v0, v1, dim, end, last = 0, *new_tag;
  const PetscInt *tag;
  IS tags;
  DM fine;

  PetscFunctionBegin;
  PetscCall(DMGetDimension(*dm, &dim));
  PetscCall(DMPlexTransformCreate(comm, &transform));
  PetscCall(DMPlexTransformSetDM(transform, *dm));
  PetscCall(DMPlexTransformSetType(transform, DMPLEXREFINEREGULAR));
  PetscCall(DMPlexTransformSetUp(transform));
  PetscCall(DMPlexTransformApply(transform, *dm, &fine));
  PetscCall(PetscObjectQuery((PetscObject)*dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(ISGetIndices(tags, &tag));
  PetscCall(DMPlexGetChart(fine, NULL, &end));
  PetscCall(PetscCalloc1(end, &new_tag));
  PetscCall(DMPlexGetDepthStratum(*dm, 0, &v0, &v1));
  for (PetscInt v = v0; v < v1; v++) {
    PetscInt child;

    PetscCall(DMPlexTransformGetTargetPoint(transform, DM_POLYTOPE_POINT, DM_POLYTOPE_POINT, v, 0, &child));
    new_tag[child] = tag[v];
    last = PetscMax(last, tag[v]);
  }
  /* New tags follow the largest of all ranks, so that they are the same for any partition. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &last, 1, MPIU_INT, MPI_MAX, comm));
  for (PetscInt depth = 1; depth <= dim; depth++) PetscCall(TagMiddles(*dm, transform, tag, depth, &last, new_tag));
  PetscCall(TagCells(*dm, transform, tag, new_tag));
  PetscCall(ISRestoreIndices(tags, &tag));
  PetscCall(HycoPlexSetTags(fine, new_tag));
  PetscCall(DMPlexTransformDestroy(&transform));
  PetscCall(DMDestroy(dm));
  *dm = fine;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pyramids would be divided into cells of two types, whose tags would not follow from their parents'. */
static PetscErrorCode CheckShapes(DM dm)
{
  PetscInt c0, c1;

  PetscFunctionBegin;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &c0, &c1));
  for (PetscInt c = c0; c < c1; c++) {
    DMPolytopeType of;

    PetscCall(DMPlexGetCellType(dm, c, &of));
    HycoCheck(of != DM_POLYTOPE_PYRAMID,
              "scene_refine: the mesh has pyramids, which are not refined; refine the file (gmsh -refine)");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a number of cells for which a rank alone has too little memory. Collective. */
static PetscErrorCode CheckMemory(DM dm, PetscInt times)
{
  const PetscReal memory = HycoMachineMemory();
  PetscReal most, all;
  PetscInt c0, c1, dim;

  PetscFunctionBegin;
  PetscCall(DMGetDimension(dm, &dim));
  PetscCall(DMPlexGetHeightStratum(dm, 0, &c0, &c1));
  most = all = (PetscReal)(c1 - c0) * PetscPowReal(2, (PetscReal)(dim * times));
  HycoAllreduce(&most, 1, MPIU_REAL, MPI_MAX, HycoComm(dm));
  HycoAllreduce(&all, 1, MPIU_REAL, MPI_SUM, HycoComm(dm));
  HycoCheck(
      !(memory > 0 && BYTES(dim) * most > memory),
      "scene_refine: cells that are halved %d times are %.2g, and take at least %.2g GB; this machine has %.2g GB: "
      "refine less",
      (int)times, (double)all, (double)(BYTES(dim) * all / 1e9), (double)(memory / 1e9));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On one process, numbers the cells by type, as DMPlexTransform needs them; distribution does so on several. */
static PetscErrorCode SortByType(DM *dm)
{
  PetscInt c0, c1, last, next, n, *place, *new_tag;
  const PetscInt *tag;
  DMPolytopeType before = DM_POLYTOPE_POINT, of;
  PetscBool sorted = PETSC_TRUE;
  IS tags, order;
  PetscMPIInt size;
  DM by_type;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)*dm), &size));
  PetscCall(DMPlexGetHeightStratum(*dm, 0, &c0, &c1));
  for (PetscInt c = c0; c < c1; c++, before = of) {
    PetscCall(DMPlexGetCellType(*dm, c, &of));
    sorted = (PetscBool)(sorted && of >= before);
  }
  if (sorted || size > 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectQuery((PetscObject)*dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(DMPlexGetChart(*dm, NULL, &last));
  PetscCall(ISGetLocalSize(tags, &n));
  /* A permutation of cells within their stratum; vertices stay. */
  PetscCall(PetscMalloc1(last, &place));
  PetscCall(PetscMalloc1(n, &new_tag));
  for (PetscInt p = 0; p < last; p++) place[p] = p;
  next = c0;
  for (int type = 0; type < DM_NUM_POLYTOPES; type++) {
    for (PetscInt c = c0; c < c1; c++) {
      PetscCall(DMPlexGetCellType(*dm, c, &of));
      if ((int)of == type) place[c] = next++;
    }
  }
  PetscCall(ISGetIndices(tags, &tag));
  for (PetscInt p = 0; p < n; p++) new_tag[place[p]] = tag[p];
  PetscCall(ISRestoreIndices(tags, &tag));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, last, place, PETSC_OWN_POINTER, &order));
  PetscCall(DMPlexPermute(*dm, order, &by_type));
  PetscCall(ISDestroy(&order));
  PetscCall(HycoPlexSetTags(by_type, new_tag));
  PetscCall(DMDestroy(dm));
  *dm = by_type;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refines `times` times, and leaves an interpolated DM. Replaces *dm. Collective. */
PetscErrorCode HycoPlexRefine(DM *dm, HycoScene scene, PetscInt times)
{
  PetscFunctionBegin;
  if (!times) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnEach(PetscObjectComm((PetscObject)*dm), CheckShapes(*dm));
  PetscCall(CheckMemory(*dm, times));
  PetscCall(SortByType(dm));
  PetscCall(RefineMeshInterpolate(dm, scene));
  for (PetscInt k = 0; k < times; k++) PetscCall(RefineOnce(dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
