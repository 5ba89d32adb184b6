/* Reading of gmsh files, format 2.2 and 4.1: nodes by tag, groups by dimension and tag, and the mesh's tables from them.
   A quadrilateral and a triangle share a side; tags are neither contiguous nor in order. */
#include "patch.h"
#include "msh.h"

/* (0,0) (1,0) (1,1) (0,1) (2,0.5) with the tags 40, 7, 12, 30, 9; node 99 is in no element of a group. */
#define NODES_22 "$Nodes\n6\n40 0 0 0\n7 1 0 0\n12 1 1 0\n30 0 1 0\n9 2 .5 0\n99 5 5 0\n$EndNodes\n"
/* plate (quadrilateral 300), wing (triangle 20), edge (two lines, the first one twice), seam (the line between both
   cells), a corner, a line of a group without a name, and a line of no group. */
#define ELEMENTS_22                                                                                                    \
  "$Elements\n9\n1 15 2 4 1 40\n5 1 2 1 1 40 7\n6 1 2 1 1 7 40\n4 1 2 1 1 40 30\n8 1 2 2 2 7 12\n"                     \
  "9 1 2 8 3 9 12\n10 1 2 0 4 9 99\n300 3 2 5 1 40 7 12 30\n20 2 2 6 2 7 9 12\n$EndElements\n"
#define NAMES                                                                                                          \
  "$PhysicalNames\n5\n0 4 \"corner\"\n1 1 \"edge\"\n1 2 \"seam\"\n2 5 \"plate\"\n2 6 \"wing\"\n$EndPhysicalNames\n"
#define FILE_22 "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" NAMES NODES_22 ELEMENTS_22

/* The same in 4.1: groups belong to entities; nodes and elements are in blocks of entities. */
#define ENTITIES                                                                                                       \
  "$Entities\n1 4 2 0\n1 0 0 0 1 4\n1 0 0 0 1 1 0 1 1 0\n2 1 0 0 1 1 0 1 2 0\n3 1 .5 0 2 1 0 1 8 0\n"                  \
  "4 2 .5 0 5 5 0 0 0\n1 0 0 0 1 1 0 1 5 0\n2 1 0 0 2 1 0 1 6 0\n$EndEntities\n"
#define NODES_41                                                                                                       \
  "$Nodes\n2 6 7 99\n0 1 0 1\n40\n0 0 0\n2 1 0 5\n7\n12\n30\n9\n99\n1 0 0\n1 1 0\n0 1 0\n2 .5 0\n5 5 0\n$EndNodes\n"
#define ELEMENTS_41                                                                                                    \
  "$Elements\n7 9 1 300\n0 1 15 1\n1 40\n1 1 1 3\n5 40 7\n6 7 40\n4 40 30\n1 2 1 1\n8 7 12\n1 3 1 1\n9 9 12\n"         \
  "1 4 1 1\n10 9 99\n2 1 3 1\n300 40 7 12 30\n2 2 2 1\n20 7 9 12\n$EndElements\n"
#define FILE_41 "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" NAMES ENTITIES NODES_41 ELEMENTS_41

static char path[PETSC_MAX_PATH_LEN];

static PetscErrorCode Write(const char text[])
{
  FILE *out = fopen(path, "w");

  PetscFunctionBegin;
  PetscCheck(out && fputs(text, out) >= 0 && fclose(out) == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void CheckList(const char what[], PetscInt n, const PetscInt found[], const PetscInt expected[])
{
  for (PetscInt k = 0; k < n; k++)
    CHECK(found[k] == expected[k], "%s, %d: expected %d, found %d", what, (int)k, (int)expected[k], (int)found[k]);
}

/* Nodes by ascending tag; groups by dimension and tag, with all of their elements in the file's order. */
static PetscErrorCode TestFile(const char text[])
{
  static const PetscInt tag[] = {7, 9, 12, 30, 40, 99};
  static const PetscReal xy[][2] = {{1, 0}, {2, .5}, {1, 1}, {0, 1}, {0, 0}, {5, 5}};
  static const struct {
    const char *name;
    int dim, tag;
    PetscInt n, nv, shapes, id[3], node[6]; /* nodes by their places in tag[] */
  } group[] = {{"corner", 0, 4, 1, 1, 0, {1}, {4}},
               {"edge", 1, 1, 3, 2, 1 << HYCO_LINE2, {5, 6, 4}, {4, 0, 0, 4, 4, 3}},
               {"seam", 1, 2, 1, 2, 1 << HYCO_LINE2, {8}, {0, 2}},
               {"group_1_8", 1, 8, 1, 2, 1 << HYCO_LINE2, {9}, {1, 2}},
               {"plate", 2, 5, 1, 4, 1 << HYCO_QUAD4, {300}, {4, 0, 2, 3}},
               {"wing", 2, 6, 1, 3, 1 << HYCO_TRI3, {20}, {0, 1, 2}}};
  const PetscInt n_groups = (PetscInt)(sizeof(group) / sizeof(group[0]));
  HycoMsh file = {0};

  PetscFunctionBegin;
  PetscCall(Write(text));
  PetscCall(HycoMshRead(path, &file));
  CHECK(file.n_nodes == 6 && file.n_groups == n_groups, "%d nodes, %d groups", (int)file.n_nodes, (int)file.n_groups);
  CheckList("tags", PetscMin(file.n_nodes, 6), file.tag, tag);
  for (PetscInt k = 0; k < 3 * PetscMin(file.n_nodes, 6); k++)
    CHECK_NEAR(file.xyz[k], k % 3 < 2 ? xy[k / 3][k % 3] : 0, 0);
  for (PetscInt g = 0; g < PetscMin(file.n_groups, n_groups); g++) {
    const HycoMshGroup *of = &file.group[g];

    CHECK(!strcmp(of->name, group[g].name) && of->dim == group[g].dim && of->tag == group[g].tag,
          "group %d is %s, dimension %d, tag %d", (int)g, of->name, of->dim, of->tag);
    CHECK(of->n == group[g].n && of->nv == group[g].nv, "%s: %d elements of %d nodes", of->name, (int)of->n,
          (int)of->nv);
    CHECK(!of->dim || of->shapes == group[g].shapes, "%s: shapes %d", of->name, (int)of->shapes);
    if (of->n != group[g].n || of->nv != group[g].nv) continue;
    CheckList(of->name, of->n, of->id, group[g].id);
    CheckList(of->name, of->n * of->nv, of->node, group[g].node);
  }
  PetscCall(HycoMshDestroy(&file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tables: cells and nodes by tag, without node 99; the triangle as a quadrilateral with a repeated node; bodies;
   facets at the boundary, each once, with their cells; the seam's nodes, but no facet. */
static PetscErrorCode TestTables(const char text[])
{
  static const PetscInt node_id[] = {7, 9, 12, 30, 40}, node_body[] = {0, 1, 0, 0, 0}, cell_id[] = {20, 300},
                        cells[] = {0, 1, 2, 2, 4, 0, 2, 3}, cell_body[] = {1, 0},
                        group_start[] = {0, 1, 4, 6, 8, 12, 15},
                        group_node[] = {4, 0, 3, 4, 0, 2, 1, 2, 0, 2, 3, 4, 0, 1, 2},
                        cell_start[] = {0, 0, 0, 0, 0, 1, 2}, group_cell[] = {1, 0}, facet_cell[] = {1, 1, 0},
                        facet_group[] = {1, 1, 3}, facets[] = {4, 0, 4, 3, 1, 2};
  char key[5][32] = {"scene_mesh", "body_plate_young", "body_plate_poisson", "body_wing_young", "body_wing_poisson"};
  char number[2][8] = {"210", "0.3"};
  char *keys[5] = {key[0], key[1], key[2], key[3], key[4]};
  char *values[5] = {path, number[0], number[1], number[0], number[1]};
  HycoScene scene;
  HycoMesh m;

  PetscFunctionBegin;
  PetscCall(Write(text));
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, 5, keys, values, "/", &scene));
  PetscCall(HycoMeshRead(scene, &m));
  CHECK(m->dim == 2 && m->type == HYCO_QUAD4 && m->mixed && m->nv == 4 && m->nf == 2, "dimension %d, type %d",
        (int)m->dim, (int)m->type);
  CHECK(m->n_nodes == 5 && m->n_cells == 2 && m->n_facets == 3 && m->n_groups == 6,
        "%d nodes, %d cells, %d facets, %d groups", (int)m->n_nodes, (int)m->n_cells, (int)m->n_facets,
        (int)m->n_groups);
  if (m->n_nodes == 5 && m->n_cells == 2 && m->n_facets == 3 && m->n_groups == 6) {
    CheckList("node_id", 5, m->node_id, node_id);
    CheckList("node_body", 5, m->node_body, node_body);
    CheckList("cell_id", 2, m->cell_id, cell_id);
    CheckList("cells", 8, m->cells, cells);
    CheckList("cell_body", 2, m->cell_body, cell_body);
    CheckList("group_start", 7, m->group_start, group_start);
    CheckList("group_node", 15, m->group_node, group_node);
    CheckList("group_cell_start", 7, m->group_cell_start, cell_start);
    CheckList("group_cell", 2, m->group_cell, group_cell);
    CheckList("facet_cell", 3, m->facet_cell, facet_cell);
    CheckList("facet_group", 3, m->facet_group, facet_group);
    CheckList("facets", 6, m->facets, facets);
    CHECK(HycoMeshShape(m, 0) == HYCO_TRI3 && HycoMeshShape(m, 1) == HYCO_QUAD4, "shapes %d, %d",
          (int)HycoMeshShape(m, 0), (int)HycoMeshShape(m, 1));
  }
  PetscCall(HycoMeshDestroy(&m));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file with one place of its text replaced is refused, and the message names `text`. */
static PetscErrorCode TestRefused(const char file[], const char from[], const char to[], const char text[])
{
  const char *at = strstr(file, from);
  char changed[4096];
  HycoMsh msh = {0};

  PetscFunctionBegin;
  PetscCheck(at, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s", from);
  PetscCall(PetscSNPrintf(changed, sizeof(changed), "%.*s%s%s", (int)(at - file), file, to, at + strlen(from)));
  PetscCall(Write(changed));
  CHECK_FAILS(HycoMshRead(path, &msh), text);
  PetscCall(HycoMshDestroy(&msh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  static const char *const file[] = {FILE_22, FILE_41};

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/hyco_mesh_file_%ld.msh", getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp",
                          (long)getpid()));
  for (int k = 0; k < 2; k++) {
    PetscCall(TestFile(file[k]));
    PetscCall(TestTables(file[k]));
  }
  PetscCall(TestRefused(FILE_22, "9 12\n10", "9 13\n10", "13")); /* a node that is missing */
  PetscCall(TestRefused(FILE_41, "9 9 12", "9 9 13", "13"));
  PetscCall(TestRefused(FILE_22, "12 1 1 0", "7 1 1 0", "7")); /* a tag twice */
  PetscCall(TestRefused(FILE_41, "7\n12\n", "7\n7\n", "7"));
  PetscCall(TestRefused(FILE_22, "12 1 1 0", "12 1 nan 0", "12")); /* no number */
  PetscCall(TestRefused(FILE_22, "2.2 0 8", "2.1 0 8", "2.1"));
  (void)unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
