/* Stiffness, stress and energy on distorted patches of each cell type. */
#include "patch.h"
#include <math.h>

/* A displacement gradient without symmetry. */
static const double grad[3][3] = {{0.3, -0.7, 0.2}, {0.1, 0.5, -0.4}, {0.6, 0.05, -0.25}};

static void Linear(HycoMesh m, PetscReal u[])
{
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt c = 0; c < m->dim; c++) {
      u[i * m->dim + c] = 0.1 * (double)(c + 1);
      for (PetscInt d = 0; d < m->dim; d++) u[i * m->dim + c] += grad[c][d] * m->xyz[3 * i + d];
    }
  }
}

/* sigma = lambda tr(eps) I + 2 mu eps (plane strain in 2D, E du/dx in 1D), in the library's order of components. */
static double Hooke(int dim, double sigma[6])
{
  const double E = 210, nu = 0.3, lame = E * nu / ((1 + nu) * (1 - 2 * nu)), mu = E / (2 * (1 + nu));
  const int at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
  double trace = 0, energy = 0;

  if (dim == 1) {
    sigma[0] = E * grad[0][0];
    return sigma[0] * grad[0][0] / 2;
  }
  for (int c = 0; c < dim; c++) trace += grad[c][c];
  for (int k = 0; k < (dim == 2 ? 4 : 6); k++) {
    const int i = at[k][0], j = at[k][1], out = i >= dim || j >= dim;
    const double eps = out ? 0 : (grad[i][j] + grad[j][i]) / 2;

    sigma[k] = 2 * mu * eps + (i == j ? lame * trace : 0);
    energy += sigma[k] * eps * (i == j ? 1 : 2) / 2;
  }
  return energy;
}

/* K times translations and infinitesimal rotations vanishes, cell by cell; K is symmetric and not zero. */
static PetscErrorCode TestRigid(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  const PetscInt dim = m->dim, n = m->nv * dim, modes = dim == 1 ? 1 : dim == 2 ? 3 : 6;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], size = 0, worst = 0, skew = 0, u[HYCO_MAX_CELL_DOFS];

    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    for (PetscInt k = 0; k < n; k++) {
      size = fmax(size, fabs(Ke[k * n + k]));
      CHECK(Ke[k * n + k] > 0, "cell %d: diagonal %d is %g", (int)e, (int)k, Ke[k * n + k]);
      for (PetscInt j = 0; j < n; j++) skew = fmax(skew, fabs(Ke[k * n + j] - Ke[j * n + k]));
    }
    for (PetscInt mode = 0; mode < modes; mode++) {
      for (PetscInt k = 0; k < n; k++) {
        const PetscReal *x = fe->X + 3 * m->cells[e * m->nv + k / dim];
        const PetscInt c = k % dim, a = mode - dim, i = dim == 2 ? 0 : (a + 1) % 3, j = dim == 2 ? 1 : (a + 2) % 3;

        u[k] = mode < dim ? (c == mode) : (c == i ? -x[j] : c == j ? x[i] : 0);
      }
      for (PetscInt k = 0; k < n; k++) {
        PetscReal f = 0;

        for (PetscInt j = 0; j < n; j++) f += Ke[k * n + j] * u[j];
        worst = fmax(worst, fabs(f));
      }
    }
    CHECK(worst <= 1e-13 * size, "cell %d: a rigid motion makes a force of %g of %g", (int)e, worst, size);
    CHECK(skew <= 1e-14 * size, "cell %d: not symmetric by %g of %g", (int)e, skew, size);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The patch test (Irons): a linear displacement gives constant stress, the exact energy, no force on inner nodes. */
static PetscErrorCode TestPatch(const Patch *p, HycoFE fe)
{
  HycoMesh m = fe->mesh;
  PetscReal *u, *sigma, *energy, exact[6] = {0}, density, sum = 0;
  const PetscReal *f;
  Mat K;
  Vec U, F;

  PetscFunctionBegin;
  density = Hooke(p->dim, exact);
  PetscCall(PetscMalloc3(fe->n_dof, &u, m->n_cells * fe->n_sigma, &sigma, m->n_cells, &energy));
  Linear(m, u);
  PetscCall(HycoFEStress(fe, u, sigma));
  for (PetscInt k = 0; k < m->n_cells * fe->n_sigma; k++) CHECK_NEAR(sigma[k], exact[k % fe->n_sigma], 1e-11);
  PetscCall(HycoFEEnergy(fe, u, energy));
  for (PetscInt e = 0; e < m->n_cells; e++) sum += energy[e];
  CHECK_NEAR(sum, density * p->volume, 1e-12 * density);
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, m->n_nodes, 0, &K));
  PetscCall(HycoFEAssembleStiffness(fe, K));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, fe->n_dof, u, &U));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(MatMult(K, U, F));
  PetscCall(VecGetArrayRead(F, &f));
  for (PetscInt k = p->first_inner * p->dim; k < fe->n_dof; k++) CHECK_NEAR(f[k], 0, 1e-12 * 210);
  sum = 0;
  for (PetscInt k = 0; k < fe->n_dof; k++) sum += f[k] * u[k] / 2;
  CHECK_NEAR(sum, density * p->volume, 1e-12 * density);
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&U));
  PetscCall(MatDestroy(&K));
  PetscCall(PetscFree3(u, sigma, energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shape functions: a partition of unity, and weights that sum to the reference cell's size. */
static void TestShapes(HycoCellType type)
{
  const double size[HYCO_N_CELL_TYPES] = {2, 0.5, 4, 1.0 / 6, 8, 0.5, 4, 4, 1.0 / 6, 8, 8};
  const HycoElement *el = HycoElementGet(type);
  double weight = 0;

  for (PetscInt q = 0; q < el->nq; q++) {
    double sum = 0, slope[3] = {0, 0, 0};

    weight += el->w[q];
    for (PetscInt a = 0; a < el->nv; a++) {
      sum += el->N[q][a];
      for (PetscInt c = 0; c < el->dim; c++) slope[c] += el->dN[q][a][c];
    }
    CHECK_NEAR(sum, 1, 1e-15);
    for (PetscInt c = 0; c < el->dim; c++) CHECK_NEAR(slope[c], 0, 1e-15);
  }
  CHECK_NEAR(weight, size[type], 1e-14);
}

/* A dilatation that varies in the cells: the energies from K and from the cells agree. */
static PetscErrorCode TestEnergy(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscReal *u, *energy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(fe->n_dof, &u, m->n_cells, &energy));
  for (PetscInt i = 0; i < fe->n_dof; i++) u[i] = sin(1 + 2.3 * (double)i);
  PetscCall(HycoFEEnergy(fe, u, energy));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], sum = 0;
    const PetscInt *node = m->cells + e * m->nv;

    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    for (PetscInt k = 0; k < n; k++) {
      for (PetscInt j = 0; j < n; j++)
        sum +=
            u[node[k / m->dim] * m->dim + k % m->dim] * Ke[k * n + j] * u[node[j / m->dim] * m->dim + j % m->dim] / 2;
    }
    CHECK_NEAR(energy[e], sum, 1e-12 * fabs(sum));
  }
  PetscCall(PetscFree2(u, energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The element bbar: for quad4 and hex8 it passes the tests of the standard one; for the others it is refused. */
static PetscErrorCode TestMeanDilatation(void)
{
  PetscFunctionBegin;
  for (int type = 0; type < HYCO_N_MESH_TYPES; type++) {
    HycoScene scene = NULL;
    HycoMesh mesh = NULL;
    HycoFE fe = NULL;
    PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], Kb[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], apart = 0;

    if (type != HYCO_QUAD4 && type != HYCO_HEX8) {
      CHECK_FAILS(PatchLoad(&patches[type], "body_block_element", "bbar", &scene, &mesh, &fe), "is for quad4 and hex8");
      PetscCall(PatchFree(&scene, &mesh, &fe));
      continue;
    }
    PetscCall(PatchLoad(&patches[type], NULL, NULL, &scene, &mesh, &fe));
    PetscCall(HycoFEElementStiffness(fe, 0, Ke));
    PetscCall(PatchFree(&scene, &mesh, &fe));
    PetscCall(PatchLoad(&patches[type], "body_block_element", "bbar", &scene, &mesh, &fe));
    PetscCall(TestRigid(fe));
    PetscCall(TestPatch(&patches[type], fe));
    PetscCall(TestEnergy(fe));
    PetscCall(HycoFEElementStiffness(fe, 0, Kb));
    for (int k = 0; k < 64; k++) apart = fmax(apart, fabs(Ke[k] - Kb[k]));
    CHECK(apart > 1, "%s: the entry changes nothing (%g)", patches[type].name, apart);
    PetscCall(PatchFree(&scene, &mesh, &fe));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The energy of the linear displacement on a DM, whose only reference then is fe's. */
static PetscErrorCode EnergyOf(HycoScene scene, DM *dm, double expected)
{
  PetscReal mu[1] = {0}, *u, *energy, sum = 0;
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(HycoFECreate(scene, *dm, &fe));
  PetscCall(DMDestroy(dm));
  PetscCall(HycoFESetParameters(fe, mu));
  PetscCall(PetscMalloc2(fe->n_dof, &u, fe->mesh->n_cells, &energy));
  Linear(fe->mesh, u);
  PetscCall(HycoFEEnergy(fe, u, energy));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) sum += energy[e];
  CHECK_NEAR(sum, expected, 1e-12 * expected);
  PetscCall(PetscFree2(u, energy));
  PetscCall(HycoFEDestroy(&fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A DMPlex of two unit squares that PETSc made, with labels for groups, and the submesh of its second cell: fe is on either,
   and both have their own tables. */
static PetscErrorCode TestDM(void)
{
  const PetscInt cell[8] = {0, 1, 4, 3, 1, 2, 5, 4}, second = 1;
  const PetscReal xy[12] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
  PetscReal stress[6];
  const double density = Hooke(2, stress);
  HycoMesh mesh = NULL, of, again, sub;
  HycoScene scene;
  DMLabel label;
  HycoFE fe;
  DM dm;

  PetscFunctionBegin;
  PetscCall(PatchLoad(&patches[HYCO_QUAD4], NULL, NULL, &scene, &mesh, &fe));
  PetscCall(DMPlexCreateFromCellListPetsc(PETSC_COMM_SELF, 2, 2, 6, 4, PETSC_TRUE, cell, 2, xy, &dm));
  PetscCall(DMSetLabelValue(dm, "block", 0, 1));
  PetscCall(DMSetLabelValue(dm, "block", 1, 1));
  PetscCall(DMCreateLabel(dm, "skin"));
  PetscCall(DMGetLabel(dm, "skin", &label));
  PetscCall(DMPlexMarkBoundaryFaces(dm, 1, label));
  PetscCall(HycoMeshOf(dm, scene, &of));
  PetscCall(HycoMeshOf(dm, scene, &again));
  CHECK(of == again && of->dm == dm && of->n_cells == 2 && of->n_facets == 6, "%d cells, %d facets", (int)of->n_cells,
        (int)of->n_facets);
  PetscCall(HycoSubmesh(scene, of, 1, &second, 0, NULL, 0, NULL, &sub));
  PetscCall(EnergyOf(scene, &dm, 2 * density));
  CHECK(sub->n_nodes == 4 && sub->n_facets == 3, "%d nodes, %d facets", (int)sub->n_nodes, (int)sub->n_facets);
  PetscCall(EnergyOf(scene, &sub->dm, density));
  PetscCall(PatchFree(&scene, &mesh, &fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM of tables that come from a file: the tables made from it anew are the same, with facets that have no cell. */
static PetscErrorCode TestLoaded(const Patch *p)
{
  HycoMesh mesh = NULL, sub, again;
  PetscInt skin, keep = 0;
  HycoScene scene;
  HycoFE fe;
  DM dm;

  PetscFunctionBegin;
  PetscCall(PatchLoad(p, NULL, NULL, &scene, &mesh, &fe));
  PetscCall(HycoMeshFindGroup(mesh, "test", "skin", &skin));
  PetscCall(HycoSubmesh(scene, mesh, 1, &keep, 0, NULL, 1, &skin, &sub));
  PetscCall(HycoMeshDetach(sub)); /* as it is read from a file */
  PetscCall(HycoMeshCreateDM(scene, sub));
  dm = sub->dm;
  PetscCall(PetscObjectReference((PetscObject)dm));
  PetscCall(HycoMeshDetach(sub));
  PetscCall(HycoMeshOf(dm, scene, &again));
  CHECK(again != sub && again->n_nodes == sub->n_nodes && again->n_facets == p->n_facets && again->n_cells == 1,
        "%s: %d nodes, %d facets", p->name, (int)again->n_nodes, (int)again->n_facets);
  for (PetscInt f = 0; f < p->n_facets * sub->nf; f++)
    CHECK(again->facets[f] == sub->facets[f] && again->facet_cell[f / sub->nf] == sub->facet_cell[f / sub->nf],
          "%s: facet %d differs", p->name, (int)(f / sub->nf));
  PetscCall(DMDestroy(&dm));
  PetscCall(HycoMeshDestroy(&sub));
  PetscCall(PatchFree(&scene, &mesh, &fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PatchesComplete();
  PetscCall(TestMeanDilatation());
  PetscCall(TestDM());
  PetscCall(TestLoaded(&patches[HYCO_QUAD4]));
  PetscCall(TestLoaded(&patches[HYCO_TET10]));
  for (int type = 0; type < HYCO_N_MESH_TYPES; type++) {
    HycoScene scene;
    HycoMesh mesh = NULL;
    HycoFE fe;
    const int before = check_failures;

    PetscCall(PatchLoad(&patches[type], NULL, NULL, &scene, &mesh, &fe));
    PetscCall(TestEnergy(fe));
    CHECK(mesh->type == (HycoCellType)type, "expected type %d, found %d", type, (int)mesh->type);
    TestShapes((HycoCellType)type);
    PetscCall(TestRigid(fe));
    PetscCall(TestPatch(&patches[type], fe));
    PetscCall(PatchFree(&scene, &mesh, &fe));
    if (check_failures > before) fprintf(stderr, "  these were about %s\n", patches[type].name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
