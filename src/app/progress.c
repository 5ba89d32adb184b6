/* What a person at the terminal sees while it runs. */
#include "driver.h"
#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

PetscErrorCode Say(const char format[], ...)
{
  PetscMPIInt rank;
  va_list args;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank == 0) {
    va_start(args, format);
    vfprintf(stdout, format, args);
    va_end(args);
    fflush(stdout);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DriverPercent(PetscReal share, char text[32])
{
  const double percent = 100 * (double)share;

  snprintf(text, 32, percent >= 99.5 && percent < 1e6 ? "%.0f %%" : "%.2g %%", percent);
}

PetscErrorCode DriverProgress(PetscInt done, PetscInt n, void *ctx)
{
  static PetscReal begin = -1, last = -1;
  static PetscInt first = 0;
  const PetscReal now = HycoNow();
  const int terminal = isatty(STDERR_FILENO);
  PetscReal left;

  PetscFunctionBegin;
  if (begin < 0 || done < first) {
    begin = last = now;
    first = done;
  }
  left = done > first ? (now - begin) / (done - first) * (n - done) : 0;
  if (done == n || now - last > (terminal ? 0.2 : 10)) {
    last = now;
    fprintf(stderr, "%s%s %d of %d, %.0f s left%s", terminal ? "\r\033[K" : "", (const char *)ctx, (int)done, (int)n,
            (double)left, terminal && done < n ? "" : "\n");
    fflush(stderr);
  }
  if (done == n) begin = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReadMonitor(PetscBool *monitor)
{
  PetscFunctionBegin;
  *monitor = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-hyco_monitor", "a line per iteration of the active set", monitor));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverMonitor(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx)
{
  PetscFunctionBegin;
  (void)ctx;
  PetscCall(Say("  active set, iteration %d: %d active, %d to change\n", (int)iteration, (int)n_active, (int)changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}
