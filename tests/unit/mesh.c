/* Meshes as DMs and as tables, for each type of cell: cones, closures and labels of groups; parts cut out of a mesh;
   distribution and gathering; refinement. Sizes, tags and orientations are those of the file on any number of ranks. */
#include "patch.h"
#include "msh.h"
#include "plex.h"

#define MOST     1000
#define MIXED    HYCO_N_CELL_TYPES /* the index of the cases after those of one type */
#define N_CASES  (MIXED + 2)
#define TAG(i)   (3 + 2 * (i))  /* of node i in the file */
#define CELL(e)  (50 + 3 * (e)) /* of cell e */
#define FACET(f) (5000 + (f))

static PetscMPIInt rank, size;
static Patch cases[N_CASES];

/* A hex8, a prism6, a tet4 and a pyramid5, and the same without the pyramid. Facets of three nodes end with -1. */
static const Patch solids = {"mixed",
                             3,
                             8,
                             4,
                             0,
                             0,
                             12,
                             4,
                             14,
                             12,
                             {PATCH_CUBE, {2, 0, 0}, {2, 1, 0}, {1.3, -1, 0.3}, {0.5, 0.5, 2}},
                             {{0, 1, 2, 3, 4, 5, 6, 7}, {1, 5, 8, 2, 6, 9}, {1, 8, 5, 10}, {4, 5, 6, 7, 11}},
                             {{0, 1, 2, 3},
                              {0, 1, 5, 4},
                              {2, 3, 7, 6},
                              {3, 0, 4, 7},
                              {1, 8, 9, 2},
                              {8, 5, 6, 9},
                              {2, 9, 6, -1},
                              {1, 8, 10, -1},
                              {8, 5, 10, -1},
                              {5, 1, 10, -1},
                              {4, 5, 11, -1},
                              {5, 6, 11, -1},
                              {6, 7, 11, -1},
                              {7, 4, 11, -1}},
                             2};
static const int solids_gmsh[] = {5, 6, 4, 7}, solids_nodes[] = {8, 6, 4, 5};
static const int top[] = {4, 5, 6, 7}; /* the hexahedron's face below the pyramid */

static void MakeCases(void)
{
  for (int e = 0; e < patches[HYCO_TET4].n_cells; e++) { /* gmsh's tetrahedra have positive determinants */
    int *node = patches[HYCO_TET4].cell[e], keep = node[0];

    node[0] = node[1];
    node[1] = keep;
  }
  PatchesComplete();
  for (int t = 0; t < HYCO_N_MESH_TYPES; t++) cases[t] = patches[t];
  cases[MIXED] = cases[MIXED + 1] = solids;
  cases[MIXED + 1].n_nodes = 11;
  cases[MIXED + 1].n_cells = 3;
  cases[MIXED + 1].n_facets = 11;
  for (int v = 0; v < 4; v++) cases[MIXED + 1].facet[10][v] = top[v];
  cases[MIXED + 1].volume = 1 + 1. / 2 + 1. / 6;
  cases[MIXED].volume = cases[MIXED + 1].volume + 1. / 3;
}

static int CellGmsh(const Patch *p, int e)
{
  return p->gmsh_cell ? p->gmsh_cell : solids_gmsh[e];
}
static int CellSize(const Patch *p, int e)
{
  return p->gmsh_cell ? p->nv : solids_nodes[e];
}
static int FacetSize(const Patch *p, int f)
{
  return p->gmsh_cell ? p->nf : p->facet[f][3] < 0 ? 3 : 4;
}

/* Groups: the facets (skin), the cells (block), node 0 (marker, which is also a name of DMPlex). */
static PetscErrorCode Write(const Patch *p, const char path[])
{
  FILE *out = fopen(path, "w");

  PetscFunctionBegin;
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s", path);
  fprintf(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n%d 1 \"skin\"\n%d 2 \"block\"\n", p->dim - 1,
          p->dim);
  fprintf(out, "0 3 \"marker\"\n$EndPhysicalNames\n$Nodes\n%d\n", p->n_nodes);
  for (int i = 0; i < p->n_nodes; i++)
    fprintf(out, "%d %.17g %.17g %.17g\n", TAG(i), p->xyz[i][0], p->xyz[i][1], p->xyz[i][2]);
  fprintf(out, "$EndNodes\n$Elements\n%d\n4000 15 2 3 3 %d\n", 1 + p->n_facets + p->n_cells, TAG(0));
  for (int f = 0; f < p->n_facets; f++) {
    const int gmsh = p->gmsh_facet ? p->gmsh_facet : FacetSize(p, f) == 3 ? 2 : 3;

    fprintf(out, "%d %d 2 1 1", FACET(f), gmsh);
    for (int v = 0; v < FacetSize(p, f); v++) fprintf(out, " %d", TAG(p->facet[f][v]));
    fprintf(out, "\n");
  }
  for (int e = 0; e < p->n_cells; e++) {
    fprintf(out, "%d %d 2 2 2", CELL(e), CellGmsh(p, e));
    for (int v = 0; v < CellSize(p, e); v++) fprintf(out, " %d", TAG(p->cell[e][v]));
    fprintf(out, "\n");
  }
  fprintf(out, "$EndElements\n");
  PetscCheck(fclose(out) == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene on the case's mesh, whose file the caller removes. */
static PetscErrorCode MakeScene(MPI_Comm comm, const Patch *p, const char refine[], HycoScene *scene)
{
  char path[PETSC_MAX_PATH_LEN], key[4][32] = {"scene_mesh", "scene_refine", "body_block_young", "body_block_poisson"};
  char times[8], young[8] = "210", poisson[8] = "0.3";
  char *keys[4] = {key[0], key[1], key[2], key[3]}, *values[4] = {path, times, young, poisson};
  PetscMPIInt me;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &me));
  PetscCall(PetscStrncpy(times, refine, sizeof(times)));
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/hyco_mesh_%ld.msh", getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp",
                          (long)getpid()));
  PetscCallMPI(MPI_Bcast(path, sizeof(path), MPI_CHAR, 0, comm));
  if (!me) PetscCall(Write(p, path));
  PetscCall(HycoSceneFromEntries(comm, p->dim > 1 ? 4 : 3, keys, values, "/", scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DropScene(HycoScene *scene)
{
  PetscFunctionBegin;
  if (!rank) (void)unlink((*scene)->mesh_path); /* which reads it last */
  PetscCall(HycoSceneDestroy(scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareInts(const void *a, const void *b)
{
  return *(const int *)a - *(const int *)b;
}

/* The index of the case's facet with these n nodes in any order, of which some may be repeated; -1: none. */
static int FindFacet(const Patch *p, PetscInt n, const PetscInt node[])
{
  int mine[HYCO_FACET_NODES], k = 0;

  for (PetscInt v = 0; v < n; v++) mine[v] = (int)node[v];
  qsort(mine, (size_t)n, sizeof(int), CompareInts);
  for (PetscInt v = 0; v < n; v++) {
    if (!v || mine[v] != mine[v - 1]) mine[k++] = mine[v];
  }
  for (int f = 0; f < p->n_facets; f++) {
    int own[HYCO_FACET_NODES];

    if (FacetSize(p, f) != k) continue;
    for (int v = 0; v < k; v++) own[v] = p->facet[f][v];
    qsort(own, (size_t)k, sizeof(int), CompareInts);
    if (!memcmp(own, mine, (size_t)k * sizeof(int))) return f;
  }
  return -1;
}

/* -- the DM -- */

static PetscErrorCode CheckCones(const Patch *p, DM dm, PetscBool interpolated, HycoCellType type)
{
  static const DMPolytopeType expected[18] = {
      [1] = DM_POLYTOPE_SEGMENT,      [2] = DM_POLYTOPE_TRIANGLE,    [3] = DM_POLYTOPE_QUADRILATERAL,
      [4] = DM_POLYTOPE_TETRAHEDRON,  [5] = DM_POLYTOPE_HEXAHEDRON,  [6] = DM_POLYTOPE_TRI_PRISM,
      [7] = DM_POLYTOPE_PYRAMID,      [9] = DM_POLYTOPE_TRIANGLE,    [10] = DM_POLYTOPE_QUADRILATERAL,
      [11] = DM_POLYTOPE_TETRAHEDRON, [12] = DM_POLYTOPE_HEXAHEDRON, [16] = DM_POLYTOPE_QUADRILATERAL,
      [17] = DM_POLYTOPE_HEXAHEDRON};

  PetscFunctionBegin;
  for (int e = 0; e < p->n_cells; e++) {
    const PetscInt n = CellSize(p, e);
    PetscInt vertex[HYCO_CELL_NODES], cone;
    DMPolytopeType of;

    PetscCall(DMPlexGetCellType(dm, e, &of));
    CHECK(of == expected[CellGmsh(p, e)], "%s, cell %d: DMPlex's type is %s", p->name, e, DMPolytopeTypes[of]);
    PetscCall(DMPlexGetConeSize(dm, e, &cone));
    CHECK(interpolated || cone == n, "%s, cell %d: %d points in the cone", p->name, e, (int)cone);
    PetscCall(HycoPlexVertices(dm, interpolated, type, e, n, vertex));
    for (PetscInt v = 0; v < n; v++)
      CHECK(vertex[v] - p->n_cells == p->cell[e][v], "%s, cell %d, node %d: expected %d, found %d", p->name, e, (int)v,
            p->cell[e][v], (int)vertex[v] - p->n_cells);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In each stratum of a cell's facet, the cells whose facet of this number is in the file; together all of them. */
static PetscErrorCode CheckFacetLabel(const Patch *p, HycoMesh m, DMLabel label)
{
  PetscInt found = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < HycoFacetCount(m->type); k++) {
    PetscInt n = 0, node[HYCO_FACET_NODES];
    const PetscInt *cell = NULL;
    IS is;

    PetscCall(DMLabelGetStratumIS(label, HYCO_FACET + k, &is));
    if (!is) continue;
    PetscCall(ISGetLocalSize(is, &n));
    PetscCall(ISGetIndices(is, &cell));
    for (PetscInt j = 0; j < n; j++) {
      for (PetscInt v = 0; v < m->nf; v++) node[v] = m->cells[cell[j] * m->nv + HycoFacetNodes(m->type, k)[v]];
      CHECK(FindFacet(p, m->nf, node) >= 0, "%s: facet %d of cell %d is no facet of the file", p->name, (int)k,
            (int)cell[j]);
    }
    found += n;
    PetscCall(ISRestoreIndices(is, &cell));
    PetscCall(ISDestroy(&is));
  }
  CHECK(found == p->n_facets, "%s: expected %d facets, found %d", p->name, p->n_facets, (int)found);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each group is a label; points have the value 1 + dimension of the group; a name of DMPlex is not used. */
static PetscErrorCode CheckLabels(const Patch *p, HycoMesh m, DM dm)
{
  const char *const name[] = {"skin", "block", "group marker"};
  const PetscInt value[] = {p->dim, p->dim + 1, 1};
  PetscInt n_skin = 0;

  PetscFunctionBegin;
  for (int g = 0; g < 3; g++) {
    PetscInt n, expected = 0;
    PetscBool has, skin[96] = {PETSC_FALSE};

    PetscCall(DMHasLabel(dm, name[g], &has));
    CHECK(has, "%s: no label %s on rank %d", p->name, name[g], rank);
    if (!has || rank) continue;
    for (int f = 0; f < p->n_facets; f++) {
      for (int v = 0; v < FacetSize(p, f); v++) skin[p->facet[f][v]] = PETSC_TRUE;
    }
    for (int i = 0; i < p->n_nodes; i++) n_skin += g == 0 && skin[i];
    expected = g == 0 ? n_skin : g == 1 ? p->n_nodes + p->n_cells : 1;
    PetscCall(DMGetStratumSize(dm, name[g], value[g], &n));
    CHECK(n == expected, "%s, %s: expected %d points, found %d", p->name, name[g], (int)expected, (int)n);
    for (PetscInt i = 0; i < p->n_nodes; i++) {
      const PetscBool in = g == 0 ? skin[i] : (PetscBool)(g == 1 || i == 0);
      PetscInt of;

      PetscCall(DMGetLabelValue(dm, name[g], p->n_cells + i, &of));
      CHECK(of == (in ? value[g] : -1), "%s, %s: node %d has the value %d", p->name, name[g], (int)i, (int)of);
    }
  }
  if (!rank && p->dim > 1) {
    DMLabel label;

    PetscCall(DMGetLabel(dm, "skin", &label));
    PetscCall(CheckFacetLabel(p, m, label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the cones of first-order cells DMPlex finds the file's facets at the boundary, and positive determinants. */
static PetscErrorCode CheckInterpolated(const Patch *p, DM dm, HycoCellType type)
{
  PetscInt first, end, n = 0;
  DM full;

  PetscFunctionBegin;
  PetscCall(DMPlexInterpolate(dm, &full));
  if (!rank) {
    PetscCall(CheckCones(p, full, PETSC_TRUE, type));
    PetscCall(DMPlexGetHeightStratum(full, 1, &first, &end));
    for (PetscInt f = first; f < end; f++) {
      PetscInt vertex[4], cells;

      PetscCall(DMPlexGetSupportSize(full, f, &cells));
      if (cells != 1) continue;
      n++;
      PetscCall(HycoPlexVertices(full, PETSC_TRUE, HYCO_N_CELL_TYPES, f, p->nf, vertex));
      for (PetscInt v = 0; v < p->nf; v++) vertex[v] -= p->n_cells;
      CHECK(FindFacet(p, p->nf, vertex) >= 0, "%s: facet %d of DMPlex is not in the file", p->name, (int)f);
    }
    CHECK(n == p->n_facets, "%s: expected %d facets at the boundary, found %d", p->name, p->n_facets, (int)n);
    for (PetscInt e = 0; p->gmsh_cell && e < p->n_cells; e++) {
      PetscReal det, x[3], J[9], inverse[9];

      PetscCall(DMPlexComputeCellGeometryFEM(full, e, NULL, x, J, inverse, &det));
      CHECK(det > 0, "%s: DMPlex's determinant of cell %d is %g", p->name, (int)e, (double)det);
    }
  }
  PetscCall(DMDestroy(&full));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM of a file: its cells, nodes and tags on rank 0, none elsewhere, and its groups. */
static PetscErrorCode TestDM(const Patch *p)
{
  HycoScene scene;
  HycoMesh m = NULL;
  PetscInt last, n, expected = rank ? 0 : p->n_cells + p->n_nodes, type;
  const PetscInt *tag;
  PetscBool mixed;
  IS tags;
  DM dm;

  PetscFunctionBegin;
  PetscCall(MakeScene(PETSC_COMM_WORLD, p, "0", &scene));
  PetscCall(HycoMeshLoad(PETSC_COMM_WORLD, scene, &dm));
  if (!rank) PetscCall(HycoMeshRead(scene, &m));
  PetscCall(DMPlexGetChart(dm, NULL, &last));
  CHECK(last == expected, "%s: expected %d points on rank %d, found %d", p->name, (int)expected, rank, (int)last);
  PetscCall(HycoPlexType(dm, &type, &mixed));
  CHECK(mixed == !p->gmsh_cell && !strcmp(HycoCellKinds[type].name, mixed ? "hex8" : p->name), "%s: the type is %s",
        p->name, HycoCellKinds[type].name);
  PetscCall(PetscObjectQuery((PetscObject)dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(ISGetLocalSize(tags, &n));
  PetscCall(ISGetIndices(tags, &tag));
  CHECK(n == expected, "%s: %d tags", p->name, (int)n);
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt of = k < p->n_cells ? CELL(k) : TAG(k - p->n_cells);

    CHECK(tag[k] == of, "%s, point %d: expected tag %d, found %d", p->name, (int)k, (int)of, (int)tag[k]);
  }
  PetscCall(ISRestoreIndices(tags, &tag));
  if (!rank) PetscCall(CheckCones(p, dm, PETSC_FALSE, (HycoCellType)type));
  PetscCall(CheckLabels(p, m, dm));
  if (!HycoCellKinds[type].quadratic && p->dim > 1) PetscCall(CheckInterpolated(p, dm, (HycoCellType)type));
  PetscCall(DMDestroy(&dm));
  PetscCall(HycoMeshDestroy(&m));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- geometry -- */

/* The determinant of the corners' map at a point of the unit cell. */
static PetscReal Determinant(HycoMesh m, PetscInt cell, const PetscReal xi[3])
{
  static const int at[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                               {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const PetscBool simplex = (PetscBool)(m->dim > 1 && HycoCellKinds[m->type].corners == m->dim &&
                                        m->type != HYCO_QUAD4 && m->type != HYCO_QUAD8 && m->type != HYCO_QUAD9);
  const PetscInt corners = simplex ? m->dim + 1 : 1 << m->dim;
  PetscReal J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  for (PetscInt c = 0; c < m->dim; c++) {
    for (PetscInt d = 0; d < m->dim; d++) {
      J[c][d] = 0;
      for (PetscInt a = 0; a < corners; a++) {
        PetscReal slope = simplex ? (PetscReal)(a == d + 1) - (a == 0) : 1;

        for (PetscInt k = 0; k < m->dim && !simplex; k++) slope *= k == d ? at[a][k] / 2. : (1 + at[a][k] * xi[k]) / 2;
        J[c][d] += slope * m->xyz[3 * m->cells[cell * m->nv + a] + c];
      }
    }
  }
  return (J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) +
          J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0])) *
         (simplex ? (m->dim == 2 ? 1. / 2 : 1. / 6) : 1);
}

/* The volume of the cells with their corners alone, which is that of the cases; each determinant is positive. A
   simplex has the same determinant everywhere, and the points' weights add up to 1; else they are 1 each. */
static PetscReal Volume(const char name[], HycoMesh m)
{
  const PetscBool simplex =
      (PetscBool)(m->type == HYCO_TRI3 || m->type == HYCO_TRI6 || m->type == HYCO_TET4 || m->type == HYCO_TET10);
  PetscReal volume = 0;

  for (PetscInt e = 0; e < m->n_cells; e++) {
    for (PetscInt g = 0; g < 1 << m->dim; g++) {
      const PetscReal xi[3] = {(g & 1 ? 1 : -1) / sqrt(3.), (g & 2 ? 1 : -1) / sqrt(3.), (g & 4 ? 1 : -1) / sqrt(3.)};
      const PetscReal det = Determinant(m, e, xi);

      CHECK(det > 0, "%s: cell %d has the determinant %g", name, (int)m->cell_id[e], (double)det);
      volume += simplex ? det / (1 << m->dim) : det;
    }
  }
  return volume;
}

/* The area of the facets' corners; each facet's normal points away from the middle of its cell. */
static PetscReal Area(const char name[], HycoMesh m)
{
  PetscReal area = 0;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf, *cell = m->cells + m->facet_cell[f] * m->nv;
    const PetscInt corners = HycoCellKinds[m->type].corners;
    PetscReal normal[3] = {0, 0, 0}, out = 0, sum = 0;

    if (m->dim == 2) {
      normal[0] = m->xyz[3 * node[1] + 1] - m->xyz[3 * node[0] + 1];
      normal[1] = m->xyz[3 * node[0]] - m->xyz[3 * node[1]];
    }
    for (PetscInt k = 1; k + 1 < corners && m->dim == 3; k++) { /* a fan of triangles */
      for (PetscInt c = 0; c < 3; c++) {
        const PetscInt d = (c + 1) % 3, h = (c + 2) % 3;
        const PetscReal *o = m->xyz + 3 * node[0], *a = m->xyz + 3 * node[k], *b = m->xyz + 3 * node[k + 1];

        normal[c] += ((a[d] - o[d]) * (b[h] - o[h]) - (a[h] - o[h]) * (b[d] - o[d])) / 2;
      }
    }
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt v = 0; v < m->nv; v++) out += normal[c] * (m->xyz[3 * node[0] + c] - m->xyz[3 * cell[v] + c]);
      sum += normal[c] * normal[c];
    }
    CHECK(m->dim == 1 || out > 0, "%s: facet %d of cell %d points into it", name, (int)f,
          (int)m->cell_id[m->facet_cell[f]]);
    area += m->dim == 1 ? 1 : sqrt(sum);
  }
  return area;
}

/* The area of the case's skin: of the square or cube, else of the solids (slanted faces by Heron's formula). */
static PetscReal Skin(const Patch *p)
{
  PetscReal area = 0;

  if (p->gmsh_cell) return p->dim == 1 ? 3 : 2 * p->dim; /* in 1D node 0 is in two groups */
  for (int f = 0; f < p->n_facets; f++) {
    for (int k = 1; k + 1 < FacetSize(p, f); k++) {
      const double *x[3] = {p->xyz[p->facet[f][0]], p->xyz[p->facet[f][k]], p->xyz[p->facet[f][k + 1]]};
      double side[3], s = 0;

      for (int j = 0; j < 3; j++) {
        const double *a = x[j], *b = x[(j + 1) % 3];

        side[j] = sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
        s += side[j] / 2;
      }
      area += sqrt(s * (s - side[0]) * (s - side[1]) * (s - side[2]));
    }
  }
  return area;
}

/* -- parts -- */

/* Members of a group in a part: those of the whole that the part has (NULL: all), by their tags. */
static void CheckMembers(const char name[], PetscInt n_groups, const PetscInt start[], const PetscInt member[],
                         const PetscInt id[], const PetscInt whole_start[], const PetscInt whole_member[],
                         const PetscInt whole_id[], const PetscBool in[])
{
  for (PetscInt g = 0; g < n_groups; g++) {
    PetscInt expected = 0, sum = 0;

    for (PetscInt k = whole_start[g]; k < whole_start[g + 1]; k++) {
      const PetscBool has = (PetscBool)(!in || in[whole_member[k]]);

      expected += has;
      sum += has ? whole_id[whole_member[k]] : 0;
    }
    for (PetscInt k = start[g]; k < start[g + 1]; k++) sum -= id[member[k]];
    CHECK(start[g + 1] - start[g] == expected && !sum, "%s, group %d: expected %d members, found %d; tags differ by %d",
          name, (int)g, (int)expected, (int)(start[g + 1] - start[g]), (int)sum);
  }
}

/* Nodes of cells come first, in both parts ascending; numbers in the whole, tags, coordinates, bodies agree. */
static void CheckPartNodes(const Patch *p, HycoMesh whole, HycoMesh part, const PetscInt want[], PetscInt n_cell_nodes)
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < whole->n_nodes; i++) n += want[i] > 0;
  CHECK(part->n_nodes == n, "%s: expected %d nodes, found %d", p->name, (int)n, (int)part->n_nodes);
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt w = part->node_whole[i];

    CHECK(want[w] == (i < n_cell_nodes ? 2 : 1), "%s: node %d of the part is %d", p->name, (int)i, (int)w);
    CHECK(!i || i == n_cell_nodes || w > part->node_whole[i - 1], "%s: node %d is not in order", p->name, (int)i);
    CHECK(part->node_id[i] == TAG(w) && part->node_body[i] == 0, "%s: node %d has tag %d", p->name, (int)i,
          (int)part->node_id[i]);
    for (PetscInt c = 0; c < 3; c++) CHECK_NEAR(part->xyz[3 * i + c], p->xyz[w][c], 0);
  }
}

/* Facets are those of the whole, in its order and orientation, of the cells that are kept and of the group `all`. */
static void CheckPartFacets(const Patch *p, HycoMesh whole, HycoMesh part, const PetscBool in[], PetscInt all)
{
  PetscInt n = 0;

  for (PetscInt f = 0; f < whole->n_facets; f++) {
    const PetscInt cell = whole->facet_cell[f];

    if (!in[cell] && whole->facet_group[f] != all) continue;
    CHECK(n < part->n_facets, "%s: facet %d is missing", p->name, (int)f);
    if (n >= part->n_facets) return;
    CHECK(part->facet_group[n] == whole->facet_group[f], "%s: facet %d has another group", p->name, (int)f);
    CHECK(in[cell] ? part->facet_cell[n] >= 0 && part->cell_whole[part->facet_cell[n]] == cell
                   : part->facet_cell[n] == -1,
          "%s: facet %d bounds cell %d", p->name, (int)f, (int)part->facet_cell[n]);
    for (PetscInt v = 0; v < part->nf; v++) {
      const PetscInt at = part->facets[n * part->nf + v];

      CHECK(at >= 0 && part->node_whole[at] == whole->facets[f * part->nf + v], "%s: facet %d, node %d is %d", p->name,
            (int)f, (int)v, (int)at);
    }
    n++;
  }
  CHECK(part->n_facets == n, "%s: expected %d facets, found %d", p->name, (int)n, (int)part->n_facets);
}

/* Whether a facet of four nodes is a triangle. */
static PetscBool FacetTriangle(HycoMesh m, PetscInt f)
{
  return (PetscBool)(m->nf == 4 && m->facets[4 * f + 2] == m->facets[4 * f + 3]);
}

/* The DM of a submesh: its points' tags, types and points in the whole mesh; a facet without its cell has this cell as
   its point, and in its group's label its number there. */
static PetscErrorCode CheckSubmeshDM(const Patch *p, HycoMesh whole, HycoMesh part)
{
  PetscInt n, first, last, loose = 0, node[HYCO_FACET_NODES];
  const PetscInt *point, *tag;
  IS points, tags;

  PetscFunctionBegin;
  PetscCall(HycoSubmeshGetPoints(part->dm, &points));
  PetscCall(PetscObjectQuery((PetscObject)part->dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(ISGetIndices(points, &point));
  PetscCall(ISGetIndices(tags, &tag));
  PetscCall(ISGetLocalSize(points, &n));
  PetscCall(DMPlexGetChart(part->dm, &first, &last));
  for (PetscInt f = 0; f < part->n_facets; f++) loose += part->facet_cell[f] < 0;
  CHECK(first == 0 && last == n && n == part->n_cells + loose + part->n_nodes, "%s: %d points in %d to %d", p->name,
        (int)n, (int)first, (int)last);
  for (PetscInt e = 0; e < part->n_cells; e++) {
    const PetscInt c = part->cell_point[e];

    CHECK(point[c] == whole->cell_point[part->cell_whole[e]] && tag[c] == part->cell_id[e],
          "%s: cell %d is point %d with tag %d", p->name, (int)e, (int)point[c], (int)tag[c]);
  }
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt v = part->node_point[i];

    CHECK(point[v] == whole->node_point[part->node_whole[i]] && tag[v] == part->node_id[i],
          "%s: node %d is point %d with tag %d", p->name, (int)i, (int)point[v], (int)tag[v]);
  }
  for (PetscInt f = 0; f < part->n_facets; f++) {
    DMPolytopeType type;
    DMLabel label;
    PetscInt value, cell = 0, n_cone;
    const PetscInt *cone;

    if (part->facet_cell[f] >= 0) continue;
    PetscCall(DMPlexGetCellType(part->dm, part->facet_point[f], &type));
    CHECK(DMPolytopeTypeGetDim(type) == part->dim - 1 &&
              (part->dim < 3 || (type == DM_POLYTOPE_TRIANGLE) == (part->nf % 4 > 1 || FacetTriangle(part, f))),
          "%s: facet %d is a %s", p->name, (int)f, DMPolytopeTypes[type]);
    while (cell < whole->n_cells && whole->cell_point[cell] != point[part->facet_point[f]]) cell++;
    CHECK(cell < whole->n_cells && tag[part->facet_point[f]] == whole->cell_id[cell], "%s: facet %d has tag %d",
          p->name, (int)f, (int)tag[part->facet_point[f]]);
    PetscCall(DMGetLabel(part->dm, part->group_name[part->facet_group[f]], &label));
    PetscCall(DMLabelGetValue(label, part->facet_point[f], &value));
    CHECK(value >= HYCO_FACET && cell < whole->n_cells, "%s: facet %d has value %d", p->name, (int)f, (int)value);
    if (value < HYCO_FACET || cell == whole->n_cells) continue;
    (void)HycoMeshFace(whole, cell, value - HYCO_FACET, node);
    PetscCall(DMPlexGetConeSize(part->dm, part->facet_point[f], &n_cone));
    PetscCall(DMPlexGetCone(part->dm, part->facet_point[f], &cone));
    for (PetscInt v = 0; v < n_cone; v++) {
      PetscBool in = PETSC_FALSE;

      for (PetscInt w = 0; w < part->nf; w++) in = (PetscBool)(in || whole->node_point[node[w]] == point[cone[v]]);
      CHECK(in, "%s: facet %d, vertex %d is not a node of its cell's face", p->name, (int)f, (int)v);
    }
  }
  PetscCall(ISRestoreIndices(points, &point));
  PetscCall(ISRestoreIndices(tags, &tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The submesh of a submesh without its cells, with all nodes and the facets of a group, has its order. */
static PetscErrorCode CheckSecondCut(const Patch *p, HycoScene scene, HycoMesh of, PetscInt skin)
{
  PetscInt all[96], parent[96], n = 0;
  HycoMesh sub;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < of->n_nodes; i++) all[i] = i;
  PetscCall(HycoSubmesh(scene, of, 0, NULL, of->n_nodes, all, 1, &skin, &sub));
  PetscCall(HycoSubmeshNodes(sub, of, parent));
  CHECK(sub->n_nodes == of->n_nodes && !sub->n_cells && sub->type == of->type, "%s: %d nodes, %d cells", p->name,
        (int)sub->n_nodes, (int)sub->n_cells);
  for (PetscInt i = 0; i < sub->n_nodes; i++)
    CHECK(parent[i] == i && sub->node_id[i] == of->node_id[i] && sub->node_whole[i] == of->node_whole[i] &&
              sub->node_body[i] == of->node_body[i],
          "%s: node %d is node %d", p->name, (int)i, (int)parent[i]);
  for (PetscInt f = 0; f < of->n_facets; f++) {
    if (of->facet_group[f] != skin) continue;
    CHECK(n < sub->n_facets, "%s: facet %d is missing", p->name, (int)f);
    for (PetscInt v = 0; n < sub->n_facets && v < of->nf; v++)
      CHECK(sub->facets[n * of->nf + v] == of->facets[f * of->nf + v], "%s: facet %d, node %d is %d", p->name, (int)f,
            (int)v, (int)sub->facets[n * of->nf + v]);
    n++;
  }
  CHECK(sub->n_facets == n, "%s: expected %d facets, found %d", p->name, (int)n, (int)sub->n_facets);
  CheckMembers(p->name, of->n_groups, sub->group_start, sub->group_node, sub->node_id, of->group_start, of->group_node,
               of->node_id, NULL);
  for (PetscInt g = 0; g < of->n_groups; g++)
    CHECK(sub->group_dim[g] == of->group_dim[g], "%s: %s has dimension %d", p->name, of->group_name[g],
          (int)sub->group_dim[g]);
  PetscCall(HycoMeshDestroy(&sub));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every second cell and node 0, with the facets of the cells, or with all. */
static PetscErrorCode TestSubmesh(const Patch *p, PetscBool all)
{
  HycoScene scene;
  HycoMesh whole, part;
  PetscInt keep[12], n_keep = 0, extra = 0, skin, want[96] = {0}, n_cell_nodes = 0;
  PetscBool in[12] = {PETSC_FALSE}, has[96];

  PetscFunctionBegin;
  PetscCall(MakeScene(PETSC_COMM_SELF, p, "0", &scene));
  PetscCall(HycoMeshCreate(PETSC_COMM_SELF, scene, &whole));
  PetscCall(HycoMeshFindGroup(whole, "test", "skin", &skin));
  for (PetscInt e = 1; e < p->n_cells; e += 2) keep[n_keep++] = e;
  PetscCall(HycoSubmesh(scene, whole, n_keep, keep, 1, &extra, all, &skin, &part));
  want[0] = 1;
  for (int f = 0; all && f < p->n_facets; f++) {
    for (int v = 0; v < FacetSize(p, f); v++) want[p->facet[f][v]] = 1;
  }
  for (PetscInt k = 0; k < n_keep; k++) {
    in[keep[k]] = PETSC_TRUE;
    for (int v = 0; v < CellSize(p, (int)keep[k]); v++) want[p->cell[keep[k]][v]] = 2;
  }
  for (PetscInt i = 0; i < whole->n_nodes; i++) {
    has[i] = (PetscBool)(want[i] > 0);
    n_cell_nodes += want[i] == 2;
  }
  CheckPartNodes(p, whole, part, want, n_cell_nodes);
  CHECK(part->n_cells == n_keep, "%s: %d cells", p->name, (int)part->n_cells);
  for (PetscInt k = 0; k < part->n_cells; k++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n = HycoMeshOwnNodes(part, k, node);

    CHECK(part->cell_whole[k] == keep[k] && part->cell_id[k] == CELL(keep[k]) && part->cell_body[k] == 0,
          "%s, cell %d: tag %d", p->name, (int)k, (int)part->cell_id[k]);
    CHECK(n == CellSize(p, (int)keep[k]), "%s, cell %d: %d nodes", p->name, (int)k, (int)n);
    for (PetscInt v = 0; v < n; v++)
      CHECK(part->node_whole[node[v]] == p->cell[keep[k]][v], "%s, cell %d: node %d is another one", p->name, (int)k,
            (int)v);
  }
  CheckPartFacets(p, whole, part, in, all ? skin : -1);
  CheckMembers(p->name, whole->n_groups, part->group_start, part->group_node, part->node_id, whole->group_start,
               whole->group_node, whole->node_id, has);
  CheckMembers(p->name, whole->n_groups, part->group_cell_start, part->group_cell, part->cell_id,
               whole->group_cell_start, whole->group_cell, whole->cell_id, in);
  if (!all) (void)Area(p->name, part);
  PetscCall(CheckSubmeshDM(p, whole, part));
  PetscCall(CheckSecondCut(p, scene, part, skin));
  PetscCall(HycoMeshDestroy(&part));
  PetscCall(HycoMeshDestroy(&whole));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- distribution -- */

static PetscErrorCode Distribute(HycoScene scene, HycoMesh *part)
{
  HycoMesh whole;
  DM dm;

  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(PETSC_COMM_WORLD, scene, &dm));
  PetscCall(HycoPlexToMesh(dm, scene, &whole));
  PetscCall(HycoMeshDistribute(&dm, scene, whole, 0, NULL, HYCO_PARTITION_METIS, ""));
  PetscCall(HycoPlexToMesh(dm, scene, part));
  PetscCall(HycoMeshDestroy(&whole));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every node and every cell (of its first node) belongs to one rank; numbers of owned nodes are contiguous, those in
   the whole are the order of the tags; a rank has all cells around its nodes. */
static PetscErrorCode CheckOwners(const Patch *p, HycoMesh part)
{
  PetscInt owners[96] = {0}, numbers[96] = {0}, cells[12] = {0}, total = part->n_owned;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt w = part->node_whole ? part->node_whole[i] : i, n = part->node_global ? part->node_global[i] : i;

    CHECK(w >= 0 && w < p->n_nodes && part->node_id[i] == TAG(w), "%s: node with tag %d is number %d of the whole",
          p->name, (int)part->node_id[i], (int)w);
    CHECK(n >= 0 && n < p->n_nodes, "%s: node %d has number %d", p->name, (int)w, (int)n);
    if (HycoMeshOwned(part, i) < 0) continue;
    owners[w]++;
    numbers[n]++;
  }
  for (PetscInt e = 0; e < part->n_cells; e++) {
    const PetscInt w = part->cell_whole ? part->cell_whole[e] : e;

    CHECK(part->cell_id[e] == CELL(w), "%s: cell with tag %d is number %d of the whole", p->name, (int)part->cell_id[e],
          (int)w);
    cells[w] += HycoMeshOwned(part, part->cells[e * part->nv]) >= 0;
  }
  for (int e = 0; e < p->n_cells; e++) {
    PetscBool has = PETSC_FALSE, needs = PETSC_FALSE;

    for (PetscInt k = 0; k < part->n_cells; k++) has = (PetscBool)(has || part->cell_id[k] == CELL(e));
    for (int v = 0; v < CellSize(p, e); v++) needs = (PetscBool)(needs || owners[p->cell[e][v]]);
    CHECK(has == needs, "%s: rank %d has cell %d: %d, and owns a node of it: %d", p->name, rank, e, has, needs);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, owners, 96, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, numbers, 96, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, cells, 12, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  CHECK(total == p->n_nodes, "%s: %d owned nodes for %d", p->name, (int)total, p->n_nodes);
  for (int i = 0; i < p->n_nodes; i++)
    CHECK(owners[i] == 1 && numbers[i] == 1, "%s: node %d has %d owners, %d nodes have its number", p->name, i,
          (int)owners[i], (int)numbers[i]);
  for (int e = 0; e < p->n_cells; e++) CHECK(cells[e] == 1, "%s: cell %d has %d owners", p->name, e, (int)cells[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void CheckInts(const char name[], const char what[], PetscInt n, const PetscInt found[],
                      const PetscInt expected[])
{
  for (PetscInt k = 0; k < n; k++)
    CHECK(found[k] == expected[k], "%s, %s %d: expected %d, found %d", name, what, (int)k, (int)expected[k],
          (int)found[k]);
}

/* All of a distributed mesh on rank 0, NULL elsewhere; on one process the mesh as it is. */
static PetscErrorCode GatherAll(HycoScene scene, HycoMesh part, HycoMesh *all)
{
  PetscFunctionBegin;
  if (size == 1)
    PetscCall(Distribute(scene, all));
  else
    PetscCall(HycoMeshGather(scene, part, NULL, NULL, all));
  CHECK(!rank == !!*all, "rank %d: %p", rank, (void *)*all);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two meshes are the same, with the order and the orientation of everything. */
static void CheckSame(const char name[], HycoMesh m, HycoMesh of, PetscBool with_facets)
{
  CHECK(m->n_nodes == of->n_nodes && m->n_cells == of->n_cells && m->n_facets == of->n_facets &&
            m->n_groups == of->n_groups,
        "%s: %d nodes, %d cells, %d facets, %d groups; expected %d, %d, %d, %d", name, (int)m->n_nodes, (int)m->n_cells,
        (int)m->n_facets, (int)m->n_groups, (int)of->n_nodes, (int)of->n_cells, (int)of->n_facets, (int)of->n_groups);
  if (m->n_nodes != of->n_nodes || m->n_cells != of->n_cells || m->n_facets != of->n_facets) return;
  CheckInts(name, "tag of node", m->n_nodes, m->node_id, of->node_id);
  CheckInts(name, "body of node", m->n_nodes, m->node_body, of->node_body);
  for (PetscInt k = 0; k < 3 * m->n_nodes; k++) CHECK_NEAR(m->xyz[k], of->xyz[k], 1e-15);
  CheckInts(name, "tag of cell", m->n_cells, m->cell_id, of->cell_id);
  CheckInts(name, "body of cell", m->n_cells, m->cell_body, of->cell_body);
  for (PetscInt g = 0; g < PetscMin(m->n_groups, of->n_groups); g++)
    CHECK(!strcmp(m->group_name[g], of->group_name[g]) && m->group_dim[g] == of->group_dim[g], "%s: group %d is %s",
          name, (int)g, m->group_name[g]);
  CheckInts(name, "nodes of group", m->n_groups + 1, m->group_start, of->group_start);
  CheckInts(name, "node in groups", m->group_start[m->n_groups], m->group_node, of->group_node);
  CheckInts(name, "cells of group", m->n_groups + 1, m->group_cell_start, of->group_cell_start);
  CheckInts(name, "cell in groups", m->group_cell_start[m->n_groups], m->group_cell, of->group_cell);
  if (!with_facets) return;
  CheckInts(name, "node in cells", m->n_cells * m->nv, m->cells, of->cells);
  CheckInts(name, "cell of facet", m->n_facets, m->facet_cell, of->facet_cell);
  CheckInts(name, "group of facet", m->n_facets, m->facet_group, of->facet_group);
  CheckInts(name, "node in facets", m->n_facets * m->nf, m->facets, of->facets);
}

/* On rank 0: points of its own part have their tags; numbers are those of the whole mesh. */
static PetscErrorCode CheckSent(const Patch *p, HycoMesh part, HycoMesh some)
{
  PetscInt n, last;
  const PetscInt *point, *tag, *whole_tag;
  IS points, tags, whole_tags;

  PetscFunctionBegin;
  PetscCall(HycoSubmeshGetPoints(some->dm, &points));
  PetscCall(PetscObjectQuery((PetscObject)some->dm, HYCO_TAGS, (PetscObject *)&tags));
  PetscCall(PetscObjectQuery((PetscObject)part->dm, HYCO_TAGS, (PetscObject *)&whole_tags));
  PetscCall(DMPlexGetChart(part->dm, NULL, &last));
  PetscCall(ISGetLocalSize(points, &n));
  PetscCall(ISGetIndices(points, &point));
  PetscCall(ISGetIndices(tags, &tag));
  PetscCall(ISGetIndices(whole_tags, &whole_tag));
  for (PetscInt k = 0; k < n; k++)
    CHECK(point[k] >= last || tag[k] == whole_tag[point[k]], "%s: point %d with tag %d is point %d", p->name, (int)k,
          (int)tag[k], (int)point[k]);
  PetscCall(ISRestoreIndices(points, &point));
  PetscCall(ISRestoreIndices(tags, &tag));
  PetscCall(ISRestoreIndices(whole_tags, &whole_tag));
  for (PetscInt i = 0; i < some->n_nodes; i++)
    CHECK(some->node_whole[i] == (some->node_id[i] - TAG(0)) / 2 && some->node_global[i] >= 0, "%s: node %d is %d",
          p->name, (int)i, (int)some->node_whole[i]);
  for (PetscInt e = 0; e < some->n_cells; e++)
    CHECK(some->cell_whole[e] == 2 * e, "%s: cell %d is %d", p->name, (int)e, (int)some->cell_whole[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the skin and the cells with even numbers: each once, with their nodes and all of the skin's. */
static PetscErrorCode CheckGatherSome(HycoScene scene, const Patch *p, HycoMesh part)
{
  PetscBool *group, *cell;
  PetscInt skin, n = 0, want[96] = {0};
  HycoMesh some;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(part, "test", "skin", &skin));
  PetscCall(PetscCalloc2(part->n_groups, &group, part->n_cells, &cell));
  group[skin] = PETSC_TRUE;
  for (PetscInt e = 0; e < part->n_cells; e++) cell[e] = (PetscBool)((part->cell_id[e] - CELL(0)) / 3 % 2 == 0);
  PetscCall(HycoMeshGather(scene, part, group, cell, &some));
  PetscCall(PetscFree2(group, cell));
  CHECK(!rank == !!some, "rank %d: %p", rank, (void *)some);
  if (!some) PetscFunctionReturn(PETSC_SUCCESS);
  for (int f = 0; f < p->n_facets; f++) {
    for (int v = 0; v < FacetSize(p, f); v++) want[p->facet[f][v]] = 1;
  }
  for (int e = 0; e < p->n_cells; e += 2) {
    for (int v = 0; v < CellSize(p, e); v++) want[p->cell[e][v]] = 2;
  }
  for (int k = 0; k < 2 * p->n_nodes; k++) { /* nodes of cells come first */
    const int i = k % p->n_nodes;

    if (want[i] != 2 - k / p->n_nodes) continue;
    CHECK(n < some->n_nodes && some->node_id[n] == TAG(i), "%s: node %d is not gathered", p->name, i);
    n++;
  }
  CHECK(some->n_nodes == n, "%s: expected %d nodes, found %d", p->name, (int)n, (int)some->n_nodes);
  CHECK(some->n_cells == (p->n_cells + 1) / 2, "%s: %d cells", p->name, (int)some->n_cells);
  for (PetscInt e = 0; e < some->n_cells; e++)
    CHECK(some->cell_id[e] == CELL(2 * e), "%s: cell %d has tag %d", p->name, (int)e, (int)some->cell_id[e]);
  CHECK(p->dim == 1 || some->n_facets == p->n_facets, "%s: %d facets", p->name, (int)some->n_facets);
  for (PetscInt f = 0; f < some->n_facets; f++) {
    PetscInt node[HYCO_FACET_NODES];

    for (PetscInt v = 0; v < some->nf; v++) node[v] = (some->node_id[some->facets[f * some->nf + v]] - TAG(0)) / 2;
    CHECK(FindFacet(p, some->nf, node) >= 0, "%s: facet %d is not in the file", p->name, (int)f);
  }
  PetscCall(CheckSent(p, part, some));
  PetscCall(HycoMeshDestroy(&some));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parts have each node and cell once, and give the mesh of one process again when they are gathered. */
static PetscErrorCode TestDistribution(const Patch *p)
{
  HycoScene scene;
  HycoMesh part, all, whole = NULL;

  PetscFunctionBegin;
  PetscCall(MakeScene(PETSC_COMM_WORLD, p, "0", &scene));
  PetscCall(Distribute(scene, &part));
  PetscCall(CheckOwners(p, part));
  (void)Area(p->name, part);
  PetscCall(GatherAll(scene, part, &all));
  if (all) {
    PetscCall(HycoMeshCreate(PETSC_COMM_SELF, scene, &whole));
    CheckSame(p->name, all, whole, PETSC_TRUE);
    CHECK_NEAR(Volume(p->name, all), p->volume, 1e-14);
    CHECK_NEAR(Area(p->name, all), Skin(p), 1e-14);
  }
  if (size > 1) PetscCall(CheckGatherSome(scene, p, part));
  PetscCall(HycoMeshDestroy(&all));
  PetscCall(HycoMeshDestroy(&whole));
  PetscCall(HycoMeshDestroy(&part));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- refinement -- */

/* `times` halvings: 2^dim cells of each and 2^(dim - 1) facets, positive determinants, facets outward, the same volume
   and area; old nodes keep tag and place, new tags follow without gaps; the same on any number of ranks. */
static PetscErrorCode TestRefinement(const Patch *p, PetscInt times)
{
  const PetscInt factor = (PetscInt)1 << (p->dim * times), facets = (PetscInt)1 << ((p->dim - 1) * times);
  HycoScene scene;
  HycoMesh part, all, one = NULL;
  char text[8];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(text, sizeof(text), "%d", (int)times));
  PetscCall(MakeScene(PETSC_COMM_WORLD, p, text, &scene));
  PetscCall(Distribute(scene, &part));
  (void)Area(p->name, part);
  PetscCall(GatherAll(scene, part, &all));
  if (all) {
    CHECK(all->n_cells == factor * p->n_cells, "%s: %d cells of %d", p->name, (int)all->n_cells, p->n_cells);
    CHECK(all->n_facets == facets * p->n_facets + (p->dim == 1), "%s: %d facets of %d", p->name, (int)all->n_facets,
          p->n_facets);
    CHECK_NEAR(Volume(p->name, all), p->volume, 1e-13);
    CHECK_NEAR(Area(p->name, all), Skin(p), 1e-13);
    for (PetscInt e = 0; e < all->n_cells; e++)
      CHECK(all->cell_id[e] == e + 1, "%s: cell %d has tag %d", p->name, (int)e, (int)all->cell_id[e]);
    for (PetscInt i = 0; i < all->n_nodes; i++) {
      const PetscInt tag = i < p->n_nodes ? TAG(i) : TAG(p->n_nodes - 1) + i + 1 - p->n_nodes;

      CHECK(all->node_id[i] == tag, "%s, node %d: expected tag %d, found %d", p->name, (int)i, (int)tag,
            (int)all->node_id[i]);
      for (PetscInt c = 0; c < 3 && i < p->n_nodes; c++) CHECK_NEAR(all->xyz[3 * i + c], p->xyz[i][c], 0);
    }
    PetscCall(HycoMeshCreate(PETSC_COMM_SELF, scene, &one));
    CheckSame(p->name, all, one, PETSC_FALSE);
  }
  PetscCall(HycoMeshDestroy(&one));
  PetscCall(HycoMeshDestroy(&all));
  PetscCall(HycoMeshDestroy(&part));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells of second order and pyramids are not refined; the message names them. */
static PetscErrorCode TestRefused(const Patch *p, const char text[])
{
  HycoScene scene;
  DM dm;

  PetscFunctionBegin;
  PetscCall(MakeScene(PETSC_COMM_WORLD, p, "0", &scene));
  PetscCall(HycoMeshLoad(PETSC_COMM_WORLD, scene, &dm));
  CHECK_FAILS(HycoPlexRefine(&dm, scene, 1), text);
  PetscCall(DMDestroy(&dm));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With straight edges, the nodes added to hex20 cells and quad8 facets are the middles of faces and cells: hex27's. */
static PetscErrorCode TestFaceNodes(void)
{
  const Patch *wide = &cases[HYCO_HEX27];
  HycoScene scene;
  HycoMsh file = {0};

  PetscFunctionBegin;
  PetscCall(MakeScene(PETSC_COMM_SELF, &cases[HYCO_HEX20], "0", &scene));
  PetscCall(HycoMshRead(scene->mesh_path, &file));
  PetscCall(HycoMshAddFaceNodes(scene->mesh_path, &file));
  CHECK(file.n_nodes == wide->n_nodes, "expected %d nodes, found %d", wide->n_nodes, (int)file.n_nodes);
  for (PetscInt i = 0; i < file.n_nodes; i++) {
    PetscReal least = 1;

    for (int j = 0; j < wide->n_nodes; j++) {
      PetscReal off = 0;

      for (int c = 0; c < 3; c++) off = PetscMax(off, PetscAbsReal(file.xyz[3 * i + c] - wide->xyz[j][c]));
      least = PetscMin(least, off);
    }
    CHECK(least < 1e-14, "node %d is %g from any of hex27", (int)i, (double)least);
  }
  PetscCall(HycoMshDestroy(&file));
  PetscCall(DropScene(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  MakeCases();
  for (int t = 0; t < N_CASES; t++) {
    const Patch *p = &cases[t];
    const PetscBool quadratic = (PetscBool)(t < HYCO_N_MESH_TYPES && HycoCellKinds[t].quadratic);

    if (!p->name) continue;
    PetscCall(TestDM(p));
    if (!rank) PetscCall(TestSubmesh(p, PETSC_FALSE));
    if (!rank) PetscCall(TestSubmesh(p, PETSC_TRUE));
    PetscCall(TestDistribution(p)); /* also with fewer cells than ranks, some of which then have none */
    if (quadratic || t == MIXED)
      PetscCall(TestRefused(p, quadratic ? p->name : "pyramid"));
    else
      PetscCall(TestRefinement(p, t == HYCO_TRI3 || t == HYCO_HEX8 ? 2 : 1));
  }
  if (!rank) PetscCall(TestFaceNodes());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
