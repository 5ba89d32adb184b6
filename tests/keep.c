/* Loaded by every program under sanitizers: keeps opened libraries loaded. LeakSanitizer runs at the very end, when
   Open MPI has closed its plug-ins: it could not resolve the names of their functions, and would read the process's
   memory map again for each such address, which takes most of its time. */
#include <dlfcn.h>

int dlclose(void *handle)
{
  (void)handle;
  return 0;
}
