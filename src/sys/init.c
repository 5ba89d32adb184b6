/* Start and end of the package. */
#include <hycoimpl.h>
#include <slepcsys.h>

static PetscBool began_petsc = PETSC_FALSE;

PetscErrorCode HycoInitialize(int *argc, char ***argv)
{
  PetscBool petsc, slepc;
  PetscErrorCode ierr;

  ierr = PetscInitialized(&petsc);
  if (ierr) return ierr;
  if (!petsc) {
    ierr = PetscInitialize(argc, argv, NULL, NULL);
    if (ierr) return ierr;
    began_petsc = PETSC_TRUE;
  }
  ierr = SlepcInitialized(&slepc);
  if (ierr || slepc) return ierr;
  return SlepcInitialize(argc, argv, NULL, NULL);
}

PetscErrorCode HycoFinalize(void)
{
  PetscErrorCode ierr = SlepcFinalize();

  if (ierr) return ierr;
  return began_petsc ? PetscFinalize() : 0;
}

const char *HycoVersion(void)
{
  return HYCO_VERSION;
}
