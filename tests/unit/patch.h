/* A patch of distorted cells of each type, written as a gmsh 2.2 file and read back by the library. */
#ifndef PATCH_H
#define PATCH_H

#include "check.h"
#include <hycofe.h>
#include <unistd.h>

typedef struct {
  const char *name;
  int dim, nv, nf, gmsh_cell, gmsh_facet, n_nodes, n_cells, n_facets, first_inner; /* inner nodes: the last ones */
  double xyz[96][3];
  int cell[12][27], facet[14][9];
  double volume; /* of the whole patch: 1 */
} Patch;

#define PATCH_CUBE                                                                                                     \
  {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1},                                         \
  {                                                                                                                    \
    0, 1, 1                                                                                                            \
  }

/* The unit square in two quadrilaterals, nodes at the middles of their sides, the last one between them. */
#define PATCH_PAIR                                                                                                     \
  {0, 0}, {0.4, 0}, {1, 0}, {1, 1}, {0.6, 1}, {0, 1}, {0.2, 0}, {0.7, 0}, {1, 0.5}, {0.8, 1}, {0.3, 1}, {0, 0.5},      \
  {                                                                                                                    \
    0.5, 0.5                                                                                                           \
  }

/* Inner nodes: MacNeal, Harder, Finite Elem. Anal. Des. 1 (1985) 3-20, for hex8; otherwise off the centre. Facets
   are written without consistent orientation: the library orients them outward. */
static Patch patches[HYCO_N_CELL_TYPES] = {
    {"line2", 1, 2, 1, 1, 15, 4, 3, 2, 2, {{0}, {1}, {0.2}, {0.75}}, {{0, 2}, {2, 3}, {3, 1}}, {{0}, {1}}, 1},
    {"tri3",
     2,
     3,
     2,
     2,
     1,
     5,
     4,
     4,
     4,
     {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.35, 0.6}},
     {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
     {{0, 1}, {2, 1}, {2, 3}, {0, 3}},
     1},
    {"quad4",
     2,
     4,
     2,
     3,
     1,
     8,
     5,
     4,
     4,
     {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.2, 0.15}, {0.8, 0.3}, {0.7, 0.75}, {0.25, 0.6}},
     {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}, {4, 5, 6, 7}},
     {{0, 1}, {2, 1}, {2, 3}, {0, 3}},
     1},
    {"tet4",
     3,
     4,
     3,
     4,
     2,
     9,
     12,
     12,
     8,
     {PATCH_CUBE, {0.4, 0.55, 0.3}},
     {{0, 2, 1, 8},
      {0, 3, 2, 8},
      {4, 5, 6, 8},
      {4, 6, 7, 8},
      {0, 1, 5, 8},
      {0, 5, 4, 8},
      {1, 2, 6, 8},
      {1, 6, 5, 8},
      {2, 3, 7, 8},
      {2, 7, 6, 8},
      {3, 0, 4, 8},
      {3, 4, 7, 8}},
     {{0, 1, 2},
      {0, 3, 2},
      {4, 5, 6},
      {4, 7, 6},
      {0, 1, 5},
      {0, 4, 5},
      {1, 2, 6},
      {1, 5, 6},
      {2, 3, 7},
      {2, 6, 7},
      {3, 0, 4},
      {3, 7, 4}},
     1},
    {"hex8",
     3,
     8,
     4,
     5,
     3,
     16,
     7,
     6,
     8,
     {PATCH_CUBE,
      {0.249, 0.342, 0.192},
      {0.826, 0.288, 0.288},
      {0.850, 0.649, 0.263},
      {0.273, 0.750, 0.230},
      {0.320, 0.186, 0.643},
      {0.677, 0.305, 0.683},
      {0.788, 0.693, 0.644},
      {0.165, 0.745, 0.702}},
     {{0, 1, 2, 3, 8, 9, 10, 11},
      {12, 13, 14, 15, 4, 5, 6, 7},
      {0, 1, 9, 8, 4, 5, 13, 12},
      {1, 2, 10, 9, 5, 6, 14, 13},
      {2, 3, 11, 10, 6, 7, 15, 14},
      {3, 0, 8, 11, 7, 4, 12, 15},
      {8, 9, 10, 11, 12, 13, 14, 15}},
     {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}},
     1},
    {"tri6",
     2,
     6,
     3,
     9,
     8,
     9,
     2,
     4,
     8,
     {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 0}, {1, 0.5}, {0.5, 1}, {0, 0.5}, {0.5, 0.5}},
     {{0, 1, 2, 4, 5, 8}, {0, 2, 3, 8, 6, 7}},
     {{0, 1, 4}, {2, 1, 5}, {2, 3, 6}, {0, 3, 7}},
     1},
    {"quad8",
     2,
     8,
     3,
     16,
     8,
     13,
     2,
     6,
     12,
     {PATCH_PAIR},
     {{0, 1, 4, 5, 6, 12, 10, 11}, {1, 2, 3, 4, 7, 8, 9, 12}},
     {{0, 1, 6}, {1, 2, 7}, {3, 2, 8}, {3, 4, 9}, {4, 5, 10}, {0, 5, 11}},
     1},
    {"quad9",
     2,
     9,
     3,
     10,
     8,
     15,
     2,
     6,
     12,
     {PATCH_PAIR, {0.25, 0.5}, {0.75, 0.5}},
     {{0, 1, 4, 5, 6, 12, 10, 11, 13}, {1, 2, 3, 4, 7, 8, 9, 12, 14}},
     {{0, 1, 6}, {1, 2, 7}, {3, 2, 8}, {3, 4, 9}, {4, 5, 10}, {0, 5, 11}},
     1},
};

/* -- second order in 3D: the first-order patches with nodes at the middles of edges, for hex27 also of faces and
   cells, in gmsh's order (gmsh 4.11 manual, "Node ordering") -- */

typedef struct {
  int n, corner[8];
} PatchPart;

static const PatchPart patch_tet10[] = {{2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}, {2, {3, 0}}, {2, {2, 3}}, {2, {1, 3}}};
static const PatchPart patch_hex27[] = {{2, {0, 1}},
                                        {2, {0, 3}},
                                        {2, {0, 4}},
                                        {2, {1, 2}},
                                        {2, {1, 5}},
                                        {2, {2, 3}},
                                        {2, {2, 6}},
                                        {2, {3, 7}},
                                        {2, {4, 5}},
                                        {2, {4, 7}},
                                        {2, {5, 6}},
                                        {2, {6, 7}},
                                        {4, {0, 3, 2, 1}},
                                        {4, {0, 1, 5, 4}},
                                        {4, {0, 4, 7, 3}},
                                        {4, {1, 2, 6, 5}},
                                        {4, {2, 3, 7, 6}},
                                        {4, {4, 5, 6, 7}},
                                        {8, {0, 1, 2, 3, 4, 5, 6, 7}}};
static const PatchPart patch_tri6[] = {{2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}};
static const PatchPart patch_quad9[] = {{2, {0, 1}}, {2, {1, 2}}, {2, {2, 3}}, {2, {3, 0}}, {4, {0, 1, 2, 3}}};

/* The node at the middle of these corners, whose coordinates are in p; new nodes get the next numbers. */
static inline int PatchMiddle(Patch *p, int first, const PatchPart *part, const int corner[])
{
  double x[3] = {0, 0, 0};

  for (int k = 0; k < part->n; k++) {
    for (int c = 0; c < 3; c++) x[c] += p->xyz[corner[part->corner[k]]][c] / part->n;
  }
  for (int i = first; i < p->n_nodes; i++) { /* coordinates identify nodes, because the patches are distorted */
    double off = 0;

    for (int c = 0; c < 3; c++) off += (p->xyz[i][c] - x[c]) * (p->xyz[i][c] - x[c]);
    if (off < 1e-20) return i;
  }
  for (int c = 0; c < 3; c++) p->xyz[p->n_nodes][c] = x[c];
  return p->n_nodes++;
}

static inline void PatchRaise(const Patch *of, const char name[], int nv, int nf, int gmsh_cell, int gmsh_facet,
                              const PatchPart in_cell[], const PatchPart in_facet[], Patch *p)
{
  const int corners = of->nv, facet_corners = of->nf, n_inner = of->n_nodes - of->first_inner;
  int at[16];

  *p = *of;
  p->name = name;
  p->nv = nv;
  p->nf = nf;
  p->gmsh_cell = gmsh_cell;
  p->gmsh_facet = gmsh_facet;
  p->n_nodes = of->first_inner;
  for (int f = 0; f < p->n_facets; f++) {
    for (int k = facet_corners; k < nf; k++)
      p->facet[f][k] = PatchMiddle(p, of->first_inner, &in_facet[k - facet_corners], p->facet[f]);
  }
  p->first_inner = p->n_nodes;
  for (int i = 0; i < of->n_nodes; i++) at[i] = i < of->first_inner ? i : p->n_nodes + i - of->first_inner;
  for (int i = 0; i < n_inner; i++) {
    for (int c = 0; c < 3; c++) p->xyz[p->first_inner + i][c] = of->xyz[of->first_inner + i][c];
  }
  p->n_nodes += n_inner;
  for (int e = 0; e < p->n_cells; e++) {
    for (int k = 0; k < corners; k++) p->cell[e][k] = at[of->cell[e][k]];
    for (int k = corners; k < nv; k++)
      p->cell[e][k] = PatchMiddle(p, of->first_inner, &in_cell[k - corners], p->cell[e]);
  }
}

/* Creates the patches of second order in 3D. */
static inline void PatchesComplete(void)
{
  PatchRaise(&patches[HYCO_TET4], "tet10", 10, 6, 11, 9, patch_tet10, patch_tri6, &patches[HYCO_TET10]);
  PatchRaise(&patches[HYCO_HEX8], "hex20", 20, 8, 17, 16, patch_hex27, patch_quad9, &patches[HYCO_HEX20]);
  PatchRaise(&patches[HYCO_HEX8], "hex27", 27, 9, 12, 10, patch_hex27, patch_quad9, &patches[HYCO_HEX27]);
}

static inline PetscErrorCode PatchWrite(const Patch *p, const char path[])
{
  FILE *out = fopen(path, "w");

  PetscFunctionBegin;
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s", path);
  fprintf(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n%d 1 \"skin\"\n%d 2 \"block\"\n", p->dim - 1,
          p->dim);
  fprintf(out, "$EndPhysicalNames\n$Nodes\n%d\n", p->n_nodes);
  for (int i = 0; i < p->n_nodes; i++)
    fprintf(out, "%d %.17g %.17g %.17g\n", i + 1, p->xyz[i][0], p->xyz[i][1], p->xyz[i][2]);
  fprintf(out, "$EndNodes\n$Elements\n%d\n", p->n_facets + p->n_cells);
  for (int e = 0; e < p->n_facets + p->n_cells; e++) {
    const int skin = e < p->n_facets, *node = skin ? p->facet[e] : p->cell[e - p->n_facets];

    fprintf(out, "%d %d 2 %d %d", e + 1, skin ? p->gmsh_facet : p->gmsh_cell, skin ? 1 : 2, skin ? 1 : 2);
    for (int a = 0; a < (skin ? p->nf : p->nv); a++) fprintf(out, " %d", node[a] + 1);
    fprintf(out, "\n");
  }
  fprintf(out, "$EndElements\n");
  PetscCheck(fclose(out) == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene (body "block", E = 210, nu = 0.3 unless 1D, and the given extra entry) on the patch. */
static inline PetscErrorCode PatchLoad(const Patch *p, const char key[], const char value[], HycoScene *scene,
                                       HycoMesh *mesh, HycoFE *fe)
{
  char path[256];
  char *keys[4], *values[4];
  const char *k[4] = {"scene_mesh", "body_block_young", key ? key : "body_block_poisson", "body_block_poisson"};
  const char *v[4] = {path, "210", key ? value : "0.3", "0.3"};
  const PetscInt n = p->dim == 1 ? (key ? 3 : 2) : (key ? 4 : 3);

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "/tmp/hyco_patch_%s_%ld.msh", p->name, (long)getpid());
  PetscCall(PatchWrite(p, path));
  for (PetscInt i = 0; i < 4; i++) {
    PetscCall(PetscStrallocpy(k[i], &keys[i]));
    PetscCall(PetscStrallocpy(v[i], &values[i]));
  }
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, n, keys, values, "/", scene));
  for (PetscInt i = 0; i < 4; i++) {
    PetscCall(PetscFree(keys[i]));
    PetscCall(PetscFree(values[i]));
  }
  PetscCall(HycoMeshCreate(PETSC_COMM_SELF, *scene, mesh));
  unlink(path);
  PetscCall(HycoFECreate(*scene, (*mesh)->dm, fe));
  PetscCall(HycoFESetParameters(*fe, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode PatchFree(HycoScene *scene, HycoMesh *mesh, HycoFE *fe)
{
  PetscFunctionBegin;
  PetscCall(HycoFEDestroy(fe));
  PetscCall(HycoMeshDestroy(mesh));
  PetscCall(HycoSceneDestroy(scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
