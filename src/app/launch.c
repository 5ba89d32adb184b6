/* How the ranks were started, and the resources that each may use. */
#include "driver.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* Environment variables in which launchers store the number of ranks. */
static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS",
                                    NULL};

/* The value of one of them before MPI begins, which sets some itself: "NAME=VALUE"; "": one rank, or no launcher. */
static char launched[DRIVER_LINE];

/* PMIX_RANK > 0 shows several processes where no size is given. */
void DriverNoteLaunch(void)
{
  const char *rank = getenv("PMIX_RANK");

  for (int k = 0; sizes[k] && !launched[0]; k++) {
    const char *value = getenv(sizes[k]);

    if (value && atol(value) > 1) snprintf(launched, sizeof(launched), "%s=%s", sizes[k], value);
  }
  if (!launched[0] && rank && atol(rank) > 0) snprintf(launched, sizeof(launched), "PMIX_RANK=%s", rank);
}

/* Before MPI, so that rank 0 is known from the launcher's variables only; the nap lets it speak first. */
PetscBool DriverRefuseEarly(const char text[])
{
  static const char *const ranks[] = {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", NULL};
  const struct timespec nap = {1, 0};

  for (int k = 0; ranks[k]; k++) {
    const char *rank = getenv(ranks[k]);

    /* No variable: a run without a launcher, which speaks for itself. */
    if (!rank || atol(rank) <= 0) continue;
    nanosleep(&nap, NULL); /* a launcher ends all ranks when one has failed */
    return PETSC_FALSE;
  }
  fprintf(stderr, "hyco: error: %s\n", text);
  fflush(stderr);
  return PETSC_FALSE;
}

/* Whether a folder can be created in this one. By trying: permissions, quotas and read-only mounts have no other
   common test. */
static int HoldsFolders(const char *folder)
{
  char path[DRIVER_LINE];
  const int length = snprintf(path, sizeof(path), "%s/hyco-XXXXXX", folder);

  return folder[0] && length > 0 && length < (int)sizeof(path) && mkdtemp(path) && !rmdir(path);
}

/* Open MPI 5 creates a folder for every process, in the first of these variables that is set, and crashes if it
   cannot. */
static void ChooseTemporary(void)
{
  static const char *const asked[] = {"TMPDIR", "TEMP", "TMP", NULL};
  static const char *const others[] = {"/tmp", "/var/tmp", "/dev/shm", ".", NULL};
  const char *folder = NULL;

  for (int k = 0; asked[k] && !folder; k++) folder = getenv(asked[k]);
  /* The folder that Open MPI would take, if it works, is left to the user's choice. */
  if (HoldsFolders(folder ? folder : others[0])) return;
  for (int k = 0; others[k]; k++) {
    if (!HoldsFolders(others[k])) continue;
    setenv("TMPDIR", others[k], 1);
    return;
  }
}

/* A cell's matrix has up to 52 kB, there may be several of them on the stack, and MPI needs some 100 kB. */
#define STACK ((rlim_t)512 * 1024)
#define USUAL ((rlim_t)8 * 1024 * 1024)

/* Some batch systems set a small limit, and libraries then end in a segmentation fault without a line. Asked
   before MPI starts, since a process that has called MPI_Init() cannot start itself again. */
PetscBool DriverHasStack(char **argv)
{
  struct rlimit limit;
  char text[DRIVER_LINE];

  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= STACK)
    return PETSC_TRUE;
  /* The limit may be raised by the process itself. */
  if (limit.rlim_max == RLIM_INFINITY || limit.rlim_max >= STACK) {
    limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || limit.rlim_max > USUAL ? USUAL : limit.rlim_max;
    if (setrlimit(RLIMIT_STACK, &limit) == 0) { /* started again, because threads keep the limit of the start */
      execv("/proc/self/exe", argv);
      return PETSC_TRUE;
    }
  }
  snprintf(text, sizeof(text), "the stack is limited to %ld kB, and %ld kB are needed; raise the limit: ulimit -s 8192",
           (long)(limit.rlim_cur / 1024), (long)(STACK / 1024));
  return DriverRefuseEarly(text);
}

/* Only where no launcher has set its variables; values that the user has set stay (setenv without overwriting). */
void DriverStartAlone(void)
{
  static const char *const launched_by[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_FD", "PMI_ID", NULL};
  static const char *const settings[][2] = {
      /* no daemon, because nothing is spawned, and no folder for its files: Open MPI 4 gives all such runs of a user
         the same folder, and each run removes it while others use it */
      {"OMPI_MCA_ess_singleton_isolated", "1"},
      {"OMPI_MCA_orte_create_session_dirs", "0"},
      /* no communication: no shared memory, no network; if these are missing, Open MPI would print warnings */
      {"OMPI_MCA_btl", "self"},
      /* no search for a fast network: psm2 measures its clock for 0.2 s first */
      {"OMPI_MCA_pml", "ob1"},
      {"OMPI_MCA_if", "^posix_ipv4"},
      {"PMIX_MCA_pif", "^posix_ipv4"},
      {"HWLOC_HIDE_ERRORS", "2"}, /* a chroot without /sys */
  };

  for (int k = 0; launched_by[k]; k++) {
    if (getenv(launched_by[k])) return;
  }
  for (size_t k = 0; k < sizeof(settings) / sizeof(settings[0]); k++) setenv(settings[k][0], settings[k][1], 0);
  ChooseTemporary();
}

/* MPI_Init() of the wrong MPI makes N separate runs, which would write the same files. */
PetscErrorCode DriverCheckLaunch(void)
{
  PetscFunctionBegin;
  HycoCheck(HycoSize(PETSC_COMM_WORLD) > 1 || !launched[0],
            "the launcher started several processes (%s) that are not connected: it belongs to another MPI than "
            "hyco's; use the mpiexec (or srun --mpi=...) of the MPI that PETSc was built with",
            launched);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The library reads its variable when it is loaded; a new start takes 0.05 s. */
void DriverChooseKernels(char **argv)
{
  if (!HycoBLASChooseKernels() && argv)
    execv("/proc/self/exe", argv); /* returns only after a failure: hyco then continues unchanged */
}
