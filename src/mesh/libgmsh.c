/* Loads gmsh's library: the one that hyco was built against, by its path, or where the linker finds its name. */
#define _GNU_SOURCE /* RTLD_DEEPBIND, dladdr() */
#include "libgmsh.h"
#include <dlfcn.h>
#include <hycoimpl.h>
#include <string.h>

static const char *const names[] = {
#define HYCO_GMSH_NAME(name) #name,
    HYCO_GMSH_CALLS(HYCO_GMSH_NAME)
#undef HYCO_GMSH_NAME
};
#define N_CALLS (sizeof(names) / sizeof(names[0]))

static union {
  HycoGmsh calls;
  void *address[N_CALLS];
} gmsh;
static PetscBool loaded = PETSC_FALSE;

/* Its symbols are sought first in the 90 libraries that come with it, not in the 110 that come with PETSc: a third of
   the time. Not where malloc() is not libc's (sanitizers, LD_PRELOAD): what the one allocates, the other would free. */
static int HowToLoad(void)
{
#if defined(RTLD_DEEPBIND)
  Dl_info of_malloc, of_libc;

  if (dladdr(dlsym(RTLD_DEFAULT, "malloc"), &of_malloc) && dladdr(dlsym(RTLD_DEFAULT, "getpid"), &of_libc) &&
      of_malloc.dli_fbase == of_libc.dli_fbase)
    return RTLD_LAZY | RTLD_LOCAL | RTLD_DEEPBIND;
#endif
  return RTLD_LAZY | RTLD_LOCAL;
}

PetscErrorCode HycoGmshLoad(const HycoGmsh **calls)
{
  const char *name = strrchr(HYCO_GMSH_LIBRARY, '/');
  void *library;

  PetscFunctionBegin;
  *calls = &gmsh.calls;
  if (loaded) PetscFunctionReturn(PETSC_SUCCESS);
  library = dlopen(HYCO_GMSH_LIBRARY, HowToLoad());
  if (!library && name) library = dlopen(name + 1, HowToLoad());
  HycoCheck(library, "gmsh's library, which reads meshes, cannot be loaded: %s", dlerror());
  for (size_t k = 0; k < N_CALLS; k++) {
    gmsh.address[k] = dlsym(library, names[k]);
    HycoCheck(gmsh.address[k], "gmsh's library %s has no %s()", HYCO_GMSH_LIBRARY, names[k]);
  }
  loaded = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
