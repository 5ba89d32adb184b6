/*
  A contact law of one's own: a threshold of friction, |r_t| <= g (Tresca), on the contacts of a plane scene.

      build/ladder/cone -scene examples/roller -mu 1,0.6,12 -threshold 0.1

  A law is a projection onto the admissible forces of a block, here (r_n, r_t), and its derivative. The scene gives the
  system without friction; each of its rows becomes two, and the solver of the type semismooth takes any law. The load is
  applied in one step from rest. hyco recomputes the residuals by the same projection.
*/
#include <hyco.h>

/* z = (max(y_n, 0), y_t within the threshold) */
static PetscErrorCode Project(HycoCone cone, const PetscReal g[], const PetscReal y[], PetscReal z[])
{
  PetscFunctionBeginUser;
  (void)cone;
  z[0] = PetscMax(y[0], 0);
  z[1] = PetscMax(-g[0], PetscMin(y[1], g[0]));
  PetscFunctionReturn(0);
}

static PetscErrorCode Derivative(HycoCone cone, const PetscReal g[], const PetscReal y[], PetscReal J[])
{
  PetscFunctionBeginUser;
  (void)cone;
  J[0] = y[0] > 0;
  J[1] = J[2] = 0;
  J[3] = PetscAbsReal(y[1]) < g[0];
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateThreshold(HycoCone cone)
{
  PetscFunctionBeginUser;
  PetscCall(HycoConeSetOps(cone, &(struct _HycoConeOps){.project = Project, .derivative = Derivative}, 1));
  PetscFunctionReturn(0);
}

/* Rows 2 i and 2 i + 1: row i of B, and the same turned by a right angle: (b_x, b_y) becomes (-b_y, b_x). */
static PetscErrorCode AddTangents(Mat B, Mat *both)
{
  PetscInt lo, hi, columns;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(B, &lo, &hi));
  PetscCall(MatGetLocalSize(B, NULL, &columns));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, 2 * (hi - lo), columns, PETSC_DETERMINE, PETSC_DETERMINE, 16, NULL, 16, NULL,
                         both));
  for (PetscInt i = 2 * lo; i < 2 * hi; i++) {
    PetscInt n;
    const PetscInt *column;
    const PetscScalar *b;

    PetscCall(MatGetRow(B, i / 2, &n, &column, &b));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt turn = i % 2 == 0 ? 0 : column[k] % 2 == 0 ? 1 : -1;

      PetscCall(MatSetValue(*both, i, column[k] + turn, turn < 0 ? -b[k] : b[k], INSERT_VALUES));
    }
    PetscCall(MatRestoreRow(B, i / 2, &n, &column, &b));
  }
  PetscCall(MatAssemblyBegin(*both, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*both, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

/* The system of the scene with two rows for each contact, and the same threshold in all of them. */
static PetscErrorCode AddFriction(HycoSystem plain, PetscReal g, HycoSystem *system, Vec *x, Vec *L)
{
  Mat K, B, both, transposed;
  Vec F, D, gaps;
  HycoCone cone;
  PetscInt rows;
  PetscReal *data;

  PetscFunctionBeginUser;
  PetscCall(HycoSystemGetMatrices(plain, &K, NULL, &B));
  PetscCall(HycoSystemGetVectors(plain, &F, &D));
  PetscCall(AddTangents(B, &both));
  PetscCall(MatCreateVecs(both, x, &gaps));
  PetscCall(VecSetBlockSize(gaps, 2));
  PetscCall(VecStrideScatter(D, 0, gaps, INSERT_VALUES)); /* slip is counted from rest */
  PetscCall(VecDuplicate(gaps, L));
  PetscCall(MatTranspose(both, MAT_INITIAL_MATRIX, &transposed));
  PetscCall(HycoConeCreate(PETSC_COMM_WORLD, &cone));
  PetscCall(HycoConeSetSize(cone, 2));
  PetscCall(HycoConeSetType(cone, "threshold"));
  PetscCall(HycoSystemCreate(PETSC_COMM_WORLD, system));
  PetscCall(HycoSystemSetMatrices(*system, K, transposed, both, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(*system, F, gaps));
  PetscCall(MatGetLocalSize(B, &rows, NULL));
  PetscCall(PetscMalloc1(rows, &data));
  for (PetscInt i = 0; i < rows; i++) data[i] = g;
  PetscCall(HycoSystemSetBlocks(*system, 1, &cone, rows, NULL, data));
  PetscCall(PetscFree(data));
  PetscCall(HycoConeDestroy(&cone));
  PetscCall(MatDestroy(&both));
  PetscCall(MatDestroy(&transposed));
  PetscCall(VecDestroy(&gaps));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoScene scene;
  HycoFOM fom;
  HycoSystem plain, system;
  HycoSolver solver;
  Vec x, L;
  char folder[PETSC_MAX_PATH_LEN] = "examples/roller";
  PetscReal mu[8], g = 0.1, normal, tangential, largest;
  PetscInt n = 8;

  PetscFunctionBeginUser;
  PetscCall(HycoConeRegister("threshold", CreateThreshold));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-scene", folder, sizeof(folder), NULL));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-threshold", &g, NULL));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSystem(fom, &plain));
  PetscCall(AddFriction(plain, g, &system, &x, &L));
  PetscCall(HycoSolverCreate(PETSC_COMM_WORLD, &solver));
  PetscCall(HycoSolverSetType(solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoSolverSetOptionsPrefix(solver, "friction_"));
  PetscCall(HycoSolverSetFromOptions(solver));
  PetscCall(HycoSolverSetSystem(solver, system));
  PetscCall(HycoSolverSolve(solver, x, L));
  PetscCall(HycoSolverView(solver, NULL));
  PetscCall(VecStrideNorm(L, 0, NORM_1, &normal));
  PetscCall(VecStrideNorm(L, 1, NORM_1, &tangential));
  PetscCall(VecStrideNorm(L, 1, NORM_INFINITY, &largest));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "normal forces %.10g, tangential %.10g, largest %.10g\n", (double)normal,
                        (double)tangential, (double)largest));
  PetscCall(HycoSolverDestroy(&solver));
  PetscCall(HycoSystemDestroy(&system));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&L));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
