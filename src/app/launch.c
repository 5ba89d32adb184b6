/* How the ranks were started, and what each may use of the machine. */
#include "driver.h"
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

/* Variables by which launchers tell a process how many ranks they have started. */
static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS",
                                    NULL};

/* What one of them said before MPI began, which sets some itself: "NAME=VALUE"; "": one rank, or no launcher. */
static char launched[DRIVER_LINE];

void DriverNoteLaunch(void)
{
  const char *rank = getenv("PMIX_RANK");

  for (int k = 0; sizes[k] && !launched[0]; k++) {
    const char *value = getenv(sizes[k]);

    if (value && atol(value) > 1) snprintf(launched, sizeof(launched), "%s=%s", sizes[k], value);
  }
  if (!launched[0] && rank && atol(rank) > 0) snprintf(launched, sizeof(launched), "PMIX_RANK=%s", rank);
}

PetscErrorCode DriverCheckLaunch(void)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  HycoCheck(size > 1 || !launched[0],
            "the launcher started several ranks (%s), and each is alone: it belongs to another MPI than hyco's; take "
            "the mpiexec (or srun --mpi=...) of the MPI that PETSc was built with",
            launched);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverOneThread(void)
{
  static const char *const asked[] = {"OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "MKL_NUM_THREADS",
                                      "BLIS_NUM_THREADS",     "OMP_NUM_THREADS",  NULL};
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
