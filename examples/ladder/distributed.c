/*
  Step 4: on several ranks.

      mpiexec -n 2 build/ladder/distributed -scene examples/pellet -mu 4.06,1

  A full-order model spreads mesh, matrices and vectors over its communicator; every call on it is collective, and gives
  the same answers on any number of ranks. Each rank works on the rows that it owns, as here; sums over all come by MPI,
  the solution in the mesh file's order by HycoFOMGetSolution() on rank 0.
*/
#include <hyco.h>

/* Each rank's part of the stiffness matrix, in the order of the ranks. */
static PetscErrorCode PrintRows(Mat K)
{
  PetscInt first, last, n;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(MatGetOwnershipRange(K, &first, &last));
  PetscCall(PetscSynchronizedPrintf(PETSC_COMM_WORLD, "this rank owns the rows %d to %d of %d\n", (int)first,
                                    (int)last - 1, (int)n));
  PetscCall(PetscSynchronizedFlush(PETSC_COMM_WORLD, PETSC_STDOUT));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoScene scene;
  HycoFOM fom;
  HycoSystem system;
  HycoSummary s;
  Mat K;
  char folder[PETSC_MAX_PATH_LEN] = "examples/pellet";
  PetscReal mu[2] = {4.06, 1}, sum = 0;
  const PetscReal *L;
  PetscInt n = 2, m;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-scene", folder, sizeof(folder), NULL));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n, NULL));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, 2, mu));
  PetscCall(HycoFOMGetSystem(fom, &system)); /* borrowed: K, B, F, D of the last solve */
  PetscCall(HycoSystemGetMatrices(system, &K, NULL, NULL));
  PetscCall(PrintRows(K));
  PetscCall(HycoFOMGetSummary(fom, &s));                              /* collective: the same numbers on every rank */
  PetscCall(HycoFOMGetSolution(fom, NULL, NULL, &m, &L, NULL, NULL)); /* on rank 0; none elsewhere */
  for (PetscInt i = 0; i < m; i++) sum += L[i];
  PetscCallMPI(MPI_Bcast(&sum, 1, MPIU_REAL, 0, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: force %.10g, the sum of the gathered ones %.10g\n",
                        HycoReasonName(s.reason), (double)s.total_contact_force, (double)sum));
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
