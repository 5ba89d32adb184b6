/* How the ranks were started, and what each may use of the machine. */
#include "driver.h"
#include <dlfcn.h>

/* Variables by which launchers tell a process how many ranks they have started. */
static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS", NULL};

PetscErrorCode DriverCheckLaunch(void)
{
  PetscMPIInt size;
  const char *rank = getenv("PMIX_RANK"), *said = NULL;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size > 1) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; sizes[k] && !said; k++) {
    const char *value = getenv(sizes[k]);

    if (value && atol(value) > 1) said = sizes[k];
  }
  if (!said && rank && atol(rank) > 0) said = "PMIX_RANK";
  HycoCheck(!said,
            "the launcher started several ranks (%s=%s), and each is alone: it belongs to another MPI than hyco's; take "
            "the mpiexec (or srun --mpi=...) of the MPI that PETSc was built with",
            said, said ? getenv(said) : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverOneThread(void)
{
  static const char *const asked[] = {"OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS",
                                      "OMP_NUM_THREADS", NULL};
  static const char *const setters[] = {"openblas_set_num_threads", "MKL_Set_Num_Threads", NULL};
  union {
    void *address;
    void (*set)(int);
  } call;

  for (int k = 0; asked[k]; k++) {
    if (getenv(asked[k])) return;
  }
  for (int k = 0; setters[k]; k++) {
    call.address = dlsym(RTLD_DEFAULT, setters[k]);
    if (call.address) call.set(1);
  }
}
