/* Loads and the H1 norm on distorted patches (the unit line, square or cube) of each cell type. */
#include "patch.h"
#include <math.h>

static PetscErrorCode Assemble(const Patch *p, const char key[], const char value[], PetscReal sum[3],
                               PetscReal moment[3], PetscReal *largest)
{
  HycoScene scene;
  HycoMesh mesh = NULL;
  HycoFE fe;
  Vec F;
  const PetscReal *f;

  PetscFunctionBegin;
  PetscCall(PatchLoad(p, key, value, &scene, &mesh, &fe));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, fe->n_dof, &F));
  PetscCall(HycoFEAssembleForce(fe, F));
  PetscCall(VecNorm(F, NORM_INFINITY, largest));
  PetscCall(VecGetArrayRead(F, &f));
  for (int c = 0; c < 3; c++) sum[c] = moment[c] = 0;
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    const PetscReal *x = mesh->xyz + 3 * i;
    PetscReal force[3] = {0, 0, 0};

    for (PetscInt c = 0; c < mesh->dim; c++) sum[c] += force[c] = f[i * mesh->dim + c];
    for (int c = 0; c < 3; c++) moment[c] += x[(c + 1) % 3] * force[(c + 2) % 3] - x[(c + 2) % 3] * force[(c + 1) % 3];
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCall(VecDestroy(&F));
  PetscCall(PatchFree(&scene, &mesh, &fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A constant pressure on a closed surface has no resultant and no moment; with p = x its resultant is
   - integral of grad p = -volume in x (the divergence theorem). */
static PetscErrorCode TestPressure(const Patch *p)
{
  PetscReal sum[3], moment[3], largest;

  PetscFunctionBegin;
  PetscCall(Assemble(p, "pressure_skin", "3", sum, moment, &largest));
  CHECK(largest > 0.1, "the pressure makes nodal forces; the largest is %g", largest);
  for (int c = 0; c < 3; c++) {
    CHECK_NEAR(sum[c], 0, 1e-14);
    CHECK_NEAR(moment[c], 0, 1e-14);
  }
  PetscCall(Assemble(p, "pressure_skin", "x", sum, moment, &largest));
  CHECK_NEAR(sum[0], -p->volume, 1e-14);
  CHECK_NEAR(sum[1], 0, 1e-14);
  CHECK_NEAR(sum[2], 0, 1e-14);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body force sums to force times volume, a traction to traction times the skin's area (2, 4, 6). */
static PetscErrorCode TestForces(const Patch *p)
{
  PetscReal sum[3], moment[3], largest;

  PetscFunctionBegin;
  PetscCall(Assemble(p, "force_block_x", "-2.5", sum, moment, &largest));
  CHECK_NEAR(sum[0], -2.5 * p->volume, 1e-14);
  PetscCall(Assemble(p, "force_block_x", "x", sum, moment, &largest)); /* integral of x over the unit cell: 1/2 */
  CHECK_NEAR(sum[0], 0.5, 1e-14);
  PetscCall(Assemble(p, "traction_skin_x", "1.5", sum, moment, &largest));
  CHECK_NEAR(sum[0], 1.5 * 2 * p->dim, 1e-13);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u = 1 + x in x: |u|^2 = integral (1 + x)^2 = 7/3, |grad u|^2 = 1. The quadrature is exact except on the distorted
   hex8, where the integrand has degree 4 in a direction and two Gauss points are exact up to 3. */
static PetscErrorCode TestH1(const Patch *p)
{
  HycoScene scene;
  HycoMesh mesh = NULL;
  HycoFE fe;
  Mat M;
  Vec u, Mu;
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(PatchLoad(p, NULL, NULL, &scene, &mesh, &fe));
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, mesh->n_nodes, 0, &M));
  PetscCall(HycoFEAssembleH1(fe, 2, M));
  PetscCall(MatCreateVecs(M, &u, &Mu));
  for (PetscInt i = 0; i < mesh->n_nodes; i++)
    PetscCall(VecSetValue(u, i * mesh->dim, 1 + mesh->xyz[3 * i], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(u));
  PetscCall(VecAssemblyEnd(u));
  PetscCall(MatMult(M, u, Mu));
  PetscCall(VecDot(u, Mu, &norm));
  CHECK_NEAR(norm, 7.0 / 3 + 4, p->nv == 8 ? 1e-4 : 1e-12);
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&Mu));
  PetscCall(MatDestroy(&M));
  PetscCall(PatchFree(&scene, &mesh, &fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prescribed displacements: with u = 1 on the skin the lifted force is -K u0: the solution is u = 1 inside too. */
static PetscErrorCode TestLifting(const Patch *p)
{
  HycoScene scene;
  HycoMesh mesh = NULL;
  HycoFE fe;
  Mat K;
  Vec F, u, r;
  PetscReal norm, size;

  PetscFunctionBegin;
  PetscCall(PatchLoad(p, "fixed_skin_x", "1", &scene, &mesh, &fe));
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, mesh->n_nodes, 0, &K));
  PetscCall(HycoFEAssembleStiffness(fe, K));
  PetscCall(MatCreateVecs(K, &u, &F));
  PetscCall(VecDuplicate(F, &r));
  PetscCall(HycoFEAssembleForce(fe, F));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) PetscCall(VecSetValue(u, i * mesh->dim, 1, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(u));
  PetscCall(VecAssemblyEnd(u));
  PetscCall(MatMult(K, u, r));
  PetscCall(VecAXPY(r, -1, F));
  PetscCall(VecNorm(r, NORM_2, &norm));
  PetscCall(VecNorm(F, NORM_2, &size));
  CHECK(size > 1 && norm <= 1e-13 * size, "K u = F to %g of %g", norm, size);
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&r));
  PetscCall(MatDestroy(&K));
  PetscCall(PatchFree(&scene, &mesh, &fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PatchesComplete();
  for (int type = 0; type < HYCO_N_MESH_TYPES; type++) {
    const int before = check_failures;

    PetscCall(TestPressure(&patches[type]));
    PetscCall(TestForces(&patches[type]));
    PetscCall(TestH1(&patches[type]));
    PetscCall(TestLifting(&patches[type]));
    if (check_failures > before) fprintf(stderr, "  these were about %s\n", patches[type].name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
