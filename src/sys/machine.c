/* Checks of the environment: a locale with a decimal point, memory of the machine and for BLAS. */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include <hycoimpl.h>
#include <locale.h>
#include <petscblaslapack.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

/* OpenBLAS allocates this much address space at its first call, and tries without end if it cannot. */
#define BLAS_BUFFER (((size_t)136) << 20)

/* For this thread alone, and cheaply: setlocale() would change the whole program. NULL: nothing is to be restored. */
void *HycoPointBegin(void)
{
  static locale_t plain;

  if (!plain) plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
  return plain ? (void *)uselocale(plain) : NULL;
}

void HycoPointEnd(void *before)
{
  if (before) (void)uselocale((locale_t)before);
}

/* strtod() stops at a point if the locale has a decimal comma: 0.5 would be read as 0. */
double HycoNumber(const char text[], char **end)
{
  void *before = HycoPointBegin();
  const double number = strtod(text, end);

  HycoPointEnd(before);
  return number;
}

/* In bytes; 0: not known. */
PetscReal HycoMachineMemory(void)
{
  const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);

  return pages > 0 && size > 0 ? (PetscReal)pages * (PetscReal)size : 0;
}

/* The factorisation makes BLAS allocate its buffers now, where a lack of memory can be reported. OpenBLAS ends the
   program without a message if it cannot have its buffers. */
PetscErrorCode HycoReserveBLAS(void)
{
  static PetscBool done;
  PetscScalar a[4] = {2, 1, 1, 2};
  PetscBLASInt two = 2, pivot[2], info;
  void *probe;

  PetscFunctionBegin;
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  /* Not malloc(), which fills the memory if MALLOC_PERTURB_ is set: 0.1 s. */
  probe = mmap(NULL, BLAS_BUFFER, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  HycoCheck(probe != MAP_FAILED, "not enough memory: BLAS needs %d MB of address space; raise the limit (ulimit -v)",
            (int)(BLAS_BUFFER >> 20));
  (void)munmap(probe, BLAS_BUFFER);
  LAPACKgetrf_(&two, &two, a, &two, pivot, &info);
  done = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
