/*
  The mesh as a DMPlex: cells and vertices, a DMLabel per group, the file's tags of both in an IS. It has no edges and
  faces unless it is refined: DMPlexInterpolate() of 1e6 hexahedra takes 31 s and 935 MB, cells and vertices take 0.4 s
  and 172 MB. A facet of a group is therefore stored as a label value of its cell: HYCO_FACET + its number in the cell.
*/
#include "plex.h"
#include <stdlib.h>
#include <string.h>

/* The positions of gmsh's nodes in DMPlex's cone of a cell; the permutation is its own inverse. Cells of second
   order keep gmsh's order. */
static const signed char cone_place[HYCO_N_CELL_TYPES][8] = {
    [HYCO_LINE2] = {0, 1},
    [HYCO_TRI3] = {0, 1, 2},
    [HYCO_QUAD4] = {0, 1, 2, 3},
    [HYCO_TET4] = {1, 0, 2, 3},
    [HYCO_HEX8] = {0, 3, 2, 1, 4, 5, 6, 7},
    [HYCO_PYRAMID5] = {0, 3, 2, 1, 4},
    [HYCO_PRISM6] = {0, 2, 1, 3, 4, 5},
};
const DMPolytopeType HycoPlexTypes[HYCO_N_CELL_TYPES] = {
    DM_POLYTOPE_SEGMENT,     DM_POLYTOPE_TRIANGLE,   DM_POLYTOPE_QUADRILATERAL, DM_POLYTOPE_TETRAHEDRON,
    DM_POLYTOPE_HEXAHEDRON,  DM_POLYTOPE_TRIANGLE,   DM_POLYTOPE_QUADRILATERAL, DM_POLYTOPE_QUADRILATERAL,
    DM_POLYTOPE_TETRAHEDRON, DM_POLYTOPE_HEXAHEDRON, DM_POLYTOPE_HEXAHEDRON,    DM_POLYTOPE_PYRAMID,
    DM_POLYTOPE_TRI_PRISM};
/* The position of a node of a cell in its cone; shape HYCO_N_CELL_TYPES: for points that are not cells. */
PetscInt HycoConePlace(HycoCellType shape, PetscInt node)
{
  return shape < HYCO_N_CELL_TYPES && !HycoCellKinds[shape].quadratic ? cone_place[shape][node] : node;
}

/* The type of one cell: the mesh's, or a smaller one in a mesh whose smaller cells are stored as collapsed quad4
   or hex8. DMPlex knows the true shape. */
PetscErrorCode HycoPlexShape(DM dm, HycoCellType type, PetscInt cell, HycoCellType *shape)
{
  DMPolytopeType of;

  PetscFunctionBegin;
  *shape = type;
  if (type != HYCO_QUAD4 && type != HYCO_HEX8) PetscFunctionReturn(PETSC_SUCCESS);
  /* Of the several types with one polytope only first-order ones can be in a mesh of quad4 or hex8. */
  PetscCall(DMPlexGetCellType(dm, cell, &of));
  for (int t = 0; t < HYCO_N_CELL_TYPES; t++) {
    if (HycoPlexTypes[t] == of && !HycoCellKinds[t].quadratic) *shape = (HycoCellType)t;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The n nodes of a cell or facet in gmsh's order, repeated if the shape is smaller: from the cone (cells and
   vertices only), or from the closure (interpolated DM), whose vertices come last, in the order of the cone. */
PetscErrorCode HycoPlexVertices(DM dm, PetscBool interpolated, HycoCellType type, PetscInt p, PetscInt n,
                                PetscInt vertex[])
{
  PetscInt *closure = NULL, size, at = 0, v0, v1;
  HycoCellType shape;

  PetscFunctionBegin;
  PetscCall(HycoPlexShape(dm, type, p, &shape));
  if (!interpolated) {
    const PetscInt *cone, own = shape < HYCO_N_CELL_TYPES ? HycoCellKinds[shape].nv : n;

    PetscCall(DMPlexGetCone(dm, p, &cone));
    for (PetscInt k = 0; k < PetscMin(n, own); k++) vertex[k] = cone[HycoConePlace(shape, k)];
    if (own < n) HycoShapeWiden(shape, n, vertex);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(DMPlexGetDepthStratum(dm, 0, &v0, &v1));
  PetscCall(DMPlexGetTransitiveClosure(dm, p, PETSC_TRUE, &size, &closure));
  for (PetscInt k = 0; k < size && at < n; k++) {
    const PetscInt v = closure[2 * k];

    if (v < v0 || v >= v1) continue;
    /* The permutation is its own inverse, so that it also maps from DMPlex's place to gmsh's. */
    vertex[HycoConePlace(shape, at)] = v;
    at++;
  }
  PetscCall(DMPlexRestoreTransitiveClosure(dm, p, PETSC_TRUE, &size, &closure));
  if (at < n) HycoShapeWiden(shape < HYCO_N_CELL_TYPES ? shape : HYCO_TRI3, n, vertex);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a cone of this size is possible for a type, given DMPlex's type: cells of second order have all their
   nodes in their cones, those of first order at most these (in DMs with edges and faces the sides). */
static PetscBool ConeIsOf(HycoCellType type, PetscInt size)
{
  return (PetscBool)(HycoCellKinds[type].quadratic ? size == HycoCellKinds[type].nv : size <= HycoCellKinds[type].nv);
}

/* Whether a cell may be of a type, given DMPlex's type and the size of its cone. With ties, cones have any size, and
   the ties have the type of the mesh. */
static PetscBool IsOf(HycoCellType type, DMPolytopeType of, PetscInt size, HycoTies ties)
{
  if (HycoPlexTypes[type] != of) return PETSC_FALSE;
  if (!ties) return ConeIsOf(type, size);
  return (PetscBool)(HycoCellKinds[ties->type].quadratic ? type == (HycoCellType)ties->type
                                                         : !HycoCellKinds[type].quadratic);
}

/* The shapes of this process's cells, bits 1 << HycoCellType. An unknown type is an error on the rank that has it;
   FindType() is collective. */
static PetscErrorCode FindShapes(DM dm, PetscInt *shapes)
{
  HycoTies ties;
  PetscInt c0, c1;

  PetscFunctionBegin;
  *shapes = 0;
  PetscCall(HycoTiesOf(dm, &ties));
  PetscCall(DMPlexGetHeightStratum(dm, 0, &c0, &c1));
  for (PetscInt c = c0; c < c1; c++) {
    DMPolytopeType of;
    PetscInt t = 0, size;

    PetscCall(DMPlexGetConeSize(dm, c, &size));
    PetscCall(DMPlexGetCellType(dm, c, &of));
    /* By number of cone points and type: second-order cells have the type of their corners. */
    while (t < HYCO_N_CELL_TYPES && !IsOf((HycoCellType)t, of, size, ties)) t++;
    HycoCheck(t < HYCO_N_CELL_TYPES,
              "the mesh has cells of DMPlex's type %s; hyco supports segments, triangles, quadrilaterals, tetrahedra, "
              "pyramids, prisms (triangular_prism) and hexahedra",
              DMPolytopeTypes[of]);
    *shapes |= (PetscInt)1 << t;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TYPE "HycoType"

/* Composed with submeshes, shares and their migrated points: the type of the parent mesh stays, even if the part
   has only one shape or no cell. As an IS, because PETSc composes objects alone. */
PetscErrorCode HycoPlexSetType(DM dm, HycoCellType type, PetscBool mixed)
{
  const PetscInt value[2] = {(PetscInt)type, mixed};
  IS is;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, 2, value, PETSC_COPY_VALUES, &is));
  PetscCall(PetscObjectCompose((PetscObject)dm, TYPE, (PetscObject)is));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type that holds all shapes of all ranks (-1: no cells at all). Collective, unless it is composed. */
PetscErrorCode HycoPlexType(DM dm, PetscInt *type, PetscBool *mixed)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)dm);
  PetscInt shapes = 0;
  const PetscInt *of;
  IS set;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, TYPE, (PetscObject *)&set));
  if (set) { /* of the mesh of which this is a part */
    PetscCall(ISGetIndices(set, &of));
    *type = of[0];
    *mixed = (PetscBool)of[1];
    PetscCall(ISRestoreIndices(set, &of));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoOnEach(comm, FindShapes(dm, &shapes));
  /* A rank may have one type of cells alone, or none. */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &shapes, 1, MPIU_INT, MPI_BOR, comm));
  *type = shapes ? (PetscInt)HycoShapesType(shapes) : -1;
  *mixed = (PetscBool)(shapes && shapes != (PetscInt)1 << *type);
  HycoCheck(*type < HYCO_N_CELL_TYPES,
            "the DM has cells of second order and of other types; only first-order cells may be of several types");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- labels, tags, types -- */

/* Names of DMPlex's own labels are reserved. */
PetscBool HycoPlexOwnLabel(const char name[])
{
  return (PetscBool)(!strcmp(name, "depth") || !strcmp(name, "celltype") || !strcmp(name, "marker"));
}

/* Prefixes group names that DMPlex reserves. */
PetscErrorCode HycoPlexLabelName(const char group[], size_t room, char name[])
{
  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(name, room, "%s%s", HycoPlexOwnLabel(group) ? "group " : "", group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *label: borrowed; NULL if the DM has no such group. */
PetscErrorCode HycoPlexGroupLabel(DM dm, const char group[], DMLabel *label)
{
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoPlexLabelName(group, sizeof(name), name));
  PetscCall(DMGetLabel(dm, name, label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes ownership of tag[], by point of this process. The IS is of one process, for tags need no communication. */
PetscErrorCode HycoPlexSetTags(DM dm, PetscInt tag[])
{
  PetscInt first, last;
  IS is;

  PetscFunctionBegin;
  PetscCall(DMPlexGetChart(dm, &first, &last));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, last - first, tag, PETSC_OWN_POINTER, &is));
  PetscCall(PetscObjectCompose((PetscObject)dm, HYCO_TAGS, (PetscObject)is));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- from a DM to tables -- */

typedef struct {
  PetscInt node[HYCO_FACET_NODES], cell, point; /* point: of a facet without its cell */
  PetscInt tag, number;                         /* of its cell, in its cell */
} Facet;

typedef struct {
  DM dm;
  HycoScene scene;
  HycoMesh m;
  PetscInt c0, c1, v0, v1;     /* ranges of cells and vertices */
  PetscBool facets_are_points; /* the DM is interpolated */
  PetscBool sub;               /* a submesh: in the order of its points, with facets without their cells */
  PetscBool part;              /* of another mesh, with its type: nodes need not have cells */
  const PetscInt *tag;         /* by point */
  PetscBool *owned, all_owned; /* by vertex */
  HycoTies ties;               /* borrowed; NULL: none */
  PetscInt *node, *cell;       /* node of each vertex, cell of each cell of the DM; -1: none */
  PetscInt n_facets, room, node_room, cell_room;
  Facet *facet; /* of the current group */
} Builder;

/* The same on all processes. */
static PetscErrorCode FindType(Builder *b)
{
  HycoMesh m = b->m;
  PetscInt type;

  PetscFunctionBegin;
  PetscCall(HycoPlexType(b->dm, &type, &m->mixed));
  m->type = (HycoCellType)PetscMax(type, 0);
  m->nv = HycoCellKinds[m->type].nv;
  m->nf = HycoCellKinds[m->type].nf;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* place[k]: the index of the k-th smallest tag; a submesh is in order. */
static PetscErrorCode PlexOrder(const Builder *b, PetscInt n, const PetscInt key[], PetscInt place[])
{
  PetscBool sorted;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) place[k] = k;
  PetscCall(PetscSortedInt(n, key, &sorted));
  if (!sorted && !b->sub) PetscCall(PetscSortIntWithPermutation(n, key, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the vertices that this process owns. */
static PetscErrorCode FindOwned(Builder *b)
{
  PetscSF sf;
  PetscInt n = 0;
  /* Leaves of the point star forest are owned by other ranks. */
  const PetscInt *leaf = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->v1 - b->v0, &b->owned));
  for (PetscInt v = b->v0; v < b->v1; v++) b->owned[v - b->v0] = PETSC_TRUE;
  PetscCall(DMGetPointSF(b->dm, &sf));
  /* n is negative where no graph is set (one process), and then all is owned. */
  PetscCall(PetscSFGetGraph(sf, NULL, &n, &leaf, NULL));
  b->all_owned = (PetscBool)(n <= 0);
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt p = leaf ? leaf[k] : k;

    if (p >= b->v0 && p < b->v1) b->owned[p - b->v0] = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The masters of a cell's tied nodes: with ties, the end of its cone. Masters are in the cone, so that they come with
   the cell when it moves to another rank. */
static PetscErrorCode FollowedVertices(const Builder *b, PetscInt cell, PetscInt *n, const PetscInt *vertex[])
{
  HycoCellType shape;

  PetscFunctionBegin;
  PetscCall(HycoPlexShape(b->dm, b->m->type, cell, &shape));
  PetscCall(DMPlexGetConeSize(b->dm, cell, n));
  PetscCall(DMPlexGetCone(b->dm, cell, vertex));
  *n -= HycoCellKinds[shape].nv;
  *vertex += HycoCellKinds[shape].nv;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects the cells that touch a vertex owned by this process, by tag: those that contribute to its rows. The outer
   part of the overlap is dropped, which would only cost assembly. */
static PetscErrorCode TakeCells(Builder *b)
{
  HycoMesh m = b->m;
  PetscInt *keep, *key, *place, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->c1 - b->c0, &b->cell));
  PetscCall(PetscMalloc3(b->c1 - b->c0, &keep, b->c1 - b->c0, &key, b->c1 - b->c0, &place));
  for (PetscInt c = b->c0; c < b->c1; c++) {
    PetscInt vertex[HYCO_CELL_NODES] = {0}, n_followed;
    const PetscInt *followed;
    PetscBool mine = b->all_owned;

    /* On one process the closure of every cell would be computed twice for nothing. */
    if (!mine) PetscCall(HycoPlexVertices(b->dm, b->facets_are_points, m->type, c, m->nv, vertex));
    for (PetscInt v = 0; v < m->nv && !mine; v++) mine = (PetscBool)(mine || b->owned[vertex[v] - b->v0]);
    if (b->ties && !mine) {
      PetscCall(FollowedVertices(b, c, &n_followed, &followed));
      for (PetscInt k = 0; k < n_followed; k++) mine = (PetscBool)(mine || b->owned[followed[k] - b->v0]);
    }
    /* The order of the tags, not of the DM, so that sums over cells run in the same order on any number of ranks. */
    b->cell[c - b->c0] = -1;
    if (!mine) continue;
    key[n] = b->tag[c];
    keep[n++] = c;
  }
  PetscCall(PlexOrder(b, n, key, place));
  m->n_cells = n;
  PetscCall(PetscMalloc1(n, &b->m->cell_point));
  PetscCall(PetscMalloc1(n, &m->cell_id));
  PetscCall(PetscMalloc1(n * m->nv, &m->cells));
  for (PetscInt e = 0; e < n; e++) {
    b->m->cell_point[e] = keep[place[e]];
    b->cell[b->m->cell_point[e] - b->c0] = e;
    m->cell_id[e] = key[place[e]];
    /* Points of vertices for now: node indices follow from the nodes that these cells need (TakeNodes()). */
    PetscCall(HycoPlexVertices(b->dm, b->facets_are_points, m->type, b->m->cell_point[e], m->nv, m->cells + e * m->nv));
  }
  PetscCall(PetscFree3(keep, key, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects their nodes, by tag, with coordinates. By tag: the order of nodes, and with it that of all sums over them,
   is that of the file. */
static PetscErrorCode TakeNodes(Builder *b)
{
  HycoMesh m = b->m;
  PetscInt *key, *place, *keep, n = 0, dim;
  PetscSection section;
  Vec x;
  const PetscScalar *xyz;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->v1 - b->v0, &b->node));
  /* A part also has nodes without cells: those of facets, and masters. */
  for (PetscInt v = b->v0; v < b->v1; v++) b->node[v - b->v0] = b->part ? 0 : -1;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) b->node[m->cells[k] - b->v0] = 0;
  for (PetscInt e = 0; e < m->n_cells && b->ties; e++) {
    const PetscInt *followed;
    PetscInt n_followed;

    PetscCall(FollowedVertices(b, m->cell_point[e], &n_followed, &followed));
    for (PetscInt k = 0; k < n_followed; k++) b->node[followed[k] - b->v0] = 0;
  }
  PetscCall(PetscMalloc3(b->v1 - b->v0, &keep, b->v1 - b->v0, &key, b->v1 - b->v0, &place));
  for (PetscInt v = b->v0; v < b->v1; v++) {
    if (b->node[v - b->v0] < 0) continue;
    key[n] = b->tag[v];
    keep[n++] = v;
  }
  PetscCall(PlexOrder(b, n, key, place));
  m->n_nodes = n;
  PetscCall(PetscMalloc1(n, &b->m->node_point));
  PetscCall(PetscMalloc1(n, &m->node_id));
  PetscCall(PetscMalloc1(3 * n, &m->xyz));
  /* 3 for a mesh that was read, also of a plane; a DM of another program may have its own dimension. */
  PetscCall(DMGetCoordinateDim(b->dm, &dim));
  PetscCall(DMGetCoordinateSection(b->dm, &section));
  PetscCall(DMGetCoordinatesLocal(b->dm, &x));
  PetscCall(VecGetArrayRead(x, &xyz));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt at;

    b->m->node_point[i] = keep[place[i]];
    b->node[b->m->node_point[i] - b->v0] = i;
    m->node_id[i] = key[place[i]];
    PetscCall(PetscSectionGetOffset(section, b->m->node_point[i], &at));
    for (PetscInt c = 0; c < 3; c++) m->xyz[3 * i + c] = c < dim ? xyz[at + c] : 0;
  }
  PetscCall(VecRestoreArrayRead(x, &xyz));
  PetscCall(PetscFree3(keep, key, place));
  /* From points to indices of nodes, which exist only now. */
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) m->cells[k] = b->node[m->cells[k] - b->v0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reverses the orientation of a facet: its corners, of a face from the first on, and the middles of its sides, of
   which the k-th follows the k-th corner. */
static void PlexReverse(HycoCellType type, PetscInt facet[])
{
  const PetscInt corners = HycoCellKinds[type].corners, first = corners > 2;

  for (PetscInt k = first, last = corners - 1; k < last; k++, last--) {
    const PetscInt keep = facet[k];

    facet[k] = facet[last];
    facet[last] = keep;
  }
  /* The middles of the sides, in the same turn. */
  for (PetscInt k = corners, last = 2 * corners - 1; HycoCellKinds[type].quadratic && corners > 2 && k < last;
       k++, last--) {
    const PetscInt keep = facet[k];

    facet[k] = facet[last];
    facet[last] = keep;
  }
}

/* Reverses the facet if its normal points into the cell. In 1D nothing is done. */
static void TurnOutward(HycoMesh m, PetscInt cell, PetscInt facet[])
{
  PetscReal inside[3] = {0, 0, 0}, normal[3] = {0, 0, 0}, out = 0;
  const PetscReal *p = m->xyz + 3 * facet[0], *q, *s = m->xyz + 3 * facet[HycoCellKinds[m->type].corners - 1];

  /* A facet is a node: its normal follows from the cell where it is needed. */
  if (m->dim == 1) return;
  q = m->xyz + 3 * facet[1];
  for (PetscInt c = 0; c < 3; c++) {
    for (PetscInt v = 0; v < m->nv; v++) inside[c] += m->xyz[3 * m->cells[cell * m->nv + v] + c] / m->nv;
  }
  if (m->dim == 2) {
    normal[0] = q[1] - p[1];
    normal[1] = p[0] - q[0];
  }
  for (PetscInt c = 0; c < 3 && m->dim == 3; c++) {
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

    normal[c] = (q[d] - p[d]) * (s[e] - p[e]) - (q[e] - p[e]) * (s[d] - p[d]);
  }
  /* Against the cell's mean node: true for convex cells, and independent of the file's orientation, which gmsh does
     not guarantee. */
  for (PetscInt c = 0; c < 3; c++) out += normal[c] * (p[c] - inside[c]);
  if (out < 0) PlexReverse(m->type, facet);
}

/* Outward for facets with a cell here; one without it keeps the order that it got when it had the cell. */
void HycoMeshTurnFacet(HycoMesh m, PetscInt cell, PetscInt facet[])
{
  if (cell >= 0) TurnOutward(m, cell, facet);
  HycoFacetRepeatLast(m->nf, facet);
}

/* Adds a facet with a node that this process owns, of a cell or of a point without its cell (cell -1); `number` is its
   number in its cell. */
static PetscErrorCode AddFacet(Builder *b, PetscInt cell, PetscInt point, PetscInt number, const PetscInt node[])
{
  HycoMesh m = b->m;
  PetscBool mine = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt v = 0; v < m->nf; v++) {
    const PetscInt tied = HycoMeshTied(m, node[v]);

    mine = (PetscBool)(mine || b->owned[m->node_point[node[v]] - b->v0]);
    /* Masters of a tied node take its share of the facet's load. */
    for (PetscInt j = tied < 0 ? 0 : m->tied_start[tied]; tied >= 0 && j < m->tied_start[tied + 1]; j++)
      mine = (PetscBool)(mine || b->owned[m->node_point[m->tied_master[j]] - b->v0]);
  }
  /* Only facets around owned nodes: others are another rank's to integrate. */
  if (!mine) PetscFunctionReturn(PETSC_SUCCESS);
  HycoGrow(b->n_facets, b->room, b->facet);
  PetscCall(PetscArraycpy(b->facet[b->n_facets].node, node, m->nf));
  b->facet[b->n_facets].cell = cell;
  b->facet[b->n_facets].point = point;
  b->facet[b->n_facets].tag = cell < 0 ? b->tag[point] : m->cell_id[cell];
  b->facet[b->n_facets++].number = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lists of the current group grow at the end; group_start[group + 1] counts. */
static PetscErrorCode AddNode(Builder *b, PetscInt group, PetscInt node)
{
  HycoMesh m = b->m;
  PetscInt *n = &m->group_start[group + 1];

  PetscFunctionBegin;
  HycoGrow(*n, b->node_room, m->group_node);
  m->group_node[(*n)++] = node;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As AddNode(), for cells; in both a point may come several times, by several values, and is sorted out in
   TakeGroup(). */
static PetscErrorCode AddCell(Builder *b, PetscInt group, PetscInt cell)
{
  HycoMesh m = b->m;
  PetscInt *n = &m->group_cell_start[group + 1];

  PetscFunctionBegin;
  HycoGrow(*n, b->cell_room, m->group_cell);
  m->group_cell[(*n)++] = cell;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet that is a point of the DM bounds one cell, or lies between two and is then no boundary. */
static PetscErrorCode AddFacetPoint(Builder *b, PetscInt group, PetscInt p, const PetscInt node[])
{
  HycoMesh m = b->m;
  PetscInt n, number = 0, cell;
  const PetscInt *support, *cone;

  PetscFunctionBegin;
  PetscCall(DMPlexGetSupportSize(b->dm, p, &n));
  PetscCall(DMPlexGetSupport(b->dm, p, &support));
  for (PetscInt k = 0; k < b->scene->n_loads && n > 1; k++)
    HycoCheck(strcmp(b->scene->load[k].group, m->group_name[group]),
              "the load on %s: one of its facets lies between two cells; give a group on the boundary",
              m->group_name[group]);
  for (PetscInt k = 0; k < b->scene->n_springs && n > 1 && m->dim > 1; k++)
    HycoCheck(strcmp(b->scene->spring[k].group, m->group_name[group]),
              "the spring on %s: one of its facets lies between two cells; give a group on the boundary",
              m->group_name[group]);
  /* An inner facet is no boundary; its nodes are in the group by the closure of the label. */
  if (n != 1) PetscFunctionReturn(PETSC_SUCCESS);
  cell = b->cell[support[0] - b->c0];
  /* A number in the DM's cone, not in gmsh's order: it only makes the order of facets unique. */
  PetscCall(DMPlexGetCone(b->dm, support[0], &cone));
  while (number < HycoFacetCount(m->type) && cone[number] != p) number++;
  for (PetscInt v = 0; v < m->nf; v++) cell = node[v] < 0 ? -1 : cell;
  if (cell >= 0) PetscCall(AddFacet(b, cell, -1, number, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a point of a label, which contains the closure of its points, to the group as a node, a cell or a facet. */
static PetscErrorCode AddPoint(Builder *b, PetscInt group, PetscInt value, PetscInt p)
{
  HycoMesh m = b->m;
  /* of: the dimension of what the point shows the group to contain. Labels of DMs without faces carry it as the
     value 1 + dimension. */
  PetscInt vertex[HYCO_FACET_NODES], node[HYCO_FACET_NODES], depth = 0, of = 0;

  PetscFunctionBegin;
  if (p >= b->c0 && p < b->c1) {
    const PetscInt e = b->cell[p - b->c0];

    if (value < HYCO_FACET || b->facets_are_points) {
      of = m->dim;
      if (e >= 0) PetscCall(AddCell(b, group, e));
    } else if (e >= 0) {
      (void)HycoMeshFace(m, e, value - HYCO_FACET, node);
      PetscCall(AddFacet(b, e, -1, value - HYCO_FACET, node));
    }
  } else if (b->sub && p < b->v0) { /* a facet without its cell */
    const PetscInt *cone;
    PetscInt n;

    PetscCall(DMPlexGetConeSize(b->dm, p, &n));
    PetscCall(DMPlexGetCone(b->dm, p, &cone));
    for (PetscInt v = 0; v < m->nf; v++) node[v] = b->node[cone[PetscMin(v, n - 1)] - b->v0];
    PetscCall(AddFacet(b, -1, p, value - HYCO_FACET, node));
  } else {
    if (p < b->v0 || p >= b->v1)
      PetscCall(DMPlexGetPointDepth(b->dm, p, &depth));
    else if (b->node[p - b->v0] >= 0)
      PetscCall(AddNode(b, group, b->node[p - b->v0]));
    /* The group's dimension: of the point itself if facets are points, as the label contains closures; else the
       value's. */
    of = b->facets_are_points ? depth : value - 1;
    if (b->facets_are_points && depth == m->dim - 1) {
      PetscCall(HycoPlexVertices(b->dm, PETSC_TRUE, HYCO_N_CELL_TYPES, p, m->nf, vertex));
      for (PetscInt k = 0; k < m->nf; k++) node[k] = b->node[vertex[k] - b->v0];
      PetscCall(AddFacetPoint(b, group, p, node));
    }
  }
  /* A label has no dimension of its own: it is the largest of what it contains, over all ranks (AgreeOnGroups()). */
  m->group_dim[group] = PetscMax(m->group_dim[group], of);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By the tag of the cell, then the number in it: the same on any number of ranks. Facets without their cell may share
   both (HycoMeshCreateDM()); their points are in order. */
static int CompareFacets(const void *a, const void *b)
{
  const Facet *x = (const Facet *)a, *y = (const Facet *)b;

  if (x->tag != y->tag) return x->tag < y->tag ? -1 : 1;
  if (x->number != y->number) return x->number < y->number ? -1 : 1;
  return (x->point > y->point) - (x->point < y->point);
}

/* The facets of a group, in the order of their cells; those without their cell have their orientation. Outward: a
   pressure acts against the normal, and contact's gap is along it. */
static PetscErrorCode PlaceFacets(Builder *b, PetscInt group)
{
  HycoMesh m = b->m;
  const PetscInt n = m->n_facets + b->n_facets;

  PetscFunctionBegin;
  if (b->n_facets) qsort(b->facet, (size_t)b->n_facets, sizeof(*b->facet), CompareFacets);
  /* One more than needed: PetscRealloc() to 0 bytes frees. */
  PetscCall(PetscRealloc((size_t)(n * m->nf + 1) * sizeof(PetscInt), &m->facets));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &m->facet_group));
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &m->facet_cell));
  if (b->sub) PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(PetscInt), &m->facet_point));
  for (PetscInt k = 0; k < b->n_facets; k++) {
    PetscInt *facet = m->facets + m->n_facets * m->nf;

    PetscCall(PetscArraycpy(facet, b->facet[k].node, m->nf));
    HycoMeshTurnFacet(m, b->facet[k].cell, facet);
    m->facet_group[m->n_facets] = group;
    if (b->sub) m->facet_point[m->n_facets] = b->facet[k].point;
    m->facet_cell[m->n_facets++] = b->facet[k].cell;
  }
  b->n_facets = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the points of one label, in all its strata; duplicates come from values that share points (a cell with two
   facets). */
static PetscErrorCode TakeGroup(Builder *b, PetscInt group, DMLabel label)
{
  HycoMesh m = b->m;
  PetscInt n_values, n;
  const PetscInt *value, *point;
  IS values, points;

  PetscFunctionBegin;
  m->group_start[group + 1] = m->group_start[group];
  m->group_cell_start[group + 1] = m->group_cell_start[group];
  PetscCall(DMLabelGetValueIS(label, &values));
  PetscCall(ISGetLocalSize(values, &n_values));
  PetscCall(ISGetIndices(values, &value));
  for (PetscInt k = 0; k < n_values; k++) {
    /* In a submesh the value keeps the dimension, even where a group has lost all of its points. */
    if (b->sub && value[k] < HYCO_FACET) m->group_dim[group] = value[k] - 1; /* also without points */
    PetscCall(DMLabelGetStratumIS(label, value[k], &points));
    if (!points) continue;
    PetscCall(ISGetLocalSize(points, &n));
    PetscCall(ISGetIndices(points, &point));
    for (PetscInt j = 0; j < n; j++) PetscCall(AddPoint(b, group, value[k], point[j]));
    PetscCall(ISRestoreIndices(points, &point));
    PetscCall(ISDestroy(&points));
  }
  PetscCall(ISRestoreIndices(values, &value));
  PetscCall(ISDestroy(&values));
  n = m->group_start[group + 1] - m->group_start[group];
  /* Sorted, as searches by bisection expect. */
  PetscCall(HycoSortUnique(&n, m->group_node ? m->group_node + m->group_start[group] : NULL));
  m->group_start[group + 1] = m->group_start[group] + n;
  n = m->group_cell_start[group + 1] - m->group_cell_start[group];
  PetscCall(HycoSortUnique(&n, m->group_cell ? m->group_cell + m->group_cell_start[group] : NULL));
  m->group_cell_start[group + 1] = m->group_cell_start[group] + n;
  PetscCall(PlaceFacets(b, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Labels in the DM's order, the same on all ranks; DMPlex's own labels are no groups. */
static PetscErrorCode TakeGroups(Builder *b)
{
  HycoMesh m = b->m;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(DMGetNumLabels(b->dm, &n));
  PetscCall(PetscCalloc1(n, &m->group_name));
  PetscCall(PetscCalloc1(n, &m->group_dim));
  PetscCall(PetscCalloc1(n + 1, &m->group_start));
  PetscCall(PetscCalloc1(n + 1, &m->group_cell_start));
  for (PetscInt k = 0; k < n; k++) {
    const char *name;
    DMLabel label;

    PetscCall(DMGetLabelName(b->dm, k, &name));
    if (HycoPlexOwnLabel(name)) continue;
    PetscCall(DMGetLabel(b->dm, name, &label));
    /* The prefix of HycoPlexLabelName(). */
    if (strncmp(name, "group ", 6) == 0) name += 6;
    PetscCall(PetscStrallocpy(name, &m->group_name[m->n_groups]));
    PetscCall(TakeGroup(b, m->n_groups++, label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assigns each cell to the group of its one body. A body is the group of its name; in a mesh file others are rejected
   while it is read. */
static PetscErrorCode TakeBodies(Builder *b)
{
  HycoMesh m = b->m;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_body));
  for (PetscInt e = 0; e < m->n_cells; e++) m->cell_body[e] = -1;
  for (PetscInt k = 0; k < b->scene->n_bodies; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "body", b->scene->body[k].name, &g));
    for (PetscInt j = m->group_cell_start[g]; j < m->group_cell_start[g + 1]; j++) {
      PetscInt *body = &m->cell_body[m->group_cell[j]];

      HycoCheck(*body < 0, "cell %d belongs to two bodies, %s and %s; each cell must belong to one",
                (int)m->cell_id[m->group_cell[j]], b->scene->body[PetscMax(*body, 0)].name, b->scene->body[k].name);
      *body = k;
    }
  }
  /* A cell of a DMPlex without a label would have no law. */
  for (PetscInt e = 0; e < m->n_cells; e++)
    HycoCheck(m->cell_body[e] >= 0, "cell %d belongs to no body; give each cell of the mesh the label of a body",
              (int)m->cell_id[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells and nodes of a submesh: facets without their cells are between them. In a submesh DMPlex has no order of
   depths that would tell them apart. */
static PetscErrorCode FindStrata(Builder *b)
{
  const PetscInt dim = b->m->dim;
  PetscInt depth;
  PetscObject type;
  IS points;

  PetscFunctionBegin;
  PetscCall(DMPlexGetDepth(b->dm, &depth));
  PetscCall(DMPlexGetHeightStratum(b->dm, 0, &b->c0, &b->c1));
  PetscCall(DMPlexGetDepthStratum(b->dm, 0, &b->v0, &b->v1));
  PetscCall(HycoSubmeshGetPoints(b->dm, &points));
  b->sub = (PetscBool)(points != NULL);
  PetscCall(PetscObjectQuery((PetscObject)b->dm, TYPE, (PetscObject *)&type));
  b->part = (PetscBool)(type != NULL);
  b->facets_are_points = (PetscBool)(depth == dim && !b->part);
  /* Cells and the facets after them are in one stratum, of height 0, since neither is in a cone; bisection by type
     finds the border. */
  for (PetscInt end = b->c1, first = b->c0; b->sub && first < end;) {
    DMPolytopeType of;

    PetscCall(DMPlexGetCellType(b->dm, (first + end) / 2, &of));
    if (DMPolytopeTypeGetDim(of) == dim)
      first = (first + end) / 2 + 1;
    else
      end = b->c1 = (first + end) / 2;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each node of a submesh, with or without cells, belongs to the first of the bodies in whose group it is. */
static PetscErrorCode TakeNodeBodies(Builder *b)
{
  HycoMesh m = b->m;

  PetscFunctionBegin;
  /* Descending, so that the first body is written last and stays, as HycoMeshSetNodeBodies() chooses for nodes with
     cells. */
  for (PetscInt k = b->sub ? b->scene->n_bodies - 1 : -1; k >= 0; k--) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "body", b->scene->body[k].name, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) m->node_body[m->group_node[j]] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the tables of this process's part, without the data that needs communication. Without communication: its errors
   are raised by all ranks together afterwards. */
static PetscErrorCode MakeTables(Builder *b)
{
  IS tags;

  PetscFunctionBegin;
  PetscCall(DMGetDimension(b->dm, &b->m->dim));
  PetscCall(FindStrata(b));
  PetscCall(PetscObjectQuery((PetscObject)b->dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(ISGetIndices(tags, &b->tag));
  PetscCall(HycoTiesOf(b->dm, &b->ties));
  PetscCall(FindOwned(b));
  PetscCall(TakeCells(b));
  PetscCall(TakeNodes(b));
  /* After nodes are known: ties name them by tag. */
  PetscCall(HycoMeshSetTies(b->m, b->ties));
  PetscCall(TakeGroups(b));
  PetscCall(TakeBodies(b));
  PetscCall(HycoMeshSetNodeBodies(b->scene, b->m));
  PetscCall(TakeNodeBodies(b));
  PetscCall(ISRestoreIndices(tags, &b->tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers in the distributed vectors, by a section of the unknowns; places in the whole mesh, by tag. */
static PetscErrorCode PlexNumberNodes(Builder *b)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)b->dm);
  HycoMesh m = b->m;
  PetscSection section, global;

  PetscFunctionBegin;
  PetscCall(PetscSectionCreate(comm, &section));
  PetscCall(PetscSectionSetChart(section, b->v0, b->v1));
  for (PetscInt v = b->v0; v < b->v1; v++) PetscCall(PetscSectionSetDof(section, v, m->dim));
  PetscCall(PetscSectionSetUp(section));
  /* The DM's own section is replaced: the numbers are those of the vectors that DMCreateGlobalVector() would give. */
  PetscCall(DMSetLocalSection(b->dm, section));
  PetscCall(PetscSectionDestroy(&section));
  PetscCall(DMGetGlobalSection(b->dm, &global));
  /* The local section has dim unknowns at each vertex; the global one numbers them owner by owner. */
  for (PetscInt i = 0; i < m->n_nodes; i++) m->n_owned += b->owned[b->m->node_point[i] - b->v0];
  PetscCallMPI(MPI_Exscan(&m->n_owned, &m->first, 1, MPIU_INT, MPI_SUM, comm));
  PetscCall(PetscMalloc1(m->n_nodes + 1, &m->node_global));
  PetscCall(PetscMalloc1(m->n_nodes + 1, &m->node_whole));
  PetscCall(PetscMalloc1(m->n_cells + 1, &m->cell_whole));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    PetscInt at;

    PetscCall(PetscSectionGetOffset(global, b->m->node_point[i], &at));
    /* Negative: of another owner, whose offset it encodes. */
    m->node_global[i] = (at < 0 ? -(at + 1) : at) / m->dim;
  }
  PetscCall(HycoRankInts(comm, m->n_nodes, m->node_id, m->node_whole, &m->n_whole_nodes));
  PetscCall(HycoRankInts(comm, m->n_cells, m->cell_id, m->cell_whole, &m->n_whole_cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes consistent on all ranks: the whole mesh's length, and the dimensions of groups, which a process without their
   points does not know. */
static PetscErrorCode AgreeOnGroups(MPI_Comm comm, HycoMesh m)
{
  PetscReal ends[6];

  PetscFunctionBegin;
  HycoMeshEnds(m, ends);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 6, MPIU_REAL, MPI_MAX, comm));
  for (PetscInt c = 0; c < 3; c++) m->whole_length = PetscMax(m->whole_length, ends[c] + ends[3 + c]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, m->group_dim, (PetscMPIInt)m->n_groups, MPIU_INT, MPI_MAX, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the facets in the closure of a group of cells: they do not belong to the group. */
static void DropInnerFacets(HycoMesh m)
{
  PetscInt n = 0;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->group_dim[m->facet_group[f]] == m->dim) continue;
    /* In place and downwards: n never overtakes f. */
    memmove(m->facets + n * m->nf, m->facets + f * m->nf, (size_t)m->nf * sizeof(PetscInt));
    m->facet_group[n] = m->facet_group[f];
    if (m->facet_point) m->facet_point[n] = m->facet_point[f];
    m->facet_cell[n++] = m->facet_cell[f];
  }
  m->n_facets = n;
}

/* Separate from the caller, which frees its tables before it returns an error. */
static PetscErrorCode CheckGroups(MPI_Comm comm, HycoMesh m, HycoScene scene)
{
  PetscFunctionBegin;
  HycoOnEach(comm, HycoMeshCheckGroups(m, scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills the new tables b->m. Collective on comm. */
static PetscErrorCode FillTables(Builder *b, MPI_Comm comm)
{
  HycoScene scene = b->scene;
  PetscMPIInt size;
  size_t length;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(FindType(b));
  /* User errors (a cell of two bodies) occur on the rank that has the cell; all ranks return together. */
  HycoOnEach(comm, MakeTables(b));
  if (size == 1) b->m->n_owned = b->m->n_nodes;
  if (size > 1) PetscCall(AgreeOnGroups(comm, b->m));
  DropInnerFacets(b->m);
  PetscCall(PetscStrlen(scene->mesh_path, &length));
  if (!b->part &&
      (scene->dm || (length > 3 && strcmp(scene->mesh_path + length - 3, ".h5") == 0))) /* not yet checked */
    PetscCall(CheckGroups(comm, b->m, scene));
  if (size > 1) PetscCall(PlexNumberNodes(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The local tables of a DM's part: nodes and cells by tag, groups, facets outward, bodies; with several ranks also
   global numbers. The caller gets a reference to the DM. Collective on comm, which is PETSC_COMM_SELF for a DM that one
   rank alone uses. After an error the tables are freed, and the DM is as before. */
PetscErrorCode HycoPlexToTables(DM dm, MPI_Comm comm, HycoScene scene, HycoMesh *mesh)
{
  Builder b = {.dm = dm, .scene = scene};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshQuery(dm, mesh));
  /* Made once for each DM: the tables are composed with it. */
  if (*mesh) {
    PetscCall(PetscObjectReference((PetscObject)dm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscNew(&b.m));
  ierr = FillTables(&b, comm);
  HycoFreeAll(&b.owned, &b.node, &b.cell, &b.facet);
  if (ierr) PetscCall(HycoMeshDestroy(&b.m));
  PetscCall(ierr);
  PetscCall(PetscObjectReference((PetscObject)dm));
  PetscCall(HycoMeshSetDM(b.m, dm));
  *mesh = b.m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For a DM with points on all ranks of its own communicator. Collective. */
PetscErrorCode HycoPlexToMesh(DM dm, HycoScene scene, HycoMesh *mesh)
{
  PetscFunctionBegin;
  PetscCall(HycoPlexToTables(dm, PetscObjectComm((PetscObject)dm), scene, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
