/*
  Step 3: many predictions from a model file.

      build/ladder/batch -model rope.h5 -points 8

  HycoROMSolveMany() gives the answers of one HycoROMPredict() after another, in the caller's order and arrays; inside,
  points that share their stiffness share its factor. Nothing but the model file is read.
*/
#include <hyco.h>

/* Points on the diagonal of the parameters' box, ends included: n x n_par, row major. */
static void FillDiagonal(PetscInt n, PetscInt n_par, const PetscReal lo[], const PetscReal hi[], PetscReal mu[])
{
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt p = 0; p < n_par; p++) mu[k * n_par + p] = lo[p] + (hi[p] - lo[p]) * (n > 1 ? k / (n - 1.0) : 0.5);
  }
}

static PetscErrorCode Run(void)
{
  HycoROM model;
  HycoScene scene; /* the one stored in the model */
  HycoPrediction *p;
  PetscInt n = 8, n_par, m;
  const PetscReal *lo, *hi;
  PetscReal *mu, *L;
  char file[PETSC_MAX_PATH_LEN] = "rope.h5";

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-model", file, sizeof(file), NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-points", &n, NULL));
  PetscCall(HycoROMLoad(file, &model));
  PetscCall(HycoROMGetScene(model, &scene));
  PetscCall(HycoSceneGetParameters(scene, &n_par, NULL, &lo, &hi));
  PetscCall(HycoROMGetSizes(model, &m, NULL, NULL));
  PetscCall(PetscMalloc3(n * n_par, &mu, n, &p, n * m, &L));
  FillDiagonal(n, n_par, lo, hi, mu);
  PetscCall(HycoROMSolveMany(model, n, n_par, mu, p, L, NULL)); /* NULL: no displacements */
  for (PetscInt k = 0; k < n; k++) {
    PetscReal largest = 0;

    for (PetscInt i = 0; i < m; i++) largest = PetscMax(largest, L[k * m + i]);
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%.10g,%.10g: %s, force %.10g, largest %.10g\n", (double)mu[k * n_par],
                          n_par > 1 ? (double)mu[k * n_par + 1] : 0., HycoReasonName(p[k].reason),
                          (double)p[k].total_contact_force, (double)largest));
  }
  PetscCall(PetscFree3(mu, p, L));
  PetscCall(HycoROMDestroy(&model));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
